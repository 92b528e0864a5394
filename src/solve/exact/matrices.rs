//! One mode made ready: its matrices, its guards, and how fast anything in it can change.

mod shown;

use crate::friction::Motion;
use crate::mechanism::{BODIES, Cause, DRIVES, Form, Layout, Mechanism, Mode, ROUNDING, SPRINGS, State};
use crate::signal::DEGREE;
use crate::solve::propagator::{Matrix, SERIES_ORDER, SERIES_REACH};
pub(super) use shown::Shown;
use std::sync::{Arc, OnceLock};

/// What the vector z of the exact solver holds: the state in the solver's coordinates, the inputs with their derivatives, and a one.
#[derive(Debug, Clone)]
pub(in crate::solve) struct Space {
    pub(in crate::solve) layout: Layout,
    /// Order of the highest derivative of an input that is carried along: 1 for straight inputs, [`DEGREE`] for smooth ones.
    pub(in crate::solve) highest: usize,
}

impl Space {
    pub(in crate::solve) fn new(mechanism: &Mechanism, smooth: bool) -> Self {
        Self { layout: Layout::new(mechanism), highest: if smooth { DEGREE } else { 1 } }
    }

    /// Places of what moves, and of the constants behind it: those that the kernels have to have room for.
    pub(in crate::solve) fn size(&self) -> (usize, usize) {
        (self.layout.states + self.layout.inputs * self.highest, self.layout.inputs + 1)
    }

    /// Place of the k-th derivative of an input in a vector of which `R` places move: the moving ones behind the states, the highest,
    /// constant, behind all that moves.
    #[inline]
    pub(in crate::solve) fn chain<const R: usize>(&self, input: usize, k: usize) -> usize {
        if k < self.highest { self.layout.states + input * self.highest + k } else { R + input }
    }

    /// The state that `z` stands for, in the solver's coordinates.
    #[inline]
    pub(in crate::solve) fn inner(&self, z: &[f64]) -> State {
        let layout = &self.layout;
        let mut inner = State::default();
        for body in 0..layout.bodies() {
            inner.position[body] = z[layout.coordinate[body]];
            inner.speed[body] = z[layout.speed[body]];
        }
        for drive in 0..layout.inputs {
            inner.current[drive] = z[layout.current[drive]];
        }
        inner
    }

    /// A form as a row of weights on it.
    fn row<const R: usize, const C: usize>(&self, form: &Form) -> [f64; C] {
        let layout = &self.layout;
        let mut row = [0.0; C];
        let on = layout.on_coordinates(form);
        for body in 0..layout.bodies() {
            row[layout.coordinate[body]] = on.position[body];
            row[layout.speed[body]] = on.speed[body];
        }
        for drive in 0..layout.inputs {
            row[layout.current[drive]] = on.current[drive];
            row[self.chain::<R>(drive, 0)] = form.input[drive];
        }
        row[C - 1] = form.constant;
        row
    }

    /// The inputs in it.
    #[inline]
    pub(in crate::solve) fn input<const R: usize>(&self, z: &[f64]) -> [f64; DRIVES] {
        let mut input = [0.0; DRIVES];
        for (drive, value) in input.iter_mut().enumerate().take(self.layout.inputs) {
            *value = z[self.chain::<R>(drive, 0)];
        }
        input
    }
}

/// Growth rate, 1/s, that is put up with where a part that stores no energy has to be bounded: at least this, and about
/// this share of an output interval.
const GROWTH: f64 = 20.0;
const GROWTH_PER_INTERVAL: f64 = 0.05;

/// The same for a current that the motion does not act back on.
const GROWTH_OF_CURRENT: f64 = 1e-2;

/// The size of a rate of change: √(2V), or per unit of it, of the mechanical and of the magnetic energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::solve) struct Size {
    mechanical: f64,
    magnetic: f64,
}

impl Size {
    pub(super) const ZERO: Size = Size { mechanical: 0.0, magnetic: 0.0 };
}

/// A condition of the mode on the vector z.
pub(in crate::solve) struct Watch<const C: usize> {
    /// What counts in it: places in z in ascending order, and their weights. Most others are zero.
    places: [usize; C],
    weights: [f64; C],
    /// How many count; and how many of those move.
    count: [usize; 2],
    /// The norm dual to the energy: how much its value can change per unit of √(2V), mechanical and magnetic.
    dual: Size,
    /// The magnitudes of its coefficients of the inputs.
    input: [f64; DRIVES],
    pub(super) cause: Cause,
}

