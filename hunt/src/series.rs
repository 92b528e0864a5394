//! Linear forms of the state, the input and one; Taylor series of states that obey them; what rounding may do to both.

use crate::double::{Double, ROUNDING};
use crate::machine::{STATES, State};
use crate::root::Polynomial;
use std::ops::{Add, Mul, Neg, Sub};

/// Order of the Taylor series.
pub const ORDER: usize = 32;

/// Rounding of a state so far, as a share of the largest value that it had.
const GATHERED: f64 = 1e-27;

/// A linear form of the state, the input, and one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Form {
    /// On the state.
    pub on: [Double; STATES],
    /// On the input.
    pub input: Double,
    /// The constant part.
    pub one: Double,
}

impl Form {
    /// An element of the state.
    pub fn state(place: usize) -> Self {
        let mut form = Self::default();
        form.on[place] = Double::ONE;
        form
    }

    /// The input.
    pub fn input() -> Self {
        Self { input: Double::ONE, ..Self::default() }
    }

    /// A number.
    pub fn constant(one: Double) -> Self {
        Self { one, ..Self::default() }
    }
}

impl Add for Form {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let on = std::array::from_fn(|j| self.on[j] + other.on[j]);
        Self { on, input: self.input + other.input, one: self.one + other.one }
    }
}

impl Mul<Double> for Form {
    type Output = Self;
    fn mul(self, factor: Double) -> Self {
        Self { on: self.on.map(|c| c * factor), input: self.input * factor, one: self.one * factor }
    }
}

impl Neg for Form {
    type Output = Self;
    fn neg(self) -> Self {
        self * Double::from(-1.0)
    }
}

impl Sub for Form {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

/// The same without its zeros.
#[derive(Debug, Clone)]
pub struct Row {
    on: Vec<(usize, Double)>,
    input: Double,
    one: Double,
}

impl From<Form> for Row {
    fn from(form: Form) -> Self {
        let on = form.on.into_iter().enumerate().filter(|(_, c)| *c != Double::ZERO);
        Self { on: on.collect(), input: form.input, one: form.one }
    }
}

impl Row {
    /// Term k of its series.
    #[inline]
    fn term(&self, k: usize, z: &State, u: &Polynomial) -> Double {
        let mut sum = if k == 0 { self.one } else { Double::ZERO };
        if self.input.high != 0.0 {
            sum += self.input * u[k];
        }
        for &(place, c) in &self.on {
            sum += c * z[place];
        }
        sum
    }

    /// Σ |c| of the values given for the states and the input.
    fn most(&self, states: &[f64; STATES], input: f64) -> f64 {
        let on: f64 = self.on.iter().map(|&(place, c)| c.high.abs() * states[place]).sum();
        on + self.input.high.abs() * input
    }

    /// Coefficient on an element of the state.
    fn coefficient(&self, place: usize) -> f64 {
        self.on.iter().find(|(at, _)| *at == place).map_or(0.0, |(_, c)| c.high)
    }
}

/// Rates of the states that move.
#[derive(Debug, Clone)]
pub struct Rates {
    rows: Vec<(usize, Row)>,
}

impl Rates {
    /// From the rate of each state.
    pub fn new(forms: &[Form; STATES]) -> Self {
        let moving = forms.iter().enumerate().filter(|(_, form)| **form != Form::default());
        Self { rows: moving.map(|(place, &form)| (place, Row::from(form))).collect() }
    }

