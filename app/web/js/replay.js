// What is replayed of recorded runs at the present moment: shown by the scene and the slices, with no work of the planner.

/** @import { ScopePose } from "./endoscope/lens.js" */
/** @import { Triple } from "./slices/grid.js" */

/**
 * A tool of a run at one moment, and the way of its tip over the whole run; all in LPS mm.
 * @typedef {{ key: string, plan: string | null, ghost: boolean, segments: [Triple, Triple][], side: Triple, radii: number[], way: Triple[], camera?: ScopePose, forces?: { guidance: [number, number], resistance: [number, number] } }} ReplayedTool
 *   key: of the run. plan: that was driven. camera: where one of its own is; else its first part has the lens. forces: on the hand, N, to the right in its picture and down. segments: axes of the tool's parts from the tip on. side: across the first part,
 *   to which its bend or lens points. ghost: another run beside the one that is looked at
 */

/**
 * What a tool has swept over a run, LPS mm.
 * @typedef {{ key: string, ghost: boolean, mesh: import("./scene-layer/made-meshes.js").MadeMesh }} SweptBody
 */
/**
 * Bone within reach of the tool of a run, and the least distance of each of its places to it; all in mm.
 * @typedef {{ positions: Float32Array, indices: Uint32Array, least: Float32Array, reach: number }} NearBone
 */

/** Says `change` of the tools, and `laid` of what is laid into the scene; the page has one. */
export class Replay extends EventTarget {
  constructor() {
    super();
    /** @type {ReplayedTool[]} the run first */
    this.tools = [];
    /** @type {SweptBody[]} */
    this.swept = [];
    /** @type {NearBone | null} */
    this.near = null;
  }

  /**
   * @param {SweptBody[]} swept
   * @param {NearBone | null} near
   */
  lay(swept, near) {
    if (!swept.length && !this.swept.length && near === this.near) return;
    Object.assign(this, { swept, near });
    this.dispatchEvent(new Event("laid"));
  }

  /** @param {ReplayedTool[]} tools */
  show(tools) {
    if (!tools.length && !this.tools.length) return;
    this.tools = tools;
    this.dispatchEvent(new Event("change"));
  }

  /** Where the tip of the run is. @returns {Triple | undefined} */
  get tip() {
    return this.tools[0]?.segments[0]?.[1];
  }
}

export const replay = new Replay();
