//! Observation of a run without rows: the motion between events, changes of the input and rows, for an [`Observe`]r.

use super::polynomial::{Polynomial, TERMS, binomials, hermite};
use super::{Detail, Flow};
use crate::mechanism::{BODIES, DRIVES, Form, Layout, Mechanism, Mode, Shown, State};
use crate::solve::widest::widest;
use crate::trajectory::Trajectory;

/// Number of quantities in a [`Reading`].
pub const QUANTITIES: usize = 20;

/// Number of readings that suffices for most machines; the remaining ones are zero and not computed.
pub(super) const FEW: usize = 12;

/// Readings of a run at one instant, in the order of [`Mechanism::readings`], for an axis that of [`reading`]. SI
/// units.
pub type Reading = [f64; QUANTITIES];

/// Indices in a [`Reading`] of an axis.
pub mod reading {
    /// ẋ, m/s.
    pub const CART_SPEED: usize = 0;
    /// r φ̇₁, m/s.
    pub const DRIVE_SPEED: usize = 1;
    /// Elongation of span 1, m; those of spans 2 and 3 follow.
    pub const STRETCH: usize = 2;
    /// Force in span 1, N; those in spans 2 and 3 follow.
    pub const FORCE: usize = 5;
    /// Motor current, A.
    pub const CURRENT: usize = 8;
    /// φ̇_r, rad/s: speed of the rotor behind the gear.
    pub const ROTOR_SPEED: usize = 9;
    /// Voltage at the motor's terminals, V; for a stepper, the commanded position, m.
    pub const VOLTAGE: usize = 10;
    /// x, m.
    pub const CART_POSITION: usize = 11;
}

/// The reading of these values, of the first [`FEW`] quantities or of all.
#[inline(always)]
pub(super) fn reading_of(few: bool, mut value: impl FnMut(usize) -> f64) -> Reading {
    let mut reading = [0.0; QUANTITIES];
    // Two loops of known lengths, each compiled for vectors.
    match few {
        true => (0..FEW).for_each(|q| reading[q] = value(q)),
        false => (0..QUANTITIES).for_each(|q| reading[q] = value(q)),
    }
    reading
}

/// A part of a run with one mode and no jump of the input, described by its ends.
#[derive(Debug, Clone, Copy)]
pub struct Gap<'a> {
    /// Its start, s.
    pub begin: f64,
    /// Its length, s; 0 for a single instant.
    pub length: f64,
    /// The reading at its beginning.
    pub from: &'a Reading,
    /// The reading at its end.
    pub to: &'a Reading,
    /// Largest deviation of a quantity from the straight line between the two; infinite if no bound is known.
    pub bow: &'a Reading,
    /// The states of all parts.
    pub mode: &'a Mode,
    /// True if all readings are among the first [`FEW`] quantities.
    pub(super) few: bool,
}

impl Gap<'_> {
    /// A bound of the magnitude of quantity `q` within.
    #[inline(always)]
    pub fn bound(&self, q: usize) -> f64 {
        Self::bound_of(self.from[q], self.to[q], self.bow[q])
    }

    /// Bound of a quantity that goes from `from` to `to` and deviates from the straight line by at most `bow`.
    #[inline(always)]
    pub fn bound_of(from: f64, to: f64, bow: f64) -> f64 {
        let (middle, half) = (0.5 * (from + to).abs(), 0.5 * (to - from).abs());
        middle + rise(half, bow)
    }

    widest! {
        /// For any quantity: true if its magnitude at either end exceeds the first of `factors` times its height, and
        /// true if it can exceed the second within.
        pub fn rises_above(&self, heights: &Reading, factors: [f64; 2]) -> (bool, bool)
            = rises_above_by_any, rises_above_by_avx2;
    }

    #[inline(always)]
    fn rises_above_by_any(&self, heights: &Reading, factors: [f64; 2]) -> (bool, bool) {
        match self.few {
            true => self.rises_above_of::<FEW>(heights, factors),
            false => self.rises_above_of::<QUANTITIES>(heights, factors),
        }
    }

    #[inline(always)]
    fn rises_above_of<const Q: usize>(&self, heights: &Reading, [at_ends, inside]: [f64; 2]) -> (bool, bool) {
        let (mut ends, mut within) = (0_u64, 0_u64);
        let both = self.from[..Q].iter().zip(&self.to[..Q]);
        for (((from, to), bow), height) in both.zip(&self.bow[..Q]).zip(&heights[..Q]) {
            let least = *height * at_ends;
            ends |= u64::from(from.abs() > least) | u64::from(to.abs() > least);
            within |= u64::from(Self::bound_of(*from, *to, *bow) > height * inside);
        }
        (ends != 0, within != 0)
    }

    /// True if quantity `q` is held at one value: by a limit, or because nothing moves.
    #[inline(always)]
    pub fn holds(&self, q: usize) -> bool {
        self.bow[q] == 0.0 && self.from[q] == self.to[q]
    }

    /// Bounds of the value of quantity `q` within, from below and above.
    pub fn range(&self, q: usize) -> (f64, f64) {
        let (middle, half) = (0.5 * (self.from[q] + self.to[q]), 0.5 * (self.to[q] - self.from[q]).abs());
        let rise = rise(half, self.bow[q]);
        (middle - rise, middle + rise)
    }
}

