//! Proposals of a further experiment: the sensitivities of its outputs in addition to those of the logs.

use super::identify::Identifiability;
use super::uncertainty::Judged;
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::{Differences, Step};
use crate::fit::limits::UNDETERMINED;
use crate::fit::search::starts::Searched;
use crate::log::Quantity;
use crate::machine::{AmplifierMode, BeltModel, Machine};
use crate::solve::Bench;
use nalgebra::DMatrix;

/// A further experiment.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// The action or the measurement.
    pub name: &'static str,
    /// Its predicted effect, in words.
    pub told: String,
    /// Number of parameters determined with it.
    pub determined: usize,
    /// Sum of the logarithms of the relative errors, those that are not determined counted as [`UNDETERMINED`].
    score: f64,
}

/// The quantities to measure in a problem whose logs have these deviations, and with which deviations.
type Measured = fn(&Problem, &[(Quantity, f64)]) -> Vec<(Quantity, f64)>;

/// An experiment to repeat, with a change.
struct Idea {
    name: &'static str,
    /// Further quantities to measure, each with a deviation.
    measured: Measured,
    /// The change of the machine.
    change: fn(&mut Machine),
    /// True if the input is reversed.
    reversed: bool,
    /// True if the logs have that already, or the model lacks it.
    is_there: fn(&Problem) -> bool,
}

fn same(problem: &Problem, noise: &[(Quantity, f64)]) -> Vec<(Quantity, f64)> {
    let _ = problem;
    noise.to_vec()
}

/// The quantities of the logs and one more.
fn with(noise: &[(Quantity, f64)], quantity: Quantity, deviation: f64) -> Vec<(Quantity, f64)> {
    noise.iter().copied().chain([(quantity, deviation)]).collect()
}

/// Deviation of a position of the cart by an encoder like that of the logs.
fn cart_noise(problem: &Problem, noise: &[(Quantity, f64)]) -> f64 {
    let r = problem.machine.pulley_radius;
    let known = noise.iter().find(|(quantity, _)| quantity.is_position());
    known.map_or(10e-6, |(quantity, sigma)| if *quantity == Quantity::CartPosition { *sigma } else { sigma * r })
}

const IDEAS: &[Idea] = &[
    Idea {
        name: "the same inputs with the opposite sign",
        measured: same,
        change: |_| {},
        reversed: true,
        is_there: turns_round,
    },
    Idea {
        name: "an encoder at the cart with the resolution of the present one (10 µm if there is none)",
        measured: |problem, noise| with(noise, Quantity::CartPosition, cart_noise(problem, noise)),
        change: |_| {},
        reversed: false,
        is_there: |problem| has(problem, Quantity::CartPosition),
    },
    Idea {
        name: "the motor's current, measured to 1 % of its peak",
        measured: |problem, noise| with(noise, Quantity::MotorCurrent, 0.01 * peak_current(problem)),
        change: |_| {},
        reversed: false,
        is_there: knows_current,
    },
    Idea {
        name: "the same inputs with a known mass added to the cart, as heavy as the cart",
        measured: same,
        change: |machine| machine.cart.mass *= 2.0,
        reversed: false,
        is_there: |_| false,
    },
    Idea {
        name: "the same inputs with the belt taken off: the drive pulley alone",
        measured: |problem, noise| {
            let r = problem.machine.pulley_radius;
            vec![(Quantity::DriveAngle, cart_noise(problem, noise) / r)]
        },
        change: |machine| {
            machine.belt.stiffness = [1e-6; 3].into();
            machine.belt.damping = [0.0; 3].into();
            machine.belt.model = BeltModel::Elastic;
            // Spans that follow the cart derive their stiffness from their make.
            machine.belt.follows_cart = false;
            machine.belt.pretension = None;
        },
        reversed: false,
        is_there: |problem| problem.machine.belt.model == BeltModel::Rigid,
    },
    Idea {
        name: "the drive pulley locked and the current measured, to 1 % of its peak",
        measured: |problem, _| vec![(Quantity::MotorCurrent, 0.01 * peak_current(problem))],
        change: |machine| {
            for side in [&mut machine.drive_pulley.friction.forward, &mut machine.drive_pulley.friction.backward] {
                side.breakaway = 1e9;
            }
        },
        reversed: false,
        is_there: knows_current,
    },
];

fn peak_current(problem: &Problem) -> f64 {
    let most = problem.runs.iter().flat_map(|run| &run.logged[0]).fold(0.0, |most: f64, u| most.max(u.abs()));
    let amplifier = &problem.machine.drives[0].amplifier;
    let output = (most * amplifier.gain).abs().max(1e-9);
    match amplifier.mode {
        AmplifierMode::Voltage => output / problem.machine.drives[0].motor.resistance,
        AmplifierMode::Current | AmplifierMode::Position => output,
    }
}

