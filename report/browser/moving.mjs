// Makes the moving picture of the README from the real page: a drag of a slider, then the motion, as a GIF.
//
//   node moving.mjs BROWSER TAUT OUT.gif
import {spawn} from "node:child_process";
import {writeFileSync} from "node:fs";
import {chromium} from "playwright-core";

const [program, taut, out] = process.argv.slice(2);
const WIDE = 1280,
  HIGH = 860,
  HUNDREDTHS = 8;
const child = spawn(taut, ["studio", "stages/sollmann-jouaneh/table4.toml", "--no-open"], {
  stdio: ["ignore", "pipe", "inherit"],
});
const address = await new Promise(done => child.stdout.once("data", data => done(String(data).split("\n")[0])));
const asRoot = process.getuid && process.getuid() === 0;
const browser = await chromium.launch({
  executablePath: program,
  args: ["--disable-background-networking", ...(asRoot ? ["--no-sandbox"] : [])],
});
const context = await browser.newContext({viewport: {width: WIDE, height: HIGH}, colorScheme: "light"});
const page = await context.newPage(),
  tool = await context.newPage();
await page.goto(address);
await page.waitForFunction(() => window.studio && window.studio.run && !window.studio.wire.isBusy);

// ---- The pictures

const frames = [];
const keep = async () => frames.push((await page.screenshot({type: "png"})).toString("base64"));
const settle = () =>
  page
    .waitForFunction(() => !window.studio.wire.isBusy)
    .then(() => page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))));
await page.evaluate(() => {
  window.studio.factor = 400;
  window.studio.seek(0);
});
await page.locator('[data-key="cart.mass"] input[type=range]').scrollIntoViewIfNeeded();
await settle();
for (let k = 0; k < 22; k++) {
  await page.evaluate(k => {
    window.studio.seek((0.3 * k) / 21);
  }, k);
  await settle();
  await keep();
}
// Where the cart swings most: 2 % of the run, and its mass under the slider.
await page.evaluate(() => {
  window.studio.look([0.24, 0.3]);
  window.studio.seek(0.256);
});
await settle();
for (let k = 0; k < 26; k++) {
  await page.evaluate(k => {
    const mass = Number((0.362 * 4 ** Math.sin((Math.PI * k) / 25)).toPrecision(4)),
      row = document.querySelector('[data-key="cart.mass"]');
    const slider = /** @type {HTMLInputElement} */ (row.querySelector("input[type=range]"));
    slider.value = String(Math.round(500 + 500 * Math.log10(mass / 0.362)));
    row.querySelector("input[type=text]").value = String(mass);
    window.studio.drag("cart.mass", mass);
  }, k);
  await settle();
  await keep();
}
child.kill("SIGTERM");

// ---- The file

// Pixels of a picture, as numbers 0xRRGGBB.
const pixels = frame =>
  tool
    .evaluate(
      async ([frame, wide, high]) => {
        const bytes = Uint8Array.from(atob(frame), c => c.charCodeAt(0));
        const bitmap = await createImageBitmap(new Blob([bytes], {type: "image/png"}));
        const canvas = new OffscreenCanvas(wide, high),
          pen = canvas.getContext("2d");
        pen.drawImage(bitmap, 0, 0, wide, high);
        const {data} = pen.getImageData(0, 0, wide, high);
        let text = "";
        for (let i = 0; i < data.length; i += 4) text += String.fromCharCode(data[i], data[i + 1], data[i + 2]);
        return btoa(text);
      },
      [frame, WIDE, HIGH],
    )
    .then(text => Buffer.from(text, "base64"));

const pictures = [];
for (const frame of frames) pictures.push(await pixels(frame));
await browser.close();

// The colours that occur most, to five bits each; each other one becomes the nearest of them.
const counts = new Map();
const coarse = (data, i) => ((data[i] & 0xf8) << 16) | ((data[i + 1] & 0xf8) << 8) | (data[i + 2] & 0xf8);
for (const data of pictures)
  for (let i = 0; i < data.length; i += 3) {
    const c = coarse(data, i);
    counts.set(c, (counts.get(c) || 0) + 1);
  }
