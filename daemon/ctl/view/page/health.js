// Tiles of sensors and neighbors with reason and advice, the links, and the events.

import { degrees, element, fit, fixed, length, setText, style } from "./dom.js";
import { norm } from "./geometry.js";
import { AGE, FRESH_SECONDS, MODE, MODES, SIGMA, SIGMA_ROTATION, T, indexAt, positionOf } from "./store.js";

const SPARK_SECONDS = 30;
const BAD_NIS = 2; // mean by degree of freedom; 1 for an honest filter

const totals = (object) => Object.entries(object || {}).map(([name, count]) => `${name.replaceAll("_", " ")} ${count}`).join(", ");

/** A list entry that stays while its texts change: no layout jumps, and focus is kept. */
function tileIn(list, key) {
  let tile = [...list.children].find((each) => each.dataset.key === key);
  if (!tile) {
    tile = element("li", { class: "tile", "data-key": key }, element("div", { class: "head" }, element("span"), element("span", { class: "state" })),
      element("p", { class: "advice" }), element("p", { class: "numbers" }), element("canvas", { "aria-hidden": "true" }));
    list.append(tile);
  }
  return tile;
}

function fill(tile, { name, state, advice, numbers, isBad, spark }) {
  setText(tile.querySelector(".head span"), name);
  setText(tile.querySelector(".state"), state);
  setText(tile.querySelector(".advice"), advice);
  setText(tile.querySelector(".numbers"), numbers);
  tile.classList.toggle("bad", isBad);
  drawSpark(tile.querySelector("canvas"), spark);
}

/** The points of the last half minute, from zero upwards. */
function drawSpark(canvas, { points, from, to }) {
  if (canvas.clientWidth === 0) return;
  fit(canvas);
  const pen = canvas.getContext("2d");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  pen.clearRect(0, 0, width, height);
  const top = Math.max(1e-9, ...points.map(([, value]) => value));
  pen.strokeStyle = style("--accent");
  pen.lineWidth = 1.5;
  pen.beginPath();
  points.forEach(([t, value], i) => {
    const x = ((t - from) / (to - from)) * width;
    const y = height - 2 - (value / top) * (height - 4);
    if (i === 0 || t - points[i - 1][0] > 2) pen.moveTo(x, y);
    else pen.lineTo(x, y);
  });
  pen.stroke();
}

/** The share of the channel, and whose datagrams could be forged. */
const airOf = ({ mesh }) => mesh ? `, ${fixed(100 * mesh.airtime_of_all, 1)} % of the air with all that are heard${mesh.warning ? `; ${mesh.warning}` : ""}` : "";
/** The share of a neighbor's datagrams that do not arrive. */
const lossOf = (about) => about?.reports?.loss > 0 ? `, ${fixed(100 * about.reports.loss, 0)} % of its datagrams lost` : "";

const verdicts = (neighbor, kind, verdict) => neighbor.measurements?.[kind]?.[verdict] || 0;
const allOf = (neighbor, verdict) => Object.values(neighbor.measurements || {}).reduce((sum, kind) => sum + (kind[verdict] || 0), 0);

/** Writes cells as [text, isBad]; nodes stay while the number of rows does. */
function fillTable(table, head, rows) {
  if (table.rows.length !== rows.length + 1) {
    table.replaceChildren(element("thead", {}, element("tr", {}, ...head.map((text) => element("th", { scope: "col" }, text)))),
      element("tbody", {}, ...rows.map((cells) => element("tr", {}, ...cells.map((_, j) => element(j === 0 ? "th" : "td", j === 0 ? { scope: "row" } : {}))))));
  }
  rows.forEach((cells, i) => cells.forEach(([text, isBad = false], j) => {
    setText(table.rows[i + 1].cells[j], text);
    table.rows[i + 1].cells[j].classList.toggle("bad", isBad);
  }));
}

/** Rate and age of a kind of measurement; an old one is marked. */
const measuredCells = (rate, ageMs) => [[fixed(rate, 1)], [fixed(ageMs, 0), ageMs > 1000 * FRESH_SECONDS]];

