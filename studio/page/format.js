// @ts-check
// Numbers and small elements for people.

import {MINUS} from "./pen.js";

export {number} from "./pen.js";

const PREFIXES = [
  [1, "s"],
  [1e-3, "ms"],
  [1e-6, "\u00b5s"],
  [1e-9, "ns"],
];

/** A time, as precise as the step asks. @param {number} seconds @param {number} [step] */
export function time(seconds, step = 1e-3) {
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

/** A table: texts of its head, and rows of texts, cells or whole.
 * @param {string[]} head @param {((Node | string)[] | Node)[]} rows @param {string} [caption] @returns {any} */
export const table = (head, rows, caption) =>
  element(
    "table",
    {},
    caption ? element("caption", {}, caption) : null,
    element("thead", {}, element("tr", {}, ...head.map(text => element("th", {scope: "col"}, text)))),
    element("tbody", {}, ...rows.map(row => (Array.isArray(row) ? element("tr", {}, ...row.map(cell)) : row))),
  );

/** @param {Node | string} content */
const cell = content => (typeof content === "string" ? element("td", {}, content) : content);

/** The head of a row. @param {string} text */
export const rowHead = text => element("th", {scope: "row"}, text);

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

/** Has the browser keep a file. @param {string} name @param {BlobPart} content @param {string} kind */
export function download(name, content, kind) {
  const address = URL.createObjectURL(new Blob([content], {type: kind}));
  const link = element("a", {href: address, download: name});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** A name as that of a file. @param {string} name */
export const fileName = name =>
  name
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]+/gu, "-")
    .replace(/^-+|-+$/g, "") || "case";