impl<const C: usize> Watch<C> {
    fn new<const R: usize>(row: &[f64; C], dual: Size, input: [f64; DRIVES], cause: Cause) -> Self {
        let (mut places, mut weights, mut count) = ([0; C], [0.0; C], [0; 2]);
        for (place, weight) in row.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            (places[count[0]], weights[count[0]]) = (place, *weight);
            count[0] += 1;
            count[1] += usize::from(place < R);
        }
        Self { places, weights, count, dual, input: input.map(f64::abs), cause }
    }

    /// By how much it changes at once with the inputs, per unit of time in which they change no faster than this.
    pub(super) fn at_once(&self, rate: &[f64; DRIVES]) -> f64 {
        self.input.iter().zip(rate).fold(0.0, |sum, (input, rate)| sum + input * rate)
    }

    /// Σ w_j z_j, in the order of the places.
    #[inline(always)]
    fn sum(&self, count: usize, term: impl Fn(f64, usize) -> f64) -> f64 {
        self.weights.iter().zip(&self.places).take(count).fold(0.0, |sum, (weight, place)| sum + term(*weight, *place))
    }

    pub(super) fn value(&self, z: &[f64; C]) -> f64 {
        self.sum(self.count[0], |weight, place| weight * z[place])
    }

    /// Its value, with what rounding alone may have made negative taken for zero.
    pub(super) fn standing(&self, z: &[f64; C]) -> f64 {
        let value = self.value(z);
        if value < 0.0 && self.is_zero(z) { 0.0 } else { value }
    }

    /// Whether its value is zero but for rounding.
    pub(super) fn is_zero(&self, z: &[f64; C]) -> bool {
        self.value(z).abs() <= 2.0 * self.noise(z)
    }

    /// What rounding may do to its value.
    pub(super) fn noise(&self, z: &[f64; C]) -> f64 {
        self.noise_of(z)
    }

    /// What rounding may do to its value, the parts of z being of these sizes.
    fn noise_of(&self, sizes: &[f64; C]) -> f64 {
        ROUNDING * self.sum(self.count[0], |weight, place| (weight * sizes[place]).abs())
    }

    /// The first coefficient along a series, from `first` on, that is more than rounding; those before it count as zero,
    /// however many there are. `sizes` are those of [`ModeMatrices::sizes`].
    pub(super) fn first_term(&self, coefficients: &[f64], sizes: &[[f64; C]; SERIES_ORDER + 1], first: usize) -> usize {
        let counts = |k: &usize| coefficients[*k].abs() > 2.0 * self.noise_of(&sizes[*k]);
        (first..coefficients.len()).find(counts).unwrap_or(coefficients.len())
    }

    /// Its rate of change, `y` being ż.
    pub(super) fn slope<const R: usize>(&self, y: &[f64; R]) -> f64 {
        self.sum(self.count[1], |weight, place| weight * y[place])
    }
}

/// Coordinates that a length is made of, at most: bodies, less those that stand in others' places.
const MOST_TERMS: usize = 2;

/// The equations of one mode, ż = A z, and what follows from them.
pub(in crate::solve) struct ModeMatrices<const R: usize, const C: usize> {
    pub(super) mode: Mode,
    pub(super) guards: Vec<Watch<C>>,
    /// |b|: how fast √(2V) of ż can grow per unit of |u̇|.
    pub(super) forcing: [f64; DRIVES],
    /// Halvings of the interval until the Taylor series serves.
    pub(super) finest: usize,
    h: f64,
    /// A bound of the fastest undamped swing, rad/s.
    pub(super) swing: f64,
    /// Where ways are counted from.
    origin: [f64; BODIES],
    rate: Matrix<R, C>,
    steps: Vec<OnceLock<Box<Matrix<R, C>>>>,
    /// Rate at which √V may grow by itself; zero for most machines.
    growth: f64,
    inertia: [f64; BODIES],
    stiffness: [f64; SPRINGS],
    /// Inertias, by the places of the speeds that move.
    kinetic: Vec<(usize, f64)>,
    /// Stiffnesses, and what the lengths are in terms of the coordinates: places and weights, those that are not there of no weight.
    elastic: Vec<(f64, [(usize, f64); MOST_TERMS])>,
    /// Weight of each (di/dt)² in 2V, by the places of the currents.
    magnetic: Vec<(usize, f64)>,
    /// The same by the drives.
    weight_of_current: [f64; DRIVES],
    /// Whether a current moves anything, and the motion that current.
    coupled: bool,
    /// What an observer is shown.
    shown: OnceLock<Box<Shown<C>>>,
}

