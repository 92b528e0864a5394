//! Warnings and notes on a fit, before its numbers are used: faults of the logs, and of the search.

use super::doubts::Cause;
use super::finding::{Finding, Grade};
use super::found::Fit;
use super::interruption::interruptions;
use super::scores::LogFit;
use super::trials::{is_borne_out, is_opposite};
use super::unexplained::{self, Reason};
use crate::case::{Case, Plan};
use crate::fit::asked::controller::reproduced;
use crate::fit::limits::{
    CAUSE_EXPLAINS, CAUSE_MOVES, CAUSE_SETTLES, CAUSE_WARNS, FACTOR_LEAVES, FAR_BEYOND_NOISE, KINK_PROMISE,
    MORE_THAN_NOISE, MOTOR_CONSTANTS, NORMAL, POOR_FIT, REPRODUCED,
};
use crate::fit::noise::Wave;
use crate::fit::search::point::Ending;
use crate::fit::search::regression::Balance;
use crate::fit::search::starts::Searched;
use crate::log::{Channel, Note, Quantity, Remedy, Severity, Survey};
use crate::machine::{AmplifierMode, DriveAt, DriveUnit, Motor};
use crate::number::{engineering_typed, significant};

/// All findings, warnings first.
pub(crate) fn findings(case: &Case, plan: &Plan, found: &Searched, fit: &Fit, surveys: &[Survey]) -> Vec<Finding> {
    let mut all = of_logs(case, plan, found, surveys);
    all.extend(of_controller(case, plan));
    all.extend(of_cause(fit));
    all.extend(of_search(fit));
    let is_explained = fit.cause.as_ref().is_some_and(|cause| cause.explained >= CAUSE_SETTLES);
    all.extend(interruptions(case, plan, found).into_iter().filter(|_| !is_explained));
    all.extend(of_motor(case, fit));
    let unexplained = of_residuals(case, plan, found, fit, &all);
    // Each of two exchanged columns may move against the model, but a change of sign corrects neither; and where one
    // column is reversed, not all are.
    let is_corrected =
        |log: &Option<String>| unexplained.iter().any(|one| ["swapped", "sign"].contains(&one.code) && one.log == *log);
    all.retain(|one| !(one.code == "sign" && is_corrected(&one.log)));
    all.extend(unexplained);
    let astray = astray(surveys, &all);
    let follows = ["time-unit", "interruption", "unexplained"];
    all.retain(|one| !(follows.contains(&one.code) && one.log.as_ref().is_some_and(|log| astray.contains(log))));
    // A sensor that stands still is a part in which the machine does not follow its input.
    let held: Vec<_> = all.iter().filter(|one| one.code == "held").map(|one| one.log.clone()).collect();
    all.retain(|one| !(one.code == "interruption" && held.contains(&one.log)));
    let is_named = all.iter().any(|one| one.grade == Grade::Warning || one.code == "other_law") || fit.cause.is_some();
    all.extend(of_noise(found, fit, is_named));
    all.sort_by_key(|finding| std::cmp::Reverse(finding.grade));
    all
}

/// The logs whose first value is reported as an outlier: a run from there agrees with nothing.
fn astray(surveys: &[Survey], all: &[Finding]) -> Vec<String> {
    let is_first = |channel: &Channel| channel.outliers.first().is_some_and(|outlier| outlier.sample == 0);
    let is_astray = |survey: &&Survey| {
        let is_told = all.iter().any(|one| one.code == "outliers" && one.log.as_ref() == Some(&survey.log));
        is_told && survey.channels.iter().any(is_first)
    };
    surveys.iter().filter(is_astray).map(|survey| survey.log.clone()).collect()
}

fn finding(grade: Grade, code: &'static str, text: String) -> Finding {
    Finding { grade, code, log: None, text }
}

/// The findings of the survey of each log that simulation confirms.
fn of_logs(case: &Case, plan: &Plan, found: &Searched, surveys: &[Survey]) -> Vec<Finding> {
    let mut all = Vec::new();
    for survey in surveys {
        let name = &survey.log;
        for note in survey.notes.iter().filter(|note| note.severity != Severity::Fact) {
            let grade = grade(note, case, plan);
            let column = note.column.map(|column| format!("{column}: ")).unwrap_or_default();
            let text = format!("{column}{}", note.text);
            all.push(Finding { grade, code: note.code, log: Some(name.clone()), text });
        }
        let told = all.iter().any(|one: &Finding| one.code == "sign" && one.log.as_ref() == Some(name));
        if !told && is_opposite(&found.problem, name) && is_borne_out(case, plan, found, name, &Remedy::Reverse) {
            let inputs = case.machine.geometry().drives.iter().map(|drive| format!("{} = -1", drive.input));
            let text = format!(
                "it moves opposite to the model with the values of the case: swapped wires, or a sign; set scale = {{ \
                 {} }}, or -1 for the outputs",
                inputs.collect::<Vec<_>>().join(", ")
            );
            all.push(Finding { grade: Grade::Warning, code: "sign", log: Some(name.clone()), text });
        }
    }
    all
}

