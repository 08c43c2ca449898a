//! Where parts stand. The cost of a placement, in grid units of wire: parts that overlap, wires as they are guessed (the shortest
//! tree of each net, bends, parts and wires in their way), wishes, the variants' own costs, the size of the whole.
use super::route::{route, Routed};
use super::{Diagram, Drawing, Point, Random, Variant, Wish};
use emsim_expr::interrupt;
use std::cell::RefCell;

const OVERLAP: i64 = 60; // two parts on each other
const CELL: i64 = 12; // of what overlaps
const BEND: i64 = 4; // of a wire
const AWAY: i64 = 9; // a pin looks away from where its wire goes
const HIT: i64 = 22; // a wire through a part
const CROSSING: i64 = 13; // of two wires
const SHARED: i64 = 26; // a wire along another

const NEAR: [Point; 16] = [
    (-1, 0),
    (1, 0),
    (0, -1),
    (0, 1),
    (-2, 0),
    (2, 0),
    (0, -2),
    (0, 2),
    (-3, 0),
    (3, 0),
    (0, -3),
    (0, 3),
    (-5, 0),
    (5, 0),
    (0, -5),
    (0, 5),
];

type Place = (i32, i32, usize);

/// The best drawing of `rounds` searches of `moves` changes each, then `polish` changes judged by real wires.
pub fn arrange(d: &Diagram, seed: u64, rounds: usize, moves: usize, polish: usize) -> Drawing {
    let mut best: Option<(i64, Vec<Place>, Routed)> = None;
    for round in 0..rounds.max(1) {
        let mut search = Search::new(d, seed + 1000 * round as u64);
        search.anneal(moves);
        let routed = route(d, &search.places, 1);
        search.stand();
        let cost = 2 * search.standing() + routed.cost;
        if best.as_ref().is_none_or(|b| cost < b.0) {
            best = Some((cost, search.places, routed));
        }
    }
    let (mut cost, places, mut routed) = best.expect("at least one round");
    let mut search = Search::new(d, seed + 7);
    search.places = places;
    for step in 0..polish {
        let old = search.places.clone();
        let reach = if step < polish / 2 { 6 } else { 2 };
        search.change(reach);
        search.stand();
        if search.overlaps() > 0 || search.places == old {
            search.places = old;
            continue;
        }
        let standing = 2 * search.standing();
        if standing > cost {
            search.places = old;
            continue;
        }
        let tried = route(d, &search.places, 0);
        if standing + tried.cost <= cost {
            cost = standing + tried.cost;
            routed = tried;
        } else {
            search.places = old;
        }
    }
    let last = route(d, &search.places, 3);
    if last.cost <= routed.cost {
        routed = last;
    }
    Drawing { places: search.places, wires: routed.wires, failed: routed.failed, cost }
}

struct Search<'a> {
    d: &'a Diagram,
    places: Vec<Place>,
    random: Random,
    at: Vec<Vec<usize>>,           // nets by part
    bounds: Vec<Vec<[i32; 4]>>,    // of all rectangles, by part and variant
    boxes: RefCell<Vec<[i32; 4]>>, // the same where the parts stand: scratch of `cost`
    segments: RefCell<Vec<(usize, Point, Point)>>,
    edges: RefCell<Vec<Edge>>,
}

struct Edge {
    net: usize,
    a: Point,
    b: Point,
}

