// What is known about the swarm as one robot sees it, live or recorded, and which instant is shown.

// The columns of a row; see pose_row in view_json.hpp.
export const T = 0;
export const MODE = 1;
export const P = 2;
export const Q = 5;
export const COV = 9;
export const SIGMA = 15;
export const SIGMA_ROTATION = 16;
export const AGE = 17;
export const RESETS = 18;
export const MODES = ["direct", "graph", "predicted"];

const LIVE_SECONDS = 300; // kept of a live swarm
const STALE_SECONDS = 0.5; // an older pose is none
const ROW_SECONDS = 0.04; // between two rows
const MAX_EVENTS = 200;
const GATED = 1; // of the verdicts of an innovation
const READING = 4; // where its numbers begin in a row of innovations
export const KINDS = ["bearing", "peer_bearing", "range", "peer_range"];
// The values of CalibrationRecord, as STATUS names them: key, how many, factor to SI units.
const RADIANS = Math.PI / 180;
const CALIBRATION = [["own_gyro_bias_radps", 3, 1], ["own_accel_bias_mps2", 3, 1], ["gyro_bias_radps", 3, 1], ["accel_bias_mps2", 3, 1], ["range_bias_m", 1, 1],
  ["own_misalignment_deg", 3, RADIANS], ["misalignment_deg", 3, RADIANS]];
export const FRESH_SECONDS = 1.5; // STATUS reports a neighbor's measurements once a second

export const positionOf = (row) => row.slice(P, P + 3);
export const quaternionOf = (row) => row.slice(Q, Q + 4);
export function covarianceOf(row) {
  const [xx, xy, xz, yy, yz, zz] = row.slice(COV, COV + 6);
  return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
}

/** The index of the last row at or before `t`; -1 if there is none. */
export function indexAt(rows, t) {
  let [low, high] = [0, rows.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][T] <= t) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Position and quaternion at `t` between the rows before and after it, which have them from a column on; null in a gap. */
export function poseBetween(rows, t, column) {
  const i = indexAt(rows, t);
  const [a, next] = [rows[i], rows[i + 1]];
  const b = next && next[T] - a?.[T] <= STALE_SECONDS ? next : a;
  if (!a || (a === b && t - a[T] > 2 * ROW_SECONDS)) return null;
  const s = a === b ? 0 : (t - a[T]) / (b[T] - a[T]);
  const [from, to] = [a, b].map((row) => row.slice(column, column + 7));
  const sign = from.slice(3).reduce((sum, x, k) => sum + x * to[3 + k], 0) < 0 ? -1 : 1;
  const mixed = from.map((x, k) => x + s * ((k >= 3 ? sign : 1) * to[k] - x));
  const length = Math.hypot(...mixed.slice(3));
  return { p: mixed.slice(0, 3), q: mixed.slice(3).map((x) => x / length) };
}

/** A row of innovations as STATUS says it; see `SensorReading` in outputs.hpp. */
function readingOf(row, ours, theirs) {
  const z = row.slice(READING);
  const about = { t: row[T], gated: row[2] === GATED };
  if (z.length === 6) return { ...about, u: z.slice(0, 3), from: z.slice(3), to: row[1] === 0 ? theirs.led : ours.led };
  return { ...about, m: z[0], from: ours.uwb, to: theirs.uwb };
}

export class Store {
  constructor(isLive) {
    this.isLive = isLive;
    this.neighbors = new Map(); // by id (live) or name (replay)
    this.cameras = []; // of the observer: name, p, border in its body
    this.ups = []; // rows of t, x, y, z
    this.status = {};
    this.events = [];
    this.link = { ok: false, reason: "not connected yet" };
    this.cursor = null; // the instant that is shown; null: the newest
    this.hasTruth = false;
    this.newest = null; // the time of the newest row, and when it came
    this.rates = new Map(); // counts of the last two statuses: see health.js
    this.version = 0; // grows with every change
  }

  changed() {
    ++this.version;
  }

  neighbor(key, name) {
    let found = this.neighbors.get(key);
    if (!found) {
      found = { key, name: name || `robot ${key}`, index: 0, rows: [], truth: [] };
      this.neighbors.set(key, found);
      // In the order of ids, so that colours do not depend on who was seen first.
      const ordered = [...this.neighbors.values()].sort((a, b) =>
        String(a.key).localeCompare(String(b.key), "en", { numeric: true }));
      this.neighbors = new Map(ordered.map((each, index) => [each.key, Object.assign(each, { index })]));
    }
    if (name) found.name = name;
    return found;
  }

