// @ts-check
// The means of all plots, of the studio and of reports: texts of numbers, scales and their ticks, axes, curves and
// symbols. They are drawn by the pen of a canvas or by one that writes SVG.

export const COLOURS = ["blue", "verm", "green", "purple", "amber", "sky"];
export const MINUS = "\u2212";
/** How far from its points a line may be drawn, in pixels. */
const NEAR = 0.05;
/** The largest value that is drawn. */
const MOST = 1e200;

/** The colours of the page's theme by name. @returns {Object<string, string>} */
export function palette() {
  const style = getComputedStyle(document.documentElement),
    names = [...COLOURS, "ink", "grey", "axis", "grid", "soft", "paper", "mark"];
  return Object.fromEntries(names.map(name => [name, style.getPropertyValue("--" + name).trim() || "#888"]));
}

/** @param {number} v @param {number} low @param {number} high */
export const limited = (v, low, high) => Math.max(low, Math.min(high, v));

/** The first index whose value is not below. @param {ArrayLike<number>} x @param {number} value */
export function lowerBound(x, value) {
  let from = 0,
    to = x.length;
  while (from < to) {
    const middle = (from + to) >> 1;
    if (x[middle] < value) from = middle + 1;
    else to = middle;
  }
  return from;
}

/** The value of a curve at a place within it, between points along a line.
 * @param {ArrayLike<number>} x @param {ArrayLike<number>} y @param {number} at */
export function valueAt(x, y, at) {
  const i = Math.min(x.length - 1, lowerBound(x, at));
  if (i === 0 || x[i] === at) return y[i];
  return y[i - 1] + ((at - x[i - 1]) / (x[i] - x[i - 1])) * (y[i] - y[i - 1]);
}

/** The value of a state at a place within its curve: no line leads from one to the next.
 * @param {ArrayLike<number>} x @param {ArrayLike<number>} y @param {number} at */
export function stateAt(x, y, at) {
  const i = Math.min(x.length - 1, lowerBound(x, at));
  return i === 0 || x[i] === at ? y[i] : y[i - 1];
}

/** Does what a key stands for, if it stands for something. @param {KeyboardEvent} event
 * @param {Object<string, () => void>} acts by key */
export function obey(event, acts) {
  if (event.ctrlKey || event.metaKey || event.altKey || !acts[event.key]) return;
  acts[event.key]();
  event.preventDefault();
}

// ---- Texts

const superscript = (/** @type {number} */ exponent) =>
  [...String(exponent)]
    .map(c => (c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[+c]))
    .join("");

/** A number as a mantissa, as short as it is, and a power of ten. @param {number} value @param {number} decimals */
function scientific(value, decimals) {
  const [mantissa, exponent] = value.toExponential(decimals).split("e");
  return `${String(+mantissa).replace("-", MINUS)}\u00d710${superscript(+exponent)}`;
}

/** As short as it can be with so many digits. @param {number} value @param {number} [digits] */
export function number(value, digits = 5) {
  if (!isFinite(value)) return "\u2013";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e7 || size < 1e-4) return scientific(value, digits - 1);
  return String(+value.toPrecision(digits)).replace("-", MINUS);
}

/** A tick's text: as many decimals as the step needs, powers of ten beyond comfortable lengths.
 * @param {number} value @param {number} by the step @param {number} largest of the values at the axis */
function tickText(value, by, largest) {
  if (Math.abs(value) < 1e-9 * by) value = 0;
  if (largest >= 1e6 || largest < 1e-4)
    return value === 0 ? "0" : scientific(value, limited(Math.ceil(Math.log10(largest / by)), 0, 15));
  return value.toFixed(limited(-Math.floor(Math.log10(by * 1.0001)), 0, 17)).replace("-", MINUS);
}

// ---- Scales

/** A round step for about so many ticks. @param {number} span @param {number} wanted */
export function step(span, wanted) {
  const rough = span / Math.max(1, wanted),
    power = 10 ** Math.floor(Math.log10(rough));
  return power * /** @type {number} */ ([1, 2, 5, 10].find(m => rough / power <= m * 1.0001));
}

