//! The documents tell the truth: what they show of the program is what it prints, and what they name is there.
#![cfg(unix)]

use crate::common::{read, root};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// A folder in which the repository's machines can be named as from its root.
fn workplace() -> TempDir {
    let folder = TempDir::new().unwrap();
    std::os::unix::fs::symlink(root().join("stages"), folder.path().join("stages")).unwrap();
    folder
}

/// The output of a command line on both streams, as in a terminal 100 characters wide.
fn printed(folder: &Path, line: &str) -> String {
    let programs = assert_cmd::cargo::cargo_bin("taut").parent().unwrap().to_path_buf();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("sh");
    command.arg("-c").arg(format!("{{ {line}\n}} 2>&1")).current_dir(folder);
    let output = command.env("PATH", path).env("COLUMNS", "100").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().flat_map(|line| [line.trim_end(), "\n"]).collect()
}

/// Counts that follow from how a search or a solver goes about it, and not from the result: `12 steps`,
/// `40 simulations`.
const EFFORT: [&str; 9] =
    ["steps", "step", "evaluations", "modes", "mode", "simulations", "iterations", "designs", "rounds"];

/// The words of an output that have to stay: without clock times and counts of effort, without what another step of a
/// search would change, without the bound of rounding. Where lines are broken does not matter.
fn lasting(text: &str) -> Vec<String> {
    let mut words = Vec::new();
    for line in text.lines() {
        let line = match line.trim_start().starts_with("took ") {
            true => "took",
            false => line.split("another step would").next().unwrap_or_default(),
        };
        let of_line: Vec<&str> = line.split_whitespace().collect();
        for (k, word) in of_line.iter().enumerate() {
            let next = of_line.get(k + 1).map_or("", |next| next.trim_end_matches([',', ';', '.', ':']));
            let is_effort = word.bytes().all(|b| b.is_ascii_digit()) && EFFORT.contains(&next);
            let is_bound = k > 1 && of_line[k - 2..k] == ["positions", "within"];
            words.push(if is_effort || is_bound { "#".to_string() } else { word.to_string() });
        }
    }
    words
}

/// True if an output is as the document shows it; a line `…` of the document stands for any lines.
fn agrees(got: &str, want: &str) -> bool {
    let (got, parts) = (lasting(got), want.split("\n…").map(lasting).collect::<Vec<_>>());
    let ([first, middle @ .., last], true) = (&parts[..], parts.len() > 1) else { return got == parts[0] };
    let Some(mut rest) = got.strip_prefix(&first[..]).and_then(|rest| rest.strip_suffix(&last[..])) else {
        return false;
    };
    middle.iter().all(|part| {
        let place = (0..rest.len()).find(|&place| rest[place..].starts_with(part));
        place.map(|place| rest = &rest[place + part.len()..]).is_some()
    })
}

/// An output as the document is to show it: as short as it was. A part between two `…` begins at the line that shares
/// the most first words with the line there.
fn shown(got: &str, want: &str) -> String {
    let parts: Vec<&str> = want.split("\n…").collect();
    let ([first, middle @ .., last], true) = (&parts[..], parts.len() > 1) else { return got.to_string() };
    let count = |part: &str| part.trim_matches('\n').lines().count();
    let lines: Vec<&str> = got.trim_end_matches('\n').lines().collect();
    let end = lines.len().saturating_sub(count(last));
    let mut from = first.lines().count().min(end);
    let mut shown = lines[..from].to_vec();
    for part in middle {
        let before = part.trim_matches('\n').lines().next().unwrap_or_default();
        let shared = |line: &str| {
            let pairs = line.split_whitespace().zip(before.split_whitespace());
            pairs.take_while(|(now, before)| now == before).count()
        };
        let place = (from..end).rev().max_by_key(|&k| shared(lines[k])).unwrap_or(from);
        from = (place + count(part)).min(end);
        shown.push("…");
        shown.extend(&lines[place..from]);
    }
    shown.push("…");
    shown.extend(&lines[end..]);
    shown.join("\n") + "\n"
}

