//! All tests of the library in one program, which is linked once: `cargo test --package taut --test all fit::` runs
//! those of `fit.rs`.

mod authorities;
mod bad_cases;
mod bad_logs;
mod bombs;
mod breaks;
mod case;
mod case_documentation;
mod case_mutations;
mod causes;
mod certificate;
mod collocation;
mod combinations;
mod common;
mod compare;
mod control;
mod cost;
mod definitions;
mod definitions_control;
mod elements;
mod experiment_design;
mod fit;
mod fitted_files;
mod force_map;
mod free;
mod frf;
mod gantry;
mod gantry_design;
mod gantry_fit;
mod gantry_frf;
mod gantry_laws;
mod gantry_loops;
mod gantry_moves;
mod gantry_yaw;
mod general;
mod golden;
mod hard;
mod instant;
mod laws;
mod learning;
mod linear;
mod logs;
mod lugre;
mod margins;
mod measure;
mod merged;
mod metrics;
mod moves;
mod narrow;
mod parameters;
mod posterior;
mod published;
mod quantity;
mod recorders;
mod reference;

mod planning;
mod reach;
mod rooms;
mod rounding;
mod rows;
mod sensitivity;
mod set_values;
mod shape;
mod shape_of_belts;
mod shape_of_modes;
mod sheet;
mod stages;
mod stated;
mod stepper;
mod stepping;
mod survey;
mod suspicions;
mod sweep;
mod table3;
mod tune;
mod two_sensors;
mod undetermined;
mod verdict;
mod verdicts;

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
