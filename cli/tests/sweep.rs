//! `taut sweep` as its user gets it: the same file whatever threads and interruptions, and mistakes told.
#![cfg(unix)]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use taut::log::read_columns;
use tempfile::TempDir;

fn machine(name: &str) -> String {
    format!("{}/../stages/sollmann-jouaneh/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command.arg("sweep").args(arguments).current_dir(folder).stdin(Stdio::null());
    crate::faults::by_default(&mut command);
    command
}

fn sweep(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = sweep(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn told(folder: &Path, arguments: &[&str]) -> String {
    let output = sweep(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Finished chunks.
fn parts(folder: &Path) -> usize {
    let entries = fs::read_dir(folder).map(|entries| entries.flatten().collect()).unwrap_or_else(|_| Vec::new());
    entries.iter().filter(|entry| entry.path().extension().is_some_and(|e| e == "part")).count()
}

/// Waits until so many chunks are there.
fn wait_for(child: &mut Child, folder: &Path, wanted: usize) {
    let begin = Instant::now();
    while parts(folder) < wanted {
        assert!(begin.elapsed() < Duration::from_secs(120), "it never came so far");
        assert!(child.try_wait().unwrap().is_none(), "it was done too soon");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn figures_are_chosen_and_those_that_nothing_has_are_told() {
    let folder = TempDir::new().unwrap();
    let (case, sweep) = (machine("table4.toml"), ["--runs", "3", "--vary", "cart.mass=20%", "--out", "runs.csv"]);
    let with = |figures: &'static str| [&[case.as_str(), "--figures", figures][..], &sweep].concat();
    done(folder.path(), &with("peak_cart_speed, stop_time"));
    let text = fs::read_to_string(folder.path().join("runs.csv")).unwrap();
    assert_eq!(
        text.lines().next(),
        Some(
            "run,cart.mass_kg,5-v-pulse.status,5-v-pulse.peak_cart_speed_m_s,5-v-pulse.stop_time_s,10-v-pulse.status,\
             10-v-pulse.peak_cart_speed_m_s,10-v-pulse.stop_time_s"
        )
    );
    let message = told(folder.path(), &with("peak_cart_sped"));
    let expected = "nothing that is swept has a figure \"peak_cart_sped\"\n  next: leave figures out: the columns of the \
                    result are named after all there are\n";
    assert!(message.contains(expected), "{message}");
    let message = told(folder.path(), &[&[case.as_str(), "--set", "sweep.figures=[]"][..], &sweep].concat());
    assert!(message.contains("sweep.figures: the list is empty"), "{message}");
}

#[test]
fn the_file_is_the_same_on_any_number_of_threads() {
    let folder = TempDir::new().unwrap();
    for ending in ["parquet", "csv"] {
        let files: Vec<Vec<u8>> = ["1", "2", "3"]
            .iter()
            .map(|threads| {
                let out = format!("{threads}.{ending}");
                let case = machine("table4.toml");
                done(
                    folder.path(),
                    &[&case, "--runs", "300", "--vary", "all=20%", "--threads", threads, "--out", &out],
                );
                fs::read(folder.path().join(out)).unwrap()
            })
            .collect();
        assert!(files[0].len() > 10_000 && files[0] == files[1] && files[0] == files[2]);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 6, "no parts are left");
    let columns =
        read_columns(&folder.path().join("1.parquet"), &["run", "cart.mass_kg", "5-v-pulse.peak_motor_current_A"])
            .unwrap();
    let other =
        read_columns(&folder.path().join("1.csv"), &["run", "cart.mass_kg", "5-v-pulse.peak_motor_current_A"]).unwrap();
    assert_eq!(columns, other);
    assert_eq!((columns[0][299], columns[0].len()), (299.0, 300));
    assert!(columns[1].iter().all(|mass| (0.8 * 0.362..1.2 * 0.362).contains(mass)));
    let bytes = fs::read(folder.path().join("1.parquet")).unwrap();
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(holds("unit.cart.mass_kg") && holds("unit.5-v-pulse.peak_span1_force_N"));
}

/// kill -9 twice in the middle, and once Ctrl-C: the same command goes on, does nothing twice, and the file is that of
/// a run in one go.
#[test]
fn a_killed_sweep_goes_on() {
    let folder = TempDir::new().unwrap();
    let case = machine("table4.toml");
    let plan = |out: &'static str| {
        [&case as &str, "--runs", "6000", "--design", "sobol", "--vary", "all=20%", "--threads", "2", "--out", out]
            .map(str::to_string)
    };
    let run = |out: &'static str| {
        let plan = plan(out);
        let plan: Vec<&str> = plan.iter().map(String::as_str).collect();
        command(folder.path(), &plan)
    };
    let parts_folder = folder.path().join("killed.parquet.parts");
    for (signal, status) in [("-KILL", None), ("-KILL", None), ("-INT", Some(130))] {
        let before = parts(&parts_folder);
        let mut child = run("killed.parquet").stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        wait_for(&mut child, &parts_folder, before + 2);
        assert!(Command::new("kill").arg(signal).arg(child.id().to_string()).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), status);
        if status.is_some() {
            let told = String::from_utf8(output.stderr).unwrap();
            assert!(told.contains("the same command continues from there"), "{told}");
        }
        assert!(!folder.path().join("killed.parquet").exists());
        assert!(parts(&parts_folder) >= before + 2, "what was done is kept");
    }
    // Another plan does not mix with it.
    let other = told(folder.path(), &[&case, "--runs", "6000", "--vary", "all=10%", "--out", "killed.parquet"]);
    assert!(other.contains("this folder has an unfinished sweep of another case, plan or version"), "{other}");
    assert!(other.contains("remove killed.parquet.parts"), "{other}");

    let kept = parts(&parts_folder);
    let output = run("killed.parquet").output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let line = text.lines().find(|line| line.contains("simulations a second")).unwrap();
    let again: usize = line.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(again < 6000 && kept >= 6, "{line}");
    assert!(run("whole.parquet").output().unwrap().status.success());
    let [killed, whole] = ["killed.parquet", "whole.parquet"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(killed == whole, "{} and {} bytes", killed.len(), whole.len());
    assert!(!parts_folder.exists());
}

#[test]
fn a_folder_has_rows_summary_case_report_and_plots() {
    let folder = TempDir::new().unwrap();
    let arguments = [
        "--runs",
        "128",
        "--design",
        "sobol",
        "--indices",
        "--vary",
        "cart.mass=20%",
        "--vary",
        "motor.resistance=normal(0.71 ohm, 0.02 ohm)",
    ];
    let case = machine("table4.toml");
    let text = done(folder.path(), &[&[&case as &str, "--out", "out"], &arguments[..]].concat());
    assert!(text.contains("512 runs of 2 simulations each: 2 parameters, sobol, for Sobol' indices"), "{text}");
    let out = folder.path().join("out");
    let summary: Value = serde_json::from_str(&fs::read_to_string(out.join("sweep.json")).unwrap()).unwrap();
    let figures = summary["experiments"][0]["figures"].as_array().unwrap();
    let current = figures.iter().find(|figure| figure["name"] == "peak_motor_current").unwrap();
    // The peak of the current is that of the first moment, V/R: nothing else matters.
    assert!((current["indices"]["motor.resistance"]["total"]["value"].as_f64().unwrap() - 1.0).abs() < 0.2);
    assert!(current["indices"]["cart.mass"]["total"]["value"].as_f64().unwrap().abs() < 1e-9);
    let report = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("first order") && report.contains("motor.resistance"));
    assert!(out.join("plots/5-v-pulse-peak-motor-current-indices.svg").exists());
    assert!(out.join("plots/5-v-pulse-final-cart-position-histogram.svg").exists());
    // The case of the folder repeats it.
    let again: Value = serde_json::from_str(&done(&out, &["case.toml", "--json"])).unwrap();
    assert_eq!(again, summary);
}

/// Counted from the rows, of an experiment and of moves: one that keeps its steps and one that loses them.
#[test]
fn the_probability_of_lost_steps_is_told() {
    let folder = TempDir::new().unwrap();
    let case = machine("../stepper-axis/stepper-axis.toml");
    let (torque, mass) = ("stepper.holding_torque=40%", "cart.mass=40%");
    let text = done(folder.path(), &[&case, "--runs", "6", "--vary", torque, "--vary", mass, "--out", "out"]);
    let out = folder.path().join("out");
    let summary: Value = serde_json::from_str(&fs::read_to_string(out.join("sweep.json")).unwrap()).unwrap();
    let mut seen = Vec::new();
    for group in summary["experiments"].as_array().unwrap() {
        let file = taut::plan::file_name(group["name"].as_str().unwrap());
        let names = ["in_step", "lost_steps"].map(|name| format!("{file}.{name}"));
        let columns = read_columns(&out.join("runs.parquet"), &names.each_ref().map(String::as_str)).unwrap();
        let slipped = columns[0].iter().filter(|value| **value == 0.0).count();
        let lost = &group["lost_steps"];
        assert_eq!([&lost["runs"], &lost["of"]].map(Value::as_u64), [Some(slipped as u64), Some(6)], "{group}");
        let ends = [0, 1].map(|k| lost["interval_95"][k].as_f64().unwrap());
        assert!(ends[0] <= slipped as f64 / 6.0 && slipped as f64 / 6.0 <= ends[1], "{group}");
        assert!(text.contains(&format!("steps are lost in {slipped} of 6 runs")), "{text}");
        // Steps in which a run ends behind were lost.
        assert!(columns[1].iter().filter(|steps| **steps != 0.0).count() <= slipped);
        seen.push(slipped);
    }
    assert!(seen.iter().any(|slipped| *slipped > 0) && seen.contains(&0), "{seen:?}");
    let plain = machine("table4.toml");
    let text = done(folder.path(), &[&plain, "--runs", "2", "--vary", "cart.mass=20%"]);
    assert!(!text.contains("steps are lost"), "{text}");
}

#[test]
fn trajectories_are_written_on_request() {
    let folder = TempDir::new().unwrap();
    let case = machine("table4.toml");
    let options = ["--runs", "3", "--vary", "cart.mass=20%", "--solver", "exact", "--trajectories"];
    done(folder.path(), &[&[case.as_str()], &options[..], &["--out", "r.parquet"]].concat());
    let names = ["run", "experiment", "time_s", "cart_position_m"];
    let columns = read_columns(&folder.path().join("r-trajectories.parquet"), &names).unwrap();
    assert_eq!(columns[0].len(), 3 * 2 * 1001);
    let rows = read_columns(&folder.path().join("r.parquet"), &["10-v-pulse.final_cart_position_m"]).unwrap();
    let last = (0..columns[0].len()).rfind(|row| columns[0][*row] == 1.0).unwrap();
    assert_eq!((columns[1][last], columns[2][last], columns[3][last]), (1.0, 1.0, rows[0][1]));
}

#[test]
fn mistakes_on_the_command_line_are_told() {
    let folder = TempDir::new().unwrap();
    let case = machine("table4.toml");
    for (arguments, message) in [
        (vec![], "this case has no parameters to vary"),
        (vec!["--runs", "10"], "nothing is varied"),
        (vec!["--vary", "all=20%"], "`sweep.runs` is missing"),
        (vec!["--runs", "0", "--vary", "all=20%"], "has to be above zero"),
        (vec!["--runs", "1.5", "--vary", "all=20%"], "has to be a whole number"),
        (vec!["--runs", "10", "--vary", "cart.mass"], "does not say how something varies"),
        (vec!["--runs", "10", "--vary", "=20%"], "does not say how something varies"),
        (vec!["--runs", "10", "--vary", "cart.mas=20%"], "did you mean `cart.mass`?"),
        (vec!["--runs", "10", "--vary", "cart.mass=20 kg"], "is not a distribution of a parameter"),
        (vec!["--runs", "10", "--vary", "cart.load=20%"], "is 0, of which a share"),
        (vec!["--runs", "10", "--vary", "all=20%", "--design", "sobl"], "did you mean \"sobol\"?"),
        (vec!["--runs", "10", "--vary", "all=20%", "--interval", "2 s"], "does not suit"),
        (vec!["--runs", "10", "--vary", "all=20%", "--out", "no/runs.csv"], "there is no folder no"),
        (vec!["--runs", "10", "--vary", "all=20%", "--out", "runs.xlsx"], "rows are not written as .xlsx"),
        (vec!["--runs", "200000", "--vary", "all=20%"], "too many to keep in memory"),
        (vec!["--runs", "20000", "--vary", "all=20%", "--out", "t.csv", "--trajectories"], "would fill the disk"),
        (vec!["--runs", "10", "--vary", "all=20%", "--trajectories"], "--out"),
        (vec!["--runs", "10", "--vary", "all=20%", "--threads", "0"], "a whole number from 1"),
        (vec!["--runs", "10", "--vary", "cart.mass=20%", "--vary", "total.inertia=20%"], "set the same number"),
        (vec!["--runs", "10", "--vary", "cart.mass=20%", "--vary", "cart.mass=10%"], "cart.mass varies twice"),
        (vec!["--runs", "10", "--vary", "all=20%", "--seed=-1"], "a whole number from 0 to 9223372036854775807"),
        (
            vec!["--indices", "--design", "grid", "--vary", "cart.mass=values(1 kg)"],
            "sensitivity indices are not available",
        ),
    ] {
        let told = told(folder.path(), &[&[&case as &str], &arguments[..]].concat());
        assert!(told.contains(message), "{arguments:?}: {told}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left of them");
}

/// A sweep of 10^12 runs began to write; one on 100,000 threads started them all.
#[test]
fn a_sweep_says_before_it_begins_what_it_takes() {
    let folder = TempDir::new().unwrap();
    let case = machine("table4.toml");
    let sweep = |more: &[&str]| {
        let mut run = Command::new(env!("CARGO_BIN_EXE_taut"));
        run.current_dir(folder.path()).args(["sweep", &case, "--vary", "all=20%", "--no-report"]).args(more);
        let output = run.output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let begin = Instant::now();
    let (status, told) = sweep(&["--runs", "1e12", "--out", "runs.csv"]);
    assert!(status == Some(2) && begin.elapsed() < Duration::from_secs(20));
    assert!(told.starts_with("error: --runs: 1000000000000 runs make a file of about "), "{told}");
    assert!(told.contains(" TB while it is written\n  allowed: up to 10000000000 runs\n"), "{told}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let (status, told) = sweep(&["--runs", "1e1", "--threads", "100000", "--out", "runs.csv"]);
    assert_eq!(status, Some(0));
    let started = std::thread::available_parallelism().unwrap().get().min(10);
    assert!(told.starts_with(&format!("note: --threads 100000: {started} are started, because there are ")), "{told}");
    assert_eq!(fs::read_to_string(folder.path().join("runs.csv")).unwrap().lines().count(), 11);
}

/// Section 3 of the paper, which `taut paper` computes by a way of its own.
#[test]
fn the_papers_study_is_a_sweep() {
    let folder = TempDir::new().unwrap();
    let paper = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(["paper", "--out", "p"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(paper.status.success());
    let claims: Vec<Value> =
        serde_json::from_str(&fs::read_to_string(folder.path().join("p/claims.json")).unwrap()).unwrap();
    let checks = |id: &str| -> Vec<(String, f64)> {
        let claim = claims.iter().find(|claim| claim["id"] == id).unwrap();
        let checks = claim["checks"].as_array().unwrap();
        checks.iter().map(|c| (c["what"].as_str().unwrap().to_string(), c["value"].as_f64().unwrap())).collect()
    };
    let summary: Value = serde_json::from_str(&done(folder.path(), &[&machine("sweep.toml"), "--json"])).unwrap();
    let relative = |experiment: usize, parameter: &str, which: usize| -> f64 {
        let figures = summary["experiments"][experiment]["figures"].as_array().unwrap();
        let figure = figures.iter().find(|figure| figure["name"] == "final_drive_travel").unwrap();
        let value = figure["one_at_a_time"][parameter][which]["figure"].as_f64().unwrap();
        value / figure["nominal"].as_f64().unwrap() - 1.0
    };
    let inertia = "drive_pulley.inertia = idler_pulley.inertia";
    let all = format!("{inertia} = cart.mass");
    let stiffness: f64 = [0, 1]
        .iter()
        .flat_map(|volts| [0, 1].map(|which| relative(*volts, "belt.stiffness", which).abs()))
        .fold(0.0, f64::max);
    let of = |id: &str, what: &str| checks(id).into_iter().find(|(own, _)| own == what).unwrap().1;
    for (swept, claimed) in [
        (relative(0, inertia, 0), of("p10-inertia", "J ×2, Table 4 at 5 V")),
        (relative(0, &all, 0), of("p10-inertia", "J and M ×2, Table 4 at 5 V")),
        (stiffness, of("p10-stiffness", "largest change, Table 4")),
    ] {
        assert!((swept - claimed).abs() < 1e-10, "{swept} and {claimed}");
    }
    // In the remark, to three digits: "From Table 4 it is −61.6 % and +111 % at 5 V."
    let remark =
        claims.iter().find(|claim| claim["id"] == "p10-friction").unwrap()["remark"].as_str().unwrap().to_string();
    let friction = summary["parameters"][3]["name"].as_str().unwrap();
    for which in [0, 1] {
        let percent = taut::number::significant(100.0 * relative(0, friction, which).abs(), 3);
        assert!(remark.contains(&percent), "{percent}: {remark}");
    }
}
