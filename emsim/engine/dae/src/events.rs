//! State events: times at which flags turn, found on the method's dense output inside a step.
//!
//! What a flag means at its threshold. A flag holds the truth of "operand > 0" during a step, so that the equations are smooth in
//! it. Its value belongs to the open stretch between two events, and the values at an event itself are those just behind it:
//!
//! 1. A condition is true where its operand is above zero, and false at zero. So it ends where the operand *arrives* at zero, though it
//!    may stay there (a PULSE that returns to 0), and begins where the operand *leaves* zero upwards. `a >= b` is "not b > a", `a == b`
//!    neither a > b nor b > a, `a != b` its negation, a bare `x ?` is x != 0: each is made of flags of this kind, closed on the right side.
//! 2. A switch without hysteresis turns where its operand arrives at zero from either side, and stays so while the operand is there
//!    (ngspice's S and W: off after PULSE(0 1) with vt=0, on during PULSE(0 5) with vt=5). It starts on when it starts there, and in a
//!    run from given values as its card says. With hysteresis it turns beyond its outer threshold only.
//! 3. A kink (min, max, abs, tables) has the same value on both sides: it turns beyond zero only.
//! 4. Zero is zero to rounding: operands within 64 eps of what is added up in them, the largest quantities of the run in place of
//!    their present values, are on the threshold (conditions.rs).
//! 5. A flag that has turned stands on its threshold until its operand has been clear of it on the flag's own side ("armed"). Until
//!    then only an operand clear of it on the other side turns the flag again: an event found a little early turns nothing back.
//! 6. Flags turn together. After a turn the algebraic unknowns are solved anew and the flags asked again, until none asks: all
//!    that ask turn at once, later one after the other, so that latches that are let go together fall to one side. Flags that find no
//!    consistent set end the run (E418); one that is not what its condition says at a row is told (W404).
//! 7. Logic of flags alone (`!`, `&&`, `==` of comparisons, their sums) is no flag: it is computed from them, exactly.
//!
//! 8. A kink that turns again and again has no events for a while: it is a function then, which every iteration evaluates at its
//!    point (`Work::free`), so that nothing is integrated along a branch that no longer holds.
//!
//! `System::eval_roots` gives of each flag a number that is positive where the flag asks to turn, and continuous. Times that sources
//! alone decide are computed, not searched: edges.rs follows the same rules. Modes of laws (friction, rigid stops) are flags whose roots are searched
//! like the others'; where one asks, modes.rs decides all of them together.
//!
//! After a step the roots are looked at in a few places and at its end, and between neighbouring looks where slopes let them rise above
//! zero and fall again (events/peaks.rs), of laws with modes by more than their bands. Inside a step values are known less well than at
//! its end: where a peak is above zero by less than that, the step is taken anew to end there, and its end tells. The earliest
//! crossing is bracketed and narrowed by the Illinois variant of regula falsi. The step is then repeated up to there, and once
//! more where its end tells another place: what lies inside a long step of the trapezoid is known less well than its end.
use crate::model::Law;
use crate::system::{System, Work};

mod peaks;
use peaks::Place;

/// What is found in a step.
pub enum Located {
    /// flags flip there
    Turn(f64),
    /// a step has to end there to tell
    Peak(f64),
}

/// A step just attempted: its end, its inside, and whether it is so long that its inside must be searched too.
pub struct Candidate<'a> {
    pub end: &'a [f64],
    pub dense: &'a dyn Fn(f64, &mut [f64]),
    pub long: bool,
    /// so far turns what conditions hang on by sines [rad]
    pub turn: f64,
    pub reltol: f64,
    /// is a step to end at a peak that only its end can tell?
    pub peaks: bool,
}

/// Compares every flag with its condition at every row: a flag that is not what its condition says is told, once each.
#[derive(Clone, Default)]
pub struct Check {
    since: Vec<(f64, f64)>, // by flag: from this end of a step on it asks to turn, at each, and its value then; INFINITY: it does not
    roots: Vec<f64>,
    last: f64, // where the step began, and the one before it
    before: f64,
    span: f64, // of the run
    reltol: f64,
    pub broken: Vec<(f64, usize)>,
}

/// Between the ends of steps values are known to so many tolerances.
const INSIDE: f64 = 10.0;

