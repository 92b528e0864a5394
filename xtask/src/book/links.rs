//! Links of the book: those to files outside `docs` lead to copies, and all are checked in the built pages.

use super::{copy_file, files, read};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// Folder of the book with copies of files from outside `docs`.
const COPIES: &str = "repository";

/// Changes the links of a page to files outside `docs` so that they lead to copies in the book, and makes these copies.
///
/// A copy of a Markdown file ends in `.txt`, since mdBook takes `.md` for a page. A link to a folder leads to its
/// `README.md`.
pub fn within(text: &str, pages: &Path) -> Result<String, String> {
    let mut parts = text.split("](../");
    let mut changed = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (link, rest) = part.split_once(')').ok_or("a link has no end")?;
        let path = link.split('#').next().unwrap_or_default();
        let mut file = PathBuf::from(path);
        if file.is_dir() {
            file.push("README.md");
        }
        let name = file.display().to_string();
        let name = name.strip_suffix(".md").map_or(name.clone(), |stem| format!("{stem}.txt"));
        copy_file(&file, &pages.join(COPIES).join(&name))?;
        changed += &format!("]({COPIES}/{name}){rest}");
    }
    Ok(changed)
}

/// Checks every relative link and anchor of the built pages; returns the number of links and the broken ones.
pub fn check(html: &Path) -> Result<(usize, Vec<String>), String> {
    let mut pages = BTreeMap::new();
    for path in files(html)?.into_iter().filter(|path| path.extension().is_some_and(|e| e == "html")) {
        pages.insert(path.clone(), read(&path)?);
    }
    let anchors: BTreeMap<&Path, BTreeSet<&str>> =
        pages.iter().map(|(path, text)| (path.as_path(), values(text, " id=\"").collect())).collect();
    let (mut checked, mut broken) = (0, Vec::new());
    for (path, text) in &pages {
        // One page with all others in it, and one that stands for any that is missing, at whatever depth.
        if path.ends_with("print.html") || path.ends_with("404.html") {
            continue;
        }
        for link in values(text, " href=\"").chain(values(text, " src=\"")) {
            if link.is_empty() || link.contains("://") || link.starts_with("mailto:") || link.starts_with("data:") {
                continue;
            }
            if link.starts_with(super::studio::PAGE) {
                continue; // beside the book
            }
            checked += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let to = match file {
                "" => path.clone(),
                _ => plain(&path.parent().unwrap_or(html).join(file)),
            };
            let is_there = match anchors.get(to.as_path()) {
                Some(names) => anchor.is_empty() || names.contains(anchor),
                None => to.is_file(),
            };
            if !is_there {
                broken.push(format!("{}: {link}", path.strip_prefix(html).unwrap_or(path).display()));
            }
        }
    }
    broken.dedup();
    Ok((checked, broken))
}

/// The values of an attribute, begun by `begin`.
fn values<'a>(text: &'a str, begin: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(begin).skip(1).filter_map(|rest| rest.split('"').next())
}

/// The path without `..` and `.`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    plain
}
