//! The general solver: against the exact one where both apply, and against laws that hold for any friction.

mod common;

use common::random::{self, Dry};
use proptest::prelude::*;
use taut::case::{Experiment, Initial};
use taut::friction::{Friction, Law, Shape};
use taut::signal::Signal;
use taut::solve::{Ending, Solution, Solver, simulate};
use taut::stage::Stage;

fn experiment(input: &Signal, until: f64, every: f64) -> Experiment {
    Experiment { name: "general".into(), input: input.clone(), until, every, initial: Initial::default() }
}

fn run(stage: &Stage, experiment: &Experiment, solver: Solver) -> Solution {
    let solution = simulate(stage, experiment, solver).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

/// The largest difference at the belt, m.
fn apart(stage: &Stage, a: &Solution, b: &Solution) -> f64 {
    let arms = [("drive_angle", stage.pulley_radius), ("cart_position", 1.0), ("idler_angle", stage.pulley_radius)];
    let mut worst: f64 = 0.0;
    for (name, arm) in arms {
        let (a, b) = (a.trajectory.get(name).unwrap(), b.trajectory.get(name).unwrap());
        assert_eq!(a.len(), b.len());
        worst = a.iter().zip(b).map(|(a, b)| arm * (a - b).abs()).fold(worst, f64::max);
    }
    worst
}

#[test]
fn the_papers_machine_as_the_exact_solver_has_it() {
    let stage = common::table4();
    for (volts, until) in [(5.0, 1.0), (10.0, 1.0)] {
        let experiment = experiment(&Signal::Pulse { value: volts, duration: 0.25, at: 0.0 }, until, 1e-3);
        let exact = run(&stage, &experiment, Solver::Exact);
        for (tolerance, allowed, moment) in [(1e-6, 1e-8, 1e-4), (1e-9, 1e-11, 1e-8), (1e-12, 1e-13, 1e-10)] {
            let general = run(&stage, &experiment, Solver::General { tolerance });
            let difference = apart(&stage, &exact, &general);
            println!("{volts} V, {tolerance:e}: {difference:.1e} m, {:?}", general.outcome.cost);
            assert!(difference < allowed, "{volts} V, {tolerance:e}: {difference:e}");
            assert_eq!(general.outcome.events.len(), exact.outcome.events.len(), "{volts} V, {tolerance:e}");
            for (a, b) in general.outcome.events.iter().zip(&exact.outcome.events) {
                assert!(a.body == b.body && a.to == b.to && (a.time - b.time).abs() < moment, "{a:?} and {b:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Where both solvers apply they agree.
    #[test]
    fn general_is_exact(stage in random::stage(Dry::Any), input in random::input()) {
        let experiment = experiment(&input, 0.3, 1e-3);
        let (a, b) = (run(&stage, &experiment, Solver::Exact), run(&stage, &experiment, Solver::General { tolerance: 1e-11 }));
        let difference = apart(&stage, &a, &b);
        prop_assert!(difference < 1e-9, "{difference:e} m");
    }
}
