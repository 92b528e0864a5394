//! Faults around a command that writes: it is killed, the disk is full, the folder cannot be written to, somebody
//! presses Ctrl-C. What stood before still stands, and what is new is whole or absent.
//!
//! `TAUT_KILLS=200` kills each command so often instead of 8 times, `TAUT_SEED=2` at other moments.
#![cfg(unix)]

#[path = "faults/claims.rs"]
mod claims;
#[path = "faults/signals.rs"]
mod signals;

pub use signals::by_default;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The files below a folder: their content by their path.
type Files = BTreeMap<String, Vec<u8>>;

fn stages(name: &str) -> String {
    format!("{}/../stages/sollmann-jouaneh/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// How often each command is killed.
const KILLS: u64 = 8;

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

fn taut(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command.args(arguments).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    by_default(&mut command);
    command
}

/// Ends well, or with a result that is not to be relied on.
fn done(folder: &Path, arguments: &[&str]) {
    let output = taut(folder, arguments).stderr(Stdio::piped()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?}: {}: {told}", output.status);
}

fn files(folder: &Path) -> Files {
    let mut found = Files::new();
    gather(folder, "", &mut found);
    found
}

fn gather(folder: &Path, within: &str, found: &mut Files) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = format!("{within}{}", entry.file_name().to_string_lossy());
        match entry.path().is_dir() {
            true => gather(&entry.path(), &format!("{name}/"), found),
            // What is gone meanwhile was a temporary file.
            false => drop(fs::read(entry.path()).map(|bytes| found.insert(name, bytes))),
        }
    }
}

