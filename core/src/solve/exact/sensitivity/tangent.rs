//! Tangent of a mode: derivatives of its equations, guards and outputs with respect to each variable.

use super::super::ModeMatrices;
use super::super::matrices::Space;
use crate::friction::Motion;
use crate::mechanism::{BODIES, Cause, Drive, Form, Layout, Mechanism, Mode, Shown, State};
use crate::solve::coordinates::Coordinates;
use crate::solve::followed::Differentiated;
use crate::solve::propagator::{Columns, SlopedStep};
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
        if here == first && here == second {
            return [0.0; N];
        }
        std::array::from_fn(|k| self.slope(here[k], first[k], second[k]))
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

    /// Adds its values of one `z` after the other.
    pub(super) fn add_along<'z, const N: usize>(
        &self,
        z: impl Iterator<Item = &'z [f64; N]> + Clone,
        values: &mut [f64],
    ) {
        for &(place, weight) in &self.0 {
            values.iter_mut().zip(z.clone()).for_each(|(value, z)| *value += weight * z[place]);
        }
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
    /// Number among the `known` of the derivatives of the mode of `law`, by these variables that change the equations.
    pub(super) fn find(known: &[Self], law: &Arc<ModeMatrices<N>>, machines: &[&Varied]) -> Option<usize> {
        let same = |(own, weights): &([Arc<Mechanism>; 2], [f64; 3]), varied: &&Varied| {
            let pairs = own.iter().zip(&varied.machines);
            *weights == varied.weights && pairs.into_iter().all(|(a, b)| Arc::ptr_eq(a, b) || a == b)
        };
        let fits = |known: &Self| {
            Arc::ptr_eq(&known.law, law)
                && known.of.len() == machines.len()
                && known.of.iter().zip(machines).all(|(own, varied)| same(own, varied))
        };
        known.iter().position(fits)
    }

    /// The derivatives of the mode of `law`, from those of its bodies' motions; `None` if these do not have its guards.
    pub(super) fn new(law: &Arc<ModeMatrices<N>>, variables: &[Option<Varied>], bodies: &Bodies<N>) -> Option<Self> {
        let (mut of, mut slopes, mut guards) = (Vec::new(), Vec::new(), Vec::new());
        let places = bodies.guards(law)?;
        for (j, varied) in variables.iter().enumerate() {
            let Some(varied) = varied.as_ref().filter(|varied| !varied.is_start) else { continue };
            of.push((varied.machines.clone(), varied.weights));
            slopes.push(bodies.slopes_of_rates(j));
            let row = |(body, place): &(usize, usize)| bodies.moving(bodies.rows(*body, Some(j))[*place]);
            guards.push(places.iter().map(|guard| Sparse::new(row(guard))).collect());
        }
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
    /// Tangent of a mode, from those of its bodies' motions.
    pub(super) fn new<const N: usize>(sloped: usize, outputs: &[Differentiated], bodies: &Bodies<N>) -> Self {
        let all = |of: Option<usize>| (0..outputs.len()).map(move |i| (i, Sparse::new(bodies.output(outputs, i, of))));
        let slopes = |j| all(Some(j)).filter(|(_, slope)| !slope.0.is_empty()).map(move |(i, slope)| (i, j, slope));
        let output_slopes = bodies.variables().flat_map(slopes).collect();
        Self { sloped, outputs: all(None).map(|(_, row)| row).collect(), output_slopes }
    }
}

/// Number of times that a distance is crossed by series before matrices are computed for it.
const FEW: u32 = 4;

/// Rows of weights of z of one machine in one mode: rates of the states in their order, guards, and outputs. Speeds of
/// stuck bodies, which are zero, count.
struct Rows<const N: usize> {
    all: Vec<[f64; N]>,
    /// Of the guards.
    causes: Vec<Cause>,
}

impl<const N: usize> Rows<N> {
    /// `None` if an output is not linear in z.
    fn new(seen: &RelativeMachine, mode: &Mode, outputs: &[Differentiated]) -> Option<Self> {
        let (layout, equations) = (&seen.space.layout, seen.mechanism.equations(*mode));
        let row = |form: &Form| seen.space.row::<N>(form);
        let mut all = Vec::with_capacity(layout.states + equations.guards.len() + outputs.len());
        all.resize(layout.states, [0.0; N]);
        for body in 0..layout.bodies() {
            all[layout.speed[body]] = row(&equations.acceleration[body]);
            all[layout.coordinate[body]] = row(&layout.rate(&seen.mechanism, body));
        }
        for (place, rate) in layout.current.iter().zip(&equations.current_rate) {
            place.iter().for_each(|place| all[*place] = row(rate));
        }
        all.extend(equations.guards.iter().map(|guard| row(&guard.form)));
        for output in outputs {
            all.push(match *output {
                Differentiated::Acceleration(body) => all[layout.speed[body]],
                Differentiated::Shown(shown) => shown_row(seen, mode, shown)?,
            });
        }
        Some(Self { all, causes: equations.guards.iter().map(|guard| guard.transition.cause).collect() })
    }

    /// Their derivatives by a variable, from those at its points; `None` if it changes the guards.
    fn slopes(&self, varied: &Varied, [first, second]: [&Self; 2]) -> Option<Vec<[f64; N]>> {
        let rows = self.all.iter().zip(&first.all).zip(&second.all);
        let slopes = rows.map(|((here, first), second)| varied.row(here, first, second));
        let same = first.causes == self.causes && second.causes == self.causes;
        same.then(|| slopes.collect())
    }
}

/// The rows of a machine in a mode in which all bodies have one motion, with their derivatives.
///
/// A body's equation depends on its own motion alone, unless a lossy gear is there: the derivatives of any mode are put
/// together from a few such modes.
struct Alike<const N: usize> {
    mode: Mode,
    rows: Rows<N>,
    /// The derivatives of all rows, by variable; `None` for a variable of the input.
    slopes: Vec<Option<Vec<[f64; N]>>>,
}

/// A mode of a run with the rows of each of its bodies.
pub(super) struct Bodies<'f, const N: usize> {
    alike: [&'f Alike<N>; BODIES],
    layout: &'f Layout,
    mode: &'f Mode,
}

/// The derivatives of the modes of a run, by the motion of bodies.
pub(super) struct Families<const N: usize>(Vec<Alike<N>>);

impl<const N: usize> Families<N> {
    pub(super) fn new() -> Self {
        Self(Vec::new())
    }

    /// The rows of a mode; `None` if an output is not linear in z, or a variable changes the guards.
    pub(super) fn of<'f>(
        &'f mut self,
        mode: &'f Mode,
        seen: &'f RelativeMachine,
        variables: &[Option<Varied>],
        outputs: &[Differentiated],
    ) -> Option<Bodies<'f, N>> {
        let (mechanism, layout) = (&seen.mechanism, &seen.space.layout);
        let loses = mechanism.drives.iter().any(Drive::loses);
        let mut places = [0; BODIES];
        for (body, place) in places.iter_mut().enumerate().take(layout.bodies()) {
            let mut wanted = *mode;
            if !loses {
                wanted.motion = [mode.motion[mechanism.leader(body)]; BODIES];
            }
            *place = match self.0.iter().position(|alike| alike.mode == wanted) {
                Some(known) => known,
                None => {
                    self.0.push(Alike::new(wanted, seen, variables, outputs)?);
                    self.0.len() - 1
                }
            };
        }
        Some(Bodies { alike: places.map(|place| &self.0[place]), layout, mode })
    }
}

