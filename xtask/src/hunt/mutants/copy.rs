//! A copy of the repository with changes built into it, and its programs of tests.

use super::change::Change;
use crate::cargo;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The switch of the changes.
const SWITCH: &str = "//! Which change is turned on.
/// Whether it is this one.
pub fn on(k: usize) -> bool {
    static ON: std::sync::LazyLock<usize> =
        std::sync::LazyLock::new(|| std::env::var(\"TAUT_MUTANT\").ok().and_then(|k| k.parse().ok()).unwrap_or(0));
    *ON == k
}
";

/// The features that the library is built with.
const FEATURES: &str = "json,parquet";

/// Memory that a program of tests may take, KiB: a change may make a loop that collects for ever.
const MEMORY: u64 = 12 << 20;

/// The copy.
pub struct Tree {
    root: PathBuf,
}

/// A program of tests, or one module of it.
pub struct Program {
    pub name: String,
    path: PathBuf,
    /// The tests whose names contain this.
    filter: String,
    root: PathBuf,
    /// How long it takes without a change.
    took: Duration,
    /// Tests that fail without a change, and say nothing about one.
    failing: Vec<String>,
}

/// How a program of tests ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ended {
    Well,
    Badly,
    /// It took many times as long as without a change.
    Not,
}

impl Tree {
    /// All files of the repository, anew.
    pub fn make() -> Result<Self, String> {
        let here = std::env::current_dir().map_err(|error| error.to_string())?;
        let root = here.join("target/mutants/taut");
        let _ = fs::remove_dir_all(&root);
        // Data that some tests read are not in the list of files.
        #[cfg(unix)]
        if let Ok(data) = here.join("data").canonicalize() {
            let made = fs::create_dir_all(&root).and_then(|()| std::os::unix::fs::symlink(data, root.join("data")));
            made.map_err(|error| format!("target/mutants: {error}"))?;
        }
        let listed = Command::new("git").args(["ls-files", "-z", "--cached"]).output();
        let listed = listed.map_err(|error| format!("git cannot be started: {error}"))?;
        for name in String::from_utf8_lossy(&listed.stdout).split('\0').filter(|name| Path::new(name).is_file()) {
            let to = root.join(name);
            let made = to.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::copy(name, &to));
            made.map_err(|error| format!("{}: {error}", to.display()))?;
        }
        let library = root.join("src/lib.rs");
        let text = fs::read_to_string(&library).map_err(|error| error.to_string())?;
        write(&library, &(text + "\npub mod mutant;\n"))?;
        write(&root.join("src/mutant.rs"), SWITCH)?;
        Ok(Self { root })
    }

    /// Builds so many changes in, the first that do not overlap and compile.
    pub fn build(&self, drawn: Vec<Change>, count: usize) -> Result<Vec<Change>, String> {
        let mut refused: BTreeSet<usize> = BTreeSet::new();
        loop {
            let mut chosen: Vec<usize> = Vec::new();
            for (k, change) in drawn.iter().enumerate().filter(|(k, _)| !refused.contains(k)) {
                let apart = |other: &usize| {
                    let other = &drawn[*other];
                    other.file != change.file
                        || other.place.end <= change.place.start
                        || change.place.end <= other.place.start
                };
                if chosen.len() < count && chosen.iter().all(apart) {
                    chosen.push(k);
                }
            }
            let places = self.write(&drawn, &chosen)?;
            let errors = self.errors()?;
            if errors.is_empty() {
                return Ok(chosen.into_iter().map(|k| drawn[k].clone()).collect());
            }
            let before = refused.len();
            for (file, at) in &errors {
                let hit =
                    places.iter().find(|(_, (own, place))| own == file && place.start < at.end && at.start < place.end);
                refused.extend(hit.map(|(k, _)| *k));
            }
            if refused.len() == before {
                return Err(format!("the copy does not compile, and no change is the reason: {errors:?}"));
            }
            println!("{} changes do not compile; others are drawn", refused.len() - before);
        }
    }

    /// Writes the changed files; where each change stands in them.
    fn write(&self, drawn: &[Change], chosen: &[usize]) -> Result<BTreeMap<usize, (String, Range<usize>)>, String> {
        let mut files: BTreeMap<&str, Vec<(usize, usize)>> =
            drawn.iter().map(|change| (&*change.file, Vec::new())).collect();
        for (number, &k) in chosen.iter().enumerate() {
            files.entry(&drawn[k].file).or_default().push((k, number + 1));
        }
        let mut places = BTreeMap::new();
        for (file, mut changes) in files {
            changes.sort_by_key(|(k, _)| drawn[*k].place.start);
            let was = fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?;
            let (mut text, mut end) = (String::new(), 0);
            for (k, number) in changes {
                let place = &drawn[k].place;
                text.push_str(&was[end..place.start]);
                let start = text.len();
                text.push_str(&drawn[k].switched(number));
                places.insert(k, (file.to_string(), start..text.len()));
                end = place.end;
            }
            text.push_str(&was[end..]);
            write(&self.root.join(file), &text)?;
        }
        Ok(places)
    }

    fn cargo(&self, words: &[&str]) -> Command {
        let mut command = cargo(words);
        // A folder of its own: cargo would take what it builds here for the repository's.
        command.args(["--package", "taut", "--features", FEATURES, "--message-format=json"]).current_dir(&self.root);
        command.env("CARGO_TARGET_DIR", "../target").stderr(Stdio::null());
        command
    }

    /// Where the compiler finds errors.
    fn errors(&self) -> Result<Vec<(String, Range<usize>)>, String> {
        let output =
            self.cargo(&["check", "--lib"]).output().map_err(|error| format!("cargo cannot be started: {error}"))?;
        let mut errors = Vec::new();
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else { continue };
            if message["message"]["level"] != "error" {
                continue;
            }
            for span in message["message"]["spans"].as_array().into_iter().flatten() {
                let number = |key: &str| span[key].as_u64().unwrap_or(0) as usize;
                let file = span["file_name"].as_str().unwrap_or_default().to_string();
                errors.push((file, number("byte_start")..number("byte_end").max(number("byte_start") + 1)));
            }
        }
        match output.status.success() || !errors.is_empty() {
            true => Ok(errors),
            false => Err(format!("the copy in {} cannot be built", self.root.display())),
        }
    }

    /// Builds the programs of tests of these names, and runs each without a change.
    pub fn programs<'a>(&self, names: impl Iterator<Item = &'a str>) -> Result<Vec<Program>, String> {
        let names: BTreeSet<&str> = names.collect();
        let words = ["test", "--no-run", "--lib", "--test", "all"];
        let output = self.cargo(&words).output().map_err(|error| format!("cargo cannot be started: {error}"))?;
        let (mut library, mut all) = (None, None);
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else { continue };
            let Some(path) = message["executable"].as_str() else { continue };
            let is_library = message["target"]["kind"][0] == "lib";
            *if is_library { &mut library } else { &mut all } = Some(PathBuf::from(path));
        }
        let (Some(library), Some(all)) = (library, all) else {
            return Err(format!("the tests of the copy in {} cannot be built", self.root.display()));
        };
        let mut programs = Vec::new();
        for name in names {
            let (path, filter) =
                if name == "lib" { (library.clone(), String::new()) } else { (all.clone(), format!("{name}::")) };
            let took = Duration::from_secs(600);
            let (root, failing) = (self.root.clone(), Vec::new());
            let mut program = Program { name: name.into(), path, filter, root, took, failing };
            program.leave_out_failing();
            let begin = Instant::now();
            if program.run(0) != Ended::Well {
                return Err(format!("{name} fails without any change; repeat it by cargo test"));
            }
            program.took = begin.elapsed();
            println!("{name}: {:.1} s", program.took.as_secs_f64());
            for test in &program.failing {
                println!("  {test} fails without any change, and is left out");
            }
            programs.push(program);
        }
        Ok(programs)
    }
}

