//! The exact solver: modes and matrix exponentials.
//!
//! Within a mode the stage is linear and a step is a product with e^{A h}. A mode ends only when one of its guards
//! becomes negative, so the solver takes the largest steps on which a rigorous bound excludes this. Only where the
//! bound does not decide, it halves the step, and finally expands the state into a Taylor series.
//!
//! The bound. y = ż obeys ẏ = A y + b u̇, and friction, resistance and damping only take energy away, so its energy
//! V(y) = ½ Σ m a² + ½ Σ k (Δv)² + ½ w L (di/dt)² can only grow by the input's rate: √(2V)(τ) ≤ √(2V)(0) + |b|·|u̇|·τ.
//! A guard g = w·z therefore has a rate of at most |w|·√(2V), with the norm |w| dual to V; likewise its slope, with ẏ.

mod change;
mod ellipsoid;
mod kernel;
mod lanes;
mod matrices;
mod run;
mod saved;
mod sensitivity;
mod shown;

use super::coordinates::Coordinates;
use super::engine::Engine;
use super::inputs::Pieces;
use super::pace::{Pace, STEPS_BETWEEN_QUESTIONS};
use super::propagator::SERIES_TERMS;
use super::record::Extra;
use super::roots;
use super::rounding::Rounding;
use super::rules::Rules;
use super::saved::{Pass, Passed};
use super::{Cost, Ending, Event, PositionError};
use crate::mechanism::{DRIVES, Form, Layout, Mechanism, Mode, State, Transition};
use ellipsoid::Ellipsoid;
use kernel::Modes;
pub(super) use kernel::{Make, in_kernel};
pub use lanes::{Job, Receive};
pub(super) use lanes::{run_beside, takes};
pub(super) use matrices::Space;
use matrices::{GuardBuffers, ModeMatrices, Size};
pub(super) use run::ExactRun;
pub(super) use sensitivity::Following;
use std::sync::Arc;

/// Halvings of an interval with exact matrices: eighths, for a delay that ends within a sample.
const HALVES: usize = 3;

/// Fraction of the series radius below which the sign of a speed leaving zero is taken from the series.
const SOON: f64 = 1e-6;

/// A running machine: state, mode, and all data to continue. A clone continues identically.
#[derive(Clone)]
pub(super) struct Core<const N: usize> {
    /// State in the solver's coordinates, inputs and their derivatives, and a one.
    z: [f64; N],
    /// The largest magnitudes of its elements in rows so far.
    largest: [f64; N],
    matrices: Arc<ModeMatrices<N>>,
    known: Modes<N>,
    /// Matrices that were there before.
    shared: u64,
    room: Box<GuardBuffers<N>>,
    /// Rounding errors of the state, for a machine in which they can grow.
    errors: Option<Box<Ellipsoid<N>>>,
    pub(super) common: Common,
}

/// The parts of a running machine that do not depend on the kernel.
#[derive(Clone)]
pub(super) struct Common {
    pub(super) mechanism: Arc<Mechanism>,
    pub(super) space: Arc<Space>,
    pub(super) coordinates: Coordinates,
    /// Interval whose halves have matrices, s.
    h: f64,
    pub(super) rules: Rules,
    /// Bounds of |u̇| and |ü| on the present pieces.
    input_rate: [f64; DRIVES],
    input_curvature: [f64; DRIVES],
    /// Present time relative to `base`, s.
    base: f64,
    offset: f64,
    /// Number of modes so far.
    taken: u64,
    pub(super) cost: Cost,
    rounding: Rounding,
    /// Number of intervals crossed or halved, the progress per interval, and the target time.
    questions: u64,
    pace: Pace,
    end: f64,
    /// True if the receiver has to be asked to continue.
    pub(super) asks: bool,
}

/// The verdict of a bound on an interval.
enum Bound<const N: usize> {
    /// No guard falls; here is the end, if it was computed.
    Safe(Option<[f64; N]>),
    /// These guards need a closer check.
    Unsure(Lanes),
}

/// Guards by their numbers: one bit for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lanes(u64);

impl Lanes {
    const NONE: Self = Self(0);

    fn set(&mut self, lane: usize, is_in: bool) {
        self.0 |= u64::from(is_in) << lane;
    }

