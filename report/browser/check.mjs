// Opens reports in a browser and uses them as their reader would; cargo xtask browser makes the reports and runs this.
//
//   node check.mjs BROWSER REPORTS SHOTS
//
// REPORTS holds a folder for each report, with report.html in it; pictures of all pages go to SHOTS.
import {mkdirSync, readFileSync, readdirSync} from "node:fs";
import {createRequire} from "node:module";
import {join, resolve} from "node:path";
import {pathToFileURL} from "node:url";
import {chromium} from "playwright-core";

const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const [program, reports, shots] = process.argv.slice(2);
mkdirSync(shots, {recursive: true});
const names = readdirSync(reports, {withFileTypes: true})
  .filter(entry => entry.isDirectory())
  .map(entry => entry.name)
  .sort();
const address = name => pathToFileURL(resolve(join(reports, name, "report.html"))).href;

let passed = 0,
  failed = 0;
async function test(name, work) {
  try {
    await work();
    passed++;
  } catch (error) {
    failed++;
    console.log(
      `${name} ... FAILED\n  ${String(error.message || error)
        .split("\n")
        .join("\n  ")}`,
    );
  }
}
function expect(holds, told) {
  if (!holds) throw new Error(told);
}

// Root may not use Chromium's sandbox.
const asRoot = process.getuid && process.getuid() === 0;
const browser = await chromium.launch({executablePath: program, args: asRoot ? ["--no-sandbox"] : []});

// A page with a report on it, and what went wrong on it.
async function open(name, options) {
  const context = await browser.newContext({viewport: {width: 1200, height: 900}, colorScheme: "light", ...options});
  const page = await context.newPage(),
    trouble = [];
  page.on("console", message => {
    if (message.type() === "error") trouble.push("console: " + message.text());
  });
  page.on("pageerror", error => trouble.push("error: " + error.message));
  page.on("request", request => {
    if (!/^(file|data|blob):/.test(request.url())) trouble.push("asked for " + request.url());
  });
  await page.goto(address(name));
  // Folded sections are checked like the others.
  await page.evaluate(() =>
    document.querySelectorAll("details.section").forEach(section => {
      section.open = true;
    }),
  );
  return {page, trouble, done: () => context.close()};
}

// ---- Every report, narrow and wide, light and dark

// Texts of plots that are not wholly inside them.
const cutTexts = page =>
  page.evaluate(() =>
    [...document.querySelectorAll(".stage>svg")].flatMap(svg => {
      const frame = svg.getBoundingClientRect();
      return [...svg.querySelectorAll("text")]
        .filter(text => {
          const box = text.getBoundingClientRect();
          return (
            box.width && (box.left < frame.left - 1 || box.right > frame.right + 1 || box.bottom > frame.bottom + 1)
          );
        })
        .map(text => text.textContent);
    }),
  );

// The height of a picture in pixels: browsers fail on pictures of pages that are much taller.
const TALL = 8000;

// Pictures of the whole page, top to bottom; those after the first end in their number.
async function pictures(page, width, name) {
  const height = await page.evaluate(() => document.documentElement.scrollHeight);
  for (let k = 0; k * TALL < height; k++) {
    const clip = {x: 0, y: k * TALL, width, height: Math.min(TALL, height - k * TALL)};
    await page.screenshot({path: join(shots, `${name}${k ? `-${k + 1}` : ""}.png`), fullPage: true, clip});
  }
}

