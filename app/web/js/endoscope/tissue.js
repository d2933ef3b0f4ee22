// The surface of tissue on the graphics card, and its drawing with one light at the lens.
import { inSight } from "./mesh-file.js";
import { arrayOf, programOf } from "./programs.js";
import { TISSUE_VERTEX } from "./shaders.js";
/** @import { Lens } from "./lens.js" */
/** @import { Look } from "./looks.js" */
/** @import { MeshFile } from "./mesh-file.js" */
/** @import { Program } from "./programs.js" */


export class Tissue {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {MeshFile} file
   */
  constructor(gl, { count, vertices, corners, clusters }) {
    this.gl = gl;
    this.clusters = clusters;
    this.held = arrayOf(gl, vertices, [
      [3, gl.FLOAT, false, 12, 0],
      [3, gl.BYTE, true, 4, 12 * count],
      [4, gl.UNSIGNED_BYTE, true, 4, 16 * count],
    ], corners);
    /** @type {Map<string, Program>} by the text of their fragment shaders */
    this.programs = new Map();
  }

  /**
   * @param {Lens} lens
   * @param {Look} look
   * @param {string} fragment a shader's text
   */
  draw(lens, look, fragment) {
    const { gl } = this;
    const { program, at } = this.program(fragment);
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("toClip"), false, lens.toClip);
    gl.uniform3fv(at("eye"), lens.eye);
    gl.uniform3fv(at("ahead"), lens.ahead);
    gl.uniform3fv(at("lights"), [1, -1].flatMap((side) => lens.eye.map((value, axis) => value + side * look.lights * lens.right[axis])));
    for (const name of /** @type {const} */ (["reach", "near", "exposure", "shine", "fog", "relief"])) gl.uniform1f(at(name), look[name]);
    for (const name of /** @type {const} */ (["wrap", "tint"])) gl.uniform3fv(at(name), look[name]);
    gl.bindVertexArray(this.held.array);
    for (const [first, corners] of inSight(this.clusters, lens)) gl.drawElements(gl.TRIANGLES, corners, gl.UNSIGNED_INT, 4 * first);
  }

  /** @param {string} fragment */
  program(fragment) {
    const made = this.programs.get(fragment) ?? programOf(this.gl, TISSUE_VERTEX, fragment);
    this.programs.set(fragment, made);
    return made;
  }

  remove() {
    this.held.remove();
    for (const { program } of this.programs.values()) this.gl.deleteProgram(program);
  }
}

