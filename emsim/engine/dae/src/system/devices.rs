//! Devices in the equations: where the numbers of every class go, in rows, in the matrix, and in programs.
use super::{System, Work};
use crate::devices::class::{across, add, Series};
use crate::devices::{Class, Line, Met, Near, Noise, Number};
use crate::sparse::Pattern;
use std::ops::Range;
use std::sync::Arc;

/// A class, and where its numbers lie and go. `lines` and `held` are those of all classes, one behind the other.
pub struct Placed {
    pub class: Arc<dyn Class>,
    lines: Range<usize>,
    held: Range<usize>,
}

/// The current of a branch, with its charge: where the numbers lie in `lines`, and the rows that hold it.
pub struct Current {
    pub stage: usize, // i + a q
    pub charge: Option<usize>,
    pub rows: [i32; 4],
    off: bool, // of an instance that is off at the start
}

/// What a current changes by with a port voltage.
pub struct Slope {
    pub stage: usize, // g + a c
    conductance: usize,
    /// where there is one
    pub capacitance: Option<usize>,
    pub at: usize,            // the port voltage that the line is about
    pub ports: (i32, i32),    // its nodes
    pub rows: [i32; 4],       // of the branch
    pub own: bool,            // the port lies along the branch
    slots: Vec<(usize, f64)>, // places in the matrix, with signs
    off: bool,
}

/// An instance: its class, and its number there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    pub class: usize,
    pub number: usize,
}

/// All of them.
#[derive(Default)]
pub struct Devices {
    pub classes: Vec<Placed>,
    pub instances: Vec<Instance>,
    pub currents: Vec<Current>,
    pub slopes: Vec<Slope>,
    /// how many instances have exponential currents, ...
    pub exponentials: usize,
    /// ... and whether all are passive two-poles
    pub passive: bool,
    /// is one of them off at the start?
    pub some_off: bool,
    operations: f64,
}

/// Rows of a branch, with signs.
pub fn signed(rows: [i32; 4]) -> impl Iterator<Item = (usize, f64)> {
    let signs = [1.0, -1.0, 1.0, -1.0];
    rows.into_iter().zip(signs).filter_map(|(row, sign)| Some((usize::try_from(row).ok()?, sign)))
}

/// Nodes of a port, with signs.
pub fn ends((p, n): (i32, i32)) -> impl Iterator<Item = (usize, f64)> {
    [(p, 1.0), (n, -1.0)].into_iter().filter_map(|(k, sign)| Some((usize::try_from(k).ok()?, sign)))
}

/// Places (row, column) in the matrix of what a class's currents hang on. Not `all`: without those that cancel, of branches and ports
/// whose ends are one node.
pub fn places(class: &dyn Class, all: bool) -> Vec<(usize, usize)> {
    let mut places = Vec::new();
    for (k, seat) in class.seats().iter().enumerate() {
        let shape = class.shape(k);
        for (j, &rows) in seat.rows.iter().enumerate() {
            let counts = |row: usize| all || signed(rows).filter(|r| r.0 == row).map(|r| r.1).sum::<f64>() != 0.0;
            for (p, &(from, to)) in shape.ports.iter().enumerate() {
                let (link, nodes) = (shape.link(j, p), (seat.nodes[from], seat.nodes[to]));
                if (link.current || link.charge) && (all || nodes.0 != nodes.1) {
                    let rows = signed(rows).filter(|r| counts(r.0));
                    places.extend(rows.flat_map(|(row, _)| ends(nodes).map(move |(col, _)| (row, col))));
                }
            }
        }
    }
    places
}

