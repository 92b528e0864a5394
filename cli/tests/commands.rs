//! The commands as a user types them.

use crate::common::{names, stage, taut_in, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn table4() -> PathBuf {
    stage("sollmann-jouaneh/table4.toml")
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// The two pulses of Table 4, simulated into a fresh folder.
fn simulated(more: &[&str]) -> TempDir {
    let folder = TempDir::new().unwrap();
    taut_in(folder.path()).arg("simulate").arg(table4()).args(["--out", "out"]).args(more).assert().success();
    folder
}

#[test]
fn init_then_simulate() {
    let folder = TempDir::new().unwrap();
    let first = taut_in(folder.path()).args(["init", "axis.toml"]).assert().success();
    assert_eq!(text(&first.get_output().stdout), "wrote axis.toml\nnext: taut simulate axis.toml --out results\n");
    let again = taut_in(folder.path()).args(["init", "axis.toml"]).assert().code(2);
    assert_eq!(
        text(&again.get_output().stderr),
        "error: axis.toml: this file exists already, and nothing was written\n  next: choose another name, or replace it with --force\n"
    );
    taut_in(folder.path()).args(["init", "axis.toml", "--force"]).assert().success();
    let run = taut_in(folder.path()).args(["simulate", "axis.toml", "--out", "results"]).assert().success();
    let out = text(&run.get_output().stdout);
    for word in
        ["My axis", "final position", "steady speed", "peak stretch", "stop time", "events", "cost", "report.html"]
    {
        assert!(out.contains(word), "{word} is not in\n{out}");
    }
    assert!(run.get_output().stderr.is_empty());
}

#[test]
fn the_numbers_of_the_paper() {
    let folder = simulated(&["--no-report"]);
    let summary = json(&folder.path().join("out/summary.json"));
    let golden =
        [("5 V pulse", 0.053744890394, 0.053746653033, [6, 6]), ("10 V pulse", 0.123487374321, 0.123487225459, [4, 4])];
    for (experiment, (name, drive, cart, _)) in summary["experiments"].as_array().unwrap().iter().zip(golden) {
        let metrics = &experiment["metrics"];
        assert_eq!(experiment["name"], name);
        assert!((metrics["final_drive_travel_m"].as_f64().unwrap() - drive).abs() < 1e-9);
        assert!((metrics["final_cart_position_m"].as_f64().unwrap() - cart).abs() < 1e-9);
        assert_eq!(metrics["settled"], true);
        assert_eq!(experiment["ending"]["word"], "complete");
    }
    for (experiment, (.., counts)) in summary["experiments"].as_array().unwrap().iter().zip(golden) {
        let count = |key: &str| -> u64 {
            let bodies = experiment["metrics"]["event_counts"].as_array().unwrap();
            bodies.iter().map(|body| body[key].as_u64().unwrap()).sum()
        };
        assert_eq!([count("stops"), count("starts")], counts);
    }
}

#[test]
fn the_folder_holds_what_it_should_and_nothing_else() {
    let folder = simulated(&["--format", "csv"]);
    let out = folder.path().join("out");
    assert_eq!(names(folder.path()), ["out"]);
    let top = [
        "10-v-pulse.csv",
        "10-v-pulse.events.csv",
        "5-v-pulse.csv",
        "5-v-pulse.events.csv",
        "case.toml",
        "files.json",
        "plots",
        "report.html",
        "summary.json",
    ];
    assert_eq!(names(&out), top);
    let plots = ["forces", "friction", "input", "positions", "speeds", "stretch"];
    let mut expected = Vec::new();
    for run in ["10-v-pulse", "5-v-pulse"] {
        for plot in plots {
            expected.push(format!("{run}-{plot}.svg"));
        }
    }
    assert_eq!(names(&out.join("plots")), expected);
    let report = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.starts_with("<!DOCTYPE html>") && report.contains("torque_constant"));
    for outside in ["src=\"http", "href=\"http", "url(http"] {
        assert!(!report.contains(outside), "the report asks for another file: {outside}");
    }
    let events = fs::read_to_string(out.join("5-v-pulse.events.csv")).unwrap();
    assert!(events.starts_with("time_s,part,from,to,load,by_rounding\n0,drive,stuck,forward,"), "{events}");
    assert_eq!(events.lines().count(), 16);
}

#[test]
fn the_table_reads_back_to_the_bits_that_were_computed() {
    use taut::solve::{Solver, simulate};
    let folder = simulated(&["--no-report"]);
    let csv = fs::read_to_string(folder.path().join("out/5-v-pulse.csv")).unwrap();
    let mut lines = csv.lines();
    assert_eq!(
        lines.next().unwrap(),
        "time_s,voltage_V,drive_angle_rad,drive_speed_rad_s,cart_position_m,cart_speed_m_s,idler_angle_rad,\
         idler_speed_rad_s,motor_current_A,span1_force_N,span2_force_N,span3_force_N,drive_friction_N_m,\
         cart_friction_N,idler_friction_N_m,drive_state,cart_state,idler_state"
    );
    let case = taut::case::Case::read(table4()).unwrap();
    let solution = simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap();
    for (row, line) in lines.enumerate() {
        for (column, number) in solution.trajectory.columns.iter().zip(line.split(',')) {
            assert_eq!(number.parse::<f64>().unwrap().to_bits(), column.values[row].to_bits(), "{} {row}", column.name);
        }
    }
}

#[test]
fn the_written_case_repeats_the_run() {
    let folder = TempDir::new().unwrap();
    let first = ["--set", "cart.mass=0.5 kg", "--set", "experiment.0.until=0.3 s", "--no-report", "--out", "one"];
    taut_in(folder.path()).arg("simulate").arg(table4()).args(first).assert().success();
    taut_in(folder.path()).args(["simulate", "one/case.toml", "--no-report", "--out", "two"]).assert().success();
    for name in names(&folder.path().join("one")) {
        let read = |run: &str| fs::read(folder.path().join(run).join(&name)).unwrap();
        assert!(read("one") == read("two"), "{name} differs");
    }
    let summary = json(&folder.path().join("two/summary.json"));
    assert_eq!(summary["stage"]["cart_mass_kg"], 0.5);
    assert_eq!(summary["experiments"][0]["metrics"]["end_time_s"], 0.3);
}

/// A recorded input is copied into the folder, so that the case there does not depend on where it came from.
#[test]
fn the_written_case_brings_its_input_files_along() {
    let folder = TempDir::new().unwrap();
    let here = folder.path();
    fs::create_dir_all(here.join("machine")).unwrap();
    fs::write(here.join("u.csv"), "t,u\n0,5\n0.2,0\n").unwrap();
    let case = fs::read_to_string(table4()).unwrap();
    let case =
        case.replace("{ pulse = \"5 V\", for = \"0.25 s\" }", "{ file = \"../u.csv\", time = \"t\", column = \"u\" }");
    fs::write(here.join("machine/axis.toml"), case).unwrap();
    taut_in(here).args(["simulate", "machine/axis.toml", "--no-report", "--out", "results/one"]).assert().success();
    fs::remove_file(here.join("u.csv")).unwrap();
    taut_in(here).args(["simulate", "results/one/case.toml", "--no-report", "--out", "two"]).assert().success();
    let read = |run: &str| fs::read(here.join(run).join("5-v-pulse.csv")).unwrap();
    assert!(read("results/one") == read("two"));
}

/// A log of a run is what a real one would be: it reads, drives the next run, and shows in the report.
#[test]
fn a_run_as_measured() {
    let folder = TempDir::new().unwrap();
    let here = folder.path();
    taut_in(here).args(["init", "axis.toml"]).assert().success();
    let noisy = "measurement.motor_current={ step = \"10 mA\", noise = \"20 mA\" }";
    let args = ["simulate", "axis.toml", "--experiment", "5 V pulse", "--set", noisy, "--as-measured", "--out", "out"];
    taut_in(here).args(args).args(["--set", "measurement.delay=2ms"]).assert().success();
    let out = here.join("out");
    assert!(names(&out).contains(&"5-v-pulse.measured.csv".to_string()));
    assert_eq!(json(&out.join("summary.json"))["experiments"][0]["files"][2], "5-v-pulse.measured.csv");
    let log = out.join("5-v-pulse.measured.csv");
    let columns = ["time_s", "voltage_V", "encoder_count", "drive_angle_rad", "motor_current_A"];
    assert!(fs::read_to_string(&log).unwrap().starts_with(&(columns.join(",") + "\n")));
    let read = taut::log::read_columns(&log, &columns).unwrap();
    let exact = taut::log::read_columns(&out.join("5-v-pulse.csv"), &["drive_angle_rad"]).unwrap();
    assert_eq!(read[0].len(), 1001);
    for (k, counts) in read[2].iter().enumerate() {
        let then = exact[0][k.saturating_sub(2)];
        assert!((counts / 2048.0 * std::f64::consts::TAU - then).abs() <= std::f64::consts::PI / 2048.0 + 1e-12);
    }
    let report = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("measured at the drive pulley"));

    // The logged input drives the same run.
    let input =
        "experiment.0.input={ file = \"out/5-v-pulse.measured.csv\", time = \"time_s\", column = \"voltage_V\" }";
    let again = ["simulate", "axis.toml", "--experiment", "5 V pulse", "--set", input, "--no-report", "--out", "two"];
    taut_in(here).args(again).assert().success();
    let cart = |run: &str| {
        let file = here.join(run).join("5-v-pulse.csv");
        taut::log::read_columns(&file, &["cart_position_m"]).unwrap().remove(0)
    };
    for (a, b) in cart("out").iter().zip(cart("two")) {
        assert!((a - b).abs() < 1e-12);
    }
}

