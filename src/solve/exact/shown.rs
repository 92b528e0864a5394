//! What an observer is shown of a run: every interval, and closer where something may happen within.

use super::Run;
use crate::plant::State;
use crate::solve::law::{Law, Shown, chain};
use crate::solve::observe::{Curve, Gap, QUANTITIES, Reading};
use std::rc::Rc;

/// What a curve may be off in the middle, as a share of the largest value seen of that quantity.
const OFF: f64 = 1e-9;

/// Curves of a run that are looked at closer at most: what swings more often than that between its rows is not seen whole.
const MOST_CURVES: u64 = 2_000_000;

/// Where an observer is.
pub(super) struct Watching {
    /// What is read now, where nothing has jumped since.
    now: Option<Reading>,
    /// The largest magnitudes seen.
    scale: Reading,
    /// Curves shown, and tried.
    curves: u64,
}

impl Watching {
    pub(super) fn new() -> Self {
        Self { now: None, scale: [0.0; QUANTITIES], curves: 0 }
    }
}

impl<const R: usize, const C: usize> Run<'_, R, C> {
    /// Whether somebody observes.
    pub(super) fn is_observed(&self) -> bool {
        self.recorder.observer.is_some()
    }

    /// Input or mode may have jumped: what is read now has to be read anew.
    pub(super) fn jumped(&mut self) {
        self.watching.now = None;
    }

    /// The run has ended.
    pub(super) fn end_shown(&mut self) {
        let (time, state, mode) = (self.time(), self.state(), self.mode);
        if self.is_observed() {
            let law = Rc::clone(&self.law);
            let shown = law.shown(self.plant);
            self.show(shown, time, 0.0, &self.z.clone(), &[0.0; QUANTITIES]);
        }
        if let Some(observer) = &mut self.recorder.observer {
            observer.end(time, &state, &mode);
        }
    }

    /// How far readings can be off a straight line over intervals of this length, within `whole` from now on.
    pub(super) fn bow(&self, law: &Law<R, C>, interval: f64, whole: f64) -> Reading {
        self.bow_from(law, &self.z, interval, whole)
    }

    fn bow_from(&self, law: &Law<R, C>, z: &[f64; C], interval: f64, whole: f64) -> Reading {
        let shown = law.shown(self.plant);
        law.bow(shown, &law.rate(z), (self.input_rate, self.input_curvature), (interval, whole))
    }

    /// Shows the interval of `length` that began at `begin` and has led to `end`; says whether the observer wants to see closer.
    fn show(&mut self, shown: &Shown, begin: f64, length: f64, end: &[f64; C], bow: &Reading) -> bool {
        let to = shown.readout.read(&self.state_of(end), end[chain::<R>(0)]);
        let from = match self.watching.now {
            Some(from) => from,
            None => shown.readout.read(&self.state(), self.input()),
        };
        self.watching.now = Some(to);
        self.ask(begin, length, &from, &to, bow)
    }

    fn ask(&mut self, begin: f64, length: f64, from: &Reading, to: &Reading, bow: &Reading) -> bool {
        for (scale, to) in self.watching.scale.iter_mut().zip(to) {
            *scale = scale.max(to.abs());
        }
        let gap = Gap { begin, length, from, to, bow, mode: &self.mode };
        self.recorder.observer.as_mut().is_some_and(|observer| observer.pass(&gap))
    }

    /// Moves on to `end`, `length` from now, in the present mode, and shows the way there.
    pub(super) fn move_shown(&mut self, law: &Law<R, C>, begin: f64, length: f64, end: [f64; C], bow: &Reading) {
        let start = self.z;
        if self.show(law.shown(self.plant), begin, length, &end, bow) {
            self.show_closer(law, start, begin, length);
        }
        self.z = end;
    }

    /// Shows a way of any length that begins at `z`, in parts that there are matrices for and a rest that a series tells.
    fn show_closer(&mut self, law: &Law<R, C>, mut z: [f64; C], mut begin: f64, mut length: f64) {
        for level in 0..=law.finest {
            while length >= law.length(level) {
                z = self.show_level(law, z, begin, level);
                begin += law.length(level);
                length -= law.length(level);
            }
        }
        if length > 0.0 {
            let series = law.series(&z, length);
            let end = std::array::from_fn(|j| series.iter().rev().fold(0.0, |sum, term| sum + term[j]));
            let curve = self.curve(law, &z, &end, begin, length);
            self.see(&curve);
        }
    }

    /// Shows an interval of h/2^level from `z` on and returns its end.
    fn show_level(&mut self, law: &Law<R, C>, z: [f64; C], begin: f64, level: usize) -> [f64; C] {
        let (length, shown) = (law.length(level), law.shown(self.plant));
        let mut end = z;
        law.step(level).advance(&mut end);
        let bow = self.bow_from(law, &z, length, length);
        let read = |run: &Self, z: &[f64; C]| shown.readout.read(&run.state_of(z), z[chain::<R>(0)]);
        let (from, to) = (read(self, &z), read(self, &end));
        if !self.ask(begin, length, &from, &to, &bow) {
            return end;
        }
        self.watching.curves += 1;
        let last = level == law.finest || self.watching.curves > MOST_CURVES;
        let curve = self.curve(law, &z, &end, begin, length);
        if last || self.is_true(law, &curve, &z, level) {
            self.see(&curve);
        } else {
            let middle = self.show_level(law, z, begin, level + 1);
            self.show_level(law, middle, begin + 0.5 * length, level + 1);
        }
        end
    }

    /// Whether a curve is right in its middle.
    fn is_true(&self, law: &Law<R, C>, curve: &Curve, z: &[f64; C], level: usize) -> bool {
        let mut middle = *z;
        law.step(level + 1).advance(&mut middle);
        let readout = &law.shown(self.plant).readout;
        let is = readout.read(&self.state_of(&middle), middle[chain::<R>(0)]);
        let near = |((is, told), scale): ((&f64, f64), &f64)| (is - told).abs() <= OFF * scale;
        is.iter().zip(curve.at(0.5)).zip(&self.watching.scale).all(near)
    }

    /// The curve from `start` to `end`.
    fn curve(&self, law: &Law<R, C>, start: &[f64; C], end: &[f64; C], begin: f64, length: f64) -> Curve {
        let readout = &law.shown(self.plant).readout;
        let terms = |z: &[f64; C]| {
            // q, q̇ h, q̈ h²/2, q⃛ h³/6
            let mut terms = [readout.read(&self.state_of(z), z[chain::<R>(0)]); 4];
            let (mut change, mut factor) = (law.rate(z), 1.0);
            for (k, term) in terms.iter_mut().enumerate().skip(1) {
                factor *= length / k as f64;
                let wide = widened(&change);
                *term = readout.change(&self.state_of(&wide), wide[chain::<R>(0)]).map(|value| value * factor);
                change = law.rate_of_rate(&change);
            }
            terms
        };
        Curve::through(begin, length, &terms(start), &terms(end))
    }

    fn see(&mut self, curve: &Curve) {
        if let Some(observer) = &mut self.recorder.observer {
            observer.see(curve);
        }
    }

    /// The state that `z` stands for.
    fn state_of(&self, z: &[f64; C]) -> State {
        super::state_of::<R, C>(self.plant, z)
    }
}

/// `y` with zeros where the constants stand.
fn widened<const R: usize, const C: usize>(y: &[f64; R]) -> [f64; C] {
    let mut wide = [0.0; C];
    wide[..R].copy_from_slice(y);
    wide
}
