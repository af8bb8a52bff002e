// The page of a study in a browser: actions of a reader, and the looks of the page.
//
//   node page.js REPORTS SCREENSHOTS
//
// REPORTS holds pages that `bristle study` has written (see .ci/run): paper.html of examples/zirconia.toml, deburring.html of
// examples/deburring.toml, and smaller ones that sweep three settings, one, and none, simulate three turns, compare tools, and tilt a cup. brush.html of
// examples/brush.toml and tilted.html are pages that `bristle simulate` has written.

import assert from "node:assert/strict";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { chromium } from "playwright-core";

const [reports, screenshots] = process.argv.slice(2);
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "bristle-page-"));
/** Width in px of the narrowest screens on which the page has to work. */
const NARROW = 360;
let browser;

before(async () => {
  fs.mkdirSync(screenshots, { recursive: true });
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: [
      "--no-sandbox",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
    ],
  });
});
after(async () => {
  await browser?.close();
  fs.rmSync(scratch, { recursive: true });
});

/** Opens a page, does something with it and its data, and fails if it complains or asks for anything but itself. */
async function visit(file, body, { width = 1280, height = 900, ...options } = {}, address = "") {
  const context = await browser.newContext({ viewport: { width, height }, ...options });
  const page = await context.newPage();
  // A machine that does other work too may stand still for a while.
  page.setDefaultTimeout(120_000);
  const complaints = [];
  const url = pathToFileURL(file).href;
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on(
    "request",
    (request) =>
      request.url().split("#")[0] !== url && !request.url().startsWith("data:") && complaints.push(request.url()),
  );
  await page.goto(url + address);
  await body(page, await page.evaluate(() => JSON.parse(document.getElementById("data").textContent)));
  await context.close();
  assert.deepEqual(complaints, []);
}

const report = (name) => path.join(reports, `${name}.html`);
/** A test of the page of a report, at an address such as "paper#case-66". */
const visiting = (address, body, options) => () => {
  const [name, row] = address.split("#");
  return visit(report(name), body, options, row && `#${row}`);
};
/** The values of a quantity in all cases. */
const valuesOf = (data, key) => data.quantities.find((quantity) => quantity.key === key).values;
/** Expects the text of an element to match a pattern. */
const says = async (page, element, pattern) => assert.match(await page.textContent(element), pattern);
const shape = (page) => page.getAttribute("#filament", "points");
const shot = (page, name) => page.screenshot({ path: path.join(screenshots, `${name}.png`), fullPage: true });

/** The middle of the cell in a column and a row, counted from the lower left one of the paper's 12 by 10, on the screen. */
async function cell(page, column, row) {
  await page.locator("#map").scrollIntoViewIfNeeded();
  const box = await page.locator("#map").boundingBox();
  const [left, right, top, bottom] = [50, 8, 8, 44];
  const [width, height] = [(box.width - left - right) / 12, (box.height - top - bottom) / 10];
  return [box.x + left + (column + 0.5) * width, box.y + box.height - bottom - (row + 0.5) * height];
}

/** The file of a page with other data. */
function withData(name, as, change) {
  const text = fs.readFileSync(report(name), "utf8");
  const [head, rest] = text.split('id="data">');
  const end = rest.indexOf("</script>");
  const data = JSON.parse(rest.slice(0, end));
  change(data);
  const file = path.join(scratch, `${as}.html`);
  fs.writeFileSync(file, `${head}id="data">${JSON.stringify(data).replaceAll("<", "\\u003c")}${rest.slice(end)}`);
  return file;
}

async function fitsAcross(page) {
  const [content, window] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
  assert.ok(content <= window, `the page is ${content} px wide in a window of ${window} px`);
}

/** Waits until the page shows the case in that row of runs.csv: the address changes first, the content a moment later. */
async function opened(page, row) {
  await page.waitForFunction(
    (row) => location.hash === `#case-${row}` && document.getElementById("case-row").textContent === String(row),
    row,
  );
}

