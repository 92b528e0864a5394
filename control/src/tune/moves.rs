//! Moves for the judgement of a controller, and the current that they require.

use super::trouble::limit;
use crate::case::{Case, Move};
use crate::control::measures_cart;
use crate::design::{Design, FeedForward, FeedForwardModel};
use crate::error::Result;
use crate::machine::Machine;
use crate::machine::rigid::Rigid;
use crate::reach::compensation::Compensation;
use crate::reach::forward::Forward;
use crate::reach::quickest::within_pull_out;
use crate::signal::profile::{Leg, Limits, Profile, Reference};

/// Fractions of the speed and the force allowed by the command limit that a standard move uses.
const SPEED: f64 = 0.5;
const FORCE: f64 = 0.5;

/// Largest speed (m/s) and acceleration (m/s²) of standard moves, also without limits.
const MODEST: (f64, f64) = (0.2, 2.0);
const MOST: (f64, f64) = (5.0, 50.0);

/// Distance of the short move without a travel, m, and fractions of a travel.
const SHORT: f64 = 0.02;
const SHARES: [f64; 2] = [0.1, 0.7];

/// Half of the window of standard moves in encoder counts, and at least, m.
const COUNTS: f64 = 5.0;
const WINDOW: f64 = 50e-6;

/// The moves of a case, or a standard set: a short and a long move as quick as travel and limits allow, a slow
/// reversal, and for a machine with several coordinates the long move of each alone.
pub fn moves(case: &Case, design: &Design) -> Result<Vec<Move>> {
    if case.moves.is_empty() { standard(&case.machine, design) } else { Ok(case.moves.clone()) }
}

fn standard(machine: &Machine, design: &Design) -> Result<Vec<Move>> {
    let (speed, acceleration) = limits(machine, design);
    let (jerk, quick) = (60.0 * acceleration, 8000.0 * acceleration);
    let limits = Limits { speed, acceleration, jerk: Some(jerk), snap: Some(quick) };
    let slow = Limits { speed: 0.04 * speed, acceleration: 0.04 * acceleration, jerk: Some(0.04 * jerk), snap: None };
    // Start of each coordinate, and its short and long distance.
    let (from, distances): (Vec<f64>, Vec<[f64; 2]>) = machine
        .travels()
        .map(|(_, travel)| match travel {
            None => (0.0, [SHORT, 10.0 * SHORT]),
            Some(travel) => {
                let length = travel.max - travel.min;
                (travel.min + 0.1 * length, SHARES.map(|share| share * length))
            }
        })
        .unzip();
    let gone = |share: &dyn Fn(usize) -> f64| -> Vec<f64> {
        from.iter().enumerate().map(|(coordinate, from)| from + share(coordinate)).collect()
    };
    let to = |share: &dyn Fn(usize) -> f64, limits: Limits| Leg::To(gone(share), limits);
    let mut legs = vec![
        ("short".to_string(), vec![to(&|k| distances[k][0], limits)]),
        ("long".to_string(), vec![to(&|k| distances[k][1], limits)]),
        ("slow reversal".to_string(), vec![to(&|k| 0.25 * distances[k][0], slow), to(&|_| 0.0, slow)]),
    ];
    if from.len() > 1 {
        legs.extend(machine.travels().enumerate().map(|(at, (label, _))| {
            let leg = to(&|k| if k == at { distances[k][1] } else { 0.0 }, limits);
            (format!("long, {} alone", label.name), vec![leg])
        }));
    }
    let count = machine.encoder.map_or(0.0, |encoder| {
        let length = if measures_cart(machine) { 1.0 } else { machine.pulley_radius };
        length / encoder.counts_per_unit(machine.drives[0].motor.gear_ratio)
    });
    let one = |(name, legs): (String, Vec<Leg<Vec<f64>>>)| {
        let profiles = Profile::of_legs(&from, &legs)?;
        let end = Profile::last_end(&profiles);
        Ok(Move {
            name,
            until: (end + 0.3).max(1.3 * end),
            every: design.every,
            window: WINDOW.max(COUNTS * count),
            profiles,
            is_planned: false,
        })
    };
    legs.into_iter().map(one).collect()
}

