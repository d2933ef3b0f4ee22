// A button that records the tracked pointer from a first press to a second one.
import { h } from "/static/js/dom.js";

/** @import { TrackerView } from "/static/js/types.js" */

const MOST_S = 290; // the planner keeps 300

export class RecordButton {
  /**
   * @param {string} id
   * @param {string} words on it before it is pressed
   * @param {(seconds: number) => unknown} recorded called with how long it took
   */
  constructor(id, words, recorded) {
    this.words = words;
    this.recorded = recorded;
    /** @type {number | null} */
    this.began = null;
    this.timer = 0;
    this.element = h("button", { type: "button", class: "wide", id, onclick: () => (this.began === null ? this.start() : this.stop()) }, words);
  }

  get records() {
    return this.began !== null;
  }

  /**
   * @param {TrackerView | null} pointer
   * @param {boolean} free whether something may be recorded
   */
  update(pointer, free) {
    this.element.hidden = !pointer;
    this.element.disabled = !this.records && (!free || pointer?.state !== "fresh");
    this.element.title = pointer ? `Pointer: ${pointer.words}` : "";
  }

  start() {
    this.began = performance.now();
    this.timer = window.setInterval(() => this.tell(), 500);
    this.tell();
  }

  tell() {
    const seconds = this.began === null ? 0 : (performance.now() - this.began) / 1000;
    this.element.textContent = this.began === null ? this.words : `Stop (${seconds.toFixed(0)} s)`;
    this.element.classList.toggle("primary", this.records);
    if (seconds > MOST_S) this.stop();
  }

  stop() {
    if (this.began === null) return;
    const seconds = (performance.now() - this.began) / 1000;
    window.clearInterval(this.timer);
    this.began = null;
    this.tell();
    this.recorded(seconds);
  }
}
