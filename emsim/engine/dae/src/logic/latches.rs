//! Latches, which follow their inputs while they are enabled; and what they share with flip-flops.
use super::flipflops::{FALL, IC, RESET, RISE, SET};
use super::{delay, input, load, open, output, slope, Call, Given, Level, One, Part, Spec, State, Unknown, Zero};

macro_rules! latch {
    ($name:literal, $what:literal, [$($own:literal),*], $delay:expr, [$($load:literal),*], $rule:expr) => {
        Spec {
            name: $name,
            what: $what,
            ports: &[
                $(input($own),)* input("enable"), open(input("set")), open(input("reset")), open(output("out")), open(output("Nout")),
            ],
            parameters: &[
                $delay, delay("enable_delay", "delay from enable"), SET, RESET, IC, RISE, FALL,
                $(load($load),)* load("enable_load"), load("set_load"), load("reset_load"),
            ],
            make: |g| Ok(latch(g, $rule)),
        }
    };
}

pub const SPECS: &[Spec] = &[
    latch!("d_dlatch", "D latch", ["data"], delay("data_delay", "delay from the data"), ["data_load"], |i, _| i[0]),
    latch!(
        "d_srlatch",
        "set-reset latch",
        ["s", "r"],
        delay("sr_delay", "delay from s and r"),
        ["sr_load"],
        |i, now| {
            match (i[0], i[1]) {
                (Zero, Zero) => now,
                (Zero, One) => Zero,
                (One, Zero) => One,
                _ => Unknown,
            }
        }
    ),
];

/// What set and reset make of the output, whatever else there is: where they are undefined they have no say.
pub(super) fn forced(set: Level, reset: Level) -> Option<Level> {
    match (set == One, reset == One) {
        (false, false) => None,
        (true, false) => Some(One),
        (false, true) => Some(Zero),
        (true, true) => Some(Unknown),
    }
}

/// The same at rest, where they have one only if both are known.
pub(super) fn forced_at_rest(set: Level, reset: Level) -> Option<Level> {
    forced(set, reset).filter(|_| set != Unknown && reset != Unknown)
}

/// An output and its negation.
#[derive(Clone)]
pub(super) struct Pair {
    pub level: Level,
    port: usize,
    slopes: [f64; 2],
}

impl Pair {
    /// `port`: of the output; the next one is its negation.
    pub fn new(given: &Given, port: usize) -> Pair {
        Pair { level: Unknown, port, slopes: [given.number("rise_delay"), given.number("fall_delay")] }
    }

    pub fn start(&mut self, c: &mut Call, level: Level) {
        self.level = level;
        c.post(self.port, State::strong(level), 0.0);
        c.post(self.port + 1, State::strong(!level), 0.0);
    }

    /// Both after a delay and that of their slopes.
    pub fn set(&mut self, c: &mut Call, level: Level, delay: f64) {
        let was = std::mem::replace(&mut self.level, level);
        if level != was {
            c.post(self.port, State::strong(level), delay + slope(was, level, self.slopes));
            c.post(self.port + 1, State::strong(!level), delay + slope(!was, !level, self.slopes));
        }
    }
}

#[derive(Clone)]
struct Latch {
    rule: fn(&[Level], Level) -> Level,
    own: usize,
    delays: [f64; 4], // from the inputs, enable, set, reset
    out: Pair,
    ic: Level,
    was: Vec<Level>, // inputs, enable, set, reset
}

fn latch(given: &Given, rule: fn(&[Level], Level) -> Level) -> Box<dyn Part> {
    let own = given.spec.ports.len() - 5;
    let first = given.spec.parameters[0].name;
    Box::new(Latch {
        rule,
        own,
        delays: [first, "enable_delay", "set_delay", "reset_delay"].map(|name| given.number(name)),
        out: Pair::new(given, own + 3),
        ic: given.level("ic"),
        was: vec![Unknown; own + 3],
    })
}

impl Part for Latch {
    fn call(&mut self, c: &mut Call) {
        let own = self.own;
        let now: Vec<Level> = (0..own + 3).map(|k| c.level(k)).collect();
        let was = std::mem::replace(&mut self.was, now.clone());
        let [enable, set, reset] = [now[own], now[own + 1], now[own + 2]];
        let level = forced(set, reset).unwrap_or_else(|| match enable {
            One => (self.rule)(&now[..own], self.out.level),
            _ => self.out.level,
        });
        if c.rests {
            let level = forced_at_rest(set, reset).unwrap_or(if enable == One { level } else { self.ic });
            return self.out.start(c, level);
        }
        let by = [2, 3, 1].into_iter().find(|&k| now[own + k - 1] != was[own + k - 1]).unwrap_or(0);
        self.out.set(c, level, self.delays[by]);
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
