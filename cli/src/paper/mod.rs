//! `taut paper`: recomputes Sollmann & Jouaneh (2011).
#![allow(dead_code)]

mod linear;
mod model;
