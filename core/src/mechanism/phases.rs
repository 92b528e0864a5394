//! Phases of a stepper: two windings with sinusoidal torque over the rotor angle.
//!
//! With N rotor teeth, the rotor's angle φ counted from a full step, ε = N φ + π/4, and the angle ψ = N x*/r + π/4 of
//! the commanded field (Kuo and Kelemen 1979; Kenjo and Sugawara 1994):
//!
//! ```text
//! L di_a/dt = v_a − R i_a + K_m φ̇ sin ε
//! L di_b/dt = v_b − R i_b − K_m φ̇ cos ε
//! τ = K_m (−i_a sin ε + i_b cos ε) − T_d sin 4ε
//! ```
//!
//! Phase b is phase a shifted by a quarter of a tooth pitch: with σ_a = 0 and σ_b = π/2 both have one formula. The rate
//! −R i/L is in the linear equations of a mode; the nonlinear rest is here.

use super::{Amplifier, Cause, Drive, Form, Mechanism, Mode, Motor, SpringLaw, State, Switch};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A stepper's phases, prepared for evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Phases {
    /// N
    pub teeth: f64,
    /// K_m, N m/A and V s/rad.
    pub torque_constant: f64,
    /// T_d, N m.
    pub detent_torque: f64,
    /// R, Ω.
    pub resistance: f64,
    /// L, H.
    pub inductance: f64,
    /// The voltage of the supply V, V.
    pub supply: f64,
    /// √2 I, A.
    pub amplitude: f64,
    /// 2π f_b of the chopper's regulator, 1/s; none if the driver sets the voltage.
    pub regulator: Option<f64>,
}

/// Rate of a phase current, A/s, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PhaseRate {
    /// di/dt + R i/L, A/s.
    pub value: f64,
    /// Derivatives with respect to rotor angle, speed and current.
    pub slopes: [f64; 3],
}

/// Small motions of a stepper without load about a constant speed, with currents that turn with the rotor: i_d along
/// its field and i_q across it, in the places of the two phases.
///
/// ```text
/// i_d = i_a cos ε + i_b sin ε          di_d/dt = u cos δ − λ i_d + N φ̇ i_q
/// i_q = −i_a sin ε + i_b cos ε         di_q/dt = u sin δ − λ i_q − N φ̇ i_d − κ φ̇
/// δ = ψ − ε                            τ = K_m i_q − T_d sin 4ε
/// ```
///
/// For a voltage u = V/L, λ = R/L and κ = K_m/L; for a chopper within its supply u = ω_c √2 I, λ = ω_c and κ = 0.
/// Detents count at rest, where the rotor is on a full step; at a speed their mean is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Steady {
    /// Torque on the rotor, N m.
    pub torque: Form,
    /// Rates of i_d and i_q, A/s.
    pub rates: [Form; 2],
}

impl Phases {
    /// Phases of a drive; none for a brushed motor.
    pub fn new(drive: &Drive) -> Option<Self> {
        Self::of_motor(&drive.motor, &drive.amplifier)
    }

    /// Phases of a motor and its driver.
    pub fn of_motor(motor: &Motor, amplifier: &Amplifier) -> Option<Self> {
        let stepper = motor.stepper?;
        Some(Self {
            teeth: stepper.teeth(),
            torque_constant: motor.torque_constant,
            detent_torque: stepper.detent_torque,
            resistance: motor.resistance,
            inductance: motor.inductance,
            supply: amplifier.voltage_limit.unwrap_or(f64::INFINITY),
            amplitude: stepper.amplitude(),
            regulator: amplifier.bandwidth.map(|bandwidth| 2.0 * PI * bandwidth),
        })
    }

    /// ε = N φ + π/4, or ψ of the commanded angle.
    fn electrical(&self, angle: f64) -> f64 {
        self.teeth * angle + FRAC_PI_4
    }

