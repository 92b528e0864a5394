//! First guess without simulation: torque balance of a rigid axis by linear regression.
//!
//! ```text
//! τ_M = J φ̈ + B φ̇ + C sgn φ̇ + T₀                at the drive pulley, everything moving together
//! ```
//!
//! τ_M follows from the logged input, φ̇ and φ̈ from the logged positions by derivatives of a Gaussian that weighs a
//! few rows. This is the method of the inverse dynamic model (M. Gautier, W. Khalil 1990); noise in positions biases
//! it, so it is only a start for a search.

use super::triangle::inverse_of_square;
use crate::fit::asked::problem::Problem;
use crate::fit::asked::run::FittedLog;
use crate::fit::limits::{
    LONGEST_DELAY, LONGEST_SHIFT, REGRESSION_BLOCK, REGRESSION_NOISE, REST_ROWS, SHIFT_SHARE, SHIFT_STRIDE,
    SHIFT_UNEXPLAINED, SHORTEST_DELAY, SUSPECT_DELAY, SUSPECT_SHIFT, WIDEST_IN_REGRESSION, WIDTHS,
};
use crate::log::Quantity;
use crate::machine::{AmplifierMode, Machine};
use crate::parameter::{Free, Sum, at_pulley, value};
use nalgebra::{DMatrix, DVector};
use std::ops::RangeInclusive;

/// Torque balance of a rigid axis, at the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Total inertia J, kg m².
    pub inertia: f64,
    /// Total viscous friction B, N m s/rad, without back-EMF.
    pub viscous: f64,
    /// Total Coulomb friction C, N m.
    pub coulomb: f64,
    /// Constant torque T₀ of the motor, N m.
    pub load: f64,
    /// Standard errors of the four, as if the equations were independent.
    pub errors: [f64; 4],
    /// RMS of the residual relative to that of the torque.
    pub unexplained: f64,
    /// Equations.
    pub equations: usize,
}

/// The balance over all logs of a problem; `None` without evenly sampled positions or sufficient motion.
pub fn regression(problem: &Problem) -> Option<Balance> {
    balance(&smoothed(problem), 0)
}

/// A log with the derivatives of its position.
pub(crate) struct Smoothed<'a> {
    run: &'a FittedLog,
    machine: &'a Machine,
    output: usize,
    /// Rows without derivatives at each end.
    margin: usize,
    /// φ̇ and φ̈
    derivatives: Vec<[f64; 2]>,
}

/// Delay of the input, of either sign, that leaves clearly less unexplained torque, s; `None` if there is none.
pub(crate) fn suspected_delay(problem: &Problem) -> Option<f64> {
    let logs = smoothed(problem);
    let late = least_left(&logs, -LONGEST_DELAY..=LONGEST_DELAY, 1, SUSPECT_DELAY)?;
    (late.abs() >= SHORTEST_DELAY).then(|| late as f64 * problem.runs[0].interval())
}

/// Rows by which the input of the log of this name was logged too early, beyond a plausible delay; negative if too
/// late. None if no shift leaves far less unexplained torque.
pub(crate) fn suspected_shift(problem: &Problem, name: &str) -> Option<isize> {
    let mut logs = smoothed(problem);
    logs.retain(|log| log.run.name == name);
    let rows = logs.iter().map(|log| log.run.time.len()).min()?;
    if balance(&logs, 0)?.unexplained < SHIFT_UNEXPLAINED {
        return None;
    }
    let most = LONGEST_SHIFT.min((SHIFT_SHARE * rows as f64) as isize);
    let rough = least_left(&logs, -most..=most, SHIFT_STRIDE, SUSPECT_SHIFT)?;
    let late = least_left(&logs, rough - SHIFT_STRIDE..=rough + SHIFT_STRIDE, 1, f64::INFINITY)?;
    (late.abs() > LONGEST_DELAY).then_some(late)
}

/// The delay among these rows, `apart` rows apart, with the least unexplained torque; `None` if that exceeds `most`
/// times the value without delay.
fn least_left(logs: &[Smoothed], rows: RangeInclusive<isize>, apart: isize, most: f64) -> Option<isize> {
    let left = |late: isize| Some((late, balance(logs, late)?.unexplained));
    let tried = rows.step_by(apart.unsigned_abs()).filter_map(left);
    let (late, least) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (least <= most * left(0)?.1).then_some(late)
}

/// The logs of a problem with evenly sampled positions, for [`balance`].
pub(crate) fn smoothed<'a>(problem: &'a Problem) -> Vec<Smoothed<'a>> {
    let noise = problem.noise();
    let mut all = Vec::new();
    // A single torque balance requires a single coordinate.
    if !problem.machine.has_torque_balance() {
        return all;
    }
    for run in problem.runs.iter().filter(|run| run.is_even()) {
        let seen = run.seen.iter().position(|seen| seen.quantity.is_position() && !seen.absolute);
        if let Some(output) = seen {
            all.extend(Smoothed::new(run, &problem.machine, output, noise.deviation(run.seen[output].quantity)));
        }
    }
    all
}

