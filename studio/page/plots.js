// @ts-check
// The plots of a run on canvases: all share the part of time that is seen, and the cursor. Each can be used by keys,
// and has its values as a table.
import {element, fold, number, table, timeText, download, fileName, isOutOfView, tell} from "./format.js";
import {Axes, COLOURS, Scale, SvgPen, density, line, lowerBound, obey, palette, sized, step} from "./pen.js";

/** @typedef {import("./app.js").App} App */
/** @typedef {import("./wire.js").Answer} Answer */
/** @typedef {import("./pen.js").Pen} Pen */

const LEFT = 66,
  RIGHT = 12,
  TOP = 8,
  BOTTOM = 24,
  MARGINS = {left: LEFT, right: RIGHT, top: TOP, bottom: BOTTOM},
  HEIGHT = 170,
  SMALL_HEIGHT = 120,
  TABLE_ROWS = 50;
/** Time without a change, ms, after which values in legends out of sight catch up. */
const REST = 200;
const DASHES = [[], [], [7, 4], [2, 3]];
/** States of a body: stuck, forward, backward, and sliding without dry friction. */
const STATES = new Map([
  [0, ["stuck", "grey"]],
  [1, ["forward", "blue"]],
  [-1, ["backward", "verm"]],
  [2, ["sliding", "green"]],
]);

export class Plots {
  /** @param {HTMLElement} root @param {App} app @param {(panel: any) => boolean} [isWanted] tells which panels have a
   * plot here @param {import("./layout.js").Panels | null} [panels] that arranges them */
  constructor(root, app, isWanted = panel => panel.title, panels = null) {
    this.root = root;
    this.app = app;
    this.isWanted = isWanted;
    this.panels = panels;
    /** @type {Plot[]} */
    this.plots = [];
    this.shape = "";
    this.colours = palette();
    /** Height of the curves, pixels. */
    this.tall = 0;
    /** The states strip and its like are not to be hidden by what a panel is called. */
    for (const what of /** @type {const} */ (["run", "view"])) {
      app.on(what, () => {
        this.build();
        this.later();
      });
    }
    for (const what of /** @type {const} */ (["window", "compare", "cursor"]))
      app.on(what, () => this.later(what === "cursor"));
    const recolour = () => {
      this.colours = palette();
      this.later();
    };
    app.on("theme", recolour);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
    const isSmall = matchMedia("(max-width: 52rem), (max-height: 34rem)");
    new ResizeObserver(() => {
      this.tall = isSmall.matches ? SMALL_HEIGHT : HEIGHT;
      this.measure();
    }).observe(root);
    if (panels) panels.resized = () => this.measure();
    // A plot that is scrolled out of sight is drawn when it comes in: pictures of a drag are of what is looked at.
    this.sight = new IntersectionObserver(
      entries => {
        for (const {target, isIntersecting} of entries) {
          const plot = this.plots.find(({area}) => area === target);
          if (plot) {
            plot.isSeen = isIntersecting;
            plot.catchUp();
          }
        }
      },
      {rootMargin: "150px"},
    );
    addEventListener("beforeprint", () =>
      this.plots.forEach(plot => {
        plot.isSeen = true;
        plot.catchUp();
      }),
    );
    this.frame = 0;
    this.rest = 0;
    this.onlyCursor = true;
  }

  /** Makes a plot for each panel, where they are others than before. */
  build() {
    const {run} = this.app;
    if (!run) return;
    const panels = run.head.panels.filter(panel => this.isWanted(panel));
    const shape = JSON.stringify(panels.map(panel => [panel.key, panel.curves]));
    if (shape === this.shape) {
      this.plots.forEach((plot, i) => {
        plot.panel = panels[i];
      });
      return;
    }
    this.shape = shape;
    this.plots = panels.map(panel => new Plot(panel, this));
    if (this.panels) this.panels.place(this.plots);
    else this.root.replaceChildren(...this.plots.map(plot => plot.figure));
    this.sight.disconnect();
    for (const plot of this.plots) this.sight.observe(plot.area);
  }

