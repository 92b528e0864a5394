//! The paper's sentences, each with the numbers that decide it.
//!
//! The meaning of the paper's words, once for all: "by far" is five times, "minor" and "marginal" less than a tenth,
//! "not appreciable" less than a hundredth, "the same" less than a thousandth.

use super::claims::{Claim, ClaimSource::Statement, MINOR, NOT_APPRECIABLE, Rule};
use super::findings::Findings;
use super::model::{Change, VOLTS};
use super::studies::{Effect, FACTORS, From, largest, smallest};
use super::words::{mm, percent, share, si, um};

const BY_FAR: f64 = 5.0;
const THE_SAME: f64 = 1e-3;

const INERTIA: [Change; 2] = [Change::PulleyInertia, Change::AllInertia];
const ALL_BUT_FRICTION: [Change; 3] = [Change::Stiffness, Change::PulleyInertia, Change::AllInertia];

/// All of them, in the paper's order.
pub fn statements(f: &Findings) -> Vec<Claim> {
    let mut all = super::make::statements(f);
    all.extend(figures_4_to_13(f));
    all.extend(matching(f));
    all.extend(friction_models(f));
    all
}

fn figures_4_to_13(f: &Findings) -> Vec<Claim> {
    let runs = &f.runs;
    let linear = |changes: &'static [Change]| runs.effects(From::Table1, changes);
    let dry = |changes: &'static [Change]| runs.effects(From::Table4, changes);
    let friction: &[Change] = &[Change::Friction];
    let stiffness: &[Change] = &[Change::Stiffness];
    let final_position = |e: &Effect| e.final_position;
    let path = |e: &Effect| e.path;
    let plateau = |e: &Effect| e.plateau;
    let oscillation = |e: &Effect| e.oscillation;
    let ratio = |from: From, by: fn(&Effect) -> f64| {
        smallest(runs.effects(from, friction), by) / largest(runs.effects(from, &ALL_BUT_FRICTION), by)
    };
    let one = |from, change, factor| runs.one(from, change, factor, VOLTS[0]);
    let [double, half] = FACTORS;
    let tau = |change, factor| one(From::Table1, change, factor).time_constant_change;
    vec![
        Claim::new(
            "figure-4-falls-short",
            Statement,
            "section 3, figure 4",
            "\"the final steady state value of the simulated system is less than what was observed in the \
             real system\"",
        )
        .found("no measured data")
        .remark(format!(
            "The measured curves are not available as data. Table 4, which the paper says matches them, \
                 ends {} (5 V) and {} (10 V) further than Table 1.",
            percent(1.0 / (1.0 + f.matched.table1[0]) - 1.0),
            percent(1.0 / (1.0 + f.matched.table1[1]) - 1.0)
        )),
        Claim::new(
            "friction-biggest",
            Statement,
            "section 3, figures 12–13",
            "\"friction has by far the biggest influence regarding the magnitude of the response\"",
        )
        .decide(
            "least effect of friction ×2, ×0.5 on the path, over the greatest of inertia and stiffness \
                 (Table 1)",
            ratio(From::Table1, path),
            "",
            Rule::AtLeast(BY_FAR),
        )
        .decide(
            "the same for the speed that is reached (Table 1)",
            ratio(From::Table1, plateau),
            "",
            Rule::AtLeast(BY_FAR),
        )
        .further("the same for the path (Table 4)", ratio(From::Table4, path), "", Rule::AtLeast(BY_FAR))
        .further(
            "the same for the final position (Table 4)",
            ratio(From::Table4, final_position),
            "",
            Rule::AtLeast(BY_FAR),
        )
        .found(format!("{} times the next largest effect", taut::number::significant(ratio(From::Table1, path), 3)))
        .remark(format!(
            "Friction ×2 and ×0.5 moves the final position by {} and {} (Table 1), by {} and {} (Table \
                 4, 5 V).",
            percent(one(From::Table1, Change::Friction, double).final_position),
            percent(one(From::Table1, Change::Friction, half).final_position),
            percent(one(From::Table4, Change::Friction, double).final_position),
            percent(one(From::Table4, Change::Friction, half).final_position)
        )),
        Claim::new(
            "inertia-stiffness-minor",
            Statement,
            "section 3, figures 6–11",
            "\"Inertia and stiffness have minor effects on the dynamics of the system\"",
        )
        .decide(
            "largest change of the position at any time, over the final position (Table \
                 1)",
            largest(linear(&ALL_BUT_FRICTION), path),
            "1",
            Rule::AtMost(MINOR),
        )
        .further(
            "largest change of the time constant (Table 1)",
            largest(linear(&ALL_BUT_FRICTION), |e| e.time_constant_change),
            "1",
            Rule::AtMost(MINOR),
        )
        .found(format!("position changes by up to {}", share(largest(linear(&ALL_BUT_FRICTION), path))))
        .remark(format!(
            "On the scale of the position plots the effect is small. The time constant follows the \
                 inertia: {} for J ×2, {} for J and M ×2.",
            percent(tau(Change::PulleyInertia, double)),
            percent(tau(Change::AllInertia, double))
        )),
        Claim::new(
            "stiffness-position",
            Statement,
            "section 3, figures 6–7",
            "\"changing the stiffness does not appreciably change the position response\"",
        )
        .decide(
            "largest change of the position at any time, over the final position (Table \
                 1)",
            largest(linear(stiffness), path),
            "1",
            Rule::AtMost(NOT_APPRECIABLE),
        )
        .further("the same for Table 4", largest(dry(stiffness), path), "1", Rule::AtMost(NOT_APPRECIABLE))
        .found(format!("position changes by up to {}", share(largest(linear(stiffness), path))))
        .remark(format!(
            "The final position moves by {} (Table 1) and by up to {} (Table 4).",
            share(largest(linear(stiffness), final_position)),
            share(largest(dry(stiffness), final_position))
        )),
        Claim::new(
            "stiffness-oscillation",
            Statement,
            "section 3, figures 8–9",
            "\"Only the oscillation in the velocity profile changes marginally\"",
        )
        .decide(
            "largest change of the speed that is reached (Table 1)",
            largest(linear(stiffness), plateau),
            "1",
            Rule::AtMost(NOT_APPRECIABLE),
        )
        .decide(
            "largest change of the time constant (Table 1)",
            largest(linear(stiffness), |e| e.time_constant_change),
            "1",
            Rule::AtMost(NOT_APPRECIABLE),
        )
        .further(
            "largest change of the oscillation between motor and cart (Table \
                 1)",
            largest(linear(stiffness), oscillation),
            "1",
            Rule::AtMost(MINOR),
        )
        .found(format!(
            "oscillation {} (k ×2), {} (×0.5)",
            percent(one(From::Table1, Change::Stiffness, double).oscillation),
            percent(one(From::Table1, Change::Stiffness, half).oscillation)
        ))
        .remark(format!(
            "The speed that is reached and the time constant stay; the oscillation changes by {} (×2) \
                 and {} (×0.5).",
            percent(one(From::Table1, Change::Stiffness, double).oscillation),
            percent(one(From::Table1, Change::Stiffness, half).oscillation)
        )),
        Claim::new("inertia-slower", Statement, "section 3, figures 10–11", "\"a slower response for higher inertia\"")
            .decide(
                "least change of the time constant for ×2 (Table 1)",
                linear(&INERTIA)
                    .filter(|e| e.factor == double)
                    .map(|e| e.time_constant_change)
                    .fold(f64::INFINITY, f64::min),
                "1",
                Rule::AtLeast(0.0),
            )
            .decide(
                "greatest change of the time constant for ×0.5 (Table 1)",
                linear(&INERTIA)
                    .filter(|e| e.factor == half)
                    .map(|e| e.time_constant_change)
                    .fold(f64::NEG_INFINITY, f64::max),
                "1",
                Rule::AtMost(0.0),
            )
            .further(
                "least change of the time constant for ×2 (Table 4)",
                dry(&INERTIA)
                    .filter(|e| e.factor == double)
                    .map(|e| e.time_constant_change)
                    .fold(f64::INFINITY, f64::min),
                "1",
                Rule::AtLeast(0.0),
            )
            .found(format!("time constant {} for J ×2", percent(tau(Change::PulleyInertia, double))))
            .remark(format!(
                "J ×2: {}, J ×0.5: {}; J and M ×2: {}, ×0.5: {}.",
                percent(tau(Change::PulleyInertia, double)),
                percent(tau(Change::PulleyInertia, half)),
                percent(tau(Change::AllInertia, double)),
                percent(tau(Change::AllInertia, half))
            )),
        Claim::new(
            "inertia-final",
            Statement,
            "section 3, figure 10",
            "\"the final position is the same\" for another inertia",
        )
        .decide(
            "largest change of the final position (Table 1)",
            largest(linear(&INERTIA), final_position),
            "1",
            Rule::AtMost(THE_SAME),
        )
        .further("the same for Table 4", largest(dry(&INERTIA), final_position), "1", Rule::AtMost(THE_SAME))
        .found(format!(
            "linear: {}; Table 4: up to {}",
            share(largest(linear(&INERTIA), final_position)),
            share(largest(dry(&INERTIA), final_position))
        ))
        .remark(format!(
            "It is a property of viscous friction: r K_t/R · V T/(B_1 + B_2 + b r² + K_t K_e/R) holds \
                 no inertia. With \
                 Coulomb friction J ×2 moves it by {} and J and M ×2 by {} (Table 4, 5 V).",
            percent(one(From::Table4, Change::PulleyInertia, double).final_position),
            percent(one(From::Table4, Change::AllInertia, double).final_position)
        )),
        Claim::new(
            "inertia-coasting",
            Statement,
            "section 3, figure 10",
            "\"a higher inertia also leads to a slower deceleration after shutting off the motor\"",
        )
        .decide(
            "distance travelled after the pulse for J ×2, over that for J (Table \
                 1)",
            one(From::Table1, Change::PulleyInertia, double).coasting,
            "",
            Rule::AtLeast(1.0),
        )
        .further(
            "the same for Table 4, 5 V",
            one(From::Table4, Change::PulleyInertia, double).coasting,
            "",
            Rule::AtLeast(1.0),
        )
        .found(format!(
            "{} times as far after the pulse for J ×2",
            taut::number::significant(one(From::Table1, Change::PulleyInertia, double).coasting, 3)
        ))
        .remark(format!(
            "J and M ×2: {} times (Table 1).",
            taut::number::significant(one(From::Table1, Change::AllInertia, double).coasting, 3)
        )),
    ]
}

