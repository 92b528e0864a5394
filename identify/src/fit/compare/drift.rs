//! Drift: the single change of a machine that explains logs that it does not fit, such as those of another day, after a
//! repair, or with another load.
//!
//! Numbers of one cause change together: friction in both directions of one surface, both pulleys of one make, the two
//! constants of one motor. Each such pair is a change in addition to those of its members. Otherwise a smaller pulley
//! might explain more than Coulomb friction in one direction if it fell in both.

use crate::case::{Case, Nuisances, Plan, Scope};
use crate::error::Result;
use crate::fit::asked::problem::Stop;
use crate::fit::limits::{CAUSE_ERRORS, CAUSE_EXPLAINS, CHANGE_ALIKE};
use crate::fit::search::starts::{Searched, Work};
use crate::fit::trust::found::Estimate;
use crate::fit::trust::held_out::nothing;
use crate::fit::trust::nearest::{Settled, search};
use crate::fit::trust::result::result;
use crate::fit::trust::scores::{Together, together};
use crate::fit::trust::uncertainty::Judged;
use crate::log::Quantity;
use crate::machine::Machine;
use crate::parameter::{self, Free};
use crate::solve::Flow;

/// The effect of single changes on the errors of a machine.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Drift {
    /// Errors of the unchanged machine.
    pub unchanged: Vec<Together>,
    /// Single changes: first those that the logs cannot distinguish from the one that explains most, ordered by
    /// likelihood of their causes; then the others, ordered by their explained share.
    pub changes: Vec<Change>,
    /// Number of changes that the logs cannot distinguish from the one that explains most, including it.
    pub alike: usize,
    /// The effort.
    pub work: Work,
}

/// A single change.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Change {
    /// The parameter, with its old and its new value.
    pub estimate: Estimate,
    /// The errors with it.
    pub errors: Vec<Together>,
    /// Remaining fraction of the sum of squares; mean over several quantities.
    pub left: f64,
}

impl Change {
    /// True if the logs show this change: it explains as much of the sum of squares as a missing element has to, and is
    /// as many times its standard error.
    pub fn is_shown(&self) -> bool {
        let Estimate { value, start, error, .. } = self.estimate;
        let is_far = error.is_none_or(|error| (value - start).abs() >= CAUSE_ERRORS * error);
        is_far && 1.0 - self.left >= CAUSE_EXPLAINS
    }
}

impl Drift {
    /// True if the logs show any change.
    pub fn is_changed(&self) -> bool {
        self.changes.iter().any(Change::is_shown)
    }

    /// Quantities in the logs.
    pub fn quantities(&self) -> Vec<Quantity> {
        self.unchanged.iter().filter(|one| !one.held_out).map(|one| one.quantity).collect()
    }

    /// The changes that are indistinguishable from the best one, the most likely causes first.
    pub fn best(&self) -> impl Iterator<Item = &Change> {
        self.changes.iter().take(self.alike)
    }

    fn new(unchanged: Vec<Together>, mut changes: Vec<Change>, work: Work) -> Self {
        changes.sort_by(|a, b| a.left.total_cmp(&b.left));
        let least = changes.first().map_or(0.0, |change| change.left);
        let alike = changes.partition_point(|change| change.left <= least * (1.0 + CHANGE_ALIKE) + 1e-12);
        // A pair precedes its members.
        let members = |change: &Change| change.estimate.name.split(" = ").count();
        changes[..alike].sort_by_key(|change| (Cause::new(&change.estimate.name), std::cmp::Reverse(members(change))));
        Self { unchanged, changes, alike, work }
    }
}

/// Causes of a change in a machine, the most likely first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Cause {
    /// Friction: wear, grease, temperature, dirt.
    Friction,
    /// Load: moved masses, and forces on the cart.
    Load,
    /// The belt: age, tension.
    Belt,
    /// The motor and its supply: temperature, voltage.
    Drive,
    /// The wiring and timing of the input.
    Input,
    /// Make, which does not change in use: radii, gear ratios, encoders.
    Make,
}

