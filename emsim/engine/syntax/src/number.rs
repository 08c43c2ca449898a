//! Words that are numbers by SPICE's rule: digits, then a scale suffix, then letters that mean nothing.
//!
//! The value is Python's `spice_number` of emsim/units.py, bit for bit: the suffix goes into the decimal exponent, so
//! that 1.1n is the double nearest to 1.1e-9. What that rule would warn of or refuse is no number here.

/// The scale suffixes as exponents, longest first; `a` is a unit, ampere.
const SCALES: [(&str, &str); 9] = [
    ("meg", "e6"),
    ("t", "e12"),
    ("g", "e9"),
    ("k", "e3"),
    ("m", "e-3"),
    ("u", "e-6"),
    ("n", "e-9"),
    ("p", "e-12"),
    ("f", "e-15"),
];

/// What may stand behind the scale suffix and means nothing: emsim/units.py's list.
const UNITS: [&str; 48] = [
    "a", "adc", "aac", "amp", "amps", "ampere", "amperes", "aohm", "aohms", "c", "db", "deg", "degc", "degrees", "f",
    "farad", "farads", "h", "henrys", "henries", "henry", "hertz", "hy", "hz", "j", "m", "meter", "meters", "ohm",
    "ohms", "r", "rad", "s", "sec", "second", "seconds", "secs", "v", "va", "vac", "vdc", "volt", "volts", "vpp",
    "vrms", "w", "watt", "watts",
];

/// The value of digits with an exponent behind them.
fn joined(mantissa: &str, power: &str) -> Option<f64> {
    let mut buffer = [0; 48];
    let length = mantissa.len() + power.len();
    if length > buffer.len() {
        return format!("{mantissa}{power}").parse().ok();
    }
    buffer[..mantissa.len()].copy_from_slice(mantissa.as_bytes());
    buffer[mantissa.len()..length].copy_from_slice(power.as_bytes());
    std::str::from_utf8(&buffer[..length]).ok()?.parse().ok()
}

/// The value of a word that is a finite number and nothing to talk about.
pub fn plain(word: &str) -> Option<f64> {
    let bytes = word.as_bytes();
    let digits = |mut k: usize| {
        while k < bytes.len() && bytes[k].is_ascii_digit() {
            k += 1;
        }
        k
    };
    let begin = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mut end = digits(begin);
    let mut count = end - begin;
    if bytes.get(end) == Some(&b'.') {
        let stop = digits(end + 1);
        count += stop - end - 1;
        end = stop;
    }
    if count == 0 {
        return None;
    }
    let mut exponent = false;
    let mut fortran = None;
    if matches!(bytes.get(end), Some(b'e' | b'E' | b'd' | b'D')) {
        let from = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let stop = digits(from);
        if stop > from {
            if matches!(bytes[end], b'd' | b'D') {
                fortran = Some(format!("{}e{}", &word[..end], &word[end + 1..stop]));
            }
            end = stop;
            exponent = true;
        }
    }
    let (mantissa, letters) = word.split_at(end);
    let mantissa = fortran.as_deref().unwrap_or(mantissa);
    let letters = letters.strip_suffix('%').unwrap_or(letters);
    let begins = |scale: &str| letters.get(..scale.len()).is_some_and(|head| head.eq_ignore_ascii_case(scale));
    let scale = if begins("mil") { 3 } else { SCALES.iter().find(|s| begins(s.0)).map_or(0, |s| s.0.len()) };
    let rest = letters.get(scale..)?;
    if !rest.is_empty() && !UNITS.iter().any(|unit| unit.eq_ignore_ascii_case(rest)) {
        return None;
    }
    let value = if begins("mil") {
        mantissa.parse::<f64>().ok()? * 25.4e-6
    } else if let Some(&(_, power)) = SCALES.iter().find(|(scale, _)| begins(scale)) {
        if exponent {
            // 1e3k: the factor is a double of its own
            mantissa.parse::<f64>().ok()? * joined("1", power)?
        } else {
            joined(mantissa, power)?
        }
    } else {
        mantissa.parse::<f64>().ok()?
    };
    value.is_finite().then_some(value)
}
