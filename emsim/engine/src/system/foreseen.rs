//! What moves by itself: expressions of time alone, a B source's bell or burst. No state tells a method that they are about to move, and
//! a step from rest would go over them; but they are known before the run.
//!
//! 1. A term is a largest part of a row that reads time and piecewise linear sources alone, and that is no straight line. Sums are
//!    taken apart, so that a small term beside a large one counts.
//! 2. The run is cut into cells by interval arithmetic: the cell in which a term may change most is halved, until no cell holds more
//!    than a quarter of what the term changes in all. Where it cannot move at all, a cell stays long.
//! 3. No step goes farther than into the next cell that moves (`Foreseen::limit`). Then the method sees the change and its error, and
//!    goes on by itself.
//! 4. Of conditions of time alone, the zeros are parted in the same way; a step ends in every stretch between two of them.
use crate::graph::{Fun, Graph, Id, Node};
use crate::waves::Wave;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::PI;

/// A cell with more than this part of a term's range is halved, ...
const COARSE: f64 = 0.25;
/// ... one with less than this part is at rest.
const STILL: f64 = 0.01;
/// Cells of all terms together at most, but so many of each. Beyond, what a cell looks like in its middle is taken for all of it.
const CELLS: usize = 4096;
const LEAST: usize = 64;
/// Cells shorter than this part of the run are not halved: a jump, a pole.
const SHORTEST: f64 = 1e-13;
/// Corners of a source in a cell at most: more of them are not looked through.
const CORNERS: usize = 64;
/// Steps from a cell that moves may go on by so many of its lengths: the method knows the pace by then.
const ONWARD: f64 = 4.0;

/// Terms and roots, as programs for intervals.
#[derive(Default)]
pub struct Foreseen {
    terms: Vec<Program>,
    roots: Vec<Program>,
}

/// What it comes to in one run.
pub struct Ahead {
    /// of each term: cells that move, in order
    cells: Vec<Vec<Cell>>,
    /// of each condition: where its value changes, in order
    zeros: Vec<Vec<f64>>,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    start: f64,
    end: f64,
    pace: f64, // the term moves so much in a time like this
}

/// Nodes, operands first and numbered by place; the last one is the result.
struct Program(Vec<Node>);

type Interval = (f64, f64);
const ANYTHING: Interval = (f64::NEG_INFINITY, f64::INFINITY);

impl Foreseen {
    /// `rows`: the expressions of the equations; `roots`: operands of flags that are found by stepping. `straight`: no term.
    pub fn find(g: &Graph, rows: &[Id], roots: &[Id], waves: &[Wave], straight: impl Fn(Id) -> bool) -> Foreseen {
        let mut known: BTreeMap<Id, bool> = BTreeMap::new();
        for id in g.reachable(&[rows, roots].concat()) {
            let node = g.node(id);
            let own = match node {
                Node::Const(_) | Node::Time => true,
                Node::Wave(k) => waves.get(k as usize).is_some_and(Wave::is_piecewise_linear),
                Node::Call(Fun::Floor | Fun::Ceil | Fun::Round | Fun::Sign, _) => false, // jumps are flags
                _ => !node.is_leaf() && node.operands().all(|o| known[&o]),
            };
            known.insert(id, own);
        }
        let mut terms: Vec<Id> = Vec::new();
        let mut seen: BTreeMap<Id, ()> = BTreeMap::new();
        let mut stack: Vec<Id> = [rows, roots].concat();
        while let Some(id) = stack.pop() {
            if seen.insert(id, ()).is_some() {
                continue;
            }
            let node = g.node(id);
            let sum = match node {
                Node::Neg(_) | Node::Add(..) | Node::Sub(..) => true,
                Node::Mul(a, b) => g.value(a).is_some() || g.value(b).is_some(),
                _ => false,
            };
            match known[&id] {
                true if straight(id) => {}
                true if !sum => terms.push(id),
                _ => stack.extend(node.operands()),
            }
        }
        let alone = |&&id: &&Id| known[&id] && !straight(id);
        Foreseen {
            terms: terms.iter().map(|&id| Program::new(g, id)).collect(),
            roots: roots.iter().filter(alone).map(|&id| Program::new(g, id)).collect(),
        }
    }

    pub fn ahead(&self, waves: &[Wave], tstop: f64) -> Option<Ahead> {
        if self.terms.is_empty() && self.roots.is_empty() {
            return None;
        }
        let most = (CELLS / self.terms.len().max(1)).max(LEAST);
        Some(Ahead {
            cells: self.terms.iter().map(|p| moving(p, waves, tstop, most)).collect(),
            zeros: self.roots.iter().map(|p| zeros(p, waves, tstop)).collect(),
        })
    }
}

