//! Reports in a browser: made with the program, opened and used in headless Chromium by `report/browser/check.mjs`; and
//! the studio, by the scripts `studio*.mjs` beside it, and `web.mjs` without a server.

use crate::host::{install, path_of};
use crate::{Counts, web};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The script that opens them, and what npm installs for it.
pub const FOLDER: &str = "report/browser";

/// The name of these tests where they cannot be done.
const NAME: &str = "reports in a browser";

/// The name of the tests of the studio without a server.
const WITHOUT_SERVER: &str = "the studio without a server, in a browser";

/// Spectra as printers name them: with such names a page scrolled sideways.
const SPECTRA: [&str; 2] =
    ["target/browser/resonances_x_20210701_223821.csv", "target/browser/resonances_x_20210821_152037.csv"];

/// The reports that are looked at: a name, and the command that makes it.
const REPORTS: [(&str, &[&str]); 18] = [
    ("simulate", &["simulate", "stages/sollmann-jouaneh/table4.toml"]),
    // More rows than a page holds.
    ("long", &["simulate", "stages/sollmann-jouaneh/table4.toml", "--set", "experiment.0.every=0.05ms"]),
    ("gantry", &["simulate", "stages/h-frame/h-frame.toml"]),
    ("live", &["simulate", "stages/sollmann-jouaneh/table4.toml", "--live"]),
    ("live-gantry", &["simulate", "stages/h-frame/h-frame.toml", "--live"]),
    ("modes", &["modes", "stages/printer-axis/printer-axis.toml"]),
    ("modes-of-a-gantry", &["modes", "stages/h-frame/h-frame.toml"]),
    ("move", &["move", "stages/sollmann-jouaneh/controllers/pid.toml"]),
    ("move-of-a-gantry", &["move", "stages/core-xy/square.toml"]),
    ("tune", &["tune", "stages/sollmann-jouaneh/controllers/pid.toml"]),
    ("sweep", &["sweep", "stages/sollmann-jouaneh/table4.toml", "--runs", "200", "--vary", "all=20%"]),
    ("shape", &["shape", "stages/printer-axis/printer-axis.toml"]),
    ("spectra", &["shape", SPECTRA[0], SPECTRA[1]]),
    ("paper", &["paper"]),
    ("show", &["show", "stages/printer-axis/printer-axis.toml"]),
    (
        "design",
        &[
            "design",
            "stages/sollmann-jouaneh/table4.toml",
            "--for",
            "cart.mass",
            "--input",
            "trapezoid",
            "--measure",
            "drive_angle=1mrad",
        ],
    ),
    ("check", &["check", "stages/sollmann-jouaneh/identification/linear-5v.toml"]),
    ("fit", &["fit", "stages/sollmann-jouaneh/identification/linear-5v.toml"]),
];

/// Makes the reports and looks at them; false where one is not as it should be. Where there is no browser, or no node
/// to drive it, and neither can be installed, the tests are ignored, unless `TAUT_REQUIRE=all` is set.
pub fn test(counts: &mut Counts) -> Result<bool, String> {
    let browser = match browser() {
        Ok(browser) => browser,
        Err(needs) => return ignored(&needs, counts),
    };
    let target = crate::host::target();
    let (reports, shots) = (target.join("browser/reports"), target.join("browser/shots"));
    // A report of an earlier version must not be taken for this one.
    let _ = fs::remove_dir_all(target.join("browser"));
    for (path, peak) in SPECTRA.into_iter().zip([42.0, 55.0]) {
        let written = fs::create_dir_all("target/browser").and_then(|()| fs::write(path, spectrum(peak)));
        written.map_err(|error| format!("{path} cannot be written: {error}"))?;
    }
    let Some(taut) = crate::build_program(counts)? else { return Ok(false) };
    for (name, words) in REPORTS {
        let folder = reports.join(name);
        let made = Command::new(&taut).args(words).arg("--out").arg(&folder).stdout(Stdio::null()).status();
        // A result that is not to be relied on ends with 1, and has a report all the same.
        if !made.is_ok_and(|status| matches!(status.code(), Some(0 | 1))) || !folder.join("report.html").exists() {
            return Err(format!("taut {} makes no report", words.join(" ")));
        }
    }
    let mut check = Command::new("node");
    check.arg(Path::new(FOLDER).join("check.mjs")).arg(&browser).arg(&reports).arg(&shots);
    let looked = crate::run(check, counts)?;
    let studio = studio(&taut, &browser, &shots, counts)? & without_server(&taut, &browser, &shots, counts)?;
    println!("pictures of all pages: {}", shots.display());
    Ok(looked && studio)
}

