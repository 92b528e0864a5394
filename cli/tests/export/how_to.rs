//! The page on exports: what it shows is done as it stands there.

use super::tools::{are_there, file, python};
use std::fs;
use std::path::Path;
use std::process::Command;

/// A block between two fences: the words behind the first, and the text.
struct Block<'t> {
    words: Vec<&'t str>,
    text: &'t str,
}

fn blocks(section: &str) -> Vec<Block<'_>> {
    let mut all = Vec::new();
    let mut rest = section;
    while let Some((_, behind)) = rest.split_once("\n```") {
        let (words, behind) = behind.split_once('\n').unwrap();
        let (text, after) = behind.split_once("\n```").unwrap();
        all.push(Block { words: words.split_whitespace().collect(), text });
        rest = after;
    }
    all
}

/// The output of the lines of a section.
fn printed(folder: &Path, lines: &str, python: &Path) -> String {
    let taut = assert_cmd::cargo::cargo_bin("taut");
    let mut path = std::ffi::OsString::new();
    for program in [taut.as_path(), python] {
        path.push(program.parent().unwrap());
        path.push(":");
    }
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-e", "-c", lines])
        .current_dir(folder)
        .env("PATH", path)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{lines}: {told}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn every_page_of_use_works_as_it_stands() {
    let page = fs::read_to_string(file("docs/export.md")).unwrap();
    let mut done = 0;
    for section in page.split("\n## ").skip(1) {
        let name = section.lines().next().unwrap();
        let tools: &[&str] = match name {
            "c" => &["gcc"],
            "matlab" => &["octave-cli", "mkoctfile"],
            "st" | "python" | "json" => &[],
            // Exports of another program are tested beside that.
            _ => continue,
        };
        if !are_there(tools) {
            continue;
        }
        let Some(python) = python() else { continue };
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(file("stages"), folder.path().join("stages")).unwrap();
        let blocks = blocks(section);
        for block in &blocks {
            if let [_, name] = block.words[..] {
                fs::write(folder.path().join(name), format!("{}\n", block.text)).unwrap();
            }
        }
        let lines = blocks.iter().find(|block| block.words == ["sh"]).expect("commands");
        let wanted = blocks.iter().find(|block| block.words == ["text"]).expect("what they print");
        let got = printed(folder.path(), lines.text, &python);
        assert_eq!(got.trim_end(), wanted.text, "docs/export.md, {name}");
        done += 1;
    }
    assert!(done > 0 || python().is_none());
}