impl<const R: usize, const C: usize> ModeMatrices<R, C> {
    /// Those of a mode and an interval, among those that are known, or new ones, which are added; and whether they are new.
    pub(super) fn of(
        known: &mut Vec<Arc<Self>>,
        mechanism: &Mechanism,
        space: &Space,
        mode: &Mode,
        h: f64,
    ) -> (Arc<Self>, bool) {
        // Of one machine, seen from several places: the ends of its travel are what differs.
        let fits = |known: &&Arc<Self>| known.mode == *mode && known.h == h && known.origin == mechanism.origin;
        if let Some(known) = known.iter().find(fits) {
            return (Arc::clone(known), false);
        }
        let new = Arc::new(Self::new(mechanism, space, mode, h));
        known.push(Arc::clone(&new));
        (new, true)
    }

    fn new(mechanism: &Mechanism, space: &Space, mode: &Mode, h: f64) -> Self {
        let layout = &space.layout;
        let mut equations = mechanism.equations(*mode);
        // What is stuck has no speed, and a span between stuck bodies does not change: leaving both out of the
        // conditions lets the bounds know it.
        let stuck = mode.motion.map(|motion| motion == Motion::Stuck);
        let mut at_rest = [true; SPRINGS];
        for (at_rest, spring) in at_rest.iter_mut().zip(&mechanism.springs) {
            *at_rest = spring.arms.iter().all(|&(body, _)| stuck[body]);
        }
        let without_stuck = |form: &mut Form| {
            for (speed, stuck) in form.speed.iter_mut().zip(stuck) {
                if stuck {
                    *speed = 0.0;
                }
            }
        };
        equations.guards.iter_mut().map(|guard| &mut guard.form).for_each(without_stuck);
        equations.acceleration.iter_mut().for_each(without_stuck);

        let row_of = |form: &Form| space.row::<R, C>(form);
        let mut rate = Matrix::zero();
        let put = |rate: &mut Matrix<R, C>, row: usize, form: &Form| {
            for (column, value) in row_of(form).into_iter().enumerate() {
                rate.set(row, column, value);
            }
        };
        for (body, stuck) in stuck.into_iter().enumerate().take(layout.bodies()) {
            if !stuck {
                put(&mut rate, layout.speed[body], &equations.acceleration[body]);
            }
            let mut way = layout.rate(mechanism, body);
            without_stuck(&mut way);
            put(&mut rate, layout.coordinate[body], &way);
        }
        for drive in 0..layout.inputs {
            put(&mut rate, layout.current[drive], &equations.current_rate[drive]);
            for k in 0..space.highest {
                rate.set(space.chain::<R>(drive, k), space.chain::<R>(drive, k + 1), 1.0);
            }
        }

        // The current does g i φ̇ of work, and its own rate is −δ i − β φ̇. With the weight w = g/β on its share ½ w i² in V the
        // two cancel. Where there is no β to speak of, a large weight leaves next to nothing.
        let inertia = equations.inertia;
        let (mut magnetic, mut growth, mut decays, mut coupled) = ([0.0; DRIVES], 0.0, 0.0, false);
        for (index, drive) in mechanism.drives.iter().enumerate().filter(|(_, drive)| drive.has_current_state()) {
            let moved: f64 = (0..BODIES).map(|j| inertia[j] * equations.acceleration[j].current[index].powi(2)).sum();
            let moves = equations.acceleration[drive.shaft].current[index];
            let own = &equations.current_rate[index];
            let (decay, back) = (-own.current[index], -own.speed[drive.shaft]);
            magnetic[index] = 1.0;
            let mut exchange = 0.0;
            if moves != 0.0 && decay > 0.0 {
                let g = moved / moves;
                let mass = g / moves;
                // What is left of the exchange feeds V at (g − w β)²/(4 w δ m).
                let enough = g * g / (4.0 * GROWTH_OF_CURRENT * decay * mass);
                let weight = if back > 0.0 { f64::min(g / back, enough) } else { enough };
                let left = g - weight * back;
                if left.abs() > 1e-12 * g {
                    growth += left * left / (4.0 * weight * decay * mass);
                }
                exchange = f64::max(g / (weight * mass).sqrt(), back * (weight / mass).sqrt());
                magnetic[index] = weight;
            }
            decays += decay + exchange;
            coupled |= exchange > 0.0 && moves != 0.0;
        }

        // What a condition watches and no spring holds is bounded by a small stiffness κ that is not there: it feeds V, at
        // a rate of ½ √(κ Σ arm²/m).
        let mut stiffness = equations.stiffness;
        for (j, spring) in mechanism.springs.iter().enumerate() {
            let watched = equations.guards.iter().any(|guard| guard.form.stretch[j] != 0.0) && !at_rest[j];
            if stiffness[j] == 0.0 && watched {
                let own = GROWTH.max(GROWTH_PER_INTERVAL / h);
                let lightness: f64 = spring.arms.iter().map(|&(body, arm)| arm * arm / inertia[body]).sum();
                stiffness[j] = 4.0 * own * own / lightness;
                growth += own;
            }
        }

        // A little more, for the rounding of all that is compared with it.
        let dual = |form: &Form| {
            let mut sum = 0.0;
            for j in 0..SPRINGS {
                if form.stretch[j] != 0.0 && !at_rest[j] {
                    sum += form.stretch[j] * form.stretch[j] / stiffness[j];
                }
            }
            for (speed, inertia) in form.speed.iter().zip(inertia).filter(|(speed, _)| **speed != 0.0) {
                sum += speed * speed / inertia;
            }
            let currents = form.current.iter().zip(&magnetic).filter(|(current, _)| **current != 0.0);
            let magnetic = currents.fold(0.0, |sum: f64, (current, weight)| sum.hypot(current.abs() / weight.sqrt()));
            Size { mechanical: sum.sqrt() * (1.0 + 1e-9), magnetic: magnetic * (1.0 + 1e-9) }
        };
        let guards = equations
            .guards
            .iter()
            .map(|guard| Watch::new::<R>(&row_of(&guard.form), dual(&guard.form), guard.form.input, guard.cause))
            .collect();
        let forcing = std::array::from_fn(|drive| {
            let push: f64 = (0..BODIES).map(|j| inertia[j] * equations.acceleration[j].input[drive].powi(2)).sum();
            (push + magnetic[drive] * equations.current_rate[drive].input[drive].powi(2)).sqrt()
        });

        // ‖A‖ in the norm of V, from above: stiffness by its Frobenius norm, then all that damps by its trace.
        let (mut swing, mut damp) = (0.0, growth);
        for (i, form) in equations.acceleration.iter().enumerate() {
            for (stretch, spring) in form.stretch.iter().zip(&mechanism.springs) {
                for &(_, arm) in spring.arms.iter().filter(|(body, _)| *body == i) {
                    swing += (stretch * arm).abs();
                }
            }
            damp += form.speed[i].abs();
        }
        damp += decays;
        let swing = f64::sqrt(swing);
        let speed: f64 = swing + damp;
        let finest = (speed * h / SERIES_REACH).log2().ceil().clamp(0.0, 1000.0) as usize;

        let bodies = 0..layout.bodies();
        let moving = |list: [f64; DRIVES]| (0..layout.inputs).map(move |drive| (drive, list[drive]));
        Self {
            mode: *mode,
            guards,
            forcing,
            finest,
            h,
            swing,
            origin: mechanism.origin,
            rate,
            steps: (0..=finest).map(|_| OnceLock::new()).collect(),
            growth,
            inertia,
            stiffness,
            kinetic: bodies.filter(|&body| !stuck[body]).map(|body| (layout.speed[body], inertia[body])).collect(),
            elastic: (0..mechanism.springs.len())
                .filter(|&spring| stiffness[spring] > 0.0 && !at_rest[spring])
                .map(|spring| {
                    let mut terms = [(0, 0.0); MOST_TERMS];
                    for (term, (body, weight)) in terms.iter_mut().zip(layout.weights(spring)) {
                        *term = (layout.coordinate[body], weight);
                    }
                    (stiffness[spring], terms)
                })
                .collect(),
            magnetic: moving(magnetic)
                .filter(|(_, weight)| *weight > 0.0)
                .map(|(drive, weight)| (layout.current[drive], weight))
                .collect(),
            weight_of_current: magnetic,
            coupled,
            shown: OnceLock::new(),
        }
    }

