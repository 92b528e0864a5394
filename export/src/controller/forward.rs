//! Feed-forward as a program: [`crate::control::compensation`], operation by operation.

use super::Target;
use crate::design::{Design, FeedForward, FeedForwardModel};
use crate::machine::rigid::{REST_ACCELERATION, REST_SPEED, Rigid};
use crate::machine::{AmplifierMode, BeltModel, EncoderPlace, Machine};
use crate::program::{Expr, Program, Relation, Test, number, variable};

/// Feed-forward of a model of the axis.
pub(super) struct Forward<'s> {
    machine: &'s Machine,
    settings: FeedForward,
    pub(super) rigid: Rigid,
    before_belt: bool,
    before_gear: bool,
}

/// Accelerations and forces that the reference needs of pulleys and motor.
pub(super) struct Needed {
    pub drive: Target,
    pub idler: [Expr; 2],
    pub force: [Expr; 2],
}

impl<'s> Forward<'s> {
    pub(super) fn new(machine: &'s Machine, design: &Design) -> Self {
        let at = machine.encoder.map_or(EncoderPlace::Motor, |encoder| encoder.at);
        Self {
            machine,
            settings: design.feed_forward,
            rigid: Rigid::of(machine),
            before_belt: at != EncoderPlace::Cart,
            before_gear: at == EncoderPlace::Motor,
        }
    }

    /// Direction in which the axis moves, or is about to move: 1, −1 or 0.
    fn direction(&self, p: &mut Program, name: &str, y: &Target) -> Expr {
        let name = format!("{name}_way");
        let way = p.declare(&name);
        let sign = |p: &mut Program, of: &Expr, rest: f64, or: &mut dyn FnMut(&mut Program)| {
            let (own, of) = (name.clone(), of.clone());
            p.when(
                Test(Relation::More, of.clone(), number(rest)),
                |p| p.set(&own, number(1.0)),
                |p| p.when(Test(Relation::Less, of, number(-rest)), |p| p.set(&own, number(-1.0)), |p| or(p)),
            );
        };
        sign(p, &y.speed, REST_SPEED, &mut |p| {
            sign(p, &y.acceleration, REST_ACCELERATION, &mut |p| p.set(&name, number(0.0)));
        });
        way
    }

    /// A number for each direction.
    fn side(&self, p: &mut Program, name: &str, way: &Expr, both: [f64; 2]) -> Expr {
        p.choose(name, Test(Relation::AtLeast, way.clone(), number(0.0)), number(both[0]), number(both[1]))
    }

    /// Friction of the axis as one mass: its viscous part and its dry part.
    fn friction(&self, p: &mut Program, name: &str, speed: Expr, way: &Expr) -> (Expr, Expr) {
        // Its backward side is that of a negative direction, zero counts as forward.
        let viscous = self.side(p, &format!("{name}_viscous"), way, self.rigid.viscous);
        let coulomb = self.side(p, &format!("{name}_coulomb"), way, self.rigid.coulomb);
        (viscous * speed, coulomb * way.clone())
    }

    /// The command that makes the motor push with `force`, changing at `rate`, at `speed`.
    pub(super) fn command_of(&self, p: &mut Program, name: &str, force: Expr, rate: Expr, speed: Expr) -> Expr {
        let motor = &self.machine.drives[0].motor;
        let force = p.local(&format!("{name}_force"), force);
        let both = [motor.gear_efficiency, 1.0 / motor.gear_efficiency].map(|e| self.rigid.force_per_ampere * e);
        let per_ampere = self.per_ampere(p, name, &force, &speed, both);
        let current = p.local(&format!("{name}_current"), force / per_ampere.clone());
        let gain = self.machine.drives[0].amplifier.gain;
        match self.machine.drives[0].amplifier.mode {
            AmplifierMode::Current => current / gain,
            // v = R i + L di/dt + K_e n φ̇
            AmplifierMode::Voltage => {
                let resistive = motor.resistance * current;
                let sum = match motor.inductance {
                    0.0 => resistive,
                    inductance => resistive + inductance * rate / per_ampere,
                };
                (sum + self.rigid.brake * speed) / gain
            }
        }
    }

