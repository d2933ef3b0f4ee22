// The picture of an endoscope on the page, while a layout shows it: its lens, its poses, and what it is made of.
import { note } from "../dialogs.js";
import { h, icon, whenChanged } from "../dom.js";
import { pacing } from "../frame-pacing.js";
import { LAID_OUT } from "../layout.js";
import { NearnessGauge } from "../nearness.js";
import { replay } from "../replay.js";
import { saveBlob } from "../rest.js";
import { say } from "../said.js";
import { length, minus } from "../slices/vectors.js";
import { CameraHand } from "./camera-hand.js";
import { lensOf } from "./lens.js";
import { forceSound } from "./force-sound.js";
import { ForceArcs } from "./guidance-arc.js";
import { LOOKS } from "./looks.js";
import { NearnessCues } from "./nearness-cues.js";
import { PoseChannel } from "./pose-channel.js";
import { Renderer } from "./renderer.js";
import { scopeOf, wallWords } from "./scope.js";
import { ScopeTools } from "./scope-tools.js";
import { SurfaceLoader } from "./surface-loader.js";
import { TaskPicture } from "./task-picture.js";

/** @import { Connection } from "../connection.js" */
/** @import { ToolPoses } from "../slices/tool-poses.js" */
/** @import { Triple } from "../slices/grid.js" */
/** @import { ScopeSection, ViewModel } from "../types.js" */
/** @import { Keys } from "../keys.js" */
/** @import { Lens, LensSettings, ScopePose } from "./lens.js" */
/** @import { Look } from "./looks.js" */

/** planned: the tool in the plan's dry run. swap: show it large, or small. @typedef {{ planned: () => ToolPoses, swap: () => void, keys: Keys }} Page */

const LIVE = ["ready", "running", "paused"];
const STILL_MS = 400; // without a motion the picture is drawn in full
const MOVING_PX = 320; // of a picture that moves, without a graphics card
const MOST_PX = [420, 1600]; // of any, without and with one
const MOVED = 1e-5; // mm, or a unit vector
const DROPPED = "The graphics card dropped the picture.";
/** A camera that the robot turns has no lens to turn. @type {LensSettings} */
const AS_IT_IS = { angle: 0, turn: 0, level: false };
const TOWARDS_HEAD = /** @type {Triple} */ ([0, 0, 1]);

export class EndoscopeView {
  /**
   * @param {HTMLElement} root
   * @param {Connection} connection
   * @param {Page} page
   */
  constructor(root, connection, page) {
    this.root = root;
    this.connection = connection;
    this.page = page;
    this.visible = false;
    this.canvas = h("canvas", { class: "scope-picture", tabIndex: 0, role: "img" });
    this.tools = new ScopeTools(this.canvas, (moves) => this.seenAnew(moves), () => this.save());
    this.hand = new CameraHand(root, this.canvas, connection, page.keys);
    this.arcs = new ForceArcs();
    this.task = new TaskPicture(() => this.renderer, () => this.schedule());
    this.cues = new NearnessCues();
    this.tools.saveButton.before(...this.cues.buttons);
    this.swapButton = h("button", { type: "button", class: "icon plain scope-swap", id: "scope-swap", onclick: () => page.swap() }, icon("large"));
    this.nearness = new NearnessGauge();
    this.source = h("span", { id: "scope-source" });
    this.channelWords = h("span", { class: "caution", role: "status" });
    /** @type {Renderer | null} */
    this.renderer = null;
    /** @type {ScopePose | null} where the scope is shown */
    this.pose = null;
    /** @type {ScopePose | null} the newest of the drive */
    this.driven = null;
    /** @type {string | undefined} key of the run that is replayed */
    this.run = undefined;
    this.movedAt = -Infinity;
    this.own = false; // the picture is of a camera that has no lens to turn
    this.wished = false; // a frame is asked for
    this.lost = false; // what the graphics card held
    this.broken = ""; // why there is no picture, until the graphics card is given anew
    /** @type {number | undefined} */
    this.stillTimer = undefined;
    this.changedPlan = whenChanged();
    this.channel = new PoseChannel((pose, row) => this.came(pose, row), (words) => this.told(words));
    this.surface = new SurfaceLoader((data) => this.loaded(data));
    root.replaceChildren(this.canvas, this.cues.vignette, this.arcs.element, ...this.task.elements, this.tools.element, this.swapButton, this.nearness.element, h("p", { class: "scope-foot" }, this.source, this.channelWords), this.surface.element);
    this.canvas.addEventListener("webglcontextlost", (event) => this.lose(event));
    this.canvas.addEventListener("webglcontextrestored", () => this.recover());
    replay.addEventListener("change", () => this.played());
    window.addEventListener(LAID_OUT, (event) => this.laidOut(/** @type {CustomEvent<string>} */ (event).detail));
    new ResizeObserver(() => this.schedule()).observe(this.canvas);
  }

