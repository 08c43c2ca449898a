//! A point may be one by the currents of gmin alone: into a transistor that is turned off a current source drives a milliampere
//! through 1e-12 S, at 1e9 V. Where the same circuit has another point, that is the one which was meant.
//!
//! Such a voltage grows as gmin falls, and without gmin there is none. Between junctions that block, gmin only shares out what sources
//! give: there the voltages stay within those of the sources, whatever gmin is.
use super::Dc;
use crate::model::Kind;
use crate::newton::Options;
use crate::system::{Hanging, System, Work};
use crate::tolerances::Quantity;

/// What is left of gmin where it is asked what a point comes to without it. Not 0: nodes between junctions that block had no voltage.
const LESS: f64 = 1e-3;

impl Dc<'_> {
    /// Does the point x, with a conductance `shunt` to ground at every node, hang on gmin? Its factors are those of the last iteration.
    /// Somewhere gmin carries more than `abstol`, and with a thousandth of it the equations about x lead farther away than the largest
    /// voltage that there is.
    pub(super) fn hanging(&mut self, w: &mut Work, x: &[f64], shunt: f64, o: &Options) -> Option<Hanging> {
        let sys = self.sys;
        if sys.devices() == 0 && shunt == 0.0 {
            return None;
        }
        let gmin = w.gmin;
        let carried = carried(sys, w, x, shunt);
        let least = o.absolute.of(Quantity::Current, o.reltol);
        let node = |i: usize| sys.unknowns[i].kind == Kind::Node;
        if !(0..sys.n).any(|i| node(i) && carried[i].abs() > least) {
            return None;
        }
        self.residual.copy_from_slice(&carried);
        for i in (0..sys.n).filter(|&i| self.held[i].is_some()) {
            self.residual[i] = 0.0;
        }
        self.lu.solve(&mut self.residual);
        w.counters.solves += 1;
        // a voltage that runs away as 1/gmin changes by its own size for each such part of gmin; half of that is worth
        // a closer look
        if !(0..sys.n).any(|i| node(i) && self.residual[i].abs() > 0.5 * x[i].abs()) {
            return None;
        }
        w.gmin = LESS * gmin;
        sys.eval_jacobian(w, x, 0.0, false);
        self.assemble(w, x, LESS * shunt, None);
        w.gmin = gmin;
        self.hold(x);
        let solved = self.lu.factor_or_refactor(&self.matrix).is_ok();
        w.counters.factorisations += 1;
        if solved {
            self.lu.solve(&mut self.residual);
            w.counters.solves += 1;
        }
        let largest = (0..sys.n).filter(|&i| node(i)).map(|i| x[i].abs()).fold(0.0, f64::max);
        // where nothing can be solved, the largest voltage is the one that is told
        let away = |i: usize| if solved { self.residual[i].abs() } else { x[i].abs() };
        let farthest = (0..sys.n).filter(|&i| node(i)).max_by(|&i, &j| away(i).total_cmp(&away(j)))?;
        let far = !solved || !(away(farthest) <= largest);
        let most = carried.iter().enumerate().filter(|&(i, _)| node(i)).map(|(_, c)| c.abs()).fold(0.0, f64::max);
        far.then(|| Hanging { unknown: farthest, volts: x[farthest], amperes: most })
    }
}

/// The currents out of every node that gmin carries at x.
fn carried(sys: &System, w: &mut Work, x: &[f64], shunt: f64) -> Vec<f64> {
    let gmin = w.gmin;
    sys.eval(w, x, 0.0);
    let mut carried = w.f.clone();
    w.gmin = 0.0;
    sys.eval(w, x, 0.0);
    w.gmin = gmin;
    carried.iter_mut().zip(&w.f).for_each(|(with, without)| *with -= without);
    for i in (0..sys.n).filter(|&i| shunt > 0.0 && sys.unknowns[i].kind == Kind::Node) {
        carried[i] += shunt * x[i];
    }
    for s in sys.sums.iter().filter(|_| shunt > 0.0) {
        carried[s.root] += shunt * x[s.node];
    }
    carried
}
