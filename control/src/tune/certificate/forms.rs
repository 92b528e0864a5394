//! Linear forms of the channels along an interval of frequencies, and their values over a box of parameters.
//!
//! Values at all nodes and minors of a table are computed side by side, so that the compiler takes vector instructions.

use super::jet::modulus;
use nalgebra::Complex;

/// What forms need of polynomials over a box.
pub(super) struct Columns {
    /// By channels: the values in the middle, and side by side those of `nodes` Bernstein coefficients, whose hull
    /// contains the values over the box, followed by those of terms that are bounded by their size (minors).
    pub center: Vec<f64>,
    pub columns: Vec<Vec<f64>>,
    pub nodes: usize,
}

/// A linear form of the channels, and the parts of it that are bounded.
pub(super) struct Form {
    /// Coefficients at the middle of the interval, and their changes along it, linear and quadratic.
    pub still: Vec<Complex<f64>>,
    pub change: Vec<Complex<f64>>,
    pub bend: Vec<Complex<f64>>,
    /// Bound of what the interval adds beyond, and of all else.
    pub curved: f64,
    pub other: f64,
}

impl Form {
    /// Largest value over the box in the middle of the interval, and what the interval adds at most.
    pub fn most(&self, over: &Columns) -> [f64; 2] {
        let values = Values::new(self, over);
        let most = |sizes: Vec<f64>| {
            let (nodes, minors) = sizes.split_at(over.nodes);
            minors.iter().fold(nodes.iter().copied().fold(0.0, f64::max), |sum, minor| sum + minor)
        };
        [most(values.still.moduli()) + self.other, most(values.changes()) + self.curved]
    }
}

/// Complex numbers side by side.
pub(super) struct Numbers {
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Numbers {
    fn zero(count: usize) -> Self {
        Self { re: vec![0.0; count], im: vec![0.0; count] }
    }

    pub fn count(&self) -> usize {
        self.re.len()
    }

    pub fn at(&self, place: usize) -> Complex<f64> {
        Complex::new(self.re[place], self.im[place])
    }

    /// self + factor · column
    fn add(&mut self, factor: Complex<f64>, column: &[f64]) {
        self.re.iter_mut().zip(column).for_each(|(sum, value)| *sum += factor.re * value);
        self.im.iter_mut().zip(column).for_each(|(sum, value)| *sum += factor.im * value);
    }

    /// As [`modulus`].
    fn moduli(&self) -> Vec<f64> {
        let parts = || self.re.iter().zip(&self.im);
        let mut all: Vec<f64> = parts().map(|(re, im)| (re * re + im * im).sqrt()).collect();
        for (own, (re, im)) in all.iter_mut().zip(parts()) {
            if !(*own > 1e-124 && *own < 1e124) {
                *own = modulus(Complex::new(*re, *im));
            }
        }
        all
    }
}

/// Re(lead Δ − turn X) of each.
pub(super) fn parts(into: &mut [f64], [delta, x]: [&Numbers; 2], [lead, turn]: [Complex<f64>; 2]) {
    let all = into.iter_mut().zip(&delta.re).zip(&delta.im).zip(&x.re).zip(&x.im);
    for ((((into, delta_re), delta_im), x_re), x_im) in all {
        *into = (lead.re * delta_re - lead.im * delta_im) - (turn.re * x_re - turn.im * x_im);
    }
}

/// The values of a form at all nodes and minors of a table.
pub(super) struct Values {
    /// In the middle of the interval, and the linear and quadratic changes along it.
    pub still: Numbers,
    pub change: Numbers,
    pub bend: Numbers,
}

impl Values {
    fn new(form: &Form, over: &Columns) -> Self {
        let none = || Numbers::zero(over.columns[0].len());
        let mut values = Self { still: none(), change: none(), bend: none() };
        for (channel, column) in over.columns.iter().enumerate() {
            let (still, change, bend) = (form.still[channel], form.change[channel], form.bend[channel]);
            if [still, change, bend] != [Complex::ZERO; 3] {
                values.still.add(still, column);
                values.change.add(change, column);
                values.bend.add(bend, column);
            }
        }
        values
    }

