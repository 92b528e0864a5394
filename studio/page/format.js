// @ts-check
// Numbers and small elements for people.

const MINUS = "\u2212";

/** As short as it can be with so many digits. @param {number} value @param {number} [digits] */
export function number(value, digits = 5) {
  if (!isFinite(value)) return "\u2013";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e7 || size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    const up = [...String(+exponent)]
      .map(c => (c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[+c]))
      .join("");
    return `${String(+mantissa).replace("-", MINUS)}\u00d710${up}`;
  }
  return String(+value.toPrecision(digits)).replace("-", MINUS);
}

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
