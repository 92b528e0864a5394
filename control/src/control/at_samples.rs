//! A move as it is at the samples of its controller: figures without what is between, for a search that runs thousands.
//!
//! Nobody observes the motion, which takes a third of the time. What is between samples is missing: a peak by about
//! (ω T)²/8 of itself at a frequency ω and a sample time T, 1e-3 at 14 Hz and 1 kHz.

use super::figures::{Deviation, DriveFigures, Figures, LoadFigures};
use super::outcome::{at_rest, unrecorded};
use super::sampled::{Controller, Loop};
use super::standard::Standard;
use crate::error::Result;
use crate::machine::Machine;
use crate::machine::axis::CART;
use crate::mechanism::State;
use crate::metrics::{Meter, Peak};
use crate::signal::profile::Profile;
use crate::solve::{self, Solver};

/// Runs a move of an axis and gathers the cart's error, settling and the root mean square of the current at samples
/// alone, with straight lines between; the figures, and how the run ended. Motion and commands are those of
/// [`closed_loop`](super::closed_loop).
pub(crate) fn closed_loop_at_samples(
    machine: &Machine,
    controller: &mut Standard,
    timing: &Loop,
    profiles: &[Profile],
    (until, window): (f64, f64),
    solver: Solver,
) -> Result<(Figures, solve::Ending)> {
    timing.check(until)?;
    let experiment = at_rest(machine, profiles, until, timing.every.min(until));
    let mut gathered = Gathered::new(&profiles[0], window);
    let see = |time: f64, state: &State, current: f64| gathered.see(time, state, current);
    let controllers = &mut [controller as &mut dyn Controller];
    let outcome = unrecorded((machine, &experiment), controllers, (timing, profiles), solver, None::<&mut Meter>, see)?;
    Ok((gathered.finish(), outcome.ending))
}

/// Figures at samples.
struct Gathered<'a> {
    profile: &'a Profile,
    window: f64,
    /// End of the profile, s, and target, m.
    done: f64,
    target: f64,
    /// The last sample: time, cart's error, squares of error and current, distance from the target.
    last: Option<(f64, f64, [f64; 2], f64)>,
    peak: Peak,
    /// ∫ of the squares.
    squares: [f64; 2],
    /// When the cart entered its window for the last time after the profile.
    entered: Option<f64>,
}

impl<'a> Gathered<'a> {
    fn new(profile: &'a Profile, window: f64) -> Self {
        let (done, target) = (profile.end(), profile.target());
        let (peak, squares) = (Peak::default(), [0.0; 2]);
        Self { profile, window, done, target, last: None, peak, squares, entered: None }
    }

    fn see(&mut self, time: f64, state: &State, current: f64) {
        let x = state.position[CART];
        let error = x - self.profile.at(time).position;
        if error.abs() > self.peak.value.abs() {
            self.peak = Peak { value: error, time };
        }
        let (values, away) = ([error * error, current * current], (x - self.target).abs());
        if let Some((before, _, was, from)) = self.last {
            let length = time - before;
            for (sum, (was, is)) in self.squares.iter_mut().zip(was.iter().zip(values)) {
                *sum += 0.5 * length * (was + is);
            }
            if time > self.done && from > self.window && away <= self.window {
                let share = (from - self.window) / (from - away);
                self.entered = Some(before + share * length);
            }
        }
        self.last = Some((time, error, values, away));
    }

    fn finish(self) -> Figures {
        let (end, last, _, away) = self.last.unwrap_or_default();
        let [error, current] = self.squares.map(|sum| (sum / end.max(f64::MIN_POSITIVE)).sqrt());
        let is_inside = end >= self.done && away <= self.window;
        Figures {
            loads: vec![LoadFigures { error: Deviation { peak: self.peak, rms: error, last }, overshoot: 0.0 }],
            settling: is_inside.then(|| self.entered.map_or(0.0, |time| (time - self.done).max(0.0))),
            drives: vec![DriveFigures { current: (Peak::default(), current), ..DriveFigures::default() }],
            contour: None,
        }
    }
}
