// @ts-check
// A machine of the studio within another page, such as a lesson: <taut-stage case="table4.toml"></taut-stage>.
//
// `case` is the address of a case file; without it, the text within the element is the case. `view` names the view that
// opens: motion, modes, fit, tune, shape, sweep, gallery or tour.
import {fragment} from "./link.js";

const STYLE = `
  :host { display: block; height: 44rem; }
  :host([data-failed]) { height: auto; }
  iframe { width: 100%; height: 100%; border: 1px solid #8888; border-radius: 8px; box-sizing: border-box; }
`;

class TautStage extends HTMLElement {
  static observedAttributes = ["case", "view"];

  constructor() {
    super();
    const style = document.createElement("style");
    style.textContent = STYLE;
    this.frame = document.createElement("iframe");
    this.told = document.createElement("p");
    this.told.setAttribute("role", "alert");
    this.attachShadow({mode: "open"}).append(style, this.told, this.frame);
  }

  connectedCallback() {
    this.open();
  }

  attributeChangedCallback() {
    if (this.isConnected) this.open();
  }

  async open() {
    const file = this.getAttribute("case"),
      view = this.getAttribute("view") || "motion";
    let told = "";
    try {
      const name = (file || "").split(/[?#]/)[0].split("/").pop() || "studio.toml";
      const text = file ? await textOf(new URL(file, document.baseURI)) : this.textContent || "";
      this.frame.title = `${name} in taut studio`;
      this.frame.src = new URL("index.html", import.meta.url) + (await fragment({text, name, view}));
    } catch (error) {
      told = `${file} cannot be opened: ${/** @type {Error} */ (error).message}`;
    }
    this.told.textContent = told;
    this.told.hidden = !told;
    this.frame.hidden = !!told;
    this.toggleAttribute("data-failed", !!told);
  }
}

/** @param {URL} address */
async function textOf(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
  return answer.text();
}

customElements.define("taut-stage", TautStage);
