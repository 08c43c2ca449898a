//! What a run's steps tell about the run: how much of an oscillation the method takes, how late it makes it, whether it
//! rings, whether loops come open, and how many steps the rest would need.
//!
//! Watched are bursts of `BURST` accepted steps (every one, or every 4th or 16th for slower modes) with pauses between
//! them, so that all of it costs a fraction of a percent. Where an unknown oscillates in a burst (oscillation.rs), the
//! method's response at y = w h (response.rs) gives loss and lateness of a step. A track follows one unknown's mode from
//! burst to burst and adds them up. Of methods with long steps there are samples inside each step too.
//!
//! Not every oscillation is the method's to damp: a driven one is held up by its source. So a loss counts only where the
//! amplitude is seen to fall: about as predicted, or faster and as evenly within the bursts as from one to the next, which
//! is a mode that decays by itself; of that one the method takes what is predicted. What drives (driven.rs) is a source, a
//! sine of time, a shaft that turns. Of an oscillation of its very frequency the method takes nothing: it falls with what
//! drives it. Lateness cannot be seen. It counts, as the loss of a mode that decays, where nothing of about that frequency
//! (or a harmonic) drives. What a mode that decays has lost or is late by weighs as much as is left of it, so its figures
//! are those of the time when that product was largest. Told beside true: tests/bench/watch.py.
//!
//! Ringing: a method with |R(infinity)| = 1 keeps errors of algebraic unknowns and fast modes as +a, -a, +a ...
//!
//! Cost: steps so far and the present rate for the rest, over `maxsteps`, throughout `PATIENT` steps. A mode that is seen
//! to decay by itself is given the time that it takes to die.
mod driven;
mod track;

use self::driven::Drives;
use self::track::{alike, Sum, Track};
use super::oscillation::{extremes, Stretch};
use super::response;
use super::{Limit, Method};
use crate::newton::{Failure, Options, Tolerances};
use crate::stopwatch::Stopwatch;
use crate::system::{System, Work};

const BURST: usize = 96; // samples of a burst: at eight a period, a dozen periods
/// A burst that is cut short is looked at from so many samples on.
const LEAST: usize = 24;
/// Steps from sample to sample, in turn; the longest serve modes of some hundred steps a period.
const STRIDES: [u32; 3] = [1, 4, 16];
/// Steps between bursts: a quarter of those taken, within these bounds.
const PAUSE: (u64, u64) = (128, 2048);
/// Unknowns that are watched, of larger systems the first ones.
const MOST: usize = 400;
/// An amplitude below this part of the largest value is not worth a word.
const WORTH: f64 = 1e-3;
/// What a changed frequency may add up to, in periods, before the lateness of a step says nothing of that of the run.
const UNSTEADY: f64 = 0.01;
/// Steps of a burst that are asked what they do to it, or up to twice as many.
const SAMPLED: usize = 96;
/// Frequencies that differ by less lose alike: the loss of a formula of order 5 by 1 %.
const TOGETHER: f64 = 2e-3;
/// So much of what is predicted may be missing or too much from burst to burst, added up.
const APART: f64 = 0.8;
/// What falls by so many times what is predicted within its bursts decays by itself.
const OWN: f64 = 1.25;
/// What a burst must lose, ln, to be told from the error of its fit.
const FITTED: f64 = 1e-3;
/// ... and ringing below this.
const RINGS: f64 = 0.01;
/// Steps that a run may be on its way to `maxsteps` before it is stopped, and how often that is looked at.
const PATIENT: u64 = 200_000;
const LOOK: u64 = 4096;
/// A mode that loses less than this a cycle (a quality above 30 000) persists: what it loses may as well be numerical, since
/// steps of changing length take a little even where the formula takes nothing.
const SLOWEST: f64 = 1e-4;

/// A mode as it was followed: what the method took of it.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub unknown: usize,
    pub period: f64,
    pub steps: f64,  // a period, in its coarsest burst
    pub share: f64,  // amplitude at first, of the unknown's largest value
    pub loss: f64,   // share of the amplitude over the run; 0 where it was not seen to fall by it
    pub late: f64,   // periods over the run
    pub cycles: f64, // periods followed, until when the figure holds
    pub left: f64,   // share of the amplitude at first that the mode itself has then
    pub from: f64,   // [s]
    pub until: f64,
}

