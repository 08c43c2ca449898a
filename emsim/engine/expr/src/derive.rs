//! Differentiation and substitution on the graph. The results are nodes again: fully symbolic, shared, folded.
//!
//! Reverse mode: with adjoints  ybar_i = dy/dnode_i,  a node f(a, b) adds  ybar * df/da  to a's adjoint. One sweep gives
//! the derivatives with respect to all leaves, which is what a scalar energy with many coordinates asks for.
use super::repeat;
use crate::graph::{Fun, Graph, Id, Node};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};
use std::collections::BTreeMap;

/// dy/dx for each x in `xs` (leaves: unknowns, symbols, time). Flags are constant between events: derivative zero.
pub fn gradient(g: &mut Graph, y: Id, xs: &[Id]) -> Vec<Id> {
    let order = g.reachable(&[y]);
    // only nodes that depend on some x carry an adjoint
    let mut active: HashMap<Id, bool> = HashMap::default();
    let leaves: HashSet<Id> = xs.iter().copied().collect();
    for &id in &order {
        let on = leaves.contains(&id) || g.node(id).operands().any(|o| active[&o]);
        active.insert(id, on);
    }
    let zero = g.constant(0.0);
    if !active[&y] {
        return vec![zero; xs.len()];
    }
    let mut adjoint: HashMap<Id, Id> = HashMap::default();
    let one = g.constant(1.0);
    adjoint.insert(y, one);
    for &id in order.iter().rev() {
        let Some(&bar) = adjoint.get(&id) else { continue };
        if !active[&id] {
            continue;
        }
        for (operand, partial) in partials(g, id, bar, &active) {
            let sum = match adjoint.get(&operand) {
                Some(&old) => g.add(old, partial),
                None => partial,
            };
            adjoint.insert(operand, sum);
        }
    }
    xs.iter().map(|x| adjoint.get(x).copied().unwrap_or(zero)).collect()
}

/// bar * d, kept inside the branch where the adjoint lives: `select(c, bar, 0) * d` must be 0, not 0 * NaN, elsewhere.
fn scale(g: &mut Graph, bar: Id, d: Id) -> Id {
    if let Node::Select(c, a, b) = g.node(bar) {
        let zero = g.constant(0.0);
        if b == zero {
            let p = scale(g, a, d);
            return g.select(c, p, zero);
        }
        if a == zero {
            let p = scale(g, b, d);
            return g.select(c, zero, p);
        }
    }
    g.mul(bar, d)
}

/// (operand, bar * d node / d operand) for each active operand.
fn partials(g: &mut Graph, id: Id, bar: Id, active: &HashMap<Id, bool>) -> Vec<(Id, Id)> {
    let on = |o: Id| active.get(&o).copied().unwrap_or(false);
    let mut out = Vec::with_capacity(2);
    match g.node(id) {
        Node::Neg(a) => {
            let p = g.neg(bar);
            out.push((a, p));
        }
        Node::Add(a, b) => {
            out.push((a, bar));
            out.push((b, bar));
        }
        Node::Sub(a, b) => {
            out.push((a, bar));
            let p = g.neg(bar);
            out.push((b, p));
        }
        Node::Mul(a, b) => {
            if on(a) {
                let p = scale(g, bar, b);
                out.push((a, p));
            }
            if on(b) {
                let p = scale(g, bar, a);
                out.push((b, p));
            }
        }
        Node::Div(a, b) => {
            let r = if let Node::Select(..) = g.node(bar) {
                let one = g.constant(1.0);
                let inverse = g.div(one, b);
                scale(g, bar, inverse)
            } else {
                g.div(bar, b)
            };
            out.push((a, r));
            if on(b) {
                // d(a/b)/db = -(a/b)/b
                let p = g.mul(r, id);
                let p = g.neg(p);
                out.push((b, p));
            }
        }
        Node::Powi(a, n) => {
            let c = g.constant(f64::from(n));
            let p = g.powi(a, n - 1);
            let p = g.mul(c, p);
            let p = scale(g, bar, p);
            out.push((a, p));
        }
        Node::Pow(a, b) => of_power(g, (a, b, id), bar, &on, &mut out),
        Node::Atan2(a, b) => of_atan2(g, (a, b), bar, &on, &mut out),
        Node::Call(f, a) => {
            let d = derivative(g, f, a, id);
            let p = scale(g, bar, d);
            out.push((a, p));
        }
        Node::Select(c, a, b) => {
            let zero = g.constant(0.0);
            let pa = g.select(c, bar, zero);
            let pb = g.select(c, zero, bar);
            out.push((a, pa));
            out.push((b, pb));
        }
        Node::Result(number, k, list) => {
            for (a, d) in repeat::partials(g, (number, k, list), &on) {
                let p = scale(g, bar, d);
                out.push((a, p));
            }
        }
        _ => {}
    }
    out.retain(|&(o, _)| on(o));
    out
}

