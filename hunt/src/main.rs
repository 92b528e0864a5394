//! `taut-hunt`: what `cargo xtask hunt` runs.

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use taut_hunt::by::By;
use taut_hunt::compare::compare;
use taut_hunt::draw;
use taut_hunt::replay::{self, Tool};
use taut_hunt::stages::{self, Drawing, Hunt};

/// Hunts for wrong answers of taut.
#[derive(Parser)]
#[command(name = "taut-hunt", version)]
struct Arguments {
    #[command(subcommand)]
    part: Part,
}

#[derive(Subcommand)]
enum Part {
    /// Random stages against an independent solver.
    Stages(Stages),
    /// Cases in which each pair of features occurs, curved ones, gantries, loops and exports among them.
    Pairs(Stages),
    /// The same with a dual belt in place of their machines.
    DualBelts(Stages),
    /// Drawn machines event by event: exported C, Python and MATLAB against the exact solver.
    Replay(Replay),
}

#[derive(clap::Args)]
struct Replay {
    /// How many.
    #[arg(long, default_value_t = 300)]
    machines: usize,
    /// Which ones; the same seed gives the same.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The number of the first one.
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// c, python or octave; all that are there unless said. Several with commas.
    #[arg(long, value_delimiter = ',')]
    tool: Vec<String>,
}

#[derive(clap::Args)]
struct Stages {
    /// How many.
    #[arg(long, default_value_t = 1000)]
    stages: u64,
    /// Which ones; the same seed gives the same.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The number of the first one.
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Threads; as many as processors unless given. They do not change the result.
    #[arg(long)]
    threads: Option<usize>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    /// Print the cases that are ill-conditioned or unknown, too.
    #[arg(long)]
    all: bool,
    /// Print the case of a stage, `--first`, and no more.
    #[arg(long)]
    show: bool,
    /// Of pairs: count how often each occurs, and compare nothing.
    #[arg(long)]
    count: bool,
    /// Compare the first experiment of this case file by these ways, instead of random ones.
    #[arg(long, value_name = "FILE")]
    case: Option<PathBuf>,
    /// With `--case`: exact, general, cs, me, c or sweep; both solvers unless said. Several with commas.
    #[arg(long, value_delimiter = ',')]
    by: Vec<String>,
}

fn main() -> ExitCode {
    match Arguments::parse().part {
        Part::Stages(arguments) => arguments.run(Drawing::Stages),
        Part::Pairs(arguments) => arguments.run(Drawing::Pairs),
        Part::DualBelts(arguments) => arguments.run(Drawing::DualBelts),
        Part::Replay(arguments) => arguments.run(),
    }
}

impl Replay {
    fn run(&self) -> ExitCode {
        let machines = replay::machines(self.seed, self.first, self.machines);
        let mut status = ExitCode::SUCCESS;
        for tool in Tool::ALL {
            let is_asked = self.tool.is_empty() || self.tool.iter().any(|name| name == tool.name());
            let Some(program) = tool.program().filter(|_| is_asked) else { continue };
            match replay::replay(tool, &program, &machines) {
                Ok(result) => {
                    result.different.iter().for_each(|told| println!("# {told}"));
                    println!("{}", result.told(tool));
                    if !result.different.is_empty() {
                        status = ExitCode::FAILURE;
                    }
                }
                Err(error) => {
                    eprintln!("error: {error}");
                    status = ExitCode::from(2);
                }
            }
        }
        status
    }
}

impl Stages {
    fn run(&self, drawing: Drawing) -> ExitCode {
        if let Some(path) = &self.case {
            return one_case(path, &self.by);
        }
        if self.show {
            match drawing {
                Drawing::Stages => print!("{}", draw::stage(self.seed, self.first).text),
                Drawing::Pairs => print!("{}", draw::pair(self.seed, self.first).0.text),
                Drawing::DualBelts => print!("{}", draw::dual_belt(self.seed, self.first).0.text),
            }
            return ExitCode::SUCCESS;
        }
        if self.count {
            let cases: Vec<_> = (0..self.stages).map(|k| draw::recipe(self.seed, self.first + k)).collect();
            told_pairs(cases.iter().map(Vec::as_slice));
            return ExitCode::SUCCESS;
        }
        let stop = Arc::new(AtomicBool::new(false));
        // Ctrl-C and SIGTERM end it; what is done is shown.
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            let _ = signal_hook::flag::register(signal, Arc::clone(&stop));
        }
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.threads.unwrap_or(processors).clamp(1, 256);
        let hunt = Hunt {
            seed: self.seed,
            first: self.first,
            count: self.stages,
            threads,
            progress: true,
            stop: Arc::clone(&stop),
            drawing,
        };
        let begin = Instant::now();
        let outcomes = hunt.run();
        let unexplained = outcomes.iter().flat_map(|o| &o.compared).filter(|c| c.verdict.is_unexplained()).count();
        if self.json {
            println!("{:#}", stages::json(&hunt, &outcomes));
        } else {
            print!("{}", stages::told(self.seed, &outcomes, self.all));
            println!(
                "Seed {}, {} of {} stages from number {}, {:.0} s on {threads} threads: {unexplained} unexplained.\n",
                self.seed,
                outcomes.len(),
                self.stages,
                self.first,
                begin.elapsed().as_secs_f64()
            );
            print!("{}", stages::table(&outcomes));
            if drawing == Drawing::Pairs {
                println!();
                told_pairs(outcomes.iter().map(|outcome| outcome.features.as_slice()));
            }
        }
        match (unexplained, stop.load(Ordering::Relaxed)) {
            (1.., _) => ExitCode::FAILURE,
            (0, true) => ExitCode::from(130),
            (0, false) => ExitCode::SUCCESS,
        }
    }
}

/// How often each pair of features occurs.
fn told_pairs<'a>(cases: impl Iterator<Item = &'a [draw::Feature]> + Clone) {
    print!("{}", stages::pairs_table(cases.clone()));
    let ([a, b], count) = stages::rarest_pair(cases);
    println!("\nRarest pair: {} and {}, {count} times.", a.names()[0], b.names()[0]);
}

/// Compares the case of a file.
fn one_case(path: &std::path::Path, words: &[String]) -> ExitCode {
    let mut ways = Vec::new();
    for word in words {
        let known = [("exact", By::Exact), ("general", By::General), ("cs", By::CoSimulation)];
        let more = [("me", By::ModelExchange), ("c", By::C), ("sweep", By::Sweep)];
        let Some((_, by)) = known.into_iter().chain(more).find(|(name, _)| name == word) else {
            eprintln!("error: --by cannot be {word}; allowed: exact, general, cs, me, c, sweep");
            return ExitCode::from(2);
        };
        ways.push(by);
    }
    if ways.is_empty() {
        ways = vec![By::Exact, By::General];
    }
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) => {
            eprintln!("error: {} cannot be read: {error}", path.display());
            return ExitCode::from(2);
        }
    };
    let mut status = ExitCode::SUCCESS;
    for compared in compare(&path.display().to_string(), &text, &ways, &[3.1]) {
        println!(
            "{:?}: {}, positions within {:.1e} m, {} body events; {}",
            compared.by,
            compared.verdict.word(),
            compared.difference,
            compared.events,
            compared.verdict.told()
        );
        if compared.verdict.is_unexplained() {
            status = ExitCode::FAILURE;
        }
    }
    status
}
