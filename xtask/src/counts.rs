//! `cargo xtask counts [--keep]`: how many instructions nine standard works take, against those that are kept in
//! `benches/counts.txt`.
//!
//! Times depend on what else a machine does; instructions do not. valgrind runs `examples/counts.rs` and counts those
//! of each work. It knows AVX2 and nothing wider. The counts hold for one compiler, which the file names; another one
//! is told, and its counts are compared all the same. Counts that are kept go into the tables of `docs/performance.md`,
//! too, with the share that each kind of work has in a run and in a sweep.

mod shares;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

pub const USAGE: &str = "cargo xtask counts [--keep]";

/// A kind of work, and its share.
type Share = (&'static str, f64);

/// Where the counts are kept.
const KEPT: &str = "benches/counts.txt";

/// The document with a table of them.
const DOCUMENT: &str = "docs/performance.md";

/// A rise by more than this share is told.
const RISE: f64 = 0.03;

/// Counts the instructions of every work and compares them with those kept, or keeps them.
pub fn run(words: &[&str]) -> Result<(), String> {
    let keep = match words {
        [] => false,
        ["--keep"] => true,
        _ => return Err(format!("usage: {USAGE}")),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("the project has no folder")?;
    let compiler = told(Command::new("rustc").arg("--version"))?.trim().to_string();
    let counts = count(root)?;
    let file = root.join(KEPT);
    let before = match fs::read_to_string(&file) {
        Ok(text) => Kept::read(&text)?,
        Err(_) if keep => Kept::default(),
        Err(error) => return Err(format!("{KEPT} cannot be read: {error}; `{USAGE}` with --keep makes it")),
    };
    if !before.compiler.is_empty() && before.compiler != compiler {
        println!("{KEPT} was counted with {}, this is {compiler}", before.compiler);
    }
    let rises = compare(&before.counts, &counts);
    if keep {
        let document = root.join(DOCUMENT);
        let text = fs::read_to_string(&document).map_err(|error| format!("{DOCUMENT} cannot be read: {error}"))?;
        let text = with_shares(&with_counts(&text, &counts), [shares(root, 0)?, shares(root, 1)?]);
        fs::write(&document, text).map_err(|error| format!("{DOCUMENT} cannot be written: {error}"))?;
        let text = Kept { compiler, counts: counts.into_iter().collect() }.text();
        return fs::write(&file, text).map_err(|error| format!("{KEPT} cannot be written: {error}"));
    }
    match rises[..] {
        [] => Ok(()),
        _ => Err(format!("more instructions than before: {}", rises.join(", "))),
    }
}

/// Instructions of each work, in the order of the example.
fn count(root: &Path) -> Result<Vec<(String, u64)>, String> {
    let built = super::cargo(&["build", "--release", "--quiet", "--package", "taut", "--no-default-features"])
        .args(["--example", "counts"])
        .current_dir(root)
        .status();
    if !built.is_ok_and(|status| status.success()) {
        return Err("the example counts could not be built".into());
    }
    let folder = root.join("target/counts");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|error| format!("{} cannot be made: {error}", folder.display()))?;
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--toggle-collect=measured_work", "--dump-after=measured_work"]);
    command.arg(format!("--callgrind-out-file={}", folder.join("out").display()));
    command.arg(root.join("target/release/examples/counts")).arg("1").current_dir(root);
    let names = told(&mut command)?;
    let names = names.lines().filter_map(|line| line.split_whitespace().next());
    names
        .enumerate()
        .map(|(index, name)| {
            let sum = total(&profile(root, index)?).ok_or_else(|| format!("the profile of {name} has no sum"))?;
            Ok((name.to_string(), sum))
        })
        .collect()
}

/// The profile of the work with this number, from 0 on.
fn profile(root: &Path, index: usize) -> Result<String, String> {
    let file = root.join(format!("target/counts/out.{}", index + 1));
    fs::read_to_string(&file).map_err(|error| format!("valgrind made no {}: {error}", file.display()))
}

/// The share of each kind of work in the one with this number.
fn shares(root: &Path, index: usize) -> Result<Vec<Share>, String> {
    Ok(shares::shares(&profile(root, index)?))
}

/// The sum of the costs in a file of callgrind's: the number behind `summary:`, or behind `totals:`.
fn total(text: &str) -> Option<u64> {
    let sum = |word: &str| text.lines().find_map(|line| line.strip_prefix(word)?.trim().parse().ok());
    sum("totals:").or_else(|| sum("summary:"))
}

/// The output of a command.
fn told(command: &mut Command) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|error| format!("{name} cannot be started: {error}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{name} failed: {}", String::from_utf8_lossy(&output.stderr))),
    }
}

