//! Targets that a run did not build, and how to build them.

use crate::compiler;

/// A target for which a release is wanted.
struct Other {
    triple: &'static str,
    /// How to build it.
    recipe: &'static str,
    /// The system that builds it; none: any Linux.
    system: Option<&'static str>,
}

/// The recipe of a static program.
const MUSL: &str = "cargo zigbuild --locked --profile dist --package taut-cli --no-default-features --features parquet \
                    --target x86_64-unknown-linux-musl (static, therefore without `taut export fmu`; untried)";

const OTHERS: [Other; 5] = [
    Other { triple: "x86_64-unknown-linux-gnu", recipe: "cargo xtask package --twice", system: None },
    Other {
        triple: "aarch64-unknown-linux-gnu",
        recipe: "cargo xtask package --target aarch64-unknown-linux-gnu (untried)",
        system: None,
    },
    Other { triple: "x86_64-unknown-linux-musl", recipe: MUSL, system: None },
    Other { triple: "aarch64-apple-darwin", recipe: "cargo xtask package (untried)", system: Some("macos") },
    Other { triple: "x86_64-pc-windows-msvc", recipe: "cargo xtask package (untried)", system: Some("windows") },
];

/// Prints the targets other than `built`, with the reason and the recipe of each.
pub fn print(built: &str) {
    println!("\n== not built here");
    for other in OTHERS.iter().filter(|other| other.triple != built) {
        println!("{}: {}; recipe: {}", other.triple, reason(other, built), other.recipe);
    }
}

/// Errors: a target whose programs are static and cannot carry the shared object for FMUs.
pub fn refuse_static(triple: &str) -> Result<(), String> {
    match triple.contains("musl") {
        true => Err(format!("{triple} has no shared objects, which FMUs need; without them: {MUSL}")),
        false => Ok(()),
    }
}

/// Why this run has not built a target.
fn reason(other: &Other, built: &str) -> String {
    match other.system {
        Some(system) if system != std::env::consts::OS => format!("it is built on {system}"),
        _ if compiler::installed(other.triple).is_none() => {
            format!("the standard library of Rust for it is not installed (rustup target add {})", other.triple)
        }
        _ => format!("one run builds one target, and this one built {built}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_of_another_system_is_named_with_that_system() {
        let foreign = OTHERS.iter().find(|other| other.system.is_some_and(|system| system != std::env::consts::OS));
        let foreign = foreign.expect("one of macOS and Windows is not this system");
        assert!(reason(foreign, "x86_64-unknown-linux-gnu").starts_with("it is built on "));
    }
}