/// Gaps of a [`Stretch`] by their numbers: one bit for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gaps(u64);

impl Gaps {
    /// No gap.
    pub const NONE: Self = Self(0);

    /// The first `count` gaps.
    pub fn first(count: usize) -> Self {
        Self(if count < 64 { (1 << count) - 1 } else { u64::MAX })
    }

    /// Adds the one with this number.
    #[inline(always)]
    pub fn set(&mut self, gap: usize, is_in: bool) {
        self.0 |= u64::from(is_in) << gap;
    }

    /// True if the one with this number is among them.
    pub fn has(self, gap: usize) -> bool {
        self.0 >> gap & 1 == 1
    }

    /// One more than the largest number.
    pub fn end(self) -> usize {
        64 - self.0.leading_zeros() as usize
    }
}

/// A part of a run with one mode and no jump of the input, described by readings at even intervals.
#[derive(Debug, Clone, Copy)]
pub struct Stretch<'a> {
    /// Its start, s.
    pub begin: f64,
    /// Interval between readings, s; 0 for a single instant.
    pub interval: f64,
    /// The readings: at its beginning, and after each of at most 64 gaps.
    pub readings: &'a [Reading],
    /// The largest magnitudes of each quantity in them.
    pub most: Reading,
    /// Largest deviation of a quantity from the straight line between two of them; infinite if no bound is known.
    pub bow: &'a Reading,
    /// The states of all parts.
    pub mode: &'a Mode,
    few: bool,
}

impl<'a> Stretch<'a> {
    pub(super) fn new(
        (begin, interval): (f64, f64),
        readings: &'a [Reading],
        bow: &'a Reading,
        mode: &'a Mode,
        few: bool,
    ) -> Self {
        let most = if few { most_of::<FEW>(readings) } else { most_of::<QUANTITIES>(readings) };
        Self { begin, interval, readings, most, bow, mode, few }
    }

    /// Its end, s.
    pub fn end(&self) -> f64 {
        self.time(self.readings.len() - 1)
    }

    /// Time of a reading, s.
    pub fn time(&self, reading: usize) -> f64 {
        self.begin + reading as f64 * self.interval
    }

    /// The reading of a quantity with the largest magnitude, and its time: the last of those equal within `share`, the
    /// first of those at a limit.
    pub fn largest(&self, q: usize, share: f64) -> (f64, f64) {
        let height = self.most[q];
        let (mut place, mut value) = (0, 0.0);
        for (row, reading) in self.readings.iter().enumerate() {
            let held = row > 0 && self.bow[q] == 0.0 && reading[q] == self.readings[row - 1][q];
            if reading[q].abs() >= height * (1.0 - share) && !held {
                place = row;
            }
            if reading[q].abs() == height {
                value = reading[q];
            }
        }
        (value, self.time(place))
    }

