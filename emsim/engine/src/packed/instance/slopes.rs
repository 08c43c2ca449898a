//! Directional derivatives of rates and outputs by states and inputs, from the Jacobian of the equations at a point.
//!
//! With the rows S that keep a state, the others A, and the sums of rows whose charges cancel in place of one of these,
//!
//! ```text
//!     C_S dx + dQ_S/du du = dy,    G_A dx + dF_A/du du = 0,    df = -(G_S dx + dF_S/du du),    dz = dz/dx dx + dz/du du
//! ```
use super::Instance;
use crate::smallsignal::{Gradients, Slopes};
use crate::sparse::{Lu, Pattern, Symbolic};
use crate::system::System;

/// Derivatives of outputs and of what reads inputs, in symbols.
pub(super) struct Tapes {
    outputs: Gradients,
    rows: [(Vec<usize>, Gradients); 2], // of F and of Q
}

/// A direction: by state, by wave.
struct Direction {
    states: Vec<f64>,
    waves: Vec<(usize, f64)>,
}

/// Every row's slopes by inputs along a direction, of F and of Q.
type ByInputs = [Vec<f64>; 2];

impl Instance {
    /// `sensitivity` <- d unknowns / d knowns along `seed`: unknowns are rates and outputs, knowns states and inputs, by value reference.
    pub fn directional(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), String> {
        if !self.packed.exchange.as_ref().is_some_and(|e| e.slopes) || !self.by_others {
            return Err("this model has no directional derivatives".into());
        }
        if knowns.len() != seed.len() || unknowns.len() != sensitivity.len() {
            return Err("directional derivatives take one number for each variable".into());
        }
        self.begun()?;
        let direction = self.direction(knowns, seed)?;
        let places: Vec<usize> = unknowns.iter().map(|&u| self.asked(u)).collect::<Result<_, _>>()?;
        if self.slopes.is_none() {
            self.slopes = Some(self.tapes());
        }
        let (x, t) = self.evaluated(|e| e.unknowns().map(|(x, t)| (x.to_vec(), t)))?;
        let (dx, by_inputs, outputs) = self.moved(&x, t, &direction)?;
        let (sys, count) = (&self.system, self.packed.outputs.len());
        let reduced = sys.reduced()?;
        let exchange = self.exchange.as_mut().ok_or("the model was not initialised")?;
        let w = exchange.work();
        for (out, place) in sensitivity.iter_mut().zip(places) {
            *out = match outputs.get(place) {
                Some(slopes) => along(slopes, &dx, &direction.waves),
                None => {
                    let row = reduced.states[place - count - reduced.states.len()];
                    -(0..sys.n).fold(by_inputs[0][row], |sum, col| {
                        sum + sys.pattern.position(row, col).map_or(0.0, |k| w.gv[k] * dx[col])
                    })
                }
            };
        }
        Ok(())
    }

    /// Along which states and inputs.
    fn direction(&self, knowns: &[u32], seed: &[f64]) -> Result<Direction, String> {
        let (inputs, outputs, states) = (self.packed.inputs.len(), self.packed.outputs.len(), self.states());
        let mut found = Direction { states: vec![0.0; states], waves: Vec::new() };
        for (&known, &v) in knowns.iter().zip(seed) {
            let k = (known as usize).wrapping_sub(1);
            match k.checked_sub(inputs + outputs) {
                _ if k < inputs => found.waves.push((self.packed.inputs[k].wave, v)),
                Some(s) if s < states => found.states[s] += v,
                _ => {
                    return Err(format!("the value reference {known} is no state and no input: it is known by nothing"))
                }
            }
        }
        Ok(found)
    }

    /// The number behind the inputs of an output or a rate.
    fn asked(&self, unknown: u32) -> Result<usize, String> {
        let (outputs, states) = (self.packed.outputs.len(), self.states());
        let k = (unknown as usize).wrapping_sub(1 + self.packed.inputs.len());
        let is_rate = (outputs + states..outputs + 2 * states).contains(&k);
        let why = || format!("the value reference {unknown} is no output and no derivative of a state");
        (k < outputs || is_rate).then_some(k).ok_or_else(why)
    }

    fn tapes(&mut self) -> Tapes {
        let outputs: Vec<_> = self.packed.outputs.iter().map(|o| o.id).collect();
        let rows = [0, 1].map(|which| {
            let (rows, ids): (Vec<usize>, Vec<_>) = self.system.expression_ids(which).iter().copied().unzip();
            (rows, Gradients::new(&mut self.graph, &ids))
        });
        Tapes { outputs: Gradients::new(&mut self.graph, &outputs), rows }
    }

