//! The observer that gathers the figures of a move.

use super::contour::{Contour, ContourGauge};
use super::figures::{DriveFigures, Figures, LoadFigures, is_made};
use super::quadrature::{larger, shifted, slope, square};
use super::sampled::SLIDES;
use crate::case::Experiment;
use crate::machine::{Machine, SlideAt};
use crate::mechanism::{Limit, Mechanism, Mode, Shown, State};
use crate::metrics::{Held, Meter, Metrics, Peak, Sought};
use crate::signal::profile::{Passage, Profile};
use crate::solve::{self, Curve, Gap, Observe, Polynomial, TERMS, integral, integral_of_product};

/// A machine, and its mechanism with the readings of a move.
pub(super) fn read(machine: &Machine) -> (&Machine, Mechanism) {
    let mut mechanism = machine.mechanism();
    mechanism.readings = machine.readings_of_move(&mechanism);
    (machine, mechanism)
}

/// Gathers the figures of a move that it observes.
pub(super) struct Gauge<'a> {
    meter: Meter,
    profiles: &'a [Profile],
    window: f64,
    loads: Vec<LoadGauge>,
    drives: Vec<DriveGauge>,
    spans: Vec<SpanGauge>,
    contour: Option<ContourGauge>,
    end: f64,
    /// True if only the errors of the slides, settling and current are required.
    is_brief: bool,
}

/// Figures of a slide, gathered during a run.
struct LoadGauge {
    body: usize,
    /// The reading of its position.
    position: usize,
    /// Its peak speed, if the readings do not contain its speed.
    peak_speed: Option<Peak>,
    /// Time (s) and direction of overshoot: [`Passage::approach`] of the last leg that moves it.
    approach: (f64, f64),
    target: f64,
    /// ∫ of its squared error.
    square: f64,
    /// The largest distance from its start at the end of any curve, m.
    reached: f64,
    start: f64,
    /// Last time outside its window after the profile, and true if it is outside now.
    outside: Option<f64>,
    is_outside: bool,
    seen: LoadFigures,
}

/// Figures of a drive, gathered during a run.
struct DriveGauge {
    pulley: usize,
    /// The reading of its current.
    current: usize,
    voltage: Voltage,
    /// Weights of the coordinates in the position of its part of the belt.
    shares: &'static [f64],
    /// That position by the slides minus r φ as a sum of elongations: reading and weight.
    elongations: Vec<(usize, f64)>,
    /// ∫ of the squares of following error, voltage and current.
    squares: [f64; 3],
    /// True if a limit of its amplifier is active now.
    saturated: bool,
    seen: DriveFigures,
}

/// Least and greatest force in a span, gathered during a run.
struct SpanGauge {
    /// The reading of its force.
    force: usize,
    seen: [Peak; 2],
}

/// The voltage at a motor's terminals.
enum Voltage {
    /// A reading.
    Read(usize),
    /// R i + L di/dt + K_e n φ̇ from the reading of the shaft's speed behind the gear.
    Computed { speed: usize, resistance: f64, inductance: f64, back_emf: f64 },
    /// None: each phase of a stepper has its own.
    OfPhases,
}

impl Voltage {
    fn on(&self, curve: &Curve, current: &Polynomial) -> Polynomial {
        match *self {
            Self::OfPhases => Polynomial([0.0; TERMS]),
            Self::Read(q) => curve.polynomial(q),
            Self::Computed { speed, resistance, inductance, back_emf } => {
                let (rate, speed) = (slope(current, curve.length), curve.polynomial(speed));
                let sum = |k: usize| resistance * current.0[k] + inductance * rate.0[k] + back_emf * speed.0[k];
                Polynomial(std::array::from_fn(sum))
            }
        }
    }
}

impl LoadGauge {
    fn new((slide, profile): (&SlideAt, &Profile), mechanism: &Mechanism) -> Self {
        let find = |shown: Shown| mechanism.readings.iter().position(|reading| *reading == shown);
        let mut approaches = profile.passages().iter().rev().map(Passage::approach);
        Self {
            body: slide.body,
            position: find(Shown::Position(slide.body, 1.0)).unwrap_or_default(),
            peak_speed: match find(Shown::Speed(slide.body, 1.0)) {
                Some(_) => None,
                None => Some(Peak::default()),
            },
            approach: approaches.find(|(_, direction)| *direction != 0.0).unwrap_or_default(),
            target: profile.target(),
            reached: 0.0,
            start: profile.start(),
            square: 0.0,
            outside: None,
            is_outside: false,
            seen: LoadFigures::default(),
        }
    }

