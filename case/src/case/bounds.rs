//! How much a case file holds, before it is read: its reader makes hundreds of bytes of a value, a thousand of a table.

use super::source::Source;
use crate::error::{Error, Result};

/// Largest case file, in bytes; what is longer than that belongs into a CSV file.
pub const LARGEST_FILE: usize = 16 << 20;

/// Most that the signs of a file may weigh in all; one of weight 1 stands for about 200 bytes of memory.
const MOST: usize = 1_500_000;

/// Weight of a header, and of a point that leads through a table.
const TABLE: usize = 8;

/// Weight of `{`, of `=`, and of what parts values.
const INLINE: usize = 4;
const KEY: usize = 3;
const VALUE: usize = 1;

/// Most tables within tables that a key or a header may name.
const DEEPEST: usize = 16;

/// Refuses what is too large or too deep.
pub(super) fn check(source: &Source) -> Result<()> {
    let long = "put long tables into a CSV file, and read it with input = { file = ... }";
    if source.text.len() > LARGEST_FILE {
        return Err(Error::new("this case file is too large")
            .in_file(&source.name)
            .allowed(format!("up to {LARGEST_FILE} bytes"))
            .next(long));
    }
    let mut signs = Signs { text: &source.text, place: 0, depth: 0, is_key: true, begins: true, word: 0, points: 0 };
    let mut all = 0;
    while let Some(weight) = signs.next() {
        all += weight;
        if signs.points > DEEPEST {
            let error = Error::new("this is nested too deeply").at(source.place(signs.word..signs.place));
            return Err(error.next("nest lists and tables less deeply"));
        }
        if all > MOST {
            return Err(Error::new("this case file holds too many values, keys and tables")
                .at(source.place(signs.place - 1..signs.place))
                .allowed("some 300,000 points of a table, 500,000 keys, or 180,000 tables")
                .next(long));
        }
    }
    Ok(())
}

/// The signs of a TOML text outside its strings and remarks. Of what is no TOML the weights mean nothing, and none is
/// needed.
struct Signs<'a> {
    text: &'a str,
    place: usize,
    /// Lists and tables in one line that are open.
    depth: usize,
    /// True if this is a header, or what stands before `=` on a line.
    is_key: bool,
    /// True if nothing stood on this line yet.
    begins: bool,
    /// Where the last word began, and the points in it.
    word: usize,
    points: usize,
}

impl Signs<'_> {
    /// The weight of the next byte; none at the end.
    fn next(&mut self) -> Option<usize> {
        let bytes = self.text.as_bytes();
        let place = self.place;
        let byte = *bytes.get(place)?;
        self.place += 1;
        let begins = std::mem::replace(&mut self.begins, false) && self.depth == 0;
        match byte {
            b' ' | b'\t' | b'\r' => self.begins = begins,
            b'"' | b'\'' => self.place = end_of_text(self.text, place),
            b'#' => self.place = self.text[place..].find('\n').map_or(bytes.len(), |length| place + length),
            b'.' => return Some(self.point(place)),
            b'\n' => {
                self.part();
                (self.begins, self.is_key) = (true, self.depth == 0);
            }
            b'[' if begins => {
                self.part();
                return Some(TABLE);
            }
            // The second bracket of [[experiment]].
            b'[' if self.is_key => self.part(),
            b'[' | b'{' => {
                self.part();
                self.depth += 1;
                return Some(if byte == b'{' { INLINE } else { VALUE });
            }
            b']' | b'}' if !self.is_key => self.depth = self.depth.saturating_sub(1),
            b'=' => {
                self.part();
                self.is_key = false;
                return Some(KEY);
            }
            b',' => {
                self.part();
                return Some(VALUE);
            }
            _ => {}
        }
        Some(0)
    }

    /// A new word begins.
    fn part(&mut self) {
        (self.word, self.points) = (self.place, 0);
    }

    /// A point leads through a table, unless it is that of a number.
    fn point(&mut self, place: usize) -> usize {
        self.points += 1;
        let digit = |place: Option<usize>| {
            place.and_then(|place| self.text.as_bytes().get(place)).is_some_and(u8::is_ascii_digit)
        };
        let number = !self.is_key && self.points == 1 && digit(place.checked_sub(1)) && digit(Some(place + 1));
        if number { VALUE } else { TABLE }
    }
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
