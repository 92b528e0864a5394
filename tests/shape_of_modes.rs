//! Input shapers from the modes of a machine, without a measurement: single ones, and pairs.

use crate::common::chance::Chance;
use taut::case::Case;
use taut::control::shaper::{Firmware, Shaper, ShaperKind, residual_vibration};
use taut::control::shaping::{Criterion, Target, choose};
use taut::linear::{Operation, Root, System};
use taut::machine::{Machine, MachineKind};
use taut::reach::resonance::{Drive, Resonance, reaches, resonances};

/// The shaper that is chosen for a stage leaves little of each of its modes, along all of its travel.
#[test]
fn a_stage_without_a_measurement() {
    for case in [
        "stages/printer-axis/printer-axis.toml",
        "stages/sollmann-jouaneh/table4.toml",
        "stages/two-mass/two-mass.toml",
    ] {
        for drive in [Drive::Held, Drive::Free] {
            let machine = Case::read(case).unwrap().machine;
            let modes = resonances(&machine, drive, 0).unwrap();
            assert!(modes.iter().all(|mode| mode.frequency > 1.0 && mode.damping >= 0.0 && mode.share <= 1.0));
            let main = modes.iter().find(|mode| mode.share == 1.0).unwrap();
            let criterion = Criterion::default().with_damping(main.damping).unwrap();
            // Where nothing is uncertain the shortest one does, at the mode's own frequency.
            let sure = choose(Target::Modes { modes: &modes[..1], uncertainty: 0.0 }, &criterion).unwrap();
            assert_eq!(sure.best().shaper.kind, ShaperKind::Zv);
            assert!((sure.best().shaper.frequency / modes[0].frequency - 1.0).abs() < 0.03, "{sure:?}");
            let choice = choose(Target::Modes { modes: &modes, uncertainty: 0.1 }, &criterion).unwrap();
            let best = &choice.best().shaper;
            for mode in &modes {
                let left = mode.share * residual_vibration(best.impulses(), mode.frequency, mode.damping);
                assert!(left < 0.15, "{case} {drive:?}: {left} of {mode:?} behind {best:?}");
            }
        }
    }
    let rigid = Case::read("stages/emps/emps.toml").unwrap().machine;
    assert!(resonances(&rigid, Drive::Held, 0).unwrap_err().what.contains("rigid"));
}

/// The modes of a gantry are those of its equations of motion: with free motors those of `paper/h-frame.md`, with
/// motors held of bridge and cart on all spans, K = Σ k dᵀd over both.
#[test]
fn a_gantry_has_modes_of_each_coordinate() {
    let k = [132_760.0, 132_760.0, 58_885.0];
    // d of the three spans over bridge and cart
    let (xx, yy) = (k[0] + k[1] + 4.0 * k[2], k[0] + k[1]);
    let held = [xx / 1.2, yy / 0.362].map(|squared: f64| squared.sqrt() / std::f64::consts::TAU);
    let machine = Case::read("stages/h-frame/h-frame.toml").unwrap().machine;
    for (coordinate, frequency) in held.into_iter().enumerate() {
        // Alike on both sides, bridge and cart do not know of each other.
        let modes = resonances(&machine, Drive::Held, coordinate).unwrap();
        assert_eq!(modes.len(), 1, "{modes:?}");
        assert!((modes[0].frequency / frequency - 1.0).abs() < 1e-9, "{modes:?} {frequency}");
    }
    for (kind, wanted) in
        [("h-frame", [196.643_946_994, 220.198_687_165]), ("core-xy", [214.360_612_188, 263.042_776_685])]
    {
        let machine = Case::read(format!("stages/{kind}/{kind}.toml")).unwrap().machine;
        let mut found: Vec<f64> = (0..2)
            .flat_map(|coordinate| resonances(&machine, Drive::Free, coordinate).unwrap())
            .map(|mode| mode.frequency)
            .collect();
        found.sort_by(f64::total_cmp);
        found.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-9);
        assert_eq!(found.len(), 2, "{kind}: {found:?}");
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found / wanted - 1.0).abs() < 1e-9, "{kind}: {found} {wanted}");
        }
    }
    // Spans that follow: along the whole area, each mode between its least and its greatest of `taut modes`.
    let machine = Case::read("stages/core-xy/follows.toml").unwrap().machine;
    let modes = resonances(&machine, Drive::Free, 0).unwrap();
    let [low, high] = [f64::min, f64::max]
        .map(|pick| modes.iter().filter(|mode| mode.share == 1.0).map(|mode| mode.frequency).reduce(pick).unwrap());
    assert!((low - 179.4).abs() < 0.1 && (high - 222.7).abs() < 0.1, "{low} {high}");
}

/// Two modes far apart: one shaper that covers both would be long.
fn two_modes() -> Vec<Resonance> {
    let mode = |frequency: f64, share: f64| Resonance { position: 0.0, frequency, damping: 0.02, share };
    vec![mode(30.0, 1.0), mode(70.0, 0.8)]
}

