//! Which modes follow an event: which laws are in question, what has died, and what a step a little later says.
use super::lcp::{self, Bounds, Solution};
use super::{faces, law_at, put_relay, shown, towards, with, Event, Look, Modes, Point, AGREE, LATE, LOADS, TOUCHES};
use crate::model::{around, Form, LawSpec};
use crate::rounding::SAME;
use crate::system::{Reading, System, Work};

/// The laws in question.
pub(super) struct Asked {
    pub which: Vec<usize>,
    /// of all laws, where they are asked
    readings: Vec<Reading>,
    /// to which side relays slid
    sides: Vec<f64>,
    /// corners that would fall back at once
    rests: Vec<bool>,
}

/// What a step a little later has found.
pub(super) struct Next {
    pub asked: Vec<usize>,
    pub look: Look,
    pub solution: Solution,
    /// relays that go, and which way
    goes: Vec<Option<f64>>,
    /// at its end
    readings: Vec<Reading>,
    pub ahead: f64,
    /// no finite force kept a touch sliding
    pub jams: bool,
}

impl Modes {
    /// Those in question are free, the others in their modes.
    pub(super) fn free(&mut self, e: &Event, p: &mut Point) -> Option<Asked> {
        let (sys, list) = (e.sys, e.list());
        let readings = p.readings(sys);
        let touches: Vec<bool> = (0..list.len())
            .map(|k| {
                let closed = list[k].opens() && p.w.flags[list[k].closed()] != 0.0;
                let near = list[k].form == Form::Corner && readings[k].gap <= TOUCHES * e.gaps[k];
                // one that has come past the end of its edge touches no more
                list[k].form == Form::OneWay || (closed || near) && faces(p.w, &list[k])
            })
            .collect();
        let rests = self.rests(e, p, &readings, &touches)?;
        let w = &mut *p.w;
        // (of a corner another flag is in its place, which nothing reads)
        let sides: Vec<f64> = list.iter().map(|law| law.flags.get(1).map_or(0.0, |&flag| w.flags[flag])).collect();
        let mut asked = Vec::new();
        for (k, law) in list.iter().enumerate() {
            let flow = readings[k].flow;
            if law.form != Form::Relay {
                if law.opens() {
                    sys.put_mode(w, law.closed(), 0.0);
                }
                if touches[k] && (flow <= e.moves[k] || rests[k]) {
                    asked.push(k);
                }
                continue;
            }
            if law.normal.is_some_and(|normal| !asked.contains(&normal.law)) {
                put_relay(sys, w, law, true, 0.0, 0.0);
                continue;
            }
            let [slid, side, seen] = [law.slides(), law.side(), law.shown()].map(|flag| w.flags[flag]);
            let (speed, to) = towards(list, &readings, k);
            // of the speed, along the direction of the last event
            let (along, real) = match law.across {
                None => (flow * side, side.abs() == 1.0),
                Some(_) => (around(list, k).map(|k| readings[k].flow * sides[k]).sum(), seen != 0.0),
            };
            let returns = e.hit(k) && slid != 0.0 && real && along <= -0.5 * speed;
            if speed > e.moves[k] && !returns {
                let turned =
                    // a direction whose part along that of the last event is so large is noted no more
                    if law.across.is_some() { along < 0.75 * speed || !real } else { [side, seen] != [to, to] };
                if slid != 1.0 || turned {
                    put_relay(sys, w, law, true, to, shown(law, to, true));
                }
            } else {
                put_relay(sys, w, law, true, 0.0, 0.0);
                asked.push(k);
            }
        }
        Some(Asked { which: asked, readings, sides, rests })
    }

