//! A tuning in words: rows of a name, before and after.

use super::Work;
use std::f64::consts::PI;
use std::fmt::Write;
use taut::control::Deviation;
use taut::design::InDrives;
use taut::number::{engineering, significant};
use taut::tune::{
    AtWorst, Break, Corner, Family, Figure, Forced, Hunt, Judgement, Limit, Margins, MoveVerdict, SPREAD, Source,
    Standing, Worse,
};

/// A length in µm.
fn length(metres: f64) -> String {
    if metres.is_finite() { format!("{:.1} µm", 1e6 * metres) } else { "does not end".into() }
}

/// Before and after, with a name.
pub type Row = (String, String, String);

/// A value with four digits in its unit, spaces as on a keyboard.
fn number(value: f64, unit: &str) -> String {
    engineering(value, unit, 4).replace('\u{a0}', " ")
}

/// The gains.
pub fn gains(work: &Work) -> Vec<Row> {
    let name = |key: &str| key.trim_start_matches("controller.").to_string();
    let row = |(gain, after): (taut::tune::Gain, f64)| {
        (name(gain.key), number(gain.value, gain.unit), number(after, gain.unit))
    };
    let mut rows: Vec<Row> = work.tuned.changes().into_iter().map(row).collect();
    if let Some([before, after]) = work.tuned.filters() {
        rows.push(("filters".into(), before, after));
    }
    rows
}

/// Gains and filters as drives have them; filters that only one side has stand beside a dash.
pub fn in_drives(work: &Work) -> Vec<Row> {
    let [before, after] = [&work.tuned.before, &work.tuned.after].map(|verdict| verdict.design.in_drives());
    let told = |gain: Option<&InDrives>| match gain {
        Some(gain) if gain.unit == "dB" => format!("{:.1} dB", gain.value),
        Some(gain) => format!("{} {}", significant(gain.value, 4), gain.unit).trim_end().to_string(),
        None => "-".into(),
    };
    let row = |k: usize| {
        let [before, after] = [before.get(k), after.get(k)];
        let name = after.or(before).map_or("", |gain| gain.name);
        (name.to_string(), told(before), told(after))
    };
    (0..before.len().max(after.len())).map(row).collect()
}

/// A frequency.
pub fn hertz(omega: f64) -> String {
    if omega.is_finite() { format!("{:.2} Hz", omega / (2.0 * PI)) } else { "none".into() }
}

/// Point and drive at which the loop is broken for a margin; empty if the loop is the same everywhere or unstable.
fn broken(margins: &Margins, at: Break, drive: Option<usize>) -> String {
    let at = (!margins.has_one_loop).then(|| told(at));
    let parts = [at, drive.and_then(|drive| margins.drive_name(drive))];
    let parts = parts.into_iter().flatten().filter(|_| margins.stable);
    parts.map(|part| format!(", {part}")).collect()
}

/// The parts that slide, in a word.
fn sliding(work: &Work) -> &'static str {
    if work.case.is_axis() { "cart" } else { "bridge or cart" }
}

/// A break in words.
pub fn told(at: Break) -> &'static str {
    match at {
        Break::Command => "at the command",
        Break::Position => "at the encoder",
        Break::Scale => "at the scale",
        Break::Current => "at the measured current",
    }
}

/// Margins before and after, one row each.
pub fn margins(before: &Margins, after: &Margins) -> Vec<Row> {
    let factor = |m: &Margins| match m.gain {
        _ if !m.stable => "none".into(),
        gain if gain.is_infinite() => "any".into(),
        gain => {
            format!("{gain:.2} ({:.1} dB){}", 20.0 * gain.log10(), broken(m, m.breaks.gain, Some(m.breaks.gain_drive)))
        }
    };
    let angle = |m: &Margins| match m.phase.is_finite() {
        true => format!("{:.1}°{}", m.phase.to_degrees(), broken(m, m.breaks.phase, Some(m.breaks.phase_drive))),
        false => "any".into(),
    };
    type Shown<'a> = Box<dyn Fn(&Margins) -> String + 'a>;
    let peak = |value: f64| if value.is_finite() { format!("{value:.3}") } else { "not stable".into() };
    let top = |m: &Margins| {
        if m.stable { format!(" at {}", hertz(m.at)) } else { format!(", oscillates at {}", hertz(m.at)) }
    };
    let rows: [(&str, Shown); 7] = [
        (
            "Ms",
            Box::new(move |m| format!("{}{}{}", peak(m.sensitivity), top(m), broken(m, m.breaks.sensitivity, None))),
        ),
        ("Mt", Box::new(move |m| format!("{}{}", peak(m.complementary), broken(m, m.breaks.complementary, None)))),
        ("gain margin", Box::new(factor)),
        ("phase margin", Box::new(angle)),
        ("crossover", Box::new(|m| hertz(m.crossover))),
        ("bandwidth", Box::new(|m| hertz(m.bandwidth))),
        ("reference to cart, -3 dB", Box::new(|m| hertz(m.tracking))),
    ];
    rows.iter().map(|(name, shown)| (name.to_string(), shown(before), shown(after))).collect()
}

