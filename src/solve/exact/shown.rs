//! The view of an observer on a run: every interval, and closer where something may happen within.

use super::matrices::Shown;
use super::{ModeMatrices, Run};
use crate::mechanism::Cause;
use crate::solve::observe::{Curve, Gap, Observe, QUANTITIES, Reading};
use std::sync::Arc;

/// The error of a curve that is allowed in the middle, as a share of the largest value seen of that quantity.
const OFF: f64 = 1e-9;

/// Curves of a run that are looked at closer at most: what swings more often than that between its rows is not seen
/// whole.
const MOST_CURVES: u64 = 2_000_000;

/// Room for what a cubic is off where it only tells whether to look closer.
const MARGIN: f64 = 1.05;

/// Lengths that differ by less than this share are one.
const SAME: f64 = 1e-10;

/// Curves in a row that are right before longer ones are tried.
const RIGHT: u32 = 32;

/// Gaps that are put off at most.
const LATER: usize = 256;

/// An instant as an observer sees it; rates, and the terms of curves that begin or end there, are made ready when they
/// are first wanted.
struct Sight<const N: usize> {
    z: [f64; N],
    value: Reading,
    slope: Option<([f64; N], Reading)>,
    /// q̈ and q⃛
    terms: Option<[Reading; 2]>,
}

/// A gap that an observer wants to see closer and need not see at once.
struct Later<const N: usize> {
    law: Arc<ModeMatrices<N>>,
    /// The state at its beginning.
    z: [f64; N],
    begin: f64,
    length: f64,
    from: Reading,
    to: Reading,
    bow: Reading,
}

/// Where an observer is.
pub(super) struct Watching<const N: usize> {
    /// Whether there is an observer who follows the motion.
    follows: bool,
    /// The present reading, where nothing has jumped since.
    now: Option<Reading>,
    /// Gaps to be looked at closer.
    later: Vec<Later<N>>,
    /// The largest magnitudes seen.
    scale: Reading,
    /// Curves tried.
    curves: u64,
    /// Halvings of the output interval after which curves were right lately, and how many in a row.
    level: usize,
    right: u32,
}

impl<const N: usize> Watching<N> {
    pub(super) fn new(observer: Option<&dyn Observe>) -> Self {
        let follows = observer.is_some_and(|observer| observer.follows());
        Self { follows, now: None, later: Vec::new(), scale: [0.0; QUANTITIES], curves: 0, level: 0, right: 0 }
    }
}

