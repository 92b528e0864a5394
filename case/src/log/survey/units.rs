//! Suspicions of wrong units, columns and signs: a log compared with itself, and with a rough run of the machine.

use super::super::{Log, Output, Quantity};
use super::channel::Channel;
use super::motion::Motion;
use super::{Note, Remedy, Severity, quantile, shown};
use crate::machine::{AmplifierMode, DriveUnit, EncoderPlace, Machine};
use crate::quantity::{self, rounded};

/// Measured and expected may differ by this factor without a suspicion: the machine's parameters may be rough.
const ROUGH: f64 = 30.0;

/// An output of no more different values may be an input.
const MOST_SWITCHED: usize = 40;

/// An input that gives less than this part of the friction does not move a machine, however rough its parameters.
const IDLE: f64 = 5.0;

/// Accelerations so many times what the machine would do are no machine's.
const HASTY: f64 = 12.0;

/// Steps that differ by less than this factor are the same.
const ALIKE: f64 = 1.02;

/// A measured ratio is a known factor within this difference of logarithms.
const NEARLY: f64 = 0.05;

/// An expected ratio is a known factor within this difference of logarithms: the parameters are rough.
const ROUGHLY: f64 = 1.2;

/// Of fewer different values a step cannot be told.
const FEWEST_LEVELS: usize = 10;

/// Largest voltage and current that a drive of this kind takes.
const MOST_VOLTS: f64 = 800.0;
const MOST_AMPERES: f64 = 300.0;
/// Longest travel of an axis that a position commands, m.
const MOST_TRAVEL: f64 = 100.0;

pub(super) fn input_unit(stage: &Machine) -> &'static str {
    stage.drives[0].amplifier.mode.unit()
}

pub(super) fn notes(log: &Log, stage: &Machine, channels: &[Channel], motion: Option<&Motion>) -> Vec<Note> {
    let mut notes = Vec::new();
    if !stage.has_torque_balance() {
        notes.extend(stage.drives.iter().zip(channels).filter_map(|(unit, channel)| input_note(stage, unit, channel)));
        notes.extend(beside_drives(log, stage, channels));
        notes.extend(encoder_note(stage, channels));
        return notes;
    }
    let input = input_note(stage, &stage.drives[0], &channels[0]);
    let swapped = swapped_note(log, channels);
    let trusted = input.is_none() && swapped.is_none();
    notes.extend(input);
    notes.extend(swapped);
    let pairs = consistency(log, stage, channels);
    if pairs.is_empty() && trusted {
        notes.extend(motion.filter(|motion| motion.moves).and_then(|motion| magnitude(log, stage, motion)));
    }
    notes.extend(pairs);
    notes.extend(encoder_note(stage, channels));
    if trusted {
        notes.extend(motion.filter(|motion| motion.moves).and_then(|motion| direction(log, stage, motion)));
        notes.extend(current_note(log, stage));
    }
    notes
}

/// Steps of a position that are not those of the case's encoder.
fn encoder_note(stage: &Machine, channels: &[Channel]) -> Option<Note> {
    let encoder = stage.encoder?;
    let counted: Vec<&str> = stage.counted().map(Quantity::name).collect();
    let count = 1.0 / encoder.counts_per_unit(stage.drives[0].motor.gear_ratio);
    let (channel, step) = channels.iter().find_map(|channel| {
        let step = channel.step.filter(|_| counted.contains(&channel.name) && channel.levels > FEWEST_LEVELS)?;
        Some((channel, step))
    })?;
    let ratio = step / count;
    if (1.0 / ALIKE..ALIKE).contains(&ratio) {
        return None;
    }
    let per = match encoder.at {
        EncoderPlace::Cart => "per metre",
        EncoderPlace::Motor | EncoderPlace::DrivePulley => "per turn",
    };
    let of_turn = match encoder.at {
        EncoderPlace::Cart => 1.0,
        EncoderPlace::Motor => std::f64::consts::TAU / stage.drives[0].motor.gear_ratio,
        EncoderPlace::DrivePulley => std::f64::consts::TAU,
    };
    let text = format!(
        "it moves in steps of {}, and a count of the case's encoder is {}: the steps would be those of {} counts {per}; correct encoder.counts \
         (or lines), or the unit or scale of this column",
        shown(step, channel.unit),
        shown(count, channel.unit),
        rounded((of_turn / step * 1e3).round() / 1e3)
    );
    // Finer steps than counts may be those of the digits that were written.
    let severity = if ratio > 1.0 { Severity::Warning } else { Severity::Fact };
    Some(Note::new("encoder-step", severity, text).on(channel.name))
}

