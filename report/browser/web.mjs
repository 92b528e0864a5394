// Uses the studio without a server in a browser as a person would; cargo xtask browser runs this.
//
//   node web.mjs BROWSER TAUT FOLDER SHOTS [NAME]
//
// TAUT is the program, whose digits are compared; FOLDER is what `cargo xtask web` made. Pictures go to SHOTS. Of tests
// with NAME in their names only these are done.
import {execFileSync} from "node:child_process";
import {mkdirSync, mkdtempSync, readFileSync, writeFileSync} from "node:fs";
import {createServer} from "node:http";
import {tmpdir} from "node:os";
import {extname, join} from "node:path";
import {Harness, expect, quiet, row, settled, value} from "./harness.mjs";

const [program, taut, folder, shots, only] = process.argv.slice(2);
mkdirSync(shots, {recursive: true});
const TABLE4 = "stages/sollmann-jouaneh/table4.toml", LINEAR = "stages/sollmann-jouaneh/identification/linear-5v.toml";
/** Where the folder is served: not at the top. */
const UNDER = "/lessons/belt/";

// ---- A server of files that knows nothing else, not even what WebAssembly is.

const TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"};
const asked = [];
const files = createServer((request, response) => {
  asked.push(`${request.method} ${request.url}`);
  const path = request.url.startsWith(UNDER) ? request.url.slice(UNDER.length) || "index.html" : "";
  let content = null;
  try { if (request.method === "GET" && /^[a-z-]+\.[a-z]+$/.test(path)) content = readFileSync(join(folder, path)); } catch { /* told below */ }
  response.writeHead(content ? 200 : 404, {"Content-Type": (content && TYPES[extname(path)]) || "application/octet-stream"});
  response.end(content || "");
});
await new Promise(done => files.listen(0, "127.0.0.1", done));
const address = `http://127.0.0.1:${files.address().port}${UNDER}`;

const harness = new Harness(program, taut);
await harness.start();
const test = (name, work) => (!only || name.includes(only) ? harness.test(name, open => work((options = {}, hash = "") => open(address + hash, options))) : null);
const ask = (page, act, body) => page.evaluate(async ([act, body]) => {
  try { return (await window.studio.wire.ask(act, body)).head; } catch (error) { return {error: error.mistake || String(error)}; }
}, [act, body]);

// ---- What a person does

await test("opens a machine of the gallery, and a drag of a slider simulates", async open => {
  const {page} = await open();
  await page.click("#go-gallery");
  await page.locator("#view-gallery button", {hasText: /Table 4|friction of Table 4/}).first().click();
  await quiet(page);
  expect((await page.title()).includes("Table 4"), await page.title());
  const slider = row(page, "cart.friction.viscous").locator("input[type=range]");
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let k = 1; k <= 20; k++) await page.mouse.move(box.x + box.width * (0.5 + 0.02 * k), box.y + box.height / 2);
  await page.mouse.up();
  await quiet(page);
  const shown = Number(await row(page, "cart.friction.viscous").locator("input[type=text]").inputValue());
  expect(shown > 30 && (await value(page, "cart.friction.viscous")) === shown, `the field says ${shown}`);
  expect((await page.evaluate(() => window.studio.text)).includes(`viscous = "${shown} N s/m"`), "the text does not have it");
});

await test("shows the digits of the program for 30 random settings", async open => {
  const {page} = await open();
  // A sequence that is the same each time (Lehmer, 48271 modulo 2³¹ − 1).
  let state = 20261;
  const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
  const keys = ["cart.mass", "drive_pulley.inertia", "idler_pulley.inertia", "belt.stiffness.0", "belt.stiffness.2",
    "cart.friction.viscous", "cart.friction.coulomb", "drive_pulley.friction.viscous", "drive_pulley.friction.coulomb"];
  const text = readFileSync(TABLE4, "utf8"), {parameters} = await ask(page, "run", {text, describe: true});
  const file = join(mkdtempSync(join(tmpdir(), "taut-web-test-")), "studio.toml");
  const number = key => parameters.find(one => one.key === key);
  for (let k = 0; k < 30; k++) {
    const set = keys.filter(key => number(key) && random() < 0.5).map(key => [key, number(key).value * 10 ** (random() - 0.5)]);
    const experiment = Math.floor(2 * random());
    const here = await ask(page, "run", {text, set, experiment});
    // The text that the page shows for it, as whoever downloads it would run it.
    writeFileSync(file, here.text);
    const there = JSON.parse(execFileSync(taut, ["simulate", file, "--json"], {maxBuffer: 1 << 26}));
    const [one, other] = [here.result.experiments, [there.experiments[experiment]]].map(all => JSON.stringify(all));
    expect(one === other, `${JSON.stringify(set)}: the page has\n${one}\nthe program\n${other}`);
    expect(JSON.stringify(here.result.machine) === JSON.stringify(there.machine), `${JSON.stringify(set)}: another machine`);
  }
});

