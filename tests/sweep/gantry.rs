//! Sweeps of gantries: a row is the run of its machine, and figures are those of its columns.

use super::{bits, rows};
use taut::case::{Case, Given, Sampling};
use taut::machine::MachineKind;
use taut::metrics::{Extras, Meter, Metrics, figures};
use taut::parameter::{Free, every, values};
use taut::solve::{Course, Detail, Flow, Solver, stream_mechanism};
use taut::sweep::{Status, Sweep};
use taut::trajectory::Trajectory;

const H_FRAME: &str = include_str!("../../stages/h-frame/h-frame.toml");
const CORE_XY: &str = include_str!("../../stages/core-xy/core-xy.toml");
const DUAL_BELT: &str = include_str!("../../stages/dual-belt/dual-belt.toml");
const RACKING: &str = include_str!("../../stages/h-frame/racking.toml");

fn case(text: &str, changes: &[&str]) -> Case {
    Case::from_text_with("gantry.toml", text, changes).unwrap_or_else(|error| panic!("{error}"))
}

fn sweep(text: &str, changes: &[&str]) -> Sweep {
    Sweep::new(&case(text, changes)).unwrap_or_else(|error| panic!("{error}"))
}

/// The key figures that `taut simulate` gives of an experiment.
fn simulated(case: &Case, experiment: usize) -> Metrics {
    let mechanism = case.machine.mechanism();
    let mut meter = Meter::new(&case.machine, &case.experiments[experiment]);
    let (course, solver) = (Course::new(&mechanism, &case.experiments[experiment]), Solver::of_mechanism(&mechanism));
    let observed = (Detail::Full, Some(&mut meter as _));
    let outcome = stream_mechanism(&mechanism, &course, solver, observed, &mut |_| Flow::Continue).unwrap();
    meter.finish(&outcome.events)
}

/// Each row, its numbers put into the case file by `--set` and simulated, bit for bit.
#[test]
fn figures_that_are_asked_for_are_those_of_all() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/stages/h-frame/h-frame.toml");
    let rows = |more: &[&str]| {
        let plan = ["sweep.runs=3", "sweep.vary.\"cart.mass\"=20 %"];
        let case = Case::read_with(file, &[&plan[..], more].concat()).unwrap();
        Sweep::new(&case).unwrap().rows(0, 3, &|| false).unwrap()
    };
    let (all, some) = (rows(&[]), rows(&["sweep.figures=[\"peak_belt_force\"]"]));
    let per_experiment = some.columns.iter().filter(|column| column.name.contains('.')).count();
    assert_eq!(per_experiment % 2, 1, "the parameter, and of each experiment status and force");
    for column in &some.columns {
        assert_eq!(Some(&column.values[..]), all.get(&column.name), "{}", column.name);
    }
}

#[test]
fn a_row_is_the_run_of_its_machine() {
    let keys = [
        "cart.mass",
        "bridge.friction.coulomb",
        "left_drive.motor.resistance",
        "belt.stiffness.1",
        "motor.torque_constant",
    ];
    let mut compared = 0;
    for text in [H_FRAME, CORE_XY, DUAL_BELT, RACKING] {
        for design in ["random", "latin-hypercube", "sobol"] {
            let mut changes =
                vec![format!("sweep.design={design}"), "sweep.runs=6".to_string(), "sweep.solver=exact".to_string()];
            changes.extend(keys.iter().map(|key| format!("sweep.vary.\"{key}\"=10 %")));
            let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
            let sweep = sweep(text, &changes);
            let table = rows(&sweep, 0, 6);
            for row in 0..6 {
                let set: Vec<String> =
                    keys.iter().map(|key| format!("{key}={:?}", table.get(key).unwrap()[row])).collect();
                let case = case(text, &set.iter().map(String::as_str).collect::<Vec<_>>());
                assert_eq!(sweep.machine(row as u64), case.machine);
                for (number, group) in sweep.groups().iter().enumerate() {
                    assert_eq!(table.get(&format!("{}.status", group.file)).unwrap()[row], Status::Complete.code());
                    let metrics = simulated(&case, number);
                    for figure in figures(case.machine.kind, Extras::new(&case.machine)) {
                        let value = table.get(&format!("{}.{}", group.file, figure.name)).unwrap()[row];
                        let told = figure.value(&metrics).number();
                        assert_eq!(value.to_bits(), told.to_bits(), "{design} {}", figure.name);
                        compared += 1;
                    }
                }
            }
        }
    }
    assert!(compared > 3000, "{compared}");
}

