//! Forces that are no straight lines, as Taylor series of what they depend on: friction curves, bristles, spans that
//! follow the cart.
//!
//! Each is a place behind the states. Its series comes term by term from those of the states, by the recurrences of
//! products, quotients, e^y (k E_k = Σ j y_j E_{k−j}) and tanh (T′ = N y′, N′ = −2 T N y′, N = 1 − T²).

use crate::double::{Double, ROUNDING};
use crate::machine::{BODIES, SPANS, STATES};
use crate::terms::{ORDER, PLACES, Terms};

/// Place of the curved part of the friction of each body.
pub const FRICTION: [usize; BODIES] = [STATES, STATES + 1, STATES + 2, STATES + 3, STATES + 4];
/// Place of the force of each span that follows, k(x) s.
pub const SPAN: [usize; SPANS] = {
    let behind = STATES + BODIES;
    [behind, behind + 1, behind + 2, behind + 3, behind + 4, behind + 5]
};

/// A straight line of a position: value + slope · state.
#[derive(Debug, Clone, Copy)]
pub struct Ramp {
    /// At position zero.
    pub value: Double,
    /// Per position.
    pub slope: Double,
    /// The position.
    pub way: usize,
}

/// Kinds of curves.
#[derive(Debug, Clone)]
pub enum CurveKind {
    /// (F_b − F_c) e^{−q²}, or e^{−q}: what a Stribeck curve has beyond F_c.
    Stribeck {
        /// F_b − F_c.
        above: Double,
        /// v_s.
        velocity: Double,
        /// True if the exponent is a square.
        is_gaussian: bool,
    },
    /// √e (F_b − F_c) w e^{−w²/2} + F_c tanh 10 w, w = v/v_b: the law that never sticks.
    Smooth {
        /// F_b − F_c.
        above: Double,
        /// F_c.
        coulomb: Double,
        /// v_b.
        velocity: Double,
    },
    /// σ₀ abs(v) z/(F_c + (F_b − F_c) e^{−(v/v_s)²}).
    Bristles {
        /// F_b − F_c.
        above: Double,
        /// F_c.
        coulomb: Double,
        /// v_s.
        velocity: Double,
        /// σ₀.
        stiffness: Double,
        /// Place of z.
        bristle: usize,
    },
    /// E A s/l.
    Span {
        /// E A.
        rigidity: Double,
        /// Length where all positions are zero.
        length: Double,
        /// Its change with positions.
        of: Vec<(usize, f64)>,
        /// The elongation by positions.
        arms: Vec<(usize, f64)>,
    },
}

/// A force that is no straight line.
#[derive(Debug, Clone)]
pub struct Curved {
    /// Where its series stands.
    pub place: usize,
    /// Place of the speed, and 1 or −1: the law is that of their product.
    pub speed: (usize, f64),
    /// Factor that changes along the travel.
    pub along: Option<Ramp>,
    /// Its kind.
    pub kind: CurveKind,
}

/// y of a tail at a speed and its change over a step, both as multiples of the curve's velocity.
type Tail = fn(f64, f64) -> [f64; 2];

/// A series by its terms.
type Sequence = [Double; ORDER + 1];

/// Series under way.
pub struct Work {
    q: Sequence,
    y: Sequence,
    e: Sequence,
    t: Sequence,
    n: Sequence,
    p: Sequence,
    g: Sequence,
    own: Sequence,
}

impl Default for Work {
    /// Without a term yet.
    fn default() -> Self {
        let zero = [Double::ZERO; ORDER + 1];
        Self { q: zero, y: zero, e: zero, t: zero, n: zero, p: zero, g: zero, own: zero }
    }
}

/// Term k of a product.
fn product(a: &Sequence, b: &Sequence, k: usize) -> Double {
    (0..=k).fold(Double::ZERO, |sum, j| sum + a[j] * b[k - j])
}

/// Term k of e^y.
fn exponential(e: &Sequence, y: &Sequence, k: usize) -> Double {
    if k == 0 {
        return y[0].exp();
    }
    let sum = (1..=k).fold(Double::ZERO, |sum, j| sum + y[j] * e[k - j] * j as f64);
    sum / Double::from(k as f64)
}

/// Term k of a/b, b's terms up to k known.
fn quotient(a: Double, own: &Sequence, b: &Sequence, k: usize) -> Double {
    let rest = (1..=k).fold(a, |sum, j| sum - b[j] * own[k - j]);
    rest / b[0]
}

