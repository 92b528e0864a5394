//! The tables of the case file's reference are those of the program.

use std::fs;
use std::path::Path;
use taut::case::Case;
use taut::parameter::{free_markdown, markdown, sections};

#[test]
fn the_reference_holds_the_tables_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/case-file.md");
    let text = fs::read_to_string(&path).unwrap();
    let mut updated = text.clone();
    let tables = sections().map(|section| (section, markdown(section)));
    for (section, table) in tables.chain([("free", free_markdown())]) {
        let (begin, end) = (format!("<!-- parameters: {section} -->\n"), "<!-- end -->");
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

#[test]
fn the_examples_of_the_reference_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/case-file.md");
    let text = fs::read_to_string(path).unwrap();
    let blocks = text.split("```toml\n").skip(1).map(|block| block.split("```").next().unwrap_or_default());
    let (variants, parts): (Vec<&str>, Vec<&str>) = blocks.partition(|block| block.starts_with("# instead"));
    let whole = parts.join("\n");
    assert_eq!(variants.len(), 2);
    for variant in variants {
        let begin = whole.find("[belt]").unwrap();
        let end = begin + whole[begin..].find("\n[").unwrap();
        let other = format!("{}{variant}{}", &whole[..begin], &whole[end..]);
        let case = Case::from_text("docs/case-file.md", &other).unwrap_or_else(|error| panic!("{error}"));
        assert!(case.stage.belt.make.is_some());
    }
    let case = Case::from_text("docs/case-file.md", &whole).unwrap_or_else(|error| panic!("{error}\n{whole}"));
    assert!(case.experiments.len() > 5);
}
