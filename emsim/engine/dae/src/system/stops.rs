//! Where a run has to stop: flags and their roots, corners of sources, edges that are known.
use super::{Free, System, Work};
use crate::clocked::{Left, Trouble};
use crate::conditions::Scale;
use crate::model::{Kind, Law};
use crate::tape::Inputs;
use crate::waves::Wave;

impl System {
    /// What the flags ask for at (x, t): positive where one is to turn, and continuous, so that its place can be found. Flags
    /// that sources alone decide (edges.rs) ask for nothing here.
    pub fn eval_roots(&self, w: &mut Work, x: &[f64], t: f64, out: &mut [f64]) {
        self.eval_all_roots(w, x, t, out);
        self.mask_timed(w, out);
    }

    /// Flags that sources decide and that are not what these say at t, a time at which none turns.
    pub fn broken_edges(&self, w: &mut Work, t: f64, tell: impl FnMut(usize)) {
        self.edges.broken(&mut w.edges, &mut w.standing, &self.waves, &w.flags, t, tell);
    }

    pub fn is_timed(&self, k: usize) -> bool {
        self.edges.timed[k]
    }

    pub fn mask_timed(&self, w: &Work, out: &mut [f64]) {
        if let Some(k) = w.standing.stuck {
            out[k] = -1.0;
        }
        for (out, &timed) in out.iter_mut().zip(&self.edges.timed) {
            *out = if timed { -1.0 } else { *out };
        }
    }

    /// What is added up in a flag's operand, with quantities as large as they have been.
    pub fn flag_size(&self, w: &Work, k: usize) -> f64 {
        w.standing.size(k)
    }

    /// So near to its threshold nobody knows on which side a flag's operand is, as it starts from rest.
    pub fn flag_unknown(&self, w: &Work, k: usize) -> f64 {
        w.standing.unknown(k)
    }

    /// Floors of flags, for absolute tolerances by unknown.
    pub fn put_floors(&self, w: &mut Work, atol: &[f64]) {
        if self.flags.is_empty() {
            return;
        }
        self.set_time(w, 0.0);
        let moves = |(i, atol): (usize, &f64)| match self.unknowns[i].kind {
            Kind::Coordinate | Kind::Speed => *atol,
            _ => 0.0,
        };
        let least: Vec<f64> = atol.iter().enumerate().map(moves).collect();
        let mut slots = self.conditions.sizes.workspace();
        w.standing.floor.fill(0.0);
        for (sign, x) in [(1.0, least), (-1.0, vec![0.0; self.n])] {
            self.conditions.sizes.run(&Inputs { x: &x, t: 0.0, waves: &w.waves, flags: &w.flags }, &mut slots);
            for (k, floor) in w.standing.floor.iter_mut().enumerate() {
                *floor += sign * self.conditions.sizes.output(&slots, k);
            }
        }
        w.standing.floor.iter_mut().for_each(|floor| *floor = if floor.is_finite() { floor.abs() } else { 0.0 });
    }

    /// How far beyond its threshold a law's mode is left that has just begun.
    pub fn mode_band(&self, w: &Work, k: usize) -> f64 {
        w.standing.mode_band(k, w.flags[k] != 0.0)
    }

    /// What is added up in a flag's operand, with quantities as large as those of x at t.
    pub fn flag_size_at(&self, w: &mut Work, x: &[f64], t: f64, k: usize) -> f64 {
        let mut scale = w.scale.clone();
        if !scale.observe(&self.unknowns, x, t) {
            return self.flag_size(w, k);
        }
        self.set_time(w, t);
        let mut slots = self.conditions.sizes.workspace();
        self.conditions.sizes.run(&Inputs { x: &scale.of, t, waves: &w.waves, flags: &w.flags }, &mut slots);
        self.conditions.sizes.output(&slots, k).max(self.flag_size(w, k))
    }

