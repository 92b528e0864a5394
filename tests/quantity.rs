//! Quantities as people type them, and their values, to the last bit.

use proptest::prelude::*;
use std::f64::consts::PI;
use taut::quantity::{Dimension, parse, read, show, write};

/// (typed, wanted unit, value in SI)
const GOOD: &[(&str, &str, f64)] = &[
    ("19.4 mm", "m", 0.0194),
    ("19.4mm", "m", 0.0194),
    ("19.4\u{a0}mm", "m", 0.0194),
    (" 0.25 s ", "s", 0.25),
    ("132.76 kN/m", "N/m", 132760.0),
    ("6.3e-5 kg m^2", "kg m^2", 6.3e-5),
    ("6.3E-5 kg·m²", "kg m^2", 6.3e-5),
    ("6.3e-5 kg⋅m²", "kg m^2", 6.3e-5),
    ("6.3e−5 kg*m**2", "kg m^2", 6.3e-5),
    ("23 mN m/A", "N m/A", 0.023),
    ("23 mNm/A", "N m/A", 0.023),
    ("23 mV s/rad", "V s/rad", 0.023),
    ("23e-3 V/(rad/s)", "V s/rad", 0.023),
    ("8.335 GPa", "Pa", 8.335e9),
    ("16.67 GPa", "Pa", 16.67e9),
    ("5.5626 mm^2", "m^2", 5.5626e-6),
    ("5.5626 mm²", "m^2", 5.5626e-6),
    ("5.5626 mm2", "m^2", 5.5626e-6),
    ("5.5626×10^-6 m^2", "m^2", 5.5626e-6),
    ("5.5626 x 10⁻⁶ m²", "m^2", 5.5626e-6),
    ("10^-6 m", "m", 1e-6),
    ("10^3 m", "m", 1e3),
    ("0.0042 N m s", "N m s/rad", 0.0042),
    ("0.0042 N*m*s", "N m s/rad", 0.0042),
    ("0.0042 N·m·s", "N m s/rad", 0.0042),
    ("0.0042 N.m.s", "N m s/rad", 0.0042),
    ("0.0042 N-m-s", "N m s/rad", 0.0042),
    ("0.0042 Nm s", "N m s/rad", 0.0042),
    ("0.0042 N m s/rad", "N m s/rad", 0.0042),
    ("40.6518 (N s)/m", "N s/m", 40.6518),
    ("40.6518 N/(m/s)", "N s/m", 40.6518),
    ("40.6518 N s m^-1", "N s/m", 40.6518),
    ("40.6518 N s m⁻¹", "N s/m", 40.6518),
    ("40.6518 N s m-1", "N s/m", 40.6518),
    ("3 m/s/s", "m/s^2", 3.0),
    ("0.71 ohm", "ohm", 0.71),
    ("0.71 Ohm", "ohm", 0.71),
    ("0.71 Ω", "ohm", 0.71),
    ("0.71 \u{2126}", "ohm", 0.71),
    ("710 mΩ", "ohm", 0.71),
    ("3 µH", "H", 3e-6),
    ("3 \u{3bc}H", "H", 3e-6),
    ("3 uH", "H", 3e-6),
    ("90 deg", "rad", PI / 2.0),
    ("90°", "rad", PI / 2.0),
    ("1 rev", "rad", 2.0 * PI),
    ("0.5 turn", "rad", PI),
    ("60 rpm", "rad/s", 2.0 * PI),
    ("1 rev/s", "rad/s", 2.0 * PI),
    ("3 /s", "rad/s", 3.0),
    ("3 s⁻¹", "Hz", 3.0),
    ("2 kHz", "Hz", 2e3),
    ("1/2 s", "s", 0.5),
    ("2/3", "", 2.0 / 3.0),
    ("25 %", "", 0.25),
    ("5.9", "", 5.9),
    ("1000/m", "1/m", 1000.0),
    ("20 1/mm", "1/m", 20000.0),
    ("13.75 in", "m", 0.34925),
    ("13.75 inch", "m", 0.34925),
    ("13.75\"", "m", 0.34925),
    ("31 in", "m", 0.7874),
    ("1 ft", "m", 0.3048),
    ("80 mil", "m", 0.002032),
    ("80 thou", "m", 0.002032),
    ("1 lb", "kg", 0.45359237),
    ("1 oz", "kg", 0.028349523125),
    ("1 lbf", "N", 4.4482216152605),
    ("16 ozf", "N", 4.4482216152605),
    ("1 ozf in", "N m", 0.0070615518142260435),
    ("1 ozf-in", "N m", 0.0070615518142260435),
    ("1 kgf cm", "N m", 0.0980665),
    ("1 lbf/in", "N/m", 175.1268352464764),
    ("1 psi", "Pa", 6894.757293168362),
    ("1 bar", "Pa", 1e5),
    ("2 t", "kg", 2000.0),
    ("1.5 min", "s", 90.0),
    ("1 h", "s", 3600.0),
    ("2.7 g/cm^3", "kg/m^3", 2700.0),
    ("1 W", "N m/s", 1.0),
    ("1 A", "A", 1.0),
    ("-5 V", "V", -5.0),
    ("−5 V", "V", -5.0),
    ("+5 V", "V", 5.0),
    (".5 V", "V", 0.5),
    ("5. V", "V", 5.0),
    ("1_000 V", "V", 1000.0),
    ("0 N", "N", 0.0),
];

