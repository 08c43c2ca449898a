//! Dense output: the collocation polynomial of degree s through x0, X1 .. Xs, and the correction
//!
//!   (gamma / phi'(0)) e phi(theta),   phi' = (theta - c_1) .. (theta - c_s),   phi(0) = phi(1) = 0,
//!
//! which takes the slope at the start from that of the collocation polynomial to that of the solution and leaves the
//! slopes at the nodes: the error of the interior falls from O(h^(s+1)) to O(h^(s+2)).
use super::blend;
use super::tables::{Scheme, MOST};
use crate::multiversion::{by_lanes, whole, Lanes, One, LANES};
use std::sync::OnceLock;

/// What a scheme's polynomials are made from.
struct Basis {
    nodes: [f64; MOST + 1],       // 0, c_1 .. c_s
    barycentric: [f64; MOST + 1], // 1 / prod_k (node_j - node_k), over all of them
    stages: [f64; MOST],          // the same over c_1 .. c_s alone
    back: [f64; MOST],            // Lagrange's weights of the stages alone, at the start of the step
    fewer: [f64; MOST],           // the same of all stages but the first
    correction: [f64; MOST + 1],  // coefficients of phi / phi'(0), ascending from theta
    weakest: f64,                 // where `nodal` is largest
}

fn basis(scheme: &Scheme) -> &'static Basis {
    static KNOWN: [OnceLock<Basis>; 3] = [const { OnceLock::new() }; 3];
    KNOWN[scheme.rank()].get_or_init(|| {
        let m = scheme.s + 1;
        let mut nodes = [0.0; MOST + 1];
        nodes[1..m].copy_from_slice(scheme.c);
        let over = |nodes: &[f64], j: usize| -> f64 {
            (0..nodes.len()).filter(|&k| k != j).map(|k| nodes[j] - nodes[k]).product::<f64>().recip()
        };
        let barycentric = std::array::from_fn(|j| if j < m { over(&nodes[..m], j) } else { 0.0 });
        let stages: [f64; MOST] = std::array::from_fn(|j| if j < scheme.s { over(scheme.c, j) } else { 0.0 });
        let mut back = [0.0; MOST];
        lagrange(scheme.c, &stages, One::all(0.0), &mut back, 0, 1);
        let rest = &scheme.c[1..];
        let without: [f64; MOST] = std::array::from_fn(|j| if j < rest.len() { over(rest, j) } else { 0.0 });
        let mut fewer = [0.0; MOST];
        lagrange(rest, &without, One::all(0.0), &mut fewer, 0, 1);
        // phi'(t) / phi'(0) = product of (1 - t / c_i)
        let mut p = [0.0; MOST + 1];
        p[0] = 1.0;
        for (k, c) in scheme.c.iter().enumerate() {
            for m in (0..=k).rev() {
                p[m + 1] -= p[m] / c;
            }
        }
        let correction = std::array::from_fn(|k| p[k] / (k + 1) as f64);
        let size = |k: &usize| nodal(scheme, *k as f64 / 200.0).abs();
        let weakest = (0..200).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0) as f64 / 200.0;
        Basis { nodes, barycentric, stages, back, fewer, correction, weakest }
    })
}

/// l_j = w_j prod_{k != j} (theta - node_k), with w the barycentric weights of the nodes; the one of node j at j `width` + `at` of `l`.
#[inline(always)]
fn lagrange<L: Lanes>(nodes: &[f64], w: &[f64], theta: L, l: &mut [f64], at: usize, width: usize) {
    let mut product = L::all(1.0);
    for (j, node) in nodes.iter().enumerate() {
        (L::all(w[j]) * product).put(l, j * width + at);
        product = product * (theta - L::all(*node));
    }
    product = L::all(1.0);
    for (j, node) in nodes.iter().enumerate().rev() {
        let place = j * width + at;
        (L::at(l, place) * product).put(l, place);
        product = product * (theta - L::all(*node));
    }
}

/// Lagrange's weights at theta of the values at 0, c_1 .. c_s.
pub fn weights(scheme: &Scheme, theta: f64) -> [f64; MOST + 1] {
    let b = basis(scheme);
    let mut l = [0.0; MOST + 1];
    lagrange(&b.nodes[..=scheme.s], &b.barycentric, One::all(theta), &mut l, 0, 1);
    l
}

