//! A small language for what is computed once a sample: assignments and conditions, no loops. It is written out as C
//! and as Structured Text, in the same order of operations, so that both give the same bits.

use std::collections::HashSet;
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

/// An operation on two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

    fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Operator::Plus => a + b,
            Operator::Minus => a - b,
            Operator::Times => a * b,
            Operator::Over => a / b,
        }
    }
}

/// A number as it stands.
pub(super) fn number(value: f64) -> Expr {
    Expr(Rc::new(Node::Number(value)))
}

/// A variable by its name.
pub(super) fn variable(name: &str) -> Expr {
    Expr(Rc::new(Node::Variable(name.to_string())))
}

impl Expr {
    pub(super) fn node(&self) -> &Node {
        &self.0
    }

    /// Its value, where that is known already.
    pub(super) fn known(&self) -> Option<f64> {
        match *self.0 {
            Node::Number(value) => Some(value),
            _ => None,
        }
    }

    /// The whole number below it.
    pub(super) fn whole(self) -> Expr {
        Expr(Rc::new(Node::Whole(self)))
    }

    fn two(operator: Operator, a: Expr, b: Expr) -> Expr {
        match (operator, a.known(), b.known()) {
            // Two numbers are joined now, as they would be later.
            (_, Some(a), Some(b)) => number(operator.of(a, b)),
            (Operator::Times, Some(1.0), None) => b,
            (Operator::Times | Operator::Over, None, Some(1.0)) => a,
            _ => Expr(Rc::new(Node::Two(operator, a, b))),
        }
    }

    fn reads(&self, names: &mut HashSet<String>) {
        match &*self.0 {
            Node::Number(_) => {}
            Node::Variable(name) => {
                names.insert(name.clone());
            }
            Node::Minus(a) | Node::Whole(a) => a.reads(names),
            Node::Two(_, a, b) => {
                a.reads(names);
                b.reads(names);
            }
        }
    }

    /// The first number in it that is none.
    fn fault(&self) -> Option<f64> {
        match &*self.0 {
            Node::Number(value) => (!value.is_finite()).then_some(*value),
            Node::Variable(_) => None,
            Node::Minus(a) | Node::Whole(a) => a.fault(),
            Node::Two(_, a, b) => a.fault().or_else(|| b.fault()),
        }
    }
}

macro_rules! operators {
    ($($trait:ident $function:ident $operator:ident),*) => {
        $(
            impl $trait for Expr {
                type Output = Expr;
                fn $function(self, other: Expr) -> Expr {
                    Expr::two(Operator::$operator, self, other)
                }
            }

            impl $trait<&Expr> for &Expr {
                type Output = Expr;
                fn $function(self, other: &Expr) -> Expr {
                    Expr::two(Operator::$operator, self.clone(), other.clone())
                }
            }

            impl $trait<&Expr> for f64 {
                type Output = Expr;
                fn $function(self, other: &Expr) -> Expr {
                    Expr::two(Operator::$operator, number(self), other.clone())
                }
            }

            impl $trait<Expr> for f64 {
                type Output = Expr;
                fn $function(self, other: Expr) -> Expr {
                    Expr::two(Operator::$operator, number(self), other)
                }
            }

            impl $trait<f64> for Expr {
                type Output = Expr;
                fn $function(self, other: f64) -> Expr {
                    Expr::two(Operator::$operator, self, number(other))
                }
            }
        )*
    };
}

operators! { Add add Plus, Sub sub Minus, Mul mul Times, Div div Over }

impl Neg for Expr {
    type Output = Expr;
    fn neg(self) -> Expr {
        match self.known() {
            Some(value) => number(-value),
            None => Expr(Rc::new(Node::Minus(self))),
        }
    }
}

/// How two numbers compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Relation {
    Less,
    More,
    AtLeast,
}

impl Relation {
    pub(super) fn sign(self) -> &'static str {
        match self {
            Relation::Less => "<",
            Relation::More => ">",
            Relation::AtLeast => ">=",
        }
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

/// Something with a name.
#[derive(Debug, Clone)]
pub(super) struct Variable {
    pub name: String,
    /// The value that a state begins with.
    pub start: f64,
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
    /// Blocks of statements that are open.
    open: Vec<Vec<Statement>>,
}

impl Program {
    pub(super) fn input(&mut self, name: &str, about: &str) -> Expr {
        self.inputs.push(Variable { name: name.into(), start: 0.0, about: about.into() });
        variable(name)
    }

    pub(super) fn state(&mut self, name: &str, start: f64, about: &str) -> Expr {
        self.states.push(Variable { name: name.into(), start, about: about.into() });
        variable(name)
    }

