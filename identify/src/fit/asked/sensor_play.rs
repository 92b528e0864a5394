//! Play between the machine and a sensor: the reading follows the motion only when the play is used up.
//!
//! With the width w, and the share c of it that lies ahead at the start, the reading z of the positions y is (play
//! operator; Krasnosel'skii and Pokrovskii 1989)
//!
//! ```text
//! z₀ = y₀        z_k = max(y_k − c w, min(y_k + (1 − c) w, z_{k−1}))
//! ```

use super::run::{FittedLog, Nuisance};

/// Play of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorPlay {
    /// w, in the unit of the reading.
    pub width: f64,
    /// c, between 0 and 1.
    pub ahead: f64,
}

/// Contact that moves a reading from one row to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Contact {
    Free,
    Forward,
    Backward,
}

impl SensorPlay {
    /// The reading of these positions, and what moves it in each row.
    fn contacts(self, positions: &[f64]) -> (Vec<f64>, Vec<Contact>) {
        let Self { width: w, ahead: c } = self;
        let mut z = positions.first().copied().unwrap_or_default();
        let follow = |&y: &f64| {
            let (least, most) = (y - c * w, y + (1.0 - c) * w);
            let contact = match () {
                () if z < least => Contact::Forward,
                () if z > most => Contact::Backward,
                () => Contact::Free,
            };
            // max before min would differ by rounding where w = 0.
            z = match contact {
                Contact::Forward => least,
                Contact::Backward => most,
                Contact::Free => z,
            };
            (z, contact)
        };
        positions.iter().map(follow).unzip()
    }

    /// The reading of these positions.
    pub fn read(self, positions: &[f64]) -> Vec<f64> {
        self.contacts(positions).0
    }

    /// The reading of these positions, and its derivatives in place of those of the positions, by variables on which
    /// width and share depend as given: (dw, dc).
    pub fn differentiate<'s>(
        self,
        positions: &[f64],
        slopes: impl Iterator<Item = (&'s mut Vec<f64>, [f64; 2])>,
    ) -> Vec<f64> {
        let Self { width: w, ahead: c } = self;
        let (read, contacts) = self.contacts(positions);
        for (slopes, [dw, dc]) in slopes {
            let mut dz = slopes.first().copied().unwrap_or_default();
            for (slope, contact) in slopes.iter_mut().zip(&contacts) {
                dz = match contact {
                    Contact::Free => dz,
                    // d(y − c w)
                    Contact::Forward => *slope - c * dw - w * dc,
                    // d(y + (1 − c) w)
                    Contact::Backward => *slope + (1.0 - c) * dw - w * dc,
                };
                *slope = dz;
            }
        }
        read
    }
}

impl FittedLog {
    /// The play of the sensor of output `index` for these values of the extras; `None` if it has none.
    pub(crate) fn sensor_play(&self, index: usize, extras: &[f64]) -> Option<SensorPlay> {
        let quantity = self.seen[index].quantity;
        let width = self.extra(Nuisance::SensorPlay(quantity), extras)?;
        Some(SensorPlay { width, ahead: self.extra(Nuisance::SensorStart(quantity), extras).unwrap_or(0.5) })
    }

    /// Readings of the sensor of output `index` for these values of the model: with its play and its factor, its sign
    /// lost, and its bias.
    pub(crate) fn read(&self, index: usize, values: &[f64], extras: &[f64]) -> Vec<f64> {
        let mut read = match self.sensor_play(index, extras) {
            Some(play) => play.read(values),
            None => values.to_vec(),
        };
        let (scale, bias) = (self.sensor_scale(index, extras), self.bias(index, extras));
        let is_absolute = self.seen[index].absolute;
        read.iter_mut().for_each(|value| *value = scale * if is_absolute { value.abs() } else { *value } + bias);
        read
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_stays_within_the_play() {
        let play = SensorPlay { width: 2.0, ahead: 0.25 };
        let read = play.read(&[0.0, 0.4, 1.0, 3.0, 2.0, 1.0, 0.0, 1.5]);
        assert_eq!(read, [0.0, 0.0, 0.5, 2.5, 2.5, 2.5, 1.5, 1.5]);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let y = |a: f64| (0..60).map(|k| a * (0.2 * f64::from(k)).sin()).collect::<Vec<f64>>();
        let read = |[a, w, c]: [f64; 3]| SensorPlay { width: w, ahead: c }.read(&y(a));
        let at = [1.0, 0.3, 0.4];
        let mut slopes = [y(1.0), vec![0.0; 60], vec![0.0; 60]];
        let by = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let own = SensorPlay { width: at[1], ahead: at[2] }.differentiate(&y(at[0]), slopes.iter_mut().zip(by));
        assert_eq!(own, read(at));
        for (j, slope) in slopes.iter().enumerate() {
            let moved = |by: f64| {
                let mut own = at;
                own[j] += by;
                read(own)
            };
            for ((slope, high), low) in slope.iter().zip(moved(1e-6)).zip(moved(-1e-6)) {
                assert!((slope - (high - low) / 2e-6).abs() < 1e-6, "{j}: {slope} {}", (high - low) / 2e-6);
            }
        }
    }
}
