// Charts over time with one cursor, and what is shown of them as CSV or PNG.

import { anglesOf, angleBetween, levelOf, norm, product, rotationOf, sub, times } from "./geometry.js";
import { colorOf, dashOf, degrees, element, fit, fixed, save, saveCanvases, setText, style } from "./dom.js";
import { AGE, SIGMA, SIGMA_ROTATION, T, indexAt, poseBetween, positionOf, quaternionOf } from "./store.js";

const LEFT = 46; // px, for the numbers
const BOTTOM = 16;
const GAP_SECONDS = 0.5; // a line is interrupted where poses are missing for longer
const MIN_WINDOW = 0.5; // s
const LIVE_WINDOW = 30; // s
const KEY_STEP = 0.01; // of the shown span
const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/** Position and rotation in the level frame of the row's time. */
function levelled(store, t, position, quaternion) {
  const up = store.upAt(t);
  const level = up ? levelOf(up) : IDENTITY;
  return { p: times(level, position), R: product(level, rotationOf(quaternion)) };
}

const ofRow = (store, row) => levelled(store, row[T], positionOf(row), quaternionOf(row));
const ofTruth = (store, row) => levelled(store, row[T], row.slice(1, 4), row.slice(4, 8));

/** A value of the estimate and of the truth, by axis. */
const axis = (label, dash, i) => ({
  label, dash,
  value: (row, store) => ofRow(store, row).p[i],
  truth: (row, store) => ofTruth(store, row).p[i],
});
const angle = (label, dash, i) => ({
  label, dash, jump: 180,
  value: (row, store) => degrees(anglesOf(ofRow(store, row).R)[i]),
  truth: (row, store) => degrees(anglesOf(ofTruth(store, row).R)[i]),
});

const SIGMA_PANELS = [
  { title: "sigma of the position", unit: "cm", fromZero: true, lines: [{ label: "σ", value: (row) => 100 * row[SIGMA] }] },
  { title: "sigma of the orientation", unit: "deg", fromZero: true, lines: [{ label: "σ", value: (row) => degrees(row[SIGMA_ROTATION]) }] },
];
// In a replay they need --debug-innovations.
const MEASUREMENT_PANELS = [
  { title: "age of the newest measurement", unit: "s", fromZero: true, lines: [{ label: "age", value: (row) => row[AGE] }] },
  { title: "gated measurements", unit: "1/s", fromZero: true, rows: "gated", lines: [{ label: "gated", value: (row) => row[1] }] },
];

/** The truth at a row's time. Thinned rows of both lie at most 25 ms apart, so the truth is interpolated. */
const truthNear = (neighbor, t) => poseBetween(neighbor.truth, t, 1);

const ERROR_PANELS = [
  { title: "error of the position", unit: "cm", fromZero: true, lines: [
    { label: "error", value: (row, store, neighbor) => { const truth = truthNear(neighbor, row[T]); return truth ? 100 * norm(sub(positionOf(row), truth.p)) : NaN; } },
    { label: "3 σ", dash: [3, 3], value: (row) => 300 * row[SIGMA] }] },
  { title: "error of the orientation", unit: "deg", fromZero: true, lines: [
    { label: "error", value: (row, store, neighbor) => { const truth = truthNear(neighbor, row[T]); return truth ? degrees(angleBetween(rotationOf(quaternionOf(row)), rotationOf(truth.q))) : NaN; } },
    { label: "3 σ", dash: [3, 3], value: (row) => 3 * degrees(row[SIGMA_ROTATION]) }] },
];

// Of a replay with --debug-innovations: rows of t, kind, verdict, NIS by degree of freedom.
const nisPanel = (title, kinds) => ({
  title: `NIS by degree of freedom, ${title}`, unit: "1", fromZero: true, rows: "innovations", isPoints: true, bound: 1,
  lines: [["fused", (verdict) => verdict === 0], ["not fused", (verdict) => verdict !== 0]].map(([label, has]) => ({
    label, value: (row) => (kinds.includes(row[1]) && has(row[2]) ? row[3] : NaN) })),
});
// Live, the means of the newest measurements, by kind.
const LIVE_NIS_PANEL = {
  title: "NIS by degree of freedom", unit: "1", fromZero: true, rows: "nis", bound: 1,
  lines: [["bearing", []], ["its bearing", [7, 3]], ["range", [2, 3]], ["its range", [9, 3, 2, 3]]].map(([label, dash], i) => ({ label, dash, value: (row) => row[1 + i] })),
};
// Rows of t and the 19 values of CalibrationRecord.
const biasPanel = (title, unit, first, scale = 1) => ({
  title, unit, rows: "calibrations",
  lines: ["x", "y", "z"].map((label, i) => ({ label, dash: [[], [7, 3], [2, 3]][i], value: (row) => scale * row[1 + first + i] })),
});
const NIS_PANELS = [nisPanel("bearings", [0, 1]), nisPanel("ranges", [2, 3])];
const BIAS_PANELS = [
  biasPanel("gyro bias of the observer", "deg/s", 0, degrees(1)),
  biasPanel("gyro bias of the neighbor", "deg/s", 6, degrees(1)),
  biasPanel("accelerometer bias of the observer", "m/s²", 3),
  biasPanel("accelerometer bias of the neighbor", "m/s²", 9),
  { title: "range bias", unit: "cm", rows: "calibrations", lines: [{ label: "bias", value: (row) => 100 * row[13] }] },
  biasPanel("misalignment of the observer's camera", "deg", 13, degrees(1)),
  biasPanel("misalignment of the neighbor's camera", "deg", 16, degrees(1)),
];

