// From an empty page to a fitted model, step by step as a new user would, each with its time: cargo xtask first-fit.
//
//   node first-fit.mjs BROWSER TAUT [--shots DIR]
//
// TAUT is the program, or the folder that `cargo xtask web` makes, which needs no server.
// The log is data/pendulepi/february.csv, or in the folder that TAUT_DATA names. Between two steps a person looks and
// reads; the times are those of the machine alone.
import {existsSync, statSync} from "node:fs";
import {loadavg} from "node:os";
import {join} from "node:path";
import {Harness, quiet, settled} from "./harness.mjs";

const [program, taut, ...words] = process.argv.slice(2);
const shots = words[0] === "--shots" ? words[1] : "",
  isFolder = statSync(taut).isDirectory();
const log = [process.env.TAUT_DATA, "data"]
  .filter(Boolean)
  .map(folder => join(folder, "pendulepi/february.csv"))
  .find(existsSync);
if (!log) {
  console.log("needs data/pendulepi/february.csv: cargo xtask data fetches it");
  process.exit(1);
}
const harness = new Harness(program, taut);
await harness.start();
const load = loadavg()[0],
  rows = [];
let begun = performance.now();
const step = (what, told) => {
  const now = performance.now();
  rows.push([what, (now - begun) / 1000, told]);
  begun = performance.now();
};
const {address} = isFolder ? await harness.serveFolder(taut) : await harness.serve([]);
const {page} = await harness.open(address);
const shot = name => (shots ? page.screenshot({path: join(shots, `first-fit-${name}.png`), fullPage: true}) : null);
step(
  `${isFolder ? "The address of the folder" : "`taut studio`"}: the page opens with a case to start from`,
  await page.title(),
);

await page.click("#go-gallery");
await page.locator(".gallery button", {hasText: "pendulepi/pendulepi.toml"}).click();
await page.waitForFunction(() => /pendule_pi/.test(document.title));
await quiet(page);
step("Gallery, the cart of pendule_pi: the machine as its authors weighed it", await page.title());

await page.click("#go-fit");
await page.setInputFiles("#log-file", log);
await page.waitForSelector(".log-file .mapping");
await settled(page);
const mapped = await page.evaluate(() =>
  [...document.querySelectorAll(".log-file select")]
    .map(select => [
      select.getAttribute("aria-label").replace(": column", ""),
      select.options[select.selectedIndex].text,
    ])
    .filter(([, text]) => text !== "–" && text !== "any"),
);
step(
  "Fit: drop `february.csv`; columns are guessed",
  mapped.map(([what, column]) => `${what.toLowerCase()} = ${column}`).join(", "),
);
await shot("mapped");

await page.locator("#view-fit .choices input[value='amplifier.gain']").check();
await page.click("#check");
await page.waitForSelector("#view-fit .report[data-of=check] h2", {timeout: 280_000});
step(
  "tick `amplifier.gain` beside the frictions; What do the logs determine?",
  await page.locator("#fit-status").innerText(),
);

let steps = 0;
const counting = setInterval(
  () =>
    page
      .locator("#fit-status")
      .innerText()
      .then(text => {
        const found = /^Step (\d+)/.exec(text);
        if (found) steps = Number(found[1]);
      })
      .catch(() => {}),
  100,
);
await page.click("#fit");
await page.waitForSelector("#fit-keep", {timeout: 280_000});
clearInterval(counting);
await settled(page);
const status = await page.locator("#fit-status").innerText(),
  scores = await page.evaluate(() =>
    [...document.querySelectorAll("#fit-done tbody tr")].map(
      row => `${row.cells[0].textContent} ${row.cells[1].textContent} (${row.cells[3].textContent})`,
    ),
  );
step("Fit", `${status.split(".")[0]}; ${scores.join("; ")}`);
await shot("fitted");

await page.click("#fit-keep");
await quiet(page);
await page.click("#go-motion");
await settled(page);
step(
  "Keep: the estimates stand in the case, and the axis moves with them",
  (await page.evaluate(() => /\[uncertainty\]/.test(window.studio.text)))
    ? "with their intervals, as `[uncertainty]`"
    : "NOT KEPT",
);

console.log("| step | s | what is seen |\n|---|---|---|");
for (const [what, seconds, told] of rows) console.log(`| ${what} | ${seconds.toFixed(1)} | ${told} |`);
console.log(
  `\n${rows.reduce((sum, [, seconds]) => sum + seconds, 0).toFixed(0)} s together, with a load of `
    + `${load.toFixed(1)} before it began. ${steps} steps of the fit were seen.`,
);
await harness.browser.close();
for (const child of harness.servers) child.kill("SIGTERM");
process.exit(0);
