//! Values of options: numbers with units, and words.

use taut::case::EFFORTS;
use taut::control::recommendation::Damping;
use taut::control::shaper::Form;
use taut::machine::{Channel, Quantity};
use taut::quantity;

/// A number of draws or chains.
pub fn count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 1..=1_000_000) => Ok(number),
        _ => Err("a whole number from 1 to 1000000 is needed".into()),
    }
}

/// Metres of one of a unit of length.
pub fn metre_unit(text: &str) -> Result<f64, String> {
    quantity::read(&format!("1 {}", text.trim()), "m").map_err(|_| "a unit of length is needed, such as mm".into())
}

pub fn seed(text: &str) -> Result<u64, String> {
    let most = i64::MAX as u64;
    let seed = text.parse().ok().filter(|seed| *seed <= most);
    seed.ok_or_else(|| format!("a whole number from 0 to {most} is needed"))
}

pub fn count_or_none(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 0..=1_000_000) => Ok(number),
        _ => Err("a whole number from 0 to 1000000 is needed".into()),
    }
}

pub fn share(text: &str) -> Result<f64, String> {
    let share = match text.parse() {
        Ok(number) => number,
        Err(_) => quantity::read(text, "").map_err(|e| e.to_string())?,
    };
    if (0.0..1.0).contains(&share) { Ok(share) } else { Err("a share from 0 to below 1 is needed, such as 20%".into()) }
}

/// A share of what is limited.
pub fn reserve(text: &str) -> Result<f64, String> {
    match share(text)? {
        reserve if reserve <= 0.9 => Ok(reserve),
        _ => Err("a share from 0 to 90% is needed, such as 10%".into()),
    }
}

pub fn speed(text: &str) -> Result<f64, String> {
    positive(text, "m/s", "speed above zero, such as \"0.5 m/s\",")
}

pub fn acceleration(text: &str) -> Result<f64, String> {
    positive(text, "m/s^2", "acceleration above zero, such as \"20 m/s^2\",")
}

pub fn jerk(text: &str) -> Result<f64, String> {
    positive(text, "m/s^3", "jerk above zero, such as \"500 m/s^3\",")
}

pub fn effort(text: &str) -> Result<f64, String> {
    let (least, most) = (EFFORTS.start(), EFFORTS.end());
    match text.parse() {
        Ok(effort) if EFFORTS.contains(&effort) => Ok(effort),
        _ => Err(format!("a number from {least} to {most} is needed, such as 4")),
    }
}

/// A number in the SI unit, or with a unit of its own.
pub fn number(text: &str, unit: &str) -> Result<f64, String> {
    let value = match text.parse() {
        Ok(number) => number,
        Err(_) => quantity::read(text, unit).map_err(|e| e.to_string())?,
    };
    if f64::is_finite(value) { Ok(value) } else { Err("a finite number is needed".into()) }
}

pub fn metres(text: &str) -> Result<f64, String> {
    number(text, "m")
}

pub fn length(text: &str) -> Result<f64, String> {
    positive(text, "m", "length above zero, such as \"0.4 m\",")
}

pub fn amperes(text: &str) -> Result<f64, String> {
    positive(text, "A", "current above zero, such as \"3 A\",")
}

/// A measured quantity and its noise: `drive_angle=1mrad`.
pub fn channel(text: &str) -> Result<Channel, String> {
    let names = || Quantity::all().map(Quantity::name).collect::<Vec<_>>().join(", ");
    let (name, noise) = text.split_once('=').ok_or("a quantity and its noise are needed, such as drive_angle=1mrad")?;
    let quantity = Quantity::all().find(|quantity| quantity.name() == name.trim());
    let quantity =
        quantity.ok_or_else(|| format!("`{}` is not a measured quantity; available are {}", name.trim(), names()))?;
    let noise = positive(noise.trim(), quantity.unit(), "standard deviation above zero")?;
    Ok(Channel { quantity, step: None, noise, range: None })
}

pub fn metres_per_second(text: &str) -> Result<f64, String> {
    number(text, "m/s")
}

pub fn positive(text: &str, unit: &str, needed: &str) -> Result<f64, String> {
    match number(text, unit)? {
        value if value > 0.0 => Ok(value),
        _ => Err(format!("a {needed} is needed")),
    }
}

pub fn step(text: &str) -> Result<f64, String> {
    positive(text, "s", "step above zero, such as 0.1ms,")
}

pub fn delay(text: &str) -> Result<f64, String> {
    match number(text, "s")? {
        value if value >= 0.0 => Ok(value),
        _ => Err("a time of 0 s or more is needed, such as 0.1ms".into()),
    }
}

pub fn seconds(text: &str) -> Result<f64, String> {
    positive(text, "s", "time above zero, such as 0.1ms,")
}

pub fn hertz(text: &str) -> Result<f64, String> {
    positive(text, "Hz", "frequency above zero, such as 10Hz,")
}

pub fn smoothing(text: &str) -> Result<f64, String> {
    if text.trim().parse::<f64>().is_ok() {
        return Err("a length with its unit is needed, such as \"0.1 mm\"".into());
    }
    let length = quantity::read(text, "m").map_err(|e| e.to_string())?;
    if (1e-7..=0.1).contains(&length) {
        return Ok(length);
    }
    Err("a length from 0.0001 mm to 100 mm is needed, such as \"0.1 mm\"".into())
}

pub fn corner_speed(text: &str) -> Result<f64, String> {
    if text.trim().parse::<f64>().is_ok() {
        return Err("a speed with its unit is needed, such as \"5 mm/s\"".into());
    }
    let speed = quantity::read(text, "m/s").map_err(|e| e.to_string())?;
    if (0.0..=10.0).contains(&speed) {
        Ok(speed)
    } else {
        Err("a speed from 0 to 10 m/s is needed, such as \"5 mm/s\"".into())
    }
}

/// Shapers with their parameters.
#[derive(Debug, Clone)]
pub struct Shapers(pub Vec<Form>);

pub fn shapers(text: &str) -> Result<Shapers, String> {
    // A comma within parentheses parts parameters.
    let (mut all, mut depth, mut from) = (Vec::new(), 0, 0);
    for (place, character) in text.char_indices().chain([(text.len(), ',')]) {
        match character {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' if depth <= 0 || place == text.len() => {
                all.push(Form::read(&text[from..place]).map_err(|e| e.to_string())?);
                from = place + 1;
            }
            _ => {}
        }
    }
    Ok(Shapers(all))
}

pub fn damping(text: &str) -> Result<Damping, String> {
    match text.trim() {
        "fitted" => Ok(Damping::Fitted),
        text => {
            text.parse().map(Damping::Ratio).map_err(|_| "a damping ratio such as 0.08 is needed, or \"fitted\"".into())
        }
    }
}

pub fn vibrations(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('%').trim_end().parse::<f64>() {
        Ok(percent) if (0.1..=100.0).contains(&percent) => Ok(0.01 * percent),
        _ => Err("per cent from 0.1 to 100 are needed, such as 5".into()),
    }
}

pub fn uncertainty(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(part) if (0.0..=0.5).contains(&part) => Ok(part),
        _ => Err("a part from 0 to 0.5 is needed, such as 0.1 for 10 %".into()),
    }
}
