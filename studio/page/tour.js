// @ts-check
// The paper as a guided tour: what each figure shows, in a sentence, with the controls to try it.
import {element} from "./format.js";

/** @typedef {import("./app.js").App} App */

export const key = "tour", name = "Tour";

const RIG = "sollmann-jouaneh/";

/** A stop: what the paper says there, the case that shows it, and what can be played with.
 * @typedef {{figure: string, title: string, words: string, stage: string, experiment?: number, panels: string[], tries: {words: string, key: string, value: number}[], at?: number, factor?: number}} Stop */

/** @type {Stop[]} */
const STOPS = [
  {figure: "Figures 1 and 2", title: "The stage and its model", stage: "table4.toml", panels: ["position"], factor: 1000, at: 0.05,
    words: "A motor turns the drive pulley; three spans of a toothed belt carry the motion to the cart and around the idler pulley. The model is two pulleys and a cart, joined by springs.",
    tries: [{words: "a belt twenty times softer in span 1", key: "belt.stiffness.0", value: 6638}]},
  {figure: "Figures 4 to 7", title: "The linear model answers a pulse", stage: "table1.toml", panels: ["position", "speed"], at: 0.25,
    words: "With viscous friction alone, the cart follows a 5 V pulse of a quarter of a second and comes to rest slowly: nothing but damping holds it.",
    tries: [{words: "half the cart's friction", key: "cart.friction.viscous", value: 9.5}, {words: "a cart of one kilogram", key: "cart.mass", value: 1}]},
  {figure: "Figures 8 and 9", title: "Coulomb friction ends the motion", stage: "table4.toml", panels: ["position", "state"], at: 0.4,
    words: "With dry friction the bodies stop for good: they stick one after another, at instants that the strip below shows, and no speed creeps on.",
    tries: [{words: "no dry friction at the cart", key: "cart.friction.coulomb", value: 0}, {words: "ten times as much", key: "cart.friction.coulomb", value: 2}]},
  {figure: "Figures 10 to 13", title: "Where motor and cart part", stage: "table4.toml", panels: ["error", "force"], factor: 2000, at: 0.01,
    words: "While the stage accelerates, its belt stretches: the cart is micrometres behind the motor's encoder, most of all in the first milliseconds.",
    tries: [{words: "twice the cart's mass", key: "cart.mass", value: 0.724}, {words: "twice as stiff a span 2", key: "belt.stiffness.1", value: 265520}]},
  {figure: "Figures 14 to 17", title: "Twice the voltage", stage: "table4.toml", experiment: 1, panels: ["speed", "current"], at: 0.25,
    words: "At 10 V the stage runs more than twice as fast as at 5 V: of the first volts, dry friction takes its share.",
    tries: [{words: "no dry friction at the drive pulley", key: "drive_pulley.friction.coulomb", value: 0}]},
  {figure: "Figures 20 and 21", title: "The stiffness of the belt", stage: "table2.toml", panels: ["error", "force"], factor: 2000, at: 0.01,
    words: "Stiffness and length of a span decide how far the cart is from where the encoder says; the resonance lies far above what the motion excites. The view Frequencies has it along the travel.",
    tries: [{words: "a tenth of the stiffness of span 3", key: "belt.stiffness.2", value: 5888.5}]},
];

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  let at = 0;
  const place = element("p", {class: "quiet"}), title = element("h2", {tabindex: "-1"}), words = element("p", {class: "lead"});
  const tries = element("div", {class: "tries"});
  const back = element("button", {type: "button", id: "tour-back", onclick: () => go(at - 1)}, "Back");
  const next = element("button", {type: "button", id: "tour-next", class: "strong", onclick: () => go(at + 1)}, "Next");
  const list = element("ol", {class: "stops"}, ...STOPS.map((stop, k) => element("li", {}, element("button", {type: "button", onclick: () => go(k)}, `${stop.figure}: ${stop.title}`))));
  root.append(element("div", {class: "tour"}, element("p", {class: "quiet"}, "K. Sollmann and M. Jouaneh, Dynamic modelling of a single-axis belt-drive system, 2011: the paper that this program recomputes, figure by figure. ",
    "taut paper checks every number."), list, place, title, words, tries, element("p", {class: "turns"}, back, next)));
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
    [...list.children].forEach((item, i) => { if (i === at) item.setAttribute("aria-current", "step"); else item.removeAttribute("aria-current"); });
    const show = () => element("button", {type: "button", class: "strong", id: "tour-show", onclick: () => { open(stop); }}, "Show it");
    tries.replaceChildren(show(), ...stop.tries.map(one => element("button", {type: "button", onclick: () => { open(stop, one); }}, `Try ${one.words}`)));
    title.focus({preventScroll: true});
  }

  function open(stop, one) {
    app.open(stages.get(RIG + stop.stage) || "", {name: stop.stage, experiment: stop.experiment || 0});
    app.factor = stop.factor || 100;
    app.show("motion");
    const seek = () => {
      if (stop.at !== undefined && app.cursor === 0) app.seek(stop.at);
      const panel = document.querySelector(`[data-panel="${stop.panels[0]}"]`);
      if (panel) panel.scrollIntoView({block: "center", behavior: "smooth"});
    };
    const isOpen = () => { if (one) { app.drag(one.key, one.value); app.drop(); } seek(); };
    waitFor(app, isOpen);
  }

  app.on("view", () => { if (app.view === key && !stages.size) go(at); });
}

/** Calls once, when the case that is being opened has run. @param {App} app @param {() => void} then */
function waitFor(app, then) {
  let isOver = false;
  app.on("opened", () => { if (!isOver) { isOver = true; then(); } });
}