/// True if no slide ends at a stop.
fn is_free(case: &Case) -> bool {
    case.machine.slides().all(|slide| slide.travel.is_none())
}

fn grade(note: &Note, case: &Case, plan: &Plan) -> Grade {
    match (note.severity, note.code) {
        (Severity::Suspicion, _) | (_, "still") => Grade::Warning,
        (_, "saturation") if is_free(case) || note.column.is_some_and(|column| column.ends_with("input")) => {
            Grade::Warning
        }
        (_, "outliers") if !plan.huber => Grade::Warning,
        _ => Grade::Note,
    }
}

/// Findings about the controller: its output for the logged positions, compared with the logged input.
fn of_controller(case: &Case, plan: &Plan) -> Vec<Finding> {
    let logs = case.experiments.iter().filter_map(|experiment| experiment.log.as_ref());
    let told = logs.filter_map(|log| {
        let percent = reproduced(case, log)?;
        let good = percent >= REPRODUCED;
        let grade = if good || !plan.closed_loop { Grade::Note } else { Grade::Warning };
        let next = match good {
            true => "",
            false => ": check its gains, delay, filters and reference_speed, and the columns of reference and position",
        };
        let text = format!("the controller of the case reproduces the logged input to {:.1} %{next}", percent.max(0.0));
        Some(Finding { grade, code: "controller", log: Some(log.name.clone()), text })
    });
    told.collect()
}

/// Residuals above the noise of the logs. With several coordinates or a stepper, elastic modes cause local minima; with
/// one coordinate the missing elements have been tried, and `is_named` if one of them, or another reason, is reported.
/// A vibration cannot be told from narrow-band noise; residuals that keep their sign for long are no noise.
fn of_noise(found: &Searched, fit: &Fit, is_named: bool) -> Option<Finding> {
    let problem = &found.problem;
    let is_searched = problem.machine.has_torque_balance();
    let explains = |cause: &Cause| cause.explained >= CAUSE_SETTLES || cause.times_noise <= MORE_THAN_NOISE;
    let is_explained = fit.cause.as_ref().is_some_and(explains);
    if problem.parameters.is_empty() || is_searched && is_named || is_explained {
        return None;
    }
    let most = if is_searched { FAR_BEYOND_NOISE } else { MORE_THAN_NOISE };
    let beyond: Vec<(Quantity, f64)> = found.times_noise().filter(|(_, times)| *times > most).collect();
    let oscillating = |(quantity, _): &(Quantity, f64)| {
        let own = fit.oscillations.iter().find(|(own, _)| own == quantity);
        own.map(|(_, hertz)| engineering_typed(*hertz, "Hz", 2))
    };
    let named = |own: &(Quantity, f64)| {
        let at = oscillating(own).filter(|_| !is_searched).map(|hertz| format!(" at {hertz}")).unwrap_or_default();
        format!("{} {} times{at}", own.0.name(), significant(own.1, 2))
    };
    let frequencies: Option<Vec<String>> = beyond.iter().map(oscillating).collect();
    let next = if let (true, Some(frequencies)) = (is_searched && problem.swings, frequencies) {
        &format!(
            "they oscillate at {}, by a vibration that the model lacks or by noise, for which the intervals allow",
            frequencies.join(" and ")
        )
    } else if is_searched {
        "the model lacks something that none of the tried elements explains, and the intervals hold only as far as what \
         is missing resembles noise"
    } else if problem.machine.stepper().is_none() {
        "the model lacks something that none of the tried elements explains, or the search ended in one of several \
         minima; try starts = 8 in [fit], begin with values nearer to the machine's, or let `taut fit --drift` try \
         single changes of a machine that was known"
    } else {
        "the model lacks something, or the search ended in one of several minima; try starts = 8 in [fit], or begin \
         with values nearer to the machine's"
    };
    let names = beyond.iter().map(named).collect::<Vec<_>>().join(", ");
    let text = format!("residuals exceed the noise of the logs ({names}): {next}");
    // The share of the squared residuals that noise does not explain: 1 − σ²/σ_e².
    let unexplained = beyond.iter().map(|(_, times)| 1.0 - times.powi(-2)).fold(0.0, f64::max);
    let grade = if unexplained >= CAUSE_WARNS && !is_searched { Grade::Warning } else { Grade::Note };
    (!beyond.is_empty()).then(|| finding(grade, "noise", text))
}

