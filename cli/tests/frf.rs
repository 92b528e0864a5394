//! `taut frf` as a user runs it, on logs that `taut simulate --as-measured` wrote.

use crate::common::{read, taut};
use serde_json::Value;
use std::fs;
use std::path::Path;

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";
const EXPERIMENT: &str = "experiment=[{ name = \"noise\", input = { sum = [{ step = \"5 V\" }, { prbs = \"3 V\", bit = \"1 ms\", seed = 1 }] }, \
                          until = \"10 s\", every = \"1 ms\" }]";

/// A case with a log of the paper's machine, sliding under noise.
fn measured(folder: &Path) -> String {
    let sim = folder.join("sim");
    let change = "measurement.drive_angle={step=\"0.1 mrad\"}";
    let out = sim.to_str().unwrap();
    let args = ["simulate", TABLE4, "--as-measured", "--no-report", "--quiet"];
    let told = taut(&[&args[..], &["--set", EXPERIMENT, "--set", change, "--out", out]].concat());
    assert!(told.status.success(), "{told:?}");
    let text = read(TABLE4);
    let machine = &text[..text.find("[[experiment]]").unwrap()];
    let log = "[[experiment]]\nname = \"noise\"\n\
               log = { file = \"sim/noise.measured.csv\", time = \"time_s\", input = \"voltage_V\", drive_angle = \"drive_angle_rad\" }\n";
    let case = folder.join("frf.toml");
    fs::write(&case, format!("{machine}{log}")).unwrap();
    case.to_str().unwrap().to_string()
}

#[test]
fn a_response_over_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let case = measured(folder.path());
    let out = folder.path().join("response");
    let told = taut(&["frf", &case, "--out", out.to_str().unwrap()]);
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(told.status.success(), "{text}");
    assert!(text.contains("noise: drive_angle") && text.contains("stiffness, of that in the file"), "{text}");
    for name in ["frf.json", "frf.csv", "report.html", "plots/response-1.svg", "files.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let value: Value = serde_json::from_str(&fs::read_to_string(out.join("frf.json")).unwrap()).unwrap();
    let [low, high] = [0, 1].map(|end| value["fit"]["stiffness"]["interval"][end].as_f64().unwrap());
    // The file is the machine that made the log.
    assert!(low < 1.0 && 1.0 < high && high - low < 0.05, "{low} {high}");
    let rows = fs::read_to_string(out.join("frf.csv")).unwrap();
    let points = value["responses"][0]["frequency_Hz"].as_array().unwrap().len();
    assert_eq!(rows.lines().count(), points + 1);
    // Where it is coherent it is the model's, to the circle and its smear.
    let column = |key: &str| -> Vec<f64> {
        value["responses"][0][key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let (re, im, coherence) = (column("real"), column("imaginary"), column("coherence"));
    let (model_re, model_im) = (column("model_real"), column("model_imaginary"));
    let near = (0..points).filter(|&k| coherence[k] > 0.9);
    let (mut good, mut all) = (0, 0);
    for k in near {
        let off = (re[k] - model_re[k]).hypot(im[k] - model_im[k]) / model_re[k].hypot(model_im[k]);
        good += usize::from(off < 0.1);
        all += 1;
    }
    assert!(all > 100 && good * 20 > all * 19, "{good} of {all}");
}

#[test]
fn what_it_cannot_do_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let case = measured(folder.path());
    for (args, told) in [
        (vec!["frf", TABLE4], "this case has no log to measure a response from"),
        (vec!["frf", &case, "--segment", "5s"], "segments of 5000 samples"),
        (vec!["frf", &case, "--segment", "4ms"], "segments of 4 samples"),
        (vec!["frf", &case, "--period", "0.03333s"], "is no whole number of samples"),
        (vec!["frf", &case, "--period", "1s", "--segment", "1s"], "cannot be used with"),
    ] {
        let output = taut(&args);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains(told) && output.status.code() == Some(2), "{args:?}: {:?} {text}", output.status);
    }
}