  /** @param {string} layout */
  laidOut(layout) {
    this.visible = layout.startsWith("endoscope");
    const swap = layout === "endoscope" ? "Show 3D large (E)" : "Show the endoscope large (E)";
    this.swapButton.title = swap;
    this.swapButton.setAttribute("aria-label", swap);
    this.update(this.connection.state);
  }

  /** @param {ViewModel} state */
  update(state) {
    const { plan, rehearsal, curve, driven, step, route } = state;
    const live = this.visible && step?.input === "drive" && LIVE.includes(rehearsal?.state ?? "");
    const scope = scopeOf(state, replay.tools[0]?.plan);
    this.channel.follow(live && scope.poses ? scope.poses : null);
    this.hand.follow(state, scope.hand && this.visible);
    this.own = scope.own;
    this.tools.element.hidden = scope.own;
    const [does, title] = handWords(scope);
    this.canvas.setAttribute("aria-label", `Picture of the endoscope${does}`);
    this.canvas.title = title;
    this.arcs.element.hidden = !scope.hand && !replay.tools[0]?.forces;
    if (!live) this.forgetDriven();
    this.cues.update(state, this.visible && this.connection.connected && !document.hidden);
    if (!this.visible) return;
    this.nearness.update(state.nearness);
    if (!this.prepare(state)) {
      say(this.source, "");
      return;
    }
    const places = curve?.points ?? [];
    const { now: task = null, labels = null } = (live ? state.drive_task : replayedTask(state)) ?? {}; // its polyps are drawn as such
    const targets = [...((driven ?? plan)?.targets ?? []).map(({ position }) => position), ...(task ? [] : route?.marks ?? []).map(({ at }) => at)];
    this.changedPlan([places, targets], () => {
      this.renderer?.overlay.set(places, targets);
      this.schedule();
    });
    this.task.show(task, labels);
    const replayed = replayedPose();
    if (!this.driven) this.show(replayed ?? this.plannedPose(state));
    this.feelReplayed();
    say(this.source, this.driven ? wallWords(state.snake?.lens_mm) : replayed ? "Replayed" : this.pose ? "Planned, not driven" : "");
  }

  /** Another moment of a run; only another run needs anything but its pose. */
  played() {
    const run = replay.tools[0]?.key, pose = replayedPose();
    if (run === this.run && pose && this.visible && !this.driven) {
      this.show(pose);
      this.feelReplayed();
    } else this.update(this.connection.state);
    this.run = run;
  }

  /**
   * Ask for what the picture is made of; false where that cannot be.
   * @param {ViewModel} state
   */
  prepare(state) {
    const { words, surface, key, look } = scopeOf(state, replay.tools[0]?.plan);
    if (this.lost) this.surface.drop(DROPPED);
    else if (words) this.surface.drop(words);
    else if (this.start(LOOKS[look])) {
      this.surface.want(surface, key);
      return true;
    }
    return false;
  }

  /**
   * The renderer, made when it is first needed.
   * @param {Look} look
   */
  start(look) {
    if (this.renderer) {
      this.renderer.look = look;
      return true;
    }
    if (this.broken) {
      this.surface.drop(this.broken);
      return false;
    }
    try {
      this.renderer = new Renderer(this.canvas, look);
    } catch (error) {
      this.fail(/** @type {Error} */ (error).message);
    }
    return this.renderer !== null;
  }

  /**
   * There is no picture until the graphics card is given anew.
   * @param {string} words why
   */
  fail(words) {
    this.broken = words;
    this.renderer = null;
    this.surface.drop(words);
  }

  /** @param {Event} event */
  lose(event) {
    event.preventDefault(); // so that the browser gives it back
    this.lost = true;
    this.renderer = null;
    this.surface.drop(DROPPED); // whether it is in sight or not: what is there has to be loaded again
  }

  recover() {
    this.lost = false;
    this.broken = "";
    this.changedPlan = whenChanged();
    this.task.forget();
    this.update(this.connection.state);
  }

  /** @param {ArrayBuffer | null} data */
  loaded(data) {
    if (data) this.renderer?.load(data);
    else this.renderer?.unload();
    this.root.dataset.ready = String(data !== null);
    this.surface.element.hidden = data !== null;
    this.tools.saveButton.disabled = data === null;
    this.schedule();
  }

  /**
   * Where the dry run brings the tool at the place that is shown, else at the start of the path.
   * @param {ViewModel} state
   * @returns {ScopePose | null}
   */
  plannedPose(state) {
    const { pose, own } = scopeOf(state, replay.tools[0]?.plan);
    if (own) return pose;
    const { corridor, curve } = state;
    const s = corridor?.shown_mm ?? 0;
    const [first, second] = curve?.points ?? [];
    const part = this.page.planned().at(s)?.segments[0];
    if (part) return { tip: part[1], shaft: minus(part[1], part[0]), side: sideOf(minus(part[1], part[0])) };
    if (!first || !second) return null;
    const shaft = minus(second, first);
    return { tip: first, shaft, side: sideOf(shaft) };
  }

