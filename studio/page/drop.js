// @ts-check
// A place to drop files on, or to choose them; they stay on this computer.
import {element} from "./format.js";

const MOST = 64 << 20;

/** A paragraph for an error: `tell` shows it, with words before it, and hides the paragraph where there is none.
 * @param {Object} [attributes] @returns {any} */
export function errorPlace(attributes = {}) {
  const place = element("p", {class: "mistake", role: "alert", hidden: true, ...attributes});
  place.tell = (error, before = "") => {
    place.hidden = !error;
    place.textContent = error ? before + wordsOf(error) : "";
  };
  return place;
}

/**
 * @param {{id: string, words: string, accept: string, many?: boolean,
 * take: (files: {name: string, path: string}[]) => void, failed: (error: Error) => void,
 * wire: import("./wire.js").Wire}} options
 */
export function dropPlace({id, words, accept, many, take, failed, wire}) {
  const input = element("input", {
    type: "file",
    id,
    accept,
    multiple: many || null,
    onchange: () => {
      send([...input.files]);
    },
  });
  const told = element("span", {class: "quiet", role: "status"});
  const place = element(
    "label",
    {class: "drop", for: id},
    element("strong", {}, words),
    element("span", {class: "quiet"}, "Drop here, or choose. Files stay on this computer."),
    input,
    told,
  );
  place.addEventListener("dragover", event => {
    event.preventDefault();
    place.classList.add("over");
  });
  place.addEventListener("dragleave", () => place.classList.remove("over"));
  place.addEventListener("drop", event => {
    event.preventDefault();
    place.classList.remove("over");
    send([...(event.dataTransfer ? event.dataTransfer.files : [])]);
  });
  /** @param {File[]} files */
  async function send(files) {
    if (!files.length) return;
    try {
      const sent = [];
      for (const file of many ? files : files.slice(0, 1)) {
        if (file.size > MOST)
          throw new Error(`${file.name} has ${Math.round(file.size / 1048576)} MB; a file may have 64 MB`);
        told.textContent = `Sending ${file.name}…`;
        sent.push({name: file.name, path: await wire.upload(file)});
      }
      told.textContent = sent.map(file => file.name).join(", ");
      input.value = "";
      take(sent);
    } catch (error) {
      told.textContent = "";
      failed(/** @type {Error} */ (error));
    }
  }
  return place;
}

/** A mistake in one line. @param {any} error */
export function wordsOf(error) {
  const mistake = error && error.mistake;
  if (!mistake) return String((error && error.message) || error);
  return [mistake.what, mistake.allowed && `Allowed: ${mistake.allowed}`, mistake.next && `Next: ${mistake.next}`]
    .filter(Boolean)
    .join(". ");
}