#[derive(Clone, Copy, Debug)]
pub struct Ringing {
    pub unknown: usize,
    pub t: f64,
    pub size: f64,  // half of what lies between neighbouring points
    pub share: f64, // of the unknown's largest value in the run
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    pub damped: Option<Mode>,
    pub late: Option<Mode>,
    pub ringing: Option<Ringing>,
    pub open: Option<(usize, f64)>, // closure row and its residual
    pub second: Option<usize>,      // unknown that follows from the second derivative of a source
    pub stiff: f64,                 // share of the steps that stability limited
}

pub struct Monitor {
    watched: Vec<usize>,
    unseen: u64, // steps so far that are not worth a look
    idle: u64,
    stride: u32,
    taken: u64,
    m: usize,
    times: Vec<f64>,
    formulas: Vec<usize>,           // of the steps that ended there
    samples: Vec<f64>,              // by unknown, then time
    steps: Vec<(f64, usize)>,       // ends and formulas of all steps of the burst, sampled or not
    drifts: Vec<(f64, (f64, f64))>, // frequencies, and what the steps of the burst do to them
    pieces: usize,                  // of a step, with a sample at the end of each
    inside: Vec<f64>,
    stretch: Stretch,
    tracks: Vec<Track>,
    rung: Vec<(f64, f64)>, // size and time of ringing
    report: Report,
    drives: Drives,
    looks: (u64, u64), // bursts, those in which stability limited the steps
    loops: Vec<usize>, // closure rows of a run without projection
    // the cost
    maxsteps: f64,
    span: f64,
    tmax: f64,
    began: Stopwatch,
    mark: f64,
    over: u64,
    pace: f64, // steps a second when `over` began
}

impl Monitor {
    pub fn new(sys: &System, o: &Options, span: f64, tmax: f64) -> Monitor {
        let fixed = sys.alone();
        let kinds = |i: &usize| !sys.unknowns[*i].kind.enters_linearly() && !fixed[*i];
        let watched: Vec<usize> = (0..sys.n).filter(kinds).take(MOST).collect();
        let loops = (0..sys.n).filter(|&i| sys.unknowns[i].kind.enters_linearly() && !sys.has_q[i]);
        let loops = if o.projection { Vec::new() } else { loops.collect() };
        Monitor {
            unseen: 0,
            idle: 0,
            stride: 1,
            taken: 0,
            m: 0,
            times: vec![0.0; BURST],
            formulas: vec![0; BURST],
            samples: vec![0.0; BURST * watched.len()],
            steps: Vec::new(),
            drifts: Vec::new(),
            pieces: 1,
            inside: Vec::new(),
            stretch: Stretch::default(),
            tracks: vec![Track::default(); watched.len()],
            rung: vec![(0.0, 0.0); watched.len()],
            report: Report::default(),
            drives: Drives::new(sys),
            looks: (0, 0),
            loops,
            maxsteps: if o.fixed_step.is_some() { f64::INFINITY } else { o.maxsteps },
            span,
            tmax,
            began: Stopwatch::start(),
            mark: 0.0,
            over: 0,
            pace: 0.0,
            watched,
        }
    }

    /// An accepted step ended at (t, x).
    #[inline]
    pub fn step(&mut self, t: f64, x: &[f64], method: &dyn Method, tol: &Tolerances) {
        if self.m > 0 {
            self.steps.push((t, method.formula()));
        } else if self.unseen < method.character().faithful {
            self.unseen += 1;
            return;
        }
        if self.idle > 0 {
            self.idle -= 1;
        } else {
            self.sample(t, x, method, tol);
        }
    }

