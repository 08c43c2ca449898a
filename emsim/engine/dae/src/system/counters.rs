//! How often what a run costs was done.

#[derive(Clone, Copy, Default, Debug)]
pub struct Counters {
    pub steps: u64,
    pub rejected: u64,
    pub newton_failures: u64,
    pub iterations: u64,
    pub evaluations: u64,
    pub jacobians: u64,
    pub factorisations: u64,
    pub solves: u64,
    pub events: u64,
    pub breakpoints: u64,
}

impl Counters {
    pub fn add(&mut self, other: &Counters) {
        self.steps += other.steps;
        self.rejected += other.rejected;
        self.newton_failures += other.newton_failures;
        self.iterations += other.iterations;
        self.evaluations += other.evaluations;
        self.jacobians += other.jacobians;
        self.factorisations += other.factorisations;
        self.solves += other.solves;
        self.events += other.events;
        self.breakpoints += other.breakpoints;
    }
}
