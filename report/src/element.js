// @ts-check
// Elements of a page and of drawings, times for people.
import {MINUS} from "./pen.js";

const PREFIXES = [
  [1, "s"],
  [1e-3, "ms"],
  [1e-6, "\u00b5s"],
  [1e-9, "ns"],
];

/** A time, as precise as the step asks. @param {number} seconds @param {number} [step] */
export function timeText(seconds, step = 1e-3) {
  const size = Math.max(Math.abs(seconds), step);
  const [unit, name] = PREFIXES.find(([unit]) => size >= +unit * 0.9995) || PREFIXES[3];
  const decimals = Math.max(0, Math.min(9, Math.ceil(-Math.log10(step / +unit) - 1e-9)));
  return `${(seconds / +unit).toFixed(decimals).replace("-", MINUS)}\u00a0${name}`;
}

/** An element with attributes and children.
 * @param {string} tag
 * @param {Object<string, any>} [attributes] on… are listeners
 * @param {...(Node|string|null|undefined)} children
 * @returns {any} */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  set(made, attributes);
  made.append(
    ...children.filter(child => child !== null && child !== undefined).map(child => /** @type {Node|string} */ (child)),
  );
  return made;
}

/** Details behind a summary, as a group with a name: browsers give it none.
 * @param {Object<string, any>} attributes @param {string} words of the summary @param {string} name
 * @param {...(Node|string|null|undefined)} children @returns {any} */
export function fold(attributes, words, name, ...children) {
  return element(
    "details",
    {...attributes, "aria-label": name},
    element("summary", {"aria-label": name === words ? null : name}, words),
    ...children,
  );
}

/** An element of a drawing.
 * @param {string} tag @param {Object<string, any>} [attributes] @param {...(Node|string)} children
 * @returns {any} */
export function svg(tag, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  set(made, attributes);
  made.append(...children);
  return made;
}

/** @param {Element} made @param {Object<string, any>} attributes */
function set(made, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? "" : String(value));
  }
}

/** Gives an element a text, where it has another: the browser lays out and draws again what is told, even the same.
 * @param {Element} element @param {string} text */
export function tell(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** The same for attributes. @param {Element} element @param {Object<string, any>} attributes */
export function put(element, attributes) {
  for (const [name, value] of Object.entries(attributes))
    if (element.getAttribute(name) !== String(value)) element.setAttribute(name, String(value));
}

/** True if the view of an element is not shown. @param {Element} element */
export const isOutOfView = element => Boolean(element.closest(".view[hidden]"));
