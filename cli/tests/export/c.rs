//! C: compilers, analysers, and the same numbers as taut's, on this machine and on a Cortex-M4F.

use super::machines::{Commands, commands, drawn_gantry, noisy, observed, observed_drives, pulse, ways};
use super::tools::{are_there, doubles, file, run, taut, write_doubles};
use nalgebra::Complex;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;
use taut::case::Case;
use taut::control::feedback::Feedback;
use taut::control::{Controller, Observation, Standard};
use taut::signal::profile::Reference;
use tempfile::TempDir;

/// Warnings that every compiler is asked for.
const STRICT: [&str; 8] =
    ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-Wconversion", "-ffp-contract=off", "-O2"];

/// A processor with single precision in hardware.
const ARM: [&str; 4] = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"];

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";

/// Machines with their commands' size: each kind of part that works piece by piece is in one of them.
pub const MACHINES: [(&str, &[&str], f64); 12] = [
    (TABLE4, &[], 8.0),
    ("stages/sollmann-jouaneh/table1.toml", &["cart.friction.coulomb=0.2 N"], 8.0),
    ("stages/sollmann-jouaneh/rig.toml", &[], 8.0),
    ("stages/two-mass/two-mass.toml", &[], 8.0),
    (TABLE4, &["motor.inductance=1 mH", "amplifier.current_limit=3 A", "amplifier.voltage_limit=7 V"], 12.0),
    (TABLE4, &["motor.gear_ratio=2", "motor.gear_efficiency=0.8", "motor.rotor_inertia=1e-5 kg m^2"], 12.0),
    (TABLE4, &["belt.pretension=3 N", "drive_pulley.friction.static=0.02 N m"], 24.0),
    (
        TABLE4,
        &["travel.min=-20 mm", "travel.max=20 mm", "travel.stop_stiffness=1e5 N/m", "travel.stop_damping=20 N s/m"],
        8.0,
    ),
    (
        TABLE4,
        &[
            "cart.force_along=[[\"-20 mm\", \"0.3 N\"], [\"0 mm\", \"0 N\"], [\"10 mm\", \"-0.4 N\"], [\"40 mm\", \"0.5 N\"]]",
            "cart.force_by_speed=[[\"-0.1 m/s\", \"0.1 N\"], [\"0 m/s\", \"0 N\"], [\"0.1 m/s\", \"-0.4 N\"]]",
        ],
        8.0,
    ),
    ("stages/h-frame/h-frame.toml", &[], 6.0),
    ("stages/core-xy/core-xy.toml", &[], 6.0),
    ("stages/dual-belt/dual-belt.toml", &[], 6.0),
];

/// A machine with a stepper, whose commands jump by less than two full steps.
pub const STEPPER: (&str, &[&str], f64) = ("stages/stepper-axis/stepper-axis.toml", &[], 1.5e-4);

/// The bundled controllers: every structure, feed-forward, observer and filter.
pub const CONTROLLERS: [&str; 13] = [
    "cascade-current",
    "cascade",
    "fuzzy-pd",
    "fuzzy-pi",
    "lqg",
    "lqi",
    "pid-elastic",
    "pid-observer",
    "pid-rigid",
    "pid-shaped",
    "pid",
    "sliding-cart",
    "sliding",
];

fn controller(name: &str) -> String {
    file(&format!("stages/sollmann-jouaneh/controllers/{name}.toml"))
}

/// Exports a case as `model.c` and `model.h`, with the harnesses beside it.
pub fn exported(case: &str, changes: &[&str], options: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut words = vec!["export", "c", case, "--out", "model.c"];
    changes.iter().for_each(|change| words.extend(["--set", change]));
    words.extend(options);
    let output = taut(folder.path(), &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for name in ["plant.c", "control.c", "clock.h", "arm.c", "arm.ld"] {
        fs::copy(file(&format!("cli/tests/export/{name}")), folder.path().join(name)).unwrap();
    }
    folder
}

/// Compiles with a harness and more options, and runs it here.
pub fn run_here(folder: &Path, harness: &str, options: &[&str]) -> String {
    let mut words = STRICT.to_vec();
    words.extend(options);
    words.extend(["-c", "model.c", "-o", "model.o"]);
    run(folder, "gcc", &words);
    let mut words = vec!["-O2", harness, "model.o", "-o", "here"];
    words.extend(options);
    run(folder, "gcc", &words);
    run(folder, folder.join("here"), &[])
}

fn flat(commands: &Commands) -> impl Iterator<Item = f64> + '_ {
    commands.iter().flatten().copied()
}

