// What a view shows: a plane in the patient and a window onto it, from LPS mm to CSS pixels and back.
import { dot, minus, plus } from "./vectors.js";
/** @import { PlaceNear } from "../near-plane.js" */
/** @import { Raster } from "./cut.js" */
/** @import { Triple } from "./grid.js" */

/** @typedef {{ u: Triple, v: Triple, n: Triple }} Axes unit vectors in LPS: to the right, downwards, and across the plane */
/** @typedef {"axial" | "coronal" | "sagittal"} AxisName */

/** @type {Record<AxisName, Axes>} as a radiologist looks; across the plane is where its position grows */
export const AXES = {
  axial: { u: [1, 0, 0], v: [0, 1, 0], n: [0, 0, 1] },
  coronal: { u: [1, 0, 0], v: [0, 0, -1], n: [0, 1, 0] },
  sagittal: { u: [0, 1, 0], v: [0, 0, -1], n: [1, 0, 0] },
};

/** A value: a port that shows something else is another one. */
export class Port {
  /**
   * @param {Axes} axes
   * @param {Triple} centre LPS mm of the middle of the view
   * @param {number} perPixel mm
   * @param {number} width CSS pixels
   * @param {number} height
   */
  constructor(axes, centre, perPixel, width, height) {
    this.axes = axes;
    this.centre = centre;
    this.perPixel = perPixel;
    this.width = width;
    this.height = height;
  }

  /**
   * The place in the patient of a place in the view, CSS pixels from its upper left corner: a pixel's centre is at .5.
   * @param {number} x
   * @param {number} y
   */
  place(x, y) {
    const { u, v } = this.axes;
    return plus(plus(this.centre, u, (x - this.width / 2) * this.perPixel), v, (y - this.height / 2) * this.perPixel);
  }

  /**
   * Where a place is drawn, CSS pixels, and its signed distance from the plane, mm.
   * @param {Triple} place
   * @returns {PlaceNear}
   */
  project(place) {
    const away = minus(place, this.centre);
    return {
      x: dot(away, this.axes.u) / this.perPixel + this.width / 2,
      y: dot(away, this.axes.v) / this.perPixel + this.height / 2,
      away: dot(away, this.axes.n),
    };
  }

  /**
   * The pixels to cut for this view; density: of the screen, pixels of the picture to one CSS pixel.
   * @param {number} density
   * @returns {Raster}
   */
  raster(density) {
    const [width, height] = [Math.max(1, Math.round(this.width * density)), Math.max(1, Math.round(this.height * density))];
    const [column, row] = [this.width / width, this.height / height]; // CSS pixels to one of the picture
    return {
      width,
      height,
      start: this.place(column / 2, row / 2),
      u: scaled(this.axes.u, column * this.perPixel),
      v: scaled(this.axes.v, row * this.perPixel),
    };
  }
}

/**
 * @param {Triple} a
 * @param {number} s
 * @returns {Triple}
 */
function scaled(a, s) {
  return [a[0] * s, a[1] * s, a[2] * s];
}
