//! The states of each part, the equations that follow from them, and the conditions under which they go on.

use crate::curve::{self, CurveKind, Curved, Ramp};
use crate::double::Double;
use crate::machine::{
    BODIES, BRISTLE, CURRENT, Curve, DRIVES, Drive, Ends, Flanks, Line, Model, Play, ROTOR, SPANS, SPEED, STATES,
    State, WAY,
};
use crate::root::Polynomial;
use crate::series::{Form, Rates, Row};

/// The motion of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Motion {
    /// Slides in the negative direction.
    Backward,
    /// At rest, held by friction.
    Stuck,
    /// Slides in the positive direction.
    Forward,
    /// Without dry friction.
    Free,
}

/// State of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Limit {
    /// At the negative limit.
    Low,
    /// Within.
    Within,
    /// At the positive limit.
    High,
}

/// Which of two flanks carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Touch {
    /// The lower or the upper one (0, 1).
    Carries(usize),
    /// It is within reach, and its damper holds it back.
    Loose(usize),
    /// Neither.
    Apart,
}

/// The state of every part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Mode {
    /// Each body. One whose friction never lets it rest has a direction, too.
    pub motion: [Motion; BODIES],
    /// True if the torque that each motor hands to its gear is positive.
    pub gear_positive: [bool; DRIVES],
    /// Spans.
    pub slack: [bool; SPANS],
    /// Gears with backlash.
    pub gear: [Touch; DRIVES],
    /// End stops.
    pub stop: [Touch; BODIES],
    /// Points passed of the forces over the cart's position and speed, and of its friction over its position.
    pub passed: [usize; 3],
    /// Voltage limits.
    pub voltage: [Limit; DRIVES],
    /// Current limits.
    pub current: [Limit; DRIVES],
}

/// The change that follows where a condition fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The voltage limit of a drive.
    Voltage(usize, Limit),
    /// The current limit of a drive.
    Current(usize, Limit),
    /// The torque through the gear of a drive changes its sign.
    GearSign(usize),
    /// A span goes slack or taut.
    Span(usize, bool),
    /// Flanks of the gear of a drive.
    Gear(usize, Touch),
    /// End stops of a body.
    Stop(usize, Touch),
    /// As many points of a line are passed.
    Passed(usize, usize),
    /// A body leaves its travel.
    Leave,
    /// A body that friction never lets rest turns back.
    Turn(usize),
    /// A sliding body comes to rest.
    Rest(usize),
    /// A body at rest breaks away.
    Break(usize, Motion),
}

/// A condition: it holds while the form is not negative.
#[derive(Debug, Clone)]
pub struct Guard {
    /// The sum that must not become negative.
    pub row: Row,
    /// The change that follows where it does.
    pub change: Change,
}

/// The equations of a mode.
#[derive(Debug, Clone)]
pub struct Law {
    /// Rates of the states.
    pub rates: Rates,
    /// Conditions: first those of limits, gear, spans and stops, then those of the bodies. In this order they settle at
    /// one instant: a
    /// body breaks away under the load that there is, not under one that a limit or a slack span takes away at once.
    pub guards: Vec<Guard>,
    /// The current of each drive.
    currents: Vec<Row>,
}

/// Tolerance of an FMU for model exchange for speeds at zero, 1e-9 rad/s or m/s, over the 2⁻⁴⁰ of its unit by
/// which every condition falls later (docs/fmu.md).
const FORGIVEN: f64 = 1e-9 * (1_u64 << 40) as f64;

impl Change {
    /// Size along the belt of one SI unit of its condition: the lever for 1 rad or rad/s, its inverse for 1 N m.
    fn unit(self, machine: &Model, mode: &Mode) -> Double {
        let flank = |lever: Double, now: Touch, then: Touch| match (now, then) {
            (Touch::Carries(_), Touch::Loose(_)) | (Touch::Loose(_), Touch::Carries(_)) => Double::ONE / lever,
            _ => lever,
        };
        match self {
            Change::Voltage(..) | Change::Current(..) | Change::Span(..) | Change::Passed(..) | Change::Leave => {
                Double::ONE
            }
            Change::GearSign(drive) => Double::ONE / machine.lever[machine.drives[drive].body],
            Change::Gear(drive, then) => flank(machine.lever[machine.drives[drive].body], mode.gear[drive], then),
            Change::Stop(body, then) => flank(machine.lever[body], mode.stop[body], then),
            Change::Turn(body) | Change::Rest(body) => Double::from(1.0 + FORGIVEN) * machine.lever[body],
            Change::Break(body, _) => Double::ONE / machine.lever[body],
        }
    }
}

