//! Bounds of |S| and |T| over a box of parameters and an interval of frequencies.
//!
//! The axis behind a hold and a delay τ has, at z = e^{jωT}, the response Σ H(s_m) G(s_m) over all m, s_m = j(ω +
//! 2πm/T) and H(s) = e^{−sτ} (1 − e^{−sT})/(sT). With G = n/d and the controller D u = −N y, both sides times d and the
//! poles of the controller,
//!
//! ```text
//! Δ = d (D + N R) + n N H(s₀),     R = Σ H(s_m) G(s_m) over m ≠ 0
//! ```
//!
//! which like d and n is a polynomial in the parameters but for R, which is small and is bounded. |S| ≤ M means |X| ≤
//! M |Δ| with the numerator X of S, and it holds if for each direction φ there is a θ with Re(M e^{−jθ} Δ − e^{−jφ} X)
//! ≥ 0. That is linear in the coefficients of d and n, so its least value over the box is at least the least of those
//! at Bernstein's coefficients.

use super::axis::Axis;
use super::forms::{Columns, Form, Numbers, Seen, Values, dot, parts};
use super::jet::{Jet, modulus};
use super::tensor::Tensor;
use crate::control::feedback::Feedback;
use crate::tune::loops::Break;
use nalgebra::Complex;
use std::f64::consts::PI;

/// Largest number of Bernstein's coefficients; parameters with smaller mixed terms are bounded apart.
const NODES: usize = 128;

/// Pairs of aliases m = ±1, ±2, … that are evaluated one by one.
const ALIASES: i32 = 6;

/// Rounding allowance of a coefficient relative to its magnitude: above the tolerance of the interpolation.
const ROUNDING: f64 = 1e-10;

/// Directions of X if it may have any, and the angle between directions otherwise, rad.
const AROUND: usize = 16;
const BETWEEN: f64 = 0.4;

/// A violated limit counts from this factor on.
const BEYOND: f64 = 1.0 + 1e-6;

/// Polynomials over a box, in the form that cells need.
pub(super) struct Table {
    /// Channels in the middle of the box, and Bernstein's coefficients in most parameters as nodes, with linear and
    /// quadratic terms with the others as minors.
    values: Columns,
    /// By how much channels differ at most from those in the middle.
    deviation: Vec<f64>,
    /// The same of all channels over the leading one of d.
    monic: Vec<f64>,
    monic_deviation: Vec<f64>,
    /// Terms linear in each parameter.
    linear: Vec<Vec<f64>>,
    /// The sum of all higher terms, at most.
    mixed: Vec<f64>,
    /// For each node, true if its value is attained at a corner.
    is_corner: Vec<bool>,
}

