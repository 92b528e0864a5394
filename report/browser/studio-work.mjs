// Fits a log, tunes, shapes and sweeps in the studio as a person would; cargo xtask browser runs this.
//
//   node studio-work.mjs BROWSER TAUT SHOTS
//
// TAUT is the program; it is run in the folder of the project. Pictures go to SHOTS. A log of another's machine is in
// data/, or in the folder that TAUT_DATA names; where it is not, one that the program simulated takes its place.
import {execFileSync} from "node:child_process";
import {existsSync, mkdirSync, readFileSync, writeFileSync, mkdtempSync} from "node:fs";
import {createRequire} from "node:module";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {Harness, expect, quiet, settled} from "./harness.mjs";

const [program, taut, shots, only] = process.argv.slice(2);
mkdirSync(shots, {recursive: true});
const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const PENDULEPI = "stages/pendulepi/pendulepi.toml",
  PID = "stages/sollmann-jouaneh/controllers/pid.toml",
  TABLE4 = "stages/sollmann-jouaneh/table4.toml";
const LOG = [process.env.TAUT_DATA, "data"]
  .filter(Boolean)
  .map(folder => join(folder, "pendulepi/february.csv"))
  .find(existsSync);
const left = [];
const harness = new Harness(program, taut);
await harness.start();
const common = await harness.serve([PENDULEPI]);
const test = (name, work) => (!only || name.includes(only) ? harness.test(name, work) : null);
const go = async (page, view) => {
  await page.click(`#go-${view}`);
  await settled(page);
};
const shot = (page, name, fullPage = true) => page.screenshot({path: join(shots, `studio-${name}.png`), fullPage});

/** Some levels of the log: enough to fit, and quick. */
function levels(wanted) {
  const [head, ...rows] = readFileSync(LOG, "utf8").trim().split("\n"),
    folder = mkdtempSync(join(tmpdir(), "taut-studio-test-")),
    path = join(folder, "february.csv");
  writeFileSync(path, [head, ...rows.filter(row => wanted.includes(Number(row.split(",")[0])))].join("\n") + "\n");
  return path;
}

if (!LOG) left.push("a PendulePi log is dropped and fitted: needs data/pendulepi/february.csv (cargo xtask data)");

