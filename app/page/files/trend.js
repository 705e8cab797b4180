// Chart of the probes' residuals, as wide as the page allows.
"use strict";

const kMiddleOver = 9;
let lastTrend = {points: []}, drawn = "";

function shape(tag, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text) made.textContent = text;
  return made;
}

function median(values) {
  const sorted = values.slice().sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor((sorted.length - 1) / 2)] : 0;
}

// A round step that divides 0..top into two to five intervals.
function niceStep(top) {
  const power = Math.pow(10, Math.floor(Math.log10(top)));
  for (const factor of [0.2, 0.5, 1, 2]) if (top / (factor * power) <= 5) return factor * power;
  return 5 * power;
}

function mark(point, x, y) {
  const title = shape("title", {}, "row " + point.id + ": " + point.mm.toFixed(3) + " mm" +
    (point.model ? ", model version " + point.model : "") + (point.wild ? ", outlier" : "") +
    (point.alarm ? ", drift alarm" : ""));
  const made = point.alarm ?
    shape("path", {class: "alarm", d: `M${x} ${y - 8}L${x + 7} ${y + 5}L${x - 7} ${y + 5}Z`}) :
    shape("circle", {class: point.wild ? "wild" : "dot", cx: x, cy: y, r: point.wild ? 4 : 2.5});
  made.append(title);
  return made;
}

function drawTrend(target, words, trend) {
  if (trend) lastTrend = trend;
  const width = Math.max(200, target.clientWidth), points = lastTrend.points || [];
  const key = width + JSON.stringify(lastTrend);
  if (key === drawn) return;
  drawn = key;
  if (lastTrend.problem || points.length === 0) {
    target.replaceChildren();
    words.textContent = lastTrend.problem ? "The journal cannot be read: " + lastTrend.problem :
      "No probes yet.";
    return;
  }
  // Match the size of the surrounding text.
  const em = 0.75 * parseFloat(getComputedStyle(document.documentElement).fontSize);
  const kHeight = 16 * em, kLeft = 5 * em, kRight = 0.6 * em, kTop = 1.6 * em, kBottom = 2 * em;
  const all = points.map((point) => point.mm), last = points[points.length - 1];
  const top = Math.max(...all) || 1, step = niceStep(top), high = step * Math.ceil(top / step);
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  const x = (k) => kLeft + (width - kLeft - kRight) * (points.length > 1 ? k / (points.length - 1) : 0.5);
  const y = (mm) => kHeight - kBottom - (kHeight - kTop - kBottom) * mm / high;
  const present = points.filter((point) => point.model === last.model).map((point) => point.mm).slice(-20);
  const summary = `Newest: ${last.mm.toFixed(3)} mm. Median of the newest ${present.length}` +
    (last.model ? ` under model version ${last.model}` : "") + `: ${median(present).toFixed(3)} mm.`;
  const svg = shape("svg", {viewBox: `0 0 ${width} ${kHeight}`, height: kHeight, role: "img",
    "aria-label": "Residuals of the newest probes. " + summary});
  for (let mm = 0; mm <= high * 1.001; mm += step) {
    svg.append(shape("line", {class: "grid", x1: kLeft, x2: width - kRight, y1: y(mm), y2: y(mm)}),
      shape("text", {x: kLeft - 0.5 * em, y: y(mm) + 0.35 * em, "text-anchor": "end"}, mm.toFixed(digits) + " mm"));
  }
  points.forEach((point, k) => {
    if (k === 0 || point.model === points[k - 1].model) return;
    const at = (x(k) + x(k - 1)) / 2;
    svg.append(shape("line", {class: "version", x1: at, x2: at, y1: kTop, y2: kHeight - kBottom}),
      shape("text", {x: at, y: kTop - 0.3 * em, "text-anchor": k > points.length / 2 ? "end" : "start"},
        "model " + (point.model || "none")));
  });
  const middle = all.map((_, k) => median(all.slice(Math.max(0, k - kMiddleOver + 1), k + 1)));
  svg.append(shape("polyline", {class: "middle", points: middle.map((mm, k) => x(k) + "," + y(mm)).join(" ")}));
  points.forEach((point, k) => svg.append(mark(point, x(k), y(point.mm))));
  svg.append(shape("text", {x: kLeft, y: kHeight - 0.5 * em}, "row " + points[0].id),
    shape("text", {x: width - kRight, y: kHeight - 0.5 * em, "text-anchor": "end"}, "row " + last.id));
  target.replaceChildren(svg);
  words.textContent = summary + ` Line: running median of ${kMiddleOver}. Circle: outlier. Triangle: drift alarm.`;
}
