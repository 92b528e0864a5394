//! Input shapers: their laws, the published tables, Klipper's printed results, and other people's numbers.

use crate::common::{data, wrong};
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use taut::case::Case;
use taut::control::compare::compare;
use taut::control::damping::fitted;
use taut::control::power_spectral_density;
use taut::control::shaper::{Corner, Firmware, Form, Pattern, Shaper, ShaperKind, TOLERANCE};
use taut::control::shaping::{ALLOWED_SMOOTHING, Criterion, Target, choose};
use taut::control::spectrum::{Axis, Spectrum};
use taut::log::{Accelerometer, read_accelerometer};
use taut::reach::resonance::{Drive, resonances};

const EXACT: [ShaperKind; 3] = [ShaperKind::Zv, ShaperKind::Mzv, ShaperKind::Zvd];

fn shaper(kind: ShaperKind, frequency: f64, damping: f64) -> Shaper {
    Shaper::new(kind, frequency, damping).unwrap()
}

fn any_kind() -> impl Strategy<Value = ShaperKind> {
    (0..ShaperKind::ALL.len()).prop_map(|i| ShaperKind::ALL[i])
}

/// Half of the impulses of an undamped ZV of 50 Hz are 5 ms before the middle and half 5 ms behind it: where a path of
/// 5 m/s² turns back, it is off by ½ a Σ A (t − t̄)² = 62.5 µm; at a right angle by √2 (v ½ 5 ms + ½ a ½ (5 ms)²), which
/// is less.
#[test]
fn the_usual_corner_is_smoothed_by_what_the_formula_says() {
    let smoothing = shaper(ShaperKind::Zv, 50.0, 0.0).smoothing(&Corner::default());
    assert!((smoothing - 62.5e-6).abs() < 1e-15, "{smoothing:e}");
}

proptest! {
    #[test]
    fn amplitudes_sum_to_one_and_times_ascend(kind in any_kind(), f in 0.1..2000.0, zeta in 0.0..0.9) {
        let shaper = shaper(kind, f, zeta);
        let sum: f64 = shaper.impulses().iter().map(|impulse| impulse.1).sum();
        prop_assert!((sum - 1.0).abs() < 1e-14);
        prop_assert!(shaper.impulses().iter().all(|impulse| impulse.1 > 0.0));
        prop_assert_eq!(shaper.impulses()[0].0, 0.0);
        prop_assert!(shaper.impulses().windows(2).all(|pair| pair[0].0 < pair[1].0));
        let periods = shaper.duration() * f * (1.0 - zeta * zeta).sqrt();
        let expected = [0.5, 0.75, 1.0, 1.0, 1.5, 2.0][kind as usize];
        prop_assert!((periods - expected).abs() < 1e-12);
    }

    /// Zero where zero is promised; the tolerance of EI without damping, and less with it.
    #[test]
    fn vibration_at_the_design_point(f in 0.1..2000.0, zeta in 0.0..0.9) {
        for kind in EXACT.into_iter().chain([ShaperKind::TwoHumpEi]) {
            let v = shaper(kind, f, zeta).residual_vibration(f, zeta);
            prop_assert!(v < 1e-12, "{:?}: {v}", kind);
        }
        for kind in [ShaperKind::Ei, ShaperKind::ThreeHumpEi] {
            let v = shaper(kind, f, zeta).residual_vibration(f, zeta);
            prop_assert!(v <= TOLERANCE + 1e-12, "{:?}: {v}", kind);
            let v = shaper(kind, f, 0.0).residual_vibration(f, 0.0);
            prop_assert!((v - TOLERANCE).abs() < 1e-12, "{:?}: {v}", kind);
        }
    }

    /// A mode that takes the impulses one after another keeps what the formula says.
    #[test]
    fn a_simulated_mode_keeps_that_vibration(
        kind in any_kind(), f in 1.0..100.0, zeta in 0.0..0.5, at in 0.3..2.0, plant_zeta in 0.0..0.5,
    ) {
        let shaper = shaper(kind, f, zeta);
        let (omega, z): (f64, f64) = (2.0 * PI * f * at, plant_zeta);
        let omega_d = omega * (1.0 - z * z).sqrt();
        // x″ + 2ζω x′ + ω² x = 0 between impulses, each of which adds its amplitude to the speed.
        let (mut x, mut v, mut now): (f64, f64, f64) = (0.0, 0.0, 0.0);
        for &(t, a) in shaper.impulses() {
            let h = t - now;
            let (s, c) = (omega_d * h).sin_cos();
            let decay = (-z * omega * h).exp();
            let b = (v + z * omega * x) / omega_d;
            (x, v) = (decay * (x * c + b * s), decay * (v * c - (omega * omega * x + z * omega * v) / omega_d * s));
            now = t;
            v += a;
        }
        // Amplitude of the free vibration that is left, of that which one impulse of the same sum makes now.
        let left = (x * omega_d).hypot(v + z * omega * x);
        prop_assert!((left - shaper.residual_vibration(f * at, z)).abs() < 1e-12);
    }

    /// The suggested acceleration is the one at which the smoothing is the one allowed.
    #[test]
    fn acceleration_and_smoothing_agree(kind in any_kind(), f in 15.0..200.0, zeta in 0.0..0.3) {
        let shaper = shaper(kind, f, zeta);
        let acceleration = shaper.max_acceleration(ALLOWED_SMOOTHING, 5e-3);
        let smoothing = shaper.smoothing(&Corner { acceleration, speed: 5e-3 });
        prop_assert!((smoothing - ALLOWED_SMOOTHING).abs() < 1e-12 * smoothing.max(1.0));
    }

    /// A higher frequency smooths less: what `max_smoothing` relies on.
    #[test]
    fn smoothing_falls_with_frequency(kind in any_kind(), f in 15.0..200.0, zeta in 0.0..0.3) {
        let corner = Corner::default();
        prop_assert!(shaper(kind, 1.01 * f, zeta).smoothing(&corner) < shaper(kind, f, zeta).smoothing(&corner));
    }
}

