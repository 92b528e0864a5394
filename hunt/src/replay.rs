//! Drawn machines replayed event by event: the exact solver against exported C, Python and MATLAB.
//!
//! A machine starts at rest at the origin, and its commands are held over steps. What each part does is a list of
//! changes; the lists of two ways must be the same, change by change, as far as the exact solver's own list stays the
//! same where the commands are changed by as little as the other way may be off.

use crate::draw::{self, Random};
use crate::folder::Folder;
use crate::subject::{Fed, Subject};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use taut::case::Case;
use taut::export::{self, Options, Part, Real, Tables, Target};
use taut::mechanism::{Mechanism, SpringLaw, State};
use taut::signal::Signal;
use taut::solve::{Ending, Simulator, Solver};

/// Steps of a run.
const STEPS: usize = 96;

/// Steps in C for each of these: a step has room for a few events alone.
const PARTS: usize = 8;

/// The longest run, in periods of the fastest that the machine can do: 1/s times s.
const LONGEST: f64 = 400.0;

/// Changes of a part that are nearer to each other than this share of a run are one; and so much may two lists be off.
const MOMENT: f64 = 1e-9;
const NEAR: f64 = 1e-6;

/// A way of running an exported machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    /// C, compiled by gcc.
    C,
    /// Python, on NumPy and SciPy.
    Python,
    /// MATLAB, in GNU Octave.
    Octave,
}

impl Tool {
    /// All of them.
    pub const ALL: [Tool; 3] = [Tool::C, Tool::Python, Tool::Octave];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Tool::C => "c",
            Tool::Python => "python",
            Tool::Octave => "octave",
        }
    }

    /// The program that it needs; none where it is not there. Python is that of `cargo xtask export`.
    pub fn program(self) -> Option<PathBuf> {
        let is_there = |path: &PathBuf| path.is_file();
        let found = |name: &str| {
            let paths = std::env::var_os("PATH").unwrap_or_default();
            std::env::split_paths(&paths).map(|folder| folder.join(name)).find(is_there)
        };
        match self {
            Tool::C => found("gcc"),
            Tool::Octave => found("octave-cli"),
            Tool::Python => {
                let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
                let target = target.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"));
                std::path::absolute(target.join("export/bin/python")).ok().filter(is_there)
            }
        }
    }

    /// By which share its commands may be other ones: what its integrator and its rounding come to.
    fn error(self) -> f64 {
        match self {
            Tool::C => 1e-11,
            Tool::Octave => 1e-9,
            Tool::Python => 1e-8,
        }
    }
}

/// A machine with its commands.
pub struct Drawn {
    /// Its number.
    pub number: u64,
    /// Its case.
    pub text: String,
    opened: Case,
    mechanism: Mechanism,
    tables: Tables,
    step: f64,
    /// Of each drive, step by step.
    commands: Vec<Vec<f64>>,
}

/// A change of a part: when, and the code of what it does then.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    time: f64,
    code: i8,
}

/// The changes of each element, and to when they are known.
#[derive(Debug, Clone, Default)]
struct ElementChanges {
    changes: Vec<Vec<Change>>,
    end: f64,
}

/// The outcome of a replay.
#[derive(Debug, Default)]
pub struct Replayed {
    /// Machines that were compared.
    pub machines: usize,
    /// Changes that were compared.
    pub compared: usize,
    /// How many there were.
    pub all: usize,
    /// Machines that the other way could not run to its end: too many events in a step.
    pub refused: usize,
    /// The differences in words.
    pub different: Vec<String>,
}

impl Drawn {
    /// The machine of this number; none where it is not linear piece by piece, or cannot stand at the origin.
    pub fn new(seed: u64, number: u64) -> Option<Self> {
        // Axes over wide ranges, and gantries and axes by pairs of features.
        let text =
            if number.is_multiple_of(2) { draw::stage(seed, number).text } else { draw::pair(seed, number).0.text };
        let subject = Subject::new(&format!("machine-{number}.toml"), &text).ok()?;
        if matches!(subject, Subject::Loop(_)) {
            return None;
        }
        let opened = subject.opened();
        let mechanism = export::mechanism(&opened);
        let holds = |spring: &taut::mechanism::Spring| match spring.law {
            SpringLaw::Gap { low, high } | SpringLaw::Bounds { low, high } => low <= 0.0 && 0.0 <= high,
            _ => true,
        };
        if !mechanism.is_piecewise_linear() || !mechanism.springs.iter().all(holds) {
            return None;
        }
        let tables = Tables::new(&mechanism).ok()?;
        let step = subject.times()[0].min(LONGEST / tables.fastest) / STEPS as f64;
        let Ok(Fed::Held(_, values)) = subject.held(subject.times()[0] / STEPS as f64) else { return None };
        let mut random = Random::new(seed, number);
        let commands = values.iter().map(|values| held(values, &mut random)).collect();
        Some(Self { number, text, opened, mechanism, tables, step, commands })
    }