fn tell(broken: &mut Vec<(f64, usize)>, k: usize, t: f64) {
    if !broken.iter().any(|&(_, other)| other == k) {
        broken.push((t, k));
    }
}

impl Check {
    pub fn new(span: f64, reltol: f64) -> Check {
        Check { span, reltol, ..Check::default() }
    }

    /// Longer than flags take that set each other off: a few roundings of time.
    fn long(&self, from: f64, t: f64) -> bool {
        // still asking to turn, this part of the time later, and no less than a part of the run: what is let go from
        // rest turns its kinks within roundings of time
        t - from > 1e-9 * t.max(1e-3 * self.span)
    }

    /// Steps go on from t.
    pub fn begin(&mut self, t: f64) {
        (self.before, self.last) = (t, t);
    }

    /// At corners and edges what sources decide is about to turn, or touches its threshold: half-way is between two of them.
    fn half_way(&mut self, sys: &System, w: &mut Work, t: f64) {
        let (middle, long) = (0.5 * (self.last + t), self.long(self.last, t));
        (self.before, self.last) = (self.last, t);
        if !long {
            return;
        }
        sys.broken_edges(w, middle, |k| tell(&mut self.broken, k, middle));
    }

    fn at_end(&mut self, sys: &System, w: &Work, roots: &[f64], quiet_until: &[f64], t: f64) {
        const NEVER: f64 = f64::INFINITY;
        self.since.resize(roots.len(), (NEVER, 0.0));
        for (k, &root) in roots.iter().enumerate().filter(|&(k, _)| !sys.is_timed(k) && !sys.flags[k].law.of_modes()) {
            let (since, value) = self.since[k];
            // both sides of a kink agree at it: within the tolerance either is right
            let kink = if sys.flags[k].law.is_kink() {
                (self.reltol * sys.flag_size(w, k)).max(sys.flag_unknown(w, k))
            } else {
                0.0
            };
            if !(root > kink && t >= quiet_until[k]) {
                self.since[k].0 = NEVER;
            } else if since == NEVER || value != w.flags[k] {
                self.since[k] = (t, w.flags[k]);
            } else if self.long(since, t) {
                tell(&mut self.broken, k, t);
            }
        }
    }

    /// A row inside a step.
    pub fn inside(&mut self, sys: &System, w: &mut Work, x: &[f64], t: f64) {
        let began = if t > self.last { self.last } else { self.before };
        if sys.flags.is_empty() || !self.long(began, t) {
            return;
        }
        let mut roots = std::mem::take(&mut self.roots);
        roots.resize(sys.flags.len(), 0.0);
        sys.eval_all_roots(w, x, t, &mut roots);
        for (k, &root) in roots.iter().enumerate() {
            if sys.flags[k].law.of_modes() || w.free.contains(&k) {
                continue;
            }
            let known = INSIDE * (self.reltol * sys.flag_size_at(w, x, t, k)).max(sys.flag_unknown(w, k));
            if root > 0.0 && root > known {
                tell(&mut self.broken, k, t);
            }
        }
        self.roots = roots;
    }
}

#[derive(Clone)]
pub struct Detector {
    before: Vec<f64>, // roots at the start of the step
    since: f64,       // which is then
    rate: Vec<f64>,   // by how much a second they changed in the step before, as far as that is known
    now: Vec<f64>,
    looks: Vec<f64>, // roots at the places of a step at which it is looked at, one place after the other
    fired: Vec<usize>,
    seen: (f64, Vec<f64>),   // roots at the end of a repeated step
    ahead: Vec<f64>,         // of the fired flags: time until their roots cross
    recent: Vec<(f64, u32)>, // of each flag: when its present run of quick flips began, how many
    quiet_until: Vec<f64>,
}

/// So many flips within `SHORT` of the span are chattering (sliding along a discontinuity): the flag then rests for
/// `REST` of the span, so that the run goes on and follows the sliding to that resolution.
const MANY: u32 = 8;
const SHORT: f64 = 2e-5;
/// The inside of a step is looked at after so much of a turn [rad], so often at most.
pub const LOOK: f64 = std::f64::consts::FRAC_PI_6;
const LOOKS: f64 = 4096.0;
/// Slopes inside a step are those over this part of it.
const REST: f64 = 1e-4;