impl Table {
    pub fn new(polynomials: &Tensor, axis: &Axis) -> Self {
        let magnitudes = &axis.magnitudes;
        let channels = polynomials.channels;
        let size = polynomials.shape.len();
        let center = polynomials.channels_of(0).to_vec();
        let mut linear = vec![vec![0.0; channels]; size];
        let mut deviation = vec![0.0; channels];
        let mut mixing = vec![0.0; size];
        polynomials.products(|exponents, values| {
            let degree = exponents.iter().sum::<usize>();
            if degree == 0 {
                return;
            }
            deviation.iter_mut().zip(values).for_each(|(sum, value)| *sum += value.abs());
            if degree == 1 {
                let parameter = exponents.iter().position(|power| *power == 1).unwrap_or_default();
                linear[parameter] = values.to_vec();
                return;
            }
            let relative = values.iter().zip(magnitudes).map(|(value, size)| value.abs() / size.max(f64::MIN_POSITIVE));
            let relative: f64 = relative.sum();
            mixing.iter_mut().zip(exponents).filter(|(_, power)| **power > 0).for_each(|(sum, _)| *sum += relative);
        });
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| mixing[b].total_cmp(&mixing[a]));
        let mut nodes = 1;
        let mut is_major = vec![false; size];
        for parameter in order {
            let own = polynomials.shape[parameter];
            if nodes * own <= NODES {
                nodes *= own;
                is_major[parameter] = true;
            }
        }
        let shape = (0..size).filter(|&parameter| is_major[parameter]).map(|parameter| polynomials.shape[parameter]);
        let mut majors = Tensor { shape: shape.collect(), channels, values: Vec::new() };
        let mut mixed = vec![0.0; channels];
        let mut minors: Vec<&[f64]> = Vec::new();
        polynomials.products(|exponents, values| {
            if exponents.iter().zip(&is_major).all(|(power, is_major)| *is_major || *power == 0) {
                majors.values.extend(values);
            } else if exponents.iter().sum::<usize>() <= 2 {
                minors.push(values);
            } else {
                mixed.iter_mut().zip(values).for_each(|(sum, value)| *sum += value.abs());
            }
        });
        (0..majors.shape.len()).for_each(|parameter| majors.bernstein_form(parameter));
        let mut is_corner = Vec::with_capacity(majors.count());
        majors.products(|exponents, _| {
            let is_end = |(power, size): (&usize, &usize)| *power == 0 || power + 1 == *size;
            is_corner.push(exponents.iter().zip(&majors.shape).all(is_end));
        });
        let column = |channel: usize| {
            let nodes = majors.values.iter().skip(channel).step_by(channels).copied();
            nodes.chain(minors.iter().map(|minor| minor[channel])).collect()
        };
        let columns = (0..channels).map(column).collect();
        let mut table = Self {
            values: Columns { center, columns, nodes: is_corner.len() },
            is_corner,
            deviation,
            monic: Vec::new(),
            monic_deviation: Vec::new(),
            linear,
            mixed,
        };
        table.divide(axis.orders[0] - 1);
        table
    }

    /// Bounds all channels over the channel `lead`, which is positive.
    ///
    /// With Bernstein's polynomials B, a/w = Σ B a_B / Σ B w_B is a mean of a_B/w_B with the weights B w_B. What other
    /// parameters add to a − r w with r = a₀/w₀ is at most divided by the least w.
    fn divide(&mut self, lead: usize) {
        let Columns { center, columns, nodes: count } = &self.values;
        let (channels, w) = (center.len(), center[lead]);
        self.monic = center.iter().map(|a| a / w).collect();
        let (nodes, minors) = columns[lead].split_at(*count);
        let around: f64 = minors.iter().map(|own| own.abs()).sum::<f64>() + self.mixed[lead];
        let least = nodes.iter().copied().fold(f64::INFINITY, f64::min);
        let deviation = |channel: usize| {
            if least.is_nan() || least <= around {
                return f64::INFINITY;
            }
            let others = |(own, lead): (&f64, &f64)| (own - self.monic[channel] * lead).abs();
            let (own_nodes, own_minors) = columns[channel].split_at(*count);
            let by_nodes = own_nodes.iter().zip(nodes).map(|both| others(both) / both.1).fold(0.0, f64::max);
            let minors: f64 = own_minors.iter().zip(minors).map(others).sum();
            let mixed = self.mixed[channel] + self.monic[channel].abs() * self.mixed[lead];
            by_nodes * (least + around) / (least - around) + (minors + mixed) / (least - around)
        };
        self.monic_deviation = (0..channels).map(deviation).collect();
    }

    /// Effort of a cell.
    pub fn effort(&self) -> usize {
        self.values.columns[0].len() + 50
    }
}

/// Limits of |S| and |T| at the breaks of a loop that are to be proven; infinite for one that is not asked.
pub(super) struct Question<'a> {
    pub axis: &'a Axis<'a>,
    pub feedback: &'a Feedback,
    pub breaks: &'static [Break],
    pub limits: [f64; 2],
    /// T and τ, s.
    pub every: f64,
    pub delay: f64,
}

/// Result for a cell.
pub(super) enum CellResult {
    /// All limits hold, and the loop has no pole on the unit circle.
    Holds,
    /// Not shown: a shorter interval of frequencies may suffice.
    TooWide,
    /// Not shown: the box is too large, most of all in this parameter.
    TooLarge(usize),
    /// A machine of the box violates a limit.
    Violated,
}

