//! The equations linearised about a point x0, for small signals of frequency s = j w:
//!
//! ```text
//!     (G + s C) X = b,    G = dF/dx, C = dQ/dx at x0,    b = -dF/du U - s dQ/du U                     (1)
//! ```
//!
//! with U the complex amplitudes of the sources u. Circuit and machine are one matrix. What an expression e(x, u) comes to is
//! de/dx X + de/du U. The transposed solution a = (G + s C)^-T de/dx gives the same as a . b for any number of b at the price of
//! one: noise, sensitivities.
use crate::derive::gradient;
use crate::graph::{Graph, Id, Node};
use crate::model::{Law, Response};
use crate::sparse::{Complex, Lu, Pattern, Scalar, Singular, Symbolic};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};

pub struct SmallSignal {
    pattern: Pattern,
    g: Vec<f64>, // on the pattern
    c: Vec<f64>,
    held: Vec<bool>,                   // this unknown stays where it is
    delayed: Vec<(usize, f64)>,        // places in G, and by how long what they read is late
    responses: Vec<(usize, Response)>, // places in G, and the gains that stand there
    lu: Lu<Complex>,
    matrix: Vec<Complex>,
    s: Option<Complex>,  // what was factored last
    chosen: Option<f64>, // size of s where its pivots were chosen
}

impl SmallSignal {
    /// About (x, 0), with conditions and sources as they are in `w`. `hold`: the machine does not move.
    pub fn at(sys: &System, w: &mut Work, x: &[f64], hold: bool) -> Result<SmallSignal, Singular> {
        let legs = sys.flags.iter().zip(&mut w.flags).filter(|(spec, _)| spec.law == Law::Leg);
        legs.for_each(|(_, flag)| *flag = 0.0);
        sys.eval_jacobian(w, x, 0.0, false);
        let held: Vec<bool> = sys.unknowns.iter().map(|u| hold && u.kind.mechanical()).collect();
        let own = (0..sys.n).flat_map(|c| sys.pattern.column(c).iter().map(move |&r| (r, c)));
        let diagonal = (0..sys.n).filter(|&i| held[i]).map(|i| (i, i));
        let answering = sys.responses.iter().map(|r| (r.row, r.col));
        let pattern = Pattern::from_entries(sys.n, &own.chain(diagonal).chain(answering).collect::<Vec<_>>());
        let (mut g, mut c) = (vec![0.0; pattern.nnz()], vec![0.0; pattern.nnz()]);
        for col in 0..sys.n {
            for k in sys.pattern.colptr[col]..sys.pattern.colptr[col + 1] {
                let row = sys.pattern.rowidx[k];
                if let (Some(at), false) = (pattern.position(row, col), held[row]) {
                    (g[at], c[at]) = (w.gv[k], w.cv[k]);
                }
            }
        }
        for i in (0..sys.n).filter(|&i| held[i]) {
            if let Some(at) = pattern.position(i, i) {
                g[at] = 1.0;
            }
        }
        let mut delayed = Vec::new();
        for d in &sys.delays.list {
            let others = (0..sys.n).filter(|&col| col != d.row);
            delayed.extend(others.filter_map(|col| Some((pattern.position(d.row, col)?, d.by))));
        }
        let responses =
            sys.responses.iter().filter_map(|r| Some((pattern.position(r.row, r.col)?, r.clone()))).collect();
        let lu = Lu::new(&Symbolic::analyse(&pattern)?);
        let matrix = vec![Complex::ZERO; pattern.nnz()];
        Ok(SmallSignal { pattern, g, c, held, delayed, responses, lu, matrix, s: None, chosen: None })
    }

    /// G and C on their common pattern.
    pub fn pencil(&self) -> (&Pattern, &[f64], &[f64]) {
        (&self.pattern, &self.g, &self.c)
    }

    fn factor(&mut self, s: Complex) -> Result<(), Singular> {
        if self.s == Some(s) {
            return Ok(());
        }
        self.s = None;
        for (m, (&g, &c)) in self.matrix.iter_mut().zip(self.g.iter().zip(&self.c)) {
            *m = Complex::from(g) + s.scale(c);
        }
        for &(k, by) in &self.delayed {
            let (decay, angle) = ((-s.re * by).exp(), -s.im * by);
            self.matrix[k] = Complex::new(decay * angle.cos(), decay * angle.sin()).scale(self.g[k]);
        }
        for (k, response) in &self.responses {
            let (re, im) = (response.of)((s.re, s.im));
            if !(re.is_finite() && im.is_finite()) {
                return Err(Singular { row: None, col: Some(response.row), structural: false, finite: false });
            }
            self.matrix[*k] = Complex::new(-re, -im);
        }
        let size = s.abs();
        // pivots serve within this factor of the frequency at which they were chosen: entries change by orders of
        // magnitude along a sweep, and by no more than this between the points of a dense one
        if self.chosen.is_some_and(|c| (c / 2.0..=c * 2.0).contains(&size)) {
            self.lu.factor_or_refactor(&self.matrix)?;
        } else {
            self.chosen = None;
            self.lu.factor(&self.matrix)?;
            self.chosen = Some(size);
        }
        self.s = Some(s);
        Ok(())
    }

    /// b <- (G + s C)^-1 b; rows of what is held count for nothing.
    pub fn solve(&mut self, s: Complex, b: &mut [Complex]) -> Result<(), Singular> {
        self.factor(s)?;
        b.iter_mut().zip(&self.held).filter(|(_, &held)| held).for_each(|(b, _)| *b = Complex::ZERO);
        self.lu.solve(b);
        Ok(())
    }

