// @ts-check
// From a log to a model: drop files, say what their columns are, see what they determine, fit, keep.
import {download, element, fileName, fold, number, rowHead, svg, table} from "./format.js";
import {Picture} from "./picture.js";
import {dropPlace, errorPlace, wordsOf} from "./drop.js";
import {LongWork} from "./long-work.js";
import {showReport} from "./modes.js";

/** @typedef {import("./app.js").App} App */

export const key = "fit",
  name = "Fit";

const WORDS = {time: "Time", input: "Input of the amplifier", reference: "Reference", split: "Tells runs apart"};
const DELAYS = [
  ["", "no delay"],
  ["shared", "one delay for all logs"],
  ["each", "a delay for each log"],
];
const ALONG = [
  ["input_gain", "a factor on the input"],
  ["input_offset", "an offset of the input"],
  ["initial_state", "position and speed at the start"],
  ["bias", "an offset of each output"],
];
/** Parts of keys of the machine that a fit can set; the rest of a case is none of it. */
const MACHINE = /^(motor|amplifier|drive|drive_pulley|idler_pulley|cart|belt|encoder)\./;

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const view = new Logs(root, app);
  app.on("view", () => {
    if (app.view === key) view.refresh();
  });
  app.on("opened", () => view.reset());
}

class Logs {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    /** @type {LogFile[]} */
    this.files = [];
    this.result = null;
    this.begun = 0;
    /** @type {{x: number[], y: number[]}} */
    this.costs = {x: [], y: []};
    /** @type {Map<string, Picture>} */
    this.pictures = new Map();
    this.trouble = errorPlace({id: "fit-trouble"});
    this.list = element("div", {class: "log-files"});
    this.unread = element("div", {class: "mistake", id: "unread", role: "alert"});
    this.own = element(
      "p",
      {class: "quiet", hidden: true},
      "This case names logs of its own; they are used as long as no file is dropped.",
    );
    this.plan = element("div", {class: "plan"});
    this.checkButton = element(
      "button",
      {type: "button", id: "check", onclick: () => this.check()},
      "What do the logs determine?",
    );
    this.fitButton = element("button", {type: "button", id: "fit", class: "strong", onclick: () => this.fit()}, "Fit");
    const stop = {id: "fit-stop", words: "Stop, keep the best"};
    this.work = new LongWork(app.wire, [this.checkButton, this.fitButton], stop);
    this.status = element("p", {class: "quiet", role: "status", id: "fit-status"});
    this.work.stopButton.addEventListener("click", () => (this.status.textContent = "Stopping…"));
    /** Seconds, which nobody wants read out. */
    this.clock = element("span", {class: "quiet", "aria-hidden": "true"});
    this.ticking = 0;
    this.live = element("div", {class: "live", hidden: true});
    this.done = element("div", {class: "fit-done", id: "fit-done", hidden: true});
    this.checked = element("div", {class: "report page"});
    root.append(
      element("h2", {}, "From a log to a model"),
      element(
        "p",
        {class: "quiet"},
        "The case says what the machine is; a log of it says how it moved. The fit changes the "
          + "chosen parameters until the model moves as the log does.",
      ),
      element("h3", {}, "1. Logs"),
      dropPlace({
        id: "log-file",
        words: `${app.wire.carrier.words.logs} files of a recorder`,
        accept: ".csv,.txt,.tsv,.mat,.parquet,.log,.gz",
        many: true,
        take: files => this.take(files),
        failed: error => this.unread.replaceChildren(element("p", {}, wordsOf(error))),
        wire: app.wire,
      }),
      this.unread,
      this.own,
      this.list,
      element("h3", {}, "2. What is searched for"),
      this.plan,
      element("h3", {}, "3. Check and fit"),
      element("p", {class: "buttons"}, this.checkButton, this.fitButton, this.work.stopButton, this.clock),
      this.status,
      this.trouble,
      this.live,
      this.done,
      this.checked,
    );
    this.cost = new Picture("Cost", {
      x: "Step",
      y: "log₁₀ of the cost",
      height: 150,
      words: "Falls as the model comes nearer to the logs.",
    });
    this.moving = element("table", {class: "moving"});
    this.overlays = element("div", {class: "plots"});
    this.live.append(
      element(
        "div",
        {class: "live-head"},
        element(
          "div",
          {},
          this.cost.figure,
          element("p", {class: "quiet small-note"}, "It jumps where the weights of the residuals are estimated anew."),
        ),
        element("div", {class: "scroll"}, this.moving),
      ),
      this.overlays,
    );
  }

  // ---- Logs

  async take(files) {
    this.trouble.tell(null);
    this.unread.replaceChildren();
    for (const file of files) {
      try {
        const {head} = await this.app.wire.ask("columns", {path: file.path});
        const one = new LogFile(file, head, () => {
          this.files = this.files.filter(other => other !== one);
          one.element.remove();
        });
        this.files.push(one);
        this.list.append(one.element);
        this.app.say(`${file.name}: ${head.rows} rows of ${head.found.length} columns`);
      } catch (error) {
        this.unread.append(element("p", {}, `${file.name}: ${wordsOf(error)}`));
      }
    }
  }

  // ---- The plan

  /** Another case was opened: what the logs told of the one before is none of it. */
  reset() {
    this.work.leave();
    this.end("");
    this.shape = "";
    this.close();
    this.trouble.tell(null);
    if (this.app.view === key) this.refresh();
  }

  refresh() {
    const {app} = this;
    this.own.hidden = !/^\s*log\s*=/m.test(app.text);
    const machine = app.parameters.filter(one => MACHINE.test(one.key) && one.free !== false);
    const shape = machine.map(one => one.key).join(" ");
    if (shape === this.shape) return;
    this.shape = shape;
    const hasOwn = /^\[fit\]/m.test(app.text);
    this.ownPlan = element("input", {type: "checkbox", id: "own-plan", checked: hasOwn});
    // Friction is what data sheets do not say; whatever is written of it, and the mass, is a beginning.
    const isUsual = one => one.written !== null && /\.friction\./.test(one.key);
    const box = one =>
      element(
        "label",
        {class: "choice", title: one.sentence},
        element("input", {type: "checkbox", value: one.key, checked: isUsual(one)}),
        " ",
        one.key,
        element("span", {class: "quiet"}, ` ${one.shown || ""}`),
      );
    const written = machine.filter(one => one.written !== null),
      others = machine.filter(one => one.written === null);
    this.free = element("div", {class: "choices", role: "group", "aria-label": "Free parameters"}, ...written.map(box));
    const more = others.length
      ? fold(
          {class: "more"},
          `${others.length} more that stand at their default`,
          `Free parameters, ${others.length} more that stand at their default`,
          element("div", {class: "choices"}, ...others.map(box)),
        )
      : null;
    this.delay = element(
      "select",
      {id: "delay"},
      ...DELAYS.map(([value, words]) => element("option", {value, selected: value === "shared"}, words)),
    );
    this.along = element(
      "div",
      {class: "choices"},
      ...ALONG.map(([value, words]) =>
        element("label", {class: "choice"}, element("input", {type: "checkbox", value}), " ", words),
      ),
    );
    this.heldOut = element("input", {
      type: "text",
      id: "held-out",
      placeholder: "none; names, * for anything",
      size: 28,
    });
    this.starts = element("input", {type: "number", id: "starts", min: 1, max: 50, value: 1, style: null});
    const own = hasOwn ? element("label", {class: "choice"}, this.ownPlan, " as [fit] of the case says") : null;
    this.plan.replaceChildren(
      ...[
        own,
        this.free,
        more,
        element(
          "div",
          {class: "fields"},
          element("label", {for: "delay"}, "Fitted along: ", this.delay),
          element("label", {for: "held-out"}, "Held out: ", this.heldOut),
          element("label", {for: "starts"}, "Starts: ", this.starts),
        ),
        fold(
          {class: "more"},
          "More that is fitted along with each log",
          "More that is fitted along with each log",
          this.along,
        ),
      ].filter(Boolean),
    );
  }

  /** The request of check and fit. */
  body() {
    const chosen = place => [...place.querySelectorAll("input:checked")].map(input => input.value);
    const logs = this.files.map(file => ({name: file.title, log: file.table()}));
    if (this.ownPlan && this.ownPlan.checked && !logs.length) return {...this.app.body(), logs};
    const nuisance = {};
    for (const name of chosen(this.along)) nuisance[name] = true;
    if (this.delay.value) nuisance.delay = this.delay.value === "each" ? true : this.delay.value;
    const heldOut = this.heldOut.value
      .split(",")
      .map(text => text.trim())
      .filter(Boolean);
    const starts = Number(this.starts.value) || 1;
    const plan = {
      free: chosen(this.plan.querySelector(".choices")).concat(
        [...this.plan.querySelectorAll("details .choices")].filter(place => place !== this.along).flatMap(chosen),
      ),
      nuisance: Object.keys(nuisance).length ? nuisance : null,
      held_out: heldOut.length ? heldOut : null,
      starts: starts > 1 ? starts : null,
    };
    return {...this.app.body(), logs, plan};
  }

  // ---- Works

  begin(words) {
    this.trouble.tell(null);
    this.status.textContent = words;
    this.begun = performance.now();
    const tick = () => {
      const seconds = Math.floor((performance.now() - this.begun) / 1000);
      this.clock.textContent = `${seconds} s. After its last step the result is judged, which can take longer.`;
    };
    clearInterval(this.ticking);
    this.ticking = setInterval(tick, 1000);
  }

  end(words) {
    clearInterval(this.ticking);
    this.clock.textContent = "";
    this.status.textContent = words;
    if (words) this.app.say(words);
  }

  close() {
    this.done.hidden = true;
    this.live.hidden = true;
    this.checked.replaceChildren();
    this.status.textContent = "";
  }

  async check() {
    this.begin("Looking at the logs…");
    this.live.hidden = true;
    try {
      const {head} = await this.work.ask("check", this.body(), ({step, cost}) => {
        if (step) this.status.textContent = `Looking at the logs: step ${step}, cost ${number(cost, 4)}`;
      });
      showReport(this.checked, head.html);
      this.checked.dataset.of = "check";
      this.end(`Looked at in ${this.seconds()} s.`);
    } catch (error) {
      this.trouble.tell(error);
      this.end("");
    }
  }

  seconds() {
    return number((performance.now() - this.begun) / 1000, 3);
  }

  async fit() {
    this.begin("Simulating the logs…");
    this.done.hidden = true;
    this.live.hidden = false;
    this.costs = {x: [], y: []};
    this.pictures = new Map();
    this.overlays.replaceChildren();
    this.moving.replaceChildren();
    try {
      const {head} = await this.work.ask("fit", this.body(), step => this.step(step));
      this.show(head);
      this.end(`${head.ending}. ${this.seconds()} s.`);
    } catch (error) {
      this.live.hidden = true;
      this.trouble.tell(error);
      this.end("");
    }
  }

  step(step) {
    if (step.phase) {
      this.status.textContent = `Computing ${step.phase}…`;
      return;
    }
    this.status.textContent = `Step ${step.step}, cost ${number(step.cost, 5)}, ${this.seconds()} s`;
    const {x, y} = this.costs;
    if (step.cost > 0) {
      x.push(step.step);
      y.push(Math.log10(step.cost));
    }
    this.cost.show([{name: "", x, y}]);
    this.parameters(step.parameters);
    for (const log of step.logs) {
      let picture = this.pictures.get(log.name);
      if (!picture) {
        picture = new Picture(log.name, {
          x: "Time",
          xUnit: "s",
          y: log.quantity.replace(/_/g, " "),
          yUnit: log.unit,
          words: "Log and model.",
        });
        this.pictures.set(log.name, picture);
        this.overlays.append(picture.figure);
      }
      picture.show([
        {name: "log", x: log.time, y: log.seen.map(v => (v === null ? NaN : v)), kind: "points", colour: "grey"},
        {name: "model", x: log.time, y: log.model, colour: "blue"},
      ]);
    }
  }

  /** Values as they move: a bar is the value over where it started. */
  parameters(all) {
    if (this.moving.rows.length !== all.length) {
      this.moving.replaceChildren(
        element("caption", {class: "unseen"}, "Parameters as they move"),
        ...all.map(one =>
          element(
            "tr",
            {},
            element("th", {scope: "row"}, one.name),
            element("td", {}),
            element("td", {class: "quiet"}, one.unit),
            element("td", {}, element("meter", {min: 0, max: 2, value: 1, "aria-label": `${one.name} over its start`})),
          ),
        ),
      );
    }
    all.forEach((one, k) => {
      const cells = this.moving.rows[k].cells;
      cells[1].textContent = number(one.value, 5);
      /** @type {any} */ (cells[3].firstElementChild).value = one.start
        ? Math.max(0, Math.min(2, one.value / one.start))
        : 1;
    });
  }

  /** A result: estimates, correlations, what to do with it, and the whole report. */
  show(head) {
    this.result = head;
    const {result} = head;
    const rows = head.rows.map((row, k) => [
      rowHead(row.name),
      row.value,
      row.error,
      row.interval.replace(/^95 %: /, ""),
      element("td", {class: "quiet"}, row.start),
      result.parameters[k].determined ? "" : result.parameters[k].at_bound ? "at its bound" : "not determined",
    ]);
    const columns = ["Parameter", "Estimate", "Standard error", "95 % interval", "Start", ""],
      estimates = element("div", {class: "scroll card"}, table(columns, rows, "Estimates and 95 % intervals"));
    const warned = result.findings.filter(one => one.grade === "warning");
    const notes = warned.length
      ? element("ul", {class: "warnings"}, ...warned.map(one => element("li", {}, one.text)))
      : null;
    const keep = element(
      "button",
      {
        type: "button",
        id: "fit-keep",
        class: "strong",
        onclick: () => {
          this.app.edit(head.kept);
          this.app.notify("The estimates stand in the case now; Ctrl Z takes them back.");
        },
      },
      "Keep: put the estimates into the case",
    );
    const discard = element("button", {type: "button", id: "fit-discard", onclick: () => this.close()}, "Discard");
    const json = element(
      "button",
      {type: "button", onclick: () => download("fit.json", JSON.stringify(result, null, 2) + "\n", "application/json")},
      "fit.json",
    );
    const toml = element(
      "button",
      {
        type: "button",
        onclick: () =>
          download(`${fileName(this.app.name.replace(/\.toml$/, ""))}-fitted.toml`, head.fitted, "application/toml"),
      },
      "fitted.toml",
    );
    this.done.replaceChildren(
      ...[
        element("h3", {}, "Result"),
        element("p", {}, `${head.ending}.`),
        notes,
        estimates,
        correlation(result),
        element("p", {class: "buttons"}, keep, discard, json, toml),
      ].filter(Boolean),
    );
    this.done.hidden = false;
    showReport(this.checked, head.html);
    this.checked.dataset.of = "fit";
  }
}

