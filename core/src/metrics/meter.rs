//! The observer that gathers the key figures of a run.

use super::rotor::Rotor;
use super::steady::{Held, Plateau};
use super::{EventCount, LostSteps, Metrics, OfDrive, OfLoad, OfSpan, OfYaw, Peak, Seek};
use crate::friction::Motion;
use crate::machine::{Machine, Stepper};
use crate::mechanism::{Mechanism, Mode, Shown, State, Status, What};
use crate::plan::Experiment;
use crate::signal::Signal;
use crate::solve::{
    Closer, Curve, Event, Extremes, Gap, Gaps, NEWS, Observe, Polynomial, QUANTITIES, Reading, Stretch, applied,
    reading,
};
use std::sync::Arc;

/// Source of a peak: a reading, or a sum of readings.
#[derive(Debug, Clone, Copy, PartialEq)]
enum PeakSource {
    /// Index of a reading, and the factor to the quantity.
    Reading(usize, f64),
    /// Index of a sum.
    Sum(usize),
}

/// A sum of readings by their numbers, each with its weight.
type Sum = Vec<(usize, f64)>;

/// Readings from which the figures are made: the same for all machines of a structure.
#[derive(Debug, Clone, PartialEq, Default)]
struct Places {
    /// Bodies other than rotors.
    bodies: usize,
    load_speeds: Vec<PeakSource>,
    load_errors: Vec<PeakSource>,
    /// Speeds of the drive pulleys at the pitch circle; only for a machine with one drive.
    belt_speeds: Vec<PeakSource>,
    shaft_speeds: Vec<PeakSource>,
    currents: Vec<PeakSource>,
    stretches: Vec<PeakSource>,
    /// Of a bridge that yaws.
    yaw: Option<PeakSource>,
    forces: Vec<PeakSource>,
    sums: Vec<Sum>,
    /// Independent rotors, and the readings of their speeds.
    rotors: Vec<(usize, usize)>,
    /// The bodies that the motors' shafts turn with.
    shafts: Vec<usize>,
}

impl Places {
    fn new(machine: &Machine, mechanism: &Mechanism) -> Self {
        let geometry = machine.geometry();
        let find = |wanted: Shown| mechanism.readings.iter().position(|shown| *shown == wanted);
        let place = |wanted: Shown| find(wanted).map_or(PeakSource::Sum(usize::MAX), |q| PeakSource::Reading(q, 1.0));
        let mut sums: Vec<Sum> = Vec::new();
        // An elongation without a reading is a sum of those with one.
        let yaw = machine.yaw_spring().and_then(|spring| find(Shown::Stretch(spring))).zip(machine.yaw);
        // `on_yaw` is what the sum is by itself per a ψ.
        let mut summed = |terms: &[(usize, f64)], on_yaw: f64| match terms {
            &[(span, 1.0)] if yaw.is_none() && find(Shown::Stretch(span)).is_some() => place(Shown::Stretch(span)),
            _ => {
                let term = |&(span, weight): &(usize, f64)| Some((find(Shown::Stretch(span))?, weight));
                let of_yaw = yaw.map(|(reading, yaw)| (reading, yaw.arm() * geometry.left_to_yaw(on_yaw, terms)));
                sums.push(terms.iter().filter_map(term).chain(of_yaw.filter(|(_, weight)| *weight != 0.0)).collect());
                PeakSource::Sum(sums.len() - 1)
            }
        };
        let load_errors = geometry.slides.iter().map(|slide| summed(slide.error, 0.0)).collect();
        let stretches = (0..geometry.spans.len()).map(|span| match place(Shown::Stretch(span)) {
            read @ PeakSource::Reading(..) => read,
            PeakSource::Sum(_) => summed(geometry.spans[span].by_others, geometry.spans[span].on_yaw),
        });
        let stretches = stretches.collect();
        let yaw = yaw.map(|(reading, _)| PeakSource::Reading(reading, 1.0));
        let belt_speeds: Vec<PeakSource> = match &mechanism.drives[..] {
            [drive] => vec![place(Shown::Speed(drive.pulley, machine.pulley_radius))],
            _ => Vec::new(),
        };
        let shafts = mechanism.drives.iter().enumerate().map(|(number, drive)| match belt_speeds.get(number) {
            // Behind a stiff gear the shaft turns with the pulley, whose speed is already followed.
            Some(&PeakSource::Reading(q, _)) if drive.shaft == drive.pulley => {
                PeakSource::Reading(q, 1.0 / machine.pulley_radius)
            }
            _ => place(Shown::Speed(drive.shaft, 1.0)),
        });
        let shaft_speeds = shafts.collect();
        let (bodies, rotors) = (geometry.bodies.len(), mechanism.held_bodies().end..mechanism.bodies.len());
        let rotor = |body: usize| Some((body, find(Shown::Speed(body, 1.0))?));
        Self {
            bodies,
            load_speeds: geometry.slides.iter().map(|slide| place(Shown::Speed(slide.body, 1.0))).collect(),
            load_errors,
            belt_speeds,
            shaft_speeds,
            currents: (0..mechanism.drives.len()).map(|drive| place(Shown::Current(drive))).collect(),
            stretches,
            yaw,
            forces: (0..geometry.spans.len())
                .map(|span| place(Shown::Force(machine.span_alike(span).unwrap_or(span), 1.0)))
                .collect(),
            sums,
            rotors: rotors.filter_map(rotor).collect(),
            shafts: mechanism.drives.iter().map(|drive| drive.shaft).collect(),
        }
    }

