// @ts-check
// Playing a run: the drawing of the machine at the cursor, and the controls that move the cursor, for reports and all
// views that have them.
import {element, isOutOfView, put, tell, timeText} from "./element.js";
import {number, stateAt, valueAt} from "./pen.js";
import {drawing, extent} from "./stage.js";

/** A run with its curves: `times` has those of each curve where they differ, otherwise the column "time" has them.
 * @typedef {{head: any, columns: Map<string, Float64Array>, times?: Map<string, Float64Array>}} Rows */

/** Slow motion, in seconds of the machine for one of the watcher. */
export const RATES = [1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 1e-3, 1e-4, 1e-5, 1e-6];

/** A run that is played, and who is told of it. */
export class Playing {
  constructor() {
    /** @type {Map<string, (() => void)[]>} */
    this.listeners = new Map();
    /** @type {Rows | null} */
    this.run = null;
    /** Rows of the window, or around the cursor in slow motion, at a finer interval. @type {Rows | null} */
    this.section = null;
    /** The part of time that is seen; null for all. @type {[number, number] | null} */
    this.window = null;
    this.cursor = 0;
    this.isPlaying = false;
    /** Seconds of the machine for one second of the watcher. */
    this.rate = 0.1;
    /** By how much stretch and error are magnified. */
    this.factor = 100;
  }

  /** @param {string} what @param {() => void} listener */
  on(what, listener) {
    this.listeners.set(what, [...(this.listeners.get(what) || []), listener]);
  }

  /** @param {...string} whats */
  tell(...whats) {
    for (const what of whats) for (const listener of this.listeners.get(what) || []) listener();
  }

  /** The end of the run, s. */
  get until() {
    return this.run ? this.run.head.until : 1;
  }

  /** Plays, or pauses. */
  play() {
    this.isPlaying = !this.isPlaying;
    if (this.isPlaying && this.cursor >= this.until) this.cursor = 0;
    this.tell("play");
  }

  /** @param {number} time */
  seek(time) {
    this.cursor = Math.max(0, Math.min(this.until, time));
    this.tell("cursor");
  }

  /** Asks for rows around the cursor in slow motion, where there are more. @param {number} _from @param {number} _to */
  lens(_from, _to) {}

  /** What is found of a curve at a time, in the finest rows that have it. @param {string} name @param {number} time
   * @param {(x: Float64Array, y: Float64Array, at: number) => number} find @returns {number | undefined} */
  at(name, time, find) {
    for (const rows of [this.section, this.run]) {
      const times = rows && (rows.times ? rows.times.get(name) : rows.columns.get("time")),
        values = rows && rows.columns.get(name);
      if (times && values && time >= times[0] && time <= times[times.length - 1]) return find(times, values, time);
    }
  }

  /** The value of a curve at a time. @param {string} name @param {number} time @returns {number} */
  value(name, time) {
    const last = this.run && this.run.columns.get(name);
    return this.at(name, time, valueAt) ?? (last && last.length ? last[last.length - 1] : 0);
  }

  /** The state of a body at a time. @param {string} name @param {number} time */
  state(name, time) {
    return this.at(name, time, stateAt) ?? 0;
  }
}

/** Button, slider of time and clock. @param {Playing} app @param {string} [prefix] of their ids */
export function playing(app, prefix = "") {
  const play = element("button", {type: "button", id: prefix + "play", class: "play", onclick: () => app.play()});
  const scrub = element("input", {
    type: "range",
    id: prefix + "scrub",
    class: "scrub",
    min: 0,
    max: 10000,
    step: 1,
    "aria-label": "Time",
    oninput: () => {
      app.isPlaying = false;
      app.tell("play");
      app.seek(from() + (Number(scrub.value) / 10000) * span());
    },
  });
  const clock = element("span", {class: "clock", id: prefix + "clock"});
  const from = () => (app.window ? app.window[0] : 0),
    span = () => (app.window ? app.window[1] - app.window[0] : app.until);
  const show = () => {
    if (isOutOfView(scrub)) return;
    scrub.value = String(Math.round((10000 * (app.cursor - from())) / span()));
    tell(clock, timeText(app.cursor, Math.min(span() / 1000, app.isPlaying ? app.rate / 60 : 1)));
    put(scrub, {"aria-valuetext": clock.textContent});
  };
  for (const what of ["cursor", "window", "run", "view"]) app.on(what, show);
  app.on("play", () => {
    tell(play, app.isPlaying ? "❚❚" : "▶");
    put(play, {"aria-label": app.isPlaying ? "Pause" : "Play"});
  });
  return {play, scrub, clock};
}

