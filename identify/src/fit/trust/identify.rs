//! Identifiability: the sensitivity of all outputs to each parameter, and the combinations that change nothing.
//!
//! With the derivatives J of the weighted outputs with respect to relative changes of the parameters, nuisance
//! parameters projected out, J = U S Vᵀ: along vᵢ the outputs change by sᵢ standard deviations of white noise. The
//! noise of the residuals determines the error of that combination ([`crate::fit::noise`]); if this exceeds
//! [`UNDETERMINED`], or if the outputs change by less than a machine can show ([`LEAST_SHOWN`], [`MODEL_ERROR`]), it is
//! not determined.

use super::belts::Compared;
use super::combinations::{self, Combination};
use super::directions::Directions;
use crate::fit::asked::problem::{Problem, extent};
use crate::fit::asked::run::MeasuredOutput;
use crate::fit::limits::{LEAST_SHOWN, MODEL_ERROR, SHARE_LOST, UNDETERMINED};
use crate::parameter::{Arm, Free, Sum, named, value};
use nalgebra::DMatrix;

/// The information of the logs on the parameters.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Identifiability {
    /// Names of the free parameters, those of the machine first, then what is shared.
    pub names: Vec<String>,
    /// RMS of each parameter's column: change of a value by 100 %, in standard deviations.
    pub sensitivity: Vec<f64>,
    /// Singular values, falling.
    pub singular: Vec<f64>,
    /// Relative standard error of each parameter with all others free; infinite if it is not determined.
    pub error: Vec<f64>,
    /// Groups of parameters with fewer determined combinations than members.
    pub groups: Vec<Group>,
    /// The directions that are not determined, a column each: orthonormal, in relative changes of what concerns all
    /// runs.
    pub lost: DMatrix<f64>,
    /// Comparison of the belts of two drives, if a free parameter changes them.
    pub belts: Option<Compared>,
}

/// Parameters that the logs cannot distinguish.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Group {
    /// Indices among the names.
    pub members: Vec<usize>,
    /// Number of their determined combinations.
    pub determined: usize,
    /// The combination in words and numbers.
    pub words: String,
    /// Their determined sums, ratios and products that have a name.
    pub combinations: Vec<Combination>,
}

impl Identifiability {
    /// True if everything is determined.
    pub fn complete(&self) -> bool {
        self.groups.is_empty()
    }

    /// Identifiability from a Jacobian of `problem` at `x`, for white noise of this deviation; `None` if numbers fail.
    pub fn new(problem: &Problem, jacobian: &DMatrix<f64>, x: &[f64], deviation: f64) -> Option<Self> {
        let all: Vec<usize> = (0..problem.globals()).collect();
        let directions = Directions::new(problem, jacobian, x, &all)?;
        let deviation = deviation.max(f64::MIN_POSITIVE);
        let off: Vec<f64> = directions.singular.iter().map(|s| deviation / s).collect();
        let of = |c: &[f64]| c.iter().zip(&off).map(|(c, off)| (c * off).powi(2)).sum::<f64>().sqrt();
        Some(Self::told(problem, &directions, x, deviation, &off, &of))
    }

    /// For the noise of the residuals: `off` is the relative standard error along each direction, `of` that of a
    /// combination of directions.
    pub(crate) fn told(
        problem: &Problem,
        directions: &Directions,
        x: &[f64],
        deviation: f64,
        off: &[f64],
        of: &dyn Fn(&[f64]) -> f64,
    ) -> Self {
        let Directions { v, singular, norms, alive, rows, .. } = directions;
        let n = v.nrows();
        let mut names: Vec<String> = problem.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        names.extend(problem.shared.iter().map(|extra| extra.what.name(&problem.machine)));
        let sensitivity = norms.iter().map(|norm| norm / deviation / rows.sqrt()).collect();
        let least = shows(problem).least * rows.sqrt();
        let lost: Vec<usize> =
            (0..v.ncols()).filter(|&i| i >= *alive || singular[i] < least || off[i] > UNDETERMINED).collect();
        let goes_with = |j: usize| lost.iter().map(|&i| v[(j, i)].powi(2)).sum::<f64>().sqrt();
        let error = (0..n)
            .map(|j| {
                // Along lost directions at most by 100 %.
                let row: Vec<f64> = (0..*alive)
                    .map(|i| if lost.contains(&i) { v[(j, i)] * (UNDETERMINED / off[i]).min(1.0) } else { v[(j, i)] })
                    .collect();
                if goes_with(j) > SHARE_LOST { f64::INFINITY } else { of(&row) }
            })
            .collect();
        let singular = singular.iter().map(|s| s / deviation).collect();
        let hidden = v.select_columns(&lost);
        let belts = Compared::new(problem, directions, &lost, x, of);
        let mut result = Self { names, sensitivity, singular, error, groups: Vec::new(), lost: hidden, belts };
        result.groups = result.grouped(problem, directions, (&lost, off), x, of);
        result
    }

