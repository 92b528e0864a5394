//! One mode made ready for the exact solver: its matrices, its guards, and how fast anything in it can change.

use super::propagator::{Matrix, SERIES_ORDER, SERIES_REACH};
use crate::friction::Motion;
use crate::plant::{Body, Cause, Form, Mode, Plant, ROUNDING, place};
use crate::signal::DEGREE;
use std::cell::OnceCell;

/// Where the input stands behind the states.
const INPUT: usize = place::COUNT;

/// Place of the k-th derivative of the input: the moving ones behind the states, the highest, constant, behind all that moves.
pub(super) const fn chain<const R: usize>(k: usize) -> usize {
    if k < highest::<R>() { INPUT + k } else { R }
}

/// Order of the highest derivative that is carried along: 1 with eight rows, [`DEGREE`] with sixteen.
const fn highest<const R: usize>() -> usize {
    if R == 8 { 1 } else { DEGREE }
}

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
    row: [f64; C],
    /// The norm dual to the energy: how much its value can change per unit of √(2V), mechanical and magnetic.
    dual: Size,
    /// Its coefficient of the input.
    pub(super) input: f64,
    pub(super) cause: Cause,
}

impl<const C: usize> Watch<C> {
    pub(super) fn value(&self, z: &[f64; C]) -> f64 {
        self.row.iter().zip(z).fold(0.0, |sum, (w, z)| sum + w * z)
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
        ROUNDING * self.row.iter().zip(z).fold(0.0, |sum, (w, z)| sum + (w * z).abs())
    }

    /// Its rate of change, `y` being ż.
    pub(super) fn slope<const R: usize>(&self, y: &[f64; R]) -> f64 {
        self.row.iter().zip(y).fold(0.0, |sum, (w, y)| sum + w * y)
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
    rate: Matrix<R, C>,
    steps: Vec<OnceCell<Box<Matrix<R, C>>>>,
    /// Rate at which √V may grow by itself; zero for any motor whose K_e is not negligible against K_t.
    growth: f64,
    radius: f64,
    inertia: [f64; 3],
    stiffness: [f64; 3],
    /// w L of the current's share in V.
    magnetic: f64,
    /// Whether the current moves the drive pulley, and the drive pulley the current.
    coupled: bool,
}

impl<const R: usize, const C: usize> Law<R, C> {
    pub(super) fn new(plant: &Plant, mode: Mode, h: f64) -> Self {
        let stage = plant.stage();
        let motor = &stage.motor;
        let r = stage.pulley_radius;
        let mut equations = plant.equations(mode);
        // What is stuck has no speed, and a span between two stuck bodies does not change: leaving both out of the
        // conditions lets the bounds know it.
        let stuck = mode.motion.map(|motion| motion == Motion::Stuck);
        let at_rest = [stuck[0] && stuck[1], stuck[1] && stuck[2], stuck[2] && stuck[0]];
        for form in equations.guards.iter_mut().map(|guard| &mut guard.form).chain(&mut equations.acceleration) {
            for (speed, stuck) in form.speed.iter_mut().zip(stuck) {
                if stuck {
                    *speed = 0.0;
                }
            }
        }

        let row_of = |form: &Form| {
            let mut row = [0.0; C];
            row[..place::COUNT].copy_from_slice(&form.on_state(r));
            row[INPUT] = form.input;
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
                put(body.speed_place() - 1, &Form::speed(body.index()));
                put(body.speed_place(), &equations.acceleration[body.index()]);
            }
        }
        put(place::CURRENT, &equations.current_rate);
        for k in 0..highest::<R>() {
            rate.set(chain::<R>(k), chain::<R>(k + 1), 1.0);
        }

        // The motor turns e n K_t i φ̇₁ into motion and takes K_e n φ̇₁ i for it: with the weight w = e K_t / K_e on ½ L i²
        // the two cancel in V. Without back-EMF a very large weight leaves next to nothing.
        let e_kt = (equations.acceleration[0].current * equations.inertia[0] / motor.gear_ratio).max(0.0);
        let ke = motor.back_emf_constant;
        let has_current = plant.has_current_state();
        let weight = if e_kt > 0.0 { e_kt / ke.max(1e-6 * motor.torque_constant) } else { 1.0 };
        let magnetic = if has_current { weight * motor.inductance } else { 0.0 };
        let cross = motor.gear_ratio * (e_kt - weight * ke);
        let growth = if e_kt > 0.0 && cross.abs() > 1e-12 * e_kt {
            cross * cross / (4.0 * weight * motor.resistance * equations.inertia[0])
        } else {
            0.0
        };

