// @ts-check
// Every number of the case as a field and a slider, by group, with search.
import {wordsOf} from "./drop.js";
import {element, fold, number, put, tell} from "./format.js";
import {keep, recall} from "./layout.js";

/** @typedef {import("./app.js").App} App */

const GROUPS = {
  motor: "Motor",
  amplifier: "Amplifier",
  drive: "Drive",
  drive_pulley: "Drive pulley",
  idler_pulley: "Idler pulley",
  cart: "Cart",
  bridge: "Bridge",
  belt: "Belt",
  travel: "Travel",
  encoder: "Encoder",
  experiment: "Experiment",
  controller: "Controller",
  left_drive: "Left drive",
  right_drive: "Right drive",
  cart_drive: "Cart drive",
  measurement: "Recorder",
  move: "Move",
  fit: "Fit",
  tune: "Tuning",
  sweep: "Sweep",
};
const STEPS = 1000;
/** Width of a slider's thumb in pixels, as browsers draw it. */
const THUMB = 16;
/** How the ids of fields begin, with the attribute of their rows. A parameter may have a row among those of its group,
 * among those changed last and the favourites, in the view of gains, and in the tour. */
const PLACES = {"p-": "data-key", "r-": "data-again", "f-": "data-favourite", "g-": "data-key", "t-": "data-tour"};

/** Ranges of sliders that somebody chose, by key. @type {Map<string, [number, number]>} */
const ranges = new Map();

/** Keys of favourites, the newest first, which the browser remembers. @type {string[]} */
let favourites = [recall("favourites")].flat().filter(key => typeof key === "string");

/** Makes a parameter a favourite, or takes it from them. @param {string} key */
function favour(key) {
  const left = favourites.filter(other => other !== key);
  favourites = left.length < favourites.length ? left : [key, ...favourites];
  keep("favourites", favourites.length ? favourites : undefined);
}

/** Rows of some parameters beside those in their groups. */
class Shelf {
  /** @param {string} name @param {string} prefix @param {Parameters} parameters */
  constructor(name, prefix, parameters) {
    this.parameters = parameters;
    this.prefix = prefix;
    this.root = fold({class: "group", open: true, hidden: true}, name, name);
    /** @type {Map<string, Row>} */
    this.rows = new Map();
  }

  /** Shows the rows of these keys. @param {string[]} keys */
  fill(keys) {
    for (const [key, row] of this.rows) {
      if (keys.includes(key)) continue;
      row.element.remove();
      this.rows.delete(key);
    }
    for (const key of keys.toReversed()) {
      if (this.rows.has(key)) continue;
      const {parameter} = /** @type {Row} */ (this.parameters.rows.get(key));
      const row = new Row(parameter, this.parameters.app, this.prefix);
      this.rows.set(key, row);
      this.root.firstElementChild.after(row.element);
      row.show();
    }
    this.tell();
  }

  /** Shows it where it has rows and nobody searches. */
  tell() {
    this.root.hidden = !this.rows.size || Boolean(this.parameters.search.value.trim());
  }
}