await test("logs that are dropped are fitted by a worker, with the digits of the program", async open => {
  const {page} = await open();
  await page.click("#go-fit");
  await page.setInputFiles("#log-file", ["5-v-pulse", "10-v-pulse"].map(name => join(LINEAR, `../logs/${name}.measured.csv`)));
  await page.waitForFunction(() => document.querySelectorAll(".log-file").length === 2);
  const told = await ask(page, "columns", {path: "/dropped/1/10-v-pulse.measured.csv"});
  expect(told.found && told.rows > 100, JSON.stringify(told.error));
  const text = readFileSync(LINEAR, "utf8").replace("logs/5-v", "/dropped/0/5-v").replace("logs/10-v", "/dropped/1/10-v");
  const here = await page.evaluate(async text => {
    let steps = 0;
    try { return {head: (await window.studio.wire.ask("fit", {text}, () => { steps += 1; })).head, steps}; } catch (error) { return {error: error.mistake || String(error)}; }
  }, text);
  expect(here.head && here.steps > 0, JSON.stringify(here.error || here.steps));
  const there = JSON.parse(execFileSync(taut, ["fit", LINEAR, "--json"], {maxBuffer: 1 << 26}));
  const [one, other] = [here.head.result, there].map(result => JSON.stringify(result.parameters));
  expect(one && one === other, `the page has\n${one}\nthe program\n${other}`);
});

await test("a long work tells how far it is, and Stop keeps what there is", async open => {
  const {page, trouble} = await open();
  const sweep = await page.evaluate(async text => {
    const {wire} = window.studio;
    let steps = 0;
    const asked = wire.ask("sweep", {text, plan: {runs: 20000, vary: {all: "10%"}}}, () => { steps += 1; if (steps === 4) wire.cancel(asked.id); });
    try { return {head: (await asked).head, steps}; } catch (error) { return {error: error.mistake || String(error), steps}; }
  }, readFileSync(TABLE4, "utf8"));
  expect(sweep.head && sweep.head.stopped && sweep.head.done > 0 && sweep.steps >= 4, JSON.stringify(sweep.error || sweep.head));
  // The browser tells of the address by which the worker was stopped.
  for (let k = trouble.length; k--;) if (/ERR_FILE_NOT_FOUND/.test(trouble[k])) trouble.splice(k, 1);
});

await test("what a page without a server cannot do is told", async open => {
  const {page} = await open();
  const what = async (act, body) => (await ask(page, act, body)).error.what;
  expect(/cannot write files/.test(await what("save", {text: "x"})), "it saves");
  expect(/was not sent/.test(await what("columns", {path: "/etc/passwd"})), "it looks for files");
  expect(/nothing called/.test(await what("fly", {})), "it flies");
  expect((await page.locator("#save").isVisible()) === false, "Save is offered");
  const text = readFileSync(LINEAR, "utf8");
  const fit = await ask(page, "fit", {text});
  expect(fit.error && /dropped on it/.test(fit.error.text), JSON.stringify(fit));
});

await test("all views open, and nothing is asked of others", async open => {
  const {page} = await open(), requests = [];
  page.on("request", request => requests.push(request.url()));
  for (const view of ["modes", "fit", "tune", "shape", "sweep", "gallery", "tour", "motion"]) {
    await page.click(`#go-${view}`);
    await quiet(page);
    expect(await page.locator(`#view-${view}`).isVisible(), view);
  }
  const others = requests.filter(url => !url.startsWith(address) && !/^(data|blob):/.test(url));
  expect(!others.length, others.join(", "));
  const wrong = asked.filter(line => !line.startsWith(`GET ${UNDER}`));
  expect(!wrong.length, wrong.join(", "));
});

await test("a link opens for whoever has it", async open => {
  const {page} = await open();
  const hash = await page.evaluate(async address => (await import(address + "link.js")).fragment({...window.studio.snapshot(), text: window.studio.text.replace(/title = ".*"/, 'title = "A lesson"')}), address);
  const other = await open({}, hash);
  expect((await other.page.title()).includes("A lesson"), await other.page.title());
});

for (const width of [390, 1280]) {
  await test(`pictures at ${width} px`, async open => {
    const {page} = await open({viewport: {width, height: 850}});
    await page.evaluate(text => window.studio.open(text, {name: "table4.toml"}), readFileSync(TABLE4, "utf8"));
    await quiet(page);
    await settled(page);
    await page.screenshot({path: join(shots, `web-${width}.png`)});
    expect((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, "it scrolls sideways");
  });
}

files.close();
await harness.end("the studio without a server");
