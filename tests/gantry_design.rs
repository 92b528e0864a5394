//! Experiments designed for gantries: what they promise holds on simulated logs, they keep their limits, and they drive
//! the motors that tell most.

use taut::case::Case;
use taut::fit::experiment_design::{Driven, Excitation, Request, design, verify};
use taut::log::Quantity;
use taut::machine::Channel;
use taut::solve::{Solver, simulate};

const CORE_XY: &str = "stages/core-xy/core-xy.toml";
const DUAL_BELT: &str = "stages/dual-belt/dual-belt.toml";

fn request(names: &[&str], measured: &[Quantity]) -> Request {
    let channel = |&quantity: &Quantity| Channel { quantity, step: None, noise: 2e-3, range: None };
    Request {
        names: names.iter().map(|name| name.to_string()).collect(),
        kinds: vec![Excitation::Trapezoid],
        duration: 1.0,
        doubt: 0.1,
        input: Some(6.0),
        measured: measured.iter().map(channel).collect(),
        ..Request::default()
    }
}

const ANGLES: [Quantity; 2] = [Quantity::LeftAngle, Quantity::RightAngle];

/// The truth is known: fits of simulated logs are off by as much as was promised, and their own intervals hold it.
#[test]
fn promises_hold_on_simulated_logs_of_both_motors() {
    let case = Case::read(CORE_XY).unwrap();
    let names = ["bridge.mass", "cart.mass", "bridge.friction.viscous", "cart.friction.viscous"];
    let request = Request { doubt: 0.0, ..request(&names, &ANGLES) };
    let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
    assert!(found.promises.iter().all(|promise| promise.is_determined()), "{:?}", found.promises);
    // One motor alone moves both.
    assert!(["left", "right"].contains(&found.driven.name), "{:?}", found.driven);
    let logs = 24;
    for one in verify(&case, &request, &found, logs, &|| false).unwrap() {
        println!("{one:?}");
        // √χ²/n of 24 values keeps to this with 99.9 %; the mean to 3.3/√24.
        assert!((0.57..1.49).contains(&one.ratio), "{one:?}");
        assert!(one.bias.abs() < 0.68 && one.coverage > 0.78 && one.fits == logs, "{one:?}");
    }
}

/// A written design reads back; its run keeps the limits of bridge and cart and is centred in both.
#[test]
fn what_is_written_keeps_the_limits_of_both() {
    let case = Case::read(CORE_XY).unwrap();
    let request = Request { travel: Some(0.3), driven: vec!["left".into()], ..request(&["cart.mass"], &ANGLES) };
    let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
    let text = found.case_text(&case, "designed.toml".as_ref()).unwrap();
    assert!(text.contains("input = { left = {"), "{text}");
    let read = Case::from_text("designed.toml", &text).unwrap();
    let run = simulate(&case.machine, read.experiments.last().unwrap(), Solver::Exact).unwrap().trajectory;
    for (slide, name) in ["bridge_position", "cart_position"].into_iter().enumerate() {
        let values = run.get(name).unwrap();
        let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().reduce(pick).unwrap());
        let [least, most] = found.reached.positions[slide];
        assert!((low - least).abs() < 1e-9 && (high - most).abs() < 1e-9, "{name}: {low} {high}");
        assert!(high - low <= 0.9 * 0.3 * 1.002 && (high + low).abs() < 2e-3, "{name}: {low} {high}");
    }
}

/// A side of a dual belt moves the bridge with the cart on it, and tells the sum of both masses; all motors tell each.
#[test]
fn all_motors_of_a_dual_belt() {
    let case = Case::read(DUAL_BELT).unwrap();
    let measured = [Quantity::LeftAngle, Quantity::RightAngle, Quantity::CartPulleyAngle];
    let all = request(&["bridge.mass", "cart.mass"], &measured);
    let found = design(&case, &all, &|| false, &mut |_| {}).unwrap();
    assert!(found.driven.name == "all" && found.promises.iter().all(|one| one.is_determined()), "{:?}", found.driven);
    let left = Request { driven: vec!["left".into()], ..all };
    let found = design(&case, &left, &|| false, &mut |_| {}).unwrap();
    assert!(found.promises.iter().all(|one| !one.is_determined()), "{:?}", found.promises);
    assert_eq!(found.undetermined[0].0.members.len(), 2);
}

#[test]
fn what_can_be_driven() {
    let names = |file: &str| -> Vec<(&'static str, Vec<f64>)> {
        let all = Driven::all(&Case::read(file).unwrap().machine);
        all.into_iter().map(|one| (one.name, one.signs)).collect()
    };
    let of_core_xy =
        [("left", vec![1.0, 0.0]), ("right", vec![0.0, 1.0]), ("bridge", vec![1.0, 1.0]), ("cart", vec![1.0, -1.0])];
    assert_eq!(names(CORE_XY), of_core_xy);
    let of_h_frame =
        [("left", vec![1.0, 0.0]), ("right", vec![0.0, 1.0]), ("bridge", vec![-1.0, 1.0]), ("cart", vec![-1.0, -1.0])];
    assert_eq!(names("stages/h-frame/h-frame.toml"), of_h_frame);
    let of_dual_belt: Vec<&str> = names(DUAL_BELT).into_iter().map(|(name, _)| name).collect();
    assert_eq!(of_dual_belt, ["left", "right", "cart", "bridge", "all"]);
    assert_eq!(names("stages/sollmann-jouaneh/table4.toml"), [("", vec![1.0])]);
}

#[test]
fn what_cannot_be_designed_is_told() {
    let case = Case::read_with(CORE_XY, &["amplifier.voltage_limit=12 V"]).unwrap();
    let told = |case: &Case, request: &Request| design(case, request, &|| false, &mut |_| {}).unwrap_err().to_string();
    let one = Request { input: None, ..request(&["cart.mass"], &ANGLES) };
    let beyond = told(&case, &Request { input: Some(20.0), ..one.clone() });
    assert!(beyond.contains("beyond what the amplifier gives") && beyond.contains("up to 12"), "{beyond}");
    let far = told(&case, &Request { travel: Some(0.6), ..one.clone() });
    assert!(far.contains("0.6 m is more than the travel of the case"), "{far}");
    let nowhere = told(&case, &Request { driven: vec!["idler".into()], ..one.clone() });
    assert!(nowhere.contains("`idler` is nothing that an input can go to") && nowhere.contains("bridge"), "{nowhere}");
    let angle = told(&case, &request(&["cart.mass"], &[Quantity::DriveAngle]));
    assert!(angle.contains("`drive_angle` is no measured quantity of this machine"), "{angle}");
    let input =
        "experiment=[{ name = \"one\", input = { left = { step = \"1 V\" } }, until = \"1 s\", every = \"1 ms\" }]";
    let mixed = Case::read_with(CORE_XY, &["right_drive.amplifier.mode=current", input]).unwrap();
    assert!(told(&mixed, &one).contains("amplifiers of one mode"), "{}", told(&mixed, &one));
    let stepper = Case::read("stages/stepper-axis/stepper-axis.toml").unwrap();
    let stepper = told(&stepper, &request(&["cart.mass"], &[Quantity::DriveAngle]));
    assert!(stepper.contains("a motor that is commanded by voltage or current"), "{stepper}");
}
