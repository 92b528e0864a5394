//! Rows of a picture.

/// Rows of a picture: of a longer run every second one is computed, every third, …
const ROWS: u64 = 4000;

/// Interval between the rows of a picture, s, of a run with `rows` rows every `every` seconds.
pub fn interval(every: f64, rows: u64) -> f64 {
    every * rows.div_ceil(ROWS).max(1) as f64
}