    /// Sources of a figure, for all parts of its role.
    fn sought(&self, seek: Seek) -> &[PeakSource] {
        match seek {
            Seek::LoadSpeed => &self.load_speeds,
            Seek::LoadError => &self.load_errors,
            Seek::BeltSpeed => &self.belt_speeds,
            Seek::ShaftSpeed => &self.shaft_speeds,
            Seek::Current => &self.currents,
            Seek::Stretch => &self.stretches,
            Seek::Yaw => self.yaw.as_slice(),
            Seek::Force => &self.forces,
            Seek::SteadySpeed | Seek::StopTime => &[],
        }
    }
}

/// A quantity whose peak is sought: a reading, or a sum of readings, by its number.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Followed {
    Reading(usize),
    Sum(usize),
}

/// The quantities that a meter follows, made once for many machines of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Sought {
    places: Arc<Places>,
    followed: Arc<[Followed]>,
    /// Their sums, and that of the steady speed.
    quantities: Arc<[Sum]>,
    readings: [bool; QUANTITIES],
    sums: bool,
    steady_speed: bool,
    /// True if the motion has to be followed at all.
    follows: bool,
}

impl Sought {
    /// All quantities with figures.
    pub fn all(machine: &Machine, mechanism: &Mechanism) -> Self {
        Self::new(machine, mechanism, &Seek::ALL.map(|seek| (seek, None)))
    }

    /// Only these quantities, each for one or all parts of its role, and values at the end: other peaks and speeds keep
    /// their initial values and cost nothing.
    pub fn new(machine: &Machine, mechanism: &Mechanism, seeks: &[(Seek, Option<usize>)]) -> Self {
        let places = Places::new(machine, mechanism);
        let (mut readings, mut sums) = ([false; QUANTITIES], false);
        for &(seek, part) in seeks {
            for (number, place) in places.sought(seek).iter().enumerate() {
                match *place {
                    _ if part.is_some_and(|part| part != number) => {}
                    PeakSource::Reading(q, _) => readings[q] = true,
                    PeakSource::Sum(_) => sums = true,
                }
            }
        }
        let steady_speed = seeks.iter().any(|(seek, _)| *seek == Seek::SteadySpeed) && mechanism.drives.len() == 1;
        let follows = !seeks.is_empty() || !places.rotors.is_empty();
        let of_readings = (0..QUANTITIES).filter(|q| readings[*q]).map(Followed::Reading);
        let of_sums = (0..if sums { places.sums.len() } else { 0 }).map(Followed::Sum);
        let followed: Arc<[Followed]> = of_readings.chain(of_sums).collect();
        let sum = |followed: &Followed| match *followed {
            Followed::Reading(q) => vec![(q, 1.0)],
            Followed::Sum(sum) => places.sums[sum].clone(),
        };
        let quantities = followed.iter().map(sum).chain([vec![(reading::CART_SPEED, 1.0)]]).collect();
        Self { places: Arc::new(places), followed, quantities, readings, sums, steady_speed, follows }
    }
}

