//! Alexander's method of two stages (1977), order 2, L-stable, gamma = 1 - 1/sqrt 2; steps of a fixed length alone.
//!
//!   Q(X) - Q0 + gamma h F(X) = 0,    Q1 - Q0 + (1 - gamma) h F(X) + gamma h F1 = 0
use super::{Attempt, Character, Method, Response};
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::system::{System, Work};

const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

pub struct Sdirk2 {
    newton: Newton,
    times: [f64; 2], // of the last step
    x: [Vec<f64>; 2],
    q0: Vec<f64>,
    most: usize,
}

impl Sdirk2 {
    pub fn new(sys: &System, o: &Options) -> Result<Sdirk2, Failure> {
        let v = || vec![0.0; sys.n];
        Ok(Sdirk2 { newton: Newton::new(sys)?, times: [0.0; 2], x: [v(), v()], q0: v(), most: o.itl4 })
    }

    fn step(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<(), Failure> {
        let (a, t0) = (1.0 / (GAMMA * h), self.times[0]);
        let mut r: Vec<f64> = self.q0.iter().map(|q| -a * q).collect();
        for (t, share) in [(t0 + GAMMA * h, 0.0), (t0 + h, (1.0 - GAMMA) / GAMMA)] {
            if share > 0.0 {
                r.iter_mut().zip(self.newton.f()).for_each(|(r, f)| *r += share * f);
            }
            for _ in 0..2 {
                self.newton.solve(sys, w, a, &r, &mut self.x[1], t, tol, self.most)?;
            }
        }
        Ok(())
    }
}

impl Response for Sdirk2 {}

impl Method for Sdirk2 {
    fn character(&self) -> &Character {
        &Character::PLAIN
    }

    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.times = [t, t];
        self.x.iter_mut().for_each(|own| own.copy_from_slice(x));
        sys.eval(w, x, t);
        self.q0.copy_from_slice(&w.q);
        self.newton.forget();
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if self.times[1] > self.times[0] {
            self.times[0] = self.times[1];
            self.x[0] = self.x[1].clone();
        }
        match self.step(sys, w, h, tol) {
            Ok(()) => Attempt::Good { next: h },
            Err(why) => Attempt::Stuck { next: 0.25 * h, why: why.into() },
        }
    }

    fn accept(&mut self, t1: f64) {
        self.times[1] = t1;
        self.q0.copy_from_slice(self.newton.q());
    }

    fn candidate(&self) -> &[f64] {
        &self.x[1]
    }

    /// The line between the ends.
    fn dense(&self, t: f64, out: &mut [f64]) {
        let [t0, t1] = self.times;
        let share = if t1 > t0 { (t - t0) / (t1 - t0) } else { 1.0 };
        for ((o, a), b) in out.iter_mut().zip(&self.x[0]).zip(&self.x[1]) {
            *o = a + share * (b - a);
        }
    }
}
