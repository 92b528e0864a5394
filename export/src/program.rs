//! The computation of one sample as a program: assignments and conditions, no loops. It is written out as C and as
//! Structured Text, in the same order of operations, so that both give the same bits.
//!
//! [`Writer`] is a [`Calculator`] that writes down what a law computes: every operation is a node that others refer to.
//! [`Writer::finish`] makes statements of those that the result needs.

use crate::calculator::{Calculator, Relation, Slot, Slots, Test as Condition};
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::rc::Rc;

/// A number that is computed.
#[derive(Debug, Clone)]
pub(super) struct Expr(Rc<Node>);

/// Its node.
#[derive(Debug)]
pub(super) enum Node {
    Number(f64),
    Variable(String),
    Minus(Expr),
    Two(Operator, Expr, Expr),
    /// The whole number below a number that is not negative.
    Whole(Expr),
}

impl Expr {
    fn new(node: Node) -> Self {
        Self(Rc::new(node))
    }

    pub(super) fn node(&self) -> &Node {
        &self.0
    }
}

/// An operation on two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Operator {
    Plus,
    Minus,
    Times,
    Over,
}

impl Operator {
    pub(super) fn sign(self) -> char {
        match self {
            Operator::Plus => '+',
            Operator::Minus => '-',
            Operator::Times => '*',
            Operator::Over => '/',
        }
    }

    fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Operator::Plus => a + b,
            Operator::Minus => a - b,
            Operator::Times => a * b,
            Operator::Over => a / b,
        }
    }
}

/// The sign of a relation, in C and in Structured Text.
pub(super) fn sign(relation: Relation) -> &'static str {
    match relation {
        Relation::Less => "<",
        Relation::More => ">",
        Relation::AtLeast => ">=",
    }
}

/// A condition.
#[derive(Debug, Clone)]
pub(super) struct Test(pub Relation, pub Expr, pub Expr);

/// One thing that is done.
#[derive(Debug, Clone)]
pub(super) enum Statement {
    Set(String, Expr),
    If(Test, Vec<Statement>, Vec<Statement>),
    /// A remark, in a line of its own.
    Remark(String),
}

/// Something with a name: an input, or what is remembered, which begins with zero.
#[derive(Debug, Clone)]
pub(super) struct Variable {
    pub name: String,
    pub about: String,
}

/// The work of a sample.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    /// Its inputs.
    pub inputs: Vec<Variable>,
    /// Its memory from sample to sample.
    pub states: Vec<Variable>,
    /// Its local variables.
    pub locals: Vec<String>,
    pub body: Vec<Statement>,
    /// The variable that holds the result.
    pub result: String,
    /// Inputs that are read.
    pub read: HashSet<String>,
}

/// The operation of a node; operands by their places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Step {
    /// By its bits.
    Number(u64),
    Input(usize),
    /// A value remembered from the last sample.
    State(usize),
    Minus(usize),
    Two(Operator, usize, usize),
    Whole(usize),
    /// A number in relation to a constant, by its bits; and one of two others.
    Choose(usize, u8, u64, usize, usize),
    /// The neighbours of a table's cell: table, row and column; and one of them.
    Cell(usize, usize, usize),
    Neighbour(usize, usize),
}

const RELATIONS: [Relation; 3] = [Relation::Less, Relation::More, Relation::AtLeast];
/// Names that stand around a program.
const TAKEN: [&str; 5] = ["now", "ahead", "control", "reset", "command"];

const NEIGHBOURS: [&str; 4] = ["low_low", "low_high", "high_low", "high_high"];

impl Step {
    /// The nodes that it is made of.
    fn parts(self) -> impl Iterator<Item = usize> {
        let (parts, count) = match self {
            Step::Number(_) | Step::Input(_) | Step::State(_) => ([0; 3], 0),
            Step::Minus(a) | Step::Whole(a) | Step::Neighbour(a, _) => ([a, 0, 0], 1),
            Step::Two(_, a, b) | Step::Cell(_, a, b) => ([a, b, 0], 2),
            Step::Choose(a, _, _, b, c) => ([a, b, c], 3),
        };
        parts.into_iter().take(count)
    }

