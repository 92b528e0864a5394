//! Learned moves: hidden machines drawn within the stated uncertainty make the errors that were predicted, or smaller
//! ones; where learning would not converge it is refused before.

use rand_pcg::Pcg64;
use std::path::Path;
use taut::case::Case;
use taut::chance::uniform;
use taut::control::fed::Fed;
use taut::control::{Added, Loop, Rows, Standard, stream};
use taut::learning::{At, CONTRACTION, Learned, Trial, learn};
use taut::solve::{Flow, Solver};
use taut::tune::{Corner, Family};

fn case(changes: &[&str]) -> Case {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/sollmann-jouaneh/controllers/pid-shaped.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    Case::from_text_with(&file, &text, changes).unwrap_or_else(|error| panic!("{error}"))
}

/// An axis whose friction is viscous alone, with an encoder that is as good as exact.
const LINEAR: [&str; 4] = [
    "cart.friction.coulomb=0",
    "drive_pulley.friction.coulomb=0",
    "idler_pulley.friction.coulomb=0",
    "encoder.lines=1000000",
];

/// A repetition of the first move on the machine of `truth` with the controller of `case`.
fn repeated(case: &Case, truth: &Case, at: At, added: Option<&Added>) -> Trial {
    let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    let none = Added { times: vec![0.0], values: vec![0.0] };
    let mut fed = Fed::new(Standard::new(design, &case.machine).unwrap(), added.unwrap_or(&none));
    let (timing, profiles) = (Loop::of(design), motion.references(design));
    let rows = Rows { until: motion.until, every: design.every, window: motion.window };
    let mut trial = Trial { time: Vec::new(), position: Vec::new(), at };
    let mut sink = |block: &taut::trajectory::Trajectory| {
        trial.time.extend_from_slice(block.get("time").unwrap());
        let (name, arm) = match at {
            At::Cart => ("cart_position", 1.0),
            At::Encoder => ("drive_angle", truth.machine.pulley_radius),
        };
        trial.position.extend(block.get(name).unwrap().iter().map(|value| arm * value));
        Flow::Continue
    };
    let solver = Solver::of(&truth.machine);
    stream(&truth.machine, &mut [&mut fed], &timing, &profiles, &rows, solver, false, &mut sink).unwrap();
    trial
}

/// Signals learned in successive repetitions.
fn learned(case: &Case, truth: &Case, at: At, repetitions: usize) -> Vec<Learned> {
    let mut all: Vec<Learned> = Vec::new();
    for _ in 0..repetitions {
        let added = all.last().map(Learned::added);
        let trial = repeated(case, truth, at, added.as_ref());
        all.push(learn(case, &case.moves[0], &trial, added.as_ref(), &|| false).unwrap());
    }
    all
}

/// A machine somewhere within the uncertainty that the case states.
fn hidden(case: &Case, seed: u64) -> Case {
    let mut random = Pcg64::new(6, u128::from(seed));
    let family = Family::of(case, &case.tune.clone().unwrap_or_default()).unwrap();
    let nominal = family.nominal();
    let mut off = vec![0.0; family.unknowns.len()];
    // What varies by itself, with all that varies with it, is at its upper end in every second of these.
    for end in family.ends().iter().skip(1).step_by(2) {
        let share = 1.8 * uniform(&mut random) - 0.9;
        off.iter_mut().zip(&end.off).for_each(|(off, end)| *off += share * end);
    }
    Case { machine: family.stage_at(&Corner { off, ..nominal }), ..case.clone() }
}

/// On a linear machine the error of each repetition is the one that was predicted: on the machine of the file as it is
/// said, on another of the family not larger than the worst.
#[test]
fn errors_are_as_predicted() {
    let case = case(&[&LINEAR[..], &["tune.spread=15 %"]].concat());
    for at in [At::Cart, At::Encoder] {
        let own = learned(&case, &case, at, 3);
        for pair in own.windows(2) {
            let (told, is) = (pair[0].predicted[0].nominal, pair[1].now);
            assert!((is.rms / told.rms - 1.0).abs() < 0.02, "{at:?}: {told:?} {is:?}");
            assert!(pair[0].contraction <= CONTRACTION + 1e-12);
        }
        assert!(own[2].now.rms < 0.2 * own[0].now.rms, "{at:?}: {:?} {:?}", own[0].now, own[2].now);
        for seed in 0..3 {
            let truth = hidden(&case, seed);
            let all = learned(&case, &truth, at, 4);
            for (k, one) in all.iter().enumerate().skip(1) {
                let told = all[k - 1].predicted[0].worst;
                assert!(one.now.rms < 1.05 * told.rms, "{at:?} {seed} {k}: {told:?} {:?}", one.now);
            }
            assert!(all[3].now.rms < 0.5 * all[0].now.rms, "{at:?} {seed}: {:?} {:?}", all[0].now, all[3].now);
        }
    }
}

/// Dry friction comes again with each repetition: most of its error is learned, too.
#[test]
fn dry_friction_is_learned() {
    let case = case(&["tune.spread=15 %"]);
    for seed in 0..3 {
        let truth = hidden(&case, seed);
        let all = learned(&case, &truth, At::Cart, 5);
        let errors: Vec<f64> = all.iter().map(|one| one.now.rms).collect();
        println!("{seed}: {errors:?}");
        assert!(errors[4] < 0.2 * errors[0], "{seed}: {errors:?}");
    }
}

/// A family on which the response may be almost anything is refused, and so is a loop that is not stable.
#[test]
fn what_would_not_converge_is_refused() {
    let told = |changes: &[&str]| {
        let case = case(changes);
        let trial = repeated(&case, &case, At::Cart, None);
        learn(&case, &case.moves[0], &trial, None, &|| false).map(|found| found.band).unwrap_err().to_string()
    };
    let unstable = told(&[&LINEAR[..], &["tune.spread=0", "controller.pid.proportional=300 V/mm"]].concat());
    assert!(unstable.contains("the loop is not stable on an axis of the family"), "{unstable}");
    let spread = told(&["tune.spread=95 %"]);
    assert!(spread.contains("learning would not") || spread.contains("not stable"), "{spread}");
}

#[test]
fn logs_that_are_no_trial_are_told() {
    let case = case(&["tune.spread=0"]);
    let whole = repeated(&case, &case, At::Cart, None);
    let told = |change: &dyn Fn(&mut Trial)| {
        let mut trial = whole.clone();
        change(&mut trial);
        learn(&case, &case.moves[0], &trial, None, &|| false).unwrap_err().to_string()
    };
    let cut = |count: usize| {
        move |trial: &mut Trial| {
            trial.time.truncate(count);
            trial.position.truncate(count);
        }
    };
    assert!(told(&cut(0)).contains("the log has no rows"));
    assert!(told(&cut(20)).contains("the log ends at"), "{}", told(&cut(20)));
    assert!(told(&|trial| trial.time.iter_mut().for_each(|t| *t += 1.0)).contains("the log begins 1 s after the move"));
    assert!(told(&|trial| trial.position[3] = f64::NAN).contains("values that are no numbers"));
    let sparse = told(&|trial| {
        trial.time = trial.time.iter().copied().step_by(10).collect();
        trial.position = trial.position.iter().copied().step_by(10).collect();
    });
    assert!(sparse.contains("the rows of the log are"), "{sparse}");
    let stopped = learn(&case, &case.moves[0], &whole, None, &|| true).unwrap_err().to_string();
    assert!(stopped.contains("interrupted"), "{stopped}");
}
