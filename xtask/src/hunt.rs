//! `cargo xtask hunt`: looks for what is wrong with larger means than the tests have, each part with a seed and a
//! budget.

mod faults;
mod mutants;
mod readers;
mod stages;

use std::time::Duration;

/// The hunt that is asked for.
pub struct Hunt {
    parts: Vec<Part>,
    /// Random stages.
    stages: u64,
    /// Cases in which each pair of features occurs.
    pairs: u64,
    /// The same with a dual belt in place of their machines.
    dual_belts: u64,
    seed: u64,
    /// For each reader, s.
    seconds: u64,
    /// Kills of each command.
    kills: u64,
    /// Changes of the source, of each of two groups of folders.
    mutants: usize,
    /// Folders whose changes are tried; all areas where none is named.
    areas: Vec<String>,
    /// Programs of tests that are run; all where none is named.
    tests: Vec<String>,
    /// Only these of the changes.
    only: Vec<usize>,
    /// True if they are shown, and not run.
    list: bool,
    /// Threads of the stages, all processors unless given; changes and tests tried side by side, two unless given.
    threads: Option<u64>,
    /// Tests of changes that take longer are left out, s.
    longest: u64,
    /// Tests of a change end after this time together, s.
    spend: u64,
    /// True if the stages are told as JSON.
    json: bool,
}

/// A part of the hunt.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Stages,
    Pairs,
    DualBelts,
    Readers,
    Faults,
    Mutants,
}

const PARTS: [(&str, Part); 6] = [
    ("stages", Part::Stages),
    ("pairs", Part::Pairs),
    ("dual-belts", Part::DualBelts),
    ("readers", Part::Readers),
    ("faults", Part::Faults),
    ("mutants", Part::Mutants),
];

pub const USAGE: &str = "cargo xtask hunt [--part stages|pairs|dual-belts|readers|faults|mutants]... [--seed S]
                       [--threads N] [--stages N [--json]] [--pairs N] [--dual-belts N] [--seconds B] [--kills N]
                       [--mutants N [--area FOLDER]... [--tests NAME]... [--longest S] [--spend S]
                        [--list | --only K...]]";

impl Hunt {
    /// From the words behind `hunt`. The size of a part names it, too; without any all parts but the mutants, which
    /// take hours.
    pub fn new(words: &[&str]) -> Result<Self, String> {
        let mut hunt = Self {
            parts: Vec::new(),
            stages: 10_000,
            pairs: 2_000,
            dual_belts: 300,
            areas: Vec::new(),
            tests: Vec::new(),
            seed: 1,
            seconds: 300,
            kills: 200,
            mutants: 100,
            only: Vec::new(),
            list: false,
            threads: None,
            longest: 120,
            spend: 600,
            json: false,
        };
        let mut sized = Vec::new();
        let mut words = words.iter();
        while let Some(&word) = words.next() {
            match word {
                "--list" => hunt.list = true,
                "--json" => hunt.json = true,
                _ => {}
            }
            if ["--list", "--json"].contains(&word) {
                continue;
            }
            let value = *words.next().ok_or_else(|| format!("{word} wants a value"))?;
            if let Some(names) = match word {
                "--area" => Some(&mut hunt.areas),
                "--tests" => Some(&mut hunt.tests),
                _ => None,
            } {
                names.push(value.to_string());
                continue;
            }
            let number = || value.parse::<u64>().map_err(|_| format!("{word} wants a whole number, not {value}"));
            match word {
                "--part" => {
                    let known = PARTS.iter().find(|(name, _)| *name == value);
                    hunt.parts.push(known.ok_or_else(|| format!("there is no part {value}"))?.1);
                }
                "--stages" => hunt.stages = number()?,
                "--pairs" => hunt.pairs = number()?,
                "--dual-belts" => hunt.dual_belts = number()?,
                "--seed" => hunt.seed = number()?,
                "--seconds" => hunt.seconds = number()?,
                "--kills" => hunt.kills = number()?,
                "--mutants" => hunt.mutants = number()? as usize,
                "--only" => hunt.only.push(number()? as usize),
                "--threads" => hunt.threads = Some(number()?.clamp(1, 256)),
                "--longest" => hunt.longest = number()?,
                "--spend" => hunt.spend = number()?,
                _ => return Err(format!("{word} is not known")),
            }
            let part = match word {
                "--stages" => Some(Part::Stages),
                "--pairs" => Some(Part::Pairs),
                "--dual-belts" => Some(Part::DualBelts),
                "--seconds" => Some(Part::Readers),
                "--kills" => Some(Part::Faults),
                "--mutants" | "--only" => Some(Part::Mutants),
                _ => None,
            };
            sized.extend(part.filter(|part| !sized.contains(part)));
        }
        if hunt.parts.is_empty() {
            hunt.parts = sized;
        }
        if hunt.parts.is_empty() {
            hunt.parts = vec![Part::Stages, Part::Pairs, Part::DualBelts, Part::Readers, Part::Faults];
        }
        Ok(hunt)
    }

    /// Does the parts one after another; all of them, also where one has found something.
    pub fn run(&self) -> Result<(), String> {
        let mut found = Vec::new();
        for part in &self.parts {
            let done = match part {
                Part::Stages => stages::run("stages", self.stages, self.seed, self.threads, self.json),
                Part::Pairs => stages::run("pairs", self.pairs, self.seed, self.threads, self.json),
                Part::DualBelts => stages::run("dual-belts", self.dual_belts, self.seed, self.threads, self.json),
                Part::Readers => readers::run(self.seconds, self.seed),
                Part::Faults => faults::run(self.kills, self.seed),
                Part::Mutants => {
                    let wanted = mutants::Wanted {
                        count: self.mutants,
                        seed: self.seed,
                        areas: &self.areas,
                        programs: &self.tests,
                        only: &self.only,
                        longest: Duration::from_secs(self.longest),
                        spend: Duration::from_secs(self.spend),
                        threads: self.threads.unwrap_or(2) as usize,
                        list: self.list,
                    };
                    mutants::run(&wanted)
                }
            };
            found.extend(done.err());
        }
        if found.is_empty() { Ok(()) } else { Err(found.join("\n")) }
    }
}

/// Runs a cargo command to its end.
fn succeeds(command: &mut std::process::Command) -> Result<(), String> {
    let status = command.status().map_err(|error| format!("cargo cannot be started: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("failed: {command:?}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_mistakes_told() {
        let hunt = Hunt::new(&["--part", "faults", "--seed", "7", "--part", "readers"]).unwrap();
        assert!(hunt.parts == [Part::Faults, Part::Readers] && hunt.seed == 7);
        assert!(Hunt::new(&["--stages", "5", "--seed", "3"]).unwrap().parts == [Part::Stages]);
        assert_eq!(Hunt::new(&[]).unwrap().parts.len(), 5);
        assert!(Hunt::new(&["--pairs", "5"]).unwrap().parts == [Part::Pairs]);
        let hunt = Hunt::new(&["--mutants", "5", "--threads", "0", "--longest", "6", "--only", "2"]).unwrap();
        assert!(hunt.parts == [Part::Mutants] && hunt.threads == Some(1) && hunt.longest == 6);
        assert_eq!(Hunt::new(&["--part", "others"]).err().unwrap(), "there is no part others");
        assert_eq!(Hunt::new(&["--stages", "many"]).err().unwrap(), "--stages wants a whole number, not many");
        assert_eq!(Hunt::new(&["--seed"]).err().unwrap(), "--seed wants a value");
        assert_eq!(Hunt::new(&["--fast", "1"]).err().unwrap(), "--fast is not known");
    }
}
