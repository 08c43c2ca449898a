//! All instances of one device in a system, side by side: one virtual call an evaluation; inside, four at a time.
//!
//! A class evaluates and limits; it never sees a matrix. Where its numbers go is `Shape` and `Seat`, which all who build patterns,
//! programs and sums of rows read (system/devices.rs): so a class that is compiled from a text needs to know no more than these.
use super::number::{Dual, Lane, Sym};
use super::{Card, Climate, Constants, Device, Flow, Given, Inner, Noise, Spec};
use crate::graph::{Graph, Id};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{Places, V};
use crate::multiversion::in_blocks_mut;
#[cfg(target_arch = "x86_64")]
use crate::tape::vectors;
use std::cell::RefCell;
use std::collections::HashMap;
use std::marker::PhantomData;

/// So many instances are evaluated together.
pub use crate::multiversion::LANES;

/// One instance in the equations.
#[derive(Clone, Debug)]
pub struct Seat {
    pub name: String,
    /// unknown of each node, terminals first, or -1 for ground
    pub nodes: Vec<i32>,
    /// of each branch the rows that hold its current, with the signs + - + -, or -1: those of its two nodes, and sums that these
    /// are part of (see floating_groups.rs)
    pub rows: Vec<[i32; 4]>,
    pub series: Vec<Series>,
}

/// A constant resistance between a terminal and an inner node. The linear part of the system has it.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    pub terminal: usize, // number of the terminal
    pub outer: i32,
    pub inner: usize, // unknown
    pub conductance: f64,
}

/// How an instance's numbers hang together: of the nodes of its seat.
#[derive(Clone, Debug)]
pub struct Shape {
    pub ports: Vec<(usize, usize)>,
    pub branches: Vec<(usize, usize)>,
    pub links: Vec<Link>, // of every branch with every port
}

/// Do current and charge of a branch hang on a port voltage?
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    pub current: bool,
    pub charge: bool,
}

impl Shape {
    pub fn link(&self, branch: usize, port: usize) -> Link {
        self.links[branch * self.ports.len() + port]
    }

    /// Does a branch store charge?
    pub fn stores(&self, branch: usize) -> bool {
        (0..self.ports.len()).any(|port| self.link(branch, port).charge)
    }

    pub fn stores_any(&self) -> bool {
        self.links.iter().any(|link| link.charge)
    }

    /// The port whose voltage is that along the branch.
    pub fn own_port(&self, branch: usize) -> Option<usize> {
        self.ports.iter().position(|&port| port == self.branches[branch])
    }
}

/// What policies ask of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// a current may change by orders of magnitude within a step
    pub exponential: bool,
    /// a two-pole that neither makes energy nor amplifies
    pub passive: bool,
}

/// One instance at one point: currents and charges of the branches, their slopes by the ports (branch after branch).
#[derive(Clone, Debug, Default)]
pub struct Line {
    pub i: Vec<f64>,
    pub q: Vec<f64>,
    pub g: Vec<f64>,
    pub c: Vec<f64>,
}

/// Where the numbers of instances lie, four instances side by side: of P ports and B branches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    pub ports: usize,
    pub branches: usize,
}

/// Which number of an instance, as the last evaluation made it a straight line about the port voltages `At`, which are those asked for
/// unless limiting moved them. The last two with the a of the stage it was asked for, of the line at the voltages asked for.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    Voltage(usize),
    At(usize),
    Current(usize),
    Conductance(usize, usize), // branch, port
    Charge(usize),
    Capacitance(usize, usize),
    StageCurrent(usize),            // i + a q
    StageConductance(usize, usize), // g + a c
}

impl Layout {
    /// Numbers of an instance.
    pub const fn numbers(self) -> usize {
        2 * self.ports + 3 * self.branches * (1 + self.ports)
    }

    /// Room for so many instances.
    pub fn room(self, count: usize) -> usize {
        count.div_ceil(LANES) * self.numbers() * LANES
    }

    #[inline(always)]
    pub const fn row(self, number: Number) -> usize {
        let (p, b) = (self.ports, self.branches);
        let own = 2 * p;
        let per = b * (1 + p);
        match number {
            Number::Voltage(k) => k,
            Number::At(k) => p + k,
            Number::Current(j) => own + j,
            Number::Conductance(j, k) => own + b + j * p + k,
            Number::Charge(j) => own + per + j,
            Number::Capacitance(j, k) => own + per + b + j * p + k,
            Number::StageCurrent(j) => own + 2 * per + j,
            Number::StageConductance(j, k) => own + 2 * per + b + j * p + k,
        }
    }