    /// Force per ampere of a gear that drives, or, where the force acts against a motion, is driven; at rest it drives.
    fn per_ampere(&self, p: &mut Program, name: &str, force: &Expr, speed: &Expr, [drives, driven]: [f64; 2]) -> Expr {
        if drives.to_bits() == driven.to_bits() {
            return number(drives);
        }
        let name = format!("{name}_per_ampere");
        let set = |p: &mut Program, value: f64| p.set(&name, number(value));
        let moving = |p: &mut Program| {
            let with = Test(Relation::AtLeast, force.clone() * speed.clone(), number(0.0));
            p.when(with, |p| set(p, drives), |p| set(p, driven));
        };
        let per_ampere = p.declare(&name);
        let [forward, backward] = [(Relation::More, REST_SPEED), (Relation::Less, -REST_SPEED)]
            .map(|(relation, rest)| Test(relation, speed.clone(), number(rest)));
        p.when(forward, moving, |p| p.when(backward, moving, |p| set(p, drives)));
        per_ampere
    }

    /// The motion of the pulleys with which the cart follows the reference `y`.
    pub(super) fn needed(&self, p: &mut Program, name: &str, y: &Target) -> Needed {
        let machine = self.machine;
        let r = machine.pulley_radius;
        let way = self.direction(p, name, y);
        let [k1, k2] = match (machine.belt.make, machine.belt.follows_cart) {
            (Some(make), true) => {
                let (rigidity, [l1, l2, _]) = (make.rigidity(), make.spans.three());
                // k₁ = A E/(l₁ − x), k₂ = A E/(l₂ + x)
                [
                    p.local(&format!("{name}_k1"), rigidity / (l1 - &y.position)),
                    p.local(&format!("{name}_k2"), rigidity / (l2 + &y.position)),
                ]
            }
            _ => [number(machine.belt.stiffness[0]), number(machine.belt.stiffness[1])],
        };
        let k3 = number(machine.belt.stiffness[2]);
        let mut of = |what: &str, both: [f64; 2]| self.side(p, &format!("{name}_{what}"), &way, both);
        let cart = [machine.cart.friction.forward, machine.cart.friction.backward];
        let (viscous, coulomb) = (of("cart_b", cart.map(|s| s.viscous)), of("cart_c", cart.map(|s| s.coulomb)));
        let idler = [machine.idler_pulley.friction.forward, machine.idler_pulley.friction.backward];
        let (idler_b, idler_c) = (of("idler_b", idler.map(|s| s.viscous)), of("idler_c", idler.map(|s| s.coulomb)));
        let drive = [machine.drive_pulley.friction.forward, machine.drive_pulley.friction.backward];
        let drive_b = of("drive_b", drive.map(|s| s.viscous / (r * r)));
        let drive_c = of("drive_c", drive.map(|s| s.coulomb));
        let Target { position, speed, acceleration, jerk, snap } = y;
        // L = f₁ − f₂ = M y″ + b y′ + F_c sgn y′ − F                             (17)
        let mass = machine.cart.mass;
        let load = [
            mass * acceleration + &viscous * speed + &coulomb * &way - number(machine.cart.constant_force()),
            mass * jerk + &viscous * acceleration,
            mass * snap + &viscous * jerk,
        ];
        let load: Vec<Expr> =
            load.into_iter().enumerate().map(|(j, load)| p.local(&format!("{name}_load{j}"), load)).collect();
        // P = f₂ − f₃ = (J₂ y″/r + B₂ y′/r + τ_c2 sgn y′)/r                      (18)
        let inertia = machine.idler_pulley.inertia;
        let pull = [
            (inertia * acceleration / r + &idler_b * speed / r + &idler_c * &way) / r,
            (inertia * jerk / r + &idler_b * acceleration / r) / r,
            (inertia * snap / r + &idler_b * jerk / r) / r,
        ];
        let pull: Vec<Expr> =
            pull.into_iter().enumerate().map(|(j, pull)| p.local(&format!("{name}_pull{j}"), pull)).collect();
        // y₁ − y = (L + k₂ P/(k₂ + k₃))/k,  k = k₁ + k₂ k₃/(k₂ + k₃)
        let both = &k2 + &k3;
        let share = p.local(&format!("{name}_share"), &k2 / &both);
        let k = p.local(&format!("{name}_k"), k1 + &k2 * &k3 / both.clone());
        let stretch: Vec<Expr> = (0..3)
            .map(|j| {
                let value = match machine.belt.model {
                    BeltModel::Elastic => (load[j].clone() + &share * &pull[j]) / k.clone(),
                    BeltModel::TwoMass => &load[j] / &k,
                    BeltModel::Rigid => number(0.0),
                };
                p.local(&format!("{name}_stretch{j}"), value)
            })
            .collect();
        let behind: Vec<Expr> = (0..2)
            .map(|j| match machine.belt.model {
                BeltModel::Elastic => (&k3 * &stretch[j] - pull[j].clone()) / both.clone(),
                BeltModel::TwoMass | BeltModel::Rigid => stretch[j].clone(),
            })
            .collect();
        let mut sum = |what: &str, value: Expr| p.local(&format!("{name}_drive_{what}"), value);
        let drive = Target {
            position: sum("position", position + &stretch[0]),
            speed: sum("speed", speed + &stretch[1]),
            acceleration: sum("acceleration", acceleration + &stretch[2]),
            jerk: jerk.clone(),
            snap: snap.clone(),
        };
        // τ/r = ((J₁ + n² J_r) y₁″ + B₁ y₁′)/r² + τ_c1 sgn y′/r + L + P           (16)
        let n = machine.drives[0].motor.gear_ratio;
        let own = (machine.drive_pulley.inertia + n * n * machine.drives[0].motor.rotor_inertia) / (r * r);
        let force = own * &drive.acceleration
            + &drive_b * &drive.speed
            + &drive_c * &way / r
            + load[0].clone()
            + pull[0].clone();
        let rate = own * jerk + &drive_b * &drive.acceleration + load[1].clone() + pull[1].clone();
        let force = [p.local(&format!("{name}_push"), force), p.local(&format!("{name}_push_rate"), rate)];
        let idler = [position + &behind[0], speed + &behind[1]];
        let idler = [
            p.local(&format!("{name}_idler0"), idler[0].clone()),
            p.local(&format!("{name}_idler1"), idler[1].clone()),
        ];
        Needed { drive, idler, force }
    }

