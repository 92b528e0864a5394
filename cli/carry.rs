//! The shared object for FMUs, built on the way: its bytes go into the program, and into the Python package. A part of
//! build.rs.

use std::env;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Writes `carried.rs`: the shared object, or none, and the licences of what is in it.
///
/// It is built where the program is built to be used: in release profiles, with the feature `fmu`. The source is that
/// of the package `taut-fmu`, which this package depends on, in a repository or unpacked. A program that is being
/// worked on takes the object that lies beside it, so that it is not compiled twice. Cargo holds its lock on the folder
/// of this build while this runs, so the object has a folder of its own.
pub fn carry() {
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    // The build script of `taut-fmu` sets this; without the feature `fmu` it is not a dependency.
    let folder = env::var_os("DEP_TAUT_FMU_FOLDER").map(PathBuf::from);
    let released = env::var("PROFILE").is_ok_and(|name| name == "release");
    let mut text = String::new();
    if let Some(folder) = folder.filter(|_| released) {
        let beside =
            ["../case", "../control", "../core", "../export", "../Cargo.toml", "../Cargo.lock", "../cli/carry.rs"];
        let all = beside.iter().map(|path| folder.join(path)).filter(|path| path.exists());
        for path in all.chain([folder.join("src"), folder.join("Cargo.toml")]) {
            println!("cargo::rerun-if-changed={}", path.display());
        }
        let source = &folder.join("Cargo.toml");
        let object = build(source, &out.join("fmu"));
        let _ = writeln!(text, "pub const CARRIED: Option<&[u8]> = Some(include_bytes!({object:?}));");
        let notices = out.join("notices.txt");
        let mut tree = cargo("tree");
        tree.args(["--offline", "--manifest-path"]).arg(source);
        let opening = "The shared object contains these packages of others, under these licences.";
        std::fs::write(&notices, super::notices::notices(tree, opening))
            .expect("the folder of the build can be written to");
        let _ = writeln!(text, "pub const NOTICES: &str = include_str!({notices:?});");
    } else {
        text.push_str("pub const CARRIED: Option<&[u8]> = None;\npub const NOTICES: &str = \"\";\n");
    }
    std::fs::write(out.join("carried.rs"), text).expect("the folder of the build can be written to");
}

/// Builds the shared object into a folder of its own; its path. It unwinds: a panic within a call ends there and is the
/// standard's "fatal", where an abort would take the importer along.
fn build(source: &Path, folder: &Path) -> PathBuf {
    let target = env::var("TARGET").unwrap_or_default();
    let mut command = cargo("build");
    command
        .args(["--lib", "--release", "--config", "profile.release.strip=true", "--target", &target])
        .arg("--manifest-path")
        .arg(source);
    command.arg("--target-dir").arg(folder);
    command.env("CARGO_ENCODED_RUSTFLAGS", without_paths().join("\u{1f}"));
    let done = command.output().expect("cargo can be started");
    if !done.status.success() {
        panic!("the shared object for FMUs cannot be built:\n{}", String::from_utf8_lossy(&done.stderr));
    }
    let (prefix, suffix) = match env::var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("windows") => ("", ".dll"),
        Ok("macos") => ("lib", ".dylib"),
        _ => ("lib", ".so"),
    };
    let object = folder.join(&target).join("release").join(format!("{prefix}taut_fmu{suffix}"));
    assert!(object.is_file(), "cargo left no {}: this target has no shared objects", object.display());
    object
}

/// Flags that keep the folders of whoever builds it out of the object: places of panics name the files of packages.
fn without_paths() -> Vec<String> {
    let home = env::var_os(if cfg!(windows) { "USERPROFILE" } else { "HOME" }).map(PathBuf::from);
    let cargo = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(home.as_ref()?.join(".cargo")));
    let source = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let source = source.and_then(|folder| Some(folder.parent()?.to_path_buf()));
    // Of several that fit, the last one counts.
    let folders = [(home, "home"), (source, "taut"), (cargo.map(|cargo| cargo.join("registry/src")), "packages")];
    let flag =
        |(folder, name): (Option<PathBuf>, &str)| Some(format!("--remap-path-prefix={}={name}", folder?.display()));
    folders.into_iter().filter_map(flag).collect()
}

/// Cargo as it runs this, but for what is meant for this build alone: lints, wrappers, the folder.
fn cargo(command: &str) -> Command {
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args([command, "--locked"]);
    for name in ["RUSTC_WORKSPACE_WRAPPER", "CLIPPY_ARGS", "CLIPPY_CONF_DIR", "CARGO_BUILD_TARGET", "RUSTFLAGS"] {
        cargo.env_remove(name);
    }
    // Variables that cargo sets for this package's build script are not those of that one.
    for (name, _) in env::vars_os() {
        let name_text = name.to_string_lossy();
        if ["CARGO_FEATURE_", "CARGO_CFG_", "CARGO_PKG_", "DEP_"].iter().any(|begin| name_text.starts_with(begin)) {
            cargo.env_remove(&name);
        }
    }
    cargo
}
