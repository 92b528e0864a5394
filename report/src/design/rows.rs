//! A designed experiment in words.

use crate::fit::value;
use taut::fit::experiment_design::{Designed, Limits, Promise, Verified};
use taut::machine::Machine;

/// A share as people write it.
fn percent(share: f64) -> String {
    match share.is_finite() {
        true => format!("{} %", taut::number::typed(&taut::number::significant(100.0 * share, 2))),
        false => "not determined".into(),
    }
}

/// The input in a sentence.
pub fn heading(found: &Designed) -> String {
    format!("{}, {} in all", found.driven.words(&found.shape, found.unit), value(found.duration, "s", 3))
}

/// Name, value, standard error and the same relative of each parameter; those that count first.
pub fn promises(found: &Designed) -> Vec<[String; 4]> {
    let row = |promise: &Promise| {
        let error = match promise.is_determined() {
            true => format!("± {}", value(promise.error, promise.unit, 2)),
            false => "not determined".into(),
        };
        let relative = match (promise.is_determined(), promise.value == 0.0) {
            (false, _) => String::new(),
            (true, false) => percent(promise.error / promise.value.abs()),
            (true, true) => format!("{} of a typical value", percent(promise.relative)),
        };
        [promise.name.clone(), value(promise.value, promise.unit, 4), error, relative]
    };
    let wanted = found.promises.iter().filter(|promise| promise.wanted);
    wanted.chain(found.promises.iter().filter(|promise| !promise.wanted)).map(row).collect()
}

/// The best of each kind of input.
pub fn inputs(found: &Designed) -> Vec<[String; 3]> {
    let all = found.alternatives.iter();
    all.map(|one| {
        let how = if one.refined { "" } else { "first points only" };
        let input = match one.driven.name {
            "" => one.shape.kind().word().to_string(),
            name => format!("{}, {name}", one.shape.kind().word()),
        };
        [input, percent(one.score), how.to_string()]
    })
    .collect()
}

/// The case's own experiments, measured in the same way.
pub fn own(found: &Designed) -> Vec<[String; 3]> {
    let count = found.promises.iter().filter(|promise| promise.wanted).count();
    let all = found.own.iter();
    all.map(|own| {
        let determined = format!("{} of {count} determined", own.determined);
        [format!("{} ({})", own.name, value(own.duration, "s", 3)), percent(own.score), determined]
    })
    .collect()
}

/// How far it goes, what limits it, and where that comes from.
pub fn limits(found: &Designed, machine: &Machine) -> Vec<[String; 4]> {
    let Limits { input, current, travel, .. } = &found.limits;
    let reached = &found.reached;
    let row = |name: &str, is: f64, unit: &str, limit: (f64, taut::fit::experiment_design::Origin)| {
        [name.to_string(), value(is, unit, 3), value(limit.0, unit, 3), limit.1.words().to_string()]
    };
    let mut rows = vec![row("input", reached.input, found.unit, *input)];
    match current {
        Some(current) => rows.push(row("current", reached.current, "A", *current)),
        None => rows.push(["current".into(), value(reached.current, "A", 3), "none".into(), String::new()]),
    }
    for (slide, ((label, _), travel)) in machine.travels().zip(travel).enumerate() {
        rows.push(row(&format!("way of the {}", label.name), reached.way(slide), "m", *travel));
    }
    rows
}

/// Outputs that are measured, and how well.
pub fn measured(found: &Designed) -> String {
    let one = |channel: &taut::machine::Channel| {
        let unit = channel.quantity.unit();
        let step = channel.step.map(|step| format!("in steps of {}", value(step, unit, 3)));
        let noise = (channel.noise > 0.0).then(|| format!("with a noise of {}", value(channel.noise, unit, 3)));
        let how: Vec<String> = step.into_iter().chain(noise).collect();
        format!("{} {}", channel.quantity.name(), how.join(" and "))
    };
    let all: Vec<String> = found.measured.iter().map(one).collect();
    format!("measured every {}: {}", value(found.every, "s", 3), all.join("; "))
}

/// Findings of fits of simulated logs.
pub fn verified(all: &[Verified]) -> Vec<[String; 4]> {
    let row = |one: &Verified| {
        [
            one.name.clone(),
            format!("{:.2}", one.ratio),
            format!("{:+.2}", one.bias).replace("-0.00", "+0.00"),
            format!("{:.0} % of {}", 100.0 * one.coverage, one.fits),
        ]
    };
    all.iter().map(row).collect()
}
