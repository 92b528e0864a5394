//! The kernels: what is compiled for vectors of one size each, and which of them a machine takes.

use super::ModeMatrices;
use crate::mechanism::{BODIES, DRIVES};
use crate::signal::DEGREE;
use std::any::Any;
use std::sync::Arc;

/// Something that is made for one kernel: vectors of `N` places.
pub(in crate::solve) trait Make {
    /// The same for every kernel.
    type Made;

    /// Makes it.
    fn make<const N: usize>(self) -> Self::Made;
}

/// Writes [`in_kernel`] from the list of kernels: places of a vector, four or a multiple of it.
macro_rules! kernels {
    ($([$places:literal])* else [$most:literal]) => {
        /// Makes something for the smallest kernel that has room for a machine's vector: see [`super::Space::size`].
        pub(in crate::solve) fn in_kernel<M: Make>(size: usize, what: M) -> M::Made {
            match () {
                $(() if size <= $places => what.make::<$places>(),)*
                () => what.make::<$most>(),
            }
        }

        // The last one has room for every mechanism.
        const _: () = assert!($most > 2 * BODIES + DRIVES + DRIVES * (DEGREE + 1));
    };
}

kernels! {
    // One drive, three bodies, held inputs
    [8]
    // The same with inductance or a rotor of its own, with straight inputs, or with two drives
    [12]
    // One drive and smooth inputs, which carry their derivatives along
    [16]
    // The same with inductance or a rotor
    [20]
    // Two drives and smooth inputs
    else [32]
}

/// The modes of one machine that are ready, in one kernel.
pub(super) type Modes<const N: usize> = Vec<Arc<ModeMatrices<N>>>;

/// The modes that were made ready, by kernels: what runs of one machine can share.
#[derive(Default)]
pub(in crate::solve) struct Known(Vec<Box<dyn Any + Send>>);

impl Known {
    /// Forgets all of them: another machine.
    pub(in crate::solve) fn clear(&mut self) {
        self.0.clear();
    }

    /// The list of a kernel, empty where there is none yet.
    pub(super) fn list<const N: usize>(&mut self) -> &mut Modes<N> {
        let index = self.0.iter().position(|list| list.is::<Modes<N>>()).unwrap_or_else(|| {
            self.0.push(Box::new(Modes::<N>::new()));
            self.0.len() - 1
        });
        self.0[index].downcast_mut().expect("a list of this kernel")
    }
}
