//! Which of the orders comes next: the one that is expected to do the least work per unit of time.
//!
//! The estimates of orders s and s - 2 come from the same stages. For a solution that varies like exp(i w t),
//!
//!   est_s = K_s (w h)^(s+1),     K_s = c_1 .. c_s / (s! gamma_s),
//!
//! so their quotient gives w h, and that the estimate of order s + 2. Each gives the step which that order would take;
//! a step is also held where the iteration of the stages stops contracting, whatever the order, and where the run asks
//! for points. What a step costs is counted in operations of evaluation, factorisation and solution. Hairer and
//! Wanner's rule (1999, section 4: up where the contraction is below 0.002, down above 0.8) needed up to twice the time
//! on mechanisms, whose contraction is never that good.
use super::super::root;
use super::dense;
use super::tables::{Scheme, MOST, SCHEMES};
use crate::sparse::Lu;
use crate::system::{Kind, System};

/// The order changes only for a gain of so much: a change costs a Jacobian and its factorisations, the first ones with pivots to
/// find, and loses the step control its memory.
const GAIN: f64 = 0.7;
/// ... and falls only for more, where it begins higher: it is soon up again.
const FALL: f64 = 0.5;
/// After a change, so many steps pass before the next; after a failure of Newton's method, so many before a rise: twice as many as
/// after the last one, where that is no further back than so many times these steps. Beside change points of linkages the iteration
/// of the higher orders fails again and again.
const REST: u32 = 8;
const WAIT: u32 = 10;
const RECENT: u32 = 10;
/// At the highest order every so manieth step is looked at, and any behind a refused one, where no diode and no loop beside a change
/// point may want another order at once: a look costs a fourteenth of a step.
const LOOK: u32 = 4;
/// Contraction of the iteration that a step is chosen for, and the power of the step with which it grows (measured on
/// mechanisms, with the Jacobian of the middle of the step).
pub const CONTRACTION: f64 = 0.15;
const POWER: f64 = 1.3;

/// The next step in units of this one, where the iteration contracted like this.
pub fn contracting(contraction: f64) -> f64 {
    (CONTRACTION / contraction.clamp(BELIEVED.0, BELIEVED.1)).powf(1.0 / POWER).max(0.5)
}

/// Tolerances below this ask for much.
const MUCH: f64 = 5e-4;

/// Contractions that are believed.
const BELIEVED: (f64, f64) = (1e-5, 0.5);

/// Operations that everything else is worth which a step takes: the driver's work, the guess, the estimate, the rows. Not where
/// conductances turn within a step: long steps know little of that (bare exponentials at 3e-3 were wrong by 0.15 of the range).
const STEP: f64 = 4000.0;
/// A step that may grow by so much is on its way up from a start or a kick, where the least order is always the cheapest.
const GROWING: f64 = 1.5;

/// An entry or operation of factors, which are no straight-line code in a first run, in operations of an evaluation, which is.
const FACTORS: f64 = 4.0;

/// Operations of one evaluation, one Jacobian, one real factorisation, one real solution: the last two are known once there was one.
struct Costs {
    evaluation: f64,
    jacobian: f64,
    factor: f64,
    solve: f64,
    unknowns: f64,
}

/// What a step was like.
pub struct Taken {
    pub h: f64,
    pub iterations: usize,
    pub contraction: f64, // 0 where none was seen
    pub contracts: f64,   // the step that it allows, in units of this one
    /// error estimates of this order and of the next lower one, in units of the tolerance
    pub error: f64,
    pub lower: f64,
    /// the longest step that the run allows
    pub longest: f64,
    pub linear: bool,
}

pub struct Orders {
    least: usize,
    most: usize,
    /// order 9 where no exponential asks for the full Newton method and no loop for short steps beside its change points:
    /// the way up takes as long as a short run
    start: usize,
    /// the same of a run that asks for much: order 13 where that is order 9; behind jumps order 9 is the better one
    opening: Option<usize>,
    turns: bool, // conductances turn within a step
    fall: f64,   // gain for which the order falls
    wait: u32,
    patience: u32, // what the last failure made of it
    calm: u32,     // steps since then
    rest: u32,
    top: u32, // steps at the highest order since the last look
    costs: Costs,
    lower: [[f64; MOST]; 3], // of each scheme: weights of D in the estimate of the next lower order
}

/// c_1 .. c_s / (s! gamma), also for the scheme of one stage that is never used.
fn constant(scheme: Option<&Scheme>) -> f64 {
    scheme.map_or(1.0, |x| x.c.iter().enumerate().map(|(k, c)| c / (k + 1) as f64).product::<f64>() / x.gamma)
}