    fn numbers(self) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(self.0), |left| Some(left & left.wrapping_sub(1)))
            .take_while(|left| *left != 0)
            .map(|left| left.trailing_zeros() as usize)
    }
}

impl<const N: usize> Core<N> {
    /// Solver of a machine in `start`. `known` are the matrices of modes for intervals of any length; `end` is the end
    /// of the run, for the estimate of its steps.
    pub(super) fn new(
        mechanism: Arc<Mechanism>,
        space: Arc<Space>,
        start: &State,
        (h, end): (f64, f64),
        mut known: Modes<N>,
    ) -> Self {
        let layout = &space.layout;
        let (mut coordinates, inner) = Coordinates::new(layout, start);
        let z = vector(layout, &inner);
        let mode = mechanism.first_mode(start);
        coordinates.hold(layout, &mode, &inner);
        let shared = propagators(&known);
        let (matrices, is_new) = ModeMatrices::from_known(&mut known, &mechanism, &space, &mode, h);
        let rounding = Rounding::new(&space.layout, &mechanism);
        let common = Common {
            mechanism,
            space,
            coordinates,
            h,
            rules: Rules::new(mode),
            input_rate: [0.0; DRIVES],
            input_curvature: [0.0; DRIVES],
            base: 0.0,
            offset: 0.0,
            taken: 0,
            cost: Cost { modes: u64::from(is_new), ..Cost::default() },
            rounding,
            questions: 0,
            pace: Pace::default(),
            end,
            asks: false,
        };
        let errors =
            matrices::can_grow(&common.mechanism).then(|| Box::new(Ellipsoid::new(common.space.layout.states)));
        Self { z, largest: [0.0; N], matrices, known, shared, room: Box::new(GuardBuffers::new()), errors, common }
    }

    pub(super) fn time(&self) -> f64 {
        self.common.base + self.common.offset
    }

    /// The bound of rounding errors so far.
    fn bound_of_rounding(&mut self) -> PositionError {
        self.common.rounding.see(&self.largest);
        self.common.rounding.swing(self.matrices.swing, self.time());
        let steps = self.common.cost.steps + self.common.cost.series;
        let origin = self.common.coordinates.origin().iter().fold(0.0, |most: f64, origin| most.max(origin.abs()));
        self.carry_errors();
        let grown = self.errors.as_ref().map_or(0.0, |errors| errors.largest());
        self.common.rounding.bound(steps, self.time(), (origin, grown))
    }

    /// Advances to `until` and appends the events to `events`.
    fn go_on_to(&mut self, until: f64, events: &mut Vec<Event>) -> Result<(), Ending> {
        self.common.end = until;
        (self.common.questions, self.common.pace) = (0, Pace::default());
        self.count_from(self.time());
        let length = until - self.common.base;
        // Rounding of a sum of decimal times; not a fraction of the interval, which may be long.
        let near = (8.0 * f64::EPSILON * until.abs()).min(1e-9 * self.common.h);
        while length - self.common.offset > near && self.common.rules.trouble.is_none() {
            self.check();
            // Halves, quarters and eighths of the interval, which have matrices, are met to the last bit.
            let (left, eighth) = (length - self.common.offset, 0.125 * self.common.h);
            let snapped = (left / eighth).round() * eighth;
            let left = if (left - snapped).abs() <= near { snapped } else { left };
            let matrices = Arc::clone(&self.matrices);
            let looked = left >= self.common.h;
            let safe = match looked {
                true => self.safe_intervals(&matrices, (left / self.common.h) as u64).0,
                false => 0,
            };
            if safe > 0 {
                let step = matrices.step(0);
                (0..safe).for_each(|_| step.advance(&mut self.z));
                self.common.cost.steps += safe;
                self.move_on(safe as f64 * self.common.h);
                continue;
            }
            if let Some(fallen) = self.advance(left.min(self.common.h), looked) {
                self.go_through(fallen);
            } else if left <= self.common.h && !self.common.asks && self.common.rules.trouble.is_none() {
                break;
            }
            self.common.asks = false;
        }
        self.check();
        self.see();
        self.common.rules.hand_on(events);
        match self.common.rules.trouble {
            Some(ending) => Err(ending),
            None => {
                self.count_from(until.max(self.common.base));
                Ok(())
            }
        }
    }

