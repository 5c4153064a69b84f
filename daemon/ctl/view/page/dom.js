// Elements, numbers as text, and files to save.

export const byId = (id) => document.getElementById(id);

/** An element with text or children; text is never read as HTML. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** Replaces the text only if it differs: what does not change is not laid out or read out anew. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
export const degrees = (radians) => (180 / Math.PI) * radians;

/** Metres, in the unit that needs the fewest digits. */
export function length(m) {
  if (!Number.isFinite(m)) return "–";
  if (m < 0.01) return `${(1000 * m).toFixed(1)} mm`;
  return m < 1 ? `${(100 * m).toFixed(1)} cm` : `${m.toFixed(2)} m`;
}

export function save(name, blob) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

const styles = new Map(); // of the theme that is shown

/** The value of a custom property of the style sheet. */
export function style(name) {
  if (!styles.has(name)) styles.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return styles.get(name);
}

/** Another theme is shown from now on. */
export const forgetStyles = () => styles.clear();

const COLORS = 8;
const DASHES = [[], [8, 3], [2, 3]];

/** A robot's color. After the last one they begin anew, with another dash. */
export const colorOf = ({ index }) => style(`--robot-${index % COLORS}`);
export const dashOf = ({ index }) => DASHES[Math.floor(index / COLORS) % DASHES.length];

/** Saves canvases below each other, each with a caption above it, on the page's background. */
export function saveCanvases(name, parts) {
  const ratio = window.devicePixelRatio || 1;
  const title = Math.round(22 * ratio);
  const sheet = element("canvas");
  sheet.width = Math.max(...parts.map(({ canvas }) => canvas.width));
  sheet.height = parts.reduce((sum, { canvas }) => sum + canvas.height + title, 0);
  const pen = sheet.getContext("2d");
  pen.fillStyle = style("--back");
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.fillStyle = style("--text");
  pen.font = `${13 * ratio}px system-ui, sans-serif`;
  let y = 0;
  for (const { canvas, caption } of parts) {
    pen.fillText(caption, 4 * ratio, y + 16 * ratio);
    pen.drawImage(canvas, 0, y + title);
    y += canvas.height + title;
  }
  return new Promise((done) => sheet.toBlob((blob) => { save(name, blob); done(blob); }));
}

/** Fits a canvas to its box; true if it is to be drawn anew. */
export function fit(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const changed = canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio);
  if (changed) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  canvas.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
  return changed;
}
