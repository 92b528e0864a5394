// Uses the studio in a browser as a person would; cargo xtask browser runs this.
//
//   node studio.mjs BROWSER TAUT SHOTS [NAME]
//
// TAUT is the program; it is run in the folder of the project. Pictures go to SHOTS. Of tests with NAME in their names
// only these are done.
import {copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {createRequire} from "node:module";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {Harness, expect, quiet, row, settled, value} from "./harness.mjs";

const [program, taut, shots, only] = process.argv.slice(2);
mkdirSync(shots, {recursive: true});
const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const TABLE4 = "stages/sollmann-jouaneh/table4.toml";

const harness = new Harness(program, taut);
await harness.start();
const common = await harness.serve([TABLE4]),
  serve = words => harness.serve(words);
/** Pages are of the common server, unless another address is named. */
const test = (name, work) =>
  !only || name.includes(only)
    ? harness.test(name, open => work((address = common.address, options = {}) => open(address, options)))
    : null;

const picture = (page, panel = "position") =>
  page.evaluate(panel => document.querySelector(`[data-panel="${panel}"] canvas`).toDataURL(), panel);

// ---- What a person does

await test("loads within a second, shows the machine, its plots and its parameters", async open => {
  const begun = performance.now(),
    {page} = await open();
  const took = performance.now() - begun;
  // Of a browser that is warm and a server that may be built for debugging, on a busy computer.
  expect(took < 5000, `the first picture came after ${took} ms`);
  expect((await page.title()).startsWith("Sollmann & Jouaneh"), await page.title());
  expect((await page.locator(".live-plot").count()) === 9, `${await page.locator(".live-plot").count()} plots`);
  expect((await page.locator(".row").count()) > 25, `${await page.locator(".row").count()} parameters`);
  expect((await page.locator(".stage-box svg .teeth").count()) === 3, "no belt is drawn");
  expect(/token/.test(page.url()) === false, `the address still holds the token: ${page.url()}`);
  expect((await page.locator(".glance dt").allInnerTexts()).includes("largest acceleration"), "nothing at a glance");
});

await test("a drag of a slider simulates, and the last picture is of the last value", async open => {
  const {page} = await open();
  const before = await picture(page),
    slider = row(page, "cart.friction.viscous").locator("input[type=range]");
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let k = 1; k <= 20; k++) await page.mouse.move(box.x + box.width * (0.5 + 0.02 * k), box.y + box.height / 2);
  await page.mouse.up();
  await quiet(page);
  const shown = Number(await row(page, "cart.friction.viscous").locator("input[type=text]").inputValue());
  expect(shown > 30, `the slider says ${shown}`);
  expect(
    (await value(page, "cart.friction.viscous")) === shown,
    `the run has ${await value(page, "cart.friction.viscous")}, the field ${shown}`,
  );
  expect(
    (await page.evaluate(() => window.studio.text)).includes(`viscous = "${shown} N s/m"`),
    "the text does not have it",
  );
  expect((await picture(page)) !== before, "the picture is the old one");
  await page.click("#undo");
  await quiet(page);
  expect((await value(page, "cart.friction.viscous")) === 19.0424, "undo does not undo a whole drag");
  await page.click("#redo");
  await quiet(page);
  expect((await value(page, "cart.friction.viscous")) === shown, "redo does not redo");
  await page.click("#reset");
  await quiet(page);
  expect(
    (await page.evaluate(() => window.studio.text)) === readFileSync(TABLE4, "utf8"),
    "reset does not bring the case back",
  );
});

