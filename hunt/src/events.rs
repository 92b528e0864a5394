//! States of bodies over time by two solvers: where they disagree, and whether it matters.
//!
//! Moments of events are as sharp as what happens there: a body that comes to rest with next to no force on it does so
//! at next to any time.
//! So events are compared by what lies between them. Where one solver has a body slide and the other has it stuck, or
//! slide the other
//! way, the body must go next to no way; and where the independent solver has it stuck, that must not last.

use crate::law::Motion;
use crate::machine::BODIES;
use crate::solve::Event;

/// How far apart two moments are that are one, as a part of the run.
const MOMENT: f64 = 1e-6;

/// A stretch of time on which the solvers have a body do different things.
#[derive(Debug, Clone, Copy)]
pub struct Disagreement {
    body: usize,
    from: f64,
    to: f64,
    ours: Motion,
    known: Motion,
}

impl Disagreement {
    /// The event in words.
    pub fn told(&self, names: &[&str]) -> String {
        let Self { body, from, to, ours, known } = self;
        format!("the {} is {ours:?} instead of {known:?} from {from:e} s to {to:e} s", names[*body])
    }

    /// True if it matters: a stuck body may be told to slide for `moment`, and `way` gives how far the independent
    /// solver has a body go
    /// between two moments, m, which may be `near`.
    pub fn matters(&self, moment: f64, near: f64, way: impl Fn(usize, f64, f64) -> f64) -> bool {
        if self.known == Motion::Stuck {
            return self.to - self.from > moment;
        }
        way(self.body, self.from, self.to) > near
    }

    /// Of which body.
    pub fn body(&self) -> usize {
        self.body
    }

    /// Both ends.
    pub fn moments(&self) -> [f64; 2] {
        [self.from, self.to]
    }
}

/// Where two lists of events disagree up to `end`.
pub fn disagreements(ours: &[Event], known: &[Event], end: f64) -> Vec<Disagreement> {
    let mut found: Vec<Disagreement> = Vec::new();
    for body in 0..BODIES {
        let of_body = |events: &[Event]| -> Vec<Event> {
            events.iter().filter(|event| event.body == body && event.time <= end).copied().collect()
        };
        let (ours, known) = (of_body(ours), of_body(known));
        // What a body that changes nothing does is what the other solver has it do first.
        let first = ours.first().or(known.first()).map(|event| event.from);
        let Some(first) = first else { continue };
        let at = |events: &[Event], time: f64| {
            let last = events.iter().rev().find(|event| event.time <= time);
            last.map_or(events.first().map_or(first, |event| event.from), |event| event.to)
        };
        let mut moments: Vec<f64> = ours.iter().chain(&known).map(|event| event.time).chain([0.0, end]).collect();
        moments.sort_by(f64::total_cmp);
        moments.dedup();
        for pair in moments.windows(2) {
            let (ours, known) = (at(&ours, pair[0]), at(&known, pair[0]));
            if ours != known {
                found.push(Disagreement { body, from: pair[0], to: pair[1], ours, known });
            }
        }
    }
    found
}

/// An event of a body that another one undoes at the very same instant, where the independent solver has none.
pub fn undone(ours: &[Event], known: &[Event], until: f64, names: &[&str]) -> Option<String> {
    let pair = ours.iter().enumerate().find_map(|(i, a)| {
        let b = ours[i + 1..].iter().find(|b| b.body == a.body)?;
        let alone = || !known.iter().any(|k| k.body == a.body && (k.time - a.time).abs() <= MOMENT * until);
        (a.time == b.time && a.from == b.to && alone()).then_some(a)
    });
    pair.map(|a| format!("the {} goes from {:?} to {:?} and back at {:e} s", names[a.body], a.from, a.to, a.time))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(time: f64, from: Motion, to: Motion) -> Event {
        Event { time, body: 1, from, to }
    }

    #[test]
    fn a_stop_that_comes_later_disagrees_in_between() {
        let known = [event(0.1, Motion::Stuck, Motion::Forward), event(0.5, Motion::Forward, Motion::Stuck)];
        let ours = [event(0.1, Motion::Stuck, Motion::Forward), event(0.7, Motion::Forward, Motion::Stuck)];
        let found = disagreements(&ours, &known, 1.0);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].moments(), [0.5, 0.7]);
        assert!(found[0].matters(1e-6, 1e-12, |_, _, _| 0.0));
        let found = disagreements(&known, &ours, 1.0);
        assert!(!found[0].matters(1e-6, 1e-12, |_, _, _| 1e-13) && found[0].matters(1e-6, 1e-12, |_, _, _| 1e-11));
        assert!(disagreements(&ours, &ours, 1.0).is_empty());
    }

    #[test]
    fn a_pair_of_events_at_one_instant_is_told() {
        let pair = [event(0.1, Motion::Stuck, Motion::Forward), event(0.1, Motion::Forward, Motion::Stuck)];
        assert!(undone(&pair, &[], 1.0, &["", "cart"]).is_some());
        assert!(undone(&pair, &[event(0.1, Motion::Stuck, Motion::Backward)], 1.0, &["", "cart"]).is_none());
    }
}
