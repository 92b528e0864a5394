//! A prepared mode: its matrices, its guards, and bounds of its rates.

mod guards;
mod shown;

use crate::friction::Motion;
use crate::mechanism::{
    BODIES, Cause, DRIVES, Equations, Form, Layout, Mechanism, Mode, ROUNDING, SPRINGS, SpringLaw, State,
};
use crate::signal::DEGREE;
use crate::solve::propagator::{EXPONENTIAL_REACH, Matrix, SERIES_REACH, Series, series_order};
use crate::solve::widest::widest;
use guards::{Beside, LANES, Lanes, Row, Values, side_by_side};
pub(super) use guards::{GuardBuffers, Watch};
pub(super) use shown::Shown;
use std::sync::{Arc, OnceLock};

/// The places of the vector z of the exact solver: the state in the solver's coordinates, the inputs with their
/// derivatives, and a one.
#[derive(Debug, Clone)]
pub(in crate::solve) struct Space {
    pub(in crate::solve) layout: Layout,
    /// Order of the highest input derivative in z: 0 for held inputs, 1 for linear ones, [`DEGREE`] for smooth ones.
    pub(in crate::solve) highest: usize,
}

impl Space {
    /// Matrices for inputs whose pieces have at most this degree.
    pub(in crate::solve) fn new(mechanism: &Mechanism, degree: usize) -> Self {
        Self { layout: Layout::new(mechanism), highest: if degree > 1 { DEGREE } else { degree } }
    }

    /// Required size: states, inputs with their derivatives, and a one.
    pub(in crate::solve) fn size(&self) -> usize {
        self.layout.states + self.layout.inputs * (self.highest + 1) + 1
    }

    /// Place of the k-th derivative of an input.
    #[inline]
    pub(in crate::solve) fn chain(&self, input: usize, k: usize) -> usize {
        self.layout.states + input * (self.highest + 1) + k
    }

    /// The state of `z`, in the solver's coordinates.
    #[inline]
    pub(in crate::solve) fn inner(&self, z: &[f64]) -> State {
        let layout = &self.layout;
        let mut inner = State::default();
        for body in 0..layout.bodies() {
            inner.position[body] = z[layout.coordinate[body]];
            inner.speed[body] = z[layout.speed[body]];
        }
        for (current, place) in inner.current.iter_mut().zip(layout.current) {
            *current = place.map_or(0.0, |place| z[place]);
        }
        inner
    }

    /// Bounds of the derivatives of this order of the inputs in `z`, from now on for `length`: Σ_{k ≥ order} |u⁽ᵏ⁾|
    /// τ^(k − order)/(k − order)!.
    pub(in crate::solve) fn input_bounds(&self, z: &[f64], order: usize, length: f64) -> [f64; DRIVES] {
        let mut bounds = [0.0; DRIVES];
        for (drive, bound) in bounds.iter_mut().enumerate().take(self.layout.inputs) {
            let mut factor = 1.0;
            for k in order..=self.highest {
                *bound += z[self.chain(drive, k)].abs() * factor;
                factor *= length / (k - order + 1) as f64;
            }
        }
        bounds
    }

    /// A form as a row of weights on it.
    pub(super) fn row<const N: usize>(&self, form: &Form) -> [f64; N] {
        let layout = &self.layout;
        let mut row = [0.0; N];
        layout.put(form, &mut row);
        for drive in 0..layout.inputs {
            row[self.chain(drive, 0)] = form.input[drive];
        }
        row[N - 1] = form.constant;
        row
    }

    /// The inputs in it.
    #[inline]
    pub(in crate::solve) fn input(&self, z: &[f64]) -> [f64; DRIVES] {
        let mut input = [0.0; DRIVES];
        for (drive, value) in input.iter_mut().enumerate().take(self.layout.inputs) {
            *value = z[self.chain(drive, 0)];
        }
        input
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// Accepted growth rate, 1/s, for bounds of a part that stores no energy: at least this, and about this fraction per
/// output interval.
const GROWTH: f64 = 20.0;
const GROWTH_PER_INTERVAL: f64 = 0.05;

/// Growth rate for a current without back-EMF.
const GROWTH_OF_CURRENT: f64 = 1e-2;

/// Norm of ż: √(2V), or per unit of it, of the mechanical and the magnetic energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::solve) struct Size {
    mechanical: f64,
    magnetic: f64,
}

impl Size {
    pub(super) const ZERO: Size = Size { mechanical: 0.0, magnetic: 0.0 };