fn opened(case: &str, changes: &[&str]) -> Case {
    Case::read_with(file(case), changes).unwrap()
}

#[test]
fn compilers_and_analysers_find_nothing() {
    if !are_there(&["gcc", "clang", "cppcheck"]) {
        return;
    }
    let controllers: Vec<String> =
        CONTROLLERS.iter().map(|name| format!("stages/sollmann-jouaneh/controllers/{name}.toml")).collect();
    let plants = MACHINES.iter().chain([&STEPPER]).map(|(case, changes, _)| (*case, *changes));
    let all = plants.chain(controllers.iter().map(|case| (case.as_str(), &[][..])));
    for (k, (case, changes)) in all.enumerate() {
        for real in ["double", "float"] {
            let folder = exported(&file(case), changes, &["--real", real]);
            for compiler in ["gcc", "clang"] {
                let mut words = STRICT.to_vec();
                words.extend(["-Wdouble-promotion", "-Wshadow", "-c", "model.c", "-o", "model.o"]);
                run(folder.path(), compiler, &words);
            }
            // An analyser takes longer than both.
            if k % 4 == 0 {
                let checks = ["--enable=warning,portability,performance", "--error-exitcode=1", "--quiet", "model.c"];
                run(folder.path(), "cppcheck", &checks);
                misra(folder.path());
            }
        }
    }
}

/// The rules of MISRA C that the analyser's addon finds broken are those that the source names.
fn misra(folder: &Path) {
    let words = ["--addon=misra", "--quiet", "--std=c99", "model.c"];
    let output = super::tools::try_to(folder, Path::new("cppcheck"), &words);
    let source = fs::read_to_string(folder.join("model.c")).unwrap();
    let named = source.split_once("*/").unwrap().0;
    let told = String::from_utf8_lossy(&output.stderr);
    for rule in told.split("[misra-c2012-").skip(1).filter_map(|rest| rest.split(']').next()) {
        assert!(named.split([' ', ',']).any(|word| word == rule), "{rule}: {told}");
    }
}

#[test]
fn the_plant_moves_as_taut_simulates() {
    if !are_there(&["gcc"]) {
        return;
    }
    for (case, changes, size) in MACHINES {
        let opened = opened(case, changes);
        let drives = taut::export::mechanism(&opened).drives.len();
        let commands = commands(drives, size, 7);
        let ways = ways(&opened, &commands);
        for (real, most) in [("double", 1e-12), ("float", 1e-6)] {
            let folder = exported(&file(case), changes, &["--real", real, "--part", "plant"]);
            write_doubles(&folder.path().join("in.bin"), flat(&commands));
            // A finding of a sanitizer ends the program.
            let options = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
            let told = run_here(folder.path(), "plant.c", &options);
            let off = ways.differ(&doubles(&folder.path().join("out.bin")));
            println!("{case} {changes:?} {real}: {off:e} m, {}", told.trim());
            assert!(off <= most, "{case} {changes:?} {real}: {off:e} m");
        }
    }
}

#[test]
fn the_controller_replays_moves_bit_for_bit() {
    if !are_there(&["gcc"]) {
        return;
    }
    for name in CONTROLLERS {
        let case = Case::read(controller(name)).unwrap();
        let folder = exported(&controller(name), &[], &["--part", "controller"]);
        let exact = (0..case.moves.len()).map(|which| (which, observed(&case, which)));
        // A reference of rounded numbers, whose speed is never zero: its friction once had a dead zone nowhere.
        for (which, seen) in exact.chain([(0, noisy(&case, 0, 5))]) {
            write_doubles(&folder.path().join("in.bin"), seen.iter().flat_map(|(seen, _)| *seen));
            run_here(folder.path(), "control.c", &[]);
            let given = doubles(&folder.path().join("out.bin"));
            assert_eq!(given.len(), seen.len());
            let first = seen.iter().zip(&given).position(|((_, own), other)| own.to_bits() != other.to_bits());
            if let Some(k) = first {
                panic!("{name}, move {which}: sample {k} is {:e} and not {:e}", given[k], seen[k].1);
            }
        }
    }
}

