// The scene: the observer in the middle of a level grid, neighbors where it believes them.
// Drawn on a canvas by own projection: some thousand lines, no WebGL needed, sharp on every screen.

import { Camera, add, angleBetween, angleOf, carried, levelOf, norm, product, rotationOf, scale, sub, times, turned } from "./geometry.js";
import { colorOf, dashOf, fit, fixed, length, saveCanvases, style } from "./dom.js";
import { MODE, MODES, P, T, covarianceOf, indexAt, poseBetween, positionOf, quaternionOf } from "./store.js";

const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const BODY = [[0.3, 0, 0], [-0.2, 0.18, 0], [-0.1, 0, 0], [-0.2, -0.18, 0]]; // an arrow head [m]
const MIN_BODY_PX = 26;
const DASHES = { direct: [], graph: [9, 5], predicted: [2, 4] };
const MAX_PITCH = 1.57;
const RAY = 0.42; // of the distance: the thick parts of the rays from both sides do not touch
const FAR = 3; // m; a ray to a robot whose place is not known
const CIRCLE_STEPS = 72;
const CONE = 1.5; // m; how far fields of view are drawn

export class Scene {
  constructor(canvas, store) {
    this.canvas = canvas;
    this.store = store;
    this.camera = new Camera();
    this.settings = { sigma: 3, trail: 10, truth: true, measurements: false, cameras: false };
    this.view = "follow";
    this.isFitted = false;
    this.time = NaN; // of the picture
    this.robots = []; // what was drawn, for clicks and tests
    this.ghosts = [];
  }

  reset(store) {
    this.store = store;
    this.isFitted = false;
  }

  setView(view) {
    this.view = view;
    if (view === "free") return;
    this.camera.azimuth = 0;
    this.camera.elevation = view === "top" ? MAX_PITCH : 0.45;
    this.isFitted = false;
  }

  turn(dx, dy) {
    this.camera.azimuth -= dx;
    this.camera.elevation = Math.max(-0.2, Math.min(MAX_PITCH, this.camera.elevation + dy));
    this.view = "free";
  }

  zoom(factor) {
    this.camera.distance = Math.max(0.5, Math.min(400, this.camera.distance * factor));
  }

  /** The robot at a place of the canvas, or null. */
  robotAt(x, y) {
    const near = this.robots
      .map((robot) => ({ robot, distance: Math.hypot(robot.pixel[0] - x, robot.pixel[1] - y) }))
      .sort((a, b) => a.distance - b.distance)[0];
    return near && near.distance < 28 ? near.robot : null;
  }

  draw(t) {
    fit(this.canvas);
    this.pen = this.canvas.getContext("2d");
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.pen.clearRect(0, 0, width, height);
    this.colors = Object.fromEntries(
      ["back", "panel", "text", "soft", "grid", "direct", "graph", "predicted", "axis-x", "axis-y", "axis-z"].map((name) => [name, style(`--${name}`)]));
    this.camera.resize(width, height);
    const up = this.store.upAt(t);
    this.isLevel = up !== null;
    this.level = up ? levelOf(up) : IDENTITY;
    this.robots = [...this.store.neighbors.values()].map((neighbor) => this.robotOf(neighbor, t)).filter(Boolean);
    this.ghosts = this.settings.truth ? [...this.store.neighbors.values()].map((neighbor) => this.ghostOf(neighbor, t)).filter(Boolean) : [];
    this.fitOnce();
    this.camera.update();
    this.drawGrid();
    for (const robot of this.robots) this.drawTrail(robot, t);
    for (const robot of this.robots) this.drawLine(robot);
    if (this.settings.cameras) for (const camera of this.store.cameras) this.drawFieldOfView(camera);
    if (this.settings.measurements) for (const neighbor of this.store.neighbors.values()) this.drawMeasurements(neighbor, t);
    for (const ghost of this.ghosts) this.drawGhost(ghost);
    for (const robot of this.robots) this.drawEllipsoid(robot);
    this.drawBody([0, 0, 0], this.level, this.colors.text, 1);
    const far = (robot) => -this.camera.see(robot.position)[2];
    for (const robot of [...this.robots].sort((a, b) => far(a) - far(b))) this.drawRobot(robot);
    this.describe();
    this.time = t;
  }

