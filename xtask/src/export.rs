//! The tools that exported machines are run in: compilers, an emulator, Octave, and a Python environment under
//! `target/export`. Where something is missing and cannot be installed, the tests that need it are counted as ignored.

use crate::browser::{install, path_of};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Programs, and the packages of Debian that have them.
const PROGRAMS: [(&str, &str); 8] = [
    ("gcc", "gcc"),
    ("g++", "g++"),
    ("clang", "clang"),
    ("cppcheck", "cppcheck"),
    ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
    ("qemu-system-arm", "qemu-system-arm"),
    ("octave-cli", "octave"),
    ("mkoctfile", "octave-dev"),
];

/// The C library of the cross compiler has no program.
const LIBRARIES: &str = "libnewlib-arm-none-eabi";

/// Packages of Python, to the digit.
const REQUIREMENTS: &str = "cli/tests/export/requirements.txt";

/// Installs what is missing and may be installed, and says what is still missing.
pub fn prepare() -> Result<bool, String> {
    let missing = || PROGRAMS.iter().filter(|(program, _)| path_of(program).is_none());
    if missing().count() > 0 {
        let packages: Vec<&str> = missing().map(|(_, package)| *package).chain([LIBRARIES]).collect();
        install(&packages);
    }
    let packages: Vec<&str> = missing().map(|(_, package)| *package).collect();
    if !packages.is_empty() {
        println!("exports are not tested in all tools (Debian: apt-get install {})", packages.join(" "));
    }
    if !environment()? {
        println!("exports are not tested in Python: {REQUIREMENTS} cannot be installed (Debian: python3-venv; PyPI)");
    }
    Ok(true)
}

/// Makes the environment anew where what it should hold has changed; false where that cannot be.
fn environment() -> Result<bool, String> {
    let folder = crate::python::target().join("export");
    let wanted = fs::read_to_string(REQUIREMENTS).map_err(|e| format!("{REQUIREMENTS} cannot be read: {e}"))?;
    let installed = folder.join("installed.txt");
    if fs::read_to_string(&installed).is_ok_and(|there| there == wanted) {
        return Ok(true);
    }
    let python = crate::python::program(&folder, "python");
    let did = |program: &Path, words: &[&str]| {
        let done = Command::new(program).args(words).stdout(Stdio::null()).status();
        done.is_ok_and(|status| status.success())
    };
    let place = folder.display().to_string();
    let made = did(Path::new("python3"), &["-m", "venv", "--clear", &place])
        && did(
            &python,
            &["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement", REQUIREMENTS],
        );
    if !made {
        // Half an environment must not be taken for a whole one.
        let _ = fs::remove_dir_all(&folder);
        return Ok(false);
    }
    fs::write(&installed, wanted).map_err(|e| format!("{}: {e}", installed.display()))?;
    Ok(true)
}