  addReplay({ has_truth: hasTruth, up, mounting, cameras, neighbors }) {
    this.mounting = mounting;
    this.hasTruth = hasTruth;
    this.cameras = cameras.filter(Boolean);
    this.ups = up;
    for (const { name, ...rows } of neighbors) Object.assign(this.neighbor(name, name), rows);
    this.link = { ok: true };
    this.cursor = Math.min(...neighbors.filter(({ rows }) => rows.length).map(({ rows }) => rows[0][T]), this.range()[1]);
    this.changed();
  }

  addFrame({ t, up, rows }, wallSeconds) {
    // A daemon or a machine that started again has another time.
    if (this.newest && t < this.newest.t - 1) this.forget();
    this.newest = { t: this.newest ? Math.max(t, this.newest.t) : t, wall: wallSeconds };
    if (up) this.ups.push([t, ...up]);
    for (const [id, row] of Object.entries(rows)) this.addRow(this.neighbor(id), row);
    this.trim(t - LIVE_SECONDS);
    this.changed();
  }

  addRow(neighbor, row) {
    const last = neighbor.rows.at(-1);
    if (last && row[T] <= last[T]) return;
    if (last && row[RESETS] !== last[RESETS]) this.addEvent("reset", `${neighbor.name}: its filter started anew`);
    if (last && row[T] - last[T] > 1) this.addEvent("found", `${neighbor.name}: located again (${MODES[row[MODE]]})`);
    neighbor.rows.push(row);
  }

  trim(oldest) {
    // Rarely, because it moves all that stays.
    const cut = (rows) => {
      if (rows.length > 100 && rows[0][T] < oldest - 10) rows.splice(0, indexAt(rows, oldest));
    };
    cut(this.ups);
    for (const { rows } of this.neighbors.values()) cut(rows);
  }

  forget() {
    this.ups = [];
    for (const neighbor of this.neighbors.values()) Object.assign(neighbor, { rows: [], measured: [], gated: [], nis: [], calibrations: [] });
    this.newest = null;
    this.cursor = null;
  }

  /** A STATUS may be about a part: its lists replace ours, its neighbors and clocks join them. */
  addStatus(status) {
    if (status.pair) this.addPair(status.pair);
    if (status.team) this.status.team = status.team;
    if (status.pair || status.team) return this.changed();
    const before = structuredClone(this.status);
    const { neighbors = [], clocks = [], more = [], ...rest } = status;
    Object.assign(this.status, rest);
    const merge = (name, entries) => {
      const known = new Map((this.status[name] || []).map((each) => [each.peer, each]));
      for (const each of entries) {
        // Who is only named keeps what is known; of a STATUS that was cut, so do faults.
        const gone = { ...(each.state && { reason: undefined }), ...(each.state && !status.truncated && { faults: undefined }) };
        known.set(each.peer, Object.assign(known.get(each.peer) || {}, gone, each));
      }
      this.status[name] = [...known.values()].sort((a, b) => a.peer - b.peer);
    };
    merge("neighbors", neighbors.concat(more.map((peer) => ({ peer }))));
    merge("clocks", clocks);
    for (const { peer, name } of this.status.neighbors) this.neighbor(String(peer), name);
    for (const { peer, ages_s: ages, measured } of neighbors) if (ages) this.addMeasured(this.neighbor(String(peer)), ages, measured, status.timestamp);
    this.addChanges(before, this.status);
    this.changed();
  }

  /** Of the pair's filter: NIS by kind, and its calibration as in a replay's rows. */
  addPair({ peer, name, residuals = {}, calibration }) {
    if (!this.newest) return;
    const neighbor = this.neighbor(String(peer), name);
    const append = (rows = [], row) => [...rows.filter(([t]) => t < row[T] && t > row[T] - LIVE_SECONDS), row];
    const { t } = this.newest;
    neighbor.nis = append(neighbor.nis, [t, ...KINDS.map((kind) => residuals[kind]?.nis ?? NaN)]);
    if (calibration) neighbor.calibrations = append(neighbor.calibrations, [t, ...CALIBRATION.flatMap(([key, count, scale]) => count === 1 ? [(calibration[key]?.value ?? NaN) * scale] : [0, 1, 2].map((i) => (calibration[key]?.value[i] ?? NaN) * scale))]);
  }

