// @ts-check
// The paper as a guided tour: what each figure shows, in a sentence, with the controls to try it.
import {element} from "./format.js";

/** @typedef {import("./app.js").App} App */

export const key = "tour",
  name = "Tour";

const RIG = "sollmann-jouaneh/";

/** Something to try at a stop: other values, or another experiment.
 * @typedef {{words: string, set?: [string, number][], experiment?: number}} Try */

/** A stop: figures of the paper, the sentence that they support, the case that shows it (with a change of its text, where
 * there is one), where to look, and what can be played with.
 * @typedef {Object} Stop
 * @property {string} figure
 * @property {string} title
 * @property {string} words
 * @property {string} stage
 * @property {[string, string]} [change]
 * @property {string} [view]
 * @property {string} panel to be seen; of another view the heading
 * @property {Try[]} tries
 * @property {number} [at]
 * @property {number} [factor]
 * @property {[number, number]} [window] */

/** All three spans times a factor, of Table 1. @param {number} factor @returns {[string, number][]} */
const stiffness = factor => [265520, 265520, 117770].map((k, span) => [`belt.stiffness.${span}`, factor * k]);

/** Both pulleys. @param {number} factor @returns {[string, number][]} */
const inertia = factor => [
  ["drive_pulley.inertia", factor * 7e-5],
  ["idler_pulley.inertia", factor * 7e-5],
];

/** Friction everywhere. @param {number} factor @returns {[string, number][]} */
const friction = factor => [
  ["drive_pulley.friction.viscous", factor * 0.0042],
  ["idler_pulley.friction.viscous", factor * 0.0042],
  ["cart.friction.viscous", factor * 40.6518],
];

/** The cart's friction with an excess at the start. @type {[string, string]} */
const STRIBECK = ['coulomb = "0.2000 N"', 'coulomb = "0.2000 N", stribeck = { force = "1 N", velocity = "20 mm/s" }'];

