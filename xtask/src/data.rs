//! `cargo xtask data [--from DIR]`: other people's measurements, from a folder or from where they are published, into
//! `data/`.
//!
//! A file is kept only if it is the one that the tests were written with, by its SHA-256; it appears whole or not at
//! all.

mod zip;

use sha2::{Digest, Sha256};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

pub const USAGE: &str = "cargo xtask data [--from DIR]";

/// Where the files go, in the folder that holds the project.
const FOLDER: &str = "data";

/// A file.
#[derive(Debug, Clone)]
pub struct File<'a> {
    /// Its path in `data/`, and in a folder that it is copied from.
    path: &'a str,
    sha256: &'a str,
    /// Where it is published.
    url: &'a str,
    /// The end of its name in the ZIP archive that the address gives; none where the address gives the file itself.
    member: Option<&'a str>,
}

const fn file(path: &'static str, sha256: &'static str, url: &'static str) -> File<'static> {
    File { path, sha256, url, member: None }
}

const CED: &str =
    "https://www.it.uu.se/research/publications/reports/2017-024/CoupledElectricDrivesDataSetAndReferenceModels.zip";

/// All of them. The addresses were put together from repository, commit and path, or from the report's number; what was
/// tried of the download is a server of the tests.
const FILES: [File; 8] = [
    file(
        "pendulepi/february.csv",
        "086c8ae963e554c5e71c58dcf63fef307a9ab5a3fbfa6dd2083fc48ce42c3184",
        "https://raw.githubusercontent.com/francofusco/pendule_pi/f3cec145646bab083ab51dd7ce575ef432170b00/src/bin/identification/logged_motion.csv",
    ),
    file(
        "emps/estimation.mat",
        "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e",
        "https://raw.githubusercontent.com/forgi86/sysid-neural-continuous/956aa7ecd73061b0321c6f6098d74c9e4a7ce67a/examples/EMPS/data/DATA_EMPS.mat",
    ),
    File {
        member: Some("DATAUNIF.csv"),
        ..file("ced/DATAUNIF.csv", "9114f637f22ca826f03f066270cf68bd8cad686739a7fa4b471c14ccdbf66889", CED)
    },
    File {
        member: Some("DATAPRBS.csv"),
        ..file("ced/DATAPRBS.csv", "aa48c6a6e2ea59608460a449ce75add95b572f61ae0f72ce89a64de5606b23b3", CED)
    },
    file(
        "klipper-ender3/resonances_x_20210701_223821.csv",
        "e1caf54b91880b42f39931e8482500e33e6b99b55d91fed18bd8c172337ac0b9",
        "https://raw.githubusercontent.com/bassco/klipper-configs/7c0d9a21996043c801e4890adca9d876ea3adda8/ender3/resonances_x_20210701_223821.csv",
    ),
    file(
        "klipper-ender3/resonances_x_20210821_152037.csv",
        "06f1900722a2d192f95a31929b3cc4a6232e82eb7f8f36e09b200e24dabb717d",
        "https://raw.githubusercontent.com/bassco/klipper-configs/96a66b268c864ea58e47d70902fd0b49aee4cb17/ender3/resonances_x_20210821_152037.csv",
    ),
    file(
        "klipper-ender3/resonances_y_20210630_223910.csv",
        "f348730746578f95bcb9e458b2855cf1d8168add8eb2138d7ebb0dc59bbfc5ab",
        "https://raw.githubusercontent.com/bassco/klipper-configs/40a7f33367b7f04c7a870bb1aa1331f7b4bb9b17/ender3/resonances_y_20210630_223910.csv",
    ),
    file(
        "klipper-ender3/resonances_y_20210630_230110.csv",
        "2bd8f4ea627706e2ad67415abf9064b13d459792536c47aa9ff26a37628eef42",
        "https://raw.githubusercontent.com/bassco/klipper-configs/40a7f33367b7f04c7a870bb1aa1331f7b4bb9b17/ender3/resonances_y_20210630_230110.csv",
    ),
];

/// The state of a file afterwards.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Done {
    There,
    Copied,
    Downloaded,
}

