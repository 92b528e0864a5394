//! Machines side by side against the exact solver, one by one: the same events, positions to 1e-12 m, peaks to 1e-9.

use super::{bits, rows};
use taut::case::Case;
use taut::sweep::{Status, Sweep};
use taut::trajectory::Trajectory;

const TABLE4: &str = include_str!("../../stages/sollmann-jouaneh/table4.toml");
const H_FRAME: &str = include_str!("../../stages/h-frame/h-frame.toml");
const CORE_XY: &str = include_str!("../../stages/core-xy/core-xy.toml");
const DUAL_BELT: &str = include_str!("../../stages/dual-belt/dual-belt.toml");

/// Case, runs, and what is changed: every element that runs in lanes, by itself and with others.
#[rustfmt::skip]
const MACHINES: &[(&str, usize, &[&str])] = &[
    (TABLE4, 60, &["sweep.vary.all=20 %"]),
    (TABLE4, 40, &["sweep.vary.all=60 %"]),
    (TABLE4, 12, &["sweep.vary.all=20 %", "belt.stiffness=[1.3e6, 1.3e6, 6e5]"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "cart.friction.static=0.5 N", "drive_pulley.friction.static=0.03 N m"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "belt.damping=[30, 30, 20]"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "motor.inductance=0.5 mH"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "amplifier.voltage_limit=6 V"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "amplifier.current_limit=4 A"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "motor.inductance=0.5 mH", "amplifier.current_limit=4 A"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "cart.friction.viscous_backward=30 N s/m", "cart.friction.coulomb_backward=0.4 N"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "experiment.0.input={ ramp = \"6 V\", over = \"0.2 s\" }", "experiment.1.input={ triangle = \"5 V\", frequency = \"3 Hz\" }"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "travel={ min = \"-1 mm\", max = \"60 mm\" }"]),
    (TABLE4, 12, &["sweep.vary.all=20 %", "belt.model=\"two-mass\""]),
    (TABLE4, 12, &["sweep.vary.\"cart.mass\"=20 %", "belt.model=\"rigid\""]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "travel={ min = \"-1 mm\", max = \"60 mm\", stop_stiffness = \"40 kN/m\", stop_damping = \"20 N s/m\" }"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "belt.pretension=3 N"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "motor.gear_efficiency=0.8"]),
    (TABLE4, 12, &["sweep.vary.all=20 %", "motor.gear_efficiency=0.8", "motor.inductance=0.5 mH", "amplifier.voltage_limit=6 V", "belt.pretension=3 N"]),
    (CORE_XY, 8, &["sweep.vary.\"cart.mass\"=20 %", "motor.gear_efficiency=0.8"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "cart.force_along=[[\"-0.1 m\", \"0.2 N\"], [\"0.02 m\", \"1.5 N\"], [\"0.06 m\", \"-0.5 N\"]]"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "cart.force_by_speed=[[\"-0.5 m/s\", \"2 N\"], [\"0 m/s\", \"0 N\"], [\"0.1 m/s\", \"-1 N\"]]"]),
    (TABLE4, 24, &["sweep.vary.all=20 %", "belt.pretension=3 N", "motor.inductance=0.5 mH", "amplifier.current_limit=4 A", "travel={ min = \"-1 mm\", max = \"60 mm\", stop_stiffness = \"40 kN/m\" }"]),
    (TABLE4, 12, &["sweep.vary.all=20 %", "belt.model=\"two-mass\"", "belt.pretension=3 N", "travel={ min = \"-1 mm\", max = \"60 mm\", stop_stiffness = \"40 kN/m\" }"]),
    // Inputs that change at the end of a run.
    (TABLE4, 24, &["sweep.vary.all=20 %", "experiment.0.until=0.5 s", "experiment.0.input={ sum = [{ pulse = \"5 V\", for = \"0.1 s\" }, { step = \"12 V\", at = \"0.5 s\" }] }"]),
    (DUAL_BELT, 8, &["sweep.vary.\"cart.mass\"=20 %", "experiment.0.until=0.3 s", "experiment.0.input={ left = { square = \"5 V\", frequency = \"5 Hz\" }, cart = { square = \"3 V\", frequency = \"10 Hz\" } }"]),
    (H_FRAME, 8, &["sweep.vary.\"cart.mass\"=20 %", "sweep.vary.\"belt.stiffness\"=20 %"]),
    (CORE_XY, 8, &["sweep.vary.\"cart.mass\"=20 %", "sweep.vary.\"motor.resistance\"=20 %"]),
    (H_FRAME, 8, &["sweep.vary.\"cart.mass\"=20 %", "belt.pretension=4 N", "bridge.travel={ min = \"-20 mm\", max = \"20 mm\", stop_stiffness = \"20 kN/m\" }"]),
    (CORE_XY, 8, &["sweep.vary.\"cart.mass\"=20 %", "belt.pretension=4 N", "cart.travel={ min = \"-20 mm\", max = \"20 mm\", stop_stiffness = \"20 kN/m\", stop_damping = \"30 N s/m\" }"]),
    (DUAL_BELT, 8, &["sweep.vary.\"cart.mass\"=20 %", "belt.pretension=4 N", "bridge.travel={ min = \"-20 mm\", max = \"20 mm\", stop_stiffness = \"20 kN/m\" }"]),
    (DUAL_BELT, 8, &["sweep.vary.\"cart.mass\"=20 %", "sweep.vary.\"motor.resistance\"=20 %"]),
];

