//! Limits whose source can be computed, and limits that have to be in order.

// Constants are what these tests are about; a failed one is to be listed with the others.
#![allow(clippy::assertions_on_constants)]

use super::*;
use std::f64::consts::{PI, SQRT_2};

/// Share of a normal distribution beyond this many standard deviations on one side.
fn beyond(z: f64) -> f64 {
    0.5 * libm::erfc(z / SQRT_2)
}

/// True if a value agrees with a figure of a doc comment to this share.
fn near(value: f64, stated: f64, share: f64) -> bool {
    (value / stated - 1.0).abs() <= share
}

/// True if each number is larger than the one before, by a factor between these.
fn rises(numbers: &[f64], [low, high]: [f64; 2]) -> bool {
    numbers.windows(2).all(|pair| (low..=high).contains(&(pair[1] / pair[0])))
}

#[test]
fn limits_of_normal_deviates_are_theirs() {
    assert!((beyond(NORMAL) - 0.025).abs() < 1e-9);
    assert!(near(2.0 * beyond(WINDOWS_OFF), 0.02, 0.1) && near(2.0 * beyond(LAW_SHOWN), 0.003, 0.11));
    assert!(near(beyond(FAR_BOUND), 1e-9, 0.02));
    // Efficiency of Huber's estimate: (∫ψ′φ)²/∫ψ²φ, with ψ′ = 1 within k.
    let k = HUBER;
    let (inside, density) = (1.0 - 2.0 * beyond(k), (-0.5 * k * k).exp() / (2.0 * PI).sqrt());
    let square = inside - 2.0 * k * density + 2.0 * k * k * beyond(k);
    assert!(near(inside * inside / square, 0.95, 1e-4));
    assert_eq!(STAND_OUT, 3.0 * 3.0);
    assert!((SENSOR_START - 12f64.sqrt().recip()).abs() < 1e-4);
}

/// Probability that the squares of `n` standard normal values have a sum beyond this.
fn squares_beyond(n: usize, sum: f64) -> f64 {
    let odd = if n % 2 == 1 { libm::erfc((0.5 * sum).sqrt()) } else { 0.0 };
    let term = |k: f64| (0.5 * sum).powf(k) * (-0.5 * sum).exp() / libm::tgamma(k + 1.0);
    odd + (1..=n / 2).map(|i| term(0.5 * n as f64 - i as f64)).sum::<f64>()
}

/// Four machines are the fewest with which this happens in less than one of 200 cases; more take more time.
#[test]
fn an_honest_promise_is_seldom_broken_by_the_machines_that_verify_it() {
    let broken = |n: usize| squares_beyond(n, n as f64 * PROMISE_BROKEN * PROMISE_BROKEN);
    assert!(near(broken(1), 0.0455, 1e-2) && near(broken(2), (-4f64).exp(), 1e-9));
    assert!(broken(VERIFIED) < 0.005 && broken(VERIFIED - 1) > 0.005, "{} {}", broken(VERIFIED), broken(VERIFIED - 1));
}

#[test]
fn limits_of_rasters_are_those_of_their_errors() {
    // Straight lines through v² at distances h differ from it by h²/4 at most, of the greatest at v = 1.
    let h = 2.0 / (DRAG_POINTS - 1) as f64;
    assert!(h * h / 4.0 <= 0.003);
    // exp(−v²) behind the last point.
    assert!(near((-STRIBECK_POINTS[8] * STRIBECK_POINTS[8]).exp(), 0.002, 0.05));
    assert!(rises(&STRIBECK_POINTS, [1.1, 2.1]));
    // The power of a sine of a wave number off by half a step of the raster: sin²(πd)/(πd)².
    let d = 0.5 / MAP_RASTER;
    assert!(near(1.0 - ((PI * d).sin() / (PI * d)).powi(2), 0.05, 0.02));
    // A step of the golden section keeps 0.618 of the interval.
    assert!((0.5 * (5f64.sqrt() - 1.0)).powi(MAP_SECTIONS as i32) <= 1e-3);
    assert_eq!(2 * (2 * MAP_NEIGHBOURS + 1), 10);
    assert!(near(1.0 / OF_RATE, 10.0, 1e-12));
    // Truncation h² and rounding ε/h of a difference are equal at ∛ε.
    assert!(near(CAUSE_DIFFERENCE, f64::EPSILON.cbrt(), 0.7));
    assert!(near(EQUATION_STEP.powi(3) / f64::EPSILON, 1.0, 200.0));
    assert!(SWING_FASTEST < PI && near(SWING_FASTEST, PI, 0.05));
    assert!(ROUNDED > 1.0 / PI);
    assert_eq!(WAVE_STEP, 0.5);
}

#[test]
fn limits_of_memory_are_what_they_say() {
    let size = size_of::<f64>();
    assert_eq!((MOST_DRAWS * size, WINDOWS_MOST * size), (80_000_000, 160_000_000));
    assert!(CAUSE_MOST_CURVED <= CAUSE_MOST_VALUES);
    assert_eq!(EFFECTIVE, 4.0 * 100.0);
    assert!(near(WALK_TAKEN + WALK_TAKEN_OF_ONE, 0.44, 1e-12));
    // Random walks: 2.38²/n of the covariance (Gelman and others 1996).
    assert_eq!(WALK_LENGTH, 2.38);
}