/// Shows both counts of each work, and names those that rose.
fn compare(before: &BTreeMap<String, u64>, now: &[(String, u64)]) -> Vec<String> {
    println!("{:12} {:>12} {:>12}", "work", "kept", "now");
    let mut rises = Vec::new();
    for (name, now) in now {
        let Some(&kept) = before.get(name) else {
            println!("{name:12} {:>12} {now:>12}", "-");
            continue;
        };
        let change = *now as f64 / kept as f64 - 1.0;
        println!("{name:12} {kept:>12} {now:>12} {:+6.1} %", 100.0 * change);
        if change > RISE {
            rises.push(format!("{name} by {:.1} %", 100.0 * change));
        }
    }
    rises
}

/// The document with these counts in its rows of workload, description and count.
fn with_counts(document: &str, counts: &[(String, u64)]) -> String {
    document.lines().map(|line| row(line, counts).unwrap_or_else(|| line.to_string()) + "\n").collect()
}

/// The document with these shares in its rows of kind of work, share in a run, share in a sweep.
fn with_shares(document: &str, [run, sweep]: [Vec<Share>; 2]) -> String {
    let row = |line: &str| {
        let name = line.strip_prefix("| ")?.split(" |").next()?;
        let share = |of: &[Share]| of.iter().find(|(kind, _)| *kind == name).map(|(_, share)| 100.0 * share);
        Some(format!("| {name} | {:.0} % | {:.0} % |", share(&run)?, share(&sweep)?))
    };
    document.lines().map(|line| row(line).unwrap_or_else(|| line.to_string()) + "\n").collect()
}

fn row(line: &str, counts: &[(String, u64)]) -> Option<String> {
    let cells: Vec<&str> = line.split('|').map(str::trim).collect();
    let ["", name, what, kept, ""] = cells[..] else { return None };
    kept.replace(' ', "").parse::<u64>().ok()?;
    let (_, count) = counts.iter().find(|(work, _)| name.trim_matches('`') == work)?;
    Some(format!("| {name} | {what} | {} |", grouped(*count)))
}

/// A whole number with a space before every three digits.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let (first, rest) = digits.split_at((digits.len() - 1) % 3 + 1);
    rest.as_bytes().chunks(3).fold(first.to_string(), |text, three| text + " " + &String::from_utf8_lossy(three))
}

/// The counts that are kept.
#[derive(Debug, Default, PartialEq)]
struct Kept {
    compiler: String,
    counts: BTreeMap<String, u64>,
}

impl Kept {
    /// Lines of a name and a number; the compiler behind a number sign.
    fn read(text: &str) -> Result<Self, String> {
        let mut kept = Self::default();
        for line in text.lines() {
            if let Some(compiler) = line.strip_prefix("# ") {
                kept.compiler = compiler.to_string();
                continue;
            }
            let (name, count) =
                line.split_once(' ').ok_or_else(|| format!("{KEPT}: {line:?} is no name and number"))?;
            let count = count.trim().parse().map_err(|_| format!("{KEPT}: {line:?} has no number"))?;
            kept.counts.insert(name.to_string(), count);
        }
        Ok(kept)
    }

    fn text(&self) -> String {
        let lines = self.counts.iter().map(|(name, count)| format!("{name} {count}\n"));
        format!("# {}\n{}", self.compiler, lines.collect::<String>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rise_of_more_than_three_per_cent_is_told() {
        let before = BTreeMap::from([("run".to_string(), 1000), ("sweep".to_string(), 1000)]);
        let now = [("run".to_string(), 1029), ("sweep".to_string(), 1031), ("new".to_string(), 5)];
        assert_eq!(compare(&before, &now), ["sweep by 3.1 %"]);
    }

    #[test]
    fn the_table_of_the_document_takes_the_counts() {
        let document =
            "| work | what it is | instructions |\n| `run` | Table 4 | 654 326 |\n| `run` | 1 % | 2 % |\ntext\n";
        let expected = document.replace("654 326", "465 995");
        assert_eq!(with_counts(document, &[("run".to_string(), 465_995)]), expected);
        assert_eq!([7, 999, 1000, 12_345_678].map(grouped), ["7", "999", "1 000", "12 345 678"]);
    }

    #[test]
    fn the_shares_of_the_document_take_the_profiles() {
        let document = "| | `run` | `sweep` |\n| the rest | 1 % | 2 % |\n| others | 1 % | 2 % |\n";
        let expected = "| | `run` | `sweep` |\n| the rest | 12 % | 5 % |\n| others | 1 % | 2 % |\n";
        assert_eq!(with_shares(document, [vec![("the rest", 0.119)], vec![("the rest", 0.05)]]), expected);
    }

    #[test]
    fn what_is_kept_is_read_again() {
        let kept = Kept { compiler: "rustc 1.95.0".into(), counts: BTreeMap::from([("run".to_string(), 123)]) };
        assert_eq!(Kept::read(&kept.text()), Ok(kept));
        assert!(Kept::read("run many").is_err_and(|told| told.contains("has no number")));
    }

    #[test]
    fn the_sum_of_a_profile_is_found() {
        assert_eq!(total("version: 1\nevents: Ir\nsummary: 12\n\nfn=(1)\ntotals: 345\n"), Some(345));
        assert_eq!(total("events: Ir\n"), None);
    }
}
