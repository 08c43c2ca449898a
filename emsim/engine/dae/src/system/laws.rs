//! Laws with modes (Coulomb friction, rigid stops, freewheels): what they read, compiled. Which mode each is in stands in its flags,
//! by which the rows of its unknowns are chosen; who decides them is modes.rs.
use super::{System, Work};
use crate::derive::gradient;
use crate::graph::{Graph, Id, Node};
use crate::model::{around, Form, LawSpec};
use crate::tape::{Inputs, Tape};

/// The laws of a system: per law flow, bound, sticking bound, gap and which edge it is to, then the slopes of flows.
pub struct Laws {
    pub list: Vec<LawSpec>,
    tape: Tape,
    slopes: Vec<(usize, usize)>, // law and unknown
}

/// What a law reads at a point. Of a corner the flow is the rate of its gap.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    pub flow: f64,
    pub bound: f64,
    pub stick: f64,
    pub gap: f64,
    /// of a corner to one of several edges
    pub which: f64,
}

impl Laws {
    pub fn new(g: &mut Graph, list: Vec<LawSpec>) -> Laws {
        let which = |l: &LawSpec| l.feature.map_or(l.gap, |feature| feature.which);
        let mut outs: Vec<Id> = list.iter().flat_map(|l| [l.flow, l.bound, l.stick, l.gap, which(l)]).collect();
        let mut slopes = Vec::new();
        for (k, law) in list.iter().enumerate() {
            let read: Vec<Id> =
                g.reachable(&[law.flow]).into_iter().filter(|&id| matches!(g.node(id), Node::Unknown(_))).collect();
            for (&leaf, slope) in read.iter().zip(gradient(g, law.flow, &read)) {
                if let (Node::Unknown(i), true) = (g.node(leaf), g.value(slope) != Some(0.0)) {
                    slopes.push((k, i as usize));
                    outs.push(slope);
                }
            }
        }
        Laws { tape: Tape::new(g, &outs), list, slopes }
    }
}

impl Laws {
    /// (law, unknown) of everything that its flow reads.
    pub fn flows(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.slopes.iter().copied()
    }

    /// Is it the row of a law?
    pub fn has_row(&self, row: usize) -> bool {
        self.list.iter().any(|law| law.row == row)
    }
}

impl System {
    pub fn has_laws(&self) -> bool {
        !self.laws.list.is_empty()
    }

    /// What every law reads at (x, t), and the slopes of flows, (law, unknown, value).
    pub fn read_laws(&self, w: &mut Work, x: &[f64], t: f64) -> (Vec<Reading>, Vec<(usize, usize, f64)>) {
        self.set_time(w, t);
        let mut slots = self.laws.tape.workspace();
        self.laws.tape.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut slots);
        let out = |k: usize| self.laws.tape.output(&slots, k);
        let count = self.laws.list.len();
        let readings = (0..count).map(|k| Reading {
            flow: out(5 * k),
            bound: out(5 * k + 1).max(0.0),
            stick: out(5 * k + 2).max(0.0),
            gap: out(5 * k + 3),
            which: out(5 * k + 4),
        });
        let slopes = self.laws.slopes.iter().enumerate().map(|(j, &(k, i))| (k, i, out(5 * count + j)));
        (readings.collect(), slopes.collect())
    }

    /// Modes that a point by itself shows: what moves slides, at rest it sticks; a gap that is closed and does not open is closed.
    pub fn show_modes(&self, w: &mut Work, x: &[f64], t: f64) {
        if !self.has_laws() {
            return;
        }
        let (readings, _) = self.read_laws(w, x, t);
        for (k, (law, at)) in self.laws.list.iter().zip(&readings).enumerate() {
            if law.form == Form::Relay {
                let speed = around(&self.laws.list, k).map(|k| readings[k].flow).fold(0.0, f64::hypot);
                let side = if speed == 0.0 { 0.0 } else { at.flow / speed };
                // (where parts touch a point shows it by whether they do)
                let free = law.normal.is_some_and(|normal| w.flags[self.laws.list[normal.law].flags[0]] == 0.0);
                let moves = f64::from(u8::from(speed != 0.0));
                let shown = if law.across.is_some() { moves } else { side };
                let values = [if free { 1.0 } else { moves }, side, shown];
                law.flags.iter().zip(values).for_each(|(&flag, value)| w.flags[flag] = value);
            } else if law.form == Form::Bond {
                w.flags[law.flags[0]] = at.gap;
            } else {
                w.flags[law.flags[0]] = f64::from(u8::from(at.gap <= 0.0 && at.flow <= 0.0));
            }
        }
    }

    /// Puts a flag of a law; it stands on its threshold until it has been clear of it.
    pub fn put_mode(&self, w: &mut Work, flag: usize, value: f64) {
        w.flags[flag] = value;
        w.standing.armed[flag] = false;
    }

    /// How far beyond its threshold a mode is left that has just begun, [off, on].
    pub fn put_mode_bands(&self, w: &mut Work, flag: usize, bands: [f64; 2]) {
        if w.standing.modes.len() != self.flags.len() {
            w.standing.modes = vec![[0.0; 2]; self.flags.len()];
        }
        w.standing.modes[flag] = bands;
    }
}
