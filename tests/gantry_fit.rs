//! Fits of gantries with logs of both motors: the numbers that made a log are found, and intervals hold them about as
//! often as they say.

use crate::common::chance::Chance;
use crate::common::gantries::{COUNT, Drawn, Lacks, drawn as lacking, stage};
use crate::common::logged::fitted_in_steps;
use std::sync::Arc;
use taut::case::{Case, Plan};
use taut::fit::compare::{ComparisonOptions, FrictionLaw, compare};
use taut::fit::least_squares::{Differences, Residuals};
use taut::fit::{Fit, Problem, check, drift};
use taut::log::{Log, Output, Quantity};
use taut::machine::{Machine, MachineKind};
use taut::signal::Hold;
use taut::solve::{Flow, Solver, simulate};
use taut::trajectory::Trajectory;

/// Bits of 8 V on all motors, each with its own.
fn inputs(kind: MachineKind) -> String {
    let bits = |(drive, side): (usize, &str)| format!("{side} = {{ prbs = 8, bit = 0.005, seed = {} }}", 3 + 5 * drive);
    let all: Vec<String> = kind.geometry().sides().enumerate().map(bits).collect();
    format!("experiment.0.input={{ {} }}", all.join(", "))
}

/// A stage of this kind with one experiment on both motors.
fn case(kind: MachineKind, changes: &[&str]) -> Case {
    let rows = [&*inputs(kind), "experiment.0.until=0.5", "experiment.0.every=1ms"];
    let mut case = Case::read_with(stage(kind), &[&rows, changes].concat()).unwrap();
    case.experiments.truncate(1);
    case
}

/// The log of a run: angles of all motors in counts, and positions with noise of a standard deviation, m.
fn logged(run: &Trajectory, kind: MachineKind, positions: Option<f64>, seed: u64) -> Log {
    let mut chance = Chance::new(seed);
    let column = |name: &str| run.get(name).unwrap().to_vec();
    let output = |quantity: Quantity, values: Vec<f64>| Output { quantity, absolute: false, values };
    let geometry = kind.geometry();
    let is_counted = |quantity: &&Quantity| {
        geometry.drives.iter().any(|drive| quantity.name() == format!("{}_angle", geometry.label(drive.pulley).key))
    };
    let mut outputs: Vec<Output> = Quantity::for_kind(kind)
        .iter()
        .filter(is_counted)
        .map(|&quantity| {
            let counts = column(quantity.name()).iter().map(|angle| COUNT * (angle / COUNT).floor()).collect();
            output(quantity, counts)
        })
        .collect();
    if let Some(deviation) = positions {
        outputs.extend([Quantity::BridgePosition, Quantity::CartPosition].map(|quantity| {
            let values = column(quantity.name()).iter().map(|x| x + deviation * chance.normal()).collect();
            output(quantity, values)
        }));
    }
    Log {
        name: "both motors".into(),
        file: Default::default(),
        time: column("time"),
        inputs: geometry.sides().map(|side| column(&format!("{side}_voltage"))).collect(),
        added: None,
        hold: Hold::Zero,
        reference: None,
        outputs,
        ended: None,
    }
}

/// The case with the log of `truth`, to be fitted from its own values.
fn with_log(mut case: Case, truth: &Case, positions: Option<f64>, seed: u64) -> Case {
    let solver = if truth.machine.yaw.is_some() { Solver::General { tolerance: 1e-10 } } else { Solver::Exact };
    let run = simulate(&truth.machine, &truth.experiments[0], solver).unwrap().trajectory;
    let log = logged(&run, truth.machine.kind, positions, seed);
    case.experiments[0].inputs = log.signals();
    case.experiments[0].log = Some(Arc::new(log));
    case
}

fn fitted(case: &Case, plan: &Plan) -> Fit {
    fitted_in_steps(case, plan, None).unwrap()
}

/// The two spans of each belt of a CoreXY show by their sum only.
fn belts_of_core_xy(free: &[&str]) -> Plan {
    let tie = |keys: [&str; 2]| keys.map(String::from).to_vec();
    Plan {
        free: free.iter().map(|key| key.to_string()).collect(),
        tied: vec![tie(["belt.stiffness.0", "belt.stiffness.1"]), tie(["belt.stiffness.2", "belt.stiffness.3"])],
        ..Plan::default()
    }
}