impl Cause {
    /// Cause of a change by its name: a key, several joined by ` = `, a sum, or a nuisance.
    fn new(name: &str) -> Self {
        let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
        match () {
            () if has(&["radius", "gear_ratio", "teeth", "pitch", "encoder", "length"]) => Self::Make,
            () if has(&["friction", "total.viscous", "total.coulomb", "efficiency"]) => Self::Friction,
            () if has(&["mass", "inertia", "load"]) => Self::Load,
            () if name.starts_with("belt.") => Self::Belt,
            () if name.contains("motor.") => Self::Drive,
            () if has(&["amplifier", "input", "delay"]) => Self::Input,
            () => Self::Make,
        }
    }
}

/// Keys of the numbers of each of several drives, which the keys of all drives vary together.
fn of_drives(machine: &Machine) -> Vec<String> {
    let drives = machine.geometry().drives;
    if drives.len() == 1 {
        return Vec::new();
    }
    let keys = ["motor.torque_constant", "motor.back_emf_constant", "motor.resistance", "amplifier.gain"];
    drives.iter().flat_map(|drive| keys.map(|key| format!("{}{key}", drive.key))).collect()
}

/// Pairs that change together, if the machine has both and neither is zero; and the spans of each drive of several.
fn pairs(machine: &Machine) -> Vec<Vec<String>> {
    let bodies = ["drive_pulley", "cart", "idler_pulley", "bridge"];
    let kinds = ["viscous", "coulomb", "static"];
    let sides = bodies.into_iter().flat_map(|body| {
        kinds
            .into_iter()
            .map(move |kind| [format!("{body}.friction.{kind}"), format!("{body}.friction.{kind}_backward")])
    });
    let of_pulleys = ["inertia".to_string()].into_iter().chain(kinds.map(|kind| format!("friction.{kind}")));
    let pulleys = of_pulleys.map(|number| ["drive_pulley", "idler_pulley"].map(|body| format!("{body}.{number}")));
    let (geometry, has_several) = (machine.geometry(), machine.drives.len() > 1);
    // Of each drive, and of all of several.
    let of_motors = geometry.drives.iter().map(|drive| drive.key).chain(has_several.then_some(""));
    let motors = of_motors.map(|of| ["torque_constant", "back_emf_constant"].map(|key| format!("{of}motor.{key}")));
    let is_there = |key: &String| parameter::value(machine, key).is_some_and(|value| value != 0.0);
    // A direction that is not given separately follows the other one.
    let are_two = |[one, other]: &[String; 2]| {
        let free = |key: &str| Free::new(machine, key, &[], &[]).ok();
        free(one).zip(free(other)).is_some_and(|(one, other)| !one.overlaps(&other))
    };
    let all = sides.chain(pulleys).chain(motors);
    let pairs = all.filter(|pair| pair.iter().all(is_there) && are_two(pair)).map(|pair| pair.to_vec());
    let spans = |drive: usize| geometry.spans_of(drive).map(|span| format!("belt.stiffness.{span}")).collect();
    let belts = (0..machine.drives.len()).filter(|_| has_several).map(spans);
    pairs.chain(belts.filter(|spans: &Vec<String>| spans.len() > 1)).collect()
}

