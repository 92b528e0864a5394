//! Against an independent authority, which solved each case with two methods that share no code with ours; its raw
//! output is kept: 200 random stages and inputs (`authorities/random_stages.py`), and the paper's machine under waves
//! with many stick-slip transitions and steps beside each breakaway (`authorities/family.py`).
//!
//! Positions within 1e-9 m and rad, speeds within 1e-7 m/s and 1e-5 rad/s, event times within 1e-9 s, or four times the
//! authority's own uncertainty where that is more; the same modes in the same order.

use crate::common;
use serde_json::Value;
use taut::case::Experiment;
use taut::friction::{Friction, Side};
use taut::machine::{Amplifier, AmplifierMode, Belt, DriveUnit, Machine, MachineKind, Motor, Pulley, Slide};
use taut::signal::Signal;
use taut::solve::{Ending, Solver, simulate};

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {value}"))
}

fn friction(value: &Value) -> Friction {
    let side = |direction: &str| Side {
        viscous: number(value, &format!("viscous_{direction}")),
        coulomb: number(value, &format!("coulomb_{direction}")),
        breakaway: number(value, &format!("breakaway_{direction}")),
    };
    Friction::sided(side("forward"), side("backward"))
}

fn machine(value: &Value) -> Machine {
    let get = |key| number(value, key);
    let pulley = |inertia, law| Pulley { inertia: get(inertia), friction: friction(&value[law]) };
    Machine {
        kind: MachineKind::Axis,
        drives: vec![DriveUnit {
            motor: Motor {
                torque_constant: get("torque_constant"),
                back_emf_constant: get("back_emf_constant"),
                resistance: get("resistance"),
                inductance: get("inductance"),
                rotor_inertia: get("rotor_inertia"),
                gear_ratio: get("gear_ratio"),
                gear_efficiency: get("gear_efficiency"),
                gear_play: None,
                is_simple: false,
                stepper: None,
            },
            amplifier: Amplifier::ideal(
                match value["amplifier_mode"].as_str() {
                    Some("voltage") => AmplifierMode::Voltage,
                    Some("current") => AmplifierMode::Current,
                    other => panic!("amplifier mode {other:?}"),
                },
                get("amplifier_gain"),
            ),
        }],
        bridge: None,
        yaw: None,
        pulley_radius: get("pulley_radius"),
        drive_pulley: pulley("drive_inertia", "drive_friction"),
        cart: Slide::new(get("cart_mass"), friction(&value["cart_friction"])),
        idler_pulley: pulley("idler_inertia", "idler_friction"),
        belt: Belt::given(["k1", "k2", "k3"].map(get), ["c1", "c2", "c3"].map(get)),
        encoder: None,
        scale: None,
    }
}

fn input(value: &Value) -> Signal {
    let get = |key| number(value, key);
    match value["kind"].as_str().unwrap() {
        "step" => Signal::Step { value: get("value"), at: get("at") },
        "pulse" => Signal::Pulse { value: get("value"), duration: get("duration"), at: get("at") },
        "ramp" => Signal::Ramp { value: get("value"), over: get("over"), at: get("at") },
        "triangle" => Signal::Triangle { amplitude: get("amplitude"), frequency: get("frequency") },
        "square" => Signal::Square { amplitude: get("amplitude"), frequency: get("frequency"), duty: get("duty") },
        "sine" => Signal::Sine {
            amplitude: get("amplitude"),
            frequency: get("frequency"),
            phase: get("phase"),
            offset: get("offset"),
        },
        "chirp" => Signal::Chirp { amplitude: get("amplitude"), from: get("from"), to: get("to"), over: get("over") },
        "prbs" => Signal::Prbs { amplitude: get("amplitude"), bit: get("bit"), seed: value["seed"].as_u64().unwrap() },
        "table" => Signal::Table {
            points: value["points"]
                .as_array()
                .unwrap()
                .iter()
                .map(|point| [point[0].as_f64().unwrap(), point[1].as_f64().unwrap()])
                .collect(),
        },
        other => panic!("input {other:?}"),
    }
}

#[test]
fn two_hundred_random_stages() {
    assert_eq!(compare(include_str!("authorities/random_stages.json")), 200);
}

#[test]
fn the_family_of_the_papers_machine() {
    assert!(compare(include_str!("authorities/family.json")) >= 35);
}

