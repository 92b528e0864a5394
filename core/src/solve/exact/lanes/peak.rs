//! Steps that may have a peak, kept until it is known how high the others are.

use super::flight::Moving;
use super::part::Part;

/// Where a kept step begins: numbers of the law and of the inputs, the state, the time, and its length, s.
pub(super) struct Start<const S: usize, const D: usize> {
    pub(super) law: usize,
    pub(super) held: usize,
    pub(super) z: Moving<f64, S, D>,
    pub(super) begin: f64,
    pub(super) length: f64,
}

/// A step within which a quantity may have its peak: its start and slot, the quantity, and a bound of its magnitude.
pub(super) struct Later {
    pub(super) start: usize,
    pub(super) slot: usize,
    pub(super) part: Part,
    pub(super) upper: f64,
}
