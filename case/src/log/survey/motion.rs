//! The motion in a log: rest, reversals, steady speeds.

use super::super::{Log, Output, Quantity};
use super::channel::Channel;
use super::timing::Timing;
use super::{Note, Severity, quantile, shown};
use crate::chance::median;

/// A speed below this share of the largest is rest, as far as reversals go.
const SLOW: f64 = 0.05;

/// At the ends of a log, where a speed is less certain, it is rest below this share.
const AT_REST: f64 = 0.2;

/// A steady speed changes by less than this share of itself.
const STEADY: f64 = 0.03;

/// It begins where its first samples change by less than this share from one half to the other.
const SETTLED: f64 = 0.005;

/// Fewest missing samples of a gap that a fit would go astray in.
const FEWEST_MISSING: usize = 3;

/// Fewest samples of a steady speed.
const SHORTEST: usize = 20;

/// Columns that tell the motion, the best first: positions, then speeds.
const ORDER: [Quantity; 20] = [
    Quantity::BridgePosition,
    Quantity::CartPosition,
    Quantity::DriveAngle,
    Quantity::RotorAngle,
    Quantity::IdlerAngle,
    Quantity::LeftAngle,
    Quantity::RightAngle,
    Quantity::CartPulleyAngle,
    Quantity::LeftRotorAngle,
    Quantity::RightRotorAngle,
    Quantity::BridgeSpeed,
    Quantity::CartSpeed,
    Quantity::DriveSpeed,
    Quantity::RotorSpeed,
    Quantity::IdlerSpeed,
    Quantity::LeftSpeed,
    Quantity::RightSpeed,
    Quantity::CartPulleySpeed,
    Quantity::LeftRotorSpeed,
    Quantity::RightRotorSpeed,
];

/// The motion in a log, judged by one of its columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The column: a position if there is one, or else a speed.
    pub quantity: Quantity,
    /// True if that column has lost its sign.
    pub absolute: bool,
    /// True if it moves at all, beyond noise and steps.
    pub moves: bool,
    /// Largest speed, in the unit of a speed: m/s or rad/s.
    pub peak_speed: f64,
    /// True if it is at rest in the first samples.
    pub begins_at_rest: bool,
    /// True if it is at rest in the last samples.
    pub ends_at_rest: bool,
    /// Times, s, at which it turns round.
    pub reversals: Vec<f64>,
    /// Stretches of steady speed under a steady input.
    pub steady: Vec<Steady>,
    /// Speeds as estimated from positions, or as measured; NaN where that is not possible.
    pub(super) speed: Vec<f64>,
}

/// A stretch of steady speed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Steady {
    /// Where it begins, s.
    pub from: f64,
    /// Where it ends, s.
    pub to: f64,
    /// The speed, m/s or rad/s.
    pub speed: f64,
    /// The input, V or A.
    pub input: f64,
}

impl Motion {
    /// By the first position there is, or else by the first speed; of a machine with several coordinates by the first
    /// that moves.
    pub(super) fn new(log: &Log, channels: &[Channel], timing: &Timing) -> Option<Self> {
        let column = |quantity: &Quantity| {
            let output = log.output(*quantity)?;
            Some((output, channels.iter().find(|channel| channel.name == output.quantity.name())?))
        };
        let moves = |(_, channel): &(&Output, &Channel)| channel.span() > 10.0 * channel.resolution();
        let found = || ORDER.iter().filter_map(column);
        let (output, channel) = match log.inputs.len() {
            1 => found().next(),
            _ => found().find(moves).or_else(|| found().next()),
        }?;
        let (speed, fuzz) = speeds(log, output.quantity, timing, channel);
        let peak_speed = quantile(&speed.iter().map(|v| v.abs()).collect::<Vec<_>>(), 0.995);
        let resolution = channel.resolution();
        let moves = !channel.is_constant() && channel.span() > 10.0 * resolution && peak_speed > 3.0 * fuzz;
        let slow = (SLOW * peak_speed).max(3.0 * fuzz);
        let rest = |from_end: bool| {
            let (v, fuzz) = end_speed(log, output.quantity, channel, from_end);
            v.abs() <= (AT_REST * peak_speed).max(3.0 * fuzz)
        };
        let mut motion = Self {
            quantity: output.quantity,
            absolute: output.absolute,
            moves,
            peak_speed,
            begins_at_rest: !moves || rest(false),
            ends_at_rest: !moves || rest(true),
            reversals: Vec::new(),
            steady: Vec::new(),
            speed,
        };
        if moves {
            motion.reversals = motion.turns(log, slow);
            motion.steady = motion.steadiness(log, channels, fuzz);
        }
        Some(motion)
    }