/// Compares every case of the file; the number of them.
fn compare(text: &str) -> usize {
    let file: Value = serde_json::from_str(text).unwrap();
    let cases = file["cases"].as_array().unwrap();
    let (mut worst, mut events, mut faults) = ([0.0_f64; 5], 0, Vec::new());
    for case in cases {
        let name = case["name"].as_str().unwrap();
        let until = number(case, "until");
        let experiment =
            Experiment { every: number(case, "every"), ..common::experiment(input(&case["input"]), until) };
        let solution = simulate(&machine(&case["stage"]), &experiment, Solver::Exact).unwrap();
        if solution.outcome.ending != Ending::Complete {
            faults.push(format!("{name}: ended with {:?}", solution.outcome.ending));
            continue;
        }
        let doubt =
            |key: &str| 4.0 * number(&case["rounding_differs_by"], key).max(number(&case["scipy_differs_by"], key));
        // Where, which column of the authority, the tolerance
        let columns = [
            ("drive_angle", 0, 1e-9_f64.max(doubt("angle_rad"))),
            ("cart_position", 2, 1e-9_f64.max(doubt("position_m"))),
            ("idler_angle", 4, 1e-9_f64.max(doubt("angle_rad"))),
            ("drive_speed", 1, 1e-5_f64.max(doubt("speed_rad_s"))),
            ("cart_speed", 3, 1e-7_f64.max(doubt("speed_m_s"))),
            ("idler_speed", 5, 1e-5_f64.max(doubt("speed_rad_s"))),
        ];
        for (k, time) in case["times"].as_array().unwrap().iter().enumerate() {
            let row = (time.as_f64().unwrap() / experiment.every).round() as usize;
            for (column, place, tolerance) in columns {
                let got = solution.trajectory.get(column).unwrap()[row];
                let want = case["states"][k][place].as_f64().unwrap();
                let difference = (got - want).abs();
                let kind = match place {
                    2 => 0,
                    0 | 4 => 1,
                    3 => 2,
                    _ => 3,
                };
                worst[kind] = worst[kind].max(difference);
                if difference > tolerance {
                    faults.push(format!("{name}: {column} at row {row} is {got:e} instead of {want:e}"));
                }
            }
            for (body, column) in ["drive_state", "cart_state", "idler_state"].iter().enumerate() {
                let got = solution.trajectory.get(column).unwrap()[row];
                if got != case["modes"][k][body].as_f64().unwrap() {
                    faults.push(format!("{name}: {column} at row {row} is {got}"));
                }
            }
        }
        let got: Vec<_> = solution
            .outcome
            .events
            .iter()
            .map(|e| (e.body().unwrap() as i64 + 1, i64::from(e.from.code()), i64::from(e.to.code())))
            .collect();
        let theirs = case["events"].as_array().unwrap();
        let want: Vec<_> =
            theirs.iter().map(|e| (e[1].as_i64().unwrap(), e[2].as_i64().unwrap(), e[3].as_i64().unwrap())).collect();
        events += want.len();
        if got != want {
            let at = got.iter().zip(&want).position(|(a, b)| a != b);
            let show = at.map(|i| (solution.outcome.events[i], theirs[i].to_string()));
            faults.push(format!("{name}: {} events instead of {}, first different: {show:?}", got.len(), want.len()));
            continue;
        }
        for (got, want) in solution.outcome.events.iter().zip(theirs) {
            let difference = (got.time - want[0].as_f64().unwrap()).abs();
            worst[4] = worst[4].max(difference);
            if difference > 1e-9_f64.max(doubt("event_s")) {
                faults.push(format!("{name}: {got:?} instead of {want}"));
            }
            let load = want[4].as_f64().unwrap();
            if (got.load - load).abs() > 1e-6 * (1.0 + load.abs()) {
                faults.push(format!("{name}: {got:?} instead of {want}"));
            }
        }
    }
    println!(
        "{} cases, {events} events; worst differences: {:.1e} m, {:.1e} rad, {:.1e} m/s, {:.1e} rad/s, {:.1e} s",
        cases.len(),
        worst[0],
        worst[1],
        worst[2],
        worst[3],
        worst[4]
    );
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(20)].join("\n"));
    cases.len()
}
