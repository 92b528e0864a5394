//! `taut init`: a case file to start from.

use crate::args::{Init, KindName, TemplateName};
use crate::failure::{Failure, Outcome, Status};
use crate::folder;
use crate::terminal;
use taut::Error;
use taut::case::{TEMPLATE, Template, gantry_template};
use taut::files::write_atomically;
use taut::machine::MachineKind;

/// Writes the template.
pub fn run(args: &Init) -> Outcome {
    let file = &args.file;
    if file.is_dir() {
        let inside = file.join(match (args.template, args.kind) {
            (Some(TemplateName::Stage), _) => "stage.toml",
            (Some(TemplateName::Printer | TemplateName::PrinterServo), _) => "printer.toml",
            (None, KindName::Axis) => "axis.toml",
            (Some(TemplateName::Gantry), _) | (None, KindName::HFrame | KindName::CoreXy | KindName::DualBelt) => {
                "gantry.toml"
            }
        });
        return Err(Error::new("this is a folder")
            .in_file(file)
            .next(format!("name a file: {}", inside.display()))
            .into());
    }
    let _claim = folder::claim(file)?;
    if file.exists() && !args.force {
        let error = Error::new("this file exists already, and nothing was written").in_file(file);
        return Err(error.next("choose another name, or replace it with --force").into());
    }
    let template = args.template.map(|name| match name {
        TemplateName::Stage => Template::Stage,
        TemplateName::Printer => Template::Printer,
        TemplateName::PrinterServo => Template::PrinterServo,
        TemplateName::Gantry => Template::Gantry,
    });
    let text = match (template, args.kind) {
        (Some(template), _) => template.text().to_string(),
        (None, KindName::Axis) => TEMPLATE.to_string(),
        (None, KindName::HFrame) => gantry_template(MachineKind::HFrame),
        (None, KindName::CoreXy) => gantry_template(MachineKind::CoreXy),
        (None, KindName::DualBelt) => gantry_template(MachineKind::DualBelt),
    };
    write_atomically(file, text).map_err(Failure::work)?;
    let name = quoted(&file.display().to_string());
    let next =
        if template.is_some() { format!("taut show {name}") } else { format!("taut simulate {name} --out results") };
    terminal::show(&format!("wrote {name}\nnext: {next}\n"));
    Ok(Status::Done)
}

/// As one types it in a shell.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:=@~".contains(c);
    if path.chars().all(plain) { path.to_string() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}