impl Question<'_> {
    /// Looks at the frequencies from `low` to `high`, in units of half the sampling rate.
    pub fn look(&self, table: &Table, low: f64, high: f64) -> CellResult {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let orders = &self.axis.orders;
        let most_power = orders.iter().copied().max().unwrap_or(1);
        // s/Ω = jσ, σ = middle + half t; ωT = πσ
        let [angle, width] = [middle, half].map(|sigma| PI * sigma);
        let change = Jet::turning_less_one(angle, width);
        let [position, scale, _, own] = self.feedback.over_poles(change, Jet::ONE);
        let terms = [position, scale];
        let powers = powers(middle, half, most_power);
        let late = self.delay / self.every;
        let held = Jet::turning(-late * angle, -late * width) * Jet::held(angle, width);
        let aliases = self.aliases(table, middle, half);
        // Factors of d and of each n in D and in N G of each output, and how much that of d depends on the parameters.
        let none = Factors { jets: vec![Jet::ZERO; orders.len()], spread: 0.0 };
        let mut direct = none.clone();
        direct.jets[0] = own;
        let of_output = |(output, (term, alias)): (usize, (&Jet, &(Jet, f64)))| {
            let mut factors = none.clone();
            (factors.jets[0], factors.jets[1 + output]) = (*term * alias.0, *term * held);
            Factors { spread: term.most() * alias.1, ..factors }
        };
        let parts: Vec<Factors> = terms.iter().zip(&aliases).enumerate().map(of_output).collect();
        let whole = parts.iter().fold(direct.clone(), |sum, part| sum.plus(part));
        // |d| in the middle of the interval, and what the interval adds.
        let mut alone = none.clone();
        alone.jets[0] = Jet::ONE;
        let bottom = self.form(table, &powers, &alone, [0.0; 2]).most(&table.values);
        let closed = Seen::new(self.form(table, &powers, &whole, bottom), &table.values);
        let mut worst = CellResult::Holds;
        for &at in self.breaks {
            // The two parts of Δ at this break.
            let outer = match at {
                Break::Command => None,
                Break::Position => Some(0),
                Break::Scale => Some(1),
                Break::Current => continue,
            };
            let mut both = [direct.clone(), none.clone()];
            for (output, part) in parts.iter().enumerate() {
                let is_outer = outer.is_none_or(|outer| outer == output);
                both[usize::from(is_outer)] = both[usize::from(is_outer)].plus(part);
            }
            for (factors, limit) in both.iter().zip(self.limits) {
                if limit.is_infinite() {
                    continue;
                }
                let numerator = Seen::new(self.form(table, &powers, factors, bottom), &table.values);
                match shown(table, &closed, &numerator, limit) {
                    CellResult::Holds => {}
                    CellResult::Violated => return CellResult::Violated,
                    seen @ CellResult::TooLarge(_) => worst = seen,
                    CellResult::TooWide => {
                        if matches!(worst, CellResult::Holds) {
                            worst = CellResult::TooWide;
                        }
                    }
                }
            }
        }
        worst
    }

    /// Σ H(s_m) G(s_m) over m ≠ 0, for each output, of the machine in the middle of the box, and how far that of
    /// another machine may be from it.
    fn aliases(&self, table: &Table, middle: f64, half: f64) -> Vec<(Jet, f64)> {
        let orders = &self.axis.orders;
        let most_power = orders.iter().copied().max().unwrap_or(1);
        let late = self.delay / self.every;
        // 1 − 1/z
        let step = Jet::turning_less_one(-PI * middle, -PI * half) * -1.0;
        let mut sums = vec![(Jet::ZERO, 0.0); orders.len() - 1];
        let ranges = ranges(orders);
        let polynomial = |powers: &[Jet], range: &std::ops::Range<usize>| {
            let of = |(power, value): (&Jet, &f64)| *power * *value;
            powers.iter().zip(&table.monic[range.clone()]).map(of).fold(Jet::ZERO, |a, b| a + b)
        };
        let off = |sizes: &[f64], range: &std::ops::Range<usize>, sigma: f64| -> f64 {
            sizes[range.clone()].iter().rev().fold(0.0, |sum, size| sum * sigma + size)
        };
        for m in (1..=ALIASES).flat_map(|m| [-m, m]) {
            let sigma = middle + 2.0 * f64::from(m);
            let powers = powers(sigma, half, most_power);
            let bottom = polynomial(&powers, &ranges[0]);
            let inverse = bottom.inverse();
            let size = sigma.abs() + half;
            let bottom_off = off(&table.monic_deviation, &ranges[0], size);
            // H(s_m) = e^{−s_m τ} (1 − 1/z)/(s_m T)
            let time =
                Jet { c: [Complex::new(0.0, PI * sigma), Complex::new(0.0, PI * half), Complex::ZERO], radius: 0.0 };
            let hold = Jet::turning(-late * PI * sigma, -late * PI * half) * step * time.inverse();
            for (sum, range) in sums.iter_mut().zip(&ranges[1..]) {
                let response = polynomial(&powers, range) * inverse;
                // |n/d − n₀/d₀| ≤ (|n − n₀| + |n₀/d₀| |d − d₀|)/|d|
                let least = bottom.least() - bottom_off;
                let top_off = off(&table.monic_deviation, range, size);
                let away = if least > 0.0 { (top_off + response.most() * bottom_off) / least } else { f64::INFINITY };
                *sum = (sum.0 + hold * response, sum.1 + hold.most() * away);
            }
        }
        // Beyond |σ| = 2M + 1, |n/d| falls at least as fast as 1/σ²: the sum of |H G| over |m| > M is at most
        // 2 |1 − 1/z|/π · |G| (1/(2M + 1) + 1/4).
        let far = f64::from(2 * ALIASES + 1);
        let most: Vec<f64> = table.monic.iter().zip(&table.monic_deviation).map(|(a, b)| a.abs() + b).collect();
        let last = ranges[0].end - 1;
        let least = far.powi(last as i32) - off(&most, &(0..last), far);
        for (sum, range) in sums.iter_mut().zip(&ranges[1..]) {
            let is_bounded = least > 0.0 && range.len() + 2 <= ranges[0].len();
            let far_off = if is_bounded { off(&most, range, far) / least } else { f64::INFINITY };
            sum.1 += 2.0 * step.most() / PI * far_off * (1.0 / far + 0.25);
        }
        sums
    }

    /// Σ factor · polynomial as a form of the channels.
    fn form(&self, table: &Table, powers: &[Jet], factors: &Factors, bottom: [f64; 2]) -> Form {
        let channels = table.values.center.len();
        let none = vec![Complex::ZERO; channels];
        let mut form = Form { still: none.clone(), change: none.clone(), bend: none, curved: 0.0, other: 0.0 };
        for (range, jet) in ranges(&self.axis.orders).into_iter().zip(&factors.jets) {
            for (channel, power) in range.zip(powers) {
                let term = *jet * *power;
                let most = table.values.center[channel].abs() + table.deviation[channel];
                (form.still[channel], form.change[channel], form.bend[channel]) = (term.c[0], term.c[1], term.c[2]);
                form.curved += most * term.radius;
                form.other += (table.mixed[channel] + ROUNDING * self.axis.magnitudes[channel]) * term.most();
            }
        }
        if factors.spread > 0.0 {
            form.other += factors.spread * bottom[0];
            form.curved += factors.spread * bottom[1];
        }
        form
    }
}

