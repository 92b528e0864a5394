//! The transfer functions of an axis as polynomials in its uncertain parameters.
//!
//! G(s) = n(s)/d(s) of a sliding axis has coefficients that are polynomials in every parameter (masses, stiffness,
//! motor constants, the position of the cart, …), once numerator and denominator are multiplied by masses, inductances
//! and lengths of spans. They are found by interpolation between machines: exact but for rounding. The degrees are
//! found one by one, and random machines of the box confirm the result.

use super::tensor::{Tensor, from_points, next, points};
use crate::chance::uniform;
use crate::design::Design;
use crate::error::Result;
use crate::linear::{StateSpace, System};
use crate::tune::family::{Corner, Family};
use crate::tune::plant::{length, measured, slide};
use nalgebra::Complex;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::f64::consts::PI;

/// Highest degree in one parameter, and largest number of machines of an interpolation.
const HIGHEST: usize = 4;
const MACHINES: usize = 20_000;

/// Number of random machines that confirm an interpolation, and the tolerance relative to the sum of magnitudes.
const CONFIRMED: usize = 60;
const SAME: f64 = 5e-11;

/// The meaning of a parameter of the box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Of {
    /// An independent unknown of the family, by its number.
    Unknown(usize),
    /// The position of the cart.
    Place,
    /// The mass added to the cart.
    Load,
}

/// A parameter of the box, linear from −1 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parameter {
    pub of: Of,
    low: f64,
    high: f64,
}

/// G(s) of an axis over a box of parameters.
pub(super) struct Axis<'a> {
    family: &'a Family,
    pub parameters: Vec<Parameter>,
    /// Channels: coefficients of d, then of n for each output, of rising powers of s/Ω, Ω = π/T.
    pub polynomials: Tensor,
    /// Number of coefficients of d and of each n.
    pub orders: Vec<usize>,
    /// Magnitude of each channel, to which its rounding error is relative.
    pub magnitudes: Vec<f64>,
}

/// The transfer functions of one machine.
struct Sampler<'a> {
    family: &'a Family,
    /// Ω, rad/s
    unit: f64,
    /// Also from the command to the position of the cart.
    has_scale: bool,
    /// Divisor of the weight of each machine.
    weight: f64,
}

/// Coefficients of gain ∏ (s − root), and of gain ∏ (s + |root|).
fn expanded(gain: f64, roots: &[Complex<f64>]) -> [Vec<f64>; 2] {
    let (mut values, mut sizes) = (vec![Complex::new(gain, 0.0)], vec![gain.abs()]);
    for root in roots {
        values.push(Complex::ZERO);
        sizes.push(0.0);
        for k in (0..values.len()).rev() {
            let below = if k > 0 { (values[k - 1], sizes[k - 1]) } else { (Complex::ZERO, 0.0) };
            values[k] = below.0 - root * values[k];
            sizes[k] = below.1 + root.norm() * sizes[k];
        }
    }
    [values.into_iter().map(|value| value.re).collect(), sizes]
}

impl Sampler<'_> {
    /// Coefficients of d and of each n, and their magnitudes.
    fn sample(&self, corner: &Corner) -> Result<Vec<[Vec<f64>; 2]>> {
        let machine = self.family.machine_at(corner);
        let system = StateSpace::new(&machine, corner.operation())?;
        let weight = System::denominator(&machine, corner.operation()) / self.weight;
        let scaled = |roots: &[Complex<f64>]| roots.iter().map(|root| root / self.unit).collect::<Vec<_>>();
        let poles = system.poles()?;
        let mut all = vec![expanded(weight, &scaled(&poles))];
        let scale = self.has_scale.then(|| slide(&machine, &system, 0)).flatten().map(|output| (output, 1.0));
        let outputs = [Some((measured(&machine, &system, 0), length(&machine))), scale];
        for (output, length) in outputs.into_iter().flatten() {
            let zeros = system.zeros(output).transpose()?;
            let (gain, roots) = zeros.map_or((0.0, Vec::new()), |zeros| (zeros.gain, zeros.values));
            // n/d = k Ω^(m − n) ∏ (s/Ω − z/Ω) / ∏ (s/Ω − p/Ω)
            let unit = self.unit.powi(roots.len() as i32 - poles.len() as i32);
            all.push(expanded(weight * gain * length * unit, &scaled(&roots)));
        }
        Ok(all)
    }

    /// Channels of a machine, or none if it has more than these.
    fn channels(&self, corner: &Corner, orders: &[usize]) -> Result<Option<Vec<f64>>> {
        let mut channels = Vec::new();
        for ([mut values, _], order) in self.sample(corner)?.into_iter().zip(orders) {
            if values.len() > *order {
                return Ok(None);
            }
            values.resize(*order, 0.0);
            channels.extend(values);
        }
        Ok(Some(channels))
    }
}

