// The overview: a map over two swept settings, or a curve over one, and the values of the case under the pointer.

const RATIO = "contact_time_ratio";
const FORCE = "tool_contact_normal_force_n";
const AMPLIFICATION = "lateral_amplification";
const UNSTABLE = "laterally_unstable";
const INTERACTION = "interaction_factor";
/** Prefix of the keys of shares in the variance of the tool force. */
const SHARE = "sobol_";
/** Font size of the numbers in cells, their width per character, and the least room around them, in pixels. */
const CELL_NUMBER = { size: 11, character: 6.4, room: 6 };
/** Least length of the axis of a curve, as a part of its largest value: smaller changes look as small as they are. */
const LEAST_PART = 0.01;
/** Least ratio of the values of a setting that lie on a logarithmic axis. */
const DECADES = 100;
/** Number of quantities on the card; they come in the order of importance. */
const ON_CARD = 8;

/** Finds the range of each quantity, its coordinates, and the unit that suits it. */
function findRanges(quantities) {
  for (const quantity of quantities) {
    // Zero has no place on a logarithmic scale; it is shown at the lower end.
    const onScale = (value) => value !== null && (value > 0 || !quantity.logarithmic);
    const known = quantity.values.filter(onScale);
    quantity.coordinate = (value) => (quantity.logarithmic ? Math.log10(Math.max(value, quantity.low)) : value);
    quantity.low = known.reduce((a, b) => Math.min(a, b), Infinity);
    quantity.high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    const largest = Math.max(Math.abs(quantity.low), Math.abs(quantity.high));
    quantity.scale = scaleFor(quantity.unit, known.length > 0 ? largest : 0);
    // A share is shown on its whole range.
    if (quantity.range) [quantity.low, quantity.high] = quantity.range;
  }
}

/** Returns `true` if a case is laterally unstable; `false` for brushes, of which that is not known. */
function isUnstable(study, index) {
  return study.quantities.find(({ key }) => key === UNSTABLE)?.values[index] === 1;
}