export class Parameters {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.root = root;
    this.app = app;
    this.search = element("input", {
      type: "search",
      id: "find",
      placeholder: "Find a parameter",
      "aria-label": "Find a parameter",
      oninput: () => this.filter(),
    });
    this.groups = element("div", {class: "groups"});
    this.none = element("p", {class: "quiet", hidden: true}, "No parameter has that in its name.");
    /** @type {Map<string, Row>} */
    this.rows = new Map();
    /** What was moved last; a narrow page shows it. */
    this.recent = new Shelf("Changed last", "r-", this);
    this.recent.root.classList.add("recent");
    this.favourites = new Shelf("Favourites", "f-", this);
    /** Any key, also one that has no row. */
    this.any = element("input", {
      type: "text",
      id: "any",
      placeholder: "cart.load = 1 N",
      autocomplete: "off",
      spellcheck: "false",
    });
    const form = element(
      "form",
      {
        class: "any",
        onsubmit: event => {
          event.preventDefault();
          this.set();
        },
      },
      element("label", {for: "any"}, "Set any KEY = VALUE"),
      this.any,
      element("button", {type: "submit"}, "Set"),
    );
    root.append(this.search, this.none, this.recent.root, this.favourites.root, this.groups, form);
    root.addEventListener("favourite", () => this.remind());
    this.shape = "";
    app.on("run", () => {
      this.build();
      this.remind();
    });
    app.on("mistake", () => {
      this.show();
      if (app.mistake && app.mistake.key) app.say(this.named(app.mistake));
    });
    app.on("text", () => {
      this.show();
      this.remind();
    });
  }

  show() {
    for (const row of this.all()) row.show();
  }

  /** Writes what was typed as `KEY = VALUE` into the case. */
  async set() {
    const {app, any} = this,
      [key, ...rest] = any.value.split("=");
    if (!any.value.trim()) return;
    try {
      const change = rest.length ? `${key.trim()}=${rest.join("=").trim()}` : any.value.trim();
      const {head} = await app.wire.ask("run", {...app.body(), changes: [change]});
      app.edit(head.text);
      any.value = "";
    } catch (error) {
      app.notify(wordsOf(error), true);
    }
  }

  /** All rows. @returns {Row[]} */
  all() {
    return [this.rows, this.recent.rows, this.favourites.rows].flatMap(rows => [...rows.values()]);
  }

  /** Puts what was moved last, and favourites, first. What is on the screen stays where it is: a finger may be on
   * it. */
  remind() {
    const {app, root} = this,
      known = (/** @type {string[]} */ keys) => keys.filter(key => this.rows.has(key));
    const shelves = /** @type {[Shelf, string[]][]} */ ([
      [this.recent, known(app.moved)],
      [this.favourites, known(favourites)],
    ]);
    const isSame = shelves.every(([shelf, keys]) => keys.join() === [...shelf.rows.keys()].reverse().join());
    if (app.gesture || isSame) return;
    const still = root.contains(document.activeElement) ? /** @type {Element} */ (document.activeElement) : this.groups;
    const place = () => still.getBoundingClientRect().top,
      before = place();
    for (const [shelf, keys] of shelves) shelf.fill(keys);
    if (!still.isConnected) return;
    root.scrollTop += place() - before;
    scrollBy(0, place() - before);
  }

  /** Whether there is a field for a key. @param {string | null} key */
  has(key) {
    return this.rows.has(key || "");
  }

  /** Goes to the field of a key, wherever it is hidden. @param {string} key */
  go(key) {
    const row = /** @type {Row} */ (this.rows.get(key));
    this.search.value = "";
    this.filter();
    for (let at = row.element.closest("details"); at; at = at.parentElement.closest("details")) at.open = true;
    row.field.focus();
  }

  /** A mistake, with the parameter by the name that its field has. @param {any} mistake */
  named(mistake) {
    const row = this.rows.get(mistake.key || "");
    return wordsOf({
      mistake: row ? {...mistake, what: mistake.what.replace(`${mistake.key}: `, `${row.title}: `)} : mistake,
    });
  }

  build() {
    const {parameters, experiment} = this.app;
    const own = parameters.filter(
      ({key}) => !key.startsWith("experiment.") || key.startsWith(`experiment.${experiment}.`),
    );
    const shape = own.map(({key, written}) => key + (written === null)).join(" ") + this.app.original;
    if (shape !== this.shape) {
      this.shape = shape;
      this.recent.fill([]);
      this.favourites.fill([]);
      this.rows.clear();
      /** @type {Map<string, any[]>} */
      const groups = new Map();
      for (const parameter of own) {
        const group = groupOf(parameter.key);
        groups.set(group, [...(groups.get(group) || []), parameter]);
      }
      this.groups.replaceChildren(...[...groups].map(([group, parameters]) => this.group(group, parameters)));
      this.filter();
    }
    const parameterOf = new Map(own.map(parameter => [parameter.key, parameter]));
    for (const row of this.all()) {
      row.parameter = parameterOf.get(row.parameter.key) || row.parameter;
      row.show();
    }
  }

  group(group, parameters) {
    const rows = parameters.map(parameter => {
      const row = new Row(parameter, this.app);
      this.rows.set(parameter.key, row);
      return row;
    });
    const unwritten = rows.filter(row => row.parameter.written === null),
      written = rows.filter(row => row.parameter.written !== null);
    const name = GROUPS[group] || group,
      left = `${unwritten.length} more that stand at their default`;
    const more = unwritten.length
      ? fold({class: "more"}, left, `${name}, ${left}`, ...unwritten.map(row => row.element))
      : null;
    return fold({class: "group", open: written.length > 0}, name, name, ...written.map(row => row.element), more);
  }

  filter() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let found = 0;
    for (const shelf of [this.recent, this.favourites]) shelf.tell();
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

