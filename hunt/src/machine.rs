//! The numbers of a stage as the independent solver wants them: all along the belt, in numbers of 106 bits.
//!
//! A pulley of inertia J and radius r counts as a mass J/r² that goes the way y = r φ, a torque τ as a force τ/r, an
//! angular
//! viscosity B as B/r². Ways are counted from where the cart starts, so that a start far from the origin costs no
//! digits.

use crate::double::Double;
use taut::case::Experiment;
use taut::stage::{AmplifierMode, BeltModel, GRAVITY, Stage};

/// Places in the state: ways and speeds along the belt of drive pulley, cart and idler pulley, the current, way and
/// speed of a
/// rotor that turns by itself.
pub const STATES: usize = 9;
/// Way of body 0, 1, 2; its speed stands behind it.
pub const WAY: [usize; 3] = [0, 2, 4];
/// Speed of body 0, 1, 2.
pub const SPEED: [usize; 3] = [1, 3, 5];
/// The current.
pub const CURRENT: usize = 6;
/// The rotor's way and speed.
pub const ROTOR: [usize; 2] = [7, 8];

/// A state.
pub type State = [Double; STATES];

/// Dry and viscous friction of a body, forward and backward.
#[derive(Debug, Clone, Copy, Default)]
pub struct Friction {
    /// Force per speed.
    pub viscous: [Double; 2],
    /// Friction while it slides.
    pub coulomb: [Double; 2],
    /// Friction that holds at rest.
    pub breakaway: [Double; 2],
}

/// Two elastic flanks that only push.
#[derive(Debug, Clone, Copy)]
pub struct Flanks {
    /// Where the lower and the upper one begins.
    pub ends: [Double; 2],
    /// Stiffness.
    pub stiffness: Double,
    /// Damping.
    pub damping: Double,
}

/// The kind of a compliant gear.
#[derive(Debug, Clone, Copy)]
pub enum Play {
    /// Without backlash both flanks always touch: stiffness, damping.
    Tight(Double, Double),
    /// With backlash.
    Loose(Flanks),
}

/// The end of the travel.
#[derive(Debug, Clone, Copy)]
pub enum Ends {
    /// The run ends there.
    Open([Double; 2]),
    /// End stops.
    Stops(Flanks),
}

/// A force on the cart by straight lines between points, the first and the last value held beyond them.
#[derive(Debug, Clone)]
pub struct Line {
    /// Way from the start or speed, and force.
    pub points: Vec<[Double; 2]>,
}

/// The machine and its start.
#[derive(Debug, Clone)]
pub struct Machine {
    /// The bodies that move by themselves.
    pub model: BeltModel,
    /// Masses of drive pulley, cart, idler pulley.
    pub mass: [Double; 3],
    /// Mass that the rotor counts as.
    pub rotor: Double,
    /// Friction of each body by itself.
    pub friction: [Friction; 3],
    /// Stiffness and damping of the spans.
    pub belt: [[Double; 3]; 2],
    /// Pretension, if spans can go slack.
    pub pretension: Option<Double>,
    /// Constant force on the cart.
    pub force: Double,
    /// Forces on the cart over its way and over its speed.
    pub lines: [Option<Line>; 2],
    /// Ends of the travel.
    pub ends: Option<Ends>,
    /// Force at the belt per ampere, before the gear's losses.
    pub grip: Double,
    /// Back-EMF per speed along the belt.
    pub back_emf: Double,
    /// Resistance.
    pub resistance: Double,
    /// Inductance.
    pub inductance: Double,
    /// Efficiency of the gear.
    pub efficiency: Double,
    /// A compliant gear.
    pub play: Option<Play>,
    /// Whether the input commands the current.
    pub current_mode: bool,
    /// Output per input.
    pub gain: Double,
    /// Limits of voltage and current.
    pub voltage_limit: Option<Double>,
    /// Limit of the current.
    pub current_limit: Option<Double>,
    /// Rate of the current loop, rad/s.
    pub bandwidth: Option<Double>,
    /// State at time zero.
    pub start: State,
    /// Difference between the positions given for drive pulley, cart and idler pulley and those of that state: less
    /// than a strain.
    pub beyond: [Double; 3],
    /// Radius of the pulleys.
    pub radius: Double,
    /// Where the cart starts: ways are counted from there.
    pub origin: Double,
}

/// How a number of the case becomes one of ours: as it is, or perturbed.
pub type Taken<'a> = &'a mut dyn FnMut(f64) -> Double;

