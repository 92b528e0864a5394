//! A result belongs to one program at a time: of two that would write the same, the second is refused before any work.

use super::{Files, TUNING, done, files, identification, put, stages, taut};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use taut::files::Claim;
use tempfile::TempDir;

fn cases() -> Files {
    let mut read = identification("", "", "").read;
    for (name, machine) in [("table4.toml", "table4.toml"), ("pid.toml", "controllers/pid.toml")] {
        read.insert(name.into(), fs::read(stages(machine)).unwrap());
    }
    read
}

/// The error of a command that is refused; it names this process.
#[track_caller]
fn refused(folder: &Path, words: &str) {
    let mut command = taut(folder, &words.split(' ').collect::<Vec<_>>());
    let output = command.stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{words:?}: {told}");
    let process = format!("process {} (", std::process::id());
    assert!(told.contains(&process) && told.contains("is writing this result; nothing was done"), "{words:?}: {told}");
    assert!(told.contains("next: wait until it is done, end it, or name another place"), "{words:?}: {told}");
    if words.contains("--json") {
        let data: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(data["schema"], "taut/error/1", "{words:?}");
    }
}

/// Two sweeps that were started together into one file mixed their rows, and both ended well.
#[test]
fn no_command_writes_what_another_is_writing() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    put(folder.path(), &cases());
    fs::create_dir(at("out")).unwrap();
    symlink("out", at("link")).unwrap();
    symlink("rows.csv", at("rows-link.csv")).unwrap();
    let before = files(folder.path());

    let claim = Claim::folder(at("out"), &["runs.parquet".to_string()]).unwrap();
    for words in [
        "simulate table4.toml --out out",
        "simulate table4.toml --out ./link/../out --json",
        "simulate stages.toml table4.toml --out out",
        "move pid.toml --out link",
        "fit nonlinear.toml --out out",
        "fit nonlinear.toml --compare --out out",
        "fit nonlinear.toml --drift --out out",
        "check nonlinear.toml --out out",
        "design nonlinear.toml --out out",
        "frf nonlinear.toml --out out --json",
        "modes table4.toml --out link",
        "shape table4.toml --out out",
        "show table4.toml --out out",
        "sweep table4.toml --runs 5 --vary all=9% --out out",
        "sweep table4.toml --runs 5 --vary all=9% --out link/runs.parquet",
        "tune pid.toml --out out",
        "export c table4.toml --out out",
        "export fmu table4.toml --out link",
        "paper --out out",
        "man --out link",
    ] {
        refused(folder.path(), words);
    }
    drop(claim);

    let mut claim = Claim::default();
    for name in ["rows.csv", "tuned.toml", "pid.toml", "machine.c", "machine.fmu", "new.toml", "out/runs.parquet"] {
        claim.add(at(name)).unwrap();
    }
    for words in [
        "sweep table4.toml --runs 5 --vary all=9% --out rows.csv",
        "sweep table4.toml --runs 5 --vary all=9% --out ./out/../rows-link.csv --json",
        "sweep table4.toml --runs 5 --vary all=9% --out out",
        "tune pid.toml --out tuned.toml",
        "tune pid.toml --in-place",
        "export c table4.toml --out machine.c",
        "export fmu table4.toml --out link/../machine.fmu",
        "init new.toml",
        "init link/../new.toml --force",
    ] {
        refused(folder.path(), words);
    }
    drop(claim);
    assert!(files(folder.path()) == before, "something was written");
}

