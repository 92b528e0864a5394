// @ts-check
// The view of the motion: the machine above its plots, the parameters and the text beside them.
import {element, number, put, table, tell, timeText} from "./format.js";
import {Panels, reset, splitter} from "./layout.js";
import {Stage, magnifier, playing, slowness, start} from "./player.js";
import {Plots} from "./plots.js";
import {Parameters} from "./parameters.js";
import {Editor} from "./editor.js";

/** @typedef {import("./app.js").App} App */

export const key = "motion",
  name = "Motion";

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  root.classList.add("motion");
  const side = element("aside", {class: "side", "aria-label": "The case"});
  const stage = element("section", {class: "stage-box", "aria-label": "The machine"});
  const plots = element("div", {class: "plots", id: "plots"});
  const glance = element(
    "section",
    {class: "glance", "aria-labelledby": "glance-title"},
    element("h2", {id: "glance-title"}, "At a glance"),
  );
  const plotted = element(
    "section",
    {class: "plotted", "aria-labelledby": "plots-title"},
    element("h2", {id: "plots-title", class: "unseen"}, "Plots"),
    plots,
    reset,
  );
  side.append(
    splitter({
      name: "side",
      words: "Width of the parameters",
      root,
      panel: () => side.getBoundingClientRect(),
      along: "x",
      least: 240,
      most: () => Math.max(240, innerWidth - 480),
    }),
  );
  const size = splitter({
    name: "stage",
    words: "Height of the drawing",
    root,
    panel: () => (stage.querySelector("svg") || stage).getBoundingClientRect(),
    along: "y",
    least: 80,
    most: () => Math.max(80, innerHeight - 240),
  });
  root.append(
    side,
    element("div", {class: "centre", id: "centre", tabindex: "-1"}, stage, bar(app), size, plotted, glance),
  );
  sides(side, app);
  const panels = new Panels(plots, words => app.say(words));
  app.scene = {stage: new Stage(stage, app), plots: new Plots(plots, app, undefined, panels)};
  new Glance(glance, app);
}

/** Parameters and text, of which a narrow page shows one. @param {HTMLElement} root @param {App} app */
function sides(root, app) {
  const panels = [
    ["parameters", "Parameters"],
    ["case", "Case text"],
    ["results", "Results"],
  ].map(([key, title]) => ({
    key,
    title,
    panel: element("div", {role: "tabpanel", id: `side-${key}`, "aria-labelledby": `tab-${key}`, class: "side-panel"}),
  }));
  const tabs = panels.map(({key, title}, k) =>
    element(
      "button",
      {type: "button", role: "tab", id: `tab-${key}`, "aria-controls": `side-${key}`, onclick: () => choose(k)},
      title,
    ),
  );
  /** Those that are kept up to date only in sight. @type {Map<string, {show: () => void}>} */
  const drawn = new Map();
  const choose = chosen =>
    panels.forEach(({key, panel}, k) => {
      if (k === chosen && root.classList.contains("low")) sheet.click();
      panel.hidden = k !== chosen;
      if (k === chosen) drawn.get(key)?.show();
      tabs[k].setAttribute("aria-selected", String(k === chosen));
      tabs[k].tabIndex = k === chosen ? 0 : -1;
    });
  const list = element(
    "div",
    {
      role: "tablist",
      "aria-label": "The case",
      onkeydown: event => {
        const now = tabs.indexOf(event.target),
          next = {ArrowRight: now + 1, ArrowLeft: now - 1}[event.key];
        if (next === undefined) return;
        const k = (next + tabs.length) % tabs.length;
        choose(k);
        tabs[k].focus();
      },
    },
    ...tabs,
  );
  const problem = element("button", {
    type: "button",
    class: "problem",
    hidden: true,
    onclick: () => {
      const isField = app.mistake && parameters.has(app.mistake.key);
      choose(isField ? 0 : 1);
      if (isField) parameters.go(app.mistake.key);
    },
  });
  // On a narrow screen the panels are a sheet that can be put down.
  const sheet = element(
    "button",
    {
      type: "button",
      class: "sheet",
      onclick: () => {
        const isLow = root.classList.toggle("low");
        put(sheet, {"aria-expanded": !isLow});
        tell(sheet, isLow ? "Show" : "Hide");
      },
      "aria-expanded": "true",
    },
    "Hide",
  );
  root.append(element("div", {class: "side-head"}, list, sheet), problem, ...panels.map(({panel}) => panel));
  const parameters = new Parameters(panels[0].panel, app);
  drawn.set("case", new Editor(panels[1].panel, app)).set("results", new Results(panels[2].panel, app));
  choose(0);
  app.on("mistake", () => {
    if (problem.hidden === Boolean(app.mistake)) problem.hidden = !app.mistake;
    if (app.mistake)
      problem.textContent = `${app.mistake.line ? `Line ${app.mistake.line}: ` : ""}${parameters.named(app.mistake)}`;
  });
}

