//! Moves, controllers and closed loops.

use crate::common;
use common::random::{cases, decades};
use nalgebra::DMatrix;
use proptest::prelude::*;
use serde_json::Value;
use taut::case::Case;
use taut::control::{Loop, Rows, Setup, Standard, closed_loop, riccati, sliding, spread, stream};
use taut::design::*;
use taut::machine::rigid::Rigid;
use taut::machine::{Encoder, EncoderPlace, Machine};
use taut::reach::compensation::Compensation;
use taut::signal::profile::{Leg, Limits, Profile, Reference, Stroke};
use taut::solve::{Ending, Flow, Solver};

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

fn read(name: &str) -> Value {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/authorities").join(name);
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn design(structure: Structure) -> Design {
    Design {
        every: 1e-3,
        delay: 0.0,
        limit: Some(24.0),
        structure,
        feed_forward: FeedForward::NONE,
        disturbance_observer: None,
        filters: Vec::new(),
        shaper: Vec::new(),
    }
}

/// Positions within 1e-9 m of an independent simulation of the same loops (`authorities/closed_loop.py`).
#[test]
fn closed_loops_agree_with_the_authority() {
    let mut worst: f64 = 0.0;
    for case in read("closed_loop.json").as_array().unwrap() {
        let get = |key: &str| case[key].as_f64().unwrap();
        let gain = |key: &str| case["controller"][key].as_f64().unwrap();
        let structure = match case["kind"].as_str().unwrap() {
            "pid" => Structure::Pid(Pid {
                proportional: gain("proportional"),
                integral: gain("integral"),
                derivative: gain("derivative"),
                filter: gain("filter"),
                reference_speed: 1.0,
                tracking: gain("tracking"),
            }),
            _ => Structure::Cascade(Cascade {
                position: gain("position"),
                speed: gain("speed"),
                speed_integral: gain("speed_integral"),
                filter: gain("filter"),
                reference_speed: 1.0,
                tracking: gain("tracking"),
                current: None,
            }),
        };
        let mut machine = common::table4();
        let at_cart = case["at"] == "cart";
        machine.encoder = match get("counts_per_turn") {
            _ if at_cart => Some(Encoder { at: EncoderPlace::Cart, lines: 1e12 }),
            0.0 => None,
            counts => Some(Encoder { at: EncoderPlace::DrivePulley, lines: counts / 4.0 }),
        };
        let forward = case["feed_forward"] == true;
        let model = if forward { FeedForwardModel::Rigid } else { FeedForwardModel::None };
        let design = Design {
            delay: get("delay"),
            limit: Some(get("limit")),
            feed_forward: FeedForward { model, ..FeedForward::NONE },
            ..design(structure)
        };
        let [distance, speed, acceleration] = [0, 1, 2].map(|i| case["move"][i].as_f64().unwrap());
        let limits = Limits { speed, acceleration, jerk: None, snap: None };
        let profile = Profile::new(0.0, &[Leg::To(distance, limits)]).unwrap();
        let rows = case["rows"].as_array().unwrap();
        for (solver, tolerance) in [(Solver::Exact, 1e-9), (Solver::General { tolerance: 1e-11 }, 1e-8)] {
            let mut controller = Standard::new(&design, &machine).unwrap();
            let mut trajectory = taut::trajectory::Trajectory::default();
            let every = get("every") * get("row");
            let run = stream(
                &machine,
                &mut [&mut controller],
                &Loop::new(&design),
                std::slice::from_ref(&profile),
                &Rows { until: get("until"), every, window: 1e-4 },
                solver,
                false,
                &mut |block| {
                    trajectory.append(block);
                    Flow::Continue
                },
            )
            .unwrap();
            assert_eq!(run.outcome.ending, Ending::Complete);
            for (k, row) in rows.iter().enumerate() {
                for (column, place, length) in
                    [("drive_angle", 1, 0.0194), ("cart_position", 2, 1.0), ("idler_angle", 3, 0.0194)]
                {
                    let off = length * (trajectory.get(column).unwrap()[k] - row[place].as_f64().unwrap()).abs();
                    assert!(off < tolerance, "{}: {column} off by {off:e} m in row {k}, {solver:?}", case["name"]);
                    if solver == Solver::Exact {
                        worst = worst.max(off);
                    }
                }
            }
        }
    }
    println!("within {worst:.1e} m");
}

/// Solutions as SciPy's to 1e-8, residuals below 1e-10, also where the states' units differ by ten powers of ten.
#[test]
fn riccati_equations_agree_with_scipy() {
    let matrix = |value: &Value| {
        let rows: Vec<Vec<f64>> = serde_json::from_value(value.clone()).unwrap();
        DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
    };
    for (k, case) in read("riccati.json").as_array().unwrap().iter().enumerate() {
        let [a, b, q, r, x] = ["a", "b", "q", "r", "x"].map(|key| matrix(&case[key]));
        let solve = if case["discrete"] == true { riccati::discrete } else { riccati::continuous };
        let found = solve(&a, &b, &q, &r).unwrap_or_else(|e| panic!("{k}: {e}"));
        assert!(found.residual < 1e-10, "{k}: {}", found.residual);
        let scale: Vec<f64> = serde_json::from_value(case["scale"].clone()).unwrap();
        let evened = |x: &DMatrix<f64>| DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] / scale[i] / scale[j]);
        let (theirs, mine) = (evened(&x), evened(&found.x));
        let off = (&theirs - &mine).amax() / theirs.amax();
        assert!(off < 1e-8, "{k}: {off:e}");
    }
}

