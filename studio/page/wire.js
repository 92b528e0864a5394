// @ts-check
// The conversation with what computes: requests go out as JSON, answers come back as frames of a JSON head and columns.
// A carrier takes them there and back: a socket to the server that served the page, or workers of the browser.
import {Socket} from "./socket.js";
import {Workers} from "./workers.js";

/** @typedef {import("./socket.js").Carrier} Carrier */

/**
 * @typedef {Object} Answer
 * @property {any} head
 * @property {Map<string, Float64Array>} columns
 */

/** A mistake that was found, with its place in the case.
 * @property {any} mistake */
export class Mistake extends Error {
  /** @param {any} mistake */
  constructor(mistake) {
    super(mistake.what);
    /** @type {any} */
    this.mistake = mistake;
  }
}

/** Takes a frame apart: the head's length, the head, and its columns one after another, little-endian.
 * @param {ArrayBuffer} buffer
 * @returns {Answer} */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  /** @type {Map<string, Float64Array>} */
  const columns = new Map();
  let at = 4 + length;
  for (const {name, rows} of head.columns || []) {
    columns.set(name, new Float64Array(buffer, at, rows));
    at += 8 * rows;
  }
  return {head, columns};
}

export class Wire {
  constructor() {
    this.last = 0;
    /**
     * @type {Map<number, {done: (answer: Answer) => void, failed: (error: Error) => void,
     * progress?: (step: any) => void}>}
     */
    this.open = new Map();
    /** @type {Map<string, {busy: boolean, next: null | (() => void)}>} */
    this.lanes = new Map();
    /** @type {(isOpen: boolean) => void} */
    this.changed = () => {};
    /** A page that needs no server says so. @type {Carrier} */
    this.carrier = document.querySelector("meta[name=carrier][content=workers]") ? new Workers(this) : new Socket(this);
  }

  /** Whether an answer is to come. */
  get isBusy() {
    return this.open.size > 0 || [...this.lanes.values()].some(lane => lane.busy);
  }

  /** What was asked for is answered no more. @param {string} why */
  lose(why) {
    for (const {failed} of this.open.values()) failed(new Error(why));
    this.open.clear();
    this.changed(false);
  }

  /** Takes a frame. @param {ArrayBuffer} buffer @returns {any} its head */
  receive(buffer) {
    const answer = unpack(buffer);
    this.take(answer);
    return answer.head;
  }

  /** @param {Answer} answer */
  take(answer) {
    const {id, error, progress} = answer.head,
      waiting = this.open.get(id);
    if (!waiting) return;
    if (progress !== undefined) {
      if (waiting.progress) waiting.progress(progress);
      return;
    }
    this.open.delete(id);
    if (error) waiting.failed(new Mistake(error));
    else waiting.done(answer);
  }

  /** Asks, and waits for the answer.
   * @param {string} act
   * @param {Object} [body]
   * @param {(step: any) => void} [progress] how far long work is
   * @returns {Promise<Answer> & {id: number}} */
  ask(act, body = {}, progress = undefined) {
    const id = ++this.last;
    const answer = new Promise((done, failed) => {
      this.open.set(id, {done, failed, progress});
      const send = () => this.open.has(id) && this.carrier.send({id, do: act, ...body});
      this.carrier.ready.then(send).catch(error => {
        this.open.delete(id);
        failed(error);
      });
    });
    return Object.assign(answer, {id});
  }

  /** Stops long work; its answer is still to come. @param {number} id */
  cancel(id) {
    return this.ask("cancel", {of: id});
  }

  /** Stops long work and ends the wait for it: what arrives of it is dropped here, and its promise is never settled.
   * @param {number} id */
  leave(id) {
    this.open.delete(id);
    return this.cancel(id);
  }

  /** Sends a file. @param {File} file @returns {Promise<string>} the path that acts know it by */
  upload(file) {
    return this.carrier.upload(file);
  }

  /** Asks for the newest of a kind alone: what is asked for while another of its kind is under way waits, and only the
   * last that waits is asked for. So the last picture is always of the last value. What the server replaced by a newer
   * request of this kind has no answer to take.
   * @param {string} act
   * @param {() => Object} body made when it is sent
   * @param {(answer: Answer | null, error: Error | null) => void} take */
  newest(act, body, take) {
    const lane = this.lanes.get(act) || {busy: false, next: null};
    this.lanes.set(act, lane);
    const go = () => {
      lane.busy = true;
      lane.next = null;
      this.ask(act, body())
        .then(
          answer => answer.head.replaced || take(answer, null),
          error => take(null, error),
        )
        .finally(() => {
          lane.busy = false;
          if (lane.next) lane.next();
        });
    };
    if (lane.busy) lane.next = go;
    else go();
  }
}
