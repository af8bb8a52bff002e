// Fills the page with its study and connects its parts.

const study = JSON.parse(document.getElementById("data").textContent);
findRanges(study.quantities);
const grid = new Grid(study);

/** A sentence whose rows lead to their cases, and whose numbers stay with their units. */
function sentence(text) {
  const unbroken = text.replace(/(?<=\d) (?=[\p{L}%])|(?<=[≥≤]) | (?=[≥≤])/gu, "\u00a0");
  const parts = unbroken.split(/(?<=\brows? )(\d+)/);
  return parts.flatMap((part, k) =>
    k % 2 === 0 || !indexOfRow.has(Number(part)) ? rich(part) : element("a", { href: `#case-${part}` }, part),
  );
}

/** Goal of the file and its answer; without a question, the highest force in two sentences. */
function showHeadline() {
  if (!study.answer) {
    byId("headline").hidden = false;
    byId("headline").replaceChildren(...sentence(study.headline));
    return;
  }
  const { question, lines, notes } = study.answer;
  const items = (texts) => texts.map((text) => element("li", {}, ...sentence(text)));
  byId("answer").hidden = false;
  byId("question").replaceChildren(...sentence(question));
  byId("recommended").replaceChildren(...sentence(lines[0]));
  byId("known").replaceChildren(...items(lines.slice(1)));
  byId("to-keep-in-mind").replaceChildren(...items(notes));
}

function showHead() {
  byId("name").textContent = study.name;
  const swept = grid.named
    .filter((axis) => grid.axes.includes(axis))
    .map((axis) => {
      const mark = axis.symbol ? [" ", symbol(axis.symbol), "\u00a0=\u00a0"] : [" "];
      return [axis.name, ...mark, `${rangeText(axis)} (${countText(axis)})`];
    });
  const what = study.brush ? ["One sector", "sectors"] : ["One contact", "contacts"];
  const cases = study.cases === 1 ? what[0] : `${number(study.cases, 9)} ${what[1]}`;
  const of = study.brush ? "of a brush whose filaments touch each other" : "of one abrasive filament with the workpiece";
  const list = swept.flatMap((parts, k) => [k === 0 ? " over " : ", ", ...parts]);
  const outcome =
    study.failed === 0 ? "" : ` ${number(study.failed, 9)} of them ${study.failed === 1 ? "has" : "have"} failed.`;
  const shown = study.quantities[0].values.length;
  const selection =
    shown < study.cases ? ` This page shows ${number(shown, 9)} of them, evenly spread; runs.csv has all.` : "";
  byId("summary").replaceChildren(`${cases} ${of}`, ...list, `.${outcome}${selection}`);
}

/** From the first to the last of the swept values, or names. */
function rangeText({ names, values, scale }) {
  if (names) return names.length > 4 ? `${names[0]}\u00a0…\u00a0${names.at(-1)}` : names.join(", ");
  const last = withUnit(values.at(-1), scale);
  return values.length === 1 ? last : `${number(values[0] * scale.factor)}\u00a0…\u00a0${last}`;
}

function countText({ count, names }) {
  if (names) return count === 1 ? "1 tool" : `${number(count)} tools`;
  return count === 1 ? "1 value" : `${number(count)} values`;
}

/** A setting's value and unit, or the range of a swept one. */
function settingText(setting) {
  const swept = grid.axes.find((axis) => axis.path === setting.path);
  if (swept === undefined && setting.by_tool) return byToolText(setting);
  if (swept === undefined) return fixedSettingText(setting);
  return [rangeText(swept), quiet(`swept, ${countText(swept)}`)];
}

/** A setting's value for each of the tools, which differ in it. */
function byToolText({ by_tool: values, unit }) {
  return study.tools.map((name, k) => element("div", {}, `${name}: `, ...fixedSettingText({ value: values[k], unit })));
}

function showSources() {
  const sum = (values) => values.reduce((sum, value) => sum + (value ?? 0), 0);
  const total = study.statistics.map(({ name, values }) => `${number(sum(values), 12)} ${name}`);
  const kept = study.courses.length;
  const courses = study.brush
    ? "none; `bristle simulate` has a page with the sector in motion"
    : kept + study.errors.length >= study.cases
      ? "of all cases that were solved"
      : `of ${kept} cases, evenly spread over the study`;
  const scatters = study.quantities.some(({ key }) => key.startsWith(SHARE));
  showOrigin(study, [
    ["Solver, all cases shown", [total.join(", ")]],
    ["Courses over time", [study.brush ? courses : `${courses}, from a second integration at the same settings`]],
    [
      "Uncertainty of F_n,w",
      rich(`± from the number of filaments alone: F_n,w ΔN_f / N_f${scatters ? "; the 95 % band from sampled tools" : ""}`),
    ],
  ]);
}

const caseView = createCaseView(study, grid);
const indexOfRow = new Map(study.quantities[0].values.map((_, index) => [grid.row(index), index]));
/** The case in the address, `#case-37` for row 37 of runs.csv: cases can be linked to, and the back button leaves them. */
function caseOfAddress() {
  const row = Number(/^#case-(\d+)$/.exec(location.hash)?.[1]);
  return indexOfRow.get(row) ?? null;
}

function showCase(index) {
  overview.markOpen(index);
  caseView.show(index);
}

const overview = createOverview(study, grid, (index) => {
  const address = `#case-${grid.row(index)}`;
  if (location.hash === address) goToCase();
  else location.hash = address;
});

function goToCase(options) {
  const title = byId("case-title");
  title.focus({ preventScroll: true });
  title.scrollIntoView(options);
}

// A link to the case that is open changes no address.
addEventListener("click", ({ target }) => {
  if (target.closest?.("a")?.getAttribute("href") === location.hash && caseOfAddress() !== null) goToCase();
});

addEventListener("hashchange", () => {
  const index = caseOfAddress();
  if (index === null) return;
  showCase(index);
  goToCase();
});

showHead();
datePrints(study.version);
showHeadline();
showMeasured(study.measured);
showNotes(study.notes, sentence);
showSettings(study.settings, settingText);
showSources();
// Without an address: the case of the answer, or the one nearest to the middle of the study that has a course, or has not failed.
const kept = study.courses.map(([index]) => index);
const failed = new Set(study.errors.map(([index]) => index));
const solved = [...indexOfRow.values()].filter((index) => !failed.has(index));
const answered = study.answer?.rows.map((row) => indexOfRow.get(row)).find((index) => index !== undefined);
const middle = grid.index(grid.axes.map(({ values }) => Math.floor(values.length / 2)));
const asked = caseOfAddress();
showCase(asked ?? answered ?? grid.nearest(middle, kept.length > 0 ? kept : solved) ?? middle);
if (asked !== null) goToCase({ behavior: "instant" });