    /// The gaps within which the magnitude of any quantity can be above `factor` times its height.
    pub fn rising_above(&self, heights: &Reading, factor: f64) -> Gaps {
        let mut gaps = Gaps::NONE;
        let all = self.most.iter().zip(self.bow).zip(heights);
        if all.into_iter().any(|((most, bow), height)| most + bow > height * factor) {
            for (gap, ends) in self.readings.array_windows().enumerate() {
                let [from, to] = ends;
                let (begin, length, few) = (0.0, self.interval, self.few);
                let gap_of = Gap { begin, length, from, to, bow: self.bow, mode: self.mode, few };
                gaps.set(gap, gap_of.rises_above(heights, [1.0, factor]).1);
            }
        }
        gaps
    }
}

/// The largest magnitudes of the first quantities.
#[inline(always)]
fn most_of<const Q: usize>(readings: &[Reading]) -> Reading {
    let mut most = [0.0_f64; QUANTITIES];
    for reading in readings {
        let both = most[..Q].iter_mut().zip(&reading[..Q]);
        both.for_each(|(most, r)| *most = if r.abs() > *most { r.abs() } else { *most });
    }
    most
}

/// The gaps of a stretch that an observer examines more closely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closer {
    /// Every gap, at once, as [`Observe::pass`] decides.
    Now,
    /// These gaps, later, as [`Observe::pass`] decides: in a search for extremes, greater ones may be known by then.
    Later(Gaps),
}

/// Largest height above zero of a line from −`half` to `half` plus a parabola of height `bow`:
/// max over s of half (2s − 1) + 4 bow s (1 − s).
#[inline(always)]
fn rise(half: f64, bow: f64) -> f64 {
    if half >= 2.0 * bow { half } else { 0.25 * half * half / bow + bow }
}

/// A part of a run on which every quantity is accurately a polynomial of time.
#[derive(Debug, Clone, Copy)]
pub struct Curve {
    /// Its start, s.
    pub begin: f64,
    /// Its length, s.
    pub length: f64,
    /// Coefficients of the powers of s, the fraction of the length: readings are Σ terms_k sᵏ.
    pub terms: [Reading; TERMS],
    /// True if all readings are among the first [`FEW`] quantities.
    pub(super) few: bool,
}

impl Curve {
    /// The polynomial of one quantity.
    #[inline]
    pub fn polynomial(&self, q: usize) -> Polynomial {
        // Not by `map`, which would copy all readings.
        Polynomial(std::array::from_fn(|k| self.terms[k][q]))
    }

    widest! {
        /// The curve from values and the first three derivatives by s, each over its order's factorial, at both ends.
        pub(super) fn through(few: bool, ends: [f64; 2], from: &[Reading; 4], to: &[Reading; 4]) -> Self
            = Self::through_by_any, through_by_avx2;
    }

    #[inline(always)]
    fn through_by_any(few: bool, [begin, length]: [f64; 2], from: &[Reading; 4], to: &[Reading; 4]) -> Self {
        let terms = if few { Self::terms_of::<FEW>(from, to) } else { Self::terms_of::<QUANTITIES>(from, to) };
        Self { begin, length, terms, few }
    }

    #[inline(always)]
    fn terms_of<const Q: usize>(from: &[Reading; 4], to: &[Reading; 4]) -> [Reading; TERMS] {
        let mut terms = [[0.0; QUANTITIES]; TERMS];
        for q in 0..Q {
            let [before, after] = [from, to].map(|ends| ends.each_ref().map(|end| end[q]));
            let curve = hermite(before, std::array::from_fn(|k| after[k] - before[k]));
            terms.iter_mut().zip(curve).for_each(|(term, c)| term[q] = c);
        }
        terms
    }

    widest! {
        /// True if the magnitude of any quantity may exceed its height, by Σ |c_k|, which costs less than
        /// [`Curve::ranges`].
        pub fn may_exceed(&self, heights: &Reading) -> bool = may_exceed_by_any, may_exceed_by_avx2;
    }

    #[inline(always)]
    fn may_exceed_by_any(&self, heights: &Reading) -> bool {
        if self.few { self.may_exceed_of::<FEW>(heights) } else { self.may_exceed_of::<QUANTITIES>(heights) }
    }

