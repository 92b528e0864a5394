// Changes cases in the studio by mouse, touch and keys, and looks for edits that jump, stick or get lost; cargo xtask
// browser runs this.
//
//   node studio-edits.mjs BROWSER TAUT SHOTS [NAME]
//
// TAUT is the program; it is run in the folder of the project. Of tests with NAME in their names only these are done.
import {readFileSync} from "node:fs";
import {Harness, expect, quiet, row, seen, settled, value} from "./harness.mjs";

const [program, taut, , only] = process.argv.slice(2);
const TABLE4 = "stages/sollmann-jouaneh/table4.toml",
  PRINTER = "stages/printer-axis/printer-axis.toml";

const harness = new Harness(program, taut);
await harness.start();
const common = await harness.serve([TABLE4]);
/** Pages are of the common server, unless another address is named. */
const test = (name, work) =>
  !only || name.includes(only)
    ? harness.test(name, open => work((address = common.address, options = {}) => open(address, options)))
    : null;
const slider = (page, key) => row(page, key).locator("input[type=range]");

/** The middle of a slider's thumb. */
const thumb = locator =>
  locator.evaluate(input => {
    const {left, top, width, height} = input.getBoundingClientRect();
    return {x: left + 8 + ((width - 16) * Number(input.value)) / 1000, y: top + height / 2};
  });

// ---- Sliders

// A press centred the range on the value and left the thumb where it was: 0.362 dragged to 0.952, pressed again and
// moved by 2 pixels, was 2.587, and 2 pixels back 6.805.
for (const [by, options] of [
  ["mouse", {}],
  ["touch", {hasTouch: true}],
]) {
  await test(`a slider that is pressed again ten times by ${by} moves by as much as the pointer`, async open => {
    const {page} = await open(common.address, options),
      input = slider(page, "cart.mass");
    await input.scrollIntoViewIfNeeded();
    const session = by === "touch" ? await page.context().newCDPSession(page) : null;
    const touch = (type, x, y) =>
      session.send("Input.dispatchTouchEvent", {type, touchPoints: type === "touchEnd" ? [] : [{x, y}]});
    const press = (x, y) => (session ? touch("touchStart", x, y) : page.mouse.move(x, y).then(() => page.mouse.down()));
    const move = (x, y) => (session ? touch("touchMove", x, y) : page.mouse.move(x, y));
    const release = () => (session ? touch("touchEnd") : page.mouse.up());
    const pixels = await input.evaluate(input => input.getBoundingClientRect().width - 16);
    let expected = 0.362;
    for (let k = 0; k < 10; k++) {
      const {x, y} = await thumb(input),
        beside = [0, 5, -5, 3, -3][k % 5],
        by = [30, 2, -2, 12, -20][k % 5];
      await press(x + beside, y);
      await settled(page);
      await release();
      await quiet(page);
      const pressed = await value(page, "cart.mass");
      expect(Math.abs(pressed / expected - 1) < 0.003, `press ${k} without a move makes ${expected} ${pressed}`);
      await press(x + beside, y);
      // A finger counts as moving from a few pixels on.
      for (const to of [40 * Math.sign(by), by]) await move(x + beside + to, y);
      await release();
      await quiet(page);
      expected = pressed * 100 ** (by / pixels);
      const now = await value(page, "cart.mass");
      expect(
        Math.abs(now / expected - 1) < 0.01,
        `drag ${k} by ${by} pixels goes from ${pressed} to ${now}, not ${expected}`,
      );
      expected = now;
    }
    const text = await page.evaluate(() =>
      [window.studio.base === window.studio.text, window.studio.pending.size].join(),
    );
    expect(text === "true,0", `the drag is not part of the text: ${text}`);
  });
}

await test("a slider that is used again ten times by keys moves by one step a key", async open => {
  const {page} = await open(),
    input = slider(page, "cart.mass");
  let expected = 0.362;
  for (let k = 0; k < 10; k++) {
    await input.focus();
    await page.keyboard.press(k % 3 ? "ArrowRight" : "ArrowLeft");
    await quiet(page);
    expected *= 100 ** ((k % 3 ? 1 : -1) / 1000);
    const now = await value(page, "cart.mass");
    expect(Math.abs(now / expected - 1) < 0.003, `key ${k} gives ${now}, not ${expected}`);
    await page.locator("#find").focus();
  }
});

