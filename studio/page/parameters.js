// @ts-check
// Every number of the case as a field and a slider, by group, with search.
import {element, number} from "./format.js";

/** @typedef {import("./app.js").App} App */

const GROUPS = {
  motor: "Motor", amplifier: "Amplifier", drive: "Drive", drive_pulley: "Drive pulley", idler_pulley: "Idler pulley", cart: "Cart",
  bridge: "Bridge", belt: "Belt", travel: "Travel", encoder: "Encoder", experiment: "Experiment", controller: "Controller",
  left_drive: "Left drive", right_drive: "Right drive", measurement: "Recorder", move: "Move", fit: "Fit", tune: "Tuning", sweep: "Sweep",
};
const STEPS = 1000;

export class Parameters {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.search = element("input", {type: "search", id: "find", placeholder: "Find a parameter", "aria-label": "Find a parameter", oninput: () => this.filter()});
    this.groups = element("div", {class: "groups"});
    this.none = element("p", {class: "quiet", hidden: true}, "No parameter has that in its name.");
    root.append(this.search, this.none, this.groups);
    /** @type {Map<string, Row>} */
    this.rows = new Map();
    this.shape = "";
    app.on("run", () => this.build());
    app.on("mistake", () => { for (const row of this.rows.values()) row.show(); });
  }

  build() {
    const {parameters, experiment} = this.app;
    const own = parameters.filter(({key}) => !key.startsWith("experiment.") || key.startsWith(`experiment.${experiment}.`));
    const shape = own.map(({key, written}) => key + (written === null)).join(" ") + this.app.original;
    if (shape !== this.shape) {
      this.shape = shape;
      this.rows.clear();
      /** @type {Map<string, any[]>} */
      const groups = new Map();
      for (const parameter of own) {
        const group = parameter.key.split(".")[0];
        groups.set(group, [...(groups.get(group) || []), parameter]);
      }
      this.groups.replaceChildren(...[...groups].map(([group, parameters]) => this.group(group, parameters)));
      this.filter();
    }
    for (const parameter of own) {
      const row = this.rows.get(parameter.key);
      if (row) { row.parameter = parameter; row.show(); }
    }
  }

  group(group, parameters) {
    const rows = parameters.map(parameter => {
      const row = new Row(parameter, this.app);
      this.rows.set(parameter.key, row);
      return row;
    });
    const unwritten = rows.filter(row => row.parameter.written === null), written = rows.filter(row => row.parameter.written !== null);
    const more = unwritten.length
      ? element("details", {class: "more"}, element("summary", {}, `${unwritten.length} more that stand at their default`), ...unwritten.map(row => row.element)) : null;
    return element("details", {class: "group", open: written.length > 0}, element("summary", {}, GROUPS[group] || group), ...written.map(row => row.element), more);
  }

  filter() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let found = 0;
    for (const row of this.rows.values()) {
      const isThere = words.every(word => row.text.includes(word));
      row.element.hidden = !isThere;
      if (isThere) found++;
    }
    for (const group of this.groups.querySelectorAll("details")) {
      group.hidden = !group.querySelector(".row:not([hidden])");
      if (words.length && !group.hidden) group.open = true;
    }
    this.none.hidden = found > 0;
  }
}

