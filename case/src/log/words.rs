//! Names and numbers as messages show them.

/// The one of `names` that differs from `name` in case only, or in at most one letter of three.
pub(super) fn near<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |n: &str| strsim::damerau_levenshtein(&n.to_lowercase(), &name.to_lowercase());
    names
        .map(|n| (distance(n), n))
        .min_by_key(|(d, _)| *d)
        .filter(|(d, _)| 3 * d <= name.chars().count())
        .map(|(_, n)| n)
}

/// `text` between backquotes, at most 40 characters of it.
pub(super) fn shown(text: &str) -> String {
    let cut: String = text.chars().take(40).map(|c| if c.is_control() { '·' } else { c }).collect();
    if cut.len() < text.len() && text.chars().count() > 40 { format!("`{cut}…`") } else { format!("`{cut}`") }
}

pub(super) fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
