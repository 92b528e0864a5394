// Uses the studio without a server in a browser as a person would; cargo xtask browser runs this.
//
//   node web.mjs BROWSER TAUT FOLDER SHOTS [NAME]
//
// TAUT is the program, whose digits are compared; FOLDER is what `cargo xtask web` made. Pictures go to SHOTS. Of tests
// with NAME in their names only these are done.
import {spawnSync} from "node:child_process";
import {mkdirSync, mkdtempSync, readFileSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join, resolve} from "node:path";
import {pathToFileURL} from "node:url";
import {Harness, UNDER, expect, quiet, row, seen, settled, value} from "./harness.mjs";

const [program, taut, folder, shots, only] = process.argv.slice(2);
mkdirSync(shots, {recursive: true});
const TABLE4 = "stages/sollmann-jouaneh/table4.toml",
  LINEAR = "stages/sollmann-jouaneh/identification/linear-5v.toml";
const LOGS = ["5-v-pulse", "10-v-pulse"].map(name => join(LINEAR, `../logs/${name}.measured.csv`));
const harness = new Harness(program, taut);
await harness.start();
const escaped = text => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
const PRINTER = readFileSync("stages/printer-axis/printer-axis.toml", "utf8");
const LESSON = `<!DOCTYPE html><meta charset="utf-8"><title>A lesson</title>
<script type="module" src="taut-stage.js"></script>
<taut-stage id="file" case="machine.toml"></taut-stage><taut-stage id="missing" case="missing.toml"></taut-stage>
<taut-stage id="own" view="modes">${escaped(PRINTER)}</taut-stage>`;
const lesson = {"lesson.html": LESSON, "machine.toml": readFileSync(TABLE4)};
const {address, asked} = await harness.serveFolder(folder, lesson);
const opener =
  open =>
  (options = {}, hash = "", at = address) =>
    open(at + hash, options);
const test = (name, work) => (!only || name.includes(only) ? harness.test(name, open => work(opener(open))) : null);
/** The head of the answer to a request, or its error; and the steps of its progress, of which one may stop it. */
const watch = (page, act, body, stopAt = Infinity) =>
  page.evaluate(
    async ([act, body, stopAt]) => {
      const {wire} = window.studio;
      let steps = 0;
      const asked = wire.ask(act, body, () => {
        steps += 1;
        if (steps === stopAt) wire.cancel(asked.id);
      });
      const [head, error] = await asked.then(
        ({head}) => [head],
        error => [undefined, error.mistake || String(error)],
      );
      return {head, error, steps};
    },
    [act, body, stopAt],
  );
const ask = (page, act, body) => watch(page, act, body).then(({head, error}) => head || {error});

/** Waits until the text of an element matches. */
const says = (page, selector, pattern) =>
  page.waitForFunction(
    ([selector, source]) => new RegExp(source, "i").test(document.querySelector(selector).textContent),
    [selector, pattern.source],
    {timeout: 60_000},
  );

/** Removes what the browser reports of the revoked addresses by which workers are stopped. */
const forgive = trouble => {
  for (let k = trouble.length; k--;) if (/ERR_FILE_NOT_FOUND/.test(trouble[k])) trouble.splice(k, 1);
};

/** A whole answer: its head without the time that it took, and a digest of the bits of its columns. */
const all = (page, act, body) =>
  page.evaluate(
    async ([act, body]) => {
      try {
        const {
          head: {took_s, id, ...head},
          columns,
        } = await window.studio.wire.ask(act, body);
        const bits = await new Blob([...columns.values()]).arrayBuffer();
        const digest = await crypto.subtle.digest("SHA-256", bits);
        return {head, bytes: bits.byteLength, digest: [...new Uint8Array(digest)].join(" ")};
      } catch (error) {
        return {error: error.mistake || String(error)};
      }
    },
    [act, body],
  );

/**
 * JSON with the keys of objects in alphabetical order; the frequency at which a loop swings, which a model's sines and
 * logarithms give, to 12 digits.
 */
const sorted = one =>
  JSON.stringify(one, (key, part) => {
    if (key === "frequency_Hz" && typeof part === "number") return Number(part.toPrecision(12));
    const isObject = part && typeof part === "object" && !Array.isArray(part);
    return isObject ? Object.fromEntries(Object.entries(part).sort(([a], [b]) => (a < b ? -1 : 1))) : part;
  });

/** True if two answers are the same but for the tolerance of the general solver. */
const isNear = (one, other) => {
  if (typeof one === "number") return Math.abs(one - other) <= 1e-6 * Math.max(Math.abs(one), Math.abs(other), 1e-3);
  if (!one || !other || typeof one !== "object") return one === other;
  return [...new Set([...Object.keys(one), ...Object.keys(other)])].every(key => isNear(one[key], other[key]));
};