    fn turns(&self, log: &Log, slow: f64) -> Vec<f64> {
        let (mut turns, mut sign) = (Vec::new(), 0.0);
        for (&v, &t) in self.speed.iter().zip(&log.time) {
            if v.is_nan() || v.abs() <= slow {
                continue;
            }
            if sign * v < 0.0 {
                turns.push(t);
            }
            sign = v.signum();
        }
        turns
    }

    /// Steady speeds, where a single input goes with them.
    fn steadiness(&self, log: &Log, channels: &[Channel], fuzz: f64) -> Vec<Steady> {
        let [fed] = &log.inputs[..] else { return Vec::new() };
        let input = 0.01 * channels.first().map_or(0.0, Channel::span).max(1e-12);
        let mut steady: Vec<Steady> = Vec::new();
        let mut begin = 0;
        while begin + SHORTEST <= log.len() {
            let u = fed[begin];
            let (early, late) = self.speed[begin..begin + SHORTEST].split_at(SHORTEST / 2);
            let [early, late] = [early, late].map(|half| half.iter().sum::<f64>() / half.len() as f64);
            let v = 0.5 * (early + late);
            let settled = (late - early).abs() <= (SETTLED * v.abs()).max(fuzz);
            if v.is_nan() || !settled || v.abs() <= (0.1 * self.peak_speed).max(3.0 * fuzz) {
                begin += 1;
                continue;
            }
            let allowed = (STEADY * v.abs()).max(2.0 * fuzz);
            let same = |k: &usize| (self.speed[*k] - v).abs() <= allowed && (fed[*k] - u).abs() <= input;
            let end = begin + (begin..log.len()).take_while(same).count();
            if end - begin >= SHORTEST {
                let speed = median(&mut self.speed[begin..end].to_vec());
                steady.push(Steady { from: log.time[begin], to: log.time[end - 1], speed, input: u });
                begin = end;
            } else {
                begin += 1;
            }
        }
        steady
    }

    /// A gap in motion, or over a change of the input: a model that is put through the log does not know what was fed
    /// in there.
    pub(super) fn across_gaps(&self, log: &Log, timing: &Timing) -> Option<Note> {
        let changes_of = |input: &Vec<f64>, k: usize| {
            let wide = input.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
            (input[k] - input[k - 1]).abs() > 0.01 * wide
        };
        let moving = |k: usize| self.speed.get(k).is_some_and(|v| v.abs() > SLOW * self.peak_speed);
        let mut bad = timing.gaps.iter().filter(|gap| gap.missing >= FEWEST_MISSING).filter(|gap| {
            let k = log.time.partition_point(|t| *t <= gap.at);
            let changes = k > 0 && k < log.len() && log.inputs.iter().any(|input| changes_of(input, k));
            self.moves && (changes || moving(k.saturating_sub(1)) || moving(k))
        });
        let first = bad.next()?;
        let others = match bad.count() {
            0 => String::new(),
            n => format!(" and in {n} more"),
        };
        let text = format!(
            "it moves, or its input changes, in the gap of {} after {}{others}, and a fit would assume that the input \
             before the gap lasted through it: cut the log there, with from and to",
            shown(first.length, "s"),
            shown(first.at, "s")
        );
        Some(Note::new("gap-in-motion", Severity::Suspicion, text))
    }

    /// How many speeds among the steady ones differ by more than a tenth.
    pub fn steady_speeds(&self) -> usize {
        let mut speeds: Vec<f64> = self.steady.iter().map(|steady| steady.speed).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup_by(|a, b| (*a - *b).abs() <= 0.1 * a.abs().max(b.abs()));
        speeds.len()
    }

