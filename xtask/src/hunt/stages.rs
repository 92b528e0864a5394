//! Random stages against the independent solver, in a program of its own.

use super::succeeds;
use crate::cargo;

pub fn run(stages: u64, seed: u64) -> Result<(), String> {
    let (stages, seed) = (stages.to_string(), seed.to_string());
    let words = ["run", "--release", "--package", "taut-hunt", "--", "--stages", &stages, "--seed", &seed];
    succeeds(&mut cargo(&words))
}