    /// Parameters connected by lost directions, each group with its determined combinations.
    fn grouped(
        &self,
        problem: &Problem,
        directions: &Directions,
        (lost, off): (&[usize], &[f64]),
        x: &[f64],
        of: &dyn Fn(&[f64]) -> f64,
    ) -> Vec<Group> {
        let n = self.names.len();
        let v = &directions.v;
        let hidden = |i: usize, j: usize| lost.iter().map(|&d| v[(i, d)] * v[(j, d)]).sum::<f64>();
        let is_hidden = |j: usize| self.error[j].is_infinite();
        let mut groups = Vec::new();
        let mut seen = vec![false; n];
        for start in 0..n {
            if seen[start] || !is_hidden(start) {
                continue;
            }
            let mut members = vec![start];
            seen[start] = true;
            let mut next = 0;
            while next < members.len() {
                let i = members[next];
                for (j, seen) in seen.iter_mut().enumerate() {
                    if !*seen && is_hidden(j) && hidden(i, j).abs() > SHARE_LOST * SHARE_LOST {
                        *seen = true;
                        members.push(j);
                    }
                }
                next += 1;
            }
            members.sort_unstable();
            let gone = members.iter().map(|&j| hidden(j, j)).sum::<f64>().round() as usize;
            let determined = members.len().saturating_sub(gone.max(1));
            let told = directions.told_by_noise(lost, &members, off);
            let words = match told {
                Some(strongest) if determined == 0 => self.too_little(problem, &members, strongest),
                _ => self.words(problem, &members, determined, &hidden, x),
            };
            let combinations = if determined == 0 {
                Vec::new()
            } else {
                combinations::combinations(problem, directions, &self.names, &members, lost, x, of)
            };
            groups.push(Group { members, determined, words, combinations });
        }
        groups
    }

    /// Message for members that move the outputs too little: by `strongest`, relative to the weight of all values.
    fn too_little(&self, problem: &Problem, members: &[usize], strongest: f64) -> String {
        let names: Vec<&str> = members.iter().map(|&j| self.names[j].as_str()).collect();
        let Least { least, range } = shows(problem);
        let percent = |share: f64| crate::number::significant(100.0 * share, 2);
        let by = match least > MODEL_ERROR * range {
            true => "less than a fifth of their resolution".to_string(),
            false => format!(
                "{} % of their range, and a model is not accurate to less than {} %",
                percent(strongest / range),
                percent(MODEL_ERROR)
            ),
        };
        let verb = if names.len() == 1 { "has" } else { "have" };
        format!(
            "{} {verb} too little effect in these logs: a change by 100 % moves the outputs by {by}",
            listed(&names)
        )
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
                [one] => format!("{one} has no visible effect in these logs"),
                _ => format!("{} have no visible effect in these logs", listed(&names)),
            };
        }
        let parameters = members.iter().all(|&j| j < problem.parameters.len());
        if determined == 1 && parameters {
            // The remaining direction, in powers of the visible parameters.
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
            let machine = problem.stage_at(x);
            // ∂/∂p of the determined combination
            let weights: Vec<f64> = members
                .iter()
                .enumerate()
                .map(|(a, &j)| {
                    let value = problem.value(j, x[j]);
                    left[(a, best)] / (problem.slope(j, value) * problem.whole(&machine, j, x[j]))
                })
                .collect();
            let parameters: Vec<&Free> = members.iter().map(|&j| &problem.parameters[j]).collect();
            if let Some(sum) = sum_of(&machine, &parameters, &weights) {
                return format!("of {} only the combination {sum} is identifiable", listed(&names));
            }
        }
        let combinations = if determined == 1 { "1 combination".into() } else { format!("{determined} combinations") };
        let mut text = format!("of {} only {combinations} can be determined", listed(&names));
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
            text.push_str(&format!(": {} by +1 % with {} changes nothing in them", self.names[lead], along.join(", ")));
        }
        text
    }

    /// Advice for a group, a line each.
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
            choices.extend(tie(problem, &group.members));
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

