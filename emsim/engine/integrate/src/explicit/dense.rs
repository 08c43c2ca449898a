//! Dense output: the polynomial through the step's slopes and some stages more, and what the other unknowns are at its states.
use super::tableau::{combine, scaled, Tableau};
use super::Explicit;
use crate::multiversion::LANES;
use crate::newton::Tolerances;
use crate::reduced::{Point, Trouble};
use crate::tape::Sequence;
use std::cell::RefCell;

/// What dense output needs, made when it is first asked for.
pub struct Inside<'a> {
    point: Point,
    k: Vec<f64>, // the table of the tableau
    closed: Vec<f64>,
    sequence: Option<&'a Sequence>,
    ready: bool,
}

impl<'a> Explicit<'a> {
    fn insides(&self) -> &RefCell<Inside<'a>> {
        self.inside.get_or_init(|| {
            RefCell::new(Inside {
                point: self.reduced.point(&self.point.flags, self.reduced.gmin(&self.point), self.point.floor.clone()),
                k: vec![0.0; self.method.size(self.width)],
                closed: Vec::new(),
                sequence: self.method.inside(self.reduced),
                ready: false,
            })
        })
    }

    /// Another step is attempted.
    pub(super) fn outdate(&mut self) {
        if let Some(inside) = self.inside.get_mut() {
            inside.get_mut().ready = false;
        }
    }

    /// Stages and coefficients of the dense output of this step.
    fn prepare_dense(&self, inside: &mut Inside) -> Result<(), Trouble> {
        let (m, width, s, h, method) = (self.m, self.width, self.method.stages, self.h, self.method);
        let Inside { point, k, sequence, ready, .. } = inside;
        point.flags.copy_from_slice(&self.point.flags);
        self.reduced.set_gmin(point, self.reduced.gmin(&self.point));
        let (known, y0) = ((s + 1) * width, method.y0() * width);
        let times = |i: usize| self.t0 + method.c[s + 1 + i] * h;
        k[..known].copy_from_slice(&self.k[..known]);
        let mut done = false;
        if let Some(sequence) = sequence {
            if let Some(mut stages) = self.reduced.stages(point, method.extra.len()) {
                k[y0..y0 + width].copy_from_slice(&self.y0);
                let from = method.h(width);
                k[from] = h;
                for i in 0..method.extra.len() {
                    k[from + 1 + i] = times(i);
                }
                stages.run_sequence(sequence, k);
                self.reduced.finite(&k[known..y0])?;
                done = true;
            }
        }
        let (k, r) = k.split_at_mut(y0 + Tableau::DENSE * width);
        if !done {
            for (i, row) in method.extra.iter().enumerate() {
                let y = &mut r[..width];
                combine(y, &self.y0, h, row, k);
                self.reduced.y(point).copy_from_slice(&y[..m]);
                let k = &mut k[known + i * width..][..m];
                self.reduced.rates(point, &self.sys.waves, times(i), false, k)?;
            }
            for (row, r) in method.dense.iter().zip(r[3 * width..].chunks_exact_mut(width)) {
                scaled(r, h, row, k);
            }
        }
        for i in 0..width {
            let dy = self.y1[i] - self.y0[i];
            let (f0, f1) = (k[i], k[s * width + i]);
            r[i] = dy;
            r[width + i] = h * f0 - dy;
            r[2 * width + i] = 2.0 * dy - h * (f0 + f1);
        }
        *ready = true;
        Ok(())
    }

    /// The same where it is not ready: was it?
    fn prepared(&self, inside: &mut Inside) -> Result<bool, Trouble> {
        let ready = inside.ready;
        if !ready {
            self.reduced.start_from(&mut inside.point, &self.x1);
            self.prepare_dense(inside)?;
        }
        Ok(ready)
    }

    /// The unknowns at t in the step.
    pub(super) fn inside(&self, t: f64, out: &mut [f64]) -> Result<(), Trouble> {
        let mut inside = self.insides().borrow_mut();
        let inside = &mut *inside;
        if self.prepared(inside)? {
            inside.point.keep_factors();
        }
        let theta = (t - self.t0) / self.h;
        let terms = &inside.k[(self.method.y0() + Tableau::DENSE) * self.width..];
        let factors = [theta, 1.0 - theta];
        for (first, y) in (0..).step_by(LANES).zip(self.reduced.y(&mut inside.point).chunks_mut(LANES)) {
            let mut sum = [0.0; LANES];
            for k in (0..self.method.terms()).rev() {
                let r = &terms[k * self.width + first..][..LANES];
                sum = std::array::from_fn(|i| (sum[i] + r[i]) * factors[k % 2]);
            }
            let y0 = &self.y0[first..first + LANES];
            y.iter_mut().zip(sum.iter().zip(y0)).for_each(|(y, (sum, y0))| *y = sum + y0);
        }
        // the polynomial of high order opens loops by ten times what the ends of steps are wrong by: closed with the factors of
        // the first row, which is in the same step
        if self.projects && !self.method.extra.is_empty() {
            let (point, closed) = (&mut inside.point, &mut inside.closed);
            closed.clear();
            closed.extend_from_slice(self.reduced.y(point));
            self.reduced.close_gently(point, &self.sys.waves, t, closed, self.rounding());
            self.reduced.y(point).copy_from_slice(closed);
        }
        self.reduced.arrive(&mut inside.point, &self.sys.waves, t, false, None, out)
    }

    /// The size of the polynomial's last term in units of the tolerance; infinite where there is none.
    pub(super) fn last_term(&mut self, tol: &Tolerances) -> f64 {
        if self.prepared(&mut self.insides().borrow_mut()).is_err() {
            return f64::INFINITY;
        }
        let Some(inside) = self.inside.get_mut().map(RefCell::get_mut) else { return f64::INFINITY };
        // what the state means to the unknowns is that of the new point
        self.reduced.y(&mut inside.point).copy_from_slice(&self.y1[..self.m]);
        let (point, waves, t1) = (&mut inside.point, &self.sys.waves, self.t0 + self.h);
        if self.reduced.arrive(point, waves, t1, true, None, &mut self.ex).is_err() {
            return f64::INFINITY;
        }
        // largest where theta = 1/2
        let terms = self.method.terms();
        let most = 0.5_f64.powi(terms as i32);
        let last = &inside.k[(self.method.y0() + Tableau::DENSE + terms - 1) * self.width..][..self.m];
        self.e.iter_mut().zip(last).for_each(|(e, r)| *e = most * r);
        self.reduced.changes(&mut inside.point, &self.e[..self.m], &mut self.ex);
        tol.largest_error(&self.ex, &self.x1, &self.x0)
    }
}
