//! Graphs that call loops: lists of arguments and results, and what is written of them.
use super::super::repeat::{self, Law};
use super::{Graph, Id, Node};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};

/// A graph as it is written: its nodes in order.
#[derive(Serialize, Deserialize)]
pub struct Listed {
    nodes: Vec<Node>,
    symbols: u32,
    /// loops that they call, by the numbers that these had where it was written
    loops: Vec<(u32, Law)>,
}

impl From<Graph> for Listed {
    fn from(g: Graph) -> Listed {
        let called = |node: &Node| if let Node::Result(number, ..) = node { Some(*number) } else { None };
        let numbers: BTreeSet<u32> = g.nodes.iter().filter_map(called).collect();
        let loops = numbers.into_iter().map(|number| (number, repeat::of(number).law().clone())).collect();
        Listed { nodes: g.nodes, symbols: g.symbols, loops }
    }
}

impl From<Listed> for Graph {
    fn from(mut of: Listed) -> Graph {
        let here: HashMap<u32, u32> = of.loops.into_iter().map(|(there, law)| (there, repeat::number(law))).collect();
        for node in &mut of.nodes {
            if let Node::Result(number, ..) = node {
                *number = here[number];
            }
        }
        let known = of.nodes.iter().enumerate().map(|(id, &node)| (node, id as Id)).collect();
        Graph { nodes: of.nodes, known, symbols: of.symbols, copied: None }
    }
}

impl Graph {
    /// A list of arguments.
    pub fn list(&mut self, of: &[Id]) -> Id {
        let nothing = self.constant(0.0);
        of.iter().fold(nothing, |list, &id| self.intern(Node::Join(list, id)))
    }

    /// The arguments of a list.
    pub fn listed(&self, list: Id) -> Vec<Id> {
        let ahead = |of: &Id| if let Node::Join(list, id) = self.node(*of) { Some((list, id)) } else { None };
        let mut found: Vec<Id> =
            std::iter::successors(ahead(&list), |(list, _)| ahead(list)).map(|(_, id)| id).collect();
        found.reverse();
        found
    }

    /// Result k of a loop for a list of arguments.
    pub fn result(&mut self, number: u32, k: u32, list: Id) -> Id {
        let values: Option<Vec<f64>> = self.listed(list).into_iter().map(|id| self.value(id)).collect();
        if let Some(values) = values {
            let known = repeat::of(number);
            let mut results = vec![0.0; known.results()];
            known.run(&values, &mut results);
            return self.constant(results[k as usize]);
        }
        self.intern(Node::Result(number, k, list))
    }
}
