//! Bodies that a reduced belt makes one, each with a friction law of its own: against the written-out equation, a stiff
//! belt, and laws.
//!
//! Bodies that move as one have one speed: sliding friction adds up, each law's at its own speed ρ v, and so do
//! breakaways, bristles and what never sticks. [`Written`] has that in one line per body and a Runge-Kutta formula of
//! its own.

use crate::common;

use common::{random, table4};
use proptest::prelude::*;
use taut::case::{Case, Experiment};
use taut::friction::{Friction, Law, Shape, Side};
use taut::linear::{Operation, StateSpace};
use taut::machine::{BeltModel, Machine};
use taut::polyline::Polyline;
use taut::signal::Signal;
use taut::solve::{Ending, Solution, Solver, simulate};

const AXIS: &str = r#"
[motor]
torque_constant = 0.05
back_emf_constant = 0.05
resistance = 1
gear_ratio = 5
[drive_pulley]
radius = 0.02
inertia = 6e-5
friction = { coulomb = 0 }
[idler_pulley]
inertia = 9e-5
friction = { coulomb = 0 }
[cart]
mass = 0.8
friction = { viscous = 4 }
[belt]
stiffness = [2e4, 3e4, 1.5e4]
damping = [20, 20, 10]
[[experiment]]
name = "there"
input = { square = 6, frequency = 4 }
until = 0.5
every = 1e-3
"#;

fn axis() -> Machine {
    Case::from_text("axis.toml", AXIS).unwrap().machine
}

fn run(machine: &Machine, input: &Signal, until: f64, tolerance: f64) -> Solution {
    let experiment = common::experiment(input.clone(), until);
    let solution =
        simulate(machine, &experiment, Solver::General { tolerance }).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

fn wave(amplitude: f64, frequency: f64) -> Signal {
    Signal::Square { amplitude, frequency, duty: 0.5 }
}

fn column<'a>(solution: &'a Solution, name: &str) -> &'a [f64] {
    solution.trajectory.get(name).unwrap_or_else(|| panic!("no column {name}"))
}