    /// ż.
    pub(super) fn rate(&self, z: &[f64; C]) -> [f64; R] {
        self.rate.rate(z)
    }

    /// z̈ from ż.
    pub(super) fn rate_of_rate(&self, y: &[f64; R]) -> [f64; R] {
        self.rate.rate(&widened(y))
    }

    /// √(2V) of ż.
    pub(super) fn size(&self, y: &[f64; R]) -> Size {
        // 2V = Σ m a² + Σ k ṡ² + Σ w (di/dt)²
        let kinetic = self.kinetic.iter().fold(0.0, |sum, &(place, mass)| sum + mass * y[place] * y[place]);
        let elastic = self.elastic.iter().fold(0.0, |sum, (stiffness, terms)| {
            let rate = terms.iter().fold(0.0, |sum, &(place, weight)| sum + weight * y[place]);
            sum + stiffness * rate * rate
        });
        let magnetic = self.magnetic.iter().fold(0.0, |sum, &(place, weight)| sum + weight * y[place] * y[place]);
        Size { mechanical: (kinetic + elastic).sqrt(), magnetic: f64::sqrt(magnetic) }
    }

    /// By how much √(2V) of ż can grow in a unit of time while the inputs change no faster than this.
    pub(super) fn push(&self, rate: &[f64; DRIVES]) -> f64 {
        self.forcing.iter().zip(rate).fold(0.0, |sum, (forcing, rate)| sum + forcing * rate)
    }

