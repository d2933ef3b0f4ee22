// The file of what an endoscope sees, as app/imaging/endoscope_file.py writes it, and which parts of it are in sight.
import { FAR, FIELD } from "./lens.js";
/** @import { Lens } from "./lens.js" */

/**
 * vertices: positions, normals and colours of all of them, one after another, 20 bytes each. corners: of triangles.
 * clusters: 6 numbers each, first corner, number of corners, centre and radius of a ball.
 * @typedef {{ count: number, vertices: Uint8Array, corners: Uint32Array, clusters: Float32Array }} MeshFile
 */

const VERSION = 1;
const HEADER = 48;
const MAGIC = 0x53_58_46_56; // 'VFXS', little-endian
const CLUSTER = 6;
const HALF = Math.atan(Math.SQRT2 * Math.tan((FIELD / 360) * Math.PI)); // of the cone about the square picture

/**
 * @param {ArrayBuffer} data
 * @returns {MeshFile}
 */
export function readMesh(data) {
  const [magic, version, count, triangles, clusters] = data.byteLength < HEADER ? [0] : new Uint32Array(data, 0, 5);
  const at = HEADER + 20 * count;
  if (magic !== MAGIC || version !== VERSION || data.byteLength !== at + 12 * triangles + 24 * clusters) throw new Error("The surface for the endoscope is damaged.");
  return {
    count,
    vertices: new Uint8Array(data, HEADER, 20 * count),
    corners: new Uint32Array(data, at, 3 * triangles),
    clusters: new Float32Array(data, at + 12 * triangles, CLUSTER * clusters),
  };
}

/**
 * First corner and number of corners of the clusters whose balls touch the cone of sight, the nearest first: what they
 * hide costs no shading then.
 * @param {Float32Array} clusters
 * @param {Pick<Lens, "eye" | "ahead"> & { far?: number }} lens
 * @returns {[number, number][]}
 */
export function inSight(clusters, { eye, ahead, far = FAR }) {
  const [sine, cosine] = [Math.sin(HALF), Math.cos(HALF)];
  /** @type {[number, number, number][]} */
  const seen = [];
  for (let i = 0; i < clusters.length; i += CLUSTER) {
    const [x, y, z, radius] = [clusters[i + 2] - eye[0], clusters[i + 3] - eye[1], clusters[i + 4] - eye[2], clusters[i + 5]];
    const along = x * ahead[0] + y * ahead[1] + z * ahead[2];
    const off = Math.sqrt(Math.max(0, x * x + y * y + z * z - along * along));
    if (along > -radius && along < far + radius && off * cosine - along * sine < radius) seen.push([clusters[i], clusters[i + 1], along - radius]);
  }
  return seen.sort((a, b) => a[2] - b[2]).map(([first, corners]) => [first, corners]);
}
