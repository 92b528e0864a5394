//! A sweep: `taut sweep --json`, `sweep.json`.

use crate::case::Case;
use crate::sweep::{Drawn, Estimate, Measured, Shown, Spread, Summary, Sweep};
use serde_json::{Value, json};

/// The summary of all runs of a case; numbers to the last bit, null for what is no number.
pub fn sweep(case: &Case, sweep: &Sweep, summary: &Summary) -> Value {
    json!({
        "schema": super::identity("sweep"),
        "title": case.title.as_str(),
        "version": env!("CARGO_PKG_VERSION"),
        "runs": sweep.runs(),
        "design": sweep.sampling().word(),
        "seed": case.sweep.as_ref().map(|sweep| sweep.seed),
        "solver": case.sweep.as_ref().map(|sweep| sweep.solver.word()),
        "indices": sweep.indices(),
        "shares_of_every": summary.every,
        "columns": sweep.columns().iter().map(|column| column.heading()).collect::<Vec<_>>(),
        "parameters": summary.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "experiments": summary.groups.iter().map(|group| of_group(summary, group)).collect::<Vec<_>>(),
    })
}

fn spread(spread: &Option<Spread>) -> Value {
    spread.as_ref().map_or(Value::Null, |spread| {
        let [least, low, middle, high, greatest] = spread.quantiles;
        json!({
            "count": spread.count, "missing": spread.missing, "mean": spread.mean, "standard_deviation": spread.deviation,
            "least": least, "5%": low, "50%": middle, "95%": high, "greatest": greatest,
        })
    })
}

fn parameter(drawn: &Drawn) -> Value {
    json!({ "name": drawn.name, "unit": drawn.unit, "spread": spread(&drawn.spread) })
}

fn of_group(summary: &Summary, group: &Shown) -> Value {
    let endings: serde_json::Map<String, Value> =
        group.endings.iter().map(|(status, count)| (status.words().to_string(), json!(count))).collect();
    json!({
        "name": group.name,
        "endings": endings,
        "lost_steps": group.lost_steps().map(|lost| {
            json!({ "runs": lost.lost, "of": lost.runs, "share": lost.share(), "interval_95": lost.interval })
        }),
        "figures": group.measures.iter().map(|measured| figure(summary, measured)).collect::<Vec<_>>(),
    })
}

fn figure(summary: &Summary, measured: &Measured) -> Value {
    let mut value = json!({
        "name": measured.name, "unit": measured.unit, "meaning": measured.words, "spread": spread(&measured.spread),
    });
    let named = |values: Vec<Value>| -> Value {
        let names = summary.parameters.iter().map(|parameter| parameter.name.clone());
        Value::Object(names.zip(values).collect())
    };
    if !measured.ranks.is_empty() {
        value["rank_correlation"] = named(measured.ranks.iter().map(|rank| json!(rank)).collect());
    }
    if let Some(indices) = &measured.indices {
        let told = |estimate: Estimate| json!({ "value": estimate.value, "interval": estimate.interval });
        value["indices"] = named(
            indices.iter().map(|index| json!({ "first": told(index.first), "total": told(index.total) })).collect(),
        );
    }
    if !measured.tornado.is_empty() {
        value["nominal"] = json!(measured.nominal);
        let bars = |bars: &Vec<(f64, f64)>| {
            Value::Array(bars.iter().map(|(at, value)| json!({ "at": at, "figure": value })).collect())
        };
        value["one_at_a_time"] = named(measured.tornado.iter().map(bars).collect());
    }
    value
}
