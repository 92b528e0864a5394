// Takes the tour and uses what makes the studio's page comfortable, in a browser as a person would; cargo xtask browser
// runs this.
//
//   node studio-lesson.mjs BROWSER TAUT SHOTS [NAME]
//
// TAUT is the program; it is run in the folder of the project. Pictures go to SHOTS. Of tests with NAME in their names
// only these are done.
import {mkdirSync, readFileSync} from "node:fs";
import {join} from "node:path";
import {Harness, expect, quiet, row, seen, settled, value} from "./harness.mjs";

const [program, taut, shots, only] = process.argv.slice(2);
mkdirSync(shots, {recursive: true});
const TABLE4 = "stages/sollmann-jouaneh/table4.toml";

const harness = new Harness(program, taut);
await harness.start();
const common = await harness.serve([TABLE4]);
/** Pages are of the common server. */
const test = (name, work) =>
  !only || name.includes(only)
    ? harness.test(name, open => work((options = {}) => open(common.address, options)))
    : null;

/** Drags a slider that reaches from a tenth to ten times its value, until the value is this many times what it was. */
async function dragTo(page, input, ratio) {
  await input.evaluate(input => input.scrollIntoView({block: "center", behavior: "instant"}));
  const {x, y, width} = await input.boundingBox(),
    at = share => x + 8 + (width - 16) * share;
  await page.mouse.move(at(0.5), y + 10);
  await page.mouse.down();
  for (const part of [0.3, 0.6, 1]) await page.mouse.move(at(0.5 + (part * Math.log10(ratio)) / 2), y + 10);
  await page.mouse.up();
  await quiet(page);
}

// ---- The tour

/** What answers the question of each stop: the key of a slider, and how many times as large its value becomes. */
const ANSWERS = [
  ["belt.stiffness.0", 0.12],
  ["belt.stiffness.2", 3.5],
  ["cart.friction.viscous", 0.6],
  ["belt.stiffness.1", 6],
  ["belt.stiffness.0", 3.5],
  ["cart.mass", 6],
  ["cart.friction.viscous", 3.2],
  ["experiment.0.input.pulse", 2],
  ["cart.friction.stribeck.force", 0.12],
  ["cart.friction.coulomb", 3],
  ["cart.friction.coulomb", 8],
  ["experiment.0.input.pulse", 1.77],
];

for (const [width, height] of [
  [1440, 900],
  [390, 844],
]) {
  await test(`each question of the tour is answered by a drag beside the machine, at ${width} pixels`, async open => {
    const {page} = await open({viewport: {width, height}, reducedMotion: "reduce"});
    await page.click("#go-tour");
    await quiet(page);
    for (const [stop, [key, ratio]] of ANSWERS.entries()) {
      const input = page.locator(`[data-tour="${key}"] input[type=range]`),
        answer = page.locator(".answer");
      const name = `stop ${stop + 1}`;
      await input.waitFor();
      const figure = (await page.locator(".tour-show .live-plot").count())
        ? ".tour-show .area"
        : ".tour-show figure svg";
      await page.locator(figure).first().waitFor();
      await dragTo(page, input, 1.02);
      expect((await answer.innerText()) === "", `${name}: it is answered before anything is done`);
      const before = await page.locator(".reading").innerText();
      await page.locator("#tour-show").click();
      await quiet(page);
      await dragTo(page, input, ratio);
      expect(
        (await answer.innerText()).length > 60,
        `${name}: ${before} ${await page.locator(".reading").innerText()}`,
      );
      for (const part of [".tour-show .stage-box svg", `[data-tour="${key}"] input[type=range]`])
        expect((await seen(page, part)) === 3, `${name}: ${part} is seen at ${await seen(page, part)} of 3 places`);
      expect((await seen(page, figure)) >= 1, `${name}: the figure is out of sight`);
      if (stop % 4 === 0) await page.screenshot({path: join(shots, `studio-tour-${stop + 1}-${width}.png`)});
      for (const button of await page.locator(".tries button").all()) {
        await button.click();
        await quiet(page);
        const read = await page.locator(".reading").innerText();
        expect(read.length > 10 && !/–|NaN|undefined/.test(read), `${name}, ${await button.innerText()}: ${read}`);
      }
      if (stop + 1 < ANSWERS.length) await page.click("#tour-next");
      await quiet(page);
    }
    expect(await page.locator("#tour-next").isDisabled(), "there are more stops than questions");
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(wide <= width, `it is ${wide} pixels wide`);
    // What was dragged is nobody's work: the case of the command line is kept, and nothing else.
    await page.click("#go-gallery");
    expect(!(await page.evaluate(() => window.studio.isUnsaved)), "the tour's case counts as unsaved work");
  });
}

