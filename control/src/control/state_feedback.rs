//! State feedback with a Kalman filter: LQG, and with an integral LQI.

use super::compensation::Compensation;
use super::memory::{Memory, all, flag};
use super::model::Linear;
use super::model::Quantity;
use super::riccati;
use super::sampled::Sensor;
use crate::design::{Design, StateFeedback};
use crate::error::Result;
use crate::machine::Machine;
use crate::machine::axis::{CART, IDLER};
use crate::machine::rigid::Rigid;
use crate::signal::profile::Reference;
use nalgebra::{DMatrix, DVector};

/// A linear-quadratic regulator on the states that a Kalman filter estimates, both for the sampled axis with its delay.
#[derive(Debug, Clone)]
pub struct StateFeedbackState {
    law: Law,
    radius: f64,
    states: Vec<Quantity>,
    estimate: DVector<f64>,
    scratch: DVector<f64>,
    wanted: DVector<f64>,
    started: bool,
    /// The last commands beside feed-forward, latest first, and as the axis got them.
    own: Vec<f64>,
    given: Vec<f64>,
    integral: f64,
    integrated: f64,
    last_own: f64,
    /// Residuals of the two Riccati equations.
    pub residuals: [f64; 2],
}

/// The part of it that does not change in time.
#[derive(Debug, Clone)]
pub struct Law {
    /// Sample interval, s.
    pub every: f64,
    /// Φ.
    pub phi: DMatrix<f64>,
    /// Effect over a sample of the command that takes over within it, and of the one before.
    pub now: DVector<f64>,
    /// Effect of the command before it.
    pub before: DVector<f64>,
    /// The encoder; behind it the scale, if there is one. Each corrects the estimate that the one before has left.
    pub sensors: Vec<Corrected>,
    /// u = −K (x − x*), then of commands under way, then of the integral.
    pub gain: DVector<f64>,
    /// Number of commands under way.
    pub pending: usize,
    /// True if the last state is the integral of the error.
    pub has_integral: bool,
}

/// A sensor of the Kalman filter: x̂ ← x̂ + L (y − m x̂).
#[derive(Debug, Clone)]
pub struct Corrected {
    /// m.
    pub measured: DVector<f64>,
    /// L.
    pub kalman: DVector<f64>,
}

impl Law {
    /// Samples from a command to the one that takes over within a sample.
    pub fn lag(&self) -> usize {
        if self.before.iter().any(|v| *v != 0.0) { self.pending - 1 } else { self.pending }
    }

    /// Gain of the integral, if there is one.
    pub fn integral(&self) -> Option<f64> {
        self.has_integral.then(|| self.gain[self.phi.nrows() + self.pending])
    }
}

