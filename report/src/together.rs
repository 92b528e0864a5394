//! Keeps numbers and their units on one line.

/// Units of which prefixes make others.
const BASES: [&str; 14] = ["m", "s", "g", "N", "Hz", "V", "A", "Ω", "rad", "W", "J", "Pa", "H", "F"];
const PREFIXES: [&str; 10] = ["", "k", "M", "G", "m", "µ", "u", "n", "p", "c"];
/// Units that stand for themselves.
const OTHERS: [&str; 8] = ["%", "°", "°C", "dB", "rpm", "krpm", "min", "1"];

/// The same HTML with a space that does not break between a number and its unit, and between the parts of a unit; tags
/// stay as they are.
pub(crate) fn numbers_and_units(html: &str) -> String {
    let mut out = String::with_capacity(html.len());
    for piece in html.split_inclusive('>') {
        let (text, tag) = piece.find('<').map_or((piece, ""), |at| piece.split_at(at));
        join(text, &mut out);
        out.push_str(tag);
    }
    out
}

fn join(text: &str, out: &mut String) {
    let mut quantity = false;
    for (i, word) in text.split(' ').enumerate() {
        let belongs = quantity && is_unit(word.trim_end_matches(['.', ',', ';', ':', ')']));
        if i > 0 {
            out.push(if belongs { '\u{a0}' } else { ' ' });
        }
        out.push_str(word);
        // A full stop or a comma ends it.
        quantity = is_number(word) || belongs && word.ends_with(char::is_alphanumeric);
    }
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

    /// In columns of 750 pixels "250.44" stood at the end of a line and "µm" at the beginning of the next.
    #[test]
    fn numbers_stay_beside_their_units() {
        let cases = [
            ("<td>250.44 µm</td>", "<td>250.44\u{a0}µm</td>"),
            ("500 µN m, then", "500\u{a0}µN\u{a0}m, then"),
            ("−3×10⁻⁵ kg m² (7 N/m) s", "−3×10⁻⁵\u{a0}kg\u{a0}m² (7\u{a0}N/m) s"),
            ("12 runs of 5 s. A", "12 runs of 5\u{a0}s. A"),
            ("<p class=\"a 5 s\">2 m</p>", "<p class=\"a 5 s\">2\u{a0}m</p>"),
            ("a m 5, V 1. 3", "a m 5, V 1. 3"),
        ];
        for (html, kept) in cases {
            assert_eq!(numbers_and_units(html), kept);
        }
    }
}
