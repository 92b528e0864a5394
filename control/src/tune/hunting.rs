//! Limit cycles at rest (hunting), by integral action with sticking friction and encoder counts.
//!
//! They are found by simulation. Between two slips of a stuck axis the command is a ramp, the integral of a constant
//! error, and the next slip follows in closed form: with the slope u̇ of the command and the force g per command it
//! occurs when g u reaches the breakaway of cart and pulleys. This determines the observation time if slips are rare,
//! and the time of the next slip if no observation is long enough. Machines with several drives are observed without
//! it.

use crate::control::{Loop, Sample, Standard, each, recorded};
use crate::design::Design;
use crate::error::Result;
use crate::friction::Side;
use crate::machine::rigid::Rigid;
use crate::machine::{Encoder, Machine, Slide, SlideAt};
use crate::signal::profile::{Leg, Limits, Profile};
use crate::solve::{Flow, Solver};
use crate::trajectory::Trajectory;

/// Outward stroke before the slow reversal, m, half of which is the return; enough to break away. Less on a short
/// travel.
const WAY: f64 = 10e-3;

/// Its speed, m/s.
const SPEED: f64 = 20e-3;

/// Fractions of that stroke tried in turn until an axis does not come to rest: a remaining error depends on the
/// position of the target between two counts.
const STARTS: [f64; 3] = [1.0, 0.8713, 0.9361];

/// Relative standard deviation of the intervals between oscillations above which they are irregular.
const IRREGULAR: f64 = 0.25;

/// Longest first observation of an axis, s.
const LONGEST: f64 = 60.0;

/// Number of slips that a longer observation covers, its maximum number of samples, and the largest prediction time of
/// a slip, s.
const SLIPS: f64 = 4.0;
const MOST: f64 = 1e6;
const FORESEEN: f64 = 3600.0;

/// Largest ratio of the slopes of both halves of a ramp.
const STEADY: f64 = 3.0;

/// For a cart that slips occasionally: fraction of samples at rest, motion between samples at rest relative to its
/// total motion, and time without motion between two slips, s.
const STANDS: f64 = 0.7;
const STILL: f64 = 1e-4;
const APART: f64 = 0.05;

/// Relative increase of the amplitude that counts as more hunting.
const WIDER: f64 = 0.1;

/// An axis that does not come to rest.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Hunt {
    /// Amplitude of the cart's oscillation, m; NaN if no slip was observed.
    pub amplitude: f64,
    /// Period, s; NaN if no slip was observed.
    pub period: f64,
    /// Time between slips, or bursts of slips, of an axis that is stuck between them, s: half of its time at rest is in
    /// intervals of at least that length. Infinite if it always oscillates.
    pub slips_every: f64,
    /// True if the intervals between oscillations vary by more than a quarter of their mean.
    pub irregular: bool,
    /// Necessary causes: without each of these it comes to rest.
    pub needs: Vec<&'static str>,
    /// Observation time at rest, s.
    pub watched: f64,
}

/// A limit cycle, and the fraction of the stroke after which it was observed.
pub(super) type Observed = (Hunt, f64);

/// Observes the closed loop after a slow reversal; none if the cart comes to rest. An unstable loop hunts as well,
/// without any of the listed causes.
pub fn hunting(machine: &Machine, design: &Design) -> Result<Option<Hunt>> {
    observed(machine, design)?.map(|found| with_causes(machine, design, found)).transpose()
}