    #[inline(always)]
    fn may_exceed_of<const Q: usize>(&self, heights: &Reading) -> bool {
        let mut sizes = [0.0; Q];
        for term in &self.terms {
            sizes.iter_mut().zip(&term[..Q]).for_each(|(size, c)| *size += c.abs());
        }
        sizes.iter().zip(&heights[..Q]).fold(false, |any, (size, height)| any | (size > height))
    }

    widest! {
        /// Bounds of the values of every quantity, from below and above: those of [`Polynomial::range`].
        pub fn ranges(&self) -> (Reading, Reading) = ranges_by_any, ranges_by_avx2;
    }

    #[inline(always)]
    fn ranges_by_any(&self) -> (Reading, Reading) {
        if self.few { self.ranges_of::<FEW>() } else { self.ranges_of::<QUANTITIES>() }
    }

    #[inline(always)]
    fn ranges_of<const Q: usize>(&self) -> (Reading, Reading) {
        let mut b = self.terms;
        for (b, binomial) in b.iter_mut().zip(const { binomials::<TERMS>() }) {
            b[..Q].iter_mut().for_each(|b| *b /= binomial);
        }
        for i in 1..TERMS {
            for k in (i..TERMS).rev() {
                let (before, here) = b.split_at_mut(k);
                here[0][..Q].iter_mut().zip(&before[k - 1][..Q]).for_each(|(b, before)| *b += before);
            }
        }
        let (mut low, mut high) = (b[0], b[0]);
        for b in &b[1..] {
            low[..Q].iter_mut().zip(&b[..Q]).for_each(|(low, b)| *low = if *b < *low { *b } else { *low });
            high[..Q].iter_mut().zip(&b[..Q]).for_each(|(high, b)| *high = if *b > *high { *b } else { *high });
        }
        (low, high)
    }

    /// The reading at the fraction `s` of the length.
    pub fn at(&self, s: f64) -> Reading {
        if self.few { self.at_of::<FEW>(s) } else { self.at_of::<QUANTITIES>(s) }
    }

    #[inline(always)]
    fn at_of<const Q: usize>(&self, s: f64) -> Reading {
        let mut sum = self.terms[TERMS - 1];
        for term in self.terms[..TERMS - 1].iter().rev() {
            for (sum, term) in sum[..Q].iter_mut().zip(&term[..Q]) {
                *sum = *sum * s + term;
            }
        }
        sum
    }
}

/// An observer of every instant of a run, not only of its rows.
///
/// The run comes in [`Stretch`]es, each beginning where the last one ended; a jump of the input or a change of mode
/// separates two stretches. Between readings, the observer can request smaller gaps or a [`Curve`].
pub trait Observe {
    /// Takes the next stretch; returns the gaps to examine more closely.
    fn stretch(&mut self, stretch: &Stretch) -> Closer {
        let _ = stretch;
        Closer::Now
    }

    /// Takes a gap that was to be examined more closely, or one within such a gap; returns true to continue into this
    /// one.
    fn pass(&mut self, gap: &Gap) -> bool;

    /// Takes the motion within a requested gap.
    fn see(&mut self, curve: &Curve);

    /// True if it observes the motion; otherwise it is notified of the end only.
    fn follows(&self) -> bool {
        true
    }

    /// True if it examines the whole motion closely, whatever the bounds.
    fn sees_all(&self) -> bool {
        false
    }

    /// The run has ended, in this state.
    fn end(&mut self, time: f64, state: &State, mode: &Mode);
}

/// Relative excess of a bound over a peak that needs no closer search, and relative difference of equal values. The
/// peak itself is the maximum of a polynomial with a relative accuracy of 1e-9, the stated accuracy of peaks; the
/// relative error of its time, on the time scale of the curvature, is the square root of that.
pub(crate) const NEWS: f64 = 1e-12;

/// An observer of the extremes of some quantities, and of one that becomes steady: what runs side by side are followed
/// for.
pub trait Extremes {
    /// The quantities: sums of readings by their numbers, each with its weight; and a last one that becomes steady.
    fn quantities(&self) -> &[Vec<(usize, f64)>];

