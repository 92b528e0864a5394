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

/// Keys of the slides whose references the controllers of a machine take; none for an axis, which has one.
pub(super) fn slides(model: &Machine) -> Vec<&'static str> {
    let geometry = model.geometry();
    match geometry.slides {
        [_] => Vec::new(),
        slides => slides.iter().map(|slide| geometry.label(slide.body).key).collect(),
    }
}

/// The name of a derivative of a reference among the inputs: `now` at the sample, `ahead` when the command acts.
pub(super) fn input(of: &str, slide: &str, derivative: &str) -> String {
    [of, slide, derivative].into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_")
}

/// The program of a drive by a design for a model of the machine, for numbers of up to `largest`. Errors: what no
/// controller can be.
pub(super) fn program(design: &Design, model: &Machine, drive: usize, largest: f64) -> Result<Program> {
    // Designs that `taut move` refuses are refused here.
    let text = Text::of_drive(design, model, drive)?;
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
    let keys = slides(model);
    let mut reference = |of: &str, slide: &str, about: &str| {
        let [position, speed, acceleration, jerk, snap] =
            DERIVATIVES.map(|(derivative, unit)| c.input(input(of, slide, derivative), format!("{about}, {unit}")));
        Reference { position, speed, acceleration, jerk, snap }
    };
    let [now, ahead] = match keys[..] {
        [] => [("now", "the cart should be at this sample"), ("ahead", "it should be when the command acts")]
            .map(|(of, about)| vec![reference(of, "", &format!("where {about}"))]),
        _ => [("now", "at this sample"), ("ahead", "when the command acts")].map(|(of, when)| {
            keys.iter().map(|slide| reference(of, slide, &format!("where the {slide} should be {when}"))).collect()
        }),
    };
    let position = c.input("measured".into(), "measured position along the belt, m".into());
    let current = c.input("current".into(), "measured motor current, A".into());
    let mut seen = match keys[..] {
        [] => Observation { time: 0.0, reference: now[0], ahead: ahead[0], position, scale: None, current },
        _ => {
            c.remark("the part of the belt at this drive");
            let shares = model.belt_shares()[drive];
            let [reference, later] = [&now, &ahead].map(|slides| Reference::weighed(c, shares.iter().copied(), slides));
            Observation { time: 0.0, reference, ahead: later, position, scale: None, current }
        }
    };
    // As `control::stepped` does.
    let [outside, inner] = text.forward(c, &ahead);
    seen.reference = text.target(c, seen.reference, &now);
    let mut asked = text.step_with(c, &seen, inner);
    if let Some(outside) = outside {
        asked = asked + outside;
    }
    c.remark("a command that is not finite is taken as zero; then the limit");
    let zero = c.number(0.0);
    let low = c.choose(more(asked, largest), zero, asked);
    let finite = c.choose(at_least(asked, -largest), low, zero);
    let mut given = c.name("finite", finite);
    if let Some(limit) = design.limit {
        given = c.within(given, -limit, limit);
    }
    text.limited(c, outside.map_or(given, |outside| given - outside));
    writer.finish(given, "given").map_err(|value| {
        Error::new(format!("a constant of this controller is {value}, not a finite number"))
            .next("give the belt a stiffness that is finite, or take a simpler feed-forward")
    })
}
