//! Properties of a structure that tuning, limit cycles, the case reader and reports require. None has a default, so
//! that the compiler lists them all for a new structure.

use super::placement::{CASCADE, least};
use super::{
    Cascade, CurrentLoop, Design, FeedForwardModel, Filter, Fuzzy, OpenLoop, Pid, SlidingMode, StateFeedback, Structure,
};
use crate::machine::Machine;
use crate::machine::rigid::Rigid;
use std::f64::consts::PI;

/// Method by which gains of a structure are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TunedBy {
    /// They follow from bandwidth and damping, where a search begins.
    Bandwidth,
    /// They follow from weights, at which a search begins.
    Weights,
    /// They are not searched for.
    Nothing,
}

/// Properties of every structure.
pub trait Tunable {
    /// Its key in the case file.
    fn word(&self) -> &'static str;

    /// Its name for people.
    fn name(&self) -> &'static str;

    /// True if it uses a scale beside the encoder.
    fn reads_scale(&self) -> bool;

    /// True if its position loop is closed at the scale, which does not measure stretch.
    fn follows_scale(&self) -> bool;

    /// True if it has an inner current loop.
    fn commands_current(&self) -> bool;

    /// Default feed-forward.
    fn feed_forward(&self) -> FeedForwardModel;

    /// Method by which its gains are found.
    fn tuned_by(&self) -> TunedBy;

    /// With gains for this bandwidth (Hz) and damping by [`super::placement::place`]; none without such gains.
    fn placed(&self, design: &Design, machine: &Machine, bandwidth: f64, damping: f64) -> Option<Structure>;

    /// Further starting gains of a search.
    fn starts(&self, design: &Design, machine: &Machine) -> Vec<Structure>;

    /// With its integral action multiplied by `factor`, without it if that is 0; none without integral action.
    fn integral_times(&self, factor: f64) -> Option<Structure>;

    /// Growth of the command under a constant error, V/(m s) or A/(m s); zero if it does not follow from the gains
    /// alone.
    fn ramp(&self) -> f64;

    /// True if it has no damping and needs a derivative.
    fn lacks_damping(&self) -> bool;

    /// Cost of its margins on a set of axes, as a number of samples of a run.
    fn costs(&self) -> u64;

    /// Its gains in the form of industrial drives, without those not in use.
    fn in_drives(&self) -> Vec<InDrives>;
}

/// A gain in the form of industrial drives.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct InDrives {
    /// Name in manuals of drives.
    pub name: &'static str,
    /// Value in `unit`.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
}

impl Filter {
    /// Its parameters in the form of industrial drives: frequency, −3 dB width of a notch that goes to zero, and depth.
    pub fn in_drives(&self) -> Vec<InDrives> {
        match *self {
            Self::Notch { frequency, depth, damping } => vec![
                InDrives { name: "notch frequency", value: frequency, unit: "Hz" },
                InDrives { name: "notch width", value: 2.0 * damping * frequency, unit: "Hz" },
                InDrives { name: "notch depth", value: 20.0 * (depth / damping).log10(), unit: "dB" },
            ],
            Self::LowPass { frequency, damping } => vec![
                InDrives { name: "low-pass frequency", value: frequency, unit: "Hz" },
                InDrives { name: "low-pass damping", value: damping, unit: "" },
            ],
        }
    }
}

impl Design {
    /// Gains and filters in the form of industrial drives.
    pub fn in_drives(&self) -> Vec<InDrives> {
        let filters = self.filters.iter().flat_map(Filter::in_drives);
        self.structure.tunable().in_drives().into_iter().chain(filters).collect()
    }
}

/// Cost without and with the solution of two Riccati equations.
const QUICK: u64 = 500;
const SOLVED: u64 = 2000;

