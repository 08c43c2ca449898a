//! Loops over numbers that are compiled twice: for any processor, and for one with registers of four numbers (AVX2), between
//! which the running one decides. The operations and their order are the same, hence every bit.

/// Defines a function so.
macro_rules! twice {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$meta])*
        #[inline]
        $vis fn $name($($arg: $type),*) $(-> $result)? {
            #[inline(always)]
            fn plain($($arg: $type),*) $(-> $result)? $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                unsafe fn wide($($arg: $type),*) $(-> $result)? {
                    plain($($arg),*)
                }
                if $crate::tape::vectors() {
                    // SAFETY: the processor has what is asked for
                    return unsafe { wide($($arg),*) };
                }
            }
            plain($($arg),*)
        }
    };
}

pub(crate) use twice;

/// Numbers that go through the registers together.
pub const LANES: usize = 4;

/// Where the blocks of `LANES` begin in which n numbers are looked at, n being `LANES` at least: the last one reaches back, and sees
/// some of them twice.
#[inline(always)]
pub fn blocks(n: usize) -> impl Iterator<Item = usize> {
    (0..n).step_by(LANES).map(move |first| first.min(n - LANES))
}

/// The block of `v` that begins there.
#[inline(always)]
pub fn block(v: &[f64], first: usize) -> [f64; LANES] {
    v[first..first + LANES].try_into().expect("so many")
}