    /// What has died is made exactly 0. `before`: as it was at the event; `since`: the time since the last one.
    pub(super) fn stop(
        &mut self,
        e: &Event,
        p: &mut Point,
        asked: &Asked,
        before: &[Reading],
        since: f64,
    ) -> Option<()> {
        let (list, short, which) = (e.list(), e.short, &asked.which);
        // what holds a corner that parts by too little pulls, and would drive on what slides there
        let held = p.w.held();
        let driven = |k: &usize| list[*k].normal.is_some_and(|n| asked.rests[n.law]) && !which.contains(k);
        (0..list.len()).filter(driven).for_each(|k| put_relay(e.sys, p.w, &list[k], true, 0.0, 0.0));
        let look = self.look(e, p, short.instant, which);
        p.w.restore(&held);
        let look = look?;
        let recent = if since < short.step { since } else { 0.0 };
        let mut turns = false;
        let all: Vec<usize> = (0..which.len()).collect();
        let own = lcp::independent(&look.a, all.len(), &all, AGREE, &|i| list[which[i]].form != Form::Relay);
        let mut free: Vec<f64> = all.iter().map(|i| if own.contains(i) { f64::INFINITY } else { 0.0 }).collect();
        let stopped = loop {
            let least: Vec<f64> = free.iter().map(|f| -f).collect();
            let solution = lcp::solve(&look.a, &look.b, &Bounds::new(least, free.clone()))?;
            let mut dies = true;
            for (i, &k) in which.iter().enumerate().filter(|&(_, &k)| list[k].form == Form::Relay) {
                // (what a touch presses with is part of the solution)
                let at = if list[k].normal.is_some() { &before[k] } else { &asked.readings[k] };
                let stick = at.stick.max(at.bound);
                let turned = list[k].across.is_some() && towards(list, &asked.readings, k).0 <= e.moves[k];
                let late = if turned { short.late.max(recent) } else { short.late };
                if free[i] > 0.0 && self.lives(e, p, asked, &solution, i, (stick, late)) {
                    (free[i], dies) = (0.0, false);
                    turns |= turned;
                    around(list, k).filter_map(|k| law_at(which, Some(k))).for_each(|j| free[j] = 0.0);
                }
            }
            if dies {
                break solution;
            }
        };
        self.turns = if since >= short.step { 0 } else { self.turns + u32::from(turns) };
        // so often two directions may turn below their threshold, each time within a step of the last, before it is no
        // solution
        if self.turns > 1000 {
            return None;
        }
        p.go(e.sys, &look.at(&stopped.f), short.instant);
        Some(())
    }

    /// Is the flow of a relay, the i-th of those asked, more than friction `stick` can have stopped in the time `late`?
    fn lives(
        &mut self,
        e: &Event,
        p: &mut Point,
        asked: &Asked,
        stopped: &Solution,
        i: usize,
        (stick, late): (f64, f64),
    ) -> bool {
        let (list, k, instant) = (e.list(), asked.which[i], e.short.instant);
        let (flow, side) = (asked.readings[k].flow, asked.sides[k]);
        let own = around(list, k).filter_map(|k| law_at(&asked.which, Some(k)));
        let effort = own.map(|j| stopped.f[j]).fold(0.0, f64::hypot);
        // what stops a corner that would fall back at once goes through the friction there too
        let shares = asked.rests.contains(&true)
            && list[k].normal.is_some_and(|normal| {
                let load = law_at(&asked.which, Some(normal.law)).map_or(0.0, |j| stopped.f[j].abs());
                towards(list, &asked.readings, k).0 <= e.moves[k] && effort <= normal.mus.max(normal.mu) * load
            });
        if shares || !(effort * instant > LATE * late * stick) {
            return false;
        }
        if list[k].across.is_some() || !e.hit(k) || flow * side >= 0.0 || side.abs() != 1.0 {
            return true;
        }
        let passed = self.passed(e, p, asked, i);
        !(effort * instant <= LATE * passed.unwrap_or(0.0) * stick)
    }

