// Visits to pages in a browser, and helpers of their tests.

import assert from "node:assert/strict";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { after, before } from "node:test";
import { pathToFileURL } from "node:url";

import { chromium } from "playwright-core";

export const [reports, screenshots] = process.argv.slice(2);
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "bristle-page-"));
/** Width in px of the narrowest screens on which the page has to work. */
export const NARROW = 360;
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
export async function visit(file, body, { width = 1280, height = 900, ...options } = {}, address = "") {
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

export const report = (name) => path.join(reports, `${name}.html`);
/** A test of the page of a report, at an address such as "paper#case-66". */
export const visiting = (address, body, options) => () => {
  const [name, row] = address.split("#");
  return visit(report(name), body, options, row && `#${row}`);
};
/** The values of a quantity in all cases. */
export const valuesOf = (data, key) => data.quantities.find((quantity) => quantity.key === key).values;
/** Expects the text of an element to match a pattern. */
export const says = async (page, element, pattern) => assert.match(await page.textContent(element), pattern);
export const shape = (page) => page.getAttribute("#filament", "points");
export const shot = (page, name) => page.screenshot({ path: path.join(screenshots, `${name}.png`), fullPage: true });

/** The middle of the cell in a column and a row, counted from the lower left one of the paper's 12 by 10, on the screen. */
export async function cell(page, column, row) {
  await page.locator("#map").scrollIntoViewIfNeeded();
  const box = await page.locator("#map").boundingBox();
  const [left, right, top, bottom] = [50, 8, 8, 44];
  const [width, height] = [(box.width - left - right) / 12, (box.height - top - bottom) / 10];
  return [box.x + left + (column + 0.5) * width, box.y + box.height - bottom - (row + 0.5) * height];
}

/** The file of a page with other data. */
export function withData(name, as, change) {
  const text = fs.readFileSync(report(name), "utf8");
  const [head, rest] = text.split('id="data">');
  const end = rest.indexOf("</script>");
  const data = JSON.parse(rest.slice(0, end));
  change(data);
  const file = path.join(scratch, `${as}.html`);
  fs.writeFileSync(file, `${head}id="data">${JSON.stringify(data).replaceAll("<", "\\u003c")}${rest.slice(end)}`);
  return file;
}

export async function fitsAcross(page) {
  const [content, window] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
  assert.ok(content <= window, `the page is ${content} px wide in a window of ${window} px`);
}

/** Waits until the page shows the case in that row of runs.csv: the address changes first, the content a moment later. */
export async function opened(page, row) {
  await page.waitForFunction(
    (row) => location.hash === `#case-${row}` && document.getElementById("case-row").textContent === String(row),
    row,
  );
}