    fn until(&self) -> f64 {
        self.step * STEPS as f64
    }

    /// Changes of the parts by the exact solver, all commands multiplied by a factor.
    fn by_taut(&self, factor: f64) -> Option<ElementChanges> {
        let mut machine = Simulator::of_mechanism(&self.mechanism, &State::default(), Solver::Exact, self.step).ok()?;
        let mut events = Vec::new();
        let mut end = self.until();
        for k in 0..STEPS {
            for (drive, values) in self.commands.iter().enumerate().filter(|(_, v)| k == 0 || v[k] != v[k - 1]) {
                let value = values[k] * factor;
                machine.set_input(drive, &Signal::Step { value, at: 0.0 }.piece(machine.time())).ok()?;
            }
            match machine.advance(self.step * (k + 1) as f64, &mut events) {
                Ok(()) => {}
                Err(Ending::LeftTravel { time }) => {
                    end = time;
                    break;
                }
                Err(_) => return None,
            }
        }
        // Where rounding decides when something happens nothing is to be compared.
        end = events.iter().filter(|event| event.by_rounding).fold(end, |end, event| end.min(event.time));
        let changes = self.tables.elements.iter().map(|element| {
            let own = events.iter().filter(|event| element.kind.what() == Some(event.part.what));
            own.map(|event| Change { time: event.time, code: event.to.code() }).collect()
        });
        Some(ElementChanges { changes: changes.collect(), end })
    }

    /// Changes of elements in words of the tables, as events have them.
    fn told(&self, raw: &[(f64, usize, usize)]) -> ElementChanges {
        let mut changes = vec![Vec::new(); self.tables.elements.len()];
        for &(time, element, state) in raw {
            if let Some(does) = self.tables.elements.get(element).and_then(|element| element.states.get(state)) {
                changes[element].push(Change { time, code: Tables::shown_code(*does) });
            }
        }
        ElementChanges { changes, end: self.until() }
    }

    /// The changes of an element that show, up to `end`: those that last, and after which it does something else.
    fn lasting(&self, told: &ElementChanges, element: usize, end: f64) -> Vec<Change> {
        let part = &self.tables.elements[element];
        let mut now = Tables::shown_code(part.states[self.tables.at_rest()[element]]);
        let moment = MOMENT * self.until();
        let mut lasting: Vec<Change> = Vec::new();
        let all = &told.changes[element];
        for (k, change) in all.iter().enumerate().filter(|(_, change)| change.time <= end) {
            let stays = all.get(k + 1).is_none_or(|next| next.time - change.time > moment);
            if stays && change.code != now {
                lasting.push(*change);
                now = change.code;
            }
        }
        lasting
    }

