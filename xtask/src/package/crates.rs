//! Crates, packed as they would be published, and installed from their packages.

use super::trial::{Program, in_importer};
use super::{Claims, Places, hash, members, must, read};
use crate::{output, write};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Name and version of a crate.
type Published = (String, String);

/// The largest package that crates.io accepts, bytes.
const LARGEST: usize = 10 << 20;

/// Packs the crates and installs the program from the packages. Returns the program.
pub fn make(places: &Places, claims: &mut Claims) -> Result<Program, String> {
    println!("== crates");
    let (published, others) = published()?;
    let mut pack = crate::cargo(&["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"]);
    for name in &others {
        pack.args(["--exclude", name]);
    }
    must(pack)?;
    let packed = crate::host::target().join("package");
    let registry = places.work.join("registry");
    let _ = fs::remove_dir_all(&registry);
    // All that the workspace needs of others, and our own crates beside it.
    let mut vendor = crate::cargo(&["vendor", "--locked", "--versioned-dirs", "--quiet"]);
    vendor.arg(&registry);
    output(vendor)?;
    let (mut sizes, mut content) = (Vec::new(), String::new());
    for (name, version) in &published {
        let file = format!("{name}-{version}.crate");
        let bytes = read(&packed.join(&file))?;
        let mut unpack = Command::new("tar");
        unpack.arg("-xzf").arg(packed.join(&file)).arg("-C").arg(&registry);
        must(unpack)?;
        let folder = registry.join(format!("{name}-{version}"));
        content += &content_of(&folder)?;
        let sums = json!({ "files": {}, "package": hash(&bytes) });
        write(&folder.join(".cargo-checksum.json"), sums.to_string())?;
        write(&places.out.join(&file), &bytes)?;
        sizes.push((bytes.len(), name));
    }
    let (all, (largest, name)) =
        (sizes.iter().map(|(size, _)| size).sum::<usize>(), sizes.iter().max().ok_or("no member is published")?);
    if *largest > LARGEST {
        return Err(format!("{name} has {largest} bytes as a package; crates.io accepts {LARGEST}"));
    }
    let files = content.lines().count();
    claims.add(
        "crates",
        format!("{} packages with {files} files, {all} bytes; the largest is {name}, {largest} bytes", sizes.len()),
    );
    let mut rustc = Command::new("rustc");
    rustc.arg("-vV");
    content += &String::from_utf8_lossy(&output(rustc)?);
    let (path, was_kept) = installed(places, &registry, &published, &hash(content.as_bytes()))?;
    let program = Program::tried("program from the crates", path, Vec::new(), &places.work)?;
    let kept = if was_kept { ", kept from an earlier run on the same packages" } else { "" };
    claims.add(
        "cargo install taut-cli",
        format!("from these packages, offline, with an empty CARGO_HOME: {} bytes{kept}", read(&program.path)?.len()),
    );
    claims.add("its FMU in FMPy", in_importer(&program.unit(), &program)?);
    Ok(program)
}

/// Names and hashes of the files of an unpacked crate, a line each, without what depends on the name of the commit
/// alone: that name, and the hashes of our own packages in `Cargo.lock`.
fn content_of(folder: &Path) -> Result<String, String> {
    let mut lines = String::new();
    for path in crate::book::files(folder)? {
        let mut bytes = read(&path)?;
        if path.ends_with(".cargo_vcs_info.json") {
            continue;
        }
        if path.ends_with("Cargo.lock") {
            let text = String::from_utf8_lossy(&bytes);
            let versions: Vec<&str> = text.lines().filter(|line| !line.starts_with("checksum")).collect();
            bytes = versions.join("\n").into_bytes();
        }
        lines += &format!("{} {}\n", path.display(), hash(&bytes));
    }
    Ok(lines)
}

/// Members of the workspace that are published, with their versions, and names of the others.
fn published() -> Result<(Vec<Published>, Vec<String>), String> {
    let text = |package: &Value, key: &str| package[key].as_str().unwrap_or_default().to_string();
    let (published, others): (Vec<Value>, Vec<Value>) =
        members()?.into_iter().partition(|package| package["publish"].is_null());
    if let Some((name, key)) = published.iter().find_map(|one| Some((text(one, "name"), missing(one)?))) {
        return Err(format!("{name} has no {key} in its manifest"));
    }
    let published = published.iter().map(|package| (text(package, "name"), text(package, "version"))).collect();
    Ok((published, others.iter().map(|package| text(package, "name")).collect()))
}

