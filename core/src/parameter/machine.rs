//! Access to a machine's numbers by rows of the parameter table.

use super::field::{List, SLIDES};
use super::{Field, Parameter, find, named};
use crate::friction::Friction;
use crate::machine::Machine;

/// Location of a row's number in a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Sits {
    /// Nowhere.
    Elsewhere,
    /// In it, this number of times.
    Machine(List, usize),
    /// In it, as another form of the number with this key.
    Form(&'static str, List, usize),
    /// Used to compute the number with this key; the machine stores the result only.
    PartOf(&'static str),
}

impl Sits {
    /// Naming and number of its elements; none if the machine lacks it.
    pub(super) fn listed(self) -> Option<(List, usize)> {
        match self {
            Self::Machine(list, count) | Self::Form(_, list, count) => Some((list, count)),
            Self::Elsewhere | Self::PartOf(_) => None,
        }
    }

    /// Key of an element for `--set`.
    pub(super) fn key(self, row: &Parameter, index: usize) -> String {
        self.listed().map_or(List::None, |(list, _)| list).key(row.key, index)
    }
}

impl Machine {
    /// Location of the number of a row.
    pub fn sits(&self, row: &Parameter) -> Sits {
        let listed = |accessor: &super::Accessor| accessor.listed(self);
        match &row.field {
            Field::Elsewhere => Sits::Elsewhere,
            Field::Machine(accessor) => {
                listed(accessor).map_or(Sits::Elsewhere, |(list, count)| Sits::Machine(list, count))
            }
            Field::Form(of, accessor) => {
                listed(accessor).map_or(Sits::Elsewhere, |(list, count)| Sits::Form(of, list, count))
            }
            Field::PartOf(whole) => match find(whole).map(|whole| self.sits(whole)) {
                None | Some(Sits::Elsewhere) => Sits::Elsewhere,
                Some(_) => Sits::PartOf(whole),
            },
        }
    }

    /// Value of a row, at an index for a list; none if the machine lacks the part, or computes the value from others.
    pub fn get(&self, row: &Parameter, index: usize) -> Option<f64> {
        let accessor = row.field.accessor()?;
        let (_, count) = accessor.listed(self)?;
        if index < count { (accessor.get)(self, index) } else { None }
    }

    /// Sets it and everything computed from it; does nothing if the machine lacks the part.
    pub fn set(&mut self, row: &Parameter, index: usize, value: f64) {
        if let Some(accessor) = row.field.accessor() {
            (accessor.set)(self, index, value);
        }
    }

    /// Row of a key of its case file, with or without list indices.
    pub fn row(&self, key: &str) -> Option<&'static Parameter> {
        if self.slides().count() == 1 {
            return named(key);
        }
        // The cart of a gantry has the rows of its bridge, and each drive those of an axis's.
        let of_cart = key.strip_prefix(SLIDES[1]).map(|rest| format!("{}{rest}", SLIDES[0]));
        let of_drive = self.geometry().drives.iter().find_map(|drive| key.strip_prefix(drive.key));
        let row = named(of_cart.as_deref().or(of_drive).unwrap_or(key))?;
        let list = self.sits(row).listed().map(|(list, _)| list);
        // A drive contains only keys of its own parts, a cart only those of every slide.
        let belongs = of_drive.is_none() || matches!(list, Some(List::Drives(_)));
        let is_of_slide = matches!(list, Some(List::Slides | List::SlidePoints(_)));
        (belongs && (of_cart.is_none() || is_of_slide)).then_some(row)
    }

    /// The friction of each of its bodies.
    pub fn frictions(&mut self) -> impl Iterator<Item = &mut Friction> {
        let pulleys = [&mut self.drive_pulley, &mut self.idler_pulley].map(|pulley| &mut pulley.friction);
        let slides = self.bridge.iter_mut().chain([&mut self.cart]).map(|slide| &mut slide.friction);
        pulleys.into_iter().chain(slides)
    }
}
