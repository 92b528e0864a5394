//! The nonlinear forces of a mode: of friction laws, of springs that follow the bodies, of steppers, and of a cart on a
//! bridge that yaws.

use super::bristles::{Bent, Bristles, STIFF};
use super::model::{Curved, Model, Phased, Sliding, Vector};
use super::quartic::{AT_KINK, course, crossing, has_slowest, passes, places, polynomial, spread};
use super::radau::{BACKWARD, C, FOUND, Lane, NODES, POINTS, Slopes, monomials, rest};
use crate::friction::{Law, Motion, Side};
use crate::mechanism::{BODIES, DRIVES, PhaseRate, Ridden, RideLaw, Riding, SPRINGS};

/// Most forces: of friction, of springs, and the torque and the voltages of a stepper.
pub(super) const SOURCES: usize = BODIES + SPRINGS + 2 * DRIVES;

/// A force, with the arguments that it depends on by their numbers.
pub(super) enum Source {
    /// Force of a body's law; the index counts bodies with a law of their own.
    Friction {
        curved: usize,
        motion: Motion,
        speed: usize,
        /// Its coordinate, where friction changes along the travel.
        way: Option<usize>,
    },
    /// Force of a spring; the index counts springs that follow.
    Spring {
        following: usize,
        length: usize,
        /// Bodies that it follows, with their coordinates.
        ways: Vec<(usize, usize)>,
        /// Its length where the coordinates are zero, m, and by how much it grows with each: arguments and arms.
        rest: f64,
        arms: Vec<(usize, f64)>,
    },
    /// The torque of a stepper, N m.
    Torque(Phasing),
    /// Nonlinear part of the rate of a phase current, by the number of the phase, A/s.
    Phase(usize, Phasing),
    /// Reduction of the force on a body by a cart on a bridge that yaws.
    Ride { on: Ridden, law: RideLaw, arguments: Riding<Argument> },
}

/// An argument by its number, and what counts as its zero.
#[derive(Debug, Clone, Copy)]
pub(super) struct Argument {
    pub(super) number: usize,
    pub(super) origin: f64,
}

/// The numbers of the arguments of a stepper's phases.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phasing {
    /// The stepper, by its number among those.
    pub(super) phased: usize,
    pub(super) angle: usize,
    pub(super) speed: usize,
    pub(super) currents: [usize; 2],
    /// Commanded angle.
    pub(super) told: usize,
}

/// Deviations of a force below this share of it are rounding, and so near to a node ω counts as this much: a tenth of
/// its largest value between the first two.
const ROUNDING: f64 = 1e-13;
const LEAST_REST: f64 = 5e-5;

/// A speed that changes by less than this share of the width of its curve within a step shows all of it at the nodes.
const NARROW: f64 = 0.25;

impl Source {
    /// Force of a spring; its arguments are its elongation and the coordinates of the bodies that it follows.
    pub(super) fn spring(model: &Model, following: usize, length: usize, ways: Vec<(usize, usize)>) -> Self {
        let spring = &model.mechanism.springs[model.following[following].spring];
        let (mut rest, mut arms) = (0.0, Vec::new());
        if let Some(follows) = &spring.follows {
            rest = follows.length;
            for (&(body, arm), &(_, argument)) in follows.arms.iter().zip(&ways) {
                rest += arm * model.mechanism.origin[body];
                arms.push((argument, arm));
            }
        }
        Source::Spring { following, length, ways, rest, arms }
    }

    /// The force at the beginning of a step, `value` being that of an argument.
    pub(super) fn at_begin(
        &self,
        model: &Model,
        mode: &crate::mechanism::Mode,
        (input, y): (&[f64; DRIVES], &Vector),
        value: impl Fn(usize) -> f64,
    ) -> f64 {
        match self {
            Source::Torque(phasing) => model.phased[phasing.phased].torque(y),
            Source::Phase(phase, phasing) => {
                let phased = &model.phased[phasing.phased];
                let (speed, current) = (y[phased.speed], y[phased.currents[*phase]]);
                let told = phased.per_input * input[phased.drive];
                phased.phases.rate(*phase, phased.angle(y), speed, current, told).value
            }
            Source::Friction { curved, .. } => {
                let curved = &model.curved[*curved];
                model.beyond_straight(curved, mode.motion[curved.body], y)
            }
            Source::Spring { following, .. } => model.beyond(&model.following[*following], y),
            Source::Ride { on, law, arguments } => law.force(*on, &arguments.map(|own| own.origin + value(own.number))),
        }
    }

