//! Numbers for people: significant digits, engineering prefixes, a true minus sign.
//!
//! The plain functions are for prose and drawings (`−12.5 µm`, with a no-break space before the
//! unit); those called `typed` are for terminals (`-12.5 µm`).

const MINUS: char = '−';
const NO_BREAK: char = '\u{a0}';

/// Prefixes from pico to giga with their powers of ten.
const PREFIXES: [(i32, &str); 8] = [(-12, "p"), (-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G")];

/// `value` in `unit` with at most `digits` significant digits and a suitable prefix: `132.8 kN/m`.
///
/// Between 0.1 and 1000 the unit stays as it is (`0.71 Ω`, not `710 mΩ`); trailing zeros are dropped.
/// Units without prefixes (`kg m^2`, `rad`, `%`) get a power of ten if necessary.
///
/// ```
/// use taut::number::engineering;
/// assert_eq!(engineering(132_760.0, "N/m", 4), "132.8\u{a0}kN/m");
/// assert_eq!(engineering(0.053744890394, "m", 5), "53.745\u{a0}mm");
/// assert_eq!(engineering(6.3e-5, "kg m^2", 3), "6.3×10⁻⁵\u{a0}kg\u{a0}m²");
/// assert_eq!(engineering(-0.7e-6, "m", 3), "−700\u{a0}nm");
/// ```
pub fn engineering(value: f64, unit: &str, digits: usize) -> String {
    let (number, prefix) = scaled(value, unit, digits);
    if unit.is_empty() {
        return number;
    }
    let space = if matches!(unit, "°" | "'" | "\"") { String::new() } else { NO_BREAK.to_string() };
    format!("{number}{space}{prefix}{}", pretty_unit(unit).replace(' ', &NO_BREAK.to_string()))
}

/// As [`engineering`], for terminals: `-0.7 µm`, `0.71 Ω`, `6.3e-5 kg m²`.
///
/// ```
/// assert_eq!(taut::number::engineering_typed(-1.25e-6, "m", 3), "-1.25 µm");
/// ```
pub fn engineering_typed(value: f64, unit: &str, digits: usize) -> String {
    typed(&engineering(value, unit, digits))
}

/// `value` with exactly `digits` significant digits, zeros kept: `0.2000`, `−19.04`, `1.50×10⁻⁷`.
pub fn significant(value: f64, digits: usize) -> String {
    let digits = digits.clamp(1, 17);
    if !value.is_finite() {
        return odd(value);
    }
    if value == 0.0 {
        return signed(&format!("{:.*}", digits - 1, 0.0));
    }
    let (_, exponent) = parts(value, digits);
    if (-4..=6).contains(&exponent) {
        signed(&format!("{:.*}", (digits as i32 - 1 - exponent).max(0) as usize, round_to(value, digits)))
    } else {
        power(value, digits, false)
    }
}

/// `value` with `decimals` places after the point and a true minus sign; never `−0.00`.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return odd(value);
    }
    signed(&format!("{value:.decimals$}"))
}

/// A unit as printed: `kg m^2` becomes `kg m²`, `ohm` becomes `Ω`.
pub fn pretty_unit(unit: &str) -> String {
    let mut out = String::with_capacity(unit.len());
    let mut raised = false;
    for c in unit.chars() {
        raised = match c {
            '^' => true,
            '0'..='9' | '-' if raised => {
                out.push(superscript(c));
                true
            }
            _ => {
                out.push(c);
                false
            }
        };
    }
    out.replace("ohm", "Ω")
}

/// The text with spaces, minus signs and powers of ten as typed on a keyboard, for terminals and `grep`.
pub fn typed(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut exponent = false;
    for c in text.replace("×10", "e").chars() {
        let digit = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().position(|s| s == c).filter(|_| exponent || out.ends_with('e'));
        exponent = digit.is_some();
        match (digit, c) {
            (Some(i), _) => out.push(b"0123456789-"[i] as char),
            (None, MINUS) => out.push('-'),
            (None, NO_BREAK | '\u{202f}') => out.push(' '),
            (None, other) => out.push(other),
        }
    }
    out
}