/// The studio: the types of its page, and the page in use.
fn studio(taut: &Path, browser: &Path, shots: &Path, counts: &mut Counts) -> Result<bool, String> {
    let mut types = Command::new("node");
    types.arg(Path::new(FOLDER).join("node_modules/typescript/bin/tsc")).args(["-p", "studio/page/tsconfig.json"]);
    let mut passed = crate::run(types, counts)?;
    for script in ["studio.mjs", "studio-edits.mjs", "studio-work.mjs", "studio-lesson.mjs"] {
        let mut node = Command::new("node");
        node.arg(Path::new(FOLDER).join(script)).arg(browser).arg(taut).arg(shots);
        passed &= crate::run(node, counts)?;
    }
    Ok(passed)
}

/// The studio as a folder of files. If its module cannot be built here, the tests are ignored even where all tests are
/// required: fetching a compiler is the job of `cargo xtask web`.
fn without_server(taut: &Path, browser: &Path, shots: &Path, counts: &mut Counts) -> Result<bool, String> {
    let folder = web::default_folder();
    match web::compiler_for_tests() {
        Ok(compiler) => web::make(&folder, &compiler)?,
        Err(needs) => {
            counts.left_out.push(format!("{WITHOUT_SERVER}: needs {needs}"));
            return Ok(true);
        }
    };
    let mut node = Command::new("node");
    node.arg(Path::new(FOLDER).join("web.mjs")).arg(browser).arg(taut).arg(folder).arg(shots);
    crate::run(node, counts)
}

/// A spectrum with a peak there, and a smaller one above it, as Klipper writes them.
fn spectrum(peak: f64) -> String {
    let mut text = String::from("freq,psd_x,psd_y,psd_z,psd_xyz\n");
    for k in 0..=124 {
        let hertz = 1.6 * f64::from(k);
        let hill = |at: f64, height: f64| height / (1.0 + (0.5 * (hertz - at)).powi(2));
        let [x, y, z] = [hill(peak, 1e4), hill(1.6 * peak, 3e3), hill(3.0 * peak, 1e3)].map(|psd| psd + 100.0);
        text += &format!("{hertz:.1},{x:.3e},{y:.3e},{z:.3e},{:.3e}\n", x + y + z);
    }
    text
}

/// The browser, with node and what drives it installed; or the line that says what is missing.
pub fn browser() -> Result<PathBuf, String> {
    if !answers("node") || !answers("npm") {
        install(&["nodejs", "npm"]);
    }
    if !node_is_new_enough() {
        return Err("node 20 or later with npm (Debian: apt-get install nodejs npm)".into());
    }
    if !is_installed() {
        let done = Command::new("npm").args(["ci", "--ignore-scripts", "--silent"]).current_dir(FOLDER).status();
        if !done.is_ok_and(|status| status.success()) {
            return Err(format!(
                "playwright-core, typescript and axe-core (npm ci in {FOLDER}, from the npm registry)"
            ));
        }
    }
    let found = || ["chromium", "chromium-browser", "google-chrome"].into_iter().find_map(path_of);
    if found().is_none() {
        install(&["chromium"]);
    }
    found().ok_or_else(|| "Chromium (Debian: apt-get install chromium)".into())
}

/// True if what the lock file asks for is there: npm keeps a list of it with the same hashes.
fn is_installed() -> bool {
    let read = |file: &str| fs::read_to_string(Path::new(FOLDER).join(file)).unwrap_or_default();
    let (wanted, there) = (read("package-lock.json"), read("node_modules/.package-lock.json"));
    let mut hashes = wanted.lines().filter(|line| line.contains("\"integrity\"")).peekable();
    hashes.peek().is_some() && hashes.all(|hash| there.contains(hash.trim()))
}

fn answers(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|s| s.success())
}

fn node_is_new_enough() -> bool {
    let test = "process.exit(Number(process.versions.node.split('.')[0]) < 20 ? 1 : 0)";
    answers("npm") && Command::new("node").args(["--eval", test]).status().is_ok_and(|status| status.success())
}

/// Counts the tests as ignored, by name; or fails where all are required.
fn ignored(needs: &str, counts: &mut Counts) -> Result<bool, String> {
    if std::env::var_os("TAUT_REQUIRE").is_some_and(|all| all == "all") {
        return Err(format!("{NAME}: needs {needs}"));
    }
    counts.left_out.push(format!("{NAME}: needs {needs}"));
    Ok(true)
}
