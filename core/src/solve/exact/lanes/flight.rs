//! One step of all lanes at once: Taylor series, and what guards and quantities do within the step.

use super::part::{INNER, Part, TERMS};
#[cfg(target_arch = "x86_64")]
use super::wide::{Avx2, Avx512};
use super::wide::{LANES, Lanes, Plain, Wide};
use crate::solve::observe::NEWS;

/// ‖A‖ h that the terms of a series reach: 1.3²⁰/20! is 8e-17.
pub(super) const REACH: f64 = 1.3;

/// The rest of a cubic, 1/384 of the fourth derivative, by the term of order four, a 24th of it.
const FOURTH: f64 = 1.0 / 16.0;
const THIRD: f64 = 1.0 / 3.0;

/// 1/k
pub(super) const RECIPROCAL: [f64; TERMS + 1] = {
    let (mut table, mut k) = ([1.0; TERMS + 1], 1);
    while k <= TERMS {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

/// Something for all that moves in a machine: for speeds and currents, whose rates depend on everything, and for
/// lengths and straight inputs, whose rates depend on speeds alone.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving<T, const S: usize, const D: usize> {
    pub(super) s: [T; S],
    pub(super) d: [T; D],
}

/// A linear form of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form<T, const S: usize, const D: usize> {
    pub(super) of: Moving<T, S, D>,
    pub(super) constant: T,
}

/// Its rates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates<T, const S: usize, const D: usize> {
    pub(super) s: [Form<T, S, D>; S],
    pub(super) d: [([T; S], T); D],
}

/// A form that has to stay between zero and `top`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guard<T, const S: usize, const D: usize> {
    pub(super) form: Form<T, S, D>,
    pub(super) top: T,
    /// How fast it can change per unit of √(2V) of ż.
    pub(super) dual: T,
    /// Number of leading terms that are zero by definition.
    pub(super) fresh: T,
}

/// A form whose extremes are sought.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quantity<T, const S: usize, const D: usize> {
    pub(super) form: Form<T, S, D>,
    pub(super) dual: T,
}

impl<T: Copy, const S: usize, const D: usize> Moving<T, S, D> {
    pub(super) fn all(value: T) -> Self {
        Self { s: [value; S], d: [value; D] }
    }

    #[cfg(test)]
    fn each(&mut self) -> impl Iterator<Item = &mut T> {
        self.s.iter_mut().chain(&mut self.d)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &T> {
        self.s.iter().chain(&self.d)
    }
}

impl<T: Copy, const S: usize, const D: usize> Form<T, S, D> {
    pub(super) fn all(value: T) -> Self {
        Self { of: Moving::all(value), constant: value }
    }
}

impl<T: Copy, const S: usize, const D: usize> Rates<T, S, D> {
    pub(super) fn all(value: T) -> Self {
        Self { s: [Form::all(value); S], d: [([value; S], value); D] }
    }
}

impl<const S: usize, const D: usize> Moving<Lanes, S, D> {
    #[inline(always)]
    fn widen<W: Wide<Kept = Lanes>>(&self) -> Moving<W, S, D> {
        let mut all = Moving::all(W::all(0.0));
        for i in 0..S {
            all.s[i] = W::load(&self.s[i]);
        }
        for i in 0..D {
            all.d[i] = W::load(&self.d[i]);
        }
        all
    }

    /// The numbers of one lane.
    #[inline]
    pub(super) fn lane(&self, lane: usize) -> Moving<f64, S, D> {
        Moving { s: std::array::from_fn(|i| self.s[i].0[lane]), d: std::array::from_fn(|i| self.d[i].0[lane]) }
    }

    #[inline]
    pub(super) fn put(&mut self, lane: usize, numbers: &Moving<f64, S, D>) {
        self.s.iter_mut().zip(&numbers.s).for_each(|(own, number)| own.0[lane] = *number);
        self.d.iter_mut().zip(&numbers.d).for_each(|(own, number)| own.0[lane] = *number);
    }
}

impl<const S: usize, const D: usize> Moving<f64, S, D> {
    /// (self + other) s
    #[inline]
    pub(super) fn add_scaled(&mut self, other: &Self, s: f64) {
        self.s.iter_mut().zip(&other.s).for_each(|(own, other)| *own = (*own + other) * s);
        self.d.iter_mut().zip(&other.d).for_each(|(own, other)| *own = (*own + other) * s);
    }

