//! The hunt over random stages: many of them on several threads, and the table of what came out.

use crate::by::By;
use crate::compare::{Compared, Verdict, compare};
use crate::draw::{self, Drawn, Feature, StageKind};
use serde_json::{Value, json};
use std::fmt::Write;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Every so many stages the general solver is asked, too.
const GENERAL_EVERY: u64 = 20;

/// A stage that runs longer is named.
const LONG: Duration = Duration::from_secs(60);

/// The hunt that is asked for.
#[derive(Debug, Clone)]
pub struct Hunt {
    /// Which stages.
    pub seed: u64,
    /// The number of the first one.
    pub first: u64,
    /// How many.
    pub count: u64,
    /// Threads.
    pub threads: usize,
    /// True if to tell on the way how far it is.
    pub progress: bool,
    /// Ends it early; cases under way do not count.
    pub stop: Arc<AtomicBool>,
    /// The features that are drawn.
    pub drawing: Drawing,
}

/// The features that are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawing {
    /// Stages linear piece by piece, over wide ranges.
    Stages,
    /// Cases in which each pair of features occurs.
    Pairs,
    /// The same with a dual belt in place of their machines.
    DualBelts,
}

/// A stage that was compared.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Its number.
    pub number: u64,
    /// Its case file.
    pub text: String,
    /// The kinds that it belongs to.
    pub kinds: Vec<StageKind>,
    /// The features of its recipe.
    pub features: Vec<Feature>,
    /// The answers of the solvers.
    pub compared: Vec<Compared>,
}

/// Compares the stage of this number.
pub fn one(seed: u64, number: u64) -> Outcome {
    let drawn = draw::stage(seed, number);
    let solvers: &[By] = if number.is_multiple_of(GENERAL_EVERY) { &[By::Exact, By::General] } else { &[By::Exact] };
    let compared = compare(&format!("stage-{number}.toml"), &drawn.text, solvers, &[]);
    Outcome { number, text: drawn.text, kinds: drawn.kinds, features: Vec::new(), compared }
}

/// Compares the case of this number that is drawn by features.
pub fn pair(seed: u64, number: u64) -> Outcome {
    by_features(number, draw::pair(seed, number))
}

/// Compares the dual belt of this number.
pub fn dual_belt(seed: u64, number: u64) -> Outcome {
    by_features(number, draw::dual_belt(seed, number))
}

fn by_features(number: u64, (drawn, features): (Drawn, Vec<Feature>)) -> Outcome {
    let asked = features.iter().find_map(|feature| if let Feature::Asked(by) = feature { Some(*by) } else { None });
    // Rows farther apart or nearer together change no position.
    let every = if number.is_multiple_of(2) { 3.1 } else { 0.17 };
    let ways: Vec<By> = asked.into_iter().collect();
    let compared = compare(&format!("pair-{number}.toml"), &drawn.text, &ways, &[every]);
    Outcome { number, text: drawn.text, kinds: drawn.kinds, features, compared }
}

