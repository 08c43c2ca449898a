//! Calls: potentials and flows, mathematics, what the system says, functions of the module.
use super::*;

impl Elaborator<'_> {
    pub(super) fn call(&mut self, word: Word, arguments: &[E], e: E) -> Answer<Val> {
        let name = self.word(word);
        if name.starts_with('$') {
            return self.system(word, arguments, e);
        }
        if let Some(known) = self.mathematics(name, arguments, e)? {
            return Ok(Val::Num(known));
        }
        let at = self.place(e);
        let n = match name {
            "ddt" => {
                let n = self.plain_number(arguments[0])?;
                let zero = self.g.constant(0.0);
                if self.g.value(n.id).is_some() {
                    self.constant(0.0)
                } else {
                    let made = Num { id: zero, whole: false, q: Some(n.id), noise: None };
                    // inside of a condition that voltages decide the charge goes on by itself
                    if self.path.is_empty() {
                        made
                    } else {
                        self.plain(&made)
                    }
                }
            }
            "idt" => self.integral(arguments, at)?,
            "limexp" => {
                let x = self.plain_number(arguments[0])?.id;
                // where limexp goes on as a straight line
                let (edge, one) = (self.g.constant(80.0), self.g.constant(1.0));
                let c = self.g.not_less(edge, x);
                let low = self.g.select(c, x, edge);
                let grown = self.g.call(Fun::Exp, low);
                let over = self.g.sub(x, edge);
                let line = self.g.add(one, over);
                let line = self.g.mul(grown, line);
                let id = self.g.select(c, grown, line);
                self.real(id)
            }
            "ddx" => self.partial(arguments, e)?,
            "white_noise" | "flicker_noise" => self.noise(name, arguments)?,
            "analysis" => {
                let mut any = self.whole(0.0);
                for &a in arguments {
                    let kind = self.text(a)?;
                    if let Some(symbol) = symbol_of(&kind) {
                        let id = self.g.given(symbol);
                        let one = self.g.constant(1.0);
                        let id = self.g.select(id, one, any.id);
                        any = Num { whole: true, ..self.real(id) };
                    }
                }
                any
            }
            "laplace_nd" | "laplace_np" | "laplace_zd" | "laplace_zp" => self.laplace(name, arguments, at)?,
            "absdelay" => self.late(arguments, at)?,
            "idtmod" => self.integral_within(arguments, at)?,
            "transition" => self.transition(arguments, at)?,
            "slew" => self.slew(arguments, at)?,
            "ac_stim" => self.stimulus(arguments)?,
            "last_crossing" => self.last_crossing(e)?,
            "zi_nd" | "zi_np" | "zi_zd" | "zi_zp" => self.sampled(name, arguments, at)?,
            "noise_table" | "noise_table_log" => self.noise_of_table(name, arguments, at)?,
            _ => self.access(name, arguments, e)?,
        };
        Ok(Val::Num(n))
    }

    /// The potential or flow of a branch.
    pub(super) fn access(&mut self, name: &str, arguments: &[E], e: E) -> Answer<Num> {
        let at = self.place(e);
        if self.only_parameters || self.frame.function > 0 {
            return self.stop(at, "voltages and currents cannot be read here", "pass them as arguments");
        }
        if let Expression::Port(word) = self.library.expressions[arguments[0] as usize] {
            let Some(&node) = self.scope.nodes.get(&(word, None)) else {
                return self.stop(at, format!("there is no port {}", self.word(word)), "");
            };
            let label = format!("I(<{}>)", self.word(word));
            let (k, u) = self.unknown(label);
            self.port_flows.push((node, u, k));
            return Ok(self.real(u));
        }
        let (branch, turned) = self.branch_of(arguments, at)?;
        let id = if self.is_flow(name, branch, at)? {
            self.flow_of(branch)
        } else {
            let (from, to) = (self.branches[branch].from, self.branches[branch].to);
            self.port(from, to, None)
        };
        let id = if turned { self.g.neg(id) } else { id };
        Ok(self.real(id))
    }

    /// Does the access read the flow of the branch? An error where it does not fit the discipline.
    pub fn is_flow(&self, name: &str, branch: usize, at: Place) -> Answer<bool> {
        match name {
            "potential" => return Ok(false),
            "flow" => return Ok(true),
            _ => {}
        }
        let ends = [self.branches[branch].from, self.branches[branch].to];
        let module = &self.library.modules[self.scope.module];
        let mut discipline = None;
        for end in ends.into_iter().filter(|&k| k != GROUND) {
            let word = self.scope.nodes.iter().find(|n| *n.1 == end).map(|n| n.0 .0);
            discipline = discipline.or(word.and_then(|w| module.nodes.iter().find(|n| n.name == w)?.discipline));
        }
        let Some(discipline) = discipline.and_then(|d| self.library.disciplines.iter().find(|k| k.name == d)) else {
            return Ok(matches!(name, "I" | "F" | "Tau" | "Pwr"));
        };
        let access = |nature: Option<Word>| {
            nature.and_then(|n| self.library.natures.iter().find(|k| k.name == n)?.access).map(|a| self.word(a))
        };
        let (potential, flow) = (access(discipline.potential), access(discipline.flow));
        if potential == Some(name) {
            Ok(false)
        } else if flow == Some(name) {
            Ok(true)
        } else {
            let known: Vec<String> = [potential, flow].into_iter().flatten().map(|w| format!("{w}()")).collect();
            let what = format!("{name}() does not fit the discipline {}", self.word(discipline.name));
            self.stop(at, what, format!("it has {}", known.join(" and ")))
        }
    }

    pub fn mode(&mut self, mode: Mode) -> Id {
        let known = self.modes.iter().position(|&m| m == mode);
        let k = known.unwrap_or_else(|| {
            self.modes.push(mode);
            self.modes.len() - 1
        });
        self.g.flag(k as u32)
    }

    /// d expression / d potential of a node, or d flow of a branch.
    pub(super) fn partial(&mut self, arguments: &[E], e: E) -> Answer<Num> {
        let y = self.plain_number(arguments[0])?;
        let Expression::Call(word, of) = &self.library.expressions[arguments[1] as usize] else {
            let hint = "ddx(expression, V(node))";
            return self.stop(self.place(e), "ddx takes an expression and a potential or flow", hint);
        };
        let name = self.word(*word);
        let (branch, turned) = self.branch_of(of, self.place(e))?;
        let ports: Vec<Id> = (0..self.ports.len()).map(|k| self.g.unknown(k as u32)).collect();
        let slopes = gradient(&mut self.g, y.id, &ports);
        let flow = self.is_flow(name, branch, self.place(e))?;
        let mut total = self.g.constant(0.0);
        let (from, to) = (self.branches[branch].from, self.branches[branch].to);
        let node = if turned { to } else { from };
        for (k, slope) in slopes.into_iter().enumerate() {
            let port = &self.ports[k];
            if flow {
                if Some(port.from) == self.branches[branch].flow {
                    total = self.g.add(total, slope);
                }
            } else if port.from == node {
                total = self.g.add(total, slope);
            } else if port.to == node {
                total = self.g.sub(total, slope);
            }
        }
        if flow && turned {
            total = self.g.neg(total);
        }
        Ok(self.real(total))
    }

    pub(super) fn mathematics(&mut self, name: &str, arguments: &[E], e: E) -> Answer<Option<Num>> {
        let function = match name {
            "log" | "log10" => None,
            "ln" => Some(Fun::Log),
            "sgn" | "sign" | "round" | "nint" => return Ok(None),
            _ => Fun::from_name(name),
        };
        if let Some(f) = function {
            let a = self.plain_number(arguments[0])?;
            if let Some(v) = self.g.value(a.id) {
                let wrong = match f {
                    Fun::Sqrt => v < 0.0,
                    Fun::Log => v < 0.0,
                    Fun::Asin | Fun::Acos => v.abs() > 1.0,
                    Fun::Acosh => v < 1.0,
                    Fun::Atanh => v.abs() > 1.0,
                    _ => false,
                };
                if wrong && self.path.is_empty() {
                    return self.stop(
                        self.place(e),
                        format!("{name}({v}) has no value"),
                        "check the parameters that lead to it",
                    );
                }
            }
            let id = if f == Fun::Abs { self.magnitude(a.id) } else { self.g.call(f, a.id) };
            return Ok(Some(Num { whole: a.whole && f == Fun::Abs, ..self.real(id) }));
        }
        if !matches!(name, "log" | "log10" | "min" | "max" | "pow" | "atan2" | "hypot" | "int") {
            return Ok(None);
        }
        let a = self.plain_number(arguments[0])?;
        if matches!(name, "log" | "log10") {
            let id = match self.g.value(a.id) {
                Some(v) => self.g.constant(v.log10()),
                None => {
                    let l = self.g.call(Fun::Log, a.id);
                    let c = self.g.constant(std::f64::consts::LOG10_E);
                    self.g.mul(c, l)
                }
            };
            return Ok(Some(self.real(id)));
        }
        if name == "int" {
            let id = self.truncated(a.id);
            return Ok(Some(Num { whole: true, ..self.real(id) }));
        }
        let b = self.plain_number(arguments[1])?;
        Ok(Some(match name {
            "min" | "max" => {
                let whole = a.whole && b.whole;
                let id = match (self.g.value(a.id), self.g.value(b.id)) {
                    (Some(x), Some(y)) => self.g.constant(if name == "min" { x.min(y) } else { x.max(y) }),
                    _ => {
                        let c = self.g.not_less(a.id, b.id);
                        if name == "min" {
                            self.g.select(c, b.id, a.id)
                        } else {
                            self.g.select(c, a.id, b.id)
                        }
                    }
                };
                Num { whole, ..self.real(id) }
            }
            "pow" => Num { whole: false, ..self.power(&Num { whole: false, ..a }, &b) },
            "atan2" => {
                let id = self.g.atan2(a.id, b.id);
                self.real(id)
            }
            _ => {
                let (x, y) = (self.g.mul(a.id, a.id), self.g.mul(b.id, b.id));
                let s = self.g.add(x, y);
                let id = self.g.call(Fun::Sqrt, s);
                self.real(id)
            }
        }))
    }

    pub(super) fn system(&mut self, word: Word, arguments: &[E], e: E) -> Answer<Val> {
        let name = self.word(word);
        let at = self.place(e);
        Ok(Val::Num(match name {
            "$temperature" => self.constant(self.given.temperature),
            "$vt" => match arguments.first() {
                Some(&t) => {
                    let t = self.plain_number(t)?;
                    let c = self.g.constant(VOLTS_PER_KELVIN);
                    self.times(&t, c)
                }
                None => self.constant(VOLTS_PER_KELVIN * self.given.temperature),
            },
            "$abstime" | "$realtime" => {
                let id = self.g.time();
                self.real(id)
            }
            "$mfactor" => self.constant(self.given.multiplier),
            "$hflip" | "$vflip" => self.constant(1.0),
            "$angle" | "$xposition" | "$yposition" => self.constant(0.0),
            "$simparam" => self.simulation_parameter(arguments, at)?,
            "$simparam$str" => {
                let of = self.text(arguments[0])?;
                return match of.as_str() {
                    "module" => Ok(Val::Text(self.word(self.library.modules[self.scope.module].name).into())),
                    "instance" | "path" => Ok(Val::Text(self.scope.prefix.trim_end_matches('.').into())),
                    _ => self.stop(at, format!("there is no simulation parameter {of}"), ""),
                };
            }
            "$param_given" | "$port_connected" => self.is_given(name == "$param_given", arguments[0], at)?,
            "$limit" => self.limited(arguments, at)?,
            "$rtoi" => {
                let a = self.plain_number(arguments[0])?;
                let id = self.truncated(a.id);
                Num { whole: true, ..self.real(id) }
            }
            "$itor" => Num { whole: false, ..self.number(arguments[0])? },
            "$clog2" => {
                let v = self.known(arguments[0], "this")?;
                self.whole(if v > 1.0 { v.log2().ceil() } else { 0.0 })
            }
            "$table_model" => self.table_model(arguments, at)?,
            _ if crate::random::draws(name) => self.random(name, arguments, at)?,
            _ => match self.mathematics(&name[1..], arguments, e)? {
                Some(n) => n,
                None => return self.stop(at, format!("{name} gives no value"), "it is a statement"),
            },
        }))
    }

    pub(super) fn simulation_parameter(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let of = self.text(arguments[0])?;
        Ok(match of.as_str() {
            "gmin" => {
                let id = self.gmin();
                self.real(id)
            }
            "sourceScaleFactor" => {
                let id = self.source_scale();
                self.real(id)
            }
            "tnom" => self.constant(self.given.tnom - 273.15),
            "scale" => self.constant(1.0),
            "shrink" => self.constant(0.0),
            _ => match arguments.get(1) {
                Some(&default) => self.number(default)?,
                None => {
                    let what = format!("there is no simulation parameter {of}");
                    return self.stop(at, what, "give a default: $simparam(\"name\", value)");
                }
            },
        })
    }

    /// Was a parameter given, or a port connected?
    pub(super) fn is_given(&mut self, parameter: bool, argument: E, at: Place) -> Answer<Num> {
        let given = match self.library.expressions[argument as usize] {
            Expression::Parameter(k) if parameter => self.scope.given.contains_key(&k),
            _ if parameter => return self.stop(at, "$param_given takes a parameter", "$param_given(name)"),
            Expression::Name(word, _) => {
                let module = &self.library.modules[self.scope.module];
                let Some(k) = module.nodes[..module.ports].iter().position(|n| n.name == word) else {
                    return self.stop(at, format!("{} is no port", self.word(word)), "");
                };
                self.scope.connected.get(k).copied().unwrap_or(false)
            }
            _ => return self.stop(at, "$port_connected takes a port", "$port_connected(name)"),
        };
        Ok(self.whole(f64::from(u8::from(given))))
    }

    /// A potential as Newton's limited steps leave it.
    pub(super) fn limited(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let Expression::Call(word, of) = &self.library.expressions[arguments[0] as usize] else {
            return self.stop(at, "$limit takes a potential first", "$limit(V(a, b), \"pnjlim\", vt, vcrit)");
        };
        let (branch, turned) = self.branch_of(of, at)?;
        if self.is_flow(self.word(*word), branch, at)? {
            return self.stop(at, "$limit of a flow is not supported", "limit the potential that it hangs on");
        }
        let function = match arguments.get(1).map(|&e| &self.library.expressions[e as usize]) {
            Some(Expression::Text(t)) => t.to_string(),
            // a function of the module's own: only the way to the solution would differ
            _ => return self.number(arguments[0]),
        };
        let mut numbers = Vec::new();
        for &e in arguments.iter().skip(2) {
            numbers.push(self.known(e, "an argument of $limit")?);
        }
        const LIMITS: &[(&str, usize)] = &[("pnjlim", 2), ("fetlim", 1), ("limvds", 0), ("limitlog", 1)];
        match LIMITS.iter().find(|l| l.0 == function) {
            Some(&(_, least)) if numbers.len() >= least => {}
            Some(&(_, least)) => return self.stop(at, format!("{function} takes {least} numbers"), ""),
            None => {
                let known: Vec<&str> = LIMITS.iter().map(|l| l.0).collect();
                return self.stop(
                    at,
                    format!("there is no limiting function {function}"),
                    format!("there are {}", known.join(", ")),
                );
            }
        }
        let (mut from, mut to) = (self.branches[branch].from, self.branches[branch].to);
        if turned {
            (from, to) = (to, from);
        }
        let id = self.port(from, to, Some(Limit { function, arguments: numbers }));
        Ok(self.real(id))
    }

    /// An analogue function of the module: its statements are run in a frame of its own.
    pub(super) fn function(&mut self, k: u32, arguments: &[E], e: E) -> Answer<Val> {
        let function = &self.library.modules[self.scope.module].functions[k as usize];
        let name = self.word(function.name);
        if arguments.len() != function.arguments.len() {
            let what = format!("{name} takes {} arguments, here are {}", function.arguments.len(), arguments.len());
            return self.stop(self.place(e), what, "");
        }
        if self.calls > 50 {
            return self.stop(self.place(e), format!("{name} calls itself"), "functions cannot be recursive");
        }
        let mut frame = self.new_frame(&function.variables, k as usize + 1)?;
        for (&(variable, comes, _), &e) in function.arguments.iter().zip(arguments) {
            if comes {
                let value = self.eval(e)?;
                // charges and noise do not pass through variables of functions: they would be read more than once
                let about = &function.variables[variable as usize];
                frame.values[variable as usize] = self.converted(value, about.kind, self.place(e))?;
            }
        }
        let result = function.result as usize;
        if let Val::Num(n) = &frame.values[result] {
            // a function that is not assigned gives 0
            if self.unset.contains_key(&n.id) {
                frame.values[result] = Val::Num(Num { whole: function.kind == Type::Integer, ..self.constant(0.0) });
            }
        }
        let outer = std::mem::replace(&mut self.frame, frame);
        self.calls += 1;
        let mut done = Ok(());
        for variable in 0..function.variables.len() {
            if let (Some(initial), Ok(())) = (function.variables[variable].initial, &done) {
                done = self.begin(variable as u32, Some(initial));
            }
        }
        for &s in &function.body {
            if done.is_ok() {
                done = self.execute(s);
            }
        }
        self.calls -= 1;
        let frame = std::mem::replace(&mut self.frame, outer);
        done?;
        for (&(variable, _, goes), &e) in function.arguments.iter().zip(arguments) {
            if goes {
                let value = frame.values[variable as usize].clone();
                match self.library.expressions[e as usize] {
                    Expression::Variable(k) => self.assign(k, None, value, self.place(e))?,
                    Expression::Element(k, index) => self.assign(k, Some(index), value, self.place(e))?,
                    _ => {
                        return self.stop(self.place(e), format!("{name} gives a value back here"), "write a variable")
                    }
                }
            }
        }
        Ok(frame.values[result].clone())
    }
}
