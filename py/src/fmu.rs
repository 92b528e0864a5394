//! FMUs: the shared object that a wheel carries.

use std::borrow::Cow;
use std::path::Path;
use taut::case::Case;
use taut::export::fmu::{Carried, Version, object_in, pack};
use taut::export::{Exported, Part};

/// `CARRIED`, the shared object, if the build made one; `NOTICES`, the licences of what is in it.
mod carried {
    include!(concat!(env!("OUT_DIR"), "/carried.rs"));
}

/// The FMU of a case, by FMI 2.0 or 3.0, without an icon: what draws it is a part of the program.
pub fn export(case: &Case, part: Option<Part>, fmi: u32, stem: &str) -> taut::Result<Exported> {
    let version = match fmi {
        2 => Version::Two,
        3 => Version::Three,
        other => return Err(taut::Error::new(format!("there is no FMI {other} here")).allowed("2 or 3")),
    };
    let object = object()?;
    pack(case, part, version, stem, &Carried { object: &object, notices: carried::NOTICES, icon: None })
}

/// The shared object: that which the package carries, or of one that is being worked on what building left beside it.
fn object() -> taut::Result<Cow<'static, [u8]>> {
    match carried::CARRIED {
        Some(bytes) => Ok(Cow::Borrowed(bytes)),
        None => {
            // OUT_DIR is that of this package's build: three folders below that of the profile.
            let built = Path::new(env!("OUT_DIR")).ancestors().nth(3).map(Path::to_path_buf);
            object_in(built.filter(|_| cfg!(debug_assertions)).as_slice()).map(Cow::Owned)
        }
    }
}
