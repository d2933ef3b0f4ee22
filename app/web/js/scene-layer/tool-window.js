// Bone and skin give way in a round window between the eye and the tip of a tool that is driven: dithered, so that nothing has to be sorted.
import { keep, recall } from "../remember.js";

/** @import { SceneHooks, Three } from "./hooks.js" */
/** @import { ClearSurfaces } from "./see-through.js" */

const RADIUS_MM = 11; // wholly open about the line from the eye to the tip
const RIM_MM = 7; // over which it closes
const BEFORE_MM = 3; // what is less before the tip than this stays in part: the wall beside the tool is seen

const DECLARED = "uniform vec3 vfixTip; uniform vec3 vfixHole; uniform float vfixOpen;\nvoid main() {";
// Fragments in a cylinder about the line eye – tip, before the tip; kept by a 4 × 4 pattern of thresholds (Bayer).
const DITHERED = `#include <clipping_planes_fragment>
{ vec3 place = -vViewPosition, way = normalize(vfixTip);
  float along = dot(place, way), off = length(place - along * way);
  float before = smoothstep(0.0, vfixHole.z, length(vfixTip) - along);
  float gone = vfixOpen * before * (1.0 - smoothstep(vfixHole.x, vfixHole.x + vfixHole.y, off));
  ivec2 cell = ivec2(mod(gl_FragCoord.xy, 4.0));
  int low = cell.x ^ cell.y;
  int rank = ((low & 1) << 3) | ((cell.y & 1) << 2) | (low & 2) | ((cell.y & 2) >> 1);
  if (gone > (float(rank) + 0.5) / 16.0) discard; }`;

/** Whether somebody wants it; kept by the browser. Says `change`. */
export class WindowSwitch extends EventTarget {
  constructor() {
    super();
    this.on = recall("tool-window", ["on", "off"], "on") === "on";
  }

  /** @param {boolean} on */
  set(on) {
    this.on = on;
    keep("tool-window", on ? "on" : "off");
    this.dispatchEvent(new Event("change"));
  }
}

export class ToolWindow {
  /**
   * @param {SceneHooks} hooks
   * @param {ClearSurfaces} surfaces that know bone and skin
   */
  constructor(hooks, surfaces) {
    this.hooks = hooks;
    this.surfaces = surfaces;
    /** @type {number[] | null} LPS, mm; null: closed */
    this.tip = null;
    const { constructor: Vector3 } = hooks.camera.position;
    this.uniforms = { vfixTip: { value: new Vector3(0, 0, -1) }, vfixHole: { value: new Vector3(RADIUS_MM, RIM_MM, BEFORE_MM) }, vfixOpen: { value: 0 } };
    /** @type {WeakSet<Three>} materials that have the window */
    this.cut = new WeakSet();
    hooks.watchers.add((camera) => this.follow(camera));
  }

  /** @param {number[] | null} tip LPS, mm; null closes the window */
  show(tip) {
    if (!tip && !this.tip) return;
    this.tip = tip;
    this.uniforms.vfixOpen.value = tip ? 1 : 0;
    this.hooks.redraw();
  }

  /** Another opacity or cut has another material. @param {Three} camera */
  follow(camera) {
    if (!this.tip) return;
    this.uniforms.vfixTip.value.copy(this.hooks.world(this.tip)).applyMatrix4(camera.matrixWorldInverse);
    for (const surface of [this.surfaces.now.bone, this.surfaces.now.skin]) if (surface && !this.cut.has(surface.material)) this.open(surface.material);
  }

  /** @param {Three} material is compiled anew, once */
  open(material) {
    this.cut.add(material);
    const compiles = material.onBeforeCompile, key = material.customProgramCacheKey();
    material.onBeforeCompile = (/** @type {{ fragmentShader: string, uniforms: object }} */ shader, /** @type {Three} */ gl) => {
      compiles.call(material, shader, gl);
      Object.assign(shader.uniforms, this.uniforms);
      shader.fragmentShader = shader.fragmentShader.replace("void main() {", DECLARED).replace("#include <clipping_planes_fragment>", DITHERED);
    };
    material.customProgramCacheKey = () => `vfix-window ${key}`;
    material.needsUpdate = true;
  }
}
