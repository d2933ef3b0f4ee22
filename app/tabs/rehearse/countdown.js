// 3, 2, 1 before the tool is let go, from when it stands at the entry on: whoever drives has the hand on it by then.
// Escape and Pause call it off.
import { assignment } from "/static/js/assignments.js";
import { h } from "/static/js/dom.js";
import { keep, recall } from "/static/js/remember.js";

const FROM = 3;
const SECOND_MS = 1000;

export class Countdown {
  /** @param {() => void} changed it begins, counts or ends */
  constructor(changed) {
    this.changed = changed;
    this.left = 0; // s; 0: it does not count
    /** @type {(() => void) | null} what is counted for once the tool stands, which is on its way */
    this.placed = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
    this.number = h("span", { class: "countdown", role: "timer", "aria-live": "assertive", hidden: true });
    /** @type {HTMLInputElement} */
    this.box = h("input", { type: "checkbox", id: "countdown", checked: recall("countdown", ["on", "off"], "off") === "on", onchange: () => keep("countdown", this.box.checked ? "on" : "off") });
    this.element = h("label", { class: "check", title: "3, 2, 1 before the tool moves" }, this.box, "Count down");
  }

  get counting() {
    return this.left > 0;
  }

  /** Whether one is wanted, in this browser or by the assignment. */
  get wanted() {
    return this.box.checked || Boolean(assignment.open?.countdown);
  }

  /** Do it after the countdown, or at once where none is wanted. @param {() => void} done */
  before(done) {
    this.cancel();
    if (!this.wanted) {
      done();
      return;
    }
    const count = (/** @type {number} */ left) => {
      this.left = left;
      this.show();
      if (left) this.timer = setTimeout(() => count(left - 1), SECOND_MS);
      else done();
    };
    count(FROM);
  }

  /** Count once the tool stands at the entry, see `follow`. @param {() => void} done */
  whenPlaced(done) {
    this.cancel();
    this.placed = done;
  }

  /** The tool has come, or does not. @param {string | undefined} state of the drive */
  follow(state) {
    const done = this.placed;
    if (!done || state === "starting") return;
    this.placed = null;
    if (state === "ready") this.before(done);
  }

  /** Call it off. Returns whether it counted, or was going to. */
  cancel() {
    const placed = this.placed !== null;
    this.placed = null;
    if (!this.counting) return placed;
    clearTimeout(this.timer);
    this.left = 0;
    this.show();
    return true;
  }

  show() {
    this.number.hidden = !this.left;
    this.number.textContent = this.left ? String(this.left) : "";
    this.changed();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    return event.key === "Escape" && this.cancel();
  }
}
