//! Coordinates: which quantities are the states, and what every stretch, speed and angle is in terms of them.

use super::model::Variable;
use crate::friction::Law;
use crate::machine::axis::{BODIES, CART, DRIVE, ROTOR};
use crate::machine::{BeltModel, Machine};
use crate::mechanism::{Form, Mechanism};
use nalgebra::{DMatrix, DVector};

/// Speeds: of the three bodies, and of the rotor.
pub(super) const SPEEDS: usize = 4;
/// Lengths: of the three spans, the gear's twist, and where the cart is.
const STRETCHES: usize = 5;
/// The gear's twist among the lengths.
const TWIST: usize = 3;

/// Each length as coefficients of φ₁, x, φ₃ and φ_r.
fn arms(r: f64) -> [[f64; SPEEDS]; STRETCHES] {
    [[r, -1.0, 0.0, 0.0], [0.0, 1.0, -r, 0.0], [-r, 0.0, r, 0.0], [-1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]
}

/// Whether the rotor is an inertia of its own.
pub(super) fn has_rotor(mechanism: &Mechanism) -> bool {
    mechanism.drives[0].has_rotor()
}

/// States, and what is made of them.
pub(super) struct Frame {
    pub(super) variables: Vec<Variable>,
    /// Coefficients of the states in the lengths.
    stretch: [DVector<f64>; STRETCHES],
    /// Which of the lengths each spring of the mechanism has.
    of_spring: Vec<usize>,
    /// In φ̇₁, ẋ, φ̇₃, φ̇_r.
    speed: [DVector<f64>; SPEEDS],
    /// In φ₁, x, φ₃, φ_r.
    pub(super) angle: [DVector<f64>; SPEEDS],
    /// Places of the states that are ways, and their rates.
    pub(super) ways: Vec<(usize, DVector<f64>)>,
    /// Where the speeds stand that are states.
    pub(super) speed_place: [Option<usize>; SPEEDS],
    pub(super) current_place: Option<usize>,
    pub(super) bristle_place: [Option<usize>; 3],
    /// The kind of each state: the quantity whose coefficients in another frame are its own.
    kinds: Vec<Kind>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Angle(usize),
    Stretch(usize),
    Speed(usize),
    Current,
    Bristle(usize),
}

const ANGLES: [Variable; SPEEDS] = [
    Variable { name: "drive_angle", unit: "rad" },
    Variable { name: "cart_position", unit: "m" },
    Variable { name: "idler_angle", unit: "rad" },
    Variable { name: "rotor_angle", unit: "rad" },
];

const RATES: [Variable; SPEEDS] = [
    Variable { name: "drive_speed", unit: "rad/s" },
    Variable { name: "cart_speed", unit: "m/s" },
    Variable { name: "idler_speed", unit: "rad/s" },
    Variable { name: "rotor_speed", unit: "rad/s" },
];

const BRISTLES: [Variable; 3] = [
    Variable { name: "drive_bristle", unit: "rad" },
    Variable { name: "cart_bristle", unit: "m" },
    Variable { name: "idler_bristle", unit: "rad" },
];

impl Frame {
    /// Angles and speeds, body by body, of what moves by itself.
    pub(super) fn outer(machine: &Machine, plant: &Mechanism, held: [bool; 3], speed: f64) -> Self {
        let moving: Vec<usize> = moving(plant, held);
        let mut kinds: Vec<Kind> = Vec::new();
        for &j in moving.iter().filter(|&&j| j != ROTOR) {
            kinds.extend([Kind::Angle(j), Kind::Speed(j)]);
        }
        kinds.extend(plant.drives[0].has_current_state().then_some(Kind::Current));
        if moving.contains(&ROTOR) {
            kinds.extend([Kind::Angle(ROTOR), Kind::Speed(ROTOR)]);
        }
        kinds.extend(bristles(plant, held, speed));
        Self::new(machine, plant, kinds, false)
    }

    /// The cart's position and stretches, so that what does not depend on where the axis is has coefficients that are
    /// exactly zero. The outer frame where a body is held: then positions are stretches.
    pub(super) fn inner(machine: &Machine, plant: &Mechanism, held: [bool; 3], speed: f64) -> Self {
        if held.contains(&true) {
            return Self::outer(machine, plant, held, speed);
        }
        let mut kinds = vec![Kind::Angle(1)];
        kinds.extend(match machine.belt.model {
            BeltModel::Elastic => vec![Kind::Stretch(0), Kind::Stretch(1)],
            BeltModel::TwoMass => vec![Kind::Stretch(0)],
            BeltModel::Rigid => Vec::new(),
        });
        kinds.extend(has_rotor(plant).then_some(Kind::Stretch(TWIST)));
        kinds.extend(moving(plant, held).into_iter().map(Kind::Speed));
        kinds.extend(plant.drives[0].has_current_state().then_some(Kind::Current));
        kinds.extend(bristles(plant, held, speed));
        Self::new(machine, plant, kinds, true)
    }

    fn new(machine: &Machine, plant: &Mechanism, kinds: Vec<Kind>, relative: bool) -> Self {
        let r = machine.pulley_radius;
        let n = kinds.len();
        let place = |kind: Kind| kinds.iter().position(|k| *k == kind);
        let unit = |kind: Kind, factor: f64| {
            let mut row = DVector::zeros(n);
            if let Some(place) = place(kind) {
                row[place] = factor;
            }
            row
        };
        // What moves with another body goes its way times a ratio; the rotor of a stiff gear goes with the drive
        // pulley.
        let led = |kind: fn(usize) -> Kind, j: usize| match j {
            ROTOR if !has_rotor(plant) => unit(kind(plant.leader(DRIVE)), plant.ratio(DRIVE)),
            body => unit(kind(plant.leader(body)), plant.ratio(body)),
        };
        let speed: [DVector<f64>; SPEEDS] = std::array::from_fn(|j| led(Kind::Speed, j));
        let arms = arms(r);
        let along = |ways: &[DVector<f64>; SPEEDS], arm: &[f64; SPEEDS]| {
            ways.iter().zip(arm).fold(DVector::zeros(n), |sum, (way, arm)| sum + way * *arm)
        };
        let (angle, stretch): ([DVector<f64>; SPEEDS], [DVector<f64>; STRETCHES]);
        if relative {
            let x = unit(Kind::Angle(CART), 1.0);
            let (d1, twist) = (unit(Kind::Stretch(0), 1.0), unit(Kind::Stretch(TWIST), 1.0));
            // x − r φ₃; with both pulleys as one it is x − r φ₁
            let d2 = match machine.belt.model {
                BeltModel::Elastic => unit(Kind::Stretch(1), 1.0),
                _ => -d1.clone(),
            };
            // r φ₁ = x + d₁,  r φ₃ = x − d₂,  φ_r = φ₁ + θ
            let drive = (&x + &d1) / r;
            let rotor = &drive + &twist;
            angle = [drive, x.clone(), (&x - &d2) / r, rotor];
            stretch = [d1.clone(), d2.clone(), -d1 - d2, twist, x];
        } else {
            angle = std::array::from_fn(|j| led(Kind::Angle, j));
            stretch = std::array::from_fn(|j| along(&angle, &arms[j]));
        }
        let ways = kinds
            .iter()
            .enumerate()
            .filter_map(|(place, kind)| match *kind {
                Kind::Angle(j) => Some((place, speed[j].clone())),
                Kind::Stretch(j) => Some((place, along(&speed, &arms[j]))),
                _ => None,
            })
            .collect();
        let variables = kinds.iter().map(|kind| match *kind {
            Kind::Angle(j) => ANGLES[j],
            Kind::Speed(j) => RATES[j],
            Kind::Current => Variable { name: "motor_current", unit: "A" },
            Kind::Bristle(j) => BRISTLES[j],
            Kind::Stretch(3) => Variable { name: "twist", unit: "rad" },
            Kind::Stretch(_) => Variable { name: "stretch", unit: "m" },
        });
        Self {
            variables: variables.collect(),
            speed_place: std::array::from_fn(|j| place(Kind::Speed(j))),
            current_place: place(Kind::Current),
            bristle_place: std::array::from_fn(|j| place(Kind::Bristle(j))),
            stretch,
            of_spring: match has_rotor(plant) {
                true => vec![0, 1, 2, TWIST, STRETCHES - 1],
                false => vec![0, 1, 2, STRETCHES - 1],
            },
            speed,
            angle,
            ways,
            kinds,
        }
    }

    /// Coefficients of the states in a form, and that of the input.
    pub(super) fn row(&self, form: &Form) -> (DVector<f64>, f64) {
        let mut row = DVector::zeros(self.variables.len());
        let stretches = self.of_spring.iter().map(|&own| &self.stretch[own]).zip(form.stretch);
        for (part, factor) in stretches.chain(self.speed.iter().zip(form.speed)) {
            if factor != 0.0 {
                row += part * factor;
            }
        }
        if let Some(place) = self.current_place {
            row[place] += form.current[0];
        }
        (row, form.input[0])
    }

    /// This frame's states from those of another.
    pub(super) fn from(&self, other: &Frame) -> DMatrix<f64> {
        let n = self.kinds.len();
        let mut matrix = DMatrix::zeros(n, n);
        for (i, kind) in self.kinds.iter().enumerate() {
            let row = match *kind {
                Kind::Angle(j) => other.angle[j].clone(),
                Kind::Stretch(j) => other.stretch[j].clone(),
                Kind::Speed(j) => other.speed[j].clone(),
                Kind::Current | Kind::Bristle(_) => {
                    DVector::from_fn(n, |j, _| f64::from(u8::from(other.kinds[j] == *kind)))
                }
            };
            matrix.row_mut(i).copy_from(&row.transpose());
        }
        matrix
    }
}

/// Bodies that move by themselves, and the rotor, if it does.
fn moving(plant: &Mechanism, held: [bool; 3]) -> Vec<usize> {
    plant.leaders().filter(|&j| j == ROTOR || !held[j]).collect()
}

/// Bristles that are states.
fn bristles(plant: &Mechanism, held: [bool; 3], speed: f64) -> Vec<Kind> {
    let forward = speed >= 0.0;
    let has = |body: &usize| {
        let friction = &plant.bodies[*body].friction;
        let v = speed.abs() / plant.bodies[*body].kind.lever();
        matches!(friction.law, Law::LuGre { .. }) && friction.dry(forward, v) > 0.0 && !held[*body]
    };
    (0..BODIES).filter(has).map(Kind::Bristle).collect()
}
