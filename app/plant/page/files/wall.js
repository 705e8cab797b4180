// Shows changes as they come. The server makes every card, with all that comes from a cell escaped,
// so that the page with and without this script is the same.
"use strict";

const kLost_ms = 6000, kPoll_ms = 1000, kPatience_ms = 4000;
const byId = (id) => document.getElementById(id);
const form = byId("selection"), main = document.querySelector("main");
let version = document.body.dataset.version, heard_ms = performance.now();

function showStrip(strip, time) {
  byId("head").className = strip.style;
  byId("glyph").textContent = strip.glyph;
  // Only what changed, so that a screen reader does not repeat it.
  for (const part of ["headline", "reason"]) {
    if (byId(part).textContent !== strip[part]) byId(part).textContent = strip[part];
  }
  if (time) byId("about").textContent = time;
  document.title = strip.headline + " - Plumbline";
  document.body.classList.toggle("is-lost", strip.style === "lost");
}

function listOf(card) {
  const lined = main.classList.contains("lines");
  const key = lined ? "line " + card.dataset.line : card.dataset.group;
  const lists = [...document.querySelectorAll("ol")];
  const list = lists.find((one) => one.dataset.list === key);
  if (list) return list;
  const section = document.createElement("section"), title = document.createElement("h2");
  const made = document.createElement("ol");
  title.textContent = card.dataset.line;
  made.dataset.list = key;
  section.append(title, made);
  main.append(section);
  return made;
}

function select(card) {
  const words = form.elements.q.value.toLowerCase().split(" "), state = form.elements.state.value;
  card.hidden = !words.every((word) => card.dataset.words.includes(word)) ||
    (state === "person" ? card.dataset.group !== "person" : state !== "" && card.dataset.state !== state);
}

function apply(update) {
  heard_ms = performance.now();
  version = update.version;
  const template = document.createElement("template");
  template.innerHTML = update.cards.join("");
  const fresh = [...template.content.children];
  for (const card of fresh) {
    const old = byId(card.id);
    const focused = old !== null && old.contains(document.activeElement);
    if (old) old.replaceWith(card);
    else listOf(card).append(card);
    select(card);
    if (focused) card.querySelector("a")?.focus();
  }
  const known = new Set(update.order.map((cell) => "c" + cell));
  document.querySelectorAll(".card").forEach((card) => { if (!known.has(card.id)) card.remove(); });
  // Moves only what is at the wrong place.
  const placed = new Map();
  for (const cell of update.order) {
    const card = byId("c" + cell);
    if (!card) continue;
    const list = listOf(card), before = placed.get(list);
    const place = before ? before.nextElementSibling : list.firstElementChild;
    if (place !== card) list.insertBefore(card, place);
    placed.set(list, card);
  }
  showStrip(update.strip, update.time);
}

async function poll() {
  const abort = new AbortController(), timer = setTimeout(() => abort.abort(), kPatience_ms);
  try {
    const answer = await fetch("update.json?since=" + version, {signal: abort.signal, cache: "no-store"});
    if (answer.status === 401) location.reload();
    if (answer.ok) apply(await answer.json());
  } catch (error) { // shown as lost
  } finally {
    clearTimeout(timer);
  }
  setTimeout(poll, kPoll_ms);
}

function listen() {
  const events = new EventSource("events?since=" + version);
  events.addEventListener("message", (event) => apply(JSON.parse(event.data)));
  // The browser connects again by itself, unless it was refused: too many streams, or a token.
  events.addEventListener("error", () => { if (events.readyState === EventSource.CLOSED) poll(); });
}

setInterval(() => {
  const silent_ms = performance.now() - heard_ms;
  if (silent_ms < kLost_ms) return;
  showStrip({style: "lost", glyph: "○", headline: "LOST",
    reason: "the page's server does not respond; what is below is " + Math.round(silent_ms / 1000) + " s old"});
}, kPoll_ms);

function reselect() {
  document.querySelectorAll(".card").forEach(select);
  history.replaceState(null, "", "?" + new URLSearchParams(new FormData(form)));
}
document.documentElement.classList.add("scripted");
form.addEventListener("submit", (event) => { event.preventDefault(); reselect(); });
form.elements.q.addEventListener("input", reselect);
form.elements.state.addEventListener("change", reselect);
form.elements.lines.addEventListener("change", () => form.submit());
listen();
