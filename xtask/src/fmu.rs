//! `cargo xtask fmu [N]`: N random sequences of calls of the functions of FMI, 10,000 unless said otherwise, under
//! address sanitizer, and the other tests of the crate `fmu` with them.
//!
//! The sanitizer is a part of the compiler that stable Rust keeps locked; `RUSTC_BOOTSTRAP=1` unlocks it. It wants a
//! target by name, so that build scripts and macros go without it, and has a folder of its own.

use std::path::Path;
use std::process::Command;

pub const USAGE: &str = "cargo xtask fmu [N]";

/// Sequences unless said otherwise.
const SEQUENCES: &str = "10000";

/// Builds and runs the tests.
pub fn run(words: &[&str]) -> Result<(), String> {
    let sequences = match words {
        [] => SEQUENCES,
        [count] if count.parse::<u64>().is_ok() => count,
        _ => return Err(format!("usage: {USAGE}")),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("the project has no folder")?;
    let target = host()?;
    let mut command = super::cargo(&["test", "--package", "taut-fmu", "--test", "all", "--target", &target]);
    command.arg("--target-dir").arg(root.join("target/sanitized"));
    command.env("RUSTC_BOOTSTRAP", "1").env("RUSTFLAGS", "-Zsanitizer=address -Cdebuginfo=line-tables-only");
    // Leaks count, too: what was handed out is freed with the instance.
    command.env("ASAN_OPTIONS", "detect_leaks=1").env("TAUT_SEQUENCES", sequences).current_dir(root);
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err("the sanitizer, or a test, found what should not be".into()),
        Err(error) => Err(format!("cargo cannot be started: {error}")),
    }
}

/// The target that this compiler builds for.
fn host() -> Result<String, String> {
    let told =
        Command::new("rustc").arg("-vV").output().map_err(|error| format!("rustc cannot be started: {error}"))?;
    let text = String::from_utf8_lossy(&told.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_string).ok_or_else(|| "rustc does not say what it builds for".into())
}