/// With the angles of both motors in each other's columns a check took a minute of factors on them, none of which
/// helped, and said to change a sign.
#[test]
fn exchanged_columns_of_two_motors_are_named() {
    for kind in [MachineKind::CoreXy, MachineKind::HFrame] {
        let mut own = with_log(case(kind, &[]), &case(kind, &["cart.mass=0.5"]), None, 3);
        let log = Arc::make_mut(own.experiments[0].log.as_mut().unwrap());
        let (one, other) = (log.outputs[0].quantity, log.outputs[1].quantity);
        (log.outputs[0].quantity, log.outputs[1].quantity) = (other, one);
        let plan = Plan { free: vec!["cart.mass".into()], ..Plan::default() };
        let found = check(&own, &plan).unwrap();
        let told: Vec<String> = found.fit.warnings().map(ToString::to_string).collect();
        let words = format!("with the columns of {} and {} exchanged", one.name(), other.name());
        assert!(told.iter().any(|one| one.contains(&words)), "{kind:?}: {told:#?}");
        assert!(!found.fit.findings.iter().any(|one| one.code == "sign"), "{kind:?}: {told:#?}");
    }
}

/// The reversed angle of one motor was told as a log that the model does not explain, without a reason.
#[test]
fn the_reversed_encoder_of_one_motor_is_named() {
    for (kind, outputs) in [(MachineKind::CoreXy, 2), (MachineKind::HFrame, 2), (MachineKind::DualBelt, 3)] {
        let right = with_log(case(kind, &[]), &case(kind, &["cart.mass=0.5"]), None, 3);
        let plan = Plan { free: vec!["cart.mass".into()], ..Plan::default() };
        let is_told = |case: &Case| {
            let found = check(case, &plan).unwrap();
            found.fit.warnings().map(ToString::to_string).collect::<Vec<String>>()
        };
        assert!(is_told(&right).is_empty());
        for output in 0..outputs {
            let mut own = right.clone();
            let log = Arc::make_mut(own.experiments[0].log.as_mut().unwrap());
            log.outputs[output].values.iter_mut().for_each(|value| *value = -*value);
            let name = log.outputs[output].quantity.name();
            let told = is_told(&own);
            let words = format!("with the sign of {name} reversed");
            assert!(told.iter().any(|one| one.contains(&words)), "{kind:?} {name}: {told:#?}");
            let other = "it moves opposite to the model";
            assert!(!told.iter().any(|one| one.contains(other)), "{kind:?} {name}: {told:#?}");
        }
    }
}

/// Of drawn machines.
#[derive(Default)]
struct Coverage {
    machines: usize,
    /// Intervals that hold the truth, of how many.
    held: [usize; 2],
    /// Intervals of the ratio of the belts that hold it.
    ratios: usize,
    /// Statements of the looser belt, and those that are wrong.
    stated: usize,
    wrong: usize,
    /// Fits that were no minimum.
    lost: usize,
    /// Models that were said to lack something: they are right.
    blamed: usize,
}

impl Coverage {
    fn told(&self) -> String {
        let Self { machines, held: [inside, all], ratios, stated, wrong, lost, blamed } = self;
        format!(
            "{machines} machines: {inside} of {all} intervals hold the truth, {ratios} of the ratio; {stated} statements, {wrong} \
             wrong; {lost} lost; {blamed} blamed"
        )
    }
}

const FREE: [&str; 5] =
    ["cart.mass", "bridge.mass", "cart.friction.viscous", "bridge.friction.viscous", "bridge.friction.coulomb"];

/// So many CoreXY with drawn masses, friction and belts, logged by encoders at the motors and, every other one, scales.
fn coverage(machines: u64) -> Coverage {
    let mut found = Coverage { machines: machines as usize, ..Coverage::default() };
    for seed in 1..=machines {
        let mut chance = Chance::new(40_000 + seed);
        let mut between = |low: f64, high: f64| low + (high - low) * chance.uniform();
        let truth = [between(0.3, 0.6), between(0.6, 1.2), between(5.0, 15.0), between(8.0, 20.0), between(0.3, 0.7)];
        let belts = [between(8e4, 1.5e5), between(8e4, 1.5e5)];
        let mut changes: Vec<String> = FREE.iter().zip(truth).map(|(key, value)| format!("{key}={value}")).collect();
        changes.extend((0..4).map(|span| format!("belt.stiffness.{span}={}", belts[span / 2])));
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let positions = (seed % 2 == 0).then_some(5e-6);
        let alike = ["belt.stiffness=[1e5, 1e5, 1e5, 1e5]"];
        let own = with_log(case(MachineKind::CoreXy, &alike), &case(MachineKind::CoreXy, &changes), positions, seed);
        let result = fitted(&own, &belts_of_core_xy(&FREE));
        let is_blamed = result.cause.is_some() || result.findings.iter().any(|one| one.code == "noise");
        found.blamed += usize::from(is_blamed);
        let is_known = result.is_complete() && result.estimates.iter().all(|one| !one.at_bound);
        let Some(compared) = result.belts().filter(|_| is_known) else {
            found.lost += 1;
            continue;
        };
        for (estimate, value) in result.estimates.iter().zip(truth.into_iter().chain(belts)) {
            let [low, high] = estimate.interval.unwrap();
            found.held[0] += usize::from(low <= value && value <= high);
            found.held[1] += 1;
        }
        let [low, high] = compared.interval();
        let ratio = belts[1] / belts[0];
        found.ratios += usize::from(low <= ratio && ratio <= high);
        if let Some(looser) = compared.looser() {
            found.stated += 1;
            found.wrong += usize::from((looser == 1) != (ratio < 1.0));
        }
    }
    found
}

