//! Starting gains of a search by several rules, and filters to try.

use crate::design::placement::{first, place};
use crate::design::{Design, Filter};
use crate::machine::Machine;

/// Further damping ratios of placements.
const DAMPINGS: [f64; 2] = [0.6, 1.0];

/// Depth and width of an added notch.
const DEPTH: f64 = 0.1;
const WIDTH: f64 = 0.7;

/// Maximum number of notches, including those of the file.
const NOTCHES: usize = 2;

/// Starts for a design: placements about `bandwidth` (Hz), and further starts of its structure.
pub fn starts(
    design: &Design,
    machine: &Machine,
    swing: Option<f64>,
    bandwidth: Option<f64>,
    damping: f64,
) -> Vec<(Design, Option<f64>)> {
    let hertz = bandwidth.unwrap_or(first(design, swing));
    let dampings = std::iter::once(damping).chain(DAMPINGS);
    let mut all: Vec<(Design, Option<f64>)> =
        dampings.filter_map(|damping| Some((place(design, machine, hertz, damping)?, Some(hertz)))).collect();
    let others = design.structure.tunable().starts(design, machine);
    all.extend(others.into_iter().map(|structure| (Design { structure, ..design.clone() }, None)));
    all
}

/// Filter layouts to try, the design without added filters first: `modes` are frequencies of the axis below half the
/// sampling rate, Hz, the lowest first.
pub fn layouts(design: &Design, modes: &[f64]) -> Vec<Design> {
    let mut all = vec![design.clone()];
    let notch = |frequency: f64| Filter::Notch { frequency, depth: DEPTH, damping: WIDTH };
    let there = design.filters.iter().filter(|filter| matches!(filter, Filter::Notch { .. })).count();
    let room = NOTCHES.saturating_sub(there);
    let low_pass = design.filters.iter().any(|filter| matches!(filter, Filter::LowPass { .. }));
    let low = Filter::LowPass { frequency: modes.first().copied().unwrap_or(0.2 / design.every), damping: 0.7 };
    let mut add = |filters: Vec<Filter>| {
        let mut other = design.clone();
        other.filters.extend(filters);
        all.push(other);
    };
    if !low_pass {
        add(vec![low]);
    }
    if let (Some(&one), true) = (modes.first(), room > 0) {
        add(vec![notch(one)]);
        if let (Some(&two), true) = (modes.get(1), room > 1) {
            add(vec![notch(one), notch(two)]);
        }
        if !low_pass {
            add(vec![notch(one), low]);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};

    #[test]
    fn a_pid_starts_from_placements_of_several_dampings() {
        let change = "controller={ every = \"1 ms\", limit = \"24 V\", pid = { proportional = \"100 V/m\" } }";
        let case = Case::from_text_with("axis.toml", TEMPLATE, &[change]).unwrap();
        let design = case.controller.unwrap();
        let all = starts(&design, &case.machine, None, Some(15.0), 0.8);
        // 0.8, 0.6 and 1, each about the bandwidth.
        assert_eq!(all.iter().filter(|(_, hertz)| *hertz == Some(15.0)).count(), 3);
        assert!(all.iter().all(|(start, _)| start.every == design.every && start.structure != design.structure));
    }
}