    /// Unit of its speeds.
    pub fn unit(&self) -> &'static str {
        if self.quantity.is_linear() { "m/s" } else { "rad/s" }
    }

    /// Notes on it in a log of so many inputs; steady speeds are those under a single one.
    pub(super) fn notes(&self, inputs: usize) -> Vec<Note> {
        let name = self.quantity.name();
        let mut notes = Vec::new();
        let mut note = |code, severity, text: String| notes.push(Note::new(code, severity, text).on(name));
        if !self.moves {
            note(
                "still",
                Severity::Warning,
                "it does not move beyond its noise and resolution: the log says nothing about the mechanics".into(),
            );
            return notes;
        }
        let unit = self.unit();
        let peak = shown(self.peak_speed, unit);
        match self.reversals.len() {
            _ if self.absolute => note(
                "absolute",
                Severity::Fact,
                format!("it moves at up to {peak}; its sign was lost, so reversals are unknown"),
            ),
            0 => note(
                "one-way",
                Severity::Warning,
                format!(
                    "it moves at up to {peak} and never reverses: a constant force and Coulomb friction cannot be separated"
                ),
            ),
            1 => note(
                "reverses",
                Severity::Fact,
                format!("it moves at up to {peak} and reverses once, at {}", shown(self.reversals[0], "s")),
            ),
            n => note("reverses", Severity::Fact, format!("it moves at up to {peak} and reverses {n} times")),
        }
        let longest = self.steady.iter().max_by(|a, b| (a.to - a.from).total_cmp(&(b.to - b.from)));
        match (longest, self.steady_speeds()) {
            (None, _) if inputs > 1 => {}
            (None, _) => note(
                "unsteady",
                Severity::Fact,
                "no interval of steady speed: only transients separate friction from inertia".into(),
            ),
            (Some(steady), n) => {
                let (speed, from, to) = (shown(steady.speed, unit), shown(steady.from, "s"), shown(steady.to, "s"));
                let others = match n {
                    1 => "a single steady speed does not separate viscous from Coulomb friction".to_string(),
                    n => format!("there are {n} different steady speeds"),
                };
                note("steady", Severity::Fact, format!("it moves steadily at {speed} from {from} to {to}; {others}"));
            }
        }
        if !self.begins_at_rest {
            note(
                "begins-moving",
                Severity::Fact,
                "it is in motion already when the log begins: the initial state has to be fitted".into(),
            );
        }
        notes
    }
}

/// Speeds of an output, and how uncertain they are.
fn speeds(log: &Log, quantity: Quantity, timing: &Timing, channel: &Channel) -> (Vec<f64>, f64) {
    let values = log.output(quantity).map_or(&[][..], |output| &output.values);
    if quantity.is_speed() || !quantity.is_position() {
        return (values.to_vec(), channel.resolution());
    }
    // Half a window on either side, wide enough that noise does not matter.
    let half = (values.len() / 200).clamp(2, 25);
    let slope = |k: usize| {
        let (a, b) = (k.saturating_sub(half), (k + half).min(values.len() - 1));
        if b > a { (values[b] - values[a]) / (log.time[b] - log.time[a]) } else { f64::NAN }
    };
    let speeds = (0..values.len()).map(slope).collect();
    let fuzz = 2f64.sqrt() * channel.resolution() / (2.0 * half as f64 * timing.interval).max(f64::MIN_POSITIVE);
    (speeds, fuzz)
}

/// The speed at an end of a log, from its last three samples there, and how uncertain it is.
fn end_speed(log: &Log, quantity: Quantity, channel: &Channel, from_end: bool) -> (f64, f64) {
    let values = log.output(quantity).map_or(&[][..], |output| &output.values);
    let mut there: Vec<usize> = (0..values.len()).filter(|&k| !values[k].is_nan()).take(3).collect();
    if from_end {
        there = (0..values.len()).rev().filter(|&k| !values[k].is_nan()).take(3).collect();
    }
    let &[a, b, c] = &there[..] else { return (0.0, 0.0) };
    if quantity.is_speed() {
        return (values[a], channel.resolution());
    }
    // The slope at the end of the parabola through three points.
    let (h, k) = (log.time[b] - log.time[a], log.time[c] - log.time[a]);
    let (first, second) = ((values[b] - values[a]) / h, (values[c] - values[a]) / k);
    let slope = (first * k - second * h) / (k - h);
    (slope, 2.6 * channel.resolution() / h.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_position_and_speed_tells_the_motion() {
        let tells = |quantity: &Quantity| quantity.is_position() || quantity.is_speed();
        let missing: Vec<Quantity> = Quantity::all().filter(tells).filter(|own| !ORDER.contains(own)).collect();
        assert!(missing.is_empty(), "{missing:?}");
        assert!(ORDER.iter().all(tells));
        assert!(ORDER.is_sorted_by_key(|quantity| quantity.is_speed()), "positions come first");
    }
}
