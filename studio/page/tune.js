// @ts-check
// A controller and its moves: gains under sliders, the cart's error and Nyquist's curve with them, and the tuning.
import {element, number, rowHead, table} from "./format.js";
import {Picture} from "./picture.js";
import {errorPlace} from "./drop.js";
import {showReport} from "./modes.js";
import {Row} from "./parameters.js";
import {LongWork} from "./long-work.js";

/** @typedef {import("./app.js").App} App */

export const key = "tune",
  name = "Tune";

/** The largest |L| that is drawn: more of it would hide the point −1. */
const FAR = 3;

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const view = new Tune(root, app);
  app.on("view", () => view.ask());
  app.on("text", () => view.ask());
  app.on("run", () => view.ask());
  app.on("mistake", () => view.ask());
  app.on("opened", () => view.leave());
}

class Tune {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.move = 0;
    this.sent = "";
    /** @type {any[]} */
    this.controllers = [];
    this.told = element("p", {class: "quiet", role: "status", id: "loop-status"});
    this.trouble = errorPlace();
    this.choice = element(
      "select",
      {id: "controller", onchange: () => this.take()},
      element("option", {value: ""}, "as in the case"),
    );
    this.moves = element("select", {
      id: "move",
      onchange: () => {
        this.move = Number(this.moves.value);
        this.sent = "";
        this.ask();
      },
    });
    this.moveLabel = element("label", {for: "move", hidden: true}, "Move: ", this.moves);
    this.gains = element("div", {class: "groups gains"});
    this.margins = element("dl", {class: "figures", id: "margins"});
    this.figures = element("dl", {class: "figures", id: "move-figures"});
    this.error = new Picture("Reference minus cart", {
      x: "Time",
      xUnit: "s",
      y: "Error",
      yUnit: "µm",
      words: "How far the cart is from where it should be during the move.",
    });
    this.position = new Picture("Position", {
      x: "Time",
      xUnit: "s",
      y: "Position",
      yUnit: "mm",
      words: "Where the cart should be and is.",
    });
    this.command = new Picture("Command", {
      x: "Time",
      xUnit: "s",
      y: "Voltage",
      yUnit: "V",
      words: "Voltage at the motor.",
    });
    this.nyquist = new Picture("Nyquist's curve", {
      x: "Re L",
      y: "Im L",
      equal: true,
      words: "The open loop in the complex plane; it may not enter the circle around −1.",
    });
    this.sensitivity = new Picture("Sensitivity", {
      x: "Frequency",
      xUnit: "Hz",
      y: "|S| and |T|",
      logX: true,
      words: "By how much the loop enlarges disturbances, |S|, and follows, |T|, over frequency.",
    });
    this.tuneButton = element(
      "button",
      {type: "button", id: "tune", class: "strong", onclick: () => this.tune()},
      "Tune",
    );
    this.work = new LongWork(app.wire, [this.tuneButton], {id: "tune-stop", words: "Stop, keep the best"});
    this.spread = element("input", {
      type: "number",
      id: "spread",
      min: 0,
      max: 90,
      step: 5,
      placeholder: "as the case",
    });
    this.status = element("p", {class: "quiet", role: "status", id: "tune-status"});
    this.result = element("div", {id: "tune-result", hidden: true});
    this.report = element("div", {class: "report page"});
    this.live = element(
      "div",
      {class: "loop", hidden: true},
      element(
        "div",
        {class: "loop-side"},
        element("h3", {}, "Gains"),
        this.gains,
        element("h3", {}, "Margins"),
        this.margins,
        element("h3", {}, "The move"),
        this.figures,
      ),
      element(
        "div",
        {class: "plots"},
        this.error.figure,
        this.nyquist.figure,
        this.sensitivity.figure,
        this.position.figure,
        this.command.figure,
      ),
    );
    root.append(
      element("h2", {}, "Move and tune"),
      element(
        "p",
        {class: "fields"},
        element("label", {for: "controller"}, "Controller: ", this.choice),
        this.moveLabel,
        this.told,
      ),
      this.trouble,
      this.live,
      element("h3", {}, "Tuning"),
      element(
        "p",
        {class: "quiet"},
        "Searches for gains that are good on every machine that can be: settling, error and current "
          + "at worst, while the sensitivity keeps within its limit.",
      ),
      element(
        "p",
        {class: "buttons"},
        this.tuneButton,
        this.work.stopButton,
        element("label", {for: "spread"}, "Parameters may be off by ", this.spread, " %"),
      ),
      this.status,
      this.result,
      this.report,
    );
    this.shape = "";
  }

  // ---- Controllers to begin with

  async list() {
    if (this.controllers.length) return;
    const {head} = await this.app.wire.ask("controllers");
    this.controllers = head.controllers;
    this.choice.append(...this.controllers.map((one, k) => element("option", {value: k}, one.name)));
  }

  /** Puts a controller into the case, and its moves where the case has none. */
  async take() {
    const one = this.controllers[this.choice.value];
    if (!one) return;
    const changes = [`controller=${one.controller}`];
    if (!this.app.run || !this.app.run.head.has_moves) changes.push(`move=${one.moves}`);
    try {
      const {head} = await this.app.wire.ask("loop", {...this.app.body(), changes});
      this.app.edit(head.text);
      this.choice.value = "";
      this.app.notify(`${one.name}: its gains are those of another machine; tune them. Ctrl Z takes it back.`);
    } catch (error) {
      this.tell(error);
    }
  }

  tell(error) {
    const hasController = this.app.run && this.app.run.head.has_controller;
    this.trouble.tell(error, hasController ? "" : "Choose a controller above, or write one. As the case stands, ");
  }

  // ---- The loop

  ask() {
    const {app} = this;
    if (app.view !== key || !app.base) return;
    this.list().catch(error => this.tell(error));
    const state = JSON.stringify([app.base, [...app.pending], this.move]);
    if (state === this.sent) return;
    this.sent = state;
    app.wire.newest(
      "loop",
      () => ({...app.body(), move: this.move}),
      (answer, error) => {
        if (!answer) {
          this.live.hidden = this.moveLabel.hidden = true;
          this.told.textContent = "";
          this.tell(error);
          return;
        }
        this.tell(null);
        this.show(answer);
      },
    );
  }

  show({head, columns}) {
    this.shown = head;
    this.live.hidden = this.moveLabel.hidden = false;
    this.told.textContent = `${head.controller}. ${number(1000 * head.took_s, 3)} ms.`;
    const names = JSON.stringify(head.moves);
    if (names !== this.moves.dataset.names) {
      this.moves.dataset.names = names;
      this.moves.replaceChildren(...head.moves.map((one, k) => element("option", {value: k}, one.name)));
    }
    this.moves.value = String(head.move);
    this.rows(head.parameters.filter(one => one.key.startsWith("controller.")));
    const list = (place, rows) =>
      place.replaceChildren(...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
    list(this.figures, head.trouble ? [["trouble", head.trouble], ...head.rows] : head.rows);
    const time = columns.get("time"),
      scaled = (name, factor) => Float64Array.from(columns.get(name) || [], value => value * factor);
    const marks = [{x: head.profile_end, name: "end of the profile"}];
    const curve = (one, factor, colour) => ({
      name: one.name,
      x: time,
      y: scaled(one.column, factor),
      colour,
      ...(one.name === "reference" ? {colour: "grey", dash: [5, 3]} : {}),
    });
    const {error, position, command} = head.curves;
    this.error.show(
      error.map((one, k) => curve(one, 1e6, ["blue", "green"][k])),
      {marks},
    );
    this.position.show(
      position.map((one, k) => curve(one, 1e3, k < 2 ? "blue" : "green")),
      {marks},
    );
    this.command.show(
      command.map((one, k) => curve(one, 1, ["verm", "amber"][k])),
      {marks},
    );
    const {margins} = head;
    const isLinear = !margins.without;
    this.nyquist.figure.hidden = this.sensitivity.figure.hidden = !isLinear;
    list(this.margins, isLinear ? margins.rows : [["none", margins.without]]);
    if (!isLinear) return;
    const hertz = columns.get("hertz"),
      re = columns.get("re"),
      im = columns.get("im");
    const near = values => Float64Array.from(values, (value, k) => (Math.hypot(re[k], im[k]) < FAR ? value : NaN));
    const angles = Array.from({length: 121}, (_, k) => (2 * Math.PI * k) / 120),
      r = 1 / margins.limit;
    this.nyquist.show(
      [
        {name: "L", x: near(re), y: near(im), colour: margins.stable ? "blue" : "verm"},
        {
          name: `Ms = ${margins.limit}`,
          x: angles.map(a => -1 + r * Math.cos(a)),
          y: angles.map(a => r * Math.sin(a)),
          colour: "green",
          dash: [4, 3],
        },
        {name: "−1", x: [-1], y: [0], kind: "crosses", colour: "ink"},
      ],
      {xRange: [-2.4, 1.2], yRange: [-1.8, 1.8]},
    );
    const from = hertz.findIndex(value => value > 0.5);
    this.sensitivity.show(
      [
        {name: "|S|", x: hertz.slice(from), y: columns.get("sensitivity").slice(from), colour: "blue"},
        {name: "|T|", x: hertz.slice(from), y: columns.get("complementary").slice(from), colour: "amber"},
      ],
      {marks: [{y: margins.limit, name: "limit"}], yRange: [0, Math.max(2.2, margins.limit * 1.3)]},
    );
  }

  /** Gains as fields and sliders. */
  rows(parameters) {
    const shape = parameters.map(one => one.key).join(" ") + this.app.original;
    if (shape !== this.shape) {
      this.shape = shape;
      this.fields = parameters.map(parameter => new Row(parameter, this.app, "g-"));
      this.gains.replaceChildren(...this.fields.map(row => row.element));
    }
    parameters.forEach((parameter, k) => {
      this.fields[k].parameter = parameter;
      this.fields[k].show();
    });
  }

  // ---- The tuning

  async tune() {
    const {app} = this;
    this.tell(null);
    this.result.hidden = true;
    this.report.replaceChildren();
    this.status.textContent = "Searching…";
    const spread = this.spread.value === "" ? {} : {spread: Number(this.spread.value) / 100};
    try {
      const {head} = await this.work.ask("tune", {...app.body(), ...spread}, step => {
        this.status.textContent = `${step.designs} looks at designs, ${number(step.took_s, 3)} s`;
      });
      this.tuned(head);
      this.status.textContent =
        `${head.stopped ? "Stopped: the best so far. " : ""}`
        + `${head.result.designs} designs in ${number(head.took_s, 3)} s.`;
    } catch (error) {
      this.status.textContent = "";
      this.tell(error);
    }
  }

  close() {
    this.result.hidden = true;
    this.report.replaceChildren();
    this.status.textContent = "";
  }

  /** Another case was opened: gains of the one before are none of it. */
  leave() {
    this.work.leave();
    this.close();
    this.tell(null);
  }

  tuned(head) {
    const {app} = this;
    const keep = element(
      "button",
      {
        type: "button",
        id: "tune-keep",
        class: "strong",
        onclick: () => {
          app.edit(head.text);
          app.notify("The gains stand in the case now; Ctrl Z takes them back.");
        },
      },
      "Keep: put the gains into the case",
    );
    const discard = element("button", {type: "button", id: "tune-discard", onclick: () => this.close()}, "Discard");
    const rows = head.result.gains.map(one => [
      rowHead(one.key.replace(/^controller\./, "")),
      number(one.before),
      number(one.after),
      element("td", {class: "quiet"}, one.unit),
    ]);
    const gains = element("div", {class: "scroll card"}, table(["Gain", "Before", "After", "Unit"], rows, "Gains"));
    const pictures = head.moves.map((name, k) => this.pareto(name, k, head)).filter(Boolean);
    this.result.replaceChildren(
      element("p", {}, `${head.verdict}.`),
      gains,
      element("div", {class: "plots"}, ...pictures.map(one => one.figure)),
      element("p", {class: "buttons"}, keep, discard),
    );
    this.result.hidden = false;
    showReport(this.report, head.html);
  }

  /** Error against current at worst: what each choice pays for what it gets. */
  pareto(name, k, head) {
    const picture = new Picture(`${name}: error and current at worst`, {
      x: "Root mean square of the current",
      xUnit: "A",
      y: "Largest cart error",
      yUnit: "µm",
      words: "Each design at its worst machine; left and down is better.",
    });
    const one = (words, colour, all, kind = "points") => {
      const point = all[k];
      return point && point.error !== null && point.current !== null
        ? {name: words, x: [point.current], y: [1e6 * point.error], kind, colour}
        : null;
    };
    const colours = ["sky", "blue", "green", "purple"];
    const series = [
      one("before", "amber", head.before, "crosses"),
      ...head.choices.map((choice, i) =>
        one(choice.name + (choice.chosen ? ", chosen" : ""), colours[i % 4], choice.worst),
      ),
      head.choices.length ? null : one("after", "blue", head.after),
    ].filter(Boolean);
    if (!series.length) return null;
    const front = head.choices
      .map(choice => choice.worst[k])
      .filter(point => point && point.error !== null && point.current !== null)
      .sort((a, b) => a.current - b.current);
    if (front.length > 1)
      series.push({
        name: "front",
        x: front.map(point => point.current),
        y: front.map(point => 1e6 * point.error),
        colour: "axis",
        dash: [3, 3],
        quiet: true,
      });
    picture.show(/** @type {any} */ (series));
    return picture;
  }
}
