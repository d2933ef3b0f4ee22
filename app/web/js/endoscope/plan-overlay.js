// The plan laid over the picture: the path as a ribbon, targets as rings. What tissue hides is drawn again, faint.
import { NEAR } from "./lens.js";
import { arrayOf, programOf } from "./programs.js";
import { INK_FRAGMENT, LINE_VERTEX, RING_FRAGMENT, RING_VERTEX } from "./shaders.js";
/** @import { Lens } from "./lens.js" */
/** @import { Triple } from "../slices/grid.js" */

const PATH_PX = 2.5; // widths and sizes in a picture of USUAL_PX
const RING_PX = 16;
const USUAL_PX = 400;
const [HIDDEN, SEEN] = [0.3, 0.95];
/** @type {Triple} */
const PATH_INK = [0.43, 0.7, 0.95]; // as in scene and slices
/** @type {Triple} */
const TARGET_INK = [0.9, 0.56, 0.82];

export class PlanOverlay {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.line = programOf(gl, LINE_VERTEX, INK_FRAGMENT);
    this.ring = programOf(gl, RING_VERTEX, RING_FRAGMENT);
    /** @type {(ReturnType<typeof arrayOf> & { count: number }) | null} */
    this.path = null;
    /** @type {(ReturnType<typeof arrayOf> & { count: number }) | null} */
    this.targets = null;
  }

  /**
   * @param {Triple[]} path places along it
   * @param {Triple[]} targets
   */
  set(path, targets) {
    const { gl } = this;
    this.path?.remove();
    this.targets?.remove();
    const { vertices, corners } = ribbons(path);
    this.path = corners.length ? { ...arrayOf(gl, vertices, [[3, gl.FLOAT, false, 28, 0], [3, gl.FLOAT, false, 28, 12], [1, gl.FLOAT, false, 28, 24]], corners), count: corners.length } : null;
    this.targets = targets.length ? { ...arrayOf(gl, new Float32Array(targets.flat()), [[3, gl.FLOAT, false, 12, 0]]), count: targets.length } : null;
  }

  /**
   * @param {Lens} lens
   * @param {number} size of the picture, px
   */
  draw(lens, size) {
    const { gl, line, ring, path, targets } = this;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    const larger = Math.max(1, size / USUAL_PX);
    if (path) {
      gl.useProgram(line.program);
      gl.uniformMatrix4fv(line.at("toClip"), false, lens.toClip);
      gl.uniform1f(line.at("width"), (PATH_PX * larger) / size);
      gl.uniform1f(line.at("near"), NEAR);
      gl.bindVertexArray(path.array);
      this.twice(line.at("ink"), PATH_INK, () => gl.drawElements(gl.TRIANGLES, path.count, gl.UNSIGNED_INT, 0));
    }
    if (targets) {
      gl.useProgram(ring.program);
      gl.uniformMatrix4fv(ring.at("toClip"), false, lens.toClip);
      gl.uniform1f(ring.at("size"), RING_PX * larger);
      gl.bindVertexArray(targets.array);
      this.twice(ring.at("ink"), TARGET_INK, () => gl.drawArrays(gl.POINTS, 0, targets.count));
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /**
   * @param {WebGLUniformLocation | null} ink
   * @param {Triple} colour
   * @param {() => void} draw
   */
  twice(ink, colour, draw) {
    const { gl } = this;
    for (const [test, opacity] of [[gl.GREATER, HIDDEN], [gl.LEQUAL, SEEN]]) {
      gl.depthFunc(test);
      gl.uniform4f(ink, ...colour, opacity);
      draw();
    }
  }
}

/**
 * Each piece of a line as two triangles: for each corner its end of the piece, the other end, and the side.
 * @param {Triple[]} places
 */
export function ribbons(places) {
  /** @type {number[]} */
  const vertices = [];
  /** @type {number[]} */
  const corners = [];
  for (let i = 0; i + 1 < places.length; i++) {
    const [a, b] = [places[i], places[i + 1]];
    vertices.push(...a, ...b, 1, ...a, ...b, -1, ...b, ...a, -1, ...b, ...a, 1);
    corners.push(...[0, 1, 2, 2, 1, 3].map((corner) => 4 * i + corner));
  }
  return { vertices: new Float32Array(vertices), corners: new Uint32Array(corners) };
}
