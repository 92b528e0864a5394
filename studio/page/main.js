// @ts-check
// Puts the page together: views, the case's menu, keys, themes, links.
import {App} from "./app.js";
import {Cases} from "./cases.js";
import {film} from "./film.js";
import {element, download, fileName, tell} from "./format.js";
import {fragment, stateOf} from "./link.js";
import {Mistake} from "./wire.js";
import * as motion from "./motion.js";
import * as modes from "./modes.js";
import * as logs from "./logs.js";
import * as tune from "./tune.js";
import * as shape from "./shape.js";
import * as sweep from "./sweep.js";
import * as gallery from "./gallery.js";
import * as tour from "./tour.js";

/** Each view has a key, a name, and a function that makes it once; it listens to the app for the rest. */
const VIEWS = [motion, modes, logs, tune, shape, sweep, gallery, tour];

/** @type {HTMLElement} */ (document.getElementById("unstarted")).remove();
const app = new App();
/** For tests, and for the curious. */
/** @type {any} */ (window).studio = app;
const find = id => /** @type {any} */ (document.getElementById(id));

// ---- Words to everyone

app.say = text => {
  find("said").textContent = text;
};
let notice = 0;
app.notify = (text, isGrave = false) => {
  const place = find("notice");
  place.textContent = text;
  place.hidden = false;
  place.classList.toggle("grave", isGrave);
  clearTimeout(notice);
  if (!isGrave)
    notice = setTimeout(() => {
      place.hidden = true;
    }, 6000);
};
app.wire.changed = isOpen => {
  if (isOpen) {
    if (find("notice").dataset.gone) {
      delete find("notice").dataset.gone;
      find("notice").hidden = true;
    }
    return;
  }
  find("notice").dataset.gone = "1";
  app.notify(app.wire.carrier.words.gone, true);
};

// ---- Views

const main = find("main");
for (const view of VIEWS) {
  const section = element("section", {id: `view-${view.key}`, class: "view", "aria-label": view.name, hidden: true});
  main.append(section);
  view.mount(section, app);
  find("views").append(
    element("button", {type: "button", id: `go-${view.key}`, onclick: () => app.show(view.key)}, view.name),
  );
}
app.show = key => {
  app.view = VIEWS.some(view => view.key === key) ? key : "motion";
  for (const view of VIEWS) {
    find(`view-${view.key}`).hidden = view.key !== app.view;
    const button = find(`go-${view.key}`);
    if (view.key === app.view) button.setAttribute("aria-current", "page");
    else button.removeAttribute("aria-current");
    // On a narrow screen the list of views is longer than its place. `scrollIntoView` would let the tab key go on from
    // the button, past the link to the content.
    if (view.key === app.view) {
      const list = /** @type {HTMLElement} */ (button.parentElement),
        [outer, inner] = [list, button].map(element => element.getBoundingClientRect());
      list.scrollLeft += Math.min(0, inner.left - outer.left) + Math.max(0, inner.right - outer.right);
    }
  }
  app.tell("view");
};
// Past the views, and past all parameters. The address stays: it may hold a state.
/** @type {HTMLElement} */ (document.querySelector(".skip")).onclick = event => {
  event.preventDefault();
  const target = app.view === "motion" ? find("centre") : main;
  target.focus();
  target.scrollIntoView({block: "start"});
};

// ---- The case

app.on("run", () => {
  if (!app.run) return;
  const {title} = app.run.head,
    named = `${title} · taut studio`;
  tell(find("title"), title);
  if (document.title !== named) document.title = named;
});
app.on("text", () => {
  for (const [id, isIdle] of [
    ["undo", !app.past.length],
    ["redo", !app.future.length],
    ["reset", app.text === app.original && !app.pending.size],
  ])
    if (find(id).disabled !== isIdle) find(id).disabled = isIdle;
  find("save").hidden = !app.path;
});
find("undo").onclick = () => app.undo();
find("redo").onclick = () => app.redo();
find("reset").onclick = () => app.reset();

/** Does a thing of the menu, closes it, and tells what went wrong. */
const act = (id, work) => {
  find(id).addEventListener("click", async () => {
    find("menu").open = false;
    try {
      await work();
    } catch (caught) {
      const error = /** @type {Error} */ (caught);
      const {what, next} = error instanceof Mistake ? error.mistake : {what: error.message, next: ""};
      app.notify([what, next].filter(Boolean).join("; "), true);
    }
  });
};
act("save", async () => {
  await app.wire.ask("save", {text: app.text});
  app.original = app.safe = app.text;
  app.tell("text");
  app.notify(`Saved to ${app.path}`);
});
act("download", () => {
  download(app.name, app.text, "application/toml");
  app.safe = app.text;
  app.tell("text");
});
act("report", async () => {
  const {head} = await app.wire.ask("report", {text: app.text});
  download(`${fileName(app.name.replace(/\.toml$/, ""))}-report.html`, head.html, "text/html");
});
act("csv", () => {
  if (!app.run) return;
  const {columns} = app.run,
    names = [...columns.keys()];
  let text = names.join(",") + "\n";
  const values = [...columns.values()];
  for (let i = 0; i < values[0].length; i++) text += values.map(column => column[i]).join(",") + "\n";
  download(`${fileName(app.run.head.title)}.csv`, text, "text/csv");
});
act("film", async () => {
  app.isPlaying = false;
  app.tell("play");
  app.show("motion");
  const gif = await film(app, share => app.notify(`Making the pictures: ${Math.round(100 * share)} %`));
  download(`${fileName(app.run ? app.run.head.title : app.name)}.gif`, gif, "image/gif");
});
act("link", async () => {
  const hash = await fragment(app.snapshot());
  history.replaceState(null, "", hash);
  try {
    await navigator.clipboard.writeText(location.href);
  } catch {
    /* it stands in the address bar */
  }
  app.notify(app.wire.carrier.words.link);
});
// A page that knows its opener would have the cases that were left here as its own.
act("tab", async () => {
  window.open(location.pathname + (await fragment(app.snapshot())), "_blank", "noopener");
});
find("file").addEventListener("change", async () => {
  const [file] = find("file").files;
  if (!file) return;
  if (file.size > 2 << 20) {
    app.notify("A case file may have 2 MB.", true);
    return;
  }
  app.open(await file.text(), {name: file.name});
  find("menu").open = false;
  find("file").value = "";
  app.show("motion");
});
document.addEventListener("click", event => {
  for (const menu of document.querySelectorAll("details.menu[open]"))
    if (!menu.contains(/** @type {Node} */ (event.target))) /** @type {any} */ (menu).open = false;
});