#[test]
fn a_document_may_leave_out_the_effort_and_long_middles() {
    let got = "  fit   0.5 kg\n  cost  1001 rows, 12 steps, 3 modes\nfound in 40 simulations; another step would move 1e-9\nend\n";
    let want = "  fit   0.5 kg\n  cost  1001 rows, 9 steps, 3 modes\nfound in 41\nsimulations; another step would move 2e-8\nend";
    // Where a line is broken between a number and its word, the number counts.
    assert!(!agrees(got, want));
    assert!(agrees(got, &want.replace("41\nsimulations", "7 simulations")));
    assert!(!agrees(got, &want.replace("1001", "1002").replace("41\nsimulations", "7 simulations")));
    assert!(agrees(got, "  fit   0.5 kg\n…\nend") && !agrees(got, "  fit   0.6 kg\n…\nend"));
    assert_eq!(shown(got, "  fit   0.6 kg\n…\nend"), "  fit   0.5 kg\n…\nend\n");
    // Between two dots, too.
    let long = "a\nb 1\nc\nd 2\ne\nf\n";
    assert!(agrees(long, "a\n…\nd 2\n…\nf") && !agrees(long, "a\n…\nd 3\n…\nf") && !agrees(long, "a\n…\nd 2\n…\nc"));
    assert!(!agrees(long, "a\n…\nd 2\n…\nc\n…\nf"), "in their order");
    assert_eq!(shown(long, "a\n…\nd 3\n…\nf"), "a\n…\nd 2\n…\nf\n");
    // An empty line in the end is one of its lines: the line behind the dots was lost.
    assert_eq!(shown("a\nb\nc\n\nd\n", "a\n…\nc\n\nd"), "a\n…\nc\n\nd\n");
}

/// Runs the commands of a document's `console` blocks, one after another in one folder, and compares what they print.
fn check(document: &str) {
    let text = read(document);
    let folder = workplace();
    let mut updated = String::new();
    let mut wrong = Vec::new();
    let mut rest = text.as_str();
    let (mut commands, updates) = (0, std::env::var_os("UPDATE_EXPECT").is_some());
    while let Some((before, behind)) = rest.split_once("```console\n") {
        let (block, after) = behind.split_once("\n```").expect("an end of the block");
        updated += before;
        updated += "```console";
        for entry in block.strip_prefix("$ ").expect("a command first").split("\n$ ") {
            let (line, want) = entry.split_once('\n').unwrap_or((entry, ""));
            let got = printed(folder.path(), line);
            commands += 1;
            // Written anew, a document shows what is printed now, its lines and its effort too.
            let is_right = agrees(&got, want) && (!updates || shown(&got, want).trim_end() == want.trim_end());
            if is_right {
                updated += &format!("\n$ {entry}");
            } else {
                wrong.push(format!("$ {line}\n--- the document\n{want}\n--- the program\n{got}"));
                updated += format!("\n$ {line}\n{}", shown(&got, want)).trim_end_matches('\n');
            }
        }
        updated += "\n```";
        rest = after;
    }
    updated += rest;
    assert!(commands > 0, "{document} shows no command");
    if updates {
        fs::write(root().join(document), updated).unwrap();
    } else {
        assert!(wrong.is_empty(), "{document}: UPDATE_EXPECT=1 writes it anew\n{}", wrong.join("\n"));
    }
}

#[test]
fn the_readme_shows_what_the_program_prints() {
    check("README.md");
}

#[test]
fn the_page_on_the_paper_shows_what_the_program_prints() {
    check("docs/paper.md");
}

#[test]
fn the_first_axis_goes_from_data_sheets_to_a_fitted_model() {
    check("docs/first-axis.md");
}

#[test]
fn the_documentation_of_the_fit_shows_what_it_prints() {
    check("docs/fit.md");
}

#[test]
fn the_papers_procedure_shows_what_the_program_prints() {
    check("stages/sollmann-jouaneh/identification/README.md");
}

#[test]
fn the_reference_of_the_commands_shows_their_help() {
    check("docs/commands.md");
}

#[test]
fn the_page_on_control_shows_what_the_program_prints() {
    check("docs/control.md");
}

#[test]
fn the_page_on_tuning_shows_what_the_program_prints() {
    check("docs/tune.md");
}

#[test]
fn the_page_on_plans_shows_what_the_program_prints() {
    check("docs/plan.md");
}

#[test]
fn the_page_on_learning_shows_what_the_program_prints() {
    check("docs/learn.md");
}

#[test]
fn the_page_on_frequency_responses_shows_what_the_program_prints() {
    check("docs/frf.md");
}

