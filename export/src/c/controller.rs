//! The controller in C: its program written out.

use super::{Writer, plain};
use crate::controller::{DERIVATIVES, input, program, slides};
use crate::design::Design;
use crate::error::Result;
use crate::machine::Machine;
use crate::program::{Expr, Node, Operator, Program, Statement, Test, sign};
use crate::{Real, remarks};
use std::fmt::Write;

const HEADER: &str = include_str!("controller.h");
const SOURCE: &str = include_str!("controller.c");

/// A controller as its header and its source.
pub(super) struct Controller {
    design: Design,
    program: Program,
    unit: &'static str,
    /// Of a gantry, the slides whose references it takes.
    slides: Vec<&'static str>,
    /// Lines of the comment at its function.
    remarks: String,
}

impl Controller {
    /// The controller of a drive, in numbers of this type.
    pub(super) fn new(design: &Design, machine: &Machine, drive: usize, real: Real) -> Result<Self> {
        let unit = machine.drives[drive].amplifier.mode.unit();
        let program = program(design, machine, drive, real.largest())?;
        let remarks = remarks(machine, design).iter().map(|line| format!(" * {line}\n")).collect();
        Ok(Self { design: design.clone(), program, unit, slides: slides(machine), remarks })
    }

    pub(super) fn facts(&self) -> Vec<(String, String)> {
        vec![
            ("controller".into(), self.design.structure.name().into()),
            ("sample time".into(), format!("{:?} s", self.design.every)),
            ("delay of its command".into(), format!("{:?} s", self.design.delay)),
            ("states of the controller".into(), self.program.states.len().to_string()),
        ]
    }

    pub(super) fn header(&self, writer: &Writer) -> String {
        let fields = DERIVATIVES.map(|(name, unit)| format!("    @name@_real {name}; /* {unit} */"));
        let lead = self.design.feed_forward.lead.unwrap_or(self.design.delay + 0.5 * self.design.every);
        let [arrays, whose] = match self.slides[..] {
            [] => [String::new(), "the cart".into()],
            _ => [self.arrays(), "a slide".into()],
        };
        let text = HEADER.replace("@fields@", &fields.join("\n")).replace("@remarks@", &self.remarks);
        let text = text.replace("@arrays@", &arrays).replace("@whose@", &whose);
        writer.fill(
            &text,
            &[
                ("@structure@", &plain(self.design.structure.name())),
                ("@every@", &writer.number(self.design.every)),
                ("@delay@", &writer.number(self.design.delay)),
                ("@lead@", &writer.number(lead)),
                ("@unit@", self.unit),
            ],
        )
    }

    /// Indices of the slides in arrays of references.
    fn arrays(&self) -> String {
        let mut text = String::from("/* `now` and `ahead` are arrays of the references of these. */\n");
        for (number, slide) in self.slides.iter().enumerate() {
            let _ = writeln!(text, "#define @NAME@_SLIDE_{} {number}", slide.to_uppercase());
        }
        let _ = writeln!(text, "#define @NAME@_SLIDES {}\n", self.slides.len());
        text
    }

    /// Inputs that are parts of references, and where they stand.
    fn references(&self) -> impl Iterator<Item = (String, String)> {
        let places = match self.slides[..] {
            [] => vec![("", "->".to_string())],
            _ => self.slides.iter().enumerate().map(|(number, slide)| (*slide, format!("[{number}]."))).collect(),
        };
        let of = ["now", "ahead"].into_iter().flat_map(move |of| places.clone().into_iter().map(move |at| (of, at)));
        of.flat_map(|(of, (slide, place))| {
            DERIVATIVES.map(|(part, _)| (input(of, slide, part), format!("{of}{place}{part}")))
        })
    }

