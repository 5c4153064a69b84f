// The camera's picture with what was found in it, and its light.

import { byId, element, fixed, setText } from "./dom.js";
import { listen, post } from "./stream.js";

const SATURATED = 250; // of 255; the picture comes as a JPEG
const MARK = { saturated: [255, 122, 61], lit: [86, 180, 233] };
const RATE_SECONDS = 3;
const UNKNOWN = 6; // the color of a robot that is no neighbor: grey
const [COVERED, MISSING] = ["#3fcf9f", "#f0e442"];
const SLIDERS = {
  exposure_us: { from: (us) => Math.log10(us), to: (x) => Math.round(10 ** x), text: (us) => `${us} µs`, of: ({ light }) => light.exposure_us },
  gain: { from: Number, to: Number, text: (gain) => fixed(gain, 1), of: ({ light }) => light.gain },
  threshold: { from: Number, to: Number, text: (level) => (level > 0 ? String(level) : "automatic"), of: ({ threshold }) => threshold },
};

/** Brightness of dark pictures, as the eye sees it: the square root. */
const BRIGHTENED = Uint8Array.from({ length: 256 }, (_, level) => Math.round(Math.sqrt(255 * level)));

/** The grey levels of a JPEG in base64. */
async function decoded(jpeg) {
  const bytes = Uint8Array.from(atob(jpeg), (letter) => letter.charCodeAt(0));
  return createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
}

export class CameraPanel {
  constructor(store) {
    this.store = store;
    this.isShown = false;
    this.isLoading = false; // what the cameras see
    this.canvas = byId("camera-canvas");
    this.sheet = element("canvas"); // the picture alone, pixel by pixel
    this.camera = 0;
    this.robot = 0;
    this.state = { cameras: [], control: false, threshold: 0 };
    this.picture = null; // the numbers of the shown one
    this.coverage = null; // of a calibration that runs
    this.times = [];
    this.stop = null;
    this.listen();
  }

  reset(store) {
    this.store = store;
    this.close();
    this.isLoading = false;
    this.camera = 0;
    this.picture = null;
    this.setCoverage({});
  }

  /** Asks for pictures only while they are seen. */
  show(isShown, robot) {
    this.isShown = isShown;
    const isWanted = (isShown || this.isLoading) && this.store.isLive && !document.hidden;
    if (this.stop && (!isWanted || robot !== this.robot)) this.close();
    this.robot = robot;
    if (isWanted && !this.stop) this.open();
  }

  /** What the cameras see, for the scene: the daemon says it with its first picture. */
  loadCameras(robot) {
    this.isLoading = this.store.isLive && this.store.cameras.length === 0;
    this.show(this.isShown, robot);
  }

  open() {
    this.setNote("waiting for a picture");
    this.stop = listen(`/camera?robot=${this.robot}&camera=${this.camera}`, (name, data) => {
      if (name === "camera") this.setState(data);
      if (name === "picture") this.setPicture(data);
      if (name === "coverage") this.setCoverage(data);
    }, (error) => this.setNote(error.message));
  }

  close() {
    this.stop?.();
    this.stop = null;
    this.times = [];
  }

  setNote(text) {
    setText(byId("camera-note"), text);
  }

  setState(state) {
    this.state = state;
    const names = state.cameras.map(({ name }) => name);
    const select = byId("camera-name");
    if ([...select.options].map(({ text }) => text).join() !== names.join()) {
      select.replaceChildren(...names.map((name, i) => element("option", { value: String(i) }, name)));
      select.value = String(this.camera);
    }
    this.setNote(state.reason || "");
    if (state.cameras.length > 0) this.store.cameras = state.cameras.map(({ field }) => field).filter(Boolean);
    this.store.changed();
    if (this.isLoading && this.store.cameras.length > 0) {
      this.isLoading = false;
      this.show(this.isShown, this.robot);
    }
    this.showLight();
  }

