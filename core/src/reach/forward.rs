//! Feed-forward for each drive of a machine with several, from the references of all sliding parts.

use super::compensation::{direction_by, twist};
use crate::calculator::{Calculator, Evaluation, Number};
use crate::design::{FeedForward, FeedForwardModel};
use crate::machine::rigid::Rigid;
use crate::machine::{EncoderPlace, Machine};
use crate::mechanism::{Follows, GearPlay, Spring};
use crate::polyline::Polyline;
use crate::signal::profile::Reference;

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

/// The spans of a belt around a drive pulley and both slides of a gantry.
#[derive(Debug, Clone)]
struct Belt {
    spans: Vec<Span>,
    /// Bodies of the slides.
    bodies: [usize; 2],
}

/// A span of it.
#[derive(Debug, Clone)]
struct Span {
    /// Elongation per displacement of each slide: its row of A_q.
    slides: [f64; 2],
    /// Elongation per displacement of the belt at the drive pulley: a_φ.
    drive: f64,
    /// N/m, if it follows no slide.
    stiffness: f64,
    follows: Option<Follows>,
}

/// What a motion requires of a motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Required {
    /// Reference of the drive's part of the belt, without stretch.
    pub along: Reference,
    /// Motor force at the belt, N.
    pub force: f64,
    /// Motor current, A.
    pub current: f64,
    /// Voltage at its terminals, V.
    pub voltage: f64,
}

/// Motion of the belt at the drive pulley, and the motor force there.
struct Needed<N> {
    drive: Reference<N>,
    /// N; and its rate, N/s.
    force: [N; 2],
}

