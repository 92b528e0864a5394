//! The looser of two belts and the ratio of their stiffness: the statement of fits of logs and of spectra.

use crate::chance::normal_quantile;
use crate::number::significant;

/// The two sides that are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Sides {
    /// The spans at two drives with these names, from logs.
    Drives([&'static str; 2]),
    /// Belts A and B of a CoreXY, from spectra.
    Belts,
}

impl Sides {
    /// Names of both.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Self::Drives(names) => names,
            Self::Belts => ["belt A", "belt B"],
        }
    }

    /// A side as the subject of a sentence with its verb, and as what it is compared with.
    fn words(self, side: usize) -> [String; 2] {
        let name = self.names()[side];
        match self {
            Self::Drives(_) => [format!("the spans at the {name} are"), format!("those at the {name}")],
            Self::Belts => [format!("{name} is"), name.into()],
        }
    }
}

/// The stiffness of the second side over that of the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Belts {
    /// The sides.
    pub sides: Sides,
    /// K₂/K₁
    pub ratio: f64,
    /// Standard error of ln(K₂/K₁); infinite if it is not determined.
    pub error: f64,
}

impl Belts {
    /// 95 % interval of the ratio; from zero to infinity if it is not determined.
    pub fn interval(&self) -> [f64; 2] {
        let reach = (normal_quantile(0.975) * self.error).exp();
        [self.ratio / reach, self.ratio * reach]
    }

    /// Index of the side that is less stiff; `None` if the interval does not decide.
    pub fn looser(&self) -> Option<usize> {
        match self.interval() {
            [_, high] if high < 1.0 => Some(1),
            [low, _] if low > 1.0 => Some(0),
            _ => None,
        }
    }

    /// The comparison in a sentence.
    pub fn words(&self) -> String {
        let [low, high] = self.interval();
        let [one, other] = self.sides.names();
        let undecided = match self.sides {
            Sides::Drives(_) => ["the logs do not determine which spans are", "the logs do not tell which spans are"],
            Sides::Belts => ["the spectra do not determine which belt is", "the spectra do not tell which belt is"],
        };
        if !self.error.is_finite() {
            let choice = match self.sides {
                Sides::Drives(_) => format!("those at the {one} or at the {other}"),
                Sides::Belts => format!("{one} or {other}"),
            };
            return format!("{} looser, {choice}", undecided[0]);
        }
        let percent = |ratio: f64| significant(100.0 * (1.0 - ratio), 3);
        let stated = |looser: usize, [ratio, low, high]: [f64; 3]| {
            let ([subject, _], [_, than]) = (self.sides.words(looser), self.sides.words(1 - looser));
            let [by, least, most] = [ratio, high, low].map(percent);
            format!("{subject} looser than {than}: {by} % less stiff (95 %: {least} to {most} %)")
        };
        match self.looser() {
            Some(1) => stated(1, [self.ratio, low, high]),
            Some(_) => stated(0, [1.0 / self.ratio, 1.0 / high, 1.0 / low]),
            None => {
                let whose = match self.sides {
                    Sides::Drives(_) => format!("those at the {other} is {{}} times that at the {one}"),
                    Sides::Belts => format!("{other} is {{}} times that of {one}"),
                };
                let range = format!("{} to {}", significant(low, 3), significant(high, 3));
                format!("{} looser: the stiffness of {} (95 %)", undecided[1], whose.replace("{}", &range))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn belts(ratio: f64, error: f64) -> Belts {
        Belts { sides: Sides::Drives(["left drive", "right drive"]), ratio, error }
    }

    #[test]
    fn the_looser_belt_is_named_where_the_interval_says_so() {
        assert_eq!(belts(0.8, 0.01).looser(), Some(1));
        assert_eq!(belts(1.25, 0.01).looser(), Some(0));
        assert_eq!(belts(1.02, 0.02).looser(), None);
        assert_eq!(belts(0.5, f64::INFINITY).looser(), None);
        let words = belts(0.8, 0.01).words();
        assert!(words.contains("right drive are looser") && words.contains("20.0 % less stiff"), "{words}");
        // The other side.
        let words = belts(1.25, 0.01).words();
        assert!(words.contains("left drive are looser") && words.contains("20.0 % less stiff"), "{words}");
    }

    #[test]
    fn belts_of_spectra_have_their_letters() {
        let of = |ratio, error| Belts { sides: Sides::Belts, ratio, error }.words();
        assert_eq!(of(0.8, 0.01), "belt B is looser than belt A: 20.0 % less stiff (95 %: 18.4 to 21.6 %)");
        assert_eq!(of(1.25, 0.01), "belt A is looser than belt B: 20.0 % less stiff (95 %: 18.4 to 21.6 %)");
        let open = "the spectra do not tell which belt is looser: the stiffness of belt B is 0.962 to 1.04 times that of \
                    belt A (95 %)";
        assert_eq!(of(1.0, 0.02), open);
    }
}
