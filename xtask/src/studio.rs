//! `cargo xtask drag` measures how quick the studio is, `cargo xtask load` what it bears, `cargo xtask first-fit` the
//! way from an empty page to a fitted model: all with the program as it is released, by the scripts of
//! `report/browser`.

use crate::{browser, cargo, host, web};
use std::path::Path;
use std::process::Command;

pub const DRAG: &str = "cargo xtask drag [--seconds S] [--drags N] [--without-server]";

/// The page of the folder that `cargo xtask web` makes takes the place of the program's.
const WITHOUT_SERVER: &str = "--without-server";

pub const FIRST_FIT: &str = "cargo xtask first-fit [--shots DIR] [--without-server]";

pub const LOAD: &str = "cargo xtask load [--clients N] [--seconds S] [--requests N]";

/// Drags in headless Chromium, and prints the tables of docs/studio.md; fails if a bound is exceeded.
pub fn drag(words: &[&str]) -> Result<(), String> {
    let browser = browser::browser().map_err(|needs| format!("the drags need {needs}"))?;
    let mut node = script("drag.mjs");
    node.arg(browser);
    finish_with_either(node, words)
}

/// From an empty page to the fitted model of another's log, step by step with times.
pub fn first_fit(words: &[&str]) -> Result<(), String> {
    let browser = browser::browser().map_err(|needs| format!("this needs {needs}"))?;
    let mut node = script("first-fit.mjs");
    node.arg(browser);
    finish_with_either(node, words)
}

/// Many clients and requests at once; needs node alone.
pub fn load(words: &[&str]) -> Result<(), String> {
    finish(script("load.mjs"), words)
}

fn script(name: &str) -> Command {
    let mut node = Command::new("node");
    node.arg(Path::new(browser::FOLDER).join(name));
    node
}

/// Runs the script with the program, or with the folder if the words say so.
fn finish_with_either(node: Command, words: &[&str]) -> Result<(), String> {
    let (without, words): (Vec<&str>, Vec<&str>) = words.iter().partition(|word| **word == WITHOUT_SERVER);
    if without.is_empty() {
        return finish(node, &words);
    }
    web::run(&[])?;
    measure(node, &web::default_folder(), &words)
}

/// Builds the program, and runs the script with it and these words.
fn finish(node: Command, words: &[&str]) -> Result<(), String> {
    let built = cargo(&["build", "--release", "--bin", "taut"]).status();
    if !built.is_ok_and(|status| status.success()) {
        return Err("the program cannot be built".into());
    }
    let taut = host::target().join("release").join(format!("taut{}", std::env::consts::EXE_SUFFIX));
    measure(node, &taut, words)
}

fn measure(mut node: Command, studio: &Path, words: &[&str]) -> Result<(), String> {
    match node.arg(studio).args(words).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err("a bound was not held".into()),
        Err(error) => Err(format!("node cannot be started: {error}")),
    }
}
