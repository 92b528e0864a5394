//! Gantries that have an element which their model lacks: drawn masses, friction and belts, inputs of all motors, and
//! counted encoders with noise.

use super::chance::Chance;
use super::logged::output;
use super::truths::behind_play;
use std::f64::consts::TAU;
use std::sync::Arc;
use taut::case::{Case, Plan};
use taut::log::{Log, Quantity};
use taut::machine::MachineKind;
use taut::signal::{Hold, Signal};
use taut::solve::{Solver, simulate};

/// The encoder of all motors: 10 000 counts a turn.
pub const COUNT: f64 = TAU / 10_000.0;

const EVERY: f64 = 1e-3;
const ROWS: usize = 601;

/// The element that the model lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lacks {
    /// Nothing.
    Nothing,
    /// Both constants of one motor are 15 % off.
    Constants,
    /// An encoder counts 1 to 3 % too few or too many.
    Scale,
    /// All inputs act 0.3 to 1.5 ms late.
    Delay,
    /// One input acts 0.3 to 1.5 ms late.
    DriveDelay,
    /// One amplifier gives at most 40 to 75 % of what the log says.
    Limit,
    /// Play of 0.1 to 0.4 mm at the belt between the machine and one encoder.
    SensorPlay,
    /// A drag of 10 to 30 N s²/m² on one slide.
    Drag,
    /// Friction of one slide that falls by 1 to 2 N within 30 to 60 mm/s.
    Stribeck,
    /// A breakaway of one slide of 1.6 to 2.5 times its Coulomb friction.
    Breakaway,
    /// A constant force of 0.4 to 1.2 N on one slide.
    Load,
}

impl Lacks {
    pub const ALL: [Self; 11] = [
        Self::Nothing,
        Self::Constants,
        Self::Scale,
        Self::Delay,
        Self::DriveDelay,
        Self::Limit,
        Self::SensorPlay,
        Self::Drag,
        Self::Stribeck,
        Self::Breakaway,
        Self::Load,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "gantry: nothing",
            Self::Constants => "gantry: constants of one motor 15 % off",
            Self::Scale => "gantry: one encoder 1 to 3 % off",
            Self::Delay => "gantry: all inputs 0.3 to 1.5 ms late",
            Self::DriveDelay => "gantry: one input 0.3 to 1.5 ms late",
            Self::Limit => "gantry: one amplifier gives 40 to 75 %",
            Self::SensorPlay => "gantry: play of 0.1 to 0.4 mm of one encoder",
            Self::Drag => "gantry: a drag of 10 to 30 N s²/m² on one slide",
            Self::Stribeck => "gantry: friction of one slide falls by 1 to 2 N",
            Self::Breakaway => "gantry: a breakaway of 1.6 to 2.5 times the Coulomb friction of one slide",
            Self::Load => "gantry: a force of 0.4 to 1.2 N on one slide",
        }
    }

    /// The key of its cause.
    pub fn key(self) -> &'static str {
        match self {
            Self::Nothing => "",
            Self::Constants => "drive",
            Self::Scale => "sensor_scale",
            Self::Delay => "delay",
            Self::DriveDelay => "drive_delay",
            Self::Limit => "limit",
            Self::SensorPlay => "sensor_play",
            Self::Drag => "drag",
            Self::Stribeck => "stribeck",
            Self::Breakaway => "breakaway",
            Self::Load => "load",
        }
    }
}

/// A case with the log of a machine.
pub struct Drawn {
    pub case: Case,
    pub plan: Plan,
    /// The true values of the free parameters, by their names.
    pub values: Vec<(String, f64)>,
    /// The drive, slide or sensor that has the element, in the words of a cause; empty if it is none of these.
    pub part: String,
    /// Size of the element, SI.
    pub size: f64,
}

/// The stage of a kind.
pub fn stage(kind: MachineKind) -> &'static str {
    match kind {
        MachineKind::HFrame => "stages/h-frame/h-frame.toml",
        MachineKind::DualBelt => "stages/dual-belt/dual-belt.toml",
        MachineKind::Axis | MachineKind::CoreXy => "stages/core-xy/core-xy.toml",
    }
}

