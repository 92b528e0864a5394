//! The general solver: against the exact one where both apply, and against laws that hold for any friction.

use crate::common;
use common::random::{self, Dry};
use proptest::prelude::*;
use taut::case::Experiment;
use taut::friction::{Friction, Law, Shape};
use taut::machine::axis::CART;
use taut::machine::{BeltMake, Machine, Travel};
use taut::mechanism::State;
use taut::polyline::Polyline;
use taut::signal::Signal;
use taut::solve::{Dynamics, Ending, Quantity, Solution, Solver, simulate};

fn experiment(input: &Signal, until: f64, every: f64) -> Experiment {
    Experiment { every, ..common::experiment(input.clone(), until) }
}

fn run(machine: &Machine, experiment: &Experiment, solver: Solver) -> Solution {
    let solution = simulate(machine, experiment, solver).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

/// The largest difference at the belt, m.
fn apart(machine: &Machine, a: &Solution, b: &Solution) -> f64 {
    let arms = [("drive_angle", machine.pulley_radius), ("cart_position", 1.0), ("idler_angle", machine.pulley_radius)];
    let mut worst: f64 = 0.0;
    for (name, arm) in arms {
        let (a, b) = (a.trajectory.get(name).unwrap(), b.trajectory.get(name).unwrap());
        assert_eq!(a.len(), b.len());
        worst = a.iter().zip(b).map(|(a, b)| arm * (a - b).abs()).fold(worst, f64::max);
    }
    worst
}

#[test]
fn the_papers_machine_as_the_exact_solver_has_it() {
    let machine = common::table4();
    for (volts, until) in [(5.0, 1.0), (10.0, 1.0)] {
        let experiment = experiment(&Signal::Pulse { value: volts, duration: 0.25, at: 0.0 }, until, 1e-3);
        let exact = run(&machine, &experiment, Solver::Exact);
        for (tolerance, allowed, moment) in [(1e-6, 1e-8, 1e-4), (1e-9, 1e-11, 1e-8), (1e-12, 1e-13, 1e-10)] {
            let general = run(&machine, &experiment, Solver::General { tolerance });
            let difference = apart(&machine, &exact, &general);
            println!("{volts} V, {tolerance:e}: {difference:.1e} m, {:?}", general.outcome.cost);
            assert!(difference < allowed, "{volts} V, {tolerance:e}: {difference:e}");
            assert_eq!(general.outcome.events.len(), exact.outcome.events.len(), "{volts} V, {tolerance:e}");
            for (a, b) in general.outcome.events.iter().zip(&exact.outcome.events) {
                assert!(a.part == b.part && a.to == b.to && (a.time - b.time).abs() < moment, "{a:?} and {b:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(random::cases(300))]

    /// Where both solvers apply they agree.
    #[test]
    fn general_is_exact(
        machine in prop_oneof![random::machine(Dry::Any).boxed(), random::lined(Dry::Any).boxed()],
        input in random::input()
    ) {
        // Flanks and spans that rattle undamped are chaotic.
        let until = if random::rattles(&machine) { 0.04 } else { 0.3 };
        let experiment = experiment(&input, until, 1e-3);
        let (a, b) = (run(&machine, &experiment, Solver::Exact), run(&machine, &experiment, Solver::General { tolerance: 1e-11 }));
        let difference = apart(&machine, &a, &b);
        prop_assert!(difference < 1e-9, "{difference:e} m");
    }
}

/// The machine without its gear: a motor with n K_t, n K_e and n² J_r turns the pulley as the motor behind its gear.
fn without_gear(machine: &Machine) -> Machine {
    let mut direct = machine.clone();
    let motor = &mut direct.drives[0].motor;
    let n = std::mem::replace(&mut motor.gear_ratio, 1.0);
    motor.torque_constant *= n;
    motor.back_emf_constant *= n;
    motor.rotor_inertia *= n * n;
    direct
}

proptest! {
    #![proptest_config(random::cases(100))]

    /// A rotor behind a gear moves the pulley as a larger one without the gear, also where friction is curved and the
    /// gear's losses depend on the direction of its power.
    #[test]
    fn a_gear_is_a_slower_and_stronger_motor(
        machine in random::machine(Dry::Any),
        rotor in random::decades(1e-6, 1e-4),
        (ratio, efficiency) in (1.5..8.0, 0.4..0.95),
        input in random::input()
    ) {
        let mut machine = machine;
        let motor = &mut machine.drives[0].motor;
        (motor.rotor_inertia, motor.gear_ratio, motor.gear_efficiency) = (rotor, ratio, efficiency);
        let experiment = experiment(&input, 0.2, 1e-3);
        for (machine, solver, allowed) in [
            (machine.clone(), Solver::Exact, 1e-10),
            (common::with_stribeck(machine), Solver::General { tolerance: 1e-11 }, 1e-9),
        ] {
            let direct = without_gear(&machine);
            let difference = apart(&machine, &run(&machine, &experiment, solver), &run(&direct, &experiment, solver));
            prop_assert!(difference < allowed, "{solver:?}: {difference:e} m");
        }
    }
}

const LAWS: [Law; 4] = [
    Law::Stribeck { velocity: 0.05, shape: Shape::Gaussian },
    Law::Stribeck { velocity: 0.05, shape: Shape::Exponential },
    Law::Smooth { breakaway_velocity: 0.01 },
    Law::LuGre { stiffness: 1e5, damping: 190.0, velocity: 0.05 },
];

/// A law of the cart at the rim of a pulley of radius `r`.
fn at_the_rim(law: Law, r: f64) -> Law {
    match law {
        Law::Coulomb => law,
        Law::Stribeck { velocity, shape } => Law::Stribeck { velocity: velocity / r, shape },
        Law::Smooth { breakaway_velocity } => Law::Smooth { breakaway_velocity: breakaway_velocity / r },
        Law::LuGre { stiffness, damping, velocity } => {
            Law::LuGre { stiffness: stiffness * r * r, damping: damping * r * r * 0.1, velocity: velocity / r }
        }
    }
}

/// The machine of Table 4 with breakaway 30 % above Coulomb friction and this law on all three bodies.
fn stage_of(law: Law) -> Machine {
    let r = 0.0194;
    let pulley = Friction::with_breakaway(0.0016, 0.015, 0.0195).following(at_the_rim(law, r));
    let cart = Friction::with_breakaway(19.0424, 0.2, 0.26).following(law);
    common::paper_stage([1.3276e5, 1.3276e5, 5.8885e4], 6.3e-5, pulley, cart)
}

/// The same machine with a belt of 0.3 m, 0.4 m and 0.7 m whose spans follow the cart.
fn following(law: Law) -> Machine {
    let make = BeltMake { modulus: 8.335e9, section: 5.5626e-6, spans: [0.3, 0.4, 0.7].into() };
    let mut machine = stage_of(law);
    machine.belt.stiffness = make.stiffness();
    (machine.belt.make, machine.belt.follows_cart) = (Some(make), true);
    machine.cart.travel = Some(Travel { min: -0.2, max: 0.25, stop: None });
    machine
}

fn pulse() -> Signal {
    Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }
}

/// Power in = power stored in motion + power into spans and friction, integrated along the columns of the result.
#[test]
fn power_is_balanced_under_every_law() {
    for law in LAWS {
        for mut machine in [stage_of(law), following(law)] {
            machine.cart.along = Polyline::new(vec![[0.0, 1.0], [0.05, 1.5], [0.1, 0.8]]);
            let every = 1e-5;
            let solution = run(&machine, &experiment(&pulse(), 0.4, every), Solver::General { tolerance: 1e-12 });
            let column = |name: &str| solution.trajectory.get(name).unwrap();
            let r = machine.pulley_radius;
            let [w1, v, w3] = ["drive_speed", "cart_speed", "idler_speed"].map(column);
            let [f1, f2, f3] = ["span1_force", "span2_force", "span3_force"].map(column);
            let [t1, f, t3] = ["drive_friction", "cart_friction", "idler_friction"].map(column);
            let i = column("motor_current");
            let power = |k: usize| {
                let spans = f1[k] * (r * w1[k] - v[k]) + f2[k] * (v[k] - r * w3[k]) + f3[k] * r * (w3[k] - w1[k]);
                0.023 * i[k] * w1[k] - spans - t1[k] * w1[k] - f[k] * v[k] - t3[k] * w3[k]
            };
            let kinetic = |k: usize| 0.5 * (6.3e-5 * (w1[k] * w1[k] + w3[k] * w3[k]) + 0.362 * v[k] * v[k]);
            let rows = solution.trajectory.len();
            let (mut worst, mut most): (f64, f64) = (0.0, 0.0);
            for k in (0..rows - 2).step_by(2) {
                // Simpson's rule, away from what jumps.
                let (from, to) = (every * k as f64 - every, every * (k + 3) as f64);
                let jumps = solution.outcome.events.iter().map(|event| event.time).chain([0.0, 0.25]);
                if jumps.into_iter().any(|time| from <= time && time <= to) {
                    continue;
                }
                let work = every / 3.0 * (power(k) + 4.0 * power(k + 1) + power(k + 2));
                worst = worst.max((kinetic(k + 2) - kinetic(k) - work).abs() / (2.0 * every));
                most = most.max(power(k).abs());
            }
            // A LuGre bristle is as stiff as σ₀ |v| / g and bends within a few rows after the start.
            let allowed = if matches!(law, Law::LuGre { .. } | Law::Smooth { .. }) { 1e-4 } else { 1e-7 };
            println!("{law:?}: off by {worst:.1e} W of {most:.1e} W");
            assert!(worst < allowed * most, "{law:?}: off by {worst:e} W of {most:e} W");
        }
    }
}

/// The equations written down a second time, and Runge and Kutta's formula with a step of 1 µs that is halved down to
/// each event.
mod plain {
    use super::Shape;

    pub struct Plain {
        pub shape: Shape,
        pub follows: bool,
        pub k: [f64; 3],
    }

    type State = [f64; 6];
    const J: [f64; 3] = [6.3e-5, 0.362, 6.3e-5];
    const R: f64 = 0.0194;

    impl Plain {
        fn loads(&self, y: &State, u: f64) -> [f64; 3] {
            let ea = 8.335e9 * 5.5626e-6;
            let (k1, k2) = if self.follows { (ea / (0.3 - y[2]), ea / (0.4 + y[2])) } else { (self.k[0], self.k[1]) };
            let f1 = k1 * (R * y[0] - y[2]);
            let f2 = k2 * (y[2] - R * y[4]);
            let f3 = self.k[2] * (R * y[4] - R * y[0]);
            [0.023 * (u - 0.023 * y[1]) / 0.71 - R * f1 + R * f3, f1 - f2, R * f2 - R * f3]
        }

        fn rate(&self, y: &State, u: f64, mode: [f64; 3]) -> State {
            let load = self.loads(y, u);
            let mut rate = [0.0; 6];
            for j in 0..3 {
                let (b, fc, vs) = if j == 1 { (19.0424, 0.2, 0.05) } else { (0.0016, 0.015, 0.05 / R) };
                let v = y[2 * j + 1];
                if mode[j] != 0.0 {
                    let q = mode[j] * v / vs;
                    let left = if self.shape == Shape::Gaussian { (-q * q).exp() } else { (-q).exp() };
                    rate[2 * j] = v;
                    rate[2 * j + 1] = (load[j] - b * v - mode[j] * (fc + 0.3 * fc * left)) / J[j];
                }
            }
            rate
        }

        fn step(&self, y: &State, u: f64, mode: [f64; 3], h: f64) -> State {
            let add = |y: &State, k: &State, h: f64| -> State { std::array::from_fn(|j| y[j] + h * k[j]) };
            let k1 = self.rate(y, u, mode);
            let k2 = self.rate(&add(y, &k1, h / 2.0), u, mode);
            let k3 = self.rate(&add(y, &k2, h / 2.0), u, mode);
            let k4 = self.rate(&add(y, &k3, h), u, mode);
            std::array::from_fn(|j| y[j] + h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]))
        }

        /// The body whose condition does not hold, and what it does instead.
        fn violated(&self, y: &State, u: f64, mode: [f64; 3]) -> Option<(usize, f64)> {
            let load = self.loads(y, u);
            (0..3).find_map(|j| {
                let holds = 1.3 * if j == 1 { 0.2 } else { 0.015 };
                match mode[j] {
                    0.0 if load[j].abs() > holds => Some((j, load[j].signum())),
                    s if s * y[2 * j + 1] < 0.0 => {
                        Some((j, if load[j].abs() > holds { load[j].signum() } else { 0.0 }))
                    }
                    _ => None,
                }
            })
        }

        /// Rows every millisecond of the answer to 5 V for 0.25 s.
        pub fn run(&self, rows: usize) -> Vec<State> {
            let (mut y, mut mode, h) = ([0.0; 6], [0.0; 3], 1e-6);
            let mut out = vec![y];
            for row in 1..rows {
                let u = if row <= 250 { 5.0 } else { 0.0 };
                for _ in 0..1000 {
                    let mut left = h;
                    while let Some((body, to)) = self.violated(&y, u, mode) {
                        mode[body] = to;
                        y[2 * body + 1] = 0.0;
                    }
                    while left > 0.0 {
                        let next = self.step(&y, u, mode, left);
                        if self.violated(&next, u, mode).is_none() {
                            (y, left) = (next, 0.0);
                            continue;
                        }
                        let (mut low, mut high) = (0.0, left);
                        for _ in 0..60 {
                            let middle = 0.5 * (low + high);
                            let there = self.step(&y, u, mode, middle);
                            if self.violated(&there, u, mode).is_some() { high = middle } else { low = middle }
                        }
                        y = self.step(&y, u, mode, high);
                        left -= high;
                        if let Some((body, to)) = self.violated(&y, u, mode) {
                            if mode[body] != 0.0 {
                                y[2 * body + 1] = 0.0;
                            }
                            mode[body] = to;
                        }
                    }
                }
                out.push(y);
            }
            out
        }
    }
}

#[test]
fn stribeck_as_a_plain_integration_has_it() {
    for shape in [Shape::Gaussian, Shape::Exponential] {
        for follows in [false, true] {
            let law = Law::Stribeck { velocity: 0.05, shape };
            let machine = if follows { following(law) } else { stage_of(law) };
            let solution = run(&machine, &experiment(&pulse(), 0.4, 1e-3), Solver::General { tolerance: 1e-12 });
            let want = plain::Plain { shape, follows, k: machine.belt.stiffness.three() }.run(401);
            let columns = ["drive_angle", "drive_speed", "cart_position", "cart_speed", "idler_angle", "idler_speed"];
            for (j, (name, tolerance)) in columns.into_iter().zip([5e-9, 1e-5, 1e-10, 1e-7, 5e-9, 1e-5]).enumerate() {
                let got = solution.trajectory.get(name).unwrap();
                let worst = got.iter().zip(&want).map(|(a, row)| (a - row[j]).abs()).fold(0.0, f64::max);
                println!("{shape:?}, follows {follows}: {name} {worst:.1e}");
                assert!(worst < tolerance, "{shape:?}, follows {follows}: {name} differs by {worst:e}");
            }
        }
    }
}

/// A tighter tolerance changes little, under every law.
#[test]
fn every_law_converges() {
    for law in LAWS {
        for machine in [stage_of(law), following(law)] {
            let experiment = experiment(&pulse(), 1.0, 1e-3);
            let tight = run(&machine, &experiment, Solver::General { tolerance: 1e-13 });
            let usual = run(&machine, &experiment, Solver::GENERAL);
            let loose = run(&machine, &experiment, Solver::General { tolerance: 1e-6 });
            let (near, far) = (apart(&machine, &usual, &tight), apart(&machine, &loose, &tight));
            println!("{law:?}: {near:.1e} m, {far:.1e} m, {:?}", usual.outcome.cost);
            assert!(near < 1e-10 && far < 1e-7, "{law:?}: {near:e} m and {far:e} m");
            assert_eq!(usual.outcome.events.len(), tight.outcome.events.len());
            for (a, b) in usual.outcome.events.iter().zip(&tight.outcome.events) {
                assert!(a.part == b.part && a.to == b.to && (a.time - b.time).abs() < 1e-6, "{a:?} and {b:?}");
            }
        }
    }
}

#[test]
fn a_factor_along_the_travel_is_coulomb_friction_times_it() {
    let mut machine = common::table4();
    let twice = experiment(&pulse(), 0.5, 1e-3);
    machine.cart.along = Polyline::new(vec![[0.0, 2.0], [0.1, 2.0]]);
    let along = run(&machine, &twice, Solver::GENERAL);
    machine.cart = taut::machine::Slide { friction: Friction::symmetric(19.0424, 0.4), along: None, ..machine.cart };
    let exact = run(&machine, &twice, Solver::Exact);
    assert!(apart(&machine, &along, &exact) < 1e-10);
    let friction = |s: &Solution| s.trajectory.get("cart_friction").unwrap().to_vec();
    for (a, b) in friction(&along).iter().zip(friction(&exact)) {
        assert!((a - b).abs() < 1e-5, "{a} and {b}");
    }
}

/// Below breakaway a LuGre cart is a spring: deflection load / σ₀, and it goes back.
#[test]
fn bristles_hold_like_springs() {
    let mut machine = stage_of(Law::LuGre { stiffness: 1e5, damping: 190.0, velocity: 0.05 });
    machine.drives[0].amplifier.mode = taut::machine::AmplifierMode::Current;
    // 0.2 mN m of 15: far from slipping.
    let input = Signal::Pulse { value: 0.0002 / 0.023, duration: 0.5, at: 0.0 };
    let solution = run(&machine, &experiment(&input, 1.0, 1e-3), Solver::GENERAL);
    let at = |name: &str, row: usize| solution.trajectory.get(name).unwrap()[row];
    let r = machine.pulley_radius;
    let held = 1e5 * (r * at("drive_bristle", 490) + at("cart_bristle", 490) + r * at("idler_bristle", 490));
    assert!((held - 0.0002 / r).abs() < 1e-4 * held, "{held}");
    assert!((at("cart_friction", 490) - 1e5 * at("cart_bristle", 490)).abs() < 1e-6);
    assert!(at("cart_position", 490) > 1e-9 && at("cart_position", 490) < 1e-7);
    let (there, back) = (at("cart_position", 490), at("cart_position", 1000));
    assert!(back.abs() < 0.1 * there, "{there:e} {back:e}");
    assert!(solution.outcome.events.is_empty());
}

/// The exact solver once called this too many events: having left its travel, the cart left it a hundred times more.
#[test]
fn the_cart_ends_the_run_where_its_travel_ends() {
    let mut fixed = common::table4();
    fixed.cart.travel = Some(Travel { min: -0.2, max: 0.05, stop: None });
    let mut follows = following(Law::Coulomb);
    follows.cart.travel = fixed.cart.travel;
    for (machine, solver) in [(&fixed, Solver::Exact), (&fixed, Solver::GENERAL), (&follows, Solver::GENERAL)] {
        let solution = simulate(machine, &experiment(&pulse(), 1.0, 1e-3), solver).unwrap();
        let Ending::LeftTravel { time } = solution.outcome.ending else { panic!("{:?}", solution.outcome.ending) };
        let x = solution.trajectory.get("cart_position").unwrap();
        assert!(x.iter().all(|x| *x <= 0.05) && x[x.len() - 1] > 0.049 && (time * 1e3) as usize + 1 == x.len());
    }
}

#[test]
fn the_exact_solver_says_what_it_cannot_take() {
    let refused = |machine: &Machine| {
        simulate(machine, &experiment(&pulse(), 1.0, 1e-3), Solver::Exact).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(&stage_of(LAWS[0])).starts_with("the friction law of the drive pulley is not linear"));
    assert!(refused(&following(Law::Coulomb)).starts_with("the belt's spans follow the cart"));
    assert_eq!(Solver::for_machine(&stage_of(LAWS[3])), Solver::GENERAL);
    assert_eq!(Solver::for_machine(&common::table4()), Solver::Exact);
}

/// The method of Runge and Kutta on the rates for another integrator goes where a run goes: a motor with inductance,
/// a constant force on the cart, and bristles or no dry friction.
#[test]
fn another_integrator_goes_where_a_run_goes() {
    let (h, steps, volts) = (1e-5, 2000, 5.0);
    for mut machine in [common::without_dry_friction(common::table4()), stage_of(LAWS[3])] {
        machine.drives[0].motor.inductance = 1e-3;
        machine.cart.load = 0.3;
        let input = Signal::Step { value: volts, at: 0.0 };
        let solution =
            run(&machine, &experiment(&input, h * f64::from(steps), 1e-3), Solver::General { tolerance: 1e-11 });
        let mut dynamics = Dynamics::new(&machine.mechanism(), &State::default()).unwrap();
        let mut y = vec![0.0; dynamics.quantities().len()];
        for step in 0..steps {
            common::runge_kutta(&mut y, h, |values| {
                let mut rates = vec![0.0; values.len()];
                dynamics.put(h * f64::from(step), values, &[volts, 0.0, 0.0]);
                dynamics.settle(&mut Vec::new()).unwrap();
                dynamics.rates(&mut rates);
                rates
            });
        }
        let place = dynamics.quantities().iter().position(|quantity| *quantity == Quantity::Position(CART)).unwrap();
        let cart = *solution.trajectory.get("cart_position").unwrap().last().unwrap();
        assert!(cart > 1e-4 && (y[place] - cart).abs() < 1e-9, "{} and {cart}", y[place]);
    }
}

/// Equations for another integrator counted no events: one that changed an input again and again filled the memory of
/// whoever kept them.
#[test]
fn events_of_equations_for_another_integrator_are_bounded() {
    let mut machine = common::table4();
    machine.drives[0].amplifier.voltage_limit = Some(7.0);
    let mut dynamics = Dynamics::new(&machine.mechanism(), &State::default()).unwrap();
    let values = vec![0.0; dynamics.quantities().len()];
    let mut events = Vec::new();
    let mut count = 0;
    let ending = (0..200_000_u32).find_map(|k| {
        let volts = if k % 2 == 0 { 12.0 } else { -12.0 };
        dynamics.put(1e-9 * f64::from(k), &values, &[volts, 0.0, 0.0]);
        let ending = dynamics.settle(&mut events).err();
        count += events.len();
        events.clear();
        ending
    });
    assert!(matches!(ending, Some(Ending::TooManyEvents { .. })), "{ending:?} after {count} events");
    // 1e5, and 1e7 a second more.
    assert!((100_000..110_000).contains(&count), "{count}");
}

/// The same of a run: a limit that each edge of a fast square wave meets.
#[test]
fn events_of_a_run_are_bounded_as_those_of_the_exact_solver() {
    let mut machine = common::table4();
    machine.drives[0].amplifier.voltage_limit = Some(7.0);
    let square = Signal::Square { amplitude: 12.0, frequency: 1e8, duty: 0.5 };
    for solver in [Solver::Exact, Solver::GENERAL] {
        let outcome = simulate(&machine, &experiment(&square, 0.002, 1e-3), solver).unwrap().outcome;
        assert!(matches!(outcome.ending, Ending::TooManyEvents { .. }), "{:?}", outcome.ending);
        assert!((100_000..130_000).contains(&outcome.events.len()), "{}", outcome.events.len());
    }
}
