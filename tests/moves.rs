//! The figures of moves in closed loop, against dense quadratures, and whatever their rows.

use crate::common::chance::Chance;
use taut::case::{Case, Move};
use taut::control::{Accuracy, Loop, MoveRun, Rows, Standard, each, stream};
use taut::solve::{Ending, Flow, PositionError, Solver};
use taut::trajectory::Trajectory;

/// A move of a controller's case with a row every `every`, and these rows.
fn moved(case: &Case, motion: &Move, every: f64) -> (MoveRun, Trajectory) {
    let design = case.controller.as_ref().unwrap();
    let mut controllers = Standard::of_drives(design, &case.machine).unwrap();
    let profiles = motion.references(design);
    let rows = Rows { until: motion.until, every, window: motion.window };
    let mut trajectory = Trajectory::default();
    let solver = Solver::for_machine(&case.machine);
    let (controllers, timing) = (&mut each(&mut controllers), Loop::new(design));
    let run = stream(&case.machine, controllers, &timing, &profiles, &rows, solver, false, &mut |block| {
        trajectory.append(block);
        Flow::Continue
    })
    .unwrap();
    assert_eq!(run.outcome.ending, Ending::Complete);
    (run, trajectory)
}

fn case(name: &str, changes: &[&str]) -> Case {
    let file = format!("{}/stages/sollmann-jouaneh/controllers/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Case::read_with(file, changes).unwrap_or_else(|error| panic!("{error}"))
}

fn near(name: &str, a: f64, b: f64, share: f64) {
    assert!((a - b).abs() <= share * b.abs() + 1e-15, "{name}: {a} and {b}, {:e}", (a - b) / b);
}

/// ∫ by Simpson's rule over pairs of rows; no jump falls within a pair.
fn simpson(h: f64, values: &[[f64; 2]]) -> f64 {
    values.chunks_exact(2).map(|pair| h / 3.0 * (pair[0][0] + 4.0 * pair[1][0] + pair[1][1])).sum()
}

/// Energy of a move was a sum over rows, one too many: 10 mJ for 9.01; errors and currents were means over rows, with
/// whatever the last sample did.
#[test]
fn integrals_are_those_of_a_dense_quadrature() {
    for (name, limit) in [("pid-elastic", None), ("cascade", None), ("pid", Some("limit"))] {
        let changes: &[&str] = if limit.is_some() { &["controller.limit=5 V"] } else { &[] };
        let case = case(name, changes);
        let (motor, motion) = (case.machine.drives[0].motor, &case.moves[0]);
        let h = 1e-5;
        let (run, rows) = moved(&case, motion, h);
        let get = |name: &str| rows.get(name).unwrap();
        let [voltage, speed, cart, error, drive, reference] =
            ["voltage", "drive_speed", "cart_position", "cart_error", "drive_angle", "reference"].map(get);
        // On an interval the voltage is held, and the current follows the speed: i = (v − K_e n φ̇)/R, which is also
        // just before the voltage jumps.
        let current = |k: usize, at: usize| {
            (voltage[k] - motor.back_emf_constant * motor.gear_ratio * speed[at]) / motor.resistance
        };
        let n = rows.len() - 1;
        let both =
            |of: &dyn Fn(usize, usize) -> f64| -> Vec<[f64; 2]> { (0..n).map(|k| [of(k, k), of(k, k + 1)]).collect() };
        let power = both(&|k, at| voltage[k] * current(k, at));
        let net = simpson(h, &power);
        let figures = &run.figures;
        near("net energy", figures.drive().energy.0 - figures.drive().energy.1, net, 1e-8);
        let back: f64 = power.iter().map(|[a, b]| h * 0.5 * ((-a).max(0.0) + (-b).max(0.0))).sum();
        near("energy back", figures.drive().energy.1, back, 1e-3);
        let rms =
            |of: &dyn Fn(usize, usize) -> f64| (simpson(h, &both(&|k, at| of(k, at).powi(2))) / motion.until).sqrt();
        near("rms voltage", figures.drive().voltage.1, rms(&|k, _| voltage[k]), 1e-8);
        near("rms current", figures.drive().current.1, rms(&current), 1e-8);
        near("rms error", figures.cart().error.rms, rms(&|_, at| error[at]), 1e-7);
        let r = case.machine.pulley_radius;
        near("rms following", figures.drive().following.rms, rms(&|_, at| r * drive[at] - reference[at]), 1e-7);

        // Peaks: no row passes them, and the nearest comes close.
        let most = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let currents: Vec<f64> = (0..n).flat_map(|k| [current(k, k), current(k, k + 1)]).collect();
        for (name, peak, rows) in [
            ("error", figures.cart().error.peak.value, most(error)),
            ("voltage", figures.drive().voltage.0.value, most(voltage)),
            ("current", figures.drive().current.0.value, most(&currents)),
        ] {
            assert!(rows <= peak.abs() * (1.0 + 1e-9) && peak.abs() <= rows * (1.0 + 1e-3), "{name}: {peak} {rows}");
        }
        for (span, seen) in ["span1_force", "span2_force", "span3_force"].into_iter().zip(&figures.spans) {
            let force = get(span);
            let (least, most) =
                force.iter().fold((0.0, 0.0), |(least, most): (f64, f64), f| (least.min(*f), most.max(*f)));
            for (name, peak, rows) in [("least", -seen[0].value, -least), ("greatest", seen[1].value, most)] {
                let near = 1e-3 * (most - least);
                assert!(rows <= peak * (1.0 + 1e-9) && peak <= rows + near, "{name} of {span}: {peak} {rows}");
            }
        }
        let beyond = cart.iter().map(|x| x - motion.profile().target()).fold(0.0, f64::max);
        assert!(
            beyond <= figures.cart().overshoot + 1e-12 && figures.cart().overshoot <= beyond + 1e-9,
            "{beyond} {figures:?}"
        );
        let last = cart
            .iter()
            .zip(get("time"))
            .filter(|(x, t)| **t >= motion.profile().end() && (**x - motion.profile().target()).abs() > motion.window);
        let last = last.map(|(_, t)| *t).next_back();
        match figures.settling {
            Some(settling) => {
                let settled = last.map_or(0.0, |t| t - motion.profile().end());
                assert!(settling >= settled - 1e-12 && settling <= settled + 1.001 * h, "{settling} {settled}");
            }
            None => assert_eq!(last, Some(motion.until)),
        }
        // Samples at the limit, each held for its time.
        assert_eq!(run.samples.1 > 0, limit.is_some());
        near("limited", figures.drive().limited, run.samples.1 as f64 * 1e-3, 1e-12);
    }
}

/// Figures of moves were made of rows.
#[test]
fn figures_do_not_depend_on_the_rows() {
    for (name, changes) in [
        ("pid-elastic", &["amplifier.voltage_limit=4 V"][..]),
        // It howls: the belt's resonance is driven through motor and delay.
        ("pid", &["controller.pid.derivative=16 V s/m"][..]),
        ("cascade-current", &[][..]),
        ("pid-shaped", &["motor.inductance=0.5 mH", "amplifier.current_limit=6 A"][..]),
    ] {
        let case = case(name, changes);
        for motion in &case.moves[..1] {
            let [one, fine, odd] = [1e-3, 1e-4, 0.37e-3].map(|every| moved(&case, motion, every).0);
            for other in [&fine, &odd] {
                let (a, b) = (&one.figures, &other.figures);
                for (what, a, b) in [
                    ("error", a.cart().error.peak.value, b.cart().error.peak.value),
                    ("rms error", a.cart().error.rms, b.cart().error.rms),
                    ("following", a.drive().following.peak.value, b.drive().following.peak.value),
                    ("voltage", a.drive().voltage.0.value, b.drive().voltage.0.value),
                    ("rms voltage", a.drive().voltage.1, b.drive().voltage.1),
                    ("current", a.drive().current.0.value, b.drive().current.0.value),
                    ("rms current", a.drive().current.1, b.drive().current.1),
                    ("energy in", a.drive().energy.0, b.drive().energy.0),
                    ("energy back", a.drive().energy.1, b.drive().energy.1),
                    ("overshoot", a.cart().overshoot, b.cart().overshoot),
                    ("settling", a.settling.unwrap_or(0.0), b.settling.unwrap_or(0.0)),
                    ("restlessness", a.drive().restlessness, b.drive().restlessness),
                    ("amplifier", a.drive().amplifier_limited, b.drive().amplifier_limited),
                    ("force", one.metrics.spans[0].peak_force.value, other.metrics.spans[0].peak_force.value),
                ] {
                    assert!((a.abs() - b.abs()).abs() <= 1e-6 * a.abs() + 1e-12, "{name} {what}: {a} {b}");
                }
                for (a, b) in a.spans.iter().flatten().zip(b.spans.iter().flatten()) {
                    assert!((a.value - b.value).abs() <= 1e-9 * a.value.abs(), "{name} span: {a:?} {b:?}");
                }
            }
        }
    }
}

/// The time that the amplifier stands at its limit was that of rows, one too many.
#[test]
fn the_amplifier_is_saturated_for_as_long_as_it_is() {
    let case = case("pid-elastic", &["amplifier.voltage_limit=4 V"]);
    let h = 2e-6;
    let (run, rows) = moved(&case, &case.moves[0], h);
    let voltage = rows.get("voltage").unwrap();
    let at_limit = voltage[..voltage.len() - 1].iter().filter(|v| v.abs() >= 4.0 * (1.0 - 1e-12)).count();
    let switches = run.outcome.events.iter().filter(|event| event.part.key() == "voltage").count();
    assert!(at_limit > 1000, "{at_limit}");
    assert!(
        (run.figures.drive().amplifier_limited - at_limit as f64 * h).abs() <= (switches + 1) as f64 * h,
        "{:?}",
        run.figures
    );
}

/// Whoever is outside the window when the run ends has not settled, however near the last instant the end is.
#[test]
fn a_cart_outside_its_window_at_the_end_has_not_settled() {
    let case = case("cascade", &[]);
    let motion = case.moves.iter().find(|motion| motion.name == "slow reversal").unwrap();
    let (run, rows) = moved(&case, motion, 1e-3);
    let last = rows.get("cart_error").unwrap().last().unwrap().abs();
    assert!(last > motion.window, "{last}");
    assert_eq!(run.figures.settling, None);
    // With a window that the end is just inside of it has, at the last crossing.
    let wider = Move { window: last * 1.001, ..motion.clone() };
    assert!(moved(&case, &wider, 1e-3).0.figures.settling.is_some());
}

/// A move with a row every millisecond by this solver: the positions of its cart, and what it states of them.
fn stated(case: &Case, solver: Solver) -> (Vec<f64>, PositionError) {
    let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    let (machine, profiles, timing) = (&case.machine, motion.references(design), Loop::new(design));
    let rows = Rows { until: motion.until, every: 1e-3, window: motion.window };
    let mut own = Standard::of_drives(design, machine).unwrap();
    let controllers = &mut each(&mut own);
    let mut accuracy = Accuracy::new(machine, &timing, &profiles, &rows, solver);
    let mut cart = Vec::new();
    let run = stream(machine, controllers, &timing, &profiles, &rows, solver, false, &mut |block| {
        cart.extend_from_slice(block.get("cart_position").unwrap());
        accuracy.take(block);
        Flow::Continue
    })
    .unwrap();
    assert!(run.outcome.error.is_none(), "a bound for given inputs is none in closed loop");
    (cart, accuracy.finish(&run, controllers, &mut || Flow::Continue).unwrap().unwrap())
}

/// Positions of a move are off by no more than it states, by both solvers, and where a tolerance is coarse: against a
/// run at the finest tolerance. No move stated anything.
#[test]
fn a_move_states_by_how_much_it_may_be_off() {
    let curve = "cart.friction.stribeck={ force = \"0.3 N\", velocity = \"5 mm/s\" }";
    for (name, changes) in
        [("pid", vec![]), ("cascade", vec![]), ("lqg", vec![]), ("pid", vec![curve]), ("cascade", vec![curve])]
    {
        let case = case(name, &changes);
        let (best, _) = stated(&case, Solver::General { tolerance: 1e-13 });
        let mut solvers = [1e-6, 1e-9].map(|tolerance| Solver::General { tolerance }).to_vec();
        solvers.extend(changes.is_empty().then_some(Solver::Exact));
        for solver in solvers {
            let (cart, error) = stated(&case, solver);
            let off = cart.iter().zip(&best).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{name} {changes:?} {solver:?}: off by {off:.1e} m, {:.1e} m stated", error.value);
            assert!(off <= error.value + 1e-12, "{name} {changes:?} {solver:?}: {off:e} m, {error:?}");
            assert!(error.way > 0.01 && error.value < 1e-3 * error.way, "{name} {changes:?} {solver:?}: {error:?}");
        }
    }
}

/// An axis with play in its gear, flanks without damping and an encoder at the motor.
const RATTLING: &str = r#"
[motor]
torque_constant = 0.05
back_emf_constant = 0.05
resistance = 1
rotor_inertia = 2.7e-6
gear_stiffness = 348
gear_efficiency = 0.83
backlash = 3e-3
[drive_pulley]
radius = 0.01
inertia = 1e-5
friction = { coulomb = 0.01 }
[idler_pulley]
inertia = 1e-5
[cart]
mass = 0.33
friction = { viscous = 5, coulomb = 0.47 }
[belt]
stiffness = [1e5, 1e5, 5e4]
damping = [20, 20, 10]
[encoder]
at = "motor"
lines = 256
[controller]
every = 0.5e-3
delay = 0.25e-3
limit = 24
cascade = { position = 40, speed = 30, speed_integral = 500 }
[[move]]
name = "there"
to = 0.04
speed = 0.3
acceleration = 3
until = 0.6
"#;

/// Flanks that rattle between counts of the encoder amplify rounding until the bound for given inputs is kilometres; the
/// cart is off by micrometres, but was called not determined.
#[test]
fn a_loop_that_rattles_states_by_how_much_its_cart_may_be_off() {
    let mut chance = Chance::new(7);
    let mut chaotic = 0;
    for _ in 0..12 {
        let changes = [
            ("motor.gear_efficiency", chance.scaled(0.7, 1.0)),
            ("motor.gear_stiffness", chance.scaled(50.0, 1000.0)),
            ("motor.rotor_inertia", chance.scaled(1e-6, 1e-5)),
            ("motor.backlash", chance.scaled(1e-3, 1e-2)),
            ("cart.mass", chance.scaled(0.3, 1.5)),
        ];
        let changes = changes.map(|(key, value)| format!("{key}={value:?}"));
        let changes = changes.each_ref().map(String::as_str);
        let case = Case::from_text_with("rattling.toml", RATTLING, &changes).unwrap();
        assert!(case.machine.rattles());
        let (cart, error) = stated(&case, Solver::Exact);
        chaotic += usize::from(error.value > 1e-6);
        assert!(!error.is_undetermined(), "{changes:?}: {error:?}");
        for of_mass in [4e-15, -4e-15, 1e-14] {
            let mut other = case.clone();
            other.machine.cart.mass *= 1.0 + of_mass;
            let (other, _) = stated(&other, Solver::Exact);
            let off = cart.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off <= error.value, "{changes:?}: {off:e} m, {error:?}");
        }
    }
    println!("{chaotic} of 12 amplify rounding");
    assert!(chaotic >= 3, "{chaotic}");
}

/// Rounding of an unstable loop grows as the loop does: its positions are not determined.
#[test]
fn a_loop_that_amplifies_rounding_says_so() {
    let wild = case(
        "pid",
        &[
            "controller.pid.proportional=200 V/mm",
            "controller.limit=\"1e9 V\"",
            "encoder={ at = \"motor\", lines = 1000000000 }",
        ],
    );
    let (_, error) = stated(&wild, Solver::Exact);
    assert!(!error.is_exact() && error.value > 1e-9, "{error:?}");
}
