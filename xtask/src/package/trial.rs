//! Programs tried as a user would, in empty folders.

use super::{hash, read};
use crate::{output, python, write};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Output of `taut simulate --json` in the folder of a trial.
const RESULTS: &str = "simulate.json";

/// The FMU of a trial.
const UNIT: &str = "axis.fmu";

/// Largest difference between the cart's final position in an FMU and in `taut simulate`, m.
const SAME: f64 = 1e-12;

/// A built program that was tried.
pub struct Program {
    /// Name used here.
    pub name: &'static str,
    pub path: PathBuf,
    /// The folder of its trial.
    pub folder: PathBuf,
    /// Words in front of its path where this machine does not run it by itself.
    runner: Vec<String>,
}

impl Program {
    /// Tries a program in an empty folder `work/tried/name`, without variables of the environment: help, a case file,
    /// results in every form, and exports.
    pub fn tried(name: &'static str, path: PathBuf, runner: Vec<String>, work: &Path) -> Result<Self, String> {
        let folder = work.join("tried").join(name.replace(' ', "-"));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let program = Self { name, path, folder, runner };
        write(&program.folder.join("help.txt"), program.output(&["--help"])?)?;
        program.output(&["init", "axis.toml"])?;
        write(&program.folder.join(RESULTS), program.output(&["simulate", "axis.toml", "--json"])?)?;
        write(&program.folder.join("modes.json"), program.output(&["modes", "axis.toml", "--json"])?)?;
        program.output(&["simulate", "axis.toml", "--out", "rows", "--format", "parquet", "--png"])?;
        for target in ["c", "python", "matlab"] {
            program.output(&["export", target, "axis.toml", "--out", target])?;
        }
        program.output(&["export", "fmu", "axis.toml", "--out", UNIT])?;
        unpack(&program.unit(), &program.folder.join("unit"))?;
        Ok(program)
    }

    /// Runs it in the folder of its trial and returns its output.
    pub fn output(&self, words: &[&str]) -> Result<Vec<u8>, String> {
        let mut before = self.runner.iter().map(String::as_ref).chain([self.path.as_os_str()]);
        let mut command = Command::new(before.next().unwrap_or_default());
        command.args(before).args(words).current_dir(&self.folder).env_clear();
        output(command)
    }

    /// The FMU of the trial.
    pub fn unit(&self) -> PathBuf {
        self.folder.join(UNIT)
    }

    /// The shared object in that FMU.
    pub fn object(&self) -> Result<PathBuf, String> {
        let binaries = crate::book::files(&self.folder.join("unit/binaries"))?;
        binaries.into_iter().next().ok_or_else(|| format!("{} has no shared object", self.unit().display()))
    }

    /// Final position of the cart in the results of the trial, m.
    pub fn final_position(&self) -> Result<f64, String> {
        let file = self.folder.join(RESULTS);
        let result: Value = serde_json::from_slice(&read(&file)?).map_err(|e| format!("{}: {e}", file.display()))?;
        let position = result.pointer("/experiments/0/metrics/final_cart_position_m").and_then(Value::as_f64);
        position.ok_or_else(|| format!("{} has no final position of the cart", file.display()))
    }
}

/// Returns the number of files that two programs wrote alike in their trials. The object of the FMU and the archive
/// that contains it are not compared: they depend on the linker. Errors: files differ.
pub fn same(first: &Program, second: &Program) -> Result<usize, String> {
    let [one, other] = [files(&first.folder)?, files(&second.folder)?];
    let names: BTreeSet<&String> = one.keys().chain(other.keys()).collect();
    let different: Vec<&&String> = names.iter().filter(|name| one.get(**name) != other.get(**name)).collect();
    match &different[..] {
        [] => Ok(one.len()),
        _ => Err(format!("{} and {} write different files: {different:?}", first.name, second.name)),
    }
}

/// Names and hashes of the files of a trial, except the object and the archive that contains it.
fn files(folder: &Path) -> Result<BTreeMap<String, String>, String> {
    let mut found = BTreeMap::new();
    for path in crate::book::files(folder)? {
        let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
        if name != UNIT && !name.starts_with("unit/binaries") {
            found.insert(name, hash(&read(&path)?));
        }
    }
    Ok(found)
}

/// Unpacks a zip archive, which a wheel and an FMU are, into an empty folder.
pub fn unpack(archive: &Path, folder: &Path) -> Result<(), String> {
    let _ = fs::remove_dir_all(folder);
    let mut unpack = Command::new(python::interpreter()?);
    unpack.args(["-m", "zipfile", "-e"]).arg(archive).arg(folder);
    output(unpack).map(drop)
}

/// Simulates an FMU with FMPy and compares it with the results of a program. Returns the difference of the cart's final
/// positions in words. Errors: FMPy finds that the FMU violates the standard, or the difference is too large.
pub fn in_importer(unit: &Path, program: &Program) -> Result<String, String> {
    let environment = python::environment("python", python::REQUIREMENTS)?;
    let mut simulate = Command::new(python::program(&environment, "python"));
    simulate.args(["-c", include_str!("importer.py")]).arg(unit);
    let printed = String::from_utf8_lossy(&output(simulate)?).trim().to_string();
    let position: f64 = printed.parse().map_err(|_| format!("FMPy prints {printed:?} for {}", unit.display()))?;
    let off = (position - program.final_position()?).abs();
    match off <= SAME {
        true => Ok(format!("valid, and its cart ends {off:.1e} m from that of `taut simulate`")),
        false => Err(format!("the cart of {} ends {off:e} m from that of `taut simulate`", unit.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program that was tried and left these files.
    fn left(name: &'static str, files: &[(&str, &str)]) -> Program {
        let folder = std::env::temp_dir().join(format!("taut-xtask-trial-{}-{name}", std::process::id()));
        files.iter().try_for_each(|(file, text)| write(&folder.join(file), text)).unwrap();
        Program { name, path: name.into(), folder, runner: Vec::new() }
    }

    #[test]
    fn a_file_that_differs_or_is_missing_is_named() {
        let common = [("a.csv", "1"), ("unit/binaries/x/o.so", "first")];
        let first = left("first", &[&common[..], &[("b.csv", "2"), (RESULTS, "{}")]].concat());
        let second = left("second", &[("a.csv", "1"), ("unit/binaries/x/o.so", "second"), ("b.csv", "3"), ("c", "")]);
        let told = same(&first, &second).unwrap_err();
        assert!(["b.csv", "\"c\"", RESULTS].iter().all(|name| told.contains(name)) && !told.contains("o.so"), "{told}");
        assert_eq!(same(&first, &first), Ok(3));
        assert!(first.final_position().unwrap_err().ends_with("has no final position of the cart"));
        assert!(first.object().unwrap().ends_with("o.so") && second.final_position().is_err());
        [first, second].iter().for_each(|program| fs::remove_dir_all(&program.folder).unwrap());
    }
}
