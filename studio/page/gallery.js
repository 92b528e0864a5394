// @ts-check
// The machines that come with the program, with their pictures.
import {element} from "./format.js";
import {drawing} from "./stage.js";

/** @typedef {import("./app.js").App} App */

export const key = "gallery", name = "Gallery";

/** @param {HTMLElement} root @param {App} app */
export function mount(root, app) {
  const list = element("ul", {class: "gallery"});
  root.append(element("h2", {}, "Machines to start from"), element("p", {class: "quiet"}, "Each opens as a case of its own; nothing is saved."), list);
  let isThere = false;
  app.on("view", async () => {
    if (app.view !== key || isThere) return;
    isThere = true;
    const {head} = await app.wire.ask("gallery");
    list.replaceChildren(...head.stages.map(stage => {
      const picture = drawing(stage.scene);
      // As it stands: no curve has moved.
      picture.move(() => 0, () => 0, 1, {range: () => [0, 0], force: 1});
      picture.root.setAttribute("aria-hidden", "true");
      return element("li", {}, element("button", {type: "button", onclick: () => {
        app.open(stage.text, {name: stage.path.split("/").pop()});
        app.show("motion");
      }}, picture.root, element("strong", {}, stage.title), element("span", {class: "quiet"}, stage.path)));
    }));
  });
}
