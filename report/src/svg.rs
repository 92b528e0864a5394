//! SVG as text: escaping, the palette, text with subscripts, and how wide it will be.
//!
//! Colours stand in the file twice: as attributes (light, understood by every renderer) and as
//! classes, by which a page or a dark viewer overrides them.

use std::fmt::Write;

/// Colour roles for series and parts of drawings: told apart with any colour vision, in light and dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Colour {
    /// The first series.
    Blue,
    /// The second series, or what deserves attention.
    Vermillion,
    /// The third series, or what holds.
    Green,
    /// The fourth series.
    Purple,
    /// The fifth series.
    Amber,
    /// The sixth series.
    Sky,
    /// The colour of the text.
    Ink,
    /// Inputs, references, what stands in the background.
    Grey,
}

impl Colour {
    /// The colours that series take in turn when none is chosen.
    pub const CYCLE: [Colour; 6] =
        [Colour::Blue, Colour::Vermillion, Colour::Green, Colour::Purple, Colour::Amber, Colour::Sky];

    pub(crate) fn paint(self) -> &'static Paint {
        &PALETTE[self as usize]
    }
}

/// One colour in both themes.
pub(crate) struct Paint {
    pub class: &'static str,
    pub light: &'static str,
    pub dark: &'static str,
}

const fn paint(class: &'static str, light: &'static str, dark: &'static str) -> Paint {
    Paint { class, light, dark }
}

/// In the order of [`Colour`], then the neutral tones. After Okabe and Ito, darkened for thin lines on white.
pub(crate) static PALETTE: [Paint; 13] = [
    paint("blue", "#0b62a8", "#5cb0f2"),
    paint("verm", "#c94f0c", "#ff9159"),
    paint("green", "#007a5a", "#3fc99c"),
    paint("purple", "#a14f88", "#e6a0cb"),
    paint("amber", "#a87400", "#efbb3c"),
    paint("sky", "#3a8fc2", "#97d5f7"),
    paint("ink", "#16191d", "#e9ecef"),
    paint("grey", "#6a727c", "#99a3ae"),
    paint("axis", "#8b939c", "#77818b"),
    paint("grid", "#e4e7ea", "#2b3138"),
    paint("soft", "#f4f6f8", "#1e2329"),
    paint("paper", "#ffffff", "#121519"),
    paint("mark", "#5a626b", "#aab3bc"),
];
pub(crate) static INK: &Paint = &PALETTE[6];
pub(crate) static GREY: &Paint = &PALETTE[7];
pub(crate) static AXIS: &Paint = &PALETTE[8];
pub(crate) static GRID: &Paint = &PALETTE[9];
pub(crate) static SOFT: &Paint = &PALETTE[10];
pub(crate) static PAPER: &Paint = &PALETTE[11];
pub(crate) static MARK: &Paint = &PALETTE[12];

/// The font of every picture: the system's own, and for PNG the one that comes with the program.
pub(crate) const FONT: &str = "system-ui, 'Segoe UI', 'Noto Sans', Helvetica, Arial, sans-serif";

/// Where a text is anchored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// An SVG under construction, in pixels.
pub(crate) struct Svg {
    width: f64,
    height: f64,
    /// Space around the picture.
    pub margin: f64,
    body: String,
}

