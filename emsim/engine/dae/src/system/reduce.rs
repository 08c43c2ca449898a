//! The equations as an explicit ODE: compiled when a method first asks for it.
use super::System;
use crate::graph::Graph;
use crate::model::Form;
use crate::reduced::{Reduced, Source};

impl System {
    /// Compiles the equations as an explicit ODE, once; for methods that need it.
    pub fn reduce(&self, g: &mut Graph) {
        self.made.reduced.get_or_init(|| match self.laws.list.iter().any(|law| law.form == Form::Corner) {
            true => Err("rigid stops hold positions only while they are closed".into()),
            false => self.explicit(g),
        });
    }

    /// The same for a solver of somebody else's, who knows states and rates alone: what a rigid stop holds is held by its acceleration, so
    /// that a part on it stays at rest, and drifts as far as the solver's rounding takes it.
    pub fn reduce_for_others(&self, g: &mut Graph) -> Result<&Reduced, &str> {
        self.made.reduced.get_or_init(|| match self.twice_bent {
            Some(k) => Err(format!("`{}` has impulses where a source bends", self.unknowns[k].name)),
            None => self.explicit(g),
        });
        self.reduced()
    }

    fn explicit(&self, g: &mut Graph) -> Result<Reduced, String> {
        if !self.delays.list.is_empty() {
            return Err("it reads what was a time ago".into());
        }
        if !self.logic.is_empty() {
            return Err("there are digital nodes".into());
        }
        if self.devices.classes.iter().any(|c| !c.class.is_formula()) {
            return Err("an FMU for model exchange is no formula: implicit methods evaluate it".into());
        }
        if !self.clocked.is_empty() {
            return Err("there are clocks".into());
        }
        let [f, q] = self.expressions.rows.clone();
        let source = Source {
            unknowns: &self.unknowns,
            f,
            q,
            g: self.constant.g_rows.entries().collect(),
            c: self.constant.c_rows.entries().collect(),
            f_wave: &self.constant.f_wave,
            classes: self.devices.classes.iter().map(|c| c.class.clone()).collect(),
            waves: self.waves.len(),
            flags: self.flags.len(),
            laws: &self.laws.list,
        };
        Reduced::compile(g, &source)
    }

    /// What `reduce` made, or why the equations are no explicit ODE.
    pub fn reduced(&self) -> Result<&Reduced, &str> {
        match self.made.reduced.get() {
            Some(Ok(reduced)) => Ok(reduced),
            Some(Err(why)) => Err(why),
            None => Err("its equations were not prepared"),
        }
    }
}