/// Changes the parameters of the machine one at a time to fit the logs of `case`: those of `plan`, all others that may
/// vary, pairs that change together, and delay, gain and offset of the input.
pub fn drift(case: &Case, plan: &Plan, stop: Option<Stop>, watch: &mut dyn FnMut(&str) -> Flow) -> Result<Drift> {
    crate::case::needs_motors(&case.machine)?;
    let none = nothing(plan);
    let quiet = &mut |_: &[f64], _| Flow::Continue;
    watch("the machine as it is");
    let found = search(case, &none, stop, quiet)?.searched;
    let unchanged = errors(&found);
    let mut work = found.work;
    let mut changes = Vec::new();
    for single in singles(case, plan, &none) {
        let name = single.names().next().unwrap_or_else(|| "the input".into());
        if watch(&name) == Flow::Stop || stop.is_some_and(|stop| stop()) {
            break;
        }
        // A change with which the model cannot simulate the logs explains nothing.
        let Ok(Settled { searched: found, .. }) = search(case, &single, stop, quiet) else { continue };
        work.add(&found.work);
        let judged = Judged::new(
            &found.problem,
            &found.best.residuals,
            &found.best.jacobian,
            &found.best.x,
            &found.best.at_bound,
        );
        let shared = plan.nuisance != single.nuisance;
        let fit = result(&found, judged.as_ref());
        let own = if shared { fit.estimates.last() } else { fit.estimates.first() };
        let Some(estimate) = own.cloned() else { continue };
        let errors = together(&fit.logs, |_| String::new());
        let left = left(&unchanged, &errors);
        changes.push(Change { estimate, errors, left });
    }
    Ok(Drift::new(unchanged, changes, work))
}

fn errors(found: &Searched) -> Vec<Together> {
    together(&result(found, None).logs, |_| String::new())
}

/// The plans with one change each.
fn singles(case: &Case, plan: &Plan, none: &Plan) -> Vec<Plan> {
    let machine = &case.machine;
    let mut taken: Vec<Free> = Vec::new();
    let mut plans = Vec::new();
    let mut single = |own: Plan| {
        let Some(name) = own.names().next() else { return };
        let Ok(free) = Free::new(machine, &name, &[], &plan.bounds) else { return };
        let same = |other: &Free| other.keys == free.keys;
        if !taken.iter().any(same) {
            taken.push(free);
            plans.push(Plan {
                bounds: plan.bounds.iter().filter(|(known, _)| *known == name).cloned().collect(),
                ..own
            });
        }
    };
    let others = parameter::every(machine).into_iter().chain(of_drives(machine)).chain(["cart.load".to_string()]);
    for key in plan.free.iter().cloned().chain(others) {
        single(Plan { free: vec![key], ..none.clone() });
    }
    for keys in plan.tied.iter().cloned().chain(pairs(machine)) {
        single(Plan { tied: vec![keys], ..none.clone() });
    }
    for name in &plan.lumped {
        single(Plan { lumped: vec![name.clone()], ..none.clone() });
    }
    let nuisance = none.nuisance;
    // Each of several drives has its own offset and gain, and the gain of its amplifier.
    let has_one_input = machine.drives.len() == 1;
    if !plan.closed_loop {
        if nuisance.delay == Scope::Off {
            plans.push(Plan { nuisance: Nuisances { delay: Scope::Shared, ..nuisance }, ..none.clone() });
        }
        if has_one_input && nuisance.input_offset == Scope::Off {
            plans.push(Plan { nuisance: Nuisances { input_offset: Scope::Shared, ..nuisance }, ..none.clone() });
        }
    }
    if has_one_input && nuisance.input_gain == Scope::Off {
        plans.push(Plan { nuisance: Nuisances { input_gain: Scope::Shared, ..nuisance }, ..none.clone() });
    }
    plans
}

/// Remaining fraction of the sum of squares, mean over quantities.
fn left(before: &[Together], after: &[Together]) -> f64 {
    let of = |one: &Together| {
        let own = after.iter().find(|other| other.quantity == one.quantity && other.held_out == one.held_out);
        own.map_or(f64::INFINITY, |own| (own.rmse / one.rmse.max(f64::MIN_POSITIVE)).powi(2))
    };
    let quantities: Vec<f64> = before.iter().filter(|one| !one.held_out).map(of).collect();
    quantities.iter().sum::<f64>() / quantities.len().max(1) as f64
}