  robotOf(neighbor, t) {
    const { row, last } = this.store.poseAt(neighbor, t);
    if (!last) return null;
    return {
      key: neighbor.key,
      name: neighbor.name,
      color: colorOf(neighbor),
      neighbor,
      stamp: last[T],
      mode: row ? MODES[row[MODE]] : "none",
      position: times(this.level, positionOf(last)),
      rotation: product(this.level, rotationOf(quaternionOf(last))),
      covariance: row ? turned(this.level, covarianceOf(row)) : null,
      pixel: [-1, -1],
    };
  }

  /** Where the neighbor was at the instant of the pose that is drawn. */
  ghostOf(neighbor, t) {
    const { row } = this.store.poseAt(neighbor, t);
    const truth = poseBetween(neighbor.truth, row ? row[T] : t, 1);
    return truth && {
      key: neighbor.key,
      position: times(this.level, truth.p),
      rotation: product(this.level, rotationOf(truth.q)),
    };
  }

  /** The farthest robot is in the picture when a view is chosen; later it is the user's distance. */
  fitOnce() {
    if (this.isFitted || this.robots.length === 0) return;
    const reach = Math.max(2, ...this.robots.map(({ position }) => norm(position)));
    const { focal, width, height } = this.camera;
    this.camera.distance = this.view === "top" ? (reach * focal) / (0.42 * Math.min(width, height)) : 1.5 * reach;
    this.isFitted = true;
  }

  stroke(points, color, width, dash = [], alpha = 1) {
    const { pen } = this;
    pen.globalAlpha = alpha;
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    for (const [x, y] of points.slice(0, 1)) pen.moveTo(x, y);
    for (const [x, y] of points.slice(1)) pen.lineTo(x, y);
    pen.stroke();
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }

  line(p, q, color, width, dash, alpha) {
    const ends = this.camera.segment(p, q);
    if (ends) this.stroke(ends, color, width, dash, alpha);
  }

  text(words, p, color, dx = 0, dy = 0) {
    const c = this.camera.see(p);
    if (c[2] < 0.1) return;
    const [x, y] = this.camera.pixel(c);
    const { pen } = this;
    pen.lineWidth = 4;
    pen.lineJoin = "round";
    pen.strokeStyle = this.colors.panel;
    pen.fillStyle = color;
    pen.strokeText(words, x + dx, y + dy);
    pen.fillText(words, x + dx, y + dy);
  }

  /** Lines every metre, or every five or twenty where metres would be too dense; the axes have numbers. */
  drawGrid() {
    const { distance } = this.camera;
    const step = distance < 25 ? 1 : distance < 100 ? 5 : 20;
    const half = step * Math.ceil(Math.min(1.2 * distance, 24 * step) / step);
    for (let i = -half; i <= half; i += step) {
      const alpha = i === 0 ? 1 : 0.75 * (1 - Math.abs(i) / (1.15 * half));
      this.line([i, -half, 0], [i, half, 0], this.colors.grid, 1, [], alpha);
      this.line([-half, i, 0], [half, i, 0], this.colors.grid, 1, [], alpha);
    }
    this.pen.font = "11px system-ui, sans-serif";
    this.pen.textAlign = "center";
    for (const axis of [[1, 0, 0], [0, 1, 0]]) {
      for (const sign of [1, -1]) this.drawNumbers(scale(sign * step, axis), sign * step, half / step);
    }
  }

  /** Outwards from the middle, where they do not touch the one before. */
  drawNumbers(stride, metres, count) {
    let last = null;
    for (let i = 1; i <= count; ++i) {
      const c = this.camera.see(scale(i, stride));
      if (c[2] < 0.1) return;
      const [x, y] = this.camera.pixel(c);
      if (last && Math.abs(x - last[0]) < 38 && Math.abs(y - last[1]) < 18) continue;
      last = [x, y];
      this.text(`${i * metres} m`, scale(i, stride), this.colors.soft, 0, 12);
    }
  }

  /** In the level frame of its own time; kept in the row, which does not change. */
  levelPosition(row) {
    if (!row.level) {
      const up = this.store.upAt(row[T]);
      row.level = times(up ? levelOf(up) : IDENTITY, positionOf(row));
    }
    return row.level;
  }

  drawTrail({ neighbor, color }, t) {
    if (!this.settings.trail) return;
    const { rows } = neighbor;
    const from = Math.max(0, indexAt(rows, t - this.settings.trail));
    const to = indexAt(rows, t);
    const stride = Math.max(1, Math.floor((to - from) / 600));
    for (let i = from; i + stride <= to; i += stride) {
      if (rows[i + stride][T] - rows[i][T] > 1) continue; // no pose in between
      const alpha = 0.1 + 0.75 * (1 - (t - rows[i][T]) / (this.settings.trail + 1));
      this.line(this.levelPosition(rows[i]), this.levelPosition(rows[i + stride]), color, 1.6, dashOf(neighbor), Math.max(0.05, alpha));
    }
  }

