//! Block diagrams: blocks in columns and rows, orthogonal wires between their sides.
//!
//! Columns are as wide as their widest block; a wire runs straight where it can and otherwise through
//! the channel between two columns or along a lane above or below the rows. Whoever describes the diagram
//! chooses rows and lanes so that nothing crosses; the layout keeps the distances.

use super::svg::{self, Anchor, Paint, Svg, text_width};

/// A diagram under construction.
#[derive(Debug, Clone)]
pub struct Diagram {
    blocks: Vec<Block>,
    wires: Vec<Wire>,
    gaps: Vec<(usize, f64)>,
    row_height: f64,
}

/// Names a block of its diagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockId(usize);

/// The operation of a block.
#[derive(Debug, Clone, PartialEq)]
pub enum BlockKind {
    /// A signal that comes from outside.
    Input,
    /// A signal that goes outside.
    Output,
    /// Multiplies.
    Gain,
    /// Adds its inputs; one sign for each, from top to bottom.
    Sum(Vec<Sign>),
    /// Adds what comes from the left and subtracts what comes from above.
    Minus,
    /// Integrates over time.
    Integrator,
    /// A function of its inputs.
    Function,
    /// A whole subsystem with lines of text under its name.
    System(Vec<String>),
}

/// The sign with which a sum takes an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Added.
    Plus,
    /// Subtracted.
    Minus,
}

/// A block with its place.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    kind: BlockKind,
    column: usize,
    row: f64,
    text: String,
    note: String,
}

/// Where a wire meets a block: a side, and how far along it from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Port {
    /// Left side, from top to bottom.
    Left(f64),
    /// Right side, from top to bottom.
    Right(f64),
    /// Top side, from left to right.
    Top(f64),
    /// Bottom side, from left to right.
    Bottom(f64),
    /// A branch of the wire that leaves the middle of the right side, so many pixels behind the block.
    Tap(f64),
}

#[derive(Debug, Clone, PartialEq)]
struct Wire {
    from: (BlockId, Port),
    to: (BlockId, Port),
    lane: Option<f64>,
    label: String,
}

impl Diagram {
    /// An empty diagram whose rows are so many pixels apart.
    pub fn new(row_height: f64) -> Self {
        Self { blocks: Vec::new(), wires: Vec::new(), gaps: Vec::new(), row_height }
    }

    /// Adds a block; symbols in `text` may have subscripts (`τ_M`), `note`, of one or more lines,
    /// stands under the block.
    pub fn block(&mut self, kind: BlockKind, column: usize, row: f64, text: &str, note: &str) -> BlockId {
        self.blocks.push(Block { kind, column, row, text: text.into(), note: note.into() });
        BlockId(self.blocks.len() - 1)
    }

    /// Makes the channel after `column` at least so many pixels wide.
    pub fn gap(&mut self, column: usize, pixels: f64) {
        self.gaps.push((column, pixels));
    }

    /// A wire from the middle of a block's right side to the middle of another's left.
    pub fn wire(&mut self, from: BlockId, to: BlockId) {
        self.connect((from, Port::Right(0.0)), (to, Port::Left(0.0)), "");
    }

    /// A wire between any two ports, with a label near its beginning.
    pub fn connect(&mut self, from: (BlockId, Port), to: (BlockId, Port), label: &str) {
        self.wires.push(Wire { from, to, lane: None, label: label.into() });
    }

    /// A wire that runs along a lane: a row, between rows, above or below them all.
    pub fn connect_along(&mut self, lane: f64, from: (BlockId, Port), to: (BlockId, Port), label: &str) {
        self.wires.push(Wire { from, to, lane: Some(lane), label: label.into() });
    }

    /// The diagram as an SVG file; `label` says what it is to those who cannot see it.
    pub fn svg(&self, label: &str) -> String {
        let row = self.row_height;
        let sizes: Vec<(f64, f64)> = self.blocks.iter().map(|b| b.size(row)).collect();
        let columns = self.blocks.iter().map(|b| b.column + 1).max().unwrap_or(0);
        let mut widths = vec![0.0f64; columns];
        for (block, (w, _)) in self.blocks.iter().zip(&sizes) {
            widths[block.column] = widths[block.column].max(*w);
        }
        // Columns from left to right, each with its channel behind it.
        let mut centres = Vec::new();
        let mut x = 8.0;
        for (c, w) in widths.iter().enumerate() {
            centres.push(x + w / 2.0);
            let gap = self.gaps.iter().filter(|g| g.0 == c).map(|g| g.1).fold(34.0, f64::max);
            x += w + if c + 1 < columns { gap } else { 8.0 };
        }
        // Rows from the topmost lane or block to the lowest.
        let extents = self.blocks.iter().zip(&sizes).map(|(b, (_, h))| {
            let below = 4.0 + 17.0 * b.note.lines().count() as f64;
            let above = if matches!(b.kind, BlockKind::Sum(_)) { 22.0 } else { 4.0 };
            (b.row * row - h / 2.0 - above, b.row * row + h / 2.0 + below)
        });
        let lanes = self.wires.iter().filter_map(|w| w.lane).map(|l| (l * row - 20.0, l * row + 8.0));
        let (top, bottom) =
            extents.chain(lanes).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (lo, hi)| (a.min(lo), b.max(hi)));
        let (top, bottom) = if top < bottom { (top, bottom) } else { (0.0, 10.0) };
        let place = |id: BlockId| {
            let b = &self.blocks[id.0];
            (centres[b.column], b.row * row - top)
        };
        let mut out = Svg::new(x, bottom - top);
        for wire in &self.wires {
            let lane = wire.lane.map(|l| l * row - top);
            let at = |(id, port): (BlockId, Port)| port.at(place(id), sizes[id.0], &self.blocks[id.0]);
            draw_wire(&mut out, wire, at(wire.from), at(wire.to), lane);
        }
        for (i, block) in self.blocks.iter().enumerate() {
            block.draw(&mut out, place(BlockId(i)), sizes[i]);
        }
        out.finish(label)
    }
}

