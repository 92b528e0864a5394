//! The states of each part, the linear equations that follow from them, and the conditions under which they go on.

use crate::double::Double;
use crate::machine::{CURRENT, Ends, Flanks, Machine, Play, ROTOR, SPEED, STATES, WAY};
use crate::series::{Form, Rates, Row};
use taut::stage::BeltModel;

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

/// Whether a limit binds.
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
    /// Drive pulley, cart, idler pulley.
    pub motion: [Motion; 3],
    /// Whether the torque that the motor hands to the gear is positive.
    pub gear_positive: bool,
    /// Spans.
    pub slack: [bool; 3],
    /// Gear with backlash.
    pub gear: Touch,
    /// End stops.
    pub stop: Touch,
    /// Points passed of the forces over the cart's way and over its speed.
    pub passed: [usize; 2],
    /// Voltage limit.
    pub voltage: Limit,
    /// Current limit.
    pub current: Limit,
}

/// The change that follows where a condition fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The voltage limit.
    Voltage(Limit),
    /// The current limit.
    Current(Limit),
    /// The torque through the gear changes its sign.
    GearSign,
    /// A span goes slack or taut.
    Span(usize, bool),
    /// Flanks of the gear.
    Gear(Touch),
    /// End stops.
    Stop(Touch),
    /// As many points of a force are passed.
    Passed(usize, usize),
    /// The cart leaves its travel.
    Leave,
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
    machine: &'a Machine,
    mode: Mode,
    parts: Vec<(Form, Change)>,
    bodies: Vec<(Form, Change)>,
}

impl Law {
    /// The equations of `machine` in `mode`.
    pub fn new(machine: &Machine, mode: Mode) -> Self {
        let mut builder = Builder { machine, mode, parts: Vec::new(), bodies: Vec::new() };
        let rates = builder.rates();
        let Builder { parts, bodies, .. } = builder;
        let guards = parts.into_iter().chain(bodies).map(|(form, change)| Guard { row: Row::from(form), change });
        Self { rates: Rates::new(&rates), guards: guards.collect() }
    }
}