    /// Updates overshoot and settling after the last stroke and the profile, which ends at `end`.
    fn settle(&mut self, curve: &Curve, end: f64, window: f64) {
        let mut away = curve.polynomial(self.position);
        away.0[0] -= self.target;
        let share = |time: f64| ((time - curve.begin) / curve.length).max(0.0);
        let (last, done) = (share(self.approach.0), share(end));
        if last < 1.0 && self.approach.1 != 0.0 {
            let beyond = if self.approach.1 > 0.0 { away } else { away.negative() };
            if beyond.bound() > self.seen.overshoot {
                self.seen.overshoot = self.seen.overshoot.max(beyond.greatest(last, 1.0).1);
            }
        }
        let ends = away.at(1.0);
        self.reached = self.reached.max((ends + self.target - self.start).abs());
        self.is_outside = done < 1.0 && ends.abs() > window;
        if done < 1.0 && away.bound() > window {
            if self.is_outside {
                self.outside = Some(curve.begin + curve.length);
                return;
            }
            let edges = [-window, window].map(|edge| {
                let mut beyond = away;
                beyond.0[0] -= edge;
                beyond.zeros(done, 1.0).last().copied()
            });
            if let Some(s) = edges.into_iter().flatten().reduce(f64::max) {
                self.outside = Some(curve.begin + s * curve.length);
            }
        }
    }
}

impl SpanGauge {
    fn from_machine(machine: &Machine, mechanism: &Mechanism) -> Vec<Self> {
        let find = |span: usize| {
            let wanted = Shown::Force(machine.span_alike(span)?, 1.0);
            mechanism.readings.iter().position(|reading| *reading == wanted)
        };
        let spans = 0..machine.geometry().spans.len();
        spans.filter_map(find).map(|force| Self { force, seen: [Peak::default(); 2] }).collect()
    }

    fn take(&mut self, value: f64, time: f64) {
        let [least, greatest] = &mut self.seen;
        if value < least.value {
            *least = Peak { value, time };
        }
        if value > greatest.value {
            *greatest = Peak { value, time };
        }
    }

    fn see(&mut self, curve: &Curve) {
        let force = curve.polynomial(self.force);
        if force.stays_between(self.seen[0].value, self.seen[1].value) {
            return;
        }
        let (low, high) = force.range();
        if low < self.seen[0].value {
            let (s, value) = force.negative().greatest(0.0, 1.0);
            self.take(-value, curve.begin + s * curve.length);
        }
        if high > self.seen[1].value {
            let (s, value) = force.greatest(0.0, 1.0);
            self.take(value, curve.begin + s * curve.length);
        }
    }
}

impl DriveGauge {
    /// Of the drive of this number; `elongations` are springs and weights.
    fn new(machine: &Machine, mechanism: &Mechanism, (drive, elongations): (usize, Vec<(usize, f64)>)) -> Self {
        let find = |shown: Shown| mechanism.readings.iter().position(|reading| *reading == shown);
        let mechanisms_drive = &mechanism.drives[drive];
        let motor = &mechanisms_drive.motor;
        Self {
            pulley: mechanisms_drive.pulley,
            current: find(Shown::Current(drive)).unwrap_or_default(),
            voltage: match find(Shown::Voltage(drive)) {
                _ if motor.stepper.is_some() => Voltage::OfPhases,
                Some(q) => Voltage::Read(q),
                None => Voltage::Computed {
                    speed: find(Shown::Speed(mechanisms_drive.shaft, 1.0)).unwrap_or_default(),
                    resistance: motor.resistance,
                    inductance: motor.inductance,
                    back_emf: motor.gear_ratio * motor.back_emf_constant,
                },
            },
            shares: machine.belt_shares()[drive],
            elongations: elongations
                .into_iter()
                .filter_map(|(spring, weight)| Some((find(Shown::Stretch(spring))?, weight)))
                .collect(),
            squares: [0.0; 3],
            saturated: false,
            seen: DriveFigures::default(),
        }
    }

