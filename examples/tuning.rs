//! `taut tune` on each of these cases, as a table: before and after at worst over the family, verdict, the active limit
//! where it is worse, processor time; with `--evolution N` the distance of J from the result of a differential
//! evolution of N generations.
//!
//! cargo run --release --package taut --example tuning -- [--evolution N] [--drawn N]
//! stages/sollmann-jouaneh/controllers/*.toml
//!
//! `--drawn N` also tunes N machines that are drawn about the first case named: mass, friction, pulleys' inertia and
//! motor off by up to a factor of two. `--only-drawn` leaves out the cases themselves.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use taut::case::Case;
use taut::chance::uniform;
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

fn main() {
    let mut args = std::env::args().skip(1);
    let (mut generations, mut drawn, mut only, mut paths) = (0, 0, false, Vec::new());
    while let Some(arg) = args.next() {
        let mut number = || args.next().and_then(|text| text.parse().ok()).unwrap_or(0);
        match &arg[..] {
            "--evolution" => generations = number(),
            "--drawn" => drawn = number(),
            "--only-drawn" => only = true,
            _ => paths.push(arg),
        }
    }
    let more = if generations > 0 { " J by evolution |" } else { "" };
    println!(
        "| case | verdict | J | cart error at worst, mm | axes that settle | current at worst, A | active limit | processor, s |{more}"
    );
    println!("|---|---|---|---|---|---|---|---|{}", if generations > 0 { "---|" } else { "" });
    for path in paths.iter().filter(|_| !only) {
        let name = path.rsplit('/').next().unwrap_or(path).trim_end_matches(".toml").to_string();
        one(&name, Case::read(path), generations);
    }
    for k in 0..drawn {
        one(&format!("drawn {}", k + 1), machine(&paths[0], k as u64), generations);
    }
}

/// A machine that is drawn: what the first case has, each number times a factor from a half to two.
fn machine(path: &str, seed: u64) -> taut::Result<Case> {
    let base = Case::read(path)?;
    let mut random = Pcg64::seed_from_u64(400 + seed);
    let mut changes = Vec::new();
    for key in DRAWN {
        let factor = 2f64.powf(2.0 * uniform(&mut random) - 1.0);
        if let Some(value) = taut::parameter::value(&base.machine, key) {
            changes.push(format!("{key}={}", factor * value));
        }
    }
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    Case::read_with(path, &changes)
}

/// Processor time of this thread, s; 0 where the system does not tell.
fn processor() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    told.split(' ').next().and_then(|text| text.parse::<f64>().ok()).map_or(0.0, |nanoseconds| 1e-9 * nanoseconds)
}

/// Tunes a case and prints its row.
fn one(name: &str, case: taut::Result<Case>, generations: usize) {
    let found = case.and_then(|case| {
        let tuning = case.tune.clone().unwrap_or_default();
        let begin = processor();
        let tuned = tune(&case, &tuning, &|| false)?;
        let took = processor() - begin;
        eprintln!("{name}: {took:.1} s, {:.1} million samples", 1e-6 * tuned.samples as f64);
        let other = match generations {
            0 => None,
            _ => Some(evolved(&case, &tuning, &tuned, generations, &|| false)?),
        };
        Ok((tuned, took, other))
    });
    match found {
        Ok((tuned, took, other)) => println!("{} {took:.1} |{}", row(name, &tuned), beside(&tuned, other)),
        Err(error) => println!("| {name} | – | | | | | {} | |", error.what),
    }
}

/// Cost that the evolution found, and by how much the tuning is worse (better, below zero); whether a figure of what it
/// found is worse than before, where one of the tuning's is.
fn beside(tuned: &Tuned, other: Option<Option<(Verdict, Judgement)>>) -> String {
    match other {
        None => String::new(),
        Some(None) => " none |".into(),
        Some(Some((verdict, judgement))) => {
            let worse = 100.0 * ((tuned.after.objective - verdict.objective).exp() - 1.0);
            let figures = match (tuned.judgement, judgement) {
                (Judgement::Worse, Judgement::Worse) => ", a figure worse too",
                (Judgement::Worse, _) => ", no figure worse",
                (_, Judgement::Worse) => ", a figure worse",
                _ => "",
            };
            format!(" {:.3} ({worse:+.1} %{figures}) |", verdict.objective.exp())
        }
    }
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