#[test]
fn the_page_on_designed_experiments_shows_what_the_program_prints() {
    check("docs/design.md");
}

#[test]
fn the_page_on_sweeps_shows_what_the_program_prints() {
    check("docs/sweep.md");
}

#[test]
fn the_page_on_modes_shows_what_the_program_prints() {
    check("docs/modes.md");
}

#[test]
fn the_page_on_steppers_shows_what_the_program_prints() {
    check("docs/stepper.md");
}

#[test]
fn the_page_on_gantries_shows_what_the_program_prints() {
    check("docs/gantry.md");
}

#[test]
fn the_pictures_are_those_that_the_commands_draw() {
    let folder = workplace();
    for line in [
        "taut simulate stages/sollmann-jouaneh/table4.toml --out out/table4 --quiet",
        "taut simulate stages/h-frame/h-frame.toml --out out/h-frame --quiet",
        "taut simulate stages/core-xy/core-xy.toml --out out/core-xy --quiet",
        "taut simulate stages/dual-belt/dual-belt.toml --out out/dual-belt --quiet",
        "taut paper --out out/paper --json > claims.json",
    ] {
        assert_eq!(printed(folder.path(), line), "", "{line}");
    }
    for (picture, made) in [
        ("encoder-and-cart.svg", "out/table4/plots/5-v-pulse-positions.svg"),
        ("h-frame.svg", "out/h-frame/plots/machine.svg"),
        ("core-xy.svg", "out/core-xy/plots/machine.svg"),
        ("dual-belt.svg", "out/dual-belt/plots/machine.svg"),
        ("stage.svg", "out/paper/figures/figure-01-02.svg"),
        ("friction-laws.svg", "out/paper/figures/friction-laws.svg"),
        ("modes-along-the-travel.svg", "out/paper/figures/modes-along-the-travel.svg"),
    ] {
        let made = fs::read_to_string(folder.path().join(made)).unwrap();
        let committed = root().join("docs/pictures").join(picture);
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            fs::create_dir_all(committed.parent().unwrap()).unwrap();
            fs::write(&committed, &made).unwrap();
        }
        assert!(fs::read_to_string(&committed).unwrap() == made, "docs/pictures/{picture} is out of date");
    }
}

