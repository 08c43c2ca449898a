//! What moves by itself: expressions of time alone, a B source's bell or burst. No state tells a method that they are about to move, and
//! a step from rest would go over them; but they are known before the run.
//!
//! 1. A term is a largest part of a row that reads time and piecewise linear sources alone, and that is no straight line. Sums are
//!    taken apart, so that a small term beside a large one counts.
//! 2. The run is cut into cells by interval arithmetic: the cell in which a term may change most is halved, until no cell holds more
//!    than a quarter of what the term changes in all. Where it cannot move at all, a cell stays long.
//! 3. No step goes farther than into the next cell that moves (`TimeOnly::limit`). Then the method sees the change and its error, and
//!    goes on by itself.
use crate::bounds::{is_known, Program};
use crate::graph::{Fun, Graph, Id, Node};
use crate::rounding::ROUNDED;
use crate::waves::bounds::Interval;
use crate::waves::Wave;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

/// A cell with more than this part of a term's range is halved, ...
const COARSE: f64 = 0.25;
/// Cells of all terms together at most, but so many of each. Beyond, what a cell looks like in its middle is taken for all of it.
const CELLS: usize = 4096;

/// Terms, as programs for intervals.
#[derive(Default)]
pub struct TimeOnly {
    terms: Vec<Program>,
}

/// What it comes to in one run.
pub struct Ahead {
    /// of each term: cells that move, in order
    cells: Vec<Vec<Cell>>,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    start: f64,
    end: f64,
    pace: f64, // the term moves so much in a time like this
}

impl TimeOnly {
    /// `rows`: the expressions of the equations. `straight`: no term.
    pub fn find(g: &Graph, rows: &[Id], waves: &[Wave], straight: impl Fn(Id) -> bool) -> TimeOnly {
        let mut known: BTreeMap<Id, bool> = BTreeMap::new();
        for id in g.reachable(rows) {
            let node = g.node(id);
            let own = match node {
                Node::Wave(k) => waves.get(k as usize).is_some_and(Wave::is_piecewise_linear),
                Node::Call(Fun::Floor | Fun::Ceil | Fun::Round | Fun::Sign, _) => false, // jumps are flags
                _ => is_known(node, waves, false) && node.operands().all(|o| known[&o]),
            };
            known.insert(id, own);
        }
        let mut terms: Vec<Id> = Vec::new();
        let mut seen: BTreeMap<Id, ()> = BTreeMap::new();
        let mut stack: Vec<Id> = rows.to_vec();
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
        TimeOnly { terms: terms.iter().map(|&id| Program::new(g, id)).collect() }
    }

    pub fn ahead(&self, waves: &[Wave], tstop: f64) -> Option<Ahead> {
        if self.terms.is_empty() {
            return None;
        }
        let most = (CELLS / self.terms.len()).max(64);
        Some(Ahead { cells: self.terms.iter().map(|p| moving(p, waves, tstop, most)).collect() })
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
                // steps from a cell that moves may go on by so many of its lengths: the method knows the pace by then
                h = h.min(if c.start > t { c.start - t + c.pace } else { 4.0 * c.pace });
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
        let at = p.at(end, waves, &[], &mut slots);
        if at.is_finite() {
            *range = (range.0.min(at), range.1.max(at));
        }
        let (lo, hi) = p.over(start, end, waves, &[], &mut slots).value;
        Piece { start, end, change: if (hi - lo).is_nan() { f64::INFINITY } else { hi - lo } }
    };
    let mut heap = BinaryHeap::new();
    let mut done: Vec<Piece> = Vec::new();
    piece(0.0, 0.0, &mut range);
    heap.push(piece(0.0, tstop, &mut range));
    while let Some(top) = heap.pop() {
        let extent = (range.1 - range.0).max(0.0);
        let rounding = ROUNDED * range.0.abs().max(range.1.abs());
        if top.change <= (COARSE * extent).max(rounding) || heap.len() + done.len() > most {
            heap.push(top);
            break;
        }
        if top.end - top.start < ROUNDED * tstop {
            done.push(top);
            continue;
        }
        let middle = 0.5 * (top.start + top.end);
        heap.push(piece(top.start, middle, &mut range));
        heap.push(piece(middle, top.end, &mut range));
    }
    let extent = (range.1 - range.0).max(0.0);
    // bounds do not know that sin^2 + cos^2 is 1: values that agree to rounding at all of so many ends do not move
    if extent <= ROUNDED * range.0.abs().max(range.1.abs()) && heap.len() + done.len() > most {
        return Vec::new();
    }
    done.extend(heap);
    // a piece with less than this part is at rest
    let moves = |c: &Piece| c.change > 0.01 * extent && c.change > 0.0 && c.end - c.start >= ROUNDED * tstop;
    let mut cells: Vec<Cell> = Vec::new();
    for c in done.iter().filter(|c| moves(c)) {
        // cells that were too many: the pace in the middle
        let (mut start, mut end, mut change) = (c.start, c.end, c.change);
        while change > COARSE * extent && end - start > ROUNDED * tstop {
            let quarter = 0.25 * (end - start);
            let inner = piece(start + quarter, end - quarter, &mut range);
            (start, end, change) = (inner.start, inner.end, inner.change);
        }
        cells.push(Cell { start: c.start, end: c.end, pace: end - start });
    }
    cells.sort_by(|a, b| a.start.total_cmp(&b.start));
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn cells_of(make: impl Fn(&mut Graph, Id) -> Id, tstop: f64) -> Vec<Cell> {
        let mut g = Graph::new();
        let t = g.time();
        let e = make(&mut g, t);
        let p = Program::new(&g, e);
        moving(&p, &[], tstop, CELLS)
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
            let cells = cells_of(|g, t| bell(g, t, 0.3333, width, 0.0), 1.0);
            let (first, last) = (cells[0], cells[cells.len() - 1]);
            assert!(first.start > 0.3333 - 8.0 * width && first.start < 0.3333 - 0.5 * width, "{width} {first:?}");
            assert!(last.end < 0.3333 + 8.0 * width && last.end > 0.3333 + 0.5 * width, "{width} {last:?}");
            // where it is above a quarter of its height; a cell of the rest moves by less than that
            let high = |c: &&Cell| (c.start - 0.3333).abs().min((c.end - 0.3333).abs()) < 1.17 * width;
            assert!(cells.iter().filter(high).all(|c| c.pace <= 4.0 * width), "{width} {cells:?}");
        }
    }

    #[test]
    fn what_only_its_bounds_let_move_has_no_cells() {
        let cells = cells_of(
            |g, t| {
                let w = g.constant(400.0);
                let a = g.mul(w, t);
                let [s, c] = [Fun::Sin, Fun::Cos].map(|f| g.call(f, a));
                let [s, c] = [s, c].map(|x| g.mul(x, x));
                g.add(s, c)
            },
            1.0,
        );
        assert!(cells.is_empty());
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
            let cells = cells_of(sine(f), 1.0);
            assert!(cells.iter().all(|c| (0.02..0.4).contains(&(f * c.pace))), "{f} {cells:?}");
            assert!(cells.iter().map(|c| c.end - c.start).sum::<f64>() > 0.5);
        }
    }
}
