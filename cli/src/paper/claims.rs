//! A claim, the numbers that decide it, and the rules by which they do.

use serde::Serialize;

/// Less than a tenth.
pub const MINOR: f64 = 0.1;
/// Less than a hundredth.
pub const NOT_APPRECIABLE: f64 = 0.01;

/// One statement with what this run makes of it.
#[derive(Debug, Clone)]
pub struct Claim {
    /// Its name, for ever.
    pub id: &'static str,
    /// Kind of statement.
    pub kind: ClaimSource,
    /// Section, figure, table or equation.
    pub source: &'static str,
    /// The statement: the paper's, short.
    pub statement: &'static str,
    /// The numbers; the first is the one that is shown.
    pub checks: Vec<Check>,
    /// The finding in a few words with a number; empty where the first number says it.
    pub found: String,
    /// A remark; where there are no checks, the reason.
    pub remark: String,
}

/// Whose statement it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ClaimSource {
    /// A sentence of the paper.
    Statement,
    /// A number, an equation or a program as printed.
    Print,
    /// A statement of ours about the paper.
    Reading,
    /// A number of an independent solution, to hold this one against.
    Reference,
}

/// One number and its rule.
#[derive(Debug, Clone)]
pub struct Check {
    /// The name of the number.
    pub what: String,
    /// The number, SI.
    pub value: f64,
    /// Its unit; `1` for a relative change, empty for ratios and counts.
    pub unit: &'static str,
    /// When it holds.
    pub rule: Rule,
    /// True if the claim falls with it; otherwise it only earns a remark.
    pub decides: bool,
}

/// When a number holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Within `tolerance` of `expected`.
    Near {
        /// The printed number.
        expected: f64,
        /// How far off it may be.
        tolerance: f64,
    },
    /// Not above.
    AtMost(f64),
    /// Not below.
    AtLeast(f64),
}

/// The verdict on a claim. Computed by [`Claim::verdict`], and by nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Every number holds.
    Confirmed,
    /// The deciding checks hold, another one does not.
    WithRemark,
    /// One that decides does not hold.
    NotConfirmed,
    /// There is no number.
    CannotBeChecked,
}

impl Rule {
    /// True if `value` satisfies it; what is not a number satisfies nothing.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Rule::Near { expected, tolerance } => (value - expected).abs() <= tolerance,
            Rule::AtMost(limit) => value <= limit,
            Rule::AtLeast(limit) => value >= limit,
        }
    }

    /// The rule as ASCII words: `within 1e-12 of 0.0537`.
    pub fn words(self) -> String {
        match self {
            Rule::Near { expected, tolerance } => format!("within {tolerance:e} of {expected}"),
            Rule::AtMost(limit) => format!("at most {limit}"),
            Rule::AtLeast(limit) => format!("at least {limit}"),
        }
    }
}

impl Verdict {
    /// All of them.
    pub const ALL: [Verdict; 4] =
        [Verdict::Confirmed, Verdict::WithRemark, Verdict::NotConfirmed, Verdict::CannotBeChecked];

    /// As it stands in `claims.json`.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Confirmed => "confirmed",
            Verdict::WithRemark => "confirmed with a remark",
            Verdict::NotConfirmed => "not confirmed",
            Verdict::CannotBeChecked => "cannot be checked",
        }
    }
}

impl Claim {
    /// A claim without numbers yet.
    pub fn new(id: &'static str, kind: ClaimSource, source: &'static str, statement: &'static str) -> Self {
        Self { id, kind, source, statement, checks: Vec::new(), found: String::new(), remark: String::new() }
    }

    /// Adds a number with which the claim stands or falls.
    pub fn decide(mut self, what: impl Into<String>, value: f64, unit: &'static str, rule: Rule) -> Self {
        self.checks.push(Check { what: what.into(), value, unit, rule, decides: true });
        self
    }

    /// Adds a number that earns a remark where it does not hold.
    pub fn further(mut self, what: impl Into<String>, value: f64, unit: &'static str, rule: Rule) -> Self {
        self.checks.push(Check { what: what.into(), value, unit, rule, decides: false });
        self
    }

    /// Sets what was found.
    pub fn found(mut self, found: impl Into<String>) -> Self {
        self.found = found.into();
        self
    }

