//! `taut export fmu`: the archive, with the shared object that this program carries.

use crate::args::{Export as Args, PartName};
use std::borrow::Cow;
use std::fmt::Write;
use std::path::PathBuf;
use taut::case::Opened;
use taut::export::Exported;
use taut::export::fmu::{self, Archive, BINARY, Causality, Kind, MACHINE, Model, Variability, Version};
use taut::{Error, Result};
use taut_report::{gantry_drawing, png, stage_drawing};

/// `CARRIED`, the shared object, if the build made one; `NOTICES`, the licences of what is in it.
mod carried {
    include!(concat!(env!("OUT_DIR"), "/carried.rs"));
}

const MIT: &str = include_str!("../../../LICENSE-MIT");
const APACHE: &str = include_str!("../../../LICENSE-APACHE");

/// Pixels of the icon for each of the drawing's.
const ICON: f32 = 1.0;

/// The files of a functional mock-up unit; `name` is that of the model.
pub fn make(args: &Args, case: &Opened, name: &str) -> Result<Exported> {
    let version = if args.fmi == Some(2) { Version::Two } else { Version::Three };
    let with_controller = match args.part {
        None | Some(PartName::Plant) => false,
        Some(PartName::Both) => true,
        Some(PartName::Controller) => {
            return Err(Error::new("a controller by itself is no FMU that could be simulated")
                .next("say --part both for the machine with its controller inside, or export st or c"));
        }
    };
    let model = Model::new(case, with_controller)?;
    let object = object()?;
    let (folder, ending) = fmu::platform(version).ok_or_else(|| {
        Error::new(format!("FMI {} has no name for this platform: {}", version.word(), platform()))
            .next("say --fmi 3, or export on another machine")
    })?;
    let mut archive = Archive::new();
    archive.add("modelDescription.xml", fmu::description(&model, version)?.as_bytes())?;
    archive.add(&format!("binaries/{folder}/{BINARY}.{ending}"), &object)?;
    archive.add(MACHINE, model.resource.as_bytes())?;
    archive.add("resources/case.toml", case.text().as_bytes())?;
    let icon = png(&drawing(case), ICON)?;
    archive.add(if version == Version::Two { "model.png" } else { "terminalsAndIcons/icon.png" }, &icon)?;
    archive.add("documentation/index.html", page(&model, version).as_bytes())?;
    for (file, text) in [("license.txt", MIT), ("LICENSE-APACHE.txt", APACHE), ("third-party.txt", carried::NOTICES)] {
        if !text.is_empty() {
            archive.add(&format!("documentation/licenses/{file}"), text.as_bytes())?;
        }
    }
    let facts = facts(&model, version, &format!("{folder}, {} bytes", object.len()));
    let mut notes = vec![format!("it runs on {} alone: that is what this program was built for", platform())];
    if let Some(design) = model.design.as_ref().filter(|design| !design.shaper.is_empty()) {
        notes.push(format!("the shaper of {} impulses is not inside: shape the reference", design.shaper.len()));
    }
    Ok(Exported { files: vec![(format!("{name}.fmu"), archive.finish()?)], facts, notes })
}

fn platform() -> String {
    format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH)
}

/// The shared object: that which the program carries, or of one that is being worked on the one beside it.
fn object() -> Result<Cow<'static, [u8]>> {
    if let Some(bytes) = carried::CARRIED {
        return Ok(Cow::Borrowed(bytes));
    }
    let name = format!("{}{BINARY}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let beside: Vec<PathBuf> = match std::env::current_exe() {
        Ok(program) if cfg!(debug_assertions) => {
            let folder = program.parent().map(PathBuf::from).unwrap_or_default();
            vec![folder.join(&name), folder.join("deps").join(&name)]
        }
        _ => Vec::new(),
    };
    // Of two that lie about, the younger one is that of this program.
    let age = |path: &PathBuf| path.metadata().and_then(|data| data.modified()).ok();
    let found = beside.iter().filter(|path| path.is_file()).max_by_key(|path| age(path));
    let missing = || {
        Error::new("this build of taut carries no shared object for FMUs")
            .next("build it with `cargo build --release --bin taut`, with its feature fmu, from the whole repository")
    };
    let path = found.ok_or_else(missing)?;
    std::fs::read(path).map(Cow::Owned).map_err(|e| Error::new(e.to_string()).in_file(path))
}

fn drawing(case: &Opened) -> String {
    match case {
        Opened::Axis(case) => stage_drawing(&case.stage),
        Opened::Gantry(case) => gantry_drawing(&case.gantry),
    }
}

fn facts(model: &Model, version: Version, binary: &str) -> Vec<(String, String)> {
    let count = |causality: Causality| model.variables.iter().filter(|v| v.causality() == causality).count();
    let named = |causality: Causality| -> String {
        let names = model.variables.iter().filter(|v| v.causality() == causality).map(|v| v.name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    let tunable = model.variables.iter().filter(|v| v.variability() == Variability::Tunable).count();
    let row = |what: &str, value: String| (what.to_string(), value);
    vec![
        row("version of FMI", version.word().into()),
        row("for", "co-simulation and model exchange".into()),
        row("controller inside", model.design.as_ref().map_or("no", |design| design.structure.name()).into()),
        row("inputs", named(Causality::Input)),
        row("outputs", count(Causality::Output).to_string()),
        row("parameters", format!("{}, {tunable} of them tunable", count(Causality::Parameter))),
        row("continuous states", model.quantities.len().to_string()),
        row("event indicators", model.conditions.to_string()),
        row("binary", binary.into()),
    ]
}

/// The page that importers show.
fn page(model: &Model, version: Version) -> String {
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{title}</title></head>\n<body>\n\
         <h1>{title}</h1>\n<p>Made by taut {} for FMI {}. Co-simulation moves the machine exactly within a step of any \
         length; model exchange gives rates, and what is left until a part does something else. \
         resources/case.toml is the case that it was made from.</p>\n",
        env!("CARGO_PKG_VERSION"),
        version.word(),
        title = escaped(&model.title),
    );
    let groups = [("Inputs", Causality::Input), ("Outputs", Causality::Output), ("Parameters", Causality::Parameter)];
    for (heading, causality) in groups {
        let _ =
            write!(text, "<h2>{heading}</h2>\n<table>\n<tr><th>name</th><th>unit</th><th>start</th><th></th></tr>\n");
        for variable in model.variables.iter().filter(|v| v.causality() == causality) {
            let start = variable.start.map(|start| format!("{start}")).unwrap_or_default();
            let unit = if variable.kind == Kind::Whole { "whole number" } else { variable.unit };
            let tunable = if variable.variability() == Variability::Tunable { " Tunable." } else { "" };
            let _ = writeln!(
                text,
                "<tr><td><code>{}</code></td><td>{unit}</td><td>{start}</td><td>{}{tunable}</td></tr>",
                escaped(&variable.name),
                escaped(&variable.description)
            );
        }
        text.push_str("</table>\n");
    }
    text.push_str("</body>\n</html>\n");
    text
}
