//! Cases that read well: the presets, the template, and what `--set` makes of them.

use proptest::prelude::*;
use std::path::Path;
use taut::case::{Case, TEMPLATE};
use taut::friction::Friction;
use taut::machine::axis::CART;
use taut::machine::{AmplifierMode, EncoderPlace};
use taut::signal::{Signal, Slot};

fn preset(name: &str) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/sollmann-jouaneh").join(name);
    Case::read(path).unwrap_or_else(|error| panic!("{error}"))
}

/// The template with `change`s.
fn with(changes: &[&str]) -> Case {
    Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap_or_else(|error| panic!("{error}"))
}

fn told(changes: &[&str]) -> String {
    Case::from_text_with("axis.toml", TEMPLATE, changes).expect_err("an error").to_string()
}

#[test]
fn presets_hold_the_numbers_of_the_tables() {
    let (t1, t2, t4) = (preset("table1.toml"), preset("table2.toml"), preset("table4.toml"));
    assert_eq!(t1.machine.belt.stiffness, [2.6552e5, 2.6552e5, 11.777e4]);
    assert_eq!(t2.machine.belt.stiffness, [1.3276e5, 1.3276e5, 5.8885e4]);
    assert_eq!(t4.machine.belt, t2.machine.belt);
    assert_eq!(t4.machine.drives[0].motor, t1.machine.drives[0].motor);
    assert_eq!(t1.machine.drives[0].motor.torque_constant, 0.023);
    assert_eq!(t1.machine.drives[0].motor.back_emf_constant, 0.023);
    assert_eq!(t1.machine.drives[0].motor.resistance, 0.71);
    assert_eq!((t1.machine.drive_pulley.inertia, t1.machine.idler_pulley.inertia), (7e-5, 7e-5));
    assert_eq!((t4.machine.drive_pulley.inertia, t4.machine.idler_pulley.inertia), (6.3e-5, 6.3e-5));
    assert_eq!(t1.machine.cart.friction, Friction::symmetric(40.6518, 0.0));
    assert_eq!(t1.machine.drive_pulley.friction, Friction::symmetric(0.0042, 0.0));
    assert_eq!(t2.machine.cart.friction, Friction::symmetric(20.3259, 0.0));
    assert_eq!(t2.machine.idler_pulley.friction, Friction::symmetric(0.0021, 0.0));
    assert_eq!(t4.machine.cart.friction, Friction::symmetric(19.0424, 0.2));
    assert_eq!(t4.machine.drive_pulley.friction, Friction::symmetric(0.0016, 0.015));
    for case in [t1, t2, t4] {
        assert_eq!((case.machine.pulley_radius, case.machine.cart.mass), (0.0194, 0.362));
        let names: Vec<String> = case.experiments.iter().map(|e| e.file_name()).collect();
        assert_eq!(names, ["5-v-pulse", "10-v-pulse"]);
        assert_eq!(case.experiments[1].inputs[0], Signal::Pulse { value: 10.0, duration: 0.25, at: 0.0 });
        assert_eq!((case.experiments[0].until, case.experiments[0].every), (1.0, 1e-3));
        assert_eq!(case.experiments[0].samples(), 1001);
    }
}

#[test]
fn the_template_reads() {
    let case = with(&[]);
    assert_eq!(case.title, "My axis");
    assert_eq!(case.experiments.len(), 2);
    assert_eq!(case.machine.encoder.map(|e| (e.at, e.lines)), Some((EncoderPlace::Motor, 512.0)));
    assert_eq!(case.text, TEMPLATE);
}

#[test]
fn every_remark_of_the_template_that_shows_a_line_is_a_line() {
    let mut shown = TEMPLATE.to_string();
    for key in ["inductance", "rotor_inertia", "gear_ratio", "gear_efficiency", "damping"] {
        assert!(shown.contains(&format!("\n# {key} ")), "{key}");
        shown = shown.replace(&format!("\n# {key} "), &format!("\n{key} "));
    }
    assert!(Case::from_text("axis.toml", &shown).is_ok_and(|case| case.machine == with(&[]).machine));
    let recorded = ["[measurement]", "delay = \"0 s\"", "motor_current "]
        .iter()
        .fold(TEMPLATE.to_string(), |t, k| t.replace(&format!("\n# {k}"), &format!("\n{k}")));
    assert!(Case::from_text("axis.toml", &recorded).unwrap().measurement.is_some_and(|m| m.channels.len() == 1));

    // The closed loop stands at the end, all of it remarks.
    let (before, after) = TEMPLATE.split_once("\n# [controller]\n").unwrap();
    let looped: String = after.lines().map(|line| format!("{}\n", line.trim_start_matches("# "))).collect();
    let looped =
        Case::from_text("axis.toml", &format!("{before}\n[controller]\n{}", looped.replace("#\n", "\n"))).unwrap();
    assert!(looped.controller.is_some() && looped.moves.len() == 1);

    let made = TEMPLATE.replace("\nstiffness", "\n# stiffness");
    let made =
        ["modulus", "section", "spans"].iter().fold(made, |t, k| t.replace(&format!("\n# {k} "), &format!("\n{k} ")));
    let k = Case::from_text("axis.toml", &made).unwrap().machine.belt.stiffness;
    assert!((k[0] / 1.3276e5 - 1.0).abs() < 1e-4 && (k[2] / 5.8885e4 - 1.0).abs() < 1e-4, "{k:?}");
}

