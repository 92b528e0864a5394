//! Learned moves: hidden machines drawn within the stated uncertainty make the errors that were predicted, or smaller
//! ones; where learning would not converge it is refused before.

use rand_pcg::Pcg64;
use std::path::Path;
use taut::case::Case;
use taut::chance::uniform;
use taut::control::fed::Fed;
use taut::control::{Added, Controller, Loop, Rows, Standard, stream};
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
fn repeated(case: &Case, truth: &Case, at: At, added: Option<&[Added]>) -> Trial {
    let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    let (geometry, r) = (truth.machine.geometry(), truth.machine.pulley_radius);
    let none = vec![Added { times: vec![0.0], values: vec![0.0] }; geometry.drives.len()];
    let controllers = Standard::of_every_drive(design, &case.machine).unwrap();
    let mut fed: Vec<Fed> =
        controllers.into_iter().zip(added.unwrap_or(&none)).map(|(own, added)| Fed::new(own, added)).collect();
    let mut each: Vec<&mut dyn Controller> = fed.iter_mut().map(|fed| fed as &mut dyn Controller).collect();
    let (timing, profiles) = (Loop::new(design), motion.references(design));
    let rows = Rows { until: motion.until, every: design.every, window: motion.window };
    let name = |body: usize| geometry.label(body).key;
    let columns: Vec<(String, f64)> = match at {
        At::Cart => geometry.slides.iter().map(|slide| (format!("{}_position", name(slide.body)), 1.0)).collect(),
        At::Encoder => geometry.drives.iter().map(|drive| (format!("{}_angle", name(drive.pulley)), r)).collect(),
    };
    let mut trial = Trial { time: Vec::new(), positions: vec![Vec::new(); columns.len()], at };
    let mut sink = |block: &taut::trajectory::Trajectory| {
        trial.time.extend_from_slice(block.get("time").unwrap());
        for ((name, arm), position) in columns.iter().zip(&mut trial.positions) {
            position.extend(block.get(name).unwrap().iter().map(|value| arm * value));
        }
        Flow::Continue
    };
    let solver = Solver::for_machine(&truth.machine);
    stream(&truth.machine, &mut each, &timing, &profiles, &rows, solver, false, &mut sink).unwrap();
    trial
}

/// Signals learned in successive repetitions.
fn learned(case: &Case, truth: &Case, at: At, repetitions: usize) -> Vec<Learned> {
    let mut all: Vec<Learned> = Vec::new();
    for _ in 0..repetitions {
        let added = all.last().map(Learned::added);
        let trial = repeated(case, truth, at, added.as_deref());
        all.push(learn(case, &case.moves[0], &trial, added.as_deref(), &|| false).unwrap());
    }
    all
}

