//! `taut tune` on each of these cases, as a table: before and after at worst over the family, verdict, the limit that
//! forces it, time.
//!
//! cargo run --release --example tuning -- stages/sollmann-jouaneh/controllers/*.toml

use std::time::Instant;
use taut::case::Case;
use taut::tune::{Tuned, Verdict, tune};

fn main() {
    println!("| case | verdict | J | cart error at worst, mm | axes that settle | current at worst, A | forced by |");
    println!("|---|---|---|---|---|---|---|");
    for path in std::env::args().skip(1) {
        let begin = Instant::now();
        let name = path.rsplit('/').next().unwrap_or(&path).trim_end_matches(".toml").to_string();
        let found = Case::read(&path).and_then(|case| tune(&case, &case.tune.clone().unwrap_or_default(), &|| false));
        match &found {
            Ok(tuned) => println!("{}", row(&name, tuned)),
            Err(error) => println!("| {name} | – | | | | | {} |", error.what),
        }
        let samples = found.as_ref().map_or(0, |tuned| tuned.samples);
        eprintln!("{name}: {:.1} s, {:.1} million samples", begin.elapsed().as_secs_f64(), 1e-6 * samples as f64);
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
