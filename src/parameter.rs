//! The one table of parameters: every number a case file can hold, with its symbol, unit, default, range and meaning.
//!
//! Reading, documentation and everything else that has to know a parameter derive from it.

use crate::quantity::{rounded, shortest};
use std::fmt::Write;

/// One number of the case file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Where it stands: `cart.mass`. An experiment's own number is left out: `experiment.until`.
    pub key: &'static str,
    /// Its symbol in the equations; empty where it has none.
    pub symbol: &'static str,
    /// Its SI unit; empty for a pure number, [`INPUT`] for what the amplifier takes.
    pub unit: &'static str,
    /// What holds when it is not given.
    pub default: Fallback,
    /// The values it may take, in SI.
    pub range: Range,
    /// What it is.
    pub sentence: &'static str,
    /// How it is typically written.
    pub example: &'static str,
}

/// The unit of what is fed into the amplifier: V in voltage mode, A in current mode.
pub const INPUT: &str = "V or A";

/// The unit that a parameter has where the amplifier takes `input` (V or A): its own, or the one of two that fits, the first in volts.
pub fn unit_for(unit: &'static str, input: &str) -> &'static str {
    match unit.split_once(" or ") {
        Some((volts, amperes)) => {
            if input == "A" {
                amperes
            } else {
                volts
            }
        }
        None => unit,
    }
}

/// What holds for a parameter that is not given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fallback {
    /// It has to be given, at least where its table is.
    Required,
    /// This value, in SI.
    Value(f64),
    /// What the words say, mostly the value of another parameter.
    Words(&'static str),
}

/// The values that make sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
    /// Whether `low` itself is excluded.
    pub above: bool,
    /// Whether `high` itself is excluded.
    pub below: bool,
    /// Whether only whole numbers will do.
    pub whole: bool,
}

impl Range {
    pub(crate) const fn new(low: f64, high: f64) -> Self {
        Self { low, high, above: false, below: false, whole: false }
    }

    /// Above zero, and within what a computer can tell apart.
    const POSITIVE: Self = Self::new(1e-15, 1e15);
    /// Zero or above.
    const NOT_NEGATIVE: Self = Self::new(0.0, 1e15);
    /// Of either sign.
    pub(crate) const ANY: Self = Self::new(-1e15, 1e15);

    pub(crate) const fn whole(low: f64, high: f64) -> Self {
        Self { whole: true, ..Self::new(low, high) }
    }

    /// Whether `value` lies in it.
    pub fn contains(&self, value: f64) -> bool {
        let low = if self.above { value > self.low } else { value >= self.low };
        let high = if self.below { value < self.high } else { value <= self.high };
        low && high && (!self.whole || value.fract() == 0.0)
    }

    /// Whether it goes as far as a seed may.
    fn is_seed(&self) -> bool {
        self.whole && self.high == i64::MAX as f64
    }

    /// In words, with the unit: `from 0 to 1`, `above zero: from 1e-15 kg to 1e15 kg`.
    pub fn describe(&self, unit: &str) -> String {
        let with_unit = |v: f64| match unit {
            "" => rounded(v),
            _ => format!("{} {unit}", rounded(v)),
        };
        if self.is_seed() {
            return format!("a whole number from 0 to {}", i64::MAX);
        }
        let (low, high) = (with_unit(self.low), with_unit(self.high));
        let whole = if self.whole { "a whole number " } else { "" };
        match (self.above, self.below) {
            (false, false) => format!("{whole}from {low} to {high}"),
            (true, false) => format!("{whole}above {low}, up to {high}"),
            (false, true) => format!("{whole}from {low}, below {high}"),
            (true, true) => format!("{whole}above {low} and below {high}"),
        }
    }

    /// As short as a table wants it: `> 0`, `≥ 0`, `0 … 1`.
    fn short(&self) -> String {
        const FAR: f64 = 1e8;
        let text = match (self.low, self.high) {
            (low, high) if low <= -FAR && high >= FAR => "any".to_string(),
            (low, high) if high >= FAR && low > 0.0 && low < 1e-9 => "> 0".to_string(),
            (low, _) if self.is_seed() => format!("{} … {}", shortest(low), i64::MAX),
            (low, high) if high >= FAR => format!("≥ {}", shortest(low)),
            (low, high) => format!(
                "{}{} … {}{}",
                if self.above { "> " } else { "" },
                shortest(low),
                if self.below { "< " } else { "" },
                shortest(high)
            ),
        };
        if self.whole { format!("whole, {text}") } else { text }
    }
}

const fn row(
    key: &'static str,
    symbol: &'static str,
    unit: &'static str,
    default: Fallback,
    range: Range,
    example: &'static str,
    sentence: &'static str,
) -> Parameter {
    Parameter { key, symbol, unit, default, range, sentence, example }
}

use Fallback::{Required, Value, Words};

const ANY: Range = Range::ANY;
const POSITIVE: Range = Range::POSITIVE;
const NOT_NEGATIVE: Range = Range::NOT_NEGATIVE;
/// Times in a run.
const TIME: Range = Range::new(0.0, 1e9);
const DURATION: Range = Range::new(1e-12, 1e9);
const FREQUENCY: Range = Range::new(1e-9, 1e9);
/// Whole numbers that TOML has, 0 to 2⁶³ − 1: read by their digits, as a double does not hold all of them.
const SEED: Range = Range { below: true, ..Range::whole(0.0, i64::MAX as f64) };
const UP_TO_ONE: Range = Range { above: true, ..Range::new(0.0, 1.0) };