await test("the tour plays, a link leads to its stop, and its case is explored in the other views", async open => {
  const {page} = await open();
  await page.click("#go-tour");
  await page.waitForFunction(() => window.studio.isPlaying && window.studio.cursor > 0.02);
  await page.click("#tour-play");
  await page.click("#tour-next");
  await quiet(page);
  const hash = await page.evaluate(async () => (await import("/link.js")).fragment(window.studio.snapshot()));
  await page.click("#go-motion");
  await quiet(page);
  expect((await page.title()).includes("Table 1"), await page.title());
  expect((await page.locator("#plots .live-plot").count()) === 9, "the plots of the motion are not there");
  await page.click("#go-tour");
  expect(/^2 of 12/.test(await page.locator(".tour-words > p").first().innerText()), "the tour begins again");
  await page.evaluate(hash => {
    window.studio.stop = 0;
    location.hash = hash;
  }, hash);
  await page.waitForFunction(() => /^2 of 12/.test(document.querySelector(".tour-words > p").textContent));
});

// ---- Playing

// Another rate while it played had the cursor moved twice.
await test("another rate while it plays is the rate at which it plays", async open => {
  const {page} = await open();
  const rate = await page.evaluate(async () => {
    const app = window.studio;
    app.play();
    for (let k = 0; k < 4; k++) {
      app.rate = 0.02;
      app.tell("play");
      await new Promise(done => setTimeout(done, 30));
    }
    const [begun, from] = [performance.now(), app.cursor];
    await new Promise(done => setTimeout(done, 1000));
    return (app.cursor - from) / ((performance.now() - begun) / 1000);
  });
  expect(rate > 0.008 && rate < 0.024, `it plays at ${rate}`);
});

// ---- Panels

await test("the panels have the sizes that they were given, also after a reload", async open => {
  const {page} = await open();
  const wide = () => page.locator(".side").evaluate(side => side.getBoundingClientRect().width);
  const before = await wide(),
    {x, y, height} = await page.locator("#size-side").boundingBox();
  await page.mouse.move(x + 3, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + 63, y + height / 2, {steps: 3});
  await page.mouse.move(x + 123, y + height / 2, {steps: 3});
  await page.mouse.up();
  expect(Math.abs((await wide()) - before - 120) < 2, `${before} pixels became ${await wide()}`);
  await page.locator("#size-side").focus();
  await page.keyboard.press("ArrowLeft");
  expect(Math.abs((await wide()) - before - 104) < 2, `a key makes them ${await wide()}`);
  const tall = () => page.locator(".stage-box svg").evaluate(svg => svg.getBoundingClientRect().height),
    drawn = await tall();
  await page.locator("#size-stage").focus();
  for (let k = 0; k < 4; k++) await page.keyboard.press("ArrowUp");
  expect(Math.abs((await tall()) - drawn + 64) < 2, `the drawing has ${await tall()} pixels of ${drawn}`);
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.run);
  await settled(page);
  expect(Math.abs((await wide()) - before - 104) < 2, `after a reload they are ${await wide()}`);
  expect(Math.abs((await tall()) - drawn + 64) < 2, `after a reload the drawing has ${await tall()}`);
  for (const name of ["side", "stage"]) await page.locator(`#size-${name}`).dblclick();
  expect(Math.abs((await wide()) - before) < 2, `a double click leaves ${await wide()}`);
  expect((await page.evaluate(() => localStorage.getItem("taut-layout"))) === null, "the browser keeps what was reset");
});

/** Keys of the plots as they stand in the page. */
const order = page => page.evaluate(() => [...document.querySelectorAll("#plots>*")].map(plot => plot.dataset.panel));
const layout = page => page.evaluate(() => localStorage.getItem("taut-layout"));

async function again(page) {
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.run && document.querySelector(".live-plot"));
  await settled(page);
}

