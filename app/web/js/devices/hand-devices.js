// The device that a person drives with: chosen once, read once a frame while this window holds the handle, and sent as rates.
import { keep, recall } from "../remember.js";
import { LET_GO } from "../keys.js";
import { GamepadSource } from "./gamepad.js";
import { RateChannel } from "./rate-channel.js";
import { REST, atRest } from "./six-axes.js";
import { SpaceMouseSource } from "./space-mouse.js";

/** @import { Keys } from "../keys.js" */
/** @import { SixAxes } from "./six-axes.js" */

/** Mouse and keys are heard wherever they are; the others are read. @typedef {"mouse" | "keys" | "gamepad" | "space-mouse"} DeviceKind */

/** @type {readonly DeviceKind[]} */
export const DEVICES = ["mouse", "keys", "gamepad", "space-mouse"];

const SLOW_MS = 50;

/** Says `change` when another device is chosen, or one comes or goes, and `axes` with each frame in which it was read. */
export class HandDevices extends EventTarget {
  /**
   * @param {Pick<Keys, "hold">} keys
   * @param {(axes: SixAxes) => void} send
   * @param {object} browser
   */
  constructor(keys, send, browser = navigator) {
    super();
    this.gamepad = new GamepadSource(browser);
    this.spaceMouse = new SpaceMouseSource(browser);
    this.channel = new RateChannel(send, (on) => keys.hold("device", on));
    /** @type {DeviceKind} */
    this.kind = "mouse";
    /** @type {SixAxes} */
    this.axes = [...REST];
    this.watched = false; // this window holds the handle
    this.drives = false; // and its robot runs
    this.asked = false; // for the next frame
    for (const source of [this.gamepad, this.spaceMouse]) source.addEventListener("change", () => this.changed());
    window.addEventListener(LET_GO, () => this.letGo());
    this.choose(/** @type {DeviceKind} */ (recall("device", DEVICES, "mouse")));
  }

  /** What is read; null where nothing is. */
  get source() {
    return this.kind === "gamepad" ? this.gamepad : this.kind === "space-mouse" ? this.spaceMouse : null;
  }

  /** Whether what is chosen has to come to rest before it drives. */
  get isAskew() {
    return this.drives && !this.channel.armed && !atRest(this.axes);
  }

  /** Whether the hand may be at another window or program, which the same device drives. */
  get isAway() {
    return document.hidden || !document.hasFocus();
  }

  /** @param {DeviceKind} kind */
  choose(kind) {
    this.channel.letGo();
    this.source?.stop();
    this.kind = kind;
    this.axes = [...REST];
    keep("device", kind);
    this.source?.start();
    this.changed();
  }

  /**
   * @param {boolean} watched whether this window holds the handle
   * @param {boolean} drives whether its robot runs too
   */
  follow(watched, drives) {
    if (this.drives && !drives) this.channel.letGo();
    this.watched = watched;
    this.drives = drives;
    this.ask();
  }

  /** What is held is let go of, and has to come to rest before it drives again. */
  letGo() {
    this.channel.letGo();
  }

  /** One came or went: at once, whenever the next frame is. */
  changed() {
    this.read();
    this.dispatchEvent(new Event("change"));
    this.ask();
  }

  ask() {
    if (this.asked || !this.watched || !this.source) return;
    this.asked = true;
    let done = false;
    const go = () => {
      if (done) return;
      done = true;
      this.asked = false;
      if (this.watched) this.read();
      this.ask();
    };
    requestAnimationFrame(go);
    if (this.channel.held) setTimeout(go, SLOW_MS); // frames of a busy page are too far apart for a hand
  }

  read() {
    const now = performance.now();
    this.axes = this.source?.read(now) ?? [...REST];
    if (this.isAway) this.channel.letGo();
    else if (this.drives) this.channel.set(this.axes, now);
    this.dispatchEvent(new Event("axes"));
  }
}
