//! What a step of Radau is made of: where it starts, its stages, how Newton's method fares, what its error is, and the step before it.
use super::full::FullNewton;
use super::tables::Scheme;
use crate::newton::Noise;
use crate::sparse::Complex;
use crate::system::{Kind, System, Work};

/// The start of the step.
#[derive(Default)]
pub struct Start {
    pub t: f64,
    pub x: Vec<f64>,
    pub q: Vec<f64>,
    pub f: Vec<f64>,
    pub still: Vec<f64>,  // f without the sources, of linear equations
    pub known: bool,      // f, q, still hold
    pub bent: bool,       // all is linear, and the sources bend at t
    pub stored: [f64; 2], // largest charge and momentum at x
}

impl Start {
    /// Charges and currents there.
    pub fn evaluate(&mut self, sys: &System, w: &mut Work) {
        sys.eval(w, &self.x, self.t);
        self.q.copy_from_slice(&w.q);
        self.f.copy_from_slice(&w.f);
        if sys.pure_linear {
            self.still.copy_from_slice(&w.f);
            sys.subtract_waves(w, &mut self.still);
        }
        self.known = true;
        let largest = |of: fn(Kind) -> bool| {
            let q = self.q.iter().zip(&sys.unknowns).filter(|(_, u)| of(u.kind));
            q.fold(0.0, |m: f64, (q, _)| m.max(q.abs()))
        };
        self.stored = [largest(|k| k == Kind::Node), largest(|k| k == Kind::Speed)];
    }
}

/// The stages.
pub struct Points {
    pub x: Vec<Vec<f64>>,
    pub waves: Vec<Vec<f64>>, // of sources, at their times
    pub d: Vec<Vec<f64>>,     // what the charges have moved by
    pub f: Vec<Vec<f64>>,     // F, and Q behind it
    pub b: Vec<f64>,          // right-hand side of the real equations, and their solution
    pub z: Vec<Vec<Complex>>, // of the complex ones
}

impl Points {
    pub fn new(n: usize, most: usize) -> Points {
        let of = |n: usize| vec![vec![0.0; n]; most];
        let z = vec![vec![Complex::from(0.0); n]; (most - 1) / 2];
        Points { x: of(n), waves: of(0), d: of(n), f: of(2 * n), b: vec![0.0; n], z }
    }
}

/// The accepted step, for prediction and dense output.
pub struct Last {
    pub step: Option<(f64, f64, &'static Scheme)>, // start, length
    pub stage: Vec<Vec<f64>>,
    pub x0: Vec<f64>,
    pub e: Vec<f64>,
    pub bent: bool, // at its start
    pub anew: bool, // it began so
}

/// Where the rounding of an algebraic unknown comes from: what is stored in the rows that it stands in, over h.
#[derive(Clone, Copy)]
pub enum Stored {
    Charge,
    Momentum,
}

/// How Newton's method fares.
pub struct Iteration {
    pub foresee: bool,                 // the Jacobian is, or may be, that of a predicted state
    pub theta: f64,                    // of the last iteration: is the Jacobian still good?
    pub contraction: f64,              // of the last two: is the order too high?
    pub moved: Vec<f64>,               // largest part of the last update, of each unknown
    pub grown: f64,                    // the last update in units of what was there before it
    pub linear: Vec<(usize, Stored)>,  // unknowns in no norm that have a scale: what their rounding comes from
    pub behind: f64,                   // largest last update of such an unknown, in units of its scale
    pub level: f64,                    // where rounding has lately stopped the iteration
    pub full: Option<Box<FullNewton>>, // made when first needed
    pub full_steps: u32,               // so many steps more begin with it
}

impl Iteration {
    pub fn new(sys: &System) -> Iteration {
        let linear = (sys.unknowns.iter().zip(&sys.differential).enumerate())
            .filter_map(|(i, (u, &moves))| match u.kind {
                Kind::Lambda => Some((i, Stored::Momentum)),
                Kind::Branch if !moves => Some((i, Stored::Charge)),
                _ => None,
            })
            .collect();
        let (moved, full, full_steps, grown, behind, level) = (vec![0.0; sys.n], None, 0, 0.0, 0.0, 0.0);
        Iteration { foresee: true, theta: 1.0, contraction: 1.0, moved, grown, linear, behind, level, full, full_steps }
    }
}

/// The error of the step, and what rounding has to do with it.
pub struct Estimate {
    pub e: Vec<f64>,
    pub of_step: f64,                 // in units of the tolerance
    pub unfiltered: f64,              // the last one before it was filtered
    pub at_first: Option<(f64, f64)>, // length and estimate of the first attempt from here that was refused
    pub probe: Option<(f64, f64)>,    // step and error that a step of a quarter is compared with
    pub relax: f64,                   // the error is divided by this where rounding keeps the tolerance out of reach
    pub noise: f64,                   // what rounding left of the last update of the full Newton method
    pub noises: Noise,                // what rounding does to every unknown, where it was asked for
    pub corrected: Vec<bool>,         // unknowns that dense output is corrected in by the estimate
    pub given: Vec<bool>,             // unknowns that have what a source has
    pub smooth: Vec<bool>,            // what is on one curve with the start, of a step that begins anew
}

impl Estimate {
    pub fn new(sys: &System) -> Estimate {
        // the estimate means nothing for an algebraic unknown (linearised where the curve may bend sharply)
        let corrected: Vec<bool> = (sys.unknowns.iter().zip(&sys.differential))
            .map(|(u, &moves)| moves && !u.kind.enters_linearly())
            .collect();
        Estimate {
            e: vec![0.0; sys.n],
            of_step: 0.0,
            unfiltered: 0.0,
            at_first: None,
            probe: None,
            relax: 1.0,
            noise: 0.0,
            noises: Noise::new(sys.n),
            smooth: corrected.clone(),
            corrected,
            given: sys.alone(),
        }
    }
}
