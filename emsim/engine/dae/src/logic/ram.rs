//! Memory: words of bits, by address.
use super::{delay, input, list, load, output, p, Call, Level, One, Part, Spec, State, Strength, Unknown, Zero};

const READ: super::Parameter =
    super::Parameter { default: 100e-9, ..delay("read_delay", "delay from address, select and write_en") };
/// So many lines of address at most.
const LINES: usize = 20;

pub const SPECS: &[Spec] = &[Spec {
    name: "d_ram",
    what: "memory",
    ports: &[
        list(input("data_in")),
        list(output("data_out")),
        list(input("address")),
        input("write_en"),
        list(input("select")),
    ],
    parameters: &[
        p("select_value", "", 1.0, 0.0, "the select lines, as a number, that choose it"),
        p("ic", "", 2.0, 0.0, "every bit at the start: 0, 1, 2 for undefined"),
        READ,
        load("data_load"),
        load("address_load"),
        load("select_load"),
        load("enable_load"),
    ],
    make: |g| {
        let (width, lines) = (g.widths[0], g.widths[2]);
        if width != g.widths[1] {
            return Err(format!("{width} lines of data_in and {} of data_out", g.widths[1]));
        }
        if lines > LINES {
            return Err(format!("{lines} lines of address, at most {LINES} are possible"));
        }
        Ok(Box::new(Ram {
            width,
            value: g.number("select_value") as u64,
            ic: g.level("ic"),
            delay: g.number("read_delay"),
            bits: vec![g.level("ic"); width << lines],
            last: vec![State::default(); width],
        }))
    },
}];

#[derive(Clone)]
struct Ram {
    width: usize,
    value: u64,
    ic: Level,
    delay: f64,
    bits: Vec<Level>,
    last: Vec<State>,
}

/// Lines as a number, the first one is the highest bit; None where one is undefined.
fn number(mut lines: impl Iterator<Item = Level>) -> Option<u64> {
    lines.try_fold(0, |sum, line| match line {
        Zero => Some(2 * sum),
        One => Some(2 * sum + 1),
        Unknown => None,
    })
}

impl Part for Ram {
    fn call(&mut self, c: &mut Call) {
        if c.rests {
            self.bits.fill(self.ic);
        }
        let (address, selected) = (number(c.levels(2)), number(c.levels(4)).map(|n| n == self.value));
        let write = c.level(3);
        let open = vec![State::of(Unknown, Strength::HighImpedance); self.width];
        let out: Vec<State> = match (selected, write, address) {
            (Some(true), One, Some(a)) => {
                let data: Vec<Level> = c.levels(0).collect();
                self.bits[a as usize * self.width..][..self.width].copy_from_slice(&data);
                data.into_iter().map(|l| State::of(l, Strength::HighImpedance)).collect()
            }
            (Some(true), One, None) => {
                self.bits.fill(Unknown);
                open
            }
            (Some(true), _, Some(a)) => {
                let word = &self.bits[a as usize * self.width..][..self.width];
                word.iter().map(|&l| State::strong(l)).collect()
            }
            (Some(true), _, None) => vec![State::strong(Unknown); self.width],
            _ => open,
        };
        for (k, &state) in out.iter().enumerate() {
            if c.rests || state != self.last[k] {
                c.post_at(1, k, state, self.delay);
            }
        }
        self.last = out;
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
