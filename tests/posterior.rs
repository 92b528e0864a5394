//! Draws from the posterior of machines whose truth is known.

use crate::common::chance;
use crate::common::logged;
use chance::Chance;
use logged::logged;
use taut::case::{Case, Plan, Prior, TEMPLATE};
use taut::fit::Effort;
use taut::fit::least_squares::Residuals;
use taut::fit::{Fit, Posterior, Problem, fit, machines, posterior};
use taut::solve::{Flow, Solver, simulate};

const COULOMB: &str = "cart.friction.coulomb";
const VISCOUS: &str = "cart.friction.viscous";

/// Standard deviation of the drive angle in the logs, rad.
const NOISE: f64 = 0.01;

/// The first pulse of the template in a few rows, with the log of a machine that has this friction.
fn with_log(viscous: f64, coulomb: f64, seed: u64) -> Case {
    let rows = ["experiment.0.every=10ms", "experiment.0.until=0.5s"];
    let mut case = Case::from_text_with("axis.toml", TEMPLATE, &rows).unwrap();
    case.experiments.truncate(1);
    let changes = [format!("{VISCOUS}={viscous}"), format!("{COULOMB}={coulomb}")];
    let changes: Vec<&str> = rows.into_iter().chain(changes.iter().map(String::as_str)).collect();
    let truth = Case::from_text_with("axis.toml", TEMPLATE, &changes).unwrap();
    let run = simulate(&truth.machine, &truth.experiments[0], Solver::Exact).unwrap().trajectory;
    let mut chance = Chance::new(seed);
    let values = run.get("drive_angle").unwrap().iter().map(|v| v + NOISE * chance.normal()).collect();
    case.experiments[0].log = Some(logged(&case.experiments[0].name, &run, values));
    case
}

fn plan(free: &[&str]) -> Plan {
    Plan { free: free.iter().map(|key| key.to_string()).collect(), ..Plan::default() }
}

fn drawn(case: &Case, plan: &Plan, draws: usize) -> (Fit, Posterior) {
    let found = fit(case, plan, None, &mut |_| Flow::Continue).unwrap();
    let effort = Effort { draws, tune: 200, ..Effort::default() };
    let drawn = posterior(case, plan, &found, effort, &|_| true).unwrap();
    (found, drawn)
}

/// Least and greatest of the 95 % of a density that is known at points.
fn quantiles(points: &[f64], density: &[f64]) -> [f64; 2] {
    let all: f64 = density.iter().sum();
    [0.025, 0.975].map(|share| {
        let mut sum = 0.0;
        let place = density.iter().position(|d| {
            sum += d;
            sum >= share * all
        });
        points[place.unwrap()]
    })
}

/// Coulomb friction that may be zero: the fit's interval is cut off at zero and as wide as if it were not, the
/// posterior is what quadrature makes of the same likelihood.
#[test]
fn friction_near_zero_has_the_posterior_of_quadrature() {
    let case = with_log(19.0, 0.0, 5);
    let plan = plan(&[COULOMB]);
    let (found, drawn) = drawn(&case, &plan, 3000);
    assert_eq!(drawn.doubts(), Vec::<String>::new());

    let mut problem = Problem::new(&case, &plan).unwrap();
    for &(quantity, deviation) in &found.noise {
        problem.weigh(quantity, deviation, true);
    }
    let mut residuals = vec![0.0; problem.rows()];
    let rows = problem.independent();
    assert_eq!(problem.variables(), 2);
    let mut cost = |x: &[f64]| {
        assert!(problem.evaluate(x, &mut residuals));
        0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
    };
    // The variance of the residuals is taken from the fit; what else is fitted, the start, by quadrature too.
    let variance = 2.0 * cost(&found.point) / (rows - found.point.len() as f64).max(1.0) * drawn.inflation;
    let unit = found.estimates[0].start;
    let most = 6.0 * drawn.variables[0].interval[1] / unit;
    let points: Vec<f64> = (0..400).map(|k| most / 3.0 * (f64::from(k) + 0.5) / 400.0).collect();
    let density: Vec<f64> = points
        .iter()
        .map(|&x| {
            let mut at = |start: f64| (-(cost(&[x, start]) - found.cost) / variance).exp();
            (-12..=12).map(|k| at(found.point[1] + 0.1 * f64::from(k))).sum()
        })
        .collect();
    let want = quantiles(&points, &density).map(|x| unit * x);
    let got = drawn.variables[0].interval;
    let wide = want[1] - want[0];
    println!("quadrature {want:?}, draws {got:?}, fit {:?}", found.estimates[0].interval);
    for (want, got) in want.into_iter().zip(got) {
        assert!((want - got).abs() < 0.06 * wide, "{want} {got}");
    }
    // The fit's own is off by more than ten times that can be.
    let linear = found.estimates[0].interval.unwrap();
    assert!((linear[1] - want[1]).abs() > 0.1 * wide, "{linear:?} {want:?}");
}

