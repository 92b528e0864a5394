//! Rows of a move with references and errors.

use super::contour::{Contour, Follower};
use crate::machine::{Machine, SlideAt};
use crate::signal::profile::Profile;
use crate::trajectory::{Column, Trajectory};

/// Blocks of rows with references and errors after their own columns.
pub(super) struct Wide {
    block: Trajectory,
    /// The path of a machine with two coordinates.
    contour: Option<Follower>,
    /// Columns of the positions, and names of the references and errors that go with them.
    loads: Vec<[String; 3]>,
}

impl Wide {
    pub(super) fn new(machine: &Machine, profiles: &[Profile]) -> Self {
        let slides = machine.geometry().slides;
        let names = |slide: &SlideAt| {
            let key = machine.geometry().label(slide.body).key;
            let reference = if slides.len() == 1 { "reference".to_string() } else { format!("{key}_reference") };
            [format!("{key}_position"), reference, format!("{key}_error")]
        };
        Self {
            block: Trajectory::default(),
            contour: Contour::along(profiles).map(Follower::new),
            loads: slides.iter().map(names).collect(),
        }
    }

    pub(super) fn widened(&mut self, profiles: &[Profile], block: &Trajectory) -> &Trajectory {
        let (own, loads) = (block.columns.len(), self.loads.len());
        let added = 2 * loads + usize::from(self.contour.is_some());
        if self.block.columns.len() != own + added {
            self.block.columns.clone_from(&block.columns);
            let names = self.loads.iter().map(|names| &names[1]).chain(self.loads.iter().map(|names| &names[2]));
            self.block.columns.extend(names.map(|name| Column::new(name.as_str(), "m")));
            if self.contour.is_some() {
                self.block.columns.push(Column::new("contour_error", "m"));
            }
        }
        let time = block.get("time").unwrap_or(&[]);
        let place = |names: &[String; 3]| block.get(&names[0]).unwrap_or(&[]);
        let references: Vec<Vec<f64>> =
            profiles.iter().map(|profile| time.iter().map(|&t| profile.at(t).position).collect()).collect();
        let error = |(names, reference): (&[String; 3], &Vec<f64>)| -> Vec<f64> {
            place(names).iter().zip(reference).map(|(x, y)| y - x).collect()
        };
        let errors: Vec<Vec<f64>> = self.loads.iter().zip(&references).map(error).collect();
        let away: Option<Vec<f64>> = match (&mut self.contour, &self.loads[..]) {
            (Some(contour), [x, y]) => {
                let (x, y) = (place(x), place(y));
                let points = x.iter().zip(y).zip(time);
                Some(points.map(|((x, y), time)| contour.follow(*time, [*x, *y]).distance).collect())
            }
            _ => None,
        };
        let own = block.columns.iter().map(|column| &column.values);
        let sources = own.chain(&references).chain(&errors).chain(&away);
        for (to, from) in self.block.columns.iter_mut().zip(sources) {
            to.values.clone_from(from);
        }
        &self.block
    }
}