/// Findings about the end of the search.
fn of_search(fit: &Fit) -> Vec<Finding> {
    let mut all = Vec::new();
    match fit.ending {
        Ending::Stalled if fit.decrement > KINK_PROMISE => all.push(finding(
            Grade::Warning,
            "slope",
            format!(
                "the search stopped although the cost can still decrease by {:.1} standard errors (predicted): this is not a minimum",
                fit.decrement
            ),
        )),
        Ending::Stalled => all.push(finding(
            Grade::Note,
            "kink",
            format!(
                "ended at a kink, where sticks and slips change their order: predicted gain of {:.1} standard errors",
                fit.decrement
            ),
        )),
        Ending::OutOfIterations => {
            all.push(finding(Grade::Warning, "steps", "iteration limit reached before convergence".into()));
        }
        Ending::Converged | Ending::Interrupted | Ending::Failed => {}
    }
    for estimate in fit.estimates.iter().filter(|estimate| estimate.at_bound) {
        let zero = estimate.value == 0.0 && estimate.bounds[0] == 0.0;
        let value = plain(estimate.value, estimate.unit);
        let text = match zero {
            true => format!("{} is zero: the optimum would be negative", estimate.name),
            false => format!("{} ended at its bound of {value}: the optimum lies outside", estimate.name),
        };
        all.push(finding(if zero { Grade::Note } else { Grade::Warning }, "bound", text));
    }
    if let (Some(found), None) = (&fit.disagreement, &fit.cause) {
        let names: Vec<String> = fit
            .estimates
            .iter()
            .zip(&found.off)
            .filter(|(_, off)| **off > 2.0)
            .map(|(estimate, off)| format!("{} by {off:.1}", estimate.name))
            .collect();
        let text = format!(
            "{} windows of {} disagree with the whole logs by more than noise (in standard errors: {}); no element \
             explains that; the intervals are widened by it",
            found.windows,
            plain(found.length, "s"),
            names.join(", ")
        );
        all.push(finding(Grade::Note, "disagreement", text));
    }
    if let Some(found) = &fit.other_law {
        let moved = fit.estimates.iter().zip(&found.off).filter(|(_, off)| **off > 1.0);
        let moved: Vec<String> = moved.map(|(estimate, off)| format!("{} by {off:.1}", estimate.name)).collect();
        let moved = match moved.is_empty() {
            true => "it would move no parameter by more than its standard error".to_string(),
            false => {
                format!("it would move, in standard errors, {}; the intervals are widened by that", moved.join(", "))
            }
        };
        let text = format!(
            "the residuals suggest {}, which explains {:.0} % of them ({:.1} standard errors): {moved}; \
             `taut fit --compare` tries other laws",
            found.words,
            100.0 * found.explained,
            found.standard_errors
        );
        let grade = if found.explained >= CAUSE_WARNS { Grade::Warning } else { Grade::Note };
        all.push(finding(grade, "other_law", text));
    }
    // a²/2 of a wave compared with σ² of the residuals. If an element explains them, its waves are included.
    let share = |wave: &Wave| {
        let noise = fit.noise.iter().find(|(quantity, _)| *quantity == wave.quantity);
        noise.map_or(1.0, |(_, deviation)| 0.5 * (wave.amplitude / deviation).powi(2))
    };
    let waves = fit.waves.iter().filter(|wave| fit.cause.is_none() && share(wave) >= CAUSE_EXPLAINS);
    for Wave { quantity, length, amplitude } in waves {
        let text = format!(
            "{}: its error repeats with position, by ±{} every {}; the intervals are widened by its effect",
            quantity.name(),
            engineering_typed(*amplitude, quantity.unit(), 2),
            plain(*length, quantity.unit())
        );
        all.push(finding(Grade::Note, "place", text));
    }
    all
}

