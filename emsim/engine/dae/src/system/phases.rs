//! Arguments of sines and cosines that are affine in time and unknowns: what may drive an oscillation beside the sources,
//! a `sin(377*time)` in an expression or a shaft that turns.
use crate::graph::{Fun, Graph, Id, Node};

/// A phase [rad] up to a constant: clock * t + sum of c * x[i].
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    pub clock: f64, // [rad/s]
    pub of: Vec<(usize, f64)>,
}

impl Phase {
    pub fn at(&self, t: f64, x: &[f64]) -> f64 {
        self.of.iter().fold(self.clock * t, |sum, &(i, c)| sum + c * x[i])
    }

    fn plus(mut self, other: Phase, factor: f64) -> Phase {
        self.clock += factor * other.clock;
        for (i, c) in other.of {
            match self.of.iter_mut().find(|(known, _)| *known == i) {
                Some(entry) => entry.1 += factor * c,
                None => self.of.push((i, factor * c)),
            }
        }
        self.of.retain(|entry| entry.1 != 0.0);
        self.of.sort_by_key(|entry| entry.0);
        self
    }
}

/// Every phase that the rows read, once each; of opposite ones the first.
pub fn phases(g: &Graph, rows: &[Id]) -> Vec<Phase> {
    let mut found: Vec<Phase> = Vec::new();
    for id in g.reachable(rows) {
        let Node::Call(Fun::Sin | Fun::Cos, argument) = g.node(id) else { continue };
        let Some(phase) = affine(g, argument).filter(|p| p.clock != 0.0 || !p.of.is_empty()) else { continue };
        let known = |p: &Phase| {
            let none = || Phase { clock: 0.0, of: Vec::new() };
            *p == phase || none().plus(phase.clone(), -1.0) == *p
        };
        if !found.iter().any(known) {
            found.push(phase);
        }
    }
    found
}

fn affine(g: &Graph, id: Id) -> Option<Phase> {
    let only = |clock, of| Some(Phase { clock, of });
    let scaled = |id, factor| Some(Phase { clock: 0.0, of: Vec::new() }.plus(affine(g, id)?, factor));
    match g.node(id) {
        Node::Const(_) => only(0.0, Vec::new()),
        Node::Time => only(1.0, Vec::new()),
        Node::Unknown(i) => only(0.0, vec![(i as usize, 1.0)]),
        Node::Neg(a) => scaled(a, -1.0),
        Node::Add(a, b) => Some(affine(g, a)?.plus(affine(g, b)?, 1.0)),
        Node::Sub(a, b) => Some(affine(g, a)?.plus(affine(g, b)?, -1.0)),
        Node::Mul(a, b) => match (g.value(a), g.value(b)) {
            (Some(c), _) => scaled(b, c),
            (_, Some(c)) => scaled(a, c),
            _ => None,
        },
        Node::Div(a, b) => scaled(a, 1.0 / g.value(b)?),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_of_time_and_of_angles_are_found_once_each() {
        let mut g = Graph::new();
        let (t, x, y) = (g.time(), g.unknown(3), g.unknown(1));
        let [w, two] = [377.0, 2.0].map(|v| g.constant(v));
        let turning = g.mul(w, t);
        let twice = g.mul(two, x);
        let both = g.sub(twice, y);
        let back = g.sub(y, twice);
        let bent = g.mul(x, y);
        let calls = [turning, both, back, bent, w].map(|a| g.call(Fun::Sin, a));
        let again = g.call(Fun::Cos, turning);
        let rows = [calls.as_slice(), &[again]].concat();
        let found = phases(&g, &rows);
        let of_time = Phase { clock: 377.0, of: Vec::new() };
        let of_angles = Phase { clock: 0.0, of: vec![(1, -1.0), (3, 2.0)] };
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found.contains(&of_time));
        assert!(found[1].of.len() == 2 && (found[1] == of_angles || found[1].at(0.0, &[0.0, 1.0, 0.0, 0.0]) == 1.0));
        assert_eq!(of_angles.at(5.0, &[0.0, 1.0, 0.0, 2.0]), 3.0);
    }
}