/** What the program prints as JSON; of a run that ended early, too. */
const printed = words => {
  const {stdout, stderr} = spawnSync(taut, [...words, "--json"], {maxBuffer: 1 << 26, encoding: "utf8"});
  expect(stdout.startsWith("{"), `taut ${words.join(" ")}: ${stderr}`);
  return JSON.parse(stdout);
};

/** The link to the state of a page, with a change of its text. */
const linked = (page, from, to) =>
  page.evaluate(
    async ([address, from, to]) => {
      const state = window.studio.snapshot(),
        {fragment} = await import(address + "link.js");
      return fragment({...state, text: state.text.replace(from, to)});
    },
    [address, from, to],
  );

// ---- What a person does

await test("opens a machine of the gallery, and a drag of a slider simulates", async open => {
  const {page} = await open();
  await page.click("#go-gallery");
  await page
    .locator("#view-gallery button", {hasText: /Table 4|friction of Table 4/})
    .first()
    .click();
  await quiet(page);
  expect((await page.title()).includes("Table 4"), await page.title());
  const slider = row(page, "cart.friction.viscous").locator("input[type=range]");
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  const canvas = page.locator("[data-panel=position] canvas").first();
  const plotted = () => canvas.evaluate(canvas => canvas.toDataURL()),
    before = await plotted();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let k = 1; k <= 20; k++) await page.mouse.move(box.x + box.width * (0.5 + 0.02 * k), box.y + box.height / 2);
  await page.mouse.up();
  await quiet(page);
  expect((await plotted()) !== before, "the plots do not move");
  const shown = Number(await row(page, "cart.friction.viscous").locator("input[type=text]").inputValue());
  expect(shown > 30 && (await value(page, "cart.friction.viscous")) === shown, `the field says ${shown}`);
  const text = await page.evaluate(() => window.studio.text);
  expect(text.includes(`viscous = "${shown} N s/m"`), "the text does not have it");
});

await test("shows the bits of the program for 100 random machines", async open => {
  const {page} = await open(),
    other = (await open({}, "", (await harness.serve([])).address)).page;
  // A sequence that is the same each time (Lehmer, 48271 modulo 2³¹ − 1).
  let state = 20261;
  const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
  const file = join(mkdtempSync(join(tmpdir(), "taut-web-test-")), "studio.toml");
  const stages = (await ask(page, "gallery", {})).stages,
    described = [],
    seen = new Set();
  for (const {text} of stages) described.push(await ask(page, "run", {text, describe: true}));
  let exact = 0,
    printedToo = 0;
  for (let drawn = 0; exact < 100; drawn++) {
    expect(drawn < 300, `of ${drawn} machines only ${exact} could be compared`);
    const place = Math.floor(stages.length * random()),
      {parameters, experiments} = described[place];
    const changed = ({key, value}) => [key, value * 10 ** (0.5 * (random() - 0.5))];
    const set = parameters.filter(() => random() < 0.3).map(changed);
    const experiment = Math.floor(experiments.length * random()),
      {name: run} = experiments[experiment];
    const request = {text: stages[place].text, set, experiment};
    const [here, there] = [await all(page, "run", request), await all(other, "run", request)];
    const name = `${stages[place].path}, ${run}, ${JSON.stringify(set)}`;
    const both = (one, other) => `${name}: the page has\n${sorted(one)}\nthe program\n${sorted(other)}`;
    // The sines of a chirp and the powers of the general solver's step control are those of the module or of the
    // system's library, and may differ in their last digits. The exact solver computes the same bits.
    const isGeneral = !here.error && (here.head.result.solver || {}).name === "general";
    const isExact = run !== "chirp" && !isGeneral;
    expect(isExact ? sorted(here) === sorted(there) : isNear(here.head, there.head), both(here, there));
    // A breakaway below Coulomb friction, for example, is refused.
    if (here.error) continue;
    seen.add(place);
    if (!isExact) continue;
    exact++;
    // The text that the page shows for it, as whoever downloads it would run it. Of many samples the page shows fewer.
    writeFileSync(file, here.head.text);
    const kind = here.head.result.experiments ? "experiments" : "moves";
    const words = [kind === "moves" ? "move" : "simulate", file];
    const own = here.head.result[kind][0],
      wanted = printed(words)[kind][experiment];
    if (own.cost && own.cost.samples !== wanted.cost.samples) continue;
    // The page does not run a move a second time for its accuracy.
    if (kind === "moves")
      for (const key of ["position_error_m", "position_error_basis", "is_determined"]) wanted[key] = own[key] = null;
    expect(sorted(own) === sorted(wanted), both(own, wanted));
    printedToo++;
  }
  expect(seen.size === stages.length, `only ${seen.size} of ${stages.length} machines of the gallery were drawn`);
  expect(printedToo >= 50, `only ${printedToo} were printed by the program`);
});