/// Levels of the input of a motor, V, between rests: quick ones, which stretch belts, and slow ones.
fn levels(chance: &mut Chance) -> Vec<f64> {
    let mut values = vec![0.0; ROWS];
    let (mut row, mut sign) = (5 + (10.0 * chance.uniform()) as usize, 1.0);
    while row < ROWS {
        let is_quick = chance.uniform() < 0.7;
        let (level, lasts) = match is_quick {
            true => (chance.between(2.0, 8.0), chance.between(4.0, 25.0)),
            false => (chance.scaled(0.3, 2.0), chance.between(20.0, 70.0)),
        };
        let next = (row + lasts as usize).min(ROWS);
        values[row..next].fill(sign * level);
        sign = if chance.uniform() < 0.8 { -sign } else { sign };
        row = next + if chance.uniform() < 0.3 { chance.between(20.0, 60.0) as usize } else { 0 };
    }
    values
}

/// Ties of the free stiffnesses, and those that are free by themselves: the spans of one belt show by their sum.
fn belts(kind: MachineKind) -> (Vec<String>, Vec<Vec<String>>) {
    let span = |index: usize| format!("belt.stiffness.{index}");
    match kind {
        MachineKind::HFrame => ((0..3).map(span).collect(), Vec::new()),
        _ => (Vec::new(), (0..kind.geometry().drives.len()).map(|k| vec![span(2 * k), span(2 * k + 1)]).collect()),
    }
}

