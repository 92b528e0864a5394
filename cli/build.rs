//! Source of the build: the commit, where there is one, and the profile; and the shared object for FMUs.

#[path = "carry.rs"]
mod carry;
#[path = "notices.rs"]
mod notices;
#[path = "wrap.rs"]
mod wrap;

use std::process::Command;

fn main() {
    carry::carry();
    wrap::wrap_hypot("bins");
    let git = |arguments: &[&str]| -> Option<String> {
        let done = Command::new("git").args(arguments).output().ok().filter(|done| done.status.success())?;
        Some(String::from_utf8(done.stdout).ok()?.trim().to_string()).filter(|text| !text.is_empty())
    };
    // Of this repository, and not of one that this source lies in.
    let profile = std::env::var("PROFILE").unwrap_or_default();
    // A program that is being worked on is not built anew for every commit.
    let own = profile == "release" && git(&["ls-files", "--error-unmatch", "build.rs"]).is_some();
    let commit = git(&["rev-parse", "--short=9", "HEAD"]).filter(|_| own);
    let target = std::env::var("TARGET").unwrap_or_default();
    let from = match commit {
        Some(commit) => format!("commit {commit}, {profile}, {target}"),
        None => format!("{profile}, {target}"),
    };
    println!("cargo::rustc-env=TAUT_BUILT_FROM={from}");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=wrap.rs");
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|_| own) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}
