//! The structure of the code is the one that ARCHITECTURE.md describes: which crates use which, and that imports among
//! the files and folders of one folder do not form loops.

use crate::common::root;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The crates of the library, each with those that it may use, as in ARCHITECTURE.md.
const CRATES: [(&str, &[&str]); 6] = [
    ("core", &[]),
    ("case", &["core"]),
    ("control", &["core", "case"]),
    ("identify", &["core", "case", "control"]),
    ("export", &["core", "case", "control"]),
    (".", &["core", "case", "control", "identify", "export"]),
];

/// The crates above the library.
const OTHERS: [&str; 10] = ["acts", "cli", "fmu", "fuzz", "hunt", "py", "report", "studio", "web", "xtask"];

/// Words of a path of modules, such as `solve`, `exact`, `change`.
type Module = Vec<String>;

/// The text of each module of a crate, without remarks and without its tests.
fn modules(source: &Path) -> BTreeMap<Module, String> {
    fn collect(folder: &Path, above: &[String], into: &mut BTreeMap<Module, String>) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            let own: Module = match name.as_str() {
                "mod" | "lib" | "main" => above.to_vec(),
                _ => above.iter().cloned().chain([name]).collect(),
            };
            if path.is_dir() {
                collect(&path, &own, into);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
                let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
                let code: String = lines.flat_map(|line| [line, "\n"]).collect();
                into.entry(own).or_default().push_str(&code);
            }
        }
    }
    let mut found = BTreeMap::new();
    collect(source, &[], &mut found);
    found
}

/// Every path in a text that begins with `crate`, `super` or `self`; braces are opened up.
fn paths(code: &str) -> Vec<Module> {
    /// Reads a tree of paths from `rest`, adds them to `into`, and returns what stands behind it.
    fn tree<'a>(mut rest: &'a str, before: &[String], into: &mut Vec<Module>) -> &'a str {
        let mut path = before.to_vec();
        loop {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            path.push(rest[..end].to_string());
            rest = &rest[end..];
            let Some(next) = rest.strip_prefix("::") else {
                into.push(path);
                return rest;
            };
            rest = next;
            let Some(inner) = rest.strip_prefix('{') else {
                if !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_') {
                    into.push(path);
                    return rest;
                }
                continue;
            };
            rest = inner.trim_start();
            while !rest.starts_with('}') && !rest.is_empty() {
                rest = tree(rest, &path, into);
                // Another name of it, and the comma.
                let end = rest.find([',', '}']).unwrap_or(rest.len());
                rest = rest[end..].trim_start_matches(',').trim_start();
            }
            return rest.strip_prefix('}').unwrap_or(rest);
        }
    }
    let mut found = Vec::new();
    for word in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(word) {
            let is_begun = code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
            if !is_begun {
                tree(&code[at..], &[], &mut found);
            }
        }
    }
    found
}

/// The module that a path leads to, from that in which it stands.
fn target(path: &[String], from: &Module, modules: &BTreeMap<Module, String>) -> Module {
    let (mut here, mut rest) = (from.clone(), path);
    match path[0].as_str() {
        "crate" => (here, rest) = (Vec::new(), &path[1..]),
        "self" => rest = &path[1..],
        _ => {
            while rest.first().is_some_and(|word| word == "super") {
                here.pop();
                rest = &rest[1..];
            }
        }
    }
    for word in rest {
        here.push(word.clone());
        if !modules.contains_key(&here) {
            here.pop();
            break;
        }
    }
    here
}

