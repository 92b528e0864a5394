// @ts-check
// Carries requests to workers of the browser, which run the commands as a WebAssembly module: one worker for all quick
// acts, and one for each long act. Dropped files are sent to these workers only.

/** Time after which a cancelled act that has not answered is terminated, ms. */
const PATIENCE = 3000;

/** A file that was dropped, and its number. @typedef {{place: number, file: File}} Dropped */

/** @typedef {import("./socket.js").Carrier} Carrier */

/** @implements {Carrier} */
export class Workers {
  /** @param {import("./socket.js").Receiver} wire */
  constructor(wire) {
    this.wire = wire;
    this.words = {
      gone: "The module of this page cannot be loaded. Load the page again; its folder needs "
        + "taut.wasm and worker.js, and the browser vectors in modules (Chrome 91, Firefox 89, Safari 16.4 or later).",
      link: "The address of this page holds this state now: whoever opens it sees the same.",
      loading: "Loading the module that computes…",
      logs: "CSV or MATLAB",
    };
    /** @type {Dropped[]} */
    this.files = [];
    /**
     * Who waits for the path of a file, by its number.
     * @type {Map<number, (kept: {path?: string, error?: string}) => void>}
     */
    this.waiting = new Map();
    /** Long works, by the number of the request. @type {Map<number, {worker: Worker, go: string}>} */
    this.long = new Map();
    /** The acts that are long. @type {Set<string>} */
    this.isLong = new Set();
    /** @type {Promise<void>} */
    this.ready = this.begin();
    this.ready.catch(error => {
      console.error(error);
      wire.changed(false);
    });
  }

  async begin() {
    const answer = await fetch(new URL("taut.wasm", import.meta.url));
    if (!answer.ok) throw new Error(`taut.wasm cannot be loaded: ${answer.status} ${answer.statusText}`);
    // Streaming would require the server to send the type application/wasm.
    this.module = await WebAssembly.compile(await answer.arrayBuffer());
    performance.mark("module");
    await new Promise((done, failed) => {
      this.quick = this.worker(done, failed);
    });
    this.wire.changed(true);
  }

  /**
   * A new worker, with the files that were dropped.
   * @param {(value?: any) => void} begun
   * @param {(error: Error) => void} failed
   * @returns {Worker}
   */
  worker(begun, failed) {
    const worker = new Worker(new URL("worker.js", import.meta.url));
    worker.onmessage = ({data}) => {
      if (data.long) {
        this.isLong = new Set(data.long);
        begun();
      }
      if (data.frame) this.take(data.frame);
      if (data.kept) {
        const take = this.waiting.get(data.place);
        this.waiting.delete(data.place);
        if (take) take(data.kept);
      }
    };
    worker.onerror = event => failed(new Error(event.message || "worker.js cannot be loaded"));
    worker.postMessage({module: this.module, files: this.files});
    return worker;
  }

  /** @param {ArrayBuffer} frame */
  take(frame) {
    const {id, progress} = this.wire.receive(frame);
    if (progress === undefined) this.end(id);
  }

  /** Ends the worker of a long work. @param {number} id @returns {boolean} whether it was there */
  end(id) {
    const work = this.long.get(id);
    if (!work) return false;
    this.long.delete(id);
    work.worker.terminate();
    URL.revokeObjectURL(work.go);
    return true;
  }

  /** @param {{id: number, do?: string, of?: number}} request */
  send(request) {
    const {id} = request,
      ask = JSON.stringify(request);
    if (request.do === "cancel") this.cancel(id, request.of || 0);
    else if (this.isLong.has(request.do || "")) {
      // A busy worker receives no messages, but it notices that this address was revoked.
      const go = URL.createObjectURL(new Blob(["go"]));
      const worker = this.worker(
        () => {},
        error => {
          this.end(id);
          this.fail(id, error.message);
        },
      );
      this.long.set(id, {worker, go});
      worker.postMessage({ask, go});
    } else /** @type {Worker} */ (this.quick).postMessage({ask});
  }

  /** @param {number} id of the request @param {number} of the work */
  cancel(id, of) {
    const work = this.long.get(of);
    if (work) {
      URL.revokeObjectURL(work.go);
      setTimeout(() => {
        if (this.end(of)) this.fail(of, "stopped before there was a result");
      }, PATIENCE);
    }
    this.wire.take({head: {id, cancelled: !!work}, columns: new Map()});
  }

  /** @param {number} id @param {string} what */
  fail(id, what) {
    this.wire.take({head: {id, error: {what, text: what}}, columns: new Map()});
  }

  /** @param {File} file @returns {Promise<string>} */
  async upload(file) {
    await this.ready;
    const place = this.files.length,
      dropped = {place, file};
    this.files.push(dropped);
    const kept = await new Promise(done => {
      this.waiting.set(place, done);
      /** @type {Worker} */ (this.quick).postMessage({file: dropped});
    });
    if (kept.path !== undefined) return kept.path;
    this.files = this.files.filter(other => other !== dropped);
    throw new Error(kept.error);
  }
}