  /**
   * @param {ScopePose} pose of the drive
   * @param {(name: string) => number} row
   */
  came(pose, row) {
    this.driven = pose;
    if (!this.arcs.element.hidden) this.feel(row);
    this.show(pose);
    say(this.source, wallWords(this.connection.state.snake?.lens_mm));
  }

  /**
   * The forces on the hand, seen and heard.
   * @param {(name: string) => number} row
   */
  feel(row) {
    const [x, y] = [row("guidance_force_x"), row("guidance_force_y")];
    this.arcs.push([x, y], [row("forces_x") - x, row("forces_y") - y], row("t_s"));
    forceSound.hear(this.arcs.force);
  }

  /** The forces at the moment of the run that is replayed. */
  feelReplayed() {
    const forces = replay.tools[0]?.forces;
    if (forces && !this.driven) this.arcs.push(forces.guidance, forces.resistance, NaN);
  }

  /** @param {string} words why no poses of the drive come; '' where they do */
  told(words) {
    say(this.channelWords, words);
    if (!words || !this.driven || this.own) return; // of a camera that is driven what is planned is the entry: the last picture is nearer to the truth
    this.forgetDriven();
    this.update(this.connection.state);
  }

  /** What was felt goes with the picture in which it was. */
  forgetDriven() {
    this.driven = null;
    this.arcs.clear();
  }

  /** @param {ScopePose | null} pose */
  show(pose) {
    if (samePose(pose, this.pose)) return;
    this.pose = pose;
    this.movedAt = performance.now();
    this.schedule();
  }

  /** @param {boolean} moves whether the lens is being turned */
  seenAnew(moves) {
    if (moves) this.movedAt = performance.now();
    this.schedule();
  }

  /** @returns {Lens | null} */
  get lens() {
    return this.pose && lensOf(this.pose, this.own ? AS_IT_IS : this.tools.settings, this.renderer?.look.far);
  }

  schedule() {
    if (this.wished || !this.visible) return;
    this.wished = true;
    pacing.request(() => {
      this.wished = false;
      this.draw();
    });
  }

  /** Coarse while it moves, where every pixel costs; in full once it stands. */
  draw() {
    const { renderer, lens } = this;
    this.task.look(this.driven && lens);
    if (!renderer?.tissue || !lens || !this.visible) return;
    const shown = Math.round(this.canvas.clientWidth * window.devicePixelRatio * pacing.scale);
    const moving = performance.now() - this.movedAt < STILL_MS;
    const coarse = renderer.software && moving;
    renderer.resize(Math.max(1, Math.min(shown, coarse ? MOVING_PX : MOST_PX[renderer.software ? 0 : 1])));
    clearTimeout(this.stillTimer);
    renderer.inTissue = Boolean(this.driven) && (this.connection.state.snake?.lens_mm ?? 0) < 0;
    try {
      renderer.draw(lens, coarse ? "lean" : "full");
    } catch (error) {
      this.fail(/** @type {Error} */ (error).message);
      return;
    }
    if (coarse) this.stillTimer = setTimeout(() => this.schedule(), STILL_MS);
  }

  async save() {
    const { renderer, lens } = this;
    if (!renderer?.tissue || !lens) return;
    const { angle } = this.tools.settings;
    try {
      saveBlob(await renderer.picture(lens, this.own ? "Drawn from a surface. Not for clinical use." : `Drawn from a CT, ${angle}° lens. Not for clinical use.`), `endoscope-${angle}.png`);
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
  }
}

/**
 * What keys and a drag do in the picture: for a screen reader, and under the pointer.
 * @param {Pick<ScopeSection, "hand" | "own">} scope
 */
function handWords({ hand, own }) {
  if (hand) return ["; arrow keys turn the camera while it is driven", "Drag turns the camera"];
  return own ? ["", ""] : ["; ← and → turn its lens", "Drag turns the lens; double-click turns it back"];
}

/** @returns {ScopePose | null} of the run that is replayed */
function replayedPose() {
  const [tool] = replay.tools, [part] = tool?.segments ?? [];
  return tool?.camera ? tool.camera : part ? { tip: part[1], shaft: minus(part[1], part[0]), side: tool.side } : null;
}

/**
 * The task of that run, at the moment that is shown.
 * @param {ViewModel} state
 */
function replayedTask({ replayed_task: told }) {
  return told && told.run === replay.tools[0]?.key ? told : null;
}

/**
 * The side of a shaft that is nearest to the top of the head.
 * @param {Triple} shaft
 * @returns {Triple}
 */
function sideOf([x, y, z]) {
  return Math.hypot(x, y) > 0.1 * Math.hypot(x, y, z) ? TOWARDS_HEAD : [0, -1, 0];
}

/**
 * @param {ScopePose | null} a
 * @param {ScopePose | null} b
 */
function samePose(a, b) {
  if (!a || !b) return a === b;
  return /** @type {const} */ (["tip", "shaft", "side"]).every((name) => length(minus(a[name], b[name])) < MOVED);
}
