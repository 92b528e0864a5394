//! Loops that are closed: a move and the loop's margins for what sliders ask, and the tuning.

use crate::Context;
use crate::case::{opened_for, parameters};
use crate::message::{Reply, Request};
use crate::rows::interval;
use serde_json::{Value, json};
use std::cell::Cell;
use std::f64::consts::PI;
use taut::case::{Case, Files, Given, Move, Tuning};
use taut::control::feedback::Feedback;
use taut::control::{Loop, Rows, Standard, each, stream};
use taut::design::Design;
use taut::error::{Error, Result};
use taut::machine::{DriveAt, Machine};
use taut::solve::Solver;
use taut::stages;
use taut::trajectory::Trajectory;
use taut::tune::{Family, Loops, Margins, Verdict, loops, trouble, tune};
use taut_report::motion::{Done, Tried};
use taut_report::tune::{Work, figures, page};

/// Time between two steps of progress, s.
const STEPS: f64 = 0.1;

/// The controllers to begin with: name, and the table `[controller]` on one line, in SI units; and the moves of their
/// case.
pub fn controllers(_: &Request, _: &Context) -> Result<Reply> {
    let one = |(path, text): (&str, &str)| {
        let case = Case::from_text(path, text)?;
        let told = |key: &str| case.value(key).map(|given| written(&given));
        Ok(json!({ "name": case.title, "file": path, "controller": told("controller")?, "moves": told("move")? }))
    };
    let all = stages::inside("sollmann-jouaneh/controllers").map(one).collect::<Result<Vec<_>>>()?;
    Ok(Reply::new(json!({ "controllers": all })))
}

/// A value of a case on one line.
fn written(given: &Given) -> String {
    match given {
        Given::Number(value) => format!("{value:?}"),
        Given::Whole(value) => value.to_string(),
        Given::Text(text) => crate::toml::toml(&json!(text)),
        Given::Truth(truth) => truth.to_string(),
        Given::List(all) => format!("[{}]", all.iter().map(written).collect::<Vec<_>>().join(", ")),
        Given::Table(all) => {
            let pairs: Vec<String> = all.iter().map(|(key, value)| format!("{key} = {}", written(value))).collect();
            format!("{{ {} }}", pairs.join(", "))
        }
    }
}

/// One move and the margins of its loop: what every move of a gain's slider asks for.
pub fn closed(request: &Request, context: &Context) -> Result<Reply> {
    let case = opened_for(request, context, Files::Nothing)?;
    let begun = context.elapsed();
    let (design, moves) = case.moves_named(context.host.name(), &[])?;
    let place = (request.number("move").unwrap_or(0.0).max(0.0) as usize).min(moves.len() - 1);
    let motion = moves[place];
    let shown = Curves::new(&case.machine);
    let mut kept = shown.columns();
    let done = moved(&case, design, motion, context, &mut |block| kept.take(block))?;
    let tried = Tried { case: &case, design, done: vec![done] };
    let done = &tried.done[0];
    let lines = taut_report::motion::lines(&tried, done);
    let told = taut::json::moves(
        &case.title,
        design.structure.name(),
        &Loop::new(design),
        &case.machine,
        &[done.told(&case.machine)],
    );
    let opened = case.clone();
    let sliding = if case.is_axis() { "cart" } else { "bridge or cart" };
    let mut reply = Reply::new(json!({
        "title": case.title,
        "text": case.text,
        "moves": moves.iter().map(|one| json!({ "name": one.name, "until": one.until })).collect::<Vec<_>>(),
        "move": place,
        "until": motion.until,
        "profile_end": motion.end(),
        "curves": shown.told(),
        "controller": taut_report::motion::controller(design, &case.machine),
        "rows": lines.iter().map(|(name, value)| json!([name, value.replace('-', "−")])).collect::<Vec<_>>(),
        "ending": taut_report::simulate::ended_early(&done.run.outcome.ending, sliding),
        "trouble": warnings(done),
        "result": told,
        "parameters": parameters(&opened, &opened.numbers()?),
    }));
    match nyquist(&case, design) {
        Ok((margins, limit, curves, is_linear)) => {
            let rows = taut_report::tune::margins(&margins, &margins);
            let mut rows: Vec<Value> = rows.iter().map(|(name, value, _)| json!([name, value])).collect();
            if !is_linear {
                rows.insert(0, json!(["at rest", "for small motions alone"]));
            }
            reply.head.insert("margins".into(), json!({ "rows": rows, "limit": limit, "stable": margins.stable }));
            for (name, values) in ["hertz", "re", "im", "sensitivity", "complementary"].into_iter().zip(curves) {
                kept.put(name, values);
            }
        }
        // What has no loop has no L to show.
        Err(error) => {
            reply.head.insert("margins".into(), json!({ "without": error.what }));
        }
    }
    reply.head.insert("columns".into(), kept.told());
    reply.head.insert("took_s".into(), json!(context.elapsed() - begun));
    reply.columns = kept.values;
    Ok(reply)
}