/// Weights of D in the estimate of the order below that of `rank`.
fn lower(rank: usize) -> [f64; MOST] {
    let (c, d) = if rank == 0 { (&[1.0][..], &[-1.0][..]) } else { (SCHEMES[rank - 1].c, SCHEMES[rank - 1].d) };
    let mut sum = [0.0; MOST];
    for (c, d) in c.iter().zip(d) {
        for (sum, l) in sum.iter_mut().zip(&dense::weights(SCHEMES[rank], *c)[1..]) {
            *sum += d * l;
        }
    }
    sum
}

impl Orders {
    /// `name`: radau (any order), radau5, radau9, radau13. With a fixed step, `radau` is of order 5.
    pub fn new(name: &str, fixed: bool, reltol: f64, sys: &System) -> Orders {
        let (least, most) = match name {
            "radau5" => (0, 0),
            "radau9" => (1, 1),
            "radau13" => (2, 2),
            _ if fixed => (0, 0),
            // one solution a step, its factorisation kept: the longest steps win at every tolerance
            _ if sys.pure_linear => (2, 2),
            _ => (0, 2),
        };
        let (values, derivatives) = sys.operations();
        let (entries, devices) = (sys.pattern.nnz() as f64, sys.device_operations());
        let costs = Costs {
            evaluation: 2.0 * values as f64 + 2.0 * entries + devices,
            jacobian: 2.0 * derivatives as f64 + 2.0 * entries + devices,
            factor: 0.0,
            solve: 0.0,
            unknowns: sys.n as f64,
        };
        let closed = sys.unknowns.iter().any(|u| u.kind == Kind::Lambda);
        let start = if most > least && sys.devices() == 0 && !closed { 1 } else { least };
        Orders {
            least,
            most,
            start,
            opening: (start == 1 && most == 2 && reltol < MUCH).then_some(2),
            turns: sys.turns(),
            fall: if start > least { FALL } else { GAIN },
            wait: 0,
            patience: WAIT,
            calm: u32::MAX,
            rest: 0,
            top: 0,
            costs,
            lower: std::array::from_fn(lower),
        }
    }

