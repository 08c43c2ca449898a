//! Junctions: what accounts want of them, and whether an iteration that calls itself solved can be believed.
use super::expand::Near;
use super::{across, System, Work};

/// A diode's current is that of a straight line to so much of itself, or of this [A].
const FITS: f64 = 1e-3;
const SMALL_CURRENT: f64 = 1e-9;
/// A row's own entry alone overrates what is left where others move with it; simplified Newton has to be able to get below it.
const MOST_BEHIND: f64 = 1e4;
/// The least that 1 - theta is taken for.
const NOTHING_LEFT: f64 = 1e-12;

impl System {
    /// For every diode: its number, junction voltage and current at x.
    pub fn each_diode(&self, w: &Work, x: &[f64], mut look: impl FnMut(usize, f64, f64)) {
        for (k, d) in self.diodes.iter().enumerate() {
            let v = across(x, d.p, d.n);
            look(k, v, d.kernel.eval(v, w.gmin).i);
        }
    }

    /// Energy that the charge of every diode holds at x [J].
    pub fn diode_energies(&self, w: &Work, x: &[f64]) -> Vec<f64> {
        self.diodes.iter().map(|d| d.kernel.energy(across(x, d.p, d.n), w.gmin)).collect()
    }

    /// Nodes that diodes have for themselves, behind their series resistances.
    pub fn behind_resistances(&self) -> impl Iterator<Item = usize> + '_ {
        self.diodes.iter().filter(|d| d.kernel.series_conductance().is_some()).map(|d| d.p as usize)
    }

    /// Would limiting let every junction go from its voltage at `from` to that at `to`?
    pub fn junctions_within_reach(&self, from: &[f64], to: &[f64]) -> bool {
        self.diodes.iter().all(|d| !d.kernel.limit(across(to, d.p, d.n), across(from, d.p, d.n)).1)
    }

    /// `stage_expand` at the next iterate; true when the currents of all diodes are those of the straight lines that led
    /// there.
    pub fn stage_expand_and_fit(&self, w: &mut Work, x: &[f64], t: f64, a: f64) -> bool {
        self.stage_expand_near(w, x, t, Near { a, reltol: 0.0, vntol: 0.0, share: FITS, least: SMALL_CURRENT })
    }

    /// Conductance and capacitance of every diode as the last Jacobian has them.
    pub fn slopes<'a>(&self, w: &'a Work) -> impl Iterator<Item = (f64, f64)> + 'a {
        w.expansions.iter().map(|e| (e.o.g, e.o.c))
    }

    /// What a simplified Newton iteration leaves behind, in units of its last update, that solves with a diode's slopes
    /// (g, c) of another state than x: theta / (1 - theta), theta being the difference of the conductances between its
    /// terminals over that which `matrix` = G + a C has there. An inductor drives its current into a diode that has
    /// turned off, and every update for a conducting one is a small part of what is missing.
    pub fn left_behind(&self, w: &Work, slopes: &[(f64, f64)], a: f64, matrix: &[f64], x: &[f64]) -> f64 {
        let mut worst = 0.0_f64;
        for (d, &(g, c)) in self.diodes.iter().zip(slopes) {
            let held = g + a * c;
            let o = d.kernel.eval(across(x, d.p, d.n), w.gmin);
            let theirs = o.g + a * o.c;
            // what else stands between the terminals: the two nodes' own conductances in series
            let rest = |slot: Option<usize>| slot.map_or(0.0, |k| 1.0 / (matrix[k] - held).max(1e-15 * held));
            let rest = 1.0 / (rest(d.slots[0]) + rest(d.slots[3])).max(1e-300);
            let theta = (theirs - held).abs() / (held + rest);
            worst = worst.max(theta / ((theirs.min(2.0 * held - theirs) + rest) / (held + rest)).max(NOTHING_LEFT));
        }
        worst
    }

    /// Do expressions have exponentials of unknowns?
    pub fn bends(&self) -> bool {
        self.exponential && !self.yielding.is_empty()
    }

    /// Can a conductance change by more than its own size within a step: are there diodes, or exponentials in expressions?
    pub fn turns(&self) -> bool {
        self.diodes() > 0 || self.bends()
    }

    /// Can the own conductance of a node, or what else an exponential makes, fall by orders of magnitude?
    pub fn yields(&self) -> bool {
        !self.yielding.is_empty()
    }

    /// `left_behind` of expressions, exponentials of anything or conductances of nodes (a wiper that leaves its end): theta from the rows' own entries, of the matrix (`gv`, `cv`) that the
    /// iteration solves with and of the derivatives at x. Where they have grown an iteration that is no good shows it by itself.
    pub fn bent_behind(&self, w: &mut Work, (gv, cv): (&[f64], &[f64]), a: f64, x: &[f64], t: f64) -> f64 {
        self.eval_jacobian(w, x, t, false);
        let theta = |&k: &usize| {
            let held = gv[k] + a * cv[k];
            (held - (w.gv[k] + a * w.cv[k])) / held
        };
        let worst = self.yielding.iter().map(theta).fold(0.0, f64::max);
        (worst / (1.0 - worst).max(NOTHING_LEFT)).min(MOST_BEHIND)
    }
}
