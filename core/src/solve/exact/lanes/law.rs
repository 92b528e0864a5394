//! A mode of one machine as the numbers of a lane.

use super::flight::{Form, Guard, Moving, Quantity, REACH, Rates};
use crate::friction::Motion;
use crate::mechanism::{Cause, Mechanism, Mode, Shown, SpringLaw, What};
use crate::solve::exact::matrices::{self, ModeMatrices};
use crate::solve::exact::{Core, Space};
use crate::solve::observe::QUANTITIES;
use std::sync::Arc;

/// Places of z by their part in a flight.
#[derive(Debug, PartialEq)]
pub(super) struct Parts {
    /// Speeds and currents; lengths and straight inputs; ways, each with the number of its speed.
    pub(super) s: Vec<usize>,
    pub(super) d: Vec<usize>,
    pub(super) ways: Vec<(usize, usize)>,
}

impl Parts {
    pub(super) fn new(mechanism: &Mechanism, space: &Space) -> Self {
        let layout = &space.layout;
        let bodies = layout.bodies();
        let mut s: Vec<usize> = (0..bodies).map(|body| layout.speed[body]).collect();
        s.extend(layout.current.iter().flatten());
        let (mut d, mut ways) = (Vec::new(), Vec::new());
        for body in 0..bodies {
            let pulls = |spring: usize| {
                !matches!(mechanism.springs[spring].law, SpringLaw::None)
                    && layout.weights(spring).any(|(own, _)| own == body)
            };
            match layout.is_replaced(body) || (0..mechanism.springs.len()).any(pulls) {
                true => d.push(layout.coordinate[body]),
                false => ways.push((layout.coordinate[body], body)),
            }
        }
        if space.highest > 0 {
            d.extend((0..layout.inputs).map(|drive| space.chain(drive, 0)));
        }
        Self { s, d, ways }
    }
}

/// The same for vectors of `N` places.
pub(super) struct Plan<const N: usize> {
    pub(super) parts: Parts,
    /// Everything else, which is constant between changes of the inputs.
    fixed: Vec<usize>,
    is_fixed: [bool; N],
}

impl<const N: usize> Plan<N> {
    pub(super) fn new(parts: Parts) -> Self {
        let mut is_fixed = [true; N];
        let Parts { s, d, ways } = &parts;
        let moving = s.iter().chain(d).chain(ways.iter().map(|(place, _)| place));
        moving.for_each(|place| is_fixed[*place] = false);
        let fixed = (0..N).filter(|place| is_fixed[*place]).collect();
        Self { parts, fixed, is_fixed }
    }

    /// A row of weights on z, without the part that is constant.
    fn moving<const S: usize, const D: usize>(&self, weight: impl Fn(usize) -> f64) -> Moving<f64, S, D> {
        let mut moving = Moving::all(0.0);
        self.parts.s.iter().zip(&mut moving.s).for_each(|(place, own)| *own = weight(*place));
        self.parts.d.iter().zip(&mut moving.d).for_each(|(place, own)| *own = weight(*place));
        moving
    }

    /// The moving part of z.
    pub(super) fn moving_part<const S: usize, const D: usize>(&self, z: &[f64; N]) -> Moving<f64, S, D> {
        self.moving(|place| z[place])
    }

    /// Puts the moving part back.
    pub(super) fn put<const S: usize, const D: usize>(&self, moving: &Moving<f64, S, D>, z: &mut [f64; N]) {
        self.parts.s.iter().zip(&moving.s).for_each(|(place, own)| z[*place] = *own);
        self.parts.d.iter().zip(&moving.d).for_each(|(place, own)| z[*place] = *own);
    }

    /// The weights of what is constant.
    fn fixed(&self, weight: impl Fn(usize) -> f64) -> Fixed {
        let weights = self.fixed.iter().map(|&place| (place as u8, weight(place)));
        weights.filter(|(_, weight)| *weight != 0.0).collect()
    }
}

/// Σ w z of what is constant.
fn constant<const N: usize>(weights: &[(u8, f64)], z: &[f64; N]) -> f64 {
    weights.iter().fold(0.0, |sum, &(place, weight)| sum + weight * z[usize::from(place)])
}

