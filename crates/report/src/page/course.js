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
/** What a contact does per length of the workpiece's profile. */
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
  const [animation, scene, slider] = ["animation", "scene", "time"].map(byId);
  const [playButton, speed, viewChoice] = ["play", "speed", "view"].map(byId);
  let course = null;
  /** Time shown, in s, and time of the last frame while playing. */
  let time = 0;
  let playing = null;
  let parts = null;
  let diagrams = [];

  function show(index) {
    pause();
    const name = grid.name(index);
    byId("case-title").replaceChildren(...rich(name));
    byId("case").dataset.index = index;
    course = unpackAll(courses.get(index) ?? null);
    byId("course").hidden = course === null;
    byId("tables").hidden = errors.has(index);
    byId("case-row").textContent = number(grid.row(index), 9);
    showNote(index);
    showTables(index);
    if (course === null) return;
    scene.setAttribute("aria-label", `Filament at ${name}`);
    byId("view-choice").hidden = !course.views;
    byId("seen").hidden = Boolean(course.views);
    if (course.views && viewChoice.options.length === 0)
      viewChoice.append(...course.views.map(({ name }, k) => element("option", { value: k }, name)));
    const slow = Math.round(PLAYING_TIME / course.end);
    byId("slowdown").textContent = slow > 1 ? `At speed 1 it is slowed down ${number(slow, 2)} times.` : "";
    setTime(0);
    layOut();
  }

  function showNote(index) {
    const notes = [];
    if (errors.has(index)) {
      notes.push([`This case has failed: ${errors.get(index)}`]);
    } else if (course === null && courses.size === 0) {
      notes.push([
        study.brush
          ? "This page holds no course over time: `bristle brush` shows the sector of one case in motion."
          : "This page holds no course over time.",
      ]);
    } else if (course === null) {
      const nearest = nearestCourse(index);
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

  /** The case with a course that is the fewest positions away. */
  function nearestCourse(index) {
    const places = grid.places(index);
    const distance = (other) =>
      grid.places(other).reduce((sum, place, k) => sum + ((place - places[k]) / grid.axes[k].values.length) ** 2, 0);
    return [...courses.keys()].reduce((best, other) => (distance(other) < distance(best) ? other : best));
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
    diagrams = [...known.map(drawDiagram), ...worked.map(drawWork)];
    const turns = course.turn_impulses.length > 1 ? [drawTurns()] : [];
    byId("curves").replaceChildren(...[...diagrams, ...turns].map(({ figure }) => figure));
    for (const bars of turns) bars.layOut();
    // Sizes are known once the figures are in the page.
    for (const diagram of diagrams) diagram.layOut();
    update();
  }

  /** What is seen of the course: in a view of its own, or along the axis of an upright tool. */
  const seenView = () => course.views?.[Number(viewChoice.value)] ?? null;

  /** Left, right, lower and upper end of the scene, in m. */
  function windowOf(view) {
    const { body_radius, tool_radius, along, above } = course;
    if (view) {
      const [left, right, low, high] = view.window;
      const margin = AROUND * Math.max(right - left, high - low);
      return [left - margin, right + margin, low - margin, high + margin];
    }
    const margin = 0.08 * (tool_radius - body_radius);
    return [Math.min(...along) - margin, Math.max(...along) + margin, 0, Math.max(...above) + 2 * margin];
  }

  /** The body of the tool and the undeformed trim, each a list of shapes. */
  function toolParts(view, { x, y, scale }) {
    const { body_radius, tool_radius, axis_height } = course;
    if (view) {
      const shape = (style) => ({ along, above }) =>
        svgElement("polyline", { class: style, points: pointList(Array.from(along, (value, k) => [x(value), y(above[k])])) });
      return [view.body.map(shape("scene-body")), view.trim.map(shape("scene-nominal"))];
    }
    const circle = (style, radius) =>
      svgElement("circle", { class: style, cx: x(0), cy: y(axis_height), r: scale * radius });
    return [[circle("scene-body", body_radius)], [circle("scene-nominal", tool_radius)]];
  }

  function drawScene() {
    const view = seenView();
    const { points: count, shapes, tool_radius, axis_height } = course;
    const { along, above, outline } = view ?? course;
    const [low, high, bottom, top] = windowOf(view);
    const width = animation.clientWidth;
    const scale = Math.min(width / (high - low), 390 / (top - bottom));
    // The workpiece is as thick as the undeformed tool penetrates it, plus the height of its label.
    const below = view ? 28 : Math.max(scale * (tool_radius - axis_height) + 8, 28);
    const height = Math.round(scale * (top - bottom) + below);
    const shift = (width - scale * (high - low)) / 2;
    const x = (along) => shift + scale * (along - low);
    const y = (above) => scale * (top - above);
    scene.setAttribute("viewBox", `0 0 ${width} ${height}`);
    scene.setAttribute("height", height);

    const shape = (frame) =>
      Array.from({ length: count }, (_, k) => [x(along[frame * count + k]), y(above[frame * count + k])]);
    const tips = Array.from({ length: shapes }, (_, frame) => shape(frame).at(-1));
    const ghosts = Array.from({ length: 15 }, (_, k) => shape(Math.round((k * (shapes - 1)) / 14)));
    // A scale bar of a round length, about a sixth of the width.
    const length = ticks(0, (high - low) / 3, 2)[1] ?? high - low;
    const label = withUnit(length, scaleFor("m", length));
    const [from, level] = [width - 14 - scale * length, height - 10];
    const { work } = course;
    const points = (along, above) => Array.from(along, (value, k) => [x(value), y(above[k])]);
    const surface = points(outline.along, outline.above);
    // Friction work if there is any; it is what removes material.
    const bars = Math.max(0, ...work.friction) > 0 ? work.friction : work.impulse;
    const largest = Math.max(0, ...bars);
    const workedLine = view ? view.work : work;
    const worked = workedLine ? points(workedLine.along, workedLine.above) : null;
    const raised = Array.from(worked ? bars : [], (value, k) =>
      quadrilateral(worked[k], worked[k + 1], (LONGEST_BAR * value) / largest),
    );
    const thickness = view ? Math.max(height - y(0), THICKNESS) : height - y(0);
    parts = {
      x,
      y,
      scale,
      piece: svgElement(
        "g",
        { id: "workpiece" },
        svgElement("path", { class: "scene-work", d: material(surface, outline.solid, thickness) }),
        svgElement("path", { class: "scene-done", d: largest > 0 ? raised.join("") : "" }),
        svgElement("polyline", { class: "scene-surface", points: pointList(surface) }),
      ),
      trace: svgElement("polyline", { class: "scene-trace" }),
      filament: svgElement("polyline", { class: "scene-filament", id: "filament" }),
      tip: svgElement("circle", { class: "scene-tip", r: 4.5 }),
      tips,
      along,
      above,
      view,
    };
    const [body, trim] = toolParts(view, parts);
    scene.replaceChildren(
      // What is seen against its axis has the workpiece in front of its body.
      ...(view ? [...body, parts.piece] : [parts.piece, ...body]),
      ...trim,
      ...ghosts.map((points) => svgElement("polyline", { class: "scene-ghost", points: pointList(points) })),
      svgElement("polyline", { class: "scene-way", points: pointList(tips) }),
      parts.trace,
      parts.filament,
      parts.tip,
      svgElement("path", { class: "scene-scale", d: `M${from} ${level - 4}v4h${scale * length}v-4` }),
      svgText({ x: from - 6, y: level, "text-anchor": "end" }, label),
      svgText({ x: 8, y: 16, class: "quiet" }, "brush body"),
      svgText({ x: 8, y: height - 8, class: "quiet" }, "workpiece"),
    );
  }

  /** Lines across a diagram at round values of its vertical axis, whose heights `y` gives, with the values beside them. */
  function levels([low, high], { factor }, y, left, right) {
    return ticks(low * factor, high * factor, 4).flatMap((value) => {
      const level = y(value / factor);
      return [
        svgElement("line", { class: "axis", x1: left, x2: right, y1: level, y2: level }),
        svgText({ x: left - 6, y: level + 4, "text-anchor": "end" }, number(value, 4)),
      ];
    });
  }

  /** Round values of a horizontal axis in thousandths of its unit, about `count`, at the places that `x` gives. */
  function thousandths([low, high], count, x, y) {
    return ticks(low * 1e3, high * 1e3, Math.max(2, count)).map((value) =>
      svgText({ x: x(value / 1e3), y, "text-anchor": "middle" }, number(value, 4)),
    );
  }

  /** What the contact does per length over the arc length of the profile; edges are shaded. */
  function drawWork({ name, unit, key }) {
    const { arc_length, on_edge, cells } = course.work;
    const values = course.work[key];
    const largest = Math.max(...values);
    const scale = scaleFor(unit, largest);
    const title = element("figcaption", {}, ...titleParts(name, "", scale.unit));
    const drawing = svgElement("svg", { role: "img", "aria-label": name });
    const figure = element("figure", { class: "curve work" }, title, drawing);

    function layOutWork() {
      const width = figure.clientWidth;
      const [left, right, top, bottom, height] = [44, 10, 16, 34, 150];
      const [low, high] = [arc_length[0], arc_length[cells]];
      const x = (length) => left + ((length - low) / (high - low)) * (width - left - right);
      const y = (value) => height - bottom - (value / largest) * (height - bottom - top);
      drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
      drawing.setAttribute("height", height);
      const each = (draw) => Array.from({ length: cells }, (_, k) => draw(k));
      const shaded = each((k) =>
        on_edge[k] > 0.5
          ? `M${x(arc_length[k]).toFixed(2)} ${top}H${x(arc_length[k + 1]).toFixed(2)}V${height - bottom}H${x(arc_length[k]).toFixed(2)}Z`
          : "",
      );
      const steps = each((k) => [arc_length[k], arc_length[k + 1]].map((at) => [x(at), y(values[k])])).flat();
      const label = on_edge.some((value) => value > 0.5) ? "arc length in mm; shaded: edges" : "arc length in mm";
      drawing.replaceChildren(
        svgElement("path", { class: "work-edge", d: shaded.join("") }),
        ...levels([0, largest], scale, y, left, width - right),
        ...thousandths([low, high], width / 80, x, height - bottom + 15),
        svgText({ x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, label),
        svgElement("polygon", { class: "work-area", points: pointList([[x(low), y(0)], ...steps, [x(high), y(0)]]) }),
      );
    }
    return { figure, layOut: layOutWork, update() {} };
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
    const title = element("figcaption", {}, ...titleParts(name, mark, scale.unit));
    const outputs = curves.map(() => element("output", {}));
    const keys = curves.map((curve, k) => {
      const sample = curve.area
        ? svgElement("rect", { class: style(curve), x: 1, y: 1, width: 24, height: 8 })
        : svgElement("line", { class: style(curve), x1: 1, x2: 25, y1: 5, y2: 5 });
      const key = svgElement("svg", { viewBox: "0 0 26 10", "aria-hidden": "true" }, sample);
      return element("li", {}, key, curve.name, outputs[k]);
    });
    const drawing = svgElement("svg", { role: "img", "aria-label": `${name} over time` });
    const figure = element("figure", { class: "curve" }, title, element("ul", { class: "keys" }, ...keys), drawing);
    const cursor = svgElement("line", { class: "cursor" });
    let plot = null;

    function layOutDiagram() {
      const width = figure.clientWidth;
      const [left, right, top, bottom, height] = [44, 10, 16, 34, 170];
      plot = { left, width: width - left - right };
      const x = (time) => left + (time / course.end) * plot.width;
      const y = (value) => height - bottom - ((value - lowest) / (highest - lowest || 1)) * (height - bottom - top);
      const points = (values) => Array.from(values, (value, i) => [x((i / last) * course.end), y(value)]);
      drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
      drawing.setAttribute("height", height);
      const content = [
        ...levels([lowest, highest || 1], scale, y, left, left + plot.width),
        ...thousandths([0, course.end], plot.width / 80, x, height - bottom + 15),
        svgText({ x: left + plot.width / 2, y: height - 4, "text-anchor": "middle" }, "time in ms"),
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
          const time = ofFirst + turn * course.turn;
          const at = { x1: x(time), x2: x(time), y1: top - 4, y2: height - bottom };
          content.push(svgElement("line", { class: "nominal", ...at }));
          // The labels of several turns would hide each other.
          if (course.turn_impulses.length === 1)
            content.push(svgText({ class: "quiet", x: x(time) + 4, y: top - 5 }, label));
        }
        if (course.turn_impulses.length > 1 && x(course.turn) - x(0) > 60)
          content.push(svgText({ class: "quiet", x: x(before + turn * course.turn) + 4, y: top - 5 }, `turn ${turn + 1}`));
      });
      for (const curve of curves) {
        const line = points(curve.values);
        const outline = curve.area ? [[x(0), y(0)], ...line, [x(course.end), y(0)]] : line;
        const shape = { class: style(curve), points: pointList(outline) };
        content.push(svgElement(curve.area ? "polygon" : "polyline", shape));
      }
      cursor.setAttribute("y1", top - 4);
      cursor.setAttribute("y2", height - bottom);
      drawing.replaceChildren(...content, cursor);
    }

    /** Goes to the time under the pointer. */
    function seek(event) {
      if (event.buttons === 0 && event.type === "pointermove") return;
      const x = event.clientX - drawing.getBoundingClientRect().left;
      pause();
      setTime(((x - plot.left) / plot.width) * course.end);
    }
    drawing.addEventListener("pointerdown", seek);
    drawing.addEventListener("pointermove", seek);

    return {
      figure,
      layOut: layOutDiagram,
      update() {
        const place = (time / course.end) * plot.width + plot.left;
        cursor.setAttribute("x1", place);
        cursor.setAttribute("x2", place);
        const sample = Math.min(Math.ceil((time / course.end) * last), last);
        curves.forEach(
          ({ values }, k) => (outputs[k].textContent = withUnit(Math.round(values[sample] / grain) * grain, scale, DIGITS)),
        );
      },
    };
  }

  /** The impulse of each turn, as bars. */
  function drawTurns() {
    const values = course.turn_impulses;
    const largest = Math.max(...values);
    const scale = scaleFor("N s", largest);
    const title = element("figcaption", {}, ...titleParts("contact normal impulse turn by turn", "p_n", scale.unit));
    const drawing = svgElement("svg", { role: "img", "aria-label": "contact normal impulse of each turn" });
    const figure = element("figure", { class: "curve", id: "turns" }, title, drawing);
    function layOut() {
      const width = figure.clientWidth;
      const [left, right, top, bottom, height] = [44, 10, 16, 34, 170];
      const slot = (width - left - right) / values.length;
      const y = (value) => height - bottom - (value / (largest || 1)) * (height - bottom - top);
      drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
      drawing.setAttribute("height", height);
      // As many labels as there is room for.
      const every = Math.ceil(24 / slot);
      const bars = values.flatMap((value, turn) => {
        const bar = { x: left + (turn + 0.15) * slot, width: 0.7 * slot, y: y(value), height: y(0) - y(value) };
        const tip = svgElement("title", {}, `turn ${turn + 1}: ${withUnit(value, scale, DIGITS)}`);
        const rectangle = svgElement("rect", { class: "series-area", ...bar }, tip);
        if (turn % every !== 0) return [rectangle];
        const place = { x: left + (turn + 0.5) * slot, y: height - bottom + 15, "text-anchor": "middle" };
        return [rectangle, svgText(place, number(turn + 1))];
      });
      const name = svgText({ x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, "turn");
      drawing.replaceChildren(...levels([0, largest || 1], scale, y, left, width - right), ...bars, name);
    }
    return { figure, layOut };
  }

  /** Updates all views to the current time. */
  function update() {
    const { points, shapes, samples, peak_force, end } = course;
    const { along, above, view } = parts;
    const place = (time / end) * (shapes - 1);
    const frame = Math.min(Math.floor(place), shapes - 2);
    const share = place - frame;
    const between = (values, k, each = points) => {
      const [here, next] = [values[frame * each + k], values[(frame + 1) * each + k]];
      return here + share * (next - here);
    };
    const shape = Array.from({ length: points }, (_, k) => [parts.x(between(along, k)), parts.y(between(above, k))]);
    const way = view
      ? [between(view.moved_along, 0, 1), -between(view.moved_above, 0, 1)]
      : [course.feed * time];
    const tip = shape.at(-1);
    parts.piece.setAttribute("transform", `translate(${way.map((part) => (parts.scale * part).toFixed(2)).join(" ")})`);
    parts.filament.setAttribute("points", pointList(shape));
    parts.trace.setAttribute("points", pointList([...parts.tips.slice(0, frame + 1), tip]));
    parts.tip.setAttribute("cx", tip[0]);
    parts.tip.setAttribute("cy", tip[1]);
    const sample = Math.min(Math.ceil((time / end) * (samples - 1)), samples - 1);
    parts.tip.classList.toggle("touching", peak_force[sample] > 0);
    const clock = `${(time * 1e3).toFixed(2)} of ${(end * 1e3).toFixed(2)}\u202fms`;
    byId("clock").textContent = clock;
    slider.value = Math.round((time / end) * Number(slider.max));
    slider.setAttribute("aria-valuetext", clock);
    for (const diagram of diagrams) diagram.update();
  }

  function setTime(value) {
    time = Math.min(Math.max(value, 0), course.end);
    if (parts && diagrams.length > 0) update();
  }

  function pause() {
    if (playing !== null) cancelAnimationFrame(playing.request);
    playing = null;
    playButton.textContent = "Play";
  }

  function play() {
    if (time >= course.end) setTime(0);
    playButton.textContent = "Pause";
    const next = (now) => {
      const passed = (now - playing.last) / 1e3;
      setTime(time + (passed * Number(speed.value) * course.end) / PLAYING_TIME);
      if (time >= course.end) {
        pause();
      } else {
        playing = { last: now, request: requestAnimationFrame(next) };
      }
    };
    playing = { last: performance.now(), request: requestAnimationFrame(next) };
  }

  const toggle = () => (playing === null ? play() : pause());
  function go(shapes) {
    pause();
    setTime(time + (shapes * course.end) / (course.shapes - 1));
  }

  playButton.addEventListener("click", toggle);
  viewChoice.addEventListener("change", () => {
    drawScene();
    update();
  });
  slider.addEventListener("input", () => {
    pause();
    setTime((Number(slider.value) / Number(slider.max)) * course.end);
  });
  onKeys(animation, {
    " ": toggle,
    ArrowLeft: () => go(-1),
    ArrowRight: () => go(1),
    Home: () => go(-Infinity),
    End: () => go(Infinity),
  });
  let width = 0;
  new ResizeObserver(() => {
    if (course === null || animation.clientWidth === width) return;
    width = animation.clientWidth;
    layOut();
  }).observe(animation);
  return { show };
}
