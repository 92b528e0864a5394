// How quick the studio is: cargo xtask drag runs this and prints the table of docs/studio.md.
//
//   node drag.mjs BROWSER TAUT [--seconds 5] [--drags 1000]
//
// TAUT is the program, or the folder that `cargo xtask web` makes, which needs no server.
// With the paper's machine, in headless Chromium: pictures a second while a slider is dragged at constant speed, the
// time
// from an input to the picture that shows it, random drags whose last value must not be lost, the first picture after
// the start, and what the page weighs.
import {readFileSync, statSync} from "node:fs";
import {cpus, loadavg} from "node:os";
import {performance} from "node:perf_hooks";
import {Harness, quiet} from "./harness.mjs";

const [program, taut, ...words] = process.argv.slice(2);
const option = (name, usual) => {
  const place = words.indexOf(name);
  return place < 0 ? usual : Number(words[place + 1]);
};
const SECONDS = option("--seconds", 5),
  DRAGS = option("--drags", 1000),
  RATE = 125;
const isFolder = statSync(taut).isDirectory();
/** Pictures a second wanted at least. */
const WANTED = isFolder ? 50 : 30;
const CASE = "stages/sollmann-jouaneh/table4.toml",
  KEY = "cart.mass";
const harness = new Harness(program, taut);
await harness.start();
const load = loadavg()[0];
const part = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];

/** The address of a new server, and what ends it. */
async function begin() {
  if (isFolder) return {address: (await harness.serveFolder(taut)).address, end: () => {}};
  const {address, child} = await harness.serve([CASE]);
  return {address, end: () => child.kill("SIGTERM")};
}

/** Waits for the first picture. */
async function shown(page) {
  await page.waitForFunction(() => window.studio && window.studio.drawn, null, {polling: "raf"});
}

/** Opens the case in a page that no program opened it in. */
async function open(page) {
  await shown(page);
  if (!isFolder) return;
  await page.evaluate(text => window.studio.open(text, {name: "table4.toml"}), readFileSync(CASE, "utf8"));
  await quiet(page);
}

// ---- From the start of the program, or of loading, to the first picture

const firsts = [];
for (let k = 0; k < 3; k++) {
  const begun = performance.now();
  const {address, end} = await begin(),
    served = performance.now();
  const context = await harness.browser.newContext({viewport: {width: 1400, height: 950}}),
    page = await context.newPage();
  await page.goto(address, {waitUntil: "commit"});
  await shown(page);
  const now = performance.now();
  // The page notes when it has loaded and compiled its module.
  const loaded = await page.evaluate(() => {
    const mark = performance.getEntriesByName("module")[0];
    return mark ? performance.now() - mark.startTime : NaN;
  });
  firsts.push({served: served - begun, whole: now - begun, loaded});
  await context.close();
  end();
}
const first = firsts.sort((a, b) => a.whole - b.whole)[1];

// ---- What the page weighs

const {address} = await begin();
const weights = [];
const context = await harness.browser.newContext({viewport: {width: 1400, height: 950}});
{
  const page = await context.newPage();
  page.on("response", response =>
    weights.push(
      response
        .body()
        .then(body => [new URL(response.url()).pathname, body.length])
        .catch(() => null),
    ),
  );
  await page.goto(address);
  await shown(page);
  await page.waitForTimeout(300);
  await page.close();
}
const files = (await Promise.all(weights)).filter(Boolean).filter(([, bytes]) => bytes);

// ---- A drag of constant speed

