//! Loops whose end hangs on what they compute: `while (abs(dx) > tolerance) ...` of a voltage.
//!
//! A loop is a law of its own: of what it carries from pass to pass, and of what goes in and stays. It is run as it stands, pass by
//! pass, by a program of its own; in a graph it is a call of that law with several results, `Node::Result` of a list of arguments
//! (`Node::Join`): where each carried value begins, then what goes in. So machine code, interpreter and batches know no more of loops
//! than how to call one.
//!
//! Its derivatives are those of what it computes: a second loop carries values and tangents side by side, and repeats as often. A
//! condition chooses how often, and has no slope.
//!
//! Graph, derivatives and programs call loops, which are made of these: the one knot of this crate (`super::` below and there).
use super::alike;
use super::tape::{Inputs, Tape};
use crate::derive;
use crate::graph::{Graph, Id, Node};
use crate::interrupt;
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// More passes than any loop makes that ends, and more statements than a model has, even with its loops.
pub const MOST_STEPS: usize = 1_000_000;

/// One pass. Carried values are the first unknowns of its graph, what goes in follows.
#[derive(Clone, Serialize, Deserialize)]
pub struct Law {
    graph: Graph,
    /// another pass, where it is not 0
    condition: Id,
    /// what is carried on, of each carried value
    next: Vec<Id>,
    /// where it stands in the text
    at: String,
}

pub struct Loop {
    law: Law,
    program: OnceLock<Tape>,
}

/// A loop that carries tangents too: where the results of each direction are, and the arguments.
struct Tangent {
    number: u32,
    /// results of each direction, by the carried value
    places: Vec<BTreeMap<usize, u32>>,
    /// ... which are expressions of the arguments, its unknowns, and of symbols: their tangents, by direction and argument
    graph: Graph,
    arguments: Vec<Id>,
    dots: HashMap<Node, (usize, usize)>,
}

/// All loops there are, by number: a graph can be copied to any other. They stay: machine code has their addresses.
#[derive(Default)]
struct All {
    loops: Vec<&'static Loop>,
    numbers: HashMap<(Vec<Node>, Id, Vec<Id>, String), u32>,
    tangents: HashMap<(u32, Vec<Vec<usize>>), &'static Tangent>,
}

fn all() -> MutexGuard<'static, All> {
    static ALL: OnceLock<Mutex<All>> = OnceLock::new();
    ALL.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner)
}

pub fn of(number: u32) -> &'static Loop {
    all().loops[number as usize]
}

/// The number of a loop; equal ones are one.
pub fn number(law: Law) -> u32 {
    let nodes = (0..law.graph.len() as Id).map(|id| law.graph.node(id)).collect();
    let key = (nodes, law.condition, law.next.clone(), law.at.clone());
    let mut all = all();
    if let Some(&known) = all.numbers.get(&key) {
        return known;
    }
    let number = all.loops.len() as u32;
    all.loops.push(Box::leak(Box::new(Loop { law, program: OnceLock::new() })));
    all.numbers.insert(key, number);
    number
}

/// The loop of these expressions, whose leaves `carried` are what a pass begins with, and what goes in: all that does not hang on
/// them, constants too, so that a loop is the same one whatever the parameters.
pub fn made(g: &Graph, carried: &[Id], condition: Id, next: &[Id], at: &str) -> (u32, Vec<Id>) {
    let outs: Vec<Id> = std::iter::once(condition).chain(next.iter().copied()).collect();
    let (leaves, mut moves): (HashSet<&Id>, HashMap<Id, bool>) = (carried.iter().collect(), HashMap::default());
    for id in g.reachable(&outs) {
        let on = leaves.contains(&id) || g.node(id).operands().any(|o| moves[&o]);
        moves.insert(id, on);
    }
    // what is read by what moves, lists and all
    let mut read: HashSet<Id> = outs.iter().copied().collect();
    for id in g.reachable(&outs).into_iter().rev() {
        if moves[&id] || read.contains(&id) && matches!(g.node(id), Node::Join(..)) {
            read.extend(g.node(id).operands());
        }
    }
    let (mut law, mut inputs) = (Graph::new(), Vec::new());
    let mut image: HashMap<Id, Id> = HashMap::default();
    for (k, &leaf) in carried.iter().enumerate() {
        image.insert(leaf, law.unknown(k as u32));
    }
    for id in g.in_order(&outs).into_iter().filter(|id| read.contains(id)) {
        let node = g.node(id);
        let new = match g.value(id).filter(|&v| v == 0.0 || v == 1.0) {
            _ if image.contains_key(&id) => continue,
            Some(v) => law.constant(v),
            None if !moves[&id] && !matches!(node, Node::Join(..)) => {
                inputs.push(id);
                law.unknown((carried.len() + inputs.len()) as u32 - 1)
            }
            None => {
                let mut operands = [0; 3];
                node.operands().enumerate().for_each(|(k, o)| operands[k] = image[&o]);
                law.rebuild(node, operands)
            }
        };
        image.insert(id, new);
    }
    let outs: Vec<Id> = outs.iter().map(|id| image[id]).collect();
    let outs = pruned(&mut law, &outs);
    let law = Law { condition: outs[0], next: outs[1..].to_vec(), graph: law, at: at.into() };
    (number(law), inputs)
}

