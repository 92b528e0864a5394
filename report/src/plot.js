// Brings the figures of a page to life: zooms, shows values, hides curves.
//
// plot.rs has drawn each figure already, and layout.rs has placed everything: plot areas, ticks, legends, for several
// widths. This script takes those places for the width at hand and computes by itself only what a zoom changes: ticks,
// and which // part of a curve is seen. Its rules for ticks are those of axis.rs.
"use strict";
(() => {
  // ---- Texts

  const MINUS = "\u2212";
  const escaped = text => text.replace(/[&<>"]/g, c => `&#${c.charCodeAt(0)};`);

  const SUBSCRIPTS = {"\u2091": "e", "\u2098": "m", "\u209c": "t", "\u208a": "+", "\u208b": MINUS};
  for (let digit = 0; digit < 10; digit++) SUBSCRIPTS[String.fromCharCode(0x2080 + digit)] = String(digit);

  // Text for an SVG. Subscripts are set by shifts, since few fonts have those glyphs.
  const rich = text =>
    escaped(text).replace(/[\u2080-\u209c]+/g, run => {
      const letters = [...run].map(c => SUBSCRIPTS[c] || c).join("");
      return `<tspan dy="2.8" font-size="9">${letters}</tspan><tspan dy="-2.8">&#8203;</tspan>`;
    });

  const superscript = exponent =>
    [...String(exponent)]
      .map(c => (c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c]))
      .join("");
  const withMinus = text => text.replace("-", MINUS);

  // A tick's text: as many decimals as the step needs, powers of ten beyond comfortable lengths.
  function tickText(value, step, largest) {
    if (Math.abs(value) < 1e-9 * step) value = 0;
    if (largest >= 1e6 || largest < 1e-4) {
      if (value === 0) return "0";
      const digits = Math.max(0, Math.min(15, Math.ceil(Math.log10(largest / step))));
      const [mantissa, exponent] = value.toExponential(digits).split("e");
      const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
      return withMinus(short) + "\u00d710" + superscript(+exponent);
    }
    return withMinus(value.toFixed(Math.max(0, Math.min(17, -Math.floor(Math.log10(step * 1.0001))))));
  }

  // A value as the tip shows it.
  function readable(value) {
    if (!isFinite(value)) return "\u2013";
    const size = Math.abs(value);
    if (size !== 0 && (size >= 1e6 || size < 1e-4)) return tickText(value, size * 1e-5, size);
    return withMinus(String(+value.toPrecision(7)));
  }

  const withUnit = (value, unit) => readable(value) + (unit ? "\u00a0" + escaped(unit) : "");

  const pen = document.createElement("canvas").getContext("2d");
  function textWidth(text, size) {
    pen.font = size + "px system-ui, 'Segoe UI', 'Noto Sans', Helvetica, Arial, sans-serif";
    return pen.measureText(text).width;
  }

  // ---- Data

  // The numbers of an array: a start and a step, or a least value and a unit with 32-bit counts (embed.rs).
  function decode(array) {
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

  // The first index whose x is not below the value.
  function lowerBound(x, value) {
    let from = 0,
      to = x.length;
    while (from < to) {
      const middle = (from + to) >> 1;
      if (x[middle] < value) from = middle + 1;
      else to = middle;
    }
    return from;
  }

  // ---- Scales and ticks

  // From values between low and high to 0..1, and back.
  function scale([low, high], axis) {
    const bend = axis.log ? Math.log : v => v,
      a = bend(low),
      b = bend(high);
    return {
      low,
      high,
      axis,
      place: v => (bend(v) - a) / (b - a),
      value: p => (axis.log ? Math.exp(a + p * (b - a)) : a + p * (b - a)),
    };
  }

  const roundStep = rough => {
    const power = 10 ** Math.floor(Math.log10(rough));
    return power * [1, 2, 5, 10].find(m => rough / power <= m * 1.0001);
  };
  const roundAngle = rough => {
    if (rough <= 10) return roundStep(rough);
    return [15, 30, 45, 90, 180].find(part => rough <= part * 1.0001) || 360 * Math.max(1, roundStep(rough / 360));
  };

  // About so many round values, each with its text.
  function ticks(s, wanted) {
    wanted = Math.max(2, wanted);
    const found = [],
      decades = s.axis.log ? Math.log10(s.high / s.low) : 0;
    if (decades >= 1) {
      const factors = decades * 3 <= wanted + 1 ? [1, 2, 5] : [1],
        every = Math.max(1, Math.ceil(decades / wanted));
      for (let decade = Math.floor(Math.log10(s.low)); decade <= Math.ceil(Math.log10(s.high)); decade++) {
        if (((decade % every) + every) % every) continue;
        for (const factor of factors) {
          const value = factor * 10 ** decade;
          if (value < s.low * (1 - 1e-9) || value > s.high * (1 + 1e-9)) continue;
          const power = (factor > 1 ? factor + "\u00d7" : "") + "10" + superscript(decade);
          found.push([value, value >= 1e-3 && value < 1e5 ? String(+value.toPrecision(6)) : power]);
        }
      }
      return found;
    }
    const rough = (s.high - s.low) / wanted,
      step = s.axis.degrees ? roundAngle(rough) : roundStep(rough);
    const first = Math.ceil(s.low / step - 1e-6),
      last = Math.floor(s.high / step + 1e-6);
    const largest = Math.max(Math.abs(s.low), Math.abs(s.high));
    if (!(step > 0 && last - first < 100)) return found;
    for (let i = first; i <= last; i++) found.push([i * step, tickText(i * step, step, largest)]);
    return found;
  }

  // ---- Drawing

  const RIGHT = 16; // room beside the plot areas, as in layout.rs
  const SPARSE = 8; // pixels between samples from which they are drawn as dots
  const pixels = v => (Math.round(Math.max(-1e6, Math.min(1e6, v)) * 10) / 10).toString();
  const limited = (v, low, high) => Math.max(low, Math.min(high, v));

  const STROKES = {
    solid: 'stroke-width="1.8" stroke-linecap="round"',
    dashed: 'stroke-width="1.8" stroke-dasharray="7 4"',
    dotted: 'stroke-width="1.8" stroke-dasharray="0.1 4" stroke-linecap="round"',
    points: 'stroke-width="4.4" stroke-linecap="round"',
    crosses: 'stroke-width="1.6" stroke-linecap="round"',
    rings: 'stroke-width="1.6" stroke-linecap="round"',
  };
  // The mark at each point, of those styles that draw points by themselves.
  const SYMBOLS = {points: "h0", crosses: "m-4-4l8 8m0-8l-8 8", rings: "m-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0"};
  const DASHES = 'stroke-width="1.1" stroke-dasharray="1.5 3"';

  function svgText(x, y, size, colour, anchor, text) {
    const at = anchor ? ` text-anchor="${anchor}"` : "";
    return `<text class="f-${colour}" x="${pixels(x)}" y="${pixels(y)}" font-size="${size}"${at}>${rich(text)}</text>`;
  }
  const svgPath = (d, colour, strokes) => `<path class="s-${colour}" d="${d}" ${strokes}/>`;
  const svgLine = (x1, y1, x2, y2, colour, strokes) =>
    svgPath(`M${pixels(x1)} ${pixels(y1)}L${pixels(x2)} ${pixels(y2)}`, colour, strokes);

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
      const xScale = scale(view.x, spec.x);
      const panels = base.panels.map((place, i) => {
        const panel = spec.panels[i],
          yScale = scale(view.y[i], panel);
        const yTicks = view.y[i] === home.y[i] ? place.ticks : ticks(yScale, Math.round(place.height / 40));
        return {...place, panel, yScale, yTicks};
      });
      const widths = panels
        .filter(P => P.yTicks !== P.ticks)
        .flatMap(P => P.yTicks)
        .map(([, text]) => textWidth(text, 12));
      const left = Math.max(base.left, 16 + Math.max(0, ...widths)),
        wide = width - left - RIGHT;
      // As many as layout.rs has: not fewer because this browser's digits are wider.
      const xTicks = view.x === home.x ? base.ticks : ticks(xScale, Math.round((base.width - base.left - RIGHT) / 80));
      let height = base.height;
      if (spec.ratio) {
        height += spec.ratio * wide - panels[0].height;
        panels[0].height = spec.ratio * wide;
      }
      return {width, height, left, wide, right: left + wide, xScale, xTicks, panels};
    }

    across(x) {
      return this.shown.left + this.shown.wide * this.shown.xScale.place(x);
    }
    up(P, y) {
      return P.top + P.height * (1 - P.yScale.place(y));
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
      const body = L.panels.map((P, i) => this.panel(P, i)).join("");
      svg.setAttribute("viewBox", `0 0 ${L.width} ${pixels(L.height)}`);
      svg.setAttribute("width", L.width);
      svg.setAttribute("height", pixels(L.height));
      svg.innerHTML = body + this.xAxis() + '<g class="over"></g>';
      figure.classList.toggle("zoomed", view.x !== home.x || view.y.some((y, i) => y !== home.y[i]));
      this.limit.textContent = this.hasLimit
        ? "Dots are the samples that this page holds: it has not all rows of this run; the result files have them."
        : "";
      if (ofMine && focused) svg.querySelector(`[data-curve="${focused}"]`).focus();
      if (this.cursor) this.showValues();
    }

    // A panel: heading, legend, grid, lines across, curves.
    panel(P, i) {
      const L = this.shown,
        bottom = P.top + P.height;
      let out = svgText(L.left, P.heading, 13, "ink", "", P.panel.heading);
      out += P.legend.map(entry => this.legendEntry(entry, i)).join("");
      for (const [value, text] of P.yTicks) {
        const y = this.up(P, value);
        out +=
          svgLine(L.left, y, L.right, y, "grid", 'stroke-width="1"')
          + svgText(L.left - 8, y + 4.2, 12, "grey", "end", text);
      }
      for (const [value] of L.xTicks)
        out += svgLine(this.across(value), P.top, this.across(value), bottom, "grid", 'stroke-width="1"');
      out += this.verticals(P, i === 0);
      // Where all is shown nothing has to be cut off, and marks at the frame have room.
      const room = this.view.x === this.home.x && !this.spec.part ? 5 : 0;
      const box = [L.left - room, P.top - 2, L.wide + 2 * room, P.height + 4].map(pixels);
      out += `<svg x="${box[0]}" y="${box[1]}" width="${box[2]}" height="${box[3]}" viewBox="${box.join(" ")}">`;
      P.panel.series.forEach((series, k) => {
        if (!this.hidden.has(i + "." + k)) out += this.curve(series, P);
      });
      out += "</svg>";
      for (const mark of P.panel.marks) {
        const y = this.up(P, mark.at);
        if (!(y >= P.top - 0.5 && y <= bottom + 0.5)) continue;
        out += svgLine(L.left, y, L.right, y, "mark", DASHES);
        out += svgText(L.right - 4, y - P.top < 16 ? y + 14 : y - 5, 12, "mark", "end", mark.label);
      }
      return out + svgLine(L.left, bottom, L.right, bottom, "axis", 'stroke-width="1.2"');
    }

    // An entry of a legend is a switch.
    legendEntry([k, x, y, width, name], i) {
      const series = this.spec.panels[i].series[k],
        key = i + "." + k,
        on = !this.hidden.has(key),
        middle = y - 4.3;
      const symbol = SYMBOLS[series.style];
      const sample = symbol
        ? svgPath(`M${pixels(x + 10)} ${pixels(middle)}${symbol}`, series.colour, STROKES[series.style])
        : svgPath(`M${pixels(x)} ${pixels(middle)}h20`, series.colour, STROKES[series.style]);
      return (
        `<g data-curve="${key}" role="switch" tabindex="0" aria-checked="${on}" aria-label="${escaped(series.name)}"`
        + `${on ? "" : ' class="off"'}>`
        + `<rect x="${pixels(x - 4)}" y="${pixels(middle - 10)}" width="${pixels(width - 8)}" height="20"`
        + ` fill="#000" fill-opacity="0"/>${sample}${svgText(x + 26, y, 12.5, "ink", "", name)}</g>`
      );
    }

    // Vertical lines, their names above the first panel where there is room.
    verticals(P, named) {
      const L = this.shown;
      let out = "",
        free = L.left - 20;
      for (const mark of this.spec.marks) {
        const x = this.across(mark.at);
        if (!(x >= L.left - 0.5 && x <= L.right + 0.5)) continue;
        out += svgLine(x, P.top, x, P.top + P.height, "mark", DASHES);
        const width = textWidth(mark.label, 12),
          start = Math.max(L.left, Math.min(L.width - 2 - width, x - width / 2));
        if (!named || start < free) continue;
        out += svgText(start, P.top - 5, 12, "mark", "", mark.label);
        free = start + width + 8;
      }
      return out;
    }

    xAxis() {
      const L = this.shown,
        P = L.panels[L.panels.length - 1];
      if (!P) return "";
      const bottom = P.top + P.height;
      let out = "";
      for (const [value, text] of L.xTicks) {
        const x = this.across(value),
          half = textWidth(text, 12) / 2;
        out += svgLine(x, bottom, x, bottom + 4, "axis", 'stroke-width="1.2"');
        out += svgText(limited(x, half + 1, L.width - half - 1), bottom + 18, 12, "grey", "middle", text);
      }
      return out + svgText(L.left + L.wide / 2, bottom + 38, 13, "ink", "middle", this.spec.x.heading);
    }

    // The part of a curve that is seen: all samples, or the least and the greatest of as many as share a pixel.
    curve(series, P) {
      const L = this.shown,
        x = this.arrays[series.x],
        y = this.arrays[series.y],
        symbol = SYMBOLS[series.style];
      let from = 0,
        to = x.length;
      if (this.rising[series.x]) {
        from = Math.max(0, lowerBound(x, L.xScale.low) - 1);
        to = Math.min(to, lowerBound(x, L.xScale.high) + 2);
      }
      let d = "",
        dots = "",
        drawing = false;
      const point = i => {
        const u = this.across(x[i]),
          v = this.up(P, y[i]);
        if (!isFinite(u) || !isFinite(v)) {
          drawing = false;
          return;
        }
        const at = pixels(u) + " " + pixels(v);
        d += symbol ? "M" + at + symbol : (drawing ? "L" : "M") + at;
        dots += "M" + at + "h0";
        drawing = true;
      };
      const together = Math.floor((to - from) / (2 * L.wide));
      if (symbol || together < 2) {
        for (let i = from; i < to; i++) point(i);
      } else {
        for (let i = from; i < to; i += together) {
          let least = i,
            greatest = i;
          for (let j = i; j < Math.min(to, i + together); j++) {
            if (!(y[j] >= y[least])) least = j;
            if (!(y[j] <= y[greatest])) greatest = j;
          }
          point(Math.min(least, greatest));
          if (least !== greatest) point(Math.max(least, greatest));
        }
      }
      let out = svgPath(d, series.colour, STROKES[series.style]);
      const zoomed = this.view.x !== this.home.x;
      if (zoomed && !symbol && this.rising[series.x] && to - from < L.wide / SPARSE) {
        out += svgPath(dots, series.colour, STROKES.points);
        this.hasLimit = this.hasLimit || Boolean(series.of);
      }
      return out;
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
        const value = this.shown.xScale.value((cursor.x - this.shown.left) / this.shown.wide);
        best = lowerBound(x, value);
        if (best > 0 && (best === x.length || value - x[best - 1] < x[best] - value)) best--;
        if (best < 0 || best >= x.length) return null;
        const away = Math.abs(this.across(x[best]) - cursor.x);
        const beyond = value < x[0] || value > x[x.length - 1];
        if ((SYMBOLS[series.style] || beyond) && away > 12) return null;
      } else if (mine) {
        let nearest = 30 ** 2;
        for (let i = 0; i < x.length; i++) {
          const distance = (this.across(x[i]) - cursor.x) ** 2 + (this.up(P, y[i]) - cursor.y) ** 2;
          if (distance < nearest) {
            nearest = distance;
            best = i;
          }
        }
        if (best < 0) return null;
      } else return null;
      const u = this.across(x[best]),
        v = this.up(P, y[best]);
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
      this.over(
        svgPath(`M${x} ${L.panels[0].top}V${last.top + last.height}`, "axis", 'stroke-width="1"') + dots.join(""),
      );
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
      const s = this.shown.xScale;
      this.setX([s.value(centre - centre * factor), s.value(centre + (1 - centre) * factor)]);
      if (this.spec.ratio) {
        const y = this.shown.panels[0].yScale;
        this.view.y[0] = [y.value(0.5 - 0.5 * factor), y.value(0.5 + 0.5 * factor)];
      }
    }

    slide(part) {
      const s = this.shown.xScale;
      this.setX([s.value(part), s.value(1 + part)]);
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
      const L = this.shown;
      if (!wholeY && ys[1] - ys[0] > 3)
        this.view.y[i] = ys.map(y => P.yScale.value(1 - (y - P.top) / P.height)).reverse();
      if (!wholeX && xs[1] - xs[0] > 3) this.setX(xs.map(x => L.xScale.value((x - L.left) / L.wide)));
      this.later();
    }

    pan(spot) {
      const {drag} = this,
        P = this.shown.panels[drag.spot.i],
        {spec} = this;
      const moved = (range, by, axis) => {
        const s = scale(range, axis);
        return [s.value(by), s.value(1 + by)];
      };
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
      if (!this.shown || event.ctrlKey || event.metaKey || event.altKey) return;
      const entry = event.target.closest("[data-curve]");
      if (entry) {
        if (event.key !== "Enter" && event.key !== " ") return;
        this.toggle(entry.dataset.curve);
        event.preventDefault();
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
      if (!acts[event.key]) return;
      acts[event.key]();
      event.preventDefault();
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
  function bring(root) {
    for (const figure of root.querySelectorAll("figure.plot:not(.live)"))
      try {
        figure.plot = new Plot(figure);
      } catch (error) {
        console.error(error);
      }
  }
  bring(document);
  window.tautFigures = bring;
})();