await test("logs that are dropped are fitted by a worker, with the digits of the program", async open => {
  const {page} = await open();
  await page.click("#go-fit");
  await page.setInputFiles("#log-file", LOGS);
  await page.waitForFunction(() => document.querySelectorAll(".log-file").length === 2);
  const told = await ask(page, "columns", {path: "/dropped/1/10-v-pulse.measured.csv"});
  expect(told.found && told.rows > 100, JSON.stringify(told.error));
  const text = readFileSync(LINEAR, "utf8")
    .replace("logs/5-v", "/dropped/0/5-v")
    .replace("logs/10-v", "/dropped/1/10-v");
  const here = await watch(page, "fit", {text});
  expect(here.head && here.steps > 0, JSON.stringify(here.error || here.steps));
  const there = printed(["fit", LINEAR]),
    [own, others] = [here.head.result, there].map(result => result.parameters);
  // Products of large matrices are summed with fused multiplications where the processor has them, and WebAssembly has
  // none: standard errors may differ in their last digits.
  const near = (a, b) => Math.abs(a - b) <= 1e-12 * Math.abs(b);
  for (const [k, one] of own.entries()) {
    const other = others[k],
      bare = ({standard_error, interval_95, ...rest}) => sorted(rest);
    const ends = ({standard_error, interval_95}) => [standard_error, ...interval_95];
    const isSame = bare(one) === bare(other) && ends(one).every((end, i) => near(end, ends(other)[i]));
    expect(isSame, `${one.name}: the page has ${sorted(one)}, the program ${sorted(other)}`);
  }
  expect(own.length === others.length, `${own.length} parameters`);
});

await test("a log that is dropped by hand is checked and fitted from the page", async open => {
  const {page} = await open();
  await page.evaluate(text => window.studio.open(text, {name: "table4.toml"}), readFileSync(TABLE4, "utf8"));
  await quiet(page);
  await page.click("#go-fit");
  const dropped = await page.evaluateHandle(
    content => {
      const data = new DataTransfer();
      data.items.add(new File([content], "5 V pulse.csv"));
      return data;
    },
    readFileSync(LOGS[0], "utf8"),
  );
  await page.locator("#view-fit .drop").first().dispatchEvent("drop", {dataTransfer: dropped});
  await page.waitForSelector(".log-file");
  await page.locator("#view-fit input[value='cart.friction.viscous']").check();
  await page.click("#check");
  await page.waitForSelector("#view-fit .report[data-of=check] h2", {timeout: 120_000});
  await page.click("#fit");
  await page.waitForSelector("#fit-keep", {timeout: 120_000});
  const table = await page.locator("#view-fit .report table").first().innerText();
  expect(/cart.friction.viscous/.test(table), table);
  await page.screenshot({path: join(shots, "web-fit.png"), fullPage: true});
});

await test("a log that is no log, and one that is too large, are told", async open => {
  const {page} = await open();
  await page.click("#go-fit");
  const kept = await page.evaluate(async () => {
    const {wire} = window.studio,
      path = await wire.upload(new File(["words\n"], "notes.csv"));
    const large = new File([new Uint8Array((64 << 20) + 1)], "large.csv");
    return [path, await wire.upload(large).catch(String)];
  });
  expect(kept[0] === "/dropped/0/notes.csv" && /64 MB/.test(kept[1]), kept.join());
  const told = await ask(page, "columns", {path: kept[0]});
  expect(told.error && /no line of this file has numbers/.test(told.error.what), JSON.stringify(told));
});

await test("a long work tells how far it is, and Stop keeps what there is", async open => {
  const {page, trouble} = await open();
  const plan = {runs: 20000, vary: {all: "10%"}};
  const {head, steps, error} = await watch(page, "sweep", {text: readFileSync(TABLE4, "utf8"), plan}, 4);
  expect(head && head.stopped && head.done > 0 && steps >= 4, JSON.stringify(error || head));
  forgive(trouble);
});

