// @ts-check
// The machine, drawn and moved by what was computed: pulleys turn, teeth run, bodies slide, spans are coloured by their
// force. Stretch and the error between drive and load are magnified by a factor; nothing else is invented.
import {put, svg, tell} from "./element.js";
import {number} from "./pen.js";

const PITCH = 9; // of the teeth, in pixels of the drawing
const WORDS = new Map([
  [0, "stuck"],
  [1, "forward"],
  [-1, "backward"],
  [2, "slides"],
]);
const COLOUR = new Map([
  [0, "grey"],
  [1, "blue"],
  [-1, "verm"],
  [2, "green"],
]);

/** The drawing of a kind of machine.
 * @typedef {Object} Drawing
 * @property {SVGElement} root
 * @property {(value: (name: string) => number, state: (name: string) => number, factor: number,
 *   extent: Extent) => void} move */

/** How far things go: of each curve the least and the greatest value, and the largest force.
 * @typedef {{range: (name: string) => [number, number], force: number}} Extent */

/** @param {any} scene @returns {Drawing} */
export function drawing(scene) {
  return scene.kind === "axis" ? axis(scene) : gantry(scene);
}

/**
 * The range of each curve of a run, and the largest force.
 * @param {{columns: Map<string, Float64Array>}} run
 * @param {any} scene
 * @returns {Extent}
 */
export function extent(run, scene) {
  const range = name => {
    const values = run.columns.get(name) || new Float64Array(0);
    let low = 0,
      high = 0;
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return /** @type {[number, number]} */ ([low, high]);
  };
  const force = Math.max(1e-9, ...scene.spans.map(name => Math.max(...range(name).map(Math.abs))));
  return {range, force};
}

/** Gives a range that holds those it is given, and changes only where it has to, so that a drag does not shake the
 * drawing. */
function steady() {
  let [least, most] = [0, 0];
  return /** @param {[number, number]} range @returns {[number, number]} */ ([low, high]) => {
    const span = high - low,
      isInside = low >= least && high <= most;
    if (!isInside || span < 0.55 * (most - least)) [least, most] = [low - 0.04 * span, high + 0.04 * span];
    return [least, most];
  };
}

/** A span's colour and width: tight is blue, relieved vermillion, as strong as its share of the largest force.
 * @param {SVGElement} line @param {number} share */
function tension(line, share) {
  put(line, {
    class: `span ${share >= 0 ? "s-blue" : "s-verm"}`,
    "stroke-opacity": 0.3 + 0.7 * Math.min(1, Math.abs(share)),
    "stroke-width": 3 + 3 * Math.min(1, Math.abs(share)),
  });
}

/** A stretch of belt: its colour below, its teeth above. @param {SVGElement} root */
function belt(root) {
  const line = svg("path", {fill: "none", "stroke-linecap": "round"});
  const teeth = svg("path", {
    class: "s-ink teeth",
    fill: "none",
    "stroke-width": 3.4,
    "stroke-dasharray": `2 ${PITCH - 2}`,
  });
  root.append(line, teeth);
  return {
    line,
    teeth,
    /**
     * @param {string} d
     * @param {number} share
     * @param {number} offset of the teeth along the path
     * @param {number} pitch
     */
    set(d, share, offset, pitch = PITCH) {
      put(line, {d});
      tension(line, share);
      put(teeth, {d, "stroke-dasharray": `2 ${Math.max(1, pitch - 2)}`, "stroke-dashoffset": -(offset % pitch)});
    },
  };
}

/**
 * A pulley with spokes.
 * @param {SVGElement} root
 * @param {number} x
 * @param {number} y
 * @param {number} r
 * @param {string} name
 */
