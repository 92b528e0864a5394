//! Small changes of a source file: what a slip of the hand could make of it.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::Path;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{BinOp, Expr, Lit, Stmt, UnOp};

/// A change of an expression or a statement.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The file, from the repository on.
    pub file: String,
    line: usize,
    /// The function it is in.
    within: String,
    /// The place of the change, in bytes.
    pub place: Range<usize>,
    was: String,
    will: String,
    kind: ChangeKind,
}

#[derive(Debug, Clone, PartialEq)]
enum ChangeKind {
    /// An expression becomes another.
    Expression,
    /// A comparison gets another operator; a test reaches it only where the two results differ.
    Comparison { left: String, right: String, was: &'static str, will: &'static str },
    /// A statement is left out.
    Statement,
    /// The body of a function begins with a return.
    Return,
}

impl Change {
    /// True if it is in this folder, or in the file beside it that is its module.
    pub fn is_in(&self, folder: &str) -> bool {
        self.file.strip_prefix(folder).is_some_and(|rest| rest.starts_with(['/', '.']))
    }

    /// The changed text, with the original one where number `k` is not turned on.
    pub fn switched(&self, k: usize) -> String {
        let (was, will) = (&self.was, &self.will);
        match &self.kind {
            ChangeKind::Expression => format!("(if crate::mutant::on({k}) {{ {will} }} else {{ {was} }})"),
            ChangeKind::Comparison { left, right, was, will } => format!(
                "(match (&({left}), &({right})) {{ (l, r) => crate::mutant::pick({k}, *l {was} *r, *l {will} *r) }})"
            ),
            ChangeKind::Statement => format!("if !crate::mutant::on({k}) {{ {was} }}"),
            ChangeKind::Return => format!("{{ if crate::mutant::on({k}) {{ return {will}; }} {was} }}"),
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = |text: &str| {
            let one = text.split_whitespace().collect::<Vec<_>>().join(" ");
            if one.chars().count() > 70 { one.chars().take(67).chain("...".chars()).collect() } else { one }
        };
        write!(f, "{}:{} {}: ", self.file, self.line, self.within)?;
        match self.kind {
            ChangeKind::Expression | ChangeKind::Comparison { .. } => {
                write!(f, "`{}` becomes `{}`", short(&self.was), short(&self.will))
            }
            ChangeKind::Statement => write!(f, "`{}` is left out", short(&self.was)),
            ChangeKind::Return => write!(f, "returns `{}` at once", self.will),
        }
    }
}

/// All changes of the files in a folder, and of the file beside it that is its module.
pub fn all(folder: &str, changes: &mut Vec<Change>) -> Result<(), String> {
    let mut files = Vec::new();
    let module = format!("{folder}.rs");
    if Path::new(&module).is_file() {
        files.push(module);
    }
    gather(folder, &mut files)?;
    files.sort();
    for file in files {
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{file}: {error}"))?;
        changes.extend(of_text(&file, &text)?);
    }
    Ok(())
}

/// All changes of the text of a file.
pub fn of_text(file: &str, text: &str) -> Result<Vec<Change>, String> {
    let parsed = syn::parse_file(text).map_err(|error| format!("{file}: {error}"))?;
    let mut finder = Finder { file, text, within: Vec::new(), changes: Vec::new() };
    finder.visit_file(&parsed);
    Ok(finder.changes)
}

fn gather(folder: &str, files: &mut Vec<String>) -> Result<(), String> {
    for entry in std::fs::read_dir(folder).map_err(|error| format!("{folder}: {error}"))?.flatten() {
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            gather(&path, files)?;
        } else if path.ends_with(".rs") && !path.ends_with("/tests.rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// Sorts changes by a hash of the seed, the changed text and its place in words, not in lines.
///
/// An edit of the source removes the changes of the edited code and adds others, whose hashes decide whether they are
/// drawn. All other changes keep their order, so that two hunts with the same seed can be compared.
pub fn shuffle(changes: &mut [Change], seed: u64) {
    // How many changes with the same words stand before it.
    let mut alike: BTreeMap<String, usize> = BTreeMap::new();
    let mut hash = |change: &Change| {
        let words = format!("{seed}\n{}\n{}\n{}\n{}", change.file, change.within, change.was, change.will);
        let before = alike.entry(words.clone()).or_default();
        *before += 1;
        crate::data::sum(format!("{words}\n{before}").as_bytes())
    };
    changes.sort_by_cached_key(|change| hash(change));
}

struct Finder<'a> {
    file: &'a str,
    text: &'a str,
    within: Vec<String>,
    changes: Vec<Change>,
}

impl Finder<'_> {
    fn add(&mut self, spanned: &impl Spanned, will: impl Into<String>, kind: ChangeKind) {
        let place = spanned.span().byte_range();
        let line = spanned.span().start().line;
        let was = self.text[place.clone()].to_string();
        let within = self.within.last().cloned().unwrap_or_default();
        self.changes.push(Change { file: self.file.into(), line, within, place, was, will: will.into(), kind });
    }

    fn text_of(&self, spanned: &impl Spanned) -> String {
        self.text[spanned.span().byte_range()].to_string()
    }

    fn function(&mut self, name: &str, output: &syn::ReturnType, block: &syn::Block) {
        self.within.push(name.to_string());
        if let syn::ReturnType::Type(_, kind) = output {
            for value in defaults(&self.text_of(kind)) {
                self.add(block, *value, ChangeKind::Return);
            }
        }
        self.visit_block(block);
        self.within.pop();
    }

    /// Replacements of the condition of an `if` or a `while`.
    fn condition(&mut self, condition: &Expr) {
        let text = self.text_of(condition);
        let has_pattern = text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "let");
        if !has_pattern {
            self.add(condition, format!("!({text})"), ChangeKind::Expression);
        }
    }
}