impl Hunt {
    /// Compares all of them; the same whatever the number of threads. Those that were done, in the order of their
    /// numbers.
    pub fn run(&self) -> Vec<Outcome> {
        let next = AtomicU64::new(0);
        let (done, unexplained) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let found = Mutex::new(Vec::new());
        let busy: Vec<Mutex<Option<(u64, Instant)>>> = (0..self.threads).map(|_| Mutex::new(None)).collect();
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let workers: Vec<_> = busy
                .iter()
                .map(|busy| {
                    let (next, done, unexplained, found) = (&next, &done, &unexplained, &found);
                    scope.spawn(move || {
                        while !self.stop.load(Ordering::Relaxed) {
                            let index = next.fetch_add(1, Ordering::Relaxed);
                            if index >= self.count {
                                break;
                            }
                            let number = self.first + index;
                            *lock(busy) = Some((number, Instant::now()));
                            let outcome = match self.drawing {
                                Drawing::Stages => one(self.seed, number),
                                Drawing::Pairs => pair(self.seed, number),
                                Drawing::DualBelts => dual_belt(self.seed, number),
                            };
                            *lock(busy) = None;
                            // The signal that ends the hunt ends its compilers and programs, too.
                            if self.stop.load(Ordering::Relaxed) {
                                break;
                            }
                            done.fetch_add(1, Ordering::Relaxed);
                            let faults = outcome.compared.iter().filter(|c| c.verdict.is_unexplained()).count();
                            unexplained.fetch_add(faults, Ordering::Relaxed);
                            lock(found).push(outcome);
                        }
                    })
                })
                .collect();
            if self.progress {
                scope.spawn(|| self.tell(&done, &unexplained, &busy, &over));
            }
            for worker in workers {
                // A panic of taut is caught where it happens.
                let _ = worker.join();
            }
            over.store(true, Ordering::Relaxed);
        });
        let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
        found.sort_by_key(|outcome: &Outcome| outcome.number);
        found
    }

    /// How far it is, on standard error.
    fn tell(
        &self,
        done: &AtomicUsize,
        unexplained: &AtomicUsize,
        busy: &[Mutex<Option<(u64, Instant)>>],
        over: &AtomicBool,
    ) {
        let begin = Instant::now();
        let mut told = begin;
        while !over.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(100));
            if told.elapsed() < Duration::from_secs(10) {
                continue;
            }
            told = Instant::now();
            let (done, elapsed) = (done.load(Ordering::Relaxed), begin.elapsed().as_secs_f64());
            let rest = (self.count as f64 - done as f64) * elapsed / done.max(1) as f64;
            let faults = unexplained.load(Ordering::Relaxed);
            eprintln!("{done} of {} stages, {faults} unexplained; about {:.0} s left", self.count, rest);
            for (number, since) in busy.iter().filter_map(|busy| *lock(busy)) {
                if since.elapsed() > LONG {
                    eprintln!("  stage {number} has been running for {:.0} s", since.elapsed().as_secs_f64());
                }
            }
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Verdict {
    /// True if it is a find.
    pub fn is_unexplained(&self) -> bool {
        matches!(self, Verdict::Unexplained(_))
    }

    /// Its name.
    pub fn word(&self) -> &'static str {
        match self {
            Verdict::Agrees => "agrees",
            Verdict::IllConditioned(_) => "ill-conditioned",
            Verdict::Unknown(_) => "unknown",
            Verdict::Unexplained(_) => "unexplained",
        }
    }

    /// The rest of the finding in words.
    pub fn told(&self) -> &str {
        match self {
            Verdict::Agrees => "",
            Verdict::IllConditioned(told) | Verdict::Unknown(told) | Verdict::Unexplained(told) => told,
        }
    }
}

/// A line of the table.
#[derive(Debug, Clone, Default)]
struct Line {
    name: String,
    stages: usize,
    agrees: usize,
    ill_conditioned: usize,
    unknown: usize,
    unexplained: usize,
    /// Runs that are off by more than they state.
    exceeds: usize,
    /// The largest difference among those that agree, m.
    worst: f64,
    /// Changes of bodies.
    events: usize,
}

impl Line {
    fn new<'a>(name: &str, compared: impl Iterator<Item = &'a Compared>) -> Self {
        let mut line = Self { name: name.into(), ..Self::default() };
        for compared in compared {
            line.stages += 1;
            line.events += compared.events;
            line.exceeds += usize::from(compared.exceeds);
            match compared.verdict {
                Verdict::Agrees => {
                    line.agrees += 1;
                    line.worst = line.worst.max(compared.difference);
                }
                Verdict::IllConditioned(_) => line.ill_conditioned += 1,
                Verdict::Unknown(_) => line.unknown += 1,
                Verdict::Unexplained(_) => line.unexplained += 1,
            }
        }
        line
    }

    fn json(&self) -> Value {
        json!({
            "stages": self.name,
            "compared": self.stages,
            "agreeing": self.agrees,
            "ill_conditioned": self.ill_conditioned,
            "unknown": self.unknown,
            "unexplained": self.unexplained,
            "beyond_stated": self.exceeds,
            "worst_agreeing_m": self.worst,
            "events": self.events,
        })
    }
}

fn lines(outcomes: &[Outcome]) -> Vec<Line> {
    let by = |by: By| move |outcome: &'_ Outcome| outcome.compared.iter().find(|compared| compared.by == by).cloned();
    let all = |solver: By, kind: Option<StageKind>| -> Vec<Compared> {
        let of_kind = outcomes.iter().filter(|outcome| kind.is_none_or(|kind| outcome.kinds.contains(&kind)));
        of_kind.filter_map(by(solver)).collect()
    };
    if outcomes.iter().any(|outcome| !outcome.features.is_empty()) {
        let of_feature = |feature: Feature| {
            let having = outcomes.iter().filter(move |outcome| outcome.features.contains(&feature));
            Line::new(feature.names()[0], having.flat_map(|outcome| &outcome.compared))
        };
        let whole = Line::new("all", outcomes.iter().flat_map(|outcome| &outcome.compared));
        return std::iter::once(whole).chain(Feature::ALL.map(of_feature)).collect();
    }
    let mut lines = vec![Line::new("all", all(By::Exact, None).iter())];
    lines.extend(StageKind::ALL.map(|kind| Line::new(kind.name(), all(By::Exact, Some(kind)).iter())));
    lines.push(Line::new("all, by the general solver", all(By::General, None).iter()));
    lines
}

