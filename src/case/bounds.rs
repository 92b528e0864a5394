//! How much a case file holds, before it is read: its reader takes some 300 bytes for every value, key and table.

use super::tree::Source;
use crate::error::{Error, Result};
use std::ops::Range;

/// Largest case file, in bytes; what is longer than that belongs into a CSV file.
pub(super) const LARGEST_FILE: usize = 16 << 20;

/// Most of the signs that part values, keys and tables, in a whole file: `=`, `,`, `.`, `[`, `{` outside texts and remarks.
const MOST_PARTS: usize = 1_000_000;

/// Most tables within tables that a key or a header may name.
const DEEPEST: usize = 16;

/// Refuses what is too large or too deep.
pub(super) fn check(source: &Source) -> Result<()> {
    let text = source.text.as_str();
    if text.len() > LARGEST_FILE {
        return Err(Error::new("this case file is too large")
            .in_file(&source.name)
            .allowed(format!("up to {LARGEST_FILE} bytes"))
            .next("put long tables into a CSV file, and read it with input = { file = ... }"));
    }
    let (mut parts, mut points, mut word) = (0, 0, 0);
    let mut place = 0;
    while let Some(&byte) = text.as_bytes().get(place) {
        match byte {
            b'"' | b'\'' => {
                place = end_of_text(text, place);
                continue;
            }
            b'#' => {
                place = text[place..].find('\n').map_or(text.len(), |length| place + length);
                continue;
            }
            b'.' => {
                (parts, points) = (parts + 1, points + 1);
                if points > DEEPEST {
                    return Err(too_deep(source, word..place));
                }
            }
            b'=' | b',' | b'[' | b'{' => (parts, points, word) = (parts + 1, 0, place + 1),
            b'\n' => (points, word) = (0, place + 1),
            _ => {}
        }
        if parts > MOST_PARTS {
            return Err(Error::new("this case file holds too many values, keys and tables")
                .at(source.place(place..place + 1))
                .allowed(format!("{MOST_PARTS} of them, counted by the signs = , . [ and {{"))
                .next("put long tables into a CSV file, and read it with input = { file = ... }"));
        }
        place += 1;
    }
    Ok(())
}

fn too_deep(source: &Source, range: Range<usize>) -> Error {
    Error::new("this is nested too deeply").at(source.place(range)).next("nest lists and tables less deeply")
}

/// Where the text that begins here ends: behind its closing quotes, or with its line where there are none.
fn end_of_text(text: &str, begin: usize) -> usize {
    let quote = &text[begin..=begin];
    let triple = quote.repeat(3);
    let long = text[begin..].starts_with(&triple);
    let closing = if long { triple.as_str() } else { quote };
    let mut place = begin + closing.len();
    while place < text.len() {
        let rest = &text.as_bytes()[place..];
        if rest.starts_with(closing.as_bytes()) {
            return place + closing.len();
        }
        match rest[0] {
            b'\\' if quote == "\"" => place += 2,
            b'\n' if !long => return place,
            _ => place += 1,
        }
    }
    text.len()
}