/// Gathers [`Metrics`] from a run that it observes, with peaks of the motion itself, not of rows.
///
/// ```
/// use taut::case::Case;
/// use taut::metrics::Meter;
/// use taut::solve::{Course, Detail, Flow, Solver, stream_mechanism};
/// # let text = r#"
/// # kind = "h-frame"
/// # motor = { torque_constant = "23 mN m/A", back_emf_constant = "23 mV s/rad", resistance = "0.71 ohm" }
/// # drive_pulley = { radius = "19.4 mm", inertia = "6.3e-5 kg m^2" }
/// # bridge = { mass = "0.838 kg" }
/// # cart = { mass = "0.362 kg" }
/// # belt = { stiffness = ["132.76 kN/m", "132.76 kN/m", "58.885 kN/m"] }
/// # experiment = [{ name = "pulse", input = { left = { pulse = "5 V", for = "0.25 s" } }, until = 1, every = 1e-3 }]
/// # "#;
/// let case = Case::from_text("frame.toml", text)?;
/// let mechanism = case.machine.mechanism();
/// let course = Course::new(&mechanism, &case.experiments[0]);
/// let mut meter = Meter::new(&case.machine, &case.experiments[0]);
/// let rows = &mut |_: &taut::trajectory::Trajectory| Flow::Continue;
/// let outcome = stream_mechanism(&mechanism, &course, Solver::Exact, (Detail::None, Some(&mut meter)), rows)?;
/// // The left motor alone pulls bridge and cart alike.
/// let loads = meter.finish(&outcome.events).loads;
/// assert!(loads[0].position < -0.1 && loads[1].position < -0.1);
/// # Ok::<(), taut::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Meter {
    machine: Machine,
    sought: Sought,
    /// Peaks of readings.
    peaks: [Peak; QUANTITIES],
    /// Peaks of sums of readings.
    sums: Vec<Peak>,
    plateau: Option<Plateau>,
    rotors: Vec<(usize, Rotor)>,
    /// Commanded positions of steppers; empty for other motors.
    commands: Vec<Signal>,
    /// True if any body slid or was free.
    moved: bool,
    end: f64,
    state: State,
    bodies_rest: bool,
}

impl Meter {
    /// A meter for all figures of a run of `experiment` on `machine`.
    pub fn new(machine: &Machine, experiment: &Experiment) -> Self {
        let sought = Sought::all(machine, &machine.mechanism());
        Self::with(machine, &sought, Held::last(experiment), &experiment.inputs)
    }

    /// A meter for these figures of a run with these inputs, whose last constant interval is known.
    pub fn with(machine: &Machine, sought: &Sought, held: Option<Held>, inputs: &[Signal]) -> Self {
        let sums = if sought.sums { sought.places.sums.len() } else { 0 };
        Self {
            machine: machine.clone(),
            sought: sought.clone(),
            peaks: [Peak::default(); QUANTITIES],
            sums: vec![Peak::default(); sums],
            plateau: held.filter(|_| sought.steady_speed).map(Plateau::new),
            rotors: sought.places.rotors.iter().map(|&(body, reading)| (body, Rotor::new(reading))).collect(),
            commands: if machine.stepper().is_some() { inputs.to_vec() } else { Vec::new() },
            moved: false,
            end: 0.0,
            state: State::default(),
            bodies_rest: false,
        }
    }

