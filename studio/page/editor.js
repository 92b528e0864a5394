// @ts-check
// The case text beside its picture: a field for text with line numbers, what can be typed and what it means, and the
// line of a mistake marked as it is typed.
import {element, put, tell} from "./format.js";
import {hintsAt, meaning, placeAt} from "./hints.js";

/** @typedef {import("./app.js").App} App */

/** Hints shown at once. */
const MOST = 8;
/** Padding of the field, pixels. */
const PADDING = {x: 10, y: 8};

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
      "aria-describedby": "mistake meaning",
      "aria-autocomplete": "list",
      "aria-controls": "hints",
      oninput: event => {
        app.edit(this.field.value, true);
        this.count();
        if (event.inputType !== "insertText") this.close();
        else this.offer();
      },
      onscroll: () => {
        this.scroll();
        this.follow();
      },
      onkeydown: event => this.key(event),
      onkeyup: () => this.explain(this.field.selectionStart),
      onclick: () => {
        this.close();
        this.explain(this.field.selectionStart);
      },
      onmousemove: event => this.hover(event),
      onblur: () => this.close(),
    });
    /** What the case file may hold. @type {any} */
    this.schema = null;
    this.list = element("ul", {
      id: "hints",
      class: "hints",
      role: "listbox",
      "aria-label": "What can stand here",
      hidden: true,
    });
    this.meaning = element("p", {id: "meaning", class: "meaning quiet"});
    /** The hints that are shown, where they would stand, and the one that is chosen. */
    this.hints = /** @type {import("./hints.js").Hint[]} */ ([]);
    this.place = /** @type {import("./hints.js").Place | null} */ (null);
    this.chosen = 0;
    this.told = element("div", {id: "mistake", class: "mistake", role: "status", "aria-live": "polite"});
    root.append(
      element("div", {class: "editor"}, this.lines, element("div", {class: "field"}, this.mark, this.field, this.list)),
      this.meaning,
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
    this.app.wire.ask("schema").then(
      ({head}) => {
        this.schema = head.schema;
      },
      () => {},
    );
    this.fill();
    this.tellMistake();
  }

  fill() {
    if (this.field.value === this.app.text) return;
    const {scrollTop, selectionStart, selectionEnd} = this.field;
    this.field.value = this.app.text;
    this.field.scrollTop = scrollTop;
    if (document.activeElement === this.field) this.field.setSelectionRange(selectionStart, selectionEnd);
    this.close();
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

  // ---- What can be typed, and what it means

  /** Shows what can stand at the cursor. @param {boolean} [isAsked] true where somebody asked for it */
  offer(isAsked = false) {
    const {field} = this,
      at = field.selectionStart;
    this.place = this.schema && at === field.selectionEnd ? placeAt(field.value, at) : null;
    const hints = this.place && (isAsked || this.place.begun) ? hintsAt(this.schema, this.place, isAsked) : [];
    // A word that is whole needs no hint.
    this.hints = hints.length === 1 && hints[0].text === this.place?.word ? [] : hints.slice(0, MOST);
    this.chosen = 0;
    if (!this.hints.length) {
      this.close();
      return;
    }
    this.list.replaceChildren(
      ...this.hints.map(({text, words}, k) =>
        element(
          "li",
          {
            role: "option",
            id: `hint-${k}`,
            onmousedown: event => {
              event.preventDefault();
              this.accept(k);
            },
          },
          element("b", {}, text),
          words ? " " : null,
          element("span", {}, words),
        ),
      ),
    );
    this.list.hidden = false;
    this.follow();
    this.choose(0);
  }

  /** Puts the list beside its word, also where the field has scrolled: typing on its last line scrolls it. Closes the
   * list where the word is out of sight. */
  follow() {
    if (this.list.hidden || !this.place) return;
    const {field, list} = this,
      {x, y} = this.spot(this.place.from),
      tall = list.offsetHeight;
    if (y + this.line <= 0 || y >= field.clientHeight) {
      this.close();
      return;
    }
    const room = field.clientHeight - y - this.line;
    list.style.left = `${Math.max(0, Math.min(x, field.clientWidth - list.offsetWidth))}px`;
    list.style.top = `${room < tall ? Math.max(0, y - tall) : y + this.line}px`;
  }

  /** @param {number} k */
  choose(k) {
    this.chosen = (k + this.hints.length) % this.hints.length;
    [...this.list.children].forEach((item, i) => put(item, {"aria-selected": i === this.chosen}));
    put(this.field, {"aria-activedescendant": `hint-${this.chosen}`});
    this.list.children[this.chosen]?.scrollIntoView({block: "nearest"});
  }

  close() {
    if (this.list.hidden) return;
    this.list.hidden = true;
    this.field.removeAttribute("aria-activedescendant");
  }

  /** Writes a hint in place of the word. @param {number} k */
  accept(k) {
    const {field, place} = this,
      hint = this.hints[k];
    if (!place || !hint) return;
    field.setRangeText(hint.text, place.from, place.begun ? place.to : place.from, "end");
    this.close();
    this.app.edit(field.value, true);
    this.count();
    this.explain(field.selectionStart);
  }

  /** Tells what the key at an offset means. @param {number} at */
  explain(at) {
    tell(this.meaning, this.schema ? meaning(this.schema, placeAt(this.field.value, at)) : "");
  }

  /** Height of a line, pixels. */
  get line() {
    return parseFloat(getComputedStyle(this.field).lineHeight);
  }

  /** Width of a letter, pixels: all have the same. */
  get letter() {
    const pen = /** @type {CanvasRenderingContext2D} */ (document.createElement("canvas").getContext("2d"));
    pen.font = getComputedStyle(this.field).font;
    return pen.measureText("0".repeat(100)).width / 100;
  }

  /** Where an offset is in the field. @param {number} offset */
  spot(offset) {
    const lines = this.field.value.slice(0, offset).split("\n"),
      {scrollLeft, scrollTop} = this.field;
    return {
      x: PADDING.x + lines[lines.length - 1].length * this.letter - scrollLeft,
      y: PADDING.y + (lines.length - 1) * this.line - scrollTop,
    };
  }

  /** Explains what is under the mouse. @param {MouseEvent} event */
  hover(event) {
    if (!this.schema || event.buttons) return;
    const {left, top} = this.field.getBoundingClientRect(),
      {scrollLeft, scrollTop, value} = this.field;
    const row = Math.floor((event.clientY - top + scrollTop - PADDING.y) / this.line),
      column = Math.round((event.clientX - left + scrollLeft - PADDING.x) / this.letter);
    const lines = value.split("\n");
    if (row < 0 || row >= lines.length || column < 0 || column >= lines[row].length) return;
    this.explain(lines.slice(0, row).join("\n").length + (row ? 1 : 0) + column);
  }

  // Its own undo would know nothing of sliders; Escape leaves it, so that Tab is a key of the page.
  key(event) {
    if (event.key === " " && event.ctrlKey) {
      this.offer(true);
      event.preventDefault();
      return;
    }
    if (this.list.hidden) {
      if (event.key === "Escape") this.field.blur();
      return;
    }
    const acts = {
      ArrowDown: () => this.choose(this.chosen + 1),
      ArrowUp: () => this.choose(this.chosen - 1),
      Enter: () => this.accept(this.chosen),
      Tab: () => this.accept(this.chosen),
      Escape: () => this.close(),
    };
    if (!acts[event.key]) return;
    acts[event.key]();
    event.preventDefault();
    event.stopPropagation();
  }
}