await test("a slider that is left at its end reaches further, and undo moves the thumb under the focus", async open => {
  const {page} = await open(),
    input = slider(page, "cart.mass");
  await input.focus();
  await page.keyboard.press("End");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 3.62, `its end is ${await value(page, "cart.mass")}`);
  await page.keyboard.press("Control+z");
  await quiet(page);
  expect((await input.inputValue()) === "500", `after undo the thumb is at ${await input.inputValue()}`);
  await page.keyboard.press("End");
  await page.locator("#find").focus();
  await quiet(page);
  await input.focus();
  await page.keyboard.press("End");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 36.2, `its next end is ${await value(page, "cart.mass")}`);
});

await test("a slider of whole numbers goes from one to the next by a key", async open => {
  const {page} = await open(),
    key = "drive_pulley.teeth";
  await page.evaluate(text => window.studio.open(text, {name: "printer.toml"}), readFileSync(PRINTER, "utf8"));
  await quiet(page);
  const before = await value(page, key);
  await slider(page, key).focus();
  await page.keyboard.press("ArrowRight");
  await quiet(page);
  expect((await value(page, key)) === before + 1, `${key} goes from ${before} to ${await value(page, key)}`);
});

// ---- Fields, and undoing

// A refused value was blamed on a line of the text, and could not be undone by the mouse.
await test("a refused value is marked at its field, blamed on no line, and undone by the mouse", async open => {
  const {page} = await open(),
    field = row(page, "belt.stiffness.1").locator("input[type=text]");
  await field.fill("-1");
  await field.press("Enter");
  await quiet(page);
  const told = await page.locator(".problem").innerText();
  expect(
    told.startsWith("Belt, stiffness of span 2, cart to idler: -1 N/m has to be above zero") && !/[Ll]ine/.test(told),
    told,
  );
  expect((await page.locator("#said").innerText()) === told, "it is not told to those who do not see it");
  const marked = await page.locator("[aria-invalid]:not(#text)").evaluateAll(all => all.map(one => one.id));
  expect(marked.join() === "p-belt-stiffness-1", `marked are ${marked}`);
  await page.locator("#find").fill("mass");
  await page.click("#tab-case");
  expect(!(await page.locator(".line-mark").isVisible()), "a line of the text is marked");
  await page.click(".problem");
  expect(
    (await page.evaluate(() => document.activeElement.id)) === "p-belt-stiffness-1",
    "the message does not lead to the field",
  );
  await page.click("#undo");
  await quiet(page);
  expect(
    (await field.inputValue()) === "132760" && !(await page.locator(".problem").isVisible()),
    `after undo the field has ${await field.inputValue()}`,
  );
  expect(await page.locator("#undo").isDisabled(), "there is more to undo");
});

await test("a field accepts a unit, a comma, and nothing that is no number", async open => {
  const {page} = await open(),
    field = row(page, "cart.mass").locator("input[type=text]");
  for (const [typed, mass, text] of [
    ["400 g", 0.4, '"400 g"'],
    ["0,5 kg", 0.5, '"0.5 kg"'],
    ["0,6", 0.6, '"0.6 kg"'],
    ["7e2 g", 0.7, '"7e2 g"'],
  ]) {
    await field.fill(typed);
    await field.press("Enter");
    await quiet(page);
    expect((await value(page, "cart.mass")) === mass, `${typed} is ${await value(page, "cart.mass")} kg`);
    expect((await page.evaluate(() => window.studio.text)).includes(text), `${text} is not in the text`);
    expect((await field.inputValue()) === String(mass), `the field shows ${await field.inputValue()}`);
  }
  await field.fill("3 mm");
  await field.press("Enter");
  await quiet(page);
  expect(
    /"3 mm" is a length/.test(await page.locator(".problem").innerText()),
    await page.locator(".problem").innerText(),
  );
  await field.fill("");
  await field.press("Enter");
  await quiet(page);
  expect(
    !(await page.locator(".problem").isVisible()) && (await field.inputValue()) === "0.7",
    `an emptied field shows ${await field.inputValue()}`,
  );
});

await test("Ctrl-Z in a box undoes what is typed there, and otherwise the last change of the case", async open => {
  const {page} = await open(),
    field = row(page, "cart.mass").locator("input[type=text]");
  await field.fill("0.5");
  await field.press("Enter");
  await quiet(page);
  await page.locator("#find").pressSequentially("belt");
  await page.keyboard.press("Control+z");
  await quiet(page);
  expect(
    (await page.locator("#find").inputValue()) !== "belt" && (await value(page, "cart.mass")) === 0.5,
    "the search box undoes the case",
  );
  await page.locator("#find").fill("");
  await field.focus();
  await page.keyboard.type("7");
  await page.keyboard.press("Control+z");
  await quiet(page);
  expect(
    (await field.inputValue()) === "0.5" && (await value(page, "cart.mass")) === 0.5,
    `in the field it leaves ${await field.inputValue()}`,
  );
  await page.click("#tab-results");
  await page.keyboard.press("Control+z");
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.362, "elsewhere it does not undo the case");
});