#[test]
fn a_riccati_equation_without_a_solution_says_so() {
    let a = DMatrix::from_row_slice(1, 1, &[2.0]);
    let none = DMatrix::from_row_slice(1, 1, &[0.0]);
    let one = DMatrix::from_row_slice(1, 1, &[1.0]);
    let error = riccati::discrete(&a, &none, &one, &one).unwrap_err().to_string();
    assert!(error.contains("no stabilising solution") || error.contains("solved to"), "{error}");
}

/// Pulleys and spans alike on both sides, without damping: the pulleys vibrate against each other, and the cart, which
/// alone is weighted, stands still. Rounding decides whether the regulator's equation can be solved then. The error
/// spoke of a state that is to be given a weight, and there is none for it.
#[test]
fn a_vibration_without_the_cart_is_named_with_its_frequency() {
    let built = |mass: f64, second: f64, damping: f64, friction: f64| {
        let pulley = format!("inertia = 4.864e-7\nfriction = {{ viscous = {friction:e}, coulomb = 0, static = 0 }}\n");
        let text = format!(
            "[motor]\ntorque_constant = 4.287e-1\nback_emf_constant = 4.287e-1\nresistance = 54\ngear_ratio = 1\n\
             gear_efficiency = 0.6247\n[amplifier]\nmode = \"current\"\ngain = 0.7912\n\
             [drive_pulley]\nradius = 7.995e-3\n{pulley}[idler_pulley]\n{pulley}\
             [cart]\nmass = {mass:e}\nfriction = {{ viscous = 9.694e-2, coulomb = 0, static = 1.388e-2 }}\n\
             [belt]\nstiffness = [1.046e7, {second:e}, 5.171e6]\ndamping = [{damping}, {damping}, {damping}]\n\
             [encoder]\nat = \"drive_pulley\"\nlines = 45090\n\
             [controller]\nevery = 1.647e-5\n\
             state_feedback = {{ position = 2.1e-5, command = 0.1236, disturbance = 3.708e-2, noise = 4.2e-8 }}\n"
        );
        let case = Case::from_text("axis.toml", &text).unwrap();
        Standard::new(case.controller.as_ref().unwrap(), &case.machine).map(drop)
    };
    let masses: Vec<f64> = (0..12).map(|k| 4.044e-3 * (1.0 + 0.1 * f64::from(k))).collect();
    // ω² = (k₁ + 2 k₃) r²/J
    let hertz = ((1.046e7 + 2.0 * 5.171e6) * 7.995e-3_f64.powi(2) / 4.864e-7).sqrt() / std::f64::consts::TAU;
    let refused: Vec<String> =
        masses.iter().filter_map(|mass| built(*mass, 1.046e7, 0.0, 0.0).err()).map(|error| error.to_string()).collect();
    println!("{} of {} are refused", refused.len(), masses.len());
    assert!(!refused.is_empty());
    for error in refused {
        assert!(error.contains("no stabilising solution") && error.contains("in [belt]"), "{error}");
        assert!(error.contains(&format!("{hertz:.4} Hz")), "{error}");
    }
    // Unequal spans, some damping or friction suffice.
    for mass in masses {
        for (second, damping, friction) in [(2e7, 0.0, 0.0), (1.046e7, 1.0, 0.0), (1.046e7, 0.0, 1e-7)] {
            built(mass, second, damping, friction).unwrap();
        }
    }
}