/// A command above the largest number of 32 bits was taken as zero in 64 bits, too: a diverging loop in C went another
/// way than by `taut move` from 3.4e38 V on. One that is not finite is still zero, as there.
#[test]
fn only_a_command_that_is_not_finite_is_zero() {
    if !are_there(&["gcc"]) {
        return;
    }
    // A controller without a limit.
    let pid =
        "controller={ every = \"1 ms\", pid = { proportional = 100, integral = 0, derivative = 0, filter = 200 } }";
    let folder = exported(&controller("pid"), &[pid], &["--part", "controller"]);
    let text = super::st::changed(&controller("pid"), &[pid]);
    let case = opened("stages/sollmann-jouaneh/controllers/pid.toml", &[pid]);
    for (position, is_finite) in [(-1e30, true), (-1e60, true), (1e290, true), (-1e308, false), (f64::NAN, false)] {
        let mut seen = [0.0; 12];
        seen[10] = position;
        let mut own = Standard::new(case.controller.as_ref().unwrap(), &case.machine).unwrap();
        let still = Reference::default();
        let asked =
            own.step(&Observation { time: 0.0, reference: still, ahead: still, position, scale: None, current: 0.0 });
        let given = if is_finite { asked } else { 0.0 };
        assert_eq!(asked.is_finite(), is_finite, "{asked:e}");
        write_doubles(&folder.path().join("in.bin"), seen);
        run_here(folder.path(), "control.c", &[]);
        assert_eq!(doubles(&folder.path().join("out.bin")), [given], "C, {position:e} m");
        assert_eq!(super::st::replayed(&text, &[(seen, given)]), [given], "Structured Text, {position:e} m");
    }
    // The numbers of 32 bits end earlier.
    let folder = exported(&controller("pid"), &[pid], &["--part", "controller", "--real", "float"]);
    for (position, is_finite) in [(-1e30, true), (-1e38, false)] {
        let mut seen = [0.0; 12];
        seen[10] = position;
        write_doubles(&folder.path().join("in.bin"), seen);
        run_here(folder.path(), "control.c", &[]);
        let given = doubles(&folder.path().join("out.bin"))[0];
        assert_eq!(given != 0.0, is_finite, "{position:e} m: {given:e}");
    }
}

/// Gantries in closed loop, with changes.
pub const GANTRIES: [(&str, &[&str]); 7] = [
    ("stages/h-frame/square.toml", &[]),
    ("stages/core-xy/square.toml", &["controller.limit=3 V"]),
    ("stages/dual-belt/square.toml", &[]),
    (
        "stages/core-xy/square.toml",
        &[
            "controller={ every = \"1 ms\", limit = \"24 V\", cascade = { position = 20, speed = 40, speed_integral = 0.05 } }",
        ],
    ),
    ("stages/h-frame/square.toml", &["controller.filters=[{ low_pass = \"150 Hz\" }]"]),
    ("stages/dual-belt/square.toml", &["controller.feed_forward={ model = \"rigid\" }"]),
    ("stages/core-xy/square.toml", &["controller.feed_forward={ model = \"elastic\", compensate_stretch = true }"]),
];

/// Those, and drawn ones with feed-forward.
pub fn gantries() -> impl Iterator<Item = (String, Vec<String>)> {
    let owned =
        |(path, changes): (&str, &[&str])| (path.to_string(), changes.iter().map(ToString::to_string).collect());
    GANTRIES.into_iter().map(owned).chain((0..24).map(drawn_gantry))
}