// A drag that began before the answer to the last one came was remembered as the same text: one step undid both.
await test("a drag that begins before the answer to the last one is undone by itself", async open => {
  const {page} = await open(),
    values = async () => [await value(page, "cart.mass"), await value(page, "cart.friction.viscous")].join();
  await page.evaluate(() => {
    const app = window.studio;
    for (const [key, value] of [
      ["cart.mass", 0.5],
      ["cart.friction.viscous", 30],
    ]) {
      app.drag(key, value);
      app.drop();
    }
  });
  await quiet(page);
  expect((await values()) === "0.5,30", await values());
  for (const [button, wanted] of [
    ["undo", "0.5,19.0424"],
    ["undo", "0.362,19.0424"],
    ["redo", "0.5,19.0424"],
    ["redo", "0.5,30"],
  ]) {
    await page.click(`#${button}`);
    await quiet(page);
    expect((await values()) === wanted, `${button} gives ${await values()}, not ${wanted}`);
  }
  expect(/mass +="?.*0.5 kg/.test(await page.evaluate(() => window.studio.text)), "the text does not have the mass");
});

await test("random drags end with the run of the last value", async open => {
  const {page} = await open();
  const lost = await page.evaluate(async () => {
    const app = window.studio;
    let lost = 0;
    for (let drag = 0; drag < 60; drag++) {
      let last = 0;
      for (let k = 0; k < 1 + ((drag * 7) % 13); k++) {
        last = Number((0.2 + ((drag * 31 + k * 17) % 97) / 60).toPrecision(4));
        app.drag("cart.mass", last);
        if (k % 3 === 0) await new Promise(done => setTimeout(done, (drag * 5 + k) % 9));
      }
      app.drop();
      while (app.wire.isBusy) await new Promise(done => setTimeout(done, 2));
      const value = app.parameters.find(one => one.key === "cart.mass").value;
      if (value !== last || !app.text.includes(`"${last} kg"`)) lost++;
    }
    return lost;
  });
  expect(lost === 0, `${lost} of 60 last values are lost`);
});

// An answer under way took the description, or the experiment, that was asked for after it: typed quickly, a text kept
// the sliders of the one before; another case opened in its first experiment.
await test("an answer that is overtaken takes nothing of what was chosen since", async open => {
  const {page} = await open();
  const has = key => page.evaluate(key => window.studio.parameters.some(one => one.key === key), key);
  await page.evaluate(() => {
    const app = window.studio;
    app.edit(app.text.replace('mass     = "0.362 kg"', 'mass     = "0.4 kg"'));
    app.edit(app.text.replace('mass     = "0.4 kg"', 'mass     = "0.4 kg"\nload     = "0.1 N"'));
  });
  await quiet(page);
  expect(await has("cart.load"), "a text that was typed right behind another is not described");
  const written = await page.evaluate(() => window.studio.parameters.find(one => one.key === "cart.load").written);
  expect(written !== null, "the load has a slider as if it stood at its default");
  await page.evaluate(() => {
    const app = window.studio;
    app.drag("cart.mass", 0.5);
    app.choose(1);
  });
  await quiet(page);
  expect(
    (await page.evaluate(() => window.studio.experiment)) === 1,
    "the experiment that was chosen under a drag is not shown",
  );
  await page.evaluate(() => {
    const app = window.studio;
    app.drag("cart.mass", 0.6);
    app.open(app.original, {experiment: 1});
  });
  await quiet(page);
  const opened = await page.evaluate(() => [
    window.studio.experiment,
    window.studio.parameters.find(one => one.key === "cart.mass").value,
  ]);
  expect(opened.join() === "1,0.362", `the case that was opened under a drag shows experiment and mass ${opened}`);
});

await test("a broken case is marked at its line, and the last picture stays", async open => {
  const {page} = await open();
  await page.click("#tab-case");
  const text = await page.locator("#text").inputValue(),
    before = await page.evaluate(() => window.studio.run.head.text);
  await page.locator("#text").fill(text.replace("mass     =", "masss    ="));
  await quiet(page);
  const told = await page.locator("#mistake").innerText();
  expect(/Line 24, column 1/.test(told) && /did you mean `mass`/.test(told), told);
  expect(await page.locator(".line-mark").isVisible(), "no line is marked");
  expect((await page.evaluate(() => window.studio.run.head.text)) === before, "the picture went");
  expect((await page.locator("#text").getAttribute("aria-invalid")) === "true", "the field is not called invalid");
  await page.screenshot({path: join(shots, "studio-mistake.png")});
  await page.locator("#text").fill(text.replace('"0.362 kg"', '"0.724 kg"'));
  await quiet(page);
  expect(
    !(await page.locator(".line-mark").isVisible()) && (await page.locator("#mistake").innerText()) === "",
    "the mark stays",
  );
  expect((await value(page, "cart.mass")) === 0.724, "the slider does not follow the text");
});

await test("the cursor is shared by the drawing and all plots, and a zoom is computed anew", async open => {
  const {page} = await open();
  const cart = () => page.locator(".stage-box svg").getAttribute("aria-label");
  const at = await cart();
  await page.locator("#scrub").evaluate(input => {
    input.value = "2000";
    input.dispatchEvent(new Event("input"));
  });
  await settled(page);
  expect((await cart()) !== at, "the drawing does not follow");
  expect((await page.locator("#clock").innerText()) === "200\u00a0ms", await page.locator("#clock").innerText());
  const values = await page.locator("[data-panel=position] .value").allInnerTexts();
  expect(
    values.every(text => Number(text) > 30),
    `the values say ${values}`,
  );
  // A crosshair: the mouse over one plot gives the values of all.
  const over = await page.locator("[data-panel=speed] .area").boundingBox();
  await page.mouse.move(over.x + 66 + 0.1 * (over.width - 78), over.y + 60);
  await settled(page);
  const told = await page.locator("[data-panel=position] .value").allInnerTexts();
  expect(
    Math.abs((await page.evaluate(() => window.studio.cursor)) - 0.1) < 0.01
      && told.every(text => Number(text) > 10 && Number(text) < 25),
    `under the mouse ${told}`,
  );
  const area = page.locator("[data-panel=error] .area");
  await area.scrollIntoViewIfNeeded();
  const box = await area.boundingBox(),
    wide = box.width - 78;
  await page.mouse.move(box.x + 66 + 0.24 * wide, box.y + 60);
  await page.mouse.down();
  await page.mouse.move(box.x + 66 + 0.3 * wide, box.y + 60, {steps: 4});
  await page.mouse.up();
  await quiet(page);
  const seen = await page.evaluate(() => [window.studio.window, window.studio.section.columns.get("time").length]);
  expect(
    Math.abs(seen[0][0] - 0.24) < 0.01 && Math.abs(seen[0][1] - 0.3) < 0.01 && seen[1] === 2001,
    JSON.stringify(seen),
  );
  await page.screenshot({path: join(shots, "studio-zoom.png")});
  for (let k = 0; k < 6; k++)
    await page.evaluate(() => {
      const [a, b] = window.studio.window;
      window.studio.look([a + 0.4 * (b - a), a + 0.45 * (b - a)]);
    });
  await quiet(page);
  const span = await page.evaluate(() => {
    const times = window.studio.section.columns.get("time");
    return times[times.length - 1] - times[0];
  });
  expect(span < 2e-9 * 1.01 + 1e-9, `far in, the section is ${span} s long`);
  await page.locator("#all").click();
  await settled(page);
  expect((await page.evaluate(() => window.studio.window)) === null, "the whole run does not come back");
});

await test("it plays, pauses, and is slow down to a microsecond", async open => {
  const {page} = await open();
  await page.locator("#rate").selectOption("0.000001");
  await page.locator("#play").click();
  await page.waitForFunction(() => window.studio.cursor > 3e-7);
  const label = await page.locator("#play").getAttribute("aria-label");
  await page.locator("#play").click();
  expect(label === "Pause", label);
  const rows = await page.evaluate(() => window.studio.section && window.studio.section.columns.get("time").length);
  expect(rows === 2001, "in slow motion nothing is computed finer");
  const now = await page.evaluate(() => window.studio.cursor);
  expect(now < 1e-3, `it ran to ${now} s`);
  await page.waitForTimeout(100);
  expect((await page.evaluate(() => window.studio.cursor)) === now, "it does not pause");
});

// The text is not filled in out of sight.
await test("the case text and its mistake are those of the page when their tab is opened", async open => {
  const {page} = await open();
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 0.5);
    window.studio.drop();
  });
  await quiet(page);
  await page.click("#tab-case");
  expect((await page.locator("#text").inputValue()).includes('"0.5 kg"'), "the text is of before the drag");
  await page.click("#tab-parameters");
  await page.locator(`${"[data-key='cart.mass']"} input[type=text]`).fill("-1");
  await page.keyboard.press("Enter");
  await quiet(page);
  await page.click("#tab-case");
  expect(
    /mass/.test(await page.locator("#mistake").innerText()),
    `the mistake says ${await page.locator("#mistake").innerText()}`,
  );
});