if (LOG)
  await test("a PendulePi log is dropped, mapped, checked, fitted and kept", async open => {
    const {page} = await open(common.address);
    await go(page, "fit");
    await page.setInputFiles("#log-file", levels([100, -100, 200, -200]));
    await page.waitForSelector(".log-file");
    const chosen = await page.locator(".log-file .mapping").first().locator("tr").allInnerTexts();
    const mapped = await page.evaluate(() =>
      [...document.querySelectorAll(".log-file select")]
        .map(select => [select.getAttribute("aria-label"), select.options[select.selectedIndex].text])
        .filter(([, text]) => text !== "–" && text !== "any"),
    );
    const wanted = [
      ["Time: column", "time_us"],
      ["Input of the amplifier: column", "pwm"],
      ["cart position: column", "position"],
      ["Tells runs apart: column", "pwm"],
    ];
    for (const pair of wanted)
      expect(
        mapped.some(one => one.join() === pair.join()),
        `${pair}: ${JSON.stringify(mapped)}; ${chosen}`,
      );
    expect((await page.locator("[aria-label='time: unit']").inputValue()) === "us", "the clock's unit is not guessed");
    await page.locator("input[value='amplifier.gain']").check();
    await shot(page, "fit-mapped");
    await page.click("#check");
    await page.waitForSelector("#view-fit .report[data-of=check] h2", {timeout: 120_000});
    expect(
      /determined/.test(await page.locator("#view-fit .report").innerText()),
      "the check says nothing of what is determined",
    );
    // Each step that the page is told of; those that come within one picture count too.
    await page.evaluate(() => {
      const {wire} = window.studio,
        take = wire.take.bind(wire);
      window.steps = [];
      wire.take = answer => {
        if (answer.head.progress && answer.head.progress.step) window.steps.push(answer.head.progress.step);
        take(answer);
      };
    });
    await page.click("#fit");
    await page.waitForSelector("[data-picture='february/100'] canvas", {timeout: 60_000});
    await shot(page, "fit-live");
    await page.waitForSelector("#fit-keep", {timeout: 120_000});
    const seen = await page.evaluate(() => window.steps);
    expect(
      seen.length >= 2 && seen.every((step, k) => !k || step > seen[k - 1]),
      `${JSON.stringify(seen)}: steps of progress`,
    );
    await shot(page, "fit-done");
    const table = await page.locator("#fit-done table").first().innerText();
    expect(/amplifier.gain/.test(table) && /cart.friction.viscous/.test(table), table);
    expect((await page.locator(".correlation rect").count()) >= 9, "no correlations are drawn");
    const before = await page.evaluate(() => window.studio.text);
    await page.click("#fit-keep");
    await quiet(page);
    const {text, mistake} = await page.evaluate(() => ({text: window.studio.text, mistake: window.studio.mistake}));
    expect(
      !mistake && text !== before && text.includes("[uncertainty]") && !text.includes("february"),
      `${JSON.stringify(mistake)} ${text.slice(-600)}`,
    );
    // What these logs tell is friction per input, and the authors' is that of their 12 V of 255 counts; the gain by
    // itself hangs on the delay.
    const interval = key =>
      (new RegExp(`"${key}" = \\{[^}]*low = ([\\d.e-]+), high = ([\\d.e-]+)`).exec(text) || []).slice(1).map(Number);
    const [gain, viscous] = ["amplifier.gain", "cart.friction.viscous"].map(interval);
    const ratio = (viscous[0] + viscous[1]) / (gain[0] + gain[1]),
      theirs = 12.3413 / (12 / 255);
    expect(
      gain[0] > 0 && gain[1] > gain[0] && Math.abs(ratio / theirs - 1) < 0.02,
      `viscous friction ${viscous} over gain ${gain}: ${ratio}, the authors' ${theirs}`,
    );
    await page.keyboard.press("Control+z");
    await quiet(page);
    expect((await page.evaluate(() => window.studio.text)) === before, "Ctrl-Z does not take the estimates back");
  });

if (LOG)
  await test("a fit is stopped, and keeps the best", async open => {
    const {page} = await open(common.address);
    await go(page, "fit");
    await page.setInputFiles("#log-file", LOG);
    await page.waitForSelector(".log-file");
    for (const key of ["amplifier.gain", "cart.mass", "motor.back_emf_constant"])
      await page.locator(`#view-fit .choices input[value='${key}']`).check();
    await page.locator("#starts").fill("50");
    await page.click("#fit");
    await page.waitForFunction(
      () => /^Step [2-9]|^Step \d\d/.test(document.querySelector("#fit-status").textContent),
      null,
      {timeout: 60_000},
    );
    const begun = Date.now();
    await page.click("#fit-stop");
    await page.waitForSelector("#fit-keep", {timeout: 30_000});
    const told = await page.locator("#fit-status").innerText();
    expect(/interrupted|stopped|best so far/i.test(told), told);
    expect(Date.now() - begun < 20_000, `stopping took ${Date.now() - begun} ms`);
    expect((await page.locator("#fit-done tbody tr").count()) >= 5, "no estimates");
  });