/// A machine somewhere within the uncertainty that the case states.
fn hidden(case: &Case, seed: u64) -> Case {
    let mut random = Pcg64::new(6, u128::from(seed));
    let family = Family::new(case, &case.tune.clone().unwrap_or_default()).unwrap();
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
            let (told, is) = (pair[0].slides[0].predicted[0].nominal, pair[1].slides[0].now);
            assert!((is.rms / told.rms - 1.0).abs() < 0.02, "{at:?}: {told:?} {is:?}");
            assert!(pair[0].contraction <= CONTRACTION + 1e-12);
        }
        let [first, last] = [0, 2].map(|k| own[k].slides[0].now);
        assert!(last.rms < 0.2 * first.rms, "{at:?}: {first:?} {last:?}");
        for seed in 0..3 {
            let truth = hidden(&case, seed);
            let all = learned(&case, &truth, at, 4);
            for (k, one) in all.iter().enumerate().skip(1) {
                let (told, is) = (all[k - 1].slides[0].predicted[0].worst, one.slides[0].now);
                assert!(is.rms < 1.05 * told.rms, "{at:?} {seed} {k}: {told:?} {is:?}");
            }
            let [first, last] = [0, 3].map(|k| all[k].slides[0].now);
            assert!(last.rms < 0.5 * first.rms, "{at:?} {seed}: {first:?} {last:?}");
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
        let errors: Vec<f64> = all.iter().map(|one| one.slides[0].now.rms).collect();
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
            trial.positions[0].truncate(count);
        }
    };
    assert!(told(&cut(0)).contains("the log has no rows"));
    assert!(told(&cut(20)).contains("the log ends at"), "{}", told(&cut(20)));
    assert!(told(&|trial| trial.time.iter_mut().for_each(|t| *t += 1.0)).contains("the log begins 1 s after the move"));
    assert!(told(&|trial| trial.positions[0][3] = f64::NAN).contains("values that are no numbers"));
    let sparse = told(&|trial| {
        trial.time = trial.time.iter().copied().step_by(10).collect();
        trial.positions[0] = trial.positions[0].iter().copied().step_by(10).collect();
    });
    assert!(sparse.contains("the rows of the log are"), "{sparse}");
    let two = told(&|trial| trial.positions.push(Vec::new()));
    assert!(two.contains("the log has 2 columns of positions") && two.contains("1: one for each part"), "{two}");
    let signals = [Added::new(1e-3, vec![0.0]), Added::new(1e-3, vec![0.0])];
    let many = learn(&case, &case.moves[0], &whole, Some(&signals), &|| false).unwrap_err().to_string();
    assert!(many.contains("there are 2 signals that were added") && many.contains("1: one for each drive"), "{many}");
    let stopped = learn(&case, &case.moves[0], &whole, None, &|| true).unwrap_err().to_string();
    assert!(stopped.contains("interrupted"), "{stopped}");
}

/// A gantry in closed loop, whose friction is viscous alone and whose encoders are as good as exact.
fn gantry(file: &str, changes: &[&str]) -> Case {
    let linear = [
        "drive_pulley.friction.coulomb=0",
        "bridge.friction={ viscous = 12 }",
        "cart.friction={ viscous = 8 }",
        "encoder.lines=1000000",
        "controller.pid={ proportional = \"5 V/mm\", integral = \"20 V/(mm s)\", derivative = \"40 V s/m\" }",
    ];
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    let case = Case::from_text_with(&path, &text, &[&linear[..], changes].concat());
    case.unwrap_or_else(|error| panic!("{error}"))
}

const SQUARES: [&str; 3] = ["stages/h-frame/square.toml", "stages/core-xy/square.toml", "stages/dual-belt/square.toml"];

/// Bridge and cart of each kind make the errors that were predicted, and both converge.
#[test]
fn errors_of_gantries_are_as_predicted() {
    for (file, at) in SQUARES.into_iter().flat_map(|file| [(file, At::Cart), (file, At::Encoder)]) {
        let case = gantry(file, &["tune={ spread = \"10 %\" }"]);
        let own = learned(&case, &case, at, 3);
        for pair in own.windows(2) {
            for (told, is) in pair[0].slides.iter().zip(&pair[1].slides) {
                let (told, is) = (told.predicted[0].nominal, is.now);
                assert!((is.rms / told.rms - 1.0).abs() < 0.03, "{file} {at:?}: {told:?} {is:?}");
            }
            assert!(pair[0].contraction <= CONTRACTION + 1e-12);
        }
        for (slide, (first, last)) in own[0].slides.iter().zip(&own[2].slides).enumerate() {
            println!("{file} {at:?} {slide}: {:?} {:?}", first.now, last.now);
            assert!(last.now.rms < 0.4 * first.now.rms, "{file} {at:?}: {:?} {:?}", first.now, last.now);
        }
        let truth = hidden(&case, 1);
        let all = learned(&case, &truth, at, 3);
        for (k, one) in all.iter().enumerate().skip(1) {
            for (told, is) in all[k - 1].slides.iter().zip(&one.slides) {
                let (told, is) = (told.predicted[0].worst, is.now);
                assert!(is.rms < 1.1 * told.rms, "{file} {at:?} {k}: {told:?} {is:?}");
            }
        }
    }
}

