// @ts-check
// How a wide page is laid out: bars between panels, and the order and sizes of plots. The browser remembers it.
import {element, fold, put} from "./format.js";
import {limited} from "./pen.js";

const KEY = "taut-layout";
/** Columns of the grid that plots stand in. */
const COLUMNS = 12;
/** Heights of curves, pixels, and the fewest columns of a plot. */
const TALL = {least: 80, most: 700},
  NARROW = 3;
/** Where panels can be arranged; style.css has the same width. */
const wide = matchMedia("(min-width: 1100px)");

/** What is kept in the browser, by name. @returns {Object<string, any>} */
function kept() {
  try {
    const found = JSON.parse(localStorage.getItem(KEY) || "{}");
    return found && typeof found === "object" && !Array.isArray(found) ? found : {};
  } catch {
    return {};
  }
}

/** What the page goes by, where the browser keeps nothing as well. */
const now = kept();

/** What was kept under a name. @param {string} name @returns {any} */
export const recall = name => now[name];

/** Keeps a value under a name, or forgets it; in a frame of another page the browser keeps nothing.
 * @param {string} name @param {any} value */
export function keep(name, value) {
  now[name] = value;
  if (value === undefined) delete now[name];
  showReset();
  if (window !== window.top) return;
  const all = {...kept(), [name]: value};
  if (value === undefined) delete all[name];
  try {
    if (Object.keys(all).length) localStorage.setItem(KEY, JSON.stringify(all));
    else localStorage.removeItem(KEY);
  } catch {
    // Private windows.
  }
}

/** What sets a size or an order back, by the name under which it is kept. @type {Map<string, () => void>} */
const resets = new Map();

/** Sets all sizes and the order back; hidden while none was changed. */
export const reset = element(
  "button",
  {type: "button", id: "reset-layout", class: "reset-layout", hidden: true, onclick: () => resetLayout()},
  "Reset layout",
);
const showReset = () => {
  reset.hidden = ![...resets.keys()].some(name => recall(name) !== undefined);
};
function resetLayout() {
  for (const [name, back] of resets) {
    keep(name, undefined);
    back();
  }
}

/** A bar that sets a size: by dragging, by keys, and back by a double click.
 * @param {Object} options
 * @param {string} options.id
 * @param {string} options.words what it sizes
 * @param {"x" | "y"} options.along the direction in which it moves
 * @param {number} options.least
 * @param {() => number} options.most
 * @param {() => number} options.size the size as it is
 * @param {(size: number) => string} [options.told] the size in words
 * @param {() => number} [options.unit] pixels of one
 * @param {number} [options.by] what a key changes
 * @param {(size: number | undefined) => void} options.set sets a size, or the size without it
 * @param {() => void} options.settle called when a size was chosen
 * @returns {HTMLElement} */
function handle({id, words, along, least, most, size, told, unit = () => 1, by = 16, set, settle}) {
  const isAcross = along === "x";
  const show = () => {
    const value = Math.round(size());
    put(bar, {"aria-valuenow": value, "aria-valuemax": Math.round(most())});
    if (told) put(bar, {"aria-valuetext": told(value)});
  };
  const change = (/** @type {number | undefined} */ value) => {
    set(value === undefined ? undefined : Math.round(limited(value, least, Math.max(least, most()))));
    show();
  };
  /** Where the pointer took the bar, and the size then. @type {{spot: number, size: number} | null} */
  let held = null;
  const spot = event => (isAcross ? event.clientX : event.clientY);
  const release = () => {
    if (held) settle();
    held = null;
  };
  const bar = element("div", {
    class: `splitter ${along}`,
    id,
    role: "separator",
    tabindex: "0",
    "aria-label": words,
    "aria-orientation": isAcross ? "vertical" : "horizontal",
    "aria-valuemin": least,
    "aria-valuenow": least,
    title: `${words}: drag, or double-click to reset`,
    onpointerdown: event => {
      if (event.button) return;
      event.preventDefault();
      bar.focus({preventScroll: true});
      bar.setPointerCapture(event.pointerId);
      held = {spot: spot(event), size: size()};
    },
    onpointermove: event => {
      if (held) change(held.size + (spot(event) - held.spot) / unit());
    },
    onpointerup: release,
    onpointercancel: release,
    ondblclick: () => {
      change(undefined);
      settle();
    },
    onkeydown: event => {
      const sign = {ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1}[event.key];
      if (!sign) return;
      change(size() + by * sign);
      settle();
      event.preventDefault();
    },
    onfocus: show,
  });
  return bar;
}

