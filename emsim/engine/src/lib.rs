//! The native engine of emsim. It takes plain numbers and the expression graph; of deck text it knows the grammar alone, in `syntax`.
//! Everything compiles to  d/dt Q(x, t) + F(x, t) = 0. The crates beside this one hold what needs no Python; here is what others call.
// machine code and vectors are not for it
#![cfg_attr(target_family = "wasm", allow(dead_code, unused_imports, unused_variables))]

pub use {emsim_dae::*, emsim_expr::*};
pub use {emsim_foreign as foreign, emsim_integrate as integrate, emsim_schematic as schematic};
pub use {emsim_sparse as sparse, emsim_syntax as syntax, emsim_veriloga as veriloga};

pub mod curve; // a signal between its points, as measurements ask for it
#[cfg(not(target_family = "wasm"))]
pub mod fmi; // FMUs: the functions of FMI 2 and 3
pub mod interpolate; // values between recorded points
pub mod packed; // a deck as bytes, and an instance of it that runs
#[cfg(all(target_family = "wasm", not(feature = "python")))]
mod page; // the functions that a page in a browser calls
#[cfg(feature = "python")]
mod py;