    /// Σ w z
    #[inline]
    pub(super) fn dot(&self, z: &Self) -> f64 {
        dot(self, z)
    }
}

impl<const S: usize, const D: usize> Guard<Lanes, S, D> {
    const NONE: Self = Self {
        form: Form { of: Moving { s: [Lanes::ZERO; S], d: [Lanes::ZERO; D] }, constant: Lanes::ZERO },
        top: Lanes::all(f64::INFINITY),
        dual: Lanes::ZERO,
        fresh: Lanes::ZERO,
    };

    /// No guard in a lane: always zero, which is safe.
    pub(super) fn clear(&mut self, lane: usize) {
        let form = Form { of: Moving::all(0.0), constant: 0.0 };
        self.put(lane, &Guard { form, top: f64::INFINITY, dual: 0.0, fresh: 0.0 });
    }

    pub(super) fn put(&mut self, lane: usize, guard: &Guard<f64, S, D>) {
        self.form.put(lane, &guard.form);
        (self.top.0[lane], self.dual.0[lane], self.fresh.0[lane]) = (guard.top, guard.dual, guard.fresh);
    }
}

impl<const S: usize, const D: usize> Form<Lanes, S, D> {
    #[inline]
    pub(super) fn put(&mut self, lane: usize, form: &Form<f64, S, D>) {
        self.of.put(lane, &form.of);
        self.constant.0[lane] = form.constant;
    }
}

impl<const S: usize, const D: usize> Quantity<Lanes, S, D> {
    pub(super) fn put(&mut self, lane: usize, quantity: &Quantity<f64, S, D>) {
        self.form.put(lane, &quantity.form);
        self.dual.0[lane] = quantity.dual;
    }
}

impl<const S: usize, const D: usize> Rates<Lanes, S, D> {
    #[inline]
    pub(super) fn put(&mut self, lane: usize, rates: &Rates<f64, S, D>) {
        self.s.iter_mut().zip(&rates.s).for_each(|(own, form)| own.put(lane, form));
        for (own, (weights, constant)) in self.d.iter_mut().zip(&rates.d) {
            own.0.iter_mut().zip(weights).for_each(|(own, weight)| own.0[lane] = *weight);
            own.1.0[lane] = *constant;
        }
    }
}

/// Σ w z, its two parts side by side.
#[inline(always)]
fn dot<W: Wide, const S: usize, const D: usize>(weights: &Moving<W::Kept, S, D>, z: &Moving<W, S, D>) -> W {
    let mut sum = W::load(&weights.s[0]).times(z.s[0]);
    for i in 1..S {
        sum = sum.plus(W::load(&weights.s[i]).times(z.s[i]));
    }
    if D > 0 {
        let mut other = W::load(&weights.d[0]).times(z.d[0]);
        for i in 1..D {
            other = other.plus(W::load(&weights.d[i]).times(z.d[i]));
        }
        sum = sum.plus(other);
    }
    sum
}

#[inline(always)]
fn dot_of_speeds<W: Wide, const S: usize>(weights: &[W::Kept; S], z: &[W; S]) -> W {
    let mut sum = W::load(&weights[0]).times(z[0]);
    for i in 1..S {
        sum = sum.plus(W::load(&weights[i]).times(z[i]));
    }
    sum
}

impl<T: Copy, const S: usize, const D: usize> Form<T, S, D> {
    #[inline(always)]
    pub(super) fn value<W: Wide<Kept = T>>(&self, z: &Moving<W, S, D>) -> W {
        dot(&self.of, z).plus(W::load(&self.constant))
    }