/// The balance with inputs `late` rows later than logged.
pub(crate) fn balance(logs: &[Smoothed], late: isize) -> Option<Balance> {
    let mut rows: Vec<[f64; 5]> = Vec::new();
    for log in logs {
        log.add_to(late, &mut rows);
    }
    let n = rows.len();
    if n < 12 {
        return None;
    }
    let matrix = DMatrix::from_fn(n, 4, |i, j| rows[i][j]);
    let torque = DVector::from_fn(n, |i, _| rows[i][4]);
    let inverse = inverse_of_square(&matrix)?;
    let found = &inverse * matrix.tr_mul(&torque);
    let left = (&torque - &matrix * &found).norm_squared();
    let variance = left / (n - 4) as f64;
    Some(Balance {
        inertia: found[0],
        viscous: found[1],
        coulomb: found[2],
        load: found[3],
        errors: std::array::from_fn(|j| (variance * inverse[(j, j)]).sqrt()),
        unexplained: (left / torque.norm_squared().max(f64::MIN_POSITIVE)).sqrt(),
        equations: n,
    })
}

impl<'a> Smoothed<'a> {
    /// Regression of one output of a run; `None` if it is too short.
    fn new(run: &'a FittedLog, machine: &'a Machine, output: usize, noise: f64) -> Option<Self> {
        let seen = &run.seen[output];
        let (n, h) = (run.fitted_rows.min(run.time.len()), run.interval());
        let mut derivatives = None;
        for width in WIDTHS.into_iter().filter(|width| *width <= WIDEST_IN_REGRESSION) {
            let Some(found) = derived(&seen.values[..n], width, h) else { break };
            let size = (found.iter().map(|[_, a]| a * a).sum::<f64>() / found.len() as f64).sqrt();
            // Deviation of white noise behind the second derivative of a Gaussian: σ √(3/(8 √π)) / w^(5/2), per
            // interval squared
            let trembles = noise * (3.0 / (8.0 * std::f64::consts::PI.sqrt())).sqrt() / width.powf(2.5) / (h * h);
            derivatives = Some((width, found));
            if trembles < REGRESSION_NOISE * size {
                break;
            }
        }
        let (width, mut derivatives) = derivatives?;
        if seen.quantity == Quantity::CartPosition {
            derivatives.iter_mut().flatten().for_each(|value| *value /= machine.pulley_radius);
        }
        Some(Self { run, machine, output, margin: reach(width), derivatives })
    }

    /// Adds its equations: φ̈, φ̇, sgn φ̇, 1 and the torque.
    fn add_to(&self, late: isize, rows: &mut Vec<[f64; 5]>) {
        let Self { run, machine, .. } = self;
        let seen = &run.seen[self.output];
        let mut block: Vec<[f64; 5]> = Vec::with_capacity(REGRESSION_BLOCK);
        for (k, &[speed, acceleration]) in self.derivatives.iter().enumerate() {
            let row = k + self.margin;
            let input = run.logged[0][row.saturating_add_signed(-late).min(run.time.len() - 1)];
            let torque = torque(machine, input, speed);
            let moves = speed != 0.0 && seen.repeats[row] < REST_ROWS && seen.alike[row] < REST_ROWS;
            if moves && torque.is_finite() && acceleration.is_finite() {
                block.push([acceleration, speed, speed.signum(), 1.0, torque]);
            } else {
                block.clear();
            }
            if block.len() == REGRESSION_BLOCK {
                rows.push(std::array::from_fn(|j| {
                    block.iter().map(|row| row[j]).sum::<f64>() / REGRESSION_BLOCK as f64
                }));
                block.clear();
            }
        }
    }
}

/// Torque of the motor of an axis at the drive pulley, N m, at an input of its amplifier and a speed of the pulley
/// (rad/s); without inductance.
pub(crate) fn torque(machine: &Machine, input: f64, speed: f64) -> f64 {
    let (motor, amplifier) = (&machine.drives[0].motor, &machine.drives[0].amplifier);
    let n = motor.gear_ratio;
    let given = amplifier.gain * input;
    let clipped = |value: f64, limit: Option<f64>| limit.map_or(value, |limit| value.clamp(-limit, limit));
    // τ_M = η n K_t i, i = (V − K_e n φ̇)/R
    let current = match amplifier.mode {
        AmplifierMode::Current | AmplifierMode::Position => given,
        AmplifierMode::Voltage => {
            (clipped(given, amplifier.voltage_limit) - motor.back_emf_constant * n * speed) / motor.resistance
        }
    };
    motor.gear_efficiency * n * motor.torque_constant * clipped(current, amplifier.current_limit)
}

