// Tools of recorded runs in the scene, and the ways of their tips: made and moved here, so that a replay costs the planner nothing.
import { addMesh, dropMesh, sampleMesh } from "./made-meshes.js";
import { capsule, tube } from "./round-meshes.js";

/** @import { SceneHooks, Three } from "./hooks.js" */
/** @import { ReplayedTool } from "../replay.js" */

const RUN = { tool: 0xced4dc, way: 0xffd479, opacity: 1 }; // the tool as a drive shows it; its way as the tool in the slices
const GHOST = { tool: 0x4fc3a1, way: 0x4fc3a1, opacity: 0.55 };
const WAY_MM = 0.3; // radius of a way

/** @typedef {{ parts: Three[], way: Three, shape: string }} Shown shape: of what it was made for */

export class ReplayedTools {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    /** @type {Map<string, Shown>} by key of the run, and whether it is the ghost */
    this.shown = new Map();
  }

  /** @param {ReplayedTool[]} tools */
  show(tools) {
    if (!tools.length && !this.shown.size) return;
    const wanted = new Map(tools.map((tool) => [`${tool.key} ${tool.ghost}`, tool]));
    for (const [key, one] of this.shown) if (!wanted.has(key)) this.remove(key, one);
    for (const [key, tool] of wanted) this.place(key, tool);
    this.hooks.redraw();
  }

  /**
   * @param {string} key
   * @param {ReplayedTool} tool
   */
  place(key, tool) {
    const lengths = tool.segments.map(([from, to]) => Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]));
    const shape = JSON.stringify([lengths.map((length) => length.toFixed(2)), tool.radii, tool.way.length]);
    const before = this.shown.get(key);
    if (before && before.shape !== shape) this.remove(key, before);
    const one = this.shown.get(key) ?? this.make(tool, lengths, shape);
    if (!one) return; // nothing of viser's is there yet
    this.shown.set(key, one);
    tool.segments.forEach(([from, to], index) => {
      const part = one.parts[index], { constructor: Vector3 } = part.position;
      part.position.set(from[0], from[1], from[2]);
      part.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(to[0] - from[0], to[1] - from[1], to[2] - from[2]).normalize());
    });
  }

  /**
   * @param {ReplayedTool} tool
   * @param {number[]} lengths
   * @param {string} shape
   * @returns {Shown | null}
   */
  make(tool, lengths, shape) {
    const sample = sampleMesh(this.hooks);
    if (!sample) return null;
    const look = tool.ghost ? GHOST : RUN;
    const parts = lengths.map((length, index) => addMesh(this.hooks, sample, capsule(tool.radii[index], length), look.tool, look.opacity));
    const way = addMesh(this.hooks, sample, tube(tool.way, WAY_MM), look.way, look.opacity);
    return { parts, way, shape };
  }

  /**
   * @param {string} key
   * @param {Shown} one
   */
  remove(key, { parts, way }) {
    for (const mesh of [...parts, way]) dropMesh(mesh);
    this.shown.delete(key);
  }
}