/** Whether a pointer is pressed: until it is let go, nothing may move away from under it. */
let isPressed = false;
for (const [kind, now] of /** @type {const} */ ([
  ["pointerdown", true],
  ["pointerup", false],
  ["pointercancel", false],
]))
  addEventListener(
    kind,
    () => {
      isPressed = now;
    },
    true,
  );

/** Does something when no pointer is pressed, after the click of the one that is. @param {() => void} work */
function unpressed(work) {
  if (!isPressed) work();
  else for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, () => setTimeout(work), {once: true});
}

export class Row {
  /** @param {any} parameter @param {App} app @param {string} [prefix] of its id */
  constructor(parameter, app, prefix = "p-") {
    this.parameter = parameter;
    this.app = app;
    const {key, unit, sentence, allowed} = parameter;
    const symbol = symbolOf(parameter),
      id = prefix + key.replace(/[^\w]/g, "-"),
      isAway = "rft".includes(prefix[0]);
    this.title = `${GROUPS[groupOf(key)] || groupOf(key)}, ${nameOf(parameter)}`;
    // Outside its group it is named with it.
    const name = isAway ? this.title : nameOf(parameter);
    this.text = [key, name, symbol, sentence].join(" ").toLowerCase();
    this.home = parameter.value;
    /** The value that field and slider show, none while they are used. */
    this.shown = NaN;
    /** Its attribute `data-typed` says that somebody is typing. */
    this.field = element("input", {
      type: "text",
      id,
      inputmode: "decimal",
      autocomplete: "off",
      spellcheck: "false",
      "aria-describedby": `${id}-unit ${id}-told`,
      oninput: () => {
        this.field.dataset.typed = "";
      },
      onchange: () => this.typed(),
      onblur: () => {
        delete this.field.dataset.typed;
        this.show();
      },
      onkeydown: event => {
        if (event.key === "Escape") this.back();
      },
    });
    /** The position of the slider's thumb, in steps. */
    this.at = 0;
    /** How many steps the thumb is ahead of the pointer that holds it. */
    this.grip = 0;
    /** What holds the thumb: meanwhile neither it nor the range moves by itself. @type {"" | "pointer" | "key"} */
    this.held = "";
    /** It was left at an end whose value is still awaited. */
    this.isLeft = false;
    this.slider = element("input", {
      type: "range",
      min: 0,
      max: STEPS,
      step: 1,
      "aria-label": name,
      oninput: () => this.moved(),
      onpointerdown: event => this.hold(event),
      onpointerup: () => this.release(),
      onpointercancel: () => this.release(),
      onkeydown: () => {
        this.held = "key";
        this.grip = 0;
      },
      onkeyup: () => this.release(),
      onblur: () => this.leave(),
      // A key that repeats ends no change before it is let go.
      onchange: () => {
        if (this.held !== "key") this.release();
      },
    });
    this.told = element(
      "p",
      {class: "told", id: id + "-told"},
      `${sentence} `,
      element("span", {class: "quiet"}, `In the case text: ${key}; ${allowed}.`),
    );
    this.element = element(
      "div",
      {
        class: "row",
        [PLACES[prefix]]: key,
        onfocusin: () => this.element.classList.add("used"),
        onfocusout: event =>
          unpressed(() => {
            const {element} = this;
            if (!element.contains(event.relatedTarget) && !element.contains(document.activeElement))
              element.classList.remove("used");
          }),
      },
      element(
        "label",
        {for: id},
        symbol ? element("b", {}, symbol) : null,
        symbol ? " " : null,
        element("span", {}, name),
      ),
      element("span", {class: "entry-field"}, this.field, element("span", {class: "unit", id: id + "-unit"}, unit)),
      this.slider,
      this.told,
      this.tools(name),
    );
    this.span();
  }