impl Forward {
    /// Feed-forward of `drive` with these factors on inertia and friction; none without feed-forward and compensated
    /// stretch, or for an axis, which has [`Compensation`](super::compensation::Compensation).
    pub fn new(settings: FeedForward, machine: &Machine, drive: usize) -> Option<Self> {
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
            belt: is_elastic.then(|| Belt::new(machine, drive)),
            gear: machine.drives[drive].motor.gear_play.filter(|_| at_motor),
            radius: machine.pulley_radius,
        })
    }

    /// The reference of its part of the belt, without stretch.
    pub fn along<C: Calculator>(&self, c: &mut C, slides: &[Reference<C::N>]) -> Reference<C::N> {
        Reference::weighed(c, self.slides.iter().map(|slide| slide.share), slides)
    }

    /// The reference of its encoder, for which the slides follow theirs, from that of its part of the belt.
    pub fn target<C: Calculator>(
        &self,
        c: &mut C,
        along: Reference<C::N>,
        slides: &[Reference<C::N>],
    ) -> Reference<C::N> {
        let Some(belt) = self.belt.as_ref().filter(|_| self.settings.compensate_stretch) else { return along };
        let Needed { drive: mut target, force } = self.stretched(c, belt, slides);
        if let Some(gear) = self.gear {
            // The rotor's own torque does not pass through the gear.
            let torque = (force[0] - target.acceleration * self.pulley.rotor) * self.radius;
            let way = direction_by(c, &along);
            target.position = c.name("target", target.position + twist(&gear, torque, way) * self.radius);
        }
        target
    }

    /// Motor force at the belt, N, and the rate of its inertial part, N/s, with these factors on inertia and friction.
    ///
    /// The motors do the work of the forces on the slides: Σ_k f_k r dφ_k = Σ_s F_s dq_s with q_s = Σ_k w_sk r φ_k, so
    /// that f_k = Σ_s w_sk F_s, and each also accelerates its own pulley. Dry friction follows the direction of the
    /// rubbing part: of r φ for pulleys, of x and y for bridge and cart.
    fn share_of_force<C: Calculator>(&self, c: &mut C, slides: &[Reference<C::N>], shares: [f64; 2]) -> [C::N; 2] {
        let along = self.along(c, slides);
        let [mut force, mut rate] = of_part(c, &self.pulley, &along, shares);
        for (slide, reference) in self.slides.iter().zip(slides).filter(|(slide, _)| slide.lever != 0.0) {
            let [push, change] = slide.push(c, reference, shares);
            (force, rate) = (force + push * slide.lever, rate + change * slide.lever);
        }
        [force, rate]
    }

    /// The factors on inertia and friction.
    fn shares(&self) -> [f64; 2] {
        [self.settings.inertia, self.settings.friction]
    }

    /// The motion of the drive for which the slides follow their references on an elastic belt: quasi-static for the
    /// belt, without its damping.
    ///
    /// With pulleys that lead by S d, y = S (q + d), the spans stretch by s = −A_q d, since rigid motion stretches
    /// none. The slides need F = −A_qᵀ K s, so that d = (A_qᵀ K A_q)⁻¹ F; the belt pulls the pulley back by a_φᵀ K s.
    fn stretched<C: Calculator>(&self, c: &mut C, belt: &Belt, slides: &[Reference<C::N>]) -> Needed<C::N> {
        let stiffness = belt.stiffness(c, slides);
        // F = M y″ + b y′ + F_c sgn y′ − F₀ − F_x(y); the rates without F_x′ y′
        let loads: Vec<[C::N; 3]> = self.slides.iter().zip(slides).map(|(slide, y)| slide.load(c, y)).collect();
        let ahead = belt.stretch(c, &stiffness, [&loads[0], &loads[1]]);
        let y = self.along(c, slides);
        let mut lead = |j: usize, of: C::N| {
            let moving = self.slides.iter().zip(&ahead).filter(|(slide, _)| slide.share != 0.0);
            let sum = moving.fold(of, |sum, (slide, d)| sum + d[j] * slide.share);
            c.name("lead", sum)
        };
        let drive = Reference {
            position: lead(0, y.position),
            speed: lead(1, y.speed),
            acceleration: lead(2, y.acceleration),
            ..y
        };
        let pull = belt.pull(c, &stiffness, &ahead);
        let (mass, way) = (self.pulley.mass, direction_by(c, &y));
        let (viscous, dry) = self.pulley.friction_by(c, drive.speed, way);
        let damping = self.pulley.friction_by(c, drive.acceleration, way).0;
        Needed {
            drive,
            force: [drive.acceleration * mass + viscous + dry + pull[0], y.jerk * mass + damping + pull[1]],
        }
    }

    /// Command for this force, V or A; none without feed-forward.
    pub fn command<C: Calculator>(&self, c: &mut C, slides: &[Reference<C::N>]) -> Option<C::N> {
        let command = match (&self.belt, self.settings.model) {
            (_, FeedForwardModel::None) => return None,
            (Some(belt), FeedForwardModel::Elastic) => {
                let Needed { drive, force: [mut force, rate] } = self.stretched(c, belt, slides);
                if self.shares() != [1.0; 2] {
                    // What is not fed forward of inertia and friction is that of a rigid belt.
                    let [whole, fed] =
                        [[1.0; 2], self.shares()].map(|shares| self.share_of_force(c, slides, shares)[0]);
                    force = force - (whole - fed);
                }
                self.pulley.command_by(c, force, rate, &self.accelerated(drive))
            }
            _ => {
                let [force, rate] = self.share_of_force(c, slides, self.shares());
                let along = self.along(c, slides);
                self.pulley.command_by(c, force, rate, &self.accelerated(along))
            }
        };
        Some(c.name("forward", command))
    }

    /// The command in two parts: the current for a current loop, A, and the voltage for the back-EMF, V; none without
    /// feed-forward.
    pub fn split<C: Calculator>(&self, c: &mut C, slides: &[Reference<C::N>]) -> Option<[C::N; 2]> {
        let command = self.command(c, slides)?;
        let speed = self.along(c, slides).speed;
        Some(self.pulley.split(c, speed, command))
    }

    /// What the motion requires of the motor with a rigid belt.
    pub fn required(&self, slides: &[Reference]) -> Required {
        let c = &mut Evaluation::plain();
        let [force, rate] = self.share_of_force(c, slides, self.shares());
        let along = self.along(c, slides);
        let (current, voltage) = self.pulley.electrical(force, rate, &self.accelerated(along));
        Required { along, force, current, voltage }
    }

    /// A motion of the pulley with the share of the inertia that is fed forward.
    fn accelerated<N: Number>(&self, y: Reference<N>) -> Reference<N> {
        let share = self.settings.inertia;
        if share == 1.0 {
            return y;
        }
        Reference { acceleration: y.acceleration * share, jerk: y.jerk * share, ..y }
    }
}

/// F = M y″ + b y′ + F_c sgn y′ − F₀, and the rate of its inertial part, N and N/s.
fn of_part<C: Calculator>(c: &mut C, part: &Rigid, y: &Reference<C::N>, [inertia, friction]: [f64; 2]) -> [C::N; 2] {
    let way = direction_by(c, y);
    let (viscous, dry) = part.friction_by(c, y.speed, way);
    let mass = inertia * part.mass;
    [y.acceleration * mass + (viscous + dry) * friction - part.constant, y.jerk * mass]
}

