// 3, 2, 1 before the tool is let go: whoever drives has the hand on it by then. Escape and Pause call it off.
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

  /** Call it off. Returns whether it counted. */
  cancel() {
    if (!this.counting) return false;
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
