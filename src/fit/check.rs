//! Before a fit: what the logs show, what they determine, and what one more experiment would.

use super::identify::Identifiability;
use super::least_squares::{Differences, Residuals, Step};
use super::problem::Problem;
use super::regression::{Balance, regression};
use super::run::is_position;
use crate::case::{Case, Plan};
use crate::error::{Error, Result};
use crate::log::{Quantity, Survey};
use crate::solve::Bench;
use crate::stage::Stage;
use nalgebra::DMatrix;

/// What there is to know before a fit.
#[derive(Debug, Clone)]
pub struct Check {
    /// What each log shows.
    pub logs: Vec<Survey>,
    /// The balance of torques of a rigid axis, by regression; none where the logs do not allow one.
    pub balance: Option<Balance>,
    /// What they determine together.
    pub identifiability: Identifiability,
    /// What to do about each group that is not determined.
    pub choices: Vec<Vec<String>>,
    /// Which noise that is for.
    pub noise_words: String,
    /// What one more experiment would tell, the best first.
    pub experiments: Vec<Proposal>,
}

/// One more experiment.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// What is done or measured.
    pub name: &'static str,
    /// What that would tell.
    pub told: String,
    /// Parameters determined with it.
    pub determined: usize,
    /// Sum of the logarithms of the relative errors, those that are not determined counted as [`super::LIMIT`].
    score: f64,
}

/// Looks at the logs of a case.
pub fn check(case: &Case, plan: &Plan) -> Result<Check> {
    let mut problem = Problem::new(case, plan)?;
    let noise = weigh_by_noise(&mut problem);
    let (jacobian, x) = sensitivities(&mut problem)?;
    let numbers = || Error::new("the sensitivities of these logs are no numbers");
    let identifiability = Identifiability::new(&problem, &jacobian, &x, 1.0).ok_or_else(numbers)?;
    let choices = identifiability.groups.iter().map(|group| identifiability.choices(&problem, group)).collect();
    let experiments = proposals(&problem, &jacobian, &x, &identifiability, &noise);
    let noise: Vec<String> = noise
        .iter()
        .map(|(quantity, sigma)| {
            format!(
                "{} {}",
                quantity.name(),
                crate::number::engineering(*sigma, quantity.unit(), 2).replace('\u{a0}', " ")
            )
        })
        .collect();
    Ok(Check {
        balance: regression(&problem),
        logs: case.experiments.iter().filter_map(|e| Some(Survey::new(e.log.as_ref()?, &case.stage))).collect(),
        identifiability,
        choices,
        noise_words: format!(
            "for the noise that neighbouring values show ({}); what the model leaves unexplained adds to it",
            noise.join(", ")
        ),
        experiments,
    })
}

/// Weighs each quantity by what its values do from one to the next and what its converter rounds; gives these deviations.
pub(super) fn weigh_by_noise(problem: &mut Problem) -> Vec<(Quantity, f64)> {
    let noise = problem.noise().0;
    for &(quantity, deviation) in &noise {
        problem.weigh(quantity, deviation, true);
    }
    noise
}

/// The Jacobian at the start.
pub(super) fn sensitivities(problem: &mut Problem) -> Result<(DMatrix<f64>, Vec<f64>)> {
    let (x, bounds) = (problem.start(), problem.bounds());
    let mut residuals = vec![0.0; problem.rows()];
    let failed = || {
        Error::new("the model does not get through these logs with the values of the case file")
            .next("run `taut simulate` on the case to see why, or start from other values")
    };
    if !problem.evaluate(&x, &mut residuals) {
        return Err(failed());
    }
    let jacobian = problem.jacobian(&x, &residuals, &bounds, &Differences::Central).ok_or_else(failed)?;
    Ok((jacobian, x))
}

/// What is measured of a problem whose logs have these deviations, and with which deviations.
type Measured = fn(&Problem, &[(Quantity, f64)]) -> Vec<(Quantity, f64)>;

/// What is done once more, and how.
struct Idea {
    name: &'static str,
    /// What is measured beside what the logs hold; a deviation for each.
    measured: Measured,
    /// What is done to the machine.
    change: fn(&mut Stage),
    /// Whether the input is turned round.
    reversed: bool,
}

fn same(problem: &Problem, noise: &[(Quantity, f64)]) -> Vec<(Quantity, f64)> {
    let _ = problem;
    noise.to_vec()
}

/// What a position of the cart is known to, if an encoder like that of the logs were there.
fn cart_noise(problem: &Problem, noise: &[(Quantity, f64)]) -> f64 {
    let r = problem.stage.pulley_radius;
    let known = noise.iter().find(|(quantity, _)| is_position(*quantity));
    known.map_or(10e-6, |(quantity, sigma)| if *quantity == Quantity::CartPosition { *sigma } else { sigma * r })
}

const IDEAS: &[Idea] = &[
    Idea { name: "the same inputs again, the other way round", measured: same, change: |_| {}, reversed: true },
    Idea {
        name: "an encoder at the cart, as fine as the one there is (to 10 µm where there is none)",
        measured: |problem, noise| vec![(Quantity::CartPosition, cart_noise(problem, noise))],
        change: |_| {},
        reversed: false,
    },
    Idea {
        name: "the motor's current measured, to 1 % of its peak",
        measured: |problem, _| vec![(Quantity::MotorCurrent, 0.01 * peak_current(problem))],
        change: |_| {},
        reversed: false,
    },
    Idea {
        name: "the same inputs with a known mass added to the cart, as heavy as the cart",
        measured: same,
        change: |stage| stage.cart.mass *= 2.0,
        reversed: false,
    },
    Idea {
        name: "the same inputs with the belt taken off: the drive pulley alone",
        measured: |problem, noise| {
            let r = problem.stage.pulley_radius;
            vec![(Quantity::DriveAngle, cart_noise(problem, noise) / r)]
        },
        change: |stage| {
            stage.belt.stiffness = [1e-6; 3];
            stage.belt.damping = [0.0; 3];
            stage.belt.model = crate::stage::BeltModel::Elastic;
        },
        reversed: false,
    },
    Idea {
        name: "the drive pulley locked and the current measured, to 1 % of its peak",
        measured: |problem, _| vec![(Quantity::MotorCurrent, 0.01 * peak_current(problem))],
        change: |stage| {
            for side in [&mut stage.drive_pulley.friction.forward, &mut stage.drive_pulley.friction.backward] {
                side.breakaway = 1e9;
            }
        },
        reversed: false,
    },
];