impl Builder<'_> {
    fn rates(&mut self) -> [Form; STATES] {
        let machine = self.machine;
        let mut rates = [Form::default(); STATES];
        let (current, current_rate) = self.current();
        rates[CURRENT] = current_rate;
        // n K_t i / r
        let motor = current * machine.grip;
        let gear = self.gear_force();
        if let Some(force) = gear {
            rates[ROTOR[0]] = Form::state(ROTOR[1]);
            rates[ROTOR[1]] = (motor - force) * (Double::ONE / machine.rotor);
        }
        let [f1, f2, f3] = self.spans();
        let stop = self.stop_force();
        let lines = self.line_force(0, way(1)) + self.line_force(1, speed(1));
        let belt = [f3 - f1, f1 - f2 + Form::constant(machine.force) + lines - stop, f2 - f3];
        for leader in (0..3).filter(|&body| machine.leader(body) == body) {
            let load = machine.followers(leader).fold(Form::default(), |sum, body| sum + belt[body]);
            let own = self.body(leader, load, motor, gear);
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

    fn watch_limit(&mut self, unlimited: Form, bound: Double, now: Limit, change: fn(Limit) -> Change) {
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

    /// The current and its rate.
    fn current(&mut self) -> (Form, Form) {
        let m = self.machine;
        let Mode { voltage, current, .. } = self.mode;
        let command = Form::input() * m.gain;
        let shaft = if m.play.is_some() { Form::state(ROTOR[1]) } else { speed(0) };
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
                self.watch_limit(command, bound, voltage, Change::Voltage);
            }
            let volts = highest_voltage.unwrap_or(command);
            if m.inductance > Double::ZERO {
                // L di/dt = v − R i − K_e n φ̇; a current at its limit stands while that pushes it outward.
                let i = Form::state(CURRENT);
                let push = volts - i * m.resistance - emf;
                match (current, m.current_limit) {
                    (_, None) => {}
                    (Limit::Within, Some(bound)) => self.watch_limit(i, bound, current, Change::Current),
                    (side, Some(_)) => self.watch(push * sign(side.sign()), Change::Current(Limit::Within)),
                }
                return (i, if highest_current.is_some() { Form::default() } else { push * per_henry });
            }
            let unlimited = (volts - emf) * per_ohm;
            if let Some(bound) = m.current_limit {
                self.watch_limit(unlimited, bound, current, Change::Current);
            }
            return (highest_current.unwrap_or(unlimited), Form::default());
        }
        if let Some(bound) = m.current_limit {
            self.watch_limit(command, bound, current, Change::Current);
        }
        let wanted = highest_current.unwrap_or(command);
        let (i, rate, volts) = match m.bandwidth {
            // i = i_ref
            None => (wanted, Form::default(), wanted * m.resistance + emf),
            // di/dt = 2π f_b (i_ref − i)
            Some(bandwidth) => {
                let i = Form::state(CURRENT);
                let rate = (wanted - i) * bandwidth;
                (i, rate, i * m.resistance + emf + rate * m.inductance)
            }
        };
        if let Some(bound) = m.voltage_limit {
            self.watch_limit(volts, bound, voltage, Change::Voltage);
        }
        match (highest_voltage, m.bandwidth) {
            (None, _) => (i, rate),
            (Some(volts), None) => ((volts - emf) * per_ohm, Form::default()),
            (Some(volts), Some(_)) => (i, (volts - i * m.resistance - emf) * per_henry),
        }
    }

    /// The force of flanks in the state `now`, positive where the upper one pushes.
    fn flanks(&mut self, way: Form, rate: Form, flanks: &Flanks, now: Touch, change: fn(Touch) -> Change) -> Form {
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
    fn gear_force(&mut self) -> Option<Form> {
        let twist = Form::state(ROTOR[0]) - way(0);
        let rate = Form::state(ROTOR[1]) - speed(0);
        match self.machine.play? {
            Play::Tight(stiffness, damping) => Some(twist * stiffness + rate * damping),
            Play::Loose(flanks) => Some(self.flanks(twist, rate, &flanks, self.mode.gear, Change::Gear)),
        }
    }

    /// The force of an end stop on the cart.
    fn stop_force(&mut self) -> Form {
        match self.machine.ends {
            None => Form::default(),
            Some(Ends::Open([low, high])) => {
                self.watch(Form::constant(high) - way(1), Change::Leave);
                self.watch(way(1) - Form::constant(low), Change::Leave);
                Form::default()
            }
            Some(Ends::Stops(flanks)) => self.flanks(way(1), speed(1), &flanks, self.mode.stop, Change::Stop),
        }
    }

    /// A force over x: between points (x₀, y₀) and (x₁, y₁) it is y₀ + (x − x₀) (y₁ − y₀)/(x₁ − x₀).
    fn line_force(&mut self, which: usize, x: Form) -> Form {
        let Some(line) = &self.machine.lines[which] else { return Form::default() };
        let passed = self.mode.passed[which];
        let (before, after) = (passed.checked_sub(1).map(|k| line.points[k]), line.points.get(passed).copied());
        if let Some([end, _]) = after {
            self.watch(Form::constant(end) - x, Change::Passed(which, passed + 1));
        }
        if let Some([begin, _]) = before {
            self.watch(x - Form::constant(begin), Change::Passed(which, passed - 1));
        }
        match (before, after) {
            (Some([x0, y0]), Some([x1, y1])) => (x - Form::constant(x0)) * ((y1 - y0) / (x1 - x0)) + Form::constant(y0),
            (Some([_, y]), None) | (None, Some([_, y])) => Form::constant(y),
            (None, None) => Form::default(),
        }
    }

    /// Forces of the spans beyond the pretension.
    fn spans(&mut self) -> [Form; 3] {
        let m = self.machine;
        let [k, c] = m.belt;
        let span = |a: usize, b: usize, k: Double, c: Double| (way(a) - way(b)) * k + (speed(a) - speed(b)) * c;
        match m.model {
            BeltModel::Rigid => [Form::default(); 3],
            BeltModel::Elastic => {
                let forces = [span(0, 1, k[0], c[0]), span(1, 2, k[1], c[1]), span(2, 0, k[2], c[2])];
                [0, 1, 2].map(|j| self.taut_or_slack(j, forces[j]))
            }
            BeltModel::TwoMass => {
                // 1/k₂₃ = 1/k₂ + 1/k₃, c₂₃ = (c₂ k₃² + c₃ k₂²)/(k₂ + k₃)²
                let sum = k[1] + k[2];
                let k23 = k[1] * k[2] / sum;
                let c23 = (c[1] * k[2] * k[2] + c[2] * k[1] * k[1]) / (sum * sum);
                let f1 = self.taut_or_slack(0, span(0, 1, k[0], c[0]));
                let f2 = self.taut_or_slack(1, span(1, 2, k23, c23));
                [f1, f2, f2]
            }
        }
    }

    fn taut_or_slack(&mut self, j: usize, force: Form) -> Form {
        let Some(pretension) = self.machine.pretension else { return force };
        let tension = force + Form::constant(pretension);
        let slack = self.mode.slack[j];
        self.watch(if slack { -tension } else { tension }, Change::Span(j, !slack));
        if slack { Form::constant(-pretension) } else { force }
    }

    /// Acceleration of a body under the `load` of belt and stops, and what the motor adds.
    fn body(&mut self, leader: usize, load: Form, motor: Form, gear: Option<Form>) -> Form {
        let m = self.machine;
        let friction = m.friction_of(leader);
        let mut mass = m.followers(leader).fold(Double::ZERO, |sum, body| sum + m.mass[body]);
        let driven = leader == m.leader(0);
        let motion = self.mode.motion[leader];
        let forward = motion != Motion::Backward;
        // e is η where the motor drives, 1/η where it is driven.
        let passed = |forward: bool| match forward == self.mode.gear_positive {
            true => m.efficiency,
            false => Double::ONE / m.efficiency,
        };
        let loaded = |forward: bool| match (driven, gear) {
            (false, _) => load,
            (true, Some(force)) => load + force,
            (true, None) => load + motor * passed(forward),
        };
        if driven && gear.is_none() {
            mass += m.rotor * passed(forward);
        }
        let own = match motion {
            Motion::Free => (loaded(true) - speed(leader) * friction.viscous[0]) * (Double::ONE / mass),
            Motion::Forward | Motion::Backward => {
                let (side, direction) = if forward { (0, 1.0) } else { (1, -1.0) };
                self.bodies.push((speed(leader) * sign(direction), Change::Rest(leader)));
                let dry = Form::constant(friction.coulomb[side] * direction);
                (loaded(forward) - speed(leader) * friction.viscous[side] - dry) * (Double::ONE / mass)
            }
            Motion::Stuck => {
                let [forward, backward] = friction.breakaway.map(Form::constant);
                self.bodies.push((forward - loaded(true), Change::Break(leader, Motion::Forward)));
                self.bodies.push((backward + loaded(false), Change::Break(leader, Motion::Backward)));
                Form::default()
            }
        };
        if driven && gear.is_none() && m.loses() {
            // T = K_t i − J_r n φ̈, as a force at the belt before the gear's losses
            let torque = motor - own * m.rotor;
            let positive = if self.mode.gear_positive { 1.0 } else { -1.0 };
            self.watch(torque * sign(positive), Change::GearSign);
        }
        own
    }
}
