//! Linear forms of the state, the forces that are no straight lines, the inputs and one; Taylor series of states that
//! obey them; what rounding may do to both.

use crate::curve::{Curved, Work};
use crate::double::{Double, ROUNDING};
use crate::machine::{BODIES, CURRENT, DRIVES, ROTOR, STATES, State};
use crate::root::Polynomial;
use crate::terms::{ORDER, PLACES, Terms};
use std::ops::{Add, Mul, Neg, Sub};

/// Rounding of a state so far, as a share of the largest value that it had.
const GATHERED: f64 = 1e-27;

/// A linear form of the state, curved forces, the inputs, and one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// On the state and what stands behind it.
    pub on: [Double; PLACES],
    /// On the inputs.
    pub input: [Double; DRIVES],
    /// The constant part.
    pub one: Double,
}

impl Default for Form {
    fn default() -> Self {
        Self { on: [Double::ZERO; PLACES], input: [Double::ZERO; DRIVES], one: Double::ZERO }
    }
}

impl Form {
    /// An element of the state.
    pub fn state(place: usize) -> Self {
        let mut form = Self::default();
        form.on[place] = Double::ONE;
        form
    }

    /// The input of a drive.
    pub fn input(drive: usize) -> Self {
        let mut form = Self::default();
        form.input[drive] = Double::ONE;
        form
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
        let input = std::array::from_fn(|j| self.input[j] + other.input[j]);
        Self { on, input, one: self.one + other.one }
    }
}

impl Mul<Double> for Form {
    type Output = Self;
    fn mul(self, factor: Double) -> Self {
        let input = self.input.map(|c| c * factor);
        Self { on: self.on.map(|c| c * factor), input, one: self.one * factor }
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
    input: Vec<(usize, Double)>,
    one: Double,
}

impl From<Form> for Row {
    fn from(form: Form) -> Self {
        let given = |c: &(usize, Double)| c.1 != Double::ZERO;
        let on = form.on.into_iter().enumerate().filter(given).collect();
        let input = form.input.into_iter().enumerate().filter(given).collect();
        Self { on, input, one: form.one }
    }
}

impl Row {
    /// Term k of its series.
    #[inline]
    fn term(&self, k: usize, z: &[Double; PLACES], u: &[Polynomial; DRIVES]) -> Double {
        let mut sum = if k == 0 { self.one } else { Double::ZERO };
        for &(drive, c) in &self.input {
            sum += c * u[drive][k];
        }
        for &(place, c) in &self.on {
            sum += c * z[place];
        }
        sum
    }

    /// Its value in a state, of a form without curved forces.
    pub fn value(&self, state: &State, u: &[Polynomial; DRIVES]) -> Double {
        let mut z = [Double::ZERO; PLACES];
        z[..STATES].copy_from_slice(state);
        self.term(0, &z, u)
    }

    /// Σ |c| of the values given for the states and the inputs.
    fn most(&self, states: &[f64; PLACES], inputs: &[f64; DRIVES]) -> f64 {
        let on: f64 = self.on.iter().map(|&(place, c)| c.high.abs() * states[place]).sum();
        let inputs: f64 = self.input.iter().map(|&(drive, c)| c.high.abs() * inputs[drive]).sum();
        on + inputs
    }

    /// Coefficient on an element of the state.
    fn coefficient(&self, place: usize) -> f64 {
        self.on.iter().find(|(at, _)| *at == place).map_or(0.0, |(_, c)| c.high)
    }
}

/// Rates of the states that move, and the forces that are no straight lines.
#[derive(Debug, Clone)]
pub struct Rates {
    rows: Vec<(usize, Row)>,
    curved: Vec<Curved>,
}

impl Rates {
    /// From the rate of each state.
    pub fn new(forms: &[Form; STATES], curved: Vec<Curved>) -> Self {
        let moving = forms.iter().enumerate().filter(|(_, form)| **form != Form::default());
        Self { rows: moving.map(|(place, &form)| (place, Row::from(form))).collect(), curved }
    }

    /// Forces that the curves may reach.
    pub fn scales(&self) -> impl Iterator<Item = (usize, f64)> {
        self.curved.iter().map(|curved| (curved.place, curved.scale()))
    }