fn peak_current(problem: &Problem) -> f64 {
    let most = problem.runs.iter().flat_map(|run| run.logged.iter()).fold(0.0, |most: f64, u| most.max(u.abs()));
    let amplifier = &problem.stage.amplifier;
    let output = (most * amplifier.gain).abs().max(1e-9);
    match amplifier.mode {
        crate::stage::AmplifierMode::Voltage => output / problem.stage.motor.resistance,
        crate::stage::AmplifierMode::Current => output,
    }
}

/// What each idea would tell, ranked; only those that tell something.
fn proposals(
    problem: &Problem,
    jacobian: &DMatrix<f64>,
    x: &[f64],
    now: &Identifiability,
    noise: &[(Quantity, f64)],
) -> Vec<Proposal> {
    let score = |found: &Identifiability| {
        found.error.iter().map(|e| if e.is_finite() { e.clamp(1e-12, super::LIMIT).ln() } else { 0.0 }).sum::<f64>()
    };
    let count = |found: &Identifiability| found.error.iter().filter(|e| e.is_finite()).count();
    let before = (count(now), score(now));
    let mut proposals = Vec::new();
    for idea in IDEAS {
        // A model without a belt says nothing of the drive pulley alone.
        if idea.name.contains("belt taken off") && problem.stage.belt.model == crate::stage::BeltModel::Rigid {
            continue;
        }
        let Some(more) = rows_of(problem, idea, x, noise) else { continue };
        let mut all = DMatrix::zeros(jacobian.nrows() + more.nrows(), jacobian.ncols());
        all.rows_mut(0, jacobian.nrows()).copy_from(jacobian);
        all.rows_mut(jacobian.nrows(), more.nrows()).copy_from(&more);
        let Some(found) = Identifiability::new(problem, &all, x, 1.0) else { continue };
        let gained: Vec<&str> = (0..found.names.len())
            .filter(|&j| found.error[j].is_finite() && !now.error[j].is_finite())
            .map(|j| found.names[j].as_str())
            .collect();
        let sharper: Vec<String> = (0..found.names.len())
            .filter(|&j| now.error[j].is_finite() && found.error[j] < 0.5 * now.error[j])
            .map(|j| format!("{} {:.1} times better", found.names[j], now.error[j] / found.error[j]))
            .collect();
        let mut told = Vec::new();
        if !gained.is_empty() {
            let with: Vec<String> = gained
                .iter()
                .filter_map(|name| found.names.iter().position(|n| n == name))
                .map(|j| format!("{} (to {:.2} %)", found.names[j], 100.0 * found.error[j]))
                .collect();
            told.push(format!("determines {}", with.join(", ")));
        }
        if !sharper.is_empty() {
            told.push(sharper.join(", "));
        }
        if told.is_empty() {
            continue;
        }
        proposals.push(Proposal {
            name: idea.name,
            told: told.join("; "),
            determined: count(&found),
            score: score(&found),
        });
    }
    proposals.retain(|p| p.determined > before.0 || p.score < before.1);
    proposals.sort_by(|a, b| b.determined.cmp(&a.determined).then(a.score.total_cmp(&b.score)));
    proposals
}

/// Rows of sensitivities that an idea adds, for the machine's own parameters.
fn rows_of(problem: &Problem, idea: &Idea, x: &[f64], noise: &[(Quantity, f64)]) -> Option<DMatrix<f64>> {
    let measured = (idea.measured)(problem, noise);
    let quantities: Vec<Quantity> = measured.iter().map(|(quantity, _)| *quantity).collect();
    let bounds = problem.bounds();
    let answer = |x: &[f64]| -> Option<Vec<f64>> {
        let mut stage = problem.stage_at(x);
        (idea.change)(&mut stage);
        let mut values = Vec::new();
        let mut bench = Bench::default();
        for (index, run) in problem.runs.iter().enumerate() {
            let mut stage = stage.clone();
            if idea.reversed {
                stage.amplifier.gain = -stage.amplifier.gain;
            }
            let mut columns = vec![Vec::new(); quantities.len()];
            if !run.predict(&mut bench, &stage, &problem.extras_of(index, x), &quantities, &mut columns) {
                return None;
            }
            for (column, (_, sigma)) in columns.iter().zip(&measured) {
                values.extend(column.iter().map(|v| v / sigma));
            }
        }
        Some(values)
    };
    let here = answer(x)?;
    let mut rows = DMatrix::zeros(here.len(), x.len());
    let mut moved = x.to_vec();
    for j in 0..problem.parameters.len() {
        let step = Step::new(x, &bounds, j, &Differences::Central);
        moved[j] = step.first;
        let first = answer(&moved)?;
        moved[j] = step.second.unwrap_or(x[j]);
        let second = answer(&moved)?;
        moved[j] = x[j];
        for i in 0..here.len() {
            rows[(i, j)] = step.slope(here[i], first[i], second[i]);
        }
    }
    Some(rows)
}