/// Dry friction on all bodies of a CoreXY comes again with each repetition.
#[test]
fn dry_friction_of_a_gantry_is_learned() {
    let dry = ["bridge.friction={ viscous = 12, coulomb = 0.5 }", "cart.friction={ viscous = 8, coulomb = 0.2 }"];
    let case = gantry(
        SQUARES[1],
        &[&dry[..], &["drive_pulley.friction.coulomb=0.015", "tune={ spread = \"10 %\" }"]].concat(),
    );
    let all = learned(&case, &hidden(&case, 3), At::Cart, 5);
    for slide in 0..2 {
        let errors: Vec<f64> = all.iter().map(|one| one.slides[slide].now.rms).collect();
        println!("{slide}: {errors:?}");
        assert!(errors[4] < 0.3 * errors[0], "{slide}: {errors:?}");
    }
}

#[test]
fn what_a_gantry_cannot_learn_is_told() {
    let case = gantry(SQUARES[1], &["tune={ spread = \"0 %\" }"]);
    let whole = repeated(&case, &case, At::Cart, None);
    let told = |case: &Case, trial: &Trial| {
        learn(case, &case.moves[0], trial, None, &|| false).map(|found| found.band).unwrap_err().to_string()
    };
    let one = Trial { positions: vec![whole.positions[0].clone()], ..whole.clone() };
    assert!(told(&case, &one).contains("2: one for each part that slides"), "{}", told(&case, &one));
    let encoders = Trial { at: At::Encoder, positions: Vec::new(), ..whole.clone() };
    assert!(told(&case, &encoders).contains("2: one for the encoder of each drive"), "{}", told(&case, &encoders));
    let stiff = "controller.pid={ proportional = \"100 V/mm\", derivative = \"60 V s/m\" }";
    let unstable = told(&gantry(SQUARES[1], &["tune={ spread = \"0 %\" }", stiff]), &whole);
    assert!(unstable.contains("the loop is not stable"), "{unstable}");
}

/// A machine with steppers that interpolate, in the loop of its file or in open loop.
fn with_steppers(file: &str, changes: &[&str]) -> Case {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(file);
    let smooth = ["stepper.interpolate=true", "tune={ spread = 0.1 }"];
    Case::read_with(file, &[&smooth[..], changes].concat()).unwrap_or_else(|error| panic!("{error}"))
}

/// `move --added` took a signal of a stepper that `taut learn` refused to make. What is learned corrects the commanded
/// position, in open loop and in that of an encoder: the stretch of the belt and the lag of friction below the first
/// mode, as predicted. The ringing of a mode that is hardly damped is not learned.
#[test]
fn the_commanded_position_of_a_stepper_is_learned() {
    let motion = "move=[{ name = \"there\", to = 0.01, speed = 0.15, acceleration = 2, jerk = 60, until = 0.3 }]";
    let changes = ["cart.friction={ viscous = 8 }", "idler_pulley.friction={ viscous = 1e-5 }", motion];
    for (file, change) in [
        ("stepper-axis/stepper-axis.toml", "controller={ every = 1e-3 }"),
        ("stepper-axis/closed-loop.toml", "title=in loop"),
    ] {
        let case = with_steppers(file, &[&changes[..], &[change, "drive_pulley.friction={ viscous = 1e-4 }"]].concat());
        let all = learned(&case, &case, At::Cart, 3);
        let errors: Vec<f64> = all.iter().map(|one| one.slides[0].now.rms).collect();
        println!("{file}: {errors:?}, {:?}", all[0].slides[0].predicted[0].nominal);
        assert!(errors[2] < 0.6 * errors[0], "{file}: {errors:?}");
        for pair in all.windows(2) {
            let (told, is) = (pair[0].slides[0].predicted[0].nominal, pair[1].slides[0].now);
            assert!((is.rms - told.rms).abs() < 0.05 * told.rms + 2e-7, "{file}: {told:?} {is:?}");
        }
    }
}
