use super::profile::{Leg, Limits, Profile};
use super::*;
use proptest::prelude::*;
use std::f64::consts::TAU;

/// The pieces from 0 up to `until`, as a solver walks them.
fn walk(signal: &Signal, until: f64) -> Vec<Piece> {
    let mut pieces = vec![signal.piece(0.0)];
    while let Some(last) = pieces.last()
        && last.end < until
    {
        let next = signal.piece(last.end);
        assert_eq!(next.start, last.end);
        assert!(next.end - next.start > 4.0 * f64::EPSILON * next.start, "{next:?} of {signal:?}");
        pieces.push(next);
    }
    pieces
}

/// The largest |u| and |u′| there can be, by both ends of the pieces given.
fn size(pieces: &[Piece]) -> (f64, f64) {
    let largest = |k: usize| pieces.iter().map(|p| p.coefficients[k].abs()).fold(0.0, f64::max);
    // A chirp may begin at zero and have one piece alone.
    let ends = pieces.iter().filter(|p| p.end.is_finite()).map(|p| p.value(p.end).abs()).fold(0.0, f64::max);
    (largest(0).max(ends), largest(1))
}

/// Pieces and direct formula agree at `share` of every piece, and just after and just before its seams.
fn agrees(signal: &Signal, until: f64, share: f64) {
    let pieces = walk(signal, until);
    let (height, slope) = size(&pieces);
    for piece in &pieces {
        let end = if piece.end.is_finite() { piece.end } else { piece.start + 1.0 };
        let inside = piece.start + share * (end - piece.start);
        for t in [piece.start, inside, piece.start + 0.999 * (end - piece.start)] {
            let allowed = 1e-13 * height + 2e-15 * slope * t;
            let (by_piece, direct) = (piece.value(t), signal.value(t));
            assert!((by_piece - direct).abs() <= allowed, "{by_piece} is not {direct} at {t} s of {signal:?}");
        }
        // Asked for in the middle, the same piece with the same end.
        if inside > piece.start && inside + 32.0 * f64::EPSILON * inside < end {
            let part = signal.piece(inside);
            assert_eq!((part.start, part.end), (inside, piece.end), "{signal:?}");
            assert!((part.value(end) - piece.value(end)).abs() <= 1e-13 * height + 2e-15 * slope * end);
        }
    }
}

fn negated(signal: &Signal) -> Signal {
    let mut signal = signal.clone();
    match &mut signal {
        Signal::Step { value, .. } | Signal::Pulse { value, .. } | Signal::Ramp { value, .. } => *value = -*value,
        Signal::Triangle { amplitude, .. }
        | Signal::Square { amplitude, .. }
        | Signal::Chirp { amplitude, .. }
        | Signal::Prbs { amplitude, .. } => *amplitude = -*amplitude,
        Signal::Sine { amplitude, offset, .. } => (*amplitude, *offset) = (-*amplitude, -*offset),
        Signal::Multisine { tones } => tones.iter_mut().for_each(|tone| tone.amplitude = -tone.amplitude),
        Signal::Table { points } => points.iter_mut().for_each(|p| p[1] = -p[1]),
        Signal::Sampled { values, .. } => values.iter_mut().for_each(|v| *v = -*v),
        Signal::References { weights, .. } => weights.iter_mut().for_each(|weight| *weight = -*weight),
        Signal::Sum(signals) => signals.iter_mut().for_each(|s| *s = negated(s)),
        Signal::Sequence(turns) => {
            let slots = turns.slots().iter().map(|slot| Slot { signal: negated(&slot.signal), lasts: slot.lasts });
            *turns = Sequence::new(slots.collect());
        }
    }
    signal
}