/** Measurements per second between two reports of the totals. */
export class Rates {
  constructor() {
    this.last = new Map();
  }

  /** Called after each STATUS; `seconds` is the wall's time. Adds rows to the store for charts and sparklines. */
  addStatus(store, status, seconds) {
    for (const neighbor of status.neighbors || []) {
      if (!neighbor.measurements) continue;
      const key = String(neighbor.peer);
      const last = this.last.get(key);
      const passed = last ? status.uptime_s - last.uptime_s : Infinity;
      if (passed >= 0 && passed < 0.9) continue;
      const now = { uptime_s: status.uptime_s, counts: neighbor.measurements, gated: allOf(neighbor, "gated") };
      this.last.set(key, now);
      // A daemon that starts anew counts from zero.
      const more = (kind) => verdicts(neighbor, kind, "fused") - (last?.counts[kind]?.fused || 0);
      const kinds = Object.keys(now.counts);
      if (!last || passed < 0 || now.gated < last.gated || kinds.some((kind) => more(kind) < 0)) continue;
      const known = store.neighbor(key, neighbor.name);
      known.rates = Object.fromEntries(kinds.map((kind) => [kind, more(kind) / passed]));
      const t = store.newest?.t;
      if (t !== undefined) known.gated = [...(known.gated || []).slice(-400), [t, (now.gated - last.gated) / passed]];
    }
    for (const sensor of store.status.sensors || []) {
      const rows = (store.sensorRates ||= new Map()).get(sensor.name) || [];
      if (rows.length && seconds - rows.at(-1)[0] < 0.4) continue;
      store.sensorRates.set(sensor.name, [...rows.slice(-120), [seconds, sensor.rate_hz || 0]]);
    }
  }
}

export class Health {
  constructor(nodes, store) {
    this.nodes = nodes;
    this.advice = {}; // by reason, what to do where there is no pose
    this.reset(store);
  }

  reset(store) {
    this.store = store;
    this.shownEvents = null;
    for (const list of [this.nodes.neighbors, this.nodes.sensors, this.nodes.links, this.nodes.team, this.nodes.events]) list.replaceChildren();
  }

  draw(t, wallSeconds) {
    this.drawNeighbors(t);
    if (!this.store.isLive) return;
    this.drawSensors(wallSeconds);
    this.drawLinks(t);
    this.drawTeam();
    this.drawEvents();
    const { status } = this.store;
    const share = status.uptime_s > 0 ? (100 * status.cpu_s) / status.uptime_s : NaN;
    setText(this.nodes.load, status.self ? `${status.name}: up ${fixed(status.uptime_s, 0)} s, ${fixed(share, 1)} % of a core, ${fixed(status.rss_mb, 0)} MB${airOf(status)}` : "");
  }

  drawNeighbors(t) {
    for (const neighbor of this.store.neighbors.values()) {
      const { row } = this.store.poseAt(neighbor, t);
      const about = (this.store.status.neighbors || []).find(({ peer }) => String(peer) === neighbor.key);
      const reason = about?.reason || (this.store.isLive ? "no answer from the daemon" : "no row in the replay");
      const faults = (about?.faults || []).join("; ");
      const from = t - SPARK_SECONDS;
      const rows = neighbor.rows.slice(Math.max(0, indexAt(neighbor.rows, from)), indexAt(neighbor.rows, t) + 1);
      fill(tileIn(this.nodes.neighbors, neighbor.key), {
        name: neighbor.name,
        state: row ? MODES[row[MODE]] : reason,
        isBad: !row || faults !== "",
        advice: faults || (row ? "" : this.advice[reason] || ""),
        numbers: row ? `${length(norm(positionOf(row)))} away, σ ${length(row[SIGMA])}, ${fixed(degrees(row[SIGMA_ROTATION]), 2)} deg${this.store.isLive ? `, measured ${fixed(1000 * row[AGE], 0)} ms ago${lossOf(about)}` : ""}` : "",
        spark: { points: rows.map((each) => [each[T], each[SIGMA]]), from, to: t },
      });
    }
  }