impl Slide {
    /// The force that it needs from the belt, N, with these factors on inertia and friction, and the rate of its
    /// inertial part, N/s.
    fn push<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>, shares: [f64; 2]) -> [C::N; 2] {
        let [force, rate] = of_part(c, &self.part, y, shares);
        let along = self.along.as_ref().map(|line| line.value_by(c, y.position));
        [along.map_or(force, |along| force - along), rate]
    }

    /// The whole force, N, with its first and second rate, N/s and N/s².
    fn load<C: Calculator>(&self, c: &mut C, y: &Reference<C::N>) -> [C::N; 3] {
        let way = direction_by(c, y);
        let [force, rate] = self.push(c, y, [1.0; 2]);
        let [drag, change] = [y.acceleration, y.jerk].map(|speed| self.part.friction_by(c, speed, way).0);
        [force, rate + drag, y.snap * self.part.mass + change].map(|load| c.name("load", load))
    }
}

impl Belt {
    fn new(machine: &Machine, drive: usize) -> Self {
        let geometry = machine.geometry();
        let bodies = [0, 1].map(|slide: usize| geometry.slides[slide].body);
        let springs = machine.mechanism().springs.into_iter().take(geometry.spans.len());
        let arm = |span: &Spring, body: usize| -> f64 {
            span.arms.iter().filter(|(of, _)| *of == body).map(|(_, arm)| arm).sum()
        };
        let pulley = geometry.drives[drive].pulley;
        let span = |span: Spring| Span {
            slides: bodies.map(|body| arm(&span, body)),
            drive: arm(&span, pulley) / machine.pulley_radius,
            stiffness: span.stiffness,
            follows: span.follows,
        };
        Self { spans: springs.map(span).collect(), bodies }
    }

    /// Stiffness of each span with the slides at their references, N/m.
    fn stiffness<C: Calculator>(&self, c: &mut C, slides: &[Reference<C::N>]) -> Vec<C::N> {
        let position =
            |body: usize| self.bodies.iter().position(|of| *of == body).map(|number| slides[number].position);
        let of = |span: &Span| match &span.follows {
            Some(follows) => {
                let stiffness = follows.stiffness_by(c, position);
                c.name("stiffness", stiffness)
            }
            None => c.number(span.stiffness),
        };
        self.spans.iter().map(of).collect()
    }

    /// Σ w_i k_i over the spans.
    fn sum<C: Calculator>(&self, c: &mut C, stiffness: &[C::N], weight: impl Fn(&Span) -> f64) -> C::N {
        let weights = self.spans.iter().map(weight);
        let parts = stiffness.iter().zip(weights).filter(|(_, weight)| *weight != 0.0).map(|(k, weight)| *k * weight);
        parts.reduce(|sum, part| sum + part).unwrap_or_else(|| c.number(0.0))
    }

    /// d = (A_qᵀ K A_q)⁻¹ F with first and second rates, for each slide. The columns of A_q are independent for each
    /// kind of machine.
    fn stretch<C: Calculator>(&self, c: &mut C, stiffness: &[C::N], loads: [&[C::N; 3]; 2]) -> [[C::N; 3]; 2] {
        let mut of = |i: usize, j: usize| self.sum(c, stiffness, |span| span.slides[i] * span.slides[j]);
        let (k_xx, k_xy, k_yy) = (of(0, 0), of(0, 1), of(1, 1));
        let determinant = k_xx * k_yy - k_xy * k_xy;
        let [xx, xy, yy] = [k_yy, -k_xy, k_xx].map(|k| c.name("compliance", k / determinant));
        let mut stretch = |one: C::N, other: C::N| {
            std::array::from_fn(|j| c.name("stretch", one * loads[0][j] + other * loads[1][j]))
        };
        [stretch(xx, xy), stretch(xy, yy)]
    }

    /// −a_φᵀ K s = a_φᵀ K A_q d negated, the pull of the belt on the pulley that the motor overcomes, N, and its rate.
    fn pull<C: Calculator>(&self, c: &mut C, stiffness: &[C::N], ahead: &[[C::N; 3]; 2]) -> [C::N; 2] {
        let [x, y] = [0, 1].map(|slide: usize| self.sum(c, stiffness, |span| -span.drive * span.slides[slide]));
        std::array::from_fn(|j| c.name("pull", x * ahead[0][j] + y * ahead[1][j]))
    }
}