async function looks(name, width, colorScheme) {
  const {page, trouble, done} = await open(name, {viewport: {width, height: 900}, colorScheme});
  try {
    const {scroll, wide} = await page.evaluate(() => {
      const {scrollWidth: scroll, clientWidth: wide} = document.documentElement;
      return {scroll, wide};
    });
    await pictures(page, width, `${name}-${width}-${colorScheme}`);
    expect(!trouble.length, trouble.join("; "));
    expect(scroll <= wide, `scrolls sideways: ${scroll} pixels on ${wide}`);
    const cut = await cutTexts(page);
    expect(!cut.length, `texts stand out of their plots: ${cut.join(" | ")}`);
    const plots = await page.evaluate(() => [
      document.querySelectorAll("figure.plot").length,
      document.querySelectorAll("figure.live").length,
    ]);
    const captions = await page.evaluate(
      () => [...document.querySelectorAll(".caption")].filter(p => p.scrollWidth > p.clientWidth + 1).length,
    );
    expect(!captions, `${captions} captions of tables are cut`);
    expect(plots[0] === plots[1], `${plots[1]} of ${plots[0]} plots came to life`);
  } finally {
    await done();
  }
}

// ---- What a reader does with a plot

// Content of plot number i: texts of ticks, and the range of x.
const state = (page, i) =>
  page.evaluate(i => {
    const {plot} = document.querySelectorAll("figure.plot")[i];
    return {
      ticks: plot.shown.xTicks.map(tick => tick[1]).join(" "),
      range: plot.view.x.join(" "),
      picture: plot.svg.innerHTML,
    };
  }, i);

// The plot area of a panel, in pixels of the window, after it was scrolled there.
async function area(page, i, panel = 0) {
  await page.evaluate(
    i =>
      document
        .querySelectorAll("figure.plot")
        [i].querySelector(".stage")
        .scrollIntoView({block: "center", behavior: "instant"}),
    i,
  );
  await settled(page);
  return page.evaluate(
    ([i, panel]) => {
      const {plot} = document.querySelectorAll("figure.plot")[i],
        L = plot.shown,
        P = L.panels[panel];
      const box = plot.svg.getBoundingClientRect(),
        k = box.width / L.width;
      return {left: box.left + k * L.left, top: box.top + k * P.top, width: k * L.wide, height: k * P.height};
    },
    [i, panel],
  );
}
const settled = page =>
  page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));

async function drag(page, i, from, to) {
  const a = await area(page, i);
  await page.mouse.move(a.left + from[0] * a.width, a.top + from[1] * a.height);
  await page.mouse.down();
  await page.mouse.move(a.left + to[0] * a.width, a.top + to[1] * a.height, {steps: 4});
  await page.mouse.up();
  await settled(page);
}