impl Tunable for Pid {
    fn word(&self) -> &'static str {
        "pid"
    }

    fn name(&self) -> &'static str {
        "PID"
    }

    fn reads_scale(&self) -> bool {
        false
    }

    fn follows_scale(&self) -> bool {
        false
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn feed_forward(&self) -> FeedForwardModel {
        FeedForwardModel::None
    }

    fn tuned_by(&self) -> TunedBy {
        TunedBy::Bandwidth
    }

    fn placed(&self, _: &Design, machine: &Machine, bandwidth: f64, damping: f64) -> Option<Structure> {
        let rigid = Rigid::new(machine);
        let (mass, w) = (rigid.mass, 2.0 * PI * bandwidth);
        if machine.stepper().is_some() {
            // M s² + d s + k (1 + K_p + K_d s + K_i/s): the field holds the rotor like a spring
            let stiffness = rigid.field * (1.0 + self.proportional);
            let damper = 2.0 * damping * (mass * stiffness).max(0.0).sqrt();
            let kept = |old: f64, new: f64| if old == 0.0 { 0.0 } else { new };
            return Some(Structure::Pid(Pid {
                integral: kept(self.integral, w * (1.0 + self.proportional)),
                derivative: kept(self.derivative, least(damper, rigid.drag()) / rigid.field),
                ..*self
            }));
        }
        let (drag, push) = (rigid.drag(), rigid.force_per_command().abs());
        let sign = rigid.force_per_command().signum();
        // s³ + (d + g K_d)/M s² + g K_p/M s + g K_i/M
        let real = if self.integral == 0.0 { 0.0 } else { damping * w };
        let gain = |coefficient: f64| sign * mass * coefficient / push;
        Some(Structure::Pid(Pid {
            proportional: gain(w * w + 2.0 * damping * w * real),
            integral: gain(real * w * w),
            derivative: match self.derivative {
                0.0 => 0.0,
                _ => sign * least(mass * (2.0 * damping * w + real), drag) / push,
            },
            ..*self
        }))
    }

    /// Skogestad's rule for k e^{−θs}/(s (τ s + 1)) with τ_c = θ: K_c = 1/(2 k θ), τ_I = 8 θ, τ_D = τ, in series.
    ///
    /// S. Skogestad, "Simple analytic rules for model reduction and PID controller tuning", Journal of Process Control
    /// 13 (2003).
    fn starts(&self, design: &Design, machine: &Machine) -> Vec<Structure> {
        let rigid = Rigid::new(machine);
        let late = design.delay + 0.5 * design.every + 1.0 / (2.0 * PI * self.filter);
        let (drag, push) = (rigid.drag(), rigid.force_per_command());
        // M ẍ + d ẋ = g u:  k = g/d, τ = M/d; without drag k/τ is what counts. The field of a stepper is a spring.
        if drag <= 0.0 || machine.stepper().is_some() {
            return Vec::new();
        }
        let (lag, gain) = (rigid.mass / drag, push / drag);
        let (c, integral, derivative) = (0.5 / (gain * late), 8.0 * late, lag.min(8.0 * late));
        // From series to parallel form.
        let factor = 1.0 + derivative / integral;
        let kept = |old: f64, new: f64| if old == 0.0 { 0.0 } else { new };
        vec![Structure::Pid(Pid {
            proportional: c * factor,
            integral: kept(self.integral, c / integral),
            derivative: kept(self.derivative, c * derivative),
            ..*self
        })]
    }

    fn integral_times(&self, factor: f64) -> Option<Structure> {
        let integral = factor * self.integral;
        (self.integral != 0.0).then_some(Structure::Pid(Self { integral, ..*self }))
    }

    fn ramp(&self) -> f64 {
        self.integral
    }

    fn lacks_damping(&self) -> bool {
        self.derivative == 0.0
    }

    fn costs(&self) -> u64 {
        QUICK
    }

    /// In series form K_p (1 + 1/(T_n s) + T_v s).
    fn in_drives(&self) -> Vec<InDrives> {
        let used =
            |name, value: f64| (value > 0.0 && value.is_finite()).then_some(InDrives { name, value, unit: "ms" });
        let times = [
            used("T_n (reset time)", 1e3 * self.proportional / self.integral),
            used("T_v (derivative time)", 1e3 * self.derivative / self.proportional),
        ];
        times.into_iter().flatten().collect()
    }
}

