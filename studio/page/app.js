// @ts-check
// The state of a page: the case text and its history, the run that it gives, what is compared with it, and what is
// looked at. Views listen and draw; nothing here computes a motion.
import {Playing} from "./player.js";
import {Wire, Mistake} from "./wire.js";

/** @typedef {import("./wire.js").Answer} Answer */
/** The case as it was: a text, and the changes that were not in it yet.
 * @typedef {{text: string, set: [string, number | string][]}} State */
/** A case that can be returned to: its state, where it is from, and what was done with it.
 * @typedef {Object} Case
 * @property {string} name
 * @property {string} path
 * @property {number} experiment
 * @property {string} original
 * @property {string} safe
 * @property {string} base
 * @property {[string, number | string][]} set
 * @property {State[]} past
 * @property {State[]} future
 * @property {boolean} isTouched
 * @property {boolean} isBuiltIn
 * @property {boolean} isUnsaved
 * @property {string} at when it was left */

const MOST_UNDO = 200,
  MOST_PINS = 6,
  MOST_MOVED = 4;

export class App extends Playing {
  constructor() {
    super();
    this.wire = new Wire();
    this.path = "";
    this.name = "studio.toml";
    /** The text that was opened. */
    this.original = "";
    /** The text as it stands elsewhere too: as it was opened, saved or downloaded. */
    this.safe = "";
    /** Whether somebody changed the case. */
    this.isTouched = false;
    /** Whether it came with the program. */
    this.isBuiltIn = false;
    /** The text that changes start from. */
    this.base = "";
    /** The text as it is shown. */
    this.text = "";
    /**
     * Changes that are not in the text yet: keys to values in SI, or with a unit.
     * @type {Map<string, number | string>}
     */
    this.pending = new Map();
    /** @type {State[]} */
    this.past = [];
    /** @type {State[]} */
    this.future = [];
    /** Keys of the parameters that were changed last, the newest first. @type {string[]} */
    this.moved = [];
    this.experiment = 0;
    /** @type {Answer | null} */
    this.run = null;
    /** @type {any[]} */
    this.parameters = [];
    /** @type {any} what is wrong with the text, with its place */
    this.mistake = null;
    /** The run before the last change. @type {Answer | null} */
    this.before = null;
    this.showsBefore = true;
    /** @type {{name: string, answer: Answer}[]} */
    this.pins = [];
    /** Rows of the window, or around the cursor in slow motion, at a finer interval. @type {Answer | null} */
    this.section = null;
    this.view = "motion";
    /** The stop of the tour. */
    this.stop = 0;
    this.gesture = false;
    this.sent = 0;
    /** Whether the run is that of the case as it is now. */
    this.isCurrent = false;
    this.needsDescription = true;
    this.lastEdit = -Infinity;
    /** The run that is on the screen. @type {Answer | null} */
    this.drawn = null;
    /** Tells those who do not see the page; `main.js` says how. @type {(text: string) => void} */
    this.say = () => {};
    /** Tells everyone, what is grave until the next word. @type {(text: string, isGrave?: boolean) => void} */
    this.notify = () => {};
    /** Drawing and plots of the view of motion, which sets it. @type {{stage: any, plots: any} | null} */
    this.scene = null;
    /** Goes to a view. @type {(key: string) => void} */
    this.show = () => {};
  }

  /** The contents of a link. */
  snapshot() {
    const {text, name, experiment, view, stop, cursor, window, factor, rate} = this;
    return {text, name, experiment, view, stop, cursor, window, factor, rate};
  }

  // ---- The text and its history

  /** Opens a case. @param {string} text @param {Partial<Case>} [of] */
  open(
    text,
    {
      name = "studio.toml",
      path = "",
      experiment = 0,
      original = text,
      safe = text,
      set = [],
      past = [],
      future = [],
      isTouched = false,
      isBuiltIn = false,
    } = {},
  ) {
    this.tell("leave");
    Object.assign(this, {
      name,
      path,
      experiment,
      original,
      safe,
      base: text,
      text,
      past,
      future,
      isTouched,
      isBuiltIn,
      before: null,
      pins: [],
      window: null,
      section: null,
      cursor: 0,
      isPlaying: false,
      needsDescription: true,
      run: null,
      mistake: null,
      gesture: false,
      lastEdit: -Infinity,
      moved: [],
    });
    this.pending = new Map(set);
    this.tell("text", "window", "compare", "play", "cursor");
    this.ask(() => this.tell("opened"));
  }

  /** The case as it can be opened again. @returns {Case} */
  get case() {
    const {name, path, experiment, original, safe, base, past, future, isTouched, isBuiltIn, isUnsaved} = this;
    const at = new Date().toTimeString().slice(0, 5);
    return {
      name,
      path,
      experiment,
      original,
      safe,
      base,
      set: [...this.pending],
      past,
      future,
      isTouched,
      isBuiltIn,
      isUnsaved,
      at,
    };
  }

  /** Whether there is work that stands nowhere else. */
  get isUnsaved() {
    return this.isTouched && (this.text !== this.safe || this.pending.size > 0);
  }

  /** The case, as it is remembered. @returns {State} */
  get present() {
    return {text: this.base, set: [...this.pending]};
  }

  /** Remembers the case as it is, to be undone to. */
  remember() {
    const {present} = this;
    if (JSON.stringify(present) !== JSON.stringify(this.past[this.past.length - 1])) this.past.push(present);
    if (this.past.length > MOST_UNDO) this.past.shift();
    this.future = [];
    this.isTouched = true;
    this.before = this.run;
  }

