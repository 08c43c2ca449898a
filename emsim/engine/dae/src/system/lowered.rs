//! The equations with their hidden constraints put in (hidden.rs): what a run integrates. It starts by the equations as they are, for
//! charges and fluxes that are given need not fit the constraints, and small signals are theirs.
use super::{System, Work};
use crate::floating_groups::Roots;
use crate::graph::Graph;
use crate::hidden::{lowered, twice_bent};
use crate::model::Model;
use crate::sparse::Pairs;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

/// What is compiled: a model with the sums of its groups made.
pub(super) struct Prepared {
    pub model: Model,
    pub groups: [Roots; 2],
    pub floating: Vec<usize>,
    pub pairs: Pairs,
    pub passive: bool,
    pub twice_bent: Option<usize>,
}

impl Prepared {
    /// The same with a lower index; None where nothing is hidden.
    pub fn lowered(&self, g: &mut Graph) -> Mutex<Option<Box<Prepared>>> {
        let made = lowered(&self.model, g).map(|(model, relations)| {
            let mut pairs = self.pairs.clone();
            // rows that were replaced are other sums
            let replaced: BTreeSet<usize> = relations.iter().map(|r| r.row).collect();
            pairs.retain(|(row, _), _| !replaced.contains(row));
            let (groups, floating) = (self.groups.clone(), self.floating.clone());
            let twice_bent = twice_bent(&model, g);
            Box::new(Prepared { model, groups, floating, pairs, passive: false, twice_bent })
        });
        Mutex::new(made)
    }
}

impl System {
    /// What a run is to integrate: the equations of a lower index, compiled, or these. The first to ask gets them.
    pub fn integrable(self: &Arc<System>, g: &mut Graph) -> Result<Arc<System>, String> {
        let laid_by = self.made.lowered.lock().map_err(|_| "a run of these equations broke off")?.take();
        let Some(prepared) = laid_by else { return Ok(self.clone()) };
        let mut system = System::finish(*prepared, g)?;
        system.whole = Some(self.clone());
        Ok(Arc::new(system))
    }
}

impl Work {
    /// The start that was found by the equations as they were: conditions and what is held with them.
    pub fn start_as(&mut self, whole: &Work) {
        self.flags.copy_from_slice(&whole.flags);
        self.standing = whole.standing.clone();
        self.ports.copy_from_slice(&whole.ports);
        self.logic = whole.logic.clone();
        self.clocked = whole.clocked.clone();
        (self.gmin, self.doubts.hanging, self.doubts.unstable) =
            (whole.gmin, whole.doubts.hanging, whole.doubts.unstable);
        self.wave_time = f64::NAN;
        self.counters.add(&whole.counters);
    }
}