/** Experiment, playing, and what is compared. @param {App} app */
function bar(app) {
  const {play, scrub, clock} = playing(app);
  const experiment = element("select", {
    id: "experiment",
    "aria-label": "Experiment",
    onchange: () => app.choose(Number(experiment.value)),
  });
  const before = element(
    "button",
    {
      type: "button",
      "aria-pressed": "true",
      id: "before",
      onclick: () => {
        app.showsBefore = !app.showsBefore;
        before.setAttribute("aria-pressed", String(app.showsBefore));
        app.tell("compare");
      },
    },
    "Before",
  );
  const pin = element("button", {type: "button", id: "pin", onclick: () => app.pin()}, "Pin");
  const unpin = element("button", {type: "button", id: "unpin", hidden: true, onclick: () => app.unpin()}, "Unpin");
  const all = element("button", {type: "button", id: "all", hidden: true, onclick: () => app.look(null)}, "Whole run");
  app.on("window", () => {
    all.hidden = !app.window;
  });
  app.on("compare", () => {
    unpin.hidden = !app.pins.length;
    unpin.textContent = `Unpin ${app.pins.length}`;
  });
  app.on("run", () => {
    const names = app.run ? app.run.head.experiments.map(({name}) => name) : [];
    if (names.join("\n") !== experiment.dataset.names) {
      experiment.dataset.names = names.join("\n");
      experiment.replaceChildren(...names.map((name, k) => element("option", {value: k}, name)));
    }
    if (experiment.value !== String(app.experiment)) experiment.value = String(app.experiment);
  });
  start(app);
  app.tell("play");
  return element(
    "div",
    {class: "transport", role: "toolbar", "aria-label": "Time"},
    play,
    scrub,
    clock,
    slowness(app),
    magnifier(app),
    element("span", {class: "gap"}),
    experiment,
    before,
    pin,
    unpin,
    all,
  );
}

/** A part of the page whose cells take new texts where nothing else is new: the page lays out only what changed. */
class Cells {
  /** @param {HTMLElement} root @param {string} cells the selector of those that have texts */
  constructor(root, cells) {
    this.root = root;
    this.cells = cells;
    this.shape = "";
  }

  /** @param {any} shape all of it but the texts @param {string[]} texts @param {() => HTMLElement[]} make */
  fill(shape, texts, make) {
    const now = JSON.stringify(shape);
    if (now !== this.shape) {
      this.shape = now;
      this.root.replaceChildren(...make());
      return;
    }
    this.root.querySelectorAll(this.cells).forEach((cell, k) => tell(cell, texts[k]));
  }
}

/** Quantities that follow from the numbers of the machine. */
class Glance {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.body = element("div", {class: "cards"});
    root.append(this.body);
    const cells = new Cells(this.body, "dd, tbody td");
    app.on("run", () => {
      const overview = app.run && app.run.head.overview;
      if (!overview) {
        cells.fill(null, [], () => []);
        return;
      }
      const {groups, notes} = overview,
        [head, ...places] = overview.places;
      const card = ({name, rows}) =>
        element(
          "div",
          {class: "card"},
          element("h3", {}, name),
          element(
            "dl",
            {},
            ...rows.flatMap(row => [element("dt", {title: row.how || null}, row.name), element("dd", {}, row.value)]),
          ),
        );
      const along = () =>
        places.length
          ? element(
              "div",
              {class: "card wide"},
              element("h3", {}, "Along the travel"),
              element(
                "div",
                {class: "scroll", tabindex: "0", role: "group", "aria-label": "Along the travel"},
                table(head, places),
              ),
            )
          : null;
      const noted = () =>
        notes.length
          ? element(
              "div",
              {class: "card wide"},
              element("h3", {}, "To be known"),
              element("ul", {}, ...notes.map(note => element("li", {}, note))),
            )
          : null;
      const shape = [
        groups.map(({name, rows}) => [name, rows.map(row => [row.name, row.how])]),
        head,
        places.length,
        notes,
      ];
      cells.fill(shape, [...groups.flatMap(({rows}) => rows.map(row => row.value)), ...places.flat()], () =>
        [...groups.map(card), along(), noted()].filter(Boolean),
      );
    });
  }
}

/** Key figures and events of the run, while they are in sight. */
class Results {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    const figures = element("dl", {class: "figures"}),
      events = element("div", {class: "events"});
    const ending = element("p", {class: "mistake", hidden: true});
    root.append(ending, element("h2", {}, "Key figures"), figures, element("h2", {}, "Events"), events);
    const cells = new Cells(figures, "dd");
    this.show = () => {
      if (!app.run || root.hidden) return;
      const {rows, ending: told, events: all, events_left_out: left} = app.run.head;
      ending.hidden = !told;
      tell(ending, told ? `This run ${told}.` : "");
      cells.fill(
        rows.map(([name]) => name),
        rows.map(([, value]) => value),
        () => rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]),
      );
      const shown = all.slice(0, 200);
      events.replaceChildren(
        ...shown.map(event =>
          element(
            "button",
            {
              type: "button",
              class: "event",
              onclick: () => {
                app.isPlaying = false;
                app.tell("play");
                app.seek(event.time);
              },
            },
            element("span", {}, timeText(event.time, 1e-9)),
            element("span", {}, event.part),
            element("span", {class: "quiet"}, `${event.from} → ${event.to}`),
          ),
        ),
        ...(all.length + left > shown.length
          ? [element("p", {class: "quiet"}, `${all.length + left - shown.length} more`)]
          : all.length
            ? []
            : [element("p", {class: "quiet"}, "None.")]),
      );
    };
    app.on("run", this.show);
  }
}
