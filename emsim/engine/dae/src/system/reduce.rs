//! The equations as an explicit ODE: compiled when a method first asks for it.
use super::System;
use crate::graph::Graph;
use crate::model::Form;
use crate::reduced::{Reduced, Source};

impl System {
    /// Compiles the equations as an explicit ODE, once; for methods that need it.
    pub fn reduce(&self, g: &mut Graph) {
        self.made.reduced.get_or_init(|| {
            if self.laws.list.iter().any(|law| law.form == Form::Corner) {
                return Err("rigid stops hold positions only while they are closed".into());
            }
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
        });
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
