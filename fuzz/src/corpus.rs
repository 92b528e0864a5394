//! Inputs to begin with: the project's own files, its wrong files, and small ones made here.

#[path = "../../tests/common/wrong.rs"]
#[allow(dead_code)]
mod sections;

use crate::Seed;
use crate::targets::{fitted, repository};
use std::fmt::Write;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use taut::case::TEMPLATE;
use taut::fit;
use taut::trajectory::{Column, ParquetWriter, Trajectory};

/// Lines of a log, at most: longer ones show a reader nothing more.
const LINES: usize = 60;

fn good(name: &str, bytes: impl Into<Vec<u8>>) -> Seed {
    Seed { name: name.into(), bytes: bytes.into(), good: true }
}

fn any(name: &str, bytes: impl Into<Vec<u8>>) -> Seed {
    Seed { name: name.into(), bytes: bytes.into(), good: false }
}

/// The files with this ending in a folder of the repository and the folders in it, in the order of their paths.
fn files(folder: &str, ending: &str) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    gather(&repository().join(folder), ending, &mut found);
    found.sort();
    found
}

fn gather(folder: &Path, ending: &str, found: &mut Vec<(String, Vec<u8>)>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            gather(&path, ending, found);
        } else if path.extension().is_some_and(|extension| extension == ending) {
            let bytes = fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            found.push((path.display().to_string(), bytes));
        }
    }
}

fn wrong(folder: &str, ending: &str) -> Vec<Seed> {
    files(folder, ending).into_iter().map(|(name, bytes)| any(&name, bytes)).collect()
}

/// The wrong case files of `tests/bad/case`.
fn wrong_cases() -> impl Iterator<Item = (String, Vec<u8>)> {
    let all = sections::read(&repository().join("tests/bad/case")).unwrap_or_else(|what| panic!("{what}"));
    all.into_iter().map(|wrong| (wrong.path.display().to_string(), wrong.bytes()))
}

/// True if the logs that a case file names lie where the reader of the fuzzer has case files.
fn has_its_logs(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let named = text.split("file = \"").skip(1).filter_map(|rest| rest.split('"').next());
    named.into_iter().all(|path| repository().join("stages/sollmann-jouaneh/identification").join(path).exists())
}

/// Case files; those whose logs are elsewhere need not be read.
pub fn cases() -> Vec<Seed> {
    let mut seeds = vec![good("the template", TEMPLATE), good("every part", EVERY_PART), good("moves", MOVES)];
    for (name, bytes) in files("stages", "toml") {
        let good = has_its_logs(&bytes);
        seeds.push(Seed { name, bytes, good });
    }
    seeds.extend(wrong_cases().map(|(name, bytes)| any(&name, bytes)));
    seeds
}

/// A machine with every part that works piece by piece.
const EVERY_PART: &str = r#"
[motor]
torque_constant = 0.05
back_emf_constant = 0.05
resistance = "1 ohm"
inductance = "1 mH"
rotor_inertia = 1e-5
gear_ratio = 3
backlash = "0.5 deg"
gear_stiffness = "100 N m/rad"
[amplifier]
voltage_limit = "10 V"
current_limit = "8 A"
[drive_pulley]
radius = "20 mm"
inertia = 6e-5
friction = { viscous = 0.001, coulomb = "0.01 N m", static = 0.02 }
[idler_pulley]
inertia = 6e-5
friction = { viscous = 0.001, coulomb = 0.01, coulomb_backward = 0.012 }
[cart]
mass = "0.5 kg"
friction = { viscous = 10, coulomb = 0.5, static = "0.8 N" }
[belt]
stiffness = [1e5, 1e5, 6e4]
damping = [5, 5, 5]
pretension = "20 N"
[travel]
min = "-50 mm"
max = "50 mm"
stop_stiffness = "1e5 N/m"
stop_damping = "20 N s/m"
[[experiment]]
name = "there and back"
input = { square = "6 V", frequency = "5 Hz" }
until = "1 s"
every = "1 ms"
initial = { cart_position = "5 mm", drive_angle = 0.25, idler_angle = 0.25 }
[[experiment]]
name = "curved"
input = { table = [["0 s", "0 V"], ["10 ms", "5 V"], ["20 ms", "-5 V"]] }
until = "30 ms"
every = "1 ms"
"#;

