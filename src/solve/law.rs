//! One mode made ready for the exact solver: its matrices, its guards, and how fast anything in it can change.

mod shown;

use super::propagator::{Matrix, SERIES_ORDER, SERIES_REACH};
use crate::friction::Motion;
use crate::plant::{Body, Cause, Form, Mode, Plant, ROTOR, ROUNDING, SPEEDS, STRETCHES, arms, place};
use crate::signal::DEGREE;
pub(super) use shown::Shown;
use std::cell::OnceCell;
use std::rc::Rc;

/// Number of states: without the rotor's two with eight rows, else all.
pub(super) const fn states<const R: usize>() -> usize {
    if R == 8 { place::ROTOR_ANGLE } else { place::COUNT }
}

/// Place of the k-th derivative of the input: the moving ones behind the states, the highest, constant, behind all that moves.
pub(super) const fn chain<const R: usize>(k: usize) -> usize {
    if k < highest::<R>() { states::<R>() + k } else { R }
}

/// Order of the highest derivative that is carried along: [`DEGREE`] with sixteen rows, 1 with fewer.
pub(super) const fn highest<const R: usize>() -> usize {
    if R == 16 { DEGREE } else { 1 }
}

/// Growth rate, 1/s, that is put up with where a part that stores no energy has to be bounded: at least this, and about
/// this share of an output interval.
const GROWTH: f64 = 20.0;
const GROWTH_PER_INTERVAL: f64 = 0.05;

/// The same for a current that the motion does not act back on.
const GROWTH_OF_CURRENT: f64 = 1e-2;

/// The size of a rate of change: √(2V), or per unit of it, of the mechanical and of the magnetic energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    mechanical: f64,
    magnetic: f64,
}

impl Size {
    pub(super) const ZERO: Size = Size { mechanical: 0.0, magnetic: 0.0 };
}

/// A condition of the mode on the vector z.
pub(super) struct Watch<const C: usize> {
    /// What counts in it: places in z in ascending order, and their weights. Most others are zero.
    places: [usize; C],
    weights: [f64; C],
    /// How many count; and how many of those move.
    count: [usize; 2],
    /// The norm dual to the energy: how much its value can change per unit of √(2V), mechanical and magnetic.
    dual: Size,
    /// Its coefficient of the input.
    pub(super) input: f64,
    pub(super) cause: Cause,
}

impl<const C: usize> Watch<C> {
    fn new<const R: usize>(row: &[f64; C], dual: Size, input: f64, cause: Cause) -> Self {
        let (mut places, mut weights, mut count) = ([0; C], [0.0; C], [0; 2]);
        for (place, weight) in row.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            (places[count[0]], weights[count[0]]) = (place, *weight);
            count[0] += 1;
            count[1] += usize::from(place < R);
        }
        Self { places, weights, count, dual, input, cause }
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
    /// however many there are. `sizes` are those of [`Law::sizes`].
    pub(super) fn first_term(&self, coefficients: &[f64], sizes: &[[f64; C]; SERIES_ORDER + 1], first: usize) -> usize {
        let counts = |k: &usize| coefficients[*k].abs() > 2.0 * self.noise_of(&sizes[*k]);
        (first..coefficients.len()).find(counts).unwrap_or(coefficients.len())
    }

    /// Its rate of change, `y` being ż.
    pub(super) fn slope<const R: usize>(&self, y: &[f64; R]) -> f64 {
        self.sum(self.count[1], |weight, place| weight * y[place])
    }
}

/// The equations of one mode, ż = A z, and what follows from them.
pub(super) struct Law<const R: usize, const C: usize> {
    pub(super) mode: Mode,
    pub(super) guards: Vec<Watch<C>>,
    /// |b|: how fast √(2V) of ż can grow per unit of |u̇|.
    pub(super) forcing: f64,
    /// Halvings of the interval until the Taylor series serves.
    pub(super) finest: usize,
    h: f64,
    /// A bound of the fastest undamped swing, rad/s.
    pub(super) swing: f64,
    /// Ends of the travel, m.
    ends: Option<[f64; 2]>,
    rate: Matrix<R, C>,
    steps: Vec<OnceCell<Box<Matrix<R, C>>>>,
    /// Rate at which √V may grow by itself; zero for most machines.
    growth: f64,
    inertia: [f64; SPEEDS],
    stiffness: [f64; STRETCHES],
    /// Weight of (di/dt)² in 2V.
    magnetic: f64,
    /// Whether the current moves anything, or anything the current.
    coupled: bool,
    /// What an observer is shown.
    shown: OnceCell<Box<Shown>>,
}

