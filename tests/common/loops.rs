//! A sampled loop put together from what steps in time: the axis from the exponential of its matrices, the controller
//! from what one sample makes of each number that it remembers.

use nalgebra::{Complex, DMatrix, DVector, RowDVector, Schur};
use std::f64::consts::PI;
use taut::case::Case;
use taut::control::Stepped;
use taut::linear::{Operation, StateSpace};
use taut::machine::axis::{CART, DRIVE};
use taut::machine::{EncoderPlace, Machine};
use taut::mechanism::State;
use taut::signal::profile::Reference;

type Matrix = DMatrix<f64>;

/// Lines of an encoder so fine that every number is a count.
pub const FINE: f64 = 1e18;

/// Measurements of a controller: the encoder, the scale, the current.
pub const MEASURED: usize = 3;

/// Where the loop is broken: at the command, or at a measurement.
pub const BREAKS: [&str; 4] = ["command", "encoder", "scale", "current"];

/// m⁺ = A m + B w and the command a = C m + D w that follows, of the controller with its delay; the command that acted
/// until then is `old` m. p⁺ = Φ p + Γ_old a_old + Γ_new a of the axis, w = M p + N a_old.
pub struct Loop {
    a: Matrix,
    b: Matrix,
    c: RowDVector<f64>,
    d: RowDVector<f64>,
    old: RowDVector<f64>,
    phi: Matrix,
    gamma: [DVector<f64>; 2],
    measured: Matrix,
    direct: DVector<f64>,
}

/// The margins of a loop at one break.
#[derive(Debug, Clone, Copy)]
pub struct AtBreak {
    /// Where.
    pub name: &'static str,
    /// Ms.
    pub sensitivity: f64,
    /// Mt.
    pub complementary: f64,
    /// Gain margin.
    pub gain: f64,
    /// Phase margin, rad.
    pub phase: f64,
}

impl Loop {
    pub fn new(case: &Case) -> Self {
        let machine = &case.machine;
        // Every number is a count.
        assert!(machine.encoder.iter().chain(&machine.scale).all(|encoder| encoder.lines >= FINE));
        let mut design = case.controller.clone().unwrap();
        design.limit = None;
        let (t, ratio) = (design.every, design.delay / design.every);
        let rest = if (ratio - ratio.round()).abs() < 1e-9 { 0.0 } else { ratio.fract() * t };
        let body = match machine.encoder.unwrap().at {
            EncoderPlace::Cart => CART,
            EncoderPlace::DrivePulley => DRIVE,
            EncoderPlace::Motor => machine.mechanism().drives[0].shaft,
        };
        let length = if body == CART { 1.0 } else { machine.pulley_radius };

        // The controller: one whole sample from each number of its memory and each measurement.
        let mut stepped = Stepped::new(&design, machine).unwrap();
        let sample = |stepped: &mut Stepped, seen: [f64; MEASURED]| -> (Vec<f64>, f64) {
            let mut state = State::default();
            state.position[body] = seen[0] / length;
            if machine.scale.is_some() {
                state.position[CART] = seen[1];
            }
            stepped.decide(&state, &[seen[2]], &[Reference::default()], None);
            if rest > 0.0 {
                stepped.decide(&state, &[seen[2]], &[Reference::default()], None);
            }
            let mut saved = stepped.save();
            saved.pop();
            (saved.into_iter().map(f64::from_bits).collect(), stepped.commands()[0])
        };
        sample(&mut stepped, [0.0; MEASURED]);
        let (begin, k) = (stepped.save(), stepped.save().len() - 1);
        // Numbers that are not zero now tell that something is there; the first that it is between two decisions.
        let own: Vec<usize> = (1..k).filter(|&j| f64::from_bits(begin[j]) == 0.0).collect();
        let mut from = |change: Option<usize>, seen: [f64; MEASURED]| {
            let mut memory = begin.clone();
            if let Some(j) = change {
                memory[j] = 1f64.to_bits();
            }
            stepped.restore(&memory).unwrap();
            let before = stepped.commands()[0];
            let (after, command) = sample(&mut stepped, seen);
            (DVector::from_iterator(own.len(), own.iter().map(|&j| after[j])), command, before)
        };
        let states: Vec<_> = own.iter().map(|&j| from(Some(j), [0.0; MEASURED])).collect();
        let unit = |k: usize| std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        let inputs: Vec<_> = (0..MEASURED).map(|k| from(None, unit(k))).collect();
        let columns = |all: &[(DVector<f64>, f64, f64)]| {
            Matrix::from_columns(&all.iter().map(|one| one.0.clone()).collect::<Vec<_>>())
        };
        let row = |all: &[(DVector<f64>, f64, f64)], pick: fn(&(DVector<f64>, f64, f64)) -> f64| {
            RowDVector::from_iterator(all.len(), all.iter().map(pick))
        };

        // The axis: what is held for the rest of the delay, and then for the rest of the sample.
        let axis = StateSpace::new(&case.machine, Operation::default()).unwrap();
        let n = axis.a.nrows();
        let held = |time: f64| {
            let mut whole = Matrix::zeros(n + 1, n + 1);
            whole.view_mut((0, 0), (n, n)).copy_from(&(&axis.a * time));
            whole.view_mut((0, n), (n, 1)).copy_from(&(&axis.b * time));
            let done = whole.exp();
            (done.view((0, 0), (n, n)).into_owned(), done.view((0, n), (n, 1)).column(0).into_owned())
        };
        let ((early, first), (late, second)) = (held(rest), held(t - rest));
        let angle = if body == CART { "cart_position" } else { sensor(&case.machine, &axis) };
        let outputs = [(angle, length), ("cart_position", 1.0), ("motor_current", 1.0)];
        let mut measured = Matrix::zeros(MEASURED, n);
        let mut direct = DVector::zeros(MEASURED);
        for (k, (name, scale)) in outputs.into_iter().enumerate() {
            let place = axis.output(name).unwrap();
            measured.set_row(k, &(axis.c.row(place) * scale));
            direct[k] = axis.d[place] * scale;
        }
        // What no measurement reaches, an integral without a gain, is no part of the loop.
        let (a, b) = (columns(&states), columns(&inputs));
        let mut reached: Vec<usize> = Vec::new();
        loop {
            let is_new = |i: &usize| {
                !reached.contains(i)
                    && (b.row(*i).iter().any(|v| *v != 0.0) || reached.iter().any(|&j| a[(*i, j)] != 0.0))
            };
            let Some(next) = (0..own.len()).find(is_new) else { break };
            reached.push(next);
        }
        let (c, old) = (row(&states, |one| one.1), row(&states, |one| one.2));
        Self {
            a: a.select_rows(&reached).select_columns(&reached),
            b: b.select_rows(&reached),
            c: c.select_columns(&reached),
            d: row(&inputs, |one| one.1),
            old: old.select_columns(&reached),
            phi: &late * early,
            gamma: [late * first, second],
            measured,
            direct,
        }
    }

