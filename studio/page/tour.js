// @ts-check
// The paper as a guided tour: at each stop a sentence, the moving machine, a figure, and a question that is answered by
// dragging.
import {element, fold, number, tell} from "./format.js";
import {showReport} from "./modes.js";
import {Row} from "./parameters.js";
import {RATES, Stage, playing} from "./player.js";
import {Plots} from "./plots.js";
import {STOPS} from "./stops.js";

/** @typedef {import("./app.js").App} App */
/** @typedef {import("./stops.js").Try} Try */

export const key = "tour",
  name = "Tour";

const RIG = "sollmann-jouaneh/";
/** A run, or the part of it that is shown, is played within at least so many seconds. */
const LEAST = 3;

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const tour = new Tour(root, app);
  app.on("view", () => {
    if (app.view === key) tour.enter().catch(error => app.notify(String(error.message || error), true));
  });
  for (const what of /** @type {const} */ (["run", "mistake", "text"])) app.on(what, () => tour.read());
}

class Tour {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    /** Texts of the cases, by their paths. @type {Map<string, string>} */
    this.stages = new Map();
    /** The case of the stop, as it was opened. */
    this.opened = "";
    /** The run with which the stop begins. @type {import("./wire.js").Answer | null} */
    this.first = null;
    /** @type {Row[]} */
    this.rows = [];
    /** Values of their parameters at the beginning. @type {Map<string, number>} */
    this.values = new Map();
    /** Whether the first run of the case is to come, and what is tried with it. */
    this.isNew = false;
    /** @type {Try} */
    this.one = {words: ""};
    /** The text whose figures are shown. */
    this.drawn = "";
    this.place = element("p", {class: "quiet"});
    this.title = element("h2", {tabindex: "-1"});
    this.words = element("p", {class: "lead"});
    this.asked = element("p", {class: "asked"});
    this.sliders = element("div", {class: "groups"});
    this.reading = element("p", {class: "reading"});
    this.answer = element("p", {class: "answer", role: "status"});
    this.tries = element("div", {class: "tries"});
    this.back = element("button", {type: "button", id: "tour-back", onclick: () => this.go(app.stop - 1)}, "Back");
    this.next = element(
      "button",
      {type: "button", id: "tour-next", class: "strong", onclick: () => this.go(app.stop + 1)},
      "Next",
    );
    this.list = element(
      "ol",
      {class: "stops"},
      ...STOPS.map((stop, k) =>
        element(
          "li",
          {},
          element("button", {type: "button", onclick: () => this.go(k)}, `${stop.figure}: ${stop.title}`),
        ),
      ),
    );
    const stage = element("section", {class: "stage-box", "aria-label": "The machine"});
    this.plots = element("div", {class: "plots"});
    this.report = element("div", {class: "report page"});
    const {play, scrub, clock} = playing(app, "tour-");
    root.append(
      element(
        "div",
        {class: "tour"},
        element(
          "div",
          {class: "tour-show"},
          element("h2", {class: "unseen"}, "The machine"),
          stage,
          element("div", {class: "transport", role: "toolbar", "aria-label": "Time"}, play, scrub, clock),
          this.plots,
          this.report,
        ),
        element(
          "div",
          {class: "tour-words"},
          this.place,
          this.title,
          this.words,
          element(
            "section",
            {class: "question", "aria-label": "Question"},
            this.asked,
            this.sliders,
            this.reading,
            this.answer,
          ),
          this.tries,
          element("p", {class: "turns"}, this.back, this.next),
          fold({}, "All stops", "All stops", this.list),
          element(
            "p",
            {class: "quiet"},
            "K. Sollmann and M. Jouaneh, Dynamic modelling of a single-axis belt-drive system, 2011: the paper that ",
            "this program recomputes, figure by figure. taut paper checks every number.",
          ),
        ),
      ),
    );
    new Stage(stage, app);
    new Plots(this.plots, app, panel => app.view === key && !this.stop.view && panel.key === this.stop.panel);
  }

  get stop() {
    return STOPS[this.app.stop];
  }

  /** Opens the stop, unless its case is open already. */
  async enter() {
    if (!this.stages.size) {
      const {head} = await this.app.wire.ask("gallery");
      this.stages = new Map(head.stages.map(stage => [stage.path, stage.text]));
    }
    if (this.app.original !== this.opened || !this.first) await this.go(this.app.stop);
  }

  /** Goes to a stop. @param {number} k */
  async go(k) {
    const {app} = this;
    app.stop = Math.max(0, Math.min(STOPS.length - 1, k));
    const {stop} = this;
    tell(this.place, `${app.stop + 1} of ${STOPS.length} · ${stop.figure}`);
    tell(this.title, stop.title);
    tell(this.words, stop.words);
    tell(this.asked, stop.question.words);
    tell(this.answer, "");
    tell(this.reading, "");
    this.sliders.replaceChildren();
    this.report.replaceChildren();
    this.back.disabled = app.stop === 0;
    this.next.disabled = app.stop === STOPS.length - 1;
    [...this.list.children].forEach((item, i) => {
      if (i === app.stop) item.setAttribute("aria-current", "step");
      else item.removeAttribute("aria-current");
    });
    this.tries.replaceChildren(
      element("button", {type: "button", id: "tour-show", onclick: () => this.open()}, "Begin again"),
      ...stop.tries.map(one => element("button", {type: "button", onclick: () => this.open(one)}, `Try ${one.words}`)),
    );
    this.open();
    this.title.focus({preventScroll: true});
    scrollTo(0, 0);
  }

  /** Opens the case of the stop, with what is to be tried. @param {Try} [one] */
  open(one = {words: ""}) {
    const {app, stop} = this,
      text = this.stages.get(RIG + stop.stage) || "";
    this.opened = stop.change ? text.replace(...stop.change) : text;
    this.first = null;
    this.rows = [];
    app.open(this.opened, {name: stop.stage, isBuiltIn: true});
    app.factor = stop.factor || 100;
    const span = stop.window ? stop.window[1] - stop.window[0] : 1;
    app.rate = RATES.find(rate => span / rate >= LEAST) || app.rate;
    this.isNew = true;
    this.one = one;
  }

  /** Begins with the first run of the case. */
  begin() {
    const {app, stop} = this;
    this.first = app.run;
    this.isNew = false;
    const parameters = stop.question.keys.map(key => app.parameters.find(one => one.key === key)).filter(Boolean);
    this.values = new Map(parameters.map(({key, value}) => [key, value]));
    this.rows = parameters.map(parameter => new Row(parameter, app, "t-"));
    this.sliders.replaceChildren(...this.rows.map(row => row.element));
    if (this.one.experiment) app.choose(this.one.experiment);
    if (stop.window) app.look(stop.window);
    if (stop.at !== undefined) app.seek(stop.at);
    for (const [key, value] of this.one.set || []) app.drag(key, value);
    app.drop();
    app.isPlaying = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    app.tell("play");
  }

  /** Reads from the run what the question is about. */
  read() {
    const {app, stop} = this;
    if (app.view !== key || app.original !== this.opened) return;
    // What is changed here is nobody's work.
    app.isTouched = false;
    if (!app.run) return;
    // A run that comes late may be of the stop before.
    if (this.isNew && app.isCurrent) this.begin();
    if (!this.first) return;
    for (const row of this.rows) {
      row.parameter = app.parameters.find(one => one.key === row.parameter.key) || row.parameter;
      row.show();
    }
    const value = key => (app.parameters.find(one => one.key === key) || {value: NaN}).value,
      ratio = key => value(key) / (this.values.get(key) || NaN);
    const seen = {run: app.run, first: this.first, ratio, value},
      [what, size, unit] = stop.question.reading(seen);
    const reading = isFinite(size) ? `${what} ${number(size, 3)} ${unit}.` : stop.question.none || "";
    tell(this.reading, app.mistake ? String(app.mistake.what) : reading);
    const isAsked = app.experiment === this.first.head.experiment;
    if (isAsked && stop.question.isAnswered(seen)) tell(this.answer, stop.question.answer);
    if (stop.view) this.friction();
  }

  /** The figure of the cart among those of the view of frequencies that a stop is about. */
  friction() {
    const {app, stop} = this,
      speeds = (this.first && this.first.columns.get("cart_speed")) || new Float64Array(1),
      speed = speeds.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    const text = app.text;
    if (text === this.drawn && this.report.firstChild) return;
    this.drawn = text;
    app.wire.newest(
      "modes",
      () => ({text: app.text, speed}),
      answer => {
        if (!answer || this.stop !== stop) return;
        const whole = element("div", {});
        whole.innerHTML = answer.head.html;
        const heading = [...whole.querySelectorAll("h2")].find(one => one.textContent === stop.panel);
        const parts = [];
        for (let at = heading && heading.nextElementSibling; at && at.tagName !== "H2"; at = at.nextElementSibling)
          if (at.tagName === "FIGURE" && at.textContent.startsWith("Cart")) parts.push(at.outerHTML);
        showReport(this.report, parts.join(""));
      },
    );
  }
}