    #[inline(always)]
    pub(super) fn change<W: Wide<Kept = T>>(&self, z: &Moving<W, S, D>) -> W {
        dot(&self.of, z)
    }
}

impl<T: Copy, const S: usize, const D: usize> Rates<T, S, D> {
    /// The rate of z.
    #[inline(always)]
    pub(super) fn rate<W: Wide<Kept = T>>(&self, z: &Moving<W, S, D>) -> Moving<W, S, D> {
        let mut rate = Moving::all(W::all(0.0));
        for i in 0..S {
            rate.s[i] = self.s[i].value(z);
        }
        for i in 0..D {
            rate.d[i] = dot_of_speeds(&self.d[i].0, &z.s).plus(W::load(&self.d[i].1));
        }
        rate
    }

    /// The series of z over `h`, from its rate: term by term, z⁽ᵏ⁺¹⁾ hᵏ⁺¹/(k + 1)! = A z⁽ᵏ⁾ hᵏ/k! · h/(k + 1).
    #[inline(always)]
    pub(super) fn series<W: Wide<Kept = T>>(
        &self,
        h: W,
        (z, rate): (&Moving<W, S, D>, &Moving<W, S, D>),
        terms: &mut [Moving<T, S, D>; TERMS],
    ) {
        let mut now = *rate;
        for i in 0..S {
            now.s[i] = now.s[i].times(h);
        }
        for i in 0..D {
            now.d[i] = now.d[i].times(h);
        }
        keep(z, &mut terms[0]);
        keep(&now, &mut terms[1]);
        for k in 2..TERMS {
            let factor = h.times(W::all(RECIPROCAL[k]));
            let before = now;
            for i in 0..S {
                now.s[i] = self.s[i].change(&before).times(factor);
            }
            for i in 0..D {
                now.d[i] = dot_of_speeds(&self.d[i].0, &before.s).times(factor);
            }
            keep(&now, &mut terms[k]);
        }
    }
}

#[inline(always)]
fn keep<W: Wide, const S: usize, const D: usize>(numbers: &Moving<W, S, D>, kept: &mut Moving<W::Kept, S, D>) {
    for i in 0..S {
        numbers.s[i].keep(&mut kept.s[i]);
    }
    for i in 0..D {
        numbers.d[i].keep(&mut kept.d[i]);
    }
}

/// One end of the steps: z, its rate, and values and rates of guards and quantities.
pub(super) struct Side<const S: usize, const D: usize> {
    pub(super) z: Moving<Lanes, S, D>,
    pub(super) rate: Moving<Lanes, S, D>,
    pub(super) guards: Vec<[Lanes; 2]>,
    pub(super) quantities: Vec<[Lanes; 2]>,
}

impl<const S: usize, const D: usize> Side<S, D> {
    fn new() -> Self {
        let none = Moving::all(Lanes::ZERO);
        Self { z: none, rate: none, guards: Vec::new(), quantities: Vec::new() }
    }
}

/// Peaks of a quantity so far, and those that a step may have within.
#[derive(Clone, Copy)]
pub(super) struct Heights {
    /// The largest value, and its time since the begin of the piece.
    pub(super) peak: Lanes,
    pub(super) when: Lanes,
    /// Lanes in which this step may have a larger one between its ends.
    pub(super) within: u32,
}

/// All lanes.
pub(super) struct Flight<const S: usize, const D: usize> {
    pub(super) rates: Rates<Lanes, S, D>,
    /// Forms whose squares add up to 2V of a rate.
    pub(super) energy: Vec<Moving<Lanes, S, D>>,
    pub(super) guards: Vec<Guard<Lanes, S, D>>,
    pub(super) is_fresh: bool,
    /// The least that is left of each guard within the step.
    pub(super) margins: Vec<Lanes>,
    pub(super) quantities: Vec<Quantity<Lanes, S, D>>,
    pub(super) heights: Vec<Heights>,
    pub(super) from: Side<S, D>,
    pub(super) to: Side<S, D>,
    pub(super) terms: Box<[Moving<Lanes, S, D>; TERMS]>,
    /// Positions that nothing depends on: the number of the speed of each, and the lanes' values.
    pub(super) ways: Vec<(usize, Lanes)>,
    /// Largest magnitudes so far, of z and of the ways.
    pub(super) largest: Moving<Lanes, S, D>,
    pub(super) farthest: Vec<Lanes>,
    /// Time since the begin of the piece of the inputs, its length, and the step and the longest step, s.
    pub(super) time: Lanes,
    pub(super) length: Lanes,
    pub(super) h: Lanes,
    pub(super) longest: Lanes,
    /// Factor by which √(2V) can grow within a step; and how far quantities can be off their cubics in this step, per
    /// unit of their duals, times 4/3.
    pub(super) grow: Lanes,
    pub(super) rest: Lanes,
    pub(super) steps: [u64; LANES],
}

/// Lanes in which a guard may fall within the step, and those at the end of their piece of the inputs.
#[derive(Clone, Copy, Default)]
pub(super) struct Calls {
    pub(super) look: u32,
    pub(super) over: u32,
}

/// The numbers of lanes.
pub(super) fn numbers(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

/// The widest vectors of the processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Width {
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    pub(super) fn widest() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Plain
    }
}

