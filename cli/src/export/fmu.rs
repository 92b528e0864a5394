//! `taut export fmu`.

use crate::args::Export as Args;
use taut::case::Opened;
use taut::export::Exported;
use taut::{Error, Result};

/// The files of a functional mock-up unit; `name` is that of the model.
pub fn make(_args: &Args, _case: &Opened, _name: &str) -> Result<Exported> {
    Err(Error::new("this build of taut carries no FMU").next("export c, and compile it with your importer's wrapper"))
}