/// The number of an axis of the family, by which it is referred to; the words are in [`axes`].
fn numbered(work: &Work, place: usize) -> String {
    match place {
        0 => "the axis of the file".into(),
        place if place < work.tuned.family.machines.len() => format!("axis {place}"),
        _ => "the worst corner".into(),
    }
}

/// Its place in the family; behind all of them the worst corner.
fn place(work: &Work, corner: &Corner) -> usize {
    let machines = &work.tuned.family.machines;
    machines.iter().position(|machine| machine == corner).unwrap_or(machines.len())
}

/// The axes on which margins are worst, before and after.
pub fn limiting(work: &Work) -> [String; 2] {
    [&work.tuned.before, &work.tuned.after].map(|verdict| numbered(work, place(work, &verdict.corner)))
}

/// Every axis that is referred to, with what is off on it; each once.
pub fn axes(work: &Work) -> Vec<[String; 2]> {
    let family = &work.tuned.family;
    let mut all: Vec<(usize, &Corner)> = Vec::new();
    for verdict in [&work.tuned.before, &work.tuned.after] {
        all.push((place(work, &verdict.corner), &verdict.corner));
        let erring = verdict.moves.iter().map(|one| one.at_worst.error.1);
        all.extend(erring.map(|place| (place, family.machines.get(place).unwrap_or(&verdict.corner))));
    }
    all.sort_by_key(|(place, _)| *place);
    all.dedup_by_key(|(place, _)| *place);
    all.into_iter().map(|(place, corner)| [numbered(work, place), family.words(corner)]).collect()
}

/// The moves before and after.
pub fn moves(work: &Work) -> Vec<Row> {
    let (before, after) = (&work.tuned.before.moves, &work.tuned.after.moves);
    let cart = |cart: &Deviation| format!("{}, {} rms", length(cart.peak.value.abs()), length(cart.rms));
    let settles = |time: Option<f64>| time.map_or("not".into(), |time| format!("after {:.0} ms", 1e3 * time));
    let amperes = |value: f64| if value.is_finite() { number(value, "A") } else { "none".into() };
    let mut rows = Vec::new();
    for (was, is) in before.iter().zip(after) {
        let mut row = |name: &str, of: &dyn Fn(&MoveVerdict) -> String| rows.push((name.to_string(), of(was), of(is)));
        row(&format!("{}: {} error", was.name, sliding(work)), &|one| cart(&one.cart));
        row("  settles", &|one| settles(one.settling));
        row("  current", &|one| format!("{} rms", amperes(one.current)));
        row(&format!("  at worst: {} error", sliding(work)), &|one| {
            format!("{} on {}", length(one.worst.0), numbered(work, one.at_worst.error.1))
        });
        row("  at worst: settles", &|one| settles(slowest(&one.at_worst)));
        row("  at worst: current", &|one| format!("{} rms", amperes(one.at_worst.current)));
        row("  axes that settle", &|one| format!("{} of {}", one.settled.0, one.settled.1));
    }
    rows
}

/// Time until the cart settles at worst, if it does.
fn slowest(worst: &AtWorst) -> Option<f64> {
    worst.settles.1.then_some(worst.settles.0)
}

