//! Figures of a move from the samples of its controller alone, for a search that runs thousands of moves.
//!
//! The motion is not observed, which takes a third of the time. Motion between samples is missing: a peak at a
//! frequency ω and a sample time T is too low by about (ω T)²/8, 1e-3 at 14 Hz and 1 kHz.

use super::figures::{Deviation, DriveFigures, Figures, LoadFigures, is_made};
use super::outcome::{at_rest, each, unrecorded};
use super::sampled::Loop;
use super::sampled_path::SampledPath;
use super::standard::Standard;
use crate::error::Result;
use crate::machine::{Machine, SlideAt};
use crate::mechanism::State;
use crate::metrics::{Meter, Peak};
use crate::signal::profile::Profile;
use crate::solve::{self, Solver};

/// Runs a move and gathers the errors of the slides, settling and RMS currents from samples, interpolated linearly;
/// returns the figures and the ending. Motion and commands are those of [`closed_loop`](super::closed_loop).
pub(crate) fn closed_loop_at_samples(
    machine: &Machine,
    controllers: &mut [Standard],
    timing: &Loop,
    path: &SampledPath,
    (until, window): (f64, f64),
    solver: Solver,
) -> Result<(Figures, solve::Ending)> {
    timing.check(until)?;
    let experiment = at_rest(machine, path.profiles(), until, timing.every.min(until));
    let mut gathered = Gathered::new(machine, path, window);
    let see = |time: f64, state: &State, currents: &[f64]| gathered.see(time, state, currents);
    let run = (machine, &experiment);
    let outcome = unrecorded(run, &mut each(controllers), (timing, path), solver, None::<&mut Meter>, see)?;
    Ok((gathered.finish(), outcome.ending))
}

/// Figures at samples.
struct Gathered<'a> {
    window: f64,
    /// End of the profiles, and the last sample, s.
    done: f64,
    last: Option<f64>,
    /// Number of samples so far.
    seen: usize,
    path: &'a SampledPath,
    slides: Vec<OfSlide<'a>>,
    currents: Vec<Squared>,
}

/// Figures of a slide.
struct OfSlide<'a> {
    body: usize,
    profile: &'a Profile,
    target: f64,
    peak: Peak,
    squared: Squared,
    /// The largest distance from its start, m.
    reached: f64,
    /// The error at the last sample, and the distance from the target, m.
    error: f64,
    away: f64,
    /// Time of the last entry into its window after the profile, s.
    entered: Option<f64>,
}

/// The integral of a square over time, and the square at the last sample.
#[derive(Clone, Copy, Default)]
struct Squared {
    sum: f64,
    last: f64,
}

impl Squared {
    /// Adds the next sample; `length` is the time since the previous one, s, if any.
    fn see(&mut self, value: f64, length: Option<f64>) {
        let square = value * value;
        if let Some(length) = length {
            self.sum += 0.5 * length * (self.last + square);
        }
        self.last = square;
    }

    /// The root mean square until `end`, s.
    fn root(self, end: f64) -> f64 {
        (self.sum / end.max(f64::MIN_POSITIVE)).sqrt()
    }
}

impl<'a> Gathered<'a> {
    fn new(machine: &Machine, path: &'a SampledPath, window: f64) -> Self {
        let profiles = path.profiles();
        let slide = |(profile, at): (&'a Profile, &SlideAt)| OfSlide {
            body: at.body,
            profile,
            target: profile.target(),
            peak: Peak::default(),
            squared: Squared::default(),
            reached: 0.0,
            error: 0.0,
            away: 0.0,
            entered: None,
        };
        Self {
            window,
            done: Profile::last_end(profiles),
            last: None,
            seen: 0,
            path,
            slides: profiles.iter().zip(machine.geometry().slides).map(slide).collect(),
            currents: vec![Squared::default(); machine.drives.len()],
        }
    }

    fn see(&mut self, time: f64, state: &State, currents: &[f64]) {
        let length = self.last.map(|before| time - before);
        self.currents.iter_mut().zip(currents).for_each(|(squared, current)| squared.see(*current, length));
        for (number, slide) in self.slides.iter_mut().enumerate() {
            let x = state.position[slide.body];
            let error = x - self.path.position(self.seen, time, number);
            slide.reached = slide.reached.max((x - slide.profile.start()).abs());
            if error.abs() > slide.peak.value.abs() {
                slide.peak = Peak { value: error, time };
            }
            slide.squared.see(error, length);
            let (from, away) = (slide.away, (x - slide.target).abs());
            if let Some((before, length)) = self.last.zip(length)
                && time > self.done
                && from > self.window
                && away <= self.window
            {
                let share = (from - self.window) / (from - away);
                slide.entered = Some(before + share * length);
            }
            (slide.error, slide.away) = (error, away);
        }
        (self.last, self.seen) = (Some(time), self.seen + 1);
    }

    fn finish(self) -> Figures {
        let end = self.last.unwrap_or_default();
        let inside = |slide: &OfSlide| slide.away <= self.window && is_made(slide.profile, self.window, slide.reached);
        let is_inside = end >= self.done && self.slides.iter().all(inside);
        let entered = self.slides.iter().filter_map(|slide| slide.entered).reduce(f64::max);
        let load = |slide: &OfSlide| LoadFigures {
            error: Deviation { peak: slide.peak, rms: slide.squared.root(end), last: slide.error },
            overshoot: 0.0,
        };
        let drive = |current: &Squared| DriveFigures {
            current: (Peak::default(), current.root(end)),
            ..DriveFigures::default()
        };
        Figures {
            loads: self.slides.iter().map(load).collect(),
            settling: is_inside.then(|| entered.map_or(0.0, |time| (time - self.done).max(0.0))),
            drives: self.currents.iter().map(drive).collect(),
            spans: Vec::new(),
            contour: None,
        }
    }
}