  /** Of a calibration that runs, of the first camera; else without cells. */
  setCoverage(coverage) {
    this.coverage = this.camera === 0 && coverage.cells ? coverage : null;
    byId("camera-coverage").hidden = this.coverage === null;
    if (this.coverage) {
      const { share, picture, seen_s: seconds, boards, missing } = this.coverage;
      byId("coverage-bar").value = share;
      setText(byId("coverage-numbers"), `${fixed(100 * share, 0)} % of what a calibration needs: ${fixed(100 * picture, 0)} % of the picture, ` +
        `boards in view for ${fixed(seconds, 0)} s (${boards.join(", ") || "none"})`);
      const list = byId("coverage-missing");
      if ([...list.children].map(({ textContent }) => textContent).join() !== missing.join()) list.replaceChildren(...missing.map((text) => element("li", {}, text)));
    }
    this.draw();
  }

  /** Cells in which boards were seen, and those that still lack them. */
  drawCoverage(pen) {
    const { cells } = this.coverage;
    const [width, height] = [this.canvas.clientWidth / cells[0].length, this.canvas.clientHeight / cells.length];
    cells.forEach((line, row) => [...line].forEach((cell, column) => {
      if (cell === " ") return;
      const box = [column * width + 1, row * height + 1, width - 2, height - 2];
      pen.globalAlpha = cell === "#" ? 0.25 : 0.8;
      pen.fillStyle = pen.strokeStyle = cell === "#" ? COVERED : MISSING;
      pen.lineWidth = 1;
      pen.setLineDash([2, 3]);
      if (cell === "#") pen.fillRect(...box);
      else pen.strokeRect(...box);
    }));
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }

  /** What is in force, unless a slider is being moved. */
  showLight() {
    const about = { light: this.state.cameras[this.camera] || {}, threshold: this.state.threshold };
    byId("camera-light").disabled = !this.state.control;
    byId("camera-control").hidden = this.state.control || this.state.cameras.length === 0;
    for (const [name, { from, of }] of Object.entries(SLIDERS)) {
      const slider = byId(name);
      const value = of(about);
      if (slider.dataset.moves !== "yes" && value !== undefined) {
        slider.max = Math.max(Number(slider.dataset.max), from(value));
        slider.value = from(value);
      }
      if (slider.dataset.moves !== "yes") this.writeSlider(name, value);
    }
  }

  writeSlider(name, value) {
    const text = value === undefined ? "its own" : SLIDERS[name].text(value);
    setText(byId(`${name}-value`), text);
    byId(name).setAttribute("aria-valuetext", text);
  }

  async change(name) {
    const slider = byId(name);
    slider.dataset.moves = "";
    const value = SLIDERS[name].to(slider.value);
    try {
      await post(`/light?robot=${this.robot}&camera=${this.camera}&${name}=${value}`);
      setText(byId("camera-change"), "");
    } catch (error) {
      setText(byId("camera-change"), `${name.replace("_us", "")}: ${error.message}`);
      this.showLight();
    }
  }

  listen() {
    for (const name of Object.keys(SLIDERS)) {
      byId(name).addEventListener("input", ({ target }) => {
        target.dataset.moves = "yes";
        this.writeSlider(name, SLIDERS[name].to(target.value));
      });
      byId(name).addEventListener("change", () => this.change(name));
    }
    byId("camera-name").addEventListener("change", ({ target }) => {
      this.camera = Number(target.value);
      this.close();
      this.open();
    });
    for (const id of ["camera-bright", "camera-marks"]) byId(id).addEventListener("change", () => this.draw());
  }

  async setPicture(picture) {
    const bitmap = await decoded(picture.jpeg);
    if (!this.stop) return;
    this.sheet.width = picture.width;
    this.sheet.height = picture.height;
    const pen = this.sheet.getContext("2d", { willReadFrequently: true });
    pen.drawImage(bitmap, 0, 0);
    bitmap.close();
    this.levels = pen.getImageData(0, 0, picture.width, picture.height);
    this.picture = picture;
    const now = performance.now() / 1000;
    this.times = [...this.times.filter((t) => now - t < RATE_SECONDS), now];
    this.draw();
  }