    fn known(self) -> Option<f64> {
        match self {
            Step::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }
}

/// All that was written down.
#[derive(Debug, Default)]
pub(super) struct Tape(RefCell<Written>);

#[derive(Debug, Default)]
struct Written {
    steps: Vec<Step>,
    /// Index of each step, so that equal steps are computed once.
    places: HashMap<Step, usize>,
    names: HashMap<usize, String>,
    /// Remarks before the node of that place.
    remarks: Vec<(usize, String)>,
    tables: Vec<Vec<Vec<f64>>>,
    inputs: Vec<Variable>,
}

impl Written {
    fn put(&mut self, step: Step) -> usize {
        if let Some(&place) = self.places.get(&step) {
            return place;
        }
        self.steps.push(step);
        self.places.insert(step, self.steps.len() - 1);
        self.steps.len() - 1
    }
}

/// A number of a [`Writer`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Term<'t> {
    tape: &'t Tape,
    place: usize,
}

impl Tape {
    fn put(&self, step: Step) -> Term<'_> {
        Term { tape: self, place: self.0.borrow_mut().put(step) }
    }

    fn number(&self, value: f64) -> Term<'_> {
        self.put(Step::Number(value.to_bits()))
    }

    fn step(&self, place: usize) -> Step {
        self.0.borrow().steps[place]
    }

    fn two(&self, operator: Operator, a: usize, b: usize) -> Term<'_> {
        match (operator, self.step(a).known(), self.step(b).known()) {
            // Two numbers are joined now, as they would be later.
            (_, Some(a), Some(b)) => self.number(operator.apply(a, b)),
            (Operator::Times, Some(1.0), None) => Term { tape: self, place: b },
            (Operator::Times | Operator::Over, None, Some(1.0)) => Term { tape: self, place: a },
            _ => self.put(Step::Two(operator, a, b)),
        }
    }
}

macro_rules! operators {
    ($($trait:ident $function:ident $operator:ident),*) => {
        $(
            impl<'t> $trait for Term<'t> {
                type Output = Term<'t>;
                fn $function(self, other: Term<'t>) -> Term<'t> {
                    self.tape.two(Operator::$operator, self.place, other.place)
                }
            }

            impl<'t> $trait<f64> for Term<'t> {
                type Output = Term<'t>;
                fn $function(self, other: f64) -> Term<'t> {
                    let other = self.tape.number(other);
                    self.tape.two(Operator::$operator, self.place, other.place)
                }
            }
        )*
    };
}

operators! { Add add Plus, Sub sub Minus, Mul mul Times, Div div Over }

impl<'t> Neg for Term<'t> {
    type Output = Term<'t>;
    fn neg(self) -> Term<'t> {
        match self.tape.step(self.place).known() {
            Some(value) => self.tape.number(-value),
            None => self.tape.put(Step::Minus(self.place)),
        }
    }
}

/// Writes a program.
pub(super) struct Writer<'t> {
    tape: &'t Tape,
    slots: &'t Slots,
    /// The value stored in each slot at the end.
    kept: Vec<Option<usize>>,
}

impl<'t> Calculator for Writer<'t> {
    type N = Term<'t>;

