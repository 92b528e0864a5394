//! References of motion: moves from rest to rest within limits of speed, acceleration, jerk and snap, one after
//! another.
//!
//! The speed of a move over a distance D is D times a chain of moving averages, of lengths T₁ (speed), T₂
//! (acceleration), T₃ (jerk) and T₄ (snap), as many as there are limits. With T₃ ≥ T₄, T₂ ≥ T₃ + T₄ and T₁ ≥ T₂ + T₃ +
//! T₄ its peaks are D/T₁, D/(T₁T₂), D/(T₁T₂T₃) and D/(T₁T₂T₃T₄), and it takes T₁ + T₂ + T₃ + T₄. The shortest such
//! lengths are found from the last to the first, each as long as the limits above it allow: the trapezoid, the seven
//! segments of third order, and the fifteen of fourth (P. Lambrechts, M. Boerlage, M. Steinbuch, "Trajectory planning
//! and feedforward design for electromechanical motion systems", Control Engineering Practice 13, 2005).

use super::arc::{Arc, Circle, Turn};
pub use super::reference::{Limits, Reference};
use super::shifted;
use crate::error::{Error, Result};

/// A move from rest to rest over some distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    distance: f64,
    duration: f64,
    /// Begin, and position and its derivatives there, of each piece of the first half; the last derivative is constant
    /// on it.
    pieces: Vec<(f64, [f64; 5])>,
}

impl Stroke {
    /// True in the first half, the time from the nearer end, and the piece there; `later` is true if a seam belongs to
    /// the piece that begins there, false if one of the second half, which mirrors the first, belongs to the piece
    /// before.
    fn found(&self, t: f64, later: bool) -> (bool, f64, usize) {
        let middle = 0.5 * self.duration;
        let first = if later { t < middle } else { t <= middle };
        let tau = if first { t } else { self.duration - t };
        let is_before = |begin: f64| if first || !later { begin <= tau } else { begin < tau };
        (first, tau, self.pieces.partition_point(|(begin, _)| is_before(*begin)).max(1) - 1)
    }

    /// The end of the polynomial that holds from `t` after the beginning on.
    fn seam(&self, t: f64) -> f64 {
        let (first, _, index) = self.found(t, true);
        let begins = |index: usize| self.pieces.get(index).map(|(begin, _)| *begin);
        if first {
            let middle = 0.5 * self.duration;
            begins(index + 1).map_or(middle, |next| next.min(middle))
        } else {
            self.duration - begins(index).unwrap_or(0.0)
        }
    }

    /// The quickest of its kind over `distance` (m, of either sign) within `limits`.
    ///
    /// ```
    /// use taut::signal::profile::{Limits, Stroke};
    /// let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
    /// // Up to speed in 0.1 s and 25 mm, as much to stop, and 150 mm between: 0.5 s.
    /// let stroke = Stroke::new(0.2, &limits)?;
    /// assert!((stroke.duration() - 0.5).abs() < 1e-15);
    /// assert_eq!(stroke.at(0.5).position, 0.2);
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(distance: f64, limits: &Limits) -> Result<Self> {
        let values = [Some(limits.speed), Some(limits.acceleration), limits.jerk, limits.snap];
        if values.iter().flatten().any(|v| !(1e-15..=1e15).contains(v))
            || limits.jerk.is_none() && limits.snap.is_some()
        {
            return Err(Error::new("the limits of a move are invalid")
                .allowed("speed, acceleration, jerk and snap above zero; snap only with jerk"));
        }
        if distance.is_nan() || distance.abs() > 1e9 {
            return Err(Error::new(format!("a move over {distance} m")).allowed("a finite distance"));
        }
        let far = distance.abs();
        if far == 0.0 {
            return Ok(Self { distance, duration: 0.0, pieces: Vec::new() });
        }
        let limits: Vec<f64> = values.into_iter().flatten().collect();
        let times = lengths(far, &limits);
        Ok(Self { distance, duration: times.iter().sum(), pieces: pieces(distance, &times) })
    }

