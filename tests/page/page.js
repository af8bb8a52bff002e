// The page of a study in a browser: actions of a reader, and the looks of the page.
//
//   node page.js REPORTS SCREENSHOTS
//
// REPORTS holds pages that `bristle study` has written (see .ci/run): paper.html of examples/zirconia.toml, deburring.html of
// examples/deburring.toml, and smaller ones that sweep three settings, one, and none, simulate three turns, compare tools, and tilt a cup. brush.html of
// examples/brush.toml and tilted.html are pages that `bristle simulate` has written.

import assert from "node:assert/strict";
import path from "node:path";
import { test } from "node:test";

import "./map.js";
import {
  NARROW,
  cell,
  fitsAcross,
  opened,
  report,
  says,
  screenshots,
  shape,
  shot,
  valuesOf,
  visit,
  visiting,
  withData,
} from "./visits.js";

test("the filament moves: play, pause, slider, keys, curves", visiting("paper#case-66", async (page) => {
  const start = await shape(page);
  assert.equal(start.split(" ").length, 26);
  await page.click("#play");
  assert.equal(await page.textContent("#play"), "Pause");
  await page.waitForFunction((start) => document.getElementById("filament").getAttribute("points") !== start, start);
  await page.click("#play");
  assert.equal(await page.textContent("#play"), "Play");
  const paused = await shape(page);
  await page.waitForTimeout(100);
  assert.equal(await shape(page), paused);

  await page.locator("#time").fill("700");
  const late = await shape(page);
  assert.notEqual(late, paused);
  const cursor = () => page.getAttribute(".curve .cursor >> nth=0", "x1").then(Number);
  const there = await cursor();
  await page.focus("#time");
  await page.keyboard.press("ArrowLeft");
  assert.notEqual(await shape(page), late);

  await page.focus("#animation");
  await page.keyboard.press("Home");
  assert.equal(await shape(page), start);
  assert.ok((await cursor()) < there, "the cursor of the curves goes with the filament");
  await page.keyboard.press("ArrowRight");
  assert.notEqual(await shape(page), start);
  await page.keyboard.press(" ");
  assert.equal(await page.textContent("#play"), "Pause");
  await page.keyboard.press(" ");
  assert.equal(await page.textContent("#play"), "Play");

  await page.selectOption("#speed", "2");
  await page.keyboard.press("End");
  const end = await shape(page);
  await page.click("#play");
  await page.waitForFunction((end) => document.getElementById("filament").getAttribute("points") !== end, end);
  await page.click("#play");

  const curve = page.locator(".curve > svg").first();
  await curve.scrollIntoViewIfNeeded();
  const box = await curve.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  assert.ok(Math.abs((await cursor()) - box.width / 2) < 2, "a click on a curve goes to its time");
}));

test("turn after turn: the force over all turns, and the impulse of each",
  visiting("turns#case-1", async (page, data) => {
  const value = (name) => valuesOf(data, name)[0];
  assert.equal(value("turns"), 3);
  const [, course] = data.courses[0];
  assert.equal(course.turn_impulses.length, 3);
  assert.ok(Math.abs(course.turn_impulses[2] / value("contact_normal_impulse_n_s") - 1) < 1e-9);
  assert.ok(course.turn_impulses[1] > 1.5 * course.turn_impulses[0], "it comes back vibrating");
  assert.equal(await page.locator("#turns rect").count(), 3);
  await says(page, "#turns title >> nth=1", /turn 2: [\d.]+\smN\ss/);
  const labels = await page.locator(".curve svg text").allTextContents();
  assert.ok(labels.includes("turn 3"), labels.join());
  await shot(page, "turns-1280-light");
}));

test("where the work is done is shown on the drawn and the unrolled profile of an edge",
  visiting("deburring#case-11", async (page, data) => {
  const share = valuesOf(data, "edge_share");
  assert.ok(Math.max(...share) > 0.5 && Math.min(...share) < 0.2, `shares on the edge: ${share}`);
  await says(page, "#metrics", /edge/);
  assert.ok((await page.getAttribute("#workpiece .scene-work", "d")).length > 100, "the profile is drawn");
  const titles = await page.locator(".work figcaption").allTextContents();
  assert.equal(titles.length, 2, titles.join());
  assert.match(titles.join(), /friction work along the profile/i);
  assert.ok((await page.getAttribute(".work .work-edge >> nth=0", "d")).length > 20, "the arc is shaded");
  await page.selectOption("#quantity", "edge_share");
  await shot(page, "deburring-1280-light");
}));

