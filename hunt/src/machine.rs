//! The numbers of a machine as the independent solver wants them: all along the belt, in numbers of 106 bits.
//!
//! A pulley of inertia J and radius r counts as a mass J/r² at the position r φ, a torque τ as a force τ/r, an angular
//! viscosity B as B/r². Positions are counted from where the cart (of a gantry bridge and cart) starts, so that a start
//! far from the origin costs no digits.

use crate::double::Double;
use taut::case::Experiment;
use taut::machine::axis::{CART, DRIVE, IDLER};
use taut::machine::{AmplifierMode, BeltModel, GRAVITY, Machine, Travel};
use taut::mechanism::{Amplifier, Motor};
use taut::polyline::Polyline;

/// Bodies that a machine can have beside its rotors, and its drives.
pub const BODIES: usize = 5;
/// Drives.
pub const DRIVES: usize = 3;
/// Spans.
pub const SPANS: usize = 6;

/// States: positions and speeds along the belt of the bodies, currents, positions and speeds of rotors that turn by
/// themselves, deflections of bristles.
pub const STATES: usize = 2 * BODIES + DRIVES + 2 * DRIVES + BODIES;
/// Position of each body; its speed stands behind it.
pub const WAY: [usize; BODIES] = [0, 2, 4, 6, 8];
/// Speed of each body.
pub const SPEED: [usize; BODIES] = [1, 3, 5, 7, 9];
/// Current of each drive.
pub const CURRENT: [usize; DRIVES] = [10, 11, 12];
/// Each rotor's position and speed.
pub const ROTOR: [[usize; 2]; DRIVES] = [[13, 14], [15, 16], [17, 18]];
/// Deflection of each body's bristles.
pub const BRISTLE: [usize; BODIES] = [19, 20, 21, 22, 23];

/// A state.
pub type State = [Double; STATES];

/// A friction law between rest and fast sliding, in units along the belt.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Curve {
    /// Coulomb's.
    #[default]
    None,
    /// F_c + (F_b − F_c) e^{−(v/v_s)²}, or e^{−v/v_s}.
    Stribeck {
        /// v_s.
        velocity: Double,
        /// True if the exponent is a square.
        is_gaussian: bool,
    },
    /// √(2e) (F_b − F_c) e^{−(v/v_St)²} v/v_St + F_c tanh(v/v_Coul), v_St = √2 v_b, v_Coul = v_b/10.
    Smooth(Double),
    /// Bristles: σ₀, σ₁, v_s.
    Bristles([Double; 3]),
}

impl Curve {
    /// True if a body under it can be at rest.
    pub fn sticks(self) -> bool {
        matches!(self, Curve::None | Curve::Stribeck { .. })
    }
}

