//! The numbers that a controller remembers from sample to sample: one function of each part hands them out and takes
//! them back.

/// Is shown every number in turn, and may put another in its place. None where it has no more.
pub(super) type Memory<'m> = dyn FnMut(&mut f64) -> Option<()> + 'm;

/// All of these.
pub(super) fn all<'n>(numbers: impl IntoIterator<Item = &'n mut f64>, memory: &mut Memory) -> Option<()> {
    numbers.into_iter().try_for_each(memory)
}

/// Yes or no, as 1 or 0.
pub(super) fn flag(flag: &mut bool, memory: &mut Memory) -> Option<()> {
    let mut number = f64::from(u8::from(*flag));
    memory(&mut number)?;
    *flag = match number {
        0.0 => false,
        1.0 => true,
        _ => return None,
    };
    Some(())
}

/// Numbers that may be absent.
pub(super) fn optional<const N: usize>(numbers: &mut Option<[f64; N]>, memory: &mut Memory) -> Option<()> {
    let mut is_there = numbers.is_some();
    flag(&mut is_there, memory)?;
    let mut values = numbers.unwrap_or([0.0; N]);
    all(&mut values, memory)?;
    *numbers = is_there.then_some(values);
    Some(())
}

/// A number that may be absent.
pub(super) fn last(number: &mut Option<f64>, memory: &mut Memory) -> Option<()> {
    let mut list = number.map(|number| [number]);
    optional(&mut list, memory)?;
    *number = list.map(|[number]| number);
    Some(())
}