    /// Adds voltage and current over a curve.
    fn power(&mut self, curve: &Curve, is_brief: bool) {
        let i = curve.polynomial(self.current);
        if is_brief {
            self.squares[2] += curve.length * square(&i, (0.0, 1.0));
            return;
        }
        let v = self.voltage.on(curve, &i);
        larger(&mut self.seen.voltage.0, &v, (0.0, 1.0), curve);
        larger(&mut self.seen.current.0, &i, (0.0, 1.0), curve);
        let h = curve.length;
        let (volts, amperes) = (v.at_nodes(), i.at_nodes());
        self.squares[1] += h * integral_of_product(&volts, &volts);
        self.squares[2] += h * integral_of_product(&amperes, &amperes);
        // Energy in and back, split at sign changes of the power.
        let mut count = |energy: f64| {
            if energy > 0.0 { self.seen.energy.0 += energy } else { self.seen.energy.1 -= energy }
        };
        if v.keeps_its_sign() && i.keeps_its_sign() {
            count(h * integral_of_product(&volts, &amperes));
        } else {
            let mut seams = vec![0.0, 1.0];
            for turning in [v, i].iter().filter(|quantity| !quantity.keeps_its_sign()) {
                seams.extend(turning.zeros(0.0, 1.0));
            }
            seams.sort_by(f64::total_cmp);
            for pair in seams.windows(2) {
                count(h * integral((pair[0], pair[1]), |s| v.at(s) * i.at(s)));
            }
        }
        if self.saturated {
            self.seen.amplifier_limited += h;
        }
    }
}

impl<'a> Gauge<'a> {
    pub(super) fn new(machine: &Machine, experiment: &Experiment, profiles: &'a [Profile], window: f64) -> Self {
        let (_, mechanism) = read(machine);
        let loads = machine.geometry().slides.iter().zip(profiles);
        let drives = machine.elongations_of_drives(&mechanism).into_iter().enumerate();
        Self {
            meter: Meter::with(machine, &Sought::all(machine, &mechanism), Held::last(experiment), &experiment.inputs),
            profiles,
            window,
            loads: loads.map(|load| LoadGauge::new(load, &mechanism)).collect(),
            drives: drives.map(|drive| DriveGauge::new(machine, &mechanism, drive)).collect(),
            spans: SpanGauge::from_machine(machine, &mechanism),
            contour: Contour::along(profiles).map(ContourGauge::new),
            end: 0.0,
            is_brief: false,
        }
    }

    /// Gathers only the errors of the slides, settling and current.
    pub(super) fn briefly(self) -> Self {
        Self { is_brief: true, ..self }
    }

    /// Adds the motion over the part of a curve on which the references are one polynomial each.
    fn track(&mut self, curve: &Curve, part: (f64, f64), references: &[Polynomial]) {
        let mut errors = [Polynomial([0.0; TERMS]); SLIDES];
        let mut places = [Polynomial([0.0; TERMS]); SLIDES];
        for ((load, reference), (error, place)) in
            self.loads.iter_mut().zip(references).zip(errors.iter_mut().zip(&mut places))
        {
            let x = curve.polynomial(load.position);
            *place = x;
            // e = y − x
            *error = Polynomial(std::array::from_fn(|k| reference.0[k] - x.0[k]));
            larger(&mut load.seen.error.peak, error, part, curve);
            load.square += curve.length * square(error, part);
            if let (Some(peak), false) = (&mut load.peak_speed, self.is_brief) {
                larger(peak, &slope(&x, curve.length), part, curve);
            }
        }
        if self.is_brief {
            return;
        }
        for drive in &mut self.drives {
            // y − r φ = Σ s (y − x) + Σ w d; y − r φ₁ = y − x − d₁ of an axis
            let mut following = Polynomial([0.0; TERMS]);
            for (error, share) in errors.iter().zip(drive.shares) {
                following.0.iter_mut().zip(error.0).for_each(|(sum, term)| *sum += share * term);
            }
            for &(elongation, weight) in &drive.elongations {
                let elongation = curve.polynomial(elongation);
                following.0.iter_mut().zip(elongation.0).for_each(|(sum, term)| *sum += weight * term);
            }
            larger(&mut drive.seen.following.peak, &following, part, curve);
            drive.squares[0] += curve.length * square(&following, part);
        }
        if let Some(contour) = &mut self.contour {
            contour.track(curve, part, &places);
        }
    }