    /// How long ago the flow of a relay, the i-th of those asked, went through 0, by the rate at which it slides on to that side: a flow
    /// is seen to turn once it is beyond its threshold, and what would have held it since then makes it 0.
    fn passed(&mut self, e: &Event, p: &mut Point, asked: &Asked, i: usize) -> Option<f64> {
        let (list, which, h) = (e.list(), &asked.which, e.short.ahead);
        let (at, side) = (&asked.readings[which[i]], asked.sides[which[i]]);
        let look = self.look(e, p, h, which)?;
        let mut bounds = bounds(list, &asked.readings, which);
        match list[which[i]].normal {
            Some(normal) => {
                let slides = -side * normal.mu;
                bounds.with[i] = with(which, Some(normal), |_| 0.0).map(|(of, ..)| (of, slides, slides));
            }
            None => (bounds.lo[i], bounds.hi[i]) = (-side * at.bound, -side * at.bound),
        }
        let solution = lcp::solve(&look.a, &look.b, &bounds)?;
        let rate = (solution.w[i] - at.flow) / h;
        (rate * at.flow > 0.0).then(|| at.flow / rate)
    }

    /// A little later, `longer` times as far as usual: what goes and what holds.
    pub(super) fn follow(&mut self, e: &Event, p: &mut Point, mut asked: Vec<usize>, longer: f64) -> Option<Next> {
        let (sys, list) = (e.sys, e.list());
        let mut readings = p.readings(sys);
        let mut ahead = e.short.ahead * longer;
        let mut jams = false;
        loop {
            let look = self.look(e, p, ahead, &asked)?;
            // where an effort moves things against itself the step is longer than what is unstable there takes
            let m = asked.len();
            // no shorter than a hundred instants
            if ahead > 100.0 * e.short.instant && (0..m).any(|i| look.a[i * m + i] < 0.0) {
                ahead *= 0.1;
                continue;
            }
            if let Some((solution, goes)) = follows(sys, p.w, &look, &mut readings, &asked, p.t + ahead) {
                let presses = |i: &usize| list[asked[*i]].form == Form::Corner && solution.f[*i] > 0.0;
                let carry: Vec<usize> = (0..m).filter(presses).collect();
                let spare: Vec<usize> =
                    lcp::spare(&look.a, m, &carry, &solution.f).into_iter().map(|i| asked[i]).collect();
                // any places that are enough would do, but none is to pull
                if !spare.is_empty() {
                    asked.retain(|&k| !spare.contains(&list[k].normal.map_or(k, |normal| normal.law)));
                    continue;
                }
                return Some(Next { asked, look, solution, goes, readings, ahead, jams });
            }
            // whatever slides where parts touch may stop
            let slides = |k: &usize| {
                let touches = list[*k].normal.is_some_and(|normal| asked.contains(&normal.law));
                touches && !asked.contains(k)
            };
            let more: Vec<usize> = (0..list.len()).filter(slides).collect();
            if more.is_empty() {
                return None;
            }
            for &k in &more {
                put_relay(sys, p.w, &list[k], true, 0.0, 0.0);
                if around(list, k).all(|other| other >= k) {
                    self.jammed.push((p.t, k));
                }
            }
            (asked, jams) = ([asked, more].concat(), true);
        }
    }
}

impl Next {
    /// The modes of those that were asked; those lock that are independent by more than `least`.
    pub fn put(&self, e: &Event, w: &mut Work, least: f64) {
        let (sys, list, m) = (e.sys, e.list(), self.asked.len());
        let (solution, goes) = (&self.solution, &self.goes);
        // what lies beyond its threshold without a load would ask again and again while nothing parts it
        let lies = |i: usize, k: usize| {
            let beyond = list[k].form == Form::Corner && self.readings[k].gap < -0.5 * e.gaps[k];
            beyond && solution.w[i] <= e.moves[k]
        };
        let locks: Vec<usize> = (0..m)
            .filter(|&i| match list[self.asked[i]].form {
                Form::Relay => goes[i].is_none() && !solution.bound[i],
                _ => solution.f[i] > 0.0 || lies(i, self.asked[i]),
            })
            .collect();
        let locked = lcp::independent(&self.look.a, m, &locks, least, &|i| list[self.asked[i]].form != Form::Relay);
        for (i, &k) in self.asked.iter().enumerate() {
            let (law, f, stick) = (&list[k], solution.f[i], self.readings[k].stick);
            let locked = locked.contains(&i);
            if law.form != Form::Relay {
                sys.put_mode(w, law.closed(), f64::from(u8::from(locked)));
            } else if let Some(to) = goes[i] {
                put_relay(sys, w, law, true, to, shown(law, to, true));
            } else if locked {
                put_relay(sys, w, law, false, 0.0, 0.0);
            } else {
                put_relay(sys, w, law, true, if stick > 0.0 { -f / stick } else { 0.0 }, 0.0);
            }
        }
    }
}