/// The first line: what became of the moves, and what forces it.
pub fn verdict(work: &Work) -> String {
    let tuned = work.tuned;
    let (before, after) = (&tuned.before, &tuned.after);
    let mut told: Vec<String> = before.moves.iter().zip(&after.moves).filter_map(|(was, is)| change(was, is)).collect();
    let amplitude = |hunt: &Option<Hunt>| hunt.as_ref().map_or(0.0, |hunt| hunt.amplitude);
    let (was, is) = (amplitude(&before.hunt), amplitude(&after.hunt));
    if before.hunt.is_some() != after.hunt.is_some() || is > 1.1 * was {
        told.push(format!("at rest the {} {}", sliding(work), hunts(is, was)));
    }
    let told = if told.is_empty() { String::new() } else { format!(": {}", told.join("; ")) };
    match (tuned.judgement, &tuned.forced) {
        (Judgement::Better, _) => format!("BETTER{told}"),
        (Judgement::Unchanged, _) => {
            "UNCHANGED: no gains were found that make the moves better within the limits".into()
        }
        (Judgement::Worse, None) => format!("WORSE than the gains of the file{told}{}", least(work)),
        (Judgement::Worse, Some(forced)) => {
            let advice = tuned.advice.as_ref().map_or(String::new(), |advice| format!(". What helps: {advice}"));
            format!("WORSE than the gains of the file{told}. {}{}{advice}", reason(forced), least(work))
        }
    }
}

/// The first lines in one: the verdict, and the feed-forward that pays.
pub fn summary(work: &Work) -> String {
    [Some(verdict(work)), ahead(work)].into_iter().flatten().collect::<Vec<_>>().join(". ")
}

/// The gain by feed-forward, and how to have it, a sentence of its own; none where it does not pay.
pub fn ahead(work: &Work) -> Option<String> {
    let tuned = work.tuned;
    let ahead = tuned.ahead.as_ref()?;
    let moves = tuned.after.moves.iter().zip(&ahead.verdict.moves).map(|(without, with)| {
        let error =
            |one: &MoveVerdict| format!("{} ({} at worst)", length(one.cart.peak.value.abs()), length(one.worst.0));
        let mut words = format!("{}: error {} instead of {}", with.name, error(with), error(without));
        if with.settled.0 < without.settled.0 {
            let _ = write!(words, ", settles on {} axes instead of {}", with.settled.0, without.settled.0);
        }
        words
    });
    let moves: Vec<String> = moves.collect();
    Some(format!("Feed-forward helps: {}. Write `feed_forward = {}` in [controller]", moves.join("; "), ahead.text()))
}

/// Why gains are worse than those of the file.
fn reason(forced: &Forced) -> String {
    let place = format!("by {:.1} Hz with the cart at {:.0} mm", forced.mode, 1e3 * forced.place);
    match (forced.limit, forced.standing) {
        (Limit::Bandwidth, _) => {
            format!("The gains come from pole placement at {:.1} Hz, without a search", forced.mode)
        }
        (limit, Standing::WayBack) => format!("The limit of {} is the cause, {place}", limit.word()),
        (limit, Standing::File) => {
            format!(
                "The gains of the file break the limit of {} {place}, and no gains were found that keep it without a worse figure",
                limit.word()
            )
        }
    }
}

/// The design that comes nearest to being no worse, as a sentence of its own.
fn least(work: &Work) -> String {
    let Some(least) = &work.tuned.least else { return String::new() };
    let Worse { motion, figure, before, after, .. } = least.worse;
    let at_rest = format!("at rest the {}", sliding(work));
    let name = motion.map_or(&at_rest, |motion| &work.tuned.moves[motion].name);
    let what = match figure {
        Figure::Hunting => hunts(after, before),
        Figure::Error => format!("error {} ({} before)", length(after), length(before)),
        Figure::Settling => format!("settles after {:.0} ms ({:.0} ms before)", 1e3 * after, 1e3 * before),
        Figure::Settled => format!("settles on {after} axes ({before} before)"),
    };
    let which = if least.design == work.tuned.after.design { "these" } else { "`least_worse` in tune.json" };
    format!(". Of the gains that keep the limits, {which} have the smallest deterioration: {name}: {what}")
}

/// The change of a move at worst, in words; none where there is none.
fn change(was: &MoveVerdict, is: &MoveVerdict) -> Option<String> {
    let mut words = Vec::new();
    if was.worst.0 != is.worst.0 {
        words.push(format!("worst-case error {} ({} before)", length(is.worst.0), length(was.worst.0)));
    }
    if was.settled.0 != is.settled.0 {
        words.push(format!("settles on {} of {} axes ({} before)", is.settled.0, is.settled.1, was.settled.0));
    }
    (!words.is_empty()).then(|| format!("{}: {}", was.name, words.join(", ")))
}

