//! Expressions of one form, which differ in their leaves alone, as calls of one program: gaps, speeds and forces of many like pairs.
//!
//! A form is a graph whose unknowns are its arguments, with expressions of them: those that it was made of, and derivatives of these as
//! they are asked for. In other graphs each is a `Node::Result` of the form's number and a list of arguments (`Node::Join`), as those of
//! loops are (repeat.rs). A program computes all expressions of a form that are read for one list.
//!
//! So what is differentiated and made into machine code grows with the number of forms; a call more costs its arguments and results.
use super::tape::{Inputs, Tape};
use crate::derive;
use crate::graph::{Graph, Id, Node};
use rustc_hash::FxHashMap as HashMap;
use std::cell::RefCell;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

impl Node {
    /// The same with its operands numbered anew.
    pub fn numbered(self, n: impl Fn(Id) -> Id) -> Node {
        match self {
            Node::Neg(a) => Node::Neg(n(a)),
            Node::Add(a, b) => Node::Add(n(a), n(b)),
            Node::Sub(a, b) => Node::Sub(n(a), n(b)),
            Node::Mul(a, b) => Node::Mul(n(a), n(b)),
            Node::Div(a, b) => Node::Div(n(a), n(b)),
            Node::Pow(a, b) => Node::Pow(n(a), n(b)),
            Node::Powi(a, k) => Node::Powi(n(a), k),
            Node::Atan2(a, b) => Node::Atan2(n(a), n(b)),
            Node::Call(f, a) => Node::Call(f, n(a)),
            Node::Select(c, a, b) => Node::Select(n(c), n(a), n(b)),
            Node::NotLess(a, b) => Node::NotLess(n(a), n(b)),
            Node::Join(a, b) => Node::Join(n(a), n(b)),
            Node::Result(number, k, a) => Node::Result(number, k, n(a)),
            leaf => leaf,
        }
    }
}

/// What tells forms apart: their nodes, whose operands are numbered by their places, leaves in the order in which they are met; and
/// where their expressions are.
type Key = (Vec<Node>, Vec<Id>);

pub struct Form {
    pub graph: Graph,
    pub outs: Vec<Id>,
    /// do those that it was made of read an argument through an exponential?
    pub exponential: bool,
    places: HashMap<Id, u32>,
    arguments: Vec<Id>,
    /// of an expression by every argument
    slopes: HashMap<u32, Vec<Id>>,
    programs: HashMap<Vec<u32>, u32>,
}

/// All forms and programs there are: they stay, as loops do.
#[derive(Default)]
struct All {
    forms: Vec<&'static Mutex<Form>>,
    numbers: HashMap<Key, u32>,
    programs: Vec<&'static Tape>,
}

fn all() -> MutexGuard<'static, All> {
    static ALL: OnceLock<Mutex<All>> = OnceLock::new();
    ALL.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner)
}

/// Is it the number of a form, or of a program of one? Loops have the others.
pub fn is(number: u32) -> bool {
    number >> 31 == 1
}

pub fn of(number: u32) -> MutexGuard<'static, Form> {
    let form = all().forms[!number as usize];
    form.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The number of a form; equal ones are one.
pub fn number(key: Key, make: impl FnOnce() -> (Graph, Vec<Id>)) -> u32 {
    let mut all = all();
    if let Some(&known) = all.numbers.get(&key) {
        return known;
    }
    let (mut graph, outs) = make();
    let number = !(all.forms.len() as u32);
    let most = (0..graph.len() as Id).filter_map(|id| match graph.node(id) {
        Node::Unknown(k) => Some(k + 1),
        _ => None,
    });
    let most = most.max().unwrap_or(0);
    let arguments = (0..most).map(|k| graph.unknown(k)).collect();
    let places = outs.iter().zip(0..).map(|(&e, k)| (e, k)).collect();
    let form = Form {
        exponential: graph.has_exponentials(&outs),
        graph,
        outs,
        places,
        arguments,
        slopes: HashMap::default(),
        programs: HashMap::default(),
    };
    all.forms.push(Box::leak(Box::new(Mutex::new(form))));
    all.numbers.insert(key, number);
    number
}

