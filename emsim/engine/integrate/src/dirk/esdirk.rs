//! ESDIRK4(3I)6L[2]SA: order 4, L-stable, stiffly accurate, stage order 2, gamma = 1/4, five solutions a step (Kennedy and
//! Carpenter 2016, Diagonally implicit Runge-Kutta methods for ordinary differential equations, NASA/TM-2016-219173).
//!
//! Chosen by measurement among the ESDIRKs of stage order 2 whose nodes lie in [0, 1] (a node beyond the step would look past
//! the corner of a source on which the step ends): Newton iterations on a buck, a boost converter and a diode bridge
//! at 1e-5: 26400, 6600, 3400; ESDIRK4(3)7L[2]SA 55300, 12200, 3500; ESDIRK5(4)7L[2]SA2 55900, 8200, 4000. On closed loops
//! (index 2) all of them are of order 3, and the seven-stage ones 3 and 17 times less accurate with the same step.
//!
//! Dense output of order 3 in every place (local error h^4, as the method's global one). Weights w_j(theta) of the stage
//! values keep  sum w_j = 1,  sum w_j c_j^k = theta^k (k = 1, 2, 3),  sum_ij w_i a_ij c_j^2 = theta^3/3,  start at the first
//! stage and end at the last; what is left free makes the residuals of the conditions of order 4 least (in the
//! mean over theta, by least squares).
//!
//! Error: the embedded formula's two last nodes are 1, and of what follows at once (h lambda to infinity) it is right at both, so that
//! b - b^ sees nothing of the error in dQ/dt: the capacitive current of a diode that turned off in a step was wrong by itself, at every
//! tolerance (a clipper: 1.7e-5 of the range from 1e-5 to 1e-9). F_6 - F_5 is nothing but that error. Its share below makes it the
//! one of Q = t^3 at the new point; it annihilates 1, t .. t^4 as F, adds a tenth to b - b^ where nothing is stiff,
//! and makes the estimate nearer to the error everywhere on the negative axis (h lambda = -10: a quarter of it, where b - b^
//! alone is a fiftieth).
use super::Tableau;

/// gamma times the error of dQ/dt at the new point over F_6 - F_5, both of Q = t^3 and h lambda to infinity.
const LAST: f64 = 0.150_275_071_499;

pub fn tableau() -> Tableau {
    let b1 = 657_241_292_721.0 / 9_909_463_049_845.0;
    let b = vec![
        b1,
        b1,
        1_290_772_910_128.0 / 5_804_808_736_437.0,
        1_103_522_341_516.0 / 2_197_678_446_715.0,
        -3.0 / 28.0,
        0.25,
    ];
    let e1 = -71_925_161_075.0 / 3_900_939_759_889.0;
    let embedded = [
        e1,
        e1,
        2_973_346_383_745.0 / 8_160_025_745_289.0,
        3_972_464_885_073.0 / 7_694_851_252_693.0,
        -263_368_882_881.0 / 4_213_126_269_514.0,
        3_295_468_053_953.0 / 15_064_441_987_965.0,
    ];
    let c = vec![0.0, 0.5, (2.0 - std::f64::consts::SQRT_2) / 4.0, 2_012_122_486_997.0 / 3_467_029_789_466.0, 1.0, 1.0];
    let mut a = vec![
        vec![0.0, 0.25],
        vec![0.0, -1_356_991_263_433.0 / 26_208_533_697_614.0, 0.25],
        vec![0.0, -1_778_551_891_173.0 / 14_697_912_885_533.0, 7_325_038_566_068.0 / 12_797_657_924_939.0, 0.25],
        vec![
            0.0,
            -24_076_725_932_807.0 / 39_344_244_018_142.0,
            9_344_023_789_330.0 / 6_876_721_947_151.0,
            11_302_510_524_611.0 / 18_374_767_399_840.0,
            0.25,
        ],
    ];
    // the first column makes the rows sum to c
    for (row, c) in a.iter_mut().zip(&c[1..]) {
        row[0] = c - row[1..].iter().sum::<f64>();
    }
    let mut d: Vec<f64> = b.iter().zip(&embedded).map(|(b, e)| b - e).collect();
    d[4] += LAST;
    d[5] -= LAST;
    a.push(b);
    #[rustfmt::skip]
    let dense = vec![
        vec![1.0, -8.873_700_709_041_445, 18.416_997_472_107_266, -10.543_296_763_065_822, 0.0],
        vec![0.0, 4.055_231_479_093_08, -11.369_799_092_296_308, 7.314_567_613_203_228, 0.0],
        vec![0.0, 9.197_990_030_513_486, -24.925_617_760_772_134, 15.727_627_730_258_646, 0.0],
        vec![0.0, -4.777_634_595_479_917, 20.358_475_051_419_85, -15.580_840_455_939_931, 0.0],
        vec![0.0, 0.006_556_257_602_806_513, 1.688_775_266_823_824_7, -6.479_965_987_869_876, 4.784_634_463_443_244],
        vec![0.0, 0.391_557_537_311_989_83, -4.168_830_937_282_499, 9.561_907_863_413_754, -4.784_634_463_443_244],
    ];
    Tableau { c, a, d, dense, falls: 4, local: 0.1 }
}
