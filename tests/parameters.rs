//! Every number of a machine that a case file can hold is free: in a fit, in a sweep, and read back from where it sits.

use std::path::PathBuf;
use std::sync::LazyLock;
use taut::case::{Case, Given, TEMPLATE, gantry_template};
use taut::fit::Problem;
use taut::machine::{Machine, MachineKind};
use taut::parameter::{self, Field, Free, Off, Parameter, Sits, all, every, free_markdown, kinds, named, values};
use taut::sweep::Sweep;

/// A machine with all parts that go together. Numbers are sums of few powers of two, so that twice or a quarter of them
/// is exact.
const WHOLE: &str = r#"
[motor]
torque_constant = 0.5
back_emf_constant = 0.5
resistance = 2
inductance = 0.03125
rotor_inertia = 0.25
gear_ratio = 2
gear_stiffness = 4096
gear_damping = 0.5
backlash = 0.125
[amplifier]
mode = "current"
gain = 0.5
voltage_limit = 32
current_limit = 8
bandwidth = 1024
[drive_pulley]
radius = 0.5
inertia = 0.5
friction = { DRIVE }
[idler_pulley]
inertia = 0.5
friction = { IDLER }
[cart]
mass = 4
load = 2
inclination = 0.125
friction = { CART, along = [[-1, 1], [0.5, 2], [4, 1]] }
force_along = [[-1, 0.5], [0.5, -2], [4, 1]]
force_by_speed = [[-1, 0.25], [2, -0.5]]
[belt]
stiffness = [1024, 1024, 512]
damping = [1, 2, 4]
pretension = 64
[travel]
min = -2
max = 8
stop_stiffness = 512
stop_damping = 4
[encoder]
at = "motor"
lines = 512
[scale]
lines = 256
[[experiment]]
name = "step"
until = 0.03125
every = 0.0078125
log = { file = "log.csv", time = "t", input = "u", cart_position = "x" }
"#;

/// A gantry of one kind, with one friction law.
const GANTRY: &str = r#"
kind = "KIND"
[motor]
torque_constant = 0.5
back_emf_constant = 0.5
resistance = 2
[drive_pulley]
radius = 0.5
inertia = 0.5
friction = { LAW }
[bridge]
mass = 4
load = 0.5
force_by_speed = [[-1, 0.25], [2, -0.5]]
friction = { LAW }
travel = { min = -2, max = 8, stop_stiffness = 512, stop_damping = 4 }
yaw = { inertia = 0.5, belt_spacing = 4, bearing_spacing = 0.25, bearing_stiffness = 1048576, bearing_damping = 64 }
[cart]
mass = 2
load = 0.5
force_by_speed = [[-1, 0.25], [2, -0.5]]
friction = { LAW }
travel = { min = -1, max = 4, stop_stiffness = 256, stop_damping = 2 }
[belt]
stiffness = [SPANS]
damping = [SPANS]
[[experiment]]
name = "step"
input = { left = { step = 1 } }
until = 0.03125
every = 0.0078125
"#;

/// Friction laws, each on each body by turns.
const LAWS: [&str; 3] = [
    "viscous = 0.5, coulomb = 0.25, stribeck = { force = 0.125, velocity = 0.25 }",
    "viscous = 0.5, coulomb = 0.25, static = 0.5, lugre = { stiffness = 1024, damping = 2, velocity = 0.25 }",
    "viscous = 0.5, coulomb = 0.25, static = 0.5, viscous_backward = 1, coulomb_backward = 0.125, \
     static_backward = 0.25, smooth = { breakaway_velocity = 0.5 }",
];

/// Tables that exclude something of that: the belt by its make, a gear with losses, a decay instead of a velocity.
const OTHERS: [(&str, &str); 3] = [
    ("stiffness = [1024, 1024, 512]", "modulus = 1048576\nsection = 0.0078125\nspans = [8, 16, 32]"),
    ("gear_stiffness = 4096\ngear_damping = 0.5\nbacklash = 0.125", "gear_efficiency = 0.5"),
    ("force = 0.125, velocity = 0.25", "force = 0.125, decay = 16"),
];

/// A folder with a log.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("taut-parameters-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let log = "t,u,x\n0,0,0\n0.0078125,1,0\n0.015625,1,0.001\n0.0234375,1,0.003\n0.03125,1,0.006\n";
    std::fs::write(folder.join("log.csv"), log).unwrap();
    folder
});

