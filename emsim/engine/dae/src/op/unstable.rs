//! Does a rest stay? Small departures from a point go as exp(s t) with the eigenvalues s of the pencil, G v + s C v = 0. One to the right
//! of the imaginary axis leads away from there.
//!
//! 1. By what the deck stores: steps of the trapezoidal rule, (a C + G) v' = (a C - G) v, multiply a mode by (a + s)/(a - s), more than 1
//!    where Re s > 0, most where a is near |s|. So some steps with each a of a ladder leave the fastest growing mode alone, or
//!    nothing that grows: mu of that mode, or the two of a pair, are fitted to the last three vectors, and give s. It counts from an a
//!    beside |s|, and where the steps grew: far from there mu is near 1 or -1 for every mode, and roundings decide on which side.
//! 2. Where nothing is stored, whatever stores a little at the nodes: det(G + c s) of a large s and that of 0 have different signs, so there
//!    is a positive root between, whatever the capacitances are (Green and Willson 1992).
//!
//! What is passive is not asked, nor is a machine, which has `.op static` and W241, nor what is late.
use super::{balanced, Dc};
use crate::model::Kind;
use crate::newton::{Options, Tolerances};
use crate::system::{System, Unstable, Work};

/// Steps with each a, the first of them by Euler's rule, which leaves nothing of what follows at once.
const STEPS: usize = 200;
const EULER: usize = 3;
/// From a to the next one.
const APART: f64 = 10.0;
/// What is left of the last vector beside the fitted mode, and the least Re s / |s| that counts: rounding has less.
const LEFT: f64 = 1e-3;

/// Of x at t, if it is a rest at all: all is balanced without a change of what is stored. w has its conditions.
pub fn unstable(sys: &System, w: &mut Work, x: &[f64], t: f64, o: &Options, tol: &Tolerances) -> Option<Unstable> {
    let mut dc = resting(sys, w, x, t, o, tol)?;
    dc.fastest(w).or_else(|| dc.turns_over(w))
}

/// Of the point where a run starts, by (2) alone, which takes two factorisations: is it left by way of a rounding?
pub fn falls_over(sys: &System, w: &mut Work, x: &[f64], o: &Options, tol: &Tolerances) -> Option<Unstable> {
    resting(sys, w, x, 0.0, o, tol)?.turns_over(w).map(|found| Unstable { at_start: true, ..found })
}

/// The equations linearised at a rest; None where it is none, or is not asked.
fn resting<'a>(sys: &'a System, w: &mut Work, x: &[f64], t: f64, o: &Options, tol: &Tolerances) -> Option<Dc<'a>> {
    // larger systems are not asked
    let asked = !sys.passive && sys.n <= 500 && sys.delays.list.is_empty() && sys.logic.is_empty();
    if !asked || sys.unknowns.iter().any(|u| u.kind.mechanical()) {
        return None;
    }
    let dc = Dc::new(sys, true, false, o.reltol, x).ok()?;
    w.gmin = o.gmin;
    balanced(&dc, w, x, t, tol, o).ok()?;
    Some(dc)
}

