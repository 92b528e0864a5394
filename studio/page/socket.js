// @ts-check
// Carries requests to the server that served the page.

const ENDED = "the server has ended";

/** What the page says of a carrier.
 * @typedef {{gone: string, link: string, loading: string, logs: string}} Words */
/** What a carrier does: `ready` when it can send.
 * @typedef {{ready: Promise<void>, send: (request: {id: number}) => void,
 *   upload: (file: File) => Promise<string>, words: Words}} Carrier */
/** Who takes its answers, and is told whether it works.
 * @typedef {Object} Receiver
 * @property {(works: boolean) => void} changed
 * @property {(why: string) => void} lose
 * @property {(frame: ArrayBuffer) => any} receive
 * @property {(answer: {head: any, columns: Map<string, Float64Array>}) => void} take */

/** @implements {Carrier} */
export class Socket {
  /** @param {Receiver} wire */
  constructor(wire) {
    this.wire = wire;
    this.words = {
      gone:
        "The server does not answer any more: start taut studio again. The text of this page is "
        + "still here to be downloaded.",
      link: "The address of this page holds this state now. Open it elsewhere with: taut studio LINK",
      loading: "Connecting to the server…",
      logs: "CSV, MATLAB or Parquet",
    };
    /** @type {Promise<void>} */
    this.ready = this.connect();
  }

  /** @returns {Promise<void>} */
  connect() {
    return new Promise((done, failed) => {
      this.socket = new WebSocket(`ws://${location.host}/socket`);
      this.socket.binaryType = "arraybuffer";
      this.socket.onopen = () => {
        this.wire.changed(true);
        done();
      };
      this.socket.onmessage = event => this.wire.receive(event.data);
      this.socket.onclose = () => {
        failed(new Error(ENDED));
        this.wire.lose(ENDED);
        // It may have been this computer that slept.
        setTimeout(() => {
          this.ready = this.connect();
          this.ready.catch(() => {});
        }, 3000);
      };
    });
  }

  /** @param {{id: number}} request */
  send(request) {
    /** @type {WebSocket} */ (this.socket).send(JSON.stringify(request));
  }

  /** @param {File} file @returns {Promise<string>} */
  async upload(file) {
    const answer = await fetch(`/upload?name=${encodeURIComponent(file.name)}`, {method: "POST", body: file});
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return (await answer.json()).path;
  }
}
