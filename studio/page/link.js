// @ts-check
// A state as a link: everything stands behind the `#`, which browsers keep to themselves. It is compressed in the
// format of zlib, whose checksum tells when a letter was changed or lost on the way.

/** Bytes of a state at most: a link is from anywhere, and a few of its letters can mean gigabytes. */
const MOST = 4 << 20;

/** @param {Uint8Array} bytes @param {"compress"|"expand"} way @returns {Promise<Uint8Array>} */
async function through(bytes, way) {
  const stream = way === "compress" ? new CompressionStream("deflate") : new DecompressionStream("deflate");
  const reader = new Blob([/** @type {BlobPart} */ (bytes)]).stream().pipeThrough(stream).getReader();
  const parts = [];
  let length = 0;
  for (;;) {
    const {done, value} = await reader.read();
    if (done) break;
    parts.push(value);
    length += value.length;
    if (length > MOST) throw new Error("this state is too long");
  }
  const whole = new Uint8Array(length);
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

/** The fragment of a state. @param {Object} state @returns {Promise<string>} */
export async function fragment(state) {
  const bytes = await through(new TextEncoder().encode(JSON.stringify(state)), "compress");
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return "#state=" + btoa(text).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** The state of a fragment; null where it holds none. Throws where it holds one that is damaged.
 * @param {string} hash @returns {Promise<any>} */
export async function stateOf(hash) {
  const found = /[#&]state=([^&]*)/.exec(hash);
  if (!found) return null;
  try {
    const text = atob(found[1].replace(/-/g, "+").replace(/_/g, "/"));
    const bytes = await through(
      Uint8Array.from(text, c => c.charCodeAt(0)),
      "expand",
    );
    const state = JSON.parse(new TextDecoder().decode(bytes));
    if (typeof state.text === "string") return state;
  } catch {
    /* told below */
  }
  throw new Error(
    "This link is damaged: a part of it was lost or changed, and its case cannot be opened. Copy the whole link again.",
  );
}
