// @ts-check
// How the machine swings: the page of `taut modes`, made by the library, brought to life by the reports' own script.
import {element, put} from "./format.js";
import {bring} from "./plot.js";

/** @typedef {import("./app.js").App} App */

export const key = "modes",
  name = "Frequencies, friction";

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const told = element("p", {class: "quiet", role: "status"}, "Computing…"),
    body = element("div", {class: "report page"});
  root.append(told, body);
  let shown = "";
  const show = () => {
    if (app.view !== key || !app.run || shown === app.text) return;
    const text = app.text;
    const speeds = app.run.columns.get("cart_speed") || new Float64Array(1);
    const speed = speeds.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    app.wire.newest(
      "modes",
      () => ({text: app.text, speed}),
      (answer, error) => {
        told.hidden = Boolean(answer);
        if (!answer) {
          told.textContent = String(error && error.message);
          body.replaceChildren();
          return;
        }
        shown = text;
        showReport(body, answer.head.html);
      },
    );
  };
  app.on("run", show);
  app.on("view", show);
}

/**
 * Shows a part of a report: the library made it, and it holds no script.
 * @param {HTMLElement} body
 * @param {string} html
 */
export function showReport(body, html) {
  body.innerHTML = html;
  bring(body);
  // What is wider than the page scrolls, by keys too.
  for (const place of body.querySelectorAll(".scroll")) {
    if (place.scrollWidth <= place.clientWidth) continue;
    const table = place.querySelector("table[aria-label]");
    put(place, {tabindex: "0", role: "group", "aria-label": table ? table.getAttribute("aria-label") : "Figure"});
  }
}