fn apart(a: &Solution, b: &Solution, name: &str) -> f64 {
    column(a, name).iter().zip(column(b, name)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// One of the bodies that move together: its law at its own speed, ρ times that of what leads.
#[derive(Clone)]
struct Member {
    friction: Friction,
    ratio: f64,
    along: Option<Polyline>,
}

impl Member {
    fn factor(&self, way: f64) -> f64 {
        self.along.as_ref().map_or(1.0, |along| along.value(way))
    }

    fn never_sticks(&self) -> bool {
        matches!(self.friction.law, Law::Smooth { .. } | Law::LuGre { .. })
    }

    /// Its friction while it goes this way at `v`, and ż.
    fn sliding(&self, forward: bool, v: f64, way: f64, z: f64) -> (f64, f64) {
        let (v, side) = (self.ratio * v, if forward { self.friction.forward } else { self.friction.backward });
        let (sign, s) = if forward { (1.0, v) } else { (-1.0, -v) };
        let (c, above, a) = (side.coulomb, side.breakaway - side.coulomb, self.factor(way));
        let (friction, rate) = match self.friction.law {
            Law::Coulomb => (sign * a * c, 0.0),
            Law::Stribeck { velocity, shape: Shape::Gaussian } => {
                (sign * a * (c + above * (-(s / velocity).powi(2)).exp()), 0.0)
            }
            Law::Stribeck { velocity, .. } => (sign * a * (c + above * (-s / velocity).exp()), 0.0),
            Law::Smooth { breakaway_velocity: b } => {
                let q = s / (2.0_f64.sqrt() * b);
                let peak = (2.0 * std::f64::consts::E).sqrt() * above * (-q * q).exp() * q;
                (sign * a * (peak + c * (10.0 * s / b).tanh()), 0.0)
            }
            Law::LuGre { stiffness, damping, velocity } => {
                let g = a * (c + above * (-(s / velocity).powi(2)).exp());
                let rate = v - stiffness * s * z / g;
                (stiffness * z + damping * rate, rate)
            }
        };
        (self.ratio * (friction + side.viscous * v), rate)
    }

    /// Its breakaway at rest, and the force of its bristles.
    fn breakaway(&self, forward: bool, way: f64) -> f64 {
        let side = if forward { self.friction.forward } else { self.friction.backward };
        if self.never_sticks() { 0.0 } else { self.ratio * self.factor(way) * side.breakaway }
    }

    fn bristle_force(&self, z: f64) -> f64 {
        match self.friction.law {
            Law::LuGre { stiffness, .. } => self.ratio * stiffness * z,
            _ => 0.0,
        }
    }
}

/// Bodies that move as one.
#[derive(Clone)]
struct Group {
    mass: f64,
    members: Vec<Member>,
    /// 1 forward, −1 backward, 0 held.
    motion: f64,
}

/// A machine of one or two such groups, the second on a spring: what a reduced belt leaves.
#[derive(Clone)]
struct Written {
    groups: Vec<Group>,
    /// Way at the belt of each group per way of what leads it; stiffness and damping between the two.
    lever: [f64; 2],
    spring: [f64; 2],
    /// n K_t/R, n K_e, and the part of it that the gear passes, on the first group, per way of the first group.
    motor: [f64; 3],
}

/// Ways, speeds, and three bristles.
type Vector = [f64; 7];

impl Written {
    fn new(machine: &Machine) -> Self {
        let r = machine.pulley_radius;
        let member = |friction: Friction, ratio: f64| Member { friction, ratio, along: None };
        let cart = Member { along: machine.cart.along.clone(), ..member(machine.cart.friction, 1.0) };
        let motor = &machine.drives[0].motor;
        let n = motor.gear_ratio;
        let pulleys = machine.drive_pulley.inertia + machine.idler_pulley.inertia;
        let whole = |lever: f64| {
            [
                n * motor.torque_constant / motor.resistance * lever,
                n * motor.back_emf_constant * lever,
                motor.gear_efficiency,
            ]
        };
        let group = |mass: f64, members: Vec<Member>| Group { mass, members, motion: 0.0 };
        let [drive, idler] = [machine.drive_pulley.friction, machine.idler_pulley.friction];
        let [k, c] = [machine.belt.stiffness, machine.belt.damping];
        match machine.belt.model {
            BeltModel::Rigid => Self {
                groups: vec![group(
                    machine.cart.mass + pulleys / (r * r),
                    vec![member(drive, 1.0 / r), cart, member(idler, 1.0 / r)],
                )],
                lever: [1.0, 1.0],
                spring: [0.0; 2],
                motor: whole(1.0 / r),
            },
            BeltModel::TwoMass => Self {
                groups: vec![
                    group(pulleys, vec![member(drive, 1.0), member(idler, 1.0)]),
                    group(machine.cart.mass, vec![cart]),
                ],
                lever: [r, 1.0],
                spring: [
                    k[0] + k[1] * k[2] / (k[1] + k[2]),
                    c[0] + (c[1] * k[2] * k[2] + c[2] * k[1] * k[1]) / (k[1] + k[2]).powi(2),
                ],
                motor: whole(1.0),
            },
            BeltModel::Elastic => panic!("nothing moves as one"),
        }
    }

    fn index(&self, group: usize, member: usize) -> usize {
        4 + if group == 0 { member } else { self.groups[0].members.len() + member }
    }

    /// All but friction on a group that goes, or is about to go, this way.
    fn load(&self, group: usize, forward: bool, y: &Vector, volts: f64) -> f64 {
        let sign = [1.0, -1.0][group];
        let stretch = self.lever[0] * y[0] - self.lever[1] * y[1];
        let rate = self.lever[0] * y[2] - self.lever[1] * y[3];
        let spring = if self.groups.len() > 1 { self.spring[0] * stretch + self.spring[1] * rate } else { 0.0 };
        let torque = match group {
            0 => {
                let torque = self.motor[0] * (volts - self.motor[1] * y[2]);
                let eta = self.motor[2];
                torque * if forward == (torque >= 0.0) { eta } else { 1.0 / eta }
            }
            _ => 0.0,
        };
        torque - sign * self.lever[group] * spring
    }

    fn rate(&self, y: &Vector, volts: f64) -> Vector {
        let mut rate = [0.0; 7];
        for (g, group) in self.groups.iter().enumerate() {
            if group.motion == 0.0 {
                continue;
            }
            let forward = group.motion > 0.0;
            let mut force = self.load(g, forward, y, volts);
            for (m, member) in group.members.iter().enumerate() {
                let place = self.index(g, m);
                let (friction, bristle) = member.sliding(forward, y[2 + g], y[g], y[place]);
                force -= friction;
                rate[place] = bristle;
            }
            (rate[g], rate[2 + g]) = (y[2 + g], force / group.mass);
        }
        rate
    }

    fn step(&self, y: &Vector, volts: f64, h: f64) -> Vector {
        let add = |k: &Vector, h: f64| -> Vector { std::array::from_fn(|j| y[j] + h * k[j]) };
        let k1 = self.rate(y, volts);
        let k2 = self.rate(&add(&k1, 0.5 * h), volts);
        let k3 = self.rate(&add(&k2, 0.5 * h), volts);
        let k4 = self.rate(&add(&k3, h), volts);
        std::array::from_fn(|j| y[j] + h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]))
    }

    /// By how much the load on a group at rest falls short of what holds it, either way.
    fn holds(&self, g: usize, y: &Vector, volts: f64) -> [f64; 2] {
        let group = &self.groups[g];
        let members = || group.members.iter().enumerate();
        let bristles: f64 = members().map(|(m, member)| member.bristle_force(y[self.index(g, m)])).sum();
        let holds = |forward: bool| group.members.iter().map(|member| member.breakaway(forward, y[g])).sum::<f64>();
        [holds(true) - self.load(g, true, y, volts) + bristles, holds(false) + self.load(g, false, y, volts) - bristles]
    }

    /// Decides what a group at rest does now.
    fn decide(&mut self, g: usize, y: &Vector, volts: f64) {
        let [forward, backward] = self.holds(g, y, volts);
        // A load that just reaches what holds moves nothing; rounding is no load.
        self.groups[g].motion = if forward < -1e-12 {
            1.0
        } else if backward < -1e-12 {
            -1.0
        } else {
            0.0
        };
    }

    /// Whether something has happened on the way to `y`: a group that slides has turned, one at rest is held no more.
    fn over(&self, y: &Vector, volts: f64) -> Option<usize> {
        (0..self.groups.len()).find(|&g| match self.groups[g].motion {
            0.0 => self.holds(g, y, volts).iter().any(|left| *left < -1e-12),
            way => way * y[2 + g] < 0.0,
        })
    }

    /// Ways and bristles every millisecond.
    fn rows(&mut self, input: &Signal, until: f64, h: f64) -> Vec<Vector> {
        let mut y = [0.0; 7];
        let mut rows = vec![y];
        for row in 0..(until * 1e3).round() as usize {
            let volts = input.value((row as f64 + 0.5) * 1e-3);
            (0..self.groups.len())
                .filter(|&g| y[2 + g] == 0.0)
                .collect::<Vec<_>>()
                .into_iter()
                .for_each(|g| self.decide(g, &y, volts));
            let mut left = 1e-3;
            while left > 1e-15 {
                let step = f64::min(h, left);
                let next = self.step(&y, volts, step);
                let Some(_) = self.over(&next, volts) else {
                    (y, left) = (next, left - step);
                    continue;
                };
                // Where it happens, by halving.
                let (mut before, mut after) = (0.0, step);
                for _ in 0..60 {
                    let middle = 0.5 * (before + after);
                    match self.over(&self.step(&y, volts, middle), volts) {
                        Some(_) => after = middle,
                        None => before = middle,
                    }
                }
                y = self.step(&y, volts, after);
                let group = self.over(&y, volts).unwrap();
                left -= after;
                y[2 + group] = 0.0;
                self.decide(group, &y, volts);
            }
            rows.push(y);
        }
        rows
    }
}