#[test]
fn what_engineers_type() {
    for &(text, unit, value) in GOOD {
        match read(text, unit) {
            Ok(read) => assert_eq!(read.to_bits(), value.to_bits(), "{text}: {read:e} instead of {value:e}"),
            Err(error) => panic!("{text}: {error}"),
        }
    }
    // V/krpm: 1000 turns a minute are 100π/3 rad/s.
    let emf = read("2.4 V/krpm", "V s/rad").unwrap();
    assert!((emf / (2.4 * 3.0 / (100.0 * PI)) - 1.0).abs() < 4e-16);
}

/// (typed, wanted unit, message, next step)
const BAD: &[(&str, &str, &str, &str)] = &[
    ("0.362 kg", "m", "\"0.362 kg\" is a mass (kg); expected a length (m)", ""),
    ("5 Hz", "rad/s", "\"5 Hz\" is given in hertz; expected an angular speed (rad/s)", "5 Hz is 31.4159 rad/s"),
    ("31.4 rad/s", "Hz", "\"31.4 rad/s\" is an angular speed; expected a frequency (Hz)", "31.4 rad/s is 4.99747 Hz"),
    ("300 rpm", "Hz", "\"300 rpm\" is an angular speed; expected a frequency (Hz)", "300 rpm is 5 Hz"),
    (
        "5 oz-in",
        "N m",
        "\"5 oz-in\" is a mass times a length (kg m); expected a torque (N m)",
        "a weight as a force is lbf, ozf, kgf or gf; lb, oz, kg and g are masses",
    ),
    ("19,4 mm", "m", "\"19,4 mm\" has a comma in its number", "the decimal sign is a point: \"19.4 mm\""),
    ("1,019.4 mm", "m", "\"1,019.4 mm\" has a comma in its number", "write it without commas: \"1019.4 mm\""),
    ("1 000 mm", "m", "\"1 000 mm\" has a space inside its number", "write the digits together"),
    ("1 2 mm", "m", "\"1 2 mm\" has a space inside its number", "write the digits together"),
    (
        "3 x 10",
        "",
        "\"3 x 10\" has an unknown unit `x`",
        "units are such as mm, kg, N s/m, kg m^2, ohm, GPa, rpm, in, lbf",
    ),
    ("nan V", "V", "\"nan V\" is not a finite number", ""),
    ("-inf V", "V", "\"-inf V\" is not a finite number", ""),
    ("1e400 V", "V", "\"1e400 V\" is too large for a computer's number", ""),
    ("1e-400 V", "V", "\"1e-400 V\" is too small for a computer's number", "write 0 if that is meant"),
    ("", "V", "an empty text is no number", "write a number with its unit, such as \"19.4 mm\""),
    ("five V", "V", "\"five V\" does not begin with a number", "write a number with its unit, such as \"19.4 mm\""),
    (
        "5",
        "V",
        "\"5\" has no unit; expected a voltage (V)",
        "add the unit, or leave the quotes away if the number is in SI units",
    ),
    ("90", "rad", "\"90\" has no unit; expected an angle (rad)", "add the unit, such as deg, rad or rev"),
    (
        "10 V/1000rpm",
        "V s/rad",
        "\"10 V/1000rpm\" has `1000rpm` where a unit should be",
        "numbers stand before the unit; a thousand is the prefix k: V/1000rpm is V/krpm",
    ),
    (
        "100 rpm/V",
        "V s/rad",
        "\"100 rpm/V\" is a speed per voltage (rad/s/V); expected a back-EMF constant (V s/rad)",
        "this is the inverse of the expected quantity: write 0.095493 V s/rad",
    ),
    ("5 KN", "N", "\"5 KN\" has an unknown unit `KN`", "did you mean kN?"),
    ("5 volst", "V", "\"5 volst\" has an unknown unit `volst`", "did you mean volt?"),
    ("5 Nms", "N m s/rad", "\"5 Nms\" has an unknown unit `Nms`", "did you mean N ms, or Nm s?"),
    ("70 gcm^2", "kg m^2", "\"70 gcm^2\" has an unknown unit `gcm`", "did you mean g cm?"),
    (
        "5 qqq",
        "V",
        "\"5 qqq\" has an unknown unit `qqq`",
        "units are such as mm, kg, N s/m, kg m^2, ohm, GPa, rpm, in, lbf",
    ),
    ("23 mV/rad s", "V s/rad", "\"23 mV/rad s\" can be read in two ways", "write mV/(rad s) or mV s/rad"),
    ("1 N m/A s", "V", "\"1 N m/A s\" can be read in two ways", "write N m/(A s) or N m s/A"),
    ("1 m/", "m", "\"1 m/\" ends with a `/`", ""),
    ("1 (m", "m", "\"1 (m\" has a `(` without its `)`", ""),
    ("1 m)", "m", "\"1 m)\" has a `)` without its `(`", ""),
    ("1 m^0.5", "m", "\"1 m^0.5\" has a power that is not a whole number", ""),
    ("1 m^99", "m", "\"1 m^99\" has a power `99` that cannot be meant", ""),
    ("1.2.3 m", "m", "\"1.2.3 m\" has a second point in its number", ""),
    ("1/0 m", "m", "\"1/0 m\" divides by zero", ""),
    (
        "512 lines/rev",
        "",
        "\"512 lines/rev\" has an unknown unit `lines`",
        "units are such as mm, kg, N s/m, kg m^2, ohm, GPa, rpm, in, lbf",
    ),
    ("19.4 mm/rev", "m", "\"19.4 mm/rev\" is a travel per angle (m/rad); expected a length (m)", ""),
];

