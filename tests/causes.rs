//! Elements that a model lacks are found by fitting them: machines of known truth, integrated without taut's solvers.

use crate::common::chance::Chance;
use crate::common::logged::{columns, output};
use crate::common::truths::{AXIS, COUNT, EVERY, Truth, drawn, forces};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, OnceLock};
use taut::case::{Case, Experiment};
use taut::fit::{Fit, Grade, check, fit};
use taut::log::Quantity;
use taut::machine::Machine;
use taut::signal::{Hold, Signal};
use taut::solve::{Flow, Solver, simulate};

/// The fit of a machine and its true values.
type Known = Arc<OnceLock<(Fit, [f64; 3])>>;

/// The fits that several tests look at.
static KNOWN: Mutex<BTreeMap<(Truth, u64), Known>> = Mutex::new(BTreeMap::new());

/// The fit of a machine, which is made once.
fn fitted(seed: u64, truth: Truth) -> (Fit, [f64; 3]) {
    let known = KNOWN.lock().unwrap().entry((truth, seed)).or_default().clone();
    let fresh = || {
        let (case, values) = drawn(seed, truth);
        (fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap(), values)
    };
    known.get_or_init(fresh).clone()
}

/// How many intervals hold the truth.
fn held(found: &Fit, values: [f64; 3]) -> usize {
    let pairs = found.estimates.iter().zip(values);
    pairs.filter(|(one, truth)| one.interval.is_some_and(|[low, high]| low <= *truth && *truth <= high)).count()
}

fn warns(found: &Fit, code: &str) -> bool {
    found.findings.iter().any(|one| one.code == code && one.grade == Grade::Warning)
}

/// With a spring of 17 Hz between motor and cart, the mass's interval held the truth for 7 of 100 machines, and `fit`
/// did not report it.
#[test]
fn a_missing_spring_is_named() {
    for truth in [Truth::Spring, Truth::SpringAtMotor] {
        let all: Vec<_> = (1..=5).map(|seed| fitted(seed, truth)).collect();
        let named = all.iter().filter(|(found, _)| warns(found, "spring")).count();
        assert!(
            named >= 4,
            "{truth:?}: {named} of 5: {:#?}",
            all.iter().map(|one| &one.0.findings).collect::<Vec<_>>()
        );
        // Its estimates of the mass, and the intervals that contain them.
        for (found, [mass, ..]) in all.iter().filter(|(found, _)| found.cause.is_some()) {
            let with = found.cause.as_ref().unwrap().estimates[0].as_ref().unwrap();
            assert!((with.value / mass - 1.0).abs() < 0.05, "{truth:?}: {} for {mass}", with.value);
            let [low, high] = found.estimates[0].interval.unwrap();
            assert!(low <= with.value - 1.9 * with.error && with.value + 1.9 * with.error <= high);
        }
    }
}

/// Samples that are taken after their stamps are an input that acts early: the mass's interval held in 2 of 100. They
/// scatter over 0.8 ms.
#[test]
fn late_stamps_are_a_delay_of_the_other_sign_and_scatter() {
    let (mut named, mut scattered) = (0, 0);
    for seed in 1..=10 {
        let (found, _) = fitted(seed, Truth::Late);
        let Some(cause) = found.cause.as_ref().filter(|cause| cause.key == "delay") else { continue };
        named += usize::from((cause.parameters[0].value + 0.4e-3).abs() < 0.15e-3);
        let scatter = cause.parameters.iter().find(|own| own.name == "scatter");
        scattered += usize::from(scatter.is_some_and(|own| (12f64.sqrt() * own.value - 0.8e-3).abs() < 0.1e-3));
    }
    assert!(named >= 9 && scattered >= 9, "{named} and {scattered} of 10");
}

/// Elements are tried side by side, and curves differentiated by differences side by side.
#[test]
fn a_cause_is_the_same_on_any_number_of_threads() {
    for (truth, key) in [(Truth::Spring, "spring"), (Truth::LuGre, "lugre")] {
        let (case, _) = drawn(3, truth);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap())
        };
        let [one, three] = [1, 3].map(on);
        assert_eq!(one.cause.as_ref().map(|cause| cause.key), Some(key));
        assert_eq!(format!("{one:?}"), format!("{three:?}"));
    }
}

