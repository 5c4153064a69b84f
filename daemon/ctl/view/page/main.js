// The page: opens the stream or the replay, keeps the shown instant, and draws what has changed.

import { CameraPanel } from "./camera.js";
import { Charts } from "./charts.js";
import { byId, element, fixed, forgetStyles, setText } from "./dom.js";
import { Health, Rates } from "./health.js";
import { RobotStops } from "./robots.js";
import { Scene } from "./scene.js";
import { Store } from "./store.js";
import { listen, load } from "./stream.js";

const SLOW_MS = 150; // between two drawings of charts and tiles
const wall = () => performance.now() / 1000;

let source = { live: true, robots: [] };
let robot = 0;
let stop = () => {};
let store = new Store(true);
let rates = new Rates();
let isPlaying = true;
let lastTurn = wall();
let drawnVersion = -1;
let drawnTime = NaN;
let lastSlow = 0;
let mustDraw = true;

const scene = new Scene(byId("scene-canvas"), store);
const charts = new Charts(byId("charts"), store);
const health = new Health({ neighbors: byId("neighbors"), sensors: byId("sensors"), links: byId("links"), team: byId("team"), teamAge: byId("team-age"), events: byId("events"), load: byId("load") }, store);
const camera = new CameraPanel(store);
const stops = new RobotStops(byId("scene-robots"), (robot) => select(robot));
const redraw = () => { mustDraw = true; };

// ---- the source -------------------------------------------------------------------------------

function showLink() {
  const { ok, reason } = store.link;
  byId("link").classList.toggle("bad", !ok);
  const { name, place } = source.robots[robot] || {};
  setText(byId("link"), ok ? (store.isLive ? `live: ${name || "robot"} at ${place || ""}` : `replay, CREPES ${source.release}`) : reason);
}

function setSource(about) {
  source = about;
  if (source.advice) health.advice = source.advice;
  const labels = source.robots.map(({ name, place }, i) => name || place || `robot ${i + 1}`);
  const select = byId("robot");
  const shown = [...select.options].map(({ text }) => text);
  if (shown.join() !== labels.join()) {
    select.replaceChildren(...labels.map((label, i) => element("option", { value: String(i) }, label)));
    select.value = String(robot);
  }
  document.title = `${labels[robot] || "robot"} – CREPES`;
  showLink();
}

function listFocus() {
  const select = byId("focus");
  const keys = ["all", ...store.neighbors.keys()];
  const labels = ["all", ...[...store.neighbors.values()].map(({ name }) => name)];
  if ([...select.options].map(({ text }) => text).join() === labels.join()) return;
  select.replaceChildren(...labels.map((label, i) => element("option", { value: keys[i] }, label)));
  select.value = charts.focus;
}

function onEvent(name, data) {
  if (name === "robots") setSource(data);
  if (name === "frame") store.addFrame(data, wall());
  if (name === "link") store.setLink(data);
  if (name === "status") {
    store.addStatus(data);
    rates.addStatus(store, data, wall());
  }
  if (name !== "frame") showLink();
}

async function show(index) {
  stop();
  robot = index;
  store = new Store(source.live);
  rates = new Rates();
  for (const part of [scene, charts, health, camera]) part.reset(store);
  isPlaying = source.live;
  setSource(source);
  byId("truth-label").hidden = byId("ghost-legend").hidden = true;
  byId("measurements-label").hidden = false;
  byId("cameras-label").hidden = !source.live;
  for (const node of document.querySelectorAll("[data-live]")) node.hidden = !source.live;
  if (!source.live && document.body.dataset.panel === "camera") showPanel("scene");
  showCamera();
  if (scene.settings.cameras) camera.loadCameras(robot);
  byId("speed-label").hidden = source.live;
  redraw();
  if (source.live) {
    stop = listen(`/events?robot=${robot}`, onEvent, (error) => {
      store.setLink({ ok: false, reason: error.message });
      showLink();
    });
    return;
  }
  // Somebody may choose another robot before the answer comes.
  const mine = store;
  const replay = await load(`/replay?robot=${index}`).catch((error) => {
    mine.setLink({ ok: false, reason: error.message });
  });
  if (store !== mine) return;
  if (!replay) return showLink();
  store.addReplay(replay);
  charts.build();
  byId("cameras-label").hidden = store.cameras.length === 0;
  byId("measurements-label").hidden = ![...store.neighbors.values()].some(({ innovations }) => innovations?.length);
  byId("truth-label").hidden = byId("ghost-legend").hidden = !store.hasTruth;
  showLink();
}

