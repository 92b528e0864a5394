//! IEC 61131-3 Structured Text: the controller as a function block.

use super::controller::program;
use super::program::{Expr, Node, Program, Statement, Test, sign};
use super::{
    Exported, Part, controller, correction_note, drives_note, identifier, remarks, shaper_note, without_controller,
};
use crate::case::Case;
use crate::design::Design;
use crate::error::{Error, Result};
use std::fmt::Write;

const BLOCK: &str = include_str!("block.st");

/// The file `STEM.st`.
pub(super) fn export(case: &Case, part: Option<Part>, stem: &str) -> Result<Exported> {
    let (case, design) =
        controller(case).map_err(|error| without_controller(case, error, "take the machine with `taut export fmu`"))?;
    if part.is_some_and(Part::has_plant) {
        return Err(Error::new("Structured Text is only a controller here")
            .in_file("--part")
            .next("leave --part out; `taut export fmu` has the machine"));
    }
    let drives = case.machine.geometry().drives;
    let (mut texts, mut names, mut states) = (Vec::new(), Vec::new(), 0);
    for (number, at) in drives.iter().enumerate() {
        let name = match drives {
            [_] => format!("{}_controller", identifier(stem)),
            _ => format!("{}_{}_controller", identifier(stem), at.side()),
        };
        let program = program(design, &case.machine, number, f64::MAX)?;
        let unit = case.machine.drives[number].amplifier.mode.unit();
        texts.push(function_block(case, design, &program, (&name, unit)));
        names.push(name);
        states = program.states.len();
    }
    let facts = vec![
        (if drives.len() == 1 { "function block" } else { "function blocks" }.into(), names.join(", ")),
        ("controller".into(), design.structure.name().into()),
        ("sample time".into(), format!("{:?} s", design.every)),
        ("states of the controller".into(), states.to_string()),
    ];
    let mut notes =
        vec!["untried on a real controller: its grammar is checked, and it is run by an interpreter".into()];
    notes.extend(drives_note(case));
    notes.extend(correction_note(&case.machine));
    notes.extend(shaper_note(design));
    Ok(Exported { files: vec![(format!("{stem}.st"), texts.join("\n").into_bytes())], facts, notes })
}

/// A program as a function block of this name, with the unit of its command.
fn function_block(case: &Case, design: &Design, program: &Program, (name, unit): (&str, &str)) -> String {
    let lead = design.feed_forward.lead.unwrap_or(design.delay + 0.5 * design.every);
    let read = &program.read;
    let inputs = program.inputs.iter().filter(|input| read.contains(&input.name));
    let inputs: Vec<String> =
        inputs.map(|input| format!("    {} : LREAL; (* {} *)", input.name, plain(&input.about))).collect();
    let states = program
        .states
        .iter()
        .map(|state| format!("    {} : LREAL := {}; (* {} *)", state.name, literal(0.0), plain(&state.about)));
    let locals = program.locals.iter().map(|local| format!("    {local} : LREAL;"));
    let kept: Vec<String> = states.chain(locals).collect();
    let resets: Vec<String> =
        program.states.iter().map(|state| format!("    {} := {};", state.name, literal(0.0))).collect();
    let mut body = String::new();
    block(&program.body, 0, &mut body);
    let mut text = BLOCK.to_string();
    for (place, part) in [
        ("@title@", plain(&case.title)),
        ("@remarks@", remarks(&case.machine, design).iter().map(|line| format!("(* {line} *)\n")).collect()),
        ("@structure@", plain(design.structure.name())),
        ("@version@", env!("CARGO_PKG_VERSION").into()),
        ("@name@", name.into()),
        ("@every@", literal(design.every)),
        ("@delay@", literal(design.delay)),
        ("@lead@", literal(lead)),
        ("@unit@", unit.into()),
        ("@inputs@", inputs.join("\n")),
        ("@kept@", kept.join("\n")),
        ("@resets@", if resets.is_empty() { "    ;".into() } else { resets.join("\n") }),
        ("@body@", body.trim_end().into()),
        ("@result@", program.result.clone()),
    ] {
        text = text.replace(place, &part);
    }
    text
}

/// A text as a comment can hold it.
fn plain(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect::<String>()
        .replace("*)", "* )")
        .replace("(*", "( *")
}

/// A number as a literal: with a point, and never negative.
fn literal(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        Some((digits, exponent)) if !digits.contains('.') => format!("{digits}.0E{exponent}"),
        Some((digits, exponent)) => format!("{digits}E{exponent}"),
        None => text,
    }
}

fn block(body: &[Statement], depth: usize, text: &mut String) {
    let indent = "    ".repeat(depth);
    for statement in body {
        let _ = match statement {
            Statement::Remark(remark) => writeln!(text, "{indent}(* {} *)", plain(remark)),
            Statement::Set(name, value) => writeln!(text, "{indent}{name} := {};", whole(value)),
            Statement::If(Test(relation, a, b), yes, no) => {
                let test = format!("{} {} {}", term(a), sign(*relation), term(b));
                match yes.is_empty() {
                    true => {
                        let _ = writeln!(text, "{indent}IF NOT ({test}) THEN");
                        block(no, depth + 1, text);
                    }
                    false => {
                        let _ = writeln!(text, "{indent}IF {test} THEN");
                        block(yes, depth + 1, text);
                        if !no.is_empty() {
                            let _ = writeln!(text, "{indent}ELSE");
                            block(no, depth + 1, text);
                        }
                    }
                }
                writeln!(text, "{indent}END_IF;")
            }
        };
    }
}

/// An expression that stands by itself.
fn whole(value: &Expr) -> String {
    let text = term(value);
    match value.node() {
        Node::Two(..) => text[1..text.len() - 1].to_string(),
        _ => text,
    }
}

/// An expression as a part of another, every operation in parentheses.
fn term(value: &Expr) -> String {
    match value.node() {
        Node::Number(value) if value.is_sign_negative() => format!("(-{})", literal(-value)),
        Node::Number(value) => literal(*value),
        Node::Variable(name) => name.clone(),
        Node::Minus(a) => format!("(-{})", term(a)),
        Node::Whole(a) => format!("DINT_TO_LREAL(TRUNC({}))", term(a)),
        Node::Two(operator, a, b) => format!("({} {} {})", term(a), operator.sign(), term(b)),
    }
}