    /// How fast a guard can change while ż has at most this size, and the input adds at most `push` to it.
    pub(super) fn steepness(&self, guard: &Watch<C>, size: Size, push: f64) -> f64 {
        let dual = guard.dual;
        if self.coupled {
            // Motion and current pass energy to each other: only their sum is bounded.
            return (dual.mechanical * dual.mechanical + dual.magnetic * dual.magnetic).sqrt()
                * ((size.mechanical * size.mechanical + size.magnetic * size.magnetic).sqrt() + push);
        }
        let (moving, magnetic) = if !self.magnetic.is_empty() { (0.0, push) } else { (push, 0.0) };
        dual.mechanical * (size.mechanical + moving) + dual.magnetic * (size.magnetic + magnetic)
    }

    /// Length of the intervals of a level: h/2^level.
    pub(super) fn length(&self, level: usize) -> f64 {
        // 2^−level by its exponent.
        let power = if level < 1000 { f64::from_bits((1023 - level as u64) << 52) } else { 0.5_f64.powi(level as i32) };
        self.h * power
    }

    /// How far the Taylor series reaches.
    pub(super) fn reach(&self) -> f64 {
        self.length(self.finest)
    }

    /// e^{A h/2^level} − I, computed when it is first wanted.
    pub(super) fn step(&self, level: usize) -> &Matrix<R, C> {
        if self.steps[level].get().is_none() {
            let known = (level..=self.finest).find(|&l| self.steps[l].get().is_some());
            let from = known.unwrap_or_else(|| {
                let _ = self.steps[self.finest].set(Box::new(self.rate.exponential(self.reach())));
                self.finest
            });
            for l in (level..from).rev() {
                let doubled = self.steps[l + 1].get().expect("just computed").doubled();
                let _ = self.steps[l].set(Box::new(doubled));
            }
        }
        self.steps[level].get().expect("just computed")
    }

    /// Matrices computed so far.
    pub(super) fn propagators(&self) -> u64 {
        self.steps.iter().filter(|step| step.get().is_some()).count() as u64
    }

    /// Terms of the Taylor series of z over `distance`: z(s · distance) = Σ term_k sᵏ.
    pub(super) fn series(&self, z: &[f64; C], distance: f64) -> [[f64; C]; SERIES_ORDER + 1] {
        self.rate.series(z, distance)
    }

    /// What rounding may do to ż.
    pub(super) fn noise_of_rate(&self, z: &[f64; C]) -> [f64; R] {
        self.rate.absolute().rate(&z.map(f64::abs)).map(|size| ROUNDING * size)
    }

    /// How large the parts are that the terms of this series are sums of: |A|ᵏ |z| dᵏ/k!.
    pub(super) fn sizes(&self, z: &[f64; C], distance: f64) -> [[f64; C]; SERIES_ORDER + 1] {
        self.rate.absolute().series(&z.map(f64::abs), distance)
    }

    /// How much √V may grow by itself within `length`.
    pub(super) fn growth_over(&self, length: f64) -> f64 {
        if self.growth == 0.0 { 1.0 } else { (self.growth * length).exp() }
    }

    /// The same within [`ModeMatrices::growth_time`].
    pub(super) fn growth_factor(&self) -> f64 {
        if self.growth == 0.0 { 1.0 } else { 2.0 }
    }

    /// Time in which √V grows by itself to no more than twice its value.
    pub(super) fn growth_time(&self) -> f64 {
        if self.growth == 0.0 { f64::INFINITY } else { 0.69 / self.growth }
    }
}

/// `y` with zeros where the constants stand.
fn widened<const R: usize, const C: usize>(y: &[f64; R]) -> [f64; C] {
    let mut wide = [0.0; C];
    wide[..R].copy_from_slice(y);
    wide
}
