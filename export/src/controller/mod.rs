//! The controller of a design as a program: its text, written down.

use super::program::{Program, Tape, Writer};
use crate::calculator::{Calculator, at_least, more};
use crate::control::{Observation, Text, reads_scale};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::signal::profile::Reference;

/// Most numbers that a program may keep.
const MOST_SLOTS: usize = 200;

/// The derivatives of a reference, as names end.
pub(super) const DERIVATIVES: [(&str, &str); 5] =
    [("position", "m"), ("speed", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3"), ("snap", "m/s^4")];

/// The program of a design for a model of the axis. Errors: what no controller can be.
pub(super) fn program(design: &Design, model: &Machine) -> Result<Program> {
    // Designs that `taut move` refuses are refused here.
    let text = Text::new(design, model)?;
    if reads_scale(design, model) {
        return Err(Error::new("this controller reads the scale beside the encoder, which programs have no input for")
            .next("export it without [scale], or take the FMU, which has both sensors"));
    }
    if text.slots.count() > MOST_SLOTS {
        return Err(Error::new(format!("this controller keeps {} numbers from sample to sample", text.slots.count()))
            .allowed(format!("up to {MOST_SLOTS}"))
            .next("take a longer sample time, or a shorter delay"));
    }
    let tape = Tape::default();
    let mut writer = Writer::new(&tape, &text.slots);
    let c = &mut writer;
    let mut reference = |name: &str, about: &str| {
        let [position, speed, acceleration, jerk, snap] =
            DERIVATIVES.map(|(derivative, unit)| c.input(format!("{name}_{derivative}"), format!("{about}, {unit}")));
        Reference { position, speed, acceleration, jerk, snap }
    };
    let now = reference("now", "where the cart should be at this sample");
    let ahead = reference("ahead", "where it should be when the command acts");
    let position = c.input("measured".into(), "measured position along the belt, m".into());
    let current = c.input("current".into(), "measured motor current, A".into());
    let seen = Observation { time: 0.0, reference: now, ahead, position, scale: None, current };
    let asked = text.step(c, &seen);
    c.remark("a command that is not a number is taken as zero; then the limit");
    let (zero, most) = (c.number(0.0), f64::from(f32::MAX));
    let low = c.choose(more(asked, most), zero, asked);
    let finite = c.choose(at_least(asked, -most), low, zero);
    let mut given = c.name("finite", finite);
    if let Some(limit) = design.limit {
        given = c.within(given, -limit, limit);
    }
    text.limited(c, given);
    writer.finish(given, "given").map_err(|value| {
        Error::new(format!("a constant of this controller is {value}, not a finite number"))
            .next("give the belt a stiffness that is finite, or take a simpler feed-forward")
    })
}