impl Tunable for Cascade {
    fn word(&self) -> &'static str {
        "cascade"
    }

    fn name(&self) -> &'static str {
        if self.current.is_some() { "cascade P-PI-PI" } else { "cascade P-PI" }
    }

    fn reads_scale(&self) -> bool {
        true
    }

    fn follows_scale(&self) -> bool {
        true
    }

    fn commands_current(&self) -> bool {
        self.current.is_some()
    }

    fn feed_forward(&self) -> FeedForwardModel {
        FeedForwardModel::None
    }

    fn tuned_by(&self) -> TunedBy {
        TunedBy::Bandwidth
    }

    fn placed(&self, design: &Design, machine: &Machine, bandwidth: f64, damping: f64) -> Option<Structure> {
        let rigid = Rigid::new(machine);
        let (mass, w) = (rigid.mass, 2.0 * PI * bandwidth);
        let speed = CASCADE * w;
        let current = self.current.map(|inner| {
            let late = 0.5 * design.every + design.delay;
            let pole = (CASCADE * speed).min(0.5 / late.max(f64::MIN_POSITIVE));
            let gain = machine.drives[0].amplifier.gain;
            CurrentLoop {
                proportional: pole * machine.drives[0].motor.inductance / gain,
                integral: pole * machine.drives[0].motor.resistance / gain,
                ..inner
            }
        });
        // With a current loop, back-EMF does not damp the axis.
        let (drag, push) = match current {
            Some(_) => (rigid.viscous[0], rigid.driving_force_per_ampere()),
            None => (rigid.drag(), rigid.force_per_command()),
        };
        let (sign, push) = (push.signum(), push.abs());
        let middle = if self.speed_integral == 0.0 { speed } else { 2.0 * damping * speed };
        Some(Structure::Cascade(Cascade {
            position: w,
            speed: sign * least(mass * middle, drag) / push,
            speed_integral: if self.speed_integral == 0.0 { 0.0 } else { sign * mass * speed * speed / push },
            current,
            ..*self
        }))
    }

    fn starts(&self, _: &Design, _: &Machine) -> Vec<Structure> {
        Vec::new()
    }

    fn integral_times(&self, factor: f64) -> Option<Structure> {
        let speed_integral = factor * self.speed_integral;
        (self.speed_integral != 0.0).then_some(Structure::Cascade(Self { speed_integral, ..*self }))
    }

    fn ramp(&self) -> f64 {
        self.speed_integral * self.position
    }

    fn lacks_damping(&self) -> bool {
        false
    }

    fn costs(&self) -> u64 {
        QUICK
    }

    fn in_drives(&self) -> Vec<InDrives> {
        let time = |name, proportional: f64, integral: f64| {
            (integral > 0.0).then(|| InDrives { name, value: 1e3 * proportional / integral, unit: "ms" })
        };
        let current = self.current.as_ref();
        let all = [
            Some(InDrives { name: "K_v", value: self.position, unit: "1/s" }),
            // 1/s = 60/1000 (m/min)/mm
            Some(InDrives { name: "K_v", value: 0.06 * self.position, unit: "(m/min)/mm" }),
            time("T_n (speed loop)", self.speed, self.speed_integral),
            current.and_then(|current| time("T_n (current loop)", current.proportional, current.integral)),
        ];
        all.into_iter().flatten().collect()
    }
}

impl Tunable for StateFeedback {
    fn word(&self) -> &'static str {
        "state_feedback"
    }

    fn name(&self) -> &'static str {
        if self.integral.is_some() { "state feedback (LQI)" } else { "state feedback (LQG)" }
    }

    fn reads_scale(&self) -> bool {
        true
    }

    fn follows_scale(&self) -> bool {
        false
    }

    fn commands_current(&self) -> bool {
        false
    }

    /// Its reference states come from the model.
    fn feed_forward(&self) -> FeedForwardModel {
        FeedForwardModel::Elastic
    }

    fn tuned_by(&self) -> TunedBy {
        TunedBy::Weights
    }

    fn placed(&self, _: &Design, _: &Machine, _: f64, _: f64) -> Option<Structure> {
        None
    }

    /// The regulator with slower Kalman filters.
    fn starts(&self, _: &Design, _: &Machine) -> Vec<Structure> {
        let slower = |share: f64| Self { disturbance: share * self.disturbance, ..*self };
        [0.3, 0.1].map(|share| Structure::StateFeedback(slower(share))).into()
    }

    fn integral_times(&self, factor: f64) -> Option<Structure> {
        // The gain is about the inverse of the weight.
        let integral = Some(self.integral? / factor).filter(|weight| weight.is_finite());
        Some(Structure::StateFeedback(Self { integral, ..*self }))
    }

    /// It follows from the weights by a Riccati equation.
    fn ramp(&self) -> f64 {
        0.0
    }

    fn lacks_damping(&self) -> bool {
        false
    }

    fn costs(&self) -> u64 {
        SOLVED
    }

    /// Drives have no such gains.
    fn in_drives(&self) -> Vec<InDrives> {
        Vec::new()
    }
}