/// How far a sum reaches beyond its outermost inputs, both ends together.
const SUM_ENDS: f64 = 38.0;

impl Port {
    fn at(self, (x, y): (f64, f64), (w, h): (f64, f64), block: &Block) -> (f64, f64) {
        let along = |f: f64| match &block.kind {
            // A sum's inputs lie as far apart as rows do.
            BlockKind::Sum(_) => f * (h - SUM_ENDS) / 2.0,
            _ => f * h / 2.0,
        };
        match self {
            Port::Left(f) => (x - w / 2.0, y + along(f)),
            Port::Right(f) => (x + w / 2.0, y + f * h / 2.0),
            Port::Top(f) => (x + f * w / 2.0, y - h / 2.0),
            Port::Bottom(f) => (x + f * w / 2.0, y + h / 2.0),
            Port::Tap(d) => (x + w / 2.0 + d, y),
        }
    }

    fn is_vertical(self) -> bool {
        matches!(self, Port::Top(_) | Port::Bottom(_) | Port::Tap(_))
    }
}

fn draw_wire(out: &mut Svg, wire: &Wire, from: (f64, f64), to: (f64, f64), lane: Option<f64>) {
    let mut points = vec![from];
    match (lane, wire.from.1.is_vertical(), wire.to.1.is_vertical()) {
        (Some(lane), true, true) => points.extend([(from.0, lane), (to.0, lane)]),
        (Some(lane), true, false) => {
            points.extend([(from.0, lane), (to.0 - 18.0, lane), (to.0 - 18.0, to.1)]);
        }
        (Some(lane), false, true) => {
            points.extend([(from.0 + 18.0, from.1), (from.0 + 18.0, lane), (to.0, lane)]);
        }
        (Some(lane), false, false) => {
            points.extend([(from.0 + 18.0, from.1), (from.0 + 18.0, lane), (to.0 - 18.0, lane), (to.0 - 18.0, to.1)])
        }
        (None, true, false) => points.push((from.0, to.1)),
        (None, false, true) => points.push((to.0, from.1)),
        (None, _, _) if (from.1 - to.1).abs() > 0.5 && (from.0 - to.0).abs() > 0.5 => {
            let middle = (from.0 + to.0) / 2.0;
            points.extend([(middle, from.1), (middle, to.1)]);
        }
        (None, _, _) => {}
    }
    points.push(to);
    points.dedup();
    if matches!(wire.from.1, Port::Tap(_)) {
        out.circle(from, 2.8, svg::INK, svg::INK, 0.0);
    }
    let n = points.len();
    if n < 2 {
        return;
    }
    let (a, b) = (points[n - 2], points[n - 1]);
    let length = (b.0 - a.0).hypot(b.1 - a.1).max(1e-9);
    let u = ((b.0 - a.0) / length, (b.1 - a.1) / length);
    points[n - 1] = (b.0 - 5.0 * u.0, b.1 - 5.0 * u.1);
    let d: Vec<String> = points.iter().map(|p| format!("{} {}", svg::n(p.0), svg::n(p.1))).collect();
    out.path(&format!("M{}", d.join("L")), svg::INK, 1.3, "");
    out.head(b, u, 8.0, svg::INK);
    if !wire.label.is_empty() {
        // Above the longest horizontal stretch.
        let stretch = points.windows(2).filter(|w| (w[0].1 - w[1].1).abs() < 0.5);
        let longest = stretch.max_by(|a, b| (a[0].0 - a[1].0).abs().total_cmp(&(b[0].0 - b[1].0).abs()));
        if let Some(w) = longest {
            let at = ((w[0].0 + w[1].0) / 2.0, w[0].1 - 6.0);
            out.symbol(at, 13.0, Anchor::Middle, svg::INK, "", &wire.label);
        } else {
            let at = (points[0].0 + 7.0, (points[0].1 + points[1].1) / 2.0 + 4.0);
            out.symbol(at, 13.0, Anchor::Start, svg::INK, "", &wire.label);
        }
    }
}

