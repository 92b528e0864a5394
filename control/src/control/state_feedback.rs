//! State feedback with a Kalman filter: LQG, and with an integral LQI.

use super::law::{Law, LawInputs};
use super::model::Linear;
use super::model::Quantity;
use super::riccati;
use super::sampled::Sensor;
use crate::calculator::{Calculator, Slot, Slots, less, more};
use crate::design::{Design, StateFeedback};
use crate::error::{Error, Result};
use crate::linear::eigen::{balance, eigenvalues, scaled};
use crate::machine::Machine;
use crate::machine::axis::{CART, IDLER};
use crate::machine::rigid::Rigid;
use nalgebra::{DMatrix, DVector, RowDVector};

/// Maximum number of states of an axis.
const STATES: usize = 2 * crate::mechanism::BODIES + crate::mechanism::DRIVES;

/// A linear-quadratic regulator on the states that a Kalman filter estimates, both for the sampled axis with its delay.
#[derive(Debug, Clone)]
pub(crate) struct StateFeedbackLaw {
    every: f64,
    /// Φ, row by row, without zeros.
    phi: Vec<Vec<(usize, f64)>>,
    /// Effect over a sample of the command that begins within it, and of the previous one.
    now: Vec<f64>,
    before: Vec<f64>,
    /// The encoder, then the scale, if any. Each corrects the estimate of the previous one.
    sensors: Vec<Corrected>,
    /// u = −K (x − x*): for states, pending commands, and the integral.
    gain: Vec<f64>,
    pending: usize,
    radius: f64,
    states: Vec<Quantity>,
    /// Stored values.
    started: Slot,
    estimate: Vec<Slot>,
    /// The last commands without feed-forward, latest first, and as the axis got them.
    own: Vec<Slot>,
    given: Vec<Slot>,
    /// Integral of the measured error, and its last part.
    integral: Option<[Slot; 2]>,
    last_own: Slot,
}

/// A sensor of the Kalman filter: x̂ ← x̂ + L (y − m x̂).
#[derive(Debug, Clone)]
struct Corrected {
    /// m, without zeros.
    measured: Vec<(usize, f64)>,
    /// L.
    kalman: Vec<f64>,
}

/// Nonzero entries of a row.
fn sparse<'a>(row: impl IntoIterator<Item = &'a f64>) -> Vec<(usize, f64)> {
    row.into_iter().copied().enumerate().filter(|(_, value)| *value != 0.0).collect()
}

/// Σ of products.
fn dot<C: Calculator>(c: &mut C, weights: &[(usize, f64)], of: &[C::N]) -> C::N {
    let products = weights.iter().map(|&(i, weight)| of[i] * weight);
    products.reduce(|sum, product| sum + product).unwrap_or_else(|| c.number(0.0))
}

impl StateFeedbackLaw {
    /// For a model of the axis.
    pub fn new(slots: &mut Slots, weights: &StateFeedback, machine: &Machine, design: &Design) -> Result<Self> {
        let linear = Linear::new(machine);
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

        // States of the regulator: those of the axis, pending commands, the integral.
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
            // The position by the scale, if any, since the cart has to reach its target.
            let measured = linear.scale.as_ref().unwrap_or(&linear.measured);
            for j in 0..n {
                a[(last, j)] = every * measured[j];
            }
            q[(last, last)] = 1.0 / (scale * scale);
        }
        let r = DMatrix::from_element(1, 1, 1.0 / (weights.command * weights.command));
        let regulator = riccati::discrete(&a, &b, &q, &r).map_err(|error| explained(error, &linear))?;

