//! Kernels: code compiled for vectors of a fixed size, and the choice of one for a machine.
//!
//! An introduction for readers without knowledge of vector instructions. The exact solver mainly multiplies a matrix by
//! a vector: the state z after an interval is z + P z, its rate is A z, the values of all guards are G z. A processor
//! can add or multiply four numbers at once, if they lie side by side in memory and the program says so. The compiler
//! does so by itself under three conditions:
//!
//! - **The length is known when it compiles.** A vector here has `N` places, `N` being 8, 12, 16, 20 or 40 and never
//!   just "some". So every function of the solver exists five times, and [`in_kernel`] picks the smallest that has room
//!   for a machine: 8 for an axis of three bodies with its input held (six states, u, and a one for what is constant).
//!   The remaining places are zero, at the same cost.
//! - **Terms of a sum lie apart.** A sum of eight numbers is a chain of seven dependent additions. So matrices are kept
//!   by columns: to the vector of sums is added first column times z₁, then second column times z₂; the eight sums of a
//!   vector are eight independent chains. The guards of a mode lie side by side in the same way, eight to a group, as
//!   do the forms whose squares make up the energy.
//! - **No branches inside.** A condition in the innermost loop prevents vectorisation. Zeros are multiplied like other
//!   numbers; rare cases (a guard below zero, an event) are detected afterwards.
//!
//! The same source is compiled twice, for any processor (two numbers at once) and for those with AVX2 (four), and the
//! choice is made at run time. Both do the same operations in the same order, and multiply and add are two roundings in
//! both (no FMA), so that they give the same bits. Examples: [`crate::solve::propagator`] (the products), `matrices.rs`
//! (guards and energy), [`crate::solve::record`] (columns).
//!
//! The mechanism defines the layout of a vector ([`crate::mechanism::Layout`] and [`super::Space`]), so kernels do not
//! distinguish an axis from a gantry.

use super::ModeMatrices;
use crate::mechanism::{BODIES, BODIES_AND_DRIVES, DRIVES};
use crate::signal::DEGREE;
use std::sync::Arc;

/// Something that is made for one kernel: vectors of `N` places.
pub(in crate::solve) trait Make {
    /// Result type, common to all kernels.
    type Made;

    /// Makes it.
    fn make<const N: usize>(self) -> Self::Made;
}

/// Writes [`in_kernel`] from the list of kernels: places of a vector, four or a multiple of it.
macro_rules! kernels {
    ($([$places:literal])* else [$most:literal]) => {
        /// Makes something for the smallest kernel that holds a machine's vector: see [`super::Space::size`].
        pub(in crate::solve) fn in_kernel<M: Make>(size: usize, what: M) -> M::Made {
            match () {
                $(() if size <= $places => what.make::<$places>(),)*
                () => what.make::<$most>(),
            }
        }

        // The last one holds every mechanism.
        const _: () = assert!($most > 2 * BODIES + (BODIES_AND_DRIVES - BODIES) * (DEGREE + 2));
        const _: () = assert!($most > 2 * (BODIES_AND_DRIVES - DRIVES) + DRIVES * (DEGREE + 2));
    };
}

kernels! {
    // One drive, three bodies, held inputs
    [8]
    // The same with inductance or an independent rotor, with linear inputs, or with two drives
    [12]
    // One drive and smooth inputs with their derivatives
    [16]
    // The same with inductance or a rotor
    [20]
    // Two drives or three, and smooth inputs
    else [40]
}

/// The computed modes of one machine, in one kernel.
pub(super) type Modes<const N: usize> = Vec<Arc<ModeMatrices<N>>>;
