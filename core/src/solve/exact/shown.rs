//! Observation of a run: every interval, and more closely if a peak may lie within.

use super::matrices::Shown;
use super::{ExactRun, ModeMatrices};
use crate::mechanism::{BODIES, Transition};
use crate::solve::observe::{Closer, Curve, FEW, Gap, Gaps, Observe, QUANTITIES, Reading, Stretch, reading_of};
use std::sync::Arc;

/// Allowed error of a curve in the middle, relative to the largest value of that quantity so far.
const OFF: f64 = 1e-9;

/// Largest number of curves of a run; faster oscillations between rows are not resolved completely.
const MOST_CURVES: u64 = 2_000_000;

/// Largest number of rows of a block: an observer has one bit for each interval, and oscillations decay within a block.
pub(super) const ROWS: usize = 32;

/// Maximum number of postponed blocks.
const LATER: usize = 256;

/// Relative difference of equal lengths.
const SAME: f64 = 1e-10;

/// Number of successive accurate curves before longer ones are tried.
const RIGHT: u32 = 32;

/// An instant for an observer; rates are computed when first needed.
#[derive(Clone, Copy)]
struct Sight<const N: usize> {
    z: [f64; N],
    value: Reading,
    /// ż, and its reading.
    slope: Option<([f64; N], Reading)>,
    /// z̈ and z⃛.
    higher: Option<[[f64; N]; 2]>,
}

impl<const N: usize> Sight<N> {
    fn new(z: [f64; N], value: Reading) -> Self {
        Self { z, value, slope: None, higher: None }
    }
}

/// A part of a run: h/2^level from `begin` on.
#[derive(Clone, Copy)]
struct Part {
    begin: f64,
    length: f64,
    level: usize,
}

/// A block in which an observer examines some intervals more closely.
struct Later<const N: usize> {
    law: Arc<ModeMatrices<N>>,
    /// The states at both ends of its first interval, the readings there, and the origin of positions.
    z: [[f64; N]; 2],
    ends: [Reading; 2],
    origin: [f64; BODIES],
    begin: f64,
    interval: f64,
    wanted: Gaps,
}

/// State of the observation of a run.
pub(super) struct Watching<const N: usize> {
    /// True if there is an observer of the motion; and true if it examines all of it closely.
    follows: bool,
    sees_all: bool,
    /// Readings at the start of a block and at its rows; the last one is the present.
    readings: Vec<Reading>,
    /// True if nothing has jumped since the present was read.
    is_read: bool,
    /// Coordinates of the origin.
    origin: [f64; BODIES],
    later: Vec<Later<N>>,
    /// The largest magnitudes so far.
    scale: Reading,
    /// Curves tried.
    curves: u64,
    /// Halvings of the output interval for recent accurate curves, and the number of these in a row.
    level: usize,
    right: u32,
}

impl<const N: usize> Watching<N> {
    pub(super) fn new(observer: Option<&dyn Observe>) -> Self {
        let follows = observer.is_some_and(|observer| observer.follows());
        let sees_all = observer.is_some_and(|observer| observer.sees_all());
        Self {
            follows,
            sees_all,
            readings: Vec::with_capacity(if follows { ROWS + 1 } else { 0 }),
            is_read: false,
            origin: [0.0; BODIES],
            later: Vec::with_capacity(if follows && !sees_all { LATER / 4 } else { 0 }),
            scale: [0.0; QUANTITIES],
            curves: 0,
            level: 0,
            right: 0,
        }
    }

    /// Reads a block that begins in `z` with these rows.
    pub(super) fn read(&mut self, shown: &Shown<N>, origin: &[f64; BODIES], z: &[f64; N], rows: &[[f64; N]]) {
        self.origin = *origin;
        let first = match self.readings.last() {
            Some(last) if self.is_read => *last,
            _ => shown.read(z, origin),
        };
        self.readings.clear();
        self.readings.push(first);
        shown.read_rows(rows, origin, &mut self.readings);
        self.is_read = true;
    }
}

