//! Polynomials in several parameters over a box, each parameter from −1 to 1.

use nalgebra::DMatrix;

/// Coefficients of one polynomial for each channel: for each product of powers of the parameters the channels side by
/// side.
#[derive(Debug, Clone)]
pub(super) struct Tensor {
    /// Number of powers of each parameter: its degree plus one.
    pub shape: Vec<usize>,
    pub channels: usize,
    pub values: Vec<f64>,
}

/// Points of an interpolation of this degree from −1 to 1.
pub(super) fn points(degree: usize) -> Vec<f64> {
    match degree {
        0 => vec![0.0],
        _ => (0..=degree).map(|k| -(std::f64::consts::PI * k as f64 / degree as f64).cos()).collect(),
    }
}

/// From values at [`points`] to coefficients of powers.
pub(super) fn from_points(degree: usize) -> DMatrix<f64> {
    let points = points(degree);
    let powers = DMatrix::from_fn(degree + 1, degree + 1, |i, j| points[i].powi(j as i32));
    powers.try_inverse().expect("interpolation points are distinct")
}

fn choose(n: usize, k: usize) -> f64 {
    (0..k).map(|i| (n - i) as f64 / (i + 1) as f64).product()
}

/// From powers of t to powers of τ, t = c + h τ.
fn substituted(degree: usize, c: f64, h: f64) -> DMatrix<f64> {
    DMatrix::from_fn(degree + 1, degree + 1, |j, i| match i.checked_sub(j) {
        None => 0.0,
        Some(rest) => choose(i, j) * c.powi(rest as i32) * h.powi(j as i32),
    })
}

/// From powers of t to the coefficients of Bernstein's polynomials over −1 ≤ t ≤ 1.
fn bernstein(degree: usize) -> DMatrix<f64> {
    let share =
        DMatrix::from_fn(degree + 1, degree + 1, |i, j| if j <= i { choose(i, j) / choose(degree, j) } else { 0.0 });
    share * substituted(degree, -1.0, 2.0)
}

/// The exponents of the next product of powers, in the order of a tensor of this shape.
pub(super) fn next(exponents: &mut [usize], shape: &[usize]) {
    for (exponent, size) in exponents.iter_mut().zip(shape).rev() {
        *exponent += 1;
        if *exponent < *size {
            return;
        }
        *exponent = 0;
    }
}

impl Tensor {
    /// Number of products of powers.
    pub fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Applies a matrix along a parameter.
    pub fn along(&mut self, parameter: usize, matrix: &DMatrix<f64>) {
        let size = self.shape[parameter];
        let inner: usize = self.shape[parameter + 1..].iter().product::<usize>() * self.channels;
        let mut line = vec![0.0; size * inner];
        for block in self.values.chunks_exact_mut(size * inner) {
            line.fill(0.0);
            for i in 0..size {
                for j in 0..size {
                    let factor = matrix[(i, j)];
                    if factor != 0.0 {
                        let (to, from) = (&mut line[i * inner..(i + 1) * inner], &block[j * inner..(j + 1) * inner]);
                        to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
                    }
                }
            }
            block.copy_from_slice(&line);
        }
    }

    /// The polynomials over a part of the box: a parameter t from c − h to c + h.
    pub fn narrow(&mut self, parameter: usize, c: f64, h: f64) {
        let degree = self.shape[parameter] - 1;
        if degree > 0 && (c != 0.0 || h != 1.0) {
            self.along(parameter, &substituted(degree, c, h));
        }
    }

    /// Replaces the powers of a parameter by Bernstein's polynomials: all values over the box lie within the convex
    /// hull of the coefficients.
    pub fn bernstein_form(&mut self, parameter: usize) {
        self.along(parameter, &bernstein(self.shape[parameter] - 1));
    }

    /// Passes the exponents and the channels of every product of powers, in their order.
    pub fn products<'s>(&'s self, mut take: impl FnMut(&[usize], &'s [f64])) {
        let mut exponents = vec![0; self.shape.len()];
        for channels in self.values.chunks_exact(self.channels) {
            take(&exponents, channels);
            next(&mut exponents, &self.shape);
        }
    }

    /// Channels of a product of powers.
    pub fn channels_of(&self, number: usize) -> &[f64] {
        &self.values[number * self.channels..(number + 1) * self.channels]
    }

    /// The polynomials at a point.
    pub fn at(&self, point: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.channels];
        self.products(|exponents, channels| {
            let factor: f64 = exponents.iter().zip(point).map(|(power, t)| t.powi(*power as i32)).product();
            sums.iter_mut().zip(channels).for_each(|(sum, value)| *sum += factor * value);
        });
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f = 1 + 2 t + 3 t² + s (4 − t − 2 t²) and g = −f/2.
    fn pair() -> Tensor {
        let values = [1.0, 2.0, 3.0, 4.0, -1.0, -2.0].iter().flat_map(|c| [*c, -0.5 * c]).collect();
        Tensor { shape: vec![2, 3], channels: 2, values }
    }

    fn f(s: f64, t: f64) -> f64 {
        1.0 + 2.0 * t + 3.0 * t * t + s * (4.0 - t - 2.0 * t * t)
    }

    const POINTS: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, -1.0], [-0.3, 0.7], [0.9, 0.2], [-1.0, -1.0]];

    #[test]
    fn values_are_those_of_the_polynomials() {
        for [s, t] in POINTS {
            let found = pair().at(&[s, t]);
            assert!((found[0] - f(s, t)).abs() < 1e-14 && (found[1] + 0.5 * f(s, t)).abs() < 1e-14, "{found:?}");
        }
    }

    #[test]
    fn products_have_their_exponents_in_order() {
        let (pair, mut all) = (pair(), Vec::new());
        pair.products(|exponents, channels| all.push((exponents.to_vec(), channels[0])));
        let [one, two] = [[1.0, 2.0, 3.0], [4.0, -1.0, -2.0]];
        let of = |s: usize, terms: [f64; 3]| (0..3).map(move |t| (vec![s, t], terms[t]));
        assert_eq!(all, of(0, one).chain(of(1, two)).collect::<Vec<_>>());
    }

    #[test]
    fn a_part_of_the_box_has_the_values_of_the_whole_there() {
        let mut part = pair();
        part.narrow(1, 0.25, 0.5);
        for [s, t] in POINTS {
            assert!((part.at(&[s, t])[0] - f(s, 0.25 + 0.5 * t)).abs() < 1e-14);
        }
    }

    #[test]
    fn values_lie_between_the_coefficients_of_bernsteins_form() {
        let mut form = pair();
        (0..2).for_each(|parameter| form.bernstein_form(parameter));
        let all: Vec<f64> = (0..form.count()).map(|number| form.channels_of(number)[0]).collect();
        let (low, high) = all.iter().fold((f64::MAX, f64::MIN), |(low, high), b| (low.min(*b), high.max(*b)));
        for [s, t] in POINTS {
            assert!((low - 1e-14..=high + 1e-14).contains(&f(s, t)), "{low} {high}");
        }
        // At the corners they are the values themselves: f(−1, −1) = −1 and f(1, 1) = 7.
        assert!((all[0] - f(-1.0, -1.0)).abs() < 1e-14 && (all[5] - f(1.0, 1.0)).abs() < 1e-14);
    }
}