/// The same expressions by loops that carry no more than is read of them. Two walks: from the end for what is read, whose loops
/// read less of their arguments by that, and from the beginning to make it.
pub fn pruned(g: &mut Graph, outs: &[Id]) -> Vec<Id> {
    let order = g.reachable(outs);
    let mut read: HashSet<Id> = outs.iter().copied().collect();
    let mut results: HashMap<Id, BTreeMap<u32, Vec<u32>>> = HashMap::default();
    let mut kept: HashMap<(Id, u32), Vec<usize>> = HashMap::default();
    let mut whole = true;
    for &id in order.iter().rev() {
        match g.node(id) {
            // the results of a list come behind it: all that are read are known
            Node::Join(..) => {
                for (number, results) in results.remove(&id).into_iter().flatten() {
                    let (law, old) = (&of(number).law, g.listed(id));
                    let carried = law.needed(&results);
                    whole &= carried.len() == law.next.len();
                    read.extend(law.inputs(&carried).into_iter().chain(carried.iter().copied()).map(|k| old[k]));
                    kept.insert((id, number), carried);
                }
            }
            Node::Result(number, k, list) if read.contains(&id) => {
                results.entry(list).or_default().entry(number).or_default().push(k);
            }
            node if read.contains(&id) => read.extend(node.operands()),
            _ => {}
        }
    }
    if whole {
        return outs.to_vec();
    }
    let (mut image, mut calls): (HashMap<Id, Id>, HashMap<(Id, u32), (u32, Id)>) = Default::default();
    for id in order.into_iter().filter(|id| read.contains(id)) {
        let node = g.node(id);
        let new = if let Node::Result(number, k, list) = node {
            let kept = &kept[&(list, number)];
            let (less, list) = *calls.entry((list, number)).or_insert_with(|| {
                let (law, old) = (&of(number).law, g.listed(list));
                let carried: Vec<Id> = kept.iter().map(|&k| law.graph.clone().unknown(k as u32)).collect();
                let next: Vec<Id> = kept.iter().map(|&k| law.next[k]).collect();
                let (less, inputs) = made(&law.graph, &carried, law.condition, &next, &law.at);
                let arguments: Vec<Id> = carried.into_iter().chain(inputs).collect();
                let argument = |node, _: &mut Graph| match node {
                    Node::Unknown(k) => Some(image[&old[k as usize]]),
                    _ => None,
                };
                let arguments = law.graph.copied(&arguments, g, argument);
                (less, g.list(&arguments))
            });
            let place = kept.iter().position(|&c| c == k as usize).unwrap_or(0);
            g.result(less, place as u32, list)
        } else {
            let mut operands = [0; 3];
            node.operands().enumerate().for_each(|(k, o)| operands[k] = image[&o]);
            g.rebuild(node, operands)
        };
        image.insert(id, new);
    }
    outs.iter().map(|id| image[id]).collect()
}

impl Law {
    /// Which carried values these results, the condition and each other hang on.
    fn needed(&self, results: &[u32]) -> Vec<usize> {
        let carried = |outs: &[Id]| -> Vec<usize> {
            self.graph.unknowns(outs).into_iter().filter(|&k| k < self.next.len()).collect()
        };
        let mut open: Vec<usize> = results.iter().map(|&k| k as usize).chain(carried(&[self.condition])).collect();
        let mut kept = vec![false; self.next.len()];
        while let Some(k) = open.pop() {
            if !std::mem::replace(&mut kept[k], true) {
                open.extend(carried(&[self.next[k]]));
            }
        }
        (0..kept.len()).filter(|&k| kept[k]).collect()
    }