  /** What is done seldom: shown while the row is used. @param {string} name @returns {HTMLElement} */
  tools(name) {
    const {key} = this.parameter;
    this.star = element(
      "button",
      {
        type: "button",
        class: "star",
        "aria-label": `Favourite: ${name}`,
        title: "Favourites stand first",
        onclick: () => {
          favour(key);
          this.show();
          this.star.dispatchEvent(new Event("favourite", {bubbles: true}));
        },
      },
      "☆",
    );
    this.reset = element(
      "button",
      {
        type: "button",
        onclick: () => {
          this.app.drag(key, this.home);
          this.app.drop();
        },
      },
      `Back to ${asTyped(this.home)}`,
    );
    const end = words =>
      element("input", {
        type: "number",
        step: "any",
        "aria-label": `${words} of the slider, ${name}`,
        onchange: () => this.reach(),
      });
    this.from = end("Lower end");
    this.to = end("Upper end");
    return element(
      "div",
      {class: "row-tools"},
      this.star,
      this.reset,
      element("span", {}, "Slider from ", this.from, " to ", this.to),
    );
  }

  /** The range that somebody chose; none where an end is emptied. */
  reach() {
    const {key, low, high} = this.parameter,
      ends = [this.from.value, this.to.value].map(Number);
    const [from, to] = [Math.max(ends[0], low ?? -Infinity), Math.min(ends[1], high ?? Infinity)];
    if (this.from.value !== "" && this.to.value !== "" && from < to) ranges.set(key, [from, to]);
    else ranges.delete(key);
    this.span();
    this.place(this.parameter.value);
  }

  // What the slider reaches: a tenth to ten times the value it had, or the whole range where that is small.
  span() {
    const {value, low, high, example, whole} = this.parameter,
      has = v => v !== null && v !== undefined && isFinite(v);
    const size = Math.abs(value) || Math.abs(example) || 1;
    this.log =
      value > 0 && !(has(high) && high <= 10 * value && has(low)) && !whole && !this.parameter.key.includes(".travel");
    if (this.log) {
      this.low = Math.max(value / 10, has(low) && low > 0 ? low : 0);
      this.high = Math.min(value * 10, has(high) ? high : Infinity);
    } else {
      this.low =
        has(low) && high !== null && high - low <= 20 * size
          ? low
          : Math.max(has(low) ? low : -Infinity, value < 0 || low === null || low < 0 ? value - 3 * size : 0);
      this.high = has(high) && high <= 20 * size ? high : value + 3 * size;
    }
    this.range = ranges.get(this.parameter.key);
    if (this.range) {
      [this.low, this.high] = this.range;
      this.log = this.low > 0 && this.high >= 10 * this.low && !whole;
    }
    this.slider.step = String(whole ? STEPS / (this.high - this.low) : 1);
    this.from.value = String(Number(this.low.toPrecision(6)));
    this.to.value = String(Number(this.high.toPrecision(6)));
  }

