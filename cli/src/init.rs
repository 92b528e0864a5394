//! `taut init`: a case file to start from.

use crate::args::{Init, KindName};
use crate::failure::{Failure, Outcome, Status};
use crate::terminal;
use taut::Error;
use taut::case::{TEMPLATE, gantry_template};
use taut::files::write_atomically;
use taut::stage::gantry::Routing;

/// Writes the template.
pub fn run(args: &Init) -> Outcome {
    let file = &args.file;
    if file.is_dir() {
        let inside = file.join(if args.kind == KindName::Axis { "axis.toml" } else { "gantry.toml" });
        return Err(Error::new("this is a folder")
            .in_file(file)
            .next(format!("name a file: {}", inside.display()))
            .into());
    }
    if file.exists() && !args.force {
        let error = Error::new("this file exists already, and nothing was written").in_file(file);
        return Err(error.next("choose another name, or replace it with --force").into());
    }
    let text = match args.kind {
        KindName::Axis => TEMPLATE.to_string(),
        KindName::HFrame => gantry_template(Routing::HFrame),
        KindName::CoreXy => gantry_template(Routing::CoreXy),
    };
    write_atomically(file, text).map_err(Failure::work)?;
    terminal::show(&format!("wrote {0}\nnext: taut simulate {0} --out results\n", quoted(&file.display().to_string())));
    Ok(Status::Done)
}

/// As one types it in a shell.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:=@~".contains(c);
    if path.chars().all(plain) { path.to_string() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}
