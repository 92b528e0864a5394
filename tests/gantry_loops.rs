//! Loops with several drives: margins against matrices built from their definitions on dense grids, and against runs.

use nalgebra::{Complex, DMatrix};
use rand_pcg::Pcg64;
use std::f64::consts::PI;
use taut::case::Case;
use taut::chance::uniform;
use taut::control::feedback::Feedback;
use taut::control::{Controller, Loop, Observation, Standard, close};
use taut::linear::{Operation, System};
use taut::signal::profile::Reference;
use taut::solve::{Ending, Solver};
use taut::tune::{Break, Margins, Plant, breaks};

type Square = DMatrix<Complex<f64>>;

/// A gantry in closed loop without dry friction and counts, of any kind.
fn drawn(number: u64) -> Case {
    let mut random = Pcg64::new(71, u128::from(number));
    let mut between = |low: f64, high: f64| low * (high / low).powf(uniform(&mut random));
    let (kind, spans) = [("h-frame", 3), ("core-xy", 4), ("dual-belt", 6)][number as usize % 3];
    let stiffness: Vec<String> = (0..spans).map(|_| between(4e4, 2e5).to_string()).collect();
    let damping = vec![between(5.0, 60.0).to_string(); spans];
    let pid = format!(
        "pid={{ proportional = {}, integral = {}, derivative = {} }}",
        between(1e3, 2e4),
        between(1e3, 2e5),
        between(10.0, 100.0)
    );
    let cascade = format!(
        "cascade={{ position = {}, speed = {}, speed_integral = {}, current = {{ proportional = {}, integral = {} }} }}",
        between(5.0, 40.0),
        between(5.0, 60.0),
        between(1e-2, 1.0),
        between(0.2, 1.0),
        between(10.0, 300.0),
    );
    let turn = number as usize / 3 % 3;
    let structure = if turn == 2 { cascade } else { pid };
    let every = between(4e-4, 1.5e-3);
    let changes = [
        format!("belt.stiffness=[{}]", stiffness.join(", ")),
        format!("belt.damping=[{}]", damping.join(", ")),
        format!("bridge.mass={}", between(0.2, 2.0)),
        format!("cart.mass={}", between(0.1, 1.0)),
        format!("motor.inductance={}", between(2e-4, 2e-3)),
        "bridge.friction={ viscous = 12 }".into(),
        "cart.friction={ viscous = 8 }".into(),
        "drive_pulley.friction={ viscous = 0.0016 }".into(),
        "encoder.lines=1e12".into(),
        "amplifier={}".into(),
        format!("controller={{ every = {every}, delay = {}, {structure} }}", every * [0.0, 0.4, 1.0][turn]),
    ];
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(kind).join("square.toml");
    Case::read_with(path, &changes.each_ref().map(String::as_str)).unwrap_or_else(|error| panic!("{error}"))
}

/// The sampled machine from the exponential of its matrices: positions of the pulleys and currents, per command.
struct Sampled {
    phi: DMatrix<f64>,
    gamma: [DMatrix<f64>; 2],
    drives: usize,
    rows: DMatrix<f64>,
    t: f64,
}

impl Sampled {
    fn new(case: &Case) -> Self {
        let design = case.controller.as_ref().unwrap();
        let system = System::new(&case.machine, Operation::default()).unwrap();
        let (n, drives) = (system.a.nrows(), case.machine.drives.len());
        let held = |time: f64| {
            let mut whole = DMatrix::zeros(n + drives, n + drives);
            whole.view_mut((0, 0), (n, n)).copy_from(&(&system.a * time));
            whole.view_mut((0, n), (n, drives)).copy_from(&(&system.b * time));
            let done = whole.exp();
            (done.view((0, 0), (n, n)).into_owned(), done.view((0, n), (n, drives)).into_owned())
        };
        let late = design.delay;
        let ((early, first), (rest, second)) = (held(late), held(design.every - late));
        let find = |name: &str| system.outputs.iter().position(|output| output.name == name).unwrap();
        let names = match drives {
            2 => vec!["left_angle", "right_angle", "left_current", "right_current"],
            _ => {
                vec!["left_angle", "right_angle", "cart_pulley_angle", "left_current", "right_current", "cart_current"]
            }
        };
        let rows = DMatrix::from_fn(2 * drives, n, |row, column| {
            let length = if row < drives { case.machine.pulley_radius } else { 1.0 };
            length * system.c[(find(names[row]), column)]
        });
        Self { phi: &rest * early, gamma: [rest * first, second], drives, rows, t: design.every }
    }

