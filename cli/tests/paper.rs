//! `taut paper` as its reader gets it: golden numbers, documented ids, every figure, nothing from a network.

use crate::common::{self, taut_in};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Output;
use std::sync::LazyLock;

/// One run for all tests, in a folder that does not exist before.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("paper-{}", std::process::id())).join("deep");
    let output = taut(&["paper", "--png", "--out", folder.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("report.html") && text.contains("golden-table4-5V-motor"), "{text}");
    folder
});

fn taut(arguments: &[&str]) -> Output {
    taut_in(env!("CARGO_TARGET_TMPDIR")).args(arguments).output().unwrap()
}

fn read(name: &str) -> String {
    std::fs::read_to_string(FOLDER.join(name)).unwrap()
}

fn claims() -> Vec<Value> {
    serde_json::from_str(&read("claims.json")).unwrap()
}

fn claim(id: &str) -> Value {
    claims().into_iter().find(|c| c["id"] == id).unwrap_or_else(|| panic!("no claim {id}"))
}

#[test]
fn golden_numbers_are_met_to_their_printed_digits() {
    // Independent high-precision solutions.
    for (id, expected, tolerance) in [
        ("golden-table4-5V-motor", 0.053744890394, 1e-12),
        ("golden-table4-10V-motor", 0.123487374321, 1e-12),
        ("golden-table4-5V-cart", 0.053746653033, 1e-12),
        ("golden-table4-10V-cart", 0.123487225459, 1e-12),
        ("golden-table4-5V-motor-speed", 0.22327328936, 1e-11),
        ("golden-table4-10V-motor-speed", 0.50568922842, 1e-11),
        ("golden-table4-5V-cart-speed", 0.22352925510, 1e-11),
        ("golden-table4-10V-cart-speed", 0.50620371363, 1e-11),
        ("golden-table4-5V-stops", 6.0, 0.0),
        ("golden-table4-10V-starts", 4.0, 0.0),
        ("golden-table1-5V", 0.032136240137, 1e-12),
        ("golden-table1-10V", 0.064272480273, 1e-12),
        ("golden-table2-5V", 0.062371416174, 1e-12),
        ("golden-table2-10V", 0.124742832348, 1e-12),
        ("p1-sign-of-b", 22.34, 5e-3),
        ("p3-back-emf", 0.0613, 5e-5),
        ("p8-first-mode", 194.76, 5e-3),
        ("p9-scaled", -0.1295, 5e-5),
    ] {
        let value = claim(id)["value"].as_f64().unwrap();
        assert!((value - expected).abs() <= tolerance, "{id}: {value} against {expected}");
    }
}

#[test]
fn every_claim_has_a_number_or_says_why_not() {
    for claim in claims() {
        let id = &claim["id"];
        let verdict = claim["verdict"].as_str().unwrap();
        let checks = claim["checks"].as_array().unwrap();
        assert!(checks.iter().all(|c| c["value"].as_f64().is_some_and(f64::is_finite)), "{id}");
        let decides = checks.iter().any(|c| c["decides"] == true);
        assert_eq!(!decides, verdict == "cannot be checked", "{id}");
        assert!(decides || !claim["remark"].as_str().unwrap().is_empty(), "{id} does not say why");
        // The verdict is what its checks say.
        let fails = |d: bool| checks.iter().any(|c| c["decides"] == d && c["holds"] == false);
        let expected = match (decides, fails(true), fails(false)) {
            (false, ..) => "cannot be checked",
            (true, true, _) => "not confirmed",
            (true, false, true) => "confirmed with a remark",
            (true, false, false) => "confirmed",
        };
        assert_eq!(verdict, expected, "{id}");
    }
}

#[test]
fn misprints_are_told_and_references_are_met() {
    for id in ["p1-sign-of-b", "p2-r-and-r-squared", "p3-back-emf", "p4-lengths", "table3-holds", "table2-fits-5-V"] {
        assert_eq!(claim(id)["verdict"], "not confirmed", "{id}");
    }
    for claim in claims().iter().filter(|c| c["kind"] == "reference") {
        assert_eq!(claim["verdict"], "confirmed", "{}", claim["id"]);
    }
}

#[test]
fn the_ids_are_those_of_the_documentation() {
    let document = common::read("docs/paper.md");
    let (_, list) = document.split_once("## The claims").unwrap();
    let items = list.split("\n\n").find(|paragraph| paragraph.starts_with("- **")).unwrap();
    let documented: Vec<&str> = items.split('`').skip(1).step_by(2).collect();
    let ids: Vec<String> = claims().iter().map(|c| c["id"].as_str().unwrap().to_string()).collect();
    assert_eq!(documented, ids);
}

#[test]
fn the_report_holds_every_figure_and_asks_for_nothing() {
    let html = read("report.html");
    for number in 4..=21 {
        assert!(html.contains(&format!("Figure {number}.")), "figure {number}");
    }
    for word in ["http://", "https://", "<link", "src=\"", "@import", "url("] {
        // The name of a namespace is no address.
        let text = html.replace("http://www.w3.org/2000/svg", "").replace("http://www.w3.org/1998/Math/MathML", "");
        assert!(!text.contains(word), "the report contains {word}");
    }
    assert!(html.contains("not available as data"));
    // Scripts may know the word.
    let text: String =
        html.split("<script").map(|part| part.split_once("</script>").map_or(part, |(_, rest)| rest)).collect();
    assert!(!text.contains("NaN") && !text.contains("not a number"));
}

#[test]
fn every_figure_is_there_as_svg_png_and_data() {
    for number in (4..=17).chain([20, 21]) {
        let name = format!("figure-{number:02}");
        assert!(read(&format!("figures/{name}.svg")).starts_with("<svg"));
        assert!(std::fs::read(FOLDER.join(format!("figures/{name}.png"))).unwrap().starts_with(b"\x89PNG"));
        let data = read(&format!("data/{name}.csv"));
        let columns = data.lines().next().unwrap().split(',').count();
        assert!(columns >= 2 && data.lines().all(|l| l.split(',').count() == columns), "{name}");
    }
    for name in
        ["figure-01-02", "figure-03", "figure-18", "figure-19", "table-3", "modes-along-the-travel", "friction-laws"]
    {
        assert!(FOLDER.join(format!("figures/{name}.svg")).exists(), "{name}");
    }
    let last = read("data/figure-20.csv").lines().last().unwrap().to_string();
    assert!(last.starts_with("1,0.123487374320"), "{last}");
}

#[test]
fn json_on_the_terminal_is_the_file() {
    let folder = FOLDER.join("json");
    let output = taut(&["paper", "--json", "--out", folder.to_str().unwrap()]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), read("claims.json"));
}

#[test]
fn a_folder_that_cannot_be_made_is_told() {
    let file = FOLDER.join("claims.json");
    let output = taut(&["paper", "--out", file.join("below").to_str().unwrap()]);
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot be made"));
}