impl<'a> Search<'a> {
    fn new(d: &'a Diagram, seed: u64) -> Search<'a> {
        let mut random = Random::new(seed);
        let n = d.parts.len();
        let side = (1..).find(|s| s * s >= n as i32).unwrap_or(1);
        // parts come in the order of the signal: columns from the left
        let places = (0..n as i32)
            .map(|k| (12 * (k / side) + random.between(-2, 2), 10 * (k % side) + random.between(-2, 2), 0))
            .collect();
        let mut at = vec![Vec::new(); n];
        for (k, net) in d.nets.iter().enumerate() {
            for &(part, _) in net {
                if net.len() > 1 && !at[part].contains(&k) {
                    at[part].push(k);
                }
            }
        }
        let around = |rects: &[[i32; 4]]| {
            let mut b = rects[0];
            for r in rects {
                b = [b[0].min(r[0]), b[1].min(r[1]), b[2].max(r[2]), b[3].max(r[3])];
            }
            b
        };
        let bounds = d.parts.iter().map(|p| p.iter().map(|v| around(&v.rects)).collect()).collect();
        let (boxes, segments, edges) = (RefCell::default(), RefCell::default(), RefCell::default());
        Search { d, places, random, at, bounds, boxes, segments, edges }
    }

    fn anneal(&mut self, moves: usize) {
        let mut cost = self.cost();
        let mut best = (cost, self.places.clone());
        for k in 0..moves {
            let left = (moves - k) as i64;
            // falls as the square, from a part in the wrong place to a bend
            let threshold = 60 * left * left / (moves as i64 * moves as i64);
            let reach = 2 + (18 * left / moves as i64) as i32;
            let old = self.places.clone();
            self.change(reach);
            if let Some(new) = self.cost_below(cost + threshold) {
                cost = new;
                if cost < best.0 {
                    best = (cost, self.places.clone());
                }
            } else {
                self.places = old;
            }
        }
        self.places = best.1;
        self.descend();
    }

    /// Tries every small change, of one part and of all on one side of it, until none is for the better.
    fn descend(&mut self) {
        let mut cost = self.cost();
        for _ in 0..12 {
            let before = cost;
            for part in 0..self.places.len() {
                for (dx, dy) in NEAR {
                    let (x, y, _) = self.places[part];
                    for side in 0..3 {
                        let old = self.places.clone();
                        for (k, p) in self.places.iter_mut().enumerate() {
                            let moves = match side {
                                0 => k == part,
                                1 => p.0 >= x,
                                _ => p.1 >= y,
                            };
                            if moves {
                                p.0 += dx;
                                p.1 += dy;
                            }
                        }
                        cost = self.keep(cost, old);
                    }
                }
                for v in 0..self.d.parts[part].len() {
                    let old = self.places.clone();
                    self.places[part].2 = v;
                    cost = self.keep(cost, old);
                }
            }
            if cost == before {
                break;
            }
        }
    }

    /// The places as they are now if they cost less, else the old ones.
    fn keep(&mut self, cost: i64, old: Vec<Place>) -> i64 {
        if let Some(new) = self.cost_below(cost - 1) {
            return new;
        }
        self.places = old;
        cost
    }

    // ---- changes ----

    fn change(&mut self, reach: i32) {
        let n = self.places.len();
        let part = self.random.below(n);
        match self.random.below(20) {
            0..=4 => self.shift(part, reach),
            5..=10 => self.line_up(part),
            11..=13 => self.turn(part),
            14 => {
                let other = self.random.below(n);
                let (a, b) = (self.places[part], self.places[other]);
                self.places[part] = (b.0, b.1, a.2);
                self.places[other] = (a.0, a.1, b.2);
            }
            15..=16 => self.slide(part),
            17..=18 => self.together(part, reach),
            _ => {
                self.turn(part);
                self.line_up(part);
            }
        }
    }

    fn shift(&mut self, part: usize, reach: i32) {
        let (dx, dy) = (self.random.between(-reach, reach), self.random.between(-reach, reach));
        let only = self.random.below(3);
        let p = &mut self.places[part];
        p.0 += if only == 1 { 0 } else { dx };
        p.1 += if only == 2 { 0 } else { dy };
    }

    fn turn(&mut self, part: usize) {
        let count = self.d.parts[part].len();
        self.places[part].2 = self.random.below(count);
    }

    fn pin(&self, part: usize, pin: usize) -> (Point, Point) {
        let (x, y, v) = self.places[part];
        let p = self.d.parts[part][v].pins[pin];
        ((x + p.at.0, y + p.at.1), p.out)
    }

    /// Moves a part so that one of its pins looks at one that it is wired to, or lies in line with it.
    fn line_up(&mut self, part: usize) {
        if self.at[part].is_empty() {
            return self.shift(part, 8);
        }
        let d = self.d;
        let net = &d.nets[self.at[part][self.random.below(self.at[part].len())]];
        let mine: Vec<usize> = (0..net.len()).filter(|&k| net[k].0 == part).collect();
        let others: Vec<usize> = (0..net.len()).filter(|&k| net[k].0 != part).collect();
        if others.is_empty() {
            return;
        }
        let own = net[mine[self.random.below(mine.len())]];
        let (to, out) = {
            let k = others[self.random.below(others.len())];
            self.pin(net[k].0, net[k].1)
        };
        let (at, _) = self.pin(own.0, own.1);
        let (dx, dy) = match self.random.below(4) {
            0 => (to.0 - at.0, 0),
            1 => (0, to.1 - at.1),
            _ => {
                let far = self.random.between(2, 7);
                (to.0 + far * out.0 - at.0, to.1 + far * out.1 - at.1)
            }
        };
        self.places[part].0 += dx;
        self.places[part].1 += dy;
    }

    /// Moves everything on one side of a part.
    fn slide(&mut self, part: usize) {
        let (x, y, _) = self.places[part];
        let by = [-4, -3, -2, -1, 1, 2, 3, 4][self.random.below(8)];
        if self.random.below(2) == 0 {
            self.places.iter_mut().filter(|p| p.0 >= x).for_each(|p| p.0 += by);
        } else {
            self.places.iter_mut().filter(|p| p.1 >= y).for_each(|p| p.1 += by);
        }
    }

    /// Moves a part and some that are wired to it.
    fn together(&mut self, part: usize, reach: i32) {
        let mut group = vec![part];
        let size = 2 + self.random.below(4);
        let mut k = 0;
        while k < group.len() && group.len() < size {
            for &net in &self.at[group[k]] {
                for &(other, _) in &self.d.nets[net] {
                    if group.len() < size && !group.contains(&other) && self.random.below(2) == 0 {
                        group.push(other);
                    }
                }
            }
            k += 1;
        }
        let (dx, dy) = (self.random.between(-reach, reach), self.random.between(-reach, reach));
        let only = self.random.below(3);
        for part in group {
            self.places[part].0 += if only == 1 { 0 } else { dx };
            self.places[part].1 += if only == 2 { 0 } else { dy };
        }
    }

    // ---- costs ----

    fn cost(&self) -> i64 {
        interrupt::spent(100 * self.places.len());
        self.stand();
        self.overlaps() + self.standing() + self.wires()
    }

    /// The cost if it is no more than so much; wires, which take longest, are looked at last.
    fn cost_below(&self, most: i64) -> Option<i64> {
        interrupt::spent(100 * self.places.len());
        self.stand();
        let cost = self.overlaps();
        let cost = if cost > most { return None } else { cost + self.standing() };
        let cost = if cost > most { return None } else { cost + self.wires() };
        (cost <= most).then_some(cost)
    }

    /// Works out `boxes`.
    fn stand(&self) {
        let mut boxes = self.boxes.borrow_mut();
        boxes.clear();
        boxes.extend(self.places.iter().zip(&self.bounds).map(|(&(x, y, v), b)| {
            let r = b[v];
            [x + r[0], y + r[1], x + r[2], y + r[3]]
        }));
    }

    /// Rectangles that lie on one another, or with no room for a wire between.
    fn overlaps(&self) -> i64 {
        let boxes = self.boxes.borrow();
        let n = self.places.len();
        let mut cost = 0;
        for i in 0..n {
            let (xi, yi, vi) = self.places[i];
            let a = &self.d.parts[i][vi];
            let p = boxes[i];
            for j in 0..i {
                let q = boxes[j];
                if p[0] > q[2] + 1 || q[0] > p[2] + 1 || p[1] > q[3] + 1 || q[1] > p[3] + 1 {
                    continue;
                }
                let (xj, yj, vj) = self.places[j];
                let b = &self.d.parts[j][vj];
                cost += OVERLAP * (covered(b, (xj, yj), a, (xi, yi)) + covered(a, (xi, yi), b, (xj, yj)));
                for (k, r) in a.rects.iter().enumerate() {
                    for (l, s) in b.rects.iter().enumerate() {
                        // a wire's room between bodies, which come first; writing and symbols at pins may be next to anything
                        let gap = if k + l == 0 { 2 } else { 1 };
                        let w = (xi + r[2]).min(xj + s[2]) - (xi + r[0]).max(xj + s[0]) + gap;
                        let h = (yi + r[3]).min(yj + s[3]) - (yi + r[1]).max(yj + s[1]) + gap;
                        if w > 0 && h > 0 {
                            cost += OVERLAP + CELL * i64::from(w.min(h));
                        }
                    }
                }
            }
        }
        cost
    }

    /// Wishes, variants and the size of the whole.
    fn standing(&self) -> i64 {
        let mut cost = 0;
        let (mut left, mut top, mut right, mut bottom) = (i32::MAX, i32::MAX, i32::MIN, i32::MIN);
        for (part, b) in self.boxes.borrow().iter().enumerate() {
            cost += i64::from(self.d.parts[part][self.places[part].2].cost);
            left = left.min(b[0]);
            top = top.min(b[1]);
            right = right.max(b[2]);
            bottom = bottom.max(b[3]);
        }
        let (wide, tall) = (i64::from(right - left), i64::from(bottom - top));
        cost += wide + 2 * tall + 3 * (tall - wide).max(0);
        for &(wish, a, b, weight) in &self.d.wishes {
            let ((xa, ya), (xb, yb)) = (self.middle(a), self.middle(b));
            let off = match wish {
                Wish::Right => (xa + 8 - xb).max(0),
                Wish::After => (xa - xb).max(0),
                Wish::Below => (ya + 8 - yb).max(0),
                Wish::Row => (ya - yb).abs(),
                Wish::Column => (xa - xb).abs(),
            };
            cost += i64::from(weight) * i64::from(off) / 2;
        }
        cost
    }

    /// The middle of a part, of its first rectangle, in halves of a grid unit.
    fn middle(&self, part: usize) -> (i32, i32) {
        let (x, y, v) = self.places[part];
        let r = self.d.parts[part][v].rects[0];
        (2 * x + r[0] + r[2], 2 * y + r[1] + r[3])
    }

    fn wires(&self) -> i64 {
        let mut cost = 0;
        let mut edges = self.edges.borrow_mut();
        edges.clear();
        let mut pins: Vec<(Point, Point)> = Vec::with_capacity(16);
        let (mut near, mut inside) = (Vec::with_capacity(16), Vec::with_capacity(16));
        for (n, net) in self.d.nets.iter().enumerate() {
            if net.len() < 2 {
                continue;
            }
            pins.clear();
            pins.extend(net.iter().map(|&(part, pin)| self.pin(part, pin)));
            // Prim's algorithm
            let count = pins.len();
            near.clear();
            near.extend((0..count).map(|k| (reach(pins[0], pins[k]), 0)));
            inside.clear();
            inside.resize(count, false);
            inside[0] = true;
            for _ in 1..count {
                let k = (0..count).filter(|&k| !inside[k]).min_by_key(|&k| near[k].0).expect("one is outside");
                inside[k] = true;
                cost += near[k].0;
                edges.push(Edge { net: n, a: pins[near[k].1].0, b: pins[k].0 });
                for j in 0..count {
                    let far = if inside[j] { i64::MAX } else { reach(pins[k], pins[j]) };
                    if far < near[j].0 {
                        near[j] = (far, k);
                    }
                }
            }
        }
        cost + self.obstacles(&edges)
    }

    /// Parts and wires in the way of wires, of two ways about a corner the better one.
    fn obstacles(&self, edges: &[Edge]) -> i64 {
        let mut cost = 0;
        let mut segments = self.segments.borrow_mut();
        segments.clear();
        for e in edges {
            let straight = e.a.0 == e.b.0 || e.a.1 == e.b.1;
            let ways = [(e.b.0, e.a.1), (e.a.0, e.b.1)];
            let count = |c: Point| self.hits(e.a, c) + self.hits(c, e.b);
            let first = count(ways[0]);
            let corner = if straight || first == 0 || first <= count(ways[1]) { ways[0] } else { ways[1] };
            cost += HIT * if corner == ways[0] { first } else { count(corner) };
            for (p, q) in [(e.a, corner), (corner, e.b)] {
                if p != q {
                    segments.push((e.net, p.min(q), p.max(q)));
                }
            }
        }
        for (k, s) in segments.iter().enumerate() {
            for t in &segments[..k] {
                if s.0 == t.0 {
                    continue;
                }
                let (sv, tv) = (s.1 .0 == s.2 .0, t.1 .0 == t.2 .0);
                // do their boxes share anything
                if s.1 .0.max(t.1 .0) > s.2 .0.min(t.2 .0) || s.1 .1.max(t.1 .1) > s.2 .1.min(t.2 .1) {
                    continue;
                }
                cost += if sv == tv { SHARED } else { CROSSING };
            }
        }
        cost
    }

    /// How many rectangles a straight wire runs through, its ends aside.
    fn hits(&self, a: Point, b: Point) -> i64 {
        let (x0, x1, y0, y1) = (a.0.min(b.0), a.0.max(b.0), a.1.min(b.1), a.1.max(b.1));
        let mut count = 0;
        for (part, b) in self.boxes.borrow().iter().enumerate() {
            if b[0] > x1 || b[2] < x0 || b[1] > y1 || b[3] < y0 {
                continue;
            }
            let (x, y, v) = self.places[part];
            for r in &self.d.parts[part][v].rects {
                if x + r[0] <= x1 && x + r[2] >= x0 && y + r[1] <= y1 && y + r[3] >= y0 {
                    count += 1;
                }
            }
        }
        count
    }
}

/// How many pins of `b` lie under rectangles of `a`.
fn covered(a: &Variant, at: Point, b: &Variant, bt: Point) -> i64 {
    let under = |p: Point| {
        let (x, y) = (bt.0 + p.0 - at.0, bt.1 + p.1 - at.1);
        a.rects.iter().any(|r| r[0] <= x && x <= r[2] && r[1] <= y && y <= r[3])
    };
    b.pins.iter().filter(|p| under(p.at)).count() as i64
}

/// What a wire from pin to pin costs: its length, bends, and pins that look away.
fn reach((a, da): (Point, Point), (b, db): (Point, Point)) -> i64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let mut cost = i64::from(dx.abs() + dy.abs());
    let leaves = dx * da.0 + dy * da.1;
    let arrives = -(dx * db.0 + dy * db.1);
    if leaves < 0 {
        cost += AWAY;
    }
    if arrives < 0 {
        cost += AWAY;
    }
    cost += match (dx != 0, dy != 0) {
        (true, true) => {
            // one bend where one pin looks along x and the other along y, else two
            if leaves >= 0 && arrives >= 0 && (da.0 != 0) != (db.0 != 0) {
                BEND
            } else {
                2 * BEND
            }
        }
        _ => BEND * i64::from(leaves == 0) + BEND * i64::from(arrives == 0),
    };
    cost
}