impl Dc<'_> {
    /// Factors of G + a C, with a conductance to ground at every node.
    fn factor_pencil(&mut self, w: &Work, a: f64, shunt: f64) -> Option<()> {
        self.matrix.fill(0.0);
        for (k, &at) in self.place.iter().enumerate() {
            self.matrix[at] += w.gv[k] + a * w.cv[k];
        }
        let sys = self.sys;
        (0..sys.n)
            .filter(|&i| shunt > 0.0 && sys.unknowns[i].kind == Kind::Node)
            .for_each(|i| self.lead(i, shunt, 0.0));
        self.lu.factor_or_refactor(&self.matrix).ok()
    }

    /// From where to where the ladder of a goes: what holds a quantity beside what stores it, row by row.
    fn ladder(&self, w: &Work) -> impl Iterator<Item = f64> {
        let (sys, mut sums) = (self.sys, vec![(0.0_f64, 0.0_f64); self.sys.n]);
        for (k, &row) in sys.pattern.rowidx.iter().enumerate() {
            sums[row].0 += w.gv[k].abs();
            sums[row].1 += w.cv[k].abs();
        }
        let rates = sums.iter().filter(|s| s.0 > 0.0 && s.1 > 0.0).map(|s| s.0 / s.1);
        let (lo, hi) = rates.fold((f64::INFINITY, 0.0_f64), |(lo, hi), r| (lo.min(r), hi.max(r)));
        std::iter::successors(Some(lo), |a| Some(APART * a)).take_while(move |&a| a < APART * hi)
    }

    fn fastest(&mut self, w: &Work) -> Option<Unstable> {
        let ladder: Vec<f64> = self.ladder(w).collect();
        let found: Vec<Unstable> = ladder.into_iter().filter_map(|a| self.growing(w, a)).collect();
        found.into_iter().max_by(|a, b| a.s.0.total_cmp(&b.s.0))
    }

    /// c = C v
    fn stored(&self, w: &Work, v: &[f64], c: &mut [f64]) {
        c.fill(0.0);
        let pattern = &self.sys.pattern;
        for (col, v) in v.iter().enumerate() {
            for k in pattern.colptr[col]..pattern.colptr[col + 1] {
                c[pattern.rowidx[k]] += w.cv[k] * v;
            }
        }
    }

    /// The mode that is left after steps with this a, if it grows.
    fn growing(&mut self, w: &Work, a: f64) -> Option<Unstable> {
        self.factor_pencil(w, a, 0.0)?;
        // all directions, none of them a mode of a symmetric circuit
        let mut v: Vec<f64> = (0..self.sys.n).map(|i| 0.5 + (0.618_033_988_749_895 * (i + 1) as f64).fract()).collect();
        let mut last: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; v.len()]);
        let mut next = vec![0.0; v.len()];
        self.stored(w, &v, &mut last[2]);
        let mut grown = 0.0; // over the second half of the steps, ln
        for step in 0..STEPS {
            let size = last[2].iter().map(|c| c * c).sum::<f64>().sqrt();
            if !(size > 0.0 && size.is_finite()) {
                return None;
            }
            // of the last three, which are compared, none is scaled by itself
            let scale = if step + 3 < STEPS { size } else { 1.0 };
            if (STEPS / 2..STEPS - 3).contains(&step) {
                grown += size.ln();
            }
            next.iter_mut().zip(&last[2]).for_each(|(next, c)| *next = a * c / scale);
            self.lu.solve(&mut next);
            // (a C - G) v = 2 a C v - (a C + G) v
            let implicit = step < EULER;
            for (v, next) in v.iter_mut().zip(&next) {
                *v = if implicit { *next } else { 2.0 * next - *v / scale };
            }
            last.rotate_left(1);
            self.stored(w, &v, &mut last[2]);
        }
        let s = rate(&last, a).filter(|s| grown > 0.0 && (s.0.hypot(s.1) / a).ln().abs() < APART.ln())?;
        let node = |i: &usize| self.sys.unknowns[*i].kind == Kind::Node;
        let unknown = (0..self.sys.n).filter(node).max_by(|&i, &j| v[i].abs().total_cmp(&v[j].abs()))?;
        Some(Unstable { unknown, s, at_start: false })
    }

    /// Has the determinant another sign than with large conductances to ground?
    fn turns_over(&mut self, w: &Work) -> Option<Unstable> {
        if self.sys.devices() == 0 {
            return None; // sums and gains of blocks are no circuit that takes time
        }
        // a conductance at every node above all others [S]
        self.factor_pencil(w, 0.0, 1e12)?;
        let held = self.lu.negative();
        self.factor_pencil(w, 0.0, 0.0)?;
        if self.lu.negative() == held {
            return None;
        }
        // what hangs most on a current from somewhere
        let mut v: Vec<f64> = (0..self.sys.n).map(|i| 0.5 + (0.618_033_988_749_895 * (i + 1) as f64).fract()).collect();
        let node = |i: &usize| self.sys.unknowns[*i].kind == Kind::Node;
        (0..self.sys.n).filter(|i| !node(i)).for_each(|i| v[i] = 0.0);
        self.lu.solve(&mut v);
        let unknown = (0..self.sys.n).filter(node).max_by(|&i, &j| v[i].abs().total_cmp(&v[j].abs()))?;
        Some(Unstable { unknown, s: (0.0, 0.0), at_start: false })
    }
}

/// s of one mode or of a pair, by least squares of u2 = p u1 + q u0 whose solutions are mu = (a + s)/(a - s); where it grows.
fn rate(u: &[Vec<f64>; 3], a: f64) -> Option<(f64, f64)> {
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let (u00, u01, u11) = (dot(&u[0], &u[0]), dot(&u[0], &u[1]), dot(&u[1], &u[1]));
    let (u02, u12, u22) = (dot(&u[0], &u[2]), dot(&u[1], &u[2]), dot(&u[2], &u[2]));
    let det = u00 * u11 - u01 * u01;
    let one = det <= LEFT * LEFT * u00 * u11; // the vectors are parallel: one mode
    let (p, q) = if one { (u12 / u11, 0.0) } else { ((u12 * u00 - u02 * u01) / det, (u02 * u11 - u12 * u01) / det) };
    let left: f64 = u
        .iter()
        .map(Vec::len)
        .min()
        .map_or(0.0, |n| (0..n).map(|i| (u[2][i] - p * u[1][i] - q * u[0][i]).powi(2)).sum());
    if !(left <= LEFT * LEFT * u22) {
        return None;
    }
    // mu^2 = p mu + q
    let half = 0.5 * p;
    let d = half * half + q;
    let roots = if one {
        [(p, 0.0); 2]
    } else if d >= 0.0 {
        [(half + d.sqrt(), 0.0), (half - d.sqrt(), 0.0)]
    } else {
        [(half, (-d).sqrt()); 2]
    };
    let s = roots.map(|(re, im)| {
        // a (mu - 1)/(mu + 1)
        let below = (re + 1.0).powi(2) + im * im;
        (a * ((re - 1.0) * (re + 1.0) + im * im) / below, a * 2.0 * im / below)
    });
    // of two real ones that which is left: the other may be rounding
    let [near, far] = roots.map(|(re, _)| (re - u12 / u11).abs());
    let fastest = if near <= far { s[0] } else { s[1] };
    (fastest.0 > LEFT * fastest.0.hypot(fastest.1)).then_some(fastest)
}
