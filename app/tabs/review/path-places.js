// Where a tip was beside its path: numbers only, so that they can be checked without a page.

/** @import { SeriesPublic } from "/static/js/types.js" */

/** @typedef {[number, number]} Pair mm */
/** @typedef {{ x: [number, number], y: [number, number] }} Range mm */

const LEAST_HALF_MM = 0.5; // of the close-up: less is within the width of a line
const LEAST_CLOUD_MM = 0.001;
const ROOM = 1.15; // about what is shown

/**
 * The errors across the path of the samples that follow it, within its plane and off it; index: of the sample.
 * @param {SeriesPublic} series
 * @returns {{ index: number, place: Pair }[]}
 */
export function cloudOf({ across_mm: across, phases, phase }) {
  if (!across) return [];
  const following = ["follow", "done"].map((name) => phases.indexOf(name));
  return phase.flatMap((now, index) => {
    const [within, off] = [across[0][index], across[1][index]];
    return following.includes(now) && within !== null && off !== null ? [{ index, place: /** @type {Pair} */ ([within, off]) }] : [];
  });
}

/**
 * A square about no error that holds all of it.
 * @param {Pair[]} places
 * @returns {Range}
 */
export function aboutNone(places) {
  const most = ROOM * Math.max(LEAST_CLOUD_MM, ...places.flat().map((value) => Math.abs(value)));
  return { x: [-most, most], y: [-most, most] };
}

/**
 * What holds all places.
 * @param {Pair[]} places at least one
 * @returns {Range}
 */
export function aboutAll(places) {
  const range = (/** @type {number} */ axis) => {
    const values = places.map((place) => place[axis]);
    const [low, high] = [Math.min(...values), Math.max(...values)], room = ((ROOM - 1) / 2) * Math.max(high - low, 1);
    return /** @type {Pair} */ ([low - room, high + room]);
  };
  return { x: range(0), y: range(1) };
}

/**
 * A window about a place in which the errors of a run can be seen.
 * @param {Pair} middle
 * @param {number} error the largest that is shown
 * @returns {Range}
 */
export function closeUp([x, y], error) {
  const half = Math.max(LEAST_HALF_MM, ROOM * error);
  return { x: [x - half, x + half], y: [y - half, y + half] };
}

/**
 * A range with the shape of a picture, so that a millimetre has one length in it; nothing of it is left out.
 * @param {Range} range
 * @param {number} shape width by height
 * @returns {Range}
 */
export function shaped({ x, y }, shape) {
  const [wide, high] = [x[1] - x[0], y[1] - y[0]];
  const grown = (/** @type {Pair} */ [low, top], /** @type {number} */ size) => /** @type {Pair} */ ([(low + top - size) / 2, (low + top + size) / 2]);
  return wide < high * shape ? { x: grown(x, high * shape), y } : { x, y: grown(y, wide / shape) };
}

/**
 * Number of the place nearest to another one; -1 for none.
 * @param {Pair[]} places
 * @param {Pair} to
 */
export function nearestPlace(places, to) {
  let [best, found] = [Infinity, -1];
  places.forEach(([x, y], index) => {
    const apart = (x - to[0]) ** 2 + (y - to[1]) ** 2;
    if (apart < best) [best, found] = [apart, index];
  });
  return found;
}

/**
 * Digits of the values of an axis, by how much of it is shown.
 * @param {Pair} range
 */
export function digitsOf([low, high]) {
  return Math.min(Math.max(Math.ceil(-Math.log10((high - low) / 4)), 0), 5);
}
