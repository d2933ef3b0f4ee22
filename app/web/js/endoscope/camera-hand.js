// A hand in the picture of a camera that is driven: a drag moves the camera in its image plane, the wheel inserts.
// Both say how far, and what is sent is how fast: the way that is left decides, and letting go ends it.
import { LET_GO } from "../keys.js";

/** @import { Connection } from "../connection.js" */
/** @import { Keys } from "../keys.js" */
/** @import { ViewModel } from "../types.js" */

/** A pixel of a picture of USUAL_PX keeps a wall 20 mm away under the pointer. */
export const MM_PER_PX = 0.03;
const USUAL_PX = 480;
export const NOTCH_MM = 5;
const NOTCH_PX = 100; // of a wheel that scrolls by pixels
const MOST_LEFT_MM = 60; // of insertion that is owed: a wheel that was spun
const EVERY_MS = 20;
const NEAR_MM = 1.5; // from there on the insertion slows down
const REACHED_MM = 0.15;
const STUCK_MS = 700; // held for so long, what is left is forgotten

/** right, down: mm that the camera is still to go. depth: mm along the lumen where the tip is to be, null for anywhere. @typedef {{ right: number, down: number, depth: number | null }} Owed */

/**
 * What is owed as axes from −1 to 1, and what is owed after them.
 * @param {Owed} owed
 * @param {{ depth: number, insertion: number, camera: number, seconds: number }} now speeds of full axes, mm/s; seconds until the next
 * @returns {{ axes: { camera_x: number, camera_y: number, insert: number }, owed: Owed }}
 */
export function axesOf({ right, down, depth }, { depth: here, insertion, camera, seconds }) {
  const most = camera * seconds, way = Math.hypot(right, down);
  const share = way > 1e-9 ? Math.min(1, most / way) : 0;
  const step = [right * share, down * share];
  const left = depth === null ? 0 : depth - here;
  const insert = Math.abs(left) < REACHED_MM ? 0 : Math.max(-1, Math.min(1, left / Math.max(NEAR_MM, 0.05 * insertion)));
  return {
    axes: { camera_x: step[0] / most, camera_y: step[1] / most, insert },
    owed: { right: right - step[0], down: down - step[1], depth: insert === 0 ? null : depth },
  };
}

export class CameraHand {
  /**
   * @param {HTMLElement} picture
   * @param {Connection} connection
   * @param {Keys} keys
   */
  constructor(picture, connection, keys) {
    this.picture = picture;
    this.connection = connection;
    this.keys = keys;
    this.on = false; // the picture is of a camera that is driven
    this.dragging = false;
    /** @type {Owed} */
    this.owed = { right: 0, down: 0, depth: null };
    this.moving = false; // axes were sent that are not 0
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this.timer = undefined;
    this.nearer = { left: Infinity, at: 0 };
    picture.addEventListener("pointerdown", (event) => this.press(event));
    picture.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) picture.addEventListener(end, () => this.release());
    picture.addEventListener("wheel", (event) => this.turn(event), { passive: false });
    window.addEventListener(LET_GO, () => this.stop());
  }

  /**
   * @param {ViewModel} state
   * @param {boolean} on
   */
  follow(state, on) {
    if (this.on && !(on && drives(state))) this.stop();
    this.on = on;
    this.picture.classList.toggle("scope-hand", on);
  }

  get ready() {
    return this.on && drives(this.connection.state);
  }

  /** @param {PointerEvent} event */
  press(event) {
    if (!this.ready || event.button !== 0) return;
    this.dragging = true;
    this.begin();
  }

  /** @param {PointerEvent} event */
  drag({ movementX, movementY }) {
    if (!this.dragging || !this.ready) return;
    const scale = (MM_PER_PX * USUAL_PX) / Math.max(1, this.picture.clientWidth);
    this.owed.right -= movementX * scale; // what was grasped comes along: the camera goes the other way
    this.owed.down -= movementY * scale;
    this.begin();
  }

  /** Letting go is the clutch: nothing of the drag is left. */
  release() {
    if (!this.dragging) return;
    this.dragging = false;
    this.owed.right = this.owed.down = 0;
    this.tell();
  }

  /** @param {WheelEvent} event */
  turn(event) {
    if (!this.on) return;
    event.preventDefault();
    if (!this.ready) return;
    const notches = event.deltaMode === 0 ? event.deltaY / NOTCH_PX : Math.sign(event.deltaY);
    const { depth_mm: here = 0, length_mm: length = 0, fixed = false } = this.connection.state.snake ?? {};
    if (fixed) return; // nothing is inserted
    const wanted = (this.owed.depth ?? here) - NOTCH_MM * notches;
    this.owed.depth = Math.max(0, Math.min(length, Math.max(here - MOST_LEFT_MM, Math.min(here + MOST_LEFT_MM, wanted))));
    this.nearer = { left: Infinity, at: performance.now() };
    this.begin();
  }

  begin() {
    this.keys.hold("scope", true);
    this.timer ??= setInterval(() => this.tell(), EVERY_MS);
  }

  /** Send what is owed as speeds, and rest once nothing is. */
  tell() {
    const { snake } = this.connection.state;
    if (!this.ready || !snake) {
      this.stop();
      return;
    }
    this.forgetIfStuck(snake.depth_mm);
    const now = { depth: snake.depth_mm, insertion: snake.insertion_mm_per_s, camera: snake.camera_mm_per_s, seconds: EVERY_MS / 1000 };
    const { axes, owed } = axesOf(this.owed, now);
    this.owed = owed;
    const moves = Object.values(axes).some((axis) => axis !== 0);
    if (moves || this.moving) this.connection.send("axes", axes);
    this.moving = moves;
    if (!moves && !this.dragging) this.rest();
  }

  /**
   * A robot that is held does not come nearer: the wheel is not to go on by itself once it is free.
   * @param {number} here
   */
  forgetIfStuck(here) {
    if (this.owed.depth === null) return;
    const left = Math.abs(this.owed.depth - here), at = performance.now();
    if (left < this.nearer.left - 0.05) this.nearer = { left, at };
    else if (at - this.nearer.at > STUCK_MS) this.owed.depth = null;
  }

  rest() {
    clearInterval(this.timer);
    this.timer = undefined;
    this.keys.hold("scope", false);
  }

  stop() {
    this.dragging = false;
    this.owed = { right: 0, down: 0, depth: null };
    if (this.moving) this.connection.send("axes", { camera_x: 0, camera_y: 0, insert: 0 });
    this.moving = false;
    if (this.timer !== undefined) this.rest();
  }
}

/** @param {ViewModel} state */
function drives({ rehearsal }) {
  return rehearsal?.state === "running" && Boolean(rehearsal.mine);
}
