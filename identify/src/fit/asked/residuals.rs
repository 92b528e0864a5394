//! The function that a search minimises: residuals as a function of variables within bounds, and how they are
//! differentiated.

use nalgebra::DMatrix;

/// Residuals as a function of the variables.
pub trait Residuals {
    /// Number of residuals.
    fn rows(&self) -> usize;

    /// r(x); false where it cannot be computed.
    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool;

    /// True if the last Jacobian is exact, independent of the requested differences.
    fn is_exact(&self) -> bool {
        false
    }

    /// ∂r/∂x by differences within the bounds; `r` = r(x). Zero for a variable whose bounds hold it.
    fn jacobian(&mut self, x: &[f64], r: &[f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.rows(), x.len());
        let mut moved = x.to_vec();
        let (mut a, mut b) = (vec![0.0; r.len()], vec![0.0; r.len()]);
        for j in (0..x.len()).filter(|&j| !bounds.hold(j)) {
            let step = Step::new(x, bounds, j, how);
            moved[j] = step.first;
            let mut good = self.evaluate(&moved, &mut a);
            if let Some(second) = step.second {
                moved[j] = second;
                good &= self.evaluate(&moved, &mut b);
            }
            moved[j] = x[j];
            if !good {
                return None;
            }
            for i in 0..r.len() {
                jacobian[(i, j)] = step.slope(r[i], a[i], b[i]);
            }
        }
        Some(jacobian)
    }

    /// r(x), into `r`, and ∂r/∂x there; for what gives both at once. None where one of them cannot be computed.
    fn linearised(&mut self, x: &[f64], r: &mut [f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        if self.evaluate(x, r) { self.jacobian(x, r, bounds, how) } else { None }
    }
}

/// Step sizes of finite differences. The step is the cube root of the rounding unit for central differences, which
/// balances the errors of formula and rounding (1e-10 of the value), and the square root for one-sided ones.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Differences {
    /// One-sided, from the values at hand.
    Forward,
    /// To both sides.
    Central,
    /// To both sides by these steps. Where a body sticks and slips with every sample of its input, the outputs have a
    /// kink for each of them; steps of about a standard error see the slope that matters and not that between two
    /// kinks.
    Coarse(Vec<f64>),
}

/// The point of a derivative.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// The first point.
    pub first: f64,
    /// The second point, if there is one.
    pub second: Option<f64>,
    at: f64,
}

impl Step {
    /// Points around `x` within its bounds.
    pub fn new(x: &[f64], bounds: &Bounds, j: usize, how: &Differences) -> Self {
        let (x, low, high) = (x[j], bounds.low[j], bounds.high[j]);
        let size = x.abs().max(1.0);
        let central = *how != Differences::Forward;
        let h = match how {
            Differences::Forward => 1e-7 * size,
            Differences::Central => 6e-6 * size,
            Differences::Coarse(steps) => f64::min(steps[j].max(6e-6 * size), (high - low) / 3.0),
        };
        match (x + h <= high, x - h >= low, central) {
            (true, true, true) => Self { first: x + h, second: Some(x - h), at: x },
            (true, _, false) => Self { first: x + h, second: None, at: x },
            (_, _, false) => Self { first: x - h, second: None, at: x },
            // At a bound: three points on one side.
            (true, false, true) => Self { first: x + h, second: Some(x + 2.0 * h), at: x },
            (_, _, true) => Self { first: x - h, second: Some(x - 2.0 * h), at: x },
        }
    }

    /// The weights in that slope of the values at x and at the two points.
    pub fn weights(&self) -> [f64; 3] {
        [self.slope(1.0, 0.0, 0.0), self.slope(0.0, 1.0, 0.0), self.slope(0.0, 0.0, 1.0)]
    }

    /// The slope at x of a function with these values at x and at the two points.
    #[inline]
    pub fn slope(&self, here: f64, first: f64, second: f64) -> f64 {
        let h = self.first - self.at;
        match self.second {
            None => (first - here) / h,
            Some(other) if (other - self.at) * h < 0.0 => (first - second) / (self.first - other),
            // f′ = (−3 f₀ + 4 f₁ − f₂) / 2h
            Some(_) => (-3.0 * here + 4.0 * first - second) / (2.0 * h),
        }
    }
}

/// The box that the variables stay in.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Least values.
    pub low: Vec<f64>,
    /// Greatest values.
    pub high: Vec<f64>,
}

impl Bounds {
    /// No bounds on `n` variables.
    pub fn none(n: usize) -> Self {
        Self { low: vec![f64::NEG_INFINITY; n], high: vec![f64::INFINITY; n] }
    }

    /// True if variable `j` can only have one value.
    pub fn hold(&self, j: usize) -> bool {
        self.low[j] >= self.high[j]
    }
}
