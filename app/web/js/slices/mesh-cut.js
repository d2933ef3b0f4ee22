// The cut of a triangle mesh by a plane, as pieces of lines in the picture.
import { dot } from "./vectors.js";
/** @import { Raster } from "./cut.js" */
/** @import { Triple } from "./grid.js" */

const BLOCK = 256; // triangles with one box: neighbours in the file are mostly neighbours in space

/** @typedef {{ vertices: Float32Array, faces: Uint32Array, boxes: Float32Array }} BlockedMesh boxes: low and high corner of each block of triangles, LPS mm */

/**
 * A mesh as `GET /api/v1/cases/{id}/surfaces/{name}?format=arrays` sends it.
 * @param {ArrayBuffer} buffer
 * @returns {BlockedMesh}
 */
export function meshOf(buffer) {
  const [vertexCount, faceCount] = new Uint32Array(buffer, 0, 2);
  const vertices = new Float32Array(buffer, 8, vertexCount * 3);
  const faces = new Uint32Array(buffer, 8 + vertices.byteLength, faceCount * 3);
  const blocks = Math.ceil(faces.length / 3 / BLOCK);
  const boxes = new Float32Array(blocks * 6);
  for (let block = 0; block < blocks; block += 1) {
    const box = boxes.subarray(block * 6, block * 6 + 6).fill(Infinity, 0, 3).fill(-Infinity, 3, 6);
    const end = Math.min(faces.length, (block + 1) * BLOCK * 3);
    for (let corner = block * BLOCK * 3; corner < end; corner += 1) {
      for (let axis = 0; axis < 3; axis += 1) {
        const value = vertices[faces[corner] * 3 + axis];
        if (value < box[axis]) box[axis] = value;
        if (value > box[axis + 3]) box[axis + 3] = value;
      }
    }
  }
  return { vertices, faces, boxes };
}

/**
 * Pieces of the outline: x, y of one end and of the other, in pixels of the raster from its upper left corner.
 * @param {BlockedMesh} mesh
 * @param {Raster} raster
 * @returns {number[]}
 */
export function cutMesh({ vertices, faces, boxes }, raster) {
  const view = projection(raster);
  /** @type {number[]} */
  const pieces = [];
  for (let block = 0; block * 6 < boxes.length; block += 1) {
    if (!view.meets(boxes, block * 6)) continue;
    const end = Math.min(faces.length, (block + 1) * BLOCK * 3);
    for (let face = block * BLOCK * 3; face < end; face += 3) cutFace(vertices, faces, face, view, pieces);
  }
  return pieces;
}

/** @param {Raster} raster */
function projection({ start, u, v }) {
  const [uu, vv] = [dot(u, u), dot(v, v)];
  const [a, b, c] = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const size = Math.hypot(a, b, c);
  const n = /** @type {Triple} */ ([a / size, b / size, c / size]);
  const offset = dot(n, start);
  return {
    away: (/** @type {Float32Array} */ at, /** @type {number} */ index) => n[0] * at[index] + n[1] * at[index + 1] + n[2] * at[index + 2] - offset,
    x: (/** @type {Triple} */ p) => ((p[0] - start[0]) * u[0] + (p[1] - start[1]) * u[1] + (p[2] - start[2]) * u[2]) / uu + 0.5,
    y: (/** @type {Triple} */ p) => ((p[0] - start[0]) * v[0] + (p[1] - start[1]) * v[1] + (p[2] - start[2]) * v[2]) / vv + 0.5,
    /** Whether the plane passes through a box. */
    meets(/** @type {Float32Array} */ boxes, /** @type {number} */ at) {
      let [low, high] = [-offset, -offset];
      for (let axis = 0; axis < 3; axis += 1) {
        low += n[axis] * boxes[at + axis + (n[axis] < 0 ? 3 : 0)];
        high += n[axis] * boxes[at + axis + (n[axis] < 0 ? 0 : 3)];
      }
      return low <= 0 && high >= 0;
    },
  };
}

/**
 * @param {Float32Array} vertices
 * @param {Uint32Array} faces
 * @param {number} face
 * @param {ReturnType<typeof projection>} view
 * @param {number[]} pieces
 */
function cutFace(vertices, faces, face, view, pieces) {
  const corners = [faces[face] * 3, faces[face + 1] * 3, faces[face + 2] * 3];
  const away = corners.map((corner) => view.away(vertices, corner));
  const above = away.map((value) => value >= 0);
  if (above[0] === above[1] && above[1] === above[2]) return;
  for (let edge = 0; edge < 3; edge += 1) {
    const next = (edge + 1) % 3;
    if (above[edge] === above[next]) continue;
    const part = away[edge] / (away[edge] - away[next]);
    const place = /** @type {Triple} */ ([0, 1, 2].map((axis) => {
      const value = vertices[corners[edge] + axis];
      return value + (vertices[corners[next] + axis] - value) * part;
    }));
    pieces.push(view.x(place), view.y(place));
  }
}
