//! Every machine under `stages/` gives the curves beside it.
//!
//! `UPDATE_EXPECT=1 cargo test -p taut --test all stages::` writes the curves anew.

use crate::common;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use taut::case::{Case, Experiment};
use taut::fit::{Fit, fit};
use taut::log::read_columns;
use taut::measure::measure;
use taut::signal::Signal;
use taut::solve::{Course, Detail, Ending, Flow, Solver, simulate, stream_mechanism};
use taut::trajectory::{CsvWriter, Trajectory};

/// The paper's procedure, within its machine's folder.
const PROCEDURE: &str = "sollmann-jouaneh/identification";

/// Intervals between the rows that are kept of each experiment.
const KEPT: usize = 5;

/// How far a position may be off, m.
const TOLERANCE: f64 = 1e-9;

fn stages() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("stages")
}

/// The content of a folder, sorted.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    entries
}

/// The case files of a machine, with its name and theirs: `emps/emps.toml`.
fn cases(machine: &Path) -> Vec<(String, PathBuf)> {
    let toml = |path: &PathBuf| path.extension().is_some_and(|e| e == "toml");
    let name = |path: &Path| path.strip_prefix(stages()).unwrap().to_string_lossy().into_owned();
    entries(machine).into_iter().filter(toml).map(|path| (name(&path), path)).collect()
}

/// A few rows of every experiment of a case: what must not change. A case that is there to be fitted has none.
fn curve(path: &Path) -> String {
    if !common::data::of_case(path) {
        return String::new();
    }
    match Case::read_with(path, &[]).unwrap_or_else(|error| panic!("{error}")) {
        case if case.is_axis() => curve_of_axis(path, &case),
        case => curve_of_gantry(path, &case),
    }
}

/// The heading of the columns of a machine's curves.
fn heading(machine: &Path) -> &'static str {
    let is_gantry = |path: &PathBuf| matches!(Case::read_with(path, &[]), Ok(case) if !case.is_axis());
    match cases(machine).iter().any(|(_, path)| is_gantry(path)) {
        true => "case,experiment,time_s,bridge_by_drives_m,cart_by_drives_m,bridge_position_m,cart_position_m\n",
        false => "case,experiment,time_s,drive_travel_m,cart_position_m\n",
    }
}

/// The solver of a machine; where that is the general one, its curves as good as it can be.
fn solver(usual: Solver) -> Solver {
    match usual {
        Solver::Exact => Solver::Exact,
        _ => Solver::General { tolerance: 1e-12 },
    }
}

fn curve_of_gantry(path: &Path, case: &Case) -> String {
    let mut text = String::new();
    let mechanism = case.machine.mechanism();
    let solver = solver(Solver::of_mechanism(&mechanism));
    for experiment in &case.experiments {
        let mut rows = Trajectory::default();
        let sink = &mut |block: &Trajectory| {
            rows.append(block);
            Flow::Continue
        };
        let course = Course::new(&mechanism, experiment);
        let outcome = stream_mechanism(&mechanism, &course, solver, (Detail::Full, None), sink).unwrap();
        assert_eq!(outcome.ending, Ending::Complete, "{}: {}", path.display(), experiment.name);
        for kept in 0..=KEPT {
            let row = (rows.len() - 1) * kept / KEPT;
            let at = |name: &str| rows.get(name).unwrap()[row];
            let (geometry, mut angles) = (case.machine.geometry(), [0.0; 6]);
            for drive in geometry.drives {
                angles[drive.pulley] = at(&format!("{}_angle", geometry.label(drive.pulley).key));
            }
            let places: [f64; 2] = case.machine.by_drives(&angles).try_into().unwrap();
            let [x, y] = places.map(|way| way + 0.0);
            let (time, bridge, cart) = (at("time"), at("bridge_position"), at("cart_position"));
            let file = path.file_name().unwrap().to_string_lossy();
            let _ = writeln!(text, "{file},{},{time},{x:e},{y:e},{bridge:e},{cart:e}", experiment.name);
        }
    }
    text
}

