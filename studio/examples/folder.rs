//! Writes the page as a folder for a server of static files: `cargo xtask web` runs this, and adds the module.

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: folder FOLDER");
        return ExitCode::from(2);
    };
    for (name, content) in taut_studio::page_without_server() {
        if let Err(error) = std::fs::write(folder.join(name), content) {
            eprintln!("{} cannot be written: {error}", folder.join(name).display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