    /// Sets new inputs.
    pub(super) fn set_input(&mut self, pieces: &Pieces) {
        self.common.cost.pieces += 1;
        self.common.rules.refreshed();
        self.common.rules.at_edge = true;
        for drive in 0..self.common.space.layout.inputs {
            self.take_up(drive, &pieces.coefficients[drive], pieces.end - pieces.start);
        }
    }

    /// Sets an input's value and derivatives in z.
    fn take_up(&mut self, drive: usize, coefficients: &[f64], length: f64) {
        let highest = self.common.space.highest;
        if coefficients[1..].iter().all(|&c| c == 0.0) {
            (0..=highest).for_each(|k| self.z[self.common.space.chain(drive, k)] = 0.0);
            self.z[self.common.space.chain(drive, 0)] = coefficients[0];
            (self.common.input_rate[drive], self.common.input_curvature[drive]) = (0.0, 0.0);
            return;
        }
        let mut factorial = 1.0;
        for (k, &c) in coefficients.iter().enumerate().take(highest + 1) {
            factorial *= k.max(1) as f64;
            // u⁽ᵏ⁾ = k! c_k
            self.z[self.common.space.chain(drive, k)] = c * factorial;
        }
        let length = if length.is_finite() { length } else { 0.0 };
        (self.common.input_rate[drive], self.common.input_curvature[drive]) = change_rates(coefficients, length);
    }

    /// True if the state is finite.
    #[inline]
    fn is_finite(&self) -> bool {
        self.z.iter().sum::<f64>().is_finite()
    }

    /// Updates the largest magnitudes by the present state.
    #[inline]
    fn see(&mut self) {
        for (largest, z) in self.largest.iter_mut().zip(&self.z) {
            *largest = if z.abs() > *largest { z.abs() } else { *largest };
        }
    }

    /// Detects a state that is no longer finite.
    fn check(&mut self) {
        if !self.is_finite() {
            self.common.rules.trouble = Some(Ending::Diverged { time: self.time() });
        }
    }

    /// Sets the present time as `base`.
    fn count_from(&mut self, base: f64) {
        (self.common.base, self.common.offset) = (base, 0.0);
    }

    /// Number of complete intervals, up to `most`, on which no guard can become negative; and true if nothing moves.
    fn safe_intervals(&mut self, law: &ModeMatrices<N>, most: u64) -> (u64, bool) {
        self.look(law);
        let resting = self.room.rate == [0.0; N];
        if law.guards.is_empty() {
            return (most, resting);
        }
        self.common.cost.looks += 1;
        if self.common.rules.is_fresh
            && law.guards.iter().any(|guard| self.common.rules.fresh_order(guard.transition.cause) > 0)
        {
            return (0, resting);
        }
        // g(τ) ≥ g − (|w| √2V + |w_u| |u̇|) τ − |w| |b| |u̇| τ²/2
        let grow = law.growth_factor();
        let GuardBuffers { size, value, steepness, bend, .. } = &mut *self.room;
        law.steepness((*size, 0.0), grow, &self.common.input_rate, steepness);
        let push = law.push(&self.common.input_rate) * 0.5;
        let mut time = f64::INFINITY;
        if push == 0.0 {
            for (g, slope) in value.iter().zip(steepness).take(law.guards.len()) {
                // A constant guard does not fall; 0/0 is NaN, which is not less.
                let until = if *g < 0.0 { 0.0 } else { *g / *slope };
                time = if until < time { until } else { time };
            }
        } else {
            law.steepness((Size::ZERO, push), grow, &[0.0; DRIVES], bend);
            for ((&mut g, &mut slope), &mut bend) in value.iter_mut().zip(steepness).zip(bend).take(law.guards.len()) {
                let moves = slope > 0.0 || bend > 0.0;
                if g < 0.0 || (g == 0.0 && moves) {
                    time = 0.0;
                } else if moves {
                    time = f64::min(time, 2.0 * g / (slope + (slope * slope + 4.0 * bend * g).sqrt()));
                }
            }
        }
        // Nothing grows from rest.
        if !resting || push > 0.0 {
            time = time.min(law.growth_time());
        }
        // A float that is too large becomes the largest integer.
        (most.min((time / self.common.h * 0.999) as u64), resting)
    }