/// The greatest magnitude of a column.
fn most(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Everything off at once, on machines with spans that go slack, gears with play and end stops, too: figures against
/// those of rows every 20 µs, which miss the tops of the peaks by at most so much.
#[test]
fn figures_are_those_of_the_columns() {
    let more = [
        "belt.pretension=4 N",
        "motor.rotor_inertia=1e-5 kg m^2",
        "left_drive.motor.gear_stiffness=300 N m/rad",
        "left_drive.motor.backlash=0.5 deg",
        "bridge.travel.min=-60 mm",
        "bridge.travel.stop_stiffness=20 kN/m",
    ];
    let plan = ["sweep.runs=4", "sweep.interval=20 us", "sweep.vary.all=15 %", "sweep.seed=5", "sweep.solver=exact"];
    let mut compared = 0;
    let all = [(H_FRAME, &[][..]), (CORE_XY, &[]), (DUAL_BELT, &[]), (H_FRAME, &more), (CORE_XY, &more)];
    for (text, more) in all {
        let sweep = sweep(text, &[&plan[..], more].concat());
        let table = rows(&sweep, 0, 4);
        for (row, (number, group)) in (0..4).flat_map(|row| sweep.groups().iter().enumerate().map(move |g| (row, g))) {
            let figure = |name: &str| table.get(&format!("{}.{name}", group.file)).unwrap()[row];
            assert_eq!(figure("status"), Status::Complete.code());
            let mut columns = Trajectory::default();
            let sink = &mut |block: &Trajectory| {
                columns.append(block);
                Flow::Continue
            };
            sweep.stream(row as u64, number, sink).unwrap();
            let gantry = sweep.machine(row as u64);
            let column = |name: &str| columns.get(name).unwrap_or_else(|| panic!("{name}"));
            let last = |name: &str| *column(name).last().unwrap();
            let mut near = |name: &str, expected: f64, length: f64| {
                let off = figure(name).abs() - expected.abs();
                assert!((-1e-15..=length).contains(&off), "{} {name} of run {row}: {off:e}", group.name);
                compared += 1;
            };
            for body in ["bridge", "cart"] {
                near(&format!("final_{body}_position"), last(&format!("{body}_position")), 0.0);
                near(&format!("final_{body}_speed"), last(&format!("{body}_speed")), 0.0);
                near(&format!("peak_{body}_speed"), most(column(&format!("{body}_speed")).iter().copied()), 2e-4);
            }
            for at in gantry.geometry().drives {
                let (side, pulley) = (at.side(), gantry.geometry().label(at.pulley).key);
                let motor = columns.get(&format!("{side}_rotor_speed")).unwrap_or(column(&format!("{pulley}_speed")));
                near(
                    &format!(
                        "peak_{}",
                        if side == "cart" { "cart_drive_speed".into() } else { format!("{side}_speed") }
                    ),
                    most(motor.iter().copied()),
                    0.02,
                );
                near(&format!("peak_{side}_current"), most(column(&format!("{side}_current")).iter().copied()), 2e-3);
            }
            let [x, y] = ["bridge_position", "cart_position"].map(column);
            let r = gantry.pulley_radius;
            // One span for each drive tells of all: those of a belt add up to nothing.
            let spans: &[(&str, &str, [f64; 3])] = match gantry.kind {
                MachineKind::HFrame => {
                    &[("left_span", "left", [1.0, 1.0, 1.0]), ("right_span", "right", [-1.0, 1.0, -1.0])]
                }
                MachineKind::Axis | MachineKind::CoreXy => {
                    &[("a_out_span", "left", [1.0, -1.0, -1.0]), ("b_out_span", "right", [1.0, -1.0, 1.0])]
                }
                MachineKind::DualBelt => &[
                    ("left_back_span", "left", [-1.0, 1.0, 0.0]),
                    ("right_out_span", "right", [1.0, -1.0, 0.0]),
                    ("cart_back_span", "cart_pulley", [-1.0, 0.0, 1.0]),
                ],
            };
            for &(span, pulley, [of_angle, of_x, of_y]) in spans {
                let angle = column(&format!("{pulley}_angle"));
                let stretch =
                    angle.iter().zip(x).zip(y).map(|((angle, x), y)| of_angle * r * angle + of_x * x + of_y * y);
                near(&format!("peak_{span}_stretch"), most(stretch), 50e-9);
            }
            for span in gantry.kind.geometry().span_labels() {
                near(
                    &format!("peak_{}_force", span.key),
                    most(column(&format!("{}_force", span.key)).iter().copied()),
                    0.02,
                );
            }
        }
    }
    assert!(compared > 600, "{compared}");
}

#[test]
fn rows_are_the_same_however_they_are_split() {
    for (design, indices) in [("random", "true"), ("latin-hypercube", "false"), ("sobol", "true")] {
        let (design, indices) = (format!("sweep.design={design}"), format!("sweep.indices={indices}"));
        let sweep = sweep(
            CORE_XY,
            &[&design, &indices, "sweep.runs=3", "sweep.vary.\"cart.mass\"=9 %", "sweep.vary.\"belt.damping\"=9 %"],
        );
        let count = sweep.runs() as usize;
        let whole = rows(&sweep, 0, count);
        let mut pieces = rows(&sweep, 0, 2);
        pieces.append(&rows(&sweep, 2, count));
        assert_eq!((bits(&whole), whole.len()), (bits(&pieces), count));
    }
    let grid = [
        "sweep.design=grid",
        "sweep.vary.\"cart.travel.max\"=values(0.1 m, 0.2 m)",
        "sweep.vary.\"bridge.mass\"=grid(1 kg, 2 kg, 3)",
    ];
    let sweep = sweep(H_FRAME, &grid);
    assert_eq!((sweep.runs(), sweep.sampling()), (6, Sampling::Grid));
    assert_eq!(sweep.values(0, 6).columns[2].values, [1.0, 1.5, 2.0, 1.0, 1.5, 2.0]);
}

/// `all` is each number by itself; drives that are alike are one, and two where one was given a number of its own.
#[test]
fn drives_that_are_alike_are_off_alike() {
    let pulley = ["drive_pulley.friction.viscous", "drive_pulley.friction.coulomb"];
    let slide = |body: &str, names: &[&str]| -> Vec<String> {
        names.iter().map(|name| format!("{body}.friction.{name}")).collect()
    };
    let mut expected: Vec<String> = ["motor.torque_constant", "motor.back_emf_constant", "motor.resistance"]
        .into_iter()
        .chain(["drive_pulley.radius", "drive_pulley.inertia", "bridge.mass", "cart.mass"])
        .map(str::to_string)
        .collect();
    expected.extend((0..3).map(|span| format!("belt.stiffness.{span}")));
    expected.extend((0..3).map(|span| format!("belt.damping.{span}")));
    expected.extend(pulley.map(str::to_string));
    let names = ["viscous", "coulomb", "static"];
    expected.extend([slide("cart", &names), slide("bridge", &names)].concat());
    let sorted = |mut keys: Vec<String>| {
        keys.sort();
        keys
    };
    assert_eq!(sorted(every(&case(H_FRAME, &[]).machine)), sorted(expected.clone()));

    let apart = case(H_FRAME, &["left_drive.motor.resistance=0.8 ohm"]).machine;
    expected.retain(|key| key != "motor.resistance");
    expected.extend(["left_drive.motor.resistance", "right_drive.motor.resistance"].map(str::to_string));
    assert_eq!(sorted(every(&apart)), sorted(expected));
    let told = Free::new(&apart, "motor.resistance", &[], &[]).unwrap_err().to_string();
    assert_eq!(
        told,
        "`motor.resistance` is not the same in all drives\n  \
         next: name `left_drive.motor.resistance` or `right_drive.motor.resistance`"
    );
    // What is named by itself goes by itself, and `motor.resistance` is the other one.
    let both = ["motor.resistance", "left_drive.motor.resistance"];
    let [other, left] = both.map(|key| Free::new(&apart, key, &both, &[]).unwrap());
    assert_eq!((other.start, left.start, other.overlaps(&left)), (0.71, 0.8, false));
    let mut gantry = apart;
    other.set(&mut gantry, 1.0);
    assert_eq!(gantry.drives.iter().map(|unit| unit.motor.resistance).collect::<Vec<_>>(), [0.8, 1.0]);

    // Off by a share is a factor on the value, the same for both.
    let sweep = sweep(H_FRAME, &["sweep.runs=20", "sweep.vary.all=20 %"]);
    for run in 0..20 {
        let gantry = sweep.machine(run);
        assert_eq!(gantry.drives[0].motor, gantry.drives[1].motor);
        assert!((0.8 * 0.71..1.2 * 0.71).contains(&gantry.drives[0].motor.resistance));
        for friction in [gantry.drive_pulley.friction, gantry.first_slide().friction, gantry.cart.friction] {
            assert_eq!(friction.forward, friction.backward);
            assert!(friction.forward.breakaway >= friction.forward.coulomb);
        }
    }
}

/// A gantry with all that goes together, and what excludes it.
const PARTS: [&[&str]; 3] = [
    &[
        "motor={ torque_constant = 0.5, back_emf_constant = 0.5, resistance = 2, inductance = 0.03125, rotor_inertia = 0.25, \
         gear_ratio = 2, gear_stiffness = 4096, gear_damping = 0.5, backlash = 0.125 }",
        "amplifier={ mode = \"current\", gain = 0.5, voltage_limit = 32, current_limit = 8, bandwidth = 1024 }",
        "bridge.friction={ viscous = 0.5, coulomb = 0.25, stribeck = { force = 0.125, velocity = 0.25 } }",
        "cart.friction={ viscous = 0.5, coulomb = 0.25, static = 0.5, lugre = { stiffness = 1024, damping = 2, velocity = 0.25 } }",
        "drive_pulley.friction={ viscous = 0.5, coulomb = 0.25, static = 0.5, viscous_backward = 1, coulomb_backward = 0.125, \
         static_backward = 0.25, smooth = { breakaway_velocity = 0.5 } }",
        "belt.pretension=64",
        "bridge.travel={ min = -2, max = 8, stop_stiffness = 512, stop_damping = 4 }",
        "encoder={ at = \"motor\", lines = 512 }",
    ],
    &["motor.gear_efficiency=0.5", "cart.friction={ coulomb = 0.25, stribeck = { force = 0.125, decay = 16 } }"],
    &["belt={ modulus = 1048576, section = 0.0078125, spans = [8, 16, 32], follows_cart = true }"],
];

/// Sets each number of each gantry to a quarter of its value: it is read back, and a case file that says so is the same
/// machine.
#[test]
fn every_number_is_set_where_a_case_file_has_it() {
    let mut seen = 0;
    for changes in PARTS {
        let in_amperes = H_FRAME.replace(" V\"", " A\"");
        let text = if changes.iter().any(|change| change.contains("current")) { &in_amperes } else { H_FRAME };
        let base = case(text, changes);
        for (key, value) in values(&base.machine) {
            // A breakaway is never below Coulomb friction.
            let factor = if key.contains("friction.static") { 1.5 } else { 0.75 };
            let part = if value == 0.0 { 0.0 } else { factor * value };
            let stands = |key: &str| matches!(base.value(key), Ok(Given::Number(_)));
            let given: Vec<String> =
                values(&base.machine).into_iter().map(|(key, _)| key).filter(|key| stands(key)).collect();
            let given: Vec<&str> = given.iter().map(String::as_str).collect();
            let free = Free::new(&base.machine, &key, &given, &[]).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(free.start, value, "{key}");
            let mut gantry = base.machine.clone();
            free.set(&mut gantry, part);
            let set = format!("{key}={part:?}");
            let changes: Vec<&str> = changes.iter().copied().chain([set.as_str()]).collect();
            match Case::from_text_with("gantry.toml", text, &changes) {
                Ok(read) => assert_eq!(gantry, read.machine, "{key}"),
                // Zero where more is wanted, and another form of what the file has.
                Err(_) if value == 0.0 || key.contains("stribeck.decay") || key.contains("stribeck.velocity") => {
                    continue;
                }
                Err(error) => panic!("{error}"),
            }
            seen += 1;
        }
    }
    assert!(seen > 130, "{seen}");
}

/// Numbers that do not go together are a row of their own, and no reason to stop.
#[test]
fn a_gantry_that_is_none_is_a_row() {
    let plan = ["sweep.design=grid", "sweep.vary.\"cart.travel.min\"=values(-0.25 m, 0.3 m, -0.01 m)"];
    let table = rows(&sweep(H_FRAME, &plan), 0, 3);
    let status = table.get("one-motor.status").unwrap();
    assert_eq!(status, [Status::Complete, Status::Refused, Status::LeftTravel].map(Status::code));
    let position = table.get("one-motor.final_cart_position").unwrap();
    assert_eq!([0, 1, 2].map(|row: usize| position[row].is_nan()), [false, true, true]);
}
