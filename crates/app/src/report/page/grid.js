// The grid of cases: positions and names of cases, values and labels of axes.

const VELOCITY = "process.brushing_velocity_m_s";
const SPEED = "process.rotational_speed_rpm";
const DEPTH = "process.penetration_depth_m";
const PRESSED = "process.tool_force_n";

/** The name of a setting or a quantity, short enough for an axis. */
const shortName = ({ name, path }) => (path === PRESSED ? "tool force" : name);

/** `true` if a study states forces in place of depths. */
function isPressedOn({ axes, settings }) {
  return axes.some(({ path }) => path === PRESSED) || settings.some(({ path, value }) => path === PRESSED && value > 0);
}

/** The cases of a study by their positions on its axes; the last axis changes fastest. */
class Grid {
  constructor(study) {
    this.axes = study.axes.map((axis) => {
      const scale = scaleFor(axis.unit, Math.max(...axis.values.map(Math.abs)));
      return { ...axis, scale, label: axis.symbol || shortName(axis) };
    });
    const fixed = (path) => {
      const setting = study.settings.find((setting) => setting.path === path);
      return {
        ...setting,
        values: [setting.value],
        scale: scaleFor(setting.unit, setting.value),
        label: setting.symbol || shortName(setting),
      };
    };
    // Velocity, or rotational speed, and depth, or the force in its place, belong to a case's name, swept or not.
    const paths = this.axes.map((axis) => axis.path);
    const named = [paths.includes(SPEED) ? SPEED : VELOCITY, isPressedOn(study) ? PRESSED : DEPTH];
    const missing = named.filter((path) => !paths.includes(path)).map(fixed);
    const rank = (axis) => named.indexOf(axis.path) >>> 0;
    this.named = [...this.axes, ...missing].sort((a, b) => rank(a) - rank(b));
  }

  /** The case at a place on each axis. */
  index(places) {
    return this.axes.reduce((index, axis, k) => index * axis.values.length + places[k], 0);
  }

  /** The place of a case on each axis. */
  places(index) {
    const places = [];
    for (const axis of [...this.axes].reverse()) {
      places.unshift(index % axis.values.length);
      index = Math.floor(index / axis.values.length);
    }
    return places;
  }

  /** The one of some cases that is the fewest positions away from a case; `undefined` if there is none. */
  nearest(index, cases) {
    const places = this.places(index);
    const distance = (other) =>
      this.places(other).reduce((sum, place, k) => sum + ((place - places[k]) / this.axes[k].values.length) ** 2, 0);
    return cases.reduce((best, other) => (distance(other) < distance(best) ? other : best), cases[0]);
  }

  /** The row of a case in `runs.csv`, below the heading, counted from 1. */
  row(index) {
    const places = this.places(index);
    return 1 + this.axes.reduce((row, axis, k) => row * axis.count + axis.positions[places[k]], 0);
  }

  /** The name of a case: the values of swept settings, velocity and depth. */
  name(index) {
    const places = this.places(index);
    return this.named
      .map((axis) => {
        const place = this.axes.indexOf(axis);
        const value = axisText(axis, place < 0 ? 0 : places[place]);
        return axis.names ? `${axis.label} ${value}` : `${axis.label} = ${value}`;
      })
      .join(", ");
  }
}

/** A value of an axis with its unit, or a name. */
function axisText({ names, values, scale }, place) {
  return names?.[place] ?? withUnit(values[place], scale);
}

/** A value of an axis as it stands beside the axis: a number, or a name that is cut if it is long. */
function tickText({ names, values, scale }, place) {
  if (!names) return number(values[place] * scale.factor, 4);
  const letters = [...names[place]];
  return letters.length > 18 ? `${letters.slice(0, 17).join("")}…` : names[place];
}

/** Label of an axis: quantity and unit. */
function axisLabel({ name, path, symbol, scale }) {
  const label = symbol ? `${name} ${symbol}` : shortName({ name, path });
  return scale.unit ? `${label} in ${scale.unit}` : label;
}

/** At most `limit` positions of an axis to label: those with round values if there are any, otherwise evenly spread ones. */
function labelledPlaces({ values, scale }, limit) {
  if (values.length <= limit) return values.keys();
  const scaled = values.map((value) => value * scale.factor);
  const [low, high] = [Math.min(...scaled), Math.max(...scaled)];
  for (let count = Math.min(limit - 1, 12); count >= 3; count--) {
    const round = ticks(low, high, count);
    const places = round.map((tick) => scaled.findIndex((value) => Math.abs(value - tick) < 1e-6 * (high - low)));
    if (places.length > 2 && places.length <= limit && !places.includes(-1)) return places;
  }
  const every = Math.ceil(values.length / limit);
  return Array.from({ length: Math.floor(values.length / every) }, (_, k) => (k + 1) * every - 1);
}