// Events of a run that changed while the tab was out of sight were those of an earlier one when it came in.
await test("results are those of the run when their tab is opened", async open => {
  const {page} = await open();
  await page.click("#tab-results");
  const before = await page.locator("#side-results .figures").innerText(),
    events = page.locator("#side-results .event");
  await page.click("#tab-parameters");
  await page.evaluate(() => {
    const app = window.studio;
    app.edit(app.text.replace('"0.362 kg"', '"3 kg"'));
  });
  await quiet(page);
  await page.click("#tab-results");
  expect((await page.locator("#side-results .figures").innerText()) !== before, "the figures are of the run before");
  const told = await page.evaluate(() => window.studio.run.head.events.length);
  expect((await events.count()) === Math.min(200, told), `${await events.count()} of ${told} events`);
});

// Each picture of a drag gave every text and number of the page anew, the same too, and had all of it drawn again.
await test("a drag changes nothing of the page that stays as it is", async open => {
  const {page} = await open();
  const touched = await page.evaluate(async () => {
    const app = window.studio,
      touched = new Set();
    const watch = new MutationObserver(list => {
      for (const {target, attributeName} of list) {
        const place = target.nodeType === 3 ? target.parentElement : target;
        touched.add(`${place.closest("[id]").id} ${place.tagName} ${attributeName}`);
      }
    });
    app.drag("cart.mass", 0.4);
    while (app.wire.isBusy) await new Promise(done => setTimeout(done, 5));
    await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
    watch.observe(document, {subtree: true, childList: true, attributes: true, characterData: true});
    for (let k = 1; k <= 5; k++) {
      app.drag("cart.mass", 0.4 + 0.001 * k);
      while (app.wire.isBusy || app.drawn !== app.run) await new Promise(done => setTimeout(done, 5));
    }
    watch.disconnect();
    return [...touched];
  });
  // Figures at a glance change.
  const others = touched.filter(one => !/^centre D[DL]|^centre TD/.test(one));
  expect(!others.length, `also ${others.join("; ")}`);
});