    #[inline(always)]
    pub const fn place(self, instance: usize, number: Number) -> usize {
        (instance / LANES * self.numbers() + self.row(number)) * LANES + instance % LANES
    }
}

/// How near a current, its charge with it, is to be to that of the straight line which led to its voltages: to so much of
/// what the conductances make of the voltages' tolerances, and to a share of itself.
#[derive(Clone, Copy)]
pub struct Near {
    pub reltol: f64,
    pub vntol: f64,
    pub share: f64,
    pub least: f64, // current that a share is taken of [A]
}

/// How an evaluation met the instances.
#[derive(Clone, Copy, Default)]
pub struct Met {
    pub moved: bool, // limiting moved a voltage
    pub apart: bool, // a current is not near that of the straight line of before, where that was asked for
}

/// What an evaluation is asked for.
#[derive(Clone, Copy)]
pub struct Asked<'a> {
    pub x: &'a [f64],
    pub a: f64, // of the stage
    pub gmin: f64,
    /// a port voltage moves from where it was held by no more than limiting allows
    pub limit: bool,
    pub near: Option<Near>,
}

pub trait Class: Send + Sync {
    /// The device's name.
    fn kind(&self) -> &str;
    fn terminals(&self) -> usize;
    /// Port voltages of an instance.
    fn ports(&self) -> usize;
    /// Room for the numbers of so many instances, ...
    fn room(&self, count: usize) -> usize;
    /// ... and for the port voltages that limiting holds.
    fn room_held(&self, count: usize) -> usize {
        count.div_ceil(LANES) * self.ports() * LANES
    }
    /// Where a number of an instance lies.
    fn place(&self, instance: usize, number: Number) -> usize;
    /// What an evaluation of an instance with its slopes takes, in operations of expressions.
    fn operations(&self, k: usize) -> f64 {
        // an operation of a law with its derivatives costs as much as so many of an expression (both sides of what is
        // picked are computed)
        30.0 * self.shape(k).links.len() as f64
    }
    /// Are its currents and charges expressions (`symbols`)? What is only evaluated is not.
    fn is_formula(&self) -> bool {
        true
    }
    /// Itself, where it was compiled from a text.
    fn compiled(&mut self) -> Option<&mut super::compiled::Compiled> {
        None
    }

    /// An instance more, between these terminals; `inner` makes a node of that name. Errors are sentences for the user. A class whose
    /// instances come from elsewhere (a text, a file) has none made so.
    fn add(
        &mut self,
        _name: &str,
        _terminals: &[i32],
        _model: &HashMap<String, f64>,
        _instance: &HashMap<String, f64>,
        _at: Climate,
        _inner: &mut dyn FnMut(&str) -> usize,
    ) -> Result<(), String> {
        Err(format!("an instance of {} is not made of parameters", self.kind()))
    }
    fn seats(&self) -> &[Seat];
    fn seats_mut(&mut self) -> &mut [Seat];
    /// The seats are final.
    fn settle(&mut self);
    /// The same instances at other places.
    fn moved(&self, place: &dyn Fn(i32) -> i32) -> Box<dyn Class>;

    fn shape(&self, k: usize) -> &Shape;
    fn facts(&self, k: usize) -> Facts;
    fn bend(&self, k: usize, port: usize) -> f64;

    /// Adds currents to f and charges to q.
    fn values(&self, x: &[f64], gmin: f64, f: &mut [f64], q: &mut [f64]);
    /// Every instance as straight lines at x: `lines` as `Layout` says. `held`: port voltages, four instances side by side.
    fn linearise(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64]) -> Met;
    /// Puts the port voltages of the start into `held`.
    fn start(&self, held: &mut [f64]);
    /// One instance at these port voltages.
    fn at(&self, k: usize, v: &[f64], gmin: f64, line: &mut Line);
    fn limit(&self, k: usize, new: &mut [f64], old: &[f64]) -> bool;
    /// Energy that the charges of an instance hold [J].
    fn energy(&self, k: usize, v: &[f64], gmin: f64) -> f64;
    fn output(&self, k: usize, word: &str, v: &[f64], at: &Line) -> Option<f64>;
    /// Sources of noise of an instance at these port voltages, where its currents are `at`.
    fn noise(&self, k: usize, v: &[f64], at: &Line, each: &mut dyn FnMut(Noise));
    /// Current and charge of each branch as nodes of the graph, of its port voltages and gmin.
    fn symbols(&self, k: usize, g: &mut Graph, v: &[Id], gmin: Id) -> Vec<(Id, Id)>;
}