    /// Evaluates rate, norm and guards at the state; guards are zero where rounding alone made them negative.
    #[inline]
    fn look(&mut self, law: &ModeMatrices<N>) {
        (self.room.rate, self.room.size) = law.look(&self.z, &mut self.room.value);
        self.stand(law);
    }

    /// Sets guards to zero that may be negative by rounding alone.
    #[inline]
    fn stand(&mut self, law: &ModeMatrices<N>) {
        for (value, guard) in self.room.value.iter_mut().zip(&law.guards) {
            if *value < 0.0 && guard.is_zero(&self.z) {
                *value = 0.0;
            }
            *value += self.common.rules.tolerance[guard.tolerance];
        }
    }

    /// Advances by `distance`, at most an interval; stops at the first guard that falls and returns it. `looked` is
    /// true if the present state has just been evaluated.
    pub(super) fn advance(&mut self, mut distance: f64, mut looked: bool) -> Option<Transition> {
        let law = Arc::clone(&self.matrices);
        if self.common.rules.is_fresh && distance > 0.0 {
            // Its series distinguishes a speed that starts from zero from one that falls to zero.
            let first = distance.min(law.far());
            if let Some(fallen) = self.advance_by_series(&law, first, looked) {
                return Some(fallen);
            }
            looked = false;
            distance -= first;
        }
        for level in 0..=law.coarsest {
            while distance >= law.length(level) && self.goes() {
                if let Some(fallen) = self.cross_interval(&law, level, looked) {
                    return Some(fallen);
                }
                looked = false;
                distance -= law.length(level);
            }
        }
        if !(distance > 0.0 && self.goes()) {
            return None;
        }
        // Fractions such as half an interval occur repeatedly and have a matrix.
        let exact = (law.coarsest + 1..=law.finest.min(HALVES)).find(|&level| distance == law.length(level));
        match exact {
            Some(level) => self.cross_interval(&law, level, looked),
            None => self.advance_by_series(&law, distance, looked),
        }
    }

    /// Crosses an interval of h/2^level.
    fn cross_interval(&mut self, law: &ModeMatrices<N>, level: usize, looked: bool) -> Option<Transition> {
        if !self.goes_on() {
            return None;
        }
        let length = law.length(level);
        if !looked {
            self.look(law);
        }
        match self.bound(law, length, level) {
            Bound::Safe(end) => {
                match end {
                    Some(end) => self.z = end,
                    None => law.step(level).advance(&mut self.z),
                }
                self.common.cost.steps += 1;
                self.move_on(length);
                None
            }
            Bound::Unsure(_) if level < law.coarsest => {
                self.cross_interval(law, level + 1, true).or_else(|| self.cross_interval(law, level + 1, false))
            }
            Bound::Unsure(open) => self.advance_by_series_of(law, length, open),
        }
    }

    /// True if the run may continue.
    fn goes(&self) -> bool {
        self.common.rules.trouble.is_none() && !self.common.asks
    }

    /// Has the receiver asked from time to time, and checks the progress; false if the run will not end.
    fn goes_on(&mut self) -> bool {
        self.common.questions += 1;
        if self.common.questions.is_multiple_of(STEPS_BETWEEN_QUESTIONS) && self.common.rules.trouble.is_none() {
            self.common.asks = true;
            self.common.rules.trouble = self.common.pace.too_stiff(self.common.questions, self.time(), self.common.end);
        }
        self.goes()
    }

    fn move_on(&mut self, by: f64) {
        self.common.offset += by;
        self.common.rules.since_change += by;
    }

    /// Decides by the last evaluation, if possible, that no guard falls within `length`.
    fn bound(&mut self, law: &ModeMatrices<N>, length: f64, level: usize) -> Bound<N> {
        if law.guards.is_empty() {
            return Bound::Safe(None);
        }
        self.common.cost.looks += 1;
        let (unsure, falling) = self.undecided(law, length);
        match (unsure, falling) {
            (Lanes::NONE, Lanes::NONE) => Bound::Safe(None),
            (Lanes::NONE, falling) => {
                // A guard that decreases throughout has not fallen if it is still positive at the end.
                let mut end = self.z;
                law.step(level).advance(&mut end);
                let value = &mut self.room.slope;
                law.values(&end, value);
                match value.iter().take(law.guards.len()).all(|&value| value > 0.0) {
                    true => Bound::Safe(Some(end)),
                    false => Bound::Unsure(falling),
                }
            }
            (Lanes(unsure), Lanes(falling)) => Bound::Unsure(Lanes(unsure | falling)),
        }
    }

