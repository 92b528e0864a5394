//! How fast and how quickly the drives move the load, and what their belt takes then.

use super::direction::{Direction, Resistance};
use super::{FiguresAt, Group, Note, stepper, told};
use crate::case::Case;
use crate::design::Design;
use crate::machine::{Amplifier, AmplifierMode, BeltModel, BeltSheet, Machine, Motor};
use crate::signal::Signal;

pub(super) fn limits(
    case: &Case,
    directions: &[Direction],
    origin: &FiguresAt,
    notes: &mut Vec<Note>,
) -> Option<Group> {
    let machine = &case.machine;
    if machine.stepper().is_some() {
        return stepper::limits(machine);
    }
    let inputs = case.experiments.iter().flat_map(|done| done.inputs.iter().map(|input| (input, done.until)));
    let bounds = case.controller.as_ref().map(Design::bounds).unwrap_or_default();
    let most = most(bounds.command, inputs);
    let r = machine.pulley_radius;
    let power =
        |unit: &crate::machine::DriveUnit| Power::new(&unit.motor, &unit.amplifier, r, (most.as_ref(), bounds.current));
    let Some(powers) = machine.drives.iter().map(power).collect::<Option<Vec<_>>>() else {
        let text = "nothing bounds the input: give amplifier.voltage_limit or current_limit to see the largest speed and \
                    acceleration";
        notes.push(Note { code: "no-limit", text: text.to_string() });
        return None;
    };
    let least = powers.iter().map(|(power, _)| power.force).fold(f64::INFINITY, f64::min);
    let mut group =
        Group::new("limits", if powers.len() == 2 { "Limits, both drives pulling alike" } else { "Limits" });
    let name = format!("largest force of {} motor at the belt", if powers.len() == 1 { "the" } else { "a" });
    group.add("largest_force", name, least, "N").how(format!("by {}", powers[0].1));
    let together = |direction: &Direction| Together {
        drives: direction.movers.iter().map(|drive| powers[*drive].0).collect(),
        is_alike: direction.is_alike(machine),
    };
    for direction in directions {
        let sides = if direction.is_one_sided(machine) { &[1.0, -1.0][..] } else { &[1.0] };
        for side in sides {
            reached(&mut group, machine, direction, (&together(direction), *side), notes);
        }
    }
    if machine.belt.model != BeltModel::Rigid {
        for (direction, stretch) in directions.iter().zip(&origin.stretch) {
            let stretch = together(direction).force(0.0) * stretch;
            let [name, how] = match directions {
                [_] => ["stretch of the belt under this force", "at the cart, the drive held"],
                _ => ["largest stretch", "all pulling, the drive pulleys held"],
            };
            group.add(direction.key("largest_stretch"), direction.words(name), stretch, "m").how(how);
        }
        safety(&mut group, notes, &machine.belt.sheet, machine.belt.pretension, r, least);
        notes.extend(little_pretension(machine, least));
    }
    Some(group)
}

/// The largest acceleration and speed in a direction; `side` is the sign of the speed.
fn reached(
    group: &mut Group,
    machine: &Machine,
    direction: &Direction,
    (together, side): (&Together, f64),
    notes: &mut Vec<Note>,
) {
    let (end, words) = if side > 0.0 { ("", "") } else { ("_backward", " backward") };
    let Resistance { coulomb, viscous } = direction.resistance(machine, side);
    let against = -side * machine.force_at(direction.number, 0.0);
    let force = together.force(0.0);
    let left = (force - coulomb - against) / direction.accelerated();
    let name = format!("{}{words}", direction.words("largest acceleration"));
    group
        .add(direction.key("largest_acceleration") + end, name, left.max(0.0), "m/s^2")
        .how("at low speed, against friction");
    let line = machine.slide(direction.number).and_then(|slide| slide.forces.by_speed.as_ref());
    let by_speed = |speed: f64| line.map_or(0.0, |line| side * line.value(side * speed));
    let speed = together.speed_against(|speed| coulomb + viscous * speed + against - by_speed(speed));
    match speed {
        Some(speed) => {
            let name = format!("{}{words}", direction.words("largest speed"));
            group.add(direction.key("largest_speed") + end, name, speed, "m/s").how("at steady state");
        }
        None => notes.push(Note {
            code: "no-largest-speed",
            text: "the speed is unlimited: in current mode give amplifier.voltage_limit".to_string(),
        }),
    }
    if left <= 0.0 {
        let whose = if direction.movers.len() == 1 { "the motor" } else { "the motors" };
        let text =
            format!("the largest force of {whose}, {}, does not move {}{words}", told(force, "N"), direction.name);
        notes.push(Note { code: "does-not-move", text });
    }
}

