// @ts-check
// Playing a run: the drawing of the machine at the cursor, and the controls that move the cursor, for all views that
// have them.
import {element, isOutOfView, put, tell, time as timeText} from "./format.js";
import {drawing, extent} from "./stage.js";

/** @typedef {import("./app.js").App} App */

/** Slow motion, in seconds of the machine for one of the watcher. */
export const RATES = [1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 1e-3, 1e-4, 1e-5, 1e-6];

/** Button, slider of time and clock. @param {App} app @param {string} [prefix] of their ids */
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
  for (const what of /** @type {const} */ (["cursor", "window", "run", "view"])) app.on(what, show);
  app.on("play", () => {
    tell(play, app.isPlaying ? "❚❚" : "▶");
    put(play, {"aria-label": app.isPlaying ? "Pause" : "Play"});
  });
  return {play, scrub, clock};
}

/** Has the cursor move whenever the run is played. @param {App} app */
export function start(app) {
  let count = 0;
  app.on("play", () => {
    // Another rate while it plays is told in the same way: what moved the cursor so far ends.
    const own = ++count;
    if (app.isPlaying) run(app, () => own === count);
  });
}

/** Moves the cursor while this goes on. @param {App} app @param {() => boolean} goesOn */
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
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.root = root;
    this.app = app;
    this.shape = "";
    this.frame = 0;
    /** @type {import("./stage.js").Drawing | null} */
    this.drawing = null;
    /** @type {import("./stage.js").Extent | null} */
    this.extent = null;
    for (const what of /** @type {const} */ (["run", "view"])) app.on(what, () => this.build());
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
