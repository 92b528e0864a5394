//! Faults around a command that writes: it is killed, the disk is full, the folder cannot be written to, somebody
//! presses Ctrl-C. What stood before still stands, and what is new is whole or absent.
//!
//! `TAUT_KILLS=200` kills each command so often instead of 20 times, `TAUT_SEED=2` at other moments.
#![cfg(unix)]

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The files below a folder: their content by their path.
type Files = BTreeMap<String, Vec<u8>>;

fn stages(name: &str) -> String {
    format!("{}/../stages/sollmann-jouaneh/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

fn taut(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command.args(arguments).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
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

    fn reading(mut self, name: &str, stage: &str) -> Self {
        self.read.insert(name.into(), fs::read(stages(stage)).unwrap());
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
        for k in 0..number("TAUT_KILLS").unwrap_or(20) {
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
    /// Whether what was left of a command shows that it had begun to write.
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
        for k in 0..number("TAUT_KILLS").unwrap_or(20) {
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
    identification("fit nonlinear.toml --out out", "", "--set cart.mass=0.5").withstands_kills(3);
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

const TUNING: &str = "--set tune.cost=none --set tune.bandwidth=8Hz --no-report";

#[test]
fn tune_is_killed() {
    let command = format!("tune pid.toml {TUNING} --out out").leak();
    Writer::new(command, "", "--set tune.damping=0.7").reading("pid.toml", "controllers/pid.toml").withstands_kills(8);
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

// ── A disk that is full, a folder that is read-only ────────────────────────────────────────────

/// Every command that writes, and the name of what it writes into.
fn writers() -> [(Writer, &'static str); 8] {
    let table4 = |command| Writer::new(command, "", "--set cart.mass=0.5").reading("table4.toml", "table4.toml");
    let pid = |command: &str| {
        Writer::new(command.to_string().leak(), "", "--set cart.mass=0.5").reading("pid.toml", "controllers/pid.toml")
    };
    [
        (table4("simulate table4.toml --out out"), "out"),
        (pid("move pid.toml --out out"), "out"),
        (identification("fit nonlinear.toml --out out", "", "--set cart.mass=0.5"), "out"),
        (table4("modes table4.toml --out out"), "out"),
        (table4("shape table4.toml --out out"), "out"),
        (table4("sweep table4.toml --runs 200 --vary all=20% --out out"), "out"),
        (pid(&format!("tune pid.toml {TUNING} --out out")), "out"),
        (pid(&format!("tune pid.toml {TUNING} --in-place --anyway")), "."),
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
            let limit = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
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
#[ignore = "mounts a file system: run it where `unshare --map-root-user --mount` is allowed"]
fn a_disk_that_is_full_is_told() {
    for (writer, out) in writers() {
        let whole = writer.whole();
        let size: usize = whole.before.values().map(|bytes| bytes.len().next_multiple_of(4096) + 4096).sum();
        let folder = TempDir::new().unwrap();
        let standing = TempDir::new().unwrap();
        put(standing.path(), &whole.before);
        // What is left on it is copied off it, for it goes with its name space.
        let left = TempDir::new().unwrap();
        let script = format!(
            "mount -t tmpfs -o size={}k tmpfs . && cp -r {}/. . && cd . && cd \"$PWD\" && \"$0\" \"$@\"; status=$?; cp -r . {}; exit $status",
            (size + 8192) / 1024,
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

// ── Ctrl-C ─────────────────────────────────────────────────────────────────────────────────────

/// Presses Ctrl-C once the command has been at work for a while. It ends within a second, by itself with status 130 or
/// by the signal; of three attempts one has to, for the machine may be busy with other things.
#[track_caller]
fn ends_at_ctrl_c(folder: &Path, words: &str) {
    ends_at_ctrl_c_within(folder, words, 1.0);
}

/// The same within so many seconds.
fn ends_at_ctrl_c_within(folder: &Path, words: &str, seconds: f64) {
    let took = [0.5, 1.0, 0.3].map(|wait| end_at_ctrl_c(folder, words, wait));
    assert!(took.iter().flatten().any(|took| *took < seconds), "{words:?} went on for {took:?} s");
}

/// How long it goes on, s; none where it was done before, as a quick machine may be.
#[track_caller]
fn end_at_ctrl_c(folder: &Path, words: &str, wait: f64) -> Option<f64> {
    let words: Vec<&str> = words.split(' ').collect();
    let mut child = taut(folder, &words).spawn().unwrap();
    if ends_within(&mut child, Duration::from_secs_f64(wait)).is_some() {
        return None;
    }
    assert!(Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap().success());
    let begin = Instant::now();
    let Some(status) = ends_within(&mut child, Duration::from_secs(20)) else {
        let _ = child.kill();
        let _ = child.wait();
        return Some(f64::INFINITY);
    };
    let took = begin.elapsed().as_secs_f64();
    if status.success() && took < 1.0 {
        return None;
    }
    assert!(status.code() == Some(130) || status.signal() == Some(2), "{words:?}: {status}");
    Some(took)
}

fn ends_within(child: &mut Child, time: Duration) -> Option<ExitStatus> {
    let begin = Instant::now();
    while begin.elapsed() < time {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    None
}

/// The case with its first run a thousand times longer, and rows as often.
fn long(folder: &Path, name: &str) {
    let text = fs::read_to_string(stages(name)).unwrap();
    let begin = text.find("[[experiment]]").unwrap();
    let run = "[[experiment]]\nname = \"long\"\ninput = { square = \"6 V\", frequency = \"3 Hz\" }\nuntil = \"2000 s\"\nevery = \"10 us\"\n";
    fs::write(folder.join("long.toml"), format!("{}{run}", &text[..begin])).unwrap();
}

#[test]
fn long_runs_end_at_ctrl_c() {
    let folder = TempDir::new().unwrap();
    long(folder.path(), "table4.toml");
    let run = "simulate long.toml --out out --no-report";
    ends_at_ctrl_c(folder.path(), run);
    ends_at_ctrl_c(folder.path(), &format!("{run} --solver general"));
    ends_at_ctrl_c(folder.path(), &format!("{run} --solver table3 --step 10us"));
    ends_at_ctrl_c(
        folder.path(),
        &format!("{run} --set cart.friction.lugre={{stiffness=1e5,damping=10,velocity=1e-3}}"),
    );
    // No row comes out for a long time.
    ends_at_ctrl_c(folder.path(), &format!("{run} --set experiment.0.every=1000s"));
}

/// A machine so stiff that a single row takes minutes did not look up in between. It may also end by itself, as too
/// stiff.
#[test]
fn stiff_runs_end_at_ctrl_c() {
    let folder = TempDir::new().unwrap();
    long(folder.path(), "table4.toml");
    let run = "simulate long.toml --out out --no-report --set experiment.0.every=100s";
    for stiff in [
        "--set cart.mass=1e-9 --set drive_pulley.radius=1e3",
        "--set drive_pulley.radius=1e6",
        "--solver general --set motor.back_emf_constant=1e6",
        "--solver general --set drive_pulley.radius=1e6",
    ] {
        let words = format!("{run} {stiff}");
        let took = [0.5, 1.0, 0.3].map(|wait| end_at_ctrl_c(folder.path(), &words, wait));
        let within = |took: &Option<f64>| took.is_none_or(|took| took < 1.0);
        assert!(took.iter().any(within), "{words:?} went on for {took:?} s");
    }
}

#[test]
fn moves_tuning_sweeps_and_the_paper_end_at_ctrl_c() {
    let folder = TempDir::new().unwrap();
    let pid = fs::read_to_string(stages("controllers/pid.toml")).unwrap();
    fs::write(folder.path().join("pid.toml"), pid).unwrap();
    fs::copy(stages("table4.toml"), folder.path().join("table4.toml")).unwrap();
    ends_at_ctrl_c(folder.path(), "move pid.toml --out out --no-report --set move.0.until=5000s");
    ends_at_ctrl_c(folder.path(), "move pid.toml --out out --no-report --spread 20% --set move.0.until=300s");
    // It runs the moves of the whole family once with what it found: seconds without the release's optimisation.
    ends_at_ctrl_c_within(folder.path(), "tune pid.toml --out tuned --no-report", 10.0);
    ends_at_ctrl_c(folder.path(), "sweep table4.toml --runs 1000000 --vary all=20% --out rows.csv");
    ends_at_ctrl_c(folder.path(), "sweep table4.toml --runs 90000 --vary all=20%");
}

/// A log of 200,000 rows, so that each simulation of a fit takes a while.
#[test]
fn fits_and_posteriors_end_at_ctrl_c() {
    let folder = TempDir::new().unwrap();
    let case = fs::read_to_string(stages("identification/nonlinear.toml")).unwrap();
    let machine = &case[..case.find("[[experiment]]").unwrap()];
    let plan = &case[case.find("[fit]").unwrap()..];
    let run = |input: &str| format!("{machine}[[experiment]]\nname = \"run\"\n{input}\n");
    let input = "input = { square = \"5 V\", frequency = \"1 Hz\" }\nuntil = \"20 s\"\nevery = \"100 us\"";
    fs::write(folder.path().join("truth.toml"), run(input)).unwrap();
    done(folder.path(), &["simulate", "truth.toml", "--out", "out", "--no-report"]);
    let log =
        "log = { file = \"out/run.csv\", time = \"time_s\", input = \"voltage_V\", drive_angle = \"drive_angle_rad\" }";
    fs::write(folder.path().join("case.toml"), run(log) + plan).unwrap();
    let start = "--set cart.friction.viscous=3 --set cart.friction.coulomb=2 --set fit.starts=100";
    ends_at_ctrl_c(folder.path(), &format!("fit case.toml --out fitted --no-report {start}"));
    ends_at_ctrl_c(folder.path(), "fit case.toml --out fitted --no-report --posterior --draws 100000");
    let short = identification("", "", "");
    put(folder.path(), &short.read);
    ends_at_ctrl_c(folder.path(), "fit nonlinear.toml --out fitted --no-report --posterior --draws 1000000");
    ends_at_ctrl_c(folder.path(), &format!("check case.toml {start}"));
}

/// Ended before it had found any gains, `taut tune` said that there are none, as of a wrong case.
#[test]
fn tuning_that_is_ended_early_does_not_say_that_there_are_no_gains() {
    let folder = TempDir::new().unwrap();
    fs::copy(stages("controllers/pid.toml"), folder.path().join("pid.toml")).unwrap();
    for wait in [0.05, 0.1, 0.2, 0.4] {
        let mut command = taut(folder.path(), &["tune", "pid.toml", "--out", "tuned", "--no-report"]);
        let child = command.stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_secs_f64(wait));
        assert!(Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(130) || output.status.signal() == Some(2), "{}: {told}", output.status);
        assert!(!told.contains("no gains of this structure"), "{told}");
    }
}
