//! Limits and thresholds of the fit, room by room.
//!
//! Each has its meaning, its unit (1 for a ratio), its source, and a test of its effect. The source "chosen" marks a
//! judgement. Other modules declare no such numbers; `tests/rooms.rs` checks this.

// asked: what is compared with what

/// Error that numbers in files and solvers may have, as a share of the range of a quantity.
///
/// Unit: 1. Source: ten digits, which the usual logs of simulations have. Test: `limits_are_in_order`.
pub(crate) const FILE_ROUNDING: f64 = 1e-10;

/// Error of a delay that counts as 100 %, from which on it is not determined.
///
/// Unit: samples. Source: chosen: few logs determine a delay to a sample. Test:
/// `a_delay_is_found_in_windows_as_in_the_whole_log`.
pub(crate) const KNOWN_DELAY: f64 = 10.0;

/// Initial speed at which a log is taken to begin in motion.
///
/// Unit: standard errors of the speed. Source: chosen. Test: `a_log_that_begins_at_rest_does_so_in_its_first_window`.
pub(crate) const STARTS_MOVING: f64 = 5.0;

/// Standard deviation of noise that neighbouring values share, relative to what they differ by.
///
/// Unit: 1. Source: noise of first order with a time constant of 30 samples. Test:
/// `a_wrong_model_does_not_make_its_start_doubtful`.
pub(crate) const SLOW_BY_DIFFERENCE: f64 = 5.0;

/// Deviation of a sample time from an even raster up to which the solver answers at the raster's time. The error of a
/// value is at most its rate of change times this share of an interval.
///
/// Unit: sample intervals. Source: chosen. Test: `times_with_microseconds_are_even`.
pub(crate) const EVEN_RASTER: f64 = 1e-3;

/// Minimum up and down steps (and per 100 samples) for a resting signal to count as dithering.
///
/// Unit: steps. Source: chosen. Test: `what_trembles_at_rest_is_told_from_what_moves`.
pub(crate) const DITHER_STEPS: usize = 2;

/// Points of the raster per interval where times are uneven; between them positions follow cubics through positions and
/// speeds, all else straight lines. With h the raster, the error is at most h⁴|x⁗|/384, and h²|ÿ|/8.
///
/// Unit: 1/interval. Source: chosen; error bounds of Hermite and linear interpolation. Test:
/// `cubics_go_through_cubics`.
pub(crate) const RASTER_POINTS: f64 = 8.0;

/// Rows of input kept from before a window: more than a fitted delay comes to.
///
/// Unit: samples. Source: chosen; above `LONGEST_DELAY`. Test:
/// `a_window_that_is_late_goes_on_with_the_input_from_before_it`.
pub(crate) const INPUT_BEFORE_WINDOW: usize = 60;

/// Step of the central differences of the equations of motion, relative to a variable or its unit: truncation and
/// rounding of one of many terms balance there.
///
/// Unit: 1. Source: balance of truncation and rounding. Test: `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const EQUATION_STEP: f64 = 3e-5;

// search: where the least is

/// Residual beyond which Huber's loss is linear.
///
/// Unit: standard deviations. Source: P. J. Huber 1964: 95 % efficient for Gaussian noise. Test:
/// `limits_of_normal_deviates_are_theirs`.
pub(crate) const HUBER: f64 = 1.345;

/// Promised gain below which a search measures derivatives over `PAST_KINKS`.
///
/// Unit: standard errors. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const NEAR: f64 = 1.0;

/// Promised gain below which a search measures central derivatives, which cost twice as much.
///
/// Unit: standard errors. Source: chosen: a hundred times the usual tolerance. Test:
/// `a_rough_search_measures_central_derivatives_at_its_end_only`.
pub(crate) const SHARP: f64 = 0.1;

/// Step of derivatives near a minimum and in a posterior: large enough to pass over small kinks by sticks and slips.
///
/// Unit: standard errors of a variable by itself. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const PAST_KINKS: f64 = 0.3;

/// Maximum number of variables that evolution searches.
///
/// Unit: variables. Source: chosen; its cost grows with their square. Test: `many_variables_do_not_evolve`.
pub(crate) const MOST_EVOLVED: usize = 16;

/// Generations without a gain of `SHOWS` after which an evolution ends.
///
/// Unit: generations. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const BARREN: usize = 8;

/// Promised gain at which a minimum on a kink counts as converged: of all gradients around together, or of one that no
/// step of any length fulfilled.
///
/// Unit: standard errors. Source: a tenth of what noise makes of an estimate. Test: `a_minimum_on_a_kink_is_one`.
pub(crate) const KINK: f64 = 0.1;

/// Two consecutive steps with a gain below this, and far below the promised one, indicate a kink; so do steps after
/// which twice this is still promised.
///
/// Unit: standard errors. Source: a tenth of what noise makes of an estimate. Test: `limits_are_in_order`.
pub(crate) const SHOWS: f64 = 0.1;

/// Step size along the longest axis at which an evolution ends.
///
/// Unit: units of the search, here standard errors. Source: chosen. Test: `the_lowest_point_of_a_long_valley_is_found`.
pub(crate) const SMALLEST_STEP: f64 = 0.01;

/// Share of its promised gain that a step of a bundle must keep to be taken.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const KEPT: f64 = 0.1;

/// Share of the promised gain by which a new piece must contradict a step for the next step to be another.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const CONTRADICTS: f64 = 0.5;

/// Maximum halvings of a step of a bundle that is neither good nor informative.
///
/// Unit: halvings. Source: chosen. Test: `a_step_is_halved_until_the_model_can_be_run`.
pub(crate) const HALVINGS: usize = 12;

/// Gradients that a bundle keeps beyond the number of variables.
///
/// Unit: gradients. Source: chosen. Test: `pieces_far_from_the_cost_are_forgotten`.
pub(crate) const SPARE_PIECES: usize = 10;

/// Regularisation of the metric of a bundle, relative to the norm of a variable's own column.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FIRM: f64 = 1e-3;

/// Maximum rounds in which weights are estimated from the residuals.
///
/// Unit: rounds. Source: chosen. Test: `weights_agree_with_the_residuals_that_they_lead_to`.
pub(crate) const WEIGHT_ROUNDS: usize = 4;

/// Maximum Jacobians of a start other than the first, before the best of them goes on.
///
/// Unit: Jacobians. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const TRIAL_ITERATIONS: usize = 12;

/// Gain that the last step may promise in a fit that is only compared with another: a trial, a candidate law, a start.
///
/// Unit: standard errors. Source: a tenth of what noise makes of an estimate. Test: `limits_are_in_order`.
pub(crate) const ROUGH_TOLERANCE: f64 = 0.1;

/// Tolerance of refits: windows, profiles, and starts of held-out logs.
///
/// Unit: standard errors. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const REFIT_TOLERANCE: f64 = 0.05;

/// Rows averaged into one equation of the regression, against noise in derivatives.
///
/// Unit: samples. Source: chosen. Test: `a_thousand_rows_in_motion_make_two_hundred_equations`.
pub(crate) const REGRESSION_BLOCK: usize = 5;

/// Number of equal positions after which an axis counts as at rest, where friction is not determined.
///
/// Unit: samples. Source: chosen. Test: `rows_at_rest_tell_nothing_of_friction`.
pub(crate) const REST_ROWS: f64 = 20.0;

/// Widths of the Gaussian for derivatives of logs; the least that keeps to the permitted noise is taken.
///
/// Unit: samples. Source: steps of about 4/3 and 3/2. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const WIDTHS: [f64; 12] = [2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0, 96.0];

/// Widest of `WIDTHS` that a regression tries.
///
/// Unit: samples. Source: chosen: beyond it a move is smeared. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const WIDEST_IN_REGRESSION: f64 = 32.0;

/// Noise permitted in the acceleration of a regression, relative to its root mean square.
///
/// Unit: 1. Source: chosen. Test: `an_inertia_is_found_beside_noise`.
pub(crate) const REGRESSION_NOISE: f64 = 0.2;

/// Rows of a tall matrix that are reduced at once.
///
/// Unit: rows. Source: speed. Test: `products_of_columns_stay`.
pub(crate) const STRETCH: usize = 256;

// noise: what residuals are like

/// Half-width of the central 95 % of a normal distribution.
///
/// Unit: standard deviations. Source: Φ⁻¹(0.975). Test: `limits_of_normal_deviates_are_theirs`.
pub(crate) const NORMAL: f64 = 1.959_963_985;