    /// The guards that may fall within `length` by the last evaluation; and those among the others that decrease
    /// throughout.
    fn undecided(&mut self, law: &ModeMatrices<N>, length: f64) -> (Lanes, Lanes) {
        let (mut open, mut falling) = (Lanes::NONE, Lanes::NONE);
        let grow = law.growth_over(length);
        let (input_rate, curvature) = (&self.common.input_rate, &self.common.input_curvature);
        let GuardBuffers { rate, size, value, steepness, slope, bend, .. } = &mut *self.room;
        law.steepness((*size, law.push(input_rate) * length), grow, input_rate, steepness);
        for (lane, (g, steepness)) in value.iter().zip(&*steepness).enumerate().take(law.guards.len()) {
            open.set(lane, !(*g > steepness * length || (*g >= 0.0 && *steepness == 0.0)));
        }
        if open == Lanes::NONE {
            return (open, falling);
        }

        // One derivative higher: its guards are the slopes.
        let (_, size) = law.look(rate, slope);
        law.steepness((size, law.push(curvature) * length), grow, curvature, bend);
        let mut unsure = Lanes::NONE;
        for lane in open.numbers() {
            let (g, slope, bend) = (value[lane], slope[lane], bend[lane]);
            // g(τ) ≥ g + ġ τ − |g̈| τ²/2
            let stays = g >= 0.0 && g + slope.min(0.0) * length - 0.5 * bend * length * length > 0.0;
            let rises = g >= 0.0 && slope > bend * length;
            let falls = g > 0.0 && slope < -bend * length;
            falling.set(lane, falls && !(stays || rises));
            unsure.set(lane, !(stays || rises || falls));
        }
        (unsure, falling)
    }

    /// Advances by a `distance` within the reach of the Taylor series, to the first guard that falls.
    fn advance_by_series(&mut self, law: &ModeMatrices<N>, distance: f64, looked: bool) -> Option<Transition> {
        if !looked {
            self.look(law);
        }
        let (Lanes(unsure), Lanes(falling)) = self.undecided(law, distance);
        let open = Lanes(unsure | falling);
        if open == Lanes::NONE && self.room.rate == [0.0; N] {
            // Nothing moves: every term of the series is zero, and so is what it adds.
            self.common.cost.series += 1;
            self.z.iter_mut().for_each(|z| *z += 0.0);
            self.move_on(distance);
            if distance > SOON * law.reach() {
                self.common.rules.refreshed();
            }
            return None;
        }
        self.advance_by_series_of(law, distance, open)
    }

    /// Advances by a series; only these guards can fall.
    fn advance_by_series_of(&mut self, law: &ModeMatrices<N>, distance: f64, open: Lanes) -> Option<Transition> {
        self.common.cost.series += 1;
        law.series(&self.z, distance, &mut self.room.series);
        let GuardBuffers { value, series, coefficients, .. } = &mut *self.room;
        let along = |index: usize, room: &mut [f64; SERIES_TERMS]| {
            let coefficients = law.guards[index].row.along(series, room);
            coefficients[0] = value[index];
            coefficients.len()
        };
        let fall = |_, coefficients: &[f64]| roots::first_fall(coefficients);
        let first = first_fallen(&self.common.rules, law, (&self.z, distance), open, coefficients, (along, fall));
        let s = first.map_or(1.0, |(s, _)| s);
        series.add_to(&mut self.z, s);
        self.move_on(s * distance);
        if s * distance > SOON * law.reach() {
            self.common.rules.refreshed();
        }
        first.map(|(_, fallen)| fallen)
    }

    /// The state in the solver's coordinates.
    fn inner(&self) -> State {
        self.common.space.inner(&self.z)
    }

    /// The state in angles and positions.
    pub(super) fn state(&self) -> State {
        self.common.coordinates.state(&self.common.space.layout, &self.inner())
    }

    pub(super) fn input(&self) -> [f64; DRIVES] {
        self.common.space.input(&self.z)
    }

    /// The rounding error of the value of a form.
    fn noise(&self, form: &Form) -> f64 {
        form.noise(&self.common.space.layout, &self.inner(), &self.input())
    }

