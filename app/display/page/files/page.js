// Fetches the status once a second and shows it. Received values are inserted as text, never as
// markup.
"use strict";

const kPoll_ms = 1000, kPatience_ms = 4000, kLost_ms = 3000, kAsleep_ms = 6000, kRetry_ms = 3000;
const kRenew_ms = 30000, kSoon_ms = 500;
const kSlow_ms = 10000, kOldView_s = 3, kOldPicture_s = 3;
// The glyphs of the display; normal states have none.
const kMarks = {good: ["", ""], attention: ["▲", "attention: "], bad: ["■", "bad: "],
  faded: ["", ""], plain: ["", ""]};
const kLevels = {3: "bad", 4: "attention"};

const byId = (id) => document.getElementById(id);
let lastGood_ms = performance.now(), lastPoll_ms = performance.now(), lost = false, pictures = 0;
let status = null, slow_ms = -kSlow_ms, retry = null, serverStart = null;
// The picture stream: when it was requested, and until when its picture counts as live.
let asked_ms = -Infinity, liveUntil_ms = -Infinity;

function element(tag, text, className) {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  if (className) made.className = className;
  return made;
}

// A symbol and, for screen readers, a word: colour must not be the only cue.
function marked(parent, line) {
  const [sign, word] = kMarks[line.tone] || kMarks.plain;
  parent.replaceChildren();
  if (sign) {
    const mark = element("span", sign, "mark");
    mark.setAttribute("aria-hidden", "true");
    parent.append(mark);
  }
  if (word) parent.append(element("span", word, "unseen"));
  parent.append(line.text);
}

// Updates only what changed, so that a screen reader or a selection keeps its position.
function put(target, key, fill) {
  const text = JSON.stringify(key);
  if (target.dataset.key === text) return;
  target.dataset.key = text;
  fill(target);
}

const twoDigits = (number) => String(number).padStart(2, "0");

// Local time of the browser.
function localText(utc_s) {
  const at = new Date(1000 * utc_s);
  if (Number.isNaN(at.getTime())) return "";
  const date = [at.getFullYear(), at.getMonth() + 1, at.getDate()].map(twoDigits).join("-");
  return date + " " + [at.getHours(), at.getMinutes(), at.getSeconds()].map(twoDigits).join(":");
}

// Local time, and UTC beside it where they differ.
function timeText(utc_s) {
  const at = new Date(1000 * utc_s);
  if (Number.isNaN(at.getTime())) return "";
  if (at.getTimezoneOffset() === 0) return localText(utc_s) + " UTC";
  return localText(utc_s) + " (" + at.toISOString().slice(11, 19) + " UTC)";
}

const ageText = (s) => s < 120 ? Math.round(s) + " s" : Math.round(s / 60) + " min";

function listInto(target, lines) {
  target.replaceChildren(...lines.map((line) => {
    const item = element("li", "", line.tone);
    marked(item, line);
    return item;
  }));
}

function showPanels(panels) {
  put(byId("panels"), panels, (target) => {
    target.replaceChildren(...panels.map((panel) => {
      const section = element("section");
      const list = element("ul");
      listInto(list, panel.lines);
      section.append(element("h2", panel.title), list);
      return section;
    }));
  });
}

function postureText(posture) {
  if (!posture || !posture.joints) return "";
  const joints = posture.joints.map((joint) =>
    joint.value.toFixed(1).replace("-", "\u2212") + (joint.unit === "mm" ? "\u00a0mm" : "°"));
  return "joints " + joints.join(" ") + (posture.taught ? "" : ", posture not fixed by near_deg");
}