fn start(folder: &Path, words: &str) -> Child {
    taut(folder, &words.split(' ').collect::<Vec<_>>()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Of sweeps that begin at one instant each is refused or writes all of its rows; a killed one keeps nobody out.
#[test]
fn sweeps_that_begin_together_write_the_rows_of_one() {
    let sweep = "sweep table4.toml --runs 300 --vary all=20% --quiet --out";
    let alone = TempDir::new().unwrap();
    put(alone.path(), &cases());
    done(alone.path(), &format!("{sweep} rows.csv").split(' ').collect::<Vec<_>>());
    let right = fs::read(alone.path().join("rows.csv")).unwrap();
    for round in 0..3 {
        let folder = TempDir::new().unwrap();
        put(folder.path(), &cases());
        symlink(".", folder.path().join("here")).unwrap();
        let children: Vec<Child> = ["rows.csv", "./rows.csv", "here/rows.csv"]
            .map(|out| start(folder.path(), &format!("{sweep} {out}")))
            .into();
        let ends: Vec<(Option<i32>, String)> = children
            .into_iter()
            .map(|child| child.wait_with_output().unwrap())
            .map(|output| (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()))
            .collect();
        assert!(ends.iter().any(|(code, _)| *code == Some(0)), "{ends:?}");
        for (code, told) in &ends {
            assert!(*code == Some(0) || (*code == Some(1) && told.contains("is writing this result")), "{ends:?}");
        }
        assert!(fs::read(folder.path().join("rows.csv")).unwrap() == right, "round {round}");
        assert!(!files(folder.path()).keys().any(|name| name.contains(".taut.") || name.contains(".parts")));
    }
    let folder = TempDir::new().unwrap();
    put(folder.path(), &cases());
    let long = "sweep table4.toml --runs 100000 --vary all=20% --quiet --out rows.csv";
    let mut first = start(folder.path(), long);
    let (lock, begin) = (folder.path().join(".rows.csv.taut.lock"), Instant::now());
    while !fs::read_to_string(&lock).is_ok_and(|text| text.contains("sweep")) {
        assert!(begin.elapsed() < Duration::from_secs(60), "it never began");
        std::thread::sleep(Duration::from_millis(5));
    }
    let second = start(folder.path(), &format!("{sweep} rows.csv")).wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&second.stderr).into_owned();
    let named = format!("process {} (`", first.id());
    assert!(second.status.code() == Some(1) && told.contains(&named) && told.contains(long), "{told}");
    first.kill().unwrap();
    first.wait().unwrap();
    fs::remove_dir_all(folder.path().join("rows.csv.parts")).unwrap_or_default();
    done(folder.path(), &format!("{sweep} rows.csv").split(' ').collect::<Vec<_>>());
    assert!(fs::read(folder.path().join("rows.csv")).unwrap() == right);
    assert!(!lock.exists());
}

/// A place that does not exist is wrong input for every command: an export said that its work had failed.
#[test]
fn a_folder_that_is_not_there_is_wrong_input() {
    let folder = TempDir::new().unwrap();
    put(folder.path(), &cases());
    for words in [
        "export fmu table4.toml --out new/x.fmu",
        "export c table4.toml --out new/x.c",
        "sweep table4.toml --runs 5 --vary all=9% --out new/rows.csv",
        "init new/axis.toml",
        &format!("tune pid.toml {TUNING} --out new/x.toml"),
        "show table4.toml --out table4.toml/out",
    ] {
        let output =
            taut(folder.path(), &words.split(' ').collect::<Vec<_>>()).stderr(Stdio::piped()).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
        assert!(told.contains("next: "), "{words:?}: {told}");
        assert!(!folder.path().join("new").exists(), "{words:?}");
    }
}

/// `simulate --out` twice, with a private file and a link between: the file was open to all, the link gone.
#[test]
fn results_keep_links_and_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().unwrap();
    put(folder.path(), &cases());
    let words = ["simulate", "table4.toml", "--out", "out", "--no-report"];
    done(folder.path(), &words);
    let (summary, case) = (folder.path().join("out/summary.json"), folder.path().join("out/case.toml"));
    fs::set_permissions(&summary, fs::Permissions::from_mode(0o600)).unwrap();
    fs::rename(&case, folder.path().join("elsewhere.toml")).unwrap();
    symlink("../elsewhere.toml", &case).unwrap();
    done(folder.path(), &[&words[..], &["--set", "cart.mass=0.5"]].concat());
    assert_eq!(fs::metadata(&summary).unwrap().permissions().mode() & 0o777, 0o600);
    assert!(fs::symlink_metadata(&case).unwrap().is_symlink());
    assert!(!fs::read_to_string(folder.path().join("elsewhere.toml")).unwrap().contains("0.362 kg"));
    assert_eq!(Command::new("ls").arg(folder.path().join("out")).output().unwrap().status.code(), Some(0));
}