/// How often each pair of features occurs among cases with these, in Markdown; `–` where it cannot.
pub fn pairs_table<'a>(cases: impl Iterator<Item = &'a [Feature]>) -> String {
    let place = |feature: Feature| Feature::ALL.iter().position(|one| *one == feature).unwrap_or(0);
    let mut counts = vec![vec![0_u64; Feature::ALL.len()]; Feature::ALL.len()];
    for features in cases {
        for &a in features {
            for &b in features {
                counts[place(a)][place(b)] += 1;
            }
        }
    }
    let columns = &Feature::ALL[..Feature::ALL.len()];
    let mut text = String::from("| | |");
    columns.iter().for_each(|feature| text += &format!(" {} |", feature.names()[1]));
    text += "\n|---|---|";
    columns.iter().for_each(|_| text += "---|");
    text += "\n";
    for (i, a) in Feature::ALL.iter().enumerate() {
        let _ = write!(text, "| {} | {} |", a.names()[0], a.names()[1]);
        for (j, b) in columns.iter().enumerate() {
            let _ = match () {
                () if j > i => write!(text, " |"),
                () if j == i => write!(text, " **{}** |", counts[i][j]),
                () if a.goes_with(*b) || counts[i][j] > 0 => write!(text, " {} |", counts[i][j]),
                () => write!(text, " – |"),
            };
        }
        text += "\n";
    }
    text
}

/// The pair that occurs least often among those that can.
pub fn rarest_pair<'a>(cases: impl Iterator<Item = &'a [Feature]> + Clone) -> ([Feature; 2], usize) {
    let count = |[a, b]: [Feature; 2]| cases.clone().filter(|case| case.contains(&a) && case.contains(&b)).count();
    let counted = draw::pairs().into_iter().map(|pair| (pair, count(pair)));
    counted.min_by_key(|(_, count)| *count).unwrap_or(([Feature::Open; 2], 0))
}

/// The table of a hunt, in Markdown.
pub fn table(outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "| stages | compared | agreeing | ill-conditioned | unknown | unexplained | beyond stated | worst agreeing | body events |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for line in lines(outcomes) {
        let Line { name, stages, agrees, ill_conditioned, unknown, unexplained, exceeds, worst, events } = line;
        let _ = writeln!(
            text,
            "| {name} | {stages} | {agrees} | {ill_conditioned} | {unknown} | {unexplained} | {exceeds} | {worst:.1e} m | {events} |"
        );
    }
    text
}

/// The unexplained stages and those beyond their stated accuracy, or `all` that do not agree, with their cases.
pub fn told(seed: u64, outcomes: &[Outcome], all: bool) -> String {
    let mut text = String::new();
    for outcome in outcomes {
        for compared in &outcome.compared {
            if compared.verdict.is_unexplained() || compared.exceeds || (all && compared.verdict != Verdict::Agrees) {
                let way = compared.by.name();
                let (number, word, why) = (outcome.number, compared.verdict.word(), compared.verdict.told());
                let beyond = if compared.exceeds { ", beyond its stated accuracy" } else { "" };
                let _ = writeln!(text, "# seed {seed}, stage {number}, {way}, {word}{beyond}: {why}\n{}", outcome.text);
            }
        }
    }
    text
}

/// All of it as data.
pub fn json(hunt: &Hunt, outcomes: &[Outcome]) -> Value {
    let apart = outcomes.iter().flat_map(|outcome| outcome.compared.iter().map(move |compared| (outcome, compared)));
    let apart = apart.filter(|(_, compared)| compared.verdict != Verdict::Agrees).map(|(outcome, compared)| {
        json!({
            "number": outcome.number,
            "by": compared.by.name(),
            "verdict": compared.verdict.word(),
            "told": compared.verdict.told(),
            "difference_m": compared.difference,
            "allowed_m": compared.allowed,
            "is_beyond_stated": compared.exceeds,
            "perturbed_m": compared.spread,
            "case": outcome.text,
        })
    });
    json!({
        "part": "stages",
        "seed": hunt.seed,
        "first": hunt.first,
        "asked": hunt.count,
        "done": outcomes.len(),
        "table": lines(outcomes).iter().map(Line::json).collect::<Vec<_>>(),
        "not_agreeing": apart.collect::<Vec<_>>(),
    })
}
