// @ts-check
// Many machines at once: histograms and scatter plots as runs come, and brushing: what is chosen in one figure is shown
// in all, with its trajectories and parameters.
import {element, number, rowHead, table} from "./format.js";
import {Picture, histogram} from "./picture.js";
import {errorPlace} from "./drop.js";
import {LongWork} from "./long-work.js";

/** @typedef {import("./app.js").App} App */

export const key = "sweep",
  name = "Sweep";

const TRACES = 30,
  LISTED = 100;
const DESIGNS = [
  ["sobol", "Sobol' points"],
  ["latin-hypercube", "Latin hypercube"],
  ["random", "random"],
];
const MACHINE = /^(motor|amplifier|(left_|right_|cart_)?drive|drive_pulley|idler_pulley|cart|bridge|belt)\./;

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const view = new Sweep(root, app);
  app.on("view", () => {
    if (app.view === key) view.refresh();
  });
  app.on("opened", () => {
    view.leave();
    view.shape = "";
    if (app.view === key) view.refresh();
  });
}

class Sweep {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.shape = "";
    /** @type {any[]} */
    this.headings = [];
    /** Rows of all columns, in the order in which they came. @type {number[][]} */
    this.rows = [];
    /** The ranges that were brushed, by figure. @type {Map<string, any>} */
    this.brushes = new Map();
    this.vary = element("div", {class: "choices", role: "group", "aria-label": "What varies"});
    this.share = element("input", {type: "number", id: "share", min: 0.1, max: 90, step: 1, value: 20});
    this.runs = element("input", {type: "number", id: "runs", min: 8, max: 20000, step: 1, value: 500});
    this.design = element(
      "select",
      {id: "design"},
      ...DESIGNS.map(([value, words]) => element("option", {value}, words)),
    );
    this.go = element("button", {type: "button", id: "sweep", class: "strong", onclick: () => this.sweep()}, "Sweep");
    this.work = new LongWork(app.wire, [this.go], {id: "sweep-stop", words: "Stop, keep what is done"});
    this.status = element("p", {class: "quiet", role: "status", id: "sweep-status"});
    this.trouble = errorPlace();
    this.group = element("select", {id: "sweep-group", onchange: () => this.figures()});
    this.figure = element("select", {
      id: "sweep-figure",
      onchange: () => {
        this.brushes.clear();
        this.draw();
      },
    });
    this.input = element("select", {
      id: "sweep-input",
      onchange: () => {
        this.brushes.clear();
        this.draw();
      },
    });
    this.curve = element("select", {id: "sweep-curve", onchange: () => this.traces()});
    this.histogram = new Picture("Histogram", {x: "", y: "Runs", words: "How the figure is spread."}, area =>
      this.brush("histogram", area),
    );
    this.scatter = new Picture("Scatter", {x: "", y: "", words: "The figure over a parameter; a dot is a run."}, area =>
      this.brush("scatter", area),
    );
    this.inputs = new Picture("Parameter", {x: "", y: "Runs", words: "How the parameter is spread."}, area =>
      this.brush("inputs", area),
    );
    this.paths = new Picture("Trajectories of the chosen runs", {
      x: "Time",
      xUnit: "s",
      y: "",
      words: "One line for each chosen run.",
    });
    this.chosen = element("p", {class: "quiet", role: "status", id: "chosen"});
    this.table = element("div", {class: "scroll card", tabindex: "0", role: "group", "aria-label": "Chosen runs"});
    const fields = (...all) => element("p", {class: "fields"}, ...all);
    this.shown = element(
      "div",
      {hidden: true},
      fields(
        element("label", {for: "sweep-group"}, "Experiment: ", this.group),
        element("label", {for: "sweep-figure"}, "Figure: ", this.figure),
        element("label", {for: "sweep-input"}, "Parameter: ", this.input),
      ),
      element(
        "p",
        {class: "quiet"},
        "Drag over a figure to choose runs; a click clears. What is chosen in several figures is "
          + "chosen in all of them.",
      ),
      element(
        "div",
        {class: "plots"},
        this.histogram.figure,
        this.scatter.figure,
        this.inputs.figure,
        this.paths.figure,
      ),
      this.chosen,
      fields(element("label", {for: "sweep-curve"}, "Curve: ", this.curve)),
      this.table,
    );
    root.append(
      element("h2", {}, "Sweep"),
      element(
        "p",
        {class: "quiet"},
        "Many machines, each a little different: how far do the figures spread, and what do they depend on?",
      ),
      element("h3", {}, "What varies"),
      this.vary,
      fields(
        element("label", {for: "share"}, "by ± ", this.share, " %"),
        element("label", {for: "runs"}, "Runs: ", this.runs),
        element("label", {for: "design"}, "Points: ", this.design),
      ),
      element("p", {class: "buttons"}, this.go, this.work.stopButton),
      this.status,
      this.trouble,
      this.shown,
    );
  }

  refresh() {
    const machine = this.app.parameters.filter(one => MACHINE.test(one.key) && one.value !== 0 && one.free !== false);
    const shape = machine.map(one => one.key).join(" ");
    if (shape === this.shape) return;
    this.shape = shape;
    const own = /^\[sweep/m.test(this.app.text);
    const box = (value, words, checked) =>
      element("label", {class: "choice"}, element("input", {type: "checkbox", value, checked}), " ", words);
    this.own = own ? element("input", {type: "checkbox", id: "own-sweep", checked: true}) : null;
    const written = machine.filter(one => one.written !== null);
    this.vary.replaceChildren(
      ...[
        this.own ? element("label", {class: "choice"}, this.own, " as [sweep] of the case says") : null,
        box("all", "all that can be off", true),
        ...written.map(one => box(one.key, one.key, false)),
      ].filter(Boolean),
    );
  }

  body() {
    if (this.own && this.own.checked) return this.app.body();
    const share = `${Number(this.share.value) || 20} %`,
      vary = {};
    const chosen = [...this.vary.querySelectorAll("input:checked")]
      .map(input => input.value)
      .filter(value => value !== "on");
    const names = chosen.filter(value => value !== "all");
    for (const one of names.length ? names : chosen) vary[one] = share;
    return {
      ...this.app.body(),
      plan: {
        design: this.design.value,
        runs: Math.max(1, Math.min(20000, Math.round(Number(this.runs.value)) || 500)),
        vary,
      },
    };
  }

  async sweep() {
    const {app} = this;
    this.trouble.tell(null);
    this.rows = [];
    this.headings = [];
    this.brushes.clear();
    for (const one of [this.histogram, this.scatter, this.inputs]) one.brush = null;
    this.paths.show([]);
    this.table.replaceChildren();
    this.asked = this.body();
    this.status.textContent = "Running…";
    const begun = performance.now();
    try {
      const {head, columns} = await this.work.ask("sweep", this.asked, step => {
        if (step.headings) this.begin(step.headings);
        for (const row of step.rows) this.rows.push(row.map(value => (value >= 1e299 ? NaN : value)));
        this.status.textContent = `${this.rows.length} of ${step.runs} runs`;
        if (step.rows.length) this.draw();
      });
      if (!this.headings.length) this.begin(head.headings);
      this.experiments = head.experiments;
      // Moves have no trajectories here.
      this.paths.figure.hidden = this.curve.parentElement.hidden = !this.experiments.length;
      const all = [...columns.values()];
      this.rows = Array.from({length: head.done}, (_, k) => all.map(column => column[k]));
      this.status.textContent =
        `${head.done} runs${head.stopped ? ` of ${head.runs}, stopped,` : ""} in `
        + `${number((performance.now() - begun) / 1000, 3)} s.`;
      app.say(this.status.textContent);
      this.draw();
      this.traces();
    } catch (error) {
      this.status.textContent = "";
      this.trouble.tell(error);
    }
  }

  /** Another case was opened: what was computed of the one before says nothing of it. */
  leave() {
    this.work.leave();
    this.shown.hidden = true;
    this.status.textContent = "";
    this.trouble.tell(null);
  }

  // ---- Figures

  begin(headings) {
    this.headings = headings;
    this.shown.hidden = false;
    const groups = [...new Set(headings.map(one => one.group).filter(Boolean))];
    this.group.replaceChildren(...groups.map(name => element("option", {value: name}, name)));
    const inputs = headings.map((one, k) => [one, k]).filter(([one]) => one.kind === "input");
    this.input.replaceChildren(...inputs.map(([one, k]) => element("option", {value: k}, one.name)));
    this.figures();
  }

  figures() {
    const before = this.figure.value;
    const own = this.headings
      .map((one, k) => [one, k])
      .filter(([one]) => one.kind === "figure" && one.group === this.group.value);
    this.figure.replaceChildren(...own.map(([one, k]) => element("option", {value: k}, one.words || one.name)));
    if (own.some(([, k]) => String(k) === before)) this.figure.value = before;
    this.brushes.clear();
    this.draw();
    if (this.rows.length && !this.work.isRunning) this.traces();
  }

  /** The runs that every brush holds. */
  selected() {
    const f = Number(this.figure.value),
      p = Number(this.input.value);
    const within = (value, [a, b]) => value >= a && value <= b;
    const tests = [];
    const {histogram: h, scatter: s, inputs: i} = Object.fromEntries(this.brushes);
    if (h) tests.push(row => within(row[f], h.x));
    if (s) tests.push(row => within(row[p], s.x) && within(row[f], s.y));
    if (i) tests.push(row => within(row[p], i.x));
    return tests.length ? this.rows.filter(row => tests.every(test => test(row))) : this.rows;
  }

  brush(which, area) {
    if (area) this.brushes.set(which, area);
    else this.brushes.delete(which);
    this.draw();
    this.traces();
  }

  draw() {
    const f = Number(this.figure.value),
      p = Number(this.input.value),
      figure = this.headings[f],
      input = this.headings[p];
    if (!figure || !input) return;
    const words = figure.words || figure.name,
      chosen = this.selected(),
      isAll = chosen === this.rows;
    const bars = (picture, place, heading, words) => {
      const all = this.rows.map(row => row[place]),
        whole = histogram(all),
        n = whole.x.length;
      const range =
        n > 1 ? /** @type {[number, number]} */ ([whole.x[0], whole.x[n - 1] + whole.x[1] - whole.x[0]]) : undefined;
      const part =
        isAll || n < 2
          ? null
          : histogram(
              chosen.map(row => row[place]),
              n,
              range,
            );
      picture.show(
        [
          {name: "all runs", ...whole, kind: "bars", colour: part ? "axis" : "blue", alpha: part ? 0.45 : 0.8},
          ...(part ? [{name: "chosen", ...part, kind: "bars", colour: "blue", alpha: 0.85}] : []),
        ],
        {x: words, xUnit: heading.unit, xRange: range},
      );
      picture.head.textContent = words;
    };
    bars(this.histogram, f, figure, words);
    bars(this.inputs, p, input, input.name);
    const dots = (rows, name, colour, alpha) => ({
      name,
      x: rows.map(row => row[p]),
      y: rows.map(row => row[f]),
      kind: /** @type {const} */ ("points"),
      colour,
      alpha,
    });
    const others = isAll ? null : new Set(chosen);
    this.scatter.show(
      isAll
        ? [dots(this.rows, "all runs", "blue", 0.7)]
        : [
            dots(
              this.rows.filter(row => !(/** @type {Set<any>} */ (others).has(row))),
              "others",
              "axis",
              0.5,
            ),
            dots(chosen, "chosen", "blue", 0.9),
          ],
      {x: input.name, xUnit: input.unit, y: words, yUnit: figure.unit},
    );
    this.scatter.head.textContent = `${words} over ${input.name}`;
    this.chosen.textContent = isAll
      ? `${this.rows.length} runs, none chosen.`
      : `${chosen.length} of ${this.rows.length} runs chosen.`;
    if (!this.work.isRunning) this.list(chosen, figure, f);
  }

  /** The chosen runs with their parameters. */
  list(chosen, figure, f) {
    const inputs = this.headings.map((one, k) => [one, k]).filter(([one]) => one.kind === "input");
    const rows = chosen
      .slice(0, LISTED)
      .map(row => [rowHead(number(row[0], 7)), number(row[f]), ...inputs.map(([, k]) => number(row[k]))]);
    const unit = one => (one.unit ? ` (${one.unit})` : "");
    const left = chosen.length - rows.length;
    const head = ["Run", (figure.words || figure.name) + unit(figure), ...inputs.map(([one]) => one.name + unit(one))];
    const caption = `Runs and their parameters${left > 0 ? `; ${left} more are not listed` : ""}`;
    this.table.replaceChildren(table(head, rows, caption));
  }

  /** Trajectories of the chosen runs, spread over all of them. */
  traces() {
    if (!this.rows.length || !this.asked || !this.experiments || !this.experiments.length) return;
    const {app} = this;
    app.wire.newest(
      "traces",
      () => {
        const chosen = this.selected(),
          thin = Math.max(1, chosen.length / TRACES);
        const runs = [];
        for (let k = 0; k < chosen.length && runs.length < TRACES; k += thin) runs.push(chosen[Math.floor(k)][0]);
        return {...this.asked, runs, experiment: Math.max(0, this.experiments.indexOf(this.group.value))};
      },
      (answer, error) => {
        if (!answer) {
          this.trouble.tell(error);
          return;
        }
        const {panels} = answer.head,
          curves = panels.flatMap(panel => panel.curves.map(curve => ({panel, curve})));
        const names = curves.map(({panel, curve}) => `${panel.title}: ${curve.name}`),
          before = this.curve.value;
        if (names.join() !== this.names) {
          this.names = names.join();
          this.curve.replaceChildren(...curves.map((one, k) => element("option", {value: k}, names[k])));
          const usual = curves.findIndex(({curve}) => curve.key === "cart_position");
          this.curve.value = before && curves[before] ? before : String(Math.max(0, usual));
        }
        const picked = curves[Number(this.curve.value)];
        if (!picked) {
          this.paths.show([]);
          return;
        }
        const series = [];
        for (const [column, y] of answer.columns) {
          const [run, ...rest] = column.split(":");
          if (rest.join(":") !== picked.curve.key) continue;
          const scale = picked.panel.scale;
          series.push({
            name: `run ${run}`,
            x: answer.columns.get(`${run}:time`),
            y: scale === 1 ? y : Float64Array.from(y, value => value * scale),
            colour: "blue",
            alpha: 0.45,
            quiet: series.length > 5,
          });
        }
        this.paths.show(/** @type {any} */ (series), {y: picked.curve.name, yUnit: picked.panel.unit});
        this.paths.head.textContent = `${picked.panel.title}: ${series.length} runs`;
        this.paths.legend.hidden = true;
      },
    );
  }
}