/// Speeds between which the largest one is looked for, m/s, and the ratio of adjacent ones.
const LEAST_SPEED: f64 = 1e-6;
const MOST_SPEED: f64 = 1e4;
const RATIO: f64 = 1.01;

/// The power of a drive: at the belt, per direction alike.
#[derive(Debug, Clone, Copy)]
struct Power {
    /// Largest force at standstill, N.
    pub force: f64,
    /// Largest voltage at the terminals, V, where one is known.
    pub voltage: Option<f64>,
    /// Force per volt at the terminals, N/V.
    pub per_volt: f64,
    /// Force per speed that the back-EMF takes at that voltage, N s/m.
    pub brake: f64,
}

/// Where the largest input comes from.
struct Most {
    /// V or A into the amplifier.
    pub input: f64,
    /// In words.
    pub from: &'static str,
}

/// The largest input that a machine gets: of its controller's limit, or of its experiments.
fn most<'a>(limit: Option<f64>, inputs: impl Iterator<Item = (&'a Signal, f64)>) -> Option<Most> {
    if let Some(input) = limit {
        return Some(Most { input, from: "the controller's limit" });
    }
    const LOOKS: usize = 20_000;
    let peak = |(signal, until): (&Signal, f64)| match signal {
        Signal::Sampled { values, .. } => values.iter().fold(0.0, |most, value| value.abs().max(most)),
        signal => {
            let at = |k: usize| signal.value(until * k as f64 / LOOKS as f64).abs();
            (0..=LOOKS).map(at).fold(0.0, f64::max)
        }
    };
    let input = inputs.map(peak).fold(0.0, f64::max);
    (input > 0.0).then_some(Most { input, from: "the largest input of the experiments" })
}

impl Power {
    /// Of a drive with the largest input that it gets, or none, and the limit of a current loop, A; and what limits it,
    /// in words.
    pub fn new(
        motor: &Motor,
        amplifier: &Amplifier,
        r: f64,
        (most, held): (Option<&Most>, Option<f64>),
    ) -> Option<(Self, String)> {
        let n = motor.gear_ratio;
        let per_ampere = motor.gear_efficiency * n * motor.torque_constant / r;
        let per_volt = per_ampere / motor.resistance;
        let brake = per_volt * n * motor.back_emf_constant / r;
        let commanded = most.map(|most| (amplifier.gain * most.input).abs());
        let mut words: Vec<&str> = Vec::new();
        let (mut volts, mut amperes) = (amplifier.voltage_limit, amplifier.current_limit);
        let own = match amplifier.mode {
            AmplifierMode::Voltage => &mut volts,
            AmplifierMode::Current => &mut amperes,
            AmplifierMode::Position => return None,
        };
        // What is never commanded is never reached.
        match (*own, commanded) {
            (Some(limit), Some(commanded))
                if commanded < limit && most.is_some_and(|most| !most.is_of_experiments()) =>
            {
                *own = Some(commanded);
            }
            (None, Some(commanded)) => *own = Some(commanded),
            (Some(_), _) | (None, None) => {}
        }
        let is_limit = match amplifier.mode {
            AmplifierMode::Voltage => amplifier.voltage_limit == volts,
            AmplifierMode::Current => amplifier.current_limit == amperes,
            AmplifierMode::Position => return None,
        };
        if !is_limit && let Some(most) = most {
            words.push(most.from);
        }
        if amplifier.voltage_limit.is_some() && volts == amplifier.voltage_limit {
            words.push("amplifier.voltage_limit");
        }
        if amplifier.current_limit.is_some() && amperes == amplifier.current_limit {
            words.push("amplifier.current_limit");
        }
        if let Some(held) = held.filter(|held| amperes.is_none_or(|amperes| *held < amperes)) {
            words.retain(|word| *word != "amplifier.current_limit");
            words.push("the limit of the controller's current loop");
            amperes = Some(held);
        }
        let of_volts = volts.map(|volts| per_volt * volts);
        let of_amperes = amperes.map(|amperes| per_ampere * amperes);
        let force = match (of_volts, of_amperes) {
            (Some(a), Some(b)) => a.min(b),
            (Some(a), None) | (None, Some(a)) => a,
            (None, None) => return None,
        };
        Some((Self { force, voltage: volts, per_volt, brake }, words.join(" and ")))
    }

