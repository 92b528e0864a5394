//! Equations of motion of each mode, and its guards.

use super::{BODIES, CURRENTS, Cause, Contact, Drive, Form, Guard, Mechanism, Mode, SPRINGS, SpringLaw, State};
use crate::friction::{Motion, Side};

/// The equations in one mode: accelerations, rates of currents, and guards.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Equations {
    /// q̈ of each body.
    pub acceleration: [Form; BODIES],
    /// di/dt of each current; zero if it is not a state.
    pub current_rate: [Form; CURRENTS],
    /// Inertia of each body, with its rotor behind a stiff gear.
    pub inertia: [f64; BODIES],
    /// Stiffness of each spring that stores energy in this mode.
    pub stiffness: [f64; SPRINGS],
    /// Conditions under which these equations hold.
    pub guards: Vec<Guard>,
    /// Load, the sum of all forces except friction, on each independent body and those that move with it, N or N m.
    pub load: [Form; BODIES],
}

impl Mechanism {
    /// Initial mode for `state`: bodies move according to their speeds, and all other parts are in their ordinary case.
    pub fn first_mode(&self, state: &State) -> Mode {
        let motion = (0..self.bodies.len()).map(|body| match state.speed[self.leader(body)] {
            _ if !self.has_modes(body) => Motion::Free,
            v if v > 0.0 => Motion::Forward,
            v if v < 0.0 => Motion::Backward,
            _ => Motion::Stuck,
        });
        Mode { piece: self.pieces(state), ..Mode::new(motion) }
    }

    /// Adapts a mode to a machine with the same parts but other parameters: a body that gains or loses dry friction
    /// moves according to its speed; a removed part returns to its ordinary case.
    pub(crate) fn take_over(&self, from: &Mechanism, mode: &mut Mode, speed: impl Fn(usize) -> f64) {
        let mut state = State::default();
        for (body, own) in state.speed.iter_mut().enumerate().take(self.bodies.len()) {
            *own = speed(body);
        }
        let fresh = self.first_mode(&state);
        for body in (0..self.bodies.len()).filter(|body| self.has_modes(*body) != from.has_modes(*body)) {
            mode.motion[body] = fresh.motion[body];
        }
    }

    /// Torque factor of a gear: η if the motor drives, 1/η if it is driven.
    ///
    /// The driving side loses the fraction 1 − η of its power, so the gear never adds any.
    pub(super) fn gear_factor(&self, drive: usize, forward: bool, torque_positive: bool) -> f64 {
        let eta = self.drives[drive].motor.gear_efficiency;
        if forward == torque_positive { eta } else { 1.0 / eta }
    }

    /// The spring that represents a drive's compliant gear.
    pub(crate) fn gear_spring(&self, drive: usize) -> Option<usize> {
        let drive = &self.drives[drive];
        let is_gear = |arms: &[(usize, f64)]| arms.iter().any(|&(body, _)| body == drive.shaft);
        drive.has_rotor().then(|| self.springs.iter().position(|spring| is_gear(&spring.arms))).flatten()
    }

    /// True if the torque through a compliant gear is positive.
    pub(super) fn is_gear_torque_positive(&self, drive: usize, spring: usize, mode: &Mode) -> bool {
        match (&self.springs[spring].law, mode.contact[spring]) {
            (SpringLaw::Gap { .. }, Contact::Low | Contact::LowLoose) => false,
            (SpringLaw::Gap { .. }, _) => true,
            _ => mode.drive[drive].torque_positive,
        }
    }

    /// All forces (N) or torques (N m) on a body, and on those that move with it, except friction, for a body that
    /// moves, or is about to move, forward or backward: the inner brackets of eq. (16)-(18).
    pub fn load(&self, body: usize, forward: bool, mode: &Mode) -> Form {
        self.load_by(&self.forces(mode), body, forward, mode)
    }