/// The largest difference at the belt between a run and the written-out equation, m.
fn against_the_equation(machine: &Machine, input: &Signal, until: f64) -> f64 {
    let solution = run(machine, input, until, 1e-11);
    let mut written = Written::new(machine);
    let rows = written.rows(input, until, 2e-6);
    let (drive, cart) = (column(&solution, "drive_angle"), column(&solution, "cart_position"));
    let r = machine.pulley_radius;
    let rigid = machine.belt.model == BeltModel::Rigid;
    let mut worst: f64 = 0.0;
    for (row, y) in rows.iter().enumerate() {
        let (of_drive, of_cart) = if rigid { (y[0], y[0]) } else { (r * y[0], y[1]) };
        worst = worst.max((r * drive[row] - of_drive).abs()).max((cart[row] - of_cart).abs());
    }
    worst
}

/// Friction of a body whose ways are `r` at the belt (1 of the cart), of sizes that fit a force there.
fn friction(r: f64) -> impl Strategy<Value = Friction> {
    let side = move || {
        (0.0..6.0_f64, 0.1..1.0_f64, 1.0..1.6_f64).prop_map(move |(viscous, coulomb, above)| Side {
            viscous: viscous * r * r,
            coulomb: coulomb * r,
            breakaway: coulomb * above * r,
        })
    };
    let velocity = move || (0.02..0.1_f64).prop_map(move |v| v / r);
    let law = prop_oneof![
        Just(Law::Coulomb),
        velocity().prop_map(|velocity| Law::Stribeck { velocity, shape: Shape::Gaussian }),
        velocity().prop_map(|velocity| Law::Stribeck { velocity, shape: Shape::Exponential }),
        velocity().prop_map(|v| Law::Smooth { breakaway_velocity: v }),
        (velocity(), 3e3..3e4_f64, 5.0..60.0_f64).prop_map(move |(velocity, k, c)| Law::LuGre {
            stiffness: k * r * r,
            damping: c * r * r,
            velocity
        }),
    ];
    let sided = (side(), side(), law, any::<bool>()).prop_map(|(forward, backward, law, even)| Friction {
        forward,
        backward: if even { forward } else { backward },
        law,
    });
    let straight = (0.0..6.0_f64).prop_map(move |viscous| Friction::symmetric(viscous * r * r, 0.0));
    prop_oneof![6 => sided.boxed(), 1 => straight.boxed()]
}