impl Svg {
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, margin: 0.0, body: String::new() }
    }

    /// The whole file; `label` is read out to those who cannot see it.
    pub fn finish(self, label: &str) -> String {
        let (m, w, h) = (n(-self.margin), n(self.width + 2.0 * self.margin), n(self.height + 2.0 * self.margin));
        let label = escape(label);
        let mut style = String::from("@media (prefers-color-scheme:dark){");
        for Paint { class, dark, .. } in &PALETTE {
            let _ = write!(style, ".s-{class}{{stroke:{dark}}}.f-{class}{{fill:{dark}}}");
        }
        style.push('}');
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{m} {m} {w} {h}\" width=\"{w}\" height=\"{h}\" role=\"img\" \
             aria-label=\"{label}\" font-family=\"{FONT}\" font-size=\"13\" fill=\"none\" stroke-linejoin=\"round\">\
             <style>{style}</style>{}</svg>\n",
            self.body
        )
    }

    /// A stroked path.
    pub fn path(&mut self, d: &str, paint: &Paint, width: f64, extra: &str) {
        let Paint { class, light, .. } = paint;
        let _ = write!(
            self.body,
            "<path class=\"s-{class}\" d=\"{d}\" stroke=\"{light}\" stroke-width=\"{}\"{extra}/>",
            n(width)
        );
    }

    /// A filled path.
    pub fn fill(&mut self, d: &str, paint: &Paint) {
        let Paint { class, light, .. } = paint;
        let _ = write!(self.body, "<path class=\"f-{class}\" d=\"{d}\" fill=\"{light}\"/>");
    }

    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), paint: &Paint, width: f64) {
        self.path(&format!("M{} {}L{} {}", n(from.0), n(from.1), n(to.0), n(to.1)), paint, width, "");
    }

    /// A circle, filled and stroked.
    pub fn circle(&mut self, centre: (f64, f64), r: f64, fill: &Paint, stroke: &Paint, width: f64) {
        let _ = write!(
            self.body,
            "<circle class=\"f-{} s-{}\" cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"{}\"/>",
            fill.class,
            stroke.class,
            n(centre.0),
            n(centre.1),
            n(r),
            fill.light,
            stroke.light,
            n(width)
        );
    }

    /// A rectangle with rounded corners, filled and stroked.
    pub fn rect(&mut self, at: (f64, f64), size: (f64, f64), r: f64, fill: &Paint, stroke: &Paint, width: f64) {
        let _ = write!(
            self.body,
            "<rect class=\"f-{} s-{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"{}\"/>",
            fill.class,
            stroke.class,
            n(at.0),
            n(at.1),
            n(size.0),
            n(size.1),
            n(r),
            fill.light,
            stroke.light,
            n(width)
        );
    }

    /// A cell of a map, in a colour that light and dark share.
    pub fn cell(&mut self, at: (f64, f64), size: (f64, f64), colour: &str) {
        let [x, y, wide, high] = [at.0, at.1, size.0, size.1].map(n);
        let _ = write!(
            self.body,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{high}\" fill=\"{colour}\" shape-rendering=\"crispEdges\"/>"
        );
    }

    /// A stroked path in such a colour.
    pub fn stroke(&mut self, d: &str, colour: &str, width: f64) {
        let _ = write!(self.body, "<path d=\"{d}\" stroke=\"{colour}\" stroke-width=\"{}\"/>", n(width));
    }

    /// Begins a part of which only what lies in this rectangle is shown.
    pub fn open_window(&mut self, at: (f64, f64), size: (f64, f64)) {
        let [x, y, wide, high] = [at.0, at.1, size.0, size.1].map(n);
        let _ = write!(
            self.body,
            "<svg x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{high}\" viewBox=\"{x} {y} {wide} {high}\">"
        );
    }

    /// Ends it.
    pub fn close_window(&mut self) {
        self.body.push_str("</svg>");
    }

    /// An arrow from `from` to `to`, its point at `to`.
    pub fn arrow(&mut self, from: (f64, f64), to: (f64, f64), paint: &Paint, width: f64) {
        let head = 5.0 + 1.6 * width;
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy).max(1e-9);
        let (ux, uy) = (dx / length, dy / length);
        self.line(from, (to.0 - 0.7 * head * ux, to.1 - 0.7 * head * uy), paint, width);
        self.head(to, (ux, uy), head, paint);
    }

    /// The point of an arrow at `to` that comes along the unit vector `u`.
    pub fn head(&mut self, to: (f64, f64), u: (f64, f64), head: f64, paint: &Paint) {
        let (bx, by) = (to.0 - head * u.0, to.1 - head * u.1);
        let half = 0.38 * head;
        self.fill(
            &format!(
                "M{} {}L{} {}L{} {}Z",
                n(to.0),
                n(to.1),
                n(bx - half * u.1),
                n(by + half * u.0),
                n(bx + half * u.1),
                n(by - half * u.0)
            ),
            paint,
        );
    }

    /// A text at its baseline. Unicode sub- and superscripts are set as such.
    pub fn text(&mut self, at: (f64, f64), size: f64, anchor: Anchor, paint: &Paint, extra: &str, text: &str) {
        self.spans(at, size, anchor, paint, extra, &rich(text, size, false));
    }

    /// A text with symbols: as [`Svg::text`], and `K_t` or `τ_f1` has a subscript.
    pub fn symbol(&mut self, at: (f64, f64), size: f64, anchor: Anchor, paint: &Paint, extra: &str, text: &str) {
        self.spans(at, size, anchor, paint, extra, &rich(text, size, true));
    }

    fn spans(&mut self, at: (f64, f64), size: f64, anchor: Anchor, paint: &Paint, extra: &str, spans: &str) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let Paint { class, light, .. } = paint;
        let _ = write!(
            self.body,
            "<text class=\"f-{class}\" x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{light}\"{anchor}{extra}>{spans}</text>",
            n(at.0),
            n(at.1),
            n(size)
        );
    }
}