function tileOf(tile, posture) {
  const item = element("li", "", "tile " + tile.class), title = element("h3"), value = element("p", "", "value");
  const glyph = element("span", tile.glyph, "glyph");
  glyph.setAttribute("aria-hidden", "true");
  title.append(glyph, tile.name, element("span", " (" + tile.class + ")", "unseen"));
  if (tile.class !== "alarm") value.append(element("small", "corrected "));
  value.append(tile.value);
  item.append(title, value, element("p", tile.radius, "radius"));
  if (tile.note) item.append(element("p", tile.note, "note"));
  if (posture) item.append(element("p", posture, "joints"));
  return item;
}

function showTiles(tiles, points) {
  const postures = points.map((point) => point.valid ? postureText(point.posture) : "");
  put(byId("tiles"), [tiles, postures], (target) => {
    target.replaceChildren(...tiles.map((tile, k) => tileOf(tile, postures[k])));
    if (tiles.length === 0) target.replaceChildren(element("li", "no assembly point configured", "faded"));
  });
}

// Largest stated radius of the valid points.
function radiusOf(points) {
  const radii = points.filter((point) => point.valid && point.uncertainty_m).map((point) => 1000 * point.uncertainty_m);
  return radii.length ? Math.max(...radii) : null;
}

function showLog(log) {
  put(byId("log"), log, (target) => {
    target.replaceChildren(...log.slice().reverse().map((entry) => {
      const tone = kLevels[Math.max(entry.level, 3)] || "plain";
      const item = element("li", "", tone);
      const from = entry.from === "plumblined" ? "" : "[view] ";
      marked(item, {tone, text: localText(entry.utc_s) + " " + from + entry.text});
      item.title = timeText(entry.utc_s);
      return item;
    }));
  });
}

function showStrip(strip) {
  byId("head").className = strip.class;
  put(byId("glyph"), strip.glyph, (target) => { target.textContent = strip.glyph; });
  put(byId("headline"), strip.word, (target) => { target.textContent = strip.word; });
  put(byId("reason"), strip.reason, (target) => { target.textContent = strip.reason; });
  put(byId("do"), strip.do, (target) => { target.textContent = strip.do ? "→ " + strip.do : ""; });
}

function showPicture(picture) {
  const old = picture.age_s === null || picture.age_s > kOldPicture_s;
  const live = performance.now() < liveUntil_ms;
  byId("live").classList.toggle("old", old || !live);
  let words = "Live, as on the display.";
  if (picture.age_s === null) words = "No picture yet.";
  else if (old) words = "THE PICTURE IS OLD: drawn " + ageText(picture.age_s) + " ago.";
  else if (!live) words = "WAITING FOR THE LIVE PICTURE: the picture shown is old.";
  if (picture.problem) words = "NO PICTURE: " + picture.problem;
  byId("caption").textContent = words;
}

function askPicture() {
  clearTimeout(retry);
  asked_ms = performance.now();
  byId("picture").src = "live.mjpg?" + (++pictures);
}

function startPicture() {
  liveUntil_ms = -Infinity;
  askPicture();
}

// An interrupted stream looks like a still picture, so the stream is requested again periodically.
// Until the new one starts, the previous picture is shown and counts as live a little longer.
function renewPicture() {
  liveUntil_ms = Math.min(liveUntil_ms, performance.now() + 1000 * kOldPicture_s);
  askPicture();
}

function stopPicture() {
  clearTimeout(retry);
  liveUntil_ms = -Infinity;
  byId("picture").removeAttribute("src");
}

// The content below is outdated; the headline must say so.
function showLost(what, age_s) {
  document.body.classList.toggle("is-lost", what !== "");
  if (what === "") return;
  showStrip({class: "lost", glyph: "○", word: "LOST", reason: what,
    do: "everything below is " + ageText(age_s) + " old"});
  document.title = "LOST - Plumbline";
}