/// Volts between two unknowns, -1 being ground.
#[inline(always)]
pub fn across(x: &[f64], p: i32, n: i32) -> f64 {
    let at = |k: i32| if k >= 0 { x[k as usize] } else { 0.0 };
    at(p) - at(n)
}

/// Nodes and weights of Gauss-Legendre's rule of order 6 on [0, 1].
pub const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// The integral of f over s from 0 to 1, where s v are the voltages of ports, on intervals of 50 mV at most.
pub fn by_panels(v: &[f64], mut f: impl FnMut(f64) -> f64) -> f64 {
    let panels = (v.iter().fold(0.0_f64, |m, v| m.max(v.abs())) / 0.05).ceil().clamp(1.0, 400.0);
    let nodes = (0..panels as usize).flat_map(|panel| GAUSS.map(|(c, weight)| ((panel as f64 + c) / panels, weight)));
    nodes.map(|(s, weight)| weight / panels * f(s)).sum()
}

/// The instances of a `Device`.
pub struct Instances<D, const P: usize, const B: usize, const K: usize> {
    seats: Vec<Seat>,
    cards: Vec<Card<K>>,
    shapes: Vec<Shape>,
    exponential: Vec<bool>,
    wires: Vec<Wires<P, B>>,
    #[cfg(target_arch = "x86_64")]
    fours: Vec<Four<P, K>>, // none where the processor has no registers of four
    law: PhantomData<fn() -> D>,
}

/// Of one instance, as evaluations read them.
#[derive(Clone)]
struct Wires<const P: usize, const B: usize> {
    ports: [(i32, i32); P],
    rows: [[i32; 4]; B],
}

/// Constants of up to four instances; the last one's stand for those that are missing.
#[cfg(target_arch = "x86_64")]
#[derive(Clone)]
struct Four<const P: usize, const K: usize> {
    has: u32,
    of: [[f64; LANES]; K],
    ports: [(Places, Places); P],
}

#[cfg(target_arch = "x86_64")]
impl<const P: usize, const K: usize> Constants<V> for Four<P, K> {
    #[inline(always)]
    fn at(&self, k: usize) -> V {
        V::load(&self.of[k])
    }
}

/// Constants in a graph.
struct Symbols<'a, const K: usize> {
    g: &'a RefCell<Graph>,
    of: &'a [f64; K],
}

impl<'a, const K: usize> Constants<Sym<'a>> for Symbols<'a, K> {
    fn at(&self, k: usize) -> Sym<'a> {
        Sym { g: self.g, id: self.g.borrow_mut().constant(self.of[k]) }
    }
}

/// Straight lines of one instance or four: the voltages asked for, those they are about, and the law there.
struct Lines<L, const P: usize, const B: usize> {
    v: [L; P],
    at: [L; P],
    flow: Flow<Dual<L, P>, B>,
}

impl<L: Lane, const P: usize, const B: usize> Lines<L, P, B> {
    /// i + a q of branch j at v, and its slopes.
    #[inline(always)]
    fn stage(&self, j: usize, a: L) -> (L, [L; P]) {
        let (i, q) = (&self.flow.i[j], &self.flow.q[j]);
        let (mut sum, mut slopes) = (i.v + a * q.v, self.v);
        let mut k = 0;
        while k < P {
            slopes[k] = i.d[k] + a * q.d[k];
            sum = sum + slopes[k] * (self.v[k] - self.at[k]);
            k += 1;
        }
        (sum, slopes)
    }
}

/// Rows of numbers, by one or by four.
trait Rows<L> {
    fn read(&self, row: usize) -> L;
    fn write(&mut self, row: usize, v: L);
}

/// One instance's place in a group.
struct Single<'a> {
    group: &'a mut [f64],
    lane: usize,
}

