//! Linear analysis: against python-control with SLICOT and 60-digit numbers (`authorities/linear.py`), and by laws that
//! hold for any stage.

use crate::common;
use common::random::{Dry, cases, equipped, machine};
use common::{experiment, table1, table2, table4};
use nalgebra::Complex;
use proptest::prelude::*;
use serde_json::Value;
use std::f64::consts::PI;
use taut::case::{Case, Template};
use taut::friction::{Friction, Law, Shape};
use taut::linear::{Hold, Natural, Operation, Range, Root, StateSpace, places, travel, undamped};
use taut::machine::{Belt, BeltMake, BeltModel, Machine};
use taut::signal::Signal;
use taut::solve::{Solver, simulate};

fn complex(value: &Value) -> Complex<f64> {
    Complex::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap())
}

fn list(value: &Value) -> Vec<Complex<f64>> {
    value.as_array().unwrap().iter().map(complex).collect()
}

/// The largest relative distance between roots that match; zero must be zero.
fn apart(ours: &[Complex<f64>], theirs: &[Complex<f64>]) -> f64 {
    if ours.len() != theirs.len() {
        return f64::INFINITY;
    }
    let (mut left, mut worst) = (ours.to_vec(), 0.0_f64);
    let mut sorted = theirs.to_vec();
    sorted.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    for value in sorted {
        let nearest = (0..left.len()).min_by(|&i, &j| (left[i] - value).norm().total_cmp(&(left[j] - value).norm()));
        let found = left.swap_remove(nearest.unwrap());
        let distance = (found - value).norm();
        worst = worst.max(if distance == 0.0 { 0.0 } else { distance / value.norm() });
    }
    worst
}

fn told(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:.1e}")).collect::<Vec<_>>().join(", ")
}

#[test]
fn two_hundred_random_stages() {
    let file: Value = serde_json::from_str(include_str!("authorities/linear.json")).unwrap();
    let all = file["cases"].as_array().unwrap();
    assert_eq!(all.len(), 200);
    let (mut worst, mut worst_control, mut excused, mut faults) = ([0.0_f64; 5], [0.0_f64; 4], [0; 4], Vec::new());
    for case in all {
        let name = case["name"].as_str().unwrap();
        let number = |key: &str| case[key].as_f64().unwrap();
        let machine = Case::from_text("case.toml", case["case"].as_str().unwrap()).unwrap().machine;
        let operation = Operation { speed: number("speed"), ..Operation::default() };
        let system = StateSpace::new(&machine, operation).unwrap();
        let sampled = system.discrete(number("sample_time"), Hold::Zero, 0.0).unwrap();
        // Index, our distance to 60 digits, to python-control, and how far that is from the 60 digits.
        let mut check = |index: usize, what: &str, exact: f64, control: f64, doubt: &str| {
            let doubt = case["control_differs_by"][doubt].as_f64().unwrap_or(f64::INFINITY);
            worst[index] = worst[index].max(exact);
            if exact > 1e-9 {
                faults.push(format!("{name}: {what} differ by {exact:.1e}"));
            }
            if index < 4 {
                if doubt < 1e-10 {
                    worst_control[index] = worst_control[index].max(control);
                } else {
                    excused[index] += 1;
                }
                if control > 1e-9_f64.max(2.0 * doubt) {
                    faults.push(format!("{name}: {what} differ from python-control's by {control:.1e}"));
                }
            }
        };
        let poles = system.poles().unwrap();
        // Of a double zero python-control makes two small numbers: it is compared without those.
        let size = poles.iter().map(|v| v.norm()).fold(0.0, f64::max);
        let nonzero =
            |values: &[Complex<f64>]| values.iter().copied().filter(|v| v.norm() > 1e-9 * size).collect::<Vec<_>>();
        let control = list(&case["control_poles"]);
        check(0, "poles", apart(&poles, &list(&case["poles"])), apart(&nonzero(&poles), &nonzero(&control)), "poles");
        for output in case["outputs"].as_array().unwrap() {
            let index = system.output(output["name"].as_str().unwrap()).unwrap();
            let transfer = &system.transfers().unwrap()[index];
            let zeros = &transfer.zeros.values;
            let control = list(&output["control_zeros"]);
            let from_control = apart(&nonzero(zeros), &nonzero(&control));
            check(1, "zeros", apart(zeros, &list(&output["zeros"])), from_control, "zeros");
            let (order, gain) = transfer.low_frequency();
            let want = output["low_frequency_gain"].as_f64().unwrap();
            let same = i64::from(order) == output["integrators"].as_i64().unwrap();
            check(4, "gains", if same { (gain / want - 1.0).abs() } else { f64::INFINITY }, 0.0, "poles");
            let far = |got: Complex<f64>, want: &Value| (got - complex(want)).norm() / complex(want).norm();
            for (k, omega) in case["frequencies"].as_array().unwrap().iter().enumerate() {
                let got = system.at(omega.as_f64().unwrap())[index];
                let [exact, control] = ["exact_response", "response"].map(|key| far(got, &output[key][k]));
                check(2, "responses", exact, control, "response");
            }
            for (k, angle) in case["angles"].as_array().unwrap().iter().enumerate() {
                let got = sampled.at(angle.as_f64().unwrap() / sampled.sample_time)[index];
                let [exact, control] = ["exact_sampled", "sampled"].map(|key| far(got, &output[key][k]));
                check(3, "sampled responses", exact, control, "sampled");
            }
        }
    }
    println!("poles, zeros, responses, sampled responses, gains: from 60 digits at most {}", told(&worst));
    println!(
        "from python-control, where it is within 1e-10 of those, at most {}; elsewhere {excused:?} values",
        told(&worst_control)
    );
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(20)].join("\n"));
}