/** Correlations of the estimates as a square of colours, with their numbers. */
function correlation(result) {
  const names = result.parameters.map(one => one.name),
    rows = result.correlation,
    n = names.length;
  if (n < 2 || !rows || rows.length !== n) return null;
  const size = Math.max(26, Math.min(54, 420 / n)),
    left = 8 * Math.min(34, Math.max(...names.map(name => name.length))) + 10;
  const words = value => (value === null ? "unknown" : number(value, 2));
  const pairs = names.flatMap((a, i) => names.slice(i + 1).map((b, j) => `${a} and ${b} ${words(rows[i][i + 1 + j])}`));
  const drawing = svg("svg", {
    viewBox: `0 0 ${left + size * n + 8} ${size * n + 26}`,
    class: "correlation",
    role: "img",
    style: null,
    "aria-label": `Correlations: ${pairs.join("; ")}`,
  });
  drawing.setAttribute("width", String(left + size * n + 8));
  names.forEach((name, i) => {
    drawing.append(
      svg(
        "text",
        {x: left - 8, y: size * i + size / 2 + 4, "text-anchor": "end", class: "small"},
        `${i + 1}. ${name.length > 34 ? name.slice(0, 33) + "…" : name}`,
      ),
    );
    drawing.append(
      svg(
        "text",
        {x: left + size * i + size / 2, y: size * n + 18, "text-anchor": "middle", class: "small"},
        String(i + 1),
      ),
    );
    rows[i].forEach((value, j) => {
      const has = value !== null && isFinite(value);
      const cell = svg("rect", {
        x: left + size * j,
        y: size * i,
        width: size - 2,
        height: size - 2,
        rx: 3,
        class: has && value < 0 ? "f-verm" : "f-blue",
        "fill-opacity": has ? Math.min(1, Math.abs(value)) * 0.85 + 0.04 : 0,
      });
      drawing.append(cell);
      if (size > 30)
        drawing.append(
          svg(
            "text",
            {
              x: left + size * j + size / 2 - 1,
              y: size * i + size / 2 + 4,
              "text-anchor": "middle",
              class: "small cell-value",
            },
            has ? value.toFixed(2).replace("-", "−") : "–",
          ),
        );
    });
  });
  return element(
    "figure",
    {class: "picture"},
    element(
      "figcaption",
      {},
      element("h3", {}, "Correlations"),
      element(
        "span",
        {class: "quiet"},
        "Near 1 or −1 the logs determine one combination of the two far better than each.",
      ),
    ),
    element("div", {class: "scroll", tabindex: "0", role: "group", "aria-label": "Correlations"}, drawing),
  );
}

