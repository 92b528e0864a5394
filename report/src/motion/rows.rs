//! A move in words.

use super::{Done, Tried};
use crate::simulate::rows::lost_steps;
use crate::simulate::{accuracy, plain, time, value};
use taut::control::{Accuracy, Deviation, DriveFigures, LoadFigures, MoveRun, sliding};
use taut::design::{Design, FeedForwardModel, Structure};
use taut::machine::rigid::Rigid;
use taut::machine::{DriveUnit, EncoderPlace, Machine};
use taut::metrics::Peak;

/// A length in µm, in mm from 10 mm on.
pub fn length(metres: f64) -> String {
    match metres.abs() {
        m if m < 1e-2 => format!("{} µm", plain(metres * 1e6, 1)),
        _ => format!("{} mm", plain(metres * 1e3, 3)),
    }
}

/// The controller in a line.
pub fn controller(design: &Design, machine: &Machine) -> String {
    let mut words = vec![design.structure.name().to_string()];
    match design.feed_forward.model {
        FeedForwardModel::None => {}
        FeedForwardModel::Rigid => words.push("rigid feed-forward".into()),
        FeedForwardModel::Elastic => words.push("elastic feed-forward".into()),
    }
    if design.feed_forward.compensate_stretch {
        words.push("stretch-compensated reference".into());
    }
    if design.disturbance_observer.is_some() {
        words.push("disturbance observer".into());
    }
    match design.filters.len() {
        0 => {}
        1 => words.push("a filter".into()),
        n => words.push(format!("{n} filters")),
    }
    if !design.shaper.is_empty() {
        words.push(format!("shaper of {} impulses", design.shaper.len()));
    }
    if let Some(stepper) = machine.stepper() {
        words.push(if stepper.interpolate { "commanded" } else { "commanded in microsteps" }.into());
        if design.is_open_loop() {
            return words.join(", ");
        }
    }
    let timing = format!("every {}", time(design.every));
    words.push(if design.delay > 0.0 { format!("{timing}, delay {}", time(design.delay)) } else { timing });
    words.push(match machine.encoder.map(|encoder| encoder.at) {
        None => "measured exactly at the motor".into(),
        Some(at) => {
            let step =
                match at {
                    EncoderPlace::Cart => 1.0,
                    _ => machine.pulley_radius,
                } / machine.encoder.map_or(1.0, |encoder| encoder.counts_per_unit(machine.drives[0].motor.gear_ratio));
            let place = match at {
                EncoderPlace::Motor => "motor",
                EncoderPlace::DrivePulley => "drive pulley",
                EncoderPlace::Cart => "cart",
            };
            format!("encoder resolution {} at the {place}", length(step))
        }
    });
    words.join(", ")
}

