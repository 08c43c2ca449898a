//! What expressions lead to, whatever their conditions decide.
use super::elaborate::Elaborator;
use emsim_expr::graph::{Id, Node};
use std::collections::{HashMap, HashSet};

impl Elaborator<'_> {
    /// What is bad and can be reached: not what lies behind conditions that exclude each other.
    pub fn reached(&self, needed: &[Id], bad: &dyn Fn(Id) -> bool) -> Option<Id> {
        let mut tainted: HashSet<Id> = HashSet::new();
        for id in self.g.reachable(needed) {
            if bad(id) || self.g.node(id).operands().any(|o| tainted.contains(&o)) {
                tainted.insert(id);
            }
        }
        let (mut assumed, mut clean, mut budget) = (HashMap::new(), vec![HashSet::new()], 200_000);
        needed.iter().find_map(|&id| self.leads(id, bad, &tainted, &mut assumed, &mut clean, &mut budget))
    }

    /// `clean`: what was found to lead nowhere, for each assumption more; what does under few assumptions does under more of them.
    fn leads(
        &self,
        id: Id,
        bad: &dyn Fn(Id) -> bool,
        tainted: &HashSet<Id>,
        assumed: &mut HashMap<Id, bool>,
        clean: &mut Vec<HashSet<Id>>,
        budget: &mut usize,
    ) -> Option<Id> {
        if !tainted.contains(&id) || clean.iter().any(|c| c.contains(&id)) {
            return None;
        }
        if bad(id) || *budget == 0 {
            // of what takes too long to follow any one is told
            return tainted.iter().copied().find(|&t| bad(t) && (t == id || *budget == 0));
        }
        *budget -= 1;
        let mut found = None;
        if let Node::Select(c, a, b) = self.g.node(id) {
            if let Some(&known) = assumed.get(&c) {
                found = self.leads(if known { a } else { b }, bad, tainted, assumed, clean, budget);
            } else {
                found = self.leads(c, bad, tainted, assumed, clean, budget);
                for (side, holds) in [(a, true), (b, false)] {
                    if found.is_none() {
                        assumed.insert(c, holds);
                        clean.push(HashSet::new());
                        found = self.leads(side, bad, tainted, assumed, clean, budget);
                        clean.pop();
                        assumed.remove(&c);
                    }
                }
            }
        } else {
            for o in self.g.node(id).operands() {
                found = found.or_else(|| self.leads(o, bad, tainted, assumed, clean, budget));
            }
        }
        if found.is_none() {
            if let Some(top) = clean.last_mut() {
                top.insert(id);
            }
        }
        found
    }
}
