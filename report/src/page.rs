//! A report: one HTML file that opens without a network, on a phone, in the dark and on paper.

use super::figure::Figure;
use super::plane::Plane;
use super::svg::{PALETTE, Paint};
use super::{embed, layout, plot, together};
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};
use std::path::Path;
use taut::error::Result;
use taut::files::write_atomically;

/// A report under construction: call what comes next, then [`Page::html`] or [`Page::write`].
///
/// Wherever it takes `impl Render`, a string is escaped and `maud::html!` markup is taken as it is.
#[derive(Debug, Clone, Default)]
pub struct Page {
    title: String,
    subtitle: Option<Markup>,
    footer: Option<Markup>,
    body: String,
    contents: Vec<(String, String)>,
    figures: usize,
    machines: usize,
    axes: Vec<SharedAxis>,
    folds: usize,
}

/// An x axis that figures of a page have in common: they are zoomed together.
#[derive(Debug, Clone, PartialEq)]
struct SharedAxis {
    heading: String,
    log: bool,
    range: (f64, f64),
}

impl SharedAxis {
    /// The axis of a figure; none where a zoom of x is one of y, too.
    fn new(figure: &Figure) -> Option<Self> {
        let (x, _) = layout::scales(figure);
        let (heading, log, range) = (figure.x.heading(), figure.x.log, (x.lo, x.hi));
        (!figure.equal && !heading.is_empty()).then_some(Self { heading, log, range })
    }

    /// True if it measures the same over about the same range: runs of quite different lengths are zoomed apart.
    fn is_as(&self, other: &Self) -> bool {
        let bend = |v: f64| if self.log { v.ln() } else { v };
        let [a, b, c, d] = [self.range.0, self.range.1, other.range.0, other.range.1].map(bend);
        let near = 0.25 * (b - a).max(d - c);
        self.heading == other.heading && self.log == other.log && (a - c).abs() <= near && (b - d).abs() <= near
    }
}

/// The verdict of a callout or a badge on a statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Callout {
    /// It holds.
    Holds,
    /// It holds with a reservation.
    Partly,
    /// It does not hold.
    Fails,
    /// Something to know.
    Note,
}

impl Callout {
    /// The word in its badge.
    pub fn word(self) -> &'static str {
        match self {
            Callout::Holds => "holds",
            Callout::Partly => "in part",
            Callout::Fails => "does not hold",
            Callout::Note => "note",
        }
    }

    fn class(self) -> &'static str {
        match self {
            Callout::Holds => "holds",
            Callout::Partly => "partly",
            Callout::Fails => "fails",
            Callout::Note => "note-kind",
        }
    }

    /// A badge with another word, for a table cell or for prose.
    pub fn badge(self, word: &str) -> Markup {
        html! { span class={ "badge " (self.class()) } { (word) } }
    }
}

/// One cell of a table.
#[derive(Debug, Clone)]
pub enum Cell {
    /// Left-aligned text.
    Text(String),
    /// A number, already formatted; right-aligned.
    Number(String),
    /// A verdict with its word.
    Badge(Callout, String),
    /// Markup as it is.
    Markup(Markup),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::Text(text)
    }
}

impl From<Markup> for Cell {
    fn from(markup: Markup) -> Self {
        Cell::Markup(markup)
    }
}

impl From<Callout> for Cell {
    fn from(kind: Callout) -> Self {
        Cell::Badge(kind, kind.word().into())
    }
}

impl Cell {
    /// A number with so many significant digits.
    pub fn number(value: f64, digits: usize) -> Self {
        Cell::Number(taut::number::significant(value, digits))
    }

    /// A number with so many decimals.
    pub fn fixed(value: f64, decimals: usize) -> Self {
        Cell::Number(taut::number::fixed(value, decimals))
    }
}