/** The choice of slow motion. @param {Playing} app @param {string} [prefix] of its id */
export function slowness(app, prefix = "") {
  const rate = element(
    "select",
    {
      id: prefix + "rate",
      class: "rate",
      "aria-label": "Slow motion",
      onchange: () => {
        app.rate = Number(rate.value);
        app.tell("play");
      },
    },
    ...RATES.map(value => element("option", {value}, value === 1 ? "as it is" : `${number(1 / value)} × slower`)),
  );
  app.on("play", () => {
    rate.value = String(app.rate);
  });
  return rate;
}

/** The slider of what magnifies stretch and error, with its value. @param {Playing} app
 * @param {string} [prefix] of its id */
export function magnifier(app, prefix = "") {
  const factor = element("input", {
    type: "range",
    id: prefix + "factor",
    min: 0,
    max: 40,
    step: 1,
    "aria-label": "Magnification of stretch and error",
    oninput: () => {
      app.factor = Number((10 ** (Number(factor.value) / 10)).toPrecision(2));
      app.tell("cursor");
    },
  });
  const told = element("span", {class: "factor-value"});
  const show = () => {
    tell(told, `× ${number(app.factor)}`);
    factor.value = String(Math.round(10 * Math.log10(app.factor)));
    put(factor, {"aria-valuetext": told.textContent});
  };
  for (const what of ["cursor", "window", "run"]) app.on(what, show);
  return element(
    "label",
    {class: "factor", title: "Stretch and error on the drawing are magnified"},
    element("span", {class: "quiet"}, "stretch"),
    factor,
    told,
  );
}

/** Has the cursor move whenever the run is played. @param {Playing} app */
export function start(app) {
  let count = 0;
  app.on("play", () => {
    // Another rate while it plays is told in the same way: what moved the cursor so far ends.
    const own = ++count;
    if (app.isPlaying) run(app, () => own === count);
  });
}

/** Moves the cursor while this goes on. @param {Playing} app @param {() => boolean} goesOn */
function run(app, goesOn) {
  let last = performance.now(),
    asked = NaN;
  const go = now => {
    if (!goesOn()) return;
    const step = Math.min(0.1, (now - last) / 1000) * app.rate,
      end = app.window ? app.window[1] : app.until;
    last = now;
    let next = app.cursor + step;
    if (next >= end) next = app.window ? app.window[0] : 0;
    // In slow motion there are many pictures between two rows: those around the cursor are computed finer.
    if (!app.window && app.run && app.rate * 50 < app.until / 50) {
      const span = 6 * app.rate;
      if (!(next >= asked && next < asked + 0.7 * span)) {
        asked = next;
        app.lens(Math.max(0, next - 0.05 * span), Math.min(app.until, next + span));
      }
    }
    app.seek(next);
    requestAnimationFrame(go);
  };
  requestAnimationFrame(go);
}

/** The machine at the cursor. */
export class Stage {
  /** @param {HTMLElement} root @param {Playing} app */
  constructor(root, app) {
    this.root = root;
    this.app = app;
    this.shape = "";
    this.frame = 0;
    /** @type {import("./stage.js").Drawing | null} */
    this.drawing = null;
    /** @type {import("./stage.js").Extent | null} */
    this.extent = null;
    for (const what of ["run", "view"]) app.on(what, () => this.build());
    app.on("cursor", () => this.later());
  }

  build() {
    const {run} = this.app;
    if (!run || isOutOfView(this.root)) return;
    const {scene} = run.head,
      shape = JSON.stringify(scene);
    if (shape !== this.shape) {
      this.shape = shape;
      this.drawing = drawing(scene);
      this.root.replaceChildren(this.drawing.root);
    }
    this.extent = extent(run, scene);
    this.later();
  }

  later() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.move();
    });
  }

  move() {
    const {app} = this;
    if (!this.drawing || !this.extent || !app.run || isOutOfView(this.root)) return;
    this.drawing.move(
      name => app.value(name, app.cursor),
      name => app.state(name, app.cursor),
      app.factor,
      this.extent,
    );
  }
}
