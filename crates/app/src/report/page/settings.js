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

/** The name of a setting with its key. */
const settingHeading = ({ name, path }) => [name, " ", element("code", { class: "quiet" }, path)];

/** Fills the tables of the settings, one for each section of the input file; `text` gives the text of a value. */
function showSettings(settings, text) {
  const sectionOf = ({ path }) => path.split(".")[0];
  const sections = [...new Set(settings.map(sectionOf))];
  const tables = sections.map((section) => {
    const rows = settings
      .filter((setting) => sectionOf(setting) === section)
      .map((setting) => tableRow({}, settingHeading(setting), symbolCell(setting.symbol), numberCell(...text(setting))));
    return element("table", {}, element("caption", {}, section), element("tbody", {}, ...rows));
  });
  byId("settings").replaceChildren(...tables);
}

/** Shows what a reader should know about settings and results; `prose` makes elements of a sentence. */
function showNotes({ warnings, findings, assumptions }, prose) {
  const ofSettings = warnings.map((warning) => [`Warning: ${warning.replaceAll("`", "")}`]);
  const ofResults = findings.map(({ id, statement, help }) => [
    element("code", {}, id),
    ": ",
    ...prose(`${statement}.`),
    // It has keys of the input file, which are no symbols.
    help ? ` Help: ${help}.` : "",
  ]);
  const items = [...ofSettings, ...ofResults].map((content) => element("li", {}, ...content));
  byId("warnings").hidden = items.length === 0;
  byId("warnings").replaceChildren(...items);
  showAssumptions(assumptions);
}

/** Shows the settings that the input file leaves to their defaults or to a material, and what a change of each does to the tool force. */
function showAssumptions({ row, place, list, notes }) {
  if (list.length === 0) return;
  const section = byId("assumptions");
  section.hidden = false;
  const note = `The input file does not state these settings, which decide the force. Each was changed alone at ${place}${row === null ? "" : ` (row ${row})`}. ${notes.join(" ")}`;
  byId("assumptions-note").replaceChildren(...rich(note));
  const percent = (change) => (change === null ? "–" : `${change < 0 ? "" : "+"}${number(100 * change, 3)}\u202f%`);
  const rows = list.map((setting) => {
    const { symbol: mark, unit, value, changed, force_change: change } = setting;
    const texts = [value, changed].map((each) => rich(withUnit(each, scaleFor(unit, Math.abs(changed)))));
    const cells = [...texts, [percent(change)]].map((text) => numberCell(...text));
    return tableRow({}, settingHeading(setting), symbolCell(mark), ...cells);
  });
  section.querySelector("th:last-child").replaceChildren(...rich("F_n,w changes by"));
  section.querySelector("tbody").replaceChildren(...rows);
}

/** Tells on paper what has made the page, and when it was printed. */
function datePrints(version) {
  addEventListener("beforeprint", () => {
    const today = new Date().toLocaleDateString("sv");
    byId("printed").textContent = `Bristle ${version}, printed on ${today}`;
  });
}

/** Fills the list of where the numbers come from: program, equations, `entries` with names and texts, and model. */
function showOrigin({ version, equations }, entries, more = "") {
  const all = [
    ["Software", [`Bristle ${version}`]],
    ["Equations of motion", [`derived by ${equations.maker}`]],
    ["Hash of the equations", [element("code", {}, equations.sha256), " (SHA-256)"]],
    ...entries,
    ["Model", [`E. Uhlmann, A. Hoyer: Modeling of Contact Forces for Brushing Tools. Ceramics 4 (2021)${more}`]],
  ];
  const items = all.flatMap(([name, text]) => [element("dt", {}, ...rich(name)), element("dd", {}, ...text)]);
  byId("origin").replaceChildren(...items);
}