/// Machines that have all of it between them: a name for messages and a text each.
fn cases() -> Vec<(String, String)> {
    let name = FOLDER.join("case.toml").to_string_lossy().into_owned();
    let mut cases = Vec::new();
    for first in 0..3 {
        let law = |body: usize| LAWS[(first + body) % 3];
        let text = WHOLE.replace("DRIVE", law(0)).replace("IDLER", law(1)).replace("CART", law(2));
        // A gear with losses does not go with a law that never sticks.
        let others = OTHERS.iter().filter(|(_, new)| first == 0 || !new.contains("gear"));
        let other = others.fold(text.clone(), |text, (old, new)| {
            assert!(text.contains(old), "{old}");
            text.replace(old, new)
        });
        cases.extend([(name.clone(), text), (name.clone(), other)]);
    }
    let (motor, rest) = WHOLE.split_once("[amplifier]\nmode = \"current\"").unwrap();
    assert!(motor.starts_with("\n[motor]"));
    let drive = format!("[drive]\nforce_per_input = 2\ndrag = 4\n[amplifier]\nmode = \"voltage\"{rest}");
    let drive = drive.replace("bandwidth = 1024\n", "").replace("at = \"motor\"", "at = \"cart\"");
    let drive = drive.replace("[scale]\nlines = 256\n", "");
    let drive = drive.replace("stiffness = [1024, 1024, 512]", "specific_stiffness = 8192\nspans = [8, 16, 32]");
    let drive = drive.replace("DRIVE", LAWS[0]).replace("IDLER", LAWS[0]).replace("CART", LAWS[0]);
    cases.push((name, drive));
    cases
}

fn read(name: &str, text: &str, changes: &[&str]) -> Case {
    Case::from_text_with(name, text, changes).unwrap_or_else(|error| panic!("{error}\n{changes:?}"))
}

fn value_of(stage: &Machine, key: &str) -> Option<f64> {
    values(stage).into_iter().find(|(own, _)| own == key).map(|(_, value)| value)
}