/// Each motor of a gantry has a controller in files of its own.
#[test]
fn the_controllers_of_a_gantry_replay_moves_bit_for_bit() {
    if !are_there(&["gcc"]) {
        return;
    }
    for (number, (path, changes)) in gantries().enumerate() {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let case = opened(&path, &changes);
        let folder = exported(&file(&path), &changes, &["--part", "controller"]);
        let harness = fs::read_to_string(folder.path().join("control.c")).unwrap();
        for (side, seen) in case.machine.geometry().sides().zip(observed_drives(&case, 0)) {
            let own = format!("model_{side}");
            let text = harness.replace("model_", &format!("{own}_")).replace("\"model.h\"", &format!("\"{own}.h\""));
            fs::write(folder.path().join("control.c"), text).unwrap();
            fs::copy(folder.path().join(format!("{own}.c")), folder.path().join("model.c")).unwrap();
            write_doubles(&folder.path().join("in.bin"), seen.iter().flat_map(|(seen, _)| seen.iter().copied()));
            run_here(folder.path(), "control.c", &["-DSLIDES=2"]);
            let given = doubles(&folder.path().join("out.bin"));
            assert_eq!(given.len(), seen.len());
            let first = seen.iter().zip(&given).position(|((_, own), other)| own.to_bits() != other.to_bits());
            assert_eq!(first, None, "{path} {changes:?} {side}");
            if number == GANTRIES.len() - 1 && are_there(&["cppcheck"]) {
                misra(folder.path());
            }
            assert!(seen.iter().any(|(_, given)| *given != 0.0));
        }
    }
}

/// Samples that an impulse is followed for.
const SAMPLES: usize = 6000;

/// Every controller in three ways, which come from one text: as it runs, as C, bit for bit the same, and as margins see
/// it. What an impulse of a measurement makes of the command has the response of the linear view at a grid of
/// frequencies; of a controller that is not linear an impulse small enough does, from rest.
#[test]
fn a_controller_that_runs_is_its_program_and_its_margins() {
    if !are_there(&["gcc"]) {
        return;
    }
    for name in CONTROLLERS {
        let case = Case::read(controller(name)).unwrap();
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        let (size, bound) = if feedback.is_linear() { (1e-5, 1e-6) } else { (1e-8, 1e-4) };
        let folder = exported(&controller(name), &[], &["--part", "controller"]);
        let commands = |impulse: Option<usize>| {
            let mut seen = vec![[0.0; 12]; SAMPLES];
            impulse.into_iter().for_each(|input| seen[1][input] = size);
            let mut own = Standard::new(design, &case.machine).unwrap();
            let still = Reference::default();
            let step = |all: &[f64; 12]| {
                let (position, current) = (all[10], all[11]);
                let seen = Observation { time: 0.0, reference: still, ahead: still, position, scale: None, current };
                let asked = own.step(&seen);
                let given = design.limit.map_or(asked, |limit| asked.clamp(-limit, limit));
                own.limited(given);
                given
            };
            let given: Vec<f64> = seen.iter().map(step).collect();
            write_doubles(&folder.path().join("in.bin"), seen.iter().flatten().copied());
            run_here(folder.path(), "control.c", &[]);
            let written = doubles(&folder.path().join("out.bin"));
            let first = given.iter().zip(&written).position(|(own, other)| own.to_bits() != other.to_bits());
            assert_eq!((first, written.len()), (None, SAMPLES), "{name}");
            given
        };
        let still = commands(None);
        let inputs = [(10, true), (11, feedback.uses_current())];
        for (input, _) in inputs.into_iter().filter(|(_, is_used)| *is_used) {
            let pushed = commands(Some(input));
            let mut answer: Vec<f64> = pushed.iter().zip(&still).map(|(a, b)| (a - b) / size).collect();
            // Differences of differences end, whatever two integrals keep.
            for _ in 0..2 {
                answer = (0..SAMPLES).map(|k| answer[k] - if k > 0 { answer[k - 1] } else { 0.0 }).collect();
            }
            for hertz in [0.7, 2.0, 5.0, 11.0, 23.0, 47.0, 90.0, 180.0, 310.0, 460.0] {
                let theta = 2.0 * PI * hertz * design.every;
                let back = |k: f64| Complex::new(0.0, -theta * k).exp();
                let sum: Complex<f64> = answer.iter().enumerate().map(|(k, h)| back(k as f64 - 1.0) * *h).sum();
                let found = sum / (Complex::new(1.0, 0.0) - back(1.0)).powi(2);
                let terms = feedback.at(2.0 * PI * hertz);
                let told = -if input == 10 { terms.position } else { terms.current } / terms.own;
                let apart = (found - told).norm() / told.norm();
                assert!(apart < bound, "{name}, input {input} at {hertz} Hz: {found} and {told}, {apart:.1e} apart");
            }
        }
    }
}

