//! Force map: the force that depends on the position of the cart, from logs of slow motion over the travel in both
//! directions.
//!
//! Each pass in one direction gives the force that the model lacks along the travel,
//!
//! ```text
//! ΔF = M ẍ + b ẋ + F_c sgn ẋ − F₀ − F_x(x) − f_M,        all smoothed by the same Gaussian,
//! ```
//!
//! as a line through points. The part that is equal in both directions is the map, the part that changes its sign is
//! friction:
//!
//! ```text
//! F = (F⁺ + F⁻)/2,   D = (F⁺ − F⁻)/2
//! ```
//!
//! with means F⁺, F⁻ over the passes in each direction. Other differences between passes are noise, which determines
//! the uncertainty of the map. This includes friction that changes along the travel, unless the model has it.

mod passes;
mod waves;

use crate::case::{Case, Files, Given};
use crate::error::{Error, Result};
use crate::fit::limits::{MAP_FREEDOM, MAP_LENGTH, MAP_LOCAL, MAP_LOSS, MAP_MATCH, MAP_PERIODS, MAP_POINTS, MAP_ROWS};
use crate::fit::noise::student::student;
use crate::linear::Natural;
use crate::machine::Machine;
use crate::mechanism::BODIES;
use crate::polyline::{MOST_POINTS, Polyline};
use passes::{Pass, passes, travelled};
use std::f64::consts::PI;
use std::path::Path;
use waves::{Noise, Wave, search};

/// A force along the travel.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ForceMap {
    /// The points, in order; values in addition to those of the case.
    pub points: Vec<Point>,
    /// Passes forward and backward.
    pub passes: [usize; 2],
    /// Largest median speed of a pass, m/s.
    pub speed: f64,
    /// True if the force changes along the travel beyond chance; else no map is written.
    pub is_significant: bool,
    /// Mean force over the travel, N.
    pub mean: f64,
    /// D: friction beyond that of the case, N, the mean of both directions.
    pub friction: f64,
    /// The periodic components, the largest first.
    pub components: Vec<Component>,
    /// Least detectable amplitude of a periodic component, N.
    pub visible: f64,
    /// Periods of the machine for which the travel is too short.
    pub too_long: Vec<Origin>,
    /// Shortest period that is resolved, m: less than 10 % of its amplitude are lost.
    pub resolution: f64,
    /// Cause of the resolution limit.
    pub limit: Limit,
    /// `cart.force_along` of the case with the map added; none if it is not significant.
    pub line: Option<Polyline>,
}

/// A point of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Point {
    /// m
    pub position: f64,
    /// N, positive towards larger x.
    pub force: f64,
    /// Ends of the 95 % band, N.
    pub band: [f64; 2],
    /// Mean of the passes in each direction, forward and backward, N: with friction beyond that of the case.
    pub sides: [f64; 2],
}

/// A periodic component.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Component {
    /// Period and its standard error, m.
    pub period: [f64; 2],
    /// Amplitude and its standard error, N.
    pub amplitude: [f64; 2],
    /// Probability that noise causes such a component anywhere.
    pub chance: f64,
    /// Parts of the machine with this period; empty if none is known.
    pub origins: Vec<Origin>,
}

/// Source of a period along the travel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Origin {
    /// Number of periods per turn of the pulleys, which have one radius: 1 for an eccentric pulley.
    Pulley {
        /// Periods per turn.
        count: u32,
        /// m
        period: f64,
    },
    /// Number of periods per turn of the motor, as of its poles or slots.
    Motor {
        /// Periods per turn.
        count: u32,
        /// m
        period: f64,
    },
    /// The teeth of the belt.
    Tooth {
        /// m
        period: f64,
    },
}

impl Origin {
    /// m
    pub fn period(self) -> f64 {
        match self {
            Self::Pulley { period, .. } | Self::Motor { period, .. } | Self::Tooth { period } => period,
        }
    }

    /// In words.
    pub fn words(self) -> String {
        match self {
            Self::Pulley { count: 1, .. } => "a turn of the pulley".into(),
            Self::Pulley { count, .. } => format!("{count} per turn of the pulley"),
            Self::Motor { count: 1, .. } => "a turn of the motor".into(),
            Self::Motor { count, .. } => format!("{count} per turn of the motor"),
            Self::Tooth { .. } => "a tooth of the belt".into(),
        }
    }
}