fn curve_of_axis(path: &Path, case: &Case) -> String {
    let mut text = String::new();
    if case.fit.is_some() {
        return text;
    }
    for experiment in &case.experiments {
        let run = simulate(&case.machine, experiment, solver(Solver::for_machine(&case.machine))).unwrap();
        assert_eq!(run.outcome.ending, Ending::Complete, "{}: {}", path.display(), experiment.name);
        let column = |name: &str| run.trajectory.get(name).unwrap();
        for kept in 0..=KEPT {
            let row = (run.trajectory.len() - 1) * kept / KEPT;
            let drive = case.machine.pulley_radius * column("drive_angle")[row];
            let (time, cart) = (column("time")[row], column("cart_position")[row]);
            let file = path.file_name().unwrap().to_string_lossy();
            let _ = writeln!(text, "{file},{},{time},{drive:e},{cart:e}", experiment.name);
        }
    }
    text
}

#[test]
fn every_machine_gives_its_curves() {
    let mut wrong = Vec::new();
    for machine in entries(&stages()) {
        let mut text = String::from(heading(&machine));
        cases(&machine).iter().for_each(|(_, path)| text += &curve(path));
        let file = machine.join("expected.csv");
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            fs::write(&file, &text).unwrap();
        }
        let expected = fs::read_to_string(&file).unwrap_or_default();
        if expected.lines().count() != text.lines().count() {
            wrong.push(format!("{}: other cases or experiments", file.display()));
            continue;
        }
        for (want, got) in expected.lines().zip(text.lines()).skip(1) {
            let numbers = |line: &str| -> Vec<f64> { line.split(',').skip(2).map(|n| n.parse().unwrap()).collect() };
            let same = want.split(',').take(2).eq(got.split(',').take(2));
            if !same || numbers(want).iter().zip(numbers(got)).any(|(a, b)| (a - b).abs() > TOLERANCE) {
                wrong.push(format!("{}\n  expected {want}\n  is       {got}", file.display()));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{}\nUPDATE_EXPECT=1 cargo test -p taut --test all stages:: writes them anew",
        wrong.join("\n")
    );
}

#[test]
fn every_machine_says_what_it_is_and_where_its_numbers_are_from() {
    for machine in entries(&stages()).into_iter().chain([stages().join(PROCEDURE)]) {
        let readme = fs::read_to_string(machine.join("README.md")).unwrap_or_default();
        assert!(readme.starts_with("# ") && readme.contains("ource"), "{}", machine.display());
        assert!(!cases(&machine).is_empty(), "{}", machine.display());
        for (name, path) in cases(&machine) {
            assert!(readme.contains(path.file_name().unwrap().to_str().unwrap()), "{name} is not in its README");
        }
    }
}

/// The synthetic logs of the paper's procedure are what Table 4 gives behind the rig's encoder.
#[test]
fn the_logs_of_the_procedure_are_made_by_table_4() {
    let encoder = ["encoder.at=drive_pulley", "encoder.lines=3020.8"];
    let case = Case::read_with(stages().join("sollmann-jouaneh/table4.toml"), &encoder).unwrap();
    for experiment in &case.experiments {
        let log = measure(&case.machine, &case.measurement.clone().unwrap_or_default(), experiment, Solver::Exact);
        let file = std::env::temp_dir().join(format!("taut-{}-{}.csv", std::process::id(), experiment.file_name()));
        let mut writer = CsvWriter::create(&file).unwrap();
        writer.write(&log.unwrap().trajectory).unwrap();
        writer.finish().unwrap();
        let made = fs::read(&file).unwrap();
        fs::remove_file(&file).unwrap();
        let committed = stages().join(PROCEDURE).join(format!("logs/{}.measured.csv", experiment.file_name()));
        assert!(made == fs::read(&committed).unwrap(), "{} is out of date", committed.display());
    }
}

/// The paper's procedure: friction of one kind meets one voltage, of two kinds both, and the logs tell two sums of it.
#[test]
fn the_procedure_of_the_paper_comes_out() {
    let fitted = |name: &str| {
        let case = Case::read(stages().join(PROCEDURE).join(name)).unwrap();
        let plan = case.fit.clone().unwrap();
        (fit(&case, &plan, None, &mut |_| Flow::Continue), case.machine.pulley_radius)
    };
    let way = |fit: &Fit, r: f64| {
        fit.logs
            .iter()
            .map(|log| {
                let output = &log.outputs[0];
                r * output.fitted.or(output.held_out).unwrap().rmse
            })
            .collect::<Vec<f64>>()
    };
    let (linear, r) = fitted("linear-5v.toml");
    let linear = way(&linear.unwrap(), r);
    assert!(linear[0] < 0.3e-3 && linear[1] > 40.0 * linear[0], "{linear:?} m");
    let (both, r) = fitted("nonlinear.toml");
    let both = both.unwrap();
    assert!(way(&both, r).iter().all(|rmse| *rmse < 10.1e-6), "{:?} m", way(&both, r));
    // 2 B + r² b and 2 τ_c + r F_c of Table 4
    for (estimate, truth) in both.estimates.iter().zip([2.0 * 0.0016 + r * r * 19.0424, 2.0 * 0.015 + r * 0.2]) {
        assert!((estimate.value / truth - 1.0).abs() < 1e-3, "{} {}", estimate.name, estimate.value);
    }
    let separate = fitted("separate.toml").0.unwrap();
    assert!(!separate.is_complete() && separate.estimates.iter().all(|estimate| estimate.error == Some(f64::INFINITY)));
    // What the logs tell of the four are the two sums.
    let groups = &separate.identifiability.as_ref().unwrap().groups;
    assert_eq!(groups.iter().map(|group| group.combinations.len()).collect::<Vec<_>>(), [1, 1]);
    for (group, truth) in groups.iter().zip([19.0424 + 2.0 * 0.0016 / (r * r), 0.2 + 2.0 * 0.015 / r]) {
        let sum = &group.combinations[0];
        assert!((sum.value / truth - 1.0).abs() < 1e-2, "{}: {}, {truth}", sum.name, sum.value);
    }
}

/// The rig is Table 4 seen from before the gear: motion differs by what 19.404 mm instead of 19.4 mm of radius makes.
#[test]
fn the_rig_moves_as_table_4_says() {
    let [rig, table4] =
        ["rig", "table4"].map(|name| Case::read(stages().join(format!("sollmann-jouaneh/{name}.toml"))).unwrap());
    for (a, b) in rig.machine.belt.stiffness.iter().zip([1.3276e5, 1.3276e5, 5.8885e4]) {
        assert!((a / b - 1.0).abs() < 1e-5, "{a}");
    }
    for (mine, theirs) in rig.experiments.iter().zip(&table4.experiments) {
        let end = |case: &Case, experiment: &Experiment| {
            let run = simulate(&case.machine, experiment, Solver::Exact).unwrap();
            *run.trajectory.get("cart_position").unwrap().last().unwrap()
        };
        let (mine, theirs) = (end(&rig, mine), end(&table4, theirs));
        assert!((mine / theirs - 1.0).abs() < 1e-3, "{mine} {theirs}");
    }
}

/// The numbers that the authors of pendule_pi published meet their 42 records to 3.8 mm.
#[test]
fn the_cart_of_pendule_pi_moves_as_recorded() {
    let Some([file]) = common::data::data(["pendulepi/february.csv"]) else { return };
    let columns = read_columns(&file, &["pwm", "time_us", "position"]).unwrap();
    let case = Case::read(stages().join("pendulepi/pendulepi.toml")).unwrap();
    let (mut squares, mut count, mut runs, mut first) = (0.0, 0.0, 0, 0);
    while first < columns[0].len() {
        let pwm = columns[0][first];
        let rows = columns[0][first..].iter().take_while(|p| **p == pwm).count();
        let (times, positions) = (&columns[1][first..first + rows], &columns[2][first..first + rows]);
        let input = Signal::Step { value: pwm, at: 0.0 };
        let until = (rows - 1) as f64 * 5e-3;
        let experiment = Experiment { inputs: vec![input], until, every: 5e-3, ..case.experiments[0].clone() };
        let run = simulate(&case.machine, &experiment, Solver::Exact).unwrap().trajectory;
        let travel = run.get("cart_position").unwrap();
        for (time, position) in times.iter().zip(positions) {
            let row = ((time - times[0]) * 1e-6 / 5e-3).round() as usize;
            squares += (position - positions[0] - travel[row.min(rows - 1)]).powi(2);
            count += 1.0;
        }
        runs += 1;
        first += rows;
    }
    let deviation = f64::sqrt(squares / count);
    assert!(runs == 42 && (deviation - 3.76e-3).abs() < 0.05e-3, "{runs} runs, {deviation} m");
}