    pub fn first(&self) -> &'static Scheme {
        SCHEMES[self.start]
    }

    /// At the start of the run, and behind a jump.
    pub fn anew(&mut self) -> &'static Scheme {
        SCHEMES[self.opening.take().unwrap_or(self.start)]
    }

    pub fn most(&self) -> &'static Scheme {
        SCHEMES[self.most]
    }

    /// A step has been taken: is it time to look for another order? Then the estimate of the next lower one is asked for.
    pub fn due(&mut self, now: &Scheme) -> bool {
        self.wait = self.wait.saturating_sub(1);
        self.calm = self.calm.saturating_add(1);
        self.rest = self.rest.saturating_sub(1);
        if now.rank() < self.least {
            return true;
        }
        self.top = if now.rank() == self.most { self.top + 1 } else { 0 };
        let often = self.top == 0 || self.start == self.least;
        self.least < self.most && self.rest == 0 && (often || self.top >= LOOK)
    }

    /// A step was refused.
    pub fn refused(&mut self) {
        self.top = self.top.max(LOOK);
    }

    /// Weights of D in the estimate of the next lower order, and what turns the real matrix of this one into its own.
    pub fn lower(&self, scheme: &Scheme) -> (&[f64], f64) {
        let gamma = if scheme.rank() == 0 { 1.0 } else { SCHEMES[scheme.rank() - 1].gamma };
        (&self.lower[scheme.rank()][..scheme.s], scheme.gamma / gamma)
    }

    /// Work per unit of time, and the step, at order `rank`, where the estimate for a step of `taken.h` is `error`.
    /// `theta`: the logarithm of the contraction.
    fn rate(&self, rank: usize, taken: &Taken, theta: f64, error: f64, reltol: f64) -> (f64, f64) {
        let scheme = SCHEMES[rank];
        let s = scheme.s as f64;
        let allowed = super::share(reltol) / error.max(1e-12);
        let mut h = taken.h * (0.9 * root(allowed, scheme.s + 1)).clamp(0.125, 8.0);
        h = h.min(taken.longest);
        let mut iterations = taken.iterations as f64;
        if taken.contraction > 0.0 {
            h = h.min(taken.h * taken.contracts);
            let (least, most) = (BELIEVED.0.ln(), BELIEVED.1.ln());
            let stretched = (theta + POWER * (h / taken.h).ln()).clamp(least, most);
            iterations = 1.0 + (iterations - 1.0) * theta / stretched;
        }
        let c = &self.costs;
        let pairs = (s - 1.0) / 2.0;
        let systems = 1.0 + 4.0 * pairs;
        let mut work = if self.turns { 0.0 } else { STEP };
        work += (iterations * s + 1.0) * c.evaluation;
        work += iterations * (systems * c.solve + 3.0 * s * s * c.unknowns);
        if !taken.linear {
            work += c.jacobian + systems * c.factor;
        }
        (work / h, h)
    }

    /// After an accepted step: the order of the next, and its step where the order changes. `lu`: the step's real factors.
    pub fn next(
        &mut self,
        now: &'static Scheme,
        taken: &Taken,
        reltol: f64,
        lu: &Lu<f64>,
    ) -> (&'static Scheme, Option<f64>) {
        self.top = 0;
        if now.rank() < self.least {
            return (if self.wait == 0 { self.first() } else { now }, None);
        }
        if !(taken.lower > 0.0 && taken.error > 0.0) {
            return (now, None);
        }
        self.costs.factor = FACTORS * (lu.operations() + 3 * lu.nnz()) as f64;
        self.costs.solve = FACTORS * (2 * lu.nnz()) as f64;
        let rank = now.rank();
        let below = if rank == 0 { None } else { Some(SCHEMES[rank - 1]) };
        let theta = taken.contraction.clamp(BELIEVED.0, BELIEVED.1).ln();
        let (present, step) = self.rate(rank, taken, theta, taken.error, reltol);
        let mut best = (present, rank, 0.0);
        let mut consider = |other: usize, error: f64, gain: f64| {
            let (rate, h) = self.rate(other, taken, theta, error, reltol);
            if rate / gain < best.0 {
                best = (rate / gain, other, h);
            }
        };
        if rank > self.least && (self.turns || step < GROWING * taken.h) {
            consider(rank - 1, taken.lower, self.fall);
        }
        if rank < self.most && self.wait == 0 {
            let squared = (taken.error / constant(Some(now))) / (taken.lower / constant(below));
            let higher = taken.error * squared * constant(Some(SCHEMES[rank + 1])) / constant(Some(now));
            consider(rank + 1, higher, GAIN);
        }
        if best.1 == rank {
            return (now, None);
        }
        self.rest = REST;
        (SCHEMES[best.1], Some(best.2))
    }

    /// Newton's method failed twice: order 5 for a while, whose full Newton method gets through more than any other.
    pub fn fall(&mut self) -> &'static Scheme {
        let again = self.calm < self.patience.saturating_mul(RECENT);
        self.patience = if again { self.patience.saturating_mul(2) } else { WAIT };
        (self.wait, self.calm) = (self.patience, 0);
        SCHEMES[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// D of the stages of y' = z y, y(0) = 1, over a step of 1: (A^-1 - z) D = z.
    fn stages(scheme: &Scheme, z: f64) -> Vec<f64> {
        let s = scheme.s;
        let mut m: Vec<Vec<f64>> = (0..s)
            .map(|i| (0..s).map(|j| scheme.inverse_a[i * s + j] - if i == j { z } else { 0.0 }).chain([z]).collect())
            .collect();
        for k in 0..s {
            let pivot = (k..s).max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs())).unwrap();
            m.swap(k, pivot);
            let row = m[k].clone();
            for (_, other) in m.iter_mut().enumerate().filter(|(i, _)| *i != k) {
                let share = other[k] / row[k];
                (k..=s).for_each(|j| other[j] -= share * row[j]);
            }
        }
        (0..s).map(|k| m[k][s] / m[k][k]).collect()
    }

    /// f(x0) - u'(0) with these weights of D.
    fn estimate(weights: &[f64], d: &[f64], z: f64) -> f64 {
        z + weights.iter().zip(d).map(|(w, d)| w * d).sum::<f64>()
    }

    #[test]
    fn the_lower_orders_estimate_is_what_that_order_would_have_found() {
        for rank in [1, 2] {
            for z in [-0.3, -0.6, 0.4] {
                let (here, below) = (SCHEMES[rank], SCHEMES[rank - 1]);
                let own = estimate(below.d, &stages(below, z), z);
                let read = estimate(&lower(rank)[..here.s], &stages(here, z), z) * (here.s - 1) as f64;
                // both are the first term of a series in z
                assert!((read / own - 1.0).abs() < 0.25 * z.abs(), "rank {rank}, z {z}: {read:e} for {own:e}");
            }
        }
    }
}