await test("a sweep of the page shows its progress and is stopped by its button", async open => {
  const {page, trouble} = await open();
  await page.evaluate(text => window.studio.open(text, {name: "table4.toml"}), readFileSync(TABLE4, "utf8"));
  await quiet(page);
  await page.click("#go-sweep");
  await page.locator("#runs").fill("20000");
  await page.click("#sweep");
  await says(page, "#sweep-status", / of 20000 runs/);
  await page.click("#sweep-stop");
  await says(page, "#sweep-status", /stopped/);
  forgive(trouble);
  await page.screenshot({path: join(shots, "web-sweep.png"), fullPage: true});
  await page.locator("#runs").fill("60");
  await page.click("#sweep");
  await says(page, "#sweep-status", /^60 runs in/);
});

await test("all stops of the tour show their machine", async open => {
  const {page} = await open();
  await page.click("#go-tour");
  await page.waitForSelector("#tour-show");
  let stops = 0,
    isLast = false;
  for (; !isLast; stops++) {
    await quiet(page);
    isLast = await page.locator("#tour-next").isDisabled();
    await page.click("#tour-show");
    await quiet(page);
    await page.waitForSelector(".tour-show .stage-box svg");
    const {view, told, hasRun} = await page.evaluate(() => {
      const {view, mistake, run} = window.studio;
      return {view, told: mistake && mistake.text, hasRun: Boolean(run)};
    });
    expect(view === "tour" && hasRun && !told, `stop ${stops + 1}: ${view} ${told}`);
    if (!isLast) await page.click("#tour-next");
  }
  expect(stops >= 10, `${stops} stops`);
});

await test("a move is simulated in closed loop, and its controller is tuned until Stop", async open => {
  const {page, trouble} = await open();
  const {stages} = await ask(page, "gallery", {});
  const {text} = stages.find(stage => stage.path.endsWith("controllers/pid.toml"));
  await page.evaluate(text => window.studio.open(text, {name: "pid.toml"}), text);
  await quiet(page);
  await page.click("#go-tune");
  await quiet(page);
  const closed = await ask(page, "loop", {text});
  expect(!closed.error, JSON.stringify(closed.error));
  await page.click("#tune");
  await says(page, "#tune-status", /looks at designs/);
  await page.click("#tune-stop");
  await says(page, "#view-tune", /stopped|interrupted|best so far/);
  forgive(trouble);
});

await test("what a page without a server cannot do is told", async open => {
  const {page} = await open();
  const what = async (act, body) => (await ask(page, act, body)).error.what;
  expect(/cannot write files/.test(await what("save", {text: "x"})), "it saves");
  expect(/was not sent/.test(await what("columns", {path: "/etc/passwd"})), "it looks for files");
  expect(/nothing called/.test(await what("fly", {})), "it flies");
  expect((await page.locator("#save").isVisible()) === false, "Save is offered");
  const offered = await page.locator("#view-fit .drop").first().textContent();
  expect(/CSV or MATLAB/.test(offered) && !/Parquet/.test(offered), offered);
  const text = readFileSync(LINEAR, "utf8");
  const fit = await ask(page, "fit", {text});
  expect(fit.error && /dropped on it/.test(fit.error.text), JSON.stringify(fit));
});

await test("all views open, and nothing is asked of others", async open => {
  const {page} = await open(),
    requests = [];
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
  const hash = await linked(page, /title = ".*"/, 'title = "A lesson"');
  const other = await open({}, hash);
  expect((await other.page.title()).includes("A lesson"), await other.page.title());
});

await test("a damaged link says so", async open => {
  const {page} = await open();
  const hash = await linked(page, "", "");
  const other = await open({}, hash.slice(0, 40) + hash.slice(41));
  expect(/This link is damaged/.test(await other.page.locator("#notice").innerText()), "a damaged link opens");
});

await test("a folder without its module, or its worker, says what is missing", async open => {
  const {context} = await open();
  for (const missing of ["taut.wasm", "worker.js"]) {
    const page = await context.newPage();
    await page.route(`**/${missing}`, route => route.fulfill({status: 404, body: "none"}));
    await page.goto(address);
    await says(page, "#notice", /cannot be loaded/);
    await page.close();
  }
  // Browsers run no modules of files, and the page was empty.
  const page = await context.newPage();
  await page.goto(pathToFileURL(resolve(folder, "index.html")).href);
  await page.getByText("They need a server").waitFor({timeout: 20_000});
  await page.close();
});

await test("as long as the module is loaded, the page says so, and a view that was chosen stays", async open => {
  const {context} = await open(),
    page = await context.newPage();
  let load;
  const loaded = new Promise(done => (load = done));
  await page.route("**/taut.wasm", route => loaded.then(() => route.continue()));
  await page.goto(address);
  await says(page, "#notice", /^Loading the module/);
  await page.click("#go-gallery");
  load();
  await page.waitForFunction(() => window.studio.run, null, {timeout: 20_000});
  await page.waitForSelector("#view-gallery .gallery button");
  expect(await page.locator("#view-gallery").isVisible(), "the page shows another view than the one that was chosen");
  expect(!(await page.locator("#notice").isVisible()), "the page still says that it loads");
});