impl Detector {
    pub fn new(sys: &System) -> Detector {
        let n = sys.flags.len();
        Detector {
            before: vec![0.0; n],
            since: 0.0,
            rate: vec![0.0; n],
            now: vec![0.0; n],
            looks: Vec::new(),
            fired: Vec::new(),
            seen: (0.0, vec![0.0; n]),
            ahead: Vec::new(),
            recent: vec![(f64::NEG_INFINITY, 0); n],
            quiet_until: vec![f64::NEG_INFINITY; n],
        }
    }

    pub fn start(&mut self, sys: &System, w: &mut Work, x: &[f64], t: f64) {
        sys.observe_flags(w, x, t);
        sys.eval_roots(w, x, t, &mut self.before);
        self.since = t;
        self.rate.fill(0.0);
    }

    pub fn accept(&mut self, sys: &System, w: &mut Work, x: &[f64], t: f64, check: &mut Check) {
        check.half_way(sys, w, t);
        sys.turn_free(w, x, t);
        w.free.retain(|&k| t < self.quiet_until[k]);
        sys.observe_flags(w, x, t);
        self.now.copy_from_slice(&self.before);
        sys.eval_all_roots(w, x, t, &mut self.before);
        check.at_end(sys, w, &self.before, &self.quiet_until, t);
        sys.mask_timed(w, &mut self.before);
        for (rate, (now, before)) in self.rate.iter_mut().zip(self.before.iter().zip(&self.now)) {
            *rate = ((now - before) / (t - self.since)).abs();
        }
        self.since = t;
        // a root that crosses while its flag rests is still to fire when the rest is over, wherever it then goes
        for (root, &rest) in self.before.iter_mut().zip(&self.quiet_until) {
            if rest > t {
                *root = root.min(0.0);
            }
        }
    }

    pub fn fired(&self) -> &[usize] {
        &self.fired
    }

    /// A root that was already positive (a flip that a located step just missed) fires only when it
    /// moves further away.
    fn fires(&self, k: usize, value: f64, t: f64) -> bool {
        value > 0.0 && t >= self.quiet_until[k] && (self.before[k] <= 0.0 || value > self.before[k])
    }

    fn any(&mut self, sys: &System, w: &mut Work, x: &[f64], t: f64) -> bool {
        let mut now = std::mem::take(&mut self.now);
        sys.eval_roots(w, x, t, &mut now);
        let any = (0..now.len()).any(|k| self.fires(k, now[k], t));
        self.now = now;
        any
    }

    /// The earliest event in (t0, t1] of the candidate step, or a peak before it that its inside cannot tell from one. `fired` lists the
    /// flags that flip at an event.
    pub fn locate(
        &mut self,
        sys: &System,
        w: &mut Work,
        m: &Candidate,
        t0: f64,
        t1: f64,
        x: &mut [f64],
    ) -> Option<Located> {
        if sys.flags.is_empty() {
            return None;
        }
        let least = if m.long || sys.has_laws() { 4.0 } else { 1.0 };
        let looks = (m.turn / LOOK).ceil().clamp(least, LOOKS) as usize;
        let times: Vec<f64> = (0..=looks).map(|j| t0 + j as f64 / looks as f64 * (t1 - t0)).collect();
        let n = self.before.len();
        self.looks.clear();
        self.looks.extend_from_slice(&self.before);
        let mut found = None;
        for j in 1..=looks {
            let any = self.look(sys, w, m, (times[j], t1), x);
            self.looks.extend_from_slice(&self.now);
            if any {
                found = Some((j, if j == looks { t1 } else { times[j] }));
                break;
            }
        }
        let last = found.map_or(looks, |(j, _)| j);
        let peak = match self.between(sys, w, m, &times[..=last], x) {
            Some((_, t, false)) => return Some(Located::Peak(t)),
            peak => peak.map(|(j, t, _)| (j, t)),
        };
        let (j, mut hi) = peak.or(found)?;
        let from = if peak.is_some() || m.turn > LOOK { j - 1 } else { 0 };
        let mut lo = times[from];
        let mut low = self.looks[from * n..(from + 1) * n].to_vec();
        self.look(sys, w, m, (hi, t1), x);
        // narrow the bracket [lo, hi]: at lo none fires, at hi at least one does
        let tiny = (4.0 * f64::EPSILON * t1.abs()).max(1e-13 * (t1 - t0));
        let mut high = self.now.clone();
        let mut side = 0i32;
        for _ in 0..80 {
            if hi - lo <= tiny {
                break;
            }
            // the flag that crosses first by linear estimate decides where to look
            let mut theta = 1.0_f64;
            for k in 0..high.len() {
                if self.fires(k, high[k], hi) {
                    let (a, b) = (low[k].min(0.0), high[k]);
                    theta = theta.min(if b - a > 0.0 { -a / (b - a) } else { 0.5 });
                }
            }
            let mut t = lo + theta.clamp(0.02, 0.98) * (hi - lo);
            if side.abs() >= 3 {
                t = 0.5 * (lo + hi);
                side = 0;
            }
            (m.dense)(t, x);
            if self.any(sys, w, x, t) {
                hi = t;
                high.copy_from_slice(&self.now);
                side = side.max(0) + 1;
            } else {
                lo = t;
                low.copy_from_slice(&self.now);
                side = side.min(0) - 1;
            }
        }
        self.fired.clear();
        for k in 0..high.len() {
            if self.fires(k, high[k], hi) {
                self.fired.push(k);
            }
        }
        self.seen.0 = t0;
        self.seen.1.copy_from_slice(&self.before);
        Some(Located::Turn(hi))
    }