/// Every structure, with gains that make sense on the paper's machine.
fn structures() -> Vec<Structure> {
    let rules = vec![vec![-1.0, -0.5, 0.0], vec![-0.5, 0.0, 0.5], vec![0.0, 0.5, 1.0]];
    let fuzzy = Fuzzy { error: 2e-3, rate: 0.5, command: 6.0, incremental: false, rules, filter: 200.0 };
    let cascade = Cascade {
        position: 60.0,
        speed: 10.0,
        speed_integral: 500.0,
        filter: 200.0,
        reference_speed: 1.0,
        tracking: 0.02,
        current: None,
    };
    let inner = CurrentLoop { proportional: 0.1, integral: 400.0, limit: Some(10.0) };
    let lqg =
        StateFeedback { position: 5e-4, speed: None, integral: None, command: 1.0, disturbance: 0.3, noise: 3e-6 };
    vec![
        Structure::Pid(Pid {
            proportional: 3e3,
            integral: 6e4,
            derivative: 10.0,
            filter: 200.0,
            reference_speed: 1.0,
            tracking: 0.05,
        }),
        Structure::Cascade(cascade),
        Structure::Cascade(Cascade { speed: 14.0, speed_integral: 700.0, current: Some(inner), ..cascade }),
        Structure::StateFeedback(lqg),
        Structure::StateFeedback(StateFeedback { integral: Some(1e-5), ..lqg }),
        Structure::SlidingMode(SLIDING),
        Structure::Fuzzy(fuzzy.clone()),
        Structure::Fuzzy(Fuzzy { rate: 0.05, command: 250.0, incremental: true, ..fuzzy }),
    ]
}

const SLIDING: SlidingMode =
    SlidingMode { bandwidth: 15.0, reaching: 7.0, boundary: 0.7, integral: 4000.0, filter: 200.0 };

/// The paper's machine with the encoder of its rig.
fn rig() -> Machine {
    Machine { encoder: Some(Encoder { at: EncoderPlace::DrivePulley, lines: 3020.0 }), ..common::table4() }
}

