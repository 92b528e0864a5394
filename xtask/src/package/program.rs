//! The program in an archive, with what belongs to it.

#[path = "../../../cli/notices.rs"]
mod notices;

use super::trial::{Program, in_importer};
use super::{Claims, GLIBC, Places, glibc, hash, members, must, paths, read};
use crate::compiler::Compiler;
use crate::{output, write};
use serde_json::Value;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Shells with completions.
const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];

/// Documents that are handed out with the program.
const DOCUMENTS: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];

/// The version of cargo-cyclonedx, which writes the bill of materials.
const CYCLONEDX: &str = "0.5.9";

/// For which target and by what program and wheel are built.
pub struct Build<'a> {
    pub places: &'a Places,
    pub triple: &'a str,
    pub compiler: &'a Compiler,
}

impl Build<'_> {
    /// True if zig links, which has the C libraries of old, for other processors too.
    pub fn has_zig(&self) -> bool {
        self.triple.contains("linux-gnu")
    }

    /// Has a command that builds from `source` use the compiler, the tools of Python, and no paths of this machine.
    pub fn set(&self, build: &mut Command, source: &Path) -> Result<(), String> {
        // Incremental builds are larger and slower, and depend on the builds before them.
        build.env("CARGO_INCREMENTAL", "0");
        build.env("CARGO_ENCODED_RUSTFLAGS", paths::flags(source)?.join("\u{1f}"));
        build.env("PATH", with_tools(self.places)?);
        self.compiler.set(build)
    }

    /// Words that run a program for the target; none: this machine does not run it. A runner of another processor's
    /// programs has the variable that cargo reads, as CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER.
    pub fn runner(&self) -> Result<Option<Vec<String>>, String> {
        if self.triple == own_target()? {
            return Ok(Some(Vec::new()));
        }
        let variable = format!("CARGO_TARGET_{}_RUNNER", self.triple.replace(['-', '.'], "_").to_uppercase());
        Ok(std::env::var(variable).ok().map(|words| words.split_whitespace().map(str::to_string).collect()))
    }

    /// Errors: a file needs a later glibc than it should, or holds paths of this machine. Returns the glibc in words.
    pub fn checked(&self, file: &Path) -> Result<String, String> {
        paths::check(file)?;
        if !self.has_zig() {
            return Ok("no glibc".into());
        }
        let needed = glibc::newest(file)?;
        match needed > Some(GLIBC) {
            true => Err(format!("{} needs a later glibc than {}", file.display(), dotted(GLIBC))),
            false => Ok(needed.map_or("no glibc".into(), |version| format!("glibc {} (objdump -T)", dotted(version)))),
        }
    }

    /// Builds the program from the source in a folder.
    fn program(&self, source: &Path, target: &Path) -> Result<PathBuf, String> {
        let mut build = crate::cargo(&[if self.has_zig() { "zigbuild" } else { "build" }]);
        build.args(["--locked", "--profile", "dist", "--package", "taut-cli", "--bin", "taut"]);
        let triple = self.triple;
        let version = if self.has_zig() { format!("{triple}.{}", dotted(GLIBC)) } else { triple.to_string() };
        build.args(["--target", &version]).arg("--target-dir").arg(target).current_dir(source);
        self.set(&mut build, source)?;
        must(build)?;
        let windows = triple.contains("windows");
        Ok(target.join(triple).join("dist").join(if windows { "taut.exe" } else { "taut" }))
    }
}

