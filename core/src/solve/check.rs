//! Checks of a machine and an experiment before a run.
//!
//! The case reader checks files and reports the line; this module checks machines built by a program.

use super::Course;
use crate::error::{Error, Result};
use crate::friction::Law;
use crate::machine::axis::CART;
use crate::machine::{BeltModel, Machine, MachineKind};
use crate::mechanism::{AmplifierMode, BODIES_AND_DRIVES, Mechanism, SpringLaw, State};
use crate::parameter;
use crate::plan::Experiment;
use crate::polyline::MOST_POINTS;
use crate::signal::Signal;
use std::f64::consts::PI;

/// Range of positive numbers, as in a case file.
const LEAST: f64 = 1e-15;
const MOST: f64 = 1e15;

/// Largest rate, 1/s, of a machine: beyond it, rounding of the derivatives hides the motion.
const FASTEST: f64 = 1e13;

/// Maximum number of rows.
const MOST_ROWS: f64 = 1e12;

/// Rejects an invalid machine.
pub fn machine(machine: &Machine) -> Result<()> {
    if machine.kind != MachineKind::Axis {
        parameter::check(machine)?;
        return machine.check_gantry();
    }
    let motor = &machine.drives[0].motor;
    let r = machine.pulley_radius;
    let bodies = [machine.drive_pulley.inertia, machine.cart.mass, machine.idler_pulley.inertia];
    let laws = [machine.drive_pulley.friction, machine.cart.friction, machine.idler_pulley.friction];

    parameter::check(machine)?;
    // Rejects a number that is not positive, and NaN.
    let positive =
        |what: &str, values: &[f64]| match values.iter().find(|value| !(LEAST..=MOST).contains(*value)) {
            Some(value) => Err(Error::new(format!("{what} cannot be {value:e}"))
                .allowed("above zero: from 1e-15 to 1e15, in SI units")),
            None => Ok(()),
        };
    let rigid = machine.belt.model == BeltModel::Rigid;
    if !rigid {
        positive("the stiffness of a span", &machine.belt.stiffness)?;
    }
    let amplifier = &machine.drives[0].amplifier;
    if motor.gear_play.is_some() {
        positive("the inertia of a rotor that turns by itself", &[motor.rotor_inertia])?;
    }
    if machine.cart.travel.is_some_and(|travel| travel.min >= travel.max) {
        return Err(Error::new("the travel ends before it begins").allowed("max above min"));
    }
    if machine.cart.along.as_ref().is_some_and(|along| !along.grows()) {
        return Err(Error::new("the positions of cart.friction.along do not grow").allowed("each above the one before"));
    }
    let lines = [("along", &machine.cart.forces.along), ("by_speed", &machine.cart.forces.by_speed)];
    for (name, line) in lines.into_iter().filter_map(|(name, line)| Some((name, line.as_ref()?))) {
        if !line.grows() {
            return Err(Error::new(format!("the points of cart.force_{name} do not grow"))
                .allowed("each first number above the one before"));
        }
        if line.points().len() > MOST_POINTS {
            return Err(Error::new(format!("cart.force_{name} has {} points", line.points().len()))
                .allowed(format!("up to {MOST_POINTS}")));
        }
    }
    for side in laws.iter().flat_map(|law| [law.forward, law.backward]) {
        if side.breakaway < side.coulomb {
            let what = format!("the breakaway cannot be {}, below Coulomb friction", side.breakaway);
            return Err(Error::new(what).allowed(format!("at least {}", side.coulomb)));
        }
        if !(0.0..=MOST).contains(&side.breakaway) {
            return Err(Error::new(format!("the breakaway cannot be {}", side.breakaway))
                .allowed("from 0 to 1e15, in SI units"));
        }
    }

    for (body, law) in laws.into_iter().enumerate() {
        match law.law {
            Law::Coulomb | Law::Stribeck { .. } | Law::Smooth { .. } => {}
            Law::LuGre { .. } => {
                positive("Coulomb friction under bristles", &[law.forward.coulomb, law.backward.coulomb])?;
                if let Some(along) = machine.cart.along.as_ref().filter(|_| body == CART) {
                    let factors: Vec<f64> = along.points().iter().map(|point| point[1]).collect();
                    positive("the factor of friction along the travel, under bristles,", &factors)?;
                }
            }
        }
    }
    if machine.belt.follows_cart {
        let (Some(make), Some(travel)) = (machine.belt.make, machine.cart.travel) else {
            return Err(Error::new("spans that follow the cart need modulus, section, spans and a travel"));
        };
        let [l1, l2, _] = make.spans.three();
        if !(-l2 < travel.min && travel.min < travel.max && travel.max < l1) {
            let what = format!("a travel from {} m to {} m leaves no span", travel.min, travel.max);
            return Err(Error::new(what).allowed(format!("above {} m, below {l1} m", -l2)));
        }
    }

    // Rates of the parts alone: the current, and each body against its springs, dampers, friction and the motor.
    if let Some(bandwidth) = amplifier.bandwidth.filter(|bandwidth| 2.0 * PI * bandwidth > FASTEST) {
        return Err(too_fast("the current", 2.0 * PI * bandwidth).next("leave the bandwidth out: it does not show"));
    }
    if motor.inductance > 0.0 && (amplifier.mode == AmplifierMode::Voltage || amplifier.voltage_limit.is_some()) {
        let rate = motor.resistance / motor.inductance;
        if rate > FASTEST {
            return Err(too_fast("the current", rate).next("leave the inductance out: it does not show at this size"));
        }
    }
    let [k1, k2, k3] = if rigid { [0.0; 3] } else { machine.belt.stiffness.three() };
    let [c1, c2, c3] = machine.belt.damping.three();
    let n = motor.gear_ratio;
    let brake = motor.torque_constant * motor.back_emf_constant * n * n / motor.resistance / motor.gear_efficiency;
    let brake = if motor.inductance > 0.0 || machine.drives[0].amplifier.mode == AmplifierMode::Current {
        0.0
    } else {
        brake.abs()
    };
    let around = [(k1 + k3, c1 + c3, r * r, brake), (k1 + k2, c1 + c2, 1.0, 0.0), (k2 + k3, c2 + c3, r * r, 0.0)];
    for (((k, c, arm, brake), inertia), law) in around.into_iter().zip(bodies).zip(laws) {
        let drag = c * arm + brake + law.forward.viscous.max(law.backward.viscous);
        let rate = f64::max((k * arm / inertia).sqrt(), drag / inertia);
        if rate > FASTEST {
            return Err(too_fast("a body", rate).next("give it more inertia, or less stiffness, damping and friction"));
        }
    }
    Ok(())
}

