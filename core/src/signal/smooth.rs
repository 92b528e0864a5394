//! Sine, multisine and chirp: polynomials on stretches short enough to be exact to rounding.
//!
//! A sine of angular frequency ω on a stretch of length τ, interpolated at the eight Chebyshev nodes, is wrong by at
//! most (ωτ/2)⁸ / (2⁷ 8!); 26 stretches to a period make that 1.0e-14.

use super::clock::Now;
use super::{DEGREE, Part, Tone, shifted};
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

/// Stretches to the shortest period.
const STRETCHES: f64 = 26.0;

const N: usize = DEGREE + 1;

/// Seams at k/(26 f), f the highest frequency of all tones.
pub(super) fn multisine(now: Now, tones: &[Tone]) -> Part {
    let Some(lattice) = lattice(now, tones) else { return Part::held(mean(tones), f64::INFINITY) };
    let seam = |k: f64| k / lattice;
    let k = now.cell(lattice * now.t, seam);
    let (start, end) = (seam(k), seam(k + 1.0));
    let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
    let mut values = [0.0; N];
    for &Tone { amplitude: a, frequency: f, phase } in tones {
        // u = Σ a sin(θ + ω s), s from the middle of the stretch
        let theta = TAU * turns(f, middle) + phase;
        let omega = TAU * f;
        for (value, x) in values.iter_mut().zip(&nodes().x) {
            *value += a * (theta + omega * (half * x)).sin();
        }
    }
    let mut coefficients = polynomial(&values, half, now.t - middle);
    // A sine that passes through zero where a piece begins, as near as times are told apart, does so to the last bit.
    let rounding = |tone: &Tone| f64::EPSILON * tone.amplitude.abs() * (1.0 + TAU * tone.frequency.abs() * now.t);
    if sum(now, tones).abs() <= tones.iter().map(rounding).sum() {
        coefficients[0] = 0.0;
    }
    Part { end, coefficients }
}

pub(super) fn multisine_value(now: Now, tones: &[Tone]) -> f64 {
    if lattice(now, tones).is_none() {
        return mean(tones);
    }
    sum(now, tones)
}

/// u = Σ a sin(2π f t + φ)
fn sum(now: Now, tones: &[Tone]) -> f64 {
    tones.iter().map(|tone| tone.amplitude * sine(turns(tone.frequency, now.t), tone.phase)).sum::<f64>() + 0.0
}

/// sin(2π x + φ); without a phase exactly zero after every half turn.
fn sine(x: f64, phase: f64) -> f64 {
    if phase != 0.0 {
        return (TAU * x + phase).sin();
    }
    let halves = (2.0 * x).round();
    let rest = (TAU * (x - 0.5 * halves)).sin();
    if halves.rem_euclid(2.0) == 0.0 { rest } else { -rest }
}

/// Stretches per second; None if nothing oscillates, or too fast for the clock.
fn lattice(now: Now, tones: &[Tone]) -> Option<f64> {
    let oscillating = tones.iter().filter(|tone| tone.amplitude != 0.0);
    let lattice = STRETCHES * oscillating.map(|tone| tone.frequency.abs()).fold(0.0, f64::max);
    (lattice > 0.0 && now.resolves(1.0 / lattice)).then_some(lattice)
}

/// The tones of zero frequency, which stand still.
fn mean(tones: &[Tone]) -> f64 {
    tones.iter().filter(|tone| tone.frequency == 0.0).map(|tone| tone.amplitude * tone.phase.sin()).sum::<f64>() + 0.0
}

/// A sine whose frequency goes linearly `from`–`to` in `over`; zero afterwards, and if `over` is not positive.
pub(super) struct Chirp {
    pub amplitude: f64,
    pub from: f64,
    pub to: f64,
    pub over: f64,
}

impl Chirp {
    /// The number of stretches, all of one length; zero if there is nothing, or it is too fast for the clock.
    fn stretches(&self, now: Now) -> f64 {
        let &Self { from, to, over, .. } = self;
        if now.reached(over) || over.is_nan() || !(from.is_finite() && to.is_finite()) {
            return 0.0;
        }
        // Within a stretch of half length h the frequency changes too, by the phase (π (to − from)/over) h², which 89
        // √… keeps below 1e-4, where it adds no more than the 1e-14 above.
        let fast = STRETCHES * from.abs().max(to.abs()) * over;
        let changing = 89.0 * ((to - from).abs() * over).sqrt();
        let n = fast.max(changing).max(1.0).ceil();
        if now.resolves(over / n) { n } else { 0.0 }
    }

