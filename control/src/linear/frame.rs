//! Coordinates: the state variables, and every elongation, speed and angle in terms of them.

use crate::friction::Law;
use crate::machine::{Geometry, Machine};
use crate::mechanism::{self, CURRENTS, Form, Mechanism};
use nalgebra::{DMatrix, DVector};

/// A quantity with its unit.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Variable {
    /// Its name, as of a column of a run.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
}

impl Variable {
    pub(super) fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit }
    }

    /// The angle or position of a body.
    pub(super) fn angle(plant: &Mechanism, body: usize) -> Self {
        let part = &plant.bodies[body];
        let way = if part.kind == mechanism::MotionKind::Linear { "position" } else { "angle" };
        Self::new(format!("{}_{way}", part.label.key), part.kind.units()[0])
    }

    /// The speed of a body.
    pub(super) fn speed(plant: &Mechanism, body: usize) -> Self {
        let part = &plant.bodies[body];
        Self::new(format!("{}_speed", part.label.key), part.kind.units()[1])
    }

    /// A current of a drive: of a stepper i_d and i_q, which turn with its rotor.
    pub(super) fn current(geometry: &Geometry, plant: &Mechanism, number: usize) -> Self {
        let drive = (0..plant.drives.len()).rfind(|drive| plant.first_current(*drive) <= number).unwrap_or_default();
        let at = &geometry.drives[drive];
        match (plant.drives[drive].motor.stepper, number - plant.first_current(drive)) {
            (None, _) => Self::new(at.current_column, "A"),
            (Some(_), 0) => Self::new(format!("{}direct_axis_current", at.prefix), "A"),
            (Some(_), _) => Self::new(format!("{}quadrature_axis_current", at.prefix), "A"),
        }
    }
}

/// States, and quantities in terms of them.
pub(super) struct Frame {
    pub(super) variables: Vec<Variable>,
    /// Coefficients of the states in each spring's length.
    stretch: Vec<DVector<f64>>,
    /// Coefficients in each body's speed.
    speed: Vec<DVector<f64>>,
    /// Coefficients in each body's angle or position.
    pub(super) angle: Vec<DVector<f64>>,
    /// Indices of the states that are positions, and their rates.
    pub(super) ways: Vec<(usize, DVector<f64>)>,
    /// Indices of the speeds that are states, by body.
    pub(super) speed_place: Vec<Option<usize>>,
    /// Indices of the currents that are states, by their numbers.
    pub(super) current_place: Vec<Option<usize>>,
    /// Indices of the bristles, by body.
    pub(super) bristle_place: Vec<Option<usize>>,
    /// Number of inputs.
    inputs: usize,
    /// The quantity of each state, by which it is found in another frame.
    kinds: Vec<StateKind>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StateKind {
    Angle(usize),
    Stretch(usize),
    Speed(usize),
    Current(usize),
    Bristle(usize),
}

/// The springs between pulleys and independent rotors.
pub(super) fn gears(plant: &Mechanism) -> impl Iterator<Item = usize> + '_ {
    let is_gear = |spring: &usize| {
        let part = &plant.springs[*spring];
        part.arms.iter().any(|(body, _)| plant.bodies[*body].is_rotor)
    };
    (0..plant.springs.len()).filter(is_gear)
}

/// The pulleys, each with the first span between it and slides only, or a bridge that yaws.
fn pulleys(machine: &Machine, plant: &Mechanism) -> Vec<(usize, usize)> {
    let yaws = |body: usize| plant.ride.is_some_and(|ride| ride.yaw == body);
    let slides = |body: usize| plant.bodies[body].kind == mechanism::MotionKind::Linear || yaws(body);
    let turning = plant.held_bodies().filter(|body| !slides(*body));
    let own = |body: usize| {
        let hangs = |span: &usize| {
            let arms = &plant.springs[*span].arms;
            arms.iter().any(|arm| arm.0 == body) && arms.iter().all(|arm| arm.0 == body || slides(arm.0))
        };
        (0..machine.geometry().spans.len()).find(hangs).map(|span| (body, span))
    };
    turning.filter_map(own).collect()
}

impl Frame {
    /// Outer frame: angles and speeds of the independent bodies.
    pub(super) fn outer(machine: &Machine, plant: &Mechanism, held: &[bool], speed: f64) -> Self {
        let moving: Vec<usize> = moving(plant, held);
        let is_rotor = |body: &&usize| plant.bodies[**body].is_rotor;
        let mut kinds: Vec<StateKind> = Vec::new();
        for &j in moving.iter().filter(|body| !is_rotor(body)) {
            kinds.extend([StateKind::Angle(j), StateKind::Speed(j)]);
        }
        kinds.extend(currents(plant));
        for &j in moving.iter().filter(is_rotor) {
            kinds.extend([StateKind::Angle(j), StateKind::Speed(j)]);
        }
        kinds.extend(bristles(plant, held, speed));
        Self::new(machine, plant, kinds, false)
    }

