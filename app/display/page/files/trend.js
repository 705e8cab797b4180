// Chart of the probes' residuals over time, drawn by dygraphs.
"use strict";

const kMiddleOver = 9, kLoaded_kg = 0.05;
// Columns of the chart's rows after the time.
const kLoadedColumn = 1, kUnloadedColumn = 2, kOutlierColumn = 3, kAlarmColumn = 4, kMiddleColumn = 5;
const chart = {graph: null, points: [], radius_mm: null, byTime: true, drawn: ""};

const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

function median(values) {
  const sorted = values.slice().sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor((sorted.length - 1) / 2)] : 0;
}

const isLoaded = (point) => point.payload_kg === undefined || point.payload_kg > kLoaded_kg;

// The median does not mix residuals of different models: at each change its line is interrupted.
function rowsOf(points) {
  let first = 0;
  return points.map((point, k) => {
    const row = [chart.byTime ? new Date(1000 * point.utc_s) : point.id, null, null, null, null, null];
    const column = point.alarm ? kAlarmColumn : point.wild ? kOutlierColumn :
      isLoaded(point) ? kLoadedColumn : kUnloadedColumn;
    row[column] = point.mm;
    const changed = k > 0 && point.model !== points[k - 1].model;
    if (changed) first = k;
    row[kMiddleColumn] = changed ? null :
      median(points.slice(Math.max(first, k - kMiddleOver + 1), k + 1).map((one) => one.mm));
    return row;
  });
}

// The content security policy forbids the inline styles of the library's legend.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

// Marks that differ in shape, not only in colour.
function drawDisc(graph, series, context, x, y, colour, size) {
  context.fillStyle = colour;
  context.beginPath();
  context.arc(x, y, size, 0, 2 * Math.PI);
  context.fill();
}
function drawSquare(graph, series, context, x, y, colour, size) {
  context.strokeStyle = colour;
  context.lineWidth = 1.8;
  context.strokeRect(x - size, y - size, 2 * size, 2 * size);
}
function drawSaltire(graph, series, context, x, y, colour, size) {
  context.strokeStyle = colour;
  context.lineWidth = 2.2;
  context.beginPath();
  context.moveTo(x - size, y - size);
  context.lineTo(x + size, y + size);
  context.moveTo(x + size, y - size);
  context.lineTo(x - size, y + size);
  context.stroke();
}
function drawTriangle(graph, series, context, x, y, colour, size) {
  context.fillStyle = colour;
  context.beginPath();
  context.moveTo(x, y - size);
  context.lineTo(x + size, y + size);
  context.lineTo(x - size, y + size);
  context.fill();
}

// Below the data: the band within the points' radius, and a line at each change of the model.
function drawUnderlay(context, area, graph) {
  context.save();
  if (chart.radius_mm !== null) {
    const y = Math.max(area.y, graph.toDomYCoord(chart.radius_mm));
    context.globalAlpha = 0.12;
    context.fillStyle = colourOf("soft");
    context.fillRect(area.x, y, area.w, area.y + area.h - y);
    context.globalAlpha = 1;
    context.strokeStyle = colourOf("soft");
    context.setLineDash([8, 5]);
    context.beginPath();
    context.moveTo(area.x, y);
    context.lineTo(area.x + area.w, y);
    context.stroke();
  }
  const em = parseFloat(getComputedStyle(document.documentElement).fontSize);
  context.font = 0.8 * em + "px system-ui, sans-serif";
  context.fillStyle = context.strokeStyle = colourOf("soft");
  context.setLineDash([3, 3]);
  const place = (point) => chart.byTime ? 1000 * point.utc_s : point.id;
  chart.points.forEach((point, k) => {
    if (k === 0 || point.model === chart.points[k - 1].model) return;
    const x = graph.toDomXCoord((place(point) + place(chart.points[k - 1])) / 2);
    if (x < area.x || x > area.x + area.w) return;
    context.beginPath();
    context.moveTo(x, area.y);
    context.lineTo(x, area.y + area.h);
    context.stroke();
    const words = "model " + (point.model || "none");
    const left = x + context.measureText(words).width + 0.4 * em > area.x + area.w;
    context.textAlign = left ? "right" : "left";
    context.fillText(words, x + (left ? -0.3 : 0.3) * em, area.y + 0.9 * em);
  });
  context.restore();
}

function pointText(point) {
  const when = point.utc_s === undefined ? "" :
    new Date(1000 * point.utc_s).toISOString().slice(0, 19).replace("T", " ") + " UTC, ";
  return when + "row " + point.id + ": " + point.mm.toFixed(3) + " mm" +
    (point.payload_kg === undefined ? "" : ", payload " + point.payload_kg.toFixed(2) + " kg") +
    (point.model ? ", model version " + point.model : "") + (point.wild ? ", outlier" : "") +
    (point.alarm ? ", DRIFT ALARM" : "");
}