impl Machine {
    /// The machine of `stage` at the start of `experiment`; every number passes `taken` once.
    pub fn new(stage: &Stage, experiment: &Experiment, taken: Taken) -> Self {
        let motor = &stage.motor;
        let r = taken(stage.pulley_radius);
        let r2 = r * r;
        let n = taken(motor.gear_ratio);
        let friction = [
            friction(&stage.drive_pulley.friction, taken, r),
            friction(&stage.cart.friction, taken, Double::ONE),
            friction(&stage.idler_pulley.friction, taken, r),
        ];
        let [k, c] = [stage.belt.stiffness, stage.belt.damping].map(|values| values.map(&mut *taken));
        let mass =
            [taken(stage.drive_pulley.inertia) / r2, taken(stage.cart.mass), taken(stage.idler_pulley.inertia) / r2];
        // F_L − M g sin θ
        let slope = taken(stage.cart.inclination).sin_cos().0;
        let force = taken(stage.cart.load) - mass[1] * slope * GRAVITY;
        let origin = Double::from(experiment.initial.cart_position);
        let (play, ends) = (play(stage, taken, r), ends(stage, taken, origin));
        let forces = &stage.cart.forces;
        let lines = [line(forces.along.as_ref(), taken, origin), line(forces.by_speed.as_ref(), taken, Double::ZERO)];
        let amplifier = &stage.amplifier;
        Self {
            model: stage.belt.model,
            mass,
            rotor: n * n * taken(motor.rotor_inertia) / r2,
            friction,
            belt: [k, c],
            pretension: stage.belt.pretension.map(&mut *taken),
            force,
            lines,
            ends,
            grip: n * taken(motor.torque_constant) / r,
            back_emf: n * taken(motor.back_emf_constant) / r,
            resistance: taken(motor.resistance),
            inductance: taken(motor.inductance),
            efficiency: if motor.gear_efficiency < 1.0 { taken(motor.gear_efficiency) } else { Double::ONE },
            play,
            current_mode: amplifier.mode == AmplifierMode::Current,
            gain: taken(amplifier.gain),
            voltage_limit: amplifier.voltage_limit.map(&mut *taken),
            current_limit: amplifier.current_limit.map(&mut *taken),
            // 2π f
            bandwidth: amplifier.bandwidth.map(|f| crate::double::PI * 2.0 * taken(f)),
            start: start(stage, experiment, taken, r, origin),
            beyond: beyond(stage, experiment, origin),
            radius: r,
            origin,
        }
    }

    /// The body that this one moves with.
    pub fn leader(&self, body: usize) -> usize {
        match self.model {
            BeltModel::Elastic => body,
            BeltModel::TwoMass => [0, 1, 0][body],
            BeltModel::Rigid => 1,
        }
    }

    /// The bodies that move with this one, itself included.
    pub fn followers(&self, leader: usize) -> impl Iterator<Item = usize> {
        (0..3).filter(move |&body| self.leader(body) == leader)
    }

    /// Friction of a body and of all that move with it.
    pub fn friction_of(&self, leader: usize) -> Friction {
        let mut sum = Friction::default();
        for body in self.followers(leader) {
            let own = &self.friction[body];
            for side in 0..2 {
                sum.viscous[side] += own.viscous[side];
                sum.coulomb[side] += own.coulomb[side];
                sum.breakaway[side] += own.breakaway[side];
            }
        }
        sum
    }

    /// Whether the gear loses power.
    pub fn loses(&self) -> bool {
        self.efficiency < Double::ONE
    }

    /// Whether a body can be at rest, or feels its direction.
    pub fn is_dry(&self, leader: usize) -> bool {
        let friction = self.friction_of(leader);
        let dry = friction.coulomb.iter().chain(&friction.breakaway).any(|&force| force != Double::ZERO);
        dry || friction.viscous[0] != friction.viscous[1] || (self.loses() && self.leader(0) == leader)
    }

    /// Whether the current is a state.
    pub fn current_moves(&self) -> bool {
        if self.current_mode { self.bandwidth.is_some() } else { self.inductance > Double::ZERO }
    }
}

/// A line, over what is left of x without `origin`.
fn line(line: Option<&taut::polyline::Polyline>, taken: Taken, origin: Double) -> Option<Line> {
    let point = |&[x, force]: &[f64; 2]| [(Double::from(x) - origin) * taken(1.0), taken(force)];
    Some(Line { points: line?.points().iter().map(point).collect() })
}