if (LOG)
  await test("a page that is closed ends its fit", async open => {
    const {page, context} = await open(common.address);
    await go(page, "fit");
    await page.setInputFiles("#log-file", LOG);
    await page.waitForSelector(".log-file");
    await page.locator("#starts").fill("50");
    await page.click("#fit");
    await page.waitForFunction(() => /^Step/.test(document.querySelector("#fit-status").textContent), null, {
      timeout: 60_000,
    });
    await context.close();
    const ticks = () => {
      const words = readFileSync(`/proc/${common.child.pid}/stat`, "utf8").split(" ");
      return Number(words[13]) + Number(words[14]);
    };
    if (!existsSync("/proc/self/stat")) return;
    let quietFor = 0;
    for (let k = 0, last = ticks(); k < 100 && quietFor < 5; k++) {
      await new Promise(done => setTimeout(done, 200));
      const now = ticks();
      quietFor = now - last <= 1 ? quietFor + 1 : 0;
      last = now;
    }
    expect(quietFor >= 5, "the server still computes 20 s after its page has gone");
  });

/** A MATLAB file (level 5) of columns of numbers. */
function matlab(columns) {
  const padded = bytes => Buffer.concat([bytes, Buffer.alloc((8 - (bytes.length % 8)) % 8)]);
  const element = (kind, bytes) => {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(kind, 0);
    head.writeUInt32LE(bytes.length, 4);
    return padded(Buffer.concat([head, bytes]));
  };
  const whole = (...numbers) => {
    const bytes = Buffer.alloc(4 * numbers.length);
    numbers.forEach((number, k) => bytes.writeInt32LE(number, 4 * k));
    return bytes;
  };
  const head = Buffer.alloc(128, " ");
  head.write("MATLAB 5.0 MAT-file");
  head.fill(0, 116);
  head.writeUInt16LE(0x0100, 124);
  head.write("IM", 126);
  const matrices = Object.entries(columns).map(([name, values]) =>
    element(
      14,
      Buffer.concat([
        element(6, whole(6, 0)),
        element(5, whole(values.length, 1)),
        element(1, Buffer.from(name)),
        element(9, Buffer.from(new Float64Array(values).buffer)),
      ]),
    ),
  );
  return Buffer.concat([head, ...matrices]);
}

await test("Parquet and MATLAB logs are dropped, mapped, checked and fitted as CSV is", async open => {
  const {address} = await harness.serve([TABLE4]),
    folder = mkdtempSync(join(tmpdir(), "taut-studio-test-"));
  execFileSync(taut, [
    "simulate",
    TABLE4,
    "--out",
    join(folder, "parquet"),
    "--format",
    "parquet",
    "--no-report",
    "--quiet",
  ]);
  execFileSync(taut, ["simulate", TABLE4, "--out", folder, "--no-report", "--quiet"]);
  const [head, ...rows] = readFileSync(join(folder, "5-v-pulse.csv"), "utf8")
    .trim()
    .split("\n")
    .map(line => line.split(","));
  const names = ["time_s", "voltage_V", "drive_angle_rad", "cart_position_m"];
  writeFileSync(
    join(folder, "pulse.mat"),
    matlab(Object.fromEntries(names.map(name => [name, rows.map(row => Number(row[head.indexOf(name)]))]))),
  );
  const fitted = [];
  for (const file of ["parquet/5-v-pulse.parquet", "pulse.mat"]) {
    const {page} = await open(address);
    await go(page, "fit");
    await page.setInputFiles("#log-file", join(folder, file));
    await page.waitForSelector(".log-file");
    const mapped = await page.evaluate(() =>
      [...document.querySelectorAll(".log-file select")].map(select =>
        [select.getAttribute("aria-label"), select.options[select.selectedIndex].text].join(),
      ),
    );
    for (const one of [
      "Time: column,time_s",
      "drive angle: column,drive_angle_rad",
      "cart position: column,cart_position_m",
    ])
      expect(mapped.includes(one), `${file}: ${one}: ${mapped}`);
    expect(
      mapped.some(one => /^Input of the amplifier: column,(input_V|voltage_V)$/.test(one)),
      `${file}: ${mapped}`,
    );
    await page.click("#check");
    await page.waitForSelector("#view-fit .report[data-of=check] h2", {timeout: 120_000});
    await page.click("#fit");
    await page.waitForSelector("#fit-keep", {timeout: 120_000});
    fitted.push(await page.locator("#fit-done table").first().innerText());
    await shot(page, `fit-${file.split(".").pop()}`);
  }
  // The case's own numbers come out, as the logs are of its own simulation.
  for (const table of fitted) expect(/cart.friction.viscous\s+19\.0/.test(table), table);
});

