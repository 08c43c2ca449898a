//! Functions of the mathematical library: arguments in xmm0 and xmm1, the result in xmm0.
use super::super::{sin_cos, Op};
use super::x86::{Base, Place, Writer, F2, MASK, ZERO};
use crate::graph::Fun;
use crate::lanes::{self, V};

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

// the same of four numbers, which the results replace
/// # Safety
/// The processor has AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
unsafe extern "sysv64" fn exponential_of_four(at: *mut [f64; 4]) {
    let v = &mut *at;
    // (what lies beyond the reach of the quick one, and what is no number)
    if v.iter().all(|v| v.abs() <= 700.0) {
        *v = lanes::exp(V::load(v)).store();
    } else {
        v.iter_mut().for_each(|v| *v = v.exp());
    }
}
extern "sysv64" fn power_of_four(at: *mut [f64; 4], by: *const [f64; 4]) {
    // SAFETY: the code passes places of its workspace, here and below
    let (at, by) = unsafe { (&mut *at, &*by) };
    at.iter_mut().zip(by).for_each(|(a, b)| *a = a.powf(*b));
}
extern "sysv64" fn arctangent_of_four(at: *mut [f64; 4], by: *const [f64; 4]) {
    let (at, by) = unsafe { (&mut *at, &*by) };
    at.iter_mut().zip(by).for_each(|(a, b)| *a = a.atan2(*b));
}
extern "sysv64" fn integer_power_of_four(at: *mut [f64; 4], n: i32) {
    unsafe { &mut *at }.iter_mut().for_each(|a| *a = a.powi(n));
}
extern "sysv64" fn sine_of_four(at: *mut [f64; 4]) {
    unsafe { &mut *at }.iter_mut().for_each(|a| *a = sin_cos(*a).0);
}
extern "sysv64" fn cosine_of_four(at: *mut [f64; 4]) {
    unsafe { &mut *at }.iter_mut().for_each(|a| *a = sin_cos(*a).1);
}
extern "sysv64" fn apply_to_four(at: *mut [f64; 4], f: *const Fun) {
    // SAFETY: `Native` keeps the functions that its code names
    let (at, f) = unsafe { (&mut *at, *f) };
    at.iter_mut().for_each(|a| *a = f.apply(*a));
}

pub const RDI: u8 = 7; // number of the register of the first argument (System V ABI)
const RSI: u8 = 6; // of the second

impl Writer<'_> {
    /// Instruction k as a call on four numbers, which lie in the workspace meanwhile.
    pub fn function_of_four(&mut self, k: usize) {
        let i = self.part.code[k];
        let b = matches!(i.op, Op::Pow | Op::Atan2).then_some(i.b);
        let (pa, pb) = (self.place(i.a), b.map(|b| self.place(b)));
        self.release(k);
        self.save_all();
        let to = self.settle(k);
        let Place::Memory { index, .. } = to else { unreachable!("a place in memory") };
        self.copy(ZERO, pa);
        self.vex(0x11, F2, 1, ZERO, 0, to);
        self.address(RDI, index);
        if let Some(pb) = pb {
            let second = *self.second.get_or_insert_with(|| {
                self.length += 1;
                self.length - 1
            });
            self.copy(MASK, pb);
            self.vex(0x11, F2, 1, MASK, 0, Place::Memory { base: Base::Work, index: second });
            self.address(RSI, second);
        }
        let function = match i.op {
            Op::Exp => exponential_of_four as *const (),
            Op::Sin => sine_of_four as *const (),
            Op::Cos => cosine_of_four as *const (),
            Op::Pow => power_of_four as *const (),
            Op::Atan2 => arctangent_of_four as *const (),
            Op::Powi => {
                self.out.push(0xbe); // mov esi, n
                self.out.extend(i.b.to_le_bytes());
                integer_power_of_four as *const ()
            }
            _ => {
                self.out.extend([0x48, 0xbe]); // mov rsi, function
                let address = &self.functions[i.b as usize] as *const Fun as u64;
                self.out.extend(address.to_le_bytes());
                apply_to_four as *const ()
            }
        };
        self.out.extend([0xc5, 0xf8, 0x77]); // vzeroupper
        self.call(function as u64);
        self.vex(0x10, F2, 1, 0, 0, to);
        self.returned(k);
    }

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
