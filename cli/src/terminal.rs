//! What reaches the terminal: errors in one form, colour only where it is seen, and no complaint about a closed pipe.

use clap::error::ErrorKind;
use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

/// Writes `error: …` to standard error.
pub fn show_error(error: &impl Display) {
    let word = paint(io::stderr().is_terminal(), "\u{1b}[1;31m", "error");
    let _ = writeln!(io::stderr(), "{word}: {error}");
}

/// Writes `warning: …` to standard error: for what makes a result not to be relied on.
pub fn show_warning(told: &impl Display) {
    let word = paint(io::stderr().is_terminal(), "\u{1b}[1;33m", "warning");
    let _ = writeln!(io::stderr(), "{word}: {told}");
}

/// Writes `note: …` to standard error.
pub fn show_note(note: &impl Display) {
    let word = paint(io::stderr().is_terminal(), "\u{1b}[1m", "note");
    let _ = writeln!(io::stderr(), "{word}: {note}");
}

/// Writes `text` to standard output. Whoever closed the pipe has read enough: that is no error. Anything else, a full disk
/// say, ends the program with status 1.
pub fn show(text: &str) {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            show_error(&format!("the results cannot be written to standard output: {e}"));
            std::process::exit(1);
        }
        _ => {}
    }
}

/// `text` in bold, if standard output is a terminal.
pub fn bold(text: &str) -> String {
    paint(io::stdout().is_terminal(), "\u{1b}[1m", text)
}

/// What clap has to say: help and version are answers, all else is a mistake in the input.
pub fn show_help_or_mistake(told: &clap::Error) -> ExitCode {
    match told.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let text = told.render();
            let coloured = io::stdout().is_terminal() && colour_wanted();
            show(&if coloured { text.ansi().to_string() } else { text.to_string() });
            ExitCode::SUCCESS
        }
        _ => {
            let _ = told.print();
            ExitCode::from(2)
        }
    }
}

fn paint(terminal: bool, colour: &str, text: &str) -> String {
    if terminal && colour_wanted() { format!("{colour}{text}\u{1b}[0m") } else { text.to_string() }
}

fn colour_wanted() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