/// Cause of a map's resolution limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// The smoothing of the log at its speed.
    Smoothing,
    /// The distance of the points.
    Points,
    /// The lowest resonance at the speed of the log.
    Resonance,
}

impl Limit {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Smoothing => "the smoothing of the log at its speed and rate",
            Self::Points => "the distance of the points",
            Self::Resonance => "the lowest resonance at the speed of the log",
        }
    }
}

/// The force along the travel from all logs of a case. Errors: not an axis, no log, no position, uneven times, motion
/// in one direction only, too few rows.
pub fn map(case: &Case) -> Result<ForceMap> {
    let machine = &case.machine;
    if !machine.has_one_coordinate() {
        return Err(Error::new("a force along the travel is mapped on an axis, and this machine has several drives")
            .next("give a case of one axis"));
    }
    let logs: Vec<_> = case.experiments.iter().filter_map(|experiment| experiment.log.as_deref()).collect();
    if logs.is_empty() {
        return Err(Error::new("no experiment has a log to learn from").next(
            "add [[experiment]] with a name and log = { file = \"slow.csv\", time = \"time_s\", input = \"voltage_V\", \
             drive_angle = \"angle_rad\" }",
        ));
    }
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for log in &logs {
        let [low, high] = travelled(machine, log)?;
        ends = [ends[0].min(low), ends[1].max(high)];
    }
    let finest = (ends[1] - ends[0]) / (MOST_POINTS - 1) as f64;
    let mut all = Vec::new();
    // Derivatives of a constant are rounding, which would have a direction.
    for log in logs.iter().filter(|_| finest > 0.0) {
        all.extend(passes(machine, log, finest)?);
    }
    of_passes(case, all)
}