impl Limit {
    fn sign(self) -> f64 {
        match self {
            Limit::Low => -1.0,
            Limit::Within => 0.0,
            Limit::High => 1.0,
        }
    }
}

fn way(body: usize) -> Form {
    Form::state(WAY[body])
}

fn speed(body: usize) -> Form {
    Form::state(SPEED[body])
}

fn sign(value: f64) -> Double {
    Double::from(value)
}

/// The equations under construction.
struct Builder<'a> {
    machine: &'a Model,
    mode: Mode,
    parts: Vec<(Form, Change)>,
    bodies: Vec<(Form, Change)>,
    curved: Vec<Curved>,
    currents: Vec<Row>,
}

impl Law {
    /// The equations of `machine` in `mode`.
    pub fn new(machine: &Model, mode: Mode) -> Self {
        let mut builder =
            Builder { machine, mode, parts: Vec::new(), bodies: Vec::new(), curved: Vec::new(), currents: Vec::new() };
        let rates = builder.rates();
        let Builder { parts, bodies, curved, currents, .. } = builder;
        let guards = parts.into_iter().chain(bodies).map(|(form, change)| {
            let later = Form::constant(change.unit(machine, &mode) * machine.delayed);
            Guard { row: Row::from(form + later), change }
        });
        Self { guards: guards.collect(), rates: Rates::new(&rates, curved), currents }
    }

    /// The current of a drive in the state `z` under these terms of the inputs.
    pub fn current(&self, drive: usize, z: &State, inputs: &[Polynomial; DRIVES]) -> Double {
        self.currents[drive].value(z, inputs)
    }
}