test("a cup is seen along its axis and from the side", async () => {
  for (const [row, options] of [
    [1, {}],
    [2, { width: NARROW, colorScheme: "dark" }],
  ]) {
    const look = async (page) => {
      await opened(page, row);
      const views = await page.locator("#view option").allTextContents();
      assert.deepEqual(views, ["along the axis", "from the side"]);
      assert.ok(await page.isHidden("#seen"));
      await page.locator("#time").fill("500");
      const along = await shape(page);
      const trim = await page.getAttribute("#scene .scene-nominal >> nth=0", "points");
      assert.ok(trim.split(" ").length > 100, "the tips turn on a circle");
      await shot(page, `cup-${row}-axis`);
      // With the keyboard, as with the mouse.
      await page.focus("#view");
      await page.keyboard.press("ArrowDown");
      assert.equal(await page.inputValue("#view"), "1");
      assert.notEqual(await shape(page), along);
      assert.equal((await page.getAttribute("#scene .scene-nominal >> nth=0", "points")).split(" ").length, 5);
      await page.locator("#time").fill("700");
      await fitsAcross(page);
      await shot(page, `cup-${row}-side`);
      // The tip ends on the surface, or above it.
      const [tip, surface] = await page.evaluate(() =>
        ["#filament", "#workpiece .scene-surface"].map((id) => {
          const { bottom } = document.querySelector(id).getBoundingClientRect();
          return bottom;
        }),
      );
      assert.ok(tip < surface + 4, `${tip} ${surface}`);
      const titles = await page.locator(".curve figcaption").allTextContents();
      for (const part of ["tip", "root"])
        assert.ok(titles.some((title) => title.startsWith(`Height of the ${part} above the workpiece`)), titles.join());
    };
    await visit(report("cup"), look, options, `#case-${row}`);
  }
  await visit(report("single"), async (page) =>
    assert.ok((await page.isHidden("#view-choice")) && (await page.isVisible("#seen"))),
  );
});

test("settings, statistics, version and hash of the equations are there", visiting("paper", async (page) => {
  const settings = await page.textContent("#settings");
  for (const text of [
    "free length",
    "filament.length_m",
    "40\u202fmm",
    "3\u202fGPa",
    "ΔN",
    "swept, 12 values",
    "process.gravity_m_s2",
  ]) {
    assert.ok(settings.includes(text), text);
  }
  await says(page, "#statistics", /accepted steps[\d\s]+unresolved steps[\d\s]+rejected steps/);
  const origin = await page.textContent("#origin");
  assert.match(origin, /Bristle \d+\.\d+\.\d+/);
  assert.match(origin, /[0-9a-f]{64} \(SHA-256\)/);
}));

test("where filaments scatter, the band and the shares of the inputs are there",
  visiting("curve#case-2", async (page, data) => {
  const value = (name) => valuesOf(data, name)[1];
  const force = value("tool_contact_normal_force_n");
  assert.ok(value("tool_force_lower_95_n") < force && force < value("tool_force_upper_95_n"));
  await says(page, "#metrics", /lower end of the 95 % band/);
  assert.ok(!(await page.textContent("#metrics")).includes("share of the diameter"), "shares have a table of their own");
  const names = await page.locator("#shares th[scope=row]").allTextContents();
  assert.deepEqual(names, ["diameter", "Young’s modulus", "number of filaments", "not attributed to one input"]);
  const shares = await page.locator("#shares meter").evaluateAll((meters) => meters.map((meter) => meter.value));
  assert.ok(Math.abs(shares.reduce((sum, share) => sum + share, 0) - 1) < 0.05, String(shares));
  assert.ok(Math.abs(shares[0] - value("sobol_diameter")) < 1e-12);
  await page.selectOption("#quantity", "tool_force_upper_95_n");
  await shot(page, "scatter-1280-light");

  await visit(report("paper"), async (without) => assert.ok(await without.isHidden("#scatter")));
}));