  /** Puts the thumb at a value. @param {number} value */
  place(value) {
    const share = this.log
      ? Math.log(value / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    this.at = Math.round(STEPS * Math.max(0, Math.min(1, share)));
    this.slider.value = String(this.at);
  }

  /** A press on the thumb, near its middle or not, leaves it where it is; one beside it brings it to the pointer.
   * @param {PointerEvent} event */
  hold(event) {
    if (event.button) return;
    const {left, width} = this.slider.getBoundingClientRect(),
      travel = width - THUMB;
    const pressed = (STEPS * (event.clientX - left - THUMB / 2)) / travel;
    const reach = ((event.pointerType === "mouse" ? 0.5 : 1) * THUMB * STEPS) / travel;
    this.grip = Math.abs(this.at - pressed) <= reach ? this.at - pressed : 0;
    this.held = "pointer";
  }

  release() {
    this.held = "";
    this.app.drop();
    this.show();
  }

  /** A slider that is left at one of its ends reaches further when it is used again. */
  leave() {
    this.release();
    if (this.at > 0.02 * STEPS && this.at < 0.98 * STEPS) return;
    // Not before the value is there that it was left at.
    this.isLeft = this.app.pending.has(this.parameter.key);
    if (this.isLeft) return;
    this.span();
    this.place(this.parameter.value);
  }

  moved() {
    this.isLeft = false;
    const at = Math.max(0, Math.min(STEPS, Math.round(Number(this.slider.value) + this.grip))),
      share = at / STEPS;
    if (at === this.at) {
      this.slider.value = String(at);
      return;
    }
    let value = this.log ? this.low * (this.high / this.low) ** share : this.low + share * (this.high - this.low);
    if (this.parameter.whole) value = Math.round(value);
    // Four digits are finer than a slider is moved.
    value = Number(value.toPrecision(4));
    if (this.parameter.whole) this.place(value);
    else {
      this.at = at;
      this.slider.value = String(at);
    }
    this.field.value = String(value);
    this.app.drag(this.parameter.key, value);
  }

  /** A number is in SI; anything else is read as in a case: "400 g". */
  typed() {
    delete this.field.dataset.typed;
    const text = this.field.value
        .trim()
        .replaceAll("\u2212", "-")
        .replace(/^([-+]?\d*),(\d)/, "$1.$2"),
      bare = Number(text);
    if (text === "" || (text === asTyped(this.parameter.value) && !this.app.pending.size)) {
      this.back();
      return;
    }
    this.app.drag(this.parameter.key, isFinite(bare) ? bare : text);
    this.app.drop();
  }

  /** The value as it was before it was typed over. */
  back() {
    delete this.field.dataset.typed;
    this.field.value = asTyped(this.parameter.value);
    this.app.withdraw(this.parameter.key);
  }

  show() {
    const {value, key} = this.parameter,
      {mistake, pending} = this.app,
      isTyped = this.field.dataset.typed !== undefined;
    const isWrong = Boolean(mistake && pending.has(key) && (mistake.key ? mistake.key === key : !mistake.line));
    if (isWrong !== this.field.hasAttribute("aria-invalid")) {
      if (isWrong) this.field.setAttribute("aria-invalid", "true");
      else this.field.removeAttribute("aria-invalid");
    }
    const isFavourite = favourites.includes(key);
    put(this.star, {"aria-pressed": isFavourite});
    tell(this.star, isFavourite ? "★" : "☆");
    if (pending.has(key)) {
      this.shown = NaN;
      return;
    }
    if (this.reset.disabled !== (value === this.home)) this.reset.disabled = value === this.home;
    if (!this.held && (this.isLeft || this.range !== ranges.get(key))) {
      this.isLeft = false;
      this.span();
      this.shown = NaN;
    }
    if (value === this.shown) return;
    this.shown = isTyped || this.held ? NaN : value;
    if (!isTyped) this.field.value = asTyped(value);
    if (!this.held) {
      if (value < this.low || value > this.high) {
        ranges.delete(key);
        this.span();
      }
      this.place(value);
    }
    const words = `${number(value, 6)} ${this.parameter.unit}`;
    this.slider.setAttribute("aria-valuetext", words);
  }
}

/** A value as a field has it. @param {number} value */
const asTyped = value => String(Number(value.toPrecision(6)));

/** @param {string} key */
const groupOf = key => key.split(".")[0];

/** The name of a parameter in its group, of a span by the name that it has in plots: `cart.friction.viscous` is
 * "friction viscous" in the group Cart, `belt.stiffness.0` "stiffness of span 1, drive to cart".
 * @param {{key: string, span?: string | null}} parameter */
function nameOf({key, span}) {
  const isOwn = key.startsWith("experiment."),
    parts = key
      .split(".")
      .slice(1)
      .map(part => part.replace(/_/g, " "));
  if (span) return `${parts[0] === "spans" ? "length" : parts[0]} of ${span}`;
  return (
    parts
      .filter(part => !(isOwn && /^\d+$/.test(part)))
      .map(part => (/^\d+$/.test(part) ? String(Number(part) + 1) : part))
      .join(" ") || key
  );
}

/**
 * The symbol of a parameter: of a list like "k₁ k₂ k₃" that of the element.
 * @param {{key: string, symbol: string}} parameter
 */
function symbolOf({key, symbol}) {
  const all = symbol.split(" "),
    place = Number(key.split(".").at(-1));
  if (all.length < 2 || !(place >= 0)) return symbol;
  return all[place] || all[0].replace(/[₀-₉]/, () => "₀₁₂₃₄₅₆₇₈₉"[place + 1] || "");
}