/// A controller with moves of each kind.
const MOVES: &str = r#"
[motor]
torque_constant = 0.023
back_emf_constant = 0.023
resistance = 0.71
[drive_pulley]
radius = "19.4 mm"
inertia = 6.3e-5
[idler_pulley]
inertia = 6.3e-5
[cart]
mass = 0.362
friction = { viscous = 19, coulomb = 0.2, stribeck = { force = 0.2, velocity = "10 mm/s" } }
[belt]
stiffness = [1.3e5, 1.3e5, 5.9e4]
[controller]
every = "1 ms"
delay = "0.2 ms"
limit = "24 V"
pid = { proportional = "0.9 V/mm", integral = "4 V/(mm s)", derivative = "0.03 V s/mm", filter = "200 Hz" }
[[move]]
name = "there"
to = "50 mm"
speed = "0.5 m/s"
acceleration = "5 m/s^2"
jerk = "200 m/s^3"
until = "0.5 s"
window = "0.1 mm"
[[move]]
name = "list"
gcode = "G1 X20 F3000\nG4 P100\nG0 X0"
speed = "0.5 m/s"
acceleration = "5 m/s^2"
until = "2 s"
"#;

/// Quantities, and everything in quotes in the wrong cases.
pub fn quantities() -> Vec<Seed> {
    let known = [
        "19.4 mm",
        "6.3e-5 kg·m²",
        "23e-3 N m/A",
        "23e-3 V s/rad",
        "0.71 ohm",
        "1.3276e5 N/m",
        "5 deg/s",
        "3000 rpm",
        "5 Hz",
        "1 rev",
        "2 m/s^2",
        "200 m/s^3",
        "17 um/N",
        "1/4 in",
        "0.5 lb in^2",
        "3 kgf",
        "10 %",
        "4 V/(mm s)",
        "+.5e-3 µm",
        "-1 Ω",
        "12 mm/min",
        "9.81 N/kg",
        "1e-300 m",
        "0",
        "2 N s/m",
        "0.2 kW",
        "3 mJ",
        "50 GPa",
        "7 g cm^2",
        "1 km/h",
    ];
    let mut seeds: Vec<Seed> = known.iter().map(|text| any(text, *text)).collect();
    // Some of them may be in no unit that is known; these are.
    seeds.iter_mut().take(9).for_each(|seed| seed.good = true);
    for (name, bytes) in wrong_cases() {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        seeds.extend(text.split('"').skip(1).step_by(2).map(|quoted| any(&name, quoted)));
    }
    seeds
}

/// Logs as text, in every manner of writing them.
pub fn csv() -> Vec<Seed> {
    let rows = |head: &str, row: &dyn Fn(u32) -> String| (0..20).fold(head.to_string(), |text, k| text + &row(k));
    let comma = |x: f64| x.to_string().replace('.', ",");
    let mut seeds = vec![
        good("commas", rows("t,u,x\n", &|k| format!("{},{},{}\n", 0.001 * f64::from(k), k % 7, 0.5 * f64::from(k)))),
        good("units", rows("t,u,x\ns,V,mm\n", &|k| format!("{},5,{}\n", 0.001 * f64::from(k), f64::from(k)))),
        good("runs", rows("run,t,u,x\n", &|k| format!("{},{},5,{k}\n", 1 + k / 10, 0.01 * f64::from(k % 10)))),
        good("tabs", rows("t\tu\tx\r\n", &|k| format!("{k}e-3\t5\t{k}\r\n"))),
        good("blanks", rows("# a recording\n  t   u   x\n", &|k| format!("  {k}   5.0  {k}.5\n"))),
        good(
            "decimal commas",
            rows("a;b;c\n", &|k| format!("{};{};{k}\n", comma(0.001 * f64::from(k)), comma(0.5 * f64::from(k)))),
        ),
        good("missing values", rows("t,u,x\n", &|k| format!("{k},5,{}\n", if k % 3 == 0 { "" } else { "1.5" }))),
        good("quoted", rows("\"t\",\"u\",\"x\"\n", &|k| format!("\"{k}\",5,\"{k}\"\n"))),
    ];
    for (name, bytes) in files("stages/sollmann-jouaneh/identification/logs", "csv") {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let begin: String = text.split_inclusive('\n').take(LINES).collect();
        seeds.push(good(&name, begin));
    }
    seeds.extend(wrong("tests/bad/log", "csv"));
    seeds.extend(wrong("tests/bad/mapping", "csv"));
    seeds
}