fn put(folder: &Path, files: &Files) {
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

/// Files that a run leaves on purpose while it is not done: those under temporary names, and the parts of a sweep.
fn is_temporary(name: &str) -> bool {
    name.split('/').any(|part| part.starts_with('.') || part.ends_with(".tmp") || part.ends_with(".parts"))
}

/// A command that writes, in the folder of the files that it reads; the second set of words makes it write something
/// else.
struct Writer {
    read: Files,
    words: [Vec<&'static str>; 2],
}

impl Writer {
    fn new(command: &'static str, first: &'static str, second: &'static str) -> Self {
        let words = |more: &'static str| command.split(' ').chain(more.split(' ')).filter(|word| !word.is_empty());
        Self { read: Files::new(), words: [words(first).collect(), words(second).collect()] }
    }

    fn reading(mut self, name: &str, machine: &str) -> Self {
        self.read.insert(name.into(), fs::read(stages(machine)).unwrap());
        self
    }

    /// The folder before and after, when nothing goes wrong; and how long that takes.
    fn whole(&self) -> Whole {
        let folder = TempDir::new().unwrap();
        put(folder.path(), &self.read);
        done(folder.path(), &self.words[0]);
        let before = files(folder.path());
        let mut after = Vec::new();
        let mut took = Duration::ZERO;
        for _ in 0..2 {
            let again = TempDir::new().unwrap();
            put(again.path(), &before);
            let begin = Instant::now();
            done(again.path(), &self.words[1]);
            took = begin.elapsed();
            after.push(files(again.path()));
        }
        let [after, other] = after.try_into().unwrap();
        assert_eq!(after, other, "the same command writes the same files");
        assert!(after != before && !after.keys().any(|name| is_temporary(name)));
        Whole { before, after, took }
    }

    /// Kills it at moments between its beginning and its end. Every file is as it was or as it will be; where some are
    /// the one and some the other, a file says so; and the same command then does its work, and leaves nothing else.
    fn withstands_kills(&self, seed: u64) {
        let whole = self.whole();
        let mut random = Pcg64::seed_from_u64(number("TAUT_SEED").unwrap_or(1) << 8 | seed);
        let (mut killed, mut amid) = (0, 0);
        for k in 0..number("TAUT_KILLS").unwrap_or(KILLS) {
            let folder = TempDir::new().unwrap();
            put(folder.path(), &whole.before);
            let mut child = taut(folder.path(), &self.words[1]).spawn().unwrap();
            // Every second one from the moment on when it begins to write.
            if k % 2 == 1 {
                wait_until(&mut child, || files_differ(folder.path(), &whole.before));
            }
            let share = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
            let longest = if k % 2 == 1 { 0.5 } else { 1.1 };
            std::thread::sleep(whole.took.mul_f64(longest * share * share));
            let _ = child.kill();
            killed += u64::from(child.wait().unwrap().signal() == Some(9));
            let left = files(folder.path());
            let what = format!("{:?}, kill {k}", self.words[1]);
            amid += u64::from(whole.check(&left, &what));
            // A kill after the last write leaves nothing to do; some commands refuse to write over what is there.
            if left == whole.after {
                continue;
            }
            // Parts of a sweep are taken up after each kill; what others leave is the same kind of thing each time.
            if k % 5 != 0 && !left.keys().any(|name| name.contains(".parts/")) {
                continue;
            }
            done(folder.path(), &self.words[1]);
            assert!(
                files(folder.path()) == whole.after,
                "{what}: the same command then leaves {}",
                whole.other(folder.path())
            );
        }
        println!("{:?}: {killed} killed before the end, {amid} with something written", self.words[1]);
        assert!(killed > 0, "no kill came before the end");
    }
}

/// The folder before a command and after it.
struct Whole {
    before: Files,
    after: Files,
    took: Duration,
}

impl Whole {
    /// True if what was left of a command shows that it had begun to write.
    fn check(&self, left: &Files, what: &str) -> bool {
        let lost: Vec<&String> = self.before.keys().filter(|name| !left.contains_key(*name)).collect();
        assert!(lost.is_empty(), "{what}: {lost:?} stood before and is gone");
        let (mut old, mut new, mut marked) = (Vec::new(), Vec::new(), false);
        for (name, bytes) in left.iter().filter(|(name, _)| !is_temporary(name)) {
            let (was, will) = (self.before.get(name), self.after.get(name));
            match (was == Some(bytes), will == Some(bytes)) {
                (true, true) => {}
                (true, false) => old.push(name),
                (false, true) => new.push(name),
                (false, false) if was.is_none() && will.is_none() => marked = true,
                (false, false) => {
                    panic!("{what}: {name} is neither as it was nor as it will be: {} bytes", bytes.len())
                }
            }
        }
        let missing = self.after.keys().any(|name| !left.contains_key(name));
        let mixed = !new.is_empty() && (!old.is_empty() || missing);
        assert!(!mixed || marked, "{what}: {new:?} are new beside {old:?}, and nothing says so");
        marked || !new.is_empty() || left.keys().any(|name| is_temporary(name))
    }

    /// The differences of a folder from its state after the command, in a few words.
    fn other(&self, folder: &Path) -> String {
        let left = files(folder);
        let names: BTreeSet<&String> = left.keys().chain(self.after.keys()).collect();
        let other: Vec<&String> = names.into_iter().filter(|name| left.get(*name) != self.after.get(*name)).collect();
        format!("{other:?}")
    }
}

fn files_differ(folder: &Path, before: &Files) -> bool {
    let now = files(folder);
    now.len() != before.len() || now != *before
}

/// Waits until this is so, or the command is done.
fn wait_until(child: &mut Child, so: impl Fn() -> bool) {
    while child.try_wait().unwrap().is_none() && !so() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

// ── kill -9 ────────────────────────────────────────────────────────────────────────────────────

#[test]
fn init_is_killed() {
    Writer::new("init axis.toml --force", "", "").reading("axis.toml", "table1.toml").withstands_kills_of_init();
}

impl Writer {
    /// Here the file that stands before is another one.
    fn withstands_kills_of_init(self) {
        let template = taut::case::TEMPLATE.as_bytes();
        for k in 0..number("TAUT_KILLS").unwrap_or(KILLS) {
            let folder = TempDir::new().unwrap();
            put(folder.path(), &self.read);
            let mut child = taut(folder.path(), &self.words[0]).spawn().unwrap();
            std::thread::sleep(Duration::from_micros(150 * k));
            let _ = child.kill();
            child.wait().unwrap();
            let left = fs::read(folder.path().join("axis.toml")).unwrap();
            assert!(left == self.read["axis.toml"] || left == template, "after {k}: {} bytes", left.len());
            done(folder.path(), &self.words[0]);
            assert_eq!(files(folder.path()).keys().collect::<Vec<_>>(), ["axis.toml"]);
        }
    }
}

#[test]
fn simulate_is_killed() {
    Writer::new("simulate table4.toml --format csv,parquet --out out", "", "--set cart.mass=0.5")
        .reading("table4.toml", "table4.toml")
        .withstands_kills(1);
}

#[test]
fn move_is_killed() {
    Writer::new("move pid.toml --out out", "", "--set cart.mass=0.5")
        .reading("pid.toml", "controllers/pid.toml")
        .withstands_kills(2);
}

fn identification(command: &'static str, first: &'static str, second: &'static str) -> Writer {
    Writer::new(command, first, second)
        .reading("nonlinear.toml", "identification/nonlinear.toml")
        .reading("logs/5-v-pulse.measured.csv", "identification/logs/5-v-pulse.measured.csv")
        .reading("logs/10-v-pulse.measured.csv", "identification/logs/10-v-pulse.measured.csv")
}

#[test]
fn fit_is_killed() {
    identification("fit nonlinear.toml --out out", "", "--set title=again").withstands_kills(3);
}

#[test]
fn modes_is_killed() {
    Writer::new("modes table4.toml --out out", "", "--set cart.mass=0.5")
        .reading("table4.toml", "table4.toml")
        .withstands_kills(4);
}

#[test]
fn shape_is_killed() {
    Writer::new("shape table4.toml --out out", "", "--set cart.mass=0.5")
        .reading("table4.toml", "table4.toml")
        .withstands_kills(5);
}

#[test]
fn a_sweep_is_killed_and_goes_on_to_the_same_bytes() {
    Writer::new("sweep table4.toml --runs 60 --vary all=20% --threads 2 --out out", "", "--set cart.mass=0.5")
        .reading("table4.toml", "table4.toml")
        .withstands_kills(6);
}

#[test]
fn a_sweep_of_rows_alone_is_killed_and_goes_on_to_the_same_bytes() {
    Writer::new(
        "sweep table4.toml --vary all=20% --threads 2 --quiet",
        "--runs 40 --out old.csv",
        "--runs 400 --out rows.csv",
    )
    .reading("table4.toml", "table4.toml")
    .withstands_kills(7);
}

const TUNING: &str = "--set tune.cost=none --set tune.bandwidth=8Hz --set tune.spread=0 --no-report";

#[test]
fn tune_is_killed() {
    let command = format!("tune pid.toml {TUNING} --out out").leak();
    Writer::new(command, "", "--set tune.damping=0.7").reading("pid.toml", "controllers/pid.toml").withstands_kills(8);
}

/// The plan of a short move, with little to look for.
const PLAN: &str = "plan pid.toml --move fast --no-report --out out";

#[test]
fn plan_is_killed() {
    let set = "--set move.0.name=fast --set tune.spread=0";
    let command = format!("{PLAN} {set}").leak();
    Writer::new(command, "", "--reserve 20%").reading("pid.toml", "controllers/pid.toml").withstands_kills(15);
}

/// Learning from the log of a cart that creeps to its target.
fn learner() -> Writer {
    let command =
        "learn pid-shaped.toml --move fast --set move.0.name=fast --set tune.spread=0 --log trial.csv --out out";
    let mut writer = Writer::new(command, "", "--encoder --position cart_position_m");
    let row = |k: u32| format!("{},{}\n", 1e-3 * f64::from(k), 0.02 * (1.0 - (-20e-3 * f64::from(k)).exp()));
    let rows: String = (0..600).map(row).collect();
    writer.read.insert("trial.csv".into(), format!("time_s,cart_position_m\n{rows}").into_bytes());
    writer.reading("pid-shaped.toml", "controllers/pid-shaped.toml")
}

#[test]
fn learn_is_killed() {
    learner().withstands_kills(16);
}

#[test]
fn tune_in_place_is_killed() {
    let command = format!("tune pid.toml {TUNING} --in-place --anyway").leak();
    Writer::new(command, "", "--set tune.damping=0.7").reading("pid.toml", "controllers/pid.toml").withstands_kills(9);
}

#[test]
fn paper_is_killed() {
    // The paper is the paper: what stands before it is of another program.
    let mut writer = Writer::new("", "init out/axis.toml", "paper --out out");
    writer.read.insert("out/report.html".into(), b"of old".to_vec());
    writer.withstands_kills(10);
}

#[test]
fn check_is_killed() {
    identification("check nonlinear.toml --out out", "", "--set cart.mass=0.5").withstands_kills(11);
}

#[test]
fn show_is_killed() {
    Writer::new("show table4.toml --out out", "", "--set cart.mass=0.5")
        .reading("table4.toml", "table4.toml")
        .withstands_kills(12);
}

#[test]
fn frf_is_killed() {
    identification("frf nonlinear.toml --out out", "", "--set cart.mass=0.5").withstands_kills(13);
}

const DESIGN: &str = "design nonlinear.toml --input trapezoid --duration 0.5s --out out";

#[test]
fn design_is_killed() {
    identification(DESIGN, "", "--set cart.mass=0.5").withstands_kills(14);
}

#[test]
fn exports_are_killed() {
    for (seed, words) in
        ["fmu table4.toml --out machine.fmu", "c table4.toml --out machine.c", "matlab table4.toml --out out"]
            .into_iter()
            .enumerate()
    {
        Writer::new(format!("export {words}").leak(), "", "--set cart.mass=0.5")
            .reading("table4.toml", "table4.toml")
            .withstands_kills(15 + seed as u64);
    }
}

#[test]
fn manual_pages_are_killed() {
    let mut writer = Writer::new("", "init out/axis.toml", "man --out out");
    writer.read.insert("out/taut.1".into(), b"of old".to_vec());
    writer.withstands_kills(18);
}

#[test]
fn tune_into_a_file_is_killed() {
    let command = format!("tune pid.toml {TUNING}").leak();
    Writer::new(command, "--out old.toml", "--out new.toml")
        .reading("pid.toml", "controllers/pid.toml")
        .withstands_kills(19);
}

/// A file saved by the page is the whole new text or the whole old one, and a studio that is started again can save.
#[test]
fn saving_in_the_studio_is_killed() {
    use crate::common::read;
    use crate::studio_client::Studio;
    let mut random = Pcg64::seed_from_u64(number("TAUT_SEED").unwrap_or(1) << 8 | 20);
    let old = read("stages/sollmann-jouaneh/table4.toml");
    let new = old.replace("0.362 kg", "0.5 kg") + &"# a long file\n".repeat(20_000);
    let mut saved = 0;
    for k in 0..number("TAUT_KILLS").unwrap_or(KILLS) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("axis.toml");
        fs::write(&path, &old).unwrap();
        let mut studio = Studio::start(&[path.to_str().unwrap()]);
        studio.page().ask("save", serde_json::json!({ "text": new }));
        std::thread::sleep(Duration::from_micros(random.next_u64() % 8000));
        studio.kill();
        let left = fs::read_to_string(&path).unwrap();
        assert!(left == old || left == new, "kill {k}: {} bytes", left.len());
        saved += usize::from(left == new);
        let next = Studio::start(&[path.to_str().unwrap()]);
        assert!(next.page().result("save", serde_json::json!({ "text": new }))["saved"].is_string(), "kill {k}");
        assert_eq!(files(folder.path()).keys().collect::<Vec<_>>(), ["axis.toml"], "kill {k}");
    }
    println!("{saved} were saved before the kill");
}

// ── A disk that is full, a folder that is read-only ────────────────────────────────────────────

/// Every command that writes, and the name of what it writes into.
fn writers() -> Vec<(Writer, &'static str)> {
    let words = |command: &str| -> &'static str { command.to_string().leak() };
    let table4 =
        |command: &str| Writer::new(words(command), "", "--set cart.mass=0.5").reading("table4.toml", "table4.toml");
    let pid = |command: &str| {
        Writer::new(words(command), "", "--set cart.mass=0.5").reading("pid.toml", "controllers/pid.toml")
    };
    let logs = |command: &str| identification(words(command), "", "--set title=again");
    let mut manual = Writer::new("", "init out/axis.toml", "man --out out");
    manual.read.insert("out/taut.1".into(), b"of old".to_vec());
    vec![
        (table4("simulate table4.toml --out out"), "out"),
        (pid("move pid.toml --out out"), "out"),
        (logs("fit nonlinear.toml --out out"), "out"),
        (table4("modes table4.toml --out out"), "out"),
        (table4("shape table4.toml --out out"), "out"),
        (table4("sweep table4.toml --runs 200 --vary all=20% --out out"), "out"),
        (pid(&format!("tune pid.toml {TUNING} --out out")), "out"),
        (pid(&format!("tune pid.toml {TUNING} --in-place --anyway")), "."),
        (pid(&format!("{PLAN} --set move.0.name=fast --set tune.spread=0")), "out"),
        (learner(), "out"),
        (logs("check nonlinear.toml --out out"), "out"),
        (table4("show table4.toml --out out"), "out"),
        (logs("frf nonlinear.toml --out out"), "out"),
        (table4("export c table4.toml --out out"), "out"),
        (table4("export c table4.toml --out machine.c"), "."),
        (manual, "out"),
    ]
}

/// A command that fails for want of space or of a right: it says which file and what to do, ends with status 1, or 2
/// where nothing was computed yet, and leaves each file as it was or as it will be, and none of its temporary ones.
#[track_caller]
fn fails_in_order(whole: &Whole, folder: &Path, command: &mut Command, what: &str) {
    let output = command.stderr(Stdio::piped()).output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(matches!(output.status.code(), Some(1 | 2)), "{what}: {}: {told}", output.status);
    assert!(told.starts_with("error: ") && told.contains("next: "), "{what}: {told}");
    let left = files(folder);
    whole.check(&left, what);
    let temporary: Vec<&String> = left.keys().filter(|name| is_temporary(name) && !name.contains(".parts/")).collect();
    assert!(temporary.is_empty(), "{what}: {temporary:?} are left");
}

/// The shell limits how long a file may get: writing beyond fails, as on a full disk.
#[test]
fn a_file_that_cannot_be_written_to_its_end_takes_nobodys_place() {
    for (writer, _) in writers() {
        let whole = writer.whole();
        for blocks in [0, 1, 30] {
            let folder = TempDir::new().unwrap();
            put(folder.path(), &whole.before);
            let mut command = Command::new("sh");
            // The signal that the system sends ended the program without a word.
            let ignored = if blocks == 1 { "trap '' XFSZ; " } else { "" };
            let limit = format!("{ignored}ulimit -f {blocks}; exec \"$0\" \"$@\"");
            command.args(["-c", &limit, env!("CARGO_BIN_EXE_taut")]).args(&writer.words[1]).current_dir(folder.path());
            let fits = whole.after.iter().filter(|(name, bytes)| whole.before.get(*name) != Some(bytes));
            if fits.map(|(_, bytes)| bytes.len()).max() <= Some(512 * blocks) {
                continue;
            }
            let what = format!("{:?} with files of {blocks} blocks", writer.words[1]);
            fails_in_order(&whole, folder.path(), command.stdout(Stdio::null()), &what);
        }
    }
}

/// A file system of its own that is nearly full. It takes the right to mount one, which not every machine gives.
#[test]
fn a_disk_that_is_full_is_told() {
    /// Bytes that it has left.
    const SPARE: usize = 8192;
    let mounts = ["--map-root-user", "--mount", "mount", "-t", "tmpfs", "tmpfs", "/mnt"];
    if !Command::new("unshare").args(mounts).output().is_ok_and(|output| output.status.success()) {
        return crate::ignored::ignored("`unshare --map-root-user --mount` to be allowed");
    }
    for (writer, out) in writers() {
        let whole = writer.whole();
        let size: usize = whole.before.values().map(|bytes| bytes.len().next_multiple_of(4096)).sum();
        let new = whole.after.iter().filter(|(name, bytes)| whole.before.get(*name) != Some(bytes));
        if new.map(|(_, bytes)| bytes.len()).sum::<usize>() <= SPARE {
            continue;
        }
        let folder = TempDir::new().unwrap();
        let standing = TempDir::new().unwrap();
        put(standing.path(), &whole.before);
        // What is left on it is copied off it, for it goes with its name space.
        let left = TempDir::new().unwrap();
        let script = format!(
            "mount -t tmpfs -o size={}k tmpfs . && cd \"$PWD\" && cp -r {}/. . && \"$0\" \"$@\"; status=$?; cp -r . {}; exit $status",
            (size + SPARE) / 1024,
            standing.path().display(),
            left.path().display()
        );
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", &script, env!("CARGO_BIN_EXE_taut")]);
        command.args(&writer.words[1]).current_dir(folder.path()).stdout(Stdio::null());
        let what = format!("{:?} into {out} on a full disk", writer.words[1]);
        fails_in_order(&whole, left.path(), &mut command, &what);
    }
}

/// Root may write anywhere, so it runs the command as somebody else.
#[test]
fn a_folder_that_is_read_only_stays_as_it_is() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let may = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    let program = TempDir::new().unwrap();
    may(program.path(), 0o755);
    let taut = program.path().join("taut");
    let own = Path::new(env!("CARGO_BIN_EXE_taut"));
    if fs::hard_link(own, &taut).is_err() {
        fs::copy(own, &taut).unwrap();
    }
    for (writer, out) in writers() {
        let whole = writer.whole();
        let folder = TempDir::new().unwrap();
        put(folder.path(), &whole.before);
        may(folder.path(), 0o755);
        for name in [out, "out/plots", "."] {
            let path = folder.path().join(name);
            if path.is_dir() {
                may(&path, 0o555);
            }
        }
        let mut command = Command::new(&taut);
        command.args(&writer.words[1]).current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::null());
        if fs::metadata(folder.path()).unwrap().uid() == 0 {
            command.uid(65534).gid(65534);
        }
        fails_in_order(&whole, folder.path(), &mut command, &format!("{:?} read-only", writer.words[1]));
        assert!(files(folder.path()) == whole.before, "{:?}", writer.words[1]);
        for name in [".", out, "out/plots"] {
            let path = folder.path().join(name);
            if path.is_dir() {
                may(&path, 0o755);
            }
        }
    }
}