        let inertia = equations.inertia;
        let stiffness = stage.belt.stiffness;
        // A little more, for the rounding of all that is compared with it.
        let dual = |form: &Form| {
            let mut sum = 0.0;
            for j in 0..3 {
                if !at_rest[j] {
                    sum += form.stretch[j] * form.stretch[j] / stiffness[j];
                }
                sum += form.speed[j] * form.speed[j] / inertia[j];
            }
            let magnetic = if form.current == 0.0 { 0.0 } else { form.current.abs() / magnetic.sqrt() };
            Size { mechanical: sum.sqrt() * (1.0 + 1e-9), magnetic: magnetic * (1.0 + 1e-9) }
        };
        let guards = equations
            .guards
            .iter()
            .map(|guard| Watch {
                row: row_of(&guard.form),
                dual: dual(&guard.form),
                input: guard.form.input,
                cause: guard.cause,
            })
            .collect();
        let push: f64 = (0..3).map(|j| inertia[j] * equations.acceleration[j].input.powi(2)).sum();
        let forcing = (push + magnetic * equations.current_rate.input.powi(2)).sqrt();

        // ‖A‖ in the norm of V, from above: stiffness by its Frobenius norm, then all that damps.
        let arms = [[r, 1.0, 0.0], [0.0, 1.0, r], [r, 0.0, r]];
        let (mut swing, mut damp) = (0.0, 0.0);
        for body in Body::ALL {
            let i = body.index();
            if mode.motion[i] == Motion::Stuck {
                continue;
            }
            for (span, arm) in arms.iter().enumerate() {
                swing += stiffness[span] * arm[i] * arm[i] / inertia[i];
                damp += stage.belt.damping[span] * arm[i] * arm[i] / inertia[i];
            }
            damp += equations.acceleration[i].speed[i].abs();
        }
        if has_current {
            damp += motor.resistance / motor.inductance
                + motor.gear_ratio * (e_kt * ke / (inertia[0] * motor.inductance)).sqrt()
                + growth;
        }
        let speed: f64 = f64::sqrt(swing) + damp;
        let finest = (speed * h / SERIES_REACH).log2().ceil().clamp(0.0, 1000.0) as usize;

        Self {
            mode,
            guards,
            forcing,
            finest,
            h,
            rate,
            steps: (0..=finest).map(|_| OnceCell::new()).collect(),
            growth,
            radius: r,
            inertia,
            stiffness,
            magnetic,
            coupled: has_current && !stuck[0],
        }
    }

    /// ż.
    pub(super) fn rate(&self, z: &[f64; C]) -> [f64; R] {
        self.rate.times(z)
    }

    /// z̈ from ż.
    pub(super) fn rate_of_rate(&self, y: &[f64; R]) -> [f64; R] {
        self.rate.times(&widened(y))
    }

    /// √(2V) of ż.
    pub(super) fn size(&self, y: &[f64; R]) -> Size {
        let r = self.radius;
        let [v1, a1, v2, a2, v3, a3, di] = std::array::from_fn::<f64, { place::COUNT }, _>(|j| y[j]);
        let [m1, m2, m3] = self.inertia;
        let [k1, k2, k3] = self.stiffness;
        let (d1, d2, d3) = (r * v1 - v2, v2 - r * v3, r * v3 - r * v1);
        // 2V = Σ m a² + Σ k (Δv)² + w L (di/dt)²
        let kinetic = m1 * a1 * a1 + m2 * a2 * a2 + m3 * a3 * a3;
        let elastic = k1 * d1 * d1 + k2 * d2 * d2 + k3 * d3 * d3;
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
        self.h * 0.5_f64.powi(level as i32)
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
        let mut terms = [[0.0; C]; SERIES_ORDER + 1];
        terms[0] = *z;
        for k in 1..=SERIES_ORDER {
            let factor = distance / k as f64;
            let next = self.rate.times(&terms[k - 1]);
            for (term, next) in terms[k].iter_mut().zip(next) {
                *term = next * factor;
            }
        }
        terms
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
