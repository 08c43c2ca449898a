//! Currents that bend: whether an iteration that calls itself solved can be believed where it went by straight lines.
use super::devices::{ends, Instance};
use super::{System, Work};
use crate::devices::class::{across, Line, Near, Seat};
use crate::rounding::ROUNDED;

/// A current is that of a straight line to a share of itself, or to this [A]: less is nothing that anything hangs on.
const SMALL_CURRENT: f64 = 1e-9;
/// An exponential's straight line is good for so much of what its current is bent on: an eighth of a percent of the current
/// is missed at a twentieth, 3 % at a quarter.
const STRAIGHT: f64 = 0.25;

/// What bends in devices.
#[derive(Default)]
pub struct Nonlinear {
    bent: Vec<Bend>,  // voltages that exponentials hang on
    gates: Vec<Gate>, // branches
}

/// A port voltage that exponential currents hang on.
pub struct Bend {
    instance: Instance,
    port: usize,
    nodes: (i32, i32),
    volts: f64,         // for a factor of e
    slopes: Vec<usize>, // by this port, among those of the system
}

/// A branch across its own port, and what else leads from one of its ends to the other.
pub struct Gate {
    slope: usize,
    place: (Instance, usize), // of the slope among the instance's own
    ends: [End; 2],
}

struct End {
    own: Option<usize>,          // place of the node's own entry
    outer: Option<(f64, usize)>, // behind a series resistance: that conductance, and the outer node's own entry
}

impl System {
    pub(super) fn find_bends(&mut self) {
        let (mut bends, mut gates, mut slope) = (Vec::new(), Vec::new(), 0);
        for &instance in &self.devices.instances {
            let (class, k) = (self.devices.class(instance), instance.number);
            let (seat, shape) = (&class.seats()[k], class.shape(k));
            let node = |k: usize| seat.nodes[k];
            let first = bends.len();
            for (port, &(p, n)) in shape.ports.iter().enumerate() {
                let (volts, nodes) = (class.bend(k, port), (node(p), node(n)));
                bends.push(Bend { instance, port, nodes, volts, slopes: Vec::new() });
            }
            for (place, link) in shape.links.iter().enumerate() {
                if !link.current && !link.charge {
                    continue;
                }
                let (branch, port) = (place / shape.ports.len(), place % shape.ports.len());
                bends[first + port].slopes.push(slope);
                if shape.own_port(branch) == Some(port) {
                    let (p, n) = shape.branches[branch];
                    let row = |end: usize| seat.rows[branch][end];
                    let ends = [self.end(seat, node(p), row(0)), self.end(seat, node(n), row(1))];
                    gates.push(Gate { slope, place: (instance, place), ends });
                }
                slope += 1;
            }
        }
        bends.retain(|bend: &Bend| bend.volts.is_finite());
        self.nonlinear = Nonlinear { bent: bends, gates };
    }

    fn end(&self, seat: &Seat, node: i32, row: i32) -> End {
        let place =
            |row: i32, node: i32| self.pattern.position(usize::try_from(row).ok()?, usize::try_from(node).ok()?);
        let series = seat.series.iter().find(|s| s.inner as i32 == node);
        let outer = series.and_then(|s| Some((s.conductance, place(s.outer, s.outer)?)));
        End { own: place(row, node), outer }
    }