impl Rows<f64> for Single<'_> {
    #[inline(always)]
    fn read(&self, row: usize) -> f64 {
        self.group[row * LANES + self.lane]
    }

    #[inline(always)]
    fn write(&mut self, row: usize, v: f64) {
        self.group[row * LANES + self.lane] = v;
    }
}

#[cfg(target_arch = "x86_64")]
struct Group<'a>(&'a mut [[f64; LANES]]);

#[cfg(target_arch = "x86_64")]
impl Rows<V> for Group<'_> {
    #[inline(always)]
    fn read(&self, row: usize) -> V {
        V::load(&self.0[row])
    }

    #[inline(always)]
    fn write(&mut self, row: usize, v: V) {
        self.0[row] = v.store();
    }
}

impl<L: Lane, const P: usize, const B: usize> Lines<L, P, B> {
    /// Leaves the numbers; false where a current is not near the line that is there.
    #[inline(always)]
    fn put(&self, rows: &mut impl Rows<L>, a: f64, near: Option<Near>) -> bool {
        let layout = const { Layout { ports: P, branches: B } };
        let mut good = true;
        let mut j = 0;
        while j < B {
            let (current, slopes) = self.stage(j, L::all(a));
            if let Some(near) = near {
                let mut line = rows.read(layout.row(Number::StageCurrent(j)));
                let mut worth = L::all(near.share) * current.abs().largest(L::all(near.least));
                let mut k = 0;
                while k < P {
                    let led = rows.read(layout.row(Number::StageConductance(j, k)));
                    line = line + led * (self.v[k] - rows.read(layout.row(Number::Voltage(k))));
                    worth = worth + slopes[k].abs() * (L::all(near.reltol) * self.v[k].abs() + L::all(near.vntol));
                    k += 1;
                }
                // (a number that is none is not near anything)
                good &= L::everywhere((current - line).abs().lt(worth + L::all(f64::MIN_POSITIVE)));
            }
            rows.write(layout.row(Number::StageCurrent(j)), current);
            rows.write(layout.row(Number::Current(j)), self.flow.i[j].v);
            rows.write(layout.row(Number::Charge(j)), self.flow.q[j].v);
            let mut k = 0;
            while k < P {
                rows.write(layout.row(Number::StageConductance(j, k)), slopes[k]);
                rows.write(layout.row(Number::Conductance(j, k)), self.flow.i[j].d[k]);
                rows.write(layout.row(Number::Capacitance(j, k)), self.flow.q[j].d[k]);
                k += 1;
            }
            j += 1;
        }
        let mut k = 0;
        while k < P {
            rows.write(layout.row(Number::Voltage(k)), self.v[k]);
            rows.write(layout.row(Number::At(k)), self.at[k]);
            k += 1;
        }
        good
    }
}

impl<D: Device<P, B, K>, const P: usize, const B: usize, const K: usize> Default for Instances<D, P, B, K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<D: Device<P, B, K>, const P: usize, const B: usize, const K: usize> Instances<D, P, B, K> {
    const SPEC: &'static Spec = &D::SPEC;
    const LAYOUT: Layout = Layout { ports: P, branches: B };

    pub fn new() -> Self {
        Instances {
            seats: Vec::new(),
            cards: Vec::new(),
            shapes: Vec::new(),
            exponential: Vec::new(),
            wires: Vec::new(),
            #[cfg(target_arch = "x86_64")]
            fours: Vec::new(),
            law: PhantomData,
        }
    }

    /// Instances that stand between unknown 0 and ground with all of their first nodes.
    #[cfg(test)]
    pub fn of(cards: Vec<Card<K>>) -> Self {
        let mut class = Self::new();
        for card in cards {
            let nodes = std::iter::once(0).chain(std::iter::repeat(-1)).take(D::SPEC.terminals.len());
            let nodes: Vec<i32> =
                nodes.chain(D::SPEC.inner.iter().map(|inner| -(inner.behind.min(1) as i32))).collect();
            class.seat(String::new(), card, nodes, Vec::new());
        }
        class
    }

    fn seat(&mut self, name: String, card: Card<K>, nodes: Vec<i32>, series: Vec<Series>) {
        let rows = D::BRANCHES.iter().map(|&(from, to)| [nodes[from], nodes[to], -1, -1]).collect();
        let (shape, exponential) = Self::read(&card);
        self.seats.push(Seat { name, nodes, rows, series });
        self.shapes.push(shape);
        self.exponential.push(exponential);
        self.cards.push(card);
    }

