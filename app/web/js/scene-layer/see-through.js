// What is seen through bone: the path, faint where bone hides it, and bone of some opacity as clear glass.

/** @import { SceneHooks, Three } from "./hooks.js" */

const GREATER_DEPTH = 6; // THREE.GreaterDepth; three.js turns it for viser's reversed depth
const THROUGH_OPACITY = 0.55;
const LAST = 900; // render order: after everything else, before viser's labels
const LEAST_VERTICES = 1000; // the head has more than any part of a robot or a plan

/** Lines with a width in mm are those of a plan: each is drawn once more where something hides it. */
export class PathThroughBone {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    /** @type {Map<Three, Three>} the second pass of each line */
    this.passes = new Map();
    hooks.watchers.add(() => this.follow());
  }

  /** The viewer gives a line another geometry with each change, and another object now and then. */
  follow() {
    /** @type {Set<Three>} */
    const found = new Set();
    this.hooks.each((object) => {
      if (object.isLineSegments2 && object.material?.worldUnits && object.material.defines?.VISER_LINE_FRINGE === undefined && !object.userData.vfixPass) found.add(object);
    });
    for (const [line, pass] of this.passes) {
      if (found.has(line) && pass.parent === line) continue;
      pass.removeFromParent();
      pass.material.dispose();
      this.passes.delete(line);
    }
    for (const line of found) {
      const pass = this.passes.get(line) ?? this.add(line);
      pass.geometry = line.geometry;
      pass.material.resolution.copy(line.material.resolution);
    }
  }

  /** @param {Three} line */
  add(line) {
    const pass = new line.constructor(line.geometry, line.material.clone());
    pass.material.worldUnits = true;
    pass.userData.vfixPass = true;
    Object.assign(pass.material, { depthFunc: GREATER_DEPTH, depthWrite: false, transparent: true, opacity: THROUGH_OPACITY });
    Object.assign(pass, { raycast: () => {}, renderOrder: LAST, frustumCulled: false });
    line.add(pass);
    this.passes.set(line, pass);
    return pass;
  }
}

/**
 * Bone of some opacity: its depth is drawn first, after all that is solid, so that only the surface that faces the eye is
 * tinted. Unsorted triangles that lie behind one another would speckle.
 */
export class ClearBone {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    /** @type {Three} */
    this.depth = null;
    hooks.watchers.add(() => this.follow());
  }

  follow() {
    const bone = this.bone();
    const wanted = bone?.material.transparent ? bone : null;
    if (this.depth && (this.depth.parent !== wanted || this.depth.geometry !== wanted?.geometry)) {
      this.depth.removeFromParent();
      this.depth.material.dispose();
      this.depth = null;
    }
    if (!wanted) return;
    wanted.material.depthWrite = true;
    wanted.renderOrder = LAST - 1;
    if (this.depth) return;
    this.depth = new wanted.constructor(wanted.geometry, wanted.material.clone());
    this.depth.userData.vfixPass = true;
    Object.assign(this.depth.material, { colorWrite: false, depthWrite: true, transparent: true, opacity: 1 });
    Object.assign(this.depth, { raycast: () => {}, renderOrder: LAST - 2 });
    wanted.add(this.depth);
  }

  /** Objects have no names here: the head is the mesh of most vertices. */
  bone() {
    /** @type {Three} */
    let found = null;
    let most = LEAST_VERTICES;
    this.hooks.each((object) => {
      const count = object.isMesh && !object.isInstancedMesh && !object.userData.vfixPass ? object.geometry.attributes.position?.count ?? 0 : 0;
      if (count > most) [found, most] = [object, count];
    });
    return found;
  }
}
