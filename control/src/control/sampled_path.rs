//! Profiles with their references at the decisions of a loop, computed once for all runs along them.

use super::sampled::{Loop, SLIDES};
use super::stepped::References;
use crate::signal::profile::{Profile, Reference};
use crate::trajectory::Interval;

/// Largest number of samples whose references are kept; later ones are computed in each run.
const MOST: u64 = 100_000;

/// Profiles, one for each coordinate, and their references at the decisions of loops of one timing.
#[derive(Debug, Clone)]
pub(crate) struct SampledPath {
    profiles: Vec<Profile>,
    timing: Loop,
    /// At each sample: of each slide its reference, and that one lead later.
    samples: Vec<[Reference; 2]>,
    /// Time of each decision, s, and positions of all slides there, m.
    times: Vec<f64>,
    positions: Vec<f64>,
}

impl SampledPath {
    /// Of these profiles in runs until `until`, s, by loops of this timing.
    pub(crate) fn new(profiles: Vec<Profile>, timing: Loop, until: f64) -> Self {
        let (clock, rest) = (Interval::new(timing.every), timing.samples_late().1);
        let mut path = Self { profiles, timing, samples: Vec::new(), times: Vec::new(), positions: Vec::new() };
        for time in (0..MOST).map(|k| clock.times(k)).take_while(|time| *time <= until) {
            let [now, later] = references(&path.profiles, time, timing.lead);
            path.samples.extend(now.into_iter().zip(later).take(path.profiles.len()).map(|(now, later)| [now, later]));
            path.decides_at(time);
            if rest > 0.0 {
                path.decides_at(time + rest);
            }
        }
        path
    }

    fn decides_at(&mut self, time: f64) {
        self.times.push(time);
        self.positions.extend(self.profiles.iter().map(|profile| profile.at(time).position));
    }

    /// The profiles.
    pub(crate) fn profiles(&self) -> &[Profile] {
        &self.profiles
    }

    /// True if the references of its samples are those of a loop of this timing.
    pub(super) fn is_for(&self, timing: &Loop) -> bool {
        (self.timing.every, self.timing.lead) == (timing.every, timing.lead)
    }

    /// References at sample `k`, if they are known.
    pub(super) fn references(&self, k: u64) -> Option<References> {
        let slides = self.profiles.len();
        let begin = usize::try_from(k).ok()?.checked_mul(slides)?;
        let known = self.samples.get(begin..begin + slides)?;
        let mut references = [[Reference::default(); SLIDES]; 2];
        for (slide, [now, later]) in known.iter().enumerate().take(SLIDES) {
            (references[0][slide], references[1][slide]) = (*now, *later);
        }
        Some(references)
    }

    /// Position of a slide's reference at the decision of this number and time, s.
    pub(super) fn position(&self, decision: usize, time: f64, slide: usize) -> f64 {
        match self.times.get(decision) {
            Some(known) if *known == time => self.positions[decision * self.profiles.len() + slide],
            _ => self.profiles[slide].at(time).position,
        }
    }
}

/// References of all slides at `time`, s, and one `lead` later, s.
pub(super) fn references(profiles: &[Profile], time: f64, lead: f64) -> References {
    let at = |time: f64| {
        let mut slides = [Reference::default(); SLIDES];
        slides.iter_mut().zip(profiles).for_each(|(slide, profile)| *slide = profile.at(time));
        slides
    };
    let now = at(time);
    [now, if lead == 0.0 { now } else { at(time + lead) }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::profile::{Leg, Limits};

    /// Known references are those of the profiles to the last bit, at samples and at delayed commands; others are
    /// computed: after the end, and at other times.
    #[test]
    fn known_references_are_those_of_the_profiles() {
        let limits = Limits { speed: 0.3, acceleration: 5.0, jerk: Some(300.0), snap: Some(4e4) };
        let legs = [Leg::To(vec![0.02, -0.01], limits), Leg::To(vec![0.0, 0.0], limits)];
        let profiles = Profile::along(&[0.0, 0.0], &legs).unwrap();
        for (delay, lead) in [(0.0, 0.0), (0.4e-3, 0.9e-3), (2e-3, 0.0)] {
            let timing = Loop { every: 1e-3, delay, limit: None, lead };
            let path = SampledPath::new(profiles.clone(), timing, 0.25);
            let clock = Interval::new(timing.every);
            let rest = timing.samples_late().1;
            let mut decisions = 0;
            for k in 0..=250 {
                let time = clock.times(k);
                assert_eq!(path.references(k), Some(references(&profiles, time, lead)), "{k}");
                for time in [Some(time), Some(time + rest).filter(|_| rest > 0.0)].into_iter().flatten() {
                    for (slide, profile) in profiles.iter().enumerate() {
                        assert_eq!(path.position(decisions, time, slide), profile.at(time).position, "{time}");
                        assert_eq!(path.position(decisions, 0.1234, slide), profile.at(0.1234).position);
                    }
                    decisions += 1;
                }
            }
            assert_eq!(path.times.len(), decisions);
            assert_eq!(path.references(251), None);
            assert_eq!(path.position(decisions, 0.251, 1), profiles[1].at(0.251).position);
            assert!(path.is_for(&Loop { limit: Some(1.0), ..timing }));
            assert!(!path.is_for(&Loop { lead: lead + 1e-4, ..timing }));
        }
    }
}