    /// Inner frame: positions of slides and elongations, so that quantities independent of the position have
    /// coefficients of exactly zero. The outer frame if a body is held, since positions are then elongations.
    pub(super) fn inner(machine: &Machine, plant: &Mechanism, held: &[bool], speed: f64) -> Self {
        if held.contains(&true) {
            return Self::outer(machine, plant, held, speed);
        }
        let mut kinds: Vec<StateKind> =
            machine.geometry().slides.iter().map(|slide| StateKind::Angle(slide.body)).collect();
        kinds.extend(plant.ride.map(|ride| StateKind::Angle(ride.yaw)));
        let of_pulleys = pulleys(machine, plant).into_iter().filter(|(body, _)| plant.leader(*body) == *body);
        kinds.extend(of_pulleys.map(|(_, span)| StateKind::Stretch(span)));
        kinds.extend(gears(plant).map(StateKind::Stretch));
        kinds.extend(moving(plant, held).into_iter().map(StateKind::Speed));
        kinds.extend(currents(plant));
        kinds.extend(bristles(plant, held, speed));
        Self::new(machine, plant, kinds, true)
    }

    fn new(machine: &Machine, plant: &Mechanism, kinds: Vec<StateKind>, relative: bool) -> Self {
        let n = kinds.len();
        let place = |kind: StateKind| kinds.iter().position(|k| *k == kind);
        let unit = |kind: StateKind, factor: f64| {
            let mut row = DVector::zeros(n);
            if let Some(place) = place(kind) {
                row[place] = factor;
            }
            row
        };
        // A follower moves by its leader's displacement times a ratio.
        let led = |kind: fn(usize) -> StateKind, j: usize| unit(kind(plant.leader(j)), plant.ratio(j));
        let bodies = 0..plant.bodies.len();
        let speed: Vec<DVector<f64>> = bodies.clone().map(|j| led(StateKind::Speed, j)).collect();
        let along = |ways: &[DVector<f64>], spring: usize| {
            let arms = &plant.springs[spring].arms;
            arms.iter().fold(DVector::zeros(n), |sum, &(body, arm)| sum + &ways[body] * arm)
        };
        let angle: Vec<DVector<f64>>;
        let mut stretch: Vec<DVector<f64>>;
        if relative {
            let mut ways: Vec<DVector<f64>> = bodies.clone().map(|j| unit(StateKind::Angle(j), 1.0)).collect();
            stretch = (0..plant.springs.len()).map(|spring| unit(StateKind::Stretch(spring), 1.0)).collect();
            // The position of a pulley or rotor follows from its spring's length and the other bodies of that spring.
            let solved = |ways: &[DVector<f64>], stretch: &DVector<f64>, spring: usize, body: usize| {
                let arms = &plant.springs[spring].arms;
                let own = arms.iter().find(|arm| arm.0 == body).map_or(1.0, |arm| arm.1);
                let others = arms.iter().filter(|arm| arm.0 != body);
                others.fold(stretch.clone(), |sum, &(other, arm)| sum - &ways[other] * arm) / own
            };
            let pulleys = pulleys(machine, plant);
            for &(body, span) in &pulleys {
                if plant.leader(body) != body {
                    // Both pulleys are one: the elongations of the two spans are opposite.
                    stretch[span] = -stretch[pulleys[0].1].clone();
                }
                ways[body] = solved(&ways, &stretch[span], span, body);
            }
            let spans = machine.geometry().spans;
            for (span, at) in spans.iter().enumerate().filter(|(span, _)| !pulleys.iter().any(|own| own.1 == *span)) {
                let others = at.by_others.iter();
                let mut sum = others.fold(DVector::zeros(n), |sum, &(other, weight)| sum + &stretch[other] * weight);
                if let Some((yaw, ride)) = machine.yaw.zip(plant.ride) {
                    let left = machine.geometry().left_to_yaw(at.on_yaw, at.by_others);
                    sum += &ways[ride.yaw] * (yaw.arm() * left);
                }
                stretch[span] = sum;
            }
            for gear in gears(plant) {
                let rotor = plant.springs[gear].arms.iter().find(|(body, _)| plant.bodies[*body].is_rotor);
                if let Some(&(body, _)) = rotor {
                    ways[body] = solved(&ways, &stretch[gear], gear, body);
                }
            }
            // End stops, and forces along the travel.
            for (spring, own) in stretch.iter_mut().enumerate().skip(spans.len()) {
                if !gears(plant).any(|gear| gear == spring) {
                    *own = along(&ways, spring);
                }
            }
            angle = ways;
        } else {
            angle = bodies.map(|j| led(StateKind::Angle, j)).collect();
            stretch = (0..plant.springs.len()).map(|spring| along(&angle, spring)).collect();
        }
        let ways = kinds
            .iter()
            .enumerate()
            .filter_map(|(place, kind)| match *kind {
                StateKind::Angle(j) => Some((place, speed[j].clone())),
                StateKind::Stretch(j) => Some((place, along(&speed, j))),
                _ => None,
            })
            .collect();
        let variables = kinds.iter().map(|kind| match *kind {
            StateKind::Angle(j) => Variable::angle(plant, j),
            StateKind::Speed(j) => Variable::speed(plant, j),
            StateKind::Current(number) => Variable::current(machine.geometry(), plant, number),
            StateKind::Bristle(j) => {
                let part = &plant.bodies[j];
                Variable::new(format!("{}_bristle", part.label.key), part.kind.units()[0])
            }
            StateKind::Stretch(j) if gears(plant).any(|gear| gear == j) => Variable::new("twist", "rad"),
            StateKind::Stretch(_) => Variable::new("stretch", "m"),
        });
        Self {
            variables: variables.collect(),
            speed_place: (0..plant.bodies.len()).map(|j| place(StateKind::Speed(j))).collect(),
            current_place: (0..CURRENTS).map(|number| place(StateKind::Current(number))).collect(),
            bristle_place: (0..plant.bodies.len()).map(|j| place(StateKind::Bristle(j))).collect(),
            stretch,
            speed,
            angle,
            ways,
            inputs: plant.drives.len(),
            kinds,
        }
    }