/** A file that was dropped: what its columns are. */
class LogFile {
  /** @param {{name: string, path: string}} file @param {any} head @param {() => void} remove */
  constructor(file, head, remove) {
    this.file = file;
    this.head = head;
    this.title = file.name.replace(/\.\w+$/, "").slice(0, 60) || "log";
    /** @type {Map<string, {column: any, unit: any}>} */
    this.roles = new Map();
    const guessed = new Map(head.guess.columns.map(one => [one.key, one]));
    const keys = ["time", "input", ...head.quantities.map(one => one.key), "reference"];
    const units = new Map([
      ["time", "s"],
      ["input", "V or A"],
      ["reference", "m"],
      ...head.quantities.map(one => [one.key, one.unit]),
    ]);
    const row = key => this.row(key, units.get(key) || "", guessed.get(key));
    const isShown = key => ["time", "input"].includes(key) || guessed.has(key);
    this.preview = new Picture(`Preview of ${file.name}`, {
      x: "Row",
      y: "as in the file, each over its range",
      height: 170,
      words: "The chosen columns, each scaled to its own range.",
    });
    const mapping = keys => {
      const made = table(["What", "Column", "Unit", "First values"], keys.map(row));
      made.className = "mapping";
      return made;
    };
    const others = keys.filter(key => !isShown(key));
    this.split = this.columns("split", head.guess.split);
    this.preset = element(
      "select",
      {"aria-label": `Recorder of ${file.name}`},
      element("option", {value: ""}, "any"),
      ...head.presets.map(one =>
        element("option", {value: one.name, selected: one.name === head.guess.preset}, one.title),
      ),
    );
    this.element = element(
      "section",
      {class: "card log-file", "aria-label": file.name},
      element(
        "h4",
        {},
        file.name,
        element("span", {class: "quiet"}, ` ${head.rows} rows, ${head.found.length} columns `),
        element("button", {type: "button", onclick: remove, "aria-label": `Remove ${file.name}`}, "Remove"),
      ),
      element("div", {class: "scroll"}, mapping(keys.filter(isShown))),
      element(
        "div",
        {class: "fields"},
        element("label", {}, `${WORDS.split}: `, this.split),
        element("label", {}, "Recorder: ", this.preset),
      ),
      fold({class: "more"}, "More quantities", "More quantities", element("div", {class: "scroll"}, mapping(others))),
      this.preview.figure,
    );
    this.look();
  }

