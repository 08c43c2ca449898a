//! Where the steps begin: the slope there, what x is behind a jump, and the length of the first step, from the size of slopes and of
//! what they change by.
//!
//! As in Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.4: with d1 the slopes at the start and d2 what they
//! change by over an explicit Euler step of little length, over that length, both in units of the tolerance,
//! h = (`CHANGE` / max(d1, d2))^(1/p), and no more than a hundred times that little step. Their step is one that changes the solution by a
//! hundredth of its size, which is unknown for what begins at 0; ours is what the driver takes for short enough.
use super::{combine, local, Explicit, Tolerances};
use crate::reduced::{Point, Reduced, Trouble};
use crate::rounding::SAME;
use crate::system::{System, Work};

const CHANGE: f64 = 0.01; // h^p times the larger of d1 and d2 (ibid., step e)
const AT_MOST: f64 = 100.0; // of the little step (ibid., step f)

/// Puts a point where the states have what x has, with flags as they are now.
pub(crate) fn place(reduced: &Reduced, point: &mut Point, sys: &System, w: &mut Work, (t, x): (f64, &[f64])) {
    sys.eval(w, x, t);
    point.flags.copy_from_slice(&w.flags);
    reduced.set_gmin(point, w.gmin);
    reduced.start(point, &w.q, x);
}

impl Explicit<'_> {
    /// The slope at the start.
    pub(super) fn start(&mut self, sys: &System, w: &mut Work) -> Result<(), Trouble> {
        place(self.reduced, &mut self.point, sys, w, (self.t0, &self.x0));
        self.y0[..self.m].copy_from_slice(self.reduced.y(&mut self.point));
        self.reduced.rates(&mut self.point, &sys.waves, self.t0, false, &mut self.k[..self.m])?;
        self.started = true;
        Ok(())
    }

    /// What x is at t + h behind a jump at t, into `ex`: a step of Euler's method; where h is 0, at t itself. False where so short a step
    /// is too long for what has become fast there (a coil cut off by 1e12 ohm): the slope at its end is another one.
    pub(super) fn step_over_jump(
        &mut self,
        sys: &System,
        w: &mut Work,
        t: f64,
        h: f64,
        x: &[f64],
    ) -> Result<bool, Trouble> {
        place(self.reduced, &mut self.point, sys, w, (t, x));
        let (point, waves, m) = (&mut self.point, &sys.waves, self.m);
        if h == 0.0 {
            self.reduced.arrive(point, waves, t, false, None, &mut self.ex)?;
            return Ok(true);
        }
        let (before, after) = self.k.split_at_mut(self.width);
        self.reduced.rates(point, waves, t, false, &mut before[..m])?;
        for (y, k) in self.reduced.y(point).iter_mut().zip(&*before) {
            *y += h * k;
        }
        self.reduced.arrive(point, waves, t + h, false, Some(&mut after[..m]), &mut self.ex)?;
        for ((e, before), after) in self.e.iter_mut().zip(&*before).zip(&after[..m]) {
            *e = h * (after - before);
        }
        self.reduced.changes(&mut self.point, &self.e[..m], &mut self.difference);
        let mut unknowns = self.difference.iter().zip(&self.ex).zip(&self.point.floor);
        Ok(unknowns.all(|((change, x), floor)| change.abs() <= SAME * x.abs() + floor))
    }

    /// Longer than `little`, if that can be seen.
    pub(super) fn first_length(&mut self, little: f64, tol: &Tolerances) -> Result<f64, Trouble> {
        let (m, width) = (self.m, self.width);
        let share = local(self.method, tol.reltol);
        self.reduced.changes(&mut self.point, &self.k[..m], &mut self.ex);
        let d1 = tol.largest_error(&self.ex, &self.x0, &self.x0) / share;
        if !(d1 > 0.0 && d1.is_finite()) {
            return Ok(little);
        }
        combine(&mut self.y1, &self.y0, little, &[(0, 1.0)], &self.k);
        self.reduced.y(&mut self.point).copy_from_slice(&self.y1[..m]);
        let (start, moved) = self.k.split_at_mut(width);
        self.reduced.rates(&mut self.point, &self.sys.waves, self.t0 + little, false, &mut moved[..m])?;
        for ((e, f1), f0) in self.e.iter_mut().zip(&moved[..m]).zip(&*start) {
            *e = f1 - f0;
        }
        self.reduced.changes(&mut self.point, &self.e[..m], &mut self.ex);
        let d2 = tol.largest_error(&self.ex, &self.x0, &self.x0) / share / little;
        let h = (CHANGE / d1.max(d2)).powf(1.0 / f64::from(self.method.order));
        Ok(if h.is_finite() { h.clamp(little, AT_MOST * little) } else { little })
    }
}
