//! `taut export`: a machine, or its controller, in files for other tools.

mod fmu;

use crate::args::{Export as Args, PartName, RealName, TargetName};
use crate::command::Finished;
use crate::common;
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::terminal;
use clap::ValueEnum;
use std::fmt::Write;
use taut::case::{Case, Files};
use taut::export::{self, Destination, Exported, Options, Part, Real, Target};
use taut::files::{Claim, Inputs, write_atomically};
use taut::json;
use taut::{Error, Result};

impl TargetName {
    /// The ending of its main file.
    fn ending(self) -> &'static str {
        match self {
            TargetName::Fmu => "fmu",
            TargetName::C => Target::C.ending(),
            TargetName::St => Target::StructuredText.ending(),
            TargetName::Matlab => Target::Matlab.ending(),
            TargetName::Python => Target::Python.ending(),
            TargetName::Json => "json",
        }
    }

    /// Its word on the command line, and the sentence of the help.
    fn words(self) -> (String, String) {
        let value = self.to_possible_value();
        let told = value.as_ref().and_then(|value| value.get_help()).map(ToString::to_string);
        (value.map(|value| value.get_name().to_string()).unwrap_or_default(), told.unwrap_or_default())
    }
}

/// Reads the case, exports, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let (Some(target), Some(path)) = (args.target, &args.case) else {
        terminal::show(&listing());
        return Ok(Status::Done);
    };
    let common = &args.common;
    check(args, target)?;
    let case = common.open_for(path, Files::All)?;
    let own = match common::is_standard_input(path) {
        true => "axis".to_string(),
        false => path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default(),
    };
    let place = common.out.as_deref().map(|out| Destination::new(out, target.ending(), &own));
    let stem = place.as_ref().map_or(&own, |place| &place.stem);
    let inputs = folder::inputs(path, &case.files);
    let target_at = place.as_ref().map(|place| claimed(place, target, &inputs)).transpose()?;
    let exported = make(args, target, &case, stem).map_err(|error| error.in_file(path))?;
    let mut finished = finished(case.title.as_str(), target, &exported);
    match (&place, target_at) {
        (Some(place), Some(At::File(mut claim))) => {
            let names = exported.files.iter().map(|(name, _)| place.folder.join(name));
            names.into_iter().try_for_each(|name| inputs.check(&name))?;
            let written = place.write(&exported, &inputs, &mut claim).map_err(Failure::work)?;
            finished.written = written.iter().map(|path| path.display().to_string()).collect();
            finished.finish(common, None)
        }
        (Some(_), Some(At::Folder(folder))) => {
            // The model as data is the result as data.
            for (name, content) in exported.files.iter().filter(|_| target != TargetName::Json) {
                write_atomically(folder.path(name), content).map_err(Failure::work)?;
            }
            finished.finish(common, Some(folder))
        }
        _ => finished.finish(common, None),
    }
}

/// Where the files go, claimed.
enum At {
    File(Claim),
    Folder(Folder),
}

/// Claims the place before the work.
fn claimed(place: &Destination, target: TargetName, inputs: &Inputs) -> std::result::Result<At, Failure> {
    let ending = target.ending();
    match place.is_file {
        true => Ok(At::File(folder::noted(place.claim(ending)?))),
        false => {
            let main = format!("{}.{ending}", place.stem);
            Folder::create(&place.folder, inputs.clone(), [main]).map(At::Folder)
        }
    }
}

/// The targets, one line each.
fn listing() -> String {
    let mut text = String::from("taut export NAME CASE --out PATH exports to one of\n");
    for target in TargetName::value_variants() {
        let (name, told) = target.words();
        let _ = writeln!(text, "  {name:<7} {told}");
    }
    text
}

/// Refuses options that belong to another target.
fn check(args: &Args, target: TargetName) -> Result<()> {
    let not_of = |option: &str, of: &str| {
        let (name, _) = target.words();
        Error::new(format!("{option} means nothing to {name}")).allowed(format!("with {of}"))
    };
    if args.real.is_some() && target != TargetName::C {
        return Err(not_of("--real", "c"));
    }
    if args.fmi.is_some() && target != TargetName::Fmu {
        return Err(not_of("--fmi", "fmu"));
    }
    let given = [("--step", args.step), ("--at", args.at), ("--bridge", args.bridge)];
    match given.iter().find(|(_, value)| value.is_some()) {
        Some((option, _)) if !matches!(target, TargetName::C | TargetName::Matlab | TargetName::Python) => {
            Err(not_of(option, "c, matlab and python"))
        }
        _ => Ok(()),
    }
}

/// The files of a target, called `stem`.
fn make(args: &Args, target: TargetName, case: &Case, stem: &str) -> Result<Exported> {
    let part = args.part.map(|part| match part {
        PartName::Plant => Part::Plant,
        PartName::Controller => Part::Controller,
        PartName::Both => Part::Both,
    });
    let real = match args.real {
        Some(RealName::Float) => Real::Float,
        Some(RealName::Double) | None => Real::Double,
    };
    let options = Options { part, real, step: args.step, at: args.at, bridge: args.bridge };
    let of = |target| export::export(case, target, stem, &options);
    match target {
        TargetName::Fmu => fmu::make(args, part, case, stem),
        TargetName::C => of(Target::C),
        TargetName::St => of(Target::StructuredText),
        TargetName::Matlab => of(Target::Matlab),
        TargetName::Python => of(Target::Python),
        TargetName::Json => {
            let text = json::text(&json::export(case)?);
            Ok(Exported { files: vec![(format!("{stem}.json"), text.into_bytes())], ..Exported::default() })
        }
    }
}

/// The result for people and as data.
fn finished(title: &str, target: TargetName, exported: &Exported) -> Finished {
    let (name, told) = target.words();
    let mut text = format!("{}\n{told}\n\n", terminal::bold(title));
    for (file, content) in &exported.files {
        let _ = writeln!(text, "  {file:<42}{} bytes", content.len());
    }
    for (what, value) in &exported.facts {
        let _ = writeln!(text, "  {what:<42}{value}");
    }
    text.push('\n');
    for note in &exported.notes {
        let _ = writeln!(text, "note: {note}");
    }
    let data = match target {
        TargetName::Json => exported.files.first().map(|(_, text)| String::from_utf8_lossy(text).into_owned()),
        _ => None,
    };
    let data = data.unwrap_or_else(|| json::text(&json::exported(title, &name, exported)));
    Finished::new("export", ("export.json", data), text, "add --out PATH for the files")
}