    /// Positions and currents per command at ω.
    fn at(&self, omega: f64) -> [Square; 2] {
        let z = Complex::new(0.0, omega * self.t).exp();
        let n = self.phi.nrows();
        let whole = DMatrix::from_fn(n, n, |i, j| {
            let own = Complex::new(-self.phi[(i, j)], 0.0);
            if i == j { own + z } else { own }
        });
        let [old, new] = &self.gamma;
        let input = DMatrix::from_fn(n, self.drives, |i, j| old[(i, j)] / z + new[(i, j)]);
        let states = whole.lu().solve(&input).unwrap();
        let all = DMatrix::from_fn(2 * self.drives, n, |i, j| Complex::new(self.rows[(i, j)], 0.0)) * states;
        [0, self.drives].map(|row| Square::from_fn(self.drives, self.drives, |i, j| all[(row + i, j)]))
    }
}

/// S, T and the loop of each drive with the others closed, all by their definitions, broken there.
fn broken(
    at: Break,
    [position, current]: [Square; 2],
    feedback: &Feedback,
    omega: f64,
) -> (f64, f64, Vec<Complex<f64>>) {
    let terms = feedback.at(omega);
    let drives = position.nrows();
    let one = || Square::identity(drives, drives);
    let inverse = |a: Square| a.try_inverse().unwrap();
    let [by_position, by_current] = [terms.position / terms.own, terms.current / terms.own];
    let l = match at {
        Break::Command => position * by_position + current * by_current,
        // y = G u with the loop of the current closed about u
        Break::Position => position * inverse(one() + current * by_current) * by_position,
        Break::Current => current * inverse(one() + position * by_position) * by_current,
        Break::Scale => unreachable!("no gantry has a scale"),
    };
    let whole = one() + &l;
    let s = inverse(whole.clone());
    let size = |a: Square| a.singular_values()[0];
    // The loops of the other drives are closed: u_k = −(1 + L_kk)⁻¹ L_kj u_j
    let alone = |j: usize| {
        let closed = whole.clone().remove_row(j).remove_column(j);
        let from = l.column(j).into_owned().remove_row(j);
        let to = l.row(j).into_owned().remove_column(j);
        l[(j, j)] - (to * inverse(closed) * from)[(0, 0)]
    };
    (size(s.clone()), size(&l * s), (0..drives).map(alone).collect())
}

#[test]
fn margins_are_those_of_matrices_on_a_dense_grid() {
    let (mut stable, mut breaks_seen) = (0, 0);
    for number in 0..60 {
        let case = drawn(number);
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        let plant = Plant::new(&case.machine, Operation::default(), design, &feedback.corners()).unwrap();
        let margins = Margins::new(&plant, &feedback);
        if !margins.stable {
            continue;
        }
        stable += 1;
        let sampled = Sampled::new(&case);
        let most = PI / design.every;
        let mut grid: Vec<f64> = (1..4000).map(|k| most * 10f64.powf(-4.0 * (1.0 - f64::from(k) / 4000.0))).collect();
        grid.extend([margins.at, margins.complementary_at]);
        let (mut ms, mut mt, mut gain, mut phase) = (0.0_f64, 0.0_f64, f64::INFINITY, f64::INFINITY);
        for &at in breaks(&feedback) {
            breaks_seen += 1;
            let mut before: Option<Vec<Complex<f64>>> = None;
            for (k, &omega) in grid.iter().enumerate() {
                let (s, t, loops) = broken(at, sampled.at(omega), &feedback, omega);
                (ms, mt) = (ms.max(s), mt.max(t));
                for (was, is) in before.filter(|_| k < 3999).iter().flatten().zip(&loops) {
                    if was.im * is.im < 0.0 && was.re < 0.0 && is.re < 0.0 && (is - was).norm() < 0.3 * is.norm() {
                        // Where the straight line between them is real.
                        let share = was.im / (was.im - is.im);
                        let size = -(was.re + share * (is.re - was.re));
                        gain = if size < 1.0 { gain.min(1.0 / size) } else { gain };
                    }
                    if (was.norm() - 1.0) * (is.norm() - 1.0) < 0.0 {
                        phase = phase.min((-is).arg().abs()).min((-was).arg().abs());
                    }
                }
                before = Some(loops);
            }
        }
        let told = format!("{number}: {margins:?} {ms} {mt} {gain} {phase}");
        assert!((margins.sensitivity / ms - 1.0).abs() < 1e-6, "{told}");
        assert!((margins.complementary / mt - 1.0).abs() < 1e-6 || mt < 1.0 + 1e-3, "{told}");
        assert!(margins.gain < gain * 1.01 && (margins.gain > gain * 0.97 || gain > 30.0), "{told}");
        assert!((margins.phase - phase).abs() < 0.05, "{told}");
    }
    println!("{stable} stable loops of 60, {breaks_seen} breaks");
    assert!(stable >= 25 && breaks_seen > stable, "{stable}");
}