    /// What hangs on what, read off the law with the instance's own constants; and whether a current is exponential.
    fn read(card: &Card<K>) -> (Shape, bool) {
        let mut g = Graph::new();
        let v: Vec<Id> = (0..P as u32).map(|k| g.unknown(k)).collect();
        let gmin = g.symbol();
        let flows = symbols::<D, P, B, K>(card, &mut g, &v, gmin);
        let mut links = Vec::with_capacity(B * P);
        for &(i, q) in &flows {
            let [current, charge] = [i, q].map(|e| crate::derive::depends(&g, e, &v));
            links.extend(current.into_iter().zip(charge).map(|(current, charge)| Link { current, charge }));
        }
        let currents: Vec<Id> = flows.iter().map(|flow| flow.0).collect();
        let shape = Shape { ports: D::PORTS.to_vec(), branches: D::BRANCHES.to_vec(), links };
        (shape, g.has_exponentials(&currents))
    }

    /// The law's value and slopes at port voltages `at`.
    #[inline(always)]
    fn dual<L: Lane>(c: &impl Constants<L>, has: u32, at: [L; P], gmin: L) -> Flow<Dual<L, P>, B> {
        let mut ports = [Dual::port(at[0], 0); P];
        let mut k = 1;
        while k < P {
            ports[k] = Dual::port(at[k], k);
            k += 1;
        }
        D::law(c, has, ports, gmin)
    }

    /// The instances of one group, from number `first` on, one by one.
    #[inline(never)]
    fn each(&self, first: usize, asked: &Asked, held: &mut [f64], lines: &mut [f64], met: &mut Met) {
        let group = self.cards.iter().zip(&self.wires).skip(first).take(LANES);
        for (lane, (card, wires)) in group.enumerate() {
            let v: [f64; P] = std::array::from_fn(|p| across(asked.x, wires.ports[p].0, wires.ports[p].1));
            let mut at = v;
            if asked.limit {
                met.moved |= D::limit(card, &mut at, &std::array::from_fn(|p| held[p * LANES + lane]));
            }
            at.iter().enumerate().for_each(|(p, v)| held[p * LANES + lane] = *v);
            let flow = Self::dual(&card.of, card.has, at, asked.gmin);
            let mut rows = Single { group: lines, lane };
            met.apart |= !Lines { v, at, flow }.put(&mut rows, asked.a, asked.near);
        }
    }

    /// All instances, by fours.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn wide(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64]) -> Met {
        let mut met = Met::default();
        let (mut held, mut lines) = (in_blocks_mut(held), in_blocks_mut(lines));
        for (n, four) in self.fours.iter().enumerate() {
            let (own, rest) = held.split_at_mut(P);
            let (rows, others) = lines.split_at_mut(Self::LAYOUT.numbers());
            (held, lines) = (rest, others);
            let mut v = [V::all(0.0); P];
            let mut old = v;
            let mut k = 0;
            while k < P {
                v[k] = V::gather(asked.x, &four.ports[k].0) - V::gather(asked.x, &four.ports[k].1);
                old[k] = V::load(&own[k]);
                k += 1;
            }
            if asked.limit && !D::quiet(four, v, old).all() {
                self.each(n * LANES, asked, own.as_flattened_mut(), rows.as_flattened_mut(), &mut met);
                continue;
            }
            let mut k = 0;
            while k < P {
                own[k] = v[k].store();
                k += 1;
            }
            let flow = Self::dual(four, four.has, v, V::all(asked.gmin));
            met.apart |= !Lines { v, at: v, flow }.put(&mut Group(rows), asked.a, asked.near);
        }
        met
    }

    fn ports_of(v: &[f64]) -> &[f64; P] {
        v.try_into().expect("a voltage for each port")
    }
}

