// The file of what a tool has swept and how near it has passed to bone, as app/drives/swept_file.py writes it.

/** @import { NearBone } from "/static/js/replay.js" */
/** @import { MadeMesh } from "/static/js/scene-layer/made-meshes.js" */

/** @typedef {{ body: MadeMesh, near: NearBone, least: number, volume: number }} SweptFile least: mm, of the vertices of bone. volume: mm³ */

const VERSION = 1;
const HEADER = 36;
const MAGIC = 0x57_58_46_56; // 'VFXW', little-endian

/**
 * @param {ArrayBuffer} data
 * @returns {SweptFile}
 */
export function readSwept(data) {
  const [magic, version, ...counts] = data.byteLength < HEADER ? [0] : new Uint32Array(data, 0, 6);
  const [vertices, triangles, near, nearTriangles] = counts;
  if (magic !== MAGIC || version !== VERSION || data.byteLength !== HEADER + 12 * (vertices + triangles + near + nearTriangles) + 4 * near) throw new Error("The file of the swept volume is damaged.");
  const [reach, least, volume] = new Float32Array(data, 24, 3);
  let at = HEADER;
  const next = (/** @type {number} */ count) => { const from = at; at += 4 * count; return from; };
  const body = { positions: new Float32Array(data, next(3 * vertices), 3 * vertices), indices: new Uint32Array(data, next(3 * triangles), 3 * triangles) };
  const positions = new Float32Array(data, next(3 * near), 3 * near);
  const indices = new Uint32Array(data, next(3 * nearTriangles), 3 * nearTriangles);
  return { body, near: { positions, indices, least: new Float32Array(data, at, near), reach }, least, volume };
}
