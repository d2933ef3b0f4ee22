// Which label is painted on, and with what brush: chosen in the panel, used in the slices.

/** @typedef {{ id: string, caseId: string, colour: string, volume: string, revision: number, locked: boolean }} BrushLabel */

/** Says `change`; the page has one. */
export class PaintBrush extends EventTarget {
  constructor() {
    super();
    /** @type {BrushLabel | null} the label that the slices show; null: none */
    this.label = null;
    this.held = false; // a press in a slice paints
    /** @type {"paint" | "erase"} */
    this.mode = "paint";
    /** @type {"disc" | "ball"} */
    this.brush = "disc";
    this.radius = 2; // mm
  }

  /** @param {Partial<Pick<PaintBrush, "label" | "held" | "mode" | "brush" | "radius">>} values */
  set(values) {
    const before = JSON.stringify(this.values);
    Object.assign(this, values);
    if (!this.label || this.label.locked) this.held = false;
    if (JSON.stringify(this.values) !== before) this.dispatchEvent(new Event("change"));
  }

  get values() {
    const { label, held, mode, brush, radius } = this;
    return { label, held, mode, brush, radius };
  }
}

export const paintBrush = new PaintBrush();
