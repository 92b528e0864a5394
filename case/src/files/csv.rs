//! Trajectories out as CSV.

use crate::error::Result;
use crate::files::Draft;
use crate::trajectory::{Column, Trajectory};
use std::path::Path;

/// Bytes collected before they are written.
const CHUNK: usize = 1 << 16;

/// Writes a trajectory block by block: a row of [`Column::heading`]s, then numbers parted by commas.
///
/// Every number has the fewest digits that read back to the same bits. The file has a temporary name until
/// [`CsvWriter::finish`], and is removed if that is never called.
#[derive(Debug)]
pub struct CsvWriter {
    draft: Draft,
    text: Vec<u8>,
    /// The digits written last in each column: inputs and states seldom change from row to row.
    last: Vec<Digits>,
    /// The row written last from its second number on.
    tail: Vec<u8>,
}

impl CsvWriter {
    /// Begins the file; its folder exists.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        Ok(Self {
            draft: Draft::create(path)?,
            text: Vec::with_capacity(2 * CHUNK),
            last: Vec::new(),
            tail: Vec::new(),
        })
    }

    /// Adds the rows of `block`; every block has the same columns.
    pub fn write(&mut self, block: &Trajectory) -> Result<()> {
        if self.last.is_empty() {
            let headings: Vec<String> = block.columns.iter().map(Column::heading).collect();
            self.text.extend(headings.join(",").bytes());
            self.text.push(b'\n');
            self.last = vec![Digits::new(0.0); block.columns.len()];
        }
        let Some((first, others)) = block.columns.split_first() else { return Ok(()) };
        for row in 0..block.len() {
            self.last[0].become_those_of(first.values[row]);
            self.last[0].write_to(&mut self.text);
            let same = |(column, last): (&Column, &Digits)| column.values[row].to_bits() == last.bits;
            if self.tail.is_empty() || !others.iter().zip(&self.last[1..]).all(same) {
                // What moves; at rest only time goes on.
                self.tail.clear();
                for (column, last) in others.iter().zip(&mut self.last[1..]) {
                    last.become_those_of(column.values[row]);
                    self.tail.push(b',');
                    last.write_to(&mut self.tail);
                }
                self.tail.push(b'\n');
            }
            self.text.extend_from_slice(&self.tail);
            if self.text.len() >= CHUNK {
                self.draft.write(&self.text)?;
                self.text.clear();
            }
        }
        Ok(())
    }

    /// Writes what is left and gives the file its name.
    pub fn finish(mut self) -> Result<()> {
        self.draft.write(&self.text)?;
        self.draft.finish()
    }
}

/// A number as it is written.
#[derive(Debug, Clone, Copy)]
struct Digits {
    bits: u64,
    length: usize,
    text: [u8; 24],
}

impl Digits {
    fn new(value: f64) -> Self {
        let mut buffer = zmij::Buffer::new();
        let all = match value {
            v if v.is_finite() => buffer.format_finite(v),
            v if v.is_nan() => "NaN",
            v if v > 0.0 => "inf",
            _ => "-inf",
        };
        // A whole number needs no point.
        let digits = all.strip_suffix(".0").unwrap_or(all).as_bytes();
        let mut text = [0; 24];
        text[..digits.len()].copy_from_slice(digits);
        Self { bits: value.to_bits(), length: digits.len(), text }
    }

    /// Takes those of another number.
    fn become_those_of(&mut self, value: f64) {
        if value.to_bits() != self.bits {
            *self = Self::new(value);
        }
    }

    /// Writes them behind a text: all the room, of known size, and back.
    fn write_to(&self, text: &mut Vec<u8>) {
        let end = text.len() + self.length;
        text.extend_from_slice(&self.text);
        text.truncate(end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shown(value: f64) -> String {
        let mut text = Vec::new();
        Digits::new(value).write_to(&mut text);
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn numbers_are_short() {
        let texts = [0.0, -0.0, 5.0, 0.001, 0.1 + 0.2, -1.5e-7, 1e300, f64::NAN, f64::NEG_INFINITY].map(shown);
        assert_eq!(texts, ["0", "-0", "5", "0.001", "0.30000000000000004", "-1.5e-7", "1e+300", "NaN", "-inf"]);
        assert_eq!(shown(-f64::MIN_POSITIVE), "-2.2250738585072014e-308");
    }

    proptest! {
        #[test]
        fn numbers_read_back_to_the_same_bits(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(!value.is_nan());
            prop_assert_eq!(shown(value).parse::<f64>().unwrap().to_bits(), bits);
        }
    }
}