    /// (the nodes, volts for a factor of e) of voltages that exponential currents hang on.
    pub fn exponential_ports(&self) -> impl Iterator<Item = ((i32, i32), f64)> + '_ {
        self.nonlinear.bent.iter().map(|bend| (bend.nodes, bend.volts))
    }

    /// Nodes that devices have for themselves, behind their series resistances.
    pub fn behind_resistances(&self) -> impl Iterator<Item = usize> + '_ {
        self.seats().flat_map(|(_, seat)| &seat.series).map(|series| series.inner)
    }

    fn seats(&self) -> impl Iterator<Item = (Instance, &Seat)> {
        self.devices.instances.iter().map(|&i| (i, &self.devices.class(i).seats()[i.number]))
    }

    /// The nodes that an instance is joined to; ground is none.
    fn terminals(&self, i: Instance) -> impl Iterator<Item = usize> + '_ {
        let class = self.devices.class(i);
        let nodes = class.seats()[i.number].nodes.iter().take(class.terminals());
        nodes.filter_map(|&k| usize::try_from(k).ok())
    }

    /// Do capacitors or sources hold the voltage at every terminal of the devices, whatever these carry? (Three phases behind 0.1
    /// ohm into a resistor: a diode that was left with 9 A backwards was within the tolerance of 80 mV, and the output was
    /// off by 0.4 V.)
    pub fn nodes_hold_devices(&self) -> bool {
        let by_source = self.alone();
        let holds = |node: usize| by_source[node] || self.own_capacitance(node) > 0.0;
        self.devices.instances.iter().flat_map(|&i| self.terminals(i)).all(holds)
    }

    /// Would limiting let every device go from its voltages at `from` to those at `to`?
    pub fn within_reach(&self, from: &[f64], to: &[f64]) -> bool {
        self.devices.instances.iter().all(|&i| {
            let [old, mut new] = [from, to].map(|x| self.devices.voltages(i, x));
            !self.devices.class(i).limit(i.number, &mut new, &old)
        })
    }

    /// `stage_expand` at the next iterate; true when all currents are those of the straight lines that led there.
    pub fn stage_expand_and_fit(&self, w: &mut Work, x: &[f64], t: f64, a: f64) -> bool {
        // a current is that of a straight line to so much of itself, or of this [A]
        self.stage_expand_near(w, x, t, a, Near { reltol: 0.0, vntol: 0.0, share: 1e-3, least: SMALL_CURRENT })
    }

    /// Does a bend of this conductance carry a current that anything could hang on?
    fn conducts(&self, w: &Work, bend: &Bend, g: f64) -> bool {
        (g - w.gmin) * bend.volts > SMALL_CURRENT
    }

    fn conducts_at(&self, w: &Work, bend: &Bend, x: &[f64], line: &mut Line) -> bool {
        let i = bend.instance;
        let class = self.devices.class(i);
        class.at(i.number, &self.devices.voltages(i, x), w.gmin, line);
        let ports = class.ports();
        line.g.iter().skip(bend.port).step_by(ports).any(|g| self.conducts(w, bend, g.abs()))
    }

    /// Has the update `step` to x moved a port voltage whose current conducts, there or where it was expanded, by so much of what it
    /// is bent on that its straight line tells nothing of the next update? Beside a node of 400 V that is far within
    /// the tolerance of 0.4 V, and what a coil drives into a diode that turns off is an update of 26 mV again and
    /// again.
    pub fn leaves_lines(&self, w: &Work, step: &[f64], x: &[f64]) -> bool {
        let mut line = Line::default();
        self.nonlinear.bent.iter().any(|bend| {
            across(step, bend.nodes.0, bend.nodes.1).abs() > STRAIGHT * bend.volts
                && (bend.slopes.iter().any(|&s| self.conducts(w, bend, self.conductance(w, s).abs()))
                    || self.conducts_at(w, bend, x, &mut line))
        })
    }

    /// The same of several states, in which every unknown has moved by no more than `moved`, and will move by `further`
    /// times that; `slopes` are those of the straight lines.
    pub fn leaves_any<'a>(
        &self,
        w: &Work,
        slopes: &[(f64, f64)],
        moved: &[f64],
        further: f64,
        states: impl Iterator<Item = &'a Vec<f64>> + Clone,
    ) -> bool {
        let mut line = Line::default();
        self.nonlinear.bent.iter().any(|bend| {
            let by: f64 = ends(bend.nodes).map(|(k, _)| moved[k]).sum();
            further * by > STRAIGHT * bend.volts
                && (bend.slopes.iter().any(|&s| slopes.get(s).is_some_and(|&(g, _)| self.conducts(w, bend, g.abs())))
                    || states.clone().any(|x| self.conducts_at(w, bend, x, &mut line)))
        })
    }

    /// What a simplified Newton iteration leaves behind, in units of its last update, that solves with slopes (g, c) of
    /// another state than x: theta / (1 - theta), theta being the difference of a branch's conductances along it over that
    /// which `matrix` = G + a C has there. An inductor drives its current into a diode that has
    /// turned off, and every update for a conducting one is a small part of what is missing.
    pub fn left_behind(&self, w: &Work, slopes: &[(f64, f64)], a: f64, matrix: &[f64], x: &[f64]) -> f64 {
        let (mut worst, mut line, mut there) = (0.0_f64, Line::default(), None);
        for gate in &self.nonlinear.gates {
            let Some(&(g, c)) = slopes.get(gate.slope) else { break };
            let (i, place) = gate.place;
            if there.replace(i) != Some(i) {
                self.devices.class(i).at(i.number, &self.devices.voltages(i, x), w.gmin, &mut line);
            }
            let (held, theirs) = (g + a * c, line.g[place] + a * line.c[place]);
            if !(held > 0.0) {
                continue;
            }
            // what else stands between its ends: the two nodes' own conductances in series, that of the outer one
            // behind a series resistance
            let least = 1e-15 * held;
            let rest = |end: &End| {
                let own = end.own.map(|k| (matrix[k] - held).max(least));
                let beyond = end.outer.map(|(g, k)| 1.0 / g + 1.0 / (matrix[k] - g).max(least));
                beyond.or(own.map(|own| 1.0 / own)).unwrap_or(0.0)
            };
            let rest = 1.0 / (rest(&gate.ends[0]) + rest(&gate.ends[1])).max(1e-300);
            let theta = (theirs - held).abs() / (held + rest);
            worst = worst.max(theta / ((theirs.min(2.0 * held - theirs) + rest) / (held + rest)).max(ROUNDED));
        }
        worst
    }

    /// Do expressions have exponentials of unknowns?
    pub fn is_exponential(&self) -> bool {
        self.expressions.exponential && !self.expressions.yielding.is_empty()
    }

    /// Can a conductance change by more than its own size within a step: are there devices, or exponentials in expressions?
    pub fn turns(&self) -> bool {
        self.devices() > 0 || self.is_exponential()
    }

    /// Can the own conductance of a node, or what else an exponential makes, fall by orders of magnitude?
    pub fn yields(&self) -> bool {
        !self.expressions.yielding.is_empty()
    }

    /// `left_behind` of expressions, exponentials of anything or conductances of nodes (a wiper that leaves its end): theta from the rows' own entries, of the matrix (`gv`, `cv`) that the
    /// iteration solves with and of the derivatives at x. Where they have grown an iteration that is no good shows it by itself.
    pub fn bent_behind(&self, w: &mut Work, (gv, cv): (&[f64], &[f64]), a: f64, x: &[f64], t: f64) -> f64 {
        self.eval_jacobian(w, x, t, false);
        let theta = |&k: &usize| {
            let held = gv[k] + a * cv[k];
            (held - (w.gv[k] + a * w.cv[k])) / held
        };
        let worst = self.expressions.yielding.iter().map(theta).fold(0.0, f64::max);
        // a row's own entry alone overrates what is left where others move with it; simplified Newton has to be able to
        // get below it
        (worst / (1.0 - worst).max(ROUNDED)).min(1e4)
    }
}
