// Meshes that the page itself puts into viser's scene: of the classes of its three.js, since a second copy would not know its objects.

/** @import { SceneHooks, Three } from "./hooks.js" */

/** @typedef {{ positions: Float32Array, indices: Uint32Array, normals?: Float32Array }} MadeMesh without normals those of the triangles are used */

/**
 * A mesh of viser's, whose classes the others are made of; null while nothing of it is there yet.
 * @param {SceneHooks} hooks
 * @returns {Three | null}
 */
export function sampleMesh(hooks) {
  /** @type {Three} */
  let found = null;
  hooks.each((object) => {
    const { type, geometry, material, userData } = object;
    if (!found && type === "Mesh" && geometry?.type === "BufferGeometry" && geometry.index && geometry.attributes.position && material?.isMeshStandardMaterial && !userData.vfixPass && !userData.vfixReplay) found = object;
  });
  return found;
}

/**
 * An attribute of numbers for a geometry of the frame: WebGL does not know arrays of the page.
 * @param {Three} geometry of viser's
 * @param {Float32Array} values three for each vertex
 * @returns {Three}
 */
export function attributeOf(geometry, values) {
  const { position } = geometry.attributes;
  return new position.constructor(new position.array.constructor(values), 3);
}

/**
 * A mesh in the scene that is looked at, not pressed.
 * @param {SceneHooks} hooks
 * @param {Three} sample
 * @param {MadeMesh} shape
 * @param {number} colour
 * @param {number} opacity
 * @returns {Three}
 */
export function addMesh(hooks, sample, { positions, normals, indices }, colour, opacity) {
  const geometry = new sample.geometry.constructor(), { index } = sample.geometry;
  geometry.setAttribute("position", attributeOf(sample.geometry, positions));
  geometry.setIndex(new index.constructor(new index.array.constructor(indices), 1));
  if (normals) geometry.setAttribute("normal", attributeOf(sample.geometry, normals));
  else geometry.computeVertexNormals();
  const material = new sample.material.constructor();
  material.color.setHex(colour);
  Object.assign(material, { roughness: 0.5, metalness: 0, transparent: opacity < 1, opacity });
  const mesh = new sample.constructor(geometry, material);
  mesh.userData.vfixReplay = true;
  mesh.raycast = () => {};
  mesh.frustumCulled = false;
  hooks.root.add(mesh);
  return mesh;
}

/** @param {Three} mesh */
export function dropMesh(mesh) {
  mesh.removeFromParent();
  mesh.geometry.dispose();
  mesh.material.dispose();
}
