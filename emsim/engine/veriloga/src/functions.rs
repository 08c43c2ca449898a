//! The functions that the language knows by name, and how many arguments they take.

const MANY: usize = 100;

#[rustfmt::skip]
const FUNCTIONS: &[(&str, usize, usize)] = &[
    ("abs", 1, 1), ("acos", 1, 1), ("acosh", 1, 1), ("asin", 1, 1), ("asinh", 1, 1), ("atan", 1, 1), ("atan2", 2, 2), ("atanh", 1, 1),
    ("ceil", 1, 1), ("cos", 1, 1), ("cosh", 1, 1), ("exp", 1, 1), ("floor", 1, 1), ("hypot", 2, 2), ("ln", 1, 1), ("log", 1, 1),
    ("log10", 1, 1), ("max", 2, 2), ("min", 2, 2), ("pow", 2, 2), ("sin", 1, 1), ("sinh", 1, 1), ("sqrt", 1, 1), ("tan", 1, 1),
    ("tanh", 1, 1), ("limexp", 1, 1), ("int", 1, 1),
    ("ddt", 1, 2), ("idt", 1, 4), ("idtmod", 1, 5), ("ddx", 2, 2), ("absdelay", 2, 3), ("transition", 1, 5), ("slew", 1, 3),
    ("laplace_nd", 3, 4), ("laplace_np", 3, 4), ("laplace_zd", 3, 4), ("laplace_zp", 3, 4), ("last_crossing", 1, 2),
    ("zi_nd", 4, 6), ("zi_np", 4, 6), ("zi_zd", 4, 6), ("zi_zp", 4, 6), ("ac_stim", 0, 3),
    ("white_noise", 1, 2), ("flicker_noise", 2, 3), ("noise_table", 1, 2), ("noise_table_log", 1, 2), ("analysis", 1, MANY),
];

#[rustfmt::skip]
const SYSTEM: &[(&str, usize, usize)] = &[
    ("$temperature", 0, 0), ("$vt", 0, 1), ("$abstime", 0, 0), ("$realtime", 0, 1), ("$simparam", 1, 2), ("$simparam$str", 1, 1),
    ("$param_given", 1, 1), ("$port_connected", 1, 1), ("$mfactor", 0, 0), ("$limit", 1, MANY), ("$bound_step", 1, 1),
    ("$discontinuity", 0, 1), ("$strobe", 0, MANY), ("$display", 0, MANY), ("$write", 0, MANY), ("$monitor", 0, MANY),
    ("$debug", 0, MANY), ("$warning", 0, MANY), ("$info", 0, MANY), ("$error", 0, MANY), ("$fatal", 0, MANY), ("$finish", 0, 1),
    ("$stop", 0, 1), ("$hflip", 0, 0), ("$vflip", 0, 0), ("$angle", 0, 0), ("$xposition", 0, 0), ("$yposition", 0, 0),
    ("$abs", 1, 1), ("$acos", 1, 1), ("$acosh", 1, 1), ("$asin", 1, 1), ("$asinh", 1, 1), ("$atan", 1, 1), ("$atan2", 2, 2),
    ("$atanh", 1, 1), ("$ceil", 1, 1), ("$cos", 1, 1), ("$cosh", 1, 1), ("$exp", 1, 1), ("$floor", 1, 1), ("$hypot", 2, 2),
    ("$ln", 1, 1), ("$log10", 1, 1), ("$max", 2, 2), ("$min", 2, 2), ("$pow", 2, 2), ("$sin", 1, 1), ("$sinh", 1, 1), ("$sqrt", 1, 1),
    ("$tan", 1, 1), ("$tanh", 1, 1), ("$rtoi", 1, 1), ("$itor", 1, 1), ("$clog2", 1, 1),
    ("$table_model", 2, MANY), ("$random", 0, 2), ("$dist_uniform", 3, 3), ("$dist_normal", 3, 3), ("$dist_exponential", 2, 2),
    ("$dist_poisson", 2, 2), ("$dist_chi_square", 2, 2), ("$dist_t", 2, 2), ("$dist_erlang", 3, 3), ("$rdist_uniform", 3, 4),
    ("$rdist_normal", 3, 4), ("$rdist_exponential", 2, 3), ("$rdist_poisson", 2, 3), ("$rdist_chi_square", 2, 3),
    ("$rdist_t", 2, 3), ("$rdist_erlang", 3, 4),
];

/// What may stand behind @.
pub const EVENTS: &[&str] = &["initial_step", "final_step", "cross", "above", "timer", "absdelta"];

fn of(table: &[(&str, usize, usize)], name: &str) -> Option<(usize, usize)> {
    table.iter().find(|f| f.0 == name).map(|f| (f.1, f.2))
}

/// Least and largest number of arguments.
pub fn arity(name: &str) -> Option<(usize, usize)> {
    of(FUNCTIONS, name)
}

pub fn names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|f| f.0)
}

pub fn system(name: &str) -> Option<(usize, usize)> {
    of(SYSTEM, name)
}

pub fn systems() -> impl Iterator<Item = &'static str> {
    SYSTEM.iter().map(|f| f.0)
}