    fn number(&mut self, value: f64) -> Term<'t> {
        self.tape.number(value)
    }

    fn memory(&mut self, slot: Slot) -> Term<'t> {
        match self.kept[slot.place()] {
            Some(place) => Term { tape: self.tape, place },
            None => self.tape.put(Step::State(slot.place())),
        }
    }

    fn keep(&mut self, slot: Slot, value: Term<'t>) {
        self.kept[slot.place()] = Some(value.place);
    }

    fn choose(&mut self, test: Condition<Term<'t>>, yes: Term<'t>, no: Term<'t>) -> Term<'t> {
        if yes.place == no.place {
            return yes;
        }
        if let Some(of) = self.tape.step(test.of.place).known() {
            let test = Condition { of, relation: test.relation, than: test.than };
            return if test.holds() { yes } else { no };
        }
        let relation = RELATIONS.iter().position(|relation| *relation == test.relation).unwrap_or_default();
        self.tape.put(Step::Choose(test.of.place, relation as u8, test.than.to_bits(), yes.place, no.place))
    }

    fn whole(&mut self, value: Term<'t>) -> Term<'t> {
        self.tape.put(Step::Whole(value.place))
    }

    fn neighbours(&mut self, table: &[Vec<f64>], row: Term<'t>, column: Term<'t>) -> [Term<'t>; 4] {
        let number = {
            let mut written = self.tape.0.borrow_mut();
            written.tables.push(table.to_vec());
            written.tables.len() - 1
        };
        let cell = self.tape.put(Step::Cell(number, row.place, column.place)).place;
        [0, 1, 2, 3].map(|k| self.tape.put(Step::Neighbour(cell, k)))
    }

    fn name(&mut self, name: &'static str, value: Term<'t>) -> Term<'t> {
        self.named(name.into(), value)
    }

    fn numbered(&mut self, name: &'static str, number: usize, value: Term<'t>) -> Term<'t> {
        self.named(format!("{name}{number}"), value)
    }

    fn remark(&mut self, text: &str) {
        let mut written = self.tape.0.borrow_mut();
        let place = written.steps.len();
        written.remarks.push((place, text.into()));
    }
}

impl<'t> Writer<'t> {
    /// With what is remembered.
    pub(super) fn new(tape: &'t Tape, slots: &'t Slots) -> Self {
        Self { tape, slots, kept: vec![None; slots.count()] }
    }