await test("runs are pinned, compared and unpinned", async open => {
  const {page} = await open();
  const before = await picture(page);
  await page.click("#pin");
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 3);
    window.studio.drop();
  });
  await quiet(page);
  expect((await page.locator("#unpin").innerText()) === "Unpin 1", "nothing is pinned");
  const compared = await picture(page, "speed");
  await page.click("#before");
  await page.click("#unpin");
  await settled(page);
  expect((await picture(page, "speed")) !== compared && compared !== before, "the pictures are the same");
});

await test("a state is a link that opens elsewhere", async open => {
  const {page} = await open();
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 0.5);
    window.studio.drop();
    window.studio.factor = 1000;
  });
  await quiet(page);
  await page.evaluate(() => {
    window.studio.look([0.1, 0.2]);
  });
  await page.click("#menu summary");
  await page.click("#link");
  await page.waitForFunction(() => location.hash.startsWith("#state="));
  const hash = await page.evaluate(() => location.hash);
  const other = await serve([]),
    there = await open(other.address + hash);
  await quiet(there.page);
  expect((await value(there.page, "cart.mass")) === 0.5, "the case is another");
  const state = await there.page.evaluate(() => [window.studio.window, window.studio.factor, window.studio.path]);
  expect(state[0] && Math.abs(state[0][0] - 0.1) < 1e-9 && state[1] === 1000, JSON.stringify(state));
  // A link is no file: nothing can be saved.
  expect(state[2] === "" && !(await there.page.locator("#save").isVisible()), "a linked case can be saved");
});

// A damaged link opened the case of the command line without a word.
await test("a damaged link says so, wherever it is opened", async open => {
  const {page} = await open();
  const hash = await page.evaluate(async () =>
    (await import("/link.js")).fragment({
      ...window.studio.snapshot(),
      text: window.studio.text.replace("0.362 kg", "3 kg"),
    }),
  );
  const other = hash[60] === "A" ? "B" : "A";
  const damaged = {
    "without a state": "#state=",
    "of four letters": "#state=AAAA",
    cut: hash.slice(0, -9),
    "with a letter changed": hash.slice(0, 60) + other + hash.slice(61),
    "with a letter lost": hash.slice(0, 60) + hash.slice(61),
    "with one too many": hash + ")",
    "in lower case": hash.toLowerCase(),
  };
  for (const [name, link] of Object.entries(damaged)) {
    const there = await open(common.address + link),
      told = () => there.page.locator("#notice.grave").innerText();
    expect(/This link is damaged/.test(await told()), `${name}: ${await told()}`);
    expect((await value(there.page, "cart.mass")) === 0.362, `${name}: the case of the command line is not open`);
    await there.context.close();
  }
  await page.evaluate(hash => {
    location.hash = hash;
  }, damaged.cut);
  await page.waitForSelector("#notice.grave");
  expect((await value(page, "cart.mass")) === 0.362, "a damaged link changed the case of an open page");
  await page.evaluate(hash => {
    location.hash = hash;
  }, hash);
  await page.waitForFunction(() => window.studio.run && window.studio.text.includes("3 kg"));
});