/// Sets each number of a machine to a quarter of its value: it is read back, and a case file that says so is the same
/// machine.
fn set_each(
    machine: &Machine,
    is_given: &dyn Fn(&str) -> bool,
    written: &dyn Fn(&str) -> taut::Result<Machine>,
    seen: &mut Vec<&'static str>,
) {
    // What stands by itself in the file goes by itself.
    let given: Vec<&str> = all().map(|row| row.key).filter(|key| is_given(key)).collect();
    for (key, value) in values(machine) {
        let row = machine.row(&key).unwrap();
        seen.push(row.key);
        let part = if row.key.ends_with(".position") { value + 0.25 } else { 0.25 * value };
        let free = Free::new(machine, &key, &given, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((free.start, free.unit), (value, row.unit), "{key}");
        let mut stage = machine.clone();
        free.set(&mut stage, part);
        let held = value_of(&stage, &key.replace("static", "coulomb")).unwrap();
        assert_eq!(value_of(&stage, &key), Some(part.max(if key.contains(".static") { held } else { part })), "{key}");
        // A file gives one of two forms.
        let other_form = (key.ends_with(".velocity") || key.ends_with(".decay")) && !is_given(&key);
        if !other_form {
            // At rest a body holds at least what it resists with in motion, and a file may not say otherwise.
            match written(&format!("{key}={part}")) {
                Err(error) => {
                    assert!(key.contains(".static") && error.what.contains("less than the Coulomb"), "{key}: {error}")
                }
                Ok(written) => assert_eq!(written, stage, "{key}"),
            }
        }
    }
}

/// An axis with a stepper.
const STEPPER: &str = "
[stepper]
steps_per_turn = 256
holding_torque = 0.5
rated_current = 2
resistance = 1
inductance = 0.00390625
supply = 64
microsteps = 16
detent_torque = 0.015625
rotor_inertia = 0.00001
[drive_pulley]
radius = 0.0078125
inertia = 0.00001
[idler_pulley]
inertia = 0.00001
[cart]
mass = 0.5
[belt]
stiffness = [65536, 65536, 32768]
damping = [8, 8, 4]
[[experiment]]
name = \"there\"
input = { ramp = 0.03125, over = 1 }
until = 1
every = 0.25
";

/// Of axes, of gantries, and of a stepper.
#[test]
fn every_number_is_set_where_a_case_file_has_it() {
    let mut seen: Vec<&str> = Vec::new();
    for (name, text) in cases() {
        let case = read(&name, &text, &[]);
        let written = |change: &str| Ok(Case::from_text_with(&name, &text, &[change])?.machine);
        set_each(&case.machine, &|key| case.value(key).is_ok(), &written, &mut seen);
    }
    for (kind, law) in ["h-frame", "core-xy", "core-xy", "dual-belt"].into_iter().zip(LAWS.into_iter().cycle()) {
        let text = GANTRY.replace("KIND", kind).replace("LAW", law).replace(
            "SPANS",
            match kind {
                "h-frame" => "1024, 1024, 512",
                "dual-belt" => "1024, 512, 1024, 512, 1024, 512",
                _ => "1024, 512, 1024, 512",
            },
        );
        let read = |changes: &[&str]| Case::from_text_with("gantry.toml", &text, changes);
        let case = read(&[]).unwrap_or_else(|error| panic!("{error}"));
        let written = |change: &str| Ok(read(&[change])?.machine);
        set_each(&case.machine, &|key| case.value(key).is_ok(), &written, &mut seen);
    }
    let case = read("stepper.toml", STEPPER, &[]);
    let written = |change: &str| Ok(Case::from_text_with("stepper.toml", STEPPER, &[change])?.machine);
    set_each(&case.machine, &|key| case.value(key).is_ok(), &written, &mut seen);
    for row in all() {
        match row.field {
            Field::Machine(_) | Field::Form(..) => assert!(seen.contains(&row.key), "no machine has {}", row.key),
            Field::PartOf(whole) => assert!(seen.contains(&whole), "{}", row.key),
            Field::Elsewhere => {}
        }
    }
}

/// Each is a free parameter of a fit, and varied in a sweep.
#[test]
fn every_number_is_free_in_a_fit_and_varied_in_a_sweep() {
    for (name, text) in cases() {
        let case = read(&name, &text, &[]);
        for (key, value) in values(&case.machine) {
            let fitted = read(&name, &text, &[&format!("fit.free=[\"{key}\"]")]);
            let plan = fitted.fit.as_ref().unwrap();
            let problem = Problem::new(&fitted, plan).unwrap_or_else(|error| panic!("{error}"));
            let mut x = problem.start();
            assert_eq!(problem.stage_at(&x), case.machine, "{key}");
            x[0] += 0.125;
            assert_ne!(problem.stage_at(&x), case.machine, "{key}");

            let vary = format!("sweep.vary.\"{key}\"={{ factors = [1, 0.25, 2] }}");
            let swept = read(&name, &text, &["sweep.design=grid", &vary]);
            // Of the ends of its range a number has no double.
            let Ok(sweep) = Sweep::new(&swept) else {
                assert!(!named(&key).unwrap().range.contains(2.0 * value), "{key}");
                continue;
            };
            assert_eq!(sweep.machine(0), case.machine, "{key}");
            let less = value_of(&sweep.machine(1), &key).unwrap();
            assert!(less == 0.25 * value || key.contains(".static") && less < value, "{key}");
            assert_eq!(sweep.columns()[1].name, key);
        }
    }
}

/// A list as a whole keeps its ratios.
#[test]
fn the_numbers_of_a_list_go_together() {
    for (name, text) in cases() {
        let stage = read(&name, &text, &[]).machine;
        let lists = [
            "belt.stiffness",
            "belt.damping",
            "belt.spans",
            "cart.friction.along.position",
            "cart.friction.along.factor",
        ];
        for key in lists {
            let Ok(free) = Free::new(&stage, key, &[], &[]) else {
                assert!(key == "belt.stiffness" || key == "belt.spans", "{key}");
                continue;
            };
            let mut other = stage.clone();
            free.set(&mut other, 0.25 * free.start);
            let changed = values(&stage).into_iter().zip(values(&other)).filter(|(old, new)| old != new);
            let of_list = |(key, _): &(String, f64)| named(key).unwrap().key;
            let own: Vec<_> = changed.filter(|(old, _)| of_list(old) == key).collect();
            assert_eq!(own.len(), 3, "{key}");
            assert!(own.iter().all(|((_, old), (_, new))| *new == 0.25 * old), "{key}");
        }
    }
}

/// Free parameters may be set in whatever order: the breakaway is at least Coulomb friction, and of a Stribeck curve
/// its force above it.
#[test]
fn the_order_in_which_numbers_are_set_does_not_count() {
    let (name, text) = cases().remove(0);
    let stage = read(&name, &text, &[]).machine;
    let keys =
        ["idler_pulley.friction.coulomb", "idler_pulley.friction.static", "drive_pulley.friction.stribeck.force"];
    let keys = [&keys[..], &["drive_pulley.friction.coulomb"]].concat();
    let free: Vec<Free> = keys.iter().map(|key| Free::new(&stage, key, &keys, &[]).unwrap()).collect();
    let wanted = [0.0625, 0.125, 0.5, 1.0];
    let (mut one, mut other) = (stage.clone(), stage);
    parameter::set(&mut one, free.iter().zip(wanted));
    parameter::set(&mut other, free.iter().zip(wanted).rev());
    assert_eq!(one, other);
    assert_eq!(one.idler_pulley.friction.forward.breakaway, 0.125);
    assert_eq!(one.drive_pulley.friction.forward.breakaway, 1.5);
}

/// A key that this machine has not, or that is no number of a machine, is refused with what there is instead.
#[test]
fn keys_that_cannot_be_free_say_what_can() {
    let whole = read(&cases()[0].0, &cases()[0].1, &[]).machine;
    let plain = Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap().machine;
    let told = |stage: &Machine, key: &str| Free::new(stage, key, &[], &[]).unwrap_err().to_string();
    assert_eq!(
        told(&plain, "cart.friction.lugre.stiffness"),
        "`cart.friction.lugre.stiffness` has no value in this case\n  \
         allowed: cart.friction.viscous, cart.friction.coulomb, cart.friction.static, cart.friction.viscous_backward, \
         cart.friction.coulomb_backward, cart.friction.static_backward\n  next: give it one to start from, such as stiffness = \"100 kN/m\" in cart.friction.lugre"
    );
    for (stage, key, part) in [
        (&plain, "belt.modulus", "allowed: belt.stiffness.0, belt.stiffness.1, belt.stiffness.2, belt.damping.0"),
        (&plain, "cart.friction.along.1.factor", "give along to start from"),
        (&plain, "drive_pulley.teeth", "next: name `drive_pulley.radius` instead"),
        (&plain, "controller.every", "is not a number of the machine"),
        (&plain, "cart.friction", "is not a parameter of the machine"),
        (&plain, "cart.mass.0", "next: did you mean `cart.mass`?"),
        (&plain, "", "is not a parameter of the machine"),
        (&plain, "total.mass", "allowed: total.viscous, total.coulomb, total.inertia, total.stiffness"),
        (&whole, "belt.stiffness.3", "allowed: belt.stiffness.0 to belt.stiffness.2"),
        (
            &whole,
            "cart.friction.along.3.factor",
            "allowed: cart.friction.along.0.factor to cart.friction.along.2.factor",
        ),
        (&plain, "cart.force_along.1.force", "give force_along to start from"),
        (&plain, "cart.force_by_speed.force", "give force_by_speed to start from"),
        (&whole, "cart.force_by_speed.2.force", "allowed: cart.force_by_speed.0.force to cart.force_by_speed.1.force"),
        (&whole, "cart.friction.along.factor.1", "allowed: cart.friction.along.0.factor to"),
        (&whole, "drive_pulley.friction.static", "next: it follows from coulomb and stribeck.force: name one of these"),
        (&plain, "belt.spans.1", "next: name one of these, or give modulus, section and spans instead of stiffness"),
        (&plain, "travel.max", "next: give it one to start from, such as max = \"0.3 m\" in travel"),
    ] {
        let told = told(stage, key);
        assert!(told.contains(part), "{key}: {told}");
    }
    let made = read(&cases()[1].0, &cases()[1].1, &[]).machine;
    assert!(
        told(&made, "belt.stiffness.0").contains("next: it follows from modulus, section and spans: name one of these")
    );
}

/// Numbers off by a share: a factor on the value, with the numbers that are tied by nature.
#[test]
fn numbers_that_are_off_keep_their_ties() {
    for (name, text) in cases() {
        let stage = read(&name, &text, &[]).machine;
        let mut seen: Vec<String> = Vec::new();
        for kind in kinds(&stage) {
            let mut off = stage.clone();
            kind.set(&mut off, 1.5);
            let changed: Vec<String> = values(&off)
                .into_iter()
                .zip(values(&stage))
                .filter(|((key, _), _)| !matches!(named(key).unwrap().field, Field::Form(..)))
                .filter(|((_, new), (_, old))| new != old)
                .map(|((key, new), (_, old))| {
                    assert_eq!(new, 1.5 * old, "{key}");
                    assert_eq!(named(&key).unwrap().off, Off::With(named_kind(&key)), "{key}");
                    key
                })
                .collect();
            assert!(!changed.is_empty(), "{}", kind.name);
            assert!(changed.iter().all(|key| named_kind(key) == kind.name), "{changed:?}");
            seen.extend(changed);
        }
        for key in every(&stage) {
            assert!(seen.contains(&key) || named(&key).unwrap().off == Off::Alone, "{key}");
        }
    }
}

fn named_kind(key: &str) -> &'static str {
    match named(key).unwrap().off {
        Off::With(kind) => kind,
        _ => "",
    }
}

