//! The stages of a Runge-Kutta method in one piece of code: sums of rows, four components a register, and between them the
//! program as a subroutine. What a loop over stages spends on calls, rows of unequal length and checks is several times what
//! a stage of a pendulum computes.
use super::x86::{Base, Place, Writer, DOUBLE, F2, P66, WIDE};
use super::{Move, To};

/// Registers behind those of a sum: the last one holds its coefficient.
const FACTOR: u8 = 15;
const OTHER: u8 = 14;
const FRESH: u8 = 13;

impl Writer<'_> {
    /// Rows of `width`, the state at leaf `y`, the length of the step at `h` of the table of rows; times are read in turn.
    pub fn sequence(&mut self, moves: &[Move], coefficients: &[f64], width: usize, y: usize, h: usize) -> Option<()> {
        let mut at = 0; // the row that the register of results points at
        let mut first = 0;
        let (mut calls, count) = (Vec::new(), self.count());
        self.enter();
        for step in moves {
            self.out.extend([0x48, 0xb8]); // mov rax, coefficients
            self.out.extend((coefficients.as_ptr() as u64).to_le_bytes());
            let table = |row: usize, i: usize| {
                let index = (row * width + i) as i64 - (at * width) as i64;
                Place::Memory { base: Base::Results, index: index as u32 }
            };
            let groups: Vec<usize> = (0..width).step_by(4).collect();
            // what the program has just written is added last, and read as it was written: a wide load of fresh stores
            // waits until they have left for the cache
            let newest = step.row.iter().position(|&(j, _)| j == at && at > 0 && groups.len() == 1);
            let index = h as i64 - (at * width) as i64;
            let length = Place::Memory { base: Base::Results, index: index as u32 };
            // registers of a sum; behind them are those of its coefficient
            for some in groups.chunks(12) {
                let mut begun = false;
                for (term, &(j, _)) in step.row.iter().enumerate().filter(|t| Some(t.0) != newest) {
                    self.spread_factor(Place::Memory { base: Base::Table, index: (first + term) as u32 });
                    for (sum, &i) in some.iter().enumerate() {
                        if begun {
                            self.vex(0xb8, P66 | WIDE | DOUBLE, 2, sum as u8, FACTOR, table(j, i));
                        } else {
                            self.vex(0x59, P66 | WIDE, 1, sum as u8, FACTOR, table(j, i));
                        }
                    }
                    begun = true;
                }
                self.spread_factor(length);
                for (sum, &i) in some.iter().enumerate() {
                    let sum = sum as u8;
                    match step.from {
                        Some(row) if begun => self.vex(0xa8, P66 | WIDE | DOUBLE, 2, sum, FACTOR, table(row, i)),
                        Some(row) => self.vex(0x10, P66 | WIDE, 1, sum, 0, table(row, i)),
                        None if begun => self.vex(0x59, P66 | WIDE, 1, sum, FACTOR, Place::Register(sum)),
                        None => self.vex(0x57, P66 | WIDE, 1, sum, sum, Place::Register(sum)),
                    }
                }
                if let Some(term) = newest {
                    let factor = Place::Memory { base: Base::Table, index: (first + term) as u32 };
                    self.vex(0x19, P66 | WIDE, 2, OTHER, 0, factor);
                    self.vex(0x59, P66 | WIDE, 1, FACTOR, FACTOR, Place::Register(OTHER));
                    self.fresh(count);
                    self.vex(0xb8, P66 | WIDE | DOUBLE, 2, 0, FACTOR, Place::Register(FRESH));
                }
                for (sum, &i) in some.iter().enumerate() {
                    for to in step.to {
                        let to = match *to {
                            To::State => Place::Memory { base: Base::Unknowns, index: (y + i) as u32 },
                            To::Row(row) => table(row, i),
                        };
                        self.vex(0x11, P66 | WIDE, 1, sum as u8, 0, to);
                    }
                }
            }
            first += step.row.len();
            if let Some(row) = step.run {
                self.out.extend([0xc5, 0xf8, 0x77]); // vzeroupper
                let by = 8 * (row as i32 - at as i32) * width as i32;
                self.advance(Base::Results, by);
                at = row;
                self.out.extend([0xe8, 0, 0, 0, 0]); // call the program
                calls.push(self.out.len());
                self.advance(Base::Time, 8); // the next time
            }
        }
        self.out.extend([0xc5, 0xf8, 0x77]);
        self.leave();
        self.subroutine(&calls)
    }

    /// The program, behind all that calls it: `calls` are where these calls end.
    fn subroutine(&mut self, calls: &[usize]) -> Option<()> {
        let here = self.out.len();
        for &call in calls {
            self.out[call - 4..call].copy_from_slice(&((here - call) as u32).to_le_bytes());
        }
        self.out.extend([0x48, 0x83, 0xec, 8]); // sub rsp, 8
        self.program()?;
        self.out.extend([0x48, 0x83, 0xc4, 8, 0xc3]); // add rsp, 8; ret
        self.asides();
        Some(())
    }

    /// The row that was written last, one by one, as a vector.
    fn fresh(&mut self, count: usize) {
        let at = |index: u32| Place::Memory { base: Base::Results, index };
        for (to, i) in [(FRESH, 0), (OTHER, 2)] {
            if count > i {
                self.vex(0x10, F2, 1, to, 0, at(i as u32));
            }
            if count > i + 1 {
                self.vex(0x16, P66, 1, to, to, at(i as u32 + 1)); // vmovhpd
            }
        }
        if count > 2 {
            self.vex(0x18, P66 | WIDE, 3, FRESH, FRESH, Place::Register(OTHER)); // vinsertf128
            self.out.push(1);
        }
    }

    /// One number to all lanes of the factor's register.
    fn spread_factor(&mut self, from: Place) {
        self.vex(0x19, P66 | WIDE, 2, FACTOR, 0, from); // vbroadcastsd
    }
}

