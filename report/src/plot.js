// @ts-nocheck
// Brings the figures of a page to life: zooms, shows values, hides curves.
//
// plot.rs has drawn each figure already, and layout.rs has placed everything: plot areas, ticks, legends, for several
// widths. This script takes those places for the width at hand and computes by itself only what a zoom changes: ticks,
// and which part of a curve is seen.
import {Axes, Scale, SvgPen, escaped, font, limited, lowerBound, number, obey, pixels, symbols} from "./pen.js";

const withUnit = (value, unit) => number(value, 7) + (unit ? "\u00a0" + escaped(unit) : "");

// ---- Data

// The numbers of an array: a start and a step, or a least value and a unit with 32-bit counts (embed.rs).
export function decode(array) {
  const values = new Float64Array(array.n);
  if (!array.d) {
    for (let i = 0; i < array.n; i++) values[i] = array.o + i * array.s;
    return values;
  }
  const bytes = Uint8Array.from(atob(array.d), c => c.charCodeAt(0)),
    view = new DataView(bytes.buffer);
  const GAP = 0xffffffff;
  for (let i = 0; i < array.n; i++) {
    const count = view.getUint32(4 * i, true);
    values[i] = count === GAP ? NaN : array.o + count * array.s;
  }
  return values;
}

function isRising(x) {
  for (let i = 1; i < x.length; i++) if (!(x[i] >= x[i - 1])) return false;
  return true;
}

// ---- Drawing

const RIGHT = 16; // room beside the plot areas, as in layout.rs
const SPARSE = 8; // pixels between samples from which they are drawn as dots
// Radius of the symbol at each point, of those styles that draw points by themselves.
const SYMBOLS = {points: 2.2, crosses: 4, rings: 4};
const DASHES = {dashed: [7, 4], dotted: [0.1, 4]};
// The pen's colours are classes of the page.
const CLASSES = {grid: "grid", grey: "grey", axis: "axis"};

// What a curve is drawn with.
function take(pen, {style, colour}) {
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = style === "crosses" || style === "rings" ? 1.6 : 1.8;
  pen.lineCap = style === "dashed" ? "butt" : "round";
  pen.setLineDash(DASHES[style] || []);
}

// Marks are drawn with dashes.
function takeMark(pen) {
  pen.strokeStyle = pen.fillStyle = "mark";
  pen.lineWidth = 1.1;
  pen.lineCap = "butt";
  pen.setLineDash([1.5, 3]);
}

function write(pen, [x, y], size, colour, align, text) {
  pen.font = font(size);
  pen.fillStyle = colour;
  pen.textAlign = align;
  pen.fillText(text, x, y);
}

// Plots by the axis that they share: a zoom of one is a zoom of all.
const linked = new Map();

// Draws what has been asked for since the last frame, if it can be seen.
const seen = new IntersectionObserver(
  entries =>
    entries.forEach(({target, isIntersecting}) => {
      const plot = target.plot;
      plot.inSight = isIntersecting;
      if (isIntersecting && plot.stale) plot.draw();
    }),
  {rootMargin: "300px"},
);

class Plot {
  constructor(figure) {
    this.figure = figure;
    this.spec = JSON.parse(figure.querySelector("script").textContent);
    this.stage = figure.querySelector(".stage");
    this.svg = this.stage.querySelector("svg");
    this.arrays = this.spec.arrays.map(decode);
    this.rising = this.arrays.map(isRising);
    this.hidden = new Set(); // curves, as "panel.series"
    this.home = {x: this.spec.x.range, y: this.spec.panels.map(panel => panel.range)};
    this.view = {x: this.home.x, y: this.home.y.slice()};
    this.shown = null; // layout of the picture that is shown
    this.drag = null; // where a drag began
    this.cursor = null; // where values are shown
    this.inSight = true;
    this.stale = false;
    this.tip = this.add("div", "tip");
    this.tip.setAttribute("role", "status");
    this.limit = this.add("p", "limit");
    const axis = figure.dataset.axis;
    this.siblings = (axis !== undefined && linked.get(axis)) || [];
    if (axis !== undefined) linked.set(axis, this.siblings);
    this.siblings.push(this);
    figure.classList.add("live");
    // A picture with switches in it is no picture any more.
    this.svg.setAttribute("role", "group");
    this.listen();
    if (this.stage.clientWidth) this.draw();
    seen.observe(figure);
  }

