//! Operating points along a sweep of sources, each sought from the one before: the branch of a circuit with several solutions
//! is followed until it ends, and switches between their thresholds stay as they are.
use super::{initial, operating_point, polish, Dc, NoPoint};
use crate::newton::{Options, Tolerances};
use crate::system::{System, Work};

pub struct Sweep<'a> {
    pub sys: &'a System,
    pub options: &'a Options,
    pub tolerances: &'a Tolerances,
    pub statics: bool,
    /// numbers of the sources that are swept
    pub waves: &'a [usize],
    last: Option<Vec<f64>>, // their values at the last point
}

impl<'a> Sweep<'a> {
    pub fn new(
        sys: &'a System,
        options: &'a Options,
        tolerances: &'a Tolerances,
        statics: bool,
        waves: &'a [usize],
    ) -> Sweep<'a> {
        Sweep { sys, options, tolerances, statics, waves, last: None }
    }

    /// x and w are those of a point near the first one.
    pub fn begin_near(&mut self, values: &[f64]) {
        self.last = Some(values.to_vec());
    }

    /// The point with these values of the sources into `x`.
    pub fn to(&mut self, w: &mut Work, x: &mut Vec<f64>, values: &[f64]) -> Result<(), NoPoint> {
        w.dc = true;
        w.doubts.hanging = None;
        if self.last.is_none() || !self.follow(w, x, values) {
            self.set(w, values);
            let (fresh, flags) = (self.sys.work().held(), w.flags.clone());
            w.restore(&fresh);
            self.sys.inherit(w, &flags);
            *x = initial(self.sys);
            operating_point(self.sys, w, self.options, self.tolerances, self.statics, x)?;
            self.sys.remember(w, x, 0.0);
        }
        self.last = Some(values.to_vec());
        Ok(())
    }

    fn set(&self, w: &mut Work, values: &[f64]) {
        w.given = self.waves.iter().copied().zip(values.iter().copied()).collect();
        self.sys.touch_sources(w);
    }

    /// By Newton's method from the last point, in shorter stretches where the whole way is too far.
    fn follow(&self, w: &mut Work, x: &mut Vec<f64>, values: &[f64]) -> bool {
        let Some(from) = &self.last else { return false };
        let Ok(mut dc) = Dc::new(self.sys, !self.statics, false, self.options.reltol, x) else { return false };
        if !dc.pairs.is_empty() {
            return false; // a machine that comes to rest goes downhill, point by point
        }
        let (mut done, mut step) = (0.0, 1.0_f64);
        w.gmin = self.options.gmin;
        while done < 1.0 {
            let s = (done + step).min(1.0);
            let between: Vec<f64> = from.iter().zip(values).map(|(a, b)| a + (b - a) * s).collect();
            self.set(w, if s >= 1.0 { values } else { &between });
            let (held, mut trial) = (w.held(), x.clone());
            self.sys.update_flags(w, &trial, 0.0);
            let found = dc
                .newton(w, &mut trial, 0.0, None, self.tolerances, self.options.itl1)
                .and_then(|_| polish(&mut dc, w, &mut trial, self.tolerances, self.options));
            if found.is_ok() {
                if s >= 1.0 && dc.hanging(w, &trial, 0.0, self.options).is_some() {
                    return false; // there may be another one
                }
                *x = trial;
                self.sys.remember(w, x, 0.0);
                done = s;
                step *= 2.0;
            } else {
                w.restore(&held);
                step *= 0.25;
                // the shortest part of the way between two points of the sweep that is tried
                if step < 1e-3 {
                    return false;
                }
            }
        }
        true
    }
}