#[test]
fn what_is_tried_covers_what_lies_between() {
    assert!(rises(&WIDTHS, [1.3, 1.51]) && WIDTHS.contains(&WIDEST_IN_REGRESSION));
    assert!(rises(&CAUSE_SPRINGS, [2.0, 2.0]) && FLANK_FREQUENCY > CAUSE_SPRINGS[4]);
    assert!(rises(&CAUSE_GAPS, [2.0, 2.0]) && rises(&CAUSE_WIDTHS, [2.0, 2.0]) && rises(&CAUSE_BENDS, [3.9, 4.2]));
    assert!(rises(&STRIBECK_SHARES, [2.7, 3.1]) && rises(&UNEXPLAINED_WINDOWS, [4.0, 4.0]));
    // A search may go from one start to the next on either side, of those that are farthest apart.
    assert!(CAUSE_AROUND[0] < 1.0 / 4.2 && CAUSE_AROUND[1] > 4.2);
    assert!(rises(&CAUSE_LIMITS, [1.1, 1.4]) && CAUSE_LEAST_LIMIT < CAUSE_LIMITS[0] && CAUSE_LIMITS[4] < 1.0);
    assert!(rises(&START_WINDOWS, [3.0, 3.0]) && START_WINDOWS[0] >= LEAST_ROWS as f64);
    let least = f64::from(LEAST_POWER as f32);
    assert!(near(least * POWER_RATIO.powi(MOST_POWERS as i32 - 1), 1.6e5, 0.01) && TIME_RATIO > 1.0);
    assert!(SPEED_POINTS.is_sorted() && SPEED_POINTS.iter().zip(SPEED_POINTS.iter().rev()).all(|(a, b)| *a == -*b));
    assert_eq!(SPEED_POINTS.len(), TRAVEL_POINTS);
    assert!(CAUSE_DELAYS[0] == -CAUSE_DELAYS[1] && WINDOW_DELAYS.contains(&CAUSE_DELAYS[0]));
    // A limit of 0.8 of what is asked for.
    assert!(near(CAUSE_WARNS, 1.0 - 0.8 * 0.8, 1e-12));
}

#[test]
fn limits_are_in_order() {
    assert!(SHORTEST_DELAY < LONGEST_DELAY && LONGEST_DELAY < INPUT_BEFORE_WINDOW as isize);
    assert!(SHIFT_STRIDE < LONGEST_SHIFT && SHIFT_UNEXPLAINED < SUSPECT_SHIFT && SUSPECT_SHIFT < SUSPECT_DELAY);
    assert!(LAW_LEAST < LAW_FIRST && LAW_FIRST < LAW_MOST && LAW_FIRST == STRIBECK_ABOVE);
    assert!(LEAST_BREAKAWAY < 1.0 && 1.0 < BREAKAWAY_FIRST && BREAKAWAY_FIRST < MOST_BREAKAWAY);
    assert!(CAUSE_LEAST_LIMIT < LEVEL_MOST && LEVEL_LEAST < LEVEL_MOST && LEVEL_MOST < 1.0);
    assert!(KNOWN_SHARES[0] == KNOWN_SHARE && near(KNOWN_SHARES[0] + KNOWN_SHARES[1], 1.0, 1e-12));
    assert!(KNOWN_SHARE < CAUSE_SHARE && CAUSE_SHARE < KNOWN_SHARES[1]);
    assert!(UNINTERRUPTED == 0.5 * INTERRUPTED && LEAST_INTERRUPTED < UNEXPLAINED_NOISE);
    assert!(NO_WORSE < UNIT_WORSE && MENDED < 1.0 && COST_GROWTH < SAME_MINIMUM);
    assert!(MORE_THAN_NOISE < BELTS_DOUBTFUL && BELTS_DOUBTFUL < FAR_BEYOND_NOISE);
    assert!(FEWEST_WINDOWS < MOST_START_WINDOWS && SHORTEST_BEGINNING < 1.0);
    assert!(YAW_BEARINGS < YAW_SPACING && SPRING_DAMPING < FLANK_DAMPING && FLANK_DAMPING < 1.0);
    assert!(FORCE_FIRST * FORCE_MOST == 100.0 && LAW_KEEPS < 1.0 && JUMP < 1.0);
    // A search ends well below what noise makes of an estimate, and a rough one before a sharp one.
    assert!(SHARP < NEAR);
    assert!(REFIT_TOLERANCE < ROUGH_TOLERANCE && ROUGH_TOLERANCE == SHOWS && SHOWS == KINK && PAST_KINKS < NEAR);
    assert!(KEPT < CONTRADICTS && CONTRADICTS < 1.0 && FIRM < 1.0);
    assert!(CAUSE_STEPS < TRIAL_ITERATIONS && STARTS_FITTED < CAUSES_FITTED && NEAREST_FAR < NEAREST_ITERATIONS);
    assert!(CAUSE_SLOW_STEPS <= CAUSE_STEPS && CAUSE_NEAR > CAUSE_RIVAL && STEPS_IN_PART < STEPS);
    assert!(BLOCK_SAMPLES * LOG_BLOCKS > HELD_OUT_ROWS && FOLDS > FEWEST_LOGS && MAP_POINTS > MAP_LOCAL);
    assert!(MAP_SPEED < 1.0 && MAP_HALF < 1.0 && MAP_LENGTH < 1.0 && MAP_PERIODS >= FEWEST_WAVES);
    assert!(DESIGN_BARREN <= BARREN && FINALISTS < FIRST_POINTS && FIRST_POINTS < MOST_VALUES && HOPEFUL > 1.0);
    assert!(DIGITS_READ < DIGITS_KNOWN && FILE_ROUNDING < NOTHING && NOTHING == LAW_DUST);
    assert!(WHITE_BEFOREHAND + TWO_BEFOREHAND + SWING_BEFOREHAND < 1.0, "probability is left for one slow noise");
}
