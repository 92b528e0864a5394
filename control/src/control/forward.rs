//! Feed-forward of a machine with several drives, whose references have to be known together.

use crate::design::{Design, FeedForward, FeedForwardModel};
use crate::machine::Machine;
use crate::machine::rigid::Rigid;
use crate::reach::compensation::direction;
use crate::signal::profile::Reference;

/// The command of one drive from the references of all that slides, the belts taken for rigid.
#[derive(Debug, Clone)]
pub(super) struct Forward {
    settings: FeedForward,
    /// The drive with its pulley.
    pulley: Rigid,
    /// Slides: weight of the drive's travel, travel per travel of the drive, and the slide as a rigid axis.
    slides: Vec<(f64, f64, Rigid)>,
}

impl Forward {
    /// Feed-forward of drive `drive`; none for an axis, whose controller has its own, or a design without it.
    pub fn of(design: &Design, machine: &Machine, drive: usize) -> Option<Self> {
        let settings = design.feed_forward;
        if machine.drives.len() == 1 || settings.model == FeedForwardModel::None {
            return None;
        }
        let shares = machine.belt_shares()[drive];
        let slides = machine.geometry().slides.iter().enumerate();
        let slide = |(number, at): (usize, &crate::machine::SlideAt)| {
            Some((shares[number], at.by_drives[drive], Rigid::of_slide(machine, number)?))
        };
        Some(Self { settings, pulley: Rigid::of_pulley(machine, drive), slides: slides.filter_map(slide).collect() })
    }

    /// The command for references of all that slides, V or A.
    ///
    /// The motors do the work of the forces on what slides: Σ_k f_k r dφ_k = Σ_s F_s dq_s with q_s = Σ_k w_sk r φ_k, so that
    /// f_k = Σ_s w_sk F_s, and each turns its own pulley beside that. Dry friction goes the way of what rubs: of pulleys
    /// that of r φ, of bridge and cart that of x and y.
    pub fn command(&self, slides: &[Reference]) -> f64 {
        let mut along = Reference::default();
        for ((share, ..), slide) in self.slides.iter().zip(slides) {
            along = along.plus(*share, *slide);
        }
        let [mut force, mut rate] = self.force(&self.pulley, &along);
        for ((_, lever, slide), reference) in self.slides.iter().zip(slides) {
            let [push, change] = self.force(slide, reference);
            (force, rate) = (force + lever * push, rate + lever * change);
        }
        self.pulley.command(force, rate, along.speed)
    }

    /// F = M y″ + b y′ + F_c sgn y′ − F₀, and how fast its inertial part changes, N and N/s.
    fn force(&self, part: &Rigid, y: &Reference) -> [f64; 2] {
        let (viscous, dry) = part.friction(y.speed, direction(y));
        let mass = self.settings.inertia * part.mass;
        [y.acceleration * mass + (viscous + dry) * self.settings.friction - part.constant, y.jerk * mass]
    }
}
