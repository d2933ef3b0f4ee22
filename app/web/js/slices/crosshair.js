// The crosshair of all slices: moved here at once, and sent to the planner, whose 3D view follows.
/** @import { Connection } from "../connection.js" */
/** @import { Triple } from "./grid.js" */
/** @import { SlicesSection } from "../types.js" */

const SAME_MM = 2e-3; // places come back rounded to 0.001 mm
const COLLECT_MS = 50; // requests are collected, so that a wheel cannot flood the planner

/** Says `move` when the place is another one, `elsewhere` when that was not asked for here. */
export class Crosshair extends EventTarget {
  /** @param {Connection} connection */
  constructor(connection) {
    super();
    this.connection = connection;
    /** @type {Triple | null} */
    this.known = null; // the planner's
    /** @type {Triple | null} */
    this.wanted = null; // the newest request, until it is answered
    /** @type {Triple[]} requests that are not answered yet, oldest first */
    this.sent = [];
    /** @type {ReturnType<typeof setTimeout> | null} */
    this.timer = null;
    /** @type {[Triple, Triple]} */
    this.bounds = [[-Infinity, -Infinity, -Infinity], [Infinity, Infinity, Infinity]];
  }

  /** LPS mm; null before the planner has said one. */
  get place() {
    return this.wanted ?? this.known;
  }

  /** @param {SlicesSection} slices */
  heard({ cross, planes }) {
    const { axial, coronal, sagittal } = planes;
    this.bounds = [[sagittal.lo, coronal.lo, axial.lo], [sagittal.hi, coronal.hi, axial.hi]];
    if (this.known && same(cross, this.known, 0)) return;
    this.known = cross;
    const index = this.sent.findIndex((sent) => same(sent, cross, SAME_MM));
    this.sent = index < 0 ? [] : this.sent.slice(index + 1);
    if (!this.sent.length && !this.timer) this.wanted = null;
    this.dispatchEvent(new Event("move"));
    if (index < 0) this.dispatchEvent(new Event("elsewhere"));
  }

  /** @param {Triple} place pulled into the volume */
  move(place) {
    const [low, high] = this.bounds;
    this.wanted = /** @type {Triple} */ (place.map((value, axis) => Math.min(high[axis], Math.max(low[axis], value))));
    this.dispatchEvent(new Event("move"));
    this.timer ??= setTimeout(() => {
      this.timer = null;
      if (!this.connection.connected) this.wanted = null;
      if (!this.wanted) return;
      this.sent.push(this.wanted);
      this.connection.send("slice.cross", { position: this.wanted });
    }, COLLECT_MS);
  }

  /** Another head, or another line: what was asked before is not answered any more. */
  forget() {
    this.sent = [];
    this.wanted = null;
  }
}

/**
 * @param {Triple} a
 * @param {Triple} b
 * @param {number} limit mm
 */
function same(a, b, limit) {
  return a.every((value, axis) => Math.abs(value - b[axis]) <= limit);
}
