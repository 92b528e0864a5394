//! Fits a case's parameters to its logs: `cargo run --release --package taut --example fit -- CASE`.

use std::time::Instant;
use taut::case::Case;
use taut::fit::fit;
use taut::solve::Flow;

fn main() -> taut::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "stages/emps/emps.toml".into());
    let case = Case::read(&path)?;
    let plan = case.fit.clone().unwrap_or_default();
    let begin = Instant::now();
    let fit = fit(&case, &plan, None, &mut |_| Flow::Continue)?;
    let took = begin.elapsed();
    for estimate in &fit.estimates {
        println!(
            "{:<45} {:>14.6e} ± {:>9.2e} {} (from {:.4e}){}",
            estimate.name,
            estimate.value,
            estimate.error.unwrap_or(f64::NAN),
            estimate.unit,
            estimate.start,
            if estimate.at_bound { " at its bound" } else { "" }
        );
    }
    for finding in &fit.findings {
        println!("{finding}");
    }
    for log in &fit.logs {
        for output in &log.outputs {
            let shown = |score: Option<taut::fit::Score>| {
                score.map_or("-".into(), |s| format!("{:.4e} ({:.2} %, memory {:.3})", s.rmse, s.percent, s.memory))
            };
            println!(
                "{} {:?}: fitted {}, held out {}",
                log.name,
                output.quantity,
                shown(output.fitted),
                shown(output.held_out)
            );
        }
    }
    println!("{:?} {:.1e}, {:?}, starts {:?}, {took:?}", fit.ending, fit.decrement, fit.work, fit.starts);
    Ok(())
}