    /// Poles of the closed loop, its gain at a break times `gain`.
    pub fn poles(&self, at: usize, gain: f64) -> Vec<Complex<f64>> {
        let (mut gamma, mut measured, mut direct) = (self.gamma.clone(), self.measured.clone(), self.direct.clone());
        match at {
            0 => {
                gamma.iter_mut().for_each(|gamma| *gamma *= gain);
                direct *= gain;
            }
            at => {
                measured.row_mut(at - 1).scale_mut(gain);
                direct[at - 1] *= gain;
            }
        }
        let (m, n) = (self.a.nrows(), self.phi.nrows());
        // w = M p + N old m, a = C m + D w
        let from_memory = &direct * &self.old;
        let command_of_memory = &self.c + &self.d * &from_memory;
        let command_of_axis = &self.d * &measured;
        let mut whole = Matrix::zeros(m + n, m + n);
        whole.view_mut((0, 0), (m, m)).copy_from(&(&self.a + &self.b * &from_memory));
        whole.view_mut((0, m), (m, n)).copy_from(&(&self.b * &measured));
        let [old, new] = &gamma;
        whole.view_mut((m, 0), (n, m)).copy_from(&(old * &self.old + new * command_of_memory));
        whole.view_mut((m, m), (n, n)).copy_from(&(&self.phi + new * command_of_axis));
        eigenvalues(whole)
    }

    /// True if a measurement is used at all.
    fn uses(&self, k: usize) -> bool {
        self.b.column(k).iter().chain([&self.d[k]]).any(|v| *v != 0.0)
    }

    /// The breaks at which the loop is another one.
    fn breaks(&self) -> Vec<usize> {
        let used: Vec<usize> = (0..MEASURED).filter(|&k| self.uses(k)).map(|k| k + 1).collect();
        if used.len() == 1 { vec![0] } else { std::iter::once(0).chain(used).collect() }
    }