/// Hertz of every pair, the lowest first.
fn hertz(system: &StateSpace) -> Vec<f64> {
    Root::from_values(&system.poles().unwrap()).into_iter().filter_map(Root::hertz).collect()
}

proptest! {
    #![proptest_config(cases(200))]

    /// A stage without a source of energy does not grow: the motor gives no more than it takes only with K_t = K_e.
    #[test]
    fn poles_of_a_passive_stage_do_not_grow(mut machine in equipped(Dry::Any)) {
        machine.drives[0].motor.back_emf_constant = machine.drives[0].motor.torque_constant;
        for operation in [Operation::default(), Operation { speed: -0.1, ..Operation::default() }] {
            let poles = StateSpace::new(&machine, operation).unwrap().poles().unwrap();
            let largest = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
            prop_assert!(poles.iter().all(|p| p.re <= 1e-12 * largest), "{poles:?}");
        }
    }

    /// An output that is the drive angle stands still where everything else swings with the drive pulley clamped.
    #[test]
    fn antiresonance_is_resonance_with_the_drive_pulley_clamped(machine in machine(Dry::Any)) {
        let free = StateSpace::new(&machine, Operation::default()).unwrap();
        let held = Operation { held: [true, false, false, false, false, false], ..Operation::default() };
        let held = StateSpace::new(&machine, held).unwrap().poles().unwrap();
        let zeros = free.zeros(free.output("drive_angle").unwrap()).unwrap().unwrap().values;
        // With an inductance the current goes on by itself while the pulley is held: −R/L, no zero.
        let electrical = Complex::new(-machine.drives[0].motor.resistance / machine.drives[0].motor.inductance, 0.0);
        let of_motion: Vec<_> = held.iter().copied().filter(|p| (p - electrical).norm() > 1e-6 * p.norm()).collect();
        prop_assert!(apart(&of_motion, &zeros) < 1e-9, "{of_motion:?} {zeros:?}");
    }

    /// Poles and zeros together are the transfer function.
    #[test]
    fn the_response_is_that_of_its_poles_and_zeros(machine in equipped(Dry::Any)) {
        let system = StateSpace::new(&machine, Operation::default()).unwrap();
        let transfers = system.transfers().unwrap();
        for omega in [3.0, 40.0, 700.0, 2e4] {
            for (got, transfer) in system.at(omega).into_iter().zip(&transfers) {
                let s = Complex::new(0.0, omega);
                let mut log = Complex::new(transfer.zeros.gain, 0.0).ln();
                log += transfer.zeros.values.iter().map(|z| (s - z).ln()).sum::<Complex<f64>>();
                log -= transfer.poles.iter().map(|p| (s - p).ln()).sum::<Complex<f64>>();
                let want = if transfer.zeros.gain == 0.0 { Complex::new(0.0, 0.0) } else { log.exp() };
                prop_assert!((got - want).norm() <= 1e-8 * want.norm(), "{got} {want} {transfer:?}");
                let turn = (transfer.phase(omega) - got.arg()) / (2.0 * PI);
                prop_assert!(got.norm() == 0.0 || (turn - turn.round()).abs() < 1e-7, "{transfer:?}");
            }
        }
    }

    /// A model for a sample time does what the exact solver does with an input that stands between samples.
    #[test]
    fn sampled_models_step_like_the_exact_solver(mut machine in machine(Dry::Any), late in 0.0..2.5_f64) {
        for law in [&mut machine.drive_pulley.friction, &mut machine.cart.friction, &mut machine.idler_pulley.friction] {
            // Without dry friction the linear model is the whole one.
            (law.backward, law.forward.coulomb, law.forward.breakaway) = (law.forward, 0.0, 0.0);
            law.backward = law.forward;
        }
        machine.drives[0].motor.gear_efficiency = 1.0;
        let (period, late) = (1e-3, (late * 4.0).round() / 4.0);
        let system = StateSpace::new(&machine, Operation::default()).unwrap();
        let model = system.discrete(period, Hold::Zero, late * period).unwrap();
        let run = experiment(Signal::Pulse { value: 3.0, duration: 5.0 * period, at: late * period }, 0.02);
        let trajectory = simulate(&machine, &run, Solver::Exact).unwrap().trajectory;
        let mut x = nalgebra::DVector::zeros(model.a.nrows());
        let column = trajectory.get("cart_position").unwrap();
        let row = system.output("cart_position").unwrap();
        let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (k, want) in column.iter().enumerate() {
            let u = if k < 5 { 3.0 } else { 0.0 };
            let got = (model.c.row(row) * &x)[0] + model.d[row] * u;
            prop_assert!((got - want).abs() <= 1e-9 * largest + 1e-15, "row {k}: {got} {want}");
            x = &model.a * x + &model.b * u;
        }
    }
}