/// A machine of a kind that goes by the seed, and its case.
pub fn drawn(seed: u64, lacks: Lacks) -> Drawn {
    let kind = [MachineKind::CoreXy, MachineKind::HFrame, MachineKind::DualBelt][(seed % 3) as usize];
    let mut chance = Chance::new(7_000_003 * (1 + lacks as u64) + seed);
    let wide = ["bridge.travel={ min = -9, max = 9 }", "cart.travel={ min = -9, max = 9 }"];
    let plain = Case::read_with(stage(kind), &wide).unwrap();
    let (own, tied) = belts(kind);
    let mut values = vec![
        ("bridge.mass".to_string(), chance.between(0.7, 1.1)),
        ("cart.mass".to_string(), chance.between(0.3, 0.45)),
        ("bridge.friction.viscous".to_string(), chance.between(8.0, 16.0)),
        ("cart.friction.viscous".to_string(), chance.between(5.0, 12.0)),
        ("bridge.friction.coulomb".to_string(), chance.between(1.0, 2.0)),
        ("cart.friction.coulomb".to_string(), chance.between(0.6, 1.2)),
    ];
    let coulomb = [values[4].1, values[5].1];
    let mut truth: Vec<String> = values.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let mut stiffness: Vec<f64> = plain.machine.belt.stiffness.iter().copied().collect();
    for set in own.iter().map(std::slice::from_ref).chain(tied.iter().map(Vec::as_slice)) {
        let factor = chance.between(0.8, 1.2);
        for key in set {
            let span: usize = key.rsplit('.').next().unwrap().parse().unwrap();
            stiffness[span] *= factor;
            if *key == set[0] {
                values.push((set.join(" = "), stiffness[span]));
            }
        }
    }
    truth.push(format!("belt.stiffness={stiffness:?}"));
    let geometry = kind.geometry();
    let drive = (chance.uniform() * geometry.drives.len() as f64) as usize;
    let at = &geometry.drives[drive];
    let slide = usize::from(chance.uniform() < 0.5);
    let (name, dry) = (["bridge", "cart"][slide], coulomb[slide]);
    let side = if chance.uniform() < 0.5 { -1.0 } else { 1.0 };
    let inputs: Vec<Vec<f64>> = geometry.drives.iter().map(|_| levels(&mut chance)).collect();
    let most = inputs[drive].iter().fold(0.0f64, |most, u| most.max(u.abs()));
    let (part, size, changes) = match lacks {
        Lacks::Nothing => (String::new(), 0.0, vec![]),
        Lacks::Constants => {
            let (motor, size) = (plain.machine.drives[drive].motor, 1.0 + 0.15 * side);
            let [torque, back] = [motor.torque_constant, motor.back_emf_constant].map(|value| size * value);
            let changes = vec![
                format!("{}motor.torque_constant={torque}", at.key),
                format!("{}motor.back_emf_constant={back}", at.key),
            ];
            (at.label.name.to_string(), size, changes)
        }
        // The logs show the ratio of two encoders, and hardly which of them is off.
        Lacks::Scale => (String::new(), 1.0 + side * chance.between(0.01, 0.03), vec![]),
        Lacks::Delay => (String::new(), chance.between(0.3e-3, 1.5e-3), vec![]),
        Lacks::DriveDelay => (at.label.name.to_string(), chance.between(0.3e-3, 1.5e-3), vec![]),
        Lacks::Limit => {
            let limit = most * chance.between(0.4, 0.75);
            (at.label.name.to_string(), limit, vec![format!("{}amplifier.voltage_limit={limit}", at.key)])
        }
        Lacks::SensorPlay => {
            let width = chance.between(0.1e-3, 0.4e-3) / plain.machine.pulley_radius;
            (format!("{}_angle", geometry.label(at.pulley).key), width, vec![])
        }
        Lacks::Drag => {
            let c = chance.between(10.0, 30.0);
            let point = |k: i32| {
                let v = 0.05 * f64::from(k);
                format!("[{v}, {}]", -c * v * v.abs())
            };
            let points: Vec<String> = (-40..=40).map(point).collect();
            (name.to_string(), c, vec![format!("{name}.force_by_speed=[{}]", points.join(", "))])
        }
        Lacks::Stribeck => {
            let (force, velocity) = (chance.between(1.0, 2.0), chance.between(0.03, 0.06));
            let curve = format!("{name}.friction.stribeck={{ force = {force}, velocity = {velocity} }}");
            (name.to_string(), force, vec![curve])
        }
        Lacks::Breakaway => {
            let size = dry * chance.between(1.6, 2.5);
            (name.to_string(), size, vec![format!("{name}.friction.static={size}")])
        }
        Lacks::Load => {
            let size = side * chance.between(0.4, 1.2);
            (name.to_string(), size, vec![format!("{name}.load={size}")])
        }
    };
    // Without the breakaway that the bodies of the files have.
    let frictions = [("bridge", 2), ("cart", 3)].map(|(key, first)| {
        format!("{key}.friction={{ viscous = {}, coulomb = {} }}", values[first].1, values[first + 2].1)
    });
    let all = wide.map(String::from).into_iter().chain(frictions).chain(truth).chain(changes);
    let all: Vec<String> = all.collect();
    let mut made = Case::read_with(stage(kind), &all.iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
    let time: Vec<f64> = (0..ROWS).map(|k| k as f64 * EVERY).collect();
    let experiment = &mut made.experiments[0];
    (experiment.until, experiment.every) = ((ROWS - 1) as f64 * EVERY, EVERY);
    for (index, (signal, values)) in experiment.inputs.iter_mut().zip(&inputs).enumerate() {
        let is_late = lacks == Lacks::Delay || lacks == Lacks::DriveDelay && index == drive;
        let late = if is_late { size } else { 0.0 };
        let times = time.iter().map(|t| t + late).collect();
        *signal = Signal::Sampled { times, values: values.clone(), hold: Hold::Zero };
    }
    let solver = if lacks == Lacks::Stribeck { Solver::General { tolerance: 1e-9 } } else { Solver::Exact };
    let run = simulate(&made.machine, experiment, solver).unwrap().trajectory;
    let mut outputs = Vec::new();
    for (index, at) in geometry.drives.iter().enumerate() {
        let name = format!("{}_angle", geometry.label(at.pulley).key);
        let quantity = Quantity::for_kind(kind).iter().copied().find(|own| own.name() == name).unwrap();
        let mut angle = run.get(&name).unwrap().to_vec();
        if lacks == Lacks::SensorPlay && index == drive {
            behind_play(&mut angle, size, chance.uniform());
        }
        let factor = if lacks == Lacks::Scale && index == drive { size } else { 1.0 };
        let read = |phi: f64, chance: &mut Chance| COUNT * (factor * phi / COUNT + 0.1 * chance.normal()).floor();
        outputs.push(output(quantity, angle.iter().map(|&phi| read(phi, &mut chance)).collect()));
    }
    // The model: frictions and belts as the file has them, without a breakaway.
    let frictions = ["bridge.friction={ viscous = 12, coulomb = 1.5 }", "cart.friction={ viscous = 8, coulomb = 0.9 }"];
    let mut case = Case::read_with(stage(kind), &[wide, frictions].concat()).unwrap();
    case.experiments.truncate(1);
    let log = Log {
        name: "all motors".into(),
        file: Default::default(),
        time,
        inputs,
        added: None,
        hold: Hold::Zero,
        reference: None,
        outputs,
        ended: None,
    };
    let experiment = &mut case.experiments[0];
    (experiment.until, experiment.every) = ((ROWS - 1) as f64 * EVERY, EVERY);
    experiment.inputs = log.signals();
    experiment.log = Some(Arc::new(log));
    let free = values.iter().map(|(key, _)| key.clone()).filter(|key| !key.contains(" = ")).collect();
    Drawn { case, plan: Plan { free, tied, ..Plan::default() }, values, part, size }
}