/// With --live the report holds, for each run, the drawing of the machine and the rows that move it.
#[test]
fn the_machine_moves_in_a_report() {
    let folder = TempDir::new().unwrap();
    let report = |case: &str, more: &[&str]| {
        let case = stage(case);
        taut_in(folder.path()).arg("simulate").arg(case).args(["--out", "out"]).args(more).assert().success();
        fs::read_to_string(folder.path().join("out/report.html")).unwrap()
    };
    let machines = |html: &str| -> Vec<serde_json::Value> {
        let parts = html.split("<figure class=\"machine\">").skip(1);
        let texts = parts.map(|part| part.split("<script type=\"application/json\">").nth(1).unwrap());
        texts.map(|text| serde_json::from_str(text.split("</script>").next().unwrap()).unwrap()).collect()
    };
    let plain = report("sollmann-jouaneh/table4.toml", &[]);
    assert!(machines(&plain).is_empty() && !plain.contains("liven") && !plain.contains(".stage-box"));
    let live = machines(&report("sollmann-jouaneh/table4.toml", &["--live"]));
    assert_eq!(live.len(), 2);
    for machine in &live {
        assert_eq!((&machine["scene"]["kind"], &machine["until"]), (&"axis".into(), &1.0.into()));
        let curves = machine["curves"].as_array().unwrap();
        assert_eq!(curves.len(), 13);
        let rows = |curve: &serde_json::Value, axis: &str| {
            machine["arrays"][curve[axis].as_u64().unwrap() as usize]["n"].as_u64().unwrap()
        };
        assert!(curves.iter().all(|curve| rows(curve, "x") == 1001 && rows(curve, "y") == 1001));
    }
    // Of 20 001 rows a report has fewer.
    let long = ["--live", "--experiment", "5 V pulse", "--set", "experiment.0.every=50us"];
    let long = machines(&report("sollmann-jouaneh/table4.toml", &long));
    let rows = long[0]["arrays"].as_array().unwrap().iter().map(|array| array["n"].as_u64().unwrap());
    assert!(rows.clone().all(|n| (500..=2000).contains(&n)), "{:?}", rows.collect::<Vec<_>>());
    for (case, spans) in [("h-frame/h-frame.toml", 3), ("core-xy/core-xy.toml", 4), ("dual-belt/dual-belt.toml", 6)] {
        let found = machines(&report(case, &["--live"]));
        let names: Vec<&str> =
            found[0]["curves"].as_array().unwrap().iter().map(|curve| curve["name"].as_str().unwrap()).collect();
        assert_eq!(found[0]["scene"]["spans"].as_array().unwrap().len(), spans, "{case}");
        let wanted = found[0]["scene"]["spans"].as_array().unwrap().iter().map(|span| span.as_str().unwrap());
        for name in wanted.chain(["bridge_position", "cart_position", "x_error", "y_error", "cart_state"]) {
            assert!(names.contains(&name), "{case}: {name} is not in {names:?}");
        }
    }
}

