//! Messages of the library in Python's terms: arguments in place of options, calls in place of commands.

use taut::quantity::parse;

/// Options whose arguments have other names.
const ARGUMENTS: [(&str, &str); 7] = [
    ("drive", "drives"),
    ("for", "names"),
    ("from", "lowest"),
    ("input", "inputs"),
    ("measure", "measured"),
    ("runs", "n"),
    ("to", "highest"),
];

/// Values of options that are words; other words after an option go on with the sentence.
const WORDS: [&str; 8] = ["both", "controller", "exact", "general", "klipper", "lanes", "plant", "table3"];

/// Commands and the calls that do the same.
const CALLS: [(&str, &str); 9] = [
    ("taut check", "case.check()"),
    ("taut export c", "taut.export(case, \"c\", ...)"),
    ("taut export fmu", "taut.export(case, \"fmu\", ...)"),
    ("taut export st", "taut.export(case, \"st\", ...)"),
    ("taut fit", "case.fit()"),
    ("taut init", "taut.template()"),
    ("taut move", "case.move()"),
    ("taut simulate", "case.simulate()"),
    ("taut tune", "case.tune()"),
];

/// A message: `--part both` becomes `part="both"`, and a command between backquotes a call. Commands with options stay,
/// since they write files.
pub fn spoken(text: &str) -> String {
    let is_command = |number: usize| number % 2 == 1;
    let parts: Vec<String> = text
        .split('`')
        .enumerate()
        .map(|(number, part)| if is_command(number) { called(part).to_string() } else { with_arguments(part) })
        .collect();
    parts.join("`")
}

/// The name of the input in which something is wrong: that of an argument, or `change` for a changed value.
pub fn place(file: &str) -> Option<String> {
    match file {
        "--set" => Some("change".into()),
        _ => file.starts_with("--").then(|| with_arguments(file).replace('=', "")),
    }
}

fn called(command: &str) -> &str {
    CALLS.iter().find(|(name, _)| *name == command).map_or(command, |(_, call)| call)
}

/// A text with arguments in place of options.
fn with_arguments(text: &str) -> String {
    let mut spoken = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("--") {
        let (before, option) = (&rest[..at], &rest[at + 2..]);
        let end = option.find(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).unwrap_or(option.len());
        let begins_a_word = before.chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '-');
        spoken.push_str(before);
        if !(option.starts_with(|c: char| c.is_ascii_lowercase()) && begins_a_word) {
            spoken.push_str(&rest[at..at + 2 + end]);
            rest = &option[end..];
            continue;
        }
        let (argument, after) = argument(&option[..end], &option[end..]);
        spoken.push_str(&argument);
        if after.starts_with(" --") {
            spoken.push(',');
        }
        rest = after;
    }
    spoken + rest
}

/// The argument for an option, with the value that follows it in the text, and the text behind.
fn argument<'t>(option: &str, after: &'t str) -> (String, &'t str) {
    let name = ARGUMENTS.iter().find(|(theirs, _)| *theirs == option).map_or(option, |(_, ours)| ours);
    let name = name.replace('-', "_");
    let Some((value, rest)) = value(after) else { return (format!("{name}="), after) };
    let quoted = value.starts_with('"');
    let inside = value.trim_matches('"');
    match (option, inside.split_once('=')) {
        ("set", Some((key, to))) => (format!("case[\"{key}\"] = \"{}\"", to.trim_matches('"')), rest),
        ("measure", Some(_)) => {
            let (noises, rest) = noises(after);
            (format!("{name}={{{noises}}}"), rest)
        }
        (_, Some((key, to))) => (format!("{name}={{\"{key}\": \"{to}\"}}"), rest),
        ("for", None) if inside.contains(',') || inside.contains('.') => {
            (format!("{name}=[\"{}\"]", inside.replace(',', "\", \"")), rest)
        }
        (_, None) if quoted => (format!("{name}={}", si(inside)), rest),
        (_, None) if WORDS.contains(&inside) => (format!("{name}=\"{inside}\""), rest),
        (_, None) if inside.parse::<f64>().is_ok() => (format!("{name}={inside}"), rest),
        _ => (format!("{name}="), after),
    }
}

/// Pairs of a quantity and its noise, of several options in a row, as entries of a dictionary.
fn noises(mut after: &str) -> (String, &str) {
    let mut entries = Vec::new();
    while let Some((pair, rest)) = value(after) {
        let Some((key, noise)) = pair.split_once('=') else { break };
        entries.push(format!("\"{key}\": {}", si(noise)));
        after = rest;
        let Some(next) = after.strip_prefix(" --measure") else { break };
        after = next;
    }
    (entries.join(", "), after)
}

/// A quantity as a number in SI units.
fn si(text: &str) -> String {
    parse(text).map_or(format!("\"{text}\""), |quantity| quantity.value.to_string())
}

/// The word behind an option, up to a space or the punctuation of the sentence, and the text behind it.
fn value(after: &str) -> Option<(&str, &str)> {
    let text = after.strip_prefix(' ')?;
    let mut within_quotes = false;
    let ends = |c: char| {
        within_quotes ^= c == '"';
        c.is_whitespace() && !within_quotes
    };
    let word = text[..text.find(ends).unwrap_or(text.len())].trim_end_matches([',', ';', ':', '.', ')']);
    (!word.is_empty()).then(|| (word, &text[word.len()..]))
}
