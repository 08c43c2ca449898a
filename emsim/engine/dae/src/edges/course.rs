//! The first time at which what is known ahead rises beyond its threshold. The stretch is cut into parts, from its start on, until of each
//! one of these is sure by the bounds of values and slopes:
//!
//! 1. The operand stays below in it: the bound of its values is below, or where lines of the greatest slopes from both ends meet.
//! 2. It rises all along, so that its ends say whether it crosses, and the place is found by bisection and chords.
//! 3. The part is as short as rounding of time.
//!
//! So a crossing is missed only if it returns within rounding of time, however far the method's steps are from it.
use crate::bounds::Program;
use crate::graph::{Graph, Id};
use crate::waves::bounds::Bounds;
use crate::waves::Wave;

/// Operands counted towards the flag's other side, of a flag that is off and one that is on.
pub struct Course {
    beyond: [Program; 2],
    reads: Vec<usize>, // flags
}

/// A stretch between two corners.
pub struct Piece {
    pub from: f64,
    pub to: f64,
    pub ends: (f64, f64), // the operand's values there
    pub band: f64,        // width of the threshold
    pub leaves: bool,     // staying at the threshold is turning
    pub on: bool,
}

/// How far a course has been followed.
#[derive(Clone, Default)]
pub struct Seen {
    state: Vec<f64>, // the flag itself, and those that its operand reads
    from: f64,
    until: f64,
    turn: Option<f64>,
    part: f64, // length of parts that bounds can judge
    slots: Vec<Bounds>,
}

/// A time and the operand's value there.
type Place = (f64, f64);

impl Course {
    pub fn new(g: &mut Graph, up: Id, down: Id) -> Course {
        let down = g.neg(down);
        let beyond = [Program::new(g, up), Program::new(g, down)];
        let mut reads: Vec<usize> = beyond.iter().flat_map(Program::flags).collect();
        reads.sort_unstable();
        reads.dedup();
        Course { beyond, reads }
    }

    /// When the flag turns in the piece (INFINITY: it does not), and how far that is known.
    pub fn turn(&self, p: &Piece, waves: &[Wave], flags: &[f64], seen: &mut Seen) -> (f64, f64) {
        if p.ends.0 > p.band {
            return (p.from, p.to);
        }
        let program = &self.beyond[usize::from(p.on)];
        if p.leaves && p.ends.0.abs() <= p.band && p.ends.1.abs() <= p.band {
            let (lo, hi) = program.over(p.from, p.to, waves, flags, &mut seen.slots).value;
            if lo >= -p.band && hi <= p.band {
                return (p.from, p.to);
            }
        }
        let own = f64::from(u8::from(p.on));
        let state = || std::iter::once(own).chain(self.reads.iter().map(|&k| flags[k]));
        let same = seen.state.len() == self.reads.len() + 1 && seen.state.iter().copied().eq(state());
        if !same || p.from < seen.from || p.from > seen.until || seen.turn.is_some_and(|t| t < p.from) {
            seen.state.clear();
            seen.state.extend(state());
            (seen.from, seen.until, seen.turn) = (p.from, p.from, None);
        }
        if seen.turn.is_none() && seen.until < p.to {
            let mut slots = std::mem::take(&mut seen.slots);
            let from = match seen.until > p.from {
                true => (seen.until, program.at(seen.until, waves, flags, &mut slots)),
                false => (p.from, p.ends.0),
            };
            let mut over = |a: f64, b: f64| program.over(a, b, waves, flags, &mut slots);
            let part = if seen.part > 0.0 { seen.part } else { p.to - p.from };
            (seen.turn, seen.until, seen.part) = first_above(&mut over, from, (p.to, p.ends.1), p.band, part);
            seen.slots = slots;
        }
        let known = if seen.turn.is_some() { p.to } else { seen.until };
        (seen.turn.filter(|&t| t <= p.to).unwrap_or(f64::INFINITY), known)
    }
}

/// When a function that is not above the level at `from` first is so, how far that is known, and how long parts are that its bounds can
/// judge. `over`: its bounds.
fn first_above(
    over: &mut dyn FnMut(f64, f64) -> Bounds,
    from: Place,
    to: Place,
    level: f64,
    mut part: f64,
) -> (Option<f64>, f64, f64) {
    let shortest = 1e-18 * (to.0 - from.0);
    let (mut a, mut ends, mut end) = (from, Vec::<Place>::new(), to.0);
    // parts in one search at most: it goes on from there when the run has come so far. A part costs about what a tenth
    // of a step does
    for _ in 0..10_000 {
        if a.0 >= to.0 {
            break;
        }
        let fresh = ends.is_empty();
        let b = ends.pop().unwrap_or_else(|| {
            let t = a.0 + part;
            if t < to.0 {
                (t, over(t, t).value.0)
            } else {
                to
            }
        });
        end = if fresh { b.0 } else { end };
        let bounds = over(a.0, b.0);
        let width = b.0 - a.0;
        let rises = bounds.slope.0 >= 0.0 || width <= shortest.max(4.0 * f64::EPSILON * b.0.abs());
        let below = bounds.value.1 <= level || bounds.slope.1 <= 0.0 || roof(a, b, bounds) <= level;
        if b.1 > level && rises {
            return (Some(crossing(over, a, b)), b.0, part);
        } else if b.1 <= level && (below || rises) {
            a = b;
            part = if fresh { 2.0 * part } else { part };
        } else {
            let t = a.0 + 0.5 * width;
            ends.extend([b, (t, over(t, t).value.0)]);
            part = if fresh { 0.5 * part.min(width) } else { part };
        }
    }
    // (a function without bounds, a power of what is negative: what was read of it has to do)
    // parts that come no farther than this share of the first one find no bounds
    let bounded = a.0 - from.0 > 1e-9 * (end - from.0);
    (None, if bounded { a.0 } else { end }, part)
}

/// The most that slopes between these bounds allow between two places.
fn roof(a: Place, b: Place, bounds: Bounds) -> f64 {
    let ((fall, rise), h) = (bounds.slope, b.0 - a.0);
    let steep = rise - fall;
    let top = (rise * b.1 - fall * a.1 - rise * fall * h) / steep;
    if steep.is_finite() && steep > 0.0 {
        top
    } else {
        f64::INFINITY
    }
}

/// Where a function that rises from a to b crosses zero: the first place at which it is found above.
fn crossing(over: &mut dyn FnMut(f64, f64) -> Bounds, mut a: Place, mut b: Place) -> f64 {
    if a.1 >= 0.0 {
        return a.0;
    }
    for round in 0..200 {
        let width = b.0 - a.0;
        if width <= 2.0 * f64::EPSILON * b.0.abs() {
            break;
        }
        // chords, and every third time the middle
        let chord = a.0 - a.1 * width / (b.1 - a.1);
        let t = if round % 3 == 2 || !(chord > a.0 && chord < b.0) { a.0 + 0.5 * width } else { chord };
        if !(t > a.0 && t < b.0) {
            break;
        }
        let value = over(t, t).value.0;
        *(if value > 0.0 { &mut b } else { &mut a }) = (t, value);
    }
    b.0
}
