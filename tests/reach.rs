//! Needs of a reference, and the limits of the machine that they exceed; feed-forward at rest.

use crate::common;
use crate::common::chance::Chance;
use std::path::Path;
use taut::case::Case;
use taut::control::{Setup, closed_loop};
use taut::design::{Bounds, FeedForward, FeedForwardModel};
use taut::friction::Friction;
use taut::machine::axis::{CART, DRIVE, IDLER};
use taut::machine::rigid::{REST_ACCELERATION, REST_SPEED, Rigid};
use taut::machine::{AmplifierMode, BeltModel, Machine, Travel};
use taut::metrics::{Balance, balanced_speed};
use taut::number::engineering;
use taut::polyline::Polyline;
use taut::reach::compensation::{Compensation, direction};
use taut::reach::feasible::{loads, shortfalls};
use taut::signal::profile::{Leg, Limits, Profile, Reference};
use taut::signal::{Hold, Signal};
use taut::solve::{Solver, simulate};
use taut_core::calculator::Evaluation;

/// The bounds of a controller with this limit of its command.
fn commanded(command: Option<f64>) -> Bounds {
    Bounds { command, ..Bounds::default() }
}

/// Most that a reference needs of one of a machine's limits, counted from a pretension of zero.
fn needed(machine: &Machine, profile: &Profile, limit: &str) -> f64 {
    let mut machine = machine.clone();
    let amplifier = &mut machine.drives[0].amplifier;
    (amplifier.voltage_limit, amplifier.current_limit) = (Some(1e9), Some(1e9));
    machine.belt.sheet.allowed_tension = Some(1e9);
    machine.belt.pretension = Some(0.0);
    loads(&machine, Bounds::default(), std::slice::from_ref(profile))
        .iter()
        .find(|load| load.limit == limit)
        .unwrap()
        .needed
}

fn case() -> Case {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/sollmann-jouaneh/controllers");
    let mut case = Case::read(folder.join("pid-elastic.toml")).unwrap();
    (case.machine.drives[0].amplifier.voltage_limit, case.machine.drives[0].amplifier.current_limit) = (None, None);
    case
}

/// The motor gets what a reference needs where a loop follows it closely.
#[test]
fn needs_are_those_of_a_loop_that_follows_closely() {
    let case = case();
    let design = case.controller.as_ref().unwrap();
    for motion in &case.moves {
        let setup = Setup {
            window: motion.window,
            solver: Solver::Exact,
            ..Setup::new(&case.machine, design, &motion.profiles, motion.until)
        };
        let figures = closed_loop(&setup).unwrap().figures;
        let [volts, amperes] = ["voltage", "current"].map(|limit| needed(&case.machine, motion.profile(), limit));
        let (given, taken) = (figures.drive().voltage.0.value.abs(), figures.drive().current.0.value.abs());
        assert!((volts / given - 1.0).abs() < 0.1, "{}: {volts} V, {given} V in the loop", motion.name);
        assert!((amperes / taken - 1.0).abs() < 0.25, "{}: {amperes} A, {taken} A in the loop", motion.name);
    }
}

/// A force that is the same all along the travel is a load. It was counted twice once feed-forward knew it.
#[test]
fn a_force_along_the_travel_is_needed_once() {
    let case = case();
    for force in [-6.0, 2.5] {
        let [mut along, mut loaded] = [(); 2].map(|()| case.machine.clone());
        along.cart.forces.along = Polyline::new(vec![[-1.0, force], [1.0, force]]);
        loaded.cart.load += force;
        for motion in &case.moves {
            for limit in ["voltage", "current"] {
                let [is, wanted] = [&along, &loaded].map(|machine| needed(machine, motion.profile(), limit));
                let without = needed(&case.machine, motion.profile(), limit);
                assert!((is / wanted - 1.0).abs() < 1e-9, "{}: {limit} {is}, {wanted} with a load", motion.name);
                assert!((is / without - 1.0).abs() > 1e-3, "{}: {limit} {is}, {without} without", motion.name);
            }
        }
    }
}