/// Machines whose belt makes bodies one, each with a law of its own, most of them curved.
fn merged() -> impl Strategy<Value = Machine> {
    let r = 0.02;
    let along = prop::option::weighted(0.3, (0.5..2.0_f64, 0.5..2.0_f64));
    let gear = prop_oneof![3 => Just(1.0), 1 => 0.5..0.95_f64];
    (friction(r), friction(1.0), friction(r), any::<bool>(), along, gear, 0.3..2.0_f64).prop_map(
        |(drive, cart, idler, rigid, along, gear, mass)| {
            let mut machine = axis();
            (machine.drive_pulley.friction, machine.cart.friction, machine.idler_pulley.friction) =
                (drive, cart, idler);
            machine.cart.mass = mass;
            machine.belt.model = if rigid { BeltModel::Rigid } else { BeltModel::TwoMass };
            machine.cart.along = along.and_then(|(a, b)| Polyline::new(vec![[-0.02, a], [0.0, 1.0], [0.03, b]]));
            machine.drives[0].motor.gear_efficiency = gear;
            machine
        },
    )
}

fn square() -> impl Strategy<Value = Signal> {
    // Edges fall on whole milliseconds.
    (1.0..8.0_f64, prop_oneof![Just(10.0), Just(20.0), Just(25.0)])
        .prop_map(|(amplitude, frequency)| wave(amplitude, frequency))
}