#[test]
fn set_changes_the_text_and_keeps_its_remarks() {
    let case = with(&["cart.mass=0.5 kg", "experiment.1.until=2s", "motor.gear_ratio=5.9"]);
    assert_eq!(case.machine.cart.mass, 0.5);
    assert_eq!(case.experiments[1].until, 2.0);
    assert_eq!(case.machine.drives[0].motor.gear_ratio, 5.9);
    assert!(case.text.contains("mass     = \"0.5 kg\"                # with its load"), "{}", case.text);
    let again = Case::from_text("axis.toml", &case.text).unwrap();
    assert_eq!((again.machine, again.text), (case.machine, case.text));
}

#[test]
fn set_reaches_lists_inline_tables_and_what_is_not_there_yet() {
    let case = with(&[
        "belt.stiffness=[1e5, \"2 kN/m\", 3]",
        "belt.stiffness.2=4 N/m",
        "cart.friction.static=\"0.3 N\"",
        "drive_pulley.friction.coulomb_backward=0.02",
        "experiment.\"5 V pulse\".initial.cart_position=12 mm",
        "experiment.0.input={ step = \"2 V\", at = 0.1 }",
        "title=\"Another axis\"",
    ]);
    assert_eq!(case.machine.belt.stiffness, [1e5, 2e3, 4.0]);
    assert_eq!(case.machine.cart.friction, Friction::with_breakaway(19.0, 0.2, 0.3));
    assert_eq!(case.machine.drive_pulley.friction.backward.breakaway, 0.02);
    assert_eq!(case.machine.drive_pulley.friction.forward.breakaway, 0.015);
    assert_eq!(case.experiments[0].initial.position[CART], 0.012);
    assert_eq!(case.experiments[0].inputs[0], Signal::Step { value: 2.0, at: 0.1 });
    assert_eq!(case.title, "Another axis");
    let again = Case::from_text("axis.toml", &case.text).unwrap();
    assert_eq!((again.machine, again.text), (case.machine, case.text));
}

#[test]
fn set_makes_missing_tables() {
    let (begin, end) = (TEMPLATE.find("[amplifier]").unwrap(), TEMPLATE.find("# ── The mechanics").unwrap());
    let text = format!("{}{}", &TEMPLATE[..begin], &TEMPLATE[end..]);
    let case = Case::from_text_with("axis.toml", &text, &["amplifier.gain=2"]).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        (case.machine.drives[0].amplifier.gain, case.machine.drives[0].amplifier.mode),
        (2.0, AmplifierMode::Voltage)
    );
}

#[test]
fn mistakes_in_a_set_value_say_so() {
    let shown = |change| told(&[change]);
    assert_eq!(
        shown("cart.mass=-1 kg"),
        "--set:1:11: cart.mass: -1 kg has to be above zero\n  1 | cart.mass=-1 kg\n    |           ^^^^^\n  allowed: from 1e-15 kg to 1e15 kg"
    );
    assert_eq!(
        shown("cart.mas=1 kg"),
        "--set:1:10: `cart` has no key `mas`\n  1 | cart.mas=1 kg\n    |          ^^^^\n  allowed: mass, load, inclination, friction, force_along, force_by_speed\n  next: did you mean `mass`?"
    );
    assert_eq!(
        shown("cart.mass"),
        "--set:1:1: there is no `=`\n  1 | cart.mass\n    | ^^^^^^^^^\n  next: write KEY=VALUE, such as --set cart.mass=\"0.5 kg\" or --set experiment.0.until=2s"
    );
    assert_eq!(
        shown("experiment.7.until=2s"),
        "--set:1:1: there is no element `7`\n  1 | experiment.7.until=2s\n    | ^^^^^^^^^^^^^^^^^^\n  allowed: 0 to 1, or the name of an experiment in quotes"
    );
    assert_eq!(
        shown("belt.stiffness=[1 N/m]"),
        "--set:1:16: this list, table or text is not complete\n  1 | belt.stiffness=[1 N/m]\n    |                ^^^^^^^\n  next: put texts inside it in quotes: [\"1 kN/m\", \"2 kN/m\"]"
    );
    assert!(shown("cart.mass.x=1").contains("`x` cannot be set"));
    assert!(shown("=1").contains("is no key"));
    assert!(shown("title=2").contains("expected a text, found a number"));
}