    /// Coefficients of the states in a form, and those of the inputs.
    pub(super) fn row(&self, form: &Form) -> (DVector<f64>, DVector<f64>) {
        let mut row = DVector::zeros(self.variables.len());
        let stretches = self.stretch.iter().zip(form.stretch);
        for (part, factor) in stretches.chain(self.speed.iter().zip(form.speed)) {
            if factor != 0.0 {
                row += part * factor;
            }
        }
        for (place, factor) in self.current_place.iter().zip(form.current) {
            if let Some(place) = place {
                row[*place] += factor;
            }
        }
        (row, DVector::from_iterator(self.inputs, form.input.into_iter().take(self.inputs)))
    }

    /// Matrix from another frame's states to those of this one.
    pub(super) fn from(&self, other: &Frame) -> DMatrix<f64> {
        let n = self.kinds.len();
        let mut matrix = DMatrix::zeros(n, n);
        for (i, kind) in self.kinds.iter().enumerate() {
            let row = match *kind {
                StateKind::Angle(j) => other.angle[j].clone(),
                StateKind::Stretch(j) => other.stretch[j].clone(),
                StateKind::Speed(j) => other.speed[j].clone(),
                StateKind::Current(_) | StateKind::Bristle(_) => {
                    DVector::from_fn(n, |j, _| f64::from(u8::from(other.kinds[j] == *kind)))
                }
            };
            matrix.row_mut(i).copy_from(&row.transpose());
        }
        matrix
    }
}

/// Independent bodies, including rotors.
fn moving(plant: &Mechanism, held: &[bool]) -> Vec<usize> {
    plant.leaders().filter(|&j| plant.bodies[j].is_rotor || !held[j]).collect()
}

/// Currents that are states.
fn currents(plant: &Mechanism) -> impl Iterator<Item = StateKind> + '_ {
    (0..CURRENTS).filter(|number| plant.drive_of_current(*number).is_some()).map(StateKind::Current)
}

/// Bristles that are states.
fn bristles(plant: &Mechanism, held: &[bool], speed: f64) -> Vec<StateKind> {
    let forward = speed >= 0.0;
    let has = |body: &usize| {
        let friction = &plant.bodies[*body].friction;
        let v = speed.abs() / plant.bodies[*body].kind.lever();
        matches!(friction.law, Law::LuGre { .. }) && friction.dry(forward, v) > 0.0 && !held[*body]
    };
    plant.held_bodies().filter(has).map(StateKind::Bristle).collect()
}