    /// What goes in and is read where these values are carried.
    fn inputs(&self, carried: &[usize]) -> Vec<usize> {
        let outs: Vec<Id> = carried.iter().map(|&k| self.next[k]).chain([self.condition]).collect();
        self.graph.unknowns(&outs).into_iter().filter(|&k| k >= self.next.len()).collect()
    }

    /// Carried values that move where these arguments do.
    fn moved(&self, arguments: &[usize]) -> Vec<usize> {
        let reads: Vec<Vec<usize>> = self.next.iter().map(|&e| self.graph.unknowns(&[e])).collect();
        let count = reads.iter().flatten().chain(arguments).map(|k| k + 1).max().unwrap_or(0).max(self.next.len());
        let mut moves = vec![false; count];
        arguments.iter().for_each(|&k| moves[k] = true);
        while let Some(k) = (0..self.next.len()).find(|&k| !moves[k] && reads[k].iter().any(|&j| moves[j])) {
            moves[k] = true;
        }
        (0..self.next.len()).filter(|&k| moves[k]).collect()
    }

    /// Values and tangents, of each direction by the arguments that move in it.
    fn tangent(&self, directions: &[Vec<usize>]) -> Tangent {
        let mut g = self.graph.clone();
        let mut carried: Vec<Id> = (0..self.next.len() as u32).map(|k| g.unknown(k)).collect();
        let (mut next, mut places) = (self.next.clone(), Vec::new());
        let mut dots: HashMap<Node, (usize, usize)> = HashMap::default();
        for (d, moving) in directions.iter().enumerate() {
            let (mut seeds, mut place) = (Vec::new(), BTreeMap::new());
            let own = self.moved(moving);
            for &k in &own {
                let dot = g.symbol();
                seeds.push((g.unknown(k as u32), dot));
                place.insert(k, carried.len() as u32);
                carried.push(dot);
                dots.insert(g.node(dot), (d, k));
            }
            for &k in moving.iter().filter(|&&k| k >= self.next.len()) {
                let dot = g.symbol();
                seeds.push((g.unknown(k as u32), dot));
                dots.insert(g.node(dot), (d, k));
            }
            let of: Vec<Id> = own.iter().map(|&k| self.next[k]).collect();
            next.extend(derive::tangent(&mut g, &of, &seeds));
            places.push(place);
        }
        let (number, inputs) = made(&g, &carried, self.condition, &next, &self.at);
        let arguments = carried.into_iter().chain(inputs).collect();
        Tangent { number, places, graph: g, arguments, dots }
    }
}

/// Results of a loop along directions: the tangents of its arguments in each, where they have any.
pub fn tangents(g: &mut Graph, (number, k, list): (u32, u32, Id), dots: &[BTreeMap<usize, Id>]) -> Vec<Id> {
    if alike::is(number) {
        let along = |dot: &BTreeMap<usize, Id>| {
            let by: Vec<usize> = dot.keys().copied().collect();
            let slopes = alike::slopes(g, (number, k, list), &by);
            let zero = g.constant(0.0);
            slopes.into_iter().zip(dot.values()).fold(zero, |sum, (slope, &dot)| {
                let term = g.mul(slope, dot);
                g.add(sum, term)
            })
        };
        return dots.iter().map(along).collect();
    }
    let key = (number, dots.iter().map(|d| d.keys().copied().collect()).collect::<Vec<Vec<usize>>>());
    let known = all().tangents.get(&key).copied();
    let tangent = known.unwrap_or_else(|| {
        let made: &'static Tangent = Box::leak(Box::new(of(number).law.tangent(&key.1)));
        all().tangents.insert(key, made);
        made
    });
    let (old, zero) = (g.listed(list), g.constant(0.0));
    let leaf = |node, _: &mut Graph| match node {
        Node::Unknown(k) => Some(old[k as usize]),
        Node::Symbol(_) => tangent.dots.get(&node).map(|(d, k)| dots[*d].get(k).copied().unwrap_or(zero)),
        _ => None,
    };
    let arguments = tangent.graph.copied(&tangent.arguments, g, leaf);
    let list = g.list(&arguments);
    let place = |of: &BTreeMap<usize, u32>| of.get(&(k as usize)).copied();
    tangent.places.iter().map(|of| place(of).map_or(zero, |at| g.result(tangent.number, at, list))).collect()
}

