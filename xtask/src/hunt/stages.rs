//! Random stages, and cases with pairs of features, against the independent solver, in a program of its own.

use super::succeeds;
use crate::cargo;

pub fn run(part: &str, stages: u64, seed: u64, threads: Option<u64>, json: bool) -> Result<(), String> {
    let mut command = cargo(&["run", "--release", "--package", "taut-hunt", "--", part]);
    command.args(["--stages", &stages.to_string(), "--seed", &seed.to_string()]);
    if let Some(threads) = threads {
        command.args(["--threads", &threads.to_string()]);
    }
    if json {
        command.arg("--json");
    }
    succeeds(&mut command)
}