/// Each limit is named a tenth below what is needed, and not a tenth above it.
#[test]
fn each_limit_is_named_where_it_is_exceeded() {
    let case = case();
    let motion = &case.moves[0];
    let most = |limit: &str| needed(&case.machine, motion.profile(), limit);
    let [volts, amperes, off, on] = ["voltage", "current", "slack", "tension"].map(most);
    let far = motion.profile().target();
    let away = case.machine.breakaway(0, 1.0, 0.0) / Rigid::new(&case.machine).force_per_command();
    type Set = fn(&mut Machine, f64) -> Option<f64>;
    let limits: [(&str, f64, Set); 6] = [
        ("voltage", volts, |machine, most| {
            machine.drives[0].amplifier.voltage_limit = Some(most);
            None
        }),
        ("voltage", volts, |_, most| Some(most)),
        ("current", amperes, |machine, most| {
            machine.drives[0].amplifier.current_limit = Some(most);
            None
        }),
        ("travel", far, |machine, most| {
            machine.cart.travel = Some(Travel { min: -1.0, max: most, stop: None });
            None
        }),
        ("slack", off, |machine, most| {
            machine.belt.pretension = Some(most);
            None
        }),
        ("tension", on, |machine, most| {
            machine.belt.sheet.allowed_tension = Some(most);
            None
        }),
    ];
    for (limit, needed, set) in limits {
        for share in [0.9, 1.1] {
            let mut machine = case.machine.clone();
            let own = set(&mut machine, share * needed);
            let found = shortfalls(&machine, commanded(own), &motion.profiles);
            if share > 1.0 {
                assert_eq!(found, [], "{limit} at {share}");
                continue;
            }
            let [short] = &found[..] else { panic!("{limit} at {share}: {found:?}") };
            assert_eq!(short.limit, limit);
            assert!((short.allowed - share * needed).abs() <= 1e-12 * needed, "{short:?}");
            assert!(short.needed > short.allowed && short.time >= 0.0 && !short.words.is_empty(), "{short:?}");
        }
    }
    let names = |limit: f64| -> Vec<&str> {
        shortfalls(&case.machine, commanded(Some(limit)), &motion.profiles).iter().map(|short| short.limit).collect()
    };
    assert!(names(0.9 * away).contains(&"breakaway") && !names(1.1 * away).contains(&"breakaway"));
}

/// The speed that a voltage reaches is the steady speed of a run under it.
#[test]
fn the_speed_that_is_reached_is_the_steady_one() {
    let case = case();
    let motion = &case.moves[0];
    let volts = 0.5 * needed(&case.machine, motion.profile(), "voltage");
    let found = shortfalls(&case.machine, commanded(Some(volts)), &motion.profiles);
    let short = found.iter().find(|short| short.limit == "voltage").unwrap();
    let Balance::At(speed) = balanced_speed(&case.machine, volts, 0.1) else { panic!("no steady speed") };
    let told = engineering(speed, "m/s", 3);
    assert!(short.words.ends_with(&format!("reach {told}")), "{} and {told}", short.words);
}