/// Values that a function of this type may return at once.
fn defaults(kind: &str) -> &'static [&'static str] {
    match kind {
        "bool" => &["true", "false"],
        "f64" => &["0.0", "1.0"],
        "usize" | "u64" => &["0", "1"],
        kind if kind.starts_with("Option<") => &["None"],
        kind if kind.starts_with("Vec<") => &["Vec::new()"],
        "Result<()>" => &["Ok(())"],
        _ => &[],
    }
}

/// Replacements of a binary operator.
fn others(operator: &BinOp) -> &'static [&'static str] {
    match operator {
        BinOp::Lt(_) => &["<=", ">"],
        BinOp::Le(_) => &["<", ">"],
        BinOp::Gt(_) => &[">=", "<"],
        BinOp::Ge(_) => &[">", "<"],
        BinOp::Eq(_) => &["!="],
        BinOp::Ne(_) => &["=="],
        BinOp::And(_) => &["||"],
        BinOp::Or(_) => &["&&"],
        BinOp::Add(_) => &["-"],
        BinOp::Sub(_) => &["+"],
        BinOp::Mul(_) => &["/"],
        BinOp::Div(_) => &["*"],
        BinOp::AddAssign(_) => &["-="],
        BinOp::SubAssign(_) => &["+="],
        BinOp::MulAssign(_) => &["/="],
        _ => &[],
    }
}

/// The text of an operator that compares two values without a side effect.
fn comparison(operator: &BinOp) -> Option<&'static str> {
    match operator {
        BinOp::Lt(_) => Some("<"),
        BinOp::Le(_) => Some("<="),
        BinOp::Gt(_) => Some(">"),
        BinOp::Ge(_) => Some(">="),
        BinOp::Eq(_) => Some("=="),
        BinOp::Ne(_) => Some("!="),
        _ => None,
    }
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| attribute.path().is_ident("test") || attribute.path().is_ident("cfg"))
}

