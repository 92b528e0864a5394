//! Passes over the travel in one direction, and the force that the model lacks along each.

use crate::chance::median;
use crate::error::{Error, Result};
use crate::fit::limits::{MAP_ROWS, MAP_SMOOTHING, MAP_SPEED, WIDTHS};
use crate::fit::search::regression::{averaged, derived, reach, torque};
use crate::log::{Log, Quantity};
use crate::machine::Machine;
use crate::machine::rigid::Rigid;

/// A pass in one direction.
#[derive(Debug, Clone)]
pub(super) struct Pass {
    /// True towards larger x.
    pub is_forward: bool,
    /// Position and missing force of each row, m and N.
    pub rows: Vec<[f64; 2]>,
    /// Median speed, m/s, positive.
    pub speed: f64,
    /// Deviation of the Gaussian that smooths it, m.
    pub smoothing: f64,
}

impl Pass {
    /// The interval that it covers, m.
    pub fn ends(&self) -> [f64; 2] {
        let [first, last] = [self.rows.first(), self.rows.last()].map(|row| row.map_or(0.0, |row| row[0]));
        [first.min(last), first.max(last)]
    }

    /// m
    pub fn length(&self) -> f64 {
        let [low, high] = self.ends();
        high - low
    }

    /// Least-squares line through `count` points from `low`, at intervals of `step`; none if points have too few rows.
    ///
    /// With the hat functions φ_i of the points the equations Σ_k φ_i φ_j y_j = Σ_k φ_i f_k are tridiagonal.
    pub fn line(&self, low: f64, step: f64, count: usize) -> Option<Vec<f64>> {
        let (mut own, mut next, mut right) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        for [x, force] in &self.rows {
            let place = (x - low) / step;
            let index = place.floor();
            if !(0.0..(count - 1) as f64).contains(&place) {
                continue;
            }
            let (i, share) = (index as usize, place - index);
            own[i] += (1.0 - share).powi(2);
            own[i + 1] += share.powi(2);
            next[i] += share * (1.0 - share);
            right[i] += (1.0 - share) * force;
            right[i + 1] += share * force;
        }
        if own.iter().any(|weight| *weight < 0.1 * MAP_ROWS as f64) {
            return None;
        }
        for i in 1..count {
            let factor = next[i - 1] / own[i - 1];
            own[i] -= factor * next[i - 1];
            right[i] -= factor * right[i - 1];
        }
        for i in (0..count).rev() {
            let behind = if i + 1 < count { next[i] * right[i + 1] } else { 0.0 };
            right[i] = (right[i] - behind) / own[i];
        }
        Some(right)
    }
}

/// The passes of a log; `step` is about the distance of points of the map, m.
pub(super) fn passes(machine: &Machine, log: &Log, step: f64) -> Result<Vec<Pass>> {
    let mut way = way(machine, log)?;
    let interval = |n: usize| (log.time[n - 1] - log.time[0]) / (n.max(2) - 1) as f64;
    let is_even = |n: usize| {
        let h = interval(n);
        log.time[..n].iter().enumerate().all(|(k, t)| (t - log.time[0] - k as f64 * h).abs() < 0.05 * h)
    };
    // The last row of a move may be at its end, off the grid of the others.
    if way.len() > 2 && !is_even(way.len()) && is_even(way.len() - 1) {
        way.pop();
    }
    let n = way.len();
    let h = interval(n);
    if !is_even(n) {
        return Err(Error::new("its rows are not evenly spaced in time").in_key(log).next("log at a constant rate"));
    }
    let too_short = || {
        Error::new(format!("{n} rows are too few for a map")).in_key(log).next("log slow motion over the whole travel")
    };
    // A first estimate with few rows gives the speed, and the speed the final width.
    let first = derived(&way, WIDTHS[6], h).ok_or_else(too_short)?;
    let usual = usual(first.iter().map(|[speed, _]| speed.abs()));
    let wanted = MAP_SMOOTHING * step / (usual * h);
    let width = WIDTHS.into_iter().rev().find(|width| *width <= wanted).unwrap_or(WIDTHS[0]);
    let motion = derived(&way, width, h).ok_or_else(too_short)?;
    let (position, margin) = (averaged(&way, width), reach(width));
    let (rigid, r) = (Rigid::new(machine), machine.pulley_radius);
    let motor: Vec<f64> = (0..n)
        .map(|k| {
            // Speeds at the ends are those of the nearest row with a speed.
            let [speed, _] = motion[k.saturating_sub(margin).min(motion.len() - 1)];
            torque(machine, log.inputs[0][k], speed / r) / r
        })
        .collect();
    let motor = averaged(&motor, width);
    let cart = &machine.cart;
    let force = |k: usize| {
        let ([speed, acceleration], x) = (motion[k], position[k]);
        let (viscous, mut dry) = rigid.friction(speed, speed.signum());
        if let Some(along) = &cart.along {
            dry += (along.value(x) - 1.0) * cart.friction.side(speed > 0.0).coulomb * speed.signum();
        }
        let own = cart.forces.along.as_ref().map_or(0.0, |line| line.value(x))
            + cart.forces.by_speed.as_ref().map_or(0.0, |line| line.value(speed));
        // M ẍ = f_M − b ẋ − F_c sgn ẋ + F₀ + F_x + ΔF
        rigid.mass * acceleration + viscous + dry - rigid.constant - own - motor[k]
    };
    let mut all = Vec::new();
    let mut begin = 0;
    let is_slow = |k: usize| motion[k][0].abs() < 0.2 * MAP_SPEED * usual;
    for k in 0..=motion.len() {
        let goes_on = k < motion.len() && !is_slow(k) && (k == begin || motion[k][0] * motion[k - 1][0] > 0.0);
        if goes_on {
            continue;
        }
        if k > begin {
            // The Gaussian must not reach back over the reversal.
            let from = begin + (3.0 * width) as usize;
            let to = k.saturating_sub((3.0 * width) as usize);
            let speed = middle(motion[begin..k].iter().map(|[speed, _]| speed.abs()));
            let is_fast = |k: &usize| motion[*k][0].abs() >= MAP_SPEED * speed;
            if let (Some(from), Some(to)) = ((from..to).find(is_fast), (from..to).rev().find(is_fast)) {
                let rows = (from..=to).map(|k| [position[k], force(k)]).collect();
                let smoothing = width * h * speed;
                all.push(Pass { is_forward: motion[begin][0] > 0.0, rows, speed, smoothing });
            }
        }
        begin = if k < motion.len() && !is_slow(k) { k } else { k + 1 };
    }
    Ok(all)
}