    /// Number of those whose extremes are sought: all but the last, or all.
    fn sought(&self) -> usize;

    /// Takes the largest value that a quantity has come to, and when it was there last.
    fn come_to(&mut self, quantity: usize, value: f64, time: f64);

    /// Takes a value that may be larger than those before.
    fn take(&mut self, quantity: usize, value: f64, time: f64);

    /// The interval in which the last quantity is followed, s, if it is.
    fn steady(&self) -> Option<(f64, f64)>;

    /// Takes an interval of it: its ends, the values there, and bounds of what is between. Says whether it wants to see
    /// closer.
    fn pass_steady(&mut self, times: (f64, f64), ends: [f64; 2], range: (f64, f64)) -> bool;

    /// Takes the course of it in an interval that it wanted to see closer.
    /// `range` gives the least and the greatest value from a fraction of it on.
    fn see_steady(&mut self, times: (f64, f64), range: &dyn Fn(f64) -> (f64, f64));

    /// Parts have moved in this mode.
    fn moves(&mut self, mode: &Mode);

    /// The run has ended, in this state.
    fn end(&mut self, time: f64, state: &State, mode: &Mode);
}

/// The readings of a machine in one mode, as linear forms.
#[derive(Debug, Clone)]
pub(super) struct Readout {
    pub(super) forms: [Form; QUANTITIES],
    /// Readings of positions relative to the origin: the quantity, the body, its factor.
    ways: Vec<(usize, usize, f64)>,
    /// Limits of voltages and currents, which limited values do not exceed by a single bit.
    pub(super) limits: Vec<(usize, f64)>,
    /// True if all readings are among the first [`FEW`] quantities.
    pub(super) few: bool,
}

impl Readout {
    pub(super) fn new(mechanism: &Mechanism, mode: &Mode) -> Self {
        let mut forms = [Form::ZERO; QUANTITIES];
        let (mut ways, mut limits) = (Vec::new(), Vec::new());
        for (q, shown) in mechanism.readings.iter().enumerate().take(QUANTITIES) {
            forms[q] = match *shown {
                Shown::Speed(body, factor) => Form::speed(body) * factor,
                Shown::Position(body, factor) => {
                    ways.push((q, body, factor));
                    let alone = |arms: &[(usize, f64)]| arms == [(body, 1.0)];
                    match mechanism.springs.iter().position(|spring| alone(&spring.arms)) {
                        Some(spring) => Form::stretch(spring) * factor,
                        None => Form::ZERO,
                    }
                }
                // A spring between bodies that move as one has no elongation.
                Shown::Stretch(spring) if mechanism.leading_arms(spring) == [0.0; BODIES] => Form::ZERO,
                Shown::Stretch(spring) => Form::stretch(spring),
                Shown::Force(spring, factor) => mechanism.spring_force(spring, mode) * factor,
                Shown::Current(drive) => {
                    limits.extend(mechanism.drives[drive].amplifier.current_limit.map(|limit| (q, limit)));
                    mechanism.current(drive, mode)
                }
                Shown::Voltage(drive) => {
                    limits.extend(mechanism.drives[drive].amplifier.voltage_limit.map(|limit| (q, limit)));
                    mechanism.voltage(drive, mode)
                }
                Shown::Input(drive) => Form::input(drive),
                _ => Form::ZERO,
            };
        }
        Self { forms, ways, limits, few: mechanism.readings.len() <= FEW }
    }

    /// Largest deviation of readings from straight lines if only their forms are known: zero for those that are held.
    pub(super) fn unknown_bow(&self) -> Reading {
        let is_held = |q: usize| {
            let Form { constant, .. } = self.forms[q];
            self.forms[q] == Form::constant(constant) && self.ways.iter().all(|&(way, ..)| way != q)
        };
        std::array::from_fn(|q| if is_held(q) { 0.0 } else { f64::INFINITY })
    }

