//! Does a smooth function rise above a level and fall again between two places at which it is below? It is read there and, where
//! that cannot tell, at a few places in between.
//!
//! 1. `reaches`: with slopes no steeper than s it rises from a and b to no more than (a + b + s h)/2.
//! 2. `above`: the cubic of values and slopes at both ends says where to look next. What is read there tells how far the cubic is off;
//!    this, times u^2 (1-u)^2, is the leading term of its error all along. Where twice that reaches the level, both parts are asked.
//! 3. So is a part at whose ends slopes point upwards into it, as long as its tangents meet above the level: where it is bent
//!    downwards, as of two parts that pass each other, it stays below them.

/// A place with value and slope there.
#[derive(Clone, Copy)]
pub struct Place {
    pub t: f64,
    pub value: f64,
    pub slope: f64,
}

/// Can a function of these slopes between places rise to the level between two of them that are h apart?
pub fn reaches(values: (f64, f64), h: f64, slope: f64, level: f64) -> bool {
    // slopes between neighbouring places may be so much less than those in between
    0.5 * (values.0 + values.1 + 2.0 * slope * h) > level
}

/// A place between a and b at which the function is above the level.
pub fn above(a: Place, b: Place, level: f64, read: &mut dyn FnMut(f64) -> Place) -> Option<f64> {
    // parts are halved eight times at most, and the function is read at no more than forty places
    search(a, b, level, 8, &mut 40.clone(), read)
}

fn search(
    a: Place,
    b: Place,
    level: f64,
    depth: u32,
    reads: &mut u32,
    read: &mut dyn FnMut(f64) -> Place,
) -> Option<f64> {
    if depth == 0 || *reads == 0 {
        return None;
    }
    *reads -= 1;
    let cubic = Cubic::new(a, b);
    // a part ends no nearer to the end of what it is part of
    let u = cubic.peak().unwrap_or(0.5).clamp(0.01, 1.0 - 0.01);
    let c = read(a.t + u * (b.t - a.t));
    if c.value > level {
        return Some(c.t);
    }
    let off = (c.value - cubic.at(u)).abs() / shape(u);
    // the cubic is looked at between so many parts, which are shorter towards its ends
    let mut looks = (1..16).map(|i| (std::f64::consts::FRAC_PI_2 * f64::from(i) / 16.0).sin().powi(2));
    let rises = looks.any(|u| cubic.at(u) + 2.0 * off * shape(u) > level);
    let mut part = |a: Place, b: Place| {
        let asked = rises || a.slope > 0.0 && b.slope < 0.0 && tangents_meet(a, b) > level;
        asked.then(|| search(a, b, level, depth - 1, reads, read)).flatten()
    };
    part(a, c).or_else(|| part(c, b))
}

/// How high, of slopes that point upwards into the part.
fn tangents_meet(a: Place, b: Place) -> f64 {
    (b.value * a.slope - a.value * b.slope - a.slope * b.slope * (b.t - a.t)) / (a.slope - b.slope)
}

fn shape(u: f64) -> f64 {
    (u * (1.0 - u)).powi(2)
}

/// By its coefficients, of u from 0 to 1.
struct Cubic([f64; 4]);

impl Cubic {
    fn new(a: Place, b: Place) -> Cubic {
        let h = b.t - a.t;
        let (rise, first, last) = (b.value - a.value, h * a.slope, h * b.slope);
        Cubic([a.value, first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise])
    }

    fn at(&self, u: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * u + c)
    }

    /// Where it is largest, if between its ends.
    fn peak(&self) -> Option<f64> {
        let [_, c, b, a] = self.0;
        // the root of 3 a u^2 + 2 b u + c at which the slope falls
        let root = (b * b - 3.0 * a * c).sqrt();
        let u = if b < 0.0 { c / (root - b) } else { -(b + root) / (3.0 * a) };
        (u > 0.0 && u < 1.0).then_some(u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Is f seen above 0 between 0 and 1, and at how many places is it read?
    fn seen(f: impl Fn(f64) -> f64) -> (bool, u32) {
        let mut reads = 0;
        let place = |t: f64| Place { t, value: f(t), slope: (f(t + 1e-6) - f(t - 1e-6)) / 2e-6 };
        let mut read = |t: f64| {
            reads += 1;
            place(t)
        };
        (above(place(0.0), place(1.0), 0.0, &mut read).inspect(|&t| assert!(f(t) > 0.0)).is_some(), reads)
    }

    #[test]
    fn peaks_above_the_level_are_found_and_those_below_are_not() {
        for at in (1..400).map(|i| f64::from(i) / 400.0) {
            for height in [1e-2, 1e-4, 1e-6] {
                // a parabola, two balls that pass each other slowly and fast, a wave
                let courses: [&dyn Fn(f64) -> f64; 4] = [
                    &|t| -(t - at).powi(2),
                    &|t| 1.0 - (1.0 + (t - at).powi(2)).sqrt(),
                    &|t| 0.03 - (9e-4 + (t - at).powi(2)).sqrt(),
                    &|t| (2.0 * (t - at)).cos() - 1.0,
                ];
                for (k, course) in courses.iter().enumerate() {
                    if course(0.0) + height < 0.0 && course(1.0) + height < 0.0 {
                        assert!(seen(|t| course(t) + height).0, "{k} {at} {height}");
                    }
                    assert!(!seen(|t| course(t) - height).0, "{k} {at} {height}");
                }
            }
        }
    }

    #[test]
    fn what_does_not_turn_is_read_once() {
        assert_eq!(seen(|t| t - 1.001), (false, 1));
        assert_eq!(seen(|t| (t - 1.0) * (t + 3.0) - 1e-3), (false, 1));
        assert_eq!(seen(|t| -1e-9 - t * t), (false, 1));
    }

    #[test]
    fn a_bound_by_slopes_leaves_out_what_is_far() {
        assert!(!reaches((-1.0, -1.2), 0.1, 2.0, 0.0));
        assert!(reaches((-0.1, -0.2), 0.1, 2.0, 0.0));
    }
}