    /// Where the encoder's side should be, so that the cart is where it should.
    pub(super) fn target(&self, p: &mut Program, y: &Target) -> Target {
        if !(self.settings.compensate_stretch && self.before_belt) {
            return y.clone();
        }
        let needed = self.needed(p, "target", y);
        let mut target = needed.drive;
        if let Some(play) = self.machine.drives[0].motor.gear_play.filter(|_| self.before_gear) {
            let way = variable("target_way");
            let (r, n) = (self.machine.pulley_radius, self.machine.drives[0].motor.gear_ratio);
            // The twist of the gear: T/k_g, and half the play.
            let rotor = n * n * self.machine.drives[0].motor.rotor_inertia * &target.acceleration / r;
            let torque = p.local("target_torque", r * &needed.force[0] - rotor);
            let twist = r * (torque / play.stiffness + 0.5 * play.backlash * &way);
            target.position = p.local("target_position", target.position + twist);
        }
        target
    }

    /// The command that the reference asks for.
    pub(super) fn command(&self, p: &mut Program, name: &str, y: &Target) -> Expr {
        let settings = &self.settings;
        match settings.model {
            FeedForwardModel::None => number(0.0),
            // F = M y″ + b y′ + F_c sgn y′
            FeedForwardModel::Rigid => {
                let way = self.direction(p, name, y);
                let (viscous, dry) = self.friction(p, name, y.speed.clone(), &way);
                let mass = settings.inertia * self.rigid.mass;
                let force = mass * &y.acceleration + settings.friction * (viscous + dry) - number(self.rigid.constant);
                let command = self.command_of(p, name, force, mass * &y.jerk, y.speed.clone());
                p.local(name, command)
            }
            FeedForwardModel::Elastic => {
                let needed = self.needed(p, name, y);
                let way = variable(&format!("{name}_way"));
                let (viscous, dry) = self.friction(p, name, y.speed.clone(), &way);
                let less = (1.0 - settings.friction) * (viscous + dry)
                    + (1.0 - settings.inertia) * self.rigid.mass * &needed.drive.acceleration;
                let [force, rate] = needed.force;
                let command = self.command_of(p, name, force - less, rate, needed.drive.speed);
                p.local(name, command)
            }
        }
    }

    /// The part of friction that does not grow with speed, as a command.
    pub(super) fn dry(&self, p: &mut Program, y: &Target) -> Expr {
        let way = self.direction(p, "dry", y);
        // v · b of a standing axis is nothing.
        let coulomb = self.side(p, "dry_coulomb", &way, self.rigid.coulomb);
        let dry = coulomb * way;
        p.local("dry", (dry - number(self.rigid.constant)) / self.rigid.force_per_command())
    }
}