impl<const N: usize> ExactRun<'_, N> {
    /// True if an observer follows the motion.
    pub(super) fn is_observed(&self) -> bool {
        self.watching.follows
    }

    /// Input or mode may have jumped: the present has to be read again.
    pub(super) fn jumped(&mut self) {
        self.watching.is_read = false;
    }

    /// The run has ended.
    pub(super) fn end_shown(&mut self) {
        if self.is_observed() {
            let law = Arc::clone(&self.core.matrices);
            self.show_way(&law, self.core.z, &[], (self.core.time(), 0.0));
            self.show_later();
        }
        let (time, state, mode) = (self.core.time(), self.core.state(), self.core.common.rules.mode);
        if let Some(observer) = &mut self.recorder.observer {
            observer.end(time, &state, &mode);
        }
    }

    /// Shows a block of the run in the present mode that began in `z`, with these rows.
    pub(super) fn show_way(
        &mut self,
        law: &Arc<ModeMatrices<N>>,
        z: [f64; N],
        rows: &[[f64; N]],
        (begin, interval): (f64, f64),
    ) {
        let common = &self.core.common;
        let shown = law.shown(&common.mechanism, &common.space);
        self.watching.read(shown, common.coordinates.origin(), &z, rows);
        self.show_stretch(law, [z, rows.first().copied().unwrap_or(z)], (begin, interval));
    }

    /// Shows the block that has just been read, whose first interval has these ends.
    pub(super) fn show_stretch(&mut self, law: &Arc<ModeMatrices<N>>, z: [[f64; N]; 2], (begin, interval): (f64, f64)) {
        let readings = std::mem::take(&mut self.watching.readings);
        let bow = self.bow(law, &z[0], interval, interval * (readings.len() - 1) as f64);
        let few = self.is_few(law);
        let stretch = Stretch::new((begin, interval), &readings, &bow, &law.mode, few);
        for (scale, most) in self.watching.scale.iter_mut().zip(&stretch.most) {
            *scale = if *most > *scale { *most } else { *scale };
        }
        let closer = self.recorder.observer.as_mut().map_or(Closer::Later(Gaps::NONE), |o| o.stretch(&stretch));
        let (is_now, wanted) = match closer {
            Closer::Now => (true, Gaps::first(readings.len() - 1)),
            Closer::Later(gaps) => (false, gaps),
        };
        if wanted != Gaps::NONE {
            let (law, origin, ends) = (Arc::clone(law), self.watching.origin, [readings[0], readings[1]]);
            let later = Later { law, z, ends, origin, begin, interval, wanted };
            match is_now {
                true => self.show_gaps(&later),
                false => self.watching.later.push(later),
            }
        }
        self.watching.readings = readings;
        if self.watching.later.len() == LATER {
            self.show_later();
        }
    }

    /// Shows intervals of a block more closely, if the observer still needs them.
    fn show_gaps(&mut self, later: &Later<N>) {
        let Later { law, begin, interval, wanted, .. } = later;
        let count = wanted.end();
        let bends = self.bends(law, &later.z[0], *interval * count as f64);
        let (mut first, mut second) = (Sight::new(later.z[0], later.ends[0]), Sight::new(later.z[1], later.ends[1]));
        let (mut from, mut to) = (&mut first, &mut second);
        for gap in 0..count {
            if gap > 0 {
                std::mem::swap(&mut from, &mut to);
                (to.z, to.slope, to.higher) = (from.z, None, None);
                law.step(0).advance(&mut to.z);
                if wanted.has(gap) || wanted.has(gap + 1) {
                    to.value = self.reading(law, &to.z);
                }
            }
            if wanted.has(gap) {
                let ends = (begin + gap as f64 * interval, *interval);
                let bow = self.bow_between(law, [from, to], *interval, &bends);
                if self.ask(law, ends, [&from.value, &to.value], &bow) {
                    self.show_closer(law, from, to, ends, &bends);
                }
            }
        }
    }

    /// Shows postponed blocks.
    fn show_later(&mut self) {
        let mut all = std::mem::take(&mut self.watching.later);
        let here = self.watching.origin;
        for later in all.drain(..) {
            self.watching.origin = later.origin;
            self.show_gaps(&later);
        }
        self.watching.origin = here;
        self.watching.later = all;
    }

    /// Largest deviation of readings from a straight line over intervals of this length, within `whole` from `z` on.
    fn bow(&self, law: &ModeMatrices<N>, z: &[f64; N], interval: f64, whole: f64) -> Reading {
        if self.watching.sees_all {
            return [f64::INFINITY; QUANTITIES];
        }
        let common = &self.core.common;
        let rates = (&common.input_rate, &common.input_curvature);
        law.bow(law.shown(&common.mechanism, &common.space), &law.rate(z), rates, (interval, whole))
    }

    /// Asks the observer if it needs more points within an interval.
    fn ask(
        &mut self,
        law: &ModeMatrices<N>,
        (begin, length): (f64, f64),
        [from, to]: [&Reading; 2],
        bow: &Reading,
    ) -> bool {
        let gap = Gap { begin, length, from, to, bow, mode: &law.mode, few: self.is_few(law) };
        self.recorder.observer.as_mut().is_some_and(|observer| observer.pass(&gap))
    }

    /// Shows an interval of any length more closely: as a whole if its length has matrices, otherwise in parts with
    /// matrices and the rest by a series.
    fn show_closer(
        &mut self,
        law: &ModeMatrices<N>,
        from: &mut Sight<N>,
        to: &mut Sight<N>,
        (mut begin, mut length): (f64, f64),
        bends: &Reading,
    ) {
        // Rounding of a sum of times does not matter here.
        let reaches = |length: f64, part: f64| length >= part * (1.0 - SAME);
        if reaches(length, law.length(0)) && reaches(law.length(0), length) {
            return self.show_part(law, from, to, Part { begin, length, level: 0 }, bends);
        }
        let mut from = *from;
        for level in 0..=law.finest {
            let part = law.length(level);
            while reaches(length, part) {
                let mut to = self.after(law, &from, level);
                self.show_asked(law, &mut from, &mut to, Part { begin, length: part, level }, bends);
                begin += part;
                length -= part;
                from = to;
            }
        }
        if length > SAME * law.reach() {
            let curve = self.curve(law, &mut from, to, begin, length);
            self.see(&curve);
        }
    }

    /// The instant h/2^level later.
    fn after(&self, law: &ModeMatrices<N>, from: &Sight<N>, level: usize) -> Sight<N> {
        let mut z = from.z;
        law.step(level).advance(&mut z);
        self.sight(law, z)
    }

    fn sight(&self, law: &ModeMatrices<N>, z: [f64; N]) -> Sight<N> {
        Sight::new(z, self.reading(law, &z))
    }

    fn reading(&self, law: &ModeMatrices<N>, z: &[f64; N]) -> Reading {
        law.shown(&self.core.common.mechanism, &self.core.common.space).read(z, &self.watching.origin)
    }

    /// Shows a part if the observer examines its cubic more closely.
    fn show_asked(
        &mut self,
        law: &ModeMatrices<N>,
        from: &mut Sight<N>,
        to: &mut Sight<N>,
        part: Part,
        bends: &Reading,
    ) {
        if !self.watching.sees_all {
            let bow = self.bow_between(law, [from, to], part.length, bends);
            if !self.ask(law, (part.begin, part.length), [&from.value, &to.value], &bow) {
                return;
            }
        }
        self.show_part(law, from, to, part, bends);
    }

    /// Shows a part as a curve, or as two halves if the curve is not accurate.
    fn show_part(
        &mut self,
        law: &ModeMatrices<N>,
        from: &mut Sight<N>,
        to: &mut Sight<N>,
        part: Part,
        bends: &Reading,
    ) {
        let Part { begin, length, level } = part;
        if level == law.finest || self.watching.curves >= MOST_CURVES {
            let curve = self.curve_of_level(law, from, to, part);
            return self.see(&curve);
        }
        let mut middle = self.after(law, from, level + 1);
        // After recent inaccurate curves, none longer than two of the accurate ones is tried.
        if level + 1 >= self.watching.level {
            self.watching.curves += 1;
            let curve = self.curve_of_level(law, from, to, part);
            let near = |((is, told), scale): ((&f64, f64), &f64)| (is - told).abs() <= OFF * scale;
            if middle.value.iter().zip(curve.at(0.5)).zip(&self.watching.scale).all(near) {
                // After a number of accurate curves, a longer one is tried.
                self.watching.right += 1;
                if self.watching.right >= RIGHT {
                    (self.watching.right, self.watching.level) = (0, level.saturating_sub(1));
                }
                return self.see(&curve);
            }
            (self.watching.right, self.watching.level) = (0, self.watching.level.max(level + 1));
        }
        let half = |begin| Part { begin, length: 0.5 * length, level: level + 1 };
        self.show_asked(law, from, &mut middle, half(begin), bends);
        self.show_asked(law, &mut middle, to, half(begin + 0.5 * length), bends);
    }

    /// Largest deviation of readings from the straight line between two instants, with a bound `bends` of |q⁗|. With
    /// slopes a and b at its ends and d between, a cubic deviates from a straight line by s (1 − s) ((a − d)(1 − s) −
    /// (b − d) s), and the reading from the cubic by at most s² (1 − s)² |q⁗| h⁴/24: together by at most 4 s (1 − s)
    /// times max(|a − d|, |b − d|)/4 + |q⁗| h⁴/384.
    fn bow_between(
        &self,
        law: &ModeMatrices<N>,
        [from, to]: [&mut Sight<N>; 2],
        length: f64,
        bends: &Reading,
    ) -> Reading {
        if self.watching.sees_all {
            return [f64::INFINITY; QUANTITIES];
        }
        let (from_value, to_value) = (from.value, to.value);
        let ((_, from_slope), (_, to_slope)) = (self.rate(law, from), self.rate(law, to));
        let square = length * length;
        reading_of(self.is_few(law), |q| {
            let across = to_value[q] - from_value[q];
            let (a, b) = ((from_slope[q] * length - across).abs(), (to_slope[q] * length - across).abs());
            0.25 * if a > b { a } else { b } + bends[q] * (square * square / 384.0)
        })
    }

    /// Bounds of the fourth derivatives of the readings within `length` from a state on.
    fn bends(&self, law: &ModeMatrices<N>, z: &[f64; N], length: f64) -> Reading {
        if self.watching.sees_all {
            return [f64::INFINITY; QUANTITIES];
        }
        let space = &self.core.common.space;
        let input = |order| space.input_bounds(z, order, length);
        let third = law.rate(&law.rate(&law.rate(z)));
        law.change_of(law.shown(&self.core.common.mechanism, space), &third, (&input(3), &input(4)), length)
    }

    /// True if only the first quantities are read.
    fn is_few(&self, law: &ModeMatrices<N>) -> bool {
        law.shown(&self.core.common.mechanism, &self.core.common.space).readout.few
    }

    /// ż, and its reading.
    fn rate<'s>(&self, law: &ModeMatrices<N>, sight: &'s mut Sight<N>) -> &'s ([f64; N], Reading) {
        sight.slope.get_or_insert_with(|| {
            let rate = law.rate(&sight.z);
            (rate, self.rates(law, &rate))
        })
    }

    /// z̈ and z⃛.
    fn higher<'s>(&self, law: &ModeMatrices<N>, sight: &'s mut Sight<N>) -> &'s [[f64; N]; 2] {
        let rate = self.rate(law, sight).0;
        sight.higher.get_or_insert_with(|| {
            let second = law.rate(&rate);
            [second, law.rate(&second)]
        })
    }

    /// Rates of the readings; `rate` is that of z.
    fn rates(&self, law: &ModeMatrices<N>, rate: &[f64; N]) -> Reading {
        law.shown(&self.core.common.mechanism, &self.core.common.space).change(rate)
    }

    /// A reading and its first three derivatives, each times h to its order and over its factorial: q, q̇ h, q̈ h²/2,
    /// q⃛ h³/6.
    fn terms(&self, law: &ModeMatrices<N>, sight: &mut Sight<N>, length: f64, terms: &mut [Reading; 4]) {
        let few = self.is_few(law);
        let [value, first, second, third] = terms;
        *value = sight.value;
        let times = |term: &mut Reading, by: f64| {
            let all = if few { FEW } else { QUANTITIES };
            term[..all].iter_mut().for_each(|term| *term *= by);
        };
        *first = self.rate(law, sight).1;
        let higher = self.higher(law, sight);
        *second = self.rates(law, &higher[0]);
        *third = self.rates(law, &higher[1]);
        times(first, length);
        times(second, length * length / 2.0);
        times(third, length * length * length / 6.0);
    }

    /// The curve between two instants.
    fn curve(&self, law: &ModeMatrices<N>, from: &mut Sight<N>, to: &mut Sight<N>, begin: f64, length: f64) -> Curve {
        let mut ends = [[[0.0; QUANTITIES]; 4]; 2];
        self.terms(law, from, length, &mut ends[0]);
        self.terms(law, to, length, &mut ends[1]);
        Curve::through(self.is_few(law), [begin, length], &ends[0], &ends[1])
    }

    /// The curve over a part with matrices; where every part is shown, these give the curve itself, too.
    fn curve_of_level(&self, law: &ModeMatrices<N>, from: &mut Sight<N>, to: &mut Sight<N>, part: Part) -> Curve {
        match self.watching.sees_all {
            true => {
                let shown = law.shown(&self.core.common.mechanism, &self.core.common.space);
                law.curve(shown, &from.z, &from.value, part.begin, part.level)
            }
            false => self.curve(law, from, to, part.begin, part.length),
        }
    }

    fn see(&mut self, curve: &Curve) {
        if let Some(observer) = &mut self.recorder.observer {
            observer.see(curve);
        }
    }

    /// [`Core::advance`] that shows the motion to an observer.
    pub(super) fn advance_shown(&mut self, distance: f64, looked: bool) -> Option<Transition> {
        if !self.is_observed() {
            return self.core.advance(distance, looked);
        }
        let core = &mut self.core;
        let (law, before, begin, offset) = (Arc::clone(&core.matrices), core.z, core.time(), core.common.offset);
        let fallen = core.advance(distance, looked);
        let (after, length) = (core.z, core.common.offset - offset);
        self.show_way(&law, before, &[after], (begin, length));
        fallen
    }
}
