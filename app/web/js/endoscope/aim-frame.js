// The square aiming frame of a task in the middle of the picture, and for how long what is aimed at has been held.
import { h, svg } from "../dom.js";
import { FIELD } from "./lens.js";

/** @import { LabelsNowView, TaskNowView } from "../types.js" */

const CENTRE = 50; // of the picture's hundred
const LEAST = 1e-3; // of a turn
const RADIANS = Math.PI / 180;

/**
 * Half the side of the frame, of a picture whose half is 1.
 * @param {number} degrees half its opening
 */
export function frameShare(degrees) {
  return Math.tan(degrees * RADIANS) / Math.tan((FIELD / 2) * RADIANS);
}

/**
 * A part of a circle clockwise from its top, as a path; '' for none.
 * @param {number} radius
 * @param {number} share of the circle
 */
export function heldArc(radius, share) {
  if (!(share > LEAST)) return "";
  const turn = 2 * Math.PI * Math.min(share, 1 - LEAST);
  const end = `${(CENTRE + radius * Math.sin(turn)).toFixed(2)} ${(CENTRE - radius * Math.cos(turn)).toFixed(2)}`;
  return `M${CENTRE} ${(CENTRE - radius).toFixed(2)}A${radius} ${radius} 0 ${turn > Math.PI ? 1 : 0} 1 ${end}`;
}

export class AimFrame {
  constructor() {
    this.frame = svg("rect", { fill: "none", "stroke-width": "0.5" });
    this.held = svg("path", { fill: "none", "stroke-width": "1.2", "stroke-linecap": "round", class: "held", id: "task-held" });
    this.element = h("div", { class: "scope-arc scope-aim", id: "aim-frame", hidden: true }, svg("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, this.frame, this.held));
  }

  /** @param {TaskNowView | null | undefined} now */
  show(now) {
    const shown = now && !now.completed;
    this.element.hidden = !shown;
    if (!shown) return;
    const half = CENTRE * frameShare(now.frame_deg);
    for (const [name, value] of Object.entries({ x: CENTRE - half, y: CENTRE - half, width: 2 * half, height: 2 * half })) this.frame.setAttribute(name, value.toFixed(2));
    this.element.dataset.viewed = String(now.viewed);
    this.held.setAttribute("d", heldArc(half, now.held_s / now.hold_s)); // it touches the frame: within it a view is good enough
  }
}

/** The marker in the middle of the picture: hollow beside a label, whole on one, red while the tool cuts. */
export class AimMarker {
  constructor() {
    const cross = `M${CENTRE - 5} ${CENTRE}H${CENTRE - 2}M${CENTRE + 2} ${CENTRE}H${CENTRE + 5}M${CENTRE} ${CENTRE - 5}V${CENTRE - 2}M${CENTRE} ${CENTRE + 2}V${CENTRE + 5}`;
    const point = svg("circle", { cx: CENTRE, cy: CENTRE, r: "0.8" });
    this.element = h("div", { class: "scope-arc scope-marker", id: "aim-marker", hidden: true },
      svg("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, svg("path", { d: cross, fill: "none", "stroke-width": "0.6" }), point));
  }

  /** @param {LabelsNowView | null | undefined} now */
  show(now) {
    this.element.hidden = !now || now.completed;
    this.element.dataset.on = now?.cutting ? "cut" : now?.aimed ? "label" : "";
  }
}
