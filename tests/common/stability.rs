//! Nyquist's criterion beside the loop run in time.

use taut::case::Case;
use taut::control::feedback::Feedback;
use taut::control::{Setup, closed_loop};
use taut::linear::Operation;
use taut::solve::{Ending, Solver};
use taut::tune::{Margins, Plant};

/// The changes that leave viscous friction alone, counts that are nothing, and a command without a limit.
pub const LINEAR: [&str; 5] = [
    "cart.friction={ viscous = \"19 N s/m\", coulomb = 0 }",
    "drive_pulley.friction={ viscous = \"1.6e-3 N m s\", coulomb = 0 }",
    "idler_pulley.friction={ viscous = \"1.6e-3 N m s\", coulomb = 0 }",
    "encoder.lines=1e9",
    "controller.limit=1e12",
];

/// Compares both for a linear case whose axis takes the command for more and more, of which the controller knows
/// nothing: at every `every`th of 28 gains, on either side of the limit.
pub fn is_that_of_runs(name: &str, case: &Case, every: usize) {
    let design = case.controller.as_ref().unwrap();
    let louder = |step: usize| {
        let mut machine = case.machine.clone();
        machine.drives[0].amplifier.gain *= 1.2f64.powi(step as i32 - 12);
        machine
    };
    let feedback = Feedback::new(design, &case.machine).unwrap();
    let told = |step: usize| {
        let plant = Plant::new(&louder(step), Operation::default(), design, &feedback.corners()).unwrap();
        Margins::new(&plant, &feedback).stable
    };
    let told: Vec<bool> = (0..30).map(told).collect();
    let mut both = [0, 0];
    // At the limit itself it grows and dies out too slowly to be seen.
    for step in (1..29).step_by(every).filter(|&step| told[step - 1] == told[step + 1]) {
        let run = closed_loop(&Setup {
            model: &case.machine,
            window: 1e-3,
            solver: Solver::Exact,
            ..Setup::new(&louder(step), design, &case.moves[0].profiles, 12.0)
        })
        .unwrap();
        let calm = run.outcome.ending == Ending::Complete && run.figures.settling.is_some_and(|s| s < 9.0);
        assert_eq!(told[step], calm, "{name} at step {step}: {:?} {told:?}", run.figures.cart().error);
        both[usize::from(calm)] += 1;
    }
    println!("{name}: {} unstable, {} stable", both[0], both[1]);
    assert!(both[1] > 0 && both[0] > 0, "{name}: {both:?}");
}
