//! One experiment simulated: what every move of a slider asks for.

use crate::Context;
use crate::case::{chosen, opened, parameters, runnable};
use crate::curves::{Kept, bodies, panels, told};
use crate::message::{Reply, Request};
use crate::rows::interval;
use serde_json::{Value, json};
use std::time::Duration;
use taut::case::{Case, Experiment};
use taut::control::Loop;
use taut::error::Result;
use taut::json::Simulation;
use taut::metrics::Meter;
use taut::overview::Overview;
use taut::reduction::Reduction;
use taut::solve::{self, Outcome, Solver, stream_observed};
use taut_report::motion::Tried;
use taut_report::simulate::{self, Curves};

/// Events that are told.
const EVENTS: usize = 2000;

/// Simulates `experiment` of the case; with `describe`, the answer says what there is, too.
pub fn run(request: &Request, context: &Context) -> Result<Reply> {
    let case = opened(request, context)?;
    runnable(&case)?;
    let begun = context.elapsed();
    let (simulated, kept) = match &case {
        case if case.experiments.is_empty() && !case.moves.is_empty() => {
            axis(&case.moves, request, |place| move_run(case, place, context))?
        }
        case => axis(&case.experiments, request, |place| experiment_run(case, place, context))?,
    };
    let took = context.elapsed() - begun;
    let numbers = case.numbers()?;
    let mut reply = Reply::new(json!({
        "title": case.title.as_str(),
        "has_controller": case.controller.is_some(),
        "has_moves": !case.moves.is_empty(),
        "text": case.text.as_str(),
        "experiments": names(&case),
        "experiment": simulated.place,
        "until": simulated.until,
        "values": numbers.iter().map(|number| json!([number.key, number.value])).collect::<Vec<_>>(),
        "rows": simulated.rows,
        "ending": simulated.early,
        "events": simulated.outcome.events.iter().take(EVENTS).map(event).collect::<Vec<_>>(),
        "events_left_out": simulated.outcome.events.len().saturating_sub(EVENTS),
        "scene": simulate::scene(&case),
        "columns": kept.told(),
        "panels": simulated.panels,
        "bodies": bodies(&case),
        "result": simulated.json,
        "took_s": took,
    }));
    if request.flag("describe") {
        reply.head.insert("parameters".into(), parameters(&case, &numbers));
    }
    reply.head.insert("overview".into(), overview(&case));
    reply.columns = kept.columns;
    Ok(reply)
}

/// A run, as it is told.
struct Simulated {
    place: usize,
    until: f64,
    rows: Value,
    early: Option<String>,
    outcome: Outcome,
    panels: Value,
    json: Value,
}

/// Runs the experiment that the request names, of either kind of machine.
fn axis<E>(
    experiments: &[E],
    request: &Request,
    run: impl FnOnce(usize) -> Result<(Simulated, Kept)>,
) -> Result<(Simulated, Kept)> {
    run(chosen(request, experiments.len())?)
}

fn experiment_run(case: &Case, place: usize, context: &Context) -> Result<(Simulated, Kept)> {
    let (machine, experiment) = (&case.machine, &case.experiments[place]);
    let opened = case.clone();
    let panels = panels(&opened, &machine.mechanism().columns);
    let shown = Experiment { every: interval(experiment.every, experiment.samples()), ..experiment.clone() };
    let solver = Solver::for_machine(machine);
    let mut kept = Kept::new(&panels);
    let run = simulated(case, &shown, solver, context, &mut Keep::Columns(&mut kept))?;
    let lines = simulate::lines(&run, machine, solver);
    let json = serde_json::to_value(Simulation::new(case, solver, &[run.told()])).unwrap_or_default();
    let simulated = Simulated {
        place,
        until: experiment.until,
        rows: lines_told(lines.into_iter().filter(|(name, _)| *name != "cost")),
        early: simulate::early_end(&run, machine),
        outcome: run.outcome,
        panels: told(&panels),
        json,
    };
    Ok((simulated, kept))
}