proptest! {
    #![proptest_config(cases(60))]

    /// With every limit active, delays, counts, backlash of the reference's shape: all stays finite, the command within
    /// its limit, and after the disturbance of a move that asks for too much the cart comes back near its target.
    #[test]
    fn every_controller_stays_finite_and_recovers(
        which in 0..8_usize,
        (delay, limit) in (0.0..1.5e-3_f64, 4.0..12.0_f64),
        (voltage, current) in (3.5..12.0_f64, 4.0..12.0_f64),
        inductance in prop_oneof![Just(0.0), Just(3e-4)],
        (distance, acceleration) in (0.005..0.1_f64, 1.0..100.0_f64),
        (compensate, observer, cart) in any::<(bool, bool, bool)>(),
    ) {
        let mut machine = rig();
        machine.drives[0].amplifier.voltage_limit = Some(voltage);
        machine.drives[0].amplifier.current_limit = Some(current);
        machine.drives[0].motor.inductance = inductance;
        if cart {
            machine.encoder = Some(Encoder { at: EncoderPlace::Cart, lines: 250_000.0 });
        }
        let design = Design {
            delay,
            limit: Some(limit),
            feed_forward: FeedForward { model: FeedForwardModel::Elastic, compensate_stretch: compensate, ..FeedForward::NONE },
            disturbance_observer: observer.then_some(DisturbanceObserver { bandwidth: 3.0 }),
            filters: vec![Filter::LowPass { frequency: 300.0, damping: 0.7 }],
            ..design(structures().swap_remove(which))
        };
        let limits = Limits { speed: 0.5, acceleration, jerk: None, snap: None };
        let profile = Profile::new(0.0, &[Leg::To(distance, limits)]).unwrap();
        let mut controller = Standard::new(&design, &machine).unwrap();
        let timing = Loop::new(&design);
        let rows = Rows { until: 3.0, every: 1e-3, window: 1e-3 };
        let run = stream(&machine, &mut [&mut controller], &timing, std::slice::from_ref(&profile), &rows, Solver::Exact, true, &mut |_| Flow::Continue).unwrap();
        prop_assert_eq!(run.outcome.ending, Ending::Complete);
        prop_assert!(run.kept.iter().all(|s| s.given.abs() <= limit && s.asked.is_finite()));
        let end = run.figures.cart().error.last;
        prop_assert!(end.abs() < 5e-3, "{:?} ends {end} off", design.structure.name());
        // The same again gives the same: the controller forgets.
        let again = stream(&machine, &mut [&mut controller], &timing, std::slice::from_ref(&profile), &rows, Solver::Exact, true, &mut |_| Flow::Continue).unwrap();
        prop_assert_eq!(run.kept, again.kept);
    }
}

/// Sliding mode by bounds and root mean square, on axes whose parameters are off by up to 20 % one by one, as its
/// reaching gain allows.
#[test]
fn sliding_mode_keeps_its_bounds() {
    let machine = rig();
    let forward = FeedForward { model: FeedForwardModel::Elastic, compensate_stretch: true, ..FeedForward::NONE };
    let design = Design { feed_forward: forward, ..design(Structure::SlidingMode(SLIDING)) };
    let limits = Limits { speed: 0.3, acceleration: 5.0, jerk: Some(300.0), snap: Some(4e4) };
    let profile = Profile::new(0.0, &[Leg::To(0.1, limits)]).unwrap();
    let needed = sliding::required(&SLIDING, &Rigid::new(&machine), 0.2, limits.speed, limits.acceleration);
    assert!(needed < SLIDING.reaching, "{needed}");
    let axes = spread(&machine, 0.2);
    assert!(axes.len() >= 16);
    for (name, axis) in axes {
        let setup = Setup {
            machine: &axis,
            model: &machine,
            design: &design,
            profiles: std::slice::from_ref(&profile),
            until: 1.0,
            window: 1e-4,
            solver: Solver::Exact,
        };
        let figures = closed_loop(&setup).unwrap().figures;
        assert!(
            figures.cart().error.peak.value.abs() < 2e-3 && figures.cart().error.rms < 1e-3,
            "{name}: {:?}",
            figures.cart().error
        );
    }
}

/// The promise of the issue: with a motor encoder alone, feed-forward for a belt that stretches and the compensated
/// reference put the cart at least five times nearer than PID alone, in every one of the three moves.
#[test]
fn elastic_feed_forward_beats_pid_fivefold() {
    let errors = |name: &str| -> Vec<f64> {
        let case = Case::read(format!("stages/sollmann-jouaneh/controllers/{name}.toml")).unwrap();
        let (machine, design) = (&case.machine, case.controller.as_ref().unwrap());
        let error = |motion: &taut::case::Move| {
            let setup = Setup {
                machine,
                model: machine,
                design,
                profiles: &motion.profiles,
                until: motion.until,
                window: motion.window,
                solver: Solver::Exact,
            };
            closed_loop(&setup).unwrap().figures.cart().error.peak.value.abs()
        };
        case.moves.iter().map(error).collect()
    };
    let (plain, elastic) = (errors("pid"), errors("pid-elastic"));
    assert_eq!(plain.len(), 3);
    for (plain, elastic) in plain.into_iter().zip(elastic) {
        assert!(plain > 5.0 * elastic, "{plain} {elastic}");
    }
}