/// Friction of one body: the rows with that body's key, symbols, units and examples.
macro_rules! friction {
    ($body:literal, $viscous:literal, $coulomb:literal, $static:literal, $slope:literal, $load:literal,
     $slope_example:literal, $load_example:literal, $static_example:literal,
     $velocity:literal, $velocity_example:literal, $decay:literal, $decay_example:literal,
     $stiffness:literal, $stiffness_example:literal) => {
        [
            row(
                concat!($body, ".friction.viscous"),
                $viscous,
                $slope,
                Value(0.0),
                NOT_NEGATIVE,
                $slope_example,
                "Viscous friction: resistance per speed.",
            ),
            row(
                concat!($body, ".friction.coulomb"),
                $coulomb,
                $load,
                Value(0.0),
                NOT_NEGATIVE,
                $load_example,
                "Coulomb friction: what resists at any speed.",
            ),
            row(
                concat!($body, ".friction.static"),
                $static,
                $load,
                Words("as `coulomb`, on each side"),
                NOT_NEGATIVE,
                $static_example,
                "Breakaway: what it holds at rest before it slides; at least `coulomb`.",
            ),
            row(
                concat!($body, ".friction.viscous_backward"),
                $viscous,
                $slope,
                Words("as `viscous`"),
                NOT_NEGATIVE,
                $slope_example,
                "Viscous friction in the negative direction.",
            ),
            row(
                concat!($body, ".friction.coulomb_backward"),
                $coulomb,
                $load,
                Words("as `coulomb`"),
                NOT_NEGATIVE,
                $load_example,
                "Coulomb friction in the negative direction.",
            ),
            row(
                concat!($body, ".friction.static_backward"),
                $static,
                $load,
                Words("as `static`; without it as `coulomb_backward`"),
                NOT_NEGATIVE,
                $static_example,
                "Breakaway in the negative direction; at least `coulomb_backward`.",
            ),
            row(
                concat!($body, ".friction.stribeck.force"),
                "F_s",
                $load,
                Required,
                NOT_NEGATIVE,
                $load_example,
                "By how much the breakaway exceeds `coulomb`, on each side, eq. (14); instead of `static`.",
            ),
            row(
                concat!($body, ".friction.stribeck.decay"),
                "F_τ",
                $decay,
                Words("from `velocity`"),
                POSITIVE,
                $decay_example,
                "How fast that excess is gone: e^(−F_τ v²), eq. (14); 1 / velocity².",
            ),
            row(
                concat!($body, ".friction.stribeck.velocity"),
                "v_s",
                $velocity,
                Words("from `decay`"),
                POSITIVE,
                $velocity_example,
                "Speed at which 1/e of it is left. With `shape = \"exponential\"` it goes as e^(−v/v_s), else as e^(−(v/v_s)²).",
            ),
            row(
                concat!($body, ".friction.smooth.breakaway_velocity"),
                "v_b",
                $velocity,
                Required,
                POSITIVE,
                $velocity_example,
                "Speed at which a smooth law peaks, near `static`; it never sticks (Simscape's law).",
            ),
            row(
                concat!($body, ".friction.lugre.stiffness"),
                "σ₀",
                $stiffness,
                Required,
                POSITIVE,
                $stiffness_example,
                "Stiffness of the bristles, which hold where others stick.",
            ),
            row(
                concat!($body, ".friction.lugre.damping"),
                "σ₁",
                $slope,
                Required,
                NOT_NEGATIVE,
                $slope_example,
                "Damping of the bristles.",
            ),
            row(
                concat!($body, ".friction.lugre.velocity"),
                "v_s",
                $velocity,
                Required,
                POSITIVE,
                $velocity_example,
                "Stribeck velocity of the way from `static` to `coulomb`.",
            ),
        ]
    };
}

/// Inertia of one pulley: given, or from its geometry.
macro_rules! pulley {
    ($body:literal, $inertia:literal) => {
        [
            row(
                concat!($body, ".inertia"),
                $inertia,
                "kg m^2",
                Required,
                POSITIVE,
                "6.3e-5 kg m^2",
                "Moment of inertia about its axis; or a table with the four rows below.",
            ),
            row(
                concat!($body, ".inertia.outer_diameter"),
                "d_o",
                "m",
                Required,
                POSITIVE,
                "38.3 mm",
                "Outer diameter of the hollow cylinder that stands for the pulley.",
            ),
            row(
                concat!($body, ".inertia.bore_diameter"),
                "d_i",
                "m",
                Value(0.0),
                NOT_NEGATIVE,
                "6.35 mm",
                "Diameter of its bore; smaller than the outer one.",
            ),
            row(concat!($body, ".inertia.width"), "w", "m", Required, POSITIVE, "12.7 mm", "Its width."),
            row(
                concat!($body, ".inertia.density"),
                "ρ",
                "kg/m^3",
                Required,
                POSITIVE,
                "2.7 g/cm^3",
                "Density of its material.",
            ),
        ]
    };
}

/// A recorded quantity: the three rows of its analogue-to-digital converter.
macro_rules! channel {
    ($quantity:literal, $unit:literal, $step:literal, $noise:literal, $range:literal) => {
        [
            row(
                concat!("measurement.", $quantity, ".step"),
                "",
                $unit,
                Words("not rounded"),
                POSITIVE,
                $step,
                "Step of the converter; the nearest one is recorded.",
            ),
            row(
                concat!("measurement.", $quantity, ".noise"),
                "",
                $unit,
                Value(0.0),
                NOT_NEGATIVE,
                $noise,
                "Standard deviation of Gaussian noise, added before the converter.",
            ),
            row(
                concat!("measurement.", $quantity, ".range"),
                "",
                $unit,
                Words("not clipped"),
                POSITIVE,
                $range,
                "Greatest absolute value that the converter gives; at least `step`.",
            ),
        ]
    };
}

