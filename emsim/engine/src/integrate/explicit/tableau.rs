//! What tells one explicit Runge-Kutta method from another. Rows are lists of (stage, coefficient), zeros left out.

pub type Row = &'static [(usize, f64)];

pub struct Tableau {
    pub order: i32,
    /// without the new point, whose slope has the number `stages`, and without the extra ones after it
    pub stages: usize,
    /// h |lambda| to which the method is stable on the negative real axis
    pub stable: f64,
    /// of the PI control: exponent of the last error
    pub beta: f64,
    /// longest growth of a step
    pub growth: f64,
    pub c: &'static [f64],
    pub a: &'static [Row],
    pub b: Row,
    /// stages of the dense output alone
    pub extra: &'static [Row],
    pub error: Row,
    /// a second estimate, of lower order, or empty
    pub coarse: Row,
    /// dense output, see `Explicit::dense`
    pub dense: &'static [Row],
}

/// Components that are summed side by side.
const LANES: usize = 4;

/// out = y + h sum of a_j k_j, k by rows of the length of y.
#[inline]
pub fn combine(out: &mut [f64], y: &[f64], h: f64, row: Row, k: &[f64]) {
    let n = y.len();
    let out = &mut out[..n];
    sums(n, row, k, |i, sum| out[i] = y[i] + h * sum);
}

/// out += h sum of a_j k_j.
#[inline]
pub fn add(out: &mut [f64], h: f64, row: &[(usize, f64)], k: &[f64]) {
    sums(out.len(), row, k, |i, sum| out[i] += h * sum);
}

/// Every component's sum is finished in registers before the next ones begin.
#[inline(always)]
fn sums(n: usize, row: &[(usize, f64)], k: &[f64], mut take: impl FnMut(usize, f64)) {
    let mut i = 0;
    while i + LANES <= n {
        let mut sum = [0.0; LANES];
        for &(j, a) in row {
            let kj: &[f64; LANES] = k[j * n + i..][..LANES].try_into().expect("so many");
            for l in 0..LANES {
                sum[l] += a * kj[l];
            }
        }
        for (l, &s) in sum.iter().enumerate() {
            take(i + l, s);
        }
        i += LANES;
    }
    while i < n {
        take(i, row.iter().map(|&(j, a)| a * k[j * n + i]).sum());
        i += 1;
    }
}