/// Runs a move, its rows to `sink`.
pub fn moved<'a>(
    case: &'a Case,
    design: &Design,
    motion: &'a Move,
    context: &Context,
    sink: &mut dyn FnMut(&Trajectory),
) -> Result<Done<'a>> {
    let machine = &case.machine;
    let mut controllers = Standard::of_drives(design, machine)?;
    let profiles = motion.references(design);
    let count = (motion.until / motion.every).ceil().max(1.0) as u64;
    let rows =
        Rows { until: motion.until, every: interval(motion.every, count).min(motion.until), window: motion.window };
    let mut take = |block: &Trajectory| {
        sink(block);
        context.flow()
    };
    let (timing, solver) = (Loop::new(design), Solver::for_machine(machine));
    let run = stream(machine, &mut each(&mut controllers), &timing, &profiles, &rows, solver, false, &mut take)?;
    let trouble = trouble::trouble(machine, design, &run, motion);
    let shortfalls = motion.shortfalls(machine, design);
    Ok(Done { motion, run, curves: None, worst: None, trouble, shortfalls, files: Vec::new() })
}

/// The limits that the move exceeds, and the trouble of its loop, in words; nothing for a move that is followed.
fn warnings(done: &Done) -> Option<String> {
    let short = done.shortfalls.iter().map(|short| &*short.words);
    let words: Vec<&str> = short.chain(done.trouble.as_ref().map(|trouble| &*trouble.words)).collect();
    (!words.is_empty()).then(|| words.join("; "))
}

/// The margins on the axis as the file has it, the limit of Ms, and frequency, Re L, Im L where Ms stands, |S| and |T|
/// at the worst break; and whether the controller is linear.
fn nyquist(case: &Case, design: &Design) -> Result<(Margins, f64, [Vec<f64>; 5], bool)> {
    let tuning = case.tune.clone().unwrap_or_default();
    let feedback = Feedback::new(design, &case.machine)?;
    let family = Family::new(case, &tuning)?;
    let plant = family.plant(&family.nominal(), design, &feedback.corners())?;
    let margins = Margins::new(&plant, &feedback);
    let open = loops(&plant, &feedback);
    let of = |value: &dyn Fn(&Loops) -> f64| open.iter().map(value).collect::<Vec<f64>>();
    let (at, drive) = (margins.breaks.sensitivity, margins.breaks.gain_drive);
    let curves = [
        plant.frequency.iter().map(|omega| omega / (2.0 * PI)).collect(),
        of(&|open| open.broken_at(at, drive).re),
        of(&|open| open.broken_at(at, drive).im),
        of(&Loops::sensitivity),
        of(&Loops::complementary),
    ];
    Ok((margins, tuning.sensitivity, curves, feedback.is_linear()))
}

/// A curve of a move: its name and its column.
struct Shown {
    name: &'static str,
    column: String,
}

/// The curves of a move that are shown, by picture.
struct Curves {
    error: Vec<Shown>,
    position: Vec<Shown>,
    command: Vec<Shown>,
}

