//! Feed-forward from the reference alone: the command for an axis of one mass, and for one whose belt stretches.

use crate::design::{FeedForward, FeedForwardModel};
use crate::machine::rigid::{REST_ACCELERATION, REST_SPEED, Rigid};
use crate::machine::{BeltModel, EncoderPlace, Machine};
use crate::signal::profile::Reference;

/// Direction in which the axis moves, or is about to move: 1, −1 or 0.
pub fn direction(reference: &Reference) -> f64 {
    let sign = |value: f64, rest: f64| if value.abs() > rest { value.signum() } else { 0.0 };
    match sign(reference.speed, REST_SPEED) {
        0.0 => sign(reference.acceleration, REST_ACCELERATION),
        sign => sign,
    }
}

/// Feed-forward, and the reference for what the encoder sees.
#[derive(Debug, Clone)]
pub struct Compensation {
    settings: FeedForward,
    machine: Machine,
    /// The axis as one mass.
    pub rigid: Rigid,
    /// Whether the encoder sits before the belt.
    before_belt: bool,
    /// Whether it sits before the gear.
    before_gear: bool,
}

/// Pulleys that make the cart follow its reference: y₁ = r φ₁ and y₃ = r φ₃, and the force that the motor needs at the
/// belt.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Needed {
    /// Drive pulley.
    pub drive: Reference,
    /// Idler pulley, position and speed.
    pub idler: [f64; 2],
    /// N; and its rate, N/s.
    pub force: [f64; 2],
    /// Forces in the three spans of an elastic belt, counted from the pretension, N; zero for other belts.
    pub spans: [f64; 3],
}

impl Compensation {
    /// From a model of the axis.
    pub fn new(machine: &Machine, settings: &FeedForward) -> Self {
        let at = machine.encoder.map_or(EncoderPlace::Motor, |encoder| encoder.at);
        Self {
            settings: *settings,
            machine: machine.clone(),
            rigid: Rigid::of(machine),
            before_belt: at != EncoderPlace::Cart,
            before_gear: at == EncoderPlace::Motor,
        }
    }

    /// The motion of the pulleys with which the cart follows `y`: quasi-static in the idler's own swing, exact
    /// otherwise.
    pub fn needed(&self, y: &Reference) -> Needed {
        let machine = &self.machine;
        let (r, sign) = (machine.pulley_radius, direction(y));
        let forward = sign >= 0.0;
        let &Reference { position, speed, acceleration, jerk, snap } = y;
        let [k1, k2] = match (machine.belt.make, machine.belt.follows_cart) {
            (Some(make), true) => make.stiffness_at(position),
            _ => [machine.belt.stiffness[0], machine.belt.stiffness[1]],
        };
        let k3 = machine.belt.stiffness[2];
        // L = f₁ − f₂ = M y″ + b y′ + F_c sgn y′ − F                             (17)
        let (mass, cart) = (machine.cart.mass, machine.cart.friction.side(forward));
        let load = [
            mass * acceleration + cart.viscous * speed + cart.coulomb * sign - machine.cart.constant_force(),
            mass * jerk + cart.viscous * acceleration,
            mass * snap + cart.viscous * jerk,
        ];
        // P = f₂ − f₃ = (J₂ y″/r + B₂ y′/r + τ_c2 sgn y′)/r                      (18)
        let (inertia, idler) = (machine.idler_pulley.inertia, machine.idler_pulley.friction.side(forward));
        let pull = [
            (inertia * acceleration / r + idler.viscous * speed / r + idler.coulomb * sign) / r,
            (inertia * jerk / r + idler.viscous * acceleration / r) / r,
            (inertia * snap / r + idler.viscous * jerk / r) / r,
        ];
        // With y₃ − y = (k₃ (y₁ − y) − P)/(k₂ + k₃):  y₁ − y = (L + k₂ P/(k₂ + k₃))/k,  k = k₁ + k₂ k₃/(k₂ + k₃)
        let (share, k) = (k2 / (k2 + k3), k1 + k2 * k3 / (k2 + k3));
        let stretch: [f64; 3] = std::array::from_fn(|j| match machine.belt.model {
            BeltModel::Elastic => (load[j] + share * pull[j]) / k,
            BeltModel::TwoMass => load[j] / k,
            BeltModel::Rigid => 0.0,
        });
        let behind: [f64; 2] = std::array::from_fn(|j| match machine.belt.model {
            BeltModel::Elastic => (k3 * stretch[j] - pull[j]) / (k2 + k3),
            _ => stretch[j],
        });
        let drive = Reference {
            position: position + stretch[0],
            speed: speed + stretch[1],
            acceleration: acceleration + stretch[2],
            ..*y
        };
        // τ/r = ((J₁ + n² J_r) y₁″ + B₁ y₁′)/r² + τ_c1 sgn y′/r + L + P           (16)
        let n = machine.drives[0].motor.gear_ratio;
        let own = (machine.drive_pulley.inertia + n * n * machine.drives[0].motor.rotor_inertia) / (r * r);
        let side = machine.drive_pulley.friction.side(forward);
        let viscous = side.viscous / (r * r);
        let force = own * drive.acceleration + viscous * drive.speed + side.coulomb * sign / r + load[0] + pull[0];
        let rate = own * jerk + viscous * drive.acceleration + load[1] + pull[1];
        // f₁ = k₁ (y₁ − y),  f₂ = k₂ (y − y₃),  f₃ = k₃ (y₃ − y₁)
        let spans = match machine.belt.model {
            BeltModel::Elastic => [k1 * stretch[0], -k2 * behind[0], k3 * (behind[0] - stretch[0])],
            BeltModel::TwoMass | BeltModel::Rigid => [0.0; 3],
        };
        Needed { drive, idler: [position + behind[0], speed + behind[1]], force: [force, rate], spans }
    }