/// Rejects a mechanism that is not linear between changes of mode.
pub(super) fn piecewise_linear(mechanism: &Mechanism) -> Result<()> {
    let mut bodies = mechanism.bodies.iter();
    let what = if let Some(body) = bodies.find(|body| !body.friction.is_piecewise_linear()) {
        format!("the friction law of the {} is not linear", body.label.name)
    } else if let Some(body) = mechanism.bodies.iter().find(|body| body.along.is_some()) {
        format!("the {}'s friction changes along the travel", body.label.name)
    } else if mechanism.springs.iter().any(|spring| spring.follows.is_some()) {
        "the belt's spans follow the cart".into()
    } else if mechanism.drives.iter().any(|drive| drive.motor.stepper.is_some()) {
        "the torque of a stepper depends on the sine of its angle".into()
    } else if mechanism.ride.is_some() {
        "the bridge yaws, and its inertia depends on where the cart is".into()
    } else {
        assert!(mechanism.bodies.len() + mechanism.drives.len() <= BODIES_AND_DRIVES);
        return Ok(());
    };
    Err(Error::new(format!("{what}: this solver does not support it"))
        .next("leave --solver out, or write --solver general: it takes all of these"))
}

/// Fastest rate, 1/s, known beforehand: of the currents, and of each body against its springs and dampers.
pub(super) fn fastest_rate(mechanism: &Mechanism) -> f64 {
    let mut fastest: f64 = 0.0;
    for drive in &mechanism.drives {
        let motor = &drive.motor;
        let emf = motor.torque_constant * motor.back_emf_constant * motor.gear_ratio.powi(2);
        let mass = |b: usize| mechanism.ratio(b).powi(2) * mechanism.bodies[b].inertia;
        let leader = mechanism.leader(drive.shaft);
        let moved: f64 = mechanism.followers(leader).map(mass).sum();
        let shaft = moved / mechanism.ratio(drive.shaft).powi(2);
        // Rates of the current alone, and of the exchange between current and motor
        fastest = fastest.max(if motor.inductance > 0.0 {
            f64::max(motor.resistance / motor.inductance, (emf.abs() / (motor.inductance * shaft)).sqrt())
        } else {
            emf.abs() / (motor.resistance * shaft)
        });
        fastest = fastest.max(2.0 * PI * drive.amplifier.bandwidth.unwrap_or(0.0));
        if let Some(stepper) = &motor.stepper {
            // The rotor on its field, and on its detents
            let stiffness = motor.holding_torque().unwrap_or(0.0) + 4.0 * stepper.detent_torque;
            fastest = fastest.max((stepper.teeth() * stiffness / shaft).sqrt());
        }
    }
    for (index, body) in mechanism.bodies.iter().enumerate() {
        let (mut stiffness, mut damping) = (0.0, 0.0);
        for spring in &mechanism.springs {
            // Stops and flanks are taken alone, since they rarely act together with the rest.
            let alone = matches!(spring.law, SpringLaw::Gap { .. });
            let arm: f64 = spring.arms.iter().filter(|(b, _)| *b == index).map(|(_, arm)| arm * arm).sum();
            let (steepest, strongest) = spring.law.steepest();
            let (k, c) = ((spring.stiffness + steepest) * arm, (spring.damping + strongest) * arm);
            if alone || body.is_rotor {
                let two = if spring.arms.len() > 1 { 2.0 } else { 1.0 };
                fastest = fastest.max((two * k / body.inertia).sqrt()).max(two * c / body.inertia);
            } else {
                (stiffness, damping) = (stiffness + k, damping + c);
            }
        }
        let friction = &body.friction;
        (stiffness, damping) = match friction.law {
            Law::Coulomb | Law::Stribeck { .. } => (stiffness, damping),
            Law::Smooth { .. } => (stiffness, damping + friction.slope(0.0)),
            Law::LuGre { stiffness: bristle, damping: loss, .. } => (stiffness + bristle, damping + loss),
        };
        let viscous = friction.forward.viscous.max(friction.backward.viscous);
        fastest = fastest.max((stiffness / body.inertia).sqrt()).max((damping + viscous) / body.inertia);
    }
    fastest
}

