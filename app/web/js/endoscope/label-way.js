// Where the next label is while none is in the picture: an arrow on its rim, at the side to which the camera is to be turned.
import { h, svg } from "../dom.js";
import { dot, minus } from "../slices/vectors.js";
import { FIELD, NEAR } from "./lens.js";
import { HALF_MM } from "./task-labels.js";

/** @import { Lens } from "./lens.js" */
/** @import { TaskLabelView } from "../types.js" */

const CENTRE = 50; // of the picture's hundred
const [TIP, BACK, HALF] = [42.5, 38.5, 2.4]; // of the arrow: its ends from the centre, and half its width
const WORDS = 36.5; // from the centre, to where they end
const ASIDE = 0.4; // more to a side than that, they end beside the arrow, not below or above it
const RIM = Math.tan((FIELD / 2) * (Math.PI / 180));

/** number: of the label, from 1. right, down: unit, in the picture. behind: more than a right angle off. @typedef {{ number: number, right: number, down: number, behind: boolean }} LabelWay */

/**
 * The way to the first label that is left; null where the middle of any of them is in the picture, or none is left.
 * @param {Pick<Lens, "eye" | "right" | "above" | "ahead">} lens
 * @param {TaskLabelView[]} labels
 * @returns {LabelWay | null}
 */
export function wayTo({ eye, right, above, ahead }, labels) {
  const left = labels.flatMap(({ centre, end_mm: end }, index) => {
    const off = minus(centre, eye);
    return end < HALF_MM ? [{ number: index + 1, x: dot(off, right), y: -dot(off, above), z: dot(off, ahead) }] : [];
  });
  if (!left.length || left.some(({ x, y, z }) => z > NEAR && Math.hypot(x, y) < RIM * z)) return null;
  const [{ number, x, y, z }] = left, aside = Math.hypot(x, y);
  return aside > 0 ? { number, right: x / aside, down: y / aside, behind: z < 0 } : { number, right: 0, down: -1, behind: true }; // straight behind: any side
}

export class LabelPointer {
  constructor() {
    this.arrow = svg("path", {});
    this.words = svg("text", { "dominant-baseline": "central" });
    this.element = h("div", { class: "scope-arc scope-way", id: "label-way", hidden: true }, svg("svg", { viewBox: "0 0 100 100" }, this.arrow, this.words));
  }

  /** @param {LabelWay | null} way */
  show(way) {
    this.element.hidden = way === null;
    if (!way) return;
    const { number, right, down, behind } = way;
    const at = (/** @type {number} */ out, /** @type {number} */ aside) => `${(CENTRE + out * right - aside * down).toFixed(1)} ${(CENTRE + out * down + aside * right).toFixed(1)}`;
    this.arrow.setAttribute("d", `M${at(TIP, 0)}L${at(BACK, HALF)}L${at(BACK, -HALF)}Z`);
    this.words.setAttribute("text-anchor", right > ASIDE ? "end" : right < -ASIDE ? "start" : "middle");
    this.words.setAttribute("x", (CENTRE + WORDS * right).toFixed(1));
    this.words.setAttribute("y", (CENTRE + WORDS * down).toFixed(1));
    this.words.textContent = `Label ${number}${behind ? ", behind" : ""}`;
  }
}