// A result of the case before could be kept in the next one, which then was another machine.
await test("what is computed of a case ends when another one is opened", async open => {
  const {page, trouble} = await open();
  const {stages} = await ask(page, "gallery", {});
  const opened = async end => {
    const {text} = stages.find(stage => stage.path.endsWith(end));
    await page.evaluate(text => window.studio.open(text, {name: "other.toml"}), text);
    await quiet(page);
  };
  await page.click("#go-sweep");
  await page.locator("#runs").fill("20000");
  await page.click("#sweep");
  await says(page, "#sweep-status", / of 20000 runs/);
  await opened("controllers/pid.toml");
  expect(!(await page.locator("#sweep-status").innerText()), "the sweep of the case before still counts");
  expect(await page.locator("#sweep").isEnabled(), "no sweep can be begun");
  await page.click("#go-tune");
  await page.click("#tune");
  await says(page, "#tune-status", /looks at designs/);
  await opened("table4.toml");
  expect(!(await page.locator("#tune-keep").isVisible()), "gains of the case before are offered");
  await page.click("#go-fit");
  await page.setInputFiles("#log-file", LOGS);
  await page.waitForFunction(() => document.querySelectorAll(".log-file").length === 2);
  await page.click("#fit");
  await page.waitForSelector("#fit-keep", {timeout: 120_000});
  await opened("table1.toml");
  expect(!(await page.locator("#fit-keep").isVisible()), "estimates of the case before are offered");
  expect(!(await page.locator("#fit-status").innerText()), "the fit of the case before is still told");
  forgive(trouble);
});

await test("a lesson contains machines, each with its own case", async open => {
  const {context} = await open(),
    page = await context.newPage(),
    trouble = [];
  page.on("pageerror", error => trouble.push(error.message));
  await page.goto(address + "lesson.html");
  const frames = [];
  for (const id of ["file", "own"]) {
    const frame = await (await page.waitForSelector(`#${id} iframe[src]`)).contentFrame();
    await frame.waitForFunction(() => window.studio && window.studio.run, null, {timeout: 20_000});
    frames.push(frame);
  }
  const [first, second] = frames,
    title = frame => frame.evaluate(() => document.title);
  const titles = [await title(first), await title(second)];
  expect(/Table 4/.test(titles[0]) && /printer/i.test(titles[1]), titles.join("; "));
  expect((await second.evaluate(() => window.studio.view)) === "modes", "the view is another");
  const told = await page.locator("#missing [role=alert]").innerText();
  expect(/missing.toml cannot be opened: 404/.test(told), told);
  // A changed machine is that of its frame alone, and anew after a reload, without a question.
  await first.evaluate(() => {
    window.studio.drag("cart.mass", 0.5);
    window.studio.drop();
  });
  await first.waitForFunction(() => !window.studio.wire.isBusy && window.studio.isUnsaved);
  await settled(page);
  await page.screenshot({path: join(shots, "web-lesson.png"), fullPage: true});
  await page.reload();
  const again = await (await page.waitForSelector("#file iframe[src]")).contentFrame();
  await again.waitForFunction(() => window.studio && window.studio.run, null, {timeout: 20_000});
  expect((await value(again, "cart.mass")) !== 0.5, "the change is kept");
  expect(!trouble.length, trouble.join("; "));
});

for (const [width, height] of [
  [320, 700],
  [390, 844],
  [800, 1100],
  [1440, 900],
]) {
  await test(`pictures at ${width} px`, async open => {
    const {page} = await open({viewport: {width, height}, hasTouch: width < 500});
    await page.evaluate(text => window.studio.open(text, {name: "table4.toml"}), readFileSync(TABLE4, "utf8"));
    await quiet(page);
    await settled(page);
    await page.screenshot({path: join(shots, `web-${width}.png`)});
    expect((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, "it scrolls sideways");
    await page.click("#menu > summary");
    const menu = await page.locator("#menu > div").boundingBox();
    expect(menu.x >= 0 && menu.x + menu.width <= width, `the menu is at ${menu.x}, ${menu.width} wide`);
    await page.click("#menu > summary");
    // The plots came last, below the controls and behind the sheet.
    for (const selector of [".stage-box svg", "[data-panel=position] .area", ".row input[type=range]"])
      expect((await seen(page, selector)) >= 2, `${selector} is not seen when the page is opened`);
  });
}

await harness.end("the studio without a server");