function pulley(root, x, y, r, name) {
  const wheel = svg("g", {});
  wheel.append(svg("circle", {r, class: "f-soft s-axis", "stroke-width": 1.5}));
  for (let k = 0; k < 5; k++) {
    const a = (2 * Math.PI * k) / 5;
    wheel.append(
      svg("line", {
        x1: 0.25 * r * Math.cos(a),
        y1: 0.25 * r * Math.sin(a),
        x2: 0.84 * r * Math.cos(a),
        y2: 0.84 * r * Math.sin(a),
        class: "s-axis",
        "stroke-width": 2,
      }),
    );
  }
  wheel.append(svg("circle", {cx: 0.84 * r, r: 2.6, class: "f-verm"}));
  const hub = svg("circle", {cx: x, cy: y, r: Math.max(4, 0.2 * r), class: "f-grey"});
  const label = svg("text", {x, y: y + r + 22, "text-anchor": "middle", class: "f-grey small"});
  root.append(wheel, hub, label);
  return {
    /** Moves it to another place. @param {number} u @param {number} v */
    place(u, v) {
      [x, y] = [u, v];
      put(hub, {cx: x, cy: y});
      put(label, {x, y: y + r + 22});
    },
    /** @param {number} angle clockwise on the picture @param {number} state @param {boolean} hasState */
    turn(angle, state, hasState = true) {
      put(wheel, {transform: `translate(${x} ${y}) rotate(${((angle * 180) / Math.PI) % 360})`});
      put(hub, {class: `f-${hasState ? COLOUR.get(state) || "grey" : "axis"}`});
      tell(label, hasState ? `${name}: ${WORDS.get(state) || ""}` : name);
    },
  };
}

// ---- The axis: drive pulley on the left as in the reports, x towards it

