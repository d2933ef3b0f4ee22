// A hand in the picture of a camera that is driven. A drag says how far the camera is to go, and a wheel where the tip is to be;
// the control process makes up for what is left of that while the hand holds: on a busy machine too it arrives.
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
const AGAIN_MS = 80; // what is held is told again: of heartbeats that were missing it takes hold anew
const REACHED_MM = 0.15;
const STUCK_MS = 1500; // held for so long, what is left is forgotten

/** A press on the picture: its pointer, where that was pressed, and the camera's way since, mm. @typedef {{ pointer: number, x: number, y: number, right: number, down: number }} Drag */

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
    /** @type {Drag | null} */
    this.dragged = null;
    /** @type {number | null} mm along the lumen where the wheel wants the tip, null for anywhere */
    this.depth = null;
    /** @type {Map<string, { as: string, at: number }>} what was told last of each message, and when */
    this.told = new Map();
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this.timer = undefined;
    this.nearer = { left: Infinity, waited: 0, at: 0 }; // mm that were left last, and for how many ms it came no nearer
    pane.addEventListener("pointerdown", (event) => this.press(event));
    pane.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) pane.addEventListener(end, ({ pointerId }) => { if (pointerId === this.dragged?.pointer) this.release(); });
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
    this.dragged = { pointer: event.pointerId, x: event.clientX, y: event.clientY, right: 0, down: 0 };
    this.say("camera.drag", wayOf(this.dragged), true);
    this.begin();
  }

  /**
   * By where the pointer is, not by how far it moved: a busy page hears of few of its moves.
   * @param {PointerEvent} event
   */
  drag({ pointerId, clientX, clientY }) {
    const { dragged } = this;
    if (!dragged || dragged.pointer !== pointerId) return;
    const scale = (MM_PER_PX * USUAL_PX) / Math.max(1, this.picture.clientWidth);
    dragged.right = (dragged.x - clientX) * scale; // what was grasped comes along: the camera goes the other way
    dragged.down = (dragged.y - clientY) * scale;
  }

  /** Letting go is the clutch: nothing of the drag is left. */
  release() {
    const { dragged } = this;
    if (!dragged) return;
    this.dragged = null;
    this.say("camera.drag", wayOf(dragged), false);
    if (this.depth === null) this.rest();
  }

  /** @param {WheelEvent} event */
  turn(event) {
    if (!this.on) return;
    event.preventDefault();
    if (!this.ready) return;
    const notches = event.deltaMode === 0 ? event.deltaY / NOTCH_PX : Math.sign(event.deltaY);
    const { depth_mm: here = 0, length_mm: length = 0, fixed = false } = this.connection.state.snake ?? {};
    if (fixed) return; // nothing is inserted
    const wanted = (this.depth ?? here) - NOTCH_MM * notches;
    this.depth = Math.max(0, Math.min(length, Math.max(here - MOST_LEFT_MM, Math.min(here + MOST_LEFT_MM, wanted))));
    this.nearer = { left: Infinity, waited: 0, at: performance.now() };
    this.say("insert.to", { depth_mm: this.depth }, true);
    this.begin();
  }

  begin() {
    if (this.timer !== undefined) return;
    this.keys.hold("scope", true);
    this.timer = setInterval(() => this.tell(), EVERY_MS);
  }

  /** Tell the way of the drag and the depth of the wheel, where they are others or were not told for long. */
  tell() {
    const { snake } = this.connection.state;
    if (!this.ready || !snake) {
      this.stop();
      return;
    }
    const { dragged, depth } = this;
    if (dragged) this.say("camera.drag", wayOf(dragged), true);
    if (depth !== null && (Math.abs(depth - snake.depth_mm) < REACHED_MM || this.stuck(depth, snake.depth_mm))) this.forgetDepth();
    else if (depth !== null) this.say("insert.to", { depth_mm: depth }, true);
    if (this.depth === null && !dragged) this.rest();
  }

  /**
   * Tell a place that is held, where it is another or was not told for long, and at once that it is not held any more.
   * @param {"camera.drag" | "insert.to"} type
   * @param {{ right_mm: number, down_mm: number } | { depth_mm: number }} place
   * @param {boolean} held
   */
  say(type, place, held) {
    const as = JSON.stringify(place), at = performance.now(), last = this.told.get(type);
    if (held && last?.as === as && at - last.at < AGAIN_MS) return;
    if (held) this.told.set(type, { as, at });
    else this.told.delete(type);
    this.connection.send(type, { ...place, held });
  }

  forgetDepth() {
    if (this.depth !== null) this.say("insert.to", { depth_mm: this.depth }, false);
    this.depth = null;
  }

  /**
   * A robot that is held does not come nearer: the wheel is not to go on by itself once it is free. A time in which the
   * page hung does not count: it heard of nothing.
   * @param {number} depth
   * @param {number} here
   */
  stuck(depth, here) {
    const left = Math.abs(depth - here), at = performance.now();
    const waited = this.nearer.waited + Math.min(at - this.nearer.at, AGAIN_MS);
    this.nearer = left < this.nearer.left - 0.05 ? { left, waited: 0, at } : { left: this.nearer.left, waited, at };
    return this.nearer.waited > STUCK_MS;
  }

  rest() {
    if (this.timer === undefined) return;
    clearInterval(this.timer);
    this.timer = undefined;
    this.keys.hold("scope", false);
  }

  stop() {
    this.forgetDepth();
    this.release();
    this.rest();
  }
}

/** @param {Drag} dragged */
function wayOf({ right, down }) {
  return { right_mm: right, down_mm: down };
}

/** @param {ViewModel} state */
function drives({ rehearsal }) {
  return rehearsal?.state === "running" && Boolean(rehearsal.mine);
}
