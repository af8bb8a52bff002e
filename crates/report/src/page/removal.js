"use strict";

// Draws the edge at the time of the slider, over that at the start. Outlines are in parts of the length of the faces that are seen, with the
// bisector upwards.

const data = JSON.parse(document.getElementById("data").textContent);
const slider = document.getElementById("time");
const output = document.getElementById("at");
const drawing = document.getElementById("drawing");
const NAMESPACE = "http://www.w3.org/2000/svg";

function element(name, attributes) {
  const made = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function path(outline) {
  return outline.map(([x, y], index) => `${index === 0 ? "M" : "L"}${x} ${-y}`).join("");
}

const pictures = data.edges.map((edge) => {
  const [across, down] = [Math.sin(edge.half_rad), Math.cos(edge.half_rad)];
  const margin = 0.06;
  const box = [-across - margin, -margin, 2 * (across + margin), down + 2 * margin];
  const svg = element("svg", { viewBox: box.join(" "), role: "img", "aria-label": "outline of the edge" });
  const material = element("path", { fill: "#dedace", stroke: "none" });
  const start = element("path", { fill: "none", stroke: "#767676", "stroke-width": 0.006, "stroke-dasharray": "0.02 0.015" });
  const now = element("path", { fill: "none", stroke: "#0072b2", "stroke-width": 0.012 });
  svg.append(material, start, now);
  start.setAttribute("d", path(edge.outlines[0]));
  drawing.append(svg);
  return { edge, material, now };
});

function draw() {
  const index = Number(slider.value);
  const [time, turns, radius, second] = data.rows[index];
  const radii = pictures.length > 1 ? `${radius} and ${second}` : radius;
  output.textContent = `${time} ${data.unit}, ${turns} turns: R = ${radii} mm`;
  for (const { edge, material, now } of pictures) {
    const outline = path(edge.outlines[index]);
    now.setAttribute("d", outline);
    material.setAttribute("d", `${outline}Z`);
  }
}

slider.addEventListener("input", draw);
draw();
