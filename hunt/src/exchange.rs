//! An FMU for model exchange under an integrator of the hunt: extrapolation of the midpoint rule (Gragg, Bulirsch,
//! Stoer), of the linearly implicit one where there are bristles, whose rate σ₀ |v|/g grows with the speed (Bader,
//! Deuflhard); events by bisection of a step, an indicator that is zero counted with the negative ones, as FMI has it.

use crate::answer::{Answer, End, mechanism, rows};
use crate::double::Double;
use crate::input::{self, Piece};
use crate::linear::Factors;
use crate::steps::{Case, references, told};
use crate::subject::{Fed, Subject};
use std::sync::Arc;
use taut::friction::Law;
use taut_fmu::instance::{Instance, Phase, Use};

/// How far positions may be off, m.
const ALLOWED: f64 = 1e-6;

/// Relative to nominal values or values, whichever is larger.
const TOLERANCE: f64 = 1e-11;

/// The same for positions: their nominal value is 1 cm, m.
pub(crate) const POSITIONS: f64 = 0.01 * TOLERANCE;

/// Rounding of a step as a multiple of that of a rate times its length.
const ROUNDING: f64 = 16.0;

/// Columns of the extrapolation.
const COLUMNS: usize = 8;

/// Steps of each column, by the explicit and by the linearly implicit rule.
const EXPLICIT: [usize; COLUMNS] = [2, 4, 6, 8, 10, 12, 14, 16];
const IMPLICIT: [usize; COLUMNS] = [2, 6, 10, 14, 22, 34, 50, 70];

/// Part of a step over which slopes of indicators are taken.
const DIFFERENCE: f64 = 1e-4;

/// How often a step is halved in any case to find an indicator that falls and rises again within it, and at most.
const HALVED: usize = 2;
const DEEPEST: usize = 40;

/// Steps and events after which it gives up.
const MOST: usize = 300_000;

struct Importer<'a> {
    instance: Instance,
    opened: &'a Case,
    chains: Vec<Vec<Piece>>,
    subject: &'a Subject,
    nominals: Vec<f64>,
    time: f64,
    states: Vec<f64>,
    /// The length of step that suits it.
    step: f64,
    /// The longest step.
    longest: f64,
    work: usize,
    next_event: Option<f64>,
    /// True if some of its rates may be far faster than its motion.
    is_stiff: bool,
}

/// A moment of a step.
struct Moment {
    /// Since the start of the step, s.
    after: f64,
    states: Vec<f64>,
    /// The indicators, and their slopes along the motion, 1/s.
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Moment {
    /// Which indicators are above zero.
    fn holds(&self) -> impl Iterator<Item = bool> {
        self.values.iter().map(|value| *value > 0.0)
    }

    /// True if each indicator has the same sign at another moment.
    fn is_as(&self, other: &Moment) -> bool {
        self.holds().eq(other.holds())
    }

    /// True if an indicator falls here, rises at a later moment, and the two tangents meet at zero or below.
    fn may_dip(&self, later: &Moment) -> bool {
        let apart = later.after - self.after;
        let here = self.values.iter().zip(&self.slopes);
        let mut pairs = here.zip(later.values.iter().zip(&later.slopes));
        pairs.any(|((a, slope), (b, rise))| {
            // a + s slope = b − (apart − s) rise
            let s = (b - a - apart * rise) / (slope - rise);
            *a > 0.0 && *slope < 0.0 && *rise > 0.0 && a + s * slope <= 0.0
        })
    }
}

impl Importer<'_> {
    /// The inputs at a time, those before an edge where `before` says so.
    fn inputs(&self, time: f64) -> Vec<f64> {
        match self.subject {
            Subject::Loop(case) => references(case.moves[0].profile(), time).to_vec(),
            Subject::Axis(_) | Subject::Gantry(_) => {
                self.chains.iter().map(|chain| input::value(chain, time).high).collect()
            }
        }
    }