/// Ratio of neighbouring time constants in the grid of slow noises.
///
/// Unit: 1. Source: chosen. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const TIME_RATIO: f64 = 2.2;

/// Ratio of neighbouring powers in the grid of slow noises.
///
/// Unit: 1. Source: chosen. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const POWER_RATIO: f64 = 3.0;

/// Least power of a slow noise at low frequencies, relative to white noise.
///
/// Unit: 1. Source: chosen. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const LEAST_POWER: f64 = 0.1;

/// Number of powers in the grid of slow noises.
///
/// Unit: 1. Source: chosen: 0.1 · 3¹³ = 1.6e5. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const MOST_POWERS: usize = 14;

/// Prior probability of white noise.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const WHITE_BEFOREHAND: f64 = 0.3;

/// Prior probability of two slow noises.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const TWO_BEFOREHAND: f64 = 0.35;

/// Least ratio of the time constants of two slow noises, as a logarithm.
///
/// Unit: 1. Source: chosen. Test: `two_slow_noises_are_told_apart`.
pub(crate) const TIMES_APART: f64 = 1.0;

/// Rounds in which each of two slow noises is sought again beside the other.
///
/// Unit: rounds. Source: chosen. Test: `two_slow_noises_are_told_apart`.
pub(crate) const NOISE_TURNS: usize = 3;

/// Prior probability of noise that swings.
///
/// Unit: 1. Source: chosen. Test: `noise_that_swings_is_known_as_such`.
pub(crate) const SWING_BEFOREHAND: f64 = 0.1;

/// Least number of swings in the longest log.
///
/// Unit: periods. Source: chosen: fewer are a drift. Test: `a_slow_wave_is_a_drift`.
pub(crate) const SWINGS_IN_LOG: f64 = 5.0;

/// Greatest frequency of noise that swings.
///
/// Unit: rad between two blocks. Source: chosen: little below two blocks in a period. Test:
/// `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const SWING_FASTEST: f64 = 3.0;

/// Ratio of neighbouring frequencies that are tried.
///
/// Unit: 1. Source: chosen: about the width of a peak with `SWING_DAMPING`. Test:
/// `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_RATIO: f64 = 1.2;

/// Damping ratio with which frequencies are tried.
///
/// Unit: 1. Source: chosen. Test: `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_DAMPING: f64 = 0.1;

/// Variances with which frequencies are tried, relative to white noise of a block.
///
/// Unit: 1. Source: chosen. Test: `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_POWERS: [f64; 3] = [1.0, 30.0, 1000.0];

/// Ways from the best frequency, time and variance: each alone, and time with variance, since a noise that keeps its
/// phase through the log shows neither alone.
///
/// Unit: of their logarithms. Source: 2 σ²/τ, the power that drives it. Test: `intervals_hold_beside_a_tone`.
pub(crate) const SWING_WAYS: [[f64; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0]];

/// First and greatest steps along them.
///
/// Unit: of their logarithms. Source: chosen: as far as those that were tried are apart. Test:
/// `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_STEPS: [f64; 4] = [0.08, 2.0, 1.5, 1.0];

/// Greatest number of rounds of steps.
///
/// Unit: rounds. Source: chosen. Test: `intervals_hold_beside_a_tone`.
pub(crate) const SWING_ROUNDS: usize = 60;

/// Factor on a step that improves nothing; one that does grows by its inverse.
///
/// Unit: 1. Source: chosen. Test: `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_SHRINKS: f64 = 0.5;

/// Steps, relative to the first, below which the search ends.
///
/// Unit: 1. Source: chosen: of the frequency, a tenth of a radian along [`BLOCKS`]. Test:
/// `intervals_hold_beside_a_tone`.
pub(crate) const SWING_FINE: f64 = 1e-3;

/// Longest time constant of noise that swings: a tone.
///
/// Unit: lengths of the longest log. Source: chosen: ten thousand values of a tone 100 times as large as other noise
/// determine its variance relative to that to 1/10⁸. Test: `intervals_hold_beside_a_tone`.
pub(crate) const SWING_LONGEST: f64 = 1e9;

/// Greatest variance of noise that swings.
///
/// Unit: mean squares of the residuals. Source: chosen: more would be there by chance. Test:
/// `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_MOST: f64 = 2.0;

/// Grid around the most likely noise that swings.
///
/// Unit: logarithms of frequency, time and variance. Source: chosen: about a standard error of each. Test:
/// `narrow_band_noise_is_found_wherever_it_is`.
pub(crate) const SWING_AROUND: [f64; 3] = [0.02, 0.4, 0.4];

/// Maximum number of waves along the travel.
///
/// Unit: waves. Source: chosen. Test: `an_error_that_comes_again_at_the_same_place_is_named`.
pub(crate) const WAVES: usize = 3;

/// Least amplitude of a wave: rounding alone makes waves of 1/π steps.
///
/// Unit: steps of the converter. Source: above 1/π. Test: `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const ROUNDED: f64 = 0.5;

/// Least amplitude of a wave, as a share of the range of its quantity.
///
/// Unit: 1. Source: below are the last digits of logs and solvers. Test: `last_digits_of_a_log_speak_for_no_law`.
pub(crate) const NOTHING: f64 = 1e-6;

/// Kinds of noise that are filtered side by side.
///
/// Unit: kinds. Source: speed: two vectors of AVX2. Test: `a_filter_agrees_with_the_covariance_of_its_noise`.
pub(crate) const BESIDE: usize = 8;

/// Maximum number of residuals of several logs that are computed one after the other; others are computed beside them.
///
/// Unit: residuals. Source: chosen: some 2 ms, several times what a machine's modes take. Test:
/// `logs_beside_each_other_have_the_jacobian_of_each`.
pub(crate) const ROWS_BESIDE: usize = 2500;

/// Maximum number of blocks into which the values of a quantity are averaged.
///
/// Unit: blocks. Source: speed. Test: `a_long_log_has_a_bounded_number_of_blocks`.
pub(crate) const BLOCKS: usize = 700;

/// Maximum number of slow noises at once.
///
/// Unit: states of the filter. Source: two noises describe the residuals tried so far. Test:
/// `a_filter_agrees_with_the_covariance_of_its_noise`.
pub(crate) const SLOW_NOISES: usize = 2;

/// Least number of waves in the travel: an error that does not repeat is one of a law, not of a place.
///
/// Unit: waves. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FEWEST_WAVES: f64 = 2.0;

/// Share of the travel that must be passed in both directions: the error of a law changes with the direction, that of a
/// place does not.
///
/// Unit: 1. Source: chosen. Test: `a_wave_must_be_seen_in_both_directions`.
pub(crate) const BOTH_WAYS: f64 = 0.5;

/// Step of the wave numbers that are tried.
///
/// Unit: waves in the travel. Source: chosen: half of what can be resolved. Test:
/// `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const WAVE_STEP: f64 = 0.5;

/// Maximum number of wave numbers that are tried.
///
/// Unit: 1. Source: speed. Test: `a_long_travel_has_a_bounded_number_of_waves`.
pub(crate) const MOST_WAVE_NUMBERS: usize = 200;

/// Halvings of the step around the best wave number.
///
/// Unit: halvings. Source: chosen. Test: `a_wave_between_those_that_are_tried_is_found`.
pub(crate) const WAVE_HALVINGS: usize = 4;

/// Gain in log-likelihood that waves must have beyond the logarithm of the number tried.
///
/// Unit: 1. Source: chosen. Test: `the_right_law_is_not_suspected`.
pub(crate) const WAVE_CLEAR: f64 = 6.0;

/// Maximum number of classes of speed with a size of noise each.
///
/// Unit: classes. Source: chosen. Test: `noise_that_grows_with_speed_has_its_size_in_each_class`.
pub(crate) const SPEED_CLASSES: usize = 6;

/// Least number of blocks in a class of speed.
///
/// Unit: blocks. Source: chosen. Test: `classes_have_a_dozen_blocks`.
pub(crate) const FEWEST_BLOCKS: usize = 12;

/// Speed below which a block is at rest, relative to the greatest.
///
/// Unit: 1. Source: chosen. Test: `noise_that_grows_with_speed_is_not_taken_to_be_as_large_at_rest`.
pub(crate) const BLOCK_AT_REST: f64 = 0.01;

