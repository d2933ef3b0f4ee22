// What is seen through bone and skin: path, points and targets, faint where bone hides them, and both as clear glass where they have some opacity.

/** @import { SceneHooks, Three } from "./hooks.js" */

const GREATER_DEPTH = 6; // THREE.GreaterDepth; three.js turns it for viser's reversed depth
const THROUGH_OPACITY = 0.55;
const MARK_OPACITY = 0.8; // points and targets are small
const MARK_COLOURS = ["6db3f2", "e58fd0", "ffffff"]; // of path points, targets, and the selected one: app/scene/palette.py
// A share of its opacity where it faces the eye, and more towards its edges: relief is seen on what is nearly clear.
const CLEARER_IN_FRONT = "diffuseColor.a = min(1.0, diffuseColor.a * (0.65 + 2.35 * pow(1.0 - abs(dot(normalize(vViewPosition), normal)), 2.0)));";
const LAST = 900; // render order: after everything else, before viser's labels
const LEAST_VERTICES = 1000; // the head has more than any part of a robot or a plan

/** Lines with a width in mm and small bodies in the plan's colours are those of a plan: each is drawn once more where something hides it. */
export class PathThroughBone {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    /** @type {Map<Three, Three>} the second pass of each line or mark */
    this.passes = new Map();
    this.shines = true; // not through skin that is opaque: it would seem to lie on the face
    hooks.watchers.add(() => this.follow());
  }

  /** The viewer gives a line another geometry with each change, and another object now and then. */
  follow() {
    /** @type {Set<Three>} */
    const found = new Set();
    this.hooks.each((object) => {
      if (!object.userData.vfixPass && (isLine(object) || isMark(object))) found.add(object);
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
      pass.visible = this.shines;
      if (isLine(line)) pass.material.resolution.copy(line.material.resolution);
      else pass.material.color.copy(line.material.color); // another one once it is selected
    }
  }

  /** @param {Three} line */
  add(line) {
    const pass = new line.constructor(line.geometry, line.material.clone());
    if (isLine(line)) pass.material.worldUnits = true;
    pass.userData.vfixPass = true;
    const opacity = isLine(line) ? THROUGH_OPACITY : MARK_OPACITY;
    Object.assign(pass.material, { depthFunc: GREATER_DEPTH, depthWrite: false, transparent: true, opacity });
    Object.assign(pass, { raycast: () => {}, renderOrder: LAST, frustumCulled: false });
    line.add(pass);
    this.passes.set(line, pass);
    return pass;
  }
}

/** @param {Three} object */
function isLine({ isLineSegments2, material }) {
  return Boolean(isLineSegments2 && material?.worldUnits && material.defines?.VISER_LINE_FRINGE === undefined);
}

/** Whether an object is a path point or a target: objects have no names here. @param {Three} object */
function isMark({ isMesh, isInstancedMesh, isLineSegments2, geometry, material }) {
  if (!isMesh || isInstancedMesh || isLineSegments2 || !((geometry.attributes.position?.count ?? Infinity) < LEAST_VERTICES)) return false;
  return !material.transparent && MARK_COLOURS.includes(material.color?.getHexString());
}

/**
 * Bone and skin of some opacity: the depth of each is drawn first, after all that is behind it, so that only the surface
 * that faces the eye is tinted. Unsorted triangles that lie behind one another would speckle.
 */
export class ClearSurfaces {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    this.skinColour = ""; // as '#rrggbb'
    /** @type {{ bone: Three, skin: Three }} in the frame that is drawn */
    this.now = { bone: null, skin: null };
    this.bone = new ClearSurface(LAST - 1);
    this.skin = new ClearSurface(LAST + 2, clearerInFront); // over bone and path
    hooks.watchers.add(() => this.follow());
  }

  follow() {
    const { bone, skin } = this.now = this.found();
    this.bone.follow(bone);
    this.skin.follow(skin);
  }

  /** Objects have no names here: the skin is told by its colour, the bone is the other mesh of most vertices. */
  found() {
    /** @type {Three} */
    let bone = null;
    /** @type {Three} */
    let skin = null;
    let most = LEAST_VERTICES;
    this.hooks.each((object) => {
      const count = object.isMesh && !object.isInstancedMesh && !object.userData.vfixPass && !object.userData.vfixReplay ? object.geometry.attributes.position?.count ?? 0 : 0;
      if (count <= LEAST_VERTICES) return;
      if (`#${object.material.color?.getHexString()}` === this.skinColour) skin = object;
      else if (count > most) [bone, most] = [object, count];
    });
    return { bone, skin };
  }
}

/** One surface, and the pass of its depth. */
class ClearSurface {
  /**
   * @param {number} order of drawing
   * @param {(surface: Three) => void} [dress] changes its material, called for each frame
   */
  constructor(order, dress = () => {}) {
    this.order = order;
    this.dress = dress;
    /** @type {Three} */
    this.depth = null;
  }

  /** @param {Three} surface */
  follow(surface) {
    const wanted = surface?.material.transparent ? surface : null;
    if (this.depth && (this.depth.parent !== wanted || this.depth.geometry !== wanted?.geometry)) {
      this.depth.removeFromParent();
      this.depth.material.dispose();
      this.depth = null;
    }
    if (!wanted) return;
    this.dress(wanted);
    wanted.material.depthWrite = true;
    wanted.renderOrder = this.order;
    if (this.depth) return;
    this.depth = new wanted.constructor(wanted.geometry, wanted.material.clone());
    this.depth.userData.vfixPass = true;
    Object.assign(this.depth.material, { colorWrite: false, depthWrite: true, transparent: true, opacity: 1 });
    Object.assign(this.depth, { raycast: () => {}, renderOrder: this.order - 1 });
    wanted.add(this.depth);
  }
}

/** @param {Three} surface whose material is compiled anew, once */
function clearerInFront({ material }) {
  if (material.userData.vfixClearer) return;
  material.userData.vfixClearer = true;
  material.onBeforeCompile = (/** @type {{ fragmentShader: string }} */ shader) => {
    shader.fragmentShader = shader.fragmentShader.replace("#include <opaque_fragment>", `${CLEARER_IN_FRONT}\n#include <opaque_fragment>`);
  };
  material.customProgramCacheKey = () => "vfix-skin";
  material.needsUpdate = true;
}