/// A controller whose command is taken for more than it is.
struct Louder {
    inner: Standard,
    gain: f64,
}

impl Controller for Louder {
    fn step(&mut self, seen: &Observation) -> f64 {
        self.gain * self.inner.step(seen)
    }

    fn forward(&mut self, slides: &[Reference]) -> f64 {
        self.inner.forward(slides)
    }

    fn limited(&mut self, given: f64) {
        self.inner.limited(given / self.gain);
    }

    fn reset(&mut self) {
        self.inner.reset();
    }
}

#[test]
fn a_drive_swings_beyond_its_gain_margin() {
    let mut seen = 0;
    for number in 0..36 {
        let case = drawn(number);
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        let plant = Plant::new(&case.machine, Operation::default(), design, &feedback.corners()).unwrap();
        let margins = Margins::new(&plant, &feedback);
        let drives = case.machine.drives.len();
        let calm = |gains: Vec<f64>| {
            let of_drive = |inner: Standard, gain: f64| Louder { inner, gain };
            let both = Standard::of_drives(design, &case.machine).unwrap();
            let mut louder: Vec<Louder> = both.into_iter().zip(gains).map(|(one, gain)| of_drive(one, gain)).collect();
            let mut each: Vec<&mut dyn Controller> = louder.iter_mut().map(|one| one as &mut dyn Controller).collect();
            let profiles = &case.moves[0].profiles;
            let timing = Loop::new(design);
            let run = close(&case.machine, &mut each, &timing, profiles, 12.0, 1e-4, Solver::Exact).unwrap();
            run.outcome.ending == Ending::Complete && run.figures.settling.is_some_and(|time| time < 9.0)
        };
        // Without poles that hardly die away a run tells whether the loop is stable.
        if margins.stable && (margins.sensitivity > 8.0 || !(1.15..20.0).contains(&margins.gain)) {
            continue;
        }
        assert_eq!(margins.stable, calm(vec![1.0; drives]), "{number}: {margins:?}");
        // Broken at a measurement, another gain grows; a loop of several drives has one for each.
        if margins.stable && margins.breaks.gain == Break::Command {
            let louder = |factor: f64| {
                let mut gains = vec![1.0; drives];
                gains[margins.breaks.gain_drive] = 1.0 + factor * (margins.gain - 1.0);
                gains
            };
            assert!(calm(louder(0.8)), "{number}: {margins:?}");
            assert!(!calm(louder(1.2)), "{number}: {margins:?}");
            seen += 1;
        }
    }
    println!("{seen} loops at their gain margin");
    assert!(seen >= 12, "{seen}");
}

