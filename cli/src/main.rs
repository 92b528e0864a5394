//! The program `taut`.

mod paper;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments.iter().position(|a| a == "--out").and_then(|i| arguments.get(i + 1)).map(PathBuf::from);
    let json = arguments.iter().any(|a| a == "--json");
    if arguments.first().map(String::as_str) != Some("paper") {
        eprintln!("usage: taut paper [--out DIR] [--json]");
        return ExitCode::from(2);
    }
    match paper::run(out.as_deref(), json, &mut std::io::stdout()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
