//! Yaw of the bridge of a gantry on its bearings (racking).
//!
//! Motors and belts see the yaw stiffness k_ψ and the moment of inertia by the arm a of the belts only, as k_ψ/a² and
//! I/a². The bridge begins as a uniform beam between the belts, I = m (2a)²/12. Where the spans of a belt are alike, as
//! those of a CoreXY about the middle of its travel, their pulls do not turn the bridge, and encoders at the motors do
//! not show its yaw.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::fit::limits::{CAUSE_AROUND, YAW_BEARINGS, YAW_SPACING, YAW_STIFFNESS};
use crate::machine::{Machine, Yaw};

const KEY: &str = "bridge.yaw.bearing_stiffness";

/// Bearings of several stiffnesses, relative to that of the belts.
pub(super) fn bearings(site: &Site) -> Vec<Extended> {
    let machine = site.begins();
    let Some(bridge) = machine.bridge.as_ref().filter(|_| machine.yaw.is_none()) else { return Vec::new() };
    let belts = machine.belt.stiffness[..machine.geometry().spans.len()].iter().copied().fold(0.0, f64::max);
    let arm = 0.5 * YAW_SPACING;
    // k_ψ = k_b s²/2
    let stiffness = |times: &f64| 2.0 * times * belts * arm * arm / (YAW_BEARINGS * YAW_BEARINGS);
    let with = |bearing_stiffness: f64| {
        let mut machine = machine.clone();
        machine.yaw = Some(Yaw {
            inertia: bridge.mass * YAW_SPACING * YAW_SPACING / 12.0,
            belt_spacing: YAW_SPACING,
            bearing_spacing: YAW_BEARINGS,
            bearing_stiffness,
            bearing_damping: 0.0,
        });
        let mut plan = site.plan.clone();
        plan.free.push(KEY.into());
        plan.bounds.push((KEY.into(), CAUSE_AROUND.map(|factor| factor * bearing_stiffness)));
        Extended::new(site.with(machine), plan, Telling::Parameter(KEY.into()))
    };
    // In windows one start leads to either.
    let tried = if site.is_anew { &YAW_STIFFNESS[..1] } else { &YAW_STIFFNESS[..] };
    tried.iter().map(stiffness).map(with).collect()
}

pub(super) fn words(_: &Site, _: &Extended, found: &Fitted) -> Said {
    let yaw = found.machine.yaw.map_or(0.0, |yaw| yaw.stiffness());
    let [spacing, bearings] = [YAW_SPACING, YAW_BEARINGS].map(|length| shown(length, "m"));
    let words = format!(
        "a bridge that yaws on its bearings (racking), with {} if its belts are {spacing} apart",
        shown(yaw, "N m/rad")
    );
    let stiffness = shown(found.value, "N/m");
    let add = format!(
        "add [bridge.yaw] with the measured inertia and belt_spacing (here {spacing}), bearing_spacing = \
         \"{bearings}\" and bearing_stiffness = \"{stiffness}\", and {KEY} to `free`"
    );
    Said { words, add }
}

/// The machine whose bridge does not yaw.
pub(super) fn without(_: &Site, mut machine: Machine) -> Machine {
    machine.yaw = None;
    machine
}