function show() {
  const silent_ms = performance.now() - lastGood_ms;
  if (silent_ms > kLost_ms) {
    lost = true;
    showLost("plumbline-view does not respond", silent_ms / 1000);
    return;
  }
  if (status === null) return;
  const cell = status.cell || "no cell yet";
  byId("about").textContent = cell + (status.utc_s ? ", " + timeText(status.utc_s) : "");
  showPicture(status.picture);
  showPanels(status.panels);
  showTiles(status.tiles || [], status.points || []);
  showLog(status.log);
  byId("version").textContent = "Plumbline " + status.build;
  if (status.view.age_s > kOldView_s) {
    showLost("the drawing thread of plumbline-view hangs", status.view.age_s);
    return;
  }
  showLost("");
  showStrip(status.strip);
  document.title = status.strip.word + " - " + cell;
}

function showReports(reports) {
  put(byId("reports"), reports, (target) => {
    const words = {diagnosis: "latest diagnosis", model: "model version ", alarm: "alarm picture "};
    // alarm-UTC-WORD-N.png: the number within the alarm; the time follows.
    const numberOf = (report) => (report.name.match(/(\d+)\.png$/) || ["", ""])[1];
    const pictures = reports.filter((report) => report.kind === "alarm");
    setAlarmPictures(pictures.map((report) =>
      ({name: report.name,
        words: "Alarm picture " + numberOf(report) + ", " + timeText(report.utc_s)})));
    target.replaceChildren(...reports.map((report) => {
      const name = report.kind === "model" ? String(parseInt(report.name, 10)) :
        report.kind === "alarm" ? numberOf(report) : "";
      const item = element("li");
      const link = element("a", words[report.kind] + name);
      link.href = "reports/" + encodeURIComponent(report.name);
      if (report.kind === "alarm") {
        link.addEventListener("click", (event) => {
          event.preventDefault();
          showAlarmPicture(pictures.indexOf(report));
        });
      }
      item.append(link, ", " + timeText(report.utc_s));
      return item;
    }));
    if (reports.length === 0) target.replaceChildren(element("li", "none yet", "faded"));
  });
}

async function ask(what) {
  const abort = new AbortController();
  const timer = setTimeout(() => abort.abort(), kPatience_ms);
  try {
    const answer = await fetch(what, {signal: abort.signal, cache: "no-store"});
    if (answer.status === 401) location.reload();
    return answer.ok ? await answer.json() : null;
  } catch (error) {
    return null;
  } finally {
    clearTimeout(timer);
  }
}

async function askSlowly() {
  slow_ms = performance.now();
  const trend = await ask("trend.json");
  if (trend) drawTrend(trend, radiusOf((status && status.points) || []));
  const reports = await ask("reports.json");
  if (reports) showReports(reports.reports);
}

async function poll() {
  const now_ms = performance.now();
  const slept = now_ms - lastPoll_ms > kAsleep_ms;
  lastPoll_ms = now_ms;
  const fresh = await ask("status.json");
  if (fresh) {
    status = fresh;
    lastGood_ms = performance.now();
    // The browser does not restart the stream by itself.
    const another = serverStart !== null && serverStart !== fresh.page.start;
    serverStart = fresh.page.start;
    if (!document.hidden) {
      if (lost || slept || another) startPicture();
      else if (performance.now() - asked_ms > kRenew_ms) renewPicture();
    }
    lost = false;
  }
  show();
  if (fresh && performance.now() - slow_ms >= kSlow_ms) askSlowly();
  setTimeout(poll, kPoll_ms);
}

byId("picture").addEventListener("load", () => {
  liveUntil_ms = Infinity;
  show();
});
// If the stream was live, the viewer limit may still count the previous stream: retry soon.
byId("picture").addEventListener("error", () => {
  clearTimeout(retry);
  const soon = performance.now() < liveUntil_ms;
  liveUntil_ms = -Infinity;
  if (!document.hidden) retry = setTimeout(startPicture, soon ? kSoon_ms : kRetry_ms);
  show();
});
// A hidden page needs no pictures.
document.addEventListener("visibilitychange", () => document.hidden ? stopPicture() : startPicture());
setInterval(show, kPoll_ms);
if (!document.hidden) startPicture();
poll();
