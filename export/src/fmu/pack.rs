//! The archive: description, shared object, sources, resources, documentation.

use super::{Archive, BINARY, Causality, FmiType, MACHINE, Model, Variability, Version};
use super::{description, platform, sources};
use crate::case::Case;
use crate::error::{Error, Result};
use crate::{Exported, Part, controller, shaper_note};
use std::fmt::Write;
use std::path::PathBuf;

const MIT: &str = include_str!("../../LICENSE-MIT");
const APACHE: &str = include_str!("../../LICENSE-APACHE");

/// The parts of an FMU that its case does not give.
#[derive(Debug, Clone, Copy)]
pub struct Carried<'c> {
    /// The shared object for the platform of this build.
    pub object: &'c [u8],
    /// Licences of what is in it.
    pub notices: &'c str,
    /// A drawing of the machine, PNG.
    pub icon: Option<&'c [u8]>,
}

/// The shared object that building the workspace left in one of these folders: of several the youngest. Errors: there
/// is none.
pub fn object_in(folders: &[PathBuf]) -> Result<Vec<u8>> {
    let name = format!("{}{BINARY}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let paths = folders.iter().flat_map(|folder| [folder.join(&name), folder.join("deps").join(&name)]);
    let age = |path: &PathBuf| path.metadata().and_then(|data| data.modified()).ok();
    let found = paths.filter(|path| path.is_file()).max_by_key(age);
    let path = found.ok_or_else(|| {
        Error::new("this build of taut contains no shared object for FMUs")
            .next("build it with `cargo build --release --bin taut`, with its feature fmu, from the whole repository")
    })?;
    std::fs::read(&path).map_err(|e| Error::new(e.to_string()).in_file(path))
}

/// The functional mock-up unit `STEM.fmu` of a case, the controller inside if it is asked for. Errors: what none can be
/// made of, or a platform that the standard has no name for.
pub fn pack(case: &Case, part: Option<Part>, version: Version, stem: &str, carried: &Carried) -> Result<Exported> {
    let with_controller = match part {
        None | Some(Part::Plant) => false,
        Some(Part::Both) => true,
        Some(Part::Controller) => {
            let error = Error::new("a controller by itself is no FMU that could be simulated").in_file("--part");
            return Err(error.next(match controller(case) {
                Ok(_) => "say --part both for the machine with its controller inside, or export st or c",
                Err(_) => "leave --part out for the machine",
            }));
        }
    };
    let model = Model::new(case, with_controller)?;
    let own = format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH);
    let (folder, ending) = platform(version).ok_or_else(|| {
        Error::new(format!("FMI {} has no name for this platform: {own}", version.word()))
            .next("say --fmi 3, or export on another machine")
    })?;
    let sources = sources(&model, version);
    let mut archive = Archive::new();
    archive.add("modelDescription.xml", description(&model, version, sources.is_ok())?.as_bytes())?;
    archive.add(&format!("binaries/{folder}/{BINARY}.{ending}"), carried.object)?;
    archive.add(MACHINE, model.resource.as_bytes())?;
    archive.add("resources/case.toml", case.text.as_bytes())?;
    if let Some(icon) = carried.icon {
        archive.add(if version == Version::Two { "model.png" } else { "terminalsAndIcons/icon.png" }, icon)?;
    }
    archive.add("documentation/index.html", page(&model, version).as_bytes())?;
    for (file, text) in [("license.txt", MIT), ("LICENSE-APACHE.txt", APACHE), ("third-party.txt", carried.notices)] {
        if !text.is_empty() {
            archive.add(&format!("documentation/licenses/{file}"), text.as_bytes())?;
        }
    }
    let platforms = match &sources {
        Ok(files) => {
            for (name, text) in files {
                archive.add(&format!("sources/{name}"), text.as_bytes())?;
            }
            format!("its binary runs on {own}; elsewhere an importer has to compile its sources, for co-simulation")
        }
        Err(error) => format!("it runs on {own} alone, there are no sources in it: {}", error.what),
    };
    let mut notes = vec![platforms];
    notes.extend(model.design.as_ref().and_then(shaper_note));
    let facts = facts(&model, version, sources.is_ok(), &format!("{folder}, {} bytes", carried.object.len()));
    Ok(Exported { files: vec![(format!("{stem}.fmu"), archive.finish()?)], facts, notes })
}

fn facts(model: &Model, version: Version, has_sources: bool, binary: &str) -> Vec<(String, String)> {
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
        row("sources in C", if has_sources { "co-simulation" } else { "none" }.into()),
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
            let unit = if variable.kind == FmiType::Whole { "whole number" } else { variable.unit };
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
