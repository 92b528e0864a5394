//! Margins of controllers around measured frequency responses.

use super::Frf;
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::number::engineering;
use crate::signal::Hold;
use nalgebra::{Complex, DMatrix};
use std::f64::consts::PI;

/// Margins of L = N_y G/D with a measured G, over the frequencies at which it is coherent. For several drives, G is a
/// matrix with a row for each measured position and a column for each input, and N_y/D is equal for all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// max |1/(1 + L)|, for several drives the largest singular value of (1 + L)⁻¹, and its frequency, rad/s.
    pub sensitivity: (f64, f64),
    /// Its upper bound with G anywhere in its circle; infinite if a circle contains −1.
    pub sensitivity_at_most: f64,
    /// Phase margin of the loop of one drive with the others closed, rad, and the frequency of |L| = 1, rad/s.
    pub phase: Option<(f64, f64)>,
    /// Gain margin of that loop, and the frequency at which L crosses the negative real axis, rad/s.
    pub gain: Option<(f64, f64)>,
    /// True if it holds for small motions around rest only, since the controller is not linear.
    pub is_at_rest: bool,
    /// Delay of the controller that the logs do not contain, s, and that is added; below zero if they contain more.
    pub late: f64,
    /// Lowest and highest frequency evaluated, rad/s.
    pub range: [f64; 2],
}

/// Margins of a design with the responses of the positions measured by its drives, one row of `matrix` for each;
/// `length` is metres per unit of these, `late` a delay that they do not contain, s. Gain and phase margin belong to
/// the loop of `drive`.
pub fn measured(
    matrix: &[Vec<&Frf>],
    drive: usize,
    design: &Design,
    machine: &Machine,
    (length, late): (f64, f64),
) -> Result<Measured> {
    let feedback = Feedback::new(design, machine)?;
    let own = matrix[drive][drive];
    if (own.every / design.every - 1.0).abs() > 1e-6 {
        return Err(Error::new(format!(
            "the log is sampled every {} s, the controller every {} s",
            own.every, design.every
        ))
        .next("log at the controller's samples for margins"));
    }
    if own.hold != Hold::Zero {
        return Err(Error::new("the input of the log is straight between samples, the controller's is held")
            .next("log a held input for margins"));
    }
    let points: Vec<(f64, DMatrix<Complex<f64>>, f64)> =
        own.coherent().filter_map(|point| at(matrix, point.omega)).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Err(Error::new("no frequency is coherent").next("excite the machine harder, or for longer"));
    };
    let mut found = Measured {
        sensitivity: (0.0, 0.0),
        sensitivity_at_most: 0.0,
        phase: None,
        gain: None,
        is_at_rest: !feedback.is_linear(),
        late,
        range: [first.0, last.0],
    };
    let mut before: Option<(f64, Complex<f64>)> = None;
    for (omega, g, radius) in &points {
        let (omega, terms) = (*omega, feedback.at(*omega));
        if terms.current != Complex::ZERO {
            return Err(Error::new("a current loop needs the response of the current, too")
                .next("leave its margins to `taut tune`"));
        }
        if terms.scale != Complex::ZERO {
            return Err(Error::new("a controller with two sensors needs the responses of both")
                .next("leave its margins to `taut tune`"));
        }
        let factor = terms.position / terms.own * Complex::from_polar(length, -omega * late);
        let difference = DMatrix::identity(matrix.len(), matrix.len()) + g * factor;
        let far = difference.clone().singular_values().min();
        if 1.0 / far > found.sensitivity.0 {
            found.sensitivity = (1.0 / far, omega);
        }
        let nearest = far - factor.norm() * radius;
        let most = if nearest > 0.0 { 1.0 / nearest } else { f64::INFINITY };
        found.sensitivity_at_most = found.sensitivity_at_most.max(most);
        // 1 + L of a drive with the others closed is 1/[(1 + L)⁻¹]_kk
        let Some(inverse) = difference.try_inverse() else { continue };
        let l = inverse[(drive, drive)].inv() - 1.0;
        if let Some((last, was)) = before {
            if was.norm() >= 1.0 && l.norm() < 1.0 {
                let margin = (-l).arg().abs().min((-was).arg().abs());
                if found.phase.is_none_or(|(least, _)| margin < least) {
                    found.phase = Some((margin, 0.5 * (last + omega)));
                }
            }
            if was.im * l.im < 0.0 && was.re < 0.0 && l.re < 0.0 {
                let size = 0.5 * (was.re + l.re).abs();
                if size < 1.0 && found.gain.is_none_or(|(least, _)| 1.0 / size < least) {
                    found.gain = Some((1.0 / size, 0.5 * (last + omega)));
                }
            }
        }
        before = Some((omega, l));
    }
    Ok(found)
}

/// G at a frequency and the root of the sum of squared radii, if the response of each drive's own position is coherent;
/// the others may be small and incoherent.
fn at(matrix: &[Vec<&Frf>], omega: f64) -> Option<(f64, DMatrix<Complex<f64>>, f64)> {
    let (mut g, mut squares) = (DMatrix::zeros(matrix.len(), matrix.len()), 0.0);
    for (i, row) in matrix.iter().enumerate() {
        for (j, frf) in row.iter().enumerate() {
            let place = frf.points.binary_search_by(|point| point.omega.total_cmp(&omega)).ok()?;
            let point = &frf.points[place];
            if i == j && !Frf::is_coherent(point) {
                return None;
            }
            g[(i, j)] = point.value;
            squares += point.radius * point.radius;
        }
    }
    Some((omega, g, squares.sqrt()))
}

impl Measured {
    /// In a sentence.
    pub fn words(&self) -> String {
        let hertz = |omega: f64| format!("{:.2} Hz", omega / (2.0 * PI));
        let most = match self.sensitivity_at_most {
            most if most.is_finite() => format!("at most {most:.2} with 95 %"),
            _ => "without a bound: the circle of a frequency holds −1".into(),
        };
        let phase = self.phase.map_or("no crossover in the range".into(), |(margin, omega)| {
            format!("phase margin {:.1}° at {}", margin.to_degrees(), hertz(omega))
        });
        let gain = self.gain.map_or("no gain margin in the range".into(), |(margin, omega)| {
            format!("gain margin {margin:.2} at {}", hertz(omega))
        });
        let [low, high] = self.range.map(hertz);
        let (peak, at) = self.sensitivity;
        let at_rest = if self.is_at_rest { "at rest: " } else { "" };
        let late = match self.late {
            0.0 => String::new(),
            late if late > 0.0 => format!("; with {} of its delay that the log lacks", engineering(late, "s", 3)),
            late => format!("; without {} of delay that only the log has", engineering(-late, "s", 3)),
        };
        format!("{at_rest}Ms {peak:.2} at {} ({most}); {phase}; {gain}; from {low} to {high}{late}", hertz(at))
    }
}