/// An input that no such amplifier gives.
fn input_note(stage: &Machine, unit: &DriveUnit, input: &Channel) -> Option<Note> {
    let (gain, mode) = (unit.amplifier.gain, unit.amplifier.mode);
    let peak = (gain * input.greatest).abs().max((gain * input.least).abs());
    // A motor of one newton, or newton metre, per ampere stands for a force or torque, which no amplifier limits.
    let motor = &unit.motor;
    let per_ampere = motor.torque_constant * motor.gear_ratio * motor.gear_efficiency;
    let is_force = per_ampere == 1.0 || per_ampere == stage.pulley_radius;
    if is_force && mode == AmplifierMode::Current {
        return None;
    }
    let (most, unit, milli) = match mode {
        AmplifierMode::Voltage => (MOST_VOLTS, "V", "mV"),
        AmplifierMode::Current => (MOST_AMPERES, "A", "mA"),
        AmplifierMode::Position => (MOST_TRAVEL, "m", "mm"),
    };
    if peak <= most {
        return None;
    }
    let next = match gain.abs() {
        1.0 => format!("is the column in {milli}? then set units = {{ {} = \"{milli}\" }}", input.name),
        _ => format!("check amplifier.gain, which is {} {unit} per unit of the column", rounded(gain)),
    };
    let text = format!("it reaches {}, beyond any drive of this kind: {next}", shown(peak, unit));
    Some(Note::new("unit", Severity::Suspicion, text).on(input.name))
}

/// An output that looks like a command while the input looks like a measurement.
fn swapped_note(log: &Log, channels: &[Channel]) -> Option<Note> {
    let jumpy = |values: &[f64]| {
        let same = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
        same as f64 > 0.9 * values.len() as f64
    };
    let input = &channels[0];
    if input.levels < 50 || jumpy(&log.inputs[0]) {
        return None;
    }
    let (output, channel) = log.outputs.iter().zip(&channels[1..]).find(|(output, channel)| {
        (2..=MOST_SWITCHED).contains(&channel.levels) && jumpy(&output.values) && channel.missing == 0
    })?;
    let name = output.quantity.name();
    let text = format!(
        "it has {} values only and jumps between them, as an input does, while the input takes {} or more: are the two columns swapped?",
        channel.levels, input.levels
    );
    Some(Note::new("swapped", Severity::Suspicion, text).on(name))
}

/// Positions along the belt, m per unit.
fn lever(quantity: Quantity, stage: &Machine) -> f64 {
    if quantity.is_linear() { 1.0 } else { stage.pulley_radius }
}