impl StateFeedbackState {
    /// The part of it that does not change in time.
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// For a model of the axis.
    pub fn new(weights: &StateFeedback, machine: &Machine, design: &Design) -> Result<Self> {
        let linear = Linear::of(machine);
        let n = linear.a.nrows();
        let every = design.every;
        let ratio = design.delay / every;
        let near = (ratio - ratio.round()).abs() < 1e-9 * ratio.max(1.0);
        let whole = if near { ratio.round() } else { ratio.floor() };
        let rest = if near { 0.0 } else { design.delay - whole * every };
        let whole = whole as usize;
        let (phi, both) = linear.sampled(every);
        let (late, after) = linear.sampled(every - rest);
        let (_, early) = linear.sampled(rest.max(0.0));
        // x⁺ = Φ x + Γ₀ u_{k−d} + e^{A(T−ρ)} Γ(ρ) u_{k−d−1}
        let now = after.column(0).into_owned();
        let before = if rest > 0.0 { &late * early.column(0) } else { DVector::zeros(n) };
        let pending = whole + usize::from(rest > 0.0);

        // States of the regulator: those of the axis, commands under way, the integral.
        let integral = weights.integral.is_some();
        let size = n + pending + usize::from(integral);
        let (mut a, mut b) = (DMatrix::zeros(size, size), DMatrix::zeros(size, 1));
        a.view_mut((0, 0), (n, n)).copy_from(&phi);
        for (lag, effect) in [(whole, &now), (whole + 1, &before)] {
            match lag {
                0 => b.view_mut((0, 0), (n, 1)).copy_from(effect),
                lag if lag <= pending => a.view_mut((0, n + lag - 1), (n, 1)).copy_from(effect),
                _ => {}
            }
        }
        if pending > 0 {
            b[(n, 0)] = 1.0;
            for lag in 1..pending {
                a[(n + lag, n + lag - 1)] = 1.0;
            }
        }
        let mut q = DMatrix::zeros(size, size);
        let mut weigh = |row: &nalgebra::RowDVector<f64>, scale: f64| {
            for i in 0..n {
                for j in 0..n {
                    q[(i, j)] += row[i] * row[j] / (scale * scale);
                }
            }
        };
        weigh(&linear.cart, weights.position);
        if let Some(speed) = weights.speed {
            weigh(&linear.cart_speed, speed);
        }
        if let Some(scale) = weights.integral {
            let last = size - 1;
            a[(last, last)] = 1.0;
            // Of the scale, if there is one: it is the cart that is to come to rest where it should.
            let measured = linear.scale.as_ref().unwrap_or(&linear.measured);
            for j in 0..n {
                a[(last, j)] = every * measured[j];
            }
            q[(last, last)] = 1.0 / (scale * scale);
        }
        let r = DMatrix::from_element(1, 1, 1.0 / (weights.command * weights.command));
        let regulator = riccati::discrete(&a, &b, &q, &r)?;

        // The filter is the same problem transposed; what is unknown acts at the command, and as the same force at the
        // cart.
        let force = Rigid::of(machine).force_per_command();
        let mut noise = DMatrix::zeros(n, n);
        for (column, scale) in [(0, weights.disturbance), (1, weights.disturbance * force)] {
            let effect = both.column(column) * scale;
            noise += &effect * effect.transpose();
        }
        let (sensors, residual) = filter(&linear, &phi, &noise, weights, machine)?;
        let gain = regulator.gain.row(0).transpose();
        let law = Law { every, phi, now, before, sensors, gain, pending, has_integral: integral };
        Ok(Self {
            law,
            radius: machine.pulley_radius,
            states: linear.states,
            estimate: DVector::zeros(n),
            scratch: DVector::zeros(n),
            wanted: DVector::zeros(n),
            started: false,
            own: vec![0.0; pending],
            given: vec![0.0; pending + 1],
            integral: 0.0,
            integrated: 0.0,
            last_own: 0.0,
            residuals: [regulator.residual, residual],
        })
    }

    /// The next command beside feed-forward, told the position at the encoder and that at the scale, of which there may
    /// be none.
    pub fn step(&mut self, reference: &Reference, compensation: &Compensation, positions: [f64; 2]) -> f64 {
        let [position, _] = positions;
        // What the states should be, were the cart where it should be.
        let needed = compensation.needed(reference);
        let r = self.radius;
        let current = needed.force[0] / compensation.rigid.force_per_ampere;
        for (wanted, &state) in self.wanted.iter_mut().zip(&self.states) {
            *wanted = match state {
                Quantity::Position(CART) => reference.position,
                Quantity::Speed(CART) => reference.speed,
                Quantity::Position(IDLER) => needed.idler[0] / r,
                Quantity::Speed(IDLER) => needed.idler[1] / r,
                // The drive pulley, and a rotor behind it.
                Quantity::Position(_) => needed.drive.position / r,
                Quantity::Speed(_) => needed.drive.speed / r,
                Quantity::Current => current,
            };
        }
        if !self.started {
            self.started = true;
            // At rest where it is measured.
            for (x, &state) in self.estimate.iter_mut().zip(&self.states) {
                *x = match state {
                    Quantity::Position(CART) => position,
                    Quantity::Position(_) => position / r,
                    Quantity::Speed(_) | Quantity::Current => 0.0,
                };
            }
        }
        for (sensor, position) in self.law.sensors.iter().zip(positions) {
            let surprise = position - sensor.measured.dot(&self.estimate);
            self.estimate.axpy(surprise, &sensor.kalman, 1.0);
        }
        let law = &self.law;
        let mut command = 0.0;
        let n = self.estimate.len();
        for i in 0..n {
            command -= law.gain[i] * (self.estimate[i] - self.wanted[i]);
        }
        for (i, own) in self.own.iter().enumerate() {
            command -= law.gain[n + i] * own;
        }
        if let (Some(gain), Some((sensor, position))) = (law.integral(), law.sensors.iter().zip(positions).next_back())
        {
            command -= gain * self.integral;
            self.integrated = law.every * (position - sensor.measured.dot(&self.wanted));
            self.integral += self.integrated;
        }
        self.last_own = command;
        command
    }

