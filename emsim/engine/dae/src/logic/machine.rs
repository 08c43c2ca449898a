//! A state machine by a table: at each rise of the clock, what the inputs say to the present state.
use super::source::state;
use super::{delay, input, list, load, open, output, p, Call, Level, One, Part, Spec, State, Strength, Unknown};
use std::sync::Arc;

pub const SPECS: &[Spec] = &[Spec {
    name: "d_state",
    what: "state machine",
    ports: &[open(list(input("in"))), input("clk"), open(input("reset")), list(output("out"))],
    parameters: &[
        delay("clk_delay", "delay from the clock's rise"),
        delay("reset_delay", "delay from reset"),
        p(
            "state_file",
            "",
            f64::NAN,
            f64::NEG_INFINITY,
            "file of lines: state, outputs, inputs -> next state; more lines of a state: inputs -> next state",
        ),
        p("reset_state", "", 0.0, 0.0, "state at the start and on reset"),
        load("input_load"),
        load("clk_load"),
        load("reset_load"),
    ],
    make: |g| {
        let rows = g.list("rows").chunks(2 + g.widths[0]).map(|row| Row {
            state: row[0] as usize,
            next: row[1] as usize,
            inputs: row[2..].iter().map(|&v| v as u8).collect(),
        });
        let outputs = g.list("outputs").chunks(1 + g.widths[3]);
        let outputs = outputs.map(|row| (row[0] as usize, row[1..].iter().map(|&v| state(v)).collect())).collect();
        let start = g.number("reset_state") as usize;
        Ok(Box::new(Machine {
            table: Arc::new((rows.collect(), outputs)),
            delays: ["clk_delay", "reset_delay"].map(|n| g.number(n)),
            start,
            now: start,
            known: true,
            was: [Unknown; 2],
        }))
    },
}];

struct Row {
    state: usize,
    next: usize,
    inputs: Vec<u8>, // 0, 1, 2: either
}

type Outputs = Vec<(usize, Vec<State>)>;

#[derive(Clone)]
struct Machine {
    table: Arc<(Vec<Row>, Outputs)>,
    delays: [f64; 2],
    start: usize,
    now: usize,
    known: bool,
    was: [Level; 2], // clock, reset
}

impl Machine {
    fn show(&self, c: &mut Call, delay: f64) {
        let row = self.table.1.iter().find(|(state, _)| *state == self.now);
        let Some((_, states)) = row else { return };
        for (k, &state) in states.iter().enumerate() {
            let state = if self.known { state } else { State::of(Unknown, Strength::Undetermined) };
            c.post_at(3, k, state, delay);
        }
    }
}

impl Part for Machine {
    fn call(&mut self, c: &mut Call) {
        let (clock, reset) = (c.level(1), c.level(2));
        let was = std::mem::replace(&mut self.was, [clock, reset]);
        if c.rests {
            (self.now, self.known) = (self.start, true);
            return self.show(c, 0.0);
        }
        if reset != was[1] {
            // a rise of the clock at the same time is lost, as in ngspice
            if reset == One {
                (self.now, self.known) = (self.start, true);
                self.show(c, self.delays[1]);
            }
            return;
        }
        if reset == One {
            return;
        }
        if clock == One && was[0] != One {
            let fits = |row: &&Row| {
                let agree = |(level, &want): (Level, &u8)| want > 1 || level == Level::of(f64::from(want));
                row.state == self.now && c.levels(0).zip(&row.inputs).all(agree)
            };
            match self.table.0.iter().find(fits) {
                Some(row) => (self.now, self.known) = (row.next, true),
                None => self.known = false,
            }
            self.show(c, self.delays[0]);
        }
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
