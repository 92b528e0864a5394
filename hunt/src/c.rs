//! Exported C, compiled by gcc and run: the plant along inputs that are held over its steps, or plant and controller in
//! a loop.

use crate::answer::{Answer, End, LEAST, mechanism, rows};
use crate::double::Double;
use crate::folder::Folder;
use crate::subject::{Fed, Subject};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use taut::export::{self, Options, Part, Real, Target};
use taut::signal::profile::Reference;

/// Steps between two rows that are tried, fewest first.
const STEPS: [usize; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 512, 2048];

/// True if there is a compiler.
pub fn has_compiler() -> bool {
    Command::new("gcc").arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Runs it, with shorter steps where one had more events than a step may have.
pub fn run(subject: &Subject) -> Result<Answer, String> {
    let mut answer = Err(String::new());
    for fewest in [1, 8, 64] {
        answer = stepped(subject, fewest);
        if !matches!(&answer, Ok(Answer { end: End::Other(why), .. }) if why == TOO_MANY) {
            break;
        }
    }
    answer
}

/// How a step ends that has more events than it may have.
const TOO_MANY: &str = "status 1 of a step";

fn stepped(subject: &Subject, fewest: usize) -> Result<Answer, String> {
    // Currents start at zero in C.
    let subject = &without_current(subject.clone());
    let [until, every] = subject.times();
    let (part, tick) = match subject {
        Subject::Loop(case) => {
            let design = case.controller.as_ref().ok_or("the case has no controller")?;
            // A delay is a whole number of quarters of a sample here.
            (Part::Both, design.every / 4.0)
        }
        Subject::Axis(_) | Subject::Gantry(_) => (Part::Plant, every),
    };
    let mut exported = Err(String::new());
    let mut step = tick;
    let mut parts = 1;
    for count in STEPS.into_iter().filter(|count| *count >= fewest) {
        (step, parts) = (tick / count as f64, count);
        let options = Options { part: Some(part), real: Real::Double, step: Some(step), ..Options::default() };
        exported = export::export(&subject.opened(), Target::C, "axis", &options).map_err(|error| error.to_string());
        if exported.is_ok() {
            break;
        }
    }
    let exported = exported.map_err(|error| format!("the export is refused: {error}"))?;
    let folder = Folder::new()?;
    for (name, content) in &exported.files {
        folder.write(name, content)?;
    }
    let ticks = (until / tick * (1.0 + 1e-12)).floor() as usize;
    let (fed, main) = match subject {
        Subject::Loop(_) => (Fed::AsGiven, loop_main(subject, ticks, parts)?),
        Subject::Axis(_) | Subject::Gantry(_) => {
            let fed = subject.held(step)?;
            let main = plant_main(subject, &fed, ticks, parts);
            (fed, main)
        }
    };
    folder.write("main.c", main)?;
    folder.run(Path::new("gcc"), &["-std=c99", "-O1", "-ffp-contract=off", "-o", "axis", "axis.c", "main.c"])?;
    let output = Command::new(folder.join("axis")).output().map_err(|error| format!("the program: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut positions: Vec<Vec<f64>> = Vec::new();
    let mut end = End::Complete;
    for line in text.lines() {
        match line.strip_prefix("status ") {
            Some("2") => end = End::Left(f64::NAN),
            Some(other) => end = End::Other(format!("status {other} of a step")),
            None => positions.push(line.split(' ').map(bits).collect::<Result<_, _>>()?),
        }
    }
    if !output.status.success() {
        end = End::Other(format!("the program ends with {:?}", output.status));
    }
    let machine = subject.machine(&mut Double::from);
    let rows = rows(subject, &machine, &positions);
    let times = (0..=ticks).map(|k| k as f64 * tick).collect();
    let farthest = machine.origin.iter().map(|origin| origin.high.abs()).fold(0.0, f64::max);
    let allowed = LEAST * (1.0 + farthest);
    Ok(Answer {
        subject: Some(subject.clone()),
        fed,
        times,
        rows,
        events: None,
        end,
        allowed,
        is_stated: false,
        ties: 0,
    })
}

fn without_current(mut subject: Subject) -> Subject {
    match &mut subject {
        Subject::Axis(case) => case.experiments[0].initial.current[0] = 0.0,
        Subject::Gantry(case) => case.experiments[0].initial.current = Default::default(),
        Subject::Loop(_) => {}
    }
    subject
}

/// A number by its bits.
fn bits(word: &str) -> Result<f64, String> {
    u64::from_str_radix(word, 16).map(f64::from_bits).map_err(|_| format!("the program prints {word}"))
}

fn number(value: f64) -> String {
    format!("{value:e}")
}

fn list(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(", ")
}

const HEAD: &str = "#include \"axis.h\"\n#include <stdio.h>\n#include <string.h>\n\
    static void put(double v, const char *end)\n{\n    unsigned long long b;\n    memcpy(&b, &v, 8);\n    \
    printf(\"%llx%s\", b, end);\n}\n";

/// The start of the machine, and a function that prints the positions of its first bodies.
fn head(subject: &Subject) -> String {
    let mechanism = mechanism(subject);
    let state = match subject {
        Subject::Axis(case) => mechanism.begun(&case.experiments[0].initial),
        Subject::Gantry(case) => case.experiments[0].initial,
        Subject::Loop(_) => taut::mechanism::State::default(),
    };
    let count = mechanism.bodies.len();
    let mut text = String::from(HEAD);
    let _ = writeln!(text, "static const double position[] = {{{}}};", list(state.position[..count].to_vec()));
    let _ = writeln!(text, "static const double speed[] = {{{}}};", list(state.speed[..count].to_vec()));
    let bodies = subject.columns().len();
    let _ = writeln!(
        text,
        "static void row(void)\n{{\n    axis_output now;\n    int b;\n    axis_read(&now);\n    \
         for (b = 0; b < {bodies}; b++) put(now.position[b], b + 1 < {bodies} ? \" \" : \"\\n\");\n}}"
    );
    text
}

fn plant_main(subject: &Subject, fed: &Fed, ticks: usize, parts: usize) -> String {
    let mut text = head(subject);
    let Fed::Held(_, values) = fed else { return text };
    for (drive, values) in values.iter().enumerate() {
        let _ = writeln!(text, "static const double input{drive}[] = {{{}}};", list(values.iter().copied()));
    }
    let inputs: String = (0..values.len()).map(|drive| format!("in[{drive}] = input{drive}[k]; ")).collect();
    let _ = writeln!(
        text,
        "int main(void)\n{{\n    double in[4];\n    int k;\n    axis_start(position, speed);\n    row();\n    \
         for (k = 0; k < {}; k++) {{\n        axis_status status;\n        {inputs}\n        status = axis_step(in);\n        \
         if (status != AXIS_DONE) {{ printf(\"status %d\\n\", (int)status); return 0; }}\n        \
         if ((k + 1) % {parts} == 0) row();\n    }}\n    return 0;\n}}",
        ticks * parts
    );
    text
}

/// Four ticks a sample; a row at each tick.
fn loop_main(subject: &Subject, ticks: usize, parts: usize) -> Result<String, String> {
    let Subject::Loop(case) = subject else { return Err("no loop".into()) };
    let design = case.controller.as_ref().ok_or("the case has no controller")?;
    if case.machine.encoder.is_some() {
        return Err("the loop in C is run without counts".into());
    }
    let samples = ticks / 4 + 1;
    let lead = design.feed_forward.lead.unwrap_or(design.delay + 0.5 * design.every);
    let late = (design.delay / design.every * 4.0).round() as usize;
    let mut text = head(subject);
    for (name, ahead) in [("now", 0.0), ("ahead", lead)] {
        let reference = |k: usize| case.moves[0].profile().at(k as f64 * design.every + ahead);
        type Field = fn(&Reference) -> f64;
        let fields: [(&str, Field); 5] = [
            ("position", |y| y.position),
            ("speed", |y| y.speed),
            ("acceleration", |y| y.acceleration),
            ("jerk", |y| y.jerk),
            ("snap", |y| y.snap),
        ];
        for (field, of) in fields {
            let values = list((0..samples).map(|k| of(&reference(k))));
            let _ = writeln!(text, "static const double {name}_{field}[] = {{{values}}};");
        }
    }
    let header = export::export(
        &subject.opened(),
        Target::C,
        "axis",
        &Options { part: Some(Part::Controller), ..Options::default() },
    )
    .map_err(|error| error.to_string())?;
    let header = header
        .files
        .iter()
        .find(|(name, _)| name == "axis.h")
        .map(|(_, text)| String::from_utf8_lossy(text).into_owned());
    let header = header.unwrap_or_default();
    let mut set = String::new();
    for name in ["now", "ahead"] {
        for field in ["position", "speed", "acceleration", "jerk", "snap"] {
            if header.contains(&format!("_real {field};")) {
                let _ = write!(set, "{name}.{field} = {name}_{field}[s]; ");
            }
        }
    }
    let shaft = if mechanism(subject).bodies.len() > 3 { 3 } else { 0 };
    let _ = writeln!(
        text,
        "int main(void)\n{{\n    static double waiting[{}];\n    double in[4];\n    int k, j, s = 0;\n    \
         axis_start(position, speed);\n    axis_control_reset();\n    row();\n    for (k = 0; k < {ticks}; k++) {{\n        \
         if (k % 4 == 0) {{\n            axis_reference now, ahead;\n            axis_output seen;\n            \
         axis_read(&seen);\n            {set}\n            waiting[k + {late}] = axis_control(&now, &ahead, \
         {} * seen.position[{shaft}], seen.current[0]);\n            s++;\n        }}\n        \
         in[0] = 0.0;\n        for (j = k; j >= 0; j--) {{ if (j >= {late} && (j - {late}) % 4 == 0) {{ in[0] = waiting[j]; break; }} }}\n        \
         for (j = 0; j < {parts}; j++) {{\n            axis_status status = axis_step(in);\n            \
         if (status != AXIS_DONE) {{ printf(\"status %d\\n\", (int)status); return 0; }}\n        }}\n        row();\n    }}\n    \
         return 0;\n}}",
        ticks + late + 4,
        number(case.machine.pulley_radius),
    );
    Ok(text)
}
