//! The key figures for people.

use super::{Done, Tried};
use crate::simulate::table::{early_end, plain, time, value};
use crate::terminal::bold;
use std::fmt::Write;
use taut::control::compensation::Rigid;
use taut::control::drives::drive_gains;
use taut::control::sliding;
use taut::design::{Design, FeedForwardModel, Structure};
use taut::metrics::largest;
use taut::stage::{AmplifierMode, EncoderPlace, Stage};

/// A length in µm, in mm from 10 mm on.
fn length(metres: f64) -> String {
    match metres.abs() {
        m if m < 1e-2 => format!("{} µm", plain(metres * 1e6, 1)),
        _ => format!("{} mm", plain(metres * 1e3, 3)),
    }
}

/// What the controller is, in a line.
pub fn controller(design: &Design, stage: &Stage) -> String {
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
    let timing = format!("every {}", time(design.every));
    words.push(if design.delay > 0.0 { format!("{timing}, delay {}", time(design.delay)) } else { timing });
    words.push(match stage.encoder.map(|encoder| encoder.at) {
        None => "measured exactly at the motor".into(),
        Some(at) => {
            let step = match at {
                EncoderPlace::Cart => 1.0,
                _ => stage.pulley_radius,
            } / stage.encoder.map_or(1.0, |encoder| encoder.counts_per_unit(stage.motor.gear_ratio));
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

/// Text on the terminal for one case.
pub fn text(tried: &Tried) -> String {
    let mut text = format!("{}\n{}\n", bold(&tried.case.title), controller(tried.design, &tried.case.stage));
    for done in &tried.done {
        let _ = write!(text, "\n{}\n", bold(&done.motion.name));
        if let Some(told) = early_end(&done.run.outcome.ending) {
            let _ = writeln!(text, "  {:<16}{}", "ended early", told.trim_start_matches("ended "));
        }
        for (name, words) in lines(tried, done) {
            let _ = writeln!(text, "  {name:<16}{words}");
        }
    }
    text.push('\n');
    text
}

/// The key figures of a move with their names.
pub fn lines(tried: &Tried, done: &Done) -> Vec<(&'static str, String)> {
    let (stage, run) = (&tried.case.stage, &done.run);
    let figures = &run.figures;
    let deviation = |d: &taut::control::Deviation| {
        format!("at most {} at {}, {} rms", length(d.peak.value), time(d.peak.time), length(d.rms))
    };
    let (span, stretch) = largest(&run.metrics.peak_stretch);
    let (force_span, force) = largest(&run.metrics.peak_force);
    let settling = match figures.settling {
        Some(settling) => format!("{} after the profile, within {}", time(settling), length(done.motion.window)),
        None => format!("not within {} until the end", length(done.motion.window)),
    };
    let mut held = format!("{} of {} samples", run.samples.1, run.samples.0);
    if stage.amplifier.voltage_limit.is_some() || stage.amplifier.current_limit.is_some() {
        let _ = write!(held, "; the amplifier for {}", time(figures.amplifier_limited));
    }
    let mut lines = vec![
        ("cart error", format!("{}, {} at the end", deviation(&figures.cart), length(figures.final_cart_error))),
        ("following error", deviation(&figures.following)),
        ("settling", settling),
        ("overshoot", length(figures.overshoot)),
        ("peak stretch", format!("{} in span {span} at {}", value(stretch.value, "m"), time(stretch.time))),
        ("peak force", format!("{} in span {force_span} at {}", value(force.value, "N"), time(force.time))),
        ("current", format!("at most {}, {} rms", value(figures.current.0.value, "A"), value(figures.current.1, "A"))),
        ("voltage", format!("at most {}, {} rms", value(figures.voltage.0.value, "V"), value(figures.voltage.1, "V"))),
        ("saturated", held),
        ("energy", format!("{} in, {} back", value(figures.energy.0, "J"), value(figures.energy.1, "J"))),
    ];
    if let Structure::SlidingMode(gains) = &tried.design.structure {
        let (speed, acceleration) = peaks(done);
        let needed = sliding::required(gains, &Rigid::of(stage), 0.2, speed, acceleration);
        let verdict = if gains.reaching > needed { "holds" } else { "does not hold" };
        lines.push((
            "reaching",
            format!(
                "{} m/s², {:.3} m/s² wanted for parameters known to 20 %: Lyapunov's condition {verdict}",
                gains.reaching, needed
            ),
        ));
    }
    if let Some(trouble) = &done.trouble {
        lines.push((trouble.kind.word(), trouble.words.clone()));
    }
    if let Some(worst) = &done.worst {
        let words = format!(
            "cart error at most {} ({}), {} at the end; {} of {} settle",
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

/// Largest speed and acceleration of the reference, m/s and m/s².
fn peaks(done: &Done) -> (f64, f64) {
    let (profile, n) = (&done.motion.profile, 10_000);
    let at = |k: i32| profile.at(profile.end() * f64::from(k) / f64::from(n));
    (0..=n).map(at).fold((0.0, 0.0), |(v, a), y| (f64::max(v, y.speed.abs()), f64::max(a, y.acceleration.abs())))
}

/// One table for each move, a row for each case.
pub fn comparison(tried: &[Tried]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for done in tried.iter().flat_map(|tried| &tried.done) {
        if !names.contains(&done.motion.name.as_str()) {
            names.push(&done.motion.name);
        }
    }
    let spread = tried.iter().flat_map(|tried| &tried.done).any(|done| done.worst.is_some());
    let amperes = tried.iter().any(|tried| tried.case.stage.amplifier.mode == AmplifierMode::Current);
    let mut text = String::new();
    for name in names {
        let _ = writeln!(text, "{}", bold(name));
        let mut headings = vec!["controller", "cart", "rms", "following", "settles", "overshoot", "current"];
        if !amperes {
            headings.push("voltage");
        }
        if spread {
            headings.extend(["off: cart", "settle"]);
        }
        let mut rows = vec![headings.into_iter().map(String::from).collect::<Vec<_>>()];
        for case in tried {
            let Some(done) = case.done.iter().find(|done| done.motion.name == name) else { continue };
            let figures = &done.run.figures;
            let mut row = vec![
                case.case.title.clone(),
                length(figures.cart.peak.value.abs()),
                length(figures.cart.rms),
                length(figures.following.peak.value.abs()),
                figures.settling.map_or("no".into(), |s| format!("{:.0} ms", 1e3 * s)),
                length(figures.overshoot),
                format!("{:.2} A", figures.current.1),
            ];
            if !amperes {
                row.push(format!("{:.2} V", figures.voltage.1));
            }
            if let Some(worst) = &done.worst {
                row.extend([length(worst.error), format!("{}/{}", worst.settled, worst.axes)]);
            }
            rows.push(row);
        }
        let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns)
            .map(|c| rows.iter().filter_map(|row| row.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0))
            .collect();
        for row in &rows {
            let mut line = String::from(" ");
            for (c, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                let _ = if c == 0 { write!(line, " {cell:<width$}") } else { write!(line, "  {cell:>width$}") };
            }
            let _ = writeln!(text, "{}", line.trim_end());
        }
        text.push('\n');
    }
    text.push_str(
        "cart, rms: x − y; following: r φ₁ − y, at most; settles: after the end of the profile; current, voltage: rms",
    );
    text.push_str(if spread {
        "\noff: with each parameter of the axis off, one at a time: largest |x − y|, and how many settle\n"
    } else {
        "\n"
    });
    text
}

/// Feed-forward gains as drives of others take them.
pub fn drives(stage: &Stage) -> String {
    let mut text = format!("\n{}\n", bold("Feed-forward for drives, of the axis as one mass going forward"));
    for gain in drive_gains(stage) {
        let value = value(gain.value, gain.unit);
        let _ = writeln!(text, "  {:<10}{:<34}{value}", gain.system, gain.name);
    }
    text
}