/// Builds the program and its archive. Returns the program, if this machine can run it.
pub fn make(build: &Build, twice: bool, claims: &mut Claims) -> Result<Option<Program>, String> {
    println!("== program");
    let (places, triple) = (build.places, build.triple);
    let built = build.program(Path::new("."), &places.work.join("program"))?;
    let glibc = build.checked(&built)?;
    let bytes = read(&built)?;
    claims.add("program", format!("{triple}, {} bytes, {glibc}, no paths of this machine", bytes.len()));
    if twice {
        let sum = hash(&bytes);
        again(build, &sum)?;
        claims.add("two builds", format!("same bytes from two folders, SHA-256 {sum}"));
    }
    let name = format!("taut-{}-{triple}", env!("CARGO_PKG_VERSION"));
    let folder = places.work.join("archive").join(&name);
    let _ = fs::remove_dir_all(&folder);
    let program = folder.join(built.file_name().unwrap_or_default());
    write(&program, &bytes)?;
    executable(&program)?;
    DOCUMENTS.iter().try_for_each(|name| write(&folder.join(name), read(Path::new(name))?))?;
    let licences =
        licences("taut-cli", triple, "The program contains these packages of others, under these licences.")?;
    claims.add("licences", licences.figure());
    write(&folder.join("LICENCES.txt"), &licences.text)?;
    let materials = materials(places, triple, "cli")?;
    claims.add("bill of materials", listed(&materials, &licences)?);
    write(&folder.join("taut.cdx.json"), materials)?;
    let runner = build.runner()?;
    let tried = runner.map(|runner| Program::tried("released program", program, runner, &places.work)).transpose()?;
    match &tried {
        Some(tried) => {
            for shell in SHELLS {
                let text = tried.output(&["completions", shell])?;
                write(&folder.join("completions").join(format!("taut.{shell}")), text)?;
            }
            let manual = folder.join("man");
            tried.output(&["man", "--out", &manual.display().to_string()])?;
            let pages = crate::book::files(&manual)?.len();
            claims.add("in the archive", format!("completions for {} shells, {pages} manual pages", SHELLS.len()));
            let object = tried.object()?;
            let glibc = build.checked(&object)?;
            let size = read(&object)?.len();
            claims.add("object of its FMUs", format!("{size} bytes, {glibc}, no paths of this machine"));
        }
        None => {
            let figure = "this machine does not run it; no completions and no manual pages are in its archive";
            claims.add("untried", figure.into());
        }
    }
    if let Some(tried) = tried.as_ref().filter(|_| own_target().is_ok_and(|own| own == triple)) {
        claims.add("its FMU in FMPy", in_importer(&tried.unit(), tried)?);
    }
    let files = paths::checked(&folder)?.len();
    claims.add("archive", format!("{files} files, no paths of this machine in them"));
    archive(&folder, &places.out.join(format!("{name}.tar.gz")))?;
    Ok(tried)
}

/// Builds the last commit in another folder. Errors: the program has another hash than `first`.
fn again(build: &Build, first: &str) -> Result<(), String> {
    let source = build.places.work.join("again");
    let here = std::env::current_dir().map_err(|e| format!("the present folder: {e}"))?;
    let git = |words: &[&str]| {
        let mut git = Command::new("git");
        git.args(words);
        output(git)
    };
    let (of, from) = (source.display().to_string(), here.display().to_string());
    if !source.join(".git").exists() {
        git(&["clone", "--quiet", "--no-checkout", &from, &of])?;
    }
    git(&["-C", &of, "fetch", "--quiet", &from, "HEAD"])?;
    git(&["-C", &of, "checkout", "--quiet", "--force", "--detach", "FETCH_HEAD"])?;
    let second = hash(&read(&build.program(&source, &source.join("target"))?)?);
    match first == second {
        true => Ok(()),
        false => Err(format!("two builds differ: {first} and {second}")),
    }
}

