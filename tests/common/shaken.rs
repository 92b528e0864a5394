//! Resonance tests of a CoreXY with two belts, as Klipper makes and evaluates them, for tests and examples.
//!
//! The equations are integrated over time (Runge-Kutta, fourth order) and the spectra computed here: nothing is shared
//! with the fit of `taut shape --belts`.

use super::chance::Chance;
use std::f64::consts::{PI, TAU};
use taut::control::diagonals::Diagonals;
use taut::control::spectrum::{Axis, Spectrum};
use taut::log::Accelerometer;

/// Samples a second of the accelerometer.
const RATE: f64 = 3200.0;

/// Samples in a segment of a spectrum.
const SEGMENT: usize = 2048;

/// A mode that the model of the fit lacks, along x or y: of the frame, or of the accelerometer's mount.
#[derive(Debug, Clone, Copy)]
pub struct Mode {
    /// 0 for x, 1 for y.
    pub along: usize,
    /// kg
    pub mass: f64,
    /// Hz
    pub frequency: f64,
    /// Ratio.
    pub damping: f64,
}

impl Mode {
    /// Force towards the rest position, N, at a distance and a speed.
    fn force(&self, distance: f64, speed: f64) -> f64 {
        let w = TAU * self.frequency;
        -self.mass * (w * w * distance + 2.0 * self.damping * w * speed)
    }
}

/// A CoreXY: belt A is stretched by x + y, belt B by x − y.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    /// That move along x and along y, kg.
    pub mass: [f64; 2],
    /// Of belts A and B, N/m.
    pub stiffness: [f64; 2],
    /// Of belts A and B, N s/m.
    pub damping: [f64; 2],
    /// Of the rails along x and y, N s/m.
    pub viscous: [f64; 2],
    /// Friction of the rails along x and y, N.
    pub coulomb: [f64; 2],
    /// The frame, unless it is rigid.
    pub frame: Option<Mode>,
    /// A part of the moved mass with the accelerometer, unless it is rigidly mounted.
    pub mount: Option<Mode>,
    /// Angle of the accelerometer about z, rad.
    pub skew: f64,
    /// Standard deviation of a sample, m/s².
    pub noise: f64,
    /// Start and end of the sweep, Hz; Hz per second.
    pub sweep: [f64; 3],
}

/// Half a period of Klipper's command: from the middle to one side and back, at a constant acceleration of 75 mm/s² per
/// Hz along the diagonal, for which the motor moves its belt √2 times as far.
#[derive(Clone, Copy)]
struct Half {
    start: f64,
    frequency: f64,
    direction: f64,
}

impl Half {
    fn end(&self) -> f64 {
        self.start + 0.5 / self.frequency
    }

    fn next(&self, per_second: f64) -> Self {
        let frequency = self.frequency + 0.5 / self.frequency * per_second;
        Self { start: self.end(), frequency, direction: -self.direction }
    }

    /// Place and speed of the belt at the motor, m and m/s.
    fn command(&self, time: f64, per_second: f64) -> (f64, f64) {
        if time > self.end() {
            return self.next(per_second).command(time, per_second);
        }
        let t = time - self.start;
        let a = std::f64::consts::SQRT_2 * 0.075 * self.frequency;
        let top = a * 0.25 / self.frequency;
        (self.direction * t * (top - 0.5 * a * t), self.direction * (top - a * t))
    }
}

/// Kinds of disturbances of a drawn machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Disturbed {
    /// Noise and a skew accelerometer only.
    Little,
    /// Dry friction on both rails as well.
    Friction,
    /// A mode of the frame as well.
    Frame,
    /// A mode of the accelerometer's mount as well.
    Mount,
    /// All of these.
    Much,
}

impl Disturbed {
    /// Each of them, in words.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Little, "noise"),
        (Self::Friction, "dry friction"),
        (Self::Frame, "a mode of the frame"),
        (Self::Mount, "a mode of the mount"),
        (Self::Much, "all of these"),
    ];
}