await test("a file that is no log is told where it is wrong", async open => {
  const {page} = await open(common.address),
    folder = mkdtempSync(join(tmpdir(), "taut-studio-test-"));
  await go(page, "fit");
  writeFileSync(join(folder, "empty.csv"), "");
  await page.setInputFiles("#log-file", join(folder, "empty.csv"));
  await page.waitForSelector("#unread p");
  const told = await page.locator("#unread").innerText();
  expect(/^empty.csv: no line of this file has numbers/.test(told), told);
  writeFileSync(join(folder, "short.csv"), "t,u,x\n0,1,0\n0.1,1,0.001\n");
  await page.setInputFiles("#log-file", join(folder, "short.csv"));
  await page.waitForSelector(".log-file");
  await page.click("#fit");
  await page.waitForFunction(() => !document.querySelector("#fit-trouble").hidden, null, {timeout: 30_000});
});

await test("gains are dragged, and error, margins and Nyquist's curve follow", async open => {
  const {page} = await open((await harness.serve([PID])).address);
  await go(page, "tune");
  await page.waitForSelector("#margins dd");
  await quiet(page);
  const margins = () => page.locator("#margins").innerText(),
    before = await margins();
  const canvas = name =>
    page.evaluate(name => document.querySelector(`[data-picture="${name}"] canvas`).toDataURL(), name);
  const curves = await Promise.all([canvas("Nyquist's curve"), canvas("Reference minus cart")]);
  const slider = page.locator(".gains .row[data-key='controller.pid.proportional'] input[type=range]");
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let k = 1; k <= 10; k++) await page.mouse.move(box.x + box.width * (0.5 - 0.02 * k), box.y + box.height / 2);
  await page.mouse.up();
  await quiet(page);
  expect((await margins()) !== before, "the margins stay");
  const now = await Promise.all([canvas("Nyquist's curve"), canvas("Reference minus cart")]);
  expect(now[0] !== curves[0] && now[1] !== curves[1], "the curves stay");
  await page.locator("#move").selectOption("1");
  await quiet(page);
  await shot(page, "tune-loop");
});

await test("a controller is tuned, its choices shown, and kept", async open => {
  const {page} = await open((await harness.serve([PID])).address);
  await go(page, "tune");
  await page.waitForSelector("#margins dd");
  await page.locator("#spread").fill("5");
  await page.click("#tune");
  await page.waitForFunction(() => /looks at designs/.test(document.querySelector("#tune-status").textContent), null, {
    timeout: 60_000,
  });
  await page.waitForSelector("#tune-keep", {timeout: 300_000});
  expect((await page.locator("#tune-result canvas").count()) >= 1, "no picture of the choices");
  await settled(page);
  await shot(page, "tune-done");
  const before = await page.evaluate(() => window.studio.text);
  await page.click("#tune-keep");
  await quiet(page);
  const after = await page.evaluate(() => ({text: window.studio.text, mistake: window.studio.mistake}));
  expect(!after.mistake && after.text !== before, "the gains are not in the case");
});

await test("a controller and moves are put into a case without any", async open => {
  const {page} = await open((await harness.serve([TABLE4])).address);
  await go(page, "tune");
  await page.waitForFunction(
    () =>
      document.querySelector("#controller").options.length > 5 && !document.querySelector("#view-tune .mistake").hidden,
  );
  expect(
    /no move and no controller/.test(await page.locator("#view-tune .mistake").innerText()),
    await page.locator("#view-tune .mistake").innerText(),
  );
  await page.locator("#controller").selectOption("0");
  await page.waitForSelector("#margins dd");
  await quiet(page);
  expect((await page.locator("#move option").count()) === 3, "no moves");
});