    /// The first time at which two lists are not the same: which element.
    fn parting(&self, a: &ElementChanges, b: &ElementChanges) -> Option<(f64, usize)> {
        let (end, near) = (a.end.min(b.end), NEAR * self.until());
        let shown = |&element: &usize| self.tables.elements[element].kind.what().is_some();
        let of_element = |element: usize| {
            let (own, other) = (self.lasting(a, element, f64::MAX), self.lasting(b, element, f64::MAX));
            let same = |(a, b): (&Change, &Change)| a.code == b.code && (a.time - b.time).abs() <= near;
            let count = own.iter().zip(&other).take_while(|pair| same(*pair)).count();
            let first = [own.get(count), other.get(count)].into_iter().flatten().map(|change| change.time);
            let first = first.fold(f64::INFINITY, f64::min);
            (first < end - near).then_some((first, element))
        };
        let partings = (0..self.tables.elements.len()).filter(shown).filter_map(of_element);
        partings.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// To when the changes are the same for commands that differ by this share.
    fn determined(&self, told: &ElementChanges, share: f64) -> f64 {
        [1.0 + share, 1.0 - share].into_iter().fold(told.end, |end, factor| match self.by_taut(factor) {
            Some(other) => self.parting(told, &other).map_or(end.min(other.end), |(time, _)| end.min(time)),
            None => 0.0,
        })
    }

    /// Compares what a tool says with what taut does.
    fn compare(&self, tool: Tool, own: &ElementChanges, other: ElementChanges, result: &mut Replayed) {
        let end = self.determined(own, tool.error());
        let own = ElementChanges { end, ..own.clone() };
        let shown = (0..self.tables.elements.len()).filter(|&e| self.tables.elements[e].kind.what().is_some());
        for element in shown {
            result.compared += self.lasting(&own, element, end).len();
            result.all += self.lasting(&own, element, f64::MAX).len();
        }
        result.machines += 1;
        if let Some((time, element)) = self.parting(&own, &other) {
            let near = |told: &ElementChanges| {
                let all = self.lasting(told, element, f64::MAX).into_iter();
                let near = all.filter(|change| (change.time - time).abs() <= 0.05 * self.until());
                near.map(|change| format!("{} at {:e} s", change.code, change.time)).collect::<Vec<_>>().join(", ")
            };
            result.different.push(format!(
                "machine {}, {}: the {} parts at {time:e} s of {:e} s: {} and not {}\n{}",
                self.number,
                tool.name(),
                self.tables.elements[element].key,
                self.until(),
                near(&other),
                near(&own),
                self.text
            ));
        }
    }
}

/// Commands of one drive: as large as these values at most, another one every few steps.
fn held(values: &[f64], random: &mut Random) -> Vec<f64> {
    let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let size = if most > 0.0 { most } else { 1.0 };
    let (mut left, mut now) = (0, 0.0);
    let mut next = || {
        if left == 0 {
            left = 1 + random.below(12);
            now = if random.chance(0.25) { 0.0 } else { size * random.even(-2.0, 2.0) };
        }
        left -= 1;
        now
    };
    (0..STEPS).map(|_| next()).collect()
}

/// Replays the machines by a tool. Errors: a tool that does not run at all.
pub fn replay(tool: Tool, program: &Path, machines: &[Drawn]) -> Result<Replayed, String> {
    let mut result = Replayed::default();
    let own: Vec<Option<ElementChanges>> = machines.iter().map(|machine| machine.by_taut(1.0)).collect();
    let known: Vec<(&Drawn, ElementChanges)> =
        machines.iter().zip(own).filter_map(|(machine, own)| Some((machine, own?))).collect();
    let folder = Folder::new()?;
    let raw = match tool {
        Tool::C => known.iter().map(|(machine, _)| in_c(&folder, program, machine)).collect::<Result<_, _>>()?,
        Tool::Python => in_python(&folder, program, &known)?,
        Tool::Octave => in_octave(&folder, program, &known)?,
    };
    for ((machine, own), raw) in known.iter().zip(raw) {
        match raw {
            Some(raw) => machine.compare(tool, own, machine.told(&raw), &mut result),
            None => result.refused += 1,
        }
    }
    Ok(result)
}

/// Changes as a tool prints them: time, element, state; none of a machine that it cannot run.
type Raw = Option<Vec<(f64, usize, usize)>>;

fn line(line: &str) -> Option<(f64, usize, usize)> {
    let mut words = line.split_whitespace();
    Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?, words.next()?.parse::<i64>().ok()?.max(0) as usize))
}

/// Lines of the exported source, and what is put before or behind them so that it tells its changes.
const CLOCK: (&str, &str) = ("    plant.since_change = R(0.0);\n    if (", "    told += plant.since_change;\n");
const CHANGES: (&str, &str) = ("    plant.does[element] = (uint8_t)to;\n", "    tell(element, to);\n");

fn in_c(folder: &Folder, gcc: &Path, machine: &Drawn) -> Result<Raw, String> {
    let options = Options {
        part: Some(Part::Plant),
        real: Real::Double,
        step: Some(machine.step / PARTS as f64),
        ..Options::default()
    };
    let exported = export::export(&machine.opened, Target::C, "axis", &options).map_err(|error| error.to_string())?;
    for (name, content) in &exported.files {
        let mut text = String::from_utf8_lossy(content).into_owned();
        if name == "axis.c" {
            if [CLOCK.0, CHANGES.0].iter().any(|line| text.matches(line).count() != 1) {
                return Err("the lines of the exported source that changes are told by are not there once".into());
            }
            text = text.replace(CLOCK.0, &format!("{}{}", CLOCK.1, CLOCK.0));
            text = text.replace(CHANGES.0, &format!("{}{}", CHANGES.0, CHANGES.1));
            text = format!("static double told = -1.0;\nstatic void tell(unsigned element, unsigned to);\n{text}");
        }
        folder.write(name, text)?;
    }
    let mut main = String::from("#include \"axis.c\"\n#include <stdio.h>\n");
    main += "static void tell(unsigned element, unsigned to) { printf(\"%.17g %u %u\\n\", told, element, to); }\n";
    for (drive, values) in machine.commands.iter().enumerate() {
        let _ = writeln!(main, "static const double in{drive}[] = {{{}}};", list(values));
    }
    let inputs: String = (0..machine.commands.len()).map(|d| format!("in[{d}] = in{d}[k / {PARTS}]; ")).collect();
    let _ = write!(
        main,
        "int main(void)\n{{\n    double in[4];\n    int k;\n    axis_reset();\n    for (k = 0; k < {}; k++) {{\n        \
         axis_status status;\n        {inputs}\n        status = axis_step(in);\n        if (status != AXIS_DONE) {{ \
         printf(\"status %d\\n\", (int)status); return 0; }}\n    }}\n    return 0;\n}}\n",
        STEPS * PARTS
    );
    folder.write("main.c", main)?;
    folder.run(gcc, &["-std=c99", "-O0", "-ffp-contract=off", "-o", "axis", "main.c"])?;
    let told = folder.run(&folder.join("axis"), &[])?;
    // Left its travel: the same as taut, or told by what came before.
    let is_refused = told.lines().any(|line| line.starts_with("status") && line != "status 2");
    Ok((!is_refused).then(|| told.lines().filter_map(line).collect()))
}