export class Row {
  /** @param {any} parameter @param {App} app @param {string} [prefix] of its id */
  constructor(parameter, app, prefix = "p-") {
    this.parameter = parameter;
    this.app = app;
    const {key, symbol, unit, sentence, allowed} = parameter;
    const name = nameOf(key), id = prefix + key.replace(/[^\w]/g, "-");
    this.text = [key, name, symbol, sentence].join(" ").toLowerCase();
    this.home = parameter.value;
    /** The value that field and slider show, none while they are used. */
    this.shown = NaN;
    this.field = element("input", {type: "text", id, inputmode: "decimal", autocomplete: "off", spellcheck: "false", "aria-describedby": id + "-told",
      onchange: () => this.typed(), onkeydown: event => { if (event.key === "Escape") this.back(); }});
    this.slider = element("input", {type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${name}, slider`,
      oninput: () => this.moved(), onchange: () => app.drop(), onpointerdown: () => this.span()});
    this.told = element("p", {class: "told", id: id + "-told"}, `${sentence} `, element("span", {class: "quiet"}, `${key}; ${allowed}`));
    this.element = element("div", {class: "row", "data-key": key},
      element("label", {for: id}, symbol ? element("b", {}, symbol) : null, element("span", {}, name)),
      element("span", {class: "entry-field"}, this.field, element("span", {class: "unit"}, unit)), this.slider, this.told);
    this.span();
  }

  // What the slider reaches: a tenth to ten times the value it had, or the whole range where that is small.
  span() {
    const {value, low, high, example, whole} = this.parameter, has = v => v !== null && v !== undefined && isFinite(v);
    const size = Math.abs(value) || Math.abs(example) || 1;
    this.log = value > 0 && !(has(high) && high <= 10 * value && has(low)) && !whole && !this.parameter.key.includes(".travel");
    if (this.log) { this.low = Math.max(value / 10, has(low) && low > 0 ? low : 0); this.high = Math.min(value * 10, has(high) ? high : Infinity); return; }
    this.low = has(low) && high !== null && high - low <= 20 * size ? low : Math.max(has(low) ? low : -Infinity, value < 0 || low === null || low < 0 ? value - 3 * size : 0);
    this.high = has(high) && high <= 20 * size ? high : value + 3 * size;
  }

  moved() {
    const share = Number(this.slider.value) / STEPS;
    let value = this.log ? this.low * (this.high / this.low) ** share : this.low + share * (this.high - this.low);
    if (this.parameter.whole) value = Math.round(value);
    // Four digits are finer than a slider is moved.
    value = Number(value.toPrecision(4));
    this.field.value = String(value);
    this.app.drag(this.parameter.key, value);
  }

  typed() {
    const value = Number(this.field.value.trim().replace(",", ".").replace("\u2212", "-"));
    if (!isFinite(value) || this.field.value.trim() === "") {
      this.field.setAttribute("aria-invalid", "true");
      this.shown = NaN;
      return;
    }
    this.app.drag(this.parameter.key, value);
    this.app.drop();
  }

  /** The value as it was before it was typed over. */
  back() {
    this.field.removeAttribute("aria-invalid");
    this.field.value = asTyped(this.parameter.value);
  }

  show() {
    const {value, key} = this.parameter, {mistake, pending} = this.app;
    const isWrong = Boolean(mistake && pending.has(key));
    this.field.toggleAttribute("aria-invalid", isWrong);
    if (isWrong) this.field.setAttribute("aria-invalid", "true");
    if (pending.has(key)) { this.shown = NaN; return; }
    if (value === this.shown) return;
    this.shown = document.activeElement === this.field || document.activeElement === this.slider ? NaN : value;
    if (document.activeElement !== this.field) this.field.value = asTyped(value);
    if (document.activeElement !== this.slider) {
      if (value < this.low || value > this.high) this.span();
      const share = this.log ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
      this.slider.value = String(Math.round(STEPS * Math.max(0, Math.min(1, share))));
    }
    const words = `${number(value, 6)} ${this.parameter.unit}`;
    this.slider.setAttribute("aria-valuetext", words);
  }
}

/** A value as a field has it. @param {number} value */
const asTyped = value => String(Number(value.toPrecision(6)));

/** A key as words: `cart.friction.viscous` is "friction viscous" in the group Cart. @param {string} key */
function nameOf(key) {
  const parts = key.split(".").slice(1).filter(part => !(/^\d+$/.test(part) && key.startsWith("experiment.")));
  const words = parts.map(part => (/^\d+$/.test(part) ? String(Number(part) + 1) : part.replace(/_/g, " ")));
  return words.join(" ") || key;
}