/// The key figures of a move with their names.
pub fn lines(tried: &Tried, done: &Done) -> Vec<(&'static str, String)> {
    let (machine, run) = (&tried.case.machine, &done.run);
    let (figures, geometry) = (&run.figures, machine.geometry());
    let deviation =
        |d: &Deviation| format!("at most {} at {}, {} rms", length(d.peak.value), time(d.peak.time), length(d.rms));
    let (place, stretch) = run.metrics.largest_stretch();
    let (force_place, force) = run.metrics.largest_force();
    let span = |number: usize| geometry.spans[number].label.name;
    let loads = geometry.slides.iter().map(|slide| geometry.label(slide.body).name);
    let of_loads = |words: &dyn Fn(&LoadFigures) -> String| each(loads.clone(), &figures.loads, words);
    let drives = geometry.drives.iter().map(|drive| drive.label.name.trim_end_matches(" drive"));
    let of_drives = |words: &dyn Fn(&DriveFigures) -> String| each(drives.clone(), &figures.drives, words);
    let largest =
        |(peak, rms): (Peak, f64), unit: &str| format!("at most {}, {} rms", value(peak.value, unit), value(rms, unit));
    let settling = match figures.settling {
        Some(settling) => format!("{} after the profile, within {}", time(settling), length(done.motion.window)),
        None => format!("not within {} until the end", length(done.motion.window)),
    };
    let mut lines = vec![
        (
            if figures.loads.len() == 1 { "cart error" } else { "error" },
            of_loads(&|load| format!("{}, {} at the end", deviation(&load.error), length(load.error.last))),
        ),
        ("following error", of_drives(&|drive| deviation(&drive.following))),
        ("settling", settling),
        ("overshoot", of_loads(&|load| length(load.overshoot))),
        ("peak stretch", format!("{} in {} at {}", value(stretch.value, "m"), span(place), time(stretch.time))),
        ("peak force", format!("{} in {} at {}", value(force.value, "N"), span(force_place), time(force.time))),
        ("current", of_drives(&|drive| largest(drive.current, "A"))),
    ];
    let accuracy = ("accuracy", accuracy(&run.outcome, Accuracy::basis(machine, run)));
    // A stepper has no samples, and its phases have voltages of their own.
    match lost_steps(&run.metrics, geometry) {
        Some(lost) => lines.extend([accuracy, ("lost steps", lost)]),
        None => lines.extend([
            ("voltage", of_drives(&|drive| largest(drive.voltage, "V"))),
            ("saturated", saturated(machine, run, &of_drives(&|drive| time(drive.amplifier_limited)))),
            (
                "energy",
                of_drives(&|drive| format!("{} in, {} back", value(drive.energy.0, "J"), value(drive.energy.1, "J"))),
            ),
            accuracy,
        ]),
    }
    if let Some(contour) = &figures.contour {
        lines.insert(1, ("contour error", format!("{}, {} at the end", deviation(contour), length(contour.last))));
    }
    if let Structure::SlidingMode(gains) = &tried.design.structure {
        let (speed, acceleration) = peaks(done);
        let needed = sliding::required(gains, &Rigid::new(machine), 0.2, speed, acceleration);
        let verdict = if gains.reaching > needed { "holds" } else { "does not hold" };
        lines.push((
            "reaching",
            format!(
                "{} m/s², {:.3} m/s² wanted for parameters known to 20 %: Lyapunov's condition {verdict}",
                gains.reaching, needed
            ),
        ));
    }
    lines.extend(done.shortfalls.iter().map(|short| ("out of reach", short.words.clone())));
    if let Some(trouble) = &done.trouble {
        lines.push((trouble.kind.word(), trouble.words.clone()));
    }
    if let Some(worst) = &done.worst {
        let words = format!(
            "{} at most {} ({}), {} at the end; {} of {} settle",
            if figures.loads.len() == 1 { "cart error" } else { "error" },
            length(worst.error),
            worst.axis,
            length(worst.last),
            worst.settled,
            worst.axes
        );
        lines.push(("spread", words));
    }
    lines
}

/// Samples at the limit of the command, and the time that amplifiers with limits are at theirs.
fn saturated(machine: &Machine, run: &MoveRun, amplifiers: &str) -> String {
    let is_limited =
        |unit: &DriveUnit| unit.amplifier.voltage_limit.is_some() || unit.amplifier.current_limit.is_some();
    let samples = format!("{} of {} samples", run.samples.1, run.samples.0);
    match machine.drives.iter().any(is_limited) {
        true => format!("{samples}; the amplifier for {amplifiers}"),
        false => samples,
    }
}

/// Words about each part: alone where there is one, with its name where there are several.
fn each<'a, T>(names: impl Iterator<Item = &'a str>, parts: &[T], words: &dyn Fn(&T) -> String) -> String {
    match parts {
        [only] => words(only),
        _ => names.zip(parts).map(|(name, part)| format!("{name} {}", words(part))).collect::<Vec<_>>().join("; "),
    }
}

/// Largest speed and acceleration of the reference, m/s and m/s².
fn peaks(done: &Done) -> (f64, f64) {
    let (profile, n) = (&done.motion.profile(), 10_000);
    let at = |k: i32| profile.at(profile.end() * f64::from(k) / f64::from(n));
    (0..=n).map(at).fold((0.0, 0.0), |(v, a), y| (f64::max(v, y.speed.abs()), f64::max(a, y.acceleration.abs())))
}