#[rustfmt::skip]
const MOTOR: &[Parameter] = &[
    row("motor.torque_constant", "K_t", "N m/A", Required, NOT_NEGATIVE, "23 mN m/A", "Torque per ampere, at the motor's own shaft."),
    row("motor.back_emf_constant", "K_e", "V s/rad", Required, NOT_NEGATIVE, "23 mV s/rad", "Voltage per speed, at the motor's own shaft."),
    row("motor.resistance", "R", "ohm", Required, POSITIVE, "0.71 ohm", "Resistance of the armature."),
    row("motor.inductance", "L", "H", Value(0.0), NOT_NEGATIVE, "0.66 mH", "Inductance of the armature; with 0 the current follows the voltage at once."),
    row("motor.rotor_inertia", "J_r", "kg m^2", Value(0.0), NOT_NEGATIVE, "4.2e-6 kg m^2", "Inertia of the rotor, at the motor's own shaft."),
    row("motor.gear_ratio", "n", "", Value(1.0), Range::new(1e-6, 1e6), "5.9", "Motor turns per turn of the drive pulley."),
    row("motor.gear_efficiency", "η", "", Value(1.0), UP_TO_ONE, "0.73", "The part of the power that passes the gear, whichever side drives."),
    row("motor.backlash", "2α", "rad", Value(0.0), Range { below: true, ..Range::new(0.0, 6.3) }, "0.5 deg", "Play of the gear: by how much the drive pulley can turn while the rotor stands. Needs `gear_stiffness`."),
    row("motor.gear_stiffness", "k_g", "N m/rad", Words("stiff"), POSITIVE, "300 N m/rad", "Stiffness of the gear between rotor and drive pulley, at the pulley; makes the rotor an inertia of its own."),
    row("motor.gear_damping", "c_g", "N m s/rad", Value(0.0), NOT_NEGATIVE, "0.01 N m s", "Damping of the gear where its flanks touch, at the pulley."),
];

#[rustfmt::skip]
const AMPLIFIER: &[Parameter] = &[
    row("amplifier.gain", "", "", Value(1.0), ANY, "1", "Output, V or A, per unit of input; negative where the wires are swapped."),
    row("amplifier.voltage_limit", "V_max", "V", Words("none"), POSITIVE, "24 V", "Largest voltage at the motor's terminals, either way."),
    row("amplifier.current_limit", "I_max", "A", Words("none"), POSITIVE, "12 A", "Largest current, either way."),
    row("amplifier.bandwidth", "f_b", "Hz", Words("none: the current follows at once"), FREQUENCY, "1 kHz", "Bandwidth of the current loop, first order; only in current mode."),
];

#[rustfmt::skip]
const RADIUS: &[Parameter] = &[
    row("drive_pulley.radius", "r", "m", Words("from `teeth` and `pitch`"), POSITIVE, "19.4 mm", "Pitch radius, the same for both pulleys."),
    row("drive_pulley.teeth", "z", "", Words("not used with `radius`"), Range::whole(1.0, 1e6), "60", "Number of teeth or grooves; instead of `radius`, with `pitch`."),
    row("drive_pulley.pitch", "p", "m", Words("not used with `radius`"), POSITIVE, "2.03 mm", "Distance from tooth to tooth along the belt."),
];

#[rustfmt::skip]
const CART: &[Parameter] = &[
    row("cart.mass", "M", "kg", Required, POSITIVE, "0.362 kg", "Mass of the cart with its load."),
    row("cart.load", "F_L", "N", Value(0.0), ANY, "-3 N", "Constant force on the cart, positive towards larger x."),
    row("cart.inclination", "θ", "rad", Value(0.0), Range::new(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2), "10 deg", "Inclination of the axis, positive if the cart climbs towards larger x; adds −M g sin θ to the load."),
];

#[rustfmt::skip]
const BELT: &[Parameter] = &[
    row("belt.stiffness", "k₁ k₂ k₃", "N/m", Words("from `modulus`, `section` and `spans`"), POSITIVE, "132.76 kN/m",
        "Stiffness of each span: drive pulley to cart, cart to idler pulley, and the way back. Three values in a list."),
    row("belt.modulus", "E", "Pa", Words("not used with `stiffness`"), POSITIVE, "8.335 GPa",
        "Modulus of elasticity, eq. (11); or a list of parts, each `{ share, modulus }`, for a composite."),
    row("belt.modulus.share", "", "", Required, UP_TO_ONE, "1/3", "Share of the section that is of this material; all shares add up to 1."),
    row("belt.modulus.modulus", "E", "Pa", Required, POSITIVE, "50 GPa", "Modulus of this material."),
    row("belt.section", "A", "m^2", Words("not used with `stiffness`"), POSITIVE, "5.5626 mm^2",
        "Cross-section that carries the load; or `{ plain, toothed, toothed_share }` for a toothed belt, eq. (12)."),
    row("belt.section.plain", "A_nt", "m^2", Required, POSITIVE, "5.5626 mm^2", "Cross-section between the teeth."),
    row("belt.section.toothed", "A_t", "m^2", Required, POSITIVE, "10.4 mm^2", "Cross-section at a tooth."),
    row("belt.section.toothed_share", "", "", Required, Range::new(0.0, 1.0), "0.5", "Share of the belt's length that has the cross-section `toothed`."),
    row("belt.spans", "l₁ l₂ l₃", "m", Words("not used with `stiffness`"), POSITIVE, "0.34925 m", "Length of each span. Three values in a list."),
    row("belt.damping", "c₁ c₂ c₃", "N s/m", Value(0.0), NOT_NEGATIVE, "0 N s/m", "Damping of each span, parallel to its stiffness. Three values in a list."),
    row("belt.pretension", "T₀", "N", Words("none: spans can push"), POSITIVE, "50 N", "Tension of every span at rest; a span whose tension is used up goes slack and carries nothing."),
];

