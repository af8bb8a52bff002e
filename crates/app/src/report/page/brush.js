// Fills the page of a brush: the sector in motion, its results and its settings.

const brush = JSON.parse(document.getElementById("data").textContent);

/** Duration of the whole simulation at speed 1, in seconds. */
const PLAYING_TIME = 10;
/** Largest turn of the tool between two frames for which shapes in between are drawn, in rad. */
const SMALL_TURN = 0.05;
/** Largest height of the views in pixels, and their margin as a part of the filament's length. */
const HEIGHT = 460;
const MARGIN = 0.06;
/** Margin beside the outer rows in the view from above, as a share of the length of filaments. */
const ASIDE = 0.12;
/** Share of the forces that the colours tell apart. */
const BULK = 0.98;
/** Opacity of filaments that do not count. */
const PALE = 0.4;

function showHead() {
  byId("name").textContent = brush.name;
  const number_of = (count, what) => `${number(count, 9)} ${what}${count === 1 ? "" : "s"}`;
  const factor = brush.sector.find(({ key }) => key === "interaction_factor").value;
  const force = brush.metrics.find(({ key }) => key === "tool_contact_normal_force_n");
  const scale = scaleFor("N", Math.max(force.value, force.alone));
  byId("summary").replaceChildren(
    `${number_of(brush.columns, "column")} of ${number_of(brush.rows, "filament")} pass the workpiece. `,
    ...rich("F_n,w"),
    ` is ${withUnit(force.value, scale, DIGITS)}; without interaction it would be ${withUnit(force.alone, scale, DIGITS)}. The interaction factor is ${number(factor, DIGITS)}.`,
  );
}

/** A row of a table: a name with its meaning, and cells. */
function row({ key, name, meaning }, ...cells) {
  return tableRow({ "data-key": key }, [name, quiet(...rich(meaning))], ...cells);
}

function showResults() {
  const metrics = brush.metrics.map((metric) => {
    const scale = scaleFor(metric.unit, Math.max(Math.abs(metric.value), Math.abs(metric.alone)));
    const cells = [metric.value, metric.alone].map((value) => numberCell(withUnit(value, scale, DIGITS)));
    return row(metric, symbolCell(metric.symbol), ...cells);
  });
  byId("metrics").tBodies[0].replaceChildren(...metrics);
  const interaction = brush.sector.map((entry) =>
    row(entry, numberCell(withUnit(entry.value, scaleFor(entry.unit, Math.abs(entry.value)), DIGITS))),
  );
  byId("interaction").tBodies[0].replaceChildren(...interaction);
}

/** The force that few of the positive ones exceed. */
function bulk(forces) {
  const positive = forces.filter((force) => force > 0).sort();
  return positive.length > 0 ? positive[Math.floor((positive.length - 1) * BULK)] : 0;
}