    /// Forces of all springs.
    fn forces(&self, mode: &Mode) -> [Form; SPRINGS] {
        let mut forces = [Form::ZERO; SPRINGS];
        for (spring, force) in forces.iter_mut().enumerate().take(self.springs.len()) {
            *force = self.spring_force(spring, mode);
        }
        forces
    }

    /// [`Mechanism::load`] from given forces of the springs.
    fn load_by(&self, forces: &[Form; SPRINGS], body: usize, forward: bool, mode: &Mode) -> Form {
        let mut load = Form::ZERO;
        for follower in self.followers(body) {
            let own = self.own_load(forces, follower, forward, mode);
            load = if self.ratio(follower) == 1.0 { load + own } else { load + own * self.ratio(follower) };
        }
        load
    }

    fn own_load(&self, forces: &[Form; SPRINGS], body: usize, forward: bool, mode: &Mode) -> Form {
        let mut load = Form::ZERO;
        let linear = |drive: &Drive| drive.motor.stepper.is_none();
        for (index, drive) in self.drives.iter().enumerate().filter(|(_, drive)| drive.shaft == body && linear(drive)) {
            // τ_M = e n K_t i                                                   (4) with a gear
            let e = match drive.has_rotor() {
                true => 1.0,
                false => self.gear_factor(index, forward, mode.drive[index].torque_positive),
            };
            load = load + self.current(index, mode) * (drive.motor.torque_constant * drive.motor.gear_ratio * e);
        }
        // −Aᵀ f: for the axis −r f₁ + r f₃ (16), f₁ − f₂ (17), r f₂ − r f₃ (18), f being k₁ (r φ₁ − x) + c₁ (r φ̇₁ − ẋ)
        // and so on
        for (spring, part) in self.springs.iter().enumerate().rev() {
            for &(_, arm) in part.arms.iter().filter(|(other, _)| *other == body) {
                let arm = arm * self.gear_share(body, spring, forward, mode);
                load.subtract(arm, &forces[spring]);
            }
        }
        load.constant += self.bodies[body].force;
        load
    }

    /// Magnitude of the constant forces on each independent body and those that move with it before summation, N or N
    /// m: it determines the rounding error even if they cancel.
    pub(crate) fn sizes_of_forces(&self, mode: &Mode) -> [f64; BODIES] {
        let mut sizes = [0.0; BODIES];
        for body in 0..self.bodies.len() {
            let (leader, ratio) = (self.leader(body), self.ratio(body).abs());
            sizes[leader] += ratio * self.bodies[body].force.abs();
        }
        for (leader, size) in sizes.iter_mut().enumerate().take(self.bodies.len()) {
            let law = self.friction(leader);
            *size += law.forward.coulomb.max(law.backward.coulomb);
        }
        for (index, drive) in self.drives.iter().enumerate() {
            let (leader, ratio) = (self.leader(drive.shaft), self.ratio(drive.shaft).abs());
            let torque = drive.motor.torque_constant * drive.motor.gear_ratio / drive.motor.gear_efficiency;
            sizes[leader] += ratio * (torque * self.current(index, mode).constant).abs();
        }
        for (index, spring) in self.springs.iter().enumerate() {
            let size = self.size_of_constant(index, mode);
            for &(body, arm) in &spring.arms {
                sizes[self.leader(body)] += (self.ratio(body) * arm).abs() * size;
            }
        }
        sizes
    }

    /// Magnitude of the terms whose difference is the constant part of a spring's force.
    fn size_of_constant(&self, spring: usize, mode: &Mode) -> f64 {
        match &self.springs[spring].law {
            SpringLaw::Line { line, .. } => line.size_of_constant(usize::from(mode.piece[spring])),
            _ => self.spring_force(spring, mode).constant.abs(),
        }
    }