/// A limit cycle with its necessary causes.
pub(super) fn with_causes(machine: &Machine, design: &Design, (hunt, start): Observed) -> Result<Hunt> {
    let watched = watch(machine, design);
    let mut needs = Vec::new();
    let mut without = |word: &'static str, stage_without: &Machine, design: &Design| -> Result<()> {
        let seen = seen(stage_without, design, machine, start, (watched, 0.25 * watched))?;
        if seen.swing.is_none() && seen.next(stage_without).is_none() {
            needs.push(word);
        }
        Ok(())
    };
    if let Some(other) = integral_times(design, 0.0) {
        without("integral action", machine, &other)?;
    }
    let other = friction(machine, |side| (side.coulomb, side.breakaway) = (0.0, 0.0));
    if other != *machine {
        without("dry friction", &other, design)?;
    }
    let other = friction(machine, |side| side.breakaway = side.coulomb);
    if other != *machine {
        without("breakaway above Coulomb friction", &other, design)?;
    }
    if machine.drives.iter().any(|drive| drive.motor.gear_play.is_some()) {
        let mut other = machine.clone();
        other.drives.iter_mut().for_each(|drive| drive.motor.gear_play = None);
        without("play in the gear", &other, design)?;
    }
    if machine.encoder.is_some() {
        let finer = |encoder: Option<Encoder>| encoder.map(|one| Encoder { lines: 1e6 * one.lines, ..one });
        let finer = Machine { encoder: finer(machine.encoder), scale: finer(machine.scale), ..machine.clone() };
        without("encoder counts", &finer, design)?;
    }
    Ok(Hunt { needs, ..hunt })
}

/// Observes the limit cycle without its causes.
pub(super) fn observed(machine: &Machine, design: &Design) -> Result<Option<Observed>> {
    for start in STARTS {
        if let Some(hunt) = hunts_at(machine, design, start)? {
            return Ok(Some((hunt, start)));
        }
    }
    Ok(None)
}

/// The limit cycle after this fraction of the stroke.
fn hunts_at(machine: &Machine, design: &Design, start: f64) -> Result<Option<Hunt>> {
    let short = watch(machine, design);
    let first = seen(machine, design, machine, start, (short, 0.25 * short))?;
    let hunt = |Swing { amplitude, period, irregular, slips_every }: Swing, watched: f64| Hunt {
        amplitude,
        period,
        irregular,
        slips_every,
        needs: Vec::new(),
        watched,
    };
    if let Some(swing) = first.swing {
        return Ok(Some(hunt(swing, short)));
    }
    let Some((next, most)) = first.next(machine) else { return Ok(None) };
    let unseen = |next: f64, watched: f64| {
        let swing = Swing { amplitude: f64::NAN, period: f64::NAN, irregular: false, slips_every: next };
        hunt(swing, watched)
    };
    let bound = (MOST * design.every).min(FORESEEN);
    if short + 2.0 * next > bound {
        return Ok(Some(unseen(next, short)));
    }
    let watched = (short + SLIPS * most).min(bound);
    let second = seen(machine, design, machine, start, (watched, 0.25 * short))?;
    Ok(match (second.swing.or_else(|| widest(&second.slides, rare)), second.next(machine)) {
        (Some(swing), _) => Some(hunt(swing, watched)),
        // It slips, but not often enough to observe an oscillation.
        (None, Some((next, _))) => Some(unseen(next, watched)),
        (None, None) => None,
    })
}

impl Hunt {
    /// True if it hunts more than the other: if that one rests, or with a larger amplitude. Predicted slips of the
    /// other have an unknown size: an oscillation counts as more if it leaves the `window` (m) of a move, rarer slips
    /// never do.
    pub(super) fn is_more_than(&self, other: Option<&Hunt>, window: f64) -> bool {
        let Some(other) = other else { return true };
        match (self.amplitude.is_finite(), other.amplitude.is_finite()) {
            (true, true) => self.amplitude > (1.0 + WIDER) * other.amplitude,
            (true, false) => self.amplitude > window,
            (false, _) => (1.0 + WIDER) * self.interval() < other.interval(),
        }
    }

    /// Time between slips, or the period if the cart never rests, s.
    fn interval(&self) -> f64 {
        if self.slips_every.is_finite() { self.slips_every } else { self.period }
    }
}

fn friction(machine: &Machine, change: fn(&mut Side)) -> Machine {
    let mut other = machine.clone();
    let bridge = other.bridge.iter_mut().map(|bridge| &mut bridge.friction);
    let others = [&mut other.drive_pulley.friction, &mut other.cart.friction, &mut other.idler_pulley.friction];
    for law in bridge.chain(others) {
        change(&mut law.forward);
        change(&mut law.backward);
    }
    other
}

