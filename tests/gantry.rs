//! Gantries against independent solvers (`authorities/gantry.py`), and laws that hold for any of them.

use crate::common;
use serde_json::Value;
use taut::case::Case;
use taut::linear::{Analysis, Natural, Question, Root};
use taut::machine::MachineKind;
use taut::metrics::{Meter, Metrics, Peak};
use taut::solve::{Course, Detail, ErrorEstimate, Event, Flow, Solver, stream_mechanism};
use taut::trajectory::Trajectory;

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
        let case = Case::from_text_with("gantry.toml", told_case["case"].as_str().unwrap(), &[]).unwrap();
        let run = common::complete(&case, solver);
        let r = case.machine.pulley_radius;
        let doubt = |key: &str| 4.0 * told_case["methods_differ_by"][key].as_f64().unwrap();
        for (row, want) in told_case["rows"].as_array().unwrap().iter().zip(told_case["states"].as_array().unwrap()) {
            let row = row.as_u64().unwrap() as usize;
            for (column, want) in columns.iter().zip(want.as_array().unwrap()).skip(1) {
                let have = run.trajectory.get(column).unwrap()[row];
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
        let (have, want) = (told(&run.outcome.events), told_case["events"].as_array().unwrap());
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

/// The figures of a run with a row every so many seconds, and the rows.
fn metered(case: &Case, solver: Solver, every: f64) -> (Metrics, Trajectory) {
    let course = Course { every, ..Course::new(&case.machine.mechanism(), &case.experiments[0]) };
    let mut meter = Meter::new(&case.machine, &case.experiments[0]);
    let mut rows = Trajectory::default();
    let sink = &mut |block: &Trajectory| {
        rows.append(block);
        Flow::Continue
    };
    let outcome =
        stream_mechanism(&case.machine.mechanism(), &course, solver, (Detail::Full, Some(&mut meter)), sink).unwrap();
    (meter.finish(&outcome.events), rows)
}

/// All peaks of a run.
fn peaks(metrics: &Metrics) -> Vec<Peak> {
    let Metrics { loads, drives, spans, .. } = metrics;
    let mut peaks: Vec<Peak> = loads.iter().map(|load| load.peak_speed).collect();
    peaks.extend(loads.iter().map(|load| load.peak_error));
    peaks.extend(drives.iter().map(|drive| drive.peak_current));
    peaks.extend(drives.iter().map(|drive| drive.peak_speed));
    peaks.extend(spans.iter().map(|span| span.peak_stretch));
    peaks.extend(spans.iter().map(|span| span.peak_force));
    peaks
}

/// The stretch of each span by its lever arms, s = A q, from columns of q.
fn stretches(case: &Case, q: [&[f64]; 4]) -> Vec<Vec<f64>> {
    let r = case.machine.pulley_radius;
    let arms: &[[f64; 4]] = match case.machine.kind {
        MachineKind::HFrame => &[[r, 0.0, 1.0, 1.0], [0.0, -r, 1.0, -1.0], [-r, r, -2.0, 0.0]],
        MachineKind::Axis | MachineKind::CoreXy => {
            &[[r, 0.0, -1.0, -1.0], [-r, 0.0, 1.0, 1.0], [0.0, r, -1.0, 1.0], [0.0, -r, 1.0, -1.0]]
        }
        MachineKind::DualBelt => unreachable!("the authority has H-frames and CoreXY"),
    };
    let at = |arms: &[f64; 4], row: usize| arms.iter().zip(q).map(|(arm, column)| arm * column[row]).sum();
    arms.iter().map(|arms| (0..q[0].len()).map(|row| at(arms, row)).collect()).collect()
}

/// Where the drives have bridge and cart.
fn place(case: &Case, [left, right]: [f64; 2]) -> [f64; 2] {
    case.machine.by_drives(&[left, right, 0.0, 0.0, 0.0, 0.0]).try_into().unwrap()
}

/// The largest magnitudes in rows, in the same order.
fn largest_rows(case: &Case, rows: &Trajectory) -> Vec<f64> {
    let get = |name: &str| rows.get(name).unwrap().to_vec();
    let [left, right, x, y] = ["left_angle", "right_angle", "bridge_position", "cart_position"].map(get);
    let places = left.iter().zip(&right).map(|(left, right)| place(case, [*left, *right]));
    let errors: Vec<[f64; 2]> = places.zip(x.iter().zip(&y)).map(|([xd, yd], (x, y))| [xd - x, yd - y]).collect();
    let mut columns = vec![get("bridge_speed"), get("cart_speed")];
    columns.extend([0, 1].map(|k| errors.iter().map(|error| error[k]).collect()));
    columns.extend([get("left_current"), get("right_current")]);
    // Of the motors: rotors that turn by themselves, or the pulleys.
    columns.extend(["left", "right"].map(|side| {
        let rotor = rows.get(&format!("{side}_rotor_speed"));
        rotor.map_or_else(|| get(&format!("{side}_speed")), <[f64]>::to_vec)
    }));
    let stretches = stretches(case, [&left, &right, &x, &y]);
    columns.extend(stretches);
    columns.extend(case.machine.kind.geometry().span_labels().map(|span| get(&format!("{}_force", span.key))));
    columns.iter().map(|column| column.iter().fold(0.0, |most: f64, v| most.max(v.abs()))).collect()
}

#[test]
fn peaks_are_of_the_motion_and_not_of_its_rows() {
    let file = cases();
    for told in file["cases"].as_array().unwrap().iter().take(24) {
        let name = told["name"].as_str().unwrap();
        let case = Case::from_text_with("gantry.toml", told["case"].as_str().unwrap(), &[]).unwrap();
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
        assert_eq!((fine.stop_time.is_some(), &fine.bodies), (coarse.stop_time.is_some(), &coarse.bodies), "{name}");
        let [x, y] = ["bridge_position", "cart_position"].map(|name| *rows.get(name).unwrap().last().unwrap());
        assert_eq!([fine.loads[0].position, fine.loads[1].position], [x, y], "{name}");
    }
}

#[test]
fn a_rotor_behind_a_gear_with_play_keeps_a_gantry_from_resting() {
    let case = |play: &[&str]| {
        let text = std::fs::read_to_string("stages/core-xy/core-xy.toml").unwrap();
        Case::from_text_with("core-xy.toml", &text, play).unwrap()
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
    let case = Case::from_text_with("follows.toml", &text, &[]).unwrap();
    let mechanism = case.machine.mechanism();
    assert_eq!(Solver::of_mechanism(&mechanism), Solver::GENERAL);
    let course = Course::new(&mechanism, &case.experiments[0]);
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
    let r = case.machine.pulley_radius;
    let mut off: f64 = 0.0;
    for (column, lever) in [("left_angle", r), ("right_angle", r), ("bridge_position", 1.0), ("cart_position", 1.0)] {
        for (a, b) in rows.get(column).unwrap().iter().zip(fine.get(column).unwrap()) {
            off = off.max(lever * (a - b).abs());
        }
    }
    assert!(off <= error.value && error.value < 1e3 * off && error.way > 0.05, "{off} m, estimated {error:?}");
}

#[test]
fn elastic_modes_are_those_of_the_authority() {
    let file = cases();
    let told = file["frequencies"].as_array().unwrap();
    assert_eq!(told.len(), 23);
    for told in told {
        let case = Case::from_text_with("gantry.toml", told["case"].as_str().unwrap(), &[]).unwrap();
        let analysis = Analysis::new(&case, &Question::default()).unwrap();
        let (name, modes) = (told["name"].as_str().unwrap(), analysis.modes.unwrap());
        let want: Vec<f64> = told["elastic_Hz"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        assert_eq!((modes.rigid.len(), modes.elastic.len()), (2, want.len()), "{name}");
        for (mode, want) in modes.elastic.iter().zip(want) {
            assert!((mode.hertz() / want - 1.0).abs() < 1e-9, "{name}: {} Hz instead of {want} Hz", mode.hertz());
            assert!((mode.energy.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}

/// The machines of a note on the two kinds, to twelve digits.
#[test]
fn the_machines_of_the_note() {
    let case = |kind: &str, stiffness: &str| {
        let text = format!(
            r#"
            kind = "{kind}"
            motor = {{ torque_constant = 0.05, back_emf_constant = 0.05, resistance = 1 }}
            drive_pulley = {{ radius = "19.4 mm", inertia = "6.3e-5 kg m^2" }}
            bridge = {{ mass = "0.838 kg" }}
            cart = {{ mass = "0.362 kg" }}
            belt = {{ stiffness = {stiffness} }}
            experiment = [{{ name = "run", input = {{}}, until = 1, every = 1e-3 }}]
            "#
        );
        Case::from_text_with("gantry.toml", &text, &[]).unwrap()
    };
    for (kind, stiffness, hertz) in [
        ("h-frame", "[132.76e3, 132.76e3, 58.885e3]", [196.643946994, 220.198687165]),
        ("h-frame", "[100e3, 200e3, 80e3]", [193.499561135, 257.381999764]),
        ("core-xy", "[150e3, 90e3, 140e3, 95e3]", [214.360612188, 263.042776685]),
    ] {
        let case = case(kind, stiffness);
        let analysis = Analysis::new(&case, &Question::default()).unwrap();
        let modes = analysis.modes.unwrap();
        for (mode, want) in modes.elastic.iter().zip(hertz) {
            assert!((mode.hertz() - want).abs() < 1e-9, "{kind}: {} Hz", mode.hertz());
        }
        // r φ₁ and r φ₂ of bridge and cart alone, as the pulleys turn without strain.
        for (mode, [x, y]) in modes.rigid.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
            let want = case.machine.without_strain(&[x, y], &[]).position;
            assert!(mode.shape.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", mode.shape);
        }
    }
}

/// With sides alike a dual belt swings as three pairs of masses do: both pulleys against each other on all four spans,
/// both against the bridge, and the cart's pulley against the cart.
#[test]
fn a_dual_belt_swings_as_its_masses_do() {
    let text = r#"
        kind = "dual-belt"
        motor = { torque_constant = 0.05, back_emf_constant = 0.05, resistance = 1 }
        drive_pulley = { radius = "19.4 mm", inertia = "6.3e-5 kg m^2" }
        bridge = { mass = "0.838 kg" }
        cart = { mass = "0.362 kg" }
        belt = { stiffness = [60e3, 130e3, 60e3, 130e3, 95e3, 140e3] }
        experiment = [{ name = "run", input = {}, until = 1, every = 1e-3 }]
    "#;
    let case = Case::from_text_with("gantry.toml", text, &[]).unwrap();
    let (pulley, whole, cart) = (6.3e-5 / 0.0194_f64.powi(2), 0.838 + 0.362, 0.362);
    let (side, along) = (60e3 + 130e3, 95e3 + 140e3);
    let mut squares: Vec<f64> =
        vec![side / pulley, side / pulley + 2.0 * side / whole, along * (1.0 / pulley + 1.0 / cart)];
    squares.sort_by(f64::total_cmp);
    let modes = Analysis::new(&case, &Question::default()).unwrap().modes.unwrap();
    assert_eq!((modes.rigid.len(), modes.elastic.len()), (2, 3));
    for (mode, square) in modes.elastic.iter().zip(squares) {
        let want = square.sqrt() / (2.0 * std::f64::consts::PI);
        assert!((mode.hertz() / want - 1.0).abs() < 1e-9, "{} Hz instead of {want} Hz", mode.hertz());
    }
    for (mode, [x, y]) in modes.rigid.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
        let want = case.machine.without_strain(&[x, y], &[]).position;
        assert!(mode.shape.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", mode.shape);
    }
}

/// A swing dies out as its pole says.
#[test]
fn a_swing_of_a_gantry_dies_out_with_its_damping_ratio() {
    let text = r#"
        kind = "core-xy"
        motor = { torque_constant = 0.05, back_emf_constant = 0.05, resistance = 1, gear_ratio = 2 }
        drive_pulley = { radius = "19.4 mm", inertia = "6.3e-5 kg m^2", friction = { viscous = 1e-3 } }
        bridge = { mass = "0.838 kg", friction = { viscous = 12 } }
        cart = { mass = "0.362 kg", friction = { viscous = 8 } }
        belt = { stiffness = [150e3, 90e3, 140e3, 95e3], damping = [3, 4, 5, 6] }
        experiment = [{ name = "run", input = {}, until = 0.05, every = 1e-5 }]
    "#;
    let mut case = Case::from_text_with("gantry.toml", text, &[]).unwrap();
    let modes = Natural::new(&case.machine.mechanism(), &[0.0; 6]).unwrap();
    let last = modes.elastic.last().unwrap();
    let Some(Root::Pair { frequency, damping }) = last.damped else { panic!("{modes:?}") };
    assert!((frequency / last.frequency - 1.0).abs() < 0.05 && damping > 0.01 && damping < 0.5);
    // Begun in the shape of that mode, which damping mixes a little with the others.
    let r = case.machine.pulley_radius;
    for (body, shape) in last.shape.iter().enumerate() {
        case.experiments[0].initial.position[body] = 1e-4 * shape / if body < 2 { r } else { 1.0 };
    }
    let rows = common::complete(&case, Solver::Exact).trajectory;
    let energy = |row: usize| {
        let at = |name: &str| rows.get(name).unwrap()[row];
        let [x, y] = place(&case, [at("left_angle"), at("right_angle")]);
        (x - at("bridge_position")).hypot(y - at("cart_position"))
    };
    // The largest strain in each of the first two periods.
    let period = 2.0 * std::f64::consts::PI / (frequency * (1.0 - damping * damping).sqrt());
    let rows_of = (period / 1e-5).round() as usize;
    let most = |from: usize| (from..from + rows_of).map(energy).fold(0.0, f64::max);
    let want = (-damping * frequency * period).exp();
    let have = most(rows_of) / most(0);
    assert!((have / want).ln().abs() < 0.25 * want.ln().abs(), "{have} instead of {want}");
}

#[test]
fn resonances_follow_bridge_and_cart() {
    for name in ["h-frame", "core-xy", "dual-belt"] {
        let case = Case::read_with(format!("stages/{name}/follows.toml"), &[]).unwrap();
        let analysis = Analysis::new(&case, &Question::default()).unwrap();
        let map = analysis.map.unwrap();
        let middle = (map.bridge.len() / 2, map.cart.len() / 2);
        assert!(map.bridge[middle.0].abs() < 1e-15 && map.cart[middle.1].abs() < 1e-15);
        for (mode, hertz) in analysis.modes.unwrap().elastic.iter().zip(&map.hertz) {
            assert!((hertz[middle.0][middle.1] / mode.hertz() - 1.0).abs() < 1e-12);
            // Left and right are alike here: a machine seen in a mirror. The cart's motor is at one end of its bridge.
            for row in hertz.iter().filter(|_| name != "dual-belt") {
                for (a, b) in row.iter().zip(row.iter().rev()) {
                    assert!((a / b - 1.0).abs() < 1e-9, "{name}: {a} {b}");
                }
            }
        }
        let [(least, _), (most, _)] = map.range(0);
        assert!(most > 1.01 * least, "{name}: {least} to {most}");
        // One place by itself: the stiffnesses written down.
        let (i, j) = (3, 20);
        let lengths = case.machine.span_lengths(&[map.bridge[i], map.cart[j]]).unwrap();
        let mut there = case.machine.clone();
        there.belt.follows_cart = false;
        there.belt.stiffness = lengths.map(|length| there.belt.make.unwrap().rigidity() / length);
        for (hertz, want) in map.hertz.iter().zip(Natural::frequencies(&there.mechanism(), &[0.0; 6]).unwrap()) {
            assert!((hertz[i][j] / want - 1.0).abs() < 1e-12);
        }
    }
}
