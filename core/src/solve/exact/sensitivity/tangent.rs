//! Tangent of a mode: derivatives of its equations, guards and outputs with respect to each variable.

use super::super::ModeMatrices;
use super::super::matrices::{Space, straight};
use crate::friction::Motion;
use crate::mechanism::{Form, Mechanism, Mode, Shown, State};
use crate::solve::coordinates::Coordinates;
use crate::solve::followed::Differentiated;
use crate::solve::propagator::{Columns, Matrix, SlopedStep};
use std::sync::Arc;

/// Differences up to this multiple of the rounding of their terms count as zero.
const ROUNDINGS: f64 = 16.0;

/// Maximum number of distances between rows and input changes that have matrices; with more of them, the changes are
/// irregular.
const DISTANCES: usize = 6;

/// Relative difference of equal distances.
const SAME: f64 = 1e-11;

/// A machine with positions counted from the start of its run.
pub(super) struct RelativeMachine {
    pub(super) mechanism: Arc<Mechanism>,
    pub(super) space: Space,
    pub(super) coordinates: Coordinates,
    pub(super) inner: State,
}

impl RelativeMachine {
    pub(super) fn new(mechanism: &Arc<Mechanism>, start: &State, space: Space) -> Self {
        let (coordinates, inner) = Coordinates::new(&space.layout, start);
        Self { mechanism: mechanism.seen_by(&space.layout, start), space, coordinates, inner }
    }
}

/// A variable of the machine: the machine at two other values of it.
pub(super) struct Varied {
    /// The machines as they were given, counted from zero.
    pub(super) machines: [Arc<Mechanism>; 2],
    pub(super) points: [RelativeMachine; 2],
    pub(super) weights: [f64; 3],
    /// True if the start alone differs, and so neither equations nor guards do.
    pub(super) is_start: bool,
}

impl Varied {
    /// Σ wᵢ times the same number of each machine; zero if it differs by rounding alone.
    pub(super) fn slope(&self, here: f64, first: f64, second: f64) -> f64 {
        let [a, b, c] = self.weights;
        let terms = [a * here, b * first, c * second];
        let (sum, size) = (terms.iter().sum::<f64>(), terms.iter().map(|term| term.abs()).sum::<f64>());
        if sum.abs() <= ROUNDINGS * f64::EPSILON * size { 0.0 } else { sum }
    }

    fn row<const N: usize>(&self, here: &[f64; N], first: &[f64; N], second: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|k| self.slope(here[k], first[k], second[k]))
    }

    fn rows<const N: usize>(&self, here: &[[f64; N]], first: &[[f64; N]], second: &[[f64; N]]) -> Vec<Sparse> {
        let rows = here.iter().zip(first).zip(second);
        rows.map(|((here, first), second)| Sparse::new(self.row(here, first, second))).collect()
    }
}

/// A sparse row: indices of z with weights.
pub(super) struct Sparse(Vec<(usize, f64)>);

impl Sparse {
    fn new<const N: usize>(row: [f64; N]) -> Self {
        Self(row.into_iter().enumerate().filter(|(_, weight)| *weight != 0.0).collect())
    }

    /// Its value.
    #[inline]
    pub(super) fn times<const N: usize>(&self, z: &[f64; N]) -> f64 {
        self.0.iter().fold(0.0, |sum, (place, weight)| sum + weight * z[*place])
    }
}

/// Derivatives of the equations of one mode with respect to the variables of the machine, for all its runs.
pub(in crate::solve::exact) struct Sloped<const N: usize> {
    pub(super) law: Arc<ModeMatrices<N>>,
    /// The machines at the points of each variable's differences, and the weights of the points.
    of: Vec<([Arc<Mechanism>; 2], [f64; 3])>,
    /// A_p of each variable.
    pub(super) slopes: Vec<Columns<N>>,
    /// g_p by variable and guard.
    guards: Vec<Vec<Sparse>>,
    /// Repeated steps, the number of their uses before they got matrices, and the matrices.
    steps: Vec<(f64, u32, Option<SlopedStep<N>>)>,
}

