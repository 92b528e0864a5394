//! A learned signal in words.

use crate::motion::length;
use crate::simulate::value;
use taut::learning::{Learned, Predicted};

/// The answer in a line.
pub fn head(found: &Learned) -> String {
    let next = found.predicted.first().map_or(found.now, |predicted| predicted.worst);
    format!("error {} rms now, at most {} after the next repetition", length(found.now.rms), length(next.rms))
}

/// Convergence and signal with their names; `unit` is that of the signal.
pub fn lines(found: &Learned, unit: &str) -> Vec<(&'static str, String)> {
    let [from, to] = found.band;
    vec![
        ("error", format!("{} rms, {} at most", length(found.now.rms), length(found.now.peak))),
        ("learned", format!("{} to {}, {:.1} % of the error", value(from, "Hz"), value(to, "Hz"), 100.0 * found.share)),
        (
            "converges",
            format!("each repetition leaves at most {:.0} % on {} axes", 100.0 * found.contraction, found.axes),
        ),
        (
            "signal",
            format!(
                "at most {}, {} values every {}",
                value(found.largest(), unit),
                found.next.len(),
                value(found.every, "s")
            ),
        ),
    ]
}

/// The repetitions to come: number, rms and peak on the machine of the file, and the largest of the family.
pub fn trials(found: &Learned) -> Vec<[String; 5]> {
    let row = |(k, one): (usize, &Predicted)| {
        let sizes = [one.nominal.rms, one.nominal.peak, one.worst.rms, one.worst.peak].map(length);
        let [a, b, c, d] = sizes;
        [format!("{}", k + 1), a, b, c, d]
    };
    found.predicted.iter().enumerate().map(row).collect()
}