/// Lists of any length that fits the file are read in reasonable time; longer files are refused.
#[test]
fn large_files() {
    let points: Vec<String> = (0..200_000).map(|i| format!("[{i}, 1]")).collect();
    let long = TEMPLATE.replace(
        "{ pulse = \"5 V\", for = \"0.25 s\" }\nuntil",
        &format!("{{ table = [{}] }}\nuntil", points.join(",")),
    );
    let case = Case::from_text("axis.toml", &long).unwrap();
    assert!(matches!(&case.experiments[0].inputs[0], Signal::Table { points } if points.len() == 200_000));

    let one = TEMPLATE.split("[[experiment]]").nth(1).unwrap();
    let many: String =
        (0..20_000).map(|i| format!("[[experiment]]{}", one.replace("5 V pulse", &format!("run {i}")))).collect();
    let case = Case::from_text("axis.toml", &format!("{TEMPLATE}\n{many}")).unwrap();
    assert_eq!(case.experiments.len(), 20_002);

    let padded = format!("{TEMPLATE}#{}", " ".repeat(17 << 20));
    let error = Case::from_text("axis.toml", &padded).unwrap_err();
    assert_eq!(error.what, "this case file is too large");
}

/// The template's first input replaced by `input`.
fn input(input: &str) -> Signal {
    with(&[&format!("experiment.0.input={input}")]).experiments[0].inputs[0].clone()
}

#[test]
fn every_kind_of_input() {
    assert_eq!(input("{ step = 5 }"), Signal::Step { value: 5.0, at: 0.0 });
    assert_eq!(input("{ ramp = '1.2 V', over = '1 s' }"), Signal::Ramp { value: 1.2, over: 1.0, at: 0.0 });
    assert_eq!(input("{ triangle = 3, frequency = '2 Hz' }"), Signal::Triangle { amplitude: 3.0, frequency: 2.0 });
    assert_eq!(
        input("{ square = 3, frequency = 2, duty = '25 %' }"),
        Signal::Square { amplitude: 3.0, frequency: 2.0, duty: 0.25 }
    );
    let phase = std::f64::consts::FRAC_PI_2;
    assert_eq!(
        input("{ sine = 3, frequency = 2, phase = '90 deg', offset = '-500 mV' }"),
        Signal::Sine { amplitude: 3.0, frequency: 2.0, phase, offset: -0.5 }
    );
    assert_eq!(
        input("{ chirp = 2, from = 1, to = '0.3 kHz', over = 10 }"),
        Signal::Chirp { amplitude: 2.0, from: 1.0, to: 300.0, over: 10.0 }
    );
    assert_eq!(input("{ prbs = 3, bit = '20 ms', seed = 7 }"), Signal::Prbs { amplitude: 3.0, bit: 0.02, seed: 7 });
    // Above 2⁵³ they were refused; as doubles the first two would be one.
    for seed in ["9007199254740992", "9007199254740993", "9223372036854775807"] {
        let whole = seed.parse().unwrap();
        for text in [seed.to_string(), format!("'{seed}'")] {
            let signal = input(&format!("{{ prbs = 3, bit = '20 ms', seed = {text} }}"));
            assert_eq!(signal, Signal::Prbs { amplitude: 3.0, bit: 0.02, seed: whole });
        }
    }
    assert_eq!(
        input("{ prbs = 3, bit = 1, seed = 1e9 }"),
        Signal::Prbs { amplitude: 3.0, bit: 1.0, seed: 1_000_000_000 }
    );
    assert_eq!(
        input("{ table = [[0, 0], ['100 ms', '5 V']] }"),
        Signal::Table { points: vec![[0.0, 0.0], [0.1, 5.0]] }
    );
    let pulse = Signal::Pulse { value: 5.0, duration: 0.25, at: 0.5 };
    let step = Signal::Step { value: 1.0, at: 0.0 };
    assert_eq!(
        input("{ sum = [{ pulse = 5, for = 0.25, at = 0.5 }, { step = 1 }] }"),
        Signal::Sum(vec![pulse.clone(), step.clone()])
    );
    let slot = |signal: &Signal, lasts| Slot { signal: signal.clone(), lasts };
    assert_eq!(
        input("{ sequence = [{ pulse = 5, for = 0.25, at = 0.5 }, { step = 1, lasts = '1 s' }, { step = 1 }] }"),
        Signal::sequence(vec![slot(&pulse, 0.75), slot(&step, 1.0), slot(&step, f64::INFINITY)])
    );
    let ended = input("{ sequence = [{ step = 1, lasts = 1 }] }");
    let zero = Signal::Step { value: 0.0, at: 0.0 };
    assert_eq!(ended, Signal::sequence(vec![slot(&step, 1.0), slot(&zero, f64::INFINITY)]));
}