/// Each group of expressions as calls of its form, where another group has the same. What is too short for a call, which costs what
/// some tens of operations do, stays as it is: None.
pub fn outlined(g: &mut Graph, groups: &[Vec<Id>]) -> Vec<Option<Vec<Id>>> {
    let read: Vec<(Key, Vec<Id>)> = groups.iter().map(|outs| form(g, outs)).collect();
    let mut counts: HashMap<&Key, usize> = HashMap::default();
    read.iter().for_each(|(key, _)| *counts.entry(key).or_default() += 1);
    let alike: Vec<bool> = read.iter().map(|(key, _)| key.0.len() > 40 && counts[key] > 1).collect();
    let each = groups.iter().zip(read).zip(alike);
    each.map(|((outs, (key, leaves)), alike)| alike.then(|| called(g, outs, key, &leaves))).collect()
}

/// The form of expressions, and the leaves that are its arguments: numbers too, so that shapes of other sizes, in this deck or in the
/// next run of a sweep, have the same form.
fn form(g: &Graph, outs: &[Id]) -> (Key, Vec<Id>) {
    let (mut number, mut leaves): (HashMap<Id, Id>, Vec<Id>) = Default::default();
    let mut nodes = Vec::new();
    for id in g.in_order(outs) {
        number.insert(id, nodes.len() as Id);
        let node = g.node(id);
        nodes.push(if node.is_leaf() && g.value(id) != Some(0.0) && g.value(id) != Some(1.0) {
            leaves.push(id);
            Node::Unknown(leaves.len() as u32 - 1)
        } else {
            node.numbered(|id| number[&id])
        });
    }
    ((nodes, outs.iter().map(|id| number[id]).collect()), leaves)
}

fn called(g: &mut Graph, outs: &[Id], key: Key, leaves: &[Id]) -> Vec<Id> {
    let number = number(key, || {
        let mut graph = Graph::new();
        let arguments: HashMap<Node, u32> = leaves.iter().zip(0..).map(|(&id, k)| (g.node(id), k)).collect();
        let outs = g.copied(outs, &mut graph, |node, to| arguments.get(&node).map(|&k| to.unknown(k)));
        (graph, outs)
    });
    let list = g.list(leaves);
    let made = of(number).outs.clone();
    made.into_iter().take(outs.len()).map(|e| expression(g, (number, list), leaves, e)).collect()
}

/// An expression of a form for a list of arguments.
fn expression(g: &mut Graph, (number, list): (u32, Id), arguments: &[Id], e: Id) -> Id {
    let mut form = of(number);
    match form.graph.node(e) {
        Node::Const(bits) => g.constant(f64::from_bits(bits)),
        Node::Unknown(k) => arguments[k as usize],
        Node::Neg(e) => {
            drop(form);
            let positive = expression(g, (number, list), arguments, e);
            g.neg(positive)
        }
        _ => {
            let next = form.outs.len() as u32;
            let k = *form.places.entry(e).or_insert(next);
            if k == next {
                form.outs.push(e);
            }
            drop(form);
            g.result(number, k, list)
        }
    }
}

impl Form {
    fn slopes(&mut self, k: u32, by: &[usize]) -> Vec<Id> {
        let made = self
            .slopes
            .entry(k)
            .or_insert_with(|| derive::gradient(&mut self.graph, self.outs[k as usize], &self.arguments));
        by.iter().map(|&j| made[j]).collect()
    }
}

/// Of a result its slope by these arguments.
pub fn slopes(g: &mut Graph, (number, k, list): (u32, u32, Id), by: &[usize]) -> Vec<Id> {
    let made = of(number).slopes(k, by);
    let arguments = g.listed(list);
    made.into_iter().map(|e| expression(g, (number, list), &arguments, e)).collect()
}

/// What a result stands for, in the graph that calls it.
pub fn inlined(g: &mut Graph, (number, k, list): (u32, u32, Id)) -> Id {
    let (arguments, form) = (g.listed(list), of(number));
    let argument = |node, _: &mut Graph| match node {
        Node::Unknown(j) => Some(arguments[j as usize]),
        _ => None,
    };
    form.graph.copied(&[form.outs[k as usize]], g, argument)[0]
}

/// The number of the program of these expressions of a form.
pub fn program(number: u32, read: &[u32]) -> u32 {
    let mut form = of(number);
    if let Some(&known) = form.programs.get(read) {
        return known;
    }
    let outs: Vec<Id> = read.iter().map(|&k| form.outs[k as usize]).collect();
    let tape: &'static Tape = Box::leak(Box::new(Tape::new(&form.graph, &outs).native_into()));
    let mut all = all();
    all.programs.push(tape);
    let made = !(all.programs.len() as u32 - 1);
    form.programs.insert(read.to_vec(), made);
    made
}