    /// b <- (G + s C)^-T b, transposed and not conjugated.
    pub fn solve_transposed(&mut self, s: Complex, b: &mut [Complex]) -> Result<(), Singular> {
        self.factor(s)?;
        self.lu.solve_transposed(b);
        b.iter_mut().zip(&self.held).filter(|(_, &held)| held).for_each(|(b, _)| *b = Complex::ZERO);
        Ok(())
    }
}

/// A source of noise: what it drives into rows of F, for 1 of it; power density at 1 Hz, and the exponent of frequency with which
/// it falls.
pub struct NoiseSource {
    pub rows: Vec<(usize, f64)>,
    pub power: f64,
    pub exponent: f64,
}

impl NoiseSource {
    /// Density of what it gives at a frequency, with `a` the solution of the transposed equations for 1 of the output.
    pub fn density(&self, a: &[Complex], frequency: f64) -> f64 {
        let mut gain = Complex::ZERO;
        self.rows.iter().for_each(|&(row, k)| gain += a[row].scale(k));
        let falls = if self.exponent == 0.0 { 1.0 } else { frequency.powf(-self.exponent) };
        (gain.re * gain.re + gain.im * gain.im) * self.power * falls
    }
}

/// Derivatives of expressions by unknowns and sources, ready to be evaluated at a point.
pub struct Gradients {
    tape: Tape,
    terms: Vec<Vec<(Leaf, usize)>>, // of each expression: by what, output of the tape
}

#[derive(Clone, Copy)]
enum Leaf {
    Unknown(usize),
    Wave(usize),
}

/// The derivatives of one expression at a point: by unknowns, by sources.
#[derive(Clone, Default)]
pub struct Slopes {
    pub unknowns: Vec<(usize, f64)>,
    pub waves: Vec<(usize, f64)>,
}

impl Gradients {
    pub fn new(g: &mut Graph, of: &[Id]) -> Gradients {
        let (mut outs, mut terms) = (Vec::new(), Vec::new());
        for &id in of {
            let leaves: Vec<(Id, Leaf)> = g
                .reachable(&[id])
                .into_iter()
                .filter_map(|id| match g.node(id) {
                    Node::Unknown(i) => Some((id, Leaf::Unknown(i as usize))),
                    Node::Wave(k) => Some((id, Leaf::Wave(k as usize))),
                    _ => None,
                })
                .collect();
            let xs: Vec<Id> = leaves.iter().map(|l| l.0).collect();
            let slopes = gradient(g, id, &xs);
            let mut own = Vec::new();
            for ((_, leaf), d) in leaves.into_iter().zip(slopes) {
                if g.value(d) != Some(0.0) {
                    own.push((leaf, outs.len()));
                    outs.push(d);
                }
            }
            terms.push(own);
        }
        Gradients { tape: Tape::new(g, &outs), terms }
    }

    /// At (x, 0), with conditions and sources as they are in `w`.
    pub fn at(&self, sys: &System, w: &mut Work, x: &[f64]) -> Vec<Slopes> {
        self.at_time(sys, w, x, 0.0)
    }

    pub fn at_time(&self, sys: &System, w: &mut Work, x: &[f64], t: f64) -> Vec<Slopes> {
        sys.set_time(w, t);
        let values = self.tape.eval(&Inputs { x, t, waves: &w.waves, flags: &w.flags });
        let one = |terms: &Vec<(Leaf, usize)>| {
            let mut found = Slopes::default();
            for &(leaf, k) in terms {
                match leaf {
                    Leaf::Unknown(i) => found.unknowns.push((i, values[k])),
                    Leaf::Wave(i) => found.waves.push((i, values[k])),
                }
            }
            found
        };
        self.terms.iter().map(one).collect()
    }
}

impl Slopes {
    /// de/dx X + de/du U.
    pub fn of(&self, x: &[Complex], sources: &[(usize, Complex)]) -> Complex {
        let mut sum = Complex::ZERO;
        self.unknowns.iter().for_each(|&(i, d)| sum += x[i].scale(d));
        sum + self.by_sources(sources)
    }

    pub fn by_sources(&self, sources: &[(usize, Complex)]) -> Complex {
        let mut sum = Complex::ZERO;
        for &(k, d) in &self.waves {
            sources.iter().filter(|s| s.0 == k).for_each(|s| sum += s.1.scale(d));
        }
        sum
    }
}

/// How sources come into (1): constant coefficients, and expressions of F and of Q that read them.
pub struct Excitation {
    constant: Vec<(usize, usize, f64)>, // row, source, dF/du
    f: Vec<(usize, Slopes)>,
    q: Vec<(usize, Slopes)>,
    n: usize,
}

impl Excitation {
    pub fn at(sys: &System, g: &mut Graph, w: &mut Work, x: &[f64]) -> Excitation {
        let [f, q] = [0, 1].map(|which| {
            let rows = sys.expression_ids(which);
            let gradients = Gradients::new(g, &rows.iter().map(|r| r.1).collect::<Vec<_>>());
            let slopes = gradients.at(sys, w, x);
            rows.iter().map(|r| r.0).zip(slopes).filter(|(_, s)| !s.waves.is_empty()).collect()
        });
        Excitation { constant: sys.source_rows().to_vec(), f, q, n: sys.n }
    }

    /// b of (1) for sources with these amplitudes.
    pub fn of(&self, s: Complex, sources: &[(usize, Complex)]) -> Vec<Complex> {
        let mut b = vec![Complex::ZERO; self.n];
        for &(row, k, d) in &self.constant {
            sources.iter().filter(|s| s.0 == k).for_each(|s| b[row] -= s.1.scale(d));
        }
        for (rows, factor) in [(&self.f, Complex::ONE), (&self.q, s)] {
            for (row, slopes) in rows {
                b[*row] -= factor * slopes.by_sources(sources);
            }
        }
        b
    }
}
