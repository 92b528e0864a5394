// @ts-check
// The means of plots and figures: colours, steps of an axis, canvases as fine as the screen, lines.

export const COLOURS = ["blue", "verm", "green", "purple", "amber", "sky"];
/** How far from its points a line may be drawn, in pixels. */
const NEAR = 0.05;
/** The largest value that is drawn. */
const MOST = 1e200;

/** A round step for about so many ticks. @param {number} span @param {number} wanted */
export function step(span, wanted) {
  const rough = span / Math.max(1, wanted),
    power = 10 ** Math.floor(Math.log10(rough));
  return power * /** @type {number} */ ([1, 2, 5, 10].find(m => rough / power <= m * 1.0001));
}

/** @param {number} low @param {number} high @param {number} wanted @returns {number[]} */
export function ticks(low, high, wanted) {
  const by = step(high - low, wanted),
    found = [];
  if (!(by > 0)) return found;
  for (let i = Math.ceil(low / by - 1e-6); i * by <= high + 1e-6 * by && found.length < 50; i++) found.push(i * by);
  return found;
}

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

/** A line through points from left to right. Points that it passes within `NEAR` are left out: where curves are drawn
 * without a graphics card, each costs time. */
export class Path {
  /** @param {CanvasRenderingContext2D} pen */
  constructor(pen) {
    this.pen = pen;
    /** The last point drawn, and the last given. */
    this.x0 = this.y0 = this.x = this.y = NaN;
    /** The least and greatest slope from the last point drawn that pass all given since. */
    this.low = this.high = NaN;
    pen.beginPath();
  }

  /** @param {number} x @param {number} y */
  to(x, y) {
    const slope = (y - this.y0) / (x - this.x0);
    if (!(slope >= this.low && slope <= this.high)) this.keep(x, y);
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

  stroke() {
    this.pen.lineTo(this.x, this.y);
    this.pen.stroke();
  }
}

/** @param {CanvasRenderingContext2D} pen @param {number} x1 @param {number} y1 @param {number} x2 @param {number} y2 */
export function line(pen, x1, y1, x2, y2) {
  pen.beginPath();
  pen.moveTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
  pen.lineTo(Math.round(x2) + 0.5, Math.round(y2) + 0.5);
  pen.stroke();
}

/** Width of the lines of letters at axes. */
const FONT = "12px system-ui, sans-serif";

/** The axes of a plot on a canvas: where values are, the grid, and curves and points within it.
 * @typedef {{left: number, right: number, top: number, bottom: number}} Margins pixels around the curves */
export class Axes {
  /** @param {{width: number, height: number}} size of the canvas, pixels @param {Margins} margins
   * @param {number[]} x the least and greatest value across @param {number[]} y and up
   * @param {boolean} [isLog] whether the values across are on a logarithmic scale */
  constructor({width, height}, {left, right, top, bottom}, x, y, isLog = false) {
    this.left = left;
    this.right = width - right;
    this.top = top;
    this.bottom = height - bottom;
    this.isLog = isLog;
    const place = (/** @type {number} */ value) => (isLog ? Math.log10(value) : value);
    this.x0 = place(x[0]);
    this.x1 = place(x[1]);
    this.y0 = y[0];
    this.y1 = y[1];
  }

  get wide() {
    return this.right - this.left;
  }
  get tall() {
    return this.bottom - this.top;
  }

  /** @param {number} x */
  across(x) {
    return this.left + (this.wide * ((this.isLog ? Math.log10(x) : x) - this.x0)) / (this.x1 - this.x0);
  }
  /** @param {number} y */
  up(y) {
    return this.top + (this.tall * (this.y1 - y)) / (this.y1 - this.y0);
  }
  /** The value at a pixel. @param {number} pixel */
  xAt(pixel) {
    const x = this.x0 + ((this.x1 - this.x0) * (pixel - this.left)) / this.wide;
    return this.isLog ? 10 ** x : x;
  }
  /** The value at a pixel. @param {number} pixel */
  yAt(pixel) {
    return this.y1 - ((this.y1 - this.y0) * (pixel - this.top)) / this.tall;
  }

  /** Round values up the axis, for about one in so many pixels. @param {number} every */
  rows(every) {
    return ticks(this.y0, this.y1, Math.max(2, this.tall / every));
  }

  /** The grid with its numbers. @param {CanvasRenderingContext2D} pen @param {Object<string, string>} colours
   * @param {[number, string][]} columns values across, with their texts @param {[number, string][]} rows */
  grid(pen, colours, columns, rows) {
    const {left, right, top, bottom} = this;
    pen.font = FONT;
    pen.lineWidth = 1;
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    pen.strokeStyle = colours.grid;
    pen.fillStyle = colours.grey;
    pen.textAlign = "right";
    for (const [value, text] of rows) {
      const y = this.up(value);
      line(pen, left, y, right, y);
      pen.fillText(text, left - 8, y + 4);
    }
    pen.textAlign = "center";
    for (const [value, text] of columns) {
      const x = this.across(value);
      line(pen, x, top, x, bottom);
      // A number at the end would stand across the edge.
      if (x < right - 4) pen.fillText(text, Math.max(left, x), bottom + 16);
    }
    pen.strokeStyle = colours.axis;
    line(pen, left, bottom, right, bottom);
  }

  /** Keeps what follows within the axes, until the pen is restored. @param {CanvasRenderingContext2D} pen */
  clip(pen) {
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.top - 2, this.wide, this.tall + 4);
    pen.clip();
  }

  /** Lines at values across or up. @param {CanvasRenderingContext2D} pen @param {{x?: number, y?: number}[]} marks */
  marks(pen, marks) {
    pen.lineWidth = 1;
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
   * @param {CanvasRenderingContext2D} pen @param {ArrayLike<number>} x @param {ArrayLike<number>} y
   * @param {{first?: number, last?: number, together?: number, scale?: number}} [part] of the rows, and the factor of
   * the values up */
  curve(pen, x, y, {first = 0, last = x.length, together = 1, scale = 1} = {}) {
    const kx = this.wide / (this.x1 - this.x0),
      ky = this.tall / (this.y1 - this.y0);
    /** @type {Path | null} */
    let path = null;
    const to = (/** @type {number} */ i) => {
      const value = y[i] * scale,
        at = this.isLog ? Math.log10(x[i]) : x[i];
      if (!isFinite(at) || !(Math.abs(value) <= MOST)) {
        if (path) path.stroke();
        path = null;
        return;
      }
      path ??= new Path(pen);
      path.to(this.left + (at - this.x0) * kx, this.top + (this.y1 - value) * ky);
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
    if (path) /** @type {Path} */ (path).stroke();
  }

  /** Points as discs. @param {CanvasRenderingContext2D} pen @param {ArrayLike<number>} x @param {ArrayLike<number>} y
   * @param {number} radius pixels @param {{first?: number, last?: number, scale?: number}} [part] as of curves */
  points(pen, x, y, radius, {first = 0, last = x.length, scale = 1} = {}) {
    pen.beginPath();
    for (let i = first; i < last; i++) {
      if (!isFinite(x[i]) || !isFinite(y[i])) continue;
      const a = this.across(x[i]),
        b = this.up(y[i] * scale);
      pen.moveTo(a + radius, b);
      pen.arc(a, b, radius, 0, 7);
    }
    pen.fill();
  }
}