/// Keys that other rows name are there, and friction is tied alike on all bodies.
#[test]
fn the_table_is_of_one_piece() {
    let axis = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
    let text = gantry_template(MachineKind::CoreXy);
    let gantry = Case::from_text_with("gantry.toml", &text, &[]).unwrap().machine;
    let row = |key: &str| -> &'static Parameter { parameter::find(key).unwrap_or_else(|| panic!("no row {key}")) };
    for parameter in all() {
        for key in parameter.follows {
            assert_eq!((row(key).unit, row(key).range), (parameter.unit, parameter.range), "{}", parameter.key);
        }
        match parameter.field {
            Field::Form(of, _) | Field::PartOf(of) => assert!(matches!(row(of).field, Field::Machine(_)), "{of}"),
            Field::Elsewhere => assert!(parameter.part.is_none(), "{}", parameter.key),
            Field::Machine(_) => {}
        }
        let is_elsewhere = matches!(parameter.field, Field::Elsewhere);
        assert!(parameter.off == Off::No || !is_elsewhere, "{}", parameter.key);
        // What only data sheets say: a machine keeps what follows from it, or nothing but what is told of it.
        let sheets =
            ["motor.speed_constant", "motor.rated.", "belt.width", "belt.mass_per_length", "belt.allowed_tension"];
        if sheets.iter().any(|key| parameter.key.starts_with(key)) {
            assert!(is_elsewhere, "{}", parameter.key);
            continue;
        }
        if parameter.key.starts_with("stepper.") {
            // Of a motor that only steppers are.
            assert_ne!(axis.sits(parameter), Sits::Elsewhere, "{}", parameter.key);
            continue;
        }
        let machine = [
            "motor.",
            "drive.",
            "amplifier.",
            "drive_pulley.",
            "idler_pulley.",
            "cart.",
            "belt.",
            "travel.",
            "encoder.",
            "scale.",
        ];
        let is_machine = machine.iter().any(|table| parameter.key.starts_with(table));
        assert_eq!(is_machine, axis.sits(parameter) != Sits::Elsewhere, "{}", parameter.key);
        // The cart of a gantry has the rows of its bridge.
        let tables = ["motor.", "amplifier.", "drive_pulley.", "bridge.", "belt.", "encoder."];
        let is_gantry = tables.iter().any(|table| parameter.key.starts_with(table));
        assert_eq!(is_gantry, gantry.sits(parameter) != Sits::Elsewhere, "{}", parameter.key);
    }
    assert!(free_markdown().contains("| `cart.friction.static` | axis | yes | cart's dry friction | `coulomb` |"));
}

