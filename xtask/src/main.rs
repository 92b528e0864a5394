//! The project's own chores: `cargo xtask test` checks all that can be checked, `cargo xtask python` the Python package
//! alone, `cargo xtask browser` the reports alone, `cargo xtask export` exported machines in their tools alone,
//! `cargo xtask data` fetches other people's measurements, `cargo xtask bad` writes the wrong inputs of `tests/bad` as
//! whole files, `cargo xtask package` builds all that a release consists of and tries it,
//! `cargo xtask hunt` looks for what is wrong with larger means, `cargo xtask coverage` and `cargo xtask faults` make
//! the tables of docs/fit.md, `cargo xtask end-to-end` that of docs/tune.md, `cargo xtask counts` counts the
//! instructions of standard works, `cargo xtask fmu` calls the functions of FMI at random under address sanitizer,
//! `cargo xtask drag`, `cargo xtask load` and `cargo xtask first-fit` measure the studio, `cargo xtask web` makes a
//! folder of it that needs no server, `cargo xtask book` builds the documents as a book and checks its links.

mod bad;
mod book;
mod browser;
mod compiler;
mod counts;
mod data;
mod export;
mod fmu;
mod host;
mod hunt;
mod ignored;
mod package;
mod python;
mod studio;
mod web;

use ignored::Ignored;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

/// A check: what it is, and what does it.
struct Step {
    what: &'static str,
    work: Work,
}

/// The work of a check.
enum Work {
    /// A cargo command, with variables of its environment.
    Cargo(&'static [&'static str], &'static [(&'static str, &'static str)]),
    /// The Python package's own chain of commands.
    Python,
    /// Reports in a browser.
    Browser,
    /// The tools of exported machines.
    Export,
}

