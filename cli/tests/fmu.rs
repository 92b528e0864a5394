//! `taut export fmu`: the archive, and what cannot be exported. What is in it is simulated by `py/tests/test_fmu.py`.

use crate::common::{root, taut_in};
use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;
use taut::export::fmu::{Version, platform};
use tempfile::TempDir;

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";

fn fmu(args: &[&str]) -> Command {
    let mut command = taut_in(root());
    command.args(["export", "fmu"]).args(args);
    command
}

/// Exit status and message of a request that is refused.
fn refused(args: &[&str]) -> (i32, String) {
    let output = fmu(args).output().unwrap();
    assert!(output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stdout));
    (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Names and contents of an archive, by its central directory.
fn unpacked(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let word = |at: usize| usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
    let long = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k])) as usize;
    let end = bytes.len() - 22;
    assert_eq!(&bytes[end..end + 4], b"PK\x05\x06");
    let (count, mut at) = (word(end + 10), long(end + 16));
    let mut files = Vec::new();
    for _ in 0..count {
        assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
        let (method, packed, whole, length, local) =
            (word(at + 10), long(at + 20), long(at + 24), word(at + 28), long(at + 42));
        let name = String::from_utf8(bytes[at + 46..at + 46 + length].to_vec()).unwrap();
        assert_eq!(&bytes[local..local + 4], b"PK\x03\x04");
        let begin = local + 30 + word(local + 26) + word(local + 28);
        let data = &bytes[begin..begin + packed];
        let mut content = Vec::new();
        match method {
            0 => content.extend(data),
            8 => drop(std::io::Read::read_to_end(&mut flate2::read::DeflateDecoder::new(data), &mut content).unwrap()),
            other => panic!("{name} is packed by method {other}"),
        }
        assert_eq!(content.len(), whole, "{name}");
        files.push((name, content));
        at += 46 + length + word(at + 30) + word(at + 32);
    }
    files
}

#[test]
fn the_archive_has_all_that_an_importer_looks_for() {
    let folder = TempDir::new().unwrap();
    for (fmi, version, icon) in [("3", Version::Three, "terminalsAndIcons/icon.png"), ("2", Version::Two, "model.png")]
    {
        let out = folder.path().join(format!("axis-{fmi}.fmu"));
        let output = fmu(&[TABLE4, "--fmi", fmi, "--json", "--out", out.to_str().unwrap()]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((told["target"].as_str(), told["facts"][0]["value"].as_str()), (Some("fmu"), Some(version.word())));
        let files = unpacked(&fs::read(&out).unwrap());
        let file = |name: &str| files.iter().find(|(own, _)| own == name).map(|(_, content)| &content[..]);
        let (place, ending) = platform(version).unwrap();
        let object = file(&format!("binaries/{place}/taut_fmu.{ending}")).unwrap();
        if cfg!(target_os = "linux") {
            assert_eq!(&object[..4], b"\x7fELF");
        }
        assert!(file(icon).unwrap().starts_with(b"\x89PNG"));
        assert_eq!(file("resources/case.toml"), Some(&fs::read(Path::new("..").join(TABLE4)).unwrap()[..]));
        assert!(file("documentation/licenses/license.txt").unwrap().starts_with(b"MIT License"));
        let description = String::from_utf8(file("modelDescription.xml").unwrap().to_vec()).unwrap();
        for wanted in
            ["name=\"command\"", "name=\"cart.mass\"", "unit=\"kg\"", "displayUnit=\"mm\"", "stepSize=\"0.001\""]
        {
            assert!(description.contains(wanted), "{wanted} in\n{description}");
        }
        assert!(description.contains("maxOutputDerivativeOrder=\"7\""), "{description}");
        let compiled = if fmi == "3" { "fmi3.c" } else { "fmi2.c" };
        for name in [compiled, "instance.c", "machine.c", "machine.h"] {
            assert!(file(&format!("sources/{name}")).is_some(), "{name}");
        }
        let told = if fmi == "3" { file("sources/buildDescription.xml").unwrap() } else { description.as_bytes() };
        assert!(String::from_utf8_lossy(told).contains(compiled));
        // One case is one file, to the bit.
        let again = folder.path().join("again.fmu");
        fmu(&[TABLE4, "--fmi", fmi, "--out", again.to_str().unwrap()]).assert().success();
        assert_eq!(fs::read(&out).unwrap(), fs::read(again).unwrap());
    }
}

/// Machines that `export c` does not cover have no sources, and say why.
#[test]
fn what_c_does_not_cover_has_no_sources() {
    let folder = TempDir::new().unwrap();
    for (case, more, why) in [
        ("stages/core-xy/follows.toml", &[][..], "the stiffness of "),
        (
            "stages/sollmann-jouaneh/controllers/pid.toml",
            &["--part", "both"][..],
            "the controller inside is not written in C beside its machine",
        ),
    ] {
        let out = folder.path().join("one.fmu");
        let output = fmu(&[case, "--out", out.to_str().unwrap(), "--json"]).args(more).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let note = told["notes"][0].as_str().unwrap();
        assert!(note.contains("there are no sources in it") && note.contains(why), "{note}");
        let files = unpacked(&fs::read(&out).unwrap());
        assert!(files.iter().all(|(name, _)| !name.starts_with("sources/")));
    }
}

#[test]
fn requests_that_cannot_be_met_say_what_can() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (status, told) = refused(&[&path("none.toml"), "--out", &path("a.fmu")]);
    assert!(status == 2 && told.contains("there is no such file"), "{told}");
    fs::write(path("wrong.toml"), "title = \"axis\n").unwrap();
    let (status, told) = refused(&[&path("wrong.toml"), "--out", &path("a.fmu")]);
    assert!(status == 2 && told.contains("wrong.toml:1"), "{told}");
    let (status, told) = refused(&[TABLE4, "--part", "controller"]);
    assert!(status == 2 && told.contains("a controller by itself is no FMU that could be simulated"), "{told}");
    for case in [TABLE4, "stages/core-xy/core-xy.toml"] {
        let (status, told) = refused(&[case, "--part", "both"]);
        assert!(status == 2 && told.contains("has no controller"), "{told}");
        assert!(told.contains("leave --part out"), "{told}");
    }
    let (status, told) = refused(&[TABLE4, "--fmi", "1"]);
    assert!(status == 2 && told.contains("1 is not in 2..=3"), "{told}");
    // A file stands where the folder would have to be.
    fs::write(path("file"), "").unwrap();
    let (status, told) = refused(&[TABLE4, "--out", &path("file/a.fmu")]);
    assert!(status != 0 && told.starts_with("error: "), "{told}");
    assert!(!Path::new(&path("a.fmu")).exists());
}
