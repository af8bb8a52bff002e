// One case: the filament in motion, curves over time with a common cursor, and its figures.

/** Duration of a whole pass at speed 1, in seconds. */
const PLAYING_TIME = 6;
/** Curves over time: the arrays of a course that a diagram shows. */
const DIAGRAMS = [
  {
    name: "contact normal force",
    symbol: "F_n",
    unit: "N",
    series: [
      { key: "peak_force", name: "largest in an interval", area: true },
      { key: "mean_force", name: "mean of an interval" },
    ],
  },
  { name: "tip deflection", symbol: "s_n", unit: "m", series: [{ key: "deflection", name: "deflection" }] },
  {
    name: "energy",
    symbol: "",
    unit: "J",
    series: [
      { key: "kinetic", name: "kinetic" },
      { key: "potential", name: "potential" },
      { key: "dissipated", name: "dissipated so far" },
    ],
  },
  // Of tools that are no upright radial ones.
  ...["tip", "root"].map((part) => ({
    name: `height of the ${part} above the workpiece`,
    symbol: "",
    unit: "m",
    series: [{ key: `${part}_height`, name: part }],
  })),
];
/** Work of a contact per length of the workpiece's profile. */
const WORKS = [
  { name: "normal impulse along the profile", unit: "N s/m", key: "impulse" },
  { name: "friction work along the profile", unit: "J/m", key: "friction" },
];
/** Length of the longest bar of work in the scene, in pixels. */
const LONGEST_BAR = 44;
/** Part of a view that is left free around the filament, and the least thickness of the workpiece in pixels. */
const AROUND = 0.06;
const THICKNESS = 14;