await test("a spectrum is dropped, and shapers stand over it", async open => {
  const {page} = await open(common.address),
    folder = mkdtempSync(join(tmpdir(), "taut-studio-test-")),
    path = join(folder, "resonances_x.csv");
  let text = "freq,psd_x,psd_y,psd_z,psd_xyz\n";
  for (let k = 0; k <= 124; k++) {
    const hertz = 1.6 * k,
      [x, y, z] = [48, 77, 144].map((at, i) => 100 + 1e4 / (1 + i) / (1 + (0.5 * (hertz - at)) ** 2));
    text += [hertz.toFixed(1), x, y, z, x + y + z].join(",") + "\n";
  }
  writeFileSync(path, text);
  await go(page, "shape");
  await page.setInputFiles("#spectrum-file", path);
  await page.waitForSelector("#view-shape .report figure", {timeout: 60_000});
  expect(/recommended/.test(await page.locator("#view-shape .report").innerText()), "nothing is recommended");
  await page.locator("#shape-axis").selectOption("x");
  await page.waitForFunction(() =>
    /axis x|along x|\bx\b/.test(document.querySelector("#view-shape .report").innerText),
  );
  await shot(page, "shape");
});

await test("a sweep fills its figures while it runs, and what is brushed shows its trajectories", async open => {
  const {page} = await open((await harness.serve([TABLE4])).address);
  await go(page, "sweep");
  await page.locator("#runs").fill("3000");
  const counts = page.evaluate(
    () =>
      new Promise(done => {
        const seen = new Set(),
          watch = setInterval(() => {
            const told = document.querySelector("#sweep-status").textContent;
            if (/ of 3000 runs/.test(told)) seen.add(told);
            if (/^3000 runs in/.test(told)) {
              clearInterval(watch);
              done(seen.size);
            }
          }, 5);
      }),
  );
  await page.click("#sweep");
  const isDone = () => /^3000 runs in/.test(document.querySelector("#sweep-status").textContent);
  await page.waitForFunction(isDone, null, {timeout: 120_000});
  expect((await counts) >= 2, `${await counts} steps of progress were seen`);
  await quiet(page);
  const whole = await page.locator("#chosen").innerText();
  expect(/3000 runs, none chosen/.test(whole), whole);
  const area = page.locator("[data-picture=Histogram] .area");
  await area.scrollIntoViewIfNeeded();
  const box = await area.boundingBox();
  await page.mouse.move(box.x + 80, box.y + 60);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.45 * box.width, box.y + 100, {steps: 5});
  await page.mouse.up();
  await quiet(page);
  const chosen = Number(/^(\d+) of 3000/.exec(await page.locator("#chosen").innerText())[1]);
  expect(chosen > 0 && chosen < 3000, `${chosen} chosen`);
  const own = await page.evaluate(() => document.querySelectorAll("#view-sweep .card tbody tr").length);
  expect(own === Math.min(100, chosen), `${own} rows are listed`);
  await shot(page, "sweep");
  await area.click({position: {x: 200, y: 100}});
  await quiet(page);
  expect(/none chosen/.test(await page.locator("#chosen").innerText()), "a click does not clear");
  // By keys: the first ten bars.
  await area.focus();
  for (let k = 0; k < 10; k++) await page.keyboard.press("Shift+ArrowRight");
  await quiet(page);
  expect(/^\d+ of 3000 runs chosen/.test(await page.locator("#chosen").innerText()), "keys choose nothing");
});

