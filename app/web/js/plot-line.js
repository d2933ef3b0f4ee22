// Plots by uPlot in the page's colours.
import uPlot from "/static/lib/uplot/dist/uPlot.esm.js";
import { h } from "./dom.js";
import { fixed } from "./format.js";

/** @import { AlignedData, Axis, Options, Series } from "/static/lib/uplot/dist/uPlot.esm.js" */

/** @typedef {{ name: string, colour: string, width?: number, dash?: number[], points?: boolean, caution?: string }} Line colour: of the page, such as '--accent'. caution: about what it is of */

const FONT = "11px system-ui, sans-serif";

/**
 * A colour of the page's theme as it is now.
 * @param {string} name
 */
export function themed(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/**
 * Options that all plots share: axes in the page's colours, a thin cursor, no legend of uPlot's own.
 * @param {{ width: number, height: number, lines: Line[], x: (value: number) => string, unit: string, digits?: number, least?: number | null }} what
 *   x: words of a value of the x axis. least: lower end of the y axis, null for that of the data
 * @returns {Options}
 */
export function plotOptions({ width, height, lines, x, unit, digits = 1, least = 0 }) {
  const faint = () => themed("--text-faint"), grid = { stroke: () => themed("--line"), width: 1 };
  /** @type {Axis} */
  const common = { stroke: faint, grid, ticks: { show: false }, font: FONT };
  return {
    width, height,
    padding: [6, 18, 0, 0],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { size: 6 } },
    scales: { x: { time: false }, y: { range: (...[, low, high]) => rangeOf(least ?? low, high) } },
    axes: [
      { ...common, size: 22, values: (...[, values]) => values.map((value) => x(value)) },
      { ...common, size: 46 + 7 * Math.max(digits - 3, 0), values: (...[, values, , , step]) => values.map((value) => fixed(value, Math.max(digits, Math.min(3, Math.ceil(-Math.log10(step)))))), label: unit, labelSize: 14, labelFont: FONT, labelGap: 0 },
    ],
    series: [{}, ...lines.map((line) => seriesOf(line))],
  };
}

/**
 * Decimals by which the ticks of an axis that goes to a value differ.
 * @param {number} most
 */
export function digitsOf(most) {
  return Math.min(Math.max(Math.ceil(1 - Math.log10(most || 1)), 1), 6);
}

/** @param {Line} line @returns {Series} */
function seriesOf({ name, colour, width = 1.5, dash, points = false }) {
  const stroke = () => (colour.startsWith("--") ? themed(colour) : colour);
  return { label: name, stroke, width, ...(dash ? { dash } : {}), points: { show: points, size: 6, fill: stroke }, spanGaps: false };
}

/**
 * @param {number | null} low
 * @param {number | null} high
 * @returns {[number, number]}
 */
function rangeOf(low, high) {
  const from = low ?? 0, to = high ?? 1;
  return to > from ? [Math.min(from, low ?? from), to + 0.06 * (to - from)] : [from, from + 1];
}

/**
 * @param {Options} options
 * @param {AlignedData} data
 * @param {HTMLElement} root
 */
export function plotInto(options, data, root) {
  return new uPlot(options, data, root);
}

/** The name of a line with its colour. @param {Line} line */
export function plotKey({ name, colour, dash, caution }) {
  const swatch = h("i", { class: dash ? "dashed" : "" });
  swatch.style.borderTopColor = `var(${colour})`;
  return h("span", { class: caution ? "uncertified" : "", title: [name, caution].filter(Boolean).join(", ") }, swatch, name);
}
