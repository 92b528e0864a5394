//! From logs to a model: what a file has, what logs determine, and the fit.

use crate::Context;
use crate::case::opened;
use crate::message::{Reply, Request};
use crate::toml::toml;
use serde_json::{Map, Value, json};
use std::cell::RefCell;
use taut::case::{Case, Plan};
use taut::error::{Error, Result};
use taut::fit::{FittedLog, Problem, check_watched, fit_watched, profiles};
use taut::log::{ColumnId, Looked, PRESETS, Quantity, look};
use taut::machine::MachineKind;
use taut::solve::{Bench, Flow};
use taut_report::fit::FitResults;

/// Rows and points of a preview.
const ROWS: usize = 8;
const POINTS: usize = 600;

/// Logs that are shown over the model while it is fitted, and points of each.
const SHOWN: usize = 4;
const THINNED: usize = 240;

/// Time between two pictures of a fit, s.
const PICTURES: f64 = 0.04;

/// The columns of a file that was sent, their first rows, and what they seem to be.
pub fn columns(request: &Request, context: &Context) -> Result<Reply> {
    let file = context.host.sent(request.text("path")?)?;
    let Looked { columns, guess } = look(&file)?;
    let rows = columns.iter().map(|column| column.values.len()).max().unwrap_or(0);
    let thin = rows.div_ceil(POINTS).max(1);
    let one = |column: &taut::log::FileColumn| {
        let values = &column.values;
        json!({
            "id": match &column.id {
                ColumnId::Name(name) => json!(name),
                ColumnId::Number(number) => json!(number),
            },
            "unit": column.unit,
            "rows": values.len(),
            "first": values.iter().take(ROWS).collect::<Vec<_>>(),
            "points": values.iter().step_by(thin).collect::<Vec<_>>(),
        })
    };
    let keys =
        |(key, column, unit): &(&str, usize, Option<String>)| json!({ "key": key, "column": column, "unit": unit });
    let quantity = |quantity: Quantity| json!({ "key": quantity.name(), "unit": quantity.unit() });
    Ok(Reply::new(json!({
        "found": columns.iter().map(one).collect::<Vec<_>>(),
        "rows": rows,
        "guess": { "preset": guess.preset, "columns": guess.columns.iter().map(keys).collect::<Vec<_>>(), "split": guess.split },
        "quantities": Quantity::for_kind(MachineKind::Axis).iter().copied().map(quantity).collect::<Vec<_>>(),
        "presets": PRESETS.iter().map(|preset| json!({ "name": preset.name, "title": preset.title })).collect::<Vec<_>>(),
    })))
}

/// The case of a request with its logs in the place of its experiments, and its plan: `logs`, a list of `name` and
/// `log`, the table of a log; `plan`, the table `[fit]`. Both are the text's own where they are left out.
fn planned(request: &Request, context: &Context) -> Result<(Case, Plan)> {
    let mut request = request.clone();
    let mut changes = request.list("changes").to_vec();
    if !request.list("logs").is_empty() {
        changes.push(json!(format!("experiment={}", toml(&json!(request.list("logs"))))));
    }
    if let Some(plan) = request.body.get("plan").filter(|plan| plan.is_object()) {
        changes.push(json!(format!("fit={}", toml(plan))));
    }
    request.body.insert("changes".into(), Value::Array(changes));
    let name = context.host.name();
    let case = opened(&request, context)?;
    if !case.is_axis() {
        return Err(Error::new("the studio fits a single axis, and this case is a gantry")
            .next("use `taut fit` or `taut check` on the command line, which take gantries"));
    }
    let plan = case.fit_plan(name)?;
    Ok((case, plan))
}

/// The survey of the logs, and what they determine: the page of `taut check`.
pub fn check(request: &Request, context: &Context) -> Result<Reply> {
    let (case, plan) = planned(request, context)?;
    let stop = || context.is_stopped();
    let live = Live::new(&case, &plan, context)?;
    let found = check_watched(&case, &plan, Some(&stop), &mut |x, cost| live.see(x, cost));
    // Said on a search that was cut short it would be wrong.
    if context.is_stopped() {
        return Err(stopped());
    }
    let found = found?;
    let page = taut_report::check::page(&case, &found);
    Ok(Reply::new(json!({ "html": page.body(), "result": taut::json::check(&case, &found) })))
}

fn stopped() -> Error {
    Error::new("stopped before there was a result")
}

