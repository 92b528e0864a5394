//! What logs can tell: the sensitivity of all outputs to each parameter, and the combinations that change nothing.
//!
//! With J the derivatives of the weighted outputs with respect to relative changes of the parameters, and what else is
//! fitted along projected out, J = U S Vᵀ: moving the parameters along vᵢ by one changes the outputs by sᵢ standard deviations,
//! so 1/sᵢ is how far off that combination may be. Where that is more than [`LIMIT`], or where the outputs move by less than
//! [`SHOWS`], it is not determined.

use super::problem::Problem;
use crate::parameter::{Arm, Free, Sum, named, value};
use nalgebra::{DMatrix, SVD};

/// Relative standard error from which on a combination counts as not determined.
pub const LIMIT: f64 = 1.0;

/// Root mean square, in standard deviations of the noise, of what a change by 100 % makes of a value: below that a combination
/// counts as not determined however many values there are. Averages of thousands of values would tell it of a machine that is the
/// model to a fraction of what one value shows, and no machine is.
pub const SHOWS: f64 = 0.2;

/// From this share of it in what is not determined a parameter counts as not determined: a change of the combination by 100 %
/// that takes more than 10 % of the parameter with it.
const SHARE: f64 = 0.01;

/// Iterations of a singular value decomposition before it is given up.
const MOST_SWEEPS: usize = 10_000;

/// What the logs say of the parameters.
#[derive(Debug, Clone)]
pub struct Identifiability {
    /// Names of the free parameters, those of the machine first, then what is shared.
    pub names: Vec<String>,
    /// Root mean square of each parameter's column: by how many standard deviations a change by 100 % moves a value.
    pub sensitivity: Vec<f64>,
    /// Singular values, falling.
    pub singular: Vec<f64>,
    /// Relative standard error of each parameter with all others free; infinite where it is not determined.
    pub error: Vec<f64>,
    /// Groups of parameters of which only fewer combinations are determined.
    pub groups: Vec<Group>,
}

/// Parameters that the logs do not tell apart.
#[derive(Debug, Clone)]
pub struct Group {
    /// Places among the names.
    pub members: Vec<usize>,
    /// How many combinations of them are determined.
    pub determined: usize,
    /// What can be said in words and numbers.
    pub words: String,
}

impl Identifiability {
    /// Whether all is determined.
    pub fn complete(&self) -> bool {
        self.groups.is_empty()
    }

    /// From a Jacobian of `problem` at `x`, with residuals of this deviation; none if numbers fail.
    pub fn new(problem: &Problem, jacobian: &DMatrix<f64>, x: &[f64], deviation: f64) -> Option<Self> {
        let globals = problem.globals();
        let mut own = projected(jacobian, globals)?;
        let mut names: Vec<String> = problem.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        names.extend(problem.shared.iter().map(|extra| extra.what.name().to_string()));
        for (j, &x) in x.iter().enumerate().take(globals) {
            own.column_mut(j).scale_mut(problem.whole(j, x) / deviation.max(f64::MIN_POSITIVE));
        }
        let rows = problem.counted().max(1) as f64;
        let sensitivity = (0..globals).map(|j| own.column(j).norm() / rows.sqrt()).collect();
        // Of a simulation that was ended early there are no numbers, and the decomposition would panic.
        if own.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        let svd = SVD::try_new(own, false, true, 1e-15, MOST_SWEEPS)?;
        let v = svd.v_t.as_ref()?.transpose();
        let singular: Vec<f64> = svd.singular_values.iter().copied().collect();
        let most = singular.iter().copied().fold(0.0, f64::max);
        // Differences are good to about 1e-9 of the largest column.
        let floor = 1e-8 * most;
        let least = f64::max(1.0 / LIMIT, SHOWS * rows.sqrt());
        let lost: Vec<usize> = (0..globals).filter(|&i| !(singular[i] > floor && singular[i] > least)).collect();
        let mut error = Vec::new();
        for j in 0..globals {
            let hidden: f64 = lost.iter().map(|&i| v[(j, i)].powi(2)).sum();
            let told = (0..globals).filter(|&i| singular[i] > floor);
            let squares: f64 = told.map(|i| (v[(j, i)] / singular[i]).powi(2)).sum();
            error.push(if hidden > SHARE { f64::INFINITY } else { squares.sqrt() });
        }
        let mut result = Self { names, sensitivity, singular, error, groups: Vec::new() };
        result.groups = result.grouped(problem, &v, &lost, x);
        Some(result)
    }

