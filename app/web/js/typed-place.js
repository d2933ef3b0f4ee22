// A place of three typed numbers: what can be taken, what is missing, and what is wrong; nothing here touches the page.
import { numberOf } from "./fields.js";

const AXES = ["x", "y", "z"];
export const FARTHEST_MM = 10_000; // the planner takes no place farther away

/**
 * What three texts say.
 * place: where all are numbers. wrong: which of them are no numbers that can be taken. words: what is wrong, or which are
 * missing; '' for a place, and where nothing is typed.
 * @typedef {{ place: [number, number, number] | null, wrong: boolean[], missing: boolean[], words: string }} Typed
 */

/**
 * @param {string[]} texts for x, y and z
 * @returns {Typed}
 */
export function readPlace(texts) {
  const missing = texts.map((text) => text.trim() === "");
  const values = texts.map(numberOf);
  const wrong = values.map((value, axis) => !missing[axis] && !(Math.abs(value) <= FARTHEST_MM));
  const [x, y, z] = values;
  const bad = wrong.indexOf(true);
  if (bad >= 0) return { place: null, wrong, missing, words: whyWrong(AXES[bad], texts[bad].trim(), values[bad]) };
  if (!missing.includes(true)) return { place: [x, y, z], wrong, missing, words: "" };
  const gaps = AXES.filter((axis) => missing[AXES.indexOf(axis)]);
  return { place: null, wrong, missing, words: gaps.length === 3 ? "" : `${gaps.join(" and ")} ${gaps.length === 1 ? "is" : "are"} missing.` };
}

/**
 * @param {string} axis
 * @param {string} text
 * @param {number} value
 */
function whyWrong(axis, text, value) {
  const shown = `‘${text.length > 24 ? `${text.slice(0, 24)}…` : text}’`;
  if (Number.isFinite(value)) return `${axis}: ${shown} is too far away; 10000 mm at most.`;
  return `${axis}: ${shown} is no number${/^[-+−]?[\d.,]+\s*(mm|cm|m)$/iu.test(text) ? "; leave the unit out" : ""}.`;
}

/**
 * Three numbers in one text, parted by blanks, tabs, commas or semicolons, as their texts; null where it is something else.
 * @param {string} text
 * @returns {[string, string, string] | null}
 */
export function threeIn(text) {
  for (const between of [/[;\s]+/u, /[,;\s]+/u]) { // the first leaves commas to the numbers
    const [x, y, z, ...more] = text.trim().split(between);
    if (z && !more.length && [x, y, z].every((part) => !part.endsWith(",") && !Number.isNaN(numberOf(part)))) return [x, y, z];
  }
  return null;
}
