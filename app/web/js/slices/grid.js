// The grid of a CT volume: from LPS millimetres to voxel indices and back. A whole index is a voxel's centre.

/** @typedef {[number, number, number]} Triple */
/** @typedef {{ shape: Triple, transform_index_to_lps: number[][] }} GridWords as REST tells it; shape: voxels along i, j, k */

export class Grid {
  /** @param {GridWords} words */
  constructor({ shape, transform_index_to_lps: affine }) {
    this.shape = shape;
    this.affine = affine;
    this.toIndex = inverse(affine);
    this.origin = /** @type {Triple} */ ([affine[0][3], affine[1][3], affine[2][3]]);
  }

  /**
   * The index, fractions and all, of a place in LPS mm.
   * @param {Triple} place
   * @returns {Triple}
   */
  index(place) {
    return this.step([place[0] - this.origin[0], place[1] - this.origin[1], place[2] - this.origin[2]]);
  }

  /**
   * A way in mm as a way in voxels.
   * @param {Triple} way
   * @returns {Triple}
   */
  step(way) {
    return /** @type {Triple} */ (this.toIndex.map((row) => row[0] * way[0] + row[1] * way[1] + row[2] * way[2]));
  }
}

/**
 * The inverse of the upper left 3×3 part of a matrix.
 * @param {number[][]} matrix
 * @returns {[Triple, Triple, Triple]}
 */
export function inverse([[a, b, c], [d, e, f], [g, h, i]]) {
  const det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  return [
    [(e * i - f * h) / det, (c * h - b * i) / det, (b * f - c * e) / det],
    [(f * g - d * i) / det, (a * i - c * g) / det, (c * d - a * f) / det],
    [(d * h - e * g) / det, (b * g - a * h) / det, (a * e - b * d) / det],
  ];
}
