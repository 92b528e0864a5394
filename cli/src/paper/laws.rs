//! Figures 3, 16 and 17, and the friction laws beyond them: curves that need no run, from the equations alone.

use super::belt::{series_over_plain, series_over_plain_stretches};
use super::findings::Findings;
use super::plots::{Curve, Plot};
use super::words::{share, si};
use std::cmp::Ordering;
use std::f64::consts::FRAC_1_SQRT_2;
use taut::friction::{Friction, Law, Shape, velocity_of_decay};
use taut_report::{Axis, Colour, Style};

/// F_s of eq. (14), N: chosen, since the paper gives none.
const STATIC: f64 = 0.1;
/// F_τ of eq. (14), s²/m²: chosen, since the paper gives none.
const DECAY: f64 = 1e5;
/// Half-width of the speeds that are shown, m/s.
const WIDEST: f64 = 0.02;

/// Eq. (12) against (13).
pub fn toothed(f: &Findings) -> Plot {
    let ratio: Vec<f64> = (0..=180).map(|i| 1.0 + 0.05 * f64::from(i)).collect();
    let whole: Vec<f64> = ratio.iter().map(|a| series_over_plain(*a, 0.5)).collect();
    let stretches: Vec<f64> = ratio.iter().map(|a| series_over_plain_stretches(*a, 0.5)).collect();
    Plot::new(
        "figure-03",
        "Figure 3. Toothed and plain segments in series",
        Axis::new("Toothed section / plain section", ""),
        "area_ratio",
        &ratio,
    )
    .panel(
        Axis::new("Eq. (12) / eq. (13)", ""),
        1.0,
        vec![
            Curve::new("l in (13): the whole span", "whole_span", &whole, Colour::Blue),
            Curve::new("l in (13): the plain segments", "plain_stretches", &stretches, Colour::Vermillion),
        ],
    )
    .caption(format!(
        "Teeth on half the length, of the same composite as the belt. The larger their section, the better (13) holds \
         with l the plain segments, and the worse with l the whole span, as the tables have it. Teeth of neoprene, \
             which the cords do not enter, add only {} to the stiffness: then the whole span is right.",
        share(f.belt.neoprene_teeth)
    ))
}

/// Both sides of zero, and between them a place for what holds at rest.
fn speeds(widest: f64, steps: u32) -> (Vec<f64>, usize) {
    let half: Vec<f64> = (0..=steps).map(|i| widest * f64::from(i) / f64::from(steps)).collect();
    (half.iter().rev().map(|v| -v).chain([0.0]).chain(half.iter().copied()).collect(), half.len())
}

/// Eq. (14) and (15).
pub fn laws(f: &Findings) -> [Plot; 2] {
    let side = f.sets.table4.machine.cart.friction.forward;
    let (b, fc) = (side.viscous, side.coulomb);
    let (v, middle) = speeds(WIDEST, 200);
    let sided = |law: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        (0..v.len())
            .map(|i| match i.cmp(&middle) {
                Ordering::Less => law(v[i], -1.0),
                Ordering::Equal => f64::NAN,
                Ordering::Greater => law(v[i], 1.0),
            })
            .collect()
    };
    let viscous = sided(&|v, _| b * v);
    let coulomb = sided(&|_, sign| sign * fc);
    let stribeck = sided(&|v, sign| sign * STATIC * (-DECAY * v * v).exp());
    // F_f = b v + sign(v) F_c + sign(v) F_s exp(−F_τ v²)                        (14)
    let all = sided(&|v, sign| b * v + sign * fc + sign * STATIC * (-DECAY * v * v).exp());
    // F_f = b v + sign(v) F_c                                                   (15)
    let mut reduced = sided(&|v, sign| b * v + sign * fc);
    // At rest: anything between, so that the line is closed.
    reduced[middle] = 0.0;
    let (x, y) = (|| Axis::new("Velocity", "m/s"), || Axis::new("Friction force", "N"));
    [
        Plot::new("figure-16", "Figure 16. Friction law of eq. (14), with Stribeck effect", x(), "velocity_m_s", &v)
            .panel(
                y(),
                1.0,
                vec![
                    Curve::new("viscous", "viscous_N", &viscous, Colour::Sky).style(Style::Dashed),
                    Curve::new("Coulomb", "coulomb_N", &coulomb, Colour::Green).style(Style::Dashed),
                    Curve::new("Stribeck", "stribeck_N", &stribeck, Colour::Amber).style(Style::Dashed),
                    Curve::new("together", "friction_N", &all, Colour::Blue),
                ],
            )
            .caption(format!(
                "The cart's viscous coefficient {} and Coulomb force {} are those of Table 4. The paper \
                 gives neither the static force nor the Stribeck parameter: {} and {} s²/m² are chosen to \
                 show the shape.",
                si(b, "N s/m", 6),
                si(fc, "N", 4),
                si(STATIC, "N", 2),
                taut::number::engineering(DECAY, "", 2)
            )),
        Plot::new("figure-17", "Figure 17. Friction law of eq. (15), viscous and Coulomb", x(), "velocity_m_s", &v)
            .panel(y(), 1.0, vec![Curve::new("cart, Table 4", "friction_N", &reduced, Colour::Blue)])
            .caption(format!(
                "The cart's law as it runs: at rest friction takes whatever value between −{0} and {0} \
                 holds the cart.",
                si(fc, "N", 4)
            )),
    ]
}