  drawSensors(wallSeconds) {
    const sensors = this.store.status.sensors || [];
    for (const tile of [...this.nodes.sensors.children]) if (!sensors.some(({ name }) => name === tile.dataset.key)) tile.remove();
    for (const sensor of sensors) {
      const counts = [totals(sensor.faults), totals(sensor.counts)].filter(Boolean).join("; ");
      fill(tileIn(this.nodes.sensors, sensor.name), {
        name: sensor.name,
        state: sensor.ok ? "ok" : "fault",
        isBad: !sensor.ok,
        advice: sensor.ok ? "" : sensor.message || "fault",
        numbers: `${fixed(sensor.rate_hz || 0, 1)} Hz${counts ? `; ${counts}` : ""}`,
        spark: { points: this.store.sensorRates?.get(sensor.name) || [], from: wallSeconds - SPARK_SECONDS, to: wallSeconds },
      });
    }
  }

  /** One row a neighbor; of each kind of measurement the rate and how long ago the newest was taken. */
  drawLinks(t) {
    const head = ["neighbor", "heard ms ago", "lost now %", "lost %", "clock s", "± ms", "ppm", "we see /s", "ms ago", "sees us /s", "ms ago", "ranges /s", "ms ago", "off by cm", "gated", "air %"];
    const rows = (this.store.status.neighbors || []).map((neighbor) => {
      const clock = (this.store.status.clocks || []).find(({ peer }) => peer === neighbor.peer) || {};
      const { received = 0, lost = 0, age_s: age, loss } = neighbor.reports || {};
      const known = this.store.neighbor(String(neighbor.peer));
      const rates = known.rates || {};
      const since = (...kinds) => 1000 * Math.min(...kinds.map((kind) => this.store.ageOf(known, kind, t)));
      const range = (rates.range ?? NaN) + (rates.peer_range ?? 0);
      return [
        [neighbor.name || String(neighbor.peer)],
        [fixed(1000 * age, 0), age > 1],
        [fixed(100 * loss, 0), loss > 0.1],
        [fixed((100 * lost) / (received + lost), 1), lost > 0.1 * (received + lost)],
        [fixed(clock.offset_s, 6)], [fixed(1000 * clock.sigma_s, 3)], [fixed(clock.skew_ppm, 1)],
        ...measuredCells(rates.bearing, since("bearing")),
        ...measuredCells(rates.peer_bearing, since("peer_bearing")),
        ...measuredCells(range, since("range", "peer_range")),
        [fixed(100 * neighbor.range_residual_m, 1)],
        [String(allOf(neighbor, "gated"))],
        [fixed(100 * neighbor.airtime, 2)],
      ];
    });
    fillTable(this.nodes.links, head, rows);
  }

  /** What the team's filter finds of each robot, this one among them. */
  drawTeam() {
    const { robots = [], age_s: age } = this.store.status.team || {};
    this.nodes.team.closest("[data-team]").hidden = robots.length === 0;
    fillTable(this.nodes.team, ["robot", "trusted", "NIS of bearings", "of ranges", "of the gyro", "what contradicts the team"], robots.map(({ robot, name, trusted, nis = {}, faults = [] }) => [
      [name || String(robot)],
      [trusted ? "yes" : "no", !trusted],
      ...["bearing", "range", "gyro"].map((kind) => [fixed(nis[kind], 2), nis[kind] > BAD_NIS]),
      [faults.join("; "), faults.length > 0],
    ]));
    setText(this.nodes.teamAge, age > 1 ? `${fixed(age, 1)} s ago` : "");
  }

  drawEvents() {
    const newest = this.store.events[0];
    if (newest === this.shownEvents) return;
    this.shownEvents = newest;
    this.nodes.events.replaceChildren(...this.store.events.map(({ kind, text, time }) =>
      element("li", { class: kind }, element("time", { datetime: time.toISOString() }, time.toLocaleTimeString()), element("span", {}, text))));
  }
}
