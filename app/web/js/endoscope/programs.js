// WebGL programs and vertex arrays.

/** @typedef {{ program: WebGLProgram, at: (name: string) => WebGLUniformLocation | null }} Program */

/**
 * Compile and link; throws with the compiler's words.
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex
 * @param {string} fragment
 * @returns {Program}
 */
export function programOf(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]])) {
    const shader = gl.createShader(kind);
    if (!shader) throw failed(gl, program, "The graphics context is lost.");
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader); // once the program is deleted
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw failed(gl, program, gl.getShaderInfoLog(shader) || "A shader cannot be compiled.");
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw failed(gl, program, gl.getProgramInfoLog(program) || "The shaders cannot be linked.");
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const places = new Map();
  return {
    program,
    at(name) {
      if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name));
      return places.get(name) ?? null;
    },
  };
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLProgram} program that is of no use
 * @param {string} words
 */
function failed(gl, program, words) {
  gl.deleteProgram(program);
  return new Error(words);
}

/** Number, WebGL type, whether 1 is the largest integer, bytes to the next, bytes to the first. @typedef {[number, number, boolean, number, number]} Attribute */

/**
 * Vertices and indices on the graphics card.
 * @param {WebGL2RenderingContext} gl
 * @param {ArrayBufferView} vertices
 * @param {Attribute[]} attributes by location
 * @param {Uint32Array} [indices]
 */
export function arrayOf(gl, vertices, attributes, indices) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  const buffers = [gl.createBuffer(), indices ? gl.createBuffer() : null];
  gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
  gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
  attributes.forEach(([count, type, normalised, stride, offset], location) => {
    gl.vertexAttribPointer(location, count, type, normalised, stride, offset);
    gl.enableVertexAttribArray(location);
  });
  if (indices) {
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }
  gl.bindVertexArray(null);
  return {
    array,
    remove() {
      gl.deleteVertexArray(array);
      for (const buffer of buffers) gl.deleteBuffer(buffer);
    },
  };
}