/// Number and prefix, the number still with the print signs.
fn scaled(value: f64, unit: &str, digits: usize) -> (String, &'static str) {
    let digits = digits.clamp(1, 17);
    if !value.is_finite() {
        return (odd(value), "");
    }
    if value == 0.0 {
        return ("0".into(), "");
    }
    let (_, exponent) = parts(value, digits);
    if (-1..=2).contains(&exponent) {
        return (plain(value, digits), "");
    }
    // The first factor of the unit gets the prefix, unless it has one (kg), a power, or is usual without one.
    let first = unit.split([' ', '/', '*', '·']).next().unwrap_or("");
    let takes = match first {
        "" | "1" | "%" | "°" | "deg" | "rpm" | "kg" | "dB" | "counts" => false,
        "rad" | "s" => exponent < 0,
        _ => !first.contains(['^', '²', '³']),
    };
    let wanted = 3 * exponent.div_euclid(3);
    if takes && let Some(&(power, prefix)) = PREFIXES.iter().find(|(power, _)| *power == wanted) {
        return (plain(value * 10f64.powi(-power), digits), prefix);
    }
    if (-3..=4).contains(&exponent) {
        return (plain(value, digits), "");
    }
    (power(value, digits, true), "")
}

/// Mantissa digits and exponent after rounding.
fn parts(value: f64, digits: usize) -> (String, i32) {
    let text = format!("{:.*e}", digits - 1, value);
    let (mantissa, exponent) = text.split_once('e').expect("Rust writes an exponent");
    (mantissa.to_string(), exponent.parse().expect("Rust writes a whole exponent"))
}

fn round_to(value: f64, digits: usize) -> f64 {
    format!("{:.*e}", digits - 1, value).parse().unwrap_or(value)
}

fn plain(value: f64, digits: usize) -> String {
    let (_, exponent) = parts(value, digits);
    let text = format!("{:.*}", (digits as i32 - 1 - exponent).max(0) as usize, round_to(value, digits));
    signed(trim(&text))
}

fn power(value: f64, digits: usize, trimmed: bool) -> String {
    let (mantissa, exponent) = parts(value, digits);
    let raised: String = exponent.to_string().chars().map(superscript).collect();
    format!("{}×10{raised}", signed(if trimmed { trim(&mantissa) } else { &mantissa }))
}

fn trim(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_string(),
        Some(rest) => format!("{MINUS}{rest}"),
        None => text.to_string(),
    }
}

fn odd(value: f64) -> String {
    if value.is_nan() {
        "not a number".into()
    } else if value > 0.0 {
        "∞".into()
    } else {
        "−∞".into()
    }
}

fn superscript(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32('⁰' as u32 + (c as u32 - '0' as u32)).unwrap_or(c),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_suit_engineers() {
        let e = |v, u, d| engineering(v, u, d).replace(NO_BREAK, " ");
        assert_eq!(e(0.71, "ohm", 3), "0.71 Ω");
        assert_eq!(e(0.0016, "N m s", 3), "1.6 mN m s");
        assert_eq!(e(16.67e9, "Pa", 4), "16.67 GPa");
        assert_eq!(e(0.362, "kg", 3), "0.362 kg");
        assert_eq!(e(999.96, "N/m", 4), "1 kN/m");
        assert_eq!(e(1.0e12, "N/m", 4), "1×10¹² N/m");
        assert_eq!(e(12345.0, "rad/s", 3), "12300 rad/s");
        assert_eq!(e(f64::NAN, "m", 3), "not a number m");
        assert_eq!(e(5.5626e-6, "m^2", 5), "5.5626×10⁻⁶ m²");
        assert_eq!(e(-0.0, "m", 3), "0 m");
        assert_eq!(engineering_typed(6.3e-5, "kg m^2", 2), "6.3e-5 kg m²");
        assert_eq!(engineering_typed(0.71, "ohm", 2), "0.71 Ω");
    }

    #[test]
    fn digits_are_kept_where_asked() {
        assert_eq!(significant(0.2, 4), "0.2000");
        assert_eq!(significant(-19.0424, 4), "−19.04");
        assert_eq!(significant(9.9996, 4), "10.00");
        assert_eq!(significant(1.5e-7, 3), "1.50×10⁻⁷");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-1.5, 1), "−1.5");
    }
}