/// Friction of a body, forward and backward.
#[derive(Debug, Clone, Copy, Default)]
pub struct Friction {
    /// Force per speed.
    pub viscous: [Double; 2],
    /// Friction while it slides.
    pub coulomb: [Double; 2],
    /// Friction that holds at rest.
    pub breakaway: [Double; 2],
    /// The law between the two.
    pub curve: Curve,
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

/// A value by straight lines between points, the first and the last value held beyond them.
#[derive(Debug, Clone)]
pub struct Line {
    /// Position from the start or speed, and value.
    pub points: Vec<[Double; 2]>,
}

/// A span whose length follows bodies: k = E A/l.
#[derive(Debug, Clone, Copy)]
pub struct Follows {
    /// E A.
    pub rigidity: Double,
    /// Length at the start.
    pub length: Double,
    /// Change of the length with the position of each body.
    pub of: [f64; BODIES],
}

/// A span of a belt: f = k s + c ṡ with the elongation s = Σ arms q.
#[derive(Debug, Clone)]
pub struct Span {
    /// Elongation by the position of each body along the belt.
    pub arms: [f64; BODIES],
    /// Stiffness.
    pub stiffness: Double,
    /// Damping.
    pub damping: Double,
    /// The bodies that its stiffness follows.
    pub follows: Option<Follows>,
}

/// A motor with its amplifier.
#[derive(Debug, Clone)]
pub struct Drive {
    /// The body that it turns.
    pub body: usize,
    /// Mass that the rotor counts as.
    pub rotor: Double,
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
    /// True if the input commands the current.
    pub current_mode: bool,
    /// Output per input.
    pub gain: Double,
    /// Limits of voltage and current.
    pub voltage_limit: Option<Double>,
    /// Limit of the current.
    pub current_limit: Option<Double>,
    /// Rate of the current loop, rad/s.
    pub bandwidth: Option<Double>,
}

/// The machine and its start.
#[derive(Debug, Clone)]
pub struct Model {
    /// How many bodies there are.
    pub bodies: usize,
    /// The body that each one moves with.
    pub leader: [usize; BODIES],
    /// Masses.
    pub mass: [Double; BODIES],
    /// Friction of each body by itself.
    pub friction: [Friction; BODIES],
    /// Factor of the dry friction of body 1 over its position.
    pub along: Option<Line>,
    /// The belt.
    pub spans: Vec<Span>,
    /// Pretension, if spans can go slack.
    pub pretension: Option<Double>,
    /// Constant force on body 1.
    pub force: Double,
    /// Forces on body 1 over its position and over its speed.
    pub lines: [Option<Line>; 2],
    /// Ends of the travel of each body.
    pub ends: [Option<Ends>; BODIES],
    /// The drives.
    pub drives: Vec<Drive>,
    /// State at time zero.
    pub start: State,
    /// Difference between the positions given and those of that state: less than a strain.
    pub beyond: [Double; BODIES],
    /// Position of each body where ways are counted from.
    pub origin: [Double; BODIES],
    /// Factor from a position of taut (rad or m) to one along the belt.
    pub lever: [Double; BODIES],
    /// The bodies that say where the machine is, each with the change of all positions with its own.
    pub place: Vec<(usize, [f64; BODIES])>,
    /// How much later than at zero every condition falls, in the SI unit that taut has for it.
    pub delayed: f64,
}

/// How a number of the case becomes one of ours: as it is, or perturbed.
pub type Taken<'a> = &'a mut dyn FnMut(f64) -> Double;

impl Model {
    /// The axis `stage` at the start of `experiment`; every number passes `taken` once.
    pub fn new(machine: &Machine, experiment: &Experiment, taken: Taken) -> Self {
        let r = taken(machine.pulley_radius);
        let r2 = r * r;
        let cart = friction(&machine.cart.friction, taken, Double::ONE);
        let pulleys = [&machine.drive_pulley, &machine.idler_pulley].map(|pulley| friction(&pulley.friction, taken, r));
        let mut mass = [Double::ZERO; BODIES];
        mass[0] = taken(machine.drive_pulley.inertia) / r2;
        mass[1] = taken(machine.cart.mass);
        mass[2] = taken(machine.idler_pulley.inertia) / r2;
        // F_L − M g sin θ
        let slope = taken(machine.cart.inclination).sin_cos().0;
        let force = taken(machine.cart.load) - mass[1] * slope * GRAVITY;
        let cart_start = Double::from(experiment.initial.position[CART]);
        let forces = &machine.cart.forces;
        let mut ends = [None; BODIES];
        ends[1] = machine.cart.travel.map(|travel| self::ends(travel, taken, cart_start));
        let (start, beyond) = start(machine, experiment, taken, r, cart_start);
        Self {
            bodies: 3,
            leader: match machine.belt.model {
                BeltModel::Elastic => [0, 1, 2, 3, 4],
                BeltModel::TwoMass => [0, 1, 0, 3, 4],
                BeltModel::Rigid => [1, 1, 1, 3, 4],
            },
            mass,
            friction: [pulleys[0], cart, pulleys[1], Friction::default(), Friction::default()],
            along: line(machine.cart.along.as_ref(), taken, cart_start),
            spans: spans(machine, taken, cart_start),
            pretension: machine.belt.pretension.map(&mut *taken),
            force,
            lines: [
                line(forces.along.as_ref(), taken, cart_start),
                line(forces.by_speed.as_ref(), taken, Double::ZERO),
            ],
            ends,
            drives: vec![drive(0, &machine.drives[0].motor, &machine.drives[0].amplifier, taken, r)],
            start,
            beyond,
            origin: [cart_start; BODIES],
            lever: [r, Double::ONE, r, Double::ONE, Double::ONE],
            place: vec![(1, [1.0; BODIES])],
            delayed: 0.0,
        }
    }

    /// The body that this one moves with.
    pub fn leader(&self, body: usize) -> usize {
        self.leader[body]
    }

    /// The bodies that move by themselves.
    pub fn leaders(&self) -> impl Iterator<Item = usize> + use<> {
        let leader = self.leader;
        (0..self.bodies).filter(move |&body| leader[body] == body)
    }

    /// The bodies that move with this one, itself included.
    pub fn followers(&self, leader: usize) -> impl Iterator<Item = usize> + use<> {
        let all = self.leader;
        (0..self.bodies).filter(move |&body| all[body] == leader)
    }