/// Outputs compared with each other: all positions are the belt's, and speeds their rates.
fn consistency(log: &Log, stage: &Machine, channels: &[Channel]) -> Vec<Note> {
    use Quantity::{CartPosition, CartSpeed, DriveAngle, DriveSpeed, IdlerAngle, IdlerSpeed, RotorAngle, RotorSpeed};
    let usable = |output: &&Output| {
        let channel = channels.iter().find(|channel| channel.name == output.quantity.name());
        !output.absolute
            && channel.is_some_and(|c| !c.is_constant() && c.wraps == 0 && c.span() > 10.0 * c.resolution())
    };
    let first = |order: [Quantity; 4]| order.into_iter().filter_map(|q| log.output(q)).find(usable);
    let positions = [CartPosition, DriveAngle, RotorAngle, IdlerAngle];
    let speeds = [CartSpeed, DriveSpeed, RotorSpeed, IdlerSpeed];
    let mut notes = Vec::new();
    for (group, rest) in [(positions, "position"), (speeds, "speed")] {
        let Some(base) = first(group) else { continue };
        for other in group.into_iter().filter_map(|q| log.output(q)).filter(usable) {
            if other.quantity != base.quantity {
                let (y, x) = (travel(&base.values), travel(&other.values));
                let levers = lever(base.quantity, stage) / lever(other.quantity, stage);
                notes.extend(ratio_note(slope(&x, &y) * levers, base, other, stage, rest));
            }
        }
    }
    // A speed adds up to the way.
    if let (Some(position), Some(speed)) = (first(positions), first(speeds)) {
        let mut way = vec![0.0];
        let mut sum = 0.0;
        for k in 1..log.len() {
            let mean = 0.5 * (speed.values[k] + speed.values[k - 1]);
            sum += if mean.is_nan() { 0.0 } else { mean * (log.time[k] - log.time[k - 1]) };
            way.push(sum);
        }
        let levers = lever(position.quantity, stage) / lever(speed.quantity, stage);
        let ratio = slope(&way, &travel(&position.values)) * levers;
        if let Some(kind) = kind(ratio) {
            let (p, s) = (position.quantity.name(), speed.quantity.name());
            let code = if matches!(kind, RatioFault::Sign) { "sign" } else { "unit" };
            let text = match &kind {
                RatioFault::Sign => format!(
                    "it moves against {s}: one of the two has the wrong sign; set scale = {{ {s} = -1 }}, or so for {p}"
                ),
                RatioFault::Factor(factor) => {
                    format!("it goes {factor} what {s} adds up to: is the unit of {p}, of {s} or of the time wrong?")
                }
            };
            // Of a factor the times may be the reason, too.
            let sign = || Remedy::Ratio(position.quantity, speed.quantity, -1.0);
            let remedy = matches!(kind, RatioFault::Sign).then(sign);
            notes.push(Note::new(code, Severity::Suspicion, text).on(p).mended_by(remedy));
        }
    }
    notes
}

/// Positions of slides compared with those that the angles of all drives give.
fn beside_drives(log: &Log, stage: &Machine, channels: &[Channel]) -> Vec<Note> {
    let geometry = stage.geometry();
    let output = |body: usize| {
        let label = geometry.label(body);
        let of_body = |output: &&Output| output.quantity.is_position() && output.quantity.body() == Some(label.key);
        log.outputs.iter().find(|output| of_body(output) && !output.absolute)
    };
    let angles: Vec<Option<&Output>> = geometry.drives.iter().map(|drive| output(drive.pulley)).collect();
    let Some(angles) = angles.into_iter().collect::<Option<Vec<_>>>() else { return Vec::new() };
    let names: Vec<&str> = angles.iter().map(|output| output.quantity.name()).collect();
    let mut notes = Vec::new();
    for slide in geometry.slides {
        let Some(position) = output(slide.body) else { continue };
        let name = position.quantity.name();
        // Where it hardly moves there is nothing to compare.
        if channels.iter().any(|channel| channel.name == name && channel.span() <= 10.0 * channel.resolution()) {
            continue;
        }
        let by_drives: Vec<f64> = (0..log.len())
            .map(|k| {
                let drives = angles.iter().zip(slide.by_drives);
                stage.pulley_radius * drives.map(|(angle, weight)| weight * angle.values[k]).sum::<f64>()
            })
            .collect();
        let Some(kind) = kind(slope(&travel(&by_drives), &travel(&position.values))) else { continue };
        let drives = names.join(" and ");
        let (code, text) = match kind {
            RatioFault::Sign => (
                "sign",
                format!(
                    "it moves against what {drives} give for it: two columns are swapped, or one has the wrong sign; set scale = {{ {name} = -1 }}, or so for an angle"
                ),
            ),
            RatioFault::Factor(factor) => (
                "unit",
                format!(
                    "it goes {factor} what {drives} give for it: is the unit of one of them wrong, or the pulleys' radius?"
                ),
            ),
        };
        notes.push(Note::new(code, Severity::Suspicion, text).on(name));
    }
    notes
}