/** @param {any} scene @returns {Drawing} */
function axis(scene) {
  const W = 1000,
    H = 196,
    Y = 108,
    LEFT = 90,
    RIGHT = 910,
    CART = 92;
  const root = svg("svg", {viewBox: `0 0 ${W} ${H}`, role: "img"});
  const ground = svg("g", {});
  root.append(ground);
  const R = 40,
    top = Y - R,
    bottom = Y + R;
  const arcs = svg("path", {
    class: "s-ink",
    fill: "none",
    "stroke-width": 3,
    "stroke-opacity": 0.35,
    d: `M${LEFT} ${top}A${R} ${R} 0 0 0 ${LEFT} ${bottom}M${RIGHT} ${top}A${R} ${R} 0 0 1 ${RIGHT} ${bottom}`,
  });
  root.append(arcs);
  const spans = [belt(root), belt(root), belt(root)];
  const drive = pulley(root, LEFT, Y, R - 2, "drive"),
    idler = pulley(root, RIGHT, Y, R - 2, "idler");
  const forces = [0, 1, 2].map(() => svg("text", {"text-anchor": "middle", class: "f-mark small"}));
  root.append(...forces);
  const ghost = svg("rect", {
    width: CART,
    height: 50,
    rx: 6,
    class: "s-verm",
    fill: "none",
    "stroke-width": 1.6,
    "stroke-dasharray": "4 4",
  });
  const error = svg("text", {"text-anchor": "middle", class: "f-verm small"});
  const cart = svg("g", {});
  const box = svg("rect", {
    x: -CART / 2,
    y: -25,
    width: CART,
    height: 50,
    rx: 6,
    class: "f-paper s-ink",
    "stroke-width": 2,
  });
  const state = svg("text", {y: 5, "text-anchor": "middle", class: "small"});
  cart.append(
    box,
    svg("circle", {cx: -CART / 4, cy: 29, r: 5, class: "f-axis"}),
    svg("circle", {cx: CART / 4, cy: 29, r: 5, class: "f-axis"}),
    state,
  );
  root.append(ghost, cart, error);
  const way = svg("text", {"text-anchor": "middle", y: 139, class: "f-grey small"});
  root.append(way);
  const hold = steady();
  let frame = "",
    scale = 1,
    middle = 0;
  return {
    root,
    move(value, stateOf, factor, {range, force}) {
      const reach = range("cart_position"),
        [low, high] = scene.x || hold([Math.min(reach[0], -0.02), Math.max(reach[1], 0.02)]);
      const at = x => (LEFT + RIGHT) / 2 - (x - middle) * scale;
      const key = `${low} ${high}`;
      if (frame !== key) {
        frame = key;
        // Some room between the cart and the pulleys.
        scale = (RIGHT - LEFT - CART - 100) / (high - low);
        middle = (low + high) / 2;
        rail();
      }
      const x = value("cart_position"),
        first = value("drive_travel"),
        third = scene.radius * value("idler_angle");
      const place = at(x),
        away = value("error") * factor;
      put(cart, {transform: `translate(${place} ${top})`});
      put(box, {class: `f-paper s-${COLOUR.get(stateOf("cart_state")) || "ink"}`});
      tell(state, WORDS.get(stateOf("cart_state")) || "");
      // Where the drive says that the cart is: the error magnified.
      const told = Math.max(LEFT - 40, Math.min(RIGHT + 40, at(x - away)));
      put(ghost, {x: told - CART / 2, y: top - 25});
      put(error, {x: Math.max(120, Math.min(W - 120, place)), y: top - 38});
      tell(error, `x − r φ₁ = ${number(1e6 * value("error"), 4)} µm`);
      const strength = name => value(name) / force,
        stretch = name => factor * value(name) * scale;
      const [a, b] = [place - CART / 2, place + CART / 2];
      const pitch = (name, length) => PITCH * Math.max(0.4, Math.min(3, 1 + stretch(name) / Math.max(20, length)));
      // On the picture what goes to +x goes left, and the belt at the bottom the other way.
      spans[0].set(`M${LEFT} ${top}H${a}`, strength("span1_force"), a - LEFT, pitch("stretch1", a - LEFT));
      spans[1].set(`M${b} ${top}H${RIGHT}`, strength("span2_force"), 0, pitch("stretch2", RIGHT - b));
      spans[2].set(
        `M${LEFT} ${bottom}H${RIGHT}`,
        strength("span3_force"),
        (scale * (first + third)) / 2,
        pitch("stretch3", RIGHT - LEFT),
      );
      [
        [(LEFT + a) / 2, top - 12],
        [(b + RIGHT) / 2, top - 12],
        [(LEFT + RIGHT) / 2, bottom + 22],
      ].forEach(([u, v], k) => {
        put(forces[k], {x: u, y: v});
        tell(forces[k], `${number(value(`span${k + 1}_force`), 3)} N`);
      });
      // The rim goes as far as the belt on it, whatever the picture's scale.
      drive.turn((-scale * first) / (R - 2), stateOf("drive_state"));
      idler.turn((-scale * third) / (R - 2), stateOf("idler_state"));
      put(root, {
        "aria-label":
          `The axis: cart at ${number(1e3 * x, 5)} mm, ${state.textContent}; `
          + `drive pulley ${WORDS.get(stateOf("drive_state"))}, `
          + `idler pulley ${WORDS.get(stateOf("idler_state"))}`,
      });

      function rail() {
        ground.replaceChildren(
          svg("line", {x1: LEFT - 30, x2: RIGHT + 30, y1: top + 35, y2: top + 35, class: "s-grid", "stroke-width": 3}),
        );
        const span = high - low,
          by = 10 ** Math.floor(Math.log10(span / 2)),
          from = Math.ceil(low / by - 1e-9);
        for (let k = from; k * by <= high + 1e-9 * by; k++) {
          const u = at(k * by);
          ground.append(svg("line", {x1: u, x2: u, y1: top + 35, y2: top + 42, class: "s-axis", "stroke-width": 1}));
          if (k % Math.max(1, Math.ceil(span / by / 8)) === 0)
            ground.append(
              svg("text", {x: u, y: top + 56, "text-anchor": "middle", class: "f-grey small"}, number(1e3 * k * by, 4)),
            );
        }
        if (scene.x)
          for (const end of scene.x)
            ground.append(
              svg("line", {
                x1: at(end) + (end > middle ? -1 : 1) * (CART / 2 + 3),
                x2: at(end) + (end > middle ? -1 : 1) * (CART / 2 + 3),
                y1: top - 18,
                y2: top + 35,
                class: "s-mark",
                "stroke-width": 4,
              }),
            );
        put(way, {x: 176});
        tell(way, "← x, mm");
      }
    },
  };
}

