//! `taut tune` on each of these cases, as a table: before and after at worst over the family, verdict, the active limit
//! where it is worse, processor time.
//!
//! cargo run --release --package taut --example tuning -- [--effort E] [--evolution T] [--drawn N] [--from SEED]
//! [--only-drawn] stages/sollmann-jouaneh/controllers/*.toml
//!
//! `--effort E` also tunes with E times the budget, and `--evolution T` compares with a differential evolution of T
//! times the budget: J, by how much the tuning is worse (better, below zero), and processor time. `--drawn N` also
//! tunes N machines that are drawn about the first case named, from this seed on: mass, friction, pulleys' inertia and
//! motor off by up to a factor of two. `--only-drawn` leaves out the cases themselves.

#[path = "../tests/common/drawn.rs"]
mod drawn;

use drawn::off_by_two;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use taut::case::{Case, Tuning};
use taut::tune::{Judgement, Tuned, Verdict, evolved, tune};

/// The quantities that are drawn, as factors of the case's own.
const DRAWN: [&str; 7] = [
    "cart.mass",
    "cart.friction.viscous",
    "cart.friction.coulomb",
    "motor.resistance",
    "drive_pulley.inertia",
    "idler_pulley.inertia",
    "motor.torque_constant",
];

/// First seed of the machines that are drawn.
const SEED: u64 = 400;

/// Comparisons that are asked for.
#[derive(Clone, Copy, Default)]
struct Beside {
    effort: Option<f64>,
    evolution: Option<f64>,
}

fn main() {
    let mut args = std::env::args().skip(1);
    let (mut drawn, mut seed, mut only, mut paths) = (0, SEED, false, Vec::new());
    let mut beside = Beside::default();
    while let Some(arg) = args.next() {
        let mut text = || args.next().unwrap_or_default();
        match &arg[..] {
            "--effort" => beside.effort = text().parse().ok(),
            "--evolution" => beside.evolution = text().parse().ok(),
            "--drawn" => drawn = text().parse().unwrap_or(0),
            "--from" => seed = text().parse().unwrap_or(SEED),
            "--only-drawn" => only = true,
            _ => paths.push(arg),
        }
    }
    let mut more = String::new();
    more.extend(beside.effort.map(|effort| format!(" J with effort {effort} |")));
    more.extend(beside.evolution.map(|times| format!(" J by evolution, {times} budgets |")));
    println!(
        "| case | verdict | J | cart error at worst, mm | axes that settle | current at worst, A | active limit | processor, s |{more}"
    );
    println!("|---|---|---|---|---|---|---|---|{}", "---|".repeat(more.matches('|').count()));
    for path in paths.iter().filter(|_| !only) {
        let name = path.rsplit('/').next().unwrap_or(path).trim_end_matches(".toml").to_string();
        one(&name, Case::read(path), beside);
    }
    for seed in seed..seed + drawn {
        one(&format!("drawn {seed}"), machine(&paths[0], seed), beside);
    }
}

/// A machine that is drawn: what the first case has, each number times a factor from a half to two.
fn machine(path: &str, seed: u64) -> taut::Result<Case> {
    let base = Case::read(path)?;
    let changes = off_by_two(&base, &DRAWN, &mut Pcg64::seed_from_u64(seed));
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    Case::read_with(path, &changes)
}

/// Processor time of this thread, s; 0 where the system does not tell.
fn processor() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    told.split(' ').next().and_then(|text| text.parse::<f64>().ok()).map_or(0.0, |nanoseconds| 1e-9 * nanoseconds)
}

/// A result with its processor time, s.
fn timed<T>(work: impl FnOnce() -> taut::Result<T>) -> taut::Result<(T, f64)> {
    let begin = processor();
    let found = work()?;
    Ok((found, processor() - begin))
}

/// Tunes a case and prints its row.
fn one(name: &str, case: taut::Result<Case>, beside: Beside) {
    let told = case.and_then(|case| {
        let tuning = case.tune.clone().unwrap_or_default();
        let (tuned, took) = timed(|| tune(&case, &tuning, &|| false))?;
        eprintln!("{name}: {took:.1} s, {:.1} million samples", 1e-6 * tuned.samples as f64);
        let mut row = format!("{} {took:.1} |", row(name, &tuned));
        if let Some(effort) = beside.effort {
            let (longer, took) = timed(|| tune(&case, &Tuning { effort, ..tuning.clone() }, &|| false))?;
            row += &compared(&tuned, Some((&longer.after, longer.judgement)), took);
        }
        if let Some(times) = beside.evolution {
            let (other, took) = timed(|| evolved(&case, &tuning, &tuned, times, &|| false))?;
            row += &compared(&tuned, other.as_ref().map(|(verdict, judgement)| (verdict, *judgement)), took);
        }
        Ok(row)
    });
    println!("{}", told.unwrap_or_else(|error| format!("| {name} | – | | | | | {} | |", error.what)));
}

/// Cost that another search found, by how much the tuning is worse (better, below zero), and its processor time;
/// whether a figure of what it found is worse than before, where one of the tuning's is.
fn compared(tuned: &Tuned, other: Option<(&Verdict, Judgement)>, took: f64) -> String {
    let Some((verdict, judgement)) = other else { return format!(" none ({took:.1} s) |") };
    let worse = 100.0 * ((tuned.after.objective - verdict.objective).exp() - 1.0);
    let figures = match (tuned.judgement, judgement) {
        (Judgement::Worse, Judgement::Worse) => ", a figure worse too",
        (Judgement::Worse, _) => ", no figure worse",
        (_, Judgement::Worse) => ", a figure worse",
        _ => "",
    };
    format!(" {:.3} ({worse:+.1} %{figures}; {took:.1} s) |", verdict.objective.exp())
}

/// One row; of several moves the figures stand one after another.
fn row(name: &str, tuned: &Tuned) -> String {
    let each = |verdict: &Verdict, of: &dyn Fn(&taut::tune::MoveVerdict) -> String| -> String {
        verdict.moves.iter().map(of).collect::<Vec<_>>().join(", ")
    };
    let both = |of: &dyn Fn(&taut::tune::MoveVerdict) -> String| {
        format!("{} → {}", each(&tuned.before, of), each(&tuned.after, of))
    };
    let forced = tuned.forced.map_or(String::new(), |forced| {
        format!("{} at {:.1} Hz, cart at {:.0} mm", forced.limit.word(), forced.mode, 1e3 * forced.place)
    });
    format!(
        "| {name} | {} | {:.3} → {:.3} | {} | {} | {} | {forced} |",
        tuned.judgement.word(),
        tuned.before.objective.exp(),
        tuned.after.objective.exp(),
        both(&|one| format!("{:.3}", 1e3 * one.at_worst.error.0)),
        both(&|one| format!("{}/{}", one.settled.0, one.settled.1)),
        both(&|one| format!("{:.2}", one.at_worst.current)),
    )
}
