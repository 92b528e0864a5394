//! Rigid model: an axis as one mass along its belt.

use super::{AmplifierMode, DriveUnit, Machine, SlideAt};
use crate::calculator::{Calculator, Evaluation, Number, at_least, less, more};
use crate::mechanism::Phases;
use crate::signal::profile::Reference;

/// Largest speed of a reference that counts as rest, m/s, and largest acceleration that counts as none, m/s²: what
/// rounding leaves of a generated trajectory, in single precision too, has no direction.
pub const REST_SPEED: f64 = 1e-6;
/// m/s²
pub const REST_ACCELERATION: f64 = 1e-3;

/// The axis as one mass along the belt (Li & Rehani 1996), and its motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// M + (J₁ + n² J_r + J₂)/r², kg.
    pub mass: f64,
    /// (J₁ + n² J_r)/r², the share of the drive side, kg.
    pub driving: f64,
    /// n² J_r/r², the share of the rotor, whose own torque does not pass through the gear, kg.
    pub rotor: f64,
    /// b + (B₁ + B₂)/r², N s/m, forward and backward.
    pub viscous: [f64; 2],
    /// F_c + (τ_c1 + τ_c2)/r, N, forward and backward.
    pub coulomb: [f64; 2],
    /// Constant force on the cart, N.
    pub constant: f64,
    /// n K_t/r, N/A, without the gear's loss.
    pub force_per_ampere: f64,
    efficiency: f64,
    /// n K_e/r, V s/m.
    pub brake: f64,
    resistance: f64,
    inductance: f64,
    gain: f64,
    mode: AmplifierMode,
    /// N T_h/r²: stiffness of the field that holds the rotor of a stepper, N/m; zero for other motors.
    pub field: f64,
}

impl Rigid {
    /// Rigid model of an axis; for several drives, the share of each one when all move the heaviest slide.
    pub fn new(machine: &Machine) -> Self {
        if machine.drives.len() == 1 {
            return Self::of_drive(machine, 0);
        }
        // With y = s q and q = Σ l y the work Σ f dy = M q̈ dq gives f = l M q̈ = (l/s) M ÿ, for each that moves it.
        let share = |(number, at): (usize, &SlideAt)| {
            let drive = at.by_drives.iter().position(|weight| *weight != 0.0)?;
            let weight = at.by_drives[drive] / machine.belt_shares()[drive][number];
            Self::of_slide(machine, number).map(|slide| (drive, weight, slide))
        };
        let shares = machine.geometry().slides.iter().enumerate().filter_map(share);
        let heaviest = shares.max_by(|(_, v, a), (_, w, b)| (v * a.mass).total_cmp(&(w * b.mass)));
        let Some((drive, weight, slide)) = heaviest else { return Self::of_pulley(machine, 0) };
        let pulley = Self::of_pulley(machine, drive);
        let sum = |own: [f64; 2], more: [f64; 2]| [own[0] + weight * more[0], own[1] + weight * more[1]];
        Self {
            mass: pulley.mass + weight * slide.mass,
            viscous: sum(pulley.viscous, slide.viscous),
            coulomb: sum(pulley.coulomb, slide.coulomb),
            constant: weight * slide.constant,
            ..pulley
        }
    }

    /// Rigid model of an axis with the motor of this drive.
    fn of_drive(machine: &Machine, drive: usize) -> Self {
        let DriveUnit { motor, amplifier } = &machine.drives[drive];
        let (r, n) = (machine.pulley_radius, motor.gear_ratio);
        let rotor = n * n * motor.rotor_inertia;
        let pulleys = machine.drive_pulley.inertia + rotor + machine.idler_pulley.inertia;
        let [drive, cart, idler] =
            [machine.drive_pulley.friction, machine.cart.friction, machine.idler_pulley.friction];
        Self {
            mass: machine.cart.mass + pulleys / (r * r),
            driving: (machine.drive_pulley.inertia + rotor) / (r * r),
            rotor: rotor / (r * r),
            viscous: [true, false].map(|forward| {
                cart.side(forward).viscous + (drive.side(forward).viscous + idler.side(forward).viscous) / (r * r)
            }),
            coulomb: [true, false].map(|forward| {
                cart.side(forward).coulomb + (drive.side(forward).coulomb + idler.side(forward).coulomb) / r
            }),
            constant: machine.cart.constant_force(),
            force_per_ampere: n * motor.torque_constant / r,
            efficiency: motor.gear_efficiency,
            brake: n * motor.back_emf_constant / r,
            resistance: motor.resistance,
            inductance: motor.inductance,
            gain: amplifier.gain,
            mode: amplifier.mode,
            field: Phases::of_motor(motor, amplifier).map_or(0.0, |phases| phases.stiffness() / (r * r)),
        }
    }