    /// The machine that is observed.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Magnitude above which each reading has a new peak.
    #[inline]
    fn heights(&self) -> Reading {
        let mut heights = [f64::INFINITY; QUANTITIES];
        for ((height, peak), sought) in heights.iter_mut().zip(&self.peaks).zip(self.sought.readings) {
            *height = if sought { peak.value.abs() } else { f64::INFINITY };
        }
        heights
    }

    /// Peaks of the required readings, with their indices.
    fn sought(&mut self) -> impl Iterator<Item = (usize, &mut Peak)> {
        let readings = self.sought.readings;
        self.peaks.iter_mut().enumerate().filter(move |(q, _)| readings[*q])
    }

    /// True if any body other than rotors slides or is free.
    fn slides(&self, mode: &Mode) -> bool {
        mode.motion[..self.sought.places.bodies].iter().any(|motion| *motion != Motion::Stuck)
    }

    /// Final commanded positions of the slides with steppers, without stretch, m.
    fn commanded(&self) -> Vec<f64> {
        if self.commands.is_empty() {
            return Vec::new();
        }
        let (mechanism, mut state) = (self.machine.mechanism(), State::default());
        let inputs = applied(&self.commands, &mechanism, self.end);
        for (drive, input) in inputs.into_iter().enumerate().take(self.commands.len()) {
            state.position[mechanism.drives[drive].pulley] = input * mechanism.angle_per_input(drive);
        }
        self.machine.by_drives(&state.position)
    }

    /// Metrics of the observed run with these events.
    pub fn finish(self, events: &[Event]) -> Metrics {
        let (places, machine, state) = (&*self.sought.places, &self.machine, &self.state);
        let geometry = machine.geometry();
        let peak = |place: Option<&PeakSource>| match place.copied() {
            Some(PeakSource::Reading(q, 1.0)) => self.peaks[q],
            Some(PeakSource::Reading(q, factor)) => Peak { value: factor * self.peaks[q].value, ..self.peaks[q] },
            Some(PeakSource::Sum(sum)) => self.sums.get(sum).copied().unwrap_or_default(),
            None => Peak::default(),
        };
        let mut counts = vec![EventCount::default(); places.bodies];
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
        let settled = self.bodies_rest && rotors_rest;
        let commanded = self.commanded();
        let load = |(number, (slide, by_drives)): (usize, (&crate::machine::SlideAt, f64))| OfLoad {
            position: state.position[slide.body],
            speed: state.speed[slide.body],
            by_drives,
            peak_speed: peak(places.load_speeds.get(number)),
            peak_error: peak(places.load_errors.get(number)),
            command_error: commanded.get(number).map(|commanded| commanded - state.position[slide.body]),
        };
        let drive = |(number, at): (usize, &crate::machine::DriveAt)| OfDrive {
            angle: state.position[at.pulley],
            shaft_speed: state.speed[places.shafts[number]],
            peak_belt_speed: places.belt_speeds.get(number).map(|place| peak(Some(place))),
            peak_speed: peak(places.shaft_speeds.get(number)),
            peak_current: peak(places.currents.get(number)),
            lost_steps: machine.drives[number].motor.stepper.map(|_| lost_steps(events, number)),
        };
        let span = |span: usize| OfSpan {
            peak_stretch: peak(places.stretches.get(span)),
            peak_force: peak(places.forces.get(span)),
        };
        Metrics {
            end: self.end,
            loads: geometry.slides.iter().zip(machine.by_drives(&state.position)).enumerate().map(load).collect(),
            drives: geometry.drives.iter().enumerate().map(drive).collect(),
            spans: (0..geometry.spans.len()).map(span).collect(),
            yaw: machine.yaw_body().map(|body| OfYaw { angle: state.position[body], peak: peak(places.yaw.as_ref()) }),
            bodies: counts,
            steady_speed: self.plateau.as_ref().and_then(|plateau| plateau.steady_speed(machine)),
            stop_time: last.map(|time| time.max(turned)).filter(|_| settled),
            settled,
            bodies_rest: self.bodies_rest,
            rotors_rest,
        }
    }
}