  draw() {
    if (!this.picture || this.canvas.clientWidth === 0) return;
    const { width, height, scale } = this.picture;
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round((this.canvas.width * height) / width);
    this.paint();
    const pen = this.canvas.getContext("2d");
    pen.drawImage(this.sheet, 0, 0, this.canvas.width, this.canvas.height);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.perPixel = this.canvas.clientWidth / (width * scale); // of the screen to one of the camera
    if (this.coverage) this.drawCoverage(pen);
    this.drawFindings(pen);
    this.describe();
  }

  /** The picture's grey levels as they are shown: brighter, and with marks. */
  paint() {
    const { data, width, height } = this.levels;
    const shown = new ImageData(width, height);
    const isBright = byId("camera-bright").checked;
    const hasMarks = byId("camera-marks").checked;
    const { threshold } = this.picture;
    for (let i = 0; i < data.length; i += 4) {
      const level = data[i];
      const mark = hasMarks && (level >= SATURATED ? MARK.saturated : level >= threshold ? MARK.lit : null);
      const grey = isBright ? BRIGHTENED[level] : level;
      for (let k = 0; k < 3; ++k) shown.data[i + k] = mark ? (grey + mark[k]) / 2 : grey;
      shown.data[i + 3] = 255;
    }
    this.sheet.getContext("2d").putImageData(shown, 0, 0);
  }

  place([u, v]) {
    return [(u + 0.5) * this.perPixel, (v + 0.5) * this.perPixel];
  }

  drawFindings(pen) {
    const color = (name) => getComputedStyle(this.canvas).getPropertyValue(`--${name}`).trim();
    const { spots, hot, robots, predicted } = this.picture;
    for (const spot of spots) this.ring(pen, spot, 3 + Math.sqrt(spot[2] / Math.PI) * this.perPixel, color("soft"));
    for (const pixel of hot) this.cross(pen, pixel, color("bad"));
    for (const [id, ...uv] of predicted) this.ring(pen, uv, 16, this.colorOf(id, color), [4, 4]);
    for (const [id, ...uv] of robots) {
      this.ring(pen, uv, 11, this.colorOf(id, color), [], 2);
      this.name(pen, id, uv, this.colorOf(id, color));
    }
  }

  colorOf(id, color) {
    return color(`robot-${(this.store.neighbors.get(String(id))?.index ?? UNKNOWN) % 8}`);
  }

  ring(pen, uv, radius, color, dash = [], width = 1) {
    const [x, y] = this.place(uv);
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.stroke();
    pen.setLineDash([]);
  }

  cross(pen, uv, color) {
    const [x, y] = this.place(uv);
    pen.strokeStyle = color;
    pen.lineWidth = 1;
    pen.beginPath();
    for (const sign of [1, -1]) {
      pen.moveTo(x - 4, y - 4 * sign);
      pen.lineTo(x + 4, y + 4 * sign);
    }
    pen.stroke();
  }

  name(pen, id, uv, color) {
    const [x, y] = this.place(uv);
    pen.font = "600 12px system-ui, sans-serif";
    pen.fillStyle = color;
    pen.fillText(this.nameOf(id), x + 14, y - 8);
  }

  nameOf(id) {
    return this.store.neighbors.get(String(id))?.name || `robot ${id}`;
  }

  /** The same in words. */
  describe() {
    const { spots, robots, threshold, background, saturated, hot_pixels: hot } = this.picture;
    const rate = this.times.length > 1 ? (this.times.length - 1) / (this.times.at(-1) - this.times[0]) : NaN;
    const seen = robots.map(([id]) => this.nameOf(id)).join(", ") || "none";
    setText(byId("camera-numbers"), `spots: ${spots.length}, hot pixels learned: ${hot}, ${fixed(100 * saturated, 2)} % saturated; ` +
      `background ${background}, threshold ${threshold}; ${fixed(rate, 1)} pictures a second`);
    const label = `Picture of the camera; spots: ${spots.length}; identified: ${seen}`;
    if (this.canvas.getAttribute("aria-label") !== label) this.canvas.setAttribute("aria-label", label);
  }
}
