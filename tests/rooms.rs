//! The rooms of a fit: which numbers they declare, and what they use of each other.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// From the lowest to the highest; the last four do not know each other.
const ROOMS: [&str; 9] = ["limits", "asked", "search", "noise", "trust", "posterior", "compare", "design", "map"];

/// Every file below `identify/src/fit` by its path without `.rs`, and its code: no remarks, no tests.
fn sources() -> BTreeMap<String, String> {
    fn below(folder: &Path, at: &str, all: &mut BTreeMap<String, String>) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                below(&path, &format!("{at}{name}/"), all);
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]").next().unwrap_or_default();
            let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
            all.insert(format!("{at}{name}"), code.join("\n"));
        }
    }
    let mut all = BTreeMap::new();
    below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("identify/src/fit"), "", &mut all);
    assert!(all.len() > 50, "{:?}", all.keys());
    all
}

/// The name and type of a constant of a file or a type, where this line declares one: not one within a function.
fn constant(line: &str) -> Option<(&str, &str)> {
    let (indent, item) = (line.len() - line.trim_start().len(), line.trim_start());
    let item = item.strip_prefix("pub(crate) ").or(item.strip_prefix("pub(super) ")).unwrap_or(item);
    let (name, rest) = item.strip_prefix("pub ").unwrap_or(item).strip_prefix("const ")?.split_once(": ")?;
    (indent <= 4).then_some((name, rest.split(" =").next().unwrap_or(rest)))
}

fn is_number(kind: &str) -> bool {
    let of = kind.trim_start_matches(['[', '&']);
    ["f64", "f32", "usize", "u64", "u32", "i64", "i32"].iter().any(|number| of.starts_with(number))
}

#[test]
fn rooms_declare_no_limits_of_their_own() {
    let mut own = Vec::new();
    for (file, code) in sources().iter().filter(|(file, _)| *file != "limits") {
        let numbers = code.lines().filter_map(constant).filter(|(_, kind)| is_number(kind));
        own.extend(numbers.map(|(name, _)| format!("{file}: {name}")));
    }
    assert!(own.is_empty(), "these belong in identify/src/fit/limits.rs: {own:#?}");
    // The test sees what it looks for.
    let found = [
        "const FAR: f64 = 6.0;",
        "pub(crate) const AT: [[f64; 3]; 2] = [",
        "    pub const WANTED: u64 = 1;",
        "        const GAMMA: f64 = 0.05;",
        "const STATE: [&str; 6] = [",
    ]
    .map(|line| constant(line).is_some_and(|(_, kind)| is_number(kind)));
    assert_eq!(found, [true, true, true, false, false]);
}

/// Each limit has its meaning, unit and source, is used, and names a test of its effect that is there.
#[test]
fn limits_say_what_they_are() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let limits = fs::read_to_string(root.join("identify/src/fit/limits.rs")).unwrap();
    let mut tests: String = fs::read_dir(root.join("tests"))
        .unwrap()
        .filter_map(|file| fs::read_to_string(file.unwrap().path()).ok())
        .collect();
    fn inside(folder: &Path, tests: &mut String) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            match path.is_dir() {
                true => inside(&path, tests),
                false => tests.push_str(&fs::read_to_string(&path).unwrap()),
            }
        }
    }
    inside(&root.join("identify/src/fit"), &mut tests);
    let used: String = sources().iter().filter(|(file, _)| *file != "limits").map(|(_, code)| code.as_str()).collect();
    let words: BTreeSet<&str> = used.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let (mut remark, mut wrong) = (String::new(), Vec::new());
    for line in limits.lines() {
        if let Some(text) = line.strip_prefix("///") {
            remark += text;
            continue;
        }
        if let Some((name, _)) = constant(line) {
            let test = remark.split_once(" Test: `").and_then(|(_, rest)| rest.split('`').next());
            if !remark.contains(" Unit: ") || !remark.contains(" Source: ") {
                wrong.push(format!("{name} has no unit or no source"));
            }
            if !test.is_some_and(|test| tests.contains(&format!("fn {test}("))) {
                wrong.push(format!("{name} names no test that is there: {test:?}"));
            }
            if !words.contains(name) {
                wrong.push(format!("{name} is not used"));
            }
        }
        remark.clear();
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A room uses those below it. That no files use each other is checked for all crates in `cli/tests/structure.rs`.
#[test]
fn rooms_stand_in_order() {
    let sources = sources();
    let rank = |room: &str| ROOMS.iter().position(|other| *other == room).map(|rank| rank.min(5));
    let (mut upward, mut uses) = (Vec::new(), BTreeMap::<&str, BTreeSet<String>>::new());
    for (file, code) in &sources {
        let room = file.split('/').next().unwrap_or_default();
        let (folder, name) = file.rsplit_once('/').unwrap_or(("", file));
        // What stands behind `crate::fit::`, or beside this file behind `super::`, one name or several in braces.
        for (start, beside) in [("crate::fit::", ""), ("super::", folder)] {
            if beside.is_empty() == (start == "super::") || (start == "super::" && name == "mod") {
                continue;
            }
            for rest in code.split(start).skip(1) {
                let path = rest.split([';', ')', '(', '<']).next().unwrap_or_default();
                let (path, several) = path.split_once('{').unwrap_or((path, ""));
                let names = several.split([',', '}']).map(str::trim).chain([""]);
                for name in names {
                    let whole = format!("{beside}/{}{name}", path.replace("::", "/"));
                    let parts: Vec<&str> = whole.split('/').filter(|part| !part.is_empty()).collect();
                    let to = rank(parts.first().unwrap_or(&"")).filter(|_| parts[0] != room);
                    if let (Some(own), Some(to)) = (rank(room), to)
                        && to >= own
                    {
                        upward.push(format!("{file} uses {}", parts[0]));
                    }
                    let found = (1..=parts.len()).rev().map(|n| parts[..n].join("/"));
                    let target = found.into_iter().find(|path| sources.contains_key(path));
                    uses.entry(file).or_default().extend(target.filter(|target| target != file));
                }
            }
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
    let count: usize = uses.values().map(BTreeSet::len).sum();
    assert!(count > 100, "only {count} uses were found");
}
