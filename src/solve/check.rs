//! What a stage and an experiment have to be before anything is computed.
//!
//! The case reader checks what is in a file, and says on which line; here it is what a program built by itself.

use crate::case::Experiment;
use crate::error::{Error, Result};
use crate::friction::{Friction, Law};
use crate::parameter;
use crate::plant::{Body, Plant};
use crate::stage::{AmplifierMode, BeltModel, Stage};
use std::f64::consts::PI;

/// The range of anything that has to be above zero, as in a case file.
const LEAST: f64 = 1e-15;
const MOST: f64 = 1e15;

/// Fastest rate, 1/s, that a stage may have: beyond it, what rounding does to the rates of change hides the motion.
const FASTEST: f64 = 1e13;

/// Most rows.
const MOST_ROWS: f64 = 1e12;

/// Refuses what is no machine.
pub(super) fn stage(stage: &Stage) -> Result<()> {
    let motor = &stage.motor;
    let r = stage.pulley_radius;
    let bodies = [stage.drive_pulley.inertia, stage.cart.mass, stage.idler_pulley.inertia];
    let laws = [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction];

    parameter::check(stage)?;
    // `Err` for whatever is not above zero; a value that is no number is never.
    let positive =
        |what: &str, values: &[f64]| match values.iter().find(|value| !(LEAST..=MOST).contains(*value)) {
            Some(value) => Err(Error::new(format!("{what} cannot be {value:e}"))
                .allowed("above zero: from 1e-15 to 1e15, in SI units")),
            None => Ok(()),
        };
    let rigid = stage.belt.model == BeltModel::Rigid;
    if !rigid {
        positive("the stiffness of a span", &stage.belt.stiffness)?;
    }
    let amplifier = &stage.amplifier;
    if motor.gear_play.is_some() {
        positive("the inertia of a rotor that turns by itself", &[motor.rotor_inertia])?;
        if motor.gear_efficiency != 1.0 {
            return Err(Error::new("a gear that gives way has no efficiency of its own").allowed("an efficiency of 1"));
        }
    }
    if stage.travel.is_some_and(|travel| travel.min >= travel.max) {
        return Err(Error::new("the travel ends before it begins").allowed("max above min"));
    }
    if stage.cart.along.as_ref().is_some_and(|along| !along.grows()) {
        return Err(Error::new("the positions of cart.friction.along do not grow").allowed("each above the one before"));
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

    for (body, law) in Body::ALL.into_iter().zip(laws) {
        match law.law {
            Law::Coulomb | Law::Stribeck { .. } | Law::Smooth { .. } => {}
            Law::LuGre { .. } => {
                positive("Coulomb friction under bristles", &[law.forward.coulomb, law.backward.coulomb])?;
                if let Some(along) = stage.cart.along.as_ref().filter(|_| body == Body::Cart) {
                    let factors: Vec<f64> = along.points().iter().map(|point| point[1]).collect();
                    positive("the factor of friction along the travel, under bristles,", &factors)?;
                }
            }
        }
        let never_sticks = matches!(law.law, Law::Smooth { .. } | Law::LuGre { .. });
        if body == Body::DrivePulley && never_sticks && motor.gear_efficiency < 1.0 {
            return Err(Error::new(
                "a gear that loses power, and a friction law that never sticks at the drive pulley",
            )
            .allowed("one of the two")
            .next("set gear_efficiency to 1, or give the drive pulley Coulomb friction or a Stribeck curve"));
        }
    }
    let reduced = stage.belt.model != BeltModel::Elastic;
    if reduced {
        one_law_each(stage)?;
    }
    if stage.belt.follows_cart {
        if reduced || stage.belt.pretension.is_some() {
            return Err(Error::new("spans that follow the cart do not go together with pretension or a reduced model"));
        }
        let (Some(make), Some(travel)) = (stage.belt.make, stage.travel) else {
            return Err(Error::new("spans that follow the cart need modulus, section, spans and a travel"));
        };
        let [l1, l2, _] = make.spans;
        if !(-l2 < travel.min && travel.min < travel.max && travel.max < l1) {
            let what = format!("a travel from {} m to {} m leaves no span", travel.min, travel.max);
            return Err(Error::new(what).allowed(format!("above {} m, below {l1} m", -l2)));
        }
    }

    // Whatever is by itself this fast: the current, and each body against its springs, dampers, friction and the motor.
    if let Some(bandwidth) = amplifier.bandwidth.filter(|bandwidth| 2.0 * PI * bandwidth > FASTEST) {
        return Err(too_fast("the current", 2.0 * PI * bandwidth).next("leave the bandwidth out: it does not show"));
    }
    if motor.inductance > 0.0 && (amplifier.mode == AmplifierMode::Voltage || amplifier.voltage_limit.is_some()) {
        let rate = motor.resistance / motor.inductance;
        if rate > FASTEST {
            return Err(too_fast("the current", rate).next("leave the inductance out: it does not show at this size"));
        }
    }
    let [k1, k2, k3] = if rigid { [0.0; 3] } else { stage.belt.stiffness };
    let [c1, c2, c3] = stage.belt.damping;
    let n = motor.gear_ratio;
    let brake = motor.torque_constant * motor.back_emf_constant * n * n / motor.resistance / motor.gear_efficiency;
    let brake =
        if motor.inductance > 0.0 || stage.amplifier.mode == AmplifierMode::Current { 0.0 } else { brake.abs() };
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

/// Refuses what is not linear between its changes of mode.
pub(super) fn piecewise_linear(stage: &Stage) -> Result<()> {
    if stage.is_piecewise_linear() {
        return Ok(());
    }
    let bent = [
        (stage.drive_pulley.friction, "drive pulley"),
        (stage.cart.friction, "cart"),
        (stage.idler_pulley.friction, "idler pulley"),
    ];
    let what = match bent.iter().find(|(law, _)| !law.is_piecewise_linear()) {
        Some((_, body)) => format!("the friction law of the {body} is no straight line"),
        None if stage.cart.along.is_some() => "the cart's friction changes along the travel".into(),
        None => "the belt's spans follow the cart".into(),
    };
    Err(Error::new(format!("{what}: this solver does not take it"))
        .next("leave --solver out, or write --solver general: it takes all of these"))
}

/// The fastest rate, 1/s, that is known beforehand: of the current, and of each body against all that holds or damps it.
pub(super) fn fastest_rate(stage: &Stage) -> f64 {
    let motor = &stage.motor;
    let r2 = stage.pulley_radius * stage.pulley_radius;
    let rigid = stage.belt.model == BeltModel::Rigid;
    let [k1, k2, k3] = if rigid { [0.0; 3] } else { stage.belt.stiffness };
    let [c1, c2, c3] = if rigid { [0.0; 3] } else { stage.belt.damping };
    let bodies = [
        (stage.drive_pulley.inertia, stage.drive_pulley.friction, (k1 + k3) * r2, (c1 + c3) * r2),
        (stage.cart.mass, stage.cart.friction, k1 + k2, c1 + c2),
        (stage.idler_pulley.inertia, stage.idler_pulley.friction, (k2 + k3) * r2, (c2 + c3) * r2),
    ];
    let emf = motor.torque_constant * motor.back_emf_constant * motor.gear_ratio.powi(2);
    let shaft = match motor.gear_play {
        Some(_) => motor.gear_ratio.powi(2) * motor.rotor_inertia,
        None if rigid => stage.drive_pulley.inertia + stage.idler_pulley.inertia + r2 * stage.cart.mass,
        None => stage.drive_pulley.inertia,
    };
    // Of the current by itself, and of current and motor with each other
    let mut fastest: f64 = if motor.inductance > 0.0 {
        f64::max(motor.resistance / motor.inductance, (emf.abs() / (motor.inductance * shaft)).sqrt())
    } else {
        emf.abs() / (motor.resistance * shaft)
    };
    fastest = fastest.max(2.0 * PI * stage.amplifier.bandwidth.unwrap_or(0.0));
    if let Some(play) = motor.gear_play {
        let light = (motor.gear_ratio.powi(2) * motor.rotor_inertia).min(stage.drive_pulley.inertia);
        fastest = fastest.max((2.0 * play.stiffness / light).sqrt()).max(2.0 * play.damping / light);
    }
    if let Some(stop) = stage.travel.and_then(|travel| travel.stop) {
        fastest = fastest.max((stop.stiffness / stage.cart.mass).sqrt()).max(stop.damping / stage.cart.mass);
    }
    for (inertia, friction, k, c) in bodies {
        let (k, c) = match friction.law {
            Law::Coulomb | Law::Stribeck { .. } => (k, c),
            Law::Smooth { .. } => (k, c + friction.slope(0.0)),
            Law::LuGre { stiffness, damping, .. } => (k + stiffness, c + damping),
        };
        let viscous = friction.forward.viscous.max(friction.backward.viscous);
        fastest = fastest.max((k / inertia).sqrt()).max((c + viscous) / inertia);
    }
    fastest
}

/// Where several bodies move as one, a law other than Coulomb's stands for all of them, at the one that leads.
fn one_law_each(stage: &Stage) -> Result<()> {
    let plant = Plant::new(stage);
    let laws = [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction];
    for leader in plant.leaders() {
        let followers = || plant.followers(leader).filter(|&body| body != leader);
        let plain = |body: Body| laws[body.index()].law == Law::Coulomb;
        let none = |body: Body| laws[body.index()] == Friction::default();
        if !(followers().all(plain) && (plain(leader) || followers().all(none))) {
            return Err(Error::new(format!(
                "in this model of the belt the {} moves as one with others, whose friction laws cannot be added up",
                leader.name()
            ))
            .allowed(format!("such a law for the {} alone, or Coulomb friction for all of them", leader.name())));
        }
    }
    Ok(())
}

fn too_fast(what: &str, rate: f64) -> Error {
    Error::new(format!("{what} would change within {:.0e} s, too fast to be told from rounding", 1.0 / rate))
        .allowed(format!("{:e} s and longer", 1.0 / FASTEST))
}

/// Refuses a run that has no rows, or no state to begin with.
pub(super) fn experiment(plant: &Plant, experiment: &Experiment) -> Result<()> {
    let &Experiment { until, every, ref initial, .. } = experiment;
    if !(until.is_finite() && every.is_finite() && until > 0.0 && every > 0.0) {
        return Err(Error::new(format!("a run of {until:e} s with a row every {every:e} s cannot be"))
            .allowed("a length and an interval above zero"));
    }
    if until / every > MOST_ROWS {
        return Err(Error::new(format!("a row every {every:e} s makes more than {MOST_ROWS:e} rows"))
            .next("choose a longer interval"));
    }
    let state = [
        initial.drive_angle,
        initial.drive_speed,
        initial.cart_position,
        initial.cart_speed,
        initial.idler_angle,
        initial.idler_speed,
        initial.motor_current,
    ];
    if let Some(value) = state.iter().find(|v| !v.is_finite()) {
        return Err(Error::new(format!("the state at the start cannot be {value}")).allowed("any finite number"));
    }
    // What moves as one begins as one.
    let state = initial.state(plant);
    for body in Body::ALL {
        let (own, leader) = (body.speed_place(), plant.leader(body).speed_place());
        for (own, leader) in [(state[own - 1], state[leader - 1]), (state[own], state[leader])] {
            let wanted = plant.ratio(body) * leader;
            if (own - wanted).abs() > 1e-9 * wanted.abs() {
                return Err(Error::new(format!(
                    "in this model of the belt {} and {} move as one, and do not begin so: {own} instead of {wanted}",
                    body.name(),
                    plant.leader(body).name()
                ))
                .allowed("positions and speeds at the start that fit: x = r φ₁ = r φ₃"));
            }
        }
    }
    Ok(())
}