#[rustfmt::skip]
const TRAVEL: &[Parameter] = &[
    row("travel.min", "x_min", "m", Required, ANY, "-0.2 m", "Least position of the cart."),
    row("travel.max", "x_max", "m", Required, ANY, "0.3 m", "Greatest position of the cart; above `min`."),
    row("travel.stop_stiffness", "k_s", "N/m", Words("no stops: a run ends there"), POSITIVE, "20 kN/m", "Stiffness of the end stops."),
    row("travel.stop_damping", "c_s", "N s/m", Value(0.0), NOT_NEGATIVE, "50 N s/m", "Their damping."),
];

#[rustfmt::skip]
const ALONG: &[Parameter] = &[
    row("cart.friction.along.position", "x", "m", Required, ANY, "0.1 m", "First number of each point of `along`: where along the travel, growing from point to point."),
    row("cart.friction.along.factor", "", "", Required, NOT_NEGATIVE, "1.5", "Second number: what Coulomb friction, breakaway and `stribeck.force` are multiplied by there; straight lines between points."),
];

#[rustfmt::skip]
const ENCODER: &[Parameter] = &[
    row("encoder.lines", "", "", Required, POSITIVE, "512", "Lines per turn, or at the cart per metre; in quadrature each gives four counts."),
];

#[rustfmt::skip]
const MEASUREMENT: &[Parameter] = &[
    row("measurement.every", "", "s", Words("the experiment's `every`"), DURATION, "1 ms", "Interval between samples."),
    row("measurement.delay", "", "s", Value(0.0), TIME, "2 ms", "The row of time t shows what was at t minus this."),
    row("measurement.jitter", "", "s", Value(0.0), TIME, "20 us", "Standard deviation of a sample's instant; at most a quarter of the interval."),
    row("measurement.seed", "", "", Value(1.0), SEED, "1", "Which noise and jitter; the same seed gives the same ones."),
];

#[rustfmt::skip]
const EXPERIMENT: &[Parameter] = &[
    row("experiment.until", "", "s", Required, DURATION, "1 s", "End of the run."),
    row("experiment.every", "", "s", Required, DURATION, "1 ms", "Interval between the rows of the result, the last of which is at the end; it affects neither accuracy nor figures."),
];

#[rustfmt::skip]
const FIT: &[Parameter] = &[
    row("fit.starts", "", "", Value(1.0), Range::whole(1.0, 1000.0), "8", "From how many points the search starts: that of the file, and others within the bounds."),
    row("fit.seed", "", "", Value(1.0), SEED, "1", "Which other points."),
    row("fit.until", "", "s", Words("all of each log"), DURATION, "8 s", "Time in each log after which it is only compared, not fitted."),
    row("fit.windows", "", "s", Words("each log is one"), DURATION, "1 s", "Length of the windows into which logs are cut, each with a start of its own."),
];

#[rustfmt::skip]
const LOG: &[Parameter] = &[
    row("experiment.log.time.every", "", "s", Required, DURATION, "20 ms", "Interval between rows, for a file without a column of times."),
    row("experiment.log.from", "", "s", Words("the first row"), ANY, "0.1 s", "Where the log begins, on its own clock; this is time zero."),
    row("experiment.log.to", "", "s", Words("the last row"), ANY, "2 s", "Where it ends."),
];

#[rustfmt::skip]
const INITIAL: &[Parameter] = &[
    row("experiment.initial.drive_angle", "φ₁", "rad", Value(0.0), ANY, "0 rad", "Angle of the drive pulley at time zero."),
    row("experiment.initial.drive_speed", "φ₁′", "rad/s", Value(0.0), ANY, "0 rad/s", "Its speed."),
    row("experiment.initial.cart_position", "x", "m", Value(0.0), ANY, "0 mm", "Position of the cart at time zero."),
    row("experiment.initial.cart_speed", "x′", "m/s", Value(0.0), ANY, "0 m/s", "Its speed."),
    row("experiment.initial.idler_angle", "φ₃", "rad", Value(0.0), ANY, "0 rad", "Angle of the idler pulley at time zero."),
    row("experiment.initial.idler_speed", "φ₃′", "rad/s", Value(0.0), ANY, "0 rad/s", "Its speed."),
    row("experiment.initial.motor_current", "i", "A", Value(0.0), ANY, "0 A", "Armature current at time zero; only where it does not follow at once: with an inductance, or in current mode with a bandwidth."),
];