impl<const S: usize, const D: usize> Flight<S, D> {
    /// Lanes without machines, whose ways are the integrals of these speeds.
    pub(super) fn new(ways: &[usize]) -> Self {
        let (zero, none) = (Lanes::ZERO, Moving::all(Lanes::ZERO));
        let mut flight = Self {
            rates: Rates::all(zero),
            energy: Vec::new(),
            guards: Vec::new(),
            is_fresh: false,
            margins: Vec::new(),
            quantities: Vec::new(),
            heights: Vec::new(),
            from: Side::new(),
            to: Side::new(),
            terms: Box::new([none; TERMS]),
            ways: ways.iter().map(|&speed| (speed, zero)).collect(),
            largest: none,
            farthest: vec![zero; ways.len()],
            time: zero,
            length: zero,
            h: zero,
            longest: zero,
            grow: zero,
            rest: zero,
            steps: [0; LANES],
        };
        (0..LANES).for_each(|lane| flight.idle(lane));
        flight
    }

    /// Makes room for so many guards, quantities and forms of energy.
    pub(super) fn make_room(&mut self, guards: usize, quantities: usize, energy: usize) {
        let (zero, none) = (Lanes::ZERO, Moving::all(Lanes::ZERO));
        if self.guards.len() < guards {
            self.guards.resize(guards, Guard::NONE);
            self.margins.resize(guards, zero);
            self.from.guards.resize(guards, [zero; 2]);
            self.to.guards.resize(guards, [zero; 2]);
        }
        if self.quantities.len() < quantities {
            self.quantities.resize(quantities, Quantity { form: Form::all(zero), dual: zero });
            let never = Lanes::all(f64::INFINITY);
            self.heights.resize(quantities, Heights { peak: never, when: zero, within: 0 });
            self.from.quantities.resize(quantities, [zero; 2]);
            self.to.quantities.resize(quantities, [zero; 2]);
        }
        if self.energy.len() < energy {
            self.energy.resize(energy, none);
        }
    }

    /// A lane without a machine.
    pub(super) fn idle(&mut self, lane: usize) {
        let none = Moving::all(0.0);
        self.rates.put(lane, &Rates::all(0.0));
        self.energy.iter_mut().for_each(|form| form.put(lane, &none));
        self.guards.iter_mut().for_each(|guard| guard.clear(lane));
        let quantity = Quantity { form: Form { of: none, constant: 0.0 }, dual: 0.0 };
        self.quantities.iter_mut().for_each(|own| own.put(lane, &quantity));
        self.heights.iter_mut().for_each(|heights| heights.peak.0[lane] = f64::INFINITY);
        self.set(lane, &none, &none);
        self.ways.iter_mut().for_each(|way| way.1.0[lane] = 0.0);
        (self.time.0[lane], self.length.0[lane]) = (0.0, f64::INFINITY);
        (self.longest.0[lane], self.grow.0[lane]) = (0.0, 1.0);
    }

    /// A run begins.
    pub(super) fn begin(&mut self, lane: usize) {
        self.largest.put(lane, &Moving::all(0.0));
        self.farthest.iter_mut().for_each(|way| way.0[lane] = 0.0);
        self.steps[lane] = 0;
    }

