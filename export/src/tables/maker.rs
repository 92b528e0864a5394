//! Rows of weights: which elements a form depends on, and the form for each combination of what these do.

use super::{Does, Element, ElementKind, MOST_ROWS, Row, TableGuard, Then};
use crate::error::{Error, Result};
use crate::mechanism::{After, Cause, Form, Layout, Mechanism, Mode, State, StateQuantity, Transition};

/// How many modes are looked at to see what a row depends on.
const LOOKS: u64 = 48;

/// Makes rows.
pub(super) struct Maker<'m> {
    pub mechanism: &'m Mechanism,
    pub layout: &'m Layout,
    pub elements: &'m [Element],
}

impl Maker<'_> {
    /// The mode in which the elements do this; all else is as at rest.
    fn mode(&self, does: &[usize]) -> Mode {
        let mut mode = self.mechanism.first_mode(&State::default());
        for (element, &does) in self.elements.iter().zip(does) {
            match (element.kind, element.states[does]) {
                (ElementKind::Body(body), Does::Moves(motion)) => {
                    for follower in self.mechanism.followers(body) {
                        mode.motion[follower] = motion;
                    }
                }
                (ElementKind::GearTorque(drive), Does::Torque(positive)) => {
                    mode.drive[drive].torque_positive = positive;
                }
                (ElementKind::Voltage(drive), Does::Limits(limit)) => mode.drive[drive].voltage = limit,
                (ElementKind::Current(drive), Does::Limits(limit)) => mode.drive[drive].current = limit,
                (ElementKind::Span(spring), Does::Slack(slack)) => mode.slack[spring] = slack,
                (ElementKind::Gap(spring), Does::Touches(contact)) => mode.contact[spring] = contact,
                (ElementKind::Line(spring), Does::Follows(piece)) => mode.piece[spring] = piece,
                (kind, does) => unreachable!("{kind:?} cannot do {does:?}"),
            }
        }
        mode
    }

    /// The rate of a state.
    pub fn rate(&self, place: usize, mode: &Mode) -> Form {
        let layout = self.layout;
        let bodies = 0..layout.bodies();
        if let Some(body) = bodies.clone().find(|&body| layout.coordinate[body] == place) {
            return layout.rate(self.mechanism, body);
        }
        let equations = self.mechanism.equations(*mode);
        if let Some(body) = bodies.clone().find(|&body| layout.speed[body] == place) {
            return equations.acceleration[body];
        }
        let drive = layout.current.iter().position(|current| *current == Some(place));
        drive.map_or(Form::ZERO, |drive| equations.current_rate[drive])
    }

    /// A form as weights on z.
    fn weights(&self, form: &Form) -> Vec<f64> {
        let layout = self.layout;
        let mut row = vec![0.0; layout.states + layout.inputs + 1];
        layout.put(form, &mut row);
        for drive in 0..layout.inputs {
            row[layout.states + drive] = form.input[drive];
        }
        row[layout.states + layout.inputs] = form.constant;
        row
    }

    /// A random choice of what all elements do.
    fn choose(&self, number: &mut u64) -> Vec<usize> {
        let mut next = || {
            *number = number.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (*number >> 33) as usize
        };
        self.elements.iter().map(|element| next() % element.states.len()).collect()
    }

    /// The table of a form that depends on the mode.
    pub fn row(&self, form: &dyn Fn(&Mode) -> Form) -> Result<Row> {
        self.row_with(None, form)
    }

    /// A row with an element in a given case.
    fn row_with(&self, fixed: Option<(usize, usize)>, form: &dyn Fn(&Mode) -> Form) -> Result<Row> {
        let at = |does: &[usize]| form(&self.mode(does));
        let mut depends: Vec<usize> = Vec::new();
        let mut number = 1;
        for _ in 0..LOOKS {
            let mut does = self.choose(&mut number);
            if let Some((element, state)) = fixed {
                does[element] = state;
            }
            let here = at(&does);
            for (index, element) in self.elements.iter().enumerate() {
                if depends.contains(&index) || fixed.is_some_and(|(fixed, _)| fixed == index) {
                    continue;
                }
                let own = does[index];
                let differs = |state: usize| {
                    let mut other = does.clone();
                    other[index] = state;
                    at(&other) != here
                };
                if (0..element.states.len()).filter(|&state| state != own).any(differs) {
                    depends.push(index);
                }
            }
        }
        depends.sort_unstable();
        let count: usize = depends.iter().map(|&e| self.elements[e].states.len()).product();
        if count > MOST_ROWS {
            return Err(Error::new(format!("one of the equations of this machine has {count} forms"))
                .allowed(format!("up to {MOST_ROWS}"))
                .next("leave out optional parts: limits, slack spans, end stops"));
        }
        let mut forms = Vec::with_capacity(count);
        for index in 0..count {
            let mut does = vec![0; self.elements.len()];
            if let Some((element, state)) = fixed {
                does[element] = state;
            }
            let mut rest = index;
            for &element in depends.iter().rev() {
                let states = self.elements[element].states.len();
                (does[element], rest) = (rest % states, rest / states);
            }
            forms.push(at(&does));
        }
        let weights = forms.iter().map(|form| self.weights(form)).collect();
        Ok(Row { depends, weights, forms })
    }

    /// All conditions, and how many tolerances they have.
    pub fn guards(&self) -> Result<(Vec<TableGuard>, usize)> {
        let mut guards: Vec<(TableGuard, Transition)> = Vec::new();
        for (index, element) in self.elements.iter().enumerate() {
            for state in 0..element.states.len() {
                let mut does = vec![0; self.elements.len()];
                does[index] = state;
                let is_own = |transition: &Transition| element.kind.owns(transition.cause);
                for (k, transition) in self.transitions(&does, is_own).into_iter().enumerate() {
                    let row = self.row_with(Some((index, state)), &|mode| self.forms(mode, is_own)[k])?;
                    let then = element.then(transition.then);
                    guards.push((self.guard(Some((index, state)), then, &transition, row), transition));
                }
            }
        }
        let leaves = |transition: &Transition| matches!(transition.cause, Cause::Leave(_));
        for (k, transition) in self.transitions(&vec![0; self.elements.len()], leaves).into_iter().enumerate() {
            let row = self.row(&|mode| self.forms(mode, leaves)[k])?;
            guards.push((self.guard(None, Then::Leave, &transition, row), transition));
        }
        // A travel without an end on one side has no condition there.
        guards.retain(|(guard, _)| guard.row.weights.iter().flatten().all(|weight| weight.is_finite()));
        // Kinds that there are, counted.
        let mut kinds: Vec<usize> = guards.iter().map(|(_, transition)| transition.cause.kind()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let note = |cause: Cause| kinds.iter().position(|kind| *kind == cause.kind());
        let causes: Vec<Cause> = guards.iter().map(|(_, transition)| transition.cause).collect();
        let number = |cause: Cause| causes.iter().position(|own| *own == cause);
        for (guard, transition) in &mut guards {
            guard.fresh = note(transition.cause).unwrap_or(0);
            guard.slot = (!matches!(transition.cause, Cause::Stop(_))).then_some(guard.fresh);
            if let After::PartHolds { gently: Some(cause) } = transition.after {
                guard.gently = note(cause);
            }
            let body = match transition.cause {
                Cause::Stop(body) | Cause::BreakForward(body) | Cause::BreakBackward(body) => Some(body),
                Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => None,
            };
            let both = body.map(|body| [Cause::BreakForward(body), Cause::BreakBackward(body)].map(number));
            if let Some([Some(forward), Some(backward)]) = both {
                guard.breakaways = Some([forward, backward]);
            }
        }
        Ok((guards.into_iter().map(|(guard, _)| guard).collect(), kinds.len()))
    }

    /// The consequences of these conditions of a mode.
    fn transitions(&self, does: &[usize], is_one: impl Fn(&Transition) -> bool) -> Vec<Transition> {
        let all = self.mechanism.equations(self.mode(does)).guards.into_iter().map(|guard| guard.transition);
        all.filter(|transition| is_one(transition)).collect()
    }

    /// Their values.
    fn forms(&self, mode: &Mode, is_one: impl Fn(&Transition) -> bool) -> Vec<Form> {
        let all = self.mechanism.equations(*mode).guards.into_iter();
        all.filter(|guard| is_one(&guard.transition)).map(|guard| guard.form).collect()
    }

    /// A condition as far as it is known by itself.
    fn guard(&self, of: Option<(usize, usize)>, then: Then, transition: &Transition, row: Row) -> TableGuard {
        let place = |(place, value): (StateQuantity, f64)| {
            let place = match place {
                StateQuantity::Speed(body) => Some(self.layout.speed[body]),
                StateQuantity::Current(drive) => self.layout.current[drive],
            };
            place.map(|place| (place, value))
        };
        let drop = match transition.cause {
            Cause::BreakForward(body) => self.drop(body, true),
            Cause::BreakBackward(body) => self.drop(body, false),
            Cause::Stop(_) | Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => 0.0,
        };
        let resets = transition.resets.each(self.mechanism).filter_map(place).collect();
        let (rank, slot, fresh) = (transition.rank, None, 0);
        TableGuard { of, then, rank, slot, fresh, resets, breakaways: None, drop, gently: None, row }
    }

    /// By how much the breakaway of a body exceeds its Coulomb friction.
    fn drop(&self, body: usize, forward: bool) -> f64 {
        let side = self.mechanism.friction(body).side(forward);
        side.breakaway - side.coulomb
    }

    /// A bound of ‖A‖ over all modes: stiffness by its Frobenius norm, then all that damps by its trace, each the most
    /// of its row.
    pub fn fastest(&self, rates: &[Row]) -> f64 {
        let (mechanism, layout) = (self.mechanism, self.layout);
        let most = |place: usize, of: &dyn Fn(&Form) -> f64| rates[place].forms.iter().map(of).fold(0.0, f64::max);
        let (mut swing, mut damp) = (0.0, 0.0);
        for body in 0..layout.bodies() {
            let stiff = |form: &Form| -> f64 {
                let arms = |(stretch, spring): (&f64, &crate::mechanism::Spring)| -> f64 {
                    let own = spring.arms.iter().filter(|(other, _)| *other == body);
                    own.map(|(_, arm)| (stretch * arm).abs()).sum()
                };
                form.stretch.iter().zip(&mechanism.springs).map(arms).sum()
            };
            swing += most(layout.speed[body], &stiff);
            damp += most(layout.speed[body], &|form| form.speed[body].abs());
        }
        for (drive, place) in layout.current.iter().enumerate() {
            let Some(place) = *place else { continue };
            let shaft = mechanism.drives[drive].shaft;
            damp += most(place, &|form| form.current[drive].abs());
            let back = most(place, &|form| form.speed[shaft].abs());
            let push = most(layout.speed[shaft], &|form| form.current[drive].abs());
            damp += (back * push).sqrt();
        }
        swing.sqrt() + damp
    }
}