/// Counted from the first value there is.
fn travel(values: &[f64]) -> Vec<f64> {
    let first = values.iter().copied().find(|x| !x.is_nan()).unwrap_or_default();
    values.iter().map(|x| x - first).collect()
}

/// The slope of y over x through the origin; NaN if x does not move, or the two have little in common.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()) {
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    if xy * xy < 0.8 * xx * yy { f64::NAN } else { xy / xx }
}

/// The fault of a ratio that should be one.
enum RatioFault {
    Sign,
    Factor(String),
}

fn kind(ratio: f64) -> Option<RatioFault> {
    let size = ratio.abs();
    if ratio.is_nan() {
        return None;
    }
    if (0.5..2.0).contains(&size) {
        return (ratio < 0.0).then_some(RatioFault::Sign);
    }
    let times = if size >= 1.0 { format!("{size:.4} times") } else { format!("1/{:.4} of", 1.0 / size) };
    Some(RatioFault::Factor(times.replace(".0000", "")))
}

fn ratio_note(ratio: f64, base: &Output, other: &Output, stage: &Machine, what: &str) -> Option<Note> {
    let (b, o) = (base.quantity, other.quantity);
    // Swapped, the two levers go the wrong way: once too often each.
    let levers = lever(o, stage) / lever(b, stage);
    let swapped = ratio.abs() * levers * levers;
    let (name, other) = (b.name(), o.name());
    let note = |code, text: String, remedy: Remedy| {
        Some(Note::new(code, Severity::Suspicion, text).on(name).mended_by(remedy))
    };
    match kind(ratio)? {
        RatioFault::Sign => note(
            "sign",
            format!(
                "it moves against {other}: one of the two has the wrong sign; set scale = {{ {other} = -1 }}, or so for {name}"
            ),
            Remedy::Ratio(b, o, -1.0),
        ),
        RatioFault::Factor(_) if levers != 1.0 && (0.8..1.25).contains(&(1.0 / swapped)) => note(
            "swapped",
            format!(
                "it and {other} seem to be swapped: exchanged, they agree with the pulley's radius of {}",
                shown(stage.pulley_radius, "m")
            ),
            Remedy::Exchange(b, o),
        ),
        RatioFault::Factor(factor) => {
            let next = match usual_factor(ratio, stage) {
                Some(Factor::Gear) => format!(
                    "that is the gear ratio, and angles of the rotor count at the pulley: set scale = {{ {} = {} }}",
                    if ratio > 1.0 { name } else { other },
                    rounded(1.0 / stage.drives[0].motor.gear_ratio)
                ),
                Some(Factor::Ten) => "that is a power of ten: set units for one of the two".into(),
                None => "is one of their units wrong?".into(),
            };
            let radius = shown(stage.pulley_radius, "m");
            let text =
                format!("it goes {factor} what {other} reports for the same {what}, with a pulley of {radius}: {next}");
            note("unit", text, Remedy::Ratio(b, o, ratio))
        }
    }
}

/// A factor that has a reason.
enum Factor {
    /// The gear ratio of the case, or its inverse.
    Gear,
    /// A power of ten.
    Ten,
}

