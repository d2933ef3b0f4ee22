// Distances and angles in LPS mm: voxels that are no cubes would bend both.
import { fixed } from "../format.js";
import { dot, length, minus } from "./vectors.js";
/** @import { Triple } from "./grid.js" */

/** @typedef {"distance" | "angle"} MeasureKind */
/** @typedef {{ kind: MeasureKind, places: Triple[] }} Measure of an angle the second place is its corner */

const KEPT = 6; // measures; a further one takes the place of the oldest
/** @type {Record<MeasureKind, number>} */
const PLACES = { distance: 2, angle: 3 };

/** Says `change`. */
export class Measures extends EventTarget {
  constructor() {
    super();
    /** @type {Measure[]} */
    this.done = [];
    /** @type {Measure | null} the one that is being made */
    this.open = null;
    /** @type {Triple | null} where the pointer is while one is being made */
    this.hover = null;
  }

  /**
   * A place of the measure that is being made, or of a new one.
   * @param {MeasureKind} kind
   * @param {Triple} place
   */
  add(kind, place) {
    if (this.open?.kind !== kind) this.open = { kind, places: [] };
    this.open.places.push(place);
    this.hover = null;
    if (this.open.places.length === PLACES[kind]) {
      this.done = [...this.done, this.open].slice(-KEPT);
      this.open = null;
    }
    this.changed();
  }

  /** @param {Triple | null} place */
  point(place) {
    if (!this.open) return;
    this.hover = place;
    this.changed();
  }

  /** Drop what is being made; returns whether there was something. */
  cancel() {
    if (!this.open) return false;
    this.open = this.hover = null;
    this.changed();
    return true;
  }

  clear() {
    this.done = [];
    this.open = this.hover = null;
    this.changed();
  }

  /**
   * All that is drawn, the one that is being made with the pointer as its next place.
   * @returns {Measure[]}
   */
  get shown() {
    if (!this.open) return this.done;
    return [...this.done, { ...this.open, places: this.hover ? [...this.open.places, this.hover] : this.open.places }];
  }

  changed() {
    this.dispatchEvent(new Event("change"));
  }
}

/**
 * What a measure says: '12.3 mm', of an angle '45.0°', '' while it has too few places.
 * @param {Measure} measure
 */
export function measureWords({ kind, places }) {
  if (kind === "distance") return places.length < 2 ? "" : `${fixed(length(minus(places[0], places[1])), 1)} mm`;
  return places.length < 3 ? "" : `${fixed(angle(places[0], places[1], places[2]), 1)}°`;
}

/**
 * Degrees at a corner between two legs; 0 where a leg has no length.
 * @param {Triple} a
 * @param {Triple} corner
 * @param {Triple} b
 */
export function angle(a, corner, b) {
  const [one, other] = [minus(a, corner), minus(b, corner)];
  const size = length(one) * length(other);
  return size === 0 ? 0 : (Math.acos(Math.min(1, Math.max(-1, dot(one, other) / size))) * 180) / Math.PI;
}