/// Singhose's EI shapers are those whose humps all reach the tolerance: Chebyshev's polynomials in cos(πx/2).
#[test]
fn humps_are_as_high_as_the_tolerance() {
    for (kind, humps) in [(ShaperKind::Ei, 2), (ShaperKind::TwoHumpEi, 3), (ShaperKind::ThreeHumpEi, 4)] {
        let shaper = shaper(kind, 1.0, 0.0);
        let beta = ((1.0 / TOLERANCE).acosh() / f64::from(humps)).cosh();
        for k in 0..=200 {
            let x = f64::from(k) / 100.0;
            // V = V_tol T_n(β cos(π x / 2))
            let y = beta * (PI * x / 2.0).cos();
            let chebyshev = match y.abs() {
                y if y <= 1.0 => (f64::from(humps) * y.acos()).cos(),
                y => (f64::from(humps) * y.acosh()).cosh(),
            };
            let v = shaper.residual_vibration(x, 0.0);
            assert!((v - TOLERANCE * chebyshev.abs()).abs() < 1e-12, "{kind:?} at {x}: {v}");
        }
    }
}

const TODAY: [(ShaperKind, f64); 3] =
    [(ShaperKind::Ei, 0.4), (ShaperKind::TwoHumpEi, 0.3), (ShaperKind::ThreeHumpEi, 0.2)];

/// Today's polynomials keep the equations that define EI shapers with damping, to a fifth of the tolerance: humps as
/// high as the tolerance, between them next to nothing.
#[test]
fn humps_are_near_the_tolerance_with_damping() {
    for (kind, most) in TODAY {
        for part in 0..=8 {
            let zeta = most * f64::from(part) / 8.0;
            let shaper = Shaper::formed(kind.into(), Firmware::Klipper, 1.0, zeta).unwrap();
            let sum: f64 = shaper.impulses().iter().map(|impulse| impulse.1).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{kind:?} {zeta}");
            let v: Vec<f64> =
                (0..=40_000).map(|k| shaper.residual_vibration(0.3 + 5e-5 * f64::from(k), zeta)).collect();
            let tops: Vec<f64> = v.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2]).map(|w| w[1]).collect();
            let bottoms = v.windows(3).filter(|w| w[1] < w[0] && w[1] <= w[2]).map(|w| w[1]);
            let humps = tops.iter().filter(|top| (**top / TOLERANCE - 1.0).abs() < 0.2).count();
            let wanted = [1, 2, 3][kind as usize - ShaperKind::Ei as usize];
            assert_eq!(humps, wanted, "{kind:?} {zeta}: {tops:?}");
            assert!(bottoms.fold(0.0, f64::max) < 0.016, "{kind:?} {zeta}");
            let own = shaper.residual_vibration(1.0, zeta);
            let expected = if kind == ShaperKind::TwoHumpEi { 0.0 } else { TOLERANCE };
            assert!((own - expected).abs() < 6e-3, "{kind:?} {zeta}: {own}");
        }
    }
}

