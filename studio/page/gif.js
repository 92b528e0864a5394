// @ts-check
// Pictures after each other as a GIF (CompuServe, GIF89a): one palette for all, of each picture the part that changed.

/** Colours of the palette. */
const COLOURS = 256;
/** Bits of a channel by which colours are told apart, and the number of colours that gives. */
const BITS = 5,
  BINS = 1 << (3 * BITS);

/** The place of a colour among all. @param {Uint8ClampedArray} pixels @param {number} at */
const binOf = (pixels, at) =>
  ((pixels[at] >> (8 - BITS)) << (2 * BITS))
  | ((pixels[at + 1] >> (8 - BITS)) << BITS)
  | (pixels[at + 2] >> (8 - BITS));

/** The most frequent colours of some pictures, as bytes of red, green and blue.
 * @param {Uint8ClampedArray[]} pictures RGBA @returns {Uint8Array} */
export function palette(pictures) {
  const counts = new Uint32Array(BINS),
    examples = new Uint32Array(BINS);
  for (const pixels of pictures) {
    for (let at = 0; at < pixels.length; at += 4) {
      const bin = binOf(pixels, at);
      counts[bin]++;
      examples[bin] = (pixels[at] << 16) | (pixels[at + 1] << 8) | pixels[at + 2];
    }
  }
  const bins = Array.from(counts.keys()).filter(bin => counts[bin]);
  bins.sort((a, b) => counts[b] - counts[a]);
  const colours = new Uint8Array(3 * COLOURS);
  bins.slice(0, COLOURS).forEach((bin, k) => {
    const colour = examples[bin];
    colours.set([colour >> 16, (colour >> 8) & 255, colour & 255], 3 * k);
  });
  return colours;
}

/** Bytes that grow. */
class Bytes {
  constructor() {
    this.all = new Uint8Array(1 << 16);
    this.length = 0;
  }

  /** @param {ArrayLike<number>} bytes */
  add(bytes) {
    while (this.length + bytes.length > this.all.length) {
      const larger = new Uint8Array(2 * this.all.length);
      larger.set(this.all);
      this.all = larger;
    }
    this.all.set(bytes, this.length);
    this.length += bytes.length;
  }

  /** Numbers of 16 bits, the low byte first. @param {...number} numbers */
  words(...numbers) {
    this.add(numbers.flatMap(number => [number & 255, number >> 8]));
  }
}

export class Gif {
  /** @param {number} width @param {number} height pixels @param {Uint8Array} colours the palette */
  constructor(width, height, colours) {
    this.width = width;
    this.height = height;
    this.colours = colours;
    /** The nearest colour of the palette for each colour that came. */
    this.nearest = new Int16Array(BINS).fill(-1);
    /** The picture before, as places in the palette. @type {Uint8Array | null} */
    this.before = null;
    this.bytes = new Bytes();
    this.bytes.add(new TextEncoder().encode("GIF89a"));
    this.bytes.words(width, height);
    // A palette of 2⁸ colours; the background is the first of them; pixels are square.
    this.bytes.add([0xf7, 0, 0]);
    this.bytes.add(colours);
    // It is repeated without end.
    this.bytes.add([0x21, 0xff, 11, ...new TextEncoder().encode("NETSCAPE2.0"), 3, 1, 0, 0, 0]);
  }

  /** Adds a picture. @param {Uint8ClampedArray} pixels RGBA @param {number} delay in hundredths of a second */
  add(pixels, delay) {
    const {width, height, before} = this,
      places = new Uint8Array(width * height);
    for (let k = 0; k < places.length; k++) places[k] = this.place(pixels, 4 * k);
    let [left, top, right, bottom] = [width, height, -1, -1];
    for (let y = 0, k = 0; y < height; y++) {
      for (let x = 0; x < width; x++, k++) {
        if (before && before[k] === places[k]) continue;
        if (x < left) left = x;
        if (x > right) right = x;
        if (y < top) top = y;
        bottom = y;
      }
    }
    // A picture that is the same as before is one pixel of it.
    if (right < 0) [left, top, right, bottom] = [0, 0, 0, 0];
    const [wide, tall] = [right - left + 1, bottom - top + 1],
      part = new Uint8Array(wide * tall);
    for (let y = 0; y < tall; y++) {
      const from = (top + y) * width + left;
      part.set(places.subarray(from, from + wide), y * wide);
    }
    // The picture stays under the next one.
    this.bytes.add([0x21, 0xf9, 4, 4]);
    this.bytes.words(delay);
    this.bytes.add([0, 0, 0x2c]);
    this.bytes.words(left, top, wide, tall);
    this.bytes.add([0, 8]);
    const packed = compressed(part);
    for (let at = 0; at < packed.length; at += 255) {
      const block = packed.subarray(at, at + 255);
      this.bytes.add([block.length]);
      this.bytes.add(block);
    }
    this.bytes.add([0]);
    this.before = places;
  }

  /** The whole file. @returns {Uint8Array<ArrayBuffer>} */
  end() {
    this.bytes.add([0x3b]);
    return this.bytes.all.slice(0, this.bytes.length);
  }

  /** The colour of the palette that is nearest. @param {Uint8ClampedArray} pixels @param {number} at */
  place(pixels, at) {
    const bin = binOf(pixels, at);
    if (this.nearest[bin] >= 0) return this.nearest[bin];
    let best = 0,
      least = Infinity;
    for (let k = 0; k < COLOURS; k++) {
      const [r, g, b] = [0, 1, 2].map(channel => this.colours[3 * k + channel] - pixels[at + channel]),
        far = 2 * r * r + 4 * g * g + 3 * b * b;
      if (far < least) {
        least = far;
        best = k;
      }
    }
    this.nearest[bin] = best;
    return best;
  }
}

/** Bytes packed by the LZW of GIF: codes of 9 to 12 bits. @param {Uint8Array} bytes @returns {Uint8Array} */
function compressed(bytes) {
  const CLEAR = 256,
    END = 257,
    MOST = 4096;
  const out = new Uint8Array(2 * bytes.length + 16);
  let length = 0,
    held = 0,
    count = 0,
    size = 9;
  const put = (/** @type {number} */ code) => {
    held |= code << count;
    count += size;
    while (count >= 8) {
      out[length++] = held & 255;
      held >>>= 8;
      count -= 8;
    }
  };
  /** Codes of a known code followed by a byte. @type {Map<number, number>} */
  let known = new Map(),
    next = END + 1;
  put(CLEAR);
  let now = bytes[0];
  for (let at = 1; at < bytes.length; at++) {
    const both = (now << 8) | bytes[at],
      code = known.get(both);
    if (code !== undefined) {
      now = code;
      continue;
    }
    put(now);
    if (next < MOST) {
      known.set(both, next);
      // The reader knows a code one later than the writer.
      if (next++ === 1 << size && size < 12) size++;
    } else {
      put(CLEAR);
      known = new Map();
      next = END + 1;
      size = 9;
    }
    now = bytes[at];
  }
  put(now);
  // The reader has learnt one more code by now.
  if (next === 1 << size && size < 12) size++;
  put(END);
  if (count) out[length++] = held & 255;
  return out.subarray(0, length);
}
