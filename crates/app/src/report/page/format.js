// Numbers, units and symbols as a reader expects them, and the elements that show them.

/** Units that take prefixes, as in mm or kN. */
const PREFIXED = new Set(["m", "s", "N", "N s", "N m", "N m s", "J", "W", "Pa"]);
const PREFIXES = [
  ["G", 1e9],
  ["M", 1e6],
  ["k", 1e3],
  ["", 1],
  ["m", 1e-3],
  ["µ", 1e-6],
  ["n", 1e-9],
];

/** The unit in which a magnitude is a number from 1 to 1000, and the factor to it from the SI unit. */
function scaleFor(unit, magnitude) {
  if (!PREFIXED.has(unit) || !(magnitude > 0)) return { unit: unit.replace("^p", "ᵖ"), factor: 1 };
  // Rounding must not turn 1 mm into 1000 µm.
  const fits = PREFIXES.find(([, size]) => magnitude * (1 + 1e-9) >= size);
  const [prefix, size] = fits ?? PREFIXES.at(-1);
  return { unit: prefix + unit, factor: 1 / size };
}

/** Significant digits of results. Settings are shown as they were stated. */
const DIGITS = 3;

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

/** A number with at most `digits` significant digits; with `padded`, zeros at its end count. */
function number(value, digits = 5, padded = false) {
  if (value === null) return "–";
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) {
    const [mantissa, exponent] = rounded.toExponential().split("e");
    const power = "10" + [...exponent.replace("+", "")].map((character) => RAISED[character]).join("");
    return (mantissa === "1" ? power : `${mantissa} · ${power}`).replace(/^-/, "−");
  }
  const [whole, decimals] = (padded && size < 10 ** digits ? rounded.toPrecision(digits) : String(rounded)).split(".");
  const grouped = size >= 1e4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
  return (decimals === undefined ? grouped : `${grouped}.${decimals}`).replace(/^-/, "−");
}

/** A number with its unit, as plain text. */
function withUnit(value, scale, digits) {
  const text = number(value === null ? null : value * scale.factor, digits);
  return scale.unit && value !== null ? `${text}\u202f${scale.unit}` : text;
}

/** The element of the page with this id. */
const byId = (id) => document.getElementById(id);

/** An element with attributes and content; attributes whose names start with `on` are listeners. */
function element(name, attributes = {}, ...content) {
  return build(document.createElement(name), attributes, content);
}

function svgElement(name, attributes = {}, ...content) {
  return build(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, content);
}

function build(node, attributes, content) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else node.setAttribute(key, value);
  }
  node.append(...content.flat());
  return node;
}

/** A symbol such as `F_n,w`, whose part after `_` becomes a subscript, or an expression such as `max F_n`. */
function symbol(text) {
  if (text.includes(" ")) return element("span", { class: "expression" }, ...rich(text));
  const [base, index] = text.split("_");
  return element("span", { class: "symbol" }, base, index ? element("sub", {}, index) : []);
}

/** A quantity with its symbol and unit, as the parts of a title. */
function titleParts(name, mark, unit) {
  return [name[0].toUpperCase() + name.slice(1), ...(mark ? [" ", symbol(mark)] : []), unit ? ` in ${unit}` : ""];
}

/** A row of a table: the parts of its heading, and cells. */
function tableRow(attributes, heading, ...cells) {
  return element("tr", attributes, element("th", { scope: "row" }, ...heading), ...cells);
}

/** A cell with a number, or with a symbol if there is one. */
const numberCell = (...content) => element("td", { class: "number" }, ...content);
const symbolCell = (mark) => element("td", {}, mark ? symbol(mark) : []);

/** Text in smaller, paler letters. */
const quiet = (...content) => element("span", { class: "quiet" }, ...content);

/** Does what `actions` have for a key that is pressed in `node`; elements in it have keys of their own. */
function onKeys(node, actions) {
  node.addEventListener("keydown", (event) => {
    if (event.target !== node || !actions[event.key]) return;
    event.preventDefault();
    actions[event.key](event);
  });
}

/** Text with minus signs, in which symbols are typeset: those with a subscript, `R`, `ω`, and a single letter before `=`. */
function rich(text) {
  const unbroken = text.replace(/ ([=>]) /g, "\u00a0$1\u00a0").replace(/(?<![^\s(])-(?=\d)/g, "−");
  return unbroken
    .split(/((?<![\p{L}\p{N}_])Δ?\p{L}\p{M}*_[a-z0-9]+(?:,[a-z0-9]+)*|(?<!\p{L})(?:[Rω](?!\p{L})|\p{L}(?=\u00a0=)))/u)
    // The symbols are the odd parts.
    .map((part, k) => (k % 2 === 1 ? symbol(part) : part));
}

/** Text of a drawing, in which symbols such as `F_n,w` have subscripts. */
function svgText(attributes, text) {
  const parts = text.split(/((?<![\p{L}\p{N}_])Δ?\p{L}\p{M}*_[a-z0-9]+(?:,[a-z0-9]+)*)/u).map((part, k) => {
    if (k % 2 === 0) return part;
    const [base, index] = part.split("_");
    // The empty part returns to the baseline.
    return [
      svgElement("tspan", { class: "symbol" }, base),
      svgElement("tspan", { dy: 3, "font-size": "75%" }, index),
      svgElement("tspan", { dy: -3 }, "\u200b"),
    ];
  });
  return svgElement("text", attributes, ...parts);
}

/** Unpacks numbers from 16-bit words. */
function unpack({ least, step, words }) {
  const bytes = Uint8Array.from(atob(words), (character) => character.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 2 }, (_, i) => least + step * view.getUint16(2 * i, true));
}

/** Data in which all packed numbers are unpacked. */
function unpackAll(data) {
  if (Array.isArray(data)) return data.map(unpackAll);
  if (data === null || typeof data !== "object") return data;
  if ("words" in data) return unpack(data);
  return Object.fromEntries(Object.entries(data).map(([key, value]) => [key, unpackAll(value)]));
}

/** Round values that divide the range from `low` to `high` into about `count` parts. */
function ticks(low, high, count) {
  const rough = (high - low) / count;
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough * 0.999) ?? rough;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
}

/** Viridis, in even steps of lightness: its order shows in grey too, and to readers with any colour vision. */
const VIRIDIS = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const VIRIDIS_PARTS = VIRIDIS.map((color) => [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16)));

/** The red, green and blue of the colour at a part of the range, 0 to 1. */
function colorParts(share) {
  const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const below = Math.min(Math.floor(place), VIRIDIS.length - 2);
  const mix = (a, b) => Math.round(a + (place - below) * (b - a));
  return VIRIDIS_PARTS[below].map((part, i) => mix(part, VIRIDIS_PARTS[below + 1][i]));
}

/** The colour at a part of the range, 0 to 1. */
function color(share) {
  return `rgb(${colorParts(share).join(" ")})`;
}

/** Black or white, whichever has more contrast to the colour at a part of the range (relative luminance of WCAG 2). */
function inkOn(share) {
  const linear = (part) => (part <= 10 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4);
  const [red, green, blue] = colorParts(share).map(linear);
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue > 0.179 ? "#000" : "#fff";
}