fn simple() -> impl Strategy<Value = Signal> {
    let v = -24.0..24.0;
    // Round times and frequencies as people type them, and any others.
    let time = || prop_oneof![(0u32..40).prop_map(|k| f64::from(k) * 0.05), 0.0..2.0];
    let rate = || prop_oneof![(0u32..60).prop_map(|k| f64::from(k) * 0.1), 0.0..20.0];
    let points = || {
        (0.0..0.5, prop::collection::vec((1e-3..0.3, -24.0..24.0), 0..20)).prop_map(|(mut t, steps)| {
            let next = |(dt, v)| {
                t += dt;
                [t, v]
            };
            steps.into_iter().map(next).collect::<Vec<[f64; 2]>>()
        })
    };
    prop_oneof![
        (v.clone(), time()).prop_map(|(value, at)| Signal::Step { value, at }),
        (v.clone(), time(), time()).prop_map(|(value, duration, at)| Signal::Pulse { value, duration, at }),
        (v.clone(), time(), time()).prop_map(|(value, over, at)| Signal::Ramp { value, over, at }),
        (v.clone(), rate()).prop_map(|(amplitude, frequency)| Signal::Triangle { amplitude, frequency }),
        (v.clone(), rate(), -0.1..1.1).prop_map(|(amplitude, frequency, duty)| Signal::Square {
            amplitude,
            frequency,
            duty
        }),
        (v.clone(), rate(), -7.0..7.0, v.clone()).prop_map(|(amplitude, frequency, phase, offset)| Signal::Sine {
            amplitude,
            frequency,
            phase,
            offset
        }),
        (v.clone(), rate(), rate(), time()).prop_map(|(amplitude, from, to, over)| Signal::Chirp {
            amplitude,
            from,
            to,
            over
        }),
        prop::collection::vec((v.clone(), rate(), -7.0..7.0), 0..5).prop_map(|tones| Signal::Multisine {
            tones: tones
                .into_iter()
                .map(|(amplitude, frequency, phase)| Tone { amplitude, frequency, phase })
                .collect()
        }),
        (v, 0.01..0.3, any::<u64>()).prop_map(|(amplitude, bit, seed)| Signal::Prbs { amplitude, bit, seed }),
        points().prop_map(|points| Signal::Table { points }),
        (points(), prop_oneof![Just(Hold::Zero), Just(Hold::Linear)]).prop_map(|(points, hold)| {
            let (times, values) = points.iter().map(|p| (p[0], p[1])).unzip();
            Signal::Sampled { times, values, hold }
        }),
        references(),
    ]
}

/// Paths in a plane of a few legs and rests, of each order, some of them shaped.
fn references() -> impl Strategy<Value = Signal> {
    let limits = (0.05..1.0, 0.5..20.0, prop::option::of((20.0..2000.0, prop::option::of(1e3..1e5))));
    let limits = limits.prop_map(|(speed, acceleration, more)| Limits {
        speed,
        acceleration,
        jerk: more.map(|(jerk, _)| jerk),
        snap: more.and_then(|(_, snap)| snap),
    });
    let place = || (-5i32..6).prop_map(|k| f64::from(k) * 0.02);
    let leg = (prop::option::weighted(0.7, (place(), place())), limits, 0.0..0.3_f64)
        .prop_map(|(to, limits, wait)| to.map_or(Leg::Wait(wait), |(x, y)| Leg::To(vec![x, y], limits)));
    let shaper = prop::option::of((0.0..0.2_f64, 0.0..1.0_f64));
    let shaper = shaper.prop_map(|second| second.map_or(vec![], |(late, part)| vec![[0.0, 1.0 - part], [late, part]]));
    (prop::collection::vec(leg, 0..4), shaper, -1.0..1.0, -1.0..1.0).prop_map(|(legs, shaper, a, b)| {
        let profiles = Profile::along(&[0.0, 0.0], &legs).unwrap();
        let profiles = profiles.into_iter().map(|profile| profile.shaped(&shaper)).collect();
        Signal::References { profiles, weights: vec![a, b] }
    })
}

