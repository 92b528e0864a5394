//! The Python wheel.

use super::program::{Build, licences, listed, materials};
use super::trial::{Program, in_importer, unpack};
use super::{Claims, GLIBC, must, read};
use crate::{output, write};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Licences of the packages in the wheel, and its bill of materials, where maturin finds them. They are there while the
/// wheel is built.
const LICENCES: &str = "py/LICENCES.txt";
const MATERIALS: &str = "py/taut.cdx.json";

/// Simulates a case and prints where the cart ends, m; writes its FMU; prints the version of Python.
const SCRIPT: &str = "import platform, sys, taut
case = taut.read(sys.argv[1])
taut.export(case, 'fmu', sys.argv[2])
print(repr(case.simulate()[0].metrics['final_cart_position_m']), platform.python_version())
";

/// Builds the wheel and tries it in empty environments; it has to give the results of `beside`.
pub fn make(build: &Build, pythons: &[String], beside: Option<&Program>, claims: &mut Claims) -> Result<(), String> {
    println!("== wheel");
    let wheel = built(build, claims)?;
    write(&build.places.out.join(wheel.file_name().unwrap_or_default()), read(&wheel)?)?;
    if build.runner()?.is_none_or(|words| !words.is_empty()) {
        claims.add("untried", format!("this machine does not run a Python for {}", build.triple));
        return Ok(());
    }
    if cfg!(target_os = "linux") {
        claims.add("auditwheel", audited(build, &wheel)?);
    }
    let Some(beside) = beside else { return Ok(()) };
    for (number, python) in
        [crate::python::interpreter()?].into_iter().chain(pythons.iter().map(String::as_str)).enumerate()
    {
        let environment = build.places.work.join("wheel-tried").join(number.to_string());
        let (version, unit) = tried(&environment, python, &wheel, beside)?;
        claims.add(
            &format!("wheel in Python {version}"),
            format!("installed alone, gives the results of the {}", beside.name),
        );
        if number == 0 {
            claims.add("its FMU in FMPy", in_importer(&unit, beside)?);
        }
    }
    Ok(())
}

/// Builds the wheel and checks what is in it.
fn built(build: &Build, claims: &mut Claims) -> Result<PathBuf, String> {
    let wheels = build.places.work.join("wheels");
    let _ = fs::remove_dir_all(&wheels);
    let opening = "The package contains these packages of others, under these licences.";
    let licences = licences("taut-python", build.triple, opening)?;
    let materials = materials(build.places, build.triple, "py")?;
    claims.add("bill of materials of the wheel", listed(&materials, &licences)?);
    write(Path::new(LICENCES), &licences.text)?;
    write(Path::new(MATERIALS), &materials)?;
    let mut maturin = Command::new(crate::python::program(&build.places.tools, "maturin"));
    maturin.args(["build", "--locked", "--release", "--manifest-path", "py/Cargo.toml", "--out"]).arg(&wheels);
    // It would look for a relative path in `py`.
    maturin.arg("--sbom-include").arg(std::path::absolute(MATERIALS).map_err(|e| format!("{MATERIALS}: {e}"))?);
    if build.has_zig() {
        maturin.args(["--zig", "--compatibility", &format!("manylinux_{}_{}", GLIBC.0, GLIBC.1)]);
    }
    maturin.args(["--target", build.triple]).arg("--target-dir").arg(build.places.work.join("wheel"));
    let done = build.set(&mut maturin, Path::new(".")).and_then(|()| must(maturin));
    [LICENCES, MATERIALS].iter().for_each(|file| drop(fs::remove_file(file)));
    done?;
    let wheel = fs::read_dir(&wheels).ok().and_then(|mut all| Some(all.next()?.ok()?.path())).ok_or("no wheel")?;
    let name = wheel.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if !name.contains("-abi3-") {
        return Err(format!("{name} is for one version of Python"));
    }
    // What is in the archive is compressed there.
    let inside = build.places.work.join("wheel-inside");
    unpack(&wheel, &inside)?;
    let files = super::paths::checked(&inside)?;
    for wanted in ["LICENSE-MIT", "LICENSE-APACHE", "LICENCES.txt", "sboms/taut.cdx.json"] {
        if !files.iter().any(|file| file.ends_with(wanted)) {
            return Err(format!("{name} has no {wanted}"));
        }
    }
    claims.add(
        "wheel",
        format!("{name}, {} bytes, no paths of this machine in its {} files", read(&wheel)?.len(), files.len()),
    );
    claims.add("licences in it", licences.figure());
    let endings = ["so", "pyd"];
    for object in
        files.iter().filter(|file| file.extension().is_some_and(|ending| endings.iter().any(|e| *e == ending)))
    {
        let (glibc, size) = (build.checked(object)?, read(object)?.len());
        claims.add("its library", format!("{size} bytes, {glibc}"));
    }
    Ok(wheel)
}

/// Report of auditwheel on the wheel. Errors: the wheel does not run on every platform that its name claims.
fn audited(build: &Build, wheel: &Path) -> Result<String, String> {
    let mut show = Command::new(crate::python::program(&build.places.tools, "auditwheel"));
    show.arg("show").arg(wheel).env("PATH", super::program::with_tools(build.places)?);
    let shown = String::from_utf8_lossy(&output(show)?).split_whitespace().collect::<Vec<_>>().join(" ");
    let processor = build.triple.split('-').next().unwrap_or_default();
    let tag = format!("manylinux_{}_{}_{processor}", GLIBC.0, GLIBC.1);
    match shown.contains(&format!("\"{tag}\"")) {
        true => Ok(format!("consistent with {tag}")),
        false => Err(format!("auditwheel does not find {tag}: {shown}")),
    }
}

/// Installs the wheel into an environment that has nothing else, and runs a script on the case of a program's trial.
/// Returns the version of Python and the FMU.
fn tried(environment: &Path, python: &str, wheel: &Path, beside: &Program) -> Result<(String, PathBuf), String> {
    let mut make = Command::new(python);
    make.args(["-m", "venv", "--clear"]).arg(environment);
    must(make)?;
    let inside = crate::python::program(environment, "python");
    let mut install = Command::new(&inside);
    install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).arg(wheel);
    must(install)?;
    let unit = environment.join("from-python.fmu");
    let mut run = Command::new(&inside);
    run.args(["-c", SCRIPT]).arg(beside.folder.join("axis.toml")).arg(&unit).current_dir(environment);
    let printed = String::from_utf8(output(run)?).unwrap_or_default();
    let (position, version) = printed.trim().split_once(' ').unwrap_or_default();
    let wanted = beside.final_position()?;
    match position.parse() == Ok(wanted) {
        true => Ok((version.to_string(), unit)),
        false => Err(format!("the wheel has the cart end at {position} m, the {} at {wanted} m", beside.name)),
    }
}