    /// Parameters connected by lost directions, each group with what is left of it.
    fn grouped(&self, problem: &Problem, v: &DMatrix<f64>, lost: &[usize], x: &[f64]) -> Vec<Group> {
        let n = self.names.len();
        let hidden = |i: usize, j: usize| lost.iter().map(|&d| v[(i, d)] * v[(j, d)]).sum::<f64>();
        let mut groups = Vec::new();
        let mut seen = vec![false; n];
        for start in 0..n {
            if seen[start] || hidden(start, start) <= SHARE {
                continue;
            }
            let mut members = vec![start];
            seen[start] = true;
            let mut next = 0;
            while next < members.len() {
                let i = members[next];
                for (j, seen) in seen.iter_mut().enumerate() {
                    if !*seen && hidden(j, j) > SHARE && hidden(i, j).abs() > SHARE {
                        *seen = true;
                        members.push(j);
                    }
                }
                next += 1;
            }
            members.sort_unstable();
            let gone = members.iter().map(|&j| hidden(j, j)).sum::<f64>().round() as usize;
            let determined = members.len().saturating_sub(gone.max(1));
            let words = self.words(problem, &members, determined, &hidden, x);
            groups.push(Group { members, determined, words });
        }
        groups
    }

    fn words(
        &self,
        problem: &Problem,
        members: &[usize],
        determined: usize,
        hidden: &dyn Fn(usize, usize) -> f64,
        x: &[f64],
    ) -> String {
        let names: Vec<&str> = members.iter().map(|&j| self.names[j].as_str()).collect();
        if determined == 0 {
            return match names[..] {
                [one] => format!("{one} does not show in these logs"),
                _ => format!("{} do not show in these logs", listed(&names)),
            };
        }
        let parameters = members.iter().all(|&j| j < problem.parameters.len());
        if determined == 1 && parameters {
            // The direction that is left, by powers of what is not hidden.
            let m = members.len();
            let mut left = DMatrix::from_fn(m, m, |a, b| f64::from(a == b) - hidden(members[a], members[b]));
            for _ in 0..6 {
                left = &left * &left;
                let norm = left.norm();
                if norm > 0.0 {
                    left /= norm;
                }
            }
            let best = (0..m).max_by(|&a, &b| left[(a, a)].total_cmp(&left[(b, b)])).unwrap_or(0);
            let stage = problem.stage_at(x);
            // ∂/∂p of what is determined
            let weights: Vec<f64> = members
                .iter()
                .enumerate()
                .map(|(a, &j)| {
                    let value = problem.value(j, x[j]);
                    left[(a, best)] / (problem.slope(j, value) * problem.whole(j, x[j]))
                })
                .collect();
            let parameters: Vec<&Free> = members.iter().map(|&j| &problem.parameters[j]).collect();
            if let Some(sum) = sum_of(&stage, &parameters, &weights) {
                return format!("of {} only {sum} is determined", listed(&names));
            }
        }
        let combinations = if determined == 1 { "1 combination".into() } else { format!("{determined} combinations") };
        let mut text = format!("of {} only {combinations} can be told", listed(&names));
        if members.len() - determined == 1 {
            // The one direction that changes nothing.
            let lead = members.iter().copied().max_by(|&a, &b| hidden(a, a).total_cmp(&hidden(b, b))).unwrap_or(0);
            let along: Vec<String> = members
                .iter()
                .filter(|&&j| j != lead)
                .map(|&j| {
                    let percent = 100.0 * 0.01 * hidden(lead, j) / hidden(lead, lead);
                    format!("{} by {}{:.2} %", self.names[j], if percent < 0.0 { "−" } else { "+" }, percent.abs())
                })
                .collect();
            text.push_str(&format!(
                ": {} by +1 % with {} changes nothing that they show",
                self.names[lead],
                along.join(", ")
            ));
        }
        text
    }