/// Proposals ranked by gain; only those that gain something and are not in the logs already. For an axis only: machines
/// with more coordinates get none.
pub(crate) fn proposals(found: &Searched, judged: &Judged) -> Vec<Proposal> {
    let Searched { problem, best, noise, .. } = found;
    if !problem.machine.has_torque_balance() {
        return Vec::new();
    }
    // White noise with the effect of the residuals.
    let deviation = judged.covariance.deviation * judged.inflation;
    let unexplained = unexplained(problem, noise);
    let Some(now) = Identifiability::new(problem, &best.jacobian, &best.x, deviation) else { return Vec::new() };
    let score = |found: &Identifiability| {
        found.error.iter().map(|e| if e.is_finite() { e.clamp(1e-12, UNDETERMINED).ln() } else { 0.0 }).sum::<f64>()
    };
    let count = |found: &Identifiability| found.error.iter().filter(|e| e.is_finite()).count();
    let before = (count(&now), score(&now));
    let mut proposals = Vec::new();
    for idea in IDEAS.iter().filter(|idea| !(idea.is_there)(problem)) {
        let Some(all) = with_rows(problem, idea, &best.jacobian, &best.x, (noise, unexplained)) else { continue };
        let Some(found) = Identifiability::new(problem, &all, &best.x, deviation) else { continue };
        let told = told(&now, &found);
        if !told.is_empty() {
            proposals.push(Proposal { name: idea.name, told, determined: count(&found), score: score(&found) });
        }
    }
    proposals.retain(|p| p.determined > before.0 || p.score < before.1);
    proposals.sort_by(|a, b| b.determined.cmp(&a.determined).then(a.score.total_cmp(&b.score)));
    proposals
}

/// Least ratio of residuals to any measured signal: what the model does not explain in the measured signals, it does
/// not explain in another quantity either.
fn unexplained(problem: &Problem, noise: &[(Quantity, f64)]) -> f64 {
    let share = |(quantity, deviation): &(Quantity, f64)| {
        let seen = problem.runs.iter().flat_map(|run| &run.seen).filter(|seen| seen.quantity == *quantity);
        let spread = seen.map(|seen| spread(&seen.values)).fold(0.0, f64::max);
        if spread > 0.0 { (deviation / spread).min(1.0) } else { 1.0 }
    };
    noise.iter().map(share).fold(1.0, f64::min)
}

