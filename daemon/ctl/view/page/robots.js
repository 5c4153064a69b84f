// A stop for the Tab key at each robot of the scene, which is a picture otherwise.

import { element } from "./dom.js";

export class RobotStops {
  /** `onSelect` is called with a robot of the scene. */
  constructor(list, onSelect) {
    this.list = list;
    this.onSelect = onSelect;
    this.robots = [];
  }

  /** Moves the stops to the robots that were drawn. Those that stay keep the focus. */
  place(robots) {
    this.robots = robots;
    const stops = [...this.list.children];
    for (const stop of stops) if (!robots.some(({ key }) => key === stop.dataset.key)) stop.remove();
    robots.forEach((robot, i) => {
      const stop = stops.find(({ dataset }) => dataset.key === robot.key) || this.stopFor(robot.key);
      if (this.list.children[i] !== stop) this.list.insertBefore(stop, this.list.children[i] || null);
      const button = stop.firstChild;
      const label = `${robot.name}: its view or charts`;
      if (button.getAttribute("aria-label") !== label) button.setAttribute("aria-label", label);
      button.style.transform = `translate(${Math.round(robot.pixel[0])}px, ${Math.round(robot.pixel[1])}px)`;
    });
  }

  stopFor(key) {
    const button = element("button", { type: "button" });
    button.addEventListener("click", () => this.onSelect(this.robots.find((robot) => robot.key === key)));
    return element("li", { "data-key": key }, button);
  }
}