    pub fn eval_all_roots(&self, w: &mut Work, x: &[f64], t: f64, out: &mut [f64]) {
        if self.flags.is_empty() {
            return;
        }
        self.eval_operands(w, x, t);
        for (k, out) in out.iter_mut().enumerate().take(self.flags.len()) {
            *out = w.standing.asks(k, self.flags[k].law, w.flags[k] != 0.0, self.beyond(w, k));
        }
    }

    /// Free kinks are what they say at x.
    #[inline]
    pub fn turn_free(&self, w: &mut Work, x: &[f64], t: f64) {
        if !w.free.is_empty() {
            self.eval_operands(w, x, t);
            for &k in &w.free {
                w.flags[k] = f64::from(self.conditions.roots.output(&w.programs.roots, 2 * k) > 0.0);
            }
        }
    }

    fn eval_operands(&self, w: &mut Work, x: &[f64], t: f64) {
        self.set_time(w, t);
        self.conditions.roots.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut w.programs.roots);
    }

    /// The operand that turns a flag as it stands.
    pub fn operand(&self, w: &mut Work, x: &[f64], t: f64, k: usize) -> f64 {
        self.eval_operands(w, x, t);
        self.conditions.roots.output(&w.programs.roots, 2 * k + usize::from(w.flags[k] != 0.0))
    }

    /// The operand of a flag, counted towards the flag's other side.
    fn beyond(&self, w: &Work, k: usize) -> f64 {
        match w.flags[k] == 0.0 {
            true => self.conditions.roots.output(&w.programs.roots, 2 * k),
            false => -self.conditions.roots.output(&w.programs.roots, 2 * k + 1),
        }
    }

    /// A step ended with x at t: flags whose operands are clear of their thresholds, and how wide a threshold is.
    pub fn observe_flags(&self, w: &mut Work, x: &[f64], t: f64) {
        if self.flags.is_empty() {
            return;
        }
        self.measure_flags(w, x, t);
        self.eval_operands(w, x, t);
        w.standing.fresh.fill(f64::NAN);
        for k in 0..self.flags.len() {
            let clear = w.standing.clears(k, self.flags[k].law, w.flags[k] != 0.0, self.beyond(w, k));
            w.standing.armed[k] |= clear;
        }
    }

    fn measure_flags(&self, w: &mut Work, x: &[f64], t: f64) {
        if w.scale.observe(&self.unknowns, x, t) {
            self.set_time(w, t);
            let mut slots = self.conditions.sizes.workspace();
            self.conditions.sizes.run(&Inputs { x: &w.scale.of, t, waves: &w.waves, flags: &w.flags }, &mut slots);
            (0..self.flags.len()).for_each(|k| w.standing.widen(k, self.conditions.sizes.output(&slots, k)));
        }
    }

    /// Keeps what memories and histories read in x, which solves the equations, before the flags turn.
    pub fn remember(&self, w: &mut Work, x: &[f64], t: f64) {
        self.write_memories(w, x, t, Law::remembers);
    }

    fn write_memories(&self, w: &mut Work, x: &[f64], t: f64, which: impl Fn(Law) -> bool) {
        if self.flags.iter().any(|f| which(f.law)) {
            self.eval_operands(w, x, t);
            for k in (0..self.flags.len()).filter(|&k| which(self.flags[k].law)) {
                w.flags[k] = self.conditions.roots.output(&w.programs.roots, 2 * k);
            }
        }
    }

    /// The histories of other flags: an operating point that is sought anew is reached from the same past.
    pub fn inherit(&self, w: &mut Work, flags: &[f64]) {
        for k in (0..self.flags.len()).filter(|&k| self.flags[k].law == Law::History) {
            w.flags[k] = flags[k];
        }
    }

    /// Turns a flag.
    pub fn flip(&self, w: &mut Work, k: usize) {
        w.flags[k] = 1.0 - w.flags[k];
        w.clocked.turned(&self.clocked, k);
        w.standing.armed[k] = false;
        w.standing.fresh[k] = self.conditions.roots.output(&w.programs.roots, 2 * k);
    }

    /// Sets every flag as it asks at (x, t), before a run; true when one changed.
    pub fn update_flags(&self, w: &mut Work, x: &[f64], t: f64) -> bool {
        self.follow_flags(w, x, t, Free::All)
    }

    /// The same of those that are free.
    pub fn follow_flags(&self, w: &mut Work, x: &[f64], t: f64, free: Free) -> bool {
        self.remeasure_flags(w, x, t);
        if free == Free::All {
            self.write_memories(w, x, t, |law| law == Law::Memory);
        }
        let turned = self.flip_asking(w, x, t, false, |k, _, _| free.has(&self.flags[k]));
        self.rest_logic(w) || turned
    }

    /// The same for flags that the state decides, during a run: edges flip the others. `one`: only the first that asks, for those
    /// that together find no rest. A flag that has turned at this time already turns back where its operand has jumped since:
    /// one that slides along its threshold moves a little in what the jump takes of time, and is for the next step to find.
    pub fn settle_flags(&self, w: &mut Work, x: &[f64], t: f64, one: bool) -> bool {
        if self.edges.all_timed() {
            return false;
        }
        let fresh = w.standing.fresh.clone();
        // an operand that has moved by less than this part of what is added up in it has not jumped
        let slides = |k: usize, operand: f64, size: f64| (operand - fresh[k]).abs() <= 1e-6 * size;
        self.flip_asking(w, x, t, one, |k, operand, size| !self.edges.timed[k] && !slides(k, operand, size))
    }

    /// The free condition that asks most to turn at (x, t). Kinks are let off `kinks` of what is added up in them: both their sides
    /// agree at the threshold.
    pub fn asking(&self, w: &mut Work, x: &[f64], t: f64, free: Free, kinks: f64) -> Option<usize> {
        self.remeasure_flags(w, x, t);
        let mut r = std::mem::take(&mut w.asked);
        r.resize(self.flags.len(), 0.0);
        self.eval_all_roots(w, x, t, &mut r);
        let asks = |&k: &usize| {
            let (f, let_off) = (&self.flags[k], kinks * w.standing.size(k));
            let kink = f.is_kink();
            free.has(f) && !f.law.of_modes() && r[k] > if kink { let_off } else { 0.0 }
        };
        let most = (0..r.len()).filter(asks).max_by(|&i, &j| r[i].total_cmp(&r[j]));
        w.asked = r;
        most
    }

    /// Turns the first condition that asks for it.
    pub fn turn_first(&self, w: &mut Work, x: &[f64], t: f64) -> bool {
        self.turn_first_of(w, x, t, Free::All)
    }

    /// The same of those that are free.
    pub fn turn_first_of(&self, w: &mut Work, x: &[f64], t: f64, free: Free) -> bool {
        self.remeasure_flags(w, x, t);
        let turned = self.flip_asking(w, x, t, true, |k, _, _| free.has(&self.flags[k]));
        self.rest_logic(w) || turned
    }

    /// Digital nodes follow the flags, before a run; true when one changed.
    fn rest_logic(&self, w: &mut Work) -> bool {
        let changed = !self.logic.is_empty() && w.logic.rest(&self.logic, &w.flags);
        if changed {
            self.touch_sources(w);
        }
        changed
    }

    /// Nothing is remembered: what Newton's method passes through on its way to an operating point is no scale.
    fn remeasure_flags(&self, w: &mut Work, x: &[f64], t: f64) {
        if !self.flags.is_empty() {
            // a switch without hysteresis is on at its threshold, or as its card says: no matter what it was on the way
            for k in (0..self.flags.len()).filter(|&k| self.flags[k].law == Law::Arrival) {
                w.standing.armed[k] = !w.standing.given && w.flags[k] == 0.0;
            }
            w.scale = Scale::default();
            w.standing.band.fill(0.0);
            self.measure_flags(w, x, t);
        }
    }

    fn flip_asking(&self, w: &mut Work, x: &[f64], t: f64, one: bool, asked: impl Fn(usize, f64, f64) -> bool) -> bool {
        if self.flags.is_empty() {
            return false;
        }
        let mut r = std::mem::take(&mut w.asked);
        r.resize(self.flags.len(), 0.0);
        self.eval_all_roots(w, x, t, &mut r);
        let mut changed = false;
        let stuck = w.standing.stuck;
        for k in (0..r.len()).filter(|&k| r[k] > 0.0 && stuck != Some(k) && !self.flags[k].law.of_modes()) {
            if !asked(k, self.conditions.roots.output(&w.programs.roots, 2 * k), w.standing.size(k)) {
                continue;
            }
            if one && changed {
                break;
            }
            self.flip(w, k);
            // clear of the threshold at once, where its operand has jumped
            w.standing.armed[k] = self.beyond(w, k) < -w.standing.band[k];
            changed = true;
        }
        w.asked = r;
        changed
    }

    /// So many rounds of flips at one time find a consistent set of flags, where there is one: one after the other at least.
    pub fn rounds(&self) -> usize {
        20 + 2 * self.flags.len()
    }

    /// Where the integration stops next: a corner of a source that matters, an edge before it, or `tstop`. Until this is asked for again
    /// a source that jumps there has not jumped yet.
    pub fn next_stop(&self, w: &mut Work, t: f64, tstop: f64) -> f64 {
        w.logic.advance(&self.logic, &w.flags, t);
        let corner = self.next_corner(t).min(w.past.next_corner(t)).min(w.logic.next_corner(t));
        let corner = corner.min(w.clocked.next(&self.clocked)).min(tstop);
        let corner = if w.every_corner { corner.min(self.next_silent_corner(t)) } else { corner };
        let stop =
            self.edges.next(&mut w.edges, &mut w.standing, &self.waves, &w.flags, t, corner).map_or(corner, |e| e.t);
        w.before = stop * (1.0 - 8.0 * f64::EPSILON);
        self.touch_sources(w);
        stop
    }

    /// What clocks have due at t happens: they see x and what the sources were just before. True where something was due.
    pub fn tick(&self, w: &mut Work, x: &[f64], t: f64) -> Result<bool, Trouble> {
        if self.clocked.is_empty() || w.clocked.next(&self.clocked) > t * (1.0 + 8.0 * f64::EPSILON) {
            return Ok(false);
        }
        self.set_time(w, t);
        w.clocked.advance(&self.clocked, &Left { x, t, waves: &w.waves, flags: &w.flags })?;
        self.touch_sources(w);
        Ok(true)
    }

    /// Events of FMUs for model exchange at the point that stands. Flags of their indicators are then what these are behind it: a ball that
    /// has bounced is above the floor, were it by the smallest number there is.
    pub fn exchange(&self, w: &mut Work, x: &mut [f64], t: f64) -> Result<(), Trouble> {
        for (k, sign) in w.clocked.exchange(&self.clocked, x, t)? {
            w.flags[k] = f64::from(u8::from(sign > 0.0));
            w.standing.armed[k] = false;
            w.standing.fresh[k] = sign;
        }
        Ok(())
    }

    /// The next corner of a source that only edges read, for the record.
    pub fn next_silent_corner(&self, t: f64) -> f64 {
        let silent = self.waves.iter().zip(&self.edges.silent).filter(|(_, &s)| s);
        silent.map(|(v, _)| v.next_breakpoint(t)).fold(f64::INFINITY, f64::min)
    }

    /// Flips the flags whose edge is at t, or only the first of them; `say` is told each.
    pub fn flip_edges(&self, w: &mut Work, t: f64, one: bool, say: impl FnMut(usize, bool)) {
        self.edges.flip(&mut w.edges, &mut w.flags, &mut w.standing, t, one, say);
    }

    /// Nodes that sources fix, as they are at t: what lies between steps is not read off their polynomials.
    pub fn pin(&self, w: &mut Work, t: f64, x: &mut [f64]) {
        if self.edges.any_silent() {
            self.set_time(w, t);
            self.edges.pin(&mut w.edges, &w.waves, &w.flags, t, x);
        }
    }

    /// Unknowns whose rows between steps are read off a polynomial, and that error tolerances hold for.
    pub fn interpolated(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.n).filter(|&i| !self.unknowns[i].kind.enters_linearly() && !self.edges.pins(i))
    }

    /// Unknowns that stand alone in a row without d/dt, or beside such ones only: a source's node has what the source has, whatever the
    /// method, and so has that of a source on top of it.
    pub fn alone(&self) -> Vec<bool> {
        let mut of_row = vec![(0, 0); self.n]; // of unknowns that are not known to be: how many, and the sum of their numbers
        for k in 0..self.n {
            self.pattern.column(k).iter().for_each(|&r| of_row[r] = (of_row[r].0 + 1, of_row[r].1 + k));
        }
        let mut alone = vec![false; self.n];
        let mut rows: Vec<usize> = (0..self.n).filter(|&r| of_row[r].0 == 1 && !self.has_q[r]).collect();
        while let Some(row) = rows.pop() {
            let (count, k) = of_row[row];
            if count != 1 || alone[k] {
                continue;
            }
            alone[k] = true;
            for &r in self.pattern.column(k) {
                of_row[r] = (of_row[r].0 - 1, of_row[r].1 - k);
                if of_row[r].0 == 1 && !self.has_q[r] {
                    rows.push(r);
                }
            }
        }
        alone
    }

    fn loud(&self) -> impl Iterator<Item = &Wave> {
        self.waves.iter().zip(&self.edges.silent).filter(|(_, &silent)| !silent).map(|(wave, _)| wave)
    }

    fn next_corner(&self, t: f64) -> f64 {
        self.loud().map(|w| w.next_breakpoint(t)).fold(f64::INFINITY, f64::min)
    }

    /// Does a source jump (rather than bend) at t?
    pub fn jumps_at(&self, t: f64) -> bool {
        self.loud().any(|w| {
            let (before, after) = (w.value_before(t), w.value(t));
            (after - before).abs() > 1e-9 * (after.abs() + before.abs())
        })
    }

    /// The end of a ramp that begins at t and is too short to be a step of its own.
    pub fn hidden_corner(&self, t: f64) -> Option<f64> {
        self.loud().filter_map(|w| w.hidden_corner(t)).reduce(f64::max)
    }

    /// Does a ramp begin at t = 0?
    pub fn starts_bending(&self) -> bool {
        let within = |w: &Wave| 0.5 * w.shortest().min(f64::MAX);
        self.loud().any(|w| w.is_piecewise_linear() && w.value(within(w)) != w.value(0.0))
    }

    /// Shortest period of a source.
    pub fn shortest_period(&self) -> f64 {
        self.shortest_period_of(|_| true)
    }

    /// Shortest period of a source without corners, whose steps nothing else places.
    pub fn shortest_swing(&self) -> f64 {
        self.shortest_period_of(|w| !w.is_piecewise_linear())
    }

    fn shortest_period_of(&self, which: impl Fn(&Wave) -> bool) -> f64 {
        let periodic = self.loud().filter(|w| which(w)).filter_map(|w| w.frequency());
        periodic.fold(f64::INFINITY, |least, f| least.min(1.0 / f))
    }

    pub fn shortest_feature(&self) -> f64 {
        self.loud().map(|w| w.shortest()).fold(f64::INFINITY, f64::min)
    }

    /// Tells stretches between stops apart: equal where flags and pieces of the sources are.
    pub fn stretch(&self, w: &Work, t: f64) -> u64 {
        let mix = |h: u64, v: u64| (h ^ v).wrapping_mul(0x0000_0100_0000_01b3);
        let flags = w.flags.iter().fold(0xcbf2_9ce4_8422_2325, |h, &f| mix(h, u64::from(f != 0.0) + 1));
        let flags = w.clocked.levels().fold(flags, |h, on| mix(h, u64::from(on) + 1));
        self.loud().fold(flags, |h, wave| mix(h, wave.piece(t) as u64))
    }
}
