//! Impacts: what approaches where it touches, with what rubs there, until nothing does.
use super::lcp::{self, Bounds, Solution};
use super::{faces, law_at, put_relay, with, Event, Look, Modes, Point, AGREE, LOADS, ROUNDS, TOUCHES};
use crate::model::Form;
use crate::rounding::SAME;
use crate::system::{Kind, Reading, System, Work};

/// With which acceleration parts fall back on each other, the others held by what they lie on.
struct Falls {
    look: Look,
    change: Vec<f64>, // of the flows
    at: Vec<usize>,   // those that touch
    lies: Vec<bool>,  // of them
    h: f64,
    found: Vec<Option<f64>>,
}

impl Falls {
    fn of(&mut self, law: usize) -> f64 {
        let Some(k) = law_at(&self.at, Some(law)) else { return 0.0 };
        *self.found[k].get_or_insert_with(|| {
            let most: Vec<f64> = self
                .lies
                .iter()
                .enumerate()
                .map(|(j, &lies)| if j != k && lies { f64::INFINITY } else { 0.0 })
                .collect();
            let held = lcp::solve(&self.look.a, &self.change, &Bounds::new(vec![0.0; most.len()], most));
            -held.map_or(self.change[k], |held| held.w[k]) / self.h
        })
    }
}

/// Does a rebound rise so little that it is none?
fn is_none(rebound: f64, fall: f64, gap: f64) -> bool {
    // a rebound that rises less than two thresholds of its gap is none
    fall > 0.0 && rebound * rebound < 2.0 * fall * 2.0 * gap
}

/// Those that take part in one round.
struct Struck {
    which: Vec<usize>,
    /// of them: the flow with which they come, do they approach, what part of the compression their expansion is
    flows: Vec<f64>,
    approach: Vec<bool>,
    restitution: Vec<f64>,
    bounds: Bounds,
}

impl Modes {
    /// Impacts, until nothing approaches.
    pub(super) fn strike(&mut self, e: &Event, p: &mut Point) -> Option<()> {
        let (sys, list) = (e.sys, e.list());
        let mut falls: Option<Falls> = None;
        let mut rounds = 0;
        let faces: Vec<bool> = list.iter().map(|law| faces(p.w, law)).collect();
        for round in 0..2 * ROUNDS {
            let readings = p.readings(sys);
            let near = |k: usize| match list[k].form {
                Form::Relay | Form::Bond => false,
                Form::OneWay => true,
                Form::Corner => faces[k] && (readings[k].gap <= TOUCHES * e.gaps[k] || round == 0 && e.hit(k)),
            };
            let approaches = |k: usize| near(k) && readings[k].flow < -e.moves[k];
            if !(0..list.len()).any(approaches) {
                return Some(());
            }
            let together = round >= ROUNDS;
            let strikes = |k: usize| {
                let rests = near(k) && readings[k].flow <= e.moves[k] && (list[k].restitution == 0.0 || together);
                approaches(k) || rests
            };
            let which: Vec<usize> =
                (0..list.len()).filter(|&k| strikes(list[k].normal.map_or(k, |normal| normal.law))).collect();
            let_go(e, p.w, |k| which.contains(&k));
            if falls.is_none() {
                let lies = |j: usize| readings[j].flow <= e.moves[j];
                let at = (0..list.len()).filter(|&j| near(j)).map(|j| (j, lies(j))).unzip();
                falls = Some(self.falls(e, p, &readings, at)?);
            }
            let falls = falls.as_mut()?;
            let rebounds = |k: usize| {
                let fall = if list[k].restitution > 0.0 { falls.of(k) } else { 0.0 };
                let rebound = list[k].restitution * readings[k].flow.abs();
                let none = is_none(rebound, fall, e.gaps[k]) || together || list[k].form == Form::OneWay;
                if none {
                    0.0
                } else {
                    list[k].restitution
                }
            };
            let struck = Struck {
                flows: which.iter().map(|&k| readings[k].flow).collect(),
                approach: which.iter().map(|&k| approaches(k)).collect(),
                restitution: which.iter().copied().map(rebounds).collect(),
                bounds: pushes(e, &which),
                which,
            };
            self.blow(e, p, struck, &mut rounds)?;
        }
        Some(())
    }