/** All neighbors at a glance, or one in all its parts. */
function panelsFor(store, isOne) {
  const errors = store.hasTruth ? ERROR_PANELS : [];
  const where = isOne
    ? [{ title: "position in the level frame", unit: "m", lines: [axis("x", [], 0), axis("y", [7, 3], 1), axis("z", [2, 3], 2)] },
       { title: "attitude", unit: "deg", lines: [angle("roll", [], 0), angle("pitch", [7, 3], 1), angle("yaw", [2, 3], 2)] }]
    : [{ title: "distance", unit: "m", lines: [{ label: "", value: (row) => norm(positionOf(row)) }] }];
  const hasRecords = store.isLive || [...store.neighbors.values()].some(({ innovations }) => innovations?.length);
  const measured = hasRecords ? MEASUREMENT_PANELS : [];
  const records = hasRecords && isOne ? [...(store.isLive ? [LIVE_NIS_PANEL] : NIS_PANELS), ...BIAS_PANELS] : [];
  return [...where, ...errors, ...SIGMA_PANELS, ...measured, ...records];
}

/** A step of 1, 2 or 5 times a power of ten, about four to the span. */
function niceStep(span) {
  const raw = span / 4;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find((m) => m * power >= raw);
}

/** About three digits. */
const short = (value) => fixed(value, Math.abs(value) < 0.1 ? 4 : Math.abs(value) < 10 ? 2 : 1);

export class Charts {
  constructor(root, store) {
    this.root = root;
    this.store = store;
    this.focus = "all";
    this.window = null; // [from, to] that the user chose; null: all of a replay, the last 30 s live
    this.hover = null;
    this.figures = [];
    this.onSeek = () => {};
    this.onChange = () => {};
  }

  reset(store) {
    this.store = store;
    this.focus = "all";
    this.window = null;
    this.build();
  }

  setFocus(key) {
    this.focus = this.store.neighbors.has(key) ? key : "all";
    this.build();
  }

  build() {
    this.figures = panelsFor(this.store, this.focus !== "all").map((panel) => {
      const caption = element("figcaption");
      const canvas = element("canvas", { role: "img", tabindex: "0", "aria-label": panel.title });
      this.listenTo(canvas);
      return { panel, caption, canvas, figure: element("figure", { class: "chart" }, caption, canvas), scale: null };
    });
    this.root.replaceChildren(...this.figures.map(({ figure }) => figure));
  }

  /** The shown span. */
  span(now) {
    if (this.window) return this.window;
    const [first, last] = this.store.range();
    if (!this.store.isLive) return last > first ? [first, last] : [first, first + 1];
    return [now - LIVE_WINDOW, now];
  }

  zoom(factor, around) {
    const [from, to] = this.span(this.store.now(performance.now() / 1000));
    const center = around ?? (from + to) / 2;
    const half = Math.max(MIN_WINDOW, (to - from) * factor);
    const part = (center - from) / (to - from);
    this.window = [center - part * half, center + (1 - part) * half];
    this.onChange();
  }

  showAll() {
    this.window = null;
    this.onChange();
  }

  timeAt(canvas, x) {
    const [from, to] = this.span(this.store.now(performance.now() / 1000));
    return from + ((x - LEFT) / (canvas.clientWidth - LEFT)) * (to - from);
  }

