//! Graphs that call loops: lists of arguments and results, and what is written of them.
use super::super::alike;
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
    /// ... and forms: their graphs and expressions
    forms: Vec<(u32, Graph, Vec<Id>)>,
}

impl From<Graph> for Listed {
    fn from(g: Graph) -> Listed {
        let called = |node: &Node| if let Node::Result(number, ..) = node { Some(*number) } else { None };
        let numbers: BTreeSet<u32> = g.nodes.iter().filter_map(called).collect();
        let (forms, loops): (Vec<u32>, Vec<u32>) = numbers.into_iter().partition(|&number| alike::is(number));
        let loops = loops.into_iter().map(|number| (number, repeat::of(number).law().clone())).collect();
        let written = |number| {
            let form = alike::of(number);
            (number, form.graph.clone(), form.outs.clone())
        };
        Listed { nodes: g.nodes, symbols: g.symbols, loops, forms: forms.into_iter().map(written).collect() }
    }
}

impl From<Listed> for Graph {
    fn from(mut of: Listed) -> Graph {
        let mut here: HashMap<u32, u32> =
            of.loops.into_iter().map(|(there, law)| (there, repeat::number(law))).collect();
        here.extend(of.forms.into_iter().map(|(there, graph, outs)| {
            let key = (graph.nodes.clone(), outs.clone());
            (there, alike::number(key, || (graph, outs)))
        }));
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
    #[cfg(test)]
    pub fn listed_and_back(&self) -> Graph {
        Listed::from(self.clone()).into()
    }

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

    /// A node as it is shown: where it is a call of a form, what that stands for.
    pub fn shown(&mut self, id: Id) -> Node {
        match self.node(id) {
            Node::Result(number, k, list) if alike::is(number) => {
                let id = alike::inlined(self, (number, k, list));
                self.node(id)
            }
            node => node,
        }
    }

    /// Result k of a loop for a list of arguments.
    pub fn result(&mut self, number: u32, k: u32, list: Id) -> Id {
        if matches!(self.node(list), Node::Join(_, last) if self.value(last).is_none()) {
            return self.intern(Node::Result(number, k, list));
        }
        let values: Option<Vec<f64>> = self.listed(list).into_iter().map(|id| self.value(id)).collect();
        if let Some(values) = values {
            return self.constant(repeat::value(number, k, &values));
        }
        self.intern(Node::Result(number, k, list))
    }
}