    /// The margins at every break, on a grid that is dense about all poles.
    pub fn margins(&self) -> Vec<AtBreak> {
        let mut roots = self.poles(0, 1.0);
        roots.extend(eigenvalues(self.a.clone()));
        roots.extend(eigenvalues(self.phi.clone()));
        let mut grid: Vec<f64> = (0..=250).map(|k| PI * 10f64.powf(-7.0 + 7.0 * f64::from(k) / 250.0)).collect();
        grid.extend((1..100).map(|k| PI * f64::from(k) / 100.0));
        for root in roots.iter().filter(|z| z.norm() > 0.4 && z.im >= 0.0) {
            let (angle, width) = (root.arg(), (1.0 - root.norm()).abs().max(1e-9));
            for k in -16..=16 {
                grid.push(angle + width * f64::from(k).signum() * (1.5f64.powi(i32::abs(k)) - 1.0) * 0.15);
            }
        }
        grid.retain(|theta| *theta > 1e-7 && *theta <= PI);
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        let resolvents = [Resolvent::new(&self.a), Resolvent::new(&self.phi)];
        let at = |theta: f64| self.parts(&resolvents, theta);
        let all: Vec<(f64, [Complex<f64>; MEASURED])> = grid.iter().map(|&theta| (theta, at(theta))).collect();
        self.breaks().into_iter().map(|place| margins(place, &all, &at)).collect()
    }

    /// P_k = −K_k G_k at e^{jθ}.
    fn parts(&self, [own, axis]: &[Resolvent; 2], theta: f64) -> [Complex<f64>; MEASURED] {
        let z = Complex::new(0.0, theta).exp();
        let to = |v: &DVector<f64>| v.map(|v| Complex::new(v, 0.0));
        let [old, new] = &self.gamma;
        let p = axis.apply(z, &[to(old) / z + to(new)]);
        let used: Vec<usize> = (0..MEASURED).filter(|&k| self.uses(k)).collect();
        let columns: Vec<_> = used.iter().map(|&k| to(&self.b.column(k).into_owned())).collect();
        let memory = own.apply(z, &columns);
        let mut parts = [Complex::ZERO; MEASURED];
        for (&k, m) in used.iter().zip(&memory) {
            let g = dot(self.measured.row(k).iter(), &p[0]) + self.direct[k] / z;
            parts[k] = -(dot(self.c.iter(), m) + self.d[k]) * g;
        }
        parts
    }
}

/// The angle that an encoder at the motor or the drive pulley reads.
fn sensor(machine: &Machine, axis: &StateSpace) -> &'static str {
    match machine.encoder.unwrap().at {
        EncoderPlace::Motor if axis.output("rotor_angle").is_some() => "rotor_angle",
        _ => "drive_angle",
    }
}

fn dot<'a>(row: impl Iterator<Item = &'a f64>, column: &DVector<Complex<f64>>) -> Complex<f64> {
    row.zip(column.iter()).map(|(a, b)| b * *a).sum()
}

/// S and L of a break from the P_k.
fn broken(place: usize, parts: &[Complex<f64>; MEASURED]) -> Complex<f64> {
    let sum: Complex<f64> = parts.iter().sum();
    match place {
        0 => sum,
        place => {
            let others: Complex<f64> =
                parts.iter().enumerate().filter(|(k, _)| *k != place - 1).map(|(_, part)| part).sum();
            parts[place - 1] / (others + 1.0)
        }
    }
}

fn margins(
    place: usize,
    all: &[(f64, [Complex<f64>; MEASURED])],
    at: &dyn Fn(f64) -> [Complex<f64>; MEASURED],
) -> AtBreak {
    let l = |theta: f64| broken(place, &at(theta));
    let curve: Vec<(f64, Complex<f64>)> = all.iter().map(|(theta, parts)| (*theta, broken(place, parts))).collect();
    let top = |of: &dyn Fn(Complex<f64>) -> f64| {
        let values: Vec<f64> = curve.iter().map(|(_, l)| of(*l)).collect();
        let mut best = values.iter().copied().fold(0.0, f64::max);
        for k in 1..values.len() - 1 {
            if values[k] >= values[k - 1] && values[k] >= values[k + 1] && values[k] > 0.9 * best {
                let (mut low, mut high) = (curve[k - 1].0, curve[k + 1].0);
                // Thirds of thirds.
                for _ in 0..45 {
                    let third = (high - low) / 3.0;
                    if of(l(low + third)) > of(l(high - third)) { high -= third } else { low += third }
                }
                best = best.max(of(l(0.5 * (low + high))));
            }
        }
        best
    };
    let zero = |pair: &[(f64, Complex<f64>)], of: &dyn Fn(Complex<f64>) -> f64| {
        let (mut low, mut high) = (pair[0].0, pair[1].0);
        let begin = of(pair[0].1) > 0.0;
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if (of(l(middle)) > 0.0) == begin { low = middle } else { high = middle }
        }
        l(0.5 * (low + high))
    };
    let (mut gain, mut phase) = (f64::INFINITY, f64::INFINITY);
    let mut grow = |size: f64| {
        if size > 0.0 && size < 1.0 {
            gain = gain.min(1.0 / size);
        }
    };
    for pair in curve.windows(2) {
        let (a, b) = (pair[0].1, pair[1].1);
        if (a.im > 0.0) != (b.im > 0.0) && a.re < 0.0 && b.re < 0.0 {
            grow(-zero(pair, &|l| l.im).re);
        }
        if (a.norm() > 1.0) != (b.norm() > 1.0) {
            phase = phase.min((-zero(pair, &|l| l.norm() - 1.0)).arg().abs());
        }
    }
    // L is real at half the sampling rate, and at zero frequency where it has a value there.
    let (first, last) = (curve[0].1, curve[curve.len() - 1].1);
    grow(-last.re);
    if first.im.abs() < 1e-5 * first.re.abs() && (curve[1].1.re / first.re - 1.0).abs() < 1e-5 {
        grow(-first.re);
    }
    AtBreak {
        name: BREAKS[place],
        sensitivity: top(&|l| (l + 1.0).inv().norm()),
        complementary: top(&|l| (l / (l + 1.0)).norm()),
        gain,
        phase,
    }
}