    /// One drive of a machine with several drives, without the load: its motor, with the mass and friction of its
    /// pulley.
    pub(crate) fn of_pulley(machine: &Machine, drive: usize) -> Self {
        let (whole, r) = (Self::of_drive(machine, drive), machine.pulley_radius);
        let sides = [true, false].map(|forward| machine.drive_pulley.friction.side(forward));
        Self {
            mass: whole.driving,
            viscous: sides.map(|side| side.viscous / (r * r)),
            coulomb: sides.map(|side| side.coulomb / r),
            constant: 0.0,
            ..whole
        }
    }

    /// A slide as a mass with its friction and constant force, without a motor.
    pub(crate) fn of_slide(machine: &Machine, number: usize) -> Option<Self> {
        let (slide, at) = machine.slides().zip(machine.geometry().slides).nth(number)?;
        let sides = [true, false].map(|forward| slide.friction.side(forward));
        let body = &machine.mechanism().bodies[at.body];
        Some(Self {
            mass: body.inertia,
            driving: 0.0,
            rotor: 0.0,
            viscous: sides.map(|side| side.viscous),
            coulomb: sides.map(|side| side.coulomb),
            constant: body.force,
            ..Self::of_drive(machine, 0)
        })
    }

    /// Motor current, A, and terminal voltage, V, that give `force` (N, changing at `rate`, N/s), the rotor's own
    /// included, while the drive pulley moves like this.
    pub fn electrical(&self, force: f64, rate: f64, drive: &Reference) -> (f64, f64) {
        self.electrical_by(&mut Evaluation::plain(), force, rate, drive)
    }

    /// As the function without `_by`, for any calculator.
    pub(crate) fn electrical_by<C: Calculator>(
        &self,
        c: &mut C,
        force: C::N,
        rate: C::N,
        drive: &Reference<C::N>,
    ) -> (C::N, C::N) {
        let (current, per_ampere) = self.current_by(c, force, drive);
        // v = R i + L di/dt + K_e n φ̇                                        (4) with an inductance
        let mut voltage = current * self.resistance;
        if self.inductance != 0.0 {
            let change = drive.jerk * self.inductance;
            let passed = self.passed(c, rate * self.inductance, change);
            voltage = voltage + self.amperes(passed, change, per_ampere);
        }
        (current, voltage + drive.speed * self.brake)
    }

    /// Motor current, A, and the force that an ampere gives through the gear then.
    pub fn current_by<C: Calculator>(&self, c: &mut C, force: C::N, drive: &Reference<C::N>) -> (C::N, C::N) {
        let force = c.name("force", force);
        let passed = self.passed(c, force, drive.acceleration);
        let per_ampere = self.per_ampere(c, passed, drive.speed);
        let current = self.amperes(passed, drive.acceleration, per_ampere);
        (c.name("amperes", current), per_ampere)
    }

    /// Part of a force that passes through a gear with losses, without the part that accelerates the rotor.
    fn passed<C: Calculator>(&self, c: &mut C, force: C::N, acceleration: C::N) -> C::N {
        match self.is_shared() {
            true => c.name("passed", force - acceleration * self.rotor),
            false => force,
        }
    }

    /// i = (F − n² J_r a/r²)/(e n K_t/r) + (n² J_r a/r²)/(n K_t/r), from what passes through the gear
    fn amperes<N: Number>(&self, passed: N, acceleration: N, per_ampere: N) -> N {
        match self.is_shared() {
            true => passed / per_ampere + acceleration * (self.rotor / self.force_per_ampere),
            false => passed / per_ampere,
        }
    }