        // The filter is the transposed problem; the disturbance acts at the command, and as the same force at the cart.
        let force = Rigid::new(machine).force_per_command();
        let mut noise = DMatrix::zeros(n, n);
        for (column, scale) in [(0, weights.disturbance), (1, weights.disturbance * force)] {
            let effect = both.column(column) * scale;
            noise += &effect * effect.transpose();
        }
        let sensors = filter(&linear, &phi, &noise, weights, machine)?;
        let integral = integral.then(|| {
            let integral = slots.add("integral", "integral of the measured error, m s");
            [integral, slots.add("integrated", "its last part")]
        });
        Ok(Self {
            every,
            phi: phi.row_iter().map(|row| sparse(row.iter())).collect(),
            now: now.iter().copied().collect(),
            before: before.iter().copied().collect(),
            sensors,
            gain: regulator.gain.row(0).iter().copied().collect(),
            pending,
            radius: machine.pulley_radius,
            states: linear.states,
            started: slots.add("started", "1 once the filter has begun"),
            estimate: slots.list(n, "estimate", "estimated state"),
            own: slots.list(pending, "own", "a command under way"),
            given: slots.list(pending + 1, "given", "a command as the axis got it"),
            integral,
            last_own: slots.add("last_own", "the last command"),
        })
    }

    /// Number of samples from a command to its effect.
    fn lag(&self) -> usize {
        if self.before.iter().any(|v| *v != 0.0) { self.pending - 1 } else { self.pending }
    }

    /// The states if the cart were at its reference.
    fn wanted<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> [C::N; STATES] {
        let (r, reference) = (self.radius, &seen.reference);
        let needed = seen.compensation.needed_by(c, reference);
        let (current, _) = seen.compensation.rigid.current_by(c, needed.force[0], &needed.drive);
        let mut wanted = [c.number(0.0); STATES];
        for (i, (wanted, &state)) in wanted.iter_mut().zip(&self.states).enumerate() {
            let value = match state {
                Quantity::Position(CART) => reference.position,
                Quantity::Speed(CART) => reference.speed,
                Quantity::Position(IDLER) => needed.idler[0] / r,
                Quantity::Speed(IDLER) => needed.idler[1] / r,
                // The drive pulley, and a rotor behind it.
                Quantity::Position(_) => needed.drive.position / r,
                Quantity::Speed(_) => needed.drive.speed / r,
                Quantity::Current => current,
            };
            *wanted = c.numbered("wanted", i, value);
        }
        wanted
    }

    /// The estimate before a sample; at the first one, at rest at the measured position.
    fn estimated<C: Calculator>(&self, c: &mut C, position: C::N) -> [C::N; STATES] {
        let (zero, one, started) = (c.number(0.0), c.number(1.0), c.memory(self.started));
        c.keep(self.started, one);
        let mut estimate = [zero; STATES];
        for (i, (estimate, &state)) in estimate.iter_mut().zip(&self.states).enumerate() {
            let at_rest = match state {
                Quantity::Position(CART) => position,
                Quantity::Position(_) => position / self.radius,
                Quantity::Speed(_) | Quantity::Current => zero,
            };
            let known = c.memory(self.estimate[i]);
            *estimate = c.choose(less(started, 0.5), at_rest, known);
        }
        estimate
    }
}

impl Law for StateFeedbackLaw {
    fn about(&self) -> &'static str {
        "feedback of the states that a Kalman filter estimates"
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N {
        let n = self.states.len();
        let wanted = self.wanted(c, seen);
        let mut estimate = self.estimated(c, seen.position);
        let positions = [seen.position, seen.scale.unwrap_or(seen.position)];
        for (sensor, position) in self.sensors.iter().zip(positions) {
            let surprise = position - dot(c, &sensor.measured, &estimate);
            let surprise = c.name("innovation", surprise);
            for (i, kalman) in sensor.kalman.iter().enumerate() {
                estimate[i] = c.numbered("corrected", i, surprise * *kalman + estimate[i]);
            }
        }
        let mut command = c.number(0.0);
        for i in 0..n {
            c.keep(self.estimate[i], estimate[i]);
            command = command - (estimate[i] - wanted[i]) * self.gain[i];
        }
        for (own, gain) in self.own.iter().zip(&self.gain[n..]) {
            command = command - c.memory(*own) * *gain;
        }
        if let (Some([sum, part]), Some((sensor, position))) =
            (self.integral, self.sensors.iter().zip(positions).next_back())
        {
            let integral = c.memory(sum);
            command = command - integral * self.gain[n + self.pending];
            let error = position - dot(c, &sensor.measured, &wanted);
            let integrated = c.name("part", error * self.every);
            c.keep(part, integrated);
            c.keep(sum, integral + integrated);
        }
        let command = c.name("fed_back", command);
        c.keep(self.last_own, command);
        command
    }

    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, effective: C::N) {
        if let Some([sum, part]) = self.integral {
            // The integral is held while it has no effect.
            let (integral, integrated) = (c.memory(sum), c.memory(part));
            let back = integral - integrated;
            let kept = c.choose(less(excess, 0.0), back, integral);
            let kept = c.choose(more(excess, 0.0), back, kept);
            c.keep(sum, kept);
        }
        let latest = c.memory(self.last_own) + excess;
        for (slots, latest) in [(&self.own, latest), (&self.given, effective)] {
            for pair in slots.windows(2).rev() {
                let earlier = c.memory(pair[0]);
                c.keep(pair[1], earlier);
            }
            if let Some(first) = slots.first() {
                c.keep(*first, latest);
            }
        }
        // x⁺ = Φ x + Γ₀ u_{k−d} + e^{A(T−ρ)} Γ(ρ) u_{k−d−1}
        let lag = self.lag();
        let given = c.memory(self.given[lag]);
        let previous = self.given.get(lag + 1).map(|slot| c.memory(*slot));
        let mut estimate = [c.number(0.0); STATES];
        for (estimate, slot) in estimate.iter_mut().zip(&self.estimate) {
            *estimate = c.memory(*slot);
        }
        for (i, row) in self.phi.iter().enumerate() {
            let mut next = dot(c, row, &estimate) + given * self.now[i];
            if let Some(previous) = previous {
                next = next + previous * self.before[i];
            }
            c.keep(self.estimate[i], next);
        }
    }
}