const page = await context.newPage();
await page.goto(address);
await open(page);
// Inputs come as those of a mouse do, 125 a second, each from a task of its own; a picture counts with the frame that
// shows a run which was not shown before.
const drag = await page.evaluate(
  async ({seconds, rate, key}) => {
    const app = window.studio,
      inputs = [],
      pictures = [],
      waits = [];
    const values = new Map();
    let shown = app.drawn,
      isOver = false;
    const watch = () => {
      if (app.drawn !== shown) {
        shown = app.drawn;
        const now = performance.now(),
          value = new Map(shown.head.values).get(key);
        pictures.push(now);
        // All inputs up to this value are on screen now: the newest wins.
        const at = inputs.findIndex(one => one.value === value);
        if (at >= 0) for (const one of inputs.splice(0, at + 1)) waits.push(now - one.time);
      }
      if (!isOver || app.wire.open.size || inputs.length) requestAnimationFrame(watch);
    };
    requestAnimationFrame(watch);
    const begun = performance.now(),
      channel = new MessageChannel();
    let sent = 0;
    await new Promise(done => {
      channel.port1.onmessage = () => {
        const now = performance.now();
        if (now - begun > 1000 * seconds) {
          done();
          return;
        }
        if (now - begun >= (1000 * sent) / rate) {
          const value = Number((0.2 + 1.6 * (sent / (seconds * rate))).toPrecision(6));
          sent++;
          inputs.push({value, time: now});
          app.drag(key, value);
        }
        setTimeout(() => channel.port2.postMessage(0), 0);
      };
      channel.port2.postMessage(0);
    });
    app.drop();
    isOver = true;
    const until = performance.now() + 5000;
    while ((app.wire.open.size || inputs.length) && performance.now() < until)
      await new Promise(done => setTimeout(done, 10));
    void values;
    return {
      sent,
      waits,
      lost: inputs.length,
      rate: pictures.filter(time => time <= begun + 1000 * seconds).length / seconds,
    };
  },
  {seconds: SECONDS, rate: RATE, key: KEY},
);
const waits = drag.waits.sort((a, b) => a - b);

// ---- Random drags: how often the last value is not what is shown in the end

const lost = await page.evaluate(
  async ({drags, key}) => {
    const app = window.studio;
    let seed = 1,
      lost = 0;
    const chance = () => {
      seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
      return seed / 2 ** 32;
    };
    for (let k = 0; k < drags; k++) {
      let last = 0;
      for (let n = 1 + Math.floor(8 * chance()); n > 0; n--) {
        last = Number((0.1 + 2 * chance()).toPrecision(4));
        app.drag(key, last);
        if (chance() < 0.5) await new Promise(done => setTimeout(done, 12 * chance()));
      }
      app.drop();
      // A request counts as open from the next task on.
      do await new Promise(done => setTimeout(done, 4));
      while (app.wire.open.size);
      await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
      const shown = new Map(app.drawn.head.values).get(key),
        value = app.parameters.find(one => one.key === key).value;
      if (shown !== last || value !== last || app.drawn !== app.run) lost++;
    }
    return lost;
  },
  {drags: DRAGS, key: KEY},
);
await quiet(page);

// ---- The table

const ms = value => `${value.toFixed(value < 10 ? 1 : 0)} ms`,
  kB = bytes => `${(bytes / 1000).toFixed(1)} kB`;
const total = files.reduce((sum, [, bytes]) => sum + bytes, 0);
const largest = [...files]
  .sort((a, b) => b[1] - a[1])
  .slice(0, 5)
  .map(([path, bytes]) => `${path.slice(path.lastIndexOf("/") + 1) || "index.html"} ${kB(bytes)}`)
  .join(", ");
const rows = [
  ["pictures a second during a drag of constant speed", `${drag.rate.toFixed(1)}`, `at least ${WANTED}`],
  ["inputs of that drag", `${drag.sent} in ${SECONDS} s, ${drag.lost} lost`, "0 lost"],
  ["from an input to its picture: half within", ms(part(waits, 0.5)), ""],
  ["95 % within", ms(part(waits, 0.95)), "50 ms"],
  ["all within", ms(waits[waits.length - 1] ?? NaN), ""],
  [`random drags of which the last value was lost`, `${lost} of ${DRAGS}`, "0"],
  ...(isFolder
    ? [
        ["from the address to the first picture", ms(first.whole), ""],
        ["from the loaded module to the first picture", ms(first.loaded), "1 s"],
      ]
    : [
        ["from the start of the program to its address", ms(first.served), ""],
        ["to the first picture", ms(first.whole), "1 s"],
      ]),
  ["weight of the page", `${kB(total)} in ${files.length} files: ${largest}`, ""],
];
console.log("| what | measured | wanted |\n|---|---|---|");
for (const row of rows) console.log(`| ${row.join(" | ")} |`);
console.log(
  `\nOn ${cpus().length} processors (${cpus()[0].model.trim()}) with a load of ${load.toFixed(1)} before it began, `
    + `Chromium ${harness.browser.version()}.`,
);
await harness.browser.close();
for (const child of harness.servers) child.kill("SIGTERM");
const isGood =
  drag.rate >= WANTED
  && part(waits, 0.95) <= 50
  && lost === 0
  && drag.lost === 0
  && (isFolder ? first.loaded : first.whole) < 1000;
process.exit(isGood ? 0 : 1);