    /// True if the gear's loss applies to a part of the force only.
    fn is_shared(&self) -> bool {
        self.efficiency < 1.0 && self.rotor > 0.0
    }

    /// Force per ampere: reduced by the gear's loss if the motor drives, increased if it is driven; at rest it is taken
    /// to drive.
    fn per_ampere<C: Calculator>(&self, c: &mut C, force: C::N, speed: C::N) -> C::N {
        let [drives, driven] = [self.efficiency, 1.0 / self.efficiency].map(|e| c.number(self.force_per_ampere * e));
        if self.efficiency == 1.0 {
            return drives;
        }
        let moving = c.choose(at_least(force * speed, 0.0), drives, driven);
        let backward = c.choose(less(speed, -REST_SPEED), moving, drives);
        let per_ampere = c.choose(more(speed, REST_SPEED), moving, backward);
        c.name("per_ampere", per_ampere)
    }

    /// Command, V or A, or the lead of a stepper's field in m, for `force` (N, changing at `rate`, N/s), the rotor's
    /// own included, while the drive pulley moves like this.
    pub fn command(&self, force: f64, rate: f64, drive: &Reference) -> f64 {
        self.command_by(&mut Evaluation::plain(), force, rate, drive)
    }

    /// As the function without `_by`, for any calculator.
    pub fn command_by<C: Calculator>(&self, c: &mut C, force: C::N, rate: C::N, drive: &Reference<C::N>) -> C::N {
        if self.mode == AmplifierMode::Position {
            return force / (self.field * self.gain);
        }
        let (current, voltage) = self.electrical_by(c, force, rate, drive);
        if self.mode == AmplifierMode::Current { current / self.gain } else { voltage / self.gain }
    }

    /// A feed-forward command at this speed of the drive pulley in two parts: a current for a current loop, A, and the
    /// voltage outside for the back-EMF, V. A command of zero has no parts.
    pub fn split<C: Calculator>(&self, c: &mut C, speed: C::N, command: C::N) -> [C::N; 2] {
        let zero = c.number(0.0);
        let steady = Reference { position: zero, speed, acceleration: zero, jerk: zero, snap: zero };
        let back = self.command_by(c, zero, zero, &steady);
        let nothing = c.choose(less(command, 0.0), back, zero);
        let back = c.choose(more(command, 0.0), back, nothing);
        let back = c.name("back_emf", back);
        let inner = (command - back) * self.amperes_per_command();
        [c.name("inner", inner), back]
    }

    /// Force per command at rest, N/V, N/A or N/m.
    pub fn force_per_command(&self) -> f64 {
        1.0 / self.command(1.0, 0.0, &Reference::default())
    }

    /// n η K_t/r, N/A: the force of an ampere while the motor drives.
    pub fn driving_force_per_ampere(&self) -> f64 {
        self.force_per_ampere * self.efficiency
    }

    /// Current per command at standstill in voltage mode, A/V.
    pub fn amperes_per_command(&self) -> f64 {
        self.force_per_command() / self.driving_force_per_ampere()
    }

    /// Mass that the motor's force, less the loss of its gear, accelerates: with η n² J_r/r² of the rotor, kg.
    pub fn accelerated(&self) -> f64 {
        self.mass - (1.0 - self.efficiency) * self.rotor
    }

    /// Viscous drag of axis and motor, N s/m: b, in voltage mode plus n² K_t K_e/(R r²).
    pub fn drag(&self) -> f64 {
        self.viscous[0]
            + match self.mode {
                AmplifierMode::Current | AmplifierMode::Position => 0.0,
                AmplifierMode::Voltage => self.force_per_ampere * self.brake / self.resistance,
            }
    }

    /// Viscous and dry friction of the axis at this speed, N; `sign` is the direction of the dry part.
    pub fn friction(&self, speed: f64, sign: f64) -> (f64, f64) {
        self.friction_by(&mut Evaluation::plain(), speed, sign)
    }