/// The quantities of one machine, proportional ones once.
pub(super) struct Readings<const S: usize, const D: usize> {
    forms: Vec<(Quantity<f64, S, D>, Fixed)>,
}

/// Weights of what is constant, by their places in z.
type Fixed = Vec<(u8, f64)>;

/// Where a quantity is found: its slot, its factor to the form there, and a limit of its magnitude.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReadingSlot {
    pub(super) slot: usize,
    pub(super) factor: f64,
    pub(super) limit: f64,
}

impl ReadingSlot {
    /// The quantity by the value in its slot.
    pub(super) fn reading(self, value: f64) -> f64 {
        (self.factor * value).clamp(-self.limit, self.limit)
    }
}

impl<const S: usize, const D: usize> Readings<S, D> {
    /// Those of these sums of readings; none if one of them is a way, or is not held by any spring.
    pub(super) fn from_shown<const N: usize>(
        shown: &matrices::Shown<N>,
        sums: &[Vec<(usize, f64)>],
        plan: &Plan<N>,
        alike: bool,
    ) -> Option<(Self, Vec<ReadingSlot>)> {
        let (mut forms, mut seen) = (Vec::with_capacity(sums.len()), Vec::with_capacity(sums.len()));
        let mut rows: Vec<[f64; N]> = Vec::with_capacity(sums.len());
        for sum in sums {
            let (mut row, mut dual) = ([0.0; N], 0.0);
            for &(q, weight) in sum {
                row.iter_mut().zip(shown.row(q)).for_each(|(row, own)| *row += weight * own);
                dual += weight.abs() * shown.dual(q);
            }
            if plan.parts.ways.iter().any(|(place, _)| row[*place] != 0.0) || dual == f64::INFINITY {
                return None;
            }
            let limits = shown.readout.limits.iter().filter(|(q, _)| sum[..] == [(*q, 1.0)]);
            let limit = limits.map(|(_, limit)| *limit).fold(f64::INFINITY, f64::min);
            let factor = if alike { scale(&mut row) } else { 1.0 };
            let slot = rows.iter().position(|other| alike && *other == row).unwrap_or_else(|| {
                let form = Form { of: plan.moving(|place| row[place]), constant: 0.0 };
                forms.push((Quantity { form, dual: dual / factor.abs() }, plan.fixed(|place| row[place])));
                rows.push(row);
                rows.len() - 1
            });
            seen.push(ReadingSlot { slot, factor, limit });
        }
        Some((Self { forms }, seen))
    }

    pub(super) fn slots(&self) -> usize {
        self.forms.len()
    }

    /// The form of a slot while what is constant has the values in z.
    pub(super) fn with<const N: usize>(&self, slot: usize, z: &[f64; N]) -> Quantity<f64, S, D> {
        let (mut quantity, fixed) = (self.forms[slot].0, &self.forms[slot].1);
        quantity.form.constant = constant(fixed, z);
        quantity
    }
}

/// Divides a row by the first of its largest weights, which is returned: proportional rows become equal, whichever of
/// them are sought.
fn scale<const N: usize>(row: &mut [f64; N]) -> f64 {
    let largest =
        row.iter().fold(0.0, |largest: f64, weight| if weight.abs() > largest.abs() { *weight } else { largest });
    if largest == 0.0 {
        return 1.0;
    }
    row.iter_mut().for_each(|weight| *weight /= largest);
    largest
}

/// One or two guards of a part as one form between two bounds.
struct Bound<const S: usize, const D: usize> {
    slot: usize,
    of: Moving<f64, S, D>,
    dual: f64,
    /// Numbers of the guards: the form itself, and its opposite, if that is one.
    low: usize,
    high: Option<usize>,
}

/// A mode of one machine.
pub(super) struct Law<const N: usize, const S: usize, const D: usize> {
    pub(super) matrices: Arc<ModeMatrices<N>>,
    /// The longest step, s, and by how much √(2V) can grow within it.
    pub(super) longest: f64,
    pub(super) grow: f64,
    rates: Rates<f64, S, D>,
    rows: Rows<S, D>,
    pub(super) readings: Arc<Readings<S, D>>,
    pub(super) is_still: bool,
}