/** Points as an SVG attribute, to a hundredth of a pixel. */
function pointList(points) {
  return points.map(([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`).join(" ");
}

/** The area between two points and the same points moved to the left of the way between them, as a path. */
function quadrilateral([x, y], [u, v], distance) {
  const factor = distance / (Math.hypot(u - x, v - y) || 1);
  const [across, down] = [factor * (v - y), factor * (x - u)];
  const corners = [[x, y], [u, v], [u + across, v + down], [x + across, y + down]];
  return `M${corners.map((corner) => corner.map((value) => value.toFixed(2)).join(" ")).join("L")}Z`;
}

/** The material below a surface as a path: inside it if it is solid, else down to a thickness. */
function material(surface, solid, thickness) {
  if (solid) return `M${surface.map((point) => point.map((value) => value.toFixed(2)).join(" ")).join("L")}Z`;
  return surface.slice(1).map((point, k) => quadrilateral(surface[k], point, -thickness)).join("");
}

/** The view of one case at a time. */
function createCaseView(study, grid) {
  const courses = new Map(study.courses);
  const errors = new Map(study.errors);
  const [animation, scene, viewChoice] = ["animation", "scene", "view"].map(byId);
  const player = createPlayer(PLAYING_TIME, setPlace);
  let course = null;
  /** Place shown among the shapes, and the part of the pass until then. */
  let place = 0;
  let passed = 0;
  let parts = null;
  let diagrams = [];

  function show(index) {
    const name = grid.name(index);
    byId("case-title").replaceChildren(...rich(name));
    byId("case").dataset.index = index;
    course = unpackAll(courses.get(index) ?? null);
    byId("course").hidden = course === null;
    byId("tables").hidden = errors.has(index);
    byId("case-row").textContent = number(grid.row(index), 9);
    showNote(index);
    showTables(index);
    if (course === null) return player.stop();
    scene.setAttribute("aria-label", `Filament at ${name}`);
    const { views, shapes, end } = course;
    byId("view-choice").hidden = views.length === 1;
    byId("seen").hidden = views.length > 1;
    if (views.length > viewChoice.options.length)
      viewChoice.replaceChildren(...views.map(({ name }, k) => element("option", { value: k }, name)));
    player.load(shapes - 1, end, 0);
    layOut();
  }

  function showNote(index) {
    const notes = [];
    if (errors.has(index)) {
      notes.push([`This case has failed: ${errors.get(index)}`]);
    } else if (course === null && courses.size === 0) {
      notes.push([
        study.brush
          ? "This page holds no course over time: `bristle simulate` shows the sector of one case in motion."
          : "This page holds no course over time.",
      ]);
    } else if (course === null) {
      const nearest = grid.nearest(index, [...courses.keys()]);
      notes.push([
        `The course over time was kept of ${courses.size} cases that are spread over the study; this is none of them. The nearest is `,
        element("a", { href: `#case-${grid.row(nearest)}` }, ...rich(grid.name(nearest))),
        ".",
      ]);
    }
    if (isUnstable(study, index)) {
      const { values } = study.quantities.find(({ key }) => key === AMPLIFICATION);
      notes.push([
        `Laterally unstable: in this pass an imperfection out of the plane of rotation grows ${number(values[index], DIGITS)}-fold. Forces and impulse can change with it: sweep `,
        element("code", {}, "filament.lateral_tilt_rad"),
        " to see what imperfect filaments do.",
      ]);
    }
    byId("case-note").hidden = notes.length === 0;
    byId("case-note").replaceChildren(...notes.map((content) => element("p", {}, ...content)));
  }

  function showTables(index) {
    const [shares, metrics] = [true, false].map((wanted) =>
      study.quantities.filter(({ key }) => key.startsWith(SHARE) === wanted),
    );
    const rows = metrics.map((quantity) => {
      const cell = numberCell(valueText(study, quantity, index));
      if (quantity.key === FORCE && study.force_uncertainty[index]) cell.append(quiet("± from the number of filaments"));
      const attributes = { "data-key": quantity.key, ...(quantity.headline ? {} : { class: "detail" }) };
      return tableRow(attributes, [quantity.name, quiet(...rich(quantity.meaning))], symbolCell(quantity.symbol), cell);
    });
    byId("metrics").tBodies[0].replaceChildren(...rows);
    showShares(shares, index);
    const counts = study.statistics.map(({ name, values }) => tableRow({}, [name], numberCell(number(values[index], 9))));
    byId("statistics").tBodies[0].replaceChildren(...counts);
  }

  /** The shares of the inputs in the variance of the tool force, and the rest: interactions and the error of the fit. */
  function showShares(shares, index) {
    const known = shares.map(({ name, values }) => [name.replace(/^share of (the )?/, ""), values[index]]);
    const sum = known.reduce((total, [, value]) => total + value, 0);
    // Without a band, or a force, there is no variance to share.
    byId("scatter").hidden = sum === 0;
    if (sum === 0) return;
    known.push(["not attributed to one input", Math.max(0, 1 - sum)]);
    const rows = known.map(([name, value]) => {
      const percent = `${number(Math.round(1000 * value) / 10, DIGITS)}\u202f%`;
      const meter = element("meter", { min: 0, max: 1, value, "aria-label": `${name}: ${percent}` });
      return tableRow({}, [name], element("td", {}, meter), numberCell(percent));
    });
    byId("shares").tBodies[0].replaceChildren(...rows);
  }

  /** Draws everything that does not move, for the available width. */
  function layOut() {
    // A page that is loaded in the background has no width yet; the observer below reports it.
    if (animation.clientWidth === 0) return;
    drawScene();
    const worked = WORKS.filter(({ key }) => Math.max(0, ...course.work[key]) > 0);
    const known = DIAGRAMS.filter(({ series }) => course[series[0].key]);
    const turns = course.turn_impulses.length > 1 ? [drawTurns()] : [];
    diagrams = [...known.map(drawDiagram), ...worked.map(drawWork), ...turns];
    byId("curves").replaceChildren(...diagrams.map(({ figure }) => figure));
    // Sizes are known once the figures are in the page.
    for (const diagram of diagrams) diagram.layOut();
    update();
  }

  /** Left, right, lower and upper end of the scene, in m. */
  function windowOf({ window: [left, right, low, high] }) {
    const margin = AROUND * Math.max(right - left, high - low);
    return [left - margin, right + margin, low - margin, high + margin];
  }

  function drawScene() {
    const view = course.views[Number(viewChoice.value)] ?? course.views[0];
    const { points: count, shapes, work } = course;
    const { nodes, outline } = view;
    const [low, high, bottom, top] = windowOf(view);
    const width = animation.clientWidth;
    const scale = Math.min(width / (high - low), 390 / (top - bottom));
    // The label of the workpiece stands below.
    const height = Math.round(scale * (top - bottom) + 28);
    const shift = (width - scale * (high - low)) / 2;
    const x = (along) => shift + scale * (along - low);
    const y = (above) => scale * (top - above);
    scene.setAttribute("viewBox", `0 0 ${width} ${height}`);
    scene.setAttribute("height", height);

    const places = ({ along, above }) => Array.from(along, (value, k) => [x(value), y(above[k])]);
    const all = places(nodes);
    const shape = (frame) => all.slice(frame * count, (frame + 1) * count);
    const tips = Array.from({ length: shapes }, (_, frame) => shape(frame).at(-1));
    const ghosts = Array.from({ length: 15 }, (_, k) => shape(Math.round((k * (shapes - 1)) / 14)));
    // A scale bar of a round length, about a sixth of the width.
    const length = ticks(0, (high - low) / 3, 2)[1] ?? high - low;
    const label = withUnit(length, scaleFor("m", length));
    const [from, level] = [width - 14 - scale * length, height - 10];
    const surface = places(outline);
    // Friction work if there is any; it is what removes material.
    const bars = Math.max(0, ...work.friction) > 0 ? work.friction : work.impulse;
    const largest = Math.max(0, ...bars);
    const worked = view.work ? places(view.work) : null;
    const raised = Array.from(worked ? bars : [], (value, k) =>
      quadrilateral(worked[k], worked[k + 1], (LONGEST_BAR * value) / largest),
    );
    const thickness = Math.max(height - y(0), THICKNESS);
    const line = (style) => (points) => svgElement("polyline", { class: style, points: pointList(points) });
    parts = {
      x,
      y,
      scale,
      piece: svgElement(
        "g",
        { id: "workpiece" },
        svgElement("path", { class: "scene-work", d: material(surface, outline.solid, thickness) }),
        svgElement("path", { class: "scene-done", d: largest > 0 ? raised.join("") : "" }),
        line("scene-surface")(surface),
      ),
      trace: line("scene-trace")([]),
      filament: svgElement("polyline", { class: "scene-filament", id: "filament" }),
      tip: svgElement("circle", { class: "scene-tip", r: 4.5 }),
      tips,
      view,
    };
    scene.replaceChildren(
      // What is seen against its axis has the workpiece in front of its body.
      ...view.body.map(places).map(line("scene-body")),
      parts.piece,
      ...view.trim.map(places).map(line("scene-nominal")),
      ...ghosts.map(line("scene-ghost")),
      line("scene-way")(tips),
      parts.trace,
      parts.filament,
      parts.tip,
      svgElement("path", { class: "scene-scale", d: `M${from} ${level - 4}v4h${scale * length}v-4` }),
      svgText({ x: from - 6, y: level, "text-anchor": "end" }, label),
      svgText({ x: 8, y: 16, class: "quiet" }, "brush body"),
      svgText({ x: 8, y: height - 8, class: "quiet" }, "workpiece"),
    );
  }

  /** A figure of a curve: a drawing with a title and a label, whose content `draw` returns for a frame in pixels. */
  function plot({ title, label, height = 170, keys = [], ...attributes }, draw) {
    const drawing = svgElement("svg", { role: "img", "aria-label": label });
    const caption = element("figcaption", {}, ...title);
    const figure = element("figure", { class: "curve", ...attributes }, caption, keys, drawing);
    function layOut() {
      const width = figure.clientWidth;
      const frame = { left: 44, right: width - 10, top: 16, bottom: height - 34 };
      drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
      drawing.setAttribute("height", height);
      drawing.replaceChildren(...draw(frame));
    }
    return { figure, drawing, layOut, update() {} };
  }

  /** The name of the horizontal axis of a plot. */
  const axisName = ({ left, right, bottom }, text) =>
    svgText({ x: (left + right) / 2, y: bottom + 30, "text-anchor": "middle" }, text);

  /** Lines across a plot at round values of its vertical axis, whose heights `y` gives, with the values beside them. */
  function levels([low, high], { factor }, y, { left, right }) {
    return ticks(low * factor, high * factor, 4).flatMap((value) => {
      const level = y(value / factor);
      return [
        svgElement("line", { class: "axis", x1: left, x2: right, y1: level, y2: level }),
        svgText({ x: left - 6, y: level + 4, "text-anchor": "end" }, number(value, 4)),
      ];
    });
  }

  /** Round values of the horizontal axis of a plot in thousandths of its unit, at the places that `x` gives. */
  function thousandths([low, high], x, { left, right, bottom }) {
    return ticks(low * 1e3, high * 1e3, Math.max(2, (right - left) / 80)).map((value) =>
      svgText({ x: x(value / 1e3), y: bottom + 15, "text-anchor": "middle" }, number(value, 4)),
    );
  }

  /** Draws the work per length over the arc length of the profile; edges are shaded. */
  function drawWork({ name, unit, key }) {
    const { arc_length, on_edge, cells } = course.work;
    const values = course.work[key];
    const largest = Math.max(...values);
    const scale = scaleFor(unit, largest);
    const title = titleParts(name, "", scale.unit);
    return plot({ title, label: name, height: 150, class: "curve work" }, (frame) => {
      const { left, right, top, bottom } = frame;
      const [low, high] = [arc_length[0], arc_length[cells]];
      const x = (at) => left + ((at - low) / (high - low)) * (right - left);
      const y = (value) => bottom - (value / largest) * (bottom - top);
      const each = (draw) => Array.from({ length: cells }, (_, k) => draw(k));
      const shaded = each((k) => {
        const [from, to] = [arc_length[k], arc_length[k + 1]].map((at) => x(at).toFixed(2));
        return on_edge[k] > 0.5 ? `M${from} ${top}H${to}V${bottom}H${from}Z` : "";
      });
      const steps = each((k) => [arc_length[k], arc_length[k + 1]].map((at) => [x(at), y(values[k])])).flat();
      const label = on_edge.some((value) => value > 0.5) ? "arc length in mm; shaded: edges" : "arc length in mm";
      return [
        svgElement("path", { class: "work-edge", d: shaded.join("") }),
        ...levels([0, largest], scale, y, frame),
        ...thousandths([low, high], x, frame),
        axisName(frame, label),
        svgElement("polygon", { class: "work-area", points: pointList([[x(low), y(0)], ...steps, [x(high), y(0)]]) }),
      ];
    });
  }

  function drawDiagram({ name, symbol: mark, unit, series }) {
    const curves = series.map((each) => ({ ...each, values: course[each.key] }));
    const highest = Math.max(...curves.map(({ values }) => Math.max(...values)));
    const lowest = Math.min(0, ...curves.map(({ values }) => Math.min(...values)));
    const largest = Math.max(highest, -lowest);
    const scale = scaleFor(unit, largest);
    // Values as small as the step of the packed numbers are zero.
    const grain = largest > 0 ? 1e-4 * largest : 1;
    const last = course.samples - 1;
    const lines = curves.filter(({ area }) => !area);
    const style = (curve) => (curve.area ? "series-area" : `series-line series-${lines.indexOf(curve)}`);
    const outputs = curves.map(() => element("output", {}));
    const keys = curves.map((curve, k) => {
      const sample = curve.area
        ? svgElement("rect", { class: style(curve), x: 1, y: 1, width: 24, height: 8 })
        : svgElement("line", { class: style(curve), x1: 1, x2: 25, y1: 5, y2: 5 });
      const key = svgElement("svg", { viewBox: "0 0 26 10", "aria-hidden": "true" }, sample);
      return element("li", {}, key, curve.name, outputs[k]);
    });
    const title = titleParts(name, mark, scale.unit);
    const cursor = svgElement("line", { class: "cursor" });
    let x = null;

    function draw(frame) {
      const { left, right, top, bottom } = frame;
      x = (time) => left + (time / course.end) * (right - left);
      const y = (value) => bottom - ((value - lowest) / (highest - lowest || 1)) * (bottom - top);
      const content = [
        ...levels([lowest, highest || 1], scale, y, frame),
        ...thousandths([0, course.end], x, frame),
        axisName(frame, "time in ms"),
      ];
      // A filament that touches all round begins each turn where it ends the last one, the first after the workpiece has come up.
      const isAllRound = course.exit - course.entry > 0.999999 * course.turn;
      const before = isAllRound ? course.turn : 0;
      const marks = [
        [isAllRound ? "turn begins" : "nominal entry", course.entry],
        ["nominal exit", course.exit],
      ].slice(0, isAllRound ? 1 : 2);
      course.turn_impulses.forEach((_, turn) => {
        for (const [label, ofFirst] of marks) {
          const at = x(ofFirst + turn * course.turn);
          content.push(svgElement("line", { class: "nominal", x1: at, x2: at, y1: top - 4, y2: bottom }));
          // The labels of several turns would hide each other.
          if (course.turn_impulses.length === 1) content.push(svgText({ class: "quiet", x: at + 4, y: top - 5 }, label));
        }
        if (course.turn_impulses.length > 1 && x(course.turn) - x(0) > 60)
          content.push(svgText({ class: "quiet", x: x(before + turn * course.turn) + 4, y: top - 5 }, `turn ${turn + 1}`));
      });
      for (const curve of curves) {
        const points = Array.from(curve.values, (value, i) => [x((i / last) * course.end), y(value)]);
        const outline = curve.area ? [[x(0), y(0)], ...points, [x(course.end), y(0)]] : points;
        content.push(svgElement(curve.area ? "polygon" : "polyline", { class: style(curve), points: pointList(outline) }));
      }
      cursor.setAttribute("y1", top - 4);
      cursor.setAttribute("y2", bottom);
      return [...content, cursor];
    }
    const label = `${name} over time`;
    const diagram = plot({ title, label, keys: element("ul", { class: "keys" }, ...keys) }, draw);

    /** Goes to the time under the pointer. */
    function seek(event) {
      if (event.buttons === 0 && event.type === "pointermove") return;
      const at = event.clientX - diagram.drawing.getBoundingClientRect().left;
      player.stopAt(((at - x(0)) / (x(course.end) - x(0))) * (course.shapes - 1));
    }
    diagram.drawing.addEventListener("pointerdown", seek);
    diagram.drawing.addEventListener("pointermove", seek);
    diagram.update = () => {
      const at = x(passed * course.end);
      cursor.setAttribute("x1", at);
      cursor.setAttribute("x2", at);
      const sample = Math.min(Math.ceil(passed * last), last);
      curves.forEach(
        ({ values }, k) => (outputs[k].textContent = withUnit(Math.round(values[sample] / grain) * grain, scale, DIGITS)),
      );
    };
    return diagram;
  }

  /** The impulse of each turn, as bars. */
  function drawTurns() {
    const values = course.turn_impulses;
    const largest = Math.max(...values);
    const scale = scaleFor("N s", largest);
    const title = titleParts("contact normal impulse turn by turn", "p_n", scale.unit);
    return plot({ title, label: "contact normal impulse of each turn", id: "turns" }, (frame) => {
      const { left, right, top, bottom } = frame;
      const slot = (right - left) / values.length;
      const y = (value) => bottom - (value / (largest || 1)) * (bottom - top);
      // As many labels as there is room for.
      const every = Math.ceil(24 / slot);
      const bars = values.flatMap((value, turn) => {
        const bar = { x: left + (turn + 0.15) * slot, width: 0.7 * slot, y: y(value), height: y(0) - y(value) };
        const tip = svgElement("title", {}, `turn ${turn + 1}: ${withUnit(value, scale, DIGITS)}`);
        const rectangle = svgElement("rect", { class: "series-area", ...bar }, tip);
        if (turn % every !== 0) return [rectangle];
        const label = { x: left + (turn + 0.5) * slot, y: bottom + 15, "text-anchor": "middle" };
        return [rectangle, svgText(label, number(turn + 1))];
      });
      return [...levels([0, largest || 1], scale, y, frame), ...bars, axisName(frame, "turn")];
    });
  }

  /** Updates all views to the current place. */
  function update() {
    const { points, shapes, samples, peak_force, end } = course;
    const { nodes, moved } = parts.view;
    const frame = Math.min(Math.floor(place), shapes - 2);
    const share = place - frame;
    const between = (values, k, each) => {
      const [here, next] = [values[frame * each + k], values[(frame + 1) * each + k]];
      return here + share * (next - here);
    };
    const shape = Array.from({ length: points }, (_, k) => [
      parts.x(between(nodes.along, k, points)),
      parts.y(between(nodes.above, k, points)),
    ]);
    const way = [between(moved.along, 0, 1), -between(moved.above, 0, 1)];
    const tip = shape.at(-1);
    parts.piece.setAttribute("transform", `translate(${way.map((part) => (parts.scale * part).toFixed(2)).join(" ")})`);
    parts.filament.setAttribute("points", pointList(shape));
    parts.trace.setAttribute("points", pointList([...parts.tips.slice(0, frame + 1), tip]));
    parts.tip.setAttribute("cx", tip[0]);
    parts.tip.setAttribute("cy", tip[1]);
    const sample = Math.min(Math.ceil(passed * (samples - 1)), samples - 1);
    parts.tip.classList.toggle("touching", peak_force[sample] > 0);
    const clock = `${(passed * end * 1e3).toFixed(2)} of ${(end * 1e3).toFixed(2)}\u202fms`;
    byId("clock").textContent = clock;
    byId("time").setAttribute("aria-valuetext", clock);
    for (const diagram of diagrams) diagram.update();
  }

  function setPlace(to) {
    place = to;
    passed = to / (course.shapes - 1);
    if (parts && diagrams.length > 0) update();
  }

  viewChoice.addEventListener("change", () => {
    drawScene();
    update();
  });
  let width = 0;
  new ResizeObserver(() => {
    if (course === null || animation.clientWidth === width) return;
    width = animation.clientWidth;
    layOut();
  }).observe(animation);
  return { show };
}
