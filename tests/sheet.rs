//! Machines that are given by data sheets: ratings, belts by their type, drives by their force, damping as a ratio.

use crate::common;
use std::f64::consts::TAU;
use taut::case::{Case, TEMPLATE, gantry_template};
use taut::linear::{Natural, undamped};
use taut::log::{Log, Output, Quantity, Survey};
use taut::machine::{BeltModel, Machine, MachineKind, SimpleDrive, slowest_swing};
use taut::parameter::{Free, set, value};
use taut::signal::Hold;

/// The template with another table in the place of one of its own.
fn with(table: &str, other: &str) -> Machine {
    read(table, other).unwrap_or_else(|error| panic!("{error}")).machine
}

fn read(table: &str, other: &str) -> taut::Result<Case> {
    let begin = TEMPLATE.find(&format!("\n[{table}]")).unwrap() + 1;
    let end = begin + TEMPLATE[begin..].find("\n[").unwrap();
    Case::from_text("axis.toml", &format!("{}{other}{}", &TEMPLATE[..begin], &TEMPLATE[end..]))
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} and {b}");
}

#[test]
fn a_speed_constant_is_both_constants() {
    let motor = with("motor", "[motor]\nspeed_constant = \"415 rpm/V\"\nresistance = \"0.71 ohm\"\n").drives[0].motor;
    // 1/K_v with 415 rpm/V = 415 2π/60 rad/s per volt
    near(motor.torque_constant, 60.0 / (415.0 * TAU));
    near(motor.back_emf_constant, motor.torque_constant);
    assert_eq!(motor.resistance, 0.71);
}

#[test]
fn what_is_given_itself_counts_before_what_follows() {
    let text = "[motor]\nspeed_constant = \"415 rpm/V\"\ntorque_constant = 0.02\nresistance = 1\n";
    let motor = with("motor", text).drives[0].motor;
    assert_eq!(motor.torque_constant, 0.02);
    near(motor.back_emf_constant, 60.0 / (415.0 * TAU));
    let text = "[motor]\nspeed_constant = 40\nrated = { voltage = 24, speed = 300, torque = 0.3, current = 6 }\n";
    let motor = with("motor", text).drives[0].motor;
    assert_eq!((motor.torque_constant, motor.back_emf_constant), (0.025, 0.025));
    // (24 − 0.025 · 300) / 6
    near(motor.resistance, 2.75);
}

#[test]
fn a_rating_is_met_by_the_motor_that_it_gives() {
    let rating = "rated = { voltage = \"24 V\", speed = \"3000 rpm\", torque = \"0.32 N m\", current = \"5.5 A\", no_load_current = \"0.4 A\" }";
    let speed = 3000.0 * TAU / 60.0;
    for (more, resistance) in [("", None), ("resistance = 0.71\n", Some(0.71))] {
        let motor = with("motor", &format!("[motor]\n{rating}\n{more}")).drives[0].motor;
        // The torque at the shaft is that of the current beyond the idle one, and the voltage is used up.
        near(motor.torque_constant * (5.5 - 0.4), 0.32);
        near(motor.resistance * 5.5 + motor.back_emf_constant * speed, 24.0);
        match resistance {
            Some(given) => assert_eq!(motor.resistance, given),
            None => near(motor.back_emf_constant, motor.torque_constant),
        }
    }
}

#[test]
fn both_drives_of_a_gantry_take_data_sheets() {
    let text = gantry_template(MachineKind::CoreXy);
    let begin = text.find("\n[motor]").unwrap() + 1;
    let end = begin + text[begin..].find("\n[").unwrap();
    let text = format!(
        "{}[motor]\nspeed_constant = 50\nresistance = 1\n[left_drive.motor]\nspeed_constant = 40\n{}",
        &text[..begin],
        &text[end..]
    );
    let gantry = Case::from_text_with("gantry.toml", &text, &[]).unwrap().machine;
    near(gantry.drives[0].motor.torque_constant, 1.0 / 40.0);
    near(gantry.drives[1].motor.back_emf_constant, 1.0 / 50.0);
}

