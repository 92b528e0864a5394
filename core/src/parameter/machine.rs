//! Machines as the table of parameters sees them: numbers that are read and set by row.

use super::field::{DRIVES, List, SLIDES};
use super::{Field, Parameter, named};
use crate::friction::Friction;
use crate::machine::Machine;
use crate::machine::gantry::Gantry;

/// A machine whose numbers stand in the table: a [`Machine`] or a [`Gantry`].
pub trait Numbers {
    /// Where it has the number of a row.
    fn sits(&self, row: &Parameter) -> Sits;

    /// The value of a row, at a place where that is a list; none where the machine has no such part, or computes it
    /// from others.
    fn get(&self, row: &Parameter, index: usize) -> Option<f64>;

    /// Sets it, and what is computed from it; does nothing where the machine has no such part.
    fn set(&mut self, row: &Parameter, index: usize, value: f64);

    /// The row that a key of its case file names, with or without places in lists.
    fn row(&self, key: &str) -> Option<&'static Parameter>;

    /// The friction of each of its bodies.
    fn frictions(&mut self) -> Vec<&mut Friction>;

    /// It, where it is an axis.
    fn axis(&self) -> Option<&Machine>;
}

/// Where a machine has the number of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sits {
    /// Nowhere.
    Elsewhere,
    /// In it, so many times.
    Machine(List, usize),
    /// In it, as another form of the number with this key.
    Form(&'static str, List, usize),
    /// The number with this key is computed from it and from others, and the machine keeps the result alone.
    PartOf(&'static str),
}

impl Sits {
    fn of<M>(field: &Field<M>, machine: &M) -> Self {
        match field {
            Field::Elsewhere => Self::Elsewhere,
            Field::Machine(accessor) => Self::Machine(accessor.list, (accessor.count)(machine)),
            Field::Form(of, accessor) => Self::Form(of, accessor.list, (accessor.count)(machine)),
            Field::PartOf(whole) => Self::PartOf(whole),
        }
    }

    /// How its elements are named and how many there are; none where the machine has no such number.
    pub(super) fn listed(self) -> Option<(List, usize)> {
        match self {
            Self::Machine(list, count) | Self::Form(_, list, count) => Some((list, count)),
            Self::Elsewhere | Self::PartOf(_) => None,
        }
    }

    /// The key of an element, as `--set` names it.
    pub(super) fn key(self, row: &Parameter, index: usize) -> String {
        self.listed().map_or(List::None, |(list, _)| list).key(row.key, index)
    }
}

impl Numbers for Machine {
    fn sits(&self, row: &Parameter) -> Sits {
        Sits::of(&row.field, self)
    }

    fn get(&self, row: &Parameter, index: usize) -> Option<f64> {
        (row.field.accessor()?.get)(self, index)
    }

    fn set(&mut self, row: &Parameter, index: usize, value: f64) {
        if let Some(accessor) = row.field.accessor() {
            (accessor.set)(self, index, value);
        }
    }

    fn row(&self, key: &str) -> Option<&'static Parameter> {
        named(key)
    }

    fn frictions(&mut self) -> Vec<&mut Friction> {
        vec![&mut self.drive_pulley.friction, &mut self.cart.friction, &mut self.idler_pulley.friction]
    }

    fn axis(&self) -> Option<&Machine> {
        Some(self)
    }
}

impl Numbers for Gantry {
    fn sits(&self, row: &Parameter) -> Sits {
        Sits::of(&row.gantry, self)
    }

    fn get(&self, row: &Parameter, index: usize) -> Option<f64> {
        (row.gantry.accessor()?.get)(self, index)
    }

    fn set(&mut self, row: &Parameter, index: usize, value: f64) {
        if let Some(accessor) = row.gantry.accessor() {
            (accessor.set)(self, index, value);
        }
    }

    fn row(&self, key: &str) -> Option<&'static Parameter> {
        // The cart of a gantry has the rows of its bridge, and each drive those of an axis's.
        let of_cart = key.strip_prefix(SLIDES[1]).map(|rest| format!("{}{rest}", SLIDES[0]));
        let of_drive = DRIVES.iter().find_map(|drive| key.strip_prefix(drive));
        let row = named(of_cart.as_deref().or(of_drive).unwrap_or(key))?;
        let list = self.sits(row).listed().map(|(list, _)| list);
        // Nothing but the parts of a drive stands below one.
        (of_drive.is_none() || list == Some(List::Drives)).then_some(row)
    }

    fn frictions(&mut self) -> Vec<&mut Friction> {
        vec![&mut self.drive_pulley.friction, &mut self.bridge.friction, &mut self.cart.friction]
    }

    fn axis(&self) -> Option<&Machine> {
        None
    }
}