impl<const N: usize> Sloped<N> {
    /// Derivatives of the mode of `law`, known or new; `None` if a variable changes the guards of the mode.
    pub(super) fn from_known(
        known: &mut Vec<Self>,
        law: &Arc<ModeMatrices<N>>,
        seen: &RelativeMachine,
        machines: &[&Varied],
    ) -> Option<usize> {
        let same = |(own, weights): &([Arc<Mechanism>; 2], [f64; 3]), varied: &&Varied| {
            let pairs = own.iter().zip(&varied.machines);
            *weights == varied.weights && pairs.into_iter().all(|(a, b)| Arc::ptr_eq(a, b) || a == b)
        };
        let fits = |known: &Self| {
            Arc::ptr_eq(&known.law, law)
                && known.of.len() == machines.len()
                && known.of.iter().zip(machines).all(|(own, varied)| same(own, varied))
        };
        if let Some(index) = known.iter().position(fits) {
            return Some(index);
        }
        known.push(Self::new(law, seen, machines)?);
        Some(known.len() - 1)
    }

    fn new(law: &Arc<ModeMatrices<N>>, seen: &RelativeMachine, machines: &[&Varied]) -> Option<Self> {
        let here = Equated::<N>::new(seen, &law.mode);
        let (mut slopes, mut guards) = (Vec::new(), Vec::new());
        for varied in machines {
            let [first, second] = varied.points.each_ref().map(|point| Equated::<N>::new(point, &law.mode));
            if first.guards.len() != here.guards.len() || second.guards.len() != here.guards.len() {
                return None;
            }
            let columns = (0..N).map(|column| {
                let of = |rate: &Matrix<N, N>| std::array::from_fn(|row| rate.at(row, column));
                (column, varied.row(&of(&here.rate), &of(&first.rate), &of(&second.rate)))
            });
            slopes.push(Columns(columns.filter(|(_, column): &(_, [f64; N])| *column != [0.0; N]).collect()));
            guards.push(varied.rows(&here.guards, &first.guards, &second.guards));
        }
        let of = machines.iter().map(|varied| (varied.machines.clone(), varied.weights)).collect();
        Some(Self { law: Arc::clone(law), of, slopes, guards, steps: Vec::new() })
    }

    /// ∂g/∂p of a guard with respect to a variable, at the present state.
    pub(super) fn guard_slope(&self, variable: usize, guard: usize, z: &[f64; N]) -> f64 {
        self.guards.get(variable).map_or(0.0, |guards| guards[guard].times(z))
    }

    /// The matrices for this distance, if it occurs repeatedly.
    pub(super) fn step(&mut self, distance: f64) -> Option<&SlopedStep<N>> {
        let same = |(own, ..): &(f64, u32, _)| (own - distance).abs() <= SAME * distance;
        let index = self.steps.iter().position(same).or_else(|| {
            (self.steps.len() < DISTANCES).then(|| {
                self.steps.push((distance, 0, None));
                self.steps.len() - 1
            })
        })?;
        let (distance, count, step) = &mut self.steps[index];
        *count += 1;
        if step.is_none() && *count > FEW {
            *step = Some(self.law.rates().sloped_step(&self.slopes, *distance, self.law.speed()));
        }
        step.as_ref()
    }
}

/// Outputs of one run as forms of z in one mode, with their derivatives with respect to the variables.
pub(super) struct Tangent {
    /// Index of the mode among the known ones.
    pub(super) sloped: usize,
    /// The rows of the outputs.
    pub(super) outputs: Vec<Sparse>,
    /// Their derivatives that are not zero, with output and variable.
    pub(super) output_slopes: Vec<(usize, usize, Sparse)>,
}

impl Tangent {
    /// Tangent of a mode; `None` if an output is not linear in z.
    pub(super) fn new<const N: usize>(
        sloped: usize,
        mode: &Mode,
        seen: &RelativeMachine,
        variables: &[Option<Varied>],
        outputs: &[Differentiated],
    ) -> Option<Self> {
        let rows = |seen: &RelativeMachine| {
            outputs.iter().map(|output| row::<N>(seen, mode, *output)).collect::<Option<Vec<_>>>()
        };
        let here = rows(seen)?;
        let mut output_slopes = Vec::new();
        for (j, varied) in variables.iter().enumerate() {
            let Some(varied) = varied else { continue };
            let slopes = varied.rows(&here, &rows(&varied.points[0])?, &rows(&varied.points[1])?);
            let some = slopes.into_iter().enumerate().filter(|(_, slope)| !slope.0.is_empty());
            output_slopes.extend(some.map(|(i, slope)| (i, j, slope)));
        }
        Some(Self { sloped, outputs: here.into_iter().map(Sparse::new).collect(), output_slopes })
    }
}

