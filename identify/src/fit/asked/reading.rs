//! The coordinates of a machine as the outputs of a log show them: where its slides are, without strain of the belt.

use super::run::FittedLog;
use crate::log::Quantity;
use crate::machine::Machine;

/// The position of a slide, m, as a sum over outputs of a log that are positions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reading {
    /// Outputs by their numbers, and their weights in the position, m per unit of each.
    parts: Vec<(usize, f64)>,
}

impl Reading {
    /// The position of a slide by the first output that shows it alone, or else by the angles of all drives; `None` if
    /// the log has neither.
    pub fn new(run: &FittedLog, machine: &Machine, slide: usize) -> Option<Self> {
        let (geometry, r) = (machine.geometry(), machine.pulley_radius);
        let arm = |quantity: Quantity| if quantity.is_linear() { 1.0 } else { r };
        let shows_alone = |quantity: Quantity| {
            // At the belt, where the angle of a pulley counts times its radius.
            let weights = geometry.by_slides(quantity, 1.0);
            let is_alone = weights.iter().enumerate().all(|(k, weight)| (*weight != 0.0) == (k == slide));
            weights.get(slide).filter(|_| is_alone).map(|weight| arm(quantity) / weight)
        };
        let alone = run.seen.iter().enumerate().find_map(|(k, seen)| Some((k, shows_alone(seen.quantity)?)));
        if let Some(part) = alone {
            return Some(Self { parts: vec![part] });
        }
        let of_drive = |pulley: usize, weight: f64| {
            let turns_with = |quantity: Quantity| {
                let drive = geometry.drives.iter().find(|drive| drive.pulley == pulley);
                let names = [Some(geometry.label(pulley).key), drive.map(|drive| drive.rotor.key)];
                quantity.is_position() && names.contains(&quantity.body())
            };
            let output = run.seen.iter().position(|seen| turns_with(seen.quantity))?;
            Some((output, r * weight))
        };
        let drives = geometry.drives.iter().zip(geometry.slides[slide].by_drives);
        let parts: Option<Vec<_>> = drives.map(|(drive, weight)| of_drive(drive.pulley, *weight)).collect();
        parts.map(|parts| Self { parts })
    }

    /// The output of this quantity by itself, in its unit.
    pub fn of_output(run: &FittedLog, quantity: Quantity) -> Self {
        let output = run.seen.iter().position(|seen| seen.quantity == quantity);
        Self { parts: output.map(|output| (output, 1.0)).into_iter().collect() }
    }

    /// True if an output is a part of it.
    pub fn takes(&self, output: usize) -> bool {
        self.parts.iter().any(|(own, _)| *own == output)
    }

    /// The position in each row of a run, NaN where an output is missing.
    pub fn values(&self, run: &FittedLog) -> Vec<f64> {
        let row = |k: usize| self.parts.iter().map(|(output, weight)| run.seen[*output].values[k] * weight).sum();
        (0..run.time.len()).map(row).collect()
    }

    /// Its standard deviation, from those of the outputs; `None` if one of them is unknown.
    pub fn deviation(&self, run: &FittedLog, of: impl Fn(Quantity) -> Option<f64>) -> Option<f64> {
        let parts = self.parts.iter().map(|(output, weight)| Some(weight.abs() * of(run.seen[*output].quantity)?));
        let parts: Option<Vec<f64>> = parts.collect();
        parts.map(|parts| parts.into_iter().fold(0.0, f64::hypot))
    }

    /// Greatest minus least position, m; of several outputs at most that.
    pub fn extent(&self, run: &FittedLog, of: impl Fn(&[f64]) -> f64) -> f64 {
        self.parts.iter().map(|(output, weight)| weight.abs() * of(&run.seen[*output].values)).sum()
    }

    /// The speed at the start of a log or window, m/s, from a line through its first rows, and its standard error for
    /// these deviations of the outputs.
    pub fn speed_at_start(&self, run: &FittedLog, of: impl Fn(Quantity) -> Option<f64>) -> (f64, f64) {
        let is_there = |k: &usize| self.parts.iter().all(|(output, _)| run.seen[*output].values[*k].is_finite());
        let rows: Vec<usize> = (0..run.time.len().min(15)).filter(is_there).collect();
        let n = rows.len().max(1) as f64;
        let t = rows.iter().map(|&k| run.time[k]).sum::<f64>() / n;
        let below: f64 = rows.iter().map(|&k| (run.time[k] - t).powi(2)).sum();
        if below <= 0.0 {
            return (0.0, 0.0);
        }
        // Σ w (t − t̄)(y − ȳ)/Σ (t − t̄)²
        let slope = |(output, weight): &(usize, f64)| {
            let values = &run.seen[*output].values;
            let y = rows.iter().map(|&k| values[k]).sum::<f64>() / n;
            let above: f64 = rows.iter().map(|&k| (run.time[k] - t) * (values[k] - y)).sum();
            weight * above / below
        };
        let deviation = self.deviation(run, of).unwrap_or_default();
        (self.parts.iter().map(slope).sum(), deviation / below.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::Problem;
    use crate::fit::asked::problem::tests::case;

    /// x = r φ by the angle, or the position of the cart itself; and the speed of a straight line.
    #[test]
    fn a_position_is_read_from_an_angle_or_directly() {
        let (case, plan) = case(false);
        let mut run = Problem::new(&case, &plan).unwrap().runs[0].clone();
        let r = case.machine.pulley_radius;
        assert_eq!([0, 1].map(|k| run.seen[k].quantity), [Quantity::DriveAngle, Quantity::CartPosition]);
        let time = run.time.clone();
        for (seen, factor) in run.seen.iter_mut().zip([1.0 / r, 1.0]) {
            seen.values = time.iter().map(|t| factor * (0.3 + 0.2 * t)).collect();
        }
        for _ in 0..2 {
            let own = Reading::new(&run, &case.machine, 0).unwrap();
            assert!(own.values(&run).iter().zip(&time).all(|(x, t)| (x - 0.3 - 0.2 * t).abs() < 1e-12));
            assert!((own.speed_at_start(&run, |_| None).0 - 0.2).abs() < 1e-9);
            run.seen.remove(0);
        }
        assert!(Reading::new(&run, &case.machine, 0).is_none());
    }
}