/// The largest error of bridge or cart, m, in a smooth move of a gantry with this feed-forward.
fn largest_error(number: u64, structure: &str, feed_forward: &str) -> f64 {
    let mut random = Pcg64::new(73, u128::from(number));
    let mut between = |low: f64, high: f64| low * (high / low).powf(uniform(&mut random));
    let (kind, spans) = [("h-frame", 3), ("core-xy", 4), ("dual-belt", 6)][number as usize % 3];
    let stiffness: Vec<String> = (0..spans).map(|_| between(4e4, 2e5).to_string()).collect();
    let mut changes = vec![
        format!("belt.stiffness=[{}]", stiffness.join(", ")),
        format!("belt.damping={:?}", vec![0.0; spans]),
        format!("bridge.mass={}", between(0.2, 2.0)),
        format!("cart.mass={}", between(0.1, 1.0)),
        format!("bridge.friction={{ viscous = {} }}", between(1.0, 20.0)),
        format!("cart.friction={{ viscous = {} }}", between(1.0, 20.0)),
        format!("drive_pulley.friction={{ viscous = {} }}", between(1e-4, 2e-3)),
        format!("right_drive.motor.resistance={}", between(0.4, 1.0)),
        format!("motor.rotor_inertia={}", between(1e-6, 1e-5)),
        "encoder.lines=1e12".into(),
        "amplifier={}".into(),
        format!("controller={{ every = 2e-4, {structure}, feed_forward = {feed_forward} }}"),
        "move=[{ name = \"smooth\", points = [[0.04, 0.02], [0.01, 0.035]], speed = 0.3, acceleration = 5, jerk = 200, \
         snap = 20000, until = 0.8 }]"
            .into(),
    ];
    // A dual belt has no compliant gears.
    if number.is_multiple_of(2) && kind != "dual-belt" {
        changes.push(format!("motor.gear_stiffness={}", between(100.0, 1000.0)));
        changes.push("motor.gear_damping=0.05".into());
    }
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(kind).join("square.toml");
    let texts: Vec<&str> = changes.iter().map(String::as_str).collect();
    let case = Case::read_with(path, &texts).unwrap_or_else(|error| panic!("{error}"));
    let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    let mut all = Standard::of_drives(design, &case.machine).unwrap();
    let mut controllers: Vec<&mut dyn Controller> = all.iter_mut().map(|one| one as &mut dyn Controller).collect();
    let timing = Loop::new(design);
    let profiles = &motion.profiles;
    let run = close(&case.machine, &mut controllers, &timing, profiles, motion.until, motion.window, Solver::Exact);
    let run = run.unwrap();
    assert_eq!(run.outcome.ending, Ending::Complete, "{number}");
    run.figures.loads.iter().map(|load| load.error.peak.value.abs()).fold(0.0, f64::max)
}

/// Without dry friction, belt damping and counts a gantry with elastic feed-forward and compensated stretch errs by
/// what sampling leaves. The compliant gear of a rotor is compensated in position, not in the command.
#[test]
fn elastic_feed_forward_of_a_gantry_leaves_what_sampling_leaves() {
    let pid = "pid = { proportional = 2000, integral = 10000, derivative = 20 }";
    let elastic = "{ model = \"elastic\", compensate_stretch = true }";
    for number in 0..12 {
        let error = |feed_forward: &str| largest_error(number, pid, feed_forward);
        let rigid = error("{ model = \"rigid\" }");
        let compensated = error("{ model = \"rigid\", compensate_stretch = true }");
        let whole = error(elastic);
        let has_gear = number % 2 == 0 && number % 3 != 2;
        println!(
            "{number}: rigid {rigid:.2e} m, compensated {compensated:.2e} m, elastic {whole:.2e} m, gear {has_gear}"
        );
        assert!(compensated < 0.2 * rigid && whole < if has_gear { 0.2 } else { 2e-3 } * rigid, "{number}");
    }
}

#[test]
fn feed_forward_of_a_gantry_reaches_the_current_loop() {
    let cascade = "cascade = { position = 20, speed = 40, speed_integral = 0.05, \
                   current = { proportional = 0.2, integral = 300 } }";
    for number in [1, 5, 8, 9] {
        let error = |feed_forward: &str| largest_error(number, cascade, feed_forward);
        let none = error("{ model = \"none\" }");
        let elastic = error("{ model = \"elastic\", compensate_stretch = true }");
        println!("{number}: none {none:.2e} m, elastic {elastic:.2e} m");
        assert!(elastic < 0.1 * none, "{number}: {elastic} of {none}");
    }
}
