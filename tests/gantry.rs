//! Gantries against independent solvers (`authorities/gantry.py`), and laws that hold for any of them.

use serde_json::Value;
use taut::case::{GantryCase, GantryExperiment};
use taut::solve::{Course, Detail, Ending, Event, Flow, Solver, stream_mechanism};
use taut::trajectory::Trajectory;

/// What a run of the first experiment of a case gives.
struct Run {
    rows: Trajectory,
    events: Vec<Event>,
}

fn course(experiment: &GantryExperiment) -> Course {
    Course {
        inputs: experiment.inputs.to_vec(),
        start: experiment.initial,
        until: experiment.until,
        every: experiment.every,
    }
}

fn run(case: &GantryCase, solver: Solver) -> Run {
    let mechanism = case.gantry.mechanism();
    let mut rows = Trajectory::default();
    let sink = &mut |block: &Trajectory| {
        if rows.is_empty() {
            rows = Trajectory::with_capacity(&block.columns, 1024);
        }
        rows.append(block);
        Flow::Continue
    };
    let course = course(&case.experiments[0]);
    let outcome = stream_mechanism(&mechanism, &course, solver, (Detail::Full, None), sink).unwrap();
    assert_eq!(outcome.ending, Ending::Complete);
    Run { rows, events: outcome.events }
}

fn cases() -> Value {
    serde_json::from_str(include_str!("authorities/gantry.json")).unwrap()
}

/// Events as the authority tells them, simultaneous ones in the order of their bodies.
fn told(events: &[Event]) -> Vec<(f64, &'static str, &'static str, &'static str)> {
    let mut told: Vec<_> = events.iter().map(|e| (e.time, e.part.key(), e.from.word(), e.to.word())).collect();
    told.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap());
    told
}

/// The largest differences from the authority: at the belt, m; of speeds there, m/s; of events, s.
fn compare(solver: Solver, (length, speed, time): (f64, f64, f64)) {
    let file = cases();
    let columns: Vec<&str> = file["columns"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let (mut worst, mut events, mut faults) = ([0.0_f64; 3], 0, Vec::new());
    let cases = file["cases"].as_array().unwrap();
    for told_case in cases {
        let name = told_case["name"].as_str().unwrap();
        let case = GantryCase::from_text_with("gantry.toml", told_case["case"].as_str().unwrap(), &[]).unwrap();
        let run = run(&case, solver);
        let r = case.gantry.pulley_radius;
        let doubt = |key: &str| 4.0 * told_case["methods_differ_by"][key].as_f64().unwrap();
        for (row, want) in told_case["rows"].as_array().unwrap().iter().zip(told_case["states"].as_array().unwrap()) {
            let row = row.as_u64().unwrap() as usize;
            for (column, want) in columns.iter().zip(want.as_array().unwrap()).skip(1) {
                let have = run.rows.get(column).unwrap()[row];
                let lever = if column.starts_with("left") || column.starts_with("right") { r } else { 1.0 };
                let off = lever * (have - want.as_f64().unwrap()).abs();
                let (index, limit, key) = match column.ends_with("speed") {
                    true => (1, speed, "belt_m_s"),
                    false => (0, length, "belt_m"),
                };
                worst[index] = worst[index].max(off);
                if off > limit.max(doubt(key)) {
                    faults.push(format!("{name}: row {row}, {column}: {off:e} off"));
                }
            }
        }
        let (have, want) = (told(&run.events), told_case["events"].as_array().unwrap());
        if have.len() != want.len() {
            faults.push(format!("{name}: {} events instead of {}", have.len(), want.len()));
            continue;
        }
        events += want.len();
        for (have, want) in have.iter().zip(want) {
            let word = |k: usize| want[k].as_str().unwrap();
            let off = (have.0 - want[0].as_f64().unwrap()).abs();
            worst[2] = worst[2].max(off);
            if (have.1, have.2, have.3) != (word(1), word(2), word(3)) || off > time.max(doubt("event_s")) {
                faults.push(format!("{name}: {have:?} instead of {want}"));
            }
        }
    }
    println!("{} cases, {events} events: {worst:?}", cases.len());
    assert!(cases.len() >= 100 && events > 1000);
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(20)].join("\n"));
}

#[test]
fn the_exact_solver_agrees_with_the_authority() {
    compare(Solver::Exact, (1e-9, 1e-7, 1e-9));
}

#[test]
fn the_general_solver_agrees_with_the_authority() {
    compare(Solver::General { tolerance: 1e-12 }, (1e-9, 1e-7, 1e-7));
}