/// A move in closed loop, of a case that has no experiments.
fn move_run(case: &Case, place: usize, context: &Context) -> Result<(Simulated, Kept)> {
    let (design, moves) = case.moves_named(context.host.name(), &[])?;
    let opened = case.clone();
    let panels = panels(&opened, &case.machine.mechanism().columns);
    let mut kept = Kept::new(&panels);
    let done = crate::closed::moved(case, design, moves[place], context, &mut |block| kept.take(block))?;
    let timing = Loop::new(design);
    let json =
        taut::json::moves(&case.title, design.structure.name(), &timing, &case.machine, &[done.told(&case.machine)]);
    let tried = Tried { case, design, done: vec![done] };
    let rows = lines_told(taut_report::motion::lines(&tried, &tried.done[0]).into_iter());
    let outcome = tried.done.into_iter().next().map(|done| done.run.outcome);
    let Some(outcome) = outcome else { return Err(taut::Error::new("there is no such move")) };
    let early = simulate::ended_early(&outcome.ending, "cart");
    let simulated = Simulated { place, until: moves[place].until, rows, early, outcome, panels: told(&panels), json };
    Ok((simulated, kept))
}

/// Where rows go.
pub enum Keep<'a> {
    /// To the page.
    Columns(&'a mut Kept),
    /// To the plots of a report.
    Curves,
}

/// Runs an experiment, stopped when nobody waits for it.
pub fn simulated<'a>(
    case: &Case,
    experiment: &'a Experiment,
    solver: Solver,
    context: &Context,
    keep: &mut Keep,
) -> Result<simulate::SimulatedExperiment<'a>> {
    let begun = context.elapsed();
    let machine = &case.machine;
    let mut meter = Meter::new(machine, experiment);
    let mut curves = matches!(keep, Keep::Curves).then(|| Curves::new(machine));
    let outcome = stream_observed(machine, experiment, solver, &mut meter, &mut |block| {
        if let Keep::Columns(kept) = keep {
            kept.take(block);
        }
        if let Some(curves) = &mut curves {
            curves.take(block);
        }
        context.flow()
    })?;
    let metrics = meter.finish(&outcome.events);
    let reduction = Reduction::new(machine, experiment, solver)?;
    let took = Duration::try_from_secs_f64(context.elapsed() - begun).unwrap_or_default();
    Ok(simulate::SimulatedExperiment {
        experiment,
        outcome,
        metrics,
        curves,
        samples: None,
        band: None,
        log: None,
        reduction,
        files: Vec::new(),
        took,
    })
}

/// Names and lengths of the experiments.
fn names(case: &Case) -> Value {
    let one = |name: &str, until: f64| json!({ "name": name, "until": until });
    match case {
        case if case.experiments.is_empty() => case.moves.iter().map(|m| one(&m.name, m.until)).collect(),
        case => case.experiments.iter().map(|e| one(&e.name, e.until)).collect(),
    }
}

fn lines_told<N: AsRef<str>>(lines: impl Iterator<Item = (N, String)>) -> Value {
    lines.map(|(name, value)| json!([name.as_ref(), value.replace('-', "−")])).collect()
}

fn event(event: &solve::Event) -> Value {
    json!({
        "time": event.time,
        "part": event.part.name(),
        "body": event.body(),
        "from": event.from.word(),
        "to": event.to.word(),
    })
}

/// Consequences of the numbers at a glance: groups of names and values.
fn overview(case: &Case) -> Value {
    let Ok(overview) = Overview::new(case) else { return Value::Null };
    let row = |row: &taut::overview::Row| json!({ "key": row.key, "name": row.name, "value": taut_report::show::value(row), "how": row.how });
    let groups: Vec<Value> = overview
        .groups
        .iter()
        .map(|group| json!({ "name": group.name, "rows": group.rows.iter().map(row).collect::<Vec<_>>() }))
        .collect();
    let left_out = case.left_out().into_iter().map(|(name, error)| {
        let line =
            error.place.as_ref().and_then(|place| place.span.as_ref()).map(|span| format!("line {}: ", span.line));
        format!("\"{name}\" is left out: {}{}", line.unwrap_or_default(), error.what)
    });
    let notes: Vec<String> = left_out.chain(overview.notes.iter().map(|note| note.text.clone())).collect();
    json!({ "groups": groups, "places": taut_report::show::rows(&overview), "notes": notes })
}
