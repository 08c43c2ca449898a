//! The native engine of emsim. It takes plain numbers and the expression graph; of deck text it knows the grammar
//! alone, in `syntax`, which stands apart.
//!
//! Everything compiles to  d/dt Q(x, t) + F(x, t) = 0.  Modules, each knowing only those above it in this list:
// machine code and vectors are not for it
#![cfg_attr(target_family = "wasm", allow(dead_code, unused_imports, unused_variables))]

pub mod assembly; // constraints: position and velocity projection, rank
pub mod bounds; // between which values an expression of time lies
pub mod clocked; // signals that change at the ticks of clocks
pub mod conditions; // what flags ask for at their thresholds
pub mod curve; // a signal between its points, as measurements ask for it
pub mod derive; // reverse and forward differentiation, substitution
pub mod devices; // semiconductor kernels, one file each
pub mod edges; // switching times that sources alone decide
pub mod events; // state events on dense output
#[cfg(not(target_family = "wasm"))]
pub mod fmi; // FMUs: the functions of FMI 2 and 3
pub mod foreign; // FMUs of others: their libraries
pub mod graph; // hash-consed expression nodes with folding
pub mod hidden; // constraints between states, differentiated before a run
pub mod integrate; // the methods and the driver
pub mod interpolate; // values between recorded points
pub mod interrupt; // Ctrl-C: the token that all that takes long looks at
pub mod invariants; // what must hold at every recorded row
pub mod islands; // sums of the rows of nodes that only capacitors tie together
mod lanes; // four numbers in one register
pub mod ledger; // energy accounts: integrals of powers on the dense output
pub mod logic; // digital nodes: an event queue beside the time axis
pub mod model; // contributions, as the cards make them
pub mod modes; // laws with modes (friction, rigid stops), decided together
pub mod newton; // one implicit stage: Newton's method
pub mod op; // the starting point: operating point, initial conditions, consistent values
pub mod packed; // a deck as bytes, and an instance of it that runs
#[cfg(all(target_family = "wasm", not(feature = "python")))]
mod page; // the functions that a page in a browser calls
pub mod passive; // is the linear part a passive network without gain
#[cfg(feature = "python")]
mod py;
pub mod raw; // ngspice's raw file, whole or row by row
pub mod record; // recorded waveforms
pub mod reduced; // the equations as an explicit ODE
pub mod schematic; // circuit diagrams: parts placed, wires routed
pub mod smallsignal; // G, C and excitations at a point, for small signals
pub mod sparse; // LU: matching, block triangular form, AMD, Gilbert-Peierls, refactorisation
mod stopwatch; // seconds on the wall
pub mod syntax; // deck text to syntax trees, by the grammar's tables
pub mod system; // equation (1): what was compiled, and the scratch of a run
pub mod tangent; // sensitivities beside a run
pub mod tape; // native evaluation of a set of expressions
pub mod tolerances; // options of a run, absolute tolerances by kind of quantity, weights
mod twice; // loops for registers of two numbers and of four
pub mod veriloga; // Verilog-A modules: from text to expressions of branch voltages
pub mod waves; // PULSE SIN EXP PWL SFFM AM: values and breakpoints // the Python face
