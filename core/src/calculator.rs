//! Arithmetic for control laws. A law is written once; it runs on numbers ([`Evaluation`]), gives its derivatives
//! ([`Slope`]), and is exported as a program (`export::program`).

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of a calculator.
pub trait Number:
    Copy
    + Debug
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
}

impl<N> Number for N where
    N: Copy
        + Debug
        + Neg<Output = N>
        + Add<Output = N>
        + Sub<Output = N>
        + Mul<Output = N>
        + Div<Output = N>
        + Add<f64, Output = N>
        + Sub<f64, Output = N>
        + Mul<f64, Output = N>
        + Div<f64, Output = N>
{
}

/// Relation of a number to a constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// Less than the constant.
    Less,
    /// Greater than the constant.
    More,
    /// At least the constant.
    AtLeast,
}

/// A condition.
#[derive(Debug, Clone, Copy)]
pub struct Test<N> {
    /// The number.
    pub of: N,
    /// Relation of the number to the constant.
    pub relation: Relation,
    /// To this constant.
    pub than: f64,
}

/// `of` < `than`
pub fn less<N>(of: N, than: f64) -> Test<N> {
    Test { of, relation: Relation::Less, than }
}

/// `of` > `than`
pub fn more<N>(of: N, than: f64) -> Test<N> {
    Test { of, relation: Relation::More, than }
}

/// `of` ≥ `than`
pub fn at_least<N>(of: N, than: f64) -> Test<N> {
    Test { of, relation: Relation::AtLeast, than }
}

impl Test<f64> {
    /// True if the condition holds; false for NaN.
    #[inline]
    pub fn holds(&self) -> bool {
        match self.relation {
            Relation::Less => self.of < self.than,
            Relation::More => self.of > self.than,
            Relation::AtLeast => self.of >= self.than,
        }
    }
}

/// Index of a number stored from sample to sample. All begin at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot(usize);

impl Slot {
    /// Index among the stored numbers.
    pub const fn place(self) -> usize {
        self.0
    }
}

/// Stored numbers of a law.
#[derive(Debug, Clone, Default)]
pub struct Slots(Vec<(String, &'static str)>);

impl Slots {
    /// Adds a stored number with its name and description.
    pub fn add(&mut self, name: impl Into<String>, about: &'static str) -> Slot {
        self.0.push((name.into(), about));
        Slot(self.0.len() - 1)
    }

    /// Adds a numbered list of stored numbers.
    pub fn list(&mut self, count: usize, name: &str, about: &'static str) -> Vec<Slot> {
        (0..count).map(|k| self.add(format!("{name}{k}"), about)).collect()
    }

    /// Number of stored numbers.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Names and descriptions.
    pub fn all(&self) -> impl Iterator<Item = (&str, &'static str)> {
        self.0.iter().map(|(name, about)| (name.as_str(), *about))
    }
}

/// Arithmetic of a control law, without loops that depend on values; both sides of a choice are evaluated.
pub trait Calculator {
    /// Its numbers.
    type N: Number;

    /// A constant.
    fn number(&mut self, value: f64) -> Self::N;

    /// The value stored last.
    fn memory(&mut self, slot: Slot) -> Self::N;

    /// Remembers.
    fn keep(&mut self, slot: Slot, value: Self::N);

    /// Selects one of two values.
    fn choose(&mut self, test: Test<Self::N>, yes: Self::N, no: Self::N) -> Self::N;

    /// Integer part of a number that is not negative.
    fn whole(&mut self, value: Self::N) -> Self::N;

    /// Four neighbours in a square table at integer `row` and `column`: the element, the next in its row, the next in
    /// its column, and the diagonal one.
    fn neighbours(&mut self, table: &[Vec<f64>], row: Self::N, column: Self::N) -> [Self::N; 4];

    /// Names a number in an exported program.
    fn name(&mut self, name: &'static str, value: Self::N) -> Self::N;

    /// Names a value with a number.
    fn numbered(&mut self, name: &'static str, number: usize, value: Self::N) -> Self::N;

    /// Comment in an exported program on the next lines.
    fn remark(&mut self, text: &str);

    /// Clips a number to two limits.
    fn within(&mut self, value: Self::N, low: f64, high: f64) -> Self::N {
        let [low_end, high_end] = [low, high].map(|end| self.number(end));
        let held = self.choose(more(value, high), high_end, value);
        self.choose(less(value, low), low_end, held)
    }
}

/// Evaluation on numbers.
#[derive(Debug)]
pub struct Evaluation<'m> {
    memory: &'m mut [f64],
}

impl<'m> Evaluation<'m> {
    /// Evaluation with this memory.
    pub fn on(memory: &'m mut [f64]) -> Self {
        Self { memory }
    }
}

impl Evaluation<'static> {
    /// Evaluation of formulas without memory.
    pub fn plain() -> Self {
        Self { memory: &mut [] }
    }
}

impl Calculator for Evaluation<'_> {
    type N = f64;

    #[inline]
    fn number(&mut self, value: f64) -> f64 {
        value
    }

    #[inline]
    fn memory(&mut self, slot: Slot) -> f64 {
        self.memory[slot.0]
    }

    #[inline]
    fn keep(&mut self, slot: Slot, value: f64) {
        self.memory[slot.0] = value;
    }

    #[inline]
    fn choose(&mut self, test: Test<f64>, yes: f64, no: f64) -> f64 {
        if test.holds() { yes } else { no }
    }

    #[inline]
    fn whole(&mut self, value: f64) -> f64 {
        value.trunc()
    }

    #[inline]
    fn neighbours(&mut self, table: &[Vec<f64>], row: f64, column: f64) -> [f64; 4] {
        neighbours(table, row, column)
    }

    #[inline]
    fn name(&mut self, _: &'static str, value: f64) -> f64 {
        value
    }

    #[inline]
    fn numbered(&mut self, _: &'static str, _: usize, value: f64) -> f64 {
        value
    }

    #[inline]
    fn remark(&mut self, _: &str) {}
}

fn neighbours(table: &[Vec<f64>], row: f64, column: f64) -> [f64; 4] {
    let (i, j) = (row as usize, column as usize);
    let at = |i: usize, j: usize| table.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0);
    [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]
}