/// At constant speed the cart is where it should be to the last digits if the motor follows the compensated reference
/// exactly.
#[test]
fn the_compensated_reference_balances_the_belt() {
    let machine = common::table4();
    let settings = FeedForward { model: FeedForwardModel::Elastic, compensate_stretch: true, ..FeedForward::NONE };
    let compensation = Compensation::new(&machine, &settings);
    let y = Reference { position: 0.1, speed: 0.2, acceleration: 3.0, ..Reference::default() };
    let needed = compensation.needed(&y);
    let (r, [k1, k2, k3]) = (machine.pulley_radius, machine.belt.stiffness.three());
    let (y1, y3) = (needed.drive.position, needed.idler[0]);
    let (f1, f2, f3) = (k1 * (y1 - y.position), k2 * (y.position - y3), k3 * (y3 - y1));
    // M ẍ = f₁ − f₂ − b ẋ − F_c and J₂ φ̈₃ = r f₂ − r f₃ − B φ̇₃ − τ_c
    assert!((0.362 * 3.0 - (f1 - f2 - 19.0424 * 0.2 - 0.2)).abs() < 1e-9);
    let idler = r * f2 - r * f3 - 0.0016 * 0.2 / r - 0.015;
    assert!((6.3e-5 * 3.0 / r - idler).abs() < 1e-10);
    // J₁ φ̈₁ = r F − r f₁ + r f₃ − B φ̇₁ − τ_c with the force that is fed forward
    let drive = r * needed.force[0] - r * f1 + r * f3 - 0.0016 * needed.drive.speed / r - 0.015;
    assert!((6.3e-5 * needed.drive.acceleration / r - drive).abs() < 1e-10);
}

/// A controller whose limit was NaN or negative was clamped with it, which panics; and a delay of 1e9 samples asked for
/// as much memory.
#[test]
fn a_timing_that_is_none_is_refused() {
    struct Idle;
    impl taut::control::Controller for Idle {
        fn step(&mut self, _: &taut::control::Observation) -> f64 {
            1.0
        }
        fn reset(&mut self) {}
    }
    let (machine, limits) = (rig(), Limits { speed: 0.3, acceleration: 5.0, jerk: None, snap: None });
    let profile = Profile::new(0.0, &[Leg::To(0.01, limits)]).unwrap();
    let told = |timing: Loop, window: f64| {
        let rows = Rows { until: 0.1, every: 1e-3, window };
        let run = stream(
            &machine,
            &mut [&mut Idle],
            &timing,
            std::slice::from_ref(&profile),
            &rows,
            Solver::Exact,
            false,
            &mut |_| Flow::Continue,
        );
        run.err().map(|error| error.to_string())
    };
    let good = Loop { every: 1e-3, delay: 0.0, limit: None, lead: 0.0 };
    assert_eq!(told(good, 1e-4), None);
    assert_eq!(told(Loop { limit: Some(f64::MIN_POSITIVE), delay: 1.0, ..good }, 1e-4), None);
    for limit in [f64::NAN, -1.0, 0.0, -0.0, f64::INFINITY] {
        let expected =
            format!("the limit of the command cannot be {limit:?}\n  allowed: above zero, in V or A; none at all");
        assert_eq!(told(Loop { limit: Some(limit), ..good }, 1e-4).as_deref(), Some(expected.as_str()));
    }
    for every in [f64::NAN, 0.0, -1e-3, f64::INFINITY] {
        let expected = format!("a loop cannot be sampled every {every:?} s\n  allowed: above zero");
        assert_eq!(told(Loop { every, ..good }, 1e-4).as_deref(), Some(expected.as_str()));
    }
    for delay in [f64::NAN, -1e-9, 1.1, 1e9, f64::INFINITY] {
        let expected = format!("a command cannot be {delay:?} s late\n  allowed: from zero to 1000 sample times");
        assert_eq!(told(Loop { delay, ..good }, 1e-4).as_deref(), Some(expected.as_str()));
    }
    for lead in [f64::NAN, -1.0, f64::INFINITY] {
        let expected = format!("a controller cannot look {lead:?} s ahead\n  allowed: from zero on");
        assert_eq!(told(Loop { lead, ..good }, 1e-4).as_deref(), Some(expected.as_str()));
    }
    assert_eq!(
        told(Loop { every: 1e-12, ..good }, 1e-4).as_deref(),
        Some(
            "a sample every 1e-12 s makes 1e11 of them in 0.1 s\n  allowed: up to 1e9\n  next: take a longer sample time, or a shorter run"
        )
    );
    assert_eq!(told(good, f64::NAN).as_deref(), Some("the cart cannot settle within NaN m\n  allowed: above zero"));
}