await test("the case of the command line is saved, and not over what somebody else wrote", async open => {
  const folder = mkdtempSync(join(tmpdir(), "taut-studio-test-")),
    path = join(folder, "axis.toml");
  copyFileSync(TABLE4, path);
  const {address} = await serve([path]),
    {page, trouble} = await open(address);
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 0.5);
    window.studio.drop();
  });
  await quiet(page);
  await page.keyboard.press("Control+s");
  await page.waitForFunction(() => /Saved/.test(document.querySelector("#notice").textContent));
  expect(
    readFileSync(path, "utf8") === readFileSync(TABLE4, "utf8").replace("0.362 kg", "0.5 kg"),
    "the file is not as it should be",
  );
  writeFileSync(path, "# mine\n");
  await page.click("#menu summary");
  await page.click("#save");
  await page.waitForFunction(() => /changed by something else/.test(document.querySelector("#notice").textContent));
  expect(readFileSync(path, "utf8") === "# mine\n", "it was written over");
  expect(!trouble.length, trouble.join("; "));
  rmSync(folder, {recursive: true});
});

await test("the report, the rows and a plot can be kept", async open => {
  const {page} = await open();
  const kept = async work => {
    const [download] = await Promise.all([page.waitForEvent("download"), work()]);
    return readFileSync(await download.path(), "utf8");
  };
  await page.click("#menu summary");
  const report = await kept(() => page.click("#report"));
  expect(report.startsWith("<!DOCTYPE html>") && report.includes("10 V pulse"), report.slice(0, 200));
  await page.click("#menu summary");
  const csv = await kept(() => page.click("#csv"));
  expect(
    csv.startsWith("time,drive_travel,cart_position") && csv.trim().split("\n").length === 1002,
    csv.slice(0, 200),
  );
  const keep = page.locator("[data-panel=position] .keep");
  await keep.locator("summary").click();
  const svg = await kept(() => keep.locator("button", {hasText: "SVG"}).click());
  const curves = svg
    .split("<svg x=")
    .at(-1)
    .match(/<path stroke="#\w+" d="M[^"]{20,}" stroke-width="1.8"/g);
  expect(svg.startsWith("<svg") && svg.endsWith("</svg>\n") && curves.length >= 2, svg.slice(0, 400));
  // The menu closes behind what is kept.
  await keep.locator("summary").click();
  const rows = (await kept(() => keep.locator("button", {hasText: "CSV"}).click())).trim().split("\n");
  const last = await page.evaluate(() => {
    const {columns} = window.studio.run;
    return [columns.get("time").at(-1), 1e3 * columns.get("cart_position").at(-1)];
  });
  const [time, , cart] = rows.at(-1).split(",").map(Number);
  expect(
    rows[0] === "time_s,drive_travel_mm,cart_position_mm"
      && rows.length === 1002
      && time === last[0]
      && cart === last[1],
    `${rows[0]} … ${rows.at(-1)}`,
  );
  await keep.locator("summary").click();
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    keep.locator("button", {hasText: "PNG"}).click(),
  ]);
  const png = readFileSync(await download.path()),
    box = await page.locator("[data-panel=position] .area").boundingBox();
  expect(
    png.subarray(1, 4).toString() === "PNG" && png.readUInt32BE(16) === Math.round(box.width),
    `${png.length} bytes, ${png.readUInt32BE(16)} pixels of ${box.width}`,
  );
});

await test("gallery, tour and frequencies lead where they say", async open => {
  const {page} = await open();
  await page.click("#go-gallery");
  await page.waitForSelector(".gallery li");
  const count = await page.locator(".gallery li").count();
  expect(count === 18, `${count} machines`);
  await page.screenshot({path: join(shots, "studio-gallery.png")});
  await page.locator(".gallery button", {hasText: "core-xy/core-xy.toml"}).click();
  await quiet(page);
  expect((await page.title()).startsWith("CoreXY"), await page.title());
  await page.click("#go-modes");
  await page.waitForSelector("#view-modes h2");
  await page.click("#go-tour");
  await page.waitForSelector("#tour-show");
  // Where the cart ends, and where it ended before the change; what the paper says of each figure is seen in them.
  const ends = () =>
    page.evaluate(() =>
      ["run", "before"].map(one => window.studio[one] && window.studio[one].columns.get("cart_position").at(-1)),
    );
  const told = {
    "Figures 6 and 7: Try twice the stiffness": [0.9999, 1.0001],
    "Figures 6 and 7: Try half the stiffness": [0.9999, 1.0001],
    "Figures 10 and 11: Try all twice as heavy": [0.9999, 1.0001],
    "Figures 12 and 13: Try twice the friction": [0.45, 0.55],
    "Figures 12 and 13: Try half the friction": [1.85, 2],
    "Figures 14 and 15: Try 10 V": [1.99999, 2.00001],
    "Figures 20 and 21: Try 10 V": [2.29, 2.31],
  };
  const figures = new Set(),
    seen = [];
  for (let stop = 0; ; stop++) {
    const words = await page.locator(".tour .lead").innerText(),
      place = await page.locator(".tour-words > p").first().innerText();
    expect(words.length > 60, words);
    const figure = place.split(" · ")[1],
      [first, last = first] = figure.match(/\d+/g).map(Number);
    for (let k = first; k <= last; k++) figures.add(k);
    let begun = null;
    for (const button of await page.locator(".tries button").all()) {
      const name = `${figure}: ${await button.innerText()}`;
      await button.click();
      await quiet(page);
      const state = await page.evaluate(() => [
        window.studio.view,
        window.studio.mistake && window.studio.mistake.what,
      ]);
      expect(state[0] === "tour" && !state[1], `${name}: ${JSON.stringify(state)}`);
      const [end, before] = await ends();
      begun ??= end;
      if (told[name]) {
        const ratio = end / (before ?? begun),
          [low, high] = told[name];
        expect(ratio > low && ratio < high, `${name}: the cart ends ${ratio} times as far`);
        seen.push(name);
      }
    }
    if (await page.locator("#tour-next").isDisabled()) break;
    await page.click("#tour-next");
    await quiet(page);
  }
  expect(figures.size === 21, `the tour has figures ${[...figures]}`);
  expect(seen.length === Object.keys(told).length, `of what the paper says only this was seen: ${seen}`);
  await page.evaluate(() => window.studio.show("motion"));
});

