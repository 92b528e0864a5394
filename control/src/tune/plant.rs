//! Frequency response of the sampled machine from commands to measurements.

use crate::control::feedback::Turn;
use crate::control::measures_cart;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::linear::{Discrete, Hold, Operation, Range, StateSpace, System};
use crate::machine::{EncoderPlace, Machine, MachineKind};
use nalgebra::{Complex, SMatrix};
use std::f64::consts::PI;

/// Points per decade of the grid, without those around resonances.
const POINTS: f64 = 90.0;
/// Lowest frequency relative to half the sampling rate, and points per decade below all dynamics.
const LOWEST: f64 = 1e-8;
const SPARSE: f64 = 12.0;

/// A matrix over frequency with a row for each measurement or slide, and a column for each drive.
pub(super) type Square<const N: usize> = SMatrix<Complex<f64>, N, N>;

/// Responses to commands at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Answer<const N: usize> {
    /// Measured positions, m per V or A.
    pub position: Square<N>,
    /// Motor currents when sampled, A per V or A.
    pub current: Square<N>,
    /// Positions of the sliding parts, m per V or A.
    pub slides: Square<N>,
}

/// Frequency response of a sampled machine from commands to measurements.
#[derive(Debug, Clone)]
pub struct Plant {
    /// ω, rad/s, up to half the sampling rate.
    pub frequency: Vec<f64>,
    /// The frequencies in terms of the sampled loop.
    turns: Vec<Turn>,
    pub(super) every: f64,
    /// Poles outside the unit circle.
    pub(super) unstable: usize,
    pub(super) kind: MachineKind,
    pub(super) of: ByDrives,
}

/// Responses of a machine with one, two or three drives.
#[derive(Debug, Clone)]
pub(super) enum ByDrives {
    One(Box<Sampled<1>>),
    Two(Box<Sampled<2>>),
    Three(Box<Sampled<3>>),
}

/// The same code for any number of drives.
macro_rules! by_drives {
    ($plant:expr, |$sampled:ident| $value:expr) => {
        match &$plant.of {
            $crate::tune::plant::ByDrives::One(sampled) => {
                let $sampled = &**sampled;
                $value
            }
            $crate::tune::plant::ByDrives::Two(sampled) => {
                let $sampled = &**sampled;
                $value
            }
            $crate::tune::plant::ByDrives::Three(sampled) => {
                let $sampled = &**sampled;
                $value
            }
        }
    };
}
pub(super) use by_drives;

/// The sampled model of each command, and the responses on the grid.
#[derive(Debug, Clone)]
pub(super) struct Sampled<const N: usize> {
    answers: Vec<Answer<N>>,
    models: [Discrete; N],
    /// Outputs of the models: measurements, slides and currents; and metres per unit of the first.
    measured: [usize; N],
    slides: [Option<usize>; N],
    currents: [usize; N],
    length: f64,
    /// True if a command is added to the reference, as for steppers.
    pub is_fed: bool,
    /// Travel of each drive's part of the belt per travel of each slide; zero for missing slides of a machine with more
    /// drives than slides.
    pub shares: Square<N>,
}

impl Plant {
    /// Samples `machine` about `operation` with the timing of `design`.
    pub fn new(machine: &Machine, operation: Operation, design: &Design, corners: &[f64]) -> Result<Self> {
        let system = System::new(machine, operation)?;
        let model = |drive: usize| system.input(drive).discrete(design.every, Hold::Zero, design.delay);
        match machine.drives.len() {
            1 => Self::sampled([model(0)?], &system.input(0), machine, corners, |sampled| {
                ByDrives::One(Box::new(sampled))
            }),
            2 => Self::sampled([model(0)?, model(1)?], &system.input(0), machine, corners, |sampled| {
                ByDrives::Two(Box::new(sampled))
            }),
            3 => Self::sampled([model(0)?, model(1)?, model(2)?], &system.input(0), machine, corners, |sampled| {
                ByDrives::Three(Box::new(sampled))
            }),
            count => {
                Err(Error::new(format!("a machine with {count} drives has no margins")).allowed("up to three drives"))
            }
        }
    }

    fn sampled<const N: usize>(
        models: [Discrete; N],
        system: &StateSpace,
        machine: &Machine,
        corners: &[f64],
        of: fn(Sampled<N>) -> ByDrives,
    ) -> Result<Self> {
        let t = models[0].sample_time;
        let frequency = grid(&models[0], t, corners);
        let geometry = machine.geometry();
        let find = |name: &str| system.output(name);
        let shares = machine.belt_shares();
        let mut sampled = Sampled {
            answers: Vec::new(),
            measured: std::array::from_fn(|drive| measured(machine, system, drive)),
            slides: std::array::from_fn(|number| slide(machine, system, number)),
            currents: std::array::from_fn(|drive| find(geometry.drives[drive].current_column).unwrap_or_default()),
            length: length(machine),
            is_fed: machine.stepper().is_some(),
            shares: Square::from_fn(|drive, slide| {
                Complex::new(shares[drive].get(slide).copied().unwrap_or_default(), 0.0)
            }),
            models,
        };
        let unstable = sampled.models[0].poles().iter().filter(|z| z.norm() > 1.0 + 1e-9).count();
        let turns = frequency.iter().map(|&omega| Turn::new(omega, t)).collect();
        sampled.answers = frequency.iter().map(|&omega| sampled.at(omega)).collect();
        Ok(Self { frequency, turns, every: t, unstable, kind: machine.kind, of: of(sampled) })
    }