/// Truths drawn from the prior lie in 95 % of the intervals; the fit, which does not know what the prior does, has no
/// such rule.
#[test]
fn intervals_hold_truths_that_are_drawn_from_the_prior() {
    let machines = std::env::var("TAUT_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(12u64);
    let (mut held, mut linear) = (0, 0);
    for seed in 1..=machines {
        let mut chance = Chance::new(70_000 + seed);
        let truth = 0.02 * chance.uniform();
        let case = with_log(19.0, truth, seed);
        let mut plan = plan(&[COULOMB]);
        plan.priors = vec![(COULOMB.to_string(), Prior::Uniform { low: 0.0, high: 0.02 })];
        let (found, drawn) = drawn(&case, &plan, 400);
        let [low, high] = drawn.variables[0].interval;
        held += u64::from(low <= truth && truth <= high);
        linear += u64::from(found.estimates[0].interval.is_some_and(|[low, high]| low <= truth && truth <= high));
    }
    println!("{held} of {machines} posterior intervals hold the truth, {linear} of the fit's");
    // Three standard deviations of the count.
    let far = 3.0 * (machines as f64 * 0.95 * 0.05).sqrt();
    assert!(held as f64 >= 0.95 * machines as f64 - far, "{held} of {machines}");
}

/// A prior that knows better than the log decides; one that knows nothing does not.
#[test]
fn priors_count() {
    let case = with_log(19.0, 0.2, 2);
    let mut plan = plan(&[VISCOUS]);
    let (_, flat) = drawn(&case, &plan, 300);
    let narrow = flat.variables[0].deviation / 10.0;
    plan.priors = vec![(VISCOUS.to_string(), Prior::Normal { mean: 19.2, deviation: narrow })];
    let (_, strong) = drawn(&case, &plan, 300);
    assert!((strong.variables[0].mean - 19.2).abs() < narrow, "{:?}", strong.variables[0]);
    assert!((strong.variables[0].deviation / narrow - 1.0).abs() < 0.15, "{:?}", strong.variables[0]);
    plan.priors = vec![(VISCOUS.to_string(), Prior::LogNormal { median: 19.0, deviation: 3.0 })];
    let (_, weak) = drawn(&case, &plan, 300);
    let off = (weak.variables[0].mean - flat.variables[0].mean).abs();
    assert!(off < 0.3 * flat.variables[0].deviation, "{:?} {:?}", weak.variables[0], flat.variables[0]);
}

/// The machines of the draws have the friction of the draws, and what the truth does lies between them.
#[test]
fn a_band_of_drawn_machines_contains_the_truth() {
    let case = with_log(22.0, 0.3, 4);
    let plan = plan(&[VISCOUS, COULOMB]);
    let (_, drawn) = drawn(&case, &plan, 150);
    let folder = std::env::temp_dir().join(format!("taut-posterior-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("posterior.csv");
    let mut writer = taut::trajectory::CsvWriter::create(&file).unwrap();
    writer.write(&drawn.table()).unwrap();
    writer.finish().unwrap();
    let stages = machines(&case, &plan, &file).unwrap();
    assert_eq!(stages.len(), drawn.count());
    assert_eq!(stages[0].cart.friction.forward.viscous, drawn.draws.chains[0][0][0]);
    assert_eq!(stages[0].cart.friction.backward.coulomb, drawn.draws.chains[0][0][1]);
    let wrong = machines(&case, &Plan { free: vec!["cart.mass".into()], ..plan.clone() }, &file);
    let told = wrong.unwrap_err().to_string();
    assert!(told.contains("cart.mass_kg"), "{told}");
    std::fs::remove_dir_all(&folder).unwrap();

    // At the end of the pulse and at rest.
    let position = |machine: &taut::machine::Machine| {
        let run = simulate(machine, &case.experiments[0], Solver::Exact).unwrap().trajectory;
        let column = run.get("cart_position").unwrap();
        [column[column.len() / 2], *column.last().unwrap()]
    };
    let mut truth = case.machine.clone();
    for side in [&mut truth.cart.friction.forward, &mut truth.cart.friction.backward] {
        (side.viscous, side.coulomb, side.breakaway) = (22.0, 0.3, 0.3);
    }
    let truth = position(&truth);
    let all: Vec<[f64; 2]> = stages.iter().step_by(3).map(position).collect();
    for (k, truth) in truth.into_iter().enumerate() {
        let below = all.iter().filter(|ends| ends[k] < truth).count() as f64 / all.len() as f64;
        assert!((0.005..0.995).contains(&below), "{below} of the machines are below the truth");
    }
}

#[test]
fn draws_repeat_and_end_early() {
    let case = with_log(19.0, 0.2, 3);
    let plan = plan(&[VISCOUS]);
    let found = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    let effort = Effort { chains: 2, draws: 50, tune: 50, seed: 9 };
    let once = posterior(&case, &plan, &found, effort, &|_| true).unwrap();
    let again = posterior(&case, &plan, &found, effort, &|_| true).unwrap();
    assert_eq!(once.draws.chains, again.draws.chains);
    let doubts = once.doubts();
    assert!(doubts.iter().any(|doubt| doubt.contains("fewer than 400")), "{doubts:?}");
    let cut = posterior(&case, &plan, &found, effort, &|made| made < 140).unwrap();
    assert!(cut.draws.interrupted && cut.count() < 100, "{}", cut.count());
    assert!(cut.doubts()[0].contains("interrupted"));
    let never = posterior(&case, &plan, &found, effort, &|_| false).unwrap();
    assert!(never.count() == 0 && never.doubts().len() >= 2, "{:?}", never.doubts());
}

/// A parameter that the logs do not determine made the sampler wander between its bounds until somebody ended it.
#[test]
fn what_is_not_determined_is_refused_at_once() {
    let case = with_log(19.0, 0.2, 3);
    let plan = plan(&[VISCOUS, COULOMB]);
    let mut found = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    found.estimates[1].error = Some(f64::INFINITY);
    let told = posterior(&case, &plan, &found, Effort::default(), &|_| panic!("it began")).unwrap_err().to_string();
    assert_eq!(
        told,
        "no posterior: cart.friction.coulomb is not determined by these logs\n  next: take it out of fit.free, or add a log that \
         determines it; `taut check` proposes some"
    );
}