await test("frequencies are those of the case as it is", async open => {
  const {page} = await open();
  await page.click("#go-modes");
  await page.waitForSelector("#view-modes figure.live");
  const before = await page.locator("#view-modes table").first().innerText();
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 2);
    window.studio.drop();
  });
  await quiet(page);
  await page.waitForFunction(before => document.querySelector("#view-modes table").innerText !== before, before);
  await page.screenshot({path: join(shots, "studio-modes.png")});
});

await test("the keyboard reaches and moves everything", async open => {
  const {page} = await open();
  const reached = new Set();
  await page.keyboard.press("Tab");
  expect(
    (await page.evaluate(() => document.activeElement.className)) === "skip",
    "the first stop is not the way to the machine",
  );
  for (let k = 0; k < 250; k++) {
    const name = await page.evaluate(() => {
      const e = document.activeElement;
      return e.id || e.getAttribute("aria-label") || e.textContent.slice(0, 30);
    });
    reached.add(name);
    await page.keyboard.press("Tab");
  }
  for (const name of [
    "go-tour",
    "menu",
    "theme",
    "tab-parameters",
    "find",
    "play",
    "scrub",
    "rate",
    "factor",
    "experiment",
    "pin",
    "Position over time",
    "Stick and slip over time",
  ])
    expect(
      reached.has(name) || (name === "menu" && reached.has("Case")),
      `${name} is not reached: ${[...reached].join(" | ")}`,
    );
  await page.locator("[data-panel=speed] .area").focus();
  for (let k = 0; k < 10; k++) await page.keyboard.press("ArrowRight");
  await settled(page);
  const told = await page.locator("#said").innerText();
  expect(/100 ms: drive r φ₁′ 22\d.*mm\/s, cart x′/.test(told.replace("\u00a0", " ")), told);
  await page.keyboard.press("+");
  await quiet(page);
  expect((await page.evaluate(() => window.studio.window)) !== null, "+ does not zoom");
  await page.keyboard.press("0");
  await settled(page);
  expect((await page.evaluate(() => window.studio.window)) === null, "0 does not go back");
  await row(page, "cart.mass").locator("input[type=range]").focus();
  await page.keyboard.press("ArrowRight");
  await quiet(page);
  expect((await value(page, "cart.mass")) > 0.362, "an arrow does not move a slider");
  await page.keyboard.press("Control+z");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.362, "Ctrl-Z does not undo");
});

await test("each plot has a name, a description, and its values as a table", async open => {
  const {page} = await open();
  const plots = await page.locator(".live-plot").all();
  for (const plot of plots) {
    const area = plot.locator(".area");
    const [name, words] = [await area.getAttribute("aria-label"), await area.getAttribute("aria-description")];
    expect(name.length > 10 && words.length > 30, `${name}: ${words}`);
    await plot.locator(".data summary").click();
    await plot.locator(".data tbody tr").first().waitFor();
    const rows = await plot.locator(".data tbody tr").count(),
      heads = await plot.locator(".data th").count();
    expect(rows === 50 && heads >= 2, `${name}: ${rows} rows of ${heads}`);
    const cells = await plot.locator(".data td").allInnerTexts();
    expect(
      cells.every(text => text.length && text !== "\u2013"),
      `${name}: an empty cell`,
    );
    const before = await plot.locator(".value").first().innerText();
    await area.focus();
    await page.keyboard.press("End");
    await settled(page);
    await page.keyboard.press("Home");
    await settled(page);
    expect(
      (await plot.locator(".value").first().innerText()).length > 0,
      `${name}: no value at the cursor, ${before} before`,
    );
  }
  const tree = await page.locator("body").ariaSnapshot();
  for (const word of ["tablist", 'slider "Time"', 'application "Position over time"', 'img "The axis: cart at'])
    expect(tree.includes(word), `the tree lacks ${word}`);
});