#[rustfmt::skip]
const BRIDGE: &[Parameter] = &[
    row("bridge.mass", "m", "kg", Required, POSITIVE, "0.838 kg", "Mass of the bridge without the cart; of the cart with its load."),
    row("bridge.travel.min", "", "m", Required, ANY, "-0.2 m", "Least position."),
    row("bridge.travel.max", "", "m", Required, ANY, "0.2 m", "Greatest position; above `min`."),
    row("bridge.travel.stop_stiffness", "k_s", "N/m", Words("no stops: a run ends there"), POSITIVE, "20 kN/m", "Stiffness of the end stops."),
    row("bridge.travel.stop_damping", "c_s", "N s/m", Value(0.0), NOT_NEGATIVE, "50 N s/m", "Their damping."),
];

#[rustfmt::skip]
const GANTRY_INITIAL: &[Parameter] = &[
    row("gantry.initial.bridge_position", "x", "m", Value(0.0), ANY, "0 mm", "Position of the bridge at time zero."),
    row("gantry.initial.bridge_speed", "x′", "m/s", Value(0.0), ANY, "0 m/s", "Its speed."),
    row("gantry.initial.cart_position", "y", "m", Value(0.0), ANY, "0 mm", "Position of the cart on the bridge."),
    row("gantry.initial.cart_speed", "y′", "m/s", Value(0.0), ANY, "0 m/s", "Its speed."),
    row("gantry.initial.left_angle", "φ₁", "rad", Words("without strain of the belt"), ANY, "0 rad", "Angle of the left drive pulley (A)."),
    row("gantry.initial.left_speed", "φ₁′", "rad/s", Words("without strain of the belt"), ANY, "0 rad/s", "Its speed."),
    row("gantry.initial.left_current", "i₁", "A", Value(0.0), ANY, "0 A", "Current of the left motor; only where it does not follow at once."),
    row("gantry.initial.right_angle", "φ₂", "rad", Words("without strain of the belt"), ANY, "0 rad", "Angle of the right drive pulley (B)."),
    row("gantry.initial.right_speed", "φ₂′", "rad/s", Words("without strain of the belt"), ANY, "0 rad/s", "Its speed."),
    row("gantry.initial.right_current", "i₂", "A", Value(0.0), ANY, "0 A", "Current of the right motor; only where it does not follow at once."),
];

#[rustfmt::skip]
const INPUTS: &[Parameter] = &[
    row("input.step", "", INPUT, Required, ANY, "5 V", "Height of the step."),
    row("input.step.at", "", "s", Value(0.0), TIME, "0 s", "When it comes."),
    row("input.pulse", "", INPUT, Required, ANY, "5 V", "Height of the pulse."),
    row("input.pulse.for", "", "s", Required, DURATION, "0.25 s", "How long it lasts."),
    row("input.pulse.at", "", "s", Value(0.0), TIME, "0 s", "When it begins."),
    row("input.ramp", "", INPUT, Required, ANY, "1.2 V", "Value that the ramp reaches from zero, and then holds."),
    row("input.ramp.over", "", "s", Required, DURATION, "1 s", "How long it takes."),
    row("input.ramp.at", "", "s", Value(0.0), TIME, "0 s", "When it begins."),
    row("input.triangle", "", INPUT, Required, ANY, "3 V", "Peak of the triangle wave, which begins at zero and rises first."),
    row("input.triangle.frequency", "", "Hz", Required, FREQUENCY, "2 Hz", "Periods per second."),
    row("input.square", "", INPUT, Required, ANY, "3 V", "Height of the square wave, which begins high and goes to the negative of it."),
    row("input.square.frequency", "", "Hz", Required, FREQUENCY, "2 Hz", "Periods per second."),
    row("input.square.duty", "", "", Value(0.5), Range { above: true, below: true, ..Range::new(0.0, 1.0) }, "0.5", "Share of the period that is high."),
    row("input.sine", "", INPUT, Required, ANY, "3 V", "Peak of the sine, without its offset."),
    row("input.sine.frequency", "", "Hz", Required, FREQUENCY, "2 Hz", "Periods per second."),
    row("input.sine.phase", "", "rad", Value(0.0), Range::new(-1e6, 1e6), "90 deg", "Phase at time zero."),
    row("input.sine.offset", "", INPUT, Value(0.0), ANY, "0 V", "Added to the sine."),
    row("input.chirp", "", INPUT, Required, ANY, "2 V", "Peak of a sine whose frequency moves evenly; zero when it is over."),
    row("input.chirp.from", "", "Hz", Required, Range::new(0.0, 1e9), "1 Hz", "Frequency at the beginning."),
    row("input.chirp.to", "", "Hz", Required, Range::new(0.0, 1e9), "300 Hz", "Frequency at the end."),
    row("input.chirp.over", "", "s", Required, DURATION, "10 s", "How long it takes."),
    row("input.multisine", "", INPUT, Required, ANY, "0.2 V", "Peak of each sine of the sum."),
    row("input.multisine.frequencies", "", "Hz", Words("from `from`, `to` and `tones`"), FREQUENCY, "1 Hz", "Frequencies in a list, at most 1000."),
    row("input.multisine.from", "", "Hz", Words("not used with `frequencies`"), FREQUENCY, "1 Hz", "Lowest frequency."),
    row("input.multisine.to", "", "Hz", Words("not used with `frequencies`"), FREQUENCY, "50 Hz", "Highest frequency."),
    row("input.multisine.tones", "", "", Words("not used with `frequencies`"), Range::whole(2.0, 1000.0), "50", "How many sines, equally spaced in frequency."),
    row("input.prbs", "", INPUT, Required, ANY, "3 V", "Height of a pseudo-random binary sequence, which jumps between plus and minus this."),
    row("input.prbs.bit", "", "s", Required, DURATION, "20 ms", "Shortest time between jumps."),
    row("input.prbs.seed", "", "", Value(1.0), SEED, "1", "Which sequence; the same seed gives the same one."),
    row("input.point.time", "", "s", Required, TIME, "0.1 s", "First number of each point of a `table`, growing from point to point."),
    row("input.point.value", "", INPUT, Required, ANY, "5 V", "Second number of each point; straight lines between points, the last one held."),
    row("input.element.lasts", "", "s", Words("as long as a `pulse`, `ramp`, `chirp`, `table` or `file` takes"), DURATION, "1 s", "How long an element of a `sequence` has its turn."),
];

