// The plot page: dark where the system is, and charts that enlarge and zoom.

const dark = matchMedia("(prefers-color-scheme: dark)");
const followSystem = () => { document.documentElement.dataset.theme = dark.matches ? "dark" : "light"; };
dark.addEventListener("change", followSystem);
followSystem();

const MAX_ZOOM = 40;

/** Part of the chart that is shown: [left, top, width, height] in its own units. */
const viewOf = (svg) => svg.getAttribute("viewBox").split(" ").map(Number);

function listenTo(svg) {
  const [, , width, height] = viewOf(svg);
  let grabbed = null;

  /** Within the chart, and never larger than it. */
  const show = ([left, top, shownWidth]) => {
    const w = Math.min(width, Math.max(width / MAX_ZOOM, shownWidth));
    const h = (w * height) / width;
    const within = (value, most) => Math.min(Math.max(0, value), most);
    svg.setAttribute("viewBox", `${within(left, width - w)} ${within(top, height - h)} ${w} ${h}`);
    svg.classList.toggle("zoomed", w < width);
  };
  /** The point of the picture under the pointer stays where it is. */
  const zoom = (factor, x = 0.5, y = 0.5) => {
    const [left, top, w, h] = viewOf(svg);
    const next = Math.min(width, w * factor);
    show([left + x * (w - next), top + y * (h - (next * height) / width), next]);
  };
  const pan = (dx, dy) => {
    const [left, top, w, h] = viewOf(svg);
    show([left + dx * w, top + dy * h, w]);
  };
  const place = (event) => {
    const box = svg.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  const enlarge = () => svg.classList.toggle("large");

  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !svg.classList.contains("large")) return; // the page scrolls
    event.preventDefault();
    zoom(Math.exp(0.002 * event.deltaY), ...place(event));
  }, { passive: false });
  svg.addEventListener("pointerdown", (event) => {
    grabbed = { at: place(event), moved: false };
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    if (!grabbed) return;
    const [x, y] = place(event);
    const [dx, dy] = [grabbed.at[0] - x, grabbed.at[1] - y];
    if (!grabbed.moved && Math.hypot(dx, dy) < 0.01) return;
    grabbed = { at: [x, y], moved: true };
    pan(dx, dy);
  });
  svg.addEventListener("pointerup", () => {
    if (grabbed && !grabbed.moved) enlarge();
    grabbed = null;
  });
  svg.addEventListener("keydown", (event) => {
    const actions = {
      Enter: enlarge, "+": () => zoom(0.7), "-": () => zoom(1.4), 0: () => show([0, 0, width]),
      ArrowLeft: () => pan(-0.1, 0), ArrowRight: () => pan(0.1, 0), ArrowUp: () => pan(0, -0.1), ArrowDown: () => pan(0, 0.1),
    };
    const isArrow = event.key.startsWith("Arrow");
    if (!actions[event.key] || event.ctrlKey || (isArrow && !svg.classList.contains("zoomed"))) return;
    event.preventDefault();
    actions[event.key]();
  });
}

for (const svg of document.querySelectorAll(".charts svg")) {
  svg.setAttribute("tabindex", "0");
  svg.setAttribute("aria-label", svg.querySelector(".title").textContent);
  listenTo(svg);
}