  /** Draws all plots in the sizes that they have now. */
  measure() {
    for (const plot of this.plots) plot.measure();
    this.later();
  }

  /** Draws with the next picture. @param {boolean} [onlyCursor] */
  later(onlyCursor = false) {
    // A view that is shown again is drawn anew.
    if (isOutOfView(this.root)) return;
    if (!onlyCursor) this.onlyCursor = false;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      for (const plot of this.plots) plot.tellValues();
    }, REST);
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      const all = !this.onlyCursor;
      this.onlyCursor = true;
      if (!this.root.clientWidth) return;
      for (const plot of this.plots) {
        if (all) plot.isStale = true;
        plot.catchUp();
      }
      this.app.drawn = this.app.run;
    });
  }

  /** The part of time that is seen. @returns {[number, number]} */
  get seen() {
    return this.app.window || [0, this.app.until];
  }
}

class Plot {
  /** @param {any} panel @param {Plots} plots */
  constructor(panel, plots) {
    this.panel = panel;
    this.plots = plots;
    /** @type {Set<string>} */
    this.hidden = new Set();
    this.isStates = panel.key === "state";
    /** Whether it is in sight, or may be. */
    this.isSeen = true;
    /** Whether its curves are of an earlier run or another part of time. */
    this.isStale = true;
    /** Width of the area, which is asked of the page once a change: each asking has it laid out. */
    this.wide = 0;
    /** The contents of the canvas of the cursor. */
    this.pointed = "";
    /** @type {{low: number, high: number} | null} */
    this.range = null;
    /** @type {{x: number, to?: number, window: [number, number], pans: boolean} | null} */
    this.press = null;
    this.canvas = element("canvas", {"aria-hidden": "true"});
    /** The ground of the curves, which is on no page, and what it was drawn of. @type {HTMLCanvasElement} */
    this.back = element("canvas");
    /** @type {{shape: string, answers: Answer[]}} */
    this.grounded = {shape: "", answers: []};
    this.over = element("canvas", {class: "over", "aria-hidden": "true"});
    const words =
      `${panel.words}${panel.unit ? ", in " + panel.unit : ""}. `
      + `Arrow keys move the cursor, with Shift they slide what is seen; plus, minus and 0 zoom.`;
    this.area = element(
      "div",
      {
        class: "area",
        tabindex: "0",
        role: "application",
        "aria-roledescription": "plot",
        "aria-label": `${panel.title} over time`,
        "aria-description": words,
      },
      this.canvas,
      this.over,
    );
    this.legend = element("div", {class: "legend"});
    this.values = [];
    panel.curves.forEach((curve, k) => this.addEntry(curve, k));
    this.table = fold({class: "data", ontoggle: () => this.fill(this.table)}, "Values", `Values of ${panel.title}`);
    const keep = fold(
      {class: "menu keep"},
      "Keep",
      `Keep ${panel.title}`,
      element(
        "div",
        {},
        element("button", {type: "button", onclick: () => this.png()}, "PNG"),
        element(
          "button",
          {type: "button", onclick: () => download(this.fileName("svg"), this.svg(), "image/svg+xml")},
          "SVG",
        ),
        element(
          "button",
          {type: "button", onclick: () => download(this.fileName("csv"), this.csv(), "text/csv")},
          "CSV",
        ),
      ),
    );
    this.figure = element(
      "figure",
      {class: "live-plot", "data-panel": panel.key, "aria-label": panel.title},
      element(
        "figcaption",
        {},
        element("h3", {}, panel.title, panel.unit ? element("span", {class: "quiet"}, " " + panel.unit) : ""),
        this.legend,
        keep,
      ),
      this.area,
      this.table,
    );
    this.listen();
  }

