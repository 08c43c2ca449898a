//! The end of a module: what its branches carry becomes rows, noise goes where it is used, and everything that is computed has a value.
use super::*;

impl Elaborator<'_> {
    pub(super) fn finish(mut self) -> Answer<Folded> {
        let (flows, merged) = self.branch_flows();
        let (noise, shared) = self.noise_flows();
        let rows = std::mem::take(&mut self.rows);
        let mut joined = self.between_nodes(flows.into_iter().chain(shared).chain(rows));
        self.add_port_flows(&mut joined);
        joined.retain(|f| self.g.value(f.i) != Some(0.0) || self.g.value(f.q) != Some(0.0));
        self.complete(joined, noise, merged)
    }

    /// What flows in every branch that somebody gives or reads, with the rows of unknown flows; nodes that are one.
    pub(super) fn branch_flows(&mut self) -> (Vec<Flow>, Vec<(usize, usize)>) {
        let zero = self.g.constant(0.0);
        let mut merged: Vec<(usize, usize)> = Vec::new();
        let mut sets: Vec<usize> = (0..self.unknowns.len()).collect();
        let mut flows: Vec<Flow> = Vec::new();
        for b in 0..self.branches.len() {
            let (from, to, state) = (self.branches[b].from, self.branches[b].to, self.branches[b].state);
            if let Some((i, q)) = self.branches[b].indirect {
                let x = self.flow_of(b);
                let k = self.branches[b].flow.unwrap_or(0);
                self.row(k, i, q.unwrap_or(zero));
                flows.push(Flow { from, to, i: x, q: zero });
                continue;
            }
            let kind = self.g.value(state.is_potential);
            let read = self.branches[b].flow.is_some();
            if !state.touched && !read {
                continue;
            }
            if kind == Some(0.0) && state.touched {
                if !read {
                    flows.push(Flow { from, to, i: state.i, q: state.iq });
                    continue;
                }
                let x = self.flow_of(b);
                let i = self.g.sub(x, state.i);
                let q = self.g.neg(state.iq);
                self.row(self.branches[b].flow.unwrap_or(0), i, q);
                flows.push(Flow { from, to, i: x, q: zero });
                continue;
            }
            // nothing but 0 V between two nodes, one of them inside: they are one
            let short =
                state.v == zero && state.vq == zero && kind == Some(1.0) && !read && self.branches[b].noise.is_empty();
            if short && (from == to || self.join(&mut sets, from, to)) {
                if from != to {
                    merged.push((from, to));
                }
                continue;
            }
            flows.push(Flow { from, to, i: self.potential(b), q: zero });
        }
        (flows, merged)
    }

    /// The row of a branch with a potential, always or by a condition; its flow.
    pub(super) fn potential(&mut self, b: usize) -> Id {
        let (from, to, state) = (self.branches[b].from, self.branches[b].to, self.branches[b].state);
        let v = self.port(from, to, None);
        let x = self.flow_of(b);
        let k = self.branches[b].flow.unwrap_or(0);
        let (v, vq) = (self.g.sub(v, state.v), self.g.neg(state.vq));
        // a flow that is read and nowhere given: potential 0
        let is_potential = if state.touched { state.is_potential } else { self.g.constant(1.0) };
        let (i, iq) = (self.g.sub(x, state.i), self.g.neg(state.iq));
        let i = self.g.select(is_potential, v, i);
        let q = self.g.select(is_potential, vq, iq);
        self.row(k, i, q);
        for (source, factor) in std::mem::take(&mut self.branches[b].noise) {
            self.sources[source].uses.push((k, GROUND, factor));
        }
        x
    }

    /// Noise, and the flows of what goes to several places: it goes there through an unknown.
    pub(super) fn noise_flows(&mut self) -> (Vec<folded::Noise>, Vec<Flow>) {
        let zero = self.g.constant(0.0);
        let (mut noise, mut flows) = (Vec::new(), Vec::new());
        for s in 0..self.sources.len() {
            let shared = self.sources[s].unknown.is_some() || self.sources[s].uses.len() > 1;
            if shared {
                let u = self.noise_unknown(s);
                for (from, to, factor) in self.sources[s].uses.clone().into_iter().skip(1) {
                    let i = self.g.mul(factor, u);
                    // in the row of an unknown current the sign does not matter
                    flows.push(Flow { from, to, i, q: zero });
                }
                self.sources[s].uses.truncate(1);
            }
            let source = &self.sources[s];
            if let Some(&(from, to, factor)) = source.uses.first() {
                let squared = self.g.mul(factor, factor);
                let (name, exponent) = (source.name.clone(), source.exponent);
                let power = self.g.mul(source.power, squared);
                if self.g.value(power) != Some(0.0) {
                    noise.push(folded::Noise { from, to, name, power, exponent });
                }
            }
        }
        (noise, flows)
    }

    /// Flows between the same nodes are one.
    pub(super) fn between_nodes(&mut self, flows: impl Iterator<Item = Flow>) -> Vec<Flow> {
        let mut joined: Vec<Flow> = Vec::new();
        let mut seats: HashMap<(usize, usize), usize> = HashMap::new();
        for flow in flows {
            let Flow { mut from, mut to, mut i, mut q } = flow;
            if from == to {
                continue;
            }
            let current = |k: usize| self.unknowns.get(k).is_some_and(|u| u.kind == Kind::Current);
            if (from == GROUND || seats.contains_key(&(to, from))) && !current(from) && !current(to) {
                (from, to) = (to, from);
                (i, q) = (self.g.neg(i), self.g.neg(q));
            }
            match seats.get(&(from, to)) {
                Some(&k) => {
                    joined[k].i = self.g.add(joined[k].i, i);
                    joined[k].q = self.g.add(joined[k].q, q);
                }
                None => {
                    seats.insert((from, to), joined.len());
                    joined.push(Flow { from, to, i, q });
                }
            }
        }
        joined
    }

    /// Rows of flows into ports that were read: the sum of what leaves the node.
    pub(super) fn add_port_flows(&mut self, joined: &mut Vec<Flow>) {
        let zero = self.g.constant(0.0);
        for (node, u, k) in std::mem::take(&mut self.port_flows) {
            let (mut i, mut q) = (zero, zero);
            for flow in joined.iter() {
                if flow.from == node {
                    i = self.g.add(i, flow.i);
                    q = self.g.add(q, flow.q);
                } else if flow.to == node {
                    i = self.g.sub(i, flow.i);
                    q = self.g.sub(q, flow.q);
                }
            }
            let i = self.g.sub(i, u);
            joined.push(Flow { from: k, to: GROUND, i, q });
        }
    }

    /// Everything that is computed has a value.
    pub(super) fn complete(
        mut self,
        mut flows: Vec<Flow>,
        mut noise: Vec<folded::Noise>,
        merged: Vec<(usize, usize)>,
    ) -> Answer<Folded> {
        let zero = self.g.constant(0.0);
        self.ask_for_noise(&mut noise);
        let mut needed: Vec<Id> = flows.iter().flat_map(|f| [f.i, f.q]).collect();
        needed.extend(noise.iter().flat_map(|n| [Some(n.power), n.exponent]).flatten());
        needed.extend(self.bound_step);
        // what rows do not read of a loop needs no value
        let mut needed = emsim_expr::repeat::pruned(&mut self.g, &needed);
        self.resolve_memories(&needed)?;
        needed.extend(self.modes.iter().map(|mode| mode.of()));
        self.resolve_finals()?;
        let mut needed = emsim_expr::derive::substitute(&mut self.g, &needed, &self.finals);
        let unset = |id: Id| self.unset.contains_key(&id);
        if let Some(id) = self.reached(&needed, &unset) {
            let (word, at) = self.unset[&id];
            let what =
                format!("{} has no value in some cases, and keeps that of an earlier evaluation", self.word(word));
            let hint = "assign to it before the conditions: state between evaluations is not supported";
            return self.stop(at, what, hint);
        }
        if self.reached(&needed, &|id| self.g.value(id).is_some_and(f64::is_nan)).is_some() {
            let about = &self.library.modules[self.scope.module];
            let what = format!("{} is no number for these parameters", self.word(about.name));
            let hint = "a parameter leads to 0/0, or to the logarithm or root of a negative number";
            return self.stop(about.at, what, hint);
        }
        let about = &self.library.modules[self.scope.module];
        self.is_small(about.at)?;
        let powers: Vec<Id> = noise.iter().flat_map(|n| [Some(n.power), n.exponent]).flatten().collect();
        let powers = emsim_expr::derive::substitute(&mut self.g, &powers, &self.finals);
        if self.g.reachable(&powers).into_iter().any(|id| matches!(self.g.node(id), Node::Flag(_) | Node::Wave(_))) {
            let hint = "let voltages decide, or make it of a source that is always there";
            return self.stop(about.at, "noise that hangs on events or on what was is not supported", hint);
        }
        let holes: Vec<(Id, Id)> = self.unset.keys().map(|&id| (id, zero)).collect();
        // what is never read is 0
        let told: Vec<Id> = self.outputs.iter().map(|o| o.value).collect();
        let mut values = emsim_expr::derive::substitute(&mut self.g, &told, &self.finals);
        values.append(&mut needed);
        let values = emsim_expr::derive::substitute(&mut self.g, &values, &holes);
        let mut values = emsim_expr::repeat::pruned(&mut self.g, &values);
        let modes: Vec<Id> = values.split_off(values.len() - self.modes.len());
        self.modes.iter_mut().zip(modes).for_each(|(mode, e)| *mode = mode.with(e));
        let mut values = values.into_iter();
        let outputs = self.outputs.iter_mut().map(|o| &mut o.value);
        let flown = flows.iter_mut().flat_map(|f| [&mut f.i, &mut f.q]);
        let heard = noise.iter_mut().flat_map(|n| std::iter::once(&mut n.power).chain(n.exponent.as_mut()));
        for (place, value) in outputs.chain(flown).chain(heard).chain(self.bound_step.as_mut()).zip(&mut values) {
            *place = value;
        }
        let read = flows.iter().flat_map(|f| [f.i, f.q]).chain(self.outputs.iter().map(|o| o.value));
        let read: Vec<Id> = read.chain(noise.iter().flat_map(|n| [Some(n.power), n.exponent]).flatten()).collect();
        let behaves = self.g.reachable(&read).into_iter().any(|id| Folded::is_foreign(self.g.node(id)));
        Ok(Folded {
            behaves,
            graph: self.g,
            unknowns: self.unknowns,
            terminals: self.terminals,
            merged,
            ports: self.ports,
            flows,
            noise,
            noise_tables: self.noise_tables,
            outputs: self.outputs,
            bound_step: self.bound_step,
            said: self.said,
            left_out: self.left_out,
            starts: self.starts,
            modes: self.modes,
            stimuli: self.stimuli,
        })
    }

    /// Powers as they are while `.noise` runs, which alone asks for them.
    pub(super) fn ask_for_noise(&mut self, noise: &mut [folded::Noise]) {
        let during: Vec<(Id, Id)> = folded::ANALYSES
            .iter()
            .filter_map(|name| Some((folded::symbol_of(name)?, f64::from(u8::from(*name == "noise")))))
            .map(|(symbol, holds)| (self.g.given(symbol), self.g.constant(holds)))
            .collect();
        for power in noise.iter_mut().flat_map(|n| std::iter::once(&mut n.power).chain(n.exponent.as_mut())) {
            *power = emsim_expr::derive::substitute(&mut self.g, &[*power], &during)[0];
        }
    }

    /// Makes two unknowns one, unless that would join two terminals.
    pub(super) fn join(&self, sets: &mut [usize], a: usize, b: usize) -> bool {
        fn root(sets: &[usize], mut k: usize) -> usize {
            while k != GROUND && sets[k] != k {
                k = sets[k];
            }
            k
        }
        let (a, b) = (root(sets, a), root(sets, b));
        let fixed = |k: usize| k == GROUND || k < self.terminals;
        if a == b {
            return true;
        }
        if fixed(a) && fixed(b) {
            return false;
        }
        // the smaller number stays: terminals come first
        let (keep, drop) = if fixed(a) || (!fixed(b) && a < b) { (a, b) } else { (b, a) };
        sets[drop] = keep;
        true
    }
}
