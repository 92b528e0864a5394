//! `cargo xtask hunt`: hunts for wrong answers, part by part; each part is a command of the crate `taut-hunt`.

/// The parts: a name, and what to give to cargo.
const PARTS: [(&str, &[&str]); 1] = [("stages", &["run", "--release", "--package", "taut-hunt", "--", "stages"])];

/// Runs the parts that the words name, all of them where they name none, each with the other words. False where one of them has found
/// something.
pub fn hunt(words: &[String]) -> Result<bool, String> {
    let (parts, rest) = split(words)?;
    let mut clean = true;
    for (name, command) in parts {
        eprintln!("== hunt: {name}");
        let status = crate::cargo(command).args(&rest).status();
        clean &= status.map_err(|e| format!("cargo cannot be started: {e}"))?.success();
    }
    Ok(clean)
}

/// A part and its command.
type Part = (&'static str, &'static [&'static str]);

/// The parts asked for, and the words that are not about them.
fn split(words: &[String]) -> Result<(Vec<Part>, Vec<String>), String> {
    let (mut parts, mut rest) = (Vec::new(), Vec::new());
    let mut words = words.iter();
    while let Some(word) = words.next() {
        if word != "--part" {
            rest.push(word.clone());
            continue;
        }
        let name = words.next().map_or("", String::as_str);
        let Some(part) = PARTS.into_iter().find(|(known, _)| *known == name) else {
            let known = PARTS.map(|(known, _)| known).join(", ");
            return Err(format!("--part {name}: there is no such part of the hunt; there is {known}"));
        };
        parts.push(part);
    }
    if parts.is_empty() {
        parts.extend(PARTS);
    }
    Ok((parts, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_string).collect()
    }

    #[test]
    fn parts_are_named_and_the_rest_is_passed_on() {
        let (parts, rest) = split(&words("--stages 50 --part stages --seed 3")).unwrap();
        assert_eq!(parts.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["stages"]);
        assert_eq!(rest, words("--stages 50 --seed 3"));
        assert_eq!(split(&words("--seed 3")).unwrap().0.len(), PARTS.len());
    }

    #[test]
    fn a_part_that_is_not_there_is_told() {
        let told = split(&words("--part stagse")).unwrap_err();
        assert_eq!(told, "--part stagse: there is no such part of the hunt; there is stages");
    }
}