#[test]
fn what_is_refused_says_why() {
    for &(text, unit, what, next) in BAD {
        let error = read(text, unit).expect_err(text);
        assert_eq!(error.what, what);
        assert_eq!(error.next.unwrap_or_default(), next, "{text}");
    }
}

#[test]
fn values_are_shown_in_a_unit() {
    assert_eq!(show(0.0194, "mm"), "19.4 mm");
    assert_eq!(show(2.0 * PI, "rev"), "1 rev");
    assert_eq!(show(132760.0, "kN/m"), "132.76 kN/m");
    assert_eq!(show(1.0 / 3.0, ""), "0.333333");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn no_text_panics(text in any::<String>()) {
        let _ = parse(&text);
        let _ = read(&text, "N m s/rad");
    }

    #[test]
    fn nearly_right_text_does_not_panic(text in "[-−+]?[0-9]{0,3}[.,eE/×x^ ]{0,2}[0-9]{0,4}[ ]?[kmµuGNsAΩ°%\"()/*·^²⁻0-9. -]{0,14}") {
        let _ = parse(&text);
    }

    #[test]
    fn written_values_read_back_to_the_same_bits(value in any::<f64>().prop_filter("finite", |v| v.is_finite()),
            unit in prop::sample::select(vec!["m", "N s/m", "kg m^2", "V s/rad", "ohm", ""])) {
        prop_assert_eq!(read(&write(value, unit), unit).unwrap().to_bits(), value.to_bits());
    }

    #[test]
    fn powers_of_ten_round_once(digits in 1_u64..10_000_000_000_000_000, point in 0_usize..12) {
        let text = digits.to_string();
        let split = text.len().saturating_sub(point);
        let number = format!("{}.{}", if split == 0 { "0" } else { &text[..split] }, &text[split..]);
        let exact: f64 = format!("{number}e-3").parse().unwrap();
        prop_assert_eq!(read(&format!("{number} mm"), "m").unwrap().to_bits(), exact.to_bits());
    }

    #[test]
    fn factors_multiply_dimensions(a in -3_i8..4, b in -3_i8..4, c in -3_i8..4) {
        let q = parse(&format!("1 kg^{a} m^{b} s^{c}")).unwrap();
        prop_assert_eq!(q.dimension, Dimension::new(a, b, c, 0, 0));
        prop_assert_eq!(q.value, 1.0);
    }
}