test("pointing at a case shows its values, and a click opens it", visiting("paper", async (page, data) => {
  await page.mouse.move(...(await cell(page, 11, 1)));
  const readout = await page.textContent("#readout");
  assert.match(readout, /vb\s=\s30\s?m\/s, ae\s=\s1\s?mm: Fn,w\s=\s\d+\s?N/);
  const force = valuesOf(data, "tool_contact_normal_force_n")[12 + 11];
  assert.ok(readout.includes(String(Number(force.toPrecision(3)))), `${readout} has ${force}`);
  await says(page, "#card", /Fn,w[\d.]+ ± [\d.]+\s?N/);

  const earlier = await shape(page);
  await page.mouse.click(...(await cell(page, 3, 5)));
  await opened(page, 64);
  await says(page, "#case-title", /vb\s=\s10\s?m\/s, ae\s=\s3\s?mm/);
  assert.notEqual(await shape(page), earlier);
  assert.equal(await page.evaluate(() => document.activeElement.id), "case-title");
  const impulse = valuesOf(data, "contact_normal_impulse_n_s")[63];
  const shown = await page.textContent('[data-key="contact_normal_impulse_n_s"] .number');
  assert.equal(shown.replace(/\s/g, " "), `${Number((impulse * 1e3).toPrecision(3))} mN s`);

  await page.goBack();
  await page.goForward();
  await opened(page, 64);
  await says(page, "#case-title", /vb\s=\s10/);
}));

test("a page opens on a case that has not failed", async () => {
  const file = withData("paper", "mostly-failed", (data) => {
    const solved = [3, 50];
    data.courses = [];
    for (const quantity of data.quantities) {
      quantity.values = quantity.values.map((value, index) => (solved.includes(index) ? value : null));
    }
    data.errors = [...data.quantities[0].values.keys()].filter((index) => !solved.includes(index)).map((index) => [index, "stopped"]);
  });
  await visit(file, async (page) => {
    assert.equal(await page.textContent("#case-row"), "51");
    assert.ok(await page.isVisible("#tables"));
  });
});

test("findings lead to their cases, and the method can be copied", visiting("paper", async (page, data) => {
  const { findings } = data.notes;
  const items = page.locator("#warnings li");
  assert.ok(findings.length > 0);
  assert.equal(await items.count(), data.notes.warnings.length + findings.length);
  assert.ok((await items.last().textContent()).endsWith(`Help: ${findings.at(-1).help}.`));
  assert.equal(await items.locator(".symbol").filter({ hasText: /^m$/ }).count(), 0, "keys are no symbols");
  const link = items.last().locator("a");
  const row = Number(await link.textContent());
  assert.ok(findings.at(-1).rows.includes(row));
  await link.click();
  await opened(page, row);
  await says(page, "#method", /Lagrange.*ESDIRK5\(4\).*k_c = .*Cite: .*doi:/);
}));

test("the keyboard moves over the map and opens a case", visiting("paper", async (page) => {
  await page.focus("#map");
  await page.keyboard.press("Home");
  await page.keyboard.press("PageDown");
  await page.keyboard.press("ArrowUp");
  await page.keyboard.press("ArrowRight");
  await says(page, "#map-cell", /v_b = 5\s?m\/s, a_e = 1\s?mm/);
  await says(page, "#readout", /vb\s=\s5/);
  const active = await page.getAttribute("#map", "aria-activedescendant");
  assert.equal(await page.getAttribute(`#${active}`, "aria-colindex"), "2");
  await page.keyboard.press("Enter");
  await opened(page, 14);
  await says(page, "#case-title", /vb\s=\s5\s?m\/s, ae\s=\s1\s?mm/);
}));

test("another quantity is another map", visiting("paper", async (page, data) => {
  const pixels = () => page.evaluate(() => document.querySelector("#map canvas").toDataURL());
  const seen = new Set();
  const options = await page.locator("#quantity option").count();
  assert.equal(options, data.quantities.length);
  const varied = [
    "contact_time_ratio",
    "contact_normal_impulse_n_s",
    "tool_contact_normal_force_n",
    "tool_torque_n_m",
    "tool_power_w",
    "lateral_amplification",
    "contact_time_s",
  ];
  for (const key of varied) {
    await page.selectOption("#quantity", key);
    seen.add(await pixels());
  }
  assert.equal(seen.size, varied.length);
  await page.selectOption("#quantity", "tool_contact_normal_force_n");
  await says(page, "#map-title", /Contact normal force of the tool Fn,w in N/);
  await page.mouse.move(...(await cell(page, 0, 0)));
  await says(page, "#readout", /Fn,w\s=\s[\d.]+\s?N/);
  assert.ok((await page.getAttribute("#map .contour.tier", "d")).length > 100, "the line at ε_tc = ½ is drawn");
}));