await test("a key that is held is one step to undo", async open => {
  const {page} = await open();
  await slider(page, "cart.mass").focus();
  for (let k = 0; k < 12; k++) {
    await page.keyboard.down("ArrowRight");
    if (k % 4 === 0) await quiet(page);
  }
  await page.keyboard.up("ArrowRight");
  await quiet(page);
  expect((await value(page, "cart.mass")) > 0.38, `twelve steps give ${await value(page, "cart.mass")}`);
  await page.click("#undo");
  await quiet(page);
  expect(
    (await value(page, "cart.mass")) === 0.362 && (await page.locator("#undo").isDisabled()),
    `one undo gives ${await value(page, "cart.mass")}`,
  );
});

// Legends out of sight kept the values of an earlier run.
await test("legends out of sight have the values of the run", async open => {
  const {page} = await open(),
    last = page.locator(".live-plot").last();
  const values = () =>
    page.evaluate(() =>
      [...document.querySelectorAll("[data-panel=friction] .value")].map(one => one.textContent).join(),
    );
  await page.evaluate(() => {
    scrollTo(0, 0);
    window.studio.seek(0.1);
  });
  expect(!(await last.evaluate(plot => plot.getBoundingClientRect().top < innerHeight)), "the last plot is in sight");
  await page.waitForTimeout(500);
  const before = await values();
  await page.evaluate(() => {
    window.studio.drag("cart.friction.viscous", 40);
    window.studio.drop();
  });
  await quiet(page);
  await page.waitForFunction(
    before =>
      [...document.querySelectorAll("[data-panel=friction] .value")].map(one => one.textContent).join() !== before,
    before,
    {timeout: 5000},
  );
});

// ---- A narrow screen

// At 390 pixels the parameters stood below all plots: what was moved and what moved were never on the screen together.
for (const [width, height, stage] of [
  [390, 844, TABLE4],
  [320, 700, PRINTER],
  [390, 844, "stages/h-frame/h-frame.toml"],
]) {
  await test(`drawing, plot and slider under the finger are on ${width} pixels together, ${stage}`, async open => {
    const {page} = await open(common.address, {viewport: {width, height}, hasTouch: true});
    await page.evaluate(text => window.studio.open(text, {name: "test.toml"}), readFileSync(stage, "utf8"));
    await quiet(page);
    await page
      .locator("[data-panel=position]")
      .evaluate(plot => plot.scrollIntoView({block: "start", behavior: "instant"}));
    const input = slider(page, "cart.mass"),
      top = async () => (await input.boundingBox()).y;
    await input.evaluate(input => {
      const panel = input.closest(".side-panel");
      panel.scrollTop += input.getBoundingClientRect().top - panel.getBoundingClientRect().bottom + 80;
    });
    await settled(page);
    const before = await top(),
      {x, y} = await thumb(input);
    await page.touchscreen.tap(x + 40, y);
    await quiet(page);
    expect(
      (await value(page, "cart.mass")) > 0.1 && Math.abs((await top()) - before) < 1.5,
      `the slider went from ${before} to ${await top()}`,
    );
    for (const selector of [
      ".stage-box svg",
      "[data-panel=position] .area",
      '[data-key="cart.mass"] input[type=range]',
    ])
      expect(
        (await seen(page, selector)) >= (selector.includes("area") ? 2 : 3),
        `${selector} is seen at ${await seen(page, selector)} of 3 places`,
      );
    expect(
      (await page.locator("[data-again]").evaluateAll(all => all.map(one => one.getAttribute("data-again")).join()))
        === "cart.mass",
      "what was moved is not first",
    );
    await page.locator("#side-parameters").evaluate(panel => {
      panel.scrollTop = 0;
    });
    expect(await page.locator("[data-again] input[type=range]").isVisible(), "what was moved is not to be seen");
    expect(
      (await page.locator(".recent").innerText()).includes("Cart, mass"),
      await page.locator(".recent").innerText(),
    );
    await page.locator(".sheet").click();
    expect(!(await page.locator("#side-parameters").isVisible()), "the sheet stays up");
    await page.click("#tab-results");
    expect(await page.locator("#side-results").isVisible(), "a tab does not bring the sheet back");
  });
}

// ---- Work that is saved nowhere

