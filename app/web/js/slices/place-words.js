// Places as a surgeon reads and types them: side and millimetres, 'R 24.5 A 10.0 S 3.2 mm'.
import { fixed } from "../format.js";
/** @import { Triple } from "./grid.js" */

/** The letter of the positive and of the negative side of each LPS axis. */
const SIDES = ["LR", "PA", "SI"];
const TYPED = /([LRPASI])\s*([-−]?\d+(?:[.,]\d+)?)/giu;
const NUMBER = /^[-−]?\d+(?:[.,]\d+)?$/u;

/**
 * One coordinate: 'R 24.5' for L −24.5.
 * @param {number} value mm
 * @param {number} axis 0, 1 or 2 of LPS
 * @param {number} [digits]
 */
export function sideWords(value, axis, digits = 1) {
  const rounded = Number(value.toFixed(digits));
  return `${SIDES[axis][rounded < 0 ? 1 : 0]} ${fixed(Math.abs(rounded), digits)}`;
}

/**
 * @param {ArrayLike<number>} place LPS mm
 * @param {number} [digits]
 */
export function placeWords(place, digits = 1) {
  return `${Array.from(place).map((value, axis) => sideWords(value, axis, digits)).join(" ")} mm`;
}

/**
 * A place and the HU that is drawn there; null: no voxel is there.
 * @param {Triple} place
 * @param {number | null} hu
 * @returns {[string, string]}
 */
export function readingWords(place, hu) {
  return [placeWords(place), hu === null ? "outside the scan" : `${fixed(hu, 0)} HU`];
}

/**
 * The LPS place of typed words: letters with numbers in any order ('R 24.5 A 10 S 3'), or three numbers to the right, to
 * the front and upwards. Throws with words for people where they say no place.
 * @param {string} words
 * @returns {Triple}
 */
export function placeOf(words) {
  const text = words.replace(/mm/giu, " ").trim();
  for (const between of [/[;\s]+/u, /[,;\s]+/u]) { // the first leaves commas to the numbers
    const numbers = text.split(between);
    if (numbers.length !== 3 || !numbers.every((number) => NUMBER.test(number))) continue;
    const [right, front, up] = numbers.map(parsed);
    return [-right || 0, -front || 0, up];
  }
  const found = [...text.matchAll(TYPED)];
  if (text.replace(TYPED, "").replace(/[,;]/gu, " ").trim()) throw new Error(HELP);
  /** @type {(number | undefined)[]} */
  const place = [undefined, undefined, undefined];
  for (const [, letter, number] of found) {
    const axis = SIDES.findIndex((sides) => sides.includes(letter.toUpperCase()));
    if (place[axis] !== undefined) throw new Error(HELP);
    place[axis] = parsed(number) * (SIDES[axis][0] === letter.toUpperCase() ? 1 : -1) || 0;
  }
  if (place.some((value) => value === undefined)) throw new Error(HELP);
  return /** @type {Triple} */ (place);
}

const HELP = "Type a place in mm, as R 24.5 A 10 S 3.";

/** @param {string} number */
function parsed(number) {
  return Number(number.replace("−", "-").replace(",", "."));
}

/**
 * The letter of the side that a direction points to: 'R' for (−1, 0, 0).
 * @param {Triple} direction
 */
export function letterOf(direction) {
  const sizes = direction.map(Math.abs);
  const axis = sizes.indexOf(Math.max(...sizes));
  return SIDES[axis][direction[axis] < 0 ? 1 : 0];
}
