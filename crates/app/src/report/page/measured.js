// Measured forces: the table that compares them with the simulated ones, and the points that lie in a slice of the study.

/** Shows measured and simulated forces. */
function showMeasured(measured) {
  if (measured === null) return;
  const section = byId("measured");
  section.hidden = false;
  const { speed, depth, comparisons, left_out: leftOut } = measured;
  const force = (value, spread) => {
    if (value === null) return "–";
    const { factor, unit } = scaleFor("N", Math.abs(value));
    const both = spread ? `${number(value * factor, DIGITS)} ± ${number(spread * factor, 2)}` : number(value * factor, DIGITS);
    return `${both}\u202f${unit}`;
  };
  const value = (quantity, each) => withUnit(each, scaleFor(quantity.unit, each), 4);
  const row = (point) => {
    const texts = [
      value(speed, point.speed),
      value(depth, point.depth),
      force(point.force, point.std),
      point.missing ?? force(point.simulated, point.uncertainty),
      point.simulated === null ? "–" : force(point.simulated - point.force),
      point.within === null ? "–" : point.within ? "yes" : "no",
    ];
    return element("tr", {}, ...texts.map((text) => numberCell(text)));
  };
  const heading = (...content) => element("th", { scope: "col", class: "number" }, ...content);
  const tables = comparisons.map(({ condition, count, points, deviation }) => {
    const names = [symbol(speed.symbol), symbol(depth.symbol), "Measured", "Simulated", "Difference", "Within ± std"];
    const table = element(
      "table",
      {},
      element("caption", { class: "quiet" }, ...rich(condition)),
      element("thead", {}, element("tr", {}, ...names.map((name) => heading(name)))),
      element("tbody", {}, ...points.map(row)),
    );
    const rest = count - points.length;
    const more = rest > 0 ? ` ${number(rest, 9)} more points are in measured_comparison.csv.` : "";
    return [table, element("p", { class: "quiet" }, deviationText(count, deviation, force) + more)];
  });
  if (leftOut > 0) {
    tables.push([element("p", { class: "quiet" }, `${leftOut} more comparisons are in measured_comparison.csv.`)]);
  }
  byId("measured-tables").replaceChildren(...tables.flat());
}

/** Deviation of the simulated forces from the measured ones. */
function deviationText(count, deviation, force) {
  if (deviation === null) return "No point can be compared.";
  const within = deviation.within === null ? "" : `, ${deviation.within} of them within one standard deviation`;
  const compared = `${deviation.count} of ${count} points compared${within}`;
  return `${compared}. Simulated minus measured: mean ${force(deviation.bias)}, RMSE ${force(deviation.rmse)}.`;
}

/** The measured points that lie in the slice of the study at `places` on its axes, whatever their values on the axes `free`. */
function measuredIn(study, places, free) {
  if (study.measured === null) return [];
  const isNear = (a, b) => Math.abs(a - b) <= 1e-9 * Math.max(Math.abs(a), Math.abs(b));
  const isAt = (value, k) => value === null || free.includes(k) || isNear(value, study.axes[k].values[places[k]]);
  const isInSlice = ({ at, outside }) => !outside && at.every(isAt);
  return study.measured.comparisons.flatMap(({ points }) => points).filter(isInSlice);
}

/** The place of a value between those of an axis: a whole number at one of them; `null` outside. */
function placeBetween(values, value) {
  for (let i = 0; i < values.length; i++) {
    if (Math.abs(values[i] - value) <= 1e-9 * Math.abs(value)) return i;
    const next = values[i + 1];
    if (next !== undefined && values[i] < value !== next < value) return i + (value - values[i]) / (next - values[i]);
  }
  return null;
}