/** Changes the mass and leaves the case in one of the ways there are. */
const LEAVES = {
  "a gallery machine": async page => {
    await page.click("#go-gallery");
    await page.locator(".gallery button", {hasText: "core-xy/core-xy.toml"}).click();
  },
  "a tour stop": async page => {
    await page.click("#go-tour");
    await page.click("#tour-show");
  },
  "a file": async page => {
    await page.setInputFiles("#file", PRINTER);
  },
  "a link": async page => {
    await page.evaluate(async () => {
      const {fragment} = await import("/link.js");
      location.hash = await fragment({
        ...window.studio.snapshot(),
        text: window.studio.original.replace("0.362 kg", "3 kg"),
      });
    });
  },
};
const listed = page => page.locator("#left button").allTextContents();

for (const [name, leave] of Object.entries(LEAVES)) {
  await test(`${name} keeps the unsaved case, which the menu leads back to`, async open => {
    const {page} = await open();
    await page.evaluate(() => {
      window.studio.drag("cart.mass", 0.5);
      window.studio.drop();
    });
    await quiet(page);
    const text = await page.evaluate(() => window.studio.text);
    await leave(page);
    await page.waitForFunction(text => window.studio.original !== text && window.studio.text !== text, text);
    await page.waitForFunction(() => !document.querySelector("#left").hidden);
    expect(
      /Your changes to table4.toml are kept/.test(await page.locator("#notice").innerText()),
      await page.locator("#notice").innerText(),
    );
    const before = await listed(page);
    expect(before.length === 1 && /^table4.toml, changed, left at \d\d:\d\d$/.test(before[0]), before.join());
    await page.click("#menu summary");
    await page.click("#left button");
    await quiet(page);
    expect((await page.evaluate(() => window.studio.text)) === text, "the text that comes back is another");
    await page.click("#undo");
    await quiet(page);
    expect((await value(page, "cart.mass")) === 0.362, "its changes cannot be undone");
  });
}

await test("a reload keeps the unsaved case, what was left for it, and refused changes", async open => {
  const {page} = await open();
  await page.evaluate(() => {
    window.studio.drag("cart.mass", 0.5);
    window.studio.drop();
  });
  await quiet(page);
  await LEAVES["a file"](page);
  await page.waitForFunction(() => window.studio.run && window.studio.name === "printer-axis.toml");
  await page.click("#tab-case");
  await page.locator("#text").fill("title = broken");
  await quiet(page);
  await page.reload();
  await page.waitForFunction(() => window.studio && window.studio.mistake);
  expect((await page.evaluate(() => window.studio.text)) === "title = broken", "the text is not what was typed");
  await page.click("#menu summary");
  expect(
    (await listed(page)).some(one => one.startsWith("table4.toml, changed")),
    (await listed(page)).join(),
  );
  await page.locator("#left button", {hasText: "changed"}).click();
  await quiet(page);
  expect((await value(page, "cart.mass")) === 0.5, "the case that was left before is lost");
});

await test("a page with unsaved work asks before it is closed, another does not", async open => {
  for (const [change, isAsked] of [
    ["studio.go", false],
    ["drag", true],
    ["reset", false],
  ]) {
    const {page} = await open();
    // Browsers ask only whoever has used the page.
    await page.click("#go-motion");
    if (change !== "studio.go")
      await page.evaluate(() => {
        window.studio.drag("cart.mass", 0.5);
        window.studio.drop();
      });
    await quiet(page);
    if (change === "reset") {
      await page.click("#reset");
      await quiet(page);
    }
    let asked = "";
    page.on("dialog", dialog => {
      asked = dialog.type();
      dialog.accept();
    });
    await page.close({runBeforeUnload: true});
    await page.waitForEvent("close", {timeout: 5000}).catch(() => {});
    expect((asked === "beforeunload") === isAsked, `after ${change} it is asked "${asked}"`);
  }
});

await test("a look through gallery and tour leaves nothing behind but the case of the command line", async open => {
  const {page} = await open();
  for (const name of ["a gallery machine", "a tour stop"]) {
    await LEAVES[name](page);
    await quiet(page);
  }
  await page.click("#go-tour");
  await page.click("#tour-next");
  await page.locator(".tries button").last().click();
  await quiet(page);
  await LEAVES["a gallery machine"](page);
  await page.waitForFunction(() => window.studio.run && window.studio.name === "core-xy.toml");
  await quiet(page);
  const left = await listed(page);
  expect(left.length === 1 && /^table4.toml, left at/.test(left[0]), left.join());
});

await harness.end("edits in the studio");
