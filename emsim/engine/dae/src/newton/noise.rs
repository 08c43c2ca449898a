//! What rounding does to the unknowns of a stage.
use crate::system::{System, Work};

/// Of a charge, times what the differences of error estimates make of it.
const ROUNDING: f64 = 4e-15;

/// What the rounding of the charges does to the unknowns when it is divided by the step, and that of what the equations add up:
/// a shorter step has more of it. A volt on a capacitor is known to 1e-16; a picosecond's current is not, and what two floating
/// capacitors have in common hangs on that. Nor is the current through 20 mOhm under 12 V, to 1e-13 A: an inductor behind it
/// makes volts of these in a femtosecond.
pub struct Noise {
    pub of: Vec<f64>,
    uneven: Vec<f64>,
    mixed: Vec<f64>, // the same, of other signs
}

/// Roundings are not in proportion to what is rounded: charges themselves are what the inverse takes to x, and to next to nothing of
/// a current of picoamperes beside one of 30 mA in the other winding. (That of a diode that blocks was then off by 3e-4 V from update
/// to update, of which 1e-13 was known, and no step was short enough.) From 1/2 to 1, neighbours far apart.
fn uneven(i: usize) -> f64 {
    0.5 + 0.5 * (i as f64 * 0.618_033_988_749_894_9).fract()
}

impl Noise {
    pub fn new(n: usize) -> Noise {
        Noise { of: vec![0.0; n], uneven: (0..n).map(uneven).collect(), mixed: Vec::new() }
    }

    /// At x with the charges `q` and a = 1/h; `solve` is (G + a C)^-1. Of what is added up, not of what it comes to: a current that
    /// makes a small part of a winding's flux is known to the rounding of the magnet's.
    pub fn find(&mut self, sys: &System, (w, a): (&Work, f64), at: [&[f64]; 2], mut solve: impl FnMut(&mut [f64])) {
        sys.sizes(w, a, at, &mut self.of);
        for (b, uneven) in self.of.iter_mut().zip(&self.uneven) {
            *b = if b.is_finite() { ROUNDING * uneven * *b } else { 0.0 };
        }
        // roundings of either sign: one pattern alone may be what the inverse takes to next to nothing, as momenta to speeds
        let mixed = self.of.iter().enumerate().map(|(i, b)| if i.count_ones() % 2 == 0 { *b } else { -b });
        self.mixed.clear();
        self.mixed.extend(mixed);
        solve(&mut self.of);
        solve(&mut self.mixed);
        for (noise, mixed) in self.of.iter_mut().zip(&self.mixed) {
            *noise = noise.abs().max(mixed.abs());
        }
    }
}