/// Least noise of a class of speed, relative to that of all.
///
/// Unit: 1. Source: chosen. Test: `values_that_are_exact_have_a_hundredth_of_the_noise`.
pub(crate) const LEAST_SIZE: f64 = 0.01;

/// Gain in log-likelihood that classes of speed must have.
///
/// Unit: 1. Source: chosen. Test: `even_noise_has_no_classes`.
pub(crate) const CLASSES_CLEAR: f64 = 3.0;

// trust: what may be believed

/// Relative standard error from which on a combination counts as not determined.
///
/// Unit: 1. Source: the value and its error are alike. Test: `what_an_encoder_cannot_tell_is_said_in_words`.
pub const UNDETERMINED: f64 = 1.0;

/// Root mean square of what a change by 100 % makes of a value, below which a combination counts as not determined
/// however many values there are: averages of thousands of values would determine it only for a machine that follows
/// the model to a fraction of one step, and no machine does.
///
/// Unit: steps of the converter, as standard deviations of rounding. Source: chosen. Test:
/// `what_moves_the_outputs_less_than_a_machine_can_show_is_not_determined`.
pub const LEAST_SHOWN: f64 = 0.2;

/// Model error relative to the range of the values.
///
/// Unit: 1. Source: chosen: no model of an axis is better. Test:
/// `what_moves_the_outputs_less_than_a_machine_can_show_is_not_determined`.
pub const MODEL_ERROR: f64 = 2e-4;

/// Share of a parameter in directions that are not determined, above which it is not determined either.
///
/// Unit: 1. Source: chosen. Test: `what_is_determined_beside_what_is_not_keeps_its_interval`.
pub(crate) const SHARE_LOST: f64 = 0.1;

/// Singular values below this share of the greatest are rounding.
///
/// Unit: 1. Source: differences are good to about 1e-9 of the largest column. Test:
/// `a_direction_within_rounding_is_none`.
pub(crate) const SINGULAR_ROUNDING: f64 = 1e-8;

/// Maximum iterations of a singular value decomposition.
///
/// Unit: iterations. Source: far beyond what one takes. Test:
/// `a_decomposition_takes_a_hundredth_of_the_iterations_that_it_may`.
pub(crate) const MOST_SWEEPS: usize = 10_000;

/// Deviation from 1 up to which the ratio of two powers counts as 1.
///
/// Unit: 1. Source: chosen. Test: `ratios_are_told_where_a_gain_is_free`.
pub(crate) const WHOLE_POWER: f64 = 0.03;

/// Residuals within this multiple of the noise end the search for a start.
///
/// Unit: 1. Source: chosen: the noise is by third differences, and is not known to a few per cent. Test:
/// `limits_are_in_order`.
pub(crate) const MORE_THAN_NOISE: f64 = 1.2;

/// Residuals of an axis beyond this multiple of the noise are reported where no missing element explains them.
///
/// Unit: 1. Source: chosen: fits of real logs leave 2 to 20 times the noise. Test:
/// `residuals_far_above_the_noise_are_reported`.
pub(crate) const FAR_BEYOND_NOISE: f64 = 20.0;

/// Residuals beyond this multiple of the noise leave undecided which belt of a gantry is looser.
///
/// Unit: 1. Source: chosen: right models leave less, motors with wrong constants or a wrong delay 14 times and more.
/// Test: `belts_are_compared_with_the_element_that_explains_the_residuals`.
pub(crate) const BELTS_DOUBTFUL: f64 = 5.0;

/// Costs that differ by less are taken for those of one minimum.
///
/// Unit: 1. Source: chosen: a rough search ends within a few per mille of its minimum. Test:
/// `a_dual_belt_is_fitted_with_the_logs_of_three_motors`.
pub(crate) const SAME_MINIMUM: f64 = 0.01;

/// Length of the part of the logs of a stepper that a search begins with; each further one is twice as long.
///
/// Unit: periods of the slowest mode at the start values. Source: chosen: a swing or two, which have one minimum. Test:
/// `a_stepper_is_fitted_from_a_holding_torque_and_a_mass_that_are_far_off`.
pub(crate) const FIRST_BEGINNING: f64 = 1.5;

/// Least length of that part.
///
/// Unit: share of the logs. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const SHORTEST_BEGINNING: f64 = 0.01;

/// Rows that such a beginning has at least.
///
/// Unit: samples. Source: chosen. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const LEAST_ROWS: usize = 20;

/// Lengths of the windows that a search of a machine with several coordinates begins in, one after the other.
///
/// Unit: samples. Source: chosen: from a few swings of a belt to some ten, in logs that show them. Test:
/// `belts_are_found_from_a_stiffness_that_is_far_off`.
pub(crate) const START_WINDOWS: [f64; 3] = [20.0, 60.0, 180.0];

/// Most windows that a search begins in; longer logs have longer ones.
///
/// Unit: windows. Source: chosen: each has a start of its own, and the work grows with their square. Test:
/// `limits_are_in_order`.
pub(crate) const MOST_START_WINDOWS: f64 = 60.0;

/// Least number of windows that are compared with the whole logs.
///
/// Unit: windows. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FEWEST_WINDOWS: f64 = 6.0;

/// Least length of a window that is compared with the whole logs.
///
/// Unit: samples. Source: chosen. Test: `a_long_log_has_24_windows_and_a_short_one_windows_of_100_samples`.
pub(crate) const WINDOW_SAMPLES: f64 = 100.0;

/// Inflation of standard errors by slow noise, below which residuals hide no other model.
///
/// Unit: 1. Source: chosen. Test: `elements_are_looked_for_where_slow_noise_widens_the_errors`.
pub(crate) const COLOURED: f64 = 1.1;

/// Probability of white noise below which residuals count as coloured.
///
/// Unit: 1. Source: chosen: white noise of 700 rows has at least 0.6. Test: `slow_noise_is_told_from_white`.
pub(crate) const WHITE_LIKELY: f64 = 0.5;

/// Deviation of the windows from the whole logs, and from each other, above which they disagree.
///
/// Unit: standard errors. Source: chosen: 2 % of normal deviates. Test: `limits_of_normal_deviates_are_theirs`.
pub(crate) const WINDOWS_OFF: f64 = 2.3;

/// ε: relative growth of the cost that a round towards the nearest point may make.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const COST_GROWTH: f64 = 3e-3;

/// Maximum rounds towards the nearest point.
///
/// Unit: rounds. Source: chosen. Test: `a_curved_set_is_approached_in_rounds`.
pub(crate) const NEAREST_ROUNDS: usize = 3;

/// Relative change of the variables below which no further round follows.
///
/// Unit: 1. Source: chosen. Test: `no_round_follows_one_that_hardly_moved`.
pub(crate) const NEAREST_SETTLED: f64 = 1e-3;

/// Square share of a parameter in directions that are not determined, from which on it keeps its given value exactly if
/// the logs are met as well with it.
///
/// Unit: 1. Source: chosen. Test: `what_is_determined_beside_what_is_not_keeps_its_interval`.
pub(crate) const NEAREST_ALL: f64 = 0.99;

/// Maximum Jacobians of a round towards the nearest point.
///
/// Unit: Jacobians. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const NEAREST_ITERATIONS: usize = 40;

/// The same for the single try after a search by differences whose residuals are far above the noise: what the model
/// does not explain is no reason to choose among its values.
///
/// Unit: Jacobians. Source: chosen: bounds the time. Test:
/// `a_reversed_encoder_of_a_stepper_is_named_within_its_budget`.
pub(crate) const NEAREST_FAR: usize = 6;

/// Stribeck velocities that are tried, relative to the greatest speed of the body.
///
/// Unit: 1. Source: steps of 3. Test: `a_law_that_was_not_asked_for_widens_intervals_and_is_named`.
pub(crate) const STRIBECK_SHARES: [f64; 4] = [0.02, 0.06, 0.18, 0.5];

/// First amplitude of another law, relative to Coulomb friction.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const LAW_FIRST: f64 = 0.2;

/// Least amplitude of another law, relative to Coulomb friction.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const LAW_LEAST: f64 = 0.01;

/// Greatest amplitude of another law, relative to Coulomb friction.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const LAW_MOST: f64 = 3.0;

/// Amplitude from which on another law is reported.
///
/// Unit: standard errors of the amplitude. Source: chosen: 0.3 % of normal deviates. Test:
/// `the_right_law_is_not_suspected`.
pub(crate) const LAW_SHOWN: f64 = 3.0;