/// Without damping they are what they were, but for the rounding of the polynomials.
#[test]
fn without_damping_little_has_changed() {
    for kind in ShaperKind::ALL {
        let [new, old] = Firmware::ALL.map(|firmware| Shaper::formed(kind.into(), firmware, 40.0, 0.0).unwrap());
        for (a, b) in new.impulses().iter().zip(old.impulses()) {
            let rounding = if EXACT.contains(&kind) { 1e-12 } else { 1e-3 };
            let is_near = (40.0 * (a.0 - b.0)).abs() < 3.0 * rounding && (a.1 - b.1).abs() < 2.0 * rounding;
            assert!(is_near, "{kind:?}: {new:?} {old:?}");
        }
    }
}

/// A modified ZV of n impulses leaves nothing at its own frequency whatever the damping, and the usual parameters give
/// the usual shaper.
#[test]
fn generalised_mzv() {
    for (pulses, duration) in [(3, 0.75), (3, 0.6), (4, 0.9), (5, 1.1), (6, 1.0), (10, 1.5)] {
        for zeta in [0.0, 0.1, 0.3] {
            let form = Form::Mzv { pulses, duration };
            let shaper = Shaper::formed(form, Firmware::Klipper, 50.0, zeta).unwrap();
            assert_eq!(shaper.impulses().len(), pulses);
            let periods = shaper.duration() * 50.0 * (1.0 - zeta * zeta).sqrt();
            assert!((periods - duration).abs() < 1e-12, "{form:?}");
            assert!(shaper.residual_vibration(50.0, zeta) < 1e-12, "{form:?} {zeta}");
        }
    }
    let usual = Shaper::formed(ShaperKind::Mzv.into(), Firmware::Klipper, 50.0, 0.1).unwrap();
    let general = Shaper::formed(Form::read("mzv(n=3,t=0.75)").unwrap(), Firmware::Klipper, 50.0, 0.1).unwrap();
    for (a, b) in usual.impulses().iter().zip(general.impulses()) {
        assert!((a.0 - b.0).abs() < 1e-14 && (a.1 - b.1).abs() < 1e-14);
    }
    // Half a period is a ZV: what is between the ends vanishes.
    let short = Shaper::formed(Form::Mzv { pulses: 3, duration: 0.5 }, Firmware::Klipper, 50.0, 0.1).unwrap();
    let zv = Shaper::formed(ShaperKind::Zv.into(), Firmware::Klipper, 50.0, 0.1).unwrap();
    for (a, b) in short.impulses().iter().zip(zv.impulses()) {
        assert!((a.0 - b.0).abs() < 1e-14 && (a.1 - b.1).abs() < 1e-14, "{short:?}");
    }
    // tau = t (n − 2)/(n − 2 t − 1) backwards: 1 with four impulses is 3/4.
    assert_eq!(Form::read("MZV(n=4, tau=1)").unwrap(), Form::Mzv { pulses: 4, duration: 0.75 });
}

/// A tolerance of its own is what an EI shaper leaves at its frequency, to a twentieth.
#[test]
fn ei_with_a_tolerance() {
    for tolerance in [0.02, 0.05, 0.1, 0.2] {
        let form = Form::read(&format!("ei(v_tol={tolerance})")).unwrap();
        let shaper = Shaper::formed(form, Firmware::Klipper, 30.0, 0.1).unwrap();
        let left = shaper.residual_vibration(30.0, 0.1);
        assert!((left / tolerance - 1.0).abs() < 0.05, "{tolerance}: {left}");
    }
}

#[test]
fn wrong_forms_are_told_what_is_wrong_with_them() {
    for (text, what) in [
        ("zvx", "there is no shaper \"zvx\""),
        ("mzv(n=4", "the parenthesis of \"mzv(n=4\" is not closed"),
        ("mzv(n=four)", "\"n=four\" in \"mzv(n=four)\" is no number"),
        ("mzv(4,0.9)", "mzv has no parameter \"4\""),
        ("mzv(n=2)", "mzv with n = 2 impulses"),
        ("mzv(n=3,t=1)", "mzv(n=3,t=1) has no impulses that are all positive"),
        ("mzv(n=4,t=0.3)", "mzv(n=4,t=0.3) has no impulses that are all positive"),
        ("mzv(n=4,t=1,tau=1)", "mzv takes either t or tau"),
        ("zv(t=1)", "zv has no parameter \"t\""),
        ("ei(v_tol=0.5)", "ei(v_tol=0.5) has no positive impulses for a damping ratio of 0.1"),
    ] {
        let told = Form::read(text).map(|form| form.name()).unwrap_err().what;
        // A value without a key is no number of one.
        assert!(told == what || text == "mzv(4,0.9)" && told.contains("is no number"), "{text}: {told}");
    }
    let damped = Pattern::new(ShaperKind::ThreeHumpEi.into(), Firmware::Klipper, 0.25).unwrap_err();
    assert!(damped.to_string().contains("3hump_ei for a damping ratio of 0.25"), "{damped}");
    let old = Pattern::new(Form::Ei { tolerance: 0.1 }, Firmware::Klipper202508, 0.1).unwrap_err();
    assert!(old.to_string().contains("klipper-2025-08 has no ei(v_tol=0.1)"), "{old}");
}

