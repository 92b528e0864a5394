//! The page as a folder of files for any server of static files; workers of the browser execute its commands.

use crate::{assets, guard};

/// Lines for the head of the page are inserted after this one.
const PLACE: &str = "<meta charset=\"utf-8\">\n";

/// The element by which other pages contain this one. The server has none, as it forbids that.
const ELEMENT: (&str, &str) = ("taut-stage.js", include_str!("../page/taut-stage.js"));

/// Names and contents of the files, except the module `taut.wasm`.
pub fn page_without_server() -> Vec<(&'static str, String)> {
    let own = |name: &str, file: &str| if name == "index.html" { without_server(file) } else { file.to_string() };
    let page = assets::files().map(|(name, _, file)| (name, own(name, &file)));
    page.chain([(ELEMENT.0, ELEMENT.1.to_string())]).collect()
}

/// Adds the Content-Security-Policy, which the server would send as a header, and the carrier.
fn without_server(page: &str) -> String {
    let scripts = guard::POLICY.replace("script-src 'self'", "script-src 'self' 'wasm-unsafe-eval'");
    let policy = format!("{scripts}; connect-src 'self'");
    let head = format!(
        "<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"carrier\" content=\"workers\">\n"
    );
    page.replacen(PLACE, &format!("{PLACE}{head}"), 1)
}

#[cfg(test)]
mod tests {
    use super::page_without_server;

    #[test]
    fn the_page_names_only_files_of_its_folder() {
        let files = page_without_server();
        let text = |wanted: &str| &files.iter().find(|(name, _)| *name == wanted).unwrap().1;
        let page = text("index.html");
        assert!(page.contains("name=\"carrier\"") && page.contains("'wasm-unsafe-eval'; style-src"), "{page}");
        for name in page.split(['"']).filter(|word| word.ends_with(".js") || word.ends_with(".css")) {
            assert!(!text(name).is_empty(), "{name}");
        }
        let scripts = files.iter().filter(|(name, _)| name.ends_with(".js"));
        let imports = scripts.flat_map(|(_, text)| text.split("from \"./").skip(1));
        let names: Vec<&str> = imports.filter_map(|rest| rest.split('"').next()).collect();
        assert!(names.len() > 20 && names.iter().all(|name| !text(name).is_empty()));
    }
}