/// Share of what the column of another law promises that a run with it must bear out.
///
/// Unit: 1. Source: chosen. Test: `the_right_model_lacks_nothing`.
pub(crate) const LAW_KEEPS: f64 = 0.25;

/// Steps to another law that are run: friction that falls by half makes a cart slip where it stuck, and the whole step
/// misses.
///
/// Unit: 1, of the amplitude. Source: chosen. Test: `a_law_that_was_not_asked_for_widens_intervals_and_is_named`.
pub(crate) const LAW_SHARES: [f64; 3] = [1.0, 0.75, 0.5];

/// Change of the outputs that another law must make, as a share of their range.
///
/// Unit: 1. Source: below are the last digits of logs and solvers. Test: `last_digits_of_a_log_speak_for_no_law`.
pub(crate) const LAW_DUST: f64 = 1e-6;

/// Segments of a log along which friction drifts.
///
/// Unit: segments. Source: chosen. Test: `friction_that_drifts_in_segments_moves_a_cart_as_one_that_drifts_with_time`.
pub(crate) const DRIFT_PARTS: usize = 10;

/// Rounds in which the column of another law is taken again at the amplitude that it led to.
///
/// Unit: rounds. Source: chosen. Test: `the_amplitude_of_a_law_is_found_though_its_effect_bends`.
pub(crate) const LAW_ROUNDS: usize = 3;

/// Gain that a kink may promise and not keep before it is reported.
///
/// Unit: standard errors. Source: chosen. Test: `a_search_that_stalls_far_from_a_minimum_is_a_warning`.
pub(crate) const KINK_PROMISE: f64 = 2.0;

/// Explained share of an output below which a model explains nothing.
///
/// Unit: %. Source: chosen. Test: `a_log_of_which_less_than_half_is_explained_is_a_warning`.
pub(crate) const POOR_FIT: f64 = 50.0;

/// Ratio of K_t and K_e of one motor that is reported; in SI units they are the same number.
///
/// Unit: 1. Source: chosen. Test: `bounds_and_motors_that_cannot_be_are_said`.
pub(crate) const MOTOR_CONSTANTS: f64 = 1.5;

/// Correlation of model and log below which the log is taken to have the opposite sign.
///
/// Unit: 1. Source: chosen. Test: `signs_and_ratios_are_found_beside_narrow_band_noise`.
pub(crate) const OPPOSITE: f64 = -0.5;

/// Longest delay of an input that is searched for.
///
/// Unit: samples. Source: chosen; below `INPUT_BEFORE_WINDOW`. Test: `limits_are_in_order`.
pub(crate) const LONGEST_DELAY: isize = 40;

/// Shortest delay of an input that is tested.
///
/// Unit: samples. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const SHORTEST_DELAY: isize = 2;

/// Longest shift of an input against the outputs that is searched for.
///
/// Unit: samples. Source: chosen. Test: `an_input_that_is_logged_early_or_late_is_found`.
pub(crate) const LONGEST_SHIFT: isize = 500;

/// Longest shift of an input that is searched for, relative to the log.
///
/// Unit: 1. Source: chosen: three quarters of the log are left to compare. Test:
/// `an_input_that_is_off_by_a_fifth_of_the_log_is_found`.
pub(crate) const SHIFT_SHARE: f64 = 0.25;

/// Distance of the shifts that are tried first.
///
/// Unit: samples. Source: chosen: shorter than an input holds its values. Test: `limits_are_in_order`.
pub(crate) const SHIFT_STRIDE: isize = 5;

/// Least unexplained torque for the search for a shift.
///
/// Unit: 1. Source: chosen: an input with more than a delay leaves more. Test: `limits_are_in_order`.
pub(crate) const SHIFT_UNEXPLAINED: f64 = 0.25;

/// Unexplained torque with a shift, relative to that without, below which the shift is tested.
///
/// Unit: 1. Source: chosen. Test: `an_input_that_is_logged_early_or_late_is_found`.
pub(crate) const SUSPECT_SHIFT: f64 = 0.5;

/// Unexplained torque with a delay, relative to that without, below which the delay is tested.
///
/// Unit: 1. Source: chosen. Test: `a_delay_is_found_beside_narrow_band_noise`.
pub(crate) const SUSPECT_DELAY: f64 = 0.95;

/// Numbers of windows that the longest log is cut into where the whole is not explained.
///
/// Unit: windows. Source: steps of 4. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const UNEXPLAINED_WINDOWS: [f64; 3] = [4.0, 16.0, 64.0];

/// Explained share of the windows, beyond a straight line in each, from which on errors add up along the log.
///
/// Unit: 1. Source: chosen. Test: `errors_that_add_up_along_a_log_are_told_from_those_within_windows`.
pub(crate) const WINDOWS_EXPLAIN: f64 = 0.8;

/// Entries of the Jacobian up to which windows are tried.
///
/// Unit: values. Source: chosen: 160 MB. Test: `limits_of_memory_are_what_they_say`.
pub(crate) const WINDOWS_MOST: usize = 20_000_000;

/// Residuals relative to the noise of the logs up to which no part of a log is looked for that the machine does not
/// follow.
///
/// Unit: 1. Source: chosen. Test: `a_part_in_which_the_motor_is_off_is_found`.
pub(crate) const UNEXPLAINED_NOISE: f64 = 3.0;

/// Windows that the longest log is cut into to find a part in which the machine does not follow its input.
///
/// Unit: windows. Source: chosen: a part of a few hundredths of a log fills one. Test:
/// `a_long_log_has_24_windows_and_a_short_one_windows_of_100_samples`.
pub(crate) const INTERRUPTED_WINDOWS: f64 = 24.0;

/// Residuals of a window relative to the usual ones from which on it is such a part.
///
/// Unit: 1. Source: chosen. Test: `a_part_in_which_the_motor_is_off_is_found`.
pub(crate) const INTERRUPTED: f64 = 6.0;

/// Residuals of all other windows relative to the usual ones: with more, windows differ in general.
///
/// Unit: 1. Source: chosen: half of [`INTERRUPTED`]. Test: `limits_are_in_order`.
pub(crate) const UNINTERRUPTED: f64 = 3.0;

/// Share of the windows that such a part may have.
///
/// Unit: 1. Source: chosen. Test: `a_part_that_is_off_is_an_interruption_up_to_a_quarter_of_the_log`.
pub(crate) const INTERRUPTED_SHARE: f64 = 0.25;

/// Least size of usual residuals, relative to the noise of the logs.
///
/// Unit: 1. Source: chosen: noise by third differences is not known better. Test: `limits_are_in_order`.
pub(crate) const LEAST_INTERRUPTED: f64 = 1.5;

/// Factors that are tried on a column where the model explains little: powers of ten, those of wrong pulleys, counts
/// and pairs, and the units of angles and lengths, degrees and inches.
///
/// Unit: 1. Source: chosen; SI. Test: `a_factor_on_a_column_is_named`.
pub(crate) const FACTORS: [f64; 14] =
    [0.1, 0.01, 0.001, 10.0, 100.0, 1000.0, 0.5, 2.0, 1.0 / 3.0, 3.0, 0.25, 4.0, std::f64::consts::PI / 180.0, 0.0254];

/// Cost with a factor, relative to that without, below which factors are alike; above within √e of each other.
///
/// Unit: 1. Source: chosen: what belts and pulleys of the case leave. Test: `a_factor_that_others_imitate_is_named`.
pub(crate) const FACTOR_ALIKE: f64 = 0.01;

/// Ratio of a free value to that of the case, or the other way round, up to which a factor is named.
///
/// Unit: 1. Source: chosen: a case is nearer to its machine. Test: `a_factor_that_others_imitate_is_named`.
pub(crate) const FACTOR_MOVES: f64 = 3.0;

/// Cost with a factor on a column, relative to that without, below which the factor explains it.
///
/// Unit: 1. Source: chosen. Test: `a_factor_on_a_column_is_named`.
pub(crate) const FACTOR_LEAVES: f64 = 0.1;

/// Maximum Jacobians of the fits that rank factors.
///
/// Unit: Jacobians. Source: chosen: a right factor shows within a few steps. Test: `a_factor_on_a_column_is_named`.
pub(crate) const FACTOR_STEPS: usize = 4;

