//! The kinds of machines, each a constant of geometry.

use super::geometry::Geometry;
use super::{axis, dual_belt, gantry};

/// The kinds of machines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MachineKind {
    /// One drive, one cart, one belt.
    Axis,
    /// A cart on a bridge, one belt round both drive pulleys.
    HFrame,
    /// A cart on a bridge, two belts, one for each drive pulley.
    CoreXy,
    /// A cart on a bridge, a belt on either side of the bridge and one along it, each with a motor.
    DualBelt,
}

impl MachineKind {
    /// All of them.
    pub const ALL: [MachineKind; 4] =
        [MachineKind::Axis, MachineKind::HFrame, MachineKind::CoreXy, MachineKind::DualBelt];

    /// Its geometry.
    pub const fn geometry(self) -> &'static Geometry {
        match self {
            MachineKind::Axis => &axis::AXIS,
            MachineKind::HFrame => &gantry::H_FRAME,
            MachineKind::CoreXy => &gantry::CORE_XY,
            MachineKind::DualBelt => &dual_belt::DUAL_BELT,
        }
    }

    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        self.geometry().word
    }

    /// Name in messages.
    pub fn name(self) -> &'static str {
        self.geometry().name
    }
}

#[cfg(test)]
mod tests {
    use super::super::geometry::{BodyAt, Part, SpanAt};
    use super::*;
    use crate::mechanism::BODIES;

    /// The arms of a span for these positions of the bodies.
    fn length(span: &SpanAt, r: f64, at: &[f64; BODIES]) -> f64 {
        span.arms.iter().map(|(body, arm)| arm.factor(r) * at[*body]).sum()
    }

    #[test]
    fn constants_of_a_geometry_follow_from_its_arms() {
        let r = 0.02;
        for kind in MachineKind::ALL {
            let geometry = kind.geometry();
            let turns = |body: usize| matches!(geometry.bodies[body].part, Part::DrivePulley | Part::IdlerPulley);
            // Without strain no span is stretched, and positions by the drives are exact.
            for (number, slide) in geometry.slides.iter().enumerate() {
                let mut at = [0.0; BODIES];
                for (body, place) in geometry.bodies.iter().enumerate() {
                    at[body] = match turns(body) {
                        true => body_at(place, number) / r,
                        false => f64::from(u8::from(body == slide.body)),
                    };
                }
                for span in geometry.spans {
                    assert!(length(span, r, &at).abs() < 1e-12, "{} {}", geometry.word, span.label.key);
                }
            }
            // Any position: errors and elongations follow from the arms.
            let at: [f64; BODIES] = std::array::from_fn(|body| {
                if body < geometry.bodies.len() { (1.0 + body as f64).sqrt() - 0.3 * body as f64 } else { 0.0 }
            });
            let stretch = |span: usize| length(&geometry.spans[span], r, &at);
            for slide in geometry.slides {
                let drives = geometry.drives.iter().zip(slide.by_drives);
                let by_drives: f64 = drives.map(|(drive, weight)| r * weight * at[drive.pulley]).sum();
                let error: f64 = slide.error.iter().map(|(span, weight)| weight * stretch(*span)).sum();
                assert!((by_drives - at[slide.body] - error).abs() < 1e-12, "{}", geometry.word);
            }
            for (number, span) in geometry.spans.iter().enumerate() {
                let told: f64 = span.by_others.iter().map(|(span, weight)| weight * stretch(*span)).sum();
                assert!((told - stretch(number)).abs() < 1e-12, "{} {}", geometry.word, span.label.key);
            }
        }
    }

    fn body_at(body: &BodyAt, slide: usize) -> f64 {
        body.by_slides.get(slide).copied().unwrap_or_default()
    }
}