/// Of a^b, which is `id`.
fn of_power(g: &mut Graph, (a, b, id): (Id, Id, Id), bar: Id, on: &impl Fn(Id) -> bool, out: &mut Vec<(Id, Id)>) {
    if on(a) {
        // b a^(b-1)
        let one = g.constant(1.0);
        let b1 = g.sub(b, one);
        let p = g.pow(a, b1);
        let p = g.mul(b, p);
        let p = scale(g, bar, p);
        out.push((a, p));
    }
    if on(b) {
        let l = g.call(Fun::Log, a);
        let p = g.mul(id, l);
        let p = scale(g, bar, p);
        out.push((b, p));
    }
}

fn of_atan2(g: &mut Graph, (a, b): (Id, Id), bar: Id, on: &impl Fn(Id) -> bool, out: &mut Vec<(Id, Id)>) {
    let aa = g.mul(a, a);
    let bb = g.mul(b, b);
    // at (0, 0) there is no direction: derivatives 0 let Newton's method leave it
    let least = g.constant(f64::MIN_POSITIVE);
    let r = g.add(aa, bb);
    let r = g.add(r, least);
    let one = g.constant(1.0);
    let r = g.div(one, r);
    let s = scale(g, bar, r);
    if on(a) {
        let p = g.mul(s, b);
        out.push((a, p));
    }
    if on(b) {
        let p = g.mul(s, a);
        let p = g.neg(p);
        out.push((b, p));
    }
}

fn derivative(g: &mut Graph, f: Fun, a: Id, fa: Id) -> Id {
    let one = g.constant(1.0);
    match f {
        Fun::Sin => g.call(Fun::Cos, a),
        Fun::Cos => {
            let s = g.call(Fun::Sin, a);
            g.neg(s)
        }
        Fun::Tan => {
            let t = g.mul(fa, fa);
            g.add(one, t)
        }
        Fun::Asin | Fun::Acos => {
            let t = g.mul(a, a);
            let t = g.sub(one, t);
            let t = g.call(Fun::Sqrt, t);
            let t = g.div(one, t);
            if f == Fun::Acos {
                g.neg(t)
            } else {
                t
            }
        }
        Fun::Atan => {
            let t = g.mul(a, a);
            let t = g.add(one, t);
            g.div(one, t)
        }
        Fun::Sinh => g.call(Fun::Cosh, a),
        Fun::Cosh => g.call(Fun::Sinh, a),
        Fun::Tanh => {
            let t = g.mul(fa, fa);
            g.sub(one, t)
        }
        Fun::Asinh => {
            let t = g.mul(a, a);
            let t = g.add(t, one);
            let t = g.call(Fun::Sqrt, t);
            g.div(one, t)
        }
        Fun::Acosh => {
            let t = g.mul(a, a);
            let t = g.sub(t, one);
            let t = g.call(Fun::Sqrt, t);
            g.div(one, t)
        }
        Fun::Atanh => {
            let t = g.mul(a, a);
            let t = g.sub(one, t);
            g.div(one, t)
        }
        Fun::Exp => fa,
        Fun::Log => g.div(one, a),
        Fun::Sqrt => {
            let half = g.constant(0.5);
            g.div(half, fa)
        }
        Fun::Abs => g.call(Fun::Sign, a),
        Fun::Sign | Fun::Floor | Fun::Ceil | Fun::Round => g.constant(0.0),
    }
}

/// `ys` with every occurrence of `from` replaced by `to`, folded anew.
pub fn substitute(g: &mut Graph, ys: &[Id], map: &[(Id, Id)]) -> Vec<Id> {
    let mut image: HashMap<Id, Id> = map.iter().copied().collect();
    for id in g.reachable(ys) {
        if image.contains_key(&id) {
            continue;
        }
        let node = g.node(id);
        let mut ops = [0; 3];
        let mut changed = false;
        for (k, o) in node.operands().enumerate() {
            ops[k] = image[&o];
            changed |= ops[k] != o;
        }
        let new = if changed { g.rebuild(node, ops) } else { id };
        image.insert(id, new);
    }
    ys.iter().map(|y| image[y]).collect()
}

/// Which of `xs` does `y` depend on?
pub fn depends(g: &Graph, y: Id, xs: &[Id]) -> Vec<bool> {
    let reached = g.reachable(&[y]);
    xs.iter().map(|x| reached.binary_search(x).is_ok()).collect()
}

