// The settings of a simulation as tables, and the list of where the numbers come from.

/** The numbers of a vector, or of a list of vectors. */
function vectorText(value) {
  return `(${value.map((part) => (Array.isArray(part) ? vectorText(part) : number(part))).join(", ")})`;
}

/** A setting's value and unit. */
function fixedSettingText({ value, unit }) {
  if (Array.isArray(value)) return [value.length > 0 ? `${vectorText(value)}${unit ? `\u202f${unit}` : ""}` : "–"];
  if (value === null) return ["–"];
  if (typeof value !== "number") return [String(value)];
  return rich(withUnit(value, scaleFor(unit, Math.abs(value)), 12));
}

/** Fills the tables of the settings, one for each section of the input file; `text` gives the text of a value. */
function showSettings(settings, text) {
  const sectionOf = ({ path }) => path.split(".")[0];
  const sections = [...new Set(settings.map(sectionOf))];
  const tables = sections.map((section) => {
    const rows = settings
      .filter((setting) => sectionOf(setting) === section)
      .map((setting) =>
        element(
          "tr",
          {},
          element("th", { scope: "row" }, setting.name, " ", element("code", { class: "quiet" }, setting.path)),
          element("td", {}, setting.symbol ? symbol(setting.symbol) : []),
          element("td", { class: "number" }, ...text(setting)),
        ),
      );
    return element("table", {}, element("caption", {}, section), element("tbody", {}, ...rows));
  });
  document.getElementById("settings").replaceChildren(...tables);
}

/** Fills the list of where the numbers come from, with names and their texts. */
function showEntries(entries) {
  document
    .getElementById("origin")
    .replaceChildren(
      ...entries.flatMap(([name, text]) => [element("dt", {}, ...rich(name)), element("dd", {}, ...text)]),
    );
}