#[rustfmt::skip]
const CONTROLLER: &[Parameter] = &[
    row("controller.every", "T", "s", Required, DURATION, "1 ms", "Sample time."),
    row("controller.delay", "", "s", Value(0.0), TIME, "0.5 ms", "Time from a sample to the command that follows from it; up to 1000 sample times."),
    row("controller.limit", "", INPUT, Words("none"), POSITIVE, "24 V", "Largest command, either way."),
    row("controller.pid.proportional", "K_p", "V/m or A/m", Required, ANY, "2 V/mm", "Command per error of position."),
    row("controller.pid.integral", "K_i", "V/(m s) or A/(m s)", Value(0.0), ANY, "30 V/(mm s)", "Command per integral of the error."),
    row("controller.pid.derivative", "K_d", "V s/m or A s/m", Value(0.0), ANY, "25 V s/m", "Command per rate of the error."),
    row("controller.pid.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the derivative's filter, of first order."),
    row("controller.pid.tracking", "", "s", Value(0.05), DURATION, "50 ms", "Time in which the integral follows a command that is limited (anti-windup)."),
    row("controller.cascade.position", "K_v", "rad/s", Required, NOT_NEGATIVE, "60 rad/s", "Speed asked for per error of position."),
    row("controller.cascade.speed", "", "V s/m or A s/m", Required, ANY, "30 V s/m", "Command per error of speed; with a current loop the current."),
    row("controller.cascade.speed_integral", "", "V/m or A/m", Value(0.0), ANY, "1 V/mm", "Command per integral of that; with a current loop the current."),
    row("controller.cascade.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the filter of the measured speed, of first order."),
    row("controller.cascade.tracking", "", "s", Value(0.02), DURATION, "20 ms", "Time in which the integrals follow what is limited."),
    row("controller.cascade.current.proportional", "", "V/A", Required, ANY, "0.3 V/A", "Voltage per error of current."),
    row("controller.cascade.current.integral", "", "V/(A s)", Value(0.0), ANY, "200 V/(A s)", "Voltage per integral of that."),
    row("controller.cascade.current.limit", "", "A", Words("none"), POSITIVE, "10 A", "Largest current asked for."),
    row("controller.state_feedback.position", "", "m", Required, POSITIVE, "0.1 mm", "Error of the cart's position that weighs as much as `command`."),
    row("controller.state_feedback.speed", "", "m/s", Words("no weight"), POSITIVE, "0.1 m/s", "The same of its speed."),
    row("controller.state_feedback.integral", "", "m s", Words("no integral"), POSITIVE, "5e-6 m s", "The same of the integral of the measured error: makes it LQI."),
    row("controller.state_feedback.command", "", INPUT, Required, POSITIVE, "5 V", "Command that weighs as much as each of these."),
    row("controller.state_feedback.disturbance", "", INPUT, Required, POSITIVE, "1 V", "Standard deviation of an unknown command, and of a force on the cart as large, that the Kalman filter expects at each sample."),
    row("controller.state_feedback.noise", "", "m", Value(0.0), NOT_NEGATIVE, "5 um", "Standard deviation of a measured position; at least 0.3 counts are taken."),
    row("controller.sliding_mode.bandwidth", "λ", "rad/s", Required, POSITIVE, "60 rad/s", "How fast the error dies out on the sliding surface ė + λ e = 0."),
    row("controller.sliding_mode.reaching", "K", "m/s^2", Required, POSITIVE, "4 m/s^2", "Acceleration that drives to the surface."),
    row("controller.sliding_mode.boundary", "Φ", "m/s", Required, POSITIVE, "0.05 m/s", "Boundary layer: distance from the surface below which only a share of it does."),
    row("controller.sliding_mode.integral", "", "s^-2", Value(0.0), NOT_NEGATIVE, "900 s^-2", "Weight of the error's integral in the surface."),
    row("controller.sliding_mode.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the filter of the measured speed, of first order."),
    row("controller.fuzzy.error", "", "m", Required, POSITIVE, "2 mm", "Error at the outermost sets."),
    row("controller.fuzzy.rate", "", "m/s", Required, POSITIVE, "0.1 m/s", "Its rate at the outermost sets."),
    row("controller.fuzzy.command", "", INPUT, Words("none with `slope`"), POSITIVE, "5 V", "Command of a rule of 1: makes it PD."),
    row("controller.fuzzy.slope", "", "V/s or A/s", Words("none with `command`"), POSITIVE, "100 V/s", "Change of the command of a rule of 1: makes it PI."),
    row("controller.fuzzy.rule", "", "", Required, Range::new(-1.0, 1.0), "0.5", "Each value in `rules`."),
    row("controller.fuzzy.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the filter of the rate, of first order."),
    row("controller.feed_forward.inertia", "", "", Value(1.0), Range::new(0.0, 2.0), "1", "Share of the inertia's part that is fed forward."),
    row("controller.feed_forward.friction", "", "", Value(1.0), Range::new(0.0, 2.0), "0.8", "Share of the friction's."),
    row("controller.feed_forward.lead", "", "s", Words("the delay and half a sample"), TIME, "1 ms", "How far ahead of a sample it looks."),
    row("controller.disturbance_observer.bandwidth", "", "Hz", Required, FREQUENCY, "10 Hz", "Its three poles."),
    row("controller.filters.notch", "", "Hz", Words("one of these two"), FREQUENCY, "180 Hz", "Frequency that a notch takes out of the command."),
    row("controller.filters.low_pass", "", "Hz", Words("one of these two"), FREQUENCY, "300 Hz", "Frequency above which a low-pass of second order takes out everything."),
    row("controller.filters.damping", "ζ_p", "", Value(0.7), Range { above: true, ..Range::new(0.0, 10.0) }, "0.7", "Damping of the filter's poles: the more, the wider a notch."),
    row("controller.filters.depth", "ζ_z", "", Value(0.05), Range::new(0.0, 10.0), "0.05", "Damping of a notch's zeros: its gain there is depth over damping."),
    row("controller.shaper.time", "", "s", Required, TIME, "2.8 ms", "First number of each impulse of `shaper`, growing from impulse to impulse."),
    row("controller.shaper.amplitude", "", "", Required, Range::new(-10.0, 10.0), "0.5", "Second number; together they are 1."),
];

