//! Rules 1 and 2 of `auto`: which methods a system of equations is given to, by what it is made of and by the asked tolerance.
use super::super::driver::IMPOSED;
use super::super::{gear, trap};
use crate::newton::Options;
use crate::system::System;

/// Larger systems are left to the sparse methods, as are larger dense blocks.
const SMALL: usize = 400;
const BLOCK: usize = 60;
/// Closure rows: beyond these, bringing every stage's accelerations onto them costs more than implicit steps. (Six: a squeezer of
/// seven bodies takes dop853 half of radau's time, Bricard's linkage as much or less.)
const LOOPS: usize = 6;
const BESIDE_SINGULAR: f64 = 0.01;
/// Rows in a period that are dearer as steps of their own than by a longer step's dense output.
const FINEST: f64 = 1000.0;

/// Tolerances from which on rk45 does: a circuit's sources have corners, where short steps show more; from edge to edge of a switch
/// one step is enough, and the shorter tableau the cheaper one. In machines, and circuits without corners, dop853's steps are
/// cheaper at any error (chain of 20 at 1e-2: 3.1 ms and 1e-5 of the range, rk45 3.9 ms and 2e-4; four-bar 0.9 ms and 4e-2,
/// rk45 0.6 ms and half the range; LC oscillator at 1e-3 0.16 ms and 7e-6, rk45 0.21 ms and 3e-4).
fn loose(sys: &System, span: f64) -> f64 {
    match mechanical(sys) || !sys.has_corner_before(span) {
        _ if !sys.flags.is_empty() && sys.edges.all_timed() => 1e-6,
        true => f64::INFINITY,
        false => 5e-4,
    }
}

pub fn mechanical(sys: &System) -> bool {
    sys.unknowns.iter().any(|u| u.kind.mechanical())
}

/// Rule 1: is the explicit form worth making?
pub fn reduces(sys: &System, o: &Options) -> bool {
    o.fixed_step.is_none() && never_explicit(sys).is_none() && sys.n <= SMALL
}

/// Rule 1: what no explicit form is asked about.
fn never_explicit(sys: &System) -> Option<&'static str> {
    if sys.diodes() > 0 {
        Some("diodes")
    } else if sys.bends() && !mechanical(sys) {
        Some("exponentials")
    } else if sys.pure_linear {
        Some("linear equations")
    } else {
        None
    }
}

/// Rule 1: the explicit method, and why it is the first one or why there is none.
pub fn explicit(sys: &System, o: &Options) -> (Option<&'static str>, String) {
    match never_explicit(sys).map_or_else(|| sys.reduced(), Err) {
        Ok(r) if r.largest_block() > BLOCK => (None, "large dense blocks".to_string()),
        Ok(r) if r.constraints() > LOOPS => (None, "several closed loops".to_string()),
        Ok(r) if r.iterates() => (None, "stages that want iterations".to_string()),
        Ok(_) if o.reltol >= loose(sys, o.span) => (Some("rk45"), "nothing stiff".to_string()),
        Ok(_) => (Some("dop853"), "nothing stiff".to_string()),
        Err(why) => (None, why.to_string()),
    }
}

