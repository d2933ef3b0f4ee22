// Balls on the wall of the picture, lit from the lens as the wall is: the polyps of a task.
import { arrayOf, programOf } from "./programs.js";
import { BALL_FRAGMENT, BALL_VERTEX } from "./shaders.js";
/** @import { Lens } from "./lens.js" */
/** @import { Triple } from "../slices/grid.js" */

/** colour: red, green and blue, from 0 to 1. @typedef {{ at: Triple, radius: number, colour: Triple }} Bump */

const [AROUND, UP] = [24, 12]; // pieces of a ball
/** Colours of a polyp that is not in view, half way, and at the best place: a straight mix of the ends would be grey. @type {[Triple, Triple, Triple]} */
const MARKER = [[0.13, 0.3, 1], [0.2, 0.85, 0.6], [1, 0.93, 0.16]];

/**
 * @param {number} share 0: blue, 1: bright yellow
 * @returns {Triple}
 */
export function markerColour(share) {
  const half = share < 0.5 ? 0 : 1, [from, to] = [MARKER[half], MARKER[half + 1]];
  const mixed = from.map((value, index) => value + (2 * share - half) * (to[index] - value));
  return [mixed[0], mixed[1], mixed[2]];
}

export class Bumps {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    /** @type {Bump[]} */
    this.all = [];
    /** @type {{ program: ReturnType<typeof programOf>, ball: ReturnType<typeof arrayOf>, count: number } | null} */
    this.made = null;
  }

  /** @param {Lens} lens */
  draw(lens) {
    if (!this.all.length) return;
    const { gl } = this, { program, ball, count } = this.made ??= make(gl);
    gl.useProgram(program.program);
    gl.uniformMatrix4fv(program.at("toClip"), false, lens.toClip);
    gl.uniform3f(program.at("eye"), ...lens.eye);
    gl.bindVertexArray(ball.array);
    for (const { at, radius, colour } of this.all) {
      gl.uniform4f(program.at("ball"), ...at, radius);
      gl.uniform3f(program.at("colour"), ...colour);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }
  }
}

/** @param {WebGL2RenderingContext} gl */
function make(gl) {
  const { vertices, corners } = unitBall();
  return { program: programOf(gl, BALL_VERTEX, BALL_FRAGMENT), ball: arrayOf(gl, vertices, [[3, gl.FLOAT, false, 12, 0]], corners), count: corners.length };
}

/** A ball of radius 1 as triangles. */
export function unitBall() {
  const vertices = [], corners = [];
  for (let i = 0; i <= UP; i++) {
    for (let j = 0; j <= AROUND; j++) {
      const [polar, turn] = [(Math.PI * i) / UP, (2 * Math.PI * j) / AROUND];
      vertices.push(Math.sin(polar) * Math.cos(turn), Math.sin(polar) * Math.sin(turn), Math.cos(polar));
      if (i === UP || j === AROUND) continue;
      const a = i * (AROUND + 1) + j, b = a + AROUND + 1;
      corners.push(a, b, a + 1, a + 1, b, b + 1);
    }
  }
  return { vertices: new Float32Array(vertices), corners: new Uint32Array(corners) };
}