/// The rows of a law, whose room serves another one after it.
#[derive(Default)]
pub(super) struct Rows<const S: usize, const D: usize> {
    /// Constant parts of the rates: number of the rate, place, weight.
    fixed: Vec<(u8, u8, f64)>,
    energy: Vec<Moving<f64, S, D>>,
    bounds: Vec<Bound<S, D>>,
    /// By the numbers of guards.
    weights: Vec<Moving<f64, S, D>>,
}

impl<const S: usize, const D: usize> Rows<S, D> {
    fn clear(&mut self) {
        let Self { fixed, energy, bounds, weights } = self;
        fixed.clear();
        energy.clear();
        bounds.clear();
        weights.clear();
    }
}

/// Slots of guards by the numbers of their parts.
pub(super) type Slots = Vec<u16>;

/// The number of the part of a condition.
fn part(cause: Cause) -> u16 {
    let (kind, index) = match cause {
        Cause::Stop(body) | Cause::BreakForward(body) | Cause::BreakBackward(body) => (0, body),
        Cause::GearTorque(drive) => (1, drive),
        Cause::Leave(spring) => (2, spring),
        Cause::Switch(switch) => match switch.what() {
            What::Body(body) => (0, body),
            What::Span(spring) | What::Gap(spring) | What::Line(spring) => (2, spring),
            What::Voltage(drive) => (3, drive),
            What::Current(drive) => (4, drive),
            What::Field(drive) => (5, drive),
        },
    };
    64 * kind + index as u16
}

impl<const N: usize, const S: usize, const D: usize> Law<N, S, D> {
    pub(super) fn new(
        core: &Core<N>,
        readings: Arc<Readings<S, D>>,
        plan: &Plan<N>,
        slots: &mut Slots,
        mut rows: Rows<S, D>,
    ) -> Self {
        rows.clear();
        let Rows { fixed, energy, bounds, weights } = &mut rows;
        let matrices = Arc::clone(&core.matrices);
        let matrix = matrices.rates();
        let mut rates = Rates::all(0.0);
        let mut put_fixed = |number: usize, row: usize| {
            for &place in plan.fixed.iter().filter(|place| matrix.at(row, **place) != 0.0) {
                fixed.push((number as u8, place as u8, matrix.at(row, place)));
            }
        };
        for (i, &row) in plan.parts.s.iter().enumerate() {
            rates.s[i].of = plan.moving(|place| matrix.at(row, place));
            put_fixed(i, row);
        }
        for (i, &row) in plan.parts.d.iter().enumerate() {
            rates.d[i].0 = plan.moving::<S, D>(|place| matrix.at(row, place)).s;
            put_fixed(S + i, row);
        }
        for (index, guard) in matrices.guards.iter().enumerate() {
            let mut row = [0.0; N];
            guard.row.terms().for_each(|(place, weight)| row[place] = weight);
            let of = plan.moving(|place| row[place]);
            weights.push(of);
            let own = part(guard.transition.cause);
            let opposite = |low: usize| matrices.guards[low].row.is_opposite(&guard.row);
            let same =
                |bound: &&mut Bound<S, D>| bound.high.is_none() && slots[bound.slot] == own && opposite(bound.low);
            if let Some(bound) = bounds.iter_mut().find(same) {
                bound.high = Some(index);
                continue;
            }
            let taken = |slot: usize| bounds.iter().any(|bound| bound.slot == slot);
            let free = (0..slots.len()).find(|&slot| slots[slot] == own && !taken(slot));
            let slot = free.unwrap_or_else(|| {
                slots.push(own);
                slots.len() - 1
            });
            bounds.push(Bound { slot, of, dual: matrices.dual(index), low: index, high: None });
        }
        let (mechanism, layout) = (&core.common.mechanism, &core.common.space.layout);
        let longest = REACH / matrices.norm(mechanism, layout);
        let grow = matrices.growth_over(longest.min(1.0));
        energy.extend(matrices.energy_forms().map(|form| plan.moving(|place| form[place])));
        let bodies = mechanism.bodies.len();
        let is_still = matrices.mode.motion[..bodies].iter().all(|motion| *motion == Motion::Stuck);
        Self { longest, grow, rates, rows, readings, is_still, matrices }
    }

    /// Its rows, for the room that they have.
    pub(super) fn into_rows(self) -> Rows<S, D> {
        self.rows
    }

