//! Every reader of taut as a plain function of bytes, files to begin with, and ways to spoil them.
//!
//! A [`Target`] takes any bytes and says how far they got; it panics where a law of its reader is broken. The tests run
//! each target over its [`corpus`] and seeded [`mutation`]s of it, within the [`bounds`] of processor time and memory.
//! libFuzzer drives the same functions from `libfuzzer/`, which `cargo xtask hunt --part readers` does.

pub mod bounds;
pub mod corpus;
pub mod hunt;
pub mod mutation;
mod targets;

/// How far an input got.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reached {
    /// The reader refused it.
    Refused,
    /// It was read, and what it stands for was used.
    Read,
}

/// How an input is spoiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spoiling {
    /// By lines, words and numbers.
    Text,
    /// By bytes, lengths and counts.
    Binary,
    /// The same, and its elements packed as MATLAB's version 7 does.
    Matlab,
}

/// An input to begin with.
#[derive(Debug, Clone)]
pub struct Seed {
    /// Where it comes from.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
    /// True if the reader has to take it.
    pub good: bool,
}

/// A reader under test.
pub struct Target {
    /// Its name, also that of its libFuzzer program.
    pub name: &'static str,
    /// How its inputs are spoiled.
    pub kind: Spoiling,
    /// The words that are put into them.
    pub words: &'static [&'static str],
    /// The reader, and a use of what it reads.
    pub run: fn(&[u8]) -> Reached,
    /// The inputs to begin with.
    pub seeds: fn() -> Vec<Seed>,
}

/// All of them.
pub const TARGETS: [Target; 9] = [
    Target { name: "case", kind: Spoiling::Text, words: mutation::TOML, run: targets::case, seeds: corpus::cases },
    Target {
        name: "quantity",
        kind: Spoiling::Text,
        words: mutation::UNITS,
        run: targets::quantity,
        seeds: corpus::quantities,
    },
    Target { name: "csv", kind: Spoiling::Text, words: mutation::CSV, run: targets::log, seeds: corpus::csv },
    Target { name: "parquet", kind: Spoiling::Binary, words: &[], run: targets::log, seeds: corpus::parquet },
    Target { name: "matlab", kind: Spoiling::Matlab, words: &[], run: targets::log, seeds: corpus::matlab },
    Target {
        name: "samples",
        kind: Spoiling::Text,
        words: mutation::CSV,
        run: targets::accelerometer,
        seeds: corpus::samples,
    },
    Target {
        name: "spectrum",
        kind: Spoiling::Text,
        words: mutation::CSV,
        run: targets::accelerometer,
        seeds: corpus::spectra,
    },
    Target { name: "gcode", kind: Spoiling::Text, words: mutation::GCODE, run: targets::gcode, seeds: corpus::gcode },
    Target { name: "draws", kind: Spoiling::Text, words: mutation::CSV, run: targets::draws, seeds: corpus::draws },
];

/// The target of that name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