/// The design with its integral action multiplied by `factor`, removed if 0; none without integral action.
pub(super) fn integral_times(design: &Design, factor: f64) -> Option<Design> {
    let structure = design.structure.tunable().integral_times(factor)?;
    Some(Design { structure, ..design.clone() })
}

/// Observation time, s: a multiple of the time in which the integral moves the command from one breakaway to the other.
fn watch(machine: &Machine, design: &Design) -> f64 {
    let rigid = Rigid::new(machine);
    let dry: f64 = rigid.coulomb.iter().sum();
    let count = machine.encoder.map_or(1e-6, |encoder| {
        let length = if crate::control::measures_cart(machine) { 1.0 } else { machine.pulley_radius };
        length / encoder.counts_per_unit(machine.drives[0].motor.gear_ratio)
    });
    // Force per second and metre of constant error.
    let structure = design.structure.tunable();
    let force = if structure.commands_current() { rigid.driving_force_per_ampere() } else { rigid.force_per_command() };
    let rate = structure.ramp() * force;
    let ramp = dry / (rate.abs() * count);
    if ramp.is_finite() { (20.0 * ramp).clamp(4.0, LONGEST) } else { 10.0 }
}

/// An oscillation at rest: amplitude of the cart, m, period, s, true if irregular; and the time between slips of a cart
/// that rests between them, s.
#[derive(Clone, Copy)]
struct Swing {
    amplitude: f64,
    period: f64,
    irregular: bool,
    slips_every: f64,
}

/// A recorded oscillation of a sliding part, its positions (m) over time (s), and the final command, with its slope if
/// it is a ramp.
struct ObservedSwing {
    swing: Option<Swing>,
    slides: Vec<Vec<(f64, f64)>>,
    command: f64,
    slope: Option<f64>,
}

impl ObservedSwing {
    /// Time until the command of a stuck axis reaches its breakaway, and time from one breakaway to the other, s; none
    /// if the command does not move towards it, or with several drives.
    fn next(&self, machine: &Machine) -> Option<(f64, f64)> {
        if machine.drives.len() > 1 {
            return None;
        }
        let (rigid, r) = (Rigid::new(machine), machine.pulley_radius);
        let most = |side: &Side| side.coulomb.max(side.breakaway);
        let of = |friction: &crate::friction::Friction| most(&friction.forward).max(most(&friction.backward));
        let pulleys = (of(&machine.drive_pulley.friction) + of(&machine.idler_pulley.friction)) / r;
        let breakaway = pulleys + of(&machine.cart.friction);
        let (force, slope) = (rigid.force_per_command(), self.slope?);
        // g u + f = ±b
        let ends = [1.0, -1.0].map(|sign| (sign * breakaway - rigid.constant) / force);
        let until = ends.map(|end| (end - self.command) / slope).into_iter().fold(0.0, f64::max);
        let whole = 2.0 * breakaway / (force * slope).abs();
        (breakaway > 0.0 && until <= FORESEEN && whole.is_finite()).then_some((until, whole))
    }
}

/// Slope of a command over time if it is a ramp, with similar slopes in both halves.
fn slope(command: &[(f64, f64)]) -> Option<f64> {
    let [(t0, u0), (t1, u1), (t2, u2)] = [*command.first()?, *command.get(command.len() / 2)?, *command.last()?];
    let (early, late) = ((u1 - u0) / (t1 - t0), (u2 - u1) / (t2 - t1));
    let ratio = early / late;
    ((1.0 / STEADY..=STEADY).contains(&ratio) && late.is_finite()).then_some(late)
}

