//! Moves, controllers and closed loops.

mod common;

use common::random::{cases, decades};
use proptest::prelude::*;
use taut::signal::profile::{Leg, Limits, Profile, Reference, Stroke};

fn limits() -> impl Strategy<Value = Limits> {
    (
        decades(1e-3, 10.0),
        decades(1e-2, 100.0),
        prop::option::of(decades(0.1, 1e4)),
        prop::option::of(decades(1.0, 1e6)),
    )
        .prop_map(|(speed, acceleration, jerk, snap)| Limits {
            speed,
            acceleration,
            jerk,
            snap: snap.filter(|_| jerk.is_some()),
        })
}

fn values(r: &Reference) -> [f64; 5] {
    [r.position, r.speed, r.acceleration, r.jerk, r.snap]
}

proptest! {
    #![proptest_config(cases(400))]

    /// No limit is passed, the end is exact, and each derivative is that of the one before.
    #[test]
    fn strokes_keep_their_limits_and_end_where_they_should(distance in decades(1e-5, 10.0), back: bool, limits in limits()) {
        let distance = if back { -distance } else { distance };
        let stroke = Stroke::new(distance, &limits).unwrap();
        let (end, n) = (stroke.duration(), 1000);
        prop_assert_eq!(stroke.at(end), Reference::at(distance));
        prop_assert_eq!(stroke.at(0.0), Reference::default());
        let most = [f64::INFINITY, limits.speed, limits.acceleration, limits.jerk.unwrap_or(f64::INFINITY), limits.snap.unwrap_or(f64::INFINITY)];
        let order = 2 + usize::from(limits.jerk.is_some()) + usize::from(limits.snap.is_some());
        let mut integral = [0.0; 5];
        let mut before = values(&stroke.at(0.0));
        for k in 1..=n {
            let now = values(&stroke.at(end * k as f64 / n as f64));
            for j in 1..5 {
                prop_assert!(now[j].abs() <= most[j] * (1.0 + 1e-9), "{j} {now:?}");
                // Simpson's rule is exact up to the third power; where the derivative jumps within the step it is not.
                let middle = values(&stroke.at(end * (k as f64 - 0.5) / n as f64));
                let h = end / n as f64;
                integral[j] += h * (before[j] + 4.0 * middle[j] + now[j]) / 6.0;
                if j < order {
                    let jump = most.iter().skip(j + 1).copied().find(|m| m.is_finite()).unwrap_or(0.0);
                    let change = now[j - 1] - before[j - 1];
                    let simpson = h * (before[j] + 4.0 * middle[j] + now[j]) / 6.0;
                    prop_assert!((change - simpson).abs() <= jump * h * h + 1e-9 * most[j].min(1e9) * h + 1e-12 * distance.abs(), "{j} at {k}");
                }
            }
            before = now;
        }
        prop_assert!((integral[1] - distance).abs() <= 1e-3 * distance.abs());
    }

    /// A trapezoid takes the least time there is: D/v + v/a, or 2 √(D/a) where it never gets to its speed.
    #[test]
    fn trapezoids_are_the_quickest(distance in decades(1e-5, 10.0), speed in decades(1e-3, 10.0), acceleration in decades(1e-2, 100.0)) {
        let stroke = Stroke::new(distance, &Limits { speed, acceleration, jerk: None, snap: None }).unwrap();
        let reaches = distance >= speed * speed / acceleration;
        let least = if reaches { distance / speed + speed / acceleration } else { 2.0 * (distance / acceleration).sqrt() };
        prop_assert!((stroke.duration() - least).abs() <= 1e-12 * least, "{} {least}", stroke.duration());
    }

    /// Of third and fourth order something is always at its limit, and a looser limit never takes longer.
    #[test]
    fn higher_orders_use_their_limits(distance in decades(1e-5, 10.0), limits in limits()) {
        let stroke = Stroke::new(distance, &limits).unwrap();
        for tighter in [
            Limits { speed: limits.speed * 0.5, ..limits },
            Limits { acceleration: limits.acceleration * 0.5, ..limits },
            Limits { jerk: limits.jerk.map(|j| j * 0.5), ..limits },
            Limits { snap: limits.snap.map(|s| s * 0.5), ..limits },
        ] {
            prop_assert!(Stroke::new(distance, &tighter).unwrap().duration() >= stroke.duration() * (1.0 - 1e-12));
        }
        let most = [limits.speed, limits.acceleration, limits.jerk.unwrap_or(0.0), limits.snap.unwrap_or(0.0)];
        let last = most.iter().rposition(|m| *m > 0.0).unwrap();
        // The highest derivative begins at its limit.
        let first = values(&stroke.at(1e-9 * stroke.duration()));
        prop_assert!((first[last + 1] - most[last]).abs() <= 1e-9 * most[last], "{first:?} {most:?}");
    }
}

/// The seven segments of third order against their closed form (both speed and acceleration reached).
#[test]
fn a_move_of_third_order_takes_the_time_of_the_closed_form() {
    let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: Some(100.0), snap: None };
    let stroke = Stroke::new(1.0, &limits).unwrap();
    // D/v + v/a + a/j
    assert!((stroke.duration() - (2.0 + 0.1 + 0.05)).abs() < 1e-12);
    let fourth = Stroke::new(1.0, &Limits { snap: Some(1e4), ..limits }).unwrap();
    // and j/s more
    assert!((fourth.duration() - (2.0 + 0.1 + 0.05 + 0.01)).abs() < 1e-12);
}

#[test]
fn a_chain_of_moves_goes_where_it_is_told() {
    let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
    let profile = Profile::new(0.1, &[Leg::To(0.3, limits), Leg::Wait(0.2), Leg::To(-0.1, limits)]).unwrap();
    assert_eq!(profile.at(0.0), Reference::at(0.1));
    assert_eq!(profile.at(0.6), Reference::at(0.3));
    assert!((profile.end() - (0.5 + 0.2 + 0.9)).abs() < 1e-12);
    assert_eq!(profile.at(2.0), Reference::at(-0.1));
    let shaped = profile.clone().shaped(&[[0.0, 0.5], [0.1, 0.5]]);
    assert!((shaped.at(1.7 + 1e-9).position + 0.1).abs() < 1e-15);
    let halfway = 0.5 * (profile.at(0.4).position + profile.at(0.3).position);
    assert!((shaped.at(0.4).position - halfway).abs() < 1e-15);
}
