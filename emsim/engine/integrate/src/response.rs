//! What one step of a method does to an undamped oscillation: R(j y) with y = w h, to be compared with exp(j y).
//!
//!   |R| < 1         takes amplitude: -ln |R| a step
//!   arg R < y       is late: (y - arg R)/(2 pi) periods a step
//!
//! Small y, as a check (loss, lateness): trapezoid 0, y^3/12; BDF1 y^2/2, y^3/3; BDF2 y^4/4, y^3/3; Radau IIA of 3 stages
//! y^6/7200, y^7/... .
use crate::sparse::{Complex, Scalar};

/// The Pade approximant of exp(z) with degrees j over k, at z = j y (Hairer and Wanner II, section IV.3).
/// Trapezoid 1/1, Gauss of s stages s/s, Radau IIA of s stages s-1/s.
pub fn pade(j: usize, k: usize, y: f64) -> Complex {
    let z = Complex::new(0.0, y);
    let half = |own: usize, z: Complex| {
        let (mut sum, mut power, mut c) = (Complex::ONE, Complex::ONE, 1.0);
        for i in 1..=own {
            c *= (own + 1 - i) as f64 / ((j + k + 1 - i) * i) as f64;
            power *= z;
            sum += power.scale(c);
        }
        sum
    };
    half(j, z) / half(k, -z)
}