fn matching(f: &Findings) -> Vec<Claim> {
    let m = &f.matched;
    vec![
        Claim::new(
            "linear-misses-10-V",
            Statement,
            "section 3, figures 14–15",
            "\"if parameters were found to have a good match at 5 V, they will not work as well when the \
             input is 10 V\"",
        )
        .decide(
            "miss at 10 V of a linear response that is scaled to Table 4 at 5 \
                 V",
            m.scaled_to_5.abs(),
            "1",
            Rule::AtLeast(NOT_APPRECIABLE),
        )
        .found(format!("{} off at 10 V", percent(m.scaled_to_5)))
        .remark(format!(
            "The final positions of a linear set stand as {} to 1, those of Table 4 as {} to 1: a \
                 linear set that meets Table 4 at 5 V is {} off at 10 V.",
            taut::number::significant(m.ratio.0, 4),
            taut::number::significant(m.ratio.1, 4),
            percent(m.scaled_to_5)
        )),
        Claim::new(
            "table2-fits-5-V",
            Statement,
            "section 3, Table 2, figures 14–15",
            "\"a set of parameters that fit the 5 V input well\"",
        )
        .decide(
            "distance of Table 2 from Table 4 at 5 V over that at 10 V, final \
                 position",
            m.final_position[0].abs() / m.final_position[1].abs(),
            "",
            Rule::AtMost(1.0),
        )
        .found(format!("{} off Table 4 at 5 V, {} at 10 V", percent(m.final_position[0]), percent(m.final_position[1])))
        .remark(format!(
            "Table 4, which the paper says matches both voltages, stands in for the measured curves. \
                 Table 2 is {} from it at 5 V and {} at 10 V; in speed at 0.24 s {} and {}.",
            percent(m.final_position[0]),
            percent(m.final_position[1]),
            percent(m.speed[0]),
            percent(m.speed[1])
        )),
        Claim::new(
            "table4-fits-both",
            Statement,
            "section 4, figures 20–21",
            "\"both the 5 V and the 10 V input experimental data can be matched well\"",
        )
        .found("no measured data")
        .remark(format!(
            "The measured curves are not available as data. Table 4 ends at {} and {}.",
            mm(f.runs.table4[0].final_position()),
            mm(f.runs.table4[1].final_position())
        )),
    ]
}