proptest! {
    #![proptest_config(random::cases(200))]

    #[test]
    fn laws_add_up_as_the_written_out_equation_has_it(machine in merged(), input in square()) {
        let off = against_the_equation(&machine, &input, 0.15);
        prop_assert!(off < 2e-9, "{off:e} m");
    }

    /// A stage that goes forward with the input goes backward with its opposite, if the laws are turned round.
    #[test]
    fn a_mirror_image_moves_as_its_image(machine in merged(), input in square()) {
        let mut image = machine.clone();
        let turned = |friction: Friction| Friction { forward: friction.backward, backward: friction.forward, ..friction };
        image.drive_pulley.friction = turned(machine.drive_pulley.friction);
        image.cart.friction = turned(machine.cart.friction);
        image.idler_pulley.friction = turned(machine.idler_pulley.friction);
        image.cart.along = machine.cart.along.as_ref().and_then(|along| {
            Polyline::new(along.points().iter().rev().map(|[x, factor]| [-x, *factor]).collect())
        });
        let Signal::Square { amplitude, frequency, .. } = input else { panic!() };
        let opposite = wave(-amplitude, frequency);
        let (a, b) = (run(&machine, &input, 0.15, 1e-11), run(&image, &opposite, 0.15, 1e-11));
        for (a, b) in column(&a, "cart_position").iter().zip(column(&b, "cart_position")) {
            prop_assert!((a + b).abs() < 1e-10, "{a} {b}");
        }
    }

    /// The motor's work less that of friction is the machine's energy: M v²/2 = ∫ (K i − F_f) v dt with friction as the
    /// column has it.
    #[test]
    fn power_is_balanced(machine in merged(), input in square()) {
        let mut machine = machine;
        machine.belt.model = BeltModel::Rigid;
        machine.drives[0].motor.gear_efficiency = 1.0;
        let experiment = Experiment { every: 2e-6, ..common::experiment(input.clone(), 0.08) };
        let solution = simulate(&machine, &experiment, Solver::General { tolerance: 1e-10 }).unwrap();
        let [current, speed, friction] = ["motor_current", "cart_speed", "cart_friction"].map(|name| column(&solution, name));
        let (r, motor) = (machine.pulley_radius, &machine.drives[0].motor);
        let mass = machine.cart.mass + (machine.drive_pulley.inertia + machine.idler_pulley.inertia) / (r * r);
        let power = |row: usize| (motor.gear_ratio * motor.torque_constant / r * current[row] - friction[row]) * speed[row];
        let (mut work, mut moved) = (0.0, 0.0);
        let Signal::Square { frequency, .. } = input else { panic!() };
        let edge = (0.5 / frequency / 2e-6).round() as usize;
        for row in 1..speed.len() {
            // A row on an edge shows what comes after it.
            let end = if row % edge == 0 { 2.0 * power(row - 1) - power(row - 2) } else { power(row) };
            work += 1e-6 * (power(row - 1) + end);
            moved += 1e-6 * (friction[row] * speed[row]).abs();
            let stored = 0.5 * mass * speed[row] * speed[row];
            prop_assert!((stored - work).abs() <= 1e-5 * (moved + stored) + 1e-9, "row {row}: {stored} {work} {moved}");
        }
    }
}

/// One of each law, so that each kind meets each other.
fn of_all_kinds() -> Machine {
    let mut machine = axis();
    let r = machine.pulley_radius;
    machine.drive_pulley.friction = Friction::with_breakaway(2.0 * r * r, 0.4 * r, 0.6 * r)
        .following(Law::Stribeck { velocity: 0.05 / r, shape: Shape::Gaussian });
    machine.cart.friction =
        Friction::with_breakaway(3.0, 0.5, 0.7).following(Law::LuGre { stiffness: 1e4, damping: 30.0, velocity: 0.05 });
    machine.idler_pulley.friction = Friction::with_breakaway(r * r, 0.3 * r, 0.4 * r);
    machine
}