  /** A new text, typed or from elsewhere. @param {string} text @param {boolean} [typed] */
  edit(text, typed = false) {
    if (text === this.text && !this.pending.size) return;
    const now = performance.now();
    // What is typed in one go is undone in one go.
    if (!typed || now - this.lastEdit > 1500) this.remember();
    this.lastEdit = typed ? now : -Infinity;
    this.base = this.text = text;
    this.pending.clear();
    this.needsDescription = true;
    this.tell("text");
    this.ask();
  }

  /** A parameter under a slider, or typed. @param {string} key @param {number | string} value in SI, or with a unit */
  drag(key, value) {
    const isFirst = !this.gesture;
    if (isFirst) {
      this.gesture = true;
      this.remember();
    }
    if (!this.moved.includes(key)) this.moved = [key, ...this.moved].slice(0, MOST_MOVED);
    this.pending.set(key, value);
    this.ask();
    // It can be undone, even where it is refused.
    if (isFirst) this.tell("text");
  }

  /** Takes a change back that was refused. @param {string} key */
  withdraw(key) {
    if (this.mistake && this.pending.delete(key)) this.ask();
  }

  /** The end of a drag. */
  drop() {
    if (!this.gesture) return;
    this.gesture = false;
    // Otherwise the answer that is under way does it.
    if (this.isCurrent) {
      this.settle();
      this.tell("text");
    }
  }

  /** What was dragged is part of the text now. */
  settle() {
    this.base = this.text;
    this.pending.clear();
  }

  undo() {
    this.turn(this.past, this.future);
  }
  redo() {
    this.turn(this.future, this.past);
  }
  reset() {
    this.edit(this.original);
  }

  /** @param {State[]} from @param {State[]} to */
  turn(from, to) {
    const state = from.pop();
    if (state === undefined) return;
    to.push(this.present);
    this.before = this.run;
    this.base = this.text = state.text;
    this.pending = new Map(state.set);
    this.needsDescription = true;
    this.tell("text");
    this.ask();
  }

  // ---- Runs

  /** The case as requests name it. */
  body() {
    return {text: this.base, set: [...this.pending], experiment: this.experiment};
  }

  /** Asks for the run of the case as it is now. @param {() => void} [then] */
  ask(then) {
    this.sent++;
    this.isCurrent = false;
    let asked = this.sent,
      describes = false;
    this.wire.newest(
      "run",
      () => {
        asked = this.sent;
        // A text that comes while this one is under way asks for a description of its own.
        describes = this.needsDescription;
        this.needsDescription = false;
        return {...this.body(), describe: describes};
      },
      (answer, error) => {
        if (!answer && describes) this.needsDescription = true;
        // Something newer is on its way.
        if (asked === this.sent || answer) this.take(answer, error, asked === this.sent);
        if (then) then();
      },
    );
  }

  /** @param {Answer | null} answer @param {Error | null} error @param {boolean} isLast */
  take(answer, error, isLast) {
    if (!answer) {
      const mistake = error instanceof Mistake ? error.mistake : {what: String(error && error.message), next: ""};
      this.mistake = mistake;
      this.tell("mistake");
      return;
    }
    this.mistake = null;
    this.run = answer;
    // Of an answer that is overtaken already, neither experiment nor text are those that were chosen since.
    if (isLast) this.experiment = answer.head.experiment;
    if (answer.head.parameters) this.parameters = answer.head.parameters;
    else {
      const values = new Map(answer.head.values);
      for (const parameter of this.parameters) {
        const value = values.get(parameter.key);
        if (value !== undefined) parameter.value = value;
      }
    }
    if (isLast) {
      this.isCurrent = true;
      this.text = answer.head.text;
      if (!this.gesture) this.settle();
      this.tell("text");
    }
    if (this.cursor > this.until) this.cursor = this.until;
    if (this.window) this.refine();
    else if (this.section) this.section = null;
    this.tell("mistake", "run");
  }

  /** @param {number} experiment */
  choose(experiment) {
    Object.assign(this, {experiment, before: null, pins: [], window: null, section: null, cursor: 0});
    this.tell("window", "cursor", "compare");
    this.ask();
  }

  // ---- What is compared

  pin() {
    if (!this.run) return;
    this.pins.push({name: `run ${this.pins.length + 1}`, answer: this.run});
    if (this.pins.length > MOST_PINS) this.pins.shift();
    this.tell("compare");
  }

  unpin() {
    this.pins = [];
    this.before = null;
    this.tell("compare");
  }

  // ---- What is looked at

  /** Shows a part of time, or all. @param {[number, number] | null} window */
  look(window) {
    if (window) {
      const least = Math.max(1e-9, 1e-11 * this.until);
      let [from, to] = window;
      if (to - from < least) {
        const middle = (from + to) / 2;
        from = middle - least / 2;
        to = middle + least / 2;
      }
      from = Math.max(0, from);
      to = Math.min(this.until, to);
      window = from <= 0 && to >= this.until ? null : [from, to];
    }
    this.window = window;
    if (window) this.refine();
    else this.section = null;
    this.tell("window");
  }

  /** Asks for the rows of the window at a finer interval. */
  refine() {
    this.wire.newest(
      "section",
      () => {
        const [from, to] = this.window || [0, this.until];
        return {...this.body(), from, to, points: 2001};
      },
      answer => {
        if (!answer || !this.window) return;
        this.section = answer;
        this.tell("window");
      },
    );
  }

  /** Rows around the cursor for slow motion. @param {number} from @param {number} to */
  lens(from, to) {
    this.wire.newest(
      "section",
      () => ({...this.body(), from, to, points: 2001}),
      answer => {
        if (answer) this.section = answer;
      },
    );
  }
}
