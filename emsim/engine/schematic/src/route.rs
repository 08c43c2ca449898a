//! Wires at right angles between placed parts: net by net, each from what is already wired to the nearest pin that is not.
//!
//! Another net's wire may be crossed, at a right angle and straight on; nothing runs along it, and no corner, junction or pin of
//! it is touched. A point belongs to a net horizontally, vertically or, at a corner, both.
use super::{Diagram, Point};
use emsim_expr::interrupt;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

const STEP: i32 = 2; // costs are in half units of wire: a unit
const BEND: i32 = 7; // as long as three and a half units
const CROSSING: i32 = 24; // as long as twelve units
const BESIDE: i32 = 1; // next to another wire or to a part
const MARGIN: i32 = 5; // free units around the parts
const NONE: u16 = u16::MAX; // no net
const DIRECTIONS: [Point; 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

pub struct Routed {
    pub wires: Vec<Vec<Vec<Point>>>,
    pub failed: Vec<usize>,
    pub cost: i64,
}

struct Board {
    left: i32,
    top: i32,
    wide: i32,
    tall: i32,
    solid: Vec<bool>,
    across: Vec<u16>, // which net passes horizontally
    along: Vec<u16>,  // which net passes vertically
    pin: Vec<u16>,    // whose pin this is
    // of the search
    best: Vec<i32>,
    from: Vec<u8>,
    touched: Vec<usize>,
}

/// Routes all nets of the parts at `places` (x, y, variant); with `again` every net is taken out and laid anew once all lie.
pub fn route(d: &Diagram, places: &[(i32, i32, usize)], again: usize) -> Routed {
    let mut board = Board::new(d, places);
    let pins: Vec<Vec<usize>> = d
        .nets
        .iter()
        .map(|net| {
            net.iter()
                .map(|&(part, pin)| {
                    let (x, y, v) = places[part];
                    let at = d.parts[part][v].pins[pin].at;
                    board.index((x + at.0, y + at.1))
                })
                .collect()
        })
        .collect();
    let mut order: Vec<usize> = (0..d.nets.len()).collect();
    order.sort_by_key(|&n| (board.span(&pins[n]), n));
    let mut wires: Vec<Vec<Vec<usize>>> = vec![Vec::new(); d.nets.len()];
    let mut done = vec![false; d.nets.len()];
    for &n in &order {
        (wires[n], done[n]) = board.connect(n as u16, &pins[n]);
    }
    for _ in 0..again {
        for &n in &order {
            if pins[n].len() < 2 {
                continue;
            }
            let (before, whole) = (board.price(n as u16, &wires[n]), done[n]);
            let old = std::mem::take(&mut wires[n]);
            board.lift(n as u16, &old);
            let (new, ok) = board.connect(n as u16, &pins[n]);
            if (ok, Reverse(board.price(n as u16, &new))) > (whole, Reverse(before)) {
                (wires[n], done[n]) = (new, ok);
            } else {
                board.lift(n as u16, &new);
                board.lay(n as u16, &old);
                wires[n] = old;
            }
        }
    }
    let mut cost = 0;
    for n in 0..d.nets.len() {
        cost += i64::from(board.price(n as u16, &wires[n]));
    }
    let failed: Vec<usize> = (0..d.nets.len()).filter(|&n| !done[n]).collect();
    cost += 600 * failed.len() as i64;
    let wires = wires.iter().map(|paths| paths.iter().map(|p| board.corners(p)).collect()).collect();
    Routed { wires, failed, cost }
}

impl Board {
    fn new(d: &Diagram, places: &[(i32, i32, usize)]) -> Board {
        let (mut left, mut top, mut right, mut bottom) = (i32::MAX, i32::MAX, i32::MIN, i32::MIN);
        for (part, &(x, y, v)) in places.iter().enumerate() {
            for r in &d.parts[part][v].rects {
                left = left.min(x + r[0]);
                top = top.min(y + r[1]);
                right = right.max(x + r[2]);
                bottom = bottom.max(y + r[3]);
            }
            for p in &d.parts[part][v].pins {
                left = left.min(x + p.at.0);
                top = top.min(y + p.at.1);
                right = right.max(x + p.at.0);
                bottom = bottom.max(y + p.at.1);
            }
        }
        let (left, top) = (left - MARGIN, top - MARGIN);
        let (wide, tall) = (right + MARGIN - left + 1, bottom + MARGIN - top + 1);
        let size = (wide * tall) as usize;
        let mut board = Board {
            left,
            top,
            wide,
            tall,
            solid: vec![false; size],
            across: vec![NONE; size],
            along: vec![NONE; size],
            pin: vec![NONE; size],
            best: vec![i32::MAX; 4 * size],
            from: vec![0; 4 * size],
            touched: Vec::new(),
        };
        for (part, &(x, y, v)) in places.iter().enumerate() {
            for r in &d.parts[part][v].rects {
                for j in r[1]..=r[3] {
                    for i in r[0]..=r[2] {
                        let k = board.index((x + i, y + j));
                        board.solid[k] = true;
                    }
                }
            }
        }
        for (n, net) in d.nets.iter().enumerate() {
            for &(part, pin) in net {
                let (x, y, v) = places[part];
                let at = d.parts[part][v].pins[pin].at;
                let k = board.index((x + at.0, y + at.1));
                board.solid[k] = false;
                board.pin[k] = n as u16;
            }
        }
        board
    }

    fn index(&self, p: Point) -> usize {
        ((p.1 - self.top) * self.wide + p.0 - self.left) as usize
    }

    fn point(&self, k: usize) -> Point {
        (k as i32 % self.wide + self.left, k as i32 / self.wide + self.top)
    }

    fn span(&self, pins: &[usize]) -> i32 {
        let points: Vec<Point> = pins.iter().map(|&k| self.point(k)).collect();
        let of = |f: fn(&Point) -> i32| {
            let (low, high) = (points.iter().map(f).min().unwrap_or(0), points.iter().map(f).max().unwrap_or(0));
            high - low
        };
        of(|p| p.0) + of(|p| p.1)
    }

    fn step(&self, k: usize, dir: usize) -> Option<usize> {
        let (x, y) = (k as i32 % self.wide, k as i32 / self.wide);
        let (x, y) = (x + DIRECTIONS[dir].0, y + DIRECTIONS[dir].1);
        (x >= 0 && y >= 0 && x < self.wide && y < self.tall).then(|| (y * self.wide + x) as usize)
    }

    /// The wires of a net as paths of neighbouring points, laid on the board; whether they reach every pin.
    fn connect(&mut self, net: u16, pins: &[usize]) -> (Vec<Vec<usize>>, bool) {
        let mut paths = Vec::new();
        let mut open: Vec<usize> = pins[1.min(pins.len())..].to_vec();
        let mut tree: Vec<usize> = pins.first().copied().into_iter().collect();
        open.retain(|k| !tree.contains(k));
        while !open.is_empty() {
            let Some(path) = self.search(net, &tree, &open) else { return (paths, false) };
            let reached = path[path.len() - 1];
            open.retain(|&k| k != reached);
            tree.extend(&path);
            self.lay(net, std::slice::from_ref(&path));
            paths.push(path);
        }
        (paths, true)
    }

    fn search(&mut self, net: u16, tree: &[usize], open: &[usize]) -> Option<Vec<usize>> {
        for k in self.touched.drain(..) {
            self.best[k] = i32::MAX;
        }
        let mut queue = BinaryHeap::new();
        for &k in tree {
            // at a crossing nothing may branch off
            if self.foreign(k, net) {
                continue;
            }
            for dir in 0..4 {
                self.offer(&mut queue, 0, k, dir, 4, self.turning(net, k, dir));
            }
        }
        while let Some(Reverse((cost, state))) = queue.pop() {
            let (k, dir) = ((state >> 2) as usize, (state & 3) as usize);
            interrupt::spent(100);
            if cost > self.best[state as usize] {
                continue;
            }
            let Some(next) = self.step(k, dir) else { continue };
            let is_goal = open.contains(&next);
            if self.solid[next] || (self.pin[next] != NONE && !is_goal) {
                continue;
            }
            let (same, other) = if dir % 2 == 0 {
                (self.across[next], self.along[next])
            } else {
                (self.along[next], self.across[next])
            };
            if same != NONE {
                continue;
            }
            let crosses = other != NONE;
            if crosses && (other == net || is_goal) {
                continue;
            }
            let mut cost = cost + STEP + if crosses { CROSSING } else { 0 };
            if is_goal {
                return Some(self.back(next, k, dir, tree));
            }
            cost += self.beside(next, dir);
            for turn in 0..4 {
                if turn == (dir + 2) % 4 || (crosses && turn != dir) {
                    continue;
                }
                let more = if turn == dir { 0 } else { BEND };
                self.offer(&mut queue, cost + more, next, turn, dir, 0);
            }
        }
        None
    }

    fn offer(
        &mut self,
        queue: &mut BinaryHeap<Reverse<(i32, u32)>>,
        cost: i32,
        k: usize,
        dir: usize,
        from: usize,
        more: i32,
    ) {
        let state = 4 * k + dir;
        if cost + more < self.best[state] {
            self.best[state] = cost + more;
            self.from[state] = from as u8;
            self.touched.push(state);
            queue.push(Reverse((cost + more, state as u32)));
        }
    }

    /// Leaving a wire's end straight on is free, leaving its middle costs half a bend.
    fn turning(&self, net: u16, k: usize, dir: usize) -> i32 {
        let passes = if dir % 2 == 0 { self.along[k] } else { self.across[k] };
        if passes == net {
            BEND / 2
        } else {
            0
        }
    }

    fn foreign(&self, k: usize, net: u16) -> bool {
        (self.across[k] != NONE && self.across[k] != net) || (self.along[k] != NONE && self.along[k] != net)
    }

    fn beside(&self, k: usize, dir: usize) -> i32 {
        let mut cost = 0;
        for side in [(dir + 1) % 4, (dir + 3) % 4] {
            if let Some(n) = self.step(k, side) {
                let same = if dir % 2 == 0 { self.across[n] } else { self.along[n] };
                if self.solid[n] || same != NONE {
                    cost += BESIDE;
                }
            }
        }
        cost
    }

    fn back(&self, goal: usize, mut k: usize, mut dir: usize, tree: &[usize]) -> Vec<usize> {
        let mut path = vec![goal, k];
        while !(self.from[4 * k + dir] == 4 && tree.contains(&k)) {
            let came = self.from[4 * k + dir] as usize;
            k = self.step(k, (came + 2) % 4).expect("a path stays on the board");
            dir = came;
            path.push(k);
        }
        path.reverse();
        path
    }

    fn lay(&mut self, net: u16, paths: &[Vec<usize>]) {
        for path in paths {
            for pair in path.windows(2) {
                let lines = if pair[0].abs_diff(pair[1]) == 1 { &mut self.across } else { &mut self.along };
                lines[pair[0]] = net;
                lines[pair[1]] = net;
            }
        }
    }

    fn lift(&mut self, net: u16, paths: &[Vec<usize>]) {
        for &k in paths.iter().flatten() {
            for lines in [&mut self.across, &mut self.along] {
                if lines[k] == net {
                    lines[k] = NONE;
                }
            }
        }
    }

    /// Length, bends and crossings of a net's wires as they lie.
    fn price(&self, net: u16, paths: &[Vec<usize>]) -> i32 {
        let mut cost = 0;
        for path in paths {
            cost += STEP * (path.len() as i32 - 1);
            for three in path.windows(3) {
                if three[0].abs_diff(three[1]) != three[1].abs_diff(three[2]) {
                    cost += BEND;
                }
                if self.foreign(three[1], net) {
                    cost += CROSSING / 2; // each of both pays
                }
            }
        }
        cost
    }

    fn corners(&self, path: &[usize]) -> Vec<Point> {
        let points: Vec<Point> = path.iter().map(|&k| self.point(k)).collect();
        let mut found = vec![points[0]];
        for w in points.windows(3) {
            if (w[1].0 - w[0].0, w[1].1 - w[0].1) != (w[2].0 - w[1].0, w[2].1 - w[1].1) {
                found.push(w[1]);
            }
        }
        found.push(points[points.len() - 1]);
        found
    }
}
