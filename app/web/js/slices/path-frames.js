// The path by its arc length, with frames across it that do not spin.
import { cross, dot, length, minus, plus, unit } from "./vectors.js";
/** @import { Triple } from "./grid.js" */
/** @import { Axes } from "./port.js" */

/** @typedef {{ s: number, place: Triple, axes: Axes }} Frame s: arc length, mm; n of the axes is along the path */

const FINE = 4; // places between two of the curve
const UP = /** @type {Triple} */ ([0, 0, 1]);
const UPRIGHT = 0.3; // of what is below in the pictures: less, and the path runs up or down the head
const FRONT = /** @type {Triple} */ ([0, -1, 0]);

export class PathFrames {
  /**
   * @param {Triple[]} curve places along the spline, LPS mm, two or more
   */
  constructor(curve) {
    const places = smooth(distinct(curve));
    let s = 0;
    /** @type {Frame[]} */
    this.frames = [];
    let down = /** @type {Triple} */ ([0, 0, -1]);
    places.forEach((place, at) => {
      if (at) s += length(minus(place, places[at - 1]));
      const n = unit(minus(places[Math.min(at + 1, places.length - 1)], places[Math.max(at - 1, 0)]));
      if (!at) down = first(n);
      down = unit(minus(down, /** @type {Triple} */ (n.map((part) => part * dot(down, n))))); // turned by the least angle
      this.frames.push({ s, place, axes: { u: cross(down, n), v: down, n } });
    });
    upright(this.frames);
    this.length = s;
  }

  /**
   * The frame at an arc length, pulled into the path.
   * @param {number} s mm
   * @returns {Frame}
   */
  at(s) {
    const { frames } = this;
    const wanted = Math.min(this.length, Math.max(0, s));
    let next = frames.findIndex((frame) => frame.s >= wanted);
    if (next <= 0) next = 1;
    const [a, b] = [frames[next - 1], frames[next]];
    const part = (wanted - a.s) / (b.s - a.s);
    const mix = (/** @type {Triple} */ one, /** @type {Triple} */ other) => plus(one, minus(other, one), part);
    const n = unit(mix(a.axes.n, b.axes.n));
    const rough = mix(a.axes.v, b.axes.v);
    const v = unit(plus(rough, n, -dot(rough, n)));
    return { s: wanted, place: mix(a.place, b.place), axes: { u: cross(v, n), v, n } };
  }

  /**
   * The arc length of the place on the path that is nearest to one in the head.
   * @param {Triple} place
   */
  nearest(place) {
    let best = this.frames[0];
    let least = Infinity;
    for (const frame of this.frames) {
      const away = length(minus(frame.place, place));
      if (away < least) [best, least] = [frame, away];
    }
    return best.s;
  }
}

/**
 * Turn all frames by one angle about the path, so that the feet are below in the pictures of the path as a whole.
 * The start alone does not decide it: where a path begins almost upright, a small lean would turn over all pictures.
 * @param {Frame[]} frames which this changes
 */
function upright(frames) {
  const sums = (/** @type {Triple} */ up) => {
    const below = (/** @type {"u" | "v"} */ axis) => -frames.reduce((sum, { axes }) => sum + dot(axes[axis], up), 0);
    return { u: below("u"), v: below("v") };
  };
  const feet = sums(UP);
  const { u: sine, v: cosine } = Math.hypot(feet.u, feet.v) < UPRIGHT * frames.length ? sums(FRONT) : feet;
  const size = Math.hypot(sine, cosine);
  if (size < 1e-9) return;
  for (const frame of frames) {
    const { u, v, n } = frame.axes;
    const turned = unit(/** @type {Triple} */ (v.map((part, axis) => (cosine * part + sine * u[axis]) / size)));
    frame.axes = { u: cross(turned, n), v: turned, n };
  }
}

/**
 * Down in the picture at the path's start, before all are turned: to the feet, or to the back where the path itself runs up or down.
 * @param {Triple} n
 * @returns {Triple}
 */
function first(n) {
  const up = Math.abs(dot(n, UP)) > 0.9 ? FRONT : UP;
  return /** @type {Triple} */ (up.map((part) => -part));
}

/** @param {Triple[]} places */
function distinct(places) {
  const kept = places.filter((place, at) => !at || length(minus(place, places[at - 1])) > 1e-6);
  if (kept.length < 2) throw new Error("A path needs two places that are apart.");
  return kept;
}

/**
 * A Catmull-Rom spline through the places, so that the tangent has no kinks.
 * @param {Triple[]} places
 */
function smooth(places) {
  /** @type {Triple[]} */
  const fine = [];
  for (let at = 1; at < places.length; at += 1) {
    const [b, c] = [places[at - 1], places[at]];
    const a = places[at - 2] ?? plus(b, minus(c, b), -1);
    const d = places[at + 1] ?? plus(c, minus(c, b));
    for (let part = 0; part < FINE; part += 1) {
      const t = part / FINE;
      fine.push(/** @type {Triple} */ (b.map((value, axis) => 0.5 * (2 * value + (c[axis] - a[axis]) * t
        + (2 * a[axis] - 5 * value + 4 * c[axis] - d[axis]) * t ** 2 + (3 * value - a[axis] - 3 * c[axis] + d[axis]) * t ** 3))));
    }
  }
  fine.push(places[places.length - 1]);
  return fine;
}
