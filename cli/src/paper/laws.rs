//! Figures 3, 16 and 17: curves that need no run, from the equations alone.

use super::belt::{series_over_plain, series_over_plain_stretches};
use super::findings::Findings;
use super::plots::{Curve, Plot};
use super::words::{share, si};
use taut::report::{Axis, Colour, Style};

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
        "Figure 3. Toothed and plain stretches in series",
        Axis::new("Toothed section / plain section", ""),
        "area_ratio",
        &ratio,
    )
    .panel(
        Axis::new("Eq. (12) / eq. (13)", ""),
        1.0,
        vec![
            Curve::new("l in (13): the whole span", "whole_span", &whole, Colour::Blue),
            Curve::new("l in (13): the plain stretches", "plain_stretches", &stretches, Colour::Vermillion),
        ],
    )
    .caption(format!(
        "Teeth on half the length, of the same composite as the belt. The larger their section, the \
             better (13) holds with l the \
             plain stretches, and the worse with l the whole span, which is what the tables use. Teeth of neoprene, \
             which the cords do not enter, add only {} to the stiffness: then the whole span is right.",
        share(f.belt.neoprene_teeth)
    ))
}

/// Eq. (14) and (15).
pub fn laws(f: &Findings) -> [Plot; 2] {
    let side = f.sets.table4.stage.cart.friction.forward;
    let (b, fc) = (side.viscous, side.coulomb);
    // Both sides of zero, and a gap between them.
    let steps = 200;
    let half: Vec<f64> = (0..=steps).map(|i| WIDEST * f64::from(i) / f64::from(steps)).collect();
    let v: Vec<f64> = half.iter().rev().map(|v| -v).chain([0.0]).chain(half.iter().copied()).collect();
    let middle = half.len();
    let sided = |law: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        (0..v.len())
            .map(|i| match i.cmp(&middle) {
                std::cmp::Ordering::Less => law(v[i], -1.0),
                std::cmp::Ordering::Equal => f64::NAN,
                std::cmp::Ordering::Greater => law(v[i], 1.0),
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