/// Motion of the cart at rest after this fraction of the stroke, observed for this time, starting this long after the
/// reversal, s.
fn seen(
    machine: &Machine,
    design: &Design,
    model: &Machine,
    start: f64,
    (watched, skipped): (f64, f64),
) -> Result<ObservedSwing> {
    let limits = Limits { speed: SPEED, acceleration: 0.2, jerk: None, snap: None };
    // From 0, towards the longer side of the travel.
    let reversal = |slide: &Slide| {
        let way = start
            * slide.travel.map_or(WAY, |travel| match travel.max >= -travel.min {
                true => travel.max.clamp(0.0, 2.0 * WAY) * 0.5,
                false => travel.min.clamp(-2.0 * WAY, 0.0) * 0.5,
            });
        Profile::new(0.0, &[Leg::To(way, limits), Leg::To(0.5 * way, limits)])
    };
    let profiles = machine.slides().map(reversal).collect::<Result<Vec<_>>>()?;
    let from = Profile::last_end(&profiles);
    let until = from + watched;
    let mut controllers = Standard::of_drives(design, model)?;
    let geometry = machine.geometry();
    let column = |slide: &SlideAt| format!("{}_position", geometry.label(slide.body).key);
    let columns: Vec<String> = geometry.slides.iter().map(column).collect();
    let mut slides: Vec<Vec<(f64, f64)>> = vec![Vec::new(); columns.len()];
    let mut take = |block: &Trajectory| {
        let time = block.get("time").unwrap_or(&[]);
        for (places, column) in slides.iter_mut().zip(&columns) {
            let late = time.iter().zip(block.get(column).unwrap_or(&[])).filter(|(t, _)| **t > from + skipped);
            places.extend(late.map(|(t, x)| (*t, *x)));
        }
        Flow::Continue
    };
    let (timing, solver) = (Loop::new(design), Solver::for_machine(machine));
    let samples = recorded(machine, &mut each(&mut controllers), (&timing, &profiles), until, solver, &mut take)?;
    // The last eighth of the observation.
    let late = samples.iter().filter(|sample| sample.drive == 0 && sample.time >= until - 0.125 * watched);
    // The field of a stepper leads its rotor by the correction and by the error.
    let lead = |sample: &Sample| if machine.stepper().is_some() { sample.reference - sample.measured } else { 0.0 };
    let command: Vec<(f64, f64)> = late.map(|sample| (sample.time, sample.given + lead(sample))).collect();
    let command_now = command.last().map_or(0.0, |(_, given)| *given);
    Ok(ObservedSwing { swing: widest(&slides, swung), slides, command: command_now, slope: slope(&command) })
}

/// The largest oscillation of the slides.
fn widest(slides: &[Vec<(f64, f64)>], swing: fn(&[(f64, f64)]) -> Option<Swing>) -> Option<Swing> {
    slides.iter().filter_map(|places| swing(places)).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))
}

/// Oscillation of a cart from its position (m) over time (s) after the time at which it should rest.
fn swung(cart: &[(f64, f64)]) -> Option<Swing> {
    let (early, late) = cart.split_at(cart.len() / 2);
    let ends = |part: &[(f64, f64)]| {
        part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| (low.min(*x), high.max(*x)))
    };
    let ((low, high), (early_low, early_high)) = (ends(late), ends(early));
    let (size, before) = (high - low, early_high - early_low);
    // Motion in the last digits counts as rest, and motion that halves as decaying.
    if !(size > 1e-9 && size > 0.5 * before) {
        return None;
    }
    // Upward crossings of the middle, with a hysteresis of a quarter to each side.
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
            Some(Swing { amplitude: 0.5 * size, period, irregular, slips_every: slips(cart, size) })
        }
        _ => None,
    }
}

/// Slips of a cart that moves occasionally, with rests of any length between; none if it moves at most twice, since it
/// may be coming to rest.
fn rare(cart: &[(f64, f64)]) -> Option<Swing> {
    let (low, high) =
        cart.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| (low.min(*x), high.max(*x)));
    let slips_every = if high - low > 1e-9 { slips(cart, high - low) } else { f64::INFINITY };
    let swing = Swing { amplitude: 0.5 * (high - low), period: 2.0 * slips_every, irregular: true, slips_every };
    slips_every.is_finite().then_some(swing)
}