// ---- Gantries in plan view, as in the reports: x up, y to the right

/** @param {any} scene @returns {Drawing} */
function gantry(scene) {
  const W = 900,
    H = 560,
    RAILS = [192, 708],
    FAR = 46,
    MOTORS = [
      [250, 480],
      [650, 480],
    ],
    R = 30,
    OUTER = [220, 680],
    INNER = [280, 620],
    I = 12;
  const isH = scene.kind === "h-frame",
    isDual = scene.kind === "dual-belt";
  const root = svg("svg", {viewBox: `0 0 ${W} ${H}`, role: "img"});
  for (const x of RAILS)
    root.append(svg("line", {x1: x, x2: x, y1: FAR - 20, y2: 520, class: "s-grid", "stroke-width": 5}));
  const bridge = svg("g", {});
  bridge.append(
    svg("rect", {
      x: RAILS[0] - 14,
      y: -46,
      width: RAILS[1] - RAILS[0] + 28,
      height: 92,
      rx: 6,
      class: "f-soft s-axis",
      "stroke-width": 1.4,
    }),
  );
  // On two lines: beside the rails there is no room for the large letters of a narrow screen.
  const bridgeState = svg("tspan", {x: RAILS[0] - 22, dy: "1.2em"}),
    beside = {x: RAILS[0] - 22, y: -3, "text-anchor": "end", class: "f-grey small"};
  bridge.append(svg("text", beside, "bridge:", bridgeState));
  root.append(bridge);
  const spans = scene.spans.map(() => belt(root));
  const idlers = svg("g", {});
  root.append(idlers);
  const ghost = svg("rect", {
    width: 96,
    height: 84,
    rx: 6,
    class: "s-verm",
    fill: "none",
    "stroke-width": 1.6,
    "stroke-dasharray": "4 4",
  });
  const cart = svg("rect", {width: 96, height: 84, rx: 6, class: "f-paper s-ink", "stroke-width": 2});
  const cartState = svg("text", {"text-anchor": "middle", class: "small"}),
    told = svg("text", {"text-anchor": "middle", class: "f-verm small"});
  root.append(ghost, cart, cartState, told);
  const drives = MOTORS.map(([x, y], side) =>
    pulley(root, x, y, R - 3, isH || isDual ? ["left", "right"][side] : ["A", "B"][side]),
  );
  // The cart's motor rides on the bridge.
  const CART_MOTOR = 290,
    CART_IDLER = 610;
  if (isDual) drives.push(pulley(root, CART_MOTOR, 0, 13, "cart"));
  const pulleys = isDual ? ["left", "right", "cart_pulley"] : ["left", "right"];
  const forces = scene.spans.map(() => svg("text", {class: "f-mark small"}));
  root.append(...forces);
  root.append(svg("text", {x: RAILS[1] + 40, y: isDual ? 60 : 250, class: "f-grey small"}, "x ↑  y →"));
  const hold = [steady(), steady()];
  return {
    root,
    move(value, stateOf, factor, {range, force}) {
      const [xs, ys] = [
        ["bridge_position", scene.x],
        ["cart_position", scene.y],
      ].map(([name, travel], k) => {
        const [low, high] = range(name);
        return travel || hold[k]([Math.min(low, -0.02), Math.max(high, 0.02)]);
      });
      const kx = 230 / (xs[1] - xs[0]),
        ky = 190 / (ys[1] - ys[0]),
        k = Math.min(kx, ky);
      const bridgeAt = x => 265 - (x - (xs[0] + xs[1]) / 2) * k,
        cartAt = y => 450 + (y - (ys[0] + ys[1]) / 2) * k;
      const x = value("bridge_position"),
        y = value("cart_position"),
        by = bridgeAt(x),
        cx = cartAt(y);
      put(bridge, {transform: `translate(0 ${by})`});
      tell(bridgeState, WORDS.get(stateOf("bridge_state")) || "");
      place(cart, cx, by);
      put(cart, {class: `f-paper s-${COLOUR.get(stateOf("cart_state")) || "ink"}`});
      place(ghost, cx - factor * value("y_error") * k, by + factor * value("x_error") * k);
      put(cartState, {x: cx, y: by + 5});
      tell(cartState, WORDS.get(stateOf("cart_state")) || "");
      put(told, {x: cx, y: by - 54});
      tell(told, `${number(1e6 * value("x_error"), 3)} µm, ${number(1e6 * value("y_error"), 3)} µm`);
      const UP = by - 15,
        LOW = by + 15,
        [l, r] = [cx - 48, cx + 48],
        share = name => value(name) / force;
      const travel = pulleys.map(name => scene.radius * value(`${name}_angle`) * k);
      idlers.replaceChildren();
      const idler = (u, v, size) =>
        idlers.append(svg("circle", {cx: u, cy: v, r: size, class: "f-paper s-axis", "stroke-width": 1.2}));
      const paths = isH ? hFrame() : isDual ? dualBelt() : coreXy();
      paths.forEach(([d, offset, u, v, anchor], i) => {
        spans[i].set(d, share(scene.spans[i]), offset);
        put(forces[i], {x: u, y: v, "text-anchor": anchor});
        tell(forces[i], `${number(value(scene.spans[i]), 3)} N`);
      });
      if (isDual) drives[2].place(CART_MOTOR, by);
      // Angles count clockwise but for drive A of CoreXY, and the left and the cart's of a dual belt.
      drives.forEach((drive, side) =>
        drive.turn(
          ((isH || side === 1 ? 1 : -1) * travel[side]) / (side === 2 ? 13 : R - 3),
          stateOf(`${pulleys[side]}_state`),
        ),
      );
      put(root, {
        "aria-label":
          `The gantry: bridge at ${number(1e3 * x, 5)} mm, ${WORDS.get(stateOf("bridge_state"))}; `
          + `cart at ${number(1e3 * y, 5)} mm, ${cartState.textContent}`,
      });

      /** @param {SVGElement} rect @param {number} u @param {number} v */
      function place(rect, u, v) {
        put(rect, {x: u - 48, y: v - 42});
      }
      // One belt: from the cart to a motor on either side, and from there round the far end and across the bridge.
      function hFrame() {
        const far = FAR + R;
        idler(MOTORS[0][0], far, R - 4);
        idler(MOTORS[1][0], far, R - 4);
        for (const [u, s] of [
          [INNER[0], 1],
          [INNER[1], -1],
        ]) {
          idler(u + s * I, LOW + I, I - 3);
          idler(u + s * I, UP - I, I - 3);
        }
        const near = side => {
          const u = INNER[side],
            s = side ? -1 : 1,
            end = side ? r : l;
          return `M${end} ${LOW}H${u + s * I}A${I} ${I} 0 0 ${side} ${u} ${LOW + I}V${MOTORS[side][1]}`;
        };
        const wrap =
          `M${INNER[0]} ${MOTORS[0][1]}A${R} ${R} 0 0 1 ${OUTER[0]} ${MOTORS[0][1]}`
          + `V${far}A${R} ${R} 0 0 1 ${INNER[0]} ${far}V${UP - I}`
          + `A${I} ${I} 0 0 0 ${INNER[0] + I} ${UP}H${INNER[1] - I}A${I} ${I} 0 0 0 ${INNER[1]} ${UP - I}`
          + `V${far}A${R} ${R} 0 0 1 ${OUTER[1]} ${far}`
          + `V${MOTORS[1][1]}A${R} ${R} 0 0 1 ${INNER[1]} ${MOTORS[1][1]}`;
        return [
          [near(0), travel[0], INNER[0] + 10, 420, "start"],
          [near(1), -travel[1], INNER[1] - 10, 420, "end"],
          [wrap, travel[0], INNER[0] + 10, 190, "start"],
        ];
      }
      // Two belts: each from the cart back to its motor, and out round the far end to the cart's other side.
      function coreXy() {
        const back = side => {
          const u = INNER[side],
            s = side ? -1 : 1,
            end = side ? r : l;
          idler(u + s * I, LOW + I, I - 3);
          return `M${end} ${LOW}H${u + s * I}A${I} ${I} 0 0 ${side} ${u} ${LOW + I}V${MOTORS[side][1]}`;
        };
        const out = side => {
          const s = side ? -1 : 1,
            top = side ? FAR + 30 : FAR,
            u = OUTER[side],
            o = INNER[1 - side],
            end = side ? l : r,
            w = side ? 0 : 1;
          idler(u + s * I, top + I, I - 3);
          idler(o - s * I, top + I, I - 3);
          idler(o - s * I, UP - I, I - 3);
          return (
            `M${INNER[side]} ${MOTORS[side][1]}A${R} ${R} 0 0 ${w} ${u} ${MOTORS[side][1]}`
            + `V${top + I}A${I} ${I} 0 0 ${w} ${u + s * I} ${top}H${o - s * I}`
            + `A${I} ${I} 0 0 ${w} ${o} ${top + I}V${UP - I}A${I} ${I} 0 0 ${w} ${o - s * I} ${UP}H${end}`
          );
        };
        return [
          [out(0), -travel[0], 450, FAR - 12, "middle"],
          [back(0), -travel[0], INNER[0] + 10, 420, "start"],
          [out(1), -travel[1], 450, FAR + 50, "middle"],
          [back(1), -travel[1], INNER[1] - 10, 420, "end"],
        ];
      }
      // Three belts: on either side one from its motor round the far end to the bridge and back, and one along the
      // bridge.
      function dualBelt() {
        const far = FAR + R,
          [top, bottom] = [by - 46, by + 46];
        const side = number => {
          const [u, o, w, y] = [INNER[number], OUTER[number], number ? 0 : 1, MOTORS[number][1]];
          idler(MOTORS[number][0], far, R - 4);
          return [
            `M${u} ${y}A${R} ${R} 0 0 ${w} ${o} ${y}V${far}A${R} ${R} 0 0 ${w} ${u} ${far}V${top}`,
            `M${u} ${bottom}V${y}`,
          ];
        };
        idler(CART_IDLER, by, 12);
        const [[leftOut, leftBack], [rightOut, rightBack]] = [side(0), side(1)];
        const cartOut = `M${CART_MOTOR} ${UP}H${CART_IDLER}A15 15 0 0 1 ${CART_IDLER} ${LOW}H${r}`;
        const cartBack = `M${l} ${LOW}H${CART_MOTOR}A15 15 0 0 1 ${CART_MOTOR} ${UP}`;
        return [
          [leftOut, -travel[0], INNER[0] + 10, 130, "start"],
          [leftBack, -travel[0], INNER[0] + 10, 430, "start"],
          [rightOut, -travel[1], INNER[1] - 10, 130, "end"],
          [rightBack, -travel[1], INNER[1] - 10, 430, "end"],
          [cartOut, -travel[2], 730, by - 6, "start"],
          [cartBack, -travel[2], 730, by + 16, "start"],
        ];
      }
    },
  };
}