  /** The newest measurement of each kind and when it was taken, as a row of the time when it was known. */
  addMeasured(neighbor, ages, measured = {}, t = this.newest?.t) {
    if (t === undefined) return;
    const entries = Object.fromEntries(Object.entries(ages).map(([kind, age]) => [kind, { ...measured[kind], t: t - age }]));
    neighbor.measured = [...(neighbor.measured || []).filter((row) => row[T] < t && row[T] > t - LIVE_SECONDS), [t, entries]];
  }

  /** The newest measurement of a kind that was known at `t`, or null: `t` when it was taken, what STATUS says of it, whatever its age. */
  measuredAt(neighbor, kind, t) {
    if (this.isLive) {
      const row = (neighbor.measured || [])[indexAt(neighbor.measured || [], t)];
      return row?.[1][kind] || null;
    }
    const rows = neighbor.innovations || [];
    for (let i = indexAt(rows, t); i >= 0 && t - rows[i][T] < FRESH_SECONDS; --i)
      if (rows[i][1] === KINDS.indexOf(kind)) return readingOf(rows[i], this.mounting, neighbor.mounting);
    return null;
  }

  /** Seconds since then; infinite without any. */
  ageOf(neighbor, kind, t) {
    const measured = this.measuredAt(neighbor, kind, t);
    return measured ? t - measured.t : Infinity;
  }

  /** What was measured within the last second or so: the newest of these kinds, or null. */
  freshAt(neighbor, kinds, t) {
    const fresh = kinds.map((kind) => this.measuredAt(neighbor, kind, t)).filter((each) => each && t - each.t < FRESH_SECONDS && (each.u || each.m));
    return fresh.sort((a, b) => b.t - a.t)[0] || null;
  }

  addChanges(before, after) {
    if (!before.self) return;
    if (after.uptime_s < before.uptime_s) this.addEvent("restart", `${after.name}: the daemon has started anew`);
    if (after.config && before.config) {
      if (after.config.generation > before.config.generation) this.addEvent("reload", "the configuration was reloaded");
      if (after.config.fault && after.config.fault !== before.config.fault) this.addEvent("fault", `reload refused: ${after.config.fault}`);
    }
    for (const sensor of after.sensors || []) {
      const was = (before.sensors || []).find(({ name }) => name === sensor.name);
      if (was && was.ok !== sensor.ok) this.addEvent(sensor.ok ? "found" : "fault", `${sensor.name}: ${sensor.ok ? "works again" : sensor.message || "fault"}`);
    }
    for (const neighbor of after.neighbors) {
      const was = (before.neighbors || []).find(({ peer }) => peer === neighbor.peer);
      if (was && was.state !== "none" && neighbor.state === "none") this.addEvent("lost", `${neighbor.name}: no pose (${neighbor.reason})`);
      for (const fault of neighbor.faults || []) if (was && !(was.faults || []).includes(fault)) this.addEvent("fault", `${neighbor.name}: ${fault}`);
    }
  }

  setLink(link) {
    if (link.ok !== this.link.ok) this.addEvent(link.ok ? "found" : "lost", link.ok ? "the daemon answers" : link.reason);
    this.link = link;
    this.changed();
  }

  addEvent(kind, text) {
    this.events.unshift({ kind, text, time: new Date() });
    this.events.length = Math.min(this.events.length, MAX_EVENTS);
  }

  /** First and last time of all rows. */
  range() {
    let [first, last] = [Infinity, -Infinity];
    for (const { rows, truth } of this.neighbors.values()) {
      for (const list of [rows, truth]) {
        if (list.length) [first, last] = [Math.min(first, list[0][T]), Math.max(last, list.at(-1)[T])];
      }
    }
    return first <= last ? [first, last] : [0, 1];
  }

  /** The instant that is shown. The newest one advances while nothing comes: poses grow old. */
  now(wallSeconds) {
    if (this.cursor !== null) return this.cursor;
    return this.newest ? this.newest.t + Math.max(0, wallSeconds - this.newest.wall) : this.range()[1];
  }

  /** The neighbor's row at `t`, or null where it has no pose; `last` is the one before in any case. */
  poseAt(neighbor, t) {
    const last = neighbor.rows[indexAt(neighbor.rows, t)] || null;
    return { row: last && t - last[T] <= STALE_SECONDS ? last : null, last };
  }

  /** The vector against gravity in the body at `t`; null where it is not known. */
  upAt(t) {
    const row = this.ups[indexAt(this.ups, t)];
    return row && t - row[T] <= 2 ? row.slice(1) : null;
  }
}