/// A small sine on top of steady sliding, run by the exact solver, swings as the frequency response says.
#[test]
fn the_response_is_what_a_run_shows() {
    for (machine, hertz) in [(table4(), 20.0), (table4(), 130.0), (table2(), 300.0), (table1(), 60.0)] {
        let system = StateSpace::new(&machine, Operation::default()).unwrap();
        let mut run = experiment(Signal::Sine { amplitude: 0.2, frequency: hertz, phase: 0.0, offset: 4.0 }, 3.0);
        run.every = 1.0 / (40.0 * hertz);
        let trajectory = simulate(&machine, &run, Solver::Exact).unwrap().trajectory;
        let (time, speed) = (trajectory.get("time").unwrap(), trajectory.get("cart_speed").unwrap());
        // The last 20 periods, by correlation.
        let from = time.len() - 1 - 800;
        let mut sum = Complex::new(0.0, 0.0);
        for k in from..time.len() - 1 {
            sum += speed[k] * Complex::new(0.0, -2.0 * PI * hertz * time[k]).exp() / 400.0;
        }
        // sin = Im e^{jωt}: the coefficient of e^{jωt} is G/j
        let got = sum * Complex::new(0.0, 1.0) / 0.2;
        let want = system.at(2.0 * PI * hertz)[system.output("cart_speed").unwrap()];
        assert!((got - want).norm() < 1e-6 * want.norm(), "{hertz} Hz: {got} {want}");
    }
}