/** Shows the overview; `open` is called with the case that the reader chooses. */
function createOverview(study, grid, open) {
  const long = grid.axes.filter((axis) => axis.values.length > 1);
  if (long.length === 0) return { markOpen() {} };
  byId("overview").hidden = false;

  const across = long.find((axis) => [VELOCITY, SPEED].includes(axis.path)) ?? long.at(-1);
  const rest = long.filter((axis) => axis !== across);
  const upward = rest.find((axis) => [DEPTH, PRESSED].includes(axis.path)) ?? rest.at(-1) ?? null;
  const sliced = rest.filter((axis) => axis !== upward);
  const [acrossAt, upwardAt] = [grid.axes.indexOf(across), grid.axes.indexOf(upward)];
  const errors = new Map(study.errors);
  const kept = new Set(study.courses.map(([index]) => index));
  const quantities = study.quantities;
  /** Layers of a map beside its colours: lines at a level of some quantity, laterally unstable cases, and numbers. */
  const layers = [
    { id: "tier", name: "ε_tc = ½", of: RATIO, level: study.sweeping_above, text: "ε_tc = ½, between striking and sweeping" },
    {
      id: "stability",
      name: "lateral stability",
      of: AMPLIFICATION,
      level: study.unstable_above,
      text: `lateral amplification ${study.unstable_above}, laterally unstable above`,
    },
    { id: "interaction", name: "interaction factor 1", of: INTERACTION, level: 1, text: "interaction factor 1" },
    { id: "numbers", name: "numbers" },
  ]
    .map((layer) => ({ ...layer, of: layer.of && quantities.find(({ key }) => key === layer.of) }))
    .filter(({ id, of }) => of || id === "numbers");
  const unstable = new Set([...quantities[0].values.keys()].filter((index) => isUnstable(study, index)));

  const map = byId("map");
  const [canvas, drawing] = [map.querySelector("canvas"), map.querySelector("svg")];
  /** The position on each axis of the case under the pointer, which also selects the slice. */
  const places = grid.axes.map((axis) => Math.floor((axis.values.length - 1) / 2));
  let quantity = quantities[0];
  let opened = null;
  let layout = null;

  const at = (i, j) => grid.index(places.map((place, k) => (k === acrossAt ? i : k === upwardAt ? j : place)));
  const rows = upward ? upward.values.length : 1;
  const columns = across.values.length;
  /** The places of all cells, row by row. */
  const cells = Array.from({ length: rows * columns }, (_, k) => [k % columns, Math.floor(k / columns)]);

  function addChoices() {
    const select = byId("quantity");
    for (const { key, name } of quantities) {
      select.append(element("option", { value: key }, ...titleParts(name)));
    }
    select.value = quantity.key;
    select.addEventListener("change", () => {
      quantity = quantities.find(({ key }) => key === select.value);
      draw();
    });
    for (const layer of upward ? layers : []) {
      const { id, name } = layer;
      layer.box = element("input", { type: "checkbox", id: `layer-${id}`, checked: "", onchange: draw });
      byId("layers").append(element("label", {}, layer.box, element("span", {}, ...rich(name))));
    }
    byId("layers").hidden = !upward;
    for (const axis of sliced) {
      const place = grid.axes.indexOf(axis);
      const options = axis.values.map((_, i) => element("option", { value: i }, axisText(axis, i)));
      const choose = element(
        "select",
        { "data-path": axis.path, onchange: () => ((places[place] = Number(choose.value)), draw()) },
        ...options,
      );
      choose.value = places[place];
      byId("choices").append(element("label", {}, shortName(axis), " ", axis.symbol ? symbol(axis.symbol) : [], " ", choose));
    }
    byId("choices").addEventListener("submit", (event) => event.preventDefault());
  }

  /** Sizes in pixels, from the available width. */
  function measure() {
    const width = map.clientWidth;
    const names = upward?.names ? upward.values.map((_, j) => tickText(upward, j).length) : [];
    const [left, right, top, bottom] = [upward ? Math.max(50, 26 + 7 * Math.max(0, ...names)) : 64, 8, 8, 44];
    // Before the page has been laid out the width is zero.
    const inner = Math.max(0, width - left - right);
    const wanted = upward ? Math.min(inner * 0.66, rows * 64) : inner * 0.5;
    const height = Math.round(Math.min(Math.max(wanted, 190), 460));
    layout = { width, left, top, inner, height, total: height + top + bottom };
    // On paper it is narrower.
    map.style.aspectRatio = `${width} / ${layout.total}`;
    drawing.setAttribute("viewBox", `0 0 ${width} ${layout.total}`);
  }

  const cellWidth = () => layout.inner / columns;
  const cellHeight = () => layout.height / rows;
  const left = (i) => layout.left + i * cellWidth();
  const top = (j) => layout.top + layout.height - (j + 1) * cellHeight();

  function drawCells() {
    const density = window.devicePixelRatio || 1;
    canvas.width = Math.round(layout.width * density);
    canvas.height = Math.round(layout.total * density);
    const context = canvas.getContext("2d");
    const styles = getComputedStyle(document.documentElement);
    const [failed, failedInk] = ["--failed", "--failed-ink"].map((name) => styles.getPropertyValue(name));
    // Edges on whole pixels, so that no seam shows.
    const x = Array.from({ length: columns + 1 }, (_, i) => Math.round(left(i) * density));
    const y = Array.from({ length: rows + 1 }, (_, j) => Math.round(top(j - 1) * density));
    for (const [i, j] of cells) {
      const value = quantity.values[at(i, j)];
      context.fillStyle = value === null ? failed : color(shareOf(value));
      context.fillRect(x[i], y[j + 1], x[i + 1] - x[i], y[j] - y[j + 1]);
      if (value === null && cellWidth() > 8 && cellHeight() > 8) {
        context.strokeStyle = failedInk;
        context.lineWidth = 1.5 * density;
        const [centreX, centreY, reach] = [(x[i] + x[i + 1]) / 2, (y[j] + y[j + 1]) / 2, 4 * density];
        context.beginPath();
        context.moveTo(centreX - reach, centreY - reach);
        context.lineTo(centreX + reach, centreY + reach);
        context.moveTo(centreX + reach, centreY - reach);
        context.lineTo(centreX - reach, centreY + reach);
        context.stroke();
      }
    }
  }

  /** Returns `true` if a layer is shown. */
  const isShown = (id) => layers.some((layer) => layer.id === id && layer.box.checked);

  /** The part of the colours at a value. */
  function shareOf(value) {
    const [low, high] = [quantity.low, quantity.high].map(quantity.coordinate);
    return high > low ? (quantity.coordinate(value) - low) / (high - low) : 0.5;
  }

  /** Lines on which a quantity has a level, between the middles of the cells. */
  function separatingLine({ of, level }) {
    const middle = (i, j) => [left(i) + cellWidth() / 2, top(j) + cellHeight() / 2];
    let path = "";
    for (let j = 0; j + 1 < rows; j++) {
      for (let i = 0; i + 1 < columns; i++) {
        const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([right, up]) => [i + right, j + up]);
        const above = corners
          .map(([a, b]) => of.values[at(a, b)])
          .map((value) => (value === null ? NaN : of.coordinate(value) - of.coordinate(level)));
        if (above.some(Number.isNaN)) continue;
        const crossings = corners.flatMap((corner, k) => {
          const [here, next] = [above[k], above[(k + 1) % 4]];
          if (here > 0 === next > 0) return [];
          const [[x0, y0], [x1, y1]] = [middle(...corner), middle(...corners[(k + 1) % 4])];
          const share = here / (here - next);
          return [[x0 + share * (x1 - x0), y0 + share * (y1 - y0)]];
        });
        for (let k = 0; k + 1 < crossings.length; k += 2) {
          const [from, to] = [crossings[k], crossings[k + 1]].map((point) => point.map((value) => value.toFixed(1)));
          path += `M${from}L${to}`;
        }
      }
    }
    return path;
  }

  function drawMapAxes() {
    const bottom = layout.top + layout.height;
    const labels = across.values.map((_, i) => tickText(across, i));
    const widest = Math.max(...labels.map((label) => label.length)) * 7 + 10;
    for (const i of labelledPlaces(across, Math.floor(layout.inner / widest))) {
      const x = left(i) + cellWidth() / 2;
      drawing.append(
        svgElement("line", { class: "axis", x1: x, x2: x, y1: bottom, y2: bottom + 4 }),
        svgText({ x, y: bottom + 17, "text-anchor": "middle" }, labels[i]),
      );
    }
    for (const j of labelledPlaces(upward, Math.floor(layout.height / 16))) {
      const y = top(j) + cellHeight() / 2;
      drawing.append(
        svgElement("line", { class: "axis", x1: layout.left - 4, x2: layout.left, y1: y, y2: y }),
        svgText({ x: layout.left - 7, y: y + 4, "text-anchor": "end" }, tickText(upward, j)),
      );
    }
    nameAxes(axisLabel(upward));
  }

  function nameAxes(vertical) {
    const [x, y] = [layout.left + layout.inner / 2, layout.top + layout.height / 2];
    drawing.append(
      svgText({ x, y: layout.total - 6, "text-anchor": "middle" }, axisLabel(across)),
      svgText({ "text-anchor": "middle", transform: `translate(12 ${y}) rotate(-90)` }, vertical),
    );
  }

  /** The measured points that are shown; on a curve only those of its quantity. */
  function measuredPoints() {
    if (!upward && quantity.key !== FORCE) return [];
    return measuredIn(study, places, [acrossAt, upwardAt]);
  }

  /**
   * The ends of the vertical axis of the curve, as coordinates: powers of ten, or zero unless all values are far from it, in which
   * case the axis begins where they are.
   */
  function curveRange() {
    const { low, high, logarithmic, coordinate } = quantity;
    if (!logarithmic) {
      const ends = measuredPoints().flatMap(({ force, std }) => [force - (std ?? 0), force + (std ?? 0)]);
      const [least, largest] = [Math.min(low, ...ends), Math.max(high, ...ends)];
      if (least <= 0.5 * largest && largest >= 0.5 * least) return [Math.min(0, least), Math.max(0, largest)];
      const more = Math.max(0, LEAST_PART * Math.max(-least, largest) - (largest - least));
      const margin = 0.04 * (largest - least + more) + more / 2;
      return [least - margin, largest + margin];
    }
    // Without a value above zero there is no range.
    if (!(high > 0)) return [0, 1];
    const first = Math.floor(coordinate(low));
    return [first, Math.max(Math.ceil(coordinate(high)), first + 1)];
  }

  /** Returns `true` if the values of the horizontal axis of the curve span decades. */
  const spansDecades = Math.min(...across.values) > 0 && Math.max(...across.values) >= DECADES * Math.min(...across.values);
  const acrossPlace = (value) => (spansDecades ? Math.log10(value) : value);
  const acrossRange = () => [Math.min, Math.max].map((end) => acrossPlace(end(...across.values)));

  /** Where a value of the only axis and one of the quantity lie in the curve; failed cases lie on the axis. */
  function curvePoint(i) {
    return curvePlace(across.values[i], quantity.values[at(i, 0)]);
  }

  function curvePlace(x, value) {
    const [first, last] = acrossRange();
    const [low, high] = curveRange();
    const rise = value === null || high === low ? 0 : Math.max((quantity.coordinate(value) - low) / (high - low), 0);
    const pad = 12;
    return [
      layout.left + pad + ((acrossPlace(x) - first) / (last - first)) * (layout.inner - 2 * pad),
      layout.top + layout.height - rise * (layout.height - pad),
    ];
  }

  function drawCurve() {
    const bottom = layout.top + layout.height;
    const { factor } = quantity.scale;
    const [low, high] = curveRange().map((end) => (quantity.logarithmic ? end : end * factor));
    const decades = () => ticks(low, high, Math.min(high - low, 6)).filter(Number.isInteger);
    const marks = quantity.logarithmic ? decades() : ticks(low, high, 5);
    for (const value of high > low ? marks : [0]) {
      const y = bottom - (high > low ? ((value - low) / (high - low)) * (layout.height - 12) : 0);
      drawing.append(
        svgElement("line", { class: "axis", x1: layout.left, x2: layout.left + layout.inner, y1: y, y2: y }),
        svgText(
          { x: layout.left - 7, y: y + 4, "text-anchor": "end" },
          number(quantity.logarithmic ? 10 ** value : value, 4),
        ),
      );
    }
    // Powers of ten of the unit that is shown, or its round values; names have their places.
    const named = across.names ? [...labelledPlaces(across, Math.max(2, Math.floor(layout.inner / 130)))] : null;
    const inUnit = across.values.map((value) => acrossPlace(value * across.scale.factor));
    const [first, last] = [Math.min(...inUnit), Math.max(...inUnit)];
    const round = named ?? ticks(first, last, Math.max(2, layout.inner / 90));
    for (const value of spansDecades ? round.filter(Number.isInteger) : round) {
      const shown = spansDecades ? 10 ** value : value;
      const [x] = curvePlace(shown / across.scale.factor, null);
      const anchor = !named ? "middle" : value === first ? "start" : value === last ? "end" : "middle";
      const text = named ? tickText(across, value) : number(shown, 4);
      drawing.append(svgText({ x, y: bottom + 17, "text-anchor": anchor }, text));
    }
    const order = across.values.map((_, i) => i).sort((a, b) => across.values[a] - across.values[b]);
    const solved = order
      .filter((i) => quantity.values[at(i, 0)] !== null)
      .map((i) => curvePoint(i).map((v) => v.toFixed(1)));
    // Nothing lies between tools.
    if (!across.names) drawing.append(svgElement("polyline", { class: "line", points: solved.join(" ") }));
    for (const i of order) {
      const [x, y] = curvePoint(i);
      const lost = quantity.values[at(i, 0)] === null ? " lost" : "";
      const style = `point${lost}${at(i, 0) === opened ? " open" : ""}`;
      drawing.append(svgElement("circle", { class: style, cx: x, cy: y, r: columns > 60 ? 2.5 : 4 }));
    }
    nameAxes(axisLabel(quantity));
  }

  function draw() {
    if (!layout || map.clientWidth !== layout.width) measure();
    drawing.replaceChildren();
    drawTitle();
    if (upward) {
      drawCells();
      drawMapAxes();
      if (isShown("stability")) drawUnstable();
      const lines = layers.filter(({ id, of }) => of && !upward.names && isShown(id));
      const drawn = lines.map((line) => ({ ...line, path: separatingLine(line) })).filter(({ path }) => path);
      for (const { id, path } of drawn) {
        drawing.append(...["contour-case", "contour"].map((part) => svgElement("path", { class: `${part} ${id}`, d: path })));
      }
      const hasNumbers = drawNumbers();
      drawDots(hasNumbers);
      drawMeasured();
      drawOpened();
      drawMarks(drawn);
    } else {
      drawCurve();
      drawMeasured();
      drawMarks([]);
    }
    point();
  }

  /** A frame around the opened case, if it is in the slice that is shown. */
  function drawOpened() {
    if (opened === null) return;
    const open = grid.places(opened);
    if (at(open[acrossAt], open[upwardAt]) !== opened) return;
    for (const style of ["opened-case", "opened"]) drawing.append(frame(style, open[acrossAt], open[upwardAt]));
  }

  /** A corner on each laterally unstable case, if cells are large enough. */
  function drawUnstable() {
    const size = Math.min(8, cellWidth() / 2, cellHeight() / 2);
    if (size < 3) return;
    const corner = ([i, j]) => `M${(left(i + 1) - size).toFixed(1)} ${top(j).toFixed(1)}h${size}v${size}z`;
    const path = cells.filter(([i, j]) => unstable.has(at(i, j))).map(corner).join("");
    if (path) drawing.append(svgElement("path", { class: "unstable", d: path }));
  }

  /** The numbers of all cells, if all of them fit; whether they are drawn. */
  function drawNumbers() {
    const { size, character, room } = CELL_NUMBER;
    const numberOf = (value) => number(value * quantity.scale.factor, DIGITS, !Number.isInteger(value));
    const known = cells.filter(([i, j]) => quantity.values[at(i, j)] !== null);
    // A map of many cells has no numbers: they need not be made to know that.
    const couldFit = cellWidth() >= 3 * character && cellHeight() >= size + room;
    const texts = couldFit ? known.map(([i, j]) => numberOf(quantity.values[at(i, j)])) : [];
    const fit = couldFit && texts.every((text) => text.length * character + room <= cellWidth());
    layers.find(({ id }) => id === "numbers").box.disabled = !fit;
    if (!fit || !isShown("numbers")) return false;
    known.forEach(([i, j], k) => {
      const share = shareOf(quantity.values[at(i, j)]);
      const place = { x: left(i) + cellWidth() / 2, y: top(j) + cellHeight() / 2 + 0.36 * size, "text-anchor": "middle" };
      const style = `fill: ${inkOn(share)}; stroke: ${color(share)}`;
      drawing.append(svgElement("text", { class: "cell-number", style, ...place }, texts[k]));
    });
    return true;
  }

  /** A dot on each case with a course, unless all have one: in a corner if there are numbers. */
  function drawDots(hasNumbers) {
    if (!isSelection()) return;
    const radius = Math.max(1, Math.min(3, cellWidth() / 4, cellHeight() / 4));
    for (const [i, j] of cells.filter(([i, j]) => kept.has(at(i, j)))) {
      const [cx, cy] = hasNumbers
        ? [left(i) + 2 * radius, top(j) + cellHeight() - 2 * radius]
        : [left(i) + cellWidth() / 2, top(j) + cellHeight() / 2];
      drawing.append(svgElement("circle", { class: "kept", cx, cy, r: radius }));
    }
  }

  /** A mark on each measured point: between the middles of the cells, or at its force with its standard deviation. */
  function drawMeasured() {
    for (const { at: values, force, std } of measuredPoints()) {
      const [x, y] = upward ? mapPlace(values[acrossAt], values[upwardAt]) : curvePlace(values[acrossAt], force);
      if (!upward && std !== null) {
        const [low, high] = [force - std, force + std].map((end) => curvePlace(values[acrossAt], end)[1]);
        drawing.append(svgElement("line", { class: "measured", x1: x, x2: x, y1: low, y2: high }));
      }
      drawing.append(measuredMark(x, y));
    }
  }

  /** Where a measured point lies on the map. */
  function mapPlace(horizontal, vertical) {
    const [i, j] = [placeBetween(across.values, horizontal), placeBetween(upward.values, vertical)];
    return [left(i) + cellWidth() / 2, top(j) + cellHeight() / 2];
  }

  const measuredMark = (x, y) => svgElement("path", { class: "measured", d: `M${x - 5} ${y}l5 -5l5 5l-5 5z` });

  const isSelection = () => kept.size > 0 && kept.size + errors.size < quantity.values.length;

  function frame(style, i, j) {
    return svgElement("rect", { class: style, x: left(i), y: top(j), width: cellWidth(), height: cellHeight() });
  }

  function drawTitle() {
    const { name, symbol: mark, scale, meaning, low, high } = quantity;
    byId("map-title").replaceChildren(...titleParts(name, mark, scale.unit));
    byId("map-note").replaceChildren(...rich(meaning));
    byId("legend").hidden = !upward;
    const text = (value) => (Number.isFinite(value) ? number(value * scale.factor, DIGITS) : "–");
    byId("legend-low").textContent = text(low);
    byId("legend-high").textContent = high > low ? text(high) : "";
    byId("bar").style.background = `linear-gradient(to right, ${VIRIDIS})`;
  }

  /** Explains the marks other than colours, and the lines. */
  function drawMarks(lines) {
    const key = (...content) => svgElement("svg", { viewBox: "0 0 26 12", "aria-hidden": "true" }, ...content);
    const line = (style) => svgElement("line", { class: style, x1: 1, x2: 25, y1: 6, y2: 6 });
    const items = lines.map(({ id, text }) => [key(line(`contour-case ${id}`), line(`contour ${id}`)), rich(text)]);
    if (upward && unstable.size > 0 && isShown("stability")) {
      const square = svgElement("rect", { class: "failed-cell", x: 7, width: 12, height: 12 });
      items.push([key(square, svgElement("path", { class: "unstable", d: "M11 0h8v8z" })), ["laterally unstable"]]);
    }
    if (upward && isSelection())
      items.push([key(svgElement("circle", { class: "kept", cx: 13, cy: 6, r: 3 })), ["with its course over time"]]);
    if (measuredPoints().length > 0) items.push([key(measuredMark(13, 6)), ["measured"]]);
    if (errors.size > 0) {
      const square = svgElement("rect", { class: "failed-cell", x: 7, width: 12, height: 12 });
      const cross = svgElement("path", { class: "failed-cross", d: "M10 3l6 6m0-6l-6 6" });
      items.push([key(square, cross), ["failed, with its error when pointed at"]]);
    }
    byId("marks").replaceChildren(...items.map(([mark, text]) => element("li", {}, mark, ...text)));
  }

  /** Shows the case under the pointer. */
  function point() {
    drawing.querySelector(".pointed")?.remove();
    const [i, j] = [places[acrossAt], upward ? places[upwardAt] : 0];
    const [x, y] = upward ? [] : curvePoint(i);
    drawing.append(upward ? frame("pointed", i, j) : svgElement("circle", { class: "pointed", cx: x, cy: y, r: 8 }));
    const index = at(i, j);
    const failed = errors.has(index);
    const value = failed
      ? "failed"
      : `${quantity.symbol || quantity.name} = ${withUnit(quantity.values[index], quantity.scale, DIGITS)}`;
    const text = `${grid.name(index)}: ${value}${unstable.has(index) ? ", laterally unstable" : ""}`;
    byId("readout").replaceChildren(...rich(text));
    byId("map-row").setAttribute("aria-rowindex", rows - j);
    byId("map-cell").setAttribute("aria-colindex", i + 1);
    byId("map-cell").textContent = text;
    map.dataset.index = index;
    const entries = failed
      ? [element("dt", {}, "Error"), element("dd", { class: "error" }, errors.get(index))]
      : quantities
          .slice(0, ON_CARD)
          .flatMap((each) => [
            element("dt", {}, each.symbol ? symbol(each.symbol) : each.name),
            element("dd", {}, valueText(study, each, index)),
          ]);
    byId("card").classList.toggle("failed", failed);
    byId("card").replaceChildren(...entries);
  }

  function pointAt(event) {
    const box = map.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    if (!upward) {
      const distance = (i) => Math.abs(curvePoint(i)[0] - x);
      places[acrossAt] = across.values.reduce((best, _, i) => (distance(i) < distance(best) ? i : best), 0);
      point();
      return true;
    }
    const i = Math.floor((x - layout.left) / cellWidth());
    const j = Math.floor((layout.top + layout.height - y) / cellHeight());
    if (i < 0 || i >= columns || j < 0 || j >= rows) return false;
    if (i !== places[acrossAt] || j !== places[upwardAt]) {
      [places[acrossAt], places[upwardAt]] = [i, j];
      point();
    }
    return true;
  }

  function move(axisAt, step) {
    const last = grid.axes[axisAt].values.length - 1;
    places[axisAt] = Math.min(Math.max(places[axisAt] + step, 0), last);
    point();
  }

  addChoices();
  map.setAttribute("aria-rowcount", rows);
  map.setAttribute("aria-colcount", columns);
  map.setAttribute("aria-activedescendant", "map-cell");
  map.classList.add("cells");
  map.addEventListener("pointermove", pointAt);
  map.addEventListener("click", (event) => pointAt(event) && open(Number(map.dataset.index)));
  const far = ({ ctrlKey }) => (ctrlKey ? 10 : 1);
  onKeys(map, {
    ArrowLeft: (event) => move(acrossAt, -far(event)),
    ArrowRight: (event) => move(acrossAt, far(event)),
    ArrowUp: (event) => upward && move(upwardAt, far(event)),
    ArrowDown: (event) => upward && move(upwardAt, -far(event)),
    Home: () => move(acrossAt, -columns),
    End: () => move(acrossAt, columns),
    PageUp: () => upward && move(upwardAt, rows),
    PageDown: () => upward && move(upwardAt, -rows),
    Enter: () => open(Number(map.dataset.index)),
    " ": () => open(Number(map.dataset.index)),
  });
  new ResizeObserver(() => map.clientWidth !== layout?.width && draw()).observe(map);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw();
  return {
    markOpen(index) {
      opened = index;
      grid.places(index).forEach((place, k) => (places[k] = place));
      for (const select of byId("choices").querySelectorAll("[data-path]")) {
        select.value = places[grid.axes.findIndex((axis) => axis.path === select.dataset.path)];
      }
      draw();
    },
  };
}

/** A metric of a case with its unit, and with its uncertainty if it has one. */
function valueText(study, quantity, index) {
  const value = quantity.values[index];
  if (quantity.key !== FORCE || !study.force_uncertainty[index]) return withUnit(value, quantity.scale, DIGITS);
  // Two digits of the uncertainty, and the value to the same decimal.
  const { factor, unit } = quantity.scale;
  const uncertainty = Number((study.force_uncertainty[index] * factor).toPrecision(2));
  const last = uncertainty > 0 ? 10 ** (Math.floor(Math.log10(uncertainty)) - 1) : 1e-4 * value * factor;
  return `${number(last > 0 ? Math.round((value * factor) / last) * last : 0, 9)} ± ${number(uncertainty, 2)}\u202f${unit}`;
}
