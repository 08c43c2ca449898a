//! States that a table gives, at times of its own.
use super::{list, output, p, Call, Level, Part, Spec, State, Strength, Unknown};
use std::sync::Arc;

pub const SPECS: &[Spec] = &[Spec {
    name: "d_source",
    what: "source of digital states",
    ports: &[list(output("out"))],
    parameters: &[
        p(
            "input_file",
            "",
            f64::NAN,
            f64::NEG_INFINITY,
            "file of lines: time, then the state of each output (0s 1s Us 0r ...)",
        ),
        super::load("input_load"),
    ],
    make: |g| {
        let width = g.widths[0];
        let [times, states] = ["times", "states"].map(|n| g.list(n));
        let states: Vec<State> = states.iter().map(|&v| state(v)).collect();
        Ok(Box::new(Source(Arc::new((times.to_vec(), states, width)))))
    },
}];

/// 0, 1, 2 for levels, + 3 times 0 to 3 for strong, resistive, high impedance, undetermined.
pub(super) fn state(code: f64) -> State {
    let code = code as usize;
    let strengths = [Strength::Strong, Strength::Resistive, Strength::HighImpedance, Strength::Undetermined];
    State::of(Level::of((code % 3) as f64), strengths[(code / 3).min(3)])
}

#[derive(Clone)]
struct Source(Arc<(Vec<f64>, Vec<State>, usize)>);

impl Part for Source {
    /// The last states up to time 0; undefined before the first.
    fn call(&mut self, c: &mut Call) {
        let (times, states, width) = &*self.0;
        let row = times.iter().rposition(|&t| t <= 0.0);
        for k in 0..*width {
            let now = row.map_or(State::of(Unknown, Strength::Undetermined), |r| states[r * width + k]);
            c.post_at(0, k, now, 0.0);
        }
    }

    fn begin(&mut self, c: &mut Call) {
        let (times, states, width) = &*self.0;
        for (r, &t) in times.iter().enumerate().filter(|&(_, &t)| t > 0.0) {
            for k in 0..*width {
                let now = states[r * width + k];
                if r == 0 || states[(r - 1) * width + k] != now {
                    c.post_at(0, k, now, t);
                }
            }
        }
    }

    fn twin(&self) -> Box<dyn Part> {
        Box::new(self.clone())
    }
}