/// Rule 2: radau where no exponential bends it. Diodes turn gently to corners, and what is cheapest there are few
/// stages: gear's orders and, at loose tolerances, trap, whose steps are the cheapest of all, if they follow a source's
/// swing: by itself it is wrong by ten times what is asked (three_phase_rectifier at reltol 1e-3 5e-3). Not beside
/// coils: what one has left as its diode turns off rings on, and a node that floats then shows it in hundreds of volts
/// (a three-phase rectifier behind line inductances). Switches throw gear back to order 1 and want short restarts,
/// machines want a higher order: esdirk. Junctions written as expressions are as gentle: gear, one stage a step, beside
/// radau's five (transistor amplifier to 1e-3: 0.8 ms, 1.9 ms; to 1e-6 2.6 ms, 2.9 ms, by a gear that misses a tolerance
/// of 1e-7 by twenty; to 1e-8 3.7 ms by radau), unless coils ring with them (ring modulator at 1e-3: gear loses 2.5 % of
/// its range at the end).
pub fn implicit(sys: &System, o: &Options) -> &'static str {
    let swing = sys.shortest_swing();
    let followed = swing.is_finite() && o.span * trap::IN_A_PERIOD < IMPOSED * swing && o.grid * FINEST > swing;
    let few_restarts = sys.flags.is_empty() && !mechanical(sys);
    match o.reltol {
        tol if sys.diodes() == 0 && sys.bends() && few_restarts && !sys.has_coils() && tol >= 5e-7 => "gear",
        _ if sys.diodes() == 0 => "radau",
        tol if few_restarts && forgets(sys, swing, tol) => "trbdf2",
        tol if few_restarts && followed && tol >= trap_from(sys.diodes()) && !sys.has_coils() => "trap",
        _ if few_restarts => "gear",
        tol => one_step(tol),
    }
}

/// Tolerances from which on trap does, beside so many diodes. Each turns at a time of its own and throws gear's order and step back:
/// a multiplier of eight takes gear three times trap's steps. Beside four it takes as long at 1e-3, and is right to what is asked where
/// trap is off by up to seven times as much (a multiplier of two stages 1.02 ms, 2e-4, and 0.91 ms, 2e-3; of three 1.6 ms, 3e-4, and
/// 1.2 ms, 1e-3). One or two may do nothing but hold a swing that trap's steps follow anyway: a Zener regulator's ripple is off by 7e-3
/// of itself under gear at 1e-3.
fn trap_from(diodes: usize) -> f64 {
    match diodes {
        3..=4 => 5e-3,
        _ => 5e-4,
    }
}

/// Does nothing but junctions store charge, and do these lose it within so little of a source's swing that the circuit follows its
/// sources as resistors would? Then no error lasts, and what counts is how few steps follow a swing and its corners: a quarter of
/// gear's (half-wave rectifier into 1 kohm, 50 Hz, to 1e-4 and 1e-6: trbdf2 0.07, 0.15 ms, gear 0.11, 0.21 ms; three phases into
/// 10 ohm to 1e-6 0.25 ms, 0.75 ms). Clippers at 1 kHz are where it ends below 5e-4 (the rectifier there at 1e-4 0.32 ms, by gear 0.22),
/// at 5 kHz altogether.
fn forgets(sys: &System, swing: f64, reltol: f64) -> bool {
    let most = match reltol {
        tol if tol >= 5e-4 => 1e-5,
        tol if tol >= 5e-7 => 1e-6,
        _ => return false,
    };
    swing.is_finite() && sys.memory_of_junctions().is_some_and(|memory| memory < most * swing)
}

/// What does with any diode, switch or machine, and never with steps of rounding's size (transit times at 1e-8 leave gear at order 1).
pub fn one_step(reltol: f64) -> &'static str {
    if reltol >= 5e-7 {
        "esdirk"
    } else {
        "radau"
    }
}

/// What does beside positions in which constraints lose rank, where higher orders' iteration fails: gear, whose many short steps cost
/// a quarter of one of `radau5`'s, held to a hundredth of what it is elsewhere. (What its formula takes of the energy would else carry
/// a linkage over to another branch: two four-bars over 12 s at 1e-3 were off by 0.7 of the range, now by 1e-4.) Below 1e-5 its errors
/// fall by less than what is asked, and a tenth at 1e-8 does.
pub fn beside_singular(o: &mut Options) -> &'static str {
    if o.reltol < 5e-9 {
        return "radau";
    }
    let tight = (1e-5 / o.reltol).cbrt().max(1.0);
    o.trtol = BESIDE_SINGULAR * tight * if o.trtol.is_finite() { o.trtol } else { gear::LOCAL };
    "gear"
}