async function start() {
  for (;;) {
    try {
      setSource(await load("/robots"));
      await show(0);
      return;
    } catch (error) {
      store.setLink({ ok: false, reason: error.name === "TypeError" ? "no connection to crepesctl view" : error.message });
      showLink();
      await new Promise((resume) => setTimeout(resume, 1000));
    }
  }
}

// ---- time -------------------------------------------------------------------------------------

function seek(t) {
  const [first, last] = store.range();
  store.cursor = Math.max(first, Math.min(last, t));
  if (store.isLive) isPlaying = false;
  redraw();
}

function play(on) {
  const [first, last] = store.range();
  isPlaying = on;
  if (store.isLive) store.cursor = on ? null : store.now(wall());
  else if (on && store.cursor >= last) store.cursor = first;
  redraw();
}

function advance() {
  const now = wall();
  if (!store.isLive && isPlaying) {
    const last = store.range()[1];
    store.cursor = Math.min(last, store.cursor + (now - lastTurn) * Number(byId("speed").value));
    if (store.cursor >= last) isPlaying = false;
  }
  lastTurn = now;
}

function drawTransport(t) {
  const [first, last] = store.range();
  const slider = byId("slider");
  slider.min = first;
  slider.max = last;
  slider.value = Math.min(t, last);
  const shown = store.isLive ? (store.cursor === null ? "live" : `${fixed(t - last, 2)} s`) : `${fixed(t, 2)} s`;
  setText(byId("clock"), shown);
  slider.setAttribute("aria-valuetext", shown);
  setText(byId("play"), isPlaying ? "‖" : "▶");
  byId("play").setAttribute("aria-label", isPlaying ? "Pause" : "Play");
  byId("live").hidden = !store.isLive || store.cursor === null;
}

/** Why the scene may look otherwise than expected. */
function noteOf(t) {
  if (!store.link.ok) return store.link.reason;
  if (store.neighbors.size === 0) return "no neighbors yet";
  if (scene.settings.cameras && camera.isLoading && camera.state.reason) return `What the cameras see is not known: ${camera.state.reason}`;
  if (scene.isLevel) return "";
  if (!store.isLive) return store.hasTruth ? "" : "Gravity is not known without --truth: the grid is the robot's own x-y plane.";
  return store.newest ? "Gravity is not known: the grid is the robot's own x-y plane." : "No poses yet: see Health for the reasons.";
}

function turn() {
  advance();
  const t = store.now(wall());
  const isIdle = store.version === drawnVersion && t === drawnTime && !mustDraw;
  if (!isIdle) {
    drawnVersion = store.version;
    drawnTime = t;
    mustDraw = false;
    scene.draw(t);
    stops.place(scene.robots);
    setText(byId("scene-note"), noteOf(t));
    drawTransport(t);
    const now = performance.now();
    if (now - lastSlow > SLOW_MS) {
      lastSlow = now;
      listFocus();
      charts.draw(t);
      health.draw(t, wall());
    } else {
      mustDraw = true; // charts and tiles are still to come
    }
  }
  requestAnimationFrame(turn);
}

// ---- what the user does -----------------------------------------------------------------------

function press(selector, pressed) {
  for (const button of document.querySelectorAll(selector)) button.setAttribute("aria-pressed", String(button === pressed));
}

function showPanel(name) {
  document.body.dataset.panel = name;
  press("nav button", document.querySelector(`nav [data-panel="${name}"]`));
  showCamera();
  redraw();
}

const showCamera = () => camera.show(document.body.dataset.panel === "camera", robot);

function setView(name) {
  scene.setView(name);
  press("[data-view]", document.querySelector(`[data-view="${name}"]`));
  redraw();
}

/** To the view of a neighbor, or to its charts if nobody serves its view. */
function select({ key, name }) {
  const index = source.robots.findIndex((each) => (each.id !== undefined ? String(each.id) === key : each.name === name));
  if (index < 0) {
    charts.setFocus(key);
    byId("focus").value = charts.focus;
    redraw();
    return;
  }
  byId("robot").value = String(index);
  show(index);
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  localStorage.setItem("theme", name);
  forgetStyles();
  redraw();
}
const flipTheme = () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");

