//! Crates, packed as they would be published, and installed from their packages.

use super::{Places, hash, members, must};
use crate::{output, write};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Name and version of a crate.
type Published = (String, String);

/// Packs the crates and installs the program from the packages. Returns the program.
pub fn make(places: &Places) -> Result<PathBuf, String> {
    println!("== crates");
    let (published, others) = published()?;
    let mut pack = crate::cargo(&["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"]);
    for name in &others {
        pack.args(["--exclude", name]);
    }
    must(pack)?;
    let packed = crate::python::target().join("package");
    let registry = places.work.join("registry");
    let _ = fs::remove_dir_all(&registry);
    // All that the workspace needs of others, and our own crates beside it.
    let mut vendor = crate::cargo(&["vendor", "--locked", "--versioned-dirs", "--quiet"]);
    vendor.arg(&registry);
    output(vendor)?;
    for (name, version) in &published {
        let file = format!("{name}-{version}.crate");
        let bytes = fs::read(packed.join(&file)).map_err(|e| format!("{file}: {e}"))?;
        let mut unpack = Command::new("tar");
        unpack.arg("-xzf").arg(packed.join(&file)).arg("-C").arg(&registry);
        must(unpack)?;
        let sums = json!({ "files": {}, "package": hash(&bytes) });
        write(&registry.join(format!("{name}-{version}/.cargo-checksum.json")), sums.to_string())?;
        write(&places.out.join(&file), &bytes)?;
    }
    install(places, &registry, &published)
}

/// Members of the workspace that are published, with their versions, and names of the others.
fn published() -> Result<(Vec<Published>, Vec<String>), String> {
    let text = |package: &Value, key: &str| package[key].as_str().unwrap_or_default().to_string();
    let (published, others): (Vec<Value>, Vec<Value>) =
        members()?.into_iter().partition(|package| package["publish"].is_null());
    let published = published.iter().map(|package| (text(package, "name"), text(package, "version"))).collect();
    Ok((published, others.iter().map(|package| text(package, "name")).collect()))
}

/// `cargo install` from that registry, with a home of its own and in a folder without a configuration.
fn install(places: &Places, registry: &Path, published: &[Published]) -> Result<PathBuf, String> {
    let (home, root, built) = (places.work.join("home"), places.work.join("installed"), places.work.join("crates"));
    // Cargo does not compile a package again if only its content has changed, and not its version.
    for folder in [&root, &built] {
        let _ = fs::remove_dir_all(folder);
    }
    let config = format!(
        "[source.crates-io]\nreplace-with = \"packed\"\n\n[source.packed]\ndirectory = {:?}\n\n[net]\noffline = true\n",
        registry.display().to_string()
    );
    write(&home.join("config.toml"), config)?;
    let program = "taut-cli";
    let version = published.iter().find(|(name, _)| name == program).map(|(_, version)| version.as_str());
    let mut install = crate::cargo(&["install", program, "--locked", "--version", version.unwrap_or_default()]);
    install.arg("--root").arg(&root).current_dir(&home).env("CARGO_HOME", &home);
    install.env("CARGO_TARGET_DIR", &built).env_remove("CARGO_ENCODED_RUSTFLAGS");
    must(install)?;
    Ok(root.join("bin").join(format!("taut{}", std::env::consts::EXE_SUFFIX)))
}
