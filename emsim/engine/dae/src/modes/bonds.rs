//! Bonds: bodies that hold each other until they are let go or break, and that are caught while they move.
//!
//!   held     w = 0 of every row      let go     f = 0
//!
//! All rows of one bond share the flag that says which. What asks for the other one is the card's (cards/latch.py): a condition, or an
//! effort above what the bond stands. What has broken has a flag that stays. What is let go keeps its momenta; what is caught takes an
//! impulse that makes its flows 0 at once, a plastic impact, over which nothing else holds or presses but other bonds: parts that come to
//! approach on account of it strike next (impact.rs).
use super::impact::let_go;
use super::lcp::{self, Bounds};
use super::{Event, Modes, Point};
use crate::model::{Form, LawSpec};

impl LawSpec {
    /// The flag of a bond that has broken.
    fn broken(&self) -> usize {
        self.flags[4]
    }

    /// Do forces alone open and close it?
    pub fn opens(&self) -> bool {
        matches!(self.form, Form::Corner | Form::OneWay)
    }
}

impl Modes {
    /// Bonds that ask, and those whose condition has turned beside, change over.
    pub(super) fn bond(&mut self, e: &Event, p: &mut Point) -> Option<()> {
        let (sys, list) = (e.sys, e.list());
        let of: Vec<usize> = (0..list.len()).filter(|&k| list[k].form == Form::Bond).collect();
        if of.is_empty() {
            return Some(());
        }
        let mut roots = vec![0.0; sys.flags.len()];
        sys.eval_all_roots(p.w, p.x, p.t, &mut roots);
        let readings = p.readings(sys);
        let asks = |flag: &usize| roots[*flag] > 0.0 || e.fired.contains(flag);
        let mut turning: Vec<usize> = of.iter().map(|&k| list[k].closed()).filter(asks).collect();
        turning.dedup();
        let mut caught = Vec::new();
        for flag in turning {
            let rows = of.iter().copied().filter(|&k| list[k].closed() == flag);
            if p.w.flags[flag] == 0.0 {
                caught.extend(rows);
                continue;
            }
            // no condition has let it go
            rows.for_each(|k| p.w.flags[list[k].broken()] = f64::from(u8::from(readings[k].stick < 0.5)));
            sys.put_mode(p.w, flag, 0.0);
        }
        if caught.is_empty() {
            return Some(());
        }
        let_go(e, p.w, |_| false);
        let look = self.look(e, p, e.short.instant, &caught)?;
        let most = vec![f64::INFINITY; caught.len()];
        let least = most.iter().map(|f| -f).collect();
        let pulls = lcp::solve(&look.a, &look.b, &Bounds::new(least, most))?;
        self.push(e, p, &caught, (&look, &pulls.f, &pulls.w), e.short.instant);
        for &k in &caught {
            sys.put_mode(p.w, list[k].closed(), 1.0);
            p.w.flags[list[k].hits()] += 1.0;
        }
        p.go(sys, &look.at(&pulls.f), e.short.instant);
        Some(())
    }
}
