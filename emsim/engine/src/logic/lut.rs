//! Any function of several inputs, by its table.
use super::{delay, input, list, load, output, p, slope, Call, Level, Part, Spec, State, Unknown, Zero};

pub const SPECS: &[Spec] = &[Spec {
    name: "d_lut",
    what: "function by a table",
    ports: &[list(input("in")), output("out")],
    parameters: &[
        delay("rise_delay", "delay of what goes up"),
        delay("fall_delay", "delay of what goes down"),
        load("input_load"),
        p(
            "table_values",
            "",
            f64::NAN,
            f64::NEG_INFINITY,
            "0 or 1 for each of the inputs' values; the first input counts 1, the second 2",
        ),
    ],
    make: |g| {
        let (table, inputs) = (g.list("table"), g.widths[0]);
        if table.len() != 1 << inputs.min(30) {
            return Err(format!(
                "table_values has {} entries, {inputs} inputs want {}",
                table.len(),
                1_u64 << inputs.min(30)
            ));
        }
        let delays = [g.number("rise_delay"), g.number("fall_delay")];
        Ok(Box::new(Lut { table: table.iter().map(|&v| Level::of(v)).collect(), delays, last: Unknown }))
    },
}];

#[derive(Clone)]
struct Lut {
    table: Vec<Level>,
    delays: [f64; 2],
    last: Level,
}

impl Part for Lut {
    fn call(&mut self, c: &mut Call) {
        let place = c.levels(0).enumerate().try_fold(0, |sum, (k, level)| match level {
            Unknown => None,
            Zero => Some(sum),
            _ => Some(sum | 1 << k),
        });
        let level = place.map_or(Unknown, |k: usize| self.table[k]);
        if c.rests || level != self.last {
            c.post(1, State::strong(level), slope(self.last, level, self.delays));
        }
        self.last = level;
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