    /// What unknowns change by, what the rows of F and Q do by inputs alone, and the slopes of outputs.
    fn moved(&mut self, x: &[f64], t: f64, d: &Direction) -> Result<(Vec<f64>, ByInputs, Vec<Slopes>), String> {
        let sys = self.system.clone();
        let reduced = sys.reduced()?;
        let tapes = self.slopes.as_ref().ok_or("no slopes")?;
        let w = self.exchange.as_mut().ok_or("the model was not initialised")?.work();
        sys.eval_jacobian(w, x, t, false);
        let mut by_inputs = [vec![0.0; sys.n], vec![0.0; sys.n]];
        for &(row, wave, v) in sys.source_rows() {
            d.waves.iter().filter(|s| s.0 == wave).for_each(|s| by_inputs[0][row] += v * s.1);
        }
        for (sums, (rows, gradients)) in by_inputs.iter_mut().zip(&tapes.rows) {
            for (&row, slopes) in rows.iter().zip(gradients.at_time(&sys, w, x, t)) {
                sums[row] += along(&slopes, &[], &d.waves);
            }
        }
        let outputs = tapes.outputs.at_time(&sys, w, x, t);
        let mut of: Vec<Option<usize>> = vec![None; sys.n];
        reduced.states.iter().enumerate().for_each(|(s, &row)| of[row] = Some(s));
        let mut dx: Vec<f64> = (0..sys.n)
            .map(|row| match of[row] {
                Some(s) => d.states[s] - by_inputs[1][row],
                None => -rows_of(&reduced.sums, row).iter().map(|&r| by_inputs[0][r]).sum::<f64>(),
            })
            .collect();
        let (pattern, values) = matrix(&sys, &of, &reduced.sums, w);
        let why = |_| "nothing determines the unknowns here: there are no directional derivatives".to_string();
        let mut lu: Lu<f64> = Lu::new(&Symbolic::analyse(&pattern).map_err(why)?);
        lu.factor(&values).map_err(why)?;
        lu.solve(&mut dx);
        Ok((dx, by_inputs, outputs))
    }
}

/// Rows whose sum stands in a row: itself, or those of a floating group.
fn rows_of(sums: &[(usize, Vec<usize>)], row: usize) -> Vec<usize> {
    sums.iter().find(|s| s.0 == row).map_or_else(|| vec![row], |s| s.1.clone())
}

/// C in the rows of states, G in the others.
fn matrix(
    sys: &System,
    of: &[Option<usize>],
    sums: &[(usize, Vec<usize>)],
    w: &crate::system::Work,
) -> (Pattern, Vec<f64>) {
    let mut into: Vec<Vec<usize>> = (0..sys.n).map(|r| vec![r]).collect();
    for (last, rows) in sums {
        into[*last].clear();
        rows.iter().for_each(|&r| into[r].push(*last));
    }
    let mut entries: Vec<(usize, usize, f64)> = Vec::new();
    for col in 0..sys.n {
        for k in sys.pattern.colptr[col]..sys.pattern.colptr[col + 1] {
            for &row in &into[sys.pattern.rowidx[k]] {
                let v = if of[row].is_some() { w.cv[k] } else { w.gv[k] };
                entries.push((row, col, v));
            }
        }
    }
    let places: Vec<(usize, usize)> = entries.iter().filter(|e| e.2 != 0.0).map(|e| (e.0, e.1)).collect();
    let pattern = Pattern::from_entries(sys.n, &places);
    let mut values = vec![0.0; pattern.nnz()];
    for (row, col, v) in entries.into_iter().filter(|e| e.2 != 0.0) {
        if let Some(at) = pattern.position(row, col) {
            values[at] += v;
        }
    }
    (pattern, values)
}

/// de/dx dx + de/du du; without dx, by inputs alone.
fn along(slopes: &Slopes, dx: &[f64], waves: &[(usize, f64)]) -> f64 {
    let by_x: f64 = slopes.unknowns.iter().filter_map(|&(i, d)| Some(d * dx.get(i)?)).sum();
    let by_u: f64 =
        slopes.waves.iter().flat_map(|&(k, d)| waves.iter().filter(move |s| s.0 == k).map(move |s| d * s.1)).sum();
    by_x + by_u
}
