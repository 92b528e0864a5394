//! Nyquist's curve, sensitivity, and the moves before and after.

use super::Work;
use super::rows::told;
use crate::decimate::Decimator;
use crate::simulate::{Named, decimator};
use crate::{Axis, Colour, Figure, Panel, Series, Style};
use nalgebra::Complex;
use std::f64::consts::PI;
use taut::Result;
use taut::case::Move;
use taut::control::feedback::Feedback;
use taut::control::{Loop, Rows, Standard, each, stream};
use taut::machine::Machine;
use taut::solve::{Flow, Solver};
use taut::tune::{Corner, Loops, Verdict, loops};

/// The largest |L| that is drawn: more of it would hide the point −1.
const FAR: f64 = 3.0;

/// |S| is shown from this part of the frequency of its lowest peak: below, it only falls.
const BELOW_PEAK: f64 = 30.0;

/// All of them, with names for files.
pub fn figures(work: &Work) -> Result<Vec<(String, Figure)>> {
    let mut figures: Vec<(String, Figure)> = frequency(work)?.into_iter().map(|(n, f)| (n.to_string(), f)).collect();
    figures.push(("bode".into(), bode(work)?));
    figures.push(("closed-loop".into(), closed(work)?));
    figures.push(("step".into(), step(work)?));
    for motion in &work.tuned.moves {
        figures.push((format!("{}-before-and-after", motion.file_name()), moved(work, motion)?));
    }
    Ok(figures)
}

/// L and |S| of the loop before and after, on the nominal axis and on the worst.
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
        let feedback = Feedback::new(&verdict.design, &work.case.machine)?;
        let plant = tuned.family.plant(corner, &verdict.design, &feedback.corners())?;
        let open = loops(&plant, &feedback);
        let hertz: Vec<f64> = plant.frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        // The loop whose sensitivity is the highest.
        let margins = if corner == &nominal { &verdict.nominal } else { &verdict.worst };
        let at = margins.breaks.sensitivity;
        let name = if margins.has_one_loop { name.to_string() } else { format!("{name}, {}", told(at)) };
        let drive = margins.breaks.gain_drive;
        let curve = open.iter().map(|open| open.broken_at(at, drive));
        // Beyond, there is no line.
        let near: Vec<Complex<f64>> =
            curve.map(|l| if l.norm() < FAR { l } else { Complex::new(f64::NAN, f64::NAN) }).collect();
        let (re, im): (Vec<f64>, Vec<f64>) = near.iter().map(|l| (l.re, l.im)).unzip();
        nyquist = nyquist.series(Series::new(name.clone(), re, im).colour(colour).style(style));
        let highest = |of: fn(&Loops) -> f64| -> Vec<f64> { open.iter().map(|open| of(open).max(1e-4)).collect() };
        let (s, t) = (highest(Loops::sensitivity), highest(Loops::complementary));
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
                "L where its sensitivity is the highest, up to half the sampling rate. No curve may enter the circle around −1.",
            ),
        ),
        (
            "sensitivity",
            Figure::new("Sensitivity", Axis::new("Frequency", "Hz").logarithmic())
                .panel(sensitivity)
                .panel(complementary)
                .view(peak / BELOW_PEAK, last)
                .caption(
                    "S = 1/(1 + L) and T = L/(1 + L) at the worst break, on the axis as the file has it and on the worst.",
                ),
        ),
    ])
}