    /// The value of a form now.
    pub(super) fn value(&self, form: &Form) -> f64 {
        self.common.space.layout.value(form, &self.inner(), &self.input())
    }
}

/// Creates a solver in the state of another, for inputs of a higher degree.
struct Smoothed<const M: usize> {
    /// State of another kernel: states and inputs, at the indices of [`Space::inner`] and [`Space::chain`] there.
    z: Vec<f64>,
    derivatives: Vec<Vec<f64>>,
    errors: Option<Box<Ellipsoid<M>>>,
    common: Common,
}

impl<const M: usize> Make for Smoothed<M> {
    type Made = Box<dyn Engine>;

    fn make<const N: usize>(self) -> Self::Made {
        let Self { z: states, derivatives, errors, common } = self;
        let mut z = [0.0; N];
        z[..states.len()].copy_from_slice(&states);
        for (drive, derivatives) in derivatives.iter().enumerate() {
            for (k, value) in derivatives.iter().enumerate() {
                z[common.space.chain(drive, k)] = *value;
            }
        }
        z[N - 1] = 1.0;
        let mut known = Vec::new();
        let (matrices, _) =
            ModeMatrices::from_known(&mut known, &common.mechanism, &common.space, &common.rules.mode, common.h);
        let room = Box::new(GuardBuffers::new());
        let errors = errors.map(|errors| Box::new(errors.resized()));
        Box::new(Core::<N> { z, largest: [0.0; N], matrices, known, shared: 0, room, errors, common })
    }
}

impl<const N: usize> Engine for Core<N> {
    fn copy(&self) -> Box<dyn Engine> {
        Box::new(self.clone())
    }

    fn mechanism(&self) -> &Mechanism {
        &self.common.mechanism
    }

    fn time(&self) -> f64 {
        Core::time(self)
    }

    fn degree(&self) -> usize {
        self.common.space.highest
    }

    fn raised(&self, degree: usize) -> Box<dyn Engine> {
        let mut common = self.common.clone();
        common.rounding.see(&self.largest);
        let old = &self.common.space;
        let derivative = |drive: usize| (0..=old.highest).map(move |k| self.z[old.chain(drive, k)]);
        let derivatives = (0..old.layout.inputs).map(|drive| derivative(drive).collect()).collect();
        let space = Arc::new(Space::new(&self.common.mechanism, degree));
        common.space = Arc::clone(&space);
        in_kernel(
            space.size(),
            Smoothed { z: self.z[..old.layout.states].to_vec(), derivatives, errors: self.errors.clone(), common },
        )
    }

    fn take_input(&mut self, pieces: &Pieces) {
        self.set_input(pieces);
        self.resolve();
    }

    fn bound_input(&mut self, pieces: &Pieces, until: f64) {
        let (rest, length) = (pieces.since(self.time()), until - self.time());
        for drive in 0..self.common.space.layout.inputs {
            (self.common.input_rate[drive], self.common.input_curvature[drive]) =
                change_rates(&rest.coefficients[drive], length);
        }
    }

    fn go_to(&mut self, until: f64, events: &mut Vec<Event>) -> Result<(), Ending> {
        self.go_on_to(until, events)
    }

    fn state(&self) -> State {
        Core::state(self)
    }

    fn mode(&self) -> &Mode {
        &self.common.rules.mode
    }

    fn input(&self) -> [f64; DRIVES] {
        Core::input(self)
    }

    fn value(&self, form: &Form) -> f64 {
        Core::value(self, form)
    }

    fn extra(&self) -> Extra {
        Extra::default()
    }

    fn replace(&mut self, mechanism: &Mechanism) {
        Core::replace(self, mechanism);
    }

    fn pass(&mut self, pass: &mut Pass) -> Passed {
        Core::pass(self, pass)
    }

    fn error(&self) -> Option<PositionError> {
        Some(self.clone().bound_of_rounding())
    }
}