/// The law of one instance as nodes of the graph.
fn symbols<D: Device<P, B, K>, const P: usize, const B: usize, const K: usize>(
    card: &Card<K>,
    g: &mut Graph,
    v: &[Id],
    gmin: Id,
) -> Vec<(Id, Id)> {
    let graph = RefCell::new(std::mem::take(g));
    let sym = |id: Id| Sym { g: &graph, id };
    let ports: [Sym; P] = std::array::from_fn(|k| sym(v[k]));
    let flow = D::law(&Symbols { g: &graph, of: &card.of }, card.has, ports, sym(gmin));
    let flows = flow.i.iter().zip(&flow.q).map(|(i, q)| (i.id, q.id)).collect();
    *g = graph.into_inner();
    flows
}

impl<D: Device<P, B, K>, const P: usize, const B: usize, const K: usize> Class for Instances<D, P, B, K> {
    fn kind(&self) -> &str {
        Self::SPEC.name
    }

    fn terminals(&self) -> usize {
        Self::SPEC.terminals.len()
    }

    fn ports(&self) -> usize {
        P
    }

    fn room(&self, count: usize) -> usize {
        Self::LAYOUT.room(count)
    }

    fn place(&self, instance: usize, number: Number) -> usize {
        Self::LAYOUT.place(instance, number)
    }

    fn add(
        &mut self,
        name: &str,
        terminals: &[i32],
        model: &HashMap<String, f64>,
        instance: &HashMap<String, f64>,
        at: Climate,
        inner: &mut dyn FnMut(&str) -> usize,
    ) -> Result<(), String> {
        let spec = Self::SPEC;
        if terminals.len() != spec.terminals.len() {
            return Err(format!("a {} has {} terminals", spec.name, spec.terminals.len()));
        }
        let card = D::card(&Given::new(model, spec.model), &Given::new(instance, spec.instance), at)?;
        let (mut nodes, mut series) = (terminals.to_vec(), Vec::new());
        for (k, Inner { name, behind }) in spec.inner.iter().enumerate() {
            let outer = terminals[*behind];
            nodes.push(match D::series(&card, k) {
                None => outer,
                Some(conductance) => {
                    let inner = inner(name);
                    series.push(Series { terminal: *behind, outer, inner, conductance });
                    inner as i32
                }
            });
        }
        self.seat(name.to_string(), card, nodes, series);
        Ok(())
    }

    fn seats(&self) -> &[Seat] {
        &self.seats
    }

    fn seats_mut(&mut self) -> &mut [Seat] {
        &mut self.seats
    }

    fn settle(&mut self) {
        let wires = |seat: &Seat| Wires {
            ports: D::PORTS.map(|(from, to)| (seat.nodes[from], seat.nodes[to])),
            rows: std::array::from_fn(|j| seat.rows[j]),
        };
        self.wires = self.seats.iter().map(wires).collect();
        #[cfg(target_arch = "x86_64")]
        if vectors() {
            let four = |cards: &[Card<K>], wires: &[Wires<P, B>]| {
                let place = |lane: usize, p: usize| wires.get(lane).map_or((-1, -1), |w| w.ports[p]);
                Four {
                    has: cards.iter().fold(0, |has, card| has | card.has),
                    of: std::array::from_fn(|k| std::array::from_fn(|lane| cards[lane.min(cards.len() - 1)].of[k])),
                    ports: std::array::from_fn(|p| {
                        let ends: [(i32, i32); LANES] = std::array::from_fn(|lane| place(lane, p));
                        (Places::new(ends.map(|e| e.0)), Places::new(ends.map(|e| e.1)))
                    }),
                }
            };
            self.fours = self.cards.chunks(LANES).zip(self.wires.chunks(LANES)).map(|(c, w)| four(c, w)).collect();
        }
    }

    fn moved(&self, place: &dyn Fn(i32) -> i32) -> Box<dyn Class> {
        let mut other = Self::new();
        other.cards.clone_from(&self.cards);
        other.shapes.clone_from(&self.shapes);
        other.exponential.clone_from(&self.exponential);
        other.seats.clone_from(&self.seats);
        for seat in &mut other.seats {
            seat.nodes.iter_mut().chain(seat.rows.as_flattened_mut()).for_each(|k| *k = place(*k));
            for series in &mut seat.series {
                (series.outer, series.inner) = (place(series.outer), place(series.inner as i32) as usize);
            }
        }
        Box::new(other)
    }

    fn shape(&self, k: usize) -> &Shape {
        &self.shapes[k]
    }

    fn facts(&self, k: usize) -> Facts {
        Facts { exponential: self.exponential[k], passive: D::PASSIVE }
    }

