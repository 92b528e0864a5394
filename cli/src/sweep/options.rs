//! From the command line to changes of the case, and to where results go.

use crate::args::Sweep as Args;
use crate::common::Common;
use crate::failure::Failure;
use crate::folder::{self, Folder, Target};
use std::path::{Path, PathBuf};
use taut::case::Case;
use taut::files::Inputs;
use taut::{Error, Result};

/// The options with the command line as changes of the case: what is swept stands in its text, and that repeats it.
pub fn with_changes(args: &Args) -> Result<Common> {
    let mut common = args.common.clone();
    let mut put = |key: &str, value: Option<String>| {
        if let Some(value) = value {
            common.changes.push(format!("sweep.{key}={value}"));
        }
    };
    put("runs", args.runs.clone());
    put("design", args.design.clone().map(|design| format!("\"{design}\"")));
    put("seed", args.seed.map(|seed| seed.to_string()));
    put("solver", args.solver.clone().map(|solver| format!("\"{solver}\"")));
    put("interval", args.interval.clone());
    put("indices", args.indices.then(|| "true".to_string()));
    let figures = args.figures.iter().map(|name| format!("{:?}", name.trim())).collect::<Vec<_>>().join(", ");
    put("figures", (!args.figures.is_empty()).then(|| format!("[{figures}]")));
    let mut keys: Vec<&str> = Vec::new();
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
        if keys.contains(&key) {
            return Err(Error::new(format!("{key} varies twice")).in_file("--vary").next("leave one of the two out"));
        }
        keys.push(key);
        put(&format!("vary.\"{key}\""), Some(how.to_string()));
    }
    Ok(common)
}

/// The file of the rows in a folder of results.
const ROWS: &str = if cfg!(feature = "parquet") { "runs.parquet" } else { "runs.csv" };

/// Ending of the folder of the parts, behind the name of the file of the rows.
pub const PARTS: &str = ".parts";

/// Where `--out` says that the results go; the folder for them is made.
pub fn target(args: &Args, case: &Case) -> std::result::Result<Target, Failure> {
    let inputs = folder::inputs(&args.case, &case.files);
    let target = named(args, case, &inputs)?;
    if let Some(rows) = rows(&target) {
        inputs.check(&rows)?;
        inputs.check(&trajectories(&rows))?;
        inputs.check_folder(&beside(&rows, PARTS))?;
    }
    Ok(target)
}

fn named(args: &Args, case: &Case, inputs: &Inputs) -> std::result::Result<Target, Failure> {
    let Some(out) = &args.common.out else { return Ok(Target::Nowhere) };
    let ending = out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match ending.as_deref() {
        Some("csv") | Some("parquet") => {
            if out.is_dir() {
                return Err(Error::new("this is a folder").in_file(out).next("name a file in it").into());
            }
            if !parent.is_dir() {
                return Err(Error::new(format!("there is no folder {}", parent.display()))
                    .in_file(out)
                    .next("make it first, or name another")
                    .into());
            }
            if !cfg!(feature = "parquet") && ending.as_deref() == Some("parquet") {
                let error = Error::new("this program was built without Parquet").in_file(out);
                return Err(error.allowed("FILE.csv").into());
            }
            let mut claim = folder::claim(out)?;
            if args.trajectories {
                claim.add(trajectories(out))?;
            }
            Ok(Target::File(out.clone(), claim))
        }
        Some(other) if !out.is_dir() => Err(Error::new(format!("rows are not written as .{other}"))
            .in_file("--out")
            .allowed("FILE.parquet, FILE.csv, or a folder")
            .into()),
        _ => {
            let report = (!args.common.no_report).then(|| "report.html".to_string());
            let names = [ROWS, "sweep.json", "case.toml"].map(str::to_string).into_iter().chain(report);
            let trajectories = args.trajectories.then(|| trajectories(Path::new(ROWS)).display().to_string());
            let names = names.chain(folder::brought(&case.files).into_values()).chain(trajectories);
            Folder::create(out, inputs.clone(), names).map(Target::Folder)
        }
    }
}

/// The file of the rows.
pub fn rows(target: &Target) -> Option<PathBuf> {
    match target {
        Target::Nowhere => None,
        Target::File(path, _) => Some(path.clone()),
        Target::Folder(folder) => Some(folder.root().join(ROWS)),
    }
}

/// The file of the trajectories, beside that of the rows.
pub fn trajectories(rows: &Path) -> PathBuf {
    let mut name = rows.file_stem().unwrap_or_default().to_os_string();
    name.push("-trajectories.");
    name.push(rows.extension().unwrap_or_default());
    rows.with_file_name(name)
}

/// A path with something behind its name.
pub fn beside(path: &Path, behind: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(behind);
    path.with_file_name(name)
}
