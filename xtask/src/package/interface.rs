//! The interface of the libraries, compared with that of an earlier commit by cargo-semver-checks.

use super::{Claims, must};
use crate::{book, output};
use std::process::Command;

/// The version of cargo-semver-checks, which has to know the documentation format of the compiler.
const SEMVER_CHECKS: &str = "0.51.0";

/// The libraries that other programs are written against.
const LIBRARIES: [&str; 7] =
    ["taut", "taut-core", "taut-case", "taut-control", "taut-identify", "taut-export", "taut-report"];

/// Compares the interface with that of a commit; of the last release, unless one is given. Errors: a change that the
/// version does not allow.
pub fn make(since: Option<&str>, claims: &mut Claims) -> Result<(), String> {
    println!("== interface");
    let Some(commit) = since.map(str::to_string).or_else(last_release) else {
        let figure = "not compared: no tag v* before this commit; --since COMMIT compares with a commit";
        claims.add("interface", figure.into());
        return Ok(());
    };
    // A debug build: it is built for one use.
    let tool = book::installed("cargo-semver-checks", SEMVER_CHECKS, &["--debug"])?;
    let mut check = Command::new(tool);
    check.args(["semver-checks", "check-release", "--baseline-rev", &commit]);
    for name in LIBRARIES {
        check.args(["--package", name]);
    }
    must(check)?;
    let figure =
        format!("{} libraries allow the version {} after {commit}", LIBRARIES.len(), env!("CARGO_PKG_VERSION"));
    claims.add("interface", format!("cargo-semver-checks {SEMVER_CHECKS}: {figure}"));
    Ok(())
}

/// The last tag of a release before this commit; none: there was no release.
fn last_release() -> Option<String> {
    let mut describe = Command::new("git");
    describe.args(["describe", "--tags", "--match", "v*", "--abbrev=0"]);
    let tag = String::from_utf8(output(describe).ok()?).ok()?;
    Some(tag.trim().to_string()).filter(|tag| !tag.is_empty())
}