const interactions = {
  async "the script's ticks are those of the picture"(page) {
    const wrong = await page.evaluate(() =>
      [...document.querySelectorAll("figure.plot")].flatMap(({plot}) => {
        const texts = layout =>
          [layout.xTicks, ...layout.panels.map(P => P.yTicks)].map(ticks => ticks.map(tick => tick[1]).join(" "));
        const placed = texts(plot.layout()),
          {x, y} = plot.view;
        // Another range with the same ends is none that was placed before.
        plot.view = {x: x.slice(), y: y.map(range => range.slice())};
        const own = texts(plot.layout());
        plot.view = {x, y};
        return placed.flatMap((text, i) =>
          text === own[i] ? [] : [`${plot.figure.innerText.split("\n")[0]}: ${text} | ${own[i]}`],
        );
      }),
    );
    expect(!wrong.length, wrong.join("\n"));
  },

  async "a drag zooms, linked plots follow, reset brings back"(page, count) {
    const axes = await page.evaluate(() =>
      [...document.querySelectorAll("figure.plot")].map(figure => figure.dataset.axis || null),
    );
    for (const i of new Set([0, count - 1])) {
      const before = await Promise.all([...Array(count).keys()].map(k => state(page, k)));
      await drag(page, i, [0.3, 0.5], [0.6, 0.52]);
      const after = await Promise.all([...Array(count).keys()].map(k => state(page, k)));
      expect(after[i].ticks !== before[i].ticks, `ticks of plot ${i} stay ${after[i].ticks}`);
      axes.forEach((axis, k) => {
        const linked = k === i || (axis !== null && axis === axes[i]);
        expect(
          (after[k].range !== before[k].range) === linked,
          `plot ${k} ${linked ? "does not follow" : "follows"} plot ${i}`,
        );
        if (linked)
          expect(after[k].range === after[i].range, `plot ${k} shows ${after[k].range}, plot ${i} ${after[i].range}`);
      });
      await page.locator("figure.plot").nth(i).locator(".figtitle button").click();
      await settled(page);
      await page.mouse.move(2, 2);
      await settled(page);
      for (let k = 0; k < count; k++) {
        await area(page, k);
        const again = await state(page, k);
        expect(again.picture === before[k].picture, `plot ${k} is not as it was`);
      }
    }
  },

  async "a mouse shows values below the legend"(page) {
    const a = await area(page, 0);
    await page.mouse.move(a.left + 0.5 * a.width, a.top + 0.1 * a.height);
    await settled(page);
    const {on, text, over} = await page.evaluate(() => {
      const {plot} = document.querySelector("figure.plot"),
        tip = plot.tip.getBoundingClientRect();
      const legend = [...plot.svg.querySelectorAll('[data-curve^="0."]')].map(entry => entry.getBoundingClientRect());
      return {
        on: plot.tip.classList.contains("on"),
        text: plot.tip.innerText,
        over: legend.some(entry => entry.bottom > tip.top + 1),
      };
    });
    expect(on && /\d/.test(text), `the tip says ${text}`);
    expect(!over, "the tip lies over the legend");
    await page.mouse.move(2, 2);
  },

  async "keys show values, zoom and go back"(page) {
    const tip = page.locator("figure.plot .tip").first(),
      before = await state(page, 0);
    await page.locator("figure.plot .stage").first().focus();
    for (let k = 0; k < 3; k++) await page.keyboard.press("ArrowRight");
    await settled(page);
    const first = await tip.innerText();
    for (let k = 0; k < 20; k++) await page.keyboard.press("ArrowLeft");
    await settled(page);
    expect(await page.evaluate(() => document.querySelector("figure.plot").plot.cursor !== null), "no cursor");
    expect(first !== (await tip.innerText()) || !first, `the values stay ${first}`);
    await page.keyboard.press("Escape");
    await page.keyboard.press("+");
    await settled(page);
    const zoomed = await state(page, 0);
    expect(zoomed.range !== before.range, "+ does not zoom");
    await page.keyboard.press("Shift+ArrowRight");
    await settled(page);
    expect((await state(page, 0)).range !== zoomed.range, "arrows with shift do not slide");
    await page.keyboard.press("0");
    await settled(page);
    expect((await state(page, 0)).picture === before.picture, "0 does not bring back");
  },

  async "the legend hides and shows curves"(page) {
    const entry = page.locator("figure.plot [data-curve]").first();
    if (!(await entry.count())) return;
    const curves = () =>
      page.evaluate(() => {
        const svg = document.querySelector("figure.plot [data-curve]").closest(".stage>svg");
        return svg.querySelectorAll("svg>path").length;
      });
    const before = await curves();
    await entry.click();
    await settled(page);
    expect(
      (await entry.getAttribute("aria-checked")) === "false" && (await curves()) === before - 1,
      "a click hides nothing",
    );
    await entry.focus();
    await page.keyboard.press("Enter");
    await settled(page);
    expect((await entry.getAttribute("aria-checked")) === "true" && (await curves()) === before, "Enter shows nothing");
    expect(await page.evaluate(() => document.activeElement.matches("[data-curve]")), "the focus is lost");
  },
};