await test("plots are moved by buttons, keys and the mouse, and stay there until the layout is reset", async open => {
  const {page} = await open({viewport: {width: 1440, height: 950}}),
    first = await order(page),
    [a, b, c, d] = first;
  const menu = page.locator(`[data-panel=${c}] .move`),
    way = name => menu.getByRole("button", {name, exact: true});
  expect(!(await page.locator("#reset-layout").isVisible()), "there is something to reset");
  await menu.locator("summary").focus();
  await page.keyboard.press("Enter");
  await page.screenshot({path: join(shots, "studio-move.png")});
  await way("Up").focus();
  await page.keyboard.press("Enter");
  expect((await order(page)).slice(0, 4).join() === [c, a, b, d].join(), `up gives ${await order(page)}`);
  expect(/ is 1 of 9$/.test(await page.locator("#said").textContent()), await page.locator("#said").textContent());
  expect(await way("Up").evaluate(button => button === document.activeElement), "the focus is lost");
  await way("Up").click();
  expect((await order(page)).slice(0, 4).join() === [c, a, b, d].join(), `up again gives ${await order(page)}`);
  await way("Right").click();
  expect((await order(page)).slice(0, 4).join() === [a, c, b, d].join(), `right gives ${await order(page)}`);
  await way("Down").click();
  expect((await order(page)).slice(0, 4).join() === [a, b, d, c].join(), `down gives ${await order(page)}`);
  await way("Left").click();
  expect((await order(page)).slice(0, 4).join() === [a, b, c, d].join(), `left gives ${await order(page)}`);
  await way("To the front").click();
  await page.keyboard.press("Escape");
  const from = await page.locator(`[data-panel=${c}] h3`).boundingBox(),
    to = await page.locator(`[data-panel=${a}] .area`).boundingBox();
  await page.mouse.move(from.x + 10, from.y + 10);
  await page.mouse.down();
  await page.mouse.move(to.x + 80, to.y + 40, {steps: 3});
  expect((await page.locator(".target").count()) === 1, "the place is not marked");
  await page.mouse.up();
  const moved = [a, c, ...first.slice(1).filter(key => key !== c)].join();
  expect((await order(page)).join() === moved, `the mouse gives ${await order(page)}`);
  await again(page);
  expect((await order(page)).join() === moved, `after a reload ${await order(page)}`);
  // A narrow page has the plots as ever, and nothing that arranges them.
  await page.setViewportSize({width: 1000, height: 900});
  await settled(page);
  expect((await order(page)).join() === first.join(), `a narrow page has ${await order(page)}`);
  expect(!(await page.locator(".move, .live-plot>.splitter, #reset-layout").filter({visible: true}).count()), "tools");
  await page.setViewportSize({width: 1440, height: 950});
  await settled(page);
  expect((await order(page)).join() === moved, `a wide page again ${await order(page)}`);
  await page.locator("#reset-layout").click();
  expect((await order(page)).join() === first.join(), `reset gives ${await order(page)}`);
  expect((await layout(page)) === null, "the browser keeps what was reset");
  expect(!(await page.locator("#reset-layout").isVisible()), "there is more to reset");
});

for (const by of ["mouse", "touch", "keys"]) {
  await test(`plots have the sizes that they were given by ${by}, also after a reload`, async open => {
    const {page} = await open({viewport: {width: 1440, height: 950}, hasTouch: by === "touch"}),
      box = () => page.locator("[data-panel=position] .area").boundingBox(),
      bar = name => page.locator(`#${name}-position`);
    const before = await box(),
      session = by === "touch" ? await page.context().newCDPSession(page) : null;
    const touch = (type, points) => session.send("Input.dispatchTouchEvent", {type, touchPoints: points});
    const drag = async (name, right, down) => {
      if (by === "keys") {
        await bar(name).focus();
        for (let k = 0; k < 3; k++) await page.keyboard.press(name === "wide" ? "ArrowRight" : "ArrowDown");
        return;
      }
      const {x, y, width, height} = await bar(name).boundingBox(),
        at = part => ({x: x + width / 2 + part * right, y: y + height / 2 + part * down});
      if (session) {
        await touch("touchStart", [at(0)]);
        for (const part of [0.3, 0.6, 1]) await touch("touchMove", [at(part)]);
        await touch("touchEnd", []);
        return;
      }
      await page.mouse.move(at(0).x, at(0).y);
      await page.mouse.down();
      for (const part of [0.3, 0.6, 1]) await page.mouse.move(at(part).x, at(part).y);
      await page.mouse.up();
    };
    const columns = Number(await bar("wide").evaluate(bar => (bar.focus(), bar.getAttribute("aria-valuenow"))));
    expect(columns === 6, `at first ${columns} columns`);
    // Three columns of the grid, and as many pixels as three strokes of a key.
    await drag("wide", (before.width + 25.6) / 2, 0);
    await drag("tall", 0, 48);
    await settled(page);
    const now = await box(),
      wide = 1.5 * (before.width + 25.6) - 25.6;
    expect(Math.abs(now.width - wide) < 2, `${before.width} pixels became ${now.width}, not ${wide}`);
    expect(Math.abs(now.height - before.height - 48) < 2, `${before.height} pixels became ${now.height}`);
    expect((await bar("wide").getAttribute("aria-valuetext")) === "9 of 12 columns", "the width is not told");
    const drawn = await page
      .locator("[data-panel=position] canvas")
      .first()
      .evaluate(canvas => canvas.clientHeight);
    expect(Math.abs(drawn - now.height) < 2, `curves are drawn ${drawn} high`);
    await again(page);
    const then = await box();
    expect(Math.abs(then.width - now.width) < 2 && Math.abs(then.height - now.height) < 2, "a reload changes sizes");
    await page.screenshot({path: join(shots, `studio-sizes-${by}.png`)});
    for (const name of ["wide", "tall"]) await bar(name).dblclick();
    await settled(page);
    expect(Math.abs((await box()).width - before.width) < 2, `a double click leaves ${(await box()).width}`);
    expect((await layout(page)) === null, `the browser keeps ${await layout(page)}`);
  });
}

