//! Any function of several inputs, or several of them, by their table.
use super::{
    delay, input, list, load, output, p, slope, Call, HighImpedance, Level, Part, Spec, State, Undetermined, Unknown,
    Zero,
};

pub const SPECS: &[Spec] = &[D_LUT, D_GENLUT];

const D_LUT: Spec = Spec {
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
};

#[derive(Clone)]
struct Lut {
    table: Vec<Level>,
    delays: [f64; 2],
    last: Level,
}

impl Part for Lut {
    fn call(&mut self, c: &mut Call) {
        let level = place(c).map_or(Unknown, |k| self.table[k]);
        c.change(1, &mut self.last, level, self.delays);
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}

/// The number that the inputs make; none where one is undefined.
fn place(c: &Call) -> Option<usize> {
    c.levels(0).enumerate().try_fold(0, |sum, (k, level)| match level {
        Unknown => None,
        Zero => Some(sum),
        _ => Some(sum | 1 << k),
    })
}

const D_GENLUT: Spec = Spec {
    name: "d_genlut",
    what: "several functions by a table",
    ports: &[list(input("in")), list(output("out"))],
    parameters: &[],
    make: |g| {
        let (inputs, outputs) = (g.widths[0], g.widths[1]);
        let entries = 1_usize << inputs.min(24);
        if inputs > 24 {
            return Err(format!("{inputs} inputs are too many, 24 are the most"));
        }
        let mut table: Vec<State> = g
            .list("table")
            .iter()
            .take(entries * outputs)
            .map(|&v| match v {
                2.0 => State::of(Unknown, HighImpedance),
                3.0 => State::of(Unknown, Undetermined),
                _ => State::strong(Level::of(v)),
            })
            .collect();
        table.resize(entries * outputs, State::of(Unknown, Undetermined));
        // the last one given is that of all further ones
        let each = |name: &str, n: usize, default: f64, least: f64| -> Vec<f64> {
            let given = g.list(name);
            (0..n).map(|k| given.get(k).or(given.last()).map_or(default, |v| v.max(least))).collect()
        };
        let (rise, fall) = (each("rise_delay", outputs, 1e-9, 1e-12), each("fall_delay", outputs, 1e-9, 1e-12));
        Ok(Box::new(General {
            table,
            delays: rise.into_iter().zip(fall).map(|(r, f)| [r, f]).collect(),
            before: each("input_delay", inputs, 0.0, 0.0),
            inputs: vec![Unknown; inputs],
            last: vec![State::of(Unknown, Undetermined); outputs],
        }))
    },
};

#[derive(Clone)]
struct General {
    table: Vec<State>,
    delays: Vec<[f64; 2]>,
    before: Vec<f64>,
    inputs: Vec<Level>,
    last: Vec<State>,
}

impl Part for General {
    fn call(&mut self, c: &mut Call) {
        let now: Vec<Level> = c.levels(0).collect();
        let changed = (0..now.len()).filter(|&k| now[k] != self.inputs[k]);
        let before = changed.map(|k| self.before[k]).fold(0.0, f64::max);
        let (place, entries) = (place(c), 1 << now.len());
        self.inputs = now;
        for k in 0..self.last.len() {
            let state = place.map_or(State::of(Unknown, Undetermined), |j| self.table[j + k * entries]);
            if c.rests || state != self.last[k] {
                c.post_at(1, k, state, before + slope(self.last[k].level, state.level, self.delays[k]));
            }
            self.last[k] = state;
        }
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
