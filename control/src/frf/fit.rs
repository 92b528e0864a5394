//! Stiffness and damping of the belt and the delay of the loop from frequency responses, with a model of everything
//! else.
//!
//! With the model Ĝ of the sampled axis, gain g, stiffness k = s k₀, damping c = τ k and delay t_d,
//!
//! ```text
//! χ² = Σ |G − g Ĝ(s, τ, t_d)|² / E|ΔG|²  over coherent points
//! ```
//!
//! is minimised by the Levenberg-Marquardt method. A single τ describes all spans, whose damping is proportional to
//! their stiffness; g absorbs errors of the model's mass and friction. Errors are those of the linearised problem,
//! widened by the root of χ² per degree of freedom if the curves fit worse than noise allows. Noise at neighbouring
//! lines is correlated by the window, with ρ of [`ALIKE`], so with the rows J_k of the residuals at line k
//!
//! ```text
//! cov x = (Σ J_kᵀ J_k)⁻¹ (Σ ρ(k − l) J_kᵀ J_l) (Σ J_kᵀ J_k)⁻¹
//! ```

use super::{Frf, Point};
use crate::error::{Error, Result};
use crate::linear::{Hold, Operation, StateSpace, System, placed};
use crate::machine::{BeltModel, Machine, Spans};
use crate::number::engineering;
use crate::signal;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::PI;

/// Maximum number of iterations, and the least change of the unknowns.
const ITERATIONS: usize = 60;
const CHANGE: f64 = 1e-9;

/// χ² per residual below which no other start is tried.
const ENOUGH: f64 = 1.5;

/// Length of the mean P of unit vectors from which on phases are alike: half of that of equal ones.
const CLEAR: f64 = 0.5;

/// Most half samples of a delay that is looked for in phases, to either side.
const MOST_LAGS: f64 = 4000.0;

/// Fewest points.
const FEWEST: usize = 10;

/// The operating point of the model.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Cart position, m.
    pub place: f64,
    /// Bridge position, m, of a machine that has one.
    pub bridge: f64,
    /// Delay of the input in the model, s.
    pub delay: f64,
}

/// Result of a fit, each number with the ends of its central 95 %.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FrfFit {
    /// Factor on the stiffness of every span.
    pub stiffness: (f64, [f64; 2]),
    /// Stiffness of each span at the operating point, N/m.
    pub spans: Spans,
    /// Damping over stiffness, s.
    pub damping: (f64, [f64; 2]),
    /// Delay of the input, s.
    pub delay: (f64, [f64; 2]),
    /// Factor on the complete response.
    pub gain: (f64, [f64; 2]),
    /// χ² per degree of freedom.
    pub chi: f64,
    /// Number of points used.
    pub points: usize,
    /// Fitted response of the model, for each frequency response at all of its points.
    pub curves: Vec<Vec<Complex<f64>>>,
    /// Damping ratio of the first mode excited by a command, and its frequency, Hz.
    pub mode: Option<(f64, f64)>,
}

/// Distances in lines, and the spectral window of the averages: the power of Hann's window P(δ) = (sin πδ/(πδ (1 −
/// δ²)))² without its second moment, (4/3) P(δ) − (P(δ − 1) + P(δ + 1))/6, to either side.
const WINDOW: [(f64, f64); 11] = [
    (-2.5, -0.0048),
    (-2.0, -0.0417),
    (-1.5, -0.0817),
    (-1.0, 0.1667),
    (-0.5, 0.8358),
    (0.0, 1.25),
    (0.5, 0.8358),
    (1.0, 0.1667),
    (1.5, -0.0817),
    (2.0, -0.0417),
    (2.5, -0.0048),
];

/// Correlation of the noise of a response at distances of one and two lines. Under Hann's window, products of two
/// spectra have the correlations ρ₀ = (2/3)² and (1/6)²; sums less a sixth of their second difference, w = (−1/6, 4/3,
/// −1/6), have Σ w_i w_j ρ₀(d + i − j) relative to that at d = 0, which is negligible at d = 3.
pub(super) const ALIKE: [f64; 2] = [0.25723, -0.08250];