/// The tie of these parameters; `None` for values of different units, sums, and parameters of single campaigns.
fn tie(problem: &Problem, members: &[usize]) -> Option<String> {
    let mut keys = Vec::new();
    let unit = problem.parameters.get(*members.first()?)?.unit;
    for &j in members {
        let free = problem.parameters.get(j)?;
        if free.unit != unit || free.name.starts_with("total.") || problem.of[j].is_some() {
            return None;
        }
        keys.extend(free.name.split(" = ").map(|key| format!("\"{key}\"")));
    }
    Some(format!("tie them: tied = [[{}]]", keys.join(", ")))
}

/// Least visible change of a value, and the range of the values, in their weights.
struct Least {
    least: f64,
    range: f64,
}

/// Least visible RMS change of a value.
fn shows(problem: &Problem) -> Least {
    let seen = problem.runs.iter().flat_map(|run| &run.seen);
    let of = |seen: &MeasuredOutput| {
        let weight = seen.weights.iter().copied().fold(0.0, f64::max);
        let range = weight * extent(&seen.values);
        Least { least: f64::max(weight * LEAST_SHOWN * seen.step / 12f64.sqrt(), MODEL_ERROR * range), range }
    };
    let all = seen.map(of).filter(|one| one.least > 0.0 && one.least < 1e300);
    all.min_by(|a, b| a.least.total_cmp(&b.least)).unwrap_or(Least { least: 1e300, range: 1e300 })
}

/// The sum over the bodies that a key is part of.
fn sum_with(key: &str) -> Option<Sum> {
    named(key)?.part.map(|(sum, _)| sum).filter(|sum| *sum != Sum::Stiffness)
}

/// The sum over the bodies with these weights, in symbols and numbers.
pub(crate) fn sum_of(machine: &crate::machine::Machine, parameters: &[&Free], weights: &[f64]) -> Option<String> {
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
            own += factor * arm.length(machine);
            parts.push(arm.times(symbol));
            total += arm.length(machine) * value(machine, key)?;
        }
        // All weights are the arms times one number, within a tenth, since the belt is elastic.
        let ratio = weight / own;
        if (ratio / *scale.get_or_insert(ratio) - 1.0).abs() > 0.1 {
            return None;
        }
    }
    // Fixed parameters that contribute to it.
    let is_free = |key: &str| parameters.iter().any(|free| free.keys.iter().any(|(own, _)| own == key));
    for row in sum.parts(true).filter(|row| !is_free(row.key)) {
        let (arm, symbol) = arm_and_symbol(row.key)?;
        let own = arm.length(machine) * value(machine, row.key).unwrap_or(0.0);
        if own != 0.0 {
            total += own;
            parts.push(arm.times(symbol));
        }
    }
    let motor = &machine.drives[0].motor;
    if sum == Sum::Viscous
        && machine.drives[0].amplifier.mode == crate::machine::AmplifierMode::Voltage
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

pub(crate) fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => one.to_string(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::search::starts::tests::at_start;

    /// A machine follows no model to a fifth of the rounding of its converter, nor to a share of 2 in 10 000 of the
    /// range: averages over noise tell nothing below that.
    #[test]
    fn what_moves_the_outputs_less_than_a_machine_can_show_is_not_determined() {
        let (case, plan) = case(false);
        let found = at_start(Problem::new(&case, &plan).unwrap());
        let rows = (found.problem.counted() as f64).sqrt();
        // What is said where a change by 100 % moves the outputs by this, in their weights.
        let told = |problem: &Problem, by: f64| {
            let (jacobian, x) = (&found.best.jacobian, &found.best.x);
            let whole = Identifiability::new(problem, jacobian, x, 1.0).unwrap().singular[0] / rows;
            let known = Identifiability::new(problem, &(jacobian * (by / whole)), x, 1e-9).unwrap();
            known.groups.first().map_or(String::new(), |group| group.words.clone())
        };
        let weighted = |seen: &MeasuredOutput| seen.weights[0] * extent(&seen.values);
        let range = weighted(&found.problem.runs[0].seen[0]);
        let smooth = [1e-4, 3e-4].map(|share| told(&found.problem, share * range));
        assert!(smooth[0].contains("of their range") && smooth[1].is_empty(), "{smooth:?}");
        let mut stepped = found.problem.clone();
        for seen in &mut stepped.runs[0].seen {
            seen.step = extent(&seen.values);
        }
        let rounding = range / 12f64.sqrt();
        let rounded = [0.15, 0.25].map(|share| told(&stepped, share * rounding));
        assert!(rounded[0].contains("a fifth of their resolution") && rounded[1].is_empty(), "{rounded:?}");
    }
}
