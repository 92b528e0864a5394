//! Ctrl-C and requests to terminate: each ends any command within a second, at any time, and leaves no temporary file.

use super::{Files, done, files, identification, is_temporary, number, put, stages, taut};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::fs;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Has the command begin with signals as they are by default: a run of tests in the background hands on that SIGINT is
/// ignored, and the tests of Ctrl-C failed there.
pub fn by_default(command: &mut Command) {
    // SAFETY: between fork and exec only `signal` is called, which is async-signal-safe.
    unsafe {
        command.pre_exec(|| {
            for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGXFSZ] {
                libc::signal(signal, libc::SIG_DFL);
            }
            Ok(())
        });
    }
}

fn send(child: &Child, signal: &str) {
    let sent = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).status().unwrap();
    assert!(sent.success());
}

/// Presses Ctrl-C once the command has been at work for a while. It ends within a second, by itself with status 130 or
/// by the signal; of three attempts one has to, for the machine may be busy with other things.
#[track_caller]
fn ends_at_ctrl_c(folder: &Path, words: &str) {
    let took = [0.5, 1.0, 0.3].map(|wait| end_at_ctrl_c(folder, words, wait));
    assert!(took.iter().flatten().any(|took| *took < 1.0), "{words:?} went on for {took:?} s");
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
    ends_at_ctrl_c(folder.path(), "tune pid.toml --out tuned --no-report");
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
        assert!(!told.contains("none of the tried gains of this structure"), "{told}");
    }
}

// ── Any command, at any time ───────────────────────────────────────────────────────────────────

/// Commands that are at work for long, each in the phase that its words say.
fn long_commands() -> Vec<(&'static str, &'static str)> {
    vec![
        ("stiff", "simulate stiff.toml --out out"),
        ("stiff with the general solver", "simulate stiff.toml --out out --solver general"),
        ("a move of hours", "tune pid.toml --evaluate --set move.2.until=15000s"),
        ("a move of hours in closed loop", "move pid.toml --out out --set move.2.until=15000s"),
        ("search of gains", "tune pid.toml --out out"),
        ("search of gains into the case", "tune pid.toml --in-place"),
        ("laws", "fit nonlinear.toml --compare --out out"),
        ("drift", "fit nonlinear.toml --drift --out out"),
        ("search of parameters", "fit nonlinear.toml --out out --set fit.starts=100"),
        ("a check that simulates for minutes", "check silent.toml --out out"),
        ("an experiment", "design nonlinear.toml --out out"),
        ("rows", "sweep table4.toml --runs 200000 --vary all=20% --out rows.csv"),
        ("rows and a report", "sweep table4.toml --runs 200000 --vary all=20% --out out"),
        ("trajectories", "sweep table4.toml --runs 5000 --vary all=20% --trajectories --out rows.csv"),
        ("the paper", "paper --out out --png"),
        ("pictures", "simulate table4.toml --out out --png"),
    ]
}

/// The cases for them.
fn cases() -> Files {
    let mut read = identification("", "", "").read;
    let mut add = |name: &str, text: String| drop(read.insert(name.into(), text.into_bytes()));
    let text = |name: &str| fs::read_to_string(stages(name)).unwrap();
    add("table4.toml", text("table4.toml"));
    add("pid.toml", text("controllers/pid.toml"));
    let stiff = text("table4.toml");
    let radius = stiff.lines().find(|line| line.starts_with("radius")).unwrap().to_string();
    add("stiff.toml", stiff.replace(&radius, "radius = \"194 m\""));
    let silent = text("identification/nonlinear.toml");
    let constant = silent.lines().find(|line| line.starts_with("torque_constant")).unwrap().to_string();
    add("silent.toml", silent.replace(&constant, "torque_constant = \"23e6 N m/A\""));
    read
}

