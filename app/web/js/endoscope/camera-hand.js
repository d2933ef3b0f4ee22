// A hand in the picture of a camera that is driven. A drag says how far the camera is to go, and the control process makes up
// for what is left of that while the hand holds: on a busy machine too it arrives. The wheel says how far to insert, and what
// is sent is how fast: the way that is left decides.
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
const AGAIN_MS = 80; // a drag that is held is told again: of heartbeats that were missing it takes hold anew
const NEAR_MM = 1.5; // from there on the insertion slows down
const REACHED_MM = 0.15;
const STUCK_MS = 1500; // held for so long, what is left is forgotten

/** A press on the picture: its pointer, where that was pressed, and the camera's way since, mm. @typedef {{ pointer: number, x: number, y: number, right: number, down: number }} Drag */

/**
 * The axis that inserts towards a depth, from −1 to 1; 0 once it is reached.
 * @param {number} wanted mm
 * @param {number} here mm
 * @param {number} speed of a full axis, mm/s
 */
export function insertAxis(wanted, here, speed) {
  const left = wanted - here;
  return Math.abs(left) < REACHED_MM ? 0 : Math.max(-1, Math.min(1, left / Math.max(NEAR_MM, 0.05 * speed)));
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
    /** @type {Drag | null} */
    this.dragged = null;
    /** @type {number | null} mm along the lumen where the wheel wants the tip, null for anywhere */
    this.depth = null;
    this.inserts = 0; // the axis that was sent last
    this.saidAt = -Infinity; // of the drag
    this.said = ""; // its way
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this.timer = undefined;
    this.nearer = { left: Infinity, at: 0 };
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
    this.tellDrag(this.dragged);
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
    this.connection.send("camera.drag", { right_mm: dragged.right, down_mm: dragged.down, held: false });
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
    this.nearer = { left: Infinity, at: performance.now() };
    this.begin();
  }

  begin() {
    if (this.timer !== undefined) return;
    this.keys.hold("scope", true);
    this.timer = setInterval(() => this.tell(), EVERY_MS);
  }

  /** Tell the way of the drag, where it is another or was not told for long, and how fast to insert. */
  tell() {
    const { snake } = this.connection.state;
    if (!this.ready || !snake) {
      this.stop();
      return;
    }
    const { dragged } = this;
    if (dragged && (wayOf(dragged) !== this.said || performance.now() - this.saidAt >= AGAIN_MS)) this.tellDrag(dragged);
    this.forgetIfStuck(snake.depth_mm);
    const insert = this.depth === null ? 0 : insertAxis(this.depth, snake.depth_mm, snake.insertion_mm_per_s);
    if (insert === 0) this.depth = null;
    this.insert(insert);
    if (this.depth === null && !dragged) this.rest();
  }

  /** @param {Drag} dragged */
  tellDrag(dragged) {
    this.said = wayOf(dragged);
    this.saidAt = performance.now();
    this.connection.send("camera.drag", { right_mm: dragged.right, down_mm: dragged.down, held: true });
  }

  /** @param {number} insert beside the axes of keys and devices, which are added on the server */
  insert(insert) {
    if (insert || this.inserts) this.connection.send("axes", { hand: "picture", insert });
    this.inserts = insert;
  }

  /**
   * A robot that is held does not come nearer: the wheel is not to go on by itself once it is free.
   * @param {number} here
   */
  forgetIfStuck(here) {
    if (this.depth === null) return;
    const left = Math.abs(this.depth - here), at = performance.now();
    if (left < this.nearer.left - 0.05) this.nearer = { left, at };
    else if (at - this.nearer.at > STUCK_MS) this.depth = null;
  }

  rest() {
    if (this.timer === undefined) return;
    clearInterval(this.timer);
    this.timer = undefined;
    this.keys.hold("scope", false);
  }

  stop() {
    this.depth = null;
    this.release();
    this.insert(0);
    this.rest();
  }
}

/** @param {Drag} dragged */
function wayOf({ right, down }) {
  return `${right} ${down}`;
}

/** @param {ViewModel} state */
function drives({ rehearsal }) {
  return rehearsal?.state === "running" && Boolean(rehearsal.mine);
}