#[cfg(test)]
mod tests {
    use crate::graph::{Fun, Graph, Id};
    use crate::tape::{Inputs, Move, Tape, To};

    /// Stages and sums as a loop would take them; with more groups of four than there are registers, too.
    #[test]
    fn a_sequence_is_what_a_loop_over_stages_computes() {
        for n in [1, 2, 3, 4, 7, 55] {
            let mut g = Graph::new();
            let x: Vec<Id> = (0..n as u32).map(|i| g.unknown(i)).collect();
            let t = g.time();
            let rates: Vec<Id> = (0..n)
                .map(|i| {
                    let sine = g.call(Fun::Sin, x[i]);
                    let product = g.mul(sine, x[(i + 1) % n]);
                    let square = g.powi(product, 2);
                    let sum = g.add(square, product);
                    let sum = g.sub(sum, sine);
                    let sum = g.add(sum, x[i]);
                    g.add(sum, t)
                })
                .collect();
            let tape = Tape::new(&g, &rates).native_into();
            let width = n.next_multiple_of(4);
            let from = Some(4);
            let moves = [
                Move { row: &[(0, 0.5)], from, to: &[To::State], run: Some(1) },
                Move { row: &[(0, 0.25), (1, -0.75)], from, to: &[To::State, To::Row(5)], run: Some(2) },
                Move { row: &[(1, 1.5)], from, to: &[To::State], run: Some(3) },
                Move { row: &[(0, 0.1), (2, 0.3), (3, 0.6)], from, to: &[To::Row(6)], run: None },
                Move { row: &[(0, 1.0), (2, -1.0)], from: None, to: &[To::Row(7)], run: None },
            ];
            let (h, times) = (8 * width, [0.1, 0.2, 0.7]);
            let mut table = vec![0.0; h + 4];
            (0..n).for_each(|i| (table[i], table[4 * width + i]) = ((0.3 * i as f64).cos(), 0.2 + 0.1 * i as f64));
            table[h] = 0.05;
            table[h + 1..].copy_from_slice(&times);
            let mut want = table.clone();
            let (mut x, mut slots) = (vec![0.0; width], tape.workspace());
            let mut runs = times.iter();
            for step in &moves {
                let sum: Vec<f64> = (0..width)
                    .map(|i| {
                        let sum: f64 = step.row.iter().map(|&(j, a)| a * want[j * width + i]).sum();
                        step.from.map_or(0.0, |row| want[row * width + i]) + 0.05 * sum
                    })
                    .collect();
                for to in step.to {
                    match *to {
                        To::State => x.copy_from_slice(&sum),
                        To::Row(row) => want[row * width..][..width].copy_from_slice(&sum),
                    }
                }
                if let Some(row) = step.run {
                    let inputs = Inputs { x: &x, t: *runs.next().unwrap(), waves: &[], flags: &[] };
                    tape.run_into(0, &inputs, &mut slots, &mut want[row * width..]);
                }
            }
            let Some(sequence) = tape.sequence(&moves, width, 0, h, h + 1) else { return };
            let mut again = tape.again(&mut x, &[], &[], &mut slots).expect("a program long enough");
            again.run_sequence(&sequence, &mut table);
            for (a, b) in table.iter().zip(&want) {
                assert!((a - b).abs() <= 1e-14 * b.abs().max(1.0), "{n}: {a} {b}");
            }
        }
    }
}
