//! The readers under libFuzzer, one after another, beginning with the seeds of the tests and what earlier hunts found.

use super::succeeds;
use crate::cargo;
use std::process::Stdio;

const TARGETS: [&str; 9] = ["case", "quantity", "csv", "parquet", "matlab", "samples", "spectrum", "gcode", "draws"];

const FOLDER: &str = "fuzz/libfuzzer";

pub fn run(seconds: u64, seed: u64) -> Result<(), String> {
    let answers = cargo(&["fuzz", "--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !answers.is_ok_and(|status| status.success()) {
        return Err("cargo-fuzz is missing; `cargo install cargo-fuzz --version '^0.13' --locked` installs it".into());
    }
    let mut found = Vec::new();
    for target in TARGETS {
        println!("== {target}: {seconds} s");
        let corpus = format!("{FOLDER}/corpus/{target}");
        succeeds(&mut cargo(&[
            "run",
            "--quiet",
            "--package",
            "taut-fuzz",
            "--example",
            "seeds",
            "--",
            target,
            &corpus,
        ]))?;
        let (time, seed) = (format!("-max_total_time={seconds}"), format!("-seed={seed}"));
        let words = ["fuzz", "run", "--fuzz-dir", FOLDER, target, &corpus, "--", &time, &seed];
        // Of one input: seconds and MiB. Sanitizers are features of the compiler that it keeps for its nightly builds.
        let bounds =
            ["-timeout=20", "-rss_limit_mb=2048", "-malloc_limit_mb=512", "-max_len=65536", "-print_final_stats=1"];
        found.extend(succeeds(cargo(&words).args(bounds).env("RUSTC_BOOTSTRAP", "1")).err());
    }
    if found.is_empty() {
        Ok(())
    } else {
        Err(format!("what it found is kept in {FOLDER}/artifacts\n{}", found.join("\n")))
    }
}
