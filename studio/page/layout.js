// @ts-check
// Bars between panels, by which a wide page is laid out; the browser remembers where they were left.
import {element, put} from "./format.js";

const KEY = "layout";

/** What is kept, by name. @returns {Object<string, any>} */
function kept() {
  try {
    return JSON.parse(localStorage.getItem(KEY) || "{}") || {};
  } catch {
    return {};
  }
}

/** What was kept under a name. @param {string} name @returns {any} */
export const recall = name => kept()[name];

/** Keeps a value under a name, or forgets it; in a frame of another page nothing is kept.
 * @param {string} name @param {any} value */
export function keep(name, value) {
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

/** A bar that sets the size of a panel before it, in pixels: by dragging, by keys, and back by a double click.
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
  const isAcross = along === "x";
  const size = () => (isAcross ? panel().width : panel().height);
  const set = (/** @type {number | undefined} */ pixels) => {
    if (pixels === undefined) root.style.removeProperty(`--${name}`);
    else root.style.setProperty(`--${name}`, `${Math.round(Math.max(least, Math.min(most(), pixels)))}px`);
    put(bar, {"aria-valuenow": Math.round(size()), "aria-valuemax": Math.round(most())});
  };
  const settle = () => keep(name, Math.round(size()));
  /** From the edge of the panel to the pointer that holds the bar. */
  let grip = NaN;
  const edge = () => (isAcross ? panel().right : panel().bottom);
  const spot = event => (isAcross ? event.clientX : event.clientY);
  const bar = element("div", {
    class: `splitter ${along}`,
    id: `size-${name}`,
    role: "separator",
    tabindex: "0",
    "aria-label": words,
    "aria-orientation": isAcross ? "vertical" : "horizontal",
    "aria-valuemin": least,
    title: `${words}: drag, or double-click to reset`,
    onpointerdown: event => {
      if (event.button) return;
      event.preventDefault();
      bar.setPointerCapture(event.pointerId);
      grip = spot(event) - edge();
    },
    onpointermove: event => {
      if (!isNaN(grip)) set(size() + spot(event) - grip - edge());
    },
    onpointerup: () => {
      if (!isNaN(grip)) settle();
      grip = NaN;
    },
    onpointercancel: () => {
      grip = NaN;
    },
    ondblclick: () => {
      set(undefined);
      keep(name, undefined);
    },
    onkeydown: event => {
      const by = {ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1}[event.key];
      if (!by) return;
      set(size() + 16 * by);
      settle();
      event.preventDefault();
    },
  });
  const before = recall(name);
  if (Number.isFinite(before)) root.style.setProperty(`--${name}`, `${before}px`);
  bar.addEventListener("focus", () =>
    put(bar, {"aria-valuenow": Math.round(size()), "aria-valuemax": Math.round(most())}),
  );
  put(bar, {"aria-valuenow": Number.isFinite(before) ? before : least, "aria-valuemax": Math.round(most())});
  return bar;
}