/// A table: headings with units, then rows.
#[derive(Debug, Clone, Default)]
pub struct Table {
    caption: String,
    headings: Vec<(String, String)>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without columns; the caption may be empty.
    pub fn new(caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..Self::default() }
    }

    /// Adds a column; its unit stands in the heading and may be empty.
    pub fn column(mut self, heading: impl Into<String>, unit: &str) -> Self {
        self.headings.push((heading.into(), taut::number::pretty_unit(unit)));
        self
    }

    /// Adds a row, one cell per column.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// A column whose cells are mostly numbers has its heading on the right, too.
    fn numeric(&self, column: usize) -> bool {
        let cells = || self.rows.iter().filter_map(|row| row.get(column));
        2 * cells().filter(|c| matches!(c, Cell::Number(_))).count() > cells().count()
    }
}

impl Render for Table {
    fn render(&self) -> Markup {
        html! {
            // Above what scrolls, so that it can be read whatever the width.
            @if !self.caption.is_empty() { p.caption { (self.caption) } }
            div.scroll { table aria-label=[Some(&self.caption).filter(|caption| !caption.is_empty())] {
                thead { tr {
                    @for (i, (heading, unit)) in self.headings.iter().enumerate() {
                        th scope="col" class=[self.numeric(i).then_some("num")] {
                            (heading)
                            @if !unit.is_empty() { span.unit { (unit) } }
                        }
                    }
                } }
                tbody { @for row in &self.rows { tr { @for cell in row { @match cell {
                    Cell::Text(text) => td { (text) },
                    Cell::Number(text) => td.num { (text) },
                    Cell::Badge(kind, word) => td { (kind.badge(word)) },
                    Cell::Markup(markup) => td { (markup) },
                } } } } }
            } }
        }
    }
}

impl Page {
    /// An empty page with its title.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// The sentence under the title.
    pub fn subtitle(mut self, text: impl Render) -> Self {
        self.subtitle = Some(text.render());
        self
    }

    /// The end of every report of a case: its text under this name, `words` about it, and the version that ran it.
    pub fn case(&mut self, words: &str, name: &str, text: &str) {
        self.section("The case");
        if !words.is_empty() {
            self.prose(words);
        }
        self.embed(name, text);
        self.version();
    }

    /// The version of taut at the very end.
    pub fn version(&mut self) {
        self.footer(format!("taut {}", env!("CARGO_PKG_VERSION")));
    }

    /// A line at the very end.
    pub fn footer(&mut self, text: impl Render) {
        self.footer = Some(text.render());
    }

    /// Begins a section; it gets an entry in the table of contents.
    pub fn section(&mut self, heading: &str) {
        let id = format!("s{}", self.contents.len() + 1);
        self.push(html! { h2 id=(id) { (heading) } });
        self.contents.push((id, heading.to_string()));
    }

    /// Begins a section that only shows its heading until it is opened; [`Page::end_fold`] ends it.
    pub fn begin_fold(&mut self, heading: &str) {
        self.folds += 1;
        self.push(PreEscaped("<details class=\"section\"><summary>".into()));
        self.section(heading);
        self.push(PreEscaped("</summary>".into()));
    }

    /// Ends a folded section.
    pub fn end_fold(&mut self) {
        self.push(PreEscaped("</details>".into()));
    }

    /// Begins a part of a section.
    pub fn subsection(&mut self, heading: &str) {
        self.push(html! { h3 { (heading) } });
    }

    /// A paragraph.
    pub fn prose(&mut self, text: impl Render) {
        self.push_words(html! { p { (text) } });
    }

    /// Anything else, as it is.
    pub fn markup(&mut self, markup: Markup) {
        self.push(markup);
    }

    /// A table.
    pub fn table(&mut self, table: &Table) {
        self.push_words(table.render());
    }

    /// Terms and what they mean or amount to.
    pub fn definitions<T: Render, D: Render>(&mut self, pairs: impl IntoIterator<Item = (T, D)>) {
        self.push_words(html! { dl { @for (term, text) in pairs { dt { (term) } dd { (text) } } } });
    }

    /// A statement with its verdict: the badge, what was stated, and what was found.
    pub fn callout(&mut self, kind: Callout, head: impl Render, text: impl Render) {
        self.push_words(html! {
            div class={ "callout " (kind.class()) } {
                p.head { (kind.badge(kind.word())) (head) }
                p { (text) }
            }
        });
    }