/// Factors that take these steps where derivatives are differences, the best of all by a simulation of each.
///
/// Unit: factors. Source: chosen: bounds the time. Test:
/// `a_factor_on_the_output_of_a_stepper_is_named_within_its_budget`.
pub(crate) const FACTORS_SIMULATED: usize = 4;

/// Factors that are fitted whole, the best of those that were ranked.
///
/// Unit: factors. Source: chosen. Test: `a_factor_on_a_column_is_named`.
pub(crate) const FACTORS_FITTED: usize = 3;

/// Share of the logged input that the controller of a case must explain.
///
/// Unit: %. Source: chosen. Test: `a_loop_is_closed_again`.
pub(crate) const REPRODUCED: f64 = 90.0;

/// Cost of a quantity with a log corrected, relative to that as it is, below which the correction is borne out.
///
/// Unit: 1. Source: chosen. Test: `signs_and_ratios_are_found_beside_narrow_band_noise`.
pub(crate) const MENDED: f64 = 0.5;

/// The cost of all values may then be, relative to that of the log as it is: of two columns that contradict each other,
/// a fit may have left one alone.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const NO_WORSE: f64 = 1.05;

/// A unit counts as wrong unless the cost grows by this factor with the log corrected: free parameters may make up for
/// a factor.
///
/// Unit: 1. Source: chosen. Test: `a_cart_on_a_soft_belt_is_not_taken_for_a_wrong_sign_or_unit`.
pub(crate) const UNIT_WORSE: f64 = 2.0;

/// Mean square residual of samples that are said to be wrong, relative to that of the others where these do not count.
///
/// Unit: 1. Source: three standard deviations, squared. Test: `limits_of_normal_deviates_are_theirs`.
pub(crate) const STAND_OUT: f64 = 9.0;

/// Share of a jump of a measured position that the motion of the fitted model has to leave for it to be one.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const JUMP: f64 = 0.5;

/// Maximum Jacobians of the fit to a corrected log.
///
/// Unit: Jacobians. Source: chosen. Test: `a_fit_to_a_corrected_log_comes_to_its_end`.
pub(crate) const TRIAL_FIT_ITERATIONS: usize = 15;

/// Deviations from the estimate at which a profile holds its parameter; outwards, so that each fit starts where the
/// previous one ended.
///
/// Unit: standard errors. Source: chosen. Test: `the_profile_of_what_is_well_known_is_that_of_a_linear_model`.
pub(crate) const PROFILE_AT: [[f64; 3]; 2] = [[-1.0, -2.0, -3.0], [1.0, 2.0, 3.0]];

/// Maximum number of parameters that are profiled.
///
/// Unit: parameters. Source: chosen. Test: `profiles_are_as_many_as_their_simulations_allow_and_twelve_at_most`.
pub(crate) const MOST_PROFILED: usize = 12;

/// Simulated logs that profiles may take, relative to those of the fit.
///
/// Unit: 1. Source: chosen. Test: `profiles_are_as_many_as_their_simulations_allow_and_twelve_at_most`.
pub(crate) const PROFILE_WORK: u64 = 4;

/// Simulated logs that profiles may take in any case.
///
/// Unit: simulations. Source: chosen. Test: `profiles_are_as_many_as_their_simulations_allow_and_twelve_at_most`.
pub(crate) const PROFILE_SIMULATIONS: u64 = 1000;

/// Relative deviation of the cost two standard errors off from that of a linear model, above which it is reported.
///
/// Unit: 1. Source: chosen. Test: `the_profile_of_what_is_well_known_is_that_of_a_linear_model`.
pub(crate) const CROOKED: f64 = 0.25;

/// Noise permitted in a residual force, relative to its root mean square.
///
/// Unit: 1. Source: chosen. Test: `a_force_that_is_missing_is_seen`.
pub(crate) const RESIDUAL_FORCE_NOISE: f64 = 0.3;

/// Speed below which the cart counts as at rest, relative to its greatest; friction is not determined there.
///
/// Unit: 1. Source: chosen. Test: `a_force_that_is_missing_is_seen`.
pub(crate) const CART_AT_REST: f64 = 0.02;

/// Least number of rows to which the start of a held-out log is fitted.
///
/// Unit: samples. Source: chosen. Test: `the_start_of_a_log_that_is_held_out_is_fitted`.
pub(crate) const HELD_OUT_ROWS: usize = 20;

// posterior: the posterior and its sampler

/// R̂ above which a chain does not count as converged.
///
/// Unit: 1. Source: A. Vehtari and others 2021. Test: `a_posterior_is_doubted_from_one_per_cent_on`.
pub const R_HAT: f64 = 1.01;

/// Effective draws below which a posterior does not count as converged.
///
/// Unit: draws. Source: A. Vehtari and others 2021: 100 for each of four chains. Test:
/// `limits_of_memory_are_what_they_say`.
pub const EFFECTIVE: f64 = 400.0;

/// Share of divergent transitions that is not reported.
///
/// Unit: 1. Source: chosen. Test: `a_posterior_is_doubted_from_one_per_cent_on`.
pub(crate) const DIVERGING: f64 = 0.01;

/// Distance from which on a bound does not cut off what is integrated over.
///
/// Unit: standard deviations. Source: a share of 1e-9 of a normal distribution is beyond. Test:
/// `what_stays_has_the_density_of_quadrature`.
pub(crate) const FAR_BOUND: f64 = 6.0;

/// Value below which the tail of a normal distribution is replaced by that of an exponential one.
///
/// Unit: standard deviations. Source: relative error 1/30². Test: `shares_far_out_have_their_logarithms`.
pub(crate) const FAR_TAIL: f64 = -30.0;

/// Distance from which on a bound of a sampled variable is not felt.
///
/// Unit: standard errors. Source: chosen; only the change of variables depends on it. Test:
/// `a_bound_cuts_the_posterior_off`.
pub(crate) const FELT: f64 = 1e3;

/// Error of the slopes from the fit's Jacobian, relative to that of a standard error, above which they are not used.
///
/// Unit: 1. Source: chosen. Test: `slopes_that_are_off_by_half_are_not_used`.
pub(crate) const SLOPES_OFF: f64 = 0.3;

/// Maximum number of variables for which derivatives of the Jacobian are measured.
///
/// Unit: variables. Source: cost. Test: `paths_of_few_variables_are_bent_as_the_model_is`.
pub(crate) const MOST_BENT: usize = 16;

/// Places at which the slopes are compared.
///
/// Unit: points. Source: chosen. Test: `slopes_are_compared_for_the_price_of_six_jacobians`.
pub(crate) const SLOPE_PLACES: usize = 6;

/// Maximum number of chains; each is a thread.
///
/// Unit: chains. Source: chosen. Test: `an_effort_that_cannot_be_is_refused`.
pub(crate) const MOST_CHAINS: usize = 100;

/// Maximum number of draws of all chains together; they stay in memory.
///
/// Unit: draws. Source: 80 MB for each variable. Test: `an_effort_that_cannot_be_is_refused`.
pub(crate) const MOST_DRAWS: usize = 10_000_000;

/// Error of the energy from which on a path has diverged.
///
/// Unit: 1. Source: M. D. Hoffman, A. Gelman 2014, Δ_max. Test: `a_funnel_shows_divergent_transitions`.
pub(crate) const LARGEST_ERROR: f64 = 1000.0;

/// Maximum doublings of a path, which then has 2 to this many steps.
///
/// Unit: doublings. Source: Stan's default. Test: `a_path_that_does_not_turn_ends_after_a_thousand_steps`.
pub(crate) const MOST_DOUBLINGS: usize = 10;

/// δ: acceptance at which the step size aims.
///
/// Unit: 1. Source: Stan's default. Test: `steps_find_the_acceptance_that_is_wanted`.
pub(crate) const ACCEPTANCE: f64 = 0.8;

/// Steps of a random walk for a draw, for each variable.
///
/// Unit: steps. Source: chosen. Test: `draws_of_a_walk_are_nearly_independent`.
pub(crate) const WALK_STEPS: usize = 3;

/// Length of a step of a random walk, times √n.
///
/// Unit: standard deviations. Source: A. Gelman, G. O. Roberts, W. R. Gilks 1996. Test:
/// `limits_of_memory_are_what_they_say`.
pub(crate) const WALK_LENGTH: f64 = 2.38;

/// Best acceptance of a random walk in many variables.
///
/// Unit: 1. Source: G. O. Roberts, A. Gelman, W. R. Gilks 1997. Test: `a_density_of_kinks_has_its_moments`.
pub(crate) const WALK_TAKEN: f64 = 0.234;