    /// Norm of both parts together.
    fn whole(self) -> f64 {
        (self.mechanical * self.mechanical + self.magnetic * self.magnetic).sqrt()
    }
}

/// True for springs whose two ends are stuck.
fn at_rest(mechanism: &Mechanism, stuck: &[bool; BODIES]) -> [bool; SPRINGS] {
    let mut at_rest = [true; SPRINGS];
    for (at_rest, spring) in at_rest.iter_mut().zip(&mechanism.springs) {
        *at_rest = spring.arms.iter().all(|&(body, _)| stuck[body]);
    }
    at_rest
}

/// The equations of a mode, and A.
fn straight<const N: usize>(mechanism: &Mechanism, space: &Space, mode: &Mode) -> (Equations, Matrix<N, N>) {
    let layout = &space.layout;
    let mut equations = mechanism.equations(*mode);
    // Stuck bodies have no speed, and spans between them do not change; removing both from the guards tightens the
    // bounds.
    let stuck = mode.motion.map(|motion| motion == Motion::Stuck);
    let without_stuck = |form: &mut Form| {
        for (speed, stuck) in form.speed.iter_mut().zip(stuck) {
            if stuck {
                *speed = 0.0;
            }
        }
    };
    equations.guards.iter_mut().map(|guard| &mut guard.form).for_each(without_stuck);
    equations.acceleration.iter_mut().for_each(without_stuck);

    let mut rate = Matrix::zero();
    let put = |rate: &mut Matrix<N, N>, row: usize, form: &Form| {
        for (column, value) in space.row::<N>(form).into_iter().enumerate() {
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
        if let Some(place) = layout.current[drive] {
            put(&mut rate, place, &equations.current_rate[drive]);
        }
        for k in 0..space.highest {
            rate.set(space.chain(drive, k), space.chain(drive, k + 1), 1.0);
        }
    }
    (equations, rate)
}

/// True if errors can grow in a machine with these parts.
pub(super) fn can_grow(mechanism: &Mechanism) -> bool {
    mechanism.springs.iter().any(|spring| match spring.law {
        SpringLaw::Gap { .. } | SpringLaw::Tension { .. } | SpringLaw::Line { .. } => true,
        SpringLaw::TwoSided | SpringLaw::Bounds { .. } | SpringLaw::Angle { .. } | SpringLaw::None => false,
    })
}

/// Magnitude of the terms of the constant accelerations, if errors can grow.
fn crude<const N: usize>(mechanism: &Mechanism, layout: &Layout, mode: &Mode, inertia: &[f64; BODIES]) -> [f64; N] {
    let mut crude = [0.0; N];
    if !can_grow(mechanism) {
        return crude;
    }
    let sizes = mechanism.sizes_of_forces(mode);
    for body in (0..layout.bodies()).filter(|&body| mode.motion[body] != Motion::Stuck) {
        let leader = mechanism.leader(body);
        crude[layout.speed[body]] = mechanism.ratio(body).abs() * sizes[leader] / mechanism.mass(leader, inertia);
    }
    crude
}

/// The equations of one mode, ż = A z, and what follows from them.
pub(in crate::solve) struct ModeMatrices<const N: usize> {
    pub(super) mode: Mode,
    pub(super) guards: Vec<Watch<N>>,
    /// Bodies at rest whose breakaway exceeds their Coulomb friction, each with the index of that guard.
    pub(super) breakaways: Vec<(usize, usize)>,
    /// Guards in groups, for vector instructions.
    beside: Vec<Beside<N>>,
    /// The load on each body without its friction; `None` if a gear with losses changes it at rest.
    load: Option<[Row<N>; BODIES]>,
    /// |b|: growth rate of √(2V) of ż per unit of |u̇|.
    pub(super) forcing: [f64; DRIVES],
    /// A bound of ‖A‖, 1/s, and the part of it that is not mechanical.
    speed: f64,
    other_speed: f64,
    /// Halvings of the interval until a Taylor series gives the state, and until one gives the matrix exponential.
    pub(super) coarsest: usize,
    pub(super) finest: usize,
    h: f64,
    /// A bound of the fastest undamped mode, rad/s.
    pub(super) swing: f64,
    /// Magnitude of the terms of the constant part of ż; zero if errors cannot grow.
    pub(super) crude: [f64; N],
    /// Coordinates of the origin.
    origin: [f64; BODIES],
    rate: Matrix<N, N>,
    steps: Vec<OnceLock<Box<Matrix<N, N>>>>,
    /// Rate at which √V may grow by itself; zero for most machines.
    growth: f64,
    inertia: [f64; BODIES],
    stiffness: [f64; SPRINGS],
    /// Forms whose squared rates sum to the mechanical part of 2V.
    energy: Vec<Lanes<N>>,
    /// Weight of each (di/dt)² in 2V, by the indices of the currents; and true if there is any.
    magnetic: [(usize, f64); DRIVES],
    is_magnetic: bool,
    /// Weight of the current of each drive.
    weight_of_current: [f64; DRIVES],
    /// True if a current and the motion affect each other.
    coupled: bool,
    /// Currents of the drives.
    current: [OnceLock<Row<N>>; DRIVES],
    /// The readings of an observer.
    shown: OnceLock<Box<Shown<N>>>,
}

impl<const N: usize> ModeMatrices<N> {
    /// The matrices of a mode and an interval: known ones, or new ones, which are added; true if they are new.
    pub(super) fn from_known(
        known: &mut Vec<Arc<Self>>,
        mechanism: &Mechanism,
        space: &Space,
        mode: &Mode,
        h: f64,
    ) -> (Arc<Self>, bool) {
        // Origins of one machine differ in the ends of its travel only.
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
        let (equations, rate) = straight::<N>(mechanism, space, mode);
        let stuck = mode.motion.map(|motion| motion == Motion::Stuck);
        let at_rest = at_rest(mechanism, &stuck);
        let row_of = |form: &Form| space.row::<N>(form);

        // The current does g i φ̇ of work, and its own rate is −δ i − β φ̇. With the weight w = g/β on its share ½ w i²
        // in V the two cancel. If β is very small, a large weight leaves almost nothing.
        let inertia = mechanism.balanced_inertia(&equations, mode);
        let (mut magnetic, mut growth, mut decays, mut coupled) = ([0.0; DRIVES], 0.0, 0.0, false);
        for (index, drive) in mechanism.drives.iter().enumerate().filter(|(_, drive)| drive.has_current_state()) {
            let moved: f64 = (0..BODIES).map(|j| inertia[j] * square(equations.acceleration[j].current[index])).sum();
            let moves = equations.acceleration[drive.shaft].current[index];
            let own = &equations.current_rate[index];
            let (decay, back) = (-own.current[index], -own.speed[drive.shaft]);
            magnetic[index] = 1.0;
            let mut exchange = 0.0;
            if moves != 0.0 && decay > 0.0 {
                let g = moved / moves;
                let mass = g / moves;
                // The remaining exchange feeds V at (g − w β)²/(4 w δ m).
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

        // Guarded quantities without a spring are bounded by a small fictitious stiffness κ, which feeds V. So does a
        // line with negative damping c.
        //
        //   V = ½ κ s² + ½ m ṡ²,  m s̈ = −k s − c ṡ:   d√V/dt ≤ (½ |κ − k|/√(κ m) + max(−c, 0)/m) √V,  1/m = Σ arm²/m_j
        let mut stiffness = equations.stiffness;
        for (j, spring) in mechanism.springs.iter().enumerate() {
            let watched = equations.guards.iter().any(|guard| guard.form.stretch[j] != 0.0) && !at_rest[j];
            let lightness: f64 = spring.arms.iter().map(|&(body, arm)| arm * arm / inertia[body]).sum();
            let (slope, damping) = mechanism.slopes_of_line(j, mode);
            if stiffness[j] == 0.0 && watched {
                let own = GROWTH.max(GROWTH_PER_INTERVAL / h);
                stiffness[j] = f64::max(4.0 * own * own / lightness, slope.abs());
                // ½ √(κ/m) without own stiffness
                growth += 0.5 * (stiffness[j] - slope).abs() * (lightness / stiffness[j]).sqrt();
            }
            growth += f64::max(-damping, 0.0) * lightness;
        }

        // Slightly more, for the rounding of everything compared with it.
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
        let mut guards = Vec::with_capacity(equations.guards.len());
        let mut beside = vec![Beside::NONE; equations.guards.len().div_ceil(LANES)];
        for (index, guard) in equations.guards.iter().enumerate() {
            let row = row_of(&guard.form);
            guards.push(Watch::new(&row, guard.transition));
            let (dual, beside, lane) = (dual(&guard.form), &mut beside[index / LANES], index % LANES);
            beside.rows.iter_mut().zip(&row).for_each(|(place, weight)| place[lane] = *weight);
            // Motion and current exchange energy: only their sum is bounded.
            (beside.mechanical[lane], beside.magnetic[lane]) = match coupled {
                true => (dual.whole(), 0.0),
                false => (dual.mechanical, dual.magnetic),
            };
            (0..DRIVES).for_each(|drive| beside.at_once[drive][lane] = guard.form.input[drive].abs());
        }
        let breakaways = guards.iter().enumerate().filter_map(|(index, guard)| {
            let (body, forward) = match guard.transition.cause {
                Cause::BreakForward(body) => (body, true),
                Cause::BreakBackward(body) => (body, false),
                _ => return None,
            };
            let side = mechanism.friction(body).side(forward);
            (side.breakaway > side.coulomb).then_some((index, body))
        });
        let breakaways = breakaways.collect();
        let loses = mechanism.drives.iter().any(|drive| drive.loses());
        let load = (!loses).then(|| {
            let mut load = [Row::NONE; BODIES];
            let bodies = load.iter_mut().zip(&equations.load).take(layout.bodies());
            bodies.for_each(|(row, load)| *row = Row::new(&row_of(load)));
            load
        });
        let forcing = std::array::from_fn(|drive| {
            let push: f64 = (0..BODIES).map(|j| inertia[j] * square(equations.acceleration[j].input[drive])).sum();
            (push + magnetic[drive] * square(equations.current_rate[drive].input[drive])).sqrt()
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
        let halvings = |reach: f64| (speed * h / reach).log2().ceil().clamp(0.0, 1000.0) as usize;
        let (coarsest, finest) = (halvings(SERIES_REACH), halvings(EXPONENTIAL_REACH));

        // 2V = Σ m a² + Σ k ṡ² + Σ w (di/dt)²
        let mut energy: Vec<Lanes<N>> = Vec::with_capacity(2);
        let mut lane = LANES;
        let mut next = |energy: &mut Vec<Lanes<N>>| {
            lane += 1;
            if lane >= LANES {
                energy.push([[0.0; LANES]; N]);
                lane = 0;
            }
            lane
        };
        for body in (0..layout.bodies()).filter(|&body| !stuck[body]) {
            let lane = next(&mut energy);
            energy.last_mut().expect("just begun")[layout.speed[body]][lane] = inertia[body].sqrt();
        }
        for spring in (0..mechanism.springs.len()).filter(|&spring| stiffness[spring] > 0.0 && !at_rest[spring]) {
            let (lane, root) = (next(&mut energy), stiffness[spring].sqrt());
            let forms = energy.last_mut().expect("just begun");
            layout.weights(spring).for_each(|(body, w)| forms[layout.coordinate[body]][lane] = root * w);
        }
        let mut magnetic_places = [(0, 0.0); DRIVES];
        for (drive, place) in magnetic_places.iter_mut().enumerate() {
            *place = layout.current[drive].map_or((0, 0.0), |place| (place, magnetic[drive]));
        }
        Self {
            mode: *mode,
            guards,
            breakaways,
            beside,
            load,
            forcing,
            speed,
            other_speed: growth + decays,
            coarsest,
            finest,
            h,
            swing,
            crude: crude::<N>(mechanism, layout, mode, &equations.inertia),
            origin: mechanism.origin,
            rate,
            steps: (0..=finest).map(|_| OnceLock::new()).collect(),
            growth,
            inertia,
            stiffness,
            energy,
            magnetic: magnetic_places,
            is_magnetic: magnetic_places.iter().any(|(_, weight)| *weight > 0.0),
            weight_of_current: magnetic,
            coupled,
            current: [const { OnceLock::new() }; DRIVES],
            shown: OnceLock::new(),
        }
    }

    /// ż.
    pub(super) fn rate(&self, z: &[f64; N]) -> [f64; N] {
        self.rate.rate(z)
    }

    /// A.
    pub(super) fn rates(&self) -> &Matrix<N, N> {
        &self.rate
    }

    /// A bound of ‖A‖, 1/s.
    pub(super) fn speed(&self) -> f64 {
        self.speed
    }

    /// A closer bound of ‖A‖ in the energy norm, 1/s: the fastest oscillation, from λ ≤ ‖S⁴‖^¼ of the largest
    /// eigenvalue of S = M^−½ K M^−½, plus the Frobenius norm of the damping.
    pub(super) fn norm(&self, mechanism: &Mechanism, layout: &Layout) -> f64 {
        let bodies = mechanism.bodies.len();
        if (0..bodies).any(|body| mechanism.leader(body) != body) {
            return self.speed;
        }
        let (mut stiffness, mut damping) = ([[0.0; BODIES]; BODIES], 0.0);
        let moving = (0..bodies).filter(|&body| self.mode.motion[body] != Motion::Stuck);
        for i in moving.clone() {
            for j in moving.clone() {
                let scale = self.inertia[i] / self.inertia[j];
                let between = |c: usize| {
                    let place = layout.coordinate[c];
                    self.rate.at(layout.speed[i], place) * self.rate.at(place, layout.speed[j])
                };
                stiffness[i][j] = (0..bodies).map(between).sum::<f64>() * scale.sqrt();
                damping += square(self.rate.at(layout.speed[i], layout.speed[j])) * scale;
            }
        }
        let squared = |of: &[[f64; BODIES]; BODIES]| {
            let mut product = [[0.0; BODIES]; BODIES];
            for (row, of_row) in product.iter_mut().zip(of).take(bodies) {
                for (factor, other) in of_row.iter().zip(of).take(bodies) {
                    row.iter_mut().zip(other).take(bodies).for_each(|(sum, other)| *sum += factor * other);
                }
            }
            product
        };
        let fourth = squared(&squared(&stiffness));
        let size: f64 = fourth.as_flattened().iter().map(|entry| entry * entry).sum();
        // ‖S⁴‖^⅛ is a frequency.
        self.speed.min(size.sqrt().sqrt().sqrt().sqrt() + damping.sqrt() + self.other_speed)
    }

    /// Forms whose squared rates sum to 2V.
    pub(super) fn energy_forms(&self) -> impl Iterator<Item = [f64; N]> + '_ {
        let column = |lanes: &Lanes<N>, lane: usize| lanes.map(|weights| weights[lane]);
        let mechanical = self.energy.iter().flat_map(move |lanes| (0..LANES).map(move |lane| column(lanes, lane)));
        let magnetic = self.magnetic.iter().filter(|(_, weight)| *weight > 0.0).map(|&(place, weight)| {
            let mut form = [0.0; N];
            form[place] = weight.sqrt();
            form
        });
        mechanical.filter(|form| *form != [0.0; N]).chain(magnetic)
    }

    /// Largest rate of a guard per unit of √(2V) of ż with constant inputs.
    pub(super) fn dual(&self, guard: usize) -> f64 {
        let beside = &self.beside[guard / LANES];
        beside.mechanical[guard % LANES].hypot(beside.magnetic[guard % LANES])
    }

    widest! {
        /// Evaluates ż, its norm, and the guards into `value` at z; with ż for z, one derivative higher.
        pub(super) fn look(&self, z: &[f64; N], value: &mut Values) -> ([f64; N], Size) = look_by_any, look_by_avx2;
    }

    #[inline(always)]
    fn look_by_any(&self, z: &[f64; N], value: &mut Values) -> ([f64; N], Size) {
        let rate = self.rate.times(z);
        self.values_by_any(z, value);
        (rate, self.size_by_any(&rate))
    }

    widest! {
        /// The values of the guards.
        pub(super) fn values(&self, z: &[f64; N], value: &mut Values) = values_by_any, values_by_avx2;
    }

    #[inline(always)]
    fn values_by_any(&self, z: &[f64; N], value: &mut Values) {
        for (values, lanes) in value.as_chunks_mut().0.iter_mut().zip(&self.beside) {
            *values = side_by_side(&lanes.rows, z);
        }
    }

    widest! {
        /// √(2V) of ż.
        pub(super) fn size(&self, y: &[f64; N]) -> Size = size_by_any, size_by_avx2;
    }

    #[inline(always)]
    fn size_by_any(&self, y: &[f64; N]) -> Size {
        let mut squares = [0.0; LANES];
        for lanes in &self.energy {
            let rates = side_by_side(lanes, y);
            squares.iter_mut().zip(rates).for_each(|(square, rate)| *square += rate * rate);
        }
        let [a, b, c, d, e, f, g, h] = squares;
        let mechanical = f64::sqrt(((a + e) + (b + f)) + ((c + g) + (d + h)));
        if !self.is_magnetic {
            return Size { mechanical, magnetic: 0.0 };
        }
        let magnetic = self.magnetic.iter().fold(0.0, |sum, &(place, weight)| sum + weight * y[place] * y[place]);
        Size { mechanical, magnetic: f64::sqrt(magnetic) }
    }

    /// Largest growth rate of √(2V) of ż while the rates of the inputs are at most `rate`.
    pub(super) fn push(&self, rate: &[f64; DRIVES]) -> f64 {
        self.forcing.iter().zip(rate).fold(0.0, |sum, (forcing, rate)| sum + forcing * rate)
    }

    /// A norm and the contribution of the inputs, split as the weights of forms are.
    #[inline(always)]
    fn parted(&self, size: Size, push: f64) -> (f64, f64) {
        match (self.coupled, self.is_magnetic) {
            (true, _) => (size.whole() + push, 0.0),
            (false, true) => (size.mechanical, size.magnetic + push),
            (false, false) => (size.mechanical + push, size.magnetic),
        }
    }

    /// Largest rates of the guards while ż has at most this norm times `grow`, and the inputs add at most `push` to it
    /// and have at most this rate.
    #[inline]
    pub(super) fn steepness(&self, (size, push): (Size, f64), grow: f64, rate: &[f64; DRIVES], steepness: &mut Values) {
        let (mechanical, magnetic) = self.parted(size, push);
        let (mechanical, magnetic) = (grow * mechanical, grow * magnetic);
        for (steepness, beside) in steepness.as_chunks_mut().0.iter_mut().zip(&self.beside) {
            let mut sum = [0.0; LANES];
            for (lane, sum) in sum.iter_mut().enumerate() {
                *sum = beside.mechanical[lane] * mechanical + beside.magnetic[lane] * magnetic;
            }
            for (at_once, &rate) in beside.at_once.iter().zip(rate).filter(|(_, rate)| **rate > 0.0) {
                sum.iter_mut().zip(at_once).for_each(|(sum, at_once)| *sum += at_once * rate);
            }
            *steepness = sum;
        }
    }

    /// The load on a body without its friction; none with a lossy gear.
    pub(super) fn load(&self, body: usize) -> Option<&Row<N>> {
        self.load.as_ref().map(|load| &load[body])
    }

    /// Current of a drive, prepared at its first use.
    pub(super) fn current(&self, mechanism: &Mechanism, space: &Space, drive: usize) -> &Row<N> {
        self.current[drive].get_or_init(|| Row::new(&space.row(&mechanism.current(drive, &self.mode))))
    }

    /// Length of the intervals of a level: h/2^level.
    pub(super) fn length(&self, level: usize) -> f64 {
        // 2^−level by its exponent.
        let power = if level < 1000 { f64::from_bits((1023 - level as u64) << 52) } else { 0.5_f64.powi(level as i32) };
        self.h * power
    }

    /// Range of a short Taylor series, the unit of short times.
    pub(super) fn reach(&self) -> f64 {
        self.length(self.finest)
    }

    /// Largest step of the longest Taylor series, s.
    pub(super) fn far(&self) -> f64 {
        self.length(self.coarsest)
    }

    /// e^{A h/2^level} − I, computed at its first use.
    pub(super) fn step(&self, level: usize) -> &Matrix<N, N> {
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

    /// The Taylor series of z over `distance`.
    pub(super) fn series(&self, z: &[f64; N], distance: f64, series: &mut Series<N>) {
        self.rate.series(z, distance, series_order(self.speed * distance), series);
    }

    /// The rounding error of ż.
    pub(super) fn noise_of_rate(&self, z: &[f64; N]) -> [f64; N] {
        self.rate.absolute().rate(&z.map(f64::abs)).map(|size| ROUNDING * size)
    }

    /// First coefficient, from `first` on, of a guard along the series from z over `distance` that exceeds rounding;
    /// those before it count as zero. The terms of the series are sums of terms of magnitude |A|ᵏ |z| dᵏ/k!.
    pub(super) fn first_term(
        &self,
        guard: &Watch<N>,
        coefficients: &[f64],
        (z, distance): (&[f64; N], f64),
        first: usize,
    ) -> usize {
        let absolute = self.rate.absolute();
        let mut sizes = z.map(f64::abs);
        for (k, coefficient) in coefficients.iter().enumerate() {
            if k > 0 {
                let factor = distance / k as f64;
                sizes = absolute.rate(&sizes).map(|size| size * factor);
            }
            if k >= first && coefficient.abs() > 2.0 * guard.noise(&sizes) {
                return k;
            }
        }
        coefficients.len()
    }

    /// Factor by which √V can grow within `length`, s.
    pub(super) fn growth_over(&self, length: f64) -> f64 {
        if self.growth == 0.0 { 1.0 } else { (self.growth * length).exp() }
    }

    /// Factor by which the energy norm can grow within [`ModeMatrices::growth_time`].
    pub(super) fn growth_factor(&self) -> f64 {
        if self.growth == 0.0 { 1.0 } else { 2.0 }
    }

    /// Time in which √V without input grows to at most twice its value.
    pub(super) fn growth_time(&self) -> f64 {
        if self.growth == 0.0 { f64::INFINITY } else { 0.69 / self.growth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism::testing::{body, spring};
    use crate::mechanism::{Body, MotionKind};

    /// A cart of 0.4 kg and a pulley of 6e-5 kg m² at 20 mm on a span: ω² = k (1/m + r²/J).
    #[test]
    fn no_vibration_is_faster_than_its_bound() {
        let (mass, inertia, r, stiffness) = (0.4, 6e-5, 0.02, 1e5);
        let pulley = Body { kind: MotionKind::Rotary { radius: r }, ..body(0, inertia) };
        let bodies = vec![pulley, body(1, mass)];
        let mechanism = Mechanism::new(bodies, vec![spring(&[(0, r), (1, -1.0)], stiffness)], Vec::new());
        let space = Space::new(&mechanism, 0);
        let law = ModeMatrices::<16>::new(&mechanism, &space, &Mode::new([Motion::Free; 2]), 1e-3);
        let fastest = (stiffness * (1.0 / mass + r * r / inertia)).sqrt();
        assert!((1.0 - 1e-12..1.5).contains(&(law.swing / fastest)), "{} for {fastest}", law.swing);
    }
}
