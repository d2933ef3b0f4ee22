// Window and level: changed here at once, and sent to the planner, which draws the slices in the 3D view.
/** @import { Connection } from "../connection.js" */
/** @import { SlicesSection } from "../types.js" */
/** @import { Greys, Threshold } from "./shade.js" */

/** @typedef {{ name: string, label: string, window: number, level: number }} Preset HU */

/** @type {Preset[]} */
export const PRESETS = [
  { name: "bone", label: "Bone", window: 2500, level: 600 },
  { name: "sinus", label: "Sinus and air", window: 2000, level: -200 },
  { name: "soft", label: "Soft tissue", window: 400, level: 40 },
];
export const OWN = "own"; // the name of what was dragged to
export const SCANNER = "scanner"; // of what the files of the CT suggest
const WINDOW = [1, 10_000]; // what the planner takes
const LEVEL = [-2000, 4000];
const COLLECT_MS = 80;

/** Says `change`. */
export class GreyValues extends EventTarget {
  /** @param {Connection} connection */
  constructor(connection) {
    super();
    this.connection = connection;
    this.name = "sinus";
    this.window = 2000;
    this.level = -200;
    /** @type {Threshold | null} tinted in the slices */
    this.threshold = null;
    this.known = "";
    /** @type {string[]} what the planner was told and has not answered, oldest first */
    this.sent = [];
    /** @type {ReturnType<typeof setTimeout> | null} */
    this.timer = null;
  }

  /** @returns {Greys} */
  get values() {
    return { window: this.window, level: this.level, threshold: this.threshold };
  }

  /** @param {SlicesSection} slices */
  heard({ window_name: name, window, level }) {
    const key = `${name} ${window} ${level}`;
    if (key === this.known) return;
    this.known = key;
    const index = this.sent.indexOf(key);
    this.sent = index < 0 ? [] : this.sent.slice(index + 1);
    if (index >= 0 || this.timer) return; // shown already
    Object.assign(this, { name, window, level });
    this.dispatchEvent(new Event("change"));
  }

  /**
   * @param {string} name
   * @param {number} window
   * @param {number} level
   */
  set(name, window, level) {
    const within = (/** @type {number} */ value, /** @type {number[]} */ [low, high]) => Math.round(Math.min(high, Math.max(low, value)));
    Object.assign(this, { name, window: within(window, WINDOW), level: within(level, LEVEL) });
    this.dispatchEvent(new Event("change"));
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.sent.push(`${this.name} ${this.window} ${this.level}`);
      this.connection.send("slice.window", { name: this.name, window: this.window, level: this.level });
    }, COLLECT_MS);
  }

  /**
   * A drag: to the right widens the window, upwards lowers the level, which brightens.
   * @param {number} dx CSS pixels
   * @param {number} dy
   */
  drag(dx, dy) {
    const speed = Math.max(1, this.window / 250); // a narrow window is set finely
    this.set(OWN, this.window + dx * speed, this.level + dy * speed);
  }

  /** @param {Threshold | null} threshold HU */
  tint(threshold) {
    this.threshold = threshold;
    this.dispatchEvent(new Event("change"));
  }

  /** After a reconnect nothing that was sent before is answered. */
  forget() {
    this.sent = [];
  }
}