/// How often spectra of drawn machines led to which statement.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Machines.
    pub machines: usize,
    /// Machines whose belts differ by at least 5 %.
    pub unequal: usize,
    /// Belts that were named the looser ones, those of unequal machines alone, and the wrong ones.
    pub named: [usize; 2],
    pub wrong: usize,
    /// Spectra that no CoreXY fits.
    pub refused: usize,
    /// Intervals of the ratio that hold the true one.
    pub held: usize,
}

impl Counts {
    /// Adds another count.
    pub fn add(&mut self, other: &Self) {
        self.machines += other.machines;
        self.unequal += other.unequal;
        self.named = [self.named[0] + other.named[0], self.named[1] + other.named[1]];
        self.wrong += other.wrong;
        self.refused += other.refused;
        self.held += other.held;
    }
}

/// Draws a machine, shakes both of its belts, and counts what `taut shape --belts` states. The ratio is from 0.7 to
/// 1.4, or 1.
pub fn judged(seed: u64, disturbed: Disturbed, is_equal: bool) -> Counts {
    let mut chance = Chance::new(seed);
    let ratio = if is_equal { 1.0 } else { chance.scaled(0.7, 1.4) };
    let machine = Machine::drawn(&mut chance, ratio, disturbed);
    let [a, b] = [0, 1].map(|belt| Spectrum::new(&machine.spectrum(belt, &mut chance), Axis::All));
    let found = Diagonals::new(&a, &b);
    let is_unequal = ratio.ln().abs() >= 0.05;
    let mut counts = Counts { machines: 1, unequal: usize::from(is_unequal), ..Counts::default() };
    match &found.stated {
        Ok(belts) => {
            let [low, high] = belts.interval();
            counts.held = usize::from(low <= ratio && ratio <= high);
            if let Some(looser) = belts.looser() {
                counts.named = [1, usize::from(is_unequal)];
                counts.wrong = usize::from(is_equal || (looser == 1) != (ratio < 1.0));
            }
        }
        Err(_) => counts.refused = 1,
    }
    counts
}

impl Machine {
    /// A random machine whose belt B has `ratio` times the stiffness of belt A.
    pub fn drawn(chance: &mut Chance, ratio: f64, disturbed: Disturbed) -> Self {
        let mu = chance.between(0.15, 0.9);
        let highest = 110.0 * mu.sqrt();
        let low = chance.between(25.0, highest.clamp(26.0, 75.0));
        let heavy = chance.scaled(0.3, 1.5);
        let total = (TAU * low).powi(2) * heavy;
        let stiffness = [total / (1.0 + ratio), total * ratio / (1.0 + ratio)];
        let masses = if chance.uniform() < 0.5 { [heavy, mu * heavy] } else { [mu * heavy, heavy] };
        // Half of the damping ratio is of the belts, within a third, half of the rails.
        let zeta = chance.scaled(0.01, 0.1);
        let share = chance.between(0.3, 0.7);
        let of_belt = 2.0 * zeta * share / (TAU * low);
        let damping = stiffness.map(|k| k * of_belt * chance.scaled(0.8, 1.25));
        let viscous = masses.map(|m| 2.0 * zeta * (1.0 - share) * (total * m).sqrt() * chance.scaled(0.6, 1.6));
        let has = |kind| disturbed == kind || disturbed == Disturbed::Much;
        let coulomb = masses.map(|m| m * chance.between(0.2, 2.0));
        let coulomb = if has(Disturbed::Friction) { coulomb } else { [0.0; 2] };
        let mut mode = |mass: f64, low: f64, high: f64| Mode {
            along: usize::from(chance.uniform() < 0.5),
            mass,
            frequency: chance.between(low, high),
            damping: chance.scaled(0.01, 0.1),
        };
        let frame = mode(heavy, 10.0, 150.0);
        let mount = mode(mu * heavy, 60.0, 180.0);
        let frame = has(Disturbed::Frame).then(|| Mode { mass: heavy * chance.between(3.0, 15.0), ..frame });
        let mount = has(Disturbed::Mount).then(|| Mode { mass: mu * heavy * chance.between(0.1, 0.4), ..mount });
        let skew = chance.between(-2.0, 2.0) * PI / 180.0;
        Self {
            mass: masses,
            stiffness,
            damping,
            viscous,
            coulomb,
            frame,
            mount,
            skew,
            noise: 0.15,
            sweep: [5.0, 133.3, 1.0],
        }
    }