/// The documents in a folder.
fn markdown(folder: &Path, is_deep: bool, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && is_deep {
            markdown(&path, is_deep, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
}

/// Every path between backquotes, and every link within the repository, leads somewhere.
#[test]
fn what_the_documents_name_is_there() {
    let mut documents = Vec::new();
    for (folder, is_deep) in [("", false), ("docs", true), ("authorities", true), ("stages", true)] {
        markdown(&root().join(folder), is_deep, &mut documents);
    }
    assert!(documents.len() > 30, "{documents:?}");
    let folders = [
        "src",
        "core",
        "case",
        "control",
        "identify",
        "export",
        "cli",
        "stages",
        "tests",
        "examples",
        "docs",
        "authorities",
        "py",
        "xtask",
        "hunt",
        ".ci",
    ];
    let mut missing = Vec::new();
    for path in &documents {
        let text = fs::read_to_string(path).unwrap();
        let document = path.strip_prefix(root()).unwrap_or(path).display();
        // An example is one of the package that its command names; of none, the program is looked through.
        for command in text.split("cargo run ").skip(1) {
            let words: Vec<&str> = command.split_whitespace().take(8).collect();
            let after = |option: &str| {
                words
                    .windows(2)
                    .find(|pair| pair[0] == option)
                    .map(|pair| pair[1].trim_matches(|c: char| !c.is_alphanumeric() && c != '_'))
            };
            let Some(example) = after("--example") else { continue };
            let folder = after("--package").unwrap_or("cli").trim_start_matches("taut-").trim_start_matches("taut");
            if !root().join(folder).join("examples").join(example).with_extension("rs").exists() {
                missing.push(format!("{document}: --example {example}"));
            }
        }
        let quoted = text.split('`').skip(1).step_by(2);
        let paths = quoted.filter(|word| {
            let first = word.split('/').next().unwrap_or_default();
            folders.contains(&first) && !word.contains([' ', '\n', '*'])
        });
        missing.extend(paths.filter(|path| !root().join(path).exists()).map(|path| format!("{document}: {path}")));
        let links = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
        let inside = links.filter(|link| !link.is_empty() && !link.contains("://"));
        let here = path.parent().unwrap();
        missing.extend(inside.filter(|link| !here.join(link).exists()).map(|link| format!("{document}: {link}")));
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

/// A text without its fenced blocks.
fn without_blocks(text: &str) -> String {
    let mut is_block = false;
    let mut kept = String::new();
    for line in text.lines() {
        let is_fence = line.trim_start().starts_with("```");
        if !is_block && !is_fence {
            kept.extend([line, "\n"]);
        }
        is_block ^= is_fence;
    }
    kept
}

/// The anchors of a page's headings, as GitHub and mdBook make them.
fn anchors(text: &str) -> Vec<String> {
    let mut anchors: Vec<String> = Vec::new();
    for line in without_blocks(text).lines().filter(|line| line.starts_with('#')) {
        let heading = line.trim_start_matches('#').trim().to_lowercase();
        let kept = heading.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
        let plain: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let same = anchors.iter().filter(|anchor| **anchor == plain).count();
        anchors.push(if same > 0 { format!("{plain}-{same}") } else { plain });
    }
    anchors
}

/// Every link to a heading, in the book and outside, leads to one.
#[test]
fn links_to_headings_lead_to_headings() {
    let mut documents = Vec::new();
    for (folder, is_deep) in [("", false), ("docs", true), ("authorities", true), ("stages", true), ("py", false)] {
        markdown(&root().join(folder), is_deep, &mut documents);
    }
    let (mut missing, mut links) = (Vec::new(), 0);
    for path in &documents {
        let text = fs::read_to_string(path).unwrap();
        for link in without_blocks(&text).split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let Some((file, anchor)) = link.split_once('#').filter(|_| !link.contains("://")) else { continue };
            let to = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            let there = fs::read_to_string(&to).unwrap_or_default();
            if !anchors(&there).iter().any(|there| there == anchor) {
                missing.push(format!("{}: {link}", path.strip_prefix(root()).unwrap_or(path).display()));
            }
            links += 1;
        }
    }
    assert!(links > 40, "{links}");
    assert!(missing.is_empty(), "{missing:#?}");
}

/// The table of contents of the book names every page once, and no other.
#[test]
fn the_book_has_every_page() {
    let summary = read("docs/SUMMARY.md");
    let mut named: Vec<&str> = summary.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    named.sort_unstable();
    let mut pages = Vec::new();
    markdown(&root().join("docs"), false, &mut pages);
    let names = pages.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned());
    let mut pages: Vec<String> = names.filter(|name| name != "SUMMARY.md").collect();
    pages.sort_unstable();
    assert_eq!(named, pages);
}

/// A page begins with an explanation, not with a block of code.
#[test]
fn every_page_begins_with_an_explanation() {
    let mut pages = Vec::new();
    markdown(&root().join("docs"), false, &mut pages);
    for path in pages.iter().filter(|path| !path.ends_with("SUMMARY.md")) {
        let text = fs::read_to_string(path).unwrap();
        let first = text.lines().skip(1).find(|line| !line.trim().is_empty()).unwrap_or_default();
        let is_prose = first.starts_with(|c: char| c.is_alphabetic() || c == '`' || c == '"' || c == '[');
        assert!(text.starts_with("# ") && is_prose && !first.starts_with("```"), "{}: {first}", path.display());
    }
}

/// The first column of NOTATION.md's tables holds names that the code has.
#[test]
fn the_names_of_the_notation_are_those_of_the_code() {
    fn sources(folder: &Path) -> String {
        let mut text = String::new();
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            text += &if path.is_dir() { sources(&path) } else { fs::read_to_string(&path).unwrap_or_default() };
        }
        text
    }
    let folders = ["core/src", "case/src", "control/src", "identify/src", "export/src", "src"];
    let code: String = folders.iter().map(|folder| sources(&root().join(folder))).collect();
    let mut unknown = Vec::new();
    for row in read("NOTATION.md").lines().filter(|line| line.starts_with("| `")) {
        let first = row.split('|').nth(1).unwrap_or_default();
        let names = first.split('`').skip(1).step_by(2).flat_map(|name| name.split(['.', ':']));
        unknown.extend(names.filter(|name| !code.contains(name)).map(str::to_string));
    }
    assert!(unknown.is_empty(), "{unknown:?}");
}