/// The gear, where it is compliant.
fn play(stage: &Stage, taken: Taken, r: Double) -> Option<Play> {
    let play = stage.motor.gear_play?;
    let r2 = r * r;
    let (half, k, c) = (taken(play.backlash) * 0.5 * r, taken(play.stiffness) / r2, taken(play.damping) / r2);
    Some(match play.backlash > 0.0 {
        true => Play::Loose(Flanks { ends: [-half, half], stiffness: k, damping: c }),
        false => Play::Tight(k, c),
    })
}

/// The ends of the travel, from where the cart starts.
fn ends(stage: &Stage, taken: Taken, origin: Double) -> Option<Ends> {
    let travel = stage.travel?;
    let ends = [travel.min, travel.max].map(|end| (Double::from(end) - origin) * taken(1.0));
    Some(match travel.stop {
        None => Ends::Open(ends),
        Some(stop) => Ends::Stops(Flanks { ends, stiffness: taken(stop.stiffness), damping: taken(stop.damping) }),
    })
}

fn friction(law: &taut::friction::Friction, taken: Taken, r: Double) -> Friction {
    let sides = [law.forward, law.backward];
    // Values that are equal stay so.
    let mut both = |value: fn(&taut::friction::Side) -> f64| {
        let [forward, backward] = [value(&sides[0]), value(&sides[1])];
        let first = taken(forward);
        [first, if forward == backward { first } else { taken(backward) }]
    };
    let (viscous, coulomb) = (both(|side| side.viscous), both(|side| side.coulomb));
    let mut breakaway = both(|side| side.breakaway);
    for (side, (breakaway, coulomb)) in sides.iter().zip(breakaway.iter_mut().zip(coulomb)) {
        if side.breakaway == side.coulomb || *breakaway < coulomb {
            *breakaway = coulomb;
        }
    }
    Friction {
        viscous: viscous.map(|b| b / (r * r)),
        coulomb: coulomb.map(|force| force / r),
        breakaway: breakaway.map(|force| force / r),
    }
}

/// Ways of the pulleys at the start, from that of the cart, as the case gives them.
fn strains(stage: &Stage, experiment: &Experiment, origin: Double) -> [Double; 2] {
    let initial = &experiment.initial;
    [initial.drive_angle, initial.idler_angle].map(|angle| Double::from(stage.pulley_radius) * angle - origin)
}

fn beyond(stage: &Stage, experiment: &Experiment, origin: Double) -> [Double; 3] {
    let [drive, idler] =
        strains(stage, experiment, origin).map(|strain| if is_strain(strain, origin) { Double::ZERO } else { strain });
    [drive, Double::ZERO, idler]
}

fn is_strain(strain: Double, origin: Double) -> bool {
    let way = (strain + origin).high.abs();
    strain.high.abs() > LAST_PLACES * f64::EPSILON * way.max(origin.high.abs())
}

/// Positions at the start that differ by no more of their last places mean a belt without strain: x/r is a rounded
/// number, too.
const LAST_PLACES: f64 = 4.0;

fn start(stage: &Stage, experiment: &Experiment, taken: Taken, r: Double, origin: Double) -> State {
    let initial = &experiment.initial;
    let mut z = [Double::ZERO; STATES];
    // Strains, not positions: a number of 64 bits holds the first to their own last place.
    let [drive, idler] = strains(stage, experiment, origin)
        .map(|strain| if is_strain(strain, origin) { strain * taken(1.0) } else { Double::ZERO });
    (z[WAY[0]], z[WAY[2]]) = (drive, idler);
    z[SPEED[0]] = taken(initial.drive_speed) * r;
    z[SPEED[1]] = taken(initial.cart_speed);
    z[SPEED[2]] = taken(initial.idler_speed) * r;
    match stage.belt.model {
        BeltModel::Elastic => {}
        BeltModel::TwoMass => (z[WAY[2]], z[SPEED[2]]) = (z[WAY[0]], z[SPEED[0]]),
        BeltModel::Rigid => (z[SPEED[0]], z[SPEED[2]]) = (z[SPEED[1]], z[SPEED[1]]),
    }
    z[CURRENT] = taken(initial.motor_current);
    // The rotor begins in the middle of its play.
    (z[ROTOR[0]], z[ROTOR[1]]) = (z[WAY[0]], z[SPEED[0]]);
    z
}