/// Time between the slips of a cart that is mostly at rest, s: median over the instants of the observation, so that
/// bursts of slips count as one. Infinite for a cart that does not rest.
fn slips(cart: &[(f64, f64)], size: f64) -> f64 {
    let moves = |pair: &&[(f64, f64)]| (pair[1].1 - pair[0].1).abs() > STILL * size;
    let moving: Vec<f64> = cart.windows(2).filter(moves).map(|pair| pair[1].0).collect();
    if moving.len() as f64 > (1.0 - STANDS) * cart.len() as f64 {
        return f64::INFINITY;
    }
    let begins = moving.windows(2).filter(|pair| pair[1] - pair[0] > APART).map(|pair| pair[1]);
    let begins: Vec<f64> = moving.first().copied().into_iter().chain(begins).collect();
    if begins.len() < 3 {
        return f64::INFINITY;
    }
    let mut apart: Vec<f64> = begins.windows(2).map(|pair| pair[1] - pair[0]).collect();
    apart.sort_by(f64::total_cmp);
    let whole: f64 = apart.iter().sum();
    let mut passed = 0.0;
    let is_half = |time: &f64| {
        passed += time;
        passed >= 0.5 * whole
    };
    apart.iter().copied().find(is_half).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A cart that oscillates with the amplitude `size(t)` and periods of `lasts(k)` s.
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

    /// An axis that jumped after half a second or after three seconds was reported to oscillate every 1.7 s.
    #[test]
    fn swings_of_unequal_length_are_irregular() {
        let regular = swung(&cart(|k| 0.5 + 0.02 * (k % 3) as f64, |_| 1e-5)).unwrap();
        assert!(!regular.irregular && (regular.period / 0.52 - 1.0).abs() < 0.01, "{}", regular.period);
        assert!((regular.amplitude / 1e-5 - 1.0).abs() < 1e-3, "{}", regular.amplitude);
        let unequal = swung(&cart(|k| if k % 3 == 0 { 3.0 } else { 0.5 }, |_| 1e-5)).unwrap();
        assert!(unequal.irregular, "{}", unequal.period);
    }

    /// An axis that rested for more than a minute between bursts of slips was reported to be at rest.
    #[test]
    fn slips_far_apart_are_seen() {
        let place = |t: f64| if ((t / 25.0) as u64).is_multiple_of(2) { 4e-4 } else { -4e-4 };
        let cart: Vec<(f64, f64)> = (0..20_000).map(|k| 1e-2 * f64::from(k)).map(|t| (t, place(t))).collect();
        let swing = rare(&cart).unwrap();
        assert!(
            (swing.slips_every - 25.0).abs() < 0.1 && (swing.amplitude - 4e-4).abs() < 1e-9,
            "{}",
            swing.slips_every
        );
        // In bursts of five slips, 0.3 s apart, the bursts count.
        let step = |t: f64| (t / 25.0).floor() + 0.2 * ((t % 25.0) / 0.3).floor().min(5.0);
        let bursts: Vec<(f64, f64)> = cart.iter().map(|(t, _)| (*t, 4e-4 * (step(*t) % 2.0))).collect();
        let every = slips(&bursts, 8e-4);
        assert!((every - 23.5).abs() < 0.4, "{every}");
        // After two slips it may come to rest.
        assert!(rare(&cart[..7400]).is_none() && rare(&cart[..2000]).is_none());
        // A ramp continues; a command that levels off or chatters does not.
        let ramp =
            |of: &dyn Fn(f64) -> f64| slope(&(0..100).map(|k| (f64::from(k), of(f64::from(k)))).collect::<Vec<_>>());
        assert!(ramp(&|t| 0.5 - 1e-3 * t).is_some_and(|slope| (slope + 1e-3).abs() < 1e-12));
        assert!(
            ramp(&|t| (-0.1 * t).exp()).is_none() && ramp(&|t| (t - 50.0).abs()).is_none() && ramp(&|_| 0.3).is_none()
        );
    }

    #[test]
    fn what_dies_out_or_trembles_in_its_last_digits_rests() {
        assert!(swung(&cart(|_| 0.5, |t| 1e-5 * (-0.2 * t).exp())).is_none());
        assert!(swung(&cart(|_| 0.5, |_| 4e-10)).is_none());
        assert!(swung(&[]).is_none());
    }
}