/// Magnitude and phase of L before and after on the nominal axis, with the crossover after and the modes
/// along the travel marked.
fn bode(work: &Work) -> Result<Figure> {
    let tuned = work.tuned;
    let nominal = tuned.family.nominal();
    let mut magnitude = Panel::new(Axis::new("|L|, dB", "")).weight(1.3);
    let mut phase = Panel::new(Axis::new("Phase of L", "°"));
    let mut last = 0.0_f64;
    for (name, verdict, colour) in [("before", &tuned.before, Colour::Amber), ("after", &tuned.after, Colour::Blue)] {
        let feedback = Feedback::new(&verdict.design, &work.case.machine)?;
        let plant = tuned.family.plant(&nominal, &verdict.design, &feedback.corners())?;
        let open = loops(&plant, &feedback);
        let hertz: Vec<f64> = plant.frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        last = hertz.last().copied().unwrap_or(last).max(last);
        let (at, drive) = (verdict.nominal.breaks.phase, verdict.nominal.breaks.phase_drive);
        let curve: Vec<Complex<f64>> = open.iter().map(|open| open.broken_at(at, drive)).collect();
        let decibels: Vec<f64> = curve.iter().map(|l| 20.0 * l.norm().max(1e-12).log10()).collect();
        // From 0 down to −360°: −180° is what margins are counted from.
        let turned = |angle: f64| if angle > 0.0 { angle - 360.0 } else { angle };
        let degrees: Vec<f64> = curve.iter().map(|l| turned(l.arg().to_degrees())).collect();
        magnitude = magnitude.series(Series::new(name, hertz.clone(), decibels).colour(colour));
        phase = phase.series(Series::new("", hertz, degrees).colour(colour));
    }
    let after = &tuned.after.nominal;
    let which =
        if after.has_one_loop { "The open loop" } else { "The open loop, broken where its phase margin is least," };
    let told = format!(
        "{which} on the axis as the file has it. After: phase margin {:.1}°, gain margin {:.2}; vertical lines are the \
         crossover of the position loop and the axis' own modes in the middle of its travel.",
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

/// A closed loop with its name, colour and style: frequencies, rad/s, and the way from the reference of what slides to
/// what slides without feed-forward.
type LoopCurve = (String, Colour, Style, Vec<f64>, Vec<Complex<f64>>);

/// The keys of the parts that slide, with styles.
fn slides(machine: &Machine) -> impl Iterator<Item = (&'static str, Style)> {
    let geometry = machine.geometry();
    let keys = geometry.slides.iter().map(|slide| geometry.label(slide.body).key);
    keys.zip([Style::Solid, Style::Dashed])
}

/// The name of a curve of a part that slides: with that part, where there are several.
fn of_slide(machine: &Machine, name: &str, key: &str) -> String {
    if machine.geometry().slides.len() > 1 { format!("{name}, {key}") } else { name.to_string() }
}

/// The loops before and after on the nominal axis, those alone that are stable.
fn ways(work: &Work) -> Result<Vec<LoopCurve>> {
    let nominal = work.tuned.family.nominal();
    let both = [("before", &work.tuned.before, Colour::Amber), ("after", &work.tuned.after, Colour::Blue)];
    let mut all = Vec::new();
    for (name, verdict, colour) in both.into_iter().filter(|(_, verdict, _)| verdict.nominal.stable) {
        let feedback = Feedback::new(&verdict.design, &work.case.machine)?;
        let plant = work.tuned.family.plant(&nominal, &verdict.design, &feedback.corners())?;
        let loops = loops(&plant, &feedback);
        for (number, (key, style)) in slides(&work.case.machine).enumerate() {
            let way = loops.iter().map(|open| open.reference_to_slides[number]).collect();
            let name = of_slide(&work.case.machine, name, key);
            all.push((name, colour, style, plant.frequency.clone(), way));
        }
    }
    Ok(all)
}

/// The closed loop over frequency, with -3 dB and the modes marked.
fn closed(work: &Work) -> Result<Figure> {
    let mut magnitude = Panel::new(Axis::new("|x/y|, dB", ""));
    let mut last = 1.0_f64;
    for (name, colour, style, frequency, way) in ways(work)? {
        let hertz: Vec<f64> = frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        last = hertz.last().copied().unwrap_or(last).max(last);
        let decibels: Vec<f64> = way.iter().map(|way| 20.0 * way.norm().max(1e-6).log10()).collect();
        magnitude = magnitude.series(Series::new(name, hertz, decibels).colour(colour).style(style));
    }
    let mut figure = Figure::new("From the reference to the cart", Axis::new("Frequency", "Hz").logarithmic())
        .panel(magnitude.horizontal(-3.0, "−3 dB"))
        .view(0.1, last)
        .caption(
            "The closed loop without feed-forward, on the axis as the file has it; a loop that is not stable has none.",
        );
    for (number, mode) in work.tuned.modes.iter().filter(|mode| **mode < last).enumerate() {
        figure = figure.vertical(*mode, format!("mode {}", number + 1));
    }
    Ok(figure)
}

/// Samples of a step response that are shown, at most, and how long it is: times the inverse of the slowest bandwidth.
const SHOWN: usize = 600;
const LONG: f64 = 2.0;

/// The step of the closed loop.
fn step(work: &Work) -> Result<Figure> {
    let every = work.tuned.after.design.every;
    let both = [&work.tuned.before, &work.tuned.after];
    let slowest = both.iter().map(|verdict| verdict.nominal.tracking / (2.0 * PI)).filter(|hertz| *hertz > 0.0);
    let until = LONG / slowest.fold(f64::INFINITY, f64::min);
    let until = if until.is_finite() && until > 0.0 { until.min(20.0) } else { 1.0 };
    let mut panel = Panel::new(Axis::new("Cart, per step", ""));
    for (name, colour, style, frequency, way) in ways(work)? {
        let (time, values) = step_response(&frequency, &way, every, until);
        panel = panel.series(Series::new(name, time, values).colour(colour).style(style));
    }
    Ok(Figure::new("Step of the reference", Axis::new("Time", "s")).panel(panel.horizontal(1.0, "")).caption(
        "The cart after a step of the reference, without feed-forward and limits: the sampled loop while everything slides, on the axis as \
         the file has it.",
    ))
}

/// The step response of a sampled way H with no pole outside the unit circle, sums of its pulse response
/// h[k] = 2T/π ∫ Re H cos(ωkT) dω from 0 to π/T, Re H straight from one frequency to the next.
fn step_response(frequency: &[f64], way: &[Complex<f64>], every: f64, until: f64) -> (Vec<f64>, Vec<f64>) {
    let samples = ((until / every) as usize).clamp(2, 20_000);
    let stride = samples.div_ceil(SHOWN);
    let (mut time, mut values, mut sum) = (vec![0.0], vec![0.0], 0.0);
    for k in 1..samples {
        let t = k as f64 * every;
        // ∫ (a + b ω) cos ωt dω = [(a + b ω) sin ωt/t] + b [cos ωt]/t²
        let mut integral = way[0].re * (frequency[0] * t).sin() / t;
        for (w, h) in frequency.windows(2).zip(way.windows(2)) {
            let slope = (h[1].re - h[0].re) / (w[1] - w[0]);
            integral += (h[1].re * (w[1] * t).sin() - h[0].re * (w[0] * t).sin()) / t;
            integral += slope * ((w[1] * t).cos() - (w[0] * t).cos()) / (t * t);
        }
        sum += 2.0 * every / PI * integral;
        if k % stride == 0 {
            time.push(t);
            values.push(sum);
        }
    }
    (time, values)
}

/// The cart's error in a move, before and after, and the command.
fn moved(work: &Work, motion: &Move) -> Result<Figure> {
    let stage = &work.case.machine;
    let mut error = Panel::new(Axis::new("y − x", "m").shown_as("µm", 1e6)).weight(1.6);
    let mut command = Panel::new(Axis::new("Voltage", "V"));
    for (name, verdict, colour) in
        [("before", &work.tuned.before, Colour::Amber), ("after", &work.tuned.after, Colour::Blue)]
    {
        let design = &verdict.design;
        let mut controllers = Standard::of_drives(design, stage)?;
        let profiles = motion.references(design);
        let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
        let errors = slides(stage).map(|(key, style)| (of_slide(stage, name, key), format!("{key}_error"), style));
        let styles = [Style::Solid, Style::Dashed];
        let drives = stage.geometry().drives.iter().zip(styles);
        let voltages = drives.map(|(at, style)| (String::new(), format!("{}voltage", at.prefix), style));
        let kept = |(name, column, style)| (name, column, style, decimator());
        let (mut x, mut u): (Vec<_>, Vec<_>) = (errors.map(kept).collect(), voltages.map(kept).collect());
        let timing = Loop::new(design);
        let (controllers, solver) = (&mut each(&mut controllers), Solver::for_machine(stage));
        stream(stage, controllers, &timing, &profiles, &rows, solver, false, &mut |block| {
            let column = |name: &str| block.get(name).unwrap_or(&[]);
            x.iter_mut().chain(&mut u).for_each(|(_, name, _, kept)| kept.push(column("time"), column(name)));
            Flow::Continue
        })?;
        let series = |(name, _, style, kept): (String, String, Style, Decimator)| {
            let (time, values) = kept.points();
            Series::new(name, time, values).colour(colour).style(style)
        };
        error = x.into_iter().map(series).fold(error, Panel::series);
        command = u.into_iter().map(series).fold(command, Panel::series);
    }
    Ok(Figure::new(format!("{}: before and after", motion.name), Axis::new("Time", "s"))
        .panel(error)
        .panel(command)
        .vertical(motion.end(), "end of the profile")
        .caption("By how much what slides is off, and what it takes, on the machine as the file has it."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_of_a_sampled_lag_is_its_own() {
        // H(z) = (1 − a)/(z − a): s[k] = 1 − aᵏ
        let (every, a) = (1e-3, 0.98_f64);
        let frequency: Vec<f64> =
            (0..=4000).map(|i| PI / every * 10f64.powf(-6.0 + 6.0 * f64::from(i) / 4000.0)).collect();
        let way: Vec<Complex<f64>> =
            frequency.iter().map(|w| (Complex::new(0.0, w * every).exp() - a).inv() * (1.0 - a)).collect();
        let (time, values) = step_response(&frequency, &way, every, 0.3);
        for (t, value) in time.iter().zip(&values) {
            let exact = 1.0 - a.powf((t / every).round());
            assert!((value - exact).abs() < 2e-3, "{t}: {value} {exact}");
        }
    }
}
