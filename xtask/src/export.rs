//! The tools that exported machines are run in: compilers, an emulator, Octave, and a Python environment under
//! `target/export`. Where something is missing and cannot be installed, the tests that need it are counted as ignored.

use crate::host::{install, path_of};

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
    if let Err(why) = crate::python::environment("export", REQUIREMENTS) {
        println!("exports are not tested in Python: {why}");
    }
    Ok(true)
}