    /// Roots at t of the candidate step, which ends at t1: does any fire?
    fn look(&mut self, sys: &System, w: &mut Work, m: &Candidate, (t, t1): (f64, f64), x: &mut [f64]) -> bool {
        if t < t1 {
            (m.dense)(t, x);
        } else {
            x.copy_from_slice(m.end);
        }
        self.any(sys, w, x, t)
    }

    /// Where a root rises above zero and falls again between two looks, as of two parts that fly through each other: the first part
    /// of the step in which one does, a time at which it fires, and whether it does so by more than is unknown inside a step.
    fn between(
        &mut self,
        sys: &System,
        w: &mut Work,
        m: &Candidate,
        times: &[f64],
        x: &mut [f64],
    ) -> Option<(usize, f64, bool)> {
        let n = self.before.len();
        let (parts, width) = (times.len() - 1, times[1] - times[0]);
        let sought = |k: usize| !sys.is_timed(k) && !sys.flags[k].law.remembers() && sys.flags[k].law != Law::Kept;
        let mut asked = Vec::new();
        for k in (0..n).filter(|&k| sought(k)) {
            let root = |j: usize| self.looks[j * n + k];
            let slope = (0..parts).map(|j| (root(j + 1) - root(j)).abs() / width).fold(self.rate[k], f64::max);
            let (least, _) = self.levels(sys, w, m, k);
            asked.extend(
                (0..parts).filter(|&j| peaks::reaches((root(j), root(j + 1)), width, slope, least)).map(|j| (j, k)),
            );
        }
        asked.sort_unstable();
        // slopes inside a step are those over this part of it
        let nearby = 1e-5 * (times[parts] - times[0]);
        for part in asked.chunk_by(|a, b| a.0 == b.0) {
            let j = part[0].0;
            let (t0, t1) = (times[j], times[j + 1]);
            let [begin, end] =
                [(t0, t0 + nearby), (t1 - nearby, t1)].map(|(a, b)| [a, b].map(|t| (t, self.roots(sys, w, m, t, x))));
            let first = part.iter().filter_map(|&(_, k)| {
                let slope = |[a, b]: &[(f64, Vec<f64>); 2]| (b.1[k] - a.1[k]) / (b.0 - a.0);
                let place = |j: usize, slope| Place { t: times[j], value: self.looks[j * n + k], slope };
                let (a, b) = (place(j, slope(&begin)), place(j + 1, slope(&end)));
                let (least, sure) = self.levels(sys, w, m, k);
                // one that is above at the end of the part is found there
                let level = if b.value > 0.0 { sure } else { least };
                let mut read = |t: f64| {
                    let next = t + nearby;
                    let [value, ahead] = [t, next].map(|t| self.roots(sys, w, m, t, x)[k]);
                    Place { t, value, slope: (ahead - value) / (next - t) }
                };
                let t = peaks::above(a, b, level, &mut read).filter(|&t| t >= self.quiet_until[k])?;
                let value = read(t).value;
                Some((t, value > sure))
            });
            if let Some((t, is_sure)) = first.min_by(|a, b| a.0.total_cmp(&b.0)) {
                return Some((j + 1, t, is_sure));
            }
        }
        None
    }