await test("what is no layout in the browser's storage harms nothing", async open => {
  const {page} = await open({viewport: {width: 1440, height: 950}}),
    first = await order(page);
  const mixed = ["state", 3, "nothing"],
    panels = {order: mixed, wide: {position: "x", speed: 400}, tall: {position: -1e9, error: null}};
  for (const kept of ["null", "[]", "7", "{", JSON.stringify({panels: 3, side: "x"}), JSON.stringify({panels})]) {
    await page.evaluate(kept => localStorage.setItem("taut-layout", kept), kept);
    await again(page);
    expect((await order(page)).length === first.length, `${kept}: ${await order(page)}`);
    expect((await page.evaluate(() => document.documentElement.scrollWidth)) <= 1440, `${kept}: it scrolls sideways`);
    const {height} = await page.locator("[data-panel=position] .area").boundingBox();
    expect(height > 60, `${kept}: a plot is ${height} high`);
    await page.locator("#tall-speed").focus();
    await page.keyboard.press("ArrowDown");
    expect(JSON.parse(await layout(page)).panels.tall.speed === 186, `${kept}: ${await layout(page)}`);
  }
  expect((await order(page))[0] === "state", `${await order(page)}`);
});

await test("drawing, plot and slider are on a phone on its side together", async open => {
  const {page} = await open({viewport: {width: 844, height: 390}, hasTouch: true});
  await page
    .locator("[data-panel=position]")
    .evaluate(plot => plot.scrollIntoView({block: "start", behavior: "instant"}));
  const input = row(page, "cart.mass").locator("input[type=range]");
  await input.evaluate(input => {
    const panel = input.closest(".side-panel");
    panel.scrollTop += input.getBoundingClientRect().top - panel.getBoundingClientRect().top - 60;
  });
  await settled(page);
  for (const part of [".stage-box svg", '[data-key="cart.mass"] input[type=range]'])
    expect((await seen(page, part)) === 3, `${part} is seen at ${await seen(page, part)} of 3 places`);
  expect((await seen(page, "[data-panel=position] .area")) >= 2, "the plot is out of sight");
  await page.screenshot({path: join(shots, "studio-on-its-side.png")});
});

// ---- Parameters

await test("favourites stand first, and the browser remembers them", async open => {
  const {page} = await open(),
    first = page.locator("[data-favourite]");
  await row(page, "cart.friction.viscous").locator("input[type=range]").focus();
  await row(page, "cart.friction.viscous").locator(".star").click();
  await settled(page);
  expect(
    (await first.count()) === 1 && (await first.innerText()).includes("Cart, friction viscous"),
    "it is not first",
  );
  const tops = await page.evaluate(() =>
    ["[data-favourite]", ".groups"].map(one => document.querySelector(one).getBoundingClientRect().top),
  );
  expect(tops[0] < tops[1], `the favourite is at ${tops[0]}, the groups at ${tops[1]}`);
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.run && document.querySelector("[data-favourite]"));
  await first.locator("input[type=range]").focus();
  await page.keyboard.press("ArrowRight");
  await quiet(page);
  expect((await value(page, "cart.friction.viscous")) > 19.05, "its slider moves nothing");
  const shown = await row(page, "cart.friction.viscous").locator("input[type=text]").inputValue();
  expect(shown === (await first.locator("input[type=text]").inputValue()), "its two rows differ");
  await first.locator(".star").click();
  expect((await first.count()) === 0, "it stays a favourite");
  expect((await page.evaluate(() => localStorage.getItem("taut-layout"))) === null, "the browser keeps it");
});