    /// Inputs as they were from `from` on, so that a step up to an edge does not see what comes after it.
    fn put(&mut self, from: f64, time: f64, states: &[f64]) -> Result<(), String> {
        self.instance.set_time(time).map_err(told)?;
        self.instance.set_states(states).map_err(told)?;
        let values = match self.subject {
            Subject::Loop(_) => self.inputs(time),
            Subject::Axis(_) | Subject::Gantry(_) => self
                .chains
                .iter()
                .map(|chain| {
                    // An edge lies between two numbers of 64 bits.
                    let at = Double::from(from + 4.0 * f64::EPSILON * from);
                    let piece = chain.iter().rev().find(|piece| piece.start <= at);
                    piece.map_or(0.0, |piece| piece.series(Double::from(time), Double::ONE)[0].high)
                })
                .collect(),
        };
        self.instance.set_reals(&self.opened.inputs[..values.len()], &values).map_err(told)
    }

    fn rates(&mut self, from: f64, time: f64, states: &[f64]) -> Result<Vec<f64>, String> {
        self.put(from, time, states)?;
        let mut rates = vec![0.0; states.len()];
        self.instance.rates(&mut rates).map_err(told)?;
        Ok(rates)
    }

    fn residuals(&mut self, from: f64, time: f64, states: &[f64]) -> Result<Vec<f64>, String> {
        self.put(from, time, states)?;
        let mut values = vec![0.0; self.opened.model.conditions];
        self.instance.residuals(&mut values).map_err(told)?;
        Ok(values)
    }

    fn indicators(&mut self, from: f64, time: f64, states: &[f64]) -> Result<Vec<bool>, String> {
        Ok(self.residuals(from, time, states)?.into_iter().map(|value| value > 0.0).collect())
    }

    /// The indicators `after` a time, and their slopes along the motion by central differences over a part of `h`.
    fn moment(&mut self, after: f64, states: Vec<f64>, h: f64) -> Result<Moment, String> {
        let (from, time, apart) = (self.time, self.time + after, DIFFERENCE * h);
        let values = self.residuals(from, time, &states)?;
        let rates = self.rates(from, time, &states)?;
        let mut beside = |d: f64| {
            let moved: Vec<f64> = states.iter().zip(&rates).map(|(y, f)| y + d * f).collect();
            self.residuals(from, time + d, &moved)
        };
        let (before, behind) = (beside(-apart)?, beside(apart)?);
        let slopes = behind.iter().zip(&before).map(|(b, a)| (b - a) / (2.0 * apart)).collect();
        Ok(Moment { after, states, values, slopes })
    }

