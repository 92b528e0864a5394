//! What a hunt for mutants has found so far, so that an interrupted hunt goes on where it ended.
//!
//! The folder `target/mutants/records/HASH` belongs to the library's source and the changes built into it. `tests` has
//! a line for each test that ran without a change: name, seconds, numbers of the changes that it reaches; `trials` one
//! for each test that ran with a change: number, how it ended, name. Tests that are added or are made anew are run; a
//! test that was edited keeps its lines until the folder is deleted.

use super::Trial;
use super::change::Change;
use super::copy::{Ended, Test};
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

/// The files of a hunt.
pub struct Record {
    folder: PathBuf,
    /// Lines are written by one thread at a time.
    turn: Mutex<()>,
}

impl Record {
    /// The record of these changes of this source in a folder of records.
    pub fn open(folder: &Path, source: &str, chosen: &[Change]) -> Result<Self, String> {
        let all: String = chosen.iter().enumerate().map(|(k, change)| change.switched(k + 1)).collect();
        let hash = crate::data::sum(format!("{source}{all}").as_bytes());
        let folder = folder.join(&hash[..16]);
        fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let folder = folder.canonicalize().map_err(|error| format!("{}: {error}", folder.display()))?;
        Ok(Self { folder, turn: Mutex::new(()) })
    }

    /// Where a test that runs without a change lists the changes that it reaches.
    pub fn list(&self, test: &Test) -> PathBuf {
        self.folder.join(test.to_string().replace("::", ".").replace(' ', "-"))
    }

    /// Sets times and reached changes of the tests that ran before.
    pub fn recall(&self, tests: &mut [Test]) {
        let text = fs::read_to_string(self.folder.join("tests")).unwrap_or_default();
        let known: BTreeMap<&str, (&str, &str)> = text
            .lines()
            .filter_map(|line| line.split_once('\t').and_then(|(name, rest)| Some((name, rest.split_once('\t')?))))
            .collect();
        for test in tests {
            let Some((time, reached)) = known.get(&*test.to_string()) else { continue };
            let seconds = |text: &str| text.parse().ok().map(Duration::from_secs_f64);
            match time.strip_prefix('>') {
                Some(time) => test.longer_than = seconds(time).unwrap_or_default(),
                None => test.took = seconds(time),
            }
            test.reached = reached.split(' ').filter_map(|k| k.parse().ok()).collect();
        }
    }

    /// What earlier hunts found about a change.
    pub fn trial<'a>(&self, k: usize, change: &'a Change) -> Trial<'a> {
        let mut trial = Trial { k, change, passed: Vec::new(), noticed: None };
        let text = fs::read_to_string(self.folder.join("trials")).unwrap_or_default();
        for line in text.lines() {
            let mut words = line.splitn(3, '\t');
            if words.next().and_then(|word| word.parse().ok()) != Some(k) {
                continue;
            }
            match (words.next(), words.next()) {
                (Some("passes"), Some(test)) => trial.passed.push(test.into()),
                (Some("fails"), Some(test)) => trial.noticed = Some((Ended::Badly, test.into())),
                (Some("endless"), Some(test)) => trial.noticed = Some((Ended::Not, test.into())),
                _ => {}
            }
        }
        trial
    }

    /// Keeps what a test took and reached without a change.
    pub fn keep_test(&self, test: &Test) {
        let time = match test.took {
            Some(took) => took.as_secs_f64().to_string(),
            None => format!(">{}", test.longer_than.as_secs_f64()),
        };
        let reached: Vec<String> = test.reached.iter().map(usize::to_string).collect();
        self.add("tests", &format!("{test}\t{time}\t{}\n", reached.join(" ")));
        let _ = fs::remove_file(self.list(test));
    }

    /// Keeps how a test ended with change `k`.
    pub fn keep(&self, k: usize, ended: Ended, test: &str) {
        let word = match ended {
            Ended::Well => "passes",
            Ended::Badly => "fails",
            Ended::Not => "endless",
        };
        self.add("trials", &format!("{k}\t{word}\t{test}\n"));
    }

    fn add(&self, name: &str, line: &str) {
        let _turn = self.turn.lock();
        let file = fs::OpenOptions::new().append(true).create(true).open(self.folder.join(name));
        if let Err(error) = file.and_then(|mut file| file.write_all(line.as_bytes())) {
            eprintln!("{}: {error}", self.folder.join(name).display());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hunt_goes_on_where_it_ended() {
        let folder = std::env::temp_dir().join(format!("taut-xtask-mutants-{}", std::process::id()));
        let folder = folder.as_path();
        let text = "fn least(a: f64, b: f64) -> bool { a < b }";
        let changes = super::super::change::of_text("least.rs", text).unwrap();
        let record = Record::open(folder, "source", &changes).unwrap();
        let (mut known, mut long) = (Test::named("quick"), Test::named("long"));
        (known.took, known.reached) = (Some(Duration::from_millis(1500)), [1, 3].into());
        long.longer_than = Duration::from_secs(4);
        record.keep_test(&known);
        record.keep_test(&long);
        record.keep(1, Ended::Well, "all quick");
        record.keep(1, Ended::Badly, "all slow");
        record.keep(2, Ended::Not, "all slow");

        let again = Record::open(folder, "source", &changes).unwrap();
        let mut tests = ["quick", "long", "new"].map(Test::named);
        again.recall(&mut tests);
        assert_eq!((tests[0].took, &tests[0].reached), (known.took, &known.reached));
        assert_eq!((tests[1].took, tests[1].longer_than), (None, long.longer_than));
        assert_eq!((tests[2].took, tests[2].longer_than), (None, Duration::ZERO));
        let trial = again.trial(1, &changes[0]);
        assert_eq!(trial.passed, ["all quick"]);
        assert_eq!(trial.noticed, Some((Ended::Badly, "all slow".into())));
        assert_eq!(again.trial(2, &changes[1]).noticed, Some((Ended::Not, "all slow".into())));
        // Another source begins anew.
        assert_eq!(Record::open(folder, "changed", &changes).unwrap().trial(1, &changes[0]).noticed, None);
        fs::remove_dir_all(folder).unwrap();
    }
}