impl Ahead {
    /// The longest step from t.
    pub fn limit(&self, t: f64) -> f64 {
        let mut h = f64::INFINITY;
        for cells in &self.cells {
            let first = cells.partition_point(|c| c.end <= t);
            for c in &cells[first..] {
                if c.start > t + h {
                    break;
                }
                h = h.min(if c.start > t { c.start - t + c.pace } else { ONWARD * c.pace });
            }
        }
        for zeros in &self.zeros {
            let next = zeros.partition_point(|&z| z <= t);
            if let Some(&[a, b]) = zeros.get(next..next + 2) {
                h = h.min(0.5 * (a + b) - t);
            }
        }
        h
    }
}

/// A piece of the run in the heap: what may move most comes first.
struct Piece {
    start: f64,
    end: f64,
    change: f64,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Piece) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Piece) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Piece) -> Ordering {
        self.change.total_cmp(&other.change)
    }
}

/// The cells in which a term moves.
fn moving(p: &Program, waves: &[Wave], tstop: f64, most: usize) -> Vec<Cell> {
    let mut slots = Vec::new();
    let mut range: Interval = (f64::INFINITY, f64::NEG_INFINITY); // of values at ends of pieces
    let mut piece = |start: f64, end: f64, range: &mut Interval| {
        let (at, _) = p.over(end, end, waves, &mut slots);
        if at.is_finite() {
            *range = (range.0.min(at), range.1.max(at));
        }
        let (lo, hi) = p.over(start, end, waves, &mut slots);
        Piece { start, end, change: if (hi - lo).is_nan() { f64::INFINITY } else { hi - lo } }
    };
    let mut heap = BinaryHeap::new();
    let mut done: Vec<Piece> = Vec::new();
    piece(0.0, 0.0, &mut range);
    heap.push(piece(0.0, tstop, &mut range));
    while let Some(top) = heap.pop() {
        let extent = (range.1 - range.0).max(0.0);
        let rounding = 1e-12 * range.0.abs().max(range.1.abs());
        if top.change <= (COARSE * extent).max(rounding) || heap.len() + done.len() > most {
            heap.push(top);
            break;
        }
        if top.end - top.start < SHORTEST * tstop {
            done.push(top);
            continue;
        }
        let middle = 0.5 * (top.start + top.end);
        heap.push(piece(top.start, middle, &mut range));
        heap.push(piece(middle, top.end, &mut range));
    }
    let extent = (range.1 - range.0).max(0.0);
    done.extend(heap);
    let moves = |c: &Piece| c.change > STILL * extent && c.change > 0.0 && c.end - c.start >= SHORTEST * tstop;
    let mut cells: Vec<Cell> = Vec::new();
    for c in done.iter().filter(|c| moves(c)) {
        // cells that were too many: the pace in the middle
        let (mut start, mut end, mut change) = (c.start, c.end, c.change);
        while change > COARSE * extent && end - start > SHORTEST * tstop {
            let quarter = 0.25 * (end - start);
            let inner = piece(start + quarter, end - quarter, &mut range);
            (start, end, change) = (inner.start, inner.end, inner.change);
        }
        cells.push(Cell { start: c.start, end: c.end, pace: end - start });
    }
    cells.sort_by(|a, b| a.start.total_cmp(&b.start));
    cells
}

/// Where a condition's operand changes its sign.
fn zeros(p: &Program, waves: &[Wave], tstop: f64) -> Vec<f64> {
    let mut slots = Vec::new();
    let mut found = Vec::new();
    let mut stack = vec![(0.0, tstop, 0)];
    let mut looked = 0;
    while let Some((start, end, crossing)) = stack.pop() {
        looked += 1;
        if looked > 16 * CELLS {
            return Vec::new(); // too many to be told apart
        }
        let (lo, hi) = p.over(start, end, waves, &mut slots);
        if lo > 0.0 || hi <= 0.0 {
            continue;
        }
        let [first, last] = [start, end].map(|t| p.over(t, t, waves, &mut slots).0 > 0.0);
        let turns = first != last;
        // one zero, to some digits; a touch that does not cross is followed to rounding
        if turns && crossing >= 8 {
            found.push(0.5 * (start + end));
            continue;
        }
        if end - start < 1e-9 * tstop {
            continue;
        }
        let middle = 0.5 * (start + end);
        let crossing = if turns { crossing + 1 } else { 0 };
        stack.extend([(middle, end, crossing), (start, middle, crossing)]);
    }
    found.sort_by(f64::total_cmp);
    found
}

