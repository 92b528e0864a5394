//! The machines that come with the program.

use crate::Context;
use crate::message::{Reply, Request};
use crate::scene::scene;
use serde_json::{Value, json};
use taut::case::Case;
use taut::error::{Error, Result};
use taut::stages;

/// Their case files, none of which names another file.
const GALLERY: &[&str] = &[
    "sollmann-jouaneh/table4.toml",
    "sollmann-jouaneh/table1.toml",
    "sollmann-jouaneh/table2.toml",
    "printer-axis/printer-axis.toml",
    "laser-gantry/laser-gantry.toml",
    "two-mass/two-mass.toml",
    "pendulepi/pendulepi.toml",
    "sollmann-jouaneh/controllers/pid.toml",
    "h-frame/h-frame.toml",
    "h-frame/follows.toml",
    "h-frame/square.toml",
    "core-xy/core-xy.toml",
    "core-xy/follows.toml",
    "core-xy/square.toml",
    "dual-belt/dual-belt.toml",
    "dual-belt/follows.toml",
    "dual-belt/square.toml",
];

/// All of them: path, title, text, and what their pictures need.
pub fn gallery(_: &Request, _: &Context) -> Result<Reply> {
    let one = |path: &&str| {
        let text = stages::text(path).ok_or_else(|| Error::new("this stage is not bundled").in_file(path))?;
        let case = Case::from_text_with(path, text, &[])?;
        Ok(json!({ "path": path, "title": case.title.as_str(), "text": text, "scene": scene(&case) }))
    };
    let stages = GALLERY.iter().map(one).collect::<Result<Vec<Value>>>()?;
    Ok(Reply::of(json!({ "stages": stages })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_machine_of_the_gallery_is_bundled() {
        for path in GALLERY {
            assert!(stages::text(path).is_some(), "{path}");
        }
    }
}
