//! All tests of the program in one program, which is linked once: `cargo test --package taut-cli --test all fit::` runs
//! those of `fit.rs`.

mod commands;
mod common;
mod common_options;
mod design;
mod documents;
mod endings;
mod export;
mod faults;
mod fit;
mod fmu;
mod frf;
mod gantry;
#[path = "../../tests/common/ignored.rs"]
mod ignored;
mod kinds;
mod learn;
mod missing_logs;
mod moves;
mod outputs;
mod paper;
mod plan;
mod schemas;
mod shape;
mod show;
mod structure;
mod studio;
mod studio_client;
mod studio_work;
mod sweep;

/// A file that is no module here would not be run, and nobody would notice.
#[test]
fn every_file_of_tests_is_run() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let Some(name) = name.strip_suffix(".rs").filter(|name| *name != "main") else { continue };
        assert!(
            include_str!("main.rs").lines().any(|line| line == format!("mod {name};")),
            "tests/main.rs lacks mod {name};"
        );
    }
}
