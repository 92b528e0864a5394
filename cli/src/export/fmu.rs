//! `taut export fmu`: the archive, with the shared object that this program carries.

use crate::args::Export as Args;
use std::borrow::Cow;
use std::path::PathBuf;
use taut::Result;
use taut::case::Case;
use taut::export::fmu::{Carried, Version, object_in, pack};
use taut::export::{Exported, Part};
use taut_report::{machine_drawing, png};

/// `CARRIED`, the shared object, if the build made one; `NOTICES`, the licences of what is in it.
mod carried {
    include!(concat!(env!("OUT_DIR"), "/carried.rs"));
}

/// Pixels of the icon for each of the drawing's.
const ICON: f32 = 1.0;

/// The files of a functional mock-up unit; `name` is that of the model.
pub fn make(args: &Args, part: Option<Part>, case: &Case, name: &str) -> Result<Exported> {
    let version = if args.fmi == Some(2) { Version::Two } else { Version::Three };
    let object = object()?;
    let icon = png(&drawing(case), ICON)?;
    pack(case, part, version, name, &Carried { object: &object, notices: carried::NOTICES, icon: Some(&icon) })
}

/// The shared object: that which the program carries, or of one that is being worked on the one beside it.
fn object() -> Result<Cow<'static, [u8]>> {
    if let Some(bytes) = carried::CARRIED {
        return Ok(Cow::Borrowed(bytes));
    }
    let beside = match std::env::current_exe() {
        Ok(program) if cfg!(debug_assertions) => program.parent().map(PathBuf::from),
        _ => None,
    };
    object_in(beside.as_slice()).map(Cow::Owned)
}

fn drawing(case: &Case) -> String {
    machine_drawing(&case.machine)
}
