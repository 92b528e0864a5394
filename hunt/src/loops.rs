//! Controllers around the independent solver, written from the definitions of docs/control.md. Of state feedback the
//! gains and the filter are taut's own; the machine around it is not. References are those of taut's profiles.

use crate::double::Double;
use crate::input::Piece;
use crate::machine::{Model, ROTOR, Taken, WAY};
use crate::solve::{Ending, IndependentRun, Pieces, Solver};
use std::f64::consts::PI;
use taut::case::Case;
use taut::control::{Controller, Observation, Standard};
use taut::design::{Cascade, Design, FeedForwardModel, Fuzzy, Pid, SlidingMode, Structure};
use taut::machine::{AmplifierMode, EncoderPlace, Machine};
use taut::signal::profile::Reference;

/// The reference that feed-forward sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Looks {
    /// That of the profile.
    Ahead,
    /// The reference from position and derivatives at the sample, as inputs of an FMU have them.
    OnFromSample,
}

/// The reference a time later, by its derivatives: Σ y⁽ᵏ⁾ tᵏ/k!
fn later(y: &Reference, t: f64) -> Reference {
    let d = [y.position, y.speed, y.acceleration, y.jerk, y.snap];
    let from = |first: usize| {
        let (mut sum, mut power) = (0.0, 1.0);
        for (k, derivative) in d[first..].iter().enumerate() {
            sum += derivative * power;
            power *= t / (k + 1) as f64;
        }
        sum
    };
    Reference { position: from(0), speed: from(1), acceleration: from(2), jerk: from(3), snap: from(4) }
}

/// Runs the first move of a case on this machine, which its controller takes for `model`. `clock` are the times at
/// which it takes its reference: at an edge of the profile a last bit decides between two accelerations.
pub fn run(
    (case, model, looks): (&Case, &Machine, Looks),
    own: &Model,
    times: &[f64],
    (clock, kept): (Taken, Option<Taken>),
) -> Result<IndependentRun, String> {
    let design = case.controller.as_ref().ok_or("the case has no controller")?;
    let (machine, profile) = (&case.machine, case.moves[0].profile());
    let end = times.last().copied().unwrap_or(0.0);
    let mut law = Law::new(design, model)?;
    let (every, delay) = (design.every, design.delay);
    let lead = design.feed_forward.lead.unwrap_or(delay + 0.5 * every);
    let whole = (delay / every).round();
    let mut solver = Solver::new(own, times, kept);
    let none = || -> Pieces { Default::default() };
    let mut acting = none();
    // Commands on their way: when each acts, and what it is.
    let mut waiting: std::collections::VecDeque<(f64, f64)> = std::collections::VecDeque::new();
    let mut now = 0.0;
    for k in 0_u32.. {
        let sample = f64::from(k) * every;
        if sample >= end {
            break;
        }
        // Up to the sample, with what takes over on the way.
        while let Some(&(at, value)) = waiting.front().filter(|(at, _)| *at < sample) {
            waiting.pop_front();
            solver.go(&acting, Double::from(at));
            acting = pieces(at, value);
            now = at;
        }
        if sample > now {
            solver.go(&acting, Double::from(sample));
        }
        if *solver.ending() != Ending::Complete {
            break;
        }
        let current = solver.current(0, &acting).high;
        let z = solver.state();
        let at_belt = |place: usize| (z[place] + own.origin[0]).high;
        let shaft = if own.drives[0].play.is_some() { ROTOR[0][0] } else { WAY[0] };
        let (motor, pulley, cart) = (at_belt(shaft), at_belt(WAY[0]), at_belt(WAY[1]));
        let position = measured(machine, [motor, pulley, cart]);
        let scale = machine.scale.as_ref().map(|scale| in_counts(cart, 4.0 * scale.lines));
        let reference = profile.at(clock(sample).high);
        let ahead = match looks {
            Looks::Ahead => profile.at(clock(sample + lead).high),
            Looks::OnFromSample => later(&reference, lead),
        };
        let given = law.step(&LoopInputs { time: sample, reference, ahead, position, scale, current });
        // A delay of whole samples ends at a sample, to the last bit: its command acts from behind that one on.
        let at = if (delay / every - whole).abs() < 1e-9 { (f64::from(k) + whole) * every } else { sample + delay };
        // Before the delay is over nothing is commanded.
        if at <= sample {
            acting = pieces(sample, given);
        } else {
            waiting.push_back((at, given));
        }
        now = sample;
        // One that takes over exactly at a sample does so behind it.
        while let Some(&(at, value)) = waiting.front().filter(|(at, _)| *at <= now) {
            waiting.pop_front();
            acting = pieces(at, value);
        }
    }
    while let Some((at, value)) = waiting.pop_front().filter(|(at, _)| *at < end) {
        solver.go(&acting, Double::from(at));
        acting = pieces(at, value);
    }
    solver.go(&acting, Double::from(end));
    Ok(solver.finish())
}