    /// Where the encoder's side should be, so that the cart is where it should.
    pub fn target(&self, y: &Reference) -> Reference {
        if !(self.settings.compensate_stretch && self.before_belt) {
            return *y;
        }
        let needed = self.needed(y);
        let mut target = needed.drive;
        if let Some(play) = self.machine.drives[0].motor.gear_play.filter(|_| self.before_gear) {
            // The twist of the gear: T/k_g, and half the play.
            let (r, sign) = (self.machine.pulley_radius, direction(y));
            let torque = r * needed.force[0] - self.rotor(needed.drive.acceleration);
            target.position += r * (torque / play.stiffness + 0.5 * play.backlash * sign);
        }
        target
    }

    /// Torque that the rotor itself takes at the pulley, N m.
    fn rotor(&self, acceleration: f64) -> f64 {
        let n = self.machine.drives[0].motor.gear_ratio;
        n * n * self.machine.drives[0].motor.rotor_inertia * acceleration / self.machine.pulley_radius
    }

    /// The command that the reference asks for, V or A.
    pub fn command(&self, y: &Reference) -> f64 {
        let (rigid, settings) = (&self.rigid, &self.settings);
        let sign = direction(y);
        let (viscous, dry) = rigid.friction(y.speed, sign);
        match settings.model {
            FeedForwardModel::None => 0.0,
            // F = M y″ + b y′ + F_c sgn y′
            FeedForwardModel::Rigid => {
                let force = settings.inertia * rigid.mass * y.acceleration + settings.friction * (viscous + dry)
                    - rigid.constant;
                let rate = settings.inertia * rigid.mass * y.jerk;
                rigid.command(force, rate, y.speed)
            }
            FeedForwardModel::Elastic => {
                let needed = self.needed(y);
                let [force, rate] = needed.force;
                let less = (1.0 - settings.friction) * (viscous + dry)
                    + (1.0 - settings.inertia) * rigid.mass * needed.drive.acceleration;
                rigid.command(force - less, rate, needed.drive.speed)
            }
        }
    }

    /// The part of friction that does not grow with speed, as a command, V or A: what a linear model does not know.
    pub fn dry(&self, y: &Reference) -> f64 {
        let (_, dry) = self.rigid.friction(0.0, direction(y));
        (dry - self.rigid.constant) / self.rigid.force_per_command()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use std::path::Path;

    /// A generator that left a speed of 1.9e-16 m/s at the end of its move commanded the whole dry friction for ever.
    #[test]
    fn what_rounding_leaves_of_a_reference_at_rest_commands_no_friction() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/controllers");
        let case = Case::read(folder.join("pid-elastic.toml")).unwrap();
        let mut machine = case.machine.clone();
        (machine.drives[0].motor.gear_efficiency, machine.cart.load) = (0.8, 3.0);
        let mut number = 1_u64;
        let mut noise = |size: f64| {
            number = number.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            size * ((number >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
        };
        for model in [FeedForwardModel::Rigid, FeedForwardModel::Elastic] {
            let settings =
                FeedForward { model, compensate_stretch: true, ..case.controller.as_ref().unwrap().feed_forward };
            let compensation = Compensation::new(&machine, &settings);
            let still = Reference { position: 0.1, ..Reference::default() };
            let [command, dry] = [compensation.command(&still), compensation.dry(&still)];
            let target = compensation.target(&still).position;
            // The pulley is quicker than the cart by the rate of the stretch, some 1e-8 m/s here.
            for size in [1.9e-16, 1e-12, 1e-9, 0.9] {
                for _ in 0..100 {
                    let speed = noise(size * REST_SPEED);
                    let acceleration = noise(size * REST_ACCELERATION);
                    let y = Reference { speed, acceleration, ..still };
                    assert_eq!(direction(&y), 0.0);
                    assert_eq!(compensation.dry(&y), dry);
                    // The noise itself goes through inertia and viscous friction, a few grams and N s/m.
                    let most = size * 1e-2 * compensation.rigid.command(1.0, 0.0, 0.0);
                    assert!((compensation.command(&y) - command).abs() <= most + 1e-12, "{y:?}");
                    assert!((compensation.target(&y).position - target).abs() <= size * 1e-6 + 1e-15, "{y:?}");
                }
            }
            // Ten times as much is a direction.
            for sign in [1.0, -1.0] {
                let moving = Reference { speed: 10.0 * sign * REST_SPEED, acceleration: -sign, ..still };
                assert_eq!(direction(&moving), sign);
                let leaving = Reference { acceleration: 10.0 * sign * REST_ACCELERATION, ..still };
                assert_eq!(direction(&leaving), sign);
                assert!((compensation.dry(&leaving) - dry).abs() > 0.01);
            }
        }
    }
}