  add(tag, name) {
    const element = document.createElement(tag);
    element.className = name;
    this.stage.append(element);
    return element;
  }

  // ---- Places

  // The places of the widest layout that has room, its plot areas stretched to the width at hand; ticks of what is
  // seen.
  layout() {
    const {spec, view, home} = this,
      width = Math.max(240, this.stage.clientWidth);
    const base = spec.layouts.filter(l => l.width <= width).pop() || spec.layouts[0];
    const x = new Scale(view.x, spec.x),
      pen = new SvgPen(true);
    const panels = base.panels.map((place, i) => {
      const panel = spec.panels[i],
        y = new Scale(view.y[i], panel);
      const yTicks = view.y[i] === home.y[i] ? place.ticks : y.ticks(Math.round(place.height / 40));
      return {...place, panel, y, yTicks};
    });
    const widths = panels
      .filter(P => P.yTicks !== P.ticks)
      .flatMap(P => P.yTicks)
      .map(([, text]) => pen.measureText(text).width);
    const left = Math.max(base.left, 16 + Math.max(0, ...widths)),
      wide = width - left - RIGHT;
    // As many as layout.rs has: not fewer because this browser's digits are wider.
    const xTicks = view.x === home.x ? base.ticks : x.ticks(Math.round((base.width - base.left - RIGHT) / 80));
    let height = base.height;
    if (spec.ratio) {
      height += spec.ratio * wide - panels[0].height;
      panels[0].height = spec.ratio * wide;
    }
    for (const P of panels) {
      const margins = {left, right: RIGHT, top: P.top, bottom: 0};
      P.axes = new Axes({width, height: P.top + P.height}, margins, x, P.y);
    }
    return {width, height, left, wide, right: left + wide, x, xTicks, panels};
  }

  across(x) {
    return this.shown.left + this.shown.wide * this.shown.x.place(x);
  }

  // ---- Pictures

  // Asks for a new picture.
  later() {
    this.stale = true;
    if (!this.inSight) return;
    this.frame = this.frame || requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.frame = 0;
    this.stale = false;
    const L = (this.shown = this.layout()),
      {svg, figure, view, home} = this;
    const focused = document.activeElement && document.activeElement.dataset && document.activeElement.dataset.curve;
    const ofMine = svg.contains(document.activeElement);
    this.hasLimit = false;
    const pen = new SvgPen(true);
    L.panels.forEach((P, i) => this.panel(pen, P, i));
    const last = L.panels[L.panels.length - 1];
    if (last) {
      last.axes.base(pen, CLASSES, L.xTicks);
      write(pen, [L.left + L.wide / 2, last.axes.bottom + 38], 13, "ink", "center", this.spec.x.heading);
    }
    svg.setAttribute("viewBox", `0 0 ${L.width} ${pixels(L.height)}`);
    svg.setAttribute("width", L.width);
    svg.setAttribute("height", pixels(L.height));
    svg.innerHTML = pen.text + '<g class="over"></g>';
    figure.classList.toggle("zoomed", view.x !== home.x || view.y.some((y, i) => y !== home.y[i]));
    this.limit.textContent = this.hasLimit
      ? "Dots are the samples that this page holds: it has not all rows of this run; the result files have them."
      : "";
    if (ofMine && focused) svg.querySelector(`[data-curve="${focused}"]`).focus();
    if (this.cursor) this.showValues();
  }

