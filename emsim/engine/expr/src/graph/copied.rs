//! A graph that begins as another one does, and takes over what that one has made since.
use super::{Graph, Id, Node};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};
use std::sync::{Arc, Mutex};

impl Graph {
    /// A copy that knows the nodes of `of`, whose beginning it has.
    pub fn copy(&self, of: &Arc<Mutex<Graph>>) -> Graph {
        Graph { copied: Some((of.clone(), self.nodes.len())), ..self.clone() }
    }

    /// Nodes in common with a graph that this is a copy of.
    pub fn in_common(&self, with: &Arc<Mutex<Graph>>) -> Option<usize> {
        self.copied.as_ref().filter(|(of, _)| Arc::ptr_eq(of, with)).map(|c| c.1)
    }

    /// A node of another graph, whose first `common` nodes this one has too.
    pub fn take_over(&mut self, other: &Graph, id: Id, common: usize) -> Id {
        if (id as usize) < common {
            return id;
        }
        let mut here: HashMap<Id, Id> = HashMap::default();
        for id in other.reachable(&[id]) {
            let mut ops = [0; 3];
            for (place, of) in ops.iter_mut().zip(other.node(id).operands()) {
                *place = here[&of];
            }
            let made = if (id as usize) < common { id } else { self.rebuild(other.node(id), ops) };
            here.insert(id, made);
        }
        here[&id]
    }

    /// What expressions need, operands first, in an order that hangs on their form alone: not on when their nodes were made, which
    /// differs with the parameters that a deck gives.
    pub fn in_order(&self, outs: &[Id]) -> Vec<Id> {
        let (mut done, mut order) = (HashSet::default(), Vec::new());
        let mut stack: Vec<(Id, bool)> = outs.iter().rev().map(|&id| (id, false)).collect();
        while let Some((id, ready)) = stack.pop() {
            if ready {
                order.push(id);
            } else if done.insert(id) {
                stack.push((id, true));
                let operands: Vec<Id> = self.node(id).operands().collect();
                stack.extend(operands.into_iter().rev().map(|o| (o, false)));
            }
        }
        order
    }

    /// Copies expressions to another graph; `leaf` says what becomes of leaves.
    pub fn copied(&self, outs: &[Id], to: &mut Graph, mut leaf: impl FnMut(Node, &mut Graph) -> Option<Id>) -> Vec<Id> {
        let mut image: HashMap<Id, Id> = HashMap::default();
        for id in self.in_order(outs) {
            let node = self.node(id);
            let new = leaf(node, to).unwrap_or_else(|| {
                let mut operands = [0; 3];
                node.operands().enumerate().for_each(|(k, o)| operands[k] = image[&o]);
                to.rebuild(node, operands)
            });
            image.insert(id, new);
        }
        outs.iter().map(|o| image[o]).collect()
    }
}