    /// Derivatives of x, y, frame, mount and their speeds, when a motor has moved its belt by `moved` (m) at `speed`.
    fn slope(&self, state: &[f64; 8], diagonal: usize, moved: f64, speed: f64) -> [f64; 8] {
        let [x, y, frame, mount, vx, vy, vframe, vmount] = *state;
        let (mut at, mut to) = ([x, y], [vx, vy]);
        if let Some(own) = self.frame {
            at[own.along] -= frame;
            to[own.along] -= vframe;
        }
        let pulled = |d: usize| if d == diagonal { (moved, speed) } else { (0.0, 0.0) };
        let sign = [1.0, -1.0];
        let tension: [f64; 2] = std::array::from_fn(|d| {
            let (a, va) = pulled(d);
            self.stiffness[d] * (at[0] + sign[d] * at[1] - a) + self.damping[d] * (to[0] + sign[d] * to[1] - va)
        });
        let belt = [tension[0] + tension[1], tension[0] - tension[1]];
        let mut force: [f64; 2] = std::array::from_fn(|i| {
            let dry = if self.coulomb[i] > 0.0 { self.coulomb[i] * (to[i] / 1e-3).tanh() } else { 0.0 };
            -belt[i] - self.viscous[i] * to[i] - dry
        });
        let on_frame = self.frame.map_or(0.0, |own| (own.force(frame, vframe) - force[own.along]) / own.mass);
        let mut mass = self.mass;
        let on_mount = self.mount.map_or(0.0, |own| {
            let body = [(x, vx), (y, vy)][own.along];
            let pull = own.force(mount - body.0, vmount - body.1);
            force[own.along] -= pull;
            mass[own.along] -= own.mass;
            pull / own.mass
        });
        [vx, vy, vframe, vmount, force[0] / mass[0], force[1] / mass[1], on_frame, on_mount]
    }

