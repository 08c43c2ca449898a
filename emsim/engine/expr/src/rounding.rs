//! What counts as equal where numbers come to the same by different ways.

/// Of what is added up: rounding of a sum of a few dozen numbers.
pub const SUMMED: f64 = 64.0 * f64::EPSILON;
/// Of what something is made of: rounding of an elimination, of a long run's time, of what was computed in stages.
pub const ROUNDED: f64 = 1e-12;
/// Of what is looked at, far above rounding, far below a tolerance: instants that are one, efforts at bounds, rows that depend.
pub const SAME: f64 = 1e-9;