    fn roots(&self, sys: &System, w: &mut Work, m: &Candidate, t: f64, x: &mut [f64]) -> Vec<f64> {
        let mut roots = vec![0.0; self.before.len()];
        (m.dense)(t, x);
        sys.eval_roots(w, x, t, &mut roots);
        roots
    }

    /// What rises no higher than the first inside a step is nothing, what rises no higher than the second may be nothing: values are known
    /// less well there. Of laws with modes, and kinks, which are the same on both sides, these are one.
    fn levels(&self, sys: &System, w: &Work, m: &Candidate, k: usize) -> (f64, f64) {
        let (law, size, rest) = (sys.flags[k].law, sys.flag_size(w, k), sys.flag_unknown(w, k));
        let unknown = match law {
            Law::Mode => sys.mode_band(w, k),
            _ => INSIDE * (m.reltol * size).max(rest),
        };
        // what has hardly moved from rest is known no better at an end
        let told_by_ends = m.peaks && law != Law::Mode && !law.is_kink() && rest == 0.0;
        let zero = self.before[k].max(0.0);
        // Newton's method ends where values are known to so much of what is added up in them
        (zero + if told_by_ends { 1e-9 * size } else { unknown }, zero + unknown)
    }

    /// The repeated step ends at (x, at): how long until the first of the fired flags' roots crosses, below 0 where it has.
    /// By the line from the last end looked at, and at first from the step's start. None where one has crossed and falls again:
    /// no line tells when.
    pub fn due(&mut self, sys: &System, w: &mut Work, x: &[f64], at: f64) -> Option<f64> {
        let mut now = std::mem::take(&mut self.now);
        sys.eval_roots(w, x, at, &mut now);
        let (t0, then) = &mut self.seen;
        self.ahead.clear();
        let mut falls = false;
        for &k in &self.fired {
            let slope = (now[k] - then[k]) / (at - *t0);
            let ahead = if slope > 0.0 { -now[k] / slope } else { 0.0 };
            falls |= slope <= 0.0 && now[k] > 0.0 && self.before[k] <= 0.0 && at >= self.quiet_until[k];
            // what was to flip already has no crossing here, and what rests none before its rest is over
            self.ahead.push(if self.before[k] > 0.0 { 0.0 } else { ahead.max(self.quiet_until[k] - at) });
        }
        *t0 = at;
        then.copy_from_slice(&now);
        self.now = now;
        (!falls).then(|| self.ahead.iter().copied().fold(f64::INFINITY, f64::min))
    }

    /// Those of the fired flags whose roots cross later than `near` from there do not flip with it.
    pub fn keep_due(&mut self, near: f64) {
        let mut ahead = self.ahead.iter();
        self.fired.retain(|_| ahead.next().is_some_and(|&ahead| ahead <= near));
    }

    /// Book-keeping after the flags have been flipped at t: a flag that flips again and again in no time rests a while.
    /// Returns a flag that has just been put to rest; kinks are free for as long.
    pub fn flipped(&mut self, sys: &System, w: &mut Work, t: f64, span: f64) -> Option<usize> {
        let mut resting = None;
        for &k in self.fired.iter().filter(|&&k| !sys.flags[k].law.of_modes()) {
            let (begin, count) = self.recent[k];
            let kink = sys.flags[k].is_kink();
            // of kinks in so much shorter a time: both sides agree, so nothing slides along one. What turns that often
            // there is rounding, what turns less often swings
            let part = if kink { 1e-3 } else { 1.0 } * span;
            self.recent[k] = if t - begin < SHORT * part { (begin, count + 1) } else { (t, 1) };
            if self.recent[k].1 >= MANY {
                self.quiet_until[k] = t + REST * part;
                self.recent[k] = (f64::NEG_INFINITY, 0);
                match kink {
                    true => w.free.push(k),
                    false => resting = Some(k),
                }
            }
        }
        resting
    }
}
