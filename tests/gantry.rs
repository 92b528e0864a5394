//! Gantries against independent solvers (`authorities/gantry.py`), and laws that hold for any of them.

use serde_json::Value;
use taut::case::GantryCase;
use taut::metrics::{GantryMeter, GantryMetrics, Peak};
use taut::solve::{Course, Detail, Ending, ErrorEstimate, Event, Flow, Solver, stream_mechanism};
use taut::trajectory::Trajectory;

/// What a run of the first experiment of a case gives.
struct Run {
    rows: Trajectory,
    events: Vec<Event>,
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
    let course = Course::of(&case.experiments[0]);
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

/// What a meter says of a run with a row every so many seconds, and the rows.
fn metered(case: &GantryCase, solver: Solver, every: f64) -> (GantryMetrics, Trajectory) {
    let course = Course { every, ..Course::of(&case.experiments[0]) };
    let mut meter = GantryMeter::new(&case.gantry);
    let mut rows = Trajectory::default();
    let sink = &mut |block: &Trajectory| {
        rows.append(block);
        Flow::Continue
    };
    let outcome =
        stream_mechanism(&case.gantry.mechanism(), &course, solver, (Detail::Full, Some(&mut meter)), sink).unwrap();
    (meter.finish(&outcome.events), rows)
}

/// All peaks of a run.
fn peaks(metrics: &GantryMetrics) -> Vec<Peak> {
    let pairs = [metrics.peak_speed, metrics.peak_error, metrics.peak_current];
    pairs.concat().into_iter().chain(metrics.peak_force.iter().copied()).collect()
}

/// The largest magnitudes in rows, in the same order.
fn largest_rows(case: &GantryCase, rows: &Trajectory) -> Vec<f64> {
    let get = |name: &str| rows.get(name).unwrap().to_vec();
    let [left, right, x, y] = ["left_angle", "right_angle", "bridge_position", "cart_position"].map(get);
    let places = left.iter().zip(&right).map(|(left, right)| case.gantry.place([*left, *right]));
    let errors: Vec<[f64; 2]> = places.zip(x.iter().zip(&y)).map(|([xd, yd], (x, y))| [xd - x, yd - y]).collect();
    let mut columns = vec![get("bridge_speed"), get("cart_speed")];
    columns.extend([0, 1].map(|k| errors.iter().map(|error| error[k]).collect()));
    columns.extend([get("left_current"), get("right_current")]);
    columns.extend(case.gantry.routing.spans().iter().map(|span| get(&format!("{}_force", span.key))));
    columns.iter().map(|column| column.iter().fold(0.0, |most: f64, v| most.max(v.abs()))).collect()
}

#[test]
fn peaks_are_of_the_motion_and_not_of_its_rows() {
    let file = cases();
    for told in file["cases"].as_array().unwrap().iter().take(24) {
        let name = told["name"].as_str().unwrap();
        let case = GantryCase::from_text_with("gantry.toml", told["case"].as_str().unwrap(), &[]).unwrap();
        let (fine, rows) = metered(&case, Solver::Exact, 2e-5);
        let (coarse, _) = metered(&case, Solver::Exact, 0.05);
        let (general, _) = metered(&case, Solver::General { tolerance: 1e-11 }, 0.05);
        for (k, row) in largest_rows(&case, &rows).into_iter().enumerate() {
            let [fine, coarse, general] = [&fine, &coarse, &general].map(|metrics| peaks(metrics)[k].value.abs());
            let near = |a: f64, b: f64, share: f64| (a - b).abs() <= share * a.max(b) + 1e-12;
            assert!(fine >= row - 1e-12 && near(fine, row, 1e-2), "{name}: peak {k} is {fine}, of rows {row}");
            assert!(near(fine, coarse, 1e-9), "{name}: peak {k}: {fine} and {coarse}");
            assert!(near(fine, general, 1e-6), "{name}: peak {k}: {fine} and {general}");
        }
        assert_eq!((fine.stop_time.is_some(), fine.events), (coarse.stop_time.is_some(), coarse.events), "{name}");
        let [x, y] = ["bridge_position", "cart_position"].map(|name| *rows.get(name).unwrap().last().unwrap());
        assert_eq!(fine.final_position, [x, y], "{name}");
    }
}

#[test]
fn a_rotor_behind_a_gear_with_play_keeps_a_gantry_from_resting() {
    let case = |play: &[&str]| {
        let text = std::fs::read_to_string("stages/core-xy/core-xy.toml").unwrap();
        GantryCase::from_text_with("core-xy.toml", &text, play).unwrap()
    };
    let (stiff, _) = metered(&case(&[]), Solver::Exact, 1e-3);
    assert!(stiff.settled && stiff.stop_time.unwrap() < 0.4, "{:?}", stiff.stop_time);
    let play = ["motor.rotor_inertia=1e-5 kg m^2", "motor.gear_stiffness=300 N m/rad", "motor.backlash=0.5 deg"];
    let (loose, _) = metered(&case(&play), Solver::Exact, 1e-3);
    assert!(loose.bodies_rest && loose.stop_time.is_none_or(|time| time > stiff.stop_time.unwrap()));
}

#[test]
fn the_error_of_the_general_solver_is_estimated() {
    let text = std::fs::read_to_string("stages/h-frame/follows.toml").unwrap();
    let case = GantryCase::from_text_with("follows.toml", &text, &[]).unwrap();
    let mechanism = case.gantry.mechanism();
    assert_eq!(Solver::of_mechanism(&mechanism), Solver::GENERAL);
    let course = Course::of(&case.experiments[0]);
    let go = |tolerance: f64, sink: &mut dyn FnMut(&Trajectory) -> Flow| {
        stream_mechanism(&mechanism, &course, Solver::General { tolerance }, (Detail::Full, None), sink).unwrap()
    };
    let mut fine = Trajectory::default();
    go(1e-12, &mut |block| {
        fine.append(block);
        Flow::Continue
    });
    let (mut estimate, mut rows) = (ErrorEstimate::of_mechanism(&mechanism, &course), Trajectory::default());
    let outcome = go(1e-7, &mut |block| {
        estimate.take(block);
        rows.append(block);
        Flow::Continue
    });
    let error =
        estimate.finish_mechanism(&mechanism, &course, 1e-7, &outcome, &mut || Flow::Continue).unwrap().unwrap();
    let r = case.gantry.pulley_radius;
    let mut off: f64 = 0.0;
    for (column, lever) in [("left_angle", r), ("right_angle", r), ("bridge_position", 1.0), ("cart_position", 1.0)] {
        for (a, b) in rows.get(column).unwrap().iter().zip(fine.get(column).unwrap()) {
            off = off.max(lever * (a - b).abs());
        }
    }
    assert!(off <= error.value && error.value < 1e3 * off && error.way > 0.05, "{off} m, estimated {error:?}");
}