/** A step that is a part of a turn, where it is larger than ten degrees. @param {number} span @param {number} wanted */
function angle(span, wanted) {
  const rough = span / Math.max(1, wanted);
  if (rough <= 10) return step(span, wanted);
  return [15, 30, 45, 90, 180].find(part => rough <= part * 1.0001) || 360 * Math.max(1, step(rough / 360, 1));
}

/** From values between the least and the greatest to 0..1, and back; its ticks are those of axis.rs. */
export class Scale {
  /** @param {number[]} range @param {{log?: boolean, degrees?: boolean}} [kind] */
  constructor([low, high], kind = {}) {
    this.low = low;
    this.high = high;
    this.isLog = Boolean(kind.log);
    this.isAngle = Boolean(kind.degrees);
    this.from = this.bent(low);
    this.span = this.bent(high) - this.from;
  }

  /** @param {number} value */
  bent(value) {
    return this.isLog ? Math.log(value) : value;
  }
  /** @param {number} value */
  place(value) {
    return (this.bent(value) - this.from) / this.span;
  }
  /** @param {number} place */
  value(place) {
    const bent = this.from + place * this.span;
    return this.isLog ? Math.exp(bent) : bent;
  }
  /** The range between two places. @param {number} a @param {number} b @returns {[number, number]} */
  part(a, b) {
    return [this.value(a), this.value(b)];
  }

  /** About so many round values, each with its text. @param {number} wanted @returns {[number, string][]} */
  ticks(wanted) {
    const {low, high} = this,
      most = Math.max(2, wanted);
    if (this.isLog && high >= 10 * low) return this.decades(most);
    const by = this.isAngle ? angle(high - low, most) : step(high - low, most),
      first = Math.ceil(low / by - 1e-6),
      last = Math.floor(high / by + 1e-6),
      largest = Math.max(Math.abs(low), Math.abs(high));
    if (!(by > 0 && last - first < 100)) return [];
    return Array.from({length: Math.max(0, last - first + 1)}, (_, i) => {
      const value = (first + i) * by;
      return [value, tickText(value, by, largest)];
    });
  }

  /** Powers of ten, and twice and five times those where there is room. @param {number} most */
  decades(most) {
    const {low, high} = this,
      count = Math.log10(high / low),
      factors = count * 3 <= most + 1 ? [1, 2, 5] : [1],
      every = Math.max(1, Math.ceil(count / most)),
      /** @type {[number, string][]} */
      found = [];
    for (let decade = Math.floor(Math.log10(low)); decade <= Math.ceil(Math.log10(high)); decade++) {
      if (decade % every) continue;
      for (const factor of factors) {
        const value = factor * 10 ** decade;
        if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
        const power = (factor > 1 ? factor + "\u00d7" : "") + "10" + superscript(decade);
        found.push([value, value >= 1e-3 && value < 1e5 ? String(+value.toPrecision(6)) : power]);
      }
    }
    return found;
  }
}

// ---- Pens

/** The pen of a canvas, or one that is used alike. @typedef {CanvasRenderingContext2D | SvgPen} Pen */

/** Letters of so many pixels. @param {number} size */
export const font = size => size + "px system-ui, 'Segoe UI', 'Noto Sans', Helvetica, Arial, sans-serif";

/** Pixels of the screen for one of the page. */
export const density = () => window.devicePixelRatio || 1;

/** The pen of a canvas that is emptied, and as large on the screen as it is said to be.
 * @param {HTMLCanvasElement} canvas @param {{width: number, height: number}} size */
export function sized(canvas, {width, height}) {
  const k = density();
  if (canvas.width !== Math.round(width * k) || canvas.height !== Math.round(height * k)) {
    canvas.width = Math.round(width * k);
    canvas.height = Math.round(height * k);
    canvas.style.height = height + "px";
  }
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.setTransform(k, 0, 0, k, 0, 0);
  pen.clearRect(0, 0, width, height);
  return pen;
}

/** A line through points. Of those after each other from left to right, the ones that it passes within `NEAR` are left
 * out: where curves are drawn without a graphics card, each costs time. */
export class Path {
  /** @param {Pen} pen */
  constructor(pen) {
    this.pen = pen;
    /** The last point drawn, and the last given. */
    this.x0 = this.y0 = this.x = this.y = NaN;
    /** The least and greatest slope from the last point drawn that pass all given since. */
    this.low = this.high = NaN;
  }