impl Curved {
    /// A force that it may reach, for judging what is small.
    pub fn scale(&self) -> f64 {
        let size = match &self.kind {
            CurveKind::Stribeck { above, .. } => above.high,
            CurveKind::Smooth { above, coulomb, .. } => above.high + coulomb.high,
            CurveKind::Bristles { velocity, .. } => velocity.high,
            CurveKind::Span { .. } => 0.0,
        };
        size.abs()
    }

    /// Term k of its series, those of the states up to k known.
    pub fn term(&self, k: usize, terms: &Terms, w: &mut Work) -> Double {
        let (speed, sign) = self.speed;
        let ramp = |k: usize| match (self.along, k) {
            (None, 0) => Double::ONE,
            (None, _) => Double::ZERO,
            (Some(ramp), 0) => ramp.value + ramp.slope * terms[0][ramp.way],
            (Some(ramp), k) => ramp.slope * terms[k][ramp.way],
        };
        match &self.kind {
            CurveKind::Stribeck { above, velocity, is_gaussian } => {
                w.q[k] = terms[k][speed] * sign / *velocity;
                w.y[k] = if *is_gaussian { -product(&w.q, &w.q, k) } else { -w.q[k] };
                w.e[k] = exponential(&w.e, &w.y, k);
                w.g[k] = ramp(k);
                *above * if self.along.is_some() { product(&w.g, &w.e, k) } else { w.e[k] }
            }
            CurveKind::Smooth { above, coulomb, velocity } => {
                w.q[k] = terms[k][speed] * sign / *velocity;
                w.y[k] = product(&w.q, &w.q, k) * -0.5;
                w.e[k] = exponential(&w.e, &w.y, k);
                // T′ = 10 N w′, N′ = −20 T N w′: N keeps its digits where T rounds to ±1.
                if k == 0 {
                    let y = w.q[0] * 10.0;
                    (w.t[0], w.n[0]) = (y.tanh(), y.square_of_sech());
                } else {
                    let by_speed = |of: &Sequence, factor: f64| {
                        let sum = (1..=k).fold(Double::ZERO, |sum, j| sum + w.q[j] * of[k - j] * (factor * j as f64));
                        sum / Double::from(k as f64)
                    };
                    (w.t[k], w.n[k]) = (by_speed(&w.n, 10.0), by_speed(&w.p, -20.0));
                }
                w.p[k] = product(&w.t, &w.n, k);
                let root = Double::from(0.5).exp();
                w.own[k] = *above * root * product(&w.q, &w.e, k) + *coulomb * w.t[k];
                w.g[k] = ramp(k);
                if self.along.is_some() { product(&w.g, &w.own, k) } else { w.own[k] }
            }
            CurveKind::Bristles { above, coulomb, velocity, stiffness, bristle } => {
                w.q[k] = terms[k][speed] * sign / *velocity;
                w.y[k] = -product(&w.q, &w.q, k);
                w.e[k] = exponential(&w.e, &w.y, k);
                w.t[k] = *above * w.e[k] + if k == 0 { *coulomb } else { Double::ZERO };
                w.n[k] = ramp(k);
                w.g[k] = if self.along.is_some() { product(&w.n, &w.t, k) } else { w.t[k] };
                let numerator = (0..=k).fold(Double::ZERO, |sum, j| sum + terms[j][speed] * terms[k - j][*bristle]);
                w.own[k] = quotient(numerator * *stiffness * sign, &w.own, &w.g, k);
                w.own[k]
            }
            CurveKind::Span { rigidity, length, of, arms } => {
                let start = if k == 0 { *length } else { Double::ZERO };
                w.g[k] = of.iter().fold(start, |sum, &(place, change)| sum + terms[k][place] * change);
                let elongation = arms.iter().fold(Double::ZERO, |sum, &(place, arm)| sum + terms[k][place] * arm);
                w.own[k] = quotient(elongation * *rigidity, &w.own, &w.g, k);
                w.own[k]
            }
        }
    }

    /// The part of a step, from `z` with these largest changes of the states, on which the terms of the series show
    /// what the curve does.
    ///
    /// The tail of a curve is e^{−y} with y = q², q or 2 abs(10 w). Far out, terms up to order 32 of a long step are
    /// too small to be noticed although the tail rises to 1 within it. The terms (Δy)ᵏ/k! fall from k = Δy on, so
    /// Δy ≤ 24 leaves nothing unnoticed, nor does Δy ≤ y/4 with y > 96: e^{−3y/4} is below rounding.
    pub fn part(&self, z: &[Double; PLACES], change: &[f64; PLACES]) -> f64 {
        let (velocity, of_tail): (&Double, Tail) = match &self.kind {
            CurveKind::Stribeck { velocity, is_gaussian: false, .. } => (velocity, |q, d| [q, d]),
            CurveKind::Stribeck { velocity, .. } | CurveKind::Bristles { velocity, .. } => {
                (velocity, |q, d| [q * q, d * (2.0 * q + d)])
            }
            // The tail of e^{−w²/2} is flatter for w < 40, and e^{−800} is zero.
            CurveKind::Smooth { velocity, .. } => (velocity, |w, d| [20.0 * w, 20.0 * d]),
            CurveKind::Span { .. } => return 1.0,
        };
        let (speed, _) = self.speed;
        let [y, swing] = of_tail(z[speed].high.abs() / velocity.high, change[speed] / velocity.high);
        let most = f64::max(24.0, 0.25 * y);
        if swing > most { most / swing } else { 1.0 }
    }