/// Of a result: the arguments that move, and its slope by each.
pub fn partials(g: &mut Graph, of: (u32, u32, Id), moves: &impl Fn(Id) -> bool) -> Vec<(Id, Id)> {
    let moving: Vec<(usize, Id)> = g.listed(of.2).into_iter().enumerate().filter(|a| moves(a.1)).collect();
    if alike::is(of.0) {
        let by: Vec<usize> = moving.iter().map(|a| a.0).collect();
        return moving.into_iter().map(|a| a.1).zip(alike::slopes(g, of, &by)).collect();
    }
    let one = g.constant(1.0);
    let dots: Vec<BTreeMap<usize, Id>> = moving.iter().map(|a| BTreeMap::from([(a.0, one)])).collect();
    moving.into_iter().map(|a| a.1).zip(tangents(g, of, &dots)).collect()
}

/// ... its tangent, by those of its arguments.
pub fn tangent(g: &mut Graph, of: (u32, u32, Id), dot: &HashMap<Id, Id>) -> Id {
    let zero = g.constant(0.0);
    let dots = g.listed(of.2).into_iter().enumerate().map(|(j, a)| (j, dot[&a])).filter(|d| d.1 != zero);
    let dots: BTreeMap<usize, Id> = dots.collect();
    tangents(g, of, &[dots])[0]
}

/// ... its slopes by leaves, by those of its arguments.
pub fn slopes(g: &mut Graph, of: (u32, u32, Id), dots: &HashMap<Id, BTreeMap<usize, Id>>) -> BTreeMap<usize, Id> {
    let mut along: BTreeMap<usize, BTreeMap<usize, Id>> = BTreeMap::new();
    for (j, a) in g.listed(of.2).into_iter().enumerate() {
        for (&x, &d) in dots.get(&a).into_iter().flatten() {
            along.entry(x).or_default().insert(j, d);
        }
    }
    let directions: Vec<BTreeMap<usize, Id>> = along.values().cloned().collect();
    along.into_keys().zip(tangents(g, of, &directions)).collect()
}

/// How many results a call of a loop has: all of them; of a program those that were asked for.
pub fn results(number: u32) -> Option<usize> {
    (!alike::is(number)).then(|| of(number).law.next.len())
}

pub fn has_exponentials(number: u32) -> bool {
    if alike::is(number) {
        return alike::of(number).exponential;
    }
    let law = &of(number).law;
    law.graph.has_exponentials(&law.next)
}

/// A result for arguments that are numbers.
pub fn value(number: u32, k: u32, arguments: &[f64]) -> f64 {
    if alike::is(number) {
        return alike::value(number, k, arguments);
    }
    let mut results = vec![0.0; of(number).law.next.len()];
    run(number, arguments, &mut results);
    results[k as usize]
}

/// A call of a loop, or of the program of a form.
pub fn run(number: u32, arguments: &[f64], results: &mut [f64]) {
    if alike::is(number) {
        return alike::run(number, arguments, results);
    }
    of(number).run(arguments, results);
}

/// ... for sets of numbers side by side, `width` of each argument and result.
pub fn run_many(number: u32, width: usize, arguments: &[f64], results: &mut [f64]) {
    let mut own = vec![0.0; results.len() / width];
    for k in 0..width {
        let of: Vec<f64> = arguments.iter().skip(k).step_by(width).copied().collect();
        run(number, &of, &mut own);
        results.iter_mut().skip(k).step_by(width).zip(&own).for_each(|(to, v)| *to = *v);
    }
}

