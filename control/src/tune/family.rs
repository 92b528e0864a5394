//! Family of machines for a controller: uncertain parameters, loads and positions along the travel; and the worst of
//! them.

use super::margins::Margins;
use super::plant::Plant;
use super::unknown::{SPREAD, Unknown, tie, with_the_rest};
use crate::case::drawn;
use crate::case::{Case, Tuning};
use crate::chance::{quantile, uniform};
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::linear::{Operation, ResonancesAt, places, travel};
use crate::machine::Machine;
use crate::number::engineering;
use crate::parameter::{self, Free, kinds};
use crate::signal::profile::Passage;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::path::Path;

/// Number of drawn machines, in addition to the nominal machine with each load.
pub const MACHINES: usize = 40;

/// Fraction of the machines that a worst-case figure excludes: the end of the central 95 %.
const LEFT_OUT: f64 = 0.025;

/// Rounds of the search for the worst axis.
const ROUNDS: usize = 6;

/// Number of random corners as starts of further searches.
const DRAWS: usize = 16;

/// A change of a corner.
type Step<'a> = Box<dyn Fn(&Corner) -> Corner + 'a>;

/// One machine of the family.
#[derive(Debug, Clone, PartialEq)]
pub struct Corner {
    /// Position of the cart, m.
    pub place: f64,
    /// Position of the bridge, m, if any.
    pub bridge: f64,
    /// Mass added to it, kg.
    pub load: f64,
    /// Deviation of each unknown, from −1 to 1.
    pub off: Vec<f64>,
}

impl Corner {
    /// Operating point of sliding there.
    pub fn operation(&self) -> Operation {
        Operation { position: self.place, bridge: self.bridge, ..Operation::default() }
    }
}

/// A family of machines.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Family {
    /// The nominal machine.
    pub machine: Machine,
    /// The uncertain parameters.
    pub unknowns: Vec<Unknown>,
    /// Source of the uncertainty.
    pub source: Source,
    /// Positions along the travel, m; a single one if nothing changes along it.
    pub places: Vec<f64>,
    /// Positions of the bridge, m.
    pub bridges: Vec<f64>,
    /// Loads, kg.
    pub loads: Vec<f64>,
    /// The nominal machine with each load, and a Latin hypercube of machines.
    pub machines: Vec<Corner>,
    /// True if all parameters may be at their ends simultaneously.
    pub corners: bool,
}

/// Source of the uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The intervals of a fit.
    Fit,
    /// Number of draws from the posterior of a fit.
    Posterior(usize),
    /// A relative spread of each parameter.
    Spread(f64),
}

impl Family {
    /// Family of a case. Its machines are a Latin hypercube: values are uniform within a spread, normal within the
    /// interval of a fit; parameters that were not fitted have the default spread. With `tuning.corners` the worst
    /// corner of all intervals joins them.
    pub fn new(case: &Case, tuning: &Tuning) -> Result<Self> {
        if let Some(file) = &tuning.draws {
            return Self::of_draws(case, tuning, file);
        }
        let machine = case.machine.clone();
        let keys: Vec<&str> = case.known.iter().flat_map(|known| known.name.split(" = ")).collect();
        let (mut unknowns, source) = match tuning.spread {
            None if !case.known.is_empty() => {
                let mut unknowns = Vec::new();
                // Nuisance parameters of a log have no key.
                for known in case.known.iter().filter(|known| known.name.contains('.')) {
                    let free = Free::new(&machine, &known.name, &keys, &[])?;
                    let least = if free.start > 0.0 { 1e-3 * free.start } else { f64::NEG_INFINITY };
                    unknowns.push(match known.interval {
                        Some(interval) => Unknown::fitted(free, interval.map(|end| end.max(least))),
                        // Parameters that the fit does not determine have a relative spread.
                        None => Unknown::spread(free, SPREAD),
                    });
                }
                (with_the_rest(unknowns, &machine), Source::Fit)
            }
            given => {
                let share = given.unwrap_or(SPREAD);
                let unknown = |free: Free| Unknown::spread(free, share);
                (kinds(&machine).into_iter().map(unknown).collect(), Source::Spread(share))
            }
        };
        tie(&mut unknowns);
        let mut family = Self::without_machines(case, tuning, unknowns, source);
        family.machines = family.drawn(MACHINES);
        Ok(family)
    }