impl<const N: usize> Alike<N> {
    fn new(
        mode: Mode,
        seen: &RelativeMachine,
        variables: &[Option<Varied>],
        outputs: &[Differentiated],
    ) -> Option<Self> {
        let rows = Rows::new(seen, &mode, outputs)?;
        let mut slopes = Vec::with_capacity(variables.len());
        for varied in variables {
            slopes.push(match varied {
                None => None,
                Some(varied) => {
                    let [first, second] = varied.points.each_ref().map(|point| Rows::new(point, &mode, outputs));
                    Some(rows.slopes(varied, [&first?, &second?])?)
                }
            });
        }
        Some(Self { mode, rows, slopes })
    }
}

impl<'f, const N: usize> Bodies<'f, N> {
    fn is_stuck(&self, body: usize) -> bool {
        self.mode.motion[body] == Motion::Stuck
    }

    /// A row without speeds of stuck bodies.
    fn moving(&self, mut row: [f64; N]) -> [f64; N] {
        let stuck = (0..self.layout.bodies()).filter(|&body| self.is_stuck(body));
        stuck.for_each(|body| row[self.layout.speed[body]] = 0.0);
        row
    }

    /// The numbers of the variables of machine and start.
    fn variables(&self) -> impl Iterator<Item = usize> + use<'f, N> {
        self.alike[0].slopes.iter().enumerate().filter(|(_, slopes)| slopes.is_some()).map(|(j, _)| j)
    }

    /// The rows of a body, or their derivatives by a variable.
    fn rows(&self, body: usize, variable: Option<usize>) -> &'f [[f64; N]] {
        let alike = self.alike[body];
        variable.map_or(&alike.rows.all, |j| alike.slopes[j].as_deref().unwrap_or(&[]))
    }

    /// A_p
    fn slopes_of_rates(&self, variable: usize) -> Columns<N> {
        let mut slope = [[0.0; N]; N];
        let mut put = |place: usize, body: usize| {
            let row = self.rows(body, Some(variable))[place];
            if row != [0.0; N] {
                slope.iter_mut().zip(self.moving(row)).for_each(|(column, value)| column[place] = value);
            }
        };
        for body in 0..self.layout.bodies() {
            if !self.is_stuck(body) {
                put(self.layout.speed[body], body);
            }
            put(self.layout.coordinate[body], body);
        }
        self.layout.current.iter().flatten().for_each(|place| put(*place, 0));
        Columns(slope.into_iter().enumerate().filter(|(_, column)| *column != [0.0; N]).collect())
    }

    /// Where the rows of the guards of a mode are, in their order: a body, and the place among its rows; `None` if its
    /// motion alone does not have them.
    fn guards(&self, law: &ModeMatrices<N>) -> Option<Vec<(usize, usize)>> {
        let causes: Vec<Cause> = law.guards.iter().map(|guard| guard.transition.cause).collect();
        let of = |(number, cause): (usize, &Cause)| {
            let body = cause.body().unwrap_or(0);
            // Both sides of a spring that leaves its bounds have one cause: they are told apart by their order.
            let before = causes[..number].iter().filter(|other| *other == cause).count();
            let mut same = self.alike[body].rows.causes.iter().enumerate().filter(|(_, own)| *own == cause);
            same.nth(before).map(|(number, _)| (body, self.layout.states + number))
        };
        causes.iter().enumerate().map(of).collect()
    }

    /// An output, or its derivative by a variable.
    fn output(&self, outputs: &[Differentiated], number: usize, variable: Option<usize>) -> [f64; N] {
        let row = |body| {
            let rows = self.rows(body, variable);
            rows[rows.len() - outputs.len() + number]
        };
        match outputs[number] {
            // A stuck body has no acceleration.
            Differentiated::Acceleration(body) if self.is_stuck(body) => [0.0; N],
            Differentiated::Acceleration(body) => self.moving(row(body)),
            Differentiated::Shown(_) => row(0),
        }
    }
}

/// A quantity as a linear form of z; `None` if it is not linear.
fn shown_row<const N: usize>(seen: &RelativeMachine, mode: &Mode, shown: Shown) -> Option<[f64; N]> {
    let (mechanism, space) = (&seen.mechanism, &seen.space);
    let scaled = |mut row: [f64; N], factor: f64| {
        row.iter_mut().for_each(|weight| *weight *= factor);
        row
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