  drawLine({ position, mode }) {
    const ground = [position[0], position[1], 0];
    this.line(position, ground, this.colors.soft, 1, [1, 3], 0.8);
    if (mode !== "none") this.line([0, 0, 0], position, this.colors[mode], 2, DASHES[mode], 0.9);
  }

  /** The border of the picture at a distance, and some rays to it from the lens. */
  drawFieldOfView({ p, border }) {
    const at = (u, distance) => times(this.level, add(p, scale(distance, u)));
    border.forEach((u, i) => {
      this.line(at(u, CONE), at(border[(i + 1) % border.length], CONE), this.colors.soft, 1.5);
      if (i % 5 === 0) this.line(at(u, 0), at(u, CONE), this.colors.soft, 1, [], 0.5);
    });
  }

  /**
   * What was measured within the last second or so, as it was measured: a ray from each side that sees the
   * other, and the circle on which a range puts a neighbor of its height. Both sides have moved since then.
   * So a measurement is drawn where it differs from the estimate as much as it did from that of its own time.
   */
  drawMeasurements(neighbor, t) {
    const robot = this.robots.find(({ key }) => key === neighbor.key);
    const about = { neighbor, t, color: colorOf(neighbor), now: robot && robot.mode !== "none" ? this.frameAt(neighbor, t) : null };
    const measured = {
      bearing: this.drawRay(about, this.store.freshAt(neighbor, ["bearing"], t), false),
      peer_bearing: this.drawRay(about, this.store.freshAt(neighbor, ["peer_bearing"], t), true),
      range: this.drawRange(about, this.store.freshAt(neighbor, ["range", "peer_range"], t)),
    };
    if (robot) robot.measured = measured;
  }

  levelAt(t) {
    const up = this.store.upAt(t);
    return up ? levelOf(up) : IDENTITY;
  }

  /** Places of points in the observer's and the neighbor's body, and rotations of both, by the estimate at `t`; null without one. */
  frameAt(neighbor, t) {
    const pose = poseBetween(neighbor.rows, t, P);
    if (!pose) return null;
    const level = this.levelAt(t);
    const [p, R] = [times(level, pose.p), product(level, rotationOf(pose.q))];
    return { level, R, ours: (x) => times(level, x), theirs: (x) => add(p, times(R, x)) };
  }

  /** From the camera in the direction in which it saw the other's lights; what was drawn, or null. */
  drawRay({ neighbor, color, now }, measured, isPeer) {
    if (!measured) return null;
    const then = this.frameAt(neighbor, measured.t);
    const line = ({ ours, theirs }) => (isPeer ? [theirs(measured.from), ours(measured.to)] : [ours(measured.from), theirs(measured.to)]);
    if (!now || !then) return isPeer ? null : this.drawLoneRay(neighbor, color, measured);
    const [camera, lights] = line(then);
    const expected = sub(lights, camera);
    const seen = times(isPeer ? then.R : then.level, measured.u);
    const [start, end] = line(now);
    const ray = carried(seen, expected, sub(end, start));
    const reach = norm(sub(end, start));
    const dash = measured.gated ? [6, 4] : [];
    this.line(start, add(start, scale(RAY * reach, ray)), color, 5, dash, 0.75);
    this.line(start, add(start, scale(reach, ray)), color, 1.5, dash, 0.75);
    return { start, end: add(start, scale(reach, ray)), offBy: angleOf(seen, expected) };
  }

  /** Seen, but where it is is not known. */
  drawLoneRay(neighbor, color, { t, from, u, gated }) {
    const level = this.levelAt(t);
    const [start, end] = [times(level, from), times(level, add(from, scale(FAR, u)))];
    this.line(start, end, color, 3, gated ? [6, 4] : [], 0.75);
    this.text(`${neighbor.name} is seen`, end, color, 0, -6);
    return { start, end, offBy: NaN };
  }