    /// Family from the draws of a posterior: machines compatible with the logs, including correlations of parameters,
    /// at random positions and loads.
    fn of_draws(case: &Case, tuning: &Tuning, file: &Path) -> Result<Self> {
        let plan = case.fit.as_ref().ok_or_else(|| {
            Error::new("draws belong to the parameters of a fit, and this case has no [fit]")
                .in_file(file)
                .next("use --draws with the fitted.toml of the same folder, or with the case that was fitted")
        })?;
        let (frees, columns) = drawn(case, plan, &[], file)?;
        let rows = columns.first().map_or(0, Vec::len);
        let unknown = |(free, column): (Free, &Vec<f64>)| {
            let mut sorted = column.clone();
            sorted.sort_by(f64::total_cmp);
            // The nominal machine lies within, if only just.
            let least = 1e-6 * free.start.abs().max(f64::MIN_POSITIVE);
            let low = quantile(&sorted, 0.025).min(free.start - least);
            let high = quantile(&sorted, 0.975).max(free.start + least);
            Unknown::fitted(free, [low, high])
        };
        let drawn: Vec<Unknown> = frees.into_iter().zip(&columns).map(unknown).collect();
        let count = drawn.len();
        let mut unknowns = with_the_rest(drawn, &case.machine);
        tie(&mut unknowns);
        // Parameters of the draws vary jointly.
        unknowns.iter_mut().take(count).enumerate().for_each(|(place, unknown)| unknown.with = place);
        let mut family = Self::without_machines(case, tuning, unknowns, Source::Posterior(rows));
        let count = MACHINES.min(rows);
        family.machines = family.drawn(count);
        let first = family.machines.len() - count;
        for k in 0..count {
            let row = k * rows / count;
            let offs: Vec<f64> =
                columns.iter().zip(&family.unknowns).map(|(column, unknown)| unknown.off(column[row])).collect();
            for (unknown, own) in family.unknowns.iter().zip(&mut family.machines[first + k].off) {
                *own = offs.get(unknown.with).copied().unwrap_or(*own);
            }
        }
        Ok(family)
    }

    fn without_machines(case: &Case, tuning: &Tuning, unknowns: Vec<Unknown>, source: Source) -> Self {
        let [bridges, places] = along(case, tuning.places);
        let (machine, loads) = (case.machine.clone(), tuning.loads.clone());
        Self { places, bridges, loads, machine, unknowns, source, machines: Vec::new(), corners: tuning.corners }
    }

    /// The nominal machine with each load, and `count` machines of a Latin hypercube over unknowns, loads and
    /// positions.
    fn drawn(&self, count: usize) -> Vec<Corner> {
        let nominal = self.nominal();
        let mut all: Vec<Corner> = self.loads.iter().map(|&load| Corner { load, ..nominal.clone() }).collect();
        let mut random = Pcg64::seed_from_u64(15);
        // A random point of each stratum in a random order.
        let mut column = || -> Vec<f64> {
            let mut order: Vec<usize> = (0..count).collect();
            for i in (1..count).rev() {
                order.swap(i, (uniform(&mut random) * (i + 1) as f64) as usize);
            }
            order.into_iter().map(|stratum| (stratum as f64 + uniform(&mut random)) / count as f64).collect()
        };
        let (at, load) = (column(), column());
        let off: Vec<Vec<f64>> = self.unknowns.iter().map(|_| column()).collect();
        let bridge = column();
        let between = |places: &[f64], share: f64| {
            let [from, to] = [places.first(), places.last()].map(|place| place.copied().unwrap_or_default());
            from + share * (to - from)
        };
        all.extend((0..count).map(|draw| Corner {
            place: between(&self.places, at[draw]),
            bridge: between(&self.bridges, bridge[draw]),
            load: self.loads.get((load[draw] * self.loads.len() as f64) as usize).copied().unwrap_or_default(),
            off: self.unknowns.iter().map(|unknown| unknown.quantile(off[unknown.with][draw])).collect(),
        }));
        all
    }