impl Devices {
    /// `off`: names of those that are off at the start.
    pub fn new(classes: Vec<Box<dyn Class>>, off: &[String], pattern: &Pattern) -> Devices {
        let mut all = Devices { passive: true, ..Devices::default() };
        let (mut lines, mut held) = (0, 0);
        for (n, mut class) in classes.into_iter().enumerate() {
            class.settle();
            let count = class.seats().len();
            for (k, seat) in class.seats().iter().enumerate() {
                let (shape, facts) = (class.shape(k), class.facts(k));
                all.instances.push(Instance { class: n, number: k });
                all.exponentials += usize::from(facts.exponential);
                all.passive &= facts.passive;
                all.operations += class.operations(k);
                let off = off.contains(&seat.name);
                all.some_off |= off;
                let place = |number| lines + class.place(k, number);
                for (j, &rows) in seat.rows.iter().enumerate() {
                    let charge = shape.stores(j).then(|| place(Number::Charge(j)));
                    all.currents.push(Current { stage: place(Number::StageCurrent(j)), charge, rows, off });
                    for (p, &(from, to)) in shape.ports.iter().enumerate() {
                        let link = shape.link(j, p);
                        if !link.current && !link.charge {
                            continue;
                        }
                        let ports = (seat.nodes[from], seat.nodes[to]);
                        let slot = |(row, sign): (usize, f64)| {
                            let at = move |col| pattern.position(row, col).expect("every place was collected");
                            ends(ports).map(move |(col, of)| (at(col), sign * of))
                        };
                        all.slopes.push(Slope {
                            stage: place(Number::StageConductance(j, p)),
                            conductance: place(Number::Conductance(j, p)),
                            capacitance: link.charge.then(|| place(Number::Capacitance(j, p))),
                            at: place(Number::At(p)),
                            ports,
                            rows,
                            own: shape.own_port(j) == Some(p),
                            slots: signed(rows).flat_map(slot).collect(),
                            off,
                        });
                    }
                }
            }
            let room = (lines + class.room(count), held + class.room_held(count));
            all.classes.push(Placed { class: class.into(), lines: lines..room.0, held: held..room.1 });
            (lines, held) = room;
        }
        all
    }

    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// Room for `Work::lines`, ...
    pub fn lines(&self) -> Vec<f64> {
        vec![0.0; self.classes.last().map_or(0, |c| c.lines.end)]
    }

    /// ... and the port voltages of the start.
    pub fn start(&self) -> Vec<f64> {
        let mut held = vec![0.0; self.classes.last().map_or(0, |c| c.held.end)];
        self.classes.iter().for_each(|c| c.class.start(&mut held[c.held.clone()]));
        held
    }

    #[inline(always)]
    pub fn add_values(&self, x: &[f64], gmin: f64, f: &mut [f64], q: &mut [f64]) {
        for placed in &self.classes {
            placed.class.values(x, gmin, f, q);
        }
    }

    pub fn class(&self, i: Instance) -> &dyn Class {
        &*self.classes[i.class].class
    }

    /// Port voltages of an instance.
    pub fn voltages(&self, i: Instance, x: &[f64]) -> Vec<f64> {
        let (seat, shape) = (&self.class(i).seats()[i.number], self.class(i).shape(i.number));
        shape.ports.iter().map(|&(p, n)| across(x, seat.nodes[p], seat.nodes[n])).collect()
    }

    /// Currents, charges and slopes of an instance at x.
    pub fn at(&self, i: Instance, x: &[f64], gmin: f64) -> Line {
        let mut line = Line::default();
        self.class(i).at(i.number, &self.voltages(i, x), gmin, &mut line);
        line
    }
}

impl Slope {
    /// Places of its conductance in the matrix, with their signs.
    pub fn stamps(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.slots.iter().copied()
    }
}

impl System {
    /// How many instances of devices there are, ...
    /// Rows that currents of devices enter.
    pub fn rows_of_devices(&self) -> Vec<bool> {
        let mut rows = vec![false; self.n];
        self.devices.currents.iter().flat_map(|c| signed(c.rows)).for_each(|(row, _)| rows[row] = true);
        rows
    }

