//! Conversion of a running machine to plain numbers and back, for [`Simulator::save`](super::Simulator::save).

use super::inputs::Pieces;
use crate::friction::Motion;
use crate::mechanism::{Contact, Limit, Mode, State};

/// Numbers that are read from a machine or written to one; one function of each part does both.
pub(super) enum Pass<'a> {
    /// Out.
    Out(&'a mut Vec<u64>),
    /// In.
    In(std::slice::Iter<'a, u64>),
}

/// `None` if there are too few numbers, or if they belong to another machine.
pub(super) type Passed = Option<()>;

impl Pass<'_> {
    pub(super) fn bits(&mut self, bits: &mut u64) -> Passed {
        match self {
            Pass::Out(list) => list.push(*bits),
            Pass::In(list) => *bits = *list.next()?,
        }
        Some(())
    }

    pub(super) fn number(&mut self, number: &mut f64) -> Passed {
        let mut bits = number.to_bits();
        self.bits(&mut bits)?;
        *number = f64::from_bits(bits);
        Some(())
    }

    pub(super) fn numbers(&mut self, numbers: &mut [f64]) -> Passed {
        numbers.iter_mut().try_for_each(|number| self.number(number))
    }

    /// A number that may be absent.
    pub(super) fn optional(&mut self, number: &mut Option<f64>) -> Passed {
        let mut there = number.is_some();
        self.flag(&mut there)?;
        let mut value = number.unwrap_or(0.0);
        self.number(&mut value)?;
        *number = there.then_some(value);
        Some(())
    }

    pub(super) fn count(&mut self, count: &mut usize) -> Passed {
        let mut bits = *count as u64;
        self.bits(&mut bits)?;
        *count = usize::try_from(bits).ok()?;
        Some(())
    }

    pub(super) fn flag(&mut self, flag: &mut bool) -> Passed {
        let mut bits = u64::from(*flag);
        self.bits(&mut bits)?;
        *flag = one_of([false, true], bits)?;
        Some(())
    }

    /// One of a closed set, by its index.
    fn choice<T: Copy + PartialEq, const N: usize>(&mut self, all: [T; N], value: &mut T) -> Passed {
        let mut bits = all.iter().position(|other| other == value)? as u64;
        self.bits(&mut bits)?;
        *value = one_of(all, bits)?;
        Some(())
    }

    pub(super) fn state(&mut self, state: &mut State) -> Passed {
        self.numbers(&mut state.position)?;
        self.numbers(&mut state.speed)?;
        self.numbers(&mut state.current)
    }

    pub(super) fn mode(&mut self, mode: &mut Mode) -> Passed {
        let limits = [Limit::Low, Limit::Inside, Limit::High];
        let contacts = [Contact::Low, Contact::LowLoose, Contact::Apart, Contact::HighLoose, Contact::High];
        let motions = [Motion::Backward, Motion::Stuck, Motion::Forward, Motion::Free];
        mode.motion.iter_mut().try_for_each(|motion| self.choice(motions, motion))?;
        mode.slack.iter_mut().try_for_each(|slack| self.flag(slack))?;
        mode.contact.iter_mut().try_for_each(|contact| self.choice(contacts, contact))?;
        mode.piece.iter_mut().try_for_each(|piece| {
            let mut count = usize::from(*piece);
            self.count(&mut count)?;
            *piece = u8::try_from(count).ok()?;
            Some(())
        })?;
        mode.drive.iter_mut().try_for_each(|drive| {
            self.flag(&mut drive.torque_positive)?;
            self.choice(limits, &mut drive.voltage)?;
            self.choice(limits, &mut drive.current)?;
            let mut slipped = u64::from(drive.slipped.cast_unsigned());
            self.bits(&mut slipped)?;
            drive.slipped = u32::try_from(slipped).ok()?.cast_signed();
            Some(())
        })
    }

    pub(super) fn pieces(&mut self, pieces: &mut Pieces) -> Passed {
        self.number(&mut pieces.start)?;
        self.number(&mut pieces.end)?;
        pieces.coefficients.iter_mut().try_for_each(|coefficients| self.numbers(coefficients))
    }
}

/// A copy that continues from saved numbers, all of which it must use; `None` if they belong to another machine.
pub(super) fn restored<T: Clone>(own: &T, saved: &[u64], pass: impl FnOnce(&mut T, &mut Pass) -> Passed) -> Option<T> {
    let mut copy = own.clone();
    let mut numbers = Pass::In(saved.iter());
    pass(&mut copy, &mut numbers)?;
    match numbers {
        Pass::In(mut left) => left.next().is_none().then_some(copy),
        Pass::Out(_) => None,
    }
}

fn one_of<T: Copy, const N: usize>(all: [T; N], place: u64) -> Option<T> {
    all.get(usize::try_from(place).ok()?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_passed_out_comes_back() {
        let mut list = Vec::new();
        let mut out = Pass::Out(&mut list);
        out.optional(&mut Some(-0.5)).unwrap();
        out.optional(&mut None).unwrap();
        out.count(&mut 7).unwrap();
        out.flag(&mut true).unwrap();
        let (mut some, mut none, mut count, mut flag) = (None, Some(3.0), 0, false);
        let mut back = Pass::In(list.iter());
        back.optional(&mut some).unwrap();
        back.optional(&mut none).unwrap();
        back.count(&mut count).unwrap();
        back.flag(&mut flag).unwrap();
        assert_eq!((some, none, count, flag), (Some(-0.5), None, 7, true));
        assert!(back.flag(&mut flag).is_none());
        // A flag is 0 or 1.
        assert!(Pass::In([2].iter()).flag(&mut flag).is_none());
    }
}
