// What the panel of the Register step says of points, errors and orders; nothing here touches the page.

/** @import { ErrorRow, FitView, OrdersView, PairEntry } from "/static/js/types.js" */

const LEAST_SCALE_MM = 1; // a full bar: residuals below it do not look large
/** @type {Record<PairEntry["measured_from"], string>} */
const SOURCES = { typed: "typed", file: "from a table", simulated: "simulated touch", tracker: "from the tracker" };

/**
 * What is known of a point, in a few words.
 * @param {PairEntry} pair
 */
export function pairWords(pair) {
  if (!pair.in_image) return "measured, not in the image yet";
  if (!pair.measured) return "not measured yet";
  return pair.enabled ? SOURCES[pair.measured_from] : `${SOURCES[pair.measured_from]}, left out`;
}

/**
 * The residual that fills a bar, in mm.
 * @param {PairEntry[]} pairs
 */
export function barScale(pairs) {
  return Math.max(LEAST_SCALE_MM, ...pairs.map((pair) => pair.residual_mm ?? 0));
}

/**
 * How much of a bar a residual fills, from 0 to 1.
 * @param {number | null} residual
 * @param {number} scale
 */
export function barShare(residual, scale) {
  return residual === null ? 0 : Math.min(Math.max(residual / scale, 0), 1);
}

/**
 * Three numbers out of three fields; null where one of them is none. All empty is no place.
 * @param {string[]} texts
 * @returns {{ place: [number, number, number] | null, complete: boolean }}
 */
export function threeNumbers(texts) {
  const values = texts.map((text) => (text.trim() === "" ? NaN : Number(text.replace(",", "."))));
  const [x, y, z] = values;
  if (values.every(Number.isFinite)) return { place: [x, y, z], complete: true };
  return { place: null, complete: texts.every((text) => text.trim() === "") };
}

/**
 * Where the error of a row is expected.
 * @param {ErrorRow} row
 */
export function rowWords(row) {
  if (row.s_mm === null) return row.label || "Target";
  return `Worst along the path, at ${row.s_mm.toFixed(0)} mm`;
}

/**
 * How exactly one point was measured, and who says so.
 * @param {FitView} fit
 */
export function fleWords(fit) {
  if (fit.fle_mm === null) return "not known yet";
  const figure = `${fit.fle_mm.toFixed(2)} mm`;
  return fit.fle_source === "stated" ? `${figure}, as stated` : `${figure}, estimated from the fit of ${fit.used} points`;
}

/**
 * An order in words: the points of the image, and whose measured point each gets; those that stay are left out.
 * @param {OrdersView} orders
 * @param {number} index of the candidate
 */
export function orderWords(orders, index) {
  const { labels } = orders.candidates[index];
  const moved = orders.pairs.map((label, at) => [label, labels[at]]).filter(([label, other]) => label !== other);
  if (!moved.length) return "As they are now";
  return moved.map(([label, other]) => `${label} ← ${other}`).join(", ");
}
