//! The tests of `cli/tests/faults.rs` with more kills.

use super::succeeds;
use crate::cargo;

pub fn run(kills: u64, seed: u64) -> Result<(), String> {
    let words = ["test", "--package", "taut-cli", "--test", "all", "faults::", "--", "--nocapture"];
    succeeds(cargo(&words).env("TAUT_KILLS", kills.to_string()).env("TAUT_SEED", seed.to_string()))
}