    /// The first change of an indicator within a step of `h` that ends in `last`, to the last bits of time: how long
    /// after the start it comes, s, and the state there. One that is undone within the step is found, too.
    fn first_change(&mut self, start: &[f64], (h, last): (f64, &[f64])) -> Result<Option<(f64, Vec<f64>)>, String> {
        let (from, mut first) = (self.time, None);
        let begin = self.moment(0.0, start.to_vec(), h)?;
        let was: Vec<bool> = begin.holds().collect();
        let mut end = self.moment(h, last.to_vec(), h)?;
        loop {
            let changed = match end.is_as(&begin) {
                false => Some((end.after, end.states.clone())),
                true => self.hidden([&begin, &end], h, 0)?,
            };
            let Some((mut high, mut beyond)) = changed else { return Ok(first) };
            let (mut low, mut before) = (0.0, start.to_vec());
            while high - low > (4.0 * f64::EPSILON * (from + high)).max(f64::MIN_POSITIVE) {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    break;
                }
                let (states, _) = self.extrapolated(middle)?;
                match self.indicators(from, from + middle, &states)? == was {
                    true => (low, before) = (middle, states),
                    false => (high, beyond) = (middle, states),
                }
            }
            first = Some((high, beyond));
            end = self.moment(low, before, h)?;
        }
    }

    /// A time within a step of `h` between two moments, and the state there, at which an indicator has changed that is
    /// as it was at both. A step is halved twice in any case, since it may be as long as a period of the machine, and
    /// then where the tangents of an indicator meet below zero: above them lies the curve, which is convex there.
    fn hidden(&mut self, [low, high]: [&Moment; 2], h: f64, depth: usize) -> Result<Option<(f64, Vec<f64>)>, String> {
        let is_narrow = high.after - low.after <= 64.0 * f64::EPSILON * (self.time + high.after);
        if is_narrow || depth >= DEEPEST || (depth >= HALVED && !low.may_dip(high)) {
            return Ok(None);
        }
        let after = 0.5 * (low.after + high.after);
        let (states, _) = self.extrapolated(after)?;
        let middle = self.moment(after, states, h)?;
        if !middle.is_as(low) {
            return Ok(Some((after, middle.states)));
        }
        match self.hidden([low, &middle], h, depth + 1)? {
            Some(found) => Ok(Some(found)),
            None => self.hidden([&middle, high], h, depth + 1),
        }
    }

    /// The error that each quantity may have after a step of `h`: the tolerance, but no less than rounding. Far from
    /// the origin stiff springs turn the last bit of a position into a force that no step is short enough for.
    fn errors(&mut self, y: &[f64], first: &[f64], h: f64) -> Result<Vec<f64>, String> {
        let sign = |j: usize| if j.is_multiple_of(2) { f64::EPSILON } else { -f64::EPSILON };
        let rounded: Vec<f64> = y.iter().enumerate().map(|(j, y)| y * (1.0 + sign(j / 2))).collect();
        let other = self.rates(self.time, self.time, &rounded)?;
        let quantities = y.iter().zip(&self.nominals).zip(first.iter().zip(&other));
        let error = quantities.map(|((y, nominal), (f, other))| {
            (TOLERANCE * nominal.max(y.abs())).max(ROUNDING * h.abs() * (f - other).abs())
        });
        Ok(error.collect())
    }

    /// ∂f/∂y by columns, from differences: the rule is of the same order with any matrix.
    fn jacobian(&mut self, y: &[f64], first: &[f64]) -> Result<Vec<Vec<f64>>, String> {
        let mut columns = Vec::new();
        for place in 0..y.len() {
            let mut moved = y.to_vec();
            moved[place] += f64::EPSILON.sqrt() * y[place].abs().max(self.nominals[place]);
            let change = moved[place] - y[place];
            let rates = self.rates(self.time, self.time, &moved)?;
            columns.push(rates.iter().zip(first).map(|(f, first)| (f - first) / change).collect());
        }
        Ok(columns)
    }

    /// `count` steps of the midpoint rule over `h`: y₁ = y₀ + d f₀, y_{m+1} = y_{m−1} + 2 d f_m; nothing where it runs
    /// off every number.
    fn explicit(&mut self, (y, first): (&[f64], &[f64]), h: f64, count: usize) -> Result<Option<Vec<f64>>, String> {
        let (t, d) = (self.time, h / count as f64);
        let mut before = y.to_vec();
        let mut now: Vec<f64> = y.iter().zip(first).map(|(y, f)| y + d * f).collect();
        for m in 1..count {
            if now.iter().any(|y| !y.is_finite()) {
                return Ok(None);
            }
            let rates = self.rates(t, t + m as f64 * d, &now)?;
            let next = before.iter().zip(&rates).map(|(y, f)| y + 2.0 * d * f).collect();
            before = std::mem::replace(&mut now, next);
        }
        Ok(Some(now))
    }

    /// The same of the linearly implicit rule: (1 − d A) Δ₀ = d f₀, (1 − d A)(Δ_m − Δ_{m−1})/2 = d f_m − Δ_{m−1},
    /// y_{m+1} = y_m + Δ_m, and at the end half of the last change.
    fn implicit(
        &mut self,
        (y, first, jacobian): (&[f64], &[f64], &[Vec<f64>]),
        h: f64,
        count: usize,
    ) -> Result<Option<Vec<f64>>, String> {
        let (t, d) = (self.time, h / count as f64);
        let factors = Factors::new(jacobian, d);
        let mut delta = factors.solve(first.iter().map(|f| d * f).collect());
        let mut now: Vec<f64> = y.iter().zip(&delta).map(|(y, delta)| y + delta).collect();
        for m in 1..=count {
            if now.iter().any(|y| !y.is_finite()) {
                return Ok(None);
            }
            let rates = self.rates(t, t + m as f64 * d, &now)?;
            let half = factors.solve(rates.iter().zip(&delta).map(|(f, delta)| d * f - delta).collect());
            if m == count {
                now.iter_mut().zip(&half).for_each(|(y, half)| *y += half);
                break;
            }
            delta.iter_mut().zip(&half).for_each(|(delta, half)| *delta += 2.0 * half);
            now.iter_mut().zip(&delta).for_each(|(y, delta)| *y += delta);
        }
        Ok(Some(now))
    }

    /// The state a step of `h` on, and its error by the tolerance.
    fn extrapolated(&mut self, h: f64) -> Result<(Vec<f64>, f64), String> {
        let (t, y) = (self.time, self.states.clone());
        let first = self.rates(t, t, &y)?;
        let most = self.errors(&y, &first, h)?;
        let jacobian = if self.is_stiff { Some(self.jacobian(&y, &first)?) } else { None };
        let counts = if self.is_stiff { IMPLICIT } else { EXPLICIT };
        let mut last: Vec<Vec<f64>> = Vec::new();
        for (column, &count) in counts.iter().enumerate() {
            let now = match &jacobian {
                Some(jacobian) => self.implicit((&y, &first, jacobian), h, count)?,
                None => self.explicit((&y, &first), h, count)?,
            };
            // A step that runs off every number is too long.
            let Some(now) = now else { return Ok((y, f64::INFINITY)) };
            // T_{j,k} = T_{j,k−1} + (T_{j,k−1} − T_{j−1,k−1})/((n_j/n_{j−k})² − 1)
            let mut row = vec![now];
            for k in 1..=column {
                let ratio = count as f64 / counts[column - k] as f64;
                let pairs = row[k - 1].iter().zip(&last[k - 1]);
                row.push(pairs.map(|(new, old)| new + (new - old) / (ratio * ratio - 1.0)).collect());
            }
            let best = &row[column];
            let mut error = f64::INFINITY;
            if column > 1 {
                let terms = best.iter().zip(&row[column - 1]).zip(&most);
                let terms = terms.map(|((a, b), most)| (a - b).abs() / most);
                error = terms.fold(0.0, |most, e| if e.is_nan() { f64::INFINITY } else { e.max(most) });
            }
            if error <= 1.0 || column + 1 == COLUMNS {
                return Ok((best.clone(), error));
            }
            last = row;
        }
        Err("the extrapolation has no column".into())
    }

    /// Event mode at the present time and state; then continuous time again.
    fn event(&mut self) -> Result<(), String> {
        let (time, states) = (self.time, self.states.clone());
        self.put(time, time, &states)?;
        if self.instance.phase() == Phase::Continuous {
            self.instance.go_into("event", &[Phase::Continuous], Phase::Event).map_err(told)?;
        }
        let settled = self.instance.settle().map_err(told)?;
        self.next_event = settled.next;
        self.instance.states(&mut self.states).map_err(told)?;
        self.instance.go_into("continuous", &[Phase::Event], Phase::Continuous).map_err(told)
    }

    /// Goes on to `until`, over whose inside no edge of an input lies; false where the run ended before.
    fn go(&mut self, until: f64) -> Result<bool, String> {
        let near = 8.0 * f64::EPSILON * until.abs();
        while self.time < until - near {
            self.work += 1;
            if self.work > MOST {
                return Err("more steps than are worth the time".into());
            }
            if self.instance.is_over() {
                return Ok(false);
            }
            let limit = self.next_event.filter(|next| *next > self.time + near).unwrap_or(until).min(until);
            let h = self.step.min(self.longest).min(limit - self.time);
            let (from, start) = (self.time, self.states.clone());
            let (states, error) = self.extrapolated(h)?;
            let reach = h * (0.8 * error.max(1e-12).powf(-1.0 / 15.0)).clamp(0.2, 2.5);
            if error > 1.0 {
                self.step = reach;
                continue;
            }
            if h >= 0.999 * self.step || reach < self.step {
                self.step = reach;
            }
            let changed = self.first_change(&start, (h, &states))?;
            if let Some((after, beyond)) = changed {
                (self.time, self.states) = (from + after, beyond);
                self.event()?;
                continue;
            }
            let at_limit = (from + h - limit).abs() <= near;
            self.time = if at_limit { limit } else { from + h };
            self.states = states;
            let (time, states) = (self.time, self.states.clone());
            self.put(from, time, &states)?;
            let due = self.next_event.is_some_and(|next| next <= self.time + near);
            if due || self.instance.has_fallen().map_err(told)? {
                self.event()?;
            }
        }
        self.time = until;
        Ok(!self.instance.is_over())
    }
}

