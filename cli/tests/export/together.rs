//! The paper's machine exported every way, each run in its own tool, and the table of how far they are from taut.

use super::machines::{STEP, STEPS, Ways, observed, pulse, ways};
use super::tools::{are_there, doubles, file, python, run, taut, write_doubles};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use taut::case::Case;

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";
const PID: &str = "stages/sollmann-jouaneh/controllers/pid.toml";

/// A row of the table: target, tool, what is compared, how far it is off, and the most that it may be.
struct Row(&'static str, String, &'static str, f64, f64);

/// Each way, as far as its tools are there.
const RUNS: [fn(&Ways) -> Vec<Row>; 5] = [in_c, in_structured_text, in_octave, in_python, as_json];

/// Runs them and compares with the table in docs/export.md; `UPDATE_EXPECT=1` writes it there.
#[test]
fn every_export_runs_in_its_own_tool() {
    let case = Case::read_with(file(TABLE4), &[]).unwrap();
    let own = ways(&case, &pulse(5.0, 250));
    let (mut table, mut whole) = (String::new(), true);
    let _ = writeln!(table, "| target | run in | compared | largest difference | allowed |\n|---|---|---|---|---|");
    for run in RUNS {
        let rows = run(&own);
        whole &= !rows.is_empty();
        for Row(target, tool, what, off, most) in rows {
            assert!(off <= most, "{target} in {tool}: {off:e} of {what}");
            let off = if off == 0.0 { "none".to_string() } else { format!("below {}", power_above(off)) };
            let most = if most == 0.0 { "none".to_string() } else { format!("{most:e} m") };
            let _ = writeln!(table, "| `{target}` | {tool} | {what} | {off} | {most} |");
        }
    }
    println!("{table}");
    if whole {
        documented(&table);
    }
}

/// The power of ten above a length, m: what does not change with the version of a compiler.
fn power_above(off: f64) -> String {
    format!("1e{} m", off.log10().ceil() as i32)
}

fn documented(table: &str) {
    let path = file("docs/export.md");
    let text = fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once("<!-- differences -->\n").unwrap();
    let (_, after) = rest.split_once("<!-- end -->").unwrap();
    let wanted = format!("{before}<!-- differences -->\n{table}<!-- end -->{after}");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, wanted).unwrap();
    } else {
        // Versions of tools, and what they make of the last bits, are theirs.
        let rows = |text: &str| -> Vec<String> {
            let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_string()).collect::<Vec<_>>();
            let rows = text.lines().map(cells).filter(|cells| cells.len() == 7);
            rows.map(|cells| [&cells[1], &cells[3], &cells[5]].map(String::as_str).join(" | ")).collect()
        };
        assert_eq!(rows(&text), rows(&wanted), "docs/export.md; UPDATE_EXPECT=1 writes the table");
    }
}