impl Program {
    /// Runs it with one change turned on.
    pub fn run(&self, k: usize) -> Ended {
        let child = self.command(k).arg("--quiet").stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        child.map_or(Ended::Badly, |child| wait(child, 10 * self.took + Duration::from_secs(20)))
    }

    /// Looks which of its tests fail as it is.
    fn leave_out_failing(&mut self) {
        let output = self.command(0).output().map(|output| output.stdout).unwrap_or_default();
        let text = String::from_utf8_lossy(&output).into_owned();
        let failed = text.lines().filter_map(|line| line.strip_prefix("test ")?.strip_suffix(" ... FAILED"));
        self.failing = failed.map(str::to_string).collect();
    }

    fn command(&self, k: usize) -> Command {
        let mut command = Command::new("sh");
        let limited = format!("ulimit -v {MEMORY} 2>/dev/null; exec \"$0\" \"$@\"");
        command.args(["-c", &limited]).arg(&self.path).args(["--test-threads", "2"]).current_dir(&self.root);
        command.args(Some(&self.filter).filter(|filter| !filter.is_empty()));
        command.args(self.failing.iter().flat_map(|name| ["--skip", name]));
        command.env("TAUT_MUTANT", k.to_string()).env("RUST_BACKTRACE", "0").env("CARGO_MANIFEST_DIR", &self.root);
        command.stdin(Stdio::null());
        command
    }
}

fn wait(mut child: Child, longest: Duration) -> Ended {
    let begin = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ended::Well,
            Ok(Some(_)) | Err(_) => return Ended::Badly,
            Ok(None) if begin.elapsed() > longest => {
                let _ = child.kill();
                let _ = child.wait();
                return Ended::Not;
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}
