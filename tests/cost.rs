//! The cost of runs, in pieces of work: a slip that leaves every result right may still make all runs slow.

use crate::common;
use common::experiment;
use taut::machine::{GearPlay, Machine};
use taut::signal::Signal;
use taut::solve::{Cost, Solver, simulate};

fn cost(machine: &Machine, solver: Solver) -> Cost {
    let input = Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 };
    simulate(machine, &experiment(input, 1.0), solver).unwrap().outcome.cost
}

/// No count is more than a quarter above what it was when this was written.
#[track_caller]
fn costs(machine: &Machine, solver: Solver, written: Cost) {
    let now = cost(machine, solver);
    let counts = |cost: &Cost| {
        let Cost { samples, pieces, modes, propagators, steps, looks, series, evaluations } = *cost;
        [samples, pieces, modes, propagators, steps, looks, series, evaluations]
    };
    let more = counts(&now).into_iter().zip(counts(&written)).any(|(now, written)| now > written + written / 4);
    assert!(!more, "{now:?} and not {written:?}");
}

/// A stage that slides all the time needs one look at its modes, and of the exact solver one propagation for each row.
#[test]
fn viscous_friction_alone_costs_a_product_for_each_row() {
    let zero = Cost { samples: 1001, pieces: 3, modes: 1, ..Cost::default() };
    costs(&common::table2(), Solver::Exact, Cost { propagators: 4, steps: 1000, ..zero });
    costs(&common::table2(), Solver::GENERAL, Cost { propagators: 1, steps: 500, evaluations: 500, ..zero });
}

/// Rows at rest cost nothing, and most intervals are decided by a single look.
#[test]
fn dry_friction_costs_a_look_now_and_then() {
    let zero = Cost { samples: 1001, pieces: 3, modes: 9, ..Cost::default() };
    costs(&common::table4(), Solver::Exact, Cost { propagators: 21, steps: 326, looks: 193, series: 40, ..zero });
    costs(
        &common::table4(),
        Solver::GENERAL,
        Cost { propagators: 19, steps: 160, looks: 113, evaluations: 160, ..zero },
    );
}

#[test]
fn limits_and_a_gear_with_play_cost_more() {
    let mut machine = common::table4();
    machine.drives[0].amplifier.voltage_limit = Some(3.0);
    machine.drives[0].motor.rotor_inertia = 1e-6;
    machine.drives[0].motor.gear_play = Some(GearPlay { backlash: 1e-2, stiffness: 50.0, damping: 0.01 });
    let zero = Cost { samples: 1001, pieces: 3, modes: 21, ..Cost::default() };
    costs(&machine, Solver::Exact, Cost { propagators: 46, steps: 1287, looks: 995, series: 118, ..zero });
    costs(&machine, Solver::GENERAL, Cost { propagators: 34, steps: 1272, looks: 193, evaluations: 1272, ..zero });
}