impl<const N: usize> Run<'_, N> {
    /// Whether somebody follows the motion.
    pub(super) fn is_observed(&self) -> bool {
        self.watching.follows
    }

    /// Input or mode may have jumped: what is read now has to be read anew.
    pub(super) fn jumped(&mut self) {
        self.watching.now = None;
    }

    /// The run has ended.
    pub(super) fn end_shown(&mut self) {
        self.show_later();
        let (time, state, mode) = (self.core.time(), self.core.state(), self.core.common.mode);
        if self.is_observed() {
            let law = Arc::clone(&self.core.matrices);
            self.show(&law, (time, 0.0), &self.core.z.clone(), &[0.0; QUANTITIES]);
        }
        if let Some(observer) = &mut self.recorder.observer {
            observer.end(time, &state, &mode);
        }
    }

    /// How far readings can be off a straight line over intervals of this length, within `whole` from now on.
    pub(super) fn bow(&self, law: &ModeMatrices<N>, interval: f64, whole: f64) -> Reading {
        self.bow_from(law, &self.core.z, interval, whole)
    }

    fn bow_from(&self, law: &ModeMatrices<N>, z: &[f64; N], interval: f64, whole: f64) -> Reading {
        let shown = law.shown(&self.core.common.mechanism, &self.core.common.space);
        law.bow(
            shown,
            &law.rate(z),
            (&self.core.common.input_rate, &self.core.common.input_curvature),
            (interval, whole),
        )
    }

    /// Shows the interval of `length` that began at `begin` and has led to `end`; the readings at its ends where the
    /// observer wants to see closer.
    fn show(
        &mut self,
        law: &ModeMatrices<N>,
        (begin, length): (f64, f64),
        end: &[f64; N],
        bow: &Reading,
    ) -> Option<(Reading, Reading)> {
        let shown = law.shown(&self.core.common.mechanism, &self.core.common.space);
        let to = self.read(shown, end);
        let from = match self.watching.now {
            Some(from) => from,
            None => self.read(shown, &self.core.z),
        };
        self.watching.now = Some(to);
        self.ask(law, (begin, length), &from, &to, bow).then_some((from, to))
    }

    fn ask(
        &mut self,
        law: &ModeMatrices<N>,
        (begin, length): (f64, f64),
        from: &Reading,
        to: &Reading,
        bow: &Reading,
    ) -> bool {
        for (scale, to) in self.watching.scale.iter_mut().zip(to) {
            *scale = if to.abs() > *scale { to.abs() } else { *scale };
        }
        let gap = Gap { begin, length, from, to, bow, mode: &law.mode };
        self.recorder.observer.as_mut().is_some_and(|observer| observer.pass(&gap))
    }

    /// Moves on to `end`, `length` from now, in the present mode, and shows the way there; says whether the observer
    /// wants to see closer.
    pub(super) fn move_shown(
        &mut self,
        law: &Arc<ModeMatrices<N>>,
        begin: f64,
        length: f64,
        end: [f64; N],
        bow: &Reading,
    ) -> bool {
        let shown = self.show(law, (begin, length), &end, bow);
        let z = std::mem::replace(&mut self.core.z, end);
        let Some((from, to)) = shown else { return false };
        if self.can_wait() {
            if self.watching.later.len() == LATER {
                self.show_later();
            }
            let (law, bow) = (Arc::clone(law), *bow);
            if self.watching.later.capacity() == 0 {
                self.watching.later.reserve_exact(LATER);
            }
            self.watching.later.push(Later { law, z, begin, length, from, to, bow });
        } else {
            self.show_closer(law, z, (begin, length), false);
        }
        true
    }

    fn can_wait(&self) -> bool {
        self.recorder.observer.as_ref().is_some_and(|observer| observer.can_wait())
    }

    /// Shows what was put off, as far as the observer still wants to see it: first where a quantity was largest, for
    /// what is below a peak that was found there need not be seen.
    fn show_later(&mut self) {
        let mut later = std::mem::take(&mut self.watching.later);
        let largest = self.watching.scale;
        let has_largest = |from: &Reading, to: &Reading| {
            let ends = from.iter().zip(to).zip(&largest);
            ends.into_iter().any(|((from, to), largest)| from != to && f64::max(from.abs(), to.abs()) == *largest)
        };
        for first in [true, false] {
            for Later { law, z, begin, length, from, to, bow } in &later {
                if has_largest(from, to) == first && self.ask(law, (*begin, *length), from, to, bow) {
                    // No shape is known yet of what was put off: it is shown whole.
                    self.show_closer(law, *z, (*begin, *length), true);
                }
            }
        }
        later.clear();
        self.watching.later = later;
    }

    /// Shows a way of any length that begins at `z`, in parts that there are matrices for and a rest that a series
    /// tells; `whole` says that no part is left out because a cubic has nothing to see there.
    fn show_closer(
        &mut self,
        law: &ModeMatrices<N>,
        mut z: [f64; N],
        (mut begin, mut length): (f64, f64),
        whole: bool,
    ) {
        for level in 0..=law.finest {
            // What a sum of times is off by makes no difference here.
            while length >= law.length(level) * (1.0 - SAME) {
                z = self.show_level(law, z, begin, (level, whole));
                begin += law.length(level);
                length -= law.length(level);
            }
        }
        if length > SAME * law.reach() {
            let mut end = z;
            let series = &mut self.core.room.series;
            law.series(&z, length, series);
            series.add_to(&mut end, 1.0);
            let curve = self.curve(law, &mut self.sight(law, &z), &mut self.sight(law, &end), begin, length);
            self.see(&curve);
        }
    }

    /// Shows an interval of h/2^level from `z` on in parts so short that cubics tell where there is something to see;
    /// returns its end.
    fn show_level(
        &mut self,
        law: &ModeMatrices<N>,
        z: [f64; N],
        begin: f64,
        (level, whole): (usize, bool),
    ) -> [f64; N] {
        let fine = self.watching.level.saturating_sub(1).clamp(level, law.finest);
        let (parts, length) = (1_u64 << (fine - level).min(60), law.length(fine));
        let mut from = self.sight(law, &z);
        for part in 0..parts {
            let mut end = from.z;
            law.step(fine).advance(&mut end);
            let mut to = self.sight(law, &end);
            let begin = begin + part as f64 * length;
            if whole || self.asks(law, &mut from, &mut to, begin, length) {
                self.show_curve(law, &mut from, &mut to, begin, (fine, whole));
            }
            from = to;
        }
        from.z
    }

    /// Whether the observer wants to see closer what a cubic tells of a way: with slopes a and b at its ends and d
    /// between, it is off a straight line by s (1 − s) ((a − d)(1 − s) − (b − d) s).
    fn asks(&mut self, law: &ModeMatrices<N>, from: &mut Sight<N>, to: &mut Sight<N>, begin: f64, length: f64) -> bool {
        let (from_slope, to_slope) = (self.slope(law, from), self.slope(law, to));
        let bow: Reading = std::array::from_fn(|q| {
            let across = to.value[q] - from.value[q];
            let (a, b) = ((from_slope[q] * length - across).abs(), (to_slope[q] * length - across).abs());
            0.25 * MARGIN * if a > b { a } else { b }
        });
        self.ask(law, (begin, length), &from.value, &to.value, &bow)
    }

    /// Shows an interval of h/2^level as a curve, or two halves of it where that is not right.
    fn show_curve(
        &mut self,
        law: &ModeMatrices<N>,
        from: &mut Sight<N>,
        to: &mut Sight<N>,
        begin: f64,
        (level, whole): (usize, bool),
    ) {
        self.watching.curves += 1;
        let length = law.length(level);
        let curve = self.curve(law, from, to, begin, length);
        if level == law.finest || self.watching.curves > MOST_CURVES {
            self.see(&curve);
            return;
        }
        let mut middle = from.z;
        law.step(level + 1).advance(&mut middle);
        let mut middle = self.sight(law, &middle);
        let near = |((is, told), scale): ((&f64, f64), &f64)| (is - told).abs() <= OFF * scale;
        if middle.value.iter().zip(curve.at(0.5)).zip(&self.watching.scale).all(near) {
            // What has been right for a while may be right over a longer way.
            self.watching.right += 1;
            if self.watching.right >= RIGHT {
                (self.watching.right, self.watching.level) = (0, level.saturating_sub(1));
            }
            self.see(&curve);
            return;
        }
        (self.watching.right, self.watching.level) = (0, self.watching.level.max(level + 1));
        let half = 0.5 * length;
        if whole || self.asks(law, from, &mut middle, begin, half) {
            self.show_curve(law, from, &mut middle, begin, (level + 1, whole));
        }
        if whole || self.asks(law, &mut middle, to, begin + half, half) {
            self.show_curve(law, &mut middle, to, begin + half, (level + 1, whole));
        }
    }

    /// The sight of `z`.
    fn sight(&self, law: &ModeMatrices<N>, z: &[f64; N]) -> Sight<N> {
        let value = self.read(law.shown(&self.core.common.mechanism, &self.core.common.space), z);
        Sight { z: *z, value, slope: None, terms: None }
    }

    /// The rates of what is read.
    fn slope(&self, law: &ModeMatrices<N>, sight: &mut Sight<N>) -> Reading {
        let fresh = || {
            let rate = law.rate(&sight.z);
            (rate, self.rates(law, &rate))
        };
        sight.slope.get_or_insert_with(fresh).1
    }

    /// Rates of what is read, `rate` being that of z.
    fn rates(&self, law: &ModeMatrices<N>, rate: &[f64; N]) -> Reading {
        law.shown(&self.core.common.mechanism, &self.core.common.space).change(rate)
    }

    /// A reading and its first three derivatives, each times h to its order and over its factorial: q, q̇ h, q̈ h²/2,
    /// q⃛ h³/6.
    fn terms(&self, law: &ModeMatrices<N>, sight: &mut Sight<N>, length: f64) -> [Reading; 4] {
        let slope = self.slope(law, sight);
        let higher = || {
            let rate = sight.slope.map_or_else(|| law.rate(&sight.z), |(rate, _)| rate);
            let second = law.rate(&rate);
            [self.rates(law, &second), self.rates(law, &law.rate(&second))]
        };
        let [second, third] = *sight.terms.get_or_insert_with(higher);
        let [h1, h2, h3] = [length, length * length / 2.0, length * length * length / 6.0];
        [sight.value, slope.map(|v| v * h1), second.map(|v| v * h2), third.map(|v| v * h3)]
    }

    /// The curve between two sights.
    fn curve(&self, law: &ModeMatrices<N>, from: &mut Sight<N>, to: &mut Sight<N>, begin: f64, length: f64) -> Curve {
        Curve::through(begin, length, &self.terms(law, from, length), &self.terms(law, to, length))
    }

    fn see(&mut self, curve: &Curve) {
        if let Some(observer) = &mut self.recorder.observer {
            observer.see(curve);
        }
    }

    /// The readings in `z`.
    fn read(&self, shown: &Shown<N>, z: &[f64; N]) -> Reading {
        shown.read(z, self.core.common.coordinates.origin())
    }

    /// The same as [`Core::advance`], and shows the way to whoever observes.
    pub(super) fn advance_shown(&mut self, distance: f64, looked: bool) -> Option<Cause> {
        if !self.is_observed() {
            return self.core.advance(distance, looked);
        }
        let core = &mut self.core;
        let (law, before, begin, offset) = (Arc::clone(&core.matrices), core.z, core.time(), core.common.offset);
        let cause = core.advance(distance, looked);
        let (after, length) = (core.z, core.common.offset - offset);
        core.z = before;
        let bow = self.bow(&law, length, length);
        self.move_shown(&law, begin, length, after, &bow);
        cause
    }
}