    /// Torque on the rotor, N m, at an angle, rad, and currents, A, with its derivatives.
    #[inline(always)]
    pub fn torque(&self, angle: f64, [a, b]: [f64; 2]) -> (f64, [f64; 3]) {
        let (sin, cos) = self.electrical(angle).sin_cos();
        let (k, n) = (self.torque_constant, self.teeth);
        // sin 4ε = 4 sin ε cos ε (1 − 2 sin² ε), cos 4ε = 1 − 8 sin² ε cos² ε
        let product = sin * cos;
        let detent = self.detent_torque * 4.0 * product * (1.0 - 2.0 * sin * sin);
        let detent_slope = self.detent_torque * 4.0 * n * (1.0 - 8.0 * product * product);
        // τ = K_m (−i_a sin ε + i_b cos ε) − T_d sin 4ε
        let torque = k * (b * cos - a * sin) - detent;
        (torque, [-k * n * (a * cos + b * sin) - detent_slope, -k * sin, k * cos])
    }

    /// Rate of a phase current without −R i/L, at the commanded angle `told`, rad.
    #[inline(always)]
    pub fn rate(&self, phase: usize, angle: f64, speed: f64, current: f64, told: f64) -> PhaseRate {
        let (sin, cos) = (self.electrical(angle) - FRAC_PI_2 * phase as f64).sin_cos();
        let along = (self.electrical(told) - FRAC_PI_2 * phase as f64).cos();
        self.rate_at([sin, cos], along, speed, current)
    }

    /// Rate of a phase current without −R i/L, with sine and cosine of the rotor's electrical angle ε − σ and the
    /// cosine of the commanded one, ψ − σ.
    #[inline(always)]
    pub fn rate_at(&self, [sin, cos]: [f64; 2], along: f64, speed: f64, current: f64) -> PhaseRate {
        let (k, n, l) = (self.torque_constant, self.teeth, self.inductance);
        // e = −K_m φ̇ sin(ε − σ)
        let (emf, by_angle, by_speed) = (-k * speed * sin, -k * speed * n * cos, -k * sin);
        let voltage = match self.regulator {
            // v = V cos(ψ − σ)
            None => self.supply * along,
            // v = R i + e + L ω_c (√2 I cos(ψ − σ) − i), no more than ±V
            Some(rate) => {
                let wanted = self.wanted(rate, emf, current, along);
                if wanted.abs() < self.supply {
                    let value = self.resistance / l * current + rate * (self.amplitude * along - current);
                    return PhaseRate { value, slopes: [0.0, 0.0, self.resistance / l - rate] };
                }
                self.supply.copysign(wanted)
            }
        };
        PhaseRate { value: (voltage - emf) / l, slopes: [-by_angle / l, -by_speed / l, 0.0] }
    }

    /// R i + e + L ω_c (i* − i), V.
    #[inline(always)]
    fn wanted(&self, regulator: f64, emf: f64, current: f64, along: f64) -> f64 {
        self.resistance * current + emf + self.inductance * regulator * (self.amplitude * along - current)
    }

    /// Excess of a phase regulator's voltage over V and −V, V; a limit begins or ceases to bind at its zeros. None
    /// without a regulator.
    #[inline(always)]
    pub fn excess(&self, phase: usize, angle: f64, speed: f64, current: f64, told: f64) -> Option<[f64; 2]> {
        let sin = (self.electrical(angle) - FRAC_PI_2 * phase as f64).sin();
        let along = (self.electrical(told) - FRAC_PI_2 * phase as f64).cos();
        let wanted = self.wanted(self.regulator?, -self.torque_constant * speed * sin, current, along);
        Some([wanted - self.supply, wanted + self.supply])
    }

    /// u, λ and κ of [`Steady`].
    fn turning(&self) -> [f64; 3] {
        match self.regulator {
            Some(rate) => [rate * self.amplitude, rate, 0.0],
            None => [self.supply, self.resistance, self.torque_constant].map(|value| value / self.inductance),
        }
    }

    /// Stiffness of the field at rest, N m/rad: N T_h, the mean over the steps of its detents, where T_h is the holding
    /// torque with the currents at rest.
    pub fn stiffness(&self) -> f64 {
        let [u, rate, _] = self.turning();
        self.teeth * self.torque_constant * (u / rate).min(self.supply / self.resistance)
    }