/// Number of rows to each side within a Gaussian of this width.
pub(crate) fn reach(width: f64) -> usize {
    (5.0 * width).ceil() as usize
}

/// Offsets in rows and the weights of a Gaussian of this width.
fn bell(width: f64) -> (Vec<f64>, Vec<f64>) {
    let reach = reach(width) as i64;
    let offsets: Vec<f64> = (-reach..=reach).map(|k| k as f64).collect();
    let bell = offsets.iter().map(|x| (-x * x / (2.0 * width * width)).exp()).collect();
    (offsets, bell)
}

/// `values` smoothed as [`derived`] smooths their derivatives, without the margins.
pub(crate) fn averaged(values: &[f64], width: f64) -> Vec<f64> {
    let (_, bell) = bell(width);
    let total: f64 = bell.iter().sum();
    let mean = |window: &[f64]| window.iter().zip(&bell).map(|(v, w)| v * w).sum::<f64>() / total;
    values.windows(bell.len()).map(mean).collect()
}

/// First and second derivative of `values` at interval `h`, smoothed, without the margins; exact for parabolas.
pub(crate) fn derived(values: &[f64], width: f64, h: f64) -> Option<Vec<[f64; 2]>> {
    let (offsets, bell) = bell(width);
    if values.len() < offsets.len() + 9 {
        return None;
    }
    let total: f64 = bell.iter().sum();
    let variance = offsets.iter().zip(&bell).map(|(x, g)| x * x * g).sum::<f64>() / total;
    // Weights x g for the slope, (x² − x̄²) g for the curvature.
    let first: Vec<f64> = offsets.iter().zip(&bell).map(|(x, g)| x * g).collect();
    let second: Vec<f64> = offsets.iter().zip(&bell).map(|(x, g)| (x * x - variance) * g).collect();
    let slope = h * offsets.iter().zip(&first).map(|(x, w)| x * w).sum::<f64>();
    let curvature = h * h * offsets.iter().zip(&second).map(|(x, w)| x * x * w).sum::<f64>() / 2.0;
    let found = values.windows(offsets.len()).map(|window| {
        let sum = |weights: &[f64]| window.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>();
        [sum(&first) / slope, sum(&second) / curvature]
    });
    Some(found.collect())
}

