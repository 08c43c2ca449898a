//! A run whose steps somebody else takes (session/exchange.rs): it is told where these have led, and what happens there happens as behind
//! a step of its own.
use super::super::rows::Sink;
use super::super::Method;
use super::Run;
use crate::model::Law;
use crate::rounding::SAME;

impl<S: Sink> Run<'_, S> {
    /// Steps of somebody else's have led to x at t; conditions that are clear of their thresholds there are so from here on.
    pub fn stand(&mut self, t: f64, x: &[f64]) {
        (self.t, self.late) = (t, 0.0);
        self.x.copy_from_slice(x);
        self.tol.observe(x, t);
        self.sys.observe_flags(self.w, x, t);
    }

    /// An event where it stands, behind a step of this width: conditions that have `fired` turn, sources jump, what comes from outside
    /// has its new value, laws find their modes. True where a law did.
    pub fn occur(&mut self, method: &mut dyn Method, fired: &[usize], width: f64) -> bool {
        let t = self.t;
        self.sys.remember(self.w, &self.x, t);
        self.w.past.corner(t);
        self.w.counters.events += 1;
        // others keep time in another way: a corner as near as that is where the run stands
        if self.stop > t && self.stop - t <= SAME * t {
            self.t = self.stop;
        }
        let at = self.t;
        let (sys, events) = (self.sys, &mut self.outcome.events);
        sys.flip_edges(self.w, at, false, |k, on| events.push((at, k, on)));
        for &k in fired.iter().filter(|&&k| !sys.flags[k].law.of_modes()) {
            sys.flip(self.w, k);
            self.outcome.events.push((at, k, self.w.flags[k] != 0.0));
        }
        let modes = |w: &crate::system::Work| -> Vec<f64> {
            sys.flags.iter().zip(&w.flags).filter(|(f, _)| f.law.of_modes()).map(|(_, &v)| v).collect()
        };
        let before = modes(self.w);
        let asked = fired.iter().any(|&k| sys.flags[k].law == Law::Mode);
        if asked {
            self.decide(width, fired);
        }
        self.slopes_jump(method);
        self.stop = sys.next_stop(self.w, self.t, self.until);
        self.jump(width, method);
        self.restart(method);
        asked || before != modes(self.w)
    }

    /// Where a corner of a source or an edge lies ahead, if one does.
    pub fn next_corner(&self) -> Option<f64> {
        (self.stop < self.until).then_some(self.stop)
    }

    /// Where the stretch ends, and where what is known does.
    pub fn ends(&self) -> (f64, f64) {
        (self.stop, self.until)
    }

    /// Takes them back to what they were.
    pub fn end_at(&mut self, (stop, until): (f64, f64)) {
        (self.stop, self.until) = (stop, until);
        self.w.until(stop);
    }

    pub fn time(&self) -> f64 {
        self.t
    }

    /// Is there more to come than was said?
    pub fn reach(&mut self, t: f64) {
        if t >= self.until {
            self.until = 2.0 * t;
            self.lengthen(self.until);
            self.stop = self.sys.next_stop(self.w, t, self.until);
        }
    }
}
