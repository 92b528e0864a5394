//! Equations of a machine, linearised about steady sliding, as matrices.

use super::frame::{Frame, Variable, gears};
use crate::error::{Error, Result};
use crate::friction::{Law, Motion};
use crate::machine::{BeltMake, BeltModel, Geometry, Machine};
use crate::mechanism::{AmplifierMode, BODIES, Contact, Drive, Form, Mechanism, Mode, Over, Phases, SpringLaw};
use crate::number::engineering;
use nalgebra::{DMatrix, DVector};

/// Operating point of a linearisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operation {
    /// Speed at the belt, m/s, with which everything slides; negative is backward. Friction curves contribute their
    /// slope at this speed, and bristles have their steady deflection.
    pub speed: f64,
    /// Position of the cart, m, which determines the stiffness of following spans and friction along the travel.
    pub position: f64,
    /// Position of the bridge, m, if any.
    pub bridge: f64,
    /// True for held bodies, by their numbers.
    pub held: [bool; 6],
}

impl Operation {
    /// Slides at these positions, m, in the order of the geometry, with everything sliding forward.
    pub fn at(slides: &[f64]) -> Self {
        let own = Self::default();
        match slides {
            [bridge, cart] => Self { position: *cart, bridge: *bridge, ..own },
            [cart] => Self { position: *cart, ..own },
            _ => own,
        }
    }

    /// Position of each sliding part of `machine`, m, in the order of its geometry.
    pub(super) fn coordinates(&self, machine: &Machine) -> Vec<f64> {
        machine.bridge.iter().map(|_| self.bridge).chain([self.position]).collect()
    }
}

impl Default for Operation {
    /// Everything slides forward at 0.1 m/s, with all slides at position zero.
    fn default() -> Self {
        Self { speed: 0.1, position: 0.0, bridge: 0.0, held: [false; 6] }
    }
}

// One element for each body. With `[bool; BODIES]` in the struct the compiler fails where a closure of another crate
// copies it.
const _: () = assert!(BODIES == 6);

/// ẋ = A x + B u, y = C x + D u: small motions on top of steady sliding, with an input for each drive.
#[derive(Debug, Clone)]
pub struct System {
    /// The states x, in order.
    pub states: Vec<Variable>,
    /// The inputs u, before the amplifiers' gains, in the order of the drives.
    pub inputs: Vec<Variable>,
    /// The outputs y, in order.
    pub outputs: Vec<Variable>,
    /// A, 1/s and other units.
    pub a: DMatrix<f64>,
    /// B.
    pub b: DMatrix<f64>,
    /// C.
    pub c: DMatrix<f64>,
    /// D.
    pub d: DMatrix<f64>,
    /// The system in elongations instead of positions, which avoids cancellation.
    inner: Inner<DMatrix<f64>>,
}

/// ẋ = A x + b u, y = C x + d u: the system of one input.
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
    /// The system in elongations instead of positions, which avoids cancellation.
    pub(super) inner: Inner<DVector<f64>>,
}

/// The system in coordinates that suit the arithmetic.
#[derive(Debug, Clone)]
pub(super) struct Inner<B> {
    pub(super) a: DMatrix<f64>,
    pub(super) b: B,
    pub(super) c: DMatrix<f64>,
    /// Transformations to and from the states of the outer system.
    pub(super) outward: DMatrix<f64>,
    pub(super) inward: DMatrix<f64>,
}