/// The missing element, from a fit with it.
fn of_cause(fit: &Fit) -> Option<Finding> {
    let found = fit.cause.as_ref()?;
    let moved = fit.estimates.iter().zip(&found.estimates).filter_map(|(estimate, with)| {
        let with = with.as_ref()?;
        let is_moved = (with.value - estimate.value).abs() > CAUSE_MOVES * estimate.value.abs();
        is_moved.then(|| {
            let [value, error, own] = [with.value, NORMAL * with.error, estimate.value].map(|v| shown(v, with.unit));
            format!("{} is then {value} ± {error} ({own} without)", estimate.name)
        })
    });
    let moved: Vec<String> = moved.collect();
    let moved = if moved.is_empty() { "no estimate moves by a hundredth".to_string() } else { moved.join(", ") };
    let text = format!(
        "{} explains {:.0} % of the residuals, and improves the prediction of {} of {} held-out parts: {moved}; \
         the intervals are widened to contain that; {}",
        found.words,
        100.0 * found.explained,
        found.better[0],
        found.better[1],
        found.add
    );
    let grade = if found.explained >= CAUSE_WARNS { Grade::Warning } else { Grade::Note };
    Some(finding(grade, found.key, text))
}

/// A value in three digits.
fn shown(value: f64, unit: &str) -> String {
    engineering_typed(value, unit, 3)
}

/// Finding if K_t and K_e cannot belong to one motor.
fn of_motor(case: &Case, fit: &Fit) -> Option<Finding> {
    let drives = fit.machine.geometry().drives.iter().zip(&fit.machine.drives);
    drives.zip(&case.machine.drives).find_map(|((at, fitted), given)| constants(at, &fitted.motor, given))
}

/// Finding if K_t and K_e of this drive's motor cannot belong to one motor.
fn constants(at: &DriveAt, motor: &Motor, given: &DriveUnit) -> Option<Finding> {
    let (k_t, k_e) = (motor.torque_constant, motor.back_emf_constant);
    if motor.is_simple || given.amplifier.mode != AmplifierMode::Voltage || k_t <= 0.0 || k_e <= 0.0 {
        return None;
    }
    let ratio = k_t / k_e;
    if (1.0 / MOTOR_CONSTANTS..MOTOR_CONSTANTS).contains(&ratio) {
        return None;
    }
    let text = format!(
        "{}K_t = {} and K_e = {} of one motor are equal in SI units, and here differ by a factor of {}: tie them, or \
         check what else brakes or drives (the gain, the resistance, friction)",
        if at.key.is_empty() { String::new() } else { format!("{}: ", at.label.name) },
        plain(k_t, "N m/A"),
        plain(k_e, "V s/rad"),
        crate::quantity::rounded((10.0 * ratio.max(1.0 / ratio)).round() / 10.0)
    );
    Some(finding(Grade::Warning, "motor", text))
}

/// Logs that the model does not explain, with the reason, if windows or a factor are one.
fn of_residuals(case: &Case, plan: &Plan, found: &Searched, fit: &Fit, others: &[Finding]) -> Vec<Finding> {
    // An element that the model lacks is the reason already.
    if fit.cause.as_ref().is_some_and(|cause| cause.explained >= 1.0 - FACTOR_LEAVES) {
        return Vec::new();
    }
    // A log that shows no motion is not explained by any model.
    let is_known = |log: &LogFit| others.iter().any(|one| one.code == "still" && one.log.as_ref() == Some(&log.name));
    let poor = |log: &LogFit, quantity: Quantity| {
        let own = log.outputs.iter().find(|output| output.quantity == quantity);
        own.and_then(|output| output.fitted).filter(|score| score.percent < POOR_FIT)
    };
    let logs: Vec<&LogFit> = fit.logs.iter().filter(|log| !log.held_out && !is_known(log)).collect();
    let mut all = Vec::new();
    for quantity in found.problem.quantities() {
        let own: Vec<_> = logs.iter().filter_map(|log| Some((log.name.as_str(), poor(log, quantity)?))).collect();
        let names: Vec<&str> = own.iter().map(|(name, _)| *name).collect();
        if names.is_empty() {
            continue;
        }
        let is_reversed =
            |name: &&str| others.iter().any(|one| one.code == "sign" && one.log.as_deref() == Some(*name));
        // Where the sign is the reason, no other is looked for, but that two columns have changed places or one has the
        // wrong sign.
        let reason = match names.iter().all(is_reversed) {
            true => match unexplained::of_columns(case, plan, found, quantity, &names) {
                Some(corrected) => Some(corrected),
                None => continue,
            },
            false => unexplained::reason(case, plan, found, quantity, &names),
        };
        let Reason { code, text } = reason.unwrap_or_else(|| Reason {
            code: "unexplained",
            text:
                "neither windows nor exchanged or reversed columns nor a factor on it or on the input explains that: check signs, \
                   columns and units of this log, and missing parts of the model"
                    .into(),
        });
        all.extend(own.into_iter().map(|(name, score)| {
            let text =
                format!("{}: the model explains only {:.0} % of it: {text}", quantity.name(), score.percent.max(0.0));
            Finding { grade: Grade::Warning, code, log: Some(name.to_string()), text }
        }));
    }
    all
}