/// A model on a Cortex-M4F: its numbers and its cost.
pub struct OnArm {
    pub code: usize,
    pub data: usize,
    pub stack: usize,
    pub told: String,
    pub symbols: String,
}

/// Compiles for a Cortex-M4F and runs under QEMU.
pub fn run_on_arm(folder: &Path, harness: &str) -> OnArm {
    let mut words = STRICT.to_vec();
    words.extend(ARM);
    words.extend(["-Wdouble-promotion", "-fstack-usage", "-c", "model.c", "-o", "model.o"]);
    run(folder, "arm-none-eabi-gcc", &words);
    let sizes = run(folder, "arm-none-eabi-size", &["model.o"]);
    let sizes: Vec<usize> =
        sizes.lines().nth(1).unwrap().split_whitespace().take(3).map(|size| size.parse().unwrap()).collect();
    let symbols = run(folder, "arm-none-eabi-nm", &["model.o"]);
    // No chain of calls is deeper than all functions together.
    let usage = fs::read_to_string(folder.join("model.su")).unwrap();
    let stack = usage.lines().map(|line| line.split('\t').nth(1).unwrap().parse::<usize>().unwrap()).sum();
    assert!(usage.lines().all(|line| line.ends_with("static")), "{usage}");
    let mut words = vec!["-O2"];
    words.extend(ARM);
    words.extend(["-specs=rdimon.specs", "-T", "arm.ld", harness, "arm.c", "model.o", "-o", "arm.elf"]);
    run(folder, "arm-none-eabi-gcc", &words);
    let machine = ["-M", "mps2-an386", "-nographic", "-semihosting-config", "enable=on,target=native"];
    let mut words = vec!["100", "qemu-system-arm"];
    words.extend(machine);
    words.extend(["-icount", "shift=0", "-kernel", "arm.elf"]);
    let told = run(folder, "timeout", &words).trim().to_string();
    OnArm { code: sizes[0] + sizes[1], data: sizes[1] + sizes[2], stack, told, symbols }
}

const ON_ARM: [&str; 4] = ["gcc", "arm-none-eabi-gcc", "qemu-system-arm", "timeout"];

#[test]
fn a_cortex_m4f_gives_the_same_numbers() {
    if !are_there(&ON_ARM) {
        return;
    }
    let commands = pulse(5.0, 250);
    let mut rows = Vec::new();
    for real in ["double", "float"] {
        let folder = exported(&file(TABLE4), &[], &["--real", real]);
        write_doubles(&folder.path().join("in.bin"), flat(&commands));
        run_here(folder.path(), "plant.c", &[]);
        let here = doubles(&folder.path().join("out.bin"));
        let arm = run_on_arm(folder.path(), "plant.c");
        let there = doubles(&folder.path().join("out.bin"));
        rows.push(arm.row(&format!("plant, {real}")));
        let symbols = arm.symbols;
        assert_eq!(here.len(), there.len());
        assert!(here.iter().zip(&there).all(|(a, b)| a.to_bits() == b.to_bits()), "{real}");
        check_symbols(&symbols, real);
    }
    for name in ["pid", "cascade-current", "lqi"] {
        let case = Case::read(controller(name)).unwrap();
        let seen = observed(&case, 0);
        for real in ["double", "float"] {
            let folder = exported(&controller(name), &[], &["--part", "controller", "--real", real]);
            write_doubles(&folder.path().join("in.bin"), seen.iter().flat_map(|(seen, _)| *seen));
            run_here(folder.path(), "control.c", &[]);
            let here = doubles(&folder.path().join("out.bin"));
            let arm = run_on_arm(folder.path(), "control.c");
            rows.push(arm.row(&format!("{name}, {real}")));
            let symbols = arm.symbols;
            let there = doubles(&folder.path().join("out.bin"));
            assert!(here.iter().zip(&there).all(|(a, b)| a.to_bits() == b.to_bits()), "{name} {real}");
            check_symbols(&symbols, real);
        }
    }
    documented(&rows);
}

