// @ts-check
// Figures of results: lines, points and bars on a canvas, with a cursor for keys, values as a table, and brushing.
import {element, fold, number, table} from "./format.js";
import {Axes, COLOURS, Scale, limited, obey, palette, sized} from "./pen.js";

const LEFT = 70,
  RIGHT = 14,
  TOP = 10,
  BOTTOM = 40,
  MARGINS = {left: LEFT, right: RIGHT, top: TOP, bottom: BOTTOM},
  ROWS = 60;

/** @typedef {{name: string, x: ArrayLike<number>, y: ArrayLike<number>, kind?: "line"|"points"|"bars"|"crosses",
 * colour?: string, dash?: number[], alpha?: number, quiet?: boolean}} Series
 * quiet: neither in the legend nor in the table */
/**
 * @typedef {{x: string, y: string, xUnit?: string, yUnit?: string, words?: string, height?: number,
 * logX?: boolean, equal?: boolean, xRange?: [number, number], yRange?: [number, number],
 * marks?: {x?: number, y?: number, name: string}[]}} Options
 */

/** @type {Set<Picture>} */
const all = new Set();
const again = () => {
  for (const one of all) {
    if (one.figure.isConnected) one.later();
    else if (one.wasShown) all.delete(one);
  }
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
new MutationObserver(again).observe(document.documentElement, {attributes: true, attributeFilter: ["data-theme"]});

export class Picture {
  /** @param {string} title @param {Options} axes
   * @param {(area: {x: [number, number], y: [number, number]} | null) => void} [brushed] called with what was
   * chosen by dragging */
  constructor(title, axes, brushed) {
    this.title = title;
    this.axes = axes;
    this.brushed = brushed;
    /** Axes of what was drawn last. @type {Axes | null} */
    this.drawn = null;
    /** @type {Series[]} */
    this.series = [];
    this.frame = 0;
    this.wasShown = false;
    /** @type {{x: [number, number], y: [number, number]} | null} */
    this.brush = null;
    /** @type {[number, number] | null} series and row under the cursor */
    this.cursor = null;
    this.canvas = element("canvas", {"aria-hidden": "true"});
    this.said = element("p", {class: "quiet picture-value", role: "status", "aria-live": "polite"});
    this.legend = element("span", {class: "legend"});
    const help = brushed
      ? "Drag to choose. Shift and arrow keys choose by keys, Escape clears."
      : "Arrow keys tell the values.";
    this.area = element(
      "div",
      {
        class: "area picture-area",
        tabindex: "0",
        role: "application",
        "aria-roledescription": "figure",
        "aria-label": `${title}. ${axes.words || ""} ${help}`,
        onkeydown: event => this.key(event),
      },
      this.canvas,
    );
    this.table = fold(
      {class: "data", ontoggle: () => this.fill()},
      "Values",
      `Values of ${title}`,
      element("div", {class: "scroll", tabindex: "0", role: "group", "aria-label": `Values of ${title}`}),
    );
    this.head = element("h3", {}, title);
    this.unit = element("span", {class: "quiet"});
    this.figure = element(
      "figure",
      {class: "picture", "data-picture": title},
      element("figcaption", {}, element("span", {class: "picture-head"}, this.head, this.unit), this.legend),
      this.area,
      this.said,
      this.table,
    );
    new ResizeObserver(() => this.later()).observe(this.area);
    this.listen();
    all.add(this);
  }

  /** @param {Series[]} series @param {Partial<Options>} [axes] */
  show(series, axes = {}) {
    const names = JSON.stringify(series.filter(one => !one.quiet).map(one => [one.name, one.colour]));
    this.series = series;
    Object.assign(this.axes, axes);
    this.unit.textContent = this.axes.yUnit || "";
    if (names !== this.names) {
      this.names = names;
      this.legend.replaceChildren(
        ...series
          .filter(one => !one.quiet && one.name)
          .map(one => element("span", {}, element("i", {class: `swatch t-${this.colourOf(one)}`}), one.name)),
      );
    }
    if (this.cursor && !(this.series[this.cursor[0]] && this.cursor[1] < this.series[this.cursor[0]].x.length))
      this.cursor = null;
    this.later();
  }

  /** @param {Series} one */
  colourOf(one) {
    return one.colour || COLOURS[this.series.filter(other => !other.quiet).indexOf(one) % COLOURS.length] || "blue";
  }

  later() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }

  get width() {
    return Math.max(180, this.area.clientWidth);
  }
  get height() {
    return this.axes.equal ? Math.min(this.width * 0.8, 420) : this.axes.height || 230;
  }

  ranges() {
    const {axes} = this,
      found = {x: [Infinity, -Infinity], y: [Infinity, -Infinity]};
    for (const {x, y, kind} of this.series) {
      for (let i = 0; i < x.length; i++) {
        if (!isFinite(x[i]) || !isFinite(y[i]) || Math.abs(y[i]) > 1e200 || (axes.logX && !(x[i] > 0))) continue;
        found.x[0] = Math.min(found.x[0], x[i]);
        found.x[1] = Math.max(found.x[1], x[i]);
        found.y[0] = Math.min(found.y[0], y[i]);
        found.y[1] = Math.max(found.y[1], y[i]);
      }
      if (kind === "bars") found.y[0] = 0;
    }
    for (const {x, y} of axes.marks || []) {
      if (y !== undefined && isFinite(y)) {
        found.y[0] = Math.min(found.y[0], y);
        found.y[1] = Math.max(found.y[1], y);
      }
      void x;
    }
    for (const key of /** @type {const} */ (["x", "y"])) {
      let [low, high] = found[key];
      if (!(high >= low)) {
        low = 0;
        high = 1;
      }
      if (high - low < 1e-12 * Math.max(Math.abs(low), Math.abs(high)) || high === low) {
        const room = Math.abs(low) * 0.05 || 0.5;
        low -= room;
        high += room;
      }
      const isBars = this.series.some(({kind}) => kind === "bars"),
        room = key === "x" && (axes.logX || isBars) ? 0 : 0.05 * (high - low);
      found[key] = [isBars && key === "y" ? 0 : low - room, high + room];
    }
    if (axes.xRange) found.x = [...axes.xRange];
    if (axes.yRange) found.y = [...axes.yRange];
    return found;
  }

  draw() {
    if (!this.area.clientWidth) return;
    this.wasShown = true;
    const {width, height, axes} = this,
      pen = sized(this.canvas, this),
      colours = palette(),
      range = this.ranges();
    if (axes.equal) this.square(range, (width - LEFT - RIGHT) / (height - TOP - BOTTOM));
    const frame = new Axes(this, MARGINS, new Scale(range.x, {log: axes.logX}), new Scale(range.y)),
      columns = frame.x.ticks(frame.wide / 62);
    this.drawn = frame;
    frame.grid(pen, colours, columns, frame.y.ticks(frame.tall / 34));
    frame.base(pen, colours, columns);
    pen.fillText(axes.x + (axes.xUnit ? `, ${axes.xUnit}` : ""), LEFT + frame.wide / 2, height - 6);
    frame.clip(pen);
    pen.lineWidth = 1;
    pen.setLineDash([5, 4]);
    frame.marks(pen, axes.marks || []);
    const across = (/** @type {number} */ x) => frame.across(x),
      up = (/** @type {number} */ y) => frame.up(y);
    for (const one of this.series) this.one(pen, one, colours[this.colourOf(one)], frame);
    if (this.brush) {
      const {x, y} = this.brush;
      pen.globalAlpha = 0.16;
      pen.fillStyle = colours.blue;
      pen.fillRect(across(x[0]), up(y[1]), across(x[1]) - across(x[0]), up(y[0]) - up(y[1]));
      pen.globalAlpha = 1;
      pen.strokeStyle = colours.blue;
      pen.strokeRect(across(x[0]), up(y[1]), across(x[1]) - across(x[0]), up(y[0]) - up(y[1]));
    }
    if (this.cursor) {
      const one = this.series[this.cursor[0]],
        i = this.cursor[1];
      pen.strokeStyle = colours.ink;
      pen.beginPath();
      pen.arc(across(one.x[i]), up(one.y[i]), 5, 0, 7);
      pen.stroke();
    }
    pen.restore();
    if (this.table.open) this.fill();
  }

  /** The same scale on both axes. */
  square(range, ratio) {
    const [w, h] = [range.x[1] - range.x[0], range.y[1] - range.y[0]];
    const grow = (pair, to) => {
      const m = (pair[0] + pair[1]) / 2;
      return [m - to / 2, m + to / 2];
    };
    if (w / h < ratio) range.x = grow(range.x, h * ratio);
    else range.y = grow(range.y, w / ratio);
  }

  /** @param {CanvasRenderingContext2D} pen @param {Series} one @param {string} colour @param {Axes} frame */
  one(pen, one, colour, frame) {
    const {x, y, kind = "line"} = one,
      n = x.length;
    pen.strokeStyle = pen.fillStyle = colour;
    pen.globalAlpha = one.alpha === undefined ? 1 : one.alpha;
    pen.lineWidth = kind === "line" ? 1.6 : kind === "crosses" ? 2 : 1;
    pen.setLineDash(one.dash || []);
    if (kind === "line") frame.curve(pen, x, y);
    else if (kind === "bars") {
      const places = Array.from(x, value => frame.across(value));
      places.forEach((a, i) => {
        const end = i + 1 < n ? places[i + 1] : a + (n > 1 ? a - places[i - 1] : 20),
          top = frame.up(y[i]);
        pen.fillRect(a + 0.5, top, Math.max(1, end - a - 1), Math.max(0, frame.bottom - top));
      });
    } else frame.symbols(pen, kind, x, y, kind === "crosses" ? 5 : n > 400 ? 1.7 : 2.6);
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }

  // ---- What a person does

  listen() {
    /** @type {[number, number] | null} */
    let from = null;
    const at = event => {
      const box = this.canvas.getBoundingClientRect();
      return /** @type {[number, number]} */ ([event.clientX - box.left, event.clientY - box.top]);
    };
    this.area.addEventListener("pointerdown", event => {
      if (!this.brushed || event.button) return;
      from = at(event);
      try {
        this.area.setPointerCapture(event.pointerId);
      } catch {
        /* of a script's event */
      }
    });
    this.area.addEventListener("pointermove", event => {
      const [x, y] = at(event);
      if (from) {
        this.setBrush(from, [x, y]);
        return;
      }
      this.nearest(x, y);
    });
    this.area.addEventListener("pointerup", event => {
      if (!from) return;
      const to = at(event),
        isDrag = Math.hypot(to[0] - from[0], to[1] - from[1]) > 5;
      if (!isDrag) this.brush = null;
      else this.setBrush(from, to);
      from = null;
      this.later();
      if (this.brushed) this.brushed(this.brush);
    });
    this.area.addEventListener("pointerleave", () => {
      if (this.cursor) {
        this.cursor = null;
        this.said.textContent = "";
        this.later();
      }
    });
  }

  setBrush(a, b) {
    const {drawn} = this;
    if (!drawn) return;
    const isBars = this.series.some(({kind}) => kind === "bars");
    const x = [drawn.xAt(Math.min(a[0], b[0])), drawn.xAt(Math.max(a[0], b[0]))];
    const y = isBars
      ? [drawn.yAt(drawn.bottom), drawn.yAt(TOP)]
      : [drawn.yAt(Math.max(a[1], b[1])), drawn.yAt(Math.min(a[1], b[1]))];
    this.brush = {x: /** @type {[number, number]} */ (x), y: /** @type {[number, number]} */ (y)};
    this.later();
  }

  nearest(px, py) {
    const {drawn} = this;
    if (!drawn) return;
    let best = 26;
    /** @type {[number, number] | null} */
    let found = null;
    this.series.forEach((one, s) => {
      const {row, distance} = drawn.nearest(one.x, one.y, [px, py], one.quiet ? 0 : best);
      if (row < 0) return;
      best = Math.sqrt(distance);
      found = [s, row];
    });
    this.cursor = found;
    this.tell();
  }

  tell() {
    if (!this.cursor) {
      this.said.textContent = "";
      this.later();
      return;
    }
    const one = this.series[this.cursor[0]],
      i = this.cursor[1],
      {axes} = this;
    const unit = text => (text ? `\u00a0${text}` : "");
    this.said.textContent =
      `${one.name ? one.name + ": " : ""}${axes.x} ${number(one.x[i], 5)}${unit(axes.xUnit)}, `
      + `${axes.y} ${number(one.y[i], 5)}${unit(axes.yUnit)}`;
    this.later();
  }

  key(event) {
    const rows = this.series.map((one, k) => (one.quiet ? -1 : k)).filter(k => k >= 0 && this.series[k].x.length);
    if (!rows.length) return;
    if (event.key === "Escape" && this.brushed) {
      this.brush = null;
      this.later();
      this.brushed(null);
      return;
    }
    const [s, i] = this.cursor || [rows[0], -1];
    const go =
      (/** @type {number} */ by, curves = 0) =>
      () => {
        const at = rows[(rows.indexOf(s) + curves + rows.length) % rows.length];
        this.cursor = [at, limited(i + by, 0, this.series[at].x.length - 1)];
        this.followed(event.shiftKey);
      };
    const steps = {ArrowRight: 1, ArrowLeft: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity};
    const acts = Object.entries(steps).map(([key, by]) => [key, go(by)]);
    obey(event, {...Object.fromEntries(acts), ArrowDown: go(0, 1), ArrowUp: go(0, -1)});
  }

  /** Tells where the cursor is after keys, and chooses up to it where they are held with Shift.
   * @param {boolean} chooses */
  followed(chooses) {
    if (chooses && this.brushed && this.cursor) {
      // From where it began to the cursor, over the whole height.
      const {drawn} = this,
        x = this.series[this.cursor[0]].x[this.cursor[1]];
      this.anchor = this.brush && this.anchor !== undefined ? this.anchor : x;
      const y = drawn ? [drawn.yAt(drawn.bottom), drawn.yAt(TOP)] : [-Infinity, Infinity];
      this.brush = {x: [Math.min(this.anchor, x), Math.max(this.anchor, x)], y: /** @type {[number, number]} */ (y)};
      this.brushed(this.brush);
    }
    this.tell();
  }

  /** The values of the table that is open. */
  fill() {
    if (!this.table.open) return;
    const {axes} = this,
      unit = text => (text ? ` (${text})` : "");
    const tables = this.series
      .filter(one => !one.quiet)
      .map(one => {
        const thin = Math.max(1, Math.ceil(one.x.length / ROWS)),
          rows = [];
        for (let i = 0; i < one.x.length; i += thin) rows.push([number(one.x[i], 6), number(one.y[i], 6)]);
        return table([axes.x + unit(axes.xUnit), axes.y + unit(axes.yUnit)], rows, one.name);
      });
    this.table.lastElementChild.replaceChildren(...tables);
  }
}

/** Counts of values in equal parts of their range.
 * @param {number[]} values @param {number} [parts] @param {[number, number]} [range] */
export function histogram(values, parts = 0, range) {
  const good = values.filter(isFinite);
  if (!good.length) return {x: [], y: []};
  let [low, high] = range || [Math.min(...good.slice(0, 1)), good[0]];
  if (!range)
    for (const value of good) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  if (high === low) {
    low -= Math.abs(low) * 0.05 || 0.5;
    high += Math.abs(high) * 0.05 || 0.5;
  }
  const n = parts || Math.max(8, Math.min(40, Math.round(2 * Math.cbrt(good.length) * 1.5)));
  const y = new Array(n).fill(0),
    x = Array.from({length: n}, (_, k) => low + ((high - low) * k) / n);
  for (const value of good) {
    const k = Math.floor(((value - low) / (high - low)) * n);
    if (k >= 0 && k <= n) y[Math.min(n - 1, k)]++;
  }
  return {x, y};
}
