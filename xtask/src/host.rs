//! Programs and packages of the computer, and the folder of the build.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The folder into which cargo builds.
pub fn target() -> PathBuf {
    let given = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    std::path::absolute(given.unwrap_or_else(|| "target".into())).unwrap_or_else(|_| "target".into())
}

/// The path of a program; none if it is not installed.
pub fn path_of(program: &str) -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths).map(|folder| folder.join(program)).find(|path| path.is_file())
}

/// Installs packages by apt-get, if that is there and this process may use it.
pub fn install(packages: &[&str]) {
    if path_of("apt-get").is_none() || !is_root() {
        return;
    }
    let did = |words: &[&str]| {
        let mut command = Command::new("apt-get");
        command.args(words).env("DEBIAN_FRONTEND", "noninteractive").stdout(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    let install = [&["install", "--yes", "--quiet", "--no-install-recommends"], packages].concat();
    // Lists that are older than what they list name packages that cannot be had together any more.
    if !did(&install) && did(&["update", "--quiet"]) {
        did(&install);
    }
}

fn is_root() -> bool {
    let answer = Command::new("id").arg("-u").output();
    answer.is_ok_and(|answer| answer.stdout.trim_ascii() == b"0")
}