/// Steps lost by a drive in these events.
fn lost_steps(events: &[Event], drive: usize) -> LostSteps {
    let mut own = LostSteps::default();
    for event in events.iter().filter(|event| event.part.what == What::Field(drive)) {
        if let (Status::Slipped(from), Status::Slipped(to)) = (event.from, event.to) {
            own.first_slip = own.first_slip.or(Some(event.time));
            own.slips += u64::from(to.abs_diff(from));
            own.at_end = i64::from(to) * i64::from(Stepper::STEPS_PER_TOOTH);
        }
    }
    own
}

/// A sum of readings.
#[inline]
fn weighed(sum: &[(usize, f64)], reading: &Reading) -> f64 {
    sum.iter().map(|&(q, weight)| weight * reading[q]).sum()
}

/// Bound of a sum's deviation from a straight line, from those of its readings.
#[inline]
fn bowed(sum: &[(usize, f64)], bow: &Reading) -> f64 {
    sum.iter().map(|&(q, weight)| weight.abs() * bow[q]).sum()
}

impl Observe for Meter {
    fn stretch(&mut self, stretch: &Stretch) -> Closer {
        // The stop time of a rotor depends on its largest speed so far.
        if !self.rotors.is_empty() {
            return Closer::Now;
        }
        self.moved |= stretch.interval > 0.0 && self.slides(stretch.mode);
        for (q, peak) in self.sought() {
            if stretch.most[q] > peak.value.abs() * (1.0 - NEWS) {
                let (value, time) = stretch.largest(q, NEWS);
                // Its initial value is the final value of the previous one.
                if time > stretch.begin { peak.come_to(value, time) } else { peak.take(value, time) }
            }
        }
        let mut closer = match &self.plateau {
            Some(plateau) if plateau.meets(stretch) => Gaps::first(stretch.readings.len() - 1),
            _ => stretch.rising_above(&self.heights(), 1.0 + NEWS),
        };
        for (sum, peak) in self.sought.places.sums.iter().zip(&mut self.sums) {
            let bow = bowed(sum, stretch.bow);
            if let [only] = stretch.readings {
                peak.take(weighed(sum, only), stretch.begin);
            }
            for (row, [from, to]) in stretch.readings.array_windows().enumerate() {
                let ends = [weighed(sum, from), weighed(sum, to)];
                peak.pass(ends, (stretch.time(row), stretch.time(row + 1)), bow == 0.0 && ends[0] == ends[1]);
            }
            for (gap, [from, to]) in stretch.readings.array_windows().enumerate() {
                let bound = Gap::bound_of(weighed(sum, from), weighed(sum, to), bow);
                closer.set(gap, bound > peak.value.abs() * (1.0 + NEWS));
            }
        }
        Closer::Later(closer)
    }

    fn pass(&mut self, gap: &Gap) -> bool {
        let end = gap.begin + gap.length;
        let (news, mut closer) = gap.rises_above(&self.heights(), [1.0 - NEWS, 1.0 + NEWS]);
        if news {
            for (q, peak) in self.sought() {
                peak.pass([gap.from[q], gap.to[q]], (gap.begin, end), gap.holds(q));
            }
            // Values at its ends need no search between them if a bound covers the interval.
            closer = gap.rises_above(&self.heights(), [1.0, 1.0 + NEWS]).1;
        }
        for (sum, peak) in self.sought.places.sums.iter().zip(&mut self.sums) {
            let (from, to) = (weighed(sum, gap.from), weighed(sum, gap.to));
            let bow = bowed(sum, gap.bow);
            peak.pass([from, to], (gap.begin, end), bow == 0.0 && from == to);
            closer |= Gap::bound_of(from, to, bow) > peak.value.abs() * (1.0 + NEWS);
        }
        if let Some(plateau) = &mut self.plateau {
            let speed = reading::CART_SPEED;
            closer |= plateau.pass((gap.begin, end), [gap.from[speed], gap.to[speed]], gap.range(speed));
        }
        for (_, rotor) in &mut self.rotors {
            closer |= rotor.pass(gap);
        }
        self.moved |= gap.length > 0.0 && self.slides(gap.mode);
        closer && gap.length > 0.0
    }

