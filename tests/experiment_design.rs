//! Designed experiments: whether what they promise holds on simulated logs, whether they keep their limits, and what is
//! said where none can be designed.

use taut::case::{Case, TEMPLATE};
use taut::fit::experiment_design::{Criterion, Excitation, Request, Shape, design, verify};
use taut::log::Quantity;
use taut::machine::Channel;
use taut::solve::{Solver, simulate};

fn template() -> Case {
    Case::from_text("axis.toml", TEMPLATE).unwrap()
}

fn request(names: &[&str], kinds: &[Excitation]) -> Request {
    Request {
        names: names.iter().map(|name| name.to_string()).collect(),
        kinds: kinds.to_vec(),
        duration: 1.0,
        ..Request::default()
    }
}

fn noisy(quantity: Quantity, noise: f64) -> Channel {
    Channel { quantity, step: None, noise, range: None }
}

/// The truth is known: fits of simulated logs are off by as much as was promised, and their own intervals hold it.
#[test]
fn promises_hold_on_simulated_logs() {
    let case = template();
    let names = ["cart.mass", "cart.friction.coulomb", "cart.friction.viscous"];
    for kind in [Excitation::Trapezoid, Excitation::Multisine] {
        let measured = vec![noisy(Quantity::DriveAngle, 2e-3)];
        let request = Request { measured, doubt: 0.0, ..request(&names, &[kind]) };
        let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
        assert!(found.promises.iter().all(|promise| promise.is_determined()), "{:?}", found.promises);
        let logs = 40;
        for one in verify(&case, &request, &found, logs, &|| false).unwrap() {
            // √χ²/n of 40 values keeps to this with 99.9 %; the mean to 3.3/√40.
            assert!((0.66..1.38).contains(&one.ratio), "{kind:?}: {one:?}");
            assert!(one.bias.abs() < 0.52, "{kind:?}: {one:?}");
            assert!(one.coverage > 0.82 && one.fits == logs, "{kind:?}: {one:?}");
        }
    }
}

/// Rounding is no white noise: a count that stays is one error, and the promise is no better than what fits find.
#[test]
fn promises_for_an_encoder_alone_are_kept() {
    let case = template();
    let request = Request { doubt: 0.0, ..request(&["cart.mass", "cart.friction.viscous"], &[Excitation::Trapezoid]) };
    let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
    assert_eq!(found.measured.len(), 1);
    for one in verify(&case, &request, &found, 24, &|| false).unwrap() {
        assert!(one.ratio < 1.5 && one.fits == 24, "{one:?}");
    }
}

/// Fits of an elastic belt end in minima beside the truth: the errors were 600 times those of an exact model, in
/// silence.
#[test]
fn a_promise_that_fits_do_not_keep_is_reported() {
    let case = template();
    let request = request(&["cart.mass", "belt.stiffness"], &[Excitation::Prbs]);
    let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
    for one in verify(&case, &request, &found, 4, &|| false).unwrap() {
        let promise = found.promises.iter().find(|promise| promise.name == one.name).unwrap();
        let times = one.ratio * promise.random / promise.error;
        assert_eq!(one.broken(&found), (times > 2.0).then_some(times), "{one:?}");
    }
    let whole =
        |time: f64| (time / request.every.unwrap_or(1e-3) - (time / request.every.unwrap_or(1e-3)).round()).abs();
    let Shape::Prbs { bit, lasts, .. } = found.shape else { panic!("{:?}", found.shape) };
    assert!(whole(bit) < 1e-6 && whole(lasts) < 1e-6, "{bit} s, {lasts} s");
}

/// The truth is another machine each time: estimates are nearer to it than the promise, in which the model's error is,
/// and of the size of that of an exact model.
#[test]
fn promises_hold_on_machines_that_are_off() {
    let case = template();
    let measured = vec![noisy(Quantity::DriveAngle, 2e-3)];
    let request = Request { measured, ..request(&["cart.mass", "cart.friction.coulomb"], &[Excitation::Trapezoid]) };
    let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
    for one in verify(&case, &request, &found, 16, &|| false).unwrap() {
        assert!((0.4..2.0).contains(&one.ratio) && one.fits == 16 && one.coverage > 0.7, "{one:?}");
    }
}