/// Density over frequency of a mode whose frame is shaken, between bins as far apart as those of half a second.
fn resonant(modes: &[(f64, f64, f64)]) -> Spectrum {
    let frequency: Vec<f64> = (0..256).map(|k| 0.78125 * f64::from(k)).collect();
    let of = |f: f64| {
        modes.iter().map(move |(f0, z, a)| a * f * f / ((f0 * f0 - f * f).powi(2) + (2.0 * z * f0 * f).powi(2)))
    };
    let density: Vec<f64> = frequency.iter().map(|f| 1e9 * of(*f).sum::<f64>()).collect();
    let still = vec![0.0; density.len()];
    let data = Accelerometer::Spectrum {
        frequency,
        density: [density.clone(), still.clone(), still, density],
        per_frequency: false,
    };
    Spectrum::by(&data, Axis::All, Firmware::Klipper)
}

/// Of several spectra the one counts of which most remains: the vibration is that of the worst, and no less than of
/// each alone.
#[test]
fn together_the_worst_counts() {
    let all = [resonant(&[(40.0, 0.05, 1.0)]), resonant(&[(55.0, 0.05, 1.0)])];
    let criterion = Criterion::default();
    let both = choose(Target::Spectra(&all), &criterion).unwrap();
    for fitted in &both.fitted {
        let each = all.each_ref().map(|one| Target::Spectrum(one).remaining(&fitted.shaper, &criterion.tested));
        assert!((fitted.vibration - each[0].max(each[1])).abs() < 1e-12, "{fitted:?} {each:?}");
    }
    let alone = choose(Target::Spectrum(&all[0]), &criterion).unwrap();
    // One frequency for both: a ZV leaves more than of one alone, and the best is a longer shaper.
    assert!(both.fitted[0].vibration > alone.fitted[0].vibration && both.best().smoothing > alone.best().smoothing);
}

/// Since 2025-10 a ZV gives way to a shaper that leaves a tenth less, and less vibration can be asked for.
#[test]
fn todays_rule() {
    let Some(folder) = spectra() else { return };
    let data = read_accelerometer(&folder.join(PRINTED[0].0)).unwrap();
    let spectrum = Spectrum::by(&data, Axis::All, Firmware::Klipper);
    let zv_and_mzv = [Form::Usual(ShaperKind::Zv), Form::Usual(ShaperKind::Mzv)];
    let criterion = Criterion::default().with_forms(&zv_and_mzv);
    let choice = choose(Target::Spectrum(&spectrum), &criterion).unwrap();
    assert_eq!(choice.best().shaper.kind, ShaperKind::Mzv);
    let free = choose(Target::Spectrum(&spectrum), &Criterion::default()).unwrap();
    let quiet = Criterion { max_vibrations: Some(0.001), ..Criterion::default() };
    let quiet = choose(Target::Spectrum(&spectrum), &quiet).unwrap();
    assert!(quiet.best().vibration <= free.best().vibration);
    assert!(quiet.best().vibration <= 0.001, "{quiet:?}");
}

/// The damping ratio of a mode on a frame that is shaken the harder the higher the frequency comes out, whatever the
/// window does to it.
#[test]
fn fitted_damping() {
    let rate = 3200.0;
    for (f, zeta) in [(47.0, 0.02), (60.0, 0.05), (90.0, 0.1)] {
        let omega: f64 = 2.0 * PI * f;
        let (mut u, mut v, mut seed, mut before) = (0.0, 0.0, 5u64, 0.0);
        let (mut time, mut acceleration) = (Vec::new(), Vec::new());
        for k in 0..(400.0 * rate) as usize {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let noise = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            // u = x − y, ÿ = the difference of white noise; what is measured is ẍ.
            let measured = -2.0 * zeta * omega * v - omega * omega * u;
            v += (measured - (noise - before) * rate) / rate;
            u += v / rate;
            before = noise;
            time.push(k as f64 / rate);
            acceleration.push(1e3 * measured);
        }
        let still = vec![0.0; time.len()];
        let samples = Accelerometer::Samples { time, acceleration: [acceleration, still.clone(), still] };
        let mode = fitted(&Spectrum::by(&samples, Axis::X, Firmware::Klipper)).unwrap();
        assert!((mode.frequency / f - 1.0).abs() < 0.015, "{f} {zeta}: {mode:?}");
        assert!((mode.damping / zeta - 1.0).abs() < 0.2, "{f} {zeta}: {mode:?}");
    }
}

