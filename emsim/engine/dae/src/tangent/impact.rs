//! Impacts beside: at the moved time the same one is solved with the other values, from the state that has come there. What the
//! charges and momenta behind it differ by is their derivative along the impact; it is taken back to the run's own time where Y goes
//! on, Y+ = dQ+/dp + F+ dtau/dp. Everything that `Modes` knows is in it: friction, several bodies, Poisson's law.
use super::{Refused, Tangent};
use crate::model::{Form, LawSpec};
use crate::modes::{Modes, Short, INSTANT};
use crate::system::{System, Work};

impl Tangent {
    /// Has something hit, between these flags and those of w? What hits is counted.
    pub(super) fn strikes(&self, sys: &System, w: &Work) -> bool {
        let hit = |law: &LawSpec| law.form != Form::Relay && self.flags[law.hits()] != w.flags[law.hits()];
        sys.laws.list.iter().any(hit)
    }

    /// Y becomes the derivative of what is stored behind the impact, along with its time, which moves so. `w` holds the flags behind it.
    pub(super) fn strike(&mut self, sys: &System, w: &Work, t: f64, moves: &[f64]) -> Result<(), Refused> {
        let changed = |law: &&LawSpec| law.flags.iter().any(|&k| self.flags[k] != w.flags[k]);
        let fired: Vec<usize> = sys.laws.list.iter().filter(changed).map(|law| law.flags[0]).collect();
        let width = self.last;
        let least = (INSTANT * width).max(64.0 * f64::EPSILON * t).max(1e-18 * self.span);
        let short = Short::new(width, least, 2.0 * self.tol.reltol * width, self.span);
        self.y.iter_mut().for_each(|y| y.fill(0.0));
        for b in &mut self.besides {
            let moved = moves[b.parameter];
            let along = self.x.iter().zip(&self.s[b.parameter]).zip(&self.slopes);
            let mut x: Vec<f64> = along.map(|((x, s), slope)| x + b.by * (s + slope * moved)).collect();
            let mut at = b.stretch.when(self.at) + b.by * moved * b.stretch.pace();
            b.sys.put_floors(&mut b.w, &self.tol.atol);
            b.w.until(f64::INFINITY);
            let decided = Modes::new(&b.sys)
                .is_some_and(|mut modes| modes.decide(&b.sys, &mut b.w, &mut x, &mut at, short, &fired, &self.tol));
            let same = |law: &LawSpec| {
                let kept = if law.form == Form::Relay { law.slides() } else { law.hits() };
                [law.flags[0], kept].iter().all(|&k| b.w.flags[k] == w.flags[k])
            };
            if let Some(other) = sys.laws.list.iter().find(|law| !(decided && same(law))) {
                return Err(Refused::Impact { t, flag: other.flags[0] });
            }
            b.sys.eval(&mut b.w, &x, at);
            self.y[b.parameter].iter_mut().zip(&b.w.q).for_each(|(y, q)| *y += b.weight * q);
        }
        Ok(())
    }
}
