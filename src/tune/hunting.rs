//! Limit cycles at rest: an integral against sticking friction and counts, found by simulation.

use crate::control::compensation::Rigid;
use crate::control::{Loop, Rows, Standard, stream};
use crate::design::{Design, Structure};
use crate::error::Result;
use crate::friction::Side;
use crate::signal::profile::{Leg, Limits, Profile};
use crate::solve::{Flow, Solver};
use crate::stage::{Encoder, Stage};

/// Way out before the slow reversal, m, half of which it goes back; enough to break away. Less on a short travel.
const WAY: f64 = 10e-3;

/// Its speed, m/s.
const SPEED: f64 = 20e-3;

/// Standard deviation of the intervals between swings, as a share of their mean, from which on they are irregular.
const IRREGULAR: f64 = 0.25;

/// Longest watch, s.
const LONGEST: f64 = 60.0;

/// An axis that does not come to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Hunt {
    /// Half of what the cart goes to and fro, m.
    pub amplitude: f64,
    /// s.
    pub period: f64,
    /// Whether intervals from one swing to the next differ by more than a quarter of their mean.
    pub irregular: bool,
    /// Without each of these it comes to rest.
    pub needs: Vec<&'static str>,
    /// How long it was watched at rest, s.
    pub watched: f64,
}

/// Watches the closed loop after a slow reversal; none if the cart comes to rest. A loop that is not stable hunts as
/// well, and needs nothing of what is listed.
pub fn hunting(stage: &Stage, design: &Design) -> Result<Option<Hunt>> {
    let watched = watch(stage, design);
    let Some(Swing { amplitude, period, irregular }) = swing(stage, design, stage, watched)? else { return Ok(None) };
    let mut needs = Vec::new();
    let mut without = |word: &'static str, stage_without: &Stage, design: &Design| -> Result<()> {
        if swing(stage_without, design, stage, watched)?.is_none() {
            needs.push(word);
        }
        Ok(())
    };
    if let Some(other) = without_integral(design) {
        without("integral action", stage, &other)?;
    }
    let other = friction(stage, |side| (side.coulomb, side.breakaway) = (0.0, 0.0));
    if other != *stage {
        without("dry friction", &other, design)?;
    }
    let other = friction(stage, |side| side.breakaway = side.coulomb);
    if other != *stage {
        without("breakaway above Coulomb friction", &other, design)?;
    }
    if stage.motor.gear_play.is_some() {
        let mut other = stage.clone();
        other.motor.gear_play = None;
        without("play in the gear", &other, design)?;
    }
    if stage.encoder.is_some() {
        let finer = |encoder: Option<Encoder>| encoder.map(|one| Encoder { lines: 1e6 * one.lines, ..one });
        let finer = Stage { encoder: finer(stage.encoder), scale: finer(stage.scale), ..stage.clone() };
        without("encoder counts", &finer, design)?;
    }
    Ok(Some(Hunt { amplitude, period, irregular, needs, watched }))
}

fn friction(stage: &Stage, change: fn(&mut Side)) -> Stage {
    let mut other = stage.clone();
    for law in [&mut other.drive_pulley.friction, &mut other.cart.friction, &mut other.idler_pulley.friction] {
        change(&mut law.forward);
        change(&mut law.backward);
    }
    other
}

fn without_integral(design: &Design) -> Option<Design> {
    let mut other = design.clone();
    match &mut other.structure {
        Structure::Pid(pid) if pid.integral != 0.0 => pid.integral = 0.0,
        Structure::Cascade(cascade) if cascade.speed_integral != 0.0 => cascade.speed_integral = 0.0,
        Structure::StateFeedback(weights) if weights.integral.is_some() => weights.integral = None,
        _ => return None,
    }
    Some(other)
}

/// How long to watch, s: some of the times in which the integral takes the command from one breakaway to the other.
fn watch(stage: &Stage, design: &Design) -> f64 {
    let rigid = Rigid::of(stage);
    let dry: f64 = rigid.coulomb.iter().sum();
    let count = stage.encoder.map_or(1e-6, |encoder| {
        let length = if crate::control::measures_cart(stage) { 1.0 } else { stage.pulley_radius };
        length / encoder.counts_per_unit(stage.motor.gear_ratio)
    });
    // Command per second and metre of error that stays.
    let rate = match &design.structure {
        Structure::Pid(pid) => pid.integral * rigid.force_per_command(),
        Structure::Cascade(cascade) => match cascade.current {
            Some(_) => cascade.speed_integral * cascade.position * rigid.force_per_ampere,
            None => cascade.speed_integral * cascade.position * rigid.force_per_command(),
        },
        _ => 0.0,
    };
    let ramp = dry / (rate.abs() * count);
    if ramp.is_finite() { (20.0 * ramp).clamp(4.0, LONGEST) } else { 10.0 }
}