    fn sample(&mut self, t: f64, x: &[f64], method: &dyn Method, tol: &Tolerances) {
        if self.m == 0 {
            self.steps.clear();
            self.steps.push((t, method.formula()));
            self.pieces = if self.stride == 1 { method.character().pieces } else { 1 };
        } else if self.pieces > 1 {
            // a long step hides half a period
            let start = self.times[self.m - 1];
            self.inside.resize(x.len(), 0.0);
            let mut inside = std::mem::take(&mut self.inside);
            for k in 1..self.pieces {
                let at = start + (t - start) * k as f64 / self.pieces as f64;
                method.dense(at, &mut inside);
                self.put(at, &inside, method.formula());
            }
            self.inside = inside;
        }
        self.put(t, x, method.formula());
        self.idle = u64::from(self.stride) - 1;
        if self.m + self.pieces.max(2) > BURST {
            self.finish(method, tol);
        }
    }

    fn put(&mut self, t: f64, x: &[f64], formula: usize) {
        self.drives.sample(self.m == 0, t, x);
        (self.times[self.m], self.formulas[self.m]) = (t, formula);
        for (k, &i) in self.watched.iter().enumerate() {
            self.samples[k * BURST + self.m] = x[i];
        }
        self.m += 1;
    }

    /// Steps between two samples.
    fn per_sample(&self) -> f64 {
        f64::from(self.stride) / self.pieces as f64
    }

    /// The solution jumps or restarts here: what lies behind is one piece.
    pub fn cut(&mut self, method: &dyn Method, tol: &Tolerances) {
        if self.m >= LEAST {
            self.finish(method, tol);
        } else {
            self.m = 0;
        }
    }

    fn finish(&mut self, method: &dyn Method, tol: &Tolerances) {
        self.looks.0 += 1;
        self.looks.1 += u64::from(matches!(method.limit(), Limit::Stability(by) if by >= 1.0));
        let m = self.m;
        self.drifts.clear();
        self.drives.finish();
        self.stretch.begin(&self.times[..m]);
        let keeps = method.response(method.formula(), 1e9).is_some_and(|r| r.abs() > 0.99);
        for k in 0..self.watched.len() {
            let unknown = self.watched[k];
            let worth = (WORTH.min(tol.reltol) * tol.peak[unknown]).max(10.0 * tol.atol[unknown]);
            let x = &self.samples[k * BURST..k * BURST + m];
            let [low, high] = extremes(x);
            if high - low < worth {
                self.end(k);
                continue;
            }
            if keeps && self.stride == 1 && self.pieces == 1 {
                self.rings(k);
            }
            self.follow(k, method, worth, (0.5 * (low + high), tol.peak[unknown]));
        }
        let burst = (m as f64 * self.per_sample()) as u64;
        let pause = (self.taken / 4).clamp(PAUSE.0, PAUSE.1);
        self.taken += burst + pause;
        self.idle = pause;
        // a long burst in a short run would be all of it
        let turn = STRIDES.iter().position(|&s| s == self.stride).unwrap_or(0);
        let next = STRIDES[(turn + 1) % STRIDES.len()];
        self.stride = if u64::from(next) * BURST as u64 > self.taken { STRIDES[0] } else { next };
        self.m = 0;
    }

    /// Second differences that change sign at every step, `RUN` times and more, and do not shrink.
    fn rings(&mut self, k: usize) {
        const RUN: usize = 8; // by chance so many changes of sign are one in 2^8
        let x = &self.samples[k * BURST..k * BURST + self.m];
        let (mut run, mut before, mut size) = (0, 0.0, 0.0_f64);
        for j in 1..self.m - 1 {
            let now = x[j + 1] - 2.0 * x[j] + x[j - 1];
            let alternates = now * before < 0.0 && now.abs() > 0.5 * before.abs();
            (run, before) = (if alternates { run + 1 } else { 0 }, now);
            if run >= RUN {
                size = size.max(now.abs() / 4.0);
            }
        }
        // judged at the end, when it is known how large the unknown has been
        if size > self.rung[k].0 {
            self.rung[k] = (size, self.times[0]);
        }
    }

    /// Loss and lateness of this burst's steps, a second; asked once of unknowns that oscillate together.
    fn rates(&mut self, w: f64, method: &dyn Method) -> Option<(f64, f64)> {
        if let Some(&(_, rates)) = self.drifts.iter().find(|(known, _)| (known / w - 1.0).abs() < TOGETHER) {
            return Some(rates);
        }
        let rates = self.by_steps(w, method).or_else(|| self.by_formulas(w, method))?;
        self.drifts.push((w, rates));
        Some(rates)
    }

