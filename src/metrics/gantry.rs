//! The key figures of a gantry's run: where bridge and cart ended, how fast they went, what belts and motors took, how far they were from
//! where the drives say, and when everything came to rest.

use super::watch::{Sum, Watch, Watched};
use super::{EventCount, Peak};
use crate::mechanism::{DRIVES, Mode, Shown, State};
use crate::solve::{Curve, Event, Gap, Observe};
use crate::stage::gantry::{BODIES, BRIDGE, CART, Gantry, LEFT, RIGHT};

/// Peaks before those of the spans: speeds of bridge and cart, errors of both, currents.
const FIRST_SPAN: usize = 6;

/// What one run of a gantry shows. SI units; x is the bridge's position, y the cart's on it.
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
    /// Force in each span of largest magnitude, N, damping included, in the order of [`Routing::spans`](crate::stage::gantry::Routing).
    pub peak_force: Vec<Peak>,
    /// When everything came to rest, s, if it has; 0 if nothing ever moved. None while anything moves, and where a body has no dry friction
    /// to stick by.
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
/// use taut::case::GantryCase;
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
    gantry: Gantry,
    watch: Watch,
}

impl GantryMeter {
    /// A meter for a run of this gantry.
    pub fn new(gantry: &Gantry) -> Self {
        let mut sums: Vec<Sum> = [BRIDGE, CART].map(|body| vec![(Shown::Speed(body, 1.0), 1.0)]).to_vec();
        sums.extend(gantry.routing.drive_error().map(|sum| {
            let stretch = |(span, weight): (usize, f64)| (Shown::Stretch(span), weight);
            sum.map(stretch).to_vec()
        }));
        sums.extend((0..DRIVES).map(|drive| vec![(Shown::Current(drive), 1.0)]));
        sums.extend((0..gantry.routing.spans().len()).map(|span| vec![(Shown::Force(span, 1.0), 1.0)]));
        Self { gantry: gantry.clone(), watch: Watch::new(&gantry.mechanism(), &sums) }
    }

    /// The metrics of the run that was observed and whose events these are.
    pub fn finish(self, events: &[Event]) -> GantryMetrics {
        let Watched { end, state, peaks, stop_time, bodies_rest, rotors_rest, events } = self.watch.finish(events);
        GantryMetrics {
            end,
            final_position: [state.position[BRIDGE], state.position[CART]],
            final_speed: [state.speed[BRIDGE], state.speed[CART]],
            final_by_drives: self.gantry.place([state.position[LEFT], state.position[RIGHT]]),
            peak_speed: [peaks[0], peaks[1]],
            peak_error: [peaks[2], peaks[3]],
            peak_current: [peaks[4], peaks[5]],
            peak_force: peaks[FIRST_SPAN..].to_vec(),
            stop_time,
            settled: bodies_rest && rotors_rest,
            bodies_rest,
            events: std::array::from_fn(|body| events[body]),
        }
    }
}

impl Observe for GantryMeter {
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
