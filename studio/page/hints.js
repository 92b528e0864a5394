// @ts-check
// What can stand at a place of the case text, and what it means, by the JSON Schema of the case file.

/** A place in a text: the tables and keys that lead to it, whether a key or a value is written there, the word, and
 * what of it stands before the cursor.
 * @typedef {{path: string[], isKey: boolean, from: number, to: number, word: string, begun: string, used: string[]}}
 *   Place */
/** Something that can be written at a place. @typedef {{text: string, words: string}} Hint */

const NAME = /[\w-]/;

/** The end of a string that begins here, after its closing quote, or the end of its line where it is not closed.
 * @param {string} text @param {number} from @returns {number} */
function endOfString(text, from) {
  const quote = text[from],
    long = quote.repeat(3);
  if (text.startsWith(long, from)) {
    const end = text.indexOf(long, from + 3);
    return end < 0 ? text.length : end + 3;
  }
  for (let at = from + 1; at < text.length; at++) {
    if (text[at] === "\\" && quote === '"') at++;
    else if (text[at] === quote) return at + 1;
    else if (text[at] === "\n") return at;
  }
  return text.length;
}

/** The place of an offset in a text that may be unfinished; none in a comment.
 * @param {string} text @param {number} offset @returns {Place | null} */
export function placeAt(text, offset) {
  /** Path of the last header, and of the open brackets: an inline table, or a list. */
  let header = [];
  /** @type {{path: string[], isTable: boolean, used: string[]}[]} */
  let open = [];
  /** The key that is being written, or whose value is. @type {string[]} */
  let key = [];
  let isKey = true,
    isHeader = false,
    used = /** @type {string[]} */ ([]);
  const level = () => open.at(-1);
  const path = () => level()?.path ?? header;
  const place = (/** @type {number} */ from, /** @type {number} */ to) => ({
    path: isKey ? [...(isHeader ? [] : path()), ...key] : [...path(), ...key],
    isKey,
    from,
    to,
    word: text.slice(from, to),
    begun: text.slice(from, offset),
    used: isHeader ? [] : (level() || {used}).used,
  });
  let at = 0;
  while (at < text.length) {
    const letter = text[at];
    if (letter === "#") {
      const end = text.indexOf("\n", at);
      if (offset > at && (end < 0 || offset <= end)) return null;
      at = end < 0 ? text.length : end;
      continue;
    }
    if (letter === '"' || letter === "'" || NAME.test(letter)) {
      let end = at;
      if (NAME.test(letter)) while (end < text.length && (NAME.test(text[end]) || (!isKey && text[end] === "."))) end++;
      else end = endOfString(text, at);
      if (offset >= at && offset <= end) return place(at, end);
      if (isKey) key.push(text.slice(at, end).replace(/^["']|["']$/g, ""));
      at = end;
      continue;
    }
    if (offset <= at) return place(offset, offset);
    if (letter === "\n" && !open.length) {
      isKey = true;
      isHeader = false;
      key = [];
    } else if (letter === "[" && isKey && !open.length) {
      isHeader = true;
      key = [];
      used = [];
    } else if (letter === "]" && isHeader) {
      // A table of a list ends with two brackets.
      if (key.length) header = key;
      key = [];
    } else if (letter === "=") {
      (level() || {used}).used.push(key[0] || "");
      isKey = false;
    } else if (letter === "{" || letter === "[") {
      open.push({path: [...path(), ...key], isTable: letter === "{", used: []});
      key = [];
      isKey = letter === "{";
    } else if (letter === "}" || letter === "]") {
      const closed = open.pop();
      const outer = level();
      isKey = false;
      key = closed && !outer ? closed.path.slice(header.length) : [];
    } else if (letter === "," && open.length) {
      key = [];
      isKey = Boolean(level()?.isTable);
    }
    at++;
  }
  return place(offset, offset);
}

/** Every schema that a node stands for: its references and alternatives, resolved.
 * @param {any} schema @param {any} node @returns {any[]} */
function variants(schema, node) {
  if (!node) return [];
  if (node.$ref)
    return variants(
      schema,
      node.$ref
        .replace("#/", "")
        .split("/")
        .reduce((at, step) => at && at[step], schema),
    );
  if (node.anyOf) return [node, ...node.anyOf.flatMap(one => variants(schema, one))];
  // A list has the keys of its elements.
  return node.items ? [node, ...variants(schema, node.items)] : [node];
}

/** The schemas at a path. @param {any} schema @param {string[]} path @returns {any[]} */
function nodes(schema, path) {
  let found = variants(schema, schema);
  for (const step of path) {
    const isPlace = /^\d+$/.test(step);
    if (!isPlace) found = found.flatMap(node => variants(schema, node.properties && node.properties[step]));
  }
  return found;
}

/** What can be written at a place, of which the word there is the beginning.
 * @param {any} schema @param {Place} place @param {boolean} hasExamples whether examples of numbers count
 * @returns {Hint[]} */
export function hintsAt(schema, place, hasExamples) {
  /** @type {Map<string, string>} */
  const found = new Map();
  for (const node of nodes(schema, place.path)) {
    if (place.isKey) {
      for (const [name, one] of Object.entries(node.properties || {}))
        if (!place.used.includes(name) || name === place.word) found.set(name, wordsOf(schema, one));
    } else {
      for (const one of node.enum || []) found.set(JSON.stringify(one), node.description || "");
      for (const one of (hasExamples && node.examples) || [])
        found.set(JSON.stringify(one), `for example; ${node.description || ""}`);
      if ([node.type].flat().includes("boolean"))
        for (const one of ["true", "false"]) found.set(one, node.description || "");
    }
  }
  const begun = place.begun.replace(/^["']|["']$/g, "").toLowerCase();
  return [...found]
    .map(([text, words]) => ({text, words}))
    .filter(({text}) => text.replace(/^"/, "").toLowerCase().startsWith(begun));
}

/** What a node is about. @param {any} schema @param {any} node */
const wordsOf = (schema, node) =>
  variants(schema, node)
    .map(one => one.description)
    .find(Boolean) || "";

/** What the key at a place means, with its name; none where there is no such key.
 * @param {any} schema @param {Place | null} place @returns {string} */
export function meaning(schema, place) {
  if (!place || (place.isKey && !place.word)) return "";
  const path = place.isKey ? [...place.path, place.word.replace(/^["']|["']$/g, "")] : place.path;
  if (!path.length) return "";
  const found = nodes(schema, path),
    words = found.map(node => node.description).find(Boolean);
  return found.length ? `${path.join(".")}${words ? `: ${words}` : ""}` : "";
}
