// @ts-check
// The stops of the tour: figures of the paper, what they show, and a question that is answered by dragging.

/** @typedef {import("./wire.js").Answer} Answer */

/** Something to try at a stop: other values, or another experiment.
 * @typedef {{words: string, set?: [string, number][], experiment?: number}} Try */

/** What a question is about, of the run as it is and the run with which the stop begins, and the values of the
 * parameters of its sliders now and then.
 * @typedef {{run: Answer, first: Answer, ratio: (key: string) => number, value: (key: string) => number}} Seen */

/** A question: the keys of its sliders, what is read from the run meanwhile, when it is answered, and the answer.
 * @typedef {Object} Question
 * @property {string} words
 * @property {string[]} keys
 * @property {(seen: Seen) => [string, number, string]} reading name, value and unit
 * @property {string} [none] what is read where there is no such value
 * @property {(seen: Seen) => boolean} isAnswered
 * @property {string} answer */

/** A stop: figures of the paper, the sentence that they support, the case that shows it (with a change of its text,
 * where there is one), the plot that is shown, or of another view the heading of its figure, and what is asked.
 * @typedef {Object} Stop
 * @property {string} figure
 * @property {string} title
 * @property {string} words
 * @property {string} stage
 * @property {[string, string]} [change]
 * @property {string} [view]
 * @property {string} panel
 * @property {Try[]} tries
 * @property {number} [at]
 * @property {number} [factor]
 * @property {[number, number]} [window]
 * @property {Question} question */

const CART = "cart.friction.viscous",
  DRY = "cart.friction.coulomb",
  PULSE = "experiment.0.input.pulse";
const SPANS = ["belt.stiffness.0", "belt.stiffness.1", "belt.stiffness.2"];

/** All three spans times a factor, of Table 1. @param {number} factor @returns {[string, number][]} */
const stiffness = factor => [265520, 265520, 117770].map((k, span) => [SPANS[span], factor * k]);

/** Both pulleys. @param {number} factor @returns {[string, number][]} */
const inertia = factor => [
  ["drive_pulley.inertia", factor * 7e-5],
  ["idler_pulley.inertia", factor * 7e-5],
];

/** Friction everywhere. @param {number} factor @returns {[string, number][]} */
const friction = factor => [
  ["drive_pulley.friction.viscous", factor * 0.0042],
  ["idler_pulley.friction.viscous", factor * 0.0042],
  [CART, factor * 40.6518],
];

/** The cart's friction with an excess at the start. @type {[string, string]} */
const STRIBECK = ['coulomb = "0.2000 N"', 'coulomb = "0.2000 N", stribeck = { force = "1 N", velocity = "20 mm/s" }'];

/** @param {Answer} run @param {string} name */
const last = (run, name) => (run.columns.get(name) || new Float64Array(1)).at(-1) || 0;
/** @param {Answer} run @param {string} name */
const largest = (run, name) =>
  (run.columns.get(name) || new Float64Array(1)).reduce((most, value) => Math.max(most, Math.abs(value)), 0);
/** How many times as far the cart goes as at the beginning. @param {Seen} seen */
const farther = ({run, first}) => last(run, "cart_position") / last(first, "cart_position");
/** True if a value is five times what it was, or a fifth, or further. @param {number} ratio */
const isFarOff = ratio => ratio >= 5 || ratio <= 0.2;
/** When the cart comes to rest for good, s. @param {Answer} run */
const rest = run => {
  const stops = run.head.events.filter(event => event.part === "cart" && event.to === "stuck");
  return stops.length ? stops.at(-1).time : Infinity;
};

/** @type {(seen: Seen) => [string, number, string]} */
const readFarther = seen => ["The cart goes", farther(seen), "times as far"];
/** @type {(seen: Seen) => [string, number, string]} */
const readEnd = ({run}) => ["The cart ends at", 1e3 * last(run, "cart_position"), "mm"];
/** @type {(seen: Seen) => [string, number, string]} */
const readError = ({run}) => ["Drive and cart differ by up to", 1e6 * largest(run, "error"), "µm"];