    /// This share of it, over `distance` (m).
    fn scaled(&self, share: f64, distance: f64) -> Self {
        let scale = |(begin, state): &(f64, [f64; 5])| (*begin, state.map(|value| share * value));
        Self { distance, duration: self.duration, pieces: self.pieces.iter().map(scale).collect() }
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Reference at time `t` after the start, s.
    pub fn at(&self, t: f64) -> Reference {
        if t >= self.duration {
            return Reference::at(self.distance);
        }
        if t <= 0.0 { Reference::default() } else { self.reference(t, false) }
    }

    /// Reference at a time within the stroke, with the derivatives of the later or the earlier piece at a seam.
    fn reference(&self, t: f64, later: bool) -> Reference {
        let (first, tau, index) = self.found(t, later);
        let Some(&(begin, [p, v, a, j, s])) = self.pieces.get(index) else { return Reference::at(self.distance) };
        let h = tau - begin;
        let position = p + h * (v + h * (a / 2.0 + h * (j / 6.0 + h * s / 24.0)));
        let speed = v + h * (a + h * (j / 2.0 + h * s / 6.0));
        let acceleration = a + h * (j + h * s / 2.0);
        let jerk = j + h * s;
        if first {
            Reference { position, speed, acceleration, jerk, snap: s }
        } else {
            Reference { position: self.distance - position, speed, acceleration: -acceleration, jerk, snap: -s }
        }
    }
}

/// The lengths T₁, T₂, … of the averages, for as many limits.
fn lengths(distance: f64, limits: &[f64]) -> Vec<f64> {
    let order = limits.len();
    let mut times = vec![0.0; order];
    let last = limits[order - 1];
    for m in (0..order).rev() {
        let longest = if m == 0 {
            // D = p T₁, p being the peak of speed
            let peak = times[1..].iter().product::<f64>() * last;
            distance / peak
        } else {
            // The greatest T_m such that, with all before it as short as it lets them, no peak passes its limit.
            let fits = |t: f64| {
                let mut trial = times.clone();
                trial[m] = t;
                for k in (0..m).rev() {
                    trial[k] = trial[k + 1..].iter().sum();
                }
                let mut peak = last;
                for k in (1..order).rev() {
                    peak *= trial[k];
                    // After the lengths from k on, this is the peak of derivative k (1: speed).
                    if k <= m && peak > limits[k - 1] {
                        return false;
                    }
                }
                peak * trial[0] <= distance
            };
            greatest(fits, distance, limits)
        };
        times[m] = longest;
    }
    times
}

/// The greatest t for which `fits`, which does below some t and not above it.
fn greatest(fits: impl Fn(f64) -> bool, distance: f64, limits: &[f64]) -> f64 {
    let mut high = distance / limits[0] + limits.windows(2).map(|pair| pair[0] / pair[1]).sum::<f64>();
    let mut low = 0.0;
    while fits(high) {
        low = high;
        high *= 2.0;
    }
    // To the last bit: the middle in the logarithm first, as t may be anything.
    if low == 0.0 {
        low = high;
        while !fits(low) {
            high = low;
            low *= 0.5;
        }
    }
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

/// The pieces of the first half. The highest derivative jumps up or down at each sum of some of the lengths but T₁, and
/// these come in the order of binary numbers: 0, T₄, T₃, T₃ + T₄, T₂, …; then it cruises.
fn pieces(distance: f64, times: &[f64]) -> Vec<(f64, [f64; 5])> {
    let order = times.len();
    let height = distance / times.iter().product::<f64>();
    let count = 1_usize << (order - 1);
    let mut pieces = Vec::with_capacity(count);
    let (mut begin, mut state) = (0.0, [0.0; 5]);
    for k in 0..count {
        let level = match (k % 2, k.count_ones() % 2) {
            (1, _) => 0.0,
            (_, 0) => height,
            _ => -height,
        };
        // Where one pulse, two, or four have done their part, as many derivatives are zero, to the last bit.
        let lowest = (k + 1).trailing_zeros() as usize;
        state[order + 1 - lowest..=order].fill(0.0);
        state[order] = level;
        pieces.push((begin, state));
        // The next jump is where the lowest bit that is not set is: after its length less those below it.
        if k + 1 < count {
            let below: f64 = times[order - lowest..].iter().sum();
            let length = times[order - 1 - lowest] - below;
            state = moved(&state, length);
            begin += length;
        }
    }
    pieces
}

/// Position and derivatives after `h` of constant highest derivative.
fn moved(state: &[f64; 5], h: f64) -> [f64; 5] {
    let mut next = [0.0; 5];
    for (k, next) in next.iter_mut().enumerate() {
        let mut term = 1.0;
        for (i, value) in state[k..].iter().enumerate() {
            *next += term * value;
            term *= h / (i + 1) as f64;
        }
    }
    next
}

/// One move of a chain, or a wait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leg<P = f64> {
    /// To a position, m: a number for an axis, the position of each coordinate for a machine with several.
    To(P, Limits),
    /// Along a circle; of a machine with two coordinates.
    Around(Arc, Limits),
    /// Rest for so long, s.
    Wait(f64),
}

impl<P: Clone> Leg<P> {
    /// It with other limits.
    pub fn within(&self, limits: &Limits) -> Self {
        match self {
            Self::To(to, _) => Self::To(to.clone(), *limits),
            Self::Around(arc, _) => Self::Around(*arc, *limits),
            Self::Wait(length) => Self::Wait(*length),
        }
    }
}

/// Where a leg of a path begins and ends, m; of an arc its circle, and the limits along it.
struct Course {
    from: Vec<f64>,
    to: Vec<f64>,
    circle: Option<(Circle, Limits)>,
}

/// One coordinate of a leg.
#[derive(Debug, Clone, PartialEq)]
pub struct Passage {
    /// When it begins, s.
    pub begin: f64,
    /// Where, m.
    pub from: f64,
    /// Where it ends, m.
    pub to: f64,
    /// The circle that it is a coordinate of; none of a straight leg.
    pub turn: Option<Turn>,
    /// Of this coordinate; of an arc of the length along it.
    stroke: Stroke,
}

impl Passage {
    /// s
    pub fn duration(&self) -> f64 {
        self.stroke.duration
    }