/// The reason for a measured ratio, if it is within [`NEARLY`] of one.
fn usual_factor(ratio: f64, stage: &Machine) -> Option<Factor> {
    let (size, gear) = (ratio.abs().ln().abs(), stage.drives[0].motor.gear_ratio.ln().abs());
    let tens = size / 10f64.ln();
    if gear > NEARLY && (size - gear).abs() < NEARLY {
        return Some(Factor::Gear);
    }
    (tens.round() > 0.0 && (tens - tens.round()).abs() * 10f64.ln() < NEARLY).then_some(Factor::Ten)
}

/// The units that people confuse, and what a value is wrong by if they do.
fn confused(quantity: Quantity, ratio: f64) -> Option<&'static str> {
    let units: &[(&str, f64)] = match quantity {
        Quantity::CartPosition => &[("mm", 1e3), ("um", 1e6), ("cm", 1e2), ("in", 39.37)],
        Quantity::CartSpeed => &[("mm/s", 1e3), ("mm/min", 6e4), ("cm/s", 1e2)],
        Quantity::DriveAngle | Quantity::IdlerAngle | Quantity::RotorAngle => {
            &[("deg", 57.3), ("mrad", 1e3), ("count", 326.0)]
        }
        _ => &[("rpm", 9.55), ("deg/s", 57.3), ("mrad/s", 1e3)],
    };
    let distance = |factor: f64| (ratio / factor).ln().abs();
    units
        .iter()
        .filter(|(_, f)| distance(*f) < ROUGHLY)
        .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))
        .map(|u| u.0)
}

/// The largest speed and acceleration, against what the machine of the case would do.
fn magnitude(log: &Log, stage: &Machine, motion: &Motion) -> Option<Note> {
    let lever = lever(motion.quantity, stage);
    let (name, unit) = (motion.quantity.name(), motion.unit());
    let Some(expected) = expected(log, stage) else { return idle(log, stage, motion) };
    let ratio = motion.peak_speed * lever / expected.speed;
    if (1.0 / ROUGH..ROUGH).contains(&ratio) {
        return hasty(log, motion, expected.acceleration / lever);
    }
    let (is, would) = (shown(motion.peak_speed, unit), shown(expected.speed / lever, unit));
    let times = if ratio > 1.0 { format!("{ratio:.0} times") } else { format!("1/{:.0} of", 1.0 / ratio) };
    let unit_meant = confused(motion.quantity, ratio);
    let gear = stage.drives[0].motor.gear_ratio;
    let is_gear = unit == "rad/s" && gear != 1.0 && (ratio / gear).ln().abs() < ROUGHLY;
    let factor = match unit_meant {
        Some(meant) => Some(quantity::read(&format!("1 {meant}"), motion.quantity.unit()).unwrap_or(1.0 / ratio)),
        None => is_gear.then_some(1.0 / gear),
    };
    let remedy = factor.map(|factor| Remedy::Unit(motion.quantity, factor));
    let of_rotor = format!(
        "the rotor's before the gear of {}? then set scale = {{ {name} = {} }}",
        rounded(gear),
        rounded(1.0 / gear)
    );
    let next = match unit_meant {
        Some(unit) if is_gear => {
            format!("is the column in {unit}? then set units = {{ {name} = \"{unit}\" }}; or is it {of_rotor}")
        }
        Some(unit) => format!("is the column in {unit}? then set units = {{ {name} = \"{unit}\" }}"),
        None if is_gear => format!("is it {of_rotor}"),
        None if ratio < 1.0 => "are the times in ms or us, or the input in a larger unit? then set units".into(),
        None => format!(
            "is it about {} times too large? then set scale; or check the units of the time and the input",
            rounded(10f64.powf(ratio.log10().round()))
        ),
    };
    let text = format!(
        "it moves at up to {is}, {times} the {would} that the machine of the case would do with this input: {next}"
    );
    Some(Note::new("unit", Severity::Suspicion, text).on(name).mended_by(remedy))
}

