//! Keeps numbers and their units on one line.

use std::fmt::Write;

/// Units of which prefixes make others.
const BASES: [&str; 14] = ["m", "s", "g", "N", "Hz", "V", "A", "Ω", "rad", "W", "J", "Pa", "H", "F"];
const PREFIXES: [&str; 10] = ["", "k", "M", "G", "m", "µ", "u", "n", "p", "c"];
/// Units that stand for themselves.
const OTHERS: [&str; 8] = ["%", "°", "°C", "dB", "rpm", "krpm", "min", "1"];

/// The HTML with each number and its unit in a span that does not break; tags are unchanged.
pub(crate) fn numbers_and_units(html: &str) -> String {
    let mut out = String::with_capacity(html.len());
    for piece in html.split_inclusive('>') {
        let (text, tag) = piece.find('<').map_or((piece, ""), |at| piece.split_at(at));
        wrap(text, &mut out);
        out.push_str(tag);
    }
    out
}

fn wrap(text: &str, out: &mut String) {
    let words: Vec<&str> = text.split(' ').collect();
    let mut k = 0;
    while k < words.len() {
        let count = 1 + units_after(&words[k..]);
        let quantity = words[k..k + count].join(" ");
        let breaks = count > 1 || is_number(words[k]) && words[k].contains("e-");
        let _ = if breaks { write!(out, "<span class=\"q\">{quantity}</span>") } else { write!(out, "{quantity}") };
        k += count;
        if k < words.len() {
            out.push(' ');
        }
    }
}

/// How many words are the unit of the number that is the first word; a full stop or a comma ends it.
fn units_after(words: &[&str]) -> usize {
    if !is_number(words[0]) {
        return 0;
    }
    let mut count = 0;
    for word in &words[1..] {
        if !is_unit(word.trim_end_matches(['.', ',', ';', ':', ')'])) {
            break;
        }
        count += 1;
        if word.ends_with(['.', ',', ';', ':', ')']) {
            break;
        }
    }
    count
}

/// `12.5`, `−3×10⁻⁵`, `(7`.
fn is_number(word: &str) -> bool {
    let word = word.trim_start_matches(['(', '−', '-', '+', '±', '≈', '<', '>']);
    let inside = |c: char| c.is_ascii_digit() || ".×⁻⁰¹²³⁴⁵⁶⁷⁸⁹e-−".contains(c);
    word.starts_with(|c: char| c.is_ascii_digit())
        && word.chars().all(inside)
        && word.ends_with(|c: char| c != '.' && c != '-')
}

fn is_unit(word: &str) -> bool {
    let of_one = |part: &str| {
        let part = part.trim_end_matches(|c: char| "⁻¹²³⁴^23".contains(c));
        OTHERS.contains(&part)
            || PREFIXES.iter().any(|prefix| part.strip_prefix(prefix).is_some_and(|rest| BASES.contains(&rest)))
    };
    !word.is_empty() && word.split(['/', '·']).all(of_one)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In columns of 750 pixels "250.44" stood at the end of a line and "µm" at the beginning of the next; "1.6e-" and
    /// "5" too.
    #[test]
    fn numbers_stay_beside_their_units() {
        let cases = [
            ("<td>250.44 µm</td>", "<td>[250.44 µm]</td>"),
            ("500 µN m, then", "[500 µN m,] then"),
            ("−3×10⁻⁵ kg m² (7 N/m) s", "[−3×10⁻⁵ kg m²] [(7 N/m)] s"),
            ("12 runs of 5 s. A", "12 runs of [5 s.] A"),
            ("1.6e-5 is 1.6e-5 N m s/rad", "[1.6e-5] is [1.6e-5 N m s/rad]"),
            ("<p class=\"a 5 s\">2 m</p> ", "<p class=\"a 5 s\">[2 m]</p> "),
            ("a m 5, V 1. 3", "a m 5, V 1. 3"),
        ];
        for (html, kept) in cases {
            let kept = kept.replace('[', "<span class=\"q\">").replace(']', "</span>");
            assert_eq!(numbers_and_units(html), kept);
        }
    }
}