/// The fit, with progress; stopped, it keeps the best so far.
pub fn fit(request: &Request, context: &Context) -> Result<Reply> {
    let (case, plan) = planned(request, context)?;
    let stop = || context.is_stopped();
    let live = Live::new(&case, &plan, context)?;
    let begun = context.elapsed();
    let fit = match fit_watched(&case, &plan, Some(&stop), &mut |x, cost| live.see(x, cost)) {
        Err(_) if context.is_stopped() => return Err(stopped()),
        fit => fit?,
    };
    let is_wanted = request.flag("profiles") && !context.is_stopped();
    if is_wanted {
        (context.progress)(json!({ "phase": "profiles of the parameters" }));
    }
    let profiles = match is_wanted.then(|| profiles(&case, &plan, &fit, Some(&stop))) {
        Some(Err(_)) if context.is_stopped() => Vec::new(),
        Some(profiles) => profiles?,
        None => Vec::new(),
    };
    let found = FitResults { fit, profiles, drawn: None };
    let fit = &found.fit;
    let text = fit.case_text(&case, context.host.name())?;
    let page = taut_report::fit::page(&case, &found, &text);
    let result = taut::json::fit(&case, fit, &found.profiles, None);
    Ok(Reply::new(json!({
        "html": page.body(),
        "result": result,
        "fitted": text,
        "kept": kept(request, context, &found)?,
        "ending": taut_report::fit::ending(fit),
        "rows": fit.estimates.iter().map(|estimate| {
            let [value, error, interval] = taut_report::fit::words(estimate);
            json!({ "name": estimate.name, "value": value, "error": error, "interval": interval,
                    "start": taut_report::fit::value(estimate.start, estimate.unit, 5) })
        }).collect::<Vec<_>>(),
        "took_s": context.elapsed() - begun,
    })))
}

/// The text of the page with the estimates in it: its own experiments, not the logs that were fitted.
fn kept(request: &Request, context: &Context, found: &FitResults) -> Result<String> {
    let own = opened(request, context)?;
    if !own.is_axis() {
        return Err(Error::new("this case is a gantry"));
    }
    found.fit.case_text(&own, context.host.name())
}

/// A fit under way, as the page sees it.
struct Live<'a> {
    context: &'a Context<'a>,
    problem: Problem<'static>,
    /// The places of the logs that are shown.
    shown: Vec<usize>,
    state: RefCell<FitProgress>,
}

struct FitProgress {
    steps: u64,
    last: Option<f64>,
    bench: Bench,
}

impl<'a> Live<'a> {
    fn new(case: &Case, plan: &Plan, context: &'a Context<'a>) -> Result<Self> {
        let problem = Problem::new(case, plan)?;
        // Spread over all of them.
        let count = problem.runs.len().min(SHOWN);
        let shown = (0..count).map(|k| k * (problem.runs.len() - 1) / count.max(2).saturating_sub(1)).collect();
        let state = RefCell::new(FitProgress { steps: 0, last: None, bench: Bench::default() });
        Ok(Self { context, problem, shown, state })
    }

    /// One step; the page gets a picture now and then.
    fn see(&self, x: &[f64], cost: f64) -> Flow {
        let mut state = self.state.borrow_mut();
        state.steps += 1;
        let now = self.context.elapsed();
        if state.last.is_none_or(|last| now - last > PICTURES) && !self.context.is_stopped() {
            let steps = state.steps;
            let logs: Vec<Value> = self.shown.iter().filter_map(|&k| self.log(k, x, &mut state.bench)).collect();
            let told = json!({ "step": steps, "cost": cost, "parameters": self.parameters(x), "logs": logs });
            (self.context.progress)(told);
            state.last = Some(self.context.elapsed());
        }
        if self.context.is_stopped() { Flow::Stop } else { Flow::Continue }
    }

    /// Name, unit, value and start of each parameter.
    fn parameters(&self, x: &[f64]) -> Vec<Value> {
        let one = |(j, free): (usize, &taut::parameter::Free)| {
            let value = x.get(j).map_or(free.start, |x| self.problem.value(j, *x));
            json!({ "name": free.name, "unit": free.unit, "value": value, "start": free.start })
        };
        self.problem.parameters.iter().enumerate().map(one).collect()
    }

    /// A log and the model's side of it, thinned out.
    fn log(&self, k: usize, x: &[f64], bench: &mut Bench) -> Option<Value> {
        let run: &FittedLog = &self.problem.runs[k];
        let machine = self.problem.stage_of(run.part, x);
        let extras = self.problem.extras_of(k, x);
        let quantity = run.seen.first()?.quantity;
        let mut out = vec![Vec::with_capacity(run.time.len())];
        if !run.predict(bench, &machine, &extras, &[quantity], &mut out) {
            return None;
        }
        let bias = run.bias(0, &extras);
        let thin = run.time.len().div_ceil(THINNED).max(1);
        let model = |value: &f64| if run.seen[0].absolute { value.abs() } else { *value } + bias;
        let mut told = Map::new();
        told.insert("name".into(), json!(run.name));
        told.insert("quantity".into(), json!(quantity.name()));
        told.insert("unit".into(), json!(quantity.unit()));
        told.insert("time".into(), json!(run.time.iter().step_by(thin).collect::<Vec<_>>()));
        told.insert("seen".into(), json!(run.seen[0].values.iter().step_by(thin).collect::<Vec<_>>()));
        told.insert("model".into(), json!(out[0].iter().step_by(thin).map(model).collect::<Vec<_>>()));
        Some(Value::Object(told))
    }
}