/// A pair leaves of every mode the product of what its parts leave, and its figures are those of its impulses.
#[test]
fn a_pair_is_one_shaper_behind_another() {
    let modes = two_modes();
    let criterion = Criterion { pairs: true, ..Criterion::default().with_damping(0.02).unwrap() };
    let choice = choose(Target::Modes { modes: &modes, uncertainty: 0.05 }, &criterion).unwrap();
    assert!(choice.pairs.len() == 3 && choice.pairs.windows(2).all(|pair| pair[0].score <= pair[1].score));
    for pair in &choice.pairs {
        let impulses = pair.impulses();
        let sum: f64 = impulses.iter().map(|(_, a)| a).sum();
        assert!((sum - 1.0).abs() < 1e-12 && impulses.windows(2).all(|pair| pair[0].0 < pair[1].0), "{pair:?}");
        let [a, b] = &pair.parts;
        assert!(a.frequency <= b.frequency);
        for (f, zeta) in [(10.0, 0.02), (31.0, 0.1), (77.0, 0.0)] {
            let product = a.residual_vibration(f, zeta) * b.residual_vibration(f, zeta);
            assert!((residual_vibration(&impulses, f, zeta) - product).abs() < 1e-12);
        }
        assert!((taut::control::shaper::smoothing(&impulses, &criterion.corner) - pair.smoothing).abs() < 1e-15);
    }
}

/// The score alone has its least at infinite frequencies, where nothing is smoothed and everything vibrates: pairs ran
/// there. They leave hardly more than the least that their forms can, and of those the best score is taken.
#[test]
fn two_modes_have_a_shaper_each() {
    let modes = two_modes();
    let criterion = Criterion { pairs: true, ..Criterion::default().with_damping(0.02).unwrap() };
    let target = Target::Modes { modes: &modes, uncertainty: 0.05 };
    let choice = choose(target, &criterion).unwrap();
    let pair = &choice.pairs[0];
    assert!(pair.vibration < 0.1, "{pair:?}");
    // Nothing of these forms on a grid of its own leaves as little and has a score that is better by a tenth.
    let [one, other] = pair.parts.each_ref().map(|part| part.form);
    let mut looked = 0;
    for f in (0..80).map(|k| 20.0 + 0.5 * f64::from(k)) {
        for g in (0..160).map(|k| 20.0 + 0.5 * f64::from(k)) {
            let parts =
                [(one, f), (other, g)].map(|(form, f)| Shaper::formed(form, Firmware::Klipper, f, 0.02).unwrap());
            let v = |f: f64| parts.iter().map(|part| part.residual_vibration(f, 0.02)).product::<f64>();
            let left = modes
                .iter()
                .flat_map(|mode| [0.95, 0.975, 1.0, 1.025, 1.05].map(|u| v(u * mode.frequency) * mode.share));
            let left = left.fold(0.0, f64::max);
            if left <= 1.02 * pair.vibration {
                let smoothing = taut::control::shaper::smoothing(&convolved(&parts), &criterion.corner);
                let score = 1e3 * smoothing * (left.powf(1.5) + 0.2 * left + 0.01);
                assert!(score > 0.9 * pair.score, "{score} of {parts:?} against {pair:?}");
                looked += 1;
            }
        }
    }
    assert!(looked > 0, "{pair:?}");
    // The line for a case file is read as what it is.
    let case = "stages/sollmann-jouaneh/controllers/pid-shaped.toml";
    let change = format!("controller.{}", pair.line().replacen(" = ", "=", 1));
    let read = Case::read_with(case, &[&change]).unwrap().controller.unwrap().shaper;
    assert_eq!(read.len(), pair.impulses().len());
    for ([t, a], (time, amplitude)) in read.iter().zip(pair.impulses()) {
        assert!((t - time).abs() < 1e-9 && (a - amplitude).abs() < 1e-8, "{read:?} {pair:?}");
    }
    // With less smoothing allowed than any has there is none, which is said and no error.
    let little = Criterion { max_smoothing: Some(0.9 * pair.smoothing), ..criterion.clone() };
    if let Ok(choice) = choose(target, &little) {
        assert!(choice.pairs.iter().all(|pair| pair.smoothing <= little.max_smoothing.unwrap()));
    }
}