  /** Where the sphere of the measured distance around our antenna has the height of the neighbor's; a sphere below that height has no circle. */
  drawRange({ neighbor, color, now }, measured) {
    if (!measured) return null;
    const then = this.frameAt(neighbor, measured.t);
    const line = ({ ours, theirs }) => sub(theirs(measured.to), ours(measured.from));
    const offBy = now && then ? measured.m - norm(line(then)) : NaN;
    const across = now ? line(now) : [1, 0, 0];
    const distance = now && then ? norm(across) + offBy : measured.m;
    const radius = Math.sqrt(Math.max(0, distance * distance - across[2] * across[2]));
    const center = now ? now.ours(measured.from) : [0, 0, 0];
    const at = (i) => add(center, [radius * Math.cos((2 * Math.PI * i) / CIRCLE_STEPS), radius * Math.sin((2 * Math.PI * i) / CIRCLE_STEPS), across[2]]);
    for (let i = 0; i < CIRCLE_STEPS; i += 2) this.line(at(i), at(i + 1), color, measured.gated ? 2.5 : 1.2, [], 0.8);
    return { distance, radius, offBy };
  }

  drawEllipsoid({ position, covariance, color }) {
    if (!covariance || !this.settings.sigma) return;
    const outline = this.camera.ellipse(position, covariance, this.settings.sigma);
    if (!outline) return;
    const { pen } = this;
    pen.beginPath();
    pen.ellipse(outline.x, outline.y, Math.max(1, outline.a), Math.max(1, outline.b), outline.angle, 0, 2 * Math.PI);
    pen.globalAlpha = 0.22;
    pen.fillStyle = color;
    pen.fill();
    pen.globalAlpha = 0.9;
    pen.strokeStyle = color;
    pen.lineWidth = 1;
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** As large as a robot, or as large as can be seen. */
  bodyScale(position) {
    const depth = Math.max(0.2, this.camera.see(position)[2]);
    return Math.max(1, (MIN_BODY_PX * depth) / (this.camera.focal * 0.5));
  }

  drawBody(position, rotation, color, alpha, isGhost = false) {
    const size = this.bodyScale(position);
    const corners = BODY.map((p) => this.camera.see(add(position, scale(size, times(rotation, p)))));
    if (corners.some((c) => c[2] < 0.05)) return;
    const outline = corners.map((c) => this.camera.pixel(c));
    if (!isGhost) {
      const { pen } = this;
      pen.globalAlpha = 0.55 * alpha;
      pen.fillStyle = color;
      pen.beginPath();
      outline.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      pen.fill();
    }
    this.stroke([...outline, outline[0]], color, isGhost ? 1 : 1.5, isGhost ? [3, 3] : [], alpha);
    if (isGhost) return;
    ["x", "y", "z"].forEach((axis, i) => {
      const tip = add(position, scale(0.45 * size, [rotation[0][i], rotation[1][i], rotation[2][i]]));
      this.line(position, tip, this.colors[`axis-${axis}`], 2, [], alpha);
    });
  }

  drawGhost({ key, position, rotation }) {
    this.drawBody(position, rotation, this.colors.text, 0.9, true);
    const robot = this.robots.find((each) => each.key === key && each.mode !== "none");
    if (!robot) return;
    robot.error = norm(sub(robot.position, position));
    robot.errorRotation = angleBetween(robot.rotation, rotation);
    this.line(position, robot.position, this.colors.text, 1, [3, 3], 0.8);
  }

  drawRobot(robot) {
    const { position, rotation, color, mode } = robot;
    const isKnown = mode !== "none";
    this.drawBody(position, rotation, color, isKnown ? 1 : 0.35);
    const c = this.camera.see(position);
    if (c[2] < 0.1) return;
    robot.pixel = this.camera.pixel(c);
    this.pen.font = "600 13px system-ui, sans-serif";
    this.pen.textAlign = "left";
    this.text(isKnown ? `${robot.name}  ${length(norm(position))}` : `${robot.name}: no pose`, position, color, 14, -12);
  }

  savePng() {
    return saveCanvases("crepes-scene.png", [{ canvas: this.canvas, caption: this.words() }]);
  }

  /** What is drawn, in words. */
  words() {
    const about = this.robots.map(({ name, mode, position }) => {
      if (mode === "none") return `${name}: no pose`;
      const side = position[1] >= 0 ? "left" : "right";
      const end = position[0] >= 0 ? "ahead" : "behind";
      return `${name}: ${fixed(Math.abs(position[0]), 1)} m ${end}, ${fixed(Math.abs(position[1]), 1)} m to the ${side}, ${mode}`;
    });
    return `Scene: ${about.join("; ") || "no robots yet"}`;
  }

  /** For screen readers. */
  describe() {
    const label = this.words();
    const now = performance.now();
    // Not with every picture: screen readers would never come to an end.
    if (this.canvas.getAttribute("aria-label") === label || now - (this.described || -Infinity) < 1000) return;
    this.described = now;
    this.canvas.setAttribute("aria-label", label);
  }
}