impl Program {
    fn new(g: &Graph, id: Id) -> Program {
        let order = g.reachable(&[id]);
        let place: BTreeMap<Id, Id> = order.iter().enumerate().map(|(k, &id)| (id, k as Id)).collect();
        let of = |o: Id| place[&o];
        let moved = |node: Node| match node {
            Node::Neg(a) => Node::Neg(of(a)),
            Node::Add(a, b) => Node::Add(of(a), of(b)),
            Node::Sub(a, b) => Node::Sub(of(a), of(b)),
            Node::Mul(a, b) => Node::Mul(of(a), of(b)),
            Node::Div(a, b) => Node::Div(of(a), of(b)),
            Node::Pow(a, b) => Node::Pow(of(a), of(b)),
            Node::Powi(a, n) => Node::Powi(of(a), n),
            Node::Atan2(a, b) => Node::Atan2(of(a), of(b)),
            Node::Call(f, a) => Node::Call(f, of(a)),
            Node::Select(c, a, b) => Node::Select(of(c), of(a), of(b)),
            leaf => leaf,
        };
        Program(order.iter().map(|&id| moved(g.node(id))).collect())
    }

    /// Bounds of the values from a to b; of one time, the value itself.
    fn over(&self, a: f64, b: f64, waves: &[Wave], slots: &mut Vec<Interval>) -> Interval {
        slots.clear();
        for &node in &self.0 {
            let at = |o: Id| slots[o as usize];
            let value = match node {
                Node::Const(bits) => (f64::from_bits(bits), f64::from_bits(bits)),
                Node::Time => (a, b),
                Node::Wave(k) => over_wave(&waves[k as usize], a, b),
                Node::Neg(x) => (-at(x).1, -at(x).0),
                Node::Add(x, y) => (at(x).0 + at(y).0, at(x).1 + at(y).1),
                Node::Sub(x, y) => (at(x).0 - at(y).1, at(x).1 - at(y).0),
                Node::Mul(x, y) if x == y => even(at(x), |v| v * v),
                Node::Mul(x, y) => corners(at(x), at(y), |x, y| if x == 0.0 || y == 0.0 { 0.0 } else { x * y }),
                Node::Div(_, y) if at(y).0 <= 0.0 && at(y).1 >= 0.0 => ANYTHING,
                Node::Div(x, y) => corners(at(x), at(y), |x, y| x / y),
                Node::Powi(x, n) if n >= 0 && n % 2 == 0 => even(at(x), |v| v.powi(n)),
                Node::Powi(x, n) if n > 0 => (at(x).0.powi(n), at(x).1.powi(n)),
                Node::Powi(x, _) if at(x).0 <= 0.0 && at(x).1 >= 0.0 => ANYTHING,
                Node::Powi(x, n) => corners(at(x), at(x), |v, _| v.powi(n)),
                Node::Pow(x, y) if at(x).0 >= 0.0 => corners(at(x), at(y), f64::powf),
                Node::Atan2(x, y) if a == b => (at(x).0.atan2(at(y).0), at(x).0.atan2(at(y).0)),
                Node::Atan2(..) => (-PI, PI),
                Node::Call(f, x) => over_function(f, at(x)),
                Node::Select(c, x, y) => match at(c) {
                    (0.0, 0.0) => at(y),
                    (lo, hi) if lo > 0.0 || hi < 0.0 => at(x),
                    _ => (at(x).0.min(at(y).0), at(x).1.max(at(y).1)),
                },
                _ => ANYTHING,
            };
            slots.push(if value.0.is_nan() || value.1.is_nan() { ANYTHING } else { value });
        }
        slots.last().copied().unwrap_or(ANYTHING)
    }
}

fn over_wave(wave: &Wave, a: f64, b: f64) -> Interval {
    let (mut lo, mut hi) = (wave.value(a), wave.value(a));
    if a == b {
        return (lo, hi);
    }
    let mut t = a;
    for _ in 0..CORNERS {
        t = wave.next_breakpoint(t).min(b);
        for v in [wave.value_before(t), wave.value(t)] {
            (lo, hi) = (lo.min(v), hi.max(v));
        }
        if t >= b {
            return (lo, hi);
        }
    }
    ANYTHING
}