    /// What to do about a group, each a line.
    pub fn choices(&self, problem: &Problem, group: &Group) -> Vec<String> {
        let names: Vec<&str> = group.members.iter().map(|&j| self.names[j].as_str()).collect();
        let mut choices = Vec::new();
        let spare = group.members.len() - group.determined;
        choices.push(match (group.determined, names.len()) {
            (0, _) => format!("leave {} out of [fit]: the value of the case file stays", listed(&names)),
            (_, 2) => format!("fix one: leave {} or {} out of [fit]", names[0], names[1]),
            _ => format!("fix {spare}: leave {spare} of {} out of [fit]", listed(&names)),
        });
        if group.determined == 1 && names.len() > 1 {
            let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            choices.push(format!("tie them: tied = [[{}]]", quoted.join(", ")));
            let members = || group.members.iter().map(|&j| problem.parameters.get(j));
            for sum in [Sum::Viscous, Sum::Coulomb, Sum::Inertia] {
                let fits = |free: Option<&Free>| {
                    free.is_some_and(|free| free.keys.iter().all(|(key, _)| sum_with(key) == Some(sum)))
                };
                if members().all(fits) && !problem.parameters.iter().any(|free| free.name == sum.name()) {
                    choices.push(format!("lump them: lumped = [\"{}\"]", sum.name()));
                }
            }
        }
        choices
    }
}

/// Columns of the first `n` variables without what the others can do.
fn projected(jacobian: &DMatrix<f64>, n: usize) -> Option<DMatrix<f64>> {
    let all = jacobian.ncols();
    if all == n {
        let rows = jacobian.nrows();
        return if rows > n { Some(jacobian.clone().qr().unpack_r()) } else { Some(jacobian.clone()) };
    }
    // Others first: the last block of R is what they leave of the rest.
    let order: Vec<usize> = (n..all).chain(0..n).collect();
    let ordered = jacobian.select_columns(&order);
    if ordered.nrows() < all {
        return None;
    }
    let r = ordered.qr().unpack_r();
    Some(r.view((all - n, all - n), (n, n)).into_owned())
}

/// The sum over the bodies that a key is part of.
fn sum_with(key: &str) -> Option<Sum> {
    named(key)?.part.map(|(sum, _)| sum).filter(|sum| *sum != Sum::Stiffness)
}

/// A sum over the bodies that these weights are, in symbols and numbers.
fn sum_of(stage: &crate::stage::Stage, parameters: &[&Free], weights: &[f64]) -> Option<String> {
    // Each one's keys must be parts of one sum.
    let sum = sum_with(&parameters.first()?.keys.first()?.0)?;
    let mut parts = Vec::new();
    let mut total = 0.0;
    let mut scale = None;
    let arm_and_symbol = |key: &str| -> Option<(Arm, &'static str)> {
        let row = named(key)?;
        row.part.filter(|(own, _)| *own == sum).map(|(_, arm)| (arm, row.symbol))
    };
    for (free, weight) in parameters.iter().zip(weights) {
        let mut own = 0.0;
        for (key, factor) in &free.keys {
            let (arm, symbol) = arm_and_symbol(key)?;
            own += factor * arm.of(stage);
            parts.push(arm.times(symbol));
            total += arm.of(stage) * value(stage, key)?;
        }
        // All weights are the same number of times the arms, within a tenth: the belt gives way a little.
        let ratio = weight / own;
        if (ratio / *scale.get_or_insert(ratio) - 1.0).abs() > 0.1 {
            return None;
        }
    }
    // What is not searched for and adds to it.
    let is_free = |key: &str| parameters.iter().any(|free| free.keys.iter().any(|(own, _)| own == key));
    for row in sum.parts(true).filter(|row| !is_free(row.key)) {
        let (arm, symbol) = arm_and_symbol(row.key)?;
        let own = arm.of(stage) * value(stage, row.key).unwrap_or(0.0);
        if own != 0.0 {
            total += own;
            parts.push(arm.times(symbol));
        }
    }
    let motor = &stage.motor;
    if sum == Sum::Viscous
        && stage.amplifier.mode == crate::stage::AmplifierMode::Voltage
        && motor.back_emf_constant != 0.0
    {
        let n2 = motor.gear_ratio * motor.gear_ratio;
        total += n2 * motor.torque_constant * motor.back_emf_constant / motor.resistance;
        parts.push(if n2 == 1.0 { "K_t K_e/R".into() } else { "n² K_t K_e/R".into() });
    }
    let unit = match sum {
        Sum::Viscous => "N m s",
        Sum::Coulomb => "N m",
        Sum::Inertia => "kg m²",
        Sum::Stiffness => "N/m",
    };
    Some(format!("{} = {} {unit}", parts.join(" + "), crate::quantity::rounded(total)))
}

fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => one.to_string(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