    /// The smallest and the largest position on it, m.
    pub fn extremes(&self) -> [f64; 2] {
        let ends = [self.from.min(self.to), self.from.max(self.to)];
        let Some(turn) = &self.turn else { return ends };
        let [low, high] = turn.extremes();
        [low.min(ends[0]), high.max(ends[1])]
    }

    /// The share of its length that is passed at this time, s; of a coordinate that stands still 0 or 1.
    pub fn share(&self, time: f64) -> f64 {
        let t = time - self.begin;
        match t {
            t if t <= 0.0 => 0.0,
            t if t >= self.duration() => 1.0,
            t => (self.stroke.reference(t, false).position / self.stroke.distance).clamp(0.0, 1.0),
        }
    }

    /// The direction in which it comes to its end, ±1, and from when on (s) a place beyond the end has been passed
    /// over; 0 of one that does not move.
    pub fn approach(&self) -> (f64, f64) {
        let Some(turn) = &self.turn else {
            let way = self.to - self.from;
            return (self.begin, if way == 0.0 { 0.0 } else { way.signum() });
        };
        // The last thousandth of a circle, which passes over places beyond its end before.
        let before = turn.at(&Reference::at(0.999 * turn.length)).position;
        (self.begin + self.duration(), (self.to - before).signum())
    }

    /// The reference where its stroke is there.
    fn placed(&self, gone: Reference) -> Reference {
        match &self.turn {
            Some(turn) => turn.at(&gone),
            None => Reference { position: self.from + gone.position, ..gone },
        }
    }

    /// Begin and end of each polynomial of its stroke, s.
    fn seams(&self) -> impl Iterator<Item = f64> {
        let Self { begin, stroke: Stroke { duration, pieces, .. }, .. } = self;
        let first = pieces.iter().map(|(seam, _)| *seam).filter(move |seam| *seam <= 0.5 * duration);
        first.flat_map(move |seam| [begin + seam, begin + (duration - seam)])
    }

    /// The end of the polynomial that holds at `t`, s.
    fn seam(&self, t: f64) -> f64 {
        let seam = self.begin + self.stroke.seam(t - self.begin);
        self.turn.as_ref().map_or(seam, |turn| seam.min(t + turn.step()))
    }
}

/// Moves one after another, each from rest to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    passages: Vec<Passage>,
    start: f64,
    end: f64,
    /// Impulses (time, s; amplitude) that it is convolved with; empty for none.
    shaper: Vec<[f64; 2]>,
    /// Times and references that a log has instead of strokes.
    samples: Vec<(f64, Reference)>,
}