#[rustfmt::skip]
const TUNE: &[Parameter] = &[
    row("tune.bandwidth", "", "Hz", Words("one that suits the axis"), FREQUENCY, "8 Hz", "Bandwidth that the gains are placed for, and from which a search begins."),
    row("tune.damping", "ζ", "", Value(0.8), Range { above: true, ..Range::new(0.0, 10.0) }, "0.8", "Damping ratio that they are placed for."),
    row("tune.sensitivity", "M_s", "", Value(1.8), Range { above: true, ..Range::new(1.0, 100.0) }, "1.6", "Largest magnitude that the sensitivity 1/(1 + L) may have; 1.6 is careful, 2 is bold."),
    row("tune.complementary", "M_t", "", Value(1.8), Range { above: true, ..Range::new(1.0, 100.0) }, "1.5", "The same of L/(1 + L)."),
    row("tune.spread", "", "", Words("what a fit says, or 0.2"), Range { below: true, ..Range::new(0.0, 1.0) }, "20 %", "Share by which each parameter of the axis can be off."),
    row("tune.load", "", "kg", Value(0.0), Range::new(0.0, 1e6), "0.5 kg", "Each value of `load`: a mass that is added to the cart."),
    row("tune.places", "", "", Value(7.0), Range::whole(1.0, 1000.0), "7", "Places along the travel that are looked at."),
];

#[rustfmt::skip]
const SWEEP: &[Parameter] = &[
    row("sweep.runs", "N", "", Words("required where machines are drawn"), Range::whole(1.0, 1e12), "100000", "How many machines are run; `grid` and `one-at-a-time` say it themselves."),
    row("sweep.seed", "", "", Value(1.0), SEED, "1", "Which draws; the same seed gives the same ones."),
    row("sweep.interval", "", "s", Words("the experiment's `every`"), DURATION, "1 ms", "Interval between the rows of `--trajectories`; figures do not depend on it."),
];

#[rustfmt::skip]
const MOVE: &[Parameter] = &[
    row("move.from", "", "m", Value(0.0), ANY, "0 mm", "Where the cart stands at time zero."),
    row("move.to", "", "m", Words("`points` or `gcode` instead"), ANY, "50 mm", "Where it goes."),
    row("move.speed", "", "m/s", Required, POSITIVE, "0.4 m/s", "Largest speed."),
    row("move.acceleration", "", "m/s^2", Required, POSITIVE, "5 m/s^2", "Largest acceleration."),
    row("move.jerk", "", "m/s^3", Words("none: a trapezoid"), POSITIVE, "200 m/s^3", "Largest jerk."),
    row("move.snap", "", "m/s^4", Words("none: third order"), POSITIVE, "20000 m/s^4", "Largest snap; only with `jerk`."),
    row("move.until", "", "s", Required, DURATION, "1 s", "End of the run."),
    row("move.every", "", "s", Words("the controller's `every`"), DURATION, "1 ms", "Interval between the rows of the result, the last of which is at the end; it affects neither accuracy nor figures."),
    row("move.window", "", "m", Value(1e-4), POSITIVE, "50 um", "How near its target the cart counts as settled."),
    row("move.points.to", "", "m", Required, ANY, "50 mm", "Each point of a list, or its `to`."),
    row("move.points.speed", "", "m/s", Words("the move's"), POSITIVE, "0.1 m/s", "Largest speed on the way there."),
    row("move.points.wait", "", "s", Value(0.0), TIME, "0.2 s", "How long it stands there."),
];