    /// Sets the remark.
    pub fn remark(mut self, remark: impl Into<String>) -> Self {
        self.remark = remark.into();
        self
    }

    /// The verdict that follows from the checks.
    pub fn verdict(&self) -> Verdict {
        let fails = |decides: bool| self.checks.iter().any(|c| c.decides == decides && !c.rule.holds(c.value));
        if !self.checks.iter().any(|c| c.decides) {
            Verdict::CannotBeChecked
        } else if fails(true) {
            Verdict::NotConfirmed
        } else if fails(false) {
            Verdict::WithRemark
        } else {
            Verdict::Confirmed
        }
    }
}

/// A claim as it stands in `claims.json`.
#[derive(Serialize)]
struct Entry<'a> {
    id: &'a str,
    kind: ClaimSource,
    source: &'a str,
    statement: &'a str,
    value: Option<f64>,
    unit: Option<&'a str>,
    expected: Option<f64>,
    tolerance: Option<f64>,
    rule: Option<String>,
    verdict: &'static str,
    found: &'a str,
    remark: &'a str,
    checks: Vec<EntryCheck<'a>>,
}

#[derive(Serialize)]
struct EntryCheck<'a> {
    what: &'a str,
    value: f64,
    unit: &'a str,
    rule: String,
    decides: bool,
    holds: bool,
}

/// All claims as JSON, ending with a line break.
pub fn json(claims: &[Claim]) -> String {
    taut::json::text(&claims.iter().map(entry).collect::<Vec<_>>())
}

fn entry(claim: &Claim) -> Entry<'_> {
    let first = claim.checks.first();
    let (expected, tolerance) = match first.map(|c| c.rule) {
        Some(Rule::Near { expected, tolerance }) => (Some(expected), Some(tolerance)),
        _ => (None, None),
    };
    let check = |c: &'_ Check| (c.rule.words(), c.rule.holds(c.value));
    Entry {
        id: claim.id,
        kind: claim.kind,
        source: claim.source,
        statement: claim.statement,
        value: first.map(|c| c.value),
        unit: first.map(|c| c.unit),
        expected,
        tolerance,
        rule: first.map(|c| c.rule.words()),
        verdict: claim.verdict().word(),
        found: &claim.found,
        remark: &claim.remark,
        checks: claim
            .checks
            .iter()
            .map(|c| {
                let (rule, holds) = check(c);
                EntryCheck { what: &c.what, value: c.value, unit: c.unit, rule, decides: c.decides, holds }
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim() -> Claim {
        Claim::new("x", ClaimSource::Statement, "section 0", "\"x\"")
    }

    #[test]
    fn a_falsified_number_turns_the_verdict() {
        let near = Rule::Near { expected: 0.053744890394, tolerance: 1e-12 };
        assert_eq!(claim().decide("", 0.0537448903943, "m", near).verdict(), Verdict::Confirmed);
        assert_eq!(claim().decide("", 0.0537448903962, "m", near).verdict(), Verdict::NotConfirmed);
        assert_eq!(claim().decide("", f64::NAN, "m", near).verdict(), Verdict::NotConfirmed);
        for (rule, good, bad) in [(Rule::AtMost(1.0), 1.0, 1.1), (Rule::AtLeast(1.0), 1.0, 0.9)] {
            assert_eq!(claim().decide("", good, "", rule).verdict(), Verdict::Confirmed);
            assert_eq!(claim().decide("", bad, "", rule).verdict(), Verdict::NotConfirmed);
            assert_eq!(claim().decide("", f64::NAN, "", rule).verdict(), Verdict::NotConfirmed);
            assert_eq!(claim().decide("", good, "", rule).further("", bad, "", rule).verdict(), Verdict::WithRemark);
            assert_eq!(claim().decide("", bad, "", rule).further("", good, "", rule).verdict(), Verdict::NotConfirmed);
        }
    }

    #[test]
    fn without_a_number_there_is_no_verdict() {
        assert_eq!(claim().remark("no data").verdict(), Verdict::CannotBeChecked);
        assert_eq!(claim().further("", 0.0, "", Rule::AtMost(1.0)).verdict(), Verdict::CannotBeChecked);
        assert!(json(&[claim()]).contains("\"value\": null"));
    }
}