impl Profile {
    /// The chain of `legs` from `start` (m), the first beginning at time zero.
    pub fn new(start: f64, legs: &[Leg]) -> Result<Self> {
        let (mut time, mut position) = (0.0, start);
        let mut passages = Vec::new();
        for leg in legs {
            match *leg {
                Leg::Around(..) => return Err(Error::new("an arc needs two coordinates")),
                Leg::Wait(length) => {
                    if !(0.0..=1e9).contains(&length) {
                        return Err(Error::new(format!("a wait of {length} s")).allowed("from 0 s to 1e9 s"));
                    }
                    time += length;
                }
                Leg::To(target, ref limits) => {
                    let stroke = Stroke::new(target - position, limits)?;
                    let (begin, from) = (time, position);
                    (time, position) = (begin + stroke.duration(), target);
                    passages.push(Passage { begin, from, to: target, turn: None, stroke });
                }
            }
        }
        Ok(Self { passages, start, end: time, shaper: Vec::new(), samples: Vec::new() })
    }

    /// The chain of `legs` from `start` (m): a profile for each coordinate, all on one clock. Limits hold along the
    /// path, and across an arc too, whose speed they lower; legs meet at rest.
    ///
    /// ```
    /// use taut::signal::profile::{Leg, Limits, Profile};
    /// let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
    /// // 50 mm along the path, of which 30 mm along one coordinate and 40 mm along the other.
    /// let path = Profile::along(&[0.0, 0.0], &[Leg::To(vec![0.03, 0.04], limits)])?;
    /// let alone = Profile::new(0.0, &[Leg::To(0.05, limits)])?;
    /// assert_eq!((path[0].target(), path[1].target()), (0.03, 0.04));
    /// assert_eq!(path[0].end(), alone.end());
    /// assert!((path[0].at(0.1).speed - 0.6 * alone.at(0.1).speed).abs() < 1e-15);
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn along(start: &[f64], legs: &[Leg<Vec<f64>>]) -> Result<Vec<Self>> {
        let (mut position, mut gone) = (start.to_vec(), 0.0);
        // The legs by the length of the path, and the ends of each that moves, with its circle.
        let (mut lengths, mut courses) = (Vec::new(), Vec::new());
        for leg in legs {
            let (length, to, circle, limits) = match leg {
                Leg::Wait(length) => {
                    lengths.push(Leg::Wait(*length));
                    continue;
                }
                Leg::To(to, limits) => {
                    let square: f64 = to.iter().zip(&position).map(|(to, from)| (to - from).powi(2)).sum();
                    (square.sqrt(), to.clone(), None, *limits)
                }
                Leg::Around(arc, limits) => {
                    let from = position[..].try_into().map_err(|_| Error::new("an arc needs two coordinates"))?;
                    let circle = arc.circle(from)?;
                    let limits = circle.within(limits);
                    (circle.length(), arc.to.to_vec(), Some((circle, limits)), limits)
                }
            };
            gone += length;
            lengths.push(Leg::To(gone, limits));
            courses.push(Course { from: std::mem::replace(&mut position, to.clone()), to, circle });
        }
        let whole = Self::new(0.0, &lengths)?;
        let of_coordinate = |k: usize| {
            let passage = |(along, course): (&Passage, &Course)| {
                let (Passage { begin, stroke, .. }, from, to) = (along, course.from[k], course.to[k]);
                let turn = course.circle.as_ref().map(|(circle, limits)| circle.coordinate(k, limits));
                let share = if stroke.distance > 0.0 { (to - from) / stroke.distance } else { 0.0 };
                let stroke = if turn.is_some() { stroke.clone() } else { stroke.scaled(share, to - from) };
                Passage { begin: *begin, from, to, turn, stroke }
            };
            Self {
                passages: whole.passages.iter().zip(&courses).map(passage).collect(),
                start: start[k],
                end: whole.end,
                shaper: Vec::new(),
                samples: Vec::new(),
            }
        };
        Ok((0..start.len()).map(of_coordinate).collect())
    }