/// The parameters that `--vary all` varies on the paper's machine.
#[test]
fn everything_of_the_papers_machine() {
    let stage = Case::from_text("table4.toml", include_str!("../stages/sollmann-jouaneh/table4.toml")).unwrap().machine;
    let keys = [
        "motor.torque_constant",
        "motor.back_emf_constant",
        "motor.resistance",
        "drive_pulley.radius",
        "drive_pulley.inertia",
        "idler_pulley.inertia",
        "cart.mass",
        "belt.stiffness.0",
        "belt.stiffness.1",
        "belt.stiffness.2",
        "drive_pulley.friction.viscous",
        "drive_pulley.friction.coulomb",
        "cart.friction.viscous",
        "cart.friction.coulomb",
        "idler_pulley.friction.viscous",
        "idler_pulley.friction.coulomb",
    ];
    assert_eq!(every(&stage), keys);
    let kinds: Vec<String> = kinds(&stage).into_iter().map(|kind| kind.name).collect();
    let names = [
        "motor constants",
        "resistance",
        "pulleys' inertia",
        "pulleys' viscous friction",
        "pulleys' dry friction",
        "mass",
        "cart's viscous friction",
        "cart's dry friction",
        "belt's stiffness",
    ];
    assert_eq!(kinds, names);
}