fn list(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>().join(", ")
}

const IN_PYTHON: &str = "
import importlib
from commands import MACHINES
for name, step, commands in MACHINES:
    machine = importlib.import_module(name).Machine()
    why = 'done'
    try:
        for k, values in enumerate(commands):
            if k == 0 or values != commands[k - 1]:
                machine.set_command(values)
            machine.advance((k + 1) * step)
    except ValueError as error:
        why = str(error)
    print('machine', name)
    for time, element, then in machine.events:
        print(repr(float(time)), element, then)
    if 'left its travel' not in why and why != 'done':
        print('refused', why)
";

fn in_python(folder: &Folder, python: &Path, known: &[(&Drawn, ElementChanges)]) -> Result<Vec<Raw>, String> {
    let mut commands = String::from("MACHINES = [\n");
    for (machine, _) in known {
        let name = format!("m{}", machine.number);
        let options = Options { part: None, real: Real::Double, step: None, ..Options::default() };
        let exported =
            export::export(&machine.opened, Target::Python, &name, &options).map_err(|error| error.to_string())?;
        exported.files.iter().try_for_each(|(name, content)| folder.write(name, content))?;
        let rows: Vec<Vec<f64>> = rows(machine);
        let _ = writeln!(commands, "    ({name:?}, {:e}, {rows:?}),", machine.step);
    }
    folder.write("commands.py", commands + "]\n")?;
    folder.write("replay.py", IN_PYTHON)?;
    Ok(parted(&folder.run(python, &["replay.py"])?))
}

/// Commands of all drives, step by step.
fn rows(machine: &Drawn) -> Vec<Vec<f64>> {
    (0..STEPS).map(|k| machine.commands.iter().map(|values| values[k]).collect()).collect()
}

/// The printed changes, machine by machine.
fn parted(told: &str) -> Vec<Raw> {
    let parts = told.split("machine ").skip(1);
    parts.map(|part| (!part.contains("refused")).then(|| part.lines().filter_map(line).collect())).collect()
}

fn in_octave(folder: &Folder, octave: &Path, known: &[(&Drawn, ElementChanges)]) -> Result<Vec<Raw>, String> {
    let mut main = String::from("1;\n");
    for (machine, own) in known {
        let name = format!("m{}", machine.number);
        let options = Options { part: None, real: Real::Double, step: None, ..Options::default() };
        let exported =
            export::export(&machine.opened, Target::Matlab, &name, &options).map_err(|error| error.to_string())?;
        exported.files.iter().try_for_each(|(name, content)| folder.write(name, content))?;
        let rows = rows(machine).into_iter().enumerate().map(|(k, row)| {
            let time = k as f64 * machine.step;
            format!("{time:e} {}", row.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>().join(" "))
        });
        // A run that ends early has no result there.
        let until = if own.end < machine.until() { own.end * (1.0 - 1e-6) } else { machine.until() };
        let _ = writeln!(
            main,
            "printf('machine {name}\\n');\ntry\n  out = {name}([{}], {until:e}, {until:e});\n  printf('%.17g %d %d\\n', \
             out.events');\ncatch e\n  printf('refused %s\\n', e.message);\nend",
            rows.collect::<Vec<_>>().join("; ")
        );
    }
    folder.write("replay.m", main)?;
    Ok(parted(&folder.run(octave, &["--no-init-file", "--quiet", "replay.m"])?))
}

/// The first machines from number `first` on that can be replayed.
pub fn machines(seed: u64, first: u64, count: usize) -> Vec<Drawn> {
    (first..).filter_map(|number| Drawn::new(seed, number)).take(count).collect()
}

impl Replayed {
    /// In words.
    pub fn told(&self, tool: Tool) -> String {
        format!(
            "{}: {} machines, {} of {} changes compared, {} refused, {} different",
            tool.name(),
            self.machines,
            self.compared,
            self.all,
            self.refused,
            self.different.len()
        )
    }
}
