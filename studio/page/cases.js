// @ts-check
// Cases that were left for another one, so that nobody's work is lost: they stand in the menu, and the browser keeps
// them, and the one that is shown, until the tab is closed. A page in a frame of another shows its case each time anew.
import {element} from "./format.js";

/** @typedef {import("./app.js").App} App */
/** @typedef {import("./app.js").Case} Case */

const KEY = "taut-cases";
/** Time between a change and its being kept, ms: a drag changes the text with every picture. */
const LATER = 300;
/** True in a frame: several frames of a tab would take each other's cases. */
const isFramed = window !== window.top;

export class Cases {
  /** @param {HTMLElement} list of the menu, after its heading @param {App} app */
  constructor(list, app) {
    this.list = list;
    this.app = app;
    /** The newest first. @type {Case[]} */
    this.left = [];
    this.timer = 0;
    app.on("leave", () => this.leave());
    app.on("opened", () => this.show());
    if (isFramed) return;
    app.on("text", () => {
      if (!this.timer) this.timer = setTimeout(() => this.keep(), LATER);
    });
    addEventListener("pagehide", () => this.keep());
    addEventListener("beforeunload", event => {
      if (app.isUnsaved || this.left.some(one => one.isUnsaved)) event.preventDefault();
    });
  }

  /** Puts the case that is shown aside. One that came with the program is nobody's work before it is changed. */
  leave() {
    const {app} = this;
    if (!app.base || (app.isBuiltIn && !app.isUnsaved)) return;
    this.add(app.case);
    if (app.isUnsaved) app.notify(`Your changes to ${app.name} are kept. The menu “Case” leads back to them.`);
  }

  /** @param {Case} one */
  add(one) {
    this.left = [one, ...this.left.filter(other => !isSame(one, other))];
  }

  /** Shows the list, without the case that is open. */
  show() {
    const {app} = this;
    this.left = this.left.filter(one => !isSame(one, app.case));
    this.list.hidden = !this.left.length;
    this.list.replaceChildren(
      /** @type {Element} */ (this.list.firstElementChild),
      ...this.left.map(one =>
        element(
          "button",
          {type: "button", onclick: () => this.back(one)},
          `${one.name}, ${one.isUnsaved ? "changed, " : ""}left at ${one.at}`,
        ),
      ),
    );
    this.keep();
  }

  /** Returns to a case. @param {Case} one */
  back(one) {
    this.left = this.left.filter(other => other !== one);
    this.app.open(one.base, one);
    this.app.show("motion");
    /** @type {any} */ (this.list.closest("details")).open = false;
  }

  /** Has the browser keep what is unsaved. Where it may not, the question before the page is left has to do. */
  keep() {
    clearTimeout(this.timer);
    this.timer = 0;
    if (isFramed) return;
    const {app} = this,
      bare = one => ({...one, past: [], future: []});
    try {
      if (!app.isUnsaved && !this.left.length) sessionStorage.removeItem(KEY);
      else
        sessionStorage.setItem(
          KEY,
          JSON.stringify({
            hash: location.hash,
            shown: app.isUnsaved ? bare(app.case) : null,
            left: this.left.map(bare),
          }),
        );
    } catch {
      /* private windows, or more than the browser keeps */
    }
  }

  /** Takes what was kept back. @param {string} path of the case that can be saved
   * @returns {Case | null} the case that was shown, unless the address is another now */
  restore(path) {
    if (isFramed) return null;
    try {
      const {hash, shown, left} = JSON.parse(sessionStorage.getItem(KEY) || "null") || {shown: null, left: []};
      for (const one of [shown, ...left]) if (one && one.path !== path) one.path = "";
      this.left = left;
      if (!shown || hash === location.hash) return shown;
      this.add(shown);
    } catch {
      /* private windows */
    }
    return null;
  }
}

/** @param {Case} one @param {Case} other */
function isSame(one, other) {
  const text = ({name, path, base, set}) => JSON.stringify([name, path, base, set]);
  return text(one) === text(other);
}