  // A panel: heading, legend, grid, lines across, curves.
  panel(pen, P, i) {
    const L = this.shown,
      {axes} = P,
      {heading, series, marks} = P.panel;
    write(pen, [L.left, P.heading], 13, "ink", "left", heading);
    for (const entry of P.legend) this.legendEntry(pen, entry, i);
    pen.lineCap = "butt";
    axes.grid(pen, CLASSES, L.xTicks, P.yTicks);
    this.verticals(pen, P, i === 0);
    // Where all is shown nothing has to be cut off, and marks at the frame have room.
    axes.clip(pen, this.view.x === this.home.x && !this.spec.part ? 5 : 0);
    series.forEach((one, k) => {
      if (!this.hidden.has(i + "." + k)) this.curve(pen, one, axes);
    });
    pen.restore();
    for (const {at, label} of marks) {
      const y = axes.up(at);
      if (!(y >= axes.top - 0.5 && y <= axes.bottom + 0.5)) continue;
      takeMark(pen);
      axes.marks(pen, [{y: at}]);
      write(pen, [L.right - 4, y - P.top < 16 ? y + 14 : y - 5], 12, "mark", "right", label);
    }
    axes.base(pen, CLASSES);
  }

  // An entry of a legend is a switch.
  legendEntry(pen, [k, x, y, width, name], i) {
    const series = this.spec.panels[i].series[k],
      key = i + "." + k,
      on = !this.hidden.has(key),
      middle = y - 4.3;
    pen.text +=
      `<g data-curve="${key}" role="switch" tabindex="0" aria-checked="${on}" aria-label="${escaped(series.name)}"`
      + `${on ? "" : ' class="off"'}>`
      + `<rect x="${pixels(x - 4)}" y="${pixels(middle - 10)}" width="${pixels(width - 8)}" height="20"`
      + ` fill="#000" fill-opacity="0"/>`;
    take(pen, series);
    if (SYMBOLS[series.style]) symbols(pen, series.style, [[x + 10, middle]], SYMBOLS[series.style]);
    else {
      pen.beginPath();
      pen.moveTo(x, middle);
      pen.lineTo(x + 20, middle);
      pen.stroke();
    }
    write(pen, [x + 26, y], 12.5, "ink", "left", name);
    pen.text += "</g>";
  }

  // Vertical lines, their names above the first panel where there is room.
  verticals(pen, {axes}, named) {
    let free = axes.left - 20;
    for (const {at, label} of this.spec.marks) {
      const x = axes.across(at);
      if (!(x >= axes.left - 0.5 && x <= axes.right + 0.5)) continue;
      takeMark(pen);
      axes.marks(pen, [{x: at}]);
      pen.font = font(12);
      const {width} = pen.measureText(label),
        start = Math.max(axes.left, Math.min(axes.width - 2 - width, x - width / 2));
      if (!named || start < free) continue;
      write(pen, [start, axes.top - 5], 12, "mark", "left", label);
      free = start + width + 8;
    }
  }

  // The part of a curve that is seen: all samples, or the least and the greatest of as many as share a pixel.
  curve(pen, series, axes) {
    const x = this.arrays[series.x],
      y = this.arrays[series.y],
      isRising = this.rising[series.x],
      radius = SYMBOLS[series.style];
    const first = isRising ? Math.max(0, lowerBound(x, axes.x.low) - 1) : 0,
      last = isRising ? Math.min(x.length, lowerBound(x, axes.x.high) + 2) : x.length,
      part = {first, last, together: Math.max(1, Math.floor((last - first) / (2 * axes.wide)))};
    take(pen, series);
    if (radius) {
      axes.symbols(pen, series.style, x, y, radius, part);
      return;
    }
    axes.curve(pen, x, y, part);
    if (this.view.x === this.home.x || !isRising || last - first >= axes.wide / SPARSE) return;
    axes.symbols(pen, "points", x, y, SYMBOLS.points, part);
    this.hasLimit = this.hasLimit || Boolean(series.of);
  }

  over(content) {
    const group = this.svg.querySelector(".over");
    if (group) group.innerHTML = content;
  }

  // ---- Values

  // Where a pointer is, in pixels of the picture, and the number of the panel under it.
  spot(event) {
    const box = this.svg.getBoundingClientRect(),
      L = this.shown;
    const x = ((event.clientX - box.left) * L.width) / box.width,
      y = ((event.clientY - box.top) * L.height) / box.height;
    return {x, y, i: L.panels.findIndex(P => y >= P.top - 4 && y <= P.top + P.height + 4)};
  }

  isInside(spot) {
    return spot.i >= 0 && spot.x >= this.shown.left - 4 && spot.x <= this.shown.right + 4;
  }