/// Standard deviation of the existing values.
fn spread(values: &[f64]) -> f64 {
    let there: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let n = there.len().max(1) as f64;
    let mean = there.iter().sum::<f64>() / n;
    (there.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// The gain of `found` over `now`.
fn told(now: &Identifiability, found: &Identifiability) -> String {
    let places = || 0..found.names.len();
    let gained: Vec<String> = places()
        .filter(|&j| found.error[j].is_finite() && !now.error[j].is_finite())
        .map(|j| format!("{} (to {:.2} %)", found.names[j], 100.0 * found.error[j]))
        .collect();
    let sharper: Vec<String> = places()
        .filter(|&j| now.error[j].is_finite() && found.error[j] < 0.5 * now.error[j])
        .map(|j| format!("{} {:.1} times better", found.names[j], now.error[j] / found.error[j]))
        .collect();
    let mut told = Vec::new();
    if !gained.is_empty() {
        told.push(format!("determines {}", gained.join(", ")));
    }
    if !sharper.is_empty() {
        told.push(sharper.join(", "));
    }
    told.join("; ")
}

/// The Jacobian with the rows of an idea: every log again, each with an unknown start, delay and offsets.
fn with_rows(
    problem: &Problem,
    idea: &Idea,
    jacobian: &DMatrix<f64>,
    x: &[f64],
    (noise, unexplained): (&[(Quantity, f64)], f64),
) -> Option<DMatrix<f64>> {
    let mut measured = (idea.measured)(problem, noise);
    let is_new = |quantity: Quantity| !noise.iter().any(|(own, _)| *own == quantity);
    for (quantity, deviation) in measured.iter_mut().filter(|(quantity, _)| is_new(*quantity)) {
        let one = [(*quantity, 1.0)];
        let signals: Option<Vec<Vec<f64>>> =
            (0..problem.runs.len()).map(|index| answer(problem, idea, &one, index, x)).collect();
        let signal = signals?.iter().map(|signal| spread(signal)).fold(0.0, f64::max);
        *deviation = deviation.max(unexplained * signal);
    }
    let (globals, before) = (problem.globals(), jacobian.ncols());
    let bounds = problem.bounds();
    let mut blocks: Vec<DMatrix<f64>> = Vec::new();
    let mut owned: Vec<usize> = Vec::new();
    for index in 0..problem.runs.len() {
        let own = problem.own_variables(index);
        let columns: Vec<usize> = (0..globals).chain(own.iter().map(|(j, _)| *j)).collect();
        let here = answer(problem, idea, &measured, index, x)?;
        let known: Vec<(usize, f64)> = own
            .iter()
            .enumerate()
            .filter_map(|(place, (_, extra))| Some((globals + place, extra.unit / extra.known?)))
            .collect();
        let mut rows = DMatrix::zeros(here.len() + known.len(), columns.len());
        let mut moved = x.to_vec();
        for (column, &j) in columns.iter().enumerate() {
            let step = Step::new(x, &bounds, j, &Differences::Central);
            moved[j] = step.first;
            let first = answer(problem, idea, &measured, index, &moved)?;
            moved[j] = step.second.unwrap_or(x[j]);
            let second = answer(problem, idea, &measured, index, &moved)?;
            moved[j] = x[j];
            for i in 0..here.len() {
                rows[(i, column)] = step.slope(here[i], first[i], second[i]);
            }
        }
        for (row, (column, value)) in known.into_iter().enumerate() {
            rows[(here.len() + row, column)] = value;
        }
        owned.push(own.len());
        blocks.push(rows);
    }
    let height = jacobian.nrows() + blocks.iter().map(DMatrix::nrows).sum::<usize>();
    let mut all = DMatrix::zeros(height, before + owned.iter().sum::<usize>());
    all.view_mut((0, 0), (jacobian.nrows(), before)).copy_from(jacobian);
    let (mut row, mut column) = (jacobian.nrows(), before);
    for (block, own) in blocks.iter().zip(owned) {
        let height = block.nrows();
        all.view_mut((row, 0), (height, globals)).copy_from(&block.columns(0, globals));
        all.view_mut((row, column), (height, own)).copy_from(&block.columns(globals, own));
        row += height;
        column += own;
    }
    Some(all)
}

/// The outputs of run `index` with the idea, in standard deviations; `None` if the model does not reach its end.
fn answer(problem: &Problem, idea: &Idea, measured: &[(Quantity, f64)], index: usize, x: &[f64]) -> Option<Vec<f64>> {
    let run = &problem.runs[index];
    let mut machine = problem.stage_at(x);
    (idea.change)(&mut machine);
    if idea.reversed {
        machine.drives[0].amplifier.gain = -machine.drives[0].amplifier.gain;
    }
    let quantities: Vec<Quantity> = measured.iter().map(|(quantity, _)| *quantity).collect();
    let extras = problem.extras_of(index, x);
    let mut columns = vec![Vec::new(); quantities.len()];
    if !run.predict(&mut Bench::default(), &machine, &extras, &quantities, &mut columns) {
        return None;
    }
    let mut values = Vec::new();
    for (column, (quantity, sigma)) in columns.iter().zip(measured) {
        let output = run.seen.iter().position(|seen| seen.quantity == *quantity);
        let read = output.map_or_else(|| column.clone(), |output| run.read(output, column, &extras));
        values.extend(read.iter().map(|value| value / sigma));
    }
    Some(values)
}

/// True if some log has motion in both directions.
fn turns_round(problem: &Problem) -> bool {
    let (mut most, mut least) = (0.0_f64, 0.0_f64);
    for u in problem.runs.iter().flat_map(|run| &run.logged[0]) {
        (most, least) = (most.max(*u), least.min(*u));
    }
    most.min(-least) > 0.2 * most.max(-least)
}

fn has(problem: &Problem, quantity: Quantity) -> bool {
    problem.quantities().contains(&quantity)
}

/// True if the current is measured, or is the input.
fn knows_current(problem: &Problem) -> bool {
    has(problem, Quantity::MotorCurrent) || problem.machine.drives[0].amplifier.mode == AmplifierMode::Current
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;

    /// An encoder at the cart is as fine as the present one: along the belt, if that measures an angle.
    #[test]
    fn an_encoder_at_the_cart_has_the_resolution_of_the_present_one() {
        let (case, plan) = case(false);
        let problem = Problem::new(&case, &plan).unwrap();
        assert_eq!(cart_noise(&problem, &[(Quantity::CartSpeed, 0.1), (Quantity::CartPosition, 2e-6)]), 2e-6);
        assert_eq!(cart_noise(&problem, &[(Quantity::DriveAngle, 1e-3)]), 1e-3 * case.machine.pulley_radius);
        assert_eq!(cart_noise(&problem, &[]), 10e-6);
    }
}
