//! From the command line to changes of the case, and to where results go.

use crate::args::Sweep as Args;
use std::path::{Path, PathBuf};
use taut::{Error, Result};

/// The command line as changes of the case: what is swept stands in its text, and that repeats it.
pub fn changes(args: &Args) -> Result<Vec<String>> {
    let mut changes = args.changes.clone();
    let mut put = |key: &str, value: Option<String>| {
        if let Some(value) = value {
            changes.push(format!("sweep.{key}={value}"));
        }
    };
    put("runs", args.runs.clone());
    put("design", args.design.clone().map(|design| format!("\"{design}\"")));
    put("seed", args.seed.map(|seed| seed.to_string()));
    put("interval", args.interval.clone());
    put("indices", args.indices.then(|| "true".to_string()));
    for vary in &args.vary {
        let wrong = || {
            Error::new(format!("\"{vary}\" does not say how something varies"))
                .in_file("--vary")
                .next("write KEY=HOW, such as cart.mass=20% or 'belt.stiffness=uniform(15 kN/m, 25 kN/m)'")
        };
        // What is tied has `=` in its name.
        let (key, how) = vary.rsplit_once('=').ok_or_else(wrong)?;
        let (key, how) = (key.trim(), how.trim());
        if key.is_empty() || how.is_empty() || key.contains(['"', '\\']) {
            return Err(wrong());
        }
        put(&format!("vary.\"{key}\""), Some(how.to_string()));
    }
    Ok(changes)
}

/// Where the results go.
pub enum Target {
    Nowhere,
    /// The rows, as Parquet or CSV.
    File(PathBuf),
    /// A folder of rows, summary, case, report and plots.
    Folder(PathBuf),
}

impl Target {
    /// What `--out` says; the folder for it is made.
    pub fn of(args: &Args) -> Result<Self> {
        let Some(out) = &args.out else { return Ok(Self::Nowhere) };
        let ending = out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        match ending.as_deref() {
            Some("csv") | Some("parquet") => {
                if out.is_dir() {
                    return Err(Error::new("this is a folder").in_file(out).next("name a file in it"));
                }
                if !parent.is_dir() {
                    return Err(Error::new(format!("there is no folder {}", parent.display()))
                        .in_file(out)
                        .next("make it first, or name another"));
                }
                if !cfg!(feature = "parquet") && ending.as_deref() == Some("parquet") {
                    return Err(Error::new("this program was built without Parquet").in_file(out).allowed("FILE.csv"));
                }
                Ok(Self::File(out.clone()))
            }
            Some(other) if !out.is_dir() => Err(Error::new(format!("rows are not written as .{other}"))
                .in_file("--out")
                .allowed("FILE.parquet, FILE.csv, or a folder")),
            _ => {
                crate::simulate::folder::Folder::create(out)?;
                Ok(Self::Folder(out.clone()))
            }
        }
    }

    /// The file of the rows.
    pub fn rows(&self) -> Option<PathBuf> {
        match self {
            Self::Nowhere => None,
            Self::File(path) => Some(path.clone()),
            Self::Folder(folder) => {
                Some(folder.join(if cfg!(feature = "parquet") { "runs.parquet" } else { "runs.csv" }))
            }
        }
    }
}

/// A path with something behind its name.
pub fn beside(path: &Path, behind: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(behind);
    path.with_file_name(name)
}