fn of_passes(case: &Case, mut all: Vec<Pass>) -> Result<ForceMap> {
    let machine = &case.machine;
    let longest = all.iter().map(Pass::length).fold(0.0, f64::max);
    all.retain(|pass| pass.length() >= MAP_LENGTH * longest && pass.rows.len() > 1);
    let passes = [true, false].map(|forward| all.iter().filter(|pass| pass.is_forward == forward).count());
    if passes.contains(&0) {
        let there = match passes {
            [0, 0] => "do not move",
            [0, _] => "move backward only",
            _ => "move forward only",
        };
        return Err(Error::new(format!("the logs {there}: a force along the travel cannot be told from friction"))
            .allowed("slow motion over the whole travel in both directions")
            .next("log a slow move there and back"));
    }
    let low = all.iter().map(|pass| pass.ends()[0]).fold(f64::NEG_INFINITY, f64::max);
    let high = all.iter().map(|pass| pass.ends()[1]).fold(f64::INFINITY, f64::min);
    // Points of the case outside are kept.
    let own = machine.cart.forces.along.as_ref();
    let outside = |line: &&Polyline| line.points().iter().filter(|point| point[0] < low || point[0] > high).count();
    let fewest = all.iter().map(|pass| pass.rows.len()).min().unwrap_or(0) / MAP_ROWS;
    let count = fewest.min(MOST_POINTS.saturating_sub(own.as_ref().map_or(0, outside)));
    let too_few = || {
        Error::new(format!("the passes have too few rows in common for a map of {MAP_POINTS} points"))
            .next("log more slowly, at a higher rate, or over the same travel in both directions")
    };
    if count < MAP_POINTS || high <= low {
        return Err(too_few());
    }
    let step = (high - low) / (count - 1) as f64;
    let lines: Vec<Vec<f64>> = all.iter().filter_map(|pass| pass.line(low, step, count)).collect();
    if lines.len() < all.len() {
        return Err(too_few());
    }
    // F = (F⁺ + F⁻)/2, D = (F⁺ − F⁻)/2
    let side = |forward: bool, j: usize| {
        let own = all.iter().zip(&lines).filter(|(pass, _)| pass.is_forward == forward);
        own.map(|(_, line)| line[j]).sum::<f64>() / passes[usize::from(!forward)] as f64
    };
    let sides: Vec<[f64; 2]> = (0..count).map(|j| [side(true, j), side(false, j)]).collect();
    let values: Vec<f64> = sides.iter().map(|[forward, backward]| 0.5 * (forward + backward)).collect();
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| sides.iter().map(of).sum::<f64>() / count as f64;
    let friction = mean(&|[forward, backward]| 0.5 * (forward - backward));
    let residual = |(pass, line): (&Pass, &Vec<f64>)| -> Vec<f64> {
        let sign = if pass.is_forward { 1.0 } else { -1.0 };
        line.iter().zip(&values).map(|(own, value)| own - value - sign * friction).collect()
    };
    let residuals: Vec<Vec<f64>> = all.iter().zip(&lines).map(residual).collect();
    // With n⁺ and n⁻ passes var F = w σ², w = (1/n⁺ + 1/n⁻)/4, and E Σ_p r_p² = (P − 2 + P w) σ².
    let total = all.len() as f64;
    let weight = 0.25 * passes.iter().map(|count| 1.0 / *count as f64).sum::<f64>();
    let freedom = total - 2.0 + total * weight;
    let variance = |range: std::ops::Range<usize>| {
        let square = |own: &Vec<f64>| own[range.clone()].iter().map(|r| r * r).sum::<f64>();
        residuals.iter().map(square).sum::<f64>() / (freedom * range.len() as f64)
    };
    let smoothing = all.iter().map(|pass| pass.smoothing).fold(0.0, f64::max);
    let overall = variance(0..count);
    let factor = student((MAP_FREEDOM * freedom * count as f64) as usize);
    let point = |j: usize| {
        let local = variance(j.saturating_sub(MAP_LOCAL)..(j + MAP_LOCAL + 1).min(count));
        // A straight line between points has a mean error of at most h² F″/12, a Gaussian of σ² F″/2.
        let bend = if j == 0 || j + 1 == count { 0.0 } else { values[j + 1] - 2.0 * values[j] + values[j - 1] };
        let cut = bend.abs() * (1.0 / 12.0 + 0.5 * (smoothing / step).powi(2));
        let half = factor * (overall.max(local) * weight).sqrt() + cut;
        let force = values[j];
        Point { position: low + step * j as f64, force, band: [force - half, force + half], sides: sides[j] }
    };
    let points: Vec<Point> = (0..count).map(point).collect();
    let speed = all.iter().map(|pass| pass.speed).fold(0.0, f64::max);
    let (resolution, limit) = resolution(machine, (smoothing, step, speed))?;
    let found = search(&values, &Noise { residuals: &residuals, freedom, weight, step }, 1.0 / resolution);
    let length = step * count as f64;
    let origins = origins(case, resolution);
    let component = |wave: Wave| {
        let [number, error] = wave.number;
        let near = (3.0 * error).max(MAP_MATCH / length);
        let matches = |origin: &&Origin| (1.0 / origin.period() - number).abs() <= near;
        Component {
            period: [1.0 / number, error / (number * number)],
            amplitude: wave.amplitude,
            chance: wave.chance,
            origins: origins.iter().filter(matches).copied().collect(),
        }
    };
    let is_too_long = |origin: &Origin| match origin {
        Origin::Pulley { count: 2.., .. } | Origin::Motor { count: 2.., .. } => false,
        origin => MAP_PERIODS * origin.period() > length,
    };
    Ok(ForceMap {
        line: found.changes.then(|| added(own, &points)).flatten(),
        is_significant: found.changes,
        mean: mean(&|[forward, backward]| 0.5 * (forward + backward)),
        friction,
        components: found.waves.into_iter().map(component).collect(),
        visible: found.visible,
        too_long: origins.iter().copied().filter(is_too_long).collect(),
        points,
        passes,
        speed,
        resolution,
        limit,
    })
}

/// The line of the case with a map added, constant outside with its first and last value.
fn added(own: Option<&Polyline>, points: &[Point]) -> Option<Polyline> {
    let at = |x: f64| own.map_or(0.0, |line| line.value(x));
    let [low, high] = [points.first()?, points.last()?];
    let outside = |is_kept: &dyn Fn(f64) -> bool, force: f64| -> Vec<[f64; 2]> {
        let own = own.into_iter().flat_map(|line| line.points()).filter(|point| is_kept(point[0]));
        own.map(|[x, value]| [*x, value + force]).collect()
    };
    let inside = points.iter().map(|point| [point.position, at(point.position) + point.force]);
    let before = outside(&|x| x < low.position, low.force).into_iter();
    let behind = outside(&|x| x > high.position, high.force);
    Polyline::new(before.chain(inside).chain(behind).collect())
}

