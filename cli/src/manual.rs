//! `taut man`, `taut completions` and `taut schema`: the command line for readers and shells, cases and results for
//! editors.

use crate::args::{Args, Completions, Man, Schema};
use crate::failure::{Failure, Outcome, Status};
use crate::folder;
use crate::terminal;
use clap::CommandFactory;
use taut::files::{Batch, Claim, write_atomically};
use taut::{Error, Result, json};

/// Prints a schema, or their names.
pub fn schema(args: &Schema) -> Outcome {
    let Some(name) = &args.name else {
        let wide = json::schemas().map(|(name, _)| name.len()).max().unwrap_or(0);
        let lines = json::schemas().map(|(name, words)| format!("  {name:<wide$}  {words}\n"));
        terminal::show(&format!("taut schema NAME prints one of\n{}", lines.collect::<String>()));
        return Ok(Status::Done);
    };
    let schema = json::schema(name).ok_or_else(|| {
        let names: Vec<&str> = json::schemas().map(|(name, _)| name).collect();
        Error::new(format!("there is no schema \"{name}\"")).in_file("taut schema").allowed(names.join(", "))
    })?;
    terminal::show(&json::text(&schema));
    Ok(Status::Done)
}

/// Prints the completions for a shell.
pub fn completions(args: &Completions) -> Outcome {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "taut", &mut text);
    terminal::show(&String::from_utf8_lossy(&text));
    Ok(Status::Done)
}

/// Prints the manual page of the program; into a folder it writes that of every command.
pub fn run(args: &Man) -> Outcome {
    let mut command = Args::command();
    command.build();
    let Some(folder) = &args.out else {
        terminal::show(&page(&command)?);
        return Ok(Status::Done);
    };
    let _claim = folder::noted(Claim::folder(folder, &[])?);
    let batch = Batch::begin(folder).map_err(Failure::work)?;
    let mut names = vec![write(&batch, "taut", &command).map_err(Failure::work)?];
    for one in command.get_subcommands().filter(|one| one.get_name() != "help") {
        names.push(write(&batch, &format!("taut-{}", one.get_name()), one).map_err(Failure::work)?);
    }
    batch.place(&[]).map_err(Failure::work)?;
    terminal::show(&terminal::wrapped(&format!("wrote in {}:\n  {}\n", folder.display(), names.join("  "))));
    Ok(Status::Done)
}

fn write(batch: &Batch, name: &str, command: &clap::Command) -> Result<String> {
    let file = format!("{name}.1");
    write_atomically(batch.path(&file), page(command)?)?;
    Ok(file)
}

/// The page in troff.
fn page(command: &clap::Command) -> Result<String> {
    let mut text = Vec::new();
    let made = clap_mangen::Man::new(command.clone()).render(&mut text);
    made.map_err(|e| Error::new(format!("the manual page cannot be made: {e}")))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}