/// A machine alone, without experiment, fit or log.
#[test]
fn a_machine_alone_has_a_design() {
    let machine = TEMPLATE.split("[[experiment]]").next().unwrap();
    let case = Case::from_text("axis.toml", machine).unwrap();
    assert!(case.experiments.is_empty() && case.fit.is_none());
    let limits = Request { input: Some(6.0), travel: Some(0.1), ..request(&["cart.mass"], &[Excitation::Trapezoid]) };
    let found = design(&case, &limits, &|| false, &mut |_| {}).unwrap();
    assert!(found.promises[0].is_determined() && found.own.is_empty() && found.reached.way(0) <= 0.0901);
    let text = found.case_text(&case, "axis.toml".as_ref()).unwrap();
    assert_eq!(Case::from_text("designed.toml", &text).unwrap().experiments.len(), 1);
    assert_eq!(verify(&case, &limits, &found, 2, &|| false).unwrap()[0].fits, 2);
}

/// However quiet the sensor, no standard error is below that of the model.
#[test]
fn no_promise_is_better_than_the_model() {
    let case = template();
    for model_error in [0.0, 0.01, 0.05] {
        let measured = vec![noisy(Quantity::DriveAngle, 1e-6)];
        let request = Request { measured, model_error, ..request(&["cart.mass"], &[Excitation::Trapezoid]) };
        let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
        let [promise] = &found.promises[..] else { panic!("{:?}", found.promises) };
        assert!(promise.random < 1e-3 * promise.value, "{promise:?}");
        assert!((promise.relative - model_error).abs() < 1e-3, "{promise:?}");
        let root = promise.random.hypot(model_error * promise.value);
        assert!((promise.error / root - 1.0).abs() < 1e-9, "{promise:?}");
    }
    let wild = Request { model_error: 1.0, ..request(&["cart.mass"], &[Excitation::Trapezoid]) };
    let told = design(&case, &wild, &|| false, &mut |_| {}).unwrap_err().to_string();
    assert!(told.contains("a model error of 1 cannot be"), "{told}");
}

/// A designed input tells more than the experiments that the case has, in no more time.
#[test]
fn a_design_tells_more_than_a_pulse() {
    let case = template();
    let names = ["cart.mass", "cart.friction.coulomb", "cart.friction.viscous"];
    for criterion in [Criterion::D, Criterion::A] {
        let request = Request { criterion, ..request(&names, &[Excitation::Trapezoid]) };
        let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
        let pulse = found.own.iter().find(|own| own.name == "5 V pulse").unwrap();
        assert!(found.score < 0.6 * pulse.score, "{} {}", found.score, pulse.score);
    }
}

/// Every kind reads back from the text that is written as what was judged, and stays within its limits, also on a
/// machine whose parameters are off.
#[test]
fn what_is_written_is_what_was_judged_and_keeps_its_limits() {
    let travel = "\n[travel]\nmin = \"-20 mm\"\nmax = \"40 mm\"\n";
    let case = Case::from_text("axis.toml", &format!("{TEMPLATE}{travel}")).unwrap();
    for kind in Excitation::ALL {
        let request = Request { duration: 0.6, current: Some(2.0), ..request(&["cart.mass"], &[kind]) };
        let found = design(&case, &request, &|| false, &mut |_| {}).unwrap();
        let text = found.case_text(&case, "axis.toml".as_ref()).unwrap();
        let read = Case::from_text("designed.toml", &text).unwrap();
        let experiment = read.experiments.last().unwrap();
        assert_eq!((&experiment.inputs[0], experiment.until), (&found.shape.signal(), 0.6), "{kind:?}\n{text}");
        for mass in [0.8, 1.0, 1.2] {
            let mut machine = read.machine.clone();
            machine.cart.mass *= mass;
            let run = simulate(&machine, experiment, Solver::for_machine(&machine)).unwrap().trajectory;
            let most = |name: &str| run.get(name).unwrap().iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            assert!(most("motor_current") <= 0.9 * 2.0 * 1.002, "{kind:?}: {}", most("motor_current"));
            let x = run.get("cart_position").unwrap();
            let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
            assert!(high - low <= 0.9 * 0.06 * 1.002 && low > -0.02 && high < 0.04, "{kind:?}: {low} {high}");
        }
        // The middle of the way is the middle of the travel.
        let [low, high] = found.reached.positions[0];
        assert!((0.5 * (low + high) - 0.01).abs() < 1e-3, "{kind:?}: {low} {high}");
    }
}

