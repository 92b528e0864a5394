//! Sensitivities of a run of the exact solver: S = ∂z/∂p beside z, through the same modes and the same events.
//!
//! ```text
//! in a mode            ż = A z,   Ṡ = A S + A_p z
//! over a step          S ← S + P S + L z                           L = ∂P/∂p (propagator/slopes.rs)
//! where a guard falls  w·z = 0 at t*:   dt*/dp = −(w·S + w_p·z)/(w·f⁻)
//!                      S⁺ = S⁻ + (f⁻ − f⁺) dt*/dp                  f = A z before, and in the last of the modes
//!                                                                  that follow each other at that instant
//! where the input is   S⁺ = S⁻ + (f⁻ − f⁺) dt/dp                   dt/dp = 1 by a delay, 0 by all else
//! at the start         S = ∂z₀/∂p
//! an output y = c·z    ∂y/∂p = c·S + c_p·z
//! ```
//!
//! The state is continuous at mode changes: a stopping body already has zero speed, and a limited current is already at
//! its limit. So the jump of S needs no other term. In w·f⁻ the input counts with its own rate, since z has the inputs
//! in it.

mod tangent;

use super::run::locate;
use super::{Core, Make, ModeMatrices, vector};
use crate::friction::Motion;
use crate::mechanism::{DRIVES, Transition};
use crate::solve::followed::{Begun, Sensitivities, Task, Variable};
use crate::solve::inputs::Pieces;
use crate::solve::known::Known;
use crate::solve::propagator::Series;
use crate::trajectory::Grid;
use std::sync::Arc;
pub(super) use tangent::Sloped;
use tangent::{Families, RelativeMachine, Tangent, Varied, are_alike};

/// A guard whose rate is at most this multiple of its rounding only grazes.
const GRAZES: f64 = 1e5;

/// Number of rows whose outputs are written together.
const HELD: usize = 32;

/// Change of a rate, in roundings, that does not count as a jump.
const NO_JUMP: f64 = 40.0;

/// Makes the sensitivities of one run: see [`Task`].
pub(in crate::solve) struct Following<'t> {
    pub(in crate::solve) task: Task<'t>,
    pub(in crate::solve) known: &'t mut Known,
}

impl Make for Following<'_> {
    type Made = Option<Sensitivities>;

    fn make<const N: usize>(self) -> Self::Made {
        let known = std::mem::take(self.known.list::<Arc<ModeMatrices<N>>>());
        let slopes = std::mem::take(self.known.list::<Sloped<N>>());
        let mut follower = Follower::<N>::new(self.task, known, slopes)?;
        let reached = follower.take_up().and_then(|()| follower.along());
        *self.known.list() = std::mem::take(&mut follower.core.known);
        *self.known.list() = std::mem::take(&mut follower.slopes);
        let is_finite = || follower.out.columns.iter().flatten().flatten().all(|value| value.is_finite());
        (reached.is_some() && is_finite()).then_some(follower.out)
    }
}

/// A run in progress with its sensitivities.
struct Follower<'t, const N: usize> {
    task: Task<'t>,
    core: Core<N>,
    grid: Grid,
    row: u64,
    /// Number of rows output so far.
    rows: u64,
    /// z and S at the last of them, in the present mode, whose outputs are not written yet.
    held: Vec<[f64; N]>,
    seen: RelativeMachine,
    /// By variable; `None` for a variable of the input.
    varied: Vec<Option<Varied>>,
    /// Indices of the variables in `s`, those that change the equations first.
    places: Vec<usize>,
    s: Vec<[f64; N]>,
    /// The inputs, before the first change at zero.
    inputs: Pieces,
    /// Jumps of S by later changes of the input, one for each delay, if the change falls on the next row.
    pending: Vec<Later<N>>,
    /// Modes of this machine with their derivatives, and the tangents of this run.
    slopes: Vec<Sloped<N>>,
    families: Families<N>,
    tangents: Vec<Tangent>,
    /// The number of the present mode among them.
    now: usize,
    series: Box<Series<N>>,
    /// True at a row or at a change of the input.
    is_regular: bool,
    out: Sensitivities,
}

