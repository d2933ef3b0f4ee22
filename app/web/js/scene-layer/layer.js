// What the page adds to the scene of one frame. Without the hooks the scene works as viser draws it.
import { SceneHooks } from "./hooks.js";
import { SceneLabels } from "./labels.js";
import { NearPatch } from "./near-patch.js";
import { ReplayedTools } from "./replayed-tools.js";
import { ClearSurfaces, PathThroughBone } from "./see-through.js";
import { SweptVolumes } from "./swept-volumes.js";
import { ToolWindow } from "./tool-window.js";
import { Turning } from "./turning.js";

/** @import { Replay } from "../replay.js" */
/** @import { CameraSection, LabelView, SkinSection } from "../types.js" */

export class SceneLayer {
  /**
   * The layer of a frame, once viser has its canvas; null when nobody waits any more. Throws where it cannot be reached.
   * @param {Window} frame
   * @param {HTMLElement} box for words over the frame
   * @param {() => boolean} wanted whether this frame is still the one that is shown
   */
  static async attach(frame, box, wanted) {
    const hooks = await SceneHooks.attach(frame, wanted);
    return hooks && new SceneLayer(hooks, box);
  }

  /**
   * @param {SceneHooks} hooks
   * @param {HTMLElement} box
   */
  constructor(hooks, box) {
    this.hooks = hooks;
    this.labels = new SceneLabels(hooks, box);
    this.turning = new Turning(hooks);
    this.path = new PathThroughBone(hooks);
    this.surfaces = new ClearSurfaces(hooks);
    this.replayed = new ReplayedTools(hooks);
    this.swept = new SweptVolumes(hooks);
    this.near = new NearPatch(hooks, this.surfaces);
    this.window = new ToolWindow(hooks, this.surfaces);
    hooks.redraw();
  }

  /**
   * @param {LabelView[] | undefined} labels
   * @param {CameraSection | undefined} camera
   * @param {SkinSection | undefined} skin
   */
  update(labels, camera, skin) {
    this.surfaces.skinColour = skin?.colour ?? "";
    this.path.shines = !(skin?.shown && skin.opacity >= 1);
    this.labels.show(labels ?? []);
    this.turning.about(camera?.pivot ?? null);
  }

  /** @param {Replay} replay */
  lay({ swept, near }) {
    this.swept.show(swept);
    this.near.show(near);
  }

  remove() {
    this.labels.clear();
  }
}