  // The sample of a curve that the cursor means: along x where x rises, else the nearest one in the panel under it.
  sampleAt(series, P, mine) {
    const x = this.arrays[series.x],
      y = this.arrays[series.y],
      {cursor} = this;
    let best = -1;
    if (this.rising[series.x]) {
      const value = P.axes.xAt(cursor.x);
      best = lowerBound(x, value);
      if (best > 0 && (best === x.length || value - x[best - 1] < x[best] - value)) best--;
      if (best < 0 || best >= x.length) return null;
      const away = Math.abs(this.across(x[best]) - cursor.x);
      const beyond = value < x[0] || value > x[x.length - 1];
      if ((SYMBOLS[series.style] || beyond) && away > 12) return null;
    } else if (mine) {
      best = P.axes.nearest(x, y, [cursor.x, cursor.y], 30).row;
      if (best < 0) return null;
    } else return null;
    const u = this.across(x[best]),
      v = P.axes.up(y[best]);
    return {x: x[best], y: y[best], u, v, distance: (u - cursor.x) ** 2 + (v - cursor.y) ** 2};
  }

  showValues() {
    const L = this.shown,
      {spec, cursor} = this;
    const all = [];
    L.panels.forEach((P, i) =>
      P.panel.series.forEach((series, k) => {
        const sample = !this.hidden.has(i + "." + k) && this.sampleAt(series, P, i === cursor.i);
        if (sample) all.push({...sample, series, P, mine: i === cursor.i, rising: this.rising[series.x]});
      }),
    );
    // Of curves in a plane only the nearest means something: each has its own x.
    const plane = all.filter(one => !one.rising).sort((a, b) => a.distance - b.distance);
    const found = plane.length ? [plane[0]] : all;
    if (!found.length) {
      this.tip.classList.remove("on");
      this.over("");
      return;
    }
    const lines = found.filter(one => !SYMBOLS[one.series.style]),
      lead = lines.length ? lines : found;
    const at = (lead.find(one => one.mine) || lead[0]).x;
    const dots = found
      .filter(({u, v, P}) => v >= P.top - 1 && v <= P.top + P.height + 1 && u >= L.left - 1 && u <= L.right + 1)
      .map(
        ({u, v, series}) =>
          `<circle class="f-${series.colour} s-paper" cx="${pixels(u)}" cy="${pixels(v)}" `
          + `r="3.6" stroke-width="1.4"/>`,
      );
    const last = L.panels[L.panels.length - 1],
      x = pixels(this.across(at));
    const bar = `<path class="s-axis" stroke-width="1" d="M${x} ${L.panels[0].top}V${last.axes.bottom}"/>`;
    this.over(bar + dots.join(""));
    const row = ({series, P, y}) =>
      `<div><i class="t-${series.colour}"></i>`
      + `${escaped(series.name || P.panel.label)}<b>${withUnit(y, P.panel.unit)}</b></div>`;
    this.tip.innerHTML =
      `<div>${escaped(spec.x.label)}<b>${withUnit(at, spec.x.unit)}</b></div>`
      + `${found.slice(0, 14).map(row).join("")}`;
    this.placeTip();
    this.tip.classList.add("on");
  }

  // Beside the cursor and below the legend of its panel.
  placeTip() {
    const {tip, stage, cursor} = this,
      wide = stage.clientWidth,
      k = wide / this.shown.width;
    const P = this.shown.panels[cursor.i],
      width = tip.offsetWidth;
    const right = cursor.x * k + 14,
      fits = right + width <= wide;
    const left = fits ? right : Math.max(0, Math.min(cursor.x * k - width - 14, wide - width));
    const top = Math.max((P.top + 2) * k, cursor.y * k - tip.offsetHeight - 10);
    tip.style.transform = `translate(${left}px,${top}px)`;
  }

  hideValues() {
    this.cursor = null;
    this.tip.classList.remove("on");
    this.over("");
  }

  showAt(spot) {
    this.cursor = spot;
    this.showValues();
  }

  // ---- Zooms

  // Every plot that shares the x axis goes along.
  setX(range) {
    for (const plot of this.siblings) {
      plot.view.x = range;
      plot.later();
    }
  }

