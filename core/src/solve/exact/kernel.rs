//! The kernels: what is compiled for vectors of one size each, and which of them a machine takes.
//!
//! A page for somebody who has never seen vector instructions. What the exact solver does all day is to multiply a
//! matrix with a vector: the state z after an interval is z + P z, its rate is A z, the values of all guards are G z. A
//! processor can add or multiply four numbers at once, if they lie side by side in memory and the program says so. The
//! compiler says so by itself where three things hold:
//!
//! - **The length is known when it compiles.** A vector here has `N` places, `N` being 8, 12, 16, 20 or 40 and never
//!   just "some". So every function of the solver exists five times, and [`in_kernel`] picks the smallest that has room
//!   for a machine: 8 for an axis of three bodies with its input held (six states, u, and a one for what is constant).
//!   What is left over is zero, and costs as much as anything else.
//! - **What is summed lies apart.** A sum of eight numbers waits for itself seven times. So matrices are kept by
//!   columns: to the vector of sums is added first column times z₁, then second column times z₂; the eight sums of a
//!   vector are eight chains that do not wait for each other. The guards of a mode stand side by side in the same way,
//!   eight to a group, and so do the forms whose squares make up the energy.
//! - **Nobody asks on the way.** A condition in the innermost loop keeps the compiler from it. Zeros are multiplied
//!   like other numbers; what is rare (a guard below zero, an event) is looked for afterwards.
//!
//! The same source is compiled twice, for any processor (two numbers at once) and for those with AVX2 (four), and the
//! choice is made where the program runs. Both do the same operations in the same order, and multiply and add are two
//! roundings in both (no FMA), so that they give the same bits. Where this can be seen: [`crate::solve::propagator`]
//! (the products), `matrices.rs` (guards and energy), [`crate::solve::record`] (columns).
//!
//! How a vector is laid out is the mechanism's to say ([`crate::mechanism::Layout`] and [`super::Space`]): nothing here
//! knows an axis from a gantry.

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
        /// Makes something for the smallest kernel that has room for a machine's vector: see [`super::Space::size`].
        pub(in crate::solve) fn in_kernel<M: Make>(size: usize, what: M) -> M::Made {
            match () {
                $(() if size <= $places => what.make::<$places>(),)*
                () => what.make::<$most>(),
            }
        }

        // The last one has room for every mechanism, however many of its parts are drives.
        const _: () = assert!($most > 2 * BODIES + (BODIES_AND_DRIVES - BODIES) * (DEGREE + 2));
        const _: () = assert!($most > 2 * (BODIES_AND_DRIVES - DRIVES) + DRIVES * (DEGREE + 2));
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
    // Two drives or three, and smooth inputs
    else [40]
}

/// The modes of one machine that are ready, in one kernel.
pub(super) type Modes<const N: usize> = Vec<Arc<ModeMatrices<N>>>;