fn friction_models(f: &Findings) -> Vec<Claim> {
    let i = &f.identifiability;
    let creep = f.table3.runs.iter().map(|r| r.creep.abs()).fold(0.0, f64::max);
    let turns = f.table3.runs.iter().map(|r| r.turns).max().unwrap_or(0);
    vec![
        Claim::new(
            "viscous-at-rest",
            Statement,
            "section 4",
            "\"around zero velocity the friction force/torque is practically zero. However, this is not the \
             case for the real system\"",
        )
        .further(
            "motion of r φ₁ in 1 s under 98 % of the voltage that Table 4 holds at \
                 rest",
            i.below_breakaway,
            "m",
            Rule::AtMost(0.0),
        )
        .found(format!("Table 4 holds {} at rest; no measured data", si(i.breakaway.0, "V", 3)))
        .remark(format!(
            "The real system cannot be checked. In the linear model any voltage moves the axis. With \
                 Table 4 the drive pulley starts at {}, and the axis keeps moving from {} on.",
            si(i.breakaway.0, "V", 3),
            si(i.breakaway.1, "V", 4)
        )),
        Claim::new(
            "stribeck-minor",
            Statement,
            "section 4, eq. (14), figure 16",
            "\"The Stribeck effect captures however only a minor effect of the friction behaviour\"",
        )
        .found("no values, no measured data")
        .remark("The paper gives no F_s and no F_τ, and the measured curves are not available as data."),
        Claim::new(
            "table3-holds",
            Statement,
            "section 4, Table 3",
            "the function is to \"prevent a change in direction of motion\" near zero speed",
        )
        .decide(
            "most changes of the motor's direction after 0.35 s, when the exact solution is at rest, \
                 over all formulas, steps and voltages",
            turns as f64,
            "",
            Rule::AtMost(0.0),
        )
        .decide("largest creep between 0.5 s and 1 s over the same", creep, "m", Rule::AtMost(i.count))
        .found(format!("creeps by up to {}, turns back {turns} times", um(creep, 3)))
        .remark(format!(
            "Cancelled torque keeps a speed instead of ending it. The limit is one encoder count, {}; \
                 the exact solution moves by {} after the stop.",
            um(i.count, 3),
            if f.table3.exact_creep == 0.0 { "not one bit".to_string() } else { um(f.table3.exact_creep, 3) }
        )),
    ]
}