    /// End of the last of these references, shapers apart, s; 0 of none.
    pub fn last_end(profiles: &[Self]) -> f64 {
        profiles.iter().map(Self::end).fold(0.0, f64::max)
    }

    /// Time from which on all of these references rest, s; 0 of none.
    pub fn last_rest(profiles: &[Self]) -> f64 {
        profiles.iter().map(Self::rest).fold(0.0, f64::max)
    }

    /// The reference of each coordinate along legs: [`Profile::new`] of one, [`Profile::along`] of several.
    pub fn of_legs(start: &[f64], legs: &[Leg<Vec<f64>>]) -> Result<Vec<Self>> {
        let [start] = start else { return Self::along(start, legs) };
        let alone = |leg: &Leg<Vec<f64>>| match leg {
            Leg::To(to, limits) => Leg::To(to[0], *limits),
            Leg::Around(arc, limits) => Leg::Around(*arc, *limits),
            Leg::Wait(length) => Leg::Wait(*length),
        };
        Ok(vec![Self::new(*start, &legs.iter().map(alone).collect::<Vec<_>>())?])
    }

    /// A reference of which `positions` (m) at increasing `times` (s) are known: straight lines between them. Speed and
    /// acceleration are those of the parabola through a sample and its neighbours; jerk and snap are not known, and
    /// zero.
    pub fn sampled(times: &[f64], positions: &[f64]) -> Self {
        let n = times.len().min(positions.len());
        let samples = (0..n)
            .map(|k| {
                let mut reference = Reference::at(positions[k]);
                if k > 0 && k + 1 < n {
                    let (before, after) = (times[k] - times[k - 1], times[k + 1] - times[k]);
                    let slopes =
                        [(positions[k] - positions[k - 1]) / before, (positions[k + 1] - positions[k]) / after];
                    reference.speed = (after * slopes[0] + before * slopes[1]) / (before + after);
                    reference.acceleration = 2.0 * (slopes[1] - slopes[0]) / (before + after);
                }
                (times[k], reference)
            })
            .collect();
        let start = positions.first().copied().unwrap_or(0.0);
        let end = times.last().copied().unwrap_or(0.0);
        Self { passages: Vec::new(), start, end, shaper: Vec::new(), samples }
    }

    /// This profile through a shaper: impulses (time, s; amplitude) whose amplitudes add up to 1.
    pub fn shaped(mut self, shaper: &[[f64; 2]]) -> Self {
        self.shaper = shaper.to_vec();
        self
    }

    /// Reference at time `t`, s.
    pub fn at(&self, t: f64) -> Reference {
        if self.shaper.is_empty() {
            return self.plain(t);
        }
        self.shaper.iter().fold(Reference::default(), |sum, &[late, part]| sum.plus(part, self.plain(t - late)))
    }

    fn plain(&self, t: f64) -> Reference {
        if let Some((_, last)) = self.samples.last() {
            let k = self.samples.partition_point(|(time, _)| *time <= t);
            let Some((after, next)) = self.samples.get(k) else { return *last };
            let Some((before, this)) = k.checked_sub(1).map(|k| &self.samples[k]) else {
                return Reference::at(self.start);
            };
            let share = (t - before) / (after - before);
            return Reference::default().plus(1.0 - share, *this).plus(share, *next);
        }
        let index = self.passages.partition_point(|passage| passage.begin <= t);
        match index.checked_sub(1).and_then(|index| self.passages.get(index)) {
            None => Reference::at(self.start),
            Some(passage) if t - passage.begin >= passage.duration() => Reference::at(passage.to),
            Some(passage) => passage.placed(passage.stroke.at(t - passage.begin)),
        }
    }

    /// The position from `t` on as a polynomial Σ c_k (time − t)ᵏ, m, and until when it holds, s: later than `t` by
    /// more than rounding.
    pub fn piece(&self, t: f64) -> ([f64; 5], f64) {
        self.piece_beyond(t, 8.0 * f64::EPSILON * t.abs())
    }