/// In % below and above.
type Range = (f64, f64);

/// Klipper's documentation, "Resonance Compensation", Technical details: ranges in % of the shaper's frequency within
/// which vibration is reduced 20 and 10 times, said to be approximate, for shapers of ζ = 0.1 and machines around that.
const PUBLISHED: [(ShaperKind, Option<Range>, Range); 6] = [
    (ShaperKind::Zv, None, (-5.0, 5.0)),
    (ShaperKind::Mzv, Some((-4.0, 4.0)), (-10.0, 15.0)),
    (ShaperKind::Zvd, Some((-15.0, 15.0)), (-22.0, 22.0)),
    (ShaperKind::Ei, Some((-20.0, 20.0)), (-25.0, 25.0)),
    (ShaperKind::TwoHumpEi, Some((-35.0, 35.0)), (-40.0, 40.0)),
    (ShaperKind::ThreeHumpEi, Some((-45.0, 50.0)), (-50.0, 55.0)),
];

/// The published values lie within the computed ones, and are at most five points of percent less: they were rounded
/// down to 5 %.
#[test]
fn the_published_table_of_robustness() {
    let mut missing = Vec::new();
    let documented = fs::read_to_string("docs/shape.md").unwrap();
    for (kind, twenty, ten) in PUBLISHED {
        let shaper = shaper(kind, 50.0, 0.1);
        let range = |level: f64| {
            let part = shaper.insensitivity(level, &[0.075, 0.1, 0.15])?;
            Some((100.0 * (part.0 - 1.0), 100.0 * (part.1 - 1.0)))
        };
        for (level, published) in [(0.05, twenty), (0.1, Some(ten))] {
            let computed = range(level);
            let (Some(computed), Some(published)) = (computed, published) else {
                assert_eq!(computed.is_some(), published.is_some(), "{kind:?}");
                continue;
            };
            let (low, high) = (published.0 - computed.0, computed.1 - published.1);
            assert!((0.0..5.01).contains(&low) && (0.0..5.01).contains(&high), "{kind:?}: {computed:?}");
        }
        let shown = |range: Option<(f64, f64)>| {
            range.map_or("none".into(), |(low, high)| format!("−{:.1} … +{high:.1} %", -low))
        };
        let row = format!("| {} | {} | {} |", kind.name(), shown(range(0.05)), shown(range(0.1)));
        if !documented.contains(&row) {
            missing.push(row);
        }
    }
    assert!(missing.is_empty(), "docs/shape.md does not have:\n{}", missing.join("\n"));
}

fn spectra() -> Option<PathBuf> {
    let files = ["x_20210701_223821", "x_20210821_152037", "y_20210630_223910", "y_20210630_230110"];
    let [first, ..] = data::data(files.map(|name| format!("klipper-ender3/resonances_{name}.csv")))?;
    first.parent().map(Path::to_path_buf)
}

fn spectrum(file: &Path) -> Spectrum {
    Spectrum::new(&read_accelerometer(file).unwrap(), Axis::All)
}

/// Frequency (Hz), vibration (%) of zv, mzv, ei, 2hump_ei, 3hump_ei, and the recommendation.
type Printed = (&'static str, [(f64, f64); 5], &'static str);

/// As Klipper printed them for these files.
const PRINTED: [Printed; 3] = [
    ("resonances_x_20210821_152037.csv", [(58.2, 15.8), (40.8, 2.0), (51.2, 0.2), (63.0, 0.0), (77.6, 0.0)], "ei"),
    ("resonances_y_20210630_223910.csv", [(46.0, 9.5), (29.4, 1.0), (39.4, 0.0), (50.2, 0.0), (62.0, 0.0)], "ei"),
    ("resonances_y_20210630_230110.csv", [(48.2, 2.8), (46.2, 0.0), (56.2, 0.0), (71.6, 0.0), (88.0, 0.0)], "mzv"),
];

