// Plays a run, and another one beside it: the time, and where both tools are then. Positions come from one download a run.
import { replay } from "/static/js/replay.js";
import { drivenOf } from "/static/js/run-views.js";
import { robotAt, segmentsAt, sideAt } from "./curves.js";

/** @import { ReplayedTool } from "/static/js/replay.js" */
/** @import { Triple } from "/static/js/slices/grid.js" */
/** @import { AnySeries } from "/static/js/runs.js" */
/** @import { LumenSeriesPublic, RunTitle, SeriesPublic } from "/static/js/types.js" */

/** @typedef {{ run: RunTitle, series: AnySeries }} Loaded */

export const SPEEDS = [0.25, 0.5, 1, 2, 4];
export const STEP_S = 1 / 30;

/** Says `change` when another time or run is shown, `state` when it begins or stops to play. */
export class Player extends EventTarget {
  constructor() {
    super();
    /** @type {Loaded | null} */
    this.main = null;
    /** @type {Loaded | null} */
    this.ghost = null;
    this.t = 0; // s
    this.speed = 1;
    this.playing = false;
    this.last = 0; // ms, of the frame before
  }

  /** Duration of what is played, s. */
  get end() {
    const ends = [this.main, this.ghost].map((one) => one?.series.t_s.at(-1) ?? 0);
    return Math.max(...ends);
  }

  /**
   * @param {Loaded | null} main
   * @param {Loaded | null} ghost
   */
  load(main, ghost) {
    const other = main?.run.id !== this.main?.run.id;
    Object.assign(this, { main, ghost });
    if (other) {
      this.pause();
      this.t = 0;
    }
    this.seek(this.t);
  }

  /** @param {number} t */
  seek(t) {
    this.t = Math.min(Math.max(t, 0), this.end);
    this.show();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (!this.main || this.playing) return;
    if (this.t >= this.end - 1e-3) this.t = 0;
    this.playing = true;
    this.last = performance.now();
    requestAnimationFrame((now) => this.frame(now));
    this.dispatchEvent(new Event("state"));
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.dispatchEvent(new Event("state"));
  }

  /** @param {number} now ms */
  frame(now) {
    if (!this.playing) return;
    this.seek(this.t + (Math.max(now - this.last, 0) / 1000) * this.speed);
    this.last = now;
    if (this.t >= this.end) this.pause();
    else requestAnimationFrame((next) => this.frame(next));
  }

  show() {
    /** @type {ReplayedTool[]} */
    const tools = [];
    if (this.main) tools.push(toolOf(this.main, this.t, false));
    if (this.main && this.ghost) tools.push(toolOf(this.ghost, this.t, true));
    replay.show(tools);
    this.dispatchEvent(new Event("change"));
  }

  /** Nothing is shown any more, as after the tab was left. */
  hide() {
    this.pause();
    replay.show([]);
  }
}

/**
 * @param {Loaded} loaded
 * @param {number} t
 * @param {boolean} ghost
 * @returns {ReplayedTool}
 */
function toolOf({ run, series }, t, ghost) {
  return { key: run.id, plan: run.plan_id, ghost, ...PLACED[drivenOf(series)](series, t) };
}

/** Where what was driven is at a time, by what it is. @type {Record<string, (series: any, t: number) => Omit<ReplayedTool, "key" | "plan" | "ghost">>} */
const PLACED = {
  tool: (/** @type {SeriesPublic} */ series, t) => ({ segments: segmentsAt(series, t), side: sideAt(series, t), radii: series.radii_mm, way: /** @type {Triple[]} */ (series.tip) }),
  lumen: (/** @type {LumenSeriesPublic} */ series, t) => {
    const { segments, camera, forces } = robotAt(series, t);
    return { segments, side: camera.side, camera, forces, radii: segments.map(() => series.radius_mm), way: series.chain_mm.map((joints) => joints[joints.length - 1]) };
  },
};
