//! The tables of the case file's reference are those of the program.

use std::fs;
use std::path::Path;
use taut::case::Case;
use taut::machine::BELTS;
use taut::number::engineering;
use taut::parameter::{free_markdown, markdown, sections};

#[test]
fn the_reference_holds_the_tables_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/case-file.md");
    let text = fs::read_to_string(&path).unwrap();
    let mut updated = text.clone();
    let tables = sections().map(|section| (format!("parameters: {section}"), markdown(section)));
    let others = [("parameters: free", free_markdown()), ("belts", belts())];
    for (section, table) in tables.chain(others.map(|(name, table)| (name.to_string(), table))) {
        let (begin, end) = (format!("<!-- {section} -->\n"), "<!-- end -->");
        let from = updated.find(&begin).unwrap_or_else(|| panic!("no table of {section}")) + begin.len();
        let to = from + updated[from..].find(end).expect("an end");
        updated.replace_range(from..to, &table);
    }
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, &updated).unwrap();
    } else {
        assert_eq!(text, updated, "run with UPDATE_EXPECT=1 to write the tables anew");
    }
}

/// The types of belts as a table: at 10 mm of width, what each source has.
fn belts() -> String {
    const WIDTH: f64 = 10e-3;
    let mut text = String::from(
        "| type | pitch | E A of 10 mm | allowed tension | mass | a tooth carries | source |\n|---|---|---|---|---|---|---|\n",
    );
    let told = |value: Option<f64>, unit: &str, digits: usize| {
        value.map_or("–".to_string(), |value| engineering(value, unit, digits))
    };
    for belt in BELTS {
        text += &format!(
            "| `{}` | {} | {} | {} | {} | {} | {} |\n",
            belt.name,
            engineering(belt.pitch, "m", 4),
            told(belt.stiffness(WIDTH), "N", 3),
            told(belt.tension(WIDTH), "N", 3),
            told(belt.mass(WIDTH).map(|mass| 1e3 * mass), "g/m", 3),
            told(belt.teeth(WIDTH, 1.0), "N", 3),
            belt.source,
        );
    }
    text
}

#[test]
fn the_example_of_a_gantry_reads() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/gantry.md");
    let text = fs::read_to_string(path).unwrap();
    let blocks = text.split("```toml\n").skip(1).map(|block| block.split("```").next().unwrap_or_default());
    let (variants, parts): (Vec<&str>, Vec<&str>) = blocks.partition(|block| block.starts_with("# instead"));
    let whole = parts.join("\n");
    let belt = whole.find("[belt]").unwrap();
    let end = belt + whole[belt..].find("\n[").unwrap();
    let follows = format!("{}{}{}", &whole[..belt], variants[0], &whole[end..]);
    for (text, is_following) in [(&whole, false), (&follows, true)] {
        let case = Case::from_text_with("docs/gantry.md", text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert!(case.machine.belt.follows_cart == is_following && case.experiments.len() == 2);
    }
}

#[test]
fn the_examples_of_the_reference_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/case-file.md");
    let text = fs::read_to_string(path).unwrap();
    let blocks = text.split("```toml\n").skip(1).map(|block| block.split("```").next().unwrap_or_default());
    let (variants, parts): (Vec<&str>, Vec<&str>) = blocks.partition(|block| block.starts_with("# instead"));
    let whole = parts.join("\n");
    assert_eq!(variants.len(), 9);
    for variant in variants {
        let table = variant.lines().find(|line| line.starts_with('[')).unwrap();
        if table == "[stepper]" {
            // A stepper is commanded a position, which the experiments and controllers of the whole are not.
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/stepper-axis/stepper-axis.toml");
            let own = fs::read_to_string(path).unwrap();
            let begin = own.find(table).unwrap();
            let end = begin + own[begin..].find("\n[").unwrap();
            let other = format!("{}{variant}{}", &own[..begin], &own[end..]);
            let case = Case::from_text("docs/case-file.md", &other).unwrap_or_else(|error| panic!("{error}"));
            assert!(case.machine.drives[0].motor.stepper.is_some());
            continue;
        }
        let begin = whole.find(if table == "[drive]" { "[motor]" } else { table }).unwrap();
        let end = begin + whole[begin..].find("\n[").unwrap();
        let mut other = format!("{}{variant}{}", &whole[..begin], &whole[end..]);
        if table == "[drive]" {
            // Without a motor its resistance cannot vary.
            let varied = r#""motor.resistance"       = { log_normal = ["0.71 ohm", 0.05] }"#;
            other = other.replace(varied, r#""drive.drag" = { log_normal = ["12 N s/m", 0.05] }"#);
        }
        if variant.contains("type ") {
            // A type has a pitch of its own.
            other = other.replace("pitch    = \"2.03 mm\"\n", "");
        }
        let case = Case::from_text("docs/case-file.md", &other).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(case.machine.belt.make.is_some(), table == "[belt]");
    }
    let case = Case::from_text("docs/case-file.md", &whole).unwrap_or_else(|error| panic!("{error}\n{whole}"));
    assert!(case.experiments.len() > 5);
}
