//! Functions of the mathematical library: arguments in xmm0 and xmm1, the result in xmm0.
use super::super::Op;
use super::x86::{Place, Writer, MASK, ZERO};
use crate::graph::Fun;

extern "sysv64" fn exponential(a: f64) -> f64 {
    a.exp()
}
extern "sysv64" fn power(a: f64, b: f64) -> f64 {
    a.powf(b)
}
extern "sysv64" fn integer_power(a: f64, n: i32) -> f64 {
    a.powi(n)
}
extern "sysv64" fn arctangent(a: f64, b: f64) -> f64 {
    a.atan2(b)
}
extern "sysv64" fn apply(f: *const Fun, a: f64) -> f64 {
    // SAFETY: `Native` keeps the functions that its code names
    unsafe { (*f).apply(a) }
}

impl Writer<'_> {
    /// Instruction k as a call.
    pub fn function(&mut self, k: usize) {
        let i = self.part.code[k];
        let function = match i.op {
            Op::Exp => {
                self.arguments(k, i.a, None);
                exponential as *const ()
            }
            Op::Call => {
                self.arguments(k, i.a, None);
                self.out.extend([0x48, 0xbf]); // mov rdi, function
                let address = &self.functions[i.b as usize] as *const Fun as u64;
                self.out.extend(address.to_le_bytes());
                apply as *const ()
            }
            Op::Powi => {
                self.arguments(k, i.a, None);
                self.out.push(0xbf); // mov edi, n
                self.out.extend(i.b.to_le_bytes());
                integer_power as *const ()
            }
            _ => {
                self.arguments(k, i.a, Some(i.b));
                if matches!(i.op, Op::Pow) {
                    power as *const ()
                } else {
                    arctangent as *const ()
                }
            }
        };
        self.call(function as u64);
        self.returned(k);
    }

    /// Arguments to their places; everything that is needed later to the workspace.
    fn arguments(&mut self, k: usize, a: u32, b: Option<u32>) {
        let (pa, pb) = (self.place(a), b.map(|b| self.place(b)));
        self.release(k);
        self.save_all();
        // by way of the scratch registers, since xmm0 may hold the second argument
        self.copy(ZERO, pa);
        if let Some(pb) = pb {
            self.copy(MASK, pb);
            self.copy(1, Place::Register(MASK));
        }
        self.copy(0, Place::Register(ZERO));
    }
}
