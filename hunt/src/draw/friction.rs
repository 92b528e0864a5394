//! Friction of a random body: its values, and the law between rest and fast sliding.

use super::{Draw, Feature, Sizes, StageKind};
use std::fmt::Write;

impl Draw {
    /// Gives each law of the recipe to a body. What never sticks stays away from a gear with losses.
    pub(super) fn share_curves(&mut self) {
        let laws: Vec<Feature> = self.features.iter().flatten().copied().filter(|one| one.is_law()).collect();
        let loses = self.wants(Feature::Losses);
        for law in laws {
            let never_sticks = matches!(law, Feature::Smooth | Feature::LuGre);
            let first = if never_sticks && loses { 1 } else { 0 };
            let start = self.random.below(3);
            let places = (0..3).map(|k| (start + k) % 3);
            if let Some(place) = places.into_iter().find(|&k| k >= first && self.curves[k].is_none()) {
                self.curves[place] = Some(law);
            }
        }
    }

    /// The words of a law, with a body whose values forward are viscous, Coulomb and at rest.
    fn curve(
        &mut self,
        sizes: &Sizes,
        (mass, arm): (f64, f64),
        law: Option<Feature>,
        [_, coulomb, at_rest]: [f64; 3],
    ) -> String {
        let speed = sizes.way / sizes.time;
        let above = (at_rest - coulomb).max(0.0).max(0.1 * coulomb);
        let above = self.digits(above);
        let velocity = {
            let value = speed * self.random.decades(0.05, 3.0) / arm;
            self.digits(value)
        };
        match law {
            Some(Feature::Stribeck) => format!(", stribeck = {{ force = {above:e}, velocity = {velocity:e} }}"),
            Some(Feature::Exponential) => {
                format!(", stribeck = {{ force = {above:e}, velocity = {velocity:e}, shape = \"exponential\" }}")
            }
            Some(Feature::Smooth) => {
                // The slope at rest: 10 F_c/v_b.
                self.faster(10.0 * coulomb / velocity / (arm * arm * mass) / 30.0);
                format!(", smooth = {{ breakaway_velocity = {velocity:e} }}")
            }
            Some(Feature::LuGre) => {
                // Bristles that bend within about 0.001 to 0.1 of the travel and settle no faster than the machine.
                let bend = sizes.way * self.random.decades(1e-3, 0.1) / arm;
                let stiffness = (coulomb / bend).min(30.0 * self.fastest * coulomb * arm / speed);
                let stiffness = self.digits(stiffness.min(10.0 * self.fastest * self.fastest * mass * arm * arm));
                let damping = 2.0 * self.random.decades(0.01, 1.0) * (stiffness * mass).sqrt() * arm;
                let damping = self.digits(damping);
                self.faster((stiffness / mass).sqrt() / arm);
                format!(", lugre = {{ stiffness = {stiffness:e}, damping = {damping:e}, velocity = {velocity:e} }}")
            }
            _ => String::new(),
        }
    }

    /// `friction = { … }` of a body that counts as `mass` at the belt; `arm` makes a force a torque.
    /// `curve` is its law, and with `along` it changes along the travel.
    pub(super) fn friction(
        &mut self,
        sizes: &Sizes,
        mass: f64,
        arm: f64,
        curve: Option<Feature>,
        along: bool,
    ) -> String {
        let side = |draw: &mut Self| {
            let slow = mass * draw.random.decades(1e-3, 30.0) / sizes.time;
            let viscous = match draw.random.below(12) {
                0..3 => 0.0,
                3 => mass * draw.fastest * draw.random.decades(0.05, 3.0),
                _ => slow,
            };
            let common = sizes.force * draw.random.decades(1e-3, 3.0);
            let coulomb = match draw.random.below(20) {
                0..4 if curve.is_none() => 0.0,
                4 if !draw.is_by_recipe() => common * draw.random.decades(1e3, 1e6),
                _ => common,
            };
            let over = match draw.random.below(10) {
                0..4 => 1.0,
                4..8 => draw.random.even(1.0, 2.0),
                _ => draw.random.decades(2.0, 10.0),
            };
            // Breakaway alone, too.
            let coulomb_or_less = if draw.random.chance(0.05) && curve.is_none() { 0.0 } else { coulomb };
            [viscous * arm * arm, coulomb_or_less * arm, coulomb * over * arm].map(|value| draw.digits(value))
        };
        let forward = side(self);
        let asymmetric = self.random.chance(0.25);
        let backward = if asymmetric { side(self) } else { forward };
        self.faster(2.0 * forward[0].max(backward[0]) / (arm * arm * mass));
        if forward[2] > forward[1] || backward[2] > backward[1] {
            self.kind(StageKind::Static);
        }
        let [viscous, coulomb, at_rest] = forward;
        let mut text = match curve {
            Some(Feature::Stribeck | Feature::Exponential) => format!("viscous = {viscous:e}, coulomb = {coulomb:e}"),
            _ => format!("viscous = {viscous:e}, coulomb = {coulomb:e}, static = {:e}", at_rest.max(coulomb)),
        };
        if curve.is_some() {
            text += &self.curve(sizes, (mass, arm), curve, forward);
        } else if backward != forward {
            self.kind(StageKind::Asymmetric);
            let [viscous, coulomb, at_rest] = backward;
            let _ = write!(
                text,
                ", viscous_backward = {viscous:e}, coulomb_backward = {coulomb:e}, static_backward = {:e}",
                at_rest.max(coulomb)
            );
        }
        if along {
            let mut x = -sizes.way * self.random.even(0.0, 1.0);
            let mut points = Vec::new();
            for _ in 0..2 + self.random.below(4) {
                points.push(format!("[{:e}, {:e}]", self.digits(x), self.even(0.3, 2.0)));
                x += sizes.way * self.random.even(0.05, 0.7);
            }
            let _ = write!(text, ", along = [{}]", points.join(", "));
        }
        format!("friction = {{ {text} }}\n")
    }
}