  addEntry(curve, k) {
    // No live region: while the machine plays, each picture would be read out.
    const value = element("span", {class: "value"});
    this.values.push(value);
    const colour = this.isStates ? "ink" : COLOURS[k % COLOURS.length];
    const entry = element(
      "button",
      {
        type: "button",
        role: "switch",
        "aria-checked": "true",
        class: "entry",
        onclick: () => {
          if (!this.hidden.delete(curve.key)) this.hidden.add(curve.key);
          entry.setAttribute("aria-checked", String(!this.hidden.has(curve.key)));
          this.plots.later();
        },
      },
      element("i", {class: `t-${colour}${DASHES[k % 4].length ? " dashed" : ""}`}),
      curve.name,
    );
    this.legend.append(element("span", {}, entry, value));
  }

  fileName(ending) {
    return `${fileName(this.plots.app.run ? this.plots.app.run.head.title : "run")}-${this.panel.key}.${ending}`;
  }

  // ---- Drawing

  get width() {
    return Math.max(200, this.wide || this.measure());
  }
  measure() {
    return (this.wide = this.area.clientWidth);
  }
  /** Height of the curves, pixels. */
  get curves() {
    const {panels, tall} = this.plots;
    if (this.isStates) return 26 + 22 * this.panel.curves.length;
    return (panels && panels.tall(this.panel.key)) || tall;
  }
  get height() {
    return this.curves + BOTTOM;
  }
  get axes() {
    const {low, high} = this.range || {low: 0, high: 1};
    return new Axes(this, MARGINS, new Scale(this.plots.seen), new Scale([low, high]));
  }
  across(time) {
    return this.axes.across(time);
  }
  timeAt(x) {
    return this.axes.xAt(x);
  }
  up(value) {
    return this.axes.up(value);
  }

  /** The runs that are drawn, from the lowest: pins, the run before, the run itself. */
  layers() {
    const {app} = this.plots;
    const layers = app.pins.map(pin => ({answer: pin.answer, style: "pin"}));
    if (app.showsBefore && app.before && app.before !== app.run) layers.push({answer: app.before, style: "before"});
    if (app.run) layers.push({answer: app.run, style: "now"});
    return layers;
  }

  /** The rows of a curve that are seen: those of the finer section where there is one for all of it. */
  rows(answer, key) {
    const {app} = this.plots,
      [from, to] = this.plots.seen;
    if (answer === app.run && app.window && app.section) {
      const {head, columns} = app.section;
      if (head.from <= from + 1e-9 * (to - from) && head.to >= to - 1e-9 * (to - from) && columns.get(key))
        return {x: columns.get("time"), y: columns.get(key)};
    }
    return {x: answer.columns.get("time"), y: answer.columns.get(key)};
  }

  /** Draws what is to be drawn, where it is in sight. */
  catchUp() {
    if (!this.isSeen && !this.table.open) return;
    if (this.isStale) this.draw();
    this.drawCursor();
  }

  draw() {
    this.isStale = false;
    const pen = sized(this.canvas, this);
    if (this.isStates) this.drawStates(pen);
    else this.drawCurves(pen);
    if (this.table.open) this.fill(this.table);
  }