/** A bar that sets the size of a panel before it, in pixels.
 * @param {Object} options
 * @param {string} options.name under which it is kept, and the variable of the style, `--name`
 * @param {string} options.words what it sizes
 * @param {HTMLElement} options.root the element with the variable
 * @param {() => DOMRect} options.panel the place of the panel
 * @param {"x" | "y"} options.along the direction in which it moves
 * @param {number} options.least pixels
 * @param {() => number} options.most pixels
 * @returns {HTMLElement} */
export function splitter({name, words, root, panel, along, least, most}) {
  /** @type {number | undefined} */
  let chosen;
  const size = () => panel()[along === "x" ? "width" : "height"];
  const set = (/** @type {number | undefined} */ pixels) => {
    chosen = pixels;
    if (pixels === undefined) root.style.removeProperty(`--${name}`);
    else root.style.setProperty(`--${name}`, `${pixels}px`);
  };
  const before = recall(name);
  if (Number.isFinite(before)) set(before);
  resets.set(name, () => set(undefined));
  showReset();
  return handle({
    id: `size-${name}`,
    words,
    along,
    least,
    most,
    size,
    set,
    settle: () => keep(name, chosen === undefined ? undefined : Math.round(size())),
  });
}

/** A plot in its place; `curves` is the height of its curves, pixels.
 * @typedef {{panel: any, figure: HTMLElement, area: HTMLElement, curves: number}} Placed
 * @typedef {"front" | "left" | "right" | "up" | "down"} Way in which a plot is moved */
/** The ways, with the words for them. @type {[Way, string][]} */
const WAYS = [
  ["front", "To the front"],
  ["left", "Left"],
  ["right", "Right"],
  ["up", "Up"],
  ["down", "Down"],
];

/** The order of plots, and how many columns and pixels each takes, where a page is wide. */
export class Panels {
  /** @param {HTMLElement} root of the plots @param {(words: string) => void} say */
  constructor(root, say) {
    this.root = root;
    this.say = say;
    root.classList.add("arranged");
    const before = recall("panels") || {},
      list = Array.isArray(before.order) ? before.order : [];
    /** Keys in the order that was chosen. @type {string[]} */
    this.order = list.filter(key => typeof key === "string");
    /** Columns and pixels by key. @type {{wide: Object<string, number>, tall: Object<string, number>}} */
    this.sizes = {wide: {...before.wide}, tall: {...before.tall}};
    /** @type {Placed[]} */
    this.plots = [];
    /** Called when a plot takes another size. */
    this.resized = () => {};
    resets.set("panels", () => {
      this.order = [];
      this.sizes = {wide: {}, tall: {}};
      this.arrange();
    });
    showReset();
    wide.addEventListener("change", () => this.arrange());
  }

  /** The height that was chosen for the curves of a plot. @param {string} key @returns {number | undefined} */
  tall(key) {
    const pixels = wide.matches ? this.sizes.tall[key] : undefined;
    return Number.isFinite(pixels) ? limited(Number(pixels), TALL.least, TALL.most) : undefined;
  }

  /** Puts these plots into the page, each with what arranges it. @param {Placed[]} plots */
  place(plots) {
    this.plots = plots;
    for (const plot of plots) this.equip(plot);
    this.arrange();
  }

  /** The plots as they stand: those without a chosen place behind the others. */
  get placed() {
    if (!wide.matches) return this.plots;
    const rank = plot => (this.order.indexOf(plot.panel.key) + 1 || Infinity) - 1;
    return [...this.plots].sort((a, b) => (rank(a) === rank(b) ? 0 : rank(a) - rank(b)));
  }

  arrange() {
    for (const {panel, figure} of this.plots) {
      const columns = this.sizes.wide[panel.key];
      figure.style.setProperty("--wide", Number.isFinite(columns) ? String(limited(columns, NARROW, COLUMNS)) : "");
    }
    this.root.replaceChildren(...this.placed.map(({figure}) => figure));
    this.resized();
  }

  settle() {
    const {order, sizes} = this;
    const isPlain = ![...order, ...Object.keys(sizes.wide), ...Object.keys(sizes.tall)].length;
    keep("panels", isPlain ? undefined : {order, ...sizes});
  }

