// Labels of a task in the picture: flat discs with an arrow, and the object on it that is being shortened.
import { arrayOf, programOf } from "./programs.js";
import { FLAT_FRAGMENT, FLAT_VERTEX } from "./shaders.js";
/** @import { Lens } from "./lens.js" */
/** @import { TaskLabelView } from "../types.js" */
/** @import { Triple } from "../slices/grid.js" */

export const RADIUS_MM = 16.5, HALF_MM = 10; // of a label, and of its arrow
const AROUND = 48; // pieces of a disc
const RIM_MM = 0.8; // width
const [SHAFT_MM, HEAD_MM, OBJECT_MM] = [0.35, 2.2, 0.9]; // half widths, and the length of the head
/** Towards the camera, so that what lies on a label is drawn before it. @type {[number, number]} */
const LIFTED_MM = [0.3, 0.6];
/** Paper, the same of a label that is done, its dark rim, ink, and the object: none is the page's blue, and all are read on tissue. @type {Record<"paper" | "done" | "rim" | "ink" | "object", Triple>} */
export const COLOURS = { paper: [0.97, 0.95, 0.88], done: [0.5, 0.85, 0.62], rim: [0.3, 0.22, 0.24], ink: [0.12, 0.1, 0.14], object: [1, 0.8, 0.1] };
const FLOATS = 9; // place, normal, colour

/**
 * All labels as triangles: for each corner its place, the label's normal, and a colour.
 * @param {TaskLabelView[]} labels
 */
export function labelTriangles(labels) {
  /** @type {number[]} */
  const corners = [];
  for (const label of labels) {
    const across = cross(label.normal, label.along), done = label.end_mm >= HALF_MM;
    const at = (/** @type {[number, number]} */ [u, v], lift = 0) => /** @type {Triple} */ (label.centre.map((x, k) => x + u * label.along[k] + v * across[k] + lift * label.normal[k]));
    const add = (/** @type {[number, number][]} */ places, /** @type {Triple} */ colour, /** @type {number} */ lift) => places.forEach((place) => corners.push(...at(place, lift), ...label.normal, ...colour));
    const box = (/** @type {number} */ from, /** @type {number} */ to, /** @type {number} */ half, /** @type {Triple} */ colour, /** @type {number} */ lift) =>
      add([[from, -half], [to, -half], [to, half], [from, -half], [to, half], [from, half]], colour, lift);
    for (let i = 0; i < AROUND; i++) {
      const rim = (/** @type {number} */ k) => /** @type {[number, number]} */ ([RADIUS_MM * Math.cos((2 * Math.PI * k) / AROUND), RADIUS_MM * Math.sin((2 * Math.PI * k) / AROUND)]);
      add([[0, 0], rim(i), rim(i + 1)], done ? COLOURS.done : COLOURS.paper, 0);
      const inner = (/** @type {number} */ k) => /** @type {[number, number]} */ (rim(k).map((x) => x * (1 - RIM_MM / RADIUS_MM)));
      add([inner(i), rim(i), rim(i + 1), inner(i), rim(i + 1), inner(i + 1)], COLOURS.rim, LIFTED_MM[0] / 2);
    }
    box(-HALF_MM, HALF_MM - HEAD_MM, SHAFT_MM, COLOURS.ink, LIFTED_MM[0]);
    add([[HALF_MM - HEAD_MM, -0.7 * HEAD_MM], [HALF_MM, 0], [HALF_MM - HEAD_MM, 0.7 * HEAD_MM]], COLOURS.ink, LIFTED_MM[0]);
    if (!done) box(label.end_mm, HALF_MM, OBJECT_MM, COLOURS.object, LIFTED_MM[1]);
  }
  return new Float32Array(corners);
}

/**
 * @param {readonly number[]} a
 * @param {readonly number[]} b
 * @returns {Triple}
 */
function cross([a, b, c], [x, y, z]) {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

export class TaskLabels {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    /** @type {ReturnType<typeof programOf> | null} */
    this.program = null;
    /** @type {(ReturnType<typeof arrayOf> & { count: number }) | null} */
    this.array = null;
  }

  /** @param {TaskLabelView[]} labels */
  set(labels) {
    this.array?.remove();
    const corners = labelTriangles(labels), { FLOAT } = this.gl;
    const layout = [0, 12, 24].map((offset) => /** @type {[number, number, boolean, number, number]} */ ([3, FLOAT, false, 4 * FLOATS, offset]));
    this.array = labels.length ? { ...arrayOf(this.gl, corners, layout), count: corners.length / FLOATS } : null;
  }

  /** @param {Lens} lens */
  draw(lens) {
    const { gl, array } = this;
    if (!array) return;
    const { program, at } = this.program ??= programOf(gl, FLAT_VERTEX, FLAT_FRAGMENT);
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("toClip"), false, lens.toClip);
    gl.uniform3f(at("eye"), ...lens.eye);
    gl.bindVertexArray(array.array);
    gl.drawArrays(gl.TRIANGLES, 0, array.count);
  }
}
