//! The step that was solved: its end, its series, and guards along it.

use super::field::Field;
use super::linear::{EIGHTHS, Full, STATES, Set, States};
use super::model::Vector;
use super::radau::{POINTS, TERMS, monomials};
use super::sources::Source;
use super::step::{Begin, Step, StepBuffers, at_nodes, states};

impl StepBuffers {
    /// The numbers that a step depends on, by their columns; how many they are without forces.
    #[inline(always)]
    pub(super) fn fill(&mut self, field: &Field, begin: &Begin) -> usize {
        let (size, inputs) = (field.linear.size, field.linear.inputs);
        self.x[..size].copy_from_slice(&begin.y[..size]);
        self.x[size] = 1.0;
        for (drive, powers) in begin.input[..inputs].iter().enumerate() {
            let place = size + 1 + drive * (begin.degree + 1);
            self.x[place..=place + begin.degree].copy_from_slice(&powers[..=begin.degree]);
        }
        size + 1 + inputs * (begin.degree + 1)
    }

    /// Known forces, and those of the first `sources` laws, by powers of the share of the step; how many powers.
    pub(super) fn forcing(&mut self, field: &Field, begin: &Begin, sources: usize) -> usize {
        let (linear, size) = (&field.linear, field.linear.size);
        let powers = (begin.degree + 1).max(if sources > 0 { POINTS } else { 1 });
        let forcing = &mut self.forcing[..powers];
        forcing.iter_mut().for_each(|power| power[..size].fill(0.0));
        forcing[0][..size].copy_from_slice(&linear.constant[..size]);
        let mut add = |power: usize, column: &States, factor: f64| {
            if factor != 0.0 {
                forcing[power][..size].iter_mut().zip(column).for_each(|(sum, value)| *sum += factor * value);
            }
        };
        for (column, powers) in linear.input[..linear.inputs].iter().zip(begin.input) {
            powers[..=begin.degree].iter().enumerate().for_each(|(power, value)| add(power, column, *value));
        }
        for (column, force) in linear.source[..sources].iter().zip(&self.forces) {
            if *force != [0.0; POINTS] {
                monomials(force).into_iter().enumerate().for_each(|(power, value)| add(power, column, value));
            }
        }
        powers
    }

    /// The whole state after `eighth` eighths of the step that was solved by its columns.
    pub(super) fn at_eighth(&self, field: &Field, set: &Set, begin: &Begin, eighth: usize) -> Vector {
        let full = set.full(&field.linear);
        let x = &self.x[..full.end.len()];
        let states = full.at_eighth(&field.linear, (set.h, set.degree), eighth, x);
        self.with_bristles(field, begin.y, &states, eighth as f64 / EIGHTHS as f64)
    }

    /// The series of the states over the step that was solved.
    pub(super) fn expand(&mut self, field: &Field, h: f64, begin: &Begin) {
        let powers = self.forcing(field, begin, field.sources.len());
        field.linear.series(&states(begin.y), h, &self.forcing[..powers], &mut self.series);
    }

    /// Takes the state to the end of the step that was solved; without its columns, by its series.
    #[inline(always)]
    pub(super) fn go_to_end(&mut self, step: &Step) {
        let &Step { field, set, begin, whole, .. } = step;
        let linear = &field.linear;
        let mut end = states(begin.y);
        match whole {
            true => {
                let full = set.full(linear);
                let known = full.known;
                for (source, force) in self.forces[..field.sources.len()].iter().enumerate() {
                    self.x[known + source * POINTS..][..POINTS].copy_from_slice(force);
                }
                let x = &self.x[..full.end.len()];
                match linear.size {
                    8 => full.advance::<8>(&mut end, x),
                    12 => full.advance::<12>(&mut end, x),
                    _ => full.advance::<STATES>(&mut end, x),
                }
            }
            false => {
                self.expand(field, set.h, begin);
                end = self.series.at(linear.size, 1.0);
            }
        }
        self.end = self.with_bristles(field, begin.y, &end, 1.0);
    }

    /// A whole state at the share `s` of the step.
    pub(super) fn with_bristles(&self, field: &Field, begin: &Vector, states: &States, s: f64) -> Vector {
        let mut y = *begin;
        let count = field.model.layout.states;
        y[..count].copy_from_slice(&states[..count]);
        for source in &field.sources {
            let Source::Friction { curved, .. } = source else { continue };
            let curved = &field.model.curved[*curved];
            if let Some(place) = curved.bristle {
                let [a, b, c, d] = self.bristles[curved.body].bent;
                y[place] = match s {
                    1.0 => d,
                    s => monomials(&[begin[place], a, b, c, d]).iter().rev().fold(0.0, |sum, power| sum * s + power),
                };
            }
        }
        y
    }

    /// Tells the outputs of all guards at the points of the step that was solved by its columns.
    pub(super) fn tell_guards(&mut self, field: &Field, set: &Set, begin: &Begin) {
        let full = set.full(&field.linear);
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.tell_guards_by_avx2(field, full, begin) };
        }
        self.tell_guards_by_any(field, full, begin);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn tell_guards_by_avx2(&mut self, field: &Field, full: &Full, begin: &Begin) {
        self.tell_guards_by_any(field, full, begin);
    }

    #[inline(always)]
    fn tell_guards_by_any(&mut self, field: &Field, full: &Full, begin: &Begin) {
        let x = &self.x[..full.end.len()];
        for (index, &output) in field.output.iter().enumerate() {
            let lane = match output.checked_sub(field.linear.arguments) {
                None => self.arguments[output],
                Some(guard) => full.guard(guard, x),
            };
            self.told[index] = [self.output_at_begin(field, begin, output), lane[0], lane[1], lane[2], lane[3]];
        }
    }

    #[inline(always)]
    fn output_at_begin(&self, field: &Field, begin: &Begin, output: usize) -> f64 {
        let output = &field.linear.outputs[output];
        let size = field.linear.size;
        let on_state = output.row[..size].iter().zip(begin.y).fold(0.0, |sum, (weight, y)| sum + weight * y);
        let on_input = output.input.iter().zip(begin.input).fold(0.0, |sum, (weight, powers)| sum + weight * powers[0]);
        let forces = output.source.iter().zip(&self.forces);
        forces.fold(on_state + on_input + output.constant, |sum, (weight, force)| sum + weight * force[0])
    }

    /// A guard's output along the series of the step, by powers of its share.
    pub(super) fn guard_along(&self, field: &Field, begin: &Begin, index: usize, c: &mut [f64; TERMS]) {
        let output = &field.linear.outputs[field.output[index]];
        self.series.along(field.linear.size, &output.row, c);
        for (weight, powers) in output.input.iter().zip(begin.input).filter(|(weight, _)| **weight != 0.0) {
            c.iter_mut().zip(powers).for_each(|(c, power)| *c += weight * power);
        }
        for (weight, force) in output.source.iter().zip(&self.forces).filter(|(weight, _)| **weight != 0.0) {
            c.iter_mut().zip(monomials(force)).for_each(|(c, power)| *c += weight * power);
        }
        c[0] += output.constant;
    }

    /// Values at all points of the step.
    pub(super) fn at_points(c: &[f64; TERMS], order: usize) -> [f64; POINTS] {
        let lane = at_nodes(c, order);
        [c[0], lane[0], lane[1], lane[2], lane[3]]
    }
}