/// Factors of d and of each n in a sum.
#[derive(Clone)]
struct Factors {
    jets: Vec<Jet>,
    /// How far the factor of d may be from its jet in the box.
    spread: f64,
}

impl Factors {
    fn plus(&self, other: &Self) -> Self {
        let jets = self.jets.iter().zip(&other.jets).map(|(a, b)| *a + *b).collect();
        Self { jets, spread: self.spread + other.spread }
    }
}

/// Channels of d and each n.
fn ranges(orders: &[usize]) -> Vec<std::ops::Range<usize>> {
    let mut begin = 0;
    let of = |order: &usize| {
        begin += order;
        begin - order..begin
    };
    orders.iter().map(of).collect()
}

/// (j(σ + h t))ᵏ for all k below `count`.
fn powers(sigma: f64, h: f64, count: usize) -> Vec<Jet> {
    let j = Complex::new(0.0, 1.0);
    let of = |k: usize| {
        let turn = j.powu(k as u32);
        let power = |less: usize| if k >= less { sigma.powi((k - less) as i32) } else { 0.0 };
        let k = k as f64;
        let values = [power(0), k * power(1) * h, 0.5 * k * (k - 1.0) * power(2) * h * h];
        // All further terms of the binomial have positive coefficients of |σ| and h.
        let sizes: f64 = values.iter().map(|value| value.abs()).sum();
        let beyond = ((sigma.abs() + h).powf(k) - sizes).max(0.0);
        Jet { c: values.map(|value| turn * value), radius: beyond + 1e-14 * sizes }
    };
    (0..count).map(of).collect()
}

/// Checks |X| ≤ M |Δ|.
fn shown(table: &Table, closed: &Seen, numerator: &Seen, limit: f64) -> CellResult {
    let violates = |delta: Complex<f64>, x: Complex<f64>| {
        modulus(x) > limit * BEYOND * modulus(delta) + closed.form.other * limit + numerator.form.other
    };
    if violates(closed.center, numerator.center) {
        return CellResult::Violated;
    }
    let mut corners = (0..table.is_corner.len()).filter(|&node| table.is_corner[node]);
    if corners.any(|node| violates(closed.values.still.at(node), numerator.values.still.at(node))) {
        return CellResult::Violated;
    }
    let check = |along: f64| is_shown(table.values.nodes, [closed, numerator], limit, along);
    if check(1.0) {
        return CellResult::Holds;
    }
    if check(0.0) {
        return CellResult::TooWide;
    }
    let weight = |linear: &Vec<f64>| {
        limit * modulus(dot(&closed.form.still, linear)) + modulus(dot(&numerator.form.still, linear))
    };
    let weights: Vec<f64> = table.linear.iter().map(weight).collect();
    let most = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    match most {
        // A single machine: its interval is all that is left.
        None => CellResult::TooWide,
        Some(parameter) => CellResult::TooLarge(parameter),
    }
}