await test("a parameter goes back to its value, and its slider reaches what was chosen", async open => {
  const {page} = await open(),
    mass = row(page, "cart.mass"),
    input = mass.locator("input[type=range]");
  const [from, to] = [mass.locator("input[type=number]").first(), mass.locator("input[type=number]").last()];
  await input.focus();
  expect((await from.inputValue()) === "0.0362" && (await to.inputValue()) === "3.62", "its ends are not told");
  await from.fill("0.3");
  await to.fill("0.5");
  await to.press("Tab");
  await input.focus();
  await page.keyboard.press("End");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.5, `its end is ${await value(page, "cart.mass")}`);
  await page.keyboard.press("Home");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.3, `its beginning is ${await value(page, "cart.mass")}`);
  // Ends that are none are those from before: a tenth of the value to ten times it.
  await from.fill("9");
  await from.press("Tab");
  expect((await to.inputValue()) === "3", `its upper end is ${await to.inputValue()}`);
  await mass.locator("button", {hasText: "Back to 0.362"}).click();
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.362, `back at ${await value(page, "cart.mass")}`);
  await page.click("#undo");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.3, "going back cannot be undone");
});

await test("any key of the case is set, and one that is none is refused with what is allowed", async open => {
  const {page} = await open();
  await page.locator("#any").fill("travel = { min = -0.2, max = 0.3 }");
  await page.locator("#any").press("Enter");
  await page.waitForFunction(() => window.studio.text.includes("travel"));
  await quiet(page);
  expect((await value(page, "travel.max")) === 0.3, "the table is not in the case");
  for (const [typed, pattern] of [
    ["cart.masss = 1 kg", /did you mean `mass`/],
    ["cart.mass", /KEY=VALUE/],
    ["cart.mass = 3 mm", /is a length/],
  ]) {
    await page.locator("#any").fill(typed);
    await page.locator("#any").press("Enter");
    await page.waitForSelector("#notice.grave:not([hidden])");
    await settled(page);
    await quiet(page);
    expect(pattern.test(await page.locator("#notice").innerText()), await page.locator("#notice").innerText());
    expect((await page.locator("#any").inputValue()) === typed, "what was typed is gone");
  }
  await page.click("#undo");
  await quiet(page);
  expect(
    (await page.evaluate(() => window.studio.text)) === readFileSync(TABLE4, "utf8"),
    "it is not one step to undo",
  );
});

// ---- The case text