/// Speed (m/s) and acceleration (m/s²) with a reserve below the limits of controller and amplifier.
fn limits(machine: &Machine, design: &Design) -> (f64, f64) {
    if machine.stepper().is_some() {
        // The limit of its command is one of the correction.
        let slides = 0..machine.geometry().slides.len();
        let of_slide = |slide| within_pull_out(machine, slide, 1.0 - FORCE);
        return (MODEST.0, slides.filter_map(of_slide).fold(MODEST.1, f64::min));
    }
    let rigid = Rigid::new(machine);
    let Some(limit) = limit(machine, design) else { return MODEST };
    let dry = rigid.coulomb[0];
    let push = |speed: f64| rigid.command(dry + rigid.viscous[0] * speed, 0.0, &Reference::steady(speed)).abs();
    // The command is linear in speed.
    let per_speed = push(1.0) - push(0.0);
    let speed = (SPEED * limit - push(0.0)) / per_speed.max(f64::MIN_POSITIVE);
    let speed = if speed > 0.0 { speed.min(MOST.0) } else { 0.1 * MODEST.0 };
    // A current loop may have a limit of its own.
    let held = design.bounds().current.map_or(f64::INFINITY, |amperes| amperes * rigid.force_per_ampere.abs());
    let speed = speed.min(((SPEED * held - dry) / rigid.viscous[0]).max(0.1 * MODEST.0));
    let most = (limit * rigid.force_per_command().abs()).min(held);
    let force = FORCE * (most - dry - rigid.viscous[0] * speed);
    let acceleration = (force / rigid.accelerated()).min(MOST.1);
    (speed, if acceleration > 0.0 { acceleration } else { 0.1 * MODEST.1 })
}

/// RMS current over the run that a move requires on the nominal machine, A; the largest of all motors.
pub fn asked(machine: &Machine, motion: &Move) -> f64 {
    let whole = FeedForward { model: FeedForwardModel::Rigid, ..FeedForward::NONE };
    let of_drive = |drive: usize| {
        let mean = match Forward::new(whole, machine, drive) {
            Some(forward) => mean_square(motion, |time| {
                let slides: Vec<Reference> = motion.profiles.iter().map(|profile| profile.at(time)).collect();
                forward.required(&slides).current
            }),
            None => {
                let compensation = Compensation::new(machine, &FeedForward::NONE);
                let force = |time: f64| compensation.needed(&motion.profile().at(time)).force[0];
                mean_square(motion, |time| force(time) / compensation.rigid.force_per_ampere)
            }
        };
        if mean > 0.0 && mean.is_finite() { mean.sqrt() } else { 1.0 }
    };
    (0..machine.drives.len()).map(of_drive).fold(0.0, f64::max)
}

/// Mean square over the run of a requirement of a move until its end.
fn mean_square(motion: &Move, value: impl Fn(f64) -> f64) -> f64 {
    let (count, end) = (1000, motion.end());
    let square = |k: i32| value(end * (f64::from(k) + 0.5) / f64::from(count)).powi(2);
    (0..count).map(square).sum::<f64>() / f64::from(count) * end / motion.until
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    #[test]
    fn a_move_takes_half_the_force_that_the_current_leaves_beyond_friction() {
        let file =
            format!("{}/../stages/sollmann-jouaneh/controllers/cascade-current.toml", env!("CARGO_MANIFEST_DIR"));
        for amperes in [2.0, 3.0, 6.0] {
            let change = format!("controller.cascade.current.limit=\"{amperes} A\"");
            let case = Case::read_with(&file, &[&change]).unwrap();
            let (speed, acceleration) = limits(&case.machine, case.controller.as_ref().unwrap());
            let rigid = Rigid::new(&case.machine);
            let friction = rigid.coulomb[0] + rigid.viscous[0] * speed;
            let left = amperes * rigid.force_per_ampere.abs() - friction;
            let used = rigid.accelerated() * acceleration / left;
            assert!((used - FORCE).abs() < 1e-9, "{amperes} A: {used} of {left} N");
        }
    }

    /// A pulley's encoder of c counts per turn has a count of 2πr/c, one at the cart its own length.
    #[test]
    fn the_window_of_a_move_is_five_counts_of_a_coarse_encoder() {
        let folder = format!("{}/../stages/sollmann-jouaneh/controllers", env!("CARGO_MANIFEST_DIR"));
        let window = |changes: &[&str]| {
            let case = Case::read_with(format!("{folder}/pid.toml"), changes).unwrap();
            let moves = standard(&case.machine, case.controller.as_ref().unwrap()).unwrap();
            assert!(moves.iter().all(|one| one.window == moves[0].window));
            (moves[0].window, case.machine.pulley_radius)
        };
        let (found, _) = window(&["encoder={ at = \"cart\", counts = 10000 }"]);
        assert!((found / 5e-4 - 1.0).abs() < 1e-9, "{found}");
        let (found, radius) = window(&["encoder={ at = \"drive_pulley\", counts = 100 }"]);
        assert!((found / (5.0 * 2.0 * std::f64::consts::PI * radius / 100.0) - 1.0).abs() < 1e-9, "{found}");
        let (found, _) = window(&["encoder={ at = \"cart\", counts = 1000000 }"]);
        assert_eq!(found, WINDOW);
    }
}