    /// About how fast the fastest motion is, 1/s: stiffness by its square root, what damps as it is.
    pub fn fastest(&self) -> f64 {
        let is_speed = |place: usize| (place < 2 * BODIES && place % 2 == 1) || ROTOR.iter().any(|at| at[1] == place);
        let (mut swing, mut damp, mut exchange) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (place, row) in &self.rows {
            for &(column, c) in row.on.iter().filter(|on| on.0 < STATES) {
                let c = c.high.abs();
                match (is_speed(*place), is_speed(column), *place == column) {
                    (true, false, _) if !CURRENT.contains(&column) => swing = swing.max(c),
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
    pub terms: Box<Terms>,
    /// Those of the inputs.
    pub input: [Polynomial; DRIVES],
    /// The part of h on which the terms of the curved forces show what they do.
    part: f64,
    /// Σ |terms[k]| for k ≥ 1.
    change: [f64; PLACES],
    input_change: [f64; DRIVES],
}

impl Series {
    /// Of the state `z` over a time `h`, the inputs being `input`.
    pub fn new(rates: &Rates, z: &State, input: [Polynomial; DRIVES], h: Double) -> Self {
        let mut terms = Box::new([[Double::ZERO; PLACES]; ORDER + 1]);
        terms[0][..STATES].copy_from_slice(z);
        let mut change = [0.0; PLACES];
        let mut works: Vec<Work> = rates.curved.iter().map(|_| Work::default()).collect();
        for k in 0..=ORDER {
            for (curved, work) in rates.curved.iter().zip(&mut works) {
                let term = curved.term(k, &terms, work);
                terms[k][curved.place] = term;
                change[curved.place] += if k > 0 { term.high.abs() } else { 0.0 };
            }
            if k == ORDER {
                break;
            }
            // (k + 1) z_{k+1} = h (A z_k + b u_k + c δ_k0)
            let factor = h / Double::from((k + 1) as f64);
            for (place, row) in &rates.rows {
                let term = row.term(k, &terms[k], &input) * factor;
                terms[k + 1][*place] = term;
                change[*place] += term.high.abs();
            }
        }
        let input_change = input.map(|input| input[1..].iter().map(|u| u.high.abs()).sum());
        let parts = rates.curved.iter().map(|curved| curved.part(&terms[0], &change));
        let part = parts.fold(f64::INFINITY, |least, part| if part < 1.0 { least.min(part) } else { least });
        Self { terms, input, part, change, input_change }
    }

    /// The most that each input may be up to s = 1.
    pub fn input_size(&self) -> [f64; DRIVES] {
        std::array::from_fn(|drive| self.input[drive][0].high.abs() + self.input_change[drive])
    }

    /// How far, in parts of h, the terms left out are below rounding.
    pub fn reach(&self, size: &Size) -> f64 {
        let mut reach = self.part;
        let mut look = |size: f64, k: usize, term: Double| {
            let term = term.high.abs();
            if term > 0.0 {
                reach = reach.min((1e-31 * size / term).powf(1.0 / k as f64));
            } else if term.is_nan() {
                reach = f64::NAN;
            }
        };
        for k in [ORDER - 1, ORDER] {
            for (place, size) in size.states.iter().enumerate() {
                if self.change[place] == 0.0 {
                    continue;
                }
                let early: f64 = (0..8).map(|j| self.terms[j][place].high.abs()).fold(0.0, f64::max);
                look(size.max(early), k, self.terms[k][place]);
            }
            for input in &self.input {
                look(input[..8].iter().map(|u| u.high.abs()).fold(0.0, f64::max), k, input[k]);
            }
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
        row.most(&self.change, &self.input_change)
    }

    /// Its series.
    pub fn polynomial(&self, row: &Row) -> Polynomial {
        std::array::from_fn(|k| row.term(k, &self.terms[k], &self.input))
    }
}

/// The largest values that states, curved forces and inputs had so far.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Of each place.
    pub states: [f64; PLACES],
    /// Of the inputs.
    pub input: [f64; DRIVES],
}

/// Rounding of each term of a series.
pub struct Noise {
    states: Box<[[f64; PLACES]; ORDER + 1]>,
    /// Rounding of the states and the inputs themselves.
    terms: Box<[([f64; PLACES], [f64; DRIVES]); ORDER + 1]>,
}

impl Noise {
    /// Of `series` over a time `h`.
    pub fn new(rates: &Rates, series: &Series, h: f64, size: &Size) -> Self {
        let mut states = Box::new([[0.0; PLACES]; ORDER + 1]);
        for (noise, size) in states[0][..STATES].iter_mut().zip(&size.states) {
            *noise = GATHERED * size;
        }
        let mut terms = Box::new(std::array::from_fn(|k| {
            let round = |value: Double| 4.0 * ROUNDING * value.high.abs();
            (series.terms[k].map(round), series.input.map(|input| round(input[k])))
        }));
        // Of a line or a wave where it crosses zero, the moment is what rounding has touched.
        for (noise, size) in terms[0].1.iter_mut().zip(size.input) {
            *noise += GATHERED * size;
        }
        let slopes: Vec<_> = rates.curved.iter().map(|curved| curved.slopes(&series.terms[0])).collect();
        let mut noise = Self { states, terms };
        for k in 0..=ORDER {
            for (curved, (slopes, own)) in rates.curved.iter().zip(&slopes) {
                let of_states = slopes.iter().map(|&(place, slope)| slope * noise.states[k][place]);
                noise.states[k][curved.place] = of_states.sum::<f64>() + if k == 0 { *own } else { 0.0 };
            }
            if k == ORDER {
                break;
            }
            for (place, row) in &rates.rows {
                noise.states[k + 1][*place] = noise.deviation(row, k) * h / (k + 1) as f64;
            }
        }
        noise
    }

    /// Of term k of a form.
    pub fn deviation(&self, row: &Row, k: usize) -> f64 {
        let (terms, input) = &self.terms[k];
        let one = if k == 0 { 4.0 * ROUNDING * row.one.high.abs() } else { 0.0 };
        row.most(&self.states[k], &[0.0; DRIVES]) + row.most(terms, input) + one
    }
}