/// Two frictions that only act together: no input tells them apart, and that is said with what to do.
#[test]
fn what_no_input_can_tell_is_told() {
    let case = template();
    let names = ["cart.friction.viscous", "drive_pulley.friction.viscous", "cart.mass"];
    let request = request(&names, &[Excitation::Trapezoid]);
    let mut machine = case.clone();
    machine.machine.belt.model = taut::machine::BeltModel::Rigid;
    machine.machine.drive_pulley.friction = taut::friction::Friction::symmetric(1e-3, 1e-3);
    let found = design(&machine, &request, &|| false, &mut |_| {}).unwrap();
    let determined: Vec<bool> = names
        .iter()
        .map(|name| found.promises.iter().find(|promise| promise.name == *name).unwrap().is_determined())
        .collect();
    assert_eq!(determined, [false, false, true], "{:?}", found.promises);
    let (group, choices) = &found.undetermined[0];
    assert_eq!(group.members.len(), 2);
    assert!(group.words.contains("only the combination") && choices[0].contains("fix one"), "{group:?} {choices:?}");
}

/// A search that is ended gives the best so far, or says that there is none.
#[test]
fn a_search_that_is_ended_says_what_it_has() {
    let request = request(&["cart.mass"], &[]);
    let error = design(&template(), &request, &|| true, &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("the search was ended before any input was found"), "{error}");
    let calls = std::sync::atomic::AtomicUsize::new(0);
    let stop = || calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 20;
    let found = design(&template(), &request, &stop, &mut |_| {}).unwrap();
    assert!(found.interrupted && found.alternatives.len() < Excitation::ALL.len(), "{:?}", found.alternatives);
}

#[test]
fn what_cannot_be_designed_is_told() {
    let case = template();
    let told = |case: &Case, request: &Request| design(case, request, &|| false, &mut |_| {}).unwrap_err().to_string();
    let one = request(&["cart.mass"], &[Excitation::Trapezoid]);
    let nothing = Request { names: Vec::new(), ..one.clone() };
    assert!(told(&case, &nothing).contains("there is nothing to determine: the case has no [fit]"));
    let unknown = request(&["cart.mas"], &[]);
    assert!(told(&case, &unknown).contains("`cart.mas`"), "{}", told(&case, &unknown));
    let mut blind = case.clone();
    blind.machine.encoder = None;
    assert!(told(&blind, &one).contains("nothing is measured in this case"));
    let mut endless = case.clone();
    endless.experiments.clear();
    assert!(told(&endless, &one).contains("the input is unlimited"));
    let amplitude = Request { input: Some(5.0), ..one.clone() };
    assert!(told(&endless, &amplitude).contains("the travel of the cart is unlimited"));
    let mut limited = case.clone();
    limited.machine.drives[0].amplifier.voltage_limit = Some(12.0);
    let beyond = Request { input: Some(20.0), ..one.clone() };
    assert!(told(&limited, &beyond).contains("an input of 20 is beyond what the amplifier gives"));
    let short = Request { duration: 5e-3, ..one.clone() };
    assert!(told(&case, &short).contains("an experiment of 0.005 s with a sample every 0.001 s has 5 of them"));
    let wild = Request { margin: f64::NAN, ..one.clone() };
    assert!(told(&case, &wild).contains("a margin of NaN cannot be"));
    let tight = Request { travel: Some(1e-9), ..one };
    assert!(told(&case, &tight).contains("no input was found that stays within the limits and moves the cart"));
}
