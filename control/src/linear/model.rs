//! The equations of a stage, linearised about steady sliding, as matrices.

use super::frame::{Frame, Variable, has_rotor};
use crate::error::{Error, Result};
use crate::friction::{Law, Motion};
use crate::machine::axis::{BODIES, ROTOR, SPANS};
use crate::machine::{BeltModel, Machine};
use crate::mechanism::{AmplifierMode, Contact, Form, Mechanism, Mode, Over, SpringLaw};
use nalgebra::{DMatrix, DVector};

/// About what a stage is linearised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operation {
    /// Speed of the cart, m/s, with which everything slides; negative is backward. Friction curves have their slope
    /// there, and bristles are bent as they are in steady sliding.
    pub speed: f64,
    /// Where the cart is, m: spans that follow it are as stiff as there, friction that changes along the travel is as
    /// there.
    pub position: f64,
    /// Which of drive pulley, cart and idler pulley are held where they are.
    pub held: [bool; 3],
}

impl Default for Operation {
    /// Everything slides forward at 0.1 m/s, the cart at x = 0.
    fn default() -> Self {
        Self { speed: 0.1, position: 0.0, held: [false; 3] }
    }
}

/// ẋ = A x + b u, y = C x + d u: small motions on top of steady sliding.
#[derive(Debug, Clone)]
pub struct StateSpace {
    /// The states x, in order.
    pub states: Vec<Variable>,
    /// The input u, before the amplifier's gain.
    pub input: Variable,
    /// The outputs y, in order.
    pub outputs: Vec<Variable>,
    /// A, 1/s and other units.
    pub a: DMatrix<f64>,
    /// b.
    pub b: DVector<f64>,
    /// C.
    pub c: DMatrix<f64>,
    /// d.
    pub d: DVector<f64>,
    /// The same system in stretches instead of positions, which loses nothing to cancellation.
    pub(super) inner: Inner,
}

/// The system in coordinates that suit the arithmetic.
#[derive(Debug, Clone)]
pub(super) struct Inner {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DVector<f64>,
    pub(super) c: DMatrix<f64>,
    /// The states of the outer system from these, and these from those.
    pub(super) outward: DMatrix<f64>,
    pub(super) inward: DMatrix<f64>,
}

impl StateSpace {
    /// The linear equations of `stage` about `operation`.
    ///
    /// Parts that work piece by piece are taken as they are in undisturbed motion: amplifier within its limits, spans
    /// taut, end stops apart, the driving flank of a gear with play in contact. A gear with losses is driven by the
    /// motor. How stiffness and friction change with the cart's place is not followed: they are what they are at the
    /// place. Fails for a place where no span can be.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::linear::{Operation, StateSpace};
    ///
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// let axis = StateSpace::of(&case.machine, Operation::default())?;
    /// assert_eq!(axis.states.len(), 6);
    /// // One integrator, and all else dies away.
    /// let poles = axis.poles()?;
    /// assert_eq!(poles.iter().filter(|p| p.norm() == 0.0).count(), 1);
    /// assert!(poles.iter().all(|p| p.re <= 0.0));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn of(machine: &Machine, operation: Operation) -> Result<Self> {
        let machine = placed(machine, operation.position)?;
        let plant = machine.mechanism();
        let held =
            std::array::from_fn(|body| plant.followers(plant.leader(body)).any(|b| b < BODIES && operation.held[b]));
        let frame = Frame::outer(&machine, &plant, held, operation.speed);
        let inner = Frame::inner(&machine, &plant, held, operation.speed);
        let mode = mode(&plant, held, operation.speed);
        let equations = Linear { machine: &machine, plant: &plant, operation, held, mode };
        let (a, b) = equations.rates(&frame);
        let (inner_a, inner_b) = equations.rates(&inner);
        let (outputs, c, d) = equations.outputs(&frame);
        let (_, inner_c, _) = equations.outputs(&inner);
        let input = match machine.drives[0].amplifier.mode {
            AmplifierMode::Voltage => Variable { name: "voltage_command", unit: "V" },
            AmplifierMode::Current => Variable { name: "current_command", unit: "A" },
        };
        Ok(Self {
            states: frame.variables.clone(),
            input,
            outputs,
            a,
            b,
            c,
            d,
            inner: Inner {
                a: inner_a,
                b: inner_b,
                c: inner_c,
                outward: frame.from(&inner),
                inward: inner.from(&frame),
            },
        })
    }

    /// Where an output of this name stands.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|output| output.name == name)
    }
}