/// The principal root of BDF of order k with equal steps, with a share of the next term:
/// sum_{m=1..k} u^m/m + next u^{k+1}/(k+1) = z,  u = 1 - 1/R.
pub fn bdf(k: usize, next: f64, y: f64) -> Complex {
    let z = Complex::new(0.0, y);
    let mut u = Complex::ONE - Complex::new(y.cos(), -y.sin());
    for _ in 0..20 {
        let (mut value, mut slope, mut power) = (-z, Complex::ZERO, Complex::ONE);
        for m in 1..=k + 1 {
            let share = if m > k { next } else { 1.0 };
            slope += power.scale(share);
            power *= u;
            value += power.scale(share / m as f64);
        }
        let step = value / slope;
        u -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    Complex::ONE / (Complex::ONE - u)
}

/// Of BDF of order k on the points `t`, newest first, with a share of the next order's formula: D(s), the derivative that it finds of
/// exp(s t) at t_0, is to be j w; by one Newton step from s = j w, what amplitude (ln) and phase lose a second. With unequal steps
/// and changing orders the mean of that over the steps holds, where the principal root for equal ones is off by a factor of three.
pub fn bdf_drift(k: usize, next: f64, t: &[f64], w: f64) -> Option<(f64, f64)> {
    let (mut value, mut slope) = (Complex::new(0.0, -w), Complex::ZERO);
    for (order, share) in [(k, 1.0 - next), (k + 1, next)] {
        if share == 0.0 {
            continue;
        }
        let t = t.get(..=order)?;
        for j in 1..=order {
            let back = t[j] - t[0];
            let others = (1..=order).filter(|&m| m != j);
            let l = share * others.map(|m| (t[0] - t[m]) / (t[j] - t[m])).product::<f64>() / back;
            let (s, c) = (w * back).sin_cos();
            value += Complex::new(l * (c - 1.0), l * s);
            slope += Complex::new(l * back * c, l * back * s);
        }
    }
    let off = value / slope;
    Some((off.re, off.im)).filter(|(loss, late)| loss.is_finite() && late.is_finite())
}

/// Any Runge-Kutta method whose stages follow one another: X_i = 1 + z sum_j a_ij X_j, row by row as pairs (j, a_ij). The last
/// row is the new point: that of the last stage of a stiffly accurate method, else the weights.
pub fn stages(rows: impl Iterator<Item = impl Iterator<Item = (usize, f64)>>, y: f64) -> Complex {
    let z = Complex::new(0.0, y);
    let mut x: Vec<Complex> = Vec::new();
    for (i, row) in rows.enumerate() {
        let (mut known, mut own) = (Complex::ONE, 0.0);
        for (j, a) in row {
            if j == i {
                own = a;
            } else {
                known += (z * x[j]).scale(a);
            }
        }
        x.push(known / (Complex::ONE - z.scale(own)));
    }
    x.last().copied().unwrap_or(Complex::ONE)
}

/// Loss of amplitude, ln, and lateness in radians, of one step.
pub fn of(r: Complex, y: f64) -> (f64, f64) {
    // arg R within half a turn of y
    let (s, c) = (-y).sin_cos();
    let behind = r * Complex::new(c, s);
    (-r.abs().max(1e-300).ln(), -behind.im.atan2(behind.re))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64, share: f64) {
        assert!((a - b).abs() <= share * b.abs().max(1e-300), "{a} {b}");
    }

    #[test]
    fn leading_terms() {
        let y = 0.02;
        let (loss, late) = of(pade(1, 1, y), y);
        assert!(loss.abs() < 1e-15);
        near(late, y.powi(3) / 12.0, 1e-3);
        let (loss, late) = of(bdf(1, 0.0, y), y);
        near(loss, y * y / 2.0, 1e-3);
        near(late, y.powi(3) / 3.0, 1e-3);
        let (loss, late) = of(bdf(2, 0.0, y), y);
        near(loss, y.powi(4) / 4.0, 1e-2);
        near(late, y.powi(3) / 3.0, 1e-2);
        // Radau IIA of 3 stages: order 5, and |R|^2 = 1 - y^6/3600
        near(of(pade(2, 3, 0.3), 0.3).0, 0.3_f64.powi(6) / 7200.0, 0.05);
        near(of(pade(3, 3, 1.0), 1.0).0.abs() + 1.0, 1.0, 1e-14);
    }

    #[test]
    fn bdf_on_equal_steps() {
        let y = 0.05;
        for (k, next) in [(1, 0.0), (2, 0.0), (3, 0.0), (4, 0.0), (5, 0.0), (1, 0.4), (2, 0.5), (3, 0.3)] {
            let t: Vec<f64> = (0..=k + 1).map(|j| -y * j as f64).collect();
            let (loss, late) = bdf_drift(k, next, &t, 1.0).unwrap();
            let (want_loss, want_late) = of(bdf(k, next, y), y);
            near(y * loss, want_loss, 0.1);
            near(y * late, want_late, 0.1);
        }
    }

    /// All of the next order's term is the next order.
    #[test]
    fn shares_lead_from_one_order_to_the_next() {
        for k in 1..5 {
            let t: Vec<f64> = [0.0, 0.1, 0.25, 0.3, 0.5, 0.7, 0.75].iter().map(|t| -t).collect();
            assert!((bdf(k, 1.0, 0.2) - bdf(k + 1, 0.0, 0.2)).abs() < 1e-14);
            let (one, other) = (bdf_drift(k, 1.0, &t, 1.0).unwrap(), bdf_drift(k + 1, 0.0, &t, 1.0).unwrap());
            near(one.0, other.0, 1e-9);
            near(one.1, other.1, 1e-9);
        }
    }

    #[test]
    fn stages_of_known_methods() {
        for y in [0.1, 1.0, 10.0] {
            // the trapezoid, backward Euler, the classical Runge-Kutta method
            let of = |rows: &[&[(usize, f64)]]| stages(rows.iter().map(|r| r.iter().copied()), y);
            assert!((of(&[&[], &[(0, 0.5), (1, 0.5)]]) - pade(1, 1, y)).abs() < 1e-14);
            assert!((of(&[&[(0, 1.0)]]) - bdf(1, 0.0, y)).abs() < 1e-12);
            let weights = [(0, 1.0 / 6.0), (1, 1.0 / 3.0), (2, 1.0 / 3.0), (3, 1.0 / 6.0)];
            let rk = of(&[&[], &[(0, 0.5)], &[(1, 0.5)], &[(2, 1.0)], &weights]);
            let want = Complex::new(1.0 - y * y / 2.0 + y.powi(4) / 24.0, y - y.powi(3) / 6.0);
            assert!((rk - want).abs() < 1e-11 * want.abs());
        }
    }
}
