//! Machines of every kind with any of their numbers set to anything, by the general solver: a result or an error, never
//! a panic, and an accuracy for every result.

use crate::common::chance::Chance;
use std::panic::{AssertUnwindSafe, catch_unwind};
use taut::case::{Case, TEMPLATE};
use taut::parameter::{Field, all, values};
use taut::solve::{Ending, ErrorEstimate, Flow, Outcome, Solver, stream};

const TOLERANCE: f64 = 1e-7;
const GENERAL: Solver = Solver::General { tolerance: TOLERANCE };

/// Calls of a receiver, one each 4096 steps at least, after which it has seen enough.
const CALLS: usize = 4;

/// The machines that ship, of every kind.
fn machines() -> Vec<(&'static str, String)> {
    let paths = [
        "stages/h-frame/h-frame.toml",
        "stages/h-frame/follows.toml",
        "stages/core-xy/core-xy.toml",
        "stages/core-xy/follows.toml",
        "stages/dual-belt/dual-belt.toml",
        "stages/dual-belt/follows.toml",
        "stages/sollmann-jouaneh/table4.toml",
        "stages/two-mass/two-mass.toml",
        "stages/printer-axis/printer-axis.toml",
        "stages/laser-gantry/laser-gantry.toml",
    ];
    let files = paths.map(|path| (path, std::fs::read_to_string(path).unwrap()));
    std::iter::once(("axis.toml", TEMPLATE.to_string())).chain(files).collect()
}

/// Runs the first experiment for a moment, with its accuracy; none where the machine or its run is refused.
fn run(opened: &Case) -> Option<(Outcome, f64)> {
    let (mut calls, mut more) = (0, 0);
    let mut flow = || {
        more += 1;
        if more > CALLS { Flow::Stop } else { Flow::Continue }
    };
    let mut enough = || {
        calls += 1;
        if calls > CALLS { Flow::Stop } else { Flow::Continue }
    };
    let mut experiment = opened.experiments[0].clone();
    experiment.until = experiment.until.min(0.02);
    experiment.every = experiment.until / 40.0;
    let mut estimate = ErrorEstimate::new(&opened.machine, &experiment);
    let outcome = stream(&opened.machine, &experiment, GENERAL, &mut |rows| {
        estimate.take(rows);
        enough()
    });
    let outcome = outcome.ok()?;
    let error = estimate.finish(&opened.machine, &experiment, TOLERANCE, &outcome, &mut flow).unwrap();
    Some((outcome, error.map_or(f64::INFINITY, |error| error.value)))
}

fn opened(name: &str, text: &str, changes: &[String]) -> Option<Case> {
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    Case::from_text_with(name, text, &changes).ok()
}

/// The second run has fewer columns than the first, and the rotor of a gantry's gear was not among them.
#[test]
fn a_gantry_with_a_compliant_gear_made_the_estimate_panic() {
    for (path, text) in machines() {
        for play in [&[][..], &["motor.backlash=0.3 deg"], &["motor.inductance=1 mH"]] {
            let gear = ["motor.rotor_inertia=1e-5", "motor.gear_stiffness=10"];
            let changes: Vec<String> = gear.iter().chain(play).map(|change| change.to_string()).collect();
            let Some(opened) = opened(path, &text, &changes) else { continue };
            let (outcome, error) = run(&opened).unwrap_or_else(|| panic!("{path} {changes:?} is refused"));
            let is_stated = error > 0.0 && error < 1e-3;
            assert!(
                outcome.ending == Ending::Complete && is_stated,
                "{path} {changes:?}: {:?}, {error:e} m",
                outcome.ending
            );
        }
    }
}

/// `TAUT_CASES` of them: up to four numbers, each up to eight hundred times or a hundredth of what it is.
#[test]
fn any_number_of_any_machine_may_be_set() {
    let count: u64 = std::env::var("TAUT_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(150);
    let sits = |row: &&taut::parameter::Parameter| !matches!(row.field, Field::Elsewhere) && !row.example.is_empty();
    let rows: Vec<_> = all().filter(sits).collect();
    let machines = machines();
    let (mut taken, mut ran) = (0, 0);
    for number in 0..count {
        let mut chance = Chance::new(number);
        let mut below = |n: usize| ((chance.uniform() * n as f64) as usize).min(n - 1);
        let (path, text) = &machines[below(machines.len())];
        let mut changes = Vec::new();
        if below(3) == 0 {
            changes.extend(["motor.rotor_inertia=2e-5", "motor.gear_stiffness=30"].map(String::from));
        }
        for _ in 0..=below(4) {
            let factor = 10.0_f64.powi(below(5) as i32 - 2) * (1.0 + below(8) as f64);
            if below(3) > 0 {
                // A number that the machine has.
                let own = opened(path, text, &[]).map(|case| values(&case.machine));
                let own = own.unwrap();
                let (key, value) = &own[below(own.len())];
                changes.push(format!("{key}={}", factor * value));
                continue;
            }
            let row = rows[below(rows.len())];
            // "17 N/mm" with another number before its unit.
            let value = row.example.split(' ').next().unwrap_or("1");
            let Ok(usual) = value.parse::<f64>() else { continue };
            let scaled = if row.range.whole { (usual * factor).ceil() } else { usual * factor };
            changes.push(format!("{}={scaled}{}", row.key, &row.example[value.len()..]));
        }
        let told = format!("{path} {changes:?}");
        let result = catch_unwind(AssertUnwindSafe(|| opened(path, text, &changes).map(|opened| run(&opened))));
        match result {
            Err(_) => panic!("it panics: {told}"),
            Ok(None) => {}
            Ok(Some(result)) => {
                taken += 1;
                ran += u64::from(result.is_some());
                let is_stated = result.is_none_or(|(_, error)| error > 0.0);
                assert!(is_stated, "no accuracy: {told}");
            }
        }
    }
    println!("{taken} of {count} are machines, {ran} ran");
    assert!(4 * taken > count && 2 * ran > taken, "{taken} of {count} are machines, {ran} ran");
}
