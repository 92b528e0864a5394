// @ts-check
// The machines of a report in motion: each is moved by the rows of its run that the page holds.
import {Playing, RATES, Stage, magnifier, playing, slowness, start} from "./player.js";
import {decode} from "./plot.js";

/** How long a run is to be watched, s. */
const WATCHED = 8;

/** A run that the page holds. */
class Held extends Playing {
  /** @param {any} spec as live.rs writes it */
  constructor({scene, until, curves, arrays}) {
    super();
    const decoded = arrays.map(decode),
      pick = axis => new Map(curves.map(curve => [curve.name, decoded[curve[axis]]]));
    this.run = {head: {scene, until}, columns: pick("y"), times: pick("x")};
    this.rate = RATES.find(rate => until / rate >= WATCHED) || RATES[RATES.length - 1];
  }

  /** Whole numbers, which the page holds to 32 bits of their range. @param {string} name @param {number} time */
  state(name, time) {
    return Math.round(super.state(name, time));
  }
}

/** Gives each machine below an element its drawing and what plays it. @param {ParentNode} root */
export function liven(root) {
  root.querySelectorAll("figure.machine").forEach((figure, k) => {
    const held = new Held(JSON.parse(/** @type {any} */ (figure.querySelector("script")).textContent)),
      prefix = `machine${k}-`;
    new Stage(/** @type {HTMLElement} */ (figure.querySelector(".stage-box")), held);
    const {play, scrub, clock} = playing(held, prefix),
      controls = /** @type {Element} */ (figure.querySelector(".transport"));
    controls.append(play, scrub, clock, slowness(held, prefix), magnifier(held, prefix));
    start(held);
    held.tell("run", "play", "cursor");
  });
}
