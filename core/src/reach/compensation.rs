//! Feed-forward from the reference alone, for a rigid axis and for one with an elastic belt.

use crate::calculator::{Calculator, Evaluation, Number, less, more};
use crate::design::{FeedForward, FeedForwardModel};
use crate::machine::rigid::{REST_ACCELERATION, REST_SPEED, Rigid, side};
use crate::machine::{BeltModel, EncoderPlace, GearPlay, Machine};
use crate::signal::profile::Reference;

/// Direction in which the axis moves, or is about to move: 1, −1 or 0.
pub fn direction(reference: &Reference) -> f64 {
    direction_by(&mut Evaluation::plain(), reference)
}

/// As the function without `_by`, for any calculator.
pub(crate) fn direction_by<C: Calculator>(c: &mut C, reference: &Reference<C::N>) -> C::N {
    let [forward, backward, none] = [1.0, -1.0, 0.0].map(|sign| c.number(sign));
    let mut sign = |of: C::N, rest: f64, or: C::N| {
        let or = c.choose(less(of, -rest), backward, or);
        c.choose(more(of, rest), forward, or)
    };
    let leaving = sign(reference.acceleration, REST_ACCELERATION, none);
    let way = sign(reference.speed, REST_SPEED, leaving);
    c.name("way", way)
}

/// The twist of a compliant gear, rad: T/k_g, and half the play.
pub(super) fn twist<N: Number>(gear: &GearPlay, torque: N, way: N) -> N {
    torque / gear.stiffness + way * (0.5 * gear.backlash)
}

/// The reference of a part that is ahead of another one's by this, m, with its first and second rate.
fn ahead<C: Calculator>(c: &mut C, y: &Reference<C::N>, by: [C::N; 3]) -> Reference<C::N> {
    Reference {
        position: c.name("drive_position", y.position + by[0]),
        speed: c.name("drive_speed", y.speed + by[1]),
        acceleration: c.name("drive_acceleration", y.acceleration + by[2]),
        ..*y
    }
}

/// Feed-forward, and the reference for the encoder's position.
#[derive(Debug, Clone)]
pub struct Compensation {
    settings: FeedForward,
    machine: Machine,
    /// The axis as one mass.
    pub rigid: Rigid,
    /// True if the encoder is at motor or drive pulley.
    before_belt: bool,
    /// True if it is before the gear.
    before_gear: bool,
}

/// Motion of the pulleys for which the cart follows its reference, y₁ = r φ₁ and y₃ = r φ₃, and the required motor
/// force at the belt.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Needed<N = f64> {
    /// Drive pulley.
    pub drive: Reference<N>,
    /// Idler pulley, position and speed.
    pub idler: [N; 2],
    /// N; and its rate, N/s.
    pub force: [N; 2],
    /// Forces in the three spans relative to the pretension, N; zero for a rigid belt, of which none is known.
    pub spans: [N; 3],
}

impl Compensation {
    /// From a model of the axis.
    pub fn new(machine: &Machine, settings: &FeedForward) -> Self {
        let at = machine.encoder.map_or(EncoderPlace::Motor, |encoder| encoder.at);
        Self {
            settings: *settings,
            machine: machine.clone(),
            rigid: Rigid::new(machine),
            before_belt: at != EncoderPlace::Cart,
            before_gear: at == EncoderPlace::Motor,
        }
    }

    /// Motion of the pulleys for which the cart follows `y`: quasi-static for the idler's own mode, exact otherwise.
    pub fn needed(&self, y: &Reference) -> Needed {
        self.needed_by(&mut Evaluation::plain(), y)
    }