/// The stage with its spans as stiff as they are with the cart at `x`.
fn placed(machine: &Machine, x: f64) -> Result<Machine> {
    let mut machine = machine.clone();
    if let (true, Some(make)) = (machine.belt.follows_cart, machine.belt.make) {
        let [l1, l2, _] = make.spans.three();
        if !(-l2 < x && x < l1) {
            return Err(Error::new(format!("the cart cannot be at {x} m: a span would have no length"))
                .allowed(format!("between {} m and {l1} m", -l2))
                .next("name a place between the pulleys"));
        }
        let [k1, k2] = make.stiffness_at(x);
        (machine.belt.stiffness[0], machine.belt.stiffness[1]) = (k1, k2);
    }
    Ok(machine)
}

/// The mode of steady sliding.
fn mode(plant: &Mechanism, held: [bool; 3], speed: f64) -> Mode {
    let forward = speed >= 0.0;
    let motion = (0..BODIES).map(|body| match (held[body], plant.has_modes(body), forward) {
        (true, ..) => Motion::Stuck,
        (_, false, _) => Motion::Free,
        (_, _, true) => Motion::Forward,
        (_, _, false) => Motion::Backward,
    });
    let mut mode = Mode::of(motion).with_torque(forward);
    // A force that is a line over the speed is followed, one over the way stays as it is.
    for (index, spring) in plant.springs.iter().enumerate() {
        if let SpringLaw::Line { over: Over::Rate, line } = &spring.law {
            mode.piece[index] = line.piece_at(speed) as u8;
        }
    }
    if has_rotor(plant) {
        // Between its end stops, on the driving flank of its gear.
        mode.contact[SPANS] = if forward { Contact::High } else { Contact::Low };
        if plant.has_modes(ROTOR) {
            mode.motion[ROTOR] = if forward { Motion::Forward } else { Motion::Backward };
        }
    }
    mode
}

/// The equations to be written out in a frame.
struct Linear<'a> {
    machine: &'a Machine,
    plant: &'a Mechanism,
    operation: Operation,
    held: [bool; 3],
    mode: Mode,
}

