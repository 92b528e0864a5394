//! Fits: certified least-squares problems, machines whose truth is known, and what logs cannot tell.

use std::sync::Arc;
use taut::case::{Case, Plan, TEMPLATE};
use taut::fit::least_squares::{Bounds, Ending, Options, Residuals, minimise};
use taut::fit::{check, fit, inverse_of_square};
use taut::log::{Log, Output, Quantity};
use taut::measure::measure;
use taut::signal::Hold;
use taut::solve::{Flow, Solver};
use taut::stage::Measurement;

/// A problem of NIST's Statistical Reference Datasets (nonlinear regression), with its certified answer.
struct Nist {
    name: &'static str,
    x: &'static [f64],
    y: &'static [f64],
    model: fn(&[f64], f64) -> f64,
    starts: &'static [&'static [f64]],
    certified: &'static [[f64; 2]],
    squares: f64,
}

const NIST: &[Nist] = &[
    Nist {
        name: "Misra1a",
        x: &[77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0],
        y: &[10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78],
        model: |b, x| b[0] * (1.0 - (-b[1] * x).exp()),
        starts: &[&[500.0, 0.0001], &[250.0, 0.0005]],
        certified: &[[2.3894212918e2, 2.7070075241e0], [5.5015643181e-4, 7.2668688436e-6]],
        squares: 1.2455138894e-1,
    },
    Nist {
        name: "MGH09",
        x: &[4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625],
        y: &[0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246],
        model: |b, x| b[0] * (x * x + x * b[1]) / (x * x + x * b[2] + b[3]),
        starts: &[&[0.25, 0.39, 0.415, 0.39]],
        certified: &[
            [1.9280693458e-1, 1.1435312227e-2],
            [1.9128232873e-1, 1.9633220911e-1],
            [1.2305650693e-1, 8.0842031232e-2],
            [1.3606233068e-1, 9.0025542308e-2],
        ],
        squares: 3.0750560385e-4,
    },
    Nist {
        name: "Rat42",
        x: &[9.0, 14.0, 21.0, 28.0, 42.0, 57.0, 63.0, 70.0, 79.0],
        y: &[8.930, 10.800, 18.590, 22.330, 39.350, 56.110, 61.730, 64.620, 67.080],
        model: |b, x| b[0] / (1.0 + (b[1] - b[2] * x).exp()),
        starts: &[&[100.0, 1.0, 0.1], &[75.0, 2.5, 0.07]],
        certified: &[
            [7.2462237576e1, 1.7340283401e0],
            [2.6180768402e0, 8.8295217536e-2],
            [6.7359200066e-2, 3.4465663377e-3],
        ],
        squares: 8.0565229338e0,
    },
];

/// Variables in units of where they start, as a fit has them.
struct Scaled<'a>(&'a Nist, &'a [f64]);

impl Residuals for Scaled<'_> {
    fn rows(&self) -> usize {
        self.0.x.len()
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        let b: Vec<f64> = x.iter().zip(self.1).map(|(x, unit)| x * unit).collect();
        for (r, (x, y)) in r.iter_mut().zip(self.0.x.iter().zip(self.0.y)) {
            *r = (self.0.model)(&b, *x) - y;
        }
        r.iter().all(|r| r.is_finite())
    }
}

#[test]
fn certified_problems_of_nist_are_met() {
    for problem in NIST {
        for start in problem.starts {
            let n = start.len();
            let options = Options { tolerance: 1e-8, iterations: 1000, ..Options::default() };
            let found =
                minimise(&mut Scaled(problem, start), &vec![1.0; n], &Bounds::none(n), &options, &mut |_, _| {
                    Flow::Continue
                });
            let name = problem.name;
            assert_eq!(found.ending, Ending::Converged, "{name}");
            assert!((2.0 * found.cost / problem.squares - 1.0).abs() < 1e-9, "{name}: {}", 2.0 * found.cost);
            let inverse = inverse_of_square(&found.jacobian).unwrap();
            let variance = 2.0 * found.cost / (problem.x.len() - n) as f64;
            for (j, [value, error]) in problem.certified.iter().enumerate() {
                let mine = found.x[j] * start[j];
                let own = (variance * inverse[(j, j)]).sqrt() * start[j];
                assert!((mine / value - 1.0).abs() < 1e-6, "{name} b{}: {mine} {value}", j + 1);
                assert!((own / error - 1.0).abs() < 1e-5, "{name} error of b{}: {own} {error}", j + 1);
            }
        }
    }
}

/// The machine of the template with some numbers changed, and the logs that its encoder makes of both pulses.
fn recorded(changes: &[&str], seed: u64, noise: f64) -> Case {
    let mut case = Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap();
    let measurement = Measurement { seed, ..Measurement::default() };
    for experiment in &mut case.experiments {
        let log = measure(&case.stage, &measurement, experiment, Solver::Exact).unwrap().trajectory;
        let mut random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut uniform = || {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 11) as f64 * 2f64.powi(-53)
        };
        // The sum of twelve is near enough to normal.
        let values = log.get("drive_angle").unwrap().iter();
        let values = values.map(|v| v + noise * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0)).collect();
        experiment.log = Some(Arc::new(Log {
            name: experiment.name.clone(),
            file: Default::default(),
            time: log.get("time").unwrap().to_vec(),
            input: log.get("voltage").unwrap().to_vec(),
            hold: Hold::Zero,
            outputs: vec![Output { quantity: Quantity::DriveAngle, absolute: false, values }],
        }));
    }
    case
}

