//! Nyquist's curve, sensitivity, and the moves before and after.

use super::Work;
use crate::simulate::{Named, decimator};
use crate::{Axis, Colour, Figure, Panel, Series, Style};
use std::f64::consts::PI;
use taut::Result;
use taut::case::Move;
use taut::control::feedback::Feedback;
use taut::control::{Loop, Rows, Standard, stream};
use taut::solve::{Flow, Solver};
use taut::tune::{Corner, Verdict, loops};

/// The largest |L| that is drawn: more of it would hide the point −1.
const FAR: f64 = 3.0;

/// |S| is shown from this part of the frequency of its lowest peak: below, it only falls.
const BELOW_PEAK: f64 = 30.0;

/// All of them, with names for files.
pub fn figures(work: &Work) -> Result<Vec<(String, Figure)>> {
    let mut figures: Vec<(String, Figure)> = frequency(work)?.into_iter().map(|(n, f)| (n.to_string(), f)).collect();
    figures.push(("bode".into(), bode(work)?));
    for motion in &work.tuned.moves {
        figures.push((format!("{}-before-and-after", motion.file_name()), moved(work, motion)?));
    }
    Ok(figures)
}

/// L and |S| of the loop before and after, on the axis as it is taken for and on the worst.
fn frequency(work: &Work) -> Result<Vec<Named>> {
    let tuned = work.tuned;
    let nominal = tuned.family.nominal();
    let curves: [(&str, &Verdict, &Corner, Colour, Style); 4] = [
        ("before", &tuned.before, &nominal, Colour::Amber, Style::Solid),
        ("before, worst axis", &tuned.before, &tuned.before.corner, Colour::Amber, Style::Dashed),
        ("after", &tuned.after, &nominal, Colour::Blue, Style::Solid),
        ("after, worst axis", &tuned.after, &tuned.after.corner, Colour::Vermillion, Style::Dashed),
    ];
    let mut nyquist = Panel::new(Axis::new("Im L", "")).weight(2.2);
    let mut sensitivity = Panel::new(Axis::new("|S|", "").logarithmic()).weight(1.2);
    let mut complementary = Panel::new(Axis::new("|T|", "").logarithmic());
    let (mut peak, mut last) = (f64::INFINITY, 0.0);
    for (name, verdict, corner, colour, style) in curves {
        let feedback = Feedback::new(&verdict.design, &work.case.stage)?;
        let plant = tuned.family.plant(corner, &verdict.design, &feedback.corners())?;
        let open = loops(&plant, &feedback);
        let hertz: Vec<f64> = plant.frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        let near = |value: f64, size: f64| if size < FAR { value } else { f64::NAN };
        let re: Vec<f64> = open.iter().map(|l| near(l.position.re, l.position.norm())).collect();
        let im: Vec<f64> = open.iter().map(|l| near(l.position.im, l.position.norm())).collect();
        nyquist = nyquist.series(Series::new(name, re, im).colour(colour).style(style));
        let s: Vec<f64> = open.iter().map(|l| (l.position + 1.0).inv().norm().max(1e-4)).collect();
        let t: Vec<f64> = open.iter().map(|l| (l.position / (l.position + 1.0)).norm().max(1e-4)).collect();
        peak = hertz.iter().zip(&s).max_by(|a, b| a.1.total_cmp(b.1)).map_or(peak, |(hertz, _)| peak.min(*hertz));
        last = hertz.last().map_or(last, |hertz| hertz.max(last));
        sensitivity = sensitivity.series(Series::new(name, hertz.clone(), s).colour(colour).style(style));
        complementary = complementary.series(Series::new("", hertz, t).colour(colour).style(style));
    }
    // |1 + L| = 1/Ms: within this circle the sensitivity is larger.
    let limit = work.tuning.sensitivity;
    let circle = |k: i32| 2.0 * PI * f64::from(k) / 180.0;
    let (x, y): (Vec<f64>, Vec<f64>) =
        (0..=180).map(|k| (-1.0 + circle(k).cos() / limit, circle(k).sin() / limit)).unzip();
    nyquist = nyquist.series(Series::new(format!("Ms = {limit}"), x, y).colour(Colour::Green).style(Style::Dotted));
    nyquist = nyquist.series(Series::new("−1", [-1.0], [0.0]).colour(Colour::Ink).style(Style::Crosses));
    sensitivity = sensitivity.horizontal(limit, "limit");
    complementary = complementary.horizontal(work.tuning.complementary, "limit");
    Ok(vec![
        (
            "nyquist",
            Figure::new("Nyquist's curve of the sampled loop", Axis::new("Re L", "")).panel(nyquist).equal().caption(
                "L broken at the measured position, up to half the sampling rate. No curve may enter the circle around −1.",
            ),
        ),
        (
            "sensitivity",
            Figure::new("Sensitivity", Axis::new("Frequency", "Hz").logarithmic())
                .panel(sensitivity)
                .panel(complementary)
                .view(peak / BELOW_PEAK, last)
                .caption("S = 1/(1 + L) and T = L/(1 + L), on the axis as the file has it and on the worst."),
        ),
    ])
}