    /// What the interval adds at most, each.
    fn changes(&self) -> Vec<f64> {
        let mut sums = self.change.moduli();
        sums.iter_mut().zip(self.bend.moduli()).for_each(|(sum, bend)| *sum += bend);
        sums
    }
}

/// A form and its values over a box.
pub(super) struct Seen {
    pub form: Form,
    pub values: Values,
    /// Its value at the middle of box and interval.
    pub center: Complex<f64>,
    /// Distances of the nodes from it, and sizes of the minors; and what the interval adds to each at most.
    away: Vec<f64>,
    changes: Vec<f64>,
    nodes: usize,
}

impl Seen {
    pub fn new(form: Form, over: &Columns) -> Self {
        let (values, nodes) = (Values::new(&form, over), over.nodes);
        let center = dot(&form.still, &over.center);
        let mut from = Numbers { re: values.still.re.clone(), im: values.still.im.clone() };
        from.re.iter_mut().take(nodes).for_each(|re| *re -= center.re);
        from.im.iter_mut().take(nodes).for_each(|im| *im -= center.im);
        Self { away: from.moduli(), changes: values.changes(), values, center, form, nodes }
    }

    /// Bound of what is not in its values; in the middle of the interval alone if `along` is zero.
    pub fn radius(&self, along: f64) -> f64 {
        self.form.other + along * self.form.curved
    }

    /// Radius of a disc around its center that contains all of its values.
    pub fn off(&self, along: f64) -> f64 {
        let sizes = self.away.iter().zip(&self.changes).map(|(away, change)| away + along * change);
        let minors = sizes.clone().skip(self.nodes).fold(self.radius(along), |sum, own| sum + own);
        minors + sizes.take(self.nodes).fold(0.0, f64::max)
    }
}

pub(super) fn dot(form: &[Complex<f64>], channels: &[f64]) -> Complex<f64> {
    form.iter().zip(channels).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forms and columns with any numbers, zero and tiny ones among them.
    fn any(channels: usize, nodes: usize, minors: usize) -> (Form, Columns) {
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            match state >> 28 {
                0 => 0.0,
                1 => 1e-170,
                _ => f64::from(state) / f64::from(u32::MAX) - 0.5,
            }
        };
        let columns = (0..channels).map(|_| (0..nodes + minors).map(|_| number()).collect()).collect();
        let center = (0..channels).map(|_| number()).collect();
        let mut row = |zero: usize| -> Vec<Complex<f64>> {
            let of = |channel| if channel == zero { Complex::ZERO } else { Complex::new(number(), number()) };
            (0..channels).map(of).collect()
        };
        let (still, change, bend) = (row(2), row(2), row(2));
        (Form { still, change, bend, curved: 0.25, other: 0.125 }, Columns { center, columns, nodes })
    }

    /// Side by side, values are those of one node after another, to the last bit.
    #[test]
    fn values_side_by_side_are_those_of_each_node() {
        let (form, over) = any(7, 9, 4);
        let node = |place: usize| -> Vec<f64> { over.columns.iter().map(|column| column[place]).collect() };
        let seen = Seen::new(form, &over);
        let Form { still, change, bend, .. } = &seen.form;
        let center = dot(still, &over.center);
        assert_eq!(seen.center, center);
        let mut off = [0.125, 0.375];
        let mut hull = [0.0_f64; 2];
        for place in (9..13).chain(0..9) {
            let [at, first, second] = [still, change, bend].map(|form| dot(form, &node(place)));
            let values = &seen.values;
            assert_eq!([values.still.at(place), values.change.at(place), values.bend.at(place)], [at, first, second]);
            let away = modulus(if place < 9 { at - center } else { at });
            let own = [away, away + (modulus(first) + modulus(second))];
            match place < 9 {
                true => hull = [hull[0].max(own[0]), hull[1].max(own[1])],
                false => off = [off[0] + own[0], off[1] + own[1]],
            }
        }
        assert_eq!([seen.off(0.0), seen.off(1.0)], [off[0] + hull[0], off[1] + hull[1]]);
        let [lead, turn] = [Complex::new(0.3, -2.0), Complex::new(-0.7, 0.1)];
        let numbers = [&seen.values.still, &seen.values.bend];
        let mut found = vec![0.0; 13];
        parts(&mut found, numbers, [lead, turn]);
        let of = |place| (lead * numbers[0].at(place) - turn * numbers[1].at(place)).re;
        assert_eq!(found, (0..13).map(of).collect::<Vec<_>>());
    }

    #[test]
    fn sizes_neither_overflow_nor_underflow() {
        for scale in [1e-200, 1.0, 1e200] {
            let numbers = Numbers { re: vec![3.0 * scale, 0.0], im: vec![-4.0 * scale, 0.0] };
            let found = numbers.moduli();
            assert!((found[0] / (5.0 * scale) - 1.0).abs() < 1e-15 && found[1] == 0.0, "{found:?}");
        }
    }
}
