//! Links below the examples of a book that lies in a folder of the studio: each opens its case there.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::json;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The studio, from a page of the book.
pub const PAGE: &str = "../index.html";

/// Makes the links.
pub struct Links<'a> {
    program: &'a Path,
    /// A folder in which cases are tried: a link has the text of one file, so that others must not be needed.
    tried: PathBuf,
    known: BTreeMap<String, bool>,
}

impl<'a> Links<'a> {
    /// With a program that tries cases in a folder.
    pub fn new(program: &'a Path, tried: PathBuf) -> Self {
        Self { program, tried, known: BTreeMap::new() }
    }

    /// A page with a link below each block that is a whole case, or whose commands name a case of `stages`.
    pub fn below(&mut self, text: &str) -> Result<String, String> {
        let (mut page, mut block): (String, Option<(&str, Vec<&str>)>) = (String::new(), None);
        for line in text.lines() {
            page += line;
            page.push('\n');
            match (&mut block, line.strip_prefix("```")) {
                (None, Some(language)) => block = Some((language, Vec::new())),
                (Some((_, lines)), None) => lines.push(line),
                (None, None) => {}
                (Some(_), Some(_)) => {
                    let (language, lines) = block.take().unwrap_or_default();
                    if let Some((name, case)) = case_of(language, &lines)
                        && self.opens(&case)?
                    {
                        page += &format!("\n[Open {name} in the studio]({PAGE}{})\n", fragment(&name, &case)?);
                    }
                }
            }
        }
        Ok(page)
    }

    /// True if a text is a case that needs no other file.
    fn opens(&mut self, case: &str) -> Result<bool, String> {
        if let Some(known) = self.known.get(case) {
            return Ok(*known);
        }
        crate::write(&self.tried.join("case.toml"), case)?;
        let mut show = Command::new(self.program);
        show.args(["show", "case.toml"]).current_dir(&self.tried).stdout(Stdio::null());
        let shown = show.output().map_err(|e| format!("{} cannot be started: {e}", self.program.display()))?;
        // `show` does without an experiment whose log is missing; the studio may have no other.
        let opens = shown.status.success() && !String::from_utf8_lossy(&shown.stderr).contains("\" is left out: ");
        self.known.insert(case.to_string(), opens);
        Ok(opens)
    }
}

/// Name and text of the case that a block is about, if it is about one.
fn case_of(language: &str, lines: &[&str]) -> Option<(String, String)> {
    match language {
        "toml" => Some(("this case".into(), lines.join("\n") + "\n")).filter(|(_, text)| text.contains("\n[cart]")),
        "console" | "sh" => {
            let commands =
                lines.iter().map(|line| line.trim_start_matches("$ ")).filter(|line| line.starts_with("taut "));
            let path = commands
                .flat_map(str::split_whitespace)
                .find(|word| word.starts_with("stages/") && word.ends_with(".toml") && !word.contains('*'))?;
            let name = Path::new(path).file_name()?.to_str()?;
            Some((name.to_string(), fs::read_to_string(path).ok()?))
        }
        _ => None,
    }
}

/// Fragment of the page's address as `studio/page/link.js` writes it: JSON, compressed by zlib, in URL-safe base64.
fn fragment(name: &str, case: &str) -> Result<String, String> {
    let name = if name.ends_with(".toml") { name } else { "example.toml" };
    let state = json!({ "text": case, "name": name, "view": "motion" }).to_string();
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(state.as_bytes()).map_err(|e| e.to_string())?;
    Ok(format!("#state={}", letters(&packed.finish().map_err(|e| e.to_string())?)))
}

/// Base64 for addresses (RFC 4648, section 5), without padding.
fn letters(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    let letters_of = |three: &[u8]| {
        let bits = (0..3).fold(0u32, |bits, k| bits << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        let letter = move |k: usize| char::from(LETTERS[(bits >> (18 - 6 * k) & 63) as usize]);
        (0..=three.len()).map(letter).collect::<Vec<char>>()
    };
    bytes.chunks(3).flat_map(letters_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_those_of_the_standard() {
        // RFC 4648, section 10, without padding.
        for (bytes, wanted) in [("", ""), ("f", "Zg"), ("fo", "Zm8"), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(letters(bytes.as_bytes()), wanted);
        }
        assert_eq!(letters(&[0xfb, 0xff]), "-_8");
    }

    #[test]
    fn commands_and_whole_cases_name_a_case() {
        let case = case_of("toml", &["[motor]", "[cart]", "mass = 1"]).unwrap();
        assert_eq!(case.1, "[motor]\n[cart]\nmass = 1\n");
        assert_eq!(case_of("toml", &["[tune]"]), None);
        assert_eq!(case_of("rust", &["[cart]"]), None);
        assert_eq!(case_of("console", &["$ taut fit stages/no-such.toml"]), None);
        assert_eq!(case_of("console", &["$ taut move stages/*.toml"]), None);
    }
}
