//! Where values lie while a program runs: in registers, or at a place in the workspace.
//!
//! Registers are given out in one pass. Where none is free, the value whose next use is furthest away goes to memory
//! (Belady 1966), to a place that another value has left: a program of thousands of instructions works in a few lines of the
//! cache.
use super::super::Op;
use super::x86::{Base, Place, Writer, F2, NEVER, VALUES};
use super::NOWHERE;

impl Writer<'_> {
    pub fn own(&self, slot: u32) -> Option<usize> {
        (slot as usize).checked_sub(self.part.first)
    }

    /// The instruction that reads the value of own instruction k next.
    pub fn next_use(&self, k: usize) -> Option<u32> {
        let (next, end) = self.ahead[k];
        (next < end).then(|| self.uses[next as usize])
    }

    /// Where a value can be read.
    pub fn place(&self, slot: u32) -> Place {
        if let Some(k) = self.own(slot) {
            if (self.register[k] as usize) < VALUES {
                return Place::Register(self.register[k]);
            }
            if self.at[k] == NOWHERE {
                // a leaf that was never copied
                let i = &self.part.code[k];
                return match i.op {
                    Op::X => Place::Memory { base: Base::Unknowns, index: i.a },
                    Op::Wave => Place::Memory { base: Base::Waves, index: i.a },
                    Op::Flag => Place::Memory { base: Base::Flags, index: i.a },
                    _ => Place::Memory { base: Base::Time, index: 0 },
                };
            }
            return Place::Memory { base: Base::Work, index: self.at[k] };
        }
        Place::Memory { base: Base::Work, index: self.part.homes[slot as usize] }
    }

    /// A place in memory for the result of k: where others look for it, or any that is free.
    pub fn settle(&mut self, k: usize) -> Place {
        if self.at[k] == NOWHERE {
            self.at[k] = match self.part.homes[self.part.first + k] {
                NOWHERE => self.left.pop().unwrap_or_else(|| {
                    self.length += 1;
                    self.length - 1
                }),
                home => home,
            };
        }
        Place::Memory { base: Base::Work, index: self.at[k] }
    }

    /// Nobody needs the value of k any more: its place is free, though not before the present instruction is written.
    fn vacate(&mut self, k: usize) {
        let slot = (self.part.first + k) as u32;
        if self.at[k] != NOWHERE
            && self.part.homes[slot as usize] == NOWHERE
            && !self.results_of(slot).any(|i| !self.results[i])
        {
            self.leaving.push(std::mem::replace(&mut self.at[k], NOWHERE));
        }
    }

    /// The results that this slot is.
    fn results_of(&self, slot: u32) -> impl Iterator<Item = usize> + '_ {
        let first = self.wanted.partition_point(|w| w.0 < slot);
        self.wanted[first..].iter().take_while(move |w| w.0 == slot).map(|w| w.1 as usize)
    }

    /// A free register, never one of `held`; another value goes to the workspace for it if need be.
    fn free(&mut self, held: &[u8]) -> u8 {
        if let Some(r) = (0..VALUES).find(|&r| self.holds[r].is_none() && !held.contains(&(r as u8))) {
            return r as u8;
        }
        let next = |r: usize| {
            let slot = self.holds[r].expect("all are taken");
            self.own(slot).and_then(|k| self.next_use(k)).unwrap_or(NEVER)
        };
        let r = (0..VALUES).filter(|&r| !held.contains(&(r as u8))).max_by_key(|&r| next(r)).unwrap_or(0);
        self.evict(r);
        r as u8
    }

    pub fn evict(&mut self, r: usize) {
        let Some(slot) = self.holds[r].take() else { return };
        if let Some(k) = self.own(slot) {
            self.save(k);
            self.register[k] = VALUES as u8;
        }
    }

    /// To the workspace, where it is needed later and not yet there.
    fn save(&mut self, k: usize) {
        let leaf = matches!(self.part.code[k].op, Op::X | Op::Wave | Op::Flag | Op::T);
        if self.at[k] == NOWHERE && !leaf && self.next_use(k).is_some() {
            self.store(k);
        }
    }

    fn store(&mut self, k: usize) {
        let to = self.settle(k);
        self.vex(0x11, F2, 1, self.register[k], 0, to);
    }

    /// The value in a register: where it is, or loaded.
    pub fn load(&mut self, slot: u32, held: &[u8]) -> u8 {
        let place = self.place(slot);
        if let Place::Register(r) = place {
            return r;
        }
        let r = self.free(held);
        self.vex(0x10, F2, 1, r, 0, place);
        if let Some(k) = self.own(slot) {
            self.holds[r as usize] = Some(slot);
            self.register[k] = r;
        }
        r
    }

    /// An operand has been read by instruction k: registers whose value nobody needs become free.
    pub fn release(&mut self, k: usize) {
        for slot in self.part.code[k].operands() {
            if let Some(j) = self.own(slot) {
                while self.next_use(j).is_some_and(|u| u <= k as u32) {
                    self.ahead[j].0 += 1;
                }
                if self.next_use(j).is_none() {
                    self.clear(j);
                    self.vacate(j);
                }
            }
        }
    }

    /// A register for the result of k.
    pub fn result(&mut self, k: usize, held: &[u8]) -> u8 {
        let r = self.free(held);
        self.holds[r as usize] = Some((self.part.first + k) as u32);
        self.register[k] = r;
        r
    }

    /// The result is in its register: to the workspace as well if others want it.
    pub fn done(&mut self, k: usize) {
        let slot = (self.part.first + k) as u32;
        if self.part.homes[slot as usize] != NOWHERE {
            self.store(k);
        }
        let results: Vec<usize> = self.results_of(slot).collect();
        for i in results {
            self.vex(0x11, F2, 1, self.register[k], 0, Place::Memory { base: Base::Results, index: i as u32 });
            self.results[i] = true;
        }
        if self.next_use(k).is_none() {
            self.clear(k);
        }
    }

    /// The register of k holds nothing any more.
    fn clear(&mut self, k: usize) {
        if let Some(holds) = self.holds.get_mut(self.register[k] as usize) {
            *holds = None;
            self.register[k] = VALUES as u8;
        }
    }

    /// The register of a result: that of operand a, if it is free now, else any but `held`.
    pub fn target(&mut self, k: usize, ra: u8, held: &[u8]) -> u8 {
        if self.holds[ra as usize].is_none() {
            self.holds[ra as usize] = Some((self.part.first + k) as u32);
            self.register[k] = ra;
            return ra;
        }
        self.result(k, held)
    }

    /// Everything that is needed later to the workspace; all registers are free then.
    pub fn save_all(&mut self) {
        for r in 0..VALUES {
            if let Some(j) = self.holds[r].and_then(|slot| self.own(slot)) {
                self.save(j);
            }
        }
        for r in 0..VALUES {
            if let Some(j) = self.holds[r].take().and_then(|slot| self.own(slot)) {
                self.register[j] = VALUES as u8;
            }
        }
    }
}