  columns(key, chosen) {
    const words = id => (typeof id === "number" ? `column ${id}` : id);
    return element(
      "select",
      {"aria-label": `${WORDS[key] || key.replace(/_/g, " ")}: column`, onchange: () => this.look()},
      element("option", {value: ""}, "–"),
      ...this.head.found.map((column, k) => element("option", {value: k, selected: k === chosen}, words(column.id))),
    );
  }

  row(key, wanted, guess) {
    const column = this.columns(key, guess ? guess.column : null);
    const unit = element("input", {
      type: "text",
      size: 7,
      value: (guess && guess.unit) || "",
      "aria-label": `${key.replace(/_/g, " ")}: unit`,
    });
    const first = element("td", {class: "quiet first-values"});
    this.roles.set(key, {column, unit});
    const show = () => {
      const one = this.head.found[column.value];
      unit.placeholder = (one && one.unit) || wanted;
      first.textContent =
        column.value === ""
          ? ""
          : one.first
              .slice(0, 5)
              .map(value => (value === null ? "–" : number(value, 6)))
              .join(", ") + "…";
    };
    column.addEventListener("change", show);
    show();
    return element(
      "tr",
      {},
      element("th", {scope: "row"}, WORDS[key] || key.replace(/_/g, " ")),
      element("td", {}, column),
      element("td", {}, unit),
      first,
    );
  }

  look() {
    const series = [];
    for (const [key, {column}] of this.roles) {
      if (column.value === "" || key === "time") continue;
      const points = this.head.found[column.value].points.map(value => (value === null ? NaN : value)),
        good = points.filter(isFinite);
      const low = Math.min(...good),
        high = Math.max(...good),
        span = high - low || 1,
        thin = this.head.rows / Math.max(1, points.length);
      series.push({
        name: WORDS[key] || key.replace(/_/g, " "),
        x: points.map((_, k) => k * thin),
        y: points.map(value => (value - low) / span),
      });
    }
    this.preview.show(series);
  }

  /** The table of the log, as a case has it. */
  table() {
    const id = place => this.head.found[place].id;
    const table = {file: this.file.path, preset: this.preset.value || null},
      units = {};
    for (const [key, {column, unit}] of this.roles) {
      if (column.value === "") continue;
      table[key] = id(column.value);
      if (unit.value.trim()) units[key] = unit.value.trim();
    }
    if (this.split.value !== "") table.split = id(this.split.value);
    if (Object.keys(units).length) table.units = units;
    return table;
  }
}
