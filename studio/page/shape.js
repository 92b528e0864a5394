// @ts-check
// Input shapers: drop a spectrum, or samples of an accelerometer, and see shapers over it.
import {element} from "./format.js";
import {dropPlace, errorPlace} from "./drop.js";
import {showReport} from "./modes.js";

/** @typedef {import("./app.js").App} App */

export const key = "shape",
  name = "Shape";

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const told = element("p", {class: "quiet", role: "status", id: "shape-status"}),
    body = element("div", {class: "report page"});
  const trouble = errorPlace();
  const axis = element(
    "select",
    {id: "shape-axis", onchange: () => again()},
    ...[
      ["", "all axes"],
      ["x", "x"],
      ["y", "y"],
      ["z", "z"],
    ].map(([value, words]) => element("option", {value}, words)),
  );
  /** @type {{name: string, path: string}[]} */
  let files = [];
  root.append(
    element("h2", {}, "Input shapers for what vibrates"),
    element(
      "p",
      {class: "quiet"},
      "A spectrum or the samples of an accelerometer, as printers' firmware writes them. Two files "
        + "are compared: before and after.",
    ),
    dropPlace({
      id: "spectrum-file",
      words: "One spectrum, or two",
      accept: ".csv,.txt",
      many: true,
      take: sent => {
        files = sent.slice(0, 2);
        again();
      },
      failed: error => trouble.tell(error),
      wire: app.wire,
    }),
    element("p", {class: "fields"}, element("label", {for: "shape-axis"}, "Axis of the accelerometer: ", axis)),
    told,
    trouble,
    body,
  );

  async function again() {
    if (!files.length) return;
    trouble.tell(null);
    told.textContent = "Choosing…";
    try {
      const {head} = await app.wire.ask("shape", {paths: files.map(file => file.path), axis: axis.value || null});
      showReport(body, head.html);
      told.textContent = `From ${files.map(file => file.name).join(" and ")}.`;
    } catch (error) {
      body.replaceChildren();
      told.textContent = "";
      trouble.tell(error);
    }
  }
}