    /// One round: compression, expansion, and what they leave.
    fn blow(&mut self, e: &Event, p: &mut Point, mut struck: Struck, rounds: &mut u32) -> Option<()> {
        let list = e.list();
        let (look, came, press) = self.compress(e, p, &struck, rounds)?;
        for (i, _) in struck.which.iter().enumerate().filter(|&(_, &k)| list[k].form != Form::Relay) {
            struck.bounds.lo[i] = struck.restitution[i] * press.f[i];
        }
        let back = lcp::solve(&look.a, &press.w, &struck.bounds)?;
        let (f, after) = expanded(&came, &press, &back);
        self.push(e, p, &struck.which, (&look, &f, &after), e.short.instant);
        for (&k, _) in struck.which.iter().zip(&struck.approach).filter(|(_, &approaches)| approaches) {
            p.w.flags[list[k].hits()] += 1.0;
        }
        p.go(e.sys, &look.at(&f), e.short.instant);
        Some(())
    }

    /// The step, the flows with which the struck come, and the compression, with friction by the loads that it makes.
    fn compress(
        &mut self,
        e: &Event,
        p: &mut Point,
        struck: &Struck,
        rounds: &mut u32,
    ) -> Option<(Look, Vec<f64>, Solution)> {
        let (m, instant) = (struck.which.len(), e.short.instant);
        // what rebounds does so by the speed at which it came: forces have the instant to themselves
        let own = |i: usize| struck.approach[i] && struck.restitution[i] > 0.0;
        let mut around: Option<(Look, Vec<f64>)> = None;
        loop {
            let from = around.as_ref().map(|(look, f)| (look, &f[..]));
            let look = self.look_from(e, p, instant, &struck.which, from)?;
            let moves = |i: usize| look.a[i * m + i].abs() > f64::MIN_POSITIVE;
            self.blocked = (0..m).find(|&i| struck.approach[i] && !moves(i)).map(|i| struck.which[i]);
            if self.blocked.is_some() {
                return None;
            }
            let came: Vec<f64> = (0..m).map(|i| if own(i) { struck.flows[i] } else { look.b[i] }).collect();
            let press = lcp::solve(&look.a, &came, &struck.bounds)?;
            *rounds += 1;
            if *rounds >= LOADS || rubs_by_load(e.sys, p.w, &look.at(&press.f), p.t + instant, &struck.which) {
                return Some((look, came, press));
            }
            around = Some((look, press.f));
        }
    }

    /// Falls of all corners from p, those that lie on each other held.
    fn falls(
        &mut self,
        e: &Event,
        p: &mut Point,
        readings: &[Reading],
        (at, lies): (Vec<usize>, Vec<bool>),
    ) -> Option<Falls> {
        let h = e.short.ahead;
        let look = self.look(e, p, h, &at)?;
        let change = look.b.iter().zip(&at).map(|(b, &k)| b - readings[k].flow).collect();
        let found = vec![None; at.len()];
        Some(Falls { look, change, at, lies, h, found })
    }

    /// Corners that part from each other by less than a rebound that is none: what others gave them, so that they would fall back at
    /// once. Were they let go, what holds them to each other again would lift them, and so on for ever.
    pub(super) fn rests(
        &mut self,
        e: &Event,
        p: &mut Point,
        readings: &[Reading],
        touches: &[bool],
    ) -> Option<Vec<bool>> {
        let list = e.list();
        let parts = |k: usize| list[k].form == Form::Corner && touches[k] && readings[k].flow > e.moves[k];
        let mut rests = vec![false; list.len()];
        if !(0..list.len()).any(parts) {
            return Some(rests);
        }
        let_go(e, p.w, |_| false);
        let lies = |j: usize| readings[j].flow <= e.moves[j];
        let at = (0..list.len()).filter(|&j| touches[j]).map(|j| (j, lies(j))).unzip();
        let mut falls = self.falls(e, p, readings, at)?;
        for k in (0..list.len()).filter(|&k| parts(k)) {
            rests[k] = is_none(readings[k].flow, falls.of(k), e.gaps[k]);
        }
        // of two at nearly one place the least difference would be held by impulses that are large and opposite
        let (at, a, m) = (&falls.at, &falls.look.a, falls.at.len());
        let most: Vec<f64> = (0..m).map(|i| if falls.lies[i] || rests[at[i]] { f64::INFINITY } else { 0.0 }).collect();
        let flows: Vec<f64> = at.iter().map(|&k| readings[k].flow).collect();
        let held = lcp::solve(a, &flows, &Bounds::new(most.iter().map(|f| -f).collect(), most))?;
        let largest = (0..m).filter(|&i| rests[at[i]]).map(|i| flows[i]).fold(0.0, f64::max);
        (0..m).for_each(|i| rests[at[i]] &= (held.f[i] * a[i * m + i]).abs() <= 10.0 * largest);
        Some(rests)
    }

