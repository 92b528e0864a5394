//! Figures of any mechanism: the peaks of sums of its readings, events by body, and when everything came to rest.

use super::{EventCount, NEWS, Peak, Rotor};
use crate::friction::Motion;
use crate::mechanism::{Mechanism, Mode, Shown, State};
use crate::solve::{Closer, Curve, Event, Gap, Gaps, Observe, Polynomial, Reading, Stretch};

/// A sum of readings, each with its weight: one reading by itself, or a difference of two.
pub type Sum = Vec<(Shown, f64)>;

/// Observes a run of a mechanism, and keeps nothing of it but the peaks.
#[derive(Debug, Clone)]
pub struct Watch {
    /// Bodies other than rotors.
    bodies: usize,
    /// Sums by numbers of readings.
    sums: Vec<Vec<(usize, f64)>>,
    peaks: Vec<Peak>,
    rotors: Vec<(usize, Rotor)>,
    moved: bool,
    end: f64,
    state: State,
    bodies_rest: bool,
}

/// The figures of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Watched {
    /// When the run ended, s.
    pub end: f64,
    /// Ways and speeds at the end.
    pub state: State,
    /// The peak of each sum, in the order of the sums.
    pub peaks: Vec<Peak>,
    /// When everything came to rest, s, if it has; 0 if nothing ever moved.
    pub stop_time: Option<f64>,
    /// Whether all bodies other than rotors are stuck at the end.
    pub bodies_rest: bool,
    /// Whether no rotor turns at the end by more than a millionth of its largest speed.
    pub rotors_rest: bool,
    /// Events of each body other than rotors.
    pub events: Vec<EventCount>,
}

impl Watch {
    /// For a run of this mechanism.
    ///
    /// # Panics
    ///
    /// Where a quantity in `sums`, or the speed of a rotor that turns by itself, is not among the mechanism's readings.
    pub fn new(mechanism: &Mechanism, sums: &[Sum]) -> Self {
        let place = |wanted: &Shown| {
            let place = mechanism.readings.iter().position(|shown| shown == wanted);
            place.unwrap_or_else(|| panic!("{wanted:?} is not among the readings"))
        };
        let bodies = mechanism.held_bodies().len();
        let rotor = |body: usize| (body, Rotor::new(place(&Shown::Speed(body, 1.0))));
        Self {
            bodies,
            sums: sums.iter().map(|sum| sum.iter().map(|(shown, weight)| (place(shown), *weight)).collect()).collect(),
            peaks: vec![Peak::default(); sums.len()],
            rotors: (bodies..mechanism.bodies.len()).map(rotor).collect(),
            moved: false,
            end: 0.0,
            state: State::default(),
            bodies_rest: false,
        }
    }

    /// Whether any body other than rotors slides or is free.
    fn slides(&self, mode: &Mode) -> bool {
        mode.motion[..self.bodies].iter().any(|motion| *motion != Motion::Stuck)
    }

    /// The figures of the run whose events these are.
    pub fn finish(self, events: &[Event]) -> Watched {
        let mut counts = vec![EventCount::default(); self.bodies];
        for event in events {
            if let Some(count) = event.body().and_then(|body| counts.get_mut(body)) {
                count.add(event);
            }
        }
        let rotors_rest = self.rotors.iter().all(|(_, rotor)| rotor.rests);
        let turned = self.rotors.iter().map(|(_, rotor)| rotor.turned).fold(0.0, f64::max);
        let last = match events.iter().rfind(|event| event.body().is_some()) {
            Some(last) => Some(last.time),
            None => Some(0.0).filter(|_| !self.moved),
        };
        Watched {
            end: self.end,
            state: self.state,
            peaks: self.peaks,
            stop_time: last.map(|time| time.max(turned)).filter(|_| self.bodies_rest && rotors_rest),
            bodies_rest: self.bodies_rest,
            rotors_rest,
            events: counts,
        }
    }
}

/// A sum of what is read.
#[inline]
fn weighed(sum: &[(usize, f64)], reading: &Reading) -> f64 {
    sum.iter().map(|&(q, weight)| weight * reading[q]).sum()
}

impl Observe for Watch {
    fn stretch(&mut self, stretch: &Stretch) -> Closer {
        // When a rotor was last fast depends on how fast it had been by then.
        if !self.rotors.is_empty() {
            return Closer::Now;
        }
        self.moved |= stretch.interval > 0.0 && self.slides(stretch.mode);
        let mut wanted = Gaps::NONE;
        for (sum, peak) in self.sums.iter().zip(&mut self.peaks) {
            let bow = sum.iter().map(|&(q, weight)| weight.abs() * stretch.bow[q]).sum::<f64>();
            if let [only] = stretch.readings {
                peak.take(weighed(sum, only), stretch.begin);
            }
            for (row, [from, to]) in stretch.readings.array_windows().enumerate() {
                let ends = [weighed(sum, from), weighed(sum, to)];
                peak.pass(ends, (stretch.time(row), stretch.time(row + 1)), bow == 0.0 && ends[0] == ends[1]);
            }
            for (gap, [from, to]) in stretch.readings.array_windows().enumerate() {
                let bound = Gap::bound_of(weighed(sum, from), weighed(sum, to), bow);
                wanted.set(gap, bound > peak.value.abs() * (1.0 + NEWS));
            }
        }
        Closer::Later(wanted)
    }

    fn pass(&mut self, gap: &Gap) -> bool {
        let end = gap.begin + gap.length;
        let mut closer = false;
        for (sum, peak) in self.sums.iter().zip(&mut self.peaks) {
            let (from, to) = (weighed(sum, gap.from), weighed(sum, gap.to));
            let bow = sum.iter().map(|&(q, weight)| weight.abs() * gap.bow[q]).sum::<f64>();
            peak.pass([from, to], (gap.begin, end), bow == 0.0 && from == to);
            closer |= Gap::bound_of(from, to, bow) > peak.value.abs() * (1.0 + NEWS);
        }
        for (_, rotor) in &mut self.rotors {
            closer |= rotor.pass(gap);
        }
        self.moved |= gap.length > 0.0 && self.slides(gap.mode);
        closer && gap.length > 0.0
    }

    fn see(&mut self, curve: &Curve) {
        for (sum, peak) in self.sums.iter().zip(&mut self.peaks) {
            let mut course = Polynomial::default();
            for &(q, weight) in sum {
                course.add(&curve.of(q), weight);
            }
            if course.bound() > peak.value.abs() {
                let (s, value) = course.largest(0.0, 1.0);
                peak.take(value, curve.begin + s * curve.length);
            }
        }
        for (_, rotor) in &mut self.rotors {
            rotor.see(curve);
        }
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        (self.end, self.state) = (time, *state);
        let stuck = |body: usize| mode.motion[body] == Motion::Stuck && state.speed[body] == 0.0;
        self.bodies_rest = (0..self.bodies).all(stuck);
        for (body, rotor) in &mut self.rotors {
            rotor.end(state.speed[*body]);
        }
    }
}