/// The stiffer the belt, the nearer the elastic machine is to the rigid one, whatever law each body has.
#[test]
fn a_stiff_belt_tends_to_a_rigid_one() {
    let input = Signal::Pulse { value: 6.0, duration: 0.05, at: 0.0 };
    let mut rigid = of_all_kinds();
    rigid.belt.model = BeltModel::Rigid;
    let limit = run(&rigid, &input, 0.2, 1e-10);
    assert!(column(&limit, "cart_state").contains(&0.0) && column(&limit, "cart_state").contains(&1.0));
    let off = [1e5, 1e6, 1e7].map(|k| {
        let mut machine = of_all_kinds();
        machine.belt.stiffness = [k; 3].into();
        // As well damped at any stiffness
        machine.belt.damping = [0.15 * k.sqrt(); 3].into();
        apart(&limit, &run(&machine, &input, 0.2, 1e-10), "cart_position")
    });
    println!("{off:?}");
    assert!(off[0] < 1e-3 && off[1] < 0.2 * off[0] && off[2] < 0.2 * off[1], "{off:?}");
}

/// Three Coulomb laws, one of them written as a Stribeck curve that is flat, are the same machine for the exact solver
/// and the general one.
#[test]
fn a_flat_curve_is_coulomb_friction() {
    let input = wave(6.0, 10.0);
    for model in [BeltModel::Rigid, BeltModel::TwoMass] {
        let mut machine = axis();
        machine.belt.model = model;
        let r = machine.pulley_radius;
        machine.drive_pulley.friction = Friction::symmetric(1e-4, 0.4 * r);
        machine.cart.friction = Friction::symmetric(3.0, 0.5);
        machine.idler_pulley.friction = Friction::symmetric(0.0, 0.3 * r);
        let experiment = common::experiment(input.clone(), 0.2);
        let exact = simulate(&machine, &experiment, Solver::Exact).unwrap();
        machine.idler_pulley.friction.law = Law::Stribeck { velocity: 1.0, shape: Shape::Gaussian };
        let general = run(&machine, &input, 0.2, 1e-11);
        assert!(apart(&exact, &general, "cart_position") < 1e-10);
        assert_eq!(exact.outcome.events.len(), general.outcome.events.len());
    }
}

/// Linearised at rest on its bristles, a rigid machine has the slow poles of one with a very stiff belt; and each
/// body's bristles are a state.
#[test]
fn bristles_of_bodies_made_one_are_states_of_their_own() {
    let mut machine = of_all_kinds();
    let r = machine.pulley_radius;
    machine.drive_pulley.friction = Friction::with_breakaway(2.0 * r * r, 0.4 * r, 0.6 * r).following(Law::LuGre {
        stiffness: 3e3 * r * r,
        damping: 10.0 * r * r,
        velocity: 0.05 / r,
    });
    machine.idler_pulley.friction = Friction::symmetric(r * r, 0.0);
    let mut rigid = machine.clone();
    rigid.belt.model = BeltModel::Rigid;
    let rigid = StateSpace::new(&rigid, Operation::default()).unwrap();
    assert_eq!(rigid.states.iter().filter(|state| state.name.ends_with("bristle")).count(), 2);
    machine.belt.stiffness = [1e9; 3].into();
    let stiff = StateSpace::new(&machine, Operation::default()).unwrap();
    let (rigid, stiff) = (rigid.poles().unwrap(), stiff.poles().unwrap());
    for pole in rigid {
        let nearest = stiff.iter().map(|other| (other - pole).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-3 * (1.0 + pole.norm()), "{pole} is {nearest} off: {stiff:?}");
    }
}

/// r · (1/r) is 1 only but for rounding: a span between bodies that move as one must not be stretched by their motion.
#[test]
fn spans_between_bodies_that_move_as_one_have_no_arms() {
    let mut machine = table4();
    machine.belt.model = BeltModel::Rigid;
    for k in 0..2000 {
        machine.pulley_radius = 1e-3 * (1.0 + f64::from(k) * 0.1234567);
        let mechanism = machine.mechanism();
        for spring in 0..3 {
            let arms = mechanism.leading_arms(spring);
            assert!(arms.iter().all(|arm| *arm == 0.0), "r = {} m, span {spring}: {arms:?}", machine.pulley_radius);
        }
    }
}