/** @type {Stop[]} */
export const STOPS = [
  {
    figure: "Figures 1 and 2",
    title: "The stage and its model",
    stage: "table4.toml",
    panel: "error",
    factor: 1000,
    at: 0.05,
    words:
      "A geared DC motor turns one of two pulleys, and a toothed belt pulls the cart along its guide. The model has "
      + "three inertias, the pulleys and the cart, and between them the three spans of the belt as springs: equations "
      + "(1) to (3).",
    tries: [{words: "a belt twenty times softer in span 1", set: [[SPANS[0], 6638]]}],
    question: {
      words: "How soft may span 1 become before the cart is 100 µm away from where the drive pulley says?",
      keys: [SPANS[0]],
      reading: readError,
      isAnswered: ({run}) => largest(run, "error") >= 1e-4,
      answer:
        "Span 1 pulls the cart, so that its stretch is the difference between drive and cart. A model of a rigid "
        + "stage has no such difference; this one has it from the first guess of Table 1 on.",
    },
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
      "Where the belt has teeth it is much stiffer than between them. The two are springs in series, so the thin "
      + "section decides: k = AE/l, equations (11) to (13). The longest span is the softest.",
    tries: [{words: "half the modulus, as in Table 2", set: stiffness(0.5)}],
    question: {
      words: "Span 3 is the longest. How much stiffer has it to be to stretch by half as much?",
      keys: [SPANS[2]],
      reading: ({run}) => ["Span 3 stretches by up to", 1e6 * largest(run, "stretch3"), "µm"],
      isAnswered: ({run, first}) => largest(run, "stretch3") <= 0.5 * largest(first, "stretch3"),
      answer:
        "More than twice as stiff: the stiffer it is, the more of the pull goes through it. The paper computes all "
        + "three spans from one modulus, so that they change together.",
    },
  },
  {
    figure: "Figures 4 and 5",
    title: "A pulse, with the first guess",
    stage: "table1.toml",
    panel: "position",
    at: 0.25,
    words:
      "5 V, and then 10 V, for a quarter of a second, with the values of Table 1. The simulated motor answers in the "
      + "shape of the real one, and ends short of it. What was measured was not published as data: these are the "
      + "simulated curves.",
    tries: [
      {words: "10 V", experiment: 1},
      {words: "friction of a half", set: friction(0.5)},
    ],
    question: {
      words: "The real cart went farther. Which friction of the cart takes this one to 40 mm?",
      keys: [CART],
      reading: readEnd,
      isAnswered: ({run}) => last(run, "cart_position") >= 0.04,
      answer:
        "Less of it, by a third. The authors went the same way: Table 2, matched to the pulse of 5 V, has half the "
        + "friction of Table 1 at the cart and at both pulleys.",
    },
  },
  {
    figure: "Figures 6 and 7",
    title: "Stiffness and position",
    stage: "table1.toml",
    panel: "position",
    at: 0.25,
    words:
      "One parameter at a time is doubled and halved. Twice and half the stiffness do not change the position by "
      + "anything that could be seen: the dotted line, the run before, lies under the new one.",
    tries: [
      {words: "twice the stiffness", set: stiffness(2)},
      {words: "half the stiffness", set: stiffness(0.5)},
    ],
    question: {
      words: "Can the stiffness of a span move the end of the cart by 1 %? Try five times as much, and a fifth.",
      keys: SPANS,
      reading: readFarther,
      isAnswered: ({ratio}) => SPANS.some(key => isFarOff(ratio(key))),
      answer:
        "It cannot. The spans store what they take and give it back; where the cart ends depends on what is lost. "
        + "Figures 6 and 7 show the same.",
    },
  },
  {
    figure: "Figures 8 and 9",
    title: "Stiffness and speed",
    stage: "table1.toml",
    panel: "speed",
    at: 0.005,
    window: [0, 0.03],
    words:
      "In the speed, the swing of the belt on top of the motion changes, and hardly more than that: a stiffer belt "
      + "swings faster and less.",
    tries: [
      {words: "twice the stiffness", set: stiffness(2)},
      {words: "half the stiffness", set: stiffness(0.5)},
    ],
    question: {
      words: "Make span 1 stiffer until drive and cart differ by half as much. What becomes of the swing?",
      keys: [SPANS[0]],
      reading: readError,
      isAnswered: ({run, first}) => largest(run, "error") <= 0.5 * largest(first, "error"),
      answer:
        "It becomes faster and smaller, and the speed behind it stays: Figures 8 and 9 show that for twice and half "
        + "the stiffness.",
    },
  },
  {
    figure: "Figures 10 and 11",
    title: "Inertia",
    stage: "table1.toml",
    panel: "speed",
    at: 0.01,
    words:
      "More inertia makes the answer slower, and the run-out after the pulse longer by as much, so that the end is the "
      + "same. That holds while friction is viscous alone.",
    tries: [
      {words: "pulleys twice as heavy", set: inertia(2)},
      {words: "pulleys half as heavy", set: inertia(0.5)},
      {words: "all twice as heavy", set: [...inertia(2), ["cart.mass", 0.724]]},
    ],
    question: {
      words: "Make the cart five times as heavy. Where does it end?",
      keys: ["cart.mass", "drive_pulley.inertia"],
      reading: readEnd,
      isAnswered: ({ratio}) => ratio("cart.mass") >= 5,
      answer:
        "Where it ended before: it is later in gaining speed and as much later in losing it. Figures 10 and 11 show "
        + "that for the pulleys.",
    },
  },
  {
    figure: "Figures 12 and 13",
    title: "Friction",
    stage: "table1.toml",
    panel: "position",
    at: 0.25,
    words:
      "Friction has by far the largest influence: twice as much of it nearly halves the way, half as much nearly "
      + "doubles it.",
    tries: [
      {words: "twice the friction", set: friction(2)},
      {words: "half the friction", set: friction(0.5)},
    ],
    question: {
      words: "How much friction of the cart alone makes it go half as far?",
      keys: [CART, "drive_pulley.friction.viscous"],
      reading: readFarther,
      isAnswered: seen => farther(seen) <= 0.5,
      answer:
        "Between two and three times as much, as the pulleys keep theirs. Twice the friction everywhere nearly halves "
        + "the way: Figures 12 and 13.",
    },
  },
  {
    figure: "Figures 14 and 15",
    title: "Matched at 5 V",
    stage: "table2.toml",
    panel: "position",
    at: 0.25,
    words:
      "Table 2 was matched to the pulse of 5 V. A linear model goes exactly twice as far at 10 V, whatever its numbers "
      + "are, and the real stage does not: one set of linear parameters does not serve both.",
    tries: [{words: "10 V", experiment: 1}],
    question: {
      words: "How many volts take the cart twice as far?",
      keys: [PULSE],
      reading: readFarther,
      isAnswered: seen => Math.abs(farther(seen) - 2) <= 0.04,
      answer:
        "10 V, and no friction, mass or stiffness would change that: the model is linear. The real stage went farther "
        + "than twice as far.",
    },
  },
  {
    figure: "Figure 16",
    title: "Three parts of friction",
    stage: "table4.toml",
    change: STRIBECK,
    view: "modes",
    panel: "Friction over speed",
    words:
      "Friction against speed, equation (14): a part that grows with speed, a part that only knows the direction "
      + "(Coulomb), and an excess at the start of a motion that is soon gone (Stribeck). The figure shows the curve of "
      + "the cart, which has such an excess here, drawn large.",
    tries: [],
    question: {
      words: "Which of the two sliders takes the peak beside zero speed away?",
      keys: ["cart.friction.stribeck.force", CART],
      reading: ({value}) => ["The excess is", value("cart.friction.stribeck.force"), "N"],
      isAnswered: ({ratio}) => ratio("cart.friction.stribeck.force") <= 0.2,
      answer: "The force of the Stribeck part. What is left has the two parts of equation (15).",
    },
  },
  {
    figure: "Figure 17",
    title: "Two of them are kept",
    stage: "table4.toml",
    view: "modes",
    panel: "Friction over speed",
    words:
      "The Stribeck part is called minor and left out: what remains, equation (15), jumps at zero speed and rises from "
      + "there.",
    tries: [
      {words: "no dry friction at the cart", set: [[DRY, 0]]},
      {words: "ten times as much", set: [[DRY, 2]]},
    ],
    question: {
      words: "One slider moves the jump, the other the slope. Make the jump twice as high.",
      keys: [CART, DRY],
      reading: ({value}) => ["The jump is", 2 * value(DRY), "N"],
      isAnswered: ({ratio}) => ratio(DRY) >= 2,
      answer:
        "The Coulomb part is the jump: it opposes the motion with the same force at any speed. The viscous part is the "
        + "slope.",
    },
  },
  {
    figure: "Figures 18 and 19",
    title: "Friction must not push",
    stage: "table4.toml",
    panel: "state",
    at: 0.4,
    words:
      "Block diagrams of equations (16) to (18). Friction may hold a body and never turn it round: Table 3 sees to "
      + "that by a band of speeds about zero. Here a body that comes to rest sticks until its load breaks it loose; "
      + "the strip shows when.",
    tries: [{words: "no dry friction at the cart", set: [[DRY, 0]]}],
    question: {
      words: "How much dry friction brings the cart to rest within 30 ms of the end of the pulse, by 0.28 s?",
      keys: [DRY],
      reading: ({run}) => ["The cart rests from", 1e3 * rest(run), "ms on"],
      none: "The cart is not held anywhere.",
      isAnswered: ({run}) => rest(run) <= 0.28,
      answer:
        "Several times as much. Once at rest the cart stays there: the belt's force is below what friction can hold. "
        + "Without the rule of Table 3 friction would push it back and forth.",
    },
  },
  {
    figure: "Figures 20 and 21",
    title: "One set for both voltages",
    stage: "table4.toml",
    panel: "position",
    at: 0.4,
    words:
      "With the Coulomb friction of Table 4 one set of numbers serves 5 V and 10 V. Dry friction takes its share of "
      + "the first volts: twice the voltage moves the cart 2.3 times as far.",
    tries: [
      {words: "10 V", experiment: 1},
      {words: "no dry friction at the drive pulley", set: [["drive_pulley.friction.coulomb", 0]]},
    ],
    question: {
      words: "How many volts take the cart twice as far now?",
      keys: [PULSE],
      reading: readFarther,
      isAnswered: seen => Math.abs(farther(seen) - 2) <= 0.04,
      answer:
        "About 9 V: dry friction takes the same from every pulse, which is less of a large one. That is why one set of "
        + "numbers serves both voltages: Figures 20 and 21.",
    },
  },
];