/// A coordinate: at most two decimals, no trailing zeros, never anything that is not a number.
pub(crate) fn n(value: f64) -> String {
    if !value.is_finite() {
        return "0".into();
    }
    let mut text = format!("{value:.2}");
    let keep = text.trim_end_matches('0').trim_end_matches('.').len();
    text.truncate(keep);
    if text == "-0" { "0".into() } else { text }
}

/// Text for XML and HTML. Control characters, which XML forbids, become spaces.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// How a character is set, and the character itself.
#[derive(Clone, Copy, PartialEq)]
enum Level {
    Base,
    Below,
    Above,
}

fn levels(text: &str, markup: bool) -> Vec<(Level, char)> {
    let mut below = false;
    let mut out = Vec::with_capacity(text.len());
    for c in text.chars() {
        if markup && c == '_' {
            below = true;
            continue;
        }
        below &= c.is_alphanumeric() && out.last().is_none_or(|&(level, _)| level != Level::Above);
        out.push(match (c, below) {
            ('₀'..='₉', _) => (Level::Below, (b'0' + (c as u32 - '₀' as u32) as u8) as char),
            ('₊', _) => (Level::Below, '+'),
            ('₋', _) => (Level::Below, '−'),
            ('ₑ', _) => (Level::Below, 'e'),
            ('ₘ', _) => (Level::Below, 'm'),
            ('ₜ', _) => (Level::Below, 't'),
            ('⁰', _) => (Level::Above, '0'),
            ('¹', _) => (Level::Above, '1'),
            ('²', _) => (Level::Above, '2'),
            ('³', _) => (Level::Above, '3'),
            ('⁴'..='⁹', _) => (Level::Above, (b'4' + (c as u32 - '⁴' as u32) as u8) as char),
            ('⁻', _) => (Level::Above, '−'),
            (c, true) => (Level::Below, c),
            (c, false) => (Level::Base, c),
        });
    }
    out
}