/// Numbers of all stages side by side.
pub const WIDTH: usize = whole(MOST);
/// Weights of the values at 0, c_1 .. c_s in turn, each at so many places at once.
pub type Table = [f64; (MOST + 1) * WIDTH];

by_lanes! {
    /// Lagrange's weights of the first `count` of these places.
    fn weights_at<L>(nodes: &[f64], w: &[f64], theta: &[f64; WIDTH], count: usize, table: &mut Table) {
        for at in (0..count).step_by(LANES) {
            lagrange(nodes, w, L::at(theta, at), &mut table[..], at, WIDTH);
        }
    }
}

/// Lagrange's weights of the stages alone, at the start of the step.
pub fn back(scheme: &Scheme) -> &'static [f64] {
    &basis(scheme).back[..scheme.s]
}

/// ... of all stages but the first.
pub fn back_without_first(scheme: &Scheme) -> &'static [f64] {
    &basis(scheme).fewer[..scheme.s - 1]
}

/// The polynomial through (0, x0), (c_1, X1) .. (1, Xs) at theta.
pub fn polynomial(scheme: &Scheme, theta: f64, x0: &[f64], stage: &[Vec<f64>], out: &mut [f64]) {
    blend::through(scheme, &weights(scheme, theta), x0, stage, out);
}

/// The polynomial that foretells: of the unknowns under d/dt the one above, extrapolated; of the others that through the
/// stages alone, since what a multiplier has at the start of a step belongs to another polynomial and to another order.
pub fn extrapolate(scheme: &Scheme, theta: f64, x0: &[f64], stage: &[Vec<f64>], moves: &[bool], out: &mut [f64]) {
    blend::foretold(scheme, (&weights(scheme, theta), &inside(scheme, theta)), x0, stage, moves, out);
}

/// The same at as many of these places as there are rows to be written.
pub fn extrapolate_each(
    scheme: &Scheme,
    theta: &[f64; WIDTH],
    x0: &[f64],
    stage: &[Vec<f64>],
    moves: &[bool],
    out: &mut [Vec<f64>],
) {
    let (b, mut all, mut inside) = (basis(scheme), [0.0; (MOST + 1) * WIDTH], [0.0; (MOST + 1) * WIDTH]);
    weights_at(&b.nodes[..=scheme.s], &b.barycentric, theta, out.len(), &mut all);
    weights_at(scheme.c, &b.stages, theta, out.len(), &mut inside);
    blend::foretold_each(scheme, (&all, &inside), x0, stage, moves, out);
}

/// Lagrange's weights of the stages alone.
pub fn inside(scheme: &Scheme, theta: f64) -> [f64; MOST] {
    let mut inside = [0.0; MOST];
    lagrange(scheme.c, &basis(scheme).stages, One::all(theta), &mut inside, 0, 1);
    inside
}

/// phi(theta) / phi'(0).
pub fn correction(scheme: &Scheme, theta: f64) -> f64 {
    basis(scheme).correction[..=scheme.s].iter().rev().fold(0.0, |sum, p| sum * theta + p) * theta
}