    /// About how fast the fastest motion is, 1/s: stiffness by its square root, what damps as it is.
    pub fn fastest(&self) -> f64 {
        let is_speed = |place: usize| [1, 3, 5, 8].contains(&place);
        let (mut swing, mut damp, mut exchange) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (place, row) in &self.rows {
            for &(column, c) in &row.on {
                let c = c.high.abs();
                match (is_speed(*place), is_speed(column), *place == column) {
                    (true, false, _) if column != crate::machine::CURRENT => swing = swing.max(c),
                    (_, _, true) => damp = damp.max(c),
                    (true, true, false) => damp = damp.max(c),
                    (true, false, false) | (false, true, false) => {
                        let back = self.rows.iter().find(|(at, _)| *at == column);
                        exchange = exchange.max(back.map_or(0.0, |(_, back)| (back.coefficient(*place) * c).abs()));
                    }
                    (false, false, false) => {}
                }
            }
        }
        (2.0 * swing).sqrt() + damp + exchange.sqrt()
    }
}

/// A Taylor series of the state: z(t + s h) = Σ termsₖ sᵏ.
pub struct Series {
    /// Its terms.
    pub terms: [State; ORDER + 1],
    /// Those of the input.
    pub input: Polynomial,
    /// Σ |terms[k]| for k ≥ 1.
    change: [f64; STATES],
    input_change: f64,
}

impl Series {
    /// Of the state `z` over a time `h`, the input being `input`.
    pub fn new(rates: &Rates, z: &State, input: Polynomial, h: Double) -> Self {
        let mut terms = [[Double::ZERO; STATES]; ORDER + 1];
        terms[0] = *z;
        let mut change = [0.0; STATES];
        for k in 0..ORDER {
            // (k + 1) z_{k+1} = h (A z_k + b u_k + c δ_k0)
            let factor = h / Double::from((k + 1) as f64);
            for (place, row) in &rates.rows {
                let term = row.term(k, &terms[k], &input) * factor;
                terms[k + 1][*place] = term;
                change[*place] += term.high.abs();
            }
        }
        let input_change = input[1..].iter().map(|u| u.high.abs()).sum();
        Self { terms, input, change, input_change }
    }

    /// The most that the input may be up to s = 1.
    pub fn input_size(&self) -> f64 {
        self.input[0].high.abs() + self.input_change
    }

    /// How far, in parts of h, the terms left out are below rounding.
    pub fn reach(&self, size: &Size) -> f64 {
        let mut reach = f64::INFINITY;
        let mut look = |size: f64, k: usize, term: Double| {
            let term = term.high.abs();
            if term > 0.0 {
                reach = reach.min((1e-31 * size / term).powf(1.0 / k as f64));
            }
        };
        for k in [ORDER - 1, ORDER] {
            for (place, size) in size.states.iter().enumerate() {
                let early: f64 = (0..8).map(|j| self.terms[j][place].high.abs()).fold(0.0, f64::max);
                look(size.max(early), k, self.terms[k][place]);
            }
            look(self.input[..8].iter().map(|u| u.high.abs()).fold(0.0, f64::max), k, self.input[k]);
        }
        reach
    }

    /// The state at s.
    pub fn at(&self, s: Double) -> State {
        std::array::from_fn(|j| {
            if self.change[j] == 0.0 {
                return self.terms[0][j];
            }
            self.terms.iter().rev().fold(Double::ZERO, |sum, term| sum * s + term[j])
        })
    }

    /// Value of a form at the start.
    pub fn value(&self, row: &Row) -> Double {
        row.term(0, &self.terms[0], &self.input)
    }

    /// The most that it can change up to s = 1.
    pub fn change(&self, row: &Row) -> f64 {
        row.most(&self.change, self.input_change)
    }

    /// Its series.
    pub fn polynomial(&self, row: &Row) -> Polynomial {
        std::array::from_fn(|k| row.term(k, &self.terms[k], &self.input))
    }
}

/// The largest values that states and input had so far.
#[derive(Debug, Clone, Copy, Default)]
pub struct Size {
    /// Of each state.
    pub states: [f64; STATES],
    /// Of the input.
    pub input: f64,
}

/// Rounding of each term of a series.
pub struct Noise {
    states: [[f64; STATES]; ORDER + 1],
    /// Rounding of the states and the input themselves.
    terms: [([f64; STATES], f64); ORDER + 1],
}

impl Noise {
    /// Of `series` over a time `h`.
    pub fn new(rates: &Rates, series: &Series, h: f64, size: &Size) -> Self {
        let mut states = [[0.0; STATES]; ORDER + 1];
        states[0] = size.states.map(|size| GATHERED * size);
        let mut terms = std::array::from_fn(|k| {
            let round = |value: Double| 4.0 * ROUNDING * value.high.abs();
            (series.terms[k].map(round), round(series.input[k]))
        });
        // Of a line or a wave where it crosses zero, the moment is what rounding has touched.
        terms[0].1 += GATHERED * size.input;
        let mut noise = Self { states, terms };
        for k in 0..ORDER {
            for (place, row) in &rates.rows {
                noise.states[k + 1][*place] = noise.of(row, k) * h / (k + 1) as f64;
            }
        }
        noise
    }

    /// Of term k of a form.
    pub fn of(&self, row: &Row, k: usize) -> f64 {
        let (terms, input) = &self.terms[k];
        let one = if k == 0 { 4.0 * ROUNDING * row.one.high.abs() } else { 0.0 };
        row.most(&self.states[k], 0.0) + row.most(terms, *input) + one
    }
}