/// Number of times that a distance is crossed by series before matrices are computed for it.
const FEW: u32 = 4;

/// One machine in one mode: A, and the guards as rows of weights.
struct Equated<const N: usize> {
    rate: Matrix<N, N>,
    guards: Vec<[f64; N]>,
}

impl<const N: usize> Equated<N> {
    fn new(seen: &RelativeMachine, mode: &Mode) -> Self {
        let (equations, rate) = straight::<N>(&seen.mechanism, &seen.space, mode);
        Self { rate, guards: equations.guards.iter().map(|guard| seen.space.row(&guard.form)).collect() }
    }
}

/// An output as a linear form of z; `None` if it is not linear.
fn row<const N: usize>(seen: &RelativeMachine, mode: &Mode, output: Differentiated) -> Option<[f64; N]> {
    let (mechanism, space) = (&seen.mechanism, &seen.space);
    let scaled = |mut row: [f64; N], factor: f64| {
        row.iter_mut().for_each(|weight| *weight *= factor);
        row
    };
    let shown = match output {
        // A stuck body has no acceleration.
        Differentiated::Acceleration(body) if mode.motion[body] == Motion::Stuck => return Some([0.0; N]),
        Differentiated::Acceleration(body) => {
            let (equations, _) = straight::<N>(mechanism, space, mode);
            return Some(space.row(&equations.acceleration[body]));
        }
        Differentiated::Shown(shown) => shown,
    };
    Some(match shown {
        Shown::Position(body, factor) => {
            let (weights, constant) = seen.coordinates.way(&space.layout, body);
            let mut row = [0.0; N];
            for other in 0..space.layout.bodies() {
                row[space.layout.coordinate[other]] = factor * weights[other];
            }
            row[N - 1] = factor * constant;
            row
        }
        Shown::Speed(body, factor) => scaled(space.row(&Form::speed(body)), factor),
        Shown::Stretch(spring) => space.row(&Form::stretch(spring)),
        Shown::Force(spring, factor) => scaled(space.row(&mechanism.spring_force(spring, mode)), factor),
        Shown::Current(drive) => space.row(&mechanism.current(drive, mode)),
        Shown::Voltage(drive) => space.row(&mechanism.voltage(drive, mode)),
        Shown::Input(drive) => space.row(&Form::input(drive)),
        Shown::Time
        | Shown::SecondPhase(_)
        | Shown::Friction(_)
        | Shown::Motion(_)
        | Shown::Bristle(_)
        | Shown::Contact(_)
        | Shown::Counts(..) => return None,
    })
}

/// True if two machines have the same parts, so that differences between them are derivatives.
pub(super) fn are_alike(a: &RelativeMachine, b: &RelativeMachine) -> bool {
    use std::mem::discriminant;
    let (own, other) = (&a.mechanism, &b.mechanism);
    let bodies = own.bodies.len() == other.bodies.len()
        && (0..own.bodies.len())
            .all(|body| own.has_modes(body) == other.has_modes(body) && own.leader(body) == other.leader(body));
    let springs = own.springs.len() == other.springs.len()
        && own.springs.iter().zip(&other.springs).all(|(a, b)| discriminant(&a.law) == discriminant(&b.law));
    let drives = own.drives.iter().zip(&other.drives).all(|(a, b)| {
        a.loses() == b.loses()
            && a.has_rotor() == b.has_rotor()
            && a.amplifier.voltage_limit.is_some() == b.amplifier.voltage_limit.is_some()
            && a.amplifier.current_limit.is_some() == b.amplifier.current_limit.is_some()
    });
    let places =
        |seen: &RelativeMachine| (seen.space.layout.states, seen.space.layout.coordinate, seen.space.layout.speed);
    bodies && springs && drives && places(a) == places(b) && other.is_piecewise_linear()
}
