//! Control laws, one for each structure of a design.

use super::fuzzy::FuzzyLaw;
use super::law::{Law, LawInputs};
use super::pid::{CascadeLaw, PidLaw};
use super::sliding::SlidingLaw;
use super::state_feedback::StateFeedbackLaw;
use crate::calculator::{Calculator, Slots};
use crate::design::{Design, OpenLoop, Structure};
use crate::error::Result;
use crate::machine::Machine;
use crate::machine::rigid::Rigid;

/// One of the laws.
#[derive(Debug, Clone)]
pub enum AnyLaw {
    Pid(PidLaw),
    Cascade(CascadeLaw),
    StateFeedback(Box<StateFeedbackLaw>),
    SlidingMode(SlidingLaw),
    Fuzzy(FuzzyLaw),
    OpenLoop(OpenLoop),
}

/// Expands an expression for each law.
macro_rules! each_law {
    ($self:expr, $law:ident => $done:expr) => {
        match $self {
            AnyLaw::Pid($law) => $done,
            AnyLaw::Cascade($law) => $done,
            AnyLaw::StateFeedback($law) => $done,
            AnyLaw::SlidingMode($law) => $done,
            AnyLaw::Fuzzy($law) => $done,
            AnyLaw::OpenLoop($law) => $done,
        }
    };
}

impl AnyLaw {
    /// Control law of a design for a model of the axis.
    pub fn new(slots: &mut Slots, design: &Design, model: &Machine) -> Result<Self> {
        let every = design.every;
        Ok(match &design.structure {
            Structure::Pid(gains) => Self::Pid(PidLaw::new(slots, gains, every)),
            Structure::Cascade(gains) => Self::Cascade(CascadeLaw::new(slots, gains, every)),
            Structure::StateFeedback(weights) => {
                Self::StateFeedback(Box::new(StateFeedbackLaw::new(slots, weights, model, design)?))
            }
            Structure::SlidingMode(gains) => {
                Self::SlidingMode(SlidingLaw::new(slots, gains, &Rigid::new(model), every))
            }
            Structure::Fuzzy(rules) => Self::Fuzzy(FuzzyLaw::new(slots, rules, every)),
            Structure::OpenLoop(open) => Self::OpenLoop(*open),
        })
    }
}

impl Law for AnyLaw {
    fn about(&self) -> &'static str {
        each_law!(self, law => law.about())
    }

    fn commands_current(&self) -> bool {
        each_law!(self, law => law.commands_current())
    }

    fn is_linear(&self) -> bool {
        each_law!(self, law => law.is_linear())
    }

    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N {
        each_law!(self, law => law.step(c, seen))
    }

    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, effective: C::N) {
        each_law!(self, law => law.limited(c, excess, effective))
    }
}

impl Law for OpenLoop {
    fn about(&self) -> &'static str {
        "the reference is the command, without a correction"
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn step<C: Calculator>(&self, c: &mut C, _: &LawInputs<C::N>) -> C::N {
        c.number(0.0)
    }

    fn limited<C: Calculator>(&self, _: &mut C, _: C::N, _: C::N) {}
}
