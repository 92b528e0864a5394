//! The program `taut`: reads the command line, runs the command and sets the exit status.

mod args;
mod check;
mod command;
mod common;
mod design;
mod export;
mod failure;
mod fit;
mod folder;
mod frf;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[path = "../hypot.rs"]
mod hypot;
mod init;
mod interrupt;
mod learn;
mod listing;
mod manual;
mod modes;
mod motion;
mod paper;
mod plan;
mod progress;
mod shape;
mod show;
mod simulate;
mod studio;
mod sweep;
mod terminal;
mod tune;

use args::{Args, Command};
use failure::Status;
use std::process::ExitCode;

fn main() -> ExitCode {
    interrupt::outlive_file_limits();
    let args = match Args::read() {
        Ok(args) => args,
        Err(told) => return terminal::show_help_or_mistake(&told, is_json_wanted()),
    };
    let json = args.command.json();
    // The studio waits for signals by itself.
    if !matches!(args.command, Command::Studio(_)) {
        interrupt::watch(json);
    }
    let done = match args.command {
        Command::Paper(args) => paper::run(&args),
        Command::Init(args) => init::run(&args),
        Command::Show(args) => show::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Move(args) => motion::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Fit(args) => fit::run(&args),
        Command::Shape(args) => shape::run(&args),
        Command::Tune(args) => tune::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Learn(args) => learn::run(&args),
        Command::Sweep(args) => sweep::run(&args),
        Command::Modes(args) => modes::run(&args),
        Command::Frf(args) => frf::run(&args),
        Command::Design(args) => design::run(&args),
        Command::Studio(args) => studio::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Schema(args) => manual::schema(&args),
        Command::Completions(args) => manual::completions(&args),
        Command::Man(args) => manual::run(&args),
    };
    if !interrupt::finish() {
        // Another thread is ending the program.
        loop {
            std::thread::park();
        }
    }
    match done {
        Ok(Status::Done) => ExitCode::SUCCESS,
        Ok(Status::Incomplete) => ExitCode::from(1),
        Ok(Status::Interrupted(signal)) => ExitCode::from(128 + signal),
        Err(failure) => {
            let failure = interrupt::explained(failure);
            if json {
                terminal::show(&failure.json());
            }
            terminal::show_error(&failure.error);
            ExitCode::from(failure.status)
        }
    }
}

/// True if a command line that cannot be read asks for JSON.
fn is_json_wanted() -> bool {
    std::env::args_os().skip(1).take_while(|word| word != "--").any(|word| word == "--json")
}
