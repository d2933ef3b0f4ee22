// What the tools of recorded runs have swept, as clear bodies.
import { addMesh, dropMesh, sampleMesh } from "./made-meshes.js";

/** @import { SweptBody } from "../replay.js" */
/** @import { SceneHooks, Three } from "./hooks.js" */

const RUN = 0x6db3f2, GHOST = 0x4fc3a1;
const OPACITY = 0.42;
const FIRST = 700; // render order: after what is opaque, before clear bone and skin

/** Clear bodies: the depth of each is drawn before its colour, so that only what faces the eye is tinted. */
export class SweptVolumes {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    /** @type {Map<string, Three>} */
    this.shown = new Map();
    /** @type {SweptBody[]} */
    this.bodies = [];
    hooks.watchers.add(() => { if (this.bodies.length > this.shown.size) this.show(this.bodies); }); // nothing of viser's was there yet
  }

  /** @param {SweptBody[]} bodies */
  show(bodies) {
    this.bodies = bodies;
    const wanted = new Map(bodies.map((body) => [`${body.key} ${body.ghost}`, body]));
    for (const [key, mesh] of this.shown) {
      if (wanted.has(key)) continue;
      for (const part of [...mesh.children, mesh]) dropMesh(part);
      this.shown.delete(key);
    }
    const sample = wanted.size ? sampleMesh(this.hooks) : null;
    if (sample) for (const [key, body] of wanted) if (!this.shown.has(key)) this.shown.set(key, this.make(sample, body));
    this.hooks.redraw();
  }

  /**
   * @param {Three} sample
   * @param {SweptBody} body
   * @returns {Three}
   */
  make(sample, { mesh: shape, ghost }) {
    const mesh = addMesh(this.hooks, sample, shape, ghost ? GHOST : RUN, OPACITY);
    const order = FIRST + (ghost ? 0 : 2);
    mesh.renderOrder = order + 1;
    mesh.material.roughness = 0.8;
    const depth = new mesh.constructor(mesh.geometry, mesh.material.clone());
    Object.assign(depth.material, { colorWrite: false, depthWrite: true, opacity: 1 });
    Object.assign(depth, { raycast: () => {}, renderOrder: order, frustumCulled: false });
    depth.userData.vfixReplay = true;
    mesh.add(depth);
    return mesh;
  }
}