  /** @param {Placed} plot */
  equip(plot) {
    const {panel, figure, area} = plot,
      {key, title} = panel;
    const set = (/** @type {Object<string, number>} */ sizes) => (/** @type {number | undefined} */ size) => {
      if (size === undefined) delete sizes[key];
      else sizes[key] = size;
      figure.style.setProperty("--wide", String(this.sizes.wide[key] || ""));
      this.resized();
    };
    const gap = () => parseFloat(getComputedStyle(this.root).columnGap) || 0,
      column = () => (this.root.clientWidth + gap()) / COLUMNS,
      settle = () => this.settle();
    figure.append(
      handle({
        id: `wide-${key}`,
        words: `Width of ${title}`,
        along: "x",
        least: NARROW,
        most: () => COLUMNS,
        size: () => Math.round((figure.getBoundingClientRect().width + gap()) / column()),
        told: size => `${size} of ${COLUMNS} columns`,
        unit: column,
        by: 1,
        set: size => set(this.sizes.wide)(size),
        settle,
      }),
    );
    // The strips of states have the height that they need.
    if (key !== "state")
      area.after(
        handle({
          id: `tall-${key}`,
          words: `Height of ${title}`,
          along: "y",
          ...TALL,
          most: () => TALL.most,
          size: () => plot.curves,
          set: size => set(this.sizes.tall)(size),
          settle,
        }),
      );
    const ways = WAYS.map(([way, words]) =>
      element(
        "button",
        {
          type: "button",
          onclick: event => {
            this.move(plot, this.target(plot, way));
            event.target.focus({preventScroll: true});
          },
        },
        words,
      ),
    );
    const menu = fold({class: "menu move"}, "Move", `Move ${title}`, element("div", {}, ...ways));
    /** @type {HTMLElement} */ (figure.querySelector("figcaption")).append(menu);
    this.drag(plot);
  }

  /** Has the title of a plot dragged by a mouse to the place of another one. @param {Placed} plot */
  drag(plot) {
    const head = /** @type {HTMLElement} */ (plot.figure.querySelector("h3"));
    let isHeld = false;
    const mark = (/** @type {PointerEvent | null} */ event) => {
      const under = event && document.elementFromPoint(event.clientX, event.clientY),
        {placed} = this,
        to = placed.findIndex(({figure}) => figure.contains(under));
      placed.forEach(({figure}, k) => figure.classList.toggle("target", k === to && figure !== plot.figure));
      return to;
    };
    head.addEventListener("pointerdown", event => {
      if (event.button || event.pointerType !== "mouse" || !wide.matches) return;
      event.preventDefault();
      head.setPointerCapture(event.pointerId);
      isHeld = true;
    });
    head.addEventListener("pointermove", event => {
      if (isHeld) mark(event);
    });
    head.addEventListener("pointerup", event => {
      const to = isHeld ? mark(event) : -1;
      isHeld = false;
      mark(null);
      if (to >= 0 && this.placed[to] !== plot) this.move(plot, to);
    });
    head.addEventListener("pointercancel", () => {
      isHeld = false;
      mark(null);
    });
  }

  /** The place of a plot after a move, among the others. @param {Placed} plot @param {Way} way */
  target(plot, way) {
    const {placed} = this,
      at = placed.indexOf(plot);
    if (way === "front") return 0;
    if (way === "left" || way === "right") return limited(at + (way === "left" ? -1 : 1), 0, placed.length - 1);
    // The nearest one of the next row in that direction.
    const own = plot.figure.getBoundingClientRect(),
      isUp = way === "up";
    const others = placed
      .map(({figure}, k) => ({k, box: figure.getBoundingClientRect()}))
      .filter(({box}) => (isUp ? box.top < own.top - 1 : box.top > own.top + 1));
    const far = ({box}) => [Math.abs(box.top - own.top), Math.abs(box.left + box.right - own.left - own.right)];
    const [nearest] = others.sort((a, b) => far(a)[0] - far(b)[0] || far(a)[1] - far(b)[1]);
    return nearest ? nearest.k : at;
  }

  /** Moves a plot to a place among the others. @param {Placed} plot @param {number} to */
  move(plot, to) {
    const {placed} = this,
      {title} = plot.panel,
      stays = placed[to] === plot;
    if (!stays) {
      const others = placed.filter(one => one !== plot);
      others.splice(to, 0, plot);
      this.order = others.map(({panel}) => panel.key);
      this.arrange();
      this.settle();
      plot.figure.scrollIntoView({block: "nearest"});
    }
    this.say(`${title} ${stays ? "stays" : "is"} ${to + 1} of ${placed.length}`);
  }
}
