// @ts-check
// Long work of a view, one at a time: the buttons that begin it are disabled meanwhile, and another one stops it.
import {element} from "./format.js";

/** @typedef {import("./wire.js").Answer} Answer */

export class LongWork {
  /**
   * @param {import("./wire.js").Wire} wire
   * @param {HTMLButtonElement[]} begins
   * @param {{id: string, words: string}} stop
   */
  constructor(wire, begins, {id, words}) {
    this.wire = wire;
    this.begins = begins;
    /** The request under way. @type {number | null} */
    this.id = null;
    this.stopButton = element("button", {type: "button", id, hidden: true, onclick: () => this.stop()}, words);
  }

  /** Whether its answer is to come. */
  get isRunning() {
    return this.id !== null;
  }

  /** Begins it; see `Wire.ask`. Once the work is left, there is neither progress nor an answer nor an error.
   * @param {string} act
   * @param {Object} body
   * @param {(step: any) => void} progress
   * @returns {Promise<Answer>} */
  async ask(act, body, progress) {
    const asked = this.wire.ask(act, body, progress);
    this.mark(asked.id);
    try {
      return await asked;
    } finally {
      this.mark(null);
    }
  }

  /** Asks for the best so far: the answer is still to come. */
  stop() {
    if (this.id !== null) this.wire.cancel(this.id);
  }

  /** Stops it for good. */
  leave() {
    if (this.id !== null) this.wire.leave(this.id);
    this.mark(null);
  }

  /** @param {number | null} id */
  mark(id) {
    this.id = id;
    for (const button of this.begins) button.disabled = this.isRunning;
    this.stopButton.hidden = !this.isRunning;
  }
}
