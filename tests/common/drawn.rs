//! Machines drawn about a case.

use rand_pcg::Pcg64;
use taut::case::Case;
use taut::chance::uniform;

/// Changes of a case that multiply these numbers of its machine, if it has them, by factors from a half to two.
pub fn off_by_two(case: &Case, keys: &[&str], random: &mut Pcg64) -> Vec<String> {
    let change = |key: &&str| {
        let factor = 2f64.powf(2.0 * uniform(random) - 1.0);
        Some(format!("{key}={}", factor * taut::parameter::value(&case.machine, key)?))
    };
    keys.iter().filter_map(change).collect()
}