/// ln s, ln τ, t_d, ln g.
const UNKNOWNS: usize = 4;

impl Known {
    fn operation(&self) -> Operation {
        Operation { position: self.place, bridge: self.bridge, ..Operation::default() }
    }
}

/// The machine with scaled stiffness and damping of its belts.
fn changed(machine: &Machine, known: &Known, x: &[f64]) -> Result<Machine> {
    let mut machine = placed(machine, known.operation())?;
    (machine.belt.follows_cart, machine.belt.make) = (false, None);
    for (k, c) in machine.belt.stiffness.iter_mut().zip(&mut machine.belt.damping) {
        *k *= x[0].exp();
        *c = x[1].exp() * *k;
    }
    Ok(machine)
}

/// The sampled model's response at these points.
pub(super) fn model(machine: &Machine, known: &Known, frf: &Frf) -> Result<Vec<Complex<f64>>> {
    Ok(curves(machine, known, known.delay, &[(frf, &[(0.0, 1.0)])])?.remove(0))
}

/// Responses of the sampled model at the points of these, smeared by the window as the averages are, Σ W Ĝ/Σ W around
/// each line, for white inputs.
fn curves(
    machine: &Machine,
    known: &Known,
    delay: f64,
    frfs: &[(&Frf, &[(f64, f64)])],
) -> Result<Vec<Vec<Complex<f64>>>> {
    let system = System::new(machine, known.operation())?;
    let mut all = Vec::new();
    // All outputs of an input at once.
    for same in frfs.chunk_by(|(a, _), (b, _)| a.drive == b.drive && a.name == b.name) {
        let (first, window) = same[0];
        let of_input = system.input(first.drive);
        let output = |(frf, _): &(&Frf, &[(f64, f64)])| {
            let name = frf.quantity.name();
            of_input
                .output(name)
                .ok_or_else(|| Error::new(format!("the model has no {name}")).next("log another quantity"))
        };
        let outputs = same.iter().map(output).collect::<Result<Vec<_>>>()?;
        // Whole samples of a delay are z⁻ⁿ. A straight input is delayed by e^{−jωt_d} alone, which leaves out what
        // folds down from beyond half the sample rate.
        let whole = (delay / first.every).floor() * first.every;
        let (hold, within, late) = match first.hold {
            signal::Hold::Zero => (Hold::Zero, (delay - whole).max(0.0), whole),
            signal::Hold::Linear => (Hold::First, 0.0, delay),
        };
        let discrete = of_input.discrete(first.every, hold, within)?;
        let line = 2.0 * PI / (first.length as f64 * first.every);
        let sum: f64 = window.iter().map(|one| one.1).sum();
        let mut seen = vec![vec![Complex::ZERO; first.points.len()]; same.len()];
        for (k, point) in first.points.iter().enumerate() {
            for (distance, weight) in window {
                let omega = point.omega + distance * line;
                let (answers, turned) = (discrete.at(omega), Complex::from_polar(weight / sum, -omega * late));
                for (curve, output) in seen.iter_mut().zip(&outputs) {
                    curve[k] += answers[*output] * turned;
                }
            }
        }
        all.extend(seen);
    }
    Ok(all)
}

struct Problem<'a> {
    machine: &'a Machine,
    known: &'a Known,
    frfs: &'a [Frf],
}