/// A drag of 0.3 b v² made the viscous friction's interval hold in 31 of 100.
#[test]
fn a_drag_is_named_with_its_size() {
    let mut named = 0;
    for seed in 11..=15 {
        let (found, [_, viscous, _]) = fitted(seed, Truth::Drag);
        let size = found.cause.as_ref().filter(|cause| cause.key == "drag").map(|cause| &cause.parameters[0]);
        let is_right = size.is_some_and(|size| (size.value / (0.3 * viscous) - 1.0).abs() < 0.05);
        let [low, high] = found.estimates[1].interval.unwrap();
        named += usize::from(is_right && warns(&found, "drag") && (low..=high).contains(&viscous));
    }
    assert!(named == 5, "{named} of 5");
}

/// LuGre friction was taken for falling friction, a spring or a constant force.
#[test]
fn bristles_are_named_with_their_stiffness() {
    for seed in 1..=3 {
        let (found, values) = fitted(seed, Truth::LuGre);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{seed}: {:#?}", found.findings));
        assert!(cause.key == "lugre" && warns(&found, "lugre"), "{seed}: {}", cause.words);
        // They bend by 0.1 mm under the Coulomb friction.
        let stiffness = values[2] / 0.1e-3;
        let size = cause.parameters.iter().find(|own| own.name == "cart.friction.lugre.stiffness").unwrap();
        assert!((size.value / stiffness - 1.0).abs() < 0.05, "{seed}: {} for {stiffness}", size.value);
        for (one, truth) in cause.estimates.iter().zip(values) {
            let one = one.as_ref().unwrap();
            assert!((one.value / truth - 1.0).abs() < 2e-3, "{seed}: {} {} for {truth}", one.name, one.value);
        }
        assert_eq!(held(&found, values), 3, "{seed}: {:#?}", found.estimates);
    }
}

/// Flanks of a fixed stiffness, and the choice of starts by their first steps, left the play of 20 of 100 machines
/// without a name: for the second of these a spring was named. In the first, a start in a held-out part fails.
#[test]
fn play_is_named_where_first_steps_suggest_a_spring() {
    for seed in [1_000_011, 1_000_012, 1_000_014] {
        let (found, _) = fitted(seed, Truth::Play);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{seed}: {:#?}", found.findings));
        assert!(cause.key == "play" && warns(&found, "play"), "{seed}: {}", cause.words);
        let size = cause.parameters.iter().find(|own| own.name == "motor.backlash").unwrap();
        assert!((size.value / 0.3e-3 - 1.0).abs() < 0.35, "{seed}: {}", cause.words);
    }
}

/// Play of a sensor's coupling biased the mass by several standard errors without a word, or was told as bristles. With
/// `sensor_play` in the case, its width and the values are estimated.
#[test]
fn play_of_a_sensor_is_named_with_its_width() {
    for seed in 1..=5 {
        let (found, values) = fitted(seed, Truth::SensorPlay);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{seed}: {:#?}", found.findings));
        assert!(cause.key == "sensor_play" && warns(&found, "sensor_play"), "{seed}: {}", cause.words);
        let size = &cause.parameters[0];
        assert!(size.unit == "m" && (size.value - 0.3e-3).abs() < 3.0 * size.error.max(2e-6), "{seed}: {size:?}");
        for (one, truth) in cause.estimates.iter().zip(values) {
            let one = one.as_ref().unwrap();
            assert!((one.value / truth - 1.0).abs() < 3e-3, "{seed}: {} {} for {truth}", one.name, one.value);
        }
        assert_eq!(held(&found, values), 3, "{seed}: {:#?}", found.estimates);
    }
    let (case, values) = drawn(6, Truth::SensorPlay);
    let mut plan = case.fit.clone().unwrap();
    plan.nuisance.sensor_play = Some(Quantity::CartPosition);
    let found = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    let play = found.estimates.iter().find(|one| one.name == "sensor_play").unwrap();
    assert!((play.value - 0.3e-3).abs() < 3e-6 && play.unit == "m", "{play:?}");
    assert!(found.findings.is_empty() && found.cause.is_none(), "{:#?}", found.findings);
    for (one, truth) in found.estimates.iter().zip(values) {
        assert!((one.value / truth - 1.0).abs() < 3e-3, "{} {} for {truth}", one.name, one.value);
    }
}

/// Turns that were late by up to a step of the simulated truth were told as friction that differs between the
/// directions.
#[test]
fn the_right_model_has_no_finding_where_its_turns_are_right() {
    for seed in [1_000_018, 1_000_029, 1_000_032] {
        let (found, _) = fitted(seed, Truth::Right);
        assert!(found.findings.is_empty(), "{seed}: {:#?}", found.findings);
    }
}

/// The experiment of a case with the log of another machine of its kind, which taut simulates.
fn logged(seed: u64, case: &Case, other: &Machine, name: &str) -> Experiment {
    let mut chance = Chance::new(seed);
    let input = forces(&mut chance);
    let time: Vec<f64> = (0..COUNT).map(|k| k as f64 * EVERY).collect();
    let mut experiment = case.experiments[0].clone();
    (experiment.until, experiment.every) = ((COUNT - 1) as f64 * EVERY, EVERY);
    experiment.inputs[0] = Signal::Sampled { times: time.clone(), values: input.clone(), hold: Hold::Zero };
    let run = simulate(other, &experiment, Solver::for_machine(other)).unwrap().trajectory;
    let position = run.get("cart_position").unwrap().iter().map(|x| x + 1e-5 * chance.normal()).collect();
    experiment.name = name.into();
    experiment.log = Some(columns(name, time, input, vec![output(Quantity::CartPosition, position)]));
    experiment
}

/// The machine in voltage mode.
const VOLTAGE: &[&str] = &["amplifier.mode=voltage", "experiment.0.input.step=1 V"];

/// The fit of the case with `changes` to the log of another machine, which has those of `truth`, too.
fn simulated(seed: u64, changes: &[&str], truth: &[&str]) -> Fit {
    apart(&[seed], changes, &[truth])
}

/// The same with a log of each of several machines.
fn apart(seeds: &[u64], changes: &[&str], truths: &[&[&str]]) -> Fit {
    let mut case = Case::from_text_with("axis.toml", AXIS, changes).unwrap();
    let of = |(k, truth): (usize, &&[&str])| {
        let other = Case::from_text_with("axis.toml", AXIS, &[changes, truth].concat()).unwrap().machine;
        logged(seeds[k], &case, &other, &format!("log {k}"))
    };
    case.experiments = truths.iter().enumerate().map(of).collect();
    fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap()
}

/// An amplifier that gave 75 % of what the log says was called a drag, or was not reported.
#[test]
fn a_limit_is_named() {
    for seed in 1..=4 {
        let (found, values) = fitted(seed, Truth::Limited);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{seed}: {:#?}", found.findings));
        assert!(cause.key == "limit" && warns(&found, "limit"), "{seed}: {}", cause.words);
        assert!((cause.parameters[0].value / 8.0 - 1.0).abs() < 1e-3, "{seed}: {}", cause.words);
        assert!(!warns(&found, "interruption"), "{seed}: {:#?}", found.findings);
        for (one, truth) in cause.estimates.iter().zip(values) {
            let one = one.as_ref().unwrap();
            assert!((one.value / truth - 1.0).abs() < 5e-3, "{seed}: {} {} for {truth}", one.name, one.value);
        }
    }
}

/// A current that lags was called a spring.
#[test]
fn an_inductance_is_named() {
    for seed in 1..=3 {
        let found = simulated(seed, VOLTAGE, &["motor.inductance=5e-3"]);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{seed}: {:#?}", found.findings));
        assert!(cause.key == "inductance" && warns(&found, "inductance"), "{seed}: {}", cause.words);
        assert!((cause.parameters[0].value / 5e-3 - 1.0).abs() < 0.02, "{seed}: {}", cause.words);
    }
}

/// A log of a machine with another mass, or whose input has another scale, was fitted with the others in silence, or
/// with a play of 26 mm.
#[test]
fn a_log_of_another_machine_is_named() {
    for (change, name, factor) in [("cart.mass=1.4", "cart.mass", 1.4), ("amplifier.gain=1.25", "amplifier.gain", 1.25)]
    {
        // Four logs and more are held out whole by other elements.
        for count in [2, 5] {
            let seeds: Vec<u64> = (1..=count).collect();
            let changed = [change];
            let truth = |k: u64| if k == count { &changed[..] } else { &[] };
            let truths: Vec<&[&str]> = (1..=count).map(truth).collect();
            let found = apart(&seeds, VOLTAGE, &truths);
            let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{name} {count}: {:#?}", found.findings));
            assert!(cause.key == "apart" && warns(&found, "apart"), "{name} {count}: {}", cause.words);
            let last = format!("{name} [log {}]", count - 1);
            let size = cause.parameters.iter().find(|own| own.name == last).unwrap();
            assert!((size.value / factor - 1.0).abs() < 5e-3, "{name} {count}: {}", cause.words);
        }
    }
}

/// What no element explains is said: friction that is greater along a part of the travel.
#[test]
fn residuals_far_above_the_noise_are_reported() {
    for seed in 1..=2 {
        let along = "cart.force_along=[[-10, 0], [-0.05, 0], [0, 3], [0.05, 0], [10, 0]]";
        let found = simulated(seed, &[], &[along]);
        let said = found.findings.iter().any(|one| one.code == "noise" || one.grade == Grade::Warning);
        assert!(said, "{seed}: {:#?}", found.findings);
    }
}

/// A first value that stands out, such as that of a sensor which was not ready, turned the fit into nonsense: other
/// warnings spoke of the time unit, or of an interruption.
#[test]
fn a_first_value_that_stands_out_is_named() {
    let mut case = Case::from_text("axis.toml", AXIS).unwrap();
    let mut experiment = logged(1, &case, &case.machine, "log");
    let log = Arc::make_mut(experiment.log.as_mut().unwrap());
    log.outputs[0].values[0] += 0.05;
    case.experiments = vec![experiment];
    let found = fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap();
    let warnings: Vec<&str> = found.warnings().map(|one| one.code).collect();
    assert!(warnings.contains(&"outliers"), "{:#?}", found.findings);
    for code in ["time-unit", "interruption"] {
        assert!(!warnings.contains(&code), "{:#?}", found.findings);
    }
}

/// A constant force is named with its size.
#[test]
fn a_constant_force_is_named_with_its_size() {
    for seed in 1..=3 {
        let found = simulated(seed, &[], &["cart.load=0.5"]);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{seed}: {:#?}", found.findings));
        assert!(cause.key == "load" && warns(&found, "load"), "{seed}: {}", cause.words);
        let own = cause.parameters[0].value;
        assert!((own / 0.5 - 1.0).abs() < 0.2, "{seed}: {own}");
    }
}

/// A right model lacks nothing, whatever its noise is like.
#[test]
fn the_right_model_lacks_nothing() {
    let (mut named, mut inside) = (Vec::new(), 0);
    for (truth, machines) in [(Truth::Right, 6), (Truth::NarrowBand, 6)] {
        for seed in 1..=machines {
            let (found, values) = fitted(seed, truth);
            inside += held(&found, values);
            let told = ["other_law", "place"];
            let told = found.findings.iter().filter(|one| told.contains(&one.code));
            named.extend(told.map(|one| format!("{truth:?} {seed}: {one}")));
            named.extend(found.cause.map(|cause| format!("{truth:?} {seed}: {}", cause.words)));
        }
    }
    assert!(named.len() <= 1, "{named:#?}");
    // 95 % of 36 are 34.
    assert!(inside >= 32, "{inside} of 36");
}

/// `check` and `fit` say the same of a model.
#[test]
fn check_and_fit_say_the_same() {
    let (case, _) = drawn(3, Truth::SpringAtMotor);
    let plan = case.fit.as_ref().unwrap();
    let (fitted, _) = fitted(3, Truth::SpringAtMotor);
    let checked = check(&case, plan).unwrap();
    assert!(!fitted.findings.is_empty());
    assert_eq!(fitted.findings, checked.fit.findings);
}

/// Intervals under narrow-band noise were nine times too wide: first-order noise has most of its power where that has
/// almost none.
#[test]
fn noise_that_swings_is_known_as_such() {
    let (mut squares, mut widths, mut inside) = ([0.0; 3], [0.0; 3], 0);
    let machines = 8;
    for seed in 1..=machines {
        let (found, values) = fitted(seed, Truth::NarrowBand);
        inside += held(&found, values);
        for (j, estimate) in found.estimates.iter().enumerate() {
            squares[j] += (estimate.value / values[j] - 1.0).powi(2) / machines as f64;
            widths[j] += estimate.error.unwrap() / values[j] / machines as f64;
        }
    }
    let ratios: Vec<f64> = (0..3).map(|j| widths[j] / f64::sqrt(squares[j])).collect();
    assert!(ratios.iter().all(|ratio| *ratio < 2.5), "{ratios:?}");
    assert!(inside >= 18, "{inside} of 24: {ratios:?}");
}

/// Of a pure tone, hum of the mains or imbalance, the search of narrow-band noise saw a part: intervals of a right
/// model did not hold beside it.
#[test]
fn intervals_hold_beside_a_tone() {
    for hertz in [17.3, 50.0] {
        let mut inside = 0;
        for seed in 1..=6 {
            let (mut case, values) = drawn(seed, Truth::Right);
            let log = Arc::make_mut(case.experiments[0].log.as_mut().unwrap());
            let tone = |time: &f64| 2e-3 * (TAU * hertz * time + seed as f64).sin();
            log.outputs[0].values.iter_mut().zip(&log.time).for_each(|(value, time)| *value += tone(time));
            let found = fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap();
            inside += held(&found, values);
        }
        // 95 % of 18 are 17.
        assert!(inside >= 16, "{hertz} Hz: {inside} of 18");
    }
}
