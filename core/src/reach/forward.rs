//! Feed-forward of each drive of a machine with several, from the references of all sliding parts together.

use super::compensation::direction;
use crate::design::{FeedForward, FeedForwardModel};
use crate::machine::rigid::Rigid;
use crate::machine::{Machine, SlideAt};
use crate::signal::profile::Reference;

/// One drive, the belts taken for rigid.
#[derive(Debug, Clone)]
pub struct Forward {
    settings: FeedForward,
    /// The drive with its pulley.
    pulley: Rigid,
    /// Each sliding part: its share of the drive's travel, its travel per travel of the drive, and itself.
    slides: Vec<(f64, f64, Rigid)>,
}

impl Forward {
    /// That of drive `drive` with these shares of inertia and friction; none of an axis, which
    /// [`Compensation`](super::compensation::Compensation) knows better, and without feed-forward.
    pub fn of(settings: FeedForward, machine: &Machine, drive: usize) -> Option<Self> {
        if machine.drives.len() == 1 || settings.model == FeedForwardModel::None {
            return None;
        }
        let shares = machine.belt_shares()[drive];
        let slides = machine.geometry().slides.iter().enumerate();
        let slide = |(number, at): (usize, &SlideAt)| {
            Some((shares[number], at.by_drives[drive], Rigid::of_slide(machine, number)?))
        };
        Some(Self { settings, pulley: Rigid::of_pulley(machine, drive), slides: slides.filter_map(slide).collect() })
    }

    /// The reference of its part of the belt.
    pub fn along(&self, slides: &[Reference]) -> Reference {
        let shares = self.slides.iter().zip(slides);
        shares.fold(Reference::default(), |sum, ((share, ..), slide)| sum.plus(*share, *slide))
    }

    /// The force of its motor at the belt, N, and how fast its inertial part changes, N/s.
    ///
    /// The motors do the work of the forces on what slides: Σ_k f_k r dφ_k = Σ_s F_s dq_s with q_s = Σ_k w_sk r φ_k, so
    /// that f_k = Σ_s w_sk F_s, and each also accelerates its own pulley. Dry friction follows the direction of the
    /// rubbing part: of r φ for pulleys, of x and y for bridge and cart.
    pub fn force(&self, slides: &[Reference]) -> [f64; 2] {
        let [mut force, mut rate] = self.of_part(&self.pulley, &self.along(slides));
        for ((_, lever, slide), reference) in self.slides.iter().zip(slides) {
            let [push, change] = self.of_part(slide, reference);
            (force, rate) = (force + lever * push, rate + lever * change);
        }
        [force, rate]
    }

    /// The command that does this, V or A.
    pub fn command(&self, slides: &[Reference]) -> f64 {
        let [force, rate] = self.force(slides);
        self.pulley.command(force, rate, self.along(slides).speed)
    }

    /// Motor current, A, and voltage at its terminals, V, that do this.
    pub fn electrical(&self, slides: &[Reference]) -> (f64, f64) {
        let [force, rate] = self.force(slides);
        self.pulley.electrical(force, rate, self.along(slides).speed)
    }

    /// F = M y″ + b y′ + F_c sgn y′ − F₀, and how fast its inertial part changes, N and N/s.
    fn of_part(&self, part: &Rigid, y: &Reference) -> [f64; 2] {
        let (viscous, dry) = part.friction(y.speed, direction(y));
        let mass = self.settings.inertia * part.mass;
        [y.acceleration * mass + (viscous + dry) * self.settings.friction - part.constant, y.jerk * mass]
    }
}