for (const [width, height] of [
  [1400, 950],
  [820, 1100],
  [390, 844],
  [320, 700],
]) {
  for (const colorScheme of ["light", "dark"]) {
    for (const [name, path] of [
      ["axis", TABLE4],
      ["gantry", "stages/h-frame/h-frame.toml"],
    ]) {
      await test(`${name} at ${width} pixels, ${colorScheme}`, async open => {
        const {page} = await open(common.address, {viewport: {width, height}, colorScheme, hasTouch: width < 500});
        await page.evaluate(text => window.studio.open(text, {name: "test.toml"}), readFileSync(path, "utf8"));
        await quiet(page);
        await page.evaluate(() => window.studio.seek(0.1));
        await settled(page);
        await page.screenshot({path: join(shots, `studio-${name}-${width}-${colorScheme}.png`)});
        await page.screenshot({path: join(shots, `studio-${name}-${width}-${colorScheme}-whole.png`), fullPage: true});
        const {scroll, wide} = await page.evaluate(() => ({
          scroll: document.documentElement.scrollWidth,
          wide: document.documentElement.clientWidth,
        }));
        expect(scroll <= wide, `scrolls sideways: ${scroll} pixels on ${wide}`);
      });
    }
  }
}

await test("the theme is remembered, and in its tab what is unsaved", async open => {
  const {page, context} = await open();
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await paper();
  await page.locator("#theme").selectOption("dark");
  expect((await paper()) !== light, "nothing changes");
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 2);
    window.studio.drop();
  });
  await quiet(page);
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.run);
  expect((await paper()) !== light, "the theme is forgotten");
  expect((await value(page, "cart.mass")) === 2, "the change is forgotten");
  await page.click("#reset");
  await quiet(page);
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.run);
  const stored = await page.evaluate(() => [
    Object.keys(localStorage).join(),
    Object.keys(sessionStorage).length,
    document.cookie,
  ]);
  expect(stored[0] === "taut-theme" && stored[1] === 0 && stored[2] === "", JSON.stringify(stored));
  const {cookies} = await context.storageState();
  expect(cookies.length === 1 && cookies[0].httpOnly && cookies[0].sameSite === "Strict", JSON.stringify(cookies));
});

/** Of texts whose contrast axe leaves undecided, in drawings above all: those below 4.5 on the ground behind them. */
const faint = (page, nodes) =>
  page.evaluate(
    targets => {
      const pen = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
      const rgb = colour => {
        pen.clearRect(0, 0, 1, 1);
        pen.fillStyle = colour;
        pen.fillRect(0, 0, 1, 1);
        return [...pen.getImageData(0, 0, 1, 1).data];
      };
      const linear = share => (share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4);
      const luminance = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
      return targets
        .map(target => document.querySelector(target))
        .flatMap(element => {
          let ground = element,
            opacity = 1;
          for (let at = element; at; at = at.parentElement) opacity *= Number(getComputedStyle(at).opacity);
          while (ground.parentElement && (ground.closest("svg") || !rgb(getComputedStyle(ground).backgroundColor)[3]))
            ground = ground.parentElement;
          const below = rgb(getComputedStyle(ground).backgroundColor),
            style = getComputedStyle(element);
          const colour = rgb(element.closest("svg") ? style.fill : style.color).map(
            (value, k) => value * opacity + below[k] * (1 - opacity),
          );
          const [dark, light] = [luminance(below), luminance(colour)].sort((a, b) => a - b),
            contrast = (light + 0.05) / (dark + 0.05);
          return contrast < 4.5 ? [`${contrast.toFixed(2)} of "${element.textContent}"`] : [];
        });
    },
    nodes.map(node => node.target[0]),
  );