/// Loops of imports among the files and folders of one folder, each once.
fn circles(modules: &BTreeMap<Module, String>) -> Vec<String> {
    let mut uses: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (from, code) in modules {
        for path in paths(code) {
            let to = target(&path, from, modules);
            let common = from.iter().zip(&to).take_while(|(own, other)| own == other).count();
            if common < from.len() && common < to.len() {
                uses.entry(from[..=common].to_vec()).or_default().insert(to[..=common].to_vec());
            }
        }
    }
    /// Everything that imports of `from` lead to, itself only by a loop.
    fn reached<'a>(from: &'a Module, uses: &'a BTreeMap<Module, BTreeSet<Module>>) -> BTreeSet<&'a Module> {
        let (mut found, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(next) = open.pop() {
            open.extend(uses.get(next).into_iter().flatten().filter(|to| found.insert(*to)));
        }
        found
    }
    let reach: BTreeMap<&Module, BTreeSet<&Module>> = uses.keys().map(|from| (from, reached(from, &uses))).collect();
    let in_loop = |module: &&Module| reach.get(module).is_some_and(|all| all.contains(module));
    let loop_of = |module: &Module| -> Vec<String> {
        let both = reach[module].iter().filter(|other| reach.get(*other).is_some_and(|all| all.contains(module)));
        both.map(|other| other.join("/")).collect()
    };
    let loops: BTreeSet<Vec<String>> = reach.keys().copied().filter(in_loop).map(loop_of).collect();
    loops.iter().map(|files| files.join(" and ")).collect()
}

/// A name that is listed twice is not found by a search for `crate::name`.
#[test]
fn imports_in_braces_are_seen() {
    let code = "use crate::{a::{One, b::Two}, c};\nuse super::d as e;\nfn f() { self::g::h() }";
    let found: Vec<String> = paths(code).iter().map(|path| path.join("::")).collect();
    assert_eq!(found, ["crate::a::One", "crate::a::b::Two", "crate::c", "super::d", "self::g::h"]);

    let module = |name: &str| vec![name.to_string()];
    let both = BTreeMap::from([
        (Vec::new(), String::new()),
        (module("one"), "use crate::{error, two::X};".to_string()),
        (module("two"), "use super::one::Y;".to_string()),
        (module("three"), "use super::one::Y;".to_string()),
    ]);
    assert_eq!(circles(&both), ["one and two"]);
    let three = BTreeMap::from([
        (module("one"), "use crate::two::X;".to_string()),
        (module("two"), "use crate::three::Y;".to_string()),
        (module("three"), "use crate::one::Z;".to_string()),
    ]);
    assert_eq!(circles(&three), ["one and three and two"]);
}

/// No file or folder imports a sibling that imports it back, directly or by others.
#[test]
fn no_siblings_import_each_other() {
    let mut found = Vec::new();
    let all: Vec<&str> = CRATES.iter().map(|(folder, _)| *folder).chain(OTHERS).collect();
    for folder in all {
        let modules = modules(&root().join(folder).join("src"));
        assert!(!modules.is_empty(), "{folder}");
        found.extend(circles(&modules).into_iter().map(|pair| format!("{folder}: {pair}")));
    }
    assert!(found.is_empty(), "{} circles: {found:#?}", found.len());
}

/// Each crate's manifest names the crates that it may use and no other, and ARCHITECTURE.md has the same arrows.
#[test]
fn crates_use_those_below_them() {
    let architecture = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for (folder, below) in CRATES {
        let manifest = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let manifest: toml_edit::DocumentMut = manifest.parse().unwrap();
        let used = manifest["dependencies"].as_table().unwrap().iter().map(|(name, _)| name.to_string());
        let used: BTreeSet<String> = used.filter(|name| name.starts_with("taut")).collect();
        let allowed: BTreeSet<String> = below.iter().map(|name| format!("taut-{name}")).collect();
        assert_eq!(used, allowed, "{folder}");
        let name = if folder == "." { "taut".to_string() } else { format!("taut-{folder}") };
        let row = architecture.lines().find(|line| line.starts_with(&format!("| `{name}`")));
        let row = row.unwrap_or_else(|| panic!("ARCHITECTURE.md has no row of {name}"));
        let cell = row.split('|').nth(3).unwrap_or_default();
        let named: BTreeSet<String> =
            cell.split(',').map(str::trim).filter(|name| !name.is_empty()).map(|name| format!("taut-{name}")).collect();
        assert_eq!(named, allowed, "ARCHITECTURE.md, {name}");
    }
}

/// ARCHITECTURE.md names every module of the library's crates.
#[test]
fn every_module_has_its_place() {
    let architecture = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for (folder, _) in CRATES {
        let source = root().join(folder).join("src");
        for path in fs::read_dir(source).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            assert!(name == "lib" || architecture.contains(&format!("`{name}`")), "ARCHITECTURE.md: {folder}: {name}");
        }
    }
}