  listenTo(canvas) {
    let grabbed = null;
    const x = (event) => event.clientX - canvas.getBoundingClientRect().left;
    canvas.addEventListener("pointerdown", (event) => {
      grabbed = { x: x(event), span: this.span(this.store.now(performance.now() / 1000)), moved: false };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      this.hover = this.timeAt(canvas, x(event));
      if (grabbed && (grabbed.moved || Math.abs(x(event) - grabbed.x) > 4)) {
        grabbed.moved = true;
        const [from, to] = grabbed.span;
        const shift = ((grabbed.x - x(event)) / (canvas.clientWidth - LEFT)) * (to - from);
        this.window = [from + shift, to + shift];
      }
      this.onChange();
    });
    canvas.addEventListener("pointerup", (event) => {
      if (grabbed && !grabbed.moved && x(event) > LEFT) this.onSeek(this.timeAt(canvas, x(event)));
      grabbed = null;
    });
    canvas.addEventListener("pointerleave", () => this.point(null));
    canvas.addEventListener("dblclick", () => this.showAll());
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.press(event.key)) return;
      event.preventDefault();
      event.stopPropagation();
    });
    canvas.addEventListener("blur", () => this.point(null));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.002 * event.deltaY), this.timeAt(canvas, x(event)));
    }, { passive: false });
  }

  /** The instant to which a mouse or keys point; null: none. */
  point(t) {
    this.hover = t;
    this.onChange();
  }

  /** False for a key without a meaning. */
  press(key) {
    const now = this.store.now(performance.now() / 1000);
    const [from, to] = this.span(now);
    const at = this.hover ?? Math.min(to, Math.max(from, now));
    const step = { ArrowLeft: -KEY_STEP, ArrowRight: KEY_STEP, PageUp: -10 * KEY_STEP, PageDown: 10 * KEY_STEP }[key];
    if (step) this.point(Math.min(to, Math.max(from, at + step * (to - from))));
    else if (key === "+" || key === "-") this.zoom(key === "+" ? 0.6 : 1.6, at);
    else if (key === "Enter") this.onSeek(at);
    else if (key === "Escape") this.point(null);
    else return false;
    return true;
  }

  neighbors() {
    const all = [...this.store.neighbors.values()];
    return this.focus === "all" ? all : all.filter(({ key }) => key === this.focus);
  }

  /** The lines of a panel: their points within the span, and one beyond each end. */
  linesOf(panel, [from, to]) {
    const lines = [];
    for (const neighbor of this.neighbors()) {
      const rows = panel.rows ? neighbor[panel.rows] || [] : neighbor.rows;
      const within = (list) => list.slice(Math.max(0, indexAt(list, from)), indexAt(list, to) + 2);
      panel.lines.forEach((line, i) => {
        const isAll = this.focus === "all";
        const color = colorOf(isAll ? neighbor : { index: i });
        const dash = isAll && !line.dash ? dashOf(neighbor) : line.dash || [];
        const label = this.focus === "all" ? `${neighbor.name} ${line.label}`.trim() : line.label;
        const points = within(rows).map((row) => [row[T], line.value(row, this.store, neighbor)]);
        lines.push({ neighbor, label, color, dash, jump: line.jump, width: 1.5, points, isGapped: !panel.rows, isPoints: panel.isPoints });
        if (line.truth && neighbor.truth.length) {
          lines.push({ neighbor, label: `${line.label} truth`, color: style("--soft"), dash: line.dash || [], jump: line.jump, width: 1, isGapped: true,
                       points: within(neighbor.truth).map((row) => [row[T], line.truth(row, this.store)]) });
        }
      });
    }
    return lines;
  }

  draw(now) {
    const span = this.span(now);
    for (const figure of this.figures) this.drawPanel(figure, span, now);
  }

  drawPanel(figure, span, now) {
    const { panel, canvas, caption } = figure;
    if (canvas.clientWidth === 0) return;
    fit(canvas);
    const pen = canvas.getContext("2d");
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    pen.clearRect(0, 0, width, height);
    const lines = this.linesOf(panel, span);
    figure.lines = lines;
    const scale = this.scaleOf(panel, lines, span, width, height);
    this.drawAxes(pen, scale, span, width, height);
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, 0, width - LEFT, height - BOTTOM);
    pen.clip();
    if (panel.bound) this.drawLine(pen, { points: [[span[0], panel.bound], [span[1], panel.bound]], color: style("--soft"), dash: [3, 3], width: 1 }, scale);
    for (const line of lines) (line.isPoints ? this.drawPoints : this.drawLine).call(this, pen, line, scale);
    const cursor = this.hover ?? now;
    pen.strokeStyle = style("--text");
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(scale.x(cursor), 0);
    pen.lineTo(scale.x(cursor), height);
    pen.stroke();
    pen.restore();
    this.writeCaption(caption, panel, lines, cursor);
  }

  scaleOf(panel, lines, [from, to], width, height) {
    let [low, high] = panel.fromZero ? [0, 0] : [Infinity, -Infinity];
    for (const { points } of lines) {
      for (const [, value] of points) {
        if (!Number.isFinite(value)) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    if (!(low <= high)) [low, high] = [0, 1];
    const margin = Math.max(1e-3, 0.06 * (high - low));
    const [bottom, top] = [panel.fromZero ? 0 : low - margin, high + margin];
    return {
      bottom, top,
      x: (t) => LEFT + ((t - from) / (to - from)) * (width - LEFT),
      y: (value) => 4 + ((top - value) / (top - bottom)) * (height - BOTTOM - 4),
    };
  }

  drawAxes(pen, scale, [from, to], width, height) {
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = style("--soft");
    pen.strokeStyle = style("--grid");
    pen.lineWidth = 1;
    pen.setLineDash([]);
    const step = niceStep(scale.top - scale.bottom);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.beginPath();
    for (let value = Math.ceil(scale.bottom / step) * step; value <= scale.top; value += step) {
      pen.moveTo(LEFT, scale.y(value));
      pen.lineTo(width, scale.y(value));
      pen.fillText(fixed(value, digits), LEFT - 6, Math.max(7, scale.y(value)));
    }
    pen.stroke();
    pen.textAlign = "center";
    pen.textBaseline = "bottom";
    const zero = this.store.isLive ? (this.store.newest?.t ?? to) : 0;
    const tick = niceStep(to - from);
    for (let t = zero + Math.ceil((from - zero) / tick) * tick; t <= to; t += tick) {
      if (scale.x(t) < LEFT + 14 || scale.x(t) > width - 16) continue;
      pen.fillText(`${fixed(t - zero, tick < 1 ? 1 : 0)} s`, scale.x(t), height);
    }
  }

  drawLine(pen, { points, color, dash, width, isGapped, jump = Infinity }, scale) {
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    let last = null;
    for (const [t, value] of points) {
      if (!Number.isFinite(value)) continue;
      const isBroken = last === null || (isGapped && t - last[0] > GAP_SECONDS) || Math.abs(value - last[1]) > jump;
      if (isBroken) pen.moveTo(scale.x(t), scale.y(value));
      else pen.lineTo(scale.x(t), scale.y(value));
      last = [t, value];
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  drawPoints(pen, { points, color }, scale) {
    pen.fillStyle = color;
    for (const [t, value] of points) if (Number.isFinite(value)) pen.fillRect(scale.x(t) - 1, scale.y(value) - 1, 2, 2);
  }

  /** Title and the values at the cursor, which are also what a screen reader reads. */
  writeCaption(caption, panel, lines, cursor) {
    const values = lines.filter(({ label }) => !label.endsWith("truth")).map(({ label, points }) => {
      let i = indexAt(points, cursor);
      while (i >= 0 && !Number.isFinite(points[i][1]) && cursor - points[i][0] < GAP_SECONDS) --i;
      const point = points[i];
      const isNear = point && (cursor - point[0] < 2 * GAP_SECONDS);
      return { label, value: isNear ? short(point[1]) : "–" };
    });
    while (caption.children.length < values.length + 1) caption.append(element(caption.children.length ? "span" : "b"));
    while (caption.children.length > values.length + 1) caption.lastChild.remove();
    setText(caption.firstChild, `${panel.title} [${panel.unit}]`);
    values.forEach(({ label, value }, i) => {
      const node = caption.children[i + 1];
      setText(node, `${label} ${value}`);
      const line = lines.filter(({ label: each }) => !each.endsWith("truth"))[i];
      if (node.style.color !== line.color) node.style.color = line.color;
    });
  }

  /** One row a value: what is on the screen, in long form. */
  csv(now) {
    const [from, to] = this.span(now);
    const lines = ["t_s,neighbor,panel,unit,line,value"];
    for (const { panel } of this.figures) {
      for (const { neighbor, label, points } of this.linesOf(panel, [from, to])) {
        for (const [t, value] of points)
          if (t >= from && t <= to && Number.isFinite(value)) lines.push(`${t},${neighbor.name},${panel.title},${panel.unit},${label},${Number(value.toPrecision(7))}`);
      }
    }
    return `${lines.join("\n")}\n`;
  }

  saveCsv(now) {
    save("crepes.csv", new Blob([this.csv(now)], { type: "text/csv" }));
  }

  /** The charts below each other, as they are on the screen. */
  savePng() {
    const shown = this.figures.filter(({ canvas }) => canvas.width > 0);
    return saveCanvases("crepes.png", shown.map(({ canvas, caption }) => ({ canvas, caption: [...caption.children].map(({ textContent }) => textContent).join("   ") })));
  }
}