    /// Number of machines that a worst-case figure excludes: none with corners.
    pub fn left_out(&self, of: usize) -> usize {
        if self.corners { 0 } else { (LEFT_OUT * of as f64) as usize }
    }

    /// Sets the deviation of an unknown and of all that vary with it.
    pub(super) fn put(&self, corner: &mut Corner, unknown: usize, off: f64) {
        for (other, value) in self.unknowns.iter().zip(&mut corner.off) {
            if other.with == unknown {
                *value = off;
            }
        }
    }

    /// The independent unknowns.
    pub(super) fn leading(&self) -> impl Iterator<Item = usize> {
        self.unknowns.iter().enumerate().filter(|(place, unknown)| unknown.with == *place).map(|(place, _)| place)
    }

    /// The nominal machine in the middle of its positions, with the least load.
    pub fn nominal(&self) -> Corner {
        let middle = |places: &[f64]| places.get(places.len() / 2).copied().unwrap_or_default();
        let least = self.loads.iter().copied().fold(f64::INFINITY, f64::min);
        Corner {
            place: middle(&self.places),
            bridge: middle(&self.bridges),
            load: if least.is_finite() { least } else { 0.0 },
            off: vec![0.0; self.unknowns.len()],
        }
    }

    /// The nominal machine with each unknown alone at either end.
    pub fn ends(&self) -> Vec<Corner> {
        let end = |(unknown, end): (usize, f64)| {
            let mut corner = self.nominal();
            self.put(&mut corner, unknown, end);
            corner
        };
        self.leading().flat_map(|unknown| [(unknown, -1.0), (unknown, 1.0)]).map(end).collect()
    }

    /// The machine at a corner.
    pub fn stage_at(&self, corner: &Corner) -> Machine {
        let mut machine = self.machine.clone();
        let off = self.unknowns.iter().zip(&corner.off).filter(|(_, off)| **off != 0.0);
        parameter::set(&mut machine, off.map(|(unknown, &off)| (&unknown.free, unknown.value(off))));
        machine.cart.mass += corner.load;
        machine
    }

    /// The machine at a corner with span lengths that follow the cart.
    pub(super) fn machine_at(&self, corner: &Corner) -> Machine {
        following(self.stage_at(corner))
    }

    /// Its response, as sampled by the controller of `design`.
    pub fn plant(&self, corner: &Corner, design: &Design, corners: &[f64]) -> Result<Plant> {
        Plant::new(&self.machine_at(corner), corner.operation(), design, corners)
    }

