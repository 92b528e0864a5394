//! Results that runs of one machine share.

use std::any::Any;

/// Prepared modes by kernel, shared by runs of one machine.
#[derive(Default)]
pub(super) struct Known(Vec<Box<dyn Any + Send>>);

impl Known {
    /// Drops all of them, for another machine.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// The list of this type, created empty if missing: modes of a kernel, or their derivatives.
    pub(super) fn list<T: Send + 'static>(&mut self) -> &mut Vec<T> {
        let index = self.0.iter().position(|list| list.is::<Vec<T>>()).unwrap_or_else(|| {
            self.0.push(Box::new(Vec::<T>::new()));
            self.0.len() - 1
        });
        self.0[index].downcast_mut().expect("a list of this type")
    }
}
