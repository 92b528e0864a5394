//! Wrong inputs with the messages that they must give, as `tests/bad/README.md` describes them.

use std::collections::HashSet;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A wrong input and its message.
pub struct Wrong {
    /// Name of its section; with an ending, of a file in the same folder.
    pub name: String,
    /// The file: one that exists, or the place where the text stands for one.
    pub path: PathBuf,
    /// The text of a case file; `None` for a file that is read as it is.
    pub text: Option<String>,
    /// The expected message, with a line end.
    pub message: String,
    /// File of its section.
    subject: PathBuf,
    /// Line of its heading, from 0.
    line: usize,
    /// Lines of the message, from 0.
    lines: Range<usize>,
}

impl Wrong {
    /// The bytes that a reader gets.
    pub fn bytes(&self) -> Vec<u8> {
        match &self.text {
            Some(text) => text.clone().into_bytes(),
            None => fs::read(&self.path).unwrap_or_else(|error| panic!("{}: {error}", self.path.display())),
        }
    }

    fn place(&self) -> String {
        format!("{}:{}", self.subject.display(), self.line + 1)
    }
}

/// All wrong inputs of a folder, in the order of their paths. An error names file and line of what is wrong with them.
pub fn read(folder: &Path) -> Result<Vec<Wrong>, String> {
    let (mut all, mut others) = (Vec::new(), Vec::new());
    for path in files(folder)? {
        let is = |ending: &str| path.extension().is_some_and(|extension| extension == ending);
        if is("txt") {
            let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            let base = |name: &str| fs::read_to_string(folder.join(format!("../base/{name}.toml"))).ok();
            all.extend(sections(&path, &text, base)?);
        } else {
            others.push(path);
        }
    }
    all.sort_by(|a, b| a.path.cmp(&b.path));
    if let Some([a, b]) = all.array_windows().find(|[a, b]| a.path == b.path) {
        return Err(format!("{}: `{}` stands at {}, too", b.place(), b.name, a.place()));
    }
    // A file that no section reads would look tested.
    let own: HashSet<&Path> = all.iter().filter(|wrong| wrong.text.is_none()).map(|wrong| &*wrong.path).collect();
    for path in others.iter().filter(|path| !own.contains(path.as_path())) {
        let name = format!("\"{}\"", path.file_name().unwrap_or_default().display());
        if !all.iter().any(|wrong| wrong.text.as_ref().is_some_and(|text| text.contains(&name))) {
            return Err(format!("{}: no section reads this file", path.display()));
        }
    }
    Ok(all)
}

/// The files of a folder in the order of their names.
fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    Ok(files)
}

/// The sections of one file; `base` has the texts that they change.
pub fn sections(subject: &Path, text: &str, base: impl Fn(&str) -> Option<String>) -> Result<Vec<Wrong>, String> {
    let lines: Vec<&str> = text.lines().collect();
    let mut starts: Vec<usize> = (0..lines.len()).filter(|&line| lines[line].starts_with("## ")).collect();
    starts.push(lines.len());
    let common = lines[..starts[0]].iter().find_map(|line| line.strip_prefix("base: "));
    let one = |at: &[usize]| {
        section(subject, &lines, at[0]..at[1], common, &base)
            .map_err(|(line, what)| format!("{}:{}: {what}", subject.display(), line + 1))
    };
    starts.windows(2).map(one).collect()
}

/// The section on these lines; of a mistake, the line and what is wrong.
fn section(
    subject: &Path,
    lines: &[&str],
    Range { start, end }: Range<usize>,
    common: Option<&str>,
    base: impl Fn(&str) -> Option<String>,
) -> Result<Wrong, (usize, String)> {
    let name = &lines[start]["## ".len()..];
    let rule = (start..end).find(|&line| lines[line] == "---");
    let rule = rule.ok_or_else(|| (start, format!("`{name}` has no `---` above its message")))?;
    let path = subject.with_file_name(name);
    let own = lines[start + 1].strip_prefix("base: ");
    let changes = start + 1 + usize::from(own.is_some())..rule;
    let (path, text) = if path.extension().is_some() {
        if start + 1 < rule {
            return Err((start + 1, format!("`{name}` is a file as it is, and has no changes")));
        }
        if !path.exists() {
            return Err((start, format!("there is no file `{name}`")));
        }
        (path, None)
    } else {
        let known = own.or(common).ok_or_else(|| (start, "no `base: NAME` here or above all sections".to_string()))?;
        let base = base(known).ok_or_else(|| (start, format!("there is no base `{known}`")))?;
        let mut text: Vec<String> = base.lines().map(String::from).collect();
        if changes.is_empty() {
            return Err((start, format!("`{name}` changes nothing")));
        }
        for line in changes {
            let before = text.clone();
            change(&mut text, lines[line]).map_err(|what| (line, what))?;
            if text == before {
                return Err((line, format!("`{}` changes nothing", lines[line])));
            }
        }
        (path.with_extension("toml"), Some(text.join("\n") + "\n"))
    };
    let last = (rule + 1..end).rev().find(|&line| !lines[line].is_empty()).unwrap_or(rule);
    Ok(Wrong {
        name: name.into(),
        path,
        text,
        message: lines[rule + 1..=last].join("\n") + "\n",
        subject: subject.into(),
        line: start,
        lines: rule + 1..last + 1,
    })
}