/// In this order, the quickest to fail first.
const STEPS: [Step; 9] = [
    step("formatting", &["fmt", "--all", "--check"]),
    step("lints", &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
    step(
        "the library without its features",
        &[
            "clippy",
            "--package",
            "taut",
            "--package",
            "taut-case",
            "--lib",
            "--no-default-features",
            "--",
            "-D",
            "warnings",
        ],
    ),
    Step {
        what: "documentation",
        work: Work::Cargo(&["doc", "--workspace", "--no-deps"], &[("RUSTDOCFLAGS", "-D warnings")]),
    },
    TOOLS,
    // Unit tests, integration tests and the examples in the documentation.
    step("tests", &["test", "--workspace", "--no-fail-fast"]),
    step("examples", &["build", "--workspace", "--examples"]),
    BROWSER,
    PYTHON,
];

const TOOLS: Step = Step { what: "tools of exported machines", work: Work::Export };

const EXPORTS: Step =
    step("exported machines in their tools", &["test", "--workspace", "--test", "all", "--", "export::"]);

const PYTHON: Step = Step { what: "the Python package", work: Work::Python };

const BROWSER: Step = Step { what: "reports in a browser", work: Work::Browser };

const fn step(what: &'static str, command: &'static [&'static str]) -> Step {
    Step { what, work: Work::Cargo(command, &[]) }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let done = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test"] => test(&STEPS),
        ["python"] => test(&[PYTHON]),
        ["browser"] => test(&[BROWSER]),
        ["export"] => test(&[TOOLS, EXPORTS]),
        ["bad"] => bad::run(),
        ["book", ref words @ ..] => book::run(words),
        ["data", ref words @ ..] => data::run(words),
        ["package", ref words @ ..] => package::run(words),
        ["web", ref words @ ..] => web::run(words),
        ["counts", ref words @ ..] => counts::run(words),
        ["fmu", ref words @ ..] => fmu::run(words),
        ["drag", ref words @ ..] => studio::drag(words),
        ["load", ref words @ ..] => studio::load(words),
        ["first-fit", ref words @ ..] => studio::first_fit(words),
        ["coverage", ref words @ ..] => example("coverage", words),
        ["faults", ref words @ ..] => example("faults", words),
        ["end-to-end", ref words @ ..] => example("end_to_end", words),
        ["hunt", ref words @ ..] => match hunt::Hunt::new(words) {
            Ok(hunt) => hunt.run(),
            Err(told) => {
                eprintln!("xtask: {told}\nusage: {}", hunt::USAGE);
                return ExitCode::from(2);
            }
        },
        _ => {
            eprintln!(
                "usage: cargo xtask test | cargo xtask bad | cargo xtask browser | cargo xtask export | \
                 cargo xtask python | cargo xtask coverage [...] | cargo xtask faults [...] | \
                 cargo xtask end-to-end [...] | \
                 {} | {} | {} | {} | {} | {} | {} | {} | {} | {}",
                book::USAGE,
                package::USAGE,
                web::USAGE,
                counts::USAGE,
                studio::FIRST_FIT,
                studio::DRAG,
                studio::LOAD,
                data::USAGE,
                fmu::USAGE,
                hunt::USAGE
            );
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(told) => {
            eprintln!("\nxtask: {told}");
            ExitCode::FAILURE
        }
    }
}

/// Runs an example of the library that makes a table, with these words.
fn example(name: &str, words: &[&str]) -> Result<(), String> {
    let mut command = cargo(&["run", "--release", "--quiet", "--package", "taut", "--no-default-features"]);
    command.args(["--example", name, "--"]).args(words);
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(format!("{name} found what should not be")),
        Err(error) => Err(format!("cargo cannot be started: {error}")),
    }
}

/// Runs these steps, up to the first that fails.
fn test(steps: &[Step]) -> Result<(), String> {
    for (tool, component) in [("fmt", "rustfmt"), ("clippy", "clippy")] {
        let answers = cargo(&[tool, "--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        if !answers.is_ok_and(|status| status.success()) {
            return Err(format!("{component} is missing; `rustup component add {component}` installs it"));
        }
    }
    data::before_tests()?;
    let whole = Stopwatch::new();
    let (mut counts, ignored) = (Counts::default(), Ignored::new()?);
    for step in steps {
        let command = step.command();
        println!("== {}: cargo {command}", step.what);
        let own = Stopwatch::new();
        let succeeded = step.run(&mut counts, &ignored)?;
        println!("== {}: {own}", step.what);
        if !succeeded {
            counts.show(&ignored.tests());
            return Err(format!("failed: {}; to repeat it alone: cargo {command}", step.what));
        }
    }
    println!("\nall steps succeeded in {whole}");
    counts.show(&ignored.tests());
    Ok(())
}

impl Step {
    /// The words behind `cargo` that run it alone.
    fn command(&self) -> String {
        match self.work {
            Work::Cargo(words, _) => words.join(" "),
            Work::Python => "xtask python".into(),
            Work::Browser => "xtask browser".into(),
            Work::Export => "xtask export".into(),
        }
    }

    /// True if it succeeds; the tests in it are counted.
    fn run(&self, counts: &mut Counts, ignored: &Ignored) -> Result<bool, String> {
        match self.work {
            Work::Cargo(words, variables) => {
                let mut command = cargo(words);
                command.envs(variables.iter().copied()).env(ignored::VARIABLE, ignored.file());
                run(command, counts)
            }
            Work::Python => python::test(counts),
            Work::Browser => browser::test(counts),
            Work::Export => export::prepare(),
        }
    }
}

/// Time since its making, and the processor time of commands that ended since then.
struct Stopwatch {
    begin: Instant,
    processor: Option<f64>,
}

impl Stopwatch {
    fn new() -> Self {
        Self { begin: Instant::now(), processor: processor_time() }
    }
}

impl std::fmt::Display for Stopwatch {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:.1} s", self.begin.elapsed().as_secs_f64())?;
        match processor_time().zip(self.processor) {
            Some((now, begin)) => write!(f, ", {:.1} s of processor time", now - begin),
            None => Ok(()),
        }
    }
}

/// Processor time of all commands that have ended, s, where the system keeps it in `/proc`.
fn processor_time() -> Option<f64> {
    processor_time_in(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// The same from the text of that file: `cutime` and `cstime`, the 16th and 17th word, in hundredths of a second
/// (proc_pid_stat(5)). The second word, in brackets, may hold blanks.
fn processor_time_in(text: &str) -> Option<f64> {
    let mut words = text.rsplit(')').next()?.split_whitespace().skip(13);
    let mut hundredths = || words.next()?.parse::<f64>().ok();
    Some((hundredths()? + hundredths()?) / 100.0)
}

/// True if a command succeeds; its output is shown as it comes, and the tests in it are counted.
fn run(mut command: Command, counts: &mut Counts) -> Result<bool, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let child = command.stdout(Stdio::piped()).spawn();
    let mut child = child.map_err(|e| format!("{name} cannot be started: {e}"))?;
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines() {
            let line = line.map_err(|e| format!("the output of {name} cannot be read: {e}"))?;
            println!("{line}");
            counts.take(&line);
        }
    }
    Ok(child.wait().map_err(|e| format!("{name} was lost: {e}"))?.success())
}