fn plain(value: f64, unit: &str) -> String {
    engineering_typed(value, unit, 4)
}

impl Balance {
    /// The judgement on the unexplained torque.
    pub fn words(&self) -> &'static str {
        match self.unexplained {
            left if left < 0.1 => "a rigid axis with viscous and Coulomb friction explains these logs",
            left if left < 0.3 => "a rigid axis with viscous and Coulomb friction explains most of these logs",
            left if left < 0.7 => "a rigid axis with viscous and Coulomb friction explains little of these logs",
            _ => {
                "a rigid axis with viscous and Coulomb friction explains next to nothing of these logs: check columns and \
                 times; a wrong unit would not matter to it"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::doubts::Size;
    use super::super::result::result;
    use super::*;
    use crate::case::TEMPLATE;
    use crate::fit::asked::problem::Problem;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::search::starts::tests::at_start;
    use nalgebra::DMatrix;

    /// An output at the end of its range is an end stop, if the machine has one; an input is none.
    #[test]
    fn saturation_is_a_warning_unless_a_stop_explains_it() {
        let graded = |changes: &[&str], column: &'static str| {
            let case = Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap();
            let note = Note {
                code: "saturation",
                severity: Severity::Warning,
                column: Some(column),
                text: String::new(),
                remedy: None,
            };
            grade(&note, &case, &Plan::default())
        };
        let stops = ["travel={ min = \"-0.2 m\", max = \"0.2 m\" }"];
        assert!(graded(&[], "cart_position") == Grade::Warning);
        assert!(graded(&[], "input") == Grade::Warning);
        assert!(graded(&stops, "cart_position") == Grade::Note);
        assert!(graded(&stops, "input") == Grade::Warning);
    }

    /// A stop on a kink leaves what one standard error may be off by anyway; above that the result is no minimum.
    #[test]
    fn a_search_that_stalls_far_from_a_minimum_is_a_warning() {
        let (case, plan) = case(false);
        let mut fit = result(&at_start(Problem::new(&case, &plan).unwrap()), None);
        fit.ending = Ending::Stalled;
        let mut told = |decrement: f64| {
            fit.decrement = decrement;
            let all = of_search(&fit);
            (all[0].grade, all[0].code)
        };
        assert_eq!(told(1.5), (Grade::Note, "kink"));
        assert_eq!(told(3.0), (Grade::Warning, "slope"));
    }

    #[test]
    fn an_estimate_that_a_cause_moves_by_two_per_cent_is_told() {
        let (case, plan) = case(false);
        let mut fit = result(&at_start(Problem::new(&case, &plan).unwrap()), None);
        let own = fit.estimates[0].value;
        let mut told = |moved: f64| {
            let with = Size { name: "a".into(), unit: "N s/m", value: moved * own, error: 0.1 };
            fit.cause = Some(Cause {
                key: "drag",
                words: "drag".into(),
                explained: 0.5,
                standard_errors: 9.0,
                parameters: Vec::new(),
                estimates: vec![Some(with)],
                belts: None,
                times_noise: 1.0,
                add: "add it".into(),
                better: [4, 4],
                added: DMatrix::zeros(1, 1),
            });
            of_cause(&fit).unwrap().text
        };
        assert!(told(1.02).contains("cart.friction.viscous is then"), "{}", told(1.02));
        assert!(told(0.995).contains("no estimate moves by a hundredth"), "{}", told(0.995));
    }

    /// The reason is looked for by fits, which are not made here.
    #[test]
    fn a_log_of_which_less_than_half_is_explained_is_a_warning() {
        let (case, plan) = case(false);
        let mut found = at_start(Problem::new(&case, &plan).unwrap());
        let mut fit = result(&found, None);
        found.problem = found.problem.stopped_by(Some(&|| true));
        let mut told = |percent: f64| {
            fit.logs[0].outputs[0].fitted.as_mut().unwrap().percent = percent;
            of_residuals(&case, &plan, &found, &fit, &[]).len()
        };
        assert_eq!([30.0, 45.0, 55.0, 80.0].map(&mut told), [1, 1, 0, 0]);
    }
}