impl Linear<'_> {
    /// A and b.
    fn rates(&self, frame: &Frame) -> (DMatrix<f64>, DVector<f64>) {
        let plant = self.plant;
        let n = frame.variables.len();
        let (mut a, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let equations = plant.equations(self.mode);
        for (place, rate) in &frame.ways {
            a.row_mut(*place).copy_from(&rate.transpose());
        }
        if let Some(place) = frame.current_place {
            let (row, input) = frame.row(&equations.current_rate[0]);
            a.row_mut(place).copy_from(&row.transpose());
            b[place] = input;
        }
        for body in plant.leaders().filter(|&body| body < BODIES && !self.held[body]) {
            let Some(place) = frame.speed_place[body] else { continue };
            let (mut row, input) = frame.row(&equations.acceleration[body]);
            let mass = plant.mass(body, &equations.inertia);
            // M v̇ = what is linear − Σ ρ (what friction adds to it), of all that moves with it at ρ v
            for member in plant.followers(body) {
                let ratio = plant.ratio(member);
                let (on_speed, on_bristle) = self.friction(member);
                row[place] -= ratio * ratio * on_speed / mass;
                if let Some(bristle) = frame.bristle_place[member] {
                    row[bristle] -= ratio * on_bristle / mass;
                    let [on_speed, on_bristle] = self.bristle(member);
                    (a[(bristle, place)], a[(bristle, bristle)]) = (ratio * on_speed, on_bristle);
                }
            }
            a.row_mut(place).copy_from(&row.transpose());
            b[place] = input;
        }
        if let Some(place) = frame.speed_place[ROTOR] {
            let (row, input) = frame.row(&equations.acceleration[ROTOR]);
            a.row_mut(place).copy_from(&row.transpose());
            b[place] = input;
        }
        (a, b)
    }

    /// Speed of a body, in its own unit.
    fn speed(&self, body: usize) -> f64 {
        self.operation.speed / self.plant.bodies[body].kind.lever()
    }

    /// By what the dry friction of a body is multiplied where the cart is.
    fn factor(&self, body: usize) -> f64 {
        self.plant.bodies[body].along.as_ref().map_or(1.0, |along| along.value(self.operation.position))
    }

    /// ∂F_f/∂v of a body's own friction beyond the viscous friction that stands in the equations, and ∂F_f/∂z of a
    /// bristle.
    fn friction(&self, body: usize) -> (f64, f64) {
        let friction = &self.plant.bodies[body].friction;
        let v = self.speed(body);
        let side = friction.side(v >= 0.0);
        let viscous = match self.mode.motion[body] {
            Motion::Backward => friction.backward.viscous,
            _ => friction.forward.viscous,
        };
        match friction.law {
            Law::LuGre { stiffness, damping, .. } if friction.dry(v >= 0.0, v.abs()) > 0.0 => {
                // F_f = σ₀ z + σ₁ ż + b v
                let [on_speed, on_bristle] = self.bristle(body);
                (damping * on_speed + side.viscous - viscous, stiffness + damping * on_bristle)
            }
            // F_f = b v ± a(x) dry(|v|)
            _ => (side.viscous - viscous + self.factor(body) * (friction.slope(v) - side.viscous), 0.0),
        }
    }

    /// ∂ż/∂v and ∂ż/∂z of the bristles of a body.
    fn bristle(&self, body: usize) -> [f64; 2] {
        let friction = &self.plant.bodies[body].friction;
        let Law::LuGre { stiffness, .. } = friction.law else { return [0.0; 2] };
        let v = self.speed(body);
        if v == 0.0 {
            // At rest ż = v.
            return [1.0, 0.0];
        }
        let factor = self.factor(body);
        let g = factor * friction.dry(v >= 0.0, v.abs());
        let slope = factor * (friction.slope(v) - friction.side(v >= 0.0).viscous);
        // ż = v − σ₀ |v| z / g(|v|) about z = ± g/σ₀: ∂ż/∂v = |v| g′/g, ∂ż/∂z = −σ₀ |v|/g
        [v.abs() * slope / g, -stiffness * v.abs() / g]
    }

    /// The outputs, C and d.
    fn outputs(&self, frame: &Frame) -> (Vec<Variable>, DMatrix<f64>, DVector<f64>) {
        let plant = self.plant;
        let mut all: Vec<(Variable, DVector<f64>, f64)> = Vec::new();
        let mut add = |name, unit, (row, input)| all.push((Variable { name, unit }, row, input));
        const NAMES: [[(&str, &str); 2]; 3] = [
            [("drive_angle", "rad"), ("drive_speed", "rad/s")],
            [("cart_position", "m"), ("cart_speed", "m/s")],
            [("idler_angle", "rad"), ("idler_speed", "rad/s")],
        ];
        let moving = |body: &usize| !self.held[*body];
        for body in (0..BODIES).filter(moving) {
            let [(angle, unit), _] = NAMES[body];
            add(angle, unit, (frame.angle[body].clone(), 0.0));
        }
        if has_rotor(plant) {
            add("rotor_angle", "rad", (frame.angle[ROTOR].clone(), 0.0));
        }
        for body in (0..BODIES).filter(moving) {
            let [_, (speed, unit)] = NAMES[body];
            add(speed, unit, frame.row(&Form::speed(body)));
        }
        if has_rotor(plant) {
            add("rotor_speed", "rad/s", frame.row(&Form::speed(ROTOR)));
        }
        if self.machine.belt.model != BeltModel::Rigid {
            for (span, name) in ["span1_force", "span2_force", "span3_force"].into_iter().enumerate() {
                let alike = self.machine.span_alike(span).unwrap_or(span);
                add(name, "N", frame.row(&plant.spring_force(alike, &self.mode)));
            }
        }
        if has_rotor(plant) {
            add("gear_torque", "N m", frame.row(&plant.spring_force(SPANS, &self.mode)));
        }
        add("motor_current", "A", frame.row(&plant.current(0, &self.mode)));
        let c = DMatrix::from_fn(all.len(), frame.variables.len(), |i, j| all[i].1[j]);
        let d = DVector::from_fn(all.len(), |i, _| all[i].2);
        (all.into_iter().map(|(variable, ..)| variable).collect(), c, d)
    }
}
