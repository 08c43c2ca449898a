//! Outputs that are not always strong: three-state buffers, open collectors and emitters, resistors to 0 and 1.
use super::{delay, input, load, output, slope, Call, Level, One, Part, Spec, State, Strength, Unknown, Zero};
use super::{HighImpedance, Resistive, Strong, Undetermined};

macro_rules! held {
    ($name:literal, $what:literal, $level:expr) => {
        Spec {
            name: $name,
            what: $what,
            ports: &[output("out")],
            parameters: &[load("load")],
            make: |_| Ok(Box::new(Held($level))),
        }
    };
}

pub const SPECS: &[Spec] = &[
    Spec {
        name: "d_tristate",
        what: "three-state buffer",
        ports: &[input("in"), input("enable"), output("out")],
        parameters: &[delay("delay", "delay"), load("input_load"), load("enable_load")],
        make: |g| Ok(Box::new(Tristate { delay: g.number("delay"), last: State::default() })),
    },
    Spec {
        name: "d_open_c",
        what: "buffer with an open collector",
        ports: &[input("in"), output("out")],
        parameters: &[
            delay("open_delay", "delay of opening"),
            delay("fall_delay", "delay of going down"),
            load("input_load"),
        ],
        make: |g| {
            Ok(Box::new(Open { held: Zero, delays: ["open_delay", "fall_delay"].map(|n| g.number(n)), last: Unknown }))
        },
    },
    Spec {
        name: "d_open_e",
        what: "buffer with an open emitter",
        ports: &[input("in"), output("out")],
        parameters: &[
            delay("rise_delay", "delay of going up"),
            delay("open_delay", "delay of opening"),
            load("input_load"),
        ],
        make: |g| {
            Ok(Box::new(Open { held: One, delays: ["rise_delay", "open_delay"].map(|n| g.number(n)), last: Unknown }))
        },
    },
    held!("d_pullup", "resistor to 1", One),
    held!("d_pulldown", "resistor to 0", Zero),
];

#[derive(Clone)]
struct Tristate {
    delay: f64,
    last: State,
}

/// How strong is an output that is enabled so?
pub(super) fn enabled(by: Level) -> Strength {
    match by {
        One => Strong,
        Zero => HighImpedance,
        Unknown => Undetermined,
    }
}

impl Part for Tristate {
    fn call(&mut self, c: &mut Call) {
        let state = State::of(c.level(0), enabled(c.level(1)));
        if c.rests || state != self.last {
            c.post(2, state, self.delay);
        }
        self.last = state;
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}

/// Strong at one level, open at the other.
#[derive(Clone)]
struct Open {
    held: Level,
    delays: [f64; 2],
    last: Level,
}

impl Part for Open {
    fn call(&mut self, c: &mut Call) {
        let level = c.level(0);
        let strength = match level {
            Unknown => Undetermined,
            l if l == self.held => Strong,
            _ => HighImpedance,
        };
        if c.rests || level != self.last {
            c.post(1, State::of(level, strength), slope(self.last, level, self.delays));
        }
        self.last = level;
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}

#[derive(Clone)]
struct Held(Level);

impl Part for Held {
    fn call(&mut self, c: &mut Call) {
        c.post(0, State::of(self.0, Resistive), 0.0);
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