/// The error of the regulator's equation, with its reason if that is known.
fn explained(error: Error, linear: &Linear) -> Error {
    let Some(hertz) = vibration_without_cart(linear) else { return error };
    Error::new(format!(
        "the Riccati equation of the state feedback has no stabilising solution: the axis vibrates at {hertz:.4} Hz \
         without damping while its cart stands still, and only the cart is weighted"
    ))
    .allowed("vibrations that move the cart or decay by themselves")
    .next("give the spans damping in [belt], or the pulleys viscous friction; a real axis has both")
}

/// Relative size below which damping, or the motion of the cart in a vibration, is rounding.
const NOTHING: f64 = 1e-9;

/// Frequency, Hz, of an undamped vibration in which the cart stands still, as that of a belt whose pulleys and spans
/// are alike on both sides. It is not observable from the cart, so no weight of the cart makes the regulator damp it.
fn vibration_without_cart(linear: &Linear) -> Option<f64> {
    let (n, scale) = (linear.a.nrows(), balance(&linear.a));
    let a = scaled(&linear.a, &scale);
    let vibrations = eigenvalues(&linear.a).ok()?;
    let mut undamped = vibrations.iter().filter(|pole| pole.im > 0.0 && pole.re.abs() <= NOTHING * pole.im);
    undamped.find_map(|pole| {
        // (A² + ω² 1) x = 0, c x = 0 and c A x = 0 with x ≠ 0
        let of_vibration = &a * &a + DMatrix::identity(n, n) * (pole.im * pole.im);
        let size = of_vibration.norm();
        let mut rows = of_vibration.resize_vertically(n + 2, 0.0);
        for (row, cart) in [&linear.cart, &linear.cart_speed].into_iter().enumerate() {
            let cart = RowDVector::from_fn(n, |_, j| cart[j] * scale[j]);
            rows.set_row(n + row, &(&cart * (size / cart.norm())));
        }
        let least = rows.svd(false, false).singular_values.min();
        (least <= NOTHING * size).then(|| pole.im / std::f64::consts::TAU)
    })
}

/// The sensors of the Kalman filter with their gains. Their noise is independent, so they may correct sequentially: L =
/// P mᵀ/(m P mᵀ + V), P ← P − L m P, before the prediction.
fn filter(
    linear: &Linear,
    phi: &DMatrix<f64>,
    noise: &DMatrix<f64>,
    weights: &StateFeedback,
    machine: &Machine,
) -> Result<Vec<Corrected>> {
    let n = phi.nrows();
    let spread = |sensor: Sensor| weights.noise.max(0.3 * sensor.step());
    let mut all = vec![(linear.measured.transpose(), spread(Sensor::new(machine, 0)))];
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
        sensors.push(Corrected { measured: sparse(measured.iter()), kalman: kalman.iter().copied().collect() });
    }
    Ok(sensors)
}