/// Bristles that slide steadily carry what a Stribeck curve says; at rest they hold the cart like a spring.
#[test]
fn bristles_slide_like_the_curve_and_hold_like_a_spring() {
    let with = |law: Law| {
        let mut machine = undamped(&table2());
        machine.cart.friction = Friction::with_breakaway(19.0, 0.2, 0.3).following(law);
        machine
    };
    let bristles = with(Law::LuGre { stiffness: 1e5, damping: 30.0, velocity: 0.1 });
    let curve = with(Law::Stribeck { velocity: 0.1, shape: Shape::Gaussian });
    let gain = |machine: &Machine, speed: f64| {
        let system = StateSpace::new(machine, Operation { speed, ..Operation::default() }).unwrap();
        system.transfers().unwrap()[system.output("cart_speed").unwrap()].low_frequency()
    };
    for speed in [0.02, 0.1, -0.3] {
        let ((zero, a), (none, b)) = (gain(&bristles, speed), gain(&curve, speed));
        assert!(zero == 0 && none == 0 && (a / b - 1.0).abs() < 1e-9, "{speed}: {a} {b}");
    }
    let rest = Operation { speed: 0.0, held: [true, false, true, false, false, false], ..Operation::default() };
    let [k1, k2, _] = bristles.belt.stiffness.three();
    let swing = StateSpace::new(&bristles, rest).unwrap().poles().unwrap().pop().unwrap().norm_sqr();
    assert!((swing / ((k1 + k2 + 1e5) / bristles.cart.mass) - 1.0).abs() < 1e-12, "{swing}");
}

/// Two inertias on one spring: ω² = k (1/J + 1/J′), clamped k/J′.
#[test]
fn two_masses_by_hand() {
    let mut machine = undamped(&table2());
    machine.belt.model = BeltModel::TwoMass;
    let [k1, k2, k3] = machine.belt.stiffness.three();
    let k = k1 + k2 * k3 / (k2 + k3);
    let r2 = machine.pulley_radius.powi(2);
    let pulleys = (machine.drive_pulley.inertia + machine.idler_pulley.inertia) / r2;
    let m = machine.cart.mass;
    let found = &travel(&machine, Operation::default(), &[0.0]).unwrap()[0];
    let by_hand = |omega2: f64| omega2.sqrt() / (2.0 * PI);
    assert!((found.undamped_resonances[0] / by_hand(k * (1.0 / m + 1.0 / pulleys)) - 1.0).abs() < 1e-12);
    assert!((found.undamped_antiresonances[0] / by_hand(k / m) - 1.0).abs() < 1e-12);
}

/// k = A E / l with the length that is left of a span.
#[test]
fn spans_that_follow_the_cart() {
    let make = BeltMake { modulus: 4e9, section: 4e-6, spans: [0.4, 0.4, 0.8].into() };
    let belt = Belt { make: Some(make), follows_cart: true, ..Belt::given(make.stiffness(), [0.0; 3]) };
    let machine = Machine { belt, ..table2() };
    assert_eq!(places(&table2(), 5), None);
    let positions = places(&machine, 5).unwrap();
    assert!((positions[0] + 0.38).abs() < 1e-12 && (positions[4] - 0.38).abs() < 1e-12);
    let along = travel(&machine, Operation::default(), &positions).unwrap();
    // Near the drive pulley the cart hangs on a short span.
    assert!(along[4].undamped_antiresonances[1] > 2.0 * along[2].undamped_antiresonances[1], "{along:?}");
    // Where the axis is built symmetric it is so for the anti-resonance with both pulleys held.
    let both = Operation { held: [true, false, true, false, false, false], ..Operation::default() };
    let at = |position| hertz(&StateSpace::new(&machine, Operation { position, ..both }).unwrap());
    assert!((at(0.2)[0] / at(-0.2)[0] - 1.0).abs() < 1e-12);
    let [k1, k2] = make.stiffness_at(0.2);
    let poles = StateSpace::new(&machine, Operation { position: 0.2, ..both }).unwrap().poles().unwrap();
    assert!((poles[0].norm_sqr() / ((k1 + k2) / machine.cart.mass) - 1.0).abs() < 1e-12);
    let beyond = StateSpace::new(&machine, Operation { position: 0.41, ..Operation::default() });
    assert!(beyond.unwrap_err().to_string().contains("between -0.4 m and 0.4 m"));
}

