//! Feed-forward with the tuned gains, which often improves more than any gains.

use super::judged::Verdict;
use super::work::Work;
use crate::design::{Design, FeedForward, FeedForwardModel};
use crate::error::Result;
use crate::machine::{BeltModel, EncoderPlace, Machine};

/// Largest remaining fraction of the largest error for which feed-forward is recommended.
const PAYS: f64 = 0.9;

/// Feed-forward that improves the moves beyond the gains alone.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Ahead {
    /// The verdict on the gains with it.
    pub verdict: Verdict,
}

impl Ahead {
    /// Value of `controller.feed_forward` in a case file.
    pub fn text(&self) -> String {
        let FeedForward { model, compensate_stretch, .. } = self.verdict.design.feed_forward;
        let stretch = if compensate_stretch { ", compensate_stretch = true" } else { "" };
        format!("{{ model = \"{}\"{stretch} }}", model.word())
    }
}

/// Forms of feed-forward beyond a design's own on this machine.
fn forms(machine: &Machine, design: &Design) -> Vec<FeedForward> {
    let own = &design.feed_forward;
    // State feedback and sliding mode already have a model.
    if design.structure.tunable().feed_forward() != FeedForwardModel::None {
        return Vec::new();
    }
    let models: &[FeedForwardModel] = match own.model {
        FeedForwardModel::None => &[FeedForwardModel::Rigid, FeedForwardModel::Elastic],
        FeedForwardModel::Rigid => &[FeedForwardModel::Elastic],
        FeedForwardModel::Elastic => &[],
    };
    let is_elastic = machine.belt.model != BeltModel::Rigid;
    let sees_stretch = machine.encoder.is_some_and(|encoder| encoder.at == EncoderPlace::Cart)
        || design.structure.tunable().follows_scale() && machine.scale.is_some();
    let mut forms = Vec::new();
    for &model in models.iter().filter(|model| is_elastic || **model != FeedForwardModel::Elastic) {
        for compensate_stretch in [own.compensate_stretch, true] {
            let form = FeedForward { model, compensate_stretch, ..FeedForward::NONE };
            let cannot = compensate_stretch && (sees_stretch || !is_elastic);
            if !cannot && !forms.contains(&form) {
                forms.push(form);
            }
        }
    }
    forms
}

impl Work<'_> {
    /// The feed-forward that improves most on the gains of `after`: it reduces J, and the largest error by a tenth or
    /// more; none if no feed-forward does.
    pub fn ahead(&self, after: &Verdict) -> Result<Option<Ahead>> {
        let mut best: Option<Verdict> = None;
        for feed_forward in forms(&self.case.machine, &after.design) {
            if (self.stop)() {
                return Ok(None);
            }
            let verdict = self.verdict(&Design { feed_forward, ..after.design.clone() })?;
            // A J of NaN is not smaller.
            if verdict.objective < best.as_ref().unwrap_or(after).objective {
                best = Some(verdict);
            }
        }
        let worst = |verdict: &Verdict| verdict.moves.iter().map(|one| one.at_worst.error.0).fold(0.0, f64::max);
        Ok(best.filter(|best| worst(best) <= PAYS * worst(after)).map(|verdict| Ahead { verdict }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    /// A PID may get a model, state feedback has one.
    #[test]
    fn only_what_is_not_there_is_tried() {
        let read = |name: &str, changes: &[&str]| {
            let file = format!("{}/../stages/sollmann-jouaneh/controllers/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let case = Case::read_with(&file, changes).unwrap();
            let forms = forms(&case.machine, case.controller.as_ref().unwrap());
            forms.iter().map(|form| (form.model, form.compensate_stretch)).collect::<Vec<_>>()
        };
        use FeedForwardModel::{Elastic, Rigid};
        let all = [(Rigid, false), (Rigid, true), (Elastic, false), (Elastic, true)];
        assert_eq!(read("pid", &[]), all);
        assert_eq!(read("pid", &["belt.model=\"rigid\""]), [(Rigid, false)]);
        assert_eq!(read("lqg", &[]), []);
        assert_eq!(read("sliding", &[]), []);
    }
}