test("laterally unstable cases are marked, and their amplification spans decades",
  visiting("paper", async (page, data) => {
  const values = (name) => valuesOf(data, name);
  const unstable = values("laterally_unstable").filter((value) => value === 1).length;
  assert.ok(unstable > 10 && unstable < 30, `${unstable} are unstable`);
  assert.equal((await page.getAttribute("#map .unstable", "d")).match(/M/g).length, unstable);
  assert.match(
    await page.textContent("#marks"),
    /between striking and sweepinglateral amplification 100, laterally unstable abovelaterally unstable$/,
  );

  // The colours follow the logarithm: the middle of the scale is at the geometric mean of its ends.
  await page.selectOption("#quantity", "lateral_amplification");
  const amplification = values("lateral_amplification");
  const [low, high] = [Math.min(...amplification), Math.max(...amplification)].map(Math.log10);
  assert.ok(high - low > 4);
  const [column, row] = [0, 3];
  const colour = await page.evaluate(
    ([i, j]) => {
      const canvas = document.querySelector("#map canvas");
      const [width, height] = [canvas.width, canvas.height];
      const x = 50 + ((i + 0.5) * (width - 58)) / 12;
      const y = height - 44 - ((j + 0.5) * (height - 52)) / 10;
      return [...canvas.getContext("2d").getImageData(x, y, 1, 1).data.slice(0, 3)].join(" ");
    },
    [column, row],
  );
  const share = (Math.log10(amplification[12 * row + column]) - low) / (high - low);
  const viridis = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
  const place = share * (viridis.length - 1);
  const parts = (k) => [1, 3, 5].map((at) => parseInt(viridis[k].slice(at, at + 2), 16));
  const [below, above] = [parts(Math.floor(place)), parts(Math.ceil(place))];
  const expected = below.map((part, k) => part + (place - Math.floor(place)) * (above[k] - part));
  assert.ok(colour.split(" ").every((part, k) => Math.abs(part - expected[k]) < 2), `${colour} for ${expected}`);
  await says(page, "#marks", /100, laterally unstable above/);
  assert.ok((await page.getAttribute("#map .contour.stability", "d")).length > 50, "the line at 100 is drawn");
  await page.mouse.move(...(await cell(page, 0, 9)));
  await says(page, "#readout", /lateral amplification\s=\s62\d\s000, laterally unstable$/);
  await shot(page, "amplification-1280-light");

  await page.mouse.click(...(await cell(page, 0, 9)));
  await opened(page, 109);
  await says(page, "#case-note", /Laterally unstable: .* grows 62\d\s000-fold/);
  assert.ok(await page.isVisible("#course"));
  await shot(page, "unstable-1280-light");
  await page.mouse.click(...(await cell(page, 11, 9)));
  await opened(page, 120);
  assert.ok(await page.isHidden("#case-note"));
  await page.mouse.move(...(await cell(page, 11, 9)));
  assert.doesNotMatch(await page.textContent("#readout"), /unstable/);

  await visit(report("curve"), async (curve) => {
    await curve.selectOption("#quantity", "lateral_amplification");
    const labels = await curve.locator("#map svg text").allTextContents();
    assert.ok(labels.includes("1") && labels.includes("10"), labels.join());
  });
}));

test("an address with a case opens the page at that case", visiting("paper#case-66", async (page) => {
  const isThere = () => Math.abs(document.getElementById("case-title").getBoundingClientRect().top) < 5;
  await opened(page, 66);
  assert.ok(await page.evaluate(isThere), "the page is scrolled to the case");
  await says(page, "#readout", /vb\s=\s15\s?m\/s, ae\s=\s3\s?mm/);
  assert.equal(await page.evaluate(() => document.activeElement.id), "case-title");
  assert.equal(await page.locator("#map .opened").count(), 1);
  await page.evaluate(() => scrollTo({ top: 0, behavior: "instant" }));
  await page.evaluate(() => (location.hash = "#case-14"));
  await opened(page, 14);
  await page.waitForFunction(isThere);
  // The headline leads to its cases, also to the one that is open.
  const link = page.locator("#headline a").first();
  const row = Number(await link.textContent());
  for (let time = 0; time < 2; time++) {
    await page.evaluate(() => scrollTo({ top: 0, behavior: "instant" }));
    await link.click();
    await opened(page, row);
    await page.waitForFunction(isThere);
  }
  await page.evaluate(() => (location.hash = "#case-999"));
  assert.equal(await page.textContent("#case-row"), String(row));

  await visit(report("paper"), async (top) => assert.equal(await top.evaluate(() => scrollY), 0));
}));

