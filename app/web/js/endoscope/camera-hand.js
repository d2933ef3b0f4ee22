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
const ARRIVED_MM = 1e-3; // of the camera: much less than a pixel
const STUCK_MS = 1500; // held for so long, what is left is forgotten

/** right, down: mm that the camera is still to go. depth: mm along the lumen where the tip is to be, null for anywhere. @typedef {{ right: number, down: number, depth: number | null }} Owed */

/** From −1 to 1. @typedef {{ camera_x: number, camera_y: number, insert: number }} Axes */
/** @type {Axes} */
const REST = { camera_x: 0, camera_y: 0, insert: 0 };

/**
 * What is owed as axes, and without a depth that is reached.
 * @param {Owed} owed
 * @param {{ depth: number, insertion: number, camera: number, seconds: number }} now speeds of full axes, mm/s; seconds that the axes will last
 * @returns {{ axes: Axes, owed: Owed }}
 */
export function axesOf({ right, down, depth }, { depth: here, insertion, camera, seconds }) {
  const way = Math.hypot(right, down), most = Math.max(camera * seconds, way), [x, y] = way > ARRIVED_MM ? [right / most, down / most] : [0, 0];
  const left = depth === null ? 0 : depth - here;
  const insert = Math.abs(left) < REACHED_MM ? 0 : Math.max(-1, Math.min(1, left / Math.max(NEAR_MM, 0.05 * insertion)));
  return { axes: { camera_x: x, camera_y: y, insert }, owed: { right, down, depth: insert === 0 ? null : depth } };
}

/**
 * What is still owed once axes have lasted so long; beyond what was owed it is to go back.
 * @param {Owed} owed
 * @param {Axes} axes
 * @param {number} camera mm/s of a full axis
 * @param {number} seconds
 * @returns {Owed}
 */
export function stillOwed({ right, down, depth }, { camera_x: x, camera_y: y }, camera, seconds) {
  return { right: right - x * camera * seconds, down: down - y * camera * seconds, depth };
}

export class CameraHand {
  /**
   * @param {HTMLElement} pane the picture and the black around it: a hand may begin on either
   * @param {HTMLElement} picture
   * @param {Connection} connection
   * @param {Keys} keys
   */
  constructor(pane, picture, connection, keys) {
    this.pane = pane;
    this.picture = picture;
    this.connection = connection;
    this.keys = keys;
    this.on = false; // the picture is of a camera that is driven
    this.dragging = false;
    /** @type {Owed} */
    this.owed = { right: 0, down: 0, depth: null };
    this.said = { axes: REST, at: 0 }; // the last message, and when
    this.lasts = EVERY_MS / 1000; // seconds between messages: the timer of a busy page is late
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this.timer = undefined;
    this.nearer = { left: Infinity, at: 0 };
    pane.addEventListener("pointerdown", (event) => this.press(event));
    pane.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) pane.addEventListener(end, () => this.release());
    pane.addEventListener("wheel", (event) => this.turn(event), { passive: false });
    window.addEventListener(LET_GO, () => this.stop());
  }

  /**
   * @param {ViewModel} state
   * @param {boolean} on
   */
  follow(state, on) {
    if (this.on && !(on && drives(state))) this.stop();
    this.on = on;
    this.pane.classList.toggle("scope-hand", on);
  }

  get ready() {
    return this.on && drives(this.connection.state);
  }

  /** @param {PointerEvent} event */
  press(event) {
    if (!this.ready || event.button !== 0 || (event.target !== this.picture && event.target !== this.pane)) return; // what lies over them is pressed itself
    if (event.target === this.pane) this.pane.setPointerCapture(event.pointerId); // the picture captures its own
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
    this.owed = { ...this.owed, right: 0, down: 0 };
    this.say();
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
    if (this.timer !== undefined) return;
    this.keys.hold("scope", true);
    this.said = { axes: REST, at: performance.now() };
    this.lasts = EVERY_MS / 1000;
    this.timer = setInterval(() => this.tell(), EVERY_MS);
  }

  /** What was moved since the last message is owed no more. */
  tell() {
    const seconds = (performance.now() - this.said.at) / 1000;
    this.owed = stillOwed(this.owed, this.said.axes, this.connection.state.snake?.camera_mm_per_s ?? 0, seconds);
    this.lasts = Math.max(EVERY_MS / 1000, seconds);
    this.say();
  }

  /** Send what is owed as speeds, and rest once nothing is. */
  say() {
    const { snake } = this.connection.state;
    if (!this.ready || !snake) {
      this.stop();
      return;
    }
    this.forgetIfStuck(snake.depth_mm);
    const now = { depth: snake.depth_mm, insertion: snake.insertion_mm_per_s, camera: snake.camera_mm_per_s, seconds: this.lasts };
    const { axes, owed } = axesOf(this.owed, now);
    this.owed = owed;
    this.send(axes);
    if (!moves(axes) && !this.dragging) this.rest();
  }

  /** @param {Axes} axes beside those of keys and devices, which are added on the server */
  send(axes) {
    if (moves(axes) || moves(this.said.axes)) this.connection.send("axes", { hand: "picture", ...axes });
    this.said = { axes, at: performance.now() };
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
    this.send(REST);
    if (this.timer !== undefined) this.rest();
  }
}

/** @param {Axes} axes */
function moves(axes) {
  return Object.values(axes).some((axis) => axis !== 0);
}

/** @param {ViewModel} state */
function drives({ rehearsal }) {
  return rehearsal?.state === "running" && Boolean(rehearsal.mine);
}
