//! Verilog-A modules: from their text to expressions of branch voltages, which a class of devices runs (devices/).
pub mod folded;