    /// As the function without `_by`, for any calculator.
    pub fn needed_by<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>) -> Needed<C::N> {
        let machine = &self.machine;
        let (r, sign) = (machine.pulley_radius, direction_by(c, y));
        let &Reference { position, speed, acceleration, jerk, snap } = y;
        let [k1, k2] = match (machine.belt.make, machine.belt.follows_cart) {
            (Some(make), true) => {
                // k₁ = A E/(l₁ − x), k₂ = A E/(l₂ + x)
                let (rigidity, [l1, l2, _]) = (make.rigidity(), make.spans.three());
                let [rigidity, l1, l2] = [rigidity, l1, l2].map(|value| c.number(value));
                [c.name("k1", rigidity / (l1 - position)), c.name("k2", rigidity / (l2 + position))]
            }
            _ => [machine.belt.stiffness[0], machine.belt.stiffness[1]].map(|k| c.number(k)),
        };
        let k3 = c.number(machine.belt.stiffness[2]);
        let mut both = |of: [f64; 2]| side(c, sign, of);
        let cart = [machine.cart.friction.forward, machine.cart.friction.backward];
        let (cart_b, cart_c) = (both(cart.map(|side| side.viscous)), both(cart.map(|side| side.coulomb)));
        let idler = [machine.idler_pulley.friction.forward, machine.idler_pulley.friction.backward];
        let (idler_b, idler_c) = (both(idler.map(|side| side.viscous)), both(idler.map(|side| side.coulomb)));
        let drive = [machine.drive_pulley.friction.forward, machine.drive_pulley.friction.backward];
        let (drive_b, drive_c) = (both(drive.map(|side| side.viscous / (r * r))), both(drive.map(|side| side.coulomb)));
        // L = f₁ − f₂ = M y″ + b y′ + F_c sgn y′ − F − F_x(y)                    (17); the rate without F_x′ y′
        let mass = machine.cart.mass;
        let resisting = acceleration * mass + cart_b * speed + cart_c * sign - machine.cart.constant_force();
        let load = [
            self.force_along(c, position).map_or(resisting, |along| resisting - along),
            jerk * mass + cart_b * acceleration,
            snap * mass + cart_b * jerk,
        ]
        .map(|load| c.name("load", load));
        let in_series = c.name("k_in_series", k2 * k3 / (k2 + k3));
        let k = c.name("k", k1 + in_series);
        // P = f₂ − f₃ = (J₂ y₃″ + B₂ y₃′)/r² + τ_c2 sgn y′/r, and its rates          (18)
        let inertia = machine.idler_pulley.inertia;
        let pull_of = |c: &mut C, y3: &Reference<C::N>| {
            [
                (y3.acceleration * inertia / r + idler_b * y3.speed / r + idler_c * sign) / r,
                (y3.jerk * inertia / r + idler_b * y3.acceleration / r) / r,
                (y3.snap * inertia / r + idler_b * y3.jerk / r) / r,
            ]
            .map(|pull| c.name("pull", pull))
        };
        let (drive, pull, spans, behind) = match machine.belt.model {
            BeltModel::Elastic => {
                // Quasi-static idler: y₃″ = y″ in P.
                // With y₃ − y = (k₃ (y₁ − y) − P)/(k₂ + k₃):  y₁ − y = (L + P k₂/(k₂ + k₃))/k
                let pull = pull_of(c, y);
                let share = c.name("share_of_k2", k2 / (k2 + k3));
                let stretch = std::array::from_fn(|j| c.name("stretch", (load[j] + share * pull[j]) / k));
                let behind: [C::N; 2] =
                    std::array::from_fn(|j| c.name("behind", (k3 * stretch[j] - pull[j]) / (k2 + k3)));
                // f₁ = k₁ (y₁ − y),  f₂ = k₂ (y − y₃),  f₃ = k₃ (y₃ − y₁)
                let spans = [k1 * stretch[0], -k2 * behind[0], k3 * (behind[0] - stretch[0])];
                (ahead(c, y, stretch), pull, spans, behind)
            }
            BeltModel::TwoMass => {
                // Without belt damping, the position of the cart is a flat output: with y₃ = y₁ and d = y₁ − y,
                // k d = L,  k d′ = L′ − k′ d,  k d″ = L″ − 2 k′ d′ − k″ d,  k = k₁ + k₂ k₃/(k₂ + k₃)
                let rates = self.stiffness_rates(c, y, [k1, in_series]);
                let d = c.name("stretch", load[0] / k);
                let change = rates.map_or(load[1], |[first, _]| load[1] - first * d);
                let d_rate = c.name("stretch", change / k);
                let change = rates.map_or(load[2], |[first, second]| load[2] - first * d_rate * 2.0 - second * d);
                let d_second = c.name("stretch", change / k);
                // k d‴ = L‴ = b y⁗ between jumps of y⁗, which only a jump of the current could follow.
                let drive = Reference {
                    jerk: c.name("drive_jerk", jerk + cart_b * snap / k),
                    ..ahead(c, y, [d, d_rate, d_second])
                };
                // In series f₂ = f₃ = −d k₂ k₃/(k₂ + k₃); and P follows from y₁.
                let slack_side = c.name("slack_side", -(in_series * d));
                (drive, pull_of(c, &drive), [k1 * d, slack_side, slack_side], [d, d_rate])
            }
            BeltModel::Rigid => (*y, pull_of(c, y), [c.number(0.0); 3], [c.number(0.0); 2]),
        };
        // τ/r = ((J₁ + n² J_r) y₁″ + B₁ y₁′)/r² + τ_c1 sgn y′/r + L + P           (16)
        let n = machine.drives[0].motor.gear_ratio;
        let own = (machine.drive_pulley.inertia + n * n * machine.drives[0].motor.rotor_inertia) / (r * r);
        let force = drive.acceleration * own + drive_b * drive.speed + drive_c * sign / r + load[0] + pull[0];
        let rate = drive.jerk * own + drive_b * drive.acceleration + load[1] + pull[1];
        let force = [c.name("push", force), c.name("push_rate", rate)];
        Needed { drive, idler: [position + behind[0], speed + behind[1]], force, spans }
    }

    /// First and second rate of k = k₁ + k₂₃ along the reference, N/(m s) and N/(m s²); none if it is constant.
    fn stiffness_rates<C: Calculator>(
        &self,
        c: &mut C,
        y: &Reference<C::N>,
        [k1, in_series]: [C::N; 2],
    ) -> Option<[C::N; 2]> {
        let rigidity = self.machine.belt.following()?.rigidity();
        // k₁ = A E/(l₁ − y), k₂₃ = A E/(l₂ + l₃ + y):  dk/dy = (k₁² − k₂₃²)/(A E),  d²k/dy² = 2 (k₁³ + k₂₃³)/(A E)²
        let [of_1, of_23] = [k1 * k1, in_series * in_series];
        let slope = c.name("k_slope", (of_1 - of_23) / rigidity);
        let curve = c.name("k_curve", (of_1 * k1 + of_23 * in_series) * (2.0 / (rigidity * rigidity)));
        // k′ = dk/dy y′,  k″ = d²k/dy² y′² + dk/dy y″
        let rate = c.name("k_rate", slope * y.speed);
        let second = c.name("k_second", curve * (y.speed * y.speed) + slope * y.acceleration);
        Some([rate, second])
    }

    /// Reference of the encoder for which the cart follows `y`.
    pub fn target<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>) -> Reference<C::N> {
        if !(self.settings.compensate_stretch && self.before_belt) {
            return *y;
        }
        let needed = self.needed_by(c, y);
        let mut target = needed.drive;
        if let Some(play) = self.machine.drives[0].motor.gear_play.filter(|_| self.before_gear) {
            let (r, sign) = (self.machine.pulley_radius, direction_by(c, y));
            let torque = needed.force[0] * r - self.rotor(needed.drive.acceleration);
            target.position = c.name("target", target.position + twist(&play, torque, sign) * r);
        }
        target
    }

    /// Torque that the rotor itself takes at the pulley, N m.
    fn rotor<N: Number>(&self, acceleration: N) -> N {
        let n = self.machine.drives[0].motor.gear_ratio;
        acceleration * (n * n * self.machine.drives[0].motor.rotor_inertia) / self.machine.pulley_radius
    }

    /// Feed-forward command, V or A; none without feed-forward.
    pub fn command<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>) -> Option<C::N> {
        let (rigid, settings) = (&self.rigid, &self.settings);
        match settings.model {
            FeedForwardModel::None => None,
            // F = M y″ + b y′ + F_c sgn y′ − F₀ − F_x(y)
            FeedForwardModel::Rigid => {
                let (viscous, dry) = self.friction(c, y);
                let mass = settings.inertia * rigid.mass;
                let force = y.acceleration * mass + (viscous + dry) * settings.friction - rigid.constant;
                let force = self.force_along(c, y.position).map_or(force, |along| force - along);
                let command = rigid.command_by(c, force, y.jerk * mass, &self.accelerated(y));
                Some(c.name("forward", command))
            }
            FeedForwardModel::Elastic => {
                let needed = self.needed_by(c, y);
                let [force, rate] = needed.force;
                let (viscous, dry) = self.friction(c, y);
                let less = (viscous + dry) * (1.0 - settings.friction)
                    + needed.drive.acceleration * ((1.0 - settings.inertia) * rigid.mass);
                let command = rigid.command_by(c, force - less, rate, &self.accelerated(&needed.drive));
                Some(c.name("forward", command))
            }
        }
    }

    /// A motion whose inertial forces have the share that is fed forward.
    fn accelerated<N: Number>(&self, y: &Reference<N>) -> Reference<N> {
        let share = self.settings.inertia;
        if share == 1.0 {
            return *y;
        }
        Reference { acceleration: y.acceleration * share, jerk: y.jerk * share, ..*y }
    }

    /// Viscous and dry friction of the axis along the reference, N.
    fn friction<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>) -> (C::N, C::N) {
        let sign = direction_by(c, y);
        self.rigid.friction_by(c, y.speed, sign)
    }

    /// Force on the cart that depends on its position, N; none if the machine has no such force.
    fn force_along<C: Calculator>(&self, c: &mut C, position: C::N) -> Option<C::N> {
        let line = self.machine.cart.forces.along.as_ref()?;
        let along = line.value_by(c, position);
        Some(c.name("along", along))
    }

    /// Dry friction and force along the travel as a command, V or A: the parts that a linear model lacks.
    pub fn dry<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>) -> C::N {
        let (_, dry) = self.friction(c, y);
        let mut held = dry - self.rigid.constant;
        if self.settings.model != FeedForwardModel::None
            && let Some(along) = self.force_along(c, y.position)
        {
            held = held - along;
        }
        c.name("dry", held / self.rigid.force_per_command())
    }
}