/// Runs it.
pub fn run(subject: &Subject) -> Result<Answer, String> {
    let opened = Case::new(subject)?;
    let [until, every] = subject.times();
    let chains = subject.chains(until, &mut Double::from)?;
    let mut edges: Vec<f64> = chains.iter().flatten().map(|piece| piece.start.high).collect();
    edges.retain(|edge| *edge > 0.0 && *edge < until);
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let mut instance = Instance::new(Arc::clone(&opened.model), Use::ModelExchange);
    instance.set_up(0.0, None).map_err(told)?;
    instance.enter_initialization().map_err(told)?;
    let count = opened.model.quantities.len();
    let mut importer = Importer {
        instance,
        opened: &opened,
        chains,
        subject,
        nominals: vec![1.0; count],
        time: 0.0,
        states: vec![0.0; count],
        step: every / 16.0,
        longest: every / 16.0,
        work: 0,
        next_event: None,
        is_stiff: mechanism(subject).bodies.iter().any(|body| matches!(body.friction.law, Law::LuGre { .. })),
    };
    let first = importer.inputs(0.0);
    importer.instance.set_reals(&opened.inputs[..first.len()], &first).map_err(told)?;
    importer.instance.exit_initialization().map_err(told)?;
    importer.instance.states(&mut importer.states).map_err(told)?;
    importer.instance.nominals(&mut importer.nominals).map_err(told)?;
    importer.event()?;
    let (mut times, mut positions, mut end) = (Vec::new(), Vec::new(), End::Complete);
    let rows_count = (until / every * (1.0 + 1e-12)).floor() as usize;
    for k in 0..=rows_count {
        let time = k as f64 * every;
        times.push(time);
        while end == End::Complete {
            let edge = edges.first().copied().filter(|edge| *edge <= time);
            if !importer.go(edge.unwrap_or(time))? {
                end = End::Left(importer.instance.time());
                break;
            }
            // A jump of an input is an event at a time that is known.
            let Some(_) = edge else { break };
            edges.remove(0);
            importer.event()?;
        }
        if end == End::Complete {
            let (time, states) = (importer.time, importer.states.clone());
            importer.put(time, time, &states)?;
            let mut values = vec![0.0; opened.positions.len()];
            importer.instance.reals(&opened.positions, &mut values).map_err(told)?;
            positions.push(values);
        }
    }
    let machine = subject.machine(&mut Double::from);
    let rows = rows(subject, &machine, &positions);
    let fed = if matches!(subject, Subject::Loop(_)) { Fed::Sampled } else { Fed::AsGiven };
    Ok(Answer { subject: None, fed, times, rows, events: None, end, allowed: ALLOWED, is_stated: false, ties: 0 })
}
