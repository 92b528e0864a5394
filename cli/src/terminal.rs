//! Output on the terminal: errors in one form, colour only where it is seen, and no complaint about a closed pipe.

use crate::failure::Failure;
use clap::error::ErrorKind;
use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use taut::Error;

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

/// Writes `text` to standard output. Whoever closed the pipe has read enough: that is no error. Anything else, a full
/// disk say, ends the program with status 1.
pub fn show(text: &str) {
    SHOWN.store(true, Ordering::SeqCst);
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            show_error(&format!("the results cannot be written to standard output: {e}"));
            taut::files::abandon();
            std::process::exit(1);
        }
        _ => {}
    }
}

/// True once anything was written to standard output.
static SHOWN: AtomicBool = AtomicBool::new(false);

/// True if anything was written to standard output.
pub fn has_shown() -> bool {
    SHOWN.load(Ordering::SeqCst)
}

/// Clears the line of a progress that is on the terminal.
pub fn clear_line() {
    if io::stderr().is_terminal() {
        let _ = write!(io::stderr(), "\r\u{1b}[K");
    }
}

/// Columns of the terminal; else those that the environment names; else 100.
pub fn columns() -> usize {
    let seen = terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    let named = || std::env::var("COLUMNS").ok()?.trim().parse().ok();
    seen.or_else(named).unwrap_or(100).max(LEAST_COLUMNS)
}

/// Fewer columns than these are not kept to.
const LEAST_COLUMNS: usize = 40;

/// `text` with the lines that are too long for the terminal broken between words: behind a name, the rest stands under
/// what the line says of it.
pub fn wrapped(text: &str) -> String {
    let columns = columns();
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        match visible(line.trim_end_matches('\n')) > columns {
            true => wrap(line, columns, &mut out),
            false => out.push_str(line),
        }
    }
    out
}

fn wrap(line: &str, columns: usize, out: &mut String) {
    let indent = indent(line, columns);
    let mut used = 0;
    // Spaces belong to the word behind them, so that columns stay where they are.
    for word in words(line.trim_end_matches('\n')) {
        let wide = visible(word);
        if used > indent && used + wide > columns {
            out.push('\n');
            out.push_str(&" ".repeat(indent));
            let bare = word.trim_start();
            out.push_str(bare);
            used = indent + visible(bare);
        } else {
            out.push_str(word);
            used += wide;
        }
    }
    out.push('\n');
}

/// Where the rest of a line that is broken begins.
fn indent(line: &str, columns: usize) -> usize {
    let leading = line.len() - line.trim_start().len();
    let told = line[leading..].find("  ").map(|gap| {
        let behind = &line[leading + gap..];
        visible(&line[..leading + gap]) + behind.len() - behind.trim_start().len()
    });
    match told {
        Some(column) if column <= columns / 2 => column,
        _ => (leading + 4).min(columns / 2),
    }
}

/// The words of a line, each with the spaces before it; a number keeps the unit behind it.
fn words(line: &str) -> impl Iterator<Item = &str> {
    let mut rest = line;
    std::iter::from_fn(move || {
        let mut end = word(rest);
        while rest[..end].ends_with(|c: char| c.is_ascii_digit()) && is_unit(&rest[end..]) {
            end += word(&rest[end..]);
        }
        let (word, behind) = rest.split_at(end);
        rest = behind;
        (!word.is_empty()).then_some(word)
    })
}

/// Where the first word ends, spaces before it included.
fn word(text: &str) -> usize {
    let spaces = text.len() - text.trim_start_matches(' ').len();
    text[spaces..].find(' ').map_or(text.len(), |end| spaces + end)
}

/// True if a text goes on with one space and what may be a unit.
fn is_unit(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next() == Some(' ') && letters.next().is_some_and(|c| c.is_alphabetic() || "%°".contains(c))
}

/// Columns that a text takes: colours take none.
fn visible(text: &str) -> usize {
    let (mut count, mut colour) = (0, false);
    for c in text.chars() {
        match (colour, c) {
            (false, '\u{1b}') => colour = true,
            (true, 'm') => colour = false,
            (true, _) => {}
            // What goes above the letter before it, as in R̂, takes none.
            (false, '\u{300}'..='\u{36f}') => {}
            (false, _) => count += 1,
        }
    }
    count
}

/// `text` in bold, if standard output is a terminal.
pub fn bold(text: &str) -> String {
    paint(io::stdout().is_terminal(), "\u{1b}[1m", text)
}

/// Messages of clap: help and version are answers, all else is a mistake in the input, as JSON too if `json` says so.
pub fn show_help_or_mistake(told: &clap::Error, json: bool) -> ExitCode {
    match told.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let text = told.render();
            let coloured = io::stdout().is_terminal() && colour_wanted();
            show(&if coloured { text.ansi().to_string() } else { text.to_string() });
            ExitCode::SUCCESS
        }
        _ => {
            if json {
                show(&Failure::from(mistake(told)).json());
            }
            let _ = told.print();
            ExitCode::from(2)
        }
    }
}

/// A mistake on the command line as an error of ours: the first sentence is what is wrong, the rest what to do.
fn mistake(told: &clap::Error) -> Error {
    let text = told.render().to_string();
    let text = text.trim().strip_prefix("error: ").unwrap_or(text.trim());
    let (what, rest) = text.split_once("\n\n").unwrap_or((text, ""));
    let lines = |text: &str| text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
    let error = Error::new(lines(what)).in_file("command line");
    if rest.is_empty() { error } else { error.next(lines(rest)) }
}

fn paint(terminal: bool, colour: &str, text: &str) -> String {
    if terminal && colour_wanted() { format!("{colour}{text}\u{1b}[0m") } else { text.to_string() }
}

fn colour_wanted() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(columns: usize, line: &str) -> String {
        let mut out = String::new();
        wrap(line, columns, &mut out);
        out
    }

    #[test]
    fn long_lines_break_between_words_under_what_they_say() {
        assert_eq!(at(24, "  name    one two three four\n"), "  name    one two three\n          four\n");
        assert_eq!(at(20, "a sentence without any gap\n"), "a sentence without\n    any gap\n");
        assert_eq!(at(12, "averyveryverylongword and more\n"), "averyveryverylongword\n    and more\n");
        assert_eq!(at(16, "  name  1.5 m, 2.25 mm\n"), "  name  1.5 m,\n        2.25 mm\n");
        assert_eq!(visible("\u{1b}[1mbold\u{1b}[0m R\u{302}"), 6);
    }
}