/// A log that moves with an input that would not move the machine of the case.
fn idle(log: &Log, stage: &Machine, motion: &Motion) -> Option<Note> {
    let most = log.inputs[0].iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    if most == 0.0 {
        return None;
    }
    let force = drive(stage).force * (stage.drives[0].amplifier.gain * most).abs();
    let coulomb = resistance(stage).1;
    if force * IDLE > coulomb {
        return None;
    }
    let text = format!(
        "it reaches {} at most, which gives {} against {} of friction: the machine of the case would not move, and {} does; is its unit right?",
        shown(most, input_unit(stage)),
        shown(force, "N"),
        shown(coulomb, "N"),
        motion.quantity.name()
    );
    Some(Note::new("unit", Severity::Suspicion, text).on("input"))
}

/// Accelerations that no machine of this kind has, at speeds that it may have: times that pass too quickly.
fn hasty(log: &Log, motion: &Motion, expected: f64) -> Option<Note> {
    let half = (log.len() / 200).clamp(2, 25);
    let rate = |k: usize| {
        let (a, b) = (k - half, k + half);
        (motion.speed[b] - motion.speed[a]).abs() / (log.time[b] - log.time[a])
    };
    if log.len() < 4 * half {
        return None;
    }
    let rates: Vec<f64> = (half..log.len() - half).map(rate).filter(|rate| rate.is_finite()).collect();
    let (most, usual) = (quantile(&rates, 0.995), quantile(&rates, 0.5));
    // What noise makes of a derivative is there all the time.
    if most < HASTY * expected || usual > 0.2 * most {
        return None;
    }
    let unit = format!("{}^2", motion.unit());
    let times = (most / expected).sqrt();
    let text = format!(
        "it accelerates by up to {}, {:.0} times what the machine of the case would do with this input: do the times pass some {times:.0} times too \
         quickly? then set units, or time = {{ every = \"...\" }}",
        shown(most, &unit),
        most / expected
    );
    Some(Note::new("time-unit", Severity::Suspicion, text).on(motion.quantity.name()))
}

/// The motor at the cart: force per volt or ampere, and the braking by its back-EMF, N s/m.
struct Drive {
    force: f64,
    brake: f64,
}

fn drive(stage: &Machine) -> Drive {
    let (motor, r) = (&stage.drives[0].motor, stage.pulley_radius);
    let per_ampere = motor.torque_constant * motor.gear_ratio * motor.gear_efficiency / r;
    match stage.drives[0].amplifier.mode {
        AmplifierMode::Current | AmplifierMode::Position => Drive { force: per_ampere, brake: 0.0 },
        AmplifierMode::Voltage => {
            let force = per_ampere / motor.resistance;
            Drive { force, brake: force * motor.back_emf_constant * motor.gear_ratio / r }
        }
    }
}

/// Viscous and Coulomb friction of all bodies at the cart, N s/m and N.
fn resistance(stage: &Machine) -> (f64, f64) {
    let (cart, r) = (&stage.cart.friction.forward, stage.pulley_radius);
    let pulleys = [&stage.drive_pulley.friction.forward, &stage.idler_pulley.friction.forward];
    let viscous = cart.viscous + pulleys.iter().map(|side| side.viscous).sum::<f64>() / (r * r);
    (viscous, cart.coulomb + pulleys.iter().map(|side| side.coulomb).sum::<f64>() / r)
}

/// The largest speed and acceleration of the cart, m/s and m/s².
struct Expected {
    speed: f64,
    acceleration: f64,
}

