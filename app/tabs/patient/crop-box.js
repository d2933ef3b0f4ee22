// A box between two opposite corners, typed as places are everywhere on the page; it begins around the crosshair.
import { note } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { placeOf, placeWords } from "/static/js/slices/place-words.js";

/** @typedef {[number, number, number]} Place LPS mm */

const BEGIN_MM = 20; // from the crosshair to each side of a new box

export class CropBox {
  /** @param {() => void} changed */
  constructor(changed) {
    this.changed = changed;
    /** @type {number[] | null} where the crosshair stands, LPS mm */
    this.cross = null;
    /** @type {Place[] | null} two opposite corners; null until the first box */
    this.corners = null;
    this.check = h("input", { type: "checkbox", id: "segment-crop", onchange: () => this.switched() });
    this.inputs = ["One corner", "The opposite corner"].map((words, index) => h("input", {
      type: "text", id: `segment-corner-${index + 1}`, "aria-label": `${words} of the box, such as R 24.5 A 10 S 3`,
      onchange: () => this.typed(index),
    }));
    this.fields = h("div", { class: "segment-corners", hidden: true }, this.inputs);
    this.label = h("label", { class: "check" }, this.check, "Crop to box");
  }

  /** Lower and upper corner in LPS mm; null while nothing is cropped. */
  get box() {
    if (!this.check.checked || !this.corners) return null;
    const [one, other] = this.corners;
    return [Math.min, Math.max].map((pick) => one.map((value, axis) => pick(value, other[axis])));
  }

  switched() {
    const { cross } = this;
    if (this.check.checked && !this.corners) {
      const middle = cross ?? [0, 0, 0];
      this.corners = [-BEGIN_MM, BEGIN_MM].map((by) => /** @type {Place} */ (middle.map((value) => Math.round(value + by))));
      this.show();
    }
    this.fields.hidden = !this.check.checked;
    this.changed();
  }

  show() {
    this.inputs.forEach((input, index) => {
      input.value = placeWords(this.corners?.[index] ?? [0, 0, 0]);
      input.removeAttribute("aria-invalid");
    });
  }

  /** @param {number} index of the corner */
  typed(index) {
    if (!this.corners) return;
    try {
      this.corners[index] = placeOf(this.inputs[index].value);
    } catch (error) {
      this.inputs[index].setAttribute("aria-invalid", "true");
      note(/** @type {Error} */ (error).message, { error: true });
      return;
    }
    this.show();
    this.changed();
  }
}