impl Block {
    fn size(&self, row: f64) -> (f64, f64) {
        let text = text_width(&self.text, 14.0, true);
        let note = self.note.lines().map(|l| text_width(l, 11.5, true)).fold(0.0, f64::max);
        match &self.kind {
            BlockKind::Input | BlockKind::Output => (text.max(note) + 6.0, 24.0),
            // The note is wider than the triangle at times: it counts.
            BlockKind::Gain => ((text + 44.0).max(note + 6.0).max(56.0), 38.0),
            BlockKind::Sum(signs) => (28.0, row * (signs.len().max(1) - 1) as f64 + SUM_ENDS),
            BlockKind::Minus => (24.0, 24.0),
            BlockKind::Integrator => (40.0, 40.0),
            BlockKind::Function => (text.max(note).max(70.0) + 20.0, 50.0),
            BlockKind::System(lines) => {
                let widest = lines.iter().map(|l| text_width(l, 12.0, true)).fold(text * 1.08, f64::max);
                (widest + 38.0, 40.0 + 18.0 * lines.len() as f64)
            }
        }
    }

    fn draw(&self, out: &mut Svg, (x, y): (f64, f64), (w, h): (f64, f64)) {
        let edge: &Paint = svg::INK;
        match &self.kind {
            BlockKind::Input => {
                out.symbol((x + w / 2.0 - 3.0, y + 5.0), 14.0, Anchor::End, svg::INK, "", &self.text);
            }
            BlockKind::Output => {
                out.symbol((x - w / 2.0 + 5.0, y + 5.0), 14.0, Anchor::Start, svg::INK, "", &self.text)
            }
            BlockKind::Gain => {
                // A triangle is the sign of a gain; stretched to a house so that symbols fit.
                let (l, r, t, b) = (x - w / 2.0, x + w / 2.0, y - h / 2.0, y + h / 2.0);
                let roof = r - 18.0;
                let n = svg::n;
                let d = format!("M{} {}H{}L{} {}L{} {}H{}Z", n(l), n(t), n(roof), n(r), n(y), n(roof), n(b), n(l));
                out.fill(&d, svg::SOFT);
                out.path(&d, edge, 1.3, "");
                out.symbol(((l + roof + 6.0) / 2.0, y + 5.0), 14.0, Anchor::Middle, svg::INK, "", &self.text);
            }
            BlockKind::Sum(signs) => {
                out.rect((x - w / 2.0, y - h / 2.0), (w, h), w / 2.0, svg::SOFT, edge, 1.3);
                let k = signs.len();
                for (i, sign) in signs.iter().enumerate() {
                    let f = if k > 1 { 2.0 * i as f64 / (k - 1) as f64 - 1.0 } else { 0.0 };
                    let (_, at) = Port::Left(f).at((x, y), (w, h), self);
                    sign_mark(out, (x, at), *sign);
                }
                out.symbol((x, y - h / 2.0 - 7.0), 14.0, Anchor::Middle, svg::INK, "", "Σ");
            }
            BlockKind::Minus => {
                out.circle((x, y), w / 2.0, svg::SOFT, edge, 1.3);
                sign_mark(out, (x - w / 2.0 - 9.0, y + 11.0), Sign::Plus);
                sign_mark(out, (x + 11.0, y - h / 2.0 - 9.0), Sign::Minus);
            }
            BlockKind::Integrator => {
                out.rect((x - w / 2.0, y - h / 2.0), (w, h), 3.0, svg::SOFT, edge, 1.3);
                out.symbol((x, y + 7.0), 20.0, Anchor::Middle, svg::INK, "", "∫");
            }
            BlockKind::Function => {
                out.rect((x - w / 2.0, y - h / 2.0), (w, h), 3.0, svg::SOFT, edge, 1.3);
                out.symbol((x, y + 5.0), 14.0, Anchor::Middle, svg::INK, "", &self.text);
            }
            BlockKind::System(lines) => {
                out.rect((x - w / 2.0, y - h / 2.0), (w, h), 4.0, svg::SOFT, edge, 1.3);
                let top = y - h / 2.0 + 24.0;
                out.symbol((x, top), 14.0, Anchor::Middle, svg::INK, " font-weight=\"600\"", &self.text);
                for (i, line) in lines.iter().enumerate() {
                    let at = (x, top + 21.0 + 18.0 * i as f64);
                    out.symbol(at, 12.0, Anchor::Middle, svg::MARK, "", line);
                }
            }
        }
        for (i, line) in self.note.lines().enumerate() {
            let at = (x, y + h / 2.0 + 15.0 + 15.0 * i as f64);
            out.symbol(at, 11.5, Anchor::Middle, svg::MARK, "", line);
        }
    }
}

/// A plus or a minus, drawn so that it is centred in every font.
fn sign_mark(out: &mut Svg, (x, y): (f64, f64), sign: Sign) {
    out.line((x - 3.5, y), (x + 3.5, y), svg::INK, 1.4);
    if sign == Sign::Plus {
        out.line((x, y - 3.5), (x, y + 3.5), svg::INK, 1.4);
    }
}