/// True if a command succeeds.
fn succeeds(command: &mut Command) -> Result<bool, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    command.status().map(|status| status.success()).map_err(|error| format!("{name} cannot be started: {error}"))
}

/// The output of a command. Errors: it fails.
fn output(mut command: Command) -> Result<Vec<u8>, String> {
    let done = command.output().map_err(|e| format!("{command:?} cannot be started: {e}"))?;
    match done.status.success() {
        true => Ok(done.stdout),
        false => Err(format!("failed: {command:?}\n{}", String::from_utf8_lossy(&done.stderr))),
    }
}

/// Writes a file, and makes its folder first.
fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), String> {
    let written = path.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::write(path, bytes));
    written.map_err(|error| format!("{} cannot be written: {error}", path.display()))
}

/// The cargo that runs this program.
fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    command
}

/// Builds the program `taut` as the tests of the workspace do, after which there is nothing left to do; none where that
/// fails.
fn build_program(counts: &mut Counts) -> Result<Option<PathBuf>, String> {
    if !run(cargo(&["test", "--workspace", "--no-run", "--test", "all"]), counts)? {
        return Ok(None);
    }
    Ok(Some(program()))
}

/// Where a debug build puts the program `taut`.
fn program() -> PathBuf {
    host::target().join("debug").join(format!("taut{}", std::env::consts::EXE_SUFFIX))
}

/// Tests that ran, summed over all programs of tests.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    passed: u64,
    failed: u64,
    ignored: u64,
    /// Tests that could not be begun, and what they need.
    left_out: Vec<String>,
}

impl Counts {
    /// Adds what a line such as `test result: ok. 5 passed; 0 failed; …`, or pytest's `5 passed, 1 skipped in 0.1s`,
    /// reports; pytest adds `(0:01:15)` after more than a minute.
    fn take(&mut self, line: &str) {
        let seconds = line.split(" (").next().unwrap_or(line);
        let pytest = seconds.ends_with('s') && line.contains(" in ") && line.starts_with(|c: char| c.is_ascii_digit());
        if !line.starts_with("test result: ") && !pytest {
            return;
        }
        let count = |word: &str| -> u64 {
            let before = line.split(word).next().filter(|before| before.len() < line.len());
            before.and_then(|before| before.split_whitespace().last()?.parse().ok()).unwrap_or(0)
        };
        self.passed += count(" passed");
        self.failed += count(" failed");
        self.ignored += count(" ignored") + count(" skipped");
    }

    /// Shows them, and the tests that did nothing for want of a file, which their programs count as passed.
    fn show(&self, wanting: &[String]) {
        wanting.iter().chain(&self.left_out).for_each(|line| println!("ignored: {line}"));
        let count = wanting.len() as u64;
        println!(
            "{} passed, {} failed, {} ignored",
            self.passed.saturating_sub(count),
            self.failed,
            self.ignored + count + self.left_out.len() as u64
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_time_of_commands_is_read() {
        let text = "4242 (a (b) c) S 1 2 3 4 5 6 7 8 9 10 110 12 2050 150 20 0 1";
        assert_eq!(processor_time_in(text), Some(22.0));
        assert_eq!(processor_time_in("4242 (a) S 1"), None);
    }

    #[test]
    fn counts_are_summed_over_programs_of_tests() {
        let mut counts = Counts::default();
        counts.take("test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s");
        counts.take("test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out");
        counts.take("test the_word_passed; ... ok");
        counts.take("1 failed, 38 passed, 1 skipped in 4.56s");
        counts.take("189 passed, 1 warning in 130.29s (0:02:10)");
        assert_eq!(counts, Counts { passed: 242, failed: 3, ignored: 2, left_out: Vec::new() });
    }
}