  /** @param {number} x @param {number} y */
  to(x, y) {
    const slope = (y - this.y0) / (x - this.x0);
    if (!(slope >= this.low && slope <= this.high && x >= this.x)) this.keep(x, y);
    const by = x - this.x0;
    this.low = Math.max(this.low, (y - NEAR - this.y0) / by);
    this.high = Math.min(this.high, (y + NEAR - this.y0) / by);
    this.x = x;
    this.y = y;
  }

  /** Draws to the last point given, or begins at the first. @param {number} x @param {number} y */
  keep(x, y) {
    const isFirst = isNaN(this.x);
    this.x0 = isFirst ? x : this.x;
    this.y0 = isFirst ? y : this.y;
    if (isFirst) this.pen.moveTo(x, y);
    else this.pen.lineTo(this.x0, this.y0);
    // Of points above one another none is left out.
    this.low = x > this.x0 ? -Infinity : NaN;
    this.high = x > this.x0 ? Infinity : NaN;
  }

  end() {
    this.pen.lineTo(this.x, this.y);
  }
}

/** @param {Pen} pen @param {number} x1 @param {number} y1 @param {number} x2 @param {number} y2 */
export function line(pen, x1, y1, x2, y2) {
  pen.beginPath();
  pen.moveTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
  pen.lineTo(Math.round(x2) + 0.5, Math.round(y2) + 0.5);
  pen.stroke();
}

/** Pixels as SVG has them, to a tenth. @param {number} v */
export const pixels = v => String(Math.round(limited(v, -1e6, 1e6) * 10) / 10);