/// The shortest period that keeps its amplitude, and the cause of this limit.
///
/// A Gaussian of deviation σ leaves exp(−(2πσ/λ)²/2), a line through points h apart 1 − (2πh/λ)²/12, and a motor before
/// a belt of the frequency f₁ reports the force on the cart at the speed v times 1/(1 − (v/(λ f₁))²).
fn resolution(machine: &Machine, (smoothing, step, speed): (f64, f64, f64)) -> Result<(f64, Limit)> {
    let frequencies = Natural::frequencies(&machine.mechanism(), &[0.0; BODIES])?;
    let by_smoothing = 2.0 * PI * smoothing / (-2.0 * (1.0 - MAP_LOSS).ln()).sqrt();
    let by_points = 2.0 * PI * step / (12.0 * MAP_LOSS).sqrt();
    let by_resonance = frequencies.first().map_or(0.0, |first| speed / (first * (MAP_LOSS / (1.0 + MAP_LOSS)).sqrt()));
    let all =
        [(by_points, Limit::Points), (by_smoothing, Limit::Smoothing), (by_resonance, Limit::Resonance)].into_iter();
    Ok(all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((by_points, Limit::Points)))
}

/// The periods of a machine down to the resolution.
fn origins(case: &Case, resolution: f64) -> Vec<Origin> {
    let machine = &case.machine;
    let turn = 2.0 * PI * machine.pulley_radius;
    let motor = turn / machine.drives[0].motor.gear_ratio;
    let number = |key: &str| match case.value(key) {
        Ok(Given::Number(value)) => Some(value),
        Ok(Given::Whole(value)) => Some(value as f64),
        _ => None,
    };
    let of_belt = machine.belt.sheet.kind.map(|kind| kind.pitch);
    let pitch = of_belt.or(number("drive_pulley.pitch")).or(number("drive_pulley.teeth").map(|teeth| turn / teeth));
    let of_pulley = (1..).map(|count| Origin::Pulley { count, period: turn / f64::from(count) });
    let of_motor = (1..).map(|count| Origin::Motor { count, period: motor / f64::from(count) });
    of_pulley
        .take_while(|origin| origin.period() >= resolution)
        .chain(of_motor.take_while(|origin| origin.period() >= resolution))
        .chain(pitch.map(|period| Origin::Tooth { period }))
        .filter(|origin| origin.period() >= resolution)
        .collect()
}

