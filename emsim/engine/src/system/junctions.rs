//! Junctions: what accounts want of them, whether an iteration that calls itself solved can be believed, how long they remember.
use super::expand::{DiodeSlot, Near};
use super::{across, System, Work};

/// A diode's current is that of a straight line to so much of itself, or of this [A].
const FITS: f64 = 1e-3;
const SMALL_CURRENT: f64 = 1e-9;
/// A junction's straight line is good for so much of what its current is bent on: an eighth of a percent of the current
/// is missed at a twentieth, 3 % at a quarter.
const STRAIGHT: f64 = 0.25;
/// A row's own entry alone overrates what is left where others move with it; simplified Newton has to be able to get below it.
const MOST_BEHIND: f64 = 1e4;
/// The least that 1 - theta is taken for.
const NOTHING_LEFT: f64 = 1e-12;

impl DiodeSlot {
    /// Does a junction of this conductance carry a current that anything could hang on?
    fn conducts(&self, w: &Work, g: f64) -> bool {
        (g - w.gmin) * self.kernel.vte > SMALL_CURRENT
    }

    fn conducts_at(&self, w: &Work, x: &[f64]) -> bool {
        self.conducts(w, self.kernel.eval(across(x, self.p, self.n), w.gmin).g)
    }
}

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

    /// The nodes that a diode is joined to, not the one that it has for itself behind its series resistance; None for ground.
    fn terminals(&self, d: &DiodeSlot) -> [Option<usize>; 2] {
        let anode = match d.kernel.series_conductance() {
            Some(_) => d.outer.map(|(_, own)| self.pattern.rowidx[own]),
            None => usize::try_from(d.p).ok(),
        };
        [anode, usize::try_from(d.n).ok()]
    }

    /// Do capacitors or sources hold the voltage at every terminal of the diodes, whatever these carry? (Three phases behind 0.1
    /// ohm into a resistor: a diode that was left with 9 A backwards was within the tolerance of 80 mV, and the output was
    /// off by 0.4 V.)
    pub fn nodes_hold_junctions(&self) -> bool {
        let by_source = self.alone();
        let holds = |node: usize| {
            by_source[node] || self.pattern.position(node, node).is_some_and(|own| self.c_linear[own] > 0.0)
        };
        self.diodes.iter().flat_map(|d| self.terminals(d)).flatten().all(holds)
    }

    /// How long junctions hold their charge where nothing else stores any [s]: their transit times, or what their capacitance takes
    /// to go through what is joined to their nodes. None where something else stores charge or flux.
    pub fn memory_of_junctions(&self) -> Option<f64> {
        if !self.q_rows.is_empty() || self.c_linear.iter().any(|&c| c != 0.0) {
            return None;
        }
        // what leads away from a node, without the series resistances of diodes; a source holds its own nodes
        let mut leads = self.g_linear.clone();
        self.diodes.iter().filter_map(|d| d.outer).for_each(|(g, own)| leads[own] -= g);
        let by_source = self.alone();
        let resistance = |node: usize| match self.pattern.position(node, node) {
            _ if by_source[node] => 0.0,
            Some(own) => 1.0 / leads[own].max(0.0),
            None => f64::INFINITY,
        };
        let memory = |d: &DiodeSlot| {
            let series = d.kernel.series_conductance().map_or(0.0, |g| 1.0 / g);
            let through = self.terminals(d).into_iter().flatten().fold(series, |sum, node| sum + resistance(node));
            let c = d.kernel.eval(0.0, 0.0).c;
            d.kernel.transit_time().max(if c > 0.0 { c * through } else { 0.0 })
        };
        Some(self.diodes.iter().map(memory).fold(0.0, f64::max))
    }

    /// Would limiting let every junction go from its voltage at `from` to that at `to`?
    pub fn junctions_within_reach(&self, from: &[f64], to: &[f64]) -> bool {
        self.diodes.iter().all(|d| !d.kernel.limit(across(to, d.p, d.n), across(from, d.p, d.n)).1)
    }

    /// `stage_expand` at the next iterate; true when the currents of all diodes are those of the straight lines that led
    /// there.
    pub fn stage_expand_and_fit(&self, w: &mut Work, x: &[f64], t: f64, a: f64) -> bool {
        self.stage_expand_near(w, x, t, a, Near { reltol: 0.0, vntol: 0.0, share: FITS, least: SMALL_CURRENT })
    }

    /// Has the update `step` to x moved a junction that conducts, there or where it was expanded, by so much of what it
    /// is bent on that its straight line tells nothing of the next update? Beside a node of 400 V that is far within
    /// the tolerance of 0.4 V, and what a coil drives into a diode that turns off is an update of 26 mV again and
    /// again.
    pub fn junctions_leave_lines(&self, w: &Work, step: &[f64], x: &[f64]) -> bool {
        self.diodes.iter().zip(w.expansions.iter()).any(|(d, e)| {
            across(step, d.p, d.n).abs() > STRAIGHT * d.kernel.vte && (d.conducts(w, e.o.g) || d.conducts_at(w, x))
        })
    }

    /// The same of several states, in which every unknown has moved by no more than `moved`, and will move by `further`
    /// times that; `slopes` are those of the straight lines.
    pub fn junctions_leave_any<'a>(
        &self,
        w: &Work,
        slopes: &[(f64, f64)],
        moved: &[f64],
        further: f64,
        states: impl Iterator<Item = &'a Vec<f64>> + Clone,
    ) -> bool {
        let by = |k: i32| usize::try_from(k).map_or(0.0, |k| moved[k]);
        self.diodes.iter().enumerate().any(|(k, d)| {
            let held = slopes.get(k).is_some_and(|&(g, _)| d.conducts(w, g));
            further * (by(d.p) + by(d.n)) > STRAIGHT * d.kernel.vte
                && (held || states.clone().any(|x| d.conducts_at(w, x)))
        })
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
            // what else stands between the terminals: the two nodes' own conductances in series, that of the outer one
            // behind a series resistance
            let least = 1e-15 * held;
            let rest = |slot: Option<usize>, outer: Option<(f64, usize)>| {
                let own = slot.map(|k| (matrix[k] - held).max(least));
                let beyond = outer.map(|(g, k)| 1.0 / g + 1.0 / (matrix[k] - g).max(least));
                beyond.or(own.map(|own| 1.0 / own)).unwrap_or(0.0)
            };
            let rest = 1.0 / (rest(d.slots[0], d.outer) + rest(d.slots[3], None)).max(1e-300);
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