await test("axe finds nothing serious, and what it leaves undecided has contrast", async open => {
  // The page's own policy lets no foreign script in, so it is evaluated.
  for (const colorScheme of ["light", "dark"]) {
    const {page} = await open(common.address, {colorScheme, reducedMotion: "reduce"});
    await page.evaluate(readFileSync(axe, "utf8"));
    for (const view of ["motion", "modes", "fit", "tune", "shape", "sweep", "gallery", "tour"]) {
      await page.evaluate(view => window.studio.show(view), view);
      await quiet(page);
      for (const tab of view === "motion" ? ["parameters", "case", "results"] : [null]) {
        if (tab) await page.click(`#tab-${tab}`);
        const found = await page.evaluate(() => window.axe.run({resultTypes: ["violations", "incomplete"]}));
        const grave = found.violations.filter(one => ["serious", "critical"].includes(one.impact));
        const told = grave.map(
          one =>
            `${one.id}: ${one.nodes
              .slice(0, 3)
              .map(node => node.html.slice(0, 160))
              .join(" | ")}`,
        );
        expect(!grave.length, `${view} ${tab || ""}, ${colorScheme}: ${told.join("; ")}`);
        const undecided = found.incomplete.filter(one => one.id === "color-contrast").flatMap(one => one.nodes);
        const pale = await faint(page, undecided);
        expect(!pale.length, `${view} ${tab || ""}, ${colorScheme}: contrast ${pale.slice(0, 5).join(", ")}`);
        // Nothing but words for those who do not see the page may be read out by itself while the machine plays.
        const loud = await page.evaluate(() =>
          [...document.querySelectorAll("#view-motion output, #view-motion [role=status], #view-motion [aria-live]")]
            .map(one => one.id)
            .join(),
        );
        expect(loud === "mistake", `live regions: ${loud}`);
        // The figures of the view of frequencies are those of reports.
        const nameless =
          view === "modes"
            ? []
            : (await page.locator("body").ariaSnapshot())
                .split("\n")
                .filter(line => /^\s*- (group|figure|region|toolbar|slider|textbox)(:|$)/.test(line));
        expect(!nameless.length, `${view}: without a name ${nameless.join("; ")}`);
      }
    }
  }
});

// "K_t" and "torque constant" were read as one word, and 62 stops lay between the start of the page and Play.
await test("fields are read by symbol and name, and the first link leads to the machine", async open => {
  const {page} = await open();
  const tree = await page.locator("#side-parameters").ariaSnapshot();
  for (const words of [
    'textbox "K_t torque constant"',
    'textbox "k₂ stiffness of span 2, cart to idler"',
    'group "Belt"',
  ])
    expect(tree.includes(words), `the tree lacks ${words}`);
  const hash = await page.evaluate(() => location.hash);
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await page.keyboard.press("Tab");
  expect(
    (await page.evaluate(() => document.activeElement.id)) === "play",
    `the first stop is ${await page.evaluate(() => document.activeElement.outerHTML.slice(0, 80))}`,
  );
  expect((await page.evaluate(() => location.hash)) === hash, "the link takes the state out of the address");
});

await test("no view scrolls sideways at 320 pixels", async open => {
  const {page} = await open(common.address, {viewport: {width: 320, height: 700}, hasTouch: true});
  for (const view of ["motion", "modes", "fit", "tune", "shape", "sweep", "gallery", "tour"]) {
    await page.evaluate(view => window.studio.show(view), view);
    await quiet(page);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(wide <= 320, `${view} is ${wide} pixels wide`);
    await page.screenshot({path: join(shots, `studio-320-${view}.png`)});
  }
});

await test("two studios and several tabs keep apart", async open => {
  const other = await serve(["stages/h-frame/h-frame.toml"]);
  const first = await open(),
    {page, context} = first;
  const second = await context.newPage();
  await second.goto(other.address);
  await second.waitForFunction(() => window.studio && window.studio.run);
  const third = await context.newPage();
  await third.goto(common.address);
  await third.waitForFunction(() => window.studio && window.studio.run);
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 1);
    window.studio.drop();
  });
  await quiet(page);
  expect(
    (await value(third, "cart.mass")) === 0.362 && (await second.title()).startsWith("H-frame"),
    "tabs share a state",
  );
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.run);
});

await test("when the server ends, the page says so and keeps its text", async open => {
  const {address, child} = await serve([TABLE4]),
    {page, trouble} = await open(address);
  const begun = Date.now();
  child.kill("SIGTERM");
  await new Promise(done => child.once("exit", done));
  expect(Date.now() - begun < 2000, `it took ${Date.now() - begun} ms to end`);
  await page.waitForFunction(() => /does not answer/.test(document.querySelector("#notice").textContent));
  expect((await page.evaluate(() => window.studio.text)).includes("0.362 kg"), "the text went");
  // The browser itself tells of sockets that find nobody.
  trouble.length = 0;
});

await harness.end("the studio in a browser");
