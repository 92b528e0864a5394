//! A parameter, or the gain of the input, that is not the same in all logs.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::case::Per;
use crate::fit::limits::APART_MOST;
use crate::fit::trust::parts::of_row;

const GAIN: &str = "amplifier.gain";

/// Names of the logs.
fn logs(site: &Site) -> Vec<String> {
    let mut names: Vec<String> = site.found.problem.runs.iter().map(|run| run.name.clone()).collect();
    names.dedup();
    names
}

/// The name of a parameter that a log has for itself.
fn own(name: &str, log: &str) -> String {
    format!("{name} [{log}]")
}

/// Each parameter with a value of its own in each log. The gain is that of the case in the first log, since a factor on
/// all gains is also one on mass and friction.
pub(super) fn apart(site: &Site) -> Vec<Extended> {
    let logs = logs(site);
    if !(2..=APART_MOST).contains(&logs.len()) {
        return Vec::new();
    }
    // A part of a log that is cut belongs to it.
    let campaign = |name: &String| (name.clone(), vec![name.clone(), of_row(name, "*")]);
    let mut common = site.plan.clone();
    common.per = Per::Campaign;
    common.campaigns = logs.iter().map(campaign).collect();
    let with = |name: String| {
        let names = logs.iter().map(|log| own(&name, log)).collect();
        let mut plan = common.clone();
        plan.separate = vec![name];
        Extended::new(site.with(site.machine.clone()), plan, Telling::Apart(names))
    };
    let mut all: Vec<Extended> = site.plan.names().map(with).collect();
    if !site.is_free(GAIN) && site.machine.drives[0].amplifier.gain != 0.0 {
        let mut gain = with(GAIN.into());
        gain.plan.free.push(GAIN.into());
        gain.plan.bounds.push((own(GAIN, &logs[0]), [site.machine.drives[0].amplifier.gain; 2]));
        all.push(gain);
    }
    all
}

pub(super) fn words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let name = extended.plan.separate.first().map_or("", String::as_str);
    let logs = logs(site);
    let value = |log: &String| found.sizes.iter().find(|size| size.name == own(name, log));
    let of = |log: &String| Some(format!("{} in {log}", shown(value(log)?.value, value(log)?.unit)));
    let values: Vec<String> = logs.iter().filter_map(of).collect();
    let words = format!("a different {name} in each log ({})", values.join(", "));
    let add = match name == GAIN && !site.is_free(GAIN) {
        true => "compare the units and the scaling of the logged inputs, and correct them with `scale`".into(),
        false => format!("set separate = [\"{name}\"] and per = \"log\" in [fit]"),
    };
    Said { words, add }
}
