// @ts-check
// The motion as moving pictures: the machine, and the plots that are in sight, with the cursor running through them.
import {timeText} from "./format.js";
import {Gif, palette} from "./gif.js";

/** @typedef {import("./app.js").App} App */

/** Pictures, and hundredths of a second for each. */
const PICTURES = 80,
  DELAY = 6;
/** Pixels: of a picture, between its parts, of a line of text. */
const WIDTH = 800,
  GAP = 12,
  LINE = 20;
/** Plots at most, in two columns. */
const PLOTS = 4;

/** The file. @param {App} app @param {(share: number) => void} progress @returns {Promise<Blob>} */
export async function film(app, progress) {
  const {stage, plots} = app.scene || {};
  if (!app.run || !stage || !stage.drawing || !plots) throw new Error("There is no motion yet.");
  const [from, to] = app.window || [0, app.until],
    cursor = app.cursor;
  const shown = plots.plots.filter(plot => plot.isSeen).slice(0, PLOTS),
    canvas = document.createElement("canvas");
  const box = stage.drawing.root.viewBox.baseVal,
    tall = Math.round(((WIDTH - 2 * GAP) * box.height) / box.width),
    wide = (WIDTH - 3 * GAP) / 2;
  const rows = Math.ceil(shown.length / 2),
    heights = Array.from({length: rows}, (_, row) =>
      Math.max(...shown.slice(2 * row, 2 * row + 2).map(plot => LINE + (plot.height * wide) / plot.width)),
    );
  canvas.width = WIDTH;
  canvas.height = Math.round(GAP + LINE + tall + heights.reduce((sum, height) => sum + height + GAP, GAP));
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", {willReadFrequently: true}));
  const picture = async (/** @type {number} */ time) => {
    app.cursor = time;
    stage.move();
    const machine = await imageOf(stage.drawing.root, plots.colours);
    pen.fillStyle = plots.colours.paper;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.font = "600 14px system-ui, sans-serif";
    pen.fillStyle = plots.colours.ink;
    const clock = timeText(time, (to - from) / 1000);
    pen.fillText(app.run ? app.run.head.title : "", GAP, GAP + 12, WIDTH - 130);
    pen.textAlign = "right";
    pen.fillText(clock, WIDTH - GAP, GAP + 12);
    pen.textAlign = "left";
    pen.drawImage(machine, GAP, GAP + LINE, WIDTH - 2 * GAP, tall);
    let top = GAP + LINE + tall + GAP;
    for (let k = 0; k < shown.length; k++) {
      const plot = shown[k],
        left = GAP + (k % 2) * (wide + GAP);
      plot.catchUp();
      pen.fillText(`${plot.panel.title}${plot.panel.unit ? `, ${plot.panel.unit}` : ""}`, left, top + 13);
      for (const layer of [plot.canvas, plot.over])
        pen.drawImage(layer, left, top + LINE, wide, (plot.height * wide) / plot.width);
      if (k % 2) top += heights[(k - 1) / 2] + GAP;
    }
    return pen.getImageData(0, 0, canvas.width, canvas.height).data;
  };
  const timeOf = (/** @type {number} */ k) => from + ((to - from) * k) / (PICTURES - 1);
  try {
    const samples = [];
    for (const k of [0, 0.1, 0.3, 0.6, 1]) samples.push(await picture(timeOf(Math.round(k * (PICTURES - 1)))));
    const gif = new Gif(canvas.width, canvas.height, palette(samples));
    for (let k = 0; k < PICTURES; k++) {
      gif.add(await picture(timeOf(k)), DELAY);
      progress((k + 1) / PICTURES);
    }
    return new Blob([gif.end()], {type: "image/gif"});
  } finally {
    app.seek(cursor);
  }
}

/** The drawing as an image, its colours written at each element: an image knows no style of the page.
 * @param {SVGSVGElement} drawing @param {Object<string, string>} colours @returns {Promise<HTMLImageElement>} */
async function imageOf(drawing, colours) {
  const copy = /** @type {SVGSVGElement} */ (drawing.cloneNode(true)),
    {width, height} = drawing.viewBox.baseVal;
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", String(width));
  copy.setAttribute("height", String(height));
  for (const part of copy.querySelectorAll("*")) {
    if (part.tagName === "text") {
      part.setAttribute("fill", colours.ink);
      part.setAttribute("font-family", "system-ui, sans-serif");
      part.setAttribute("font-size", "13");
    }
    for (const name of part.classList) {
      const [, kind, colour] = /^([fs])-(\w+)$/.exec(name) || [];
      if (colours[colour]) part.setAttribute(kind === "f" ? "fill" : "stroke", colours[colour]);
    }
  }
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  return image;
}
