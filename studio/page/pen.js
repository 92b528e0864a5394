// @ts-check
// The means of plots and figures: colours, steps of an axis, canvases as fine as the screen, lines.

export const COLOURS = ["blue", "verm", "green", "purple", "amber", "sky"];
/** How far from its points a line may be drawn, in pixels. */
const NEAR = 0.05;

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