/// PD and cascades without integrals gathered what the limit had left in an integral that nothing empties: after a
/// second at its limit such a loop stood beside its target for ever.
#[test]
fn a_limit_leaves_nothing_behind_where_there_is_no_integral() {
    use taut::control::{Controller, Observation};
    let pid = Pid {
        proportional: 1000.0,
        integral: 0.0,
        derivative: 0.0,
        filter: 200.0,
        reference_speed: 1.0,
        tracking: 0.05,
    };
    let inner = CurrentLoop { proportional: 0.3, integral: 0.0, limit: Some(1.0) };
    let cascade = Cascade {
        position: 60.0,
        speed: 10.0,
        speed_integral: 0.0,
        filter: 200.0,
        reference_speed: 1.0,
        tracking: 0.02,
        current: None,
    };
    let loops = [
        Structure::Pid(pid),
        Structure::Cascade(cascade),
        Structure::Cascade(Cascade { current: Some(inner), ..cascade }),
    ];
    for structure in loops {
        let name = structure.name();
        let mut controller = Standard::new(&design(structure), &rig()).unwrap();
        controller.reset();
        let mut step = |error: f64| {
            let reference = Reference::at(error);
            let seen = Observation { time: 0.0, reference, ahead: reference, position: 0.0, scale: None, current: 0.0 };
            let asked = controller.step(&seen);
            controller.limited(asked.clamp(-0.1, 0.1));
            asked
        };
        let first = step(0.1);
        assert!(first > 0.2, "{name}: {first}");
        for _ in 0..1000 {
            assert_eq!(step(0.1), first, "{name}: the same error asks for the same");
        }
        assert_eq!(step(0.0), 0.0, "{name}: no error asks for nothing");
    }
}

/// A share of one made masses of nothing, and what was told then was of masses.
#[test]
fn a_spread_that_is_no_share_is_refused() {
    let case = Case::read("stages/sollmann-jouaneh/controllers/pid.toml").unwrap();
    let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    for share in [f64::NAN, -0.2, 0.0, 1.0, f64::INFINITY] {
        let told = taut::control::worst(&case.machine, design, motion, share, Solver::Exact, &|| false).unwrap_err();
        let expected = format!(
            "a relative error of parameters cannot be {share:?}\n  allowed: above 0, below 1\n  next: write 0.2 for 20 \
             %"
        );
        assert_eq!(told.to_string(), expected);
    }
    let stopped = taut::control::worst(&case.machine, design, motion, 0.2, Solver::Exact, &|| true).unwrap();
    assert_eq!(stopped, None);
}

/// Gains in units of drives: a cascade by hand, and a notch by its response.
#[test]
fn gains_of_drives_are_those_of_the_loop() {
    use taut::design::{Cascade, CurrentLoop, Design, Filter, InDrives, Pid, Structure};
    let current = CurrentLoop { proportional: 2.0, integral: 1000.0, ..CurrentLoop::default() };
    let cascade =
        Cascade { position: 50.0, speed: 4.0, speed_integral: 200.0, current: Some(current), ..Cascade::default() };
    let base = Case::read("stages/sollmann-jouaneh/controllers/pid.toml").unwrap().controller.unwrap();
    let of = |structure: Structure, filters: Vec<Filter>| Design { structure, filters, ..base.clone() }.in_drives();
    let rows = |gains: &[InDrives]| gains.iter().map(|gain| (gain.name, gain.value, gain.unit)).collect::<Vec<_>>();
    let cascade = of(Structure::Cascade(cascade), Vec::new());
    let expected = [
        ("K_v", 50.0, "1/s"),
        ("K_v", 3.0, "(m/min)/mm"),
        ("T_n (speed loop)", 20.0, "ms"),
        ("T_n (current loop)", 2.0, "ms"),
    ];
    assert_eq!(rows(&cascade), expected);
    // Without an integral or a derivative there is no such time.
    assert_eq!(of(Structure::Pid(Pid { proportional: 3e3, ..Pid::default() }), Vec::new()), []);
    let notch = of(
        Structure::Pid(Pid { proportional: 3e3, integral: 3e4, derivative: 30.0, ..Pid::default() }),
        vec![Filter::Notch { frequency: 80.0, depth: 0.05, damping: 0.5 }],
    );
    let values: Vec<f64> = notch.iter().map(|gain| gain.value).collect();
    let expected = [100.0, 10.0, 80.0, 80.0, -20.0];
    assert!(values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < 1e-12), "{notch:?}");
}

