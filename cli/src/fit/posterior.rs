//! Draws from the posterior: made with progress, and told on the terminal and in the report.

use crate::args::Fit as Args;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::terminal::bold;
use std::fmt::Write;
use taut::Result;
use taut::case::{Case, Plan};
use taut::fit::Effort;
use taut::fit::{Fit, Posterior, posterior};
use taut_report::fit::posterior::{effort, ending, words};

/// Draws that tune a chain.
const TUNE: usize = 400;

/// Draws; Ctrl-C keeps those there are.
pub fn draw(args: &Args, case: &Case, plan: &Plan, fit: &Fit, interrupt: &Interrupt) -> Result<Posterior> {
    let effort = Effort { chains: args.chains, draws: args.draws, tune: TUNE, seed: plan.seed };
    let all = (effort.chains * (effort.tune + effort.draws)) as u64;
    let progress = Progress::new("draws; Ctrl-C keeps those there are", Some(all), args.common.quiet);
    let watch = |made: usize| {
        progress.set(made as u64);
        interrupt.signal().is_none()
    };
    posterior(case, plan, fit, effort, &watch)
}

/// The lines on the terminal.
pub fn text(drawn: &Posterior, wide: usize) -> String {
    let mut text = format!("\n{}: {}\n", bold("Posterior"), ending(drawn));
    for (j, variable) in drawn.variables.iter().take(drawn.globals).enumerate() {
        let [median, interval, _, r_hat, effective] = words(None, j, variable);
        let _ = writeln!(
            text,
            "  {:<wide$}  {median:>14}   95 %: {interval}; R\u{302} {r_hat}, {effective} effective",
            variable.name
        );
    }
    let _ = writeln!(text, "  {}", effort(drawn));
    text
}