function optionsOf() {
  const em = parseFloat(getComputedStyle(document.documentElement).fontSize);
  const line = colourOf("chart"), ink = colourOf("ink"), scale = em / 16;
  const mark = (draw, color, size) => ({drawPoints: true, strokeWidth: 0, color, pointSize: size * scale,
    drawPointCallback: draw, drawHighlightPointCallback: draw, highlightCircleSize: (size + 2) * scale});
  return {
    labels: [chart.byTime ? "time" : "row", "loaded", "unloaded", "outlier", "drift alarm", "median"],
    series: {
      "loaded": mark(drawDisc, line, 3), "unloaded": mark(drawSquare, line, 3),
      "outlier": mark(drawSaltire, colourOf("warning"), 4),
      "drift alarm": mark(drawTriangle, colourOf("alarm"), 7),
      "median": {color: ink, strokeWidth: 2 * scale, highlightCircleSize: 0},
    },
    labelsUTC: true, includeZero: true, drawPoints: false, xRangePad: 8,
    axisLineColor: colourOf("edge"), gridLineColor: colourOf("edge"), axisLabelFontSize: 0.8 * em,
    axes: {y: {axisLabelWidth: 3.2 * em}, x: {axisLabelWidth: 5 * em, pixelsPerLabel: 7 * em}},
    underlayCallback: drawUnderlay,
    highlightCallback: (event, x, points, row) => {
      document.getElementById("hover").textContent = pointText(chart.points[row]);
    },
    unhighlightCallback: () => { document.getElementById("hover").textContent = ""; },
    valueRange: [0, 1.08 * Math.max(...chart.points.map((point) => point.mm), chart.radius_mm || 0, 0.001)],
  };
}

function describe() {
  const {points} = chart, last = points[points.length - 1];
  const under = points.filter((point) => point.model === last.model), present = under.map((point) => point.mm).slice(-20);
  const beyond = chart.radius_mm === null ? "" :
    ` ${under.filter((point) => point.mm > chart.radius_mm).length} of ${last.model ? "its" : "the"} ${under.length} probes shown exceed ` +
    `the largest 95 % radius of the points, ${chart.radius_mm.toFixed(2)} mm.`;
  const alarms = points.filter((point) => point.alarm).length;
  return `Newest: ${last.mm.toFixed(3)} mm. Median of the newest ${present.length}` +
    (last.model ? ` under model version ${last.model}` : "") + `: ${median(present).toFixed(3)} mm.` +
    beyond + (alarms ? ` Drift alarms: ${alarms}.` : "");
}

// @param radius_mm  largest 95 % radius of the valid points; null: unknown
function drawTrend(trend, radius_mm) {
  const target = document.getElementById("trend"), words = document.getElementById("trend-words");
  const key = JSON.stringify([trend, radius_mm]);
  if (key === chart.drawn) return;
  chart.drawn = key;
  chart.points = trend.points || [];
  chart.radius_mm = radius_mm;
  chart.byTime = chart.points.every((point) => point.utc_s !== undefined);
  const empty = chart.points.length === 0;
  document.getElementById("key").hidden = empty;
  document.querySelector("#trend-section .tools").hidden = empty;
  byId("trend-section").hidden = empty && !(status && status.model && status.model.recording);
  target.hidden = empty;
  if (empty) {
    if (chart.graph) chart.graph.destroy();
    chart.graph = null;
    words.textContent = trend.problem ? "The journal cannot be read: " + trend.problem : "No probes yet.";
    return;
  }
  const rows = rowsOf(chart.points);
  if (chart.graph) chart.graph.updateOptions({...optionsOf(), file: rows});
  else chart.graph = new Dygraph(target, rows, optionsOf());
  words.textContent = describe();
}

function zoomTrend(how) {
  const {graph} = chart;
  if (!graph) return;
  if (how === "all") {
    graph.resetZoom();
    return;
  }
  const [from, to] = graph.xAxisRange(), width = to - from, [first, last] = graph.xAxisExtremes();
  const shift = {earlier: [-0.5, -0.5], later: [0.5, 0.5], in: [0.25, -0.25], out: [-0.5, 0.5]}[how];
  const window = [Math.max(first, from + shift[0] * width), Math.min(last, to + shift[1] * width)];
  if (window[1] - window[0] > 0) graph.updateOptions({dateWindow: window});
}

for (const button of document.querySelectorAll("[data-zoom]")) {
  button.addEventListener("click", () => zoomTrend(button.dataset.zoom));
}
// Prints have light colours. The chart is scaled to A4 within its margins; its canvas keeps its size,
// because a canvas that is resized while a print is prepared stays blank.
const kPrinted_px = 630;
for (const [event, printing] of [["beforeprint", true], ["afterprint", false]]) {
  window.addEventListener(event, () => {
    document.documentElement.classList.toggle("printing", printing);
    if (!chart.graph) return;
    const {style} = document.getElementById("trend"), {width, height} = chart.graph.size();
    style.width = printing ? width + "px" : "";
    style.height = printing ? height + "px" : "";
    style.zoom = printing ? Math.min(1, kPrinted_px / width) : "";
    chart.graph.updateOptions(optionsOf());
  });
}
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  if (chart.graph) chart.graph.updateOptions(optionsOf());
});
