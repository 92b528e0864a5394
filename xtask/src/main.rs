//! The project's own chores: `cargo xtask test` checks all that can be checked.

use std::io::{BufRead, BufReader};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

/// A check: what it is, and the cargo command that does it.
struct Step {
    what: &'static str,
    command: &'static [&'static str],
    variables: &'static [(&'static str, &'static str)],
}

/// In this order, the quickest to fail first.
const STEPS: [Step; 6] = [
    step("formatting", &["fmt", "--all", "--check"]),
    step("lints", &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
    step(
        "the library without its features",
        &["clippy", "--package", "taut", "--lib", "--no-default-features", "--", "-D", "warnings"],
    ),
    Step {
        what: "documentation",
        command: &["doc", "--workspace", "--no-deps"],
        variables: &[("RUSTDOCFLAGS", "-D warnings")],
    },
    // Unit tests, integration tests and the examples in the documentation.
    step("tests", &["test", "--workspace", "--no-fail-fast"]),
    step("examples", &["build", "--workspace", "--examples"]),
];

const fn step(what: &'static str, command: &'static [&'static str]) -> Step {
    Step { what, command, variables: &[] }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words != ["test"] {
        eprintln!("usage: cargo xtask test");
        return ExitCode::from(2);
    }
    match test() {
        Ok(()) => ExitCode::SUCCESS,
        Err(told) => {
            eprintln!("\nxtask: {told}");
            ExitCode::FAILURE
        }
    }
}

/// Runs every step, up to the first that fails.
fn test() -> Result<(), String> {
    for (tool, component) in [("fmt", "rustfmt"), ("clippy", "clippy")] {
        let answers = cargo(&[tool, "--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        if !answers.is_ok_and(|status| status.success()) {
            return Err(format!("{component} is missing; `rustup component add {component}` installs it"));
        }
    }
    let begin = Instant::now();
    let mut counts = Counts::default();
    for step in &STEPS {
        println!("== {}: cargo {}", step.what, step.command.join(" "));
        let begin = Instant::now();
        let succeeded = step.run(&mut counts)?;
        println!("== {}: {:.1} s", step.what, begin.elapsed().as_secs_f64());
        if !succeeded {
            counts.show();
            return Err(format!("failed: {}; to repeat it alone: cargo {}", step.what, step.command.join(" ")));
        }
    }
    println!("\nall steps succeeded in {:.1} s", begin.elapsed().as_secs_f64());
    counts.show();
    Ok(())
}

impl Step {
    /// Whether it succeeds; its output is shown as it comes, and the tests in it are counted.
    fn run(&self, counts: &mut Counts) -> Result<bool, String> {
        let mut command = cargo(self.command);
        let mut child = command
            .envs(self.variables.iter().copied())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("cargo cannot be started: {e}"))?;
        if let Some(output) = child.stdout.take() {
            for line in BufReader::new(output).lines() {
                let line = line.map_err(|e| format!("the output of cargo cannot be read: {e}"))?;
                println!("{line}");
                counts.take(&line);
            }
        }
        Ok(child.wait().map_err(|e| format!("cargo was lost: {e}"))?.success())
    }
}

/// The cargo that runs this program.
fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    command
}

/// Tests that ran, summed over all programs of tests.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    passed: u64,
    failed: u64,
}

impl Counts {
    /// Adds what a line such as `test result: ok. 5 passed; 0 failed; …` reports.
    fn take(&mut self, line: &str) {
        if !line.starts_with("test result: ") {
            return;
        }
        let count = |word: &str| -> u64 {
            let before = line.split(word).next().filter(|before| before.len() < line.len());
            before.and_then(|before| before.split_whitespace().last()?.parse().ok()).unwrap_or(0)
        };
        self.passed += count(" passed;");
        self.failed += count(" failed;");
    }

    fn show(&self) {
        println!("{} passed, {} failed", self.passed, self.failed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_summed_over_programs_of_tests() {
        let mut counts = Counts::default();
        counts.take("test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s");
        counts.take("test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out");
        counts.take("test the_word_passed; ... ok");
        assert_eq!(counts, Counts { passed: 15, failed: 2 });
    }
}