  reset() {
    this.view.y = this.home.y.slice();
    for (const plot of this.siblings) {
      plot.view.x = plot.home.x;
      plot.later();
    }
  }

  zoom(factor, centre) {
    this.setX(this.shown.x.part(centre - centre * factor, centre + (1 - centre) * factor));
    if (this.spec.ratio) this.view.y[0] = this.shown.panels[0].y.part(0.5 - 0.5 * factor, 0.5 + 0.5 * factor);
  }

  slide(part) {
    this.setX(this.shown.x.part(part, 1 + part));
  }

  // What a drag selects: a part of x, of y, or of both, by its shape.
  selection(from, to) {
    const L = this.shown,
      P = L.panels[from.i],
      width = Math.abs(to.x - from.x),
      height = Math.abs(to.y - from.y);
    const both = Boolean(this.spec.ratio);
    const wholeX = !both && width < 9 && height > 18,
      wholeY = !both && (height < 18 || height < 0.14 * width);
    const between = (a, b, low, high) => [a, b].sort((m, n) => m - n).map(v => limited(v, low, high));
    const bottom = P.top + P.height;
    const xs = wholeX ? [L.left, L.right] : between(from.x, to.x, L.left, L.right);
    const ys = wholeY ? [P.top, bottom] : between(from.y, to.y, P.top, bottom);
    // With equal axes the longer side counts.
    if (both && width >= 9) {
      const grow = (range, length, low, high) => {
        const middle = limited((range[0] + range[1]) / 2, low + length / 2, high - length / 2);
        return [middle - length / 2, middle + length / 2];
      };
      const size = Math.max(xs[1] - xs[0], (ys[1] - ys[0]) / this.spec.ratio);
      return {
        xs: grow(xs, size, L.left, L.right),
        ys: grow(ys, size * this.spec.ratio, P.top, bottom),
        P,
        none: false,
      };
    }
    return {xs, ys, wholeX, wholeY, P, none: width < 9 && (both || height < 18)};
  }

  zoomTo({xs, ys, wholeX, wholeY, P}, i) {
    if (!wholeY && ys[1] - ys[0] > 3) this.view.y[i] = ys.map(y => P.axes.yAt(y)).reverse();
    if (!wholeX && xs[1] - xs[0] > 3) this.setX(xs.map(x => P.axes.xAt(x)));
    this.later();
  }

  pan(spot) {
    const {drag} = this,
      P = this.shown.panels[drag.spot.i],
      {spec} = this;
    const moved = (range, by, axis) => new Scale(range, axis).part(by, 1 + by);
    this.view.y[drag.spot.i] = moved(drag.view.y[drag.spot.i], (spot.y - drag.spot.y) / P.height, P.panel);
    this.setX(moved(drag.view.x, (drag.spot.x - spot.x) / this.shown.wide, spec.x));
  }

  toggle(key) {
    if (!this.hidden.delete(key)) this.hidden.add(key);
    this.later();
  }

  // ---- Pointers and keys

  listen() {
    const {svg, stage} = this;
    svg.addEventListener("pointerdown", event => this.pressed(event));
    svg.addEventListener("pointermove", event => this.moved(event));
    svg.addEventListener("pointerup", event => this.released(event));
    svg.addEventListener("pointercancel", () => {
      this.drag = null;
      this.hideValues();
    });
    // A finger leaves as soon as it is lifted, but the values that it asked for stay.
    svg.addEventListener("pointerleave", event => {
      if (!this.drag && event.pointerType === "mouse") this.hideValues();
    });
    document.addEventListener("pointerdown", event => {
      if (this.cursor && !stage.contains(event.target)) this.hideValues();
    });
    svg.addEventListener("dblclick", () => this.reset());
    svg.addEventListener(
      "wheel",
      event => {
        // Without the key the wheel scrolls the page.
        if (!this.shown || !(event.ctrlKey || event.metaKey)) return;
        event.preventDefault();
        this.zoom(Math.exp(0.002 * event.deltaY), (this.spot(event).x - this.shown.left) / this.shown.wide);
      },
      {passive: false},
    );
    stage.addEventListener("keydown", event => this.key(event));
    stage.addEventListener("blur", () => this.hideValues());
    this.figure.querySelector(".figtitle button").addEventListener("click", () => this.reset());
    let width = stage.clientWidth;
    new ResizeObserver(() => {
      if (!stage.clientWidth || stage.clientWidth === width) return;
      width = stage.clientWidth;
      this.later();
    }).observe(stage);
  }