/// Added to it in one variable: 0.44 together.
///
/// Unit: 1. Source: A. Gelman, G. O. Roberts, W. R. Gilks 1996. Test: `limits_of_memory_are_what_they_say`.
pub(crate) const WALK_TAKEN_OF_ONE: f64 = 0.206;

// compare: laws and windows

/// Number of logs from which on whole logs are held out; fewer are cut into blocks.
///
/// Unit: logs. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FEWEST_LOGS: usize = 4;

/// Maximum number of parts that are held out in turn.
///
/// Unit: parts. Source: usual (L. Breiman, P. Spector 1992). Test: `limits_are_in_order`.
pub(crate) const FOLDS: usize = 5;

/// Blocks into which a log is cut where there are few.
///
/// Unit: blocks. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const LOG_BLOCKS: usize = 4;

/// Least length of such a block: errors add up along it as along a log.
///
/// Unit: samples. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const BLOCK_SAMPLES: usize = 60;

/// Relative excess over the least sum of squares up to which a change explains a drift as well.
///
/// Unit: 1. Source: chosen. Test: `a_known_change_between_campaigns_is_named`.
pub(crate) const CHANGE_ALIKE: f64 = 0.02;

/// Share of a held-out log to which its start is fitted; the rest is predicted.
///
/// Unit: 1. Source: chosen. Test: `the_start_of_a_block_is_fitted_to_its_first_tenth`.
pub(crate) const START_SHARE: f64 = 0.1;

/// Maximum Jacobians of the fit of a law to all logs.
///
/// Unit: Jacobians. Source: chosen. Test: `curved_laws_come_to_an_end`.
pub(crate) const STEPS: usize = 20;

/// Maximum Jacobians of the fit of a law to a part of the logs.
///
/// Unit: Jacobians. Source: chosen. Test: `curved_laws_come_to_an_end`.
pub(crate) const STEPS_IN_PART: usize = 10;

/// Points of a friction or force along the travel.
///
/// Unit: points. Source: chosen. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const TRAVEL_POINTS: usize = 7;

/// Speeds of the points of a force by speed, relative to the greatest.
///
/// Unit: 1. Source: chosen: closer near rest. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const SPEED_POINTS: [f64; 7] = [-1.0, -0.5, -0.125, 0.0, 0.125, 0.5, 1.0];

/// Excess of static over Coulomb friction at which the search for a Stribeck curve begins.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const STRIBECK_ABOVE: f64 = 0.2;

/// Greatest breakaway friction, relative to the Coulomb friction at which a search begins: where a log never rests, a
/// greater one meets it as well and holds the next log for ever.
///
/// Unit: 1. Source: chosen. Test: `a_breakaway_stays_near_coulomb_friction`.
pub(crate) const MOST_BREAKAWAY: f64 = 4.0;

/// Stribeck velocity at which a search begins, relative to the greatest speed.
///
/// Unit: 1. Source: chosen. Test: `a_stribeck_curve_begins_far_below_the_greatest_speed`.
pub(crate) const STRIBECK_FALL: f64 = 0.05;

/// Deflection of bristles at which a search begins.
///
/// Unit: m of the cart. Source: chosen. Test: `bristles_begin_as_stiff_at_the_pulley_as_at_the_cart`.
pub(crate) const BRISTLE_BEND: f64 = 2e-5;

// design: the best experiment

/// Default length of an experiment.
///
/// Unit: s. Source: chosen. Test: `an_experiment_of_a_machine_alone_has_4001_samples`.
pub const DURATION: f64 = 4.0;

/// Smallest relative error that a designed experiment promises: no model is better than this.
///
/// Unit: relative. Source: chosen. Test: `no_promise_is_better_than_the_model`.
pub const DESIGN_MODEL_ERROR: f64 = 0.01;

/// Machines on which a designed experiment is verified unless another number is given.
///
/// Unit: machines. Source: time. Test: `an_honest_promise_is_seldom_broken_by_the_machines_that_verify_it`.
pub const VERIFIED: usize = 4;

/// Default sample interval of an experiment.
///
/// Unit: s. Source: chosen. Test: `an_experiment_of_a_machine_alone_has_4001_samples`.
pub(crate) const SAMPLE_INTERVAL: f64 = 1e-3;

/// Maximum rows of an experiment.
///
/// Unit: samples. Source: memory. Test: `what_cannot_be_designed_is_told`.
pub(crate) const MOST_ROWS: f64 = 200_000.0;

/// Points of each kind of input that are tried first.
///
/// Unit: points. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FIRST_POINTS: usize = 16;

/// Kinds of input that are evaluated on doubtful machines in the end.
///
/// Unit: kinds. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FINALISTS: usize = 3;

/// Generations without a gain after which the evolution of an input ends.
///
/// Unit: generations. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const DESIGN_BARREN: usize = 6;

/// Mean relative error of a kind after its first points, relative to the best, up to which it is searched.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const HOPEFUL: f64 = 1.6;

/// First step size of the evolution of an input.
///
/// Unit: logit of a share. Source: chosen. Test: `an_evolution_of_inputs_begins_around_the_best_of_the_first_points`.
pub(crate) const FIRST_SIGMA: f64 = 0.7;

/// Largest number of evaluations by the evolution strategy, for each kind, and again for the best.
///
/// Unit: evaluations. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const MOST_VALUES: usize = 60;

/// Highest frequency of an input, relative to the sample rate.
///
/// Unit: 1. Source: chosen: ten samples a period. Test: `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const OF_RATE: f64 = 0.1;

/// Highest frequency of an input, in periods of the experiment.
///
/// Unit: periods. Source: chosen. Test: `the_highest_frequency_is_one_that_a_log_shows`.
pub(crate) const MOST_PERIODS: f64 = 400.0;

/// Maximum number of experiments of the case with which a design is compared.
///
/// Unit: experiments. Source: chosen. Test: `a_design_is_compared_with_the_first_eight_experiments`.
pub(crate) const MOST_COMPARED: usize = 8;

/// Share of an experiment at its end in which the input is zero: how the axis comes to rest is observed, too.
///
/// Unit: 1. Source: chosen. Test: `every_input_lasts_nearly_to_the_end_and_leaves_time_to_come_to_rest`.
pub(crate) const REST_AT_END: f64 = 0.08;

/// Maximum number of trapezoids there and back.
///
/// Unit: cycles. Source: chosen. Test: `an_input_consists_of_a_limited_number_of_parts`.
pub(crate) const MOST_CYCLES: f64 = 8.0;

/// Maximum number of sines of a stepped sweep.
///
/// Unit: sines. Source: chosen. Test: `an_input_consists_of_a_limited_number_of_parts`.
pub(crate) const SWEEP_SINES: f64 = 8.0;

/// Maximum number of sines of a multisine.
///
/// Unit: sines. Source: chosen. Test: `an_input_consists_of_a_limited_number_of_parts`.
pub(crate) const MULTISINE_TONES: f64 = 20.0;

/// Maximum bits of a binary sequence.
///
/// Unit: bits. Source: chosen. Test: `an_input_consists_of_a_limited_number_of_parts`.
pub(crate) const MOST_BITS: f64 = 400.0;

/// Reductions of an amplitude until an input keeps the limits.
///
/// Unit: reductions. Source: chosen. Test: `what_is_written_is_what_was_judged_and_keeps_its_limits`.
pub(crate) const SMALLER: usize = 8;

/// Deviation of the starts of verifying fits from the truth, to either side.
///
/// Unit: 1. Source: chosen. Test: `promises_hold_on_simulated_logs`.
pub(crate) const START_OFF: f64 = 0.1;

/// Error of the fits of simulated logs from which on the promise of a designed experiment is broken.
///
/// Unit: the promised standard error. Source: chosen. Test: `a_promise_that_fits_do_not_keep_is_reported`.
pub(crate) const PROMISE_BROKEN: f64 = 2.0;

/// Damped Gauss-Newton steps that rank the elements a model may lack.
///
/// Unit: steps. Source: chosen: the price of a few runs. Test: `a_missing_spring_is_named`.
pub(crate) const CAUSE_STEPS: usize = 4;

/// Starts that are fitted whole: the best of each element, then others.
///
/// Unit: starts. Source: chosen: all elements and three more. Test: `play_is_named_where_first_steps_suggest_a_spring`.
pub(crate) const CAUSES_FITTED: usize = 16;