/** @type {Stop[]} */
const STOPS = [
  {
    figure: "Figures 1 and 2",
    title: "The stage and its model",
    stage: "table4.toml",
    panel: "position",
    factor: 1000,
    at: 0.05,
    words:
      "A geared DC motor turns one of two pulleys, and a toothed belt pulls the cart along its guide. The model has three inertias, the pulleys and the cart, and between them the three spans of the belt as springs: equations (1) to (3).",
    tries: [{words: "a belt twenty times softer in span 1", set: [["belt.stiffness.0", 6638]]}],
  },
  {
    figure: "Figure 3",
    title: "The belt as a spring",
    stage: "table1.toml",
    panel: "force",
    factor: 2000,
    at: 0.01,
    window: [0, 0.05],
    words:
      "Where the belt has teeth it is much stiffer than between them. The two are springs in series, so the thin section decides: k = AE/l, equations (11) to (13). The longest span is the softest.",
    tries: [{words: "half the modulus, as in Table 2", set: stiffness(0.5)}],
  },
  {
    figure: "Figures 4 and 5",
    title: "A pulse, with the first guess",
    stage: "table1.toml",
    panel: "position",
    at: 0.25,
    words:
      "5 V, and then 10 V, for a quarter of a second, with the values of Table 1. The simulated motor answers in the shape of the real one, and ends short of it. What was measured was not published as data: these are the simulated curves.",
    tries: [
      {words: "10 V", experiment: 1},
      {words: "friction of a half", set: friction(0.5)},
    ],
  },
  {
    figure: "Figures 6 and 7",
    title: "Stiffness and position",
    stage: "table1.toml",
    panel: "position",
    at: 0.25,
    words:
      "One parameter at a time is doubled and halved. Twice and half the stiffness do not change the position by anything that could be seen: the dotted line, the run before, lies under the new one.",
    tries: [
      {words: "twice the stiffness", set: stiffness(2)},
      {words: "half the stiffness", set: stiffness(0.5)},
    ],
  },
  {
    figure: "Figures 8 and 9",
    title: "Stiffness and speed",
    stage: "table1.toml",
    panel: "speed",
    at: 0.005,
    window: [0, 0.03],
    words:
      "In the speed, the swing of the belt on top of the motion changes, and hardly more than that: a stiffer belt swings faster and less.",
    tries: [
      {words: "twice the stiffness", set: stiffness(2)},
      {words: "half the stiffness", set: stiffness(0.5)},
    ],
  },
  {
    figure: "Figures 10 and 11",
    title: "Inertia",
    stage: "table1.toml",
    panel: "speed",
    at: 0.01,
    words:
      "More inertia makes the answer slower, and the run-out after the pulse longer by as much, so that the end is the same. That holds while friction is viscous alone.",
    tries: [
      {words: "pulleys twice as heavy", set: inertia(2)},
      {words: "pulleys half as heavy", set: inertia(0.5)},
      {words: "all twice as heavy", set: [...inertia(2), ["cart.mass", 0.724]]},
    ],
  },
  {
    figure: "Figures 12 and 13",
    title: "Friction",
    stage: "table1.toml",
    panel: "position",
    at: 0.25,
    words:
      "Friction has by far the largest influence: twice as much of it nearly halves the way, half as much nearly doubles it.",
    tries: [
      {words: "twice the friction", set: friction(2)},
      {words: "half the friction", set: friction(0.5)},
    ],
  },
  {
    figure: "Figures 14 and 15",
    title: "Matched at 5 V",
    stage: "table2.toml",
    panel: "position",
    at: 0.25,
    words:
      "Table 2 was matched to the pulse of 5 V. A linear model goes exactly twice as far at 10 V, whatever its numbers are, and the real stage does not: one set of linear parameters does not serve both.",
    tries: [{words: "10 V", experiment: 1}],
  },
  {
    figure: "Figure 16",
    title: "Three parts of friction",
    stage: "table4.toml",
    change: STRIBECK,
    view: "modes",
    panel: "Friction over speed",
    words:
      "Friction against speed, equation (14): a part that grows with speed, a part that only knows the direction (Coulomb), and an excess at the start of a motion that is soon gone (Stribeck). The view shows the curve of each body; here the cart has such an excess, drawn large.",
    tries: [],
  },
  {
    figure: "Figure 17",
    title: "Two of them are kept",
    stage: "table4.toml",
    view: "modes",
    panel: "Friction over speed",
    words:
      "The Stribeck part is called minor and left out: what remains, equation (15), jumps at zero speed and rises from there.",
    tries: [
      {words: "no dry friction at the cart", set: [["cart.friction.coulomb", 0]]},
      {words: "ten times as much", set: [["cart.friction.coulomb", 2]]},
    ],
  },
  {
    figure: "Figures 18 and 19",
    title: "Friction must not push",
    stage: "table4.toml",
    panel: "state",
    at: 0.4,
    words:
      "Block diagrams of equations (16) to (18). Friction may hold a body and never turn it round: Table 3 sees to that by a band of speeds about zero. Here a body that comes to rest sticks until its load breaks it loose; the strip shows when.",
    tries: [{words: "no dry friction at the cart", set: [["cart.friction.coulomb", 0]]}],
  },
  {
    figure: "Figures 20 and 21",
    title: "One set for both voltages",
    stage: "table4.toml",
    panel: "position",
    at: 0.4,
    words:
      "With the Coulomb friction of Table 4 one set of numbers serves 5 V and 10 V. Dry friction takes its share of the first volts: twice the voltage moves the cart 2.3 times as far.",
    tries: [
      {words: "10 V", experiment: 1},
      {words: "no dry friction at the drive pulley", set: [["drive_pulley.friction.coulomb", 0]]},
    ],
  },
];

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  let at = 0;
  const place = element("p", {class: "quiet"}),
    title = element("h2", {tabindex: "-1"}),
    words = element("p", {class: "lead"});
  const tries = element("div", {class: "tries"});
  const back = element("button", {type: "button", id: "tour-back", onclick: () => go(at - 1)}, "Back");
  const next = element("button", {type: "button", id: "tour-next", class: "strong", onclick: () => go(at + 1)}, "Next");
  const list = element(
    "ol",
    {class: "stops"},
    ...STOPS.map((stop, k) =>
      element("li", {}, element("button", {type: "button", onclick: () => go(k)}, `${stop.figure}: ${stop.title}`)),
    ),
  );
  root.append(
    element(
      "div",
      {class: "tour"},
      element(
        "p",
        {class: "quiet"},
        "K. Sollmann and M. Jouaneh, Dynamic modelling of a single-axis belt-drive system, 2011: the paper that this program recomputes, figure by figure. ",
        "taut paper checks every number.",
      ),
      place,
      title,
      words,
      tries,
      element("p", {class: "turns"}, back, next),
      element("h3", {}, "All stops"),
      list,
    ),
  );
  /** @type {Map<string, string>} */
  let stages = new Map();

  async function go(k) {
    at = Math.max(0, Math.min(STOPS.length - 1, k));
    if (!stages.size) {
      const {head} = await app.wire.ask("gallery");
      stages = new Map(head.stages.map(stage => [stage.path, stage.text]));
    }
    const stop = STOPS[at];
    place.textContent = `${at + 1} of ${STOPS.length} · ${stop.figure}`;
    title.textContent = stop.title;
    words.textContent = stop.words;
    back.disabled = at === 0;
    next.disabled = at === STOPS.length - 1;
    [...list.children].forEach((item, i) => {
      if (i === at) item.setAttribute("aria-current", "step");
      else item.removeAttribute("aria-current");
    });
    const show = () =>
      element(
        "button",
        {
          type: "button",
          class: "strong",
          id: "tour-show",
          onclick: () => {
            open(stop);
          },
        },
        "Show it",
      );
    tries.replaceChildren(
      show(),
      ...stop.tries.map(one =>
        element(
          "button",
          {
            type: "button",
            onclick: () => {
              open(stop, one);
            },
          },
          `Try ${one.words}`,
        ),
      ),
    );
    title.focus({preventScroll: true});
  }

  /** @param {Stop} stop @param {Try} [one] */
  function open(stop, one = {words: ""}) {
    const text = stages.get(RIG + stop.stage) || "";
    app.open(stop.change ? text.replace(...stop.change) : text, {
      name: stop.stage,
      experiment: one.experiment || 0,
      isBuiltIn: true,
    });
    app.factor = stop.factor || 100;
    app.show(stop.view || "motion");
    waitFor(app, () => {
      for (const [key, value] of one.set || []) app.drag(key, value);
      app.drop();
      // What the tour changes is nobody's work.
      app.isTouched = false;
      if (stop.window) app.look(stop.window);
      if (stop.at !== undefined && app.cursor === 0) app.seek(stop.at);
      if (stop.view) {
        heading(stop.panel, 100);
        return;
      }
      const panel = document.querySelector(`[data-panel="${stop.panel}"]`);
      if (panel) panel.scrollIntoView({block: "center", behavior: "smooth"});
    });
  }

  app.on("view", () => {
    if (app.view === key && !stages.size) go(at);
  });
}

/** Scrolls to a heading, once the page that has it is made. @param {string} text @param {number} turns to wait at most */
function heading(text, turns) {
  const found = [...document.querySelectorAll(".view:not([hidden]) h2")].find(one => one.textContent === text);
  if (found) found.scrollIntoView({block: "start", behavior: "smooth"});
  else if (turns > 0) setTimeout(() => heading(text, turns - 1), 100);
}

/** Calls once, when the case that is being opened has run. @param {App} app @param {() => void} then */
function waitFor(app, then) {
  let isOver = false;
  app.on("opened", () => {
    if (!isOver) {
      isOver = true;
      then();
    }
  });
}