/// The first key that a registry shows and a package lacks.
fn missing(package: &Value) -> Option<&'static str> {
    let is_empty = |key: &&str| match &package[*key] {
        Value::Array(words) => words.is_empty(),
        word => word.as_str().is_none_or(str::is_empty),
    };
    ["description", "license", "readme", "keywords", "categories", "rust_version"].into_iter().find(is_empty)
}

/// The program installed from that registry, and whether it is one that an earlier run installed from the same
/// `content`, a hash of all files.
fn installed(
    places: &Places,
    registry: &Path,
    published: &[Published],
    content: &str,
) -> Result<(PathBuf, bool), String> {
    let (root, home, built) = (places.work.join("installed"), places.work.join("home"), places.work.join("crates"));
    let program = root.join("bin").join(format!("taut{}", std::env::consts::EXE_SUFFIX));
    let (began, ended) = (built.join("content.txt"), root.join("content.txt"));
    let is_of = |mark: &Path| fs::read_to_string(mark).is_ok_and(|there| there == content);
    if is_of(&ended) && program.is_file() {
        return Ok((program, true));
    }
    // Cargo does not compile a package again if only its content has changed, and not its version.
    if !is_of(&began) {
        let _ = fs::remove_dir_all(&built);
        write(&began, content)?;
    }
    for folder in [&root, &home] {
        let _ = fs::remove_dir_all(folder);
    }
    let config = format!(
        "[source.crates-io]\nreplace-with = \"packed\"\n\n[source.packed]\ndirectory = {:?}\n\n[net]\noffline = true\n",
        registry.display().to_string()
    );
    write(&home.join("config.toml"), config)?;
    let name = "taut-cli";
    let version = published.iter().find(|(published, _)| published == name).map(|(_, version)| version.as_str());
    let mut install = crate::cargo(&["install", name, "--locked", "--version", version.unwrap_or_default()]);
    install.arg("--root").arg(&root).current_dir(&home).env("CARGO_HOME", &home);
    install.env("CARGO_TARGET_DIR", &built).env_remove("CARGO_ENCODED_RUSTFLAGS").env("CARGO_INCREMENTAL", "0");
    must(install)?;
    write(&ended, content)?;
    Ok((program, false))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_that_lacks_a_key_is_found() {
        let whole = json!({ "description": "a", "license": "MIT", "readme": "README.md", "keywords": ["a"],
            "categories": ["science"], "rust_version": "1.95" });
        assert_eq!(missing(&whole), None);
        let mut without = whole.clone();
        without["keywords"] = json!([]);
        assert_eq!(missing(&without), Some("keywords"));
        without["license"] = Value::Null;
        assert_eq!(missing(&without), Some("license"));
    }

    #[test]
    fn what_is_kept_depends_on_files_and_not_on_the_commit() {
        let folder = std::env::temp_dir().join(format!("taut-xtask-crates-{}", std::process::id()));
        write(&folder.join("src/lib.rs"), "fn a() {}").unwrap();
        let first = content_of(&folder).unwrap();
        write(&folder.join(".cargo_vcs_info.json"), "{}").unwrap();
        assert_eq!(content_of(&folder).unwrap(), first);
        let lock =
            |sum: &str, version: u32| format!("name = \"taut-core\"\nversion = \"{version}\"\nchecksum = \"{sum}\"\n");
        write(&folder.join("Cargo.lock"), lock("aa", 1)).unwrap();
        let first = content_of(&folder).unwrap();
        write(&folder.join("Cargo.lock"), lock("bb", 1)).unwrap();
        assert_eq!(content_of(&folder).unwrap(), first);
        write(&folder.join("Cargo.lock"), lock("bb", 2)).unwrap();
        assert_ne!(content_of(&folder).unwrap(), first);
        let first = content_of(&folder).unwrap();
        write(&folder.join("src/lib.rs"), "fn b() {}").unwrap();
        assert_ne!(content_of(&folder).unwrap(), first);
        fs::remove_dir_all(folder).unwrap();
    }
}