    /// Factor on the torque of a spring on a body: 1, but 1/e for a rotor behind a lossy compliant gear.
    fn gear_share(&self, body: usize, spring: usize, forward: bool, mode: &Mode) -> f64 {
        let is_behind = |drive: &usize| {
            let part = &self.drives[*drive];
            part.loses() && part.has_rotor() && part.shaft == body && self.gear_spring(*drive) == Some(spring)
        };
        match (0..self.drives.len()).find(is_behind) {
            None => 1.0,
            Some(drive) => 1.0 / self.gear_factor(drive, forward, self.is_gear_torque_positive(drive, spring, mode)),
        }
    }

    /// Torque whose sign determines the driving side of a lossy gear: T = K_t i − J_r n φ̈₁ for a stiff gear, or the
    /// torque of a compliant one; none if the flanks determine it.
    fn gear_torque(&self, drive: usize, mode: &Mode, acceleration: &[Form; BODIES]) -> Option<Form> {
        let part = &self.drives[drive];
        if !part.loses() {
            return None;
        }
        match self.gear_spring(drive) {
            None => {
                let own = acceleration[part.pulley] * (part.motor.rotor_inertia * part.motor.gear_ratio);
                Some(self.current(drive, mode) * part.motor.torque_constant - own)
            }
            Some(spring) => match &self.springs[spring].law {
                SpringLaw::TwoSided => Some(self.spring_force(spring, mode)),
                _ => None,
            },
        }
    }

    /// Torque of each gear with the bodies at rest, which determines its sign before a body moves.
    pub fn torque_at_rest(&self, drive: usize, mode: &Mode) -> Form {
        match self.gear_spring(drive) {
            None => self.current(drive, mode),
            Some(spring) => self.spring_force(spring, mode),
        }
    }

    /// Inertia of each body in `mode`, with its rotor: J₁ + e n² J_r, since the rotor turns n times as fast.
    fn inertia(&self, mode: &Mode) -> [f64; BODIES] {
        let mut inertia = [0.0; BODIES];
        for (inertia, body) in inertia.iter_mut().zip(&self.bodies) {
            *inertia = body.inertia;
        }
        for (index, drive) in self.drives.iter().enumerate().filter(|(_, drive)| !drive.has_rotor()) {
            let forward = mode.motion[drive.pulley] != Motion::Backward;
            let rotor = drive.motor.gear_ratio * drive.motor.gear_ratio * drive.motor.rotor_inertia;
            inertia[drive.pulley] += self.gear_factor(index, forward, mode.drive[index].torque_positive) * rotor;
        }
        inertia
    }

    /// Inertias with which springs conserve momentum between bodies. A lossy compliant gear puts 1/e of its torque on
    /// the rotor, J_r φ̈_r = τ − T/e, which is e J_r φ̈_r = e τ − T.
    pub(crate) fn balanced_inertia(&self, equations: &Equations, mode: &Mode) -> [f64; BODIES] {
        let mut inertia = equations.inertia;
        for (index, drive) in self.drives.iter().enumerate().filter(|(_, drive)| drive.loses()) {
            // Flanks that are apart, and rotors at rest, transmit nothing.
            let passes =
                |spring: &usize| equations.stiffness[*spring] > 0.0 && mode.motion[drive.shaft] != Motion::Stuck;
            if let Some(spring) = self.gear_spring(index).filter(passes) {
                let forward = mode.motion[drive.shaft] != Motion::Backward;
                inertia[drive.shaft] /= self.gear_share(drive.shaft, spring, forward, mode);
            }
        }
        inertia
    }

    /// Inertia that moves with a body, itself included, referred to its own coordinate.
    pub fn mass(&self, leader: usize, inertia: &[f64; BODIES]) -> f64 {
        self.followers(leader).map(|b| self.ratio(b) * self.ratio(b) * inertia[b]).sum()
    }