/// Simulated against its log, a machine shows by how much it misses it: by the encoder's rounding where it is the
/// machine that was logged, by much more where its friction is another.
#[test]
fn a_run_beside_its_log() {
    let folder = TempDir::new().unwrap();
    let here = folder.path();
    taut_in(here).args(["init", "axis.toml"]).assert().success();
    let measured =
        ["simulate", "axis.toml", "--experiment", "5 V pulse", "--as-measured", "--no-report", "--out", "made"];
    taut_in(here).args(measured).assert().success();
    let log = "experiment.0.log={ file = \"made/5-v-pulse.measured.csv\", time = \"time_s\", \
               drive_angle = \"drive_angle_rad\" }";
    let beside = |more: &[&str]| {
        let mut args = vec!["simulate", "axis.toml", "--experiment", "5 V pulse"];
        args.extend(["--set", log]);
        args.extend(more);
        let text = taut_in(here).args(&args).assert().success().get_output().stdout.clone();
        let text = String::from_utf8(text).unwrap();
        let told = taut_in(here).args(&args).arg("--json").assert().success().get_output().stdout.clone();
        let told: serde_json::Value = serde_json::from_slice(&told).unwrap();
        let log = &told["experiments"][0]["log"];
        assert_eq!(log["complete"], true);
        assert_eq!(log["outputs"][0]["quantity"], "drive_angle");
        assert_eq!(log["outputs"][0]["score"]["count"], 1001);
        assert!(text.contains("against its log") && text.contains("drive_angle: RMSE"), "{text}");
        log["outputs"][0]["score"]["rmse"].as_f64().unwrap()
    };
    // A count is 2π/2048.
    let count = std::f64::consts::TAU / 2048.0;
    assert!(beside(&[]) < 0.6 * count);
    assert!(beside(&["--set", "cart.friction.coulomb=12"]) > 10.0 * count);
    // Without a log there is nothing to be told.
    let plain = taut_in(here).args(["simulate", "axis.toml", "--json"]).assert().success().get_output().stdout.clone();
    assert!(serde_json::from_slice::<serde_json::Value>(&plain).unwrap()["experiments"][0]["log"].is_null());
}

