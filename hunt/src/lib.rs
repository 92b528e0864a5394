//! A hunt for wrong answers of taut.
//!
//! Random stages over wide ranges, drawn by seed, are run by taut and by an independent solver, which shares no code
//! with taut's mechanism, solvers and
//! friction: it takes a stage as data and writes its own equations, in numbers of about 106 bits. `docs/trust.md` says
//! what is compared.

pub mod compare;
pub mod double;
pub mod draw;
pub mod events;
pub mod input;
pub mod law;
pub mod machine;
pub mod root;
pub mod series;
pub mod solve;
pub mod stages;
