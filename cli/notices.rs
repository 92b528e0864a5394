//! The packages in a program, with their licences. A part of the build script and of `cargo xtask package`.

use std::env;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::Command;

/// A text that begins with `opening` and names each package with its licence, and has the texts of licences as far as
/// they can be found. `tree` is `cargo tree` for what is described, without options.
pub fn notices(mut tree: Command, opening: &str) -> String {
    tree.args(["--edges", "normal", "--prefix", "none", "--format", "{p}|{l}"]);
    let listed = tree.output().ok().filter(|done| done.status.success()).map(|done| done.stdout);
    let listed = String::from_utf8(listed.unwrap_or_default()).unwrap_or_default();
    // "name v1.2.3 (proc-macro)|MIT": those of this repository have a path instead.
    let mut packages: Vec<(String, String, String)> = Vec::new();
    for line in listed.lines() {
        let (package, licence) = line.split_once('|').unwrap_or((line, ""));
        let mut words = package.split(' ');
        let (Some(name), Some(version)) = (words.next(), words.next()) else { continue };
        if name == "taut" || name.starts_with("taut-") {
            continue;
        }
        let licence = licence.trim_end_matches(" (*)").to_string();
        packages.push((name.to_string(), version.trim_start_matches('v').to_string(), licence));
    }
    packages.sort();
    packages.dedup();
    let mut text = format!("{opening}\n");
    for (name, version, licence) in &packages {
        let _ = write!(text, "\n{}\n{name} {version}: {licence}\n", "=".repeat(72));
        for file in licence_files(name, version) {
            if let Ok(content) = std::fs::read_to_string(&file) {
                let _ = write!(text, "\n{}\n\n{}\n", file.file_name().unwrap_or_default().to_string_lossy(), content);
            }
        }
    }
    text
}

/// Texts of the licence of a package, in cargo's own folder; or beside the package that is built, where cargo has all
/// packages in a folder.
fn licence_files(name: &str, version: &str) -> Vec<PathBuf> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(env::var_os("HOME")?).join(".cargo")));
    let beside = env::var_os("CARGO_MANIFEST_DIR").and_then(|own| Some(PathBuf::from(own).parent()?.to_path_buf()));
    let entries = |path: PathBuf| std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = home
        .into_iter()
        .flat_map(|home| entries(home.join("registry/src")))
        .chain(beside)
        .flat_map(|registry| entries(registry.join(format!("{name}-{version}"))))
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
            // Apache's text is beside this one already.
            let is_licence = name.starts_with("LICEN") || name.starts_with("COPYING") || name.starts_with("NOTICE");
            path.is_file() && is_licence && !name.contains("APACHE")
        })
        .collect();
    // A registry may be there under two names.
    files.sort_by(|a, b| a.file_name().cmp(&b.file_name()));
    files.dedup_by(|a, b| a.file_name() == b.file_name());
    files
}