    /// Makes its bristles ready for a step of length `h` from `y` on.
    #[inline(always)]
    pub(super) fn set_out(&self, model: &Model, h: f64, y: &Vector, bristles: &mut Bristles) {
        let &Source::Friction { curved, motion, .. } = self else { return };
        let curved = &model.curved[curved];
        if let Some(place) = curved.bristle {
            let (v, factor) = (y[curved.speed], model.factor_at(curved.body, || y[model.coordinate(curved.body)]));
            let slip = curved.sliding(motion, v, factor, false).slip;
            let own = &mut bristles[curved.body];
            (own.rate, own.is_stiff) = (v - slip * y[place], h * slip > STIFF);
        }
    }

    /// The share of a step from `y` on at which it has a kink, or something as narrow: its body reverses without
    /// sticking, or passes a corner of its friction along the travel. A corner that is passed by less than the share
    /// [`FOUND`] of what `strict` allows counts for nothing, and neither does one at the beginning.
    #[inline(always)]
    pub(super) fn kink(
        &self,
        model: &Model,
        (y, input): (&Vector, &[f64; DRIVES]),
        arguments: &[Lane],
        strict: &[f64],
    ) -> Option<f64> {
        let mut first: Option<f64> = None;
        let mut take = |share: Option<f64>| {
            first = match (first, share) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            }
        };
        let (curved, motion, speed, way) = match *self {
            Source::Friction { curved, motion, speed, way } => (curved, motion, speed, way),
            Source::Phase(phase, phasing) => {
                // The voltage limit of a phase begins or ceases to bind.
                let (phased, places) = (&model.phased[phasing.phased], phasing.currents[phase]);
                let regulator = phased.phases.regulator?;
                let negligible = FOUND / strict[places] * phased.phases.inductance * regulator;
                let excess = phasing.excess(phased, phase, (y, input), arguments);
                excess.iter().for_each(|excess| take(crossing(excess, negligible)));
                return first;
            }
            Source::Spring { .. } | Source::Torque(_) | Source::Ride { .. } => return None,
        };
        let curved = &model.curved[curved];
        if motion == Motion::Free {
            take(crossing(&course(y[curved.speed], &arguments[speed]), FOUND / strict[speed]));
        }
        if let (Some(way), Some(along)) = (way, &model.mechanism.bodies[curved.body].along) {
            let places = course(y[model.coordinate(curved.body)], &arguments[way]);
            let origin = model.mechanism.origin[curved.body];
            let (low, high) =
                places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
            let between = along.piece_at(origin + low)..along.piece_at(origin + high);
            for [corner, _] in along.points().get(between).unwrap_or(&[]) {
                take(crossing(&places.map(|place| place - (corner - origin)), FOUND / strict[way]));
            }
        }
        first
    }

    /// Deviation of a friction force from the quartic through its points at a place between them, and by it D of the
    /// deviation D ω(s). The nodes can miss a curve that is passed within a part of the step: its peak where the body
    /// is slowest, and that of bristles, which zero speed hides, where the body is as fast as the curve is wide.
    #[inline(always)]
    pub(super) fn missed(
        &self,
        (model, h, y): (&Model, f64, &Vector),
        arguments: &[Lane],
        (force, bristles): (&[f64; POINTS], &Bristles),
    ) -> Option<[f64; 2]> {
        let &Source::Friction { curved, motion, speed, way } = self else { return None };
        let curved = &model.curved[curved];
        let speeds = course(y[curved.speed], &arguments[speed]);
        let (width, hides) = match curved.friction.law {
            Law::Coulomb => return None,
            Law::Stribeck { velocity, .. } => (velocity, false),
            // tanh 10 v/v_b
            Law::Smooth { breakaway_velocity } => (0.1 * breakaway_velocity, false),
            Law::LuGre { velocity, .. } => (velocity, true),
        };
        if spread(&speeds) <= NARROW * width || !(has_slowest(&speeds) || (hides && passes(&speeds, width))) {
            return None;
        }
        let (friction, course) = ((curved, motion, way), (arguments, &monomials(&speeds)));
        missed_by((model, h, y), friction, course, (force, bristles), hides.then_some(width))
    }

    /// True if it is zero in one direction of a body that reverses without sticking. What such a body does is then
    /// solved without an error, so that nothing but the length of a step keeps it near to a quartic.
    pub(super) fn is_one_sided(&self, model: &Model) -> bool {
        let &Source::Friction { curved, motion: Motion::Free, .. } = self else { return false };
        let friction = &model.curved[curved].friction;
        let more = friction.backward.viscous - friction.forward.viscous;
        let is_zero = |side: Side| side.coulomb == 0.0 && side.breakaway == 0.0;
        is_zero(friction.forward) || (is_zero(friction.backward) && more == 0.0)
    }

    /// The body of a friction force whose speed is zero where the step ends.
    pub(super) fn reversing(&self, model: &Model, arguments: &[Lane]) -> Option<usize> {
        let &Source::Friction { curved, motion: Motion::Free, speed, .. } = self else { return None };
        let speeds = &arguments[speed];
        let fastest = speeds.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        (speeds[NODES - 1].abs() <= AT_KINK * fastest).then_some(model.curved[curved].body)
    }

    /// The force at the nodes of a step of length `h` from `y` on; deflections of its bristles go to `bristles`.
    #[inline(always)]
    pub(super) fn at_nodes(
        &self,
        model: &Model,
        h: f64,
        y: &Vector,
        arguments: &[Lane],
        bristles: &mut Bristles,
    ) -> Lane {
        match self {
            &Source::Friction { curved, motion, speed, way } => {
                let curved = &model.curved[curved];
                let law = |i: usize| {
                    let factor = model.factor_at(curved.body, || way.map_or(0.0, |way| arguments[way][i]));
                    curved.sliding(motion, arguments[speed][i], factor, false)
                };
                let mut force = [0.0; NODES];
                if let (None, Some(forward)) = (way, curved.direction(motion)) {
                    return curved.beyond_coulomb(forward, arguments[speed]);
                }
                match (curved.friction.law, curved.bristle) {
                    (Law::LuGre { stiffness, damping, .. }, Some(place)) => {
                        let v = &arguments[speed];
                        let laws = match way {
                            None if curved.friction.forward == curved.friction.backward => curved.bristles(*v),
                            _ => std::array::from_fn(law),
                        };
                        let own = &mut bristles[curved.body];
                        own.is_stiff |= laws.iter().any(|law| h * law.slip > STIFF);
                        let bent = Bent::new(h, &laws, own.is_stiff).deflections(h, y[place], own.rate, v);
                        own.bent = bent;
                        for (i, force) in force.iter_mut().enumerate() {
                            // σ₀ z + σ₁ ż
                            let rate = v[i] - laws[i].slip * bent[i];
                            *force = laws[i].beyond + stiffness * bent[i] + damping * rate;
                        }
                    }
                    _ => force.iter_mut().enumerate().for_each(|(i, force)| *force = law(i).beyond),
                }
                force
            }
            Source::Spring { following, length, rest, arms, .. } => {
                let spring = &model.mechanism.springs[model.following[*following].spring];
                let Some(follows) = &spring.follows else { return [0.0; NODES] };
                let mut force = [*rest; NODES];
                for &(argument, arm) in arms {
                    force.iter_mut().zip(&arguments[argument]).for_each(|(length, way)| *length += arm * way);
                }
                // (k(q) − k) s
                for (force, stretch) in force.iter_mut().zip(&arguments[*length]) {
                    *force = (follows.rigidity / *force - spring.stiffness) * stretch;
                }
                force
            }
            Source::Torque(phasing) => {
                let phases = &model.phased[phasing.phased].phases;
                std::array::from_fn(|i| {
                    let currents = phasing.currents.map(|current| arguments[current][i]);
                    phases.torque(phasing.angle(model, arguments, i), currents).0
                })
            }
            Source::Phase(phase, phasing) => std::array::from_fn(|i| phasing.rate(model, *phase, arguments, i).value),
            Source::Ride { on, law, arguments: own } => {
                std::array::from_fn(|i| law.force(*on, &own.map(|own| own.origin + arguments[own.number][i])))
            }
        }
    }

    /// Its derivatives with respect to each argument.
    pub(super) fn slopes(
        &self,
        model: &Model,
        h: f64,
        arguments: &[Lane],
        bristles: &Bristles,
        each: &mut dyn FnMut(usize, &Slopes),
    ) {
        let diagonal = |of: &dyn Fn(usize) -> f64| -> Slopes {
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { of(i) } else { 0.0 }))
        };
        match self {
            &Source::Friction { curved, motion, speed, way } => {
                let curved = &model.curved[curved];
                let coordinate = |i: usize| way.map_or(0.0, |way| arguments[way][i]);
                let factor = |i: usize| model.factor_at(curved.body, || coordinate(i));
                let laws: [Sliding; NODES] =
                    std::array::from_fn(|i| curved.sliding(motion, arguments[speed][i], factor(i), true));
                // The slope of the factor: straight lines.
                const STEP: f64 = 1e-9;
                let steep = |i: usize| {
                    let there = model.factor_at(curved.body, || coordinate(i) + STEP);
                    (there - factor(i)) / STEP
                };
                match curved.friction.law {
                    Law::LuGre { .. } => {
                        let own = &bristles[curved.body];
                        let (bent, matrix) = (&own.bent, Bent::new(h, &laws, own.is_stiff));
                        each(speed, &matrix.slopes(h, curved, &laws, |q| 1.0 - laws[q].slip_slope * bent[q], 1.0));
                        if let Some(way) = way {
                            let by_way = |q: usize| laws[q].slip * steep(q) / factor(q) * bent[q];
                            each(way, &matrix.slopes(h, curved, &laws, by_way, 0.0));
                        }
                    }
                    Law::Coulomb | Law::Stribeck { .. } | Law::Smooth { .. } => {
                        each(speed, &diagonal(&|i| laws[i].slope));
                        if let Some(way) = way {
                            each(way, &diagonal(&|i| laws[i].by_factor * steep(i)));
                        }
                    }
                }
            }
            Source::Spring { following, length, ways, .. } => {
                let part = &model.following[*following];
                let way = |body: usize, i: usize| {
                    ways.iter().find(|(b, _)| *b == body).map_or(0.0, |(_, argument)| arguments[*argument][i])
                };
                let stiffer = |i: usize| model.stiffer(part.spring, |body| way(body, i));
                each(*length, &diagonal(&stiffer));
                let Some(follows) = &model.mechanism.springs[part.spring].follows else { return };
                let own = model.mechanism.springs[part.spring].stiffness;
                for &(body, argument) in ways {
                    // k = E A/l, dk/dq = −k a/l = −k² a/(E A)
                    let arm: f64 = follows.arms.iter().filter(|(b, _)| *b == body).map(|(_, arm)| arm).sum();
                    let steep = |i: usize| {
                        let k = stiffer(i) + own;
                        -k * k * arm / follows.rigidity * arguments[*length][i]
                    };
                    each(argument, &diagonal(&steep));
                }
            }
            Source::Torque(phasing) => {
                let phases = &model.phased[phasing.phased].phases;
                let slopes: [[f64; 3]; NODES] = std::array::from_fn(|i| {
                    let currents = phasing.currents.map(|current| arguments[current][i]);
                    phases.torque(phasing.angle(model, arguments, i), currents).1
                });
                let [a, b] = phasing.currents;
                for (number, argument) in [phasing.angle, a, b].into_iter().enumerate() {
                    each(argument, &diagonal(&|i| slopes[i][number]));
                }
            }
            Source::Phase(phase, phasing) => {
                let slopes: [[f64; 3]; NODES] =
                    std::array::from_fn(|i| phasing.rate(model, *phase, arguments, i).slopes);
                let own = [phasing.angle, phasing.speed, phasing.currents[*phase]];
                for (number, argument) in own.into_iter().enumerate() {
                    each(argument, &diagonal(&|i| slopes[i][number]));
                }
            }
            Source::Ride { on, law, arguments: own } => {
                let slopes: [[f64; 7]; NODES] = std::array::from_fn(|i| {
                    law.slopes(*on, &own.map(|own| own.origin + arguments[own.number][i])).parts()
                });
                for (part, argument) in own.parts().into_iter().enumerate() {
                    each(argument.number, &diagonal(&|i| slopes[i][part]));
                }
            }
        }
    }
}