    /// Frequencies, the responses to commands there, and the frequencies in terms of the sampled loop.
    pub(super) fn seen<'a, const N: usize>(
        &'a self,
        sampled: &'a Sampled<N>,
    ) -> impl Iterator<Item = (f64, &'a Answer<N>, &'a Turn)> {
        let all = self.frequency.iter().zip(&sampled.answers).zip(&self.turns);
        all.map(|((&omega, answer), turn)| (omega, answer, turn))
    }
}

impl<const N: usize> Sampled<N> {
    /// Responses to commands at ω, rad/s.
    pub fn at(&self, omega: f64) -> Answer<N> {
        let all: [Vec<Complex<f64>>; N] = std::array::from_fn(|input| self.models[input].at(omega));
        // The sampled current belongs to the previous command.
        let lag = Complex::new(0.0, -omega * self.models[0].sample_time).exp() - 1.0;
        Answer {
            position: Square::from_fn(|row, input| all[input][self.measured[row]] * self.length),
            current: Square::from_fn(|row, input| {
                let output = self.currents[row];
                all[input][output] + lag * self.models[input].d[output]
            }),
            slides: Square::from_fn(|row, input| self.slides[row].map_or(Complex::ZERO, |slide| all[input][slide])),
        }
    }
}

/// Index of the output that a drive measures.
pub(super) fn measured(machine: &Machine, system: &StateSpace, drive: usize) -> usize {
    let geometry = machine.geometry();
    let at = &geometry.drives[drive];
    let pulley = format!("{}_angle", geometry.label(at.pulley).key);
    let name = match machine.encoder.map(|encoder| encoder.at) {
        _ if measures_cart(machine) => "cart_position",
        Some(EncoderPlace::DrivePulley) => &pulley,
        _ => &format!("{}_angle", at.rotor.key),
    };
    system.output(name).or(system.output(&pulley)).unwrap_or_default()
}

/// Metres per unit of a measured output.
pub(super) fn length(machine: &Machine) -> f64 {
    if measures_cart(machine) { 1.0 } else { machine.pulley_radius }
}

/// Index of the output that is the position of a slide, if there are as many.
pub(super) fn slide(machine: &Machine, system: &StateSpace, number: usize) -> Option<usize> {
    let geometry = machine.geometry();
    let body = geometry.slides.get(number)?.body;
    Some(system.output(&format!("{}_position", geometry.label(body).key)).unwrap_or_default())
}

/// Frequencies up to half the sampling rate, dense around the poles of the axis and the controller's corners.
fn grid(model: &Discrete, t: f64, corners: &[f64]) -> Vec<f64> {
    let most = PI / t;
    // Frequencies of poles, folded below half the sampling rate.
    let mut roots: Vec<Complex<f64>> = model.poles().iter().filter(|z| z.norm() > 0.0).map(|z| z.ln() / t).collect();
    roots.extend(corners.iter().map(|omega| Complex::new(-0.3 * omega, *omega)));
    let slowest = roots.iter().map(|s| s.norm()).filter(|w| *w > 1e-9 * most).fold(most, f64::min);
    let from = (0.01 * slowest).clamp(10.0 * LOWEST * most, 1e-3 * most);
    let points = (POINTS * (most / from).log10()) as usize;
    // Far below a slow integral, so that its phase is covered completely.
    let below = (LOWEST * most / from).log10().abs();
    let count = (SPARSE * below).ceil();
    let mut frequency: Vec<f64> =
        (0..count as usize).map(|k| LOWEST * most * 10f64.powf(below * k as f64 / count)).collect();
    frequency.extend(Range { from, to: most, points }.frequencies(&roots));
    // At half the sampling rate, L is real regardless of rounding.
    frequency.retain(|omega| *omega < most * (1.0 - 1e-12));
    frequency.push(most);
    frequency
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};
    use crate::linear::StateSpace;

    #[test]
    fn frequencies_rise_from_far_below_all_poles_to_half_the_sampling_rate() {
        let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let axis = StateSpace::new(&machine, Operation::default()).unwrap();
        let model = axis.discrete(1e-3, Hold::Zero, 0.0).unwrap();
        let (most, frequency) = (PI / 1e-3, grid(&model, 1e-3, &[100.0]));
        assert!((frequency[0] / (LOWEST * most) - 1.0).abs() < 1e-9 && frequency.last() == Some(&most));
        // A jump of the grid by half a decade would let the phase turn unseen.
        assert!(frequency.windows(2).all(|pair| pair[0] < pair[1] && pair[1] < 3.0 * pair[0]));
        // The resonances of the axis are surrounded closely.
        for swing in axis.poles().unwrap().iter().map(|pole| pole.im).filter(|swing| *swing > 0.0 && *swing < most) {
            let near = frequency.iter().filter(|omega| (**omega / swing - 1.0).abs() < 0.02).count();
            assert!(near > 10, "{near} at {swing}");
        }
    }
}