    /// The state and its rate in a lane, and what follows from them.
    pub(super) fn set(&mut self, lane: usize, z: &Moving<f64, S, D>, rate: &Moving<f64, S, D>) {
        let Side { z: own, rate: own_rate, guards, quantities } = &mut self.from;
        own.put(lane, z);
        own_rate.put(lane, rate);
        let put = |form: &Form<Lanes, S, D>, pair: &mut [Lanes; 2]| {
            let weights = form.of.lane(lane);
            pair[0].0[lane] = weights.dot(z) + form.constant.0[lane];
            pair[1].0[lane] = weights.dot(rate);
        };
        self.guards.iter().zip(guards).for_each(|(guard, pair)| put(&guard.form, pair));
        self.quantities.iter().zip(quantities).for_each(|(quantity, pair)| put(&quantity.form, pair));
    }

    /// Whether the form of a guard may fall below zero, or rise above its upper bound, within the present step of a
    /// lane.
    pub(super) fn unsafe_sides(&self, slot: usize, lane: usize) -> [bool; 2] {
        if self.margins[slot].0[lane] >= 0.0 {
            return [false; 2];
        }
        let guard = &self.guards[slot];
        if guard.fresh.0[lane] > 0.0 {
            return [true; 2];
        }
        let [from, to] = [&self.from, &self.to].map(|side| side.guards[slot].map(|numbers| numbers.0[lane]));
        let (third, rest) = (self.h.0[lane] * THIRD, self.rest.0[lane] * guard.dual.0[lane]);
        let (one, two) = (from[0] + third * from[1], to[0] - third * to[1]);
        let least = from[0].min(to[0]).min(one.min(two) - rest);
        let most = from[0].max(to[0]).max(one.max(two) + rest);
        [least < 0.0, most > guard.top.0[lane]]
    }

    /// A guard within the present step of a lane: the form itself for a positive side, otherwise what is left of its
    /// upper bound.
    pub(super) fn guard(&self, slot: usize, lane: usize, side: f64) -> Part {
        let [from, to] = [&self.from, &self.to].map(|sides| sides.guards[slot].map(|numbers| numbers.0[lane]));
        let (h, dual) = (self.h.0[lane], self.guards[slot].dual.0[lane]);
        let top = if side > 0.0 { 0.0 } else { self.guards[slot].top.0[lane] };
        Part {
            values: [top + side * from[0], top + side * to[0]],
            slopes: [side * h * from[1], side * h * to[1]],
            rest: self.rest.0[lane] * (1.0 / INNER) * dual,
        }
    }

    /// A quantity within the step that a lane has just taken, over `h`, with this rest per unit of its dual.
    pub(super) fn part(&self, slot: usize, lane: usize, (h, rest): (f64, f64)) -> Part {
        let [from, to] = [&self.to, &self.from].map(|side| side.quantities[slot].map(|numbers| numbers.0[lane]));
        let rest = rest * self.quantities[slot].dual.0[lane];
        Part { values: [from[0], to[0]], slopes: [h * from[1], h * to[1]], rest }
    }