    fn bend(&self, k: usize, port: usize) -> f64 {
        D::bend(&self.cards[k], port)
    }

    fn values(&self, x: &[f64], gmin: f64, f: &mut [f64], q: &mut [f64]) {
        for (card, wires) in self.cards.iter().zip(&self.wires) {
            let v: [f64; P] = std::array::from_fn(|p| across(x, wires.ports[p].0, wires.ports[p].1));
            let flow = D::law(&card.of, card.has, v, gmin);
            for (j, rows) in wires.rows.iter().enumerate() {
                add(f, rows, flow.i[j]);
                add(q, rows, flow.q[j]);
            }
        }
    }

    fn linearise(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64]) -> Met {
        #[cfg(target_arch = "x86_64")]
        if !self.fours.is_empty() {
            // SAFETY: there are none where the processor has not AVX2 and FMA (`settle`)
            return unsafe { self.wide(asked, held, lines) };
        }
        let mut met = Met::default();
        let groups = held.chunks_mut(P * LANES).zip(lines.chunks_mut(Self::LAYOUT.numbers() * LANES));
        for (n, (held, lines)) in groups.enumerate() {
            self.each(n * LANES, asked, held, lines, &mut met);
        }
        met
    }

    fn start(&self, held: &mut [f64]) {
        for (k, card) in self.cards.iter().enumerate() {
            for (p, v) in D::start(card).into_iter().enumerate() {
                held[(k / LANES * P + p) * LANES + k % LANES] = v;
            }
        }
    }

    fn at(&self, k: usize, v: &[f64], gmin: f64, line: &mut Line) {
        let card = &self.cards[k];
        let flow = Self::dual(&card.of, card.has, *Self::ports_of(v), gmin);
        let fill = |values: &mut Vec<f64>, slopes: &mut Vec<f64>, of: &[Dual<f64, P>; B]| {
            values.clear();
            slopes.clear();
            values.extend(of.iter().map(|d| d.v));
            slopes.extend(of.iter().flat_map(|d| d.d));
        };
        fill(&mut line.i, &mut line.g, &flow.i);
        fill(&mut line.q, &mut line.c, &flow.q);
    }

    fn limit(&self, k: usize, new: &mut [f64], old: &[f64]) -> bool {
        D::limit(&self.cards[k], new.try_into().expect("a voltage for each port"), Self::ports_of(old))
    }

    fn energy(&self, k: usize, v: &[f64], gmin: f64) -> f64 {
        let (card, shape, v) = (&self.cards[k], &self.shapes[k], Self::ports_of(v));
        if let Some(energy) = D::energy(card, v, gmin) {
            return energy;
        }
        if !shape.stores_any() {
            return 0.0;
        }
        // dE = sum of v_j dq_j of the branches whose voltage is a port's, along s v
        by_panels(v, |s| {
            let flow = Self::dual(&card.of, card.has, v.map(|v| s * v), gmin);
            let rate = |d: &[f64; P]| d.iter().zip(v).map(|(c, v)| c * v).sum::<f64>();
            let each = |(j, d): (usize, &[f64; P])| rate(d) * s * shape.own_port(j).map_or(0.0, |p| v[p]);
            flow.q.iter().map(|q| &q.d).enumerate().map(each).sum()
        })
    }

    fn output(&self, k: usize, word: &str, v: &[f64], at: &Line) -> Option<f64> {
        D::output(&self.cards[k], word, Self::ports_of(v), at)
    }

    fn noise(&self, k: usize, _: &[f64], at: &Line, each: &mut dyn FnMut(Noise)) {
        D::noise(&self.cards[k], at, each);
    }

    fn symbols(&self, k: usize, g: &mut Graph, v: &[Id], gmin: Id) -> Vec<(Id, Id)> {
        symbols::<D, P, B, K>(&self.cards[k], g, v, gmin)
    }
}

/// y <- y + v in the rows of a branch, with the signs + - + -.
#[inline(always)]
pub fn add(y: &mut [f64], rows: &[i32; 4], v: f64) {
    for pair in rows.chunks_exact(2) {
        if pair[0] >= 0 {
            y[pair[0] as usize] += v;
        }
        if pair[1] >= 0 {
            y[pair[1] as usize] -= v;
        }
    }
}