/// The feed-forward of WPILib and LinuxCNC is the rigid feed-forward, and the torque of ODrive is that of the motor.
#[test]
fn gains_for_drives_make_the_same_command() {
    let machine = Case::read("stages/sollmann-jouaneh/table4.toml").unwrap().machine;
    let rigid = taut::machine::rigid::Rigid::new(&machine);
    let gains = taut::control::drives::drive_gains(&machine);
    let value = |name: &str| gains.iter().find(|gain| gain.name == name).unwrap().value;
    let (speed, acceleration) = (0.3, 4.0);
    let force = rigid.mass * acceleration + rigid.viscous[0] * speed + rigid.coulomb[0];
    let wanted = rigid.command(force, 0.0, &Reference { speed, acceleration, ..Reference::default() })
        * machine.drives[0].amplifier.gain;
    let wpilib = value("kS") + value("kV") * speed + value("kA") * acceleration;
    assert!((wpilib - wanted).abs() < 1e-12 * wanted, "{wpilib} {wanted}");
    let linuxcnc = value("FF1") * 1e3 * speed + value("FF2") * 1e3 * acceleration + value("kS");
    assert!((linuxcnc - wanted).abs() < 1e-12 * wanted, "{linuxcnc} {wanted}");
    // Turns of the motor per metre, and its torque from the current.
    let turns = machine.drives[0].motor.gear_ratio / (2.0 * std::f64::consts::PI * machine.pulley_radius);
    let torque = value("config.inertia") * acceleration * turns
        + value("input_torque per input_vel") * speed * turns
        + value("input_torque against dry friction");
    let current = (wanted - rigid.brake * speed) / machine.drives[0].motor.resistance;
    assert!((torque - machine.drives[0].motor.torque_constant * current).abs() < 1e-12, "{torque} {current}");
    let inertia = value("P-AXIS-00391 load") - value("3140:07 load inertia");
    assert_eq!(inertia, machine.drives[0].motor.rotor_inertia);
    // The command of a stepper is a position.
    let stepper = Case::read("stages/stepper-axis/stepper-axis.toml").unwrap().machine;
    assert!(taut::control::drives::drive_gains(&stepper).is_empty());
}

/// The limit of a current loop bounds what a machine can follow, as that of the amplifier does.
#[test]
fn a_current_loop_with_a_limit_cannot_follow_more() {
    let read = |changes: &[&str]| Case::read_with("stages/sollmann-jouaneh/controllers/cascade-current.toml", changes);
    let limits = |case: &Case| -> Vec<(String, f64)> {
        let found = case.shortfalls().into_iter().flat_map(|(name, short)| {
            short.into_iter().map(move |short| (format!("{name}: {}", short.limit), short.allowed))
        });
        found.collect()
    };
    let (free, own) = (read(&[]).unwrap(), read(&["controller.cascade.current.limit=2 A"]).unwrap());
    let amplifier = read(&["amplifier.current_limit=2 A"]).unwrap();
    assert!(limits(&free).is_empty(), "{:?}", limits(&free));
    assert!(
        !limits(&own).is_empty() && limits(&own).iter().all(|(limit, most)| limit.ends_with("current") && *most == 2.0)
    );
    assert_eq!(limits(&own), limits(&amplifier));
}