/// A number with its derivative along one direction (forward-mode differentiation).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    /// The number.
    pub value: f64,
    /// Its slope.
    pub slope: f64,
}

impl Dual {
    /// A number that does not change.
    pub const fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}

impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        Dual { value: -self.value, slope: -self.slope }
    }
}

impl Add for Dual {
    type Output = Dual;
    fn add(self, other: Dual) -> Dual {
        Dual { value: self.value + other.value, slope: self.slope + other.slope }
    }
}

impl Sub for Dual {
    type Output = Dual;
    fn sub(self, other: Dual) -> Dual {
        Dual { value: self.value - other.value, slope: self.slope - other.slope }
    }
}

impl Mul for Dual {
    type Output = Dual;
    fn mul(self, other: Dual) -> Dual {
        Dual { value: self.value * other.value, slope: self.slope * other.value + self.value * other.slope }
    }
}

impl Div for Dual {
    type Output = Dual;
    fn div(self, other: Dual) -> Dual {
        let value = self.value / other.value;
        Dual { value, slope: (self.slope - value * other.slope) / other.value }
    }
}

impl Add<f64> for Dual {
    type Output = Dual;
    fn add(self, other: f64) -> Dual {
        Dual { value: self.value + other, ..self }
    }
}

impl Sub<f64> for Dual {
    type Output = Dual;
    fn sub(self, other: f64) -> Dual {
        Dual { value: self.value - other, ..self }
    }
}

impl Mul<f64> for Dual {
    type Output = Dual;
    fn mul(self, other: f64) -> Dual {
        Dual { value: self.value * other, slope: self.slope * other }
    }
}

impl Div<f64> for Dual {
    type Output = Dual;
    fn div(self, other: f64) -> Dual {
        Dual { value: self.value / other, slope: self.slope / other }
    }
}

/// Derivatives along one direction of the memory and the inputs of a law. At a kink, the derivative belongs to the
/// branch that the law selects.
#[derive(Debug)]
pub struct Slope {
    /// The memory.
    pub memory: Vec<Dual>,
}

impl Calculator for Slope {
    type N = Dual;

    fn number(&mut self, value: f64) -> Dual {
        Dual::constant(value)
    }

    fn memory(&mut self, slot: Slot) -> Dual {
        self.memory[slot.0]
    }

    fn keep(&mut self, slot: Slot, value: Dual) {
        self.memory[slot.0] = value;
    }

    fn choose(&mut self, Test { of, relation, than }: Test<Dual>, yes: Dual, no: Dual) -> Dual {
        if (Test { of: of.value, relation, than }).holds() { yes } else { no }
    }

    fn whole(&mut self, value: Dual) -> Dual {
        Dual::constant(value.value.trunc())
    }

    fn neighbours(&mut self, table: &[Vec<f64>], row: Dual, column: Dual) -> [Dual; 4] {
        neighbours(table, row.value, column.value).map(Dual::constant)
    }

    fn name(&mut self, _: &'static str, value: Dual) -> Dual {
        value
    }

    fn numbered(&mut self, _: &'static str, _: usize, value: Dual) -> Dual {
        value
    }

    fn remark(&mut self, _: &str) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_differences() {
        let text = |c: &mut Slope, x: Dual| {
            let held = c.within(x, -3.0, 3.0);
            let chosen = c.choose(less(x, 1.0), x * x, x / (x + 2.0));
            (-held * 2.0 + chosen - 1.0) / (x * x + 1.0)
        };
        for x in [-4.0, -0.3, 0.7, 2.5, 5.0] {
            let at = |value: f64, slope: f64| text(&mut Slope { memory: Vec::new() }, Dual { value, slope });
            let h = 1e-6;
            let difference = (at(x + h, 0.0).value - at(x - h, 0.0).value) / (2.0 * h);
            assert!((at(x, 1.0).slope - difference).abs() < 1e-8, "{x}");
        }
    }
}
