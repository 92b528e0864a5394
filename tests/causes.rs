//! Elements that a model lacks are found by fitting them: machines of known truth, integrated without taut's solvers.

use crate::common::truths::{Truth, drawn};
use taut::fit::{Fit, Grade, check, fit};
use taut::solve::Flow;

fn fitted(seed: u64, truth: Truth) -> (Fit, [f64; 3]) {
    let (case, values) = drawn(seed, truth);
    (fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap(), values)
}

/// How many intervals hold the truth.
fn held(found: &Fit, values: [f64; 3]) -> usize {
    let pairs = found.estimates.iter().zip(values);
    pairs.filter(|(one, truth)| one.interval.is_some_and(|[low, high]| low <= *truth && *truth <= high)).count()
}

fn warns(found: &Fit, code: &str) -> bool {
    found.findings.iter().any(|one| one.code == code && one.grade == Grade::Warning)
}

/// A spring of 17 Hz between motor and cart made the mass's interval hold the truth of 7 of 100 machines, and `fit` said
/// nothing of it.
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

/// Samples that are taken after their stamps are an input that acts early: the mass's interval held in 2 of 100.
#[test]
fn late_stamps_are_a_delay_of_the_other_sign() {
    let mut named = 0;
    for seed in 1..=5 {
        let (found, _) = fitted(seed, Truth::Late);
        let cause = found.cause.as_ref().filter(|cause| cause.key == "delay");
        named += usize::from(cause.is_some_and(|cause| (cause.parameters[0].value + 0.4e-3).abs() < 0.15e-3));
    }
    assert!(named >= 4, "{named} of 5");
}

/// A right model lacks nothing, whatever its noise is like.
#[test]
fn the_right_model_lacks_nothing() {
    let (mut named, mut inside) = (Vec::new(), 0);
    for (truth, machines) in [(Truth::Right, 6), (Truth::NarrowBand, 6)] {
        for seed in 1..=machines {
            let (found, values) = fitted(seed, truth);
            inside += held(&found, values);
            named.extend(found.cause.map(|cause| format!("{truth:?} {seed}: {}", cause.words)));
        }
    }
    assert!(named.len() <= 1, "{named:#?}");
    assert!(inside >= 28, "{inside} of 36");
}

/// `check` and `fit` say the same of a model.
#[test]
fn check_and_fit_say_the_same() {
    let (case, _) = drawn(3, Truth::SpringAtMotor);
    let plan = case.fit.as_ref().unwrap();
    let fitted = fit(&case, plan, None, &mut |_| Flow::Continue).unwrap();
    let checked = check(&case, plan).unwrap();
    assert!(!fitted.findings.is_empty());
    assert_eq!(fitted.findings, checked.fit.findings);
}

/// Intervals under narrow-band noise were nine times too wide: noises of first order have most of their power where that
/// has next to none.
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
