//! Feed-forward for each drive of a machine with several, from the references of all sliding parts.

use super::compensation::{direction, twist};
use crate::design::{FeedForward, FeedForwardModel};
use crate::machine::rigid::Rigid;
use crate::machine::{EncoderPlace, Machine};
use crate::mechanism::{GearPlay, Spring};
use crate::polyline::Polyline;
use crate::signal::profile::Reference;
use nalgebra::{DMatrix, DVector};

/// Feed-forward of one drive, and the reference of its encoder.
#[derive(Debug, Clone)]
pub struct Forward {
    settings: FeedForward,
    /// The drive with its pulley.
    pulley: Rigid,
    slides: Vec<Slide>,
    /// The belt, if it stretches.
    belt: Option<Belt>,
    /// The compliant gear between the encoder and the pulley.
    gear: Option<GearPlay>,
    radius: f64,
}

/// A sliding part as seen by a drive.
#[derive(Debug, Clone)]
struct Slide {
    /// Its weight in the drive's position along the belt.
    share: f64,
    /// The drive's weight in its position.
    lever: f64,
    part: Rigid,
    /// Force over its position, N.
    along: Option<Polyline>,
}

/// The spans of a belt around a drive pulley and the slides.
#[derive(Debug, Clone)]
struct Belt {
    spans: Vec<Spring>,
    /// Elongation of each span per displacement of each slide, and per displacement of the belt at the drive pulley.
    slides: DMatrix<f64>,
    drive: DVector<f64>,
    /// Bodies of the slides.
    bodies: Vec<usize>,
}

/// Motion of the belt at the drive pulley, and the motor force there.
struct Needed {
    drive: Reference,
    /// N; and its rate, N/s.
    force: [f64; 2],
}

impl Forward {
    /// Feed-forward of `drive` with these factors on inertia and friction; none without feed-forward and compensated
    /// stretch, or for an axis, which has [`Compensation`](super::compensation::Compensation).
    pub fn of(settings: FeedForward, machine: &Machine, drive: usize) -> Option<Self> {
        if machine.drives.len() == 1 || settings.model == FeedForwardModel::None && !settings.compensate_stretch {
            return None;
        }
        let is_elastic = settings.model == FeedForwardModel::Elastic || settings.compensate_stretch;
        let shares = machine.belt_shares()[drive];
        let slides = machine.slides().zip(machine.geometry().slides).enumerate().filter_map(|(number, (slide, at))| {
            Some(Slide {
                share: shares[number],
                lever: at.by_drives[drive],
                part: Rigid::of_slide(machine, number)?,
                along: slide.forces.along.clone(),
            })
        });
        let at_motor = machine.encoder.is_none_or(|encoder| encoder.at == EncoderPlace::Motor);
        Some(Self {
            settings,
            pulley: Rigid::of_pulley(machine, drive),
            slides: slides.collect(),
            belt: is_elastic.then(|| Belt::of(machine, drive)),
            gear: machine.drives[drive].motor.gear_play.filter(|_| at_motor),
            radius: machine.pulley_radius,
        })
    }

    /// The reference of its part of the belt, without stretch.
    pub fn along(&self, slides: &[Reference]) -> Reference {
        let shares = self.slides.iter().zip(slides);
        shares.fold(Reference::default(), |sum, (slide, reference)| sum.plus(slide.share, *reference))
    }

    /// The reference of its encoder, for which the slides follow theirs, from that of its part of the belt.
    pub fn target(&self, along: Reference, slides: &[Reference]) -> Reference {
        let Some(belt) = self.belt.as_ref().filter(|_| self.settings.compensate_stretch) else { return along };
        let Needed { drive: mut target, force } = self.stretched(belt, slides);
        if let Some(gear) = self.gear {
            // The rotor's own torque does not pass through the gear.
            let torque = self.radius * (force[0] - self.pulley.rotor * target.acceleration);
            target.position += self.radius * twist(&gear, torque, direction(&along));
        }
        target
    }

    /// Motor force at the belt, N, and the rate of its inertial part, N/s.
    ///
    /// The motors do the work of the forces on the slides: Σ_k f_k r dφ_k = Σ_s F_s dq_s with q_s = Σ_k w_sk r φ_k, so
    /// that f_k = Σ_s w_sk F_s, and each also accelerates its own pulley. Dry friction follows the direction of the
    /// rubbing part: of r φ for pulleys, of x and y for bridge and cart.
    pub fn force(&self, slides: &[Reference]) -> [f64; 2] {
        self.share_of_force(slides, [self.settings.inertia, self.settings.friction])
    }

    /// As [`Forward::force`], with these factors on inertia and friction.
    fn share_of_force(&self, slides: &[Reference], shares: [f64; 2]) -> [f64; 2] {
        let [mut force, mut rate] = of_part(&self.pulley, &self.along(slides), shares);
        for (slide, reference) in self.slides.iter().zip(slides) {
            let [push, change] = slide.push(reference, shares);
            (force, rate) = (force + slide.lever * push, rate + slide.lever * change);
        }
        [force, rate]
    }

