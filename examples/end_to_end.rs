//! From logs of a closed loop to tuned gains and planned moves, on machines whose numbers are hidden, beside the same
//! work on the true numbers.
//!
//! `cargo xtask end-to-end [--machines N] [--seed S] [--effort E] [CASE]` prints a table. Each machine is the case with
//! cart mass, friction and winding resistance off by a factor from a half to two. The loop of the case follows its
//! moves on that machine; the controller's samples (encoder counts, command, noisy current) are fitted by the case as
//! it is. The controller is tuned and the moves are planned once on the fitted case and once on the true one, and both
//! run on the machine.

// Each of them is used in part.
#[allow(dead_code)]
#[path = "../tests/common"]
mod common {
    pub mod drawn;
    pub mod logged;
}

use common::drawn::off_by_two;
use common::logged::of_loop;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use taut::case::{Case, Files, Move, Nuisances, Plan, Scope, Tuning};
use taut::chance::normal;
use taut::control::{MoveRun, Setup, closed_loop};
use taut::error::{Error, Result};
use taut::fit::fit;
use taut::machine::Machine;
use taut::planning::plan;
use taut::reach::quickest::Wanted;
use taut::signal::profile::Profile;
use taut::solve::Flow;
use taut::tune::tune;

/// The numbers that are hidden, and fitted.
const HIDDEN: [&str; 4] = ["cart.mass", "cart.friction.viscous", "cart.friction.coulomb", "motor.resistance"];

/// Standard deviation of the logged current, A.
const NOISE: f64 = 0.02;

/// Cart error beyond that with the true numbers, as a share of it, up to which a machine counts as done.
const WITHIN: f64 = 0.1;

fn main() -> std::process::ExitCode {
    let mut args = std::env::args().skip(1);
    let (mut machines, mut seed, mut effort) = (20, 1, 1.0);
    let mut path = PathBuf::from("stages/sollmann-jouaneh/controllers/pid-elastic.toml");
    while let Some(arg) = args.next() {
        let mut number = || args.next().and_then(|text| text.parse::<f64>().ok());
        let read = match &arg[..] {
            "--machines" => number().map(|value| machines = value as u64),
            "--seed" => number().map(|value| seed = value as u64),
            "--effort" => number().map(|value| effort = value),
            _ => {
                path = PathBuf::from(&arg);
                continue;
            }
        };
        if read.is_none() {
            eprintln!("{arg} needs a number");
            return 2.into();
        }
    }
    println!(
        "| machine | cart error, µm | with the true numbers | ratio | arrival, ms | with the true numbers | ratio |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut within = 0;
    for number in seed..seed + machines {
        match machine(&path, number, effort) {
            Ok(row) => {
                within += u64::from(row.error[0] <= (1.0 + WITHIN) * row.error[1]);
                println!("{}", row.text(number));
            }
            Err(error) => println!("| {number} | {} | | | | | |", error.what),
        }
    }
    println!(
        "\n{within} of {machines} machines within {:.0} % of the cart error with the true numbers",
        100.0 * WITHIN
    );
    u8::from(within < machines).into()
}

/// Results with the fitted and the true numbers.
struct Row {
    /// Largest cart error of the moves of the case, m.
    error: [f64; 2],
    /// Time until the cart stays in its window in the first move as planned, s; none: it does not.
    arrival: [Option<f64>; 2],
}

impl Row {
    fn text(&self, number: u64) -> String {
        let [fitted, known] = self.error;
        let mut text = format!("| {number} | {:.2} | {:.2} | {:.3} |", 1e6 * fitted, 1e6 * known, fitted / known);
        let arrival = |value: Option<f64>| value.map_or("–".into(), |value| format!("{:.1}", 1e3 * value));
        let _ = write!(text, " {} | {} |", arrival(self.arrival[0]), arrival(self.arrival[1]));
        let ratio = self.arrival[0].zip(self.arrival[1]).map_or("–".into(), |(a, b)| format!("{:.3}", a / b));
        text + &format!(" {ratio} |")
    }
}

/// One hidden machine, from its logs to its moves.
fn machine(path: &Path, number: u64, effort: f64) -> Result<Row> {
    let base = Case::read(path)?;
    let mut random = Pcg64::seed_from_u64(number);
    let changes = off_by_two(&base, &HIDDEN, &mut random);
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    let truth = Case::read_with(path, &changes)?;
    let fitted = fitted(&base, &truth.machine, path, &mut random)?;
    // With the uncertainty of what was fitted, and of all else, as there.
    let known = Case::from_text_for(path, &fitted.text, &changes, Files::Nothing)?;
    let [fitted, known] = [worked(&fitted, &truth.machine, effort)?, worked(&known, &truth.machine, effort)?];
    Ok(Row { error: [fitted.0, known.0], arrival: [fitted.1, known.1] })
}

/// The case with the numbers that its own loop's logs on the machine give.
fn fitted(base: &Case, machine: &Machine, path: &Path, random: &mut Pcg64) -> Result<Case> {
    let logs = base.moves.iter().map(|motion| of_loop(base, motion, machine, || NOISE * normal(random)));
    let case = Case { experiments: logs.collect::<Result<_>>()?, ..base.clone() };
    let free = HIDDEN.map(String::from).to_vec();
    let nuisance = Nuisances { delay: Scope::Shared, ..Nuisances::default() };
    let found = fit(&case, &Plan { free, nuisance, ..Plan::default() }, None, &mut |_| Flow::Continue)?;
    for warning in found.warnings() {
        eprintln!("{warning:?}");
    }
    Case::from_text_for(path, &found.case_text(base, path)?, &[], Files::Nothing)
}

/// Tunes the controller of a case and plans its moves; both run on the machine. Returns the largest cart error along
/// the moves of the case, m, and the time at which the first one arrives as planned, s.
fn worked(case: &Case, machine: &Machine, effort: f64) -> Result<(f64, Option<f64>)> {
    let read = |text: String| Case::from_text_for(Path::new("case.toml"), &text, &[], Files::Nothing);
    let name = Path::new("case.toml");
    let tuning = Tuning { effort, ..case.tune.clone().unwrap_or_default() };
    let tuned = tune(case, &tuning, &|| false)?;
    let case = read(tuned.case_text(case, name)?)?;
    let mut error = 0_f64;
    for motion in &case.moves {
        error = error.max(ran(&case, motion, machine)?.figures.cart().error.peak.value.abs());
    }
    let wanted = Wanted { speed: None, acceleration: None, jerk: None, reserve: 0.1 };
    let plans = plan(&case, &[0], &wanted, &|| false)?;
    let planned = read(plans.case_text(&case, name)?)?;
    let motion = &planned.moves[0];
    let settling = ran(&planned, motion, machine)?.figures.settling;
    Ok((error, settling.map(|settling| Profile::last_rest(&motion.profiles) + settling)))
}

/// A move of a case on the machine, which its controller takes for that of the case.
fn ran(case: &Case, motion: &Move, machine: &Machine) -> Result<MoveRun> {
    let design = case.controller.as_ref().ok_or_else(|| Error::new("the case has no controller"))?;
    let known = Setup::new(machine, design, &motion.profiles, motion.until);
    closed_loop(&Setup { model: &case.machine, window: motion.window, ..known })
}