/// Titles of the sections, in the order of the case file, with the key prefix of their rows.
const SECTIONS: &[(&str, &[&[Parameter]])] = &[
    ("motor", &[MOTOR]),
    ("amplifier", &[AMPLIFIER]),
    (
        "drive_pulley",
        &[
            RADIUS,
            &pulley!("drive_pulley", "J₁"),
            &friction!(
                "drive_pulley",
                "B₁",
                "τ_c1",
                "τ_b1",
                "N m s/rad",
                "N m",
                "0.0016 N m s",
                "0.0150 N m",
                "0.02 N m",
                "rad/s",
                "0.5 rad/s",
                "s^2/rad^2",
                "4 s^2/rad^2",
                "N m/rad",
                "40 N m/rad"
            ),
        ],
    ),
    (
        "idler_pulley",
        &[
            &pulley!("idler_pulley", "J₂"),
            &friction!(
                "idler_pulley",
                "B₂",
                "τ_c2",
                "τ_b2",
                "N m s/rad",
                "N m",
                "0.0016 N m s",
                "0.0150 N m",
                "0.02 N m",
                "rad/s",
                "0.5 rad/s",
                "s^2/rad^2",
                "4 s^2/rad^2",
                "N m/rad",
                "40 N m/rad"
            ),
        ],
    ),
    (
        "cart",
        &[
            CART,
            &friction!(
                "cart",
                "b",
                "F_c",
                "F_b",
                "N s/m",
                "N",
                "19.0424 N s/m",
                "0.2 N",
                "0.3 N",
                "m/s",
                "0.01 m/s",
                "s^2/m^2",
                "1e4 s^2/m^2",
                "N/m",
                "100 kN/m"
            ),
            ALONG,
        ],
    ),
    (
        "bridge",
        &[
            BRIDGE,
            &friction!(
                "bridge",
                "b",
                "F_c",
                "F_b",
                "N s/m",
                "N",
                "15 N s/m",
                "1 N",
                "1.5 N",
                "m/s",
                "0.01 m/s",
                "s^2/m^2",
                "1e4 s^2/m^2",
                "N/m",
                "100 kN/m"
            ),
        ],
    ),
    ("belt", &[BELT]),
    ("travel", &[TRAVEL]),
    ("encoder", &[ENCODER]),
    (
        "measurement",
        &[
            MEASUREMENT,
            &channel!("motor_current", "A", "10 mA", "5 mA", "10 A"),
            &channel!("motor_voltage", "V", "10 mV", "5 mV", "24 V"),
            &channel!("drive_angle", "rad", "0.1 deg", "0.05 deg", "180 deg"),
            &channel!("drive_speed", "rad/s", "0.1 rad/s", "0.05 rad/s", "100 rad/s"),
            &channel!("cart_position", "m", "5 um", "2 um", "0.5 m"),
            &channel!("cart_speed", "m/s", "1 mm/s", "0.5 mm/s", "2 m/s"),
        ],
    ),
    ("experiment", &[EXPERIMENT]),
    ("experiment.initial", &[INITIAL]),
    ("gantry.initial", &[GANTRY_INITIAL]),
    ("experiment.log", &[LOG]),
    ("input", &[INPUTS]),
    ("controller", &[CONTROLLER]),
    ("move", &[MOVE]),
    ("tune", &[TUNE]),
    ("fit", &[FIT]),
    ("sweep", &[SWEEP]),
];

/// All parameters, in the order of the case file.
pub fn all() -> impl Iterator<Item = &'static Parameter> {
    SECTIONS.iter().flat_map(|(_, groups)| groups.iter().flat_map(|rows| rows.iter()))
}

/// The parameter with this key.
pub fn find(key: &str) -> Option<&'static Parameter> {
    all().find(|p| p.key == key)
}

/// The names that follow directly after `section` in the keys: for `cart` these are `mass` and `friction`.
pub fn names_in(section: &str) -> Vec<&'static str> {
    let mut names = Vec::new();
    for parameter in all() {
        let rest = parameter.key.strip_prefix(section).and_then(|rest| rest.strip_prefix('.'));
        if let Some(name) = rest.and_then(|rest| rest.split('.').next())
            && !names.contains(&name)
        {
            names.push(name);
        }
    }
    names
}

/// The sections of the table, each of which [`markdown`] renders.
pub fn sections() -> impl Iterator<Item = &'static str> {
    SECTIONS.iter().map(|(name, _)| *name)
}

/// The parameters of a section as a Markdown table.
pub fn markdown(section: &str) -> String {
    let mut text = String::from(
        "| key | symbol | SI unit | default | range | example | meaning |\n|---|---|---|---|---|---|---|\n",
    );
    let rows = SECTIONS.iter().filter(|(name, _)| *name == section).flat_map(|(_, groups)| groups.iter());
    for p in rows.flat_map(|rows| rows.iter()) {
        let key =
            p.key.strip_prefix("input.").or_else(|| p.key.strip_prefix(section).map(|k| &k[1..])).unwrap_or(p.key);
        let default = match p.default {
            Fallback::Required => "required".to_string(),
            Fallback::Value(value) => shortest(value),
            Fallback::Words(words) => words.to_string(),
        };
        let unit = if p.unit.is_empty() { "–" } else { p.unit };
        let symbol = if p.symbol.is_empty() { "–" } else { p.symbol };
        let _ = writeln!(
            text,
            "| `{key}` | {symbol} | {unit} | {default} | {} | {} | {} |",
            p.range.short(),
            p.example,
            p.sentence
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity;

    #[test]
    fn examples_and_defaults_lie_in_their_ranges() {
        for p in all() {
            let unit = unit_for(p.unit, "V");
            let example = quantity::read(p.example, unit).unwrap_or_else(|e| panic!("{}: {e}", p.key));
            assert!(p.range.contains(example), "{}", p.key);
            if let Fallback::Value(value) = p.default {
                assert!(p.range.contains(value), "{}", p.key);
            }
        }
    }

    #[test]
    fn no_key_stands_twice() {
        for p in all() {
            assert_eq!(all().filter(|q| q.key == p.key).count(), 1, "{}", p.key);
        }
    }
}