    pub(super) fn input(&mut self, name: String, about: String) -> Term<'t> {
        let number = {
            let mut written = self.tape.0.borrow_mut();
            written.inputs.push(Variable { name, about });
            written.inputs.len() - 1
        };
        self.tape.put(Step::Input(number))
    }

    /// Names what has no name.
    fn named(&mut self, name: String, value: Term<'t>) -> Term<'t> {
        let is_computed = !matches!(
            self.tape.step(value.place),
            Step::Number(_) | Step::Input(_) | Step::State(_) | Step::Neighbour(..)
        );
        if is_computed {
            self.tape.0.borrow_mut().names.entry(value.place).or_insert(name);
        }
        value
    }

    /// The program of all that `result` needs, at this sample and at later ones. Err: a number in it that is none.
    pub(super) fn finish(self, result: Term, name: &str) -> Result<Program, f64> {
        let written = self.tape.0.borrow();
        let (mut live, mut states) = (vec![false; written.steps.len()], vec![false; self.kept.len()]);
        let mut waiting = vec![result.place];
        while let Some(place) = waiting.pop() {
            if std::mem::replace(&mut live[place], true) {
                continue;
            }
            waiting.extend(written.steps[place].parts());
            if let Step::State(slot) = written.steps[place] {
                states[slot] = true;
                waiting.extend(self.kept[slot]);
            }
        }
        let numbers = written.steps.iter().zip(&live).filter(|(_, live)| **live).filter_map(|(step, _)| step.known());
        if let Some(fault) = numbers.into_iter().find(|value| !value.is_finite()) {
            return Err(fault);
        }
        let mut uses = vec![0; live.len()];
        let kept: Vec<(usize, usize)> = self
            .kept
            .iter()
            .enumerate()
            .filter_map(|(slot, kept)| Some((slot, (*kept)?)))
            .filter(|(slot, _)| states[*slot])
            .collect();
        let needed = (0..live.len()).filter(|place| live[*place]);
        needed.flat_map(|place| written.steps[place].parts()).for_each(|place| uses[place] += 1);
        kept.iter().for_each(|(_, place)| uses[*place] += 1);
        let taken = written.inputs.iter().map(|input| input.name.as_str()).chain(TAKEN).chain([name]);
        let mut pages = Pages {
            written: &written,
            live: &live,
            uses,
            variables: HashMap::new(),
            taken: taken.map(String::from).collect(),
            locals: Vec::new(),
        };
        let mut program = Program { result: name.into(), ..Program::default() };
        let all: Vec<(&str, &str)> = self.slots.all().collect();
        let mut of_slot: HashMap<usize, String> = HashMap::new();
        for slot in (0..states.len()).filter(|slot| states[*slot]) {
            let own = pages.fresh(all[slot].0);
            program.states.push(Variable { name: own.clone(), about: all[slot].1.into() });
            of_slot.insert(slot, own);
        }
        for (place, step) in written.steps.iter().enumerate() {
            match step {
                Step::Input(number) if live[place] => {
                    let name = written.inputs[*number].name.clone();
                    program.read.insert(name.clone());
                    pages.variables.insert(place, name);
                }
                Step::State(slot) if live[place] => {
                    pages.variables.insert(place, of_slot[slot].clone());
                }
                _ => {}
            }
        }
        // What is kept takes its place when all is computed.
        let next: HashMap<usize, usize> = kept.iter().map(|(slot, place)| (*place, *slot)).collect();
        let mut remarks = written.remarks.iter().peekable();
        let mut remark = None;
        for place in (0..live.len()).filter(|place| live[*place]) {
            while let Some((_, text)) = remarks.next_if(|(before, _)| *before <= place) {
                remark = Some(text);
            }
            let own = match next.get(&place) {
                Some(slot) if !written.names.contains_key(&place) => Some(format!("next_{}", of_slot[slot])),
                _ => None,
            };
            let mut statements = Vec::new();
            pages.write(place, own, (place == result.place).then_some(name), &mut statements);
            if let Some(text) = remark.take_if(|_| !statements.is_empty()) {
                program.body.push(Statement::Remark(text.clone()));
            }
            program.body.extend(statements);
        }
        if pages.variables.get(&result.place).is_none_or(|own| own != name) {
            let value = pages.expression(result.place);
            program.body.push(Statement::Set(name.into(), value));
            pages.locals.push(name.into());
        }
        for (slot, place) in &kept {
            program.body.push(Statement::Set(of_slot[slot].clone(), pages.expression(*place)));
        }
        program.locals = pages.locals;
        program.inputs = written.inputs.clone();
        Ok(program)
    }
}

/// Statements as they are written.
struct Pages<'w> {
    written: &'w Written,
    /// Nodes that are needed.
    live: &'w [bool],
    /// How often a node is used.
    uses: Vec<usize>,
    /// Nodes that have a variable.
    variables: HashMap<usize, String>,
    taken: HashSet<String>,
    locals: Vec<String>,
}

