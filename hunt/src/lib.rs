//! A hunt for wrong answers of taut.
//!
//! Random stages over wide ranges, drawn by seed, are run by taut and by an independent solver, which shares no code
//! with taut's mechanism, solvers and
//! friction: it takes a stage as data and writes its own equations, in numbers of about 106 bits. `docs/trust.md` says
//! what is compared.

pub mod answer;
pub mod by;
pub mod c;
pub mod compare;
pub mod curve;
pub mod double;
pub mod draw;
pub mod events;
pub mod exchange;
mod folder;
pub mod gantry;
pub mod input;
pub mod law;
pub mod linear;
pub mod loops;
pub mod machine;
pub mod replay;
pub mod root;
pub mod series;
pub mod solve;
pub mod stages;
pub mod steps;
pub mod subject;
pub mod swept;
pub mod terms;
