//! The key figures on the terminal: of one case, and of several beside each other.

use crate::terminal::bold;
use std::fmt::Write;
use taut::control::drives::drive_gains;
use taut::machine::{AmplifierMode, Machine};
use taut_report::motion::{Tried, controller, length, lines};
use taut_report::simulate::{ended_early, value};

/// Text on the terminal for one case.
pub fn text(tried: &Tried) -> String {
    let mut text = format!("{}\n{}\n", bold(&tried.case.title), controller(tried.design, &tried.case.machine));
    for done in &tried.done {
        let _ = write!(text, "\n{}\n", bold(&done.motion.name));
        if let Some(told) = ended_early(&done.run.outcome.ending, "cart") {
            let _ = writeln!(text, "  {:<16}{}", "ended early", told.trim_start_matches("ended "));
        }
        for (name, words) in lines(tried, done) {
            let _ = writeln!(text, "  {name:<16}{words}");
        }
    }
    text.push('\n');
    text
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
    let amperes = tried.iter().any(|tried| tried.case.machine.drives[0].amplifier.mode == AmplifierMode::Current);
    let paths = tried.iter().flat_map(|tried| &tried.done).any(|done| done.run.figures.contour.is_some());
    let mut text = String::new();
    for name in names {
        let _ = writeln!(text, "{}", bold(name));
        let mut headings = vec!["controller", "cart", "rms"];
        headings.extend(if paths { ["contour", "rms", "settles"] } else { ["following", "settles", "overshoot"] });
        headings.push("current");
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
                length(figures.cart().error.peak.value.abs()),
                length(figures.cart().error.rms),
            ];
            let settles = figures.settling.map_or("no".into(), |s| format!("{:.0} ms", 1e3 * s));
            row.extend(match figures.contour {
                Some(contour) => [length(contour.peak.value.abs()), length(contour.rms), settles],
                None if paths => ["–".into(), "–".into(), settles],
                None => {
                    let following = length(figures.drive().following.peak.value.abs());
                    [following, settles, length(figures.cart().overshoot)]
                }
            });
            row.push(format!("{:.2} A", figures.drive().current.1));
            if !amperes {
                // Each phase of a stepper has a voltage of its own.
                row.push(match case.case.machine.stepper() {
                    Some(_) => "–".into(),
                    None => format!("{:.2} V", figures.drive().voltage.1),
                });
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
    let second = if paths { "contour, rms: distance from the path" } else { "following: y − r φ₁, at most" };
    let _ = write!(text, "cart, rms: y − x; {second}; settles: after the end of the profile; current, voltage: rms");
    text.push_str(if spread {
        "\noff: with each parameter of the axis off, one at a time: largest |y − x|, and how many settle\n"
    } else {
        "\n"
    });
    text
}

/// Feed-forward gains as drives of others take them.
pub fn drives(machine: &Machine) -> String {
    let mut text = format!("\n{}\n", bold("Feed-forward for drives, of the axis as one mass going forward"));
    for gain in drive_gains(machine) {
        let value = value(gain.value, gain.unit);
        let _ = writeln!(text, "  {:<10}{:<34}{value}", gain.system, gain.name);
    }
    text
}