#[test]
fn phases_run_on_from_where_they_begin() {
    let system = StateSpace::new(&table2(), Operation::default()).unwrap();
    let transfers = system.transfers().unwrap();
    let zeros: Vec<_> = transfers.iter().map(|t| t.zeros.clone()).collect();
    let range = Range::new(&transfers[0].poles, &zeros);
    let frequencies = range.frequencies(&transfers[0].poles);
    let responses = system.responses(&transfers, &frequencies);
    let of = |name: &str| &responses[system.output(name).unwrap()];
    let ends = |name: &str| (of(name).degrees()[0], *of(name).degrees().last().unwrap());
    // An integrator begins at −90°. Four poles more than zeros, or two, where it ends.
    let (begin, end) = ends("drive_angle");
    assert!((begin + 90.0).abs() < 10.0 && (end + 180.0).abs() < 5.0, "{begin} {end}");
    let (begin, end) = ends("cart_position");
    assert!((begin + 90.0).abs() < 10.0 && (end + 360.0).abs() < 5.0, "{begin} {end}");
    for response in &responses {
        let jump = response.phase.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(jump < 1.0, "{jump}");
    }
}

/// Of an undamped stage nothing is left over: the eigenvalues lie on the axis.
#[test]
fn stages_without_losses() {
    let poles = StateSpace::new(&undamped(&table4()), Operation::default()).unwrap().poles().unwrap();
    assert_eq!(poles.iter().filter(|p| p.norm() == 0.0).count(), 2);
    assert!(poles.iter().all(|p| p.re.abs() <= 1e-12 * p.norm()), "{poles:?}");
}

/// With every body held the current alone is left, and without an inductance it is no state: a system without states.
#[test]
fn nothing_is_left_to_move() {
    let held = Operation { held: [true, true, true, false, false, false], ..Operation::default() };
    let system = StateSpace::new(&table4(), held).unwrap();
    assert_eq!((system.states.len(), system.poles().unwrap().len()), (0, 0));
    let transfers = system.transfers().unwrap();
    let current = system.output("motor_current").unwrap();
    assert!((transfers[current].low_frequency().1 * 0.71 - 1.0).abs() < 1e-15);
    assert_eq!(system.responses(&transfers, &[1.0])[current].value[0].re, 1.0 / 0.71);
    assert!(system.discrete(1e-3, Hold::Zero, 0.0).is_err());
}

#[test]
fn what_cannot_be_sampled_is_said() {
    let system = StateSpace::new(&table2(), Operation::default()).unwrap();
    for (t, hold, delay) in
        [(0.0, Hold::Zero, 0.0), (f64::NAN, Hold::Zero, 0.0), (1e-3, Hold::Tustin, 1e-4), (1e-3, Hold::Zero, 1.0)]
    {
        assert!(system.discrete(t, hold, delay).is_err());
    }
    // Between samples a tenth of the fastest period long the three rules agree about the slow end.
    let at = |hold| system.discrete(1e-5, hold, 0.0).unwrap().at(100.0)[0];
    let exact = system.at(100.0)[0];
    assert!((at(Hold::Tustin) - exact).norm() < 1e-6 * exact.norm());
    assert!((at(Hold::First) - exact).norm() < 1e-6 * exact.norm());
    // Half a sample late.
    let late = exact * Complex::new(0.0, -100.0 * 0.5e-5).exp();
    assert!((at(Hold::Zero) - late).norm() < 1e-6 * exact.norm());
}

/// A delay that rounding does not tell from none made a model with no place for it: an index past the end.
#[test]
fn a_delay_below_rounding_is_none() {
    let system = StateSpace::new(&table2(), Operation::default()).unwrap();
    let none = system.discrete(1e-3, Hold::Zero, 0.0).unwrap();
    for delay in [5e-324, 1e-300, 1e-20, 1e-16] {
        let model = system.discrete(1e-3, Hold::Zero, delay).unwrap();
        assert_eq!((&model.a, &model.b, model.states.len()), (&none.a, &none.b, none.states.len()), "{delay:e}");
    }
    assert_eq!(system.discrete(1e-3, Hold::Zero, 1e-14).unwrap().states.len(), none.states.len() + 1);
}