/// A swing at rest: half of what the cart goes to and fro, m, how long that takes, s, and whether not always as long.
struct Swing {
    amplitude: f64,
    period: f64,
    irregular: bool,
}

/// The swing of the cart at rest; none if it rests or dies out.
fn swing(stage: &Stage, design: &Design, model: &Stage, watched: f64) -> Result<Option<Swing>> {
    let limits = Limits { speed: SPEED, acceleration: 0.2, jerk: None, snap: None };
    // From 0, to the side that has more room.
    let way = stage.travel.map_or(WAY, |travel| match travel.max >= -travel.min {
        true => travel.max.clamp(0.0, 2.0 * WAY) * 0.5,
        false => travel.min.clamp(-2.0 * WAY, 0.0) * 0.5,
    });
    let profile = Profile::new(0.0, &[Leg::To(way, limits), Leg::To(0.5 * way, limits)])?;
    let from = profile.end();
    let until = from + watched;
    let mut controller = Standard::new(design, model)?;
    let rows = Rows { until, every: design.every.min(until), window: 1e-4 };
    let mut cart: Vec<(f64, f64)> = Vec::new();
    let solver = Solver::of(stage);
    stream(stage, &mut controller, &Loop::of(design), &profile, &rows, solver, false, &mut |block| {
        let (time, x) = (block.get("time").unwrap_or(&[]), block.get("cart_position").unwrap_or(&[]));
        let late = time.iter().zip(x).filter(|(t, _)| **t > from + 0.25 * watched);
        cart.extend(late.map(|(t, x)| (*t, *x)));
        Flow::Continue
    })?;
    Ok(swung(&cart))
}

/// The swing of a cart of which place (m) over time (s) is known from a time on at which it should rest.
fn swung(cart: &[(f64, f64)]) -> Option<Swing> {
    let (early, late) = cart.split_at(cart.len() / 2);
    let ends = |part: &[(f64, f64)]| {
        part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| (low.min(*x), high.max(*x)))
    };
    let ((low, high), (early_low, early_high)) = (ends(late), ends(early));
    let (size, before) = (high - low, early_high - early_low);
    // What trembles in the last digits rests, and what halves dies out.
    if !(size > 1e-9 && size > 0.5 * before) {
        return None;
    }
    // Crossings of the middle upward, with a band of a quarter each way.
    let (mean, band) = (0.5 * (low + high), 0.25 * size);
    let mut below = false;
    let mut upward = Vec::new();
    for (time, x) in cart {
        if *x < mean - band {
            below = true;
        } else if *x > mean + band && below {
            below = false;
            upward.push(*time);
        }
    }
    match (upward.first(), upward.last()) {
        (Some(first), Some(last)) if upward.len() > 2 => {
            let period = (last - first) / (upward.len() - 1) as f64;
            let off = upward.windows(2).map(|pair| (pair[1] - pair[0] - period).powi(2)).sum::<f64>();
            let irregular = (off / (upward.len() - 1) as f64).sqrt() > IRREGULAR * period;
            Some(Swing { amplitude: 0.5 * size, period, irregular })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A cart that swings by `size(t)` to either side, a period after `lasts(k)` s.
    fn cart(lasts: impl Fn(usize) -> f64, size: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let (mut all, mut begin) = (Vec::new(), 0.0);
        for k in 0..40 {
            let period = lasts(k);
            let steps = (period / 1e-3) as usize;
            all.extend((0..steps).map(|i| {
                let share = i as f64 / steps as f64;
                let time = begin + share * period;
                (time, 0.01 + size(time) * (2.0 * PI * share).sin())
            }));
            begin += period;
        }
        all
    }

    /// An axis that jumps now after half a second, now after three was told to swing every 1.7 s.
    #[test]
    fn swings_of_unequal_length_are_irregular() {
        let regular = swung(&cart(|k| 0.5 + 0.02 * (k % 3) as f64, |_| 1e-5)).unwrap();
        assert!(!regular.irregular && (regular.period / 0.52 - 1.0).abs() < 0.01, "{}", regular.period);
        assert!((regular.amplitude / 1e-5 - 1.0).abs() < 1e-3, "{}", regular.amplitude);
        let unequal = swung(&cart(|k| if k % 3 == 0 { 3.0 } else { 0.5 }, |_| 1e-5)).unwrap();
        assert!(unequal.irregular, "{}", unequal.period);
    }

    #[test]
    fn what_dies_out_or_trembles_in_its_last_digits_rests() {
        assert!(swung(&cart(|_| 0.5, |t| 1e-5 * (-0.2 * t).exp())).is_none());
        assert!(swung(&cart(|_| 0.5, |_| 4e-10)).is_none());
        assert!(swung(&[]).is_none());
    }
}