  pressed(event) {
    if (!this.shown || event.button) return;
    const entry = event.target.closest("[data-curve]"),
      spot = this.spot(event);
    if (entry) {
      this.toggle(entry.dataset.curve);
      return;
    }
    if (!this.isInside(spot)) {
      this.hideValues();
      return;
    }
    this.drag = {spot, view: {x: this.view.x, y: this.view.y.slice()}, pans: event.shiftKey};
    try {
      this.svg.setPointerCapture(event.pointerId);
    } catch {
      /* a synthetic pointer */
    }
    if (event.pointerType !== "mouse") return;
    event.preventDefault();
    this.stage.focus({preventScroll: true});
  }

  moved(event) {
    if (!this.shown) return;
    const spot = this.spot(event);
    if (!this.drag) {
      if (this.isInside(spot)) this.showAt(spot);
      else if (event.pointerType === "mouse") this.hideValues();
      return;
    }
    this.hideValues();
    if (this.drag.pans) {
      this.pan(spot);
      return;
    }
    const {xs, ys, none} = this.selection(this.drag.spot, spot);
    const box = [xs[0], ys[0], xs[1] - xs[0], ys[1] - ys[0]].map(pixels);
    this.over(
      none
        ? ""
        : `<rect class="f-blue s-blue" fill-opacity=".1" stroke-opacity=".6" x="${box[0]}" y="${box[1]}"`
            + ` width="${box[2]}" height="${box[3]}"/>`,
    );
  }

  released(event) {
    if (!this.drag) return;
    const spot = this.spot(event),
      {drag} = this,
      selected = this.selection(drag.spot, spot);
    this.drag = null;
    if (drag.pans) return;
    this.over("");
    if (!selected.none) this.zoomTo(selected, drag.spot.i);
    else if (this.isInside(spot)) this.showAt(spot);
  }

  // Arrows move the cursor, with shift they slide what is seen; + and - zoom about the cursor; 0 and Escape go back.
  key(event) {
    if (!this.shown) return;
    const entry = event.target.closest("[data-curve]");
    if (entry) {
      const toggle = () => this.toggle(entry.dataset.curve);
      obey(event, {Enter: toggle, " ": toggle});
      return;
    }
    const centre = this.cursor ? limited((this.cursor.x - this.shown.left) / this.shown.wide, 0, 1) : 0.5;
    const sideways = by => () => (event.shiftKey ? this.slide(0.15 * by) : this.step(by, 0));
    const isPlane = this.spec.panels.some(panel => panel.series.some(series => !this.rising[series.x]));
    const acts = {
      "+": () => this.zoom(0.7, centre),
      "=": () => this.zoom(0.7, centre),
      "-": () => this.zoom(1 / 0.7, centre),
      ArrowLeft: sideways(-1),
      ArrowRight: sideways(1),
      0: () => this.reset(),
      Escape: () => (this.cursor ? this.hideValues() : this.reset()),
    };
    if (isPlane) Object.assign(acts, {ArrowUp: () => this.step(0, -1), ArrowDown: () => this.step(0, 1)});
    obey(event, acts);
  }

  // Moves the cursor by a hundredth of the width.
  step(right, down) {
    const L = this.shown,
      P = L.panels[0],
      by = L.wide / 100;
    const {x, y, i} = this.cursor || {x: L.left + L.wide / 2, y: P.top + P.height / 2, i: 0};
    const within = L.panels[i];
    this.showAt({
      x: limited(x + right * by, L.left, L.right),
      y: limited(y + down * by, within.top, within.top + within.height),
      i,
    });
  }
}

// Brings what is below an element to life. A figure where that fails stays the picture that it is.
export function bring(root) {
  for (const figure of root.querySelectorAll("figure.plot:not(.live)"))
    try {
      figure.plot = new Plot(figure);
    } catch (error) {
      console.error(error);
    }
}