test("a failed case is shown as one, and its error as text", async () => {
  const failed = 65;
  const file = withData("paper", "failed", (data) => {
    data.failed = 1;
    data.errors = [[failed, "stopped <img src=x onerror=alert(1)>"]];
    for (const { values } of [...data.quantities, ...data.statistics]) values[failed] = null;
    data.force_uncertainty[failed] = null;
    data.courses = data.courses.filter(([index]) => index !== failed && index % 7 === 0);
  });

  await visit(file, async (page) => {
    await page.mouse.move(...(await cell(page, 5, 5)));
    await says(page, "#readout", /failed/);
    await says(page, "#card", /stopped <img/);
    await page.mouse.click(...(await cell(page, 5, 5)));
    await opened(page, 66);
    await says(page, "#case-note", /has failed: stopped <img src=x/);
    assert.ok(await page.isHidden("#course"));
    await says(page, "#summary", /1 of them has failed/);
    await shot(page, "failed-1280-light");

    // A case that is solved, but whose course was not kept, leads to one that has it.
    await page.mouse.click(...(await cell(page, 6, 5)));
    await opened(page, 67);
    await says(page, "#case-note", /course over time was kept of 18 cases/);
    await page.click("#case-note a");
    await page.locator("#course").waitFor({ state: "visible" });
  });
});

test("three swept settings: slices", visiting("slices", async (page) => {
  const before = await page.textContent("#readout");
  await page.focus("#map");
  await page.selectOption('[data-path="filament.segments"]', { index: 0 });
  assert.notEqual(await page.textContent("#readout"), before);
  await says(page, "#readout", /n\s=\s5/);
  await fitsAcross(page);
  await shot(page, "slices-1280-light");
}));

test("one swept setting: a curve", visiting("curve", async (page) => {
  assert.ok(await page.locator("#map polyline.line").count());
  await page.focus("#map");
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await opened(page, 2);
  await fitsAcross(page);
  await shot(page, "curve-1280-light");
}));

test("one case alone", visiting("single", async (page) => {
  assert.ok(await page.isHidden("#overview"));
  assert.ok(await page.isVisible("#scene"));
  await shot(page, "single-1280-light");
}));

for (const colorScheme of ["light", "dark"]) {
  for (const width of [1280, NARROW]) {
    test(`${width} px, ${colorScheme}`, visiting("paper#case-66", async (page) => {
      await page.locator("#time").fill("450");
      await fitsAcross(page);
      const [paper, ink] = await page.evaluate(() => {
        const { backgroundColor, color } = getComputedStyle(document.body);
        return [backgroundColor, color].map((text) => Number(/\d+/.exec(text)));
      });
      assert.equal(paper < ink, colorScheme === "dark");
      await shot(page, `paper-${width}-${colorScheme}`);
      await page.setViewportSize({ width: width === NARROW ? 720 : 900, height: 800 });
      await fitsAcross(page);
    }, { width, colorScheme, hasTouch: width === NARROW }));
  }
}

test("named tools are chosen by their names", visiting("tools", async (page) => {
  const choice = page.locator('#choices [data-path="tool"]');
  assert.deepEqual(await choice.locator("option").allTextContents(), ["plain", "brush_2"]);
  await says(page, "#summary", /tool plain, brush_2 \(2 tools\)/);
  await choice.selectOption({ label: "brush_2" });
  // The underscore is not that of a symbol.
  await says(page, "#readout", /tool brush_2: /);
  await page.keyboard.press("Tab");
  await page.focus("#map");
  await page.keyboard.press("Enter");
  await says(page, "#case-title", /tool brush_2$/);
  await says(page, "#settings", /plain: 1.18\u202fmmbrush_2: 800\u202fµm/);
  await shot(page, "tools-1280-light");
}));

test("tools alone have a curve without a line between them", visiting("names", async (page) => {
  const texts = await page.locator("#map svg text").allTextContents();
  assert.ok(["plain", "brush_2"].every((name) => texts.includes(name)), texts.join());
  assert.equal(await page.locator("#map svg polyline").count(), 0);
  assert.equal(await page.locator("#map svg circle.point").count(), 2);
  await fitsAcross(page);
  await shot(page, "names-360-light");
}, { width: NARROW }));

/** The number of colours on a canvas. */
const colours = (page, canvas) =>
  page.evaluate((canvas) => {
    const { width, height } = document.querySelector(canvas);
    const { data } = document.querySelector(canvas).getContext("2d").getImageData(0, 0, width, height);
    return new Set(new Uint32Array(data.buffer)).size;
  }, canvas);
