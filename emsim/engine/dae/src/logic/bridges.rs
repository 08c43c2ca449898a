//! From the equations to digital nodes: what was found by flags comes out after a delay.
use super::{delay, input, list, output, p, slope, Call, Level, Part, Spec, State, Unknown};

pub const SPECS: &[Spec] = &[Spec {
    name: "adc_bridge",
    what: "bridge from voltages to digital nodes",
    ports: &[list(input("in")), list(output("out"))],
    parameters: &[
        p("in_low", "", 0.1, f64::NEG_INFINITY, "0 up to there, undefined above"),
        p("in_high", "", 0.9, f64::NEG_INFINITY, "1 from there on"),
        delay("rise_delay", "delay of what goes up"),
        delay("fall_delay", "delay of what goes down"),
    ],
    make: |g| {
        let delays = [g.number("rise_delay"), g.number("fall_delay")];
        Ok(Box::new(Bridge { delays, last: vec![Unknown; g.widths[0]] }))
    },
}];

#[derive(Clone)]
struct Bridge {
    delays: [f64; 2],
    last: Vec<Level>,
}

impl Part for Bridge {
    fn call(&mut self, c: &mut Call) {
        for k in 0..self.last.len() {
            let Some(level) = c.levels(0).nth(k) else { continue };
            if c.rests || level != self.last[k] {
                c.post_at(1, k, State::strong(level), slope(self.last[k], level, self.delays));
            }
            self.last[k] = level;
        }
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