impl Phasing {
    /// The rotor's angle at a node, rad.
    #[inline(always)]
    fn angle(&self, model: &Model, arguments: &[Lane], i: usize) -> f64 {
        model.phased[self.phased].at + arguments[self.angle][i]
    }

    /// Nonlinear part of the rate of a phase current at a node, A/s.
    #[inline(always)]
    fn rate(&self, model: &Model, phase: usize, arguments: &[Lane], i: usize) -> PhaseRate {
        let [speed, current, told] = [self.speed, self.currents[phase], self.told].map(|number| arguments[number][i]);
        let angle = self.angle(model, arguments, i);
        model.phased[self.phased].phases.rate(phase, angle, speed, current, told)
    }

    /// The voltage beyond either limit that the regulator of a phase requires, V, at the points of a step.
    fn excess(
        &self,
        phased: &Phased,
        phase: usize,
        (y, input): (&Vector, &[f64; DRIVES]),
        arguments: &[Lane],
    ) -> [[f64; POINTS]; 2] {
        let at = |begin: f64, number: usize| course(begin, &arguments[number]);
        let current = phased.currents[phase];
        let angle = at(phased.angle(y) - phased.at, self.angle).map(|angle| angle + phased.at);
        let (speed, current) = (at(y[phased.speed], self.speed), at(y[current], self.currents[phase]));
        let told = at(phased.per_input * input[phased.drive], self.told);
        let excess: [[f64; 2]; POINTS] = std::array::from_fn(|p| {
            phased.phases.excess(phase, angle[p], speed[p], current[p], told[p]).unwrap_or_default()
        });
        [excess.map(|[high, _]| high), excess.map(|[_, low]| low)]
    }
}