impl Builder<'_> {
    fn rates(&mut self) -> [Form; STATES] {
        let machine = self.machine;
        let mut rates = [Form::default(); STATES];
        let mut driven = [None; BODIES];
        for (index, drive) in machine.drives.iter().enumerate() {
            let (current, current_rate) = self.current(index, drive);
            rates[CURRENT[index]] = current_rate;
            self.currents.push(Row::from(current));
            // n K_t i / r
            let motor = current * drive.grip;
            let gear = self.gear_force(index, drive);
            if let Some(force) = gear {
                let [at, turns] = ROTOR[index];
                rates[at] = Form::state(turns);
                rates[turns] = (motor - force) * (Double::ONE / drive.rotor);
            }
            driven[machine.leader(drive.body)] = Some((index, motor, gear));
        }
        // −Aᵀ f
        let mut belt = [Form::default(); BODIES];
        for (index, span) in machine.spans.iter().enumerate() {
            let force = self.span(index);
            for (body, &arm) in span.arms.iter().enumerate().filter(|(_, arm)| **arm != 0.0) {
                belt[body] = belt[body] - force * sign(arm);
            }
        }
        for (body, belt) in belt.iter_mut().enumerate() {
            *belt = *belt - self.stop_force(body);
        }
        belt[1] = belt[1] + Form::constant(machine.force) + self.line_force(0, way(1)) + self.line_force(1, speed(1));
        for leader in machine.leaders() {
            let load = machine.followers(leader).fold(Form::default(), |sum, body| sum + belt[body]);
            let own = self.body(leader, load, driven[leader], &mut rates);
            for body in machine.followers(leader) {
                rates[WAY[body]] = speed(body);
                rates[SPEED[body]] = own;
            }
        }
        rates
    }

    fn watch(&mut self, form: Form, change: Change) {
        self.parts.push((form, change));
    }

    fn watch_limit(&mut self, unlimited: Form, bound: Double, now: Limit, change: impl Fn(Limit) -> Change) {
        let bound = Form::constant(bound);
        match now {
            Limit::Within => {
                self.watch(bound - unlimited, change(Limit::High));
                self.watch(bound + unlimited, change(Limit::Low));
            }
            Limit::High => self.watch(unlimited - bound, change(Limit::Within)),
            Limit::Low => self.watch(-unlimited - bound, change(Limit::Within)),
        }
    }

    /// The current of a drive and its rate.
    fn current(&mut self, index: usize, m: &Drive) -> (Form, Form) {
        let (voltage, current) = (self.mode.voltage[index], self.mode.current[index]);
        let of_voltage = |limit| Change::Voltage(index, limit);
        let of_current = |limit| Change::Current(index, limit);
        let command = Form::input(index) * m.gain;
        let shaft = if m.play.is_some() { Form::state(ROTOR[index][1]) } else { speed(m.body) };
        let emf = shaft * m.back_emf;
        let (per_ohm, per_henry) = (Double::ONE / m.resistance, Double::ONE / m.inductance);
        let at_limit = |side: Limit, bound: Option<Double>| match (side, bound) {
            (Limit::Low | Limit::High, Some(bound)) => Some(Form::constant(bound * side.sign())),
            _ => None,
        };
        let (highest_voltage, highest_current) =
            (at_limit(voltage, m.voltage_limit), at_limit(current, m.current_limit));
        if !m.current_mode {
            if let Some(bound) = m.voltage_limit {
                self.watch_limit(command, bound, voltage, of_voltage);
            }
            let volts = highest_voltage.unwrap_or(command);
            if m.inductance > Double::ZERO {
                // L di/dt = v − R i − K_e n φ̇; a current at its limit stands while that pushes it outward.
                let i = Form::state(CURRENT[index]);
                let push = volts - i * m.resistance - emf;
                match (current, m.current_limit) {
                    (_, None) => {}
                    (Limit::Within, Some(bound)) => self.watch_limit(i, bound, current, of_current),
                    (side, Some(_)) => self.watch(push * sign(side.sign()), Change::Current(index, Limit::Within)),
                }
                return (i, if highest_current.is_some() { Form::default() } else { push * per_henry });
            }
            let unlimited = (volts - emf) * per_ohm;
            if let Some(bound) = m.current_limit {
                self.watch_limit(unlimited, bound, current, of_current);
            }
            return (highest_current.unwrap_or(unlimited), Form::default());
        }
        if let Some(bound) = m.current_limit {
            self.watch_limit(command, bound, current, of_current);
        }
        let wanted = highest_current.unwrap_or(command);
        let (i, rate, volts) = match m.bandwidth {
            // i = i_ref
            None => (wanted, Form::default(), wanted * m.resistance + emf),
            // di/dt = 2π f_b (i_ref − i)
            Some(bandwidth) => {
                let i = Form::state(CURRENT[index]);
                let rate = (wanted - i) * bandwidth;
                (i, rate, i * m.resistance + emf + rate * m.inductance)
            }
        };
        if let Some(bound) = m.voltage_limit {
            self.watch_limit(volts, bound, voltage, of_voltage);
        }
        match (highest_voltage, m.bandwidth) {
            (None, _) => (i, rate),
            (Some(volts), None) => ((volts - emf) * per_ohm, Form::default()),
            (Some(volts), Some(_)) => (i, (volts - i * m.resistance - emf) * per_henry),
        }
    }

    /// The force of flanks in the state `now`, positive where the upper one pushes.
    fn flanks(&mut self, way: Form, rate: Form, flanks: &Flanks, now: Touch, change: impl Fn(Touch) -> Change) -> Form {
        let side = |upper: usize| if upper == 1 { 1.0 } else { -1.0 };
        let beyond = |upper: usize| (way - Form::constant(flanks.ends[upper])) * sign(side(upper));
        let push = |upper: usize| beyond(upper) * flanks.stiffness + rate * flanks.damping * sign(side(upper));
        let damped = flanks.damping > Double::ZERO;
        match now {
            Touch::Apart => {
                for upper in 0..2 {
                    self.watch(-beyond(upper), change(Touch::Carries(upper)));
                }
                Form::default()
            }
            Touch::Carries(upper) => {
                self.watch(beyond(upper), change(Touch::Apart));
                if damped {
                    self.watch(push(upper), change(Touch::Loose(upper)));
                }
                push(upper) * sign(side(upper))
            }
            Touch::Loose(upper) => {
                self.watch(beyond(upper), change(Touch::Apart));
                self.watch(-push(upper), change(Touch::Carries(upper)));
                Form::default()
            }
        }
    }

    /// The force of a compliant gear on the belt.
    fn gear_force(&mut self, index: usize, drive: &Drive) -> Option<Form> {
        let twist = Form::state(ROTOR[index][0]) - way(drive.body);
        let rate = Form::state(ROTOR[index][1]) - speed(drive.body);
        match drive.play? {
            Play::Tight(stiffness, damping) => Some(twist * stiffness + rate * damping),
            Play::Loose(flanks) => {
                let change = |touch| Change::Gear(index, touch);
                Some(self.flanks(twist, rate, &flanks, self.mode.gear[index], change))
            }
        }
    }

    /// The force of an end stop on a body.
    fn stop_force(&mut self, body: usize) -> Form {
        match self.machine.ends[body] {
            None => Form::default(),
            Some(Ends::Open([low, high])) => {
                self.watch(Form::constant(high) - way(body), Change::Leave);
                self.watch(way(body) - Form::constant(low), Change::Leave);
                Form::default()
            }
            Some(Ends::Stops(flanks)) => {
                let change = |touch| Change::Stop(body, touch);
                self.flanks(way(body), speed(body), &flanks, self.mode.stop[body], change)
            }
        }
    }

    /// A line over x: between points (x₀, y₀) and (x₁, y₁) it is y₀ + (x − x₀) (y₁ − y₀)/(x₁ − x₀). Value where x is
    /// zero, and slope.
    fn line(&mut self, which: usize, line: &Line, x: Form) -> (Double, Double) {
        let passed = self.mode.passed[which];
        let (before, after) = (passed.checked_sub(1).map(|k| line.points[k]), line.points.get(passed).copied());
        if let Some([end, _]) = after {
            self.watch(Form::constant(end) - x, Change::Passed(which, passed + 1));
        }
        if let Some([begin, _]) = before {
            self.watch(x - Form::constant(begin), Change::Passed(which, passed - 1));
        }
        match (before, after) {
            (Some([x0, y0]), Some([x1, y1])) => {
                let slope = (y1 - y0) / (x1 - x0);
                (y0 - x0 * slope, slope)
            }
            (Some([_, y]), None) | (None, Some([_, y])) => (y, Double::ZERO),
            (None, None) => (Double::ZERO, Double::ZERO),
        }
    }

    fn line_force(&mut self, which: usize, x: Form) -> Form {
        let machine = self.machine;
        let Some(line) = &machine.lines[which] else { return Form::default() };
        let (value, slope) = self.line(which, line, x);
        Form::constant(value) + x * slope
    }

    /// Force of a span beyond the pretension.
    fn span(&mut self, j: usize) -> Form {
        let span = &self.machine.spans[j];
        let arms = || span.arms.iter().enumerate().filter(|(_, arm)| **arm != 0.0);
        let elongation = arms().fold(Form::default(), |sum, (body, &arm)| sum + way(body) * sign(arm));
        let rate = arms().fold(Form::default(), |sum, (body, &arm)| sum + speed(body) * sign(arm));
        let spring = match span.follows {
            None => elongation * span.stiffness,
            Some(follows) => {
                let places = |of: &[f64; BODIES]| -> Vec<(usize, f64)> {
                    let given = of.iter().enumerate().filter(|(_, c)| **c != 0.0);
                    given.map(|(body, &c)| (WAY[body], c)).collect()
                };
                let place = curve::SPAN[j];
                let kind = CurveKind::Span {
                    rigidity: follows.rigidity,
                    length: follows.length,
                    of: places(&follows.of),
                    arms: places(&span.arms),
                };
                self.curved.push(Curved { place, speed: (0, 1.0), along: None, kind });
                Form::state(place)
            }
        };
        let force = spring + rate * span.damping;
        let Some(pretension) = self.machine.pretension else { return force };
        let tension = force + Form::constant(pretension);
        let slack = self.mode.slack[j];
        self.watch(if slack { -tension } else { tension }, Change::Span(j, !slack));
        if slack { Form::constant(-pretension) } else { force }
    }

    /// Friction of a body that slides forward (1) or backward (−1), as a force against the positive direction, and what
    /// of it does not depend on the speed of a body at rest.
    fn sliding(&mut self, body: usize, direction: f64, along: Option<Ramp>) -> Form {
        let own = self.machine.friction[body];
        let side = if direction > 0.0 { 0 } else { 1 };
        let viscous = speed(body) * own.viscous[side];
        let factor = |value: Double| match along {
            None => Form::constant(value),
            Some(ramp) => Form::constant(ramp.value * value) + Form::state(ramp.way) * (ramp.slope * value),
        };
        let (coulomb, above) = (own.coulomb[side], own.breakaway[side] - own.coulomb[side]);
        let place = curve::FRICTION[body];
        let mut curved = |kind| {
            self.curved.push(Curved { place, speed: (SPEED[body], direction), along, kind });
            Form::state(place)
        };
        viscous
            + match own.curve {
                Curve::None => factor(coulomb) * sign(direction),
                Curve::Stribeck { velocity, is_gaussian } => {
                    let beyond = curved(CurveKind::Stribeck { above, velocity, is_gaussian });
                    (factor(coulomb) + beyond) * sign(direction)
                }
                Curve::Smooth(velocity) => curved(CurveKind::Smooth { above, coulomb, velocity }) * sign(direction),
                Curve::Bristles([stiffness, damping, velocity]) => {
                    let bristle = BRISTLE[body];
                    let bends = curved(CurveKind::Bristles { above, coulomb, velocity, stiffness, bristle });
                    Form::state(bristle) * stiffness + (speed(body) - bends) * damping
                }
            }
    }

    /// Acceleration of a body under the `load` of belt and stops, and what the motor adds.
    fn body(
        &mut self,
        leader: usize,
        load: Form,
        driven: Option<(usize, Form, Option<Form>)>,
        rates: &mut [Form; STATES],
    ) -> Form {
        let m = self.machine;
        let mut mass = m.followers(leader).fold(Double::ZERO, |sum, body| sum + m.mass[body]);
        let motion = self.mode.motion[leader];
        let forward = motion != Motion::Backward;
        let direction = if forward { 1.0 } else { -1.0 };
        let has_cart = m.followers(leader).any(|body| body == 1);
        let along = m.along.as_ref().filter(|_| has_cart).map(|line| {
            let (value, slope) = self.line(2, line, way(1));
            Ramp { value, slope, way: WAY[1] }
        });
        let of = |body: usize| along.filter(|_| body == 1);
        // e is η where the motor drives, 1/η where it is driven.
        let passed = |drive: usize, forward: bool| match forward == self.mode.gear_positive[drive] {
            true => m.drives[drive].efficiency,
            false => Double::ONE / m.drives[drive].efficiency,
        };
        let loaded = |forward: bool| match driven {
            None => load,
            Some((_, _, Some(force))) => load + force,
            Some((drive, motor, None)) => load + motor * passed(drive, forward),
        };
        if let Some((drive, _, None)) = driven {
            mass += m.drives[drive].rotor * passed(drive, forward);
        }
        let (pushed, both) = (loaded(forward), [loaded(true), loaded(false)]);
        let own = match motion {
            Motion::Stuck => {
                // Bent bristles go on pulling.
                let mut held = [Form::default(); 2];
                let mut pull = Form::default();
                for body in m.followers(leader) {
                    let friction = m.friction[body];
                    match friction.curve {
                        Curve::Bristles([stiffness, ..]) => pull = pull + Form::state(BRISTLE[body]) * stiffness,
                        Curve::Smooth(_) => {}
                        Curve::None | Curve::Stribeck { .. } => {
                            for (held, breakaway) in held.iter_mut().zip(friction.breakaway) {
                                *held = *held
                                    + match of(body) {
                                        None => Form::constant(breakaway),
                                        Some(ramp) => (Form::constant(ramp.value) + way(1) * ramp.slope) * breakaway,
                                    };
                            }
                        }
                    }
                }
                self.bodies.push((held[0] - (both[0] - pull), Change::Break(leader, Motion::Forward)));
                self.bodies.push((held[1] + (both[1] - pull), Change::Break(leader, Motion::Backward)));
                Form::default()
            }
            Motion::Free | Motion::Forward | Motion::Backward => {
                if motion != Motion::Free {
                    let change = if m.is_dry(leader) { Change::Rest(leader) } else { Change::Turn(leader) };
                    self.bodies.push((speed(leader) * sign(direction), change));
                }
                let resisted =
                    m.followers(leader).fold(pushed, |sum, body| sum - self.sliding(body, direction, of(body)));
                for body in m.followers(leader) {
                    if let Curve::Bristles(_) = m.friction[body].curve {
                        // ż = v − σ₀ abs(v) z/g(v)
                        rates[BRISTLE[body]] = speed(body) - Form::state(curve::FRICTION[body]);
                    }
                }
                resisted * (Double::ONE / mass)
            }
        };
        if let Some((drive, motor, None)) = driven
            && m.drives[drive].loses()
        {
            // T = K_t i − J_r n φ̈, as a force at the belt before the gear's losses
            let torque = motor - own * m.drives[drive].rotor;
            let positive = if self.mode.gear_positive[drive] { 1.0 } else { -1.0 };
            self.watch(torque * sign(positive), Change::GearSign(drive));
        }
        own
    }
}