fn any_signal() -> impl Strategy<Value = Signal> {
    simple().prop_recursive(2, 8, 3, |inner| {
        let lasts = prop_oneof![(0u32..20).prop_map(|k| f64::from(k) * 0.1), 0.0..2.0];
        let slot = (inner.clone(), lasts).prop_map(|(signal, lasts)| Slot { signal, lasts });
        prop_oneof![
            prop::collection::vec(inner, 0..4).prop_map(Signal::Sum),
            prop::collection::vec(slot, 0..4).prop_map(Signal::sequence),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn pieces_tile_the_time_and_agree_with_the_formula(signal in any_signal(), share in 0.01..0.99) {
        agrees(&signal, 4.0, share);
    }

    #[test]
    fn a_negated_signal_has_negated_coefficients(signal in any_signal()) {
        for (piece, mirrored) in walk(&signal, 3.0).into_iter().zip(walk(&negated(&signal), 3.0)) {
            prop_assert_eq!(piece.end, mirrored.end);
            prop_assert_eq!(piece.coefficients.map(|c| -c), mirrored.coefficients);
        }
    }

    #[test]
    fn a_sum_is_the_sum_of_its_pieces(a in any_signal(), b in any_signal(), t in 0.0..5.0) {
        let (a, b, sum) = (a.piece(t), b.piece(t), Signal::Sum(vec![a, b]).piece(t));
        prop_assert_eq!(sum.end, a.end.min(b.end));
        for k in 0..=DEGREE {
            prop_assert_eq!(sum.coefficients[k], a.coefficients[k] + b.coefficients[k]);
        }
    }

    #[test]
    fn any_time_and_any_number_gives_a_piece(signal in any_signal(), t in any::<f64>()) {
        let piece = signal.piece(t);
        prop_assert!(piece.end > t || piece.end == f64::INFINITY || t.is_nan());
        if t.is_finite() {
            prop_assert!(piece.coefficients.iter().all(|c| c.is_finite()), "{:?}", piece);
            prop_assert!(signal.value(t).is_finite());
        }
    }

    #[test]
    fn any_parameters_give_a_piece(a in any::<f64>(), b in any::<f64>(), c in any::<f64>(), t in 0.0..1e9) {
        for signal in [
            Signal::Step { value: 1.0, at: a },
            Signal::Pulse { value: 1.0, duration: a, at: b },
            Signal::Ramp { value: 1.0, over: a, at: b },
            Signal::Triangle { amplitude: 1.0, frequency: a },
            Signal::Square { amplitude: 1.0, frequency: a, duty: b },
            Signal::Sine { amplitude: 1.0, frequency: a, phase: b, offset: 0.0 },
            Signal::Chirp { amplitude: 1.0, from: a, to: b, over: c },
            Signal::Prbs { amplitude: 1.0, bit: a, seed: 1 },
            Signal::Table { points: vec![[a, 1.0], [b, 2.0], [c, 3.0]] },
            Signal::sequence(vec![
                Slot { signal: Signal::Step { value: 1.0, at: 0.0 }, lasts: a },
                Slot { signal: Signal::Step { value: 1.0, at: b }, lasts: c },
            ]),
        ] {
            for t in [0.0, t, a.abs(), f64::INFINITY] {
                let piece = signal.piece(t);
                prop_assert!(piece.end > t || piece.end == f64::INFINITY, "{:?} {:?}", signal, piece);
                signal.value(t);
                signal.duration();
            }
        }
    }
}

/// Seams up to and including `until`.
fn seams(signal: &Signal, until: f64) -> usize {
    let mut count = 0;
    let mut t = signal.piece(0.0).end;
    while t <= until {
        count += 1;
        t = signal.piece(t).end;
    }
    count
}

#[test]
fn no_seam_is_missed_or_doubled() {
    let triangle = |frequency| Signal::Triangle { amplitude: 3.0, frequency };
    let square = |frequency, duty| Signal::Square { amplitude: 3.0, frequency, duty };
    let prbs = Signal::Prbs { amplitude: 3.0, bit: 0.1, seed: 7 };
    assert_eq!(seams(&triangle(3.0), 1000.0), 6000);
    assert_eq!(seams(&triangle(0.3), 1000.0), 600);
    assert_eq!(seams(&square(3.0, 0.5), 1000.1), 6000);
    assert_eq!(seams(&square(7.0, 0.3), 1000.01), 14000);
    assert_eq!(seams(&prbs, 10_000.05), 100_000);
    // Two names for one lattice: the seams coincide, though they are computed differently.
    let twice = Signal::Sum(vec![prbs.clone(), square(5.0, 0.5), square(10.0, 0.5), square(10.0, 0.99)]);
    assert_eq!(seams(&twice, 1000.01), 30_000);
    // In a sequence the clocks differ as well.
    let slot = |lasts| Slot { signal: square(10.0, 0.5), lasts };
    let turns = Signal::sequence(vec![slot(0.1), slot(0.7), slot(0.3), slot(1.1), slot(1.0)]);
    assert_eq!(seams(&Signal::Sum(vec![turns.clone(), square(10.0, 0.5)]), 1000.01), seams(&turns, 1000.01));
    assert_eq!(seams(&turns, 1000.01), 20_000);
    assert_eq!(seams(&Signal::Sine { amplitude: 1.0, frequency: 3.0, phase: 0.3, offset: 1.0 }, 100.001), 7800);
    assert_eq!(seams(&Signal::Chirp { amplitude: 1.0, from: 1.0, to: 10.0, over: 10.0 }, 1e9), 2600);
}

#[test]
fn ten_turns_of_a_tenth_end_at_one() {
    let slot = |value| Slot { signal: Signal::Step { value, at: 0.0 }, lasts: 0.1 };
    let signal = Signal::sequence((0..11).map(|k| slot(f64::from(k))).collect());
    let ends: Vec<f64> = walk(&signal, 1.0).iter().map(|p| p.end).take(10).collect();
    assert_eq!(ends, (1..=10).map(|k| 0.1 * f64::from(k)).collect::<Vec<_>>());
    assert_eq!(ends[9], 1.0);
    assert_eq!(signal.value(0.3), 3.0);
    assert_eq!(signal.duration(), Some(1.1));
}

/// Each look-up counted the turns from the first on: a million of them, met one after another, would have taken hours.
#[test]
fn a_million_turns_are_met_in_no_time() {
    let slot = |k: u32| Slot { signal: Signal::Step { value: f64::from(k), at: 0.0 }, lasts: 0.1 };
    let signal = Signal::sequence((0..1_000_000).map(slot).collect());
    assert_eq!(seams(&signal, 99_999.95), 999_999);
    assert_eq!((signal.value(0.0), signal.value(1234.5), signal.value(1e9)), (0.0, 12345.0, 999_999.0));
    assert!((signal.duration().unwrap() - 100_000.0).abs() < 1e-9);
}

#[test]
fn straight_pieces_meet_their_points() {
    let triangle = Signal::Triangle { amplitude: 3.0, frequency: 2.0 };
    let pieces = walk(&triangle, 2.0);
    assert_eq!(pieces[0].coefficients[..2], [0.0, 24.0]);
    assert_eq!((pieces[0].end, pieces[0].value(0.125)), (0.125, 3.0));
    assert_eq!(pieces[1].coefficients[..2], [3.0, -24.0]);
    assert!(pieces.iter().all(|p| p.degree() == 1));
    let table = Signal::Table { points: vec![[0.0, 0.0], [0.1, 5.0], [0.1, 2.0], [0.4, 2.0], [0.5, -1.0]] };
    let pieces = walk(&table, f64::MAX);
    assert_eq!(pieces.iter().map(|p| p.end).collect::<Vec<_>>(), [0.1, 0.4, 0.5, f64::INFINITY]);
    assert_eq!(pieces.iter().map(|p| p.coefficients[0]).collect::<Vec<_>>(), [0.0, 2.0, 2.0, -1.0]);
    assert_eq!(pieces.iter().map(Piece::degree).collect::<Vec<_>>(), [1, 0, 1, 0]);
    assert!((pieces[0].value(0.1) - 5.0).abs() < 1e-15);
}

/// After twelve minutes the phase is as good as at the start.
#[test]
fn a_sine_does_not_lose_its_phase() {
    let sine = Signal::Sine { amplitude: 2.0, frequency: 50.0, phase: 0.25, offset: 0.5 };
    for k in [0u32, 1, 999, 46_079] {
        // Times that are exact in binary: k/64 s is 50 k/64 turns.
        let t = f64::from(k) / 64.0;
        let turns = f64::from(50 * k % 64) / 64.0;
        let exact = 0.5 + 2.0 * (TAU * turns + 0.25).sin();
        assert!((sine.value(t) - exact).abs() < 2e-15);
        assert!((sine.piece(t).value(t) - exact).abs() < 4e-14);
    }
}

#[test]
fn smooth_pieces_are_good_to_rounding() {
    for signal in [
        Signal::Sine { amplitude: 1.0, frequency: 3.0, phase: 0.3, offset: 0.0 },
        Signal::Chirp { amplitude: 1.0, from: 0.5, to: 40.0, over: 5.0 },
        Signal::Chirp { amplitude: 1.0, from: 0.0, to: 0.1, over: 1.0 },
    ] {
        let mut worst: f64 = 0.0;
        for piece in walk(&signal, 4.0) {
            let end = piece.end.min(5.0);
            for i in 0..50 {
                let t = piece.start + (end - piece.start) * f64::from(i) / 50.0;
                worst = worst.max((piece.value(t) - signal.value(t)).abs());
            }
        }
        assert!(worst < 2e-14, "{worst:e} in {signal:?}");
    }
}

#[test]
fn a_prbs_is_balanced_and_as_long_as_it_says() {
    let highs = (0..prbs::PERIOD).filter(|&k| prbs::high(3, k)).count() as u64;
    assert_eq!(highs, prbs::PERIOD / 2 + 1);
    // Of a maximum-length sequence, every shift agrees with it in one place fewer than it differs.
    for shift in [1, 2, 3, 20, 341, 1025, 61_681, 349_525] {
        let agree = (0..prbs::PERIOD).filter(|&k| prbs::high(3, k) == prbs::high(3, k + shift)).count() as u64;
        assert_eq!(agree, prbs::PERIOD / 2, "shift {shift}");
    }
    let signal = |seed| Signal::Prbs { amplitude: 1.0, bit: 0.1, seed };
    let bits = |seed| (0..64).map(|k| signal(seed).value(0.1 * f64::from(k)) > 0.0).collect::<Vec<_>>();
    assert_eq!(bits(1), bits(1));
    assert_ne!(bits(1), bits(2));
    assert_ne!(bits(0), bits(1));
}

#[test]
fn nothing_hangs_or_breaks_where_nothing_is_said() {
    for signal in [
        Signal::Table { points: vec![] },
        Signal::Sampled { times: vec![0.0, 1.0], values: vec![], hold: Hold::Linear },
        Signal::Sum(vec![]),
        Signal::sequence(vec![]),
        Signal::Multisine { tones: vec![] },
        Signal::Pulse { value: 1.0, duration: 0.0, at: 0.0 },
        Signal::Chirp { amplitude: 1.0, from: 1.0, to: 2.0, over: 0.0 },
        Signal::Triangle { amplitude: 1.0, frequency: 0.0 },
        Signal::Prbs { amplitude: 1.0, bit: 0.0, seed: 0 },
        Signal::Sine { amplitude: 0.0, frequency: 5.0, phase: 1.0, offset: 0.0 },
    ] {
        assert_eq!(signal.piece(0.0), Piece { start: 0.0, end: f64::INFINITY, coefficients: [0.0; 8] }, "{signal:?}");
        assert_eq!(signal.value(1e9), 0.0);
    }
    assert_eq!(Signal::Ramp { value: 2.0, over: 0.0, at: 0.0 }.piece(0.0).coefficients[0], 2.0);
    let still = Signal::Sine { amplitude: 2.0, frequency: 0.0, phase: 0.5, offset: 1.0 }.piece(3.0);
    assert_eq!((still.end, still.degree(), still.coefficients[0]), (f64::INFINITY, 0, 1.0 + 2.0 * 0.5f64.sin()));
    // Far beyond what the clock resolves, the mean; a clock of 0.1 s goes on for ever.
    let fast = Signal::Prbs { amplitude: 1.0, bit: 1e-9, seed: 0 };
    assert_eq!(fast.piece(1e9).end, f64::INFINITY);
    assert!(fast.piece(1.0).end - 1.0 <= 1.001e-9);
    let slow = Signal::Prbs { amplitude: 1.0, bit: 0.1, seed: 0 }.piece(1e9);
    assert!(slow.end > 1e9 && slow.end <= 1e9 + 0.11);
}

#[test]
fn durations() {
    let at = 0.5;
    assert_eq!(Signal::Step { value: 1.0, at }.duration(), None);
    assert_eq!(Signal::Pulse { value: 1.0, duration: 0.25, at }.duration(), Some(0.75));
    assert_eq!(Signal::Ramp { value: 1.0, over: 2.0, at }.duration(), Some(2.5));
    assert_eq!(Signal::Table { points: vec![[0.0, 1.0], [3.0, 1.0]] }.duration(), Some(3.0));
    let pulse = Signal::Pulse { value: 1.0, duration: 0.25, at };
    assert_eq!(Signal::Sum(vec![pulse.clone(), Signal::Table { points: vec![] }]).duration(), Some(0.75));
    assert_eq!(Signal::Sum(vec![pulse.clone(), Signal::Step { value: 1.0, at }]).duration(), None);
    let slots = |lasts| {
        vec![Slot { signal: Signal::Step { value: 1.0, at }, lasts: 2.0 }, Slot { signal: pulse.clone(), lasts }]
    };
    assert_eq!(Signal::sequence(slots(1.0)).duration(), Some(3.0));
    assert_eq!(Signal::sequence(slots(f64::INFINITY)).duration(), Some(2.75));
}

#[test]
fn equal_samples_are_one_piece() {
    let sampled =
        |hold| Signal::Sampled { times: vec![0.0, 1.0, 2.0, 3.0, 4.0], values: vec![5.0, 5.0, 5.0, 0.0, 0.0], hold };
    let ends = |signal: Signal| [0.0, 0.5, 2.0, 3.0, 4.0].map(|t| signal.piece(t).end);
    assert_eq!(ends(sampled(Hold::Zero)), [3.0, 3.0, 3.0, 4.0, f64::INFINITY]);
    assert_eq!(ends(sampled(Hold::Linear)), [2.0, 2.0, 3.0, 4.0, f64::INFINITY]);
}