impl<'t, const N: usize> Follower<'t, N> {
    fn new(task: Task<'t>, known: super::Modes<N>, slopes: Vec<Sloped<N>>) -> Option<Self> {
        let Task { mechanism, experiment, variables, outputs } = task;
        let grid = Grid::new(experiment.every, experiment.until);
        let start = mechanism.begun(&experiment.initial);
        let seen = RelativeMachine::new(mechanism, &start, task.space(mechanism));
        let ends = (grid.interval(), grid.end());
        let mut core = Core::new(Arc::clone(&seen.mechanism), Arc::new(task.space(mechanism)), &start, ends, known);
        core.errors = None;
        let of = |begun: &Begun| RelativeMachine::new(&begun.mechanism, &begun.start, task.space(&begun.mechanism));
        let mut varied = Vec::new();
        for variable in variables {
            varied.push(match variable {
                Variable::Machine { points, weights } => {
                    let machines = points.each_ref().map(|point| Arc::clone(&point.mechanism));
                    let points = points.each_ref().map(of);
                    if !points.iter().all(|point| are_alike(&seen, point)) {
                        return None;
                    }
                    let is_start = points.iter().all(|point| point.mechanism == seen.mechanism);
                    Some(Varied { machines, points, weights: *weights, is_start })
                }
                Variable::Delay { .. } | Variable::Offset { .. } => None,
            });
        }
        let changes = |j: &usize| varied[*j].as_ref().is_some_and(|varied: &Varied| !varied.is_start);
        let (first, rest): (Vec<usize>, Vec<usize>) = (0..varied.len()).partition(changes);
        let order: Vec<usize> = first.into_iter().chain(rest).collect();
        let mut places = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &j)| places[j] = place);
        let begun = |j: &usize| varied[*j].as_ref().map_or([0.0; N], |varied| begin(&seen, varied));
        let s = order.iter().map(begun).collect();
        let rows = grid.intervals() as usize + 1;
        let columns = vec![vec![vec![0.0; rows]; variables.len()]; outputs.len()];
        let series = Box::new(Series::room());
        let values = vec![vec![0.0; rows]; outputs.len()];
        let out = Sensitivities { values, columns, events: 0 };
        let (row, now) = (0, 0);
        Some(Self {
            task,
            core,
            grid,
            row,
            rows: 0,
            held: Vec::new(),
            seen,
            varied,
            places,
            s,
            inputs: Pieces::held(&[0.0; DRIVES], 0.0, f64::INFINITY),
            pending: Vec::new(),
            slopes,
            families: Families::new(),
            tangents: Vec::new(),
            now,
            series,
            is_regular: true,
            out,
        })
    }

    /// Runs to the end along the input of the experiment.
    fn along(&mut self) -> Option<()> {
        let signals = &self.task.experiment.inputs[..];
        let mut time = 0.0;
        loop {
            let pieces = Pieces::new(signals, time);
            self.seam(&pieces)?;
            if time >= self.grid.end() {
                break;
            }
            let until = pieces.end.min(self.grid.end());
            let (row, offset) = locate(&self.grid, self.row, until);
            self.reach(row, offset)?;
            time = time.max(until);
        }
        // After a last, shorter interval the run is at the last row, too.
        self.go_to(self.grid.intervals());
        self.put_out();
        self.write();
        Some(())
    }

    /// Sets new inputs and settles the mode changes that they cause at once.
    fn seam(&mut self, pieces: &Pieces) -> Option<()> {
        let delays = self.task.variables.iter().zip(&self.places).filter_map(|(variable, &place)| match *variable {
            Variable::Delay { drive, unit } => Some(Later { place, drive, unit, jump: self.earlier(pieces, drive) }),
            _ => None,
        });
        let mut pending: Vec<Later<N>> = delays.collect();
        self.core.set_input(pieces);
        self.core.resolve();
        self.take_up()?;
        self.is_regular = true;
        self.inputs = *pieces;
        let begins = self.core.time();
        self.offset(begins);
        rest(&self.core, &mut self.s);
        if !pending.is_empty() {
            let after = self.core.matrices.rate(&self.core.z);
            for later in &mut pending {
                later.jump.iter_mut().zip(after).for_each(|(before, after)| *before -= after);
            }
            self.pending = pending;
            if self.core.common.offset != 0.0 || self.row < self.rows {
                self.move_seam();
            }
        }
        Some(())
    }

    /// ż between a change of the inputs and the later change of this drive's, or of all.
    fn earlier(&self, pieces: &Pieces, drive: Option<usize>) -> [f64; N] {
        let is_start = self.row == 0 && self.core.common.offset == 0.0;
        if drive.is_none() && !is_start {
            return self.core.matrices.rate(&self.core.z);
        }
        // With a delay, an input that begins at once is zero at first.
        let (mut earlier, before) = (*pieces, self.inputs.since(pieces.start));
        match drive {
            None => earlier.coefficients = before.coefficients,
            Some(drive) => earlier.coefficients[drive] = before.coefficients[drive],
        }
        let mut core = self.core.clone();
        core.set_input(&earlier);
        core.resolve();
        core.matrices.rate(&core.z)
    }

    /// ∂u/∂p of an offset of the input.
    fn offset(&mut self, time: f64) {
        let space = &self.core.common.space;
        for (variable, &place) in self.task.variables.iter().zip(&self.places) {
            if let Variable::Offset { drive, unit, from } = *variable {
                self.s[place][space.chain(drive, 0)] = if time >= from { unit } else { 0.0 };
            }
        }
    }

    /// Jumps of the derivatives by delays at the present change of the input.
    fn move_seam(&mut self) {
        if self.pending.is_empty() {
            return;
        }
        let (space, z) = (&self.core.common.space, &self.core.z);
        for Later { place, drive, unit, jump } in self.pending.drain(..) {
            let s = &mut self.s[place];
            let mut moved = jump;
            let is_of_inputs = |input: usize| (0..=space.highest).map(move |k| (input, k));
            for (input, k) in (0..space.layout.inputs).flat_map(is_of_inputs) {
                // Their values from now on: u(t − d).
                let (at, is_later) = (space.chain(input, k), drive.is_none_or(|drive| drive == input));
                let next = if k < space.highest { z[space.chain(input, k + 1)] } else { 0.0 };
                s[at] = if is_later { -unit * next } else { 0.0 };
                moved[at] = 0.0;
            }
            s.iter_mut().zip(moved).for_each(|(s, jump)| *s += unit * jump);
        }
        rest(&self.core, &mut self.s);
    }

    /// Switches to the derivatives of the present mode.
    fn take_up(&mut self) -> Option<()> {
        if self.core.common.rules.trouble.is_some() {
            return None;
        }
        let law = Arc::clone(&self.core.matrices);
        let of = |tangent: &Tangent| Arc::ptr_eq(&self.slopes[tangent.sloped].law, &law);
        if self.tangents.get(self.now).is_some_and(of) {
            return Some(());
        }
        let known = self.tangents.iter().position(of);
        self.write();
        self.now = match known {
            Some(known) => known,
            None => {
                let bodies = self.families.of(&law.mode, &self.seen, &self.varied, self.task.outputs)?;
                let changes = self.varied.iter().flatten().filter(|varied| !varied.is_start).collect::<Vec<_>>();
                let sloped = match Sloped::find(&self.slopes, &law, &changes) {
                    Some(known) => known,
                    None => {
                        self.slopes.push(Sloped::new(&law, &self.varied, &bodies)?);
                        self.slopes.len() - 1
                    }
                };
                self.tangents.push(Tangent::new(sloped, self.task.outputs, &bodies));
                self.tangents.len() - 1
            }
        };
        Some(())
    }

    /// Advances to `offset` after row `row`, event by event.
    fn reach(&mut self, row: u64, offset: f64) -> Option<()> {
        while self.row < row || (self.row == row && self.core.common.offset < offset) {
            self.core.check();
            let mut looked = false;
            if self.core.common.offset == 0.0 {
                self.put_out();
                if self.row < row {
                    let law = Arc::clone(&self.core.matrices);
                    let (safe, _) = self.core.safe_intervals(&law, row - self.row);
                    (0..safe).for_each(|_| self.cross_row());
                    if safe > 0 {
                        continue;
                    }
                    looked = true;
                }
            }
            let ahead = if self.row < row { self.grid.interval() } else { offset };
            let (begin, from) = (self.core.z, self.core.common.offset);
            let fallen = self.core.advance(ahead - from, looked);
            self.core.common.asks = false;
            if self.core.common.rules.trouble.is_some() {
                return None;
            }
            let is_there = fallen.is_none() && (ahead - self.core.common.offset).abs() <= 1e-12 * ahead;
            self.follow(&begin, self.core.common.offset - from, is_there);
            match fallen {
                Some(fallen) => self.event(fallen)?,
                None if !is_there => {}
                None if self.row < row => self.go_to(self.row + 1),
                None => self.core.common.offset = offset,
            }
        }
        Some(())
    }

    fn go_to(&mut self, row: u64) {
        self.row = row;
        self.core.count_from(self.grid.time(row));
    }

    /// Crosses a complete interval without an event.
    fn cross_row(&mut self) {
        self.put_out();
        let begin = self.core.z;
        self.follow(&begin, self.grid.interval(), true);
        self.core.matrices.step(0).advance(&mut self.core.z);
        self.core.common.cost.steps += 1;
        self.core.common.rules.since_change += self.grid.interval();
        self.go_to(self.row + 1);
    }

    /// Advances S by `distance` from the state `begin`, in the present mode.
    fn follow(&mut self, begin: &[f64; N], distance: f64, ends_regularly: bool) {
        let sloped = &mut self.slopes[self.tangents[self.now].sloped];
        let is_regular = self.is_regular && ends_regularly;
        self.is_regular = ends_regularly;
        if is_regular && let Some(step) = sloped.step(distance) {
            step.advance(begin, &mut self.s);
            return;
        }
        let law = &sloped.law;
        let (mut left, mut z, far) = (distance, *begin, law.far());
        while left > 0.0 {
            let now = left.min(far);
            law.series(&z, now, &mut self.series);
            law.rates().add_slopes(&sloped.slopes, (&self.series, now, 1.0), &mut self.s);
            self.series.add_to(&mut z, 1.0);
            left -= now;
        }
    }

    /// Passes an event: a guard falls.
    fn event(&mut self, fallen: Transition) -> Option<()> {
        let law = Arc::clone(&self.core.matrices);
        let guard = law.guards.iter().position(|guard| guard.transition.cause == fallen.cause)?;
        let (watch, z) = (&law.guards[guard], self.core.z);
        let before = law.rate(&z);
        let fall = watch.value(&before);
        let grazes = fall.abs() <= GRAZES * watch.noise(&before);
        let sloped = &self.slopes[self.tangents[self.now].sloped];
        let shifts: Vec<f64> = self
            .s
            .iter()
            .enumerate()
            .map(|(j, s)| -(watch.value(s) + sloped.guard_slope(j, guard, &z)) / fall)
            .collect();
        self.core.change(fallen);
        self.core.resolve();
        self.out.events += 1;
        let after = self.core.matrices.rate(&self.core.z);
        let noise = [law.noise_of_rate(&z), self.core.matrices.noise_of_rate(&self.core.z)];
        let mut jump: [f64; N] = std::array::from_fn(|k| before[k] - after[k]);
        for (k, jump) in jump.iter_mut().enumerate() {
            if jump.abs() <= NO_JUMP * (noise[0][k] + noise[1][k]) {
                *jump = 0.0;
            }
        }
        if jump != [0.0; N] {
            if grazes && shifts.iter().any(|shift| *shift != 0.0) {
                return None;
            }
            for (s, shift) in self.s.iter_mut().zip(shifts).filter(|(_, shift)| *shift != 0.0) {
                s.iter_mut().zip(jump).for_each(|(s, jump)| *s += jump * shift);
            }
        }
        rest(&self.core, &mut self.s);
        self.take_up()
    }

    /// Puts out the present row, once.
    fn put_out(&mut self) {
        if self.rows == self.row {
            self.rows += 1;
            self.held.push(self.core.z);
            self.held.extend_from_slice(&self.s);
            if self.held.len() >= HELD * (1 + self.s.len()) {
                self.write();
            }
        }
        self.move_seam();
    }

    /// Writes the outputs of the rows that are held, which are of the present mode.
    fn write(&mut self) {
        let Some(tangent) = self.tangents.get(self.now) else { return };
        let wide = 1 + self.s.len();
        let rows = self.rows as usize - self.held.len() / wide..self.rows as usize;
        let held = |place: usize| self.held.chunks_exact(wide).map(move |row| &row[place]);
        for (i, form) in tangent.outputs.iter().enumerate() {
            form.add_along(held(0), &mut self.out.values[i][rows.clone()]);
            for (column, place) in self.out.columns[i].iter_mut().zip(&self.places) {
                form.add_along(held(1 + place), &mut column[rows.clone()]);
            }
        }
        for (i, j, form) in &tangent.output_slopes {
            form.add_along(held(0), &mut self.out.columns[*i][*j][rows.clone()]);
        }
        self.held.clear();
    }
}

/// A delay at a change of the inputs.
struct Later<const N: usize> {
    /// The number of its variable in S.
    place: usize,
    /// The drive whose input is delayed; `None` for all.
    drive: Option<usize>,
    /// s per unit of the variable.
    unit: f64,
    /// ż before the later change minus ż after it.
    jump: [f64; N],
}

/// ∂z/∂p at the start.
fn begin<const N: usize>(seen: &RelativeMachine, varied: &Varied) -> [f64; N] {
    let at = |seen: &RelativeMachine| vector::<N>(&seen.space.layout, &seen.inner);
    let [here, first, second] = [at(seen), at(&varied.points[0]), at(&varied.points[1])];
    std::array::from_fn(|k| varied.slope(here[k], first[k], second[k]))
}

/// Stuck bodies have no speed, whatever the variables are.
fn rest<const N: usize>(core: &Core<N>, s: &mut [[f64; N]]) {
    let (mode, layout) = (&core.common.rules.mode, &core.common.space.layout);
    for body in (0..layout.bodies()).filter(|&body| mode.motion[body] == Motion::Stuck) {
        s.iter_mut().for_each(|s| s[layout.speed[body]] = 0.0);
    }
}