await test("a sweep is stopped, and keeps what is done", async open => {
  const {page} = await open((await harness.serve([TABLE4])).address);
  await go(page, "sweep");
  await page.locator("#runs").fill("20000");
  await page.click("#sweep");
  await page.waitForFunction(() => / of 20000 runs/.test(document.querySelector("#sweep-status").textContent));
  await page.click("#sweep-stop");
  await page.waitForFunction(() => /stopped/.test(document.querySelector("#sweep-status").textContent), null, {
    timeout: 30_000,
  });
  expect((await page.evaluate(() => window.studio.view)) === "sweep", "");
});

await test("of a sweep whose case is left nothing arrives, and the next one starts at once", async open => {
  const {page} = await open((await harness.serve([TABLE4])).address);
  await go(page, "sweep");
  await page.locator("#runs").fill("20000");
  await page.click("#sweep");
  await page.waitForFunction(() => / of 20000 runs/.test(document.querySelector("#sweep-status").textContent));
  await page.evaluate(() => window.studio.open(window.studio.text));
  await quiet(page);
  // The server sent the rows that it had, and the answer.
  await page.waitForTimeout(1000);
  const left = await page.evaluate(() => ({
    status: document.querySelector("#sweep-status").textContent,
    trouble: document.querySelector("#view-sweep .mistake").textContent,
    figures: document.querySelector("[data-picture=Histogram]").checkVisibility(),
    stop: document.querySelector("#sweep-stop").checkVisibility(),
  }));
  expect(!left.status && !left.trouble && !left.figures && !left.stop, JSON.stringify(left));
  await page.locator("#runs").fill("8");
  await page.click("#sweep");
  await page.waitForFunction(() => /^8 runs in/.test(document.querySelector("#sweep-status").textContent));
  const listed = await page.evaluate(() => document.querySelectorAll("#view-sweep .card tbody tr").length);
  expect(listed === 8, `${listed} runs are listed`);
});

for (const [width, height, colorScheme] of [
  [820, 1100, "light"],
  [390, 844, "light"],
  [390, 844, "dark"],
  [1400, 950, "dark"],
]) {
  await test(`fit, tune, shape and sweep at ${width} pixels, ${colorScheme}`, async open => {
    const {page} = await open((await harness.serve([PID])).address, {viewport: {width, height}, colorScheme});
    for (const view of ["fit", "tune", "shape", "sweep"]) {
      await page.evaluate(view => window.studio.show(view), view);
      await quiet(page);
      await shot(page, `${view}-${width}-${colorScheme}`);
      const {scroll, wide} = await page.evaluate(() => ({
        scroll: document.documentElement.scrollWidth,
        wide: document.documentElement.clientWidth,
      }));
      expect(scroll <= wide, `${view} scrolls sideways: ${scroll} pixels on ${wide}`);
    }
  });
}

await test("axe finds nothing serious in fit, tune, shape and sweep", async open => {
  for (const colorScheme of ["light", "dark"]) {
    const {page} = await open((await harness.serve([PID])).address, {colorScheme});
    await page.evaluate(readFileSync(axe, "utf8"));
    for (const view of ["fit", "tune", "shape", "sweep"]) {
      await page.evaluate(view => window.studio.show(view), view);
      await quiet(page);
      if (view === "sweep") {
        await page.locator("#runs").fill("60");
        await page.click("#sweep");
        await page.waitForFunction(
          () => /^60 runs in/.test(document.querySelector("#sweep-status").textContent),
          null,
          {timeout: 60_000},
        );
        await quiet(page);
      }
      const found = await page.evaluate(() => window.axe.run({resultTypes: ["violations"]}));
      const grave = found.violations.filter(one => ["serious", "critical"].includes(one.impact));
      expect(
        !grave.length,
        `${view}, ${colorScheme}: ${grave
          .map(
            one =>
              `${one.id}: ${one.nodes
                .slice(0, 3)
                .map(node => node.html.slice(0, 200))
                .join(" | ")}`,
          )
          .join("; ")}`,
      );
    }
  }
});

await harness.end("fits, tunings, shapers and sweeps of the studio in a browser", left);