/// The value of one expression.
pub fn value(number: u32, k: u32, arguments: &[f64]) -> f64 {
    let form = of(number);
    let inputs = Inputs { x: arguments, t: 0.0, waves: &[], flags: &[] };
    Tape::new(&form.graph, &[form.outs[k as usize]]).eval(&inputs)[0]
}

/// Runs a program.
pub fn run(program: u32, arguments: &[f64], results: &mut [f64]) {
    // of each program the workspace of this thread
    thread_local!(static WORK: RefCell<HashMap<u32, (&'static Tape, Vec<f64>)>> = RefCell::default());
    let (tape, mut w) = WORK.with_borrow_mut(|work| work.remove(&program)).unwrap_or_else(|| {
        let tape = all().programs[!program as usize];
        (tape, tape.workspace())
    });
    tape.run_into(0, &Inputs { x: arguments, t: 0.0, waves: &[], flags: &[] }, &mut w, results);
    WORK.with_borrow_mut(|work| work.insert(program, (tape, w)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Fun;

    /// Of a pair, by its leaves: a distance, and a product of it with something else.
    fn pair(g: &mut Graph, [x, y, f]: [Id; 3]) -> Vec<Id> {
        let mut distance = g.constant(0.0);
        for k in 1..20 {
            let c = g.constant(f64::from(k));
            let (u, v) = (g.mul(c, x), g.sub(y, c));
            let (u, v) = (g.call(Fun::Sin, u), g.mul(v, v));
            let term = g.mul(u, v);
            distance = g.add(distance, term);
        }
        let zero = g.constant(0.0);
        let pressed = g.select(f, distance, zero);
        let product = g.mul(y, pressed);
        vec![distance, product, x, zero]
    }

    fn values(g: &Graph, outs: &[Id]) -> Vec<f64> {
        let x = [0.3, -0.7, 1.9, 0.4, 2.5, -1.1];
        let inputs = Inputs { x: &x, t: 0.0, waves: &[], flags: &[1.0, 0.0, 1.0] };
        let (slow, tape) = (Tape::new(g, outs).eval(&inputs), Tape::new(g, outs).native());
        let mut w = tape.workspace();
        // (Cranelift's code is there once it pays)
        (0..8000).for_each(|_| tape.run(&inputs, &mut w));
        let fast: Vec<f64> = (0..outs.len()).map(|k| tape.output(&w, k)).collect();
        assert_eq!(fast, slow);
        slow
    }

    /// like pairs have the values, slopes and second slopes of each by itself, in a program whose length is that of their calls
    #[test]
    fn like_expressions_are_calls_of_one_program() {
        let mut g = Graph::new();
        let leaves: Vec<[Id; 3]> = (0..3).map(|k| [g.unknown(2 * k), g.unknown(2 * k + 1), g.flag(k)]).collect();
        let groups: Vec<Vec<Id>> = leaves.iter().map(|&of| pair(&mut g, of)).collect();
        let other = vec![g.call(Fun::Exp, leaves[0][0])];
        let made = outlined(&mut g, &[groups.clone(), vec![other]].concat());
        assert_eq!(made[3], None);
        let mut all: [Vec<Id>; 2] = Default::default();
        for (k, own) in groups.iter().enumerate() {
            let like = made[k].clone().expect("three are alike");
            assert_eq!(like[2..], own[2..]);
            let (x, y) = (leaves[k][0], leaves[k][1]);
            for (found, outs) in all.iter_mut().zip([own, &like]) {
                let one = g.constant(1.0);
                let first = derive::gradient(&mut g, outs[1], &[x, y]);
                let second = derive::gradient(&mut g, first[0], &[x, y]);
                let forward = derive::tangent(&mut g, &outs[..2], &[(x, one)]);
                let both = derive::slopes(&mut g, &outs[..2], &[x, y]).concat();
                found.extend([outs[..2].to_vec(), first, second, forward, both].concat());
            }
        }
        let [own, like] = all.each_ref().map(|outs| values(&g, outs));
        for (a, b) in own.iter().zip(&like) {
            assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{a} {b}");
        }
        assert!(4 * Tape::new(&g, &all[1]).len() < Tape::new(&g, &all[0]).len());
        // what each stands for
        let Node::Result(number, k, list) = g.node(all[1][0]) else { panic!("no call") };
        let alone = inlined(&mut g, (number, k, list));
        assert_eq!(values(&g, &[alone]), like[..1]);
        // written and read
        let written = through_its_list(&g);
        assert_eq!(values(&written, &all[1]), like);
    }

    /// A graph through its list, as it is written.
    fn through_its_list(g: &Graph) -> Graph {
        g.listed_and_back()
    }
}
