//! `taut init`: a case file to start from.

use crate::args::Init;
use crate::failure::{Failure, Outcome, Status};
use crate::terminal;
use taut::Error;
use taut::case::TEMPLATE;
use taut::files::write_atomically;

/// Writes the template.
pub fn run(args: &Init) -> Outcome {
    let file = &args.file;
    if file.is_dir() {
        let inside = file.join("axis.toml");
        return Err(Error::new("this is a folder")
            .in_file(file)
            .next(format!("name a file: {}", inside.display()))
            .into());
    }
    if file.exists() && !args.force {
        let error = Error::new("this file exists already, and nothing was written").in_file(file);
        return Err(error.next("choose another name, or replace it with --force").into());
    }
    write_atomically(file, TEMPLATE).map_err(Failure::work)?;
    terminal::show(&format!("wrote {0}\nnext: taut simulate {0} --out results\n", quoted(&file.display().to_string())));
    Ok(Status::Done)
}

/// As one types it in a shell.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:=@~".contains(c);
    if path.chars().all(plain) { path.to_string() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}