    /// The equations that hold in `mode`, and the conditions under which they do.
    pub fn equations(&self, mode: Mode) -> Equations {
        let mut acceleration = [Form::ZERO; BODIES];
        let inertia = self.inertia(&mode);
        let mut guards = Vec::with_capacity(8);
        let guard = |form: Form, cause: Cause| Guard { form, transition: self.transition(cause, &mode) };
        // Without gear losses, the load on a body at rest does not depend on its direction of motion.
        let loses = self.drives.iter().any(Drive::loses);
        let (forces, mut loads) = (self.forces(&mode), [Form::ZERO; BODIES]);
        for body in self.leaders() {
            let motion = mode.motion[body];
            let law = self.friction(body);
            let load = self.load_by(&forces, body, motion != Motion::Backward, &mode);
            loads[body] = load;
            let mass = self.mass(body, &inertia);
            // J φ̈ = load − F_f, with F_f = b v ± F_c                             (15)-(18)
            let sliding = |side: Side, sign: f64| {
                let mut net = load;
                net.speed[body] -= side.viscous;
                net.constant -= sign * side.coulomb;
                net * (1.0 / mass)
            };
            let own = match motion {
                Motion::Free => sliding(law.forward, 0.0),
                Motion::Forward => {
                    guards.push(guard(Form::speed(body), Cause::Stop(body)));
                    sliding(law.forward, 1.0)
                }
                Motion::Backward => {
                    guards.push(guard(-Form::speed(body), Cause::Stop(body)));
                    sliding(law.backward, -1.0)
                }
                Motion::Stuck => {
                    let (mut ahead, mut back) =
                        (-load, if loses { self.load_by(&forces, body, false, &mode) } else { load });
                    ahead.constant += law.forward.breakaway;
                    back.constant += law.backward.breakaway;
                    guards.push(guard(ahead, Cause::BreakForward(body)));
                    guards.push(guard(back, Cause::BreakBackward(body)));
                    Form::ZERO
                }
            };
            for follower in self.followers(body) {
                let ratio = self.ratio(follower);
                acceleration[follower] = if ratio == 1.0 { own } else { own * ratio };
            }
        }
        for drive in (0..self.drives.len()).rev() {
            if let Some(torque) = self.gear_torque(drive, &mode, &acceleration) {
                let sign = if mode.drive[drive].torque_positive { 1.0 } else { -1.0 };
                // First, because the loads in the other guards depend on it.
                guards.insert(0, guard(torque * sign, Cause::GearTorque(drive)));
            }
        }
        self.watch_elements(&mode, &mut guards);
        let mut current_rate = [Form::ZERO; CURRENTS];
        for (number, rate) in current_rate.iter_mut().enumerate() {
            *rate = self.current_rate(number, &mode);
        }
        Equations { acceleration, current_rate, inertia, stiffness: self.stiffness_in(&mode), guards, load: loads }
    }

    /// Friction force (N) or torque (N m) on a body: by its law while it slides, the holding force while it is stuck.
    ///
    /// `load` is the least and the largest sum of all other forces on the body; these differ only if a lossy gear holds
    /// a part.
    pub(crate) fn friction_value(&self, body: usize, motion: Motion, speed: f64, load: (f64, f64)) -> f64 {
        let law = self.friction(body);
        match motion {
            // F_f = b v ± F_c                                                   (15)
            Motion::Free => law.forward.viscous * speed,
            Motion::Forward => law.forward.viscous * speed + law.forward.coulomb,
            Motion::Backward => law.backward.viscous * speed - law.backward.coulomb,
            // The gear holds what it can, friction the rest; for a follower, the leader holds all of it.
            Motion::Stuck if self.leader(body) != body => 0.0,
            Motion::Stuck => load.0.max(0.0) + load.1.min(0.0),
        }
    }

    /// Least and largest torque of motor and gear on a stuck drive pulley at this current, N m.
    pub fn holding_torque(&self, drive: usize, current: f64) -> (f64, f64) {
        let motor = &self.drives[drive].motor;
        let torque = motor.gear_ratio * motor.torque_constant * current;
        // n η K_t i if it drives, n K_t i / η if it is driven back
        let (passed, held) = (torque * motor.gear_efficiency, torque / motor.gear_efficiency);
        (passed.min(held), passed.max(held))
    }
}