#[test]
fn a_belt_by_its_type_is_one_of_its_specific_stiffness() {
    const SPANS: &str = "spans = [0.3, 0.4, 0.7]\n";
    let typed = with("belt", &format!("[belt]\ntype = \"at5\"\nwidth = \"16 mm\"\n{SPANS}")).belt;
    let whole = with("belt", &format!("[belt]\nspecific_stiffness = \"280 kN\"\n{SPANS}")).belt;
    let share = with("belt", &format!("[belt]\nspecific_stiffness = \"17.5 kN/mm\"\nwidth = \"16 mm\"\n{SPANS}")).belt;
    for belt in [&typed, &whole, &share] {
        near(belt.stiffness[0], 280e3 / 0.3);
        near(belt.stiffness[2], 280e3 / 0.7);
    }
    assert_eq!((typed.sheet.mass_per_length, typed.sheet.allowed_tension), (Some(0.05), Some(1120.0)));
    assert_eq!(whole.sheet.mass_per_length, None);
    // What is given counts before the table.
    let own = format!(
        "[belt]\ntype = \"AT5\"\nwidth = 0.016\nspecific_stiffness = \"200 kN\"\nmass_per_length = 0.06\n{SPANS}"
    );
    let own = with("belt", &own).belt;
    near(own.stiffness[0], 200e3 / 0.3);
    assert_eq!(own.sheet.mass_per_length, Some(0.06));
    // A stiffness that was measured stays, and the type says the rest.
    let given = with("belt", "[belt]\ntype = \"GT2\"\nwidth = 0.006\nstiffness = [1e5, 2e5, 3e5]\n").belt;
    assert!(given.stiffness == [1e5, 2e5, 3e5] && given.make.is_none());
    assert!(given.sheet.allowed_tension.is_some_and(|tension| (tension - 111.2 * 6.0 / 25.4).abs() < 0.1));
}

#[test]
fn a_specific_stiffness_is_free_and_a_modulus_is_not() {
    let mut machine = with("belt", "[belt]\nspecific_stiffness = \"280 kN\"\nspans = [0.3, 0.4, 0.7]\n");
    let free = Free::new(&machine, "belt.specific_stiffness", &[], &[]).unwrap();
    set(&mut machine, [(&free, 140e3)]);
    near(machine.belt.stiffness[1], 140e3 / 0.4);
    for key in ["belt.modulus", "belt.stiffness"] {
        let error = Free::new(&machine, key, &[], &[]).unwrap_err().to_string();
        assert!(error.contains("it follows from specific_stiffness and spans: name one of these"), "{error}");
    }
}

#[test]
fn teeth_take_the_pitch_of_the_belt() {
    let text = TEMPLATE.replace("radius   = \"19.4 mm\"", "teeth = 20");
    let begin = text.find("\n[belt]").unwrap() + 1;
    let end = begin + text[begin..].find("\n[").unwrap();
    let belt = "[belt]\ntype = \"GT2\"\nwidth = \"6 mm\"\nspans = [0.3, 0.3, 0.6]\n";
    let text = format!("{}{belt}{}", &text[..begin], &text[end..]);
    near(Case::from_text("axis.toml", &text).unwrap().machine.pulley_radius, 20.0 * 2e-3 / TAU);
    let same = text.replace("teeth = 20", "teeth = 20\npitch = \"2 mm\"");
    near(Case::from_text("axis.toml", &same).unwrap().machine.pulley_radius, 20.0 * 2e-3 / TAU);
    let other = text.replace("teeth = 20", "teeth = 20\npitch = \"3 mm\"");
    let error = Case::from_text("axis.toml", &other).unwrap_err().to_string();
    assert!(error.contains("drive_pulley.pitch: the belt's type has a pitch of 2 mm"), "{error}");
}

/// The damping ratio of the slowest mode of a machine whose belt alone takes energy.
fn slowest_ratio(machine: &Machine) -> f64 {
    let bare = Machine { belt: machine.belt.clone(), ..undamped(machine) };
    let modes = Natural::new(&bare.mechanism(), &[0.0; 6]).unwrap();
    modes.elastic[0].damping().unwrap()
}

#[test]
fn the_slowest_mode_has_the_damping_ratio_that_was_asked_for() {
    for (model, said) in
        [("elastic", "damping_ratio = 0.03"), ("two-mass", "damping_ratio = 0.03"), ("elastic", "loss_factor = 0.06")]
    {
        let text = format!("[belt]\nstiffness = [132e3, 150e3, 60e3]\nmodel = \"{model}\"\n{said}\n");
        let machine = with("belt", &text);
        assert!((slowest_ratio(&machine) - 0.03).abs() < 1e-9, "{model}: {}", slowest_ratio(&machine));
        // In proportion to the stiffness.
        near(machine.belt.damping[2] / machine.belt.stiffness[2], machine.belt.damping[0] / machine.belt.stiffness[0]);
    }
}

