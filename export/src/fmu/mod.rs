//! A machine as a functional mock-up unit: the variables that it shows, their description, and the archive.
//!
//! The shared object inside is made of the crate `fmu`, which reads the machine from the archive's resources, makes the
//! same list of variables of it, and steps it.

mod archive;
mod description;
mod model;
mod pack;
mod resource;
mod sources;
mod variable;

pub use archive::Archive;
pub use description::{Version, description};
pub use model::Model;
pub use pack::{Carried, object_in, pack};
pub use resource::resource;
pub use sources::sources;
pub use variable::{Causality, FmiType, Role, Variability, Variable};

/// Where the machine stands in the archive.
pub(crate) const MACHINE: &str = "resources/machine.toml";

/// Inputs that controllers inside have for the reference of each slide: position and its first four derivatives.
pub const REFERENCES: usize = 5;

/// How the shared object is called in the archive, without its ending.
pub(crate) const BINARY: &str = "taut_fmu";

/// The folder of binaries for the platform of this build and its ending: of FMI 3.0 and 2.0. None where the standard
/// has no name for it.
pub fn platform(version: Version) -> Option<(&'static str, &'static str)> {
    let (system, ending, word) = match std::env::consts::OS {
        "linux" => ("linux", "so", "linux"),
        "windows" => ("windows", "dll", "win"),
        "macos" => ("darwin", "dylib", "darwin"),
        _ => return None,
    };
    let folder = match (version, std::env::consts::ARCH, system) {
        (Version::Three, "x86_64", "linux") => "x86_64-linux",
        (Version::Three, "x86_64", "windows") => "x86_64-windows",
        (Version::Three, "x86_64", _) => "x86_64-darwin",
        (Version::Three, "aarch64", "linux") => "aarch64-linux",
        (Version::Three, "aarch64", "windows") => "aarch64-windows",
        (Version::Three, "aarch64", _) => "aarch64-darwin",
        (Version::Three, "x86", "linux") => "x86-linux",
        (Version::Three, "x86", "windows") => "x86-windows",
        // Names of 2.0 are of x86 alone; other processors have none that importers agree on.
        (Version::Two, "x86_64", _) => match word {
            "linux" => "linux64",
            "win" => "win64",
            _ => "darwin64",
        },
        (Version::Two, "x86", "linux") => "linux32",
        (Version::Two, "x86", "windows") => "win32",
        _ => return None,
    };
    Some((folder, ending))
}