    /// Steps to these ends of each unknown, to these positions of cart and bridge, and to the loads.
    fn steps<'a>(&'a self, ends: &[f64], [places, bridges]: [&[f64]; 2], loads: &[f64]) -> Vec<Step<'a>> {
        let mut steps: Vec<Step<'a>> = Vec::new();
        steps.extend(places.iter().map(|&place| moved(move |corner| corner.place = place)));
        steps.extend(bridges.iter().map(|&bridge| moved(move |corner| corner.bridge = bridge)));
        steps.extend(loads.iter().map(|&load| moved(move |corner| corner.load = load)));
        for unknown in self.leading() {
            steps.extend(ends.iter().map(|&end| moved(move |corner| self.put(corner, unknown, end))));
        }
        steps
    }

    /// The corner in words: deviations, load, position.
    pub fn words(&self, corner: &Corner) -> String {
        let off = |(unknown, &off): (&Unknown, &f64)| (off != 0.0).then(|| unknown.words(off));
        let mut words: Vec<String> = self.unknowns.iter().zip(&corner.off).filter_map(off).collect();
        if self.loads.len() > 1 {
            words.push(format!("load {}", engineering(corner.load, "kg", 4)));
        }
        if self.places.len() > 1 {
            words.push(format!("cart at {:.0} mm", 1e3 * corner.place));
        }
        if self.bridges.len() > 1 {
            words.push(format!("bridge at {:.0} mm", 1e3 * corner.bridge));
        }
        if words.is_empty() { "as the file has it".into() } else { words.join(", ") }
    }

    /// The corner with the largest `badness`, and its margins: coordinate search from the nominal machine, from the
    /// effect of each unknown alone, and from the worst of some draws.
    pub fn worst(
        &self,
        design: &Design,
        feedback: &Feedback,
        badness: &dyn Fn(&Margins) -> f64,
    ) -> Result<(Corner, Margins)> {
        let corners = feedback.corners();
        let look = |corner: &Corner| -> Result<(f64, Margins)> {
            let margins = Margins::new(&self.plant(corner, design, &corners)?, feedback);
            let value = badness(&margins);
            Ok((if value.is_nan() { f64::INFINITY } else { value }, margins))
        };
        let nominal = self.nominal();
        let start_bridge = nominal.bridge;
        let mut best = (nominal.clone(), look(&nominal)?);
        let start = best.1.0;
        // Effect of each unknown alone.
        let mut signs = nominal;
        for unknown in self.leading() {
            let mut most = start;
            for end in [-1.0, 1.0] {
                let mut corner = best.0.clone();
                corner.off = vec![0.0; self.unknowns.len()];
                self.put(&mut corner, unknown, end);
                let (value, _) = look(&corner)?;
                if value > most * (1.0 + 1e-9) {
                    most = value;
                    self.put(&mut signs, unknown, end);
                }
            }
        }
        let found = look(&signs)?;
        if found.0 > best.1.0 {
            best = (signs, found);
        }
        // Random starts, for combined effects.
        let mut random = Pcg64::seed_from_u64(1);
        let mut share = || uniform(&mut random);
        let mut other: Option<(Corner, (f64, Margins))> = None;
        for _ in 0..DRAWS {
            let pick = |values: &[f64], share: f64| values.get((share * values.len() as f64) as usize).copied();
            let corner = Corner {
                place: pick(&self.places, share()).unwrap_or_default(),
                bridge: match self.bridges.len() {
                    0 | 1 => start_bridge,
                    _ => pick(&self.bridges, share()).unwrap_or_default(),
                },
                load: pick(&self.loads, share()).unwrap_or_default(),
                off: vec![0.0; self.unknowns.len()],
            };
            let mut corner = corner;
            for unknown in self.leading() {
                self.put(&mut corner, unknown, if share() < 0.5 { -1.0 } else { 1.0 });
            }
            let found = look(&corner)?;
            if other.as_ref().is_none_or(|(_, most)| found.0 > most.0) {
                other = Some((corner, found));
            }
        }
        // With a notch the worst case lies between the ends, where a drawn machine is closer to it.
        let mut inner: Option<(Corner, (f64, Margins))> = None;
        for corner in &self.machines {
            let found = look(corner)?;
            if inner.as_ref().is_none_or(|(_, most)| found.0 > most.0) {
                inner = Some((corner.clone(), found));
            }
        }
        let ends = self.steps(&[-1.0, 0.0, 1.0], [&self.places, &self.bridges], &self.loads);
        best = climb(best, &ends, ROUNDS, &look)?;
        if let Some(other) = other {
            let other = climb(other, &ends, ROUNDS, &look)?;
            if other.1.0 > best.1.0 {
                best = other;
            }
        }
        // The worst case rarely lies between the ends.
        let between = self.steps(
            &[-0.75, -0.5, -0.25, 0.25, 0.5, 0.75],
            [&halves(&self.places), &halves(&self.bridges)],
            &halves(&self.loads),
        );
        let all: Vec<Step> = ends.into_iter().chain(between).collect();
        if let Some(inner) = inner {
            let inner = climb(inner, &all, 3, &look)?;
            if inner.1.0 > best.1.0 {
                best = inner;
            }
        }
        best = climb(best, &all, 2, &look)?;
        let margins = Margins::new(&self.plant(&best.0, design, &corners)?, feedback);
        Ok((best.0, margins))
    }
}

type Look<'a> = &'a dyn Fn(&Corner) -> Result<(f64, Margins)>;

