//! What a flag asks for: laws of flags at their thresholds, and how near to a threshold is on it. The semantics stand in events.rs.
use crate::graph::{Fun, Graph, Id, Node};
use crate::model::{Kind, Law, Unknown};
use crate::rounding::SUMMED;
use std::collections::HashMap;

/// Beside the flags: which of them have been beyond their thresholds since they turned, and how wide the thresholds are.
#[derive(Clone, Default)]
pub struct Standing {
    /// by flag: its operand has been on the flag's own side since it turned. Until then it stands on the threshold.
    pub armed: Vec<bool>,
    /// by flag: its operand as it turned since the last step; NaN: it has not turned
    pub fresh: Vec<f64>,
    /// by flag: from so far on its operand is not at the threshold
    pub band: Vec<f64>,
    /// by flag: what absolute tolerances of the machine's motion come to in its operand. A machine that starts from rest has moved by less
    /// for a while, and which side of a threshold that is nobody knows.
    pub floor: Vec<f64>,
    /// the run begins with given values: switches that stand at their thresholds are what their cards say
    pub given: bool,
    /// by flag of a law's mode: how far beyond its threshold it asks while it has not been clear of it, [off, on]
    pub modes: Vec<[f64; 2]>,
    /// a flag that is kept from turning, so that a test can see the check of flags fire
    pub stuck: Option<usize>,
}

impl Standing {
    pub fn new(flags: usize) -> Standing {
        Standing {
            armed: vec![true; flags],
            fresh: vec![f64::NAN; flags],
            band: vec![0.0; flags],
            floor: vec![0.0; flags],
            given: false,
            modes: Vec::new(),
            stuck: None,
        }
    }

    /// Positive asks for a turn. `beyond` is the operand, counted towards the other side of the flag.
    pub fn asks(&self, k: usize, law: Law, on: bool, beyond: f64) -> f64 {
        if law.of_modes() {
            return match law {
                Law::Mode if self.armed[k] => beyond,
                Law::Mode => beyond - self.mode_band(k, on),
                _ => -1.0,
            };
        }
        let band = self.band[k];
        let at_threshold = self.armed[k]
            && match law {
                Law::Condition => on,
                Law::Arrival => true,
                Law::Stays | Law::Leg => false,
                Law::Memory | Law::History | Law::Mode | Law::Kept => return -1.0,
            };
        match at_threshold {
            // on the threshold is too far
            true if beyond + band == 0.0 => f64::MIN_POSITIVE,
            true => beyond + band,
            false => beyond - band.max(self.unknown(k)),
        }
    }

    /// So near to its threshold a flag has that it has turned at, while all that it reads is smaller still.
    pub fn unknown(&self, k: usize) -> f64 {
        if self.size(k) < self.floor[k] {
            self.floor[k]
        } else {
            0.0
        }
    }

    pub fn mode_band(&self, k: usize, on: bool) -> f64 {
        self.modes.get(k).map_or(0.0, |bands| bands[usize::from(on)])
    }

    /// Is an operand so far on the flag's own side that it is clear of the threshold?
    pub fn clears(&self, k: usize, law: Law, on: bool, beyond: f64) -> bool {
        beyond < -if law.of_modes() { self.mode_band(k, on) } else { self.band[k].max(self.unknown(k)) }
    }

    pub fn size(&self, k: usize) -> f64 {
        self.band[k] / SUMMED
    }

    /// What is added up in a flag's operand is so large.
    pub fn widen(&mut self, k: usize, size: f64) {
        if size.is_finite() {
            self.band[k] = self.band[k].max(SUMMED * size);
        }
    }
}

/// The largest quantities of each kind so far: what a solution's rounding is a part of.
#[derive(Clone, Default)]
pub struct Scale {
    by_kind: [f64; 7],
    pub of: Vec<f64>, // by unknown
    time: f64,
}

impl Scale {
    /// True where something is larger now than it was.
    pub fn observe(&mut self, unknowns: &[Unknown], x: &[f64], t: f64) -> bool {
        let mut by_kind = self.by_kind;
        for (u, x) in unknowns.iter().zip(x) {
            let largest = &mut by_kind[u.kind as usize];
            *largest = largest.max(x.abs());
        }
        // scales that have grown by less are as they were
        let grown = by_kind.iter().zip(&self.by_kind).any(|(new, old)| *new > 1.25 * old) || t > 1.25 * self.time;
        if grown {
            (self.by_kind, self.time) = (by_kind, t);
            self.of.clear();
            self.of.extend(unknowns.iter().map(|u: &Unknown| by_kind[u.kind as usize]));
        }
        grown
    }
}

const _: () = assert!(Kind::Derivative as usize == 6);

/// Sum of the magnitudes of what is added up in e: e is known to the rounding of that.
pub fn size(g: &mut Graph, e: Id) -> Id {
    let mut sizes: HashMap<Id, Id> = HashMap::new();
    for id in g.reachable(&[e]) {
        let of = |o: Id| sizes[&o];
        let size = match g.node(id) {
            Node::Const(bits) => g.constant(f64::from_bits(bits).abs()),
            Node::Flag(_) => id,
            Node::Neg(a) => of(a),
            Node::Add(a, b) | Node::Sub(a, b) => {
                let (a, b) = (of(a), of(b));
                g.add(a, b)
            }
            Node::Mul(a, b) => {
                let (a, b) = (of(a), of(b));
                g.mul(a, b)
            }
            Node::Select(c, a, b) => {
                let (a, b) = (of(a), of(b));
                g.select(c, a, b)
            }
            Node::Div(a, b) => {
                let (a, b) = (of(a), g.call(Fun::Abs, b));
                g.div(a, b)
            }
            _ => g.call(Fun::Abs, id),
        };
        sizes.insert(id, size);
    }
    sizes[&e]
}
