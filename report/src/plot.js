// Redraws the figures of a page from their data: to the width at hand, and to what the reader zooms to.
// The first picture of each comes from plot.rs; keep the two alike.
"use strict";
(() => {
const MINUS = "\u2212";
const esc = s => s.replace(/[&<>"]/g, c => `&#${c.charCodeAt(0)};`);
const px = v => (Math.round(Math.max(-1e6, Math.min(1e6, v)) * 10) / 10).toString();
const below = {"\u2091": "e", "\u2098": "m", "\u209c": "t", "\u208a": "+", "\u208b": MINUS};
for (let i = 0; i < 10; i++) below[String.fromCharCode(0x2080 + i)] = String(i);

// Subscripts are set by shifts, since few fonts carry those glyphs.
const rich = s => esc(s).replace(/[\u2080-\u209c]+/g, run =>
  `<tspan dy="2.8" font-size="9">${[...run].map(c => below[c] || c).join("")}</tspan><tspan dy="-2.8">&#8203;</tspan>`);

// n numbers: a start and a step, or a base and a unit with 32-bit counts.
function decode(a) {
  const out = new Float64Array(a.n);
  if (!a.d) { for (let i = 0; i < a.n; i++) out[i] = a.o + i * a.s; return out; }
  const bytes = Uint8Array.from(atob(a.d), c => c.charCodeAt(0)), view = new DataView(bytes.buffer);
  for (let i = 0; i < a.n; i++) {
    const q = view.getUint32(4 * i, true);
    out[i] = q === 0xffffffff ? NaN : a.o + q * a.s;
  }
  return out;
}

const raised = e => [...String(e)].map(c => c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c]).join("");
const minus = s => s.replace("-", MINUS);
function label(v, step, largest) {
  if (Math.abs(v) < 1e-9 * step) v = 0;
  if (largest >= 1e6 || largest < 1e-4) {
    if (v === 0) return "0";
    const digits = Math.max(0, Math.min(15, Math.ceil(Math.log10(largest / step))));
    const [m, e] = v.toExponential(digits).split("e");
    return minus(m.includes(".") ? m.replace(/\.?0+$/, "") : m) + "\u00d710" + raised(+e);
  }
  return minus(v.toFixed(Math.max(0, Math.min(17, -Math.floor(Math.log10(step * 1.0001))))));
}
function readable(v) {
  if (!isFinite(v)) return "\u2013";
  const a = Math.abs(v);
  if (a !== 0 && (a >= 1e6 || a < 1e-4)) return label(v, a * 1e-5, a);
  return minus(String(+v.toPrecision(7)));
}

// A scale from lo..hi to 0..1.
function scale(lo, hi, log) {
  const f = log ? Math.log : v => v, a = f(lo), b = f(hi);
  return {lo, hi, log, at: v => (f(v) - a) / (b - a), back: p => log ? Math.exp(a + p * (b - a)) : a + p * (b - a)};
}
function ticks(s, wanted) {
  wanted = Math.max(2, wanted);
  const decades = s.log ? Math.log10(s.hi / s.lo) : 0, out = [];
  if (decades >= 1) {
    const factors = decades * 3 <= wanted + 1 ? [1, 2, 5] : [1], every = Math.max(1, Math.ceil(decades / wanted));
    for (let d = Math.floor(Math.log10(s.lo)); d <= Math.ceil(Math.log10(s.hi)); d++) {
      if (((d % every) + every) % every) continue;
      for (const f of factors) {
        const v = f * 10 ** d;
        if (v >= s.lo * (1 - 1e-9) && v <= s.hi * (1 + 1e-9))
          out.push([v, v >= 1e-3 && v < 1e5 ? String(+v.toPrecision(6)) : (f > 1 ? f + "\u00d7" : "") + "10" + raised(d)]);
      }
    }
    return out;
  }
  const rough = (s.hi - s.lo) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => rough / power <= m * 1.0001);
  const first = Math.ceil(s.lo / step - 1e-6), last = Math.floor(s.hi / step + 1e-6);
  const largest = Math.max(Math.abs(s.lo), Math.abs(s.hi));
  if (!(step > 0 && last - first < 100)) return out;
  for (let i = 0; i <= last - first; i++) out.push([(first + i) * step, label((first + i) * step, step, largest)]);
  return out;
}

// The first index whose x is not below v.
function bisect(x, v) {
  let a = 0, b = x.length;
  while (a < b) { const m = (a + b) >> 1; if (x[m] < v) a = m + 1; else b = m; }
  return a;
}
const rising = x => { for (let i = 1; i < x.length; i++) if (!(x[i] >= x[i - 1])) return false; return true; };

const pen = document.createElement("canvas").getContext("2d");
function textWidth(s, size) {
  pen.font = size + "px system-ui, 'Segoe UI', 'Noto Sans', Helvetica, Arial, sans-serif";
  return pen.measureText(s).width;
}
const dashes = {dashed: ' stroke-dasharray="7 4"', dotted: ' stroke-dasharray="0.1 4" stroke-linecap="round"', solid: ' stroke-linecap="round"'};

function plot(figure) {
  const spec = JSON.parse(figure.querySelector("script").textContent);
  const stage = figure.querySelector(".stage"), svg = stage.querySelector("svg");
  const arrays = spec.arrays.map(decode), order = arrays.map(rising), off = new Set();
  const home = {x: spec.x.range, y: spec.panels.map(p => p.range)};
  let view = {x: home.x, y: home.y.slice()}, lay = null, drag = null, frame = 0;
  const tip = document.createElement("div");
  tip.className = "tip";
  stage.append(tip);
  figure.classList.add("live");

  function layout() {
    const width = Math.max(240, stage.clientWidth), sx = scale(...view.x, spec.x.log);
    const sys = spec.panels.map((p, i) => scale(...view.y[i], p.log));
    const marks = sys.map((s, i) => ticks(s, Math.round(spec.panels[i].height / 40)));
    const left = Math.max(width < 480 ? 34 : 44, 16 + Math.max(0, ...marks.flat().map(t => textWidth(t[1], 12))));
    const wide = width - left - 16, marked = spec.marks.some(m => m.label);
    let top = 8;
    const panels = spec.panels.map((p, i) => {
      let x = left + textWidth(p.heading, 13) + 22, row = 0;
      const legend = [];
      p.series.forEach((s, k) => {
        if (!s.name) return;
        const needed = 44 + textWidth(s.name, 12.5);
        if (x + needed > left + wide + 18 && x > left) { x = left; row++; }
        legend.push({k, x, row, needed});
        x += needed;
      });
      const lift = i === 0 && marked ? 15 : 0;
      top += (row + 1) * 19 + 6 + lift;
      const place = {p, legend, row, lift, top, height: p.height, sy: sys[i], ticks: marks[i]};
      top += p.height + (i + 1 < spec.panels.length ? 16 : 0);
      return place;
    });
    return {width, height: top + 48, left, wide, sx, panels};
  }

  function path(s, l, P) {
    const x = arrays[s.x], y = arrays[s.y], points = s.style === "points";
    let a = 0, b = x.length;
    if (order[s.x]) { a = Math.max(0, bisect(x, l.sx.lo) - 1); b = Math.min(b, bisect(x, l.sx.hi) + 2); }
    const X = i => l.left + l.wide * l.sx.at(x[i]), Y = i => P.top + P.height * (1 - P.sy.at(y[i]));
    let d = "", down = false;
    const dot = i => {
      const u = X(i), v = Y(i);
      if (!isFinite(u) || !isFinite(v)) { down = false; return; }
      d += (points || !down ? "M" : "L") + px(u) + " " + px(v) + (points ? "h0" : "");
      down = true;
    };
    const bucket = Math.floor((b - a) / (2 * l.wide));
    if (points || bucket < 2) { for (let i = a; i < b; i++) dot(i); return d; }
    for (let i = a; i < b; i += bucket) {
      let lo = i, hi = i;
      for (let j = i; j < Math.min(b, i + bucket); j++) { if (!(y[j] >= y[lo])) lo = j; if (!(y[j] <= y[hi])) hi = j; }
      dot(Math.min(lo, hi));
      if (lo !== hi) dot(Math.max(lo, hi));
    }
    return d;
  }

  function draw() {
    frame = 0;
    const l = lay = layout(), right = l.left + l.wide;
    const text = (x, y, size, cls, anchor, s) =>
      `<text class="f-${cls}" x="${px(x)}" y="${px(y)}" font-size="${size}"${anchor ? ` text-anchor="${anchor}"` : ""}>${rich(s)}</text>`;
    const line = (x1, y1, x2, y2, cls, w, more = "") =>
      `<path class="s-${cls}" d="M${px(x1)} ${px(y1)}L${px(x2)} ${px(y2)}" stroke-width="${w}"${more}/>`;
    const across = v => l.left + l.wide * l.sx.at(v);
    const xt = ticks(l.sx, Math.round(l.wide / 90));
    let o = "";
    l.panels.forEach((P, i) => {
      const bottom = P.top + P.height, up = v => P.top + P.height * (1 - P.sy.at(v));
      const base = row => P.top - P.lift - 10 - (P.row - row) * 19;
      o += text(l.left, base(0), 13, "ink", "", P.p.heading);
      for (const e of P.legend) {
        const s = P.p.series[e.k], y = base(e.row) - 4.3;
        o += `<g data-k="${i}.${e.k}"${off.has(i + "." + e.k) ? ' class="off"' : ""}><rect x="${px(e.x - 4)}" y="${px(y - 10)}" width="${px(e.needed - 8)}" height="20" fill="#000" fill-opacity="0"/>`;
        o += s.style === "points" ? `<circle class="f-${s.colour}" cx="${px(e.x + 10)}" cy="${px(y)}" r="2.6"/>`
          : `<path class="s-${s.colour}" d="M${px(e.x)} ${px(y)}h20" stroke-width="2"${dashes[s.style]}/>`;
        o += text(e.x + 26, base(e.row), 12.5, "ink", "", s.name) + "</g>";
      }
      for (const [v, t] of P.ticks)
        o += line(l.left, up(v), right, up(v), "grid", 1) + text(l.left - 8, up(v) + 4.2, 12, "grey", "end", t);
      for (const [v] of xt) o += line(across(v), P.top, across(v), bottom, "grid", 1);
      let free = l.left - 20;
      for (const m of spec.marks) {
        const x = across(m.at);
        if (!(x >= l.left - 0.5 && x <= right + 0.5)) continue;
        o += line(x, P.top, x, bottom, "mark", 1.1, ' stroke-dasharray="1.5 3"');
        const w = textWidth(m.label, 12), start = Math.max(l.left, Math.min(right - w, x - w / 2));
        if (i === 0 && start >= free) { o += text(start, P.top - 5, 12, "mark", "", m.label); free = start + w + 8; }
      }
      const box = `x="${px(l.left)}" y="${px(P.top - 2)}" width="${px(l.wide)}" height="${P.height + 4}"`;
      o += `<svg ${box} viewBox="${px(l.left)} ${px(P.top - 2)} ${px(l.wide)} ${P.height + 4}">`;
      P.p.series.forEach((s, k) => {
        if (off.has(i + "." + k)) return;
        o += s.style === "points" ? `<path class="s-${s.colour}" d="${path(s, l, P)}" stroke-width="4.4" stroke-linecap="round"/>`
          : `<path class="s-${s.colour}" d="${path(s, l, P)}" stroke-width="1.8"${dashes[s.style]}/>`;
      });
      o += "</svg>";
      for (const m of P.p.marks) {
        const y = up(m.at);
        if (!(y >= P.top - 0.5 && y <= bottom + 0.5)) continue;
        o += line(l.left, y, right, y, "mark", 1.1, ' stroke-dasharray="1.5 3"');
        o += text(right - 4, y - P.top < 16 ? y + 14 : y - 5, 12, "mark", "end", m.label);
      }
      o += line(l.left, bottom, right, bottom, "axis", 1.2);
      if (i === l.panels.length - 1) {
        for (const [v, t] of xt) o += line(across(v), bottom, across(v), bottom + 4, "axis", 1.2) + text(across(v), bottom + 18, 12, "grey", "middle", t);
        o += text(l.left + l.wide / 2, bottom + 38, 13, "ink", "middle", spec.x.heading);
      }
    });
    svg.setAttribute("viewBox", `0 0 ${l.width} ${l.height}`);
    svg.setAttribute("width", l.width);
    svg.setAttribute("height", l.height);
    svg.innerHTML = o + '<g class="over"></g>';
    figure.classList.toggle("zoomed", view.x !== home.x || view.y.some((y, i) => y !== home.y[i]));
  }
  const later = () => { frame = frame || requestAnimationFrame(draw); };
  const over = o => { const g = svg.querySelector(".over"); if (g) g.innerHTML = o; };
  const reset = () => { view = {x: home.x, y: home.y.slice()}; later(); };

  // Where a pointer is: pixels, and the panel under it.
  function spot(e) {
    const r = svg.getBoundingClientRect(), x = (e.clientX - r.left) * lay.width / r.width, y = (e.clientY - r.top) * lay.height / r.height;
    return {x, y, i: lay.panels.findIndex(P => y >= P.top - 4 && y <= P.top + P.height + 4)};
  }
  const inside = p => p.i >= 0 && p.x >= lay.left - 4 && p.x <= lay.left + lay.wide + 4;

  function show(p) {
    const v = lay.sx.back((p.x - lay.left) / lay.wide), rows = [];
    let dots = "", at = null;
    lay.panels.forEach((P, i) => P.p.series.forEach((s, k) => {
      if (off.has(i + "." + k)) return;
      const x = arrays[s.x], y = arrays[s.y];
      let j = -1;
      if (order[s.x]) {
        j = bisect(x, v);
        if (j > 0 && (j === x.length || v - x[j - 1] < x[j] - v)) j--;
        if (x.length && (v < x[0] - 1e-9 * Math.abs(x[0]) || v > x[x.length - 1] * (1 + 1e-9))) j = -1;
      } else if (i === p.i) {
        let best = 900;
        for (let m = 0; m < x.length; m++) {
          const d = (lay.left + lay.wide * lay.sx.at(x[m]) - p.x) ** 2 + (P.top + P.height * (1 - P.sy.at(y[m])) - p.y) ** 2;
          if (d < best) { best = d; j = m; }
        }
      }
      if (j < 0 || j >= x.length) return;
      const cx = lay.left + lay.wide * lay.sx.at(x[j]), cy = P.top + P.height * (1 - P.sy.at(y[j]));
      if (cy >= P.top && cy <= P.top + P.height && cx >= lay.left - 1 && cx <= lay.left + lay.wide + 1)
        dots += `<circle class="f-${s.colour} s-paper" cx="${px(cx)}" cy="${px(cy)}" r="3.6" stroke-width="1.4"/>`;
      if (at === null || i === p.i) at = x[j];
      rows.push(`<div><i style="color:var(--${s.colour})"></i>${esc(s.name || P.p.label)}<b>${readable(y[j])}${P.p.unit ? "\u00a0" + esc(P.p.unit) : ""}</b></div>`);
    }));
    if (at === null) return hide();
    const x = px(lay.left + lay.wide * lay.sx.at(at)), P0 = lay.panels[0], P1 = lay.panels[lay.panels.length - 1];
    over(`<path class="s-axis" d="M${x} ${P0.top}V${P1.top + P1.height}" stroke-width="1"/>${dots}`);
    tip.innerHTML = `<div>${esc(spec.x.label)}<b>${readable(at)}${spec.x.unit ? "\u00a0" + esc(spec.x.unit) : ""}</b></div>${rows.slice(0, 14).join("")}`;
    const k = stage.clientWidth / lay.width, w = tip.offsetWidth, flip = p.x * k + w + 20 > stage.clientWidth;
    const left = flip ? Math.max(0, p.x * k - w - 14) : p.x * k + 14;
    tip.style.transform = `translate(${left}px,${Math.max(0, p.y * k - tip.offsetHeight - 10)}px)`;
    tip.classList.add("on");
  }
  function hide() { tip.classList.remove("on"); over(""); }

  svg.addEventListener("pointerdown", e => {
    if (!lay || e.button) return;
    const key = e.target.closest("[data-k]"), p = spot(e);
    if (key) { const k = key.dataset.k; off.delete(k) || off.add(k); later(); return; }
    if (!inside(p)) return;
    drag = {p, view: {x: view.x, y: view.y.slice()}, pan: e.shiftKey};
    try { svg.setPointerCapture(e.pointerId); } catch { /* a synthetic pointer */ }
    if (e.pointerType === "mouse") e.preventDefault();
    stage.focus({preventScroll: true});
  });
  // What a drag from a to b selects: x, y, or both, by its shape.
  function selection(a, b) {
    const P = lay.panels[a.i], w = Math.abs(b.x - a.x), h = Math.abs(b.y - a.y);
    const wholeX = w < 9 && h > 18, wholeY = h < 18 || h < 0.14 * w;
    const cut = (v, lo, hi) => Math.max(lo, Math.min(hi, v));
    const xs = wholeX ? [lay.left, lay.left + lay.wide] : [a.x, b.x].sort((m, n) => m - n).map(v => cut(v, lay.left, lay.left + lay.wide));
    const ys = wholeY ? [P.top, P.top + P.height] : [a.y, b.y].sort((m, n) => m - n).map(v => cut(v, P.top, P.top + P.height));
    return {xs, ys, wholeX, wholeY, P, none: w < 9 && h < 18};
  }
  svg.addEventListener("pointermove", e => {
    if (!lay) return;
    const p = spot(e);
    if (drag && drag.pan) {
      const P = lay.panels[drag.p.i], shift = (r, by, log) => {
        const s = scale(...r, log);
        return [s.back(by), s.back(1 + by)];
      };
      view.x = shift(drag.view.x, (drag.p.x - p.x) / lay.wide, spec.x.log);
      view.y[drag.p.i] = shift(drag.view.y[drag.p.i], (p.y - drag.p.y) / P.height, P.p.log);
      tip.classList.remove("on");
      later();
    } else if (drag) {
      const s = selection(drag.p, p);
      tip.classList.remove("on");
      over(s.none ? "" : `<rect class="f-blue s-blue" fill-opacity=".1" stroke-opacity=".6" x="${px(s.xs[0])}" y="${px(s.ys[0])}" width="${px(s.xs[1] - s.xs[0])}" height="${px(s.ys[1] - s.ys[0])}"/>`);
    } else if (inside(p)) show(p); else hide();
  });
  svg.addEventListener("pointerup", e => {
    if (!drag) return;
    const s = selection(drag.p, spot(e)), {pan, p: {i}} = drag;
    drag = null;
    if (pan || s.none) { over(""); if (!pan && e.pointerType !== "mouse") show(spot(e)); return; }
    if (!s.wholeX && s.xs[1] - s.xs[0] > 3) view.x = s.xs.map(x => lay.sx.back((x - lay.left) / lay.wide));
    if (!s.wholeY && s.ys[1] - s.ys[0] > 3) view.y[i] = s.ys.map(y => s.P.sy.back(1 - (y - s.P.top) / s.P.height)).reverse();
    later();
  });
  svg.addEventListener("pointercancel", () => { drag = null; hide(); });
  svg.addEventListener("pointerleave", () => { if (!drag) hide(); });
  svg.addEventListener("dblclick", reset);
  function zoom(factor, centre) {
    const s = scale(...view.x, spec.x.log);
    view.x = [s.back(centre - centre * factor), s.back(centre + (1 - centre) * factor)];
    later();
  }
  svg.addEventListener("wheel", e => {
    // Without the key the wheel scrolls the page.
    if (!lay || !(e.ctrlKey || e.metaKey)) return;
    e.preventDefault();
    zoom(Math.exp(0.002 * e.deltaY), (spot(e).x - lay.left) / lay.wide);
  }, {passive: false});
  stage.addEventListener("keydown", e => {
    const slide = by => { const s = scale(...view.x, spec.x.log); view.x = [s.back(by), s.back(1 + by)]; later(); };
    const act = {"+": () => zoom(0.7, 0.5), "=": () => zoom(0.7, 0.5), "-": () => zoom(1 / 0.7, 0.5),
      ArrowLeft: () => slide(-0.15), ArrowRight: () => slide(0.15), "0": reset, Escape: reset}[e.key];
    if (act && !e.ctrlKey && !e.metaKey && !e.altKey) { act(); e.preventDefault(); }
  });
  figure.querySelector(".figtitle button").addEventListener("click", reset);
  let seen = stage.clientWidth;
  if (seen) draw();
  new ResizeObserver(() => { if (stage.clientWidth && stage.clientWidth !== seen) { seen = stage.clientWidth; later(); } }).observe(stage);
}
for (const figure of document.querySelectorAll("figure.plot")) {
  // A figure that cannot be brought to life stays the picture that it is.
  try { plot(figure); } catch (e) { console.error(e); }
}
})();