/// Makes one change to the lines of a text.
fn change(text: &mut Vec<String>, line: &str) -> Result<(), String> {
    if let Some(address) = line.strip_prefix("- ") {
        let lines = find(text, address)?;
        text.drain(lines);
        return Ok(());
    }
    if let Some(line) = line.strip_prefix("+ ") {
        insert(text, text.len(), line);
        return Ok(());
    }
    let signs = [" = ", " => ", " + "].map(|sign| Some((line.find(sign)?, sign)));
    let Some((at, sign)) = signs.into_iter().flatten().min() else {
        return Err(format!("`{line}` is none of `KEY = VALUE`, `KEY => LINE`, `KEY + LINE`, `+ LINE`, `- KEY`"));
    };
    let (address, rest) = (&line[..at], &line[at + sign.len()..]);
    match (sign, find(text, address)) {
        (" = ", Ok(lines)) => {
            let (key, _) = text[lines.start].split_once("= ").ok_or_else(|| format!("`{address}` is a table"))?;
            // The columns of what stands above a value are kept.
            text[lines.start] = format!("{key}= {rest}");
        }
        (" = ", Err(what)) => {
            let (lines, key) = splits(address).find_map(|(name, key)| Some((table(text, name)?, key))).ok_or(what)?;
            insert(text, lines.end, &format!("{key} = {rest}"));
        }
        (" => ", lines) => text[lines?.start] = rest.into(),
        (_, lines) => insert(text, lines?.end, rest),
    }
    Ok(())
}

/// Puts a line below the last that is not empty of those before `at`; a header after an empty one.
fn insert(text: &mut Vec<String>, at: usize, line: &str) {
    let at = text[..at].iter().rposition(|line| !line.is_empty()).map_or(0, |last| last + 1);
    text.insert(at, line.into());
    if line.starts_with('[') {
        text.insert(at, String::new());
    }
}

/// The lines of a table such as `cart`, or the line of a key such as `cart.mass`.
fn find(text: &[String], address: &str) -> Result<Range<usize>, String> {
    let is_key = |line: &String, key: &str| line.split_once('=').is_some_and(|(left, _)| left.trim() == key);
    let key = || {
        splits(address).find_map(|(name, key)| {
            let line = table(text, name)?.find(|&line| is_key(&text[line], key))?;
            Some(line..line + 1)
        })
    };
    table(text, address).or_else(key).ok_or_else(|| format!("there is no `{address}`"))
}

/// Table and key that an address can stand for, the longest table first; the table "" has the keys above all headers.
fn splits(address: &str) -> impl Iterator<Item = (&str, &str)> {
    let dots = address.rmatch_indices('.').map(|(dot, _)| (&address[..dot], &address[dot + 1..]));
    dots.chain((!address.contains('.')).then_some(("", address)))
}

/// The lines of a table: header, keys, and the empty lines below.
fn table(text: &[String], name: &str) -> Option<Range<usize>> {
    let is_header = |line: &String| line.starts_with('[');
    let is_wanted = |line: &String| {
        let header = line.split('#').next().unwrap_or_default().trim_end();
        is_header(line) && header.trim_start_matches('[').trim_end_matches(']') == name
    };
    let (start, keys) = match name {
        "" => (0, 0),
        _ => text.iter().position(is_wanted).map(|header| (header, header + 1))?,
    };
    Some(start..text[keys..].iter().position(is_header).map_or(text.len(), |more| keys + more))
}

/// Every wrong input of `folder`, of which there are at least so many, gives exactly its message; `None` is no message.
/// `UPDATE_EXPECT=1` writes the messages anew.
pub fn every_message(folder: &str, least: usize, message: impl Fn(&Wrong) -> Option<String>) {
    let all = read(Path::new(folder)).unwrap_or_else(|what| panic!("{what}"));
    assert!(all.len() >= least, "only {} wrong inputs in {folder}", all.len());
    let mut failures = Vec::new();
    let mut new: Vec<(&Wrong, String)> = Vec::new();
    for wrong in &all {
        match message(wrong).map(|message| message + "\n") {
            None => failures.push(format!("── {}: {}\nwas read without a complaint\n", wrong.place(), wrong.name)),
            Some(got) if got != wrong.message => {
                let expected = &wrong.message;
                failures.push(format!("── {}: {}\nexpected:\n{expected}got:\n{got}", wrong.place(), wrong.name));
                new.push((wrong, got));
            }
            Some(_) => {}
        }
    }
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        failures.retain(|failure| failure.ends_with("without a complaint\n"));
        update(new);
    }
    assert!(failures.is_empty(), "{} messages are not the expected ones:\n{}", failures.len(), failures.join("\n"));
}

/// Writes these messages in place of the old ones.
fn update(mut new: Vec<(&Wrong, String)>) {
    // From the end of each file, so that lines above keep their numbers.
    new.sort_by_key(|(wrong, _)| std::cmp::Reverse(wrong.line));
    for (wrong, message) in new {
        let text = fs::read_to_string(&wrong.subject).unwrap();
        let mut lines: Vec<&str> = text.lines().collect();
        lines.splice(wrong.lines.clone(), message.lines());
        fs::write(&wrong.subject, lines.join("\n") + "\n").unwrap();
    }
}