/** @param {string} text */
export const escaped = text => text.replace(/[&<>"]/g, c => `&#${c.charCodeAt(0)};`);

/** @type {Object<string, string>} */
const SUBSCRIPTS = {"\u2091": "e", "\u2098": "m", "\u209c": "t", "\u208a": "+", "\u208b": MINUS};
for (let digit = 0; digit < 10; digit++) SUBSCRIPTS[String.fromCharCode(0x2080 + digit)] = String(digit);

/** A text for an SVG. Subscripts are set by shifts, since few fonts have those glyphs. @param {string} text */
const rich = text =>
  escaped(text).replace(/[\u2080-\u209c]+/g, run => {
    const letters = [...run].map(c => SUBSCRIPTS[c] || c).join("");
    return `<tspan dy="2.8" font-size="9">${letters}</tspan><tspan dy="-2.8">&#8203;</tspan>`;
  });

const ruler = /** @type {CanvasRenderingContext2D} */ (document.createElement("canvas").getContext("2d"));

/** A pen that writes SVG and is used like that of a canvas, as far as plots use it. */
export class SvgPen {
  /** @param {boolean} [isNamed] whether colours are names, for which the page has classes */
  constructor(isNamed = false) {
    this.isNamed = isNamed;
    this.text = this.d = "";
    this.kept = [];
    this.box = [0, 0, 0, 0];
    this.strokeStyle = this.fillStyle = "ink";
    this.lineWidth = this.globalAlpha = 1;
    this.lineCap = "butt";
    this.textAlign = "left";
    this.font = font(12);
    this.dash = [];
  }

  setLineDash(dash) {
    this.dash = dash;
  }
  beginPath() {
    this.d = "";
  }
  moveTo(x, y) {
    this.d += `M${pixels(x)} ${pixels(y)}`;
  }
  lineTo(x, y) {
    this.d += `L${pixels(x)} ${pixels(y)}`;
  }
  /** A circle. */
  arc(x, y, r) {
    this.d += `M${pixels(x - r)} ${pixels(y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
  }
  rect(...box) {
    this.box = box;
  }
  stroke() {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "",
      cap = this.lineCap === "butt" ? "" : ` stroke-linecap="${this.lineCap}"`;
    this.put("stroke", this.strokeStyle, `stroke-width="${this.lineWidth}"${dash}${cap}`);
  }
  fill() {
    this.put("fill", this.fillStyle, "");
  }
  fillRect(x, y, width, height) {
    this.d = `M${pixels(x)} ${pixels(y)}h${pixels(width)}v${pixels(height)}h${pixels(-width)}z`;
    this.fill();
  }
  fillText(text, x, y) {
    const anchor = {center: "middle", right: "end"}[this.textAlign],
      at = anchor ? ` text-anchor="${anchor}"` : "";
    this.text +=
      `<text ${this.paint("fill", this.fillStyle)} x="${pixels(x)}" y="${pixels(y)}" `
      + `font-size="${parseFloat(this.font)}"${at}>${rich(text)}</text>`;
  }
  measureText(text) {
    ruler.font = this.font;
    return ruler.measureText(text);
  }
  save() {
    this.kept.push({...this, end: ""});
  }
  /** Cuts off what is drawn outside of the last rectangle, until `restore`. */
  clip() {
    const [x, y, width, height] = this.box.map(pixels);
    this.text += `<svg x="${x}" y="${y}" width="${width}" height="${height}" viewBox="${x} ${y} ${width} ${height}">`;
    this.kept[this.kept.length - 1].end = "</svg>";
  }
  restore() {
    const {end, text, d, ...before} = this.kept.pop();
    this.text += end;
    Object.assign(this, before);
  }

  paint(what, colour) {
    return this.isNamed ? `class="${what[0]}-${colour}"` : `${what}="${colour}"`;
  }
  put(what, colour, more) {
    const faint = this.globalAlpha === 1 ? "" : ` opacity="${this.globalAlpha}"`;
    if (this.d) this.text += `<path ${this.paint(what, colour)} d="${this.d}" ${more}${faint}/>`;
  }
}

// ---- Axes

/** The axes of a plot: where values are, the grid, and curves and points within it.
 * @typedef {{left: number, right: number, top: number, bottom: number}} Margins pixels around the curves
 * @typedef {{first?: number, last?: number, together?: number, scale?: number}} Part of the rows, and the factor of the
 * values up */
export class Axes {
  /** @param {{width: number, height: number}} size of the picture, pixels @param {Margins} margins
   * @param {Scale} x across @param {Scale} y and up */
  constructor({width, height}, {left, right, top, bottom}, x, y) {
    this.width = width;
    this.left = left;
    this.right = width - right;
    this.top = top;
    this.bottom = height - bottom;
    this.x = x;
    this.y = y;
  }

  get wide() {
    return this.right - this.left;
  }
  get tall() {
    return this.bottom - this.top;
  }

  /** @param {number} x */
  across(x) {
    return this.left + this.wide * this.x.place(x);
  }
  /** @param {number} y */
  up(y) {
    return this.top + this.tall * (1 - this.y.place(y));
  }
  /** The value at a pixel. @param {number} pixel */
  xAt(pixel) {
    return this.x.value((pixel - this.left) / this.wide);
  }
  /** The value at a pixel. @param {number} pixel */
  yAt(pixel) {
    return this.y.value((this.bottom - pixel) / this.tall);
  }

  /** The grid, with numbers at its rows. @param {Pen} pen @param {Object<string, string>} colours
   * @param {[number, string][]} columns values across, with their texts @param {[number, string][]} rows */
  grid(pen, colours, columns, rows) {
    const {left, right, top, bottom} = this;
    pen.font = font(12);
    pen.lineWidth = 1;
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    pen.strokeStyle = colours.grid;
    pen.fillStyle = colours.grey;
    pen.textAlign = "right";
    for (const [value, text] of rows) {
      const y = this.up(value);
      line(pen, left, y, right, y);
      pen.fillText(text, left - 8, y + 4.2);
    }
    for (const [value] of columns) {
      const x = this.across(value);
      line(pen, x, top, x, bottom);
    }
  }

  /** The line below, with ticks and numbers of columns. @param {Pen} pen @param {Object<string, string>} colours
   * @param {[number, string][]} [columns] */
  base(pen, colours, columns = []) {
    const {left, right, bottom} = this;
    pen.strokeStyle = colours.axis;
    pen.lineWidth = 1.2;
    line(pen, left, bottom, right, bottom);
    pen.font = font(12);
    pen.textAlign = "center";
    pen.fillStyle = colours.grey;
    for (const [value, text] of columns) {
      const x = this.across(value),
        half = pen.measureText(text).width / 2 + 1;
      line(pen, x, bottom, x, bottom + 4);
      pen.fillText(text, limited(x, half, this.width - half), bottom + 18);
    }
  }

  /** Keeps what follows within the axes, until the pen is restored. @param {Pen} pen
   * @param {number} [room] pixels beside them for marks at the frame */
  clip(pen, room = 0) {
    pen.save();
    pen.beginPath();
    pen.rect(this.left - room, this.top - 2, this.wide + 2 * room, this.tall + 4);
    pen.clip();
  }

  /** Lines at values across or up. @param {Pen} pen @param {{x?: number, y?: number}[]} marks */
  marks(pen, marks) {
    pen.beginPath();
    for (const {x, y} of marks) {
      if (y !== undefined) {
        pen.moveTo(this.left, this.up(y));
        pen.lineTo(this.right, this.up(y));
      }
      if (x !== undefined) {
        pen.moveTo(this.across(x), this.top);
        pen.lineTo(this.across(x), this.bottom);
      }
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  /** A curve: of `together` points after each other the least and the greatest. It is broken at what is no number.
   * @param {Pen} pen @param {ArrayLike<number>} x @param {ArrayLike<number>} y @param {Part} [part] */
  curve(pen, x, y, {first = 0, last = x.length, together = 1, scale = 1} = {}) {
    const kx = this.wide / this.x.span,
      ky = this.tall / this.y.span,
      [logX, logY] = [this.x.isLog, this.y.isLog],
      [x0, y0] = [this.x.from, this.y.from];
    pen.beginPath();
    /** @type {Path | null} */
    let path = null;
    const to = (/** @type {number} */ i) => {
      const value = y[i] * scale,
        right = logX ? Math.log(x[i]) : x[i],
        up = logY ? Math.log(value) : value;
      if (!isFinite(right) || !isFinite(up) || !(Math.abs(value) <= MOST)) {
        if (path) path.end();
        path = null;
        return;
      }
      path ??= new Path(pen);
      path.to(this.left + (right - x0) * kx, this.bottom - (up - y0) * ky);
    };
    for (let i = first; i < last; i += together) {
      let least = i,
        greatest = i;
      const end = Math.min(last, i + together);
      for (let j = i + 1; j < end; j++) {
        if (y[j] < y[least]) least = j;
        if (y[j] > y[greatest]) greatest = j;
      }
      to(Math.min(least, greatest));
      if (least !== greatest) to(Math.max(least, greatest));
    }
    if (path) /** @type {Path} */ (path).end();
    pen.stroke();
  }

  /** A symbol at each point: a disc, a cross or a ring.
   * @param {Pen} pen @param {"points" | "crosses" | "rings"} kind @param {ArrayLike<number>} x
   * @param {ArrayLike<number>} y @param {number} radius pixels @param {Part} [part] */
  symbols(pen, kind, x, y, radius, {first = 0, last = x.length, scale = 1} = {}) {
    const places = [];
    for (let i = first; i < last; i++) {
      const [a, b] = [this.across(x[i]), this.up(y[i] * scale)];
      if (isFinite(a) && isFinite(b)) places.push([a, b]);
    }
    symbols(pen, kind, places, radius);
  }

  /** The point that is nearest to a place within so many pixels: its row, or -1, and the square of the distance.
   * @param {ArrayLike<number>} x @param {ArrayLike<number>} y @param {number[]} place @param {number} reach */
  nearest(x, y, [px, py], reach) {
    let row = -1,
      distance = reach ** 2;
    for (let i = 0; i < x.length; i++) {
      const far = (this.across(x[i]) - px) ** 2 + (this.up(y[i]) - py) ** 2;
      if (far < distance) [row, distance] = [i, far];
    }
    return {row, distance};
  }
}

/** @param {Pen} pen @param {"points" | "crosses" | "rings"} kind @param {number[][]} places @param {number} r pixels */
export function symbols(pen, kind, places, r) {
  pen.beginPath();
  for (const [a, b] of places) {
    if (kind === "crosses") {
      pen.moveTo(a - r, b - r);
      pen.lineTo(a + r, b + r);
      pen.moveTo(a + r, b - r);
      pen.lineTo(a - r, b + r);
    } else {
      pen.moveTo(a + r, b);
      pen.arc(a, b, r, 0, 7);
    }
  }
  if (kind === "points") pen.fill();
  else pen.stroke();
}
