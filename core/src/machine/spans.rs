//! One number for each span of a belt.

use std::fmt;
use std::ops::{Deref, DerefMut};

/// Maximum number of spans.
const ROOM: usize = 6;

/// One number for each span, in the order of the geometry: a `Copy` list that derefs to a slice.
#[derive(Clone, Copy, PartialEq)]
pub struct Spans {
    /// Values behind `count` are zero.
    values: [f64; ROOM],
    count: usize,
}

impl Spans {
    /// One value for each of `count` spans.
    pub fn all(count: usize, value: f64) -> Self {
        std::iter::repeat_n(value, count).collect()
    }

    /// Applies `change` to each number.
    pub fn map(self, change: impl FnMut(f64) -> f64) -> Self {
        self.into_iter().map(change).collect()
    }

    /// Values of the three spans of an axis.
    pub fn three(self) -> [f64; 3] {
        let [first, second, third, ..] = self.values;
        [first, second, third]
    }
}

impl<const N: usize> From<[f64; N]> for Spans {
    fn from(values: [f64; N]) -> Self {
        const { assert!(N <= ROOM) };
        values.into_iter().collect()
    }
}

impl FromIterator<f64> for Spans {
    /// Panics if there are more than the maximum.
    fn from_iter<I: IntoIterator<Item = f64>>(given: I) -> Self {
        let (mut values, mut count) = ([0.0; ROOM], 0);
        for value in given {
            values[count] = value;
            count += 1;
        }
        Self { values, count }
    }
}

impl Deref for Spans {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

impl DerefMut for Spans {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[..self.count]
    }
}

impl IntoIterator for Spans {
    type Item = f64;
    type IntoIter = std::iter::Take<std::array::IntoIter<f64, ROOM>>;

    fn into_iter(self) -> Self::IntoIter {
        self.values.into_iter().take(self.count)
    }
}

impl<'a> IntoIterator for &'a Spans {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a> IntoIterator for &'a mut Spans {
    type Item = &'a mut f64;
    type IntoIter = std::slice::IterMut<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<const N: usize> PartialEq<[f64; N]> for Spans {
    fn eq(&self, other: &[f64; N]) -> bool {
        self[..] == other[..]
    }
}

impl fmt::Debug for Spans {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self[..].fmt(f)
    }
}
