//! A copy of the repository with changes built into it, and its tests.

use super::change::Change;
use crate::cargo;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use std::{fmt, fs};

/// The switch of the changes, and the list of those that were reached.
const SWITCH: &str = r#"//! Which change is turned on, and which ones a test reaches.
use std::io::Write;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

static ON: LazyLock<usize> =
    LazyLock::new(|| std::env::var("TAUT_MUTANT").ok().and_then(|k| k.parse().ok()).unwrap_or(0));
static REACHED: LazyLock<Option<(std::ffi::OsString, Vec<AtomicBool>)>> =
    LazyLock::new(|| Some((std::env::var_os("TAUT_REACHED")?, (0..100_000).map(|_| AtomicBool::new(false)).collect())));

/// True if it is this one.
pub fn on(k: usize) -> bool {
    if let Some((path, reached)) = &*REACHED
        && !reached[k].load(Ordering::Relaxed)
        && !reached[k].swap(true, Ordering::Relaxed)
    {
        let mut file = std::fs::OpenOptions::new().append(true).create(true).open(path).unwrap();
        file.write_all(format!("{k}\n").as_bytes()).unwrap();
    }
    *ON == k
}
"#;

/// The features that the library is built with.
const FEATURES: &str = "json,parquet";

/// The programs of tests: name, arguments of cargo. `lib`, `core`, `case`, `control`, `identify` and
/// `export` are the tests within the crates of the library, `all` those beside it, `hunt`
/// those of the small hunt, `fmu` those of the shared object.
const PROGRAMS: [(&str, &[&str]); 9] = [
    ("lib", &["--package", "taut", "--features", FEATURES, "--lib"]),
    ("core", &["--package", "taut-core", "--lib"]),
    ("case", &["--package", "taut-case", "--lib"]),
    ("control", &["--package", "taut-control", "--lib"]),
    ("identify", &["--package", "taut-identify", "--lib"]),
    ("export", &["--package", "taut-export", "--lib"]),
    ("all", &["--package", "taut", "--features", FEATURES, "--test", "all"]),
    ("hunt", &["--package", "taut-hunt", "--test", "small"]),
    ("fmu", &["--package", "taut-fmu", "--test", "all"]),
];

/// A test takes at most so long without a change; a longer one is left out.
const LONGEST: Duration = Duration::from_secs(120);

/// Memory that a program of tests may take, KiB: a change may make a loop that collects for ever.
const MEMORY: u64 = 12 << 20;

/// The copy.
pub struct Tree {
    root: PathBuf,
}

/// A test of a program.
#[derive(Clone)]
pub struct Test {
    program: &'static str,
    path: PathBuf,
    name: String,
    root: PathBuf,
    /// How long it takes without a change.
    took: Duration,
    /// The changes that it reaches.
    pub reached: BTreeSet<usize>,
}

/// How a test ended.
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
        let library = root.join("core/src/lib.rs");
        let text = fs::read_to_string(&library).map_err(|error| error.to_string())?;
        write(&library, &(text + "\npub mod mutant;\n"))?;
        write(&root.join("core/src/mutant.rs"), SWITCH)?;
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
        command.arg("--message-format=json").current_dir(&self.root);
        command.env("CARGO_TARGET_DIR", "../target").stderr(Stdio::null());
        command
    }

    /// Where the compiler finds errors.
    fn errors(&self) -> Result<Vec<(String, Range<usize>)>, String> {
        let output = self
            .cargo(&["check", "--package", "taut", "--features", FEATURES, "--lib"])
            .output()
            .map_err(|error| format!("cargo cannot be started: {error}"))?;
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

    /// Builds a program of tests; where it is.
    fn program(&self, arguments: &[&str]) -> Result<PathBuf, String> {
        let words: Vec<&str> = ["test", "--no-run"].iter().chain(arguments).copied().collect();
        let output = self.cargo(&words).output().map_err(|error| format!("cargo cannot be started: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let messages = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
        let mut built = messages.filter_map(|message| Some(PathBuf::from(message["executable"].as_str()?)));
        built.next_back().ok_or_else(|| format!("the tests of the copy in {} cannot be built", self.root.display()))
    }

    /// Builds the programs of these names (none: all), and runs each of their tests without a change. The quickest
    /// tests come first.
    pub fn tests(&self, names: &[String]) -> Result<Vec<Test>, String> {
        if let Some(unknown) = names.iter().find(|name| PROGRAMS.iter().all(|(known, _)| known != *name)) {
            return Err(format!(
                "{unknown} is not a program of tests; allowed: {}",
                PROGRAMS.map(|(name, _)| name).join(", ")
            ));
        }
        let mut tests = Vec::new();
        for (program, arguments) in PROGRAMS {
            if names.is_empty() || names.iter().any(|name| name == program) {
                let path = self.program(arguments)?;
                let listed = Command::new(&path).args(["--list", "--format", "terse"]).current_dir(&self.root).output();
                let listed = listed.map_err(|error| format!("{}: {error}", path.display()))?;
                let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
                tests.extend(listed.lines().filter_map(|line| line.strip_suffix(": test")).map(|name| Test {
                    program,
                    path: path.clone(),
                    name: name.into(),
                    root: self.root.clone(),
                    took: LONGEST,
                    reached: BTreeSet::new(),
                }));
            }
        }
        let begin = Instant::now();
        let well = Mutex::new(Vec::new());
        let numbered: Vec<(usize, Test)> = tests.into_iter().enumerate().collect();
        super::side_by_side(&numbered, |(i, test)| {
            let (ended, tried) = test.reach(&self.root.join(format!("reached-{i}")));
            match ended {
                Ended::Well => well.lock().unwrap().push(tried),
                Ended::Badly => println!("{test} fails without any change, and is left out"),
                Ended::Not => println!("{test} takes longer than {} s, and is left out", LONGEST.as_secs()),
            }
        });
        let mut tests = well.into_inner().unwrap();
        tests.sort_by_key(|test| test.took);
        println!("{} tests, run one by one in {:.0} min", tests.len(), begin.elapsed().as_secs_f64() / 60.0);
        Ok(tests)
    }
}

impl Test {
    /// Runs it with one change turned on.
    pub fn run(&self, k: usize) -> Ended {
        let mut command = self.command();
        command.env("TAUT_MUTANT", k.to_string());
        wait(&mut command, 10 * self.took + Duration::from_secs(20))
    }

    /// Runs it without a change; itself with its time and with what it reaches.
    fn reach(&self, list: &Path) -> (Ended, Self) {
        let begin = Instant::now();
        let ended = wait(self.command().env("TAUT_REACHED", list), LONGEST);
        let text = fs::read_to_string(list).unwrap_or_default();
        let reached = text.lines().filter_map(|line| line.parse().ok()).collect();
        (ended, Self { took: begin.elapsed(), reached, ..self.clone() })
    }

    fn command(&self) -> Command {
        let mut command = Command::new("sh");
        let limited = format!("ulimit -v {MEMORY} 2>/dev/null; exec \"$0\" \"$@\"");
        command.args(["-c", &limited]).arg(&self.path).args(["--exact", &self.name, "--test-threads", "1", "--quiet"]);
        command.current_dir(&self.root).env("RUST_BACKTRACE", "0").env("CARGO_MANIFEST_DIR", &self.root);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.program, self.name)
    }
}

fn wait(command: &mut Command, longest: Duration) -> Ended {
    let Ok(mut child) = command.spawn() else { return Ended::Badly };
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