impl ForceMap {
    /// The text of the case with the map in `cart.force_along`; none if it is not significant. Paths in it are those of
    /// `case`; `name` is used in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<Option<String>> {
        let Some(line) = &self.line else { return Ok(None) };
        let digits = |value: f64, digits: usize| format!("{value:.digits$}");
        let point = |[x, force]: &[f64; 2]| format!("[{}, {}]", digits(*x, 6), digits(*force, 6));
        let points: Vec<String> = line.points().iter().map(point).collect();
        let change = format!("cart.force_along=[{}]", points.join(", "));
        Ok(Some(Case::from_text_for(name, &case.text, &[&change], Files::Nothing)?.text))
    }

    /// True if a component has the period of a turn of the pulley, as an eccentric pulley would cause.
    pub fn may_be_eccentric(&self) -> bool {
        let is_turn = |origin: &Origin| matches!(origin, Origin::Pulley { count: 1, .. });
        self.components.iter().any(|component| component.origins.iter().any(is_turn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::TEMPLATE;

    /// A line through points is off a parabola by h² F″/12 in the mean, a Gaussian of deviation σ by σ² F″/2.
    #[test]
    fn the_band_of_a_parabola_is_what_points_and_smoothing_take() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let (steep, smoothing, speed) = (40.0, 1e-3, 0.05);
        let pass = |is_forward: bool| {
            let row = |k: u32| {
                let x = 2e-3 * f64::from(k);
                [x, 0.5 * steep * x * x + if is_forward { 2.0 } else { -2.0 }]
            };
            Pass { is_forward, rows: (0..120).map(row).collect(), speed, smoothing }
        };
        let map = of_passes(&case, vec![pass(true), pass(false)]).unwrap();
        assert_eq!((map.passes, map.speed), ([1, 1], speed));
        assert!((map.friction - 2.0).abs() < 1e-9, "{}", map.friction);
        let step = map.points[1].position - map.points[0].position;
        let half = steep * (step * step / 12.0 + 0.5 * smoothing * smoothing);
        for Point { force, band: [low, high], .. } in &map.points[5..map.points.len() - 5] {
            assert!(((high - force) / half - 1.0).abs() < 0.01, "{force} {low} {high}: {half}");
            assert!(((force - low) / half - 1.0).abs() < 0.01, "{force} {low} {high}: {half}");
        }
    }

    /// A tenth of the amplitude is lost at the shortest period: a line through points keeps the square of sin(x)/x with
    /// x = πh/λ, a Gaussian exp(−(2πσ/λ)²/2), and a motor before the belt of f₁ reports 1/(1 − (v/(λ f₁))²).
    #[test]
    fn the_shortest_period_loses_a_tenth_of_its_amplitude() {
        let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let (period, limit) = resolution(&machine, (1e-9, 2e-3, 1e-6)).unwrap();
        let x = PI * 2e-3 / period;
        assert!(limit == Limit::Points && ((x.sin() / x).powi(2) - 0.9).abs() < 0.005, "{period}");
        let (period, limit) = resolution(&machine, (2e-3, 1e-6, 1e-6)).unwrap();
        let kept = (-0.5 * (2.0 * PI * 2e-3 / period).powi(2)).exp();
        assert!(limit == Limit::Smoothing && (kept - 0.9).abs() < 1e-9, "{period} {kept}");
        let (period, limit) = resolution(&machine, (1e-9, 1e-9, 0.5)).unwrap();
        let first = Natural::frequencies(&machine.mechanism(), &[0.0; BODIES]).unwrap()[0];
        let more = 1.0 / (1.0 - (0.5 / (period * first)).powi(2));
        assert!(limit == Limit::Resonance && (more - 1.1).abs() < 1e-9, "{period} {more}");
    }

    /// A pass each way over `length` in `rows` rows; the force is one along the travel and a friction of its own.
    fn there_and_back(length: f64, rows: u32, along: &dyn Fn(f64) -> f64, friction: &dyn Fn(f64) -> f64) -> Vec<Pass> {
        let pass = |is_forward: bool| {
            let row = |k: u32| {
                let x = length * f64::from(k) / f64::from(rows - 1);
                [x, along(x) + if is_forward { friction(x) } else { -friction(x) }]
            };
            Pass { is_forward, rows: (0..rows).map(row).collect(), speed: 0.05, smoothing: 1e-9 }
        };
        vec![pass(true), pass(false)]
    }

    /// Neighbouring points share rows and noise: of 16 points of two passes four degrees of freedom are counted, so
    /// that a band is 2.78 standard errors wide to each side.
    #[test]
    fn a_point_has_four_rows_and_a_quarter_of_a_degree_of_freedom() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        // Friction that differs by ±0.1 N from point to point: 0.1 N is the standard error of their mean force.
        let uneven = |x: f64| {
            let (place, share) = ((15.0 * x / 0.3).floor(), (15.0 * x / 0.3).fract());
            let sign = if place % 2.0 == 0.0 { 1.0 } else { -1.0 };
            2.0 + 0.1 * sign * (1.0 - 2.0 * share)
        };
        let map = of_passes(&case, there_and_back(0.3, 64, &|_| 0.0, &uneven)).unwrap();
        assert_eq!(map.points.len(), 16);
        for Point { band: [low, high], .. } in &map.points {
            assert!((0.5 * (high - low) / 0.1 - 2.776).abs() < 0.02, "{low} {high}");
        }
    }

    /// A pulley whose radius is known to a per cent is still recognised in the period of a force, and one with 5 %
    /// more circumference is not.
    #[test]
    fn a_period_is_that_of_a_pulley_to_a_twentieth_of_a_period_per_travel() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let turn = 2.0 * PI * case.machine.pulley_radius;
        let named = |share: f64| {
            let along = |x: f64| (2.0 * PI * x / (turn * share)).sin();
            let map = of_passes(&case, there_and_back(4.0 * turn, 1200, &along, &|_| 2.0)).unwrap();
            assert_eq!(map.components.len(), 1, "{share}");
            !map.components[0].origins.is_empty()
        };
        assert!(named(1.0) && named(1.01) && !named(1.05));
    }
}