/// Escaped text whose sub- and superscripts are set by shifts, since few fonts carry those glyphs.
fn rich(text: &str, size: f64, markup: bool) -> String {
    let mut out = String::new();
    let mut offset = 0.0;
    let levels = levels(text, markup);
    let mut i = 0;
    while i < levels.len() {
        let level = levels[i].0;
        let run = levels[i..].iter().take_while(|(l, c)| *l == level && !is_dots(*c)).count().max(1);
        let mut run: String = levels[i..i + run].iter().map(|(_, c)| *c).collect();
        i += run.chars().count();
        let mut dots = levels.get(i).map(|(_, c)| *c).filter(|c| is_dots(*c) && level == Level::Base);
        i += usize::from(dots.is_some());
        if let (Some(mark), true) = (dots, run.ends_with('x')) {
            run.pop();
            run.push(if mark == '\u{307}' { 'ẋ' } else { 'ẍ' });
            dots = None;
        }
        let target = match level {
            Level::Base => 0.0,
            Level::Below => 0.22 * size,
            Level::Above => -0.36 * size,
        };
        let run = escape(&run);
        match level {
            Level::Base if offset == 0.0 => out.push_str(&run),
            Level::Base => {
                let _ = write!(out, "<tspan dy=\"{}\">{run}</tspan>", n(target - offset));
            }
            _ => {
                let _ =
                    write!(out, "<tspan dy=\"{}\" font-size=\"{}\">{run}</tspan>", n(target - offset), n(0.7 * size));
            }
        }
        offset = target;
        if let Some(dots) = dots {
            out.push_str(&raised_dots(dots, size));
        }
    }
    out
}

fn is_dots(c: char) -> bool {
    matches!(c, '\u{307}' | '\u{308}')
}

/// One dot or two above the letter before, as derivatives have: full stops, raised, since the marks that
/// combine are misplaced by many fonts.
fn raised_dots(dots: char, size: f64) -> String {
    // A Greek letter is about 0.66 em wide, a full stop 0.27.
    let (letter, stop) = (0.66 * size, 0.27 * size);
    let (rise, close) = (0.6 * size, 0.05 * size);
    let (marks, wide) = if dots == '\u{307}' { (".", stop) } else { ("..", 2.0 * stop - close) };
    let back = n(-(letter + wide) / 2.0);
    let spacing = if marks.len() > 1 { format!("{back} {}", n(-close)) } else { back };
    format!(
        "<tspan dx=\"{spacing}\" dy=\"{}\">{marks}</tspan><tspan dx=\"{}\" dy=\"{}\">\u{200b}</tspan>",
        n(-rise),
        n((letter - wide) / 2.0),
        n(rise)
    )
}

/// Advance widths of the printable ASCII characters in hundredths of the font size (Noto Sans; most system fonts are
/// narrower).
const WIDTHS: [u8; 95] = [
    26, 27, 41, 65, 57, 83, 73, 23, 30, 30, 55, 57, 27, 32, 27, 37, 57, 57, 57, 57, 57, 57, 57, 57, 57, 57, 27, 27, 57,
    57, 57, 43, 90, 64, 65, 63, 73, 56, 52, 73, 74, 34, 27, 62, 52, 91, 76, 78, 61, 78, 62, 55, 56, 73, 60, 93, 58, 57,
    57, 33, 37, 33, 57, 44, 58, 56, 62, 48, 62, 56, 34, 62, 62, 26, 26, 53, 26, 94, 62, 61, 62, 62, 41, 48, 36, 62, 51,
    79, 53, 51, 47, 38, 55, 38, 57,
];

/// Roughly how wide a text is, on the safe side.
pub(crate) fn text_width(text: &str, size: f64, markup: bool) -> f64 {
    let em: f64 = levels(text, markup)
        .iter()
        .map(|&(level, c)| {
            let w = match c {
                ' '..='~' => f64::from(WIDTHS[c as usize - 32]) / 100.0,
                '\u{300}'..='\u{36f}' => 0.0,
                '\u{a0}' => 0.26,
                '\u{2e80}'.. => 1.0,
                _ => 0.6,
            };
            if level == Level::Base { w } else { 0.7 * w }
        })
        .sum();
    em * size
}

/// `text` cut so that it fits, with an ellipsis where something was left out.
pub(crate) fn fit(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size, false) <= width {
        return text.to_string();
    }
    let mut out = String::new();
    for c in text.chars() {
        out.push(c);
        if text_width(&out, size, false) + 0.8 * size > width {
            break;
        }
    }
    out.trim_end().to_string() + "…"
}