fn convolved(parts: &[Shaper; 2]) -> Vec<(f64, f64)> {
    let [one, other] = parts;
    let mut all = Vec::new();
    for (t, a) in one.impulses() {
        all.extend(other.impulses().iter().map(|(s, b)| (t + s, a * b)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// A mode whose frequency falls to a half along the travel was covered by the widest shaper alone.
#[test]
fn a_mode_that_moves_far_is_told_with_its_range() {
    let mode = |k: u32| Resonance {
        position: 0.05 * f64::from(k),
        frequency: 60.0 - 1.5 * f64::from(k),
        damping: 0.03 + 1e-4 * f64::from(k),
        share: 1.0,
    };
    let second = |k: u32| Resonance { frequency: 150.0 + 3.0 * f64::from(k), share: 0.1, ..mode(k) };
    let modes: Vec<Resonance> = (0..=20).flat_map(|k| [mode(k), second(k)]).collect();
    let all = reaches(&modes);
    assert_eq!(all.iter().map(|reach| reach.frequency).collect::<Vec<_>>(), [[30.0, 60.0], [150.0, 210.0]]);
    assert_eq!((all[0].damping, all[0].share, all[1].share), ([0.03, 0.032], 1.0, 0.1));
    let criterion = Criterion { pairs: true, ..Criterion::default().with_damping(0.03).unwrap() };
    let choice = choose(Target::Modes { modes: &modes, uncertainty: 0.05 }, &criterion).unwrap();
    let pair = &choice.pairs[0];
    // What the pair leaves anywhere is what it says it leaves at worst.
    let impulses = pair.impulses();
    let worst = modes.iter().map(|mode| mode.share * residual_vibration(&impulses, mode.frequency, mode.damping));
    assert!(worst.fold(0.0, f64::max) <= pair.vibration + 1e-12);
    assert!(pair.vibration < 0.05 && pair.smoothing > 0.0, "{pair:?} {:?}", choice.best());
}

/// An axis or plotter with compliant gears and no damping, whose encoder is at this place.
fn with_gears(kind: MachineKind, model: &str, place: &str, chance: &mut Chance) -> Machine {
    let name = kind.word();
    let mut number = |low: f64, high: f64| chance.scaled(low, high);
    let motor = format!(
        "torque_constant = 0.05\nback_emf_constant = 0.05\nresistance = 1\nrotor_inertia = {}\ngear_ratio = {}\n\
         gear_efficiency = {}\ngear_stiffness = {}\nbacklash = 1e-3\n[amplifier]\nmode = \"current\"\n",
        number(1e-6, 1e-4),
        number(1.0, 6.0),
        number(0.6, 1.0),
        number(20.0, 2000.0),
    );
    let masses = match kind {
        MachineKind::Axis => {
            format!("[idler_pulley]\ninertia = {}\n[cart]\nmass = {}\n", number(1e-6, 1e-4), number(0.2, 4.0))
        }
        _ => format!("[bridge]\nmass = {}\n[cart]\nmass = {}\n", number(0.5, 4.0), number(0.2, 2.0)),
    };
    let spans: Vec<String> = kind.geometry().spans.iter().map(|_| number(2e4, 4e5).to_string()).collect();
    let text = format!(
        "kind = \"{name}\"\n[motor]\n{motor}[drive_pulley]\nradius = 0.01\ninertia = {}\n{masses}[belt]\n\
         {model}stiffness = [{}]\n[encoder]\nat = \"{place}\"\nlines = 500\n",
        number(1e-6, 1e-4),
        spans.join(", ")
    );
    Case::from_text("gears.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}")).machine
}

/// Frequencies of the linear model, Hz, with what the encoder reads held: a rotor by an enormous inertia.
fn by_the_linear_model(machine: &Machine, drive: Drive, place: &str) -> Vec<f64> {
    let (mut machine, mut operation) = (machine.clone(), Operation::default());
    match (drive, place) {
        (Drive::Free, _) => {}
        (Drive::Held, "motor") => machine.drives.iter_mut().for_each(|unit| unit.motor.rotor_inertia = 1e4),
        (Drive::Held, _) => machine.geometry().drives.iter().for_each(|at| operation.held[at.pulley] = true),
    }
    let poles = System::new(&machine, operation).unwrap().input(0).poles().unwrap();
    Root::from_values(&poles).into_iter().filter_map(Root::hertz).collect()
}

/// With a compliant gear the rotor is a body: its modes were those of a rigid gear. They are the poles of the linear
/// model.
#[test]
fn modes_of_compliant_gears_are_those_of_the_linear_model() {
    let mut chance = Chance::new(3);
    let kinds = [MachineKind::Axis, MachineKind::HFrame, MachineKind::CoreXy];
    let variants = kinds.into_iter().flat_map(|kind| {
        let models: &[&str] = if kind == MachineKind::Axis { &["", "model = \"two-mass\"\n"] } else { &[""] };
        models.iter().flat_map(move |model| ["motor", "drive_pulley"].map(|place| (kind, *model, place)))
    });
    for (kind, model, place) in variants.flat_map(|one| std::iter::repeat_n(one, 8)) {
        let machine = with_gears(kind, model, place, &mut chance);
        for drive in [Drive::Free, Drive::Held] {
            let poles = by_the_linear_model(&machine, drive, place);
            for coordinate in 0..kind.geometry().slides.len() {
                let modes = resonances(&machine, drive, coordinate).unwrap();
                assert!(modes.iter().any(|mode| mode.share == 1.0));
                for mode in modes {
                    let off =
                        poles.iter().map(|pole| (pole / mode.frequency - 1.0).abs()).fold(f64::INFINITY, f64::min);
                    assert!(off < 1e-6, "{kind:?} {model} {place} {drive:?}: {mode:?}, poles at {poles:?} Hz");
                }
            }
        }
    }
}
