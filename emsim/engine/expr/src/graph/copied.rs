//! A graph that begins as another one does, and takes over what that one has made since.
use super::{Graph, Id};
use std::collections::HashMap;
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
        let mut here: HashMap<Id, Id> = HashMap::new();
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
}