impl Problem<'_> {
    fn curves(&self, x: &[f64]) -> Result<Vec<Vec<Complex<f64>>>> {
        let machine = changed(self.machine, self.known, x)?;
        let gain = x[3].exp();
        // Whole periods are not smeared.
        let window = |frf: &Frf| if frf.periodic { &[(0.0, 1.0)][..] } else { &WINDOW[..] };
        let seen: Vec<(&Frf, &[(f64, f64)])> = self.frfs.iter().map(|frf| (frf, window(frf))).collect();
        let mut all = curves(&machine, self.known, x[2].max(0.0), &seen)?;
        all.iter_mut().flatten().for_each(|value| *value *= gain);
        Ok(all)
    }

    /// Real and imaginary parts of (G − g Ĝ)/σ √2, of variance 1.
    fn residuals(&self, x: &[f64]) -> Result<DVector<f64>> {
        let curves = self.curves(x)?;
        let mut all = Vec::new();
        for (frf, curve) in self.frfs.iter().zip(curves) {
            for (point, value) in frf.points.iter().zip(curve).filter(|(point, _)| is_used(point)) {
                let off = (point.value - value) / point.deviation * 2f64.sqrt();
                all.extend([off.re, off.im]);
            }
        }
        Ok(DVector::from_vec(all))
    }

    /// The delay d that turns the phases of all responses most nearly into those of the model without a delay, or into
    /// their opposites, s,
    ///
    /// ```text
    /// maximum over d of Σ_i |P_i(d)|,  P_i(d) = mean of (G/|G|) (Ĝ/|Ĝ|)* e^{jωd}
    /// ```
    ///
    /// in steps of half a sample, up to a quarter of a segment (C. H. Knapp, G. C. Carter, IEEE Trans. ASSP 24 (1976)
    /// 320, the phase transform). Errors: responses of the other sign, Re P_i < 0, or ahead of the input, d < 0.
    fn lag(&self, x: &[f64]) -> Result<f64> {
        let turns: Vec<Vec<(f64, Complex<f64>)>> = (self.frfs.iter().zip(self.curves(x)?))
            .map(|(frf, curve)| {
                let points = frf.points.iter().zip(curve).filter(|(point, _)| is_used(point));
                let turn = |(point, model): (&Point, Complex<f64>)| {
                    let product = point.value * model.conj();
                    (product.norm() > 0.0).then(|| (point.omega, product / product.norm()))
                };
                points.filter_map(turn).collect()
            })
            .collect();
        let mean = |turns: &[(f64, Complex<f64>)], d: f64| {
            let turned = turns.iter().map(|(omega, turn)| turn * Complex::from_polar(1.0, omega * d));
            turned.sum::<Complex<f64>>() / turns.len().max(1) as f64
        };
        let every = self.frfs.iter().map(|frf| frf.every).fold(f64::INFINITY, f64::min);
        let longest = self.frfs.iter().map(|frf| frf.length as f64 * frf.every).fold(0.0, f64::max) / 4.0;
        let most = (2.0 * longest / every).min(MOST_LAGS) as i64;
        let alike = |d: f64| turns.iter().map(|turns| mean(turns, d).norm()).sum::<f64>();
        // The shortest of equals.
        let delays = (0..=most).flat_map(|k| [k, -k]).map(|k| k as f64 * 0.5 * every);
        let best = delays.map(|d| (alike(d), d)).reduce(|a, b| if b.0 > a.0 { b } else { a });
        let (_, d) = best.unwrap_or_default();
        // Beyond a resonance that the model has elsewhere, signs differ for another reason.
        let low = |turns: &[(f64, Complex<f64>)]| turns[..turns.len().min(FEWEST.max(turns.len() / 4))].to_vec();
        let is_other = |turns: &[(f64, Complex<f64>)]| mean(turns, d).re < -CLEAR && mean(&low(turns), d).re < -CLEAR;
        let other: Vec<String> =
            self.frfs.iter().zip(&turns).filter(|(_, turns)| is_other(turns)).map(|(frf, _)| frf.title()).collect();
        if !other.is_empty() {
            return Err(Error::new(format!("the sign of {} is opposite to the model's", other.join(" and ")))
                .next("negate that column of the log, or its input, or amplifier.gain"));
        }
        if d < -every && alike(d) > CLEAR * turns.len() as f64 {
            return Err(Error::new(format!("the outputs respond {} before the input", engineering(-d, "s", 3)))
                .allowed("a response after the input")
                .next("compare the clocks of the columns of the log"));
        }
        Ok(d.max(0.0))
    }

    fn jacobian(&self, x: &[f64], rows: usize) -> Result<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(rows, UNKNOWNS);
        for j in 0..UNKNOWNS {
            let h = if j == 2 { 1e-7 } else { 1e-4 };
            let at = |by: f64| {
                let mut moved = x.to_vec();
                moved[j] += by;
                self.residuals(&moved)
            };
            // A delay is never negative.
            let low = if j == 2 && x[2] < h { 0.0 } else { h };
            jacobian.set_column(j, &((at(h)? - at(-low)?) / (h + low)));
        }
        Ok(jacobian)
    }

    /// Covariance of the unknowns; the Jacobian has two rows for each point used.
    fn covariance(&self, jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let mut middle = jacobian.transpose() * jacobian;
        let inverse = middle.clone().try_inverse()?;
        let mut first = 0;
        for frf in self.frfs {
            let lines: Vec<f64> = frf.points.iter().filter(|point| is_used(point)).map(|one| frf.line(one)).collect();
            for (k, line) in lines.iter().enumerate().filter(|_| !frf.periodic) {
                // Points used need not be adjacent.
                for (l, other) in lines.iter().enumerate().skip(k + 1).take(ALIKE.len()) {
                    let Some(rho) = ALIKE.get((other - line).round() as usize - 1) else { continue };
                    for part in 0..2 {
                        let (a, b) = (jacobian.row(first + 2 * k + part), jacobian.row(first + 2 * l + part));
                        middle += (a.transpose() * b + b.transpose() * a) * *rho;
                    }
                }
            }
            first += 2 * lines.len();
        }
        Some(&inverse * middle * &inverse)
    }
}