    /// By the steps themselves, where the method can tell; of many steps, every so many.
    fn by_steps(&self, w: f64, method: &dyn Method) -> Option<(f64, f64)> {
        let (mut loss, mut late, mut span) = (0.0, 0.0, 0.0);
        let mut times = [0.0; 8];
        for k in (1..self.steps.len()).step_by((self.steps.len() / SAMPLED).max(1)) {
            let (t, formula) = self.steps[k];
            for (at, (t, _)) in times.iter_mut().zip(self.steps[..=k].iter().rev()) {
                *at = *t;
            }
            let known = times.len().min(k + 1);
            let Some(own) = method.drift(formula, &times[..known], w) else {
                if known == times.len() {
                    return None;
                }
                continue;
            };
            let h = t - self.steps[k - 1].0;
            (loss, late, span) = (loss + h * own.0, late + h * own.1, span + h);
        }
        (span > 0.0).then(|| (loss / span, late / (std::f64::consts::TAU * span)))
    }

    /// The same of methods of one step: each formula at the mean length of its steps, times what unequal
    /// ones make of a figure that grows as h^p, the mean of (h_j/h)^p, with p from its values at y and 1.1 y.
    fn by_formulas(&self, w: f64, method: &dyn Method) -> Option<(f64, f64)> {
        let m = self.m;
        let mut rates = (0.0, 0.0);
        let mut done: [usize; 16] = [usize::MAX; 16];
        for first in 1..m {
            let formula = self.formulas[first];
            if done.contains(&formula) {
                continue;
            }
            let free = done.iter().position(|&f| f == usize::MAX)?;
            done[free] = formula;
            let mine =
                || (first..m).filter(|&j| self.formulas[j] == formula).map(|j| self.times[j] - self.times[j - 1]);
            let (n, sum) = mine().fold((0.0, 0.0), |(n, sum), h| (n + 1.0, sum + h));
            let (mean, steps) = (sum / n, n * self.per_sample());
            let y = w * mean / self.per_sample();
            let one = response::of(method.response(formula, y)?, y);
            let more = response::of(method.response(formula, 1.1 * y)?, 1.1 * y);
            let uneven = |at: f64, beyond: f64| {
                let p = (beyond / at).ln() / 1.1_f64.ln();
                let usual = p > 0.0 && p < 20.0;
                at * if usual { mine().map(|h| (h / mean).powf(p)).sum::<f64>() / n } else { 1.0 }
            };
            rates.0 += steps * uneven(one.0, more.0);
            rates.1 += steps * uneven(one.1, more.1);
        }
        let span = self.times[m - 1] - self.times[0];
        Some((rates.0 / span, rates.1 / (std::f64::consts::TAU * span)))
    }

