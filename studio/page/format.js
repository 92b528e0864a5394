// @ts-check
// Tables, files, and the elements that views make their pages of.
import {element} from "./element.js";

export * from "./element.js";
export {number} from "./pen.js";

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