/// Starts of one element that are fitted whole.
///
/// Unit: starts. Source: chosen: the nearest does not always lead to the least. Test: `limits_are_in_order`.
pub(crate) const STARTS_FITTED: usize = 3;

/// Starts of elements of a machine of several coordinates that take steps, in the order of their predicted costs.
///
/// Unit: starts. Source: chosen: bounds the time. Test: `a_missing_element_of_a_gantry_is_named`.
pub(crate) const CAUSES_STEPPED: usize = 16;

/// Predicted cost of an element, relative to that of one that leaves noise, up to which it is fitted, too.
///
/// Unit: 1. Source: chosen: predictions of elements as large as those of drives are off by some ten per cent. Test:
/// `a_wrong_number_of_one_drive_is_named`.
pub(crate) const CAUSE_RIVAL: f64 = 2.0;

/// Share of the squared residuals that an element must explain.
///
/// Unit: 1. Source: chosen. Test: `the_right_model_lacks_nothing`.
pub(crate) const CAUSE_EXPLAINS: f64 = 0.02;

/// Size that an element must have.
///
/// Unit: standard errors of its size. Source: chosen. Test: `the_right_model_lacks_nothing`.
pub(crate) const CAUSE_ERRORS: f64 = 4.0;

/// Share of the squared residuals from which on an element that the model lacks is a warning, known or not.
///
/// Unit: 1. Source: chosen: 0.8 of the residuals are left. Test: `what_a_gantry_lacks_is_a_warning`.
pub(crate) const CAUSE_WARNS: f64 = 0.36;

/// Share of the squared residuals from which on an element explains parts of a log that stand out.
///
/// Unit: 1. Source: chosen. Test: `a_limit_is_named`.
pub(crate) const CAUSE_SETTLES: f64 = 0.9;

/// Most values of logs for which elements are tried.
///
/// Unit: values. Source: chosen: bounds the time. Test: `limits_of_memory_are_what_they_say`.
pub(crate) const CAUSE_MOST_VALUES: usize = 100_000;

/// Most values of logs for which bristles are tried, whose runs have no exact derivatives.
///
/// Unit: values. Source: chosen: bounds the time. Test: `limits_of_memory_are_what_they_say`.
pub(crate) const CAUSE_MOST_CURVED: usize = 20_000;

/// Most steps of one simulation of all logs with an element whose runs have no exact derivatives.
///
/// Unit: steps, of some 10 µs. Source: chosen: bounds the time. Test:
/// `bristles_are_not_tried_on_logs_that_take_too_many_steps`.
pub(crate) const CAUSE_MOST_STEPS: u64 = 20_000;

/// Median logarithmic gain of held-out parts from which on one part in which a start fails does not refute an element.
///
/// Unit: the logarithmic gain of the whole logs. Source: chosen. Test:
/// `play_is_named_where_first_steps_suggest_a_spring`.
pub(crate) const HELD_OUT_SHOWS: f64 = 0.5;

/// Step of the variables over which estimates with an element are differentiated.
///
/// Unit: 1. Source: the third root of rounding. Test: `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const CAUSE_DIFFERENCE: f64 = 1e-5;

/// Frequencies of a spring between motor and cart that are tried.
///
/// Unit: Hz. Source: steps of 2. Test: `a_missing_spring_is_named`.
pub(crate) const CAUSE_SPRINGS: [f64; 5] = [5.0, 10.0, 20.0, 40.0, 80.0];

/// Damping ratio with which a spring begins.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const SPRING_DAMPING: f64 = 0.05;

/// Sizes of play that are tried.
///
/// Unit: standard deviations of the residuals. Source: steps of 2: other starts end in other minima. Test:
/// `what_is_tried_covers_what_lies_between`.
pub(crate) const CAUSE_GAPS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// Lengths by which bristles bend that are tried.
///
/// Unit: standard deviations of the residuals. Source: steps of 4; what is bent adds up over a log. Test:
/// `bristles_are_named_with_their_stiffness`.
pub(crate) const CAUSE_BENDS: [f64; 3] = [0.06, 0.25, 1.0];

/// Frequency and damping ratio of the flanks of play.
///
/// Unit: Hz. Source: chosen: far above what a log shows. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const FLANK_FREQUENCY: f64 = 150.0;

/// Damping ratio of the flanks of play.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FLANK_DAMPING: f64 = 0.5;

/// Widths of the play of a sensor that are tried.
///
/// Unit: standard deviations of the residuals. Source: chosen: a fit without play leaves a third to half of the width.
/// Test: `play_of_a_sensor_is_named_with_its_width`.
pub(crate) const CAUSE_WIDTHS: [f64; 3] = [1.5, 3.0, 6.0];

/// Standard deviation of the share of the play of a sensor that lies ahead where a log begins.
///
/// Unit: 1. Source: uniform distribution, 1/√12. Test: `play_of_a_sensor_is_named_with_its_width`.
pub(crate) const SENSOR_START: f64 = 0.2887;

/// Delays that are tried.
///
/// Unit: intervals between samples. Source: chosen: one of either sign. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const CAUSE_DELAYS: [f64; 2] = [0.5, -0.5];

/// Delays from which elements of gantries begin in windows, where either leads to either sign.
///
/// Unit: as there. Source: chosen. Test: `a_delay_of_the_inputs_of_a_gantry_is_named`.
pub(crate) const WINDOW_DELAYS: [f64; 2] = [0.5, 2.0];

/// Limits of the amplifier that are tried.
///
/// Unit: the greatest voltage or current that the logs ask for. Source: chosen. Test: `a_limit_is_named`.
pub(crate) const CAUSE_LIMITS: [f64; 5] = [0.4, 0.52, 0.64, 0.76, 0.88];

/// Lower bound of such a limit.
///
/// Unit: as there. Source: chosen: an amplifier that gives less is another cause. Test:
/// `what_is_tried_covers_what_lies_between`.
pub(crate) const CAUSE_LEAST_LIMIT: f64 = 0.1;

/// Inputs of a drive that tell a limit from a factor: above this share of the greatest, and below the next.
///
/// Unit: the greatest input. Source: chosen. Test: `a_missing_element_of_a_gantry_is_named`.
pub(crate) const LEVEL_LEAST: f64 = 0.05;

/// The upper end of these.
///
/// Unit: as there. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const LEVEL_MOST: f64 = 0.9;

/// Breakaway with which a missing one begins.
///
/// Unit: Coulomb friction. Source: chosen. Test: `a_missing_element_of_a_gantry_is_named`.
pub(crate) const BREAKAWAY_FIRST: f64 = 1.3;

/// Lower bound of a breakaway; below Coulomb friction it has no effect.
///
/// Unit: Coulomb friction. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const LEAST_BREAKAWAY: f64 = 0.5;

/// Electrical time constants that are tried.
///
/// Unit: s. Source: from a small to a large motor. Test: `an_inductance_is_named`.
pub(crate) const CAUSE_LAGS: [f64; 2] = [1e-3, 1e-2];

/// Most logs for which values of their own are tried.
///
/// Unit: logs. Source: chosen: bounds the time. Test: `a_log_of_another_machine_is_named`.
pub(crate) const APART_MOST: usize = 8;

/// Share of the inertia with which a part before a spring or play begins.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const CAUSE_SHARE: f64 = 0.35;

/// Least share of the inertia for which the case is taken to contain the rotor.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const KNOWN_SHARE: f64 = 0.05;

/// Change of an estimate with an element from which on it is reported.
///
/// Unit: relative to the estimate. Source: chosen. Test: `an_estimate_that_a_cause_moves_by_two_per_cent_is_told`.
pub(crate) const CAUSE_MOVES: f64 = 0.01;

/// Longest time for which residuals that swing keep their sign.
///
/// Unit: share of a log. Source: chosen. Test: `noise_that_swings_is_known_as_such`.
pub(crate) const SWINGS_KEEP: f64 = 0.1;

/// Cost with an element after its first steps, relative to that without, up to which it is fitted whole.
///
/// Unit: 1. Source: chosen: what is further off does not get there. Test: `limits_are_in_order`.
pub(crate) const CAUSE_NEAR: f64 = 3.0;

