//! Events on curves: where a body begins to stick, and where it slips.

use crate::{Colour, Panel, Series, Style};
use taut::mechanism::Status;
use taut::solve::Event;

/// Marks of a panel; beyond, they would hide the curves.
const MOST: usize = 1000;

/// Times and values of a curve.
type Curve = (Vec<f64>, Vec<f64>);

/// The panel with what happens to each body marked on the curve of its number.
pub fn marked(mut panel: Panel, events: &[Event], curves: &[Option<Curve>]) -> Panel {
    for (name, style, happens) in
        [("sticks", Style::Points, sticks as fn(&Event) -> bool), ("slips", Style::Rings, slips)]
    {
        let found = events.iter().filter(|event| happens(event));
        let places = found.filter_map(|event| {
            let (x, y) = curves.get(event.body()?)?.as_ref()?;
            Some((event.time, at(x, y, event.time)?))
        });
        let mut places: Vec<(f64, f64)> = places.take(MOST + 1).collect();
        if places.is_empty() || places.len() > MOST {
            continue;
        }
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (x, y): Curve = places.into_iter().unzip();
        panel = panel.series(Series::new(name, x, y).colour(Colour::Ink).style(style));
    }
    panel
}

fn sticks(event: &Event) -> bool {
    matches!(event.to, Status::Motion(to) if to.code() == 0)
}

fn slips(event: &Event) -> bool {
    matches!(event.from, Status::Motion(from) if from.code() == 0)
}

/// The value of a curve at this time, on the line between two samples.
fn at(x: &[f64], y: &[f64], time: f64) -> Option<f64> {
    let after = x.partition_point(|x| *x < time);
    if after == 0 {
        return y.first().copied().filter(|_| x.first() == Some(&time));
    }
    let (x1, y1) = (*x.get(after)?, *y.get(after)?);
    let (x0, y0) = (x[after - 1], y[after - 1]);
    let share = if x1 > x0 { (time - x0) / (x1 - x0) } else { 0.0 };
    Some(y0 + share * (y1 - y0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;

    #[test]
    fn a_mark_stands_on_the_curve_of_its_body() {
        let x = vec![0.0, 1.0, 2.0];
        assert_eq!(at(&x, &[0.0, 2.0, 2.0], 0.5), Some(1.0));
        assert_eq!(at(&x, &[3.0, 2.0, 2.0], 0.0), Some(3.0));
        assert_eq!(at(&x, &[0.0, 2.0, 2.0], 2.5), None);
        assert_eq!(at(&[], &[], 0.0), None);
        let empty = marked(Panel::new(Axis::new("", "")), &[], &[Some((x.clone(), x))]);
        assert!(empty.series.is_empty());
    }
}