    pub(super) fn source(&self, writer: &Writer) -> String {
        let program = &self.program;
        let read = &program.read;
        let mut fields = String::new();
        for state in &program.states {
            let _ = writeln!(fields, "    @name@_real {}; /* {} */", state.name, plain(&state.about));
        }
        let resets: Vec<String> = program
            .states
            .iter()
            .map(|state| format!("    control.{} = {};", state.name, writer.number(0.0)))
            .collect();
        let mut body = String::new();
        for (name, from) in self.references().filter(|(name, _)| read.contains(name)) {
            let _ = writeln!(body, "    const @name@_real {name} = {from};");
        }
        for local in &program.locals {
            let _ = writeln!(body, "    @name@_real {local};");
        }
        for of in ["now", "ahead"] {
            let begins = format!("{of}_");
            if !read.iter().any(|name| name.starts_with(&begins)) {
                let _ = writeln!(body, "    (void){of};");
            }
        }
        for input in ["measured", "current"] {
            if !read.contains(input) {
                let _ = writeln!(body, "    (void){input};");
            }
        }
        let printer = Printer { writer, program };
        printer.block(&program.body, 1, &mut body);
        let (fields, resets) = match program.states.is_empty() {
            true => ("    @name@_real nothing;\n".to_string(), vec!["    control.nothing = R(0.0);".to_string()]),
            false => (fields, resets),
        };
        let text = SOURCE
            .replace("@fields@", fields.trim_end())
            .replace("@resets@", &resets.join("\n"))
            .replace("@body@", body.trim_end())
            .replace("@result@", &program.result);
        writer.fill(&text, &[])
    }
}

/// Writes statements.
struct Printer<'p> {
    writer: &'p Writer,
    program: &'p Program,
}

impl Printer<'_> {
    fn block(&self, body: &[Statement], depth: usize, text: &mut String) {
        let indent = "    ".repeat(depth);
        for statement in body {
            let _ = match statement {
                Statement::Remark(remark) => writeln!(text, "{indent}/* {} */", plain(remark)),
                Statement::Set(name, value) => {
                    writeln!(text, "{indent}{} = {};", self.place(name), self.whole(value))
                }
                Statement::If(Test(relation, a, b), yes, no) => {
                    let test = format!("{} {} {}", self.term(a), sign(*relation), self.term(b));
                    match yes.is_empty() {
                        true => {
                            let _ = writeln!(text, "{indent}if (!({test})) {{");
                            self.block(no, depth + 1, text);
                        }
                        false => {
                            let _ = writeln!(text, "{indent}if ({test}) {{");
                            self.block(yes, depth + 1, text);
                            if !no.is_empty() {
                                let _ = writeln!(text, "{indent}}} else {{");
                                self.block(no, depth + 1, text);
                            }
                        }
                    }
                    writeln!(text, "{indent}}}")
                }
            };
        }
    }

    fn place(&self, name: &str) -> String {
        match self.program.states.iter().any(|state| state.name == name) {
            true => format!("control.{name}"),
            false => name.to_string(),
        }
    }

    /// An expression that stands by itself.
    fn whole(&self, value: &Expr) -> String {
        let text = self.term(value);
        match value.node() {
            Node::Two(..) => text[1..text.len() - 1].to_string(),
            _ => text,
        }
    }

    /// An expression as a part of another: every operation in parentheses, so that the order is the one meant.
    fn term(&self, value: &Expr) -> String {
        match value.node() {
            Node::Number(value) if *value < 0.0 => format!("({})", self.writer.number(*value)),
            Node::Number(value) => self.writer.number(*value),
            Node::Variable(name) => self.place(name),
            Node::Minus(a) => format!("(-{})", self.term(a)),
            Node::Whole(a) => format!("(@name@_real)(int32_t){}", self.term(a)),
            Node::Two(operator, a, b) => {
                let sign = match operator {
                    Operator::Plus | Operator::Minus | Operator::Times | Operator::Over => operator.sign(),
                };
                format!("({} {sign} {})", self.term(a), self.term(b))
            }
        }
    }
}
