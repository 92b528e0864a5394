//! Where the instructions of a work go: what each function of a profile of callgrind's takes by itself, added up by
//! kinds of work.

use std::collections::HashMap;

/// Kinds of work, and what the names of their functions contain; the first that fits counts. What fits none is told as
/// the rest.
const KINDS: [(&str, &[&str]); 8] = [
    (
        "memory: allocation, clearing, copying",
        &[
            "malloc",
            "calloc",
            "realloc",
            "free",
            "unlink_chunk",
            "memset",
            "memcpy",
            "memmove",
            "alloc::",
            "_rdl_",
            "__rust_",
        ],
    ),
    (
        "figures: evaluation of the motion, peaks between rows",
        &["solve::observe", "exact::shown", "matrices::shown", "metrics", "call_once_force"],
    ),
    (
        "rows: propagation, columns, delivery",
        &["solve::record", "advance_rows", "trajectory", "Run<_>::p", "Coordinates"],
    ),
    (
        "event search: bounds over intervals, certain steps",
        &[
            "look",
            "safe_intervals",
            "undecided",
            "steepness",
            "size_by",
            "noise",
            "::values",
            "roots::",
            "Row<_>::along",
            "growth",
        ],
    ),
    (
        "series near events, event handling",
        &["series", "Series", "change", "resolve", "Core<_>", "first_term", "Event"],
    ),
    (
        "new modes: equations, guards, matrix exponentials",
        &["matrices", "equations", "Layout", "exponential", "doubled", "Mechanism>::"],
    ),
    ("steps by matrices", &["propagator"]),
    (
        "machines: random points, checks, mechanism",
        &["sweep", "parameter", "stage", "mechanism", "Mechanism", "check", "friction"],
    ),
];

/// The share of each kind of work, and of the rest, in a profile.
pub fn shares(profile: &str) -> Vec<(&'static str, f64)> {
    let mut costs = [0_u64; KINDS.len() + 1];
    for (name, cost) in by_function(profile) {
        let kind = KINDS.iter().position(|(_, parts)| parts.iter().any(|part| name.contains(part)));
        costs[kind.unwrap_or(KINDS.len())] += cost;
    }
    let whole = costs.iter().sum::<u64>().max(1) as f64;
    let names = KINDS.iter().map(|(name, _)| *name).chain(["the rest"]);
    names.zip(costs).map(|(name, cost)| (name, cost as f64 / whole)).collect()
}

/// The cost of each function by itself. Names are told once and then by number: `fn=(12) name`, `fn=(12)`. Lines of
/// cost begin with a place, a number by itself or against the one before; the one behind `calls=` is that of who is
/// called.
fn by_function(profile: &str) -> HashMap<String, u64> {
    let mut names = HashMap::new();
    let mut costs = HashMap::new();
    let (mut function, mut is_call) = (String::new(), false);
    for line in profile.lines() {
        if let Some(name) = line.strip_prefix("fn=").or_else(|| line.strip_prefix("cfn=")) {
            let (number, told) = name.split_once(' ').map_or((name, None), |(number, told)| (number, Some(told)));
            if let Some(told) = told {
                names.insert(number.to_string(), told.to_string());
            }
            if line.starts_with("fn=") {
                function = names.get(number).cloned().unwrap_or_default();
            }
        } else if line.starts_with("calls=") {
            is_call = true;
        } else if line.starts_with(|c: char| c.is_ascii_digit() || "+-*".contains(c)) {
            let cost = line.split_whitespace().nth(1).and_then(|cost| cost.parse::<u64>().ok()).unwrap_or(0);
            if !is_call {
                *costs.entry(function.clone()).or_insert(0) += cost;
            }
            is_call = false;
        }
    }
    costs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_counts_for_who_is_called_alone() {
        let profile = "events: Ir\n\nfn=(1) taut::solve::roots::first_fall\n3 40\n+2 20\ncfn=(2) _int_malloc\ncalls=3 0\n* 30\n\
                       fn=(2)\n0 30\nfn=(3) main\n9 10\n";
        let shares = shares(profile);
        let share = |part: &str| shares.iter().find(|(name, _)| name.starts_with(part)).map(|(_, share)| *share);
        assert_eq!(share("event search"), Some(0.6));
        assert_eq!(share("memory"), Some(0.3));
        assert_eq!(share("the rest"), Some(0.1));
        assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