impl Loop {
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// The results for these arguments; no numbers where it never ends, which is told where all arguments are numbers.
    pub fn run(&self, arguments: &[f64], results: &mut [f64]) {
        let law = &self.law;
        let make = || Tape::in_parts(&law.graph, &[(&[law.condition], true), (&law.next, true)]).native();
        let program = self.program.get_or_init(make);
        let (mut w, mut x) = (program.workspace(), arguments.to_vec());
        for _ in 0..MOST_STEPS {
            let inputs = Inputs { x: &x, t: 0.0, waves: &[], flags: &[] };
            program.run_part(0, &inputs, &mut w);
            if program.output(&w, 0) == 0.0 {
                results.copy_from_slice(&x[..results.len()]);
                return;
            }
            program.run_part(1, &inputs, &mut w);
            // what comes to where it began comes there for ever
            let mut moved = false;
            for (k, x) in x[..results.len()].iter_mut().enumerate() {
                let next = program.output(&w, k + 1);
                moved |= next.to_bits() != x.to_bits();
                *x = next;
            }
            if !moved {
                break;
            }
        }
        results.fill(f64::NAN);
        if x.iter().all(|v| v.is_finite()) {
            interrupt::fail(format!("{}: this loop does not end: its condition stays true", law.at));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(g: &Graph, ids: &[Id], x: &[f64]) -> Vec<f64> {
        let inputs = Inputs { x, t: 0.0, waves: &[], flags: &[] };
        let tape = Tape::new(g, ids).native();
        let (mut w, slow) = (tape.workspace(), Tape::new(g, ids).eval(&inputs));
        // (Cranelift's code is there once it pays)
        (0..8000).for_each(|_| tape.run(&inputs, &mut w));
        let fast: Vec<f64> = (0..ids.len()).map(|k| tape.output(&w, k)).collect();
        assert_eq!(
            fast.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            slow.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        );
        fast
    }

    /// The root of a, by Newton's method from 1; and a value that nobody reads.
    fn root(g: &mut Graph, a: Id) -> Id {
        let (x, unread, last) = (g.symbol(), g.symbol(), g.symbol());
        let [one, half, least] = [1.0, 0.5, 1e-14].map(|v| g.constant(v));
        let q = g.div(a, x);
        let q = g.add(x, q);
        let next = g.mul(half, q);
        let step = g.sub(next, x);
        let more = g.add(unread, step);
        let size = g.call(crate::graph::Fun::Abs, last);
        let condition = g.not_less(size, least);
        let (number, inputs) = made(g, &[x, unread, last], condition, &[next, more, step], "here");
        let arguments: Vec<Id> = [one, one, one].into_iter().chain(inputs).collect();
        let list = g.list(&arguments);
        g.result(number, 0, list)
    }

    #[test]
    fn a_root_by_a_loop_has_the_slopes_of_the_root() {
        let mut g = Graph::new();
        let (x, y) = (g.unknown(0), g.unknown(1));
        let a = g.mul(x, y);
        let r = root(&mut g, a);
        let e = g.call(crate::graph::Fun::Exp, r);
        let e = pruned(&mut g, &[e])[0];
        let first = derive::slopes(&mut g, &[e], &[x, y])[0].clone();
        let second = derive::gradient(&mut g, first[0], &[x, y]);
        let one = g.constant(1.0);
        let forward = derive::tangent(&mut g, &[e], &[(x, one)])[0];
        let outs: Vec<Id> = [e, forward].into_iter().chain(first).chain(second).collect();
        for at in [[2.0, 3.0], [0.01, 0.5], [40.0, 1.5]] {
            let r = f64::sqrt(at[0] * at[1]);
            let by_x = r.exp() * at[1] / (2.0 * r);
            let by_y = r.exp() * at[0] / (2.0 * r);
            let twice = r.exp() * at[1] * at[1] / (4.0 * r * r) * (1.0 - 1.0 / r);
            let mixed = r.exp() * (0.25 + 0.25 / r);
            let want = [r.exp(), by_x, by_x, by_y, twice, mixed];
            for (got, want) in value(&g, &outs, &at).into_iter().zip(want) {
                assert!((got / want - 1.0).abs() < 1e-12, "{got} {want}");
            }
        }
    }

    #[test]
    fn a_loop_carries_what_is_read_and_survives_writing() {
        let mut g = Graph::new();
        let x = g.unknown(0);
        let r = root(&mut g, x);
        let r = pruned(&mut g, &[r])[0];
        let Node::Result(number, ..) = g.node(r) else { panic!("no loop") };
        assert_eq!(results(number), Some(2));
        let four = g.constant(4.0);
        assert_eq!(derive::substitute(&mut g, &[r], &[(x, four)])[0], g.constant(2.0));
    }
}