/// Integrals from 0 to 1/4, 1/2, 3/4, 1 of the polynomials l_j of degree s - 1 through the nodes; the last ones are b.
pub fn quarters(scheme: &Scheme) -> &'static [Vec<f64>] {
    static KNOWN: [OnceLock<Vec<Vec<f64>>>; 3] = [const { OnceLock::new() }; 3];
    KNOWN[scheme.rank()].get_or_init(|| {
        let s = scheme.s;
        let integral = |j: usize, theta: f64| -> f64 {
            // Gauss-Legendre's rule of order 8
            let gauss = [
                (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
                (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
            ];
            let l = |x: f64| {
                (0..s).filter(|&k| k != j).map(|k| (x - scheme.c[k]) / (scheme.c[j] - scheme.c[k])).product::<f64>()
            };
            0.5 * theta
                * gauss.iter().map(|(x, b)| b * (l(0.5 * theta * (1.0 - x)) + l(0.5 * theta * (1.0 + x)))).sum::<f64>()
        };
        (1..=4).map(|k| (0..s).map(|j| integral(j, 0.25 * f64::from(k))).collect()).collect()
    })
}

/// theta prod (theta - c_i), the error of the polynomial in units of the next divided difference.
pub fn nodal(scheme: &Scheme, theta: f64) -> f64 {
    scheme.c.iter().fold(theta, |product, c| product * (theta - c))
}

/// Where in the step that is largest.
pub fn weakest(scheme: &Scheme) -> f64 {
    basis(scheme).weakest
}

#[cfg(test)]
mod tests {
    use super::super::tables::SCHEMES;
    use super::*;

    #[test]
    fn correction_keeps_the_ends_and_the_slopes_at_the_nodes() {
        for scheme in SCHEMES {
            let f = |x| correction(scheme, x);
            assert!(f(0.0) == 0.0 && f(1.0).abs() < 1e-12);
            let slope = |x: f64| (f(x + 1e-5) - f(x - 1e-5)) / 2e-5;
            assert!((slope(0.0) - 1.0).abs() < 1e-6);
            for &c in scheme.c {
                assert!(slope(c).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn quarters_integrate_powers() {
        for scheme in SCHEMES {
            for (k, weights) in quarters(scheme).iter().enumerate() {
                let (theta, whole) = (0.25 * (k + 1) as f64, k == 3);
                // the whole step is of the method's own order 2s - 1
                for p in 0..if whole { 2 * scheme.s - 1 } else { scheme.s } {
                    let sum: f64 = weights.iter().zip(scheme.c).map(|(b, c)| b * c.powi(p as i32)).sum();
                    assert!((sum - theta.powi(p as i32 + 1) / (p + 1) as f64).abs() < 1e-14, "{} {k} {p}", scheme.s);
                }
            }
        }
    }

    /// u' = lambda u over one step, exactly solved: the order of the interior by halving the step.
    #[test]
    fn interior_has_order_s_plus_1_once_corrected() {
        for scheme in SCHEMES {
            let s = scheme.s;
            let error = |h: f64| {
                // stages of x' = x^2, x(0) = 1, by fixed-point iteration: D = h A f, that is A^-1 D = h f
                let mut x = vec![1.0; s];
                for _ in 0..200 {
                    let f: Vec<f64> = x.iter().map(|x| x * x).collect();
                    x = collocate(scheme, &f).iter().map(|d| 1.0 + h * d).collect();
                }
                let d: f64 = (0..s).map(|i| scheme.d[i] * (x[i] - 1.0)).sum();
                let e = (h + d) / scheme.gamma;
                let stage: Vec<Vec<f64>> = x.iter().map(|&x| vec![x]).collect();
                let theta = 0.5 * (scheme.c[0] + scheme.c[1]);
                let mut out = [0.0];
                polynomial(scheme, theta, &[1.0], &stage, &mut out);
                (out[0] + scheme.gamma * correction(scheme, theta) * e - 1.0 / (1.0 - theta * h)).abs()
            };
            let h = [0.2, 0.2, 0.3][scheme.rank()];
            let slope = (error(h) / error(h / 1.5)).ln() / 1.5_f64.ln();
            assert!(slope > s as f64 + 1.7 && slope < s as f64 + 3.5, "order {}: {slope}", 2 * scheme.s - 1);
        }
    }

    /// A f, from the integrals of the Lagrange polynomials through c_1 .. c_s.
    fn collocate(scheme: &Scheme, f: &[f64]) -> Vec<f64> {
        let s = scheme.s;
        let mut sum = vec![0.0; s];
        for j in 0..s {
            let mut p = vec![1.0];
            for m in (0..s).filter(|&m| m != j) {
                let scale = scheme.c[j] - scheme.c[m];
                let mut next = vec![0.0; p.len() + 1];
                for (k, v) in p.iter().enumerate() {
                    next[k + 1] += v / scale;
                    next[k] -= scheme.c[m] * v / scale;
                }
                p = next;
            }
            for (sum, &c) in sum.iter_mut().zip(scheme.c) {
                *sum +=
                    f[j] * p.iter().enumerate().map(|(k, v)| v * c.powi(k as i32 + 1) / (k + 1) as f64).sum::<f64>();
            }
        }
        sum
    }
}