fn sweep(text: &str, runs: usize, changes: &[&str], solver: &str) -> Sweep {
    let plan = [format!("sweep.runs={runs}"), format!("sweep.solver={solver}")];
    let changes: Vec<&str> = plan.iter().map(String::as_str).chain(changes.iter().copied()).collect();
    let case = Case::from_text_with("machine.toml", text, &changes).unwrap_or_else(|error| panic!("{error}"));
    Sweep::new(&case).unwrap_or_else(|error| panic!("{error}"))
}

/// By how much a figure of lanes may be off that of the exact solver.
fn near(name: &str, value: f64) -> f64 {
    match name.split_once('.').map_or(name, |(_, figure)| figure) {
        // The time of a flat top is known to the root of the accuracy of its height.
        name if name.starts_with("peak") && name.ends_with("_time") => 1e-5,
        name if name.starts_with("peak") => 1e-9 * value.abs() + 1e-13,
        name if name.ends_with("angle") => 1e-10,
        name if name.starts_with("final") && name.ends_with("speed") => 1e-10,
        name if name.starts_with("final") => 1e-12,
        "stop_time" => 1e-10,
        "steady_speed" => 1e-9 * value.abs(),
        // Counts of events, statuses, flags
        _ => 0.0,
    }
}

#[test]
fn rows_are_those_of_the_exact_solver() {
    let (mut compared, mut off) = (0, Vec::new());
    for &(text, runs, changes) in MACHINES {
        let both = ["lanes", "exact"].map(|solver| rows(&sweep(text, runs, changes, solver), 0, runs));
        let [lanes, exact] = &both;
        assert_ne!(bits(lanes), bits(exact), "{changes:?} is left to the exact solver");
        let complete = |column: &&taut::trajectory::Column| column.name.ends_with(".status");
        let statuses = exact.columns.iter().filter(complete).flat_map(|column| &column.values);
        assert!(statuses.filter(|code| **code == Status::Complete.code()).count() > 4, "{changes:?}");
        for (column, other) in lanes.columns.iter().zip(&exact.columns) {
            for (run, (own, other)) in column.values.iter().zip(&other.values).enumerate() {
                let same = own.to_bits() == other.to_bits() || (own - other).abs() <= near(&column.name, *other);
                if !same {
                    off.push(format!("{changes:?} {} of run {run}: {own:e}, {other:e}", column.name));
                }
                compared += 1;
            }
        }
    }
    assert!(off.is_empty(), "{} of {compared}:\n{}", off.len(), off.join("\n"));
    assert!(compared > 10_000, "{compared}");
}

/// The bits of a row depend neither on neighbours, nor on the order of the queue.
#[test]
fn rows_do_not_depend_on_their_neighbours() {
    for &(text, runs, changes) in MACHINES {
        let sweep = sweep(text, runs, changes, "lanes");
        let whole = rows(&sweep, 0, runs.min(12));
        let mut pieces = Trajectory::default();
        for (first, count) in [(0, 1), (1, 4), (5, runs.min(12) - 5)] {
            pieces.append(&rows(&sweep, first, count));
        }
        assert_eq!(bits(&whole), bits(&pieces), "{changes:?}");
    }
}

/// Nothing of a sweep that is stopped is handed on.
#[test]
fn a_stopped_sweep_has_no_rows() {
    let sweep = sweep(TABLE4, 40, &["sweep.vary.all=20 %"], "lanes");
    let asked = std::cell::Cell::new(0);
    let stop = || {
        asked.set(asked.get() + 1);
        asked.get() > 20
    };
    assert!(sweep.rows(0, 40, &stop).is_none());
}