    fn follow(&mut self, k: usize, method: &dyn Method, worth: f64, (level, peak): (f64, f64)) {
        let m = self.m;
        let (start, stop) = (self.times[0], self.times[m - 1]);
        let x = &self.samples[k * BURST..k * BURST + m];
        let Some(seen) = self.stretch.oscillation(x, level).filter(|s| s.amplitude > worth) else {
            if self.stride == 1 {
                self.tracks[k].quick = 0.0;
            }
            // not to be seen where it was: gone, or no longer what it was
            if self.tracks[k].stride == self.stride {
                self.end(k);
            }
            return;
        };
        let h = (stop - start) / ((m - 1) as f64 * self.per_sample());
        let period = std::f64::consts::TAU / seen.w;
        let track = &self.tracks[k];
        if self.stride == 1 || (track.quick == 0.0 && self.stride < 16) {
            self.tracks[k].quick = period;
        } else if track.quick > 0.0 && track.quick < 0.7 * period {
            return; // its alias
        }
        let Some(rates) = self.rates(seen.w, method) else { return };
        let now = 0.5 * (start + stop);
        // another mode, or the same but newly excited
        let track = &self.tracks[k];
        let half = 0.5 * (stop - start);
        if track.bursts > 0
            && ((track.w / seen.w - 1.0).abs() > 0.15
                || seen.amplitude > 1.15 * track.last.1
                || track.excited(now, seen.amplitude, (seen.fell, half)))
        {
            self.end(k);
        }
        let track = &mut self.tracks[k];
        if track.bursts == 0 {
            let quick = track.quick;
            let (first, edge) = ((now, seen.amplitude), half);
            *track = Track {
                first,
                last: first,
                coarsest: f64::MAX,
                quick,
                edge,
                share: seen.amplitude / peak,
                began: seen.w,
                ..Track::default()
            };
        } else {
            let dt = now - track.last.0;
            let loss = 0.5 * (track.rates.0 + rates.0) * dt;
            track.loss += loss;
            track.apart += ((track.last.1 / seen.amplitude).ln() - loss).abs();
            track.late += 0.5 * (track.rates.1 + rates.1) * dt;
            track.cycles += dt / period;
            track.shift += (0.5 * (track.w + seen.w) - track.began) * dt / std::f64::consts::TAU;
            track.last = (now, seen.amplitude);
            let sum = track.sum(0.0);
            if sum.damped() > track.damped.damped() {
                track.damped = sum;
            }
            if sum.delayed() > track.delayed.delayed() {
                track.delayed = sum;
            }
        }
        track.bursts += 1;
        let harmonic = self.drives.harmonic(period);
        track.driven += u32::from(harmonic.is_some());
        track.forced += u32::from(harmonic == Some(1));
        (track.w, track.rates, track.stride) = (seen.w, rates, self.stride);
        track.coarsest = track.coarsest.min(period / h);
        track.burst = (seen.fell, half);
        let predicted = rates.0 * half;
        track.within = (track.within.0 + seen.fell, track.within.1 + predicted + FITTED);
        track.halves += half;
        if half > 0.5 * track.lately.1 {
            track.lately = (seen.fell, half);
        }
        track.seen |= predicted > FITTED && alike(seen.fell, predicted);
    }

    /// The mode of an unknown is gone, or another: what was added up is reported if it is the most so far.
    fn end(&mut self, k: usize) {
        let unknown = self.watched[k];
        let track = std::mem::take(&mut self.tracks[k]);
        if track.bursts == 0 {
            return;
        }
        let until = track.last.0;
        self.consider(unknown, &track, until);
    }

    fn consider(&mut self, unknown: usize, track: &Track, until: f64) {
        let period = std::f64::consts::TAU / track.w;
        // it is taken to last until it would have been looked at again
        let unseen = (3 * PAUSE.1 + 21 * BURST as u64) as f64 * period / track.coarsest;
        let rest = (until - track.last.0).min(unseen);
        let fell = (track.first.1 / track.last.1).ln();
        let rest = rest + track.edge;
        let end = track.sum(rest);
        let [driven, forced] = [track.driven, track.forced].map(|n| 2 * n >= track.bursts);
        let decays = track.decays();
        // in the long run it must have fallen as a whole; the first bursts can be all there is
        // what falls faster within the bursts is excited anew between them, and falls by itself
        let own = track.within.0 > OWN * track.within.1;
        let whole = track.bursts > 1
            && track.loss > 0.005
            && alike(fell, track.loss)
            && track.apart < APART * track.loss
            && !own;
        let seen = whole || (track.seen && track.bursts < 4 && !own);
        let damped = if decays && !driven {
            [track.damped, end].into_iter().max_by(|a, b| a.damped().total_cmp(&b.damped())).unwrap_or(end)
        } else if seen && !decays && !forced {
            // the steps between the bursts may have been others: what was seen is what counts
            let scale = if track.bursts > 1 { fell / track.loss.max(1e-12) } else { 1.0 };
            Sum { loss: scale * end.loss, left: 1.0, ..end }
        } else {
            Sum::default()
        };
        let mode = Mode {
            unknown,
            period,
            share: track.share,
            steps: track.coarsest,
            loss: 1.0 - (-damped.loss).exp(),
            late: damped.late,
            cycles: damped.cycles,
            left: damped.left,
            from: track.first.0 - track.edge,
            until: damped.until,
        };
        if mode.left * mode.share * mode.loss > self.report.damped.map_or(0.0, |m| m.left * m.share * m.loss) {
            self.report.damped = Some(mode);
        }
        // an oscillation that dies by itself takes its lateness with it
        let late = if track.delayed.delayed() > end.delayed() { track.delayed } else { end };
        let mode = Mode { loss: 0.0, late: late.late, cycles: late.cycles, left: late.left, until: late.until, ..mode };
        let worth = |m: &Mode| (m.left * m.share * m.late).abs();
        // a period that changes with the amplitude makes up for it, or for much more
        let steady = track.shift.abs() < (0.5 * track.late.abs()).max(UNSTEADY);
        if !driven && steady && worth(&mode) > self.report.late.as_ref().map_or(0.0, worth) {
            self.report.late = Some(mode);
        }
    }