/// The motion of the machine as one rigid mass; none if it would hardly move.
fn expected(log: &Log, stage: &Machine) -> Option<Expected> {
    let r = stage.pulley_radius;
    let (motor, cart) = (&stage.drives[0].motor, &stage.cart);
    let pulleys = [&stage.drive_pulley, &stage.idler_pulley];
    let mass = cart.mass
        + pulleys.iter().map(|pulley| pulley.inertia).sum::<f64>() / (r * r)
        + motor.rotor_inertia * (motor.gear_ratio / r).powi(2);
    let (viscous, coulomb) = resistance(stage);
    let drive = drive(stage);
    let slope = viscous + drive.brake;
    let (mut v, mut speed, mut acceleration) = (0.0_f64, 0.0_f64, 0.0_f64);
    for k in 1..log.len() {
        let dt = log.time[k] - log.time[k - 1];
        // F = K i − b v, and with a voltage i = (u − K_e n v / r) / R
        let force = drive.force * stage.drives[0].amplifier.gain * log.inputs[0][k - 1];
        let driven = force.abs() > coulomb || v != 0.0;
        let direction = if v == 0.0 { force.signum() } else { v.signum() };
        if driven {
            let net = force - direction * coulomb;
            acceleration = acceleration.max((net - slope * v).abs() / mass);
            let next = match slope > 0.0 {
                true => net / slope + (v - net / slope) * (-slope * dt / mass).exp(),
                false => v + net * dt / mass,
            };
            v = if v != 0.0 && next * v < 0.0 { 0.0 } else { next };
        }
        speed = speed.max(v.abs());
    }
    let most = log.inputs[0].iter().fold(0.0_f64, |most, u| most.max((stage.drives[0].amplifier.gain * u).abs()));
    let free = match stage.drives[0].amplifier.mode {
        AmplifierMode::Voltage if motor.back_emf_constant > 0.0 => {
            most * r / (motor.back_emf_constant * motor.gear_ratio)
        }
        _ => speed,
    };
    (speed > 1e-3 * free && speed > 0.0).then_some(Expected { speed, acceleration })
}

/// Finding if the axis moves against its input.
fn direction(log: &Log, stage: &Machine, motion: &Motion) -> Option<Note> {
    if motion.absolute {
        return None;
    }
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for (u, v) in log.inputs[0].iter().zip(&motion.speed).filter(|(_, v)| v.is_finite()) {
        let u = u * stage.drives[0].amplifier.gain;
        uu += u * u;
        uv += u * v;
        vv += v * v;
    }
    let correlation = uv / (uu * vv).sqrt();
    if correlation.is_nan() || correlation > -0.6 {
        return None;
    }
    let name = motion.quantity.name();
    let text = format!(
        "it moves against its input (correlation of input and speed {correlation:.2}): swapped wires, or a sign; set \
         scale = {{ {name} = -1 }}, or a negative amplifier.gain"
    );
    Some(Note::new("sign", Severity::Suspicion, text).on(name).mended_by(Remedy::Reverse))
}

/// A current that this motor cannot draw from this voltage.
fn current_note(log: &Log, stage: &Machine) -> Option<Note> {
    let output = log.output(Quantity::MotorCurrent)?;
    let peak = quantile(&output.values.iter().map(|i| i.abs()).collect::<Vec<_>>(), 0.995);
    let most = log.inputs[0].iter().fold(0.0_f64, |most, u| most.max((stage.drives[0].amplifier.gain * u).abs()));
    let most = match stage.drives[0].amplifier.mode {
        AmplifierMode::Voltage => 2.0 * most / stage.drives[0].motor.resistance,
        AmplifierMode::Current => most,
        AmplifierMode::Position => return None,
    };
    if most == 0.0 || peak < ROUGH * most {
        return None;
    }
    let text = format!(
        "it reaches {}, where this motor draws {} at most: is the column in mA? then set units = {{ motor_current = \"mA\" }}",
        shown(peak, "A"),
        shown(most, "A")
    );
    Some(Note::new("unit", Severity::Suspicion, text).on("motor_current"))
}

#[cfg(test)]
mod tests {
    use crate::machine::Quantity;

    #[test]
    fn every_quantity_is_of_one_kind() {
        for quantity in Quantity::all() {
            let is_other = matches!(quantity.unit(), "A" | "V" | "m/s^2");
            let kinds = [quantity.is_speed(), quantity.is_position(), is_other];
            assert_eq!(kinds.iter().filter(|kind| **kind).count(), 1);
        }
    }
}