/// A stage that a program built by itself has to keep the ranges of the case file.
#[test]
fn numbers_out_of_their_ranges_are_refused_by_their_keys() {
    for (name, text) in cases() {
        let stage = read(&name, &text, &[]).machine;
        parameter::check(&stage).unwrap();
        for (key, _) in values(&stage) {
            let row = named(&key).unwrap();
            if matches!(row.field, Field::Form(..)) {
                continue;
            }
            let free = Free::new(&stage, &key, &[], &[]).unwrap();
            for value in [row.range.low - 1.0, 2.0 * row.range.high.max(1.0), f64::NAN, f64::INFINITY] {
                let mut other = stage.clone();
                free.set(&mut other, value);
                // A breakaway is raised to Coulomb friction.
                let raised = (key.contains(".static") || key.ends_with(".force")) && (value.is_nan() || value < 0.0);
                match parameter::check(&other) {
                    Ok(()) => assert!(raised, "{key} = {value}"),
                    Err(error) => assert!(error.what.starts_with(&key) && error.allowed.is_some(), "{error}"),
                }
            }
        }
    }
    let mut stage = Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap().machine;
    stage.drives[0].motor.resistance = -1.0;
    let error = parameter::check(&stage).unwrap_err().to_string();
    assert_eq!(error, "motor.resistance cannot be -1 ohm\n  allowed: from 1e-15 ohm to 1e15 ohm");
}

/// `--set` and `Case::value` reach what a free parameter's key names.
#[test]
fn a_point_is_set_by_the_name_of_its_part() {
    let (name, text) = cases().remove(0);
    let case = read(&name, &text, &["cart.friction.along.1.factor=1.5", "cart.friction.along.0.position=-125 cm"]);
    assert_eq!(case.machine.cart.along.as_ref().unwrap().points()[..2], [[-1.25, 1.0], [0.5, 1.5]]);
    assert_eq!(case.value("cart.friction.along.0.position").unwrap(), Given::Number(-1.25));
    assert_eq!(case.value("cart.friction.along.1.1").unwrap(), Given::Number(1.5));
    for (change, part) in [
        ("cart.friction.along.3.factor=1", "there is no element `3`"),
        ("cart.friction.along.1.weight=1", "there is no element `weight`"),
        ("cart.friction.along.factor=1", "there is no element `factor`"),
    ] {
        let error = Case::from_text_with(&name, &text, &[change]).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// A slider that gives a number the value that it has must change nothing but its digits, whatever the text's unit.
#[test]
fn each_number_of_each_bundled_machine_takes_its_own_value_back() {
    let cases = [
        "sollmann-jouaneh/table4.toml",
        "sollmann-jouaneh/controllers/pid.toml",
        "printer-axis/printer-axis.toml",
        "laser-gantry/laser-gantry.toml",
        "two-mass/two-mass.toml",
        "h-frame/follows.toml",
        "core-xy/core-xy.toml",
        "dual-belt/dual-belt.toml",
    ];
    for path in cases {
        let path = format!("stages/{path}");
        let case = Case::read_with(&path, &[]).unwrap();
        let numbers = case.numbers().unwrap();
        assert!(numbers.len() > 20, "{path} has {} numbers", numbers.len());
        for number in &numbers {
            let change = number.change(number.value);
            let changed = Case::from_text_with(&path, case.text.as_str(), &[&change]);
            let changed = changed.unwrap_or_else(|e| panic!("{path}: {change}: {e}"));
            let again = changed.numbers().unwrap();
            let again =
                again.iter().find(|other| other.key == number.key).unwrap_or_else(|| panic!("{path}: {change}"));
            let off = (again.value - number.value).abs();
            assert!(off <= 1e-5 * number.value.abs(), "{path}: {change}: {} was {}", again.value, number.value);
            assert!(again.written.is_some(), "{path}: {change}");
        }
    }
}