/** The sector in motion. */
function createSector() {
  const [motion, outline] = [brush.motion, brush.outline].map(unpackAll);
  const { times, tool_angles, points } = motion;
  const filaments = motion.filaments.length;
  const counted = motion.filaments.map((filament) => brush.counted[filament]);
  const last = times.length - 1;
  const turn = Math.abs(tool_angles[last] - tool_angles[0]) / last;
  // There are too many for the arguments of a function.
  const range = (values) =>
    values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  /** Forces at the end of the colours: few impacts are higher. */
  const most = { contact_force: bulk(motion.contact_force), press_force: bulk(motion.press_force) };
  const [side, top] = ["side", "top"].map(byId);
  /** Filaments from the back to the front: the axis points at the reader. */
  const order = Array.from({ length: filaments }, (_, filament) => filament);
  if (motion.axial !== null) order.sort((a, b) => motion.axial[a * points] - motion.axial[b * points]);
  /** Place among the frames, from 0 to the last. */
  let place = 0;
  const player = createPlayer(PLAYING_TIME, (to) => {
    place = to;
    draw();
  });

  /** A coordinate at the place shown. */
  function at(values, index, perFrame) {
    const frame = Math.min(Math.floor(place), last);
    const part = turn < SMALL_TURN ? place - frame : 0;
    const value = values[frame * perFrame + index];
    return part === 0 ? value : value + part * (values[(frame + 1) * perFrame + index] - value);
  }

  /** The part of the scene that is shown: least and largest place along the surface and above it, in m. */
  function box() {
    const margin = MARGIN * brush.length;
    if (byId("zoom").value === "sector") {
      const [[left, right], [, high]] = [range(motion.along), range(motion.above)];
      return [left - margin, right + margin, -2 * margin, high + margin];
    }
    const reach = Math.sqrt(Math.max(0, brush.tool_radius ** 2 - brush.axis_height ** 2)) + 0.9 * brush.length;
    return [-reach, reach, -2 * margin, 1.15 * brush.length];
  }

  /** A canvas of this height, cleared, with coordinates in pixels. */
  function cleared(canvas, height) {
    const [width, ratio] = [canvas.clientWidth, window.devicePixelRatio || 1];
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    canvas.style.height = `${height}px`;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.lineCap = "round";
    pen.lineJoin = "round";
    return pen;
  }

  function draw() {
    const style = getComputedStyle(document.documentElement);
    const ink = (name) => style.getPropertyValue(`--${name}`);
    const [left, right, low, high] = box();
    const scale = Math.min(side.clientWidth / (right - left), HEIGHT / (high - low));
    const middle = (left + right) / 2;
    const x = (along) => side.clientWidth / 2 + scale * (along - middle);
    const pen = cleared(side, Math.round(scale * (high - low)));
    const y = (above) => scale * (high - above);
    drawWorkpiece(pen, ink, x, y);
    pen.beginPath();
    pen.arc(x(0), y(brush.axis_height), scale * brush.body_radius, 0, 2 * Math.PI);
    pen.fillStyle = ink("body");
    pen.fill();
    drawFilaments(pen, ink, scale, x, y, motion.above);
    drawLength(pen, ink, scale, side);
    if (motion.axial !== null) drawFromAbove(ink, scale, x);
    byId("clock").textContent = withUnit(timeShown(), scaleFor("s", times[last]), 4);
  }

  function drawWorkpiece(pen, ink, x, y) {
    const shift = brush.feed * timeShown();
    const surface = Array.from(outline.along, (along, k) => [x(along + shift), y(outline.above[k])]);
    const trace = () => {
      pen.beginPath();
      for (const point of surface) pen.lineTo(...point);
    };
    trace();
    pen.fillStyle = ink("workpiece");
    if (!outline.solid) {
      pen.lineTo(surface.at(-1)[0], pen.canvas.height);
      pen.lineTo(surface[0][0], pen.canvas.height);
    }
    pen.fill();
    trace();
    pen.strokeStyle = ink("ink");
    pen.lineWidth = 1.2;
    pen.stroke();
  }

  /** Filaments as thick as they are, with an edge that separates them; `upward` are the coordinates that `y` places. */
  function drawFilaments(pen, ink, scale, x, y, upward) {
    const quantity = byId("quantity").value;
    const thick = Math.max(scale * brush.diameter, 1.2);
    const edge = Math.min(1.2, 0.25 * thick);
    for (const filament of order) {
      const force = at(motion[quantity], filament, filaments);
      pen.beginPath();
      for (let k = 0; k < points; k += 1) {
        const [along, up] = [motion.along, upward].map((values) => at(values, filament * points + k, filaments * points));
        pen.lineTo(x(along), y(up));
      }
      pen.globalAlpha = 1;
      pen.strokeStyle = ink("paper");
      pen.lineWidth = thick;
      pen.stroke();
      pen.globalAlpha = counted[filament] ? 1 : PALE;
      pen.strokeStyle = force > 1e-4 * most[quantity] ? color(force / most[quantity]) : ink("failed-ink");
      pen.lineWidth = thick - edge;
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  /** The sector from above: the surface to the right as in the view along the axis, and the axis upwards. */
  function drawFromAbove(ink, scale, x) {
    // The rows and what is beside them: a filament that falls over may reach far out.
    const [low, high] = range(motion.axial.filter((_, point) => point % points === 0));
    const margin = ASIDE * brush.length;
    const pen = cleared(top, Math.round(scale * (high - low + 2 * margin)));
    const y = (z) => scale * (high + margin - z);
    drawFilaments(pen, ink, scale, x, y, motion.axial);
  }

  /** A bar of a round length. */
  function drawLength(pen, ink, scale, canvas) {
    const length = ticks(0, canvas.clientWidth / scale / 4, 4)[1];
    const [end, level] = [canvas.clientWidth - 14, 18];
    const start = end - scale * length;
    pen.strokeStyle = ink("ink");
    pen.lineWidth = 1.5;
    pen.stroke(new Path2D(`M${start} ${level - 4}V${level}H${end}V${level - 4}`));
    pen.fillStyle = ink("ink");
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.fillText(withUnit(length, scaleFor("m", length)), start - 6, level);
  }

  function timeShown() {
    return at(times, 0, 1);
  }

  function showLegend() {
    const high = most[byId("quantity").value];
    byId("legend-low").textContent = "grey: none";
    byId("legend-high").textContent = `${withUnit(high, scaleFor("N", high), DIGITS)} or more`;
    byId("bar").style.background = `linear-gradient(to right, ${VIRIDIS})`;
  }

  byId("quantity").addEventListener("change", () => {
    showLegend();
    draw();
  });
  byId("zoom").addEventListener("change", draw);
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  byId("from-above").hidden = motion.axial === null;
  if (filaments < brush.counted.length) byId("alike").textContent = "Filaments that move alike in several rows are drawn once. ";
  showLegend();
  // The middle of the simulation, where the sector is on the workpiece.
  player.load(last, times[last], Math.round(last / 2));
}

showHead();
datePrints(brush.version);
showResults();
showNotes(brush.notes, rich);
showSettings(brush.settings, fixedSettingText);
const work = brush.work.map(([name, count]) => `${number(count, 12)} ${name}`);
showOrigin(brush, [["Solver", [work.join(", ")]]], "; filaments are capsules that press on each other");
if (brush.motion === null) byId("sector").hidden = true;
else createSector();
