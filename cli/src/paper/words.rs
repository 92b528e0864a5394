//! Numbers as they stand in sentences.

use super::claims::{Check, Claim, Rule};
use maud::{Markup, html};
use taut::number::{engineering, significant};

/// A relative change in per cent with its sign: `−49.2 %`.
pub fn percent(change: f64) -> String {
    if tiny(change) { share(change) } else { signed(100.0 * change, 3) + "\u{a0}%" }
}

/// A share in per cent without sign: `0.07 %`, and for what is smaller than 10⁻⁶ the power of ten below which it lies.
pub fn share(part: f64) -> String {
    let p = 100.0 * part.abs();
    if tiny(part) {
        let power = (p.log10().ceil() as i32).unsigned_abs();
        let raised: String =
            power.to_string().chars().map(|c| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c as usize - 48).unwrap_or(c)).collect();
        return format!("less than 10⁻{raised}\u{a0}%");
    }
    significant(p, 2) + "\u{a0}%"
}

fn tiny(change: f64) -> bool {
    change != 0.0 && change.abs() < 1e-6
}

/// A number with its sign.
pub fn signed(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    if value > 0.0 { format!("+{text}") } else { text }
}

/// A quantity with the prefix that suits.
pub fn si(value: f64, unit: &str, digits: usize) -> String {
    engineering(value, unit, digits)
}

/// A position in millimetres, to the tenth of a micrometre.
pub fn mm(position: f64) -> String {
    format!("{}\u{a0}mm", taut::number::fixed(1e3 * position, 4))
}

/// A distance in micrometres.
pub fn um(distance: f64, digits: usize) -> String {
    format!("{}\u{a0}µm", significant(1e6 * distance, digits))
}

/// The number with its unit, with as many digits as its rule needs.
pub fn value(check: &Check) -> String {
    let digits = match check.rule {
        Rule::Near { expected, tolerance } if tolerance > 0.0 && expected != 0.0 => {
            ((expected / tolerance).abs().log10().ceil() as usize + 1).clamp(3, 13)
        }
        _ => 3,
    };
    quantity(check.value, check.unit, digits)
}

/// The rule in words.
pub fn rule(check: &Check) -> String {
    let show = |value: f64, digits: usize| quantity(value, check.unit, digits);
    match check.rule {
        Rule::Near { expected, tolerance: 0.0 } => format!("equal to {}", show(expected, 13)),
        Rule::Near { expected, tolerance } => format!("within {} of {}", show(tolerance, 2), show(expected, 13)),
        Rule::AtMost(limit) => format!("at most {}", show(limit, 3)),
        Rule::AtLeast(limit) => format!("at least {}", show(limit, 4)),
    }
}

/// The finding: in the claim's own words, or its first number.
pub fn found(claim: &Claim) -> String {
    match claim.checks.first() {
        Some(check) if claim.found.is_empty() => value(check),
        _ => claim.found.clone(),
    }
}

fn quantity(value: f64, unit: &str, digits: usize) -> String {
    match unit {
        "1" if value == 0.0 => "0\u{a0}%".into(),
        "1" if tiny(value) => share(value),
        "1" => engineering(100.0 * value, "%", digits),
        "" => engineering(value, "", digits),
        _ if value == 0.0 => format!("0\u{a0}{}", taut::number::pretty_unit(unit)),
        _ => si(value, unit, digits),
    }
}

/// `K_t` with its subscript set as such, and straight quotation marks as round ones.
pub fn symbols(text: &str) -> Markup {
    let mut open = false;
    let mut round = |text: &str| -> String {
        let turn = |c: char| match c {
            '"' => {
                open = !open;
                if open { '“' } else { '”' }
            }
            c => c,
        };
        text.chars().map(turn).collect()
    };
    let words = text.split_inclusive([' ', '/', '(', ')', ',', ';', '=']);
    html! {
        @for word in words {
            @let (head, tail) = subscript(word);
            (round(head))
            @if let Some((below, rest)) = tail { sub { (below) } (round(rest)) }
        }
    }
}

/// Splits `k_nt,` into `k`, and `nt` and `,`.
fn subscript(word: &str) -> (&str, Option<(&str, &str)>) {
    let Some((head, tail)) = word.split_once('_') else { return (word, None) };
    let end = tail.find(|c: char| !c.is_alphanumeric()).unwrap_or(tail.len());
    (head, Some((&tail[..end], &tail[end..])))
}