    /// The drive that turns this body.
    pub fn drive_of(&self, leader: usize) -> Option<usize> {
        self.drives.iter().position(|drive| self.leader(drive.body) == leader)
    }

    /// True if a body can be at rest, or feels its direction by a law that lets it rest.
    pub fn is_dry(&self, leader: usize) -> bool {
        let loses = self.drive_of(leader).is_some_and(|drive| self.drives[drive].loses());
        let mut sum = [[Double::ZERO; 2]; 2];
        for body in self.followers(leader).filter(|&body| self.friction[body].curve.sticks()) {
            let own = &self.friction[body];
            for (side, [dry, viscous]) in sum.iter_mut().enumerate() {
                *dry += own.coulomb[side] + own.breakaway[side];
                *viscous += own.viscous[side];
            }
        }
        sum.iter().any(|side| side[0] != Double::ZERO) || sum[0][1] != sum[1][1] || loses
    }

    /// True if it feels its direction by a law that never lets it rest.
    pub fn is_curved(&self, leader: usize) -> bool {
        self.followers(leader).any(|body| !self.friction[body].curve.sticks())
    }
}

impl Drive {
    /// True if the gear loses power.
    pub fn loses(&self) -> bool {
        self.efficiency < Double::ONE
    }

    /// True if the current is a state.
    pub fn current_moves(&self) -> bool {
        if self.current_mode { self.bandwidth.is_some() } else { self.inductance > Double::ZERO }
    }
}

/// A motor and its amplifier.
pub fn drive(body: usize, motor: &Motor, amplifier: &Amplifier, taken: Taken, r: Double) -> Drive {
    let n = taken(motor.gear_ratio);
    Drive {
        body,
        rotor: n * n * taken(motor.rotor_inertia) / (r * r),
        grip: n * taken(motor.torque_constant) / r,
        back_emf: n * taken(motor.back_emf_constant) / r,
        resistance: taken(motor.resistance),
        inductance: taken(motor.inductance),
        efficiency: if motor.gear_efficiency < 1.0 { taken(motor.gear_efficiency) } else { Double::ONE },
        play: play(motor, taken, r),
        current_mode: amplifier.mode == AmplifierMode::Current,
        gain: taken(amplifier.gain),
        voltage_limit: amplifier.voltage_limit.map(&mut *taken),
        current_limit: amplifier.current_limit.map(&mut *taken),
        // 2π f
        bandwidth: amplifier.bandwidth.map(|f| crate::double::PI * 2.0 * taken(f)),
    }
}

/// A line, over what is left of x without `origin`.
fn line(line: Option<&Polyline>, taken: Taken, origin: Double) -> Option<Line> {
    let point = |&[x, force]: &[f64; 2]| [(Double::from(x) - origin) * taken(1.0), taken(force)];
    Some(Line { points: line?.points().iter().map(point).collect() })
}

/// The gear, where it is compliant.
fn play(motor: &Motor, taken: Taken, r: Double) -> Option<Play> {
    let play = motor.gear_play?;
    let r2 = r * r;
    let (half, k, c) = (taken(play.backlash) * 0.5 * r, taken(play.stiffness) / r2, taken(play.damping) / r2);
    Some(match play.backlash > 0.0 {
        true => Play::Loose(Flanks { ends: [-half, half], stiffness: k, damping: c }),
        false => Play::Tight(k, c),
    })
}

/// The ends of a travel, from where its body starts.
pub fn ends(travel: Travel, taken: Taken, origin: Double) -> Ends {
    let ends = [travel.min, travel.max].map(|end| (Double::from(end) - origin) * taken(1.0));
    match travel.stop {
        None => Ends::Open(ends),
        Some(stop) => Ends::Stops(Flanks { ends, stiffness: taken(stop.stiffness), damping: taken(stop.damping) }),
    }
}

/// Friction of a body whose speed times `r` is that along the belt.
pub fn friction(law: &taut::friction::Friction, taken: Taken, r: Double) -> Friction {
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
    let curve = match law.law {
        taut::friction::Law::Coulomb => Curve::None,
        taut::friction::Law::Stribeck { velocity, shape } => {
            Curve::Stribeck { velocity: taken(velocity) * r, is_gaussian: shape == taut::friction::Shape::Gaussian }
        }
        taut::friction::Law::Smooth { breakaway_velocity } => Curve::Smooth(taken(breakaway_velocity) * r),
        taut::friction::Law::LuGre { stiffness, damping, velocity } => {
            Curve::Bristles([taken(stiffness) / (r * r), taken(damping) / (r * r), taken(velocity) * r])
        }
    };
    Friction {
        viscous: viscous.map(|b| b / (r * r)),
        coulomb: coulomb.map(|force| force / r),
        breakaway: breakaway.map(|force| force / r),
        curve,
    }
}

/// Spans 1 (drive pulley to cart), 2 (cart to idler pulley) and 3 (back), or 1 and the other two in series.
fn spans(machine: &Machine, taken: Taken, cart_start: Double) -> Vec<Span> {
    let [k, c] = [machine.belt.stiffness, machine.belt.damping].map(|values| values.three().map(&mut *taken));
    let make = machine.belt.make.filter(|_| machine.belt.follows_cart);
    // l₁ − x, l₂ + x; the third span keeps its length.
    let follows = make.map(|make| {
        let rigidity = taken(make.modulus) * taken(make.section);
        let [l1, l2, l3] = make.spans.three().map(&mut *taken);
        (rigidity, l1 - cart_start, l2 + cart_start, l3)
    });
    let follows = |which: usize, more: bool| {
        let (rigidity, l1, l2, l3) = follows?;
        match which {
            0 => Some(Follows { rigidity, length: l1, of: [0.0, -1.0, 0.0, 0.0, 0.0] }),
            1 if more => Some(Follows { rigidity, length: l2 + l3, of: [0.0, 1.0, 0.0, 0.0, 0.0] }),
            1 => Some(Follows { rigidity, length: l2, of: [0.0, 1.0, 0.0, 0.0, 0.0] }),
            _ => None,
        }
    };
    let first = [1.0, -1.0, 0.0, 0.0, 0.0];
    match machine.belt.model {
        BeltModel::Rigid => Vec::new(),
        BeltModel::Elastic => [first, [0.0, 1.0, -1.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0, 0.0]]
            .into_iter()
            .enumerate()
            .map(|(j, arms)| Span { arms, stiffness: k[j], damping: c[j], follows: follows(j, false) })
            .collect(),
        BeltModel::TwoMass => {
            // 1/k₂₃ = 1/k₂ + 1/k₃, c₂₃ = (c₂ k₃² + c₃ k₂²)/(k₂ + k₃)²
            let sum = k[1] + k[2];
            let k23 = k[1] * k[2] / sum;
            let c23 = (c[1] * k[2] * k[2] + c[2] * k[1] * k[1]) / (sum * sum);
            let second =
                Span { arms: [0.0, 1.0, -1.0, 0.0, 0.0], stiffness: k23, damping: c23, follows: follows(1, true) };
            vec![Span { arms: first, stiffness: k[0], damping: c[0], follows: follows(0, false) }, second]
        }
    }
}

/// True if a difference of two positions is more than their rounding.
pub fn is_strain(strain: Double, origin: Double) -> bool {
    let way = (strain + origin).high.abs();
    strain.high.abs() > LAST_PLACES * f64::EPSILON * way.max(origin.high.abs())
}

/// Positions at the start that differ by no more of their last places mean a belt without strain: x/r is a rounded
/// number, too.
const LAST_PLACES: f64 = 4.0;

fn start(
    machine: &Machine,
    experiment: &Experiment,
    taken: Taken,
    r: Double,
    origin: Double,
) -> (State, [Double; BODIES]) {
    let initial = &experiment.initial;
    let mut z = [Double::ZERO; STATES];
    let mut beyond = [Double::ZERO; BODIES];
    for (body, angle) in [(0, initial.position[DRIVE]), (2, initial.position[IDLER])] {
        // Strains, not positions: a number of 64 bits holds the first to their own last place.
        let strain = Double::from(machine.pulley_radius) * angle - origin;
        match is_strain(strain, origin) {
            true => z[WAY[body]] = strain * taken(1.0),
            false => beyond[body] = strain,
        }
    }
    z[SPEED[0]] = taken(initial.speed[DRIVE]) * r;
    z[SPEED[1]] = taken(initial.speed[CART]);
    z[SPEED[2]] = taken(initial.speed[IDLER]) * r;
    match machine.belt.model {
        BeltModel::Elastic => {}
        BeltModel::TwoMass => (z[WAY[2]], z[SPEED[2]]) = (z[WAY[0]], z[SPEED[0]]),
        BeltModel::Rigid => (z[SPEED[0]], z[SPEED[2]]) = (z[SPEED[1]], z[SPEED[1]]),
    }
    z[CURRENT[0]] = taken(initial.current[0]);
    // The rotor begins in the middle of its play.
    (z[ROTOR[0][0]], z[ROTOR[0][1]]) = (z[WAY[0]], z[SPEED[0]]);
    (z, beyond)
}