impl Curves {
    fn new(machine: &Machine) -> Self {
        let geometry = machine.geometry();
        let slides: Vec<&str> = geometry.slides.iter().map(|slide| geometry.label(slide.body).key).collect();
        let is_alone = slides.len() == 1;
        let curve = |name, column: String| Shown { name, column };
        let error = |key| curve(if is_alone { "y − x" } else { key }, format!("{key}_error"));
        let position = |key| {
            let reference = if is_alone { "reference".into() } else { format!("{key}_reference") };
            [curve("reference", reference), curve(key, format!("{key}_position"))]
        };
        let command = |at: &DriveAt| {
            curve(if is_alone { "voltage" } else { at.prefix.trim_end_matches('_') }, format!("{}voltage", at.prefix))
        };
        Self {
            error: slides.iter().copied().map(error).collect(),
            position: slides.iter().copied().flat_map(position).collect(),
            command: geometry.drives.iter().map(command).collect(),
        }
    }

    fn told(&self) -> Value {
        let all = |curves: &[Shown]| -> Vec<Value> {
            curves.iter().map(|one| json!({ "name": one.name, "column": one.column })).collect()
        };
        json!({ "error": all(&self.error), "position": all(&self.position), "command": all(&self.command) })
    }

    /// Columns for all of them, and the time.
    fn columns(&self) -> Columns {
        let all = [&self.error, &self.position, &self.command].into_iter().flatten();
        let names: Vec<String> = std::iter::once("time".into()).chain(all.map(|one| one.column.clone())).collect();
        Columns { values: vec![Vec::new(); names.len()], of_move: names.len(), names }
    }
}

/// Columns by name; the first are those of a move.
struct Columns {
    names: Vec<String>,
    values: Vec<Vec<f64>>,
    of_move: usize,
}

impl Columns {
    fn take(&mut self, block: &Trajectory) {
        for (name, values) in self.names.iter().zip(&mut self.values).take(self.of_move) {
            values.extend_from_slice(block.get(name).unwrap_or(&[]));
        }
    }

    fn put(&mut self, name: &str, values: Vec<f64>) {
        self.names.push(name.into());
        self.values.push(values);
    }

    fn told(&self) -> Value {
        let pairs = self.names.iter().zip(&self.values);
        pairs.map(|(name, values)| json!({ "name": name, "rows": values.len() })).collect()
    }
}

/// Tunes the controller: the page of `taut tune`, and the text with the gains.
pub fn tuned(request: &Request, context: &Context) -> Result<Reply> {
    let case = opened_for(request, context, Files::Nothing)?;
    let mut tuning: Tuning = case.tune.clone().unwrap_or_default();
    tuning.spread = request.number("spread").or(tuning.spread);
    let begun = context.elapsed();
    let (looks, last) = (Cell::new(0u64), Cell::new(begun));
    let stop = || {
        looks.set(looks.get() + 1);
        let now = context.elapsed();
        if now - last.get() > STEPS {
            last.set(now);
            (context.progress)(json!({ "designs": looks.get(), "took_s": now - begun }));
        }
        context.is_stopped()
    };
    let tuned = match tune(&case, &tuning, &stop) {
        Err(_) if context.is_stopped() => return Err(Error::new("stopped before any gains were found")),
        tuned => tuned?,
    };
    let work = Work { case: &case, tuning: &tuning, tuned: &tuned };
    let text = tuned.case_text(&case, context.host.name())?;
    let page = page(&work, &text, &figures(&work)?);
    let worst = |verdict: &Verdict| verdict.moves.iter().map(|one| point(&one.at_worst)).collect::<Vec<_>>();
    let choices = tuned.choices.iter().map(|choice| {
        json!({ "name": choice.name, "chosen": choice.chosen, "worst": choice.worst.iter().map(point).collect::<Vec<_>>() })
    });
    Ok(Reply::new(json!({
        "html": page.body(),
        "result": taut::json::tuned(&case, &tuning, &tuned),
        "text": text,
        "verdict": taut_report::tune::summary(&work),
        "moves": tuned.moves.iter().map(|one| &one.name).collect::<Vec<_>>(),
        "before": worst(&tuned.before),
        "after": worst(&tuned.after),
        "choices": choices.collect::<Vec<_>>(),
        "stopped": context.is_stopped(),
        "took_s": context.elapsed() - begun,
    })))
}

/// A move at worst: error (m), settling (s), current (A).
fn point(worst: &taut::tune::AtWorst) -> Value {
    let number = |value: f64| value.is_finite().then_some(value);
    json!({ "error": number(worst.error.0), "settles": worst.settles.1.then_some(worst.settles.0), "current": number(worst.current) })
}