impl<'a> Axis<'a> {
    /// The axis of a family with the timing of a design; the inner error is the reason why it has no polynomials.
    pub fn new(
        family: &'a Family,
        design: &Design,
        has_scale: bool,
        stop: &dyn Fn() -> bool,
    ) -> Result<std::result::Result<Self, String>> {
        let nominal = family.nominal();
        let weight = System::denominator(&family.machine_at(&nominal), nominal.operation());
        let sampler = Sampler { family, unit: PI / design.every, has_scale, weight };
        let parts = sampler.sample(&nominal)?;
        let orders: Vec<usize> = parts.iter().map(|[values, _]| values.len()).collect();
        let magnitudes: Vec<f64> = parts.into_iter().flat_map(|[_, sizes]| sizes).collect();
        let channels = magnitudes.len();
        let mut axis = Self {
            family,
            parameters: parameters(family),
            polynomials: Tensor { shape: Vec::new(), channels, values: Vec::new() },
            orders,
            magnitudes,
        };
        let is_same = |a: &[f64], b: &[f64], sizes: &[f64]| {
            a.iter().zip(b).zip(sizes).all(|((a, b), size)| (a - b).abs() <= SAME * size)
        };
        let formless = || Ok(Err("its equations are not polynomials in these parameters".to_string()));
        let at = |axis: &Self, point: &[f64]| sampler.channels(&axis.corner(point), &axis.orders);
        // Degrees in each parameter, at random values of the others.
        let mut random = Pcg64::seed_from_u64(21);
        let base: Vec<f64> = axis.parameters.iter().map(|_| 1.4 * uniform(&mut random) - 0.7).collect();
        let mut shape = Vec::new();
        for parameter in 0..axis.parameters.len() {
            let moved = |t: f64| {
                let mut point = base.clone();
                point[parameter] = t;
                point
            };
            let mut found = None;
            for degree in 0..=HIGHEST {
                let mut line = Tensor { shape: vec![degree + 1], channels, values: Vec::new() };
                for t in points(degree) {
                    let Some(values) = at(&axis, &moved(t))? else { return formless() };
                    line.values.extend(values);
                }
                line.along(0, &from_points(degree));
                let mut is_exact = true;
                for t in [-0.83, -0.31, 0.47, 0.91] {
                    let Some(values) = at(&axis, &moved(t))? else { return formless() };
                    is_exact &= is_same(&values, &line.at(&[t]), &axis.magnitudes);
                }
                if is_exact {
                    found = Some(degree);
                    break;
                }
            }
            let Some(degree) = found else { return formless() };
            shape.push(degree + 1);
        }
        // Parameters without influence are not part of the box.
        let has_influence: Vec<bool> = shape.iter().map(|size| *size > 1).collect();
        let mut kept = has_influence.iter();
        axis.parameters.retain(|_| *kept.next().unwrap_or(&true));
        shape.retain(|size| *size > 1);
        axis.polynomials.shape = shape;
        let count = axis.polynomials.count();
        if count > MACHINES {
            return Ok(Err(format!("{} parameters at once are too many for it", axis.parameters.len())));
        }
        let all_points: Vec<Vec<f64>> = axis.polynomials.shape.iter().map(|size| points(size - 1)).collect();
        let mut exponents = vec![0; axis.polynomials.shape.len()];
        for number in 0..count {
            if number % 64 == 0 && stop() {
                return Ok(Err("interrupted".into()));
            }
            let point: Vec<f64> = exponents.iter().zip(&all_points).map(|(k, points)| points[*k]).collect();
            let Some(values) = at(&axis, &point)? else { return formless() };
            axis.polynomials.values.extend(values);
            next(&mut exponents, &axis.polynomials.shape);
        }
        for parameter in 0..axis.parameters.len() {
            let degree = axis.polynomials.shape[parameter] - 1;
            axis.polynomials.along(parameter, &from_points(degree));
        }
        for _ in 0..CONFIRMED {
            let point: Vec<f64> = axis.parameters.iter().map(|_| 2.0 * uniform(&mut random) - 1.0).collect();
            let Some(values) = at(&axis, &point)? else { return formless() };
            if !is_same(&values, &axis.polynomials.at(&point), &axis.magnitudes) {
                return formless();
            }
        }
        Ok(Ok(axis))
    }

    /// The machine at a point, each parameter from −1 to 1.
    pub fn corner(&self, point: &[f64]) -> Corner {
        let mut corner = self.family.nominal();
        for (parameter, t) in self.parameters.iter().zip(point) {
            let value = parameter.low + 0.5 * (t + 1.0) * (parameter.high - parameter.low);
            match parameter.of {
                Of::Unknown(unknown) => self.family.put(&mut corner, unknown, self.family.unknowns[unknown].off(value)),
                Of::Place => corner.place = value,
                Of::Load => corner.load = value,
            }
        }
        corner
    }

    /// The polynomials over the box whose half-widths are these of the unknowns' times `factor`; positions and loads
    /// are all included.
    pub fn narrowed(&self, factor: f64) -> Tensor {
        let mut polynomials = self.polynomials.clone();
        for (number, parameter) in self.parameters.iter().enumerate() {
            if let Of::Unknown(unknown) = parameter.of {
                let [low, high] = self.family.unknowns[unknown].within(factor).map(|value| parameter.at(value));
                polynomials.narrow(number, 0.5 * (low + high), 0.5 * (high - low));
            }
        }
        polynomials
    }
}

impl Parameter {
    /// Its coordinate for a value.
    fn at(&self, value: f64) -> f64 {
        2.0 * (value - self.low) / (self.high - self.low) - 1.0
    }
}

/// The parameters that vary in a family.
fn parameters(family: &Family) -> Vec<Parameter> {
    let ends = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        [low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    };
    let unknown = |number: usize| (Of::Unknown(number), family.unknowns[number].within(1.0));
    let unknowns = family.leading().map(unknown);
    let others = [(Of::Place, ends(&family.places)), (Of::Load, ends(&family.loads))];
    let all = unknowns.chain(others).filter(|(_, [low, high])| high > low);
    all.map(|(of, [low, high])| Parameter { of, low, high }).collect()
}