    pub(super) fn finish(self, events: &[solve::Event]) -> (Figures, Metrics) {
        let end = self.profiles.first().map_or(0.0, Profile::end);
        let mean = |sum: f64| (sum / self.end.max(f64::MIN_POSITIVE)).sqrt();
        let mut metrics = self.meter.finish(events);
        for (load, peak) in metrics.loads.iter_mut().zip(self.loads.iter().map(|load| load.peak_speed)) {
            load.peak_speed = peak.unwrap_or(load.peak_speed);
        }
        let left = self.loads.iter().filter_map(|load| load.outside).reduce(f64::max);
        let made = |(load, profile): (&LoadGauge, &Profile)| is_made(profile, self.window, load.reached);
        let is_outside =
            self.loads.iter().any(|load| load.is_outside) || !self.loads.iter().zip(self.profiles).all(made);
        let figures = Figures {
            settling: match left {
                _ if self.end < end || is_outside => None,
                None => Some(0.0),
                Some(last) => Some(last - end),
            },
            contour: self.contour.map(|contour| contour.finish(self.end)),
            spans: self.spans.iter().map(|span| span.seen).collect(),
            loads: self
                .loads
                .into_iter()
                .map(|mut load| {
                    load.seen.error.rms = mean(load.square);
                    load.seen
                })
                .collect(),
            drives: self
                .drives
                .into_iter()
                .map(|mut drive| {
                    let [following, voltage, current] = drive.squares.map(mean);
                    let seen = &mut drive.seen;
                    (seen.following.rms, seen.voltage.1, seen.current.1) = (following, voltage, current);
                    drive.seen
                })
                .collect(),
        };
        (figures, metrics)
    }
}

impl Observe for Gauge<'_> {
    fn pass(&mut self, gap: &Gap) -> bool {
        if self.is_brief {
            return true;
        }
        self.meter.pass(gap);
        for span in &mut self.spans {
            span.take(gap.from[span.force], gap.begin);
            span.take(gap.to[span.force], gap.begin + gap.length);
        }
        for (number, drive) in self.drives.iter_mut().enumerate() {
            let mode = &gap.mode.drive[number];
            drive.saturated = mode.voltage != Limit::Inside || mode.current != Limit::Inside;
            let current = Some((&mut drive.seen.current.0, drive.current));
            let voltage = match drive.voltage {
                Voltage::Read(q) => Some((&mut drive.seen.voltage.0, q)),
                Voltage::Computed { .. } | Voltage::OfPhases => None,
            };
            for (peak, q) in [voltage, current].into_iter().flatten() {
                for (value, time) in [(gap.from[q], gap.begin), (gap.to[q], gap.begin + gap.length)] {
                    if value.abs() > peak.value.abs() {
                        *peak = Peak { value, time };
                    }
                }
            }
        }
        true
    }

    fn see(&mut self, curve: &Curve) {
        if !self.is_brief {
            self.meter.see(curve);
            self.spans.iter_mut().for_each(|span| span.see(curve));
        }
        for drive in &mut self.drives {
            drive.power(curve, self.is_brief);
        }
        let (mut begin, mut from) = (curve.begin, 0.0);
        while from < 1.0 {
            let (mut references, mut seam) = ([Polynomial([0.0; TERMS]); SLIDES], f64::INFINITY);
            for (reference, profile) in references.iter_mut().zip(self.profiles) {
                let (coefficients, until) = profile.piece(begin);
                *reference = shifted(&coefficients, from, curve.length);
                seam = seam.min(until);
            }
            let to = ((seam - curve.begin) / curve.length).min(1.0);
            self.track(curve, (from, to), &references);
            (begin, from) = (seam, to);
        }
        let end = self.profiles.first().map_or(0.0, Profile::end);
        for load in &mut self.loads {
            load.settle(curve, end, self.window);
        }
    }

    fn sees_all(&self) -> bool {
        true
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        self.meter.end(time, state, mode);
        self.end = time;
        let mut references = [0.0; SLIDES];
        for ((load, profile), reference) in self.loads.iter_mut().zip(self.profiles).zip(&mut references) {
            *reference = profile.at(time).position;
            load.seen.error.last = *reference - state.position[load.body];
        }
        let radius = self.meter.machine().pulley_radius;
        for drive in &mut self.drives {
            let y: f64 = drive.shares.iter().zip(references).map(|(share, reference)| share * reference).sum();
            drive.seen.following.last = y - radius * state.position[drive.pulley];
        }
        if let (Some(contour), [x, y]) = (&mut self.contour, &self.loads[..]) {
            contour.end(time, [x.body, y.body].map(|body| state.position[body]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_and_the_greatest_force_have_their_times() {
        let mut span = SpanGauge { force: 0, seen: [Peak::default(); 2] };
        for (value, time) in [(2.0, 0.1), (-3.0, 0.2), (1.0, 0.3), (-1.0, 0.4)] {
            span.take(value, time);
        }
        assert_eq!(span.seen, [Peak { value: -3.0, time: 0.2 }, Peak { value: 2.0, time: 0.1 }]);
    }
}
