//! State variables of the solvers, and their indices.
//!
//! A force of k (r φ₁ − x) computed from positions carries the rounding of those positions times k. With the elongation
//! as a state it carries only the rounding of the elongation, at any distance from the origin. So the lengths of
//! springs between a pulley and other bodies replace the pulleys' angles, as long as they are independent; positions of
//! sliding bodies count from the start of the run. For the axis, c = A′ q:
//!
//! ```text
//! c = (r φ₁ − x,  x − x₀,  x − r φ₃,  φ_r − φ₁)
//! ```

use super::{BODIES, CURRENTS, DRIVES, Form, Mechanism, MotionKind, SPRINGS, SpringLaw, State};

/// Coefficients up to this fraction of those they come from are zero except for rounding.
const NOTHING: f64 = 1e-12;

/// A spring's length that replaces a body's position.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Replaced {
    /// The body.
    pub body: usize,
    /// Its arm.
    pub own: f64,
    /// The arms of the others.
    pub others: Vec<(usize, f64)>,
    /// True if one of them is replaced itself.
    pub on_replaced: bool,
}

/// Indices of the quantities in the solvers' state.
#[derive(Debug, Clone)]
pub struct Layout {
    bodies: usize,
    /// The yaw of a bridge, whose angle counts from zero: springs depend on it by itself.
    yaw: Option<usize>,
    /// Lengths that replace positions, each after those that it needs.
    pub replaced: Vec<Replaced>,
    /// Every spring's length from the coordinates: (spring, body of the coordinate, weight).
    terms: Vec<(usize, usize, f64)>,
    /// Index of each body's coordinate.
    pub coordinate: [usize; BODIES],
    /// Index of each body's speed.
    pub speed: [usize; BODIES],
    /// Index of each current that is a state.
    pub current: [Option<usize>; CURRENTS],
    /// Number of states.
    pub states: usize,
    /// Number of inputs.
    pub inputs: usize,
}

impl Layout {
    /// Layout of a mechanism: bodies in their order, each with its coordinate and its speed, then the currents, then
    /// rotors.
    pub fn new(mechanism: &Mechanism) -> Self {
        let bodies = mechanism.bodies.len();
        let held = mechanism.held_bodies().len();
        let (mut current, mut currents) = ([None; CURRENTS], 0);
        for (number, place) in current.iter_mut().enumerate() {
            if mechanism.drive_of_current(number).is_some() {
                *place = Some(2 * held + currents);
                currents += 1;
            }
        }
        let place = |body: usize| 2 * body + if body < held { 0 } else { currents };
        let mut layout = Self {
            bodies,
            yaw: mechanism.ride.map(|ride| ride.yaw),
            replaced: Vec::new(),
            terms: Vec::new(),
            coordinate: std::array::from_fn(place),
            speed: std::array::from_fn(|body| place(body) + 1),
            current,
            states: 2 * bodies + currents,
            inputs: mechanism.drives.len(),
        };
        // Rows used as coordinates, by the body that they replace.
        let mut taken: [Option<[f64; BODIES]>; BODIES] = [None; BODIES];
        let mut weights = Vec::new();
        for spring in &mechanism.springs {
            let mut row = [0.0; BODIES];
            for &(body, arm) in &spring.arms {
                row[body] += arm;
            }
            let size: f64 = row.iter().map(|arm| arm.abs()).sum();
            let (mut left, mut weight) = (row, [0.0; BODIES]);
            // Remainder of the row after subtraction of the lengths used so far, by their weights.
            while let Some((body, by)) = (0..bodies).find_map(|b| taken[b].filter(|_| left[b] != 0.0).map(|by| (b, by)))
            {
                let factor = left[body] / by[body];
                weight[body] += factor;
                for (left, by) in left.iter_mut().zip(by) {
                    *left -= factor * by;
                    if left.abs() <= NOTHING * size {
                        *left = 0.0;
                    }
                }
                left[body] = 0.0;
            }
            // The yaw of a bridge is a coordinate by itself.
            let turns = |&b: &usize| {
                left[b] != 0.0 && matches!(mechanism.bodies[b].kind, MotionKind::Rotary { .. }) && layout.yaw != Some(b)
            };
            match (0..bodies).find(turns) {
                // The row becomes a coordinate and replaces a pulley that hangs on it.
                Some(body) if spring.arms.len() > 1 => {
                    taken[body] = Some(row);
                    let others = spring.arms.iter().copied().filter(|&(other, _)| other != body).collect::<Vec<_>>();
                    let on_replaced = others.iter().any(|&(other, _)| taken[other].is_some());
                    layout.replaced.push(Replaced { body, own: row[body], others, on_replaced });
                    weight = [0.0; BODIES];
                    weight[body] = 1.0;
                }
                _ => (0..bodies).for_each(|b| weight[b] += left[b]),
            }
            weights.push(weight);
        }
        for (spring, weight) in weights.iter().enumerate() {
            // A stepper's angle depends on everything that its belt moves; the exact solver, which has no steppers,
            // assumes two.
            let most = if matches!(mechanism.springs[spring].law, SpringLaw::Angle { .. }) { BODIES } else { 2 };
            let count = weight.iter().filter(|weight| **weight != 0.0).count();
            assert!(count <= most, "a length of {most} coordinates at most");
            layout.terms.extend((0..bodies).filter(|&b| weight[b] != 0.0).map(|b| (spring, b, weight[b])));
        }
        layout
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.bodies
    }