    /// Accelerations along the accelerometer's x, y and z, m/s², while one motor (0 or 1) shakes and the other holds.
    pub fn shaken(&self, diagonal: usize, chance: &mut Chance) -> [Vec<f64>; 3] {
        let h = 0.5 / RATE;
        let mut state = [0.0; 8];
        let mut half = Half { start: 0.0, frequency: self.sweep[0], direction: 1.0 };
        let mut rows: [Vec<f64>; 3] = Default::default();
        let (sine, cosine) = self.skew.sin_cos();
        let mut step = 0;
        while half.frequency < self.sweep[1] {
            let time = f64::from(step) * h;
            let [begin, middle, end] = [time, time + 0.5 * h, time + h].map(|t| half.command(t, self.sweep[2]));
            let slope = |state: &[f64; 8], (moved, speed): (f64, f64)| self.slope(state, diagonal, moved, speed);
            let moved = |slope: &[f64; 8], by: f64| -> [f64; 8] { std::array::from_fn(|i| state[i] + by * slope[i]) };
            let k1 = slope(&state, begin);
            if step % 2 == 0 {
                let mut at = [k1[4], k1[5]];
                if let Some(own) = self.mount {
                    at[own.along] = k1[7];
                }
                let [x, y] = at;
                let mut noise = || self.noise * chance.normal();
                rows[0].push(x * cosine + y * sine + noise());
                rows[1].push(y * cosine - x * sine + noise());
                rows[2].push(9.81 + 0.02 * x + noise());
            }
            let k2 = slope(&moved(&k1, 0.5 * h), middle);
            let k3 = slope(&moved(&k2, 0.5 * h), middle);
            let k4 = slope(&moved(&k3, h), end);
            for i in 0..8 {
                state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
            step += 1;
            while f64::from(step) * h >= half.end() {
                half = half.next(self.sweep[2]);
            }
        }
        rows
    }

    /// The spectrum of a test, (mm/s²)²/Hz, with frequencies rounded to 0.1 Hz as Klipper writes them.
    pub fn spectrum(&self, belt: usize, chance: &mut Chance) -> Accelerometer {
        let [x, y, z] = self.shaken(belt, chance).map(|values| density(&values));
        let step = RATE / SEGMENT as f64;
        let count = (200.0 / step) as usize + 1;
        let frequency = (0..count).map(|k| (10.0 * k as f64 * step).round() / 10.0).collect();
        let all: Vec<f64> = x.iter().zip(&y).zip(&z).map(|((x, y), z)| x + y + z).collect();
        let density = [x, y, z, all].map(|values| values[..count].iter().map(|value| 1e6 * value).collect());
        Accelerometer::Spectrum { frequency, density, per_frequency: false }
    }

    /// That spectrum in the form of Klipper's `resonances_*.csv`.
    pub fn file(&self, belt: usize, chance: &mut Chance) -> String {
        let Accelerometer::Spectrum { frequency, density: [x, y, z, all], .. } = self.spectrum(belt, chance) else {
            unreachable!()
        };
        let row = |k: usize| format!("{:.1},{:.3e},{:.3e},{:.3e},{:.3e}\n", frequency[k], x[k], y[k], z[k], all[k]);
        std::iter::once("freq,psd_x,psd_y,psd_z,psd_xyz\n".into()).chain((0..frequency.len()).map(row)).collect()
    }
}

/// One-sided power spectral density: periodograms of half-overlapping segments with a Kaiser window, averaged.
fn density(values: &[f64]) -> Vec<f64> {
    let i0 = |x: f64| {
        let (mut sum, mut term) = (1.0, 1.0);
        for k in 1..40 {
            term *= x * x / (4.0 * f64::from(k * k));
            sum += term;
        }
        sum
    };
    let n = SEGMENT;
    let window: Vec<f64> = (0..n)
        .map(|i| {
            let r = 2.0 * i as f64 / (n as f64 - 1.0) - 1.0;
            i0(6.0 * (1.0 - r * r).max(0.0).sqrt()) / i0(6.0)
        })
        .collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let mut sum = vec![0.0; n / 2];
    let mut count = 0.0;
    let mut start = 0;
    while start + n <= values.len() {
        let part = &values[start..start + n];
        let mean = part.iter().sum::<f64>() / n as f64;
        let mut re: Vec<f64> = part.iter().zip(&window).map(|(v, w)| (v - mean) * w).collect();
        let mut im = vec![0.0; n];
        transform(&mut re, &mut im);
        for (k, value) in sum.iter_mut().enumerate() {
            *value += re[k] * re[k] + im[k] * im[k];
        }
        count += 1.0;
        start += n / 2;
    }
    sum.iter().map(|value| 2.0 * value / (RATE * power * count)).collect()
}

/// Fourier transform of 2^p values in place, radix 2.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    let mut j = 0;
    for i in 1..n {
        let mut bit = n >> 1;
        while j & bit != 0 {
            j ^= bit;
            bit >>= 1;
        }
        j |= bit;
        if i < j {
            re.swap(i, j);
            im.swap(i, j);
        }
    }
    let mut length = 2;
    while length <= n {
        let half = length / 2;
        let turns: Vec<(f64, f64)> = (0..half).map(|k| (-TAU * k as f64 / length as f64).sin_cos()).collect();
        for start in (0..n).step_by(length) {
            for (k, &(s, c)) in turns.iter().enumerate() {
                let (a, b) = (start + k, start + k + half);
                let (tr, ti) = (re[b] * c - im[b] * s, re[b] * s + im[b] * c);
                (re[b], im[b]) = (re[a] - tr, im[a] - ti);
                (re[a], im[a]) = (re[a] + tr, im[a] + ti);
            }
        }
        length *= 2;
    }
}