/// Every friction law of the case file, as the solvers have it.
pub fn beyond(f: &Findings) -> Plot {
    let side = f.sets.table4.machine.cart.friction.forward;
    let (b, fc, fb) = (side.viscous, side.coulomb, side.coulomb + STATIC);
    let velocity = velocity_of_decay(DECAY);
    let stribeck = |shape| Law::Stribeck { velocity, shape };
    // So that its exponential falls as the Stribeck curve does: √2 v_b = v_s.
    let smooth = Law::Smooth { breakaway_velocity: FRAC_1_SQRT_2 * velocity };
    // Of bristles only g(v) shows while they slide steadily.
    let lugre = Law::LuGre { stiffness: 1e5, damping: 190.0, velocity };
    let laws = [
        ("Coulomb, eq. (15)", "coulomb", Law::Coulomb, Colour::Grey, Style::Solid),
        ("Stribeck, eq. (14)", "stribeck", stribeck(Shape::Gaussian), Colour::Blue, Style::Solid),
        ("Stribeck, exponential", "exponential", stribeck(Shape::Exponential), Colour::Vermillion, Style::Solid),
        ("smooth (Simscape)", "smooth", smooth, Colour::Green, Style::Solid),
        ("LuGre, steady", "lugre", lugre, Colour::Amber, Style::Dashed),
    ];
    let (v, middle) = speeds(0.5 * WIDEST, 800);
    let values = |law: Law, viscous: f64| -> Vec<f64> {
        let friction = Friction::with_breakaway(viscous, fc, fb).following(law);
        let value = |(i, &v): (usize, &f64)| match i.cmp(&middle) {
            Ordering::Less => friction.sliding(v.min(-f64::MIN_POSITIVE)),
            // At rest: anything between, so that the line is closed.
            Ordering::Equal => 0.0,
            Ordering::Greater => friction.sliding(v),
        };
        v.iter().enumerate().map(value).collect()
    };
    let panel = |viscous: f64, suffix: &str| -> Vec<(String, Vec<f64>)> {
        laws.iter().map(|(_, key, law, ..)| (format!("{key}{suffix}_N"), values(*law, viscous))).collect()
    };
    let (whole, dry) = (panel(b, ""), panel(0.0, "_dry"));
    fn curves<'a>(
        values: &'a [(String, Vec<f64>)],
        laws: &[(&str, &str, Law, Colour, Style)],
        named: bool,
    ) -> Vec<Curve<'a>> {
        let curve = |k: usize| {
            let ((heading, values), (name, _, _, colour, style)) = (&values[k], &laws[k]);
            Curve::new(if named { name } else { "" }, heading, values, *colour).style(*style)
        };
        (0..values.len().min(laws.len())).map(curve).collect()
    }
    let x = Axis::new("Velocity", "m/s").shown_as("mm/s", 1e3);
    Plot::new("friction-laws", "The friction laws of a case file", x, "velocity_m_s", &v)
        .panel(Axis::new("Friction force", "N"), 1.0, curves(&whole, &laws, true))
        .panel(Axis::new("Without b v", "N"), 1.0, curves(&dry, &laws, false))
        .caption(format!(
            "One set of parameters in every law: Table 4's {} and {}, and of figure 16 the breakaway {} and the Stribeck \
             velocity {}. Coulomb and Stribeck friction hold at rest, where the line is upright; the smooth law lets a body creep, and \
             bristles bend before they slip, which curves of velocity do not show.",
            si(b, "N s/m", 6),
            si(fc, "N", 4),
            si(fb, "N", 2),
            si(velocity, "m/s", 3)
        ))
}