impl System {
    /// Linear equations of `machine` about `operation`, for all inputs; [`StateSpace::new`] has those of the first
    /// input alone.
    ///
    /// ```
    /// use taut::case::Case;
    /// use taut::linear::{Operation, System};
    /// let case = Case::read("../stages/core-xy/core-xy.toml")?;
    /// let gantry = System::new(&case.machine, Operation::default())?;
    /// assert_eq!(gantry.inputs.len(), 2);
    /// // Motors A and B pull the cart along y in opposite ways, and the bridge along x alike.
    /// let rate = |output: &str, input: usize| gantry.input(input).output(output).unwrap();
    /// assert_eq!(rate("bridge_position", 0), rate("bridge_position", 1));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(machine: &Machine, operation: Operation) -> Result<Self> {
        let machine = placed(machine, operation)?;
        let plant = machine.mechanism();
        within_supply(&machine, &plant, operation.speed)?;
        let bodies = plant.held_bodies();
        let is_held =
            |body: usize| plant.followers(plant.leader(body)).any(|b| bodies.contains(&b) && operation.held[b]);
        let held: Vec<bool> = bodies.clone().map(is_held).collect();
        let frame = Frame::outer(&machine, &plant, &held, operation.speed);
        let inner = Frame::inner(&machine, &plant, &held, operation.speed);
        let mode = mode(&plant, &held, operation.speed);
        let equations = Linear { machine: &machine, plant: &plant, operation, held, mode };
        let (a, b) = equations.rates(&frame);
        let (inner_a, inner_b) = equations.rates(&inner);
        let (outputs, c, d) = equations.outputs(&frame);
        let (_, inner_c, _) = equations.outputs(&inner);
        let input = |(at, unit): (&crate::machine::DriveAt, &crate::machine::DriveUnit)| match unit.amplifier.mode {
            AmplifierMode::Voltage => Variable::new(format!("{}voltage_command", at.prefix), "V"),
            AmplifierMode::Current => Variable::new(format!("{}current_command", at.prefix), "A"),
            AmplifierMode::Position => Variable::new(format!("{}position_command", at.prefix), "m"),
        };
        Ok(Self {
            states: frame.variables.clone(),
            inputs: machine.geometry().drives.iter().zip(&machine.drives).map(input).collect(),
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

    /// ∏ over all masses, over inductances (resistances without one) and over the lengths of spans that follow the
    /// cart: what the coefficients of `machine`'s equations have in their denominators.
    pub(crate) fn denominator(machine: &Machine, operation: Operation) -> f64 {
        let lengths = machine.span_lengths(&operation.coordinates(machine));
        let plant = machine.mechanism();
        let held = vec![false; plant.held_bodies().len()];
        let equations = plant.equations(mode(&plant, &held, operation.speed));
        let masses: f64 = plant.leaders().map(|body| plant.mass(body, &equations.inertia)).product();
        let winding = |drive: &Drive| match drive.motor.inductance {
            0.0 => drive.motor.resistance,
            inductance => inductance,
        };
        let windings: f64 = plant.drives.iter().map(winding).filter(|value| *value != 0.0).product();
        masses * windings * lengths.map_or(1.0, |lengths| lengths.into_iter().product())
    }

    /// The system of one input, with zero for the others.
    ///
    /// # Panics
    ///
    /// If there is no input of this number.
    pub fn input(&self, input: usize) -> StateSpace {
        self.clone().into_input(input)
    }

    /// The system with one input only; consumes the system.
    fn into_input(self, input: usize) -> StateSpace {
        let System { states, inputs, outputs, a, b, c, d, inner } = self;
        let column = |matrix: &DMatrix<f64>| matrix.column(input).into_owned();
        StateSpace {
            states,
            input: inputs[input].clone(),
            outputs,
            a,
            b: column(&b),
            c,
            d: column(&d),
            inner: Inner { a: inner.a, b: column(&inner.b), c: inner.c, outward: inner.outward, inward: inner.inward },
        }
    }
}

impl StateSpace {
    /// The linear equations of `machine` about `operation`, with its first drive's input.
    ///
    /// Piecewise linear parts have their case in undisturbed motion: amplifier within its limits, spans taut, end stops
    /// open, the driving flank of a gear with play in contact. A lossy gear is driven by the motor. Steppers turn at
    /// the steady speed without load ([`Steady`](crate::mechanism::Steady)). Stiffness and friction have their values
    /// at the operating point; their derivatives along the travel are not included. Errors: a position at which a span
    /// would have no length.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::linear::{Operation, StateSpace};
    ///
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// let axis = StateSpace::new(&case.machine, Operation::default())?;
    /// assert_eq!(axis.states.len(), 6);
    /// // One integrator, and all else dies away.
    /// let poles = axis.poles()?;
    /// assert_eq!(poles.iter().filter(|p| p.norm() == 0.0).count(), 1);
    /// assert!(poles.iter().all(|p| p.re <= 0.0));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(machine: &Machine, operation: Operation) -> Result<Self> {
        Ok(System::new(machine, operation)?.into_input(0))
    }

    /// Index of the output with this name.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|output| output.name == name)
    }
}

/// Rejects a speed at which the supply of a stepper does not suffice for its currents.
fn within_supply(machine: &Machine, plant: &Mechanism, speed: f64) -> Result<()> {
    let is_limited = |drive: &Drive| {
        let turning = speed / plant.bodies[drive.shaft].kind.lever();
        Phases::new(drive).is_some_and(|phases| phases.without_load(turning).is_none())
    };
    if !plant.drives.iter().any(is_limited) {
        return Ok(());
    }
    let supply = machine.drives[0].amplifier.voltage_limit.unwrap_or(f64::INFINITY);
    let [supply, speed] = [engineering(supply, "V", 4), engineering(speed, "m/s", 4)];
    let what = format!("at {speed} the supply of {supply} does not suffice for the currents of the stepper");
    Err(Error::new(what)
        .in_file("--speed")
        .allowed("a speed at which it does: beyond that there is no linear model")
        .next("choose a lower --speed, or 0 for rest on a full step; or raise stepper.supply"))
}