/// Whether |X| ≤ M |Δ| follows; in the middle of the interval alone if `along` is zero, otherwise one.
fn is_shown(nodes: usize, both: [&Seen; 2], limit: f64, along: f64) -> bool {
    let [closed, numerator] = both;
    let (center, top) = (closed.center, numerator.center);
    let radii = both.map(|seen| seen.radius(along));
    let off = both.map(|seen| seen.off(along));
    if off.iter().any(|off| !off.is_finite()) {
        return false;
    }
    // Discs around both suffice for most.
    if limit * (modulus(center) - off[0]) >= modulus(top) + off[1] {
        return true;
    }
    let (directions, apart) = if off[1] < 0.95 * modulus(top) {
        let half = (off[1] / modulus(top)).asin();
        let count = (2.0 * half / BETWEEN).ceil().max(1.0);
        let apart = 2.0 * half / count;
        let first = top.arg() - half + 0.5 * apart;
        ((0..count as usize).map(|k| first + apart * k as f64).collect::<Vec<_>>(), apart)
    } else {
        let apart = 2.0 * PI / AROUND as f64;
        ((0..AROUND).map(|k| apart * k as f64).collect(), apart)
    };
    // |X| is at most its part along the nearest direction over the cosine of the angle between them.
    let longer = 1.0 / (0.5 * apart).cos();
    let [mut values, mut changes, mut bends] = [(); 3].map(|()| vec![0.0; closed.values.still.count()]);
    let [still, change, bend]: [fn(&Values) -> &Numbers; 3] =
        [|values| &values.still, |values| &values.change, |values| &values.bend];
    let [still, change, bend] = [still, change, bend].map(|of| both.map(|seen| of(&seen.values)));
    directions.into_iter().all(|phi| {
        let turn = Complex::new(0.0, -phi).exp() * longer;
        let mut theta = center.arg();
        for _ in 0..3 {
            let lead = Complex::new(0.0, -theta).exp() * limit;
            parts(&mut values, still, [lead, turn]);
            parts(&mut changes, change, [lead, turn]);
            parts(&mut bends, bend, [lead, turn]);
            changes.iter_mut().zip(&bends).for_each(|(change, bend)| *change = along * (change.abs() + bend.abs()));
            let mut least = (f64::INFINITY, center);
            for (node, (value, change)) in values.iter().zip(&changes).enumerate().take(nodes) {
                if value - change < least.0 {
                    least = (value - change, closed.values.still.at(node));
                }
            }
            let minors = values.iter().zip(&changes).skip(nodes);
            let others: f64 = minors.map(|(value, change)| value.abs() + change).sum();
            if least.0 - others - limit * radii[0] - longer * radii[1] >= 0.0 {
                return true;
            }
            // Towards the worst node.
            theta += 0.5 * (least.1 * Complex::new(0.0, -theta).exp()).arg();
        }
        false
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |X| against M |Δ| of a single machine.
    fn judged(x: f64, change: f64, limit: f64) -> CellResult {
        let form = |still: f64, change: f64| Form {
            still: vec![Complex::new(0.0, still)],
            change: vec![Complex::new(0.0, change)],
            bend: vec![Complex::ZERO],
            curved: 0.0,
            other: 0.0,
        };
        let table = Table {
            values: Columns { center: vec![1.0], columns: vec![vec![1.0]], nodes: 1 },
            deviation: vec![0.0],
            monic: vec![1.0],
            monic_deviation: vec![0.0],
            linear: Vec::new(),
            mixed: vec![0.0],
            is_corner: vec![true],
        };
        let seen = |form| Seen::new(form, &table.values);
        shown(&table, &seen(form(3.0, 0.0)), &seen(form(3.0 * x, 3.0 * change)), limit)
    }

    #[test]
    fn a_limit_holds_below_it_and_is_violated_above() {
        for limit in [0.7, 1.6, 4.0] {
            assert!(matches!(judged(limit * (1.0 - 1e-9), 0.0, limit), CellResult::Holds));
            assert!(matches!(judged(limit * (1.0 + 1e-3), 0.0, limit), CellResult::Violated));
            // Within rounding neither is certain.
            assert!(matches!(judged(limit * (1.0 + 1e-8), 0.0, limit), CellResult::TooWide));
            // What changes along the interval counts, too.
            assert!(matches!(judged(0.9 * limit, 0.09 * limit, limit), CellResult::Holds));
            assert!(matches!(judged(0.9 * limit, 0.11 * limit, limit), CellResult::TooWide));
        }
    }
}
