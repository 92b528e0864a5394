//! Moves in closed loop: `taut move --json`, `summary.json`.

use super::simulation::{TieTold, is_determined};
use super::{ending, peak};
use crate::case::Move;
use crate::control::drives::{DriveGain, drive_gains};
use crate::control::{Accuracy, Deviation, DriveFigures, Loop, MoveRun, Worst};
use crate::machine::Machine;
use crate::metrics::LostSteps;
use crate::reach::feasible::Shortfall;
use crate::tune::trouble::Trouble;
use serde_json::{Map, Value, json};

/// One move after it ran.
#[derive(Debug, Clone, Copy)]
pub struct Moved<'a> {
    /// The machine that the case describes.
    pub machine: &'a Machine,
    /// The move as the case has it.
    pub motion: &'a Move,
    /// Its run.
    pub run: &'a MoveRun,
    /// Its run on axes whose parameters the controller does not know.
    pub worst: Option<&'a Worst>,
    /// The trouble of its loop, where it has one.
    pub trouble: Option<&'a Trouble>,
    /// The limits that its reference exceeds.
    pub shortfalls: &'a [Shortfall],
    /// Its files.
    pub files: &'a [String],
}

/// The moves of a case of this title under a controller of this name, on this stage.
pub fn moves(title: &str, structure: &str, timing: &Loop, machine: &Machine, moved: &[Moved]) -> Value {
    let gain =
        |gain: DriveGain| json!({ "system": gain.system, "name": gain.name, "value": gain.value, "unit": gain.unit });
    json!({
        "schema": super::identity("move"),
        "title": title,
        "version": env!("CARGO_PKG_VERSION"),
        "structure": structure,
        "every_s": timing.every,
        "delay_s": timing.delay,
        "moves": moved.iter().map(motion).collect::<Vec<_>>(),
        "drive_gains": drive_gains(machine).into_iter().map(gain).collect::<Vec<_>>(),
    })
}

fn deviation(deviation: Deviation) -> Value {
    json!({ "peak_m": deviation.peak.value, "time_s": deviation.peak.time, "rms_m": deviation.rms, "last_m": deviation.last })
}

/// A limit that a reference exceeds.
pub(super) fn shortfall(short: &Shortfall) -> Value {
    json!({
        "limit": short.limit, "time_s": short.time, "position_m": short.position, "needed": short.needed,
        "allowed": short.allowed, "unit": short.unit, "words": short.words,
    })
}

fn of_drive(drive: &DriveFigures, lost: Option<LostSteps>) -> Map<String, Value> {
    let value = match lost {
        // The phases of a stepper have voltages of their own; in open loop it has no samples.
        Some(lost) => json!({
            "lost_steps": lost.at_end,
            "slips": lost.slips,
            "first_slip_s": lost.first_slip,
            "limited_s": drive.limited,
            "command_turns_per_s": drive.restlessness,
        }),
        None => json!({
            "peak_voltage_V": peak(drive.voltage.0),
            "rms_voltage_V": drive.voltage.1,
            "limited_s": drive.limited,
            "amplifier_limited_s": drive.amplifier_limited,
            "energy_in_J": drive.energy.0,
            "energy_back_J": drive.energy.1,
            "command_turns_per_s": drive.restlessness,
        }),
    };
    let both = json!({
        "following_error": deviation(drive.following),
        "peak_current_A": peak(drive.current.0),
        "rms_current_A": drive.current.1,
    });
    [both, value].into_iter().filter_map(|value| value.as_object().cloned()).flatten().collect()
}

/// One of them.
pub fn motion(done: &Moved) -> Value {
    let (run, figures) = (done.run, &done.run.figures);
    let (word, time) = ending(run.outcome.ending, run.metrics.end);
    let geometry = done.machine.geometry();
    let names = geometry.slides.iter().map(|slide| geometry.label(slide.body).key);
    // Of a stepper, commanded minus true position at the end.
    let remaining = |number: usize| run.metrics.loads.get(number).and_then(|load| load.command_error);
    let loads = names.zip(&figures.loads).zip(&done.motion.profiles).enumerate();
    let loads = loads.map(|(number, ((name, load), profile))| {
        let mut told = json!({
            "error": deviation(load.error), "overshoot_m": load.overshoot, "target_m": profile.target(),
        });
        if let (Some(error), Some(told)) = (remaining(number), told.as_object_mut()) {
            told.insert("remaining_error_m".into(), json!(error));
        }
        (name.to_string(), told)
    });
    let lost = |number: usize| run.metrics.drives.get(number).and_then(|drive| drive.lost_steps);
    let drives = geometry.drives.iter().zip(&figures.drives).enumerate();
    let drives =
        drives.map(|(number, (at, drive))| (geometry.drive_key(at).to_string(), json!(of_drive(drive, lost(number)))));
    let mut value = json!({
        "name": done.motion.name,
        "files": done.files,
        "ending": { "word": word, "time_s": time },
        "profile_end_s": done.motion.profile().end(),
        "loads": loads.collect::<Map<_, _>>(),
        "drives": drives.collect::<Map<_, _>>(),
        "window_m": done.motion.window,
        "settling_s": figures.settling,
        "peak_stretch": run.metrics.spans.iter().map(|span| peak(span.peak_stretch)).collect::<Vec<_>>(),
        "peak_force_N": run.metrics.spans.iter().map(|span| peak(span.peak_force)).collect::<Vec<_>>(),
        "samples": run.samples.0,
        "limited_samples": run.samples.1,
        "events": run.outcome.events.len(),
        "position_error_m": run.outcome.error.map(|error| error.value),
        "position_error_basis": run.outcome.error.map(|_| Accuracy::basis(done.machine, run)),
        "is_determined": is_determined(&run.outcome),
        "decided_within_rounding": TieTold::from_outcome(&run.outcome),
        "trouble": done.trouble.map(|trouble| json!({
            "kind": trouble.kind.word(), "frequency_Hz": trouble.frequency, "cause": trouble.cause, "words": trouble.words,
        })),
        "shortfalls": done.shortfalls.iter().map(shortfall).collect::<Vec<_>>(),
    });
    let Value::Object(object) = &mut value else { return value };
    if let Some(contour) = figures.contour {
        object.insert("contour_error".into(), deviation(contour));
    }
    // Of an axis the figures of its cart and its drive stand beside the others.
    if let ([cart], [drive]) = (&figures.loads[..], &figures.drives[..]) {
        object.insert("target_m".into(), json!(done.motion.profile().target()));
        object.insert("cart_error".into(), deviation(cart.error));
        object.insert("overshoot_m".into(), json!(cart.overshoot));
        object.extend(of_drive(drive, lost(0)));
        if let Some(error) = remaining(0) {
            object.insert("remaining_error_m".into(), json!(error));
        }
    }
    if let Some(worst) = done.worst {
        object.insert(
            "spread".into(),
            json!({
                "cart_error_m": worst.error, "axis": worst.axis, "last_m": worst.last,
                "settled": worst.settled, "axes": worst.axes,
            }),
        );
    }
    value
}