fn pieces(at: f64, value: f64) -> Pieces {
    [Piece::line(Double::from(at), Double::from(value), Double::ZERO), Piece::default(), Piece::default()]
}

/// The measured position along the belt.
fn measured(machine: &Machine, [motor, pulley, cart]: [f64; 3]) -> f64 {
    let r = machine.pulley_radius;
    let Some(encoder) = &machine.encoder else { return motor };
    match encoder.at {
        EncoderPlace::Motor => {
            r * in_counts(motor / r, 4.0 * machine.drives[0].motor.gear_ratio * encoder.lines / (2.0 * PI))
        }
        EncoderPlace::DrivePulley => r * in_counts(pulley / r, 4.0 * encoder.lines / (2.0 * PI)),
        EncoderPlace::Cart => in_counts(cart, 4.0 * encoder.lines),
    }
}

fn in_counts(value: f64, counts: f64) -> f64 {
    (counts * value).round() / counts
}

/// Inputs of a controller at a sample.
struct LoopInputs {
    time: f64,
    reference: Reference,
    ahead: Reference,
    position: f64,
    scale: Option<f64>,
    current: f64,
}

/// A controller under way.
struct Law {
    structure: LoopKind,
    every: f64,
    limit: Option<f64>,
    feed: Option<Rigid>,
    /// Measured position at the last sample, filtered speed, integral, filtered derivative, integral of the current.
    last: Option<f64>,
    last_error: Option<f64>,
    speed: f64,
    integral: f64,
    derivative: f64,
    of_current: f64,
}

enum LoopKind {
    Pid(Pid),
    Cascade(Cascade),
    Sliding(SlidingMode, f64, f64),
    Fuzzy(Fuzzy),
    Borrowed(Box<Standard>),
}

impl Law {
    fn new(design: &Design, machine: &Machine) -> Result<Self, String> {
        let rigid = Rigid::new(machine);
        let own = design.filters.is_empty()
            && design.disturbance_observer.is_none()
            && design.shaper.is_empty()
            && design.feed_forward.model != FeedForwardModel::Elastic
            && !design.feed_forward.compensate_stretch;
        let structure = match &design.structure {
            Structure::Pid(pid) if own => LoopKind::Pid(*pid),
            Structure::Cascade(cascade) if own => LoopKind::Cascade(*cascade),
            Structure::SlidingMode(sliding) if own => LoopKind::Sliding(*sliding, rigid.mass, rigid.push),
            Structure::Fuzzy(fuzzy) if own => LoopKind::Fuzzy(fuzzy.clone()),
            Structure::Pid(_)
            | Structure::Cascade(_)
            | Structure::SlidingMode(_)
            | Structure::Fuzzy(_)
            | Structure::OpenLoop(_)
            | Structure::StateFeedback(_) => {
                let mut standard = Standard::new(design, machine).map_err(|error| error.to_string())?;
                standard.reset();
                LoopKind::Borrowed(Box::new(standard))
            }
        };
        let feed = (design.feed_forward.model == FeedForwardModel::Rigid).then_some(Rigid {
            inertia: design.feed_forward.inertia,
            dry: design.feed_forward.friction,
            ..rigid
        });
        Ok(Self {
            structure,
            every: design.every,
            limit: design.limit,
            feed,
            last: None,
            last_error: None,
            speed: 0.0,
            integral: 0.0,
            derivative: 0.0,
            of_current: 0.0,
        })
    }

    /// v_k = a v_{k−1} + (1 − a)(p_k − p_{k−1})/T, a = e^{−2π f T}
    fn speed(&mut self, position: f64, filter: f64) -> f64 {
        let a = (-2.0 * PI * filter * self.every).exp();
        let change = position - self.last.unwrap_or(position);
        self.last = Some(position);
        self.speed = a * self.speed + (1.0 - a) * change / self.every;
        self.speed
    }