    /// Rows of every branch that a current flows in, not charge alone: + - + -, or -1.
    pub fn carrying_branches(&self) -> impl Iterator<Item = [i32; 4]> + '_ {
        self.devices.instances.iter().flat_map(|&i| {
            let class = self.devices.class(i);
            let (seat, shape) = (&class.seats()[i.number], class.shape(i.number));
            let carries = move |j: usize| (0..shape.ports.len()).any(|p| shape.link(j, p).current);
            seat.rows.iter().enumerate().filter(move |&(j, _)| carries(j)).map(|(_, &rows)| rows)
        })
    }

    /// The size of the current of every branch of devices in the rows that it enters, at the point of `eval_jacobian`.
    pub fn device_currents<'a>(&'a self, w: &'a Work) -> impl Iterator<Item = (usize, f64)> + 'a {
        self.devices.currents.iter().flat_map(|c| signed(c.rows).map(|(row, _)| (row, w.lines[c.stage].abs())))
    }

    pub fn devices(&self) -> usize {
        self.devices.instances.len()
    }

    /// ... and of these such whose currents are exponentials of voltages.
    pub fn exponentials(&self) -> usize {
        self.devices.exponentials
    }

    /// Names of the instances, in the order of their accounts.
    pub fn device_names(&self) -> Vec<String> {
        let seats = self.devices.classes.iter().flat_map(|c| c.class.seats());
        seats.map(|seat| seat.name.clone()).collect()
    }

    /// What all devices take for an evaluation, in operations of expressions.
    pub fn device_operations(&self) -> f64 {
        self.devices.operations
    }

    /// For every instance: its number and the power that its branches take at x, currents times voltages.
    pub fn each_power(&self, w: &Work, x: &[f64], mut look: impl FnMut(usize, f64)) {
        let mut line = Line::default();
        for (n, &i) in self.devices.instances.iter().enumerate() {
            let class = self.devices.class(i);
            class.at(i.number, &self.devices.voltages(i, x), w.gmin, &mut line);
            let (seat, shape) = (&class.seats()[i.number], class.shape(i.number));
            let along = shape.branches.iter().map(|&(p, n)| across(x, seat.nodes[p], seat.nodes[n]));
            look(n, along.zip(&line.i).map(|(v, i)| v * i).sum());
        }
    }

    /// Energy that the charges of every instance hold at x [J].
    pub fn device_energies(&self, w: &Work, x: &[f64]) -> Vec<f64> {
        let energy = |&i: &_| self.devices.class(i).energy(i.number, &self.devices.voltages(i, x), w.gmin);
        self.devices.instances.iter().map(energy).collect()
    }

    /// For every source of noise of every instance at x: the instance's name, the source, and the nodes it goes from and to (-1: ground).
    pub fn each_noise(&self, w: &Work, x: &[f64], mut look: impl FnMut(&str, &Noise, [i32; 2])) {
        for &i in &self.devices.instances {
            let (class, line) = (self.devices.class(i), self.devices.at(i, x, w.gmin));
            let seat = &class.seats()[i.number];
            let node = |k: usize| seat.nodes.get(k).copied().unwrap_or(-1);
            class.noise(i.number, &self.devices.voltages(i, x), &line, &mut |n| {
                look(&seat.name, &n, [node(n.from), node(n.to)])
            });
        }
    }

    /// Nodes inside of devices, each with the node (-1: ground) from which a current comes to it that hangs on the voltage between
    /// the two, and that stores nothing: what stands for a series resistance.
    pub fn tied_inside(&self) -> Vec<(usize, i32)> {
        let mut tied = Vec::new();
        for &i in &self.devices.instances {
            let class = self.devices.class(i);
            let (seat, shape) = (&class.seats()[i.number], class.shape(i.number));
            tied.extend(seat.series.iter().map(|s| (s.inner, s.outer)));
            let mut known: Vec<usize> = (0..class.terminals()).collect();
            // of what a branch hangs on, and the node behind it
            let look = |known: &[usize], b: usize| {
                let (from, to) = shape.branches[b];
                let (near, far) = if known.contains(&from) { (from, to) } else { (to, from) };
                // (where there is no resistance an inner node is a terminal)
                let own_unknown = !seat.nodes[..class.terminals()].contains(&seat.nodes[far]);
                let inside = known.contains(&near) && !known.contains(&far) && seat.nodes[far] >= 0 && own_unknown;
                let own = shape.ports.iter().position(|&p| p == (from, to) || p == (to, from));
                let links = &shape.links[b * shape.ports.len()..][..shape.ports.len()];
                let resists = own.is_some_and(|p| links[p].current) && !links.iter().any(|l| l.charge);
                (inside && resists).then(|| (links.iter().filter(|l| l.current).count(), near, far))
            };
            while let Some((_, near, far)) = (0..shape.branches.len()).filter_map(|b| look(&known, b)).min() {
                known.push(far);
                tied.push((seat.nodes[far] as usize, seat.nodes[near]));
            }
        }
        tied
    }

    /// The series resistances of all instances: the instance's name, number of the terminal, nodes (-1: ground), conductance [S].
    pub fn series(&self) -> Vec<(String, usize, [i32; 2], f64)> {
        let of = |&i: &Instance| {
            let seat = &self.devices.class(i).seats()[i.number];
            let one = |s: &Series| (seat.name.clone(), s.terminal, [s.outer, s.inner as i32], s.conductance);
            seat.series.iter().map(one).collect::<Vec<_>>()
        };
        self.devices.instances.iter().flat_map(of).collect()
    }

    /// Every class as straight lines at x, with the a of a stage.
    #[inline(always)]
    pub(super) fn linearise(&self, w: &mut Work, x: &[f64], a: f64, limit: bool, near: Option<Near>) -> Met {
        let mut met = Met::default();
        let asked = crate::devices::class::Asked { x, a, gmin: w.gmin, limit, near };
        for c in &self.devices.classes {
            let own = c.class.linearise(&asked, &mut w.ports[c.held.clone()], &mut w.lines[c.lines.clone()]);
            met.moved |= own.moved;
            met.apart |= own.apart;
        }
        met
    }

    /// Adds the straight lines, which were made with a = 0, to w.f, w.q, w.gv and w.cv; where `without_off`, but for those of devices that
    /// are off at the start.
    pub(super) fn add_lines(&self, w: &mut Work, x: &[f64]) {
        let Work { f, q, gv, cv, lines, without_off, .. } = w;
        for c in self.devices.currents.iter().filter(|c| !(*without_off && c.off)) {
            add(f, &c.rows, lines[c.stage]);
            if let Some(charge) = c.charge {
                add(q, &c.rows, lines[charge]);
            }
        }
        for s in self.devices.slopes.iter().filter(|s| !(*without_off && s.off)) {
            let c = s.capacitance.map_or(0.0, |k| lines[k]);
            if c != 0.0 {
                add(q, &s.rows, c * (across(x, s.ports.0, s.ports.1) - lines[s.at]));
            }
            for &(slot, sign) in &s.slots {
                gv[slot] += sign * lines[s.conductance];
                cv[slot] += sign * c;
            }
        }
    }

    /// y += C x of the straight lines.
    pub(super) fn add_capacitances(&self, w: &Work, x: &[f64], y: &mut [f64]) {
        for s in &self.devices.slopes {
            if let Some(c) = s.capacitance {
                add(y, &s.rows, w.lines[c] * across(x, s.ports.0, s.ports.1));
            }
        }
    }

    /// q += charges of the straight lines at x.
    pub(super) fn add_charges(&self, w: &Work, x: &[f64], q: &mut [f64]) {
        for c in &self.devices.currents {
            if let Some(charge) = c.charge {
                add(q, &c.rows, w.lines[charge]);
            }
        }
        for s in &self.devices.slopes {
            if let Some(c) = s.capacitance {
                add(q, &s.rows, w.lines[c] * (across(x, s.ports.0, s.ports.1) - w.lines[s.at]));
            }
        }
    }

    /// out -= i + a q of the straight lines.
    pub(super) fn subtract_currents(&self, w: &Work, out: &mut [f64]) {
        for c in &self.devices.currents {
            add(out, &c.rows, -w.lines[c.stage]);
        }
    }

    pub(super) fn conductance(&self, w: &Work, slope: usize) -> f64 {
        w.lines[self.devices.slopes[slope].conductance]
    }

    /// Conductance and capacitance of every slope as the last Jacobian has them.
    pub fn slopes<'a>(&'a self, w: &'a Work) -> impl Iterator<Item = (f64, f64)> + 'a {
        let of = |s: &Slope| (w.lines[s.conductance], s.capacitance.map_or(0.0, |k| w.lines[k]));
        self.devices.slopes.iter().map(of)
    }
}