#[test]
fn json_on_the_terminal_is_the_summary_in_the_folder() {
    let folder = TempDir::new().unwrap();
    let run = taut_in(folder.path())
        .arg("simulate")
        .arg(table4())
        .args(["--json", "--no-report", "--out", "out", "--experiment", "10 V pulse"])
        .assert()
        .success();
    let printed = text(&run.get_output().stdout);
    assert_eq!(printed, fs::read_to_string(folder.path().join("out/summary.json")).unwrap());
    let summary: Value = serde_json::from_str(printed).unwrap();
    assert_eq!(summary["experiments"].as_array().unwrap().len(), 1);
    assert_eq!(summary["solver"]["name"], "exact");
    assert_eq!(summary["experiments"][0]["files"][0], "10-v-pulse.csv");
    let quiet = taut_in(folder.path()).arg("simulate").arg(table4()).arg("--quiet").assert().success();
    assert!(quiet.get_output().stdout.is_empty() && quiet.get_output().stderr.is_empty());
}

#[test]
fn wrong_input_is_told_on_stderr_with_status_2() {
    let folder = TempDir::new().unwrap();
    let misspelt = taut::case::TEMPLATE.replace("torque_constant", "torque_konstant");
    fs::write(folder.path().join("axis.toml"), misspelt).unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    let table4 = table4();
    let table4 = table4.to_str().unwrap();
    let wrong: [(&[&str], &str); 15] = [
        (&["simulate", "nowhere.toml"], "error: nowhere.toml: this case file cannot be read: there is no such file"),
        (&["simulate", "axis.toml"], "did you mean `torque_constant`?"),
        (&["simulate", table4, "--set", "cart.mass=0.5 m"], "a length"),
        (&["simulate", table4, "--experiment", "6 V pulse"], "allowed: \"5 V pulse\", \"10 V pulse\""),
        (&["simulate", table4, "--step", "1ms"], "add --solver table3"),
        (&["simulate", table4, "--solver", "table3", "--step", "0"], "a step above zero"),
        (&["simulate", table4, "--out", "file"], "error: file: this is a file, not a folder"),
        (&["simulate", table4, "--frobnicate"], "unexpected argument '--frobnicate'"),
        (&["tune", table4, "--effort", "-1"], "a number from 0.1 to 100 is needed"),
        (&["init", "."], "this is a folder"),
        (&["simulate", table4, "--as-measured", "--out", "out"], "add [encoder] with for example at = \"motor\""),
        (&["simulate", table4, "--as-measured"], "--out <DIR>"),
        (&["simulate", table4, "--live"], "--out <DIR>"),
        (&["simulate", table4, "--live", "--no-report", "--out", "out"], "cannot be used with '--no-report'"),
        (
            &[
                "simulate",
                table4,
                "--as-measured",
                "--solver",
                "table3",
                "--out",
                "out",
                "--set",
                "encoder={ at = \"motor\", lines = 512 }",
            ],
            "leave --solver table3 out, or --as-measured",
        ),
    ];
    for (args, message) in wrong {
        let run = taut_in(folder.path()).args(args).assert().code(2);
        let (out, err) = (text(&run.get_output().stdout), text(&run.get_output().stderr));
        assert!(err.starts_with("error: ") && err.contains(message), "{args:?} says\n{err}");
        assert!(out.is_empty() && !err.contains('\u{1b}'), "{args:?}");
    }
    assert_eq!(names(folder.path()), ["axis.toml", "file"]);
}

