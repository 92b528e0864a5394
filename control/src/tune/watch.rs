//! Machines on which a search runs its moves: those that are worst for its designs.

use super::objective::{AtWorst, Glance, MoveFigures};

/// Number of watched machines for each figure, in addition to the excluded ones.
const WATCHED: usize = 2;

/// For each move, the machines on which a search runs it, the worst first.
#[derive(Debug, Clone, Default)]
pub(super) struct Watch {
    pub axes: Vec<Vec<usize>>,
    /// Number of machines excluded from each figure.
    pub left_out: usize,
}

/// Machines by a figure, the worst first.
fn order(seen: &[MoveFigures], figure: fn(&MoveFigures) -> f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..seen.len()).collect();
    order.sort_by(|&a, &b| figure(&seen[b]).total_cmp(&figure(&seen[a])));
    order
}

/// Figures that select the machines on which a search runs a move.
const FIGURES: [fn(&MoveFigures) -> f64; 2] = [|seen| seen.error, |seen| seen.settles];

impl Watch {
    /// Machines that are worst in a figure: `left_out` plus a fixed number for each.
    pub fn new(seen: &[Vec<MoveFigures>], left_out: usize) -> Self {
        let of_move = |seen: &Vec<MoveFigures>| {
            let mut axes: Vec<usize> = Vec::new();
            let orders = FIGURES.map(|figure| order(seen, figure));
            for rank in 0..(left_out + WATCHED).min(seen.len()) {
                for order in &orders {
                    if !axes.contains(&order[rank]) {
                        axes.push(order[rank]);
                    }
                }
            }
            axes
        };
        Self { axes: seen.iter().map(of_move).collect(), left_out }
    }

    /// Worst case of a move over machines that were seen, without the excluded ones.
    pub fn worst(&self, seen: &[(usize, Glance)]) -> AtWorst {
        AtWorst::new(&seen.iter().map(|(_, one)| one.figures).collect::<Vec<_>>(), self.left_out)
    }

    /// Adds the machines of another list; true if any is new.
    pub fn join(&mut self, other: &Self) -> bool {
        self.axes.resize(self.axes.len().max(other.axes.len()), Vec::new());
        let mut is_new = false;
        for (own, other) in self.axes.iter_mut().zip(&other.axes) {
            is_new |= other.iter().any(|axis| !own.contains(axis));
            let mut all = other.clone();
            all.extend(own.iter().filter(|axis| !other.contains(axis)));
            *own = all;
        }
        self.left_out = self.left_out.max(other.left_out);
        is_new
    }
}
