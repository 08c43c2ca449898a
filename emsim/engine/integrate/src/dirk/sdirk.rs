//! Of steps that begin with a jump: no stage stands at the start. L-stable, stiffly accurate, diagonally implicit.
//!
//! Order 4: SDIRK of five stages, gamma = 1/4 (Hairer and Wanner, Solving Ordinary Differential Equations II, table IV.6.5), with the
//! embedded formula of order 3 given there. Dense output of order 2 in the stage values behind the start, sum w_j = 1, sum w_j c_j = theta,
//! sum_ij w_i a_ij c_j = theta^2/2: the smallest such weights (they amplify what Newton's method has left five times; those of order
//! 3, thirty times), and a multiple of theta^3 that makes them end at the last stage.
//!
//! Order 2: two stages, gamma = 1 - 1/sqrt 2 (Alexander 1977). The difference of the stages' F stands for an error: a tenth of the term of
//! order 2 is held to the tolerance, as in `trap`. Dense output is the line through the stages.
use super::formula::Tableau;

pub fn order4() -> Tableau {
    let b = vec![0.0, 25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0, 0.25];
    #[rustfmt::skip]
    let dense = vec![
        vec![0.0, 0.0, 0.0, 0.0],
        vec![2.267_473_696_082_486, -8.454_338_164_503_891, 6.238_797_236_311_093, -0.051_932_767_889_687_82],
        vec![-0.979_273_967_743_886_4, 5.285_563_207_042_928, -4.129_187_908_942_76, -0.177_101_330_356_281_8],
        vec![-0.736_468_826_772_541_6, 5.410_900_127_657_975, -4.773_852_508_454_684, 0.099_421_207_569_251_59],
        vec![-0.248_751_616_156_497_9, 3.168_915_528_342_195, -2.997_134_642_386_043, 0.076_970_730_200_346_2],
        vec![0.697_020_714_590_440_2, -5.411_040_698_539_207, 5.661_377_823_472_395, 0.052_642_160_476_371_83],
    ];
    Tableau {
        c: vec![0.0, 0.25, 0.75, 0.55, 0.5, 1.0],
        a: vec![
            vec![0.0, 0.25],
            vec![0.0, 0.5, 0.25],
            vec![0.0, 0.34, -0.04, 0.25],
            vec![0.0, 371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, 0.25],
            b,
        ],
        d: vec![0.0, -3.0 / 16.0, -27.0 / 32.0, 25.0 / 32.0, 0.0, 0.25],
        dense,
        falls: 4,
        local: 0.1,
    }
}

/// That term, in parts of the difference of F, and the share of the tolerance.
const SECOND: f64 = 0.05;

pub fn order2() -> Tableau {
    let gamma = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
    let (one, local) = (1.0 / (1.0 - gamma), 0.1);
    let d = SECOND * local * one;
    Tableau {
        c: vec![0.0, gamma, 1.0],
        a: vec![vec![0.0, gamma], vec![0.0, 1.0 - gamma, gamma]],
        d: vec![0.0, -d, d],
        dense: vec![vec![0.0, 0.0], vec![one, -one], vec![-gamma * one, one]],
        falls: 2,
        local,
    }
}