/// The first sentence on the gains of the file: that they break the limits themselves.
pub fn given(work: &Work) -> Option<String> {
    let (before, tuning) = (&work.tuned.before, work.tuning);
    if before.worst.excess(tuning.sensitivity, tuning.complementary) <= 1.0 {
        return None;
    }
    let (nominal, worst) = (&before.nominal, &before.worst);
    let mut told = Vec::new();
    if !nominal.stable {
        told.push(format!("not stable on the nominal axis, oscillating at {}", hertz(nominal.at)));
    } else if nominal.excess(tuning.sensitivity, tuning.complementary) > 1.0 {
        let (ms, gain) = (nominal.sensitivity, nominal.gain);
        let peak = match nominal.complementary > tuning.complementary && ms <= tuning.sensitivity {
            true => format!("Mt {:.3}", nominal.complementary),
            false => format!("Ms {ms:.3}"),
        };
        told.push(format!("{peak}, gain margin {gain:.2} on the nominal axis"));
    }
    if worst.stable {
        let axis = numbered(work, place(work, &before.corner));
        let peaks = [
            ("Ms", worst.sensitivity, tuning.sensitivity, worst.at),
            ("Mt", worst.complementary, tuning.complementary, worst.complementary_at),
        ];
        for (name, peak, limit, at) in peaks.into_iter().filter(|(_, peak, limit, _)| peak > limit) {
            told.push(format!("{name} {peak:.3} instead of {limit} at {} on {axis}", hertz(at)));
        }
    }
    let (unstable, all) = before.unstable;
    if unstable > 0 {
        told.push(format!("not stable on {unstable} of {all} axes"));
    }
    Some(format!("The gains of the file break the limits: {}.", told.join("; ")))
}

/// The choices between stiff and gentle: name, whether chosen, and of each move error, settling and current at worst.
pub fn choices(work: &Work) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for choice in &work.tuned.choices {
        for (place, (motion, worst)) in work.tuned.moves.iter().zip(&choice.worst).enumerate() {
            let settles = slowest(worst).map_or("not".into(), |time| format!("{:.0} ms", 1e3 * time));
            let name = if choice.chosen { format!("{} (chosen)", choice.name) } else { choice.name.to_string() };
            let first = if place == 0 { [name, format!("{:.3}", choice.objective.exp())] } else { Default::default() };
            let figures = [motion.name.clone(), length(worst.error.0), settles, number(worst.current, "A")];
            rows.push(first.into_iter().chain(figures).collect());
        }
    }
    rows
}

/// Headings of [`choices`].
pub const CHOICES: [&str; 6] = ["choice", "J", "move", "cart error", "settles", "current, rms"];

/// How far a cart hunts with the new gains and with those of the file; amplitudes in m, 0 at rest.
fn hunts(after: f64, before: f64) -> String {
    match [after, before].map(|amplitude| amplitude == 0.0) {
        [true, _] => format!("no longer hunts, {} before", swing(before)),
        [_, true] => format!("hunts by {}, and did not before", swing(after)),
        [false, false] => format!("hunts by {}, {} before", swing(after), swing(before)),
    }
}

/// The swing of a hunting axis.
fn swing(amplitude: f64) -> String {
    match amplitude {
        0.0 => "not".into(),
        _ if amplitude.is_nan() => "slips too rare to be simulated".into(),
        _ => format!("± {}", length(amplitude)),
    }
}

/// A limit cycle in words.
pub fn hunt(hunt: &Option<Hunt>) -> String {
    let Some(hunt) = hunt else { return "none after a slow reversal".into() };
    let slips = match hunt.slips_every.is_finite() {
        true => format!("slips again every {} s", number(hunt.slips_every, "")),
        false => String::new(),
    };
    let how = match hunt.amplitude.is_nan() {
        true => {
            format!("the cart sticks, and the integral makes it slip again after {} s", number(hunt.slips_every, ""))
        }
        false => format!(
            "cart ± {} {} {} s{}{slips}",
            length(hunt.amplitude),
            if hunt.irregular { "irregularly, on average every" } else { "every" },
            number(hunt.period, ""),
            if slips.is_empty() { "" } else { ", " },
        ),
    };
    let needs = match &hunt.needs[..] {
        [] => "whatever is left out".into(),
        needs => format!("not without {}", needs.join(", nor without ")),
    };
    format!("{how}; {needs}")
}

