//! Flip-flops, which take their inputs over where the clock rises: D, JK, T, SR.
use super::latches::{forced, forced_at_rest, Pair};
use super::{delay, input, load, open, output, p, Call, Given, Level, One, Parameter, Part, Spec, Unknown, Zero};

/// Clock, asynchronous inputs and outputs, as all of them have them behind their own inputs.
macro_rules! ports {
    ($($own:literal),*) => {
        &[$(input($own),)* input("clk"), open(input("set")), open(input("reset")), open(output("out")), open(output("Nout"))]
    };
}

macro_rules! flipflop {
    ($name:literal, $what:literal, [$($own:literal),*], [$($load:literal),*], $rule:expr) => {
        Spec {
            name: $name,
            what: $what,
            ports: ports!($($own),*),
            parameters: &[CLK, SET, RESET, IC, RISE, FALL, $(load($load),)* load("clk_load"), load("set_load"), load("reset_load")],
            make: |g| Ok(flipflop(g, $rule)),
        }
    };
}

const CLK: Parameter = delay("clk_delay", "delay from the clock's rise");
pub(super) const SET: Parameter = delay("set_delay", "delay from set");
pub(super) const RESET: Parameter = delay("reset_delay", "delay from reset");
pub(super) const IC: Parameter = p("ic", "", 0.0, 0.0, "level at the start: 0, 1, 2 for undefined");
pub(super) const RISE: Parameter = delay("rise_delay", "delay of what goes up, beside the others");
pub(super) const FALL: Parameter = delay("fall_delay", "delay of what goes down, beside the others");

pub const SPECS: &[Spec] = &[
    flipflop!("d_dff", "D flip-flop", ["data"], ["data_load"], |i, _| i[0]),
    flipflop!("d_jkff", "JK flip-flop", ["j", "k"], ["jk_load"], |i, now| match (i[0], i[1]) {
        (Zero, Zero) => now,
        (Zero, One) => Zero,
        (One, Zero) => One,
        (One, One) => !now,
        _ => Unknown,
    }),
    flipflop!("d_tff", "toggle flip-flop", ["t"], ["t_load"], |i, now| match i[0] {
        Zero => now,
        One => !now,
        Unknown => Unknown,
    }),
    flipflop!("d_srff", "set-reset flip-flop", ["s", "r"], ["sr_load"], |i, now| match (i[0], i[1]) {
        (Zero, Zero) => now,
        (Zero, One) => Zero,
        (One, Zero) => One,
        _ => Unknown,
    }),
];

/// The level behind a rise of the clock, from the inputs and the present one.
type Rule = fn(&[Level], Level) -> Level;

#[derive(Clone)]
struct FlipFlop {
    rule: Rule,
    own: usize,       // inputs before the clock
    delays: [f64; 3], // from clock, set, reset
    out: Pair,
    ic: Level,
    was: [Level; 3], // clock, set, reset
}

fn flipflop(given: &Given, rule: Rule) -> Box<dyn Part> {
    let own = given.spec.ports.len() - 5;
    Box::new(FlipFlop {
        rule,
        own,
        delays: ["clk_delay", "set_delay", "reset_delay"].map(|name| given.number(name)),
        out: Pair::new(given, own + 3),
        ic: given.level("ic"),
        was: [Unknown; 3],
    })
}

impl Part for FlipFlop {
    fn call(&mut self, c: &mut Call) {
        let own = self.own;
        let [clock, set, reset] = [0, 1, 2].map(|k| c.level(own + k));
        let was = std::mem::replace(&mut self.was, [clock, set, reset]);
        if c.rests {
            return self.out.start(c, forced_at_rest(set, reset).unwrap_or(self.ic));
        }
        if set != was[1] || reset != was[2] {
            // a rise of the clock at the same time is lost, as in ngspice
            let by = if set != was[1] { 1 } else { 2 };
            return self.out.set(c, forced(set, reset).unwrap_or(self.out.level), self.delays[by]);
        }
        if clock == One && was[0] != One && forced(set, reset).is_none() {
            let inputs: Vec<Level> = (0..own).map(|k| c.level(k)).collect();
            let level = (self.rule)(&inputs, self.out.level);
            self.out.set(c, level, self.delays[0]);
        }
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
