//! What is added up in the results of a program, in magnitude: they are known to the rounding of that, and no better.
use super::{Inputs, Op, Tape};

impl Tape {
    /// Of every result the sum of the magnitudes of its terms, before they cancel; operation by operation what `conditions::size`
    /// makes of an expression.
    pub fn sizes(&self, inp: &Inputs) -> Vec<f64> {
        let (first, slots) = (self.constants.len(), self.constants.len() + self.code.len());
        let mut values = self.constants.clone();
        values.resize(slots, 0.0);
        self.run_code(0, self.code.len(), inp, &mut values);
        let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
        for (k, i) in self.code.iter().enumerate() {
            let of = |slot: u32| sizes[slot as usize];
            let value = |slot: u32| values[slot as usize];
            sizes[first + k] = match i.op {
                Op::Neg => of(i.a),
                Op::Add | Op::Sub => of(i.a) + of(i.b),
                Op::Mul => of(i.a) * of(i.b),
                Op::Div => of(i.a) / value(i.b).abs(),
                Op::Select => of(if value(i.a) != 0.0 { i.b } else { i.c }),
                _ => continue,
            };
        }
        self.outputs.iter().map(|&slot| sizes[slot as usize]).collect()
    }
}