    /// The same where seams up to `slack` (s) later than `t` are behind.
    pub(super) fn piece_beyond(&self, t: f64, slack: f64) -> ([f64; 5], f64) {
        let mut late = 0.0;
        loop {
            let (coefficients, until) = self.piece_at(t + late);
            if until > t + slack {
                return (shifted(&coefficients, -late), until);
            }
            // A seam is a sum and may lie before the time at which its piece is found: look farther, also where t is 0.
            late = (2.0 * late).max(slack).max(f64::MIN_POSITIVE);
        }
    }

    fn piece_at(&self, t: f64) -> ([f64; 5], f64) {
        if self.shaper.is_empty() {
            return self.plain_piece(t);
        }
        let mut sum = ([0.0; 5], f64::INFINITY);
        for &[late, part] in &self.shaper {
            let (coefficients, until) = self.plain_piece(t - late);
            sum.0.iter_mut().zip(coefficients).for_each(|(sum, c)| *sum += part * c);
            sum.1 = sum.1.min(until + late);
        }
        sum
    }

    fn plain_piece(&self, t: f64) -> ([f64; 5], f64) {
        let rest = |position: f64, until: Option<f64>| ([position, 0.0, 0.0, 0.0, 0.0], until.unwrap_or(f64::INFINITY));
        if let Some((_, last)) = self.samples.last() {
            let k = self.samples.partition_point(|(time, _)| *time <= t);
            let Some((after, next)) = self.samples.get(k) else { return rest(last.position, None) };
            let Some((before, this)) = k.checked_sub(1).map(|k| &self.samples[k]) else {
                return rest(self.start, Some(*after));
            };
            let slope = (next.position - this.position) / (after - before);
            return ([this.position + slope * (t - before), slope, 0.0, 0.0, 0.0], *after);
        }
        let index = self.passages.partition_point(|passage| passage.begin <= t);
        let next = self.passages.get(index).map(|passage| passage.begin);
        let Some(passage) = index.checked_sub(1).and_then(|index| self.passages.get(index)) else {
            return rest(self.start, next);
        };
        if t - passage.begin >= passage.duration() {
            return rest(passage.to, next);
        }
        let Reference { position, speed, acceleration, jerk, snap } =
            passage.placed(passage.stroke.reference(t - passage.begin, true));
        ([position, speed, acceleration / 2.0, jerk / 6.0, snap / 24.0], passage.seam(t))
    }

    /// Times at which a derivative of one of these references jumps, shapers included, in ascending order, s: the ends
    /// of the segments of each stroke, and the samples of a log.
    pub fn seams(profiles: &[Self]) -> Vec<f64> {
        let of_profile = |profile: &Self| -> Vec<f64> {
            let samples = profile.samples.iter().map(|(time, _)| *time);
            profile.passages.iter().flat_map(Passage::seams).chain(samples).collect()
        };
        let through = |profile: &Self, seams: Vec<f64>| -> Vec<f64> {
            if profile.shaper.is_empty() {
                return seams;
            }
            profile.shaper.iter().flat_map(|[late, _]| seams.iter().map(move |seam| late + seam)).collect()
        };
        let mut seams: Vec<f64> = profiles.iter().flat_map(|profile| through(profile, of_profile(profile))).collect();
        seams.sort_by(f64::total_cmp);
        seams
    }

    /// True if it is known by the samples of a log.
    pub fn is_sampled(&self) -> bool {
        !self.samples.is_empty()
    }

    /// When the last leg ends, s, a shaper apart.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// When the reference rests for good, s: its end, and behind it what a shaper adds.
    pub fn rest(&self) -> f64 {
        self.end + self.shaper.iter().fold(0.0, |late, impulse| f64::max(late, impulse[0]))
    }

    /// Start position, m.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// The largest distance from its start on its passages, m; 0 of a sampled one.
    pub fn excursion(&self) -> f64 {
        let away = |passage: &Passage| passage.extremes().map(|place| (place - self.start()).abs());
        self.passages.iter().flat_map(away).fold(0.0, f64::max)
    }

    /// End position, m.
    pub fn target(&self) -> f64 {
        let sampled = self.samples.last().map(|(_, reference)| reference.position);
        sampled.unwrap_or_else(|| self.passages.last().map_or(self.start, |passage| passage.to))
    }

    /// This coordinate of each leg that moves; none of a reference that is a log's.
    pub fn passages(&self) -> &[Passage] {
        &self.passages
    }
}