    /// The motion of the drive for which the slides follow their references on an elastic belt: quasi-static for the
    /// belt, without its damping.
    ///
    /// With pulleys that lead by S d, y = S (q + d), the spans stretch by s = −A_q d, since rigid motion stretches
    /// none. The slides need F = −A_qᵀ K s, so that d = (A_qᵀ K A_q)⁻¹ F; the belt pulls the pulley back by a_φᵀ K s.
    fn stretched(&self, belt: &Belt, slides: &[Reference]) -> Needed {
        let stiffness = belt.stiffness(slides);
        let of_slides = belt.slides.transpose() * &stiffness * &belt.slides;
        let Some(compliance) = of_slides.try_inverse() else {
            return Needed { drive: self.along(slides), force: self.force(slides) };
        };
        // F = M y″ + b y′ + F_c sgn y′ − F₀ − F_x(y); the rates without F_x′ y′
        let loads: Vec<[f64; 3]> = self.slides.iter().zip(slides).map(|(slide, y)| slide.load(y)).collect();
        let ahead: [DVector<f64>; 3] = std::array::from_fn(|j| {
            &compliance * DVector::from_iterator(loads.len(), loads.iter().map(|load| load[j]))
        });
        let lead =
            |j: usize| -> f64 { self.slides.iter().zip(ahead[j].iter()).map(|(slide, d)| slide.share * d).sum() };
        let y = self.along(slides);
        let drive = Reference {
            position: y.position + lead(0),
            speed: y.speed + lead(1),
            acceleration: y.acceleration + lead(2),
            ..y
        };
        let pull = |j: usize| -belt.drive.dot(&(&stiffness * (&belt.slides * &ahead[j])));
        let (mass, way) = (self.pulley.mass, direction(&y));
        let (viscous, dry) = self.pulley.friction(drive.speed, way);
        let damping = self.pulley.friction(drive.acceleration, way).0;
        Needed {
            drive,
            force: [mass * drive.acceleration + viscous + dry + pull(0), mass * y.jerk + damping + pull(1)],
        }
    }

    /// Command for this force, V or A.
    pub fn command(&self, slides: &[Reference]) -> f64 {
        match (&self.belt, self.settings.model) {
            (_, FeedForwardModel::None) => 0.0,
            (Some(belt), FeedForwardModel::Elastic) => {
                // What is not fed forward of inertia and friction is that of a rigid belt.
                let Needed { drive, force: [force, rate] } = self.stretched(belt, slides);
                let less = self.share_of_force(slides, [1.0; 2])[0] - self.force(slides)[0];
                self.pulley.command(force - less, rate, &self.accelerated(drive))
            }
            _ => {
                let [force, rate] = self.force(slides);
                self.pulley.command(force, rate, &self.accelerated(self.along(slides)))
            }
        }
    }

    /// The command in two parts: the current for a current loop, A, and the voltage for the back-EMF, V.
    pub fn split(&self, slides: &[Reference]) -> (f64, f64) {
        let command = self.command(slides);
        if command == 0.0 {
            return (0.0, 0.0);
        }
        let outside = self.pulley.command(0.0, 0.0, &Reference::steady(self.along(slides).speed));
        ((command - outside) * self.pulley.amperes_per_command(), outside)
    }

    /// Motor current, A, and terminal voltage, V, for the force with a rigid belt.
    pub fn electrical(&self, slides: &[Reference]) -> (f64, f64) {
        let [force, rate] = self.force(slides);
        self.pulley.electrical(force, rate, &self.accelerated(self.along(slides)))
    }

    /// A motion of the pulley with the share of the inertia that is fed forward.
    fn accelerated(&self, y: Reference) -> Reference {
        let share = self.settings.inertia;
        Reference { acceleration: y.acceleration * share, jerk: y.jerk * share, ..y }
    }
}

/// F = M y″ + b y′ + F_c sgn y′ − F₀, and the rate of its inertial part, N and N/s.
fn of_part(part: &Rigid, y: &Reference, [inertia, friction]: [f64; 2]) -> [f64; 2] {
    let (viscous, dry) = part.friction(y.speed, direction(y));
    let mass = inertia * part.mass;
    [y.acceleration * mass + (viscous + dry) * friction - part.constant, y.jerk * mass]
}

impl Slide {
    /// The force that it needs from the belt, N, with these factors on inertia and friction, and the rate of its
    /// inertial part, N/s.
    fn push(&self, y: &Reference, shares: [f64; 2]) -> [f64; 2] {
        let [force, rate] = of_part(&self.part, y, shares);
        [force - self.along.as_ref().map_or(0.0, |line| line.value(y.position)), rate]
    }

    /// The whole force, N, with its first and second rate, N/s and N/s².
    fn load(&self, y: &Reference) -> [f64; 3] {
        let way = direction(y);
        let drag = |speed: f64| self.part.friction(speed, way).0;
        let [force, rate] = self.push(y, [1.0; 2]);
        [force, rate + drag(y.acceleration), self.part.mass * y.snap + drag(y.jerk)]
    }
}

impl Belt {
    fn of(machine: &Machine, drive: usize) -> Self {
        let geometry = machine.geometry();
        let bodies: Vec<usize> = geometry.slides.iter().map(|slide| slide.body).collect();
        let spans: Vec<Spring> = machine.mechanism().springs.into_iter().take(geometry.spans.len()).collect();
        let arm = |span: &Spring, body: usize| -> f64 {
            span.arms.iter().filter(|(of, _)| *of == body).map(|(_, arm)| arm).sum()
        };
        let pulley = geometry.drives[drive].pulley;
        Self {
            slides: DMatrix::from_fn(spans.len(), bodies.len(), |span, slide| arm(&spans[span], bodies[slide])),
            drive: DVector::from_fn(spans.len(), |span, _| arm(&spans[span], pulley) / machine.pulley_radius),
            spans,
            bodies,
        }
    }

    /// K with the slides at their references, N/m.
    fn stiffness(&self, slides: &[Reference]) -> DMatrix<f64> {
        let position = |body: usize| {
            let number = self.bodies.iter().position(|of| *of == body);
            number.and_then(|number| slides.get(number)).map_or(0.0, |y| y.position)
        };
        let of = |span: &Spring| span.follows.as_ref().map_or(span.stiffness, |follows| follows.stiffness(position));
        DMatrix::from_diagonal(&DVector::from_iterator(self.spans.len(), self.spans.iter().map(of)))
    }
}