    /// As the function without `_by`, for any calculator.
    pub(crate) fn friction_by<C: Calculator>(&self, c: &mut C, speed: C::N, sign: C::N) -> (C::N, C::N) {
        let [viscous, coulomb] = [self.viscous, self.coulomb].map(|both| side(c, sign, both));
        (speed * viscous, sign * coulomb)
    }

    /// Minimum time of the rigid axis from rest to rest over a distance (m, of either sign) within these volts and
    /// amperes: full force, then full braking, s. Without breakaway and inductance, so that no axis is faster. Relative
    /// accuracy 1e-6; none if nothing is limited, or if it does not move.
    ///
    /// ```
    /// use taut::{case::Case, machine::rigid::Rigid};
    /// # let text = taut::case::TEMPLATE;
    /// let rigid = Rigid::new(&Case::from_text("axis.toml", text)?.machine);
    /// let [short, long] = [0.01, 0.04].map(|distance| rigid.quickest(distance, (Some(24.0), None)).unwrap());
    /// assert!(short < long && long < 4.0 * short);
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn quickest(&self, distance: f64, (volts, amperes): (Option<f64>, Option<f64>)) -> Option<f64> {
        if volts.is_none() && amperes.is_none() {
            return None;
        }
        let sign = distance.signum();
        let most = |speed: f64| {
            let by_volts = volts.map_or(f64::INFINITY, |volts| (volts - speed * self.brake) / self.resistance);
            by_volts.min(amperes.unwrap_or(f64::INFINITY))
        };
        let against = |speed: f64| {
            let (viscous, dry) = self.friction(sign * speed, sign);
            sign * (viscous + dry - self.constant)
        };
        // m v′ = n K_t i η/r − b v − F_c + F, and braking the other way round, through the gear the easier
        // with e n² J_r of the rotor, e = η or 1/η
        let [driving, driven] = [self.efficiency, 1.0 / self.efficiency];
        let mass = |e: f64| self.mass + (e - 1.0) * self.rotor;
        let gains = |speed: f64| (self.force_per_ampere * driving * most(speed) - against(speed)) / mass(driving);
        let loses = |speed: f64| (self.force_per_ampere * driven * most(-speed) + against(speed)) / mass(driven);
        if !(gains(0.0) > 0.0 && loses(0.0) > 0.0) {
            return None;
        }
        // No faster than without resistance, and no faster than the speed at which the force ends.
        let unhindered = (2.0 * distance.abs() * gains(0.0).max(loses(0.0))).sqrt();
        let mut top = unhindered;
        if gains(top) <= 0.0 {
            let mut ends = [0.0, top];
            for _ in 0..100 {
                let middle = 0.5 * (ends[0] + ends[1]);
                ends[usize::from(gains(middle) <= 0.0)] = middle;
            }
            top = ends[0];
        }
        // v = v_top (1 − e^{−u}), so that the approach to the top speed is resolved.
        let up_to = |most: f64| {
            let (mut way, mut time) = (0.0, 0.0);
            let panels = 400;
            let h = most / f64::from(panels);
            for k in 0..=2 * panels {
                let weight = if k == 0 || k == 2 * panels {
                    1.0
                } else if k % 2 == 1 {
                    4.0
                } else {
                    2.0
                } * h
                    / 6.0;
                let left = (-0.5 * h * f64::from(k)).exp();
                let speed = top * (1.0 - left);
                let per_speed = top * left * (1.0 / gains(speed) + 1.0 / loses(speed));
                time += weight * per_speed;
                way += weight * per_speed * speed;
            }
            (way, time)
        };
        let mut ends = [0.0, 25.0];
        for _ in 0..60 {
            let middle = 0.5 * (ends[0] + ends[1]);
            ends[usize::from(up_to(middle).0 > distance.abs())] = middle;
        }
        let (way, time) = up_to(ends[0]);
        // The remaining distance is covered at the top speed.
        Some(time + (distance.abs() - way).max(0.0) / top)
    }
}

/// Selects the number for a direction, forward or backward; zero counts as forward.
pub fn side<C: Calculator>(c: &mut C, sign: C::N, [forward, backward]: [f64; 2]) -> C::N {
    let [forward, backward] = [forward, backward].map(|value| c.number(value));
    c.choose(less(sign, 0.0), backward, forward)
}