    /// A figure that can be zoomed, with its title and caption.
    pub fn figure(&mut self, figure: &Figure) {
        self.figures += 1;
        let svg = strip_style(&plot::svg(figure, false));
        let axis = SharedAxis::new(figure).map(|axis| self.shared(axis));
        self.push(html! {
            figure.plot data-axis=[axis] {
                div.figtitle { span { (figure.title) } button type="button" { "Reset zoom" } }
                div.stage tabindex="0" role="group" aria-label=(figure.title) { (PreEscaped(svg)) }
                script type="application/json" { (PreEscaped(embed::json(figure))) }
                @if !figure.caption.is_empty() { figcaption { (words(&figure.caption)) } }
            }
        });
    }

    /// The number of an axis, among those of figures before if one of them is the same.
    fn shared(&mut self, axis: SharedAxis) -> usize {
        let known = self.axes.iter().position(|known| known.is_as(&axis));
        known.unwrap_or_else(|| {
            self.axes.push(axis);
            self.axes.len() - 1
        })
    }

    /// A plane, with its title and caption.
    pub fn plane(&mut self, plane: &Plane) {
        let svg = strip_style(&plane.bare());
        self.push(html! {
            figure.drawing {
                div.figtitle { span { (plane.title) } }
                div.scroll { (PreEscaped(svg)) }
                @if !plane.caption.is_empty() { figcaption { (words(&plane.caption)) } }
            }
        });
    }

    /// A drawing: an SVG as it is, so it must come from this library. The caption may be empty.
    pub fn drawing(&mut self, svg: &str, caption: impl Render) {
        let caption = caption.render();
        self.push(html! {
            figure.drawing {
                div.scroll { (PreEscaped(strip_style(svg))) }
                @if !caption.0.is_empty() { figcaption { (words(caption)) } }
            }
        });
    }

    /// A machine in motion under its title, moved by a script; `json` is what `live.js` reads.
    pub(crate) fn machine(&mut self, title: &str, json: &str, caption: &str) {
        self.machines += 1;
        self.push(html! {
            figure.machine {
                div.figtitle { span { (title) } }
                div.stage-box {}
                div.transport role="toolbar" aria-label={ "Time: " (title) } {}
                script type="application/json" { (PreEscaped(json)) }
                figcaption { (words(caption)) }
            }
        });
    }

    /// An equation as MathML (`html! { math { mi { "x" } } }`) with its number, if it has one.
    pub fn equation(&mut self, math: impl Render, number: Option<&str>) {
        self.push(html! { div.equation { (math) @if let Some(number) = number { span.number { (number) } } } });
    }

    /// A text that can be unfolded: the case file, a log.
    pub fn embed(&mut self, title: &str, text: &str) {
        let lines = text.lines().count();
        self.push(html! {
            details.embed { summary { b { (title) } (lines) " lines" } pre { (text) } }
        });
    }

    fn push(&mut self, markup: Markup) {
        self.body.push_str(&markup.into_string());
        self.body.push('\n');
    }

    /// Adds text in which numbers stay beside their units.
    fn push_words(&mut self, markup: Markup) {
        self.push(words(markup));
    }

    /// The part between header and footer, for a page of one's own that has [`style`] and [`script`].
    pub fn body(&self) -> &str {
        &self.body
    }

    /// The whole file. Nothing in it asks for another.
    pub fn html(&self) -> String {
        let nav = self.contents.len() >= 4;
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    style {
                        (PreEscaped(colours())) (PreEscaped(include_str!("page.css")))
                        @if self.machines > 0 { (PreEscaped(MACHINE)) }
                    }
                }
                body {
                    main.page.with-nav[nav] {
                        header {
                            h1 { (self.title) }
                            @if let Some(subtitle) = &self.subtitle { p.subtitle { (subtitle) } }
                        }
                        @if nav {
                            nav aria-label="Contents" { details open { summary { "Contents" } ol {
                                @for (id, heading) in &self.contents { li { a href={ "#" (id) } { (heading) } } }
                            } } }
                        }
                        (PreEscaped(&self.body))
                        @if let Some(footer) = &self.footer { footer { (footer) } }
                    }
                    @if self.figures + self.machines > 0 { script { (PreEscaped(script(self.machines > 0))) } }
                    @if self.folds > 0 { script { (PreEscaped(UNFOLD)) } }
                }
            }
        };
        page.into_string()
    }

    /// Writes the file.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        write_atomically(path, self.html())
    }
}

