//! A copy of the repository with changes built into it, and its tests.

use super::change::Change;
use crate::cargo;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
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
    reach(k);
    *ON == k
}

/// The second value if it is this one, otherwise the first; reached only where they differ.
pub fn pick(k: usize, was: bool, will: bool) -> bool {
    if was != will {
        reach(k);
    }
    if *ON == k { will } else { was }
}

fn reach(k: usize) {
    if let Some((path, reached)) = &*REACHED
        && !reached[k].load(Ordering::Relaxed)
        && !reached[k].swap(true, Ordering::Relaxed)
    {
        let mut file = std::fs::OpenOptions::new().append(true).create(true).open(path).unwrap();
        file.write_all(format!("{k}\n").as_bytes()).unwrap();
    }
}
"#;

/// Where the switch is declared, and where it stands.
const LIBRARY: &str = "core/src/lib.rs";
const SWITCHES: &str = "core/src/mutant.rs";

/// The programs of tests: name, package, folder of the package, target. `lib`, `core`, `case`, `control`, `identify`
/// and `export` are the tests within the crates of the library, `all` those beside it, `hunt` those of the small hunt,
/// `fmu` those of the shared object, `cli` those of the program `taut`, which hands the switch on.
const PROGRAMS: [(&str, &str, &str, &str); 10] = [
    ("lib", "taut", "", "lib"),
    ("core", "taut-core", "core", "lib"),
    ("case", "taut-case", "case", "lib"),
    ("control", "taut-control", "control", "lib"),
    ("identify", "taut-identify", "identify", "lib"),
    ("export", "taut-export", "export", "lib"),
    ("all", "taut", "", "all"),
    ("hunt", "taut-hunt", "hunt", "small"),
    ("fmu", "taut-fmu", "fmu", "all"),
    ("cli", "taut-cli", "cli", "all"),
];

/// Memory that a program of tests may take, KiB: a change may make a loop that collects for ever.
const MEMORY: u64 = 12 << 20;

/// The copy.
pub struct Tree {
    root: PathBuf,
    /// SHA-256 of the library's source without its tests.
    pub source: String,
}

/// A test of a program.
#[derive(Clone)]
pub struct Test {
    program: &'static str,
    path: PathBuf,
    name: String,
    /// The folder of its package.
    folder: PathBuf,
    /// How long it takes without a change, once that is known.
    pub took: Option<Duration>,
    /// It was ended without a change after this time.
    pub longer_than: Duration,
    /// The changes that it reaches.
    pub reached: BTreeSet<usize>,
}

/// How a test ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ended {
    Well,
    Badly,
    /// It took several times as long as without a change.
    Not,
}

impl Tree {
    /// All files of the repository but those that `build` writes. Files that are there already and do not differ stay
    /// as they are, so that the same changes are not built again.
    pub fn make(drawn: &[Change]) -> Result<Self, String> {
        let here = std::env::current_dir().map_err(|error| error.to_string())?;
        let root = here.join("target/mutants/taut");
        fs::create_dir_all(&root).map_err(|error| format!("target/mutants: {error}"))?;
        // Data that some tests read are not in the list of files.
        #[cfg(unix)]
        if let Ok(data) = here.join("data").canonicalize() {
            let _ = fs::remove_file(root.join("data"));
            let made = std::os::unix::fs::symlink(data, root.join("data"));
            made.map_err(|error| format!("target/mutants: {error}"))?;
        }
        let listed = Command::new("git").args(["ls-files", "-z", "--cached"]).output();
        let listed = listed.map_err(|error| format!("git cannot be started: {error}"))?;
        let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
        let listed: BTreeSet<&str> = listed.split('\0').filter(|name| Path::new(name).is_file()).collect();
        remove_others(&root, &root, &listed)?;
        let changed: BTreeSet<&str> = drawn.iter().map(|change| &*change.file).collect();
        for name in listed.difference(&changed) {
            let mut bytes = fs::read(name).map_err(|error| format!("{name}: {error}"))?;
            if *name == LIBRARY {
                bytes.extend_from_slice(b"\npub mod mutant;\n");
            }
            write(&root.join(name), &bytes)?;
        }
        write(&root.join(SWITCHES), SWITCH.as_bytes())?;
        let source = crate::data::sum(source(&listed)?.as_bytes());
        Ok(Self { root, source })
    }

