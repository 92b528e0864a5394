//! A sweep with its rows as they come, and the trajectories of chosen runs.

use crate::Context;
use crate::case::opened;
use crate::curves::{Kept, panels};
use crate::message::{Reply, Request};
use crate::toml::toml;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use taut::case::Case;
use taut::error::{Error, Result};
use taut::solve::Flow;
use taut::sweep::{Status, Sweep};
use taut::trajectory::Trajectory;

/// Most runs of a sweep on a page.
const RUNS: u64 = 20_000;

/// Runs of a piece that one thread takes at a time.
const PIECE: usize = 16;

/// Most runs whose trajectories are shown at once, and rows of each.
const TRACES: usize = 60;
const ROWS: usize = 400;

/// Time between two steps of progress, s.
const STEPS: f64 = 0.1;

/// The case of a request with its sweep: `plan`, the table `[sweep]`, the text's own where it is left out.
fn planned(request: &Request, context: &Context) -> Result<(Case, Sweep)> {
    let mut request = request.clone();
    if let Some(plan) = request.body.get("plan").filter(|plan| plan.is_object()) {
        let changes = json!([format!("sweep={}", toml(plan))]);
        request.body.insert("changes".into(), changes);
    }
    let case = opened(&request, context)?;
    let sweep = Sweep::new(&case)?;
    if sweep.runs() > RUNS {
        let error = Error::new(format!("{} runs are too many for a page", sweep.runs()));
        return Err(error.allowed(format!("up to {RUNS}")).next("use `taut sweep` for more"));
    }
    Ok((case, sweep))
}

/// Runs all machines on all processors; the page gets rows as they come, and all of them in the end.
pub fn sweep(request: &Request, context: &Context) -> Result<Reply> {
    let (case, sweep) = planned(request, context)?;
    let begun = context.elapsed();
    (context.progress)(json!({ "runs": sweep.runs(), "headings": headings(&sweep), "rows": [] }));
    let table = rows(&sweep, context);
    let mut reply = Reply::new(json!({
        "title": case.title.as_str(),
        "runs": sweep.runs(),
        "done": table.len(),
        "stopped": (table.len() as u64) < sweep.runs(),
        "headings": headings(&sweep),
        "statuses": Status::ALL.map(Status::words),
        "experiments": sweep.groups().iter().filter(|group| !group.is_move).map(|group| &group.name).collect::<Vec<_>>(),
        "took_s": context.elapsed() - begun,
        "columns": sweep.columns().iter().map(|column| json!({ "name": column.name, "rows": table.len() })).collect::<Vec<_>>(),
    }));
    reply.columns = table.columns.into_iter().map(|column| column.values).collect();
    Ok(reply)
}

/// Name, unit, and words of each column; its kind is that of a run's number, an input, a status or a figure.
fn headings(sweep: &Sweep) -> Vec<Value> {
    let inputs = sweep.inputs();
    let mut figures = vec![None; inputs];
    for group in sweep.groups() {
        figures.push(Some((group.name.as_str(), "status", "")));
        figures.extend(group.figures.iter().map(|figure| Some((group.name.as_str(), "figure", figure.words.as_str()))));
    }
    let kind = |k: usize| if k == 0 { "run" } else { "input" };
    let told = sweep.columns().iter().zip(figures).enumerate().map(|(k, (column, figure))| {
        let (group, kind, words) = figure.unwrap_or(("", kind(k), ""));
        json!({ "name": column.name, "unit": column.unit, "group": group, "kind": kind, "words": words })
    });
    told.collect()
}

/// Rows in the order of the runs, those that were done where it was stopped.
fn rows(sweep: &Sweep, context: &Context) -> Trajectory {
    let (next, stop) = (AtomicU64::new(0), || context.is_stopped());
    let piece = || {
        let first = next.fetch_add(PIECE as u64, Ordering::Relaxed);
        let piece = if first < sweep.runs() { sweep.rows(first, PIECE, &stop) } else { None };
        piece.map(|piece| (first, piece))
    };
    let mut all: Vec<(u64, Trajectory)> = Vec::new();
    let (mut last, mut told) = (context.elapsed(), 0);
    let mut take = |piece| {
        all.push(piece);
        if context.elapsed() - last > STEPS {
            // Rows that the page was too busy for come with the next step.
            let fresh: Vec<Vec<f64>> = all[told..].iter().flat_map(|(_, piece)| lines(piece)).collect();
            if (context.progress)(json!({ "runs": sweep.runs(), "rows": fresh })) {
                told = all.len();
            }
            last = context.elapsed();
        }
    };
    match context.host.threads() {
        0 | 1 => std::iter::from_fn(piece).for_each(take),
        threads => std::thread::scope(|scope| {
            let (done, pieces) = channel();
            for _ in 0..threads {
                let (done, piece) = (done.clone(), &piece);
                scope.spawn(move || std::iter::from_fn(piece).try_for_each(|piece| done.send(piece)));
            }
            drop(done);
            pieces.into_iter().for_each(&mut take);
        }),
    }
    all.sort_by_key(|(first, _)| *first);
    let mut table = Trajectory::with_capacity(sweep.columns(), all.len() * PIECE);
    all.iter().for_each(|(_, piece)| table.append(piece));
    table
}

fn lines(piece: &Trajectory) -> Vec<Vec<f64>> {
    // JSON has no word for what is no number; no figure is as large.
    let plain = |value: f64| if value.is_finite() { value } else { 1e300 };
    (0..piece.len()).map(|row| piece.columns.iter().map(|column| plain(column.values[row])).collect()).collect()
}

/// The curves of chosen runs: `runs`, their numbers; `experiment`, its place.
pub fn traces(request: &Request, context: &Context) -> Result<Reply> {
    let (case, sweep) = planned(request, context)?;
    let experiment = request.number("experiment").unwrap_or(0.0).max(0.0) as usize;
    let numbers = request.list("runs").iter().filter_map(Value::as_u64).filter(|run| *run < sweep.runs());
    let mut columns = Vec::new();
    let mut told = Vec::new();
    let mut shown = Vec::new();
    for run in numbers.take(TRACES) {
        if context.flow() == Flow::Stop {
            break;
        }
        let mut panels = panels(&case, &sweep.machine(run).mechanism().columns);
        panels.retain(|panel| panel.is_plotted());
        let mut kept = Kept::new(&panels);
        let outcome = sweep.stream(run, experiment, &mut |block| {
            kept.take(block);
            context.flow()
        });
        // A machine that cannot be run has a status that says so, and no curve.
        if outcome.is_err() {
            continue;
        }
        shown = panels;
        let Value::Array(names) = kept.told() else { continue };
        for (name, values) in names.into_iter().zip(kept.columns) {
            let thin = values.len().div_ceil(ROWS).max(1);
            let values: Vec<f64> = values.into_iter().step_by(thin).collect();
            let name = name["name"].as_str().unwrap_or_default().to_string();
            told.push(json!({ "name": format!("{run}:{name}"), "rows": values.len() }));
            columns.push(values);
        }
    }
    let mut reply = Reply::new(json!({ "panels": crate::curves::told(&shown), "columns": told }));
    reply.columns = columns;
    Ok(reply)
}
