//! The Python wheel.

use super::{Asked, GLIBC, Places, must, paths, program, tried};
use crate::{output, write};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Simulates the case that `taut init` writes, and prints where the cart ends.
const SCRIPT: &str = "import sys, taut
case = taut.read(sys.argv[1])
print(repr(case.simulate()[0].metrics['final_cart_position_m']))
taut.export(case, 'fmu', sys.argv[2])
";

/// Builds the wheel and tries it in an empty environment; it has to give the results of the program, if there is one.
pub fn make(places: &Places, asked: &Asked, beside: Option<&Path>) -> Result<(), String> {
    println!("== wheel");
    let own = program::own_target()?;
    let triple = asked.target.clone().unwrap_or_else(|| own.clone());
    let wheels = places.work.join("wheels");
    let _ = fs::remove_dir_all(&wheels);
    let mut build = Command::new(crate::python::program(&places.tools, "maturin"));
    build.args(["build", "--locked", "--release", "--manifest-path", "py/Cargo.toml", "--out"]).arg(&wheels);
    if triple.contains("linux-gnu") {
        build.args(["--zig", "--compatibility", &format!("manylinux_{}_{}", GLIBC.0, GLIBC.1)]);
    }
    build.args(["--target", &triple]).arg("--target-dir").arg(places.work.join("wheel"));
    build.env("CARGO_ENCODED_RUSTFLAGS", paths::flags()?.join("\u{1f}")).env("PATH", program::with_tools(places)?);
    must(build)?;
    let wheel = fs::read_dir(&wheels).ok().and_then(|mut all| Some(all.next()?.ok()?.path())).ok_or("no wheel")?;
    let bytes = paths::check(&wheel)?;
    write(&places.out.join(wheel.file_name().unwrap_or_default()), bytes)?;
    if triple != own {
        println!("untried: this machine does not run {triple}");
        return Ok(());
    }
    if cfg!(target_os = "linux") {
        let mut show = Command::new(crate::python::program(&places.tools, "auditwheel"));
        show.arg("show").arg(&wheel).env("PATH", program::with_tools(places)?);
        must(show)?;
    }
    try_it(places, &wheel, beside)
}

/// Installs the wheel into an environment that has nothing else, and runs a script in it.
fn try_it(places: &Places, wheel: &Path, beside: Option<&Path>) -> Result<(), String> {
    let environment = places.work.join("wheel-tried");
    let mut make = Command::new(crate::python::interpreter()?);
    make.args(["-m", "venv", "--clear"]).arg(&environment);
    must(make)?;
    let python = crate::python::program(&environment, "python");
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).arg(wheel);
    must(install)?;
    let Some(beside) = beside else { return Ok(()) };
    let result: serde_json::Value = serde_json::from_slice(&tried(beside, &places.work)?).map_err(|e| e.to_string())?;
    let script: PathBuf = places.work.join("tried").join("script.py");
    write(&script, SCRIPT)?;
    let mut run = Command::new(&python);
    run.arg(&script).args(["axis.toml", "from-python.fmu"]).current_dir(places.work.join("tried"));
    let printed = String::from_utf8(output(run)?).unwrap_or_default();
    let wanted = result.pointer("/experiments/0/metrics/final_cart_position_m").and_then(serde_json::Value::as_f64);
    match printed.trim().parse::<f64>().ok() == wanted && wanted.is_some() {
        true => println!("the wheel gives the results of {}", beside.display()),
        false => {
            return Err(format!("the wheel has the cart end at {} m, the program at {wanted:?} m", printed.trim()));
        }
    }
    Ok(())
}
