//! The program in an archive, with what belongs to it.

#[path = "../../../cli/notices.rs"]
mod notices;

use super::{Asked, GLIBC, Places, hash, members, must, paths};
use crate::{output, write};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Shells with completions.
const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];

/// Documents that are handed out with the program.
const DOCUMENTS: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];

/// The version of cargo-cyclonedx, which writes the bill of materials.
const CYCLONEDX: &str = "0.5.9";

/// Builds the program and its archive. Returns the program, if this machine can run it.
pub fn make(places: &Places, asked: &Asked) -> Result<Option<PathBuf>, String> {
    println!("== program");
    let own = own_target()?;
    let triple = asked.target.clone().unwrap_or_else(|| own.clone());
    let program = build(places, &triple, "program")?;
    let bytes = paths::check(&program)?;
    let needed = paths::glibc(&bytes);
    println!("{}: {} bytes, glibc {}", program.display(), bytes.len(), needed.map_or("none".into(), said));
    if triple.contains("gnu") && needed > Some(GLIBC) {
        return Err(format!("{} needs a later glibc than {}", program.display(), said(GLIBC)));
    }
    if asked.twice {
        let again = build(places, &triple, "program-again")?;
        let [first, second] = [hash(&bytes), hash(&fs::read(&again).map_err(|e| e.to_string())?)];
        if first != second {
            return Err(format!("two builds differ: {first} and {second}"));
        }
        println!("a second build has the same bytes: {first}");
    }
    let name = format!("taut-{}-{triple}", env!("CARGO_PKG_VERSION"));
    let folder = places.work.join("archive").join(&name);
    let _ = fs::remove_dir_all(&folder);
    write(&folder.join("taut"), &bytes)?;
    executable(&folder.join("taut"))?;
    DOCUMENTS.iter().try_for_each(|name| write(&folder.join(name), fs::read(name).map_err(|e| e.to_string())?))?;
    let mut tree = crate::cargo(&["tree", "--locked", "--package", "taut-cli"]);
    tree.args(["--target", &triple]);
    let opening = "The program contains these packages of others, under these licences.";
    write(&folder.join("LICENCES.txt"), notices::notices(tree, opening))?;
    write(&folder.join("taut.cdx.json"), materials(places, &triple)?)?;
    let runs = triple == own;
    if runs {
        let taut = |words: &[&str]| {
            let mut command = Command::new(&program);
            command.args(words);
            output(command)
        };
        for shell in SHELLS {
            write(&folder.join("completions").join(format!("taut.{shell}")), taut(&["completions", shell])?)?;
        }
        taut(&["man", "--out", &folder.join("man").display().to_string()])?;
    } else {
        println!("untried: this machine does not run {triple}; its archive has no completions and manual pages");
    }
    archive(&folder, &places.out.join(format!("{name}.tar.gz")))?;
    Ok(runs.then_some(program))
}

fn said((major, minor): (u32, u32)) -> String {
    format!("{major}.{minor}")
}

/// The target of this machine.
pub fn own_target() -> Result<String, String> {
    let mut rustc = Command::new("rustc");
    rustc.arg("-vV");
    let text = String::from_utf8(output(rustc)?).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("host: "));
    line.map(str::to_string).ok_or_else(|| "rustc -vV names no host".into())
}

/// Builds the program for a target. On Linux zig links, which knows the C libraries of old.
fn build(places: &Places, triple: &str, folder: &str) -> Result<PathBuf, String> {
    let linux = triple.contains("linux-gnu");
    let target = places.work.join(folder);
    let mut build = crate::cargo(&[if linux { "zigbuild" } else { "build" }]);
    build.args(["--locked", "--profile", "dist", "--package", "taut-cli", "--bin", "taut"]);
    let version = if linux { format!("{triple}.{}", said(GLIBC)) } else { triple.to_string() };
    build.args(["--target", &version]).arg("--target-dir").arg(&target);
    build.env("CARGO_ENCODED_RUSTFLAGS", paths::flags()?.join("\u{1f}")).env("PATH", with_tools(places)?);
    must(build)?;
    let windows = triple.contains("windows");
    Ok(target.join(triple).join("dist").join(if windows { "taut.exe" } else { "taut" }))
}

/// The path with the tools of Python in front.
pub fn with_tools(places: &Places) -> Result<std::ffi::OsString, String> {
    let before = std::env::var_os("PATH").unwrap_or_default();
    let own = crate::python::program(&places.tools, "python").parent().map(Path::to_path_buf).unwrap_or_default();
    std::env::join_paths([own].into_iter().chain(std::env::split_paths(&before))).map_err(|e| e.to_string())
}

/// A bill of materials of the program, by cargo-cyclonedx, without the time at which it was written.
fn materials(places: &Places, triple: &str) -> Result<Vec<u8>, String> {
    let tool = crate::book::installed("cargo-cyclonedx", CYCLONEDX, &[])?;
    let name = "taut-materials";
    let mut list = Command::new(tool);
    list.args(["cyclonedx", "--format", "json", "--manifest-path", "cli/Cargo.toml", "--target", triple, "--quiet"]);
    list.args(["--override-filename", name]).env("SOURCE_DATE_EPOCH", "0").env("PATH", with_tools(places)?);
    output(list)?;
    // It writes beside the manifest of every member; the program's is the one that is wanted.
    let (members, mut found) = (members()?, None);
    for manifest in members.iter().filter_map(|one| one["manifest_path"].as_str()) {
        let file = Path::new(manifest).with_file_name(format!("{name}.json"));
        if manifest.ends_with("cli/Cargo.toml") {
            found = fs::read(&file).ok();
        }
        let _ = fs::remove_file(&file);
    }
    found.ok_or_else(|| "cargo-cyclonedx wrote no bill of materials".into())
}

#[cfg(unix)]
fn executable(path: &Path) -> Result<(), String> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).map_err(|e| format!("{}: {e}", path.display()))
}

#[cfg(not(unix))]
fn executable(_: &Path) -> Result<(), String> {
    Ok(())
}

/// Packs a folder so that equal files give equal bytes.
fn archive(folder: &Path, file: &Path) -> Result<(), String> {
    let (above, name) = (folder.parent().unwrap_or(folder), folder.file_name().unwrap_or_default());
    let mut tar = Command::new("tar");
    tar.args([
        "--sort=name",
        "--mtime=@0",
        "--owner=0",
        "--group=0",
        "--numeric-owner",
        "--mode=go=rX,u+rw,a-s",
        "-cf",
        "-",
    ]);
    tar.arg("-C").arg(above).arg(name);
    let bytes = output(tar)?;
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    std::io::Write::write_all(&mut packed, &bytes).map_err(|e| e.to_string())?;
    write(file, packed.finish().map_err(|e| e.to_string())?)
}
