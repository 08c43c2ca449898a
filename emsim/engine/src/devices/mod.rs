//! Semiconductor kernels, one file each.
pub mod diode;