/// Forward mode: the derivative of each y along the direction dx/ds = `seed` (pairs leaf -> tangent).
pub fn tangent(g: &mut Graph, ys: &[Id], seed: &[(Id, Id)]) -> Vec<Id> {
    let zero = g.constant(0.0);
    let seeds: HashMap<Id, Id> = seed.iter().copied().collect();
    let order = g.reachable(ys);
    let mut dot: HashMap<Id, Id> = HashMap::default();
    for id in order {
        if let Some(&s) = seeds.get(&id) {
            dot.insert(id, s);
            continue;
        }
        let active: HashMap<Id, bool> = g.node(id).operands().map(|o| (o, dot[&o] != zero)).collect();
        let mut sum = zero;
        if let Node::Select(c, a, b) = g.node(id) {
            // no slope of the side that does not hold is ever added
            sum = g.select(c, dot[&a], dot[&b]);
        } else if let Node::Result(number, k, list) = g.node(id) {
            sum = repeat::tangent(g, (number, k, list), &dot);
        } else if active.values().any(|&a| a) {
            let one = g.constant(1.0);
            for (operand, partial) in partials(g, id, one, &active) {
                let term = g.mul(partial, dot[&operand]);
                sum = g.add(sum, term);
            }
        }
        dot.insert(id, sum);
    }
    ys.iter().map(|y| dot[y]).collect()
}

/// d y / d x of every y by every x, for a few leaves and many expressions that share most of what they are made of: forward mode
/// between the nodes that several read, reverse mode inside (a statement of a program, as it were). A selection's slope is a
/// selection, so that no slope of the side that does not hold is ever added.
pub fn slopes(g: &mut Graph, ys: &[Id], xs: &[Id]) -> Vec<Vec<Id>> {
    type Dot = BTreeMap<usize, Id>;
    let order = g.reachable(ys);
    let mut readers: HashMap<Id, u32> = HashMap::default();
    let mut active: HashMap<Id, bool> = HashMap::default();
    ys.iter().for_each(|&y| *readers.entry(y).or_default() += 2);
    for &id in &order {
        let node = g.node(id);
        let weight = if matches!(node, Node::Select(..) | Node::Join(..)) { 2 } else { 1 };
        node.operands().for_each(|o| *readers.entry(o).or_default() += weight);
        let on = xs.contains(&id) || node.operands().any(|o| active[&o]);
        active.insert(id, on);
    }
    let by_itself = |g: &Graph, id: Id| matches!(g.node(id), Node::Select(..) | Node::Result(..));
    let mut dots: HashMap<Id, Dot> = HashMap::default();
    let (zero, one) = (g.constant(0.0), g.constant(1.0));
    for &id in order.iter().filter(|id| active[id]) {
        if let Some(k) = xs.iter().position(|&x| x == id) {
            dots.insert(id, Dot::from([(k, one)]));
            continue;
        }
        if readers[&id] < 2 && !by_itself(g, id) {
            continue;
        }
        let mut dot = Dot::new();
        if let Node::Select(c, a, b) = g.node(id) {
            let of = |o: Id| dots.get(&o).cloned().unwrap_or_default();
            let (da, db) = (of(a), of(b));
            let by: std::collections::BTreeSet<usize> = da.keys().chain(db.keys()).copied().collect();
            for k in by {
                let [p, q] = [&da, &db].map(|d| d.get(&k).copied().unwrap_or(zero));
                dot.insert(k, g.select(c, p, q));
            }
        } else if let Node::Result(number, k, list) = g.node(id) {
            dot = repeat::slopes(g, (number, k, list), &dots);
        } else {
            // adjoints inside: every node there has one reader, so its adjoint is whole when it is met
            let mut inside = vec![(id, one)];
            let mut ends: BTreeMap<Id, Id> = BTreeMap::new();
            while let Some((at, bar)) = inside.pop() {
                for (operand, partial) in partials(g, at, bar, &active) {
                    if readers[&operand] < 2 && !by_itself(g, operand) && !xs.contains(&operand) {
                        inside.push((operand, partial));
                    } else {
                        let sum = ends.get(&operand).map_or(partial, |&old| g.add(old, partial));
                        ends.insert(operand, sum);
                    }
                }
            }
            for (end, bar) in ends {
                for (k, d) in dots[&end].clone() {
                    let term = g.mul(bar, d);
                    let sum = dot.get(&k).map_or(term, |&old| g.add(old, term));
                    dot.insert(k, sum);
                }
            }
        }
        dots.insert(id, dot);
    }
    let row = |y: &Id| {
        let dot = dots.get(y);
        (0..xs.len()).map(|k| dot.and_then(|d| d.get(&k).copied()).unwrap_or(zero)).collect()
    };
    ys.iter().map(row).collect()
}