impl<'a> Visit<'a> for Finder<'_> {
    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    // What is computed when the program is built cannot be switched.
    fn visit_item_const(&mut self, _: &'a syn::ItemConst) {}
    fn visit_item_static(&mut self, _: &'a syn::ItemStatic) {}
    fn visit_impl_item_const(&mut self, _: &'a syn::ImplItemConst) {}
    fn visit_type(&mut self, _: &'a syn::Type) {}
    fn visit_pat(&mut self, _: &'a syn::Pat) {}
    fn visit_attribute(&mut self, _: &'a syn::Attribute) {}
    fn visit_generic_argument(&mut self, _: &'a syn::GenericArgument) {}

    fn visit_expr_repeat(&mut self, expression: &'a syn::ExprRepeat) {
        self.visit_expr(&expression.expr);
    }

    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        if item.sig.constness.is_none() && !is_test(&item.attrs) {
            self.function(&item.sig.ident.to_string(), &item.sig.output, &item.block);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if item.sig.constness.is_none() {
            self.function(&item.sig.ident.to_string(), &item.sig.output, &item.block);
        }
    }

    fn visit_stmt(&mut self, statement: &'a Stmt) {
        if let Stmt::Expr(Expr::MethodCall(_) | Expr::Assign(_) | Expr::Call(_) | Expr::Binary(_), Some(_)) = statement
        {
            self.add(statement, "", ChangeKind::Statement);
        }
        visit::visit_stmt(self, statement);
    }

    fn visit_expr_if(&mut self, expression: &'a syn::ExprIf) {
        self.condition(&expression.cond);
        visit::visit_expr_if(self, expression);
    }

    fn visit_expr_binary(&mut self, expression: &'a syn::ExprBinary) {
        let (left, right) = (self.text_of(&expression.left), self.text_of(&expression.right));
        let has_pattern = matches!(*expression.left, Expr::Let(_)) || matches!(*expression.right, Expr::Let(_));
        if !has_pattern {
            for &other in others(&expression.op) {
                let kind = match comparison(&expression.op) {
                    Some(was) => ChangeKind::Comparison { left: left.clone(), right: right.clone(), was, will: other },
                    None => ChangeKind::Expression,
                };
                self.add(expression, format!("{left} {other} {right}"), kind);
            }
        }
        visit::visit_expr_binary(self, expression);
    }

    fn visit_expr_unary(&mut self, expression: &'a syn::ExprUnary) {
        if matches!(expression.op, UnOp::Neg(_) | UnOp::Not(_)) {
            self.add(expression, self.text_of(&expression.expr), ChangeKind::Expression);
        }
        visit::visit_expr_unary(self, expression);
    }

    fn visit_expr_lit(&mut self, expression: &'a syn::ExprLit) {
        let text = self.text_of(expression);
        match &expression.lit {
            Lit::Float(value) => {
                let zero = value.base10_parse::<f64>().is_ok_and(|value| value == 0.0);
                self.add(expression, if zero { "1.0".into() } else { format!("2.0 * {text}") }, ChangeKind::Expression);
            }
            Lit::Int(_) => self.add(expression, format!("{text} + 1"), ChangeKind::Expression),
            Lit::Bool(value) => self.add(expression, (!value.value).to_string(), ChangeKind::Expression),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edit_leaves_the_order_of_all_other_changes() {
        let order = |text: &str, seed| {
            let mut changes = of_text("a.rs", text).unwrap();
            shuffle(&mut changes, seed);
            changes.iter().map(|change| (change.was.clone(), change.will.clone())).collect::<Vec<_>>()
        };
        let text = "fn sum(a: f64, b: f64, c: f64) -> f64 { (a + b) - (a * c) + (b / c) + (a + b) }";
        let edited = format!("fn none(b: bool) -> bool {{ !b }}\n\n{}", text.replace("(b / c)", "c"));
        let before = order(text, 1);
        let kept: Vec<_> = order(&edited, 1).into_iter().filter(|change| before.contains(change)).collect();
        let expected: Vec<_> = before.iter().filter(|(was, _)| !was.contains("b / c")).cloned().collect();
        assert_eq!(kept, expected);
        assert_ne!(order(text, 2), before);
        assert_eq!(expected.iter().filter(|(was, _)| was == "a + b").count(), 2);
    }

    #[test]
    fn a_comparison_is_evaluated_once_and_reached_where_its_result_differs() {
        let changes = of_text("core/src/solve/a.rs", "fn is_less(a: f64) -> bool { a < 2.0 }").unwrap();
        let texts: Vec<String> = changes.iter().map(Change::to_string).collect();
        let expected = [
            "core/src/solve/a.rs:1 is_less: returns `true` at once",
            "core/src/solve/a.rs:1 is_less: returns `false` at once",
            "core/src/solve/a.rs:1 is_less: `a < 2.0` becomes `a <= 2.0`",
            "core/src/solve/a.rs:1 is_less: `a < 2.0` becomes `a > 2.0`",
            "core/src/solve/a.rs:1 is_less: `2.0` becomes `2.0 * 2.0`",
        ];
        assert_eq!(texts, expected);
        let text = "(match (&(a), &(2.0)) { (l, r) => crate::mutant::pick(7, *l < *r, *l <= *r) })";
        assert_eq!(changes[2].switched(7), text);
        assert!(changes[0].is_in("core/src/solve") && !changes[0].is_in("core/src/sol"));
    }
}