async function taps(name) {
  const {page, trouble, done} = await open(name, {viewport: {width: 400, height: 800}, hasTouch: true, isMobile: true});
  try {
    const a = await area(page, 0),
      tip = page.locator("figure.plot .tip").first();
    const isOn = () => tip.evaluate(element => element.classList.contains("on"));
    // Of curves in a plane one has to be hit.
    const {x, y} = await page.evaluate(() => {
      const {plot} = document.querySelector("figure.plot"),
        box = plot.svg.getBoundingClientRect(),
        L = plot.shown,
        P = L.panels[0];
      const series = P.panel.series[0],
        xs = plot.arrays[series.x],
        ys = plot.arrays[series.y];
      let i = xs.length >> 1;
      while (i < xs.length - 1 && !isFinite(ys[i])) i++;
      // A tap near a name in the legend is one on the name.
      const y = plot.rising[series.x] ? P.top + P.height / 2 : P.axes.up(ys[i]);
      return {x: box.left + (plot.across(xs[i]) * box.width) / L.width, y: box.top + (y * box.width) / L.width};
    });
    const inside = (v, from, length) => Math.max(from + 3, Math.min(from + length - 3, v));
    await page.touchscreen.tap(inside(x, a.left, a.width), inside(y, a.top, a.height));
    await page.waitForTimeout(400);
    expect(await isOn(), `a tap at ${x}, ${y} of ${JSON.stringify(a)} shows nothing`);
    const box = await tip.boundingBox();
    expect(box.x >= -1 && box.x + box.width <= 401, `the values stand from ${box.x} to ${box.x + box.width}`);
    await page.screenshot({path: join(shots, `${name}-tap.png`)});
    await page.touchscreen.tap(5, 5);
    await page.waitForTimeout(100);
    expect(!(await isOn()), "a tap elsewhere leaves the values");
    expect(!trouble.length, trouble.join("; "));
  } finally {
    await done();
  }
}

// Curves of the second plot whose samples are drawn, and what it says of its limit.
const farIn = page =>
  page.evaluate(() => {
    const {plot} = document.querySelectorAll("figure.plot")[1];
    const series = plot.svg.querySelectorAll('svg>path[class^="f-"]:not(.f-ink)');
    const curves = [...series].filter(path => !path.closest("g"));
    return {dots: curves.length, limit: plot.limit.textContent};
  });

/** Machines of a report: each is drawn at its start, and moves by its slider and while it is played. */
async function moves(page, count, before, after) {
  const machines = page.locator("figure.machine");
  expect((await machines.count()) === count, `${await machines.count()} machines`);
  for (let k = 0; k < count; k++) {
    const machine = machines.nth(k),
      told = () => machine.locator("svg").getAttribute("aria-label"),
      clock = async () => parseFloat(await machine.locator(".clock").innerText());
    await machine.scrollIntoViewIfNeeded();
    expect(before.test(await told()) && !/undefined/.test(await told()), `at first ${await told()}`);
    await machine.locator(".play").click();
    await page.waitForFunction(
      k => parseFloat(document.querySelectorAll("figure.machine .clock")[k].textContent) > 0,
      k,
    );
    await machine.locator(".play").click();
    expect((await machine.locator(".play").getAttribute("aria-label")) === "Play", "it does not pause");
    const paused = await clock();
    await settled(page);
    expect((await clock()) === paused, "it goes on");
    await machine.locator(".scrub").focus();
    await page.keyboard.press("End");
    await settled(page);
    expect(after.test(await told()) && !/undefined/.test(await told()), `at the end ${await told()}`);
    await page.keyboard.press("Home");
    await settled(page);
    expect(before.test(await told()), `back at the start ${await told()}`);
  }
  await page.evaluate(readFileSync(axe, "utf8"));
  const {violations} = await page.evaluate(() => window.axe.run("figure.machine", {resultTypes: ["violations"]}));
  expect(!violations.length, violations.map(one => `${one.id}: ${one.nodes[0].html}`).join("\n"));
}

// ---- What single reports have to show

