//! The Python package: built as a wheel, installed into an environment of its own under `target/python`, and tested
//! there.

use crate::{Counts, host};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Packages that have to be installed, to the digit.
pub const REQUIREMENTS: &str = "py/requirements.txt";

/// The oldest Python that works.
const OLDEST: (u32, u32) = (3, 10);

/// Builds, installs, checks types, tests. False where a program says no.
pub fn test(counts: &mut Counts) -> Result<bool, String> {
    let environment = environment("python", REQUIREMENTS)?;
    let python = program(&environment, "python");
    let target = host::target();
    let wheels = target.join("wheels");
    // A wheel of an earlier version must not be taken for this one.
    let _ = std::fs::remove_dir_all(&wheels);
    let mut build = Command::new(program(&environment, "maturin"));
    build.args(["build", "--locked", "--manifest-path", "py/Cargo.toml", "--profile", "dev", "--out"]).arg(&wheels);
    // What the tests of the workspace have built already is not built again.
    build.args(["--features", "one-build"]).arg("--interpreter").arg(&python);
    if !crate::run(build, counts)? {
        return Ok(false);
    }
    let wheel = std::fs::read_dir(&wheels).ok().and_then(|mut entries| entries.next()?.ok()).map(|entry| entry.path());
    let wheel = wheel.ok_or("maturin made no wheel")?;
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--no-deps", "--force-reinstall"]).arg(wheel);
    let mut types = Command::new(program(&environment, "mypy"));
    types.args(["--config-file", "pyproject.toml", "python/taut"]).current_dir("py");
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "--quiet", "--numprocesses=auto", "-p", "no:cacheprovider", "py/tests"]);
    // Results are compared with those of the program.
    let Some(taut) = crate::build_program(counts)? else { return Ok(false) };
    tests.env("TAUT_PROGRAM", taut);
    tests.env("TAUT_BAD", crate::bad::write()?);
    tests.env("MPLBACKEND", "agg").env("PYTHONDONTWRITEBYTECODE", "1");
    for command in [install, types, tests] {
        if !crate::run(command, counts)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The environment of this name with everything in it that a file of requirements names.
pub fn environment(name: &str, requirements: &str) -> Result<PathBuf, String> {
    let folder = host::target().join(name);
    let wanted = std::fs::read_to_string(requirements).map_err(|e| format!("{requirements} cannot be read: {e}"))?;
    let installed = folder.join("installed.txt");
    if std::fs::read_to_string(&installed).is_ok_and(|there| there == wanted) {
        return Ok(folder);
    }
    let python = interpreter()?;
    let mut make = Command::new(python);
    make.args(["-m", "venv", "--clear"]).arg(&folder);
    let mut install = Command::new(program(&folder, "python"));
    install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement", requirements]);
    for command in [make, install] {
        if !crate::run(command, &mut Counts::default())? {
            // Half an environment must not be taken for a whole one.
            let _ = std::fs::remove_dir_all(&folder);
            return Err(format!(
                "the environment {} cannot be made; it needs Python's venv (Debian: apt install python3-venv) and PyPI",
                folder.display()
            ));
        }
    }
    std::fs::write(&installed, wanted).map_err(|e| format!("{}: {e}", installed.display()))?;
    Ok(folder)
}

/// A Python that is new enough.
pub fn interpreter() -> Result<&'static str, String> {
    ["python3", "python"].into_iter().find(|name| is_new_enough(name).is_ok()).ok_or_else(|| {
        format!(
            "the tests of the Python package need Python {}.{} or later with venv, as python3 on the path \
             (Debian: apt install python3 python3-venv; others: python.org)",
            OLDEST.0, OLDEST.1
        )
    })
}

/// Errors: this program is no Python, or too old.
pub fn is_new_enough(name: &str) -> Result<(), String> {
    let version = format!("import sys; sys.exit(sys.version_info < {OLDEST:?})");
    let answer = Command::new(name).args(["-c", &version]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    match answer.is_ok_and(|status| status.success()) {
        true => Ok(()),
        false => Err(format!("{name} is not Python {}.{} or later", OLDEST.0, OLDEST.1)),
    }
}

/// A program of the environment.
pub fn program(environment: &Path, name: &str) -> PathBuf {
    let folder = if cfg!(windows) { "Scripts" } else { "bin" };
    environment.join(folder).join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}