/// A generator that left a speed of 1.9e-16 m/s at the end of its move commanded the whole dry friction for ever.
#[test]
fn what_rounding_leaves_of_a_reference_at_rest_commands_no_friction() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/sollmann-jouaneh/controllers");
    let case = Case::read(folder.join("pid-elastic.toml")).unwrap();
    let mut machine = case.machine.clone();
    (machine.drives[0].motor.gear_efficiency, machine.cart.load) = (0.8, 3.0);
    let run = &mut Evaluation::plain();
    let mut number = 1_u64;
    let mut noise = |size: f64| {
        number = number.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        size * ((number >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    for model in [FeedForwardModel::Rigid, FeedForwardModel::Elastic] {
        let settings =
            FeedForward { model, compensate_stretch: true, ..case.controller.as_ref().unwrap().feed_forward };
        let compensation = Compensation::new(&machine, &settings);
        let still = Reference { position: 0.1, ..Reference::default() };
        let [command, dry] = [compensation.command(run, &still).unwrap(), compensation.dry(run, &still)];
        let target = compensation.target(run, &still).position;
        // The pulley is quicker than the cart by the rate of the stretch, some 1e-8 m/s here.
        for size in [1.9e-16, 1e-12, 1e-9, 0.9] {
            for _ in 0..100 {
                let speed = noise(size * REST_SPEED);
                let acceleration = noise(size * REST_ACCELERATION);
                let y = Reference { speed, acceleration, ..still };
                assert_eq!(direction(&y), 0.0);
                assert_eq!(compensation.dry(run, &y), dry);
                // The noise itself goes through inertia and viscous friction, a few grams and N s/m.
                let most = size * 1e-2 * compensation.rigid.command(1.0, 0.0, &Reference::default());
                assert!((compensation.command(run, &y).unwrap() - command).abs() <= most + 1e-12, "{y:?}");
                assert!((compensation.target(run, &y).position - target).abs() <= size * 1e-6 + 1e-15, "{y:?}");
            }
        }
        // Ten times as much is a direction.
        for sign in [1.0, -1.0] {
            let moving = Reference { speed: 10.0 * sign * REST_SPEED, acceleration: -sign, ..still };
            assert_eq!(direction(&moving), sign);
            let leaving = Reference { acceleration: 10.0 * sign * REST_ACCELERATION, ..still };
            assert_eq!(direction(&leaving), sign);
            assert!((compensation.dry(run, &leaving) - dry).abs() > 0.01);
        }
    }
}

/// What the rotor takes does not pass through the gear: the current for a force accelerates the axis of the solver like
/// the reference, whichever side drives.
#[test]
fn a_gear_with_losses_needs_what_the_solver_says() {
    let mut chance = Chance::new(11);
    let mut draw = |low: f64, high: f64| low + (high - low) * chance.uniform();
    let (mut driving, mut driven) = (0, 0);
    for number in 0..300 {
        let mut machine = common::table4();
        machine.belt.model = BeltModel::Rigid;
        machine.drives[0].amplifier.mode = AmplifierMode::Current;
        let motor = &mut machine.drives[0].motor;
        (motor.gear_efficiency, motor.gear_ratio) = (draw(0.3, 1.0), draw(0.5, 6.0));
        motor.rotor_inertia = draw(0.0, 1e-4);
        let (speed, acceleration) = (draw(-1.0, 1.0), draw(-100.0, 100.0));
        let rigid = Rigid::new(&machine);
        let (viscous, dry) = rigid.friction(speed, speed.signum());
        let force = rigid.mass * acceleration + viscous + dry;
        let y = Reference { speed, acceleration, ..Reference::default() };
        let current = rigid.electrical(force, 0.0, &y).0;

        let until = 1e-6;
        let mut experiment = common::experiment(Signal::Step { value: current, at: 0.0 }, until);
        experiment.every = until;
        for (body, arm) in [(DRIVE, machine.pulley_radius), (CART, 1.0), (IDLER, machine.pulley_radius)] {
            experiment.initial.speed[body] = speed / arm;
        }
        let run = simulate(&machine, &experiment, Solver::Exact).unwrap();
        let speeds = run.trajectory.get("cart_speed").unwrap();
        let got = (speeds[speeds.len() - 1] - speeds[0]) / until;
        // The drag of friction changes it within the microsecond by some 1e-5 of itself.
        assert!(
            (got - acceleration).abs() < 1e-4 * (1.0 + acceleration.abs()),
            "{number}: {got} for {acceleration} m/s²\n{machine:?}"
        );
        if (force - rigid.rotor * acceleration) * speed > 0.0 { driving += 1 } else { driven += 1 }
    }
    assert!(driving > 50 && driven > 50, "{driving} {driven}");
}

/// Two masses on a belt, drawn, without belt damping, and with dry friction or without.
fn two_masses(chance: &mut Chance, is_dry: bool) -> Machine {
    let mut draw = |low: f64, high: f64| low * (high / low).powf(chance.uniform());
    let mut machine = common::table4();
    machine.belt.model = BeltModel::TwoMass;
    machine.belt.stiffness = [draw(2e3, 5e4), draw(2e3, 5e4), draw(2e3, 5e4)].into();
    machine.cart.mass = draw(0.2, 2.0);
    (machine.drive_pulley.inertia, machine.idler_pulley.inertia) = (draw(2e-5, 4e-4), draw(2e-5, 4e-4));
    machine.drives[0].motor.gear_ratio = draw(0.5, 4.0);
    machine.drives[0].motor.rotor_inertia = draw(1e-6, 1e-4);
    machine.drives[0].amplifier.mode =
        if draw(1.0, 4.0) > 2.0 { AmplifierMode::Current } else { AmplifierMode::Voltage };
    let coulomb = if is_dry { [0.01, 0.02, 0.5] } else { [0.0; 3] };
    machine.drive_pulley.friction = Friction::symmetric(draw(1e-4, 4e-3), coulomb[0]);
    machine.idler_pulley.friction = Friction::symmetric(draw(1e-4, 4e-3), coulomb[1]);
    machine.cart.friction = Friction::symmetric(draw(1.0, 40.0), coulomb[2]);
    machine
}

/// Largest error of the cart, m, when a machine runs without a controller by the feed-forward of a reference and
/// `more`, from a state on it; and the largest stretch of its belt, m.
fn open_loop(
    machine: &Machine,
    profile: &Profile,
    [begin, end]: [f64; 2],
    more: impl Fn(&Reference) -> f64,
) -> [f64; 2] {
    let settings = FeedForward { model: FeedForwardModel::Elastic, ..FeedForward::NONE };
    let compensation = Compensation::new(machine, &settings);
    let command = |time: f64| {
        let y = profile.at(time);
        compensation.command(&mut Evaluation::plain(), &y).unwrap() + more(&y)
    };
    // Straight lines between instants, with two on either side of each jump.
    let (step, side) = (4e-6, 1e-9);
    let mut times: Vec<f64> = (0..=((end - begin) / step) as usize).map(|k| begin + step * k as f64).collect();
    let seams = Profile::seams(std::slice::from_ref(profile));
    let seams: Vec<f64> = seams.into_iter().filter(|seam| (begin..end).contains(seam)).collect();
    times.retain(|time| seams.iter().all(|seam| (time - seam).abs() > 3.0 * side));
    times.extend(seams.iter().flat_map(|seam| [seam - side, seam + side]).filter(|time| *time > begin));
    times.sort_by(f64::total_cmp);
    times.dedup_by(|next, last| *next - *last < 0.5 * side);
    let values = times.iter().map(|time| command(*time)).collect();
    let times = times.into_iter().map(|time| (time - begin).max(0.0)).collect();
    let input = Signal::Sampled { times, values, hold: Hold::Linear };
    let mut experiment = common::experiment(input, end - begin);
    let (first, r) = (profile.at(begin), machine.pulley_radius);
    let needed = compensation.needed(&first);
    for (body, position, speed) in [
        (DRIVE, needed.drive.position / r, needed.drive.speed / r),
        (CART, first.position, first.speed),
        (IDLER, needed.idler[0] / r, needed.idler[1] / r),
    ] {
        (experiment.initial.position[body], experiment.initial.speed[body]) = (position, speed);
    }
    let run = simulate(machine, &experiment, Solver::for_machine(machine)).unwrap();
    let [rows, cart] = ["time", "cart_position"].map(|name| run.trajectory.get(name).unwrap());
    let off = rows.iter().zip(cart).map(|(time, x)| (x - profile.at(begin + time).position).abs());
    let stretch = rows.iter().map(|time| {
        let y = profile.at(begin + time);
        (compensation.needed(&y).drive.position - y.position).abs()
    });
    [off.fold(0.0, f64::max), stretch.fold(0.0, f64::max)]
}

/// The idler of a two-mass belt was accelerated like the cart instead of like the drive pulley with which it turns.
#[test]
fn the_feed_forward_of_a_two_mass_belt_is_its_exact_inverse() {
    let mut chance = Chance::new(32);
    let limits = Limits { speed: 0.3, acceleration: 6.0, jerk: Some(400.0), snap: Some(6e4) };
    let profile = Profile::new(0.0, &[Leg::To(0.03, limits)]).unwrap();
    let whole = profile.end();
    for number in 0..12 {
        // Dry friction does not change while all bodies move.
        let is_dry = number % 2 == 1;
        let machine = two_masses(&mut chance, is_dry);
        let during = if is_dry { [0.2 * whole, 0.8 * whole] } else { [0.0, whole] };
        let [off, stretch] = open_loop(&machine, &profile, during, |_| 0.0);
        // As before: J₂ (y″ − y₁″)/r² too much.
        let settings = FeedForward { model: FeedForwardModel::Elastic, ..FeedForward::NONE };
        let compensation = Compensation::new(&machine, &settings);
        let r = machine.pulley_radius;
        let [wrong, _] = open_loop(&machine, &profile, during, |y| {
            let behind = y.acceleration - compensation.needed(y).drive.acceleration;
            behind * machine.idler_pulley.inertia / (r * r) / compensation.rigid.force_per_command()
        });
        println!("{number}: {off:e} m, {wrong:e} m with y'', of a stretch of {stretch:e} m");
        assert!(off < 2e-9 && off < 2e-5 * stretch, "{number}: {off:e} m, stretch {stretch:e} m\n{machine:?}");
        assert!(wrong > 20.0 * off, "{number}: {off:e} m, {wrong:e} m");
    }
}

/// With spans that follow the cart, whose stiffness changes along its travel.
#[test]
fn the_feed_forward_of_a_two_mass_belt_contains_the_rates_of_its_stiffness() {
    let mut chance = Chance::new(33);
    let limits = Limits { speed: 0.3, acceleration: 6.0, jerk: Some(400.0), snap: Some(6e4) };
    let profile = Profile::new(-0.1, &[Leg::To(-0.07, limits)]).unwrap();
    for number in 0..3 {
        let mut machine = common::with_following_spans(two_masses(&mut chance, false));
        machine.belt.make.as_mut().unwrap().section *= 0.02;
        machine.belt.stiffness = machine.belt.make.unwrap().stiffness();
        let [off, stretch] = open_loop(&machine, &profile, [0.0, profile.end()], |_| 0.0);
        println!("{number}: {off:e} m, of a stretch of {stretch:e} m");
        assert!(off < 1e-8 && off < 1e-4 * stretch, "{number}: {off:e} m, stretch {stretch:e} m\n{machine:?}");
    }
}
