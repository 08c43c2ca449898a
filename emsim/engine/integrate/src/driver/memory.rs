//! How long steps may be, and lengths that come again and again: between the edges of a pulse train the second period can know what the
//! first had to find out, and an equal length keeps its factorisation.
use super::{Character, Transient};
use crate::events::LOOK;
use crate::system::System;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// SPICE takes at least so many steps, none longer than TSTEP. Methods with dense output of their own order need only see
/// every part of the run (`Character::fewest_steps`): the error bounds a step, and rows lie where they are asked for.
const SPICE: f64 = 50.0;
/// What conducts at the crest of a source's swing alone could lie between the stages of one long step.
const IN_A_PERIOD: f64 = 7.0;
/// Steps of one length that a source's periods, or a short piece of the run that is shown, impose are no more than these.
pub const IMPOSED: f64 = 1e5;

/// The longest step where the deck does not say.
pub fn longest(sys: &System, a: &Transient, of: &Character) -> f64 {
    let span = a.tstop - a.tstart;
    let (fewest, of_spice) = (span / of.fewest_steps, span / SPICE);
    let followed = match of.steps_a_period {
        Some(steps) if sys.devices() > 0 => (sys.shortest_swing() / steps).max(span / IMPOSED),
        _ => (sys.shortest_period() / IN_A_PERIOD).max(of_spice),
    };
    match of.dense_record {
        true if sys.pure_linear => fewest,
        true => fewest.min(followed),
        false => a.tstep.min(of_spice).min(followed),
    }
}

/// The longest step while conditions hang on what sources drive through states: in more than so much of a turn a polynomial follows no
/// crest. (One of degree 3 through the ends and two places inside is off a sine by its fourth derivative, (LOOK)^4/4! times the product of
/// the distances, at most 1e-4 of the amplitude.)
pub fn followed(sys: &System) -> f64 {
    if sys.swing > 0.0 {
        LOOK / (TAU * sys.swing)
    } else {
        f64::INFINITY
    }
}

/// How far a step may go from t: what is shown later on asks for short steps only there.
pub fn bound(a: &Transient, t: f64, tmax: f64) -> f64 {
    match a.tmax {
        None if t < a.tstart => tmax.max((a.tstart - t).min(a.tstop / IMPOSED)),
        _ => tmax,
    }
}

#[derive(Default)]
pub struct Memory {
    kinds: HashMap<u64, Kind>, // of stretches
    stretch: u64,
    longest: f64,   // step in the present one
    starting: bool, // the next accepted step is the first of its stretch
    landed: [f64; 8],
    place: usize,
}

/// What is known of stretches of a kind.
#[derive(Default)]
struct Kind {
    first: f64,   // length that the first step could have had
    longest: f64, // step
    wait: u32,    // so many more stretches until a leap is tried
    pause: u32,   // between two trials
}

/// A first step of so little of the longest one follows a transient. One that follows it is not asked for longer ones, and what was too much
/// to be leapt over at the start of a run, beside small currents, may be little later: a leap is tried now and then.
const FOLLOWS: f64 = 0.1;
const RAREST: u32 = 64;

/// More kinds of stretches than this are no repetition.
const KINDS: usize = 4096;
const ASKING: f64 = 1.3;

impl Memory {
    pub fn restart(&mut self, stretch: u64) {
        if let Some(kind) = self.kinds.get_mut(&self.stretch) {
            kind.longest = self.longest;
        }
        (self.stretch, self.starting, self.longest) = (stretch, true, 0.0);
    }

    pub fn length(&self) -> Option<f64> {
        self.kinds.get(&self.stretch).map(|kind| kind.first)
    }

    /// The same behind a jump, or the length of a leap over what follows it, for a method that may take one: in the second such stretch, and
    /// after twice as many each time that first steps remain short.
    pub fn first(&mut self, leaps: bool) -> Option<f64> {
        let kind = self.kinds.get_mut(&self.stretch)?;
        if !leaps || kind.first >= FOLLOWS * kind.longest {
            return Some(kind.first);
        }
        if kind.wait > 0 {
            kind.wait -= 1;
            return Some(kind.first);
        }
        kind.pause = (2 * kind.pause).clamp(1, RAREST);
        kind.wait = kind.pause;
        Some(kind.longest)
    }

    pub fn learn(&mut self, step: f64, next: f64) {
        self.longest = self.longest.max(step);
        if std::mem::take(&mut self.starting) {
            // a method may know nothing of longer steps after its first: ask it next time
            let next = if next == step { ASKING * next } else { next };
            if self.kinds.len() >= KINDS {
                self.kinds.clear();
            }
            self.kinds.entry(self.stretch).or_default().first = next;
        }
    }

    /// `left` to the bit as it was before, where it differs by rounding alone.
    pub fn recurring(&mut self, left: f64, rounding: f64) -> f64 {
        if let Some(&same) = self.landed.iter().find(|&&l| (l - left).abs() <= rounding) {
            return same;
        }
        self.landed[self.place] = left;
        self.place = (self.place + 1) % self.landed.len();
        left
    }
}