#[test]
fn a_multisine_has_schroeders_phases() {
    let Signal::Multisine { tones } = input("{ multisine = 0.5, from = 1, to = 3, tones = 3 }") else { panic!() };
    let frequencies: Vec<f64> = tones.iter().map(|t| t.frequency).collect();
    assert_eq!(frequencies, [1.0, 2.0, 3.0]);
    let pi = std::f64::consts::PI;
    for (tone, phase) in tones.iter().zip([0.0, -2.0 * pi / 3.0, -2.0 * pi]) {
        assert!((tone.phase - phase).abs() < 1e-15 && tone.amplitude == 0.5);
    }
    let Signal::Multisine { tones } = input("{ multisine = 1, frequencies = ['1 Hz', 7] }") else { panic!() };
    assert_eq!((tones[0].frequency, tones[1].frequency), (1.0, 7.0));
}

#[test]
fn a_pulley_and_a_belt_by_what_they_are_made_of() {
    let case = with(&[
        "drive_pulley={ teeth = 60, pitch = '0.08 in', inertia = { outer_diameter = '38 mm', width = '10 mm', density = '2.7 g/cm^3' } }",
        "belt={ modulus = [{ share = '2/3', modulus = '6 MPa' }, { share = '1/3', modulus = '50 GPa' }], section = { plain = '5.5626 mm^2', toothed = '50 mm^2', toothed_share = 0.5 }, spans = ['13.75 in', '13.75 in', '31 in'] }",
    ]);
    assert!((case.machine.pulley_radius - 60.0 * 2.032e-3 / (2.0 * std::f64::consts::PI)).abs() < 1e-16);
    let make = case.machine.belt.make.expect("a make");
    assert!((make.modulus / (2.0 / 3.0 * 6e6 + 50e9 / 3.0) - 1.0).abs() < 1e-15);
    assert!((make.section / (1.0 / (0.5 / 50e-6 + 0.5 / 5.5626e-6)) - 1.0).abs() < 1e-15);
    assert_eq!(make.spans, [0.34925, 0.34925, 0.7874]);
    assert!((case.machine.drive_pulley.inertia / 5.527e-6 - 1.0).abs() < 1e-3, "{}", case.machine.drive_pulley.inertia);
}

#[test]
fn a_current_is_commanded_in_amperes() {
    let case =
        with(&["amplifier.mode=current", "experiment.0.input={ step = '2 A' }", "experiment.1.input={ step = 1 }"]);
    assert_eq!(case.experiments[0].inputs[0], Signal::Step { value: 2.0, at: 0.0 });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_text_panics(text in any::<String>()) {
        let _ = Case::from_text("axis.toml", &text);
    }

    #[test]
    fn no_damage_to_the_template_panics(at in 0..TEMPLATE.len(), length in 0..40_usize, new in ".{0,8}") {
        let at = TEMPLATE.floor_char_boundary(at);
        let end = TEMPLATE.floor_char_boundary((at + length).min(TEMPLATE.len()));
        let text = format!("{}{new}{}", &TEMPLATE[..at], &TEMPLATE[end..]);
        if let Err(error) = Case::from_text("axis.toml", &text) {
            prop_assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn no_set_panics(key in "[a-z_.0-9\"]{0,20}", value in ".{0,12}") {
        let _ = Case::from_text_with("axis.toml", TEMPLATE, &[&format!("{key}={value}")]);
    }

    #[test]
    fn known_keys_take_any_value_without_panic(
        key in prop::sample::select(vec!["cart.mass", "cart", "belt", "belt.stiffness", "belt.stiffness.0", "experiment", "experiment.0", "experiment.0.input", "experiment.0.name", "title", "motor.friction"]),
        value in prop::sample::select(vec!["1", "nan", "[]", "{}", "[[]]", "true", "1979-05-27", "''", "{ sum = [{ sum = [] }] }", "[{}]", "-1e400", "{ table = [[0]] }", "{ step = '1 V', lasts = 1 }"]),
    ) {
        let _ = Case::from_text_with("axis.toml", TEMPLATE, &[&format!("{key}={value}")]);
    }
}