/// Fills `data/`: from this folder, or that of `TAUT_DATA`, or from where the files are published.
pub fn run(words: &[&str]) -> Result<(), String> {
    let from = match *words {
        [] => std::env::var_os("TAUT_DATA").map(PathBuf::from),
        ["--from", folder] => Some(PathBuf::from(folder)),
        _ => return Err(format!("`{}` is not understood\nusage: {USAGE}", words.join(" "))),
    };
    fill(Path::new(FOLDER), &FILES, from.as_deref())
}

/// Fills `data/` before the tests, if `TAUT_DATA` says from where.
pub fn before_tests() -> Result<(), String> {
    if std::env::var_os("TAUT_DATA").is_some() { run(&[]) } else { Ok(()) }
}

/// Brings all files that are not there, and names each that cannot be had.
fn fill(folder: &Path, files: &[File], from: Option<&Path>) -> Result<(), String> {
    let mut failed = Vec::new();
    for file in files {
        match bring(folder, file, from) {
            Ok(Done::There) => println!("data/{}: is there", file.path),
            Ok(Done::Copied) => println!("data/{}: copied", file.path),
            Ok(Done::Downloaded) => println!("data/{}: downloaded", file.path),
            Err(told) => failed.push(format!("data/{}: {told}", file.path)),
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

fn bring(folder: &Path, file: &File, from: Option<&Path>) -> Result<Done, String> {
    let to = folder.join(file.path);
    if fs::read(&to).is_ok_and(|bytes| sum(&bytes) == file.sha256) {
        return Ok(Done::There);
    }
    let (bytes, source, done) = match from {
        Some(from) => {
            let source = from.join(file.path);
            let bytes = fs::read(&source).map_err(|error| format!("{} cannot be read: {error}", source.display()))?;
            (bytes, source.display().to_string(), Done::Copied)
        }
        None => (downloaded(folder, file)?, file.url.to_string(), Done::Downloaded),
    };
    let sum = sum(&bytes);
    if sum != file.sha256 {
        return Err(format!("{source} is another file: its SHA-256 is {sum}, not {}; it was not kept", file.sha256));
    }
    place(&to, &bytes).map_err(|error| format!("cannot be written: {error}"))?;
    Ok(done)
}

/// The file as its address gives it.
fn downloaded(folder: &Path, file: &File) -> Result<Vec<u8>, String> {
    fs::create_dir_all(folder).map_err(|error| format!("{} cannot be made: {error}", folder.display()))?;
    let part = folder.join(format!(".{}.part", file.path.replace('/', "-")));
    let mut curl = Command::new("curl");
    curl.args(["--fail", "--location", "--silent", "--show-error", "--connect-timeout", "30", "--max-time", "600"]);
    curl.args(["--max-filesize", "100000000", "--output"]).arg(&part).arg(file.url);
    let ended = curl.output();
    let bytes = fs::read(&part);
    let _ = fs::remove_file(&part);
    let ended = ended.map_err(|error| format!("curl cannot be started: {error}; {}", by_hand(file)))?;
    if !ended.status.success() {
        let told = String::from_utf8_lossy(&ended.stderr);
        return Err(format!("{} cannot be had: {}; {}", file.url, told.trim(), by_hand(file)));
    }
    let bytes = bytes.map_err(|error| format!("what curl wrote cannot be read: {error}"))?;
    match file.member {
        Some(member) => zip::member(&bytes, member).map_err(|told| format!("{}: {told}", file.url)),
        None => Ok(bytes),
    }
}

fn by_hand(file: &File) -> String {
    format!("fetch it by other means into DIR/{} and say `cargo xtask data --from DIR`", file.path)
}

/// Writes a file beside its place, then gives it its name.
fn place(to: &Path, bytes: &[u8]) -> io::Result<()> {
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent)?;
    }
    let part = to.with_extension("part");
    let placed = fs::write(&part, bytes).and_then(|()| fs::rename(&part, to));
    if placed.is_err() {
        let _ = fs::remove_file(&part);
    }
    placed
}

/// SHA-256, as sha256sum prints it.
pub fn sum(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests;