impl<const R: usize, const C: usize> Law<R, C> {
    /// That of a mode and an interval, among those that are known, or a new one, which is added; and whether it is new.
    pub(super) fn of(known: &mut Vec<Rc<Self>>, plant: &Plant, mode: Mode, h: f64) -> (Rc<Self>, bool) {
        // Of one stage, seen from several places: the ends of the travel are what differs.
        let ends = plant.stage().travel.map(|travel| [travel.min, travel.max]);
        if let Some(law) = known.iter().find(|law| law.mode == mode && law.h == h && law.ends == ends) {
            return (Rc::clone(law), false);
        }
        let law = Rc::new(Self::new(plant, mode, h));
        known.push(Rc::clone(&law));
        (law, true)
    }

    fn new(plant: &Plant, mode: Mode, h: f64) -> Self {
        let r = plant.stage().pulley_radius;
        let mut equations = plant.equations(mode);
        // What is stuck has no speed, and a span between two stuck bodies does not change: leaving both out of the
        // conditions lets the bounds know it.
        let stuck = mode.motion.map(|motion| motion == Motion::Stuck);
        let at_rest = [stuck[0] && stuck[1], stuck[1] && stuck[2], stuck[2] && stuck[0], false, stuck[1]];
        for form in equations.guards.iter_mut().map(|guard| &mut guard.form).chain(&mut equations.acceleration) {
            for (speed, stuck) in form.speed.iter_mut().zip(stuck) {
                if stuck {
                    *speed = 0.0;
                }
            }
        }

        let row_of = |form: &Form| {
            let mut row = [0.0; C];
            row[..states::<R>()].copy_from_slice(&form.on_stretches()[..states::<R>()]);
            row[chain::<R>(0)] = form.input;
            row[C - 1] = form.constant;
            row
        };
        let mut rate = Matrix::zero();
        let mut put = |row: usize, form: &Form| {
            for (column, value) in row_of(form).into_iter().enumerate() {
                rate.set(row, column, value);
            }
        };
        for body in Body::ALL {
            if mode.motion[body.index()] != Motion::Stuck {
                put(body.speed_place(), &equations.acceleration[body.index()]);
            }
        }
        let [d1, d2, twist] = plant.stretch_rates(&mode);
        put(place::DRIVE_ANGLE, &d1);
        put(place::IDLER_ANGLE, &d2);
        if mode.motion[Body::Cart.index()] != Motion::Stuck {
            put(place::CART_POSITION, &Form::speed(Body::Cart.index()));
        }
        if plant.has_rotor() {
            put(place::ROTOR_ANGLE, &twist);
            put(place::ROTOR_SPEED, &equations.acceleration[ROTOR]);
        }
        put(place::CURRENT, &equations.current_rate);
        for k in 0..highest::<R>() {
            rate.set(chain::<R>(k), chain::<R>(k + 1), 1.0);
        }

        // The current does g i φ̇ of work, and its own rate is −δ i − β φ̇. With the weight w = g/β on its share ½ w i² in V the
        // two cancel. Where there is no β to speak of, a large weight leaves next to nothing.
        let inertia = equations.inertia;
        let shaft = if plant.has_rotor() { ROTOR } else { 0 };
        let moved: f64 = (0..SPEEDS).map(|j| inertia[j] * equations.acceleration[j].current.powi(2)).sum();
        let moves = equations.acceleration[shaft].current;
        let has_current = plant.has_current_state();
        let (decay, back) = (-equations.current_rate.current, -equations.current_rate.speed[shaft]);
        let (mut magnetic, mut growth, mut exchange) = (if has_current { 1.0 } else { 0.0 }, 0.0, 0.0);
        if has_current && moves != 0.0 && decay > 0.0 {
            let g = moved / moves;
            let mass = g / moves;
            // What is left of the exchange feeds V at (g − w β)²/(4 w δ m).
            let enough = g * g / (4.0 * GROWTH_OF_CURRENT * decay * mass);
            magnetic = if back > 0.0 { f64::min(g / back, enough) } else { enough };
            let left = g - magnetic * back;
            growth = if left.abs() > 1e-12 * g { left * left / (4.0 * magnetic * decay * mass) } else { 0.0 };
            exchange = f64::max(g / (magnetic * mass).sqrt(), back * (magnetic / mass).sqrt());
        }

        // What a condition watches and no spring holds is bounded by a small stiffness κ that is not there: it feeds V, at
        // a rate of ½ √(κ Σ arm²/m).
        let arms = arms(r);
        let mut stiffness = equations.stiffness;
        for (j, stiffness) in stiffness.iter_mut().enumerate() {
            let watched = equations.guards.iter().any(|guard| guard.form.stretch[j] != 0.0) && !at_rest[j];
            if *stiffness == 0.0 && watched {
                let own = GROWTH.max(GROWTH_PER_INTERVAL / h);
                let lightness: f64 =
                    (0..SPEEDS).filter(|&i| arms[j][i] != 0.0).map(|i| arms[j][i] * arms[j][i] / inertia[i]).sum();
                *stiffness = 4.0 * own * own / lightness;
                growth += own;
            }
        }

        // A little more, for the rounding of all that is compared with it.
        let dual = |form: &Form| {
            let mut sum = 0.0;
            for j in 0..STRETCHES {
                if form.stretch[j] != 0.0 && !at_rest[j] {
                    sum += form.stretch[j] * form.stretch[j] / stiffness[j];
                }
            }
            for (speed, inertia) in form.speed.iter().zip(inertia).filter(|(speed, _)| **speed != 0.0) {
                sum += speed * speed / inertia;
            }
            let magnetic = if form.current == 0.0 { 0.0 } else { form.current.abs() / magnetic.sqrt() };
            Size { mechanical: sum.sqrt() * (1.0 + 1e-9), magnetic: magnetic * (1.0 + 1e-9) }
        };
        let guards = equations
            .guards
            .iter()
            .map(|guard| Watch::new::<R>(&row_of(&guard.form), dual(&guard.form), guard.form.input, guard.cause))
            .collect();
        let push: f64 = (0..SPEEDS).map(|j| inertia[j] * equations.acceleration[j].input.powi(2)).sum();
        let forcing = (push + magnetic * equations.current_rate.input.powi(2)).sqrt();

        // ‖A‖ in the norm of V, from above: stiffness by its Frobenius norm, then all that damps by its trace.
        let (mut swing, mut damp) = (0.0, growth);
        for (i, form) in equations.acceleration.iter().enumerate() {
            for (stretch, arm) in form.stretch.iter().zip(&arms) {
                swing += (stretch * arm[i]).abs();
            }
            damp += form.speed[i].abs();
        }
        if has_current {
            damp += decay + exchange;
        }
        let swing = f64::sqrt(swing);
        let speed: f64 = swing + damp;
        let finest = (speed * h / SERIES_REACH).log2().ceil().clamp(0.0, 1000.0) as usize;

        Self {
            mode,
            guards,
            forcing,
            finest,
            h,
            swing,
            ends: plant.stage().travel.map(|travel| [travel.min, travel.max]),
            rate,
            steps: (0..=finest).map(|_| OnceCell::new()).collect(),
            growth,
            inertia,
            stiffness,
            magnetic,
            coupled: exchange > 0.0 && equations.acceleration[shaft].current != 0.0,
            shown: OnceCell::new(),
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
        let [d1, a1, v2, a2, d2, a3, di] = std::array::from_fn::<f64, 7, _>(|j| y[j]);
        let [m1, m2, m3, rotor] = self.inertia;
        let [k1, k2, k3, gear, position] = self.stiffness;
        let d3 = d1 + d2;
        // 2V = Σ m a² + Σ k (Δv)² + w (di/dt)²
        let mut kinetic = m1 * a1 * a1 + m2 * a2 * a2 + m3 * a3 * a3;
        let mut elastic = k1 * d1 * d1 + k2 * d2 * d2 + k3 * d3 * d3 + position * v2 * v2;
        if states::<R>() == place::COUNT {
            let (twist, a) = (y[place::ROTOR_ANGLE], y[place::ROTOR_SPEED]);
            kinetic += rotor * a * a;
            elastic += gear * twist * twist;
        }
        Size { mechanical: (kinetic + elastic).sqrt(), magnetic: (self.magnetic * di * di).sqrt() }
    }

    /// How fast a guard can change while ż has at most this size, and the input adds at most `push` to it.
    pub(super) fn steepness(&self, guard: &Watch<C>, size: Size, push: f64) -> f64 {
        let dual = guard.dual;
        if self.coupled {
            // Motion and current pass energy to each other: only their sum is bounded.
            return (dual.mechanical * dual.mechanical + dual.magnetic * dual.magnetic).sqrt()
                * ((size.mechanical * size.mechanical + size.magnetic * size.magnetic).sqrt() + push);
        }
        let (moving, magnetic) = if self.magnetic > 0.0 { (0.0, push) } else { (push, 0.0) };
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

    /// The same within [`Law::growth_time`].
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