    /// The values of the forms, with positions relative to their origin, and limits applied.
    #[inline]
    pub(super) fn placed(&self, mut reading: Reading, origin: &[f64; BODIES]) -> Reading {
        for &(q, body, factor) in &self.ways {
            reading[q] += origin[body] * factor;
        }
        for &(q, limit) in &self.limits {
            reading[q] = reading[q].clamp(-limit, limit);
        }
        reading
    }

    /// The readings in a state in the solver's coordinates, whose positions are relative to `origin`, under `input`.
    pub(super) fn read(
        &self,
        layout: &Layout,
        inner: &State,
        origin: &[f64; BODIES],
        input: &[f64; DRIVES],
    ) -> Reading {
        let stretch = layout.stretches(inner);
        self.placed(reading_of(self.few, |q| self.forms[q].value_at(&stretch, inner, input)), origin)
    }
}

/// Output of a run: blocks of rows to a receiver, the motion between them to an observer.
pub(crate) struct Output<'a> {
    pub(crate) detail: Detail,
    pub(crate) sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    pub(crate) observer: Option<&'a mut dyn Observe>,
}

impl<'a> Output<'a> {
    /// This output for a shorter lifetime.
    pub(crate) fn within<'b>(self) -> Output<'b>
    where
        'a: 'b,
    {
        let observer = self.observer.map(|observer| -> &'b mut dyn Observe { observer });
        Output { detail: self.detail, sink: self.sink, observer }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time of the largest of these values, which are `interval` apart from 1 s on.
    fn largest(values: &[f64], bow: f64, share: f64) -> (f64, f64) {
        let reading = |value: &f64| {
            let mut reading = [0.0; QUANTITIES];
            reading[5] = *value;
            reading
        };
        let readings: Vec<Reading> = values.iter().map(reading).collect();
        let (bow, mode) = ([bow; QUANTITIES], Mode::new(std::iter::empty()));
        let stretch = Stretch::new((1.0, 0.5), &readings, &bow, &mode, false);
        assert_eq!(stretch.end(), 1.0 + 0.5 * (values.len() - 1) as f64);
        stretch.largest(5, share)
    }

    #[test]
    fn of_equal_values_the_last_is_the_largest_and_at_a_limit_the_first() {
        assert_eq!(largest(&[1.0, -3.0, 2.0, 3.0, 0.5], 0.1, 0.0), (3.0, 2.5));
        assert_eq!(largest(&[1.0, -3.0, 2.0, 2.99, 0.5], 0.1, 1e-2), (-3.0, 2.5));
        assert_eq!(largest(&[1.0, 3.0, 3.0, 3.0], 0.1, 0.0), (3.0, 2.5));
        // Held by a limit.
        assert_eq!(largest(&[1.0, 3.0, 3.0, 3.0], 0.0, 0.0), (3.0, 1.5));
        assert_eq!(largest(&[2.0, 2.0, 2.0], 0.0, 0.0), (2.0, 1.0));
    }

    /// f = from + (to − from) s ± 4 bow s (1 − s)
    #[test]
    fn values_between_two_readings_lie_within_their_range() {
        let mode = Mode::new(std::iter::empty());
        for (from, to, bow) in [(1.0, 2.0, 0.1), (1.0, 2.0, 0.3), (-2.0, 1.0, 5.0), (0.7, 0.7, 0.0), (0.7, 0.7, 0.2)] {
            let [from_all, to_all, bow_all] = [from, to, bow].map(|value: f64| [value; QUANTITIES]);
            let gap =
                Gap { begin: 0.0, length: 1.0, from: &from_all, to: &to_all, bow: &bow_all, mode: &mode, few: false };
            let (low, high) = gap.range(2);
            let values = (0..=1000)
                .map(|k| f64::from(k) / 1000.0)
                .flat_map(|s| [-1.0, 1.0].map(|sign| from + (to - from) * s + sign * 4.0 * bow * s * (1.0 - s)));
            let (least, most) = values.fold((f64::MAX, f64::MIN), |(l, m), v| (l.min(v), m.max(v)));
            assert!((low - least).abs() < 1e-5 && (high - most).abs() < 1e-5, "{low} {least} {high} {most}");
            assert_eq!(gap.holds(2), from == to && bow == 0.0);
        }
    }
}
