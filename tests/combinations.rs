//! Parts that go together: a gear with play and losses, spans that follow the cart with pretension and in reduced
//! belts.

use crate::common;
use taut::case::Case;
use taut::solve::{Ending, Solution, Solver, simulate};

const AXIS: &str = r#"
[motor]
torque_constant = 0.05
back_emf_constant = 0.05
resistance = 1
rotor_inertia = 2e-6
gear_ratio = 5
[drive_pulley]
radius = 0.02
inertia = 6e-5
friction = { coulomb = 0.01 }
[idler_pulley]
inertia = 6e-5
friction = { coulomb = 0.01 }
[cart]
mass = 0.8
friction = { viscous = 4, coulomb = 0.5 }
[travel]
min = "-0.3 m"
max = "0.3 m"
[belt]
modulus = "8 GPa"
section = "5 mm^2"
spans = [0.4, 0.45, 0.85]
damping = [5, 5, 3]
[[experiment]]
name = "there"
input = { square = 6, frequency = 4 }
until = 0.5
every = 1e-3
"#;

fn run(changes: &[&str]) -> (Case, Solution) {
    let case = Case::from_text_with("axis.toml", AXIS, changes).unwrap();
    let solution = simulate(&case.machine, &case.experiments[0], Solver::for_machine(&case.machine)).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Complete, "{changes:?}");
    (case, solution)
}

fn apart(a: &Solution, b: &Solution, column: &str) -> f64 {
    let pairs = a.trajectory.get(column).unwrap().iter().zip(b.trajectory.get(column).unwrap());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The stiffer a gear that loses power, the nearer it is to one that is stiff and loses as much.
#[test]
fn a_stiff_limit_of_a_gear_with_losses() {
    let stiff = run(&["motor.gear_efficiency=0.7"]).1;
    let without = run(&[]).1;
    assert!(apart(&stiff, &without, "cart_position") > 1e-3);
    let soft = ["3e2", "3e3", "3e4"].map(|stiffness| {
        let gear = format!("motor.gear_stiffness={stiffness}");
        let damping = "motor.gear_damping=0.3";
        apart(&stiff, &run(&["motor.gear_efficiency=0.7", &gear, damping]).1, "cart_position")
    });
    assert!(soft[0] < 2e-3 && soft[1] < 0.3 * soft[0] && soft[2] < 0.3 * soft[1], "{soft:?}");
}

/// Backlash and an efficiency: the exact solver and the general one agree, and the motor needs more current than
/// without losses.
#[test]
fn play_and_losses_by_both_solvers() {
    let changes =
        ["motor.gear_efficiency=0.6", "motor.gear_stiffness=300", "motor.backlash=0.01", "motor.gear_damping=0.05"];
    let (case, exact) = run(&changes);
    assert!(exact.trajectory.get("gear_state").unwrap().contains(&-1.0));
    let general = simulate(&case.machine, &case.experiments[0], Solver::General { tolerance: 1e-11 }).unwrap();
    let off = apart(&exact, &general, "cart_position");
    assert!(off < 1e-8, "{off:e}");
    assert_eq!(exact.outcome.events.len(), general.outcome.events.len());
}

/// With more pretension than is ever used up, spans that follow the cart are what they are without; with less they go
/// slack, and a slack span carries nothing.
#[test]
fn pretension_of_spans_that_follow_the_cart() {
    let free = run(&["belt.follows_cart=true"]).1;
    let taut = run(&["belt.follows_cart=true", "belt.pretension=500"]).1;
    assert!(apart(&free, &taut, "cart_position") < 1e-9);
    let loose = run(&["belt.follows_cart=true", "belt.pretension=4", "cart.mass=3"]).1;
    let (force, slack) = (loose.trajectory.get("span1_force").unwrap(), loose.trajectory.get("span1_slack").unwrap());
    assert!(slack.contains(&1.0));
    for (force, slack) in force.iter().zip(slack) {
        assert!(*force >= -4.0 - 1e-9 && (*slack == 0.0 || *force == -4.0), "{force} {slack}");
    }
}

/// Spans 2 and 3 in series that follow the cart, against a plain integration of both inertias.
#[test]
fn a_two_mass_belt_that_follows_the_cart() {
    let smooth = [
        "belt.follows_cart=true",
        "belt.model=two-mass",
        "drive_pulley.friction={ viscous = 1e-3 }",
        "idler_pulley.friction={ viscous = 1e-3 }",
        "cart.friction={ viscous = 4 }",
        "belt.damping=[0, 0, 0]",
        "experiment.there.input={ step = 6 }",
        "experiment.there.until=0.2",
    ];
    let (case, solution) = run(&smooth);
    let (machine, motor) = (&case.machine, &case.machine.drives[0].motor);
    let (r, n, ea) = (machine.pulley_radius, motor.gear_ratio, 8e9 * 5e-6);
    let inertia = machine.drive_pulley.inertia + machine.idler_pulley.inertia + n * n * motor.rotor_inertia;
    let rate = |&[phi, omega, x, v]: &[f64; 4]| {
        // k₁ = E A/(l₁ − x); 2 and 3 in series are one span of l₂ + l₃ + x.
        let force = (ea / (0.4 - x) + ea / (0.45 + 0.85 + x)) * (r * phi - x);
        let torque = n * motor.torque_constant * (6.0 - motor.back_emf_constant * n * omega) / motor.resistance;
        [omega, (torque - 2e-3 * omega - r * force) / inertia, v, (force - 4.0 * v) / machine.cart.mass]
    };
    let (mut y, h) = ([0.0; 4], 1e-6);
    for _ in 0..200_000 {
        common::runge_kutta(&mut y, h, rate);
    }
    let last = |name: &str| *solution.trajectory.get(name).unwrap().last().unwrap();
    assert!((last("cart_position") - y[2]).abs() < 1e-9, "{} {}", last("cart_position"), y[2]);
    assert!((r * (last("drive_angle") - y[0])).abs() < 1e-9);
    // It is not what it is with the stiffness at x = 0.
    let fixed = run(&[&["belt.follows_cart=false"], &smooth[1..]].concat()).1;
    assert!(apart(&fixed, &solution, "cart_position") > 1e-7);
}

/// A belt that does not stretch does so at any length: the exact solver takes it.
#[test]
fn a_rigid_belt_follows_the_cart_too() {
    let (case, follows) = run(&["belt.follows_cart=true", "belt.model=rigid"]);
    assert_eq!(Solver::for_machine(&case.machine), Solver::Exact);
    assert_eq!(apart(&follows, &run(&["belt.model=rigid"]).1, "cart_position"), 0.0);
}
