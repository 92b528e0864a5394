//! The program `taut`.

mod paper;

fn main() {}