impl OnArm {
    /// Bytes of flash, memory and stack, and instructions on average and at most.
    fn row(&self, what: &str) -> (String, Vec<usize>) {
        let words: Vec<&str> = self.told.split_whitespace().collect();
        let after = |word: &str| words[words.iter().position(|w| *w == word).unwrap() + 1].parse().unwrap();
        let most = words.last().unwrap().parse().unwrap();
        (what.to_string(), vec![self.code, self.data, self.stack, after("instructions"), most])
    }
}

/// The table of docs/export.md: what another version of the compiler makes of it may differ by a quarter.
fn documented(rows: &[(String, Vec<usize>)]) {
    let path = file("docs/export.md");
    let page = fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once("<!-- cortex -->\n").unwrap();
    let (there, after) = rest.split_once("<!-- end -->").unwrap();
    let mut table = String::from("| | flash, bytes | memory, bytes | stack, bytes | instructions | at most |\n");
    table += "|---|---|---|---|---|---|\n";
    for (what, numbers) in rows {
        let numbers: Vec<String> = numbers.iter().map(ToString::to_string).collect();
        table += &format!("| {what} | {} |\n", numbers.join(" | "));
    }
    println!("{table}");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, format!("{before}<!-- cortex -->\n{table}<!-- end -->{after}")).unwrap();
        return;
    }
    for (what, numbers) in rows {
        let line = there.lines().find(|line| line.starts_with(&format!("| {what} |")));
        let line = line.unwrap_or_else(|| panic!("docs/export.md has no row {what}; UPDATE_EXPECT=1 writes it"));
        let shown: Vec<f64> = line.split('|').filter_map(|cell| cell.trim().parse().ok()).collect();
        assert_eq!(shown.len(), numbers.len(), "{line}");
        let near = shown.iter().zip(numbers).all(|(a, b)| (a - *b as f64).abs() <= 0.25 * a + 64.0);
        assert!(near, "docs/export.md: {line} and now {numbers:?}; UPDATE_EXPECT=1 writes the table");
    }
}

/// Nothing of the C library but what a compiler puts in itself, and no double precision where floats are asked for.
fn check_symbols(symbols: &str, real: &str) {
    for line in symbols.lines().filter(|line| line.contains(" U ")) {
        let name = line.split_whitespace().last().unwrap();
        let of_compiler = matches!(name, "memset" | "memcpy") || (real == "double" && name.starts_with("__aeabi_"));
        assert!(of_compiler, "{name}");
    }
}

/// An end that is no `Complete`: told as a status, and nothing that is no number.
#[test]
fn what_cannot_go_on_is_a_status() {
    if !are_there(&["gcc"]) {
        return;
    }
    let folder = exported(&file(TABLE4), &["travel.min=-50 mm", "travel.max=50 mm"], &[]);
    write_doubles(&folder.path().join("in.bin"), [f64::NAN]);
    let output = compiled(folder.path());
    assert_eq!(output, Some(3));
    write_doubles(&folder.path().join("in.bin"), vec![24.0; 1000]);
    assert_eq!(compiled(folder.path()), Some(2));
}

/// Compiles the harness of plants here and runs it: its status.
pub fn compiled(folder: &Path) -> Option<i32> {
    run(folder, "gcc", &["-O2", "plant.c", "model.c", "-o", "here"]);
    super::tools::try_to(folder, &folder.join("here"), &[]).status.code()
}
