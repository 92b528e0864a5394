//! The kernels: what is compiled for vectors of one size each, and which of them a machine takes.

use super::ModeMatrices;
use crate::mechanism::{BODIES, DRIVES};
use crate::signal::DEGREE;
use std::any::Any;
use std::sync::Arc;

/// Something that is made for one kernel: vectors of `R` places that move and `C` in all.
pub(in crate::solve) trait Make {
    /// The same for every kernel.
    type Made;

    /// Makes it.
    fn make<const R: usize, const C: usize>(self) -> Self::Made;
}

/// Writes [`in_kernel`] from the list of kernels: places that move, and places in all.
macro_rules! kernels {
    ($([$rows:literal, $columns:literal])* else [$most_rows:literal, $most_columns:literal]) => {
        /// Makes something for the smallest kernel that has room for a machine's vector: see [`super::Space::size`].
        pub(in crate::solve) fn in_kernel<M: Make>((moving, constant): (usize, usize), what: M) -> M::Made {
            match () {
                $(() if moving <= $rows && $rows + constant <= $columns => what.make::<$rows, $columns>(),)*
                () => what.make::<$most_rows, $most_columns>(),
            }
        }

        // The last one has room for every mechanism.
        const _: () = assert!($most_rows >= 2 * BODIES + DRIVES + DRIVES * DEGREE && $most_columns > $most_rows + DRIVES);
    };
}

kernels! {
    // One drive, three bodies, straight inputs
    [8, 10]
    // The same with a rotor of its own
    [12, 14]
    // One drive and smooth inputs, which carry their derivatives along
    [16, 18]
    // Two drives
    [16, 19]
    // Two drives and smooth inputs
    else [28, 31]
}

/// The modes of one machine that are ready, in one kernel.
pub(super) type Modes<const R: usize, const C: usize> = Vec<Arc<ModeMatrices<R, C>>>;

/// The modes that were made ready, by kernels: what runs of one machine can share.
#[derive(Default)]
pub(in crate::solve) struct Known(Vec<Box<dyn Any + Send>>);

impl Known {
    /// Forgets all of them: another machine.
    pub(in crate::solve) fn clear(&mut self) {
        self.0.clear();
    }

    /// The list of a kernel, empty where there is none yet.
    pub(super) fn list<const R: usize, const C: usize>(&mut self) -> &mut Modes<R, C> {
        let index = self.0.iter().position(|list| list.is::<Modes<R, C>>()).unwrap_or_else(|| {
            self.0.push(Box::new(Modes::<R, C>::new()));
            self.0.len() - 1
        });
        self.0[index].downcast_mut().expect("a list of this kernel")
    }
}
