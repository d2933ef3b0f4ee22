// A tool as a small picture, to scale: the end of its shaft with its bend, and what an endoscope sees.
import { html, nothing, svg } from "/static/js/template.js";

/** @import { ToolPublic } from "/static/js/types.js" */

const [LEFT, TOP, WIDTH, HEIGHT] = [-40, -8, 50, 16]; // mm about the tip
const [REACH, HALF_ANGLE] = [8, Math.PI / 6]; // of the drawn view

/** @param {Pick<ToolPublic, "parts" | "view">} tool */
export function toolPicture({ parts, view }) {
  const lines = parts.map(({ start, end, radius }) => svg`<line class="tool" x1=${start[0]} y1=${-start[1]} x2=${end[0]} y2=${-end[1]} stroke-width=${2 * radius} stroke-linecap="round"></line>`);
  const middle = (Math.min(...parts.map(lowest)) + Math.max(...parts.map(highest))) / 2;
  return html`<svg class="tool-picture" viewBox="${LEFT} ${TOP + middle} ${WIDTH} ${HEIGHT}" aria-hidden="true">${view ? svg`<path class="tool-view" d=${sector(view)}></path>` : nothing}${lines}</svg>`;
}

/** @param {ToolPublic["parts"][number]} part */
const lowest = ({ start, end }) => Math.min(-start[1], -end[1]);

/** @param {ToolPublic["parts"][number]} part */
const highest = ({ start, end }) => Math.max(-start[1], -end[1]);

/**
 * What is seen from the tip, as the data of an SVG path.
 * @param {[number, number]} view
 */
function sector([along, across]) {
  const middle = Math.atan2(-across, along);
  const [from, to] = [middle - HALF_ANGLE, middle + HALF_ANGLE].map((angle) => `${(REACH * Math.cos(angle)).toFixed(2)} ${(REACH * Math.sin(angle)).toFixed(2)}`);
  return `M0 0L${from}A${REACH} ${REACH} 0 0 1 ${to}Z`;
}
