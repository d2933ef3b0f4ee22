// The guidance force as an arc on the picture's rim, at the side of the wall that is near: a hand sees what it cannot feel.
import { h, svg } from "../dom.js";

const MEAN_S = 0.03; // over which the force is averaged: it jumps between two steps
export const LEAST_N = 0.2; // less is not shown
export const RED_N = 2;
const HALF_DEG = [10, 45]; // half the arc at the least force, and from RED_N on
const [CENTRE, RADIUS] = [50, 48.2];

/**
 * Half the angle of the arc in degrees, and whether it is red; null where there is none.
 * @param {number} force N
 */
export function arcOf(force) {
  if (!(force >= LEAST_N)) return null;
  const share = Math.min(1, (force - LEAST_N) / (RED_N - LEAST_N));
  return { half: HALF_DEG[0] + share * (HALF_DEG[1] - HALF_DEG[0]), red: force >= RED_N };
}

export class GuidanceArc {
  constructor() {
    this.arc = svg("path", { fill: "none", "stroke-width": "3", "stroke-linecap": "round" });
    this.element = h("div", { class: "scope-arc", hidden: true }, svg("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, this.arc));
    this.mean = [0, 0]; // N, to the right and down
    this.at = NaN;
  }

  /**
   * @param {number} x N, of the force on the hand, to the right in the picture
   * @param {number} y N, down
   * @param {number} t s
   */
  push(x, y, t) {
    const passed = t - this.at;
    const share = passed >= 0 ? 1 - Math.exp(-passed / MEAN_S) : 1;
    this.at = t;
    this.mean = [this.mean[0] + share * (x - this.mean[0]), this.mean[1] + share * (y - this.mean[1])];
    this.draw();
  }

  draw() {
    const [x, y] = this.mean, shown = arcOf(Math.hypot(x, y));
    this.arc.style.display = shown ? "" : "none";
    if (!shown) return;
    const towards = Math.atan2(-y, -x); // the force leads away from the wall
    const ends = [-1, 1].map((side) => towards + (side * shown.half * Math.PI) / 180);
    const [from, to] = ends.map((angle) => `${(CENTRE + RADIUS * Math.cos(angle)).toFixed(2)} ${(CENTRE + RADIUS * Math.sin(angle)).toFixed(2)}`);
    this.arc.setAttribute("d", `M${from}A${RADIUS} ${RADIUS} 0 0 1 ${to}`);
    this.arc.setAttribute("class", shown.red ? "red" : "amber");
  }
}