    /// Forms whose squares add up to 2V of a rate.
    pub(super) fn energy(&self) -> &[Moving<f64, S, D>] {
        &self.rows.energy
    }

    /// The rates while what is constant has the values in z.
    pub(super) fn rates(&self, z: &[f64; N]) -> Rates<f64, S, D> {
        let mut rates = self.rates;
        for &(number, place, weight) in &self.rows.fixed {
            let number = usize::from(number);
            let constant = if number < S { &mut rates.s[number].constant } else { &mut rates.d[number - S].1 };
            *constant += weight * z[usize::from(place)];
        }
        rates
    }

    /// Its guards, by their slots, as they are for `core`.
    pub(super) fn guards(&self, core: &Core<N>, plan: &Plan<N>) -> impl Iterator<Item = (usize, Guard<f64, S, D>)> {
        let rules = &core.common.rules;
        let fixed_part = |index: usize| {
            let guard = &self.matrices.guards[index];
            let terms = guard.row.terms().filter(|(place, _)| plan.is_fixed[*place]);
            let constant = terms.fold(0.0, |sum, (place, weight)| sum + weight * core.z[place]);
            constant + rules.tolerance[guard.tolerance]
        };
        let fresh = |index: usize| rules.fresh_order(self.matrices.guards[index].transition.cause);
        self.rows.bounds.iter().map(move |bound| {
            let constant = fixed_part(bound.low);
            // A form that leaves its upper bound is looked at more closely.
            let top = bound.high.map_or(f64::INFINITY, |high| match fresh(high) {
                0 => constant + fixed_part(high),
                _ => f64::NEG_INFINITY,
            });
            let form = Form { of: bound.of, constant };
            (bound.slot, Guard { form, top, dual: bound.dual, fresh: fresh(bound.low) as f64 })
        })
    }

    /// True if it has a guard in this slot.
    pub(super) fn has(&self, slot: usize) -> bool {
        self.rows.bounds.iter().any(|bound| bound.slot == slot)
    }

    /// The guards for which these are true, by their slots: the form itself, and its upper bound.
    pub(super) fn open(&self, are_open: impl Fn(usize) -> [bool; 2]) -> impl Iterator<Item = usize> {
        self.rows.bounds.iter().flat_map(move |bound| {
            let [low, high] = are_open(bound.slot);
            [Some(bound.low).filter(|_| low), bound.high.filter(|_| high)].into_iter().flatten()
        })
    }

    /// The slot of a guard: 1 if it is the form there, −1 if it is what is left of the upper bound.
    pub(super) fn slot(&self, index: usize) -> (usize, f64) {
        let of = |bound: &&Bound<S, D>| bound.low == index || bound.high == Some(index);
        let bound = self.rows.bounds.iter().find(of).expect("every guard has a slot");
        (bound.slot, if bound.low == index { 1.0 } else { -1.0 })
    }

    /// The moving weights of a guard.
    pub(super) fn weights(&self, index: usize) -> &Moving<f64, S, D> {
        &self.rows.weights[index]
    }
}

/// True if no reading depends on the mode.
pub(super) fn reads_alike(mechanism: &Mechanism) -> bool {
    let plain = |law: &SpringLaw| matches!(law, SpringLaw::TwoSided | SpringLaw::None | SpringLaw::Bounds { .. });
    let is_read = |spring: usize| {
        let is_of = |shown: &Shown| matches!(*shown, Shown::Force(own, _) | Shown::Contact(own) if own == spring);
        mechanism.readings.iter().any(is_of)
    };
    mechanism.readings.len() <= QUANTITIES
        && mechanism.springs.iter().enumerate().all(|(index, spring)| plain(&spring.law) || !is_read(index))
        && mechanism.drives.iter().all(|drive| {
            drive.amplifier.voltage_limit.is_none() && drive.amplifier.current_limit.is_none() && !drive.loses()
        })
}

/// The mode in which every body that can stick slides.
pub(super) fn all_slide(mode: &Mode, mechanism: &Mechanism) -> Mode {
    let mut all = *mode;
    for motion in all.motion.iter_mut().take(mechanism.bodies.len()).filter(|motion| **motion == Motion::Stuck) {
        *motion = Motion::Forward;
    }
    all
}