    /// Largest force at a speed, N.
    fn at(&self, speed: f64) -> f64 {
        // k (V − K_e n v / r), within the force at standstill
        self.voltage.map_or(self.force, |volts| (self.per_volt * volts - self.brake * speed).min(self.force))
    }
}

/// The drives of a direction.
struct Together {
    drives: Vec<Power>,
    /// True if they pull alike, none harder than the weakest can; otherwise their forces add up.
    is_alike: bool,
}

impl Together {
    /// Their largest force at a speed, N.
    fn force(&self, speed: f64) -> f64 {
        let all = self.drives.iter().map(|power| power.at(speed));
        match self.is_alike {
            true => self.drives.len() as f64 * all.fold(f64::INFINITY, f64::min),
            false => all.sum(),
        }
    }

    /// The lowest speed at which the force is used up by what resists at that speed, m/s; none below [`MOST_SPEED`].
    fn speed_against(&self, resists: impl Fn(f64) -> f64) -> Option<f64> {
        let left = |speed: f64| self.force(speed) - resists(speed);
        if left(0.0) <= 0.0 {
            return Some(0.0);
        }
        let mut ends = [0.0, LEAST_SPEED];
        while left(ends[1]) > 0.0 {
            ends = [ends[1], ends[1] * RATIO];
            if ends[1] > MOST_SPEED {
                return None;
            }
        }
        for _ in 0..60 {
            let middle = 0.5 * (ends[0] + ends[1]);
            ends[usize::from(left(middle) <= 0.0)] = middle;
        }
        Some(ends[1])
    }
}

impl Most {
    fn is_of_experiments(&self) -> bool {
        self.from.ends_with("experiments")
    }
}

/// Teeth and tension against the largest force of one drive.
fn safety(group: &mut Group, notes: &mut Vec<Note>, sheet: &BeltSheet, pretension: Option<f64>, r: f64, force: f64) {
    if let Some((in_mesh, carried)) = sheet.mesh(r) {
        group.add("teeth_in_mesh", "teeth in mesh at the drive pulley", in_mesh, "");
        if let Some(carried) = carried {
            group.add("tooth_force", "force that the teeth carry at rest", carried, "N");
            group
                .add("tooth_safety", "safety of the teeth", carried / force, "")
                .how("against the largest force of the motor");
            unsafe_note(notes, "teeth-overloaded", carried, force, "the teeth in mesh carry");
        }
    }
    if let Some(allowed) = sheet.allowed_tension {
        let tension = pretension.unwrap_or(0.0) + force;
        group.add("allowed_tension", "allowed tension", allowed, "N");
        group.add("largest_tension", "largest tension of a span", tension, "N").how(match pretension {
            Some(_) => "pretension and the largest force of the motor",
            None => "the largest force of the motor; no pretension is given",
        });
        group.add("tension_safety", "safety of the tension", allowed / tension, "");
        unsafe_note(notes, "belt-overloaded", allowed, tension, "the belt may have a tension of");
    }
}

fn unsafe_note(notes: &mut Vec<Note>, code: &'static str, allowed: f64, there: f64, words: &str) {
    if allowed < there {
        let text = format!("{words} {}, and the motor can bring it to {}", told(allowed, "N"), told(there, "N"));
        notes.push(Note { code, text });
    }
}

/// Of a belt that the largest force makes slack.
fn little_pretension(machine: &Machine, force: f64) -> Option<Note> {
    let pretension = machine.belt.pretension.filter(|pretension| *pretension < 0.5 * force)?;
    let text = format!(
        "a pretension of {} is less than half of the largest force, {}: a span may go slack",
        told(pretension, "N"),
        told(force, "N")
    );
    Some(Note { code: "little-pretension", text })
}