/// `simulate` went on for 3 s, `tune --evaluate` for 6 s, `fit --compare` for minutes, and an interrupted `check` left
/// its hidden folder behind. `TAUT_SIGNALS=20` sends as many to each command instead of 2.
#[test]
fn any_command_ends_within_a_second_of_a_signal_and_leaves_nothing_half_written() {
    let mut random = Pcg64::seed_from_u64(number("TAUT_SEED").unwrap_or(1) << 8 | 40);
    let mut share = move || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let read = cases();
    let (mut ended, mut longest) = (0, 0.0_f64);
    for (what, words) in long_commands() {
        for k in 0..number("TAUT_SIGNALS").unwrap_or(2) {
            let (name, number) = [("INT", 2), ("TERM", 15)][k as usize % 2];
            let mut took = Vec::new();
            // Of three attempts one has to, for the machine may be busy with other things.
            for _ in 0..3 {
                let folder = TempDir::new().unwrap();
                put(folder.path(), &read);
                let mut child = taut(folder.path(), &words.split(' ').collect::<Vec<_>>()).spawn().unwrap();
                if ends_within(&mut child, Duration::from_secs_f64(0.05 + 2.0 * share() * share())).is_some() {
                    continue;
                }
                send(&child, name);
                let begin = Instant::now();
                let status = ends_within(&mut child, Duration::from_secs(20));
                took.push(begin.elapsed().as_secs_f64());
                let Some(status) = status else {
                    let _ = child.kill();
                    let _ = child.wait();
                    continue;
                };
                // Before it listens the signal itself ends it; or it was done already.
                let is_ended = status.code() == Some(128 + number) || status.signal() == Some(number);
                assert!(is_ended || matches!(status.code(), Some(0 | 1)), "{what}, {name}: {status}");
                check_left(folder.path(), &read, &format!("{what}, {name}"));
                if took.last().is_some_and(|took| *took < 1.0) {
                    ended += u64::from(is_ended);
                    break;
                }
            }
            assert!(took.is_empty() || took.iter().any(|took| *took < 1.0), "{what}: {words:?} went on for {took:?} s");
            longest = took.iter().fold(longest, |a, b| a.max(*b));
        }
    }
    println!("{ended} were ended by a signal, the last after {longest:.2} s");
    assert!(ended > 5, "{ended} were still at work");
}

/// Every file that was there is as it was, and what is new is under a name of its own, but for the parts of a sweep; no
/// folder is empty.
#[track_caller]
fn check_left(folder: &Path, read: &Files, what: &str) {
    let left = files(folder);
    for (name, bytes) in read {
        assert!(left.get(name) == Some(bytes), "{what}: {name} is not as it was");
    }
    let temporary: Vec<&String> = left.keys().filter(|name| is_temporary(name) && !name.contains(".parts/")).collect();
    assert!(temporary.is_empty(), "{what}: {temporary:?} are left");
    assert!(!left.contains_key("out/unfinished.txt"), "{what}");
    if folder.join("out").is_dir() {
        assert!(left.keys().any(|name| name.starts_with("out/")), "{what}: an empty folder is left");
        // What was kept is on the list.
        assert!(left.contains_key("out/files.json") || left.keys().any(|name| name.contains(".parts/")), "{what}");
    }
}

/// Under `nohup`, or in the background of a script, Ctrl-C is not meant for the program. A request to terminate is.
#[test]
fn a_signal_that_is_ignored_stays_ignored() {
    let read = cases();
    for words in [
        "fit nonlinear.toml --compare --out out",
        "check silent.toml --out out",
        "sweep table4.toml --runs 200000 --vary all=20% --out rows.csv",
        "tune pid.toml --out out",
        "simulate stiff.toml --out out --set experiment.0.every=1000s",
    ] {
        let folder = TempDir::new().unwrap();
        put(folder.path(), &read);
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' INT; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_taut")]).args(words.split(' '));
        command.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        if ends_within(&mut child, Duration::from_millis(400)).is_some() {
            continue;
        }
        send(&child, "INT");
        let status = ends_within(&mut child, Duration::from_millis(900));
        assert!(status.is_none_or(|status| matches!(status.code(), Some(0..=2))), "{words:?}: {status:?}");
        if status.is_some() {
            continue;
        }
        send(&child, "TERM");
        let begin = Instant::now();
        let Some(status) = ends_within(&mut child, Duration::from_secs(20)) else { panic!("{words:?} went on") };
        assert!(matches!(status.code(), Some(0 | 1 | 143)), "{words:?}: {status}");
        assert!(begin.elapsed().as_secs_f64() < 3.0, "{words:?} went on for {:?}", begin.elapsed());
    }
}

/// A pipe that nobody writes to held a command for ever.
#[test]
fn a_case_or_a_log_that_is_a_pipe_is_refused() {
    let folder = TempDir::new().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let case = fs::read_to_string(stages("identification/nonlinear.toml")).unwrap();
    fs::write(folder.path().join("case.toml"), case.replace("logs/5-v-pulse.measured.csv", "pipe")).unwrap();
    for (words, told) in [
        ("show pipe", "nothing was written to this pipe for 5 s"),
        ("check case.toml", "this is a pipe or a device, not a file"),
        ("init pipe --force", "this is a pipe, a socket or a device, not a file"),
    ] {
        let mut command = taut(folder.path(), &words.split(' ').collect::<Vec<_>>());
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        assert!(ends_within(&mut child, Duration::from_secs(30)).is_some(), "{words:?} went on");
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(2) && error.contains(told) && error.contains("next: "),
            "{words:?}: {error}"
        );
    }
}