const particular = {
  async tune(page) {
    const nyquist = await page.evaluate(() => {
      const {plot} = [...document.querySelectorAll("figure.plot")].find(figure => /Nyquist/.test(figure.innerText));
      const L = plot.shown,
        P = L.panels[0],
        [low, high] = [L.x.low, L.x.high];
      return {
        right: L.wide / (high - low),
        up: P.height / (P.y.high - P.y.low),
        sees: low < -1 && high > 0,
        named: P.panel.series.some(series => series.name === "\u22121"),
      };
    });
    expect(Math.abs(nyquist.right / nyquist.up - 1) < 0.01, `a unit is ${nyquist.right} wide and ${nyquist.up} high`);
    expect(nyquist.sees && nyquist.named, "the point -1 is not shown");
    const places = await page.evaluate(() => {
      const {plot} = [...document.querySelectorAll("figure.plot")].find(figure =>
        /^Sensitivity/.test(figure.innerText),
      );
      const P = plot.shown.panels[0];
      return P.panel.series.map(series => {
        const x = plot.arrays[series.x],
          y = plot.arrays[series.y];
        return plot.shown.x.place(x[y.indexOf(Math.max(...y))]);
      });
    });
    expect(
      places.every(place => place > 0.1 && place < 1),
      `peaks of |S| stand at ${places} of the width`,
    );
  },

  async modes(page) {
    const styles = await page.evaluate(() => {
      const {plot} = [...document.querySelectorAll("figure.plot")].find(figure =>
        /Poles and zeros/.test(figure.innerText),
      );
      return plot.spec.panels[0].series.map(series => [series.name.split(" ")[0], series.style].join(" "));
    });
    expect(styles.includes("poles crosses") && styles.includes("zeros rings"), styles.join(", "));
    const phases = await page.evaluate(() =>
      [...document.querySelectorAll("figure.plot")].flatMap(({plot}) =>
        plot.shown.panels.filter(P => P.panel.unit === "\u00b0").flatMap(P => P.yTicks.map(tick => tick[0])),
      ),
    );
    expect(phases.length && phases.every(phase => phase % 15 === 0), `phases at ${phases}`);
  },

  async simulate(page) {
    const marks = await page.evaluate(() =>
      [...document.querySelectorAll("figure.plot")].flatMap(({plot}) =>
        plot.spec.panels.flatMap(panel => panel.series.map(series => series.name + " " + series.style)),
      ),
    );
    expect(marks.includes("sticks points") && marks.includes("slips rings"), marks.join(", "));
    // Far in, samples are dots.
    for (let k = 0; k < 4; k++) await drag(page, 1, [0.3, 0.5], [0.35, 0.5]);
    const {dots, limit} = await farIn(page);
    expect(dots > 0, "no sample is drawn as a dot");
    expect(!limit, `all rows are there, and the page says: ${limit}`);
  },

  live: page => moves(page, 2, /cart at 0 mm/, /cart at [1-9][\d.]* mm/),
  "live-gantry": page => moves(page, 3, /bridge at 0 mm.*cart at 0 mm/, /at (\u2212|[1-9])[\d.]* mm/),

  async long(page) {
    for (let k = 0; k < 4; k++) await drag(page, 1, [0.3, 0.5], [0.35, 0.5]);
    const {dots, limit} = await farIn(page);
    expect(dots > 0 && /not all rows/.test(limit), `${dots} curves with dots, and the page says: ${limit}`);
  },
};

for (const name of names) {
  for (const width of [1200, 400]) {
    for (const theme of ["light", "dark"])
      await test(`${name} at ${width} pixels, ${theme}`, () => looks(name, width, theme));
  }
  const {page, trouble, done} = await open(name, {});
  const count = await page.locator("figure.plot").count();
  if (count) {
    for (const [what, work] of Object.entries(interactions)) await test(`${name}: ${what}`, () => work(page, count));
    await test(`${name}: a tap shows values`, () => taps(name));
  }
  if (particular[name]) await test(`${name}: what it has to show`, () => particular[name](page));
  await test(`${name}: no trouble`, () => expect(!trouble.length, trouble.join("; ")));
  await done();
}
await browser.close();
console.log(`test result: ${failed ? "FAILED" : "ok"}. ${passed} passed; ${failed} failed; reports in a browser`);
process.exit(failed ? 1 : 0);