/// The worst deviation of a friction force from the quartic through its points, where its body is slowest and, if
/// a width is given, where its speed is that, and by it D of the deviation D ω(s).
#[cold]
fn missed_by(
    (model, h, y): (&Model, f64, &Vector),
    (curved, motion, way): (&Curved, Motion, Option<usize>),
    (arguments, powers): (&[Lane], &[f64; POINTS]),
    (force, bristles): (&[f64; POINTS], &Bristles),
    width: Option<f64>,
) -> Option<[f64; 2]> {
    let ways = way.map(|way| monomials(&course(y[model.coordinate(curved.body)], &arguments[way])));
    let law = |s: f64| {
        let factor = model.factor_at(curved.body, || ways.map_or(0.0, |ways| polynomial(&ways, s)));
        curved.sliding(motion, polynomial(powers, s), factor, false)
    };
    let mut worst: Option<[f64; 2]> = None;
    let mut take = |s: f64| {
        // Both, and a size that rounding is a part of.
        let (own, there, size) = match (curved.friction.law, curved.bristle) {
            (Law::LuGre { stiffness, damping, .. }, Some(place)) => {
                // The defect δ = p(s) − (v − a z), p being the polynomial of ż at the points: σ₀ z is off by
                // σ₀ δ min(h, 1/a), and σ₁ ż by σ₁ δ.
                let own = &bristles[curved.body];
                let [a, b, c, d] = own.bent;
                let bent = monomials(&[y[place], a, b, c, d]);
                let rate = |s: f64| polynomial(powers, s) - law(s).slip * polynomial(&bent, s);
                let rates = C.map(rate);
                let begin = if own.is_stiff { BACKWARD.iter().zip(rates).map(|(b, r)| b * r).sum() } else { own.rate };
                let [a, b, c, d] = rates;
                let weight = stiffness * h.min(1.0 / law(s).slip) + damping;
                let through = polynomial(&monomials(&[begin, a, b, c, d]), s);
                (weight * rate(s), weight * through, weight * polynomial(powers, s).abs())
            }
            _ => {
                let own = law(s).beyond;
                (own, polynomial(&monomials(force), s), own.abs())
            }
        };
        let off = (own - there).abs();
        if off > ROUNDING * size && worst.is_none_or(|[most, _]| off > most) {
            worst = Some([off, off / rest(s).abs().max(LEAST_REST)]);
        }
    };
    let speed = |s: f64| polynomial(powers, s);
    let slope = |s: f64| (1..POINTS).rev().fold(0.0, |sum, k| sum * s + k as f64 * powers[k]);
    // |v| grows where v v′ > 0.
    places(
        |s| speed(s) * slope(s) > 0.0,
        |s, grows| {
            if grows {
                take(s)
            }
        },
    );
    if let Some(width) = width {
        places(|s| speed(s).abs() > width, |s, _| take(s));
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::super::bristles::Bristle;
    use super::*;
    use crate::friction::{Friction, Shape};
    use crate::mechanism::testing::{body, spring};
    use crate::mechanism::{BODIES, Body, Follows, Layout, Mechanism, Spring};
    use crate::polyline::Polyline;
    use std::sync::Arc;

    /// Two carts on a span that follows the first; the first one's friction has this law.
    fn model(law: Law, along: bool) -> Model {
        let friction = Friction::sided(
            Side { viscous: 3.0, coulomb: 1.0, breakaway: 1.6 },
            Side { viscous: 4.0, coulomb: 1.2, breakaway: 1.9 },
        );
        let line = Polyline::new(vec![[-1.0, 0.8], [1.0, 1.4]]).filter(|_| along);
        let follows = Follows { rigidity: 2e4, length: 0.6, arms: vec![(0, 1.0)] };
        let spring = Spring { follows: Some(follows), ..spring(&[(0, 1.0), (1, -1.0)], 3e4) };
        let bodies = vec![Body { friction: friction.following(law), along: line, ..body(0, 1.0) }, body(1, 1.0)];
        let mechanism = Mechanism::new(bodies, vec![spring], Vec::new());
        let layout = Layout::new(&mechanism);
        Model::new(Arc::new(mechanism), layout)
    }

    /// Central differences of the forces by each argument at each node.
    fn differences(source: &Source, model: &Model, (h, y): (f64, &Vector), arguments: &[Lane]) -> Vec<Slopes> {
        let forces = |arguments: &[Lane]| {
            let mut bristles = [Bristle::default(); BODIES];
            source.set_out(model, h, y, &mut bristles);
            source.at_nodes(model, h, y, arguments, &mut bristles)
        };
        let of_node = |argument: usize, node: usize| {
            let at = |by: f64| {
                let mut moved = arguments.to_vec();
                moved[argument][node] += by;
                forces(&moved)
            };
            let (up, down) = (at(1e-6), at(-1e-6));
            std::array::from_fn::<f64, NODES, _>(|i| (up[i] - down[i]) / 2e-6)
        };
        let of_argument = |argument: usize| -> Slopes {
            let columns: [Lane; NODES] = std::array::from_fn(|node| of_node(argument, node));
            std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
        };
        (0..arguments.len()).map(of_argument).collect()
    }

    /// Newton's method uses the slopes as derivatives of the forces. Wrong slopes cost steps without an error of
    /// positions.
    #[test]
    fn slopes_are_the_derivatives_of_the_forces() {
        let laws = [
            Law::Stribeck { velocity: 0.1, shape: Shape::Gaussian },
            Law::Smooth { breakaway_velocity: 0.1 },
            Law::LuGre { velocity: 0.1, stiffness: 1e4, damping: 20.0 },
        ];
        let places: Lane = [0.11, 0.13, 0.16, 0.18];
        for (law, along, sign) in laws.into_iter().flat_map(|law| {
            [(false, 1.0), (true, 1.0), (false, -1.0), (true, -1.0)].map(|(along, sign)| (law, along, sign))
        }) {
            let model = model(law, along);
            let motion = match (law.never_sticks(), sign > 0.0) {
                (true, _) => Motion::Free,
                (false, true) => Motion::Forward,
                (false, false) => Motion::Backward,
            };
            let friction = Source::Friction { curved: 0, motion, speed: 0, way: along.then_some(1) };
            let spring = Source::spring(&model, 0, 2, vec![(0, 1)]);
            let arguments = [[0.05, 0.07, 0.09, 0.12].map(|v| sign * v), places, [1e-3, 2e-3, -1e-3, 3e-3]];
            let mut y = [0.0; super::super::model::MOST];
            (y[model.speed(0)], y[model.coordinate(0)]) = (sign * 0.04, 0.1);
            if let Some(place) = model.bristle[0] {
                y[place] = sign * 5e-5;
            }
            // Bristles bend in the shorter step and slip in the longer one.
            for (h, source) in [1e-4, 0.1].into_iter().flat_map(|h| [(h, &friction), (h, &spring)]) {
                let known = differences(source, &model, (h, &y), &arguments);
                let mut bristles = [Bristle::default(); BODIES];
                source.set_out(&model, h, &y, &mut bristles);
                source.at_nodes(&model, h, &y, &arguments, &mut bristles);
                let mut own = vec![[[0.0; NODES]; NODES]; arguments.len()];
                source.slopes(&model, h, &arguments, &bristles, &mut |argument, slopes| own[argument] = *slopes);
                for (argument, (own, known)) in own.iter().zip(&known).enumerate() {
                    let largest = known.iter().flatten().fold(0.0, |most: f64, slope| most.max(slope.abs()));
                    for (own, known) in own.iter().flatten().zip(known.iter().flatten()) {
                        let off = (own - known).abs();
                        assert!(off <= 1e-5 * largest + 1e-6, "{law:?} {along} {h} {argument}: {own} and {known}");
                    }
                }
            }
        }
    }
}