fn too_fast(what: &str, rate: f64) -> Error {
    Error::new(format!("{what} would change within {:.0e} s, too fast for 64-bit numbers", 1.0 / rate))
        .allowed(format!("{:e} s and longer", 1.0 / FASTEST))
}

/// Rejects a run of a mechanism without rows, with a wrong number of inputs, or with an invalid initial state.
pub(super) fn course(mechanism: &Mechanism, course: &Course) -> Result<()> {
    times(course.until, course.every)?;
    if course.inputs.len() != mechanism.drives.len() {
        return Err(Error::new(format!("{} inputs cannot be", course.inputs.len()))
            .allowed(format!("one for each drive: {}", mechanism.drives.len())));
    }
    state(&course.start)
}

/// A jump of a stepper's command that its rotor cannot follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Number of the drive.
    pub drive: usize,
    /// s
    pub time: f64,
    /// m
    pub by: f64,
    /// Largest jump that the rotor follows, m.
    pub most: f64,
}

/// First such jump of these commands before `until`, s, for a machine that begins in `start`.
pub fn first_jump(mechanism: &Mechanism, inputs: &[Signal], start: &State, until: f64) -> Option<Jump> {
    inputs.iter().enumerate().find_map(|(drive, input)| {
        let most = mechanism.farthest_jump(drive)?;
        let begin = start.position[mechanism.drives[drive].shaft] / mechanism.angle_per_input(drive);
        let (time, by) = input.first_jump(begin, most, until)?;
        Some(Jump { drive, time, by, most })
    })
}

/// Rejects commands of steppers with jumps that a rotor cannot follow, including one from its initial position.
fn commands(mechanism: &Mechanism, course: &Course) -> Result<()> {
    match first_jump(mechanism, &course.inputs, &course.start, course.until) {
        None => Ok(()),
        Some(Jump { time, by, most, .. }) => {
            Err(Error::new(format!("the command of the stepper jumps by {by} m at {time} s"))
                .allowed(format!("up to {most} m at once, two full steps: a rotor does not follow more"))
                .next("begin where the rotor is, and let the command grow"))
        }
    }
}

/// Rejects an invalid state.
pub(super) fn state(start: &State) -> Result<()> {
    match start.position.iter().chain(&start.speed).chain(&start.current).find(|value| !value.is_finite()) {
        Some(value) => {
            Err(Error::new(format!("the state at the start cannot be {value}")).allowed("any finite number"))
        }
        None => Ok(()),
    }
}

/// Rejects a run without rows.
fn times(until: f64, every: f64) -> Result<()> {
    if !(until.is_finite() && every.is_finite() && until > 0.0 && every > 0.0) {
        return Err(Error::new(format!("a run of {until:e} s with a row every {every:e} s cannot be"))
            .allowed("a length and an interval above zero"));
    }
    if until / every > MOST_ROWS {
        return Err(Error::new(format!("a row every {every:e} s makes more than {MOST_ROWS:e} rows"))
            .next("choose a longer interval"));
    }
    Ok(())
}

/// Rejects a run without rows or with an invalid initial state.
pub(super) fn experiment(mechanism: &Mechanism, experiment: &Experiment) -> Result<()> {
    state(&experiment.initial)?;
    let begun = Course::new(mechanism, experiment);
    course(mechanism, &begun)?;
    commands(mechanism, &begun)?;
    // Joined bodies start with equal speed and position.
    let state = begun.start;
    for body in 0..mechanism.bodies.len() {
        let leader = mechanism.leader(body);
        for values in [&state.position, &state.speed] {
            let (own, wanted) = (values[body], mechanism.ratio(body) * values[leader]);
            if (own - wanted).abs() > 1e-9 * wanted.abs() {
                return Err(Error::new(format!(
                    "in this belt model {} and {} move together, but their initial values disagree: {own} instead of \
                     {wanted}",
                    mechanism.bodies[body].label.name, mechanism.bodies[leader].label.name
                ))
                .allowed("positions and speeds at the start that fit: x = r φ₁ = r φ₃"));
            }
        }
    }
    Ok(())
}
