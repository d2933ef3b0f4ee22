// How near the tool of a drive is to bone and each protected structure: a small scale for each, the nearest to its margin first.
import { h } from "./dom.js";
import { fixed } from "./format.js";
import { worstFirst } from "./nearness-order.js";
import { draw, html, repeat } from "./template.js";

/** @import { NearnessView } from "./types.js" */

const FULL_MM = 3; // end of every scale: as far as the clearance to bone is known

export class NearnessGauge {
  constructor() {
    this.element = h("div", { class: "nearness", role: "group", "aria-label": "Clearance of the tool" });
    /** @type {string[]} names, as they are shown */
    this.order = [];
  }

  /** @param {NearnessView[] | undefined} structures */
  update(structures = []) {
    const shown = worstFirst(structures, this.order);
    this.order = shown.map(({ name }) => name);
    this.element.hidden = !shown.length;
    draw(this.element, html`<ul>${repeat(shown, ({ name }) => name, row)}</ul>`);
  }
}

/** @param {NearnessView} structure */
function row({ name, clearance_mm: clearance, margin_mm: margin, at_least: far, level }) {
  return html`<li data-level=${level} data-structure=${name}><span class="nearness-name" title=${name}>${name}</span>
    <span class="nearness-scale" aria-hidden="true" title="Line: margin ${fixed(margin, 2)} mm"><i style="width: ${share(far ? FULL_MM : clearance)}"></i><b style="left: ${share(margin)}"></b></span>
    <span class="number">${far ? "≥ " : ""}${fixed(clearance, far ? 0 : 2)}<span class="unit">mm</span></span></li>`;
}

/** @param {number} mm */
function share(mm) {
  return `${(100 * Math.min(1, Math.max(0, mm / FULL_MM))).toFixed(1)}%`;
}
