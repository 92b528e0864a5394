//! Linear forms of the columns of the state.

use super::BLOCK;
use crate::mechanism::{BODIES, DRIVES, Form, Layout, SPRINGS};
use std::ops::Range;

/// Values of one quantity in the rows of a block.
pub(super) type Values = [f64; BLOCK];

/// Maximum number of terms of a sum: the load on bodies that move as one contains every spring on each body, and the
/// currents.
const TERMS: usize = SPRINGS * BODIES + DRIVES;

/// A linear form of columns: indices and weights, added in this order, and a constant.
#[derive(Debug, Clone)]
pub(super) struct Sum {
    places: [u8; TERMS],
    weights: [f64; TERMS],
    count: usize,
    pub(super) constant: f64,
}

impl Sum {
    /// A constant.
    pub(super) fn constant(constant: f64) -> Self {
        Self { places: [0; TERMS], weights: [0.0; TERMS], count: 0, constant }
    }

    pub(super) fn add(&mut self, place: usize, weight: f64) {
        if weight != 0.0 {
            (self.places[self.count], self.weights[self.count]) = (place as u8, weight);
            self.count += 1;
        }
    }

    /// Its values in these rows, one for each in `out`. −0 + 0 is 0.
    #[inline(always)]
    pub(super) fn put(&self, columns: &[Values], rows: Range<usize>, out: &mut [f64]) {
        let (column, constant) = (|place: u8| &columns[usize::from(place)][rows.clone()], self.constant);
        let (places, weights) = (&self.places[..self.count], &self.weights[..self.count]);
        let (more, by) = match (places, weights) {
            (&[a], &[wa]) => {
                out.iter_mut().zip(column(a)).for_each(|(out, a)| *out = wa * a + constant);
                return;
            }
            (&[a, b, ref places @ ..], &[wa, wb, ref weights @ ..]) => {
                let terms = column(a).iter().zip(column(b));
                out.iter_mut().zip(terms).for_each(|(out, (a, b))| *out = (wa * a + constant) + wb * b);
                (places, weights)
            }
            _ => {
                out.fill(constant);
                return;
            }
        };
        for (&place, &weight) in more.iter().zip(by) {
            out.iter_mut().zip(column(place)).for_each(|(out, value)| *out += weight * value);
        }
    }
}

/// Indices of the columns, each after those that it depends on: first the numbers of a row in their order.
#[derive(Clone)]
pub(super) struct Places {
    pub(super) bodies: usize,
    pub(super) springs: usize,
    pub(super) drives: usize,
    /// Numbers per row, and indices of the inputs.
    pub(super) stride: usize,
    pub(super) inputs: [usize; DRIVES],
    pub(super) layout: Layout,
}

impl Places {
    /// A body's coordinate: its position relative to the origin, or the elongation that replaces it.
    pub(super) fn coordinate(&self, body: usize) -> usize {
        self.layout.coordinate[body]
    }

    pub(super) fn speed(&self, body: usize) -> usize {
        self.layout.speed[body]
    }

    pub(super) fn input(&self, drive: usize) -> usize {
        self.inputs[drive]
    }

    pub(super) fn stretch(&self, spring: usize) -> usize {
        self.stride + spring
    }

    /// A body's position.
    pub(super) fn way(&self, body: usize) -> usize {
        self.stretch(self.springs) + body
    }

    pub(super) fn force(&self, spring: usize) -> usize {
        self.way(self.bodies) + spring
    }

    pub(super) fn current(&self, drive: usize) -> usize {
        self.force(self.springs) + drive
    }

    pub(super) fn count(&self) -> usize {
        self.current(self.drives)
    }

    /// A form as a sum of columns.
    pub(super) fn sum(&self, form: &Form) -> Sum {
        let mut sum = Sum::constant(form.constant);
        (0..self.springs).for_each(|j| sum.add(self.stretch(j), form.stretch[j]));
        (0..self.bodies).for_each(|j| sum.add(self.speed(j), form.speed[j]));
        let states =
            self.layout.current.iter().zip(form.current).filter_map(|(place, factor)| Some(((*place)?, factor)));
        states.for_each(|(place, factor)| sum.add(place, factor));
        (0..self.drives).for_each(|j| sum.add(self.input(j), form.input[j]));
        sum
    }
}