    /// i_d, A, and the angle δ by which the rotor is behind its field, rad, at this speed, rad/s, without load. None
    /// where the supply does not suffice for it, or limits the currents of a chopper.
    pub fn without_load(&self, speed: f64) -> Option<(f64, f64)> {
        let ([u, rate, emf], turning) = (self.turning(), self.teeth * speed);
        // u cos δ = λ i_d and u sin δ = ω (N i_d + κ), so u² = λ² i_d² + ω² (N i_d + κ)²
        let (square, half) = (rate * rate + turning * turning, turning * speed * emf);
        let current = ((half * half + square * (u * u - (speed * emf).powi(2))).sqrt() - half) / square;
        // v_d = R i_d and v_q = N ω L i_d + K_m ω; at rest on a full step each phase has v_d/√2
        let across = turning * self.inductance * current + self.torque_constant * speed;
        let needed = match speed == 0.0 {
            true => self.resistance * current * FRAC_PI_4.cos(),
            false => (self.resistance * current).hypot(across),
        };
        let suffices = self.regulator.is_none() || needed < self.supply;
        (current > 0.0 && suffices).then(|| (current, (speed * (self.teeth * current + emf)).atan2(rate * current)))
    }

    /// The amplitude of the phases' commands: a current of a chopper, A, or else a voltage, V.
    pub fn commanded(&self) -> f64 {
        if self.regulator.is_some() { self.amplitude } else { self.supply }
    }

    /// The amplitude of the phase currents at rest, A; none exceeds V/R.
    pub fn holding_current(&self) -> f64 {
        if self.regulator.is_some() { self.amplitude } else { self.supply / self.resistance }
    }

    /// Currents at rest at this commanded angle of the field, A.
    pub fn at_rest(&self, told: f64) -> [f64; 2] {
        let (most, amplitude) = (self.supply / self.resistance, self.holding_current());
        [0.0, FRAC_PI_2].map(|shift| (amplitude * (self.electrical(told) - shift).cos()).clamp(-most, most))
    }
}

impl Mechanism {
    /// The spring whose length is the angle of a stepper's rotor, and the angle at zero length.
    pub fn angle_of(&self, drive: usize) -> Option<(usize, f64)> {
        let shaft = self.drives[drive].shaft;
        self.springs.iter().enumerate().find_map(|(index, spring)| match spring.law {
            SpringLaw::Angle { at } if spring.arms.iter().any(|(body, _)| *body == shaft) => Some((index, at)),
            _ => None,
        })
    }

    /// Commanded angle of a stepper's shaft per unit of the input, rad/m: 1/r.
    pub fn angle_per_input(&self, drive: usize) -> f64 {
        self.drives[drive].amplifier.gain / self.bodies[self.drives[drive].pulley].kind.lever()
    }

    /// Input of a microstep, m; none for a brushed motor or an interpolating driver.
    pub fn microstep(&self, drive: usize) -> Option<f64> {
        let stepper = self.drives[drive].motor.stepper.filter(|stepper| !stepper.interpolate)?;
        Some(stepper.microstep() / self.angle_per_input(drive))
    }

    /// True if the command of a drive advances in microsteps.
    pub fn is_stepped(&self) -> bool {
        (0..self.drives.len()).any(|drive| self.microstep(drive).is_some())
    }

    /// Largest allowed jump of a stepper's command, m: two full steps, half a tooth pitch.
    pub fn farthest_jump(&self, drive: usize) -> Option<f64> {
        let stepper = self.drives[drive].motor.stepper?;
        Some(PI / stepper.teeth() / self.angle_per_input(drive).abs())
    }