/// 20 machines; with `TAUT_CASES`, that many.
#[test]
fn intervals_of_gantries_hold_the_truth_about_as_often_as_they_say() {
    let machines = std::env::var("TAUT_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(20);
    let found = coverage(machines);
    println!("{}", found.told());
    let share = found.held[0] as f64 / found.held[1] as f64;
    assert!(found.lost == 0 && found.wrong == 0, "{}", found.told());
    // The models are right.
    assert!(20 * found.blamed <= found.machines, "{}", found.told());
    assert!(share >= 0.9 && found.ratios as f64 >= 0.85 * found.machines as f64, "{}", found.told());
    assert!(found.stated as f64 >= 0.8 * found.machines as f64, "{}", found.told());
}

/// Free parameters of a fit of this kind: masses, friction and belts.
fn of_kind(kind: MachineKind) -> Plan {
    let free = ["bridge.mass", "cart.mass", "bridge.friction.viscous", "cart.friction.viscous"];
    match kind {
        MachineKind::CoreXy => belts_of_core_xy(&free),
        MachineKind::HFrame => {
            let spans = ["belt.stiffness.0", "belt.stiffness.1", "belt.stiffness.2"];
            Plan { free: free.iter().chain(&spans).map(|key| key.to_string()).collect(), ..Plan::default() }
        }
        _ => {
            let tie = |belt: usize| [2 * belt, 2 * belt + 1].map(|span| format!("belt.stiffness.{span}")).to_vec();
            Plan { free: free.map(String::from).to_vec(), tied: (0..3).map(tie).collect(), ..Plan::default() }
        }
    }
}

/// Drawn masses and friction of a machine, and the belt of its right drive, relative to those of its file.
fn drawn(kind: MachineKind, chance: &mut Chance) -> Vec<String> {
    let plain = case(kind, &[]).machine;
    let mut changes = vec![
        format!("bridge.mass={}", chance.between(0.7, 1.1)),
        format!("cart.mass={}", chance.between(0.3, 0.45)),
        format!("bridge.friction.viscous={}", chance.between(8.0, 16.0)),
        format!("cart.friction.viscous={}", chance.between(5.0, 12.0)),
    ];
    let factor = chance.between(0.8, 1.2);
    let right = plain.geometry().spans_of(1);
    changes.extend(right.map(|span| format!("belt.stiffness.{span}={}", factor * plain.belt.stiffness[span])));
    changes
}

/// The length of logs of fits with missing elements, which take long.
const SHORT: &str = "experiment.0.until=0.3";

fn simulated(kind: MachineKind, changes: &[String]) -> Case {
    case(kind, &changes.iter().map(String::as_str).collect::<Vec<_>>())
}

/// A wrong torque constant of one drive was never named; masses, friction and belts are drawn, and so are the drive,
/// the number and its factor.
#[test]
fn a_wrong_number_of_one_drive_is_named() {
    let mut chance = Chance::new(4711);
    for kind in [MachineKind::CoreXy, MachineKind::HFrame, MachineKind::DualBelt] {
        let drives = kind.geometry().drives;
        let drive = (chance.uniform() * drives.len() as f64) as usize;
        let (at, plain) = (drives[drive].key, case(kind, &[]).machine.drives[drive]);
        let factor = if chance.uniform() < 0.5 { 0.85 } else { 1.15 };
        let motor = plain.motor;
        let (names, values): (&[&str], &[f64]) = match (chance.uniform() * 3.0) as usize {
            0 => (
                &["motor.torque_constant", "motor.back_emf_constant"],
                &[motor.torque_constant, motor.back_emf_constant],
            ),
            1 => (&["motor.resistance"], &[motor.resistance]),
            _ => (&["amplifier.gain"], &[plain.amplifier.gain]),
        };
        let keys: Vec<String> = names.iter().map(|name| format!("{at}{name}")).collect();
        let mut changes = drawn(kind, &mut chance);
        changes.push(SHORT.into());
        changes.extend(keys.iter().zip(values).map(|(key, value)| format!("{key}={}", factor * value)));
        let own = with_log(case(kind, &[SHORT]), &simulated(kind, &changes), None, 3);
        let found = fitted(&own, &of_kind(kind));
        let what = format!("{kind:?} {} {factor}", keys.join(" = "));
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{what}: {:#?}", found.findings));
        let size = &cause.parameters[0];
        assert!(cause.key == "drive" && size.name == keys.join(" = "), "{what}: {}", cause.words);
        assert!((size.value / values[0] / factor - 1.0).abs() < 0.01, "{what}: {}", cause.words);
        assert!(found.findings.iter().any(|one| one.code == "drive"), "{what}");
        // The belts by the fit with that number.
        let ratio = |machine: &Machine| {
            let of_drive =
                |drive| kind.geometry().spans_of(drive).map(|span| machine.belt.stiffness[span]).sum::<f64>();
            of_drive(1) / of_drive(0)
        };
        if let Some(belts) = found.belts().filter(|_| cause.explained > 0.9) {
            let [low, high] = belts.interval();
            let truth = ratio(&simulated(kind, &changes).machine);
            assert!(high / low < 1.1 && 0.99 * low < truth && truth < 1.01 * high, "{what}: {}", belts.words());
        }
    }
}

/// An encoder that counts 1 to 3 % too few or too many, or a pulley of another radius below it.
#[test]
fn a_factor_on_the_readings_of_one_encoder_is_named() {
    let mut chance = Chance::new(5);
    for kind in [MachineKind::CoreXy, MachineKind::HFrame] {
        let mut changes = drawn(kind, &mut chance);
        changes.push(SHORT.into());
        let mut own = with_log(case(kind, &[SHORT]), &simulated(kind, &changes), None, 3);
        let size = chance.between(0.01, 0.03);
        let factor = if chance.uniform() < 0.5 { 1.0 - size } else { 1.0 + size };
        let log = Arc::make_mut(own.experiments[0].log.as_mut().unwrap());
        let output = &mut log.outputs[usize::from(chance.uniform() < 0.5)];
        output.values.iter_mut().for_each(|value| *value = COUNT * (factor * *value / COUNT).round());
        let what = format!("{kind:?} {} {factor}", output.quantity.name());
        let name = output.quantity.name();
        let found = fitted(&own, &of_kind(kind));
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{what}: {:#?}", found.findings));
        // The logs tell the ratio of both encoders, and hardly which of them is off.
        assert_eq!(cause.key, "sensor_scale", "{what}: {}", cause.words);
        let size = 1.0 + cause.parameters[0].value;
        let ratio = if cause.words.contains(name) { size } else { 1.0 / size };
        assert!((ratio - factor).abs() < 2e-3, "{what}: {}", cause.words);
    }
}

/// Inputs that act a drawn number of samples late.
#[test]
fn a_delay_of_the_inputs_of_a_gantry_is_named() {
    let mut chance = Chance::new(99);
    for kind in [MachineKind::CoreXy, MachineKind::HFrame, MachineKind::DualBelt] {
        let late = 1 + usize::from(chance.uniform() < 0.5);
        let mut changes = drawn(kind, &mut chance);
        changes.push(SHORT.into());
        let mut own = with_log(case(kind, &[SHORT]), &simulated(kind, &changes), None, 3);
        let log = Arc::make_mut(own.experiments[0].log.as_mut().unwrap());
        for output in &mut log.outputs {
            output.values.rotate_right(late);
            output.values[..late].fill(0.0);
        }
        let found = fitted(&own, &of_kind(kind));
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{kind:?} {late}: {:#?}", found.findings));
        assert!(cause.key == "delay" && cause.parameters[0].name == "delay", "{kind:?} {late}: {}", cause.words);
        assert!((cause.parameters[0].value - 1e-3 * late as f64).abs() < 1e-5, "{kind:?} {late}: {}", cause.words);
    }
}

/// What was tried on an axis alone is tried on the drives, sensors and slides of a gantry, and named with its size.
#[test]
fn a_missing_element_of_a_gantry_is_named() {
    for lacks in [Lacks::DriveDelay, Lacks::Limit, Lacks::Stribeck, Lacks::Breakaway, Lacks::Load] {
        let Drawn { case, plan, part, size, .. } = lacking(1_000_003, lacks);
        let found = fitted(&case, &plan);
        let cause = found.cause.as_ref().unwrap_or_else(|| panic!("{lacks:?}: {:#?}", found.findings));
        assert!(cause.key == lacks.key() && cause.words.contains(&part), "{lacks:?} of {part}: {}", cause.words);
        let own = &cause.parameters[0];
        assert!((own.value / size - 1.0).abs() < 0.2, "{lacks:?} of {size}: {own:?}");
        assert!(found.findings.iter().any(|one| one.code == lacks.key()), "{lacks:?}: {:#?}", found.findings);
    }
}

/// `nuisance` takes the delay of one drive, with exact derivatives.
#[test]
fn the_delay_of_one_drive_is_fitted() {
    for seed in 0..3 {
        let Drawn { case, mut plan, part, size, .. } = lacking(seed, Lacks::DriveDelay);
        let drives = case.machine.geometry().drives;
        let drive = drives.iter().position(|at| at.label.name == part).unwrap();
        plan.nuisance.drive_delay = Some(drive);
        let mut problem = Problem::new(&case, &plan).unwrap();
        let (mut x, bounds, delay) = (problem.start(), problem.bounds(), problem.parameters.len());
        // Between samples.
        x[delay] = 0.4;
        let mut at = |x: &[f64]| {
            let mut residuals = vec![0.0; problem.rows()];
            assert!(problem.evaluate(x, &mut residuals));
            residuals
        };
        let here = at(&x);
        let moved = [1e-4, -1e-4].map(|by| {
            let mut x = x.clone();
            x[delay] += by;
            at(&x)
        });
        let jacobian = problem.jacobian(&x, &here, &bounds, &Differences::Central).unwrap();
        assert_eq!(problem.differences, 0);
        let (exact, n) = (jacobian.column(delay), here.len());
        let slopes: Vec<f64> = (0..n).map(|k| (moved[0][k] - moved[1][k]) / 2e-4).collect();
        let most = slopes.iter().fold(0.0f64, |most, slope| most.max(slope.abs()));
        let off = (0..n).fold(0.0f64, |most, k| most.max((exact[k] - slopes[k]).abs()));
        assert!(most > 0.0 && off < 1e-4 * most, "{part}: {off:e} of {most:e}");
        let found = fitted(&case, &plan);
        let name = format!("{}_delay", drives[drive].input);
        let own = found.estimates.iter().find(|one| one.name == name).unwrap();
        assert!((own.value - size).abs() < 4.0 * own.error.unwrap() && own.unit == "s", "{own:?} for {size}");
        assert!(found.cause.is_none(), "{:#?}", found.findings);
    }
}

/// Racking of a bridge in a log whose model has none.
#[test]
fn a_bridge_that_yaws_is_named() {
    let yaw = "bridge.yaw={ inertia = 0.02, belt_spacing = 0.5, bearing_spacing = 0.06, bearing_stiffness = 5e6, \
               bearing_damping = 300 }";
    let mut chance = Chance::new(7);
    for kind in [MachineKind::CoreXy, MachineKind::HFrame] {
        let mut changes = drawn(kind, &mut chance);
        changes.extend([SHORT, yaw].map(String::from));
        let own = with_log(case(kind, &[SHORT]), &simulated(kind, &changes), None, 3);
        let found = fitted(&own, &of_kind(kind));
        let told: Vec<String> = found.findings.iter().map(ToString::to_string).collect();
        let is_named = found.cause.as_ref().is_some_and(|cause| cause.key == "yaw");
        assert!(is_named || found.warnings().any(|one| one.code == "noise"), "{kind:?}: {told:#?}");
    }
}

/// The constants of one motor are off, which belts imitate, and were taken for a looser belt.
#[test]
fn belts_are_compared_with_the_element_that_explains_the_residuals() {
    let alike = ["belt.stiffness=[1e5, 1e5, 1e5, 1e5]"];
    let plain = case(MachineKind::CoreXy, &alike);
    let [torque, back] =
        [plain.machine.drives[1].motor.torque_constant, plain.machine.drives[1].motor.back_emf_constant];
    let off = [
        format!("right_drive.motor.torque_constant={}", 0.85 * torque),
        format!("right_drive.motor.back_emf_constant={}", 0.85 * back),
    ];
    let changes = [alike[0], &off[0], &off[1]];
    let own = with_log(plain, &case(MachineKind::CoreXy, &changes), None, 3);
    let found = fitted(&own, &belts_of_core_xy(&FREE));
    assert!(found.warnings().next().is_some());
    // Named, so that belts are told by the fit with them.
    let [low, high] = found.belts().unwrap().interval();
    assert!(low < 1.0 && 1.0 < high && high / low < 1.2, "{low} to {high}: {:#?}", found.findings);
    // The same with these constants.
    let knowing = fitted(
        &with_log(case(MachineKind::CoreXy, &changes), &case(MachineKind::CoreXy, &changes), None, 3),
        &belts_of_core_xy(&FREE),
    );
    let [low, high] = knowing.belts().unwrap().interval();
    assert!(low < 1.0 && 1.0 < high && high / low < 1.2, "{low} to {high}");
}

#[test]
fn an_h_frame_is_fitted_with_all_three_spans() {
    let truth = ["belt.stiffness=[1.2e5, 0.9e5, 0.6e5]", "left_drive.motor.resistance=0.74", "cart.mass=0.4"];
    let own = with_log(case(MachineKind::HFrame, &[]), &case(MachineKind::HFrame, &truth), Some(2e-6), 5);
    let free = ["belt.stiffness.0", "belt.stiffness.1", "belt.stiffness.2", "left_drive.motor.resistance", "cart.mass"];
    let plan = Plan { free: free.map(String::from).to_vec(), ..Plan::default() };
    let found = fitted(&own, &plan);
    for (estimate, value) in found.estimates.iter().zip([1.2e5, 0.9e5, 0.6e5, 0.74, 0.4]) {
        let error = estimate.error.unwrap();
        assert!((estimate.value - value).abs() < 4.0 * error && error < 0.02 * value, "{estimate:?}");
    }
    let belts = found.belts().unwrap();
    assert_eq!(belts.looser(), Some(1), "{}", belts.words());
    // As one equation of balance is of one coordinate, there is none.
    let told = check(&own, &plan).unwrap();
    assert!(told.balance.is_none() && told.experiments.is_empty() && told.tells());
    assert_eq!(told.logs[0].channels[1].name, "right_input");
}

/// Three inputs and three belts, of each of which only the sum of both spans shows.
#[test]
fn a_dual_belt_is_fitted_with_the_logs_of_three_motors() {
    let values = [0.9, 0.4, 9.0, 14.0, 1.9e5, 2.2e5, 2.4e5];
    let spans: Vec<f64> = values[4..].iter().flat_map(|sum| [0.5 * sum, 0.5 * sum]).collect();
    let free = ["bridge.mass", "cart.mass", "cart.friction.viscous", "bridge.friction.viscous"];
    let mut truth: Vec<String> = free.iter().zip(values).map(|(key, value)| format!("{key}={value}")).collect();
    truth.push(format!("belt.stiffness={spans:?}"));
    let truth: Vec<&str> = truth.iter().map(String::as_str).collect();
    let alike = ["belt.stiffness=[1e5, 1e5, 1e5, 1e5, 1e5, 1e5]"];
    let own = with_log(case(MachineKind::DualBelt, &alike), &case(MachineKind::DualBelt, &truth), None, 13);
    let tie = |belt: usize| [2 * belt, 2 * belt + 1].map(|span| format!("belt.stiffness.{span}")).to_vec();
    let plan = Plan { free: free.map(String::from).to_vec(), tied: (0..3).map(tie).collect(), ..Plan::default() };
    let found = fitted(&own, &plan);
    let single = values.iter().enumerate().map(|(k, value)| if k < 4 { *value } else { 0.5 * value });
    for (estimate, value) in found.estimates.iter().zip(single) {
        let error = estimate.error.unwrap();
        assert!((estimate.value - value).abs() < 4.0 * error && error < 0.02 * value, "{estimate:?}, {value}");
    }
    assert_eq!(found.estimates.len(), 7);
}

/// Every quantity that a log of a dual belt can have, alone with the encoders and all together: a scale at bridge or
/// cart, a camera, an accelerometer at the cart, tachometers, currents and voltages.
#[test]
fn a_dual_belt_is_fitted_with_every_sensor() {
    let truth = case(MachineKind::DualBelt, &[SHORT, "bridge.mass=1", "cart.mass=0.4"]);
    let run = simulate(&truth.machine, &truth.experiments[0], Solver::Exact).unwrap().trajectory;
    let time = run.get("time").unwrap();
    let mut chance = Chance::new(17);
    let mut measured = |quantity: &Quantity| {
        let name = quantity.name();
        let values: Vec<f64> = match quantity.is_acceleration() {
            false => run.get(name).unwrap().to_vec(),
            true => {
                let speed = run.get(&name.replace("acceleration", "speed")).unwrap();
                let slope = |k: usize| {
                    let (before, after) = (k.saturating_sub(1), (k + 1).min(speed.len() - 1));
                    (speed[after] - speed[before]) / (time[after] - time[before])
                };
                (0..speed.len()).map(slope).collect()
            }
        };
        let most = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let values = values.iter().map(|value| value + 1e-3 * most * chance.normal()).collect();
        Output { quantity: *quantity, absolute: false, values }
    };
    let all: Vec<Output> = Quantity::for_kind(MachineKind::DualBelt).iter().map(&mut measured).collect();
    let own = with_log(case(MachineKind::DualBelt, &[SHORT]), &truth, None, 1);
    let plan = Plan { free: ["bridge.mass", "cart.mass"].map(String::from).to_vec(), ..Plan::default() };
    let encoders = own.experiments[0].log.as_ref().unwrap().outputs.clone();
    let is_new = |output: &&Output| encoders.iter().all(|encoder| encoder.quantity != output.quantity);
    let each = all.iter().filter(is_new).map(|output| [&encoders[..], std::slice::from_ref(output)].concat());
    let positions = all.iter().filter(|own| own.quantity.is_linear() && own.quantity.is_position()).cloned().collect();
    for outputs in each.chain([positions, all.clone()]) {
        let mut own = own.clone();
        let names: Vec<&str> = outputs.iter().map(|output| output.quantity.name()).collect();
        Arc::make_mut(own.experiments[0].log.as_mut().unwrap()).outputs.clone_from(&outputs);
        let found = fitted(&own, &plan);
        for (estimate, value) in found.estimates.iter().zip([1.0, 0.4]) {
            assert!((estimate.value / value - 1.0).abs() < 5e-3, "{names:?}: {estimate:?}");
        }
    }
}

/// Out and back of a CoreXY's belt are stretched alike: only the sum of their stiffnesses shows.
#[test]
fn spans_of_one_belt_show_by_their_sum() {
    let own =
        with_log(case(MachineKind::CoreXy, &[]), &case(MachineKind::CoreXy, &["belt.stiffness.2=1.1e5"]), None, 7);
    let free = ["belt.stiffness.0", "belt.stiffness.1", "belt.stiffness.2", "belt.stiffness.3"];
    let plan = Plan { free: free.map(String::from).to_vec(), ..Plan::default() };
    let found = fitted(&own, &plan);
    assert!(!found.is_complete());
    let known = found.identifiability.as_ref().unwrap();
    assert_eq!(known.groups.iter().map(|group| group.members.clone()).collect::<Vec<_>>(), [vec![0, 1], vec![2, 3]]);
    // The comparison of the belts is one of sums: 240 kN/m and 205 kN/m.
    let belts = found.belts().unwrap();
    let [low, high] = belts.interval();
    assert!(low < 205.0 / 240.0 && 205.0 / 240.0 < high && high - low < 0.1, "{}", belts.words());
    assert_eq!(belts.looser(), Some(1), "{}", belts.words());
}

/// Belts that are off by up to a half swing out of step with the log: a search over the whole log alone ends at a fit
/// that is off by a few periods.
#[test]
fn belts_are_found_from_a_stiffness_that_is_far_off() {
    let truth = case(MachineKind::CoreXy, &["belt.stiffness=[1.2e5, 1e5, 1.05e5, 0.9e5]"]);
    for start in [0.8e5, 1.3e5, 1.6e5] {
        let begins = format!("belt.stiffness=[{start}, {start}, {start}, {start}]");
        let own = with_log(case(MachineKind::CoreXy, &[&begins]), &truth, None, 3);
        let found = fitted(&own, &belts_of_core_xy(&["bridge.mass", "cart.mass"]));
        for (estimate, value) in found.estimates[2..].iter().zip([1.1e5, 0.975e5]) {
            assert!((estimate.value / value - 1.0).abs() < 2e-3, "{start}: {estimate:?}");
        }
    }
}

/// A bridge that rubs more on its way back, fitted with friction that is the same both ways: the model lacks something.
#[test]
fn what_a_gantry_lacks_is_a_warning() {
    for kind in [MachineKind::CoreXy, MachineKind::HFrame, MachineKind::DualBelt] {
        let truth = case(kind, &[SHORT, "bridge.friction.static=3", "bridge.friction.coulomb_backward=3"]);
        let own = with_log(case(kind, &[SHORT]), &truth, None, 5);
        let plan = Plan { free: vec!["bridge.friction.coulomb".into(), "bridge.mass".into()], ..Plan::default() };
        let found = fitted(&own, &plan);
        let warned: Vec<&str> = found.warnings().map(|one| one.code).collect();
        let is_told =
            found.cause.as_ref().is_some_and(|cause| warned.contains(&cause.key)) || warned.contains(&"noise");
        assert!(is_told, "{kind:?}: {:#?}", found.findings);
    }
}

/// A log that does not stretch the belts says so.
#[test]
fn a_slow_log_does_not_say_which_belt_is_looser() {
    let slow = "experiment.0.input={ left = { sine = 2, frequency = 2 }, right = { sine = 2, frequency = 3 } }";
    let truth = case(MachineKind::CoreXy, &[slow]);
    let own = with_log(case(MachineKind::CoreXy, &[slow]), &truth, None, 9);
    let found = fitted(&own, &belts_of_core_xy(&["cart.friction.viscous"]));
    let belts = found.belts().unwrap();
    assert_eq!(belts.looser(), None, "{}", belts.words());
    assert!(belts.words().starts_with("the logs do not"), "{}", belts.words());
}

/// Positions by the encoders of the motors say where bridge and cart begin, and offsets of each input are found.
#[test]
fn a_log_that_begins_elsewhere_and_inputs_with_offsets_are_fitted() {
    let begins = "experiment.0.initial={ bridge_position = 0.03, cart_position = -0.02 }";
    let truth = case(MachineKind::CoreXy, &[begins]);
    let mut own = with_log(case(MachineKind::CoreXy, &[]), &truth, None, 11);
    let log = Arc::make_mut(own.experiments[0].log.as_mut().unwrap());
    log.inputs[0].iter_mut().for_each(|u| *u += 0.05);
    log.inputs[1].iter_mut().for_each(|u| *u -= 0.08);
    own.experiments[0].inputs = log.signals();
    let mut plan = Plan { free: vec!["cart.mass".into()], ..Plan::default() };
    plan.nuisance.input_offset = taut::case::Scope::Shared;
    let found = fitted(&own, &plan);
    let names: Vec<&str> = found.estimates.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["cart.mass", "left_input_offset", "right_input_offset"]);
    for (estimate, value) in found.estimates.iter().zip([0.362, -0.05, 0.08]) {
        assert!((estimate.value - value).abs() < 4.0 * estimate.error.unwrap(), "{estimate:?}");
    }
}

/// A belt that has become looser, and a motor that has become weak.
#[test]
fn a_single_change_of_a_gantry_is_named() {
    let short = "experiment.0.until=0.15";
    for (kind, changes, name, factor) in [
        (
            MachineKind::CoreXy,
            "belt.stiffness=[132760, 132760, 106208, 106208]",
            "belt.stiffness.2 = belt.stiffness.3",
            0.8,
        ),
        (
            MachineKind::DualBelt,
            "left_drive.motor={ torque_constant = 0.0207, back_emf_constant = 0.0207 }",
            "left_drive.motor.torque_constant = left_drive.motor.back_emf_constant",
            0.9,
        ),
    ] {
        let nominal = match kind {
            MachineKind::CoreXy => vec![short, "belt.stiffness=[132760, 132760, 132760, 132760]"],
            _ => vec![short],
        };
        let truth = case(kind, &[&nominal[..], &[changes]].concat());
        let case = with_log(case(kind, &nominal), &truth, None, 5);
        let plan = Plan { free: vec!["bridge.mass".into()], ..Plan::default() };
        let found = drift(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
        let told: Vec<String> = found
            .best()
            .map(|one| format!("{} {:.4}", one.estimate.name, one.estimate.value / one.estimate.start))
            .collect();
        let own = found.changes.first().map(|one| &one.estimate).filter(|own| own.name == name);
        let own = own.unwrap_or_else(|| panic!("{name} by {factor}: {told:?}"));
        assert!((own.value / own.start / factor - 1.0).abs() < 0.03, "{name} by {factor}: {told:?}");
    }
}

/// The friction of a bridge with its own value in each direction.
#[test]
fn friction_laws_of_a_bridge_are_compared() {
    let rows = ["experiment.0.until=0.4"];
    let sided = "bridge.friction={ viscous = 12, coulomb = 1.0, viscous_backward = 16, coulomb_backward = 1.6 }";
    let truth = case(MachineKind::CoreXy, &[&rows[..], &[sided]].concat());
    let case = with_log(case(MachineKind::CoreXy, &rows), &truth, None, 9);
    let free = ["bridge.friction.viscous", "bridge.friction.coulomb"];
    let plan = Plan { free: free.map(String::from).to_vec(), ..Plan::default() };
    let laws = vec![FrictionLaw::Coulomb, FrictionLaw::Asymmetric];
    let setting = ComparisonOptions { laws, windows: vec![None] };
    let found = compare(&case, "core-xy.toml".as_ref(), &plan, &setting, None, &mut |_| Flow::Continue).unwrap();
    assert_eq!(found.body, "bridge");
    assert_eq!(found.candidates[found.chosen].law, FrictionLaw::Asymmetric, "{:?}", found.words());
}
