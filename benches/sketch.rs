//! A plain sketch of the exact method, as one would write it first, to measure ours against: one 8 × 8 exponential and forty
//! doublings for every mode met, one product a sample, a look at the signs at its end, bisection with the doublings.
//!
//! It knows symmetric Coulomb friction and a voltage pulse only, and misses what happens twice within a sample.

use taut::stage::Stage;

type Matrix = [[f64; 8]; 8];
type Vector = [f64; 8];

const LEVELS: usize = 40;

/// What a run gives.
pub struct Run {
    /// Mode changes.
    pub events: usize,
    /// States at the samples: φ₁, φ₁′, x, x′, φ₃, φ₃′, u, 1.
    #[allow(dead_code)]
    pub states: Vec<Vector>,
}

struct Machine<'a> {
    stage: &'a Stage,
    known: Vec<([i8; 3], Vec<Matrix>)>,
}

/// One second from rest with a pulse, so many intervals.
pub fn run(stage: &Stage, volts: f64, duration: f64, intervals: usize) -> Run {
    let h = 1.0 / intervals as f64;
    let off = (duration / h).round() as usize;
    let mut machine = Machine { stage, known: Vec::new() };
    let mut z: Vector = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, volts, 1.0];
    let (mut mode, mut events) = ([0_i8; 3], 0);
    let mut states = Vec::with_capacity(intervals + 1);
    for sample in 0..intervals {
        if sample == off {
            z[6] = 0.0;
        }
        events += machine.settle(&mut mode, &z);
        states.push(z);
        // What is left of the sample, as a number of the smallest steps.
        let mut left: u64 = 1 << LEVELS;
        while left > 0 {
            let powers = machine.powers(mode, h).to_vec();
            let mut moved = false;
            for (level, step) in powers.iter().enumerate() {
                let size = 1_u64 << (LEVELS - level);
                while left >= size {
                    let next = advance(step, &z);
                    if machine.broken(mode, &next).is_some() {
                        break;
                    }
                    (z, left, moved) = (next, left - size, true);
                }
            }
            if left > 0 {
                // One smallest step further the mode is broken.
                let next = advance(&powers[LEVELS], &z);
                let body = machine.broken(mode, &next).expect("or it would have moved");
                (z, left) = (next, left - 1);
                if mode[body] != 0 {
                    z[2 * body + 1] = 0.0;
                    let load = machine.load(body, &z);
                    mode[body] = if load.abs() <= machine.coulomb(body) { 0 } else { load.signum() as i8 };
                } else {
                    mode[body] = machine.load(body, &z).signum() as i8;
                }
                events += 1;
                assert!(moved || events < 1000, "the sketch is stuck");
            }
        }
    }
    states.push(z);
    Run { events, states }
}

fn advance(step: &Matrix, z: &Vector) -> Vector {
    let mut out = *z;
    for (out, row) in out.iter_mut().zip(step) {
        *out += row.iter().zip(z).map(|(p, z)| p * z).sum::<f64>();
    }
    out
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut out = [[0.0; 8]; 8];
    for i in 0..8 {
        for j in 0..8 {
            out[i][j] = (0..8).map(|k| a[i][k] * b[k][j]).sum();
        }
    }
    out
}

impl Machine<'_> {
    fn coulomb(&self, body: usize) -> f64 {
        let s = self.stage;
        [s.drive_pulley.friction, s.cart.friction, s.idler_pulley.friction][body].forward.coulomb
    }

    fn load(&self, body: usize, z: &Vector) -> f64 {
        let (s, m, r) = (self.stage, &self.stage.motor, self.stage.pulley_radius);
        let [k1, k2, k3] = s.belt.stiffness;
        let (f1, f2, f3) = (k1 * (r * z[0] - z[2]), k2 * (z[2] - r * z[4]), k3 * r * (z[4] - z[0]));
        match body {
            0 => r * (f3 - f1) + m.torque_constant / m.resistance * (z[6] - m.back_emf_constant * z[1]),
            1 => f1 - f2,
            _ => r * (f2 - f3),
        }
    }

    fn broken(&self, mode: [i8; 3], z: &Vector) -> Option<usize> {
        (0..3).find(|&body| match mode[body] {
            0 => self.load(body, z).abs() > self.coulomb(body),
            sign => z[2 * body + 1] * f64::from(sign) < 0.0,
        })
    }

    fn settle(&self, mode: &mut [i8; 3], z: &Vector) -> usize {
        let mut changed = 0;
        while let Some(body) = (0..3).find(|&b| mode[b] == 0 && self.load(b, z).abs() > self.coulomb(b)) {
            mode[body] = self.load(body, z).signum() as i8;
            changed += 1;
        }
        changed
    }

    /// e^{A h/2ᵏ} − I for k = 0…40.
    fn powers(&mut self, mode: [i8; 3], h: f64) -> &[Matrix] {
        if let Some(found) = self.known.iter().position(|(m, _)| *m == mode) {
            return &self.known[found].1;
        }
        let s = self.stage;
        let inertia = [s.drive_pulley.inertia, s.cart.mass, s.idler_pulley.inertia];
        let viscous = [s.drive_pulley.friction, s.cart.friction, s.idler_pulley.friction].map(|f| f.forward.viscous);
        let mut a = [[0.0; 8]; 8];
        for body in (0..3).filter(|&b| mode[b] != 0) {
            a[2 * body][2 * body + 1] = 1.0;
            for column in 0..7 {
                let mut unit = [0.0; 8];
                unit[column] = 1.0;
                a[2 * body + 1][column] = self.load(body, &unit) / inertia[body];
            }
            a[2 * body + 1][2 * body + 1] -= viscous[body] / inertia[body];
            a[2 * body + 1][7] = -self.coulomb(body) * f64::from(mode[body]) / inertia[body];
        }
        let x = a.map(|row| row.map(|entry| entry * h / (1_u64 << LEVELS) as f64));
        let x2 = product(&x, &x);
        let mut step = x;
        for i in 0..8 {
            for j in 0..8 {
                step[i][j] += 0.5 * x2[i][j];
            }
        }
        let mut powers = vec![step];
        for _ in 0..LEVELS {
            let last = powers.last().expect("never empty");
            let mut next = product(last, last);
            for i in 0..8 {
                for j in 0..8 {
                    next[i][j] += 2.0 * last[i][j];
                }
            }
            powers.push(next);
        }
        powers.reverse();
        self.known.push((mode, powers));
        &self.known.last().expect("just put there").1
    }
}