await test("the case text is completed and explained by the schema", async open => {
  const {page} = await open();
  await page.click("#tab-case");
  const field = page.locator("#text"),
    hints = page.locator("#hints"),
    meaning = page.locator("#meaning");
  const text = () => field.inputValue(),
    go = mark =>
      field.evaluate((field, mark) => {
        const at = field.value.indexOf(mark) + mark.length;
        field.focus();
        field.setSelectionRange(at, at);
      }, mark);
  await page.waitForFunction(() => document.querySelector("#text").value.includes("[cart]"));
  await go("[cart]");
  await page.keyboard.type("\nlo");
  expect(/^load/.test(await hints.innerText()), `for "lo" it offers ${await hints.innerText()}`);
  expect((await field.getAttribute("aria-activedescendant")) === "hint-0", "the chosen hint is not told");
  await page.screenshot({path: join(shots, "studio-hints.png")});
  await page.keyboard.press("Enter");
  expect((await text()).includes("[cart]\nload\n") || (await text()).includes("[cart]\nload "), "it is not written");
  expect(/Constant force on the cart/.test(await meaning.innerText()), await meaning.innerText());
  await page.keyboard.type(' = "1 N"\n');
  await quiet(page);
  expect((await value(page, "cart.load")) === 1, "the completed key is not read");
  // Within a table on one line: keys that are there already are not offered.
  await go('friction = { viscous = "19.0424 N s/m", ');
  await page.keyboard.press("Control+ ");
  const offered = await hints.locator("b").allInnerTexts();
  expect(offered.includes("along") && !offered.includes("viscous"), `offered are ${offered}`);
  await page.keyboard.press("Escape");
  expect(!(await hints.isVisible()), "Escape does not close the list");
  // A list follows its word, and closes where that is out of sight: here in a field of a few lines.
  await page.keyboard.press("Control+ ");
  const lists = [];
  for (const moved of [0, 10, 10]) {
    await field.evaluate((field, moved) => (field.scrollTop += moved), moved);
    await settled(page);
    lists.push((await hints.boundingBox()).y);
  }
  expect(lists[1] === lists[0] - 10 && lists[2] === lists[0] - 20, `the list is at ${lists}`);
  await field.evaluate(field => {
    field.style.height = "60px";
    field.scrollTop = 0;
  });
  await settled(page);
  expect(!(await hints.isVisible()), "the list of a word out of sight is open");
  await field.evaluate(field => field.style.removeProperty("height"));
  // The mouse over a word.
  await go("[belt]");
  const spot = await field.evaluate(field => {
    const lines = field.value.slice(0, field.value.indexOf("stiffness = ")).split("\n").length - 1;
    const tall = parseFloat(getComputedStyle(field).lineHeight);
    field.scrollTop = (lines - 4) * tall;
    const {left, top} = field.getBoundingClientRect();
    return {x: left + 40, y: top + 8 + lines * tall - field.scrollTop + tall / 2};
  });
  await page.mouse.move(spot.x, spot.y);
  expect(/^belt.stiffness: Stiffness of each span/.test(await meaning.innerText()), await meaning.innerText());
  // A choice is offered as it is typed; an example of a number only on demand.
  await page.evaluate(() => window.studio.edit("kind = \n[cart]\nmass = "));
  await field.evaluate(field => field.setSelectionRange(7, 7));
  await page.keyboard.press("Control+ ");
  const kinds = (await hints.locator("b").allInnerTexts()).join();
  // The shorter text scrolls the field, which is told two pictures later: the list stays.
  await settled(page);
  expect(await hints.isVisible(), "the list closes where the field scrolls by itself");
  expect(kinds === '"axis","h-frame","core-xy","dual-belt"', kinds);
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Tab");
  expect((await text()).startsWith('kind = "h-frame"\n'), await text());
  await page.keyboard.press("Control+End");
  await page.keyboard.type("3");
  expect(!(await hints.isVisible()), "a number is completed to another");
});

// ---- What can be taken elsewhere

await test("the motion is a GIF of the machine and its plots", async open => {
  const {page} = await open();
  await page.click("#menu summary");
  const [download] = await Promise.all([page.waitForEvent("download", {timeout: 60_000}), page.click("#film")]);
  const gif = readFileSync(await download.path());
  expect(download.suggestedFilename().endsWith(".gif") && gif.subarray(0, 6).toString() === "GIF89a", "it is no GIF");
  expect(gif.length < 4 << 20, `it has ${gif.length} bytes`);
  const told = await page.evaluate(async base64 => {
    const data = Uint8Array.from(atob(base64), letter => letter.charCodeAt(0));
    const decoder = new ImageDecoder({data, type: "image/gif"});
    await decoder.completed;
    await decoder.tracks.ready;
    const {frameCount} = decoder.tracks.selectedTrack,
      sums = [];
    for (const frameIndex of [0, 20, frameCount - 1]) {
      const {image} = await decoder.decode({frameIndex}),
        canvas = new OffscreenCanvas(image.displayWidth, image.displayHeight),
        pen = canvas.getContext("2d");
      pen.drawImage(image, 0, 0);
      const {data} = pen.getImageData(0, 0, canvas.width, canvas.height);
      let dark = 0;
      for (let k = 0; k < data.length; k += 4) if (data[k] + data[k + 1] + data[k + 2] < 500) dark++;
      sums.push({
        width: canvas.width,
        corner: [...data.slice(0, 3)],
        dark: dark / (data.length / 4),
        bits: data.join().length,
      });
    }
    return {frameCount, sums};
  }, gif.toString("base64"));
  expect(told.frameCount === 80, `${told.frameCount} pictures`);
  for (const one of told.sums) {
    expect(one.width === 800 && one.corner.every(value => value > 250), `a picture is ${JSON.stringify(one)}`);
    expect(one.dark > 0.005 && one.dark < 0.3, `a share of ${one.dark} is dark`);
  }
  expect(new Set(told.sums.map(one => one.bits)).size > 1, "all pictures are the same");
  expect((await page.evaluate(() => window.studio.cursor)) === 0, "the cursor is where the last picture was");
});

await harness.end("a lesson in the studio");