/// The eigenvalues; where the QR algorithm does not end, of the matrix with a last digit more.
fn eigenvalues(a: Matrix) -> Vec<Complex<f64>> {
    let (a, _) = balanced(a);
    let tries = [0.0, 1e-15, -1e-15, 3e-15, 1e-14].into_iter();
    let mut found = tries.filter_map(|more| {
        let other =
            Matrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * (1.0 + more * ((3 * i + 7 * j) % 5) as f64));
        Schur::try_new(other, f64::EPSILON, 10_000).map(|schur| schur.complex_eigenvalues().iter().copied().collect())
    });
    found.next().expect("eigenvalues")
}

/// D⁻¹ A D whose rows and columns are as large as each other, by powers of two; D.
fn balanced(mut a: Matrix) -> (Matrix, DVector<f64>) {
    let mut scales = DVector::repeat(a.nrows(), 1.0);
    for _ in 0..20 {
        for i in 0..a.nrows() {
            let size = |v: f64| v.abs();
            let row: f64 = (0..a.ncols()).filter(|j| *j != i).map(|j| size(a[(i, j)])).sum();
            let column: f64 = (0..a.nrows()).filter(|j| *j != i).map(|j| size(a[(j, i)])).sum();
            if row > 0.0 && column > 0.0 {
                let factor = 2f64.powf((0.5 * (row / column).log2()).round());
                a.row_mut(i).unscale_mut(factor);
                a.column_mut(i).scale_mut(factor);
                scales[i] *= factor;
            }
        }
    }
    (a, scales)
}

/// (z I − A)⁻¹ by Hessenberg's form D⁻¹ A D = Q H Qᵀ. Without D, where states are in metres, amperes and whatever a
/// filter keeps, a loop has eight digits, and five about a narrow resonance.
struct Resolvent {
    scales: DVector<f64>,
    q: Matrix,
    h: Matrix,
}

impl Resolvent {
    fn new(a: &Matrix) -> Self {
        let (a, scales) = balanced(a.clone());
        if a.nrows() < 2 {
            return Self { scales, q: Matrix::identity(a.nrows(), a.nrows()), h: a };
        }
        let (q, h) = a.hessenberg().unpack();
        Self { scales, q, h }
    }

    /// (z I − A)⁻¹ b for each b.
    fn apply(&self, z: Complex<f64>, all: &[DVector<Complex<f64>>]) -> Vec<DVector<Complex<f64>>> {
        let n = self.h.nrows();
        let mut rows = self.h.map(|h| Complex::new(-h, 0.0));
        (0..n).for_each(|i| rows[(i, i)] += z);
        let turned = |b: &DVector<Complex<f64>>| -> Vec<Complex<f64>> {
            let b = DVector::from_fn(n, |i, _| b[i] / self.scales[i]);
            (0..n).map(|i| dot(self.q.column(i).iter(), &b)).collect()
        };
        let mut found: Vec<Vec<Complex<f64>>> = all.iter().map(turned).collect();
        for i in 0..n.saturating_sub(1) {
            if rows[(i + 1, i)].norm_sqr() > rows[(i, i)].norm_sqr() {
                rows.swap_rows(i, i + 1);
                found.iter_mut().for_each(|x| x.swap(i, i + 1));
            }
            let factor = rows[(i + 1, i)] / rows[(i, i)];
            for j in i..n {
                let above = rows[(i, j)];
                rows[(i + 1, j)] -= factor * above;
            }
            for x in &mut found {
                let above = x[i];
                x[i + 1] -= factor * above;
            }
        }
        let solved = |mut x: Vec<Complex<f64>>| {
            for i in (0..n).rev() {
                let known: Complex<f64> = (i + 1..n).map(|j| rows[(i, j)] * x[j]).sum();
                x[i] = (x[i] - known) / rows[(i, i)];
            }
            let x = DVector::from_vec(x);
            DVector::from_fn(n, |i, _| dot(self.q.row(i).iter(), &x) * self.scales[i])
        };
        found.into_iter().map(solved).collect()
    }
}
