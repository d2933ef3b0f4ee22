// What a threshold would take in, tinted in the slices while it is being chosen.

/** @typedef {{ low: number, high: number }} ThresholdRange HU, both ends included */
/** @typedef {{ caseId: string, key: string, runs: Uint32Array, step: number }} KeptVoxels of the widest volume, on every step-th voxel; key: of the request */

/** Says `change`; the page has one. */
export class ThresholdPreview extends EventTarget {
  constructor() {
    super();
    /** @type {ThresholdRange | null} */
    this.value = null;
    /** @type {KeptVoxels | null} what of it is kept; null: all */
    this.kept = null;
  }

  /** @param {ThresholdRange | null} value null: nothing is tinted */
  set(value) {
    this.value = value;
    this.dispatchEvent(new Event("change"));
  }

  /** @param {KeptVoxels | null} kept */
  keep(kept) {
    if (kept === this.kept) return;
    this.kept = kept;
    this.dispatchEvent(new Event("kept"));
  }
}

export const thresholdPreview = new ThresholdPreview();