#[test]
fn what_klipper_printed() {
    let Some(folder) = spectra() else { return };
    for (file, printed, recommended) in PRINTED {
        let spectrum = spectrum(&folder.join(file));
        let criterion = Criterion { firmware: Firmware::Klipper202508, ..Criterion::default() };
        let choice = choose(Target::Spectrum(&spectrum), &criterion).unwrap();
        assert_eq!(choice.best().shaper.kind.name(), recommended, "{file}");
        let fitted: Vec<_> = choice.fitted.iter().filter(|one| one.shaper.kind != ShaperKind::Zvd).collect();
        for (one, (frequency, vibration)) in fitted.iter().zip(printed) {
            assert!((one.shaper.frequency - frequency).abs() < 0.2, "{file}: {one:?}");
            assert!((100.0 * one.vibration - vibration).abs() < 0.051, "{file}: {one:?}");
        }
        if file == PRINTED[0].0 {
            let smoothing = [0.052, 0.122, 0.123, 0.136, 0.136];
            let acceleration = [13200.0, 4900.0, 4900.0, 4400.0, 4400.0];
            for (one, (smoothing, acceleration)) in fitted.iter().zip(smoothing.into_iter().zip(acceleration)) {
                assert!((1e3 * one.smoothing - smoothing).abs() < 5.1e-4, "{one:?}");
                assert!((1e3 * one.max_acceleration - acceleration).abs() < 51.0, "{one:?}");
            }
        }
    }
}

