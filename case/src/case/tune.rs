//! The table of the tuning: what the gains are to be good for, and what they have to stand. And what a fit said of its
//! estimates.

use super::Move;
use super::reader::{Field, Table};
use super::suggestion;
use super::tree::NodeValue;
use crate::design::{Design, Structure, Tunable, TunedBy};
use crate::error::Result;
use crate::machine::Machine;
use std::path::PathBuf;

/// The goal of `taut tune`.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuning {
    /// The cost; none where bandwidth and damping alone give the gains.
    pub cost: Option<Cost>,
    /// Bandwidth that the gains are placed for, Hz; one that suits the axis where it is not said.
    pub bandwidth: Option<f64>,
    /// Damping ratio for which they are placed.
    pub damping: f64,
    /// Largest |S| allowed.
    pub sensitivity: f64,
    /// Largest |T| allowed.
    pub complementary: f64,
    /// By what share each parameter can be off; where it is not said, what a fit says, or 20 %.
    pub spread: Option<f64>,
    /// Masses that are added to the cart, kg.
    pub loads: Vec<f64>,
    /// Number of positions along the travel that are evaluated.
    pub places: usize,
    /// True if all parameters may be at their ends at once, and no axis is left out.
    pub corners: bool,
    /// Draws of `taut fit --posterior`, of which the family is made instead.
    pub draws: Option<PathBuf>,
    /// How many times as long as usual a search may take, one of [`EFFORTS`].
    pub effort: f64,
}

/// Efforts that a search may take.
pub const EFFORTS: std::ops::RangeInclusive<f64> = 0.1..=100.0;

impl Default for Tuning {
    /// The default: the best moves with Ms ≤ 1.8.
    fn default() -> Self {
        Self {
            cost: Some(Cost::Moves),
            bandwidth: None,
            damping: 0.8,
            sensitivity: 1.8,
            complementary: 1.8,
            spread: None,
            loads: vec![0.0],
            places: 7,
            corners: false,
            draws: None,
            effort: 1.0,
        }
    }
}

/// The cost that is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// Of all moves: time until the cart settles, its largest error, and the current, each at worst.
    Moves,
    /// Root of the mean square of the cart's error over all moves.
    Squares,
    /// Its largest magnitude.
    Peak,
    /// The effect of a disturbance on the cart, without moves.
    Disturbance,
}

impl Cost {
    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        match self {
            Cost::Moves => "moves",
            Cost::Squares => "squares",
            Cost::Peak => "peak",
            Cost::Disturbance => "disturbance",
        }
    }
}

/// The estimate of a parameter by a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Its key, or the name of a group, as in `[fit]`.
    pub name: String,
    /// Its 95 % interval, SI; none where the fit knows nothing.
    pub interval: Option<[f64; 2]>,
    /// Its standard error, SI; none where the fit knows nothing.
    pub error: Option<f64>,
}

pub(super) fn tuning(
    root: &Table,
    machine: &Machine,
    design: Option<&Design>,
    moves: &[Move],
) -> Result<Option<Tuning>> {
    let Some(field) = root.optional("tune") else { return Ok(None) };
    let table = field.table()?;
    table.check_keys(&["cost"], &[])?;
    let Some(design) = design else {
        return Err(field
            .fail("there is no controller to tune")
            .next(format!("add [controller] with for example {}", suggestion::controller(machine))));
    };
    let tuned_by = design.structure.tunable().tuned_by();
    let placed = tuned_by == TunedBy::Bandwidth;
    // Of steppers in open loop it says for which family moves are planned.
    let of_open_loop = design.is_open_loop();
    if of_open_loop && let Some(field) = table.first_beyond(&["spread", "load", "places"]) {
        return Err(field
            .fail("a stepper in open loop has no gains to tune")
            .allowed("spread, load and places: the machines that a move is planned for"));
    }
    if tuned_by == TunedBy::Nothing && !of_open_loop {
        return Err(field
            .fail(format!("the gains of {} cannot be tuned", design.structure.name()))
            .allowed(format!("a controller with {}", tunable())));
    }
    let default = Tuning::default();
    let words = [
        ("moves", Some(Cost::Moves)),
        ("squares", Some(Cost::Squares)),
        ("peak", Some(Cost::Peak)),
        ("disturbance", Some(Cost::Disturbance)),
        ("none", None),
    ];
    let cost = match table.optional("cost") {
        None => default.cost,
        Some(field) => {
            let cost = field.choice(&words)?;
            if moves.is_empty() && matches!(cost, Some(Cost::Squares | Cost::Peak)) {
                return Err(field
                    .fail("there is no move whose error could be minimised")
                    .next("add [[move]], or write cost = \"moves\" for a set that suits the axis"));
            }
            cost
        }
    };
    let bandwidth = table.number_if_given("bandwidth")?;
    if let (Some(field), false) = (table.optional("bandwidth").or(table.optional("damping")), placed) {
        return Err(field
            .fail(format!("{} follows from weights, not from a bandwidth", design.structure.name()))
            .next("leave it out: the search begins at the weights of the file"));
    }
    if cost.is_none() && bandwidth.is_none() {
        let next = if placed { "add for example bandwidth = \"8 Hz\"" } else { "write for example cost = \"moves\"" };
        return Err(field.fail("without a cost the gains follow from a bandwidth, which is missing").next(next));
    }
    Ok(Some(Tuning {
        cost,
        bandwidth,
        damping: table.number("damping")?,
        sensitivity: table.number("sensitivity")?,
        complementary: table.number("complementary")?,
        spread: table.number_if_given("spread")?,
        loads: match table.optional("load") {
            None => default.loads,
            Some(field) => {
                let load = |field: &Field| field.clone().named("tune.load").number();
                field.filled_list()?.iter().map(load).collect::<Result<_>>()?
            }
        },
        places: table.number("places")? as usize,
        corners: false,
        draws: None,
        effort: default.effort,
    }))
}

/// The structures whose gains can be tuned, in words.
fn tunable() -> String {
    let all: Vec<&str> = Structure::each()
        .iter()
        .map(Structure::tunable)
        .filter(|one| one.tuned_by() != TunedBy::Nothing)
        .map(Tunable::word)
        .collect();
    match &all[..] {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => all.concat(),
    }
}

/// The table that a fit leaves behind.
pub(super) fn known(root: &Table) -> Result<Vec<Known>> {
    let Some(field) = root.optional("uncertainty") else { return Ok(Vec::new()) };
    let table = field.table()?;
    let mut all = Vec::new();
    for key in table.keys() {
        let Some(field) = table.optional(key) else { continue };
        let row = field.table()?;
        let number = |key: &str| match row.optional(key) {
            None => Ok(None),
            Some(field) => match field.node.kind {
                NodeValue::Float(value) if value.is_finite() => Ok(Some(value)),
                NodeValue::Integer(value) => Ok(Some(value as f64)),
                _ => Err(field
                    .fail("this is no finite number in SI units")
                    .next("leave the table as `taut fit` wrote it, or take it out")),
            },
        };
        let interval = match (number("low")?, number("high")?) {
            (Some(low), Some(high)) if low > high => {
                return Err(field
                    .fail(format!("the interval from {low} to {high} is empty"))
                    .allowed("low up to high"));
            }
            (Some(low), Some(high)) => Some([low, high]),
            (Some(_), None) | (None, Some(_)) => {
                return Err(field.fail("an interval has two ends").next("give low and high, or neither"));
            }
            (None, None) => None,
        };
        let error = number("error")?.filter(|error| *error > 0.0);
        all.push(Known { name: key.to_string(), interval, error });
    }
    Ok(all)
}
