// @ts-check
// The case text beside its picture: a field for text with line numbers, and the line of a mistake marked as it is
// typed.
import {element} from "./format.js";

/** @typedef {import("./app.js").App} App */

export class Editor {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.lines = element("pre", {class: "lines", "aria-hidden": "true"});
    this.mark = element("div", {class: "line-mark", hidden: true});
    this.field = element("textarea", {
      id: "text",
      spellcheck: "false",
      autocomplete: "off",
      autocapitalize: "off",
      wrap: "off",
      "aria-label": "Case text",
      "aria-describedby": "mistake",
      oninput: () => {
        app.edit(this.field.value, true);
        this.count();
      },
      onscroll: () => this.scroll(),
      onkeydown: event => this.key(event),
    });
    this.told = element("div", {id: "mistake", class: "mistake", role: "status", "aria-live": "polite"});
    root.append(
      element("div", {class: "editor"}, this.lines, element("div", {class: "field"}, this.mark, this.field)),
      this.told,
    );
    app.on("text", () => {
      if (!root.hidden) this.fill();
    });
    app.on("mistake", () => {
      if (!root.hidden) this.tellMistake();
    });
  }

  /** Catches up with the text when it comes in sight. */
  show() {
    this.fill();
    this.tellMistake();
  }

  fill() {
    if (this.field.value === this.app.text) return;
    const {scrollTop, selectionStart, selectionEnd} = this.field;
    this.field.value = this.app.text;
    this.field.scrollTop = scrollTop;
    if (document.activeElement === this.field) this.field.setSelectionRange(selectionStart, selectionEnd);
    this.count();
  }

  count() {
    const count = this.field.value.split("\n").length;
    if (count !== this.counted) {
      this.counted = count;
      this.lines.textContent = Array.from({length: count}, (_, k) => k + 1).join("\n");
    }
    this.scroll();
  }

  scroll() {
    this.lines.scrollTop = this.field.scrollTop;
    const line = this.app.mistake && this.app.mistake.line;
    const height = parseFloat(getComputedStyle(this.field).lineHeight);
    if (this.mark.hidden === Boolean(line)) this.mark.hidden = !line;
    if (line) {
      this.mark.style.height = height + "px";
      this.mark.style.transform = `translateY(${8 + (line - 1) * height - this.field.scrollTop}px)`;
    }
  }

  tellMistake() {
    const {mistake} = this.app;
    this.field.toggleAttribute("aria-invalid", Boolean(mistake));
    if (mistake) this.field.setAttribute("aria-invalid", "true");
    this.scroll();
    if (!mistake) {
      this.told.replaceChildren();
      return;
    }
    const where = mistake.line ? `Line ${mistake.line}, column ${mistake.column}: ` : "";
    const lines = [element("p", {}, element("b", {}, where), mistake.what)];
    if (mistake.allowed) lines.push(element("p", {}, `Allowed: ${mistake.allowed}`));
    if (mistake.next) lines.push(element("p", {}, `Next: ${mistake.next}`));
    if (mistake.line) lines.push(element("button", {type: "button", onclick: () => this.go(mistake)}, "Go there"));
    this.told.replaceChildren(...lines);
  }

  /** Puts the cursor at a mistake. */
  go(mistake) {
    const before =
      this.field.value
        .split("\n")
        .slice(0, mistake.line - 1)
        .join("\n").length + (mistake.line > 1 ? 1 : 0);
    this.field.focus();
    this.field.setSelectionRange(before + mistake.column - 1, before + mistake.column - 1 + (mistake.width || 1));
    this.field.scrollTop = Math.max(0, (mistake.line - 6) * parseFloat(getComputedStyle(this.field).lineHeight));
  }

  // Its own undo would know nothing of sliders; Escape leaves it, so that Tab is a key of the page.
  key(event) {
    if (event.key === "Escape") this.field.blur();
  }
}