    /// Builds so many changes of each group in, the first that do not overlap and compile. A file keeps the numbers of
    /// those that do not.
    pub fn build(&self, drawn: &[Change], groups: &[Range<usize>], count: usize) -> Result<Vec<Change>, String> {
        let all: String = drawn.iter().map(|change| change.switched(0)).collect();
        let hash = crate::data::sum(format!("{}{count}{all}", self.source).as_bytes());
        let kept = self.root.with_file_name(format!("refused-{}", &hash[..16]));
        let known = fs::read_to_string(&kept).ok();
        let numbers = |text: &String| text.split_whitespace().filter_map(|k| k.parse().ok()).collect();
        let mut refused: BTreeSet<usize> = known.as_ref().map(numbers).unwrap_or_default();
        loop {
            let mut chosen: Vec<usize> = Vec::new();
            for group in groups {
                let end = chosen.len() + count;
                for k in group.clone().filter(|k| !refused.contains(k)) {
                    let change = &drawn[k];
                    let apart = |other: &usize| {
                        let other = &drawn[*other];
                        other.file != change.file
                            || other.place.end <= change.place.start
                            || change.place.end <= other.place.start
                    };
                    if chosen.len() < end && chosen.iter().all(apart) {
                        chosen.push(k);
                    }
                }
            }
            let places = self.write(drawn, &chosen)?;
            let errors = if known.is_some() { Vec::new() } else { self.errors()? };
            if errors.is_empty() {
                let text: Vec<String> = refused.iter().map(usize::to_string).collect();
                write(&kept, text.join(" ").as_bytes())?;
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
            write(&self.root.join(file), text.as_bytes())?;
        }
        Ok(places)
    }

    fn cargo(&self, words: &[&str]) -> Command {
        let mut command = cargo(words);
        // A folder of its own: cargo would take what it builds here for the repository's.
        command.arg("--message-format=json").current_dir(&self.root);
        command.env("CARGO_TARGET_DIR", "../target").stderr(Stdio::null());
        // Nobody debugs it, and few files stay between two builds.
        command.envs([("CARGO_PROFILE_DEV_DEBUG", "false"), ("CARGO_INCREMENTAL", "0")]);
        command
    }

    /// Where the compiler finds errors.
    fn errors(&self) -> Result<Vec<(String, Range<usize>)>, String> {
        let output = self
            .cargo(&["check", "--package", "taut", "--lib"])
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

    /// Builds the programs of tests and lists the tests of those of these names (none: all).
    pub fn tests(&self, names: &[String]) -> Result<Vec<Test>, String> {
        if let Some(unknown) = names.iter().find(|name| PROGRAMS.iter().all(|(known, ..)| known != *name)) {
            return Err(format!(
                "{unknown} is not a program of tests; allowed: {}",
                PROGRAMS.map(|(name, ..)| name).join(", ")
            ));
        }
        let is_named = |program: &str| names.is_empty() || names.iter().any(|name| name == program);
        // All packages are named whatever is built: they share features, so that the library is built once.
        let mut words = vec!["test", "--no-run"];
        words.extend(PROGRAMS.iter().flat_map(|(_, package, ..)| ["--package", package]));
        for (program, .., target) in PROGRAMS {
            match target {
                _ if !is_named(program) || words.contains(&target) => {}
                "lib" if words.contains(&"--lib") => {}
                "lib" => words.push("--lib"),
                _ => words.extend(["--test", target]),
            }
        }
        let output = self.cargo(&words).output().map_err(|error| format!("cargo cannot be started: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let messages: Vec<serde_json::Value> =
            text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let mut tests = Vec::new();
        for (program, _, folder, target) in PROGRAMS.into_iter().filter(|(program, ..)| is_named(program)) {
            let folder = self.root.join(folder);
            let manifest = folder.join("Cargo.toml");
            let built = messages.iter().find_map(|message| {
                let is_it = message["manifest_path"].as_str().is_some_and(|path| Path::new(path) == manifest)
                    && message["profile"]["test"] == true
                    && (message["target"]["kind"][0] == "test") == (target != "lib");
                is_it.then(|| message["executable"].as_str().map(PathBuf::from))?
            });
            let path = built
                .filter(|_| output.status.success())
                .ok_or_else(|| format!("the tests {program} of the copy in {} cannot be built", self.root.display()))?;
            let listed = Command::new(&path).args(["--list", "--format", "terse"]).current_dir(&folder).output();
            let listed = listed.map_err(|error| format!("{}: {error}", path.display()))?;
            let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
            tests.extend(listed.lines().filter_map(|line| line.strip_suffix(": test")).map(|name| Test {
                program,
                path: path.clone(),
                name: name.into(),
                folder: folder.clone(),
                took: None,
                longer_than: Duration::ZERO,
                reached: BTreeSet::new(),
            }));
        }
        Ok(tests)
    }
}

impl Test {
    /// A test of the program `all`.
    #[cfg(test)]
    pub fn named(name: &str) -> Self {
        Self {
            program: "all",
            path: PathBuf::new(),
            name: name.into(),
            folder: PathBuf::new(),
            took: None,
            longer_than: Duration::ZERO,
            reached: BTreeSet::new(),
        }
    }

    /// Runs it with one change turned on.
    pub fn run(&self, k: usize) -> Ended {
        let took = self.took.unwrap_or_default();
        let mut command = self.command(3 * took + Duration::from_secs(2));
        command.env("TAUT_MUTANT", k.to_string());
        wait(&mut command, 10 * took + Duration::from_secs(30))
    }

    /// Runs it without a change for at most `longest`, and keeps its time, and what it reaches, in a file.
    pub fn reach(&mut self, list: &Path, longest: Duration) -> Ended {
        let _ = fs::remove_file(list);
        let begin = Instant::now();
        let ended = wait(self.command(longest).env("TAUT_REACHED", list), 3 * longest);
        let text = fs::read_to_string(list).unwrap_or_default();
        match ended {
            Ended::Well => self.took = Some(begin.elapsed()),
            Ended::Badly => {}
            Ended::Not => self.longer_than = longest,
        }
        self.reached = text.lines().filter_map(|line| line.parse().ok()).collect();
        ended
    }

    /// The command that runs it, which may use this much time of a processor.
    fn command(&self, longest: Duration) -> Command {
        let mut command = Command::new("sh");
        let seconds = longest.as_secs_f64().ceil();
        let limited = format!("ulimit -v {MEMORY} 2>/dev/null; ulimit -t {seconds}; exec \"$0\" \"$@\"");
        command.args(["-c", &limited]).arg(&self.path).args(["--exact", &self.name, "--test-threads", "1", "--quiet"]);
        command.current_dir(&self.folder).env("RUST_BACKTRACE", "0").env("CARGO_MANIFEST_DIR", &self.folder);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.program, self.name)
    }
}

/// Waits for a command for at most this long; one that the limit of its processor time killed has not ended.
fn wait(command: &mut Command, longest: Duration) -> Ended {
    let Ok(mut child) = command.spawn() else { return Ended::Badly };
    let begin = Instant::now();
    let mut pause = Duration::from_millis(1);
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ended::Well,
            Ok(Some(status)) if is_used_up(status) => return Ended::Not,
            Ok(Some(_)) | Err(_) => return Ended::Badly,
            Ok(None) if begin.elapsed() > longest => {
                let _ = child.kill();
                let _ = child.wait();
                return Ended::Not;
            }
            Ok(None) => {
                std::thread::sleep(pause);
                pause = (2 * pause).min(Duration::from_millis(20));
            }
        }
    }
}

/// True if the system ended a program at its limit of processor time, by SIGXCPU or, beyond it, SIGKILL.
#[cfg(unix)]
fn is_used_up(status: std::process::ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    status.signal().is_some_and(|signal| [signal_hook::consts::SIGXCPU, signal_hook::consts::SIGKILL].contains(&signal))
}

#[cfg(not(unix))]
fn is_used_up(_: std::process::ExitStatus) -> bool {
    false
}

/// The text of the library without its tests, whose changes leave what a test reaches as it is.
fn source(listed: &BTreeSet<&str>) -> Result<String, String> {
    let mut all = String::new();
    for name in listed.iter().filter(|name| name.ends_with(".rs") && !name.ends_with("/tests.rs")) {
        if ["", "core/", "case/", "control/", "identify/", "export/"]
            .iter()
            .any(|folder| name.strip_prefix(folder).is_some_and(|rest| rest.starts_with("src/")))
        {
            let text = fs::read_to_string(name).map_err(|error| format!("{name}: {error}"))?;
            all.push_str(name);
            let tests = ["mod tests {", "pub(crate) mod tests {"].map(|module| format!("\n#[cfg(test)]\n{module}"));
            let end = tests.iter().filter_map(|begin| text.find(begin)).min();
            all.push_str(&text[..end.unwrap_or(text.len())]);
        }
    }
    Ok(all)
}

/// Writes a file that is not there with these bytes.
fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    if fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    let made = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(path, bytes));
    made.map_err(|error| format!("{}: {error}", path.display()))
}

/// Removes files of an earlier copy that are not in the list.
fn remove_others(folder: &Path, root: &Path, listed: &BTreeSet<&str>) -> Result<(), String> {
    for entry in fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?.flatten() {
        let path = entry.path();
        let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => remove_others(&path, root, listed)?,
            Ok(kind) if kind.is_file() && !listed.contains(&*name) && name != SWITCHES => {
                fs::remove_file(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            }
            _ => {}
        }
    }
    Ok(())
}