  /** The range of what is seen; it changes only where it has to, so that a drag does not shake the axis. */
  fit() {
    const {scale} = this.panel,
      [from, to] = this.plots.seen;
    let low = Infinity,
      high = -Infinity;
    for (const {answer} of this.layers()) {
      for (const {key} of this.panel.curves) {
        if (this.hidden.has(key)) continue;
        const {x, y} = this.rows(answer, key);
        if (!x || !y) continue;
        const first = Math.max(0, lowerBound(x, from) - 1),
          last = Math.min(x.length, lowerBound(x, to) + 2);
        for (let i = first; i < last; i++) {
          const value = y[i] * scale;
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
    }
    if (!(high >= low)) {
      low = 0;
      high = 1;
    }
    const least = Math.max(1e-9 * Math.max(Math.abs(low), Math.abs(high)), 1e-12);
    if (high - low < least) {
      const m = (high + low) / 2;
      low = m - Math.max(least, Math.abs(m) * 0.1, 1e-9);
      high = m + Math.max(least, Math.abs(m) * 0.1, 1e-9);
    }
    const {range} = this,
      span = high - low;
    if (range && low >= range.low && high <= range.high && span > 0.55 * (range.high - range.low)) return;
    const by = step(span, 4),
      grown = 0.04 * span;
    this.range = {
      low: Math.floor((low - grown) / (by / 2)) * (by / 2),
      high: Math.ceil((high + grown) / (by / 2)) * (by / 2),
    };
  }

  /** @param {CanvasRenderingContext2D} pen */
  drawCurves(pen) {
    this.fit();
    pen.drawImage(this.ground(), 0, 0, this.width, this.height);
    this.drawRun(pen);
  }

  /** The curves of the run itself, and its events. @param {Pen} pen */
  drawRun(pen) {
    this.axes.clip(pen);
    this.marks(pen);
    for (const layer of this.layers()) if (layer.style === "now") this.strokes(pen, layer);
    pen.restore();
  }

  /** The grid, and the curves of other runs. @param {Pen} pen */
  drawGround(pen) {
    this.grid(pen, this.axes.y.ticks(4));
    this.axes.clip(pen);
    for (const layer of this.layers()) if (layer.style !== "now") this.strokes(pen, layer);
    pen.restore();
  }

  /** The grid, and the curves that stay during a drag: drawn anew only where one of them, the range or the colours
   * change. @returns {HTMLCanvasElement} */
  ground() {
    const {colours, seen} = this.plots,
      {width, height} = this;
    const below = this.layers().filter(({style}) => style !== "now");
    const drawn = [width, height, density(), this.range, seen, [...this.hidden], colours],
      shape = JSON.stringify([drawn, below.map(({style}) => style)]);
    const isSame = shape === this.grounded.shape && below.every(({answer}, k) => answer === this.grounded.answers[k]);
    if (isSame) return this.back;
    this.grounded = {shape, answers: below.map(({answer}) => answer)};
    this.drawGround(sized(this.back, this));
    return this.back;
  }

  /** All curves of a run. @param {Pen} pen @param {{answer: Answer, style: string}} layer */
  strokes(pen, {answer, style}) {
    const {colours, app} = this.plots;
    this.panel.curves.forEach(({key}, k) => {
      if (this.hidden.has(key)) return;
      const {x, y} = this.rows(answer, key);
      if (!x || !y) return;
      pen.strokeStyle = style === "pin" ? colours.axis : colours[COLOURS[k % COLOURS.length]];
      pen.globalAlpha = style === "now" ? (app.mistake ? 0.35 : 1) : style === "before" ? 0.45 : 0.5;
      pen.lineWidth = style === "now" ? 1.8 : 1.1;
      pen.setLineDash(style === "before" ? [3, 3] : DASHES[k % 4]);
      this.curve(pen, x, y);
    });
  }

  /** Draws what is seen of a curve: all points, or the least and greatest of those that share a pixel.
   * @param {Pen} pen @param {Float64Array} x @param {Float64Array} y */
  curve(pen, x, y) {
    const [from, to] = this.plots.seen,
      {axes} = this;
    const first = Math.max(0, lowerBound(x, from) - 1),
      last = Math.min(x.length, lowerBound(x, to) + 1);
    const part = {first, last, together: Math.max(1, Math.floor((last - first) / axes.wide)), scale: this.panel.scale};
    // Dashes of what is dense show nothing, and cost most of a picture.
    if (part.together > 2) pen.setLineDash([]);
    axes.curve(pen, x, y, part);
    if (last - first < axes.wide / 9 && pen.globalAlpha === 1) {
      pen.fillStyle = pen.strokeStyle;
      axes.symbols(pen, "points", x, y, 2.1, part);
    }
  }

  /** Lines at the events. @param {Pen} pen */
  marks(pen) {
    const {app, colours} = this.plots,
      [from, to] = this.plots.seen;
    if (!app.run) return;
    const seen = app.run.head.events.filter(event => event.time >= from && event.time <= to);
    if (seen.length > 120) return;
    pen.strokeStyle = colours.grid;
    pen.lineWidth = 1;
    pen.setLineDash([2, 2]);
    this.axes.marks(
      pen,
      seen.map(event => ({x: event.time})),
    );
  }

  /** A strip for each body, and the events on it. @param {Pen} pen */
  drawStates(pen) {
    const {app, colours} = this.plots,
      {width} = this;
    this.grid(pen, []);
    if (!app.run) return;
    pen.save();
    this.panel.curves.forEach(({key, name}, k) => {
      const {x, y} = this.rows(app.run, key),
        top = TOP + 6 + 22 * k;
      pen.fillStyle = colours.grey;
      pen.textAlign = "right";
      pen.fillText(name.split(" ")[0], LEFT - 8, top + 11);
      if (this.hidden.has(key) || !x || !y) return;
      const from = Math.max(0, lowerBound(x, this.plots.seen[0]) - 1),
        to = Math.min(x.length - 1, lowerBound(x, this.plots.seen[1]) + 1);
      for (let i = from; i < to;) {
        let j = i;
        while (j < to && y[j] === y[i]) j++;
        const [, colour] = STATES.get(y[i]) || ["", "grey"];
        const a = Math.max(LEFT, this.across(x[i])),
          b = Math.min(width - RIGHT, this.across(x[j]));
        pen.fillStyle = colours[colour];
        pen.globalAlpha = y[i] === 0 ? 0.28 : 0.75;
        if (b > a) pen.fillRect(a, y[i] === 0 ? top + 5 : top, b - a, y[i] === 0 ? 5 : 15);
        i = j;
      }
      pen.globalAlpha = 1;
    });
    pen.strokeStyle = colours.ink;
    pen.lineWidth = 1;
    for (const {time, body} of app.run.head.events) {
      const x = this.across(time),
        place = body === null ? -1 : body;
      if (x < LEFT || x > width - RIGHT || place < 0) continue;
      pen.beginPath();
      pen.moveTo(x, TOP + 4 + 22 * place);
      pen.lineTo(x, TOP + 23 + 22 * place);
      pen.stroke();
    }
    pen.restore();
  }

  /** @param {Pen} pen @param {[number, string][]} rows */
  grid(pen, rows) {
    const {colours} = this.plots,
      [from, to] = this.plots.seen,
      {axes} = this;
    const most = axes.wide / 80,
      by = step(to - from, most),
      // Far in, what counts is the distance from the left.
      isFar = to - from < 1e-3 * Math.abs(from);
    const columns = /** @type {[number, string][]} */ (
      axes.x.ticks(most).map(([value]) => [value, isFar ? "+" + timeText(value - from, by) : timeText(value, by)])
    );
    axes.grid(pen, colours, columns, rows);
    axes.base(pen, colours, columns);
    if (!isFar) return;
    pen.textAlign = "left";
    pen.fillText(number(from, 9) + " s", 2, axes.bottom + 18);
  }

  drawCursor() {
    const {app, colours} = this.plots,
      {width, height, press} = this,
      x = this.across(app.cursor);
    const isInside = x >= LEFT && x <= width - RIGHT;
    /** @type {[string, number][]} */
    const dots = [];
    this.tellValues();
    this.panel.curves.forEach(({key}, k) => {
      if (this.isStates || this.hidden.has(key) || !isInside) return;
      dots.push([colours[COLOURS[k % COLOURS.length]], this.up(app.value(key, app.cursor) * this.panel.scale)]);
    });
    const box = press && !press.pans && press.to !== undefined ? [press.x, press.to] : null;
    const pointed = JSON.stringify([x, width, height, density(), box, dots, colours.ink]);
    if (pointed === this.pointed) return;
    this.pointed = pointed;
    const pen = sized(this.over, this);
    if (box) {
      pen.fillStyle = colours.blue;
      pen.globalAlpha = 0.12;
      pen.fillRect(Math.min(...box), TOP, Math.abs(box[1] - box[0]), height - TOP - BOTTOM);
      pen.globalAlpha = 1;
    }
    if (x >= LEFT - 0.5 && x <= width - RIGHT + 0.5) {
      pen.strokeStyle = colours.ink;
      pen.globalAlpha = 0.55;
      line(pen, x, TOP, x, height - BOTTOM);
      pen.globalAlpha = 1;
    }
    for (const [colour, y] of dots) {
      pen.fillStyle = colour;
      pen.beginPath();
      pen.arc(x, y, 3, 0, 7);
      pen.fill();
    }
  }

  /** Puts the values at the cursor into the legend: those who hear the page read it out of sight too. */
  tellValues() {
    this.panel.curves.forEach(({key}, k) => tell(this.values[k], this.words(key)));
  }

  /** The value of a curve at the cursor. */
  words(key) {
    const {app} = this.plots;
    if (this.isStates) return (STATES.get(app.state(key, app.cursor)) || [""])[0];
    return number(app.value(key, app.cursor) * this.panel.scale, 5);
  }

  // ---- Pointers and keys

  listen() {
    const {area, plots} = this,
      {app} = plots;
    const spot = event => event.clientX - area.getBoundingClientRect().left;
    area.addEventListener("pointerdown", event => {
      if (event.button) return;
      this.press = {x: spot(event), window: plots.seen, pans: event.shiftKey || event.pointerType === "touch"};
      if (event.pointerType !== "touch") area.setPointerCapture(event.pointerId);
    });
    area.addEventListener("pointermove", event => {
      const x = spot(event),
        {press} = this;
      if (!press) {
        if (!app.isPlaying && event.pointerType === "mouse") app.seek(this.timeAt(x));
        return;
      }
      if (press.pans && app.window && event.pointerType !== "touch") {
        const by = ((press.x - x) / (this.width - LEFT - RIGHT)) * (press.window[1] - press.window[0]);
        this.slide(press.window, by);
      } else if (!press.pans) {
        press.to = Math.max(LEFT, Math.min(this.width - RIGHT, x));
        this.drawCursor();
      }
    });
    const release = event => {
      const x = spot(event),
        {press} = this;
      this.press = null;
      if (!press || event.type === "pointercancel") return;
      if (!press.pans && Math.abs(x - press.x) > 8)
        app.look(/** @type {[number, number]} */ ([this.timeAt(press.x), this.timeAt(press.to)].sort((a, b) => a - b)));
      else if (Math.abs(x - press.x) <= 8) {
        app.isPlaying = false;
        app.tell("play");
        app.seek(this.timeAt(x));
      }
      plots.later(true);
    };
    area.addEventListener("pointerup", release);
    area.addEventListener("pointercancel", release);
    area.addEventListener("dblclick", () => app.look(null));
    area.addEventListener(
      "wheel",
      event => {
        if (!(event.ctrlKey || event.metaKey)) return;
        event.preventDefault();
        this.zoom(Math.exp(0.002 * event.deltaY), this.timeAt(spot(event)));
      },
      {passive: false},
    );
    area.addEventListener("keydown", event => this.key(event));
  }

  slide([from, to], by) {
    const {app} = this.plots,
      span = to - from,
      start = Math.max(0, Math.min(app.until - span, from + by));
    app.look([start, start + span]);
  }

  zoom(factor, about) {
    const [from, to] = this.plots.seen;
    this.plots.app.look([about - (about - from) * factor, about + (to - about) * factor]);
  }

  key(event) {
    const {app} = this.plots,
      [from, to] = this.plots.seen,
      span = to - from;
    const go = by => () => {
      if (event.shiftKey) {
        if (app.window) this.slide([from, to], (15 * by * span) / 100);
        return;
      }
      const start = app.cursor < from || app.cursor > to ? from : app.cursor;
      app.seek(Math.max(from, Math.min(to, start + (by * span) / 100)));
      this.say();
    };
    const acts = {
      ArrowLeft: go(-1),
      ArrowRight: go(1),
      PageUp: go(-10),
      PageDown: go(10),
      Home: () => {
        app.seek(from);
        this.say();
      },
      End: () => {
        app.seek(to);
        this.say();
      },
      "+": () => this.zoom(0.6, app.cursor),
      "=": () => this.zoom(0.6, app.cursor),
      "-": () => this.zoom(1 / 0.6, app.cursor),
      0: () => app.look(null),
      Escape: () => app.look(null),
    };
    obey(event, acts);
  }

  /** Tells the values at the cursor to those who do not see them. */
  say() {
    const {app} = this.plots,
      [from, to] = this.plots.seen;
    const values = this.panel.curves
      .filter(({key}) => !this.hidden.has(key))
      .map(({key, name}) => `${name} ${this.words(key)}${this.panel.unit ? " " + this.panel.unit : ""}`);
    app.say(`${timeText(app.cursor, (to - from) / 100)}: ${values.join(", ")}`);
  }

  // ---- The same as a table, and for elsewhere

  /** Rows that are seen, evenly chosen. @param {number} most */
  chosen(most) {
    const {app} = this.plots,
      [from, to] = this.plots.seen;
    if (!app.run) return [];
    const columns = this.panel.curves.map(({key}) => this.rows(app.run, key));
    const x = columns.length ? columns[0].x : null;
    if (!x) return [];
    const first = lowerBound(x, from),
      last = Math.min(x.length, lowerBound(x, to * (1 + 1e-15)) + 1),
      count = last - first,
      found = [];
    const rows = Math.min(most, count);
    for (let k = 0; k < rows; k++) {
      const i = first + (rows < 2 ? 0 : Math.round((k * (count - 1)) / (rows - 1)));
      found.push([x[i], ...columns.map(({y}) => (y ? y[i] * (this.isStates ? 1 : this.panel.scale) : NaN))]);
    }
    return found;
  }

  fill(details) {
    if (!details.open) return;
    const unit = this.panel.unit ? ` (${this.panel.unit})` : "";
    const head = ["time (s)", ...this.panel.curves.map(curve => curve.name + unit)];
    const words = (value, k) => (this.isStates && k ? (STATES.get(value) || [""])[0] : number(value, 7));
    const rows = this.chosen(TABLE_ROWS).map(row => row.map(words));
    const shown = element(
      "div",
      {class: "scroll", tabindex: "0", role: "group", "aria-label": `Values of ${this.panel.title}`},
      table(head, rows),
    );
    details.replaceChildren(details.firstElementChild, shown);
  }

  csv() {
    const head = [
      "time_s",
      ...this.panel.curves.map(
        ({key}) => key + (this.panel.unit ? "_" + this.panel.unit.replace(/[ /]/g, "_").replace("µ", "u") : ""),
      ),
    ];
    return [head, ...this.chosen(Infinity)].map(row => row.join(",") + "\n").join("");
  }

  png() {
    if (this.isStale) this.draw();
    const canvas = document.createElement("canvas"),
      {colours} = this.plots;
    canvas.width = this.canvas.width;
    canvas.height = this.canvas.height;
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.fillStyle = colours.paper;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.drawImage(this.canvas, 0, 0);
    canvas.toBlob(blob => {
      if (blob) download(this.fileName("png"), blob, "image/png");
    });
  }

  /** The picture as SVG. */
  svg() {
    const pen = new SvgPen(),
      {width, height} = this;
    if (this.isStates) this.drawStates(pen);
    else {
      this.fit();
      this.drawGround(pen);
      this.drawRun(pen);
    }
    return (
      `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" `
      + `font-family="system-ui, sans-serif" fill="none"><rect width="100%" height="100%" `
      + `fill="${this.plots.colours.paper}"/>${pen.text}</svg>\n`
    );
  }
}