fn is_used(point: &Point) -> bool {
    point.deviation > 0.0 && Frf::is_coherent(point)
}

fn used(frfs: &[Frf]) -> usize {
    frfs.iter().map(|frf| frf.points.iter().filter(|point| is_used(point)).count()).sum()
}

/// True if these responses and this machine admit a fit, whatever its result.
pub(super) fn can_be_fitted(machine: &Machine, frfs: &[Frf]) -> bool {
    machine.belt.model != BeltModel::Rigid && used(frfs) >= FEWEST
}

/// Fits the belt and the delay of a machine to frequency responses.
pub fn fit(machine: &Machine, known: &Known, frfs: &[Frf]) -> Result<FrfFit> {
    if machine.belt.model == BeltModel::Rigid {
        return Err(Error::new("a rigid belt has no stiffness to be fitted").next("give belt.model = \"elastic\""));
    }
    let problem = Problem { machine, known, frfs };
    let points = used(frfs);
    if points < FEWEST {
        return Err(Error::new(format!("{points} points with a coherence of at least {}", super::COHERENT))
            .allowed(format!("at least {FEWEST}"))
            .next("excite the axis harder or for longer, or give a shorter --segment"));
    }
    let ratio = machine.belt.damping.iter().zip(&machine.belt.stiffness).map(|(c, k)| c / k).sum::<f64>();
    let ratio = ratio / machine.belt.stiffness.len() as f64;
    let mut best: Option<(f64, Vec<f64>)> = None;
    // Distant resonances cause local minima, so several stiffnesses and dampings are tried until noise explains the
    // residuals.
    for stiffness in [1.0, 0.6, 1.6, 0.35, 2.8] {
        if best.as_ref().is_some_and(|(least, _)| *least < ENOUGH * (2 * points) as f64) {
            break;
        }
        for ratio in if ratio > 0.0 { vec![ratio] } else { vec![1e-5, 1e-4] } {
            let start = vec![f64::ln(stiffness), ratio.ln(), known.delay, 0.0];
            if let Ok((value, x)) = minimised(&problem, start)
                && best.as_ref().is_none_or(|(least, _)| value < *least)
            {
                best = Some((value, x));
            }
        }
    }
    let rows = 2 * points;
    let chi = |squares: f64| squares / (rows - UNKNOWNS) as f64;
    // Where no start leads near, the phases show a long delay, an output ahead of its input, or one of the other sign.
    if best.as_ref().is_none_or(|(least, _)| chi(*least) > FAR) {
        let ratio = if ratio > 0.0 { ratio } else { 1e-5 };
        let mut start = vec![0.0, ratio.ln(), 0.0, 0.0];
        start[2] = problem.lag(&start)?;
        if let Ok((value, x)) = minimised(&problem, start)
            && best.as_ref().is_none_or(|(least, _)| value < *least)
        {
            best = Some((value, x));
        }
    }
    let Some((squares, x)) = best else {
        return Err(
            Error::new("no stiffness, damping and delay give the measured response").next("check the case file")
        );
    };
    let chi = chi(squares);
    let covariance = problem.covariance(&problem.jacobian(&x, rows)?);
    let wide = |j: usize| {
        let variance = covariance.as_ref().map_or(f64::INFINITY, |covariance| covariance[(j, j)].max(0.0));
        1.96 * (variance * chi.max(1.0)).sqrt()
    };
    let grown = |j: usize| (x[j].exp(), [(x[j] - wide(j)).exp(), (x[j] + wide(j)).exp()]);
    let delay = x[2].max(0.0);
    let found = changed(machine, known, &x)?;
    let mode = StateSpace::new(&found, known.operation()).and_then(|system| system.poles()).ok().and_then(|poles| {
        let swinging = poles.into_iter().filter(|pole| pole.im > 0.0 && pole.re.abs() < 0.7 * pole.norm());
        swinging.min_by(|a, b| a.norm().total_cmp(&b.norm()))
    });
    Ok(FrfFit {
        stiffness: grown(0),
        spans: found.belt.stiffness,
        damping: grown(1),
        delay: (delay, [(delay - wide(2)).max(0.0), delay + wide(2)]),
        gain: grown(3),
        chi,
        points,
        curves: problem.curves(&x)?,
        mode: mode.map(|pole| (-pole.re / pole.norm(), pole.norm() / (2.0 * PI))),
    })
}