test("every page has a headline", async () => {
  for (const name of ["paper", "single", "curve", "slices", "deburring", "turns"]) {
    await visit(report(name), async (page) =>
      assert.match(await page.textContent("#headline"), /Fn,w\s=\s[\d.]+.*N.*\..+\.$/, name),
    );
  }
});

test("cells have numbers where they fit, and layers can be left out", visiting("paper", async (page, data) => {
  await page.selectOption("#quantity", "tool_contact_normal_force_n");
  const numbers = page.locator("#map .cell-number");
  assert.equal(await numbers.count(), 120);
  const forces = valuesOf(data, "tool_contact_normal_force_n");
  const expected = forces.map((force) => String(Number(force.toPrecision(3))));
  assert.deepEqual((await numbers.allTextContents()).sort(), expected.sort());
  // As much contrast as WCAG asks of text, on each of them.
  const contrasts = await numbers.evaluateAll((texts) => {
    const luminance = (colour) => {
      const parts = colour.match(/\d+/g).map((part) => part / 255);
      const [red, green, blue] = parts.map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
      return 0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05;
    };
    return texts.map((text) => {
      const { fill, stroke } = getComputedStyle(text);
      const [low, high] = [fill, stroke].map(luminance).sort((a, b) => a - b);
      return high / low;
    });
  });
  assert.ok(Math.min(...contrasts) > 4.5, `${Math.min(...contrasts)}`);
  await shot(page, "numbers-1280-light");

  for (const [layer, shapes] of [
    ["tier", ".contour.tier"],
    ["stability", ".unstable, .contour.stability"],
    ["numbers", ".cell-number"],
  ]) {
    const drawn = page.locator(`#map :is(${shapes})`);
    assert.ok((await drawn.count()) > 0, layer);
    await page.uncheck(`#layer-${layer}`);
    assert.equal(await drawn.count(), 0, layer);
    await page.check(`#layer-${layer}`);
    assert.ok((await drawn.count()) > 0, layer);
  }
  assert.equal(await page.locator("#layer-interaction").count(), 0, "one filament has no interaction");
  await page.setViewportSize({ width: NARROW, height: 800 });
  await page.waitForFunction(() => document.getElementById("layer-numbers").disabled);
  assert.equal(await numbers.count(), 0, "they do not fit");
  await fitsAcross(page);

  await visit(report("curve"), async (curve) => assert.ok(await curve.isHidden("#layers")));
}));

test("of brushes, the interaction factor is a quantity and a layer", async () => {
  const file = withData("paper", "interaction", (data) => {
    const amplification = data.quantities.find(({ key }) => key === "lateral_amplification");
    const values = amplification.values.map((_, index) => 0.8 + 0.005 * (index % 12) + 0.03 * Math.floor(index / 12));
    const names = { key: "interaction_factor", symbol: "", unit: "", name: "interaction factor", meaning: "" };
    data.quantities.unshift({ ...names, logarithmic: false, values });
    data.brush = true;
  });
  await visit(file, async (page) => {
    await says(page, "#map-title", /Interaction factor/);
    assert.ok((await page.getAttribute("#map .contour.interaction", "d")).length > 50);
    await says(page, "#marks", /interaction factor 1/);
    await shot(page, "interaction-1280-light");
    await page.uncheck("#layer-interaction");
    assert.equal(await page.locator("#map .contour.interaction").count(), 0);
  });
});

test("a curve begins where its values are, over decades on a logarithmic axis", async () => {
  const file = withData("curve", "tolerance", (data) => {
    const [axis] = data.axes;
    Object.assign(axis, { path: "solver.relative_tolerance", symbol: "", unit: "", name: "relative tolerance" });
    axis.values = axis.values.map((_, place) => 10 ** (2 * place - 7));
    const force = data.quantities.find(({ key }) => key === "tool_contact_normal_force_n");
    force.values = force.values.map((_, place) => 243.4 + 0.2 * place);
  });
  await visit(file, async (page) => {
    await page.selectOption("#quantity", "tool_contact_normal_force_n");
    const texts = await page.locator("#map svg text").allTextContents();
    assert.ok(!texts.includes("0") && texts.includes("10⁻⁷") && texts.includes("0.001"), texts.join());
    const places = await page.locator("#map .point").evaluateAll((points) => points.map((point) => Number(point.getAttribute("cx"))));
    assert.ok(Math.abs(places[1] - places[0] - (places[2] - places[1])) < 0.1, String(places));
    await shot(page, "tolerance-1280-light");
  });
});

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