/// The style of machines in motion and of their controls.
const MACHINE: &str = include_str!("machine.css");

/// Opens the folded section of the element that the address names, and all of them for printing.
const UNFOLD: &str = "\
const unfold = () => {
for (let e = document.getElementById(location.hash.slice(1)); e; e = e.parentElement) if (e.tagName === \"DETAILS\") e.open = true;
};
addEventListener(\"hashchange\", unfold);
addEventListener(\"beforeprint\", () => document.querySelectorAll(\"details.section\").forEach(e => { e.open = true; }));
unfold();
";

/// Numbers stay beside their units.
fn words(text: impl Render) -> Markup {
    PreEscaped(together::numbers_and_units(&text.render().into_string()))
}

/// The styles of a page's body within an element of the class `report`, and the palette; `data-theme` of the root,
/// which is `light` or `dark`, goes before the system's theme.
pub fn style() -> String {
    let palette = format!(
        ":root{{{0}}}@media screen and (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{1}}}}}\
         @media screen{{:root[data-theme=dark]{{{1}}}}}{2}",
        variables(|paint| paint.light),
        variables(|paint| paint.dark),
        classes()
    );
    format!("{palette}.report{{{}}}{MACHINE}", include_str!("page.css"))
}

/// The modules that draw plots and machines and bring them to life, by the names under which they import each other;
/// reports carry them, and the studio serves them.
pub const MODULES: [(&str, &str); 5] = [
    ("pen.js", include_str!("pen.js")),
    ("plot.js", include_str!("plot.js")),
    ("element.js", include_str!("element.js")),
    ("stage.js", include_str!("stage.js")),
    ("player.js", include_str!("player.js")),
];

/// Script that plays a report's machines with the modules.
const LIVE: &str = include_str!("live.js");

/// The modules as one script, without indentation and without the lines that are remarks. It brings the figures of its
/// document to life, and with `machines` those, too.
pub fn script(machines: bool) -> String {
    let modules = MODULES.iter().map(|(_, text)| *text).take(if machines { MODULES.len() } else { 2 });
    let mut is_remark = false;
    let kept = modules.chain(machines.then_some(LIVE)).flat_map(str::lines).map(str::trim_start).filter(|line| {
        is_remark |= line.starts_with("/**");
        let drops = is_remark || line.is_empty() || line.starts_with("//") || line.starts_with("import ");
        is_remark &= !line.ends_with("*/");
        !drops
    });
    let lines = kept.flat_map(|line| [line.strip_prefix("export ").unwrap_or(line), "\n"]);
    let start = if machines { "bring(document);\nliven(document);\n" } else { "bring(document);\n" };
    format!("(() => {{\n\"use strict\";\n{}{start}}})();\n", lines.collect::<String>())
}

/// The palette as variables for both themes, paper always light, and the classes that pictures use.
fn colours() -> String {
    let (light, dark) = (variables(|paint| paint.light), variables(|paint| paint.dark));
    format!(":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}{}", classes())
}

fn variables(pick: fn(&Paint) -> &'static str) -> String {
    PALETTE.iter().map(|paint| format!("--{}:{};", paint.class, pick(paint))).collect()
}

fn classes() -> String {
    PALETTE
        .iter()
        .map(|p| format!(".s-{0}{{stroke:var(--{0})}}.f-{0}{{fill:var(--{0})}}.t-{0}{{color:var(--{0})}}", p.class))
        .collect()
}

/// A picture without its own style sheet: on a page, the page's applies.
fn strip_style(svg: &str) -> String {
    match (svg.find("<style>"), svg.find("</style>")) {
        (Some(a), Some(b)) if a < b => format!("{}{}", &svg[..a], &svg[b + "</style>".len()..]),
        _ => svg.to_string(),
    }
}