impl Balance {
    /// Values of the free parameters for which the machine's totals match the balance, if plausible.
    pub fn guess(&self, problem: &Problem) -> Vec<f64> {
        let mut values: Vec<f64> = problem.parameters.iter().map(|parameter| parameter.start).collect();
        let totals = [(Sum::Inertia, self.inertia), (Sum::Viscous, self.viscous), (Sum::Coulomb, self.coulomb)];
        let machine = &problem.machine;
        for ((sum, wanted), forward) in totals.into_iter().flat_map(|total| [(total, true), (total, false)]) {
            let keys: Vec<&str> = sum.parts(forward).map(|row| row.key).collect();
            let own = |free: &Free| free.keys.iter().all(|(key, _)| keys.contains(&key.as_str()));
            let part = |free: &Free| -> f64 {
                free.keys.iter().map(|(key, factor)| factor * free.start * at_pulley(machine, key)).sum()
            };
            let total: f64 = keys.iter().map(|key| value(machine, key).unwrap_or(0.0) * at_pulley(machine, key)).sum();
            // For parameters of single campaigns, that of the first campaign.
            let first = |(_, of): &(&Free, &Option<usize>)| of.is_none_or(|of| of == 0);
            let counted = problem.parameters.iter().zip(&problem.of).filter(first).map(|(free, _)| free);
            let searched: f64 = counted.filter(|free| own(free)).map(part).sum();
            let factor = (wanted - (total - searched)) / searched;
            if searched > 0.0 && factor > 0.02 && factor < 50.0 {
                for (value, free) in values.iter_mut().zip(&problem.parameters).filter(|(_, free)| own(free)) {
                    *value = (free.start * factor).clamp(free.low, free.high);
                }
            }
        }
        for (value, parameter) in values
            .iter_mut()
            .zip(&problem.parameters)
            .filter(|(_, parameter)| parameter.keys.iter().any(|(key, _)| key == "cart.load"))
        {
            let other = machine.cart.constant_force() - machine.cart.load;
            *value = (-self.load / machine.pulley_radius - other).clamp(parameter.low, parameter.high);
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::normal;
    use crate::fit::asked::problem::tests::case;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;
    use std::f64::consts::{PI, TAU};
    use std::sync::Arc;

    /// Inertia, viscous and Coulomb friction, and constant torque.
    const KNOWN: [f64; 4] = [2e-4, 2e-3, 0.05, 0.02];

    /// A log of the angles `seen`, one each millisecond, while the voltage turns the drive pulley to `turned`.
    fn logged(turned: &[f64], seen: &[f64]) -> Problem<'static> {
        let (mut case, plan) = case(false);
        let motor = case.machine.drives[0].motor;
        let voltage = |k: usize| {
            let [a, b, c] = [k.saturating_sub(1), k, (k + 1).min(turned.len() - 1)].map(|k| turned[k]);
            let (speed, acceleration) = ((c - a) / 2e-3, (a - 2.0 * b + c) / 1e-6);
            let sign = if speed == 0.0 { 0.0 } else { speed.signum() };
            let torque = KNOWN[0] * acceleration + KNOWN[1] * speed + KNOWN[2] * sign + KNOWN[3];
            torque / motor.torque_constant * motor.resistance + motor.back_emf_constant * speed
        };
        let log = Arc::make_mut(case.experiments[0].log.as_mut().unwrap());
        log.time = (0..turned.len()).map(|k| 1e-3 * k as f64).collect();
        log.inputs = vec![(0..turned.len()).map(voltage).collect()];
        log.outputs.truncate(1);
        log.outputs[0].values = seen.to_vec();
        Problem::new(&case, &plan).unwrap()
    }

    /// To and fro by 5 rad, three times a second.
    fn sway(rows: usize) -> Vec<f64> {
        (0..rows).map(|k| 5.0 * (3e-3 * TAU * k as f64).sin()).collect()
    }

    /// Greatest relative error of the four numbers.
    fn error(found: &Balance) -> f64 {
        let numbers = [found.inertia, found.viscous, found.coulomb, found.load];
        numbers.iter().zip(KNOWN).map(|(own, known)| (own / known - 1.0).abs()).fold(0.0, f64::max)
    }

    /// Ten rows at each end have no derivatives.
    #[test]
    fn a_thousand_rows_in_motion_make_two_hundred_equations() {
        let turned = sway(1020);
        let found = regression(&logged(&turned, &turned)).unwrap();
        assert!(found.equations == 200 && error(&found) < 0.01, "{found:?}");
    }

    /// At rest friction has any value up to breakaway.
    #[test]
    fn rows_at_rest_tell_nothing_of_friction() {
        // To and fro by 2 rad in 100 rows, with 40 rows of rest between.
        let turn = |k: usize| {
            let u = f64::min((k % 140) as f64 / 100.0, 1.0);
            let way = 2.0 * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            if (k / 140).is_multiple_of(2) { way } else { 2.0 - way }
        };
        let turned: Vec<f64> = (0..1400).map(turn).collect();
        let found = regression(&logged(&turned, &turned)).unwrap();
        assert!(error(&found) < 0.03, "{found:?}");
    }

    /// Noise in the acceleration makes the inertia seem smaller, by its share in the mean square.
    #[test]
    fn an_inertia_is_found_beside_noise() {
        let (turned, mut random) = (sway(2000), Pcg64::seed_from_u64(1));
        let seen: Vec<f64> = turned.iter().map(|angle| angle + 0.044 * normal(&mut random)).collect();
        let found = regression(&logged(&turned, &seen)).unwrap();
        assert!((found.inertia / KNOWN[0] - 1.0).abs() < 0.08, "{found:?}");
    }

    /// A sweep of 560 rows between 220 rows of rest.
    #[test]
    fn an_input_that_is_off_by_a_fifth_of_the_log_is_found() {
        let turn = |k: usize| {
            let u = ((k as f64 - 220.0) / 560.0).clamp(0.0, 1.0);
            5.0 * (PI * u).sin().powi(2) * (TAU * (2.0 * u + 4.0 * u * u)).sin()
        };
        let turned: Vec<f64> = (0..1000).map(turn).collect();
        let mut problem = logged(&turned, &turned);
        let (name, voltage) = (problem.runs[0].name.clone(), problem.runs[0].logged[0].clone());
        for early in [200, -200] {
            problem.runs[0].logged[0] = (0..1000).map(|k: isize| voltage[(k + early).clamp(0, 999) as usize]).collect();
            assert_eq!(suspected_shift(&problem, &name), Some(early));
        }
    }

    #[test]
    fn derivatives_of_a_parabola_are_exact() {
        let (h, f) = (0.01, |t: f64| 3.0 - 2.0 * t + 5.0 * t * t);
        let values: Vec<f64> = (0..100).map(|k| f(f64::from(k) * h)).collect();
        for (k, [speed, acceleration]) in derived(&values, 3.0, h).unwrap().into_iter().enumerate() {
            let t = (k + reach(3.0)) as f64 * h;
            assert!((speed - (10.0 * t - 2.0)).abs() < 1e-9 && (acceleration - 10.0).abs() < 1e-7);
        }
    }
}
