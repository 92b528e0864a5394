//! The key figures of a gantry's run: where bridge and cart ended, how fast they went, what belts and motors took, how
//! far they were from where the drives say, and when everything came to rest.

use super::watch::{Sum, Watch, Watched};
use super::{EventCount, Peak};
use crate::machine::Machine;
use crate::machine::gantry::BODIES;
use crate::mechanism::{DRIVES, Mechanism, Mode, Roles, Shown, State};
use crate::solve::{Closer, Curve, Event, Gap, Observe, Stretch};

/// Peaks before those of the spans: speeds of bridge and cart, errors of both, currents, speeds of the motors.
const FIRST_SPAN: usize = 8;

/// The key figures of one run of a gantry. SI units; x is the bridge's position, y the cart's on it.
#[derive(Debug, Clone, PartialEq)]
pub struct GantryMetrics {
    /// When the run ended, s.
    pub end: f64,
    /// x and y at the end, m.
    pub final_position: [f64; 2],
    /// ẋ and ẏ at the end, m/s.
    pub final_speed: [f64; 2],
    /// x and y as the angles of the drive pulleys say, with the belts taken as rigid, at the end, m.
    pub final_by_drives: [f64; 2],
    /// ẋ and ẏ of largest magnitude, m/s.
    pub peak_speed: [Peak; 2],
    /// x and y as the drives say minus what they are, of largest magnitude, m: what the belts' stretch does.
    pub peak_error: [Peak; 2],
    /// Currents of the left and the right motor of largest magnitude, A.
    pub peak_current: [Peak; DRIVES],
    /// Speeds of the left and the right motor behind its gear, of largest magnitude, rad/s: those of the pulleys where
    /// the gear is stiff.
    pub peak_drive_speed: [Peak; DRIVES],
    /// Stretch of each span of largest magnitude, m, in the order of [`Kind::spans`](crate::machine::Kind).
    pub peak_stretch: Vec<Peak>,
    /// Force in each span of largest magnitude, N, damping included, in the order of
    /// [`Kind::spans`](crate::machine::Kind).
    pub peak_force: Vec<Peak>,
    /// When everything came to rest, s, if it has; 0 if nothing ever moved. None while anything moves, and where a body
    /// has no dry friction to stick by.
    pub stop_time: Option<f64>,
    /// Whether everything is at rest at the end: bodies and rotors.
    pub settled: bool,
    /// Whether all four bodies are stuck at the end.
    pub bodies_rest: bool,
    /// Events of left pulley, right pulley, bridge and cart.
    pub events: [EventCount; BODIES],
}

/// Gathers [`GantryMetrics`] from a run that it observes: peaks between rows, too, and not of rows.
///
/// ```
/// use taut::case::Case;
/// use taut::metrics::GantryMeter;
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
/// let case = GantryCase::from_text_with("frame.toml", text, &[])?;
/// let course = Course::of(&case.experiments[0]);
/// let mut meter = GantryMeter::new(&case.gantry);
/// let (mechanism, rows) = (case.gantry.mechanism(), &mut |_: &taut::trajectory::Trajectory| Flow::Continue);
/// let outcome = stream_mechanism(&mechanism, &course, Solver::Exact, (Detail::None, Some(&mut meter)), rows)?;
/// // The left motor alone pulls bridge and cart alike.
/// let [x, y] = meter.finish(&outcome.events).final_position;
/// assert!(x < -0.1 && y < -0.1);
/// # Ok::<(), taut::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct GantryMeter {
    gantry: Machine,
    roles: Roles,
    watch: Watch,
}

impl GantryMeter {
    /// A meter for a run of this gantry.
    pub fn new(gantry: &Machine) -> Self {
        Self::of(gantry, &gantry.mechanism())
    }

    /// The same where its mechanism is there already.
    pub fn of(gantry: &Machine, mechanism: &Mechanism) -> Self {
        let (roles, drives) = (mechanism.roles.clone(), &mechanism.drives);
        let alone = |shown: Shown| vec![(shown, 1.0)];
        let stretches =
            |sum: &[(usize, f64)]| sum.iter().map(|&(span, weight)| (Shown::Stretch(span), weight)).collect();
        let mut sums: Vec<Sum> = roles.loads.iter().map(|load| alone(Shown::Speed(*load, 1.0))).collect();
        sums.extend(gantry.geometry().slides.iter().map(|slide| stretches(slide.error)));
        sums.extend((0..DRIVES).map(|drive| alone(Shown::Current(drive))));
        sums.extend(drives.iter().map(|drive| alone(Shown::Speed(drive.shaft, 1.0))));
        sums.extend(gantry.geometry().spans.iter().map(|span| stretches(span.by_others)));
        sums.extend(roles.spans.iter().map(|span| alone(Shown::Force(*span, 1.0))));
        Self { gantry: gantry.clone(), roles, watch: Watch::new(mechanism, &sums) }
    }

    /// The metrics of the run that was observed and whose events these are.
    pub fn finish(self, events: &[Event]) -> GantryMetrics {
        let Self { gantry, roles, watch } = self;
        let Watched { end, state, peaks, stop_time, bodies_rest, rotors_rest, events } = watch.finish(events);
        let (stretches, forces) = peaks[FIRST_SPAN..].split_at(roles.spans.len());
        let by_drives = gantry.by_drives(&state.position);
        GantryMetrics {
            end,
            final_position: std::array::from_fn(|load| state.position[roles.loads[load]]),
            final_speed: std::array::from_fn(|load| state.speed[roles.loads[load]]),
            final_by_drives: std::array::from_fn(|slide| by_drives[slide]),
            peak_speed: [peaks[0], peaks[1]],
            peak_error: [peaks[2], peaks[3]],
            peak_current: [peaks[4], peaks[5]],
            peak_drive_speed: [peaks[6], peaks[7]],
            peak_stretch: stretches.to_vec(),
            peak_force: forces.to_vec(),
            stop_time,
            settled: bodies_rest && rotors_rest,
            bodies_rest,
            events: std::array::from_fn(|body| events[body]),
        }
    }
}

impl Observe for GantryMeter {
    fn stretch(&mut self, stretch: &Stretch) -> Closer {
        self.watch.stretch(stretch)
    }

    fn pass(&mut self, gap: &Gap) -> bool {
        self.watch.pass(gap)
    }

    fn see(&mut self, curve: &Curve) {
        self.watch.see(curve);
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        self.watch.end(time, state, mode);
    }
}
