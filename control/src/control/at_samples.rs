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
use crate::solve::{self, Flow, Solver};

/// Number of samples between two questions whether a run is enough.
const ASKED: usize = 32;

/// Runs a move and gathers the errors of the slides, settling and RMS currents from samples, interpolated linearly;
/// returns the figures and the ending, and the time of the last sample, s. Motion and commands are those of
/// [`closed_loop`](super::closed_loop). The run stops if `is_enough` says so of the figures so far, each a lower bound
/// of that of the whole run; these are then returned.
pub(crate) fn closed_loop_at_samples(
    machine: &Machine,
    controllers: &mut [Standard],
    timing: &Loop,
    path: &SampledPath,
    (until, window): (f64, f64),
    solver: Solver,
    is_enough: &mut dyn FnMut(&Figures) -> bool,
) -> Result<AtSamples> {
    timing.check(until)?;
    let experiment = at_rest(machine, path.profiles(), until, timing.every.min(until));
    let (mut gathered, mut is_cut) = (Gathered::new(machine, path, window), false);
    let see = |time: f64, state: &State, currents: &[f64]| {
        gathered.see(time, state, currents);
        is_cut = gathered.seen % ASKED == 0 && is_enough(&gathered.so_far(until));
        if is_cut { Flow::Stop } else { Flow::Continue }
    };
    let run = (machine, &experiment);
    let outcome = unrecorded(run, &mut each(controllers), (timing, path), solver, None::<&mut Meter>, see)?;
    let end = gathered.last.unwrap_or_default();
    Ok(match is_cut {
        true => AtSamples { figures: gathered.so_far(until), ending: None, end },
        false => AtSamples { figures: gathered.finish(), ending: Some(outcome.ending), end },
    })
}

/// Figures of a move at samples.
pub(crate) struct AtSamples {
    /// Figures, of a run that was cut short lower bounds.
    pub figures: Figures,
    /// The ending of a run that was not cut short.
    pub ending: Option<solve::Ending>,
    /// Time of the last sample, s.
    pub end: f64,
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

    /// Figures of the whole run.
    fn finish(self) -> Figures {
        let end = self.last.unwrap_or_default();
        let inside = |slide: &OfSlide| slide.away <= self.window && is_made(slide.profile, self.window, slide.reached);
        let is_inside = end >= self.done && self.slides.iter().all(inside);
        self.figures(end, is_inside.then(|| self.entered().map_or(0.0, |time| (time - self.done).max(0.0))))
    }

    /// Lower bounds of the figures of a run until `until`, s.
    fn so_far(&self, until: f64) -> Figures {
        let is_outside = self.slides.iter().any(|slide| slide.away > self.window);
        let outside = if is_outside { self.last } else { self.entered() };
        self.figures(until, Some(outside.map_or(0.0, |time| (time - self.done).max(0.0))))
    }

    /// Time of the last entry of a slide into its window, s.
    fn entered(&self) -> Option<f64> {
        self.slides.iter().filter_map(|slide| slide.entered).reduce(f64::max)
    }

    fn figures(&self, end: f64, settling: Option<f64>) -> Figures {
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
            settling,
            drives: self.currents.iter().map(drive).collect(),
            spans: Vec::new(),
            contour: None,
        }
    }
}
