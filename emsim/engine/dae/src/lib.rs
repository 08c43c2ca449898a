//! The equations  d/dt Q(x, t) + F(x, t) = 0: how a model becomes them, their values and slopes, where a run begins, laws with
//! modes, events, and what is recorded.
// machine code and vectors are not for it
#![cfg_attr(target_family = "wasm", allow(dead_code, unused_imports, unused_variables))]

use emsim_expr::*;
use {emsim_foreign as foreign, emsim_sparse as sparse, emsim_veriloga as veriloga};

pub mod assembly; // constraints: position and velocity projection, rank
pub mod bounds; // between which values an expression of time lies
pub mod clocked; // signals that change at the ticks of clocks
pub mod conditions; // what flags ask for at their thresholds
pub mod devices; // semiconductor kernels, one file each
pub mod edges; // switching times that sources alone decide
pub mod events; // state events on dense output
pub mod floating_groups; // sums of the rows of nodes that only capacitors tie together
pub mod hidden; // constraints between states, differentiated before a run
pub mod invariants; // what must hold at every recorded row
pub mod ledger; // energy accounts: integrals of powers on the dense output
pub mod logic; // digital nodes: an event queue beside the time axis
pub mod model; // contributions, as the cards make them
pub mod modes; // laws with modes (friction, rigid stops), decided together
pub mod newton; // one implicit stage: Newton's method
pub mod op; // the starting point: operating point, initial conditions, consistent values
pub mod passive; // is the linear part a passive network without gain
pub mod raw; // ngspice's raw file, whole or row by row
pub mod record; // recorded waveforms
pub mod reduced; // the equations as an explicit ODE
pub mod smallsignal; // G, C and excitations at a point, for small signals
pub mod system; // equation (1): what was compiled, and the scratch of a run
pub mod tangent; // sensitivities beside a run
pub mod tolerances; // options of a run, absolute tolerances by kind of quantity, weights
pub mod waves; // PULSE SIN EXP PWL SFFM AM: values and breakpoints