/// Parquet files by PyArrow, and one of our own.
pub fn parquet() -> Vec<Seed> {
    let mut seeds: Vec<Seed> = files("tests/logs", "parquet")
        .into_iter()
        .map(|(name, bytes)| Seed { good: !name.contains("brotli"), name, bytes })
        .collect();
    let column = |name, unit, scale: f64| Column {
        values: (0..30).map(|k| scale * f64::from(k)).collect(),
        ..Column::new(name, unit)
    };
    let rows = Trajectory {
        columns: vec![column("time", "s", 1.0), column("voltage", "V", 0.5), column("drive_angle", "rad", 2.0)],
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("own.parquet");
    let written = ParquetWriter::create(&path).and_then(|mut writer| {
        writer.write(&rows)?;
        writer.finish()
    });
    written.unwrap_or_else(|error| panic!("{error}"));
    seeds.push(good("our own", fs::read(&path).expect("the file is there")));
    seeds
}

/// MATLAB files by SciPy, versions 5 to 7; those of versions 4 and 7.3 are refused.
pub fn matlab() -> Vec<Seed> {
    let mut seeds: Vec<Seed> = files("tests/logs", "mat")
        .into_iter()
        .map(|(name, bytes)| Seed { good: !name.contains("version") && !name.contains("types"), name, bytes })
        .collect();
    let ramp: Vec<f64> = (0..16).map(f64::from).collect();
    let plain: Vec<u8> = ["t", "u", "x"].iter().flat_map(|name| doubles(name, &ramp)).collect();
    seeds.push(good("made here", matlab_file(&plain)));
    seeds.push(good("made here, packed", pack(&matlab_file(&plain))));
    seeds
}

/// A MATLAB file of half a megabyte that unpacks to 100 MB of bytes, which are 800 MB of numbers.
pub fn much_of_nothing() -> Vec<u8> {
    let much: Vec<u8> = ["t", "u", "x"].iter().flat_map(|name| zeros(name, 1 << 25)).collect();
    pack(&matlab_file(&much))
}

/// A MATLAB file of version 5 with these elements.
pub fn matlab_file(elements: &[u8]) -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0x00, 0x01, b'I', b'M']);
    file.extend(elements);
    file
}

/// A part of an element: kind, length, bytes.
fn part(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut part = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    part.extend(bytes);
    part.resize(part.len().next_multiple_of(8), 0);
    part
}

/// A matrix of doubles: flags, dimensions, name, values, which are stored as numbers of this kind.
fn matrix(name: &str, rows: u32, kind: u32, values: &[u8]) -> Vec<u8> {
    let size = [rows.to_le_bytes(), 1_u32.to_le_bytes()].concat();
    let flags = [6_u32.to_le_bytes(), [0; 4]].concat();
    part(14, &[part(6, &flags), part(5, &size), part(1, name.as_bytes()), part(kind, values)].concat())
}

fn doubles(name: &str, values: &[f64]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    matrix(name, values.len() as u32, 9, &bytes)
}

/// So many zeros, each stored as a byte.
fn zeros(name: &str, count: u32) -> Vec<u8> {
    matrix(name, count, 2, &vec![0; count as usize])
}

/// A MATLAB file with each of its elements packed as version 7 does; what does not look like an element is left as it
/// is.
pub fn pack(file: &[u8]) -> Vec<u8> {
    let mut packed = file[..file.len().min(128)].to_vec();
    let mut rest = &file[packed.len()..];
    while let Some((tag, _)) = rest.split_at_checked(8) {
        let length = u32::from_le_bytes([tag[4], tag[5], tag[6], tag[7]]) as usize;
        let Some((element, after)) = length.checked_add(8).and_then(|end| rest.split_at_checked(end)) else { break };
        if tag[0] == 15 {
            packed.extend(element);
        } else {
            let mut zip = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            let bytes = zip.write_all(element).and_then(|()| zip.finish()).unwrap_or_default();
            packed.extend(15_u32.to_le_bytes());
            packed.extend((bytes.len() as u32).to_le_bytes());
            packed.extend(bytes);
        }
        rest = after;
    }
    packed.extend(rest);
    packed
}