#[test]
fn help_and_version_are_answers() {
    let folder = TempDir::new().unwrap();
    let help = taut_in(folder.path()).args(["simulate", "--help"]).assert().success();
    let help = text(&help.get_output().stdout);
    assert!(help.contains("Examples:") && help.contains("--set") && !help.contains('\u{1b}'));
    taut_in(folder.path()).arg("--version").assert().success();
    taut_in(folder.path()).assert().code(2);
}

#[test]
fn a_run_that_diverges_says_how_far_it_came() {
    let folder = TempDir::new().unwrap();
    let far = ["--set", "experiment.0.until=9s", "--set", "experiment.0.every=10ms", "--experiment", "5 V pulse"];
    let run = taut_in(folder.path())
        .arg("simulate")
        .arg(table4())
        .args(["--solver", "table3", "--step", "10ms", "--out", "out", "--no-report"])
        .args(far)
        .assert()
        .code(1);
    let err = text(&run.get_output().stderr);
    assert!(err.starts_with("error: the run \"5 V pulse\" ended at "), "{err}");
    let summary = json(&folder.path().join("out/summary.json"));
    assert_eq!(summary["experiments"][0]["ending"]["word"], "diverged");
    assert!(names(&folder.path().join("out")).contains(&"5-v-pulse.csv".to_string()));
}

fn controllers() -> PathBuf {
    stage("sollmann-jouaneh/controllers")
}

#[test]
fn moves_in_closed_loop() {
    let folder = TempDir::new().unwrap();
    let case = controllers().join("pid-elastic.toml");
    let output = taut_in(folder.path())
        .args(["move", "--move", "short fast", "--out", "moved", "--json"])
        .arg(&case)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let error = told["moves"][0]["cart_error"]["peak_m"].as_f64().unwrap().abs();
    assert!(error > 1e-6 && error < 50e-6, "{error}");
    let moved = folder.path().join("moved");
    assert_eq!(json(&moved.join("summary.json")), told);
    let rows = fs::read_to_string(moved.join("short-fast.csv")).unwrap();
    assert!(rows.lines().next().unwrap().ends_with("encoder_count,reference_m,cart_error_m"));
    assert_eq!(rows.lines().count(), 602);
    let samples = fs::read_to_string(moved.join("short-fast.samples.csv")).unwrap();
    assert_eq!(samples.lines().next().unwrap(), "time_s,reference_m,measured_m,asked_V,given_V");
    assert!(moved.join("report.html").exists() && moved.join("plots/short-fast-motion.svg").exists());
    // The case that was written repeats the move.
    let again =
        taut_in(folder.path()).args(["move", "moved/case.toml", "--move", "short fast", "--json"]).output().unwrap();
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(again["moves"][0]["cart_error"], told["moves"][0]["cart_error"]);
}

