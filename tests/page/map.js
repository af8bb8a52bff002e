// The map of a study, or its curve: readings, layers, marks, and cases that it opens.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  NARROW,
  cell,
  fitsAcross,
  opened,
  report,
  says,
  shape,
  shot,
  valuesOf,
  visit,
  visiting,
  withData,
} from "./visits.js";

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