#[test]
fn both_ways_to_the_slowest_swing_agree() {
    for model in [BeltModel::Elastic, BeltModel::TwoMass] {
        let mut machine = common::table4();
        machine.belt.model = model;
        let hertz = Natural::frequencies(&machine.mechanism(), &[0.0; 6]).unwrap()[0];
        near(slowest_swing(&machine.mechanism()).unwrap(), TAU * hertz);
    }
    let mut rigid = common::table4();
    rigid.belt.model = BeltModel::Rigid;
    assert_eq!(slowest_swing(&rigid.mechanism()), None);
    for kind in [MachineKind::HFrame, MachineKind::CoreXy, MachineKind::DualBelt] {
        let gantry = Case::from_text_with("gantry.toml", &gantry_template(kind), &[]).unwrap().machine;
        let hertz = Natural::frequencies(&gantry.mechanism(), &[0.0; 6]).unwrap()[0];
        assert!((slowest_swing(&gantry.mechanism()).unwrap() / (TAU * hertz) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_drive_pushes_with_its_force_and_drags() {
    let mut machine = with("motor", "[drive]\nforce_per_input = \"0.65 N/V\"\ndrag = \"12 N s/m\"\n");
    let drive = SimpleDrive::new(&machine.drives[0].motor, machine.pulley_radius).unwrap();
    near(drive.force, 0.65);
    near(drive.drag, 12.0);
    assert_eq!(
        (value(&machine, "drive.drag").map(f64::round), value(&machine, "motor.resistance")),
        (Some(12.0), None)
    );
    // Both are set, in either order.
    let keys = ["drive.force_per_input", "drive.drag"];
    let [force, drag] = keys.map(|key| Free::new(&machine, key, &keys, &[]).unwrap());
    for order in [[(&force, 2.0), (&drag, 5.0)], [(&drag, 5.0), (&force, 2.0)]] {
        set(&mut machine, order);
        let drive = SimpleDrive::new(&machine.drives[0].motor, machine.pulley_radius).unwrap();
        near(drive.force, 2.0);
        near(drive.drag, 5.0);
    }
    let error = Free::new(&machine, "motor.torque_constant", &[], &[]).unwrap_err().to_string();
    assert!(error.contains("this case has a [drive] instead of [motor]"), "{error}");
}

#[test]
fn counts_are_four_to_a_line() {
    let machine = with("encoder", "[encoder]\nat = \"cart\"\ncounts = 25059.1\n");
    near(machine.encoder.unwrap().counts_per_unit(1.0), 25059.1);
    assert_eq!(value(&machine, "encoder.lines"), Some(25059.1 / 4.0));
}

/// A log of a cart that goes to and fro in steps of an encoder with so many counts per metre.
fn counted(counts: f64) -> Log {
    let time: Vec<f64> = (0..400).map(|k| f64::from(k) * 5e-3).collect();
    let values = time.iter().map(|t| (counts * 0.05 * (1.0 - (2.0 * t).cos())).round() / counts).collect();
    let outputs = vec![Output { quantity: Quantity::CartPosition, absolute: false, values }];
    let input = time.iter().map(|t| 2.0 * (2.0 * t).sin()).collect();
    Log {
        added: None,
        name: "to and fro".into(),
        file: "log.csv".into(),
        time,
        inputs: vec![input],
        hold: Hold::Zero,
        reference: None,
        outputs,
        ended: None,
    }
}

#[test]
fn a_log_that_steps_otherwise_than_the_encoder_is_told() {
    let machine = with("encoder", "[encoder]\nat = \"cart\"\ncounts = 25000\n");
    assert!(!Survey::new(&counted(25000.0), &machine).has("encoder-step"));
    let survey = Survey::new(&counted(6250.0), &machine);
    let note = survey.notes.iter().find(|note| note.code == "encoder-step").unwrap();
    assert_eq!(
        note.text,
        "it moves in steps of 160 µm, and a count of the case's encoder is 40 µm: the steps would be those of 6250 counts per metre; correct \
         encoder.counts (or lines), or the unit or scale of this column"
    );
}