    /// About how much it changes with each state it depends on, and the rounding of its own value.
    pub fn slopes(&self, z: &[Double; PLACES]) -> (Vec<(usize, f64)>, f64) {
        let (speed, sign) = self.speed;
        let v = z[speed].high * sign;
        let (factor, steep) = match self.along {
            None => (1.0, None),
            Some(Ramp { value, slope, way }) => (value.high + slope.high * z[way].high, Some((way, slope.high.abs()))),
        };
        let along = |size: f64| steep.map(|(way, slope)| (way, slope * size));
        let mut slopes = Vec::new();
        match &self.kind {
            CurveKind::Stribeck { above, velocity, is_gaussian } => {
                let (above, q) = (above.high * factor, v / velocity.high);
                let (e, turn) =
                    if *is_gaussian { ((-q * q).exp(), 2.0 * q.abs()) } else { ((-q).min(700.0).exp(), 1.0) };
                slopes.push((speed, above * e * turn / velocity.high));
                slopes.extend(along(above * e));
                return (slopes, 16.0 * ROUNDING * above * e);
            }
            CurveKind::Smooth { above, coulomb, velocity } => {
                slopes.push((speed, factor * (1.7 * above.high + 10.0 * coulomb.high) / velocity.high));
                slopes.extend(along(above.high + coulomb.high));
            }
            CurveKind::Bristles { above, coulomb, velocity, stiffness, bristle } => {
                let q = v / velocity.high;
                let g = factor * (coulomb.high + above.high * (-q * q).exp());
                let rate = stiffness.high * v.abs() / g;
                let own = stiffness.high * z[*bristle].high.abs() / g;
                slopes.push((*bristle, rate));
                slopes.push((speed, own * (1.0 + 2.0 * q * q * above.high * factor / g)));
                slopes.extend(along(own * v.abs() / factor));
            }
            CurveKind::Span { rigidity, length, of, arms } => {
                let l = of.iter().fold(length.high, |sum, &(place, change)| sum + z[place].high * change);
                let s = arms.iter().fold(0.0, |sum, &(place, arm)| sum + z[place].high * arm);
                slopes.extend(arms.iter().map(|&(place, arm)| (place, (arm * rigidity.high / l).abs())));
                slopes.extend(of.iter().map(|&(place, change)| (place, (change * rigidity.high * s / (l * l)).abs())));
            }
        }
        (slopes, 16.0 * ROUNDING * z[self.place].high.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{BRISTLE, SPEED, WAY};
    use crate::terms::Terms;

    fn double(value: f64) -> Double {
        Double::from(value)
    }

    /// The sum of a series at s is the law of the sums of what it depends on.
    fn sums(curved: &Curved, law: impl Fn(&dyn Fn(usize) -> Double) -> Double) {
        let mut terms: Terms = [[Double::ZERO; PLACES]; ORDER + 1];
        for (place, c) in [
            (WAY[1], [0.2, 0.1, -0.05]),
            (WAY[0], [-0.1, 0.03, 0.01]),
            (SPEED[1], [0.7, -0.2, 0.1]),
            (BRISTLE[1], [0.3, 0.1, 0.2]),
        ] {
            c.iter().enumerate().for_each(|(k, c)| terms[k][place] = double(*c));
        }
        let mut work = Work::default();
        let own: Vec<Double> = (0..=ORDER).map(|k| curved.term(k, &terms, &mut work)).collect();
        let s = double(0.1);
        let sum = own.iter().rev().fold(Double::ZERO, |sum, c| sum * s + *c);
        let at = |place: usize| terms.iter().rev().fold(Double::ZERO, |sum, term| sum * s + term[place]);
        let rest = sum - law(&at);
        assert!(rest.high.abs() < 1e-24 * sum.high.abs(), "{:?}: {rest:?} of {sum:?}", curved.kind);
    }

    #[test]
    fn series_are_the_laws_they_stand_for() {
        let along = Ramp { value: double(0.9), slope: double(0.4), way: WAY[1] };
        let a = |at: &dyn Fn(usize) -> Double| along.value + along.slope * at(WAY[1]);
        let [above, coulomb, velocity] = [0.4, 1.3, 0.8].map(double);
        let curved = |kind| Curved { place: FRICTION[1], speed: (SPEED[1], 1.0), along: Some(along), kind };
        for is_gaussian in [true, false] {
            let kind = CurveKind::Stribeck { above, velocity, is_gaussian };
            sums(&curved(kind), |at| {
                let q = at(SPEED[1]) / velocity;
                above * a(at) * (if is_gaussian { -(q * q) } else { -q }).exp()
            });
        }
        sums(&curved(CurveKind::Smooth { above, coulomb, velocity: double(5.0) }), |at| {
            let w = at(SPEED[1]) / double(5.0);
            let hump = double(0.5).exp() * above * w * (w * w * -0.5).exp();
            a(at) * (hump + coulomb * (w * 10.0).tanh())
        });
        let stiffness = double(70.0);
        sums(&curved(CurveKind::Bristles { above, coulomb, velocity, stiffness, bristle: BRISTLE[1] }), |at| {
            let q = at(SPEED[1]) / velocity;
            let g = a(at) * (coulomb + above * (-(q * q)).exp());
            stiffness * at(SPEED[1]) * at(BRISTLE[1]) / g
        });
        let kind = CurveKind::Span {
            rigidity: double(900.0),
            length: double(1.7),
            of: vec![(WAY[1], -1.0)],
            arms: vec![(WAY[0], 1.0), (WAY[1], -1.0)],
        };
        sums(&Curved { place: SPAN[0], speed: (0, 1.0), along: None, kind }, |at| {
            double(900.0) * (at(WAY[0]) - at(WAY[1])) / (double(1.7) - at(WAY[1]))
        });
    }

    /// Where tanh rounds to 1 its series was constant, and a step of the solver missed the steep part.
    #[test]
    fn a_series_of_tanh_is_not_constant_where_tanh_rounds_to_one() {
        let [above, coulomb, velocity] = [0.4, 1.3, 0.8].map(double);
        let kind = CurveKind::Smooth { above, coulomb, velocity };
        let curved = Curved { place: FRICTION[1], speed: (SPEED[1], 1.0), along: None, kind };
        let mut terms: Terms = [[Double::ZERO; PLACES]; ORDER + 1];
        // 10 w = 45 − 50 s
        (terms[0][SPEED[1]], terms[1][SPEED[1]]) = (velocity * 4.5, velocity * -5.0);
        let mut work = Work::default();
        let own: Vec<Double> = (0..=ORDER).map(|k| curved.term(k, &terms, &mut work)).collect();
        // 1 − tanh y = 2 e^{−2y} but for e^{−4y}: term k of tanh is −2 e^{−90} 100ᵏ/k!
        let mut expected = double(-90.0).exp() * -2.0 * coulomb;
        let hump = |k: usize| {
            let root = double(0.5).exp();
            above * root * product(&work.q, &work.e, k)
        };
        for (k, term) in own.iter().enumerate().skip(1) {
            expected = expected * 100.0 / double(k as f64);
            let rest = *term - hump(k) - expected;
            let size = expected.high.abs().max(hump(k).high.abs());
            assert!(rest.high.abs() < 1e-14 * size, "term {k}: {:?} instead of {expected:?}", *term - hump(k));
        }
    }

    /// A step from far out in the tail of a curve ends before the curve rises.
    #[test]
    fn steps_do_not_cross_a_curve_from_far_out() {
        let [above, coulomb, velocity] = [0.4, 1.3, 1.0].map(double);
        for (kind, far) in [
            (CurveKind::Stribeck { above, velocity, is_gaussian: false }, 300.0),
            (CurveKind::Stribeck { above, velocity, is_gaussian: true }, 20.0),
            (CurveKind::Smooth { above, coulomb, velocity }, 15.0),
        ] {
            let curved = Curved { place: FRICTION[1], speed: (SPEED[1], 1.0), along: None, kind };
            let (mut z, mut change) = ([Double::ZERO; PLACES], [0.0; PLACES]);
            (z[SPEED[1]], change[SPEED[1]]) = (double(-far), far);
            let part = curved.part(&z, &change);
            assert!(part > 0.05 && part < 0.5, "{:?}: {part}", curved.kind);
            change[SPEED[1]] = 0.01 * far;
            assert_eq!(curved.part(&z, &change), 1.0);
        }
    }
}
