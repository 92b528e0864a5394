//! Feed-forward for each drive of a machine with several, from the references of all sliding parts.

use super::compensation::direction;
use crate::design::{FeedForward, FeedForwardModel};
use crate::machine::rigid::Rigid;
use crate::machine::{Machine, SlideAt};
use crate::signal::profile::Reference;

/// Feed-forward of one drive, with rigid belts.
#[derive(Debug, Clone)]
pub struct Forward {
    settings: FeedForward,
    /// The drive with its pulley.
    pulley: Rigid,
    /// For each sliding part: weight of its position in the drive's, weight of the drive's in its position, and the
    /// part.
    slides: Vec<(f64, f64, Rigid)>,
}

impl Forward {
    /// Feed-forward of `drive` with these factors on inertia and friction; none without feed-forward, or for an axis,
    /// which has [`Compensation`](super::compensation::Compensation).
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

    /// Motor force at the belt, N, and the rate of its inertial part, N/s.
    ///
    /// The motors do the work of the forces on the slides: Σ_k f_k r dφ_k = Σ_s F_s dq_s with q_s = Σ_k w_sk r φ_k, so
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

    /// Command for this force, V or A.
    pub fn command(&self, slides: &[Reference]) -> f64 {
        let [force, rate] = self.force(slides);
        self.pulley.command(force, rate, &self.drive(slides))
    }

    /// Motor current, A, and terminal voltage, V, for this force.
    pub fn electrical(&self, slides: &[Reference]) -> (f64, f64) {
        let [force, rate] = self.force(slides);
        self.pulley.electrical(force, rate, &self.drive(slides))
    }

    /// The motion of its pulley, with the share of the inertia that is fed forward.
    fn drive(&self, slides: &[Reference]) -> Reference {
        let (y, share) = (self.along(slides), self.settings.inertia);
        Reference { acceleration: y.acceleration * share, jerk: y.jerk * share, ..y }
    }

    /// F = M y″ + b y′ + F_c sgn y′ − F₀, and the rate of its inertial part, N and N/s.
    fn of_part(&self, part: &Rigid, y: &Reference) -> [f64; 2] {
        let (viscous, dry) = part.friction(y.speed, direction(y));
        let mass = self.settings.inertia * part.mass;
        [y.acceleration * mass + (viscous + dry) * self.settings.friction - part.constant, y.jerk * mass]
    }
}