/// The machine with the span lengths of the operating point. Errors: a position at which a span would have no length.
pub fn placed(machine: &Machine, operation: Operation) -> Result<Machine> {
    let slides = machine.geometry().slides;
    let at = operation.coordinates(machine);
    let Some((make, lengths)) = machine.belt.following().zip(machine.span_lengths(&at)) else {
        return Ok(machine.clone());
    };
    if lengths.iter().any(|length| length.is_nan() || *length <= 0.0) {
        let name = |body: usize| machine.geometry().label(body).name;
        let places = slides.iter().zip(&at).map(|(slide, at)| format!("the {} at {at} m", name(slide.body)));
        let places = places.collect::<Vec<_>>().join(" and ");
        let error = Error::new(format!("with {places} a span would have no length"));
        let error = match slides {
            [_] => error.allowed(within(machine.geometry(), &make)),
            _ => error,
        };
        return Err(error.next("name a place on the travel, between the pulleys"));
    }
    Ok(machine.with_spans_held(&at))
}

/// Possible positions of the only slide, in words, for positive span lengths.
fn within(geometry: &Geometry, make: &BeltMake) -> String {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for (length, span) in make.spans.into_iter().zip(geometry.spans) {
        for (_, arm) in span.follows {
            // l + arm x > 0
            match *arm > 0.0 {
                true => low = low.max(-length / arm),
                false => high = high.min(-length / arm),
            }
        }
    }
    format!("between {low} m and {high} m")
}

/// The mode of steady sliding.
fn mode(plant: &Mechanism, held: &[bool], speed: f64) -> Mode {
    let forward = speed >= 0.0;
    let motion = plant.held_bodies().map(|body| match (held[body], plant.has_modes(body), forward) {
        (true, ..) => Motion::Stuck,
        (_, false, _) => Motion::Free,
        (_, _, true) => Motion::Forward,
        (_, _, false) => Motion::Backward,
    });
    let mut mode = Mode::new(motion).with_torque(forward);
    // A piecewise linear force over speed is linearised, one over position stays constant.
    for (index, spring) in plant.springs.iter().enumerate() {
        if let SpringLaw::Line { over: Over::Rate, line } = &spring.law {
            mode.piece[index] = line.piece_at(speed) as u8;
        }
    }
    for gear in gears(plant) {
        // Between its end stops, on the driving flank of its gear.
        mode.contact[gear] = if forward { Contact::High } else { Contact::Low };
    }
    for rotor in plant.held_bodies().end..plant.bodies.len() {
        if plant.has_modes(rotor) {
            mode.motion[rotor] = if forward { Motion::Forward } else { Motion::Backward };
        }
    }
    mode
}

/// Equations to be expressed in a frame.
struct Linear<'a> {
    machine: &'a Machine,
    plant: &'a Mechanism,
    operation: Operation,
    held: Vec<bool>,
    mode: Mode,
}

