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

/// out = y + h sum of a_j k_j, k by rows of the length of y.
#[inline]
pub fn combine(out: &mut [f64], y: &[f64], h: f64, row: Row, k: &[f64]) {
    let n = y.len();
    let out = &mut out[..n];
    match row {
        // two at a time: half the traffic through `out`
        [(j, a), rest @ ..] if !rest.is_empty() => {
            let (l, b) = rest[0];
            let (kj, kl) = (&k[j * n..j * n + n], &k[l * n..l * n + n]);
            let (a, b) = (h * a, h * b);
            for i in 0..n {
                out[i] = y[i] + (a * kj[i] + b * kl[i]);
            }
            add(out, h, &rest[1..], k);
        }
        _ => {
            out.copy_from_slice(y);
            add(out, h, row, k);
        }
    }
}

/// out += h sum of a_j k_j.
#[inline]
pub fn add(out: &mut [f64], h: f64, row: &[(usize, f64)], k: &[f64]) {
    let n = out.len();
    for pair in row.chunks(2) {
        let (j, a) = pair[0];
        let kj = &k[j * n..j * n + n];
        let a = h * a;
        if let Some(&(l, b)) = pair.get(1) {
            let kl = &k[l * n..l * n + n];
            let b = h * b;
            for i in 0..n {
                out[i] += a * kj[i] + b * kl[i];
            }
        } else {
            for i in 0..n {
                out[i] += a * kj[i];
            }
        }
    }
}