/// Moves from a corner to worse ones, step by step, as long as it gets worse, up to a number of rounds.
fn climb(
    mut best: (Corner, (f64, Margins)),
    steps: &[Step],
    rounds: usize,
    look: Look,
) -> Result<(Corner, (f64, Margins))> {
    for _ in 0..rounds {
        let before = best.1.0;
        if before == f64::INFINITY {
            break;
        }
        for step in steps {
            let corner = step(&best.0);
            if corner == best.0 {
                continue;
            }
            let found = look(&corner)?;
            if found.0 > best.1.0 * (1.0 + 1e-9) {
                best = (corner, found);
            }
        }
        if best.1.0 <= before * (1.0 + 1e-6) {
            break;
        }
    }
    Ok(best)
}

/// Midpoints between neighbours.
fn halves(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
}

/// A corner with one change.
fn moved<'a>(change: impl Fn(&mut Corner) + 'a) -> Step<'a> {
    Box::new(move |corner| {
        let mut other = corner.clone();
        change(&mut other);
        other
    })
}

/// The machine with span lengths that follow the cart, even if the runs assume fixed ones.
fn following(mut machine: Machine) -> Machine {
    machine.belt.follows_cart |= machine.belt.make.is_some();
    machine
}

/// Resonance and anti-resonance of a machine at these positions of its cart, with the bridge at `bridge`, m.
pub(super) fn modes_along(machine: &Machine, bridge: f64, places: &[f64]) -> Result<Vec<ResonancesAt>> {
    travel(&following(machine.clone()), Operation { bridge, ..Operation::default() }, places)
}

/// Positions of the bridge, if any, and of the cart along their travel: from `[travel]` or else the range of the moves.
fn along(case: &Case, count: usize) -> [Vec<f64>; 2] {
    let machine = following(case.machine.clone());
    let steps = count.max(2) - 1;
    let evenly = |low: f64, high: f64| (0..=steps).map(|i| low + (high - low) * i as f64 / steps as f64).collect();
    let of_moves = |slide: usize| {
        let profiles = case.moves.iter().map(|motion| &motion.profiles[slide]);
        let ends = profiles.flat_map(|profile| profile.passages().iter().flat_map(Passage::extremes));
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        (low <= high).then(|| evenly(low, high))
    };
    if machine.bridge.is_some() {
        let changes = machine.belt.follows_cart || machine.yaw.is_some();
        let of_slide = |slide| of_moves(slide).filter(|_| changes).unwrap_or(vec![0.0]);
        return [of_slide(0), of_slide(1)];
    }
    let Some(whole) = places(&machine, count) else { return [Vec::new(), vec![0.0]] };
    match of_moves(0).filter(|_| machine.cart.travel.is_none()) {
        Some(places) => [Vec::new(), places],
        None => [Vec::new(), whole],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Template;

    /// Numbers of values in equal strata of an interval; those at its ends or outside are not counted.
    fn strata(values: impl Iterator<Item = f64>, [from, to]: [f64; 2], count: usize) -> Vec<usize> {
        let mut counts = vec![0; count];
        for value in values {
            let share = (value - from) / (to - from);
            if (0.0..1.0).contains(&share) {
                counts[(share * count as f64) as usize] += 1;
            }
        }
        counts
    }

    #[test]
    fn drawn_axes_have_one_in_every_stratum() {
        for template in [Template::Stage, Template::Gantry] {
            let case = Case::from_text("machine.toml", template.text()).unwrap();
            let family = Family::new(&case, &Tuning::default()).unwrap();
            let drawn = &family.machines[family.loads.len()..];
            assert_eq!(drawn.len(), MACHINES);
            let ends = |places: &[f64]| [places[0], places[places.len() - 1]];
            let one_each = vec![1; MACHINES];
            assert_eq!(strata(drawn.iter().map(|one| one.place), ends(&family.places), MACHINES), one_each);
            if family.bridges.len() > 1 {
                assert_eq!(strata(drawn.iter().map(|one| one.bridge), ends(&family.bridges), MACHINES), one_each);
            }
            // Values within a spread are uniform.
            for (k, unknown) in family.unknowns.iter().enumerate().filter(|(k, unknown)| unknown.with == *k) {
                let offs = drawn.iter().map(|one| one.off[k]);
                assert_eq!(strata(offs, [-1.0, 1.0], MACHINES), one_each, "{}", unknown.name);
            }
        }
    }
}