/// A place that is no number is within no travel and outside none: without a travel its eigenvalues were sought for
/// ever.
#[test]
fn a_question_whose_numbers_are_none_is_refused() {
    use taut::linear::{Analysis, Question};
    let case = taut::case::Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let told = |question: Question| Analysis::new(&case, &question).unwrap_err().to_string();
    let nan = f64::NAN;
    let usual = Question::default();
    for (question, expected) in [
        (
            Question { at: Some(nan), ..usual.clone() },
            "--at: NaN is not allowed here\n  allowed: a finite number, in m",
        ),
        (
            Question { speed: Some(f64::INFINITY), ..usual.clone() },
            "--speed: inf is not allowed here\n  allowed: a finite number, in m/s",
        ),
        (
            Question { delay: nan, ..usual.clone() },
            "--delay: NaN is not allowed here\n  allowed: a finite number, in s",
        ),
        (
            Question { from: Some(0.0), ..usual.clone() },
            "--from: 0.0 is not allowed here\n  allowed: above zero, in Hz",
        ),
        (Question { to: Some(-1.0), ..usual.clone() }, "--to: -1.0 is not allowed here\n  allowed: above zero, in Hz"),
    ] {
        assert_eq!(told(question), expected);
    }
}

/// The modes of any mechanism, on an axis: its poles are those of the state space.
#[test]
fn natural_modes_have_the_poles_of_the_state_space() {
    let mut geared = table2();
    geared.drives[0].motor.gear_ratio = 3.0;
    geared.drives[0].motor.gear_efficiency = 0.8;
    geared.drives[0].motor.rotor_inertia = 4e-6;
    geared.belt.damping = [3.0, 4.0, 5.0].into();
    for machine in [table4(), geared] {
        let natural = Natural::new(&machine.mechanism(), &[0.0; 6]).unwrap();
        let system = StateSpace::new(&machine, Operation::default()).unwrap();
        let size = |root: &Root| match *root {
            Root::Zero => 0.0,
            Root::Real(s) => s.abs(),
            Root::Pair { frequency, .. } => frequency,
        };
        let mut sizes =
            [Root::from_values(&system.poles().unwrap()), natural.poles].map(|roots| roots.iter().map(size).collect());
        sizes.iter_mut().for_each(|sizes: &mut Vec<f64>| sizes.sort_by(f64::total_cmp));
        let [want, have] = sizes;
        assert_eq!(have.len(), want.len());
        for (have, want) in have.iter().zip(&want) {
            assert!((have - want).abs() <= 1e-9 * want, "{have} {want}");
        }
        let bare = StateSpace::new(&undamped(&machine), Operation::default()).unwrap().poles().unwrap();
        let hertz = Root::from_values(&bare).into_iter().filter_map(Root::hertz);
        if machine.drives[0].motor.gear_efficiency == 1.0 {
            for (mode, want) in natural.elastic.iter().zip(hertz) {
                assert!((mode.hertz() / want - 1.0).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn a_machine_with_spans_held_is_the_one_that_follows_at_that_place() {
    proptest!(cases(40), |(shares in [-0.9..0.9, -0.9..0.9_f64], template in 0..3)| {
        let template = [Template::Stage, Template::PrinterServo, Template::Gantry][template as usize];
        let machine = Case::from_text("machine.toml", template.text()).unwrap().machine;
        let slides: Vec<f64> = machine
            .travels()
            .zip(shares)
            .map(|((_, travel), share)| travel.map_or(0.0, |travel| share * travel.max))
            .collect();
        let held = machine.with_spans_held(&slides);
        prop_assert!(!held.belt.follows_cart && held.mechanism().is_piecewise_linear());
        let there = StateSpace::new(&machine, Operation::at(&slides)).unwrap();
        let here = StateSpace::new(&held, Operation::default()).unwrap();
        let apart = (&there.a - &here.a).amax() / there.a.amax();
        prop_assert!(apart < 1e-14, "{apart:e} of the largest element");
        // The law of a span: k = A E / l.
        let lengths = machine.span_lengths(&slides).unwrap();
        for (stiffness, length) in held.belt.stiffness.into_iter().zip(lengths) {
            let wanted = machine.belt.make.unwrap().rigidity() / length;
            prop_assert!((stiffness / wanted - 1.0).abs() < 1e-14);
        }
    });
}
