//! Machines with steppers in C, drawn at random, against taut's own solver along the same held commands.

use super::c::{compiled, run_here};
use super::in_loop::in_loop;
use super::machines::random;
use super::tools::{are_there, doubles, file, python, run, taut, write_doubles};
use std::fmt::Write;
use std::fs;
use taut::case::Case;
use taut::control::{Setup, Stepped, closed_loop};
use taut::mechanism::{State, Status, What};
use taut::signal::Signal;
use taut::signal::profile::Reference;
use taut::solve::{Ending, Simulator, Solution, Solver, simulate};
use tempfile::TempDir;

/// Steps of a command, of 1 ms each.
const STEPS: usize = 120;

/// A machine in a case whose commands are held, and the commands of its drives.
struct Drawn {
    case: String,
    commands: Vec<Vec<f64>>,
}

/// Smooth ways there and back, in which no command jumps by more than two full steps; some are too fast for the motor.
fn drawn(seed: u64) -> Drawn {
    let mut uniform = random(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * uniform();
    let is_plane = between(0.0, 1.0) < 0.4;
    let (holding, rated) = (between(0.2, 1.0), between(0.8, 3.0));
    let resistance = between(0.8, 2.5) / rated;
    let chopper = between(0.0, 1.0) < 0.7;
    let supply = if chopper { between(12.0, 36.0) } else { 2.0_f64.sqrt() * rated * resistance * 0.999 };
    let drive = if chopper { "chopper" } else { "voltage" };
    let (radius, microsteps) = (between(5e-3, 1e-2), [1, 4, 16][(3.0 * between(0.0, 0.999)) as usize]);
    let kind = if is_plane { "kind = \"core-xy\"\n" } else { "" };
    let mut case = format!(
        "{kind}[stepper]\nsteps_per_turn = 200\nholding_torque = {holding:e}\nrated_current = {rated:e}\nresistance = {resistance:e}\n\
         inductance = {:e}\nsupply = {supply:e}\ndrive = \"{drive}\"\nmicrosteps = {microsteps}\ninterpolate = {}\n\
         detent_torque = {:e}\nrotor_inertia = {:e}\n",
        resistance * between(1e-3, 3e-3),
        between(0.0, 1.0) < 0.3,
        holding * between(0.0, 0.05),
        1.2e-5 * holding,
    );
    let (viscous, coulomb) = (between(0.5, 5.0), holding / radius * between(0.0, 0.1));
    let stiffness = 10f64.powf(between(4.0, 5.3));
    let slide = |mass: f64| format!("mass = {mass:e}\nfriction = {{ viscous = {viscous:e}, coulomb = {coulomb:e} }}\n");
    let pulley = format!("radius = {radius:e}\ninertia = 1e-6\n");
    let drives = if is_plane { 2 } else { 1 };
    match is_plane {
        true => {
            let _ = write!(
                case,
                "[drive_pulley]\n{pulley}[cart]\n{}[bridge]\n{}[belt]\nstiffness = {:?}\ndamping = [2.0, 3.0, 4.0, 5.0]\n",
                slide(between(0.1, 0.4)),
                slide(between(0.3, 0.8)),
                [1.0, 0.7, 0.9, 0.6].map(|share| share * stiffness),
            );
        }
        false => {
            let _ = write!(
                case,
                "[drive_pulley]\n{pulley}friction = {{ coulomb = {:e} }}\n[cart]\n{}[idler_pulley]\ninertia = 5e-7\n[belt]\n\
                 stiffness = [{stiffness:e}, {stiffness:e}, {:e}]\ndamping = [{:e}, {:e}, {:e}]\n",
                holding * between(0.0, 0.05),
                slide(between(0.1, 0.5)),
                0.5 * stiffness,
                1e-4 * stiffness,
                1e-4 * stiffness,
                5e-5 * stiffness,
            );
        }
    }
    // Two full steps of 1.8 degrees each are the most of a command.
    let most = 2.0 * radius * 1.8_f64.to_radians() * between(0.1, 0.9);
    let shares: Vec<f64> = (0..drives).map(|_| between(-1.0, 1.0)).collect();
    let mut at = vec![0.0; drives];
    let mut commands = Vec::new();
    for k in 0..STEPS {
        let way = (std::f64::consts::PI * k as f64 / 30.0).sin();
        at.iter_mut().zip(&shares).for_each(|(at, share)| *at += if k < 90 { share * most * way } else { 0.0 });
        commands.push(at.clone());
    }
    let held = |drive: usize| -> String {
        let each = commands.iter().map(|command| format!("{{ step = {:?}, lasts = \"1 ms\" }}", command[drive]));
        format!("{{ sequence = [{}, {{ step = {:?} }}] }}", each.collect::<Vec<_>>().join(", "), at[drive])
    };
    let input = match drives {
        1 => held(0),
        _ => format!("{{ left = {}, right = {} }}", held(0), held(1)),
    };
    let _ =
        write!(case, "[[experiment]]\nname = \"held\"\nuntil = \"{STEPS} ms\"\nevery = \"1 ms\"\ninput = {input}\n");
    Drawn { case, commands }
}

fn exported(drawn: &Drawn, options: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case.toml");
    fs::write(&case, &drawn.case).unwrap();
    super::c::exported(case.to_str().unwrap(), &[], options)
}

/// Runs it: what it writes, and the lost steps.
fn in_c(drawn: &Drawn, options: &[&str]) -> (Vec<f64>, Vec<i32>) {
    let folder = exported(drawn, options);
    write_doubles(&folder.path().join("in.bin"), drawn.commands.iter().flatten().copied());
    let options = ["-DSTEPPERS", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let told = run_here(folder.path(), "plant.c", &options);
    let lost = told.lines().filter_map(|line| line.strip_prefix("lost ")).map(|steps| steps.parse().unwrap()).collect();
    (doubles(&folder.path().join("out.bin")), lost)
}

fn solved(drawn: &Drawn) -> (Case, Solution) {
    let case = Case::from_text("case.toml", &drawn.case).unwrap_or_else(|error| panic!("{error}\n{}", drawn.case));
    let solution = simulate(&case.machine, &case.experiments[0], Solver::General { tolerance: 1e-11 }).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Complete);
    (case, solution)
}

/// Each position within 1e-9 m at the belt of taut's, each current within a millionth of the rated one, and the same
/// steps lost; in single precision within 20 µm, unless steps are lost.
#[test]
fn drawn_machines_go_where_taut_has_them() {
    if !are_there(&["gcc"]) {
        return;
    }
    let (mut lost_any, mut kept_all) = (0, 0);
    for seed in 0..16 {
        let drawn = drawn(500 + seed);
        let (case, solution) = solved(&drawn);
        let mechanism = case.machine.mechanism();
        let (bodies, drives) = (mechanism.bodies.len(), mechanism.drives.len());
        let (written, lost) = in_c(&drawn, &[]);
        let row = bodies + 2 * drives;
        assert_eq!(written.len(), row * STEPS, "{seed}");
        let columns = &solution.trajectory.columns;
        let positions: Vec<_> =
            columns.iter().filter(|c| c.name.ends_with("_angle") || c.name.ends_with("_position")).collect();
        assert_eq!(positions.len(), bodies, "{:?}", columns.iter().map(|c| &c.name).collect::<Vec<_>>());
        let (second, first): (Vec<_>, Vec<_>) = columns
            .iter()
            .filter(|column| column.name.ends_with("_current"))
            .partition(|column| column.name.contains("second_phase"));
        let currents: Vec<_> = first.iter().zip(&second).collect();
        assert_eq!(currents.len(), drives);
        let (mut off, mut off_current): (f64, f64) = (0.0, 0.0);
        for k in 1..STEPS {
            let own = &written[row * (k - 1)..row * k];
            for (body, column) in positions.iter().enumerate() {
                off = off.max((own[body] - column.values[k]).abs() * mechanism.bodies[body].kind.lever());
            }
            for (drive, (first, second)) in currents.iter().enumerate() {
                let both = &own[bodies + 2 * drive..];
                off_current =
                    off_current.max((both[0] - first.values[k]).abs().max((both[1] - second.values[k]).abs()));
            }
        }
        let mut behind = vec![0; drives];
        for event in &solution.outcome.events {
            if let (What::Field(drive), Status::Slipped(pitches)) = (event.part.what, event.to) {
                behind[drive] = 4 * pitches;
            }
        }
        println!("{seed}: {off:.1e} m, {off_current:.1e} A, {lost:?}");
        let rated = mechanism.drives[0].motor.stepper.unwrap().rated_current;
        let is_kept = behind.iter().all(|steps| *steps == 0);
        // A rotor that falls to another tooth amplifies what is off before.
        let most = if is_kept { 1e-9 } else { 1e-7 };
        assert!(off < most && off_current < 1e3 * most * rated, "{seed}: {off:e} m, {off_current:e} A\n{}", drawn.case);
        assert_eq!(lost, behind, "{seed}\n{}", drawn.case);
        if is_kept {
            kept_all += 1;
            let (single, lost) = in_c(&drawn, &["--real", "float"]);
            let each = single
                .chunks(row)
                .zip(written.chunks(row))
                .flat_map(|(a, b)| (0..bodies).map(move |body| (a[body] - b[body]).abs()));
            let levers = mechanism.bodies.iter().map(|body| body.kind.lever()).fold(0.0, f64::max);
            let off = each.fold(0.0, f64::max) * levers.min(1.0);
            assert!(lost == behind && off < 2e-5, "{seed}: {off:e} m in single precision");
        } else {
            lost_any += 1;
        }
    }
    assert!(lost_any > 0 && kept_all > 4, "{lost_any} lost steps, {kept_all} did not");
}

/// Each position of every body after each step, in m at the belt, by taut's own solver.
fn ways(case: &Case, solution: &Solution) -> Vec<f64> {
    let mechanism = case.machine.mechanism();
    let columns = &solution.trajectory.columns;
    let positions: Vec<_> =
        columns.iter().filter(|c| c.name.ends_with("_angle") || c.name.ends_with("_position")).collect();
    let levers: Vec<f64> = mechanism.bodies.iter().map(|body| body.kind.lever()).collect();
    (1..STEPS).flat_map(|k| positions.iter().zip(&levers).map(move |(own, lever)| own.values[k] * lever)).collect()
}

const IN_PYTHON: &str = "
import numpy as np, axis
commands = np.fromfile('in.bin').reshape(-1, len(axis.DRIVES))
result = axis.simulate([(1e-3 * k, row) for k, row in enumerate(commands)], until=1e-3 * (len(commands) - 1))
ways = [result[b + '_position'][1:] * lever for b, lever in zip(axis.BODIES, axis.LEVERS)]
np.array(ways).T.tofile('out.bin')
print(*(int(result[d + '_lost_steps'][-1]) for d in axis.DRIVES))
try:
    axis.simulate([(0.0, [5e-3] * len(axis.DRIVES))], until=1e-3)
    raise SystemExit('a jump was taken')
except ValueError as error:
    assert 'two full steps' in str(error), error
";

const IN_OCTAVE: &str = "
f = fopen('in.bin'); commands = fread(f, 'double'); fclose(f);
m = load('axis_data.mat', 'drives', 'levers');
commands = reshape(commands, size(m.drives, 1), [])';
time = 1e-3 * (0:size(commands, 1) - 1)';
out = axis([time, commands], time(end), 1e-3);
f = fopen('out.bin', 'w'); fwrite(f, (out.position(2:end, :) .* m.levers')', 'double'); fclose(f);
printf('%d ', out.lost_steps(end, :));
";

/// The scripts of Python and MATLAB: each position within 1e-8 m of taut's while no step is lost, and the same steps
/// lost.
#[test]
fn drawn_machines_go_in_python_and_octave_where_taut_has_them() {
    let has_octave = are_there(&["octave-cli"]);
    for seed in 0..4 {
        let drawn = drawn(500 + seed);
        let (case, solution) = solved(&drawn);
        let own = ways(&case, &solution);
        let behind: Vec<i64> = (0..case.machine.drives.len())
            .map(|drive| {
                let mut slips = solution.outcome.events.iter().filter_map(|event| match (event.part.what, event.to) {
                    (What::Field(own), Status::Slipped(pitches)) if own == drive => Some(4 * i64::from(pitches)),
                    _ => None,
                });
                slips.next_back().unwrap_or(0)
            })
            .collect();
        let compare = |tool: &str, folder: &TempDir, told: &str| {
            let off = doubles(&folder.path().join("out.bin"))
                .iter()
                .zip(&own)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            let lost: Vec<i64> = told.split_whitespace().map(|steps| steps.parse().unwrap()).collect();
            println!("{seed}: {tool} {off:.1e} m, {lost:?}");
            let most = if behind.iter().all(|steps| *steps == 0) { 1e-8 } else { 1e-6 };
            assert!(off < most && lost == behind, "{seed}: {tool} {off:e} m, {lost:?}\n{}", drawn.case);
        };
        if let Some(python) = python() {
            let folder = exported_to(&drawn, "python", "axis.py");
            fs::write(folder.path().join("check.py"), IN_PYTHON).unwrap();
            let told = run(folder.path(), python, &["check.py"]);
            compare("python", &folder, &told);
        }
        // Octave takes a minute for some of them.
        if has_octave && seed % 2 == 0 {
            let folder = exported_to(&drawn, "matlab", "axis.m");
            fs::write(folder.path().join("check.m"), IN_OCTAVE).unwrap();
            let told = run(folder.path(), "octave-cli", &["--no-init-file", "--quiet", "check.m"]);
            compare("octave", &folder, &told);
        }
    }
}

/// The export of a drawn machine to a target, with its commands.
fn exported_to(drawn: &Drawn, target: &str, out: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("case.toml"), &drawn.case).unwrap();
    let output = taut(folder.path(), &["export", target, "case.toml", "--out", out]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    write_doubles(&folder.path().join("in.bin"), drawn.commands.iter().flatten().copied());
    folder
}

/// Jumps beyond two full steps and numbers that are none change nothing and have a status; so has the export of a
/// controller, which a stepper does not have.
#[test]
fn what_a_stepper_cannot_follow_is_a_status() {
    if !are_there(&["gcc"]) {
        return;
    }
    let drawn = drawn(500);
    let folder = exported(&drawn, &[]);
    for (command, status) in [(f64::NAN, 3), (1e9, 3), (5e-3, 4), (0.0, 0)] {
        write_doubles(&folder.path().join("in.bin"), vec![command; drawn.commands[0].len()]);
        assert_eq!(compiled(folder.path()), Some(status), "{command}");
    }
    fs::write(folder.path().join("case.toml"), &drawn.case).unwrap();
    for (target, part, word) in [("c", "controller", "no controller"), ("st", "controller", "no controller")] {
        let output = taut(folder.path(), &["export", target, "case.toml", "--part", part, "--out", "other.c"]);
        assert!(!output.status.success());
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(told.contains(word) && told.contains("next:"), "{told}");
    }
}

/// A closed-loop stepper in C, its harness beside it, as far as `until`: the ways of all bodies after each of `per`
/// steps of a sample, for references that are held over a step. `at` is the time within a step of the reference's
/// value.
fn looped_in_c(case: &Case, text: &str, (per, until, at): (usize, f64, f64)) -> (f64, Vec<Vec<f64>>) {
    let (design, machine) = (case.controller.as_ref().unwrap(), &case.machine);
    let step = design.every / per as f64;
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("case.toml"), text).unwrap();
    let each = format!("{step:e} s");
    let words = ["export", "c", "case.toml", "--part", "both", "--out", "model.c", "--step", &each];
    let output = taut(folder.path(), &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let steps = (until / step).round() as usize;
    let rows = (0..steps).flat_map(|k| held_row(case, k as f64 * step, at * step));
    write_doubles(&folder.path().join("in.bin"), rows);
    fs::copy(file("cli/tests/export/looped.c"), folder.path().join("looped.c")).unwrap();
    let counts = machine.encoder.map_or(0.0, |encoder| encoder.counts_per_unit(1.0));
    let late = (design.delay / step).round() as usize;
    let mut words: Vec<String> = ["-std=c99", "-O2", "-ffp-contract=off", "looped.c"].map(String::from).to_vec();
    words.extend(["model.c", "model_left.c", "model_right.c"].map(String::from));
    words.retain(|word| !word.starts_with("model") || folder.path().join(word).exists());
    words.push(format!("-DRADIUS={:e}", machine.pulley_radius));
    words.push(format!("-DCOUNTS={counts:e}"));
    words.extend([format!("-DPER={per}"), format!("-DLATE={late}")]);
    words.extend(["-lm", "-o", "here"].map(String::from));
    run(folder.path(), "gcc", &words.iter().map(String::as_str).collect::<Vec<_>>());
    run(folder.path(), folder.path().join("here"), &[]);
    let bodies = machine.mechanism().bodies.len();
    (step, doubles(&folder.path().join("out.bin")).chunks(bodies).map(<[f64]>::to_vec).collect())
}

/// References of the drives `at` a time after that of a step, and those of the slides at it with their derivatives.
fn held_row(case: &Case, time: f64, at: f64) -> Vec<f64> {
    let profiles = case.moves[0].references(case.controller.as_ref().unwrap());
    let slides: Vec<_> = profiles.iter().map(|profile| profile.at(time)).collect();
    let shares = case.machine.belt_shares();
    let of_drive = |shares: &&[f64]| -> f64 {
        shares.iter().zip(&profiles).map(|(share, profile)| share * profile.at(time + at).position).sum()
    };
    let fields = slides.iter().flat_map(|y| [y.position, y.speed, y.acceleration, y.jerk, y.snap]);
    shares.iter().map(of_drive).chain(fields).collect()
}

/// The same loop by taut's simulator and its controllers stepped from outside.
fn looped(case: &Case, (step, rows): (f64, usize)) -> Vec<Vec<f64>> {
    let mechanism = case.machine.mechanism();
    let solver = Solver::General { tolerance: 1e-11 };
    let mut machine = Simulator::of_mechanism(&mechanism, &mechanism.begun(&State::default()), solver, step).unwrap();
    let mut control = Stepped::new(case.controller.as_ref().unwrap(), &case.machine).unwrap();
    let (bodies, drives) = (mechanism.bodies.len(), mechanism.drives.len());
    let mut all = Vec::new();
    for k in 0..rows {
        let time = k as f64 * step;
        let row = held_row(case, time, 0.0);
        while control.next() <= time + 1e-3 * step {
            let slides: Vec<Reference> = row[drives..]
                .chunks(5)
                .map(|y| Reference { position: y[0], speed: y[1], acceleration: y[2], jerk: y[3], snap: y[4] })
                .collect();
            control.decide(&machine.state(), &vec![0.0; drives], &slides, None);
        }
        for (drive, (own, correction)) in row.iter().zip(control.commands()).enumerate() {
            let (value, now) = (own + correction, machine.time());
            machine.set_input(drive, &Signal::Step { value, at: 0.0 }.piece(now)).unwrap();
        }
        machine.advance((k + 1) as f64 * step, &mut Vec::new()).unwrap();
        all.push(machine.state().position[..bodies].to_vec());
    }
    all
}

/// The largest distance of ways, m at the belt.
fn apart(case: &Case, a: &[f64], b: &[f64]) -> f64 {
    let mechanism = case.machine.mechanism();
    let levers = mechanism.bodies.iter().map(|body| body.kind.lever());
    levers.zip(a.iter().zip(b)).map(|(lever, (a, b))| lever * (a - b).abs()).fold(0.0, f64::max)
}

/// Plant and controllers of closed-loop steppers in C had never been run together: along references that are held over
/// two steps of a sample they go where taut's own simulator and controllers go, and with short steps where `taut move`
/// goes, whose references are not held.
#[test]
fn loops_of_steppers_in_c_go_where_taut_has_them() {
    if !are_there(&["gcc"]) {
        return;
    }
    for seed in 0..8 {
        let text = in_loop(seed, random(7000 + seed), false);
        let case = Case::from_text("case.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let (step, written) = looped_in_c(&case, &text, (2, 0.1, 0.0));
        let own = looped(&case, (step, written.len()));
        let off = written.iter().zip(&own).map(|(a, b)| apart(&case, a, b)).fold(0.0, f64::max);
        println!("{seed}: {off:.1e} m of held references");
        assert!(off < 1e-8, "{seed}: {off:e} m\n{text}");
        // The reference of the middle of each step.
        let (_, written) = looped_in_c(&case, &text, (64, 0.15, 0.5));
        let (design, shown) = (case.controller.as_ref().unwrap(), &case.moves[0]);
        let run = closed_loop(&Setup::new(&case.machine, design, &shown.profiles, shown.until)).unwrap();
        let last = written.last().unwrap();
        let ends = shown.references(design).into_iter().map(|profile| profile.at(shown.until).position);
        for ((end, load), place) in ends.zip(&run.figures.loads).zip(&case.machine.mechanism().roles.loads) {
            let off = end - load.error.last - last[*place];
            println!("{seed}: {off:.1e} m of a move");
            // A microstep that comes a step later lets an encoder count at another sample.
            assert!(off.abs() < 1e-6, "{seed}: {off:e} m\n{text}");
        }
    }
}