    /// Is told what the limit took (`excess`), and what the axis gets beside what dry friction takes of it.
    pub fn limited(&mut self, excess: f64, effective: f64) {
        if excess != 0.0 && self.law.has_integral {
            // What has no effect is not gathered.
            self.integral -= self.integrated;
        }
        let law = &self.law;
        self.own.insert(0, self.last_own + excess);
        self.own.truncate(law.pending);
        self.given.insert(0, effective);
        self.given.truncate(law.pending + 1);
        let lag = law.lag();
        self.scratch.gemv(1.0, &law.phi, &self.estimate, 0.0);
        self.scratch.axpy(self.given[lag], &law.now, 1.0);
        if let Some(&previous) = self.given.get(lag + 1) {
            self.scratch.axpy(previous, &law.before, 1.0);
        }
        std::mem::swap(&mut self.scratch, &mut self.estimate);
    }

    /// Forgets.
    pub fn reset(&mut self) {
        self.started = false;
        self.own.fill(0.0);
        self.given.fill(0.0);
        (self.integral, self.integrated, self.last_own) = (0.0, 0.0, 0.0);
    }

    /// Shows its memory to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        flag(&mut self.started, memory)?;
        all(self.estimate.iter_mut().chain(&mut self.own).chain(&mut self.given), memory)?;
        all([&mut self.integral, &mut self.integrated, &mut self.last_own], memory)
    }
}

/// The sensors of the Kalman filter with their gains, and what is left of its Riccati equation. Their noise is
/// independent, so that they may correct one after another: L = P mᵀ/(m P mᵀ + V), P ← P − L m P, before the
/// prediction.
fn filter(
    linear: &Linear,
    phi: &DMatrix<f64>,
    noise: &DMatrix<f64>,
    weights: &StateFeedback,
    machine: &Machine,
) -> Result<(Vec<Corrected>, f64)> {
    let n = phi.nrows();
    let spread = |sensor: Sensor| weights.noise.max(0.3 * sensor.step());
    let mut all = vec![(linear.measured.transpose(), spread(Sensor::new(machine)))];
    if let (Some(row), Some(sensor)) = (&linear.scale, Sensor::of_scale(machine)) {
        all.push((row.transpose(), spread(sensor)));
    }
    let mut rows = DMatrix::zeros(n, all.len());
    all.iter().enumerate().for_each(|(k, (measured, _))| rows.set_column(k, measured));
    let variances = DMatrix::from_diagonal(&DVector::from_iterator(all.len(), all.iter().map(|(_, v)| v * v)));
    let filter = riccati::discrete(&phi.transpose(), &rows, noise, &variances)?;
    let mut x = filter.x;
    let mut sensors = Vec::new();
    for (measured, spread) in all {
        let p = &x * &measured;
        let kalman = &p / (measured.dot(&p) + spread * spread);
        x -= &kalman * p.transpose();
        sensors.push(Corrected { measured, kalman });
    }
    Ok((sensors, filter.residual))
}