// ---- Keys

document.addEventListener("keydown", event => {
  const target = /** @type {HTMLElement} */ (event.target),
    isText = target.matches("textarea, input:not([type=range], [type=file], [type=checkbox])");
  // What is being typed into a field is undone by the browser; what is part of the case, by the page.
  const isItsOwn = isText && !target.matches("#text, .entry-field input:not([data-typed])");
  if ((event.ctrlKey || event.metaKey) && !event.altKey) {
    const key = event.key.toLowerCase();
    if (isItsOwn && "zy".includes(key)) return;
    if (key === "z" && !event.shiftKey) app.undo();
    else if (key === "y" || (key === "z" && event.shiftKey)) app.redo();
    else if (key === "s") {
      if (app.path) find("save").click();
      else find("download").click();
    } else return;
    event.preventDefault();
    return;
  }
  if (event.key === "Escape")
    for (const menu of document.querySelectorAll("details.menu[open]")) {
      /** @type {any} */ (menu).open = false;
      /** @type {any} */ (menu.firstElementChild).focus();
    }
  if (
    event.key === " "
    && !isText
    && !target.closest("button, summary, select, a, label, [role=application], details")
  ) {
    app.play();
    event.preventDefault();
  }
});

// ---- Themes

const theme = find("theme");
/** The address may be that of a site with names of its own. */
const THEME = "taut-theme";
const setTheme = value => {
  if (value) document.documentElement.dataset.theme = value;
  else delete document.documentElement.dataset.theme;
  theme.value = value;
  app.tell("theme");
};
theme.addEventListener("change", () => {
  setTheme(theme.value);
  if (window !== window.top) return;
  try {
    localStorage.setItem(THEME, theme.value);
  } catch {
    /* private windows */
  }
});
try {
  setTheme(localStorage.getItem(THEME) || "");
} catch {
  setTheme("");
}

// ---- The beginning

const cases = new Cases(find("left"), app);

/** Opens the state that the address holds. @returns {Promise<boolean>} whether it holds one */
async function follow() {
  let state = null;
  try {
    state = await stateOf(location.hash);
  } catch (error) {
    app.notify(/** @type {Error} */ (error).message, true);
  }
  if (!state) return false;
  find("notice").hidden = true;
  app.open(state.text, {name: String(state.name || "linked.toml"), experiment: Number(state.experiment) || 0});
  if (Number.isFinite(state.factor)) app.factor = state.factor;
  if (Number.isFinite(state.rate)) app.rate = state.rate;
  if (Number.isInteger(state.stop)) app.stop = Math.max(0, state.stop);
  app.show(state.view);
  let isFirst = true;
  app.on("opened", () => {
    if (!isFirst) return;
    isFirst = false;
    if (Array.isArray(state.window) && state.window.length === 2) app.look(state.window.map(Number));
    if (Number.isFinite(state.cursor)) app.seek(state.cursor);
  });
  return true;
}

async function begin() {
  const {head} = await app.wire.ask("open");
  const own = {name: head.name, path: head.path || "", isBuiltIn: !head.path},
    kept = cases.restore(own.path);
  if (kept) {
    if (own.path && kept.path !== own.path) app.open(head.text, own);
    app.open(kept.base, kept);
    app.show(app.view);
    app.notify(`Your changes to ${kept.name} are back. “Reset” returns to the case as it was opened.`);
  } else if (!(await follow())) {
    app.open(head.text, own);
    app.show(app.view);
  }
}

/** Says that the page is not ready yet, if that takes long. */
async function wait() {
  const {ready, words} = app.wire.carrier,
    place = find("notice");
  const late = setTimeout(() => {
    place.textContent = words.loading;
    place.hidden = false;
  }, 500);
  // `changed` tells what failed.
  await ready.catch(() => {});
  clearTimeout(late);
  if (place.textContent === words.loading) place.hidden = true;
}
addEventListener("hashchange", () => {
  follow();
});
wait();
begin().catch(error => app.notify(String(error.message || error), true));