    /// Equations of a stepper for small motions about this speed of its shaft, rad/s; none for a brushed motor, and
    /// where [`Phases::without_load`] has no current.
    pub fn steady(&self, drive: usize, speed: f64) -> Option<Steady> {
        let (phases, (spring, _)) = Phases::new(&self.drives[drive]).zip(self.angle_of(drive))?;
        let (first, shaft) = (self.first_current(drive), Form::speed(self.drives[drive].shaft));
        let ([u, rate, emf], n, k) = (phases.turning(), phases.teeth, phases.torque_constant);
        let (along, behind) = phases.without_load(speed)?;
        let (angle, direct, across) = (Form::stretch(spring), Form::current(first), Form::current(first + 1));
        // δ = N (φ* − φ) beyond its steady value
        let lag = (Form::input(drive) * self.angle_per_input(drive) - angle) * n;
        // sin 4ε = −sin 4Nφ about a full step
        let detent = if speed == 0.0 { 4.0 * n * phases.detent_torque } else { 0.0 };
        Some(Steady {
            torque: across * k + angle * detent,
            rates: [
                lag * (-u * behind.sin()) - direct * rate + across * (n * speed),
                lag * (u * behind.cos()) - across * rate - direct * (n * speed) - shaft * (n * along + emf),
            ],
        })
    }

    /// Lag of a stepper's rotor behind its command, rad.
    fn lag(&self, drive: usize) -> Option<Form> {
        let (spring, at) = self.angle_of(drive)?;
        let mut lag = -Form::stretch(spring);
        lag.input[drive] = self.angle_per_input(drive);
        lag.constant = -at;
        Some(lag)
    }

    /// Guards of a rotor within half a tooth pitch of the field; beyond that it falls to the next tooth, four full
    /// steps away.
    pub(super) fn watch_steps(&self, drive: usize, mode: &Mode, watch: &mut impl FnMut(Form, Cause)) {
        let Some((lag, stepper)) = self.lag(drive).zip(self.drives[drive].motor.stepper) else { return };
        let (slipped, pitch) = (mode.drive[drive].slipped, 2.0 * PI / stepper.teeth());
        let middle = lag - Form::constant(f64::from(slipped) * pitch);
        let half = Form::constant(0.5 * pitch);
        watch(half - middle, Cause::Switch(Switch::Field(drive, slipped + 1)));
        watch(half + middle, Cause::Switch(Switch::Field(drive, slipped - 1)));
    }

    /// Sets the phase currents of steppers that hold the rotor in its position.
    pub(super) fn energise(&self, state: &mut State) {
        for (number, drive) in self.drives.iter().enumerate() {
            if let Some(phases) = Phases::new(drive) {
                let first = self.first_current(number);
                state.current[first..first + 2].copy_from_slice(&phases.at_rest(state.position[drive.shaft]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases() -> Phases {
        Phases {
            teeth: 50.0,
            torque_constant: 0.3,
            detent_torque: 0.02,
            resistance: 1.5,
            inductance: 3e-3,
            supply: 24.0,
            amplitude: 2.0,
            regulator: None,
        }
    }

    #[test]
    fn without_current_the_detent_torque_is_a_sine_of_four_periods_per_field() {
        for k in -20..20 {
            let angle = 1e-3 * f64::from(k);
            let epsilon = 50.0 * angle + FRAC_PI_4;
            let (torque, _) = phases().torque(angle, [0.0; 2]);
            assert!((torque + 0.02 * (4.0 * epsilon).sin()).abs() < 1e-15, "{angle}");
        }
    }

    #[test]
    fn derivatives_of_the_torque_are_those_of_differences() {
        let of = |[angle, a, b]: [f64; 3]| phases().torque(angle, [a, b]).0;
        let (at, steps) = ([0.013, 1.3, -0.7], [1e-6, 1e-4, 1e-4]);
        let (_, slopes) = phases().torque(at[0], [at[1], at[2]]);
        for (k, slope) in slopes.into_iter().enumerate() {
            let moved = |side: f64| std::array::from_fn(|j| at[j] + if j == k { side * steps[k] } else { 0.0 });
            let difference = (of(moved(1.0)) - of(moved(-1.0))) / (2.0 * steps[k]);
            assert!((slope - difference).abs() < 1e-6 * slope.abs(), "{k}: {slope} for {difference}");
        }
    }
}