/// Most that a fit with an element may gain, in whole steps of the linear model: beyond its first steps, or, with
/// curved friction, beyond the fit without it.
///
/// Unit: 1. Source: chosen: of some 300 starts on 27 machines of `cargo xtask coverage --causes` none that ended lowest
/// gained more. Test: `bristles_are_named_with_their_stiffness`.
pub(crate) const CAUSE_REACH: f64 = 2.0;

/// Decrease of the cost in [`CAUSE_SLOW_STEPS`] below which a fit of play that explains nothing yet is given up.
///
/// Unit: relative to the cost. Source: chosen. Test: `a_search_that_gains_half_a_per_cent_in_four_steps_creeps`.
pub(crate) const CAUSE_SLOW: f64 = 0.01;

/// Steps in which a fit has to progress.
///
/// Unit: steps. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const CAUSE_SLOW_STEPS: usize = 4;

/// Factors on a number of a drive between which it is searched.
///
/// Unit: 1. Source: chosen. Test: `a_wrong_number_of_one_drive_is_named`.
pub(crate) const DRIVE_FACTORS: [f64; 2] = [0.2, 5.0];

/// Difference of the likelihoods of two parameters up to which the logs do not tell which of them differs.
///
/// Unit: standard errors. Source: chosen. Test: `elements_are_alike_up_to_three_standard_errors`.
pub(crate) const CAUSE_ALIKE: f64 = 3.0;

/// Yaw stiffnesses that are tried, at the belts.
///
/// Unit: the stiffness of the stiffest span. Source: chosen. Test: `a_bridge_that_yaws_is_named`.
pub(crate) const YAW_STIFFNESS: [f64; 2] = [1.0, 8.0];

/// Distance of the belts of a bridge whose yaw is tried. Its yaw stiffness at the belts does not depend on it.
///
/// Unit: m. Source: that of the example in the table of parameters. Test: `limits_are_in_order`.
pub(crate) const YAW_SPACING: f64 = 0.5;

/// Distance of the bearings of such a bridge.
///
/// Unit: m. Source: as above. Test: `limits_are_in_order`.
pub(crate) const YAW_BEARINGS: f64 = 0.06;

/// Bounds of the size of an element, relative to its start.
///
/// Unit: 1. Source: chosen: starts are 2 to 4 times apart. Test: `what_is_tried_covers_what_lies_between`.
pub(crate) const CAUSE_AROUND: [f64; 2] = [0.1, 10.0];

/// Bounds of the share of the inertia before a spring or play.
///
/// Unit: 1. Source: chosen: less is not visible, and takes long to simulate. Test: `limits_are_in_order`.
pub(crate) const KNOWN_SHARES: [f64; 2] = [0.05, 0.95];

/// First size of a force on the cart that is tried.
///
/// Unit: the motor's force at the greatest input. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const FORCE_FIRST: f64 = 0.01;

/// Points of a drag over the speed.
///
/// Unit: points. Source: straight lines are then within 0.3 % of the greatest drag. Test:
/// `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const DRAG_POINTS: usize = 21;

/// Points of friction that falls with speed, on either side of zero.
///
/// Unit: Stribeck velocities. Source: 0.2 % of the fall is left at the last. Test:
/// `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const STRIBECK_POINTS: [f64; 9] = [0.2, 0.4, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5];

/// Greatest size of a force on the cart that has one sign, relative to its first.
///
/// Unit: 1. Source: chosen: a hundred times the motor's greatest force. Test: `limits_are_in_order`.
pub(crate) const FORCE_MOST: f64 = 1e4;

/// Step to which an estimate is rounded in a file.
///
/// Unit: standard errors of the estimate with all others held. Source: 2.2503 kg ± 0.0022 kg has two digits of its
/// error. Test: `a_file_has_the_digits_that_are_known_and_the_units_that_were_there`.
pub(crate) const DIGITS_KNOWN: f64 = 0.1;

/// Rounding of numbers that go through text.
///
/// Unit: relative. Source: sums and units of 64-bit numbers; a wrong form of a parameter is further off. Test:
/// `limits_are_in_order`.
pub(crate) const DIGITS_READ: f64 = 1e-9;

// map: the force along the travel

/// Chance that logs without a force along the travel show one.
///
/// Unit: 1, for a whole map. Source: chosen, below the 5 % that a user accepts. Test:
/// `noise_makes_no_map`.
pub(crate) const MAP_FALSE_ALARM: f64 = 0.01;

/// Wave numbers that are tried per reciprocal of the mapped travel.
///
/// Unit: 1. Source: chosen: between two of them a peak loses 5 % of its power. Test:
/// `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const MAP_RASTER: f64 = 4.0;

/// Steps of the golden section that finds the top of a peak.
///
/// Unit: steps. Source: 1e-3 of the raster is left. Test: `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const MAP_SECTIONS: usize = 15;

/// Rounds in which wave numbers are refined one after the other.
///
/// Unit: rounds. Source: chosen. Test: `sines_close_together_are_refined_to_their_own_wave_numbers`.
pub(crate) const MAP_ROUNDS: usize = 3;

/// Neighbours on either side, at distances of the reciprocal of the mapped travel, from which the noise at a wave
/// number is estimated, too.
///
/// Unit: 1. Source: chosen: ten degrees of freedom from two passes. Test:
/// `limits_of_rasters_are_those_of_their_errors`.
pub(crate) const MAP_NEIGHBOURS: i32 = 2;

/// Most periodic components.
///
/// Unit: 1. Source: chosen. Test: `of_many_sines_the_eight_largest_are_named`.
pub(crate) const MAP_WAVES: usize = 8;

/// Least periods within the mapped travel of what is called periodic.
///
/// Unit: periods. Source: chosen: each half of the travel has to show one. Test: `limits_are_in_order`.
pub(crate) const MAP_PERIODS: f64 = 2.0;

/// Least amplitude of a sine of a map.
///
/// Unit: standard errors beside the other sines. Source: chosen. Test: `sines_that_cancel_are_not_named`.
pub(crate) const MAP_ERRORS: f64 = 4.0;

/// Most by which the error of a sine's amplitude grows beside the other sines of a map.
///
/// Unit: the error by itself. Source: chosen: beyond it two sines nearly cancel. Test:
/// `sines_that_cancel_are_not_named`.
pub(crate) const MAP_INFLATION: f64 = 3.0;

/// Least amplitude of a periodic component in each half of the travel, relative to that in all of it.
///
/// Unit: 1. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const MAP_HALF: f64 = 0.4;

/// Difference of wave numbers up to which a period matches one of the machine, where the noise makes it no larger.
///
/// Unit: reciprocals of the mapped travel. Source: chosen: a pulley's radius is known to a per cent. Test:
/// `a_period_is_that_of_a_pulley_to_a_twentieth_of_a_period_per_travel`.
pub(crate) const MAP_MATCH: f64 = 0.05;

/// Deviation of the Gaussian that smooths a log, along the travel.
///
/// Unit: distances of the points. Source: chosen: it then resolves what the points do. Test:
/// `a_log_is_smoothed_over_less_than_the_distance_of_points`.
pub(crate) const MAP_SMOOTHING: f64 = 0.25;

/// Loss of amplitude at the shortest period that a map resolves.
///
/// Unit: 1. Source: chosen. Test: `the_shortest_period_loses_a_tenth_of_its_amplitude`.
pub(crate) const MAP_LOSS: f64 = 0.1;

/// Speed at which a pass begins and ends.
///
/// Unit: median speed of the pass. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const MAP_SPEED: f64 = 0.5;

/// Least length of a pass.
///
/// Unit: that of the longest. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const MAP_LENGTH: f64 = 0.8;

/// Least rows of a pass for each point.
///
/// Unit: rows. Source: chosen. Test: `a_point_has_four_rows_and_a_quarter_of_a_degree_of_freedom`.
pub(crate) const MAP_ROWS: usize = 4;

/// Least points of a map.
///
/// Unit: points. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const MAP_POINTS: usize = 16;

/// Degrees of freedom of the residuals of a pass, relative to its points: neighbours share noise.
///
/// Unit: 1. Source: chosen. Test: `a_point_has_four_rows_and_a_quarter_of_a_degree_of_freedom`.
pub(crate) const MAP_FREEDOM: f64 = 0.25;

/// Points on either side whose scatter is that of a point.
///
/// Unit: points. Source: chosen. Test: `limits_are_in_order`.
pub(crate) const MAP_LOCAL: usize = 5;

#[cfg(test)]
mod tests;