/// Magnitude and phase of L before and after on the axis as it is taken for, with the crossover after and the modes
/// along the travel marked.
fn bode(work: &Work) -> Result<Figure> {
    let tuned = work.tuned;
    let nominal = tuned.family.nominal();
    let mut magnitude = Panel::new(Axis::new("|L|, dB", "")).weight(1.3);
    let mut phase = Panel::new(Axis::new("Phase of L", "°"));
    let mut last = 0.0_f64;
    for (name, verdict, colour) in [("before", &tuned.before, Colour::Amber), ("after", &tuned.after, Colour::Blue)] {
        let feedback = Feedback::new(&verdict.design, &work.case.stage)?;
        let plant = tuned.family.plant(&nominal, &verdict.design, &feedback.corners())?;
        let open = loops(&plant, &feedback);
        let hertz: Vec<f64> = plant.frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        last = hertz.last().copied().unwrap_or(last).max(last);
        let decibels: Vec<f64> = open.iter().map(|l| 20.0 * l.position.norm().max(1e-12).log10()).collect();
        // From 0 down to −360°: −180° is what margins are counted from.
        let turned = |angle: f64| if angle > 0.0 { angle - 360.0 } else { angle };
        let degrees: Vec<f64> = open.iter().map(|l| turned(l.position.arg().to_degrees())).collect();
        magnitude = magnitude.series(Series::new(name, hertz.clone(), decibels).colour(colour));
        phase = phase.series(Series::new("", hertz, degrees).colour(colour));
    }
    let after = &tuned.after.nominal;
    let told = format!(
        "The open loop on the axis as the file has it. After: phase margin {:.1}° at the crossover, gain margin {:.2}; vertical lines are the \
         crossover and the axis' own modes in the middle of its travel.",
        after.phase.to_degrees(),
        after.gain
    );
    let mut figure = Figure::new("Bode diagram of the open loop", Axis::new("Frequency", "Hz").logarithmic())
        .panel(magnitude.horizontal(0.0, ""))
        .panel(phase.horizontal(-180.0, "−180°"))
        .view(0.1, last)
        .caption(told);
    if after.crossover.is_finite() {
        figure = figure.vertical(after.crossover / (2.0 * PI), "crossover");
    }
    for (number, mode) in tuned.modes.iter().filter(|mode| **mode < last).enumerate() {
        figure = figure.vertical(*mode, format!("mode {}", number + 1));
    }
    Ok(figure)
}

/// The cart's error in a move, before and after, and the command.
fn moved(work: &Work, motion: &Move) -> Result<Figure> {
    let stage = &work.case.stage;
    let mut error = Panel::new(Axis::new("Cart x − y", "m").shown_as("µm", 1e6)).weight(1.6);
    let mut command = Panel::new(Axis::new("Voltage", "V"));
    for (name, verdict, colour) in
        [("before", &work.tuned.before, Colour::Amber), ("after", &work.tuned.after, Colour::Blue)]
    {
        let design = &verdict.design;
        let mut controller = Standard::new(design, stage)?;
        let profile = motion.profile.clone().shaped(&design.shaper);
        let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
        let (mut x, mut u) = (decimator(), decimator());
        stream(stage, &mut controller, &Loop::of(design), &profile, &rows, Solver::of(stage), false, &mut |block| {
            let column = |name: &str| block.get(name).unwrap_or(&[]);
            x.push(column("time"), column("cart_error"));
            u.push(column("time"), column("voltage"));
            Flow::Continue
        })?;
        let ((t, x), (time, u)) = (x.points(), u.points());
        error = error.series(Series::new(name, t, x).colour(colour));
        command = command.series(Series::new("", time, u).colour(colour));
    }
    Ok(Figure::new(format!("{}: before and after", motion.name), Axis::new("Time", "s"))
        .panel(error)
        .panel(command)
        .vertical(motion.profile.end(), "end of the profile")
        .caption("By how much the cart is off, and what it takes, on the axis as the file has it."))
}