    /// Turns since the start, less whole ones: f₁ t + (f₂ − f₁) t²/(2T).
    fn turns(&self, t: f64) -> f64 {
        let &Self { from, to, over, .. } = self;
        let sweep = 0.5 * (to - from) / over;
        let (speed, speed_rest) = product(sweep, t);
        let (swept, swept_rest) = product(speed, t);
        let (steady, steady_rest) = product(from, t);
        (steady - steady.round()) + (swept - swept.round()) + (steady_rest + swept_rest + speed_rest * t)
    }

    pub fn part(&self, now: Now) -> Part {
        let &Self { amplitude: a, from, to, over } = self;
        let n = self.stretches(now);
        if n == 0.0 {
            return Part::held(0.0, f64::INFINITY);
        }
        let seam = |k: f64| if k < n { over * (k / n) } else { over };
        let k = now.cell(now.t / over * n, seam).min(n - 1.0);
        let (start, end) = (seam(k), seam(k + 1.0));
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        // u = a sin(θ + ω s + β s²), s from the middle of the stretch
        let theta = TAU * self.turns(middle);
        let beta = PI * (to - from) / over;
        let omega = TAU * from + 2.0 * beta * middle;
        let values = nodes().x.map(|x| {
            let s = half * x;
            a * (theta + s * (omega + beta * s)).sin()
        });
        let mut coefficients = polynomial(&values, half, now.t - middle);
        if self.value(now).abs() <= f64::EPSILON * a.abs() * (1.0 + (omega.abs() + TAU * from.abs()) * now.t) {
            coefficients[0] = 0.0;
        }
        Part { end, coefficients }
    }

    pub fn value(&self, now: Now) -> f64 {
        if self.stretches(now) == 0.0 { 0.0 } else { self.amplitude * sine(self.turns(now.t), 0.0) + 0.0 }
    }
}

/// a b, rounded, and the error of that.
pub(super) fn product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    (p, a.mul_add(b, -p))
}

/// f t less whole turns, to rounding however many those are.
fn turns(f: f64, t: f64) -> f64 {
    let (turns, rest) = product(f, t);
    (turns - turns.round()) + rest
}

/// The eight Chebyshev nodes on −1..1, and the matrix that takes values there to powers of x.
struct Nodes {
    x: [f64; N],
    powers: [[f64; N]; N],
}

fn nodes() -> &'static Nodes {
    static NODES: OnceLock<Nodes> = OnceLock::new();
    NODES.get_or_init(|| {
        // x_j = cos((2j + 1) π/(2n)), u(x) = Σ_k (2 − δ_k0)/n Σ_j u_j T_k(x_j) T_k(x), T_k(x_j) = cos(k (2j + 1)
        // π/(2n))
        let angle = |j: usize| (2 * j + 1) as f64 * PI / (2 * N) as f64;
        let x = std::array::from_fn(|j| angle(j).cos());
        let mut powers = [[0.0; N]; N];
        // T_k in powers of x: T₀ = 1, T₁ = x, T_k+1 = 2 x T_k − T_k−1
        let mut chebyshev = [[0.0; N]; N];
        chebyshev[0][0] = 1.0;
        chebyshev[1][1] = 1.0;
        for k in 2..N {
            for i in 0..N {
                chebyshev[k][i] = if i > 0 { 2.0 * chebyshev[k - 1][i - 1] } else { 0.0 } - chebyshev[k - 2][i];
            }
        }
        for (k, t) in chebyshev.iter().enumerate() {
            let share = if k == 0 { 1.0 } else { 2.0 } / N as f64;
            for (row, t) in powers.iter_mut().zip(t) {
                for (j, power) in row.iter_mut().enumerate() {
                    *power += share * (k as f64 * angle(j)).cos() * t;
                }
            }
        }
        Nodes { x, powers }
    })
}

/// The polynomial through `values` at the nodes of −`half`..`half`, in powers of the time since `origin` in there.
fn polynomial(values: &[f64; N], half: f64, origin: f64) -> [f64; N] {
    let powers = &nodes().powers;
    let c: [f64; N] = std::array::from_fn(|i| powers[i].iter().zip(values).map(|(p, v)| p * v).sum());
    // Σ c_i xⁱ in powers of x − x₀
    let mut c = shifted(&c, origin / half);
    let mut scale = 1.0;
    for c in &mut c {
        *c *= scale;
        scale /= half;
    }
    c
}