impl Linear<'_> {
    /// A and B.
    fn rates(&self, frame: &Frame) -> (DMatrix<f64>, DMatrix<f64>) {
        let plant = self.plant;
        let n = frame.variables.len();
        let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, plant.drives.len()));
        let mut equations = plant.equations(self.mode);
        for (drive, part) in plant.drives.iter().enumerate() {
            let speed = if self.holds(part.shaft) { 0.0 } else { self.speed(part.shaft) };
            let Some(steady) = plant.steady(drive, speed) else { continue };
            let (leader, first) = (plant.leader(part.shaft), plant.first_current(drive));
            // M v̇ = … + ρ τ
            let mass = plant.mass(leader, &equations.inertia);
            let own = equations.acceleration[leader];
            equations.acceleration[leader] = own + steady.torque * (plant.ratio(part.shaft) / mass);
            equations.current_rate[first..first + 2].copy_from_slice(&steady.rates);
        }
        for (place, rate) in &frame.ways {
            a.row_mut(*place).copy_from(&rate.transpose());
        }
        let mut put = |a: &mut DMatrix<f64>, place: usize, (row, input): (DVector<f64>, DVector<f64>)| {
            a.row_mut(place).copy_from(&row.transpose());
            b.row_mut(place).copy_from(&input.transpose());
        };
        for (number, place) in frame.current_place.iter().enumerate() {
            if let Some(place) = place {
                put(&mut a, *place, frame.row(&equations.current_rate[number]));
            }
        }
        for body in plant.leaders().filter(|body| plant.bodies[*body].is_rotor || !self.held[*body]) {
            let Some(place) = frame.speed_place[body] else { continue };
            let (mut row, input) = frame.row(&equations.acceleration[body]);
            if plant.bodies[body].is_rotor {
                put(&mut a, place, (row, input));
                continue;
            }
            let mass = plant.mass(body, &equations.inertia);
            // M v̇ = linear forces − Σ ρ (friction beyond them) of all followers, which move at ρ v
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
            put(&mut a, place, (row, input));
        }
        self.ride(frame, &mut a, &mut b);
        (a, b)
    }

    /// Couples the accelerations of bridge and yaw by the cart, for a bridge without yaw about the cart's position y.
    fn ride(&self, frame: &Frame, a: &mut DMatrix<f64>, b: &mut DMatrix<f64>) {
        let Some(ride) = self.plant.ride else { return };
        let Some(yaw) = frame.speed_place[ride.yaw] else { return };
        let bridge = frame.speed_place[ride.bridge];
        let inertia = |body: usize| self.plant.bodies[body].inertia;
        let (m, whole, turned, y) =
            (inertia(ride.cart), inertia(ride.bridge), inertia(ride.yaw), self.operation.position);
        // M ẍ + m y ψ̈ = M a_x, (I + m y²) ψ̈ + m y ẍ = I a_ψ; a bridge that is held does not accelerate.
        let free = if bridge.is_some() { m / whole } else { 0.0 };
        let whole_turned = turned + m * y * y * (1.0 - free);
        for matrix in [a, b] {
            let of_yaw = matrix.row(yaw) * (turned / whole_turned);
            let of_bridge = bridge.map_or_else(|| of_yaw.clone() * 0.0, |bridge| matrix.row(bridge) * 1.0);
            let turning = of_yaw - &of_bridge * (m * y / whole_turned);
            if let Some(bridge) = bridge {
                matrix.set_row(bridge, &(of_bridge - &turning * (m * y / whole)));
            }
            matrix.set_row(yaw, &turning);
        }
    }

    /// True if a body is held.
    fn holds(&self, body: usize) -> bool {
        self.held.get(body).is_some_and(|held| *held)
    }

    /// Speed of a body, in its own unit.
    fn speed(&self, body: usize) -> f64 {
        self.operation.speed / self.plant.bodies[body].kind.lever()
    }

    /// Factor on the dry friction of a body at the position of the cart.
    fn factor(&self, body: usize) -> f64 {
        self.plant.bodies[body].along.as_ref().map_or(1.0, |along| along.value(self.operation.position))
    }

    /// ∂F_f/∂v of a body's own friction beyond the viscous friction in the equations, and ∂F_f/∂z of a bristle.
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

    /// The outputs, C and D.
    fn outputs(&self, frame: &Frame) -> (Vec<Variable>, DMatrix<f64>, DMatrix<f64>) {
        let (plant, geometry) = (self.plant, self.machine.geometry());
        let drives = plant.drives.len();
        let mut all: Vec<(Variable, DVector<f64>, DVector<f64>)> = Vec::new();
        let mut add = |variable, (row, input)| all.push((variable, row, input));
        let moving = || plant.held_bodies().filter(|body| !self.held[*body]);
        let rotors = || plant.held_bodies().end..plant.bodies.len();
        for body in moving().chain(rotors()) {
            add(Variable::angle(plant, body), (frame.angle[body].clone(), DVector::zeros(drives)));
        }
        for body in moving().chain(rotors()) {
            add(Variable::speed(plant, body), frame.row(&Form::speed(body)));
        }
        if self.machine.belt.model != BeltModel::Rigid {
            for (span, at) in geometry.spans.iter().enumerate() {
                let alike = self.machine.span_alike(span).unwrap_or(span);
                let force = Variable::new(format!("{}_force", at.column), "N");
                add(force, frame.row(&plant.spring_force(alike, &self.mode)));
            }
        }
        for gear in gears(plant) {
            let torque = Variable::new(format!("{}_torque", plant.springs[gear].label.key), "N m");
            add(torque, frame.row(&plant.spring_force(gear, &self.mode)));
        }
        for drive in 0..drives {
            let first = plant.first_current(drive);
            add(Variable::current(geometry, plant, first), frame.row(&plant.current(drive, &self.mode)));
            if plant.drives[drive].windings() > 1 {
                add(Variable::current(geometry, plant, first + 1), frame.row(&Form::current(first + 1)));
            }
        }
        let c = DMatrix::from_fn(all.len(), frame.variables.len(), |i, j| all[i].1[j]);
        let d = DMatrix::from_fn(all.len(), drives, |i, j| all[i].2[j]);
        (all.into_iter().map(|(variable, ..)| variable).collect(), c, d)
    }
}
