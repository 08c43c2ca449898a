//! Seconds that pass on the wall; none in a browser, whose modules have no clock of their own.
#[cfg(not(target_family = "wasm"))]
use std::time::Instant;

pub struct Stopwatch {
    #[cfg(not(target_family = "wasm"))]
    began: Instant,
}

impl Stopwatch {
    pub fn start() -> Stopwatch {
        Stopwatch {
            #[cfg(not(target_family = "wasm"))]
            began: Instant::now(),
        }
    }

    pub fn seconds(&self) -> f64 {
        #[cfg(not(target_family = "wasm"))]
        return self.began.elapsed().as_secs_f64();
        #[cfg(target_family = "wasm")]
        0.0
    }
}
