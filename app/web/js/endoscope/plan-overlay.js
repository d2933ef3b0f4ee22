// The plan laid over the picture: the path as a ribbon, targets as rings; and what a task has done with, as rings with a
// tick at first. What tissue hides is drawn again, faint.
import { NEAR } from "./lens.js";
import { arrayOf, programOf } from "./programs.js";
import { INK_FRAGMENT, LINE_VERTEX, RING_FRAGMENT, RING_VERTEX, TICK_FRAGMENT } from "./shaders.js";
/** @import { Lens } from "./lens.js" */
/** @import { Program } from "./programs.js" */
/** @import { Triple } from "../slices/grid.js" */

/** @typedef {ReturnType<typeof arrayOf> & { count: number }} Places */

const PATH_PX = 2.5; // widths and sizes in a picture of USUAL_PX
const RING_PX = 16;
const TICK_PX = 44;
const USUAL_PX = 400;
const [HIDDEN, SEEN] = [0.3, 0.95];
/** @type {Triple} */
const PATH_INK = [0.43, 0.7, 0.95]; // as in scene and slices
/** @type {Triple} */
const TARGET_INK = [0.9, 0.56, 0.82];
/** @type {Triple} */
const DONE_INK = [0.33, 0.8, 0.51];
/** @type {Triple} */
const TICK_INK = [0.1, 0.5, 0.27]; // under a white tick, on tissue and on a label

export class PlanOverlay {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.line = programOf(gl, LINE_VERTEX, INK_FRAGMENT);
    this.ring = programOf(gl, RING_VERTEX, RING_FRAGMENT);
    this.tick = programOf(gl, RING_VERTEX, TICK_FRAGMENT);
    /** @type {Places | null} */
    this.path = null;
    /** @type {Places | null} */
    this.targets = null;
    /** @type {Places | null} */
    this.done = null;
    /** @type {Places | null} done just now */
    this.fresh = null;
  }

  /**
   * @param {Triple[]} path places along it
   * @param {Triple[]} targets
   */
  set(path, targets) {
    const { gl } = this;
    this.path?.remove();
    const { vertices, corners } = ribbons(path);
    this.path = corners.length ? { ...arrayOf(gl, vertices, [[3, gl.FLOAT, false, 28, 0], [3, gl.FLOAT, false, 28, 12], [1, gl.FLOAT, false, 28, 24]], corners), count: corners.length } : null;
    this.targets = this.placesOf(targets, this.targets);
  }

  /**
   * @param {Triple[]} done
   * @param {Triple[]} fresh done just now
   */
  setDone(done, fresh) {
    this.done = this.placesOf(done, this.done);
    this.fresh = this.placesOf(fresh, this.fresh);
  }

  /**
   * @param {Triple[]} places
   * @param {Places | null} before that they take the place of
   * @returns {Places | null}
   */
  placesOf(places, before) {
    const { gl } = this;
    before?.remove();
    return places.length ? { ...arrayOf(gl, new Float32Array(places.flat()), [[3, gl.FLOAT, false, 12, 0]]), count: places.length } : null;
  }

  /**
   * @param {Lens} lens
   * @param {number} size of the picture, px
   */
  draw(lens, size) {
    const { gl, line, path } = this;
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
    this.points(this.ring, this.targets, RING_PX * larger, TARGET_INK, lens);
    this.points(this.ring, this.done, RING_PX * larger, DONE_INK, lens);
    this.points(this.tick, this.fresh, TICK_PX * larger, TICK_INK, lens);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /**
   * @param {Program} program
   * @param {Places | null} places
   * @param {number} size px
   * @param {Triple} ink
   * @param {Lens} lens
   */
  points({ program, at }, places, size, ink, lens) {
    if (!places) return;
    const { gl } = this;
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("toClip"), false, lens.toClip);
    gl.uniform1f(at("size"), size);
    gl.bindVertexArray(places.array);
    const draw = () => gl.drawArrays(gl.POINTS, 0, places.count);
    if (program === this.tick.program) { // over all: a label leans, and would hide half of it
      gl.depthFunc(gl.ALWAYS);
      gl.uniform4f(at("ink"), ...ink, SEEN);
      draw();
    } else this.twice(at("ink"), ink, draw);
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
