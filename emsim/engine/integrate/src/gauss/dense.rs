//! Dense output: the polynomial through the last 2s points, of the method's order; with fixed steps the first one supplies
//! them by shorter steps from the same start. Else, while there are not so many, it goes through the stages (order s + 1),
//! and `interior` says so: there the driver ends a step at a row.
use super::super::interpolate;
use super::Gauss;
use crate::newton::Tolerances;
use crate::system::System;

impl Gauss {
    /// The 2s newest points, the candidate among them while there is one.
    fn points(&self) -> ([f64; 7], [&[f64]; 7], usize) {
        let accepted = self.past.t[0] == self.t1;
        let (mut ts, mut xs, mut len) = ([0.0; 7], [self.x1.as_slice(); 7], 1);
        ts[0] = self.t1;
        let extra = self.extra.iter().filter(|_| !accepted).map(|(t, x)| (*t, x.as_slice()));
        let past = (usize::from(accepted)..self.past.len).map(|j| (self.past.t[j], self.past.x[j].as_slice()));
        for (t, x) in extra.chain(past).take(2 * self.k.s) {
            (ts[len], xs[len]) = (t, x);
            len += 1;
        }
        (ts, xs, len)
    }

    pub(super) fn polynomial(&self, t: f64, out: &mut [f64]) {
        let (mut ts, mut xs, len) = self.points();
        let (m, k) = (2 * self.k.s, self.k);
        if len >= m {
            return interpolate(&ts[..m], &xs[..m], t, out);
        }
        // through both ends and the stages
        let accepted = self.past.t[0] == self.t1;
        let stages = if accepted { self.before.as_ref().map(|b| &b.1) } else { Some(&self.stage) };
        let mut m = len;
        if let Some(stages) = stages {
            for j in 0..k.s {
                (ts[2 + j], xs[2 + j]) = (ts[1] + k.c[j] * self.h, &stages[j]);
            }
            m = 2 + k.s;
        }
        interpolate(&ts[..m], &xs[..m], t, out);
    }

    /// What the polynomial lacks in the middle of the step, by one point more.
    pub(super) fn lacking(&self, sys: &System, tol: &Tolerances) -> f64 {
        let (ts, xs, len) = self.points();
        let m = 2 * self.k.s;
        if len < m + 1 {
            return f64::INFINITY;
        }
        let t = 0.5 * (ts[0] + ts[1]);
        let whole: f64 = ts[..m].iter().map(|tj| t - tj).product();
        let weight = |j: usize| (0..=m).filter(|&i| i != j).map(|i| ts[j] - ts[i]).product::<f64>().recip();
        let weights: Vec<f64> = (0..=m).map(|j| whole * weight(j)).collect();
        let mut worst = 0.0_f64;
        for i in sys.interpolated() {
            let error: f64 = weights.iter().zip(&xs).map(|(w, x)| w * x[i]).sum();
            worst = worst.max(error.abs() / tol.weight(i, xs[0][i], xs[1][i]));
        }
        worst
    }
}