/// Least Σ r² from a start, and its position.
fn minimised(problem: &Problem, mut x: Vec<f64>) -> Result<(f64, Vec<f64>)> {
    let mut residuals = problem.residuals(&x)?;
    let mut squares = residuals.norm_squared();
    let mut mu = 1e-3;
    for _ in 0..ITERATIONS {
        let jacobian = problem.jacobian(&x, residuals.len())?;
        let (normal, slope) = (jacobian.transpose() * &jacobian, jacobian.transpose() * &residuals);
        let mut is_better = false;
        for _ in 0..10 {
            let mut damped = normal.clone();
            for j in 0..UNKNOWNS {
                damped[(j, j)] += mu * normal[(j, j)].max(1e-12);
            }
            let Some(step) = damped.lu().solve(&slope) else { break };
            let trial: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x - s.clamp(-1.0, 1.0)).collect();
            let trial = vec![trial[0], trial[1].clamp(-25.0, 0.0), trial[2].max(0.0), trial[3]];
            if let Ok(there) = problem.residuals(&trial)
                && there.norm_squared() < squares
            {
                let change = squares - there.norm_squared();
                (x, residuals, is_better) = (trial, there, change > CHANGE * squares);
                squares = residuals.norm_squared();
                mu = (0.3 * mu).max(1e-12);
                break;
            }
            mu *= 5.0;
        }
        if !is_better {
            break;
        }
    }
    if squares.is_finite() { Ok((squares, x)) } else { Err(Error::new("no finite residuals")) }
}

/// χ² per degree of freedom above which the model does not describe the responses: residuals are more than three times
/// what noise explains.
const FAR: f64 = 10.0;

impl FrfFit {
    /// True if noise does not nearly explain the residuals.
    pub fn is_far(&self) -> bool {
        self.chi > FAR
    }

    /// Results of the fit with units: name, value, ends of the interval.
    pub fn rows(&self) -> Vec<(&'static str, String, [String; 2])> {
        let shown = |value: f64, unit: &str| engineering(value, unit, 4);
        let row = |name, unit: &str, (value, [low, high]): (f64, [f64; 2])| {
            (name, shown(value, unit), [shown(low, unit), shown(high, unit)])
        };
        vec![
            row("stiffness, of that in the file", "", self.stiffness),
            row("belt damping over stiffness", "s", self.damping),
            row("delay", "s", self.delay),
            row("gain relative to the model", "", self.gain),
        ]
    }
}
