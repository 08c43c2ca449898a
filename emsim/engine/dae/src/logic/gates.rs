//! Gates: and, or, exclusive or, their negations, buffer, inverter.
use super::{delay, input, list, load, output, Call, Given, Level, One, Part, Port, Spec, Unknown, Zero};

const MANY: &[Port] = &[list(input("in")), output("out")];
const SINGLE: &[Port] = &[input("in"), output("out")];
const PARAMETERS: &[super::Parameter] =
    &[delay("rise_delay", "delay of what goes up"), delay("fall_delay", "delay of what goes down"), load("input_load")];

macro_rules! gate {
    ($name:literal, $what:literal, $ports:expr, $rule:expr) => {
        Spec { name: $name, what: $what, ports: $ports, parameters: PARAMETERS, make: |g| Ok(gate(g, $rule)) }
    };
}

pub const SPECS: &[Spec] = &[
    gate!("d_and", "and gate", MANY, and),
    gate!("d_nand", "and gate, negated", MANY, |i| !and(i)),
    gate!("d_or", "or gate", MANY, or),
    gate!("d_nor", "or gate, negated", MANY, |i| !or(i)),
    gate!("d_xor", "exclusive or gate", MANY, xor),
    gate!("d_xnor", "exclusive or gate, negated", MANY, |i| !xor(i)),
    gate!("d_buffer", "buffer", SINGLE, or),
    gate!("d_inverter", "inverter", SINGLE, |i| !or(i)),
];

type Rule = fn(&mut dyn Iterator<Item = Level>) -> Level;

fn and(inputs: &mut dyn Iterator<Item = Level>) -> Level {
    inputs.fold(One, |all, one| match (all, one) {
        (Zero, _) | (_, Zero) => Zero,
        (One, One) => One,
        _ => Unknown,
    })
}

fn or(inputs: &mut dyn Iterator<Item = Level>) -> Level {
    !and(&mut inputs.map(|one| !one))
}

fn xor(inputs: &mut dyn Iterator<Item = Level>) -> Level {
    inputs.fold(Zero, |all, one| match (all, one) {
        (Unknown, _) | (_, Unknown) => Unknown,
        (a, b) => Level::is(a != b),
    })
}

#[derive(Clone)]
struct Gate {
    rule: Rule,
    delays: [f64; 2],
    last: Level,
}

fn gate(given: &Given, rule: Rule) -> Box<dyn Part> {
    let delays = [given.number("rise_delay"), given.number("fall_delay")];
    Box::new(Gate { rule, delays, last: Unknown })
}

impl Part for Gate {
    fn call(&mut self, c: &mut Call) {
        let level = (self.rule)(&mut c.levels(0));
        c.change(1, &mut self.last, level, self.delays);
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
