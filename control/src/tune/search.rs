//! Derivative-free search (J. A. Nelder, R. Mead, "A simplex method for function minimization", The Computer Journal 7,
//! 1965).

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Optimum {
    /// Where.
    pub x: Vec<f64>,
    /// The value there.
    pub value: f64,
}

/// Minimises from a point, with a simplex of edge `step`, until it is smaller than `accuracy` or after `most`
/// evaluations. NaN counts as infinite.
pub fn minimise(
    start: &[f64],
    step: f64,
    accuracy: f64,
    most: usize,
    function: &mut dyn FnMut(&[f64]) -> f64,
) -> Optimum {
    minimise_below(start, step, accuracy, most, &mut |x, _| function(x))
}

/// Minimises a function that receives the value to beat: if it is not better, it may return any value that is not below
/// that, without changing the course of the search.
pub(crate) fn minimise_below(
    start: &[f64],
    step: f64,
    accuracy: f64,
    most: usize,
    function: &mut dyn FnMut(&[f64], f64) -> f64,
) -> Optimum {
    let n = start.len();
    let mut asked = 0;
    let mut value = |x: &[f64], bar: f64| {
        asked += 1;
        let value = function(x, bar);
        (if value.is_nan() { f64::INFINITY } else { value }, asked)
    };
    let mut simplex: Vec<(Vec<f64>, f64)> = Vec::with_capacity(n + 1);
    for i in 0..=n {
        let mut x = start.to_vec();
        if i > 0 {
            x[i - 1] += step;
        }
        let v = value(&x, f64::INFINITY).0;
        simplex.push((x, v));
    }
    loop {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let size = |x: &[f64]| x.iter().zip(&simplex[0].0).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let width = simplex.iter().map(|(x, _)| size(x)).fold(0.0, f64::max);
        let last = simplex[n].clone();
        let centre: Vec<f64> = (0..n).map(|j| simplex[..n].iter().map(|(x, _)| x[j]).sum::<f64>() / n as f64).collect();
        let along =
            |factor: f64| -> Vec<f64> { centre.iter().zip(&last.0).map(|(c, w)| c + factor * (c - w)).collect() };
        let reflected = along(1.0);
        let (at_reflected, count) = value(&reflected, last.1);
        if width < accuracy || count >= most {
            if at_reflected < simplex[0].1 {
                simplex[0] = (reflected, at_reflected);
            }
            let (x, value) = simplex.swap_remove(0);
            return Optimum { x, value };
        }
        if at_reflected < simplex[0].1 {
            let expanded = along(2.0);
            let at_expanded = value(&expanded, at_reflected).0;
            simplex[n] = if at_expanded < at_reflected { (expanded, at_expanded) } else { (reflected, at_reflected) };
            continue;
        }
        if at_reflected < simplex[n - 1].1 {
            simplex[n] = (reflected, at_reflected);
            continue;
        }
        let contracted = along(if at_reflected < last.1 { 0.5 } else { -0.5 });
        let at_contracted = value(&contracted, last.1.min(at_reflected)).0;
        if at_contracted < last.1.min(at_reflected) {
            simplex[n] = (contracted, at_contracted);
            continue;
        }
        let best = simplex[0].0.clone();
        for (x, v) in &mut simplex[1..] {
            x.iter_mut().zip(&best).for_each(|(x, b)| *x = b + 0.5 * (*x - b));
            *v = value(x, f64::INFINITY).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_of_a_bent_valley() {
        // Rosenbrock's, 0 at (1, 1)
        let mut count = 0;
        let mut valley = |x: &[f64]| {
            count += 1;
            (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2)
        };
        let found = minimise(&[-1.2, 1.0], 0.3, 1e-8, 2000, &mut valley);
        // A contraction to the wrong side takes twice as many.
        assert!(found.value < 1e-12 && count < 250, "{found:?} after {count}");
        assert!((found.x[0] - 1.0).abs() < 1e-5);
    }

    #[test]
    fn what_is_no_better_need_not_be_known() {
        let valley = |x: &[f64]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
        let whole = minimise(&[-1.2, 1.0], 0.3, 1e-8, 500, &mut |x| valley(x));
        // Above the bar, only the fact is returned.
        let mut short = |x: &[f64], bar: f64| if valley(x) < bar { valley(x) } else { bar + 1e3 };
        assert_eq!(minimise_below(&[-1.2, 1.0], 0.3, 1e-8, 500, &mut short), whole);
    }

    #[test]
    fn walks_around_what_is_no_number() {
        let mut wall = |x: &[f64]| if x[0] < 0.5 { f64::NAN } else { (x[0] - 0.6).powi(2) };
        let found = minimise(&[2.0], 0.5, 1e-9, 500, &mut wall);
        assert!((found.x[0] - 0.6).abs() < 1e-6, "{found:?}");
    }
}