impl Pages<'_> {
    /// A name that nothing else has.
    fn fresh(&mut self, name: &str) -> String {
        let numbers = (2..).map(|number| format!("{name}_{number}"));
        let free = std::iter::once(name.to_string()).chain(numbers).find(|name| !self.taken.contains(name));
        let free = free.unwrap_or_default();
        self.taken.insert(free.clone());
        free
    }

    fn local(&mut self, name: &str) -> String {
        let own = self.fresh(name);
        self.locals.push(own.clone());
        own
    }

    /// A node as an expression.
    fn expression(&self, place: usize) -> Expr {
        if let Some(name) = self.variables.get(&place) {
            return Expr::new(Node::Variable(name.clone()));
        }
        match self.written.steps[place] {
            Step::Number(bits) => Expr::new(Node::Number(f64::from_bits(bits))),
            Step::Minus(a) => Expr::new(Node::Minus(self.expression(a))),
            Step::Two(operator, a, b) => Expr::new(Node::Two(operator, self.expression(a), self.expression(b))),
            Step::Whole(a) => Expr::new(Node::Whole(self.expression(a))),
            // These have variables.
            Step::Input(_) | Step::State(_) | Step::Choose(..) | Step::Cell(..) | Step::Neighbour(..) => {
                Expr::new(Node::Number(f64::NAN))
            }
        }
    }

    /// Gives a node a variable, if it needs one: `own` where it has no name, `given` at any rate.
    fn write(&mut self, place: usize, own: Option<String>, given: Option<&str>, statements: &mut Vec<Statement>) {
        let name = self.written.names.get(&place).cloned();
        match self.written.steps[place] {
            Step::Number(_) | Step::Input(_) | Step::Neighbour(..) => {}
            // A variable of what changes at the end.
            Step::State(_) => {
                if let Some(own) = own {
                    let local = self.local(&own);
                    statements.push(Statement::Set(local.clone(), self.expression(place)));
                    self.variables.insert(place, local);
                }
            }
            Step::Cell(table, row, column) => self.cell(place, (table, row, column), statements),
            step => {
                let is_alone = given.is_none() && name.is_none() && own.is_none() && self.uses[place] < 2;
                // What is used once is written there; a choice only in another choice.
                if is_alone && (!matches!(step, Step::Choose(..)) || self.is_in_choice(place)) {
                    return;
                }
                let variable = match given {
                    Some(given) => {
                        self.locals.push(given.into());
                        given.to_string()
                    }
                    None => self.local(&name.or(own).unwrap_or_else(|| "part".into())),
                };
                self.assign(&variable, place, statements);
                self.variables.insert(place, variable);
            }
        }
    }

    /// True if the one use of a choice is as one of two of another.
    fn is_in_choice(&self, place: usize) -> bool {
        self.written.steps.iter().zip(self.live).any(|(step, live)| match *step {
            Step::Choose(of, _, _, yes, no) => *live && of != place && (yes == place || no == place),
            _ => false,
        })
    }

    /// Sets a variable to a node: choices in choices are conditions in conditions.
    fn assign(&self, variable: &str, place: usize, statements: &mut Vec<Statement>) {
        match self.written.steps[place] {
            Step::Choose(of, relation, than, yes, no) if !self.variables.contains_key(&place) => {
                let than = Expr::new(Node::Number(f64::from_bits(than)));
                let test = Test(RELATIONS[usize::from(relation)], self.expression(of), than);
                let (mut one, mut other) = (Vec::new(), Vec::new());
                self.assign(variable, yes, &mut one);
                self.assign(variable, no, &mut other);
                statements.push(Statement::If(test, one, other));
            }
            _ => statements.push(Statement::Set(variable.into(), self.expression(place))),
        }
    }

    /// The four neighbours of a cell: by comparison, for there are no tables.
    fn cell(&mut self, place: usize, (table, row, column): (usize, usize, usize), statements: &mut Vec<Statement>) {
        let names = NEIGHBOURS.map(|name| self.local(name));
        for (k, name) in names.iter().enumerate() {
            statements.push(Statement::Set(name.clone(), Expr::new(Node::Number(0.0))));
            if let Some(&own) = self.written.places.get(&Step::Neighbour(place, k)) {
                self.variables.insert(own, name.clone());
            }
        }
        let rules = &self.written.tables[table];
        let is = |at: usize, k: usize| {
            let half = Expr::new(Node::Number(k as f64 - 0.25));
            Test(Relation::AtLeast, self.expression(at), half)
        };
        let set = |i: usize, j: usize| {
            let corners = names.iter().zip([(0, 0), (0, 1), (1, 0), (1, 1)]);
            let one = |(name, (di, dj)): (&String, (usize, usize))| {
                Statement::Set(name.clone(), Expr::new(Node::Number(rules[i + di][j + dj])))
            };
            Statement::If(is(column, j), corners.map(one).collect(), Vec::new())
        };
        for (i, across) in rules.iter().take(rules.len().saturating_sub(1)).enumerate() {
            let columns = (0..across.len().saturating_sub(1)).map(|j| set(i, j)).collect();
            statements.push(Statement::If(is(row, i), columns, Vec::new()));
        }
    }
}