/// Recordings of an accelerometer.
pub fn samples() -> Vec<Seed> {
    let recording = |separator: char, rate: f64| {
        let mut text = format!("#time{separator}accel_x{separator}accel_y{separator}accel_z\n");
        for k in 0..260 {
            let time = 4321.5 + f64::from(k) / rate;
            let [x, y, z] = [40.0, 70.0, 9.0].map(|f: f64| 1000.0 * (std::f64::consts::TAU * f * time).sin());
            let _ = writeln!(text, "{time:.6}{separator}{x:.3}{separator}{y:.3}{separator}{z:.3}");
        }
        text
    };
    let mut seeds =
        vec![good("as Klipper writes it", recording(',', 250.0)), good("semicolons", recording(';', 220.0))];
    seeds.extend(wrong("tests/bad/shape", "csv"));
    seeds
}

/// Spectra of an accelerometer.
pub fn spectra() -> Vec<Seed> {
    let spectrum = |more: &str| {
        let mut text = format!("freq,psd_x,psd_y,psd_z,psd_xyz{more}\n");
        for k in 0..60 {
            let f = 5.0 + 3.0 * f64::from(k);
            let x = 1e4 / (1.0 + ((f - 45.0) / 5.0).powi(2));
            let rest = if more.is_empty() { "" } else { ",1,0.5" };
            let _ = writeln!(text, "{f},{x:.2},{:.2},10,{:.2}{rest}", 0.2 * x, 1.2 * x + 10.0);
        }
        text
    };
    let mut seeds = vec![good("resonances", spectrum("")), good("calibration data", spectrum(",shapers:,zv(45.2)"))];
    seeds.extend(wrong("tests/bad/shape", "csv"));
    seeds
}

/// Lists of moves.
pub fn gcode() -> Vec<Seed> {
    let mut seeds: Vec<Seed> = [
        "G1 X50 F3000 ; out at 50 mm/s\nG4 P200\nG0 X0",
        "G20\nG91\nG1 X1.5 F60\nG4 S0.5\nX-1.5\nG90 G21 (millimetres again)\nG0 X10",
        "N10 G21 G90\nN20 G1 X10 F600\nN30 X20\nN40 X-20 F1200\nN50 G4 P0",
        "g0x5\ng0x5\n\n;nothing\n",
        "G4 S1000000",
        "G91\nG0 X.001\nG0 X-1e0",
    ]
    .iter()
    .enumerate()
    .map(|(k, text)| Seed { good: k < 4, ..any(text, *text) })
    .collect();
    seeds.extend(wrong_cases().filter_map(|(name, bytes)| {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let list = text.split("gcode = \"").nth(1)?.split('"').next()?.replace("\\n", "\n");
        Some(any(&name, list))
    }));
    seeds
}

/// Draws of the fit of two logs.
pub fn draws() -> Vec<Seed> {
    let case = fitted();
    let Some(plan) = &case.fit else { unreachable!("the case has a fit") };
    let problem = fit::Problem::new(case, plan).unwrap_or_else(|error| panic!("{error}"));
    let parameters = &problem.parameters;
    let headings: Vec<String> =
        parameters.iter().map(|parameter| Column::new(parameter.name.clone(), parameter.unit).heading()).collect();
    let middle: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    let mut text = format!("chain,draw,{}\n", headings.join(","));
    for k in 0..30 {
        let row: Vec<String> = middle.iter().map(|x| (x * (1.0 + 0.01 * f64::from(k))).to_string()).collect();
        let _ = writeln!(text, "{},{k},{}", k % 4, row.join(","));
    }
    let one: Vec<String> = middle.iter().map(f64::to_string).collect();
    vec![
        good("draws", text),
        good("one draw", format!("{}\n{}\n", headings.join(","), one.join(","))),
        any("no draws", format!("{}\n", headings.join(","))),
    ]
}
