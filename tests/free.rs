//! Everything of a machine can be free: what friction laws, belts, gears and limits are made of is found from logs of
//! simulated machines.

use crate::common::chance::Chance;
use crate::common::logged::logged;
use taut::case::{Case, Plan, TEMPLATE};
use taut::fit::fit;
use taut::solve::{Flow, Solver, simulate};

/// The template with these changes, and a log of the second experiment of the machine whose `key` has this value.
fn made(own: &[&str], key: &str, truth: f64, noise: f64) -> Case {
    let mut case = Case::from_text_with("axis.toml", TEMPLATE, own).unwrap_or_else(|error| panic!("{key}: {error}"));
    let change = format!("{key}={truth}");
    let real = Case::from_text_with("axis.toml", TEMPLATE, &[own, &[&change]].concat()).unwrap();
    let mut chance = Chance::new(7);
    case.experiments.remove(0);
    let experiment = &real.experiments[1];
    let run = simulate(&real.machine, experiment, Solver::for_machine(&real.machine)).unwrap().trajectory;
    let angle = run.get("drive_angle").unwrap();
    let values = angle.iter().map(|v| v + noise * chance.normal()).collect();
    let name = case.experiments[0].name.clone();
    let mut log = (*logged(&name, &run, values)).clone();
    // What was meant, and not what came out of the amplifier.
    log.inputs[0] = log.time.iter().map(|&t| experiment.inputs[0].value(t)).collect();
    case.experiments[0].log = Some(std::sync::Arc::new(log));
    case
}

/// Each from a start that is a third off: within 5 %, or within what the fit says that it may be off.
#[test]
fn everything_can_be_free() {
    let slow = [
        "experiment.1.input={ sine = \"12 V\", frequency = \"2 Hz\" }",
        "experiment.1.until=1 s",
        "experiment.1.every=2 ms",
    ];
    let stribeck = ["cart.friction={ viscous = 10, coulomb = 2, stribeck = { force = 3, velocity = 0.05 } }"];
    let smooth = ["cart.friction={ viscous = 10, coulomb = 2, static = 3, smooth = { breakaway_velocity = 0.02 } }"];
    let lugre = [
        "cart.friction={ viscous = 10, coulomb = 2, static = 3, lugre = { stiffness = 20000, damping = 50, velocity = 0.05 } }",
    ];
    let along = ["cart.friction={ viscous = 10, coulomb = 2, along = [[-0.05, 1], [0, 1.5], [0.05, 1]] }"];
    let soft = ["belt={ modulus = 2e7, section = 1.5e-5, spans = [0.1, 0.3, 0.4] }"];
    let damped = ["belt={ stiffness = [3000, 3000, 2000], damping = [3, 3, 3] }"];
    let play =
        ["motor.gear_stiffness=20", "motor.gear_damping=0.02", "motor.rotor_inertia=5e-5", "motor.backlash=0.05"];
    let limit = ["amplifier.voltage_limit=8"];
    let current = ["amplifier.current_limit=9"];
    let cases: [(&[&str], &str, f64); 11] = [
        (&stribeck, "cart.friction.stribeck.velocity", 0.07),
        (&stribeck, "cart.friction.stribeck.force", 4.0),
        (&smooth, "cart.friction.smooth.breakaway_velocity", 0.03),
        (&lugre, "cart.friction.lugre.stiffness", 30000.0),
        (&lugre, "cart.friction.lugre.velocity", 0.07),
        (&along, "cart.friction.along.1.factor", 2.0),
        (&soft, "belt.modulus", 3e7),
        (&damped, "belt.damping", 4.0),
        (&play, "motor.backlash", 0.07),
        (&limit, "amplifier.voltage_limit", 6.0),
        (&current, "amplifier.current_limit", 7.0),
    ];
    let mut wrong: Vec<String> = Vec::new();
    for (own, key, truth) in cases {
        let own = [&slow[..], own].concat();
        let made = made(&own, if key == "belt.damping" { "belt.damping.0" } else { key }, truth, 1e-4);
        let key = if key == "belt.damping" { "belt.damping.0" } else { key };
        let plan = Plan { free: vec![key.into()], ..Plan::default() };
        let found = fit(&made, &plan, None, &mut |_| Flow::Continue).unwrap_or_else(|error| panic!("{key}: {error}"));
        let estimate = &found.estimates[0];
        let off = (estimate.value / truth - 1.0).abs();
        let within =
            estimate.error.is_some_and(|error| (estimate.value - truth).abs() < 4.0 * error && error < 0.3 * truth);
        if off >= 0.05 && !within {
            wrong.push(format!("{key}: {} for {truth}, ± {:?}, {:?}", estimate.value, estimate.error, found.ending));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