    fn see(&mut self, curve: &Curve) {
        if curve.may_exceed(&self.heights()) {
            let (lows, highs) = curve.ranges();
            for (q, peak) in self.sought() {
                if highs[q] > peak.value.abs() {
                    let (s, value) = curve.polynomial(q).greatest(0.0, 1.0);
                    peak.take(value, curve.begin + s * curve.length);
                }
                if -lows[q] > peak.value.abs() {
                    let (s, value) = curve.polynomial(q).negative().greatest(0.0, 1.0);
                    peak.take(-value, curve.begin + s * curve.length);
                }
            }
        }
        for (sum, peak) in self.sought.places.sums.iter().zip(&mut self.sums) {
            let mut course = Polynomial::default();
            for &(q, weight) in sum {
                course.add(&curve.polynomial(q), weight);
            }
            if course.may_exceed(peak.value.abs()) {
                let (s, value) = course.largest(0.0, 1.0);
                peak.take(value, curve.begin + s * curve.length);
            }
        }
        if let Some(plateau) = &mut self.plateau {
            let speed = curve.polynomial(reading::CART_SPEED);
            plateau.see((curve.begin, curve.begin + curve.length), &|from| speed.extremes(from, 1.0));
        }
        for (_, rotor) in &mut self.rotors {
            rotor.see(curve);
        }
    }

    fn follows(&self) -> bool {
        self.sought.follows
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        (self.end, self.state) = (time, *state);
        let stuck = |body: usize| mode.motion[body] == Motion::Stuck && state.speed[body] == 0.0;
        self.bodies_rest = (0..self.sought.places.bodies).all(stuck);
        for (body, rotor) in &mut self.rotors {
            rotor.end(state.speed[*body]);
        }
    }
}

impl Meter {
    fn peak(&mut self, quantity: usize) -> Option<&mut Peak> {
        match *self.sought.followed.get(quantity)? {
            Followed::Reading(q) => Some(&mut self.peaks[q]),
            Followed::Sum(sum) => Some(&mut self.sums[sum]),
        }
    }
}

impl Extremes for Meter {
    fn quantities(&self) -> &[Sum] {
        &self.sought.quantities
    }

    fn sought(&self) -> usize {
        self.sought.followed.len()
    }

    fn come_to(&mut self, quantity: usize, value: f64, time: f64) {
        if let Some(peak) = self.peak(quantity) {
            peak.come_to(value, time);
        }
    }

    fn take(&mut self, quantity: usize, value: f64, time: f64) {
        if let Some(peak) = self.peak(quantity) {
            peak.take(value, time);
        }
    }

    fn steady(&self) -> Option<(f64, f64)> {
        Some(self.plateau.as_ref()?.watched())
    }

    fn pass_steady(&mut self, times: (f64, f64), ends: [f64; 2], range: (f64, f64)) -> bool {
        self.plateau.as_mut().is_some_and(|plateau| plateau.pass(times, ends, range))
    }

    fn see_steady(&mut self, times: (f64, f64), range: &dyn Fn(f64) -> (f64, f64)) {
        if let Some(plateau) = &mut self.plateau {
            plateau.see(times, range);
        }
    }

    fn moves(&mut self, mode: &Mode) {
        self.moved |= self.slides(mode);
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        Observe::end(self, time, state, mode);
    }
}