    /// Lengths of the springs in a state in these coordinates.
    #[inline]
    pub fn stretches(&self, inner: &State) -> [f64; SPRINGS] {
        let mut stretch = [0.0; SPRINGS];
        for &(spring, body, weight) in &self.terms {
            stretch[spring] += weight * inner.position[body];
        }
        stretch
    }

    /// Value of a form in a state in these coordinates.
    #[inline]
    pub fn value(&self, form: &Form, inner: &State, input: &[f64; DRIVES]) -> f64 {
        form.value_at(&self.stretches(inner), inner, input)
    }

    /// Coefficients of a form in these coordinates.
    pub(crate) fn on_coordinates(&self, form: &Form) -> State {
        let mut row = State { position: [0.0; BODIES], speed: form.speed, current: form.current };
        for &(spring, body, weight) in &self.terms {
            row.position[body] += form.stretch[spring] * weight;
        }
        row
    }

    /// Writes a form into a row: lengths, speeds and currents at their indices.
    #[inline]
    pub fn put(&self, form: &Form, row: &mut [f64]) {
        for body in 0..self.bodies {
            row[self.speed[body]] = form.speed[body];
        }
        for &(spring, body, weight) in &self.terms {
            row[self.coordinate[body]] += form.stretch[spring] * weight;
        }
        for (place, current) in self.current.iter().zip(form.current) {
            if let Some(place) = place {
                row[*place] = current;
            }
        }
    }

    /// Elongation of a spring per unit of each coordinate: (body of the coordinate, weight).
    pub fn weights(&self, spring: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.terms.iter().filter(move |term| term.0 == spring).map(|&(_, body, weight)| (body, weight))
    }

    /// True if a length replaces this body's position.
    pub fn is_replaced(&self, body: usize) -> bool {
        self.replaced.iter().any(|replaced| replaced.body == body)
    }

    /// Origin of the positions in a run that begins in `start`.
    pub fn origin(&self, start: &State) -> [f64; BODIES] {
        let counts = |b: usize| b < self.bodies && !self.is_replaced(b) && self.yaw != Some(b);
        std::array::from_fn(|b| if counts(b) { start.position[b] } else { 0.0 })
    }

    /// Difference between a spring's length and that from its coordinates, for positions counted from `origin`.
    pub fn shift(&self, spring: usize, origin: &[f64; BODIES]) -> f64 {
        self.weights(spring).map(|(body, weight)| weight * origin[body]).sum()
    }

    /// The form of a coordinate's rate: a speed, or the rate of a spring's length.
    pub fn rate(&self, mechanism: &Mechanism, body: usize) -> Form {
        match self.replaced.iter().find(|replaced| replaced.body == body) {
            None => Form::speed(body),
            Some(replaced) => {
                let together = |&(other, _): &(usize, f64)| mechanism.leader(other) == mechanism.leader(body);
                if replaced.others.iter().all(together) {
                    return Form::ZERO;
                }
                let mut rate = Form::speed(body) * replaced.own;
                for &(other, arm) in &replaced.others {
                    rate.speed[other] += arm;
                }
                rate
            }
        }
    }
}
