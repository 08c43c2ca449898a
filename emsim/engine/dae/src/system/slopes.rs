//! What needs the second derivative of a source: ddt(ddt()) of a node that a source fixes, or a capacitor across a source whose
//! current fixes the voltage of another one. Every method has the first derivative right, from the values of one step and the
//! next; the second is a difference of differences, and one of a step's errors over its length.
use super::System;
use crate::model::Kind;

/// How often a source has been differentiated for an unknown: nobody knows, or nothing of it changes.
const UNKNOWN: i32 = i32::MAX;
const STILL: i32 = i32::MIN / 2;

impl System {
    /// An unknown that follows from a source's second derivative, row by row: each row in which all is known but one
    /// unknown gives that one, and a row with d/dt gives it from slopes.
    pub fn second_slope(&self) -> Option<usize> {
        *self.made.second.get_or_init(|| self.find_second_slope().or(self.twice_bent))
    }

    fn find_second_slope(&self) -> Option<usize> {
        let (mut plain, mut slopes) = (vec![Vec::new(); self.n], vec![Vec::new(); self.n]);
        let mut readers = vec![Vec::new(); self.n];
        let mut expression = vec![[false; 2]; self.pattern.rowidx.len()];
        for (slots, which) in [(&self.expressions.g_slots, 0), (&self.expressions.c_slots, 1)] {
            slots.iter().for_each(|&k| expression[k][which] = true);
        }
        for slope in &self.devices.slopes {
            for (k, _) in slope.stamps() {
                expression[k][0] = true;
                expression[k][1] |= slope.capacitance.is_some();
            }
        }
        for c in 0..self.n {
            for k in self.pattern.colptr[c]..self.pattern.colptr[c + 1] {
                let r = self.pattern.rowidx[k];
                let reads = [self.constant.g[k] != 0.0, self.constant.c[k] != 0.0];
                if reads[0] || expression[k][0] {
                    plain[r].push(c);
                }
                if reads[1] || expression[k][1] {
                    slopes[r].push(c);
                }
                readers[c].push(r);
            }
        }
        // what time itself does in a row
        let mut own = vec![STILL; self.n];
        for &r in &self.expressions.f_rows {
            own[r] = 0;
        }
        for &(r, k, _) in &self.constant.f_wave {
            if !self.waves[k].still() {
                own[r] = own[r].max(i32::from(self.slopes.iter().any(|s| s.1 == k)));
            }
        }
        let mut order = vec![UNKNOWN; self.n];
        let mut first = None;
        let mut rows: Vec<usize> = (0..self.n).collect();
        while let Some(r) = rows.pop() {
            let mut open = plain[r].iter().filter(|&&c| order[c] == UNKNOWN);
            let (Some(&c), None) = (open.next(), open.next()) else { continue };
            if slopes[r].iter().any(|&c| order[c] == UNKNOWN) {
                continue;
            }
            let values = plain[r].iter().filter(|&&k| k != c).map(|&k| order[k]);
            let found = values.chain(slopes[r].iter().map(|&k| order[k] + 1)).fold(own[r], i32::max);
            if found > 1 {
                first = Some(c);
                // what reads a ddt() has a name in the deck
                if self.unknowns[c].kind != Kind::Derivative {
                    break;
                }
            }
            order[c] = found;
            rows.extend(&readers[c]);
        }
        first
    }
}
