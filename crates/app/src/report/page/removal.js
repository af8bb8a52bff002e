// Draws the edge at the time of the slider, over that at the start. Outlines are in parts of the length of the faces that are seen, with the
// bisector upwards.

const data = JSON.parse(document.getElementById("data").textContent);
const [slider, output, drawing] = ["time", "at", "drawing"].map(byId);

const path = (outline) => `M${outline.map(([x, y]) => `${x} ${-y}`).join("L")}`;

const pictures = data.edges.map((edge) => {
  const [across, down] = [Math.sin(edge.half_rad), Math.cos(edge.half_rad)];
  const margin = 0.06;
  const box = [-across - margin, -margin, 2 * (across + margin), down + 2 * margin];
  const attributes = { viewBox: box.join(" "), role: "img", "aria-label": "outline of the edge" };
  const line = (more) => svgElement("path", { fill: "none", ...more });
  const material = svgElement("path", { fill: "#dedace", stroke: "none" });
  const start = { stroke: "#767676", "stroke-width": 0.006, "stroke-dasharray": "0.02 0.015", d: path(edge.outlines[0]) };
  const now = line({ stroke: "#0072b2", "stroke-width": 0.012 });
  drawing.append(svgElement("svg", attributes, material, line(start), now));
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