/// Interval covered by a log, m.
pub(super) fn travelled(machine: &Machine, log: &Log) -> Result<[f64; 2]> {
    let way = way(machine, log)?;
    Ok([way.iter().copied().fold(f64::INFINITY, f64::min), way.iter().copied().fold(f64::NEG_INFINITY, f64::max)])
}

/// The position of the cart along a log, m.
fn way(machine: &Machine, log: &Log) -> Result<Vec<f64>> {
    let is_wanted = |quantity: Quantity| {
        matches!(quantity, Quantity::CartPosition | Quantity::DriveAngle | Quantity::RotorAngle | Quantity::IdlerAngle)
    };
    let output = log.outputs.iter().find(|output| is_wanted(output.quantity) && !output.absolute).ok_or_else(|| {
        Error::new("it has no position")
            .in_key(log)
            .allowed("cart_position, drive_angle, rotor_angle or idler_angle")
            .next("name the column of the encoder, such as drive_angle = \"angle_rad\"")
    })?;
    if output.values.iter().any(|value| !value.is_finite()) {
        return Err(Error::new("its positions have values that are missing").in_key(log).next("keep complete rows"));
    }
    let arm = if output.quantity == Quantity::CartPosition { 1.0 } else { machine.pulley_radius };
    Ok(output.values.iter().map(|value| arm * value).collect())
}

/// An error of a log.
trait OfLog {
    fn in_key(self, log: &Log) -> Self;
}

impl OfLog for Error {
    fn in_key(self, log: &Log) -> Self {
        self.in_file(format!("log of \"{}\"", log.name))
    }
}

fn middle(values: impl Iterator<Item = f64>) -> f64 {
    median(&mut values.collect::<Vec<f64>>())
}

/// Median of the values above a tenth of the largest.
fn usual(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = values.clone().fold(f64::MIN_POSITIVE, f64::max);
    middle(values.filter(|value| *value > 0.1 * most)).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};
    use crate::log::Output;
    use crate::signal::Hold;

    #[test]
    fn the_least_squares_line_of_a_broken_line_is_that_line() {
        let nodes = [1.0, -2.0, 0.5, 4.0, 3.0];
        let (low, step) = (0.1, 0.02);
        let rows = (0..400).map(|k| {
            let place = 0.01 * f64::from(k);
            let (i, share) = (place as usize, place.fract());
            [low + step * place, nodes[i] + share * (nodes[i + 1] - nodes[i])]
        });
        let pass = Pass { is_forward: true, rows: rows.collect(), speed: 0.1, smoothing: 0.0 };
        let found = pass.line(low, step, nodes.len()).unwrap();
        for (found, node) in found.iter().zip(nodes) {
            assert!((found - node).abs() < 1e-9, "{found} for {node}");
        }
        // Points beyond the rows have none.
        assert!(pass.line(low, step, nodes.len() + 2).is_none());
    }

    /// A Gaussian of a quarter of their distance keeps what a line through the points can follow; the widths that are
    /// tried are up to 1.5 apart.
    #[test]
    fn a_log_is_smoothed_over_less_than_the_distance_of_points() {
        let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let (speed, every, rows) = (0.05, 1e-3, 8000);
        let place = |k: usize| speed * every * k.min(rows - k) as f64;
        let position =
            Output { quantity: Quantity::CartPosition, absolute: false, values: (0..=rows).map(place).collect() };
        let log = Log {
            name: "slow".into(),
            file: Default::default(),
            time: (0..=rows).map(|k| every * k as f64).collect(),
            inputs: vec![vec![1.0; rows + 1]],
            added: None,
            hold: Hold::Zero,
            reference: None,
            outputs: vec![position],
            ended: None,
        };
        for step in [0.7e-3, 1.3e-3, 2.9e-3] {
            let all = passes(&machine, &log, step).unwrap();
            assert_eq!(all.len(), 2);
            for Pass { smoothing, .. } in all {
                let share = smoothing / step;
                assert!((0.16..0.27).contains(&share), "{step}: {share}");
            }
        }
    }
}