    /// Expands all lanes over their next step, and finds those in which a guard may fall.
    pub(super) fn fly(&mut self, width: Width) -> Calls {
        match width {
            Width::Plain => self.fly_by::<Plain>(),
            // SAFETY: the processor has these vectors.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => unsafe { self.fly_by_avx2() },
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => unsafe { self.fly_by_avx512() },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn fly_by_avx2(&mut self) -> Calls {
        self.fly_by::<Avx2>()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn fly_by_avx512(&mut self) -> Calls {
        self.fly_by::<Avx512>()
    }

    #[inline(always)]
    fn fly_by<W: Wide<Kept = Lanes>>(&mut self) -> Calls {
        let left = W::load(&self.length).minus(W::load(&self.time));
        let longest = W::load(&self.longest);
        let over = !W::bits(W::below(longest, left)) & 0xff;
        let h = left.smaller(longest);
        h.keep(&mut self.h);
        let (z, rate) = (self.from.z.widen::<W>(), self.from.rate.widen::<W>());
        self.rates.series(h, (&z, &rate), &mut self.terms);

        // The state at the end, the smallest terms first.
        let mut end = self.terms[TERMS - 1].widen::<W>();
        for k in (0..TERMS - 1).rev() {
            for i in 0..S {
                end.s[i] = end.s[i].plus(W::load(&self.terms[k].s[i]));
            }
            for i in 0..D {
                end.d[i] = end.d[i].plus(W::load(&self.terms[k].d[i]));
            }
        }
        keep(&end, &mut self.to.z);
        let rate = self.rates.rate(&end);
        keep(&rate, &mut self.to.rate);

        // √(2V) of the term of order four is h⁴/24 times that of z⁗.
        let fourth = self.terms[4].widen::<W>();
        let mut squares = W::all(0.0);
        for form in &self.energy {
            let part = dot(form, &fourth);
            squares = squares.plus(part.times(part));
        }
        let rest = squares.root().times(W::load(&self.grow)).times(W::all(FOURTH * INNER));
        rest.keep(&mut self.rest);

        let mut low = W::all(0.0);
        let third = h.times(W::all(THIRD));
        let sides = self.from.guards.iter().zip(&mut self.to.guards);
        for ((guard, (from, to)), margin) in self.guards.iter().zip(sides).zip(&mut self.margins) {
            let (value, slope) = (guard.form.value(&end), guard.form.change(&rate));
            value.keep(&mut to[0]);
            slope.keep(&mut to[1]);
            let (begin, rest) = (W::load(&from[0]), rest.times(W::load(&guard.dual)));
            let one = begin.plus(third.times(W::load(&from[1])));
            let two = value.minus(third.times(slope));
            let highest = begin.larger(value).larger(one.larger(two).plus(rest));
            let room = W::load(&guard.top).minus(highest);
            let (mut begin, mut one, mut two) = (begin, one.minus(rest), two.minus(rest));
            if self.is_fresh {
                // What is zero by definition is not looked at.
                let (zero, fresh) = (W::all(0.0), W::load(&guard.fresh));
                let (first, second) = (W::below(zero, fresh), W::below(W::all(1.0), fresh));
                one = W::pick(first, third.times(W::load(&from[1])).minus(rest), one);
                one = W::pick(second, zero, one);
                two = W::pick(second, two.minus(rest.times(W::all(3.0))), two);
                begin = W::pick(first, zero, begin);
            }
            let lowest = begin.smaller(value).smaller(one.smaller(two)).smaller(room);
            lowest.keep(margin);
            low = low.smaller(lowest);
        }
        let mut sum = W::all(0.0);
        for i in 0..S {
            sum = sum.plus(end.s[i]);
        }
        for i in 0..D {
            sum = sum.plus(end.d[i]);
        }
        let finite = W::bits(W::below(sum.abs(), W::all(f64::INFINITY)));
        let safe = !W::bits(W::below(low, W::all(0.0)));
        Calls { look: !(finite & safe) & 0xff, over }
    }

    /// Takes the steps, but for lanes that have `ended` theirs in their own way, and finds quantities that may have a
    /// peak within theirs.
    pub(super) fn land(&mut self, width: Width, ended: u32) -> u32 {
        match width {
            Width::Plain => self.land_by::<Plain>(ended),
            // SAFETY: the processor has these vectors.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => unsafe { self.land_by_avx2(ended) },
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => unsafe { self.land_by_avx512(ended) },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn land_by_avx2(&mut self, ended: u32) -> u32 {
        self.land_by::<Avx2>(ended)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn land_by_avx512(&mut self, ended: u32) -> u32 {
        self.land_by::<Avx512>(ended)
    }

    #[inline(always)]
    fn land_by<W: Wide<Kept = Lanes>>(&mut self, ended: u32) -> u32 {
        let (h, time, length) = (W::load(&self.h), W::load(&self.time), W::load(&self.length));
        let (end, rate) = (self.to.z.widen::<W>(), self.to.rate.widen::<W>());
        let (rest, third) = (W::load(&self.rest), h.times(W::all(THIRD)));
        let left = length.minus(time);
        let next = W::pick(W::below(W::load(&self.longest), left), time.plus(h), length);
        // What does not go takes nothing.
        let mut least = Lanes::all(f64::MIN_POSITIVE);
        for (lane, least) in least.0.iter_mut().enumerate() {
            *least = if ended >> lane & 1 == 0 { f64::MIN_POSITIVE } else { f64::INFINITY };
        }
        let least = W::load(&least);
        let (zero, never) = (W::all(0.0), W::all(f64::INFINITY));
        let mut any = 0;
        let all = self.quantities.iter().zip(&self.from.quantities).zip(&mut self.to.quantities);
        for (((quantity, from), to), heights) in all.zip(&mut self.heights) {
            let (value, slope) = (quantity.form.value(&end), quantity.form.change(&rate));
            value.keep(&mut to[0]);
            slope.keep(&mut to[1]);
            let (begin, steep) = (W::load(&from[0]), W::load(&from[1]));
            let one = begin.plus(third.times(steep)).abs();
            let two = value.minus(third.times(slope)).abs();
            let (new, peak) = (value.abs(), W::load(&heights.peak));
            let old = peak.abs();
            // What comes to a value as large as any before takes its time, as the last of equal ones; what is held does
            // not.
            let change = begin.minus(value).abs().plus(steep.abs().plus(slope.abs()));
            let needed = old.times(W::all(1.0 - NEWS)).larger(least);
            let needed = W::pick(W::below(zero, change), needed, never);
            let stays = W::below(new, needed);
            let most = new.larger(old);
            let signed = W::pick(W::below(value, zero), zero.minus(most), most);
            W::pick(stays, peak, signed).keep(&mut heights.peak);
            W::pick(stays, W::load(&heights.when), next).keep(&mut heights.when);
            let rest = rest.times(W::load(&quantity.dual));
            let inner = one.larger(two).plus(rest);
            // Between its ends a course is highest only if its slope changes sign; that is off the slope of the cubic
            // by 3.1 times the rest at most.
            let (s, t) = (h.times(steep), h.times(slope));
            let middle = value.minus(begin).times(W::all(3.0)).minus(s.plus(t));
            let (least, greatest) = (s.smaller(t).smaller(middle), s.larger(t).larger(middle));
            let sure = rest.times(W::all(3.2 / INNER));
            let straight = W::pick(W::below(least, sure), zero, W::all(1.0));
            let straight = W::pick(W::below(greatest, zero.minus(sure)), W::all(1.0), straight);
            let inner = W::pick(W::below(zero, straight), zero, inner);
            heights.within = W::bits(W::below(most.times(W::all(1.0 + NEWS)), inner)) & !ended;
            any |= heights.within;
        }
        for ((speed, way), farthest) in self.ways.iter_mut().zip(&mut self.farthest) {
            let mut sum = W::load(&self.terms[TERMS - 1].s[*speed]).times(W::all(RECIPROCAL[TERMS]));
            for k in (0..TERMS - 1).rev() {
                sum = sum.plus(W::load(&self.terms[k].s[*speed]).times(W::all(RECIPROCAL[k + 1])));
            }
            let here = W::load(way);
            here.abs().larger(W::load(farthest)).keep(farthest);
            here.plus(sum.times(h)).keep(way);
        }
        let begin = self.from.z.widen::<W>();
        for i in 0..S {
            begin.s[i].abs().larger(W::load(&self.largest.s[i])).keep(&mut self.largest.s[i]);
        }
        for i in 0..D {
            begin.d[i].abs().larger(W::load(&self.largest.d[i])).keep(&mut self.largest.d[i]);
        }
        next.keep(&mut self.time);
        if self.is_fresh {
            for guard in &mut self.guards {
                guard.fresh = Lanes::ZERO;
            }
            self.is_fresh = false;
        }
        std::mem::swap(&mut self.from, &mut self.to);
        for (lane, steps) in self.steps.iter_mut().enumerate() {
            *steps += u64::from(ended >> lane & 1 == 0);
        }
        any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;
    use rand_pcg::Pcg64;

    /// Lanes with any numbers, of the size of those of an axis.
    fn flight<const S: usize, const D: usize>(seed: u64) -> Flight<S, D> {
        let mut random = Pcg64::new(u128::from(seed), 1);
        let mut even = |size: f64| size * (2.0 * uniform(&mut random) - 1.0);
        let mut flight = Flight::new(&[1]);
        flight.make_room(3, 4, 5);
        for lane in 0..LANES {
            let mut moving = |size: f64| {
                let mut all = Moving::all(0.0);
                all.each().for_each(|number: &mut f64| *number = even(size));
                all
            };
            let mut rates = Rates::all(0.0);
            for row in &mut rates.s {
                *row = Form { of: moving(300.0), constant: moving(1.0).s[0] };
            }
            rates.d.iter_mut().for_each(|row| *row = (moving(1.0).s, 0.0));
            flight.rates.put(lane, &rates);
            flight.energy.iter_mut().for_each(|form| form.put(lane, &moving(1.0)));
            for (slot, guard) in flight.guards.iter_mut().enumerate() {
                let form = Form { of: moving(1.0), constant: moving(1.0).s[0].abs() };
                let (top, fresh) = (1.0 + slot as f64, [0.0, 1.0, 2.0][(lane + slot) % 3]);
                guard.put(lane, &Guard { form, top, dual: 0.1, fresh });
            }
            for quantity in &mut flight.quantities {
                let form = Form { of: moving(1.0), constant: moving(1.0).s[0] };
                quantity.put(lane, &Quantity { form, dual: 0.1 });
            }
            for heights in &mut flight.heights {
                heights.peak.0[lane] = moving(2.0).s[0];
            }
            let (z, rate) = (moving(1.0), moving(10.0));
            flight.set(lane, &z, &rate);
            (flight.longest.0[lane], flight.grow.0[lane]) = (1e-3 + 1e-4 * lane as f64, 1.0);
            flight.length.0[lane] = if lane == 3 { 1e-4 } else { 1.0 };
        }
        flight.is_fresh = true;
        flight
    }

    fn bits<const S: usize, const D: usize>(flight: &Flight<S, D>) -> Vec<u64> {
        let pairs = [&flight.from, &flight.to].into_iter().flat_map(|side| {
            let pairs = side.guards.iter().chain(&side.quantities).flatten();
            side.z.iter().chain(side.rate.iter()).chain(pairs).copied().collect::<Vec<_>>()
        });
        let heights = flight.heights.iter().flat_map(|heights| [heights.peak, heights.when]);
        let others = [flight.time, flight.h, flight.rest, flight.ways[0].1];
        let all = pairs.chain(flight.margins.iter().copied()).chain(heights).chain(others);
        all.flat_map(|lanes| lanes.0).map(f64::to_bits).collect()
    }

    /// A machine has the same bits on every processor.
    #[test]
    fn every_width_gives_the_same_bits() {
        let widths = match Width::widest() {
            Width::Plain => return,
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => vec![Width::Plain, Width::Avx2],
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => vec![Width::Plain, Width::Avx2, Width::Avx512],
        };
        let mut called = [0; 3];
        for seed in 0..50 {
            let told = widths.iter().map(|&width| {
                let (mut small, mut large) = (flight::<3, 2>(seed), flight::<4, 4>(seed));
                let mut all = Vec::new();
                for _ in 0..3 {
                    let calls = small.fly(width);
                    let within = small.land(width, calls.look & 1);
                    all.push((calls.look, calls.over, within));
                    let calls = large.fly(width);
                    all.push((calls.look, calls.over, large.land(width, 0)));
                }
                (all, bits(&small), bits(&large))
            });
            let told: Vec<_> = told.collect();
            for (look, over, within) in &told[0].0 {
                called[0] += look.count_ones();
                called[1] += over.count_ones();
                called[2] += within.count_ones();
            }
            assert!(told.iter().all(|other| *other == told[0]), "{seed}");
        }
        assert!(called.iter().all(|count| *count > 50), "{called:?}");
    }
}