    /// At the end of the run, at (t, x).
    pub fn report(
        &mut self,
        sys: &System,
        w: &mut Work,
        run: (f64, &[f64]),
        method: &dyn Method,
        tol: &Tolerances,
    ) -> Report {
        let (t, x) = run;
        if self.m >= LEAST {
            self.finish(method, tol);
        }
        for k in 0..self.watched.len() {
            let track = std::mem::take(&mut self.tracks[k]);
            if track.bursts > 0 {
                self.consider(self.watched[k], &track, t);
            }
        }
        for (&unknown, &(size, t)) in self.watched.iter().zip(&self.rung) {
            let share = size / tol.peak[unknown].max(1e-300);
            if size > 100.0 * tol.atol[unknown] && share > self.report.ringing.map_or(RINGS, |r| r.share) {
                self.report.ringing = Some(Ringing { unknown, t, size, share });
            }
        }
        if !self.loops.is_empty() {
            sys.eval(w, x, t);
            let open = self.loops.iter().map(|&i| (i, w.f[i].abs())).max_by(|a, b| a.1.total_cmp(&b.1));
            self.report.open = open.filter(|o| o.1.is_finite());
        }
        self.report.second = sys.second_slope();
        self.report.stiff = self.looks.1 as f64 / self.looks.0.max(1) as f64;
        self.report
    }

    /// Called with the number of attempts now and then: why the run is not worth going on with.
    pub fn cost(&mut self, count: u64, t: f64, h: f64, tol: &Tolerances) -> Option<Failure> {
        if count % LOOK != 0 {
            return None;
        }
        let rate = LOOK as f64 / (t - self.mark).max(1e-300);
        self.mark = t;
        let steps = count as f64 + rate * (self.span - t);
        // who asks for short steps gets them
        if steps < self.maxsteps || h >= 0.9 * self.tmax {
            self.over = 0;
            return None;
        }
        // what dies lets the steps grow: begin to count anew
        if self.over == 0 || rate < 0.7 * self.pace {
            (self.over, self.pace) = (0, rate);
        }
        self.over += LOOK;
        if self.over < PATIENT {
            return None;
        }
        let active = (0..self.watched.len()).filter(|&k| self.tracks[k].bursts > 0);
        let fastest = active.max_by(|&a, &b| self.tracks[a].w.total_cmp(&self.tracks[b].w));
        let mut mode = None;
        if let Some(k) = fastest {
            let (unknown, track) = (self.watched[k], &self.tracks[k]);
            let (dt, fell) = (track.last.0 - track.first.0, (track.first.1 / track.last.1).ln());
            let own = fell - track.loss;
            if own > 0.02 && own > track.loss && own > SLOWEST * track.cycles {
                let floor = tol.reltol * 0.02 * tol.peak[unknown] + tol.atol[unknown];
                let dies = (track.last.1 / floor).max(1.0).ln() * dt / own;
                if count as f64 + rate * dies < self.maxsteps {
                    return None;
                }
            }
            let period = std::f64::consts::TAU / track.w;
            mode = Some((unknown, period, track.coarsest));
        }
        let seconds = self.began.seconds() / count as f64 * steps;
        Some(Failure::TooLong { steps, seconds, mode })
    }
}