/// The case of the file, with the logs of another machine.
fn with_logs_of(truth: Case) -> Case {
    let mut case = Case::from_text("axis.toml", TEMPLATE).unwrap();
    for (own, other) in case.experiments.iter_mut().zip(truth.experiments) {
        own.log = other.log;
    }
    case
}

fn plan(free: &[&str]) -> Plan {
    Plan { free: free.iter().map(|key| key.to_string()).collect(), ..Plan::default() }
}

#[test]
fn a_machine_is_found_again() {
    let truth = [("cart.friction.viscous", 24.0), ("cart.friction.coulomb", 0.6), ("cart.mass", 0.5)];
    let changes: Vec<String> = truth.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    let case = with_logs_of(recorded(&changes, 1, 0.0));
    let keys: Vec<&str> = truth.iter().map(|(key, _)| *key).collect();
    let found = fit(&case, &plan(&keys), None, &mut |_| Flow::Continue).unwrap();
    assert_eq!(found.ending, Ending::Converged);
    for (estimate, (key, value)) in found.estimates.iter().zip(truth) {
        let error = estimate.error.unwrap();
        assert!((estimate.value - value).abs() < 4.0 * error, "{key}: {} ± {error}, is {value}", estimate.value);
        assert!(error < 0.05 * value, "{key}: ± {error}");
    }
    // What is written is what was found.
    let text = found.case_text(&case, "axis.toml".as_ref()).unwrap();
    let again = Case::from_text("fitted.toml", &text).unwrap();
    assert!((again.stage.cart.mass - found.estimates[2].value).abs() < 1e-12, "{text}");
}

/// P7: an encoder at the motor does not tell the friction of the cart from that of the pulleys.
#[test]
fn what_an_encoder_cannot_tell_is_refused_in_words() {
    let case = with_logs_of(recorded(&[], 1, 0.0));
    let plan = plan(&["drive_pulley.friction.viscous", "cart.friction.viscous", "cart.friction.coulomb"]);
    let told = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap_err().to_string();
    assert!(told.contains("B₁ + r² b + B₂ + K_t K_e/R"), "{told}");
    assert!(told.contains("total.viscous") && told.contains("fix one"), "{told}");
    let found = check(&case, &plan).unwrap();
    assert_eq!(found.identifiability.groups.len(), 1);
    assert_eq!(found.identifiability.groups[0].determined, 1);
    assert!(found.identifiability.error[0].is_infinite() && found.identifiability.error[2].is_finite());
}

/// Share of 95 % intervals that hold the truth, over so many random machines; and how many fits met a bound or failed.
fn coverage(machines: u64, noise: f64) -> (f64, usize) {
    let keys = ["cart.friction.viscous", "cart.friction.coulomb", "cart.mass"];
    let (mut held, mut all, mut lost) = (0, 0, 0);
    for seed in 1..=machines {
        let share = |k: u64| {
            ((seed * 2_654_435_761 + k * 40_503).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 11) as f64 * 2f64.powi(-53)
        };
        let truth = [10.0 + 25.0 * share(1), 0.1 + 1.4 * share(2), 0.2 + 0.8 * share(3)];
        let changes: Vec<String> = keys.iter().zip(truth).map(|(key, value)| format!("{key}={value}")).collect();
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let case = with_logs_of(recorded(&changes, seed, noise));
        let found = fit(&case, &plan(&keys), None, &mut |_| Flow::Continue).unwrap();
        for (estimate, value) in found.estimates.iter().zip(truth) {
            match estimate.interval {
                Some([low, high]) => {
                    all += 1;
                    held += usize::from(low <= value && value <= high);
                }
                None => lost += 1,
            }
        }
    }
    (f64::from(held as u32) / f64::from(all.max(1)), lost)
}

#[test]
fn intervals_hold_the_truth_about_as_often_as_they_say() {
    let (share, lost) = coverage(40, 1e-3);
    println!("{share} {lost}");
    assert!((0.88..=1.0).contains(&share) && lost == 0, "{share}, {lost} lost");
}

/// The whole run; `cargo test --release --test fit -- --ignored --nocapture` prints the shares.
#[test]
#[ignore = "minutes"]
fn intervals_hold_the_truth_of_a_thousand_machines() {
    for noise in [0.0, 1e-3, 1e-2] {
        let (share, lost) = coverage(1000, noise);
        println!(
            "noise {noise} rad beside the encoder's counts: {:.1} % of 3000 intervals, {lost} lost",
            100.0 * share
        );
        assert!((0.93..=0.97).contains(&share) && lost == 0, "{share}, {lost} lost");
    }
}