/// The first of the `open` guards that falls along a series of z over `distance`, and the fraction of the distance;
/// `along` gives the coefficients of a guard and their number, `fall` its first fall if none of them is left out.
fn first_fallen<const N: usize>(
    rules: &Rules,
    law: &ModeMatrices<N>,
    (z, distance): (&[f64; N], f64),
    open: Lanes,
    room: &mut [f64; SERIES_TERMS],
    (mut along, fall): (impl FnMut(usize, &mut [f64; SERIES_TERMS]) -> usize, impl Fn(usize, &[f64]) -> Option<f64>),
) -> Option<(f64, Transition)> {
    let mut first: Option<(f64, Transition)> = None;
    for index in open.numbers() {
        let guard = &law.guards[index];
        let count = along(index, room);
        let coefficients = &room[..count];
        let mut order = rules.fresh_order(guard.transition.cause);
        if order > 0 || coefficients[0] == 0.0 {
            order = law.first_term(guard, coefficients, (z, distance), order.max(1));
        }
        let sooner = |s: f64| {
            first.is_none_or(|(earliest, other)| s < earliest || (s == earliest && guard.transition.rank < other.rank))
        };
        let found = match order {
            0 => fall(index, coefficients),
            order => roots::first_fall(&coefficients[order..]),
        };
        if let Some(s) = found
            && sooner(s)
        {
            first = Some((s, guard.transition));
        }
    }
    first
}

/// The vector z of a state in the solver's coordinates, its inputs zero.
fn vector<const N: usize>(layout: &Layout, inner: &State) -> [f64; N] {
    let mut z = [0.0; N];
    for body in 0..layout.bodies() {
        (z[layout.coordinate[body]], z[layout.speed[body]]) = (inner.position[body], inner.speed[body]);
    }
    for (place, current) in layout.current.iter().zip(inner.current) {
        if let Some(place) = place {
            z[*place] = current;
        }
    }
    z[N - 1] = 1.0;
    z
}

/// Bounds of |u̇| and |ü| of Σ c_k τᵏ for τ up to `length`.
fn change_rates(coefficients: &[f64], length: f64) -> (f64, f64) {
    let (mut rate, mut curvature) = (0.0, 0.0);
    let (mut power1, mut power2) = (1.0, 1.0);
    for (k, c) in coefficients.iter().enumerate() {
        let order = k as f64;
        if k >= 1 {
            rate += order * c.abs() * power1;
            power1 *= length;
        }
        if k >= 2 {
            curvature += order * (order - 1.0) * c.abs() * power2;
            power2 *= length;
        }
    }
    (rate, curvature)
}

/// Matrices computed so far.
fn propagators<const N: usize>(known: &[Arc<ModeMatrices<N>>]) -> u64 {
    known.iter().map(|matrices| matrices.propagators()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Friction;
    use crate::mechanism::Body;
    use crate::mechanism::testing::{body, spring};

    /// Two bodies of 1 kg with a spring of 1 N/mm between them, each held by 1 N of friction.
    fn pair(elongation: f64, speed: f64) -> Core<8> {
        let held = |number| Body { friction: Friction::symmetric(0.0, 1.0), ..body(number, 1.0) };
        let between = spring(&[(0, 1.0), (1, -1.0)], 1e3);
        let mechanism = Mechanism::new(vec![held(0), held(1)], vec![between], Vec::new());
        let mut start = State::default();
        (start.position[0], start.speed[0]) = (elongation, speed);
        let space = Arc::new(Space::new(&mechanism, 0));
        let mut core = Core::new(Arc::new(mechanism), space, &start, (1e-3, f64::INFINITY), Vec::new());
        core.resolve();
        core
    }

    /// Holds of a length without a matrix were expanded into series at rest, too, which took a third of the time of a
    /// search for limit cycles.
    #[test]
    fn at_rest_nothing_is_expanded() {
        let hold = |core: &mut Core<8>, count: u32| {
            (1..=count).for_each(|k| core.go_on_to(0.37e-3 * f64::from(k), &mut Vec::new()).unwrap());
        };
        let mut rests = pair(0.5e-3, 0.0);
        let before = rests.z.map(f64::to_bits);
        hold(&mut rests, 100);
        assert_eq!(rests.z.map(f64::to_bits), before);
        assert_eq!((rests.room.series.order, rests.common.cost.series), (0, 100));
        assert!((rests.time() - 0.037).abs() < 1e-15);
        let mut slides = pair(0.5e-3, 0.1);
        hold(&mut slides, 1);
        assert!(slides.room.series.order > 0 && slides.z.map(f64::to_bits) != before);
    }
}
