// @ts-check
// The machines that come with the program, with their pictures.
import {element, svg} from "./format.js";
import {drawing, extent} from "./stage.js";

/** @typedef {import("./app.js").App} App */

export const key = "gallery",
  name = "Gallery";

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const list = element("ul", {class: "gallery"});
  root.append(
    element("h2", {}, "Machines to start from"),
    element(
      "p",
      {class: "quiet"},
      "Each opens as a case of its own. The menu “Case” leads back to the case that you leave.",
    ),
    list,
  );
  let isThere = false;
  app.on("view", async () => {
    if (app.view !== key || isThere) return;
    isThere = true;
    const {head} = await app.wire.ask("gallery");
    const pictures = head.stages.map(stage => drawing(stage.scene));
    list.replaceChildren(
      ...head.stages.map((stage, k) => {
        pictures[k].root.setAttribute("aria-hidden", "true");
        return element(
          "li",
          {},
          element(
            "button",
            {
              type: "button",
              onclick: () => {
                app.open(stage.text, {name: stage.path.split("/").pop(), isBuiltIn: true});
                app.show("motion");
              },
            },
            pictures[k].root,
            element("strong", {}, stage.title),
            element("span", {class: "quiet"}, stage.path),
          ),
        );
      }),
    );
    // Each as it is in the midst of its first run, over the curves of that run.
    for (const [k, stage] of head.stages.entries()) {
      const run = await app.wire.ask("run", {text: stage.text});
      const times = run.columns.get("time");
      if (!times) continue;
      const row = Math.floor(0.22 * times.length);
      const value = name => (run.columns.get(name) || [])[row] || 0;
      pictures[k].move(value, value, 100, extent(run, stage.scene));
      pictures[k].root.after(curves(run));
    }
  });
}

/** The speeds of a run, small. @param {import("./wire.js").Answer} run */
function curves(run) {
  const names = run.head.panels.find(panel => panel.key === "speed").curves.map(curve => curve.key);
  const columns = names.map(name => run.columns.get(name) || new Float64Array(1)),
    all = columns.flatMap(column => [...column]);
  const low = Math.min(0, ...all),
    high = Math.max(low + 1e-12, ...all),
    wide = 200,
    tall = 40;
  const line = (column, k) =>
    svg("polyline", {
      fill: "none",
      class: k ? "s-verm" : "s-blue",
      "stroke-width": 1.2,
      points: Array.from({length: 200}, (_, i) => {
        const at = Math.round((i / 199) * (column.length - 1));
        return (
          `${((i / 199) * wide).toFixed(1)},`
          + `${(tall - 2 - ((tall - 4) * (column[at] - low)) / (high - low)).toFixed(1)}`
        );
      }).join(" "),
    });
  return svg(
    "svg",
    {viewBox: `0 0 ${wide} ${tall}`, preserveAspectRatio: "none", class: "spark", "aria-hidden": "true"},
    ...columns.map(line),
  );
}