/// Varied parameters by name after a fit: those fitted, and those not.
fn varied(family: &Family, fitted: &str) -> String {
    let names = |is_fitted: bool| -> String {
        let own = family.unknowns.iter().filter(|unknown| unknown.is_fitted == is_fitted);
        own.map(|unknown| unknown.name.clone()).collect::<Vec<_>>().join(", ")
    };
    let spread = format!("± {} %", number(100.0 * SPREAD, ""));
    match [names(true), names(false)] {
        [own, rest] if rest.is_empty() => format!("{own} {fitted}"),
        [own, rest] if own.is_empty() => format!("{rest} {spread}"),
        [own, rest] => format!("{own} {fitted}; never fitted: {rest} {spread}"),
    }
}

/// The family that the limits had to hold over.
pub fn family(work: &Work) -> String {
    let family = &work.tuned.family;
    let off = match family.source {
        Source::Fit => varied(family, "within the 95 % intervals of the fit"),
        Source::Posterior(draws) => varied(family, &format!("as drawn from the posterior, {draws} draws")),
        Source::Spread(share) => format!("{} parameters ± {} %", family.unknowns.len(), number(100.0 * share, "")),
    };
    let places = match &family.places[..] {
        [first, .., last] => {
            format!(", {} places from {:.0} mm to {:.0} mm", family.places.len(), 1e3 * first, 1e3 * last)
        }
        _ => String::new(),
    };
    let loads = if family.loads.len() > 1 { format!(", {} loads", family.loads.len()) } else { String::new() };
    let machines = family.machines.len();
    let level = match (family.corners, family.left_out(machines)) {
        (true, _) => format!("{machines} axes and the worst corner of all of them"),
        (false, 0) => format!("{machines} axes, the worst of them"),
        (false, left_out) => format!("{machines} axes, the worst of the central 95 % ({left_out} left out)"),
    };
    format!("{off}{loads}{places}: {level}")
}

/// Certificate of the tuned loop for every machine of the family: what is proven, and the nearest violation.
pub fn certificate(work: &Work) -> Vec<String> {
    let (family, own) = (&work.tuned.family, &work.tuned.certificate);
    let spread = |factor: f64| match family.source {
        Source::Spread(share) => format!("± {} %", number(100.0 * share * factor, "")),
        Source::Fit | Source::Posterior(_) => format!("{} % of the intervals", number(100.0 * factor, "")),
    };
    let proven = match (&own.reason, own.bounds) {
        (Some(reason), _) => format!("nothing is proven: {reason}"),
        (None, Some([ms, mt])) => format!("proven: Ms ≤ {ms:.3}, Mt ≤ {mt:.3} in the whole family, {}", spread(1.0)),
        (None, None) => format!("proven: the limits hold within {} of all parameters at once", spread(own.factor)),
    };
    let violated = own.violation.as_ref().map(|violation| {
        let (margins, tuning) = (&violation.margins, work.tuning);
        let what = if !margins.stable {
            format!("not stable, oscillates at {}", hertz(margins.at))
        } else if margins.sensitivity / tuning.sensitivity >= margins.complementary / tuning.complementary {
            let at = broken(margins, margins.breaks.sensitivity, None);
            format!("Ms {:.3} at {}{at}", margins.sensitivity, hertz(margins.at))
        } else {
            let at = broken(margins, margins.breaks.complementary, None);
            format!("Mt {:.3} at {}{at}", margins.complementary, hertz(margins.complementary_at))
        };
        format!("violated at {}: {what}, with {}", spread(violation.factor), family.words(&violation.corner))
    });
    let none = (own.reason.is_none()).then(|| "violated by no machine that was found in the family".into());
    std::iter::once(proven).chain(violated.or(none)).collect()
}

/// The goal of the search.
pub fn goal(work: &Work) -> String {
    let tuning = work.tuning;
    let limits = format!("Ms ≤ {}, Mt ≤ {}", tuning.sensitivity, tuning.complementary);
    let placed = work.tuned.placed.map(|hertz| format!("{} Hz, damping {}", number(hertz, ""), tuning.damping));
    match (tuning.cost, placed) {
        (None, placed) => format!("placed for {}; limits are {limits}", placed.unwrap_or_default()),
        (Some(cost), Some(placed)) => format!("cost \"{}\" with {limits}; began with {placed}", cost.word()),
        (Some(cost), None) => format!("cost \"{}\" with {limits}", cost.word()),
    }
}