fn over_function(f: Fun, (lo, hi): Interval) -> Interval {
    let monotone = |f: Fun| (f.apply(lo), f.apply(hi));
    match f {
        Fun::Exp | Fun::Sinh | Fun::Tanh | Fun::Asinh | Fun::Atan | Fun::Asin | Fun::Atanh | Fun::Acosh => monotone(f),
        Fun::Acos => (hi.acos(), lo.acos()),
        Fun::Sqrt if lo >= 0.0 => monotone(f),
        Fun::Log if lo > 0.0 => monotone(f),
        Fun::Abs => even((lo, hi), f64::abs),
        Fun::Cosh => even((lo, hi), f64::cosh),
        Fun::Sin => over_cosine(lo - 0.5 * PI, hi - 0.5 * PI, lo.sin(), hi.sin()),
        Fun::Cos => over_cosine(lo, hi, lo.cos(), hi.cos()),
        Fun::Tan if (lo / PI - 0.5).floor() == (hi / PI - 0.5).floor() => monotone(f),
        _ => ANYTHING,
    }
}

/// A cosine between two arguments with its values there.
fn over_cosine(lo: f64, hi: f64, first: f64, last: f64) -> Interval {
    let holds = |shift: f64| ((hi - shift) / (2.0 * PI)).floor() > ((lo - shift) / (2.0 * PI)).floor();
    let least = if lo < hi && holds(PI) { -1.0 } else { first.min(last) };
    let most = if lo < hi && holds(0.0) { 1.0 } else { first.max(last) };
    (least, most)
}

fn even((lo, hi): Interval, f: impl Fn(f64) -> f64) -> Interval {
    let (a, b) = (f(lo), f(hi));
    let least = if lo <= 0.0 && hi >= 0.0 { f(0.0) } else { a.min(b) };
    (least, a.max(b))
}

fn corners(x: Interval, y: Interval, f: impl Fn(f64, f64) -> f64) -> Interval {
    let values = [f(x.0, y.0), f(x.0, y.1), f(x.1, y.0), f(x.1, y.1)];
    if values.iter().any(|v| v.is_nan()) {
        return ANYTHING;
    }
    (values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells_of(make: impl Fn(&mut Graph, Id) -> Id, tstop: f64) -> (Vec<Cell>, Vec<f64>) {
        let mut g = Graph::new();
        let t = g.time();
        let e = make(&mut g, t);
        let p = Program::new(&g, e);
        (moving(&p, &[], tstop, CELLS), zeros(&p, &[], tstop))
    }

    /// exp(-((t - at) / width)^2) - less
    fn bell(g: &mut Graph, t: Id, at: f64, width: f64, less: f64) -> Id {
        let [at, scale, less] = [at, 1.0 / width, less].map(|v| g.constant(v));
        let s = g.sub(t, at);
        let s = g.mul(scale, s);
        let square = g.mul(s, s);
        let square = g.neg(square);
        let e = g.call(Fun::Exp, square);
        g.sub(e, less)
    }

    #[test]
    fn a_bell_is_found_however_narrow() {
        for width in [1e-1, 1e-4, 1e-7, 1e-10] {
            let (cells, _) = cells_of(|g, t| bell(g, t, 0.3333, width, 0.0), 1.0);
            let (first, last) = (cells[0], cells[cells.len() - 1]);
            assert!(first.start > 0.3333 - 8.0 * width && first.start < 0.3333 - 0.5 * width, "{width} {first:?}");
            assert!(last.end < 0.3333 + 8.0 * width && last.end > 0.3333 + 0.5 * width, "{width} {last:?}");
            // where it is above a quarter of its height; a cell of the rest moves by less than that
            let high = |c: &&Cell| (c.start - 0.3333).abs().min((c.end - 0.3333).abs()) < 1.17 * width;
            assert!(cells.iter().filter(high).all(|c| c.pace <= 4.0 * width), "{width} {cells:?}");
        }
    }

    #[test]
    fn zeros_of_narrow_conditions_are_parted() {
        let (_, zeros) = cells_of(|g, t| bell(g, t, 0.7, 1e-5, 0.9), 1.0);
        let half = 1e-5 * (-0.9_f64.ln()).sqrt();
        assert_eq!(zeros.len(), 2);
        assert!((zeros[0] - 0.7 + half).abs() < 0.1 * half && (zeros[1] - 0.7 - half).abs() < 0.1 * half, "{zeros:?}");
    }

    #[test]
    fn a_sine_has_cells_of_parts_of_its_period() {
        let sine = |f: f64| {
            move |g: &mut Graph, t: Id| {
                let w = g.constant(2.0 * PI * f);
                let a = g.mul(w, t);
                g.call(Fun::Sin, a)
            }
        };
        // few periods, and more than there are cells for
        for f in [3.0, 1e6] {
            let (cells, _) = cells_of(sine(f), 1.0);
            assert!(cells.iter().all(|c| (0.02..0.4).contains(&(f * c.pace))), "{f} {cells:?}");
            assert!(cells.iter().map(|c| c.end - c.start).sum::<f64>() > 0.5);
        }
    }
}