function listenToScene() {
  const { canvas } = scene;
  let grabbed = null;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("pointerdown", (event) => {
    grabbed = { at: place(event), moved: false };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    if (!grabbed) {
      canvas.style.cursor = scene.robotAt(x, y) ? "pointer" : "grab";
      return;
    }
    const [dx, dy] = [x - grabbed.at[0], y - grabbed.at[1]];
    if (!grabbed.moved && Math.hypot(dx, dy) < 4) return;
    grabbed = { at: [x, y], moved: true };
    scene.turn(0.008 * dx, 0.008 * dy);
    press("[data-view]", document.querySelector('[data-view="free"]'));
    redraw();
  });
  canvas.addEventListener("pointerup", (event) => {
    const hit = grabbed && !grabbed.moved && scene.robotAt(...place(event));
    grabbed = null;
    if (hit) select(hit);
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    scene.zoom(Math.exp(0.0015 * event.deltaY));
    redraw();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] }[event.key];
    if (turns) {
      scene.turn(...turns);
      press("[data-view]", document.querySelector('[data-view="free"]'));
    } else if (event.key === "+" || event.key === "-") {
      scene.zoom(event.key === "+" ? 0.85 : 1.18);
    } else {
      return;
    }
    event.preventDefault();
    redraw();
  });
}

const KEYS = {
  1: () => showPanel("scene"),
  2: () => showPanel("health"),
  3: () => showPanel("time"),
  4: () => source.live && showPanel("camera"),
  f: () => setView("follow"),
  t: () => setView("top"),
  m: () => byId("measurements").click(),
  c: () => byId("cameras").click(),
  d: flipTheme,
  "?": () => byId("help-dialog").showModal(),
  " ": () => play(!isPlaying),
  ",": () => seek(store.now(wall()) - 0.04),
  ".": () => seek(store.now(wall()) + 0.04),
  Home: () => seek(store.range()[0]),
  End: () => (store.isLive ? play(true) : seek(store.range()[1])),
};

function listenToPage() {
  addEventListener("keydown", (event) => {
    const isTyping = event.target.matches("select") || (event.target.matches("input, button, dialog *") && (event.key === " " || event.key.length > 1));
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey || byId("help-dialog").open || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  for (const button of document.querySelectorAll("nav button")) button.addEventListener("click", () => showPanel(button.dataset.panel));
  for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => setView(button.dataset.view));
  const on = (id, type, action) => byId(id).addEventListener(type, (event) => { action(event.target); redraw(); });
  on("robot", "change", ({ value }) => show(Number(value)));
  on("theme", "click", flipTheme);
  on("help", "click", () => byId("help-dialog").showModal());
  on("sigma", "change", ({ value }) => { scene.settings.sigma = Number(value); });
  on("trail", "change", ({ value }) => { scene.settings.trail = Number(value); });
  on("measurements", "change", ({ checked }) => {
    scene.settings.measurements = checked;
    for (const node of document.querySelectorAll("[data-measured]")) node.hidden = !checked;
  });
  on("cameras", "change", ({ checked }) => {
    scene.settings.cameras = checked;
    if (checked) camera.loadCameras(robot);
  });
  on("truth", "change", ({ checked }) => { scene.settings.truth = checked; });
  on("focus", "change", ({ value }) => charts.setFocus(value));
  on("zoom-in", "click", () => charts.zoom(0.6));
  on("zoom-out", "click", () => charts.zoom(1.6));
  on("zoom-all", "click", () => charts.showAll());
  on("csv", "click", () => charts.saveCsv(store.now(wall())));
  on("png", "click", () => charts.savePng());
  on("scene-png", "click", () => scene.savePng());
  on("play", "click", () => play(!isPlaying));
  on("live", "click", () => play(true));
  on("slider", "input", ({ value }) => seek(Number(value)));
  addEventListener("resize", () => { camera.draw(); redraw(); });
  document.addEventListener("visibilitychange", showCamera);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", ({ matches }) => setTheme(matches ? "dark" : "light"));
}

setTheme(localStorage.getItem("theme") || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
charts.onSeek = seek;
charts.onChange = redraw;
charts.build();
listenToScene();
listenToPage();
start();
requestAnimationFrame(turn);

// For tests and the curious: what is drawn, read back.
globalThis.crepes = { get scene() { return scene; }, get store() { return store; }, get charts() { return charts; }, camera, seek, play, select };