    /// The command that is given.
    fn step(&mut self, seen: &LoopInputs) -> f64 {
        let t = self.every;
        let y = &seen.reference;
        let clip = |asked: f64| {
            let asked = if asked.is_finite() { asked } else { 0.0 };
            self.limit.map_or(asked, |limit| asked.clamp(-limit, limit))
        };
        let limit = self.limit;
        let added = match &self.structure {
            LoopKind::Borrowed(_) => 0.0,
            LoopKind::Pid(_) | LoopKind::Cascade(_) | LoopKind::Sliding(..) | LoopKind::Fuzzy(_) => {
                self.feed.as_ref().map_or(0.0, |rigid| rigid.command(&seen.ahead))
            }
        };
        let give = |u: f64| match limit {
            Some(limit) => (u + added).clamp(-limit, limit),
            None => u + added,
        };
        let e = y.position - seen.position;
        match &mut self.structure {
            LoopKind::Borrowed(standard) => {
                let &LoopInputs { time, reference, ahead, position, scale, current } = seen;
                let asked = standard.step(&Observation { time, reference, ahead, position, scale, current });
                let given = clip(asked);
                standard.limited(given);
                given
            }
            LoopKind::Pid(pid) => {
                let pid = *pid;
                let tau = 1.0 / (2.0 * PI * pid.filter);
                let change = e - self.last_error.unwrap_or(e);
                self.last_error = Some(e);
                self.derivative = (tau * self.derivative + change) / (tau + t);
                self.integral += pid.integral * t * e;
                let u = pid.proportional * e + self.integral + pid.derivative * self.derivative;
                let given = give(u);
                if pid.integral != 0.0 {
                    self.integral += (t / pid.tracking).min(1.0) * (given - (u + added));
                }
                given
            }
            LoopKind::Cascade(cascade) => {
                let cascade = *cascade;
                let v = self.speed(seen.position, cascade.filter);
                let e = seen.scale.map_or(e, |scale| y.position - scale);
                let wanted = cascade.position * e + cascade.reference_speed * y.speed;
                let epsilon = wanted - v;
                self.integral += cascade.speed_integral * t * epsilon;
                let u = cascade.speed * epsilon + self.integral;
                let share = (t / cascade.tracking).min(1.0);
                let has_integral = cascade.speed_integral != 0.0;
                let Some(current) = cascade.current else {
                    let given = give(u);
                    if has_integral {
                        self.integral += share * (given - (u + added));
                    }
                    return given;
                };
                let wanted = current.limit.map_or(u, |limit| u.clamp(-limit, limit));
                if has_integral {
                    self.integral += share * (wanted - u);
                }
                let lacks = wanted - seen.current;
                self.of_current += current.integral * t * lacks;
                let u = current.proportional * lacks + self.of_current;
                let given = give(u);
                let back = share * (given - (u + added));
                if current.integral != 0.0 {
                    self.of_current += back;
                }
                if has_integral && current.proportional != 0.0 {
                    self.integral += back / current.proportional;
                }
                given
            }
            LoopKind::Sliding(sliding, mass, push) => {
                let (sliding, mass, push) = (*sliding, *mass, *push);
                let rate = y.speed - self.speed(seen.position, sliding.filter);
                self.integral += t * e;
                let (lambda, kappa) = (sliding.bandwidth, sliding.integral);
                let sigma = rate + lambda * e + kappa * self.integral;
                let saturated = (sigma / sliding.boundary).clamp(-1.0, 1.0);
                let u = mass * (lambda * rate + kappa * e + sliding.reaching * saturated) / push;
                let given = give(u);
                if kappa > 0.0 {
                    let delta = given - (u + added);
                    let back = delta * push * sliding.boundary / (mass * kappa * sliding.reaching);
                    self.integral += (lambda * t).min(1.0) * back;
                }
                given
            }
            LoopKind::Fuzzy(fuzzy) => {
                let fuzzy = fuzzy.clone();
                let rate = y.speed - self.speed(seen.position, fuzzy.filter);
                let rule = between(&fuzzy.rules, e / fuzzy.error, rate / fuzzy.rate);
                let u = match fuzzy.incremental {
                    true => {
                        self.integral += t * fuzzy.command * rule;
                        self.integral
                    }
                    false => fuzzy.command * rule,
                };
                let given = give(u);
                if fuzzy.incremental {
                    self.integral += given - (u + added);
                }
                given
            }
        }
    }
}

/// Bilinear interpolation of rules on evenly spaced sets from −1 to 1, held beyond.
fn between(rules: &[Vec<f64>], error: f64, rate: f64) -> f64 {
    let count = rules.len();
    let place = |x: f64| {
        let at = (x.clamp(-1.0, 1.0) + 1.0) / 2.0 * (count - 1) as f64;
        let low = (at.floor() as usize).min(count - 2);
        (low, at - low as f64)
    };
    let ((i, a), (j, b)) = (place(error), place(rate));
    (1.0 - a) * ((1.0 - b) * rules[i][j] + b * rules[i][j + 1])
        + a * ((1.0 - b) * rules[i + 1][j] + b * rules[i + 1][j + 1])
}