fn dotted((major, minor): (u32, u32)) -> String {
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

/// The path with the tools of Python in front.
pub fn with_tools(places: &Places) -> Result<OsString, String> {
    let before = std::env::var_os("PATH").unwrap_or_default();
    let own = crate::python::program(&places.tools, "python").parent().map(Path::to_path_buf).unwrap_or_default();
    std::env::join_paths([own].into_iter().chain(std::env::split_paths(&before))).map_err(|e| e.to_string())
}

/// Licences of the packages of others in a program or wheel.
pub struct Licences {
    pub text: String,
    /// Names and versions.
    packages: Vec<String>,
    /// Those whose text is not in `text`: Apache's, which is handed out as a file, or none in their package.
    without_text: usize,
}

impl Licences {
    pub fn figure(&self) -> String {
        let (all, without) = (self.packages.len(), self.without_text);
        format!("{all} packages of others, each with its licence, {} with its text in the package", all - without)
    }
}

/// Licences of the packages in a member of the workspace. Errors: none are found, or a package has none.
pub fn licences(member: &str, triple: &str, opening: &str) -> Result<Licences, String> {
    let mut tree = crate::cargo(&["tree", "--locked", "--package", member]);
    tree.args(["--target", triple]);
    let text = notices::notices(tree, opening);
    let (mut packages, mut without_text) = (Vec::new(), 0);
    for section in text.split(&format!("\n{}\n", "=".repeat(72))).skip(1) {
        let (first, rest) = section.split_once('\n').unwrap_or((section, ""));
        match first.split_once(": ").map(|(name, licence)| (name, licence.trim())) {
            Some((name, licence)) if !licence.is_empty() => packages.push(name.to_string()),
            _ => return Err(format!("{member}: a package without a licence: {first}")),
        }
        without_text += usize::from(rest.trim().is_empty());
    }
    match packages.is_empty() {
        false => Ok(Licences { text, packages, without_text }),
        true => Err(format!("cargo tree names no packages in {member}")),
    }
}

/// A bill of materials of the program or library in this folder of the workspace, by cargo-cyclonedx, without the time
/// and the place of its writing.
pub fn materials(places: &Places, triple: &str, member: &str) -> Result<String, String> {
    // A debug build: it is built for one use.
    let tool = crate::book::installed("cargo-cyclonedx", CYCLONEDX, &["--debug"])?;
    let (name, own) = ("taut-materials", format!("{member}/Cargo.toml"));
    let mut list = Command::new(tool);
    list.args(["cyclonedx", "--format", "json", "--manifest-path", &own, "--target", triple, "--quiet"]);
    list.args(["--override-filename", name]).env("SOURCE_DATE_EPOCH", "0").env("PATH", with_tools(places)?);
    output(list)?;
    // It writes beside the manifest of every member; one is wanted.
    let (members, mut found) = (members()?, None);
    for manifest in members.iter().filter_map(|one| one["manifest_path"].as_str()) {
        let file = Path::new(manifest).with_file_name(format!("{name}.json"));
        if Path::new(manifest).ends_with(&own) {
            found = fs::read_to_string(&file).ok();
        }
        let _ = fs::remove_file(&file);
    }
    let here = std::env::current_dir().map_err(|e| format!("the present folder: {e}"))?;
    let found = found.ok_or("cargo-cyclonedx wrote no bill of materials")?;
    Ok(without_folder(&found, &here))
}

/// A bill whose members of the workspace lie in `/taut`. Their references are URLs: `path+file:///folder/cli#…`.
fn without_folder(bill: &str, folder: &Path) -> String {
    let url = format!("path+file:///{}", folder.display().to_string().replace('\\', "/").trim_start_matches('/'));
    bill.replace(&url, "path+file:///taut")
}

/// Summary of a bill of materials. Errors: it is invalid, or lacks a package of `licences`.
pub fn listed(materials: &str, licences: &Licences) -> Result<String, String> {
    let bill: Value = serde_json::from_str(materials).map_err(|e| format!("the bill of materials: {e}"))?;
    let components = bill["components"].as_array().map(Vec::as_slice).unwrap_or_default();
    let word = |component: &Value, key: &str| component[key].as_str().unwrap_or_default().to_string();
    let names: Vec<String> = components
        .iter()
        .map(|component| format!("{} {}", word(component, "name"), word(component, "version")))
        .collect();
    let missing: Vec<&String> = licences.packages.iter().filter(|package| !names.contains(package)).collect();
    match &missing[..] {
        [] => Ok(format!(
            "{} {}, {} components, all packages of LICENCES.txt among them",
            word(&bill, "bomFormat"),
            word(&bill, "specVersion"),
            names.len()
        )),
        _ => Err(format!("the bill of materials lacks {missing:?}")),
    }
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
    let mut pack = Command::new(crate::python::interpreter()?);
    pack.args(["-c", include_str!("archive.py")]).arg(folder).arg(file);
    output(pack).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn licences() -> Licences {
        Licences { text: String::new(), packages: vec!["libm 0.2.16".into()], without_text: 0 }
    }

    #[test]
    fn a_bill_that_lacks_a_package_is_refused() {
        let bill =
            r#"{"bomFormat": "CycloneDX", "specVersion": "1.3", "components": [{"name": "libm", "version": "0.2.1"}]}"#;
        assert_eq!(listed(bill, &licences()), Err("the bill of materials lacks [\"libm 0.2.16\"]".into()));
        assert!(listed("no JSON", &licences()).unwrap_err().starts_with("the bill of materials: "));
    }

    #[test]
    fn a_bill_does_not_say_where_it_was_written() {
        let (here, there) = ("path+file:///home/me/taut/cli#taut-cli@0.1.0", "path+file:///taut/cli#taut-cli@0.1.0");
        assert_eq!(without_folder(here, Path::new("/home/me/taut")), there);
        assert_eq!(without_folder("path+file:///C:/me/cli#a", Path::new(r"C:\me")), "path+file:///taut/cli#a");
    }

    #[test]
    fn equal_files_give_equal_archives() {
        let folder = std::env::temp_dir().join(format!("taut-xtask-archive-{}", std::process::id()));
        let pack = |name: &str| {
            let whole = folder.join("whole");
            let _ = fs::remove_dir_all(&whole);
            ["taut", "man/taut.1"].iter().try_for_each(|file| write(&whole.join(file), file)).unwrap();
            executable(&whole.join("taut")).unwrap();
            archive(&whole, &folder.join(name)).unwrap();
            read(&folder.join(name)).unwrap()
        };
        let first = pack("first.tar.gz");
        assert!(first == pack("second.tar.gz"));
        let refused = archive(&folder.join("whole"), &folder.join("nowhere").join("third.tar.gz")).unwrap_err();
        assert!(refused.contains("No such file"), "{refused}");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn licences_of_a_member_that_does_not_exist_are_an_error() {
        let refused = super::licences("taut-nothing", "x86_64-unknown-linux-gnu", "").err();
        assert_eq!(refused.as_deref(), Some("cargo tree names no packages in taut-nothing"));
    }
}
