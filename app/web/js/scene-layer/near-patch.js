// How near the tool of a recorded run has passed to bone, as a coloured skin upon it.
import { nearColour } from "../near-scale.js";
import { addMesh, attributeOf, dropMesh, sampleMesh } from "./made-meshes.js";

/** @import { NearBone } from "../replay.js" */
/** @import { SceneHooks, Three } from "./hooks.js" */
/** @import { ClearSurfaces } from "./see-through.js" */

const BONE = 0xe2d8c6; // as app/scene/palette.py has it
const OFF_MM = 0.3; // off the bone, towards the air: what is shown of a head may be thinned by as much
const DOUBLE_SIDE = 2; // THREE.DoubleSide, as bone is drawn

export class NearPatch {
  /**
   * @param {SceneHooks} hooks
   * @param {ClearSurfaces} surfaces that know the bone
   */
  constructor(hooks, surfaces) {
    this.hooks = hooks;
    this.surfaces = surfaces;
    /** @type {NearBone | null} */
    this.near = null;
    /** @type {Three} */
    this.mesh = null;
    /** @type {Three} the geometry of bone that it was made for: a cut gives it another one */
    this.bone = null;
    hooks.watchers.add(() => this.follow());
  }

  /** @param {NearBone | null} near */
  show(near) {
    if (near === this.near) return;
    this.near = near;
    this.drop();
    this.hooks.redraw();
  }

  drop() {
    if (this.mesh) dropMesh(this.mesh);
    this.mesh = null;
    this.bone = null;
  }

  follow() {
    const { near } = this, bone = near ? this.surfaces.found().bone?.geometry : null;
    if (!near || !bone || bone === this.bone) return;
    this.drop();
    const sample = sampleMesh(this.hooks);
    if (!sample) return;
    this.bone = bone;
    bone.computeBoundingBox();
    const indices = within(near, bone.boundingBox);
    if (!indices.length) return;
    this.mesh = addMesh(this.hooks, sample, { positions: near.positions, indices }, BONE, 1);
    const { geometry, material } = this.mesh, { color } = material;
    geometry.setAttribute("color", attributeOf(geometry, coloursOf(near, [color.r, color.g, color.b])));
    liftOff(geometry.attributes.position.array, geometry.attributes.normal.array);
    color.setHex(0xffffff); // it multiplies those of the vertices
    Object.assign(material, { vertexColors: true, side: DOUBLE_SIDE });
    this.hooks.redraw();
  }
}

/**
 * Corners of the triangles whose middle lies between the ends of bone from side to side: the rest was cut away.
 * @param {NearBone} near
 * @param {{ min: { x: number }, max: { x: number } }} box
 */
export function within({ positions, indices }, { min, max }) {
  const kept = [];
  for (let at = 0; at < indices.length; at += 3) {
    const [a, b, c] = indices.subarray(at, at + 3);
    const x = (positions[3 * a] + positions[3 * b] + positions[3 * c]) / 3;
    if (x >= min.x && x <= max.x) kept.push(a, b, c);
  }
  return new Uint32Array(kept);
}

/**
 * @param {NearBone} near
 * @param {number[]} plain colour of bone, linear
 */
function coloursOf({ least, reach }, plain) {
  const values = new Float32Array(3 * least.length);
  least.forEach((distance, vertex) => { values.set(nearColour(distance, reach, plain), 3 * vertex); });
  return values;
}

/**
 * @param {Float32Array} places
 * @param {Float32Array} normals
 */
function liftOff(places, normals) {
  normals.forEach((value, index) => { places[index] += OFF_MM * value; });
}
