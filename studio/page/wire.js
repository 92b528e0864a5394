// @ts-check
// The conversation with the server: requests go out as JSON, answers come back as frames of a JSON head and columns.

/**
 * @typedef {Object} Answer
 * @property {any} head
 * @property {Map<string, Float64Array>} columns
 */

/** A mistake that the server found, with its place in the case.
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
    /** @type {Map<number, {done: (answer: Answer) => void, failed: (error: Error) => void, progress?: (step: any) => void}>} */
    this.open = new Map();
    /** @type {Map<string, {busy: boolean, next: null | (() => void)}>} */
    this.lanes = new Map();
    /** @type {(isOpen: boolean) => void} */
    this.changed = () => {};
    /** @type {Promise<WebSocket>} */
    this.socket = this.connect();
  }

  /** Whether an answer is to come. */
  get isBusy() { return this.open.size > 0 || [...this.lanes.values()].some(lane => lane.busy); }

  /** @returns {Promise<WebSocket>} */
  connect() {
    return new Promise((done, failed) => {
      const socket = new WebSocket(`ws://${location.host}/socket`);
      socket.binaryType = "arraybuffer";
      socket.onopen = () => { this.changed(true); done(socket); };
      socket.onmessage = event => this.take(unpack(event.data));
      socket.onclose = () => {
        failed(new Error("the server has ended"));
        for (const {failed: fail} of this.open.values()) fail(new Error("the server has ended"));
        this.open.clear();
        this.changed(false);
        // It may have been this computer that slept.
        setTimeout(() => { this.socket = this.connect(); this.socket.catch(() => {}); }, 3000);
      };
    });
  }

  /** @param {Answer} answer */
  take(answer) {
    const {id, error, progress} = answer.head, waiting = this.open.get(id);
    if (!waiting) return;
    if (progress !== undefined) { if (waiting.progress) waiting.progress(progress); return; }
    this.open.delete(id);
    if (error) waiting.failed(new Mistake(error)); else waiting.done(answer);
  }

  /** Asks, and waits for the answer.
   * @param {string} act
   * @param {Object} [body]
   * @param {(step: any) => void} [progress] how far long work is
   * @returns {Promise<Answer> & {id: number}} */
  ask(act, body = {}, progress = undefined) {
    const id = ++this.last;
    const answer = this.socket.then(socket => new Promise((done, failed) => {
      this.open.set(id, {done, failed, progress});
      socket.send(JSON.stringify({id, do: act, ...body}));
    }));
    return Object.assign(answer, {id});
  }

  /** Stops long work. @param {number} id */
  cancel(id) { return this.ask("cancel", {of: id}); }

  /** Asks for the newest of a kind alone: what is asked for while another of its kind is under way waits, and only the
   * last that waits is asked for. So the last picture is always of the last value.
   * @param {string} act
   * @param {() => Object} body made when it is sent
   * @param {(answer: Answer | null, error: Error | null) => void} take */
  newest(act, body, take) {
    const lane = this.lanes.get(act) || {busy: false, next: null};
    this.lanes.set(act, lane);
    const go = () => {
      lane.busy = true;
      lane.next = null;
      this.ask(act, body()).then(answer => take(answer, null), error => take(null, error)).finally(() => {
        lane.busy = false;
        if (lane.next) lane.next();
      });
    };
    if (lane.busy) lane.next = go; else go();
  }
}