/// Efforts of the laws that are asked, and which of them go and which way; None without a solution. `readings` become those at the end
/// of the step.
fn follows(
    sys: &System,
    w: &mut Work,
    look: &Look,
    readings: &mut Vec<Reading>,
    asked: &[usize],
    end: f64,
) -> Option<(Solution, Vec<Option<f64>>)> {
    for again in 0..LOADS {
        let found = bounded(look, &sys.laws.list, readings, asked)?;
        // friction by a load that depends on the friction: until both agree
        let (after, _) = sys.read_laws(w, &look.at(&found.0.f), end);
        let agree = |a: f64, b: f64| (a - b).abs() <= AGREE * a.abs().max(b.abs());
        let settled = asked
            .iter()
            .filter(|&&k| sys.laws.list[k].normal.is_none())
            .all(|&k| agree(after[k].stick, readings[k].stick) && agree(after[k].bound, readings[k].bound));
        *readings = after;
        if settled || again + 1 == LOADS {
            return Some(found);
        }
    }
    None
}

/// Bounds of the laws that are asked, at rest.
fn bounds(list: &[LawSpec], readings: &[Reading], asked: &[usize]) -> Bounds {
    let own = |k: usize| match list[k].form {
        Form::Relay if list[k].normal.is_some() => (0.0, 0.0),
        Form::Relay => (-readings[k].stick.max(readings[k].bound), readings[k].stick.max(readings[k].bound)),
        _ => (0.0, f64::INFINITY),
    };
    let (lo, hi): (Vec<f64>, Vec<f64>) = asked.iter().map(|&k| own(k)).unzip();
    let mut bounds = Bounds::new(lo, hi);
    for (i, &k) in asked.iter().enumerate() {
        bounds.with[i] = with(asked, list[k].normal, |normal| normal.mus.max(normal.mu));
        bounds.pair[i] = law_at(asked, list[k].across);
    }
    bounds
}

/// The same with bounds as they are known.
fn bounded(
    look: &Look,
    list: &[LawSpec],
    readings: &[Reading],
    asked: &[usize],
) -> Option<(Solution, Vec<Option<f64>>)> {
    let m = asked.len();
    let mut bounds = bounds(list, readings, asked);
    let mut goes: Vec<Option<f64>> = vec![None; m];
    loop {
        let solution = lcp::solve(&look.a, &look.b, &bounds)?;
        let size = |i: usize| look.b[i].abs() + (0..m).map(|j| (look.a[i * m + j] * solution.f[j]).abs()).sum::<f64>();
        let mut more = false;
        for (i, &k) in asked.iter().enumerate().filter(|&(_, &k)| list[k].form == Form::Relay) {
            let (w, pair) = (solution.w[i], bounds.pair[i]);
            let speed = bounds.around(i).map(|j| solution.w[j]).fold(0.0, f64::hypot);
            let least = SAME * bounds.around(i).map(size).fold(0.0, f64::max);
            if goes[i].is_none() && speed > least && solution.bound[i] {
                (goes[i], more) = (Some(w / speed), true);
                // with two directions it goes the way of its flow, at the edge of what it slides with
                let mu = list[k].normal.map_or(0.0, |normal| normal.mu);
                let (low, high) = if pair.is_some() { (-1.0, 1.0) } else { (-w.signum(), -w.signum()) };
                if let Some((of, ..)) = bounds.with[i] {
                    bounds.with[i] = Some((of, low * mu, high * mu));
                } else {
                    (bounds.lo[i], bounds.hi[i]) = (low * readings[k].bound, high * readings[k].bound);
                }
            } else if goes[i].is_some() && pair.is_some() && speed > 0.0 {
                goes[i] = Some(w / speed);
            }
        }
        if !more {
            return Some((solution, goes));
        }
    }
}
