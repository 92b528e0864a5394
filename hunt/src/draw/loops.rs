//! Controllers and moves of a random axis.

use super::machine::Scale;
use super::{Draw, Feature, Sizes};
use crate::by::By;
use std::fmt::Write;

impl Draw {
    /// A controller about as stiff as its sample time and the belt allow, and a move.
    pub(super) fn motion(&mut self, sizes: &Sizes, scale: &Scale) {
        let until = self.digits(sizes.time);
        let samples = 60.0 + self.random.below(80) as f64;
        let every = self.digits(until / samples);
        let mass: f64 = sizes.mass.iter().sum();
        let softest = sizes.stiffness.iter().copied().fold(f64::MAX, f64::min);
        let swing = (softest / mass).sqrt();
        let omega = (self.random.even(0.03, 0.15) / every).min(0.2 * swing);
        // Command per acceleration of all bodies.
        let unit = mass / scale.push;
        let force = (mass * sizes.way / (until * until) * 8.0).max(sizes.force);
        let resists = self.random.decades(1.0, 20.0) * force / scale.push.abs();
        let in_c = self.wants(Feature::Asked(By::C));
        let late = match self.wants(Feature::Late) {
            true => every * [0.25, 0.5, 1.0, 1.25][self.random.below(4)],
            false => 0.0,
        };
        if self.random.chance(0.5) && !in_c {
            let lines = sizes.radius / (sizes.way * self.random.decades(1e-4, 1e-2));
            let at = ["motor", "drive_pulley"][self.random.below(2)];
            let _ = writeln!(self.text, "\n[encoder]\nat = \"{at}\"\nlines = {:e}", self.digits(lines));
        }
        let two_sensors = self.random.chance(0.3) && !in_c && self.text.contains("[encoder]");
        if two_sensors && self.wants(Feature::Cascade) {
            let lines = 1.0 / (sizes.way * self.random.decades(1e-4, 1e-2));
            let _ = writeln!(self.text, "\n[scale]\nlines = {:e}", self.digits(lines));
        }
        self.table("controller");
        let _ = writeln!(self.text, "every = {every:e}\ndelay = {late:e}");
        if self.random.chance(0.7) {
            let _ = writeln!(self.text, "limit = {:e}", self.digits(resists));
        }
        let filter = {
            let value = self.random.even(0.05, 0.4) / every;
            self.digits(value)
        };
        let number = |value: f64| format!("{value:.6e}");
        let kp = number(unit * omega * omega);
        let ki = if self.random.chance(0.6) { number(0.2 * unit * omega.powi(3)) } else { "0".into() };
        let kd = number(1.4 * unit * omega);
        let features = self.features.clone().unwrap_or_default();
        let controller = features.into_iter().find(|one| one.is_controller()).unwrap_or(Feature::Pid);
        let law = match controller {
            Feature::Cascade => format!(
                "cascade = {{ position = {:e}, speed = {kd}, speed_integral = {kp}, filter = {filter:e} }}",
                self.digits(0.4 * omega)
            ),
            Feature::CurrentLoop => {
                // Gains of the speed loop in amperes; volts per ampere about the resistance.
                let resistance = self.value_of("resistance");
                let grip = scale.push * resistance;
                let [speed, integral] = [1.4 * omega, omega * omega].map(|gain| number(gain * mass / grip));
                let [p, i] = [0.5 * resistance, 0.1 * resistance / every].map(|gain| self.digits(gain));
                format!(
                    "cascade = {{ position = {:e}, speed = {speed}, speed_integral = {integral}, filter = {filter:e}, \
                     current = {{ proportional = {p:e}, integral = {i:e} }} }}",
                    self.digits(0.4 * omega)
                )
            }
            Feature::StateFeedback => {
                let [error, command] = [sizes.way * 0.05, resists * 0.3].map(|value| self.digits(value.abs()));
                let integral = match self.random.chance(0.5) {
                    true => format!(", integral = {:e}", self.digits(error * until * 0.1)),
                    false => String::new(),
                };
                let noise = self.digits(sizes.way * 1e-4);
                format!(
                    "state_feedback = {{ position = {error:e}, command = {command:e}, disturbance = {:e}, noise = {noise:e}{integral} }}",
                    self.digits(command * 0.3)
                )
            }
            Feature::SlidingMode => {
                let reach = {
                    let value = force / mass * self.random.decades(0.5, 5.0);
                    self.digits(value)
                };
                let boundary = self.digits(reach / omega);
                let integral = if self.random.chance(0.4) { self.digits(0.2 * omega * omega) } else { 0.0 };
                format!(
                    "sliding_mode = {{ bandwidth = {:e}, reaching = {reach:e}, boundary = {boundary:e}, \
                     integral = {integral:e}, filter = {filter:e} }}",
                    self.digits(0.5 * omega)
                )
            }
            Feature::Fuzzy => {
                let (error, rate) = (self.digits(sizes.way * 0.3), self.digits(sizes.way * 0.3 * omega));
                let rules = "[[-1, -0.7, 0], [-0.6, 0, 0.5], [0, 0.6, 1]]";
                // A command of the same sign as the amplifier's gain.
                let turned = "[[1, 0.7, 0], [0.6, 0, -0.5], [0, -0.6, -1]]";
                let rules = if scale.push < 0.0 { turned } else { rules };
                let command = self.digits((unit * omega * omega * error).abs());
                let command = match self.random.chance(0.5) {
                    true => format!("command = {command:e}"),
                    false => format!("slope = {:e}", self.digits(command * omega)),
                };
                format!(
                    "fuzzy = {{ error = {error:e}, rate = {rate:e}, {command}, rules = {rules}, filter = {filter:e} }}"
                )
            }
            _ => format!("pid = {{ proportional = {kp}, integral = {ki}, derivative = {kd}, filter = {filter:e} }}"),
        };
        let _ = writeln!(self.text, "{law}");
        // The rigid feed-forward splits its command where there is a current loop.
        if self.random.chance(0.4) && controller != Feature::CurrentLoop && controller != Feature::StateFeedback {
            let _ = writeln!(self.text, "feed_forward = {{ model = \"rigid\" }}");
        }
        let goes = 0.6 * until;
        let way = if self.random.chance(0.4) { -sizes.way } else { sizes.way };
        let (to, speed) = (self.digits(way), self.digits(2.0 * sizes.way / goes));
        let acceleration = self.digits(6.0 * sizes.way / (goes * goes));
        self.text.push_str("\n[[move]]\nname = \"there\"\n");
        let _ = writeln!(self.text, "to = {to:e}\nspeed = {speed:e}\nacceleration = {acceleration:e}");
        if self.random.chance(0.5) {
            let _ = writeln!(self.text, "jerk = {:e}", self.digits(acceleration * 20.0 / goes));
        }
        let rows = {
            let value = until / (20.0 + self.random.below(20) as f64);
            self.digits(value)
        };
        let _ = writeln!(self.text, "until = {until:e}\nevery = {rows:e}\nwindow = {:e}", sizes.way);
    }

    /// A number of the text so far.
    pub(super) fn value_of(&self, key: &str) -> f64 {
        let start = format!("{key} = ");
        let value = self.text.lines().find_map(|line| line.strip_prefix(&start));
        value.and_then(|value| value.parse().ok()).unwrap_or(1.0)
    }
}