#[test]
fn moves_that_cannot_be() {
    let folder = TempDir::new().unwrap();
    let case = controllers().join("pid.toml");
    let output = taut_in(folder.path()).arg("simulate").arg(&case).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("run its moves with `taut move`"), "{}", text(&output.stderr));
    let output = taut_in(folder.path()).arg("move").arg(table4()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("no move and no controller"), "{}", text(&output.stderr));
    // With the controller that this proposes, only the move is missing.
    let with_controller = std::fs::read_to_string(&case).unwrap().replace("[[move]]", "[[ignored]]");
    let with_controller = with_controller.split("[[ignored]]").next().unwrap();
    std::fs::write(folder.path().join("still.toml"), with_controller).unwrap();
    let output = taut_in(folder.path()).args(["move", "still.toml"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.contains("this case has no move") && !told.contains("[controller]"), "{told}");
    let output = taut_in(folder.path()).arg("move").arg(&case).args(["--spread", "150%"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

/// Poles, matrices and files of `taut modes`; wrong places and ranges are told.
#[test]
fn modes_of_the_papers_machine() {
    let folder = TempDir::new().unwrap();
    let case = table4();
    let file = case.to_str().unwrap();
    let args = ["modes", file, "--out", "out", "--sample-time", "1ms", "--json"];
    let run = taut_in(folder.path()).args(args).assert().success();
    let found: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!(found, json(&folder.path().join("out/modes.json")));
    let poles = found["poles"].as_array().unwrap();
    assert_eq!(poles.iter().filter(|pole| pole["integrator"] == true).count(), 1);
    assert_eq!((poles.len(), found["A"].as_array().unwrap().len()), (6, 6));
    // r K_t/R / (B₁ + B₂ + b r² + K_t K_e/R): what a volt moves in the long run
    let r = 0.0194_f64;
    let speed = r * 0.023 / 0.71 / (2.0 * 0.0016 + 19.0424 * r * r + 0.023 * 0.023 / 0.71);
    let gain = found["outputs"][1]["low_frequency_gain"].as_f64().unwrap();
    assert!((gain / speed - 1.0).abs() < 1e-9, "{gain} {speed}");
    assert!(found["operation"]["sticks_at_rest"] == true && found["stiffness_depends_on_position"] == false);
    assert_eq!(
        names(&folder.path().join("out")),
        ["files.json", "frequency-response.csv", "modes.json", "plots", "report.html"]
    );
    let rest = taut_in(folder.path()).args(["modes", file, "--speed", "0"]).assert().success();
    assert!(text(&rest.get_output().stdout).contains("at rest this stage sticks"));
    for (wrong, told) in [
        (["--from", "10", "--to", "5"], "before it begins"),
        (["--sample-time", "1ms", "--delay", "1s"], "late by 1 s"),
        (["--stuck", "rotor", "--speed", "0"], "this machine has no body \"rotor\"\n  allowed: drive, cart, idler"),
        (["--bridge", "1mm", "--speed", "0"], "this machine has no bridge"),
    ] {
        let run = taut_in(folder.path()).args(["modes", file]).args(wrong).assert().code(2);
        assert!(text(&run.get_output().stderr).contains(told), "{wrong:?}");
    }
}

#[test]
fn several_cases_are_simulated_one_after_the_other() {
    let folder = TempDir::new().unwrap();
    let cases = ["h-frame/h-frame.toml", "core-xy/core-xy.toml", "printer-axis/printer-axis.toml"];
    let cases: Vec<String> = cases.iter().map(|case| stage(case).display().to_string()).collect();
    let run = |more: &[&str]| taut_in(folder.path()).arg("simulate").args(&cases).args(more).output().unwrap();
    let done = run(&["--out", "out", "--no-report"]);
    assert!(done.status.success(), "{done:?}");
    for name in ["h-frame", "core-xy", "printer-axis"] {
        assert!(folder.path().join("out").join(name).join("summary.json").exists(), "{name}");
    }
    let refused = run(&["--json"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("name one case"));
    let same = taut_in(folder.path()).args(["simulate", &cases[0], &cases[0], "--out", "out"]).output().unwrap();
    assert!(text(&same.stderr).contains("another case has the same name"), "{same:?}");
}
