// Parts that scripts which use the studio in a browser have in common: servers, pages whose console is watched, tests.
import {spawn} from "node:child_process";
import {readFileSync} from "node:fs";
import {createServer} from "node:http";
import {extname, join} from "node:path";
import {chromium} from "playwright-core";

/** The folder that a server of files presents the studio in: not the top. */
export const UNDER = "/lessons/belt/";

/** Types that a server of files knows: it need not know what WebAssembly is. */
const TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"};

/** Servers, a browser and tests of a program. */
export class Harness {
  constructor(program, taut) {
    this.program = program;
    this.taut = taut;
    this.servers = [];
    this.passed = this.failed = 0;
  }

  async start() {
    const asRoot = process.getuid && process.getuid() === 0;
    this.browser = await chromium.launch({
      executablePath: this.program,
      args: ["--disable-background-networking", ...(asRoot ? ["--no-sandbox"] : [])],
    });
  }

  /** A server with these words behind `studio`. */
  async serve(words) {
    const child = spawn(this.taut, ["studio", ...words, "--no-open"], {stdio: ["ignore", "pipe", "inherit"]});
    this.servers.push(child);
    const address = await new Promise(done => child.stdout.once("data", data => done(String(data).split("\n")[0])));
    return {child, address};
  }

  /** A server of the files of a folder and of more, by their names; and the requests that it received. */
  async serveFolder(folder, more = {}) {
    const asked = [];
    const content = path => {
      try {
        return more[path] || readFileSync(join(folder, path));
      } catch {
        return null;
      }
    };
    const server = createServer(({method, url}, response) => {
      asked.push(`${method} ${url}`);
      const path = url.startsWith(UNDER) ? url.slice(UNDER.length) || "index.html" : "";
      const found = method === "GET" && /^[a-z-]+\.[a-z]+$/.test(path) ? content(path) : null;
      response.writeHead(found ? 200 : 404, {
        "Content-Type": (found && TYPES[extname(path)]) || "application/octet-stream",
      });
      response.end(found || "");
    });
    await new Promise(done => server.listen(0, "127.0.0.1", done));
    // The server ends with the script.
    server.unref();
    return {address: `http://127.0.0.1:${server.address().port}${UNDER}`, asked};
  }

  /** A page of it; what its console says, and what it asks of others, is trouble. */
  async open(address, options = {}) {
    const context = await this.browser.newContext({
      viewport: {width: 1400, height: 950},
      colorScheme: "light",
      ...options,
    });
    const page = await context.newPage(),
      trouble = [];
    page.on("console", message => {
      if (["error", "warning"].includes(message.type())) trouble.push("console: " + message.text());
    });
    page.on("pageerror", error => trouble.push("error: " + error.message));
    const local = url => /^(http|ws):\/\/127\.0\.0\.1:/.test(url) || /^(data|blob):/.test(url);
    page.on("request", request => {
      if (!local(request.url())) trouble.push("asked for " + request.url());
    });
    page.on("websocket", socket => {
      if (!local(socket.url())) trouble.push("asked for " + socket.url());
    });
    await page.goto(address);
    await page.waitForFunction(() => window.studio && window.studio.run && document.querySelector(".live-plot"), null, {
      timeout: 20_000,
    });
    await settled(page);
    return {page, trouble, context};
  }

  async test(name, work) {
    const pages = [];
    try {
      await work(async (...given) => {
        const page = await this.open(...given);
        pages.push(page);
        return page;
      });
      for (const {trouble} of pages) expect(!trouble.length, trouble.join("; "));
      this.passed++;
    } catch (error) {
      this.failed++;
      console.log(
        `studio: ${name} ... FAILED\n  ${String(error.stack || error)
          .split("\n")
          .slice(0, 6)
          .join("\n  ")}`,
      );
    }
    for (const {context} of pages) await context.close();
  }

  async end(what, left = []) {
    await this.browser.close();
    for (const child of this.servers) child.kill("SIGTERM");
    for (const one of left) console.log(`ignored: ${one}`);
    console.log(`test result: ${this.failed ? "FAILED" : "ok"}. ${this.passed} passed; ${this.failed} failed; ${what}`);
    process.exit(this.failed ? 1 : 0);
  }
}

export function expect(holds, told) {
  if (!holds) throw new Error(told);
}

/** Two pictures later. */
export const settled = page =>
  page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));

/** When the page shows what was asked for last. */
export const quiet = page =>
  page.waitForFunction(() => !window.studio.wire.isBusy, null, {timeout: 30_000}).then(() => settled(page));

/** A parameter's value in the run that is shown, in SI. */
export const value = (page, key) =>
  page.evaluate(key => window.studio.parameters.find(one => one.key === key).value, key);

/** A parameter with its field and its slider. */
export const row = (page, key) => page.locator(`.row[data-key="${key}"]`);

/** At how many of three places an element is seen, top to bottom, and not what lies over it. */
export const seen = (page, selector) =>
  page
    .locator(selector)
    .first()
    .evaluate(element => {
      const {left, top, right, bottom} = element.getBoundingClientRect();
      const shares = [0.1, 0.5, 0.9].map(share =>
        document.elementFromPoint((left + right) / 2, top + share * (bottom - top)),
      );
      return shares.filter(at => at && (element.contains(at) || at.contains(element))).length;
    });