/// All bodies as one mass at the belt.
#[derive(Clone)]
struct Rigid {
    mass: f64,
    /// Forward and backward.
    viscous: [f64; 2],
    coulomb: [f64; 2],
    load: f64,
    /// Force per command at rest.
    push: f64,
    inertia: f64,
    dry: f64,
    machine: Machine,
}

impl Rigid {
    fn new(machine: &Machine) -> Self {
        let (r, motor) = (machine.pulley_radius, &machine.drives[0].motor);
        let (j1, j2, n) = (machine.drive_pulley.inertia, machine.idler_pulley.inertia, motor.gear_ratio);
        // M = m + (J₁ + n² J_r + J₂)/r²
        let mass = machine.cart.mass + (j1 + n * n * motor.rotor_inertia + j2) / (r * r);
        let sides = [&machine.cart.friction, &machine.drive_pulley.friction, &machine.idler_pulley.friction];
        let sum = |of: fn(&taut::friction::Side) -> f64, backward: bool, arm: f64| {
            let side = |f: &taut::friction::Friction| of(if backward { &f.backward } else { &f.forward });
            side(sides[0]) + (side(sides[1]) + side(sides[2])) / arm
        };
        let per_volt = motor.gear_efficiency * n * motor.torque_constant / r * machine.drives[0].amplifier.gain;
        Self {
            mass,
            viscous: [false, true].map(|back| sum(|side| side.viscous, back, r * r)),
            coulomb: [false, true].map(|back| sum(|side| side.coulomb, back, r)),
            load: machine.cart.constant_force(),
            push: match machine.drives[0].amplifier.mode {
                AmplifierMode::Voltage => per_volt / motor.resistance,
                AmplifierMode::Current | AmplifierMode::Position => per_volt,
            },
            inertia: 1.0,
            dry: 1.0,
            machine: machine.clone(),
        }
    }

    /// F_x: straight between the points, constant beyond them.
    fn along(&self, x: f64) -> f64 {
        let Some(line) = &self.machine.cart.forces.along else { return 0.0 };
        let points = line.points();
        let behind = points.iter().position(|point| x < point[0]).unwrap_or(points.len());
        match (behind.checked_sub(1), points.get(behind)) {
            (Some(before), Some([x1, y1])) => {
                let [x0, y0] = points[before];
                y0 + (y1 - y0) * ((x - x0) / (x1 - x0))
            }
            (Some(last), None) => points[last][1],
            (None, first) => first.map_or(0.0, |first| first[1]),
        }
    }

    /// F = p M y″ + q (b y′ + s F_c) − F_L − F_x(y), and the command for it.
    fn command(&self, y: &Reference) -> f64 {
        let (motor, amplifier, r) =
            (&self.machine.drives[0].motor, &self.machine.drives[0].amplifier, self.machine.pulley_radius);
        // s = sgn y′ where abs(y′) > 1 µm/s, else sgn y″ where abs(y″) > 1 mm/s², else 0
        let s = match (y.speed.abs() > 1e-6, y.acceleration.abs() > 1e-3) {
            (true, _) => y.speed.signum(),
            (false, true) => y.acceleration.signum(),
            (false, false) => 0.0,
        };
        let side = usize::from(s < 0.0);
        let resists = self.viscous[side] * y.speed + s * self.coulomb[side];
        let force = self.inertia * self.mass * y.acceleration + self.dry * resists - self.load - self.along(y.position);
        let rate = self.inertia * self.mass * y.jerk;
        let (eta, n) = (motor.gear_efficiency, motor.gear_ratio);
        // The rotor's own torque does not pass through the gear: J_r n y″/r is added to the gear's, behind the loss.
        let rotor = self.inertia * n * n * motor.rotor_inertia / (r * r);
        let ([force, of_rotor], [rate, rate_of_rotor]) =
            ([force - rotor * y.acceleration, rotor * y.acceleration], [rate - rotor * y.jerk, rotor * y.jerk]);
        let lossless = r / (n * motor.torque_constant);
        let per_force = match force * y.speed < 0.0 && y.speed.abs() > 1e-6 {
            true => eta * r / (n * motor.torque_constant),
            false => r / (eta * n * motor.torque_constant),
        };
        let command = match amplifier.mode {
            AmplifierMode::Voltage => {
                motor.resistance * (per_force * force + lossless * of_rotor)
                    + motor.inductance * (per_force * rate + lossless * rate_of_rotor)
                    + n * motor.back_emf_constant * y.speed / r
            }
            AmplifierMode::Current | AmplifierMode::Position => per_force * force + lossless * of_rotor,
        };
        command / amplifier.gain
    }
}
