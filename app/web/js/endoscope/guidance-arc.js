// The forces on the hand as arcs on the picture's rim, since a hand sees what it cannot feel: guidance outside, at the
// side of the wall that is near; resistance inside it, thinner, at the side to which the hand goes.
import { h, svg } from "../dom.js";

const MEAN_S = 0.03; // over which a force is averaged: it jumps between two steps
export const LEAST_N = 0.2; // less is not shown
export const RED_N = 2;
const HALF_DEG = [10, 45]; // half the arc at the least force, and from RED_N on
const CENTRE = 50;

/**
 * Half the angle of the arc in degrees, and whether it is red; null where there is none.
 * @param {number} force N
 */
export function arcOf(force) {
  if (!(force >= LEAST_N)) return null;
  const share = Math.min(1, (force - LEAST_N) / (RED_N - LEAST_N));
  return { half: HALF_DEG[0] + share * (HALF_DEG[1] - HALF_DEG[0]), red: force >= RED_N };
}

/** A force as its mean. */
export class MeanForce {
  constructor() {
    this.mean = [0, 0]; // N, to the right and down
    this.at = NaN;
  }

  /**
   * @param {number} x N, to the right in the picture
   * @param {number} y N, down
   * @param {number} t s
   */
  push(x, y, t) {
    const passed = t - this.at;
    const share = passed >= 0 ? 1 - Math.exp(-passed / MEAN_S) : 1;
    this.at = t;
    this.mean = [this.mean[0] + share * (x - this.mean[0]), this.mean[1] + share * (y - this.mean[1])];
  }
}

/** The mean of a force on the hand as an arc, opposite to where it leads. */
class ForceArc extends MeanForce {
  /**
   * @param {string} name
   * @param {number} radius of the picture's hundred
   * @param {number} width
   */
  constructor(name, radius, width) {
    super();
    this.radius = radius;
    this.path = svg("path", { fill: "none", "stroke-width": String(width), "stroke-linecap": "round", "data-force": name });
  }

  /**
   * @override
   * @param {number} x
   * @param {number} y
   * @param {number} t
   */
  push(x, y, t) {
    super.push(x, y, t);
    const [right, down] = this.mean, shown = arcOf(Math.hypot(right, down));
    this.path.style.display = shown ? "" : "none";
    if (!shown) return;
    const towards = Math.atan2(-down, -right);
    const ends = [-1, 1].map((side) => towards + (side * shown.half * Math.PI) / 180);
    const [from, to] = ends.map((angle) => `${(CENTRE + this.radius * Math.cos(angle)).toFixed(2)} ${(CENTRE + this.radius * Math.sin(angle)).toFixed(2)}`);
    this.path.setAttribute("d", `M${from}A${this.radius} ${this.radius} 0 0 1 ${to}`);
    this.path.setAttribute("class", shown.red ? "red" : "amber");
  }
}

export class ForceArcs {
  constructor() {
    this.guidance = new ForceArc("guidance", 48.2, 3);
    this.resistance = new ForceArc("resistance", 44.8, 1.2);
    this.element = h("div", { class: "scope-arc", hidden: true }, svg("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, this.guidance.path, this.resistance.path));
  }

  /**
   * @param {[number, number]} guidance N, to the right in the picture and down
   * @param {[number, number]} resistance N
   * @param {number} t s
   */
  push(guidance, resistance, t) {
    this.guidance.push(...guidance, t);
    this.resistance.push(...resistance, t);
  }

  /** Nothing is felt: a drive has ended. */
  clear() {
    this.push([0, 0], [0, 0], NaN);
  }

  /** N, of both together. */
  get force() {
    const [a, b] = [this.guidance.mean, this.resistance.mean];
    return Math.hypot(a[0] + b[0], a[1] + b[1]);
  }
}
