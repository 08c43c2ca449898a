//! Gauss-Legendre collocation with two and three stages (Hairer and Wanner 1996, table IV.5.1): nodes, A, A^-1, and the
//! rows TI (left eigenvectors of A^-1) with their inverse T:  TI A^-1 T = diag(gamma, [[alpha, -beta], [beta, alpha]]), the
//! real eigenvalue being there with three stages only.

use crate::split::Eigenvalues;

pub struct Table {
    pub s: usize,
    pub c: [f64; 3],
    pub b: [f64; 3],
    pub inverse: [[f64; 3]; 3],
    pub ti: [[f64; 3]; 3],
    pub t: [[f64; 3]; 3],
    pub gamma: Option<f64>,
    pub alpha: f64,
    pub beta: f64,
}

impl Table {
    pub fn eigenvalues(&self) -> Eigenvalues<'_> {
        use std::slice::from_ref;
        Eigenvalues { gamma: self.gamma, alpha: from_ref(&self.alpha), beta: from_ref(&self.beta) }
    }
}

const S3: f64 = 1.732_050_807_568_877_2; // sqrt 3
const S15: f64 = 3.872_983_346_207_417; // sqrt 15

pub const TWO: Table = Table {
    s: 2,
    c: [0.5 - S3 / 6.0, 0.5 + S3 / 6.0, 0.0],
    b: [0.5, 0.5, 0.0],
    inverse: [[3.0, 2.0 * S3 - 3.0, 0.0], [-3.0 - 2.0 * S3, 3.0, 0.0], [0.0; 3]],
    ti: [[0.965_925_826_289_068_4, 0.0, 0.0], [0.0, -0.258_819_045_102_520_74, 0.0], [0.0; 3]],
    t: [[1.035_276_180_410_083, 0.0, 0.0], [0.0, -3.863_703_305_156_273_7, 0.0], [0.0; 3]],
    gamma: None,
    alpha: 3.0,
    beta: S3,
};

pub const THREE: Table = Table {
    s: 3,
    c: [0.5 - S15 / 10.0, 0.5, 0.5 + S15 / 10.0],
    b: [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0],
    inverse: [
        [5.0, 4.0 * S15 / 3.0 - 4.0, 5.0 - 4.0 * S15 / 3.0],
        [-2.5 - S15 / 1.2, 2.0, S15 / 1.2 - 2.5],
        [5.0 + 4.0 * S15 / 3.0, -4.0 - 4.0 * S15 / 3.0, 5.0],
    ],
    ti: [
        [0.979_941_982_816_970_4, 0.186_318_452_535_970_62, 0.070_704_628_966_889_37],
        [0.886_118_879_170_533_6, 0.075_235_165_970_300_29, -0.072_875_507_057_510_93],
        [0.0, -0.448_312_424_795_851_15, 0.053_274_121_520_246_32],
    ],
    t: [
        [0.441_160_927_242_979_34, 0.640_645_289_882_025, 0.290_858_492_389_519_55],
        [0.726_582_743_628_939_5, -0.803_514_010_601_856_7, -2.063_464_419_787_299_8],
        [6.114_339_613_977_853, -6.761_731_665_785_562, 1.406_372_556_640_238_3],
    ],
    gamma: Some(4.644_370_709_252_168),
    alpha: 3.677_814_645_373_918_4,
    beta: 3.508_761_919_567_444_7,
};

/// Weights of the last step's F, this step's, and F at the point between them in Gauss's quadrature error of this step,
///   integral_0^1 prod (t - c_i)^2 dt  F[all 2s + 1 nodes],   1/180 and 1/2800 times a divided difference,
/// which falls as h^(2s+1) like the local error. `ratio` is the last step over this one.
pub fn difference(k: &Table, ratio: f64) -> [f64; 7] {
    let m = 2 * k.s + 1;
    let mut nodes = [0.0; 7];
    for j in 0..k.s {
        nodes[j] = (k.c[j] - 1.0) * ratio;
        nodes[k.s + j] = k.c[j];
    }
    let square = if k.s == 2 { 1.0 / 180.0 } else { 1.0 / 2800.0 };
    let mut weights = [0.0; 7];
    for (j, w) in weights.iter_mut().enumerate().take(m) {
        *w = square / (0..m).filter(|&i| i != j).map(|i| nodes[j] - nodes[i]).product::<f64>();
    }
    weights
}

/// The same of a first step, from its own F and that at its start:  |prod (t - c_i)| F[s + 1 nodes],  which falls as h^(s+1).
pub fn first_difference(k: &Table) -> [f64; 7] {
    let node = |j: usize| if j < k.s { k.c[j] } else { 0.0 };
    let norm = if k.s == 2 { 1.0 / 180.0_f64 } else { 1.0 / 2800.0 }.sqrt();
    let mut weights = [0.0; 7];
    for j in 0..=k.s {
        let w = norm / (0..=k.s).filter(|&i| i != j).map(|i| node(j) - node(i)).product::<f64>();
        weights[if j < k.s { k.s + j } else { 2 * k.s }] = w;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn collocation_and_its_eigenvectors() {
        for k in [&TWO, &THREE] {
            let s = k.s;
            // A from A^-1: A c^(q-1) = c^q / q, that is A^-1 c^q = q c^(q-1); b integrates degree 2s - 1
            for q in 1..=s as i32 {
                for i in 0..s {
                    let sum: f64 = (0..s).map(|j| k.inverse[i][j] * k.c[j].powi(q)).sum();
                    assert!((sum - f64::from(q) * k.c[i].powi(q - 1)).abs() < 1e-13);
                }
            }
            for q in 1..=2 * s as i32 {
                let sum: f64 = (0..s).map(|j| k.b[j] * k.c[j].powi(q - 1)).sum();
                assert!((sum - 1.0 / f64::from(q)).abs() < 1e-15);
            }
            // TI A^-1 T
            let mut want = [[0.0; 3]; 3];
            let first = usize::from(k.gamma.is_some());
            if let Some(gamma) = k.gamma {
                want[0][0] = gamma;
            }
            (want[first][first], want[first + 1][first + 1]) = (k.alpha, k.alpha);
            (want[first][first + 1], want[first + 1][first]) = (-k.beta, k.beta);
            for i in 0..s {
                for j in 0..s {
                    let inner = |l: usize| (0..s).map(|m| k.inverse[l][m] * k.t[m][j]).sum::<f64>();
                    let sum: f64 = (0..s).map(|l| k.ti[i][l] * inner(l)).sum();
                    assert!((sum - want[i][j]).abs() < 1e-12, "{i} {j} {sum}");
                }
            }
        }
    }

    #[test]
    fn the_difference_is_the_error_of_the_quadrature() {
        for k in [&TWO, &THREE] {
            let w = difference(k, 0.7);
            for q in 0..=2 * k.s as i32 {
                let at = |t: f64| t.powi(q);
                let mut sum = w[2 * k.s] * at(0.0);
                let mut gauss = 0.0;
                for j in 0..k.s {
                    sum += w[j] * at(0.7 * (k.c[j] - 1.0)) + w[k.s + j] * at(k.c[j]);
                    gauss += k.b[j] * at(k.c[j]);
                }
                assert!((sum - (1.0 / f64::from(q + 1) - gauss)).abs() < 1e-13, "{q} {sum}");
            }
        }
    }
}