fn exported(folder: &Path, target: &str, case: &str, words: &[&str]) {
    let case = file(case);
    let mut all = vec!["export", target, &case];
    all.extend(words);
    let output = taut(folder, &all);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The first line of what a tool says of itself.
fn version(tool: &str, words: &[&str], pick: usize) -> String {
    let told = run(Path::new("."), tool, words);
    let line = told.lines().next().unwrap_or_default();
    line.split_whitespace().nth(pick).unwrap_or(line).trim_end_matches(',').to_string()
}

fn in_c(own: &Ways) -> Vec<Row> {
    if !are_there(&["gcc", "clang", "arm-none-eabi-gcc", "qemu-system-arm"]) {
        return Vec::new();
    }
    let mut rows = Vec::new();
    for (real, most) in [("double", 1e-12), ("float", 1e-6)] {
        let folder = super::c::exported(&file(TABLE4), &[], &["--real", real]);
        write_doubles(&folder.path().join("in.bin"), pulse(5.0, 250).into_iter().flatten());
        super::c::run_here(folder.path(), "plant.c", &[]);
        let off = own.differ(&doubles(&folder.path().join("out.bin")));
        let what = if real == "double" { "ways, double" } else { "ways, float" };
        rows.push(Row("c", format!("gcc {}", version("gcc", &["-dumpfullversion"], 0)), what, off, most));
        super::c::run_on_arm(folder.path(), "plant.c");
        let off = own.differ(&doubles(&folder.path().join("out.bin")));
        let emulator = format!("Cortex-M4F, QEMU {}", version("qemu-system-arm", &["--version"], 3));
        rows.push(Row("c", emulator, what, off, most));
    }
    let case = Case::read(file(PID)).unwrap();
    let seen = observed(&case, 0);
    let folder = super::c::exported(&file(PID), &[], &["--part", "controller"]);
    write_doubles(&folder.path().join("in.bin"), seen.iter().flat_map(|(seen, _)| *seen));
    super::c::run_here(folder.path(), "control.c", &[]);
    let given = doubles(&folder.path().join("out.bin"));
    rows.push(Row("c", "gcc".into(), "commands of a move, V", unlike(&seen, &given), 0.0));
    rows
}

/// How many commands are not the same bits.
fn unlike(seen: &[([f64; 12], f64)], given: &[f64]) -> f64 {
    assert_eq!(seen.len(), given.len());
    seen.iter().zip(given).filter(|((_, own), other)| own.to_bits() != other.to_bits()).count() as f64
}

fn in_structured_text(_: &Ways) -> Vec<Row> {
    let case = Case::read(file(PID)).unwrap();
    let seen = observed(&case, 0);
    let folder = tempfile::tempdir().unwrap();
    exported(folder.path(), "st", PID, &["--out", "pid.st"]);
    let given = super::st::replayed(&fs::read_to_string(folder.path().join("pid.st")).unwrap(), &seen);
    vec![Row("st", "an interpreter of the tests".into(), "commands of a move, V", unlike(&seen, &given), 0.0)]
}

const IN_OCTAVE: &str = "
out = axis([0 5; 0.25 0], 1, 1e-3);
f = fopen('function.bin', 'wb'); fwrite(f, out.position(2:end, :)', 'double'); fclose(f);
commands = zeros(1000, 1); commands(1:250) = 5;
position = axis_mex(commands);
f = fopen('mex.bin', 'wb'); fwrite(f, position', 'double'); fclose(f);
m = load('axis_data.mat');
assert(size(m.A), [6 6]); assert(iscellstr(m.states)); assert(numel(m.output_units), size(m.C, 1));
% The linear model turns about the same poles as the axis: one integrator, all else dies away.
assert(sum(abs(eig(m.A)) < 1e-6), 1); assert(all(real(eig(m.A)) < 1e-6));
try
  axis_mex([1 2]); error('it should have been refused');
catch e
  assert(~isempty(strfind(e.message, 'a matrix of commands')));
end
";

fn in_octave(own: &Ways) -> Vec<Row> {
    if !are_there(&["octave-cli", "mkoctfile"]) {
        return Vec::new();
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    exported(at, "matlab", TABLE4, &["--out", "axis.m"]);
    run(at, "mkoctfile", &["--mex", "axis_mex.c", "axis_plant.c"]);
    fs::write(at.join("check.m"), IN_OCTAVE).unwrap();
    run(at, "octave-cli", &["--no-init-file", "--quiet", "check.m"]);
    let tool = format!("GNU Octave {}", version("octave-cli", &["--version"], 3));
    let mex = tool.clone() + ", MEX";
    vec![
        Row("matlab", tool, "ways", own.differ(&doubles(&at.join("function.bin"))), 1e-9),
        Row("matlab", mex, "ways", own.differ(&doubles(&at.join("mex.bin"))), 1e-12),
    ]
}

const IN_PYTHON: &str = "
import numpy as np, scipy, control, axis
result = axis.simulate([(0.0, 5.0), (0.25, 0.0)], until=1.0)
np.array([result[b + '_position'][1:] for b in axis.BODIES]).T.tofile('out.bin')
system = axis.linear()
assert system.nstates == 6 and system.input_labels == ['voltage_command']
assert sum(abs(system.poles()) < 1e-6) == 1
print(scipy.__version__)
";

fn in_python(own: &Ways) -> Vec<Row> {
    let Some(python) = python() else { return Vec::new() };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    exported(at, "python", TABLE4, &["--out", "axis.py"]);
    fs::write(at.join("check.py"), IN_PYTHON).unwrap();
    let version = run(at, python, &["check.py"]);
    let off = own.differ(&doubles(&at.join("out.bin")));
    vec![Row("python", format!("SciPy {}", version.trim()), "ways", off, 1e-9)]
}

/// The tables of the JSON give the rates of change that the C begins with: read again, the case is the same machine.
fn as_json(own: &Ways) -> Vec<Row> {
    let folder = tempfile::tempdir().unwrap();
    exported(folder.path(), "json", TABLE4, &["--out", "axis.json"]);
    let text = fs::read_to_string(folder.path().join("axis.json")).unwrap();
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    let again = Case::from_text_with("axis.toml", data["case"].as_str().unwrap(), &[]).unwrap();
    let again = ways(&again, &pulse(5.0, 250));
    let flat: Vec<f64> =
        again.ways.iter().flat_map(|row| row.iter().zip(&again.levers).map(|(way, lever)| way / lever)).collect();
    assert_eq!((STEPS, STEP), (own.ways.len(), 1e-3));
    vec![Row("json", "taut, the case in it read again".into(), "ways", own.differ(&flat), 1e-15)]
}
