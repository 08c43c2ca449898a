//! Statements: assignments, conditions, loops, contributions.
use super::ast::{Expression, Statement, Type, Variable, E, S};
use super::elaborate::{Answer, Elaborator, Frame, Num, State, Val};
use super::looped::End;
use super::source::Place;
use emsim_expr::graph::Id;
use emsim_expr::interrupt;
use emsim_expr::repeat::MOST_STEPS;
use std::rc::Rc;

const REACHED: &str = "where voltages decide whether it is reached";

impl Elaborator<'_> {
    pub fn new_frame(&mut self, variables: &[Variable], function: usize) -> Answer<Frame> {
        let mut frame = Frame { function, stamps: vec![0; variables.len()], ..Frame::default() };
        for variable in variables {
            let one = self.unset_value(variable);
            frame.values.push(match variable.size {
                Some((a, b)) => {
                    let (low, high) = (self.index_of(a)?, self.index_of(b)?);
                    if (high - low).abs() > 100_000 {
                        return self.stop(variable.at, "more than 100000 values", "");
                    }
                    Val::Row(low.min(high), Rc::new(vec![one; (high - low).unsigned_abs() as usize + 1]))
                }
                None => one,
            });
        }
        Ok(frame)
    }

    /// A variable that has no value yet: a symbol that must not be left in the end.
    fn unset_value(&mut self, variable: &Variable) -> Val {
        if variable.kind == Type::Text {
            return Val::Text("".into());
        }
        let id = self.g.symbol();
        self.unset.insert(id, (variable.name, variable.at));
        Val::Num(Num { id, whole: variable.kind == Type::Integer, q: None, noise: None })
    }

    pub fn variable(&self, k: u32) -> &Variable {
        let module = &self.library.modules[self.scope.module];
        match self.frame.function {
            0 => &module.variables[k as usize],
            f => &module.functions[f - 1].variables[k as usize],
        }
    }

    /// The value of a variable: 0 before it is assigned to, and then it may not be assigned to later.
    pub fn read(&mut self, k: u32, e: E) -> Answer<Val> {
        let Some(value) = self.frame.values.get(k as usize).cloned() else {
            return self.stop(self.place(e), "a variable cannot be read here", "parameters follow from parameters");
        };
        let Val::Num(n) = value else { return Ok(value) };
        let id = self.within(n.id);
        if self.unset.contains_key(&id) {
            let at = self.place(e);
            self.frame.early.entry(k).or_insert(at);
            return Ok(Val::Num(Num { id: self.g.constant(0.0), ..n }));
        }
        Ok(Val::Num(Num { id, ..n }))
    }

    pub fn begin(&mut self, k: u32, initial: Option<E>) -> Answer<()> {
        let variable = self.variable(k).clone();
        let value = match initial {
            Some(e) => self.eval(e)?,
            None => return Ok(()),
        };
        if let (Val::Row(_, items), Some((a, b))) = (&value, variable.size) {
            let (low, high) = (self.index_of(a)?, self.index_of(b)?);
            if items.len() as i64 != (high - low).abs() + 1 {
                return self.stop(variable.at, "the number of values does not fit the range", "");
            }
            self.keep(k, Val::Row(low.min(high), items.clone()));
            return Ok(());
        }
        let value = self.converted(value, variable.kind, variable.at)?;
        self.keep(k, value);
        Ok(())
    }

    /// Gives a variable its value, with what it was noted for the condition that is run.
    pub fn keep(&mut self, k: u32, value: Val) {
        let slot = &mut self.frame.values[k as usize];
        let old = std::mem::replace(slot, value);
        if self.stamp > 0 && self.frame.stamps[k as usize] != self.stamp {
            self.frame.stamps[k as usize] = self.stamp;
            self.frame.journal.push((k, old));
        }
    }

    pub fn assign(&mut self, k: u32, index: Option<E>, value: Val, at: Place) -> Answer<()> {
        if self.is_held(k) {
            let what = format!("{} is set at an event and here", self.word(self.variable(k).name));
            return self.stop(at, what, "what keeps its value is set at events alone");
        }
        self.may_keep(k, at)?;
        let kind = self.variable(k).kind;
        let value = match (self.frame.values.get(k as usize), index) {
            (Some(Val::Row(first, items)), Some(index)) => {
                let (first, mut items) = (*first, items.clone());
                let value = self.converted(value, kind, at)?;
                let j = self.index_of(index)?;
                match usize::try_from(j - first).ok().filter(|&j| j < items.len()) {
                    Some(j) => Rc::make_mut(&mut items)[j] = value,
                    None => {
                        let last = first + items.len() as i64 - 1;
                        return self.stop(self.place(index), format!("{j} is outside of {first}:{last}"), "");
                    }
                }
                Val::Row(first, items)
            }
            (Some(Val::Row(first, items)), None) => match value {
                Val::Row(_, new) if new.len() == items.len() => Val::Row(*first, new),
                _ => return self.stop(at, "one value for a row of them", "write name[index] = ..."),
            },
            (Some(_), Some(_)) => return self.stop(at, "this variable is no row of values", "declare it with a range"),
            _ => self.converted(value, kind, at)?,
        };
        if let Some(&early) = self.frame.early.get(&k) {
            let zero = matches!(&value, Val::Num(n) if self.value_of(n) == Some(0.0));
            if !zero {
                let name = self.word(self.variable(k).name);
                let what = format!("{name} is read before it has a value, and keeps that of an earlier evaluation");
                return self.stop(early, what, "assign to it first: state between evaluations is not supported");
            }
        }
        self.keep(k, value);
        Ok(())
    }

    pub fn execute(&mut self, s: S) -> Answer<()> {
        self.steps += 1;
        interrupt::spent(100);
        let library = self.library;
        if self.steps > MOST_STEPS {
            let at = library.statement_places[s as usize];
            return self.stop(at, "the module takes too many steps", "does a loop never end?");
        }
        match &library.statements[s as usize] {
            Statement::Nothing => {}
            Statement::Block(body) => {
                for &s in body {
                    self.execute(s)?;
                }
            }
            Statement::Begin(k, initial) => {
                let variable = self.variable(*k).clone();
                if self.is_held(*k) {
                    if initial.is_some() {
                        let hint = "declare it in the module";
                        return self.stop(variable.at, "a variable that events set begins anew here", hint);
                    }
                } else if initial.is_some() {
                    self.begin(*k, *initial)?;
                } else if variable.size.is_none() && self.loops == 0 {
                    let value = self.unset_value(&variable);
                    self.keep(*k, value);
                }
            }
            Statement::Assign(k, index, e) => {
                let value = self.eval(*e)?;
                self.assign(*k, *index, value, library.statement_places[s as usize])?;
            }
            Statement::If(c, yes, no) => {
                let c = self.number(*c)?;
                let c = self.plain(&c);
                match self.decided(c.id) {
                    Some(true) => self.execute(*yes)?,
                    Some(false) => {
                        if let Some(no) = no {
                            self.execute(*no)?;
                        }
                    }
                    None => {
                        let c = self.condition(c.id);
                        let (yes, no) = (*yes, *no);
                        self.either(c, |run| run.execute(yes), |run| no.map_or(Ok(()), |s| run.execute(s)))?;
                    }
                }
            }
            Statement::Case(e, arms, otherwise) => {
                let value = self.eval(*e)?;
                self.case(value, arms, *otherwise)?;
            }
            Statement::For(first, c, next, body) => {
                self.execute(*first)?;
                self.repeated(*c, &[*body, *next], None, 0)?;
            }
            Statement::While(c, body, unroll) => self.repeated(*c, &[*body], *unroll, 0)?,
            Statement::Repeat(count, body) => self.counted(*count, *body)?,
            Statement::Event(triggers, body) => self.event(triggers, *body, library.statement_places[s as usize])?,
            Statement::Contribute(to, e) => {
                let value = self.number(*e)?;
                self.contribute(*to, value)?;
            }
            Statement::Indirect(to, e) => self.indirect(*to, *e)?,
            Statement::Call(e) => self.task(*e)?,
        }
        Ok(())
    }

    fn case(&mut self, value: Val, arms: &[(Vec<E>, S)], otherwise: Option<S>) -> Answer<()> {
        let Some(((labels, body), rest)) = arms.split_first() else {
            return otherwise.map_or(Ok(()), |s| self.execute(s));
        };
        // the first label that fits
        let mut holds = self.whole(0.0);
        for &label in labels {
            let same = match (&value, self.eval(label)?) {
                (Val::Text(a), Val::Text(b)) => self.whole(f64::from(u8::from(*a == b))),
                (Val::Num(a), Val::Num(b)) => {
                    let (a, b) = (self.plain(a), self.plain(&b));
                    self.comparison(super::ast::Operator::Equals, a.id, b.id)
                }
                _ => return self.stop(self.place(label), "a label of another type than the value", ""),
            };
            let one = self.g.constant(1.0);
            let id = self.g.select(same.id, one, holds.id);
            holds = Num { whole: true, ..self.real(id) };
        }
        match self.decided(holds.id) {
            Some(true) => self.execute(*body),
            Some(false) => self.case(value, rest, otherwise),
            None => {
                let c = self.condition(holds.id);
                let again = value.clone();
                self.either(c, |run| run.execute(*body), |run| run.case(again, rest, otherwise))
            }
        }
    }

    /// A loop: as long as parameters decide it is run; from where voltages do it is a loop of its own, or it is nested, one repetition
    /// in the other.
    fn repeated(&mut self, c: E, body: &[S], unroll: Option<u32>, done: usize) -> Answer<()> {
        self.loops += 1;
        let mut done = done;
        loop {
            let condition = self.number(c)?;
            let condition = self.plain(&condition);
            self.steps += 1;
            match self.decided(condition.id) {
                Some(false) => break,
                Some(true) => {
                    if self.steps > MOST_STEPS {
                        let hint = "the condition of this loop stays true";
                        return self.stop(self.place(c), "the module takes too many steps", hint);
                    }
                    for &s in body {
                        self.execute(s)?;
                    }
                }
                None => {
                    if unroll == Some(done as u32) {
                        break;
                    }
                    let c2 = self.condition(condition.id);
                    let impeding = if unroll.is_some() { None } else { self.impeding(c, body) };
                    if unroll.is_none() && impeding.is_none() {
                        self.looped(End::Condition(c), body, c2)?;
                        break;
                    }
                    // how often a loop is repeated whose end hangs on voltages, if it does not say
                    if done >= 200 || self.g.len() > 200_000 {
                        let (at, what) = impeding.unwrap_or((self.place(c), "it is unrolled".into()));
                        let text = format!("{what} in a loop whose end hangs on voltages");
                        let hint = "bound it: (* unroll = 10 *) while (...), or by a counter that ends it";
                        return self.stop(at, text, hint);
                    }
                    self.either(
                        c2,
                        |run| {
                            for &s in body {
                                run.execute(s)?;
                            }
                            run.repeated(c, body, unroll, done + 1)
                        },
                        |_| Ok(()),
                    )?;
                    break;
                }
            }
            done += 1;
        }
        self.loops -= 1;
        Ok(())
    }

    /// Runs both sides of a condition that voltages decide; what they changed becomes a selection.
    fn either(
        &mut self,
        c: (Id, bool),
        yes: impl FnOnce(&mut Self) -> Answer<()>,
        no: impl FnOnce(&mut Self) -> Answer<()>,
    ) -> Answer<()> {
        if self.path.len() > 500 {
            let at = self.library.modules[self.scope.module].at;
            return self.stop(at, "conditions are nested too deeply", "");
        }
        let (zero, one) = (self.g.constant(0.0), self.g.constant(1.0));
        let outer = std::mem::take(&mut self.frame.journal);
        let stamp = self.stamp;
        let before: Vec<State> = self.branches.iter().map(|b| b.state).collect();
        let first = self.side((c.0, !c.1), yes)?;
        let firsts: Vec<State> = self.branches.iter().map(|b| b.state).collect();
        for (b, branch) in self.branches.iter_mut().enumerate() {
            if let Some(&state) = before.get(b) {
                branch.state = state;
            } else {
                branch.state =
                    State { is_potential: zero, i: zero, iq: zero, v: zero, vq: zero, touched: false, keep: one };
            }
        }
        let untouched: Vec<State> = self.branches.iter().map(|b| b.state).collect();
        let second = self.side((c.0, c.1), no)?;
        self.frame.journal = outer;
        self.stamp = stamp;
        // variables: those that either side changed; a side that did not has the old value
        for (k, value) in &first {
            let other = second.iter().find(|s| s.0 == *k).map(|s| s.1.clone());
            let other = other.unwrap_or_else(|| self.frame.values[*k as usize].clone());
            let at = self.variable(*k).at;
            let merged = self.merged(c, value.clone(), other, at)?;
            self.keep(*k, merged);
        }
        for (k, value) in &second {
            if first.iter().any(|f| f.0 == *k) {
                continue;
            }
            let old = self.frame.values[*k as usize].clone();
            let at = self.variable(*k).at;
            let merged = self.merged(c, old, value.clone(), at)?;
            self.keep(*k, merged);
        }
        // branches: each side began its sums at 0
        for b in 0..self.branches.len() {
            let fresh = State { is_potential: zero, i: zero, iq: zero, v: zero, vq: zero, touched: false, keep: one };
            let old = untouched.get(b).copied().unwrap_or(fresh);
            let here = self.branches[b].state;
            let there = firsts.get(b).copied().unwrap_or(State { touched: false, ..old });
            self.branches[b].state = self.joined(c, old, there, here);
        }
        Ok(())
    }

    /// One side of a condition: the values of the variables that it changed; they are set back. Branches begin with empty sums.
    fn side(&mut self, known: (Id, bool), run: impl FnOnce(&mut Self) -> Answer<()>) -> Answer<Vec<(u32, Val)>> {
        let (zero, one) = (self.g.constant(0.0), self.g.constant(1.0));
        self.next_stamp += 1;
        self.stamp = self.next_stamp;
        for branch in &mut self.branches {
            let state = &mut branch.state;
            (state.i, state.iq, state.v, state.vq) = (zero, zero, zero, zero);
            (state.touched, state.keep) = (false, one);
        }
        self.path.push(known);
        let done = run(self);
        self.path.pop();
        done?;
        Ok(self.undone())
    }

    /// Sets back what was changed since the journal began; the values that it had come to.
    pub fn undone(&mut self) -> Vec<(u32, Val)> {
        let journal = std::mem::take(&mut self.frame.journal);
        let mut values: Vec<(u32, Val)> = Vec::new();
        for (k, old) in journal.into_iter().rev() {
            let new = std::mem::replace(&mut self.frame.values[k as usize], old);
            if !values.iter().any(|v| v.0 == k) {
                values.push((k, new));
            }
        }
        values.reverse();
        values
    }

    /// What a branch was given, after a condition: what it was before, where the sides keep it, plus what either side added.
    fn joined(&mut self, c: (Id, bool), old: State, yes: State, no: State) -> State {
        if !yes.touched && !no.touched {
            return old;
        }
        let keep = self.select(c, yes.keep, no.keep);
        let mut add = |old: Id, a: Id, b: Id| {
            let before = self.gate(keep, old);
            let sum = self.select(c, a, b);
            self.g.add(before, sum)
        };
        State {
            i: add(old.i, yes.i, no.i),
            iq: add(old.iq, yes.iq, no.iq),
            v: add(old.v, yes.v, no.v),
            vq: add(old.vq, yes.vq, no.vq),
            is_potential: self.select(c, yes.is_potential, no.is_potential),
            touched: true,
            keep: self.gate(keep, old.keep),
        }
    }

    /// x where the condition holds, else 0.
    fn gate(&mut self, condition: Id, x: Id) -> Id {
        let zero = self.g.constant(0.0);
        self.g.select(condition, x, zero)
    }

    // ---- contributions ----

    fn target(&mut self, to: E) -> Answer<(usize, bool, bool)> {
        let library = self.library;
        let at = self.place(to);
        let Expression::Call(word, arguments) = &library.expressions[to as usize] else {
            return self.stop(at, "only branches can be contributed to", "");
        };
        if self.frame.function > 0 {
            return self.stop(
                at,
                "functions cannot contribute to branches",
                "give the value back, and contribute outside",
            );
        }
        if let Some(Expression::Port(_)) = arguments.first().map(|&a| &library.expressions[a as usize]) {
            return self.stop(at, "the flow into a port can only be read", "contribute to a branch");
        }
        let (branch, turned) = self.branch_of(arguments, at)?;
        let flow = self.is_flow(self.word(*word), branch, at)?;
        Ok((branch, turned, flow))
    }

    fn contribute(&mut self, to: E, value: Num) -> Answer<()> {
        let at = self.place(to);
        let (b, turned, flow) = self.target(to)?;
        if self.branches[b].indirect.is_some() {
            return self.stop(at, "this branch is given indirectly already", "keep one of both");
        }
        let zero = self.g.constant(0.0);
        let sign = self.g.constant(if turned { -1.0 } else { 1.0 });
        // noise goes its own way
        let guards = self.path.clone();
        for &(source, factor) in value.noise.iter().flat_map(|n| n.iter()) {
            let mut factor = self.g.mul(factor, sign);
            for &(c, holds) in guards.iter().rev() {
                factor = if holds { self.g.select(c, factor, zero) } else { self.g.select(c, zero, factor) };
            }
            if flow {
                let (from, to) = (self.branches[b].from, self.branches[b].to);
                self.sources[source].uses.push((from, to, factor));
            } else {
                self.branches[b].noise.push((source, factor));
            }
        }
        let id = self.g.mul(value.id, sign);
        let q = value.q.map_or(zero, |q| self.g.mul(q, sign));
        if flow && id == zero && q == zero {
            // noise by itself, or a conductance of 0, opens no short circuit
            self.branches[b].state.touched = true;
            return Ok(());
        }
        let mut state = self.branches[b].state;
        // a contribution of the other kind discards what was before
        let kind = self.g.constant(f64::from(u8::from(!flow)));
        if state.is_potential != kind {
            // some sides of conditions before may have made it this kind: those go on
            let (zero, one) = (self.g.constant(0.0), self.g.constant(1.0));
            let c = state.is_potential;
            let same = if flow { self.g.select(c, zero, one) } else { self.g.select(c, one, zero) };
            for x in [&mut state.i, &mut state.iq, &mut state.v, &mut state.vq, &mut state.keep] {
                *x = self.gate(same, *x);
            }
            state.is_potential = kind;
        }
        state.touched = true;
        if flow {
            state.i = self.g.add(state.i, id);
            state.iq = self.g.add(state.iq, q);
        } else {
            state.v = self.g.add(state.v, id);
            state.vq = self.g.add(state.vq, q);
        }
        self.branches[b].state = state;
        self.branches[b].at = at;
        Ok(())
    }

    /// V(out) : expression == expression.
    fn indirect(&mut self, to: E, e: E) -> Answer<()> {
        let at = self.place(to);
        let (b, _, _) = self.target(to)?;
        let library = self.library;
        let Expression::Binary(super::ast::Operator::Equals, left, right) = library.expressions[e as usize] else {
            return self.stop(at, "an equation is expected behind the colon", "V(out) : V(in) == 0;");
        };
        if !self.path.is_empty() {
            let hint = "write it outside, with ?: in it";
            return self.stop(at, "an equation inside of a condition that voltages decide", hint);
        }
        if self.branches[b].indirect.is_some() || self.branches[b].state.touched {
            return self.stop(at, "this branch is given twice", "keep one of both");
        }
        let (left, right) = (self.number(left)?, self.number(right)?);
        let minus = self.g.constant(-1.0);
        let right = Num {
            id: self.g.mul(right.id, minus),
            q: right.q.map(|q| self.g.mul(q, minus)),
            ..self.without_noise(right)
        };
        let left = self.without_noise(left);
        let sum = self.sum(&left, &right);
        self.branches[b].indirect = Some((sum.id, sum.q));
        Ok(())
    }

    fn without_noise(&mut self, n: Num) -> Num {
        if n.noise.is_none() {
            return n;
        }
        let q = n.q;
        let plain = self.plain(&Num { q: None, ..n });
        Num { q, ..plain }
    }

    // ---- tasks ----

    /// A system task.
    fn task(&mut self, e: E) -> Answer<()> {
        let library = self.library;
        let at = self.place(e);
        let (word, arguments): (_, &[E]) = match &library.expressions[e as usize] {
            Expression::Call(word, arguments) => (*word, arguments),
            Expression::System(word) => (*word, &[]),
            Expression::Function(..) => {
                self.eval(e)?;
                return Ok(());
            }
            _ => return self.stop(at, "this is no statement", ""),
        };
        let name = self.word(word);
        match name {
            "$bound_step" => {
                let n = self.number(arguments[0])?;
                let n = self.plain(&n);
                let longest = self.g.constant(f64::INFINITY);
                let mut step = n.id;
                for &(c, holds) in self.path.clone().iter().rev() {
                    step = if holds { self.g.select(c, step, longest) } else { self.g.select(c, longest, step) };
                }
                self.bound_step = Some(match self.bound_step {
                    Some(other) => {
                        let c = self.g.not_less(step, other);
                        self.g.select(c, other, step)
                    }
                    None => step,
                });
            }
            "$discontinuity" => {}
            "$strobe" | "$display" | "$write" | "$monitor" | "$debug" | "$warning" | "$info" => {
                // what is said while voltages decide would be said at every evaluation
                if self.path.is_empty() {
                    let text = self.formatted(arguments)?;
                    if self.said.len() < 100 {
                        self.said.extend(text);
                    }
                } else {
                    self.leave_out(&format!("{name} {REACHED}"), "it is not carried out");
                }
            }
            "$error" | "$fatal" | "$finish" | "$stop" => {
                if !self.path.is_empty() {
                    self.leave_out(&format!("{name} {REACHED}"), "it is not carried out");
                } else {
                    let skip = usize::from(name == "$fatal");
                    let text =
                        if name == "$finish" { None } else { self.formatted(arguments.get(skip..).unwrap_or(&[]))? };
                    let said = self.said.pop();
                    let text = text.or(said).unwrap_or_else(|| format!("the module ends with {name}"));
                    return self.stop(at, text, "the module refuses these parameters");
                }
            }
            _ if name.starts_with('$') => {
                self.eval(e)?;
            }
            _ => {
                return self.stop(
                    at,
                    format!("{name} alone has no effect"),
                    "contribute its value to a branch, or assign it",
                );
            }
        }
        Ok(())
    }

    /// What is not done as the language has it, told once.
    pub fn leave_out(&mut self, what: &str, instead: &str) {
        let text = format!("{what}: {instead}");
        if !self.left_out.contains(&text) {
            self.left_out.push(text);
        }
    }

    /// The text of $strobe and others; None where a value hangs on voltages.
    fn formatted(&mut self, arguments: &[E]) -> Answer<Option<String>> {
        let mut values = Vec::new();
        for &e in arguments {
            if matches!(self.library.expressions[e as usize], Expression::Empty) {
                continue;
            }
            values.push(self.eval(e)?);
        }
        let mut out = String::new();
        let mut rest = values.iter();
        let shown = |run: &Self, v: Option<&Val>, letter: char| -> Option<String> {
            match v {
                Some(Val::Text(t)) => Some(t.to_string()),
                Some(Val::Num(n)) => run.value_of(n).map(|v| match letter {
                    'd' => format!("{}", v.round()),
                    'e' => format!("{v:e}"),
                    'f' => format!("{v:.6}"),
                    _ => format!("{v}"),
                }),
                _ => Some(String::new()),
            }
        };
        while let Some(value) = rest.next() {
            match value {
                Val::Text(format) => {
                    let mut c = format.chars().peekable();
                    while let Some(x) = c.next() {
                        if x != '%' {
                            out.push(x);
                            continue;
                        }
                        while c.peek().is_some_and(|d| d.is_ascii_digit() || matches!(d, '.' | '-' | '+' | ' ')) {
                            c.next();
                        }
                        match c.next() {
                            Some('%') | None => out.push('%'),
                            Some('m' | 'M') => out.push_str(self.scope.prefix.trim_end_matches('.')),
                            Some(letter) => match shown(self, rest.next(), letter.to_ascii_lowercase()) {
                                Some(text) => out.push_str(&text),
                                None => return Ok(None),
                            },
                        }
                    }
                }
                other => match shown(self, Some(other), 'g') {
                    Some(text) => out.push_str(&text),
                    None => return Ok(None),
                },
            }
        }
        Ok(Some(out.trim_end().to_string()))
    }
}