const whole = colour => colour | ((colour >> 5) & 0x070707);
const palette = [...counts]
  .sort((a, b) => b[1] - a[1])
  .slice(0, 63)
  .map(([colour]) => whole(colour));
const nearest = new Map();
for (const colour of counts.keys()) {
  let best = 0,
    least = Infinity;
  palette.forEach((one, k) => {
    const away = [16, 8, 0].reduce(
      (sum, shift) => sum + (((whole(colour) >> shift) & 255) - ((one >> shift) & 255)) ** 2,
      0,
    );
    if (away < least) {
      least = away;
      best = k;
    }
  });
  nearest.set(colour, best);
}
const SAME = 63; // transparent: as in the picture before

// Lempel, Ziv and Welch, as GIF has it: codes of growing length, 6 bits a pixel.
function compress(indices) {
  const out = [];
  let bits = 0,
    count = 0,
    size = 7,
    next = 66,
    table = new Map();
  const put = code => {
    bits |= code << count;
    count += size;
    while (count >= 8) {
      out.push(bits & 255);
      bits >>>= 8;
      count -= 8;
    }
  };
  put(64);
  let prefix = indices[0];
  for (let i = 1; i < indices.length; i++) {
    const key = (prefix << 6) | indices[i],
      known = table.get(key);
    if (known !== undefined) {
      prefix = known;
      continue;
    }
    put(prefix);
    if (next === 4096) {
      put(64);
      table = new Map();
      next = 66;
      size = 7;
    } else {
      if (next === 1 << size) size++;
      table.set(key, next++);
    }
    prefix = indices[i];
  }
  put(prefix);
  put(65);
  if (count) out.push(bits & 255);
  return out;
}

const file = [...Buffer.from("GIF89a"), WIDE & 255, WIDE >> 8, HIGH & 255, HIGH >> 8, 0xf5, 0, 0];
for (let k = 0; k < 64; k++) {
  const c = palette[k] || 0;
  file.push((c >> 16) & 255, (c >> 8) & 255, c & 255);
}
file.push(0x21, 0xff, 11, ...Buffer.from("NETSCAPE2.0"), 3, 1, 0, 0, 0);
let before = null;
pictures.forEach((data, number) => {
  const now = new Uint8Array(WIDE * HIGH);
  for (let i = 0; i < now.length; i++) now[i] = nearest.get(coarse(data, 3 * i));
  // The box of all that changed.
  let [left, top, right, bottom] = [WIDE, HIGH, -1, -1];
  for (let y = 0; y < HIGH; y++)
    for (let x = 0; x < WIDE; x++)
      if (!before || now[y * WIDE + x] !== before[y * WIDE + x]) {
        left = Math.min(left, x);
        right = Math.max(right, x);
        top = Math.min(top, y);
        bottom = Math.max(bottom, y);
      }
  if (right < 0) [left, top, right, bottom] = [0, 0, 0, 0];
  const wide = right - left + 1,
    high = bottom - top + 1,
    indices = new Uint8Array(wide * high);
  for (let y = 0; y < high; y++)
    for (let x = 0; x < wide; x++) {
      const at = (y + top) * WIDE + x + left;
      indices[y * wide + x] = before && now[at] === before[at] ? SAME : now[at];
    }
  before = now;
  const pause = number === 21 || number === pictures.length - 1 ? 90 : HUNDREDTHS;
  file.push(0x21, 0xf9, 4, 0x05, pause & 255, pause >> 8, SAME, 0);
  file.push(0x2c, ...[left, top, wide, high].flatMap(value => [value & 255, value >> 8]));
  file.push(0, 6);
  const packed = compress(indices);
  for (let i = 0; i < packed.length; i += 255) {
    const part = packed.slice(i, i + 255);
    file.push(part.length, ...part);
  }
  file.push(0);
});
file.push(0x3b);
writeFileSync(out, Buffer.from(file));
console.log(`${out}: ${pictures.length} pictures, ${(file.length / 1e6).toFixed(2)} MB`);