impl Tunable for SlidingMode {
    fn word(&self) -> &'static str {
        "sliding_mode"
    }

    fn name(&self) -> &'static str {
        "sliding mode"
    }

    fn reads_scale(&self) -> bool {
        false
    }

    fn follows_scale(&self) -> bool {
        false
    }

    fn commands_current(&self) -> bool {
        false
    }

    /// Its equivalent control is that of the model.
    fn feed_forward(&self) -> FeedForwardModel {
        FeedForwardModel::Rigid
    }

    fn tuned_by(&self) -> TunedBy {
        TunedBy::Nothing
    }

    fn placed(&self, _: &Design, _: &Machine, _: f64, _: f64) -> Option<Structure> {
        None
    }

    fn starts(&self, _: &Design, _: &Machine) -> Vec<Structure> {
        Vec::new()
    }

    fn integral_times(&self, factor: f64) -> Option<Structure> {
        let integral = factor * self.integral;
        (self.integral != 0.0).then_some(Structure::SlidingMode(Self { integral, ..*self }))
    }

    /// It is bounded by the boundary layer, and depends on the mass of the axis.
    fn ramp(&self) -> f64 {
        0.0
    }

    fn lacks_damping(&self) -> bool {
        false
    }

    fn costs(&self) -> u64 {
        QUICK
    }

    /// Drives have no such gains.
    fn in_drives(&self) -> Vec<InDrives> {
        Vec::new()
    }
}

impl Tunable for Fuzzy {
    fn word(&self) -> &'static str {
        "fuzzy"
    }

    fn name(&self) -> &'static str {
        if self.incremental { "fuzzy PI" } else { "fuzzy PD" }
    }

    fn reads_scale(&self) -> bool {
        false
    }

    fn follows_scale(&self) -> bool {
        false
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn feed_forward(&self) -> FeedForwardModel {
        FeedForwardModel::None
    }

    fn tuned_by(&self) -> TunedBy {
        TunedBy::Nothing
    }

    fn placed(&self, _: &Design, _: &Machine, _: f64, _: f64) -> Option<Structure> {
        None
    }

    fn starts(&self, _: &Design, _: &Machine) -> Vec<Structure> {
        Vec::new()
    }

    /// Its rules are integral action and damping in one.
    fn integral_times(&self, _: f64) -> Option<Structure> {
        None
    }

    /// It depends on the error.
    fn ramp(&self) -> f64 {
        0.0
    }

    fn lacks_damping(&self) -> bool {
        false
    }

    fn costs(&self) -> u64 {
        QUICK
    }

    /// Drives have no such gains.
    fn in_drives(&self) -> Vec<InDrives> {
        Vec::new()
    }
}

impl Tunable for OpenLoop {
    fn word(&self) -> &'static str {
        "open_loop"
    }

    fn name(&self) -> &'static str {
        "open loop"
    }

    fn reads_scale(&self) -> bool {
        false
    }

    fn follows_scale(&self) -> bool {
        false
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn feed_forward(&self) -> FeedForwardModel {
        FeedForwardModel::None
    }

    fn tuned_by(&self) -> TunedBy {
        TunedBy::Nothing
    }

    fn placed(&self, _: &Design, _: &Machine, _: f64, _: f64) -> Option<Structure> {
        None
    }

    fn starts(&self, _: &Design, _: &Machine) -> Vec<Structure> {
        Vec::new()
    }

    fn integral_times(&self, _: f64) -> Option<Structure> {
        None
    }

    fn ramp(&self) -> f64 {
        0.0
    }

    fn lacks_damping(&self) -> bool {
        false
    }

    fn costs(&self) -> u64 {
        QUICK
    }

    fn in_drives(&self) -> Vec<InDrives> {
        Vec::new()
    }
}