    fn push(&mut self, statement: Statement) {
        match self.open.last_mut() {
            Some(block) => block.push(statement),
            None => self.body.push(statement),
        }
    }

    pub(super) fn remark(&mut self, text: &str) {
        self.push(Statement::Remark(text.into()));
    }

    /// Gives a state, or a local, a value.
    pub(super) fn set(&mut self, name: &str, value: Expr) {
        self.push(Statement::Set(name.into(), value));
    }

    /// A local with a value; what is known already needs none.
    pub(super) fn local(&mut self, name: &str, value: Expr) -> Expr {
        if value.known().is_some() {
            return value;
        }
        self.declare(name);
        self.set(name, value);
        variable(name)
    }

    pub(super) fn declare(&mut self, name: &str) -> Expr {
        if !self.locals.iter().any(|local| local == name) {
            self.locals.push(name.into());
        }
        variable(name)
    }

    /// Does one thing or another.
    pub(super) fn when(&mut self, test: Test, then: impl FnOnce(&mut Self), or: impl FnOnce(&mut Self)) {
        self.open.push(Vec::new());
        then(self);
        let yes = self.open.pop().unwrap_or_default();
        self.open.push(Vec::new());
        or(self);
        let no = self.open.pop().unwrap_or_default();
        self.push(Statement::If(test, yes, no));
    }

    /// A local that is one of two numbers.
    pub(super) fn choose(&mut self, name: &str, test: Test, yes: Expr, no: Expr) -> Expr {
        if let (Some(a), Some(b)) = (yes.known(), no.known())
            && a.to_bits() == b.to_bits()
        {
            return yes;
        }
        self.declare(name);
        self.when(test, |p| p.set(name, yes), |p| p.set(name, no));
        variable(name)
    }

    /// A local within a limit on both sides.
    pub(super) fn within(&mut self, name: &str, value: Expr, low: f64, high: f64) -> Expr {
        let local = self.declare(name);
        if !matches!(value.node(), Node::Variable(own) if own == name) {
            self.set(name, value);
        }
        self.when(
            Test(Relation::Less, local.clone(), number(low)),
            |p| p.set(name, number(low)),
            |p| p.when(Test(Relation::More, variable(name), number(high)), |p| p.set(name, number(high)), |_| {}),
        );
        local
    }

    /// Leaves out what nobody reads, and says which number of the rest is none.
    pub(super) fn finish(mut self, result: &str) -> Result<Self, f64> {
        self.result = result.into();
        loop {
            let mut read = HashSet::from([result.to_string()]);
            reads(&self.body, &mut read);
            let before = self.locals.len() + self.states.len();
            self.locals.retain(|local| read.contains(local));
            // A state that only it itself reads is of no use either; a second look finds what it read.
            self.states.retain(|state| read.contains(&state.name));
            let keep: HashSet<String> =
                self.locals.iter().cloned().chain(self.states.iter().map(|state| state.name.clone())).collect();
            self.body = kept(std::mem::take(&mut self.body), &keep);
            if self.locals.len() + self.states.len() == before {
                break;
            }
        }
        match fault(&self.body) {
            None => Ok(self),
            Some(value) => Err(value),
        }
    }

    /// Inputs that are read.
    pub(super) fn read_inputs(&self) -> HashSet<String> {
        let mut read = HashSet::new();
        reads(&self.body, &mut read);
        read
    }
}

fn reads(body: &[Statement], names: &mut HashSet<String>) {
    for statement in body {
        match statement {
            Statement::Set(_, value) => value.reads(names),
            Statement::If(Test(_, a, b), yes, no) => {
                a.reads(names);
                b.reads(names);
                reads(yes, names);
                reads(no, names);
            }
            Statement::Remark(_) => {}
        }
    }
}

/// The statements that give something that is kept a value.
fn kept(body: Vec<Statement>, keep: &HashSet<String>) -> Vec<Statement> {
    let one = |statement| match statement {
        Statement::Set(name, value) => keep.contains(&name).then_some(Statement::Set(name, value)),
        Statement::If(test, yes, no) => {
            let (yes, no) = (kept(yes, keep), kept(no, keep));
            (!(yes.is_empty() && no.is_empty())).then_some(Statement::If(test, yes, no))
        }
        Statement::Remark(text) => Some(Statement::Remark(text)),
    };
    body.into_iter().filter_map(one).collect()
}

fn fault(body: &[Statement]) -> Option<f64> {
    body.iter().find_map(|statement| match statement {
        Statement::Set(_, value) => value.fault(),
        Statement::If(Test(_, a, b), yes, no) => {
            a.fault().or_else(|| b.fault()).or_else(|| fault(yes)).or_else(|| fault(no))
        }
        Statement::Remark(_) => None,
    })
}