/// Every digit that today's Klipper prints, of 64 drawn spectra and with its options: frequency, vibration, smoothing
/// and acceleration of each shaper, and the recommendation. The authority is its rule written out again with NumPy.
#[test]
fn every_digit_of_todays_klipper() {
    let text = fs::read_to_string("tests/authorities/klipper.json").unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let sets = value["sets"].as_array().unwrap();
    assert!(sets.len() >= 48);
    let mut wrong = Vec::new();
    for (place, set) in sets.iter().enumerate() {
        let column = |key: &str| set[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
        let (frequency, density) = (column("frequency"), column("density"));
        let still = vec![0.0; density.len()];
        let density = [density.clone(), still.clone(), still, density];
        let data = Accelerometer::Spectrum { frequency, density, per_frequency: false };
        let spectrum = Spectrum::by(&data, Axis::All, Firmware::Klipper);
        let mut criterion = Criterion {
            max_smoothing: set["max_smoothing"].as_f64().map(|mm| 1e-3 * mm),
            max_vibrations: set["max_vibrations"].as_f64(),
            ..Criterion::default()
        };
        if let (Some(zeta), Some(speed)) = (set["zeta"].as_f64(), set["corner"].as_f64()) {
            criterion = criterion.designed_for(zeta).unwrap();
            criterion.corner.speed = 1e-3 * speed;
        }
        let choice = choose(Target::Spectrum(&spectrum), &criterion).unwrap();
        let best = &choice.best().shaper;
        let mut printed = vec![vec![best.form.name(), format!("{:.1}", best.frequency)]];
        for one in choice.fitted.iter().filter(|one| one.is_candidate) {
            printed.push(vec![
                one.shaper.form.name(),
                format!("{:.1}", one.shaper.frequency),
                format!("{:.1}", 100.0 * one.vibration),
                format!("{:.3}", 1e3 * one.smoothing),
                format!("{:.0}", (10.0 * one.max_acceleration).round() * 100.0),
            ]);
        }
        let rows = std::iter::once(&set["recommended"]).chain(set["shapers"].as_array().unwrap());
        let expected: Vec<Vec<&str>> =
            rows.map(|row| row.as_array().unwrap().iter().map(|x| x.as_str().unwrap()).collect()).collect();
        if printed != expected {
            wrong.push(format!("{place}: {printed:?}, expected {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), sets.len(), wrong.join("\n"));
}

fn temporary(name: &str, text: &str) -> PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&file, text).unwrap();
    file
}

/// A file that names shapers holds densities that are divided by frequency already, with a column that marks them or
/// without.
#[test]
fn spectra_with_shapers_are_divided_already() {
    let plain: Vec<(f64, f64)> =
        (0..140).map(|k| 1.5 * f64::from(k)).map(|f| (f, 1e5 / (1.0 + ((f - 44.0) / 4.0).powi(2)))).collect();
    let mut text = String::from("freq,psd_x,psd_y,psd_z,psd_xyz\n");
    let mut divided = [
        "freq,psd_x,psd_y,psd_z,psd_xyz,zv(44.0),mzv(44.0)\n",
        "# accelerometer x\nfreq,psd_x,psd_y,psd_z,psd_xyz,shapers:,mzv(44.0)\n",
    ]
    .map(String::from);
    for (f, p) in plain {
        text += &format!("{f},{p},0,0,{p}\n");
        let (q, kept) = (p / (f + 0.1), if f < 5.0 { 0.0 } else { 1.0 });
        divided[0] += &format!("{f},{0},0,0,{0},0.5,0.4\n", q * kept);
        divided[1] += &format!("{f},{0},0,0,{0},,0.4\n", q * kept);
    }
    let expected = spectrum(&temporary("resonances_x.csv", &text));
    for (name, text) in ["calibration_data_x.csv", "calibration_data_y.csv"].iter().zip(&divided) {
        let read = spectrum(&temporary(name, text));
        let far = read.density.iter().zip(&expected.density).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 1e-12 * expected.greatest(), "{name}: {far}");
    }
}

/// Samples from a file, as Klipper writes them: the names stand in a remark.
#[test]
fn samples_from_a_file() {
    let mut text = String::from("#time,accel_x,accel_y,accel_z\n");
    for k in 0..3200 {
        let t = f64::from(k) / 1600.0;
        text += &format!("{:.6},{:.6},0.5,9806.65\n", 100.0 + t, 700.0 * (2.0 * PI * 50.0 * t).sin());
    }
    let spectrum = spectrum(&temporary("raw_data_x.csv", &text));
    let peaks = spectrum.peaks();
    assert!(peaks.len() == 1 && (peaks[0].0 - 50.0).abs() < 0.1, "{peaks:?}");
    assert_eq!(spectrum.main_axis(peaks[0].0).unwrap().0, Axis::X);
    // Half the squared amplitude, spread over a few frequencies.
    let width = spectrum.frequency[1] - spectrum.frequency[0];
    let power: f64 = spectrum.frequency.iter().zip(&spectrum.density).map(|(f, p)| p * (f + 0.1) * width).sum();
    assert!((power / (0.5 * 700.0 * 700.0) - 1.0).abs() < 1e-3, "{power}");
}

/// The lighter motor: the first peak goes from 40.0 to 45.0 Hz, as Klipper printed it.
#[test]
fn two_motors_compared() {
    let Some(folder) = spectra() else { return };
    let heavy = spectrum(&folder.join("resonances_x_20210701_223821.csv"));
    let light = spectrum(&folder.join("resonances_x_20210821_152037.csv"));
    let first = |spectrum: &Spectrum| spectrum.peaks()[0].0;
    assert!(
        (first(&heavy) - 40.0).abs() < 1.6 && (first(&light) - 45.0).abs() < 1.6,
        "{} {}",
        first(&heavy),
        first(&light)
    );
    let compared = compare(&heavy, &light);
    assert!(compared.similarity < 0.95);
    let same = compare(&light, &light);
    assert!((same.similarity - 1.0).abs() < 1e-12 && (same.level - 1.0).abs() < 1e-12);
    assert!(same.only_first.is_empty() && same.only_second.is_empty() && same.pairs.len() == light.peaks().len());
}

/// `max_smoothing` is kept, and costs vibration.
#[test]
fn smoothing_can_be_limited() {
    let Some(folder) = spectra() else { return };
    let spectrum = spectrum(&folder.join(PRINTED[1].0));
    for firmware in Firmware::ALL {
        let free = choose(Target::Spectrum(&spectrum), &Criterion { firmware, ..Criterion::default() }).unwrap();
        let limit = 0.1e-3;
        let criterion = Criterion { max_smoothing: Some(limit), firmware, ..Criterion::default() };
        let limited = choose(Target::Spectrum(&spectrum), &criterion).unwrap();
        assert!(limited.fitted.iter().all(|one| one.smoothing <= limit));
        for (one, other) in free.fitted.iter().zip(&limited.fitted) {
            // Today's rule takes what leaves hardly more; of what is limited, the least.
            let least = match firmware {
                Firmware::Klipper202508 => one.vibration,
                Firmware::Klipper => (one.vibration - 0.0005) / 1.1,
            };
            assert!(other.vibration >= least, "{one:?} {other:?}");
        }
    }
    let criterion = Criterion { max_smoothing: Some(1e-9), ..Criterion::default() };
    assert!(choose(Target::Spectrum(&spectrum), &criterion).is_err());
}

/// Acceleration samples of one mode shaken by noise: the spectrum peaks there, and the shaper that is chosen covers it.
#[test]
fn samples_of_a_known_mode() {
    let (rate, f, zeta) = (3200.0, 47.0, 0.05);
    let omega: f64 = 2.0 * PI * f;
    let (mut x, mut v, mut seed) = (0.0, 0.0, 1u64);
    let (mut time, mut acceleration) = (Vec::new(), Vec::new());
    for k in 0..(60.0 * rate) as usize {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let noise = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        let a = noise - 2.0 * zeta * omega * v - omega * omega * x;
        v += a / rate;
        x += v / rate;
        time.push(k as f64 / rate);
        acceleration.push(1e6 * omega * omega * x);
    }
    let still = vec![0.0; time.len()];
    let samples = Accelerometer::Samples { time, acceleration: [acceleration, still.clone(), still] };
    let spectrum = Spectrum::new(&samples, Axis::X);
    let peak = spectrum.peaks().into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert!((peak.0 - f).abs() < 3.2, "{peak:?}");
    let criterion = Criterion::default().with_damping(zeta).unwrap();
    let choice = choose(Target::Spectrum(&spectrum), &criterion).unwrap();
    assert!(choice.best().shaper.residual_vibration(f, zeta) < 0.06, "{choice:?}");
}

/// The density's sum is the variance, and a sine's power stands at its frequency.
#[test]
fn densities_sum_to_the_variance() {
    let rate = 1000.0;
    let values: Vec<f64> = (0..20_000).map(|k| 3.0 * (2.0 * PI * 62.5 * f64::from(k) / rate).sin()).collect();
    let (frequency, density) = power_spectral_density(&values, rate, 512);
    let total: f64 = density.iter().sum::<f64>() * (frequency[1] - frequency[0]);
    assert!((total - 4.5).abs() < 1e-3, "{total}");
    let top = (0..density.len()).max_by(|a, b| density[*a].total_cmp(&density[*b])).unwrap();
    assert_eq!(frequency[top], 62.5);
    assert!(power_spectral_density(&values[..100], rate, 512).1.is_empty());
}

/// The numbers of authorities/shapers.py, which integrates the oscillator and shares nothing with taut.
#[test]
fn an_authority_agrees() {
    let text = fs::read_to_string("tests/authorities/shapers.json").unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let vibrations = value["vibration"].as_array().unwrap();
    assert!(vibrations.len() >= 60);
    for one in vibrations {
        let kind = ShaperKind::from_name(one["shaper"].as_str().unwrap()).unwrap();
        let shaper = shaper(kind, number(&one["frequency"]), number(&one["damping"]));
        let v = shaper.residual_vibration(number(&one["mode_frequency"]), number(&one["mode_damping"]));
        assert!((v - number(&one["vibration"])).abs() < 1e-8, "{one}: {v}");
    }
    let samples: Vec<f64> = value["samples"].as_array().unwrap().iter().map(number).collect();
    let (_, density) = power_spectral_density(&samples, number(&value["rate"]), 64);
    let expected: Vec<f64> = value["density"].as_array().unwrap().iter().map(number).collect();
    assert_eq!(density.len(), expected.len());
    let most = expected.iter().copied().fold(0.0, f64::max);
    for (mine, theirs) in density.iter().zip(&expected) {
        assert!((mine - theirs).abs() < 1e-12 * most, "{mine} {theirs}");
    }
    for one in value["resonances"].as_array().unwrap() {
        let case = Case::from_text("authority.toml", one["toml"].as_str().unwrap()).unwrap();
        let drive = if one["drive"] == "held" { Drive::Held } else { Drive::Free };
        let found = resonances(&case.machine, drive, 0).unwrap();
        let expected = one["modes"].as_array().unwrap();
        assert!(!expected.is_empty());
        for mode in expected {
            let (f, z) = (number(&mode["frequency"]), number(&mode["damping"]));
            let near = found.iter().min_by(|a, b| (a.frequency - f).abs().total_cmp(&(b.frequency - f).abs())).unwrap();
            assert!((near.frequency / f - 1.0).abs() < 1e-9, "{mode} {near:?}");
            assert!((near.damping - z).abs() < 1e-9, "{mode} {near:?}");
        }
    }
}

#[test]
fn wrong_files_are_told_what_is_wrong_with_them() {
    wrong::every_message("tests/bad/shape", 25, |wrong| Some(read_accelerometer(&wrong.path).err()?.to_string()));
}

#[test]
fn wrong_numbers_are_refused() {
    for (frequency, damping) in [(0.0, 0.1), (-5.0, 0.1), (f64::NAN, 0.1), (50.0, 1.0), (50.0, -0.1), (50.0, f64::NAN)]
    {
        assert!(Shaper::new(ShaperKind::Zv, frequency, damping).is_err(), "{frequency} {damping}");
    }
}