    /// Books a step of length h from p in which the corners and freewheels among `which` gave impulses: these, and the energy that they took together, shared
    /// among those that took.
    pub(super) fn push(
        &mut self,
        e: &Event,
        p: &mut Point,
        which: &[usize],
        (look, f, after): (&Look, &[f64], &[f64]),
        h: f64,
    ) {
        let list = e.list();
        // with what rubs there
        let mut lost = vec![0.0; list.len()];
        for (i, &k) in which.iter().enumerate() {
            let of = list[k].normal.map_or(k, |normal| normal.law);
            if list[of].form != Form::Relay {
                lost[of] -= 0.5 * h * f[i] * (look.b[i] + after[i]);
            }
        }
        let whole = lost.iter().sum::<f64>().max(0.0);
        let taken = lost.iter().map(|lost| lost.max(0.0)).sum::<f64>();
        for (i, &k) in which.iter().enumerate().filter(|&(_, &k)| list[k].form != Form::Relay) {
            let share = if taken > 0.0 { lost[k].max(0.0) / taken } else { 0.0 };
            p.w.flags[list[k].impulse()] += f[i] * h;
            p.w.flags[list[k].lost()] += share * whole;
        }
        let mut mean = look.at(f);
        for ((mean, before), unknown) in mean.iter_mut().zip(&*p.x).zip(&e.sys.unknowns) {
            if unknown.kind == Kind::Speed {
                *mean = 0.5 * (*mean + before);
            }
        }
        self.jolts.push((p.t + h, h, mean));
    }
}

/// Corners and freewheels are open; relays that stick, and `others`, are without friction.
pub(super) fn let_go(e: &Event, w: &mut Work, others: impl Fn(usize) -> bool) {
    for (k, law) in e.list().iter().enumerate() {
        match law.form {
            Form::Relay if w.flags[law.slides()] == 0.0 || others(k) => put_relay(e.sys, w, law, true, 0.0, 0.0),
            Form::Relay | Form::Bond => {}
            _ => e.sys.put_mode(w, law.closed(), 0.0),
        }
    }
}

/// Bounds of the compression: what strikes pushes, with friction in proportion.
fn pushes(e: &Event, struck: &[usize]) -> Bounds {
    let list = e.list();
    let most = |k: usize| if list[k].form == Form::Relay { 0.0 } else { f64::INFINITY };
    let mut bounds = Bounds::new(vec![0.0; struck.len()], struck.iter().map(|&k| most(k)).collect());
    for (i, &k) in struck.iter().enumerate() {
        bounds.with[i] = with(struck, list[k].normal, |normal| normal.mu);
        bounds.pair[i] = law_at(struck, list[k].across);
    }
    bounds
}

/// Efforts and flows behind the expansion `back` that follows the compression `press` of flows b: as much of it as does not raise the
/// energy.
fn expanded(b: &[f64], press: &lcp::Solution, back: &lcp::Solution) -> (Vec<f64>, Vec<f64>) {
    let change: Vec<f64> = back.w.iter().zip(&press.w).map(|(after, before)| after - before).collect();
    let both: Vec<f64> = b.iter().zip(&press.w).map(|(b, w)| b + w).collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // twice the work of press + s back
    let (none, some, square) =
        (product(&press.f, &both), product(&press.f, &change) + product(&back.f, &both), product(&back.f, &change));
    let size = none.abs() + some.abs() + square.abs();
    let part = if none + some + square <= SAME * size {
        1.0
    } else {
        ((-some + (some * some - 4.0 * none * square).max(0.0).sqrt()) / (2.0 * square)).clamp(0.0, 1.0)
    };
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + part * b).collect();
    (sum(&press.f, &back.f), sum(&press.w, &change))
}

/// Do relays that slide beside those struck do so with what they are loaded with at x?
fn rubs_by_load(sys: &System, w: &mut Work, x: &[f64], t: f64, struck: &[usize]) -> bool {
    let (readings, _) = sys.read_laws(w, x, t);
    sys.laws.list.iter().zip(&readings).enumerate().all(|(k, (law, at))| {
        let slides = law.form == Form::Relay && w.flags[law.slides()] != 0.0 && w.flags[law.shown()] != 0.0;
        let own = law.normal.is_none() && law.across.is_none() && !struck.contains(&k);
        !(slides && own) || (x[law.row] + w.flags[law.side()] * at.bound).abs() <= AGREE * at.bound
    })
}
