//! Frequency divider: counts rises of its input.
use super::{delay, input, load, output, p, Call, Level, One, Part, Spec, Unknown};

pub const SPECS: &[Spec] = &[Spec {
    name: "d_fdiv",
    what: "frequency divider",
    ports: &[input("freq_in"), output("freq_out")],
    parameters: &[
        p("div_factor", "", 2.0, 1.0, "so many periods of the input make one of the output"),
        p("high_cycles", "", 1.0, 1.0, "the output is high for so many of them"),
        p("i_count", "", 0.0, 0.0, "count at the start"),
        delay("rise_delay", "delay of what goes up"),
        delay("fall_delay", "delay of what goes down"),
        load("freq_in_load"),
    ],
    make: |g| {
        let delays = [g.number("rise_delay"), g.number("fall_delay")];
        let [factor, high, count] = ["div_factor", "high_cycles", "i_count"].map(|n| g.number(n) as u64);
        Ok(Box::new(Divider { factor, high, start: count, count, delays, was: Unknown, last: Unknown }))
    },
}];

#[derive(Clone)]
struct Divider {
    factor: u64,
    high: u64,
    start: u64,
    count: u64,
    delays: [f64; 2],
    was: Level,
    last: Level,
}

impl Part for Divider {
    fn call(&mut self, c: &mut Call) {
        let input = c.level(0);
        let was = std::mem::replace(&mut self.was, input);
        if c.rests {
            self.count = self.start;
        } else if input == One && was != One {
            self.count += 1;
            if self.count > self.factor {
                self.count = 1;
            }
        } else {
            return;
        }
        let level = Level::is(self.count > 0 && self.count <= self.high);
        c.change(1, &mut self.last, level, self.delays);
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
