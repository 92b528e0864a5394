//! Logs of a machine, read by way of the case file.

use std::fs;
use std::path::{Path, PathBuf};
use taut::case::{Case, TEMPLATE};
use taut::log::{Log, Quantity};

/// The machine of the template with this experiment.
fn case_text(experiment: &str) -> String {
    let machine = &TEMPLATE[..TEMPLATE.find("[[experiment]]").unwrap()];
    format!("{machine}\n[[experiment]]\nname = \"run\"\n{experiment}\n")
}

/// A folder of its own for the test called `name`.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("logs-{name}"));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Reads a case whose log is this text in `log.csv`.
fn read(name: &str, text: &str, experiment: &str) -> Case {
    let folder = folder(name);
    fs::write(folder.join("log.csv"), text).unwrap();
    Case::from_text(folder.join("case.toml"), &case_text(experiment)).unwrap_or_else(|error| panic!("{error}"))
}

fn output(log: &Log, quantity: Quantity) -> &[f64] {
    &log.output(quantity).unwrap().values
}

#[test]
fn a_log_drives_its_experiment() {
    let text = "t,u,x,i\n0,5,0,0.1\n0.1,5,2.5,0.2\n0.2,0,5,0.3\n";
    let log = r#"log = { file = "log.csv", time = "t", input = "u", cart_position = "x", motor_current = "i", units = { cart_position = "mm" } }"#;
    let case = read("drives", text, log);
    let experiment = &case.experiments[0];
    assert_eq!((experiment.until, experiment.every), (0.2, 0.1));
    let log = experiment.log.as_ref().unwrap();
    assert_eq!((log.name.as_str(), &log.time, &log.input), ("run", &vec![0.0, 0.1, 0.2], &vec![5.0, 5.0, 0.0]));
    assert_eq!(output(log, Quantity::CartPosition), [0.0, 2.5e-3, 5e-3]);
    assert_eq!(output(log, Quantity::MotorCurrent), [0.1, 0.2, 0.3]);
    assert_eq!(experiment.input.value(0.15), 5.0);
    assert_eq!(experiment.input.value(0.2), 0.0);
    assert_eq!(case.files.len(), 1);
}
