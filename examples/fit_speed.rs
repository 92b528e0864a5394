//! How long a fit takes: `cargo run --release --package taut --example fit_speed -- CASE [RUNS]`.
//!
//! Prints the median of the runs and the quickest, in seconds, the number of simulated logs, how it ended, and each
//! estimate.

use std::time::Instant;
use taut::case::Case;
use taut::fit::fit;
use taut::solve::Flow;

fn main() -> taut::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "stages/sollmann-jouaneh/identification/nonlinear.toml".into());
    let runs = arguments.next().and_then(|runs| runs.parse().ok()).unwrap_or(11).max(1);
    let case = Case::read(&path)?;
    let plan = case.fit.clone().unwrap_or_default();
    let mut seconds = Vec::new();
    let mut found = None;
    for _ in 0..runs {
        let begin = Instant::now();
        found = Some(fit(&case, &plan, None, &mut |_| Flow::Continue)?);
        seconds.push(begin.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    if let Some(found) = found {
        println!("{} {} {} {}", seconds[runs / 2], seconds[0], found.work.simulations, found.ending.word());
        for estimate in &found.estimates {
            println!("{} {} {}", estimate.name, estimate.value, estimate.error.unwrap_or(f64::NAN));
        }
    }
    Ok(())
}