const drawing = (page, canvas) => page.evaluate((canvas) => document.querySelector(canvas).toDataURL(), canvas);

test("a brush in motion", visiting("brush", async (page, data) => {
  assert.ok((await colours(page, "#side")) > 50);
  assert.ok(await page.isHidden("#top"));
  await shot(page, "brush-1280-light");
  const earlier = await drawing(page, "#side");
  await page.focus("#animation");
  await page.keyboard.press("ArrowRight");
  const next = await drawing(page, "#side");
  assert.notEqual(next, earlier);
  await page.keyboard.press("ArrowLeft");
  assert.equal(await drawing(page, "#side"), earlier);
  await page.selectOption("#quantity", "press_force");
  assert.notEqual(await drawing(page, "#side"), earlier);
  await page.selectOption("#zoom", "sector");
  await page.keyboard.press("Home");
  await page.click("#play");
  await page.waitForFunction(() => Number(document.getElementById("time").value) > 100);
  await page.click("#play");
  const factor = data.sector.find(({ key }) => key === "interaction_factor").value;
  const shown = await page.textContent('#interaction [data-key="interaction_factor"] .number');
  assert.equal(shown, String(Number(factor.toPrecision(3))));
  assert.ok(await page.evaluate(() => [...document.images].every((image) => image.naturalWidth > 0)));
  assert.ok(await page.isVisible("#assumptions"));
  assert.deepEqual(
    await page.locator("#assumptions tbody code").allTextContents(),
    data.notes.assumptions.list.map(({ path }) => path),
  );
  await says(page, "#assumptions-note", /for one filament alone\./);
  assert.equal(await page.locator("#warnings li").count(), data.notes.findings.length);

  const unusual = withData("brush", "unusual", (data) => {
    data.notes.findings = [];
    data.notes.warnings.push("`filament.length_m` = 30 m");
  });
  await visit(unusual, async (warned) =>
    assert.equal(await warned.textContent("#warnings"), "Warning: filament.length_m = 30 m"),
  );
}));

for (const [colorScheme, width] of [["dark", 1280], ["light", NARROW]]) {
  test(`a brush in space at ${width} px, ${colorScheme}`, visiting("tilted", async (page) => {
    assert.ok((await colours(page, "#top")) > 50);
    await page.locator("#time").fill("400");
    await fitsAcross(page);
    await shot(page, `tilted-${width}-${colorScheme}`);
  }, { width, colorScheme }));
}

test("the picture of the README", visiting("paper", async (page) => {
  await page.locator("#time").fill("400");
  await page.evaluate(() => (document.activeElement.blur(), scrollTo({ top: 0, behavior: "instant" })));
  await page.screenshot({ path: path.join(screenshots, "readme.png") });
}, { height: 1640 }));

test("what the file asks for comes first, with its answer", visiting("goal", async (page, data) => {
  await says(page, "#question", /^Which speed and depth give Fn,w\s=\s20\sN with ae\s≤\s2\smm\?$/);
  await says(page, "#recommended", /^Recommended for 20\sN: [\d.]+\srpm \(vb\s=\s[\d.]+\sm\/s\), ae\s=\s[\d.]+\smm$/);
  const known = await page.locator("#known li").allTextContents();
  assert.match(known.join("\n"), /Fn,w\s=\s(19|20)[\d.]*\sN, .*\nfor it: .*\nsimulated \(rows? \d+.*: (19|20)[\d.]*\sN\)$/m);
  assert.ok(await page.isHidden("#headline"));
  assert.equal(await page.inputValue("#quantity"), "tool_contact_normal_force_n");
  const [row] = data.answer.rows;
  assert.equal(await page.textContent("#case-row"), String(row));
  await shot(page, "goal-1280-light");
  await page.click("#known a >> nth=0");
  await opened(page, row);
}));

/** The number of sheets of a page, of which a PDF is kept. */
async function printed(page, name) {
  const file = await page.pdf({ path: path.join(screenshots, `${name}.pdf`), format: "A4" });
  await says(page, "#printed", /^Bristle [\d.]+, printed on \d{4}-\d\d-\d\d$/);
  return file.toString("latin1").match(/\/Type\s*\/Page\b/g).length;
}

test("printed, a study has two pages", async () => {
  for (const name of ["paper", "goal", "curve", "deburring"]) {
    await visit(report(name), async (page) => assert.equal(await printed(page, name), 2, name));
  }
});
